"""Sensors at points in space: displacement along a direction, strain on a web, whichever way its shells are wound."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from birdstrike.solver.build import build_plate
from birdstrike.solver.case.case import load_case
from birdstrike.solver.sensors.recording import readings
from birdstrike.solver.sensors.registry import SENSORS
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.shell_block import ShellBlock

ON_WEB = {"point": ["100 mm", "30 mm", "-20 mm"], "part": "stiffeners"}
ON_SKIN = {"point": ["20 mm", "30 mm", "0 mm"], "part": "skin", "along": [1.0, 0.0, 0.0]}


def panel() -> Target:
    return build_plate(load_case("openradioss_panel", {"target.generator.element_size": "20 mm"}))


def wound_anyhow() -> Target:
    """The panel with every other shell wound the other way."""
    plate = panel()
    quads = plate.shells.quads.copy()
    quads[::2] = quads[::2][:, [0, 3, 2, 1]]
    plate.blocks[0] = ShellBlock(plate.mesh.nodes, quads, plate.shells.sections, plate.shells.section, True)
    plate.quads, plate.mesh.quads[:] = quads, quads
    return plate


def read(
    plate: Target, sensors: dict[str, dict[str, Any]], gradient: np.ndarray, bend: float = 0.0
) -> dict[str, float]:
    """Readings after one step of 1 s of the displacement field gradient @ x, and of bending about y."""
    run: Any = SimpleNamespace(plate=plate, contact=SimpleNamespace(side=1, spacing=5e-3))
    found = readings({name: SENSORS.validate(table) for name, table in sensors.items()}, run)
    plate.v[:] = plate.x @ gradient.T
    if bend:
        plate.v[:, 2] += 0.5 * bend * plate.x[:, 0] ** 2
        plate.omega[:, 1] -= bend * plate.x[:, 0]
    plate.x[:] += plate.v
    plate.update_forces(1.0)
    return {name: reading(run) for name, reading in found.items()}


def test_displacement_of_a_web_along_a_direction():
    gradient = 1e-6 * np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]])
    sensors = {
        "sideways": {"kind": "displacement", "along": [1.0, 0.0, 0.0], **ON_WEB},
        "push": {"kind": "displacement", **ON_WEB},
        "slanted": {"kind": "displacement", "along": [0.0, 0.6, 0.8], **ON_WEB},
    }
    moved = gradient @ np.array([0.1, 0.03, -0.02])
    found = read(panel(), sensors, gradient)
    assert found["sideways"] == pytest.approx(moved[0])
    assert found["push"] == pytest.approx(-moved[2])
    assert found["slanted"] == pytest.approx(0.6 * moved[1] + 0.8 * moved[2])


@pytest.mark.parametrize("target", [panel, wound_anyhow])
def test_strain_of_a_web_along_and_across_it(target):
    """A uniform field: each direction reads its own strain, on both sides alike."""
    gradient = np.diag([1e-6, 2e-6, 3e-6])
    sensors = {
        f"{name}_{side}": {"kind": "strain", "along": along, "side": side, **ON_WEB}
        for name, along in (("along", [0.0, 1.0, 0.0]), ("down", [0.0, 0.0, -1.0]))
        for side in ("impact", "back")
    }
    found = read(target(), sensors, gradient)
    for side in ("impact", "back"):
        assert found[f"along_{side}"] == pytest.approx(2e-6, rel=1e-3)
        assert found[f"down_{side}"] == pytest.approx(3e-6, rel=1e-3)


@pytest.mark.parametrize("target", [panel, wound_anyhow])
def test_bending_strains_the_sides_of_the_skin_oppositely(target):
    """w'' = 1e-4/m on 3 mm: -1.5e-7 on the impact side where the skin is dished upwards, +1.5e-7 on its back."""
    sensors = {side: {"kind": "strain", "side": side, **ON_SKIN} for side in ("impact", "back")}
    found = read(target(), sensors, np.zeros((3, 3)), bend=1e-4)
    assert found["impact"] == pytest.approx(-1.5e-7, rel=0.02)
    assert found["back"] == pytest.approx(1.5e-7, rel=0.02)
