"""The inverse network beside the emulator on synthetic records: the table of docs/models.md.

python docs/network_emulator.py --runs FOLDER [--records 100] [--seed 0] [--trainer lm] [--copies 0,10] [--out TABLE.md]

The case is synthetic_strike, much coarser (150 particles, 8 x 6 shells, 1.5 ms), two constants, one displacement at 12
instants, 25 simulations of a uniform design. Truths are drawn uniformly in the ranges and simulated; records have 0.05
mm of noise and a time origin that is off by 0.02 ms (1 sigma), which every method knows. "beyond": records whose curve
is 30 % larger than any, which no constants of the ranges make.

Networks: linear outputs as in the paper, and bounded ones trained on several numbers of copies of every run with the
noise and the time origin's uncertainty. Errors: root mean square, share of the range; coverage: share of the 95 %
intervals that hold the truth (the whole range where a method does not call a constant identified); identified: how
often it does; training: wall time of one network on one thread.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.histories import Array
from birdstrike.data.storage.files import write_atomically
from birdstrike.data.storage.store import RunStore
from birdstrike.doe.campaign.campaign import run_campaign
from birdstrike.doe.designs.registry import make_design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.estimation.answers.network_inversion import network_answer, network_estimates
from birdstrike.inversion.estimation.answers.proposal import by_emulator
from birdstrike.inversion.estimation.locate import InversionOptions, Located, locate
from birdstrike.inversion.estimation.time_origin import clock_drift
from birdstrike.inversion.forward import StoredSolver
from birdstrike.inversion.results.estimates import Estimate
from birdstrike.solver.case.case import Case, load_case
from birdstrike.surrogate.emulator import fit_emulator
from birdstrike.surrogate.inverse_network import TRAINERS, NetworkFit, fit_network

CHANNEL = "displacement_centre"
NOISE, CLOCK = 5e-5, 2e-5  # m, s
TIMES = np.linspace(0.25e-3, 1.4e-3, 12)
COARSE = {"bird.particles": "150", "plate.elements": "[8, 6]", "time.end": "1.5 ms"}
SOUGHT = ("bird.material.pressure_cutoff", "bird.material.viscosity")
BEYOND = 1.3


@dataclass
class Score:
    """Errors as shares of the range, whether each interval holds the truth, whether it was called identified."""

    errors: list[Array] = field(default_factory=list)
    hits: list[bool] = field(default_factory=list)
    identified: list[bool] = field(default_factory=list)
    left: int = 0
    training: float | None = None

    def add(self, estimates: dict[str, Estimate], truth: Array, dataset: Dataset) -> None:
        """One record's answer."""
        span = dataset.highs - dataset.lows
        values = np.array([float(e.value or 0.0) for e in estimates.values()])
        self.errors.append((values - truth) / span)
        for one, low, high, true in zip(estimates.values(), dataset.lows, dataset.highs, truth, strict=True):
            ends = one.interval_95 if one.identified and one.interval_95 else (low, high)
            self.hits.append(bool(ends[0] <= true <= ends[1]))
            self.identified.append(one.identified)

    def row(self, name: str) -> str:
        """A line of the table."""
        errors = np.array(self.errors)
        rms = " | ".join(f"{100 * e:.1f} %" for e in np.sqrt(np.mean(errors**2, axis=0)))
        held = f"{100 * np.mean(self.hits):.0f} %"
        took = "" if self.training is None else f"{self.training:.2g} s"
        return f"| {name} | {rms} | {held} | {100 * np.mean(self.identified):.0f} % | {self.left} | {took} |"


def methods(copies: str) -> dict[str, tuple[str, int]]:
    """Name -> outputs and noisy copies; copies: "0,10"."""
    bounded = {f"network, bounded, {n} copies": ("bounded", int(n)) for n in copies.split(",")}
    return {"network, linear": ("linear", 0), **bounded}


def case() -> Case:
    """The coarse case with two constants sought."""
    loaded = load_case("synthetic_strike", COARSE)
    table = loaded.table
    sought = {key: entry for key, entry in table["inversion"]["parameters"].items() if key in SOUGHT}
    table["inversion"] = {"parameters": sought}
    return load_case(table)


def records(folder: Path, base: Case, dataset: Dataset, count: int) -> Iterator[tuple[Array, Measured]]:
    """Truths and their records."""
    rng = np.random.default_rng(1)
    solver = StoredSolver(base, RunStore(folder / "truths"))
    for _ in range(count):
        truth = rng.uniform(dataset.lows, dataset.highs)
        run = solver(dict(zip(dataset.names, map(float, truth), strict=True)))
        values = np.interp(TIMES - CLOCK * rng.standard_normal(), run.time, run.channels[CHANNEL])
        yield truth, Measured(TIMES, {CHANNEL: values + NOISE * rng.standard_normal(12)}, {}, {CHANNEL: "m"})


def networks(
    dataset: Dataset, located: Located, kinds: dict[str, tuple[str, int]], trainer: str, seed: int
) -> dict[str, tuple[NetworkFit, float]]:
    """Each kind, trained once, with its time [s]: all records have the same instants and the same noise."""
    drift = clock_drift(located.calibration.calibrator, located.calibration.modes[0], located.origin)
    noise = np.full(len(TIMES), NOISE)
    found = {}
    for name, (outputs, copies) in kinds.items():
        began = time.perf_counter()
        with threadpool_limits(limits=1, user_api="blas"):
            fit = fit_network(
                dataset,
                {CHANNEL: TIMES},
                trainer,
                seed=seed,
                noise=noise,
                copies=copies,
                outputs=outputs,
                nuisances=drift.reshape(12, -1),
            )
        found[name] = (fit, time.perf_counter() - began)
    return found


def main() -> None:
    """Simulate what is missing, and print the table."""
    given = argparse.ArgumentParser(description=__doc__)
    given.add_argument("--runs", type=Path, required=True)
    given.add_argument("--records", type=int, default=100)
    given.add_argument("--seed", type=int, default=0, help="of the networks' first weights and copies")
    given.add_argument("--out", type=Path)
    given.add_argument("--trainer", choices=list(TRAINERS), default="lm")
    given.add_argument("--copies", default="0,5,10,20,40,80", help="noisy copies of every run that are compared")
    asked = given.parse_args()
    kinds = methods(asked.copies)
    base = case()
    design = make_design("uniform", ParameterSpace.of_case(base), 25, 0)
    dataset = run_campaign(base, design, asked.runs / "doe", say=lambda _: None)
    options = InversionOptions(
        method="emulator", noise={CHANNEL: NOISE}, time_offset=CLOCK, sampling=None, analyse=False
    )
    emulator = fit_emulator(dataset, [CHANNEL])
    scores = {place: {name: Score() for name in ("emulator", *kinds)} for place in ("within", "beyond")}
    trained: dict[str, tuple[NetworkFit, float]] = {}
    for truth, record in records(asked.runs, base, dataset, asked.records):
        larger = Measured(TIMES, {CHANNEL: BEYOND * record.channels[CHANNEL]}, {}, record.units)
        for place, one in (("within", record), ("beyond", larger)):
            found = locate(dataset, one, options, emulator)
            trained = trained or networks(dataset, found, kinds, asked.trainer, asked.seed)
            scores[place]["emulator"].add(dict(by_emulator(found.calibration).estimates), truth, dataset)
            drift = clock_drift(found.calibration.calibrator, found.calibration.modes[0], found.origin)
            for name, (fit, took) in trained.items():
                scores[place][name].training = took
                answer = network_answer(dataset, fit, found.observations, {CHANNEL: TIMES}, drift)
                own = network_estimates(dataset, fit, answer, found.prior_predictive.inside)
                scores[place][name].add(own, truth, dataset)
                scores[place][name].left += int(((answer.raw < dataset.lows) | (answer.raw > dataset.highs)).any())
    table = [
        f"| method | error of {' | error of '.join(key.rsplit('.', 1)[-1].replace('_', ' ') for key in SOUGHT)} | "
        "coverage | identified | answers outside the ranges | training |",
        "|---" * 7 + "|",
        *(score.row(f"{name}, {place}") for place, own in scores.items() for name, score in own.items()),
    ]
    text = "\n".join(table) + "\n"
    sys.stdout.write(text)
    if asked.out:
        write_atomically(asked.out, text)


if __name__ == "__main__":
    main()
