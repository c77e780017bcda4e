"""docs/cases.md against the models that read a case: current, complete, and true."""

from __future__ import annotations

import importlib
import re
import tomllib
from typing import Any

import pytest

from birdstrike.solver.case.sections import quantities, quantity_at
from tests.docs.pages import ROOT


@pytest.fixture
def say(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The script that writes the page; docs/ is no package."""
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    return importlib.import_module("case_keys")


def test_the_page_is_current(say: Any) -> None:
    assert say.PAGE.read_text(encoding="utf-8") == say.page(), "run: python docs/case_keys.py"


def test_every_key_has_a_meaning_and_every_meaning_a_key(say: Any) -> None:
    keys = {row[0].strip("`") for _, table in say.chapters() for row in table}
    assert [row[0] for _, table in say.chapters() for row in table if not row[4]] == []
    last = {key.rpartition(".")[2] for key in keys}
    said = {**say.PLATE, **say.TARGET, **say.BIRD, **say.STRIKE, **say.SENSORS, **say.SETTINGS, **say.EXTERNAL}
    assert set(said) <= keys
    assert {key.rpartition(".")[2] for key in (*say.NULL, *say.STRENGTH, *say.LAW)} <= last


def test_every_quantity_of_a_case_stands_on_it_with_its_unit(say: Any) -> None:
    units = {row[0].strip("`"): row[1] for _, table in say.chapters() for row in table}
    for key, _ in quantities():
        mark = quantity_at(key)
        assert mark is not None
        assert units[key] == (mark.shown or "number"), key


def test_the_template_names_the_page_that_has_its_keys() -> None:
    template = (ROOT / "data" / "templates" / "case.toml").read_text(encoding="utf-8")
    (named,) = re.findall(r"All keys: (\S+\.md)\.", template)
    page = (ROOT / named).read_text(encoding="utf-8")
    sections = [key for key, table in tomllib.loads(template).items() if isinstance(table, dict)]
    assert sections
    assert [section for section in sections if f"`{section}." not in page] == []
