"""One shot: its record as a diagnosis reads it, and everything of the setup carried to the record's points.

A record is cut to the simulated time; neighbouring instants are averaged where there are more than the model can use.

Instrument effects as signatures on the model's own curve: clock, gain, bandwidth, drift; in common and per sensor.

What a fault changes is known exactly (`solver.effects.fault`), so that no simulation is needed. It stands beside what
the case declares of the instrument.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag
from scipy.sparse import csr_matrix

from birdstrike.data.curves import Measured
from birdstrike.data.errors import MeasuredError
from birdstrike.data.formatting import plain
from birdstrike.data.histories import Array, Indices
from birdstrike.inversion.diagnosis.preparation.discrepancy import Shape, process_modes, shape_of
from birdstrike.inversion.diagnosis.preparation.plan import COARSE_PARTICLES
from birdstrike.inversion.diagnosis.preparation.setup import Setup
from birdstrike.inversion.observations import reader as observed
from birdstrike.inversion.observations.baseline import Baseline
from birdstrike.inversion.observations.expected import Expected
from birdstrike.inversion.observations.noise import Noise
from birdstrike.inversion.observations.reader import ChannelRecord
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.overlay import Raw
from birdstrike.solver.effects.effect import Effect
from birdstrike.solver.effects.fault import AS_IT_IS, Fault
from birdstrike.solver.effects.instrument import GAIN, able, settings_with, transducers
from birdstrike.solver.effects.registry import effect_named, effects
from birdstrike.solver.sensors.instrument import LEAST_GAIN, Instrument

WIDEST = 10.0  # plausible sizes that are looked for: these signatures are exact
ROUNDING = 1e-12  # of the least gain: what a product of gains may miss it by


@dataclass(frozen=True)
class InstrumentEffect:
    """One fault. sensors: those that it acts on; label: `sensor_gain` or `sensor_gain.displacement_centre`.

    least: smallest magnitude that means anything, in plausible sizes; -inf: none.
    """

    effect: Effect
    size: float
    sensors: tuple[str, ...]
    label: str
    least: float = -np.inf

    @property
    def fault(self) -> Fault:
        """What it does to one instrument."""
        assert self.effect.fault is not None, "an effect of the instruments has a fault"
        return self.effect.fault

    @property
    def one_sided(self) -> bool:
        """Whether 0 is the smallest magnitude."""
        return self.least == 0.0

    @property
    def limits(self) -> tuple[float, float]:
        """Plausible sizes between which it is looked for."""
        largest = WIDEST if self.fault.largest is None else self.fault.largest / self.size
        return max(self.least, -largest), largest

    @property
    def ends(self) -> bool:
        """Whether nothing can lie below the lower limit."""
        return self.limits[0] == self.least

    @property
    def bends(self) -> bool:
        """Whether what it changes is no multiple of its size: late and slow are alike to first order alone."""
        return self.fault.bends


def instrument_effects(case: Case, channels: Sequence[str]) -> tuple[InstrumentEffect, ...]:
    """Faults in common, then sensor by sensor where that is another fault than the common one."""
    found: list[InstrumentEffect] = []
    for name, effect in effects().items():
        if effect.fault is None:
            continue
        alone = able(case, effect.fault, channels)
        common = alone if effect.fault.common else tuple(c for c in _own(case, channels) if c in alone)
        acting = [(common, name)] if common else []
        acting += [((c,), f"{name}.{c}") for c in alone if common != (c,)]
        size = effect.size(case)
        found += [InstrumentEffect(effect, size, on, label, _least(case, effect, on) / size) for on, label in acting]
    return tuple(found)


def _least(case: Case, effect: Effect, sensors: Sequence[str]) -> float:
    """Smallest magnitude of a fault of some sensors [SI]: of a gain one with which a case can state all of theirs."""
    if effect.fault is not GAIN:
        return effect.least(case)
    smallest = min(case.instrument.get(sensor, AS_IT_IS).gain for sensor in sensors)
    return LEAST_GAIN * (1.0 + ROUNDING) / smallest - 1.0


def _own(case: Case, channels: Sequence[str]) -> tuple[str, ...]:
    return tuple(c for c in transducers(case) if c in channels)


def with_faults(case: Case, faults: Iterable[tuple[str, str, float]]) -> Case:
    """The case with faults of single sensors beside what it declares: sensor, name of the effect, magnitude [SI].

    They are written beside the instruments without the case's effects, which act on top of them.
    """
    table: dict[str, Raw] = {}
    declared = case.with_effects({})
    for sensor, name, x in faults:
        table.setdefault(sensor, {}).update(settings_with(declared, fault_named(name), x, sensor))
    return case.overlaid({"instrument": table}) if table else case


def beside_declared(case: Case, name: str, magnitude: float) -> float:
    """Magnitude [SI] of an effect together with what the case declares of it.

    Only an instrument's can be there twice: what the case states of another effect is not looked for.
    """
    fault = effect_named(name).fault
    return magnitude if fault is None else fault.combined(case.effects.get(name, 0.0), magnitude)


def fault_named(name: str) -> Fault:
    """What the effect of that name does to one instrument; raises KeyError where it is no effect of the instruments."""
    fault = effects()[name].fault
    if fault is None:
        raise KeyError(name)
    return fault


MOST_POINTS = 400  # of all channels together: beyond it, neighbours are averaged
FEWEST_POINTS = 3
PROCESS = 40  # directions a channel of a process of numerical error


@dataclass(frozen=True)
class Trace:
    """One channel: instants (raw,) [s] on the record's clock, of which each `block` neighbours make one point.

    values: (n,) SI, the means of the blocks; noise: of one instant; peak: largest magnitude, SI; rest: what the sensor
    reads at rest, which has been subtracted.
    """

    name: str
    unit: str
    times: Array
    block: int
    values: Array
    noise: Noise
    peak: float
    rest: Baseline | None = None

    @property
    def middle(self) -> Array:
        """(n,) mean instant of every point [s]."""
        return averaged(self.times, self.block)

    @property
    def level(self) -> float:
        """Typical standard deviation of a point's noise, SI."""
        return float(np.sqrt(np.diag(self.covariance()).mean()))

    def covariance(self) -> Array:
        """(n, n) of the measurement noise of the points, and of what is uncertain in the reading at rest."""
        noise = self.noise.covariance(self.times, self.block)
        if self.rest is None:
            return noise
        columns = averaged(self.rest.columns(self.times).T, self.block)
        return noise + columns.T @ columns


@dataclass(frozen=True)
class Record:
    """All channels, one after the other, and what the user should know about how they were read."""

    traces: tuple[Trace, ...]
    warnings: tuple[str, ...]

    @property
    def values(self) -> Array:
        """(n,) stacked."""
        return np.concatenate([trace.values for trace in self.traces])

    @property
    def middle(self) -> Array:
        """(n,) stacked instants [s]."""
        return np.concatenate([trace.middle for trace in self.traces])

    @property
    def channel(self) -> np.ndarray:
        """(n,) number of the channel of every point."""
        return np.repeat(np.arange(len(self.traces)), [len(trace.values) for trace in self.traces])

    def covariance(self) -> Array:
        """(n, n) of the measurement noise; channels are independent."""
        return np.asarray(block_diag(*(trace.covariance() for trace in self.traces)))


def averaged(values: Array, block: int) -> Array:
    """Means (..., n) of `block` neighbours of values (..., raw)."""
    if block == 1:
        return values
    return values.reshape(*values.shape[:-1], -1, block).mean(axis=-1)


def read_record(measured: Measured, expected: Expected) -> Record:
    """The record's channels as the common reader gives them, neighbours averaged where there are many.

    What a sensor reads at rest is subtracted as in a calibration, but for the drift of a displacement, which is one of
    the effects that are looked for.

    Raises MeasuredError for an unknown channel, another unit, or a channel with fewer than three points in the window.
    """
    channels = observed.read_record(measured, expected, FEWEST_POINTS, zero=True, keep_drift=True)
    most = max(MOST_POINTS // len(channels), FEWEST_POINTS)
    warnings = tuple(text for channel in channels for text in channel.warnings)
    return Record(tuple(_trace(channel, most) for channel in channels), warnings)


def _trace(channel: ChannelRecord, most: int) -> Trace:
    """At most `most` points, each the mean of as many neighbours."""
    count = len(channel.times)
    block = -(-count // most)
    kept = np.arange(count - count % block)
    values = averaged(channel.values[kept], block)
    return Trace(
        name=channel.name,
        unit=channel.unit,
        times=channel.times[kept],
        block=block,
        values=values,
        noise=channel.noise.at(kept),
        peak=channel.peak,
        rest=channel.baseline if channel.zeroed else None,
    )


TIME_OFFSET = "time_offset"
NUISANCE_EFFECT = {
    "time_offset": TIME_OFFSET,
    "speed": "impact_speed",
    "mass": "bird_mass",
    "thickness": "plate_thickness",
    "angle": "impact_angle",
}
"""Name under `inversion.nuisance` -> effect whose signature it has."""
LATEST_SHIFT = 6e-5  # s: three plausible sizes of the time offset, which the record's end leaves free


@dataclass(frozen=True)
class Shot:
    """A record with its setup and a bird of its own. baseline: nothing is suspected in it."""

    name: str
    setup: Setup
    record: Record
    baseline: bool = False

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kind of sensor of every channel of the record."""
        return tuple(self.setup.plan.case.sensors[trace.name].kind for trace in self.record.traces)

    @property
    def onset(self) -> float:
        """When the discrepancy may begin [s]: contact, less the time in which a layer of particles arrives.

        The first contact of a bird of particles is smeared by one spacing, of a fine bird as of a coarse one.
        """
        case, fine = self.setup.plan.case, self.setup.plan.fine
        spacing = (fine.bird.volume / fine.bird.particles) ** (1.0 / 3.0)
        return case.first_contact - spacing / case.normal_speed

    @property
    def channels(self) -> tuple[str, ...]:
        """The record's channels in its order."""
        return tuple(trace.name for trace in self.record.traces)

    @cached_property
    def sampler(self) -> csr_matrix:
        """(n, grid): a stacked curve's means over the record's blocks, linear between the clock's instants."""
        time, m = self.setup.time, len(self.setup.time)
        rows: list[Indices] = []
        columns: list[Indices] = []
        weights: list[Array] = []
        first = 0
        for trace in self.record.traces:
            begin = m * self.setup.channels.index(trace.name)
            i = np.asarray(np.clip(np.searchsorted(time, trace.times) - 1, 0, m - 2), dtype=np.intp)
            w = np.clip((trace.times - time[i]) / (time[i + 1] - time[i]), 0.0, 1.0)
            row = np.asarray(first + np.arange(len(trace.times)) // trace.block, dtype=np.intp)
            rows += [row, row]
            columns += [begin + i, begin + i + 1]
            weights += [(1.0 - w) / trace.block, w / trace.block]
            first += len(trace.values)
        at = (np.concatenate(rows), np.concatenate(columns))
        shape = (first, m * len(self.setup.channels))
        return csr_matrix((np.concatenate(weights), at), shape=shape)

    def sample(self, curves: Array) -> Array:
        """(q, n) of curves (q, grid)."""
        return np.asarray((self.sampler @ curves.T).T)

    def instrument_signature(self, fault: InstrumentEffect, grid: Array, h: float = 0.0) -> Array:
        """(n,) derivative of the record, by plausible sizes of a fault, where it has h of them; curves (grid,)."""
        of, time = fault.fault.signature, self.setup.time
        return self._of_sensors(fault, grid, lambda part, own: of(fault.size, time, part, h, own))

    def instrument_change(self, fault: InstrumentEffect, grid: Array, h: float) -> Array:
        """(n,) change of the record by a fault of h plausible sizes, on the curves (grid,)."""
        of, time = fault.fault.change, self.setup.time
        return self._of_sensors(fault, grid, lambda part, own: of(h * fault.size, time, part, own))

    def _of_sensors(self, fault: InstrumentEffect, grid: Array, of: Callable[[Array, Instrument], Array]) -> Array:
        """(n,) at the record's points: of a fault's sensors what `of` makes of their curves, 0 of the others."""
        instruments = self.setup.plan.case.instrument
        parts = [
            of(part, instruments.get(c, AS_IT_IS)) if c in fault.sensors else 0.0 * part
            for c, part in self.setup.split(grid).items()
        ]
        return self.sample(np.concatenate(parts)[None])[0]

    @property
    def nuisances(self) -> dict[str, float]:
        """Standard deviation [SI] of each uncertainty that the shot's case states and that has a signature."""
        stated = self.setup.plan.case.inversion.nuisance
        able = {*self.setup.responses, TIME_OFFSET}
        return {name: sigma for name, sigma in stated.items() if sigma > 0.0 and NUISANCE_EFFECT[name] in able}

    def nuisance_signature(self, name: str, z: Array, grid: Array) -> Array:
        """(n,) change of the record by one SI unit of an uncertain quantity, at parameters z (k,), curves (grid,)."""
        effect = NUISANCE_EFFECT[name]
        if effect == TIME_OFFSET:
            faults = instrument_effects(self.setup.plan.case, self.setup.channels)
            clock = next(fault for fault in faults if fault.label == TIME_OFFSET)
            return self.instrument_signature(clock, grid) / clock.size
        return self.response_to(effect, z) / self.setup.responses[effect].known.size

    def response_to(self, effect: str, z: Array) -> Array:
        """(n,) change of the record for h = 1 by an effect of the solver, small as it is, at parameters z (k,)."""
        return self.sample(self.setup.responses[effect].at(z)[None])[0]

    @cached_property
    def scatter(self) -> Array:
        """(r, n) rows whose products sum to the covariance by which runs differ, of mean square 1 on the setup's grid.

        The rows are the setup's, the same for all shots, whatever their clocks.
        """
        return self.sample(self.setup.scatter)

    @cached_property
    def lattice_moves(self) -> Array:
        """(r, n) SI, what another lattice moves at each point of `Setup.lattice_moves`; read once for all fits."""
        return self.sample(self.setup.lattice_moves)

    @cached_property
    def process_modes(self) -> tuple[Array, ...]:
        """(n, q) of every channel: the largest directions of a process of numerical error of variance 1."""
        return tuple(
            process_modes(trace.middle, self.onset, 0.5 * self.shapes[trace.name].length, PROCESS)
            for trace in self.record.traces
        )

    @cached_property
    def shapes(self) -> dict[str, Shape]:
        """channel -> the discrepancy in time, from what meshes differ by."""
        draws = self.setup.split(self.setup.mesh_draws)
        middle = self.setup.split(self.setup.grid(np.full((1, len(self.setup.lows)), 0.5))[0])
        return {channel: shape_of(part, middle[channel], self.setup.time) for channel, part in draws.items()}


def setups_of(shots: Sequence[Shot]) -> list[Setup]:
    """The shots' setups, each once, in their order."""
    return list({id(shot.setup): shot.setup for shot in shots}.values())


def responses_of(shots: Sequence[Shot]) -> tuple[str, ...]:
    """Effects of the solver that the case of any of the shots can carry, those of the first before the others'."""
    return tuple(dict.fromkeys(name for shot in shots for name in shot.setup.responses))


def unpredicted(setup: Setup, channels: Iterable[str]) -> str:
    """Why channels are left out, and what to do."""
    shares, fine, declared = setup.unpredictable, setup.plan.fine.bird.particles, setup.plan.case.bird.particles
    moved = ", ".join(f"{plain(name)} by {100 * shares[name]:.0f} %" for name in channels if name in shares)
    enough = f"up to {COARSE_PARTICLES}" if declared < COARSE_PARTICLES else f"beyond {fine}"
    return (
        f"another lattice of the bird's {fine} particles alone moves {moved} of the peak, several times as much as the "
        "quietest sensor, so that neither the bird's parameters nor faults can be read from it: not used; raise "
        f"bird.particles = {declared} {enough}"
    )


def read_shot(name: str, setup: Setup, measured: Measured, baseline: bool = False) -> Shot:
    """The record's channels that the setup has, in the window of the simulation; raises MeasuredError without any."""
    own = {c: measured.channels[c] for c in setup.channels if c in measured.channels}
    if not own:
        raise MeasuredError([f"{measured.path}: {unpredicted(setup, measured.channels)}"])
    expected = Expected.of_case(setup.plan.case, float(setup.time[-1]), LATEST_SHIFT)
    record = read_record(replace(measured, channels=own), expected)
    return Shot(name, setup, record, baseline)
