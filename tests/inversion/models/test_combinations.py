"""The bulk modulus of an answer: at the density that goes with the sought constants, not at the case's own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from birdstrike.inversion.models.calibrate_models import calibrate_models
from birdstrike.inversion.models.candidates import built, calibrated_case, candidate, modulus_of
from birdstrike.inversion.models.results import Combined, ModelAnswer
from birdstrike.solver.bird.eos.porous import AIR_SOUND_SPEED, porous_density
from birdstrike.solver.case.case import Case, case_from_table
from tests.inversion.models import rig

DENSITY, C0, Z = "bird.density", "bird.material.eos.c0", "bird.material.eos.z"
KNOWN = {DENSITY: {"range": ["900 kg/m^3", "1150 kg/m^3"], "prior": {"mean": "1100 kg/m^3", "sd": "3 kg/m^3"}}}


def seeking(case: Case, sought: dict[str, Any]) -> Case:
    return case.overlaid({"inversion": {"parameters": sought}})


def found(cases: list[Case], model: str, truth: dict[str, float], out: Path) -> tuple[ModelAnswer, Combined]:
    records = [rig.record(case, model, truth, i, f"shot_{i}") for i, case in enumerate(cases)]
    with rig.formula_for_solver():
        answers = calibrate_models(cases, records, out, [model], runs=12, workers=1, posterior=False)
    own = answers.models[model]
    return own, own.combinations["bulk_modulus"]


def test_the_bulk_modulus_is_that_of_the_density_sought_beside_it(tmp_path: Path) -> None:
    """The rig's bird has 938 kg/m^3, the truth 1100: K was rho0 c0^2 with the rig's, 15 % too small."""
    cases = [seeking(rig.shot(speed), KNOWN) for speed in (60.0, 100.0)]
    truth = {DENSITY: 1100.0, C0: 618.0, "bird.material.viscosity": 300.0}
    answer, bulk = found(cases, "null+polynomial_k", truth, tmp_path)
    density, c0 = (answer.parameters[key].value for key in (DENSITY, C0))
    assert density == pytest.approx(1100.0, abs=3.0)
    assert bulk.value == pytest.approx((density or 0.0) * (c0 or 0.0) ** 2, rel=1e-9)
    assert bulk.value == pytest.approx(1100.0 * 618.0**2, rel=0.02)
    assert bulk.interval_95 is not None
    assert bulk.interval_95[0] < 1100.0 * 618.0**2 < bulk.interval_95[1]
    assert set(bulk.of) == {DENSITY, C0}
    assert "density not identifiable" not in bulk.sentence  # its prior says what it is


def porous(case: Case) -> Case:
    """The rig's bird, of a law that gives the density."""
    table = case.table
    bird = {key: value for key, value in table["bird"].items() if key != "density"}
    material = {**bird["material"], "eos": {"kind": "porous", "z": 0.1, "mixing": "linear"}}
    return case_from_table({**table, "bird": {**bird, "material": material}, "inversion": {}}, case.name)


@pytest.mark.parametrize("z", [0.0, 0.3])
def test_the_density_follows_the_share_of_air(z: float) -> None:
    """K = rho_z c_z^2 was at the density of the case's own share of air: 1979 for 2199 MPa without any."""
    case = calibrated_case(candidate("null+porous"), porous(rig.shot(80.0)))
    speed = (1.0 - z) * 1482.9 + z * AIR_SOUND_SPEED
    assert built(case, {Z: z}).bulk_modulus == pytest.approx(porous_density(z, 1000.0) * speed**2, rel=1e-9)
    assert modulus_of(case) == ("rho_z c_por^2", (Z,))


def test_a_sought_density_alone_makes_a_bulk_modulus(tmp_path: Path) -> None:
    """None was given, because all draws had the case's own density."""
    viscosity = {"bird.material.viscosity": {"range": ["0 Pa s", "1500 Pa s"]}}
    free = {DENSITY: {"range": ["800 kg/m^3", "1200 kg/m^3"]}}
    cases = [seeking(rig.shot(speed), {**viscosity, **free}) for speed in (60.0, 100.0)]
    answer, bulk = found(cases, "null", {DENSITY: 1050.0, "bird.material.viscosity": 300.0}, tmp_path)
    assert bulk.of == (DENSITY,)
    assert bulk.identified
    assert bulk.value == pytest.approx(1050.0 * 1670.0**2, rel=0.02)
    assert bulk.value == pytest.approx((answer.parameters[DENSITY].value or np.nan) * 1670.0**2, rel=1e-9)


def test_the_density_that_a_sought_mass_gives_counts() -> None:
    table = rig.shot(80.0).table
    bird = {key: value for key, value in table["bird"].items() if key != "density"} | {"mass": "0.25 kg"}
    sought = {"bird.mass": {"range": ["0.2 kg", "0.3 kg"]}}
    case = case_from_table({**table, "bird": bird, "inversion": {"parameters": sought}})
    own = calibrated_case(candidate("murnaghan"), case)
    assert modulus_of(own)[1] == ("bird.material.eos.B", "bird.material.eos.g")  # K = B g has no density
    other = calibrated_case(candidate("null+polynomial_k"), case)
    assert set(modulus_of(other)[1]) == {"bird.mass", C0}
    k = [built(other, {"bird.mass": mass}).bulk_modulus for mass in (0.2, 0.3)]
    assert k[1] / k[0] == pytest.approx(1.5, rel=1e-9)
