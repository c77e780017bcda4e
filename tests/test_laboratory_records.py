"""A quick part of docs/records.md: a formula in the solver's place, and the records that need no long pre-trigger."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.histories import Histories
from birdstrike.doe.campaign.results import load_dataset
from birdstrike.inversion.results.estimates import Estimate
from tests.inversion import small_campaign
from tests.laboratory_records import CENTRE, CUTOFF, KINDS, VISCOSITY, Bench, Kind, ended

QUICK = (
    "German logger: semicolons, decimal commas, a line of units, NaN",
    "noise 0.05 mm where the case states 0.02",
    "offset of 1.2 mm, pre-trigger",
    "clipped at 4 mm",
    "overload written as OVL",
    "wrong sign",
    "trigger 0.5 ms late",
    "dead sensor: zeros",
    "cable broken at 1.7 ms",
    "volts, times of day, UTF-16",
    "units in a second row, a constant channel, text, a summary behind",
    "number of the sample, the rate in the head",
    "readings alone, with --rate",
    "clock of two digits",
    "seconds since 1970",
    "seconds under the name of milliseconds",
    "flat top with noise on it",
    "12 levels of 0.5 mm",
    "one sample in twenty lost",
    "converter that overflows at 4 mm",
    "oscilloscope: infinity beyond the range, volts",
    "whole micrometres, points for thousands",
    "date, AM, mils",
    "drift of 0.1 mm/ms, no pre-trigger",
)


def forward(theta: Mapping[str, float]) -> Histories:
    """The formula of the small campaign."""
    curve = small_campaign.curve(theta[VISCOSITY], theta[CUTOFF])
    return Histories(small_campaign.TIME, {CENTRE: curve}, {CENTRE: "m"})


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    folder = tmp_path_factory.mktemp("laboratory")
    small_campaign.build(folder)
    return Bench(load_dataset(folder), forward)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind.name in QUICK], ids=lambda kind: kind.name)
def test_a_laboratory_record_ends_in_the_truth_or_in_the_right_word(bench: Bench, kind: Kind, tmp_path: Path) -> None:
    found = ended(bench, kind, tmp_path, seed=3)
    assert kind.word in found.words, found.words
    assert found.identified == kind.answer, found.words
    assert not found.missed, (found.truth, found.estimate)


def test_the_quick_part_is_a_part() -> None:
    assert len(QUICK) == sum(kind.name in QUICK for kind in KINDS)
    assert len(KINDS) >= 20


def test_the_cables_break_leaves_the_viscosity_known(bench: Bench, tmp_path: Path) -> None:
    """Guards the table's criterion: an answer is a narrow interval, not the whole range."""
    (kind,) = (kind for kind in KINDS if kind.name == "cable broken at 1.7 ms")
    estimate = ended(bench, kind, tmp_path, seed=4).estimate
    assert isinstance(estimate, Estimate)
    assert estimate.interval_95 is not None
    assert np.ptp(estimate.interval_95) < 300.0
