"""The figures of `inversion.json` about its ingredients: training, emulator, measurement."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.histories import Array
from birdstrike.inversion.formatting import plain, span
from birdstrike.inversion.inversion import EmulatorFigures, MeasuredFigures, TrainingFigures
from birdstrike.inversion.observations.observations import Observations
from birdstrike.inversion.observations.prior_predictive import POOR_Q2
from birdstrike.surrogate.emulator import Emulator
from birdstrike.surrogate.holdout import describe, describe_times
from birdstrike.surrogate.inverse_network import NetworkFit
from birdstrike.surrogate.levenberg_marquardt import Settings

TRAINING_FILE = "training.csv"
WORTH_SAYING = 0.01  # of a range


def training_figures(fit: NetworkFit, dataset: Dataset, read: Mapping[str, Array]) -> TrainingFigures:
    """How the network was trained; read: the instants it reads, on the record's clock."""
    training, test_mse = fit.training, float(fit.training.test_mse[-1])
    return TrainingFigures(
        trainer=training.trainer,
        shape=str(fit.network.shape),
        epochs=training.epochs,
        goal=Settings().goal,
        mse=float(training.mse.min()),
        test_mse=test_mse if np.isfinite(test_mse) else None,
        history=TRAINING_FILE,
        status=training.status,
        holdout=f"{describe(len(dataset.runs))}; {describe_times(read)}",
        held_out=tuple(int(run) for run in dataset.runs[fit.held_out]),
        inputs={channel: tuple(map(float, times)) for channel, times in read.items()},
    )


def emulator_figures(emulator: Emulator, dataset: Dataset) -> EmulatorFigures:
    """Leave-one-out figures of every channel and the runs that were left out."""
    q2 = {name: _known(curve.validation.q2) for name, curve in emulator.channels.items()}
    standardised = {name: curve.validation.standardised for name, curve in emulator.channels.items()}
    return EmulatorFigures(
        components={name: len(curve.processes) for name, curve in emulator.channels.items()},
        q2=q2,
        loo_rmse={name: curve.validation.rmse for name, curve in emulator.channels.items()},
        standardised_rms={n: float(np.sqrt(np.mean(s**2))) if s.size else None for n, s in standardised.items()},
        runs_left_out=tuple(int(run) for run in dataset.runs if int(run) not in emulator.runs),
    )


def measured_figures(measured: Measured, observations: Observations) -> MeasuredFigures:
    """Provenance, points and noise of the measurement."""
    return MeasuredFigures(
        path=measured.path,
        provenance=tuple(measured.provenance),
        simulated=measured.simulated,
        points={c.name: len(c.times) for c in observations.channels},
        noise={c.name: float(np.sqrt(np.mean(c.noise**2))) for c in observations.channels},
        noise_source={c.name: c.noise_source for c in observations.channels},
    )


def emulator_warnings(emulator: Emulator, dataset: Dataset) -> tuple[str, ...]:
    """Runs left out, values that no run stands behind, and channels that are predicted poorly."""
    sentences: list[str] = []
    lost = [str(int(run)) for run in dataset.runs[~dataset.smooth]]
    if lost:
        many = "s" if len(lost) > 1 else ""
        sentences.append(f"run{many} {', '.join(lost)} lost more than 5 % of the bird: the emulator leaves them out")
    for i, name in enumerate(dataset.names):
        for low, high in _gaps(emulator, dataset, i):
            where = span(low, high, dataset.units[i])
            sentences.append(f"{plain(name)} {where}: too few smooth runs stand there, so no answer is sought there")
    for channel, curve in emulator.channels.items():
        q2 = curve.validation.q2
        if not q2 > POOR_Q2:
            sentences.append(f"the emulator predicts left-out runs of {plain(channel)} poorly (Q2 {q2:.2f}): add runs")
    return tuple(sentences)


def _gaps(emulator: Emulator, dataset: Dataset, i: int) -> list[tuple[float, float]]:
    """Stretches of parameter i's range that no region of the emulator covers."""
    low, high = float(dataset.lows[i]), float(dataset.highs[i])
    gaps: list[tuple[float, float]] = []
    reached = low
    for start, end in sorted({(float(r.lows[i]), float(r.highs[i])) for r in emulator.regions}):
        gaps.append((reached, start))
        reached = max(reached, end)
    gaps.append((reached, high))
    return [(a, b) for a, b in gaps if b - a > WORTH_SAYING * (high - low)]


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None
