"""What the captions of the pictures say is what the pictures show."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from birdstrike.reports.results.results import Results
from birdstrike.reports.sections import animation, pictures
from birdstrike.solver.build import rest_mesh
from tests.reports.synthetic import strike
from tests.solver.test_struck_plane import about_y
from tests.solver.test_struck_plane import strike as aslant_strike


def test_the_shapes_are_dated_by_the_snapshots_that_are_shown(results: Results) -> None:
    snapshots = strike(instants=(0.6e-3, 1.2e-3, 1.8e-3, 2.1e-3)).snapshots
    scene = pictures._scene(results, snapshots)
    picture = pictures._shapes(results, {"elastic": snapshots}, scene)
    assert picture.caption.startswith("Simulated bird and plate from the front at 0.60, 1.20, 1.80, 2.10 ms, ")
    assert "along the plate at 2.10 ms: elastic " in picture.caption


def test_the_largest_displacement_is_that_of_the_instants_in_motion(results: Results) -> None:
    """A sensor's peak between two of them may be larger."""
    snapshots = strike().snapshots
    caption = animation._caption({"elastic": snapshots}, pictures._scene(results, snapshots), solid=False)
    assert "Largest displacement anywhere on the plate at these instants: elastic " in caption


def test_the_displacement_of_a_turned_plate_counts_in_the_push(results: Results, tmp_path: Path) -> None:
    """An upright plate that was pushed in by 2 mm showed 0; it was drawn in the axes of space, edge on from above."""
    case = aslant_strike(tmp_path, 90.0)
    normal, resting = about_y(90.0)[:, 2], rest_mesh(case).nodes
    bird = {"particles": 0.1 * np.tile(normal, (3, 1)), "velocity": -100.0 * np.tile(normal, (3, 1))}
    flown = replace(strike().snapshots[0], nodes=resting - 0.002 * normal, **bird)
    (seen,) = pictures.along_plate([flown], case.struck_plane)
    scene = pictures._scene(replace(results, case=case), [seen])
    assert animation.deflection(seen, scene) == pytest.approx(2.0)
    assert np.abs(scene.resting[:, 2]).max() < 1e-9, "no height above itself"
    assert np.ptp(scene.resting[:, :2], axis=0) == pytest.approx(np.sort(np.ptp(resting, axis=0))[:0:-1], rel=1e-9)
    assert scene.up == 1.0, "the bird comes from above"


def test_a_bird_s_extent_is_compared_with_what_it_was_in_the_same_direction(results: Results) -> None:
    """Of an oblique impact the length along the plate stood beside the length along the bird's own axis."""
    snapshots = strike(instants=(0.0, 1.2e-3)).snapshots
    caption = pictures._shapes(results, {"elastic": snapshots}, pictures._scene(results, snapshots)).caption
    assert f"{pictures._length(snapshots[0])} at 0 ms" in caption
    assert "262 mm" not in caption
