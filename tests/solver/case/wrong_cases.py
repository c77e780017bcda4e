"""Wrong cases and what is said of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from birdstrike.data.errors import CaseError
from birdstrike.solver.case.case import load_case


def errors_with(settings: dict[str, str]) -> list[str]:
    """All that is said of the reference strike with these settings."""
    with pytest.raises(CaseError) as caught:
        load_case("reference_strike", settings)
    return caught.value.errors


def raised(action: Callable[[], object]) -> Exception | None:
    """What an action ends with, if not well."""
    try:
        action()
    except Exception as error:  # whatever it is: the test says what it should be
        return error
    return None


def written(folder: Path, name: str, text: str) -> Path:
    """A case file of this text."""
    path = folder / f"{name}.toml"
    path.write_text(text)
    return path
