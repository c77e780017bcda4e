"""Every bird model calibrated to the same shots and ranked: what `birdstrike calibrate-models` does."""

from __future__ import annotations

import hashlib
import json
import warnings
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from birdstrike.data.arguments import as_list, as_names, refuse_other_kinds
from birdstrike.data.curves import Measured, as_measured, only_channels, refuse_twice, shot_names
from birdstrike.data.errors import CaseError, RunFailed, UserError, refuse_not_whole
from birdstrike.data.formatting import listing
from birdstrike.data.storage.files import json_values
from birdstrike.data.storage.out_folder import fills_out
from birdstrike.data.units import rounded
from birdstrike.doe.campaign.run import retry_before
from birdstrike.doe.designs.registry import refuse_seed
from birdstrike.doe.designs.uniform import LARGEST
from birdstrike.doe.external.deck import refuse_missing_in_deck
from birdstrike.doe.solvers import content_of, solver_for
from birdstrike.inversion import forward
from birdstrike.inversion.conditions import case_of_each
from birdstrike.inversion.models.campaigns import FitOptions, ModelRuns, ShotSetup, unlike_cases
from birdstrike.inversion.models.candidates import (
    Candidate,
    calibrated_case,
    candidate,
    candidates,
    literature_case,
    refuse_invalid_corners,
    refuse_other_parameters,
)
from birdstrike.inversion.models.joint_fit import ModelFit
from birdstrike.inversion.models.optimisers import refuse_unknown
from birdstrike.inversion.models.ranking import Ranked, misses, ranked
from birdstrike.inversion.models.results import (
    ANSWER,
    COMPARISON,
    ModelAnswer,
    ModelComparison,
    save_answer,
    save_comparison,
    saved_answer,
)
from birdstrike.inversion.models.simulations import LatePool
from birdstrike.inversion.models.warning_summary import summarised, warnings_of
from birdstrike.inversion.observations.expected import Expected
from birdstrike.inversion.observations.reader import read_record
from birdstrike.solver.bird.model_names import is_model
from birdstrike.solver.case.case import Case, CaseSource, as_case
from birdstrike.solver.version import code_of

USUAL = ("null", "elastic", "plastic_kinematic", "hydrodynamic", "murnaghan")
"""Models that are calibrated where none are named."""
FEWEST_RUNS = 8

Report = Callable[[str, float], None]
"""report(what is done, share of all the work, 0..1)."""


@fills_out("calibrate-models")
def calibrate_models(
    case: CaseSource | Sequence[CaseSource],
    measured: str | Path | Measured | Sequence[str | Path | Measured],
    out: str | Path,
    models: str | Sequence[str] = USUAL,
    runs: int = 20,
    seed: int = 0,
    workers: int | None = None,
    *,
    channels: str | Sequence[str] = (),
    posterior: bool = True,
    optimisers: str | Sequence[str] = (),
    budget: int = 160,
    retry_failed: bool = False,
    progress: Report = lambda *_: None,
) -> ModelComparison:
    """Calibrate bird models to the same records, verify each by the solver, and rank them by held-out error.

    Parameters
    ----------
    case : case or sequence of cases
        One for all records, or one for each.
    measured : record or sequence of records
        Measured-data CSV, a shipped name, or Measured; several shots are fitted jointly, one likelihood, and their
        order does not matter.
    out : path
        Folder for models.json and a folder a model; the same call resumes. Folders of models that are not named stay.
    models : str or sequence of str
        MODEL, MODEL+LAW, or LAW for null+LAW; models.json ranks these.
    runs : int
        Simulations of each campaign (a model and a shot), 8 to 2000; up to 15 more near the answer.
    seed : int
        Of designs, emulators, sampling and bootstrap.
    workers : int, optional
        Simulations at a time; all cores by default.
    channels : str or sequence of str
        Of the records that are used; all where none is named.
    posterior : bool
        Whether posteriors are drawn; else intervals are linearised.
    optimisers : str or sequence of str
        "least_squares", "cma": run beside it with the solver in the loop.
    budget : int
        Simulations of each shot that an optimiser may spend.
    retry_failed : bool
        Whether runs with a failure on record are tried again.
    progress : callable, optional
        Takes what is being done and the share of the work that is done, 0..1.

    Returns
    -------
    ModelComparison
        The content of models.json.

    Raises
    ------
    UserError
        For names, cases, records or channels that do not fit.
    RunFailed
        When no model has an answer.
    """
    folder = Path(out)
    chosen = [_named_as_before(one, folder) for one in candidates(as_names("models", models))]
    refuse_unknown(asked := as_names("optimisers", optimisers))
    refuse_not_whole("--budget", budget, "an optimiser spends at least one simulation of each shot")
    if budget < 1:
        raise UserError(f"--budget = {budget} is below 1: an optimiser spends at least one simulation of each shot")
    refuse_not_whole("--runs", runs, "20 is usual")
    refuse_seed(seed)
    if not FEWEST_RUNS <= runs <= LARGEST:
        raise UserError(
            f"--runs = {runs} is outside {FEWEST_RUNS} .. {LARGEST}: an emulator of several constants needs at least "
            f"{FEWEST_RUNS}, a uniform design has at most {LARGEST}; 20 is usual"
        )
    options = FitOptions(runs=runs, seed=seed, posterior=posterior, optimisers=asked, budget=budget)
    refuse_other_kinds(options)
    setups = _setups(as_list(case), as_list(measured), as_names("channels", channels))
    _refuse_what_does_not_fit(chosen, setups)
    retry = retry_before(retry_failed)
    with LatePool(workers) as pool:
        each: list[ModelRuns] = []
        for i, one in enumerate(chosen):
            share = _part_of(progress, one.name, i, len(chosen), len(setups))
            each.append(ModelRuns(one, setups, folder / one.name, options, pool, share, retry))
        progress("designs", 0.0)
        _refuse_invalid_runs(each)
        answers = {own.chosen.name: _answer(own) for own in each}
    found = _compared(answers, setups, options.seed)
    found = replace(found, warnings=(*_left_out(folder, chosen), *found.warnings))
    save_comparison(folder, found, [setup.measured for setup in setups])
    if not found.ranking:
        reasons = "; ".join(f"{name}: {one.failure}" for name, one in answers.items())
        raise RunFailed(f"no model has an answer: {reasons}", f"{folder / COMPARISON} has the reasons")
    return found


def _answer(runs: ModelRuns) -> ModelAnswer:
    """One model's answer: the one at hand where nothing has changed, else a new one; a failure is one too."""
    mark, kept = _fingerprint(runs), runs.folder / ANSWER
    if (known := saved_answer(kept, mark)) is not None and not runs.retry:
        return known
    runs.folder.mkdir(parents=True, exist_ok=True)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            answer = ModelFit(runs).answer()
    except RunFailed as failure:
        return ModelAnswer(runs.chosen.name, runs.chosen.source, failure=str(failure))
    save_answer(kept, answer, mark)
    return answer


def _calibrated_before(folder: Path) -> list[str]:
    """Names of the models whose answers the folder holds, as far as they are known here."""
    names = sorted(path.parent.name for path in folder.glob(f"*/{ANSWER}"))
    return [name for name in names if is_model(name)]


def _named_as_before(chosen: Candidate, folder: Path) -> Candidate:
    """The model by the name under which the folder holds it already, perhaps null+murnaghan for murnaghan."""
    held = _calibrated_before(folder)
    alike = [candidate(name) for name in held if chosen.name not in held and chosen.is_named(name)]
    seeks = (chosen.literature, chosen.ranges)
    return next((one for one in alike if (one.literature, one.ranges) == seeks), chosen)


def _left_out(folder: Path, chosen: Sequence[Candidate]) -> tuple[str, ...]:
    """A warning where the folder holds answers of models that this call does not name, and so does not rank."""
    named, held = [one.name for one in chosen], _calibrated_before(folder)
    others = [name for name in held if not any(one.is_named(name) for one in chosen)]
    if not others:
        return ()
    return (
        f"{listing(others)}: calibrated in this folder by an earlier call and not ranked here, since models.json "
        f"holds the models that --models names; their folders are kept. To rank all, repeat the command with --models "
        f"{','.join([*named, *others])}: answers to the same records and options are read, not calculated again",
    )


def _fingerprint(runs: ModelRuns) -> str:
    """Digest of all that changes a model's answer."""
    content = {
        "options": asdict(runs.options),
        "cases": [content_of(case, forward.simulate) for case in runs.cases],
        "records": [_digest(setup.measured) for setup in runs.setups],
        "names": [setup.name for setup in runs.setups],
        "published": runs.chosen.literature,
        "code": code_of("inversion"),
    }
    return hashlib.sha256(json.dumps(json_values(content), sort_keys=True, default=str).encode()).hexdigest()[:32]


def _digest(record: Measured) -> str:
    found = hashlib.sha256(record.time.tobytes())
    for source in (record.channels, record.sigma):
        for name, values in source.items():
            found.update(name.encode() + np.ascontiguousarray(values).tobytes())
    return found.hexdigest()[:32]


def _setups(cases: list[Any], records: list[Any], channels: Sequence[str]) -> tuple[ShotSetup, ...]:
    """Each record with its case and a name of its own, the slowest first whatever their order; raises UserError."""
    if not records:
        raise UserError("--measured is missing: give one measured-data CSV, or several, each with its --case")
    read = [as_measured(one) for one in records]
    loaded = case_of_each(read, [as_case(one) for one in cases])
    for record in read:
        record.refuse_dead_sensors()
    read = only_channels(read, channels)
    refuse_twice([("--measured", record) for record in read])
    shots = sorted(zip(loaded, read, strict=True), key=lambda shot: (shot[0].impact.speed, shot[1].path))
    names = shot_names([record for _, record in shots])
    return tuple(ShotSetup(name, *shot) for name, shot in zip(names, shots, strict=True))


def _refuse_other_deck(chosen: Candidate, own: Case, case: Case | None) -> None:
    """Raise CaseError where an external solver's deck cannot carry the model: another bird would be simulated."""
    if case is None or own.solver.name != "external":
        return
    try:
        refuse_missing_in_deck(own, case)
        solver_for(case)
    except CaseError as error:
        raise CaseError([f"--models {chosen.name}: {line}" for line in error.errors]) from error


def _refuse_what_does_not_fit(chosen: Sequence[Candidate], setups: Sequence[ShotSetup]) -> None:
    """Every case with every model and its record, before the first simulation; raises UserError with all that is
    wrong."""
    errors: list[str] = []
    for one in chosen:
        cases: list[Case] = []
        for setup in setups:
            try:
                cases.append(calibrated_case(one, setup.case))
                refuse_invalid_corners(one, cases[-1])
                for case in (cases[-1], literature_case(one, setup.case)):
                    _refuse_other_deck(one, setup.case, case)
            except (UserError, CaseError) as error:
                errors += error.errors
        try:
            refuse_other_parameters(one, cases)
        except UserError as error:
            errors += error.errors
    for setup in setups:
        lost = [name for name in setup.measured.channels if name not in setup.case.sensors]
        if lost:
            errors.append(
                f"{setup.measured.path}: the case {setup.case.name} has no sensor {', '.join(lost)}; it has "
                f"{', '.join(setup.case.sensors)}: rename the columns, add the sensors, or leave them out: --channels"
            )
            continue
        try:
            read_record(setup.measured, Expected.of_case(setup.case, setup.case.time.end))
        except UserError as error:
            errors += error.errors
    if errors:
        raise UserError(dict.fromkeys(errors))


def _refuse_invalid_runs(each: Sequence[ModelRuns]) -> None:
    """Every run of every design, before the first simulation; raises CaseError."""
    errors: list[str] = []
    for own in each:
        try:
            own.refuse_invalid_runs()
        except CaseError as error:
            errors += error.errors
    if errors:
        raise CaseError(errors)


def _compared(answers: dict[str, ModelAnswer], setups: Sequence[ShotSetup], seed: int) -> ModelComparison:
    """The ranking, and what it says in words."""
    found = ranked(answers, seed)
    by = "shot" if len(setups) > 1 else "time block"
    sentences = {shot: _of_shot(found, shot, order) for shot, order in found.per_shot.items()}
    speeds = {setup.name: setup.case.impact.speed for setup in setups}
    simulated = tuple(setup.name for setup in setups if setup.measured.simulated)
    own = warnings_of(found.answers, found.ranking)
    return ModelComparison(
        models=found.answers,
        ranking=found.ranking,
        per_shot=found.per_shot,
        tied=found.tied,
        tied_per_shot=found.tied_per_shot,
        records={setup.name: setup.measured.path for setup in setups},
        speeds=speeds,
        simulated=bool(simulated),
        simulated_shots=simulated,
        heldout_by=by,
        sentence=_sentence(found.answers, found.ranking, found.tied, by) if found.ranking else "no model has an answer",
        per_shot_sentences=sentences,
        seed=seed,
        measured=next((one.measured for one in found.answers.values() if one.failure is None), {}),
        warnings=(*_missed(found), *unlike_cases(setups), *summarised(own)),
    )


def _of_shot(found: Ranked, shot: str, order: Sequence[str]) -> str:
    """What the ranking of one shot says."""
    errors = {name: found.answers[name].heldout[shot] for name in order}
    return _verdict(errors, order, found.tied_per_shot[shot], found.answers[order[0]].heldout_95[shot])


def _missed(found: Ranked) -> tuple[str, ...]:
    """A warning where even the first model misses what it was not calibrated to."""
    if not found.ranking or not misses(interval := found.answers[found.ranking[0]].expected_95):
        return ()
    first = found.answers[found.ranking[0]]
    error, low, high = (rounded(one, 3) for one in (first.expected or 0.0, *(interval or (0.0, 0.0))))
    return (
        f"even the best model ({first.name}) leaves {error} times the noise in what it was not calibrated to (95 %: "
        f"{low} .. {high}; the true model leaves 1, and 1.4 where the simulation errs by as much as the record): the "
        "ranking says which has the least error, not which is right, and the constants compensate for what is wrong; "
        "look for what else differs (birdstrike diagnose), use a finer mesh and more particles, and check the stated "
        "noise",
    )


def _sentence(answers: dict[str, ModelAnswer] | Any, ranking: Sequence[str], tied: Sequence[str], by: str) -> str:
    errors = {name: answers[name].expected or 0.0 for name in ranking}
    what = "shots" if by == "shot" else "thirds of the record"
    found = _verdict(errors, ranking, tied, answers[ranking[0]].expected_95)
    return f"Predicting {what} that a model was not calibrated to: {found}"


def _verdict(
    errors: dict[str, float],
    ranking: Sequence[str],
    tied: Sequence[str],
    first_95: tuple[float, float] | None,
) -> str:
    """ "murnaghan predicts best (error 1.3 times the noise); next null (2.4)", or who shares the first place.

    first_95: interval of the first one's error; beyond the noise the sentence says that even it misses.
    """
    first, missed = ranking[0], misses(first_95)
    even = "; even the best is off by more than noise and a numerical error as large account for" if missed else ""
    if len(ranking) == 1:
        error = f"held-out error {rounded(errors[first], 3)} times the noise"
        return f"{first} alone was ranked ({error}); name others: --models{even}"
    if tied:
        shown = ", ".join(f"{name} ({rounded(errors[name], 3)})" for name in tied)
        return f"{shown} share the first place: the records cannot tell them apart (held-out error over noise){even}"
    after = f"next {ranking[1]} ({rounded(errors[ranking[1]], 3)})"
    best = "has the least error" if missed else "predicts best"
    return f"{first} {best} (held-out error {rounded(errors[first], 3)} times the noise); {after}{even}"


def _part_of(report: Report, name: str, model: int, models: int, shots: int) -> Report:
    """Progress of one model: its campaigns take most of its share, then runs near the answer, then the fit."""
    done: dict[str, float] = {}

    def part(stage: str, share: float) -> None:
        done[stage] = share
        own = {key: value for key, value in done.items() if key not in ("fit", "runs near the answer")}
        whole = 0.7 * sum(own.values()) / shots
        whole += 0.2 * (1.0 if "fit" in done else done.get("runs near the answer", 0.0)) + 0.1 * done.get("fit", 0.0)
        report(f"{name}: {stage}", (model + whole) / models)

    return part
