"""The page of a prediction: what the reader must know stands before the numbers, and once."""

from __future__ import annotations

from typing import Any

from birdstrike.reports.blocks import Lines, Warnings
from birdstrike.reports.page.prediction import _left_open, _reach, _rest

CONTENT: dict[str, Any] = {
    "extrapolation": ["normal speed 70 m/s is 17 % above the learnt shot (60 m/s)"],
    "warnings": ["no posterior is stored: where the records allow, train-and-invert stores one"],
    "posterior": ["no posterior is stored", "no missing effect was looked for"],
    "reach": {},
    "correlation": 1.0,
    "growth": 1.0,
    "explanations": [],
    "campaign": {"finished": 8, "asked": 8, "finer": 0},
    "tolerances": {},
}


def test_all_warnings_stand_first() -> None:
    assert _reach(CONTENT)[0] == Warnings((*CONTENT["extrapolation"], *CONTENT["warnings"]))
    assert not any(isinstance(block, Warnings) for block in _rest(CONTENT))
    assert not isinstance(_reach(CONTENT | {"extrapolation": [], "warnings": []})[0], Warnings)


def test_what_was_used_does_not_repeat_a_warning() -> None:
    assert _rest(CONTENT)[0] == Lines(("no missing effect was looked for",))


def test_the_interval_of_a_probability_says_of_how_many_simulations_it_is() -> None:
    """It was said to be that of the number of draws, thousands, where eight simulations stood behind it."""
    limits = {"displacement_centre": {}, "strain_back": {}}
    methods = {"displacement_centre": "draws", "strain_back": "emulator"}
    told = _left_open({"limits": limits, "campaign": {"finished": 8, "method": methods}})
    assert "of displacement centre is what 8 simulations of the new case leave open" in told
    assert "of strain back is what the posterior's draws, by the emulator, leave open" in told
