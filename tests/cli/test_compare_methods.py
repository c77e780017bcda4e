"""`birdstrike compare-methods`: which channel the noise is stated in, and what is refused before any work."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from birdstrike.cli import compare_methods as command
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import UserError
from birdstrike.inversion import method_comparison
from birdstrike.inversion.identifiability.coverage import Coverage
from birdstrike.inversion.method_comparison import KnownCase, conditions, score_methods
from birdstrike.surrogate.inverse_network import NetworkFit, fit_network
from tests.inversion.stand_in import CHANNEL, NAMES, campaign, forward, spread, truth


@pytest.fixture(scope="module")
def force_first() -> Dataset:
    made = campaign(spread(5))
    units = {"contact_force": "N", CHANNEL: "m"}
    return replace(made, curves={name: made.curves[name] for name in units}, channel_units=units)


def test_noise_is_stated_in_mm_of_a_displacement(force_first: Dataset) -> None:
    assert list(force_first.curves) == ["contact_force", CHANNEL]
    assert command.displacement_first("rig", force_first) == (CHANNEL, "contact_force")


def test_a_campaign_without_a_displacement_is_refused(force_first: Dataset) -> None:
    force = {"contact_force": force_first.curves["contact_force"]}
    with pytest.raises(UserError, match="sensors of rig: contact_force: none is a displacement"):
        command.displacement_first("rig", replace(force_first, curves=force, channel_units={"contact_force": "N"}))


def test_nothing_to_compare_is_refused_before_the_work(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="leave nothing to compare"):
        command.compare_methods("nowhere", tmp_path / "out", truths=0, solver_truths=0, table=False)
    assert not (tmp_path / "out").exists()


def test_one_channel_is_compared_once() -> None:
    assert len(conditions((CHANNEL,))) == 6
    assert len(conditions((CHANNEL, "contact_force"))) == 12


def test_parameters_of_one_last_name_are_told_apart() -> None:
    both: dict[str, float] = {"bird.density": 0.5, "plate.material.density": 0.5}
    text = command.markdown((), {"noise": [Coverage("solver", 1, both, {**both}, both, both, both, both, 0)]})
    rows = [line.split("|")[1].strip() for line in text.splitlines() if line.startswith("| ")][1:]
    assert len(set(rows)) == 2, rows


def test_errors_are_shares_of_a_range_in_its_scale_as_their_bounds_are() -> None:
    """A third of the true damping, over a logarithmic range from 0.05 to 0.25."""
    runs = replace(campaign(spread(12)), scales=("linear", "linear", "logarithmic", "linear"))
    right = truth(0.6)
    bench = KnownCase.of(runs, forward, dict(zip(NAMES, map(float, right), strict=True)), (CHANNEL,))
    condition, off = conditions((CHANNEL,))[0], np.array([1.0, 1.0, 1.0 / 3.0, 1.0])
    row = method_comparison._row(bench, condition, bench.record(condition), "own", right * off, 0, 0.0, None)
    assert row.errors == pytest.approx(dict(zip(NAMES, (0.0, 0.0, np.log(3.0) / np.log(5.0), 0.0), strict=True)))


def test_networks_are_trained_as_train_and_invert_trains_them(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = KnownCase.of(
        campaign(spread(25)), forward, dict(zip(NAMES, map(float, truth(0.6)), strict=True)), (CHANNEL,)
    )
    copies = dict[str, int]()

    def watched(*args: Any, **kwargs: Any) -> NetworkFit:
        copies[args[2]] = kwargs["copies"]
        return fit_network(*args, **kwargs)

    monkeypatch.setattr(method_comparison, "fit_network", watched)
    rows = islice(score_methods(bench, (CHANNEL,)), len(method_comparison.TRAINERS))
    assert [row.method for row in rows] == list(method_comparison.TRAINERS)
    assert copies == {"lm": 10, "adam": 10, "br": 10, "ensemble": 0}
