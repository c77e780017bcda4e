"""Several shots of one bird: shared parameters, own clocks, and a scatter between shots that is found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import UserError
from birdstrike.data.histories import Histories
from birdstrike.inversion.estimation.locate import InversionOptions, locate
from birdstrike.inversion.estimation.shots import CampaignShot, joined, with_scatter
from birdstrike.inversion.invert import invert
from tests.inversion.stand_in import CHANNEL, NAMES, TIMES, campaign, forward, record, spread, truth

OPTIONS = InversionOptions(method="emulator", noise={CHANNEL: 4e-5}, time_offset=0.05e-3, sampling=None, analyse=False)
SHARE = (0.4, 0.6, 0.45, 0.5)


@pytest.fixture(scope="module")
def few() -> Dataset:
    """A small campaign: each shot's emulator is fitted several times."""
    return campaign(spread(20))


def harder(theta: Mapping[str, float]) -> Histories:
    """The same bird shot at a higher speed: a larger curve."""
    run = forward(theta)
    return replace(run, channels={name: 1.3 * values for name, values in run.channels.items()})


def shot(dataset: Dataset, seed: int, t0: float = 0.0, size: float = 1.0, fast: bool = False) -> CampaignShot:
    scale = 1.3 if fast else 1.0
    measured = record(truth(SHARE), TIMES, t0=t0)
    noise = 4e-5 * np.random.default_rng(seed).normal(size=len(TIMES))
    measured = replace(measured, channels={CHANNEL: size * scale * measured.channels[CHANNEL] + noise})
    runs = replace(dataset, curves={name: scale * rows for name, rows in dataset.curves.items()})
    return CampaignShot(runs, measured, harder if fast else forward, OPTIONS)


def widths(dataset: Dataset, measured: Measured, run, options: InversionOptions, columns=None) -> np.ndarray:
    found = invert(dataset, measured, run, options, columns=columns).inversion.methods["emulator"].parameters
    for name, share in zip(NAMES[:3], SHARE, strict=False):
        interval = found[name].interval_95
        low, high = truth(0.0)[NAMES.index(name)], truth(1.0)[NAMES.index(name)]
        assert interval is not None
        assert interval[0] < low + share * (high - low) < interval[1]
    return np.array([np.diff(found[name].interval_95 or (np.nan, np.nan))[0] for name in NAMES[:3]])


def test_two_speeds_tell_more_than_one_and_each_has_its_clock(few: Dataset) -> None:
    first, second = shot(few, 1, t0=0.02e-3), shot(few, 2, t0=-0.04e-3, fast=True)
    joint = joined([first, second])
    assert [f.suffix for f in joint.figures] == ["", "@2"]
    assert joint.figures[1].time_offset == pytest.approx(-0.04e-3, abs=8e-6)
    alone = widths(first.dataset, first.measured, forward, OPTIONS)
    both = widths(joint.dataset, joint.measured, joint.forward, joint.options, joint.columns)
    assert (both < alone).all()


@pytest.mark.parametrize("late", [0, 1])
def test_a_late_record_is_fitted_alike_whichever_of_the_shots_it_is(few: Dataset, late: int) -> None:
    """0.1 ms late, two standard deviations of the clock: the others are laid onto the first one's clock."""
    records = [shot(few, i + 1, t0=0.1e-3 if i == late else 0.0) for i in range(2)]
    joint = joined(records)
    found = invert(joint.dataset, joint.measured, joint.forward, joint.options, columns=joint.columns).inversion
    assert found.time_offset.value == pytest.approx(0.1e-3 if late == 0 else 0.0, abs=8e-6)
    widths(joint.dataset, joint.measured, joint.forward, joint.options, joint.columns)  # holds the truth
    score = found.methods["emulator"].channels
    assert all((one.verified_rmse or 1.0) < 1.3 * 4e-5 for one in score.values())


def test_scatter_between_shots_is_found_and_carried(few: Dataset) -> None:
    _, scatter = with_scatter(joined([shot(few, i, size=size) for i, size in enumerate((0.96, 1.05))]))
    assert 0.01 <= scatter <= 0.15
    _, none = with_scatter(joined([shot(few, i) for i in range(2)]))
    assert none <= 0.003


def test_what_is_allowed_for_a_shots_size_holds_none_of_its_noise(few: Dataset) -> None:
    """Else a curve too small by any factor leaves less of the noise than the right one: the size is drawn downwards."""
    joint, scatter = with_scatter(joined([shot(few, i, size=size) for i, size in enumerate((0.96, 1.05))]))
    assert scatter
    assert joint.columns is not None
    found = locate(joint.dataset, joint.measured, OPTIONS, columns=joint.columns)
    mode, seen = found.calibration.modes[0], found.observations
    channels = tuple(replace(c, values=c.values + 1e-3 * np.cos(np.arange(len(c.values)))) for c in seen.channels)
    noisy = replace(seen, channels=channels)
    assert not np.array_equal(noisy.values, seen.values)
    np.testing.assert_array_equal(joint.columns(noisy, mode), joint.columns(seen, mode))


def test_other_points_are_refused_with_the_remedy(dataset: Dataset) -> None:
    other = shot(campaign(spread(40, seed=5)), 2)
    with pytest.raises(UserError, match=r"0 points in common; .*--design FIRST/design\.csv"):
        joined([shot(dataset, 1), other])
    renamed = replace(other, dataset=replace(other.dataset, names=("a", "b", "c", "d")))
    with pytest.raises(UserError, match="different parameters"):
        joined([shot(dataset, 1), renamed])
