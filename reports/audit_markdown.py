"""The audit as Markdown, for the repository's own pages."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from reports.audit import experiment_rows, gate_rows, robustness_rows


def audit_markdown(content: Mapping[str, Any]) -> str:
    """Gates, robustness and every experiment as tables."""
    return "\n".join(_lines(content)) + "\n"


def _lines(content: Mapping[str, Any]) -> Iterator[str]:
    asked = (
        "the solver confirmed each record's models" if content["confirmed"] else "emulator and learnt responses only"
    )
    yield f"Solver {content['solver_version']}; {content['draws']} draws of the noise on each curve; {asked}."
    for name, entry in content["tables"].items():
        yield f"\n## Records of {name}: {entry['curves']} curves\n"
        yield from _table(("figure", "value", "95 % interval", "curves", "gate", "met"), gate_rows(entry))
        yield "\nThe same with noise other than stated, without the check of the record before contact:\n"
        yield from _table(("noise", "false alarms", "truth in the set", "unique and wrong"), robustness_rows(entry))
        yield "\nEvery experiment (answer to the record as it stands; last column over the noise draws):\n"
        head = ("experiment", "planted", "signal", "answer", "confidence set (first five)", "truth in set")
        yield from _table(head, experiment_rows(entry))


def _table(head: tuple[str, ...], rows: tuple[tuple[str, ...], ...]) -> Iterator[str]:
    yield f"| {' | '.join(head)} |"
    yield f"|{'---|' * len(head)}"
    yield from (f"| {' | '.join(row)} |" for row in rows)
