"""The records of a diagnosis, each with its case: shots, baselines, the held-out one; and all that makes them unfit.

Everything here is known before a simulation is paid for.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from birdstrike.data.arguments import as_list
from birdstrike.data.curves import Measured, as_measured, only_channels, refuse_twice, shot_names
from birdstrike.data.errors import CaseError, MeasuredError, UserError
from birdstrike.data.formatting import quantity
from birdstrike.inversion.conditions import case_of_each, parts_of_one_shot, same_structure
from birdstrike.inversion.diagnosis.conclusions.baseline import left_out, unfit
from birdstrike.inversion.observations.expected import Expected
from birdstrike.inversion.observations.reader import read_record
from birdstrike.solver.case.case import Case, CaseSource, Parameter, as_case

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
