"""Responses learnt from strikes: exact where they are quadratic, and as uncertain as three places show them to be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from data.histories import Array, Histories
from inversion.diagnosis.finer import choices, elsewhere, pairs
from inversion.diagnosis.responses import Known, Response, label, learn, library
from solver.case import load_case
from tests.inversion.diagnosis.toy_study import TIME, groundwork

SHAPE = np.sin(np.pi * TIME / TIME[-1])
BEND = np.sin(3.0 * np.pi * TIME / TIME[-1])


def known() -> Known:
    """An effect that acts both ways."""
    return next(one for one in library(load_case("virtual_strike"))[0] if one.name == "impact_speed")


def learnt(slopes: tuple[float, float, float], bend: float, lost: int | None = None) -> Response:
    """From strikes whose slope is another at each of three places; lost: a place whose base strike failed."""
    one = known()
    runs: dict[str, Histories] = {}
    for place, slope in enumerate(slopes):
        for b in one.learnt_at() if place == 0 else one.checked_at()[place - 1 : place]:
            runs[label(one.name, b, place)] = Histories(
                TIME, {"y": (1.0 + place) + b * slope * SHAPE + b * b * bend * BEND}, {}
            )
    bases: list[Array | None] = [np.full(len(TIME), 1.0 + place) for place in range(3)]
    others = [None if place == lost else base for place, base in enumerate(bases)][1:]
    base = bases[0]
    assert base is not None
    found = learn(one, base, others, runs, lambda run: run.channels["y"], (1e-9,))
    assert found is not None
    return found


def test_a_quadratic_response_is_exact_and_certain_where_it_is_the_same_everywhere() -> None:
    found = learnt((2.0, 2.0, 2.0), 0.3)
    assert found.at(np.array([1.7]))[0] == pytest.approx(1.7 * 2.0 * SHAPE + 1.7**2 * 0.3 * BEND)
    assert found.doubt == pytest.approx(0.0, abs=1e-12)


def test_places_that_disagree_are_averaged_and_tell_how_uncertain_another_one_is() -> None:
    found = learnt((2.0, 2.6, 1.7), 0.0)
    slopes = np.array([2.0, 2.6, 1.7])
    assert found.slope == pytest.approx(slopes.mean() * SHAPE)
    assert found.doubt == pytest.approx(slopes.var(ddof=1) * (1.0 + 1.0 / 3.0) * SHAPE**2)
    told = found.told(0.5 * SHAPE, np.full(len(TIME), 0.5))
    assert told.slope == pytest.approx(found.slope + 0.25 * SHAPE)
    assert told.doubt == pytest.approx(0.25 * found.doubt)


def test_a_place_whose_strike_failed_is_left_out_and_no_other_takes_its_part() -> None:
    found = learnt((2.0, 2.6, 1.7), 0.0, lost=1)
    assert found.slope == pytest.approx(np.mean([2.0, 1.7]) * SHAPE)


def test_numerical_strikes_are_finer_lie_inside_the_ranges_and_differ_from_each_other(tmp_path: Path) -> None:
    ground = groundwork(tmp_path)
    case = load_case(tmp_path / "case.toml")
    found = pairs(case, ground.coordinates)
    assert len(found) == 10
    lattices = set()
    for pair in found.values():
        assert pair.finer.bird.particles >= 1.5 * case.bird.particles
        assert min(f / c for f, c in zip(pair.finer.plate.elements, case.plate.elements, strict=True)) >= 1.4
        box = ground.coordinates.boxes[0]
        assert ((pair.theta > box.theta_lows) & (pair.theta < box.theta_highs)).all()
        lattices.add((pair.finer.bird.lattice, pair.finer.bird.particles, pair.finer.bird.seed))
    assert len(lattices) == 10
    assert {pair.finer.bird.lattice for pair in found.values()} == {"cubic"} != {case.bird.lattice}
    others = [one.bird for one in elsewhere(case, ground.coordinates).values()]
    assert len({(one.lattice, one.particles, one.seed) for one in others}) == 2
    assert len(choices(case, ground.theta)) == 2
