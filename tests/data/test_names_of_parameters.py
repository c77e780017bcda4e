"""Short names of parameters: the last word where one parameter has it, with parents where several do."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.data.formatting import key_labels, plain
from birdstrike.doe.designs.quality import design_quality
from birdstrike.inversion.identifiability.directions import _words
from birdstrike.reports.explore.view import answer, parameter
from birdstrike.reports.figures.quantities import parameter_label, symbol

LEFT, RIGHT, MU = "target.parts.left.thickness", "target.parts.right.thickness", "bird.material.viscosity"


@pytest.mark.parametrize(
    ("keys", "labels"),
    [
        ((MU, "bird.material.tension_erosion"), ["viscosity", "tension_erosion"]),
        ((LEFT, RIGHT, MU), ["left thickness", "right thickness", "viscosity"]),
        ((LEFT, "plate.thickness"), ["left thickness", "plate thickness"]),
        (("a.x.k", "b.x.k", "c.y.k"), ["a x k", "b x k", "y k"]),
        (("density", "bird.density"), ["density", "bird density"]),
        ((MU, MU), ["viscosity"]),
    ],
)
def test_labels_take_parents_until_they_differ(keys: tuple[str, ...], labels: list[str]) -> None:
    assert list(key_labels(keys).values()) == labels


def test_console_report_and_explorer_tell_two_thicknesses_apart() -> None:
    names = (LEFT, RIGHT, MU)
    assert [plain(name, names) for name in names] == ["left thickness", "right thickness", "viscosity"]
    assert [plain(name) for name in names] == ["thickness", "thickness", "viscosity"]
    assert [parameter_label(name, names) for name in names] == ["left thickness", "right thickness", "viscosity MU"]
    assert [symbol(name, names) for name in names] == ["left thickness", "right thickness", "MU"]
    assert _words(names, np.array([0.8, -0.6, 0.0])) == "left thickness with less right thickness"
    assert parameter(LEFT, "m", 1e-3, 2e-3, among=names)["label"] == "left thickness"
    told = {"identified": True, "value": 1e-3, "interval_95": (1e-3, 2e-3)}
    assert answer(RIGHT, "m", told, names)["label"] == "right thickness"


def test_a_design_that_moves_two_thicknesses_together_names_both() -> None:
    x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(0.0, 1.0, 3), np.linspace(0.0, 1.0, 3)))
    quality = design_quality(np.column_stack([x, x, y]), [LEFT, RIGHT, MU])
    assert "+0.71 left thickness +0.71 right thickness; +1.00 viscosity" in quality.sentence


def test_symbols_of_two_birds_keep_the_cards_name() -> None:
    names = ("first.viscosity", "second.viscosity")
    assert [symbol(name, names) for name in names] == ["first MU", "second MU"]
    assert [parameter_label(name, names) for name in names] == ["first viscosity MU", "second viscosity MU"]
