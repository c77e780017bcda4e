"""What the player is given of an assembly: nodes where they moved to, failed shells marked, the section."""

from __future__ import annotations

import base64
from dataclasses import replace

import numpy as np

from birdstrike.reports.figures.cut import Sheets
from birdstrike.reports.figures.views import Scene
from birdstrike.reports.sections import animation
from birdstrike.solver.target.mesh import rectangle, shell_mesh
from tests.reports.synthetic import strike

GRID, ONE = rectangle(0.2, 0.1, (10, 4))
RESTING = np.concatenate([np.column_stack([GRID, np.full(len(GRID), z)]) for z in (0.0, -0.03)])
QUADS = np.concatenate([ONE, ONE + len(GRID)])
MESH = replace(shell_mesh(RESTING, QUADS), parts={"skin": np.arange(40), "inner_skin": np.arange(40, 80)})
SCENE = Scene(RESTING, 0.002, 0.008, 1.0, Sheets.of(MESH, 0.002))
FAILED = 17


def snapshots():
    """At rest, and bent with a failed facet whose own corner has flown off."""
    rest = replace(strike().snapshots[0], nodes=RESTING, quads=QUADS, plate_stress=np.zeros(80))
    bent = RESTING - [0.0, 0.0, 0.02] * np.cos(np.pi * RESTING[:, :1] / 0.2)
    return rest, replace(rest, nodes=bent, quads=np.delete(QUADS, FAILED, axis=0), plate_stress=np.zeros(79))


def test_nodes_reach_the_player_where_they_moved_to():
    seen = snapshots()
    box = animation._box({"bird": seen})
    packed = np.frombuffer(base64.b64decode(animation._nodes(seen, box)), "<u2").reshape(2, -1, 3)
    low, high = box
    found = low + packed / 65535.0 * (high - low)
    assert np.abs(found - np.stack([s.nodes for s in seen])).max() < 1e-5 * 0.2


def test_a_failed_shell_is_gone_from_mesh_and_section():
    seen = snapshots()
    scales = animation._scales({"bird": seen}, SCENE)
    plate = animation._plate(seen, scales, SCENE)
    steps = np.frombuffer(base64.b64decode(plate["shells"]), "u1").reshape(2, 80)
    assert np.flatnonzero(steps[0] == animation.GONE).size == 0
    assert np.flatnonzero(steps[1] == animation.GONE).tolist() == [FAILED]
    crossed = FAILED in animation.section_outlines(seen[0], SCENE)[2]
    assert [len(outlines) // 9 for outlines in plate["cuts"]] == [20, 19 if crossed else 20]
    assert crossed


def test_a_mesh_of_many_nodes_has_fewer_instants_but_the_first_and_the_last():
    seen = {"bird": snapshots() * 30}
    kept = animation._thinned(seen, animation.MOST_MESH // (3 * 20))["bird"]
    assert len(kept) == 20
    assert kept[0] is seen["bird"][0]
    assert kept[-1] is seen["bird"][-1]
