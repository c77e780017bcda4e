"""The page of an audit: gates, confusion matrix, power, robustness, every experiment."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from data.errors import UserError
from data.files import write_atomically
from reports.blocks import Paragraph, Section, Table, drawing
from reports.figures.audit import confusion_figure, power_figure
from reports.render import rendered
from solver.case_effects import shown
from solver.effects import effects


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
    sections = [section(i, name, entry, content["alpha"]) for i, (name, entry) in enumerate(content["tables"].items())]
    return rendered(
        title="Audit of the diagnosis",
        subtitle=f"Planted experiments, simulated on finer meshes than the diagnosed ones; {content['draws']} draws of "
        f"the noise on each curve; solver {content['solver_version']}.",
        sections=sections,
    )


def section(number: int, name: str, entry: Mapping[str, Any], alpha: float) -> Section:
    """All of one number of channels."""
    words = (
        f"{entry['curves']} curves. Rates are means over curves of the share of noise draws; intervals by bootstrap "
        "over curves. Missed gates are shown."
    )
    blocks = [Paragraph(words), _gates(entry)]
    confusion = confusion_figure(entry["confusion"])
    blocks.append(drawing(f"confusion-{number}", confusion, "What was planted and what was answered."))
    if entry["power"]:
        power = power_figure(entry["power"], alpha)
        blocks += [drawing(f"power-{number}", power, "Power against the planted effect's signal."), _magnitudes(entry)]
    return Section(f"table-{number}", f"Records of {name}", (*blocks, _robustness(entry), _experiments(entry)))


def gate_rows(entry: Mapping[str, Any]) -> tuple[tuple[str, ...], ...]:
    """The gates as cells."""
    return tuple(
        (
            gate["figure"],
            "–" if gate["value"] is None else f"{gate['value']:.3f}",
            "–" if gate["interval_95"] is None else "{:.3f} to {:.3f}".format(*gate["interval_95"]),
            str(gate["curves"]),
            gate["gate"],
            {None: "–", True: "yes", False: "no"}[gate["met"]],
        )
        for gate in entry["gates"]
    )


def _gates(entry: Mapping[str, Any]) -> Table:
    head = ("figure", "value", "95 % interval", "curves", "gate", "met")
    return Table(head, gate_rows(entry), "The gates.", frozenset({1, 3}))


def _magnitudes(entry: Mapping[str, Any]) -> Table:
    """Physical size of each planted effect at which power was asked."""
    rows = tuple(
        (one["effect"], f"{one['signal']:g}", shown(effects()[one["effect"]], one["magnitude"]), f"{one['power']:.2f}")
        for one in entry["power"]
        if one["signal"] in (4.0, 5.0)
    )
    caption = "Power at a signal of 4 and 5, with the magnitude that makes it at the stated noise on that curve."
    return Table(("effect", "signal", "magnitude", "power"), rows, caption, frozenset({1, 3}))


KEYS = ("false alarms", "truth in the set", "unique and wrong")


def robustness_rows(entry: Mapping[str, Any]) -> tuple[tuple[str, ...], ...]:
    """Rates under each kind of noise as cells."""
    return tuple((one["noise"], *(_share(one[key]["value"]) for key in KEYS)) for one in entry["robustness"])


def _robustness(entry: Mapping[str, Any]) -> Table:
    caption = "The same with noise other than stated, the check of the record before contact left out."
    return Table(("noise", *KEYS), robustness_rows(entry), caption, frozenset({1, 2, 3}))


def _share(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"


def experiment_rows(entry: Mapping[str, Any]) -> tuple[tuple[str, ...], ...]:
    """Every experiment as cells."""
    return tuple(
        (
            one["experiment"],
            _planted(one["planted"]) or one["kind"],
            ", ".join(f"{value:.1f}" for value in one["signals"].values()) or "–",
            one["verdict"].replace("_", " "),
            ", ".join(one["confidence_set"][:5]) or "–",
            f"{one['in_set']:.2f}",
        )
        for one in entry["experiments"]
    )


def _experiments(entry: Mapping[str, Any]) -> Table:
    head = ("experiment", "planted", "signal", "answer to the record", "confidence set (first five)", "truth in set")
    return Table(
        head, experiment_rows(entry), "Every experiment; the last column over the noise draws.", frozenset({2, 5})
    )


def _planted(planted: Mapping[str, float] | str) -> str:
    if isinstance(planted, str):
        return planted
    return ", ".join(f"{name} {shown(effects()[name], value)}" for name, value in planted.items())
