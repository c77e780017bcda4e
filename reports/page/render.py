"""The template of every page, filled; nothing in a page points outside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime

from birdstrike.reports.blocks import Section
from birdstrike.reports.sections.reproducibility import installed
from birdstrike.reports.template import page_template


def rendered(
    title: str,
    subtitle: str,
    sections: Sequence[Section],
    switches: Sequence[Mapping[str, str]] = (),
    simulated: str = "",
    beside: str = "",
) -> str:
    """HTML text of a page; switches: of the curves that its figures can hide; simulated: which of these curves are,
    in words; beside: the file of `explore`."""
    version = installed("birdstrike")
    return page_template("birdstrike.reports.page", ".", "template.html.j2").render(
        title=title,
        subtitle=subtitle,
        sections=sections,
        switches=switches,
        simulated=simulated,
        beside=beside,
        version=version,
        footer=f"Written by birdstrike {version} on {datetime.now(UTC):%Y-%m-%d %H:%M} UTC.",
    )
