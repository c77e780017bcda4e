"""A design like Table 6 of the bird-strike paper cannot give four separate estimates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from birdstrike.data.dataset import Dataset
from birdstrike.doe.designs.design import Design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.estimation.locate import DesignError, InversionOptions, design_figures
from birdstrike.inversion.invert import invert
from tests.inversion.stand_in import (
    CHANNEL,
    HIGHS,
    LOWS,
    NAMES,
    UNITS,
    campaign,
    diagonal,
    forward,
    record,
    spread,
)

OPTIONS = InversionOptions(noise={CHANNEL: 2e-5}, allow_rank_deficient=True)


@pytest.fixture(scope="module")
def table6() -> Dataset:
    return campaign(diagonal())


def test_diagonal_design_is_refused(table6: Dataset) -> None:
    with pytest.raises(DesignError, match="the design carries 1 direction, not 4") as error:
        invert(table6, record(table6.parameters[10]), forward, InversionOptions())
    assert error.value.exit_code == 1
    assert "--allow-rank-deficient" in str(error.value)


def test_full_design_passes() -> None:
    found = design_figures(campaign(spread()))
    assert found.rank == found.parameters == 4
    assert not found.deficient
    assert found.max_correlation is not None
    assert found.max_correlation < 0.5


def test_the_combination_that_is_carried_stands_in_place_of_four_values(table6: Dataset) -> None:
    share = 0.3
    theta = LOWS + np.array([1.0 - share, share, share, 1.0 - share]) * (HIGHS - LOWS)
    found = invert(table6, record(theta, noise=2e-5), forward, OPTIONS).inversion
    assert found.design.rank == 1
    for answer in found.methods.values():
        for estimate in answer.parameters.values():
            assert estimate.value is None
            assert estimate.interval_95 is None
            assert not estimate.identified
            assert "the design carries 1 direction, not 4" in estimate.reason
        assert answer.combination is not None
        assert len(answer.combination.coordinates) == 1
    carried = found.methods["emulator"].combination
    assert carried is not None
    point = np.array([carried.point[name] for name in table6.names])
    np.testing.assert_allclose((point - LOWS) / (HIGHS - LOWS), (theta - LOWS) / (HIGHS - LOWS), atol=0.02)
    assert carried.interval_95[0] is not None
    assert carried.interval_95[0][0] < carried.coordinates[0] < carried.interval_95[0][1]
    assert carried.sentence.count("damping") == 1
    assert any("no separate values" in warning for warning in found.warnings)


def test_network_is_held_to_the_same_line(table6: Dataset) -> None:
    found = invert(table6, record(table6.parameters[8]), forward, OPTIONS).inversion.methods["network"].combination
    assert found is not None
    unit = (np.array([found.point[name] for name in table6.names]) - LOWS) / (HIGHS - LOWS)
    np.testing.assert_allclose(unit[[0, 3]], 1.0 - unit[1], atol=1e-9)
    assert unit[2] == pytest.approx(unit[1])


def test_runs_that_do_not_differ_are_refused_even_then() -> None:
    same = campaign(np.full((10, 4), 0.5))
    with pytest.raises(DesignError, match="carries 0 directions, not 4"):
        invert(same, record(same.parameters[0]), forward, OPTIONS)


LOGARITHMIC = ("linear", "logarithmic", "linear", "linear")


@pytest.mark.parametrize("straight_in", [LOGARITHMIC, ("linear",) * 4])
def test_a_line_of_runs_is_one_in_the_scale_of_the_range_or_in_linear_shares(straight_in: tuple[str, ...]) -> None:
    """run-doe and the inversion judge alike, and the combination lies on the line."""
    lows, highs = LOWS.copy(), HIGHS.copy()
    lows[1], highs[1] = 0.5e-3, 5e-3
    line = ParameterSpace(NAMES, UNITS, lows, highs, straight_in)
    theta = line.to_physical(diagonal())
    runs = replace(campaign((theta - LOWS) / (HIGHS - LOWS)), lows=lows, highs=highs, scales=LOGARITHMIC)
    assert design_figures(runs).rank == 1
    space = replace(line, scales=LOGARITHMIC)
    design = Design("file", None, space, runs.runs, theta, space.to_unit(theta))
    assert design.quality().rank == 1
    found = invert(runs, record(theta[8], noise=2e-5), forward, replace(OPTIONS, method="emulator")).inversion
    carried = found.methods["emulator"].combination
    assert carried is not None
    point = line.to_unit(np.array([[carried.point[name] for name in NAMES]]))[0]
    np.testing.assert_allclose(point, diagonal()[8], atol=0.02)
    ends = np.array([carried.directions[0][name] for name in NAMES])
    np.testing.assert_allclose(np.abs(ends), highs - lows, rtol=1e-6)
