"""Registries: what installed packages add is checked when it is first needed, and its errors name the package."""

from __future__ import annotations

import statistics  # noqa: F401 (a module with a file)
from importlib.metadata import EntryPoint

import pytest

from birdstrike.data.errors import UserError
from birdstrike.solver.registry import Registry

LIBRARY = {"one": 1.0}


def registry(monkeypatch: pytest.MonkeyPatch, **points: str) -> Registry[float]:
    """A registry of numbers with these entry points installed."""
    entries = [EntryPoint(name, value, "numbers") for name, value in points.items()]
    monkeypatch.setattr("birdstrike.solver.registry.entry_points", lambda group: entries if group == "numbers" else [])
    return Registry("number", "numbers", LIBRARY, float)


def test_the_library_comes_first_then_what_is_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert dict(registry(monkeypatch, circle="math:tau")) == {"one": 1.0, "circle": pytest.approx(6.2832, abs=1e-4)}


def test_what_the_library_has_is_found_without_loading_a_package(monkeypatch: pytest.MonkeyPatch) -> None:
    broken = registry(monkeypatch, broken="no_such_module:x")
    assert broken["one"] == 1.0
    with pytest.raises(UserError, match=r"the number no_such_module:x of the installed package .*ModuleNotFoundError"):
        broken.get("two")


@pytest.mark.parametrize(
    ("name", "value", "why"),
    [
        ("one", "math:tau", '"one" of the installed package math exists already'),
        ("root", "math:sqrt", "it is no float"),
    ],
)
def test_a_name_that_is_taken_and_a_thing_of_another_sort_are_refused(
    monkeypatch: pytest.MonkeyPatch, name: str, value: str, why: str
) -> None:
    with pytest.raises(UserError, match=why):
        list(registry(monkeypatch, **{name: value}))


def test_only_what_comes_from_outside_has_sources_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    found = registry(monkeypatch, circle="math:tau")
    found.own["mine"] = (2.0, "statistics")
    monkeypatch.setattr(found, "_installed", {})
    assert found.sources(["one"]) == {}
    assert found.sources(["one", "mine"]).keys() == {"number mine"}
