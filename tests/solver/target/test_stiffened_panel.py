"""A generated panel: what is refused of its dimensions, what its sheets share, where its rivets lie."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from birdstrike.data.errors import CaseError
from birdstrike.solver.case.case import load_case
from birdstrike.solver.setup_warnings import sunk_sheets
from birdstrike.solver.target.generators.registry import GENERATORS
from birdstrike.solver.target.part_mesh import PartMesh

SKIN: dict[str, Any] = {"kind": "stiffened_panel", "length": "400 mm", "width": "300 mm", "element_size": "25 mm"}
BLADES = SKIN | {"stiffeners": 2, "pitch": "200 mm", "height": "40 mm"}
LAP = {"lap": "2 mm", "rivet_pitch": "25 mm"}
FEET = BLADES | LAP | {"section": "Z", "foot": "30 mm", "flange": "20 mm"}
PAD = SKIN | LAP | {"stiffeners": 0, "pad": ["100 mm", "150 mm"]}
JOINT = SKIN | LAP | {"stiffeners": 0, "overlap": "50 mm"}


def mesh_of(table: Mapping[str, Any]) -> PartMesh:
    return GENERATORS.validate(table).mesh()


def refused(table: Mapping[str, Any]) -> list[str]:
    return list(GENERATORS["stiffened_panel"].broken_rules(table, "generator"))


@pytest.mark.parametrize("table", [BLADES, FEET, PAD, JOINT, JOINT | PAD | {"pad_at": ["90 mm", "0 mm"]}])
def test_a_panel_with_room_for_all_is_taken(table):
    assert refused(table) == []


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (FEET | {"pitch": "380 mm"}, "foot = 30 mm of the last stiffener lies at 190 .. 220 mm along the length, bey"),
        (FEET | {"pitch": "25 mm"}, "foot = 30 mm reaches the next stiffener, generator.pitch = 25 mm away; a smaller"),
        (FEET | {"pitch": "40 mm", "flange": "40 mm"}, "flange = 40 mm reaches the next stiffener"),
        (FEET | {"height": "2 mm"}, "height = 2 mm is not above generator.lap = 2 mm: it counts from the skin's mid"),
        (FEET | {"height": "1 mm"}, "height = 1 mm is not above generator.lap = 2 mm"),
        (
            BLADES | {"length": "100 mm", "pitch": "50 mm", "radius": "40 mm"},
            "radius = 40 mm is not above the 40 mm by",
        ),
        (
            BLADES | {"length": "100 mm", "pitch": "50 mm", "radius": "35 mm"},
            "radius = 35 mm is not above the 40 mm by",
        ),
        (BLADES | {"radius": "50 mm"}, "radius = 50 mm closes the panel beyond half a circle; length is along the arc"),
        (
            JOINT | PAD,
            "pad = ['100 mm', '150 mm'] at -50 .. 50 mm along the length reaches the overlap of the skins at",
        ),
        (JOINT | PAD | {"pad_at": ["-74 mm", "0 mm"]}, "at -124 .. -24 mm along the length reaches the overlap"),
        (FEET | {"rivet_pitch": "301 mm"}, "rivet_pitch = 301 mm is above the 300 mm of generator.width = 300 mm"),
        (JOINT | {"rivet_pitch": "1 m"}, "rivet_pitch = 1 m is above the 300 mm of generator.width = 300 mm, along"),
        (PAD | {"rivet_pitch": "101 mm"}, "is above the 100 mm of generator.pad = ['100 mm', '150 mm'], along which"),
    ],
)
def test_dimensions_that_have_no_room_are_refused(table, said):
    (line,) = refused(table)
    assert line.startswith("generator.")
    assert said in line


@pytest.mark.parametrize(
    "table",
    [
        BLADES | {"stiffeners": 1},
        BLADES | {"stiffeners": 0},
        BLADES | {"joint": "10 mm", "lap": "2 mm", "rivet_pitch": "20 mm"},
        JOINT | PAD | {"pad_at": ["-75 mm", "0 mm"]},
    ],
)
def test_keys_without_use_and_sheets_that_touch_are_no_error(table):
    """Whoever varies the number of stiffeners leaves their pitch and height as they are."""
    assert not refused(table)


def test_riveted_sheets_share_no_node_even_where_they_touch():
    """A pad across a lap joint lies in the second skin: 20 of its 25 nodes were that skin's."""
    mesh = mesh_of(JOINT | PAD | {"pad": ["100 mm", "100 mm"]})
    number = {name: mesh.quads[mesh.part == place] for place, name in enumerate(mesh.parts)}
    assert not np.intersect1d(number["pad"], np.concatenate([number["skin"], number["skin_2"]])).size


def points_of(table: Mapping[str, Any], row: str) -> list[tuple[float, float]]:
    """Places of a row in plan [mm], rising."""
    found = np.vstack([one.points for one in mesh_of(table).rows[row]])
    return sorted((float(x), float(y)) for x, y in np.round(1e3 * found[:, :2], 6) + 0.0)


def test_rivets_of_feet_lie_in_their_middle_and_half_a_pitch_from_the_ends():
    lines = [-100.0 + 15.0, 100.0 + 15.0]
    assert points_of(FEET | {"rivet_pitch": "100 mm"}, "stiffeners") == [(x, y) for x in lines for y in (-100, 0, 100)]


def test_rivets_of_a_pad_lie_half_a_pitch_from_its_rim_each_once():
    along, across = (-25.0, 25.0), (-50.0, 0.0, 50.0)
    assert points_of(PAD | {"rivet_pitch": "50 mm"}, "pad") == [(x, y) for x in along for y in across]
    narrow = PAD | {"pad": ["100 mm", "250 mm"], "rivet_pitch": "100 mm"}
    assert points_of(narrow, "pad") == [(0.0, -50.0), (0.0, 50.0)], "one line, of which each rivet was there twice"


@pytest.mark.parametrize(("cells", "size"), [(8, "20 mm"), (5, "30 mm")])
def test_the_nodes_of_a_load_cell_lie_side_by_side(cells, size):
    """Neighbours along the rim: one fewer than its nodes."""
    table = {"kind": "flat_plate", "length": "480 mm", "width": "360 mm", "element_size": size, "cells": cells}
    mesh, step = mesh_of(table), float(size.split()[0]) * 1e-3
    for number in range(1, cells + 1):
        cell = mesh.nodes[mesh.sets[f"cell_{number}"]]
        apart = np.linalg.norm(cell[:, None] - cell[None], axis=2)
        assert np.count_nonzero(apart < 1.01 * step) - len(cell) == 2 * (len(cell) - 1), f"cell_{number}"


RIVETS = {"tension_strength": "4 kN", "shear_strength": "4 kN"}


def padded(lap: str, **of_row: Any) -> dict[str, Any]:
    """A case of a panel with a thick pad."""
    pad = {"thickness": "20 mm", "material": "aluminium"}
    generator = LAP | {"pad": ["100 mm", "100 mm"], "lap": lap}
    target = {"generator": generator, "parts": {"pad": pad}, "rivets": {"pad": RIVETS | of_row}}
    return {"extends": "openradioss_panel", "target": target}


def test_sheets_that_lie_in_each_other_are_told():
    (said,) = sunk_sheets(load_case(padded("0.1 mm")))
    assert (
        "target.generator.lap = 0.1 mm, and skin and pad, joined by the rivets of pad, lie on each other at 11.5"
        in said
    )
    assert sunk_sheets(load_case(padded("11.5 mm"))) == []
    assert sunk_sheets(load_case("sidewall_004")) == []


def test_places_for_a_row_that_the_generator_places_are_refused():
    own = {"parts": ["skin", "pad"], "start": ["0 mm"] * 3, "end": ["9 mm", "0 mm", "0 mm"], "pitch": "5 mm"}
    with pytest.raises(CaseError) as caught:
        load_case(padded("11.5 mm", **own))
    assert "has rivets.pad with parts, start, end and pitch, and the generator places a row of that name" in str(
        caught.value
    )
