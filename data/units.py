"""Units: engineers' text to SI numbers and back; the only place where a unit is converted.

Factors are decimal, not binary: "8.57 mm" and "0.00857 m" are the same double, so that one case has one hash.
"""

from __future__ import annotations

import math
import re
from decimal import Decimal
from functools import cache
from numbers import Real
from typing import TYPE_CHECKING

from birdstrike.data.errors import UnitError
from birdstrike.data.nearest import nearest

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pint import UnitRegistry
    from pint.util import UnitsContainer

SIZES = {
    "m": {"m": "1", "cm": "1e-2", "mm": "1e-3", "um": "1e-6", "in": "0.0254"},
    "s": {"s": "1", "ms": "1e-3", "us": "1e-6"},
    "Pa": {
        "Pa": "1",
        "kPa": "1e3",
        "MPa": "1e6",
        "GPa": "1e9",
        "N/mm^2": "1e6",
        "psi": "6894.757293168361336722673445",
        "ksi": "6894757.293168361336722673445",
        "Msi": "6894757293.168361336722673445",
    },
    "N": {"N": "1", "kN": "1e3"},
    "Pa s": {"Pa s": "1", "MPa ms": "1e3", "N*ms/mm^2": "1e3"},
    "kg": {"kg": "1", "g": "1e-3", "t": "1e3", "lb": "0.45359237"},
    "kg/m^3": {"kg/m^3": "1", "g/cm^3": "1e3", "t/mm^3": "1e12"},
    "m/s": {"m/s": "1", "mm/ms": "1", "km/h": "0.2777777777777777777777777778", "kn": "0.5144444444444444444444444445"},
    "rad": {"deg": "0.01745329251994329576923690768", "rad": "1"},
    "1/s": {"1/s": "1", "1/ms": "1e3", "Hz": "1", "kHz": "1e3"},
    "N/s": {"N/s": "1", "kN/s": "1e3", "kN/ms": "1e6"},
    "Pa/s": {"Pa/s": "1", "MPa/s": "1e6", "MPa/ms": "1e9"},
    "N m/rad/m": {"N*m/rad/m": "1", "kN*m/rad/m": "1e3", "N/rad": "1"},
    "N m/rad": {"N*m/rad": "1", "kN*m/rad": "1e3"},
    "N s": {"N s": "1", "kN ms": "1"},
    "J": {"J": "1", "kJ": "1e3"},
    "rad/N": {"rad/N": "1", "mrad/kN": "1e-6"},
    "m^2/N": {"m^2/N": "1", "mm^2/kN": "1e-9"},
    "N/m": {"N/m": "1", "kN/m": "1e3", "kN/mm": "1e6", "J/m^2": "1"},
    "K": {"K": "1"},
    "J/kg/K": {"J/kg/K": "1"},
    "": {"m/m": "1", "cm/m": "1e-2", "mm/m": "1e-3", "um/m": "1e-6"},
}
"""SI units the project uses -> what a user may write instead -> its size in SI, as pint has it (BIPM, The International
System of Units, 2019; NIST SP 811). Any other text is left to pint, whose import takes a tenth of every command."""

ACCEPTED = {si: ", ".join(sizes) for si, sizes in SIZES.items() if si} | {
    "": "a bare number, or %, um/m, microstrain",
}
"""SI units the project uses -> what a user may write instead, for messages."""

STRAIN = "m/m"
"""Dimension under which a strain is shown, apart from pure numbers; everywhere else both are ""."""

DISPLAY = {"m": "mm", "s": "ms", "Pa": "MPa", "N": "kN", "Pa s": "Pa s", "kg": "kg", "m/s": "m/s", "rad": "deg", "": ""}
DISPLAY |= {STRAIN: "µm/m", "kg/m^3": "kg/m³"}
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
    **dict.fromkeys(("microstrain", "micro strain", "ustrain", "uStrain", "ustr", "ue", "u\u03b5", "ppm"), "um/m"),
    **dict.fromkeys(("millistrain", "mstrain", "\u2030"), "mm/m"),
    **dict.fromkeys(("%", "percent", "% strain"), "cm/m"),
}
"""Strain gauges' ways to write a ratio."""

_POWERS = {"2": "cm/m", "3": "mm/m", "6": "um/m", "\u00b2": "cm/m", "\u00b3": "mm/m", "\u2076": "um/m"}
"""Digit of a negative power of ten -> the strain that it stands for as a unit."""
_POWER = re.compile(
    r"(?:[x*\u00d7\u00b7\u2219]\s*)?"
    r"(?:10\s*(?:\^|\*\*)?\s*[-\u2212]([236])|10\u207b([\u00b2\u00b3\u2076])|1?(?:\.0*)?[eE]-0?([236]))"
)
"""A power of ten in the place of a strain's unit: 1e-6, 10^-6, 10-6, x10^-3; pint takes its e for a charge."""

OTHER_RATIO = "ratio"
"""Dimension of mV/V and other quotients that are no strain."""

_WORDS = {
    **dict.fromkeys(("Second", "Seconds", "SECONDS", "Sec", "SEC", "Sek", "sek", "Sekunden"), "s"),
    **dict.fromkeys(("Volt", "Volts", "VOLTS"), "V"),
    **dict.fromkeys(('"', '1"', "''", "\u2033", "1\u2033"), "in"),
    **dict.fromkeys(("gn", "gee"), "g_n"),
}
"""Units as oscilloscopes and loggers write them out."""

_ELSEWHERE = ("lbf", "kgf", "bar", "mbar", "Mbar", "daN", "inch", "%", "um/m", "microstrain")
"""Units of instruments and of other codes' inputs beside `SIZES`; instruments write them in any case."""
_SECONDS = re.compile(r"^([mu\u00b5\u03bc]?)sec$")
_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d{1,3})?"
_MILS = re.compile(r"\bmils?\b")
"""A thousandth of an inch, as in a displacement sensor's sheet; pint takes it for an angle of gunnery."""
_MEGAPSI = re.compile(r"\bMsi\b")
_COMMA = re.compile(r"\s*([+-]?\d+),(\d+)\b(.*)")
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*(.*?)\s*")


_KNOWN = {unit: (Decimal(size), si) for si, sizes in SIZES.items() for unit, size in {**sizes, si: "1"}.items()}


@cache
def _registry() -> UnitRegistry:
    """Pint's thousand units; read late, because hardly a case has one that `SIZES` lacks."""
    from pint import UnitRegistry

    return UnitRegistry(non_int_type=Decimal)  # pyright: ignore[reportArgumentType] (pint's hint is too narrow)


@cache
def _dimensions() -> Mapping[UnitsContainer, str]:
    """Pint's base units of what the project uses -> its SI name."""
    quantity = _registry().Quantity
    return {quantity(Decimal(1), si or "dimensionless").to_base_units()._units: si for si in SIZES}


def is_ratio(unit: str) -> bool:
    """Whether a unit is one of strain gauges' ways to write a ratio: microstrain, %."""
    return bool(_strain(unit))


def is_power(unit: str) -> bool:
    """Whether a unit is a power of ten, of which a strain counts so many: 1e-6, x10^-3."""
    return _POWER.fullmatch(unit.strip()) is not None


def _strain(unit: str) -> str:
    """The quotient of lengths that a strain gauge's unit stands for; empty for any other unit."""
    if power := _POWER.fullmatch(unit.strip()):
        return _POWERS[next(filter(None, power.groups()))]
    return _STRAIN.get(unit.replace("\u03bc", "µ").replace("µ", "u").strip(), "")


@cache
def _base(unit: str) -> tuple[Decimal, str]:
    """Factor to SI and the dimension of a unit's text: the SI name in `SIZES`, else what pint calls its base units.

    "kg/m3", "kg/m³" and "N.ms/mm2" are read as engineers mean them.
    """
    text = _strain(unit) or _WORDS.get(unit.strip(), unit)
    text = re.sub(r"(?<=[A-Za-zµ])(-?\d)", r"^\1", _MILS.sub("thou", text)).replace("²", "^2").replace("³", "^3")
    text = re.sub(r"(?<=[A-Za-z0-9)])[.·](?=[A-Za-z(])", "*", text).replace("µ", "u").replace("\u03bc", "u")
    if found := _KNOWN.get(text):
        return found
    if (better := usual(unit)) and _differs_in_size(text, better):
        raise UnitError(f'"{unit}" is "{better}" but for the case of a letter, and of quite another size; "{better}"?')
    try:
        quantity = _registry().Quantity(Decimal(1), _MEGAPSI.sub("Mpsi", text) or "dimensionless").to_base_units()
    except Exception as error:  # pint's parser raises a dozen types, among them tokenize errors
        raise UnitError(f'"{unit}" is not a unit{meant(unit)}') from error
    if quantity.magnitude and _registry().Quantity(Decimal(0), text or "dimensionless").to_base_units().magnitude:
        raise UnitError(f'"{unit}" does not count from zero; give the value in {ACCEPTED["K"]}')
    kind = _dimensions().get(quantity._units, str(quantity._units))
    return Decimal(quantity.magnitude), kind if kind or _may_be_a_strain(text) else OTHER_RATIO


def _may_be_a_strain(unit: str) -> bool:
    """Whether a number without dimension is one by its unit: not a quotient of anything but lengths, as mV/V is."""
    above, stroke, below = unit.partition("/")
    return not stroke or all(_base(part.strip(" ()"))[1] == "m" for part in (above, below))


def usual(unit: str) -> str:
    """The usual unit that one in the wrong case, or a word, stands for; empty where it is one itself or there is none.

    MS and mSec are ms, milimeter is mm, LBF is lbf.
    """
    known = [*(unit for si, sizes in SIZES.items() for unit in sizes if si), *_ELSEWHERE]
    text = _SECONDS.sub(r"\1s", unit.strip(" .").casefold())
    alike = [one for one in dict.fromkeys(known) if one.casefold() == text]
    words = {word: short for short, word in PLURALS.items()}
    alike += [words[word] for word in [nearest(text, words, 0.8)] if word]
    return "" if unit in known or not alike else alike[0]


def meant(unit: str) -> str:
    """What to write for a unit in the wrong case, or a word for one, as the end of a sentence; else empty."""
    better = usual(unit)
    return f'; "{better}"?' if better else ""


def _differs_in_size(unit: str, other: str) -> bool:
    """Whether pint knows a unit of the dimension of another and of another size, as Mm beside mm."""
    try:
        quantity, size = _registry().Quantity(Decimal(1), unit).to_base_units(), _base(other)
    except Exception:  # pint's parser raises a dozen types, among them tokenize errors
        return False
    return _dimensions().get(quantity._units) == size[1] and quantity.magnitude != size[0]


def factor(unit: str) -> Decimal:
    """Size of one `unit` in SI; raises UnitError when `unit` is not a unit."""
    return _base(unit)[0]


def dimension(unit: str) -> str:
    """SI name of a unit's dimension, or what pint calls one that the project does not use; raises UnitError."""
    return _base(unit)[1]


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
    if base in SIZES:
        return base
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
    """Number and unit of a quantity's text, both still text: parts("10 mm") is ("10", "mm"); raises UnitError."""
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


def to_si(text: str | float, unit: str) -> float:
    """SI value of a quantity's text: to_si("10 mm", "m") is 0.01; raises UnitError naming the accepted units.

    From Python, a number is taken where the quantity is a pure number, and refused elsewhere.
    """
    if not isinstance(text, str):
        if unit == "" and isinstance(text, Real) and not isinstance(text, bool):
            return float(text)
        raise UnitError(f"{text!r} has no unit; accepted units: {ACCEPTED.get(unit, unit)}")
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


def of_reading(si: str) -> str:
    """Dimension under which a sensor's readings are shown: without a unit they are strains, which gauges alone give.

    A case's own pure numbers, such as a failure strain or a gain, are shown as they are written.
    """
    return si or STRAIN


def rounded(number: float, digits: int) -> str:
    """A number to so many digits, without an exponent where a reader can do without one: "1230", not "1.23e+03"."""
    text = f"{number + 0.0:.{digits}g}"  # + 0.0: of -0.0 no sign
    if "e" not in text or not 1e-6 <= abs(number) < 1e7:
        return text
    return f"{Decimal(text):f}"


def quantity_text(value: float, si: str) -> str:
    """Text that to_si reads back to the same double, in SI: quantity_text(0.01, "m") is "0.01 m"."""
    return f"{float(value)!r} {si}".strip()
