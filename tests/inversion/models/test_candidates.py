"""Names of bird models, the cases that they make, and ranges over decades."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from birdstrike.data.errors import UserError
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.models.candidates import (
    built,
    calibrated_case,
    candidate,
    candidates,
    kept_constants,
    literature_case,
    modulus_of,
    refuse_other_parameters,
    with_material,
)
from birdstrike.solver.bird.materials.registry import BIRD_MATERIALS
from birdstrike.solver.case.case import Case, case_from_table
from tests.inversion.diagnosis.rig import tiny

B, G = "bird.material.eos.B", "bird.material.eos.g"


def sought(case: Case) -> dict[str, Any]:
    return {p.name: (p.low, p.high, p.scale) for p in case.parameters()}


@pytest.mark.parametrize("name", [*BIRD_MATERIALS, "murnaghan", "null+polynomial_k", "hydrodynamic+grueneisen"])
def test_every_model_makes_a_case_with_ranges(name: str) -> None:
    case = calibrated_case(candidate(name), tiny())
    assert case.parameters()
    assert case.bird.material.model == name.partition("+")[0].replace("murnaghan", "null")
    assert literature_case(candidate(name), tiny()) is not None


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (("null", "grueneisen"), "names grueneisen and null, which are one model"),
        (("murnaghan", "null+murnaghan"), "which are one model"),
        (("null", "null"), "names null more than once: name it once"),
        (("null+foo",), '"null\\+foo" is no bird model; name null, elastic'),
        (("null+",), '"null\\+" is no bird model'),
    ],
)
def test_one_model_under_two_names_is_refused(names: tuple[str, ...], said: str) -> None:
    with pytest.raises(UserError, match=said):
        candidates(names)
    assert len(candidates(("null", "murnaghan", "hydrodynamic+grueneisen"))) == 3


def test_a_law_without_published_constants_takes_part_by_a_case_that_has_it() -> None:
    """A table of pressures: the case's own, sought in what the material itself declares."""
    law = {"kind": "table", "mu": [-0.1, 0.0, 0.1], "p": ["-200 MPa", "0 MPa", "300 MPa"]}
    with pytest.raises(UserError, match="declares no constants: give a case"):
        calibrated_case(candidate("null+table"), tiny())
    table = tiny().table
    bird = table["bird"] | {"material": table["bird"]["material"] | {"eos": law}}
    own = case_from_table({**table, "bird": bird})
    found = calibrated_case(candidate("null+table"), own)
    assert found.bird.material.eos.kind == "table"
    assert found.parameters()
    assert literature_case(candidate("null+table"), own) is None


def test_another_material_seeks_nothing_of_the_case_s_own_bird() -> None:
    other = with_material(tiny(), candidate("elastic").literature)
    assert other.bird.material.model == "elastic"
    assert not [p for p in other.parameters() if p.name.startswith("bird.material.")]


def test_murnaghan_is_a_null_bird_on_that_law_sought_over_decades() -> None:
    case = calibrated_case(candidate("murnaghan"), tiny())
    assert sought(case)[B] == (5e6, 1e9, "logarithmic")
    assert sought(case)[G] == (4.0, 12.0, "linear")
    assert modulus_of(case) == ("B g", (B, G))
    assert built(case, {B: 60e6, G: 7.0}).bulk_modulus == pytest.approx(420e6)


def test_a_case_states_its_own_ranges() -> None:
    own = {"inversion": {"models": {"murnaghan": {B: {"range": ["50 MPa", "200 MPa"]}}}}}
    assert sought(calibrated_case(candidate("murnaghan"), tiny().overlaid(own))) == {B: (50e6, 200e6, "linear")}
    of_the_case = sought(calibrated_case(candidate("null"), tiny()))  # the rig's bird is a NULL bird
    assert of_the_case == {"bird.material.viscosity": (100.0, 1000.0, "linear")}


@pytest.mark.parametrize("stated", ["murnaghan", "null+murnaghan"])
@pytest.mark.parametrize("asked", ["murnaghan", "null+murnaghan"])
def test_ranges_under_either_name_of_a_model_count(stated: str, asked: str) -> None:
    """Those under null+murnaghan were passed over where the model was asked for as murnaghan."""
    own = {"inversion": {"models": {stated: {B: {"range": ["50 MPa", "200 MPa"]}}}}}
    assert sought(calibrated_case(candidate(asked), tiny().overlaid(own))) == {B: (50e6, 200e6, "linear")}


def test_constants_that_a_case_keeps_although_the_model_seeks_them_are_warned_of() -> None:
    """A case that seeks one constant for train-and-invert has one for calibrate-models too; other models have all."""
    null, elastic = candidate("null"), candidate("elastic")
    (line,) = kept_constants(null, [calibrated_case(null, tiny())] * 2)
    assert "what is sought of this model (viscosity): pressure cutoff stays at -0.4 MPa, so that" in line
    assert line.endswith("not known too: inversion.models.null")
    assert kept_constants(elastic, [calibrated_case(elastic, tiny())]) == ()


def test_ranges_under_both_names_of_a_model_are_refused() -> None:
    both = {name: {B: {"range": ["50 MPa", "200 MPa"]}} for name in ("murnaghan", "null+murnaghan")}
    with pytest.raises(UserError, match=r"inversion.models.murnaghan and inversion.models.null\+murnaghan are of one"):
        calibrated_case(candidate("murnaghan"), tiny().overlaid({"inversion": {"models": both}}))


def test_a_logarithmic_range_has_its_middle_in_its_logarithm() -> None:
    space = ParameterSpace.of_case(calibrated_case(candidate("hydrodynamic"), tiny()))
    low, high = (
        np.array([v[i] for v in sought(calibrated_case(candidate("hydrodynamic"), tiny())).values()]) for i in (0, 1)
    )
    np.testing.assert_allclose(space.to_physical(space.to_unit(np.stack([low, high]))), [low, high])
    cutoff = space.names.index("bird.material.pressure_cutoff")
    assert space.middle[cutoff] == pytest.approx(-np.sqrt(5e6 * 1e4))


@pytest.mark.parametrize(
    ("other", "message"),
    [
        (
            {"young": 500.2, "poisson": 0.49},
            r"young is sought in 1 \.\. 500 MPa .* in one with elastic, sought in 1 .. 500\.2",
        ),
        ({"poisson": 0.49, "young": 500.0}, "one with elastic and two with elastic seek the same in another order"),
    ],
)
def test_shots_that_seek_otherwise_are_refused(other: dict[str, float], message: str) -> None:
    """Ranges that three digits do not part are other ranges, and another order would mix up the constants."""

    def seeking(name: str, highs: dict[str, float]) -> Case:
        lows, units = {"young": "1 MPa", "poisson": 0.4}, {"young": " MPa"}
        ranges = {
            f"bird.material.{key}": {"range": [lows[key], f"{high}{units[key]}" if key in units else high]}
            for key, high in highs.items()
        }
        table = tiny().overlaid({"inversion": {"models": {"elastic": ranges}}}).table
        return calibrated_case(candidate("elastic"), case_from_table(table, name))

    one = seeking("one", {"young": 500.0, "poisson": 0.49})
    refuse_other_parameters(candidate("elastic"), [one, seeking("two", {"young": 500.0, "poisson": 0.49})])
    with pytest.raises(UserError, match=message):
        refuse_other_parameters(candidate("elastic"), [one, seeking("two", other)])
