"""Whether a diagnosis is of the record and case of an inversion beside it, by what their files say.

Records are compared by the digests of their files' content, those of earlier versions, which hold none, by their names.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

from birdstrike.data.errors import UserError
from birdstrike.data.storage.files import read_json
from birdstrike.inversion.results.diagnosis_files import RESULT, case_files
from birdstrike.solver.case.case import case_hash, load_case


class _File(NamedTuple):
    """A record's file; digest: SHA-256 of its content; both "" where not known."""

    path: str
    digest: str

    @property
    def name(self) -> str:
        return Path(self.path).name

    def differs(self, other: _File) -> bool:
        """Whether the two are known not to be one record."""
        if self.digest and other.digest:
            return self.digest != other.digest
        return bool(self.name and other.name) and self.name != other.name


def shot_difference(inversion: Path, diagnosis: Path) -> str:
    """In which way no shot of a diagnosis is the first one of an inversion, a sentence; "" where none is known.

    Of a diagnosis of several shots one must be of the inversion's record, and its case that of the inversion; baselines
    and the held-out record do not count. What cannot be read differs in nothing: its reader will say so.
    """
    answer, diagnosed = _content(inversion / "inversion.json"), _content(diagnosis / RESULT)
    own, names = _inverted(answer), list(diagnosed.get("record", {}).get("shots", []))
    shots = _shots(diagnosed, len(names))
    number = next((i for i, one in enumerate(shots) if not own.differs(one)), None)
    if number is None and shots and len(shots) == len(names):
        return f"the diagnosis in {diagnosis} {_other_record(own, shots)} in {inversion}"
    files = case_files(names or [""])
    wanted, found = (
        answer.get("case_hash"),
        [_hash(diagnosis / one) for one in (files if number is None else [files[number]])],
    )
    if wanted and all(found) and wanted not in found:
        return (
            f"the diagnosis in {diagnosis} is of another case (hash {', '.join(found)}) than the inversion in "
            f"{inversion} (hash {wanted})"
        )
    return ""


def refuse_two_shots(loop: Path) -> None:
    """Raise UserError for a loop's folder whose diagnosis and inversion are not of one shot, both named."""
    inversion, diagnosis = loop / "inversion", loop / "diagnosis"
    both = (inversion / "inversion.json").is_file() and (diagnosis / RESULT).is_file()
    if both and (differs := shot_difference(inversion, diagnosis)):
        raise UserError(f"{differs}; name the one that is meant: {inversion}, or {diagnosis}")


def _inverted(answer: dict[str, Any]) -> _File:
    """The first record of an inversion."""
    first = [*answer.get("shots", []), answer.get("measured", {})][0]
    return _File(str(first.get("path", "")), str(first.get("digest", "")))


def _shots(diagnosed: dict[str, Any], count: int) -> list[_File]:
    """The records of a diagnosis's shots; an earlier version names the first one's file alone."""
    record = diagnosed.get("record", {})
    files = record.get("files", [record.get("path", "")])[:count]
    digests = record.get("digests", [])[: len(files)]
    return [_File(str(path), str(digest)) for path, digest in zip_longest(files, digests, fillvalue="")]


def _other_record(own: _File, shots: Sequence[_File]) -> str:
    if own.name in [one.name for one in shots]:
        return f"read {own.name} when it had another content than for the inversion"
    return f"is of {', '.join(one.name for one in shots)}, not of {own.name}, the record of the inversion"


def _hash(case: Path) -> str:
    """The hash of a case, "" where it cannot be read."""
    with suppress(OSError, UserError):
        return case_hash(load_case(case))
    return ""


def _content(path: Path) -> dict[str, Any]:
    """A JSON object, {} where it cannot be read."""
    with suppress(OSError, UserError):
        return read_json(path)
    return {}
