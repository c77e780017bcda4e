"""Criteria, their intervals, and the reliability of the stated probabilities."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from birdstrike.inversion.audit.score import Score
from birdstrike.inversion.audit.tables import Criterion, by_truth, confusion, criteria, rate, reliability, tables
from birdstrike.reports.page.audit import audit_markdown, page, state

BASE = Score(
    name="a",
    draw="d0",
    channels=("displacement_centre",),
    shots=1,
    baseline="none",
    form="own model",
    kind="clean",
    what="",
    planted={},
    verdict="no_significant_residual",
    p=0.5,
    alarm=False,
    confidence_set=("none",),
    in_set=True,
)


def record(i: int, **changes: Any) -> Score:
    return replace(BASE, name=f"r{i}", draw=f"d{i}", **changes)


def single(i: int, **changes: Any) -> Score:
    whole = {
        "kind": "single",
        "planted": {"plate_thickness": 1e-4},
        "verdict": "ambiguous",
        "alarm": True,
        "signal": 5.0,
    }
    return record(i, **(whole | changes))


def criterion(found: list[Criterion], words: str) -> Criterion:
    return next(one for one in found if one.figure.startswith(words))


def test_records_of_one_truth_count_as_one() -> None:
    same = [replace(record(0, alarm=alarm), name=f"n{i}") for i, alarm in enumerate([True] * 5 + [False] * 5)]
    others = [record(i) for i in range(1, 5)]
    found = rate(by_truth([*same, *others], lambda s: s.alarm))
    assert found.value == pytest.approx(0.1)
    assert (found.curves, found.draws) == (5, 14)


def test_the_exact_interval_is_that_of_clopper_and_pearson() -> None:
    found = rate([np.array([1.0])] * 5 + [np.array([0.0])] * 95)
    assert found.exact_95 == pytest.approx((0.0164, 0.1128), abs=2e-4)  # Newcombe, Statist. Med. 17 (1998) 857


def test_false_alarms_are_met_only_by_an_interval_that_is_narrow_and_holds_the_rate() -> None:
    few = [record(i, alarm=i == 0) for i in range(20)]
    assert criterion(criteria(few, 0.05, 1, 1), "false alarms").met is False, "5 % of twenty is no measurement"
    many = [record(i, alarm=i % 20 == 0) for i in range(400)]
    assert criterion(criteria(many, 0.05, 1, 1), "false alarms").met is True
    loud = [record(i, alarm=i % 5 == 0) for i in range(400)]
    assert criterion(criteria(loud, 0.05, 1, 1), "false alarms").met is False


def test_criteria_at_a_signal_count_only_records_near_it_and_depend_on_the_sensors() -> None:
    scores = [single(i, rank=1 if i < 7 else 2, family_rank=1) for i in range(10)]
    scores += [single(100 + i, rank=9, family_rank=4, signal=20.0, alarm=False) for i in range(10)]
    found = criteria(scores, 0.05, 1, 1)
    assert criterion(found, "truth first").rate.value == pytest.approx(0.7)
    assert criterion(found, "truth first").met is True
    assert criterion(criteria(scores, 0.05, 4, 1), "truth first").met is False
    assert criterion(criteria(scores, 0.05, 1, 3), "truth first").words == "shown"
    assert criterion(found, "power of the alarm at 5").rate.value == 1.0


def test_what_was_not_measured_is_neither_met_nor_missed() -> None:
    for one in criteria([], 0.05, 4, 1):
        assert one.met is None
        assert one.rate.value is None


def test_excess_error_counts_where_one_effect_is_attributed() -> None:
    good = single(0, verdict="attributed", named="plate_thickness", error=(5.0, 1.0, 1.0))
    bad = single(1, error=(5.0, 5.0, 1.0))
    found = criterion(criteria([good, bad], 0.05, 1, 1), "excess error")
    assert found.rate.value == pytest.approx(0.0)
    assert found.met is True
    assert single(2, error=(1.0, 1.0, 2.0)).excess is None, "the oracle is no better: there is nothing to gain"


def stated(p: float, true_share: float, count: int) -> list[Score]:
    """Records of every kind in the prior's shares, each with one model of probability p that is true so often."""
    kinds = ["clean"] * 50 + ["single"] * 40 + ["pair"] * 5 + ["outside"] * 5
    rng = np.random.default_rng(3)
    return [record(i, kind=kinds[i % 100], probabilities=((p, bool(rng.random() < true_share)),)) for i in range(count)]


def test_probabilities_that_hold_are_told_from_those_that_do_not() -> None:
    honest, boasting = (next(d for d in reliability(stated(0.85, t, 400)) if d["truths"]) for t in (0.85, 0.6))
    assert honest["from"] == 0.8
    assert honest["within"]
    assert not boasting["within"]
    assert boasting["interval_95"][1] < 0.85


@pytest.mark.parametrize(("true", "within"), [(0.01, True), (0.03, False)])
def test_many_small_probabilities_of_each_truth_are_judged_by_how_many_they_are(true: float, within: bool) -> None:
    """Of 100 truths with 30 models at 0.01 each: by an interval of 100 yes and no three times as many held."""
    drawn = np.random.default_rng(0).random((100, 30)) < true
    scores = [
        single(i, probabilities=tuple((0.01, bool(one)) for one in row), in_set=True) for i, row in enumerate(drawn)
    ]
    assert reliability(scores)[0]["within"] is within


def test_kinds_are_weighted_to_the_prior() -> None:
    """Of 90 clean and 10 single records the prior expects 50 to 40."""
    clean = [record(i, probabilities=((0.55, True),)) for i in range(90)]
    lone = [single(100 + i, probabilities=((0.55, False),)) for i in range(10)]
    (found,) = (d for d in reliability([*clean, *lone]) if d["truths"])
    assert found["true"] == pytest.approx(0.5 / 0.9)


def test_the_confusion_s_rows_are_shares() -> None:
    scores = [single(0, in_set=True), single(1, in_set=False), single(2, verdict="attributed", named="edge_slip")]
    (row,) = confusion(scores).values()
    assert sum(row.values()) == pytest.approx(1.0)
    assert row["edge_slip"] == pytest.approx(1.0 / 3.0)
    assert row["ambiguous, truth not among them"] == pytest.approx(1.0 / 3.0)


def content(scores: list[Score], complete: bool) -> dict[str, Any]:
    return {
        "complete": complete,
        "wanted": 100,
        "records": len(scores),
        "failed": {},
        "alpha": 0.05,
        "draws": 1,
        "confirmed": True,
        "command": "birdstrike audit --out audit --make 2",
        "date": "2026-11-22",
        "code": "0" * 16,
        "solver_version": "1" * 12,
        "tables": tables(scores, 0.05),
    }


def test_tables_are_by_channels_shots_baseline_and_form() -> None:
    scores = [single(0), single(1, baseline="another"), single(2, shots=3), single(3, form="hexahedral bird")]
    scores.append(single(4, baseline="own"))
    assert list(tables(scores, 0.05)) == [
        "1 channel, 1 shot, without a baseline",
        "1 channel, 1 shot, with a baseline of another bird",
        "1 channel, 1 shot, with a baseline of its own bird",
        "1 channel, 3 shots, without a baseline",
        "1 channel, 1 shot, without a baseline, truth by another model",
    ]


def test_the_pages_say_how_far_the_audit_got_and_list_what_was_not_measured() -> None:
    scores = [single(0, probabilities=((0.7, True), (0.2, False)), rank=1), record(1)]
    text = audit_markdown(content(scores, complete=False))
    assert "has not been run to the end**: 2 records" in text
    assert "### 4 channels, 3 shots" in text
    assert "### 1 channel, 1 shot" not in text, "that table is there"
    assert "| power of the alarm at 5 | at least 95 % | not measured |" in text
    assert "plate_thickness +0.1 mm" in text
    assert state({**content(scores[:1], complete=True), "failed": {"a": "lost"}}) == (
        "1 record was diagnosed and scored. 1 further record has no answer."
    )
    whole = page(content(scores, complete=True))
    assert "not been run to the end" not in whole
    assert "Records of 1 channel, 1 shot, without a baseline" in whole
