"""Units against their definitions, and every round trip without a lost bit."""

from __future__ import annotations

import math
from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pint import UnitRegistry

from birdstrike.data.units import (
    ACCEPTED,
    DISPLAY,
    UnitError,
    dimension,
    display,
    factor,
    from_si,
    in_unit,
    quantity_text,
    scaled,
    share,
    si_unit,
    to_si,
)

finite = st.floats(allow_nan=False, allow_infinity=False, min_value=-1e30, max_value=1e30)


@pytest.mark.parametrize(
    ("text", "unit", "si"),
    [
        ("10 mm", "m", 0.01),
        ("10mm", "m", 0.01),
        ("-0.3705 MPa", "Pa", -370500.0),
        ("71 GPa", "Pa", 71e9),
        ("0.71 Mbar", "Pa", 71e9),  # of shock physics, beside instruments' mbar
        ("1 N/mm^2", "Pa", 1e6),
        ("938 kg/m3", "kg/m^3", 938.0),
        ("0.938 g/cm^3", "kg/m^3", 938.0),
        ("91.1 mm/ms", "m/s", 91.1),
        ("5 us", "s", 5e-6),
        ("5 µs", "s", 5e-6),
        ("2.5e1 kN", "N", 25e3),
        ("1 in", "m", 0.0254),
        ("180 deg", "rad", math.pi),
    ],
)
def test_quantities_have_their_defined_size(text: str, unit: str, si: float) -> None:
    assert to_si(text, unit) == si


@pytest.mark.parametrize("text", ["641 Pa s", "0.641 MPa ms", "0.641 N*ms/mm^2", "0.641 N ms/mm2", "0.641 N.ms/mm2"])
def test_viscosity_reads_in_every_unit_engineers_write(text: str) -> None:
    assert to_si(text, "Pa s") == 641.0


NO_LENGTHS = ["10", "10 s", "abc", "", "nan mm", "inf mm", "10 furlings", "1e999 mm", "1_0 mm", "10 mm mm"]


@pytest.mark.parametrize("text", NO_LENGTHS)
def test_what_is_no_length_is_refused_with_the_accepted_units(text: str) -> None:
    with pytest.raises(UnitError) as caught:
        to_si(text, "m")
    assert "too large" in str(caught.value) or ACCEPTED["m"] in str(caught.value)


def test_a_number_without_a_unit_is_refused_with_the_accepted_units() -> None:
    with pytest.raises(UnitError, match=r"8\.5 has no unit; accepted units: m, cm, mm, um, in"):
        to_si(8.5, "m")
    assert to_si(0.004, "") == 0.004


def test_the_accepted_units_that_errors_name_are_accepted() -> None:
    for unit, listed in ACCEPTED.items():
        for name in listed.split(", ") if unit else []:
            assert to_si(f"1 {name}", unit) > 0.0
            assert si_unit(name) == unit


def test_the_accepted_units_have_the_size_that_pint_gives_them() -> None:
    every = UnitRegistry(non_int_type=Decimal)  # pyright: ignore[reportArgumentType] (pint's hint is too narrow)
    for unit, listed in ACCEPTED.items():
        for name in [unit, *listed.split(", ")] if unit else []:
            text = name.replace("Msi", "Mpsi")
            assert factor(name) == pytest.approx(
                every.Quantity(Decimal(1), text).to_base_units().magnitude, rel=Decimal("1e-26")
            )


def test_a_unit_that_is_not_listed_is_read_too() -> None:
    assert to_si("1 ft", "m") == 0.3048
    assert to_si("2 bar", "Pa") == 2e5
    assert to_si("1 min", "s") == 60.0  # not a thousandth of an inch


@pytest.mark.parametrize("unit", ["degC", "degF"])
def test_a_unit_that_does_not_count_from_zero_is_refused(unit: str) -> None:
    with pytest.raises(UnitError):
        to_si(f"25 {unit}", "K")
    assert to_si("25 K", "K") == 25.0


@given(finite)
def test_a_written_quantity_reads_back_to_the_same_double(value: float) -> None:
    for unit in ACCEPTED:
        if unit:
            assert to_si(quantity_text(value, unit), unit) == value


@given(finite, st.sampled_from([u for u in DISPLAY if u and u != "rad"]))
def test_engineers_units_lose_no_bit(value: float, unit: str) -> None:
    shown = DISPLAY[unit]
    assert scaled(str(in_unit(value, shown)), shown) == value


@given(st.floats(min_value=-1e6, max_value=1e6))
def test_angles_survive_degrees(value: float) -> None:
    assert to_si(f"{from_si(value, 'deg')!r} deg", "rad") == pytest.approx(value, rel=4e-16, abs=1e-300)


@given(st.integers(min_value=1, max_value=10**9), st.integers(min_value=0, max_value=6))
def test_the_same_length_in_two_units_is_the_same_double(digits: int, shift: int) -> None:
    assert to_si(f"{digits}e-{shift} mm", "m") == to_si(f"{digits}e-{shift + 3} m", "m")


def test_display_is_in_engineers_units() -> None:
    assert display(0.0056, "m") == (5.6, "mm")
    assert display(641.0, "Pa s") == (641.0, "Pa s")
    assert display(0.34, "") == (0.34, "")


@pytest.mark.parametrize(("text", "value"), [("2 %", 0.02), ("0.7%", 0.007), ("1e2 %", 1.0), ("-3 %", -0.03)])
def test_a_percentage_is_a_share(text: str, value: float) -> None:
    assert share(text) == value


@pytest.mark.parametrize("text", ["2", "2 mm", "%", "two %", "2 percent"])
def test_what_is_no_percentage_is_refused(text: str) -> None:
    with pytest.raises(UnitError, match=f'"{text}" is not '):
        share(text)


@pytest.mark.parametrize(
    ("unit", "kind"), [("um/m", ""), ("(um/m)", ""), ("mm/(mm)", ""), ("%", ""), ("mV/V", "ratio"), ("kg/kg", "ratio")]
)
def test_a_quotient_of_anything_but_lengths_is_no_strain(unit: str, kind: str) -> None:
    assert dimension(unit) == kind
