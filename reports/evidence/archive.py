"""The evidence as a zip: inputs, results, what repeats them, and a manifest with the digest of every file."""

from __future__ import annotations

import hashlib
import json
import platform
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from birdstrike.data.errors import UserError
from birdstrike.data.storage.files import json_values, read_json, whole_file
from birdstrike.doe.solvers import simulated_by, solver_for
from birdstrike.inversion.train_and_invert import case_file
from birdstrike.reports.evidence.sources import CAMPAIGN_FILES, Sources, find_sources, repeat_line, repeat_words
from birdstrike.reports.evidence.summary import summary_page
from birdstrike.reports.evidence.verification_rows import Aspect, aspects, read_rows
from birdstrike.reports.sections.reproducibility import LIBRARIES, installed
from birdstrike.solver.case.case import Case, case_hash, load_case
from birdstrike.solver.case.write import case_toml, named_files, portable_table
from birdstrike.solver.version import SOLVER_VERSION

EPOCH = (1980, 1, 1, 0, 0, 0)
"""Date of every entry: the same evidence gives the same bytes."""
PAGE, MANIFEST, CHECKS = "SUMMARY.md", "manifest.json", "verification.json"
LEFT_OUT = (".birdstrike.json",)
HELD = "case.toml"
"""The case of a folder of results."""
CASES = (HELD, case_file("*"), "diagnosis_*.toml", "baseline_*.toml")
"""Those of an inversion's shots, and of a diagnosis' shots and baselines."""


@dataclass(frozen=True)
class Evidence:
    """path: the zip; files: how many it holds; missing: aspects of the case that no row of the verification checks;

    open_points: sentences on what is not there.
    """

    path: Path
    files: int
    missing: tuple[str, ...]
    open_points: tuple[str, ...]
    repeat: str


def write_evidence(
    folder: Path,
    out: Path,
    *,
    measured: Sequence[str | Path] = (),
    doe: Path | None = None,
    verification: Path | None = None,
    runs: bool = False,
) -> Evidence:
    """Write the evidence of the answer in a folder; raises UserError for one that could not be repeated from it.

    verification: the page of birdstrike verify, by default VERIFICATION.md here or in the source tree; runs: whether
    the campaign's simulations themselves go into it, and not only their curves.
    """
    if out.suffix.lower() != ".zip":
        raise UserError(f"--out {out}: the evidence is a zip; name it so, such as evidence.zip")
    sources = find_sources(folder, measured, doe)
    found, more = _checks(sources, verification)
    sources = _with_points(sources, [*_other_solver(sources), *more])
    entries = dict(_entries(sources, runs))
    digests = {name: hashlib.sha256(content).hexdigest() for name, content in entries.items()}
    versions = {"birdstrike": installed("birdstrike"), "Python": platform.python_version()}
    versions |= {name: installed(name) for name in LIBRARIES}
    entries[CHECKS] = _json(
        {"solver_version": solver_for(sources.case).version, "aspects": [one.figures() for one in found]}
    )
    entries[PAGE] = summary_page(sources, found, digests, versions).encode()
    entries["repeat.sh"] = (
        f"#!/bin/sh\n# Repeats the calibration in this folder.\nset -e\n{repeat_line(sources)}\n".encode()
    )
    entries[MANIFEST] = _json(_manifest(sources, entries, versions))
    with whole_file(out) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in (PAGE, MANIFEST, *sorted(entries.keys() - {PAGE, MANIFEST})):
            archive.writestr(zipfile.ZipInfo(name, EPOCH), entries[name], zipfile.ZIP_DEFLATED)
    missing = tuple(f"{one.name}: {one.missing}" for one in found if one.missing)
    return Evidence(out, len(entries), missing, sources.open_points, repeat_line(sources))


def _with_points(sources: Sources, more: Sequence[str]) -> Sources:
    return replace(sources, open_points=(*sources.open_points, *more))


def _other_solver(sources: Sources) -> list[str]:
    """That a campaign was made with another solver than the one at hand."""
    now = solver_for(sources.case).version
    made = dict.fromkeys(str(read_json(one / "summary.json").get("solver_version")) for one in sources.campaigns)
    others = [version for version in made if version != now]
    if not others:
        return []
    return [
        f"the campaign was simulated with solver {', '.join(others)}, and the one at hand is {now}, with which the "
        "command would verify the answer: run the campaign again, or install the version that made it"
    ]


def _checks(sources: Sources, given: Path | None) -> tuple[tuple[Aspect, ...], list[str]]:
    """Aspects of the case with their rows, and what to know of the page that they come from."""
    if sources.case.solver.name == "external":
        return (), _external_points(sources.case)
    root = Path(__file__).resolve().parents[2]
    page = next(
        (one for one in (given, Path("VERIFICATION.md"), root / "VERIFICATION.md") if one and one.is_file()), None
    )
    if given is not None and page != given:
        raise UserError(f"--verification {given}: there is no such file; birdstrike verify writes it")
    if page is None:
        return (), ["no VERIFICATION.md: make it with birdstrike verify, and name it with --verification"]
    rows, codes = read_rows(page)
    points = []
    if others := [code for code in codes if code != SOLVER_VERSION]:
        points.append(
            f"rows of {page.name} were made with solver {', '.join(others)}, and this one is {SOLVER_VERSION}: repeat "
            "birdstrike verify"
        )
    return aspects(sources.case, rows), points


def _external_points(case: Case) -> list[str]:
    """What the archive cannot hold or vouch for where another program simulates the case."""
    program, external = simulated_by(case), case.external
    assert external is not None
    return [
        f"the curves are those of {program}: VERIFICATION.md checks birdstrike's own solver and says nothing of it; "
        "add evidence of your own",
        f"{program} is not in this archive: to repeat the calibration, install it where external.command of the cases "
        f"finds it ({' '.join(external.command)})",
    ]


def _entries(sources: Sources, runs: bool) -> Iterator[tuple[str, bytes]]:
    yield from _case(sources.case, "case.toml", "")
    for record in sources.records:
        yield f"records/{record.name}", record.read_bytes()
    for number, case in enumerate(sources.cases, 1):
        yield from _case(load_case(case), f"cases/{number}.toml", f"{number}/")
    for number, campaign in enumerate(sources.campaigns, 1):
        yield from _campaign(campaign, f"campaigns/{number}", runs)
    if sources.options["extras"].get("mesh"):
        mesh = Path(sources.options["extras"]["mesh"])
        if not mesh.is_file():
            raise UserError(f"the mesh study {mesh} of the inversion is not where it was; put it back")
        yield "mesh/convergence.csv", mesh.read_bytes()
    yield from _files(sources.inversion, "inversion")
    if sources.diagnosis is not None:
        yield from _files(sources.diagnosis, "diagnosis")
    for number, record in enumerate(sources.beside, 1):
        yield f"diagnosis/records/{number}/{record.name}", record.read_bytes()
    if sources.report is not None:
        yield "report.html", sources.report.read_bytes()


def _case(case: Case, name: str, place: str) -> Iterator[tuple[str, bytes]]:
    """A case that stands alone, and the files that it names, under `place` in its folder."""
    yield name, case_toml(case, portable_table(case, place)).encode()
    folder = Path(name).parent.as_posix()
    for file, path in named_files(case).items():
        yield Path(folder, place, file).as_posix(), path.read_bytes()


def _held_case(path: Path, place: str) -> Iterator[tuple[str, bytes]]:
    """A case that a folder of results holds; one that names files by whole paths (an older folder's) is made anew."""
    name, case = f"{place}/{path.name}", load_case(path)
    if named_files(case):
        yield from _case(case, name, "" if path.name == HELD else f"{path.stem}/")
    else:
        yield name, path.read_bytes()


def _campaign(campaign: Path, place: str, runs: bool) -> Iterator[tuple[str, bytes]]:
    for name in CAMPAIGN_FILES:
        if (campaign / name).is_file():
            yield f"{place}/{name}", (campaign / name).read_bytes()
    yield from _held_case(campaign / HELD, place)
    for path in sorted((campaign / "runs").glob("*")) if runs else ():
        if path.is_file() and not path.name.startswith("."):
            yield f"{place}/runs/{path.name}", path.read_bytes()


def _files(folder: Path, place: str) -> Iterator[tuple[str, bytes]]:
    """Files of a folder of results itself, with those that its cases name; not the runs below it."""
    cases = [path for pattern in CASES for path in sorted(folder.glob(pattern))]
    for path in cases:
        yield from _held_case(path, place)
    for path in sorted(folder.iterdir()):
        if path.is_file() and path not in cases and path.name not in LEFT_OUT and path.suffix != ".zip":
            yield f"{place}/{path.name}", path.read_bytes()


def _manifest(sources: Sources, entries: dict[str, bytes], versions: dict[str, str]) -> dict[str, Any]:
    answer = sources.answer
    summaries = [read_json(one / "summary.json") for one in sources.campaigns]
    return {
        "case": sources.case.name,
        "case_hash": case_hash(sources.case),
        "solver_version": solver_for(sources.case).version,
        "campaigns": [
            {
                "case_hash": one.get("case_hash"),
                "solver_version": one.get("solver_version"),
                "design": one.get("design"),
                "runs": one.get("runs"),
            }
            for one in summaries
        ],
        "verification_runs": {name: one.run for name, one in answer.methods.items()},
        "seed": answer.seed,
        "options": sources.options,
        "repeat": repeat_words(sources),
        "versions": versions,
        "machine": {"system": platform.platform(), "processor": platform.machine()},
        "warnings": [*answer.warnings],
        "open_points": list(sources.open_points),
        "files": {name: {"sha256": hashlib.sha256(c).hexdigest(), "bytes": len(c)} for name, c in entries.items()},
    }


def _json(content: dict[str, Any]) -> bytes:
    return (json.dumps(json_values({"schema_version": 1, **content}), indent=2, allow_nan=False) + "\n").encode()
