"""A diagnosis: verdict, confidence set, every model's figures, before and after; its JSON is a contract."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from birdstrike.data.files import write_json
from birdstrike.inversion.diagnosis.heldout import HeldOut
from birdstrike.inversion.diagnosis.remainder import Remainder
from birdstrike.inversion.diagnosis.separate import Proposal
from birdstrike.solver.case.case import Case

OWN_FILES = ("curves", "case", "held_out")  # fields that are not written to diagnosis.json as they stand


@dataclass(frozen=True)
class EffectFigures:
    """One model of the library (`none`: without effects); magnitude and interval in SI, None for `none`.

    log_evidence: over none; at_bound: the magnitude is held by a bound; twins: name -> cosine; absorbed: share of the
    signature that the calibrated parameters imitate; bias: what one plausible size would add to each of them, SI, were
    it there and not in the model; confirmed: the solver was asked at the fit.
    """

    name: str
    magnitude: float | None
    unit: str
    interval_95: tuple[float, float] | None
    p_consistent: float
    log_evidence: float
    twins: Mapping[str, float]
    at_bound: bool
    absorbed: float | None
    bias: Mapping[str, float]
    plausible_size: float | None
    meaning: str
    confirmed: bool

    def figures(self) -> dict[str, Any]:
        """For JSON."""
        return dict(vars(self))


@dataclass(frozen=True)
class State:
    """The model before or after the effect is added.

    rmse: sensor -> SI; weighted: whitened RMS (1 = noise); raw: the same with measurement noise alone as the unit;
    heldout: time_block, channel (the worst one), shot -> whitened RMS or None; parameters: name -> value, interval_95,
    unit; solver: the first three (rmse, weighted, raw) of one strike of the solver at the fit, with what finer meshes
    add, `declared`, the first without that, and `off`, the RMS of what lies between its curve and the fitted one,
    whitened; None where there is no such strike.
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
        """rmse, weighted, raw: the solver's own where there is a strike, else the fitted ones."""
        return self.solver or vars(self)

    def figures(self) -> dict[str, Any]:
        """For JSON."""
        return dict(vars(self))


@dataclass(frozen=True)
class Diagnosis:
    """Everything that a diagnosis found; `sentence` is the one for a test report.

    unnamed: why the only effect in the confidence set is not named (see inversion.diagnosis.choice), else None;
    held_out: by time_block, "channel <name>", shot; tolerances: where no noise is known, the verdict at each;
    case: the case with the effect in it, which `case_after` is the file of.
    """

    alpha: float
    verdict: str
    confidence_set: tuple[str, ...]
    effects: tuple[EffectFigures, ...]
    before: State
    after: State | None
    minimum_detectable: Mapping[str, float | None]
    next_measurement: Proposal | None
    pairs: tuple[Mapping[str, Any], ...]
    remainder: Remainder | None
    noise: Mapping[str, Any]
    nuisance: Mapping[str, Mapping[str, float]]
    case_after: str | None
    strikes: Mapping[str, Any]
    warnings: tuple[str, ...]
    held_out: Mapping[str, HeldOut]
    tolerances: tuple[Mapping[str, Any], ...]
    refused: Mapping[str, str]
    record: Mapping[str, Any]
    sentence: str
    unnamed: str | None = None
    curves: Mapping[str, Any] = field(default_factory=dict)
    case: Case | None = None

    def named(self, name: str) -> EffectFigures:
        """Figures of one model."""
        return next(one for one in self.effects if one.name == name)

    def figures(self) -> dict[str, Any]:
        """The content of diagnosis.json, without the schema's version."""
        plain = {key: value for key, value in vars(self).items() if key not in OWN_FILES}
        proposal = self.next_measurement
        return {
            **plain,
            "effects": [one.figures() for one in self.effects],
            "before": self.before.figures(),
            "after": self.after.figures() if self.after else None,
            "next_measurement": {**asdict(proposal), "sentence": proposal.sentence} if proposal else None,
            "remainder": self.remainder.figures() if self.remainder else None,
            "held_out": {name: vars(one) for name, one in self.held_out.items()},
        }

    def save(self, path: Path) -> None:
        """Write diagnosis.json, whole or not at all."""
        write_json(path, self.figures())
