"""Covariances of what no simulation shows: the error of the model's form, and something else that no effect describes.

Of the model's form: what shots share and what each has for itself, in time (`preparation.discrepancy`) and along the
signatures of the library; and what an effect changes in it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.linalg import block_diag

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.inference.hypotheses import CandidateEffect
from birdstrike.inversion.diagnosis.inference.linearisation import UNSEEN_SHARE, Linearisation
from birdstrike.inversion.diagnosis.preparation.discrepancy import OWN_SHARE, Amplitudes, Shape, process_modes, started
from birdstrike.inversion.diagnosis.preparation.shots import Shot
from birdstrike.inversion.misfit import rms

CHANGED = 8  # directions a channel of the discrepancy that an effect may change

PHYSICAL = 0.2  # of the variance of what a shot has for itself: speed, aim, support are never repeated exactly
FAST = 0.3  # of that variance: ringing of shells and contact, which repeats in no record and no mesh, block by block


def model_error(
    at: Linearisation,
    kind: str,
    library: Sequence[Array],
    known: Amplitudes,
    shapes: Mapping[str, Shape],
    length: float,
) -> tuple[Array, Array]:
    """(n, n) of what shots share, and of what each has for itself, for an amplitude of 1 of one kind of sensor.

    length: factor on the lengths over which what they share changes with the parameters.
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


def _along_library(at: Linearisation, library: Sequence[Array], kind: str) -> list[Array]:
    """(q, n) of each shot: the library's signatures in one kind of sensor, alike in size, for an amplitude of 1."""
    found = []
    for shot, own, peak in zip(at.shots, library, at.peaks, strict=True):
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
    """(n, n) of something else: smooth in time, as large as the library's signatures are, in the measured shots."""
    own = [signatures[one.label] ** 2 for one in found if one.response]
    size = np.sqrt(np.mean(own, axis=0)) if own else np.zeros(sum(len(shot.record.values) for shot in at.shots))
    blocks, first = [], 0
    for shot in at.shots:
        for i, trace in enumerate(shot.record.traces):
            n = len(trace.values)
            own = size[first : first + n]
            first += n
            if shot.baseline or shot.kinds[i] != kind:
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
