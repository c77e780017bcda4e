"""The content of diagnosis.json: what a diagnosis found. The file is a contract."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from birdstrike.data.display import Displayed, draw_curves, own_axes
from birdstrike.data.errors import UserError
from birdstrike.data.storage.files import file_in, write_json
from birdstrike.inversion.labels import label_parts, provenance_of
from birdstrike.inversion.results.estimates import ends_95
from birdstrike.solver.case.case import Case

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

RESULT = "diagnosis.json"
NONE, SOMETHING_ELSE = "none", "something_else"
"""Models that are no effect, beside whose names those of effects stand."""
NOT_EFFECTS = {NONE: "no effect", SOMETHING_ELSE: "something that no effect of the library describes"}
LEAST_SHARE, MOST_SHARE = 0.0005, 0.5
"""Of the peak: range in which the model error that a model requires is looked for."""
ATTRIBUTED, AMBIGUOUS, UNEXPLAINED, NO_RESIDUAL = "attributed", "ambiguous", "unexplained", "no_significant_residual"
LEVEL = 0.95
HEADS = {
    NO_RESIDUAL: "No significant residual",
    ATTRIBUTED: "Attributed",
    AMBIGUOUS: "Ambiguous",
    UNEXPLAINED: "Unexplained",
}
OWN_FILES = ("curves", "case", "model")
AGAIN = "repeat birdstrike diagnose with the same --out, whose simulations are stored"
"""What to do about a damaged file of a diagnosis."""
LISTED = 8  # models in the picture of the probabilities


@dataclass(frozen=True)
class EffectFigures:
    """One model; magnitude and interval in SI, None for `none` and `something_else`.

    probability: that it is there, alone or in a pair; p_consistent: its evidence against the best model's, 1e-4 .. 1,
    no frequency (`answer.consistency`); log_evidence: over none; twins: name -> cosine of the signatures, less what the
    calibrated parameters imitate of them; at_bound: the largest magnitude looked at is reached; absorbed: share of the
    signature, squared and weighed by all errors but the unnamed ones, that these parameters imitate; bias: what one
    plausible size would add to each of them in the fit without an effect, SI; confirmed: the solver was run at the fit.
    """

    name: str
    family: str
    meaning: str
    probability: float
    prior: float
    magnitude: float | None
    unit: str
    interval_95: tuple[float, float] | None
    at_bound: bool
    p_consistent: float
    log_evidence: float
    required_discrepancy: float | None
    twins: Mapping[str, float]
    absorbed: float | None
    bias: Mapping[str, float]
    plausible_size: float | None
    confirmed: bool

    def figures(self) -> dict[str, Any]:
        """For JSON."""
        return dict(vars(self))


@dataclass(frozen=True)
class State:
    """The model before or after.

    rmse: sensor -> SI; weighted: whitened RMS (1: all errors together), less what the baselines show;
    raw: in units of the measurement noise alone; heldout: time_block, channel, shot; parameters: name -> value,
    interval_95, unit; solver: rmse of one run of the declared case, or None; rmse_less_baseline: sensor -> SI, of the
    residual less what the baselines' residuals tell of it, None without a baseline, and of the solver, whose declared
    mesh is not that on which the baselines were calibrated.
    """

    model: str
    rmse: Mapping[str, float]
    weighted: float
    raw: float
    heldout: Mapping[str, float | None]
    parameters: Mapping[str, Mapping[str, Any]]
    solver: Mapping[str, Any] | None = None
    rmse_less_baseline: Mapping[str, float] | None = None

    @property
    def point(self) -> dict[str, float]:
        """Dotted key -> fitted value, SI, of those that have one."""
        return {key: float(one["value"]) for key, one in self.parameters.items() if one["value"] is not None}


@dataclass(frozen=True)
class Errors:
    """Of one state, as in `State`."""

    rmse: Mapping[str, float]
    weighted: float
    raw: float
    rmse_less_baseline: Mapping[str, float] | None


def errors(before: State, after: State | None) -> tuple[Errors, Errors | None]:
    """Errors of two states, like with like: the solver's where it was run for both, else the fits'.

    Less the baseline's they are those of the fits, on the mesh on which the baseline was calibrated.
    """
    ran = all(one.solver for one in (before, after) if one is not None)

    def of(one: State) -> Errors:
        source = one.solver if ran and one.solver else vars(one)
        return Errors(source["rmse"], source["weighted"], source["raw"], one.rmse_less_baseline)

    return of(before), of(after) if after is not None else None


@dataclass(frozen=True)
class ShotStates:
    """One shot: name, name of its case, the model before and after in it."""

    name: str
    case: str
    before: State
    after: State | None

    def figures(self) -> dict[str, Any]:
        """For JSON."""
        return {**vars(self), "before": vars(self.before), "after": vars(self.after) if self.after else None}


def of_another_bird(same_bird: float | None) -> bool:
    """Whether the birds of shots and baselines are rather not one; None: there is a single shot."""
    return same_bird is not None and same_bird < 0.5


@dataclass(frozen=True, repr=False)
class Diagnosis(Displayed):
    """Everything that a diagnosis found; `sentence` is the one for a test report.

    alarm: p-value of none; families, probabilities: posterior; required_discrepancy: shares of the peak; left_out:
    channels that simulations cannot predict -> share of the peak by which another lattice moves them; tolerances and
    unnamed: of earlier versions, always empty; options: see `diagnose.asked`, None in earlier versions; case: the case
    with the effect in it, which `case_after` is the file of; model: the emulators and fits as arrays, of which
    model.npz is the file.
    """

    alpha: float
    alarm: float
    verdict: str
    confidence_set: tuple[str, ...]
    probabilities: Mapping[str, float]
    families: Mapping[str, float]
    required_discrepancy: Mapping[str, float | None]
    effects: tuple[EffectFigures, ...]
    before: State
    after: State | None
    minimum_detectable: Mapping[str, float | None]
    next_measurement: Mapping[str, Any] | None
    pairs: tuple[Mapping[str, Any], ...]
    remainder: Mapping[str, Any] | None
    noise: Mapping[str, Any]
    discrepancy: Mapping[str, Any]
    nuisance: Mapping[str, Any]
    baseline: Mapping[str, Any] | None
    shots: tuple[ShotStates, ...]
    held_out: Mapping[str, Mapping[str, float | None]]
    case_after: str | None
    strikes: Mapping[str, Any]
    warnings: tuple[str, ...]
    refused: Mapping[str, str]
    record: Mapping[str, Any]
    sentence: str
    curves: Mapping[str, Any] = field(default_factory=dict)
    case: Case | None = None
    model: Mapping[str, Any] = field(default_factory=dict)
    left_out: Mapping[str, float] = field(default_factory=dict)
    tolerances: tuple[Mapping[str, Any], ...] = ()
    unnamed: str | None = None
    options: Mapping[str, Any] | None = None

    def named(self, name: str) -> EffectFigures:
        """Figures of one model."""
        return next(one for one in self.effects if one.name == name)

    def figures(self) -> dict[str, Any]:
        """The content of diagnosis.json, without the schema's version."""
        plain = {key: value for key, value in vars(self).items() if key not in OWN_FILES}
        return {
            **plain,
            "effects": [one.figures() for one in self.effects],
            "before": dict(vars(self.before)),
            "after": dict(vars(self.after)) if self.after else None,
            "shots": [one.figures() for one in self.shots],
        }

    def save(self, path: str | Path) -> None:
        """Write JSON, into diagnosis.json of a folder, whole or not at all."""
        write_json(file_in(path, RESULT), self.figures())

    @classmethod
    def load(cls, path: str | Path) -> Diagnosis:
        """From diagnosis.json or its folder, without what has files of its own: curves, case and model.npz.

        Raises UserError for a file that is missing, damaged or of another version.
        """
        file = file_in(path, RESULT)
        try:
            return _DIAGNOSIS.validate_json(file.read_bytes())
        except (OSError, ValidationError) as error:
            raise UserError(f"{file} is missing, damaged or of another version; {AGAIN}") from error

    read = load
    """The same, by the name that it had first."""

    @property
    def shown_shot(self) -> ShotStates:
        """The first shot in which the effect of `after` acts: one of a single shot acts in no other.

        Of a fault of one sensor the first whose record has that sensor.
        """
        _, place, alone = label_parts(self.after.model if self.after else "")
        acting = [one for one in self.shots if alone in ("", one.name)]
        return next((one for one in acting if place and place in one.before.rmse), acting[0])

    @property
    def of_another_bird(self) -> bool:
        """Whether the bird of the baselines is rather another one than the shot's."""
        return of_another_bird((self.baseline or {}).get("same_bird"))

    @property
    def provenance(self) -> str:
        """Whether the records are measured, and of several which are simulated."""
        return provenance_of(self.record, self.record["shots"])

    @property
    def listed(self) -> tuple[EffectFigures, ...]:
        """The effects of which the records say something: without the faults of sensors that are not used."""
        return tuple(one for one in self.effects if label_parts(one.name)[1] not in self.left_out)

    @property
    def units(self) -> dict[str, str]:
        """SI unit of every sensor."""
        return {name: one["unit"] for name, one in self.noise["sensors"].items()}

    @property
    def conclusion(self) -> str:
        """The verdict in words and the sentence, as files and pages give them."""
        return f"{HEADS[self.verdict]}. {self.sentence}."

    @property
    def headline(self) -> str:
        """The verdict with the sentence for a report."""
        return f"Diagnosis: {HEADS[self.verdict].lower()}. {self.sentence}"

    def to_dataframe(self) -> pd.DataFrame:
        """A row a model, the likeliest first: probability, magnitude with the ends of its 95 % interval, SI."""
        import pandas as pd

        rows = [
            {
                "name": one.name,
                "probability": one.probability,
                "magnitude": np.nan if one.magnitude is None else one.magnitude,
                **ends_95(one.interval_95),
                "unit": one.unit,
                "p_consistent": one.p_consistent,
                "meaning": one.meaning,
            }
            for one in self.effects
        ]
        return pd.DataFrame(rows)

    def plot(self, channel: str | None = None, axes: Axes | None = None, shot: str | None = None) -> Axes:
        """The likeliest models' probabilities; with a channel, its record with the curves before and after.

        shot: by name, the first by default. Raises UserError for a name that is not there.
        """
        on = own_axes(axes)
        if channel is None:
            first = self.effects[:LISTED][::-1]
            on.barh([one.name for one in first], [one.probability for one in first])
            on.set_xlim(0.0, 1.0)
            on.set_xlabel("probability")
            return on
        name, one = self._curves_of(channel, shot)
        if len(self.curves) > 1:
            on.set_title(f"shot {name}", fontsize="small")
        looks = {"measured": {"marker": ".", "linestyle": "none", "color": "black"}, "before": {}, "after": {}}
        for key, look in looks.items():
            if np.isfinite(one[key]).any():
                draw_curves(on, one["time"], one[key], channel, one["unit"], label=key, **look)
        on.legend(fontsize="small")
        return on

    def _curves_of(self, channel: str, shot: str | None) -> tuple[str, Mapping[str, Any]]:
        """A shot's name, of the first where none is given, and the columns of one of its channels."""
        if not self.curves:
            raise UserError(
                "a diagnosis that was read from diagnosis.json has no curves: they are in the CSV files beside it; "
                "diagnose with the same folder has them, and simulates nothing again"
            )
        name = next(iter(self.curves)) if shot is None else shot
        if name not in self.curves:
            raise UserError(f'no shot "{name}"; the shots are: {", ".join(self.curves)}')
        if channel not in self.curves[name]:
            raise UserError(f'shot {name} has no channel "{channel}"; its channels: {", ".join(self.curves[name])}')
        return name, self.curves[name][channel]

    def draw(self) -> tuple[Any, ...]:
        """The probabilities, and the first channel where the curves are at hand."""
        curves = next(iter(self.curves.values()), {})
        channels = [partial(self.plot, name) for name in list(curves)[:1]]
        return (lambda axes: self.plot(axes=axes), *channels)


_DIAGNOSIS = TypeAdapter(Diagnosis)
