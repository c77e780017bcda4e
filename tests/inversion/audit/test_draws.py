"""Truths: what is drawn, on which mesh, by which model, and from nothing but the seed."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from birdstrike.data.histories import Histories
from birdstrike.inversion.audit.draws import (
    BASELINE,
    CLEAN,
    HELDOUT,
    HEXAHEDRA,
    OTHER_LAW,
    OUTSIDE,
    OWN,
    OWN_BASELINE,
    PAIR,
    SHARES,
    SINGLE,
    WITHOUT,
    Drawn,
    draw,
    label_of,
    name_of,
    replaced,
    roles,
    truth_case,
    with_effects_of,
)
from birdstrike.inversion.audit.truth_runs import _columns
from birdstrike.solver.bird.eos.grueneisen import grueneisen
from birdstrike.solver.bird.eos.murnaghan import murnaghan
from birdstrike.solver.case.case import Case, load_case

COUNT = 60


@pytest.fixture(scope="module")
def case() -> Case:
    return load_case("virtual_strike")


@pytest.fixture(scope="module")
def drawn(case: Case) -> list[Drawn]:
    return [draw(case, 0, number, forms=False) for number in range(COUNT)]


def one_of(drawn: list[Drawn], kind: str) -> Drawn:
    return next(one for one in drawn if one.kind == kind)


def test_a_truth_follows_from_the_seed_and_its_number_alone(case: Case, drawn: list[Drawn]) -> None:
    assert draw(case, 0, 7, forms=False) == drawn[7]
    assert draw(case, 1, 7, forms=False).parameters != drawn[7].parameters
    assert draw(case, 0, 7, forms=False, attempt=1).parameters != drawn[7].parameters


def test_kinds_come_in_their_shares_and_parameters_inside_their_ranges(case: Case, drawn: list[Drawn]) -> None:
    counts = Counter(one.kind for one in drawn)
    for kind, share in SHARES.items():
        assert abs(counts[kind] - share * COUNT) <= 4.0 * np.sqrt(COUNT * share * (1.0 - share))
    for p in case.parameters():
        assert all(p.low < one.parameters[p.name] < p.high for one in drawn)
        assert all(one.parameters[p.name] != one.clean[p.name] for one in drawn), "a baseline has a bird of its own"


def test_single_effects_are_of_several_families_and_some_of_one_sensor_or_of_one_shot(drawn: list[Drawn]) -> None:
    labels = [label for one in drawn for label in one.effects]
    assert any("." in label for label in labels)
    assert any(label.endswith("@shot1") for label in labels)
    assert len({label.split("@")[0].split(".")[0] for label in labels}) > 8
    assert all(len(one.effects) == {CLEAN: 0, SINGLE: 1, PAIR: 2, OUTSIDE: 0}[one.kind] for one in drawn)


def test_every_truth_is_eight_times_finer_on_another_lattice_and_the_baseline_is_clean(
    case: Case, drawn: list[Drawn]
) -> None:
    one = one_of(drawn, SINGLE)
    cases = roles(one, case, own_baseline=True)
    for role in ("shot1", "shot2", "shot3", HELDOUT, BASELINE, OWN_BASELINE, WITHOUT):
        found = cases[role]
        assert found.bird.particles >= 8 * case.bird.particles
        assert all(fine >= 2 * coarse for fine, coarse in zip(found.plate.elements, case.plate.elements, strict=True))
        assert found.bird.lattice != case.bird.lattice
        assert found.bird.jitter > 0.0
    assert len({cases[role].bird.seed for role in ("shot1", "shot2", "shot3", HELDOUT, BASELINE, OWN_BASELINE)}) == 6
    assert cases[BASELINE].resolved() == cases[BASELINE]
    assert cases[OWN_BASELINE].resolved() == cases[OWN_BASELINE]
    assert cases[OWN_BASELINE].bird.material == cases["shot1"].bird.material != cases[BASELINE].bird.material
    assert cases[WITHOUT].bird.seed == cases["shot1"].bird.seed
    assert cases["shot1"].canonical() != cases[WITHOUT].canonical()


@pytest.mark.parametrize("form", [HEXAHEDRA, OTHER_LAW])
def test_the_other_model_is_another_model_on_three_times_the_shells(case: Case, drawn: list[Drawn], form: str) -> None:
    one = one_of(drawn, CLEAN)
    found = truth_case(case, Drawn(0, CLEAN, one.parameters, one.clean, {}, form, 1), 0, "shot1")
    own = truth_case(case, Drawn(0, CLEAN, one.parameters, one.clean, {}, OWN, 1), 0, "shot1")
    assert found.plate.elements[0] >= 3 * case.plate.elements[0]
    assert (found.bird.method != own.bird.method) == (form == HEXAHEDRA)
    if form == OTHER_LAW:
        assert found.bird.material.law.kind == "murnaghan"
        assert found.solver.shock_linear > own.solver.shock_linear


def test_the_other_law_is_as_stiff_as_the_declared_one_in_small_compressions(case: Case) -> None:
    one = draw(case, 0, 0, forms=False)
    found = truth_case(case, Drawn(0, CLEAN, one.parameters, one.clean, {}, OTHER_LAW, 1), 0, "shot1")
    law, density = found.bird.material.law, case.bird.actual_density
    other = murnaghan(density, law.B, law.g)
    own = grueneisen(density, one.parameters["bird.material.eos.C"], 2.48)
    for mu in (0.01, 0.03):
        pressures = [law.terms(mu, law.constants)[0] for law in (other, own)]
        assert pressures[0] == pytest.approx(pressures[1], rel=0.01)


def test_something_outside_the_library_changes_the_shot_but_not_the_baseline(case: Case, drawn: list[Drawn]) -> None:
    one = one_of(drawn, OUTSIDE)
    cases = roles(one, case)
    plain = truth_case(case, Drawn(0, CLEAN, one.parameters, one.clean, {}, OWN, one.seed), 0, "shot1")
    assert one.what
    assert cases["shot1"].canonical() != plain.canonical()
    assert cases[BASELINE].plate == plain.plate


def test_an_effect_of_one_shot_or_of_one_sensor_acts_there_alone(case: Case) -> None:
    fast = with_effects_of(case, {"impact_speed@shot1": 2.0}, "shot1")
    assert fast.impact.speed == pytest.approx(case.impact.speed + 2.0)
    assert with_effects_of(case, {"impact_speed@shot1": 2.0}, "shot2") == case
    loud = with_effects_of(case, {"sensor_gain.displacement_quarter": 0.05}, "shot2")
    assert loud.instrument["displacement_quarter"].gain == pytest.approx(1.05)
    assert "displacement_centre" not in loud.instrument


def test_a_truth_stands_beside_what_its_case_declares(case: Case) -> None:
    """A gain of 1.2 was planted in the place of the declared one of 1.1; a declared thickness was planted in vain."""
    declared = case.with_effects({"sensor_gain": 0.1, "plate_thickness": 2e-4})
    found = with_effects_of(declared, {"sensor_gain": 0.2, "impact_speed": 2.0}, "shot1")
    assert found.instrument["displacement_centre"].gain == pytest.approx(1.1 * 1.2)
    assert found.plate.thickness == pytest.approx(case.plate.thickness + 2e-4)
    rng = np.random.default_rng(0)
    drawn = {name_of(label_of(declared, rng)) for _ in range(200)}
    assert "sensor_gain" in drawn
    assert "plate_modulus" in drawn
    assert "plate_thickness" not in drawn


def test_a_declared_drift_runs_before_contact_in_every_record(case: Case) -> None:
    """It was 0 there, so that the record read as that of an instrument whose drift begins at the record's zero."""
    declared = case.overlaid({"instrument": {"displacement_centre": {"drift": "0.3 m/s"}}})
    one = Drawn(0, SINGLE, {}, {}, {"sensor_drift.displacement_centre": -0.1}, OWN, 0)
    t = np.linspace(0.0, case.time.end, 11)
    still = Histories(t, dict.fromkeys(case.sensors, 0.0 * t), {})
    time, found = _columns(replaced(declared, {}), one, {"shot1": still, BASELINE: still})
    early = time < 0.0
    assert found["shot1", "displacement_centre"][early] == pytest.approx(0.2 * time[early])
    assert found[BASELINE, "displacement_centre"][early] == pytest.approx(0.3 * time[early])
    assert not found["shot1", "displacement_quarter"][early].any()
