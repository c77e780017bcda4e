"""docs/prior_sensitivity.py: a row a shot, a column a variant; a second call goes on where the first one stopped."""

from __future__ import annotations

import importlib
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from birdstrike.inversion.diagnosis.diagnose import DiagnosisOptions
from tests.docs.pages import ROOT


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The script; docs/ is no package."""
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    found = importlib.import_module("prior_sensitivity")
    monkeypatch.setattr(found, "process_pool", ThreadPoolExecutor)
    return found


def test_every_scale_is_a_prior_s_and_changes_one_alone(script: Any) -> None:
    for scales in script.VARIANTS.values():
        options = DiagnosisOptions(**scales)
        changed = [name for name in script.SCALES if getattr(options, name) != 1.0]
        assert changed == list(scales)


def test_table_has_a_row_a_shot_and_a_second_call_asks_nothing_again(
    script: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked: list[tuple[str, str]] = []

    def answer(
        case: str, shot: str, baseline: str | None, out: Path, variant: str, _: int | None = 1
    ) -> dict[str, Any]:
        assert (case, baseline, out) == ("rig", "clean.csv", tmp_path)
        asked.append((shot, variant))
        verdict = "attributed" if shot == "fast.csv" else "no_significant_residual"
        return {"verdict": verdict, "set": ["impact_speed"], "best": "impact_speed", "magnitude": 4.93}

    monkeypatch.setattr(script, "answer", answer)
    words = ["prior_sensitivity.py", "rig", "fast.csv", "quiet.csv", "--baseline", "clean.csv", "--out", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", words)
    script.main()
    assert len(asked) == len(set(asked)) == 2 * len(script.VARIANTS)
    rows = [row for row in capsys.readouterr().out.splitlines() if row.startswith(("| fast", "| quiet"))]
    assert rows[0].count("attributed impact_speed 4.93 (1 in the set)") == len(script.VARIANTS)
    assert rows[1].count("no significant residual (1 in the set)") == len(script.VARIANTS)
    script.main()
    assert len(asked) == 2 * len(script.VARIANTS)
