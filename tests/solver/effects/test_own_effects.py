"""Effects of one's own: on which sections of a case they act, and how one that acts elsewhere is refused."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import deepcopy
from typing import Any

import pytest

from birdstrike.data.errors import CaseError, UnitError, UserError
from birdstrike.effects import Effect, register, unregister
from birdstrike.inversion.diagnosis.preparation.plan import library
from birdstrike.solver.case.case import Case, case_hash, load_case

CASE = load_case("virtual_strike")
Change = Callable[[Case, float], dict[str, object]]


@pytest.fixture
def own() -> Iterator[Callable[[Change], None]]:
    """Registers an effect `own` with this change."""

    def add(change: Change) -> None:
        register(Effect("own", "something of one's own", "", change, lambda _: 1.0))

    yield add
    unregister("own")


def test_an_effect_moves_a_sensor(own: Callable[[Change], None]) -> None:
    """A gauge that sits elsewhere than declared is an effect like any other, in the case and in its hash."""
    own(lambda _, x: {"sensors": {"displacement_centre": {"at": [f"{x} mm", "0 mm"]}}})
    moved = CASE.with_effects({"own": 7.0})
    assert moved.sensors["displacement_centre"].place == (pytest.approx(0.007), 0.0)
    assert list(moved.sensors) == list(CASE.sensors)
    assert case_hash(moved) != case_hash(CASE)
    sections = moved.canonical()
    del sections["sources"]  # of the effect itself
    assert moved.resolved().canonical() == sections


def test_an_effect_moves_one_of_the_default_sensors(own: Callable[[Change], None]) -> None:
    default = CASE.overlaid({"sensors": {}})
    own(lambda _, x: {"sensors": {"displacement_centre": {"at": [f"{x} mm", "0 mm"]}}})
    bare = load_case("reference_strike", {"sensors": "{}"})
    moved = bare.with_effects({"own": 7.0})
    assert list(moved.sensors) == ["displacement_centre", "contact_force", "reaction_force"]
    assert moved.sensors["displacement_centre"].place == (pytest.approx(0.007), 0.0)
    assert list(default.sensors) == list(CASE.sensors)


def test_an_effect_changes_a_numerical_setting(own: Callable[[Change], None]) -> None:
    own(lambda case, x: {"solver": {"shock_linear": case.solver.shock_linear * (1.0 + x)}})
    changed = CASE.with_effects({"own": 0.5})
    assert changed.solver.shock_linear == pytest.approx(1.5 * CASE.solver.shock_linear)
    assert case_hash(changed) != case_hash(CASE)


def test_an_effect_that_would_change_what_is_recorded_is_refused_with_the_reason(own: Callable[[Change], None]) -> None:
    own(lambda case, x: {"time": {"end": f"{case.time.end * (1.0 + x)} s"}})
    with pytest.raises(
        CaseError, match=r"effects\.own = .*`change` sets time; an effect acts on plate, target, bird, impact, "
    ):
        CASE.with_effects({"own": 0.1})


@pytest.mark.parametrize(("unit", "why"), [("mm", 'give the magnitude in "m"'), ("furl", '"furl"')])
def test_a_unit_in_which_no_case_could_state_the_effect_is_refused(unit: str, why: str) -> None:
    with pytest.raises(UnitError, match=why):
        Effect("own", "something of one's own", unit, lambda *_: {}, lambda _: 1.0)


@pytest.mark.parametrize(("key", "known"), [("family", "support, plate, impact"), ("scope", "shot, bird, plate")])
def test_a_family_or_scope_that_no_answer_has_is_refused(key: str, known: str) -> None:
    with pytest.raises(UserError, match=f"its `{key}` is 'engine'; known: {known}"):
        Effect("own", "something", "", lambda _, __: {}, lambda _: 1.0, **{key: "engine"})  # pyright: ignore[reportArgumentType]


def test_what_is_no_effect_and_a_name_of_an_answer_are_refused_with_what_to_do() -> None:
    with pytest.raises(TypeError, match=r"3 is no effect; write register\(Effect\("):
        register(3)  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match='cannot be named "none", as an answer calls the model without effects'):
        register(Effect("none", "something of one's own", "", lambda *_: {}, lambda _: 1.0))


@pytest.mark.parametrize("error", [AssertionError("no"), RuntimeError("no"), OSError("no"), StopIteration("no")])
def test_whatever_an_effect_of_ones_own_raises_is_an_error_of_the_case(
    own: Callable[[Change], None], error: Exception
) -> None:
    def change(_: Case, __: float) -> dict[str, object]:
        raise error

    own(change)
    said = rf"effects\.own = .* `change` failed: {type(error).__name__}: no; correct it in {__name__}"
    with pytest.raises(CaseError, match=said):
        CASE.with_effects({"own": 0.1})


@pytest.mark.parametrize("name", ["size", "least", "refuses", "places"])
def test_what_is_no_function_of_the_case_is_refused_where_the_effect_is_written(name: str) -> None:
    given: dict[str, Any] = {"size": lambda _: 1.0, name: 1.0}
    said = rf'effect "own": its `{name}` is 1.0 and must be a function of the case; .*{name}=lambda case: 1.0'
    with pytest.raises(UserError, match=said):
        Effect("own", "something of one's own", "", lambda *_: {}, **given)
    with pytest.raises(UserError, match="its `change` is None and must be a function"):
        Effect("own", "something of one's own", "", None, lambda _: 1.0)  # pyright: ignore[reportArgumentType]


def broken(_: object) -> Any:
    raise RuntimeError("no")


@pytest.mark.parametrize("name", ["size", "least", "refuses"])
@pytest.mark.parametrize(
    ("function", "said"),
    [(broken, f"failed: RuntimeError: no; correct it in {__name__}"), (lambda _: b"1 mm", "returns b'1 mm', which is")],
)
def test_a_function_that_fails_or_returns_something_else_is_named(
    name: str, function: Callable[[object], Any], said: str
) -> None:
    given: dict[str, Any] = {"size": lambda _: 1.0, name: function}
    register(Effect("own", "something of one's own", "", lambda *_: {}, **given))
    try:
        with pytest.raises(CaseError, match=rf"effects\.own: its function `{name}` {said}"):
            library(CASE, CASE)
    finally:
        unregister("own")


def test_an_effect_can_be_copied() -> None:
    own = Effect("own", "something of one's own", "", lambda *_: {}, lambda _: 2.0, least=broken)
    assert deepcopy(own).size(CASE) == 2.0
    with pytest.raises(CaseError, match=r"effects\.own: its function `least` failed"):
        deepcopy(own).least(CASE)
