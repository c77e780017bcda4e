"""Axes and labels in the engineer's units: SI arrays in, display numbers and their unit out."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from birdstrike.data.formatting import key_labels
from birdstrike.data.histories import Array
from birdstrike.data.units import display, of_reading

_SYMBOLS = {"pressure_cutoff": "PC", "viscosity": "MU", "tension_erosion": "TEROD", "compression_erosion": "CEROD"}


def shown(values: Array, si_unit: str) -> tuple[Array, str]:
    """An SI array in the unit an engineer reads, with that unit's name; units here are linear (no offset)."""
    factor, unit = display(1.0, si_unit)
    return np.asarray(values, dtype=float) * factor, unit


def shown_readings(values: Array, si_unit: str) -> tuple[Array, str]:
    """The same of a sensor's readings: strains in µm/m."""
    return shown(values, of_reading(si_unit))


def milliseconds(time: Array) -> Array:
    """Time [s] as [ms]."""
    return shown(time, "s")[0]


def shown_span(record_time: Array, simulated_until: float) -> tuple[float, float]:
    """From rest to a little after the end [s]: what a figure on the record's clock shows of it and of simulations.

    Of a record that begins long before contact, or goes on long after the simulations' end, a quarter of their time.
    """
    end = min(float(record_time[-1]), 1.25 * simulated_until)
    return max(min(0.0, float(record_time[0])), -0.25 * end), 1.04 * end


def words(name: str) -> str:
    """A sensor's or a file's name as words: `displacement_centre` -> `displacement centre`."""
    return name.replace("_", " ")


def parameter_label(dotted: str, among: Iterable[str] = ()) -> str:
    """A dotted case key as the field says it: `bird.material.viscosity` -> `viscosity MU`.

    among: the other keys in question, from which parents tell it.
    """
    card = _SYMBOLS.get(_last(dotted))
    label = words(key_labels((dotted, *among))[dotted])
    return f"{label} {card}" if card else label


def symbol(dotted: str, among: Iterable[str] = ()) -> str:
    """The card's short name where there is one: `bird.material.viscosity` -> `MU`; among: as in `parameter_label`."""
    last = _last(dotted)
    label = key_labels((dotted, *among))[dotted]
    return words(label.removesuffix(last)) + _SYMBOLS.get(last, words(last))


def _last(dotted: str) -> str:
    return dotted.rsplit(".", 1)[-1]


def labelled(name: str, unit: str) -> str:
    """`displacement_centre`, `mm` -> `Displacement centre [mm]`; a pure number says [–]."""
    text = words(name)
    return f"{text[:1].upper()}{text[1:]} [{unit or '–'}]"


def residual_label(unit: str) -> str:
    """Of the axis below two curves, with its sense, in two lines since that axis is low."""
    return f"Simulated\n− record [{unit or '–'}]"


def significant(value: float, digits: int = 3) -> str:
    """A number with so many significant digits, no exponent in the everyday range: 0.00123, 45.6, 641."""
    if not np.isfinite(value):
        return "–"
    if value < 0:
        return f"−{significant(-value, digits)}"
    if value == 0 or 1e-4 <= abs(value) < 1e6:
        decimals = max(0, digits - 1 - int(np.floor(np.log10(abs(value))))) if value else 0
        return f"{value + 0.0:.{decimals}f}"
    return f"{value:.{digits - 1}e}"


def quantity(value: float, si_unit: str, digits: int = 3) -> str:
    """An SI value as an engineer reads it: `quantity(0.00556, "m")` is `5.56 mm`."""
    number, unit = display(value, si_unit)
    return f"{significant(number, digits)} {unit}".strip()


def reading(value: float, si_unit: str, digits: int = 3) -> str:
    """The same of a sensor's reading: `reading(-0.00501, "")` is `−5010 µm/m`, a strain."""
    return quantity(value, of_reading(si_unit), digits)


def signed_quantity(value: float, si_unit: str) -> str:
    """A difference with its sign: `+0.12 mm`, `−0.12 mm`; nothing before a zero."""
    text = quantity(value, si_unit, 2)
    return f"+{text}" if value > 0 else text


def signed_reading(value: float, si_unit: str) -> str:
    """The same of a difference between readings."""
    return signed_quantity(value, of_reading(si_unit))


def bound(value: float, si_unit: str) -> str:
    """An end of a range as it was given, without added zeros: `bound(-5e4, "Pa")` is `−0.05 MPa`."""
    number, unit = display(value, si_unit)
    return f"{number + 0.0:.6g} {unit}".strip().replace("-", "−", 1)


def probability_text(probability: float) -> str:
    """Two decimals; of the least that they round to 0, a limit."""
    return f"{probability:.2f}" if probability >= 0.005 else "< 0.01"
