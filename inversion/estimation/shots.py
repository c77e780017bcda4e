"""Several shots, one bird: their campaigns, records and forward models as one, the parameters shared.

A channel of the second shot is called `displacement_centre@2`, and so on, so that emulator, network and posterior see
one strike with more sensors. What is each shot's own stays its own: its clock, its noise, its nuisances. Later shots
are laid on the first one's clock by their own fits, and what is uncertain in that is a column of their error.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from birdstrike.data.curves import Measured, on_one_clock
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array, Histories
from birdstrike.data.progress import Progress
from birdstrike.inversion.estimation.calibration import Mode
from birdstrike.inversion.estimation.curve_model import CurveModel
from birdstrike.inversion.estimation.known_errors import Columns
from birdstrike.inversion.estimation.locate import InversionOptions, locate
from birdstrike.inversion.forward import Forward, watched
from birdstrike.inversion.observations.filters import ModelFilter
from birdstrike.inversion.observations.observations import Observations
from birdstrike.inversion.results.ingredients import MeshCorrectionFigures, ShotFigures
from birdstrike.solver.case.case import Case
from birdstrike.surrogate.emulator import Emulator, fit_emulator

SCATTERS = (0.0, 0.003, 0.01, 0.02, 0.04, 0.08, 0.15)


@dataclass(frozen=True)
class CampaignShot:
    """One record with the campaign and forward model of its case.

    options: its noise and time origin; columns: errors of its own (nuisances, mesh), None where it has none;
    known_errors: those in words; campaign: folder of the runs, if they come from one; verifier: the forward model on
    the fine mesh, where the campaign is corrected for it; case: that the runs are of; filter: that the
    model's curves have passed; warnings: what the user should know of a record that was filtered.
    """

    dataset: Dataset
    measured: Measured
    forward: Forward
    options: InversionOptions
    columns: Columns | None = None
    known_errors: tuple[str, ...] = ()
    campaign: Path | None = None
    verifier: Forward | None = None
    mesh_correction: MeshCorrectionFigures | None = None
    case: Case | None = None
    filter: ModelFilter | None = None
    warnings: tuple[str, ...] = ()

    @property
    def verified_by(self) -> Forward:
        """The model that verifies answers."""
        return self.verifier or self.forward


@dataclass(frozen=True)
class Joint:
    """Several shots as one: what `invert` takes, and what to say of each.

    forward: makes runs that are added to the data set; verifier: makes those that verify an answer.
    """

    dataset: Dataset
    measured: Measured
    forward: Forward
    verifier: Forward
    options: InversionOptions
    columns: Columns | None
    figures: tuple[ShotFigures, ...] = ()
    known_errors: tuple[str, ...] = ()

    @classmethod
    def alone(cls, shot: CampaignShot) -> Joint:
        """A single shot."""
        own = shot.forward, shot.verified_by, shot.options, shot.columns, (), shot.known_errors
        return cls(shot.dataset, shot.measured, *own)


@dataclass(frozen=True)
class JointForward:
    """Every shot's forward model at the same parameters, one after the other; one that shots share runs once."""

    parts: tuple[Forward, ...]
    time: Array

    def __call__(self, theta: Mapping[str, float]) -> Histories:
        """All channels on the common clock; the first shot's summary. Raises RunFailed."""
        runs: list[tuple[Forward, Histories]] = []
        for part in self.parts:
            known = [run for other, run in runs if other is part]
            runs.append((part, known[0] if known else part(theta)))
        channels: dict[str, Array] = {}
        units: dict[str, str] = {}
        for number, (_, run) in enumerate(runs):
            for name, values in run.channels.items():
                channels[name + suffix(number)] = np.interp(self.time, run.time, values)
                units[name + suffix(number)] = run.units[name]
        return Histories(self.time, channels, units, runs[0][1].summary)

    def watched(self, progress: Progress) -> JointForward:
        """With the progress of each part reported."""
        many = len(self.parts)
        parts = (watched(part, lambda f, i=i: progress((i + f) / many)) for i, part in enumerate(self.parts))
        return replace(self, parts=tuple(parts))


def suffix(number: int) -> str:
    """What a shot's channels have after their names: nothing for the first, "@2" for the second."""
    return f"@{number + 1}" if number else ""


def joined(shots: Sequence[CampaignShot], origins: Sequence[tuple[float, bool]] | None = None) -> Joint:
    """The shots as one; raises UserError where their campaigns vary other parameters or points, or priors differ.

    origins: each shot's time origin [s] and whether its own model can make it, where that is known.
    """
    dataset = _dataset(shots)
    _refuse_other_priors(shots)
    offsets, inside = zip(*(origins or [own_origin(shot) for shot in shots]), strict=True)
    moved = [0.0, *(t0 - offsets[0] for t0 in offsets[1:])]  # onto the first one's clock, which is fitted
    measured = _measured([shot.measured for shot in shots], moved)
    first = shots[0]
    noise = {n + suffix(i): sigma for i, shot in enumerate(shots) for n, sigma in shot.options.noise.items()}
    figures = tuple(
        ShotFigures(shot.measured.path, suffix(i), shot.dataset.case_hash, t0, ok, shot.measured.digest)
        for i, (shot, t0, ok) in enumerate(zip(shots, offsets, inside, strict=True))
    )
    return Joint(
        dataset=dataset,
        measured=measured,
        forward=JointForward(tuple(shot.forward for shot in shots), dataset.time),
        verifier=JointForward(tuple(shot.verified_by for shot in shots), dataset.time),
        options=replace(first.options, noise=noise),
        columns=_columns(shots, dataset),
        figures=figures,
        known_errors=tuple(dict.fromkeys(said for shot in shots for said in shot.known_errors)),
    )


def _refuse_other_priors(shots: Sequence[CampaignShot]) -> None:
    """Raises UserError where the cases of shots that share the parameters state other priors of them."""
    first = shots[0].options.priors
    for shot in shots[1:]:
        own = shot.options.priors
        if differing := [name for name in {**first, **own} if first.get(name) != own.get(name)]:
            raise UserError(
                f"the shots' cases state different priors of {', '.join(differing)}, but share the parameter: state "
                f'the same inversion.parameters."{differing[0]}".prior in every case'
            )


def with_scatter(joint: Joint) -> tuple[Joint, float]:
    """The joint record with the shot-to-shot scatter that makes it most likely, and that scatter (1 sigma, relative).

    Each shot's curves may be larger or smaller by a factor of its own, normal about 1; the scatter is the one of
    SCATTERS at which the best joint fit is most probable (empirical Bayes: its own uncertainty is not carried). It is
    low on average and often 0, because the parameters are fitted to the same curves and take up part of the difference
    (no degree of freedom is given back for them); two or three shots hardly determine a scatter. State a known one as
    a discrepancy of the model, or as an uncertain mass or speed.
    """
    alone = joint.options.fit_alone
    names = list(joint.measured.channels)
    emulator = fit_emulator(joint.dataset, names, alone.seed)
    costs = []
    for share in SCATTERS:
        columns = _amplitudes(joint.columns, share, emulator)
        found = locate(joint.dataset, joint.measured, alone, emulator, columns)
        costs.append(found.calibration.modes[0].cost)
    share = SCATTERS[int(np.argmin(costs))]
    return replace(joint, columns=_amplitudes(joint.columns, share, emulator)), share


def _amplitudes(columns: Columns | None, share: float, emulator: Emulator) -> Columns:
    """The columns, and one a shot: `share` of the curve that a first fit gives it.

    Not of the record: its noise would be scaled with it, and a curve too small by any factor would leave less of the
    noise than the right one does (Peelle's puzzle: D'Agostini, Nucl. Instrum. Methods A 346 (1994) 306).
    """

    def more(observations: Observations, mode: Mode) -> Array:
        known = [columns(observations, mode)] if columns is not None else []
        own: list[Array] = [np.zeros((len(observations.values), 0))]
        if share:
            numbers = np.concatenate([np.full(len(c.times), shot_number(c.name)) for c in observations.channels])
            curve = CurveModel(emulator, observations).curve(mode.theta, mode.t0)
            own.append(np.where(numbers[:, None] == np.unique(numbers), share * curve[:, None], 0.0))
        return np.hstack([*known, *own])

    return more


def own_origin(shot: CampaignShot) -> tuple[float, bool]:
    """A shot's own time origin [s], and whether its own model can make it."""
    found = locate(shot.dataset, shot.measured, shot.options.fit_alone, columns=shot.columns)
    return found.origin.value, found.prior_predictive.inside


def _dataset(shots: Sequence[CampaignShot]) -> Dataset:
    """One data set: the runs that every campaign finished, the channels of all."""
    first = shots[0].dataset
    for shot in shots[1:]:
        if shot.dataset.names != first.names:
            raise UserError(
                f"the shots' campaigns vary different parameters: {', '.join(first.names)} and "
                f"{', '.join(shot.dataset.names)}; run run-doe with the same design for both cases"
            )
    rows = [_rows(shot.dataset, first.parameters) for shot in shots]
    common = np.all([row >= 0 for row in rows], axis=0)
    if common.sum() < len(first.names) + 2:
        raise UserError(
            f"the shots' campaigns have {common.sum()} points in common; run the other case on the first one's points: "
            "birdstrike run-doe CASE --out DIR --design FIRST/design.csv"
        )
    end = min(shot.dataset.time[-1] for shot in shots)
    time = first.time[first.time <= end * (1.0 + 1e-9)]
    curves: dict[str, Array] = {}
    units: dict[str, str] = {}
    drifts: dict[str, float] = {}
    smooth = np.ones(int(common.sum()), dtype=bool)
    for i, (shot, row) in enumerate(zip(shots, rows, strict=True)):
        chosen = row[common]
        smooth &= shot.dataset.smooth[chosen]
        for name, values in shot.dataset.curves.items():
            curves[name + suffix(i)] = np.stack([np.interp(time, shot.dataset.time, values[j]) for j in chosen])
            units[name + suffix(i)] = shot.dataset.channel_units[name]
        drifts |= {name + suffix(i): drift for name, drift in shot.dataset.drifts.items()}
    return replace(
        first,
        runs=first.runs[common],
        parameters=first.parameters[common],
        time=time,
        curves=curves,
        channel_units=units,
        smooth=smooth,
        drifts=drifts,
    )


def _rows(dataset: Dataset, points: Array) -> NDArray[np.int64]:
    """Row of the data set at each point (n, k), -1 where it has none."""
    apart = np.abs(dataset.to_unit(dataset.parameters)[None] - dataset.to_unit(points)[:, None]).max(axis=2)
    nearest = apart.argmin(axis=1)
    return np.where(apart[np.arange(len(points)), nearest] < 1e-9, nearest, -1)


def _measured(records: Sequence[Measured], offsets: Sequence[float]) -> Measured:
    """All records on one clock, gaps where a record has no sample; record i is `offsets[i]` [s] late."""
    return on_one_clock(
        [
            replace(
                record,
                time=record.time - t0,
                channels={name + suffix(i): values for name, values in record.channels.items()},
                sigma={name + suffix(i): values for name, values in record.sigma.items()},
                units={name + suffix(i): unit for name, unit in record.units.items()},
                read_before={name + suffix(i): known for name, known in record.read_before.items()},
                provenance=tuple(f"{record.path}: {line}" for line in record.provenance),
            )
            for i, (record, t0) in enumerate(zip(records, offsets, strict=True))
        ]
    )


def _columns(shots: Sequence[CampaignShot], dataset: Dataset) -> Columns:
    """Every shot's own columns on its own channels, and the clocks of all but the first."""

    def columns(observations: Observations, mode: Mode) -> Array:
        blocks = [_own(shot, i, observations, mode, dataset) for i, shot in enumerate(shots)]
        return np.asarray(block_diag(*blocks), dtype=np.float64)

    return columns


def _own(shot: CampaignShot, number: int, observations: Observations, mode: Mode, dataset: Dataset) -> Array:
    """One shot's columns (points of its channels, s)."""
    mine = tuple(
        replace(c, name=c.name.removesuffix(suffix(number)))
        for c in observations.channels
        if shot_number(c.name) == number
    )
    own = replace(observations, channels=mine)
    parts: list[Array] = [np.zeros((len(own.values), 0))]
    if shot.columns is not None:
        parts.append(shot.columns(own, mode))
    if number and shot.options.time_offset:
        nearest = dataset.nearest(mode.theta)
        slopes = [_slope(dataset, nearest, c.name + suffix(number), c.times - mode.t0) for c in mine]
        parts.append(shot.options.time_offset * np.concatenate(slopes)[:, None])
    return np.hstack(parts)


def shot_number(name: str) -> int:
    """The shot of a joint record's channel, from 0: the reverse of `suffix`."""
    _, sign, number = name.rpartition("@")
    return int(number) - 1 if sign else 0


def _slope(dataset: Dataset, run: int, channel: str, times: Array) -> Array:
    """Rate of a run's curve [SI/s] at `times`."""
    return np.interp(times, dataset.time, np.gradient(dataset.curves[channel][run], dataset.time), left=0.0)
