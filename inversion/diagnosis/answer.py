"""The answer of a diagnosis: its figures, its verdict and its sentence; its JSON is a contract."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from birdstrike.data.files import write_json
from birdstrike.data.units import display
from birdstrike.inversion.diagnosis.hypotheses import NONE, SOMETHING_ELSE
from birdstrike.inversion.formatting import rounded
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.effects import SHOWN, shown
from birdstrike.solver.effects.registry import effects

ATTRIBUTED, AMBIGUOUS, UNEXPLAINED, NO_RESIDUAL = "attributed", "ambiguous", "unexplained", "no_significant_residual"
LEVEL = 0.95
HEADS = {
    NO_RESIDUAL: "No significant residual",
    ATTRIBUTED: "Attributed",
    AMBIGUOUS: "Ambiguous",
    UNEXPLAINED: "Unexplained",
}
OWN_FILES = ("curves", "case")
MOST_NAMED = 3


@dataclass(frozen=True)
class EffectFigures:
    """One model; magnitude and interval in SI, None for `none` and `something_else`. probability: posterior."""

    name: str
    family: str
    meaning: str
    probability: float
    prior: float
    magnitude: float | None
    unit: str
    interval_95: tuple[float, float] | None
    at_limit: bool
    p_consistent: float
    log_evidence: float
    required_discrepancy: float | None
    twins: Mapping[str, float]
    absorbed: float | None
    plausible_size: float | None

    def figures(self) -> dict[str, Any]:
        """For JSON."""
        return dict(vars(self))


@dataclass(frozen=True)
class State:
    """The model before or after. rmse: sensor -> SI; weighted: whitened RMS (1: noise, numerical error and discrepancy);
    raw: in units of the measurement noise alone; heldout: time_block, channel, shot; parameters: name -> value,
    interval_95, unit; solver: rmse of one run of the declared case, or None.
    """

    model: str
    rmse: Mapping[str, float]
    weighted: float
    raw: float
    heldout: Mapping[str, float | None]
    parameters: Mapping[str, Mapping[str, Any]]
    solver: Mapping[str, Any] | None = None

    @property
    def error(self) -> Mapping[str, Any]:
        """The solver's own error where it was run, else the fit's."""
        return {**vars(self), **(self.solver or {})}


@dataclass(frozen=True)
class Answer:
    """Everything that a diagnosis found; `sentence` is the one for a test report."""

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
    shots: tuple[Mapping[str, Any], ...]
    held_out: Mapping[str, Mapping[str, float | None]]
    case_after: str | None
    strikes: Mapping[str, Any]
    warnings: tuple[str, ...]
    refused: Mapping[str, str]
    record: Mapping[str, Any]
    sentence: str
    curves: Mapping[str, Any] = field(default_factory=dict)
    case: Case | None = None

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
        }

    def save(self, path: Path) -> None:
        """Write diagnosis.json, whole or not at all."""
        write_json(path, self.figures())


def verdict_of(shares: Mapping[str, float], alarm: float, alpha: float, singles: set[str], credible: tuple[str, ...]) -> str:
    """attributed: one effect holds 95 % and the alarm was raised; unexplained: something else holds most."""
    if alarm >= alpha:
        return NO_RESIDUAL if shares.get(NONE, 0.0) >= 0.5 or NONE in credible else AMBIGUOUS
    best = max(shares, key=lambda name: shares[name])
    if best in singles and shares[best] >= LEVEL:
        return ATTRIBUTED
    return UNEXPLAINED if shares.get(SOMETHING_ELSE, 0.0) >= 0.5 else AMBIGUOUS


def magnitude_words(one: EffectFigures) -> str:
    """ "+0.2 mm (95 %: +0.1 .. +0.3 mm)"; "at least" where the limit of what was looked at is reached."""
    if one.magnitude is None:
        return ""
    effect = effects().get(one.name.split(".")[0].split("@")[0])
    if effect is None:
        return f"{one.magnitude:+.3g} {one.unit}".strip()
    if one.at_limit:
        return f"at least {shown(effect, one.interval_95[0] if one.interval_95 else one.magnitude)}"
    if one.interval_95 is None:
        return shown(effect, one.magnitude)
    unit = SHOWN.get(effect.unit, effect.unit)
    low, high = (shown(effect, x).removesuffix(unit).strip() for x in one.interval_95)
    return f"{shown(effect, one.magnitude)} (95 %: {low} .. {high} {unit}".rstrip() + ")"


def sentence_of(found: Answer) -> str:
    """One sentence that an engineer can put into a test report."""
    likely = [one for one in found.effects if one.name in found.confidence_set]
    needs = found.required_discrepancy.get(NONE)
    alone = "no discrepancy up to half of the peak" if needs is None else f"a model error of {100 * needs:.2g} % of the peak"
    if found.verdict == NO_RESIDUAL:
        return f"The calibrated model explains the record (p = {found.alarm:.2f}) with {alone}; no effect is missing that this record could show"
    if found.verdict == ATTRIBUTED:
        one = found.effects[0]
        return (
            f"The model lacks {one.meaning} ({one.name}), {magnitude_words(one)}, with probability "
            f"{one.probability:.2f}; {_errors(found)}without it the record needs {alone}"
        )
    if found.verdict == UNEXPLAINED:
        return f"The residual is real (p = {found.alarm:.3g}), but no effect of the library explains it: something else is likelier"
    named = "; ".join(f"{one.name} {magnitude_words(one)} with {one.probability:.2f}" for one in likely[:MOST_NAMED] if one.magnitude is not None)
    real = "The residual is real" if found.alarm < found.alpha else "The residual is not significant"
    rest = len(found.confidence_set) - min(len(likely), MOST_NAMED)
    more = f"; {rest} further models share the 95 % set" if rest > 0 else ""
    return f"{real} (p = {found.alarm:.2g}); the record does not decide between {named or 'the models of the set'}{more}"


def _errors(found: Answer) -> str:
    """Of the sensor with the largest error before, in its unit."""
    if found.after is None:
        return ""
    before, after = found.before.error["rmse"], found.after.error["rmse"]
    first = next(iter(before))
    unit = found.noise["sensors"][first]["unit"]
    low, high = display(after[first], unit), display(before[first], unit)
    return f"the error at {first.replace('_', ' ')} falls from {rounded(high[0], 3)} to {rounded(low[0], 3)} {low[1]}; "
