"""Data held out: every channel in turn, and another shot, to which nothing is fitted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from birdstrike.inversion.diagnosis.groundwork import Groundwork
from birdstrike.inversion.diagnosis.heldout import HeldOut, channels, expected, hold_out, in_short, other_shot
from birdstrike.inversion.diagnosis.judge import Judge, Judged
from birdstrike.inversion.diagnosis.miss import errors
from birdstrike.inversion.diagnosis.refit import Fit
from birdstrike.inversion.diagnosis.responses import Response, library
from birdstrike.inversion.diagnosis.verdict import NONE
from birdstrike.solver.case.case import load_case
from tests.inversion.diagnosis.toy_study import SIZE, TIME, curves, groundwork, judge

NOISE, LATE = 1e-4, 2e-5
MIDDLE = np.full((1, 2), 0.5)
QUIET = np.exp(-(((TIME - 5e-4) / 3e-4) ** 2))  # a thicker plate's change of the curve, per plausible size


@pytest.fixture(scope="module")
def ground(tmp_path_factory: pytest.TempPathFactory) -> Groundwork:
    """The toy with two nuisances: the trigger, of each shot, and the plate's thickness, of all."""
    place = tmp_path_factory.mktemp("heldout")
    ground = groundwork(place)
    known = (*ground.known, *(one for one in library(ground.case)[0] if one.name in ("time_offset", "plate_thickness")))
    text = (place / "case.toml").read_text()
    (place / "case.toml").write_text(f'{text}\n[inversion.nuisance]\ntime_offset = "{LATE} s"\nthickness = "0.1 mm"\n')
    response = Response(1e-4 * QUIET, np.zeros_like(QUIET), np.zeros((0, len(QUIET))), np.zeros_like(QUIET), 2.0)
    return replace(ground, case=load_case(place / "case.toml"), known=known, responses={"plate_thickness": response})


def shot(ground: Groundwork, late: float, thicker: float, seed: int) -> Judge:
    """A record of the toy: its trigger late, its plate thicker by plausible sizes."""
    (values,) = curves(MIDDLE)
    signal = np.interp(TIME - late, TIME, values[0] + 1e-4 * thicker * QUIET)
    return judge(ground, [signal + NOISE * np.random.default_rng(seed).standard_normal(len(TIME))], NOISE)


def fit(one: Judge) -> Judged:
    return one.judged(NONE, one.start()[0])


def test_another_shot_has_its_own_trigger_and_the_same_plate(ground: Groundwork) -> None:
    first = fit(shot(ground, late=3.0 * LATE, thicker=2.0, seed=0)).fit
    other = shot(ground, 0.0, 2.0, 1)
    moved, spread = expected(first, other.record)
    named = {first.problem.model.known[i].name: v for (i, _), v in zip(first.problem.nuisances, moved.v, strict=True)}
    assert first.v[0] > 1.5
    assert named["time_offset"] == 0.0
    assert named["plate_thickness"] == first.v[1] != 0.0
    change = LATE * np.gradient(moved.curve, TIME)
    inner = np.s_[5:-5, 5:-5]  # the ends have their signal on one side only
    assert np.linalg.norm((spread - np.outer(change, change))[inner]) < 0.1 * np.linalg.norm(spread[inner])


def test_shots_whose_triggers_scatter_as_stated_miss_by_one_on_average(ground: Groundwork) -> None:
    first = shot(ground, late=2.5 * LATE, thicker=0.0, seed=0)
    base = fit(first)
    rng = np.random.default_rng(5)
    others = [shot(ground, LATE * rng.standard_normal(), 0.0, 10 + i) for i in range(25)]
    found = [other_shot(first, base, None, one.record) for one in others]
    assert np.sqrt(np.mean([one.before**2 for one in found])) == pytest.approx(1.0, abs=0.15)
    carried = [_with_the_first_trigger(base.fit, one) for one in others]
    assert np.mean(carried) > 1.5 * np.mean([one.before for one in found])


def _with_the_first_trigger(base: Fit, other: Judge) -> float:
    """What the same figure would be with the first shot's fitted time offset."""
    model = replace(base.problem.model, record=other.record)
    there = replace(base, problem=replace(base.problem, model=model))
    return errors(other, other.record.values - there.curve, other.allowance(there))[0]


def test_the_emulators_error_is_part_of_the_unit_for_a_struck_model_too(tmp_path: Path) -> None:
    ground = groundwork(tmp_path, scatter=3e-4)
    one = judge(ground, [curves(MIDDLE)[0][0]], 1e-5)
    base = one.start()[0]
    corrected = replace(base, problem=replace(base.problem, model=base.problem.model.corrected(0.0 * TIME)))
    plain, struck = np.diag(one.allowance(base)), np.diag(one.allowance(corrected))
    assert np.sqrt(plain.mean()) > 3e-4
    assert struck == pytest.approx(plain)  # a strike is as rough as the emulator's runs


def test_every_channel_is_held_out_in_turn_and_the_worst_is_the_figure(tmp_path: Path) -> None:
    ground = groundwork(tmp_path, 3)
    values = [y[0] for y in curves(MIDDLE, 3)]
    values[1] = values[1] + 0.1 * SIZE * np.sin(30.0 * TIME / TIME[-1])
    one = judge(ground, values, 1e-4)
    parts = channels(one)
    assert list(parts) == ["channel middle", "channel gauge", "channel side"]
    found = {name: hold_out(one, *part, 0.05, lambda _: None) for name, part in parts.items()}
    assert max(found, key=lambda name: found[name].before) == "channel gauge"
    assert in_short(found)[0] == {"time_block": None, "channel": found["channel gauge"].before, "shot": None}


def test_before_and_after_are_of_the_same_channel() -> None:
    found = {
        "channel a": HeldOut(5.0, 1.0, 5.0, 1.0, "sensor_gain", "attributed"),
        "channel b": HeldOut(2.0, None, 2.0, None, None, "no_significant_residual"),
    }
    assert [short["channel"] for short in in_short(found)] == [2.0, None]
