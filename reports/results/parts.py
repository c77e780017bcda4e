"""Parts of a report: which folder holds the campaign, the inversion and the diagnosis, and what is not there."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from birdstrike.data.errors import UserError
from birdstrike.data.storage.out_folder import maker_of, model_of
from birdstrike.inversion.results.same_shot import shot_difference

CAMPAIGN_FILES = ("case.toml", "design.csv", "curves.csv", "summary.json")
INVERSION_FILES = ("inversion.json", "verification.csv")
DIAGNOSIS_FILES = ("diagnosis.json", "diagnosis.csv")
SHOWN = ("run-doe", "train-and-invert", "diagnose", "close-the-loop", "start")
"""Commands whose folders a report can be made of."""


@dataclass(frozen=True)
class Parts:
    """Folders of a report's parts, None for a part that does not exist; folder: the one that was named.

    missing: a sentence about each part that is not there, with the command that makes it; other_diagnosis: one about a
    diagnosis that is there, but of another record or case than the inversion, and is left out for that.
    """

    folder: Path
    doe: Path | None = None
    inversion: Path | None = None
    diagnosis: Path | None = None
    missing: tuple[str, ...] = ()
    other_diagnosis: str = ""


def find_parts(
    folder: Path, doe: Path | None = None, diagnosis: Path | None = None, makers: Sequence[str] = SHOWN
) -> Parts:
    """Parts in a loop's folder, or of a campaign's, an inversion's or a diagnosis' own folder; raises UserError.

    doe, diagnosis: where those lie, if elsewhere. The campaign of an inversion's own folder is looked for beside it: it
    is the only one with the same case hash. A loop without one of its own has the one that its inversion was given,
    where that still lies there. A diagnosis of another record or case than the inversion's is left out, and refused
    where it is named. makers: commands whose folders the errors ask for.
    """
    if folder.is_file():
        raise UserError(f"{folder} is a file; give the folder that close-the-loop, run-doe or train-and-invert made")
    if not folder.is_dir():
        made = shlex.join(["birdstrike", "close-the-loop", "CASE", "--measured", "CSV", "--out", str(folder)])
        raise UserError(f"{folder} does not exist; make it with: {made}")
    maker, asked = maker_of(folder), f"give a folder of {', '.join(makers[:-1])} or {makers[-1]}"
    if of_model := model_of(folder):
        raise UserError(
            f"{folder} is of the bird model {of_model[1]} in {of_model[0]}, which birdstrike calibrate-models made "
            f"(birdstrike explore, export and predict --from take it); {asked}"
        )
    if maker not in (None, *SHOWN):
        pages = [str(page) for page in sorted(folder.glob("*.html")) if page.name != "explore.html"]
        own = f" (its own page is {', '.join(pages)})" if pages else ""
        raise UserError(f"{folder} was made by birdstrike {maker}{own}; {asked}")
    for given, files, what in ((doe, CAMPAIGN_FILES, "finished campaign"), (diagnosis, DIAGNOSIS_FILES, "diagnosis")):
        if given is not None and (lacking := _lacking(given, files)):
            raise UserError(f"no {what} in {given}: it lacks {', '.join(lacking)}")
    inverted = _first((folder, folder / "inversion"), INVERSION_FILES)
    diagnosed = diagnosis or _first((folder, folder / "diagnosis"), DIAGNOSIS_FILES)
    differs = shot_difference(inverted, diagnosed) if inverted is not None and diagnosed is not None else ""
    if differs and diagnosis is not None:
        raise UserError(
            f"{differs}; give a diagnosis of the same record and case, or leave --diagnosis out: "
            f"{_by_itself(diagnosis)}"
        )
    campaign = doe or _first((folder, folder / "doe"), CAMPAIGN_FILES)
    if campaign is None and inverted is not None:
        campaign = _campaign_beside(folder) if inverted == folder else _campaign_given(inverted)
    other = f"{differs}: it is left out; {_by_itself(diagnosed)}" if differs and diagnosed is not None else ""
    found = Parts(folder, campaign, inverted, None if differs else diagnosed, other_diagnosis=other)
    missing = tuple(_missing(found))
    if found.doe is None and found.inversion is None and found.diagnosis is None:
        raise UserError(list(missing), f"{folder} is not ready for a report")
    return replace(found, missing=missing)


def _by_itself(diagnosis: Path) -> str:
    return f"{shlex.join(['birdstrike', 'report', str(diagnosis)])} shows it by itself"


def invert_again(doe: Path, inversion: Path) -> str:
    """The command that makes an inversion of a campaign."""
    return shlex.join(
        ["birdstrike", "train-and-invert", str(doe), "--measured", "CSV", "--out", str(inversion)],
    )


def _first(folders: tuple[Path, ...], files: tuple[str, ...]) -> Path | None:
    """The first of the folders that holds all files."""
    return next((folder for folder in folders if not _lacking(folder, files)), None)


def _lacking(folder: Path, files: tuple[str, ...]) -> list[str]:
    return [name for name in files if not (folder / name).is_file()]


def _campaign_given(inversion: Path) -> Path | None:
    """The one finished campaign that a loop's inversion was given, by its options, where it lies there still.

    None where the loop has a campaign of its own, whole or not.
    """
    if (inversion.parent / "doe").is_dir():
        return None
    try:
        given = json.loads((inversion / "options.json").read_text(encoding="utf-8"))["campaigns"]
    except (OSError, ValueError, KeyError):
        return None  # of an earlier version, or of the Python function
    wanted, places = _entry(inversion / "inversion.json"), [Path(one) for one in given]
    fits = len(places) == 1 and not _lacking(places[0], CAMPAIGN_FILES) and wanted == _entry(places[0] / "summary.json")
    return places[0] if fits else None


def _campaign_beside(inversion: Path) -> Path | None:
    """The only finished campaign beside the inversion's folder whose case is the inversion's, else None."""
    wanted = _entry(inversion / "inversion.json")
    with suppress(OSError):
        folders = [path for path in sorted(inversion.absolute().parent.iterdir()) if path.is_dir()]
        fitting = [path for path in folders if not _lacking(path, CAMPAIGN_FILES)]
        fitting = [path for path in fitting if wanted and _entry(path / "summary.json") == wanted]
        if len(fitting) == 1:
            found = fitting[0]
            return found if inversion.is_absolute() else inversion.parent / found.name
    return None


def _entry(path: Path) -> str:
    """The hash of the case in a JSON file, "" where it cannot be read."""
    try:
        return str(json.loads(path.read_text(encoding="utf-8")).get("case_hash", ""))
    except (OSError, ValueError, AttributeError):
        return ""


def _missing(found: Parts) -> Iterator[str]:
    """One line for each part that is not there, with its command."""
    folder = found.folder
    doe = folder / "doe"
    inversion = folder.parent / "inversion" if folder in (found.doe, found.diagnosis) else folder / "inversion"
    if found.doe is None and found.inversion == folder:
        yield (
            f"no campaign of the same case beside {folder}; name it with --doe: without it the report has neither "
            "set-up nor simulations of the campaign, nor the standard birds"
        )
    elif found.doe is None:
        place = doe if found.inversion or not found.diagnosis else folder.parent / "doe"
        made = shlex.join(["birdstrike", "run-doe", "CASE", "--out", str(place)])
        lacking = _lacking(doe, CAMPAIGN_FILES) if doe.is_dir() else ()
        what = f"no {', '.join(lacking)} in {doe}" if lacking else f"no finished campaign in {place}"
        yield f"{what}; make it with: {made}"
    if found.inversion is None:
        lacking = _lacking(inversion, INVERSION_FILES)
        made = f"no {', '.join(lacking)} in {inversion}; make it with: {invert_again(found.doe or doe, inversion)}"
        yield made if lacking else f"the inversion in {inversion}, which birdstrike report {inversion.parent} shows"
    if found.diagnosis is None:
        place = folder.parent / "diagnosis" if folder in (found.doe, found.inversion) else folder / "diagnosis"
        case = str(found.doe / "case.toml") if found.doe else "CASE"
        made = shlex.join(["birdstrike", "diagnose", case, "--measured", "CSV", "--out", str(place)])
        there = f"the diagnosis in {place}, which --diagnosis {place} adds"
        if found.other_diagnosis:
            yield f"{found.other_diagnosis}; one of this inversion's record takes its place: {made}"
        else:
            yield f"no diagnosis in {place}; make it with: {made}" if _lacking(place, DIAGNOSIS_FILES) else there
