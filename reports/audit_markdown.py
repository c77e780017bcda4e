"""The audit as Markdown, for the repository's own pages."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from reports.audit_tables import in_markdown, tables, words


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
