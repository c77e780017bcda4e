"""Designs in the range's own scale: a parameter that spans decades is spread over its decades."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.errors import CaseError
from birdstrike.doe.campaign.planned import planned_design
from birdstrike.doe.campaign.results import load_dataset
from birdstrike.doe.designs.registry import make_design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.solver.case.case import load_case
from tests.doe.campaign.test_campaign import campaign
from tests.doe.stand_in import reference

SPACE = ParameterSpace(
    ("a", "b", "c"),
    ("Pa s", "Pa", ""),
    np.array([0.1, -1e6, 0.0]),
    np.array([1000.0, -1e2, 2.0]),
    ("logarithmic", "logarithmic", "linear"),
)


def test_equal_fractions_are_equal_ratios_on_either_side_of_zero() -> None:
    unit = np.linspace(0.0, 1.0, 5)[:, None] * np.ones(3)
    values = SPACE.to_physical(unit)
    np.testing.assert_allclose(values[:, 0], [0.1, 1.0, 10.0, 100.0, 1000.0], rtol=1e-12)
    np.testing.assert_allclose(values[:, 1], [-1e6, -1e5, -1e4, -1e3, -1e2], rtol=1e-12)
    np.testing.assert_allclose(values[:, 2], [0.0, 0.5, 1.0, 1.5, 2.0])
    np.testing.assert_allclose(SPACE.to_unit(values), unit, atol=1e-12)
    assert not SPACE.outside(values).any()
    assert ((values >= SPACE.lows) & (values <= SPACE.highs)).all()


def test_a_value_beyond_zero_is_outside_a_logarithmic_range() -> None:
    values = np.array([[-1.0, -1e3, 1.0], [0.0, 1e3, 1.0], [1.0, -1e3, 1.0]])
    np.testing.assert_array_equal(SPACE.outside(values)[:, :2], [[True, False], [True, True], [False, False]])


@pytest.mark.parametrize("kind", ["uniform", "orthogonal", "lhs", "sobol"])
def test_every_kind_spreads_its_runs_over_the_decades(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("birdstrike.doe.designs.uniform.SWAPS", 20_000)
    design = make_design(kind, SPACE, 16)
    decades = np.floor(np.log10(design.values[:, 0]))
    np.testing.assert_array_equal(np.unique(decades, return_counts=True)[1], [4, 4, 4, 4])


LOGARITHMIC = {'inversion.parameters."bird.material.viscosity".scale': '"logarithmic"'}


def test_a_case_names_the_scale_and_a_range_through_zero_has_none() -> None:
    decades = {'inversion.parameters."bird.material.viscosity".range': '["1 Pa s", "1500 Pa s"]'}
    case = load_case("reference_strike", LOGARITHMIC | decades)
    assert [p.scale for p in case.parameters()] == ["linear", "logarithmic", "linear", "linear"]
    with pytest.raises(CaseError, match="logarithmic needs a range on one side of 0"):
        load_case("reference_strike", LOGARITHMIC)
    with pytest.raises(CaseError, match="did you mean"):
        load_case("reference_strike", {'inversion.parameters."bird.material.viscosity".scale': '"logaritmic"'})


def test_another_scale_is_another_range_and_is_not_extended(tmp_path: Path) -> None:
    space = ParameterSpace.of(reference().parameters())
    campaign(tmp_path, make_design("lhs", space, 4))
    other = ParameterSpace(space.names, space.units, space.lows, space.highs, ("logarithmic", *("linear",) * 3))
    assert load_dataset(tmp_path).scales == ("linear",) * 4
    longer = planned_design("lhs", other, 6, 0, tmp_path)
    assert not np.allclose(longer.values[:4], make_design("lhs", space, 4).values)
