"""The files of a diagnosis's folder: what they are called, how they are written, and how an earlier one's go."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import pandas as pd

from birdstrike.data.columns import read_own_table
from birdstrike.data.curves import LONGEST
from birdstrike.data.errors import UserError
from birdstrike.data.storage.files import withdraw, write_atomically
from birdstrike.data.storage.tree import save_tree
from birdstrike.inversion.results.diagnosis import AGAIN, ATTRIBUTED, RESULT, Diagnosis
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.write import case_toml, copy_case, portable_table

CASE = "case.toml"
"""As declared, of the first shot."""
MODEL = "model.npz"
"""What `explore` and `predict` read: responses, records and fits."""
COLUMNS = ("measured", "sigma", "error", "baseline", "before", "after", "before_solver", "after_solver")


def write(found: Diagnosis, folder: Path, declared: Mapping[str, Case] | None = None) -> Diagnosis:
    """Write all files, diagnosis.json last; returns the diagnosis with the name of its case file.

    declared: names of files -> cases of shots and baselines. What an earlier diagnosis left there goes first, but for
    the declared cases, of which one may be what the user gave: those that this one has not go last.
    """
    made, given = _of_earlier(folder)
    withdraw(folder, RESULT, MODEL)
    for name in made:
        (folder / name).unlink(missing_ok=True)
    for name, case in (declared or {}).items():
        copy_case(case, folder, name, "" if name == CASE else f"{Path(name).stem}/")
    if found.case is not None and found.after is not None:
        model = found.after.model.replace(".", "_").replace("@", "_of_")
        path = folder / f"{found.case.name[:LONGEST]}_with_{model}.toml"
        write_atomically(path, case_text(found, found.case))
        found = replace(found, case_after=path.name)
    for name, channels in zip(curve_files(list(found.curves)), found.curves.values(), strict=True):
        write_curves(folder / name, channels)
    if found.model:
        save_tree(folder / MODEL, found.model)
    found.save(folder / RESULT)
    for name in given - _declared(found):
        (folder / name).unlink(missing_ok=True)
    return found


def remove(folder: Path) -> None:
    """Remove what a diagnosis wrote into its folder, its simulations apart."""
    made, given = _of_earlier(folder)
    for name in (RESULT, MODEL, *made, *given):
        (folder / name).unlink(missing_ok=True)


def _of_earlier(folder: Path) -> tuple[set[str], set[str]]:
    """Names of the curves and the case after that a diagnosis made in a folder, and of the cases that it was given.

    None of either where the folder holds no diagnosis that can be read.
    """
    try:
        earlier = Diagnosis.read(folder / RESULT)
    except UserError:
        return set(), set()
    curves = curve_files([one.name for one in earlier.shots])
    return {*curves, *([earlier.case_after] if earlier.case_after else [])}, _declared(earlier)


def _declared(found: Diagnosis) -> set[str]:
    """Names of the cases that a diagnosis was given."""
    clean = (found.baseline or {}).get("shots", [])
    return {*case_files([one.name for one in found.shots]), *map(baseline_file, clean)}


def baseline_file(name: str) -> str:
    """Name of the file of a baseline's case."""
    return f"baseline_{name}.toml"


def curve_files(shots: Sequence[str]) -> list[str]:
    """Names of the files of curves: of the first shot diagnosis.csv."""
    return [f"diagnosis_{shot}.csv" if i else "diagnosis.csv" for i, shot in enumerate(shots)]


def case_files(shots: Sequence[str]) -> list[str]:
    """Names of the files of the cases as declared: of the first shot case.toml."""
    return [f"diagnosis_{shot}.toml" if i else CASE for i, shot in enumerate(shots)]


def write_curves(path: Path, channels: Mapping[str, Mapping[str, object]]) -> None:
    """Record, errors and models of one shot, channel below channel."""
    tables = [
        pd.DataFrame({"channel": channel, "time_s": one["time"], **{key: one[key] for key in COLUMNS}})
        for channel, one in channels.items()
    ]
    write_atomically(path, pd.concat(tables).to_csv(index=False, float_format="%.9e", lineterminator="\n"))


def read_curves(path: Path) -> pd.DataFrame:
    """The curves of one shot as `write_curves` wrote them; raises UserError for a damaged file."""
    return read_own_table(path, ("time_s", *COLUMNS), AGAIN, texts=("channel",))


def case_text(found: Diagnosis, case: Case) -> str:
    """TOML of the case after, headed by what it is; the files that it names are those beside the folder's case.toml."""
    head = [f"{found.sentence}."]
    if found.verdict != ATTRIBUTED:
        model = found.after.model if found.after else ""
        head.append(f"This case has {model} in it, the likeliest; it is not attributed.")
    head.append("The calibrated parameters are the refitted ones; the effect stands under [effects] or [instrument].")
    return "".join(f"# {line}\n" for line in head) + case_toml(case, portable_table(case))
