"""The page at the head of the evidence: what was found, from what, how to repeat it, where it holds, what is open."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from birdstrike.data.formatting import quantity, span
from birdstrike.data.storage.files import read_json
from birdstrike.data.units import rounded
from birdstrike.doe.solvers import simulated_by
from birdstrike.inversion.labels import flight
from birdstrike.reports.evidence.sources import Sources, no_command, repeat_line
from birdstrike.reports.evidence.verification_rows import Aspect
from birdstrike.solver.case.case import Case, case_hash
from birdstrike.solver.case.effects import stated
from birdstrike.solver.version import SOLVER_VERSION


def summary_page(
    sources: Sources, found: Sequence[Aspect], digests: Mapping[str, str], versions: Mapping[str, str]
) -> str:
    """Markdown; digests: archive name -> SHA-256 of the records."""
    lines = [
        f"# Evidence: {sources.case.name}",
        "",
        sources.answer.headline + ".",
        "",
        "## What was found",
        "",
        *_answer(sources),
        "",
        "## From what",
        "",
        *_inputs(sources, digests),
        "",
        "## To repeat it",
        "",
        *_again(sources),
        "",
        *(f"- {name}: {value}" for name, value in versions.items()),
        "",
        "## Where it holds",
        "",
        *_validity(sources),
        "",
        "## Checks of the solver that bear on this case",
        "",
        *_checks(found),
        "",
        "## Open points",
        "",
        *_open(sources, found),
        "",
    ]
    return "\n".join(lines)


def _again(sources: Sources) -> Iterator[str]:
    """How the calibration is repeated, or why no command does it."""
    if why := no_command(sources.options):
        yield f"Not by a command: {why}. Versions of then:"
        return
    yield from ("In the folder where this archive is unpacked, with the versions below:", "")
    yield from (f"    {repeat_line(sources)}", "")
    yield "The numbers of again/inversion.json are then those of inversion/inversion.json; on another machine the last "
    yield "digits may differ."


def _answer(sources: Sources) -> Iterator[str]:
    answer = sources.answer.best_answer
    for name, one in answer.parameters.items():
        value = "no value" if one.value is None else quantity(one.value, one.unit, 4)
        if one.identified and one.interval_95 is not None:
            yield f"- {name}: {value}, 95 % interval {span(*one.interval_95, one.unit, 4)}"
        else:
            yield f"- {name}: NOT IDENTIFIED ({one.reason})"
    if answer.verified_relative is not None:
        share = rounded(100.0 * answer.verified_relative, 2)
        yield f"- Simulation at this answer and the record: {share} % of the peaks (RMS)"
    if found := sources.diagnosed:
        yield f"- Diagnosis: {found.verdict.replace('_', ' ')}. {found.sentence}."


def _inputs(sources: Sources, digests: Mapping[str, str]) -> Iterator[str]:
    simulated = sources.answer.simulated_records
    for record, path in zip(sources.records, sources.answer.records, strict=True):
        kind = "SIMULATED, NOT MEASURED" if path in simulated else "measured"
        yield f"- Record {record.name} ({kind}), SHA-256 {digests[f'records/{record.name}']}"
    yield f"- Case {sources.case.name}, hash {case_hash(sources.case)}; {_solver(sources.case)}"
    for number, campaign in enumerate(sources.campaigns, 1):
        summary = read_json(campaign / "summary.json")
        design = summary.get("design", {})
        made = f"design {design.get('kind')}, {design.get('runs')} runs, seed {design.get('seed')}"
        yield f"- Campaign {number}: {made}, solver {summary.get('solver_version')}"
    yield f"- Seed of the inversion {sources.answer.seed}; {sources.answer.runs_used} runs used"


def _solver(case: Case) -> str:
    """The solver of the case: our own by the digest of its sources, another by the version that the case states."""
    if case.solver.name == "external":
        return f"solver {simulated_by(case)}, an external program (version as the case states it)"
    return f"this archive was written with solver {SOLVER_VERSION} (digest of its sources)"


def _validity(sources: Sources) -> Iterator[str]:
    """The ranges that were searched and what the campaign spans: outside of them nothing is known."""
    case = sources.case
    units = {parameter.name: parameter.unit for parameter in case.parameters()}
    for name, (low, high) in sources.answer.ranges.items():
        yield f"- {name} was sought in {span(low, high, units.get(name, ''), 4)}"
    yield f"- One impact: {flight(case.impact, 4)}, to {quantity(case.time.end, 's', 4)}; other speeds and "
    yield "  targets are an extrapolation of the calibrated bird"
    if not case.plate.rigid and case.target is None:
        yield f"- Target: plate of {quantity(case.plate.thickness, 'm', 4)}, edges {case.plate.edge_words}"
    yield from (f"- Effect that the case states: {line}" for line in stated(case))
    unknown = [name for name, one in sources.answer.best_answer.parameters.items() if not one.identified]
    if unknown:
        yield f"- Not identified, and so only a place in its range: {', '.join(unknown)}"


def _checks(found: Sequence[Aspect]) -> Iterator[str]:
    if not found:
        yield "None (see the open points)."
    for one in found:
        verdicts = [row.verdict for row in one.rows]
        judged = f"{verdicts.count('within')} rows within their tolerance, {verdicts.count('beyond')} beyond"
        yield f"- {one.name}: {judged}{f'; MISSING: {one.missing}' if one.missing else ''}"


def _open(sources: Sources, found: Sequence[Aspect]) -> Iterator[str]:
    lines = [*sources.open_points, *sources.answer.warnings]
    lines += sources.diagnosed.warnings if sources.diagnosed else ()
    lines += [f"verification: {one.name}: {one.missing}" for one in found if one.missing]
    yield from (f"- {line}" for line in dict.fromkeys(lines))
    if not lines:
        yield "None."
