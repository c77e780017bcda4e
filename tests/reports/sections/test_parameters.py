"""What a parameter that is not identified has in the tables: its whole range, or the narrower prior of the case."""

from __future__ import annotations

from dataclasses import replace

import pytest

from birdstrike.cli.train_and_invert import _cells
from birdstrike.inversion.results.estimates import Estimate
from birdstrike.reports.blocks import Picture
from birdstrike.reports.figures.parameters import ParameterRow
from birdstrike.reports.results.results import Results
from birdstrike.reports.sections.identifiability import section
from birdstrike.reports.sections.parameters import _estimate

CHANNEL = "displacement_centre"
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


def test_indices_by_an_emulator_that_hardly_follows_the_simulations_say_so(results: Results) -> None:
    """Of a strain with Q2 0 all indices were 0 at all times, as if no parameter moved it."""
    known = results.inversion
    poor = replace(known, emulator=replace(known.emulator, q2={CHANNEL: 0.0}))
    sound, doubtful = (
        next(block.caption for block in section(one).blocks if isinstance(block, Picture) and "sobol" in block.name)
        for one in (results, replace(results, inversion=poor))
    )
    assert doubtful.removeprefix(sound).startswith(" The emulator predicts this sensor poorly (leave-one-out Q² 0.00)")
