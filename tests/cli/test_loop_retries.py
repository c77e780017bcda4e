"""close-the-loop does a stage again when the library of effects has changed, and when failed runs are to be retried."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from birdstrike.data.storage.store import RunStore
from birdstrike.doe.solvers import solver_for
from birdstrike.effects import Effect, effects, register, unregister
from birdstrike.solver.case.case import load_case
from birdstrike.solver.sensors.registry import SENSORS
from tests.cli.test_close_the_loop import RUNS, Solver, campaign_only, close, ledger, record, solver
from tests.diagnoses import effect, written_diagnosis
from tests.script import ROOT

__all__ = ["campaign_only", "record", "solver"]

OWN = """
from birdstrike.effects import Effect

def change(case, size):
    return {"plate": {"thickness": f"{case.plate.thickness + FACTOR * size!r} m"}}

EFFECT = Effect("rolling_tolerance", "another thickness of the sheet", "m", change, lambda case: 1e-4)
"""


@pytest.fixture
def diagnoses(monkeypatch: pytest.MonkeyPatch, campaign_only: None) -> list[str]:  # noqa: ARG001
    """A diagnosis in the place of the real one, which notes its effects; inversion and report are left out."""
    made: list[str] = []

    def diagnose(case: object, measured: object, out: Path, *_: object, **__: object) -> None:  # noqa: ARG001
        made.append(",".join(effects()))
        out.mkdir(parents=True, exist_ok=True)
        written_diagnosis(out, effect("impact_speed"), verdict="unexplained", sentence="No effect fits.")
        (out / "diagnosis.csv").write_text("time_s\n")

    monkeypatch.setattr("birdstrike.inversion.diagnosis.diagnose.diagnose", diagnose)
    return made


def module(folder: Path, name: str, factor: float) -> Effect:
    """An effect from a file of its own, loaded anew."""
    (folder / f"{name}.py").write_text(OWN.replace("FACTOR", repr(factor)))
    sys.modules.pop(name, None)
    return __import__(name).EFFECT


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[float], None]]:
    """Registers the effect of a file outside the tree, with a factor in its source."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)

    def registered(factor: float) -> None:
        unregister("rolling_tolerance")
        register(module(tmp_path, "own_effect", factor))

    yield registered
    unregister("rolling_tolerance")
    sys.modules.pop("own_effect", None)


@pytest.mark.usefixtures("solver")
def test_an_effect_that_is_registered_or_changed_makes_the_diagnosis_due(
    own: Callable[[float], None], diagnoses: list[str], record: Path, tmp_path: Path
) -> None:
    out = tmp_path / "loop"
    close(out, record)
    close(out, record)
    assert len(diagnoses) == 1, "nothing has changed"
    own(1.0)
    close(out, record)
    assert len(diagnoses) == 2
    assert diagnoses[-1].endswith("rolling_tolerance")
    close(out, record)
    assert len(diagnoses) == 2, "the same effect, from the same source"
    own(2.0)
    close(out, record)
    assert len(diagnoses) == 3, "the source of the effect has changed"
    assert ledger(out)["stages"]["doe"]["reused"]


@pytest.mark.usefixtures("diagnoses")
def test_a_retry_makes_the_campaign_due_again_and_completes_it(solver: Solver, record: Path, tmp_path: Path) -> None:
    out = tmp_path / "loop"
    solver.fails_above = 1500.0 * (1 - 1 / RUNS)
    close(out, record, diagnosis=False)
    before, solver.fails_above = solver.strikes, float("inf")
    close(out, record, diagnosis=False)
    assert solver.strikes == before, "the failure is on record"
    close(out, record, diagnosis=False, retry_failed=True)
    assert solver.strikes > before
    assert not ledger(out)["stages"]["doe"]["reused"]
    assert json.loads((out / "doe" / "summary.json").read_text())["failed"] == []


def installed_sensor(folder: Path, patch: pytest.MonkeyPatch, comment: str) -> None:
    """The sensor kind "mean_deflection" from a file outside the tree, loaded anew."""
    source = (Path(ROOT) / "tests/outside/gelatine/birdstrike_gelatine/sensor.py").read_text(encoding="utf-8")
    (folder / "own_sensor.py").write_text(f"{source}\n# {comment}\n", encoding="utf-8")
    sys.modules.pop("own_sensor", None)
    patch.setitem(SENSORS.own, "mean_deflection", (__import__("own_sensor").MeanDeflection, "own_sensor"))


@pytest.mark.usefixtures("solver")
def test_an_edit_of_an_installed_sensor_makes_campaign_inversion_and_diagnosis_due(
    diagnoses: list[str], record: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    out, kind = tmp_path / "loop", {"sensors.mean.kind": "mean_deflection"}
    for times, comment in enumerate(("as installed", "as installed", "edited")):
        installed_sensor(tmp_path, monkeypatch, comment)
        close(out, record, case=load_case("reference_strike", kind))
        stages = {name: stage["reused"] for name, stage in ledger(out)["stages"].items()}
        assert [stages[name] for name in ("doe", "inversion", "diagnosis")] == [times == 1] * 3
    assert len(diagnoses) == 2
    sys.modules.pop("own_sensor", None)


@pytest.mark.usefixtures("solver")
@pytest.mark.parametrize("cured", ["at half the step", "by another version", "not at all"])
def test_only_runs_that_failed_at_every_step_make_the_diagnosis_due_at_a_retry(
    cured: str, diagnoses: list[str], record: Path, tmp_path: Path
) -> None:
    out = tmp_path / "loop"
    close(out, record)
    store, version = RunStore(out / "diagnosis" / "runs"), solver_for(load_case("demo")).version
    meta = {"solver_version": "older" if cured == "by another version" else version, "attempts": ["full", "half"]}
    store.save_failure("full", "unstable", meta)
    if cured == "at half the step":
        campaign = RunStore(out / "doe" / "runs")
        histories = campaign.load(campaign.keys()[0])
        assert histories is not None
        store.save("half", histories)
    close(out, record)
    assert len(diagnoses) == 1, "no retry was asked for"
    close(out, record, retry_failed=True)
    assert len(diagnoses) == (2 if cured == "not at all" else 1)


@pytest.mark.usefixtures("solver")
def test_campaign_inversion_and_diagnosis_of_one_call_retry_what_failed_before_one_instant(
    record: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    instants: list[float] = []

    class Noted(Exception):
        """Ends the loop once all three have been asked."""

    def campaign(*_: object, retry: float, **__: object) -> None:
        instants.append(retry)

    def invert(*_: object, extras: Any, **__: object) -> None:
        instants.append(extras.retry)
        assert not extras.retry_failed

    def diagnose(*_: object, options: Any, retry_failed: bool = False, **__: object) -> None:
        instants.append(options.retry)
        assert not retry_failed
        raise Noted

    monkeypatch.setattr("birdstrike.doe.campaign.campaign.run_campaign", campaign)
    monkeypatch.setattr("birdstrike.inversion.train_and_invert.train_and_invert", invert)
    monkeypatch.setattr("birdstrike.inversion.diagnosis.diagnose.diagnose", diagnose)
    monkeypatch.setattr("birdstrike.loop.digest", lambda *_: "the files of stages that are left out")
    for asked in (True, False):
        instants.clear()
        with pytest.raises(Noted):
            close(tmp_path / f"loop{asked}", record, retry_failed=asked)
        assert len(instants) == 3
        assert len(set(instants)) == 1
        assert (instants[0] > 0.0) is asked
