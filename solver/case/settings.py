"""What a case says around the event: numerical settings, and what an inversion may vary."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any

from pydantic import Field, ValidationInfo, field_validator
from pydantic_core import InitErrorDetails

from birdstrike.data.nearest import nearest
from birdstrike.data.units import UnitError, share
from birdstrike.solver.bird.model_names import table_of
from birdstrike.solver.case.external import Text
from birdstrike.solver.case.sections import quantities, quantity_at
from birdstrike.solver.fields import Between, Count, OneOf, Section, complaint, each_of
from birdstrike.solver.registry import errors_of

ROUNDING = 1e-9
"""Of a limit: a range that is no wider, such as from "100 Pa s" to "0.1 MPa ms", has no width but a conversion's."""
MATERIAL, DENSITY = "bird.material.", "bird.density"
NUISANCE = {
    "time_offset": Between("0 ms", "10 ms"),
    "speed": Between("0 m/s", "100 m/s"),
    "mass": Between("0 g", "5000 g"),
    "thickness": Between("0 mm", "10 mm"),
    "angle": Between("0 deg", "20 deg"),
}


class SolverSettings(Section):
    """Numerical choices.

    name: the embedded solver, or the external one of the case's section `external` (`solver = "external"` for short);
    courant: share of the stable step; shock_linear, shock_quadratic: artificial viscosity (on shocks only);
    smoothing: smoothing length over particle spacing; threads (absent: all cores) change no bit of a history.

    Of a bird of hexahedra: hourglass control by dampers or by springs (absent: springs for an elastic bird, dampers for
    all that flow), its coefficient (absent: 0.02 for dampers, 0.05 for springs); smallest_step: an element whose stable
    step falls below this share of the undistorted mesh's smallest is eroded; the run's step is at most that share,
    so that a smaller one costs more time and erodes less.
    shock_linear, shock_quadratic: 1 and 2 stand for the usual 0.06 and 1.5.
    """

    name: Annotated[str, OneOf(("embedded", "external"))] = "embedded"
    courant: Annotated[float, Between(0.05, 1.0)] = 0.9
    shock_linear: Annotated[float, Between(0.0, 5.0)] = 1.0
    shock_quadratic: Annotated[float, Between(0.0, 10.0)] = 2.0
    smoothing: Annotated[float, Between(1.0, 2.5)] = 1.2
    threads: Annotated[int, Count(1, 1024)] | None = None
    hourglass: Annotated[str, OneOf(("viscous", "stiffness"))] | None = None
    hourglass_coefficient: Annotated[float, Between(0.0, 0.3)] | None = None
    smallest_step: Annotated[float, Between(0.02, 0.9)] = 0.25


class Prior(Section):
    """What is known of a parameter beside its range: mean and standard deviation in SI, normal in the range's scale."""

    mean: float
    sd: float


class Inverted(Section):
    """A parameter to be found: key (dotted, filled in by its parent) and range, the SI limits of the search.

    scale: in which a design spreads its runs over the range, and in which a prior is normal; logarithmic for one that
    spans decades.
    prior: what else is known of it, cut off at the range; absent: a normal one about the middle of the range with its
    standard deviation, range/sqrt(12).
    """

    key: str
    range: tuple[float, float]
    scale: Annotated[str, OneOf(("linear", "logarithmic"))] = "linear"
    prior: Prior | None = None

    @field_validator("range", mode="before")
    @classmethod
    def _range_in_the_unit_of_the_parameter(cls, value: Any, info: ValidationInfo) -> tuple[float, float]:
        mark = quantity_at(info.data["key"])
        if mark is None:
            raise complaint(_no_such_quantity(info.data["key"]))
        if reason := _not_sought(info.data["key"]):
            raise complaint(f"cannot be a parameter: {reason}")
        if not isinstance(value, list | tuple) or len(value) != 2:
            raise complaint(f'must be two limits such as ["{mark.low}", "{mark.high}"]')
        low, high = each_of(dict(enumerate(value)), lambda _, limit: mark.validate(limit)).values()
        if not high - low > ROUNDING * max(abs(low), abs(high)):
            raise complaint("must rise: the lower limit first")
        return low, high

    @field_validator("scale", mode="after")
    @classmethod
    def _logarithms_of_one_sign(cls, value: str, info: ValidationInfo) -> str:
        low, high = info.data.get("range", (1.0, 1.0))
        if value == "logarithmic" and low * high <= 0.0:
            raise complaint("needs a range on one side of 0, such as from a thousandth of its upper limit")
        return value

    @field_validator("prior", mode="before")
    @classmethod
    def _prior_in_the_unit_of_the_parameter(cls, value: Any, info: ValidationInfo) -> Any:
        mark, limits = quantity_at(info.data["key"]), info.data.get("range")
        if value is None or mark is None or limits is None:
            return None
        low, high = limits
        if not isinstance(value, dict) or set(value) != set(Prior.model_fields):
            middle, fifth = mark.written(0.5 * (low + high)), mark.written(0.2 * (high - low))
            raise complaint(f"must be a mean and a standard deviation such as {{ mean = {middle}, sd = {fifth} }}")
        found = each_of(value, lambda _, entry: mark.si(entry))
        if not low <= found["mean"] <= high:
            raise complaint(f"has its mean outside the range, {mark.display(low)} .. {mark.display(high)}")
        if not found["sd"] > 0.0:
            raise complaint("has a standard deviation that is not above 0; to fix the value, state it in the case")
        logarithmic = info.data.get("scale") == "logarithmic"
        whole = abs(found["mean"] * math.log(high / low)) if logarithmic else high - low
        if found["sd"] >= whole / math.sqrt(12.0):
            raise complaint(
                f"has a standard deviation that tells no more than the range does, whose own is "
                f"{mark.display(whole / math.sqrt(12.0))}; leave the prior out, or widen the range"
            )
        return found


def _not_sought(key: str) -> str:
    """Why a quantity cannot be sought; empty for one that can."""
    return "it says what is computed and recorded, not what is struck" if key.startswith("time.") else ""


def _no_such_quantity(key: str) -> str:
    """Why a dotted key cannot be sought, with the nearest that can."""
    known = [name for name, _ in quantities() if not _not_sought(name)]
    return f"belongs to no quantity of a case; {_did_you_mean(key, dict(zip(known, known, strict=True)))}"


def _did_you_mean(word: str, known: Mapping[str, str]) -> str:
    """The key of the nearest of the known words, or all keys."""
    close = nearest(word, known)
    return f"did you mean {known[close]}?" if close else f"known: {', '.join(known.values())}"


def _not_of_model(name: str, entries: Any) -> Iterator[InitErrorDetails]:
    """What is wrong with a name under `inversion.models`, and keys there that are no constant of that model."""
    try:
        table = table_of(name)
    except ValueError as error:
        yield InitErrorDetails(type=complaint(str(error)), loc=(name,), input={})
        return
    known = [key for key, _ in quantities({"bird": {"material": table}}) if key.startswith(MATERIAL)]
    for key in entries if isinstance(entries, dict) else ():
        if not key.startswith((MATERIAL, DENSITY)) and quantity_at(key) is not None:
            text = f"is no constant of the bird model {name}; what else is sought stands in inversion.parameters"
            yield InitErrorDetails(type=complaint(text), loc=(name, key), input={})
        elif key.startswith(MATERIAL) and key not in known:
            close = _did_you_mean(key.rsplit(".", 1)[-1], {one.rsplit(".", 1)[-1]: one for one in known})
            text = f"belongs to no quantity of the model {name}; {close}"
            yield InitErrorDetails(type=complaint(text), loc=(name, key), input={})


class InversionSettings(Section):
    """parameters: dotted case key -> range; nuisance: name -> known uncertainty, 1 sigma in SI.

    discrepancy: sensor -> error of the model's form, 1 sigma as a share of the largest value that the sensor recorded.
    models: bird model as `calibrate-models` names it -> dotted case key -> range, in place of the model's own.
    """

    parameters: dict[str, Inverted] = Field(default_factory=dict)
    models: dict[str, dict[str, Inverted]] = Field(default_factory=dict)
    nuisance: dict[str, float] = Field(default_factory=dict)
    discrepancy: dict[str, float] = Field(default_factory=dict)

    @field_validator("parameters", mode="before")
    @classmethod
    def _each_parameter_knows_its_key(cls, value: Any) -> Any:
        if not isinstance(value, dict):
            return value
        if any(isinstance(entry, dict) and "key" in entry for entry in value.values()):
            raise complaint('has an entry with a key named "key"; known here: range, scale, prior')
        return {key: {"key": key} | entry if isinstance(entry, dict) else entry for key, entry in value.items()}

    @field_validator("models", mode="before")
    @classmethod
    def _parameters_of_each_model(cls, value: Any) -> Any:
        if not isinstance(value, dict):
            return value
        wrong = [error for name, entries in value.items() for error in _not_of_model(name, entries)]
        if wrong:
            raise errors_of(wrong)
        return {name: cls._each_parameter_knows_its_key(entries) for name, entries in value.items()}

    @field_validator("nuisance", mode="before")
    @classmethod
    def _known_nuisances(cls, value: Any) -> Any:
        return each_of(value, _nuisance) if isinstance(value, dict) else value

    @field_validator("discrepancy", mode="before")
    @classmethod
    def _shares_of_the_peak(cls, value: Any) -> Any:
        return each_of(value, _discrepancy) if isinstance(value, dict) else value


class DiagnosisSettings(Section):
    """baselines: records of shots at the same rig in which nothing is suspected; whole paths, or shipped names.

    baseline_bird: what is known of their birds beside the shot's: of one batch, of one recipe, unlike; or nothing.
    """

    baselines: tuple[Annotated[str, Text('"clean.csv"')], ...] = ()
    baseline_bird: Annotated[str, OneOf(("auto", "same", "recipe", "other"))] = "auto"


def _discrepancy(sensor: str, given: Any) -> float:
    """Share of the sensor's peak from "2 %"."""
    meant = f'a percentage of the largest value that {sensor} recorded, such as "2 %"'
    if not isinstance(given, str):
        raise complaint(f"must be {meant}")
    try:
        found = share(given)
    except UnitError as error:
        raise complaint(f"is not understood: {error}; write {meant}") from error
    if not 0.0 <= found <= 1.0:
        raise complaint(f"is outside 0 % .. 100 %; it is {meant}")
    return found + 0.0


def _nuisance(name: str, sigma: Any) -> float:
    """Sigma in SI of a known nuisance."""
    if name not in NUISANCE:
        raise complaint(f"is unknown; available: {', '.join(NUISANCE)}")
    return NUISANCE[name].validate(sigma)
