"""All shots as one linear-Gaussian system about given parameters.

residual = J dz + sum_j h_j (G_j + D_j) + error, error ~ N(0, F + a^2 U) for each kind of sensor: F noise, numerical
error and the part of the discrepancy whose amplitude is fixed, U the other part for an amplitude of 1. Both are
diagonal in the coordinates T with T F T^T = 1 and T U T^T = lambda (Golub & Van Loan, Matrix Computations, 4th ed.,
8.7), so that any amplitude costs a weighted sum. Kinds of sensors are independent of each other but for parameters and
effects.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag, cholesky, eigh, solve_triangular

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.inference.hypotheses import CandidateEffect
from birdstrike.inversion.diagnosis.inference.linearisation import (
    Linearisation,
    Places,
    change,
    signature,
    unnamed_errors,
)
from birdstrike.inversion.diagnosis.inference.model_error import (
    changed_by_effects,
    model_error,
    something_else,
    without_baseline,
)
from birdstrike.inversion.diagnosis.inference.simulation_error import (
    lattice_columns,
    learnt_error,
    numerical_error,
    share_moved,
    trends,
)
from birdstrike.inversion.diagnosis.preparation.discrepancy import PARAMETER_LENGTH, Amplitudes, Shape
from birdstrike.inversion.diagnosis.preparation.shots import Shot
from birdstrike.inversion.estimation.prior import NormalPrior


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
        L = cholesky(F, lower=True)
        inner = solve_triangular(L, solve_triangular(L, U, lower=True).T, lower=True)
        lam, V = eigh(0.5 * (inner + inner.T))
        T = solve_triangular(L, V, lower=True, trans=1).T
        return cls(
            kind=kind, rows=rows, T=T, lam=np.maximum(lam, 0.0), logdet=2.0 * float(np.log(np.diag(L)).sum()), F=F, U=U
        )


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
        together, apart = model_error(at, kind, library, known, shapes, options.parameter_length)
        shared, own = white.both(together), white.both(apart)
        free, held = (own, shared) if kind in known.learnt else (without_baseline(shared, own), own)
        F = np.eye(len(rows)) + (numerical @ numerical.T)[cut] + known.fixed[kind] ** 2 * held[cut]
        blocks.append(Block.of(kind, rows, F, free[cut]))
        smooth[kind] = white.both(something_else(at, kind, signatures, found))[cut]
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
    at: Linearisation, found: Sequence[CandidateEffect], signatures: Mapping[str, Array], library: Sequence[Array]
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
        "unnamed": np.vstack(unnamed_errors(at, sizes) if bent else library),
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
    parts["unnamed"] = white(np.vstack(unnamed_errors(at, places.h)))
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
