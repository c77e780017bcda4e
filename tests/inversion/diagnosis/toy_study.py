"""A case made ready for a diagnosis without a strike: analytic curves of two parameters, drift and gain as effects."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.groundwork import Groundwork
from birdstrike.inversion.diagnosis.judge import Judge
from birdstrike.inversion.diagnosis.model import Clock
from birdstrike.inversion.diagnosis.numerical import Numerical
from birdstrike.inversion.diagnosis.record import read_record
from birdstrike.inversion.diagnosis.responses import library
from birdstrike.inversion.estimation.coordinates import parameter_coordinates
from birdstrike.inversion.observations.reader import Expected
from birdstrike.solver.case.case import load_case
from birdstrike.surrogate.emulator import fit_emulator
from tests.inversion.diagnosis.test_diagnose import CASE

TIME = np.linspace(0.0, 1e-3, 101)
NAMES: tuple[str, ...] = ("bird.material.viscosity", "bird.material.eos.c0")
LOWS, HIGHS = np.array([0.0, 1000.0]), np.array([800.0, 1800.0])
SIZE = 5e-3
SCATTER = 2e-5  # of a run, which no parameter explains
EFFECTS = ("sensor_drift", "sensor_gain", "sensor_bandwidth")


def curves(unit: Array, channels: int = 1) -> list[Array]:
    """Per channel (n, m) curves of parameters (n, 2) in 0..1."""
    t = TIME / TIME[-1]
    shapes = [np.sin(np.pi * t * (1.0 + 0.1 * c)) for c in range(channels)]
    late = np.maximum(t - 0.4, 0.0)
    return [SIZE * ((1.0 + 0.2 * unit[:, :1]) * shape + 0.5 * unit[:, 1:] * late) for shape in shapes]


def groundwork(folder: Path, channels: int = 1, scatter: float = SCATTER) -> Groundwork:
    """Emulator of noisy runs; no numerical error beyond the plain scatter."""
    declared = CASE.split("[inversion.nuisance]")[0].replace('kind = "strain"', 'kind = "displacement"')
    (folder / "case.toml").write_text(declared + third(channels))
    case = load_case(folder / "case.toml")
    names = tuple(case.sensors)[:channels]
    rng = np.random.default_rng(0)
    unit = rng.random((16, 2))
    found = {
        name: y + scatter * rng.standard_normal(y.shape) for name, y in zip(names, curves(unit, channels), strict=True)
    }
    runs, smooth, units = np.arange(1, 17), np.ones(16, dtype=bool), dict.fromkeys(names, "m")
    theta = LOWS + unit * (HIGHS - LOWS)
    data = Dataset(NAMES, ("Pa s", "m/s"), LOWS, HIGHS, runs, theta, TIME, found, units, smooth, "")
    emulator = fit_emulator(data, names)
    known = tuple(one for one in library(case)[0] if one.name in EFFECTS)
    clock = Clock(TIME, names)
    none = np.zeros((0, channels * len(TIME)))
    numerical = Numerical(none, none, {}, channels, float(TIME[1] - TIME[0]))
    middle = dict(zip(NAMES, 0.5 * (LOWS + HIGHS), strict=True))
    coordinates = parameter_coordinates(data, emulator.regions)
    return Groundwork(case, case, data, emulator, coordinates, clock, known, {}, {}, numerical, middle, {})


def third(channels: int) -> str:
    """A third sensor where one is asked for."""
    return '[sensors.side]\nkind = "displacement"\nat = ["0 mm", "40 mm"]\n' if channels > 2 else ""


def judge(ground: Groundwork, values: list[Array], noise: float, tolerance: float | None = None) -> Judge:
    """Of a record with the channels' values (n,), its noise stated in the file, if above 0, or as a tolerance."""
    names = ground.clock.channels
    stated = {name: np.full(len(TIME), noise) for name in names} if noise else {}
    measured = Measured(TIME, dict(zip(names, values, strict=True)), stated, dict.fromkeys(names, "m"))
    record = read_record(measured, Expected(dict.fromkeys(names, "m"), 0.0, float(TIME[-1]), -1.0), tolerance)
    return Judge.of(ground, record)
