"""Forward emulator: curves from parameters by principal components, a Gaussian process for each, with its own error.

The error is a covariance over time and channels. Predicted components err as their processes say, correlated as their
leave-one-out errors are; the rest of a run's curves is drawn anew with every run (`run_scatter`), as large as that of
the runs nearby.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from sklearn.decomposition import PCA
from sklearn.gaussian_process.kernels import Kernel
from threadpoolctl import threadpool_limits

from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import UserError
from birdstrike.data.formatting import listing, many
from birdstrike.data.histories import Array
from birdstrike.data.progress import Progress, silent
from birdstrike.surrogate.features import FEATURES, Region, covered, features, regions, runs_needed
from birdstrike.surrogate.gaussian_process import GaussianProcess, LocalVariance, student_inflation
from birdstrike.surrogate.run_scatter import factors_between, shrunk_correlation
from birdstrike.surrogate.scaling import Scaling
from birdstrike.surrogate.validation import Validation, q2, rmse

VARIANCE_KEPT = 0.9999
WORTH_PREDICTING = 0.3  # leave-one-out Q2; a process can be fitted to a few dozen draws of noise with less
INSTANTS = 110  # of a channel, at which the covariance of what is left stands; linear between them


class ExtrapolationError(ValueError):
    """Parameters where no run stands behind the emulator."""


@dataclass(frozen=True)
class CurveEmulator:
    """One channel: y(t, theta) = mean(t) + sum_c s_c(theta) basis_c(t).

    time: (m,) [s]; mean: (m,) SI; basis: (c, m) SI, all components of the runs; processes: Gaussian processes of the
    first components, those that can be predicted. Its errors, in directions common to all channels of an emulator:
    mixing: (kept, q) rows whose products are the correlations of the kept scores' errors; remainder: (r, m) SI, the
    rest of a run's curve, one standard deviation of each direction on the average of the runs; nearby: its variance at
    a place over that average; outside: (m,) variance, SI squared, of what those leave out, each instant by itself.
    left: (n, m) SI, the rest of the runs' own curves, each run left out.
    """

    time: Array
    mean: Array
    basis: Array
    processes: tuple[GaussianProcess, ...]
    mixing: Array
    remainder: Array
    nearby: LocalVariance
    outside: Array
    left: Array
    validation: Validation

    @classmethod
    def fit(
        cls, time: Array, curves: Array, u: Array, seed: int = 0, kernels: Sequence[Kernel] | None = None
    ) -> CurveEmulator:
        """From curves (n, m) at scaled features u (n, d); `kernels`: of an emulator fitted before on the same runs.

        Components are added until they hold 99.99 % of the variance or the next one is mostly noise to its process
        (leave-one-out Q2 up to 0.3). Curves are standardised by one number: millimetres and meganewtons fare alike.
        """
        size = float(curves.std(axis=0).max()) or 1.0
        with np.errstate(invalid="ignore"):  # curves that never change have no shares of variance, which is fine
            pca = PCA().fit(curves / size)
        scores = pca.transform(curves / size)
        if kernels is None:
            processes = _predictable(u, scores, seed)
        else:
            processes = [GaussianProcess.with_kernel(u, scores[:, c], kernel) for c, kernel in enumerate(kernels)]
        basis, mean = np.asarray(pca.components_) * size, np.asarray(pca.mean_) * size
        left = _left(curves, len(processes))
        alone = cls(
            time,
            mean,
            basis,
            tuple(processes),
            np.eye(len(processes)),
            np.zeros((0, len(time))),
            _nearby(u, processes, left),
            np.zeros(len(time)),
            left,
            _validate(curves, mean, basis, processes),
        )
        return jointly({"": alone})[""]

    def scores(self, u: Array) -> Array:
        """Mean scores (q, kept) at scaled features u (q, d)."""
        return np.stack([p.mean(u) for p in self.processes], axis=1) if self.processes else np.zeros((len(u), 0))

    def curves(self, u: Array, times: Array) -> Array:
        """Mean curves (q, len(times)) at scaled features u (q, d)."""
        mean, basis = self.at(times)
        return mean + self.scores(u) @ basis[: len(self.processes)]

    def error_factor(self, u: Array, times: Array) -> Array:
        """F (t, c): F F^T + diag(outside) is the covariance of the curve's error at a point u (d,), scatter included.

        The columns are common to all channels of an emulator.
        """
        variance = np.array([p.variance(u[None])[0] for p in self.processes])
        return self._factor(variance, float(self.nearby.at(u[None])[0]), times)

    def scatter_factor(self, u: Array, times: Array) -> Array:
        """`error_factor` of the runs' scatter alone, which no further run takes away: of the remainder, what is left
        where it is smallest."""
        variance = np.array([min(p.nugget, p.variance(u[None])[0]) for p in self.processes])
        return self._factor(variance, min(float(self.nearby.at(u[None])[0]), self.nearby.least), times)

    def _factor(self, variance: Array, remainder: float, times: Array) -> Array:
        """(t, c) from variances (kept,) of the scores and the remainder's over its average."""
        kept = self.at(times)[1][: len(variance)].T * np.sqrt(variance)
        return np.hstack([kept @ self.mixing, np.sqrt(remainder) * self.remainder_at(times)])

    def remainder_at(self, times: Array) -> Array:
        """(t, r) `remainder` at `times` [s]: at a place, times the root of `nearby`."""
        return self._between(self.remainder, times).T

    def rough(self) -> float:
        """Mean variance, SI squared, by which a run leaves what is smooth in the parameters: no emulator knows it."""
        nuggets = np.array([p.nugget for p in self.processes])
        known = (nuggets @ self.basis[: len(nuggets)] ** 2).mean() if len(nuggets) else 0.0
        return float(known + (self.left**2).mean())

    def outside_at(self, times: Array) -> Array:
        """(t,) `outside` at `times` [s]."""
        return np.interp(times, self.time, self.outside)

    def at(self, times: Array) -> tuple[Array, Array]:
        """Mean (t,) and basis (c, t) at `times` [s]: linear between samples, at rest before them, NaN after."""
        values = self._between(np.vstack([self.mean, self.basis]), times)
        return values[0], values[1:]

    def _between(self, rows: Array, times: Array) -> Array:
        """Rows (., m) at `times` [s], (., t)."""
        i = np.clip(np.searchsorted(self.time, times) - 1, 0, len(self.time) - 2)
        w = np.maximum((times - self.time[i]) / (self.time[i + 1] - self.time[i]), 0.0)
        w = np.where(times > self.time[-1] * (1.0 + 1e-9), np.nan, np.minimum(w, 1.0))
        return rows[:, i] * (1.0 - w) + rows[:, i + 1] * w


@dataclass(frozen=True)
class Emulator:
    """All channels of a campaign.

    names: (k) dotted case keys; runs: numbers of those it learnt from; regions: boxes in which these stand behind it;
    scaling: of the features to 0..1; scales (k): "linear" or "logarithmic" of the ranges, all linear if left out.
    """

    names: tuple[str, ...]
    runs: tuple[int, ...]
    regions: tuple[Region, ...]
    scaling: Scaling
    channels: Mapping[str, CurveEmulator]
    scales: tuple[str, ...] = ()

    def predict(self, theta: Array, channel: str, times: Array | None = None) -> tuple[Array, Array]:
        """Mean curves and standard deviations (q, t) of a channel at parameters theta (q, k) SI.

        Raises ExtrapolationError where no run stands behind the answer.
        """
        self.check(theta)
        emulator, u = self.channels[channel], self.inputs(theta)
        t = emulator.time if times is None else times
        variance = [(emulator.error_factor(row, t) ** 2).sum(axis=1) + emulator.outside_at(t) for row in u]
        return emulator.curves(u, t), np.sqrt(np.stack(variance))

    def covariance(self, theta: Array, channel: str, times: Array) -> Array:
        """Covariance (t, t) of the error of a channel's curve at one point theta (k,) SI; raises ExtrapolationError."""
        self.check(theta[None])
        emulator = self.channels[channel]
        factor = emulator.error_factor(self.inputs(theta[None])[0], times)
        return factor @ factor.T + np.diag(emulator.outside_at(times))

    def inputs(self, theta: Array) -> Array:
        """Scaled features (q, d) of parameters theta (q, k) SI; features that no run varies are left out."""
        unit = self.scaling.to_unit(features(self.names, theta, self.scales))
        return unit[:, ~self.scaling.constant]

    def check(self, theta: Array) -> None:
        """Raises ExtrapolationError unless every row of theta (q, k) lies in one of the regions."""
        for row in theta[~covered(self.regions, theta)]:
            values = ", ".join(f"{name} = {value:.6g}" for name, value in zip(self.names, row, strict=True))
            raise ExtrapolationError(f"no run of the campaign stands behind the emulator at {values}")


def fit_emulator(
    dataset: Dataset,
    channels: Sequence[str],
    seed: int = 0,
    progress: Progress = silent,
) -> Emulator:
    """Fit the given channels of a campaign's smooth runs; raises UserError when those are too few, or none can differ.

    Runs in a part of a range that too few of them cover are left out as well, and those that repeat another: they could
    only mislead.
    """
    own = dataset.smooth & dataset.distinct
    _refuse_too_few(dataset, own, own)
    boxes = regions(dataset.names, dataset.lows, dataset.highs, dataset.parameters[own], dataset.scales)
    used = own & covered(boxes, dataset.parameters)
    _refuse_too_few(dataset, own, used)
    theta = dataset.parameters[used]
    scaling = Scaling.over(features(dataset.names, theta, dataset.scales))
    if scaling.constant.all():
        raise UserError(
            f"none of the {len(theta)} smooth runs depends on {listing(dataset.names)}: erosion limits that no "
            "particle can reach; widen their ranges (inversion.parameters) past 1 and run the campaign anew, or seek "
            "something else"
        )
    emulator = Emulator(dataset.names, tuple(map(int, dataset.runs[used])), boxes, scaling, {}, dataset.scales)
    u = emulator.inputs(theta)
    fitted: dict[str, CurveEmulator] = {}
    for i, channel in enumerate(channels):
        fitted[channel] = CurveEmulator.fit(dataset.time, dataset.curves[channel][used], u, seed)
        progress((i + 1) / len(channels))
    return replace(emulator, channels=jointly(fitted))


def _refuse_too_few(dataset: Dataset, own: NDArray[np.bool_], used: NDArray[np.bool_]) -> None:
    """Raise UserError where the runs used are too few.

    It says how many are not smooth, repeat another (are not in `own`), or stand alone in their part.
    """
    needed, smooth = runs_needed(len(dataset.names)), int(dataset.smooth.sum())
    single, found = int(own.sum()), int(used.sum())
    if found >= needed:
        return
    split = listing([name for name in dataset.names if name.rsplit(".", 1)[-1] in FEATURES])
    repeated = f", {single} of them with values of their own" if single < smooth else ""
    apart = f", {found} of them where enough lie on the same side of 1 in {split}" if found < single else ""
    raise UserError(
        f"{many(smooth, 'run')} of the campaign's {len(dataset.runs)} {'is' if smooth == 1 else 'are'} smooth"
        f"{repeated}{apart}; the emulator needs {needed}: extend it by run-doe --runs"
    )


def jointly(channels: Mapping[str, CurveEmulator]) -> dict[str, CurveEmulator]:
    """Channels of the same runs with the errors that they have in common.

    What the directions of the rest leave out has the variance of as many draws as there are runs, enlarged as Student's
    t asks for so few.
    """
    emulators = list(channels.values())
    errors = np.hstack([e.validation.standardised for e in emulators])
    mixing = _factor(shrunk_correlation(errors)) if errors.shape[1] else np.zeros((0, 0))
    rows = np.split(mixing, np.cumsum([len(e.processes) for e in emulators])[:-1], axis=0)
    inflation = student_inflation(len(emulators[0].left) - 1)
    remainders = factors_between([e.time for e in emulators], [e.left for e in emulators], INSTANTS)
    found: dict[str, CurveEmulator] = {}
    for (name, e), own, remainder in zip(channels.items(), rows, remainders, strict=True):
        outside = inflation * np.maximum((e.left**2).mean(axis=0) - (remainder**2).sum(axis=0), 0.0)
        found[name] = replace(e, mixing=own, remainder=remainder, outside=outside)
    return found


def _factor(correlation: Array) -> Array:
    """(p, p) F with F F^T = correlation, whether or not it has full rank."""
    values, vectors = np.linalg.eigh(correlation)
    return vectors * np.sqrt(np.maximum(values, 0.0))


def _predictable(u: Array, scores: Array, seed: int) -> list[GaussianProcess]:
    """Processes of the first components of scores (n, c) until they hold the variance or the next is mostly noise."""
    variance = np.mean(scores**2, axis=0)
    processes: list[GaussianProcess] = []
    for c in range(scores.shape[1]):
        if variance[:c].sum() >= VARIANCE_KEPT * variance.sum():
            break
        process = GaussianProcess.fit(u, scores[:, c], seed)
        if not process.q2 > WORTH_PREDICTING:
            break
        processes.append(process)
    return processes


def _nearby(u: Array, processes: Sequence[GaussianProcess], left: Array) -> LocalVariance:
    """`CurveEmulator.nearby` from the rest (n, m) of runs at scaled features u (n, d).

    Features count as they do to the components; the scale is the range of the one that counts most, since components
    that are nearly linear have lengths beyond all ranges, on which no run would be nearer than another.
    """
    lengths = (
        np.exp(np.mean([np.log(p.missed.lengths) for p in processes], axis=0)) if processes else np.ones(u.shape[1])
    )
    lengths /= lengths.min()
    squares = (left**2).mean(axis=1)
    return LocalVariance.of(lengths, u / lengths, squares / (squares.mean() or 1.0))


def _left(curves: Array, predicted: int) -> Array:
    """(n, m) what each of the curves (n, m), left out, has beyond the others' mean and first `predicted` components.

    A run's scatter has as many directions as the curve has instants, its components only as many as there are other
    runs, and these were chosen to hold those runs: what is left is larger than the runs' own components show.
    """
    left = np.zeros_like(curves)
    with threadpool_limits(limits=1, user_api="blas"):
        for i in range(len(curves)):
            others = np.delete(curves, i, axis=0)
            mean = others.mean(axis=0)
            components = _components(others - mean)[:predicted]
            left[i] = curves[i] - mean - (components @ (curves[i] - mean)) @ components
    return left


def _components(rows: Array) -> Array:
    """Right singular vectors (c, m) of rows (n, m), the largest first, by the Gram matrix."""
    squares, vectors = np.linalg.eigh(rows @ rows.T)
    kept = np.flatnonzero(squares > 1e-12 * max(squares[-1], 1e-300))[::-1]
    return vectors[:, kept].T @ rows / np.sqrt(squares[kept])[:, None]


def _validate(curves: Array, mean: Array, basis: Array, processes: Sequence[GaussianProcess]) -> Validation:
    """Leave-one-out on the runs themselves, with hyperparameters, mean and components kept.

    Mean and components still know the run left out: where runs jitter in ways no parameter explains, these figures are
    somewhat better than those of new runs, the more so the fewer the runs.
    """
    if not processes:
        return Validation(
            q2(curves, np.broadcast_to(mean, curves.shape)), rmse(curves, mean), np.zeros((len(curves), 0))
        )
    loo = np.stack([p.loo for p in processes], axis=1)
    predicted = mean + loo @ basis[: len(processes)]
    return Validation(
        q2(curves, predicted), rmse(curves, predicted), np.stack([p.standardised for p in processes], axis=1)
    )
