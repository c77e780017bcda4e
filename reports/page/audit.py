"""The audit as Markdown, for the repository's own pages."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from birdstrike.data.errors import UserError
from birdstrike.data.files import write_atomically
from birdstrike.reports.blocks import Block, Paragraph, Section, Table, drawing
from birdstrike.reports.figures.audit import confusion_figure, power_figure
from birdstrike.reports.page.render import rendered
from birdstrike.solver.case.effects import shown
from birdstrike.solver.effects.registry import effects

GATES = ("figure", "value", "95 % by bootstrap", "95 % Clopper-Pearson", "curves", "gate", "met")
KEYS = ("false alarms", "truth in the set", "unique and wrong")
APART = 0.3  # of the wanted signal: from there the table says why what the record shows is another
CIRCULAR = "Made by the emulator itself (circular: shows only that the arithmetic holds)"

Rows = tuple[tuple[str, ...], ...]


def tables(entry: Mapping[str, Any]) -> dict[str, Table]:
    """Every table of one number of channels, by name; those of which there is nothing to say are left out."""
    found = {
        "gates": Table(GATES, gate_rows(entry["gates"]), "The gates.", frozenset({1, 2, 3, 4})),
        "made": Table(
            GATES[:-2],
            tuple(row[:-2] for row in gate_rows(entry["emulator_made"]["gates"]) if row[1] != "–"),
            CIRCULAR,
            frozenset({1, 2, 3, 4}),
        ),
        "power": _power(entry["power"]),
        "robustness": _robustness(entry["robustness"]),
        "experiments": _experiments(entry["experiments"]),
    }
    return {
        name: table
        for name, table in found.items()
        if table.rows and (name != "made" or entry["emulator_made"]["curves"])
    }


def gate_rows(gates: Sequence[Mapping[str, Any]]) -> Rows:
    """Gates with both intervals; the one that judges a gate on an interval is the wider."""
    return tuple(
        (
            gate["figure"],
            _share(gate["value"]),
            _ends(gate["interval_95"]),
            _ends(gate["exact_95"]),
            str(gate["curves"]),
            gate["gate"],
            {None: "–", True: "yes", False: "no"}[gate["met"]],
        )
        for gate in gates
    )


def _ends(interval: Sequence[float] | None) -> str:
    return "–" if interval is None else "{:.3f} to {:.3f}".format(*interval)


def _share(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"


def _power(power: Sequence[Mapping[str, Any]]) -> Table:
    """Power at a signal of 4 and 5: what makes it, in physical units, and what the record itself shows there."""
    head = (
        "effect",
        "experiment",
        "signal",
        "the record shows",
        "along one effect",
        "size that makes it",
        "power",
        "why",
    )
    rows = tuple(
        (
            one["effect"],
            one["experiment"],
            f"{one['signal']:g}",
            f"{one['shown']:.1f}",
            f"{one['along']:.1f}",
            shown(effects()[one["effect"]], one["magnitude"]),
            f"{one['power']:.2f}",
            _why(one),
        )
        for one in power
        if one["signal"] in (4.0, 5.0)
    )
    caption = (
        "Power at a signal |P g b| of 4 and 5, reached by scaling the noise. Beside it what the noise-free record "
        "shows beyond the model without effects, |P r|, and how much of that lies along the learnt signature of one "
        "effect; the size of the effect that would make the signal at the stated noise, if curves answered in "
        "proportion."
    )
    return Table(head, rows, caption, frozenset({2, 3, 4, 5, 6}))


def _why(one: Mapping[str, Any]) -> str:
    """Why what the record shows differs from the signal, where it does by more than 30 %."""
    off = one["shown"] / one["signal"] - 1.0
    if off > APART:
        return "the record shows more: error of the mesh beside the effect"
    if off < -APART:
        return "the record shows less: parameters absorb more than the learnt response says"
    if one["along"] < (1.0 - APART) * one["shown"]:
        return "what it shows has the shape of no single effect as learnt"
    return ""


def _robustness(robustness: Sequence[Mapping[str, Any]]) -> Table:
    head = ("noise", *(f"{key}, {how}" for how in ("believed", "as read") for key in KEYS))
    rows = tuple(
        (one["noise"], *(_share(one[how][key]["value"]) for how in ("believed", "as read") for key in KEYS))
        for one in robustness
    )
    caption = (
        "Robustness. Believed: the covariance as stated, whatever the noise is. As read: whole drawn records go "
        "through the reading of `diagnose`, which checks the noise before contact, finds correlation and leaves "
        "outliers out."
    )
    return Table(head, rows, caption, frozenset(range(1, 7)))


def _experiments(experiments: Sequence[Mapping[str, Any]]) -> Table:
    head = (
        "experiment",
        "planted",
        "signal",
        "shown",
        "answer",
        "confidence set (first five)",
        "strikes",
        "truth in set",
        "unasked",
    )
    rows = tuple(
        (
            one["experiment"],
            _planted(one["planted"]) or one["kind"],
            ", ".join(f"{value:.1f}" for value in one["signals"].values()) or "–",
            f"{one['shown']:.1f}",
            one["verdict"].replace("_", " "),
            ", ".join(one["confidence_set"][:5]) or "–",
            str(one["strikes"]),
            f"{one['in_set']:.2f}",
            f"{one['unasked']:.2f}",
        )
        for one in experiments
    )
    caption = (
        "Every experiment: the answer to the record as it stands and the strikes that it took; the last two columns "
        "over the noise draws: the truth in the set, and sets with an effect in them that the solver was not asked "
        "about."
    )
    return Table(head, rows, caption, frozenset({2, 3, 6, 7, 8}))


def _planted(planted: Mapping[str, float] | str) -> str:
    if isinstance(planted, str):
        return planted
    return ", ".join(f"{name} {shown(effects()[name], value)}" for name, value in planted.items())


def words(content: Mapping[str, Any]) -> str:
    """How the audit was made, in sentences."""
    asked = (
        "Each record was diagnosed as `birdstrike diagnose` does it, the solver asked about the models that matter; "
        "draws of the noise carry its corrections, and effects that a draw alone brings near the set are answered by "
        "emulator and learnt responses."
        if content["confirmed"]
        else "Quick: the solver was asked about no model (--no-confirm), which `birdstrike diagnose` never does."
    )
    return (
        f"{asked} {content['draws']} draws of the noise on each curve, {content['read']} whole records of each kind "
        f"of noise; solver {content['solver_version']}."
    )


def in_markdown(table: Table) -> Iterator[str]:
    """Lines of a table in Markdown."""
    yield f"| {' | '.join(table.head)} |"
    yield f"|{'---|' * len(table.head)}"
    yield from (f"| {' | '.join(row)} |" for row in table.rows)


def write_audit_page(folder: str | Path) -> Path:
    """Write `audit.html` beside audit.json; its path. Raises UserError where there is no audit."""
    place = Path(folder)
    path = place / "audit.json"
    if not path.is_file():
        raise UserError(f"no audit.json in {place}; make it with: birdstrike audit --out {place}")
    content = json.loads(path.read_text(encoding="utf-8"))
    write_atomically(place / "audit.html", page(content))
    return place / "audit.html"


def page(content: Mapping[str, Any]) -> str:
    """The page as HTML text; nothing in it points outside."""
    return rendered(
        title="Audit of the diagnosis",
        subtitle=f"Planted experiments, simulated on finer meshes than the diagnosed ones. {words(content)}",
        sections=[
            section(i, name, entry, content["alpha"]) for i, (name, entry) in enumerate(content["tables"].items())
        ],
    )


def section(number: int, name: str, entry: Mapping[str, Any], alpha: float) -> Section:
    """All of one number of channels."""
    intro = (
        f"{entry['curves']} curves. Rates are means over curves of the share of noise draws. Two intervals, both over "
        "curves: by bootstrap, which is too narrow over a handful of them, and Clopper and Pearson's of the nearest "
        "whole number of curves, which is wide; a gate on an interval takes the wider. Missed gates are shown."
    )
    found = tables(entry)
    confusion = drawing(
        f"confusion-{number}", confusion_figure(entry["confusion"]), "What was planted and what was answered."
    )
    blocks: list[Block] = [Paragraph(intro), found.pop("gates"), confusion]
    if entry["power"]:
        caption = (
            "Power against the size of the effect that makes the signal at the stated noise, one panel an effect; "
            "dots: signals of 2 to 6, reached by scaling the noise; the upright line: the size that was planted."
        )
        blocks.append(drawing(f"power-{number}", power_figure(entry["power"], alpha), caption))
    return Section(f"table-{number}", f"Records of {name}", (*blocks, *found.values()))


def audit_markdown(content: Mapping[str, Any]) -> str:
    """Gates, power, robustness, the emulator's own truths and every experiment as tables."""
    return "\n".join(_lines(content)) + "\n"


def _lines(content: Mapping[str, Any]) -> Iterator[str]:
    yield words(content)
    for name, entry in content["tables"].items():
        yield f"\n## Records of {name}: {entry['curves']} curves"
        for table in tables(entry).values():
            yield f"\n{table.caption}\n"
            yield from in_markdown(table)
