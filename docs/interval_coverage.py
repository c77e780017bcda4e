"""How often the calibration's 95 % intervals hold truths that the solver made: the table of docs/inversion.md.

python docs/interval_coverage.py --runs FOLDER [--parts plain refined finer uncorrected] [--sizes 9 25 49 196]
    [--points 12 500] [--channels 1 3] [--noises 2e-5 1e-4] [--truths 200] [--step 1] [--out TABLE.md]

The case is synthetic_strike, much coarser: 150 particles, 8 x 6 shells, 1.5 ms, three parameters. Truths are drawn
uniformly in the ranges; each is inverted with one of four designs of every size, in turn (196 runs: all four designs
of 49 at once). Intervals are those of the posterior (importance sampling of the same likelihood that train-and-invert
samples), the clocks are the same, the noise's size is known.

plain: record and campaign share the mesh, no run is added; refined: the same after --refine auto; finer: records of 8
times the particles and twice the shells a side, the campaign corrected by --mesh-correction; uncorrected: the same
records without it.

FOLDER keeps the simulations and, in intervals.csv, every interval: the same call resumes, and the table is made from
all that is there. It is no part of the repository.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import qmc
from threadpoolctl import threadpool_limits

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.histories import Array, Histories
from birdstrike.data.storage.files import write_atomically
from birdstrike.data.storage.store import RunStore
from birdstrike.doe.designs.registry import make_design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.estimation.calibration import Calibrator, Mode
from birdstrike.inversion.estimation.coordinates import parameter_coordinates
from birdstrike.inversion.estimation.curve_model import CurveModel
from birdstrike.inversion.estimation.known_errors import error_columns
from birdstrike.inversion.estimation.likelihood import Likelihood
from birdstrike.inversion.estimation.locate import InversionOptions
from birdstrike.inversion.estimation.mesh_correction import CorrectedCampaign, correct_campaign, fine_mesh
from birdstrike.inversion.estimation.prior import identified
from birdstrike.inversion.estimation.refinement import AUTO, refine
from birdstrike.inversion.forward import Forward, StoredSolver
from birdstrike.inversion.observations.observations import observe
from birdstrike.solver.case.case import Case, case_hash, load_case
from birdstrike.surrogate.emulator import Emulator, fit_emulator
from birdstrike.surrogate.features import covered

NAMES = ("bird.material.pressure_cutoff", "bird.material.viscosity", "bird.density")
COARSE = {"bird.particles": "150", "plate.elements": "[8, 6]", "time.end": "1.5 ms"}
DESIGNS = (("uniform", 0), ("lhs", 1), ("lhs", 2), ("sobol", 3))
PARTS = ("plain", "refined", "finer", "uncorrected")
SIZES, POINTS, CHANNELS, NOISES = (9, 25, 49, 196), (12, 500), (1, 3), (0.02e-3, 0.1e-3)
LARGEST = 49  # runs of a design; 196: all four at once
FEWEST = 10  # intervals behind a parameter's own share
FIRST = 0.1  # of the record: before it nothing moves
TRUTHS_SEED = 2026
DRAWS, ROUNDS, HEAVY = 1024, 5, 5.0
ENOUGH = 300.0  # effective draws
KEY = ["part", "runs", "points", "channels", "noise", "truth"]


@dataclass(frozen=True)
class Cell:
    """Runs of a campaign, points a channel, channels, noise [m] of the first (others in proportion to their peaks)."""

    runs: int
    points: int
    channels: int
    noise: float


@dataclass(frozen=True)
class Model:
    """A campaign with its emulator; corrected: for the fine mesh, None where it is not."""

    dataset: Dataset
    emulator: Emulator
    corrected: CorrectedCampaign | None = None


@dataclass(frozen=True)
class Interval:
    """z: (k,) the truth; interval: (k, 2) of the posterior, in shares of the ranges; prior: (k,) its width before."""

    z: Array
    interval: Array
    prior: Array
    added: int = 0


class Bench:
    """The case on both meshes, its truths and campaigns, simulated when they are asked for and kept in a folder."""

    def __init__(self, folder: Path) -> None:
        self.case = load_case("synthetic_strike", COARSE)
        self.fine = fine_mesh(self.case, self.case)
        self.space = ParameterSpace.of(tuple(p for p in self.case.parameters() if p.name in NAMES))
        folder.mkdir(parents=True, exist_ok=True)
        self.store = RunStore(folder)
        self.model = lru_cache(16)(self._model)
        self.campaign = lru_cache(16)(self._campaign)
        self.widening = lru_cache(None)(self._widening)

    def forward(self, fine: bool) -> Forward:
        """The solver on one of the meshes."""
        return StoredSolver(self.fine if fine else self.case, self.store)

    def truth(self, number: int, fine: bool) -> tuple[Array, Histories]:
        """(k,) fractions of the ranges of a truth, and its curves."""
        z = np.random.default_rng(TRUTHS_SEED).random((number + 1, len(NAMES)))[-1]
        values = self.space.to_physical(z[None])[0]
        return z, self.forward(fine)(dict(zip(NAMES, map(float, values), strict=True)))

    def _campaign(self, runs: int, turn: int) -> Dataset:
        """One of the designs of a size, all four at once beyond the largest."""
        units = [make_design(kind, self.space, min(runs, LARGEST), seed).unit for kind, seed in DESIGNS]
        return campaign(
            self.case, self.space, units[turn] if runs <= LARGEST else np.vstack(units), self.forward(False)
        )

    def _model(self, runs: int, turn: int, channels: int, corrected: bool) -> Model:
        """The campaign's emulator for its first channels."""
        dataset = self.campaign(runs, turn)
        names = [*dataset.curves][:channels]
        found = None
        if corrected:
            found = correct_campaign(dataset, self.forward(True), self.fine, names, lambda _: None)
            dataset = found.dataset
        return Model(dataset, fit_emulator(dataset, names), found)

    def _widening(self, cell: Cell, turn: int) -> float:
        """Of the mesh correction, the same for every record at the cell's instants."""
        model = self.model(cell.runs, turn, cell.channels, True)
        if model.corrected is None:
            raise AssertionError("a corrected model was asked for")
        measured = record(model.dataset, self.truth(turn, True)[1], cell, turn)
        return model.corrected.widening(observe(measured, model.dataset, {}), 0.0)

    def interval(self, part: str, cell: Cell, number: int) -> Interval | None:
        """Of one truth, in one of the designs; None where no runs stand behind the emulator."""
        model = self.model(cell.runs, number % len(DESIGNS), cell.channels, part == "finer")
        z, histories = self.truth(number, part in ("finer", "uncorrected"))
        dataset, emulator, added = model.dataset, model.emulator, 0
        if not covered(emulator.regions, self.space.to_physical(z[None]))[0]:
            return None
        measured = record(dataset, histories, cell, number)
        if part == "refined":
            options = InversionOptions(method="emulator", sampling=None, analyse=False)
            dataset, figures = refine(dataset, measured, self.forward(False), options, AUTO)
            added = len(figures.added)
            emulator = fit_emulator(dataset, [*measured.channels]) if added else emulator
        observations = observe(measured, dataset, {})
        coordinates = parameter_coordinates(dataset, emulator.regions)
        known = error_columns(emulator, dataset, observations)
        problem = Calibrator(CurveModel(emulator, observations, known if known.size else None), coordinates, 0.0)
        middle, found = posterior(problem, number)
        if model.corrected is not None:
            widening = self.widening(cell, number % len(DESIGNS))
            columns = model.corrected.columns(observations, at(problem, middle), widening)
            problem = replace(problem, model=replace(problem.model, known=np.hstack([known, columns])))
            _, found = posterior(problem, number)
        return Interval(z, found, coordinates.prior.width(), added)


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


def record(dataset: Dataset, truth: Histories, cell: Cell, seed: int) -> Measured:
    """A truth's curves with the noise of a cell."""
    rng, names = np.random.default_rng(seed), [*dataset.curves][: cell.channels]
    times = np.linspace(FIRST * dataset.time[-1], dataset.time[-1], cell.points)
    peaks = {name: float(np.abs(dataset.curves[name]).max()) for name in names}
    sizes = {name: cell.noise * peak / peaks[names[0]] for name, peak in peaks.items()}
    values = {name: truth.at(name, times) + sizes[name] * rng.normal(size=len(times)) for name in names}
    sigma = {name: np.full(len(times), size) for name, size in sizes.items()}
    units = {name: dataset.channel_units[name] for name in names}
    return Measured(times, values, sigma, units, ("SIMULATED by birdstrike",), "coverage")


def at(calibrator: Calibrator, z: Array) -> Mode:
    """A fit at z (k,) with the clocks the same."""
    k, box = len(z), calibrator.coordinates.boxes[0]
    return Mode(z, calibrator.coordinates.theta(z, box), 0.0, np.eye(k + 1), 0.0, np.zeros(0), box)


def posterior(calibrator: Calibrator, seed: int) -> tuple[Array, Array]:
    """(k,) mean and (k, 2) central 95 % of the posterior, by adaptive importance sampling from the prior on."""
    k, box = len(calibrator.coordinates.names), calibrator.coordinates.boxes[0]
    density = Likelihood.of(calibrator, (at(calibrator, np.full(k, 0.5)),))
    rng = np.random.default_rng(seed)
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
    return weights @ z, np.stack([quantiles(z[:, i], weights) for i in range(k)])


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


def fill(bench: Bench, table: Path, part: str, cells: Sequence[Cell], truths: Iterable[int]) -> Iterator[str]:
    """Append to the table of intervals what is not in it yet, truth by truth; a line for every cell."""
    known = read(table)
    done = {tuple(row) for row in known[KEY].drop_duplicates().itertuples(index=False)}
    for cell in cells:
        begun, new = time.process_time(), 0
        for number in truths:
            if (part, cell.runs, cell.points, cell.channels, cell.noise, number) in done:
                continue
            found = bench.interval(part, cell, number)
            rows(part, cell, number, found).to_csv(table, mode="a", header=not table.exists(), index=False)
            new += 1
        if new:
            yield f"{part} {cell}: {new} truths, {time.process_time() - begun:.0f} s"


def rows(part: str, cell: Cell, number: int, found: Interval | None) -> pd.DataFrame:
    """One truth's intervals, a row a parameter; empty figures where no runs stand behind the emulator."""
    none = [None] * len(NAMES)
    own = {"z": none, "low": none, "high": none, "prior": none, "added": none}
    if found is not None:
        low, high = found.interval.T
        own = {"z": found.z, "low": low, "high": high, "prior": found.prior, "added": [found.added] * len(NAMES)}
    key = dict(zip(KEY, (part, cell.runs, cell.points, cell.channels, cell.noise, number), strict=True))
    return pd.DataFrame({**key, "parameter": NAMES, **own})


def read(table: Path) -> pd.DataFrame:
    """All intervals so far."""
    return pd.read_csv(table) if table.exists() else pd.DataFrame(columns=[*KEY, "parameter"])


def tables(intervals: pd.DataFrame) -> str:
    """Every part's table in Markdown."""
    known: Any = intervals.dropna(subset=["low"])
    known = known.assign(
        width=known.high - known.low,
        holds=(known.low <= known.z) & (known.z <= known.high),
        identified=identified(known.high - known.low, known.prior),
    )
    reference = known[(known.part == "plain") & (known.runs > LARGEST)]
    parts = []
    for part in PARTS:
        own = known[known.part == part]
        if len(own):
            lines = [
                cell_row(dict(zip(KEY, (part, *cell), strict=False)), one, reference) for cell, one in grouped(own)
            ]
            parts.append("\n".join([f"### {HEADINGS[part]}", "", HEAD, *lines, ""]))
    return "\n".join(parts)


def grouped(intervals: pd.DataFrame) -> Iterator[tuple[tuple[int, int, int, float], pd.DataFrame]]:
    """The intervals of every cell in the table's order."""
    groups: Any = intervals.groupby(["runs", "channels", "points", "noise"])
    for (runs, channels, points, noise), one in groups:
        yield (int(runs), int(points), int(channels), float(noise)), one


HEADINGS = {
    "plain": "Record and campaign on one mesh, no run added",
    "refined": "The same after `--refine auto`",
    "finer": "Records of a finer mesh, with `--mesh-correction`",
    "uncorrected": "Records of a finer mesh, without it",
}
HEAD = """| runs | points | channels | noise | truths | identified | hold | lowest of a parameter | all truths | width, pressure cutoff | width, viscosity | width, density | against 196 runs | runs added |
|---|---|---|---|---|---|---|---|---|---|---|---|---|---|"""  # noqa: E501


def cell_row(cell: Mapping[str, object], own: pd.DataFrame, reference: pd.DataFrame) -> str:
    """A cell as a row: shares of intervals that hold, median widths, and those over the widths of 196 runs.

    Against 196 runs: median over the truths that both have, of the parameters that 196 runs identify.
    """
    identified = own[own.identified]
    each = [one.holds.mean() for _, one in identified.groupby("parameter") if len(one) >= FEWEST]
    width = own.groupby("parameter").width.median()
    same: Any = reference[(reference.points == cell["points"]) & (reference.channels == cell["channels"])]
    same = same[(same.noise == cell["noise"]) & same.identified]
    ratio = own.merge(same, on=["truth", "parameter"], suffixes=("", "_reference"))
    figures = [
        cell["runs"],
        cell["points"],
        cell["channels"],
        f"{1e3 * float(str(cell['noise'])):g} mm",
        own.truth.nunique(),
        percent(own.identified.mean()),
        percent(identified.holds.mean()) if len(identified) else "–",
        percent(min(each)) if each else "–",
        percent(own.holds.mean()),
        *(percent(width[name], 1) for name in NAMES),
        f"{(ratio.width / ratio.width_reference).median():.2f}" if len(ratio) else "–",
        f"{own.added.mean():.1f}",
    ]
    return f"| {' | '.join(map(str, figures))} |"


def percent(share: float, digits: int = 0) -> str:
    """A share in per cent."""
    return f"{100 * share:.{digits}f} %"


def main(arguments: Sequence[str] | None = None) -> None:
    """Fill the table of intervals and write what it says."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=Path, required=True, help="folder of the simulations and intervals")
    parser.add_argument("--parts", nargs="*", default=[*PARTS], choices=PARTS, help="none: only the table is written")
    parser.add_argument("--truths", type=int, default=200)
    parser.add_argument("--step", type=int, default=1, help="4: every fourth truth, so that the first design has all")
    parser.add_argument("--sizes", type=int, nargs="+", default=[*SIZES], help="of the campaigns")
    parser.add_argument("--points", type=int, nargs="+", default=[*POINTS])
    parser.add_argument("--channels", type=int, nargs="+", default=[*CHANNELS])
    parser.add_argument("--noises", type=float, nargs="+", default=[*NOISES], help="[m]")
    parser.add_argument("--out", type=Path, help="Markdown; on the terminal by default")
    chosen = parser.parse_args(arguments)
    bench, table = Bench(chosen.runs), chosen.runs / "intervals.csv"
    order = product(chosen.sizes, chosen.channels, chosen.points, chosen.noises)
    cells = [Cell(runs, points, channels, noise) for runs, channels, points, noise in order]
    with threadpool_limits(limits=1, user_api="blas"):
        for part in chosen.parts:
            for line in fill(bench, table, part, cells, range(0, chosen.truths, chosen.step)):
                say(line)
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True).stdout.strip()
    made = f"`python docs/interval_coverage.py`, commit {commit or 'unknown'}, {time.strftime('%d %B %Y')}."
    text = f"{made}\n\n{tables(read(table))}"
    if chosen.out is None:
        say(text)
    else:
        write_atomically(chosen.out, text)


def say(text: str) -> None:
    """A line on the terminal, at once."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
