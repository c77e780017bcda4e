"""Two finished loops around the stand-in, made once: one on a measured record, one on a simulated one."""

from __future__ import annotations

from pathlib import Path

import pytest

from birdstrike.reports.page.page import report
from birdstrike.reports.results.reading import read_results
from birdstrike.reports.results.results import Results
from tests.reports.synthetic import finished_folder, stand_in_for_models, write_record


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A loop on a record that the stand-in can produce."""
    folder = tmp_path_factory.mktemp("measured")
    with pytest.MonkeyPatch.context() as patch:
        return finished_folder(folder, write_record(folder / "shot7.csv"), patch)


@pytest.fixture(scope="session")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A loop on LS-DYNA's curve, which lies outside all strikes of the stand-in."""
    with pytest.MonkeyPatch.context() as patch:
        return finished_folder(tmp_path_factory.mktemp("simulated"), Path("table7_group5"), patch)


def page_of(folder: Path) -> Path:
    """The page of a folder with all bird models, few instants in motion."""
    with pytest.MonkeyPatch.context() as patch:
        stand_in_for_models(patch)
        return report(folder)


@pytest.fixture(scope="session")
def results(finished: Path) -> Results:
    """What is read from the first loop."""
    return read_results(finished)


@pytest.fixture(scope="session")
def page(finished: Path) -> Path:
    """The first loop's page, the standard birds simulated by the stand-in."""
    return page_of(finished)


@pytest.fixture(scope="session")
def simulated_page(simulated: Path) -> Path:
    """The second loop's page, with the inverted bird alone."""
    return report(simulated, models=False)
