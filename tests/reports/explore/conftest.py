"""A campaign's and an inversion's folder around a formula, their pages, and one browser for all of them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from birdstrike.inversion.train_and_invert import Extras, train_and_invert
from birdstrike.reports.explore.explore import explore
from tests.inversion.small_campaign import build, strike, write_record
from tests.reports.explore.browser import BROWSER, Browser


@pytest.fixture(scope="session")
def loop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with doe/ and inversion/, as close-the-loop leaves it without a diagnosis."""
    folder = tmp_path_factory.mktemp("explored")
    case = build(folder / "doe")
    record = write_record(folder / "shot7.csv")
    train_and_invert(
        folder / "doe",
        record,
        folder / "inversion",
        method="emulator",
        case=case,
        forward=lambda theta: strike(case.with_values(theta)),
        extras=Extras(refine=0, posterior=False),
    )
    return folder


@pytest.fixture(scope="session")
def campaign_page(loop: Path) -> Path:
    """The page of the campaign alone."""
    return explore(loop / "doe")


@pytest.fixture(scope="session")
def page(loop: Path) -> Path:
    """The page of the loop."""
    return explore(loop)


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """One browser for all pages."""
    if not BROWSER:
        pytest.skip("no chromium or google-chrome on the PATH")
    with Browser(tmp_path_factory.mktemp("browser")) as started:
        yield started
