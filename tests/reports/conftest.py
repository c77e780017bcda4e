"""Two finished loops around the stand-in, made once: one on a measured record, one on a simulated one."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.data.curves import Measured, write_measured
from birdstrike.doe.campaign.campaign import run_campaign
from birdstrike.doe.designs.registry import make_design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.doe.external.external import simulate_external
from birdstrike.reports.page.page import report
from birdstrike.reports.results.reading import read_results
from birdstrike.reports.results.results import Results
from tests.doe.external_case import oscillator
from tests.reports.synthetic import finished_folder, stand_in_for_models, write_record

CHANNEL = "displacement_centre"


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


@pytest.fixture(scope="session")
def external_loop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Campaign `doe` and `inversion` of a case that the oscillator simulates: another program than birdstrike."""
    folder = tmp_path_factory.mktemp("external")
    case = oscillator(folder / "case")
    design = make_design("lhs", ParameterSpace.of(case.parameters()), 8)
    with ThreadPoolExecutor(2) as executor:
        run_campaign(case, design, folder / "doe", workers=2, executor=executor, say=lambda _: None)
    run = simulate_external(case)
    sigma = {CHANNEL: np.full(len(run.time), 1e-5)}
    write_measured(folder / "shot.csv", Measured(run.time, run.channels, sigma, run.units, ("SIMULATED by hand",)))
    line = ["train-and-invert", str(folder / "doe"), "--measured", str(folder / "shot.csv"), "--method", "emulator"]
    made = CliRunner().invoke(app, [*line, "--refine", "0", "--out", str(folder / "inversion")])
    assert made.exit_code == 0, made.output
    return folder
