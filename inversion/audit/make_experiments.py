"""Make virtual experiments: `python -m birdstrike.inversion.audit.make_experiments --out DIR` (seed from entropy).

Each truth is struck by the solver at a finer mesh and on another lattice than the declared case, and recorded twice:
with one channel and with all of the case's, noise drawn anew. Names, order and headers tell nothing. The seed is not
kept: the truth files are the only place where the truth stands. A truth whose strike fails is drawn again, and counted.
"""

from __future__ import annotations

import argparse
import secrets
import sys
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from numpy.random import Generator

from birdstrike.data.curves import Measured, write_measured
from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.files import write_atomically
from birdstrike.data.histories import Histories
from birdstrike.doe.campaign.worker import prepare
from birdstrike.inversion.audit.experiment import truth_text
from birdstrike.inversion.audit.outside import strike_with
from birdstrike.inversion.audit.planted import SPARE, Planted, draw, redraw
from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.simulate import simulate

BEFORE = 5.5e-4  # s of record before first contact
HEADER = (
    "SIMULATED, NOT MEASURED: a virtual experiment made by birdstrike's own solver, with noise added.",
    "The declared case stands in the file of the same name that ends in .toml. What the strike really was is sealed.",
)


@dataclass(frozen=True)
class Job:
    """A truth and the declared case's name or path."""

    case: str
    planted: Planted


def strike(job: Job) -> Histories | str:
    """The noise-free strike of a truth, or why it failed."""
    try:
        return _strike(job)
    except (RunFailed, UserError) as error:
        return str(error)


def _strike(job: Job) -> Histories:
    end = f"{load_case(job.case).time.end + SPARE!r} s"
    case = load_case(job.case, {**job.planted.mesh, "time.end": end}).with_values(job.planted.parameters)
    case = case.with_effects(job.planted.effects).resolved()
    return simulate(case, threads=1) if job.planted.outside is None else strike_with(case, job.planted.outside)


def noise_free(case: Case, histories: Histories, channels: tuple[str, ...]) -> Measured:
    """The record without noise, from well before contact to the declared end."""
    step = case.time.output_interval
    early = int(np.ceil((BEFORE - case.first_contact) / step))
    time = step * np.arange(-early, round(case.time.end / step) + 1)
    values = {name: np.interp(time, histories.time, histories.channels[name]) for name in channels}
    for name, own in case.resolved().instrument.items():
        if name in values:  # a drift runs before contact as well
            values[name] = np.where(time < 0.0, own.drift * time, values[name])
    return Measured(time, values, {}, {name: histories.units[name] for name in channels})


def noisy(case: Case, clean: Measured, rng: Generator) -> Measured:
    """White noise of each sensor's own level."""
    channels = {
        name: values + (case.sensors[name].noise or 0.0) * rng.standard_normal(len(values))
        for name, values in clean.channels.items()
    }
    return Measured(clean.time, channels, {}, clean.units, HEADER)


def write_experiment(folder: Path, name: str, case_name: str, job: Job, clean: Measured, rng: Generator) -> None:
    """Declared case, record, and the sealed truth."""
    declared = load_case(case_name)
    write_atomically(folder / f"{name}.toml", f'# Declared case of a virtual experiment.\nextends = "{case_name}"\n')
    write_measured(folder / f"{name}.csv", noisy(declared, clean, rng))
    write_atomically(folder / f"{name}.truth.toml", truth_text(job.planted, clean))


def main() -> None:
    """Draw, strike, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--case", default="virtual_strike")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    rng = np.random.default_rng(secrets.randbits(128))
    case = load_case(options.case)
    jobs = [Job(options.case, planted) for planted in draw(case, rng)]
    names = [f"shot_{i + 1:02d}" for i in rng.permutation(2 * len(jobs))]
    first = next(iter(case.sensors))
    options.out.mkdir(parents=True, exist_ok=True)
    context = get_context("spawn")
    lifeline, _kept = context.Pipe(duplex=False)
    failed = 0
    with context.Pool(options.workers, initializer=prepare, initargs=(lifeline,)) as pool:
        due = list(range(len(jobs)))
        while due:
            struck = dict(zip(due, pool.imap(strike, [jobs[i] for i in due]), strict=True))
            due = [i for i, histories in struck.items() if isinstance(histories, str)]
            failed += len(due)
            for i in due:
                sys.stderr.write(f"a strike failed and is drawn again: {struck[i]}\n")
                jobs[i] = replace(jobs[i], planted=redraw(case, jobs[i].planted, rng))
            for i, histories in struck.items():
                if isinstance(histories, Histories):
                    acting = case.with_effects(jobs[i].planted.effects)
                    for name, channels in ((names[2 * i], (first,)), (names[2 * i + 1], tuple(case.sensors))):
                        clean = noise_free(acting, histories, channels)
                        write_experiment(options.out, name, options.case, jobs[i], clean, rng)
    sys.stdout.write(f"{len(jobs)} strikes, {2 * len(jobs)} records in {options.out}; {failed} drawn again\n")


if __name__ == "__main__":
    main()
