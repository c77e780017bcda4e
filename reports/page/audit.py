"""The audit as a page and as Markdown, for the repository's own pages."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from birdstrike.data.errors import UserError
from birdstrike.data.formatting import many
from birdstrike.data.storage.files import read_json, write_atomically
from birdstrike.inversion.audit.draws import PARTICLES, SHELLS, SHELLS_OF_FORM, name_of
from birdstrike.inversion.audit.tables import NEAR, criteria
from birdstrike.reports.blocks import Block, Paragraph, Section, Table, drawing
from birdstrike.reports.figures.audit import confusion_figure, reliability_figure
from birdstrike.reports.page.render import rendered
from birdstrike.solver.case.effects import shown
from birdstrike.solver.effects.registry import effects

CRITERIA = ("figure", "value", "95 % by bootstrap", "95 % Clopper-Pearson", "truths", "criterion", "met")
EXPECTED = ((1, 1), (4, 1), (4, 3))
"""(channels, shots) of the tables that the design asks for, of all kinds of baseline and of truth."""
BARS = 40  # characters from 0 to 1 in the diagram in text

Rows = tuple[tuple[str, ...], ...]


def tables(entry: Mapping[str, Any]) -> dict[str, Table]:
    """Tables of one kind of record, by name."""
    return {
        "gates": Table(CRITERIA, criterion_rows(entry["gates"]), "The acceptance criteria.", frozenset({1, 2, 3, 4})),
        "reliability": _reliability(entry["reliability"]),
        "experiments": _experiments(entry["experiments"]),
    }


def criterion_rows(found: Sequence[Mapping[str, Any]]) -> Rows:
    """Criteria with both intervals; the one that judges a criterion on an interval is the wider."""
    return tuple(
        (
            criterion["figure"],
            _share(criterion["value"]),
            _ends(criterion["interval_95"]),
            _ends(criterion["exact_95"]),
            str(criterion["curves"]),
            criterion["gate"],
            _met(criterion),
        )
        for criterion in found
    )


def _met(criterion: Mapping[str, Any]) -> str:
    if criterion["gate"] != "shown" and criterion["value"] is None:
        return "not measured"
    return {None: "–", True: "yes", False: "no"}[criterion["met"]]


def _ends(interval: Sequence[float] | None) -> str:
    return "–" if interval is None else "{:.3f} to {:.3f}".format(*interval)


def _share(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"


def _reliability(deciles: Sequence[Mapping[str, Any]]) -> Table:
    head = ("stated, from .. to", "models", "truths", "mean stated", "true", "95 %", "within")
    rows = tuple(
        (
            f"{one['from']:.1f} .. {one['to']:.1f}",
            str(one["models"]),
            str(one["truths"]),
            _share(one["stated"]),
            _share(one["true"]),
            _ends(one["interval_95"]),
            {None: "–", True: "yes", False: "no"}[one["within"]],
        )
        for one in deciles
    )
    caption = (
        "Reliability: how often what is stated with a probability is true, kinds of truth weighted to the prior "
        "probabilities of the diagnosis."
    )
    return Table(head, rows, caption, frozenset({1, 2, 3, 4, 5}))


def _experiments(records: Sequence[Mapping[str, Any]]) -> Table:
    head = (
        "record",
        "planted",
        "signal",
        "answer",
        "p",
        "95 % set (first five)",
        "rank",
        "probability",
        "excess error",
    )
    rows = tuple(
        (
            one["name"],
            _planted(one),
            "–" if one["signal"] is None else f"{one['signal']:.1f}",
            one["verdict"].replace("_", " ") + (f": {one['named']}" if one["named"] else ""),
            f"{one['p']:.3f}",
            ", ".join(one["confidence_set"][:5]) or "–",
            "–" if one["rank"] is None else str(one["rank"]),
            _share(one["probability"]),
            "–" if one["excess"] is None else f"{one['excess']:.2f}",
        )
        for one in records
    )
    caption = (
        "Every record: rank of the planted effect among the single effects, probability that the answer gives to the "
        "truth, and (after^2 - oracle^2) / (before^2 - oracle^2) of the errors held out."
    )
    return Table(head, rows, caption, frozenset({2, 4, 6, 7, 8}))


def _planted(one: Mapping[str, Any]) -> str:
    if not one["planted"]:
        return one["what"] or one["kind"]
    return ", ".join(f"{label} {_size(label, value)}" for label, value in one["planted"].items())


def _size(label: str, value: float) -> str:
    effect = effects().get(name_of(label))
    return f"{value:.3g}" if effect is None else shown(value, effect.unit)


def state(content: Mapping[str, Any]) -> str:
    """Whether the audit has been run to the end, and with how many records."""
    records, wanted = content["records"], content["wanted"]
    lost = len(content["failed"])
    failed = f" {many(lost, 'further record')} {'has' if lost == 1 else 'have'} no answer." if lost else ""
    scored = f"{many(records, 'record')} {'was' if records == 1 else 'were'} diagnosed and scored"
    if content["complete"]:
        return f"{scored}.{failed}"
    if not records:
        return f"**The audit of this design of the diagnosis has not been run**: no record has been scored.{failed}"
    return (
        f"**The audit of this design of the diagnosis has not been run to the end**: {scored}, and a table needs "
        f"{wanted} truths. Figures of so few say little.{failed}"
    )


def words(content: Mapping[str, Any]) -> str:
    """How the audit was made, in sentences."""
    asked = (
        "Each record was diagnosed as `birdstrike diagnose` does it."
        if content["confirmed"]
        else "Quick: the solver was not run at the fits (--no-confirm)."
    )
    several = f" {content['draws']} draws of the noise on each record." if content["draws"] > 1 else ""
    return f"{asked}{several} Solver {content['solver_version']}, code of the diagnosis {content['code']}."


METHOD = (
    f"Truths that the audit makes stand on {PARTICLES} times the declared particles and {SHELLS} times the declared "
    "shells a side, on the other, jittered lattice; parameters, effects, sizes (0.8 to 3 plausible ones), signs and "
    f"noise are drawn from the seed. Truths by another model have {SHELLS_OF_FORM} times the shells and a bird of "
    "hexahedra, or another equation of state with twice the artificial viscosity. A baseline has a bird of its own or, "
    "where the table says so, the shot's own bird on another lattice, and the diagnosis is told. "
    "The signal is the whitened change between two simulations of the truth, with and without the effect on one "
    "lattice, less what the calibrated parameters imitate; a record counts at a signal within a factor of "
    f"{NEAR:g} of it. The records that are shipped are older: their truths stand on 2 to 2.8 times the particles, and "
    "they have no such pairs, so that figures at a signal are not measured on them."
)


def in_markdown(table: Table) -> Iterator[str]:
    """Lines of a table in Markdown."""
    yield f"| {' | '.join(table.head)} |"
    yield f"|{'---|' * len(table.head)}"
    yield from (f"| {' | '.join(row)} |" for row in table.rows)


def diagram(deciles: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """The reliability diagram in text: a row a decile, - its interval, o the share that is true, | the mean stated."""
    yield "```text"
    yield f"stated     0{' ' * (BARS - 2)}1"
    for one in deciles:
        cells = [" "] * (BARS + 1)
        if one["truths"]:
            low, high = (round(BARS * x) for x in one["interval_95"])
            cells[low : high + 1] = "-" * (high - low + 1)
            cells[round(BARS * one["stated"])] = "|"
            cells[round(BARS * one["true"])] = "o"
        yield f"{one['from']:.1f} .. {one['to']:.1f} {''.join(cells)}".rstrip()
    yield "```"


def write_audit_page(folder: str | Path) -> Path:
    """Write `audit.html` beside audit.json; its path. Raises UserError where there is no audit."""
    place = Path(folder)
    path = place / "audit.json"
    if not path.is_file():
        raise UserError(f"no audit.json in {place}; make it with: birdstrike audit --out {place}")
    content = read_json(path)
    write_atomically(place / "audit.html", page(content))
    return place / "audit.html"


def page(content: Mapping[str, Any]) -> str:
    """The page as HTML text; nothing in it points outside."""
    return rendered(
        title="Audit of the diagnosis",
        subtitle=f"Records of known truth. {state(content).replace('**', '')} {words(content).replace('`', '')}",
        sections=[section(i, name, entry) for i, (name, entry) in enumerate(content["tables"].items())],
    )


def section(number: int, name: str, entry: Mapping[str, Any]) -> Section:
    """All of one kind of record."""
    intro = (
        f"{many(entry['records'], 'record')} of {many(entry['curves'], 'truth')}. Two intervals, both over truths: by "
        "bootstrap, which is too narrow over a handful of them, and Clopper and Pearson's of the nearest whole number "
        "of truths, which is wide; a criterion on an interval takes the wider. Missed criteria are shown."
    )
    found = tables(entry)
    confusion = drawing(
        f"confusion-{number}", confusion_figure(entry["confusion"]), "What was planted and what was answered."
    )
    caption = (
        "Stated probabilities by deciles against the share that is true, with 95 % intervals; on the diagonal they are "
        "as stated."
    )
    reliable = drawing(f"reliability-{number}", reliability_figure(entry["reliability"]), caption)
    blocks: list[Block] = [Paragraph(intro), found.pop("gates"), confusion, reliable]
    return Section(f"table-{number}", f"Records of {name}", (*blocks, *found.values()))


def audit_markdown(content: Mapping[str, Any]) -> str:
    """docs/audit.md: criteria, met or not, the reliability diagram and every record."""
    return "\n".join(_lines(content)) + "\n"


def _lines(content: Mapping[str, Any]) -> Iterator[str]:
    yield "# Audit of the diagnosis"
    made = (
        f"Made by `{content['command'] or 'birdstrike audit'}` on {content['date']}; figures: [audit.json](audit.json)."
    )
    yield from ("", made, "", state(content), "", words(content)) if content["records"] else ("", state(content))
    yield from ("", METHOD)
    for name, entry in content["tables"].items():
        yield f"\n## Records of {name}: {many(entry['curves'], 'truth')}, {many(entry['records'], 'record')}"
        for key, table in tables(entry).items():
            yield f"\n{table.caption}\n"
            yield from in_markdown(table)
            if key == "reliability":
                yield ""
                yield from diagram(entry["reliability"])
    missing = [one for one in EXPECTED if not any(_fits(name, one) for name in content["tables"])]
    if missing:
        yield "\n## Not measured\n"
        yield "The criteria of the tables for which no record has been diagnosed:"
    for channels, shots in missing:
        heading = f"{many(channels, 'channel')}, {many(shots, 'shot')}"
        yield f"\n### {heading}, without and with a baseline, truths by the declared and by another model\n"
        yield "| figure | criterion | met |"
        yield "|---|---|---|"
        for criterion in criteria((), content["alpha"], channels, shots):
            if criterion.words != "shown":
                yield f"| {criterion.figure} | {criterion.words} | not measured |"


def _fits(name: str, wanted: tuple[int, int]) -> bool:
    """Whether a table of that name has one or several channels and so many shots as are wanted."""
    count, shots = name.split(", ")[:2]
    return (int(count.split()[0]) > 1) == (wanted[0] > 1) and int(shots.split()[0]) == wanted[1]
