"""Whole files and plain JSON."""

from __future__ import annotations

import errno
import json
from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.histories import Snapshot
from birdstrike.data.storage.files import whole_file, write_json
from birdstrike.data.vtu import write_fields

NO_CELLS = np.empty((0, 8), np.int64)


def test_a_file_that_is_not_finished_does_not_replace_the_old_one(tmp_path: Path) -> None:
    path = tmp_path / "summary.json"
    path.write_text("old")

    def interrupted() -> None:
        with whole_file(path) as temporary:
            temporary.write_text("half of the n")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["summary.json"]


def test_a_full_disk_names_the_file_that_was_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "summary.json"

    def full() -> None:
        with whole_file(path):
            raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(OSError, match="No space") as caught:
        full()
    assert (caught.value.errno, caught.value.filename) == (errno.ENOSPC, str(path))
    path.mkdir()
    with pytest.raises(IsADirectoryError) as taken:
        write_json(path, {})
    assert taken.value.filename == str(path)
    assert [p.name for p in tmp_path.iterdir()] == ["summary.json"]


def test_json_has_a_schema_version_and_null_for_what_is_not_finite(tmp_path: Path) -> None:
    content = {"a": np.float64(1.5), "n": np.int64(3), "x": [np.nan, np.inf, 2.0], "b": np.bool_(True), "v": np.ones(2)}
    write_json(tmp_path / "r.json", content)
    found = json.loads((tmp_path / "r.json").read_text())
    assert found == {"schema_version": 1, "a": 1.5, "n": 3, "x": [None, None, 2.0], "b": True, "v": [1.0, 1.0]}


def test_vtu_files_hold_the_snapshot(tmp_path: Path) -> None:
    import meshio

    nodes = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    bird = np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]])
    quads, eroded, stress = np.array([[0, 1, 2, 3]]), np.array([False, True]), np.array([3e4, 0.0])
    snapshot = Snapshot(
        1e-3, bird, np.array([1e6, 2e6]), 9.0 * bird, eroded, stress, NO_CELLS, nodes, quads, np.array([5e7])
    )
    assert [p.name for p in write_fields(tmp_path, [snapshot])] == [
        "bird_0000.vtu",
        "plate_0000.vtu",
        "bird.pvd",
        "plate.pvd",
    ]
    points = meshio.read(tmp_path / "bird_0000.vtu")
    np.testing.assert_array_equal(points.points, bird)
    np.testing.assert_array_equal(points.point_data["pressure_Pa"], [1e6, 2e6])
    np.testing.assert_array_equal(points.point_data["eroded"], [0, 1])
    plate = meshio.read(tmp_path / "plate_0000.vtu")
    np.testing.assert_array_equal(plate.cells_dict["quad"], quads)
    np.testing.assert_array_equal(plate.cell_data_dict["von_mises_Pa"]["quad"], [5e7])
