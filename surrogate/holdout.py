"""Which runs test the network and which instants of a curve it reads: rules stated in words, never drawn at random."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.dataset import Dataset
from birdstrike.data.histories import Array

MOST_TIMES = 12  # the bird-strike network reads 12 displacements
FIRST_MOTION = 0.01  # of the campaign's largest value in that channel


def held_out(runs: int) -> NDArray[np.int64]:
    """Positions (from 0) of the runs kept for testing, in the order of the design; see `describe`.

    With 25 runs these are samples 1, 5, 10, 15, 20, 25. Raises ValueError below 3 runs.
    """
    if runs < 3:
        raise ValueError(f"{runs} finished runs cannot be split into training and test runs; at least 3 are needed")
    fifths = range(5, runs + 1, 5)
    full = sorted({1, *fifths, runs})
    for numbers in (full, list(fifths), [runs]):
        if 0 < len(numbers) <= runs / 3:
            return np.array(numbers, dtype=np.int64) - 1
    raise AssertionError(f"no hold-out for {runs} runs")


def describe(runs: int) -> str:
    """The hold-out rule in words, with the samples it gives."""
    numbers = ", ".join(str(i + 1) for i in held_out(runs))
    return (
        "the first, every fifth and the last finished run test the network and are not trained on (every fifth only, "
        f"where that is more than a third of them; the last only, below five runs): of {runs} runs, samples {numbers}"
    )


def input_times(measured: Mapping[str, Array], dataset: Dataset, t0: float = 0.0) -> dict[str, Array]:
    """Instants [s] of each measured channel that the network reads; see `describe_times`.

    measured: channel -> its instants on the record's clock, which is t0 [s] ahead of the model's.
    """
    return {channel: _thinned(times, t0 + _first_motion(dataset, channel)) for channel, times in measured.items()}


def describe_times(chosen: Mapping[str, Array]) -> str:
    """The rule for the instants in words, with their number."""
    counts = ", ".join(f"{len(times)} of {channel}" for channel, times in chosen.items())
    return (
        f"network inputs are the record's instants; of more than {MOST_TIMES}, {MOST_TIMES} equally spaced in number "
        f"from the campaign's first motion (1 % of its largest value) to the last, or the last {MOST_TIMES} where "
        f"fewer follow it: {counts}"
    )


def _first_motion(dataset: Dataset, channel: str) -> float:
    """Earliest instant [s] at which any run exceeds 1 % of the campaign's largest value in this channel."""
    size = np.abs(dataset.curves[channel]).max(axis=0)
    return float(dataset.time[np.argmax(size >= FIRST_MOTION * size.max())])


def _thinned(times: Array, first_motion: float) -> Array:
    if len(times) <= MOST_TIMES:
        return times
    moving = times[times >= first_motion]
    if len(moving) < MOST_TIMES:
        return times[-MOST_TIMES:]
    return moving[np.linspace(0, len(moving) - 1, MOST_TIMES).round().astype(int)]
