"""The audit: planted truths are drawn as promised, files hold together, rates come with their intervals."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.curves import read_measured
from birdstrike.data.errors import UserError
from birdstrike.data.paths import MEASURED
from birdstrike.inversion.audit.experiment import experiments, read_truth, truth_text
from birdstrike.inversion.audit.make_experiments import noise_free
from birdstrike.inversion.audit.outside import bolted, strike_with, yawed
from birdstrike.inversion.audit.planted import COUNTS, OF_BUCKLING, SINGLE, bears, draw, redraw
from birdstrike.solver.case.case import load_case
from birdstrike.solver.effects.plate import bending_stiffness
from birdstrike.solver.effects.registry import effects
from birdstrike.solver.simulate import simulate

CASE = load_case("virtual_strike")
VIRTUAL = MEASURED / "virtual"


def test_planted_strikes_are_finer_and_on_another_lattice() -> None:
    planted = draw(CASE, np.random.default_rng(5))
    assert Counter(one.kind for one in planted) == Counter(COUNTS)
    assert len(planted) >= 24
    for one in planted:
        assert int(one.mesh["bird.particles"]) >= 2 * CASE.bird.particles
        assert one.mesh["bird.lattice"] != CASE.bird.lattice
    for one in planted[:6]:
        finer = load_case("virtual_strike", dict(one.mesh)).with_values(one.parameters).with_effects(one.effects)
        assert min(f / c for f, c in zip(finer.plate.elements, CASE.plate.elements, strict=True)) >= 1.5


def test_shipped_experiments_say_that_they_are_simulated_and_nothing_else() -> None:
    found = experiments(VIRTUAL)
    assert len(found) >= 2 * 24
    heads = set()
    for one in found:
        record = read_measured(one.record)
        assert record.simulated
        assert (record.time < load_case(one.case).first_contact).sum() >= 100
        heads.add((record.provenance, one.case.read_text()))
    assert len(heads) == 1  # the same words for every truth


def test_shipped_truths_are_all_kinds_in_one_and_three_channels() -> None:
    truths = [read_truth(one.truth) for one in experiments(VIRTUAL)]
    kinds = Counter(truth.kind for truth in truths)
    assert set(kinds) == set(COUNTS)
    assert not any(count % 2 for count in kinds.values())  # each strike is recorded twice
    assert Counter(len(truth.channels) for truth in truths) == {1: len(truths) // 2, 3: len(truths) // 2}


def test_a_truth_file_reads_back(tmp_path: Path) -> None:
    planted = next(one for one in draw(CASE, np.random.default_rng(5)) if len(one.effects) == 2)
    coarse = {"bird.particles": "200", "plate.elements": "[8, 6]", "time.end": "0.3 ms"}
    case = load_case("virtual_strike", coarse)
    clean = noise_free(case, simulate(case, threads=1), ("displacement_centre",))
    (tmp_path / "x.truth.toml").write_text(truth_text(planted, clean))
    truth = read_truth(tmp_path / "x.truth.toml")
    assert truth.effects == pytest.approx(planted.effects)
    assert truth.parameters == pytest.approx(planted.parameters)
    assert truth.channels["displacement_centre"] == pytest.approx(
        clean.channels["displacement_centre"], rel=1e-5, abs=1e-9
    )
    with pytest.raises(UserError, match="no experiment"):
        experiments(tmp_path)


def test_what_is_outside_the_library_changes_the_strike() -> None:
    case = load_case("virtual_strike", {"bird.particles": "300", "plate.elements": "[10, 8]", "time.end": "2.5 ms"})
    plain = simulate(case, threads=1).channels["displacement_centre"]
    bolts = strike_with(case, bolted(4)).channels["displacement_centre"]
    assert bolts.max() > 1.02 * plain.max()  # a frame that holds less lets the plate go farther
    assert np.abs(strike_with(case, yawed(0.3)).channels["displacement_centre"] - plain).max() > 1e-5


def test_every_effect_of_the_library_is_planted_once_alone() -> None:
    planted = draw(CASE, np.random.default_rng(5))
    alone = [next(iter(one.effects)) for one in planted if one.kind == SINGLE]
    assert sorted(alone) == sorted(name for name, effect in effects().items() if not effect.refuses(CASE))


def test_no_compression_near_the_buckling_load_is_planted() -> None:
    """Clamped, equally compressed both ways: N (1 + a^2/b^2) = 4/3 pi^2 D/a^2 (3 + 3 a^4/b^4 + 2 a^2/b^2), from above.

    Timoshenko & Gere (1961), by energy with a cosine in both directions.
    """
    plate = CASE.plate
    ratio = (plate.length / plate.width) ** 2
    shape = 3.0 + 3.0 * ratio**2 + 2.0 * ratio
    load = 4.0 / 3.0 * np.pi**2 * bending_stiffness(CASE) / plate.length**2 * shape / (1.0 + ratio)
    limit = OF_BUCKLING * load / plate.thickness
    assert bears(CASE, {"plate_preload": -0.93 * limit})
    assert not bears(CASE, {"plate_preload": -1.02 * limit})
    assert bears(CASE, {"plate_preload": limit})
    assert not bears(CASE, {"plate_preload": -1.2 * plate.material.yield_stress})


def test_a_truth_is_drawn_again_with_the_same_effects() -> None:
    rng = np.random.default_rng(5)
    for one in draw(CASE, rng):
        other = redraw(CASE, one, rng)
        assert (other.kind, list(other.effects)) == (one.kind, list(one.effects))
        assert (other.outside and other.outside.name) == (one.outside and one.outside.name)
        assert other.mesh != one.mesh
