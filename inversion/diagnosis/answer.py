"""The answer of a diagnosis: its figures, its verdict and its sentence; its JSON is a contract."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import norm

from birdstrike.data.display import Displayed, draw_curves, own_axes
from birdstrike.data.errors import UserError
from birdstrike.data.files import write_json
from birdstrike.data.histories import Array
from birdstrike.data.units import display, rounded
from birdstrike.doe.campaign.simulations import Simulations
from birdstrike.inversion.diagnosis.alarm import SHARES
from birdstrike.inversion.diagnosis.before_and_after import (
    Held,
    SolverRun,
    estimate,
    expected_residual,
    predicted,
    rms_by_channel,
)
from birdstrike.inversion.diagnosis.hypotheses import NONE, SOMETHING_ELSE, Hypothesis
from birdstrike.inversion.diagnosis.power import absorbed, biases, collinear
from birdstrike.inversion.diagnosis.ranking import Fit, Ranking
from birdstrike.inversion.diagnosis.shots import Shot
from birdstrike.inversion.diagnosis.system import PRIOR_SD
from birdstrike.inversion.formatting import in_words, label_parts
from birdstrike.inversion.misfit import rms
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.effects import SHOWN, shown
from birdstrike.solver.effects.registry import effects, kind_of
from birdstrike.surrogate.gaussian_process import NORMAL_95

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

ATTRIBUTED, AMBIGUOUS, UNEXPLAINED, NO_RESIDUAL = "attributed", "ambiguous", "unexplained", "no_significant_residual"
LEVEL = 0.95
SOUND = 0.03  # of the peak: two sound codes differ by no more on one shot
SIMULATION_SCATTER = 5.0
"""Nats by which one effect may gain on another where their responses are simulated anew. On two shots of another code,
five sets of 8 to 24 pairs moved one lead by 1.3 (standard deviation); another was 15 to 21 by four sets at 2.5
plausible sizes, and 8 by a set at 1.6: more of a smaller change is scatter, hence `solver_update.LEAST_SIZE`."""
HEADS = {
    NO_RESIDUAL: "No significant residual",
    ATTRIBUTED: "Attributed",
    AMBIGUOUS: "Ambiguous",
    UNEXPLAINED: "Unexplained",
}
OWN_FILES = ("curves", "case", "model")
MOST_NAMED = 3
LISTED = 8  # models in the picture of the probabilities


@dataclass(frozen=True)
class EffectFigures:
    """One model; magnitude and interval in SI, None for `none` and `something_else`.

    probability: that it is there, alone or in a pair; p_consistent: of a likelihood ratio against the best model;
    log_evidence: over none; twins: name -> cosine; at_bound: the largest magnitude looked at is reached; absorbed:
    share of the signature that the calibrated parameters imitate; bias: what one plausible size would add to each of
    them, SI, were it there and not in the model; confirmed: the solver was run at the fit.
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


Errors = Mapping[str, Any]


def errors(before: Mapping[str, Any], after: Mapping[str, Any] | None) -> tuple[Errors, Errors | None]:
    """Errors of two states (as in diagnosis.json), like with like: the solver's where it was run for both, else the
    fits'. Less the baseline's they are those of the fits, on the mesh on which the baseline was calibrated.
    """
    states = [before] if after is None else [before, after]
    ran = all(one["solver"] for one in states)
    found = [
        {**one, **(one["solver"] if ran else {}), "rmse_less_baseline": one.get("rmse_less_baseline")} for one in states
    ]
    return found[0], found[1] if after is not None else None


def shot_with(shots: Sequence[Mapping[str, Any]], model: str) -> Mapping[str, Any]:
    """The first of the shots of diagnosis.json in which a model's effect acts; model: "" or `none` act in all.

    Of a fault of one sensor the first whose record has that sensor.
    """
    _, place, alone = label_parts(model)
    acting = [one for one in shots if alone in ("", one["name"])]
    return next((one for one in acting if place and place in one["before"]["rmse"]), acting[0])


@dataclass(frozen=True, repr=False)
class Diagnosis(Displayed):
    """Everything that a diagnosis found; `sentence` is the one for a test report.

    alarm: p-value of none; families, probabilities: posterior; required_discrepancy: shares of the peak; left_out:
    channels that simulations cannot predict -> share of the peak by which another lattice moves them; tolerances and
    unnamed: of earlier versions, always empty; case: the case with the effect in it, which `case_after` is the file of;
    model: the emulators and fits as arrays, of which model.npz is the file.
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
    model: Mapping[str, Any] = field(default_factory=dict)
    left_out: Mapping[str, float] = field(default_factory=dict)
    tolerances: tuple[Mapping[str, Any], ...] = ()
    unnamed: str | None = None

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

    @classmethod
    def read(cls, path: Path) -> Diagnosis:
        """From diagnosis.json, without what has files of its own: curves, case and model.npz."""
        content = json.loads(path.read_text(encoding="utf-8"))
        own = {one.name: content[one.name] for one in fields(cls) if one.name in content}
        own["effects"] = tuple(EffectFigures(**one) for one in content["effects"])
        own["before"] = State(**content["before"])
        own["after"] = State(**content["after"]) if content["after"] else None
        return cls(**own)

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
                "low_95": (one.interval_95 or (np.nan, np.nan))[0],
                "high_95": (one.interval_95 or (np.nan, np.nan))[1],
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


def verdict_of(
    presence: Mapping[str, float],
    alarm: float,
    alpha: float,
    credible: tuple[str, ...],
    same_bird: float | None = None,
    ahead: float = float("inf"),
) -> str:
    """attributed: the alarm was raised, one effect is there with 95 %, no other is, and other simulations would say so.

    presence: none, something else, and each effect -> probability that it is there. unexplained: something else holds
    most. same_bird: probability that the birds of all shots and baselines are one, None of a single shot: beside
    another bird nothing is attributed, because model error changes with the bird by as much as there is of it. ahead:
    nats by which the likeliest effect is ahead of the models without it.
    """
    if alarm >= alpha:
        return NO_RESIDUAL if presence.get(NONE, 0.0) >= 0.5 or NONE in credible else AMBIGUOUS
    if presence.get(SOMETHING_ELSE, 0.0) >= 0.5:
        return UNEXPLAINED
    first, second = ([*sorted((p for name, p in presence.items() if name != NONE), reverse=True), 0.0, 0.0])[:2]
    sure = first >= LEVEL > second and ahead >= SIMULATION_SCATTER and not of_another_bird(same_bird)
    return ATTRIBUTED if sure else AMBIGUOUS


def of_another_bird(same_bird: float | None) -> bool:
    """Whether the birds of shots and baselines are rather not one; None: there is a single shot."""
    return same_bird is not None and same_bird < 0.5


def magnitude_words(one: EffectFigures) -> str:
    """ "+0.2 mm (95 %: +0.1 .. +0.3 mm)"; "at least" where the limit of what was looked at is reached."""
    if one.magnitude is None:
        return ""
    if one.at_bound:
        return beyond(one.magnitude, one.interval_95, partial(shown, unit=one.unit))
    if one.interval_95 is None:
        return shown(one.magnitude, one.unit)
    unit = SHOWN.get(one.unit, one.unit)
    low, high = (shown(x, one.unit).removesuffix(unit).strip() for x in one.interval_95)
    return f"{shown(one.magnitude, one.unit)} (95 %: {low} .. {high} {unit}".rstrip() + ")"


def beyond(magnitude: float, interval_95: Sequence[float] | None, text: Callable[[float], str]) -> str:
    """Of a magnitude at the largest that was looked at, what it is at least: its interval's end nearest to 0.

    Of an interval that holds 0 there is no such thing: its other end, and that it reaches beyond what was looked at.
    """
    if interval_95 is None:
        return f"at least {text(magnitude)}"
    low, high = interval_95
    if low <= 0.0 <= high:
        return f"from {text(low if magnitude > 0.0 else high)} to beyond {text(magnitude)}"
    return f"at least {text(min(low, high, key=abs))}"


def headline(verdict: str, sentence: str) -> str:
    """The verdict in words and the sentence, as files and pages give them."""
    return f"{HEADS[verdict]}. {sentence}."


def provenance(record: Mapping[str, Any]) -> str:
    """ "The record is measured"; where only some of several shots are simulated, these by name.

    record: of diagnosis.json; one of an earlier version does not say which are simulated.
    """
    shots = record["shots"]
    made = record["simulated_shots"] if "simulated_shots" in record else shots if record["simulated"] else []
    some = made if 0 < len(made) < len(shots) else []
    record_s, be = ("records", "are") if len(some or shots) > 1 else ("record", "is")
    which = f" of {', '.join(some)}" if some else ""
    return f"The {record_s}{which} {be} {'simulated, not measured' if made else 'measured'}"


def next_step(verdict: str, likeliest: str, proposal: str | None, baseline: bool) -> str:
    """What to do after a diagnosis, by its verdict.

    likeliest: name of the likeliest effect; proposal: sentence of the proposed measurement, if there is one; baseline:
    whether one was given.
    """
    if verdict == NO_RESIDUAL and not baseline:
        return f"if an effect is suspected, {BASELINE_SHOT}"
    if proposal:
        return proposal
    if verdict == ATTRIBUTED:
        return f"check at the rig: {in_words(likeliest)}; repeat with another --seed where much depends on the answer"
    if verdict == UNEXPLAINED:
        own = "look for what the case does not describe, or define an effect of your own (documentation: Diagnosis)"
        return own if baseline else f"{BASELINE_SHOT}; then {own}"
    if verdict == NO_RESIDUAL:
        return 'nothing; what this record could have shown is in the table of effects under "least detectable"'
    return "measure with further sensors, or at another speed" if baseline else BASELINE_SHOT


def sentence_of(found: Diagnosis) -> str:
    """One sentence that an engineer can put into a test report."""
    needs = found.required_discrepancy.get(NONE)
    if found.verdict == NO_RESIDUAL:
        error = "" if needs is None else f" with {_model_error(needs)}"
        if needs is not None and needs > SOUND:
            error += ", more than the 1 to 3 % by which two sound codes differ"
        return f"The calibrated model explains the record (p = {found.alarm:.2f}){error}; {_unless(found)}"
    if found.verdict == ATTRIBUTED:
        one = found.effects[0]
        return (
            f"The model lacks {in_its_sense(one)} ({one.name}), {magnitude_words(one)}, with probability "
            f"{one.probability:.2f}{_beside(found)}{_errors(found)}; {_without(needs)}"
        )
    if found.verdict == UNEXPLAINED:
        return (
            f"The residual is real (p = {found.alarm:.3g}), but no effect of the library explains it: something else "
            f"is likelier, with probability {found.probabilities[SOMETHING_ELSE]:.2f}"
        )
    real = "The residual is real" if found.alarm < found.alpha else "The residual is not significant"
    listed = "; ".join(_named(found, name) for name in found.confidence_set[:MOST_NAMED])
    rest = len(found.confidence_set) - MOST_NAMED
    if len(found.confidence_set) == 1:
        return f"{real} (p = {found.alarm:.2g}); {listed} is the likeliest explanation, but it is not attributed"
    more = f"; {rest} further models share the 95 % set" if rest > 0 else ""
    if (first := found.effects[0]).probability >= LEVEL:
        more += f"; together the models with {first.name} hold {first.probability:.2f}"
    return f"{real} (p = {found.alarm:.2g}); the record does not decide between {listed}{more}"


BASELINE_SHOT = (
    "fire a shot in which nothing is changed, with a bird of the same batch, and give it by --baseline with "
    "--baseline-bird same"
)
"""What a diagnosis without a baseline needs first."""
OPPOSITES = re.compile(r"(\w+) or (\w+)")


def _unless(found: Diagnosis) -> str:
    """Of a record that raises no alarm: what is likelier than no missing effect all the same, and what would decide."""
    likeliest = found.confidence_set[0]
    if likeliest == NONE:
        return "no effect is missing that this record could show"
    decides = "a baseline shot would decide" if found.baseline is None else "this record cannot decide"
    return f"if its error is smaller, {_named(found, likeliest)} is likelier than no missing effect: {decides}"


def in_its_sense(one: EffectFigures) -> str:
    """The effect's meaning; of two opposites ("faster or slower") the one that its interval tells.

    The library names that of a positive magnitude first.
    """
    if one.interval_95 is None or one.interval_95[0] <= 0.0 <= one.interval_95[1]:
        return one.meaning
    return OPPOSITES.sub(r"\1" if one.interval_95[0] > 0.0 else r"\2", one.meaning)


def _without(needs: float | None) -> str:
    """What model error stands in for the effect; needs: as in `required_discrepancy`."""
    if needs is None:
        return "without it no model error up to half of the peak is enough"
    if needs <= SHARES[0]:
        return "without it no larger model error makes the record likelier"
    return f"without it the record needs {_model_error(needs)}"


def _model_error(share: float) -> str:
    """Of a share of the peak."""
    return f"a model error of {100 * share:.2g} % of the peak"


def _beside(found: Diagnosis) -> str:
    """The other effect that the records hold for likelier than not, if there is one."""
    other = found.effects[1]
    if other.name in NOT_EFFECTS or other.probability < 0.5:
        return ""
    return f", with a second effect that is likelier than not beside it: {other.name} ({other.probability:.2f})"


def _named(found: Diagnosis, name: str) -> str:
    """A model of the set with its magnitude and its probability."""
    share = f"({found.probabilities.get(name, 0.0):.2f})"
    if "+" in name:
        return f"{' with '.join(name.split('+'))} {share}"
    size = magnitude_words(found.named(name))
    told = {NONE: "no missing effect", SOMETHING_ELSE: "something outside the library"}.get(name, name)
    return f"{told} {size} {share}" if size else f"{told} {share}"


def _errors(found: Diagnosis) -> str:
    """Of one sensor in its unit, and of all by what noise and model error explain, in a shot that has the effect.

    The sensor is that of a fault of one sensor, else the first.

    A baseline's model error, which the shot shares, may stand against the effect: then the plain error grows while the
    record agrees better with what is expected of it; so the error is told less what the baseline shows. The misfit of
    all sensors is that of the fits: simulations of the declared mesh differ by its error, which is no part of the unit.
    """
    if found.after is None:
        return ""
    shot = shot_with(found.shots, found.after.model)
    before, after = errors(shot["before"], shot["after"])
    assert after is not None, "every shot has a state after where the first has one"
    place = label_parts(found.after.model)[1]
    first = place if place in before["rmse"] else next(iter(before["rmse"]))
    where = f" in shot {shot['name']}" if len(found.shots) > 1 else ""
    beside = before["rmse_less_baseline"]
    key, words = ("rmse_less_baseline", ", less what the baseline shows,") if beside else ("rmse", "")
    unit = found.noise["sensors"][first]["unit"]
    (old, shown_unit), (new, _) = (display(one[key][first], unit) for one in (before, after))
    changes = "falls" if new < old else "rises"
    ratios = (shot["before"]["weighted"], shot["after"]["weighted"])
    return (
        f"; the error at {first.replace('_', ' ')}{where}{words} {changes} from {rounded(old, 3)} to {rounded(new, 3)} "
        f"{shown_unit}, the misfit of all sensors' fits over noise and model error goes from {ratios[0]:.2g} to "
        f"{ratios[1]:.2g}"
    )


NOT_EFFECTS = {NONE: "no effect", SOMETHING_ELSE: "something that no effect of the library describes"}
REFUTED = 1e-4  # smallest p-value that is told
TOLD = 0.05  # probability of something else from which on it is told
GROWN = 3.0  # growth of the model error beyond which a curve tells nothing


def effect_figures(
    ranking: Ranking, required: Mapping[str, float | None], confirmed: str | None = None
) -> tuple[EffectFigures, ...]:
    """none, singles and something else, the likeliest first; confirmed: the effect that the solver was run with."""
    found = [_figures(ranking, label, required) for label, model in ranking.models.items() if len(model.members) < 2]
    alike, share, shifts = collinear(ranking), absorbed(ranking), biases(ranking)
    told = [
        replace(
            one,
            twins=alike.get(one.name, {}),
            absorbed=share.get(one.name),
            bias=shifts.get(one.name, {}),
            confirmed=one.name == confirmed,
        )
        for one in found
    ]
    return tuple(sorted(told, key=lambda one: -one.probability))


def _figures(ranking: Ranking, label: str, required: Mapping[str, float | None]) -> EffectFigures:
    """One model by itself."""
    model, evidence = ranking.models[label], ranking.evidence[label].log_evidence
    best = max(one.log_evidence for one in ranking.evidence.values())
    figures = EffectFigures(
        name=label,
        family=model.family,
        meaning=NOT_EFFECTS.get(label, ""),
        probability=ranking.presence[label],
        prior=model.prior,
        magnitude=None,
        unit="",
        interval_95=None,
        at_bound=False,
        p_consistent=consistency(evidence, best),
        log_evidence=evidence - ranking.evidence[NONE].log_evidence,
        required_discrepancy=required.get(label),
        twins={},
        absorbed=None,
        bias={},
        plausible_size=None,
        confirmed=False,
    )
    if not model.members:
        return figures
    one = model.members[0]
    magnitude, interval, at_bound = magnitude_of(ranking, label)
    named = replace(figures, meaning=_meaning(label, one.name), unit=one.unit, plausible_size=one.size)
    return replace(named, magnitude=magnitude, interval_95=interval, at_bound=at_bound)


def _meaning(label: str, name: str) -> str:
    text = effects()[kind_of(name)].meaning
    _, place, shot = label_parts(label)
    if place:
        text = text.replace("displacement transducer", "sensor")  # all transducers together, but any sensor alone
        return f"{text}: {place.replace('_', ' ')} alone"
    return f"{text}, in shot {shot} alone" if shot else text


def consistency(log_evidence: float, best: float) -> float:
    """p-value of a likelihood ratio against the best model, one degree of freedom."""
    return float(max(2.0 * norm.sf(np.sqrt(max(2.0 * (best - log_evidence), 0.0))), REFUTED))


def magnitude_of(ranking: Ranking, label: str) -> tuple[float, tuple[float, float], bool]:
    """SI magnitude, 95 % interval, whether a limit of what was looked at holds it.

    The magnitude is the posterior mean with what is not known of the signature as it is at the fit. About another
    model's fit that can lie outside the interval, which knows it at every size: then it is the median of the latter.
    The interval holds both.
    """
    standing, one = ranking.standings[label], ranking.models[label].members[0]
    low, high = one.limits
    evidence = standing.at_fit
    mean = float(np.clip(evidence.h[0], low, high))
    begin, middle, end = standing.fit.tester.quantiles(evidence)
    h = mean if standing.own or begin < mean < end else middle
    ends = [one.magnitude(x) for x in (min(begin, mean), max(end, mean))]
    return one.magnitude(h), (min(ends), max(ends)), reaches_limit(h, (begin, end), one.limits)


def reaches_limit(h: float, interval: tuple[float, float], limits: tuple[float, float]) -> bool:
    """Whether a size of response, and the end of its interval on that side, are those of the largest looked at.

    limits: of a response that bends not alike on both sides; the lower is 0 of an effect that cannot be negative.
    """
    (begin, end), (low, high) = interval, limits
    return (h > 0.9 * high and end > 0.95 * high) or (h < 0.9 * low < 0.0 and begin < 0.95 * low)


def state(ranking: Ranking, label: str, shot: Shot, held: list[Held], run: SolverRun | None) -> State:
    """The model in one shot at its fit."""
    fit, curve = ranking.fits[label], curve_at(ranking, label, shot)
    residual = shot.record.values - curve
    mean, sd = expected_residual(shot, ranking.problem, ranking.models[label], fit)
    noise = np.sqrt(np.diag(shot.record.covariance()))
    beside = any(one.baseline for one in ranking.problem.shots)
    solver = None
    if run is not None:
        off = shot.record.values - run.curve
        solver = {
            "rmse": rms_by_channel(shot, off),
            "weighted": rms((off - mean) / sd),
            "raw": rms(off / noise),
            "off": rms((run.curve - curve) / sd),
            "rmse_less_baseline": None,
        }
    return State(
        model=label,
        rmse=rms_by_channel(shot, residual),
        weighted=rms((residual - mean) / sd),
        raw=rms(residual / noise),
        heldout=in_short(held),
        parameters=parameters(fit, shot, ranking.models[label]),
        solver=solver,
        rmse_less_baseline=rms_by_channel(shot, residual - mean) if beside else None,
    )


def in_short(held: list[Held]) -> dict[str, float | None]:
    """time_block, the worst channel, the worst shot."""
    found: dict[str, float | None] = {"time_block": None, "channel": None, "shot": None}
    for one in held:
        key = one.name.split(" ")[0]
        found[key] = one.error if found.get(key) is None else max(found[key] or 0.0, one.error)
    return found


def curve_at(ranking: Ranking, label: str, shot: Shot) -> Array:
    """(n,) a fitted model on a shot's points."""
    fit, model = ranking.fits[label], ranking.models[label]
    return predicted(shot, model, *estimate(shot, model, fit))


def parameters(fit: Fit, shot: Shot, model: Hypothesis) -> dict[str, dict[str, Any]]:
    """Dotted key -> value, interval_95, unit, identified; SI."""
    space = shot.setup.plan.space
    k = len(space.names)
    mean, sd = fit.interval(shot.name, k)
    low, high = (np.clip(mean + s * NORMAL_95 * sd, 0.0, 1.0) for s in (-1, 1))
    ends = [space.to_physical(z[None])[0] for z in (low, estimate(shot, model, fit)[0], high)]
    return {
        name: {
            "value": float(ends[1][i]),
            "interval_95": (float(ends[0][i]), float(ends[2][i])),
            "unit": space.units[i],
            "identified": bool(sd[i] < 0.5 * PRIOR_SD),
        }
        for i, name in enumerate(space.names)
    }


def curves(ranking: Ranking, shot: Shot, after: str | None, runs: Mapping[str, SolverRun]) -> dict[str, Any]:
    """channel -> columns of diagnosis.csv."""
    label = after or NONE
    mean, sd = expected_residual(shot, ranking.problem, ranking.models[label], ranking.fits[label])
    noise = np.sqrt(np.diag(shot.record.covariance()))
    fitted = {"before": curve_at(ranking, NONE, shot)}
    if after:
        fitted["after"] = curve_at(ranking, after, shot)
    found: dict[str, Any] = {}
    for i, trace in enumerate(shot.record.traces):
        of = shot.record.channel == i
        blank = np.full(int(of.sum()), np.nan)
        found[trace.name] = {
            "unit": trace.unit,
            "time": trace.middle,
            "measured": trace.values,
            "sigma": noise[of],
            "error": sd[of],
            "baseline": mean[of],
            "before": fitted["before"][of],
            "after": fitted["after"][of] if after else blank,
            "before_solver": runs["before"].curve[of] if "before" in runs else blank,
            "after_solver": runs["after"].curve[of] if "after" in runs else blank,
        }
    return found


def noise_figures(shots: Sequence[Shot], ranking: Ranking) -> dict[str, Any]:
    """Noise of every sensor in the first shot that has it, its source, and the share of emulator and mesh in the whole.

    numerical_share: of standard deviations, beside the sensors that of the first shot; `numerical` and
    `numerical_enlarged` of earlier versions stay empty.
    """
    found = [_noise_in(shot, ranking) for shot in shots]
    sensors = {name: one for own, _ in found[::-1] for name, one in own.items()}
    order = dict.fromkeys(name for own, _ in found for name in own)
    return {
        "sensors": {name: sensors[name] for name in order},
        "numerical": {},
        "numerical_share": found[0][1],
        "numerical_enlarged": 1.0,
    }


def _noise_in(shot: Shot, ranking: Ranking) -> tuple[dict[str, dict[str, Any]], float]:
    """Of the sensors of one shot, and the numerical share of all of them."""
    whole = expected_residual(shot, ranking.problem, ranking.models[NONE], ranking.fits[NONE])[1] ** 2
    numerical = ranking.fits[NONE].system.numerical_variance(shot.name)
    sensors = {}
    for i, trace in enumerate(shot.record.traces):
        of = shot.record.channel == i
        sensors[trace.name] = {
            "unit": trace.unit,
            "source": trace.noise.source,
            "sigma": trace.noise.level,
            "correlation_time": trace.noise.correlation_time,
            "before_contact": {"sigma": trace.noise.before[0], "points": trace.noise.before[1]}
            if trace.noise.before
            else None,
            "points": len(trace.values),
            "averaged_over": trace.block,
            "numerical_share": float(np.sqrt(numerical[of].mean() / whole[of].mean())),
            "peak": trace.peak,
        }
    return sensors, float(np.sqrt(numerical.mean() / whole.mean()))


def simulation_counts(
    ranking: Ranking, simulations: Simulations, shot: Shot, runs: Mapping[str, SolverRun], chosen: str | None
) -> dict[str, Any]:
    """Simulations run and found stored, and by how much the solver leaves the fits, by channel, SI."""
    labels = {"before": NONE, "after": chosen}
    off = {
        label: rms_by_channel(shot, runs[key].curve - curve_at(ranking, label, shot))
        for state_name, label in labels.items()
        if label is not None and (key := f"{shot.name} {state_name}") in runs
    }
    campaign = sum(label.startswith("coarse ") for label in shot.setup.runs)
    counts = {"campaign": campaign, "paid": simulations.paid, "reused": simulations.reused}
    return {**counts, "emulator_error": off, "failed": dict(simulations.failures)}


def remainder_figures(ranking: Ranking) -> dict[str, Any] | None:
    """What something else has of the probability; None where that is little."""
    share = ranking.shares.get(SOMETHING_ELSE, 0.0)
    if share < TOLD:
        return None
    sentence = f"something that the library does not hold has a probability of {share:.2f}"
    return {"probability": share, "sentence": sentence}


def discrepancy_figures(ranking: Ranking, chosen: str | None) -> dict[str, Any]:
    """Amplitudes by kind of sensor, and when on the curve tells nothing because the model error has grown."""
    fit, known = ranking.fits[chosen or NONE], ranking.problem.known
    time = ranking.problem.shots[0].setup.time
    growth = {}
    for channel, shape in ranking.problem.shapes.items():
        late = np.flatnonzero(shape.growth > GROWN)
        since = float(time[late[0]]) if len(late) else None
        growth[channel] = {"largest": float(shape.growth.max()), "uninformative_from": since}
    amplitude = dict(fit.evidence.amplitudes)
    return {"source": known.source, "amplitude": amplitude, "fixed": dict(known.fixed), "growth": growth}


def pair_figures(ranking: Ranking) -> tuple[dict[str, Any], ...]:
    """Pairs of the credible set."""
    kept = [name for name in ranking.confidence_set if len(ranking.models[name].members) == 2]
    return tuple(
        {
            "effects": [one.label for one in ranking.models[name].members],
            "probability": ranking.shares[name],
            "p_consistent": consistency(
                ranking.evidence[name].log_evidence, max(one.log_evidence for one in ranking.evidence.values())
            ),
            "magnitudes": [
                one.magnitude(float(np.clip(h, *one.limits)))
                for one, h in zip(ranking.models[name].members, ranking.evidence[name].h, strict=True)
            ],
        }
        for name in kept
    )
