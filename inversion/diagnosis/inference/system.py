"""All shots as one linear-Gaussian system about given parameters.

residual = J dz + sum_j h_j (G_j + D_j) + error, error ~ N(0, F + a^2 U) for each kind of sensor: F noise, numerical
error and the part of the discrepancy whose amplitude is fixed, U the other part for an amplitude of 1. Both are
diagonal in the coordinates T with T F T^T = 1 and T U T^T = lambda (Golub & Van Loan, Matrix Computations, 4th ed.,
8.7), so that any amplitude costs a weighted sum. Kinds of sensors are independent of each other but for parameters and
effects.

Covariances of what no simulation shows: the error of the model's form, and something else that no effect describes.

Of the model's form: what shots share and what each has for itself, in time (`preparation.discrepancy`) and along the
signatures of the library; and what an effect changes in it.

Errors of the simulations, one standard deviation a direction: of the curves, and of the signatures of effects.

Of the curves: emulator, mesh correction, the lattice of particles. Of a signature: what the simulations that it was
learnt from leave unknown, and by how much another sound model would answer otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag, eigh, solve_triangular
from scipy.special import eval_legendre

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.inference.hypotheses import CandidateEffect
from birdstrike.inversion.diagnosis.inference.linearisation import (
    UNSEEN_SHARE,
    Linearisation,
    Places,
    change,
    paired,
    signature,
    unnamed_error,
    unnamed_errors,
)
from birdstrike.inversion.diagnosis.preparation.discrepancy import (
    OWN_SHARE,
    PARAMETER_LENGTH,
    Amplitudes,
    Shape,
    process_modes,
    running_mean,
    started,
)
from birdstrike.inversion.diagnosis.preparation.shots import Shot
from birdstrike.inversion.estimation.prior import NormalPrior
from birdstrike.inversion.misfit import rms

CHANGED = 8  # directions a channel of the discrepancy that an effect may change

PHYSICAL = 0.2  # of the variance of what a shot has for itself: speed, aim, support are never repeated exactly
FAST = 0.3  # of that variance: ringing of shells and contact, which repeats in no record and no mesh, block by block


def model_error(
    at: Linearisation,
    kind: str,
    library: Array,
    known: Amplitudes,
    shapes: Mapping[str, Shape],
    length: float,
) -> tuple[Array, Array]:
    """(n, n) of what shots share, and of what each has for itself, for an amplitude of 1 of one kind of sensor.

    library: (n, q) its signatures; length: factor on the lengths over which what they share changes with parameters.
    """
    along = _along_library(at, library, kind)
    grown = _grown(at, along, shapes) if kind in known.learnt else None
    physical = np.asarray(block_diag(*(part.T @ part for part in along)))
    sizes = [_size(shot, kind, peak) ** 2 for shot, peak in zip(at.shots, at.peaks, strict=True)]
    own = (1.0 - PHYSICAL - FAST) * _unrepeated(at, kind, shapes) + PHYSICAL * physical
    own = own + FAST * np.diag(np.concatenate(sizes))
    return _discrepancy(at, kind, shapes, length, grown), own


def without_baseline(shared: Array, own: Array) -> Array:
    """The free part where no baseline tells what shots share from what each has for itself."""
    return (1.0 - OWN_SHARE) * shared + OWN_SHARE * own


def _size(shot: Shot, kind: str, peaks: Array) -> Array:
    """(n,) peak of each point's channel; 0 in those of another kind."""
    return np.where(np.array(shot.kinds)[shot.record.channel] == kind, peaks[shot.record.channel], 0.0)


def _discrepancy(
    at: Linearisation, kind: str, shapes: Mapping[str, Shape], length: float, library: Sequence[Array] | None
) -> Array:
    """(n, n) for an amplitude of 1 of one kind of sensor: the part that shots share.

    length: factor on the lengths over which it changes with the parameters. A process in each channel; with baselines
    also along the library's signatures (library: (q, n) of each shot): there it counts by what it changes from bird to
    bird, which is another load, and that moves all sensors at once.
    """
    shots, peaks = at.shots, at.peaks
    starts = np.cumsum([0, *(len(shot.record.values) for shot in shots)])
    whole = np.zeros((starts[-1], starts[-1]))
    for i, shot in enumerate(shots):
        for j, other in enumerate(shots):
            block = _block(shot, other, kind, shapes, peaks[i], peaks[j])
            if library is not None:
                block += library[i].T @ library[j]
            whole[starts[i] : starts[i + 1], starts[j] : starts[j + 1]] = at.discrepancy_shared(i, j, length) * block
    return whole


def _unrepeated(at: Linearisation, kind: str, shapes: Mapping[str, Shape]) -> Array:
    """(n, n) what each shot has for itself in any direction, for an amplitude of 1: a run's scatter.

    Until simulations have shown how runs scatter, a process in each channel stands for it.
    """
    if all(len(shot.setup.scatter) for shot in at.shots):
        return _scattered(at, kind)
    own = [_block(shot, shot, kind, shapes, peak, peak) for shot, peak in zip(at.shots, at.peaks, strict=True)]
    return np.asarray(block_diag(*own))


def _scattered(at: Linearisation, kind: str) -> Array:
    """(n, n) by what runs differ that lattices alone part, in the channels of one kind, for an amplitude of 1.

    A bird that breaks up strikes anew in every shot: what one strike has by chance acts on all sensors at once.
    """
    blocks = []
    for shot, peak in zip(at.shots, at.peaks, strict=True):
        rows = shot.scatter.copy()
        for i, name in enumerate(shot.kinds):
            of = shot.record.channel == i
            size = float(np.sqrt((rows[:, of] ** 2).sum(axis=0).mean()))
            rows[:, of] *= peak[i] / size if name == kind and size else 0.0
        blocks.append(rows.T @ rows)
    return np.asarray(block_diag(*blocks))


def _along_library(at: Linearisation, library: Array, kind: str) -> list[Array]:
    """(q, n) of each shot: the library's signatures in one kind of sensor, alike in size, for an amplitude of 1."""
    found = []
    for shot, own, peak in zip(at.shots, at.by_shot(library), at.peaks, strict=True):
        of_kind = np.array(shot.kinds)[shot.record.channel] == kind
        rows = np.where(of_kind, own.T, 0.0)
        power = ((rows / peak[shot.record.channel]) ** 2).sum(axis=1) / max(of_kind.sum(), 1)
        seen = power > UNSEEN_SHARE**2
        scale = np.divide(seen, np.sqrt(power), out=np.zeros_like(power), where=seen)
        found.append(scale[:, None] * rows / np.sqrt(max(seen.sum(), 1)))
    return found


def _grown(at: Linearisation, rows: Sequence[Array], shapes: Mapping[str, Shape]) -> list[Array]:
    """Rows (q, n) of each shot, larger where the discrepancy grows."""
    found = []
    for shot, own in zip(at.shots, rows, strict=True):
        growth = [np.interp(one.middle, shot.setup.time, shapes[one.name].growth) for one in shot.record.traces]
        found.append(own * np.concatenate(growth))
    return found


def _block(shot: Shot, other: Shot, kind: str, shapes: Mapping[str, Shape], peaks: Array, theirs: Array) -> Array:
    """(n, n') of two shots' channels of one kind; different channels are independent."""
    block = np.zeros((len(shot.record.values), len(other.record.values)))
    for i, trace in enumerate(shot.record.traces):
        if shot.kinds[i] != kind or trace.name not in other.channels:
            continue
        j = other.channels.index(trace.name)
        shape, again = shapes[trace.name], other.record.traces[j]
        rows, columns = np.flatnonzero(shot.record.channel == i), np.flatnonzero(other.record.channel == j)
        kernel = started(trace.middle - shot.onset, again.middle - other.onset, 0.0, shape.length)
        left = peaks[i] * np.interp(trace.middle, shot.setup.time, shape.growth)
        right = theirs[j] * np.interp(again.middle, other.setup.time, shape.growth)
        block[np.ix_(rows, columns)] = left[:, None] * kernel * right
    return block


def something_else(
    at: Linearisation, kind: str, signatures: Mapping[str, Array], found: Sequence[CandidateEffect]
) -> Array:
    """(p, p) of something else in the records of one kind of sensor: smooth in time, as large as the library's
    signatures are, in the measured shots.
    """
    own = [signatures[one.label] ** 2 for one in found if one.response]
    size = np.sqrt(np.mean(own, axis=0)) if own else np.zeros(sum(len(shot.record.values) for shot in at.shots))
    blocks, first = [], 0
    for shot in at.shots:
        for i, trace in enumerate(shot.record.traces):
            n = len(trace.values)
            own = size[first : first + n]
            first += n
            if shot.kinds[i] != kind:
                continue
            if shot.baseline or not own.any():
                blocks.append(np.zeros((n, n)))
                continue
            t = trace.middle
            kernel = started(t, t, shot.onset, shot.shapes[trace.name].length)
            blocks.append(rms(own) ** 2 * kernel)
    return np.asarray(block_diag(*blocks))


def changed_by_effects(at: Linearisation, shapes: Mapping[str, Shape], known: Amplitudes) -> list[dict[str, Array]]:
    """Directions of the discrepancy that baselines share, by channel, in each measured shot: none without baselines.

    A model-form error is a share of the response. An effect that changes the response by a share changes it by that
    share of itself, in a way that the baseline cannot know, alike in shots of birds that are alike.
    """
    found: list[dict[str, Array]] = []
    for shot, peaks in zip(at.shots, at.peaks, strict=True):
        own: dict[str, Array] = {}
        for i, trace in enumerate(shot.record.traces):
            if shot.baseline or shot.kinds[i] not in known.learnt:
                continue
            shape = shapes[trace.name]
            size = known.fixed[shot.kinds[i]] * peaks[i] * np.interp(trace.middle, shot.setup.time, shape.growth)
            modes = size[:, None] * process_modes(trace.middle, shot.onset, shape.length, CHANGED)
            own[trace.name] = np.zeros((len(shot.record.values), modes.shape[1]))
            own[trace.name][shot.record.channel == i] = modes
        found.append(own)
    return found


TRENDS = 3  # Legendre polynomials in time by which a signature may be off: as fast as the first bending mode
SHARE = 0.2  # of a signature: how far the answers of two sound models to one effect lie apart
IN_COMMON = 0.5  # of that variance: a model that answers more strongly does so in all channels


def lattice_columns(moves: Sequence[Array]) -> Array:
    """(n, q) one standard deviation each of what another lattice moves; moves: (runs, points) of each shot.

    Their mean is the error of the emulator's own lattice, which all shots share; what runs scatter by about it each
    shot has for itself. Together they are the runs' second moment.
    """
    means = [own.mean(axis=0) if len(own) else np.zeros(own.shape[1]) for own in moves]
    rest = [(own - mean) / np.sqrt(max(len(own), 1)) for own, mean in zip(moves, means, strict=True)]
    return np.hstack([np.concatenate(means)[:, None], np.asarray(block_diag(*(own.T for own in rest)))])


def numerical_error(at: Linearisation, emulator: bool) -> Array:
    """(n, q) directions, one standard deviation each, of emulator, where it is asked for, and mesh correction.

    Half of the mesh correction's variance is given to a process of their size
    that is independent of directions (they are fewer than the directions). Shots share them as far as their
    parameters are alike; the extrapolation to finer meshes they share wholly.
    """
    pairs = list(zip(at.shots, at.z, strict=True))
    factors = [_own_factors(shot, z, emulator) for shot, z in pairs]
    finer = np.concatenate([shot.sample(shot.setup.mesh.extrapolation(z)[None])[0] for shot, z in pairs])
    return np.hstack([at.near.shared(factors), finer[:, None]])


def _own_factors(shot: Shot, z: Array, with_emulator: bool) -> dict[str, Array]:
    """Source -> (n, q) of one shot: by channel the emulator, components of the mesh, what they leave, the process."""
    found: dict[str, Array] = {}
    if with_emulator:
        own = shot.setup.emulator_factors(z)
        found |= {f"emulator {channel}": shot.sample(rows).T for channel, rows in own.items()}
    drawn, count = shot.sample(shot.setup.mesh.factor(z)).T, len(shot.setup.mesh.processes)
    found |= {"mesh": np.sqrt(0.5) * drawn[:, :count], "beside the mesh": np.sqrt(0.5) * drawn[:, count:]}
    process = _process(shot, np.sqrt((drawn**2).sum(axis=1)))
    return found | {f"process {channel}": np.sqrt(0.5) * columns for channel, columns in process.items()}


def _process(shot: Shot, size: Array) -> dict[str, Array]:
    """Channel -> (n, q) factor of a process of standard deviation `size` (n,), smoothed, 0 in the other channels.

    The largest direction first, so that shots can share them.
    """
    found: dict[str, Array] = {}
    for i, (channel, modes) in enumerate(zip(shot.channels, shot.process_modes, strict=True)):
        of = shot.record.channel == i
        power = running_mean(size[of] ** 2, 2 * max(len(modes) // 10, 1) + 1)
        found[channel] = np.zeros((len(size), modes.shape[1]))
        found[channel][of] = np.sqrt(power)[:, None] * modes
    return found


def learnt_error(one: CandidateEffect, at: Linearisation, column: Array) -> Array:
    """(n, q) what simulations leave unknown of a signature for h = 1: errors of regression, and their scatter.

    Shots of one case share it: they have one response. In another case it was learnt from other simulations.
    """
    found: list[dict[str, Array]] = []
    for shot, z, own in zip(at.shots, at.z, at.by_shot(column), strict=True):
        if not np.any(own):
            found.append({})
            continue
        response, size = one.response_in(shot, at.places.h.get(one.label, 0.0))
        scatter = response.scatter_at(z)[[shot.setup.channels.index(c) for c in shot.channels]]
        parts = {f"learnt {id(shot.setup)}": size * shot.sample(response.error_at(z)).T}
        if scatter.any():
            parts[f"scatter {id(shot.setup)}"] = size * (shot.scatter * scatter[shot.record.channel]).T
        found.append(parts)
    return np.vstack(paired(found, [len(shot.record.values) for shot in at.shots]))


def trends(at: Linearisation, column: Array) -> list[dict[str, Array]]:
    """Slow trends in time of a signature, in common and by channel: what another sound model would answer.

    Of each shot; a model that answers otherwise in one shot does so in all shots of such birds.
    """
    found: list[dict[str, Array]] = []
    for shot, own in zip(at.shots, at.by_shot(column), strict=True):
        if not np.any(own):
            found.append({})
            continue
        x = 2.0 * shot.record.middle / float(shot.setup.time[-1]) - 1.0
        trends = np.transpose(
            [np.sqrt((2.0 * k + 1.0) / TRENDS) * SHARE * eval_legendre(k, x) * own for k in range(TRENDS)]
        )
        parts = {"": np.sqrt(IN_COMMON) * trends}
        for i, trace in enumerate(shot.record.traces):
            parts[trace.name] = np.sqrt(1.0 - IN_COMMON) * trends * (shot.record.channel == i)[:, None]
        found.append(parts)
    return found


def share_moved(at: Linearisation, signature: Array) -> float:
    """RMS of a signature over that of the curves, the channels weighed alike, for h = 1."""
    ratios = []
    for shot, own, mean in zip(at.shots, at.by_shot(signature), at.means, strict=True):
        if shot.baseline:
            continue
        for i in range(len(shot.record.traces)):
            of = shot.record.channel == i
            ratios.append(float((own[of] ** 2).mean() / max(float((mean[of] ** 2).mean()), 1e-300)))
    return float(np.sqrt(np.mean(ratios))) if ratios else 0.0


@dataclass(frozen=True)
class Block:
    """One kind of sensor. rows: (p,) of the record; T: (p, p); lam: (p,); logdet: of F; F, U: (p, p), whitened."""

    kind: str
    rows: np.ndarray
    T: Array
    lam: Array
    logdet: float
    F: Array
    U: Array

    @classmethod
    def of(cls, kind: str, rows: np.ndarray, F: Array, U: Array) -> Block:
        """From the two covariances."""
        lam, V = eigh(U, F)
        logdet = 2.0 * float(np.log(np.diag(np.linalg.cholesky(F))).sum())
        return cls(kind=kind, rows=rows, T=V.T, lam=np.maximum(lam, 0.0), logdet=logdet, F=F, U=U)


@dataclass(frozen=True)
class System:
    """blocks: by kind; smooth: kind -> (p, p) whitened covariance of something else. columns: (n, m) whitened: the
    residual at the places, J by one prior standard deviation of each parameter, unnamed errors, nuisances by one
    standard deviation of each, G and D of each candidate effect, model error that effects change, what another lattice
    moves; at: name -> their indices; dz: (r,) how far the places lie from the priors' means; priors: of each shot's
    parameters, the shots in the order of J; noise: Cholesky factor (n, n); numerical_variance: shot -> (n,) SI
    squared, of emulator and mesh correction at its points; roughness: see `Linearisation`; moved: label ->
    `share_moved`.
    """

    blocks: tuple[Block, ...]
    smooth: Mapping[str, Array]
    columns: Array
    at: Mapping[str, slice]
    dz: Array
    priors: Mapping[str, NormalPrior]
    noise: Array
    numerical_variance: Mapping[str, Array]
    roughness: Array
    moved: Mapping[str, float]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the shots."""
        return tuple(self.priors)

    @cached_property
    def other(self) -> tuple[Block, ...]:
        """The blocks with something else in F."""
        return tuple(Block.of(one.kind, one.rows, one.F + self.smooth[one.kind], one.U) for one in self.blocks)


@dataclass(frozen=True)
class Options:
    """Choices of the system that a sensitivity study changes. emulator: whether the emulator's error is in it."""

    parameter_length: float = PARAMETER_LENGTH
    emulator: bool = True


def build(
    shots: Sequence[Shot],
    found: Sequence[CandidateEffect],
    places: Places,
    known: Amplitudes,
    shapes: Mapping[str, Shape],
    options: Options = Options(),
) -> System:
    """The system at the places."""
    at = Linearisation(shots, places)
    noise = np.linalg.cholesky(np.asarray(block_diag(*(shot.record.covariance() for shot in shots))))
    white = Whitener(noise)
    signatures, library = {one.label: signature(one, at) for one in found}, unnamed_errors(at)
    parts = _columns(at, found, signatures, library)
    parts["changed"] = at.near.shared(changed_by_effects(at, shapes, known))
    parts["lattice"] = lattice_columns([shot.lattice_moves for shot in shots])
    directions = numerical_error(at, options.emulator)
    numerical = white(directions)
    blocks, smooth = list[Block](), dict[str, Array]()
    for kind in known.nodes:
        rows = at.rows(kind)
        cut = np.ix_(rows, rows)
        of_kind = Whitener(noise[cut])  # channels are independent
        together, apart = model_error(at, kind, library, known, shapes, options.parameter_length)
        shared, own = of_kind.both(together[cut]), of_kind.both(apart[cut])
        free, held = (own, shared) if kind in known.learnt else (without_baseline(shared, own), own)
        F = np.eye(len(rows)) + numerical[rows] @ numerical[rows].T + known.fixed[kind] ** 2 * held
        blocks.append(Block.of(kind, rows, F, free))
        smooth[kind] = of_kind.both(something_else(at, kind, signatures, found))
    variances = at.by_shot((directions**2).sum(axis=1))
    return System(
        blocks=tuple(blocks),
        smooth=smooth,
        columns=white(np.hstack(list(parts.values()))),
        at=_places_of(parts),
        dz=np.concatenate([prior.deviations(z) for prior, z in zip(at.priors.values(), at.z, strict=True)]),
        priors=at.priors,
        noise=noise,
        numerical_variance={shot.name: part for shot, part in zip(shots, variances, strict=True)},
        roughness=at.roughness,
        moved={one.label: share_moved(at, signatures[one.label]) for one in found if one.response},
    )


def _columns(
    at: Linearisation, found: Sequence[CandidateEffect], signatures: Mapping[str, Array], library: Array
) -> dict[str, Array]:
    """(n, ...) by name, not whitened: residual, parameters, unnamed errors, nuisances, effects with their errors."""
    sizes = at.places.h
    y = np.concatenate([shot.record.values - mean for shot, mean in zip(at.shots, at.means, strict=True)])
    y = y - sum(
        change(one, at, h) if one.fault else h * signatures[one.label] for one in found if (h := sizes.get(one.label))
    )
    bent = any(one.bends and sizes.get(one.label) for one in found)
    parts: dict[str, Array] = {
        "y": y[:, None],
        "J": np.asarray(block_diag(*(J.T * p.sd for J, p in zip(at.jacobians, at.priors.values(), strict=True)))),
        "unnamed": unnamed_errors(at, sizes) if bent else library,
        "nuisance": _nuisances(at),
    }
    for one in found:
        parts[one.label] = signatures[one.label][:, None]
        if one.response:
            parts[f"error of {one.label}"] = learnt_error(one, at, signatures[one.label])
            parts[f"error of {one.label} in other models"] = at.near.shared(trends(at, signatures[one.label]))
    return parts


class Whitener:
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


def changes(one: CandidateEffect, shots: Sequence[Shot], places: Places, sizes: Sequence[float], noise: Array) -> Array:
    """(n, sizes) whitened change of all records by each size of an instrument's fault; noise: `System.noise`."""
    at = Linearisation(shots, places)
    found = [change(one, at, h) for h in sizes]
    return Whitener(noise)(np.array(found).T)


def with_fault(system: System, one: CandidateEffect, shots: Sequence[Shot], places: Places) -> System:
    """A system that stands where no effect is, moved to the size of an instrument's fault, of which alone it knows.

    The parameters stay, and with them all that is costly.
    """
    at, white, old = Linearisation(shots, places), Whitener(system.noise), system.at
    parts = {name: system.columns[:, old[name]] for name in ("y", "J", "unnamed", "nuisance")}
    parts["y"] = parts["y"] - white(change(one, at, places.h[one.label])[:, None])
    if one.label in (labels := at.unnamed_labels):  # of which its size changes that alone
        parts["unnamed"] = parts["unnamed"].copy()
        parts["unnamed"][:, labels.index(one.label)] = white(
            unnamed_error(at, one.label, places.h[one.label])[:, None]
        )[:, 0]
    parts[one.label] = white(signature(one, at)[:, None])
    parts |= {name: system.columns[:, old[name]] for name in ("changed", "lattice")}
    return replace(system, columns=np.hstack(list(parts.values())), at=_places_of(parts))


def _places_of(parts: Mapping[str, Array]) -> dict[str, slice]:
    """Where each part stands among the columns."""
    ends = np.cumsum([0, *(part.shape[1] for part in parts.values())])
    return {name: slice(int(a), int(b)) for name, a, b in zip(parts, ends, ends[1:], strict=False)}


def _nuisances(at: Linearisation) -> Array:
    """(n, q) one standard deviation of every uncertainty that `inversion.nuisance` states, in baselines too.

    A thickness is the rig's, and its shots share it; the others are drawn anew in every shot.
    """
    ends = np.cumsum([0, *(len(shot.record.values) for shot in at.shots)])
    found: dict[tuple[str, str], Array] = {}
    for shot, z, grid, a, b in zip(at.shots, at.z, at.grids, ends[:-1], ends[1:], strict=True):
        for name, sigma in shot.nuisances.items():
            key = (name, "" if name == "thickness" else shot.name)
            column = found.setdefault(key, np.zeros(ends[-1]))
            column[a:b] = sigma * shot.nuisance_signature(name, z, grid)
    return np.array(list(found.values())).reshape(len(found), ends[-1]).T
