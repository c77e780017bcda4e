"""`birdstrike diagnose`: from cases and records to a verdict, an effect's name, the error before and after."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from numbers import Real
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from birdstrike.data.arguments import as_names, as_options, as_path, refuse_other_kinds
from birdstrike.data.curves import Measured
from birdstrike.data.errors import MeasuredError, UserError
from birdstrike.data.progress import Progress
from birdstrike.data.storage.out_folder import fills_out
from birdstrike.doe.campaign.run import retry_before
from birdstrike.doe.campaign.simulations import Simulations
from birdstrike.doe.designs.registry import refuse_seed
from birdstrike.inversion.diagnosis.conclusions.baseline import read_baselines
from birdstrike.inversion.diagnosis.conclusions.solver_update import NearFits, with_runs
from birdstrike.inversion.diagnosis.inference.bird_scatter import AUTO, birds_apart
from birdstrike.inversion.diagnosis.pipeline import DiagnosisOptions, Pipeline
from birdstrike.inversion.diagnosis.preparation.plan import make_plan
from birdstrike.inversion.diagnosis.preparation.setup import Setup, make_setup, simulate_plan, unpredictable
from birdstrike.inversion.diagnosis.preparation.shots import read_shot, unpredicted
from birdstrike.inversion.diagnosis.records import (
    NamedRecord,
    RecordLike,
    baseline_names,
    channels_of,
    described,
    read_records,
)
from birdstrike.inversion.estimation.refinement import AUTO_RUNS, PAYS, refuse_budget
from birdstrike.inversion.results.diagnosis import Diagnosis
from birdstrike.inversion.results.diagnosis_files import baseline_file, case_files, write
from birdstrike.solver.case.case import Case, CaseSource, case_hash

REFINED_AT_ONCE = 5  # runs, before the emulator is fitted anew


@fills_out("diagnose")
def diagnose(
    case: CaseSource | Sequence[CaseSource],
    measured: RecordLike | Sequence[RecordLike],
    out: str | Path,
    doe: str | Path | None = None,
    heldout: RecordLike | None = None,
    options: DiagnosisOptions | None = None,
    retry_failed: bool = False,
    baseline: RecordLike | Sequence[RecordLike] = (),
    baseline_case: CaseSource | Sequence[CaseSource] = (),
    channels: str | Sequence[str] = (),
    baseline_bird: str | None = None,
) -> Diagnosis:
    """Diagnose a record, or several shots of one rig; write `diagnosis.json`, curves and the case with the effect.

    Parameters
    ----------
    case, measured : case and record, or sequences of them
        A case for every record in order; a single case serves all.
    out : path
        Folder; simulations stay in `out/runs`, so that the same call resumes.
    doe : path, optional
        Folder of a finished campaign of the case, whose runs are used where they fit.
    heldout : record, optional
        Another record of the first case, which nothing is fitted to.
    options : DiagnosisOptions, optional
        How to diagnose.
    retry_failed : bool
        Whether runs with a failure on record are tried again.
    baseline, baseline_case : record and case, or sequences of them
        Shots of the rig in which nothing is suspected (none: those that the first case names in
        `diagnosis.baselines`); a case for each in order, or none at all: they are of the first case.
    channels : str or sequence of str
        Channels of the records that are used, of each those that it has, all where none is named; of baselines and
        `heldout` the same.
    baseline_bird : {'auto', 'same', 'recipe', 'other'}, optional
        What is known of the birds of all shots, baselines included: of one batch, cast and shot alike; of one recipe;
        unlike; `auto`: nothing, the records decide. By default the first case's `diagnosis.baseline_bird`.

    Raises
    ------
    UserError, RunFailed
        The input cannot be used; the simulations failed. A baseline that cannot serve is left out with a warning.
    """
    choice = as_options("options", options, DiagnosisOptions)
    folder, used = as_path("out", out), as_names("channels", channels)
    choice = replace(choice, retry=retry_before(True)) if retry_failed else choice
    refuse_choices(choice)
    records = read_records(case, measured, heldout, baseline, baseline_case, used)
    shots, clean, other = records.shots, records.clean, records.heldout
    choice = replace(choice, baseline_bird=stated_bird(choice, shots[0].case, baseline_bird))
    further = () if doe is None else (runs_of(as_path("doe", doe)),)
    folder.mkdir(parents=True, exist_ok=True)
    with (
        choice.counter() as shown,
        Simulations(folder / "runs", further, choice.workers, shown, choice.retry) as simulations,
    ):
        setups = all_setups(shots, clean, simulations, choice)
        shots, lost = predicted_shots(shots, setups)
        compared, left_out = predicted_heldout(other, records.shots[0], shots)

        def prepared(setups: Mapping[str, Setup]) -> Pipeline:
            own = tuple(read_shot(one.name, setups[case_hash(one.case)], one.record) for one in shots)
            names = baseline_names(shots, clean)
            beside = {name: (one.record, setups[case_hash(one.case)]) for name, one in zip(names, clean, strict=True)}
            seen = tuple(dict.fromkeys(channel for shot in own for channel in shot.channels))
            return Pipeline(
                own, read_baselines(beside, seen), choice, simulations, (*lost, *left_out, *records.warnings)
            )

        with choice.display("Runs near the fits") as progress:
            pipeline, refinement = refined(setups, prepared, simulations, choice, progress)
        held = None if compared is None else read_shot("held out", pipeline.shots[0].setup, compared)
        found = pipeline.diagnosis(refinement, held)
    cases = dict(zip(case_files([one.name for one in shots]), (one.case for one in shots), strict=True))
    cases |= {baseline_file(one.name): one.case for one in clean}
    others = [*(one.record for one in clean), *([] if other is None else [other])]
    repeats = asked(choice, clean, other, used)
    return write(replace(found, record=described(shots, others), options=repeats), folder, cases)


def asked(
    choice: DiagnosisOptions, clean: Sequence[NamedRecord], heldout: Measured | None, channels: Sequence[str]
) -> dict[str, Any]:
    """`options` of diagnosis.json: what repeats it beside alpha, and the cases and records of its shots.

    seed, refine, baseline_bird, channels; baselines: name -> path; heldout: path, or null; python: the choices that no
    option of the command sets, where they are not the usual ones.
    """
    usual, chosen = DiagnosisOptions().choices(), choice.choices()
    own = ("seed", "refine", "baseline_bird")
    return {
        **{name: chosen[name] for name in own},
        "channels": list(channels),
        "baselines": {one.name: str(one.record.path) for one in clean},
        "heldout": None if heldout is None else str(heldout.path),
        "python": {n: v for n, v in chosen.items() if n not in (*own, "alpha") and v != usual[n]},
    }


def refuse_choices(choice: DiagnosisOptions) -> None:
    """Raise UserError for a choice that no diagnosis can be made with."""
    refuse_budget(choice.refine)
    refuse_alpha(choice.alpha)
    refuse_seed(choice.seed)
    refuse_other_kinds(choice)


def refuse_alpha(alpha: float) -> None:
    """Raise UserError for a rate of false alarms that is none."""
    if not isinstance(alpha, Real) or not 0.0 < alpha < 0.5:
        raise UserError(f"--alpha = {alpha} is not above 0 and below 0.5; 0.05 is usual")


def runs_of(campaign: Path) -> Path:
    """Folder of a campaign's runs; raises UserError where there are none."""
    if not (campaign / "runs").is_dir():
        raise UserError(
            f"--doe {campaign} holds no runs; give the folder of a finished run-doe or diagnose, or leave it out"
        )
    return campaign / "runs"


def stated_bird(choice: DiagnosisOptions, first: Case, given: str | None) -> str:
    """The bird of the baselines as given, else by the options, else by the first case; raises UserError."""
    bird = given or (choice.baseline_bird if choice.baseline_bird != AUTO else first.diagnosis.baseline_bird)
    birds_apart(bird)
    return bird


def all_setups(
    shots: Sequence[NamedRecord], clean: Sequence[NamedRecord], simulations: Simulations, choice: DiagnosisOptions
) -> dict[str, Setup]:
    """Setups by the case's hash, one for each different case, with the measured channels.

    Magnitudes are counted in the plausible sizes of the first shot's case in all of them.
    """
    cases = {case_hash(one.case): one.case for one in (*shots, *clean)}
    plans = {key: make_plan(case, choice.runs, choice.seed, shots[0].case) for key, case in cases.items()}
    runs = {key: simulate_plan(plan, simulations) for key, plan in plans.items()}
    measured = channels_of(shots)
    moved = unpredictable([(plans[key], runs[key]) for key in plans], measured)
    found: dict[str, Setup] = {}
    for key, case in cases.items():
        channels = [channel for channel in measured if channel in case.sensors]
        with choice.display(f"Emulator of {case.name}") as progress:
            found[key] = make_setup(plans[key], channels, runs[key], moved, progress)
    return found


def refined(
    setups: Mapping[str, Setup],
    prepared: Callable[[Mapping[str, Setup]], Pipeline],
    simulations: Simulations,
    choice: DiagnosisOptions,
    progress: Progress,
) -> tuple[Pipeline, dict[str, Any]]:
    """The diagnosis with runs added near the fits, at most `choice.refine` of each case, and what they did.

    Until the emulator adds less than a fifth to the variance of every parameter's interval, of the baselines and of the
    shots that a fit without an effect explains; what it leaves then is the runs' own scatter and the mesh. `refine` 0
    adds none and only says what the emulator adds.
    """
    budget = AUTO_RUNS if isinstance(choice.refine, str) else choice.refine
    added, shares, reason = 0, list[float](), ""
    while not reason:
        with threadpool_limits(limits=1, user_api="blas"):
            pipeline = prepared(setups)
            near = NearFits.of(pipeline.problem)
        share = near.share
        shares.append(share)
        progress(1.0 if share < PAYS else added / max(budget, 1))
        if not near.shots:
            reason = "no fit without an effect explains the records: runs near it would not help"
        elif share < PAYS:
            reason = f"the emulator adds {100 * share:.0f} % to an interval's variance"
        elif added >= budget:
            still = f"the emulator still adds {100 * share:.0f} % to an interval's variance"
            reason = f"all {budget} runs were used, and {still}" if budget else still
        else:
            count = min(REFINED_AT_ONCE, budget - added)
            again = {
                key: with_runs(setup, pipeline.problem, near, count, choice.seed, simulations)
                for key, setup in setups.items()
            }
            if all(again[key] is setup for key, setup in setups.items()):
                reason = "no run near the fits finished"
            setups, added = again, added + count
    return pipeline, {"added": added, "added_variance": shares, "reason": reason}


def predicted_shots(
    shots: Sequence[NamedRecord], setups: Mapping[str, Setup]
) -> tuple[list[NamedRecord], tuple[str, ...]]:
    """The shots of which a sensor can be predicted, and a warning for each of the others; raises MeasuredError."""
    found: list[NamedRecord] = []
    lost: list[str] = []
    for one in shots:
        setup = setups[case_hash(one.case)]
        if set(one.record.channels) & set(setup.channels):
            found.append(one)
        else:
            lost.append(f"{one.name} is left out: {unpredicted(setup, one.record.channels)}")
    if not found:
        raise MeasuredError(lost)
    return found, tuple(lost)


def predicted_heldout(
    heldout: Measured | None, first: NamedRecord, shots: Sequence[NamedRecord]
) -> tuple[Measured | None, tuple[str, ...]]:
    """The held-out record, unless the first shot is left out, whose case and channels it has; and a warning then."""
    if heldout is None or any(one is first for one in shots):
        return heldout, ()
    return None, (
        f"the held-out record {heldout.path} is left out as {first.name} is, whose case and channels it has; nothing "
        "is judged by it",
    )
