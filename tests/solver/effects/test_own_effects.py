"""Effects of one's own: on which sections of a case they act, and how one that acts elsewhere is refused."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from birdstrike.data.errors import CaseError, UnitError
from birdstrike.effects import Effect, register, unregister
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


def test_what_is_no_effect_and_a_name_of_an_answer_are_refused_with_what_to_do() -> None:
    with pytest.raises(TypeError, match=r"3 is no effect; write register\(Effect\("):
        register(3)  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match='cannot be named "none", as an answer calls the model without effects'):
        register(Effect("none", "something of one's own", "", lambda *_: {}, lambda _: 1.0))
