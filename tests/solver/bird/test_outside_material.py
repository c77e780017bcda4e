"""A bird material from outside the tree, with a pressure law and a constant of its own."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
import pytest
from numba import njit

from birdstrike.data.errors import CaseError
from birdstrike.solver.bird.eos.interface import EquationOfState
from birdstrike.solver.bird.materials.fluid import Fluid
from birdstrike.solver.bird.materials.interface import BirdMaterial
from birdstrike.solver.bird.materials.registry import BIRD_MATERIALS
from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.fields import Between
from birdstrike.solver.simulate import simulate

SMALL = {"bird.particles": "200", "plate.elements": "[8, 8]", "time.end": "0.3 ms", "time.snapshots": "[]"}
SMALL |= {"impact.standoff": "1 mm"}
MURNAGHAN = {
    "bird.material.eos.kind": "murnaghan",
    "bird.material.eos.B": "128 MPa",
    "bird.material.eos.g": "7.98",
    "bird.material.pressure_cutoff": "-1 MPa",
    "bird.material.viscosity": "100 Pa s",
    "bird.material.compression_erosion": "0",
}
GEL = {"bird.material.model": "gel", "bird.material.hardness": "128 MPa"}


@njit
def gel_terms(mu, eos):
    """Cold pressure hardness [(1 + mu)^7.98 - 1] and its slope; no energy term."""
    power = eos[1] * (1.0 + mu) ** eos[2]
    return power - eos[1], eos[2] * power / (1.0 + mu), 0.0, 0.0


class Gel(BirdMaterial):
    """Gelatine whose hardness [Pa] is its one constant."""

    model: Literal["gel"]
    hardness: Annotated[float, Between("1 MPa", "1000 MPa")]
    body: ClassVar[str] = "fluid"

    def build(self, rho0: float) -> Fluid:
        return Fluid(EquationOfState(gel_terms, np.array([rho0, self.hardness, 7.98])), -1e6, 100.0)


@pytest.fixture
def gel(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(BIRD_MATERIALS.own, "gel", (Gel, __name__))


def small(changes: dict[str, str], method: str) -> Case:
    return load_case("reference_strike_156mm", SMALL | {"bird.method": method} | changes)


@pytest.mark.usefixtures("gel")
@pytest.mark.parametrize("method", ["sph", "hexahedra"])
def test_a_law_from_outside_gives_the_bits_of_the_same_law_in_the_library(method: str):
    """Murnaghan's formula, compiled from here: p0 = 0 adds nothing to it."""
    outside, inside = (simulate(small(changes, method)) for changes in (GEL, MURNAGHAN))
    assert inside.channels["contact_force"].max() > 1e3
    for name, values in inside.channels.items():
        assert (outside.channels[name] == values).all(), name


@pytest.mark.usefixtures("gel")
def test_the_constant_of_a_material_from_outside_acts():
    soft, hard = (small(GEL | {"bird.material.hardness": text}, "sph") for text in ("20 MPa", "300 MPa"))
    assert simulate(hard).summary["peak"]["contact_force"]["value"] != pytest.approx(
        simulate(soft).summary["peak"]["contact_force"]["value"], rel=0.05
    )


def test_an_unknown_material_is_an_error_that_lists_the_known_ones():
    with pytest.raises(CaseError, match=r"is unknown; available: null, elastic, plastic_kinematic, hydrodynamic"):
        small({"bird.material.model": "gel"}, "sph")


def test_every_kind_answers_to_the_name_under_which_it_is_registered():
    for name, kind in BIRD_MATERIALS.items():
        assert kind.model_fields["model"].annotation == Literal[name]  # pyright: ignore[reportInvalidTypeForm]
