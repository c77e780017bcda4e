"""`birdstrike diagnose`: from cases and records to a verdict, an effect's name, the error before and after.

The records of a diagnosis, each with its case: shots, baselines, the held-out one; and all that makes them unfit.

Everything here is known before a simulation is paid for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from numbers import Real
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from birdstrike.data.arguments import as_list, as_names, as_options, as_path, refuse_other_kinds
from birdstrike.data.curves import Measured, as_measured, only_channels, refuse_twice, shot_names
from birdstrike.data.errors import CaseError, MeasuredError, UserError
from birdstrike.data.formatting import quantity
from birdstrike.data.progress import Progress
from birdstrike.data.storage.out_folder import fills_out
from birdstrike.doe.campaign.run import retry_before
from birdstrike.doe.campaign.simulations import Simulations
from birdstrike.doe.designs.registry import refuse_seed
from birdstrike.inversion.conditions import case_of_each, parts_of_one_shot, same_structure
from birdstrike.inversion.diagnosis.conclusions.baseline import left_out, read_baselines, unfit
from birdstrike.inversion.diagnosis.conclusions.solver_update import NearFits, with_runs
from birdstrike.inversion.diagnosis.inference.hypotheses import AUTO, birds_apart
from birdstrike.inversion.diagnosis.pipeline import DiagnosisOptions, Pipeline
from birdstrike.inversion.diagnosis.preparation.plan import make_plan
from birdstrike.inversion.diagnosis.preparation.setup import Setup, make_setup, simulate_plan, unpredictable
from birdstrike.inversion.diagnosis.preparation.shots import read_shot, unpredicted
from birdstrike.inversion.estimation.refinement import AUTO_RUNS, PAYS, refuse_budget
from birdstrike.inversion.observations.expected import Expected
from birdstrike.inversion.observations.reader import read_record
from birdstrike.inversion.results.diagnosis import Diagnosis
from birdstrike.inversion.results.diagnosis_files import baseline_file, case_files, write
from birdstrike.solver.case.case import Case, CaseSource, Parameter, as_case, case_hash

RecordLike = str | Path | Measured

SHORTEST = 0.25  # of the simulated time: a record that ends earlier is refused


@dataclass(frozen=True)
class NamedRecord:
    """A record, its name (`shot_names`), and the case that it is a shot of."""

    name: str
    case: Case
    record: Measured


def described(shots: Sequence[NamedRecord], others: Sequence[Measured] = ()) -> dict[str, Any]:
    """`record` of diagnosis.json: path of the first, names of all, and which of them no instrument took.

    others: baselines and the held-out record; `files` are the paths of all, `digests` the SHA-256 of their content.
    """
    every = [*(shot.record for shot in shots), *others]
    simulated = [one.name for one in shots if one.record.simulated]
    return {
        "path": str(shots[0].record.path),
        "simulated": bool(simulated),
        "shots": [one.name for one in shots],
        "simulated_shots": simulated,
        "files": [str(one.path) for one in every],
        "digests": [one.digest for one in every],
    }


@dataclass(frozen=True)
class Records:
    """What a diagnosis is made of; warnings: sentences on baselines that cannot serve and on files of one
    shot."""

    shots: list[NamedRecord]
    clean: list[NamedRecord]
    heldout: Measured | None
    warnings: tuple[str, ...]


def read_records(
    case: CaseSource | Sequence[CaseSource],
    measured: RecordLike | Sequence[RecordLike],
    heldout: RecordLike | None = None,
    baseline: RecordLike | Sequence[RecordLike] = (),
    baseline_case: CaseSource | Sequence[CaseSource] = (),
    channels: str | Sequence[str] = (),
) -> Records:
    """All records of a diagnosis, see `diagnose`; raises UserError for what does not fit, before any simulation."""
    named = named_records(case, measured)
    kept = only_channels([one.record for one in named], channels)
    shots = [replace(one, record=record) for one, record in zip(named, kept, strict=True)]
    other = None if heldout is None else as_measured(heldout)
    refuse(shots, other)
    other = None if other is None else other.only(tuple(shots[0].record.channels))
    clean, warnings = clean_shots(shots, as_list(baseline), as_list(baseline_case))
    refuse_twice(
        [
            *(("--measured", one.record) for one in shots),
            *(("--baseline", one.record) for one in clean),
            *([] if other is None else [("--heldout", other)]),
        ]
    )
    parts = parts_of_one_shot([one.record for one in shots], [one.case for one in shots])
    return Records(shots, clean, other, (*parts, *warnings))


def named_records(
    case: CaseSource | Sequence[CaseSource], measured: RecordLike | Sequence[RecordLike]
) -> list[NamedRecord]:
    """Every record with its case; raises UserError when their numbers do not fit."""
    shots, cases = as_list(measured), as_list(case)
    if not shots or not cases:
        raise UserError(f"{'the case' if shots else '--measured'} is missing: give one, or one for each shot")
    return matched([as_case(one) for one in cases], [as_measured(one) for one in shots])


def matched(cases: Sequence[Case], records: Sequence[Measured]) -> list[NamedRecord]:
    """Records with their cases and names; raises UserError when their numbers do not fit."""
    return [NamedRecord(*one) for one in zip(shot_names(records), case_of_each(records, cases), records, strict=True)]


def refuse(shots: Sequence[NamedRecord], heldout: Measured | None) -> None:
    """Raise UserError for every case of another rig and every record that does not fit its case, all at once.

    Before anything is simulated. heldout: of the first case, with the channels of the first record alone.
    """
    first = shots[0]
    rigs = [error for one in shots[1:] for error in apart(one.case, first.case)]
    if errors := [*rigs, *_other_discrepancies([one.case for one in shots])]:
        raise CaseError(errors)
    records = [(one.record, one.case) for one in shots]
    if heldout is not None:
        channels = [n for n in first.record.channels if n in heldout.channels]
        records += [(heldout.only(channels), first.case)] if channels else []
        errors = [
            f'{heldout.path}: channel "{n}" is missing; it must have the channels of the first record'
            for n in first.record.channels
            if n not in channels
        ]
    errors = [*(error for one in records for error in unusable(*one)), *errors]
    if errors:
        raise MeasuredError(errors)


def apart(case: Case, first: Case) -> list[str]:
    """Why two cases cannot be calibrated together: another rig, clock or sensor, or parameters sought elsewhere."""
    if not same_structure(case, first):
        return [
            f"case {case.name} has another plate or target (or mesh of it) than case {first.name}: shots that are "
            "diagnosed together are of one rig; extend one file for all and change [impact] and [bird] alone, or "
            "diagnose each rig by itself"
        ]
    if differ := [*other_clock(case, first), *other_kinds(case, first)]:
        return differ
    if case.parameters() == first.parameters():
        return []
    own, theirs = ({one.name: one for one in each.parameters()} for each in (case, first))
    differ = [name for name in {**theirs, **own} if own.get(name) != theirs.get(name)]
    if not differ:
        return [f"case {case.name} names its inversion.parameters in another order than case {first.name}"]
    return [
        f'inversion.parameters."{name}" is {sought(own.get(name))} in case {case.name} and {sought(theirs.get(name))} '
        f"in case {first.name}: shots share their parameters, with their ranges and priors; state them alike in both"
        for name in differ
    ]


def _other_discrepancies(cases: Sequence[Case]) -> Iterator[str]:
    """Where cases state different model errors of one sensor; what one of them alone states holds for all."""
    said: dict[str, tuple[float, str]] = {}
    for case in cases:
        for sensor, share in case.inversion.discrepancy.items():
            other, name = said.setdefault(sensor, (share, case.name))
            if share != other:
                yield (
                    f"inversion.discrepancy.{sensor} = {100 * share:g} % in case {case.name} and {100 * other:g} % in "
                    f"case {name}: shots share the model's error; state it alike in all, or in one of them"
                )


def other_clock(case: Case, first: Case) -> list[str]:
    """Where two cases differ in the instants that are simulated: model error is known at the same ones in all shots."""
    alike = "shots that are diagnosed together are simulated at the same instants; state [time] alike in all, with the "
    return [
        f"time.{key} = {quantity(getattr(case.time, key), 's')} in case {case.name} and "
        f"{quantity(getattr(first.time, key), 's')} in case {first.name}: {alike}longest end (a record may end earlier)"
        for key in ("end", "output_interval")
        if getattr(case.time, key) != getattr(first.time, key)
    ]


def other_kinds(case: Case, first: Case) -> list[str]:
    """Sensors of two cases that share a name and no kind: one name is one channel in the answer."""
    kinds = {name: (one.kind, first.sensors[name].kind) for name, one in case.sensors.items() if name in first.sensors}
    return [
        f"sensors.{name} is of kind {own} in case {case.name} and {theirs} in case {first.name}: a name stands for one "
        "kind of sensor in shots that are diagnosed together; rename it in one case, and in its record"
        for name, (own, theirs) in kinds.items()
        if own != theirs
    ]


def sought(one: Parameter | None) -> str:
    """How a case seeks a parameter, in words."""
    return "not sought" if one is None else one.words


def unusable(record: Measured, case: Case) -> list[str]:
    """Why a record cannot be compared with its case."""
    end = float(record.time[-1])
    if end < SHORTEST * case.time.end:
        ends = f"{record.path}: ends at {1e3 * end:.3g} ms, the simulation at {1e3 * case.time.end:.3g} ms"
        return [f"{ends}; shorten time.end, or use the whole record"]
    try:
        read_record(record, Expected.of_case(case, case.time.end))
    except MeasuredError as error:
        return list(error.errors)
    return []


def clean_shots(
    shots: Sequence[NamedRecord], baseline: Sequence[RecordLike], baseline_case: Sequence[CaseSource]
) -> tuple[list[NamedRecord], tuple[str, ...]]:
    """The baselines that can serve, a warning for each of the others; raises UserError for a file that is not there.

    The case's own baselines are taken where none is given.
    """
    first = shots[0].case
    given: Sequence[RecordLike] = baseline or first.diagnosis.baselines
    if baseline_case and len(baseline_case) != len(given):
        counts = f"{len(given)} baselines and {len(baseline_case)} of their cases"
        raise UserError(f"{counts}: give a --baseline-case for each --baseline in order, or none at all")
    cases = [as_case(one) for one in baseline_case] or [first] * len(given)
    warnings: list[str] = []
    readable: list[tuple[Case, Measured]] = []
    for own, one in zip(cases, given, strict=True):
        try:
            readable.append((own, as_measured(one)))
        except MeasuredError as error:
            warnings.append(left_out(f"baseline {one}", "; ".join(error.errors)))
    named = matched([own for own, _ in readable], [record for _, record in readable]) if readable else []
    found = []
    for one in named:
        if reason := unfit(one.record, one.case, first, channels_of(shots)) or "; ".join(apart(one.case, first)):
            warnings.append(left_out(f"baseline {one.name}", reason))
        else:
            found.append(one)
    return found, tuple(warnings)


def baseline_names(shots: Sequence[NamedRecord], clean: Sequence[NamedRecord]) -> list[str]:
    """What the baselines are called beside the shots, of which one may come from a file `baseline clean.csv`."""
    taken = {one.name for one in shots}
    found: list[str] = []
    for one in clean:
        name = f"baseline {one.name}"
        while name in taken:
            name += "_"
        taken.add(name)
        found.append(name)
    return found


def channels_of(shots: Sequence[NamedRecord]) -> tuple[str, ...]:
    """Channels of all measured records, those of the first before the others."""
    return tuple(dict.fromkeys(channel for one in shots for channel in one.record.channels))


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
