"""What an answer rests on: campaigns, records, options, and the files of its folders."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from birdstrike.data.errors import UserError
from birdstrike.data.formatting import many
from birdstrike.data.paths import resolve_measured
from birdstrike.data.storage.files import file_digest, read_json
from birdstrike.data.storage.out_folder import maker_of
from birdstrike.doe.campaign.folder import CampaignFolder
from birdstrike.inversion.results.diagnosis import Diagnosis
from birdstrike.inversion.results.inversion import Inversion
from birdstrike.inversion.train_and_invert import case_file
from birdstrike.reports.results.commands import invert_words, stored_options, verified_in_python
from birdstrike.reports.results.parts import find_parts
from birdstrike.solver.case.case import Case, case_from_table, raw_case

MAKERS = ("train-and-invert", "close-the-loop", "start")
"""Commands whose folders hold an inversion, of which evidence can be made."""
CAMPAIGN_FILES = ("case.json", "design.csv", "curves.csv", "summary.json")


@dataclass(frozen=True)
class Sources:
    """inversion, diagnosis: their folders, the latter None where there is none; diagnosed: its content.

    campaigns, records: in the order of the options; beside: further records on which the diagnosis rests; cases: of the
    records where they were named, else empty; case: of the first record; options: as train-and-invert had them;
    open_points: what is not there, or not as it should be.
    """

    folder: Path
    inversion: Path
    answer: Inversion
    diagnosis: Path | None
    diagnosed: Diagnosis | None
    campaigns: tuple[Path, ...]
    records: tuple[Path, ...]
    beside: tuple[Path, ...]
    cases: tuple[Path, ...]
    case: Case
    options: Mapping[str, Any]
    report: Path | None
    open_points: tuple[str, ...]


def find_sources(folder: Path, measured: Sequence[str | Path] = (), doe: Path | None = None) -> Sources:
    """The sources of the answer in a folder; raises UserError for one that cannot be repeated.

    measured: the records' files, in the order in which they were inverted, where they have moved; doe: the campaign's
    folder, where it lies elsewhere.
    """
    parts = find_parts(folder, doe, makers=MAKERS)
    if parts.inversion is None:
        maker = maker_of(folder)
        made = f" (birdstrike {maker} made it)" if maker is not None else ""
        raise UserError(
            f"{folder} holds no inversion{made}; evidence is of an inversion: give a folder of "
            f"{', '.join(MAKERS[:-1])} or {MAKERS[-1]}; the evidence takes a diagnosis from the folder diagnosis in it"
        )
    answer = Inversion.load(parts.inversion / "inversion.json")
    options, told = stored_options(parts.inversion, answer)
    campaigns = _campaigns(options, parts.doe, doe)
    altered = [line for campaign in campaigns for line in CampaignFolder(campaign).altered()]
    if altered:
        raise UserError(altered)
    records = _records(options, measured)
    _refuse_changed(records, [one.digest for one in answer.shots or [answer.measured]], "the inversion", _RIGHT_FILE)
    cases = tuple(_held(parts.inversion, number, Path(one)) for number, one in enumerate(options["cases"], 1) if one)
    held = parts.inversion / case_file(1)
    case = _case(options["cases"], held if held.is_file() else campaigns[0] / "case.toml", campaigns[0])
    report = next((page for page in (folder / "report.html", parts.inversion / "report.html") if page.is_file()), None)
    diagnosed = None if parts.diagnosis is None else Diagnosis.read(parts.diagnosis / "diagnosis.json")
    if diagnosed is None:
        unasked = "no diagnosis: whether an effect is missing from the model was not asked"
        beside, points = (), [parts.other_diagnosis or unasked]
    else:
        beside, points = of_diagnosis(diagnosed, records)
    if report is None:
        points = [f"no report.html in {folder.name}: make it with birdstrike report", *points]
    return Sources(
        folder=folder,
        inversion=parts.inversion,
        answer=answer,
        diagnosis=parts.diagnosis,
        diagnosed=diagnosed,
        campaigns=campaigns,
        records=records,
        beside=beside,
        cases=cases,
        case=case,
        options=options,
        report=report,
        open_points=(*told, *filter(None, [no_command(options)]), *points),
    )


def of_diagnosis(found: Diagnosis, records: Sequence[Path]) -> tuple[tuple[Path, ...], list[str]]:
    """Further records on which a diagnosis rests, and what to know of them: those of the inversion are `records`.

    One of the inversion's that has moved since is known by its name.
    """
    named = found.record.get("files")
    if named is None:  # of an earlier version
        count = len(found.shots) - 1 + len((found.baseline or {}).get("shots", [])) + ("shot" in found.held_out)
        return (), [_gone([f"{count} of which the diagnosis does not say the files"])] if count else []
    places = {str(one): _found(one) for one in named}
    names, own = {path.name for path in records}, {path.resolve() for path in records}
    gone = [one for one, place in places.items() if place is None and Path(one).name not in names]
    beside = tuple(
        path for path in dict.fromkeys(place.resolve() for place in places.values() if place) if path not in own
    )
    points = [_gone(gone)] if gone else []
    read = {
        place.resolve(): digest
        for one, digest in zip(named, found.record.get("digests", []), strict=False)
        if (place := places[str(one)])
    }
    _refuse_changed(beside, [read.get(path, "") for path in beside], "the diagnosis", _AS_IT_WAS)
    if beside:
        points.append(
            f"the diagnosis rests on further records ({', '.join(path.name for path in beside)}), which are in "
            "diagnosis/records: the command repeats the calibration alone"
        )
    return beside, points


def _gone(records: Sequence[str]) -> str:
    return (
        f"the diagnosis rests on further records which are not in this archive ({', '.join(records)}): keep them and "
        "their cases with it"
    )


def _held(inversion: Path, number: int, named: Path) -> Path:
    """The case of a shot as the inversion keeps it; of an earlier version the file that was named."""
    kept = inversion / case_file(number)
    return kept if kept.is_file() else named


def _case(named: Sequence[str | None], held: Path, campaign: Path) -> Case:
    """The first record's case, by its own name, which its file had, else the campaign says it."""
    first = next(iter(named), None)
    told = first and Path(first).name != case_file(1)  # a copy's name tells nothing
    own = Path(first).stem if first and told else read_json(campaign / "case.json").get("name", held.stem)
    return case_from_table(raw_case(held), own)


def _campaigns(options: Mapping[str, Any], found: Path | None, given: Path | None) -> tuple[Path, ...]:
    named = [Path(one) for one in options["campaigns"]]
    if given is not None and len(named) <= 1:
        named = [given]
    if len(named) <= 1 and found is not None and not (named and named[0].is_dir()):
        named = [found]
    gone = [str(one) for one in named if not (one / "curves.csv").is_file()]
    if gone or not named:
        where = ", ".join(gone) or "an unknown place"
        raise UserError(f"the campaign of the inversion is not where it was ({where}); name it: --doe CAMPAIGN")
    return tuple(named)


def _records(options: Mapping[str, Any], given: Sequence[str | Path]) -> tuple[Path, ...]:
    named: list[Any] = list(given) or list(options["measured"])
    if given and len(given) != len(options["measured"]):
        raise UserError(
            f"--measured was given {many(len(given), 'time')}, and the inversion has "
            f"{many(len(options['measured']), 'record')}: give each of them, in their order"
        )
    places = [_found(one) for one in named]
    found = tuple(place for place in places if place is not None)
    if len(found) < len(named):
        raise UserError(
            f"the record {one} is not where the inversion read it; name its file: --measured CSV"
            for one, place in zip(named, places, strict=True)
            if place is None
        )
    names = [one.name for one in found]
    if len(set(names)) < len(names):
        raise UserError(f"two records have one name ({', '.join(names)}); rename one, and give both by --measured")
    return found


_RIGHT_FILE = (
    "name the file as it was read: --measured CSV (of each record, in their order), or repeat birdstrike "
    "train-and-invert with this one"
)
_AS_IT_WAS = "put the file there as it was read, or repeat birdstrike diagnose with this one"


def _refuse_changed(records: Sequence[Path], digests: Sequence[str], reader: str, remedy: str) -> None:
    """Raises UserError for each record whose content is not that which was read; digest "": it is not known.

    reader: what read them, and remedy: what to do, in words.
    """
    now = [file_digest(one) if digest else "" for one, digest in zip(records, digests, strict=True)]
    changed = [
        f"{one} (SHA-256 {found[:12]}) is not as {reader} read it (SHA-256 {digest[:12]}); {remedy}"
        for one, digest, found in zip(records, digests, now, strict=True)
        if found != digest
    ]
    if changed:
        raise UserError(changed)


def _found(record: str | Path | None) -> Path | None:
    """Where a record is that was named so; None where it is not there, or had no file."""
    try:
        return Path(resolve_measured(record)) if record else None
    except UserError:
        return None


def repeat_words(sources: Sources) -> list[str]:
    """The command that repeats the calibration in the unpacked archive, word by word; none where no command does."""
    if verified_in_python(sources.options):
        return []
    words = invert_words(
        sources.options,
        [f"campaigns/{i}" for i in range(1, len(sources.campaigns) + 1)],
        [f"records/{record.name}" for record in sources.records],
        [f"cases/{i}.toml" for i in range(1, len(sources.cases) + 1)],
        "mesh/convergence.csv",
        "again",
    )
    return ["birdstrike", *words]


def repeat_line(sources: Sources) -> str:
    """The command itself, or a shell's comment that says why there is none."""
    return shlex.join(repeat_words(sources)) or f"# {no_command(sources.options)}"


def no_command(options: Mapping[str, Any]) -> str:
    """Why no command repeats the calibration; empty where one does."""
    why = verified_in_python(options)
    return f"{why}: no command repeats it; keep that function with this archive" if why else ""
