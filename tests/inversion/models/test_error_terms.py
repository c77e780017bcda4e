"""The discrepancy of a bird model: nothing before a shot's own contact, the stated share of the peak after it."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.inversion.models.error_terms import Discrepancy
from birdstrike.inversion.observations.observations import Channel, Observations


def channel(name: str, peak: float) -> Channel:
    time = np.linspace(0.0, 3e-3, 61)
    return Channel(name, "m", time, peak * np.sin(np.pi * time / time[-1]), np.full(61, 1e-5), "stated")


def test_each_shot_errs_from_its_own_contact() -> None:
    contacts, share = (0.2e-3, 1.0e-3), 0.02
    seen = Observations((channel("w", 0.010), channel("w@2", 0.004)))
    sigma = np.sqrt((Discrepancy(contacts, 3e-3).columns(seen, share) ** 2).sum(axis=1))
    for part, contact, peak, one in zip(np.split(sigma, 2), contacts, (0.010, 0.004), seen.channels, strict=True):
        before = one.times <= contact
        assert np.allclose(part[before], 0.0, atol=1e-4 * share * peak)
        assert part[one.times > contact + 1e-3] == pytest.approx(share * peak, rel=0.05)


def test_a_part_of_the_shots_keeps_its_contacts() -> None:
    both = Discrepancy((0.2e-3, 1.0e-3), 3e-3)
    second = Observations((channel("w", 0.004),))
    assert np.array_equal(both.only([1]).columns(second, 0.02), Discrepancy((1.0e-3,), 3e-3).columns(second, 0.02))
