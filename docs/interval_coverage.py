"""How often the calibration's 95 % intervals hold truths that the solver made: docs/interval_coverage.md.

python docs/interval_coverage.py --runs FOLDER [--truths 200] [--out docs/interval_coverage.md]

The case is synthetic_strike, coarser: 300 particles, 10 x 8 shells, 2.2 ms, three parameters; record and model share
the mesh. Truths are drawn uniformly in the ranges; each is inverted with one of four designs of every size, in turn.
FOLDER keeps the simulations (532 of 1 s each) and is not part of the repository. Intervals are those of the
posterior (importance sampling of the same likelihood that train-and-invert samples), the clocks are the same, the
noise's size is known, and no run is added.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.files import write_atomically
from birdstrike.data.histories import Array, Histories
from birdstrike.data.store import RunStore
from birdstrike.doe.designs.registry import make_design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.estimation.calibration import Calibrator, Mode
from birdstrike.inversion.estimation.coordinates import parameter_coordinates
from birdstrike.inversion.estimation.curve_model import CurveModel
from birdstrike.inversion.estimation.estimates import NEWS
from birdstrike.inversion.estimation.likelihood import Likelihood
from birdstrike.inversion.forward import Forward, StoredSolver
from birdstrike.inversion.observations.observations import Observations, observe
from birdstrike.solver.case.case import Case, case_hash, load_case
from birdstrike.surrogate.emulator import Emulator, fit_emulator
from birdstrike.surrogate.features import covered

NAMES = ("bird.material.pressure_cutoff", "bird.material.viscosity", "bird.density")
COARSE = {"bird.particles": "300", "plate.elements": "[10, 8]", "time.end": "2.2 ms"}
DESIGNS = (("uniform", 0), ("lhs", 1), ("lhs", 2), ("sobol", 3))
SIZES, POINTS, CHANNELS, NOISES = (9, 25, 49), (12, 500), (1, 3), (0.02e-3, 0.1e-3)
FIRST = 0.1  # of the record: before it nothing moves
TRUTHS_SEED = 2026
DRAWS, ROUNDS, HEAVY = 2048, 5, 5.0
ENOUGH = 300.0  # effective draws


@dataclass(frozen=True)
class Cell:
    """Runs of a campaign, points a channel, channels, noise [m] of the first (others in proportion to their peaks)."""

    runs: int
    points: int
    channels: int
    noise: float


@dataclass(frozen=True)
class Held:
    """z: (k,) the truth; interval: (k, 2) of the posterior, in shares of the ranges; prior: (k,) its width before."""

    z: Array
    interval: Array
    prior: Array

    @property
    def identified(self) -> NDArray[np.bool_]:
        """(k,) bool, by the rule of an inversion."""
        return np.ptp(self.interval, axis=1) < NEWS * self.prior

    @property
    def holds(self) -> NDArray[np.bool_]:
        """(k,) bool."""
        return (self.interval[:, 0] <= self.z) & (self.z <= self.interval[:, 1])


def coarse_case() -> tuple[Case, ParameterSpace]:
    """The case, and the three parameters that are sought."""
    case = load_case("synthetic_strike", COARSE)
    return case, ParameterSpace.of(tuple(p for p in case.parameters() if p.name in NAMES))


def campaign(case: Case, space: ParameterSpace, unit: Array, forward: Forward) -> Dataset:
    """The runs at fractions unit (n, k) of the ranges."""
    values = space.to_physical(unit)
    found = [forward(dict(zip(space.names, map(float, row), strict=True))) for row in values]
    wanted = {p.name: p for p in case.parameters()}
    return Dataset(
        names=space.names,
        units=tuple(wanted[name].unit for name in space.names),
        lows=np.array([wanted[name].low for name in space.names]),
        highs=np.array([wanted[name].high for name in space.names]),
        runs=np.arange(1, len(unit) + 1),
        parameters=values,
        time=found[0].time,
        curves={name: np.stack([run.channels[name] for run in found]) for name in case.sensors},
        channel_units={name: found[0].units[name] for name in case.sensors},
        smooth=np.ones(len(unit), dtype=bool),
        case_hash=case_hash(case),
    )


def record(dataset: Dataset, truth: Histories, cell: Cell, seed: int) -> Observations:
    """A truth's curves with the noise of a cell."""
    rng, names = np.random.default_rng(seed), list(dataset.curves)[: cell.channels]
    times = np.linspace(FIRST * dataset.time[-1], dataset.time[-1], cell.points)
    peaks = {name: float(np.abs(dataset.curves[name]).max()) for name in names}
    sizes = {name: cell.noise * peak / peaks[names[0]] for name, peak in peaks.items()}
    values = {name: truth.at(name, times) + sizes[name] * rng.normal(size=len(times)) for name in names}
    sigma = {name: np.full(len(times), size) for name, size in sizes.items()}
    units = {name: dataset.channel_units[name] for name in names}
    return observe(Measured(times, values, sigma, units, ("SIMULATED by birdstrike",), "coverage"), dataset, {})


def interval(calibrator: Calibrator, seed: int) -> Array:
    """(k, 2) central 95 % of the posterior, by adaptive importance sampling from the prior on."""
    k = len(calibrator.coordinates.names)
    box = calibrator.coordinates.boxes[0]
    start = Mode(np.full(k, 0.5), box.theta_lows, 0.0, np.eye(k + 1), 0.0, np.zeros(0), box)
    density, rng = Likelihood.of(calibrator, (start,)), np.random.default_rng(seed)
    z = box.lows + qmc.Sobol(k, rng=rng).random(DRAWS) * (box.highs - box.lows)
    log_weights = density.log_posterior(np.column_stack([z, np.zeros(len(z))]))
    for turn in range(ROUNDS):
        weights, power = tempered(log_weights, 40.0)
        if turn > 1 and power == 1.0 and 1.0 / (weights**2).sum() > ENOUGH:
            break
        centre = weights @ z
        factor = np.linalg.cholesky(1.3 * np.cov(z.T, aweights=weights) + 1e-12 * np.eye(k))
        scale = np.sqrt(rng.chisquare(HEAVY, DRAWS) / HEAVY)[:, None]
        drawn = centre + (rng.normal(size=(DRAWS, k)) / scale) @ factor.T
        z = drawn[((drawn >= box.lows) & (drawn <= box.highs)).all(axis=1)]
        away = np.linalg.solve(factor, (z - centre).T)
        proposed = -0.5 * (HEAVY + k) * np.log1p((away**2).sum(axis=0) / HEAVY)
        log_weights = density.log_posterior(np.column_stack([z, np.zeros(len(z))])) - proposed
    weights, _ = tempered(log_weights, 1.0)
    return np.stack([quantiles(z[:, i], weights) for i in range(k)])


def tempered(log_weights: Array, least: float) -> tuple[Array, float]:
    """Normalised weights, flattened by a power until they are worth `least` draws; the power."""
    power = 1.0
    while True:
        weights = np.exp(power * (log_weights - log_weights.max()))
        weights /= weights.sum()
        if 1.0 / (weights**2).sum() >= least or power < 1e-4:
            return weights, power
        power *= 0.6


def quantiles(values: Array, weights: Array) -> Array:
    """The 2.5 and 97.5 % points of weighted draws."""
    order = np.argsort(values)
    return np.interp([0.025, 0.975], np.cumsum(weights[order]), values[order])


def held(
    dataset: Dataset, emulator: Emulator, truths: Sequence[tuple[int, Array, Histories]], cell: Cell
) -> list[Held]:
    """The intervals of the truths where runs stand behind the emulator."""
    coordinates, found = parameter_coordinates(dataset, emulator.regions), list[Held]()
    for number, z, histories in truths:
        theta = dataset.lows + z * (dataset.highs - dataset.lows)
        if covered(emulator.regions, theta[None])[0]:
            model = CurveModel(emulator, record(dataset, histories, cell, number))
            problem = Calibrator(model, coordinates, 0.0)
            found.append(Held(z, interval(problem, number), coordinates.prior_width()))
    return found


def measured(
    folder: Path, truths: int, sizes: Sequence[int], say: Callable[[str], None]
) -> Iterator[tuple[Cell, list[Held]]]:
    """Every cell of the table."""
    case, space = coarse_case()
    folder.mkdir(parents=True, exist_ok=True)
    forward = StoredSolver(case, RunStore(folder))
    z = np.random.default_rng(TRUTHS_SEED).random((truths, len(space.names)))
    made = campaign(case, space, z, forward)
    histories = [
        Histories(made.time, {name: rows[i] for name, rows in made.curves.items()}, dict(made.channel_units))
        for i in range(truths)
    ]
    everything = list(zip(range(truths), z, histories, strict=True))
    for runs in sizes:
        sets: list[tuple[Dataset, Emulator]] = []
        units = [make_design(kind, space, min(runs, 49), seed).unit for kind, seed in DESIGNS]
        for unit in units if runs <= 49 else [np.vstack(units)]:
            data = campaign(case, space, unit, forward)
            sets.append((data, fit_emulator(data, list(data.curves))))
        for channels, points, noise in product(CHANNELS, POINTS, NOISES):
            begun, cell, found = time.process_time(), Cell(runs, points, channels, noise), list[Held]()
            for turn, (data, emulator) in enumerate(sets):
                used = dict(list(emulator.channels.items())[:channels])
                own = replace(emulator, channels=used)
                found += held(data, own, everything[turn :: len(sets)], cell)
            say(f"{row(cell, found)} ({time.process_time() - begun:.0f} s)")
            yield cell, found


HEAD = """| runs | points | channels | noise | truths | identified | hold | lowest of a parameter | all truths | {} |
|---|---|---|---|---|---|---|---|---|{}|"""


def row(cell: Cell, found: Sequence[Held]) -> str:
    """A cell as a row of the table."""
    identified = np.stack([one.identified for one in found])
    holds = np.stack([one.holds for one in found])
    width = np.median([np.ptp(one.interval, axis=1) for one in found], axis=0)
    each = [f"{100 * h[i].mean():.0f}" for h, i in zip(holds.T, identified.T, strict=True) if i.sum() >= 10]
    said = f"{100 * holds[identified].mean():.0f} %" if identified.any() else "–"
    parts = [
        f"{cell.runs}",
        f"{cell.points}",
        f"{cell.channels}",
        f"{cell.noise * 1e3:g} mm",
        f"{len(found)}",
        f"{100 * identified.mean():.0f} %",
        said,
        f"{min(each, key=int)} %" if each else "–",
        f"{100 * holds.mean():.0f} %",
        *(f"{100 * w:.1f} %" for w in width),
    ]
    return "| " + " | ".join(parts) + " |"


def said(text: str) -> None:
    """A line on the terminal, at once."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=Path, required=True, help="folder of the simulations")
    parser.add_argument("--truths", type=int, default=200)
    parser.add_argument(
        "--sizes", type=int, nargs="+", default=[*SIZES, 196], help="196: all four designs of 49 at once"
    )
    parser.add_argument("--out", type=Path)
    chosen = parser.parse_args(arguments)
    rows = [row(*one) for one in measured(chosen.runs, chosen.truths, chosen.sizes, said)]
    names = [name.rsplit(".", 1)[-1].replace("_", " ") for name in NAMES]
    head = HEAD.format(" | ".join(f"width, {name}" for name in names), "|".join("---" for _ in names))
    if chosen.out is not None:
        commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True).stdout.strip()
        command = f"python docs/interval_coverage.py --truths {chosen.truths}"
        made = f"`{command}`, commit {commit or 'unknown'}, {time.strftime('%d %B %Y')}."
        write_atomically(chosen.out, "\n".join([made, "", head, *rows, ""]))


if __name__ == "__main__":
    main(sys.argv[1:])
