"""The published 25-run design, extrapolated in two readings: one line, of which five rows are printed."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.data.paths import REFERENCE
from birdstrike.doe.designs.registry import make_design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.solver.case.case import load_case

VISCOSITY = 1


@pytest.mark.parametrize(("reading", "largest"), [("step", 2400.0), ("range", 1500.0)])
def test_both_readings_are_the_printed_diagonal_and_say_that_it_has_rank_one(reading: str, largest: float) -> None:
    wide = {'inversion.parameters."bird.material.viscosity".range': ["0 Pa s", "2400 Pa s"]}
    space = ParameterSpace.of_case(load_case("reference_strike", wide))
    printed = make_design(REFERENCE / "table6_design.csv", space)
    design = make_design(REFERENCE / f"table6_extrapolated_{reading}.csv", space)
    assert len(design.numbers) == 25
    assert design.quality().rank == 1
    assert design.values[-1, VISCOSITY] == pytest.approx(largest)
    same = [i for i in range(4) if reading == "step" or i != VISCOSITY]
    np.testing.assert_allclose(design.values[:5, same], printed.values[:, same])
