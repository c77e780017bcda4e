"""Units: engineers' text to SI numbers and back; the only place where a unit is converted.

Factors are decimal, not binary: "8.57 mm" and "0.00857 m" are the same double, so that one case has one hash.
"""

from __future__ import annotations

import math
import re
from decimal import Decimal
from functools import cache
from typing import TYPE_CHECKING

from birdstrike.data.errors import UnitError

if TYPE_CHECKING:
    from pint import UnitRegistry
    from pint.util import UnitsContainer

ACCEPTED = {
    "m": "m, cm, mm, um, in",
    "s": "s, ms, us",
    "Pa": "Pa, kPa, MPa, GPa, N/mm^2, psi, ksi, Msi",
    "N": "N, kN",
    "Pa s": "Pa s, MPa ms, N*ms/mm^2",
    "kg": "kg, g, t, lb",
    "kg/m^3": "kg/m^3, g/cm^3, t/mm^3",
    "m/s": "m/s, mm/ms, km/h, kn",
    "rad": "deg, rad",
    "1/s": "1/s, 1/ms, Hz, kHz",
    "N/s": "N/s, kN/s, kN/ms",
    "Pa/s": "Pa/s, MPa/s, MPa/ms",
    "N m/rad/m": "N*m/rad/m, kN*m/rad/m, N/rad",
    "N m/rad": "N*m/rad, kN*m/rad",
    "N s": "N s, kN ms",
    "J": "J, kJ",
    "rad/N": "rad/N, mrad/kN",
    "m^2/N": "m^2/N, mm^2/kN",
    "N/m": "N/m, kN/m, kN/mm, J/m^2",
    "K": "K",
    "J/kg/K": "J/kg/K",
    "": "a bare number, or %, um/m, microstrain",
}
"""SI units the project uses -> what a user may write instead."""

DISPLAY = {"m": "mm", "s": "ms", "Pa": "MPa", "N": "kN", "Pa s": "Pa s", "kg": "kg", "m/s": "m/s", "rad": "deg", "": ""}
"""SI unit -> the unit in which engineers read it."""

PLURALS = {
    "mm": "millimetres",
    "ms": "milliseconds",
    "us": "microseconds",
    "MPa": "megapascals",
    "GPa": "gigapascals",
    "deg": "degrees",
    "g": "grams",
}

_STRAIN = {
    **dict.fromkeys(("strain", "Strain", "STRAIN"), "m/m"),
    **dict.fromkeys(("microstrain", "ustrain", "ustr", "ue", "u\u03b5", "ppm"), "um/m"),
    **dict.fromkeys(("millistrain", "mstrain", "\u2030"), "mm/m"),
    **dict.fromkeys(("%", "percent", "% strain"), "cm/m"),
}
"""Strain gauges' ways to write a ratio."""

_DEFINITIONS = """
pi = 3.1415926535897932384626433832795028841971693993751
micro- = 1e-6 = u-
milli- = 1e-3 = m-
centi- = 1e-2 = c-
kilo- = 1e3 = k-
mega- = 1e6 = M-
giga- = 1e9 = G-
meter = [length] = m
second = [time] = s
kilogram = [mass] = kg
kelvin = [temperature] = K
radian = [] = rad
degree = pi / 180 * radian = deg
gram = 1e-3 * kilogram = g
tonne = 1e3 * kilogram = t
pound = 0.45359237 * kilogram = lb
inch = 0.0254 * meter = in
hour = 3600 * second = h
knot = 1852 * meter / hour = kn
hertz = 1 / second = Hz
newton = kilogram * meter / second ** 2 = N
joule = newton * meter = J
pascal = newton / meter ** 2 = Pa
pound_force = pound * 9.80665 * meter / second ** 2
pound_per_square_inch = pound_force / inch ** 2 = psi
kip_per_square_inch = 1e3 * pound_force / inch ** 2 = ksi
"""
"""The units of ACCEPTED in pint's language (BIPM, The International System of Units, 2019; NIST SP 811). Reading pint's
own thousand takes a second of every command, so that they are left to the texts that have other units."""

_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d{1,3})?"
_MILS = re.compile(r"\bmils?\b")
"""A thousandth of an inch, as in a displacement sensor's sheet; pint takes it for an angle of gunnery."""
_COMMA = re.compile(r"\s*([+-]?\d+),(\d+)\b(.*)")
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*(.*?)\s*")


@cache
def _registry(every: bool) -> UnitRegistry:
    """Pint's units: every one, or those of ACCEPTED; read late, because a command's --help has no use for them."""
    from pint import UnitRegistry

    lines = "" if every else _DEFINITIONS.split("\n")
    return UnitRegistry(lines, non_int_type=Decimal)  # pyright: ignore[reportArgumentType] (pint's hint is too narrow)


@cache
def _names() -> frozenset[str]:
    """Symbols of the units in ACCEPTED, and of the lengths in whose ratios strain is read."""
    texts = [f"{si} {accepted}" for si, accepted in ACCEPTED.items() if si]
    return frozenset(re.findall(r"[A-Za-z]+", " ".join((*texts, *_STRAIN.values(), "Mpsi"))))


def is_ratio(unit: str) -> bool:
    """Whether a unit is one of strain gauges' ways to write a ratio: microstrain, %."""
    return _plain_strain(unit) in _STRAIN


def _plain_strain(unit: str) -> str:
    return unit.replace("\u03bc", "µ").replace("µ", "u").strip()


@cache
def _base(unit: str) -> tuple[Decimal, UnitsContainer]:
    """Factor to SI and the base units of a unit's text; "kg/m3" and "N.ms/mm2" are read as engineers mean them."""
    text = _STRAIN.get(_plain_strain(unit), unit)
    text = re.sub(r"(?<=[A-Za-zµ])(-?\d)", r"^\1", re.sub(r"\bMsi\b", "Mpsi", _MILS.sub("thou", text)))
    text = re.sub(r"(?<=[A-Za-z0-9)])[.·](?=[A-Za-z(])", "*", text).replace("µ", "u").replace("\u03bc", "u")
    every = not _names().issuperset(re.findall(r"[A-Za-z]+", text))
    try:
        quantity = _registry(every).Quantity(Decimal(1), text or "dimensionless").to_base_units()
    except Exception as error:  # pint's parser raises a dozen types, among them tokenize errors
        raise UnitError(f'"{unit}" is not a unit{meant(unit)}') from error
    return Decimal(quantity.magnitude), quantity._units


def meant(unit: str) -> str:
    """What to write for a unit in the wrong case, such as MS for ms, as the end of a sentence; else empty."""
    known = re.findall(r"[^,;\s]+", " ".join(ACCEPTED.values()))
    alike = [one for one in dict.fromkeys(known) if one.casefold() == unit.strip().casefold() and one != unit]
    return f'; "{alike[0]}"?' if alike else ""


def factor(unit: str) -> Decimal:
    """Size of one `unit` in SI; raises UnitError when `unit` is not a unit."""
    return _base(unit)[0]


def ratio(unit: str, other: str) -> Decimal:
    """Size of one `unit` in units of `other`, of any dimension; raises UnitError where these differ in kind."""
    (size, base), (other_size, other_base) = _base(unit), _base(other)
    if base != other_base:
        raise UnitError(f'"{unit}" and "{other}" measure different things')
    return size / other_size


@cache
def si_unit(unit: str) -> str:
    """SI name of a unit's dimension ("mm" -> "m"); raises UnitError for a dimension the project does not use."""
    base = _base(unit)[1]
    for si in ACCEPTED:
        if _base(si)[1] == base:
            return si
    if better := meant(unit):
        raise UnitError(f'"{unit}" measures nothing used here{better}')
    raise UnitError(f'"{unit}" measures nothing used here; known: {"; ".join(filter(None, ACCEPTED.values()))}')


def scaled(number: str, unit: str) -> float:
    """SI value of a number's text given in `unit`; finite decimals only ("nan", "inf", "1_000" are refused)."""
    if not re.fullmatch(_NUMBER, number.strip()):
        raise UnitError(f'"{number}" is not a finite number')
    value = float(Decimal(number.strip()) * factor(unit))
    if math.isinf(value):
        raise UnitError(f'"{number}" is too large')
    return value


def parts(text: str) -> tuple[str, str]:
    """Number and unit of a quantity's text, both still text: parts("10 mm") is ("10", "mm")."""
    match, comma = _QUANTITY.fullmatch(text), decimal_comma(text)
    if match is None or comma:
        raise UnitError(f'"{text}" {comma or "is not a number with a unit"}')
    return match[1], match[2]


def decimal_comma(text: str) -> str:
    """What is wrong with a number written with a comma, and what to write; empty where there is none."""
    match = _COMMA.fullmatch(text)
    if match is None:
        return ""
    whole, after, rest = match.groups()
    thousands = f' or, if the comma marks thousands, "{whole}{after}{rest}"' if len(after) == 3 else ""
    return f'has a decimal comma; write "{whole}.{after}{rest}"{thousands}'


def to_si(text: str, unit: str) -> float:
    """SI value of a quantity's text: to_si("10 mm", "m") is 0.01; raises UnitError naming the accepted units."""
    try:
        number, given = parts(text)
    except UnitError as error:
        raise UnitError(f"{error}; accepted units: {ACCEPTED.get(unit, unit)}") from error
    if unit and not given:
        raise UnitError(f'"{text}" has no unit; accepted units: {ACCEPTED.get(unit, unit)}')
    try:
        fits = _base(given)[1] == _base(unit)[1]
    except UnitError:
        fits = False
    if not fits:
        raise UnitError(f'"{text}" is not in a unit of this dimension; accepted units: {ACCEPTED.get(unit, unit)}')
    return scaled(number, given)


def share(text: str) -> float:
    """Share that a percentage's text states: share("2 %") is 0.02; raises UnitError."""
    try:
        number, unit = parts(text)
    except UnitError as error:
        raise UnitError(f'"{text}" is not a number with "%"') from error
    if unit != "%":
        raise UnitError(f'"{text}" is not in "%"')
    return float(Decimal(number) / 100)


def in_unit(value: float, unit: str) -> Decimal:
    """An SI value in `unit`, exact in decimal, so that writing and reading a file changes no bit."""
    return Decimal(repr(float(value))) / factor(unit)


def from_si(value: float, unit: str) -> float:
    """An SI value in `unit`: from_si(0.01, "mm") is 10.0."""
    return float(in_unit(value, unit))


def to_display(value: float, si: str) -> float:
    """An SI value in the engineers' unit of its dimension."""
    return from_si(value, DISPLAY.get(si, si))


def display(value: float, si: str) -> tuple[float, str]:
    """An SI value and the engineers' unit it is given in: display(0.01, "m") is (10.0, "mm")."""
    return to_display(value, si), DISPLAY.get(si, si)


def quantity_text(value: float, si: str) -> str:
    """Text that to_si reads back to the same double, in SI: quantity_text(0.01, "m") is "0.01 m"."""
    return f"{float(value)!r} {si}".strip()
