"""Responses learnt from strikes: exact where they are quadratic, and as uncertain as three places show them to be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.histories import Array, Histories
from birdstrike.inversion.diagnosis.finer import choices, elsewhere, pairs
from birdstrike.inversion.diagnosis.responses import Known, Response, label, learn, library, pooled
from birdstrike.solver.case.case import load_case
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


@pytest.mark.parametrize(("varies", "scatters"), [(1.0, 0.1), (0.5, 0.5), (0.1, 1.0)])
def test_a_response_is_as_far_off_as_it_says_before_and_after_two_strikes_at_the_fit(
    varies: float, scatters: float
) -> None:
    """Slopes that vary from place to place by one amount, seen through strikes that scatter by another."""
    rng, size, grid = np.random.default_rng(0), 1.5, 40
    said, off = np.zeros(2), np.zeros(2)
    at = known().learnt_at()[1]
    for _ in range(400):
        true = varies * rng.standard_normal((4, grid))
        seen = true[:3] + np.sqrt(2.0) * scatters / at * rng.standard_normal((3, grid))
        mean = seen.mean(axis=0)
        spread = np.sqrt(4.0 / 3.0 / 2.0) * (seen - mean)
        before = Response(mean, np.zeros(grid), spread, np.full(grid, 2.0 * scatters**2), at)
        there = true[3] + np.sqrt(2.0) * scatters / size * rng.standard_normal(grid)
        after = before.told(there - mean, size, 1)
        said += [before.doubt.mean() - 2.0 * (scatters / at) ** 2, after.doubt.mean()]
        off += [np.mean((one.slope - true[3]) ** 2) for one in (before, after)]
    assert off[1] < 1.02 * off[0]
    assert (said / off > 0.8).all()
    assert (said / off < 2.0).all()  # three places tell a small variation from scatter but roughly


def test_scatter_of_the_strikes_is_not_taken_for_curvature() -> None:
    rng = np.random.default_rng(0)
    one = known()
    kept, raw = [], []
    for _ in range(50):
        base = rng.standard_normal(len(TIME))
        runs = {
            label(one.name, b): Histories(TIME, {"y": 3.0 * b * SHAPE + rng.standard_normal(len(TIME))}, {})
            for b in one.learnt_at()
        }
        found = learn(one, base, [None, None], runs, lambda run: run.channels["y"], (1.0,))
        assert found is not None
        kept.append(np.mean(found.curvature**2))
        low, high = (runs[label(one.name, b)].channels["y"] - base for b in one.learnt_at())
        raw.append(np.mean(((low + high) / (2.0 * one.learnt_at()[1] ** 2)) ** 2))
    assert np.mean(kept) < 0.05 * np.mean(raw)


def test_half_of_every_spread_goes_to_the_directions_that_all_have() -> None:
    rng = np.random.default_rng(0)
    rows = {name: size * rng.standard_normal((3, 2 * len(TIME))) for name, size in (("a", 1.0), ("b", 5.0))}
    none = np.zeros(2 * len(TIME))
    found = pooled({name: Response(none, none, spread, none, 2.0) for name, spread in rows.items()}, 2)
    for name, spread in rows.items():
        parts = np.split(found[name].doubt, 2)
        assert [part.mean() for part in parts] == pytest.approx([p.mean() for p in np.split((spread**2).sum(0), 2)])
        unit = rows["b" if name == "a" else "a"][0]
        unit = unit / np.linalg.norm(unit)
        assert ((found[name].spread @ unit) ** 2).sum() > 3.0 * ((spread @ unit) ** 2).sum()


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
