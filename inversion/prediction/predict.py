"""`birdstrike predict`: what was learnt from one shot carried to another case, with bands and where they come from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from birdstrike.data.arguments import as_names, as_options, as_path, refuse_other_kinds
from birdstrike.data.errors import UnitError, UserError, refuse_not_whole
from birdstrike.data.progress import Progress, silent
from birdstrike.data.storage.files import withdraw
from birdstrike.data.storage.out_folder import fills_out, model_of
from birdstrike.data.units import to_si
from birdstrike.doe.campaign.run import retry_before
from birdstrike.doe.campaign.simulations import Counter, Simulations, uncounted
from birdstrike.doe.designs.registry import refuse_seed
from birdstrike.inversion.labels import in_words
from birdstrike.inversion.prediction.answer import (
    AveragedExplanation,
    Band,
    Limit,
    Prediction,
    exceeded,
    quantiles_of,
    settled,
    share_of,
)
from birdstrike.inversion.prediction.budget import narrowing, shares
from birdstrike.inversion.prediction.campaign import run_campaign, used_meshes
from birdstrike.inversion.prediction.carry_over import (
    Carried,
    carried_effects,
    drawn_instead,
    refuse_another_bird,
    refuse_other_sensors,
)
from birdstrike.inversion.prediction.curves import DRAWS, SensorDraws, Setting, sensor_draws
from birdstrike.inversion.prediction.distance import distance
from birdstrike.inversion.prediction.learnt import Learnt
from birdstrike.inversion.prediction.reading import read_learnt
from birdstrike.inversion.prediction.sample import FEWEST, affordable, draw, shares_of, tolerances_of
from birdstrike.solver.case.case import Case, CaseSource, as_case
from birdstrike.solver.case.write import copy_case
from birdstrike.solver.target.section import can_fail

BUDGET = 40
LEAST_BUDGET = 8
NEVER_TEARS = 10.0  # failure strain of a plate whose case states none
LARGE = 0.05  # share of the simulations


@dataclass(frozen=True)
class PredictOptions:
    """How to predict.

    limits: sensor -> text such as "8 mm"; tolerances: dotted key -> one standard deviation, such as "1 m/s"; budget:
    simulations of the new case; leave_behind: effects that are not carried over; only: labels of the explanations that
    are used, all where none is named.
    """

    limits: Mapping[str, str] | None = None
    tolerances: Mapping[str, str] | None = None
    budget: int = BUDGET
    seed: int = 0
    workers: int | None = None
    leave_behind: str | Sequence[str] = ()
    only: str | Sequence[str] = ()
    retry_failed: bool = False
    counter: Counter = uncounted
    progress: Progress = silent


@fills_out("predict")
def predict(case: CaseSource, learnt: str | Path, out: str | Path, options: PredictOptions | None = None) -> Prediction:
    """Predict the readings of another shot from what a results folder holds; write prediction.json and prediction.csv.

    Parameters
    ----------
    case : path, table or Case
        The new shot: speed, thickness, structure, sensors. It is simulated on the mesh that it declares; after
        `diagnose` on the coarser mesh of a diagnosis, with its correction.
    learnt : path
        Folder of train-and-invert, diagnose, calibrate-models or close-the-loop.
    out : path
        Folder; simulations stay in `out/runs`, so that the same call resumes.
    options : PredictOptions, optional
        Limits, tolerances, budget, seed.

    Returns
    -------
    Prediction
        Bands, largest readings, probabilities of exceeding the limits, where the width comes from; SI.

    Raises
    ------
    UserError
        For a folder without results, sensors that were not learnt, an effect that the case cannot carry, limits or
        tolerances with wrong units.
    RunFailed
        When too few simulations of the new case finish.
    """
    choice = _normalised(as_options("options", options, PredictOptions))
    folder, new = as_path("out", out), as_case(case)
    known = affordable(_only(read_learnt(as_path("learnt", learnt)), choice.only), choice.budget)
    limits = _limits(new, choice.limits or {})
    warnings = [*known.warnings, *refuse_other_sensors(known, new), *drawn_instead(known, new)]
    setting, simulated = prepared(new, known, folder, choice)
    found = _assembled(setting, new, limits, simulated, warnings)
    withdraw(folder, "prediction.json", "prediction.html")
    copy_case(new, folder)
    found.save(folder)
    return found


def _normalised(choice: PredictOptions) -> PredictOptions:
    """The options with names as sequences of names; raises UserError for values of another kind."""
    refuse_seed(choice.seed)
    refuse_not_whole("--budget", choice.budget, f"{BUDGET} is usual")
    refuse_other_kinds(choice)
    left = as_names("leave_behind", choice.leave_behind)
    return replace(choice, leave_behind=left, only=as_names("only", choice.only))


def prepared(new: Case, known: Learnt, folder: Path, choice: PredictOptions) -> tuple[Setting, dict[str, int]]:
    """The simulations of the new case with what it takes to draw from them, and how many were paid and reused.

    Raises UserError for a budget, case, tolerance or effect that cannot be predicted with, RunFailed for too few runs.
    """
    if not LEAST_BUDGET <= choice.budget <= DRAWS:
        raise UserError(f"--budget = {choice.budget} is outside {LEAST_BUDGET} .. {DRAWS}; {BUDGET} is usual")
    refuse_another_bird(known, new)
    carried = carried_effects(known, new, as_names("leave_behind", choice.leave_behind))
    tolerances = tolerances_of(new, choice.tolerances or {}, known)
    counts = shares_of(known.explanations, choice.budget, FEWEST)
    points = draw(known, carried, tolerances, counts, choice.seed)
    folder.mkdir(parents=True, exist_ok=True)
    retry = retry_before(choice.retry_failed)
    with ExitStack() as bar:
        shown = bar.enter_context(choice.counter())
        with Simulations(folder / "runs", (known.folder / "runs",), choice.workers, shown, retry) as simulations:
            campaign = run_campaign(known, new, points, simulations, choice.progress, choice.seed, bar.close)
            counted = {"paid": simulations.paid, "reused": simulations.reused}
    return Setting(known, carried, tolerances, campaign, distance(known, new), choice.seed), counted


def _alone(learnt: Learnt, label: str) -> str:
    """How a bird model that is left out as improbable is predicted with all the same; "" for any other label."""
    if model_of(place := learnt.folder / label) is None:
        return ""
    return f" (less probable bird models are left out); {label} alone: --from {place}"


def _only(learnt: Learnt, labels: str | Sequence[str]) -> Learnt:
    """What was learnt, of some explanations alone; raises UserError for an unknown one."""
    if not (labels := as_names("only", labels)):
        return learnt
    known = {one.label: one for one in learnt.explanations}
    unknown = [label for label in labels if label not in known]
    if unknown:
        raise UserError(
            f"--only {label}: no explanation; {learnt.folder} holds {', '.join(known)}{_alone(learnt, label)}"
            for label in unknown
        )
    shares = np.array([known[label].probability for label in labels])
    shares = shares / shares.sum() if shares.any() else np.full(len(labels), 1.0 / len(labels))
    kept = tuple(replace(known[label], probability=float(p)) for label, p in zip(labels, shares, strict=True))
    return replace(learnt, explanations=kept)


def _limits(case: Case, given: Mapping[str, str]) -> dict[str, float]:
    """SI limits by sensor; raises UserError with every one that is wrong."""
    found, errors = dict[str, float](), list[str]()
    for name, text in given.items():
        if name not in case.sensors:
            errors.append(f"--limit {name}: {case.name} has no such sensor; it has {', '.join(case.sensors)}")
            continue
        try:
            found[name] = to_si(text, case.sensors[name].unit)
        except UnitError as error:
            errors.append(f'--limit {name}="{text}": {error}')
            continue
        if found[name] == 0.0:
            errors.append(f'--limit {name}="{text}": a limit of 0 is passed by every shot; state a largest reading')
    if errors:
        raise UserError(errors)
    return found


def _assembled(
    setting: Setting, new: Case, limits: Mapping[str, float], simulated: Mapping[str, int], warnings: list[str]
) -> Prediction:
    """All draws, then the figures."""
    learnt, campaign, where = setting.learnt, setting.campaign, setting.where
    counts = shares_of(learnt.explanations, DRAWS)
    sample = draw(learnt, setting.carried, setting.tolerances, counts, setting.seed + 1)
    draws = {name: sensor_draws(setting, name, sample) for name in new.sensors}
    tops = {name: one.tops(one.values) for name, one in draws.items()}
    first = next(iter(limits), next(iter(draws)))
    weights = campaign.points.weights
    torn, torn_interval = share_of(campaign.torn, float(1.0 / (weights**2).sum()), weights)
    return Prediction(
        case=new.name,
        source=f"{learnt.source}: {learnt.folder}",
        extrapolation=where.sentences,
        reach=where.reaches,
        correlation=where.correlation,
        growth=where.growth,
        limits={name: _limit(draws[name], value) for name, value in limits.items()},
        peaks={name: {**quantiles_of(tops[name]), "unit": one.unit} for name, one in draws.items()},
        residual={
            name: {**quantiles_of(settled(one.values)), "unit": one.unit}
            for name, one in draws.items()
            if one.kind == "displacement"
        },
        perforation={
            "probability": torn,
            "interval_95": torn_interval,
            "simulations": len(campaign.torn),
            "modelled": bool(campaign.torn.any()) or tears(new),
        },
        sources={name: shares(one) for name, one in draws.items()},
        narrowing=narrowing(draws, learnt, list(setting.held), first),
        explanations=tuple(_averaged(learnt, setting.carried)),
        posterior=learnt.posterior,
        tolerances={k: {"value": t.value, "sigma": t.sigma, "unit": t.unit} for k, t in setting.tolerances.items()},
        campaign={
            **campaign.counts,
            **simulated,
            "method": {name: "emulator" if one.emulated else "draws" for name, one in draws.items()},
            "q2": {name: campaign.q2(name) for name in draws},
            "failed": dict(campaign.failures),
        },
        seed=setting.seed,
        warnings=(*_warnings(setting, new), *warnings, *campaign.warnings),
        bands={name: Band(one.unit, one.kind, one.time, quantiles_of(one.values)) for name, one in draws.items()},
        draws=tops,
    )


def _limit(draws: SensorDraws, value: float) -> Limit:
    probability, interval = share_of(exceeded(draws.values, value), draws.distinct)
    return Limit(value, draws.unit, probability, interval)


def tears(case: Case) -> bool:
    """Whether the case lets its structure tear; another solver's runs do not tell."""
    if case.solver.name == "external":
        return False
    if case.target is not None:
        used = {part.material for part in case.target.parts.values()}
        rows = [law.row() for name, law in case.target.materials.items() if name in used and law.moves]
        return any(can_fail(row) for row in rows)
    return not case.plate.rigid and case.plate.material.failure_strain < NEVER_TEARS


def _averaged(learnt: Learnt, carried: Mapping[str, Carried]) -> list[AveragedExplanation]:
    return [
        AveragedExplanation(one.label, one.probability, {label: carried[label].how for label in one.members})
        for one in learnt.explanations
    ]


def _warnings(setting: Setting, new: Case) -> list[str]:
    """What the user must know of the campaign."""
    campaign, learnt, found = setting.campaign, setting.learnt, list[str]()
    lost = campaign.counts["asked"] - campaign.counts["finished"]
    if lost > LARGE * campaign.counts["asked"]:
        reason = next(iter(campaign.failures.values()), "")
        found.append(
            f"{lost} of {campaign.counts['asked']} simulations of the new case failed ({reason}); the bands rest on "
            "the others, which may be the gentler ones"
        )
    found += [
        f"no simulation of {in_words(one.label)} (probability {one.probability:.2g}) finished: its effect is not in "
        "the bands; raise --budget or --leave-behind the effect"
        for i, one in enumerate(learnt.explanations)
        if i not in campaign.points.explanation
    ]
    if learnt.corrected and campaign.counts["finer"] < 2:
        found.append(
            "the learnt models stand for a finer mesh, whose simulations of the new case failed: the bands are those "
            "of the campaign's mesh and may be off by what a finer one changes; run the command again with "
            "--retry-failed"
        )
    found += other_mesh(learnt, new)
    if campaign.torn.any():
        found.append(
            "the plate tears in some of the simulations: curves of torn plates are not smooth in the parameters, so "
            "that the simulated draws themselves make the bands"
        )
    return found


def other_mesh(learnt: Learnt, new: Case) -> list[str]:
    """A warning where the new case is simulated on other meshes than those that the learnt parameters belong to."""
    pairs = zip(used_meshes(learnt, learnt.case), used_meshes(learnt, new), strict=True)
    if not any(_other_mesh(there, here) for there, here in pairs if there is not None and here is not None):
        return []
    remedy = "give it the same number of particles and elements of the same size"
    if learnt.corrected:
        return [
            f"the new case is simulated on another mesh, coarse or fine, than those of {learnt.source}: the error that "
            f"their fine mesh left is in what was learnt, and that of the new one may be another; {remedy}"
        ]
    return [
        "the new case has another mesh than the one that the bird was calibrated on, whose error its parameters hold: "
        f"{remedy}"
    ]


def _other_mesh(learnt: Case, new: Case) -> bool:
    """Whether particles or shells are of another size, by more than a tenth."""
    if learnt.target is not None or new.target is not None or "external" in (learnt.solver.name, new.solver.name):
        return False
    birds = [(one.bird.volume / one.bird.particles) ** (1.0 / 3.0) for one in (learnt, new)]
    shells = [one.plate.length / one.plate.elements[0] for one in (learnt, new)]
    return any(abs(np.log(pair[1] / pair[0])) > np.log(1.1) for pair in (birds, shells))
