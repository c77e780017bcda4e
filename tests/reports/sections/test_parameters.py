"""What a parameter that is not identified has in the tables: its whole range, or the narrower prior of the case."""

from __future__ import annotations

import pytest

from birdstrike.cli.train_and_invert import _cells
from birdstrike.inversion.results.estimates import Estimate
from birdstrike.reports.figures.parameters import ParameterRow
from birdstrike.reports.sections.parameters import _estimate

RANGE = (100.0, 1000.0)


@pytest.mark.parametrize(
    ("interval", "on_page", "in_terminal"),
    [
        (RANGE, "whole range", "in 100 .. 1000 Pa s"),
        (None, "whole range", "in 100 .. 1000 Pa s"),
        ((304.0, 696.0), "304 Pa s to 696 Pa s", "in 304 .. 696 Pa s"),
    ],
)
def test_what_is_not_identified_has_its_range_or_its_prior(
    interval: tuple[float, float] | None, on_page: str, in_terminal: str
) -> None:
    estimate = Estimate(500.0, interval, "Pa s", False, "the noise hides it")
    row = ParameterRow("bird.material.viscosity", "Pa s", *RANGE, {})
    assert _estimate(estimate, row) == ("–", on_page, "no", "the noise hides it")
    assert _cells(estimate, RANGE)[0] == in_terminal
