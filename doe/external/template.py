"""The deck of an external solver: a template whose placeholders are the case's quantities, each in the deck's unit."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jinja2

from birdstrike.data.errors import CaseError, UnitError
from birdstrike.data.units import from_si, si_unit
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.overlay import at
from birdstrike.solver.case.sections import entry_at, quantity_at

NAMED = {"plate", "bird", "impact", "time", "solver"}
"""Tables of a case whose keys a template may name."""


class Quantity(float):
    """A number in SI that knows its unit; times, over or with a number it keeps it."""

    unit: str

    def __new__(cls, value: float, unit: str) -> Quantity:
        quantity = super().__new__(cls, value)
        quantity.unit = unit
        return quantity

    def __mul__(self, other: float) -> float:
        return float(self) * float(other) if isinstance(other, Quantity) else Quantity(float(self) * other, self.unit)

    __rmul__ = __mul__

    def __truediv__(self, other: float) -> float:
        return float(self) / float(other) if isinstance(other, Quantity) else Quantity(float(self) / other, self.unit)

    def __neg__(self) -> Quantity:
        return Quantity(-float(self), self.unit)


def to(value: Any, unit: str) -> float:
    """The filter `| to("MPa ms")`: a quantity as a number in a unit of its dimension; raises UnitError."""
    if not isinstance(value, Quantity):
        raise UnitError(f'to("{unit}") stands behind {value}, which has no unit: only a quantity of the case has one')
    if si_unit(unit) != value.unit:
        raise UnitError(f'to("{unit}") stands behind a quantity in {value.unit or "no unit"}, another dimension')
    return from_si(value, unit)


def card(value: float, width: int = 10) -> str:
    """The filter `| card(10)`: a number flush right in a field of `width` characters, with as many digits as fit.

    Raises UnitError where not even one digit fits.
    """
    for digits in range(17, 0, -1):
        plain, scientific = f"{float(value):.{digits}g}", f"{float(value):.{digits - 1}e}"
        for text in (plain, _shortened(plain), _shortened(scientific)):
            if len(text) <= width:
                return text.rjust(width)
    raise UnitError(f"card({width}) is too narrow for {float(value):g}")


def _shortened(text: str) -> str:
    """A number without what says nothing: 0.5 as .5, 1.230e-05 as 1.23e-5."""
    mantissa, sign, exponent = text.partition("e")
    if "." in mantissa and sign:
        mantissa = mantissa.rstrip("0").rstrip(".")
    mantissa = re.sub(r"^(-?)0(?=\.)", r"\1", mantissa)
    return f"{mantissa}e{int(exponent)}" if sign else mantissa


def rendered(case: Case, step_factor: float = 1.0) -> str:
    """The deck of a case; raises CaseError with the line of the template that cannot be filled."""
    return filled(case, case_values(case), step_factor)


def filled(case: Case, values: Mapping[str, Any], step_factor: float = 1.0) -> str:
    """The case's template with other values than its own; raises as `rendered` does."""
    assert case.external is not None
    path = Path(case.external.template)
    try:
        return _template(path).render(placeholders(case, values) | {"step_factor": step_factor})
    except jinja2.TemplateSyntaxError as error:
        raise CaseError(f"{path}, line {error.lineno}: {error.message}") from error
    except jinja2.UndefinedError as error:
        raise CaseError(f"{path}{_line(error)}: {error}; {_known_names(case)}") from error
    except (jinja2.TemplateError, UnitError, TypeError, ZeroDivisionError) as error:
        raise CaseError(f"{path}{_line(error)}: {error}") from error
    except UnicodeDecodeError as error:
        raise CaseError(f"{path} is not UTF-8 text: {error}") from error


def _known_names(case: Case) -> str:
    """What a template of the case may name, for one that names something else."""
    sought = ", ".join(name.rsplit(".", 1)[-1] for name in case.inversion.parameters)
    short = f"the last word of what it seeks ({sought})" if sought else "no short name, since it seeks nothing"
    return (
        f"a template may name the whole keys of the case {case.name} in {', '.join(sorted(NAMED))}, such as "
        f"bird.material.viscosity, and {short}"
    )


def case_values(case: Case) -> dict[str, Any]:
    """What of a case a template may name, nested, SI; the bird's mass and density as they are, whichever is stated."""
    tree = case.model_dump(include=NAMED)
    tree["bird"] |= {"density": case.bird.actual_density, "mass": case.bird.actual_mass}
    return tree


def placeholders(case: Case, values: Mapping[str, Any]) -> dict[str, Any]:
    """What a template may name: the case's own tables, and the last words of the sought parameters' keys.

    Beside them velocity_normal and velocity_along, the components of the impact's velocity, both positive.
    """
    known = {name: _quantities(table, name) for name, table in values.items()}
    last = [name.rsplit(".", 1)[-1] for name in case.inversion.parameters]
    short = {
        word: at(known, name)
        for name, word in zip(case.inversion.parameters, last, strict=True)
        if last.count(word) == 1 and word not in known
    }
    speed, angle = values["impact"]["speed"], values["impact"]["angle"]
    normal, along = (Quantity(speed * part, "m/s") for part in (math.sin(angle), math.cos(angle)))
    return {**short, **known, "velocity_normal": normal, "velocity_along": along}


def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(undefined=jinja2.StrictUndefined, keep_trailing_newline=True, autoescape=False)
    environment.filters |= {"to": to, "card": card}
    return environment


def _template(path: Path) -> jinja2.Template:
    environment = _environment()
    code = environment.compile(path.read_text(encoding="utf-8"), filename=str(path))
    return jinja2.Template.from_code(environment, code, environment.globals)


def _quantities(value: Any, key: str) -> Any:
    """A table of the case with its physical quantities as such, those in lists too."""
    if isinstance(value, Mapping):
        return {name: _quantities(entry, f"{key}.{name}") for name, entry in value.items()}
    if isinstance(value, list | tuple):
        mark = entry_at(key)
        return value if mark is None else [Quantity(entry, mark.unit) for entry in value]
    mark = quantity_at(key) if isinstance(value, float) else None
    return value if mark is None else Quantity(value, mark.unit)


def _line(error: Exception) -> str:
    """ ", line 12" of the template in which an error arose: jinja names the template's own lines in the traceback."""
    trace, line = error.__traceback__, ""
    while trace is not None:
        if trace.tb_frame.f_code.co_name in ("root", "top-level template code"):
            line = f", line {trace.tb_lineno}"
        trace = trace.tb_next
    return line
