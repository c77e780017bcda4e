"""Whether two cases strike one structure, a mesh from a file wherever it stands; what cases say of their records."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from birdstrike.data.curves import Measured
from birdstrike.inversion.conditions import parts_of_one_shot, same_structure
from birdstrike.inversion.diagnosis.conclusions.baseline import unfit
from birdstrike.inversion.diagnosis.diagnose import apart
from birdstrike.inversion.prediction.distance import other_rig
from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.case.write import copy_case
from birdstrike.solver.target.generators.registry import GENERATORS


def panel(path: Path, shift: float = 0.0) -> Case:
    """The shipped panel with its mesh in a file; shift [m]: of the node nearest to the middle, out of its plane."""
    table = load_case("openradioss_panel", {"target.generator.element_size": "50 mm"}).table
    mesh = GENERATORS.validate(table["target"].pop("generator")).mesh()
    nodes = mesh.nodes.copy()
    nodes[np.linalg.norm(nodes - [0.0, 0.0, 0.0], axis=1).argmin(), 2] += shift
    path.parent.mkdir(parents=True, exist_ok=True)
    parts: dict[str, Any] = {name: [np.flatnonzero(mesh.part == i)] for i, name in enumerate(mesh.parts)}
    held: dict[str, Any] = {"edges": mesh.sets["edges"]}
    meshio.Mesh(nodes, [("quad", mesh.quads)], cell_sets=parts, point_sets=held).write(path)
    table["target"] |= {"mesh": str(path), "mesh_unit": "m"}
    return load_case(table)


@pytest.fixture
def learnt(tmp_path: Path) -> Case:
    return panel(tmp_path / "panel.inp")


def test_a_mesh_that_stands_elsewhere_is_the_same_structure(learnt: Case, tmp_path: Path) -> None:
    """A results folder holds a copy of the mesh: a prediction of the case at another speed called it another
    structure, and doubled the model's error; a baseline with a case of its own was left out.
    """
    (tmp_path / "out").mkdir()
    copy_case(learnt, tmp_path / "out")
    copied = load_case(tmp_path / "out" / "case.toml")
    assert copied.target is not None
    assert learnt.target is not None
    assert copied.target.mesh != learnt.target.mesh
    assert other_rig(copied, learnt) == ""
    assert same_structure(copied, learnt)
    assert apart(copied, learnt) == []
    time = np.linspace(0.0, learnt.time.end, 5)
    record = Measured(time, {"w_centre": time}, {}, {"w_centre": "m"})
    assert unfit(record, copied, learnt, ["w_centre"]) == ""


def test_another_prior_of_a_sought_parameter_is_named(learnt: Case) -> None:
    """Both cases were said to seek "900 .. 1000 kg/m³ (linear)"."""
    sought = {"range": ["900 kg/m^3", "1000 kg/m^3"]}
    known = sought | {"prior": {"mean": "938.2 kg/m^3", "sd": "3 kg/m^3"}}
    first, other = (learnt.overlaid({"inversion": {"parameters": {"bird.density": one}}}) for one in (sought, known))
    (said,) = apart(other, first)
    assert "is 900 .. 1000 kg/m³ (linear), prior 938.2 kg/m³ ± 3 kg/m³ in case" in said
    assert "and 900 .. 1000 kg/m³ (linear) in case" in said


def test_what_differs_of_a_target_is_named(learnt: Case, tmp_path: Path) -> None:
    moved = panel(tmp_path / "moved" / "panel.inp", shift=1e-4)
    assert other_rig(learnt, moved) == "target.mesh"
    assert not same_structure(learnt, moved)
    held = learnt.overlaid({"target": {"supports": {"edges": "pinned"}, "damping": "20 1/s"}})
    assert other_rig(learnt, held) == "target.supports, target.damping"


def test_another_thickness_of_the_struck_part_is_the_same_rig(learnt: Case) -> None:
    thick = learnt.overlaid({"target": {"parts": {"skin": {"thickness": "4 mm"}}}})
    assert other_rig(learnt, thick) == ""
    assert not same_structure(learnt, thick)
    stiff = learnt.overlaid({"target": {"parts": {"stiffeners": {"thickness": "4 mm"}}}})
    assert other_rig(learnt, stiff) == "target.parts"


def test_files_of_one_shot_are_told_from_two_shots() -> None:
    """Taken for two shots, they would count as two birds with clocks of their own."""
    case, faster = load_case("demo_rig"), load_case("demo_rig", {"impact.speed": "120 m/s"})

    def record(path: str, *sensors: str) -> Measured:
        curve = np.zeros(3)
        return Measured(np.arange(3.0), dict.fromkeys(sensors, curve), {}, dict.fromkeys(sensors, "m"), path=path)

    centre, quarter, both = record("a.csv", "centre"), record("b.csv", "quarter"), record("c.csv", "centre", "quarter")
    (said,) = parts_of_one_shot([centre, quarter, both], [case] * 3)
    assert "birdstrike import b.csv --beside a.csv" in said
    assert not list(parts_of_one_shot([centre, quarter], [case, faster]))
