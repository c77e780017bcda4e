"""docs/cases.md against the models that read a case: current, complete, and true."""

from __future__ import annotations

from birdstrike.reports import case_keys as say
from birdstrike.reports.case_keys import PAGE, chapters, page
from birdstrike.solver.case.sections import quantities, quantity_at


def keys() -> list[str]:
    return [row[0].strip("`") for _, table in chapters() for row in table]


def test_the_page_is_current() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(), "run: python -m birdstrike.reports.case_keys"


def test_every_key_has_a_meaning_and_every_meaning_a_key() -> None:
    assert [row[0] for _, table in chapters() for row in table if not row[4]] == []
    last = {key.rpartition(".")[2] for key in keys()}
    said = {**say.PLATE, **say.BIRD, **say.STRIKE, **say.SENSORS, **say.SETTINGS, **say.EXTERNAL}
    assert set(said) <= set(keys())
    assert {key.rpartition(".")[2] for key in (*say.NULL, *say.STRENGTH, *say.LAW)} <= last


def test_every_quantity_of_a_strike_stands_on_it_with_its_unit() -> None:
    units = {row[0].strip("`"): row[1] for _, table in chapters() for row in table}
    for key, _ in quantities():
        mark = quantity_at(key)
        assert mark is not None
        assert units[key] == (mark.shown or "number"), key
