"""close-the-loop does a stage again when the library of effects has changed, and when failed runs are to be retried."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from birdstrike import close_the_loop
from birdstrike.effects import Effect, effects, register, unregister
from tests.cli.test_close_the_loop import RUNS, Solver, ledger, record, short_page, solver

__all__ = ["record", "short_page", "solver"]

OWN = """
from birdstrike.effects import Effect

def change(case, size):
    return {"plate": {"thickness": f"{case.plate.thickness + FACTOR * size!r} m"}}

EFFECT = Effect("rolling_tolerance", "another thickness of the sheet", "m", change, lambda case: 1e-4)
"""


@pytest.fixture
def diagnoses(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """A diagnosis in the place of the real one, which notes its effects; inversion and report are left out."""
    made: list[str] = []

    def diagnose(case: object, measured: object, out: Path, *_: object, **__: object) -> None:  # noqa: ARG001
        made.append(",".join(effects()))
        out.mkdir(parents=True, exist_ok=True)
        content = {"verdict": "unexplained", "confidence_set": [], "sentence": "No effect fits."}
        (out / "diagnosis.json").write_text(json.dumps(content))
        (out / "diagnosis.csv").write_text("time_s\n")

    def invert(plan: Any, _: object) -> None:
        plan.inversion.mkdir(parents=True, exist_ok=True)
        for name in ("inversion.json", "verification.csv"):
            (plan.inversion / name).write_text("{}")

    monkeypatch.setattr("birdstrike.inversion.diagnosis.diagnose.diagnose", diagnose)
    monkeypatch.setattr("birdstrike.loop._inversion", invert)
    monkeypatch.setattr("birdstrike.loop._report", lambda plan, _: plan.report.write_text("a page"))
    monkeypatch.setattr("birdstrike.loop.conclude", lambda plan: plan.ledger.read())
    return made


def close(out: Path, measured: Path, **options: Any) -> dict[str, Any]:
    asked = {"design": "lhs", "runs": RUNS, "workers": 1, "say": lambda _: None, **options}
    return close_the_loop("demo", measured, out, **asked)


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
