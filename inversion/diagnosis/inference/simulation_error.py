"""Errors of the simulations, one standard deviation a direction: of the curves, and of the signatures of effects.

Of the curves: emulator, mesh correction, the lattice of particles. Of a signature: what the simulations that it was
learnt from leave unknown, and by how much another sound model would answer otherwise.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import block_diag
from scipy.special import eval_legendre

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.inference.hypotheses import CandidateEffect
from birdstrike.inversion.diagnosis.inference.linearisation import Linearisation, paired
from birdstrike.inversion.diagnosis.preparation.discrepancy import running_mean
from birdstrike.inversion.diagnosis.preparation.shots import Shot

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
