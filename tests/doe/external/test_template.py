"""The deck of an external solver: placeholders in the deck's own units, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from birdstrike.data.errors import CaseError, UnitError
from birdstrike.doe.external.external import external_solver
from birdstrike.doe.external.template import Quantity, card, rendered
from tests.doe.external_case import DECK, oscillator


def filled(folder: Path, text: str) -> str:
    """The template `text`, filled with the oscillator's case."""
    return rendered(oscillator(folder, deck=text))


@pytest.mark.parametrize(
    ("placeholder", "text"),
    [
        ('{{ viscosity | to("MPa ms") }}', "0.4"),
        ('{{ bird.material.viscosity | to("Pa s") }}', "400.0"),
        ('{{ bird.density | to("t/mm^3") }}', "9.5e-10"),
        ('{{ plate.thickness | to("mm") }}', "10.0"),
        ('{{ impact.angle | to("deg") }}', "30.0"),
        ('{{ (2 * viscosity) | to("MPa ms") }}', "0.8"),
        ('{{ (-plate.length / 2) | to("mm") }}', "-125.0"),
        ("{{ bird.shape }} {{ bird.particles }} {{ bird.material.tension_erosion }}", "cylinder 500 1.1"),
        ('{{ bird.mass | to("g") | card }}', "1492.25651"),
        ('{{ impact.offset[0] | to("mm") }} {{ plate.preload[1] | to("MPa") }}', "0.0 0.0"),
        ("{{ plate.elements[0] }} {{ solver.shock_linear }}", "10 1.0"),
        ("{{ step_factor }}", "1.0"),
    ],
)
def test_a_placeholder_is_the_case_s_quantity_in_the_deck_s_unit(tmp_path: Path, placeholder: str, text: str) -> None:
    assert filled(tmp_path, placeholder) == text


def test_the_components_of_the_velocity_are_those_of_speed_and_angle(tmp_path: Path) -> None:
    text = filled(tmp_path, '{{ velocity_along | to("m/s") }} {{ velocity_normal | to("m/s") }}')
    along, normal = map(float, text.split())
    assert along == pytest.approx(91.1 * math.cos(math.radians(30.0)), rel=1e-12)
    assert normal == pytest.approx(91.1 * 0.5, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('a\nb\n{{ viscosity | to("mm") }}\n', "line 3: .*Pa s, another dimension"),
        ("{{ viscosty }}", "'viscosty' is undefined"),
        ("{{ bird.material.viscosty }}", "no attribute 'viscosty'"),
        ('{{ 3.0 | to("mm") }}', "which has no unit"),
        ("x\n{{ viscosity | to( }}", "line 2"),
        ("{{ viscosity | nosuch }}", "nosuch"),
    ],
)
def test_what_cannot_be_filled_is_named_with_its_place(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(CaseError, match=message):
        filled(tmp_path, text)


def test_a_card_s_field_holds_as_many_digits_as_fit() -> None:
    assert card(0.4) == "       0.4"
    assert card(1.0 / 3.0) == ".333333333"
    assert card(-1.23456789e-7) == "-1.2346e-7"
    assert card(-1.23456789e-4, 8) == "-.000123"
    assert card(1.25e11, 8) == " 1.25e11"
    assert card(2.0 / 3.0, 5) == ".6667"
    with pytest.raises(UnitError, match="too narrow"):
        card(-1.5e-100, 5)


def test_a_quantity_loses_its_unit_in_a_product_of_quantities() -> None:
    assert isinstance(2.0 * Quantity(3.0, "m"), Quantity)
    assert not isinstance(Quantity(3.0, "m") * Quantity(3.0, "m"), Quantity)
    assert not isinstance(Quantity(3.0, "m") / Quantity(3.0, "s"), Quantity)


def test_a_sought_parameter_without_a_placeholder_is_refused(tmp_path: Path) -> None:
    deck = DECK.replace('viscosity | to("MPa ms")', "0.4")
    with pytest.raises(CaseError) as caught:
        external_solver(oscillator(tmp_path, deck=deck))
    assert "no placeholder of strike.k.j2 changes with it" in str(caught.value)
    assert '{{ bird.material.viscosity | to("Pa s") }}' in str(caught.value)
    assert "impact.speed" not in str(caught.value)  # it acts through velocity_normal


def test_a_sought_ratio_is_asked_for_without_a_unit(tmp_path: Path) -> None:
    sought = {"inversion": {"parameters": {"bird.material.tension_erosion": {"range": [1.05, 1.25]}}}}
    case = oscillator(tmp_path).overlaid(sought)
    with pytest.raises(CaseError, match=r"write \{\{ bird\.material\.tension_erosion \}\} where it belongs"):
        external_solver(case)
    asked = oscillator(tmp_path / "mended", deck=DECK + "\n{{ bird.material.tension_erosion }}\n")
    external_solver(asked.overlaid(sought))


def test_a_template_that_names_the_step_factor_has_a_second_chance(tmp_path: Path) -> None:
    assert external_solver(oscillator(tmp_path / "plain")).step_factors == (1.0,)
    safer = DECK.replace("0.005 | card", "(0.005 * step_factor) | card")
    assert external_solver(oscillator(tmp_path / "safer", deck=safer)).step_factors == (1.0, 0.5)
