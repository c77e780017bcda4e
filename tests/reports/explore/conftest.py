"""A campaign's and an inversion's folder around a formula, their pages, and one browser for all of them."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from birdstrike.data.curves import Measured, write_measured
from birdstrike.data.histories import Histories
from birdstrike.doe.campaign.campaign import run_campaign
from birdstrike.doe.designs.registry import make_design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.extras import Extras
from birdstrike.inversion.train_and_invert import train_and_invert
from birdstrike.reports.explore.explore import explore
from birdstrike.solver.case.case import Case, case_from_table
from birdstrike.solver.version import SOLVER_VERSION
from tests.inversion.diagnosis.rig import tiny
from tests.reports.explore.browser import BROWSER, Browser

RUNS, NOISE = 16, 2e-5
TIME = np.linspace(0.0, 0.9e-3, 91)


def rig() -> Case:
    """Three parameters: viscosity shapes the curves, by its logarithm; the cutoff hardly, erosion not at all."""
    ranges = {
        "viscosity": ("100 Pa s", "1000 Pa s"),
        "pressure_cutoff": ("-1.2 MPa", "-0.1 MPa"),
        "tension_erosion": (0.4, 1.8),
    }
    sought: dict[str, dict[str, Any]] = {
        f"bird.material.{name}": {"range": list(ends)} for name, ends in ranges.items()
    }
    sought["bird.material.viscosity"]["scale"] = "logarithmic"
    inversion = {"parameters": sought, "nuisance": {"time_offset": "0.01 ms"}}
    return case_from_table({**tiny().table, "inversion": inversion}, "rig")


def strike(case: Case, **_: object) -> Histories:
    """A formula in the solver's place."""
    thick, weak = case.bird.material.viscosity / 1000.0, -case.bird.material.pressure_cutoff / 1.2e6
    pulse = np.sin(np.pi * np.clip(TIME / (0.7e-3 + 0.3e-3 * thick), 0.0, 1.0)) ** 2
    centre = (5.0e-3 - 1.5e-3 * thick + 3e-6 * weak) * pulse
    channels = {"displacement_centre": centre, "displacement_side": (0.5 + 0.1 * thick**2) * centre}
    return Histories(TIME, channels, dict.fromkeys(channels, "m"), {"eroded_mass_fraction": 0.0})


def write_record(path: Path) -> Path:
    """What instruments would have seen at 400 Pa s."""
    found, rng = strike(rig().with_values({"bird.material.viscosity": 400.0})), np.random.default_rng(0)
    values = {name: curve[::2] + NOISE * rng.normal(size=46) for name, curve in found.channels.items()}
    write_measured(path, Measured(TIME[::2], values, {}, dict.fromkeys(values, "m"), ("SIMULATED by a formula",)))
    return path


@pytest.fixture(scope="session")
def loop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with doe/ and inversion/, as close-the-loop leaves it without a diagnosis."""
    folder = tmp_path_factory.mktemp("explored")
    case = rig()
    design = make_design("lhs", ParameterSpace.of(case.parameters()), RUNS, 0)
    with ThreadPoolExecutor(1) as pool:
        run_campaign(
            case,
            design,
            folder / "doe",
            workers=1,
            simulate=strike,
            solver_version=SOLVER_VERSION,
            executor=pool,
            say=lambda _: None,
        )
    inverted(folder, write_record(folder / "shot7.csv"), folder / "inversion")
    return folder


def inverted(loop: Path, record: Path, out: Path) -> Path:
    """The folder of an inversion of a record by the campaign in `loop/doe`."""
    case = rig()
    train_and_invert(
        loop / "doe",
        record,
        out,
        method="emulator",
        case=case,
        forward=lambda theta: strike(case.with_values(theta)),
        extras=Extras(refine=0, posterior=False),
    )
    return out


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
