"""A campaign's folder: whose it is, and what stands in it while the campaign runs.

case.toml (the resolved case, with deck/ where an external solver needs it),
case.json (its SI values and hash), design.csv, runs/, summary.json, curves.csv.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import re
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import CaseError, UserError
from birdstrike.data.formatting import many, span
from birdstrike.data.histories import Array
from birdstrike.data.storage.files import file_digest, read_json, write_atomically, write_json
from birdstrike.doe.designs.design import Design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.solver.case.case import Case, case_hash, load_case
from birdstrike.solver.case.write import copy_case

DAY = 86400.0
"""[s] No save takes that long: a younger file may belong to a campaign that runs beside this one."""

_TEMPORARY = re.compile(r"\.[0-9a-f]{32}\.(h5|failed\.json)\.\d+-[0-9a-f]{8}\.tmp")
"""Names that data.storage.files.whole_file gives to the files of data.storage.store.RunStore while they are written."""

RANGE_DIGITS = 6
"""Of the ends of a parameter's range, which a user wrote."""

_REPAIR = (
    "put the original back, or delete it and repeat the command that made the campaign (of an extended one all of "
    "them, in their order): what stands in runs/ is not simulated again"
)
_ALTERED = (
    "has been edited since the campaign wrote it (its digest is not that in summary.json), so that parameters and "
    f"curves need not belong together; {_REPAIR}"
)

_OTHER_CASE = (
    "or a file that it names, is not what the campaign was run for any more: {differences}; put the original back, or "
    "repeat the command that made the campaign: what stands in runs/ is not simulated again"
)


@dataclass(frozen=True)
class CampaignFolder:
    """Paths of a campaign."""

    path: Path

    @property
    def runs(self) -> Path:
        """The run store."""
        return self.path / "runs"

    @property
    def summary(self) -> Path:
        """State, design quality and the fate of every run."""
        return self.path / "summary.json"

    @property
    def design(self) -> Path:
        """`run`, then the parameters in SI."""
        return self.path / "design.csv"

    @property
    def curves(self) -> Path:
        """`run`, `time_s`, then the channels in SI; only when the campaign, or the one it extends, has finished."""
        return self.path / "curves.csv"

    def claim(self, case: Case, design: Design) -> None:
        """Make the folder this campaign's, or extend the one in it to a longer design that begins with the same rows.

        UserError when it holds another, of which nothing is then touched; one that was stopped before its first run is
        none.
        """
        if self._begun:
            self._refuse_other_case(case)
            self._refuse_other_design(design)
        self.runs.mkdir(parents=True, exist_ok=True)
        remove_leftovers(self.runs)
        copy_case(case, self.path)
        identity = {"name": case.name, "case_hash": case_hash(case), "case": case.canonical()}
        write_json(self.path / "case.json", identity)
        write_atomically(self.design, design_text(design))

    @property
    def _begun(self) -> bool:
        """Whether its simulations have begun, before which summary.json is written, or runs lie there."""
        kept = self.runs.iterdir() if self.runs.is_dir() else ()
        return self.summary.exists() or any(not _TEMPORARY.fullmatch(path.name) for path in kept)

    def read_summary(self) -> dict[str, Any]:
        """Content of summary.json, empty where there is none."""
        return read_json(self.summary)

    def every_row(self) -> tuple[NDArray[np.int64], Array]:
        """Run numbers (n,) and SI values (n, k) of design.csv; raises UserError where it is no table of numbers."""
        return design_rows(self.design, self.design.read_text(encoding="utf-8").splitlines())

    def altered(self) -> list[str]:
        """One line for each of design.csv and curves.csv that is no longer what summary.json vouches for by its digest.

        And one for case.toml, its mesh or deck included, where it is no longer the case of case.json. Rows beyond those
        that the summary counts were planned by a call that was stopped; a summary of an older version holds no digest
        of the curves.
        """
        curves = self.read_summary().get("curves", {})
        found = [f"{self.design} {_ALTERED}"] if self._design_was_edited() else []
        if "digest" in curves and self.curves.exists() and file_digest(self.curves) != curves["digest"]:
            found.append(f"{self.curves} {_ALTERED}")
        if differences := self._changes_of_case():
            found.append(f"{self.path / 'case.toml'}, {_OTHER_CASE.format(differences=differences)}")
        return found

    def _design_was_edited(self) -> bool:
        """Whether the rows of design.csv that summary.json counts are not those whose digest it holds."""
        design = self.read_summary().get("design", {})
        if "digest" not in design or not self.design.exists():
            return False
        rows = self.design.read_text(encoding="utf-8").splitlines()[: design["runs"] + 1]
        return rows_digest(rows) != design["digest"]

    def _changes_of_case(self) -> str:
        """In what case.toml differs from case.json; empty where it does not, or where either cannot be read."""
        held = read_json(self.path / "case.json")
        with suppress(UserError):
            case = stored_case(self.path)
            if held and held["case_hash"] != case_hash(case):
                return _differences(held["case"], case.canonical())
        return ""

    def other_sources(self, case: Case) -> str:
        """Which things of installed packages have other sources than the campaign in the folder had; empty for none."""
        held = read_json(self.path / "case.json")
        there, here = held.get("case", {}).get("sources", {}), case.sources_from_outside()
        return ", ".join(f"the {name}" for name in sorted(here) if held and there.get(name) != here[name])

    def _refuse_other_case(self, case: Case) -> None:
        if other := refusal_of_other_case(read_json(self.path / "case.json"), case):
            raise UserError(
                f"{self.path} holds {other}; choose another --out, or repeat the first case to resume",
            )

    def _refuse_other_design(self, design: Design) -> None:
        if not self.design.exists():
            return
        held_text, text, held = self.design.read_text(encoding="utf-8"), design_text(design), self.read_summary()
        if text == held_text or extends(design, text, held_text, held):
            return
        if self._design_was_edited():
            raise UserError(f"{self.design} {_ALTERED}")
        old = held.get("design")
        runs = old["runs"] if old else len(held_text.splitlines()) - 1
        words = _words(old["kind"], runs, old["seed"], old["source"]) if old else "another design"
        asked = _words(design.kind, len(design.numbers), design.seed, design.source)
        raise UserError(
            f"{self.path} holds a campaign with {words}, not with {asked} over these ranges; "
            f"{remedy(design, runs, held)}"
        )


def campaign_within(folder: Path) -> str:
    """Where the campaign of a loop's folder lies, as the end of a sentence; empty where there is none."""
    inner = folder / "doe"
    return f"; its campaign is {inner}" if (inner / "design.csv").exists() and (inner / "case.toml").exists() else ""


def stored_case(folder: Path) -> Case:
    """The case in a folder of results, `case.toml`; raises CaseError with that file's path and all its errors."""
    path = folder / "case.toml"
    try:
        return load_case(path)
    except CaseError as error:
        raise CaseError(error.errors, f"{path}: {many(len(error.errors), 'error')}") from error


def refusal_of_other_case(held: Mapping[str, Any], case: Case) -> str:
    """In what a campaign's case.json differs from a case; empty where it does not, or where there is none."""
    if not held or held["case_hash"] == case_hash(case):
        return ""
    return (
        f"a campaign of the case {held['name']} (hash {held['case_hash']}), not of {case.name} "
        f"(hash {case_hash(case)}): {_differences(held['case'], case.canonical())}"
    )


def extends(design: Design, text: str, held_text: str, held: Mapping[str, Any]) -> bool:
    """Whether the held rows are the first of `text`, bit for bit, in a design of the same kind, seed and ranges.

    text, held_text: design.csv as asked and as held; held: the folder's summary.json, which is written after it: rows
    beyond those it counts were planned by a call that was stopped there. Where it is missing nothing vouches for the
    ranges, and the answer is no.
    """
    if not held or not _same_family(design, held["design"]) or held["space"] != space_json(design.space):
        return False
    vouched = "".join(held_text.splitlines(keepends=True)[: held["design"]["runs"] + 1])
    return text.startswith(vouched)


def remedy(design: Design, held_runs: int, held: Mapping[str, Any]) -> str:
    """What to do about a design that neither resumes nor extends the held one of `held_runs` runs."""
    again = "choose another --out, or repeat the first options to resume"
    if not held or not _same_family(design, held["design"]):
        return again
    if len(design.numbers) < held_runs:
        return f"a campaign cannot be shortened: {again}"
    if held["space"] != space_json(design.space):
        other = other_ranges(held["space"], design.space) or (
            "inversion.parameters differ in their order, or in the last digits of their ranges"
        )
        return f"{other}: {again}"
    return f"rows may only be appended to the first {held_runs}, which differ: {again}"


def _same_family(design: Design, held: Mapping[str, Any]) -> bool:
    return (design.kind, design.seed) == (held["kind"], held["seed"])


def remove_leftovers(runs: Path) -> None:
    """Delete the store's own temporary files older than a day; what cannot be deleted stays."""
    oldest = time.time() - DAY
    for path in runs.iterdir():
        if _TEMPORARY.fullmatch(path.name):
            with suppress(OSError):
                if path.lstat().st_mtime < oldest:
                    path.unlink()


def design_text(design: Design) -> str:
    """`design.csv`: run numbers and SI values, every bit of them; a key with a comma (of a material) is quoted."""
    rows = ([str(n), *(repr(float(v)) for v in row)] for n, row in zip(design.numbers, design.values, strict=True))
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([["run", *design.names], *rows])
    return text.getvalue()


def design_rows(path: Path, rows: Sequence[str]) -> tuple[NDArray[np.int64], Array]:
    """Run numbers (n,) and SI values (n, k) from the lines of `design.csv` at `path`, its header the first.

    Raises UserError where they are no table of numbers.
    """
    columns = len(next(csv.reader(rows[:1]), ()))
    table = []
    for i, row in enumerate(rows[1:], 2):
        try:
            table.append([float(cell) for cell in row.split(",")])
        except ValueError as error:
            raise UserError(f"{path}, line {i}: {row} is no row of numbers; {_REPAIR}") from error
        if len(table[-1]) != columns:
            raise UserError(f"{path}, line {i} has {many(len(table[-1]), 'cell')}, its header {columns}; {_REPAIR}")
    if not table:
        raise UserError(f"{path} holds no runs; {_REPAIR}")
    numbers, values = np.hsplit(np.array(table), [1])
    return numbers[:, 0].astype(np.int64), values


def rows_digest(rows: Sequence[str]) -> str:
    """What vouches for the rows of `design.csv`, its header the first: SHA-256 of their text."""
    return hashlib.sha256("\n".join(rows).encode()).hexdigest()


def space_json(space: ParameterSpace) -> dict[str, list[Any]]:
    """The ranges as summary.json has them."""
    return {
        "names": list(space.names),
        "units": list(space.units),
        "lows": space.lows.tolist(),
        "highs": space.highs.tolist(),
        "scales": ["logarithmic" if logarithmic else "linear" for logarithmic in space.logarithmic],
    }


def other_ranges(held: Mapping[str, Sequence[Any]], space: ParameterSpace) -> str:
    """In what the ranges of a campaign's summary differ from those of a case; empty where they do not.

    The order of the parameters is none of it, nor what rounding makes of a range's ends.
    """
    there, here = _ranges(held), _ranges(space_json(space))
    if there == here:
        return ""
    varied = [f"{name} {text}" for name, text in there.items() if here.get(name) != text]
    sought = [f"{name} {text}" for name, text in here.items() if there.get(name) != text]
    return (
        f"inversion.parameters differ: the campaign varied {', '.join(varied) or 'fewer of them'}, the case seeks "
        f"{', '.join(sought) or 'fewer of them'}"
    )


def _ranges(space: Mapping[str, Sequence[Any]]) -> dict[str, str]:
    """Parameter -> its range in words."""
    scales = space.get("scales") or ["linear"] * len(space["names"])  # older summaries hold none
    columns = zip(space["names"], space["units"], space["lows"], space["highs"], scales, strict=True)
    return {
        name: span(low, high, unit, RANGE_DIGITS) + ("" if scale == "linear" else " (logarithmic)")
        for name, unit, low, high, scale in columns
    }


def _words(kind: str, runs: int, seed: int | None, source: str | None) -> str:
    if kind == "file":
        return f"the design of {source} ({runs} runs)"
    return f"the {kind} design of {runs} runs and seed {seed}"


def _differences(there: Mapping[str, Any], here: Mapping[str, Any], most: int = 3) -> str:
    """The first few dotted keys in which two canonical cases differ."""
    old, new = flat(there), flat(here)
    changed = [key for key in dict.fromkeys([*old, *new]) if old.get(key) != new.get(key)]
    keys = [key for key in changed if not key.startswith("sources.")]
    shown = [_difference(key, old.get(key), new.get(key)) for key in keys[:most]]
    more = [f"{len(keys) - most} more"] if len(keys) > most else []
    return ", ".join(shown + more)


def _difference(key: str, there: Any, here: Any) -> str:
    """A key's two values in words; of a mesh from a file a case holds the digest of its content."""
    if key == "target.mesh" and there and here:
        return f"the mesh that target.mesh names has another content (digest {there} there, {here} here)"
    return f"{key} is {there} there and {here} here (SI)"


def flat(tree: Mapping[str, Any], place: str = "") -> dict[str, Any]:
    """A canonical case's values under dotted keys."""
    found: dict[str, Any] = {}
    for key, value in json.loads(json.dumps(tree)).items():
        found |= flat(value, f"{place}{key}.") if isinstance(value, dict) else {f"{place}{key}": value}
    return found
