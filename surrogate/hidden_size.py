"""How many hidden neurons: cross-validated errors of several starts for every size, mean and spread."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.data.progress import Progress, silent
from birdstrike.surrogate.network import Shape, forward
from birdstrike.surrogate.trainers.ensemble import starts, train
from birdstrike.surrogate.trainers.levenberg_marquardt import Settings
from birdstrike.surrogate.trainers.training import Samples

SIZES = tuple(range(7, 15))  # those that the authors of the bird-strike network tried
FOLDS = 4
STARTS = 10


@dataclass(frozen=True)
class HiddenSize:
    """One size: mean and standard deviation over the starts of the cross-validated root mean square error.

    In fractions of the parameters' ranges, each in its scale.
    """

    hidden: int
    mean: float
    spread: float


def search(
    x: Array,
    t: Array,
    sizes: Sequence[int] = SIZES,
    seed: int = 0,
    settings: Settings | None = None,
    progress: Progress = silent,
    fractions: Callable[[Array], Array] = np.asarray,
) -> tuple[HiddenSize, ...]:
    """Sizes with their errors, in the order given; x (n, inputs), t (n, outputs) scaled. A fold: every fourth row.

    fractions: scaled outputs -> fractions of the parameters' ranges. Raises UserError below 3 rows.
    """
    if len(x) < 3:
        raise UserError(
            f"--hidden search compares sizes on training runs that are left out in turn; of {len(x)} none says "
            "anything: give a number of neurons, or extend the campaign by run-doe --runs"
        )
    folds = range(min(FOLDS, len(x)))
    found: list[HiddenSize] = []
    for i, hidden in enumerate(sizes):
        shape = Shape(x.shape[1], hidden, t.shape[1])
        squares = [_squares(shape, x, t, fold, seed, settings, fractions) for fold in folds]
        errors = np.sqrt(np.mean(squares, axis=0))
        found.append(HiddenSize(hidden, float(errors.mean()), float(errors.std(ddof=1))))
        progress((i + 1) / len(sizes))
    return tuple(found)


def best(found: Sequence[HiddenSize]) -> HiddenSize:
    """The smallest mean error."""
    return min(found, key=lambda size: size.mean)


def _squares(
    shape: Shape,
    x: Array,
    t: Array,
    fold: int,
    seed: int,
    settings: Settings | None,
    fractions: Callable[[Array], Array],
) -> Array:
    """(starts,) mean squared error on one fold of networks that were trained on the others."""
    out = np.arange(len(x)) % FOLDS == fold
    samples = Samples(x[~out], t[~out], x[out], t[out])
    weights = train(shape, starts(shape, STARTS, seed), samples, settings).weights
    truth = fractions(t[out])
    return np.array([np.mean((fractions(forward(shape, w, x[out])) - truth) ** 2) for w in weights])
