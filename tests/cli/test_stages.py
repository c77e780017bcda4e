"""Stages: done once, redone when their inputs change, kept when the flow breaks off."""

from __future__ import annotations

import importlib
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from birdstrike.data.progress import Progress
from birdstrike.effects import Effect, register, unregister
from birdstrike.solver.sources import digest_of_function
from birdstrike.stages import Ledger, Stage, digest, effects_digest, run_stages


class Flow:
    """Two stages that copy their input to their output, and count how often they run."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.ran = folder, list[str]()
        self.break_at = ""
        (folder / "a").write_text("1")

    def stage(self, name: str, source: str, target: str) -> Stage:
        """A stage whose input is the file `source`."""
        return Stage(
            name,
            name.title(),
            lambda: (self.folder / source).read_text(),
            (self.folder / target,),
            self.copy(name, source, target),
        )

    def copy(self, name: str, source: str, target: str) -> Callable[[Progress], None]:
        """The stage's work."""

        def run(progress: Progress) -> None:
            if name == self.break_at:
                raise KeyboardInterrupt
            self.ran.append(name)
            (self.folder / target).write_text((self.folder / source).read_text())
            progress(1.0)

        return run

    def go(self) -> dict[str, dict[str, object]]:
        """Run the flow; the ledger's stages."""
        ledger = Ledger(self.folder / "ledger.json")
        self.ran = []
        run_stages((self.stage("first", "a", "b"), self.stage("second", "b", "c")), ledger)
        return ledger.read()["stages"]


@pytest.fixture
def flow(tmp_path: Path) -> Flow:
    return Flow(tmp_path)


def test_what_is_valid_is_not_done_again(flow: Flow) -> None:
    assert {name: entry["reused"] for name, entry in flow.go().items()} == {"first": False, "second": False}
    assert flow.ran == ["first", "second"]
    assert {name: entry["reused"] for name, entry in flow.go().items()} == {"first": True, "second": True}
    assert flow.ran == []


def test_a_changed_input_is_followed_as_far_as_it_reaches(flow: Flow) -> None:
    flow.go()
    (flow.folder / "a").write_text("2")
    flow.go()
    assert flow.ran == ["first", "second"]
    (flow.folder / "b").write_text("3")
    flow.go()
    assert flow.ran == ["second"]
    assert (flow.folder / "c").read_text() == "3"


def test_a_lost_output_is_made_again(flow: Flow) -> None:
    flow.go()
    (flow.folder / "c").unlink()
    flow.go()
    assert flow.ran == ["second"]


def test_after_an_interruption_the_flow_resumes_behind_what_is_done(flow: Flow) -> None:
    flow.break_at = "second"
    with pytest.raises(KeyboardInterrupt):
        flow.go()
    assert flow.ran == ["first"]
    flow.break_at = ""
    flow.go()
    assert flow.ran == ["second"]


def test_a_damaged_ledger_costs_time_but_nothing_else(flow: Flow) -> None:
    flow.go()
    (flow.folder / "ledger.json").write_text("{")
    flow.go()
    assert flow.ran == ["first", "second"]
    assert json.loads((flow.folder / "ledger.json").read_text())["schema_version"] == 1


def test_digests_follow_the_content(tmp_path: Path) -> None:
    one, other = tmp_path / "one", tmp_path / "other"
    one.write_text("x")
    other.write_text("y")
    assert digest(one, other) != digest(other, one)


@pytest.mark.parametrize("size", [abs, "a".join, str.upper])
def test_an_effect_whose_size_is_a_builtin_has_a_digest(size: Callable[..., Any]) -> None:
    before = effects_digest()
    register(Effect("own_gap", "a gap", "m", lambda *_: {}, size))
    try:
        assert effects_digest() == effects_digest() != before
    finally:
        unregister("own_gap")
    assert effects_digest() == before


def test_where_an_effect_acts_alone_is_in_its_digest() -> None:
    found = []
    places: Any = dir
    alone: Any = vars
    for more in ({}, {"places": places}, {"places": places, "alone": alone}):
        register(Effect("own_gap", "a gap", "m", lambda *_: {}, abs, **more))
        found.append(effects_digest())
        unregister("own_gap")
    assert len(set(found)) == 3


def test_a_function_of_a_package_is_followed_through_all_files_of_the_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    package = tmp_path / "birds"
    package.mkdir()
    (package / "__init__.py").write_text("from birds.change import change\n")
    found = []
    for factor in (1.0, 1.0, 2.0):
        (package / "constants.py").write_text(f"FACTOR = {factor}\n")
        (package / "change.py").write_text("from birds.constants import FACTOR\n\ndef change(case, x): return {}\n")
        for name in [name for name in sys.modules if name.partition(".")[0] == "birds"]:
            del sys.modules[name]
        found.append(digest_of_function(importlib.import_module("birds").change))
    assert found[0] == found[1] != found[2], "the edit is in another file of the package"
