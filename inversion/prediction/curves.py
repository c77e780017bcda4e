"""All of a prediction together: the model at every draw, the errors of mesh and emulator, the model's own error."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array, side_of
from birdstrike.inversion.diagnosis.preparation.shots import fault_named
from birdstrike.inversion.estimation.mesh_correction import EXTRAPOLATED
from birdstrike.inversion.prediction.campaign import Campaign
from birdstrike.inversion.prediction.carry_over import ANEW, Carried, same_sensor
from birdstrike.inversion.prediction.discrepancy import realisations
from birdstrike.inversion.prediction.distance import Distance
from birdstrike.inversion.prediction.learnt import Learnt
from birdstrike.inversion.prediction.sample import EFFECT, Sample, Tolerance
from birdstrike.solver.effects.fault import AS_IT_IS
from birdstrike.surrogate.emulator import CurveEmulator

DRAWS = 2000
PARTS = ("discrepancy", "mesh", "emulator")


@dataclass(frozen=True)
class SensorDraws:
    """One sensor's draws.

    model: (n, m) SI at every draw, the finer mesh's mean in it; learnt: (n, m) SI, the model error that the records let
    expect of the draw; parts: source -> (n, m) SI that is added to both, of mean 0; sample: the draws; distinct: how
    many of the posterior's draws stand behind them; nominal: (n,) largest reading of model and learnt error with
    tolerances at their values; loose: (n,) that of the likeliest draw's model with tolerances as drawn; emulated:
    whether by an emulator, else by the simulated draws themselves; side: of 0 (1 or -1) on which largest readings are
    sought, that of the median curve.
    """

    time: Array
    unit: str
    kind: str
    model: Array
    learnt: Array
    parts: Mapping[str, Array]
    sample: Sample
    distinct: float
    nominal: Array
    loose: Array
    emulated: bool
    side: float

    def tops(self, curves: Array) -> Array:
        """(n,) largest reading of curves (n, m)."""
        return _tops(curves, self.side)

    @property
    def values(self) -> Array:
        """(n, m) predicted readings."""
        return self.model + self.learnt + sum(self.parts.values())


@dataclass(frozen=True)
class Setting:
    """What every sensor's draws are made of."""

    learnt: Learnt
    carried: Mapping[str, Carried]
    tolerances: Mapping[str, Tolerance]
    campaign: Campaign
    where: Distance
    seed: int

    @property
    def held(self) -> dict[str, float]:
        """Column of a tolerance, or of an effect that is drawn anew -> its value where nothing is drawn."""
        found = {key: one.value for key, one in self.tolerances.items()}
        anew = (one for one in self.carried.values() if one.how == ANEW and not one.sensors)
        return found | {EFFECT + one.name: 0.0 for one in anew if EFFECT + one.name in self.campaign.points.values}


def sensor_draws(setting: Setting, name: str, sample: Sample) -> SensorDraws:
    """The draws of one sensor; sample: those at which an emulator is asked, else their explanations' simulated ones."""
    campaign, rng = setting.campaign, np.random.default_rng([setting.seed, sum(name.encode())])
    sensor = campaign.case.sensors[name]
    emulated = campaign.emulated(name)
    if not emulated:
        sample, chosen = _resampled(campaign, np.unique(sample.explanation), rng)
    n = len(sample)
    mesh_mean = campaign.mesh_mean(name)
    if emulated:
        model, errors = _emulated(campaign, name, sample, rng)
        nominal, _ = _emulated(campaign, name, sample.fixed(setting.held), None)
        centre = _centre(sample)
        moved = _emulated(campaign, name, _about(sample, centre, setting.held), None)[0]
        nominal, moved = nominal + mesh_mean, moved + mesh_mean
        distinct = float(len(np.unique(np.stack([sample.explanation, sample.row]), axis=1).T))
    else:
        model, errors = campaign.curves[name][chosen], np.zeros((n, len(campaign.time)))
        counts = np.bincount(chosen) / n
        distinct = float(1.0 / (counts**2).sum())
    model = _faulty(setting, sample, name, model + mesh_mean)
    learnt, deviations, finer = _discrepancy(setting, name, sample, model, rng)
    side = side_of(np.median(model + learnt, axis=0))
    if emulated:
        tops = _tops(_faulty(setting, sample, name, nominal) + learnt, side), _tops(moved, side)
    else:
        tops = _regressed(sample, _tops(model + learnt, side), list(setting.held))
    parts = {
        "discrepancy": deviations,
        "mesh": campaign.mesh_draws(name, n, rng) + finer,
        "emulator": errors,
    }
    return SensorDraws(
        campaign.time, sensor.unit, sensor.kind, model, learnt, parts, sample, distinct, *tops, emulated, side
    )


def _tops(curves: Array, side: float) -> Array:
    """(n,) reading of curves (n, m) that lies farthest on one side of 0."""
    return np.asarray(side * (side * curves).max(axis=-1))


def _resampled(
    campaign: Campaign, explanations: NDArray[np.int64], rng: np.random.Generator
) -> tuple[Sample, NDArray[np.int64]]:
    """The explanations' simulated draws by their weights, as often as it takes to have DRAWS: systematic resampling."""
    of = np.isin(campaign.points.explanation, explanations)
    weights = np.where(of, campaign.points.weights, 0.0)
    edges = np.cumsum(weights if weights.any() else of.astype(float))
    chosen = np.searchsorted(edges, (np.arange(DRAWS) + rng.random()) / DRAWS * edges[-1])
    chosen = np.minimum(chosen, len(edges) - 1)
    return campaign.points.take(chosen), chosen


def _emulated(campaign: Campaign, name: str, sample: Sample, rng: np.random.Generator | None) -> tuple[Array, Array]:
    """(n, m) mean curves and, with a generator, draws of the emulator's error."""
    mean, errors = np.zeros((len(sample), len(campaign.time))), np.zeros((len(sample), len(campaign.time)))
    for family in campaign.families:
        of = np.flatnonzero(np.isin(sample.explanation, family.members))
        one = family.curve(name)
        if not len(of) or one is None or family.emulator is None:
            continue
        u = family.emulator.inputs(np.stack([sample.column(key)[of] for key in family.keys], axis=1))
        mean[of] = one.curves(u, campaign.time)
        if rng is not None:
            errors[of] = _errors(one, u, campaign.time, rng)
    return mean, errors


def _errors(one: CurveEmulator, u: Array, times: Array, rng: np.random.Generator) -> Array:
    """(n, m) draws of the error at scaled features u (n, d)."""
    n, kept = len(u), len(one.processes)
    rows = rng.standard_normal((n, one.remainder.shape[0])) @ one.remainder_at(times).T
    rows *= np.sqrt(one.nearby.at(u))[:, None]
    rows += rng.standard_normal((n, len(times))) * np.sqrt(one.outside_at(times))
    if kept:
        sd = np.sqrt(np.stack([process.variance(u) for process in one.processes], axis=1))
        rows += (rng.standard_normal((n, one.mixing.shape[1])) @ one.mixing.T * sd) @ one.at(times)[1][:kept]
    return rows


def _centre(sample: Sample) -> int:
    """The draw of the likeliest explanation that lies nearest to its median."""
    counts = np.bincount(sample.explanation, weights=sample.weights)
    own = np.flatnonzero(sample.explanation == int(counts.argmax()))
    distance = np.zeros(len(own))
    for column in sample.values.values():
        values = column[own]
        if np.isfinite(values).all() and values.std() > 0.0:
            distance += ((values - np.median(values)) / values.std()) ** 2
    return int(own[distance.argmin()])


def _about(sample: Sample, centre: int, held: Mapping[str, float]) -> Sample:
    """Every column at one draw's, but for those that tolerances move."""
    values = {
        key: column if key in held else np.full(len(sample), column[centre]) for key, column in sample.values.items()
    }
    return replace(sample, values=values, explanation=np.full(len(sample), sample.explanation[centre]))


def _regressed(sample: Sample, tops: Array, held: list[str]) -> tuple[Array, Array]:
    """Largest readings without and with only what tolerances move, from a linear regression on these."""
    columns = [sample.values[key] for key in held if key in sample.values]
    moving = [c - c.mean() for c in columns if np.isfinite(c).all() and np.ptp(c) > 0.0]
    if not moving:
        return tops, np.zeros(len(tops))
    x = np.stack(moving, axis=1)
    explained = x @ np.linalg.lstsq(x, tops - tops.mean(), rcond=None)[0]
    return tops - explained, explained


def _faulty(setting: Setting, sample: Sample, name: str, curves: Array) -> Array:
    """The curves as the sensor reads them, with the errors of its instrument."""
    found, instrument = curves.copy(), setting.campaign.case.instrument.get(name, AS_IT_IS)
    for label, sizes in sample.faults.items():
        one = setting.carried[label]
        if name not in one.sensors:
            continue
        for i in np.flatnonzero(sizes):
            found[i] += fault_named(one.name).change(float(sizes[i]), setting.campaign.time, curves[i], instrument)
    return found


def _discrepancy(
    setting: Setting, name: str, sample: Sample, model: Array, rng: np.random.Generator
) -> tuple[Array, Array, Array]:
    """(n, m) SI: the model error that the records let expect, what they leave open of it, and of a still finer mesh."""
    case, where, learnt = setting.campaign.case, setting.where, setting.learnt
    same = same_sensor(learnt.case, case, name)
    errors = [shot.errors.get(name) if same else None for shot in where.shots]
    times = setting.campaign.time - case.first_contact
    found = np.zeros((3, *model.shape))
    peak = float(np.median(np.abs(model).max(axis=1)))
    finer = EXTRAPOLATED * setting.campaign.mesh_mean(name) / (peak or 1.0)
    for i in np.unique(sample.explanation):
        of = np.flatnonzero(sample.explanation == i)
        one, kind = learnt.explanations[int(i)], case.sensors[name].kind
        found[:, of] = peak * np.array(realisations(one, sample.row[of], errors, kind, times, finer, where, rng))
    return found[0], found[1], found[2]
