"""Wrong cases and what is said of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from birdstrike.data.errors import CaseError
from birdstrike.solver.case.case import load_case


def errors_with(settings: dict[str, str]) -> list[str]:
    """All that is said of the reference strike with these settings."""
    with pytest.raises(CaseError) as caught:
        load_case("reference_strike", settings)
    return caught.value.errors


def written(folder: Path, name: str, text: str) -> Path:
    """A case file of this text."""
    path = folder / f"{name}.toml"
    path.write_text(text)
    return path
