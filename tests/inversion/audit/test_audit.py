"""The audit: planted truths are drawn as promised, files hold together, rates come with their intervals."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from data.curves import read_measured
from data.errors import UserError
from data.paths import MEASURED
from inversion.audit.experiment import experiments, read_truth, truth_text
from inversion.audit.gates import at_least, contains, rate
from inversion.audit.make_experiments import noise_free
from inversion.audit.outside import bolted, strike_with, yawed
from inversion.audit.planted import COUNTS, draw
from solver.case import load_case
from solver.simulate import simulate

CASE = load_case("virtual_strike")
VIRTUAL = MEASURED / "virtual"


def test_planted_strikes_are_finer_and_on_another_lattice() -> None:
    planted = draw(CASE, np.random.default_rng(5))
    assert Counter(one.kind for one in planted) == Counter(COUNTS)
    assert len(planted) >= 24
    for one in planted:
        assert int(one.mesh["bird.particles"]) >= 2 * CASE.bird.particles
        assert one.mesh["bird.lattice"] != CASE.bird.lattice
        finer = load_case("virtual_strike", dict(one.mesh)).with_values(one.parameters).with_effects(one.effects)
        assert min(f / c for f, c in zip(finer.plate.elements, CASE.plate.elements, strict=True)) >= 1.5


def test_shipped_experiments_say_that_they_are_simulated_and_nothing_else() -> None:
    found = experiments(VIRTUAL)
    assert len(found) == 2 * sum(COUNTS.values())
    heads = set()
    for one in found:
        record = read_measured(one.record)
        assert record.simulated
        assert (record.time < load_case(one.case).first_contact).sum() >= 100
        heads.add((record.provenance, one.case.read_text()))
    assert len(heads) == 1  # the same words for every truth


def test_shipped_truths_are_all_kinds_in_one_and_three_channels() -> None:
    truths = [read_truth(one.truth) for one in experiments(VIRTUAL)]
    assert Counter(truth.kind for truth in truths) == {kind: 2 * count for kind, count in COUNTS.items()}
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


def test_rates_are_bootstrapped_over_whole_curves() -> None:
    same = rate([np.ones(200), np.zeros(200)] * 5)
    assert same.value == 0.5
    assert same.interval_95 is not None
    assert same.interval_95[1] - same.interval_95[0] > 0.5  # ten curves, not two thousand draws
    assert contains("x", same, 0.5).met
    assert not at_least("x", same, 0.6).met
    assert rate([]).value is None
    assert contains("x", rate([]), 0.05).met is None
