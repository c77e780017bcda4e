"""`birdstrike diagnose`: from cases and records to a verdict, an effect's name, the error before and after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd

from birdstrike.data.curves import Measured, read_measured
from birdstrike.data.errors import MeasuredError, UserError
from birdstrike.data.files import write_atomically
from birdstrike.data.paths import resolve_measured
from birdstrike.solver.case.write import case_toml
from birdstrike.inversion.diagnosis.answer import ATTRIBUTED, Answer
from birdstrike.inversion.diagnosis.pipeline import Options
from birdstrike.inversion.diagnosis.pipeline import Pipeline, read_baselines
from birdstrike.inversion.diagnosis.plan import make_plan
from birdstrike.inversion.diagnosis.setup import Setup, make_setup, simulate_plan
from birdstrike.inversion.diagnosis.shots import Shot, read_shot
from birdstrike.inversion.diagnosis.simulations import Strikes
from birdstrike.solver.case.case import Case, case_hash, load_case

One = str | Path
Record = str | Path | Measured
COLUMNS = ("measured", "sigma", "error", "before", "after", "before_solver", "after_solver")
SHORTEST = 0.25  # of the simulated time: a record that ends earlier is refused


@dataclass(frozen=True)
class Pair:
    """A measured record and the case that it is a shot of."""

    name: str
    case: Case
    record: Measured


def diagnose(
    case: One | Case | Sequence[One | Case],
    measured: Record | Sequence[Record],
    out: str | Path,
    doe: str | Path | None = None,
    heldout: Record | None = None,
    options: Options | None = None,
    baseline: Sequence[Record] = (),
    baseline_case: Sequence[One | Case] = (),
) -> Answer:
    """Diagnose one record, or several shots of one rig, and write `diagnosis.json`, curves and the case with the effect.

    Parameters
    ----------
    case, measured : one of each, or a case for every record (a single case serves all).
    out : folder; simulations stay in `out/runs`, so that the same call resumes.
    doe : folder of a finished campaign of the case, whose runs are used where they fit.
    heldout : another record of the first case, which nothing is fitted to.
    baseline, baseline_case : shots of the rig in which nothing is suspected; a case for each, or none at all.

    Raises
    ------
    UserError, RunFailed
        The input cannot be used; the simulations failed.
    """
    choice, folder = options or Options(), Path(out)
    if not 0.0 < choice.alpha < 0.5:
        raise UserError(f"--alpha = {choice.alpha} is outside 0 .. 0.5; 0.05 is usual")
    shots = paired(case, measured)
    clean = paired(list(baseline_case) or [shots[0].case], list(baseline)) if baseline else []
    other = None if heldout is None else read(heldout)
    refuse(shots, other)
    folder.mkdir(parents=True, exist_ok=True)
    further = () if doe is None else (Path(doe) / "runs",)
    with choice.counter() as shown, Strikes(folder / "runs", further, choice.workers, shown) as strikes:
        setups = all_setups([*shots, *clean], shots[0], strikes, choice)
        read_shots = tuple(read_shot(one.name, setups[case_hash(one.case)], one.record, "shots") for one in shots)
        by_name = {Path(one.record.path).stem: setups[case_hash(one.case)] for one in clean if case_hash(one.case) in setups}
        baselines = read_baselines(read_shots[0].setup, [one.record for one in clean], read_shots[0], by_name)
        held: Shot | None = None
        if other is not None:
            held = read_shot("held out", read_shots[0].setup, other, "shots")
        found = Pipeline(read_shots, baselines, choice, strikes).answer(held)
    simulated = any(one.record.simulated for one in shots)
    record = {"path": str(shots[0].record.path), "simulated": simulated, "shots": [one.name for one in shots]}
    return write(replace(found, record=record), folder)


def paired(case: Any, measured: Any) -> list[Pair]:
    """Every record with its case; raises UserError when their numbers do not fit."""
    records = [read(one) for one in (measured if isinstance(measured, list | tuple) else [measured])]
    given = list(case) if isinstance(case, list | tuple) else [case]
    cases = [load_case(one) if isinstance(one, str | Path) else one for one in given]
    if len(cases) == 1:
        cases = cases * len(records)
    if len(cases) != len(records):
        raise UserError(f"{len(records)} records and {len(cases)} cases: give one case, or one for each record in order")
    names = [Path(one.path).stem or f"shot{i + 1}" for i, one in enumerate(records)]
    unique = [name if names.count(name) == 1 else f"{name}_{i + 1}" for i, name in enumerate(names)]
    return [Pair(name, own, record) for name, own, record in zip(unique, cases, records, strict=True)]


def read(measured: Record) -> Measured:
    """A record from its file or as it is."""
    return measured if isinstance(measured, Measured) else read_measured(resolve_measured(measured))


def refuse(shots: Sequence[Pair], heldout: Measured | None) -> None:
    """Raise MeasuredError for channels that a case lacks and for records too short, before anything is simulated."""
    errors: list[str] = []
    for one in shots:
        known = ", ".join(one.case.sensors)
        errors += [
            f'{one.record.path}: channel "{n}" is no sensor of case {one.case.name}; its sensors: {known}'
            for n in one.record.channels
            if n not in one.case.sensors
        ]
        if float(one.record.time[-1]) < SHORTEST * one.case.time.end:
            errors.append(
                f"{one.record.path}: ends at {1e3 * float(one.record.time[-1]):.3g} ms, the simulation at "
                f"{1e3 * one.case.time.end:.3g} ms; shorten time.end, or use the whole record"
            )
    if heldout is not None:
        errors += [f'{heldout.path}: channel "{n}" is missing' for n in shots[0].record.channels if n not in heldout.channels]
    if errors:
        raise MeasuredError(errors)


def all_setups(pairs: Sequence[Pair], first: Pair, strikes: Strikes, choice: Options) -> dict[str, Setup]:
    """Setups by the case's hash, one for each different case, with the sensors of the first record."""
    found: dict[str, Setup] = {}
    for one in pairs:
        key = case_hash(one.case)
        if key in found:
            continue
        channels = [c for c in first.record.channels if c in one.case.sensors]
        plan = make_plan(one.case, choice.runs, choice.seed)
        with choice.display(f"Simulations and emulator of {one.case.name}") as progress:
            found[key] = make_setup(plan, channels, simulate_plan(plan, strikes), progress)
    return found


def write(found: Answer, folder: Path) -> Answer:
    """Write all files, diagnosis.json last; returns the answer with the name of its case file."""
    if found.case is not None and found.after is not None:
        path = folder / f"{found.case.name}_with_{found.after.model.replace('.', '_').replace('@', '_of_')}.toml"
        write_atomically(path, case_text(found, found.case))
        found = replace(found, case_after=path.name)
    for i, (shot, channels) in enumerate(found.curves.items()):
        name = "diagnosis.csv" if i == 0 else f"diagnosis_{shot}.csv"
        tables = [
            pd.DataFrame({"channel": c, "time_s": one["time"], **{key: one[key] for key in COLUMNS}})
            for c, one in channels.items()
        ]
        text = pd.concat(tables).to_csv(index=False, float_format="%.9e", lineterminator="\n")
        write_atomically(folder / name, text)
    found.save(folder / "diagnosis.json")
    return found


def case_text(found: Answer, case: Case) -> str:
    """TOML of the case after, headed by what it is."""
    head = [found.sentence]
    if found.verdict != ATTRIBUTED:
        head.append(f"This case has {found.after.model if found.after else ''} in it, the likeliest; it is not attributed.")
    head.append("The calibrated parameters are the refitted ones.")
    return "".join(f"# {line}\n" for line in head) + case_toml(case)


__all__ = ["Options", "diagnose"]
