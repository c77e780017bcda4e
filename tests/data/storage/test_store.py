"""The run store: whole files or none, damage found, failures kept, keys that follow what changes a history."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.histories import Histories, Snapshot
from birdstrike.data.storage.store import RunStore, run_key

ROOT = Path(__file__).resolve().parents[2]


def a_run() -> Histories:
    time = 5e-6 * np.arange(20.0)
    rng = np.random.default_rng(1)
    picture = Snapshot(
        1e-4,
        rng.normal(size=(7, 3)),
        rng.normal(size=7) * 1e6,
        rng.normal(size=(7, 3)),
        np.arange(7) > 4,
        rng.normal(size=7) * 1e6,
        np.empty((0, 8), np.int64),
        rng.normal(size=(9, 3)),
        np.array([[0, 1, 4, 3], [1, 2, 5, 4]]),
        rng.normal(size=2) * 1e6,
    )
    channels = {"w": rng.normal(size=20), "contact_force": rng.normal(size=20)}
    summary = {"steps": 3, "energy_error": 1e-3, "peak": {"w": {"value": 1.0, "time": np.float64(2.0)}}}
    return Histories(time, channels, {"w": "m", "contact_force": "N"}, summary, (picture,))


def test_a_saved_run_loads_with_every_bit_of_its_curves(tmp_path: Path) -> None:
    store = RunStore(tmp_path / "runs")
    store.save("a" * 32, a_run(), {"run": 4})
    loaded = store.load("a" * 32)
    assert loaded is not None
    np.testing.assert_array_equal(loaded.time, a_run().time)
    assert list(loaded.channels) == ["w", "contact_force"]
    for name, values in a_run().channels.items():
        np.testing.assert_array_equal(loaded.channels[name], values)
    assert loaded.units == a_run().units
    assert loaded.summary == {"steps": 3, "energy_error": 1e-3, "peak": {"w": {"value": 1.0, "time": 2.0}}}
    assert store.meta("a" * 32) == {"run": 4}
    assert store.keys() == ["a" * 32]


def test_snapshots_keep_single_precision_and_all_their_numbers(tmp_path: Path) -> None:
    store = RunStore(tmp_path)
    store.save("k", a_run())
    loaded = store.load("k")
    assert loaded is not None
    (kept,), (given,) = loaded.snapshots, a_run().snapshots
    assert kept.time == given.time
    np.testing.assert_allclose(kept.particles, given.particles, rtol=1e-7)
    np.testing.assert_allclose(kept.plate_stress, given.plate_stress, rtol=1e-7)
    np.testing.assert_array_equal(kept.quads, given.quads)
    np.testing.assert_array_equal(kept.eroded, given.eroded)
    assert kept.quads.dtype == np.int64
    assert kept.particles.dtype == np.float64


def test_an_absent_run_is_none(tmp_path: Path) -> None:
    assert RunStore(tmp_path / "nowhere").load("k") is None


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_a_truncated_file_is_set_aside_and_the_run_can_be_saved_again(tmp_path: Path, share: float) -> None:
    store = RunStore(tmp_path)
    store.save("k", a_run())
    whole = store.path("k").read_bytes()
    store.path("k").write_bytes(whole[: int(share * len(whole))])
    with pytest.warns(UserWarning, match=r"set aside as k\.h5\.corrupt"):
        assert store.load("k") is None
    assert (tmp_path / "k.h5.corrupt").exists()
    store.save("k", a_run())
    assert store.load("k") is not None


def test_a_flipped_byte_in_a_curve_is_found_by_the_checksum(tmp_path: Path) -> None:
    store = RunStore(tmp_path)
    store.save("k", a_run())
    content = bytearray(store.path("k").read_bytes())
    place = content.find(a_run().channels["w"].tobytes())
    assert place > 0
    content[place + 3] ^= 1
    store.path("k").write_bytes(bytes(content))
    with pytest.warns(UserWarning, match="checksum"):
        assert store.load("k") is None


def test_looking_a_damaged_run_up_leaves_it_as_it_is(tmp_path: Path) -> None:
    store = RunStore(tmp_path)
    assert store.look_up("k") is None
    store.save("k", a_run())
    assert store.look_up("k") is not None
    store.path("k").write_bytes(b"scrambled")
    with pytest.warns(UserWarning, match="left as it is and not used"):
        assert store.look_up("k") is None
    assert [(p.name, p.read_bytes()) for p in tmp_path.iterdir()] == [("k.h5", b"scrambled")]


FULL = """
import resource, sys
from pathlib import Path
from birdstrike.data.storage.store import RunStore
sys.path.insert(0, sys.argv[2])
from test_store import a_run

resource.setrlimit(resource.RLIMIT_FSIZE, (2048, 2048))
try:
    RunStore(Path(sys.argv[1])).save("k", a_run())
except OSError as error:
    print(error.filename)
"""


def test_a_full_disk_is_an_error_that_names_the_run_and_leaves_nothing(tmp_path: Path) -> None:
    program = [sys.executable, "-B", "-c", FULL, str(tmp_path), str(Path(__file__).parent)]
    ended = subprocess.run(program, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stdout.strip()) == (0, str(tmp_path / "k.h5")), ended.stderr
    assert list(tmp_path.iterdir()) == []


KILLED = """
import os, signal, sys
from pathlib import Path
from birdstrike.data.storage import store
from birdstrike.data.storage.store import RunStore
sys.path.insert(0, sys.argv[2])
from test_store import a_run

written = store.write_run
def write_then_die(path, histories, meta):
    written(path, histories, meta)
    os.kill(os.getpid(), signal.SIGKILL)
store.write_run = write_then_die
RunStore(Path(sys.argv[1])).save("k", a_run())
"""


def test_a_kill_between_writing_and_renaming_leaves_the_old_run(tmp_path: Path) -> None:
    store = RunStore(tmp_path)
    store.save("k", a_run())
    before = store.path("k").read_bytes()
    program = [sys.executable, "-c", KILLED, str(tmp_path), str(Path(__file__).parent)]
    ended = subprocess.run(program, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ended.returncode == -9, ended.stderr
    assert store.path("k").read_bytes() == before
    assert store.keys() == ["k"]
    assert len(list(tmp_path.glob(".k.h5.*.tmp"))) == 1


def test_an_exception_while_writing_leaves_no_trace(tmp_path: Path) -> None:
    store = RunStore(tmp_path)
    broken = a_run()
    broken = Histories(broken.time, {"w": np.array([object()])}, {"w": "m"})
    with pytest.raises(TypeError):
        store.save("k", broken)
    assert list(tmp_path.iterdir()) == []


def test_a_failure_is_on_record_with_its_reason(tmp_path: Path) -> None:
    store = RunStore(tmp_path)
    assert store.failure("k") is None
    store.save_failure("k", "the run went unstable at 0.4 ms", {"run": 7})
    assert store.failure("k") == "the run went unstable at 0.4 ms"
    assert json.loads((tmp_path / "k.failed.json").read_text())["run"] == 7
    assert store.load("k") is None


def test_stores_merge_by_copying(tmp_path: Path) -> None:
    one, other = RunStore(tmp_path / "one"), RunStore(tmp_path / "other")
    one.save("a", a_run())
    other.save("b", a_run())
    shutil.copytree(one.folder, other.folder, dirs_exist_ok=True)
    assert other.keys() == ["a", "b"]
    assert other.load("a") is not None


def test_a_key_follows_case_version_and_step_factor_and_nothing_else() -> None:
    canonical = {"plate": {"thickness": 0.01, "elements": [50, 40]}, "bird": {"density": 900.0}}
    turned = {"bird": {"density": 900.0}, "plate": {"elements": (50, 40), "thickness": 0.01}}
    key = run_key(canonical, "v1", 1.0)
    assert len(key) >= 16
    assert run_key(turned, "v1", 1) == key
    others = [
        run_key({**canonical, "bird": {"density": np.nextafter(900.0, 901.0)}}, "v1", 1.0),
        run_key(canonical, "v2", 1.0),
        run_key(canonical, "v1", 0.5),
    ]
    assert len({key, *others}) == 4
