"""All shots as one linear-Gaussian system about given parameters, in the few directions that matter.

residual = J dz + sum_j h_j G_j + error, error ~ N(0, noise + numerical + discrepancy). Whitened by the noise and
projected on the directions in which anything but noise has weight; what is left is white noise for every model alike.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from data.histories import Array
from inversion.diagnosis_v2.discrepancy import PARAMETER_LENGTH, Amplitudes, Shape, alike, started
from inversion.diagnosis_v2.hypotheses import Suspect
from inversion.diagnosis_v2.shots import Shot

PRIOR_SD = 1.0 / np.sqrt(12.0)  # of a uniform distribution over a parameter's range
INSIGNIFICANT = 0.05  # of the noise's variance: a direction with less can move no decision
TEMPORAL = 0.1  # of the record: correlation time of what is not known of a response


@dataclass(frozen=True)
class Places:
    """Where the system is linearised. z: group -> (k,) fractions of the ranges; h: suspect's label -> size."""

    z: Mapping[str, Array]
    h: Mapping[str, float]


@dataclass(frozen=True)
class System:
    """In p directions. y: (p,) residual at the places; J: (p, r) by one prior standard deviation of each parameter;
    dz: (r,) how far the places lie from the prior's middle, in those; G: label -> (p,) for h = 1; fixed: (p, p) noise,
    emulator and mesh; shared, own: kind -> (p, p) for an amplitude of 1; doubt: label -> (p, p) for h = 1; rest: chi
    square of what was left out, with its degrees of freedom; basis: (n, p) whitened directions; noise: (n, n) Cholesky
    factor; groups: the groups in the order of J's columns.
    """

    y: Array
    J: Array
    dz: Array
    G: Mapping[str, Array]
    fixed: Array
    shared: Mapping[str, Array]
    own: Mapping[str, Array]
    doubt: Mapping[str, Array]
    rest: tuple[float, int]
    basis: Array
    noise: Array
    groups: tuple[str, ...]
    smooth: Mapping[str, Array]

    def covariance(self, shared: Mapping[str, float], own: Mapping[str, float]) -> Array:
        """(p, p) of noise, numerical error and discrepancy of given amplitudes, parameters known."""
        parts = [a**2 * self.shared[kind] for kind, a in shared.items()]
        parts += [a**2 * self.own[kind] for kind, a in own.items() if a]
        return self.fixed + sum(parts)


@dataclass(frozen=True)
class Options:
    """Choices of the system that a sensitivity study changes."""

    parameter_length: float = PARAMETER_LENGTH
    largest: float = 0.10


def build(
    shots: Sequence[Shot],
    found: Sequence[Suspect],
    places: Places,
    known: Amplitudes,
    shapes: Mapping[str, Shape],
    options: Options = Options(),
) -> System:
    """The system at the places."""
    groups = tuple(dict.fromkeys(shot.group for shot in shots))
    grids = [shot.setup.grid(places.z[shot.group][None])[0] for shot in shots]
    signatures = {one.label: _signature(one, shots, grids) for one in found}
    means = [shot.sample(grid[None])[0] for shot, grid in zip(shots, grids, strict=True)]
    y = np.concatenate([shot.record.values - mean for shot, mean in zip(shots, means, strict=True)])
    y = y - sum(h * signatures[label] for label, h in places.h.items())
    chol = np.linalg.cholesky(np.asarray(block_diag(*(shot.record.covariance() for shot in shots))))
    white = _Whitener(chol)
    jacobian = white(_jacobian(shots, places, groups)) * PRIOR_SD
    stacked_signatures = white(np.array(list(signatures.values())).T)
    factors = white(_numerical(shots, places, options))
    peaks = _peaks(shots, means)
    shared = {k: white.both(_discrepancy(shots, k, places, shapes, peaks, options)) for k in known.nodes}
    own = {k: white.both(_discrepancy(shots, k, places, shapes, peaks, None)) for k in known.nodes}
    smooth = {k: white.both(_smooth(shots, k, signatures, found)) for k in known.nodes}
    whole = sum(options.largest**2 * one for one in shared.values()) + sum(
        max(known.own[k], 0.05) ** 2 * one for k, one in own.items()
    )
    whole = whole + factors @ factors.T + sum(smooth.values())
    basis = _basis(whole, np.hstack([jacobian, stacked_signatures]))
    short = basis.T
    wy = white(y[:, None])[:, 0]
    middle = np.concatenate([places.z[g] - 0.5 for g in groups]) / PRIOR_SD
    py = short @ wy
    return System(
        py,
        short @ jacobian,
        middle,
        {label: column for label, column in zip(signatures, (short @ stacked_signatures).T, strict=True)},
        np.eye(len(py)) + (short @ factors) @ (short @ factors).T,
        {k: short @ one @ basis for k, one in shared.items()},
        {k: short @ one @ basis for k, one in own.items()},
        {one.label: _doubt(one, shots, signatures[one.label], white, basis) for one in found if one.response},
        (float(wy @ wy - py @ py), len(wy) - len(py)),
        basis,
        chol,
        groups,
        {k: short @ one @ basis for k, one in smooth.items()},
    )


class _Whitener:
    """Whitening by the noise's Cholesky factor."""

    def __init__(self, chol: Array) -> None:
        self.diagonal = not np.any(np.tril(chol, -1))
        self.chol, self.scale = chol, 1.0 / np.diag(chol)

    def __call__(self, columns: Array) -> Array:
        if self.diagonal:
            return self.scale[:, None] * columns
        return np.asarray(solve_triangular(self.chol, columns, lower=True))

    def both(self, matrix: Array) -> Array:
        """L^-1 M L^-T."""
        return self(self(matrix).T)


def _basis(whole: Array, columns: Array) -> Array:
    """(n, p) directions: of the covariance above the noise's insignificant share, and the columns themselves."""
    values, vectors = np.linalg.eigh(whole)
    kept = vectors[:, values > INSIGNIFICANT]
    left = columns - kept @ (kept.T @ columns)
    sizes = np.linalg.norm(left, axis=0)
    u, s, _ = np.linalg.svd(left[:, sizes > INSIGNIFICANT], full_matrices=False)
    return np.hstack([kept, u[:, s > INSIGNIFICANT]])


def _signature(one: Suspect, shots: Sequence[Shot], grids: Sequence[Array]) -> Array:
    """(n,) change of all records for h = 1."""
    parts: list[Array] = []
    for shot, grid in zip(shots, grids, strict=True):
        if shot.baseline or shot.name not in one.shots:
            parts.append(np.zeros(len(shot.record.values)))
        elif one.fault is not None:
            parts.append(shot.instrument_signature(one.fault, grid))
        else:
            parts.append(shot.sample(shot.setup.responses[one.name].signature[None])[0])
    return np.concatenate(parts)


def _jacobian(shots: Sequence[Shot], places: Places, groups: Sequence[str]) -> Array:
    """(n, groups * k) by fractions of the ranges."""
    blocks = [shot.sample(shot.setup.jacobian(places.z[shot.group]).T).T for shot in shots]
    k, rows = blocks[0].shape[1], []
    for shot, block in zip(shots, blocks, strict=True):
        row = np.zeros((len(block), len(groups) * k))
        at = groups.index(shot.group) * k
        row[:, at : at + k] = block
        rows.append(row)
    return np.vstack(rows)


def _numerical(shots: Sequence[Shot], places: Places, options: Options) -> Array:
    """(n, q) directions, one standard deviation each, of emulator and mesh correction.

    The mesh correction's leave-one-out errors are draws; half of their variance is given to a process of their size
    that is independent of directions (they are fewer than the directions). Shots share them as far as their
    parameters are alike; the extrapolation to finer meshes they share wholly.
    """
    factors = [_own_factors(shot, places.z[shot.group]) for shot in shots]
    z = [places.z[shot.group] for shot in shots]
    share = np.linalg.cholesky(
        np.array([[alike(a, b, options.parameter_length) for b in z] for a in z]) + 1e-9 * np.eye(len(z))
    )
    columns = []
    for j in range(len(shots)):
        columns.append(np.vstack([share[i, j] * factors[i] for i in range(len(shots))]))
    finer = np.concatenate([shot.sample(shot.setup.mesh.extrapolation[None])[0] for shot in shots])
    return np.hstack([*columns, finer[:, None]])


def _own_factors(shot: Shot, z: Array) -> Array:
    """(n, q) of one shot."""
    emulator = shot.sample(shot.setup.emulator_factor(z).T).T
    errors = shot.setup.mesh.errors
    drawn = shot.sample(errors).T / np.sqrt(max(len(errors), 1))
    process = _process(shot, np.sqrt((drawn**2).sum(axis=1)))
    return np.hstack([emulator, np.sqrt(0.5) * drawn, np.sqrt(0.5) * process])


def _process(shot: Shot, size: Array) -> Array:
    """(n, q) factor of a process of standard deviation `size` (n,), smoothed, independent from channel to channel."""
    blocks = []
    for i, trace in enumerate(shot.record.traces):
        of = shot.record.channel == i
        t = trace.middle
        length = 0.5 * shot.shapes[trace.name].length
        width = max(len(t) // 10, 1)
        kernel = np.ones(2 * width + 1)
        power = np.convolve(size[of] ** 2, kernel, "same") / np.convolve(np.ones(len(t)), kernel, "same")
        covariance = started(t, t, shot.setup.plan.case.first_contact, length)
        values, vectors = np.linalg.eigh(covariance)
        kept = values > 1e-4 * values.max()
        blocks.append(np.sqrt(power)[:, None] * vectors[:, kept] * np.sqrt(values[kept]))
    return np.asarray(block_diag(*blocks))


def _peaks(shots: Sequence[Shot], means: Sequence[Array]) -> list[Array]:
    """(channels,) of every shot: largest magnitude of the model's or the record's curve, whichever is larger."""
    found = []
    for shot, mean in zip(shots, means, strict=True):
        own = [float(np.abs(mean[shot.record.channel == i]).max()) for i in range(len(shot.record.traces))]
        found.append(np.maximum(own, [trace.peak for trace in shot.record.traces]))
    return found


def _discrepancy(
    shots: Sequence[Shot],
    kind: str,
    places: Places,
    shapes: Mapping[str, Shape],
    peaks: Sequence[Array],
    options: Options | None,
) -> Array:
    """(n, n) for an amplitude of 1 of one kind of sensor; options None: the part that each shot has for itself."""
    starts = np.cumsum([0, *(len(shot.record.values) for shot in shots)])
    whole = np.zeros((starts[-1], starts[-1]))
    for i, shot in enumerate(shots):
        for j, other in enumerate(shots):
            if options is None and i != j:
                continue
            share = 1.0 if options is None else alike(places.z[shot.group], places.z[other.group], options.parameter_length)
            block = _block(shot, other, kind, shapes, peaks[i], peaks[j])
            whole[starts[i] : starts[i + 1], starts[j] : starts[j + 1]] = share * block
    return whole


def _block(
    shot: Shot, other: Shot, kind: str, shapes: Mapping[str, Shape], peaks: Array, theirs: Array
) -> Array:
    """(n, n') of two shots' channels of one kind; different channels are independent."""
    block = np.zeros((len(shot.record.values), len(other.record.values)))
    for i, trace in enumerate(shot.record.traces):
        if shot.kinds[i] != kind or trace.name not in other.channels:
            continue
        j = other.channels.index(trace.name)
        shape, again = shapes[trace.name], other.record.traces[j]
        rows, columns = np.flatnonzero(shot.record.channel == i), np.flatnonzero(other.record.channel == j)
        contact = shot.setup.plan.case.first_contact
        kernel = started(trace.middle, again.middle, contact, shape.length)
        left = peaks[i] * np.interp(trace.middle, shot.setup.time, shape.growth)
        right = theirs[j] * np.interp(again.middle, other.setup.time, shape.growth)
        block[np.ix_(rows, columns)] = left[:, None] * kernel * right
    return block


def _smooth(shots: Sequence[Shot], kind: str, signatures: Mapping[str, Array], found: Sequence[Suspect]) -> Array:
    """(n, n) of something else: smooth in time, as large as the library's signatures are, in the measured shots."""
    size = np.sqrt(np.mean([signatures[one.label] ** 2 for one in found if one.response], axis=0))
    blocks, first = [], 0
    for shot in shots:
        for i, trace in enumerate(shot.record.traces):
            n = len(trace.values)
            own = size[first : first + n]
            first += n
            if shot.baseline or shot.kinds[i] != kind:
                blocks.append(np.zeros((n, n)))
                continue
            t = trace.middle
            kernel = started(t, t, shot.setup.plan.case.first_contact, shot.shapes[trace.name].length)
            blocks.append(float(np.sqrt(np.mean(own**2))) ** 2 * kernel)
    return np.asarray(block_diag(*blocks))


def _doubt(one: Suspect, shots: Sequence[Shot], column: Array, white: _Whitener, basis: Array) -> Array:
    """(p, p) of what is not known of a signature, for h = 1."""
    blocks, first = [], 0
    for shot in shots:
        acts = not shot.baseline and shot.name in one.shots
        response = shot.setup.responses[one.name]
        scatter = np.sqrt(np.maximum(shot.sample(response.scatter[None])[0], 0.0))
        share = shot.per_point(response.spread)
        for i, trace in enumerate(shot.record.traces):
            of = shot.record.channel == i
            own = column[first : first + len(shot.record.values)][of]
            t = trace.middle
            r = (t[:, None] - t) / (TEMPORAL * float(shot.setup.time[-1]))
            kernel = np.exp(-0.5 * r * r)
            size = np.sqrt(0.5 * own**2 + 0.5 * np.mean(own**2)) * share[of]
            blocks.append((np.outer(size, size) + np.outer(scatter[of], scatter[of])) * kernel * float(acts))
        first += len(shot.record.values)
    whole = white.both(np.asarray(block_diag(*blocks)))
    return basis.T @ whole @ basis
