"""Registries: what installed packages add is checked when it is first needed, and its errors name the package."""

from __future__ import annotations

import functools
import importlib
import statistics  # noqa: F401 (a module with a file)
import sys
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any, ClassVar, Literal

import pytest

from birdstrike.data.errors import UserError
from birdstrike.effects import Effect, register, unregister
from birdstrike.solver.bird.materials.interface import BirdMaterial
from birdstrike.solver.bird.materials.registry import BIRD_MATERIALS
from birdstrike.solver.effects.registry import EFFECTS
from birdstrike.solver.fields import Between
from birdstrike.solver.registry import Kinds, Registry
from birdstrike.solver.sensors.registry import SENSORS
from birdstrike.solver.sensors.sensor import Sensor
from birdstrike.solver.sources import digest_files

LIBRARY = {"one": 1.0}

CURRENT: Any = None
"""What the entry point of a test refers to."""


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


class Noiseless(Sensor):
    """Says neither its noise nor its noun."""

    kind: Literal["noiseless"] = "noiseless"
    drift_range: ClassVar = Between("0 mm/s", "1 mm/s")


class Bodiless(BirdMaterial):
    """Says not which particles carry it."""

    model: Literal["bodiless"]


class Misnamed(BirdMaterial):
    """Its table answers to another name than its entry point."""

    model: Literal["gel"]
    body: ClassVar[str] = "fluid"


class Unnamed(BirdMaterial):
    """Its table answers to any name."""

    body: ClassVar[str] = "fluid"


@pytest.mark.parametrize(
    ("kinds", "name", "kind", "why"),
    [
        (SENSORS, "noiseless", Noiseless, "its class declares no noise_range, noun"),
        (BIRD_MATERIALS, "bodiless", Bodiless, "its class declares no body"),
        (BIRD_MATERIALS, "jelly", Misnamed, r'its class does not declare model: Literal\["jelly"\]'),
        (BIRD_MATERIALS, "jelly", Unnamed, r'its class does not declare model: Literal\["jelly"\]'),
        (BIRD_MATERIALS, "number", float, "it is no BirdMaterial"),
    ],
)
def test_a_kind_that_lacks_what_its_base_leaves_open_is_refused_when_it_is_loaded(
    monkeypatch: pytest.MonkeyPatch, kinds: Kinds[Any], name: str, kind: type[Any], why: str
) -> None:
    monkeypatch.setattr(f"{__name__}.CURRENT", kind)
    entries = [EntryPoint(name, f"{__name__}:CURRENT", "kinds")]
    monkeypatch.setattr("birdstrike.solver.registry.entry_points", lambda **_: entries)
    outside = Kinds(kinds.what, kinds.key, "kinds", {}, kinds.base)
    with pytest.raises(UserError, match=rf"of the installed package {__name__} cannot be used: {why}"):
        list(outside)


@pytest.mark.parametrize("kinds", [SENSORS, BIRD_MATERIALS])
def test_every_kind_of_the_library_would_be_accepted_from_outside(kinds: Kinds[Any]) -> None:
    assert {name: kinds.fault(name, kind) for name, kind in kinds.library.items()} == dict.fromkeys(kinds.library, "")


@pytest.fixture
def engine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A module that computes, and another, `facade`, that re-exports it; returns the digest of the first."""
    (tmp_path / "engine.py").write_text(
        "class Number(float):\n    pass\n\n\ndef change(case, x, key):\n    return {}\n"
    )
    (tmp_path / "facade.py").write_text("from engine import Number, change\n")
    monkeypatch.syspath_prepend(tmp_path)
    for name in ("engine", "facade"):
        monkeypatch.setitem(sys.modules, name, importlib.import_module(name))
    return digest_files(tmp_path, [tmp_path / "engine.py"])


def test_the_sources_are_those_of_the_module_that_defines_the_class(
    monkeypatch: pytest.MonkeyPatch, engine: str
) -> None:
    entries = [EntryPoint("n", "facade:Number", "numbers")]
    monkeypatch.setattr("birdstrike.solver.registry.entry_points", lambda **_: entries)
    found: Registry[type[float]] = Registry("number", "numbers", {}, type)
    assert found.sources(["n"]) == {"number n": engine}


def test_the_sources_of_an_effect_are_those_below_its_partials_and_wrappers(engine: str) -> None:
    change = importlib.import_module("facade").change

    @functools.wraps(change)
    def wrapped(case: Any, x: float, key: str) -> Any:
        return change(case, x, key)

    for function in (change, functools.partial(change, key="a"), functools.partial(wrapped, key="a")):
        register(Effect("own", "something of one's own", "", function, lambda _: 1.0))
        try:
            assert EFFECTS.sources(["own"]) == {"effect own": engine}
        finally:
            unregister("own")


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("none", 'cannot be named "none", as an answer calls the model without effects'),
        ("something_else", "as an answer calls what no effect of the library describes"),
        ("a.b", '"a.b" cannot be an effect\'s name; use letters, digits and _'),
    ],
)
def test_an_installed_effect_has_a_name_that_register_would_accept(
    monkeypatch: pytest.MonkeyPatch, name: str, why: str
) -> None:
    monkeypatch.setattr(f"{__name__}.CURRENT", Effect(name, "of a package", "", lambda *_: {}, lambda _: 1.0))
    entries = [EntryPoint("n", f"{__name__}:CURRENT", "birdstrike.effects")]
    monkeypatch.setattr("birdstrike.solver.registry.entry_points", lambda **_: entries)
    installed = type(EFFECTS)(EFFECTS.what, EFFECTS.group, {}, EFFECTS.base, EFFECTS.name_of, EFFECTS.code_of)
    with pytest.raises(UserError, match=rf"of the installed package {__name__} cannot be used: .*{why}"):
        list(installed)
