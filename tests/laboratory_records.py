# ruff: noqa: E501
"""Records as laboratories have them, from the logger's file to the parameters: the table of docs/records.md.

Each record is made from a simulation at parameters of its own, written as some logger would write it, imported by the
command, and inverted with one campaign on a coarse mesh. It must end in an answer whose 95 % interval holds the truth,
or in the word that names its fault; and no interval may miss the truth. The table is made anew by

    python -m tests.laboratory_records docs/records.md
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import tomli_w
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.data.curves import read_measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array, Histories
from birdstrike.doe.campaign.results import load_dataset
from birdstrike.inversion.estimation.locate import InversionOptions
from birdstrike.inversion.forward import Forward
from birdstrike.inversion.invert import invert
from birdstrike.inversion.results.estimates import Estimate
from birdstrike.solver.case.case import load_case
from birdstrike.surrogate.emulator import Emulator, fit_emulator

CENTRE, QUARTER, STRAIN = "displacement_centre", "displacement_quarter", "strain_back"
VISCOSITY, CUTOFF = "bird.material.viscosity", "bird.material.pressure_cutoff"
STATED = {CENTRE: 2e-5, QUARTER: 2e-5, STRAIN: 2e-5}
TIME_OFFSET = 2e-5  # [s] 1 sigma of the case's trigger
STEP = 5e-3  # [ms] of the logger
END = 2.55  # [ms] of the record


@dataclass(frozen=True)
class Bench:
    """What all records share: a campaign, its emulators (by channels), and the model that made the truth."""

    dataset: Dataset
    forward: Forward
    emulators: dict[tuple[str, ...], Emulator] = field(default_factory=dict)

    def emulator(self, channels: tuple[str, ...]) -> Emulator:
        """Fitted once."""
        if channels not in self.emulators:
            self.emulators[channels] = fit_emulator(self.dataset, channels)
        return self.emulators[channels]


@dataclass
class Signal:
    """A record while it is made: clock [ms], displacements [mm], strain, and a source of noise."""

    clock: Array
    displacement: Array
    quarter: Array
    strain: Array
    rng: np.random.Generator

    def white(self, sigma: float) -> Array:
        """White noise [mm]."""
        return sigma * self.rng.normal(size=len(self.clock))


@dataclass(frozen=True)
class Kind:
    """One kind of record.

    name: in words; text: what the logger writes; options: of `birdstrike import`; before: record before t = 0 [ms];
    late: by how much the trigger is late [ms]; word: what must be said, where no answer is due, or besides it; answer:
    whether the viscosity must be identified; encoding: of the file.
    """

    name: str
    text: Callable[[Signal], str]
    options: Sequence[str] = ("--sensor", CENTRE)
    before: float = 0.0
    late: float = 0.0
    word: str = ""
    answer: bool = True
    encoding: str = "utf-8"


def plain(
    values: Callable[[Signal], Array], head: str = "time [ms],w [mm]", shown: str = "{:.3f},{:.6f}"
) -> Callable[[Signal], str]:
    """Two columns, the clock and `values`."""
    return lambda s: "\n".join([head, *(shown.format(t, v) for t, v in zip(s.clock, values(s), strict=True))]) + "\n"


def with_noise(
    sigma: float, more: Callable[[Signal], Array] = lambda s: np.zeros(len(s.clock))
) -> Callable[[Signal], Array]:
    """The displacement with white noise [mm] and what else the instrument adds."""
    return lambda s: s.displacement + s.white(sigma) + more(s)


def german(s: Signal) -> str:
    """Semicolons, decimal commas, a line of units, notes above, NaN where the logger has skipped."""
    values = [f"{v:.5f}" for v in s.displacement + s.white(0.02)]
    values[40] = values[41] = "NaN"
    rows = (f"{t:.3f};{v}".replace(".", ",") for t, v in zip(s.clock, values, strict=True))
    return "\n".join(["Messung 12;Kanal 3", "Zeit;Weg Mitte", "ms;mm", *rows]) + "\n"


def overloaded(s: Signal) -> str:
    """OVL beyond 4.3 mm."""
    values = s.displacement + s.white(0.03)
    rows = (f"{t:.3f}\t{'OVL' if v > 4.3 else f'{v:.4f}'}" for t, v in zip(s.clock, values, strict=True))
    return "\n".join(["t (ms)\tDisp Z (mm)", *rows]) + "\n"


def time_of_day(s: Signal) -> str:
    """Stamps of the day, and volts of 2 mm each."""
    values = (s.displacement + s.white(0.03)) / 2.0
    rows = (f"10:15:{30.0 + 1e-3 * (t - s.clock[0]):.6f},{v:.6f}" for t, v in zip(s.clock, values, strict=True))
    return "\n".join(["Timestamp,CH1 [V]", *rows]) + "\n"


def thousands(s: Signal) -> str:
    """Micrometres with commas for thousands, in quotes."""
    values = 1e3 * (s.displacement + s.white(0.03))
    return (
        "\n".join(["t_us,laser_um", *(f'"{1e3 * t:,.1f}","{v:,.1f}"' for t, v in zip(s.clock, values, strict=True))])
        + "\n"
    )


def stopped(s: Signal) -> Array:
    """The cable breaks at 1.7 ms: zero from then on."""
    return np.where(s.clock > 1.7, 0.0, with_noise(0.03)(s))


def spikes(s: Signal) -> Array:
    values = with_noise(0.03)(s)
    values[[110, 203, 260, 333, 401]] += np.array([3.0, -4.0, 2.0, -2.0, 5.0])
    return values


def rounded(s: Signal) -> Array:
    """A converter of 8 bits over 12.8 mm."""
    return 0.05 * np.round(with_noise(0.01)(s) / 0.05)


def filtered(s: Signal) -> Array:
    """Noise that an amplifier has smoothed over 8 samples."""
    rough = 0.08 * s.rng.normal(size=len(s.clock) + 7)
    return s.displacement + np.convolve(rough, np.full(8, 0.125), "valid") * np.sqrt(8.0) * 0.5


def sparse(s: Signal) -> str:
    """A table read off a plot: 14 points."""
    chosen = np.linspace(60, len(s.clock) - 1, 14).astype(int)
    values = s.displacement + s.white(0.02)
    return "\n".join(["t [ms],w [mm]", *(f"{s.clock[i]:.3f},{values[i]:.4f}" for i in chosen)]) + "\n"


def two_channels(s: Signal) -> str:
    """A laser in inches and a gauge in microstrain."""
    laser, gauge = (s.displacement + s.white(0.02)) / 25.4, 1e6 * s.strain + s.white(20.0)
    rows = (f"{t:.3f},{a:.7f},{b:.2f}" for t, a, b in zip(s.clock, laser, gauge, strict=True))
    return "\n".join(["t [ms],laser [in],SG1 [µm/m]", *rows]) + "\n"


def rows_of(s: Signal, values: Array, shown: str = "{:.3f},{:.5f}") -> list[str]:
    """Clock and values in lines."""
    return [shown.format(t, v) for t, v in zip(s.clock, values, strict=True)]


def whole_export(s: Signal) -> str:
    """Notes, units of volts and millimetres in a second row, a constant channel, a column of text, a summary behind."""
    head = ["DAQ 3000", "Channels,4", "Date,12.03.2024", "Time,CH1,CH2,State", "[ms],[mm],[V],[]"]
    rows = [f"{row},9.998,{'OK' if i % 7 else 'trig'}" for i, row in enumerate(rows_of(s, with_noise(0.02)(s)))]
    return "\n".join([*head, *rows, "", "Maximum,5.3", "End of data"]) + "\n"


def counted(s: Signal) -> str:
    """The number of the sample in the clock's place, and the rate in the head."""
    rows = (f"{i};{v:.4f}" for i, v in enumerate(with_noise(0.02)(s)))
    return "\n".join(["Sampling rate: 200 kHz", "Sample;Laser [mm]", *rows]) + "\n"


def readings(s: Signal) -> str:
    """Readings alone."""
    return "\n".join(["dt = 5 us", "Laser [mm]", *(f"{v:.4f}" for v in with_noise(0.02)(s))]) + "\n"


def since_1970(s: Signal) -> str:
    """Seconds of the computer's clock."""
    rows = (f"{1.7e9 + 1e-3 * t:.6f},{v:.4f}" for t, v in zip(s.clock, with_noise(0.02)(s), strict=True))
    return "\n".join(["timestamp [s],w [mm]", *rows]) + "\n"


def exchanged(s: Signal) -> str:
    """Two lasers, each under the other's name."""
    rows = zip(s.clock, s.quarter + s.white(0.02), s.displacement + s.white(0.02), strict=True)
    return "\n".join(["t [ms],centre [mm],quarter [mm]", *("{:.3f},{:.4f},{:.4f}".format(*row) for row in rows)]) + "\n"


def constant_beside(s: Signal) -> str:
    """A second channel that stands at its end throughout."""
    return "\n".join(["t [ms],a [mm],b [mm]", *(f"{row},9.998" for row in rows_of(s, with_noise(0.02)(s)))]) + "\n"


def saturated(s: Signal) -> Array:
    """The sensor stands at three quarters of the peak; the digitiser's noise is on top."""
    return np.minimum(s.displacement, 0.75 * s.displacement.max()) + s.white(0.02)


def twelve_levels(s: Signal) -> Array:
    return 0.5 * np.round(with_noise(0.02)(s) / 0.5)


def lost_samples(s: Signal) -> Array:
    """One reading in twenty is 0."""
    return np.where(s.rng.random(len(s.clock)) < 0.05, 0.0, with_noise(0.02)(s))


def wrapped(s: Signal) -> Array:
    """A converter that begins anew at -4 mm beyond 4 mm."""
    values = with_noise(0.02)(s)
    return np.where(values > 4.0, values - 8.0, values)


def resampled(s: Signal) -> str:
    """Every eighth sample, and straight lines between them."""
    coarse = np.interp(s.clock, s.clock[::8], with_noise(0.03)(s)[::8])
    return "\n".join(["t [ms],w [mm]", *rows_of(s, coarse)]) + "\n"


def with_blocks_missing(s: Signal) -> str:
    rows = rows_of(s, with_noise(0.02)(s))
    return "\n".join(["t [ms],w [mm]", *(row for i, row in enumerate(rows) if (i // 25) % 3)]) + "\n"


def hum(s: Signal) -> Array:
    return 0.3 * np.sin(2e-3 * np.pi * 50.0 * s.clock + 0.7)


def scope(s: Signal) -> str:
    """A PC oscilloscope: units in brackets in the second row, a blank one, the sign of infinity beyond its range."""
    values = (s.displacement + s.white(0.02)) / 2.0
    rows = (f"{t:.6f},{'∞' if v > 2.2 else f'{v:.6f}'}" for t, v in zip(s.clock, values, strict=True))
    return "\n".join(["Time,Channel A", "(ms),(V)", "", *rows]) + "\n"


def scpi(s: Signal) -> str:
    """9.91E+37 where the instrument has no number."""
    values = s.displacement + s.white(0.03)
    rows = (f"{t:.3f},{'9.91E+37' if v > 4.3 else f'{v:.4E}'}" for t, v in zip(s.clock, values, strict=True))
    return "\n".join(["time [ms],w [mm]", *rows]) + "\n"


def sentinel(s: Signal) -> Array:
    """-999.25 where the acquisition lost its readings."""
    return np.where((s.clock > 1.3) & (s.clock < 1.5), -999.25, with_noise(0.03)(s))


def whole_micrometres(s: Signal) -> str:
    """Whole micrometres with points for thousands."""
    values = 1e3 * (s.displacement + s.white(0.02))
    rows = (f"{1e3 * t:,.0f};{v:,.0f}".replace(",", ".") for t, v in zip(s.clock, values, strict=True))
    return "\n".join(["t [us];w [um]", *rows]) + "\n"


def american(s: Signal) -> str:
    """A date, a time of day with AM, thousandths of an inch."""
    values = (s.displacement + s.white(0.02)) / 25.4e-3
    rows = (
        f"3/12/2024,10:15:{30.0 + 1e-3 * (t - s.clock[0]):.6f} AM,{v:.4f}" for t, v in zip(s.clock, values, strict=True)
    )
    return "\n".join(["Date,Time,Disp [mils]", *rows]) + "\n"


def burst(s: Signal) -> Array:
    """The trigger of the gun couples into the cable: 2 mm, gone within 30 us."""
    age = s.clock - 0.2
    ring = np.where(age >= 0.0, 2.0 * np.exp(-np.maximum(age, 0.0) / 0.01) * np.cos(2e2 * np.pi * age), 0.0)
    return with_noise(0.02)(s) + ring


def drooping(s: Signal) -> Array:
    """An amplifier coupled through a capacitor of 5 ms: y' = x' - y/tau."""
    x, y = s.displacement, np.zeros(len(s.clock))
    keep = np.exp(-STEP / 5.0)
    for i in range(1, len(x)):
        y[i] = keep * (y[i - 1] + x[i] - x[i - 1])
    return y + s.white(0.02)


def drift(s: Signal) -> Array:
    return 0.1 * s.clock


def hum_in_seconds(s: Signal) -> str:
    """Hum of 50 Hz and an offset, on a clock in seconds with negative instants."""
    values = s.displacement + 0.2 * np.sin(2e-3 * np.pi * 50.0 * s.clock + 1.0) - 0.8 + s.white(0.03)
    return "\n".join(["t [s],w [mm]", *rows_of(s, values, "{:.3f}e-3,{:.5f}")]) + "\n"


def both_clipped(s: Signal) -> str:
    """A laser and a gauge that both stood at their ends, strain in per cent."""
    laser, gauge = np.minimum(s.displacement + s.white(0.04), 4.4), 100.0 * s.strain + s.white(0.003)
    gauge = np.minimum(gauge, 75.0 * np.abs(s.strain).max())
    rows = (f"{t:.3f};{a:.4f};{b:.6f}" for t, a, b in zip(s.clock, laser, gauge, strict=True))
    return "\n".join(["t [ms];Laser [mm];DMS [%]", *rows]) + "\n"


def german_thousands(s: Signal) -> str:
    """Micrometres and microseconds with points for thousands and decimal commas."""
    values = 1e3 * (s.displacement + s.white(0.03))
    rows = (f"{1e3 * t:,.1f};{v:,.2f}" for t, v in zip(s.clock, values, strict=True))
    marks = str.maketrans(",.", ".,")
    return "\n".join(["Zeit [us];Weg [um]", *(row.translate(marks) for row in rows)]) + "\n"


def second_laser_stops(s: Signal) -> str:
    """The second laser repeats its last reading from 1 ms on."""
    quarter = s.quarter + s.white(0.03)
    quarter[s.clock > 1.0] = quarter[s.clock <= 1.0][-1]
    rows = zip(s.clock, s.displacement + s.white(0.03), quarter, strict=True)
    return "\n".join(["t [ms],a [mm],b [mm]", *("{:.3f},{:.5f},{:.5f}".format(*row) for row in rows)]) + "\n"


def out_of_order(s: Signal) -> str:
    """Sixty rows stand backwards."""
    rows = rows_of(s, with_noise(0.02)(s))
    return "\n".join(["t [ms],w [mm]", *rows[:200], *rows[260:199:-1], *rows[261:]]) + "\n"


def written_twice(s: Signal) -> str:
    """Every seventh row stands twice."""
    rows = rows_of(s, with_noise(0.02)(s))
    return "\n".join(["t [ms],w [mm]", *(row for i, row in enumerate(rows) for _ in range(1 + (i % 7 == 0)))]) + "\n"


def dated(s: Signal) -> str:
    """A byte order mark, notes, a row of units that says how the clock is written, a European date, decimal commas."""
    values = with_noise(0.02)(s)
    rows = (f"24.11.2026 10:15:{30.0 + 1e-3 * t:09.6f};{v:.5f}" for t, v in zip(s.clock, values, strict=True))
    head = ["\ufeff# Versuch 4", "# Kanal 1: Laser", "Zeit;Weg", "dd.mm.yyyy hh:mm:ss;mm"]
    return "\n".join([*head, *(f"{row[:19]}{row[19:].replace('.', ',')}" for row in rows)]) + "\n"


def standard(s: Signal) -> str:
    """Names and units parted by a stroke, metres and seconds with exponents."""
    values = 1e-3 * with_noise(0.02)(s)
    return "\n".join(["t/s\tw/m", *(f"{1e-3 * t:.6E}\t{v:.7E}" for t, v in zip(s.clock, values, strict=True))]) + "\n"


KINDS = (
    Kind("CSV, noise as stated", plain(with_noise(0.02)), before=0.5),
    Kind("German logger: semicolons, decimal commas, a line of units, NaN", german, before=0.3),
    Kind("noise 0.05 mm where the case states 0.02", plain(with_noise(0.05)), word="the noise stated"),
    Kind("noise 0.2 mm, pre-trigger", plain(with_noise(0.2)), before=1.0, word="the noise stated"),
    Kind("offset of 1.2 mm, pre-trigger", plain(with_noise(0.03, lambda _: np.array(1.2))), before=2.5, word="its zero is taken from there"),
    Kind("the same with --zero", plain(with_noise(0.03, lambda _: np.array(1.2))), ("--sensor", CENTRE, "--zero"), 2.5, word="was subtracted"),
    Kind("clipped at 4 mm", plain(lambda s: np.minimum(with_noise(0.05)(s), 4.0)), before=0.5, word="are clipped"),
    Kind("overload written as OVL", overloaded, before=0.5, word="read as gaps"),
    Kind("hum of 50 Hz, 0.3 mm, pre-trigger of 25 ms", plain(with_noise(0.03, hum)), before=25.0, word="hum of 50 Hz"),
    Kind("drift of 0.1 mm/ms, pre-trigger of 3 ms", plain(with_noise(0.03, lambda s: 0.1 * s.clock)), before=3.0, word="a drift"),
    Kind("wrong sign", plain(lambda s: -with_noise(0.03)(s)), before=0.5, word="--scale displacement_centre=-1", answer=False),
    Kind("wrong unit: metres in the head", plain(with_noise(0.03), "t [ms],w [m]"), word="near a thousand", answer=False),
    Kind("trigger 0.5 ms late", plain(with_noise(0.03)), late=0.5, word='--shift "', answer=False),
    Kind("trigger 0.03 ms late", plain(with_noise(0.03)), late=0.03, before=0.5),
    Kind("dead sensor: zeros", plain(lambda s: 0.0 * s.clock), word="zero everywhere", answer=False),
    Kind("dead sensor: noise", plain(lambda s: s.white(0.03)), word="shows no response", answer=False),
    Kind("cable broken at 1.7 ms", plain(stopped), before=0.5, word="are frozen"),
    Kind("five spikes", plain(spikes), before=0.5, word="far off"),
    Kind("volts, times of day, UTF-16", time_of_day, ("--sensor", f"{CENTRE}=CH1", "--scale", "2 mm/V"), word="times of day", encoding="utf-16"),
    Kind("commas for thousands, micrometres and microseconds", thousands),
    Kind("8-bit converter", plain(rounded), before=0.5),
    Kind("noise smoothed by an amplifier, pre-trigger", plain(filtered), before=2.0, word="correlated"),
    Kind("14 points off a plot", sparse),
    Kind("units in a second row, a constant channel, text, a summary behind", whole_export, ("--sensor", f"{CENTRE}=CH1"), 0.5, word="columns of text"),
    Kind("number of the sample, the rate in the head", counted, ("--sensor", CENTRE), word='--rate "200 kHz" (its head says "Sampling rate: 200 kHz")', answer=False),
    Kind("the same with --rate", counted, ("--sensor", CENTRE, "--rate", "200 kHz")),
    Kind("readings alone, with --rate", readings, ("--sensor", CENTRE, "--rate", "5 us")),
    Kind("clock of two digits", plain(with_noise(0.02), shown="{:.2f},{:.5f}"), word="the clock has too few digits", answer=False),
    Kind("the same with --rate", plain(with_noise(0.02), shown="{:.2f},{:.5f}"), ("--sensor", CENTRE, "--rate", "200 kHz"), 0.3),
    Kind("seconds since 1970", since_1970, word="does it count from another instant", answer=False),
    Kind("seconds under the name of milliseconds", plain(lambda s: with_noise(0.02)(s), shown="{:.3f}e-3,{:.5f}"), word="in another unit", answer=False),
    Kind("two channels exchanged", exchanged, ("--sensor", f"{CENTRE}=centre", "--sensor", f"{QUARTER}=quarter"), 0.3, word="change places", answer=False),
    Kind("a second channel that is constant", constant_beside, ("--sensor", f"{CENTRE}=a", "--sensor", f"{QUARTER}=b"), word="reads 9.998 mm everywhere", answer=False),
    Kind("flat top with noise on it", plain(saturated), before=0.5, word="flat, but for their noise"),
    Kind("12 levels of 0.5 mm", plain(twelve_levels), before=0.5, word="multiples of 0.5 mm"),
    Kind("one sample in twenty lost", plain(lost_samples), before=0.3, word="are dropouts"),
    Kind("converter that overflows at 4 mm", plain(wrapped), before=0.3, word="jumps by", answer=False),
    Kind("resampled from 25 kHz to 200 kHz, no pre-trigger", resampled),
    Kind("every third stretch of 25 rows missing", with_blocks_missing, before=0.3),
    Kind("hum of 50 Hz, 0.3 mm, no pre-trigger", plain(with_noise(0.03, hum))),
    Kind("stated by --sigma ten times too large", plain(with_noise(0.02)), ("--sensor", CENTRE, "--sigma", "0.2 mm"), 0.3),
    Kind("stated by --sigma ten times too small", plain(with_noise(0.1)), ("--sensor", CENTRE, "--sigma", "0.01 mm"), 0.3, word="the noise stated"),
    Kind("laser in inches and strain in µm/m", two_channels, ("--sensor", f"{CENTRE}=laser", "--sensor", f"{STRAIN}=SG1")),
    Kind("oscilloscope: infinity beyond the range, volts", scope, ("--sensor", CENTRE, "--scale", "2 mm/V"), 0.5, word='"∞", the first in line'),
    Kind("9.91E+37 beyond the range", scpi, before=0.5, word='"9.91E+37", the first in line'),
    Kind("-999.25 where readings are lost", plain(sentinel), before=0.5, word="(the same reading in a row)"),
    Kind("whole micrometres, points for thousands", whole_micrometres, before=0.3, word='--decimal ","', answer=False),
    Kind("the same with --decimal", whole_micrometres, ("--sensor", CENTRE, "--decimal", ","), 0.3),
    Kind("date, AM, mils", american, word="times of day"),
    Kind("burst of 2 mm from the trigger", plain(burst), before=0.3, word="jumps by", answer=False),
    Kind("amplifier coupled through a capacitor", plain(drooping), before=0.5, word="cannot produce", answer=False),
    Kind("drift of 0.1 mm/ms, no pre-trigger", plain(with_noise(0.03, drift)), word="unless the sensor drifts"),
    Kind("offset of 0.5 mm, no pre-trigger", plain(with_noise(0.03, lambda _: np.array(0.5))), word="subtract it from the record", answer=False),
    Kind("gain of 2", plain(lambda s: 2.0 * with_noise(0.02)(s)), before=0.3, word="cannot produce", answer=False),
    Kind("record ends before the peak", plain(lambda s: np.where(s.clock < 1.2, with_noise(0.02)(s), np.nan)), before=0.3, answer=True),
    Kind("bracket that rings at 3 kHz, 0.1 mm", plain(with_noise(0.02, lambda s: 0.1 * np.where(s.clock > 0.2, np.sin(6.0 * np.pi * (s.clock - 0.2)), 0.0))), before=0.3, word="cannot produce", answer=False),
    Kind("turned round and offset by 1.2 mm", plain(lambda s: 1.2 - with_noise(0.03)(s)), before=0.5, word="--scale displacement_centre=-1", answer=False),
    Kind("clock of twice the rate", plain(with_noise(0.02)), ("--sensor", CENTRE, "--rate", "400 kHz"), 0.3, word="correct the rate", answer=False),
    Kind("hum of 50 Hz, offset of -0.8 mm, pre-trigger of 8 ms, seconds", hum_in_seconds, before=8.0, word="its zero is taken from there"),
    Kind("turned round, and trigger 0.4 ms late", plain(lambda s: -with_noise(0.03)(s)), before=0.2, late=0.4, word="--scale displacement_centre=-1", answer=False),
    Kind("drift of -0.15 mm/ms and offset of 0.3 mm, pre-trigger of 1 ms", plain(with_noise(0.03, lambda s: 0.3 - 0.15 * s.clock)), before=1.0, word="a drift"),
    Kind("laser and gauge clipped, strain in %", both_clipped, ("--sensor", f"{CENTRE}=Laser", "--sensor", f"{STRAIN}=DMS"), 0.5, word="are clipped"),
    Kind("offset of 2 mm, clipped at 6 mm, --zero", plain(lambda s: np.minimum(with_noise(0.05)(s) + 2.0, 6.0)), ("--sensor", CENTRE, "--zero"), 2.0, word="was subtracted"),
    Kind("UTF-16, points for thousands, decimal commas", german_thousands, before=0.5, encoding="utf-16"),
    Kind("second laser stops at 1 ms", second_laser_stops, ("--sensor", f"{CENTRE}=a", "--sensor", f"{QUARTER}=b"), 0.5, word="why the logger stopped there"),
    Kind("sixty rows stand backwards", out_of_order, before=0.3, word="does not increase; sort the rows", answer=False),
    Kind("every seventh row stands twice", written_twice, before=0.3, word="one for each instant", answer=False),
    Kind("byte order mark, notes, European date, the clock's pattern among the units", dated, word="times of day"),
    Kind("names and units parted by a stroke, metres, exponents", standard),
    Kind("force in kN under the laser's name", plain(with_noise(0.03), "Zeit [ms],Kraft [kN]"), before=2.0, word="has unit N, the sensor m", answer=False),
)  # fmt: skip


@dataclass(frozen=True)
class Ending:
    """How a record ended: the truth and the estimate of the viscosity, the words, and whether that is right."""

    kind: Kind
    truth: Mapping[str, float]
    estimate: Estimate | None
    words: str
    missed: tuple[str, ...]

    @property
    def identified(self) -> bool:
        return self.estimate is not None and self.estimate.identified

    @property
    def right(self) -> bool:
        """No interval misses, the word that is due has been said, and the answer that is due is there."""
        return not self.missed and self.kind.word in self.words and self.identified == self.kind.answer

    @property
    def sentence(self) -> str:
        """The first line that holds the word."""
        return next((line for line in self.words.splitlines() if self.kind.word and self.kind.word in line), "")


def ended(bench: Bench, kind: Kind, folder: Path, seed: int) -> Ending:
    """Make the record, import it by the command and invert it."""
    rng = np.random.default_rng(seed)
    ranges = {
        n: (lo, hi) for n, lo, hi in zip(bench.dataset.names, bench.dataset.lows, bench.dataset.highs, strict=True)
    }
    truth = {name: low + (high - low) * rng.uniform(0.2, 0.8) for name, (low, high) in ranges.items()}
    source, out = folder / f"record_{seed}.txt", folder / f"record_{seed}.csv"
    source.write_text(kind.text(signal(bench.forward(truth), kind, rng)), encoding=kind.encoding)
    here = f"{folder}/"
    shown = CliRunner().invoke(app, ["import", str(source), "--out", str(out), *kind.options], env={"COLUMNS": "400"})
    if shown.exit_code:
        return Ending(kind, truth, None, shown.output.replace(here, ""), ())
    try:
        estimates, warnings = inverted(bench, out, seed)
    except UserError as error:
        return Ending(kind, truth, None, "\n".join([shown.output, str(error)]).replace(here, ""), ())
    missed = tuple(
        name
        for name, one in estimates.items()
        if one.interval_95 is not None and not one.interval_95[0] <= truth[name] <= one.interval_95[1]
    )
    words = "\n".join([shown.output, *warnings]).replace(here, "")
    return Ending(kind, truth, estimates[VISCOSITY], words, missed)


def signal(run: Histories, kind: Kind, rng: np.random.Generator) -> Signal:
    """The run on the logger's clock; before the simulated record the plate is at rest."""
    clock = STEP * np.arange(-round(kind.before / STEP), round((END - kind.late) / STEP))
    at = np.clip(1e-3 * (clock + kind.late), run.time[0], run.time[-1])
    quarter, strain = (run.at(name, at) if name in run.channels else np.zeros(len(at)) for name in (QUARTER, STRAIN))
    return Signal(clock, 1e3 * run.at(CENTRE, at), 1e3 * quarter, strain, rng)


def inverted(bench: Bench, record: Path, seed: int) -> tuple[Mapping[str, Estimate], tuple[str, ...]]:
    """Parameters and warnings, by the emulator and with linearised intervals."""
    measured = read_measured(record)
    options = InversionOptions(
        method="emulator", seed=seed, noise=STATED, time_offset=TIME_OFFSET, sampling=None, analyse=False
    )
    emulator = bench.emulator(tuple(measured.channels))
    found = invert(bench.dataset, measured, bench.forward, options, emulator=emulator).inversion
    return found.methods["emulator"].parameters, found.warnings


def solver_bench(folder: Path) -> Bench:
    """The synthetic strike with 300 particles and 25 runs."""
    table = load_case("synthetic_strike", {"bird.particles": "300", "plate.elements": "[16, 12]"}).table
    for name in list(table["inversion"]["parameters"]):
        if name not in (VISCOSITY, CUTOFF):
            del table["inversion"]["parameters"][name]
    path = folder / "laboratory.toml"
    path.write_bytes(tomli_w.dumps(table).encode())
    arguments = ["run-doe", str(path), "--out", str(folder / "doe"), "--design", "lhs", "--runs", "25"]
    made = CliRunner().invoke(app, arguments)
    assert made.exit_code == 0, made.output
    case = load_case(path)

    def forward(theta: Mapping[str, float]) -> Histories:
        import birdstrike

        return birdstrike.simulate(case.with_values(theta))

    return Bench(load_dataset(folder / "doe"), forward)


def table(endings: Sequence[Ending], seconds: float) -> str:
    """The page."""
    right = sum(ending.right for ending in endings)
    answers = sum(ending.identified for ending in endings)
    missed = sum(len(ending.missed) for ending in endings)
    head = [
        "# Records as laboratories have them",
        "",
        f"{len(endings)} records, each made from a simulation at parameters of its own, written as some logger would write",
        "it, imported by `birdstrike import` and inverted with one campaign (25 runs of `synthetic_strike` with 300 particles",
        "and 16 x 12 shells; noise stated 0.02 mm, trigger known to 0.02 ms). Sought: viscosity and pressure cutoff; a single",
        "displacement curve seldom identifies the cutoff, so the table shows the viscosity. The model is the same solver on",
        "the same mesh, so nothing here says how right the mesh is.",
        "",
        f"{right} of {len(endings)} end as they should: in an answer whose 95 % interval holds the truth ({answers} with an answer), or in",
        f"a message that names the fault. Intervals of either parameter that miss the truth: {missed}.",
        f"Made in {seconds:.0f} s by `python -m tests.laboratory_records docs/records.md`.",
        "",
        *DRIFT,
        "",
        *GAIN,
        "",
        *BEFORE_CONTACT,
        "",
        "| record | truth [Pa s] | 95 % interval [Pa s] | message |",
        "|---|---|---|---|",
    ]  # fmt: skip
    return "\n".join([*head, *map(_row, endings)]) + "\n"


DRIFT = (
    "A drift that is as slow as the response, in a record without a pre-trigger to show it, changes the estimate of the bird's",
    "viscosity. Where the residual of the best fit is not noise and no reading before contact excludes a drift, the fit is",
    "therefore repeated with an offset and a drift of the sensor as nuisances (5 % of the peak each, 1 sigma, or what the",
    "readings before contact leave of that). The repeated fit is kept where it gains clearly and its residual is no longer",
    "correlated in time, or no more than noise behind a filter is. A warning says so, because a missing effect can look the same. A drift of 0.1 mm/ms gave 609 to 731 Pa s",
    "without this step (truth 576) and gives 516 to 624 with it. Records of a simulation are not treated so: they have no sensor.",
    "To measure the drift instead, at no cost in the width of the interval, record some milliseconds before contact.",
)
GAIN = (
    "A gain that is wrong by some per cent cannot be found in a record: another viscosity makes much the same curve. In records of",
    "500 Pa s a gain of 1.02 gave 514 to 617 Pa s without a warning, and one of 1.05 gave 620 to 720, with the warning that the",
    "residual is not noise. Calibrate the measuring chain before the shot, and state a known gain by `instrument.<sensor>.gain`.",
)
BEFORE_CONTACT = (
    "What the reader takes from the record before contact was measured without an inversion, on a pulse of 5 mm. Of noise that a filter has",
    "smoothed it gives the diagnosis a first-order process, whose chi-square a point of the noise alone is 1 where its covariance is right",
    "(means of 24 records; white noise 1.00 to 1.06). Below 1 the intervals are too wide. A pre-trigger of less than ten correlation times",
    "(0.16 ms with noise of 5 kHz: level 0.6 of the true one, chi-square 3.4) is too short to tell either.",
    "",
    "| noise before contact | 0.16 ms | 1.16 ms | 3.16 ms | right noise levels rejected at 1.16 ms, of 24 |",
    "|---|---|---|---|---|",
    "| 20 kHz, two poles, 1 MHz | 1.20 | 0.78 | 0.80 | 0 |",
    "| 50 kHz, two poles, 1 MHz | 1.54 | 1.26 | 1.29 | 1 |",
    "| 20 kHz, two poles, 200 kHz | 1.00 | 0.98 | 0.94 | 0 |",
    "| 20 kHz, one pole, 1 MHz | 1.27 | 1.10 | 1.12 | 1 |",
    "| 5 kHz, two poles, 1 MHz | 3.37 | 0.34 | 0.35 | 0 |",
    "| 10 kHz, four poles, 200 kHz | 0.80 | 0.45 | 0.46 | 1 |",
    "",
    "| zero before contact | what is made of it |",
    "|---|---|",
    '| hum of 50 Hz, 0.3 mm, pre-trigger of 13.5 to 15.8 ms, 16 phases each | the record "bends before contact as a mains hum" does (62 of 64; its noise is right, its zero is not known), or a drift that may be the beginning of a hum, off by at most 1.2 of its standard deviations (2); never a hum of 60 Hz |',
    "| drift of 0.05 mm/ms, noise of 0.015 mm at 50 kHz, pre-trigger of 4, 8 and 15 ms | a drift, known to 0.07, 0.02 and 0.005 mm (one standard deviation) 3 ms after contact, as far as it may be the beginning of a hum; 32 records each, off by at most 1.3 standard deviations |",
    "| hum of 60 Hz, 0.3 mm, the same | found in 64 of 64, off by at most 2.2 standard deviations |",
    "| 0.3 mm at every point of a converter in steps of 0.1 mm | an offset of 0.3 mm (95 %: 0.243 .. 0.357 mm) |",
    "| the same in steps of 0.05 mm | an offset of 0.3 mm (95 %: 0.272 .. 0.328 mm) |",
)


def _row(ending: Ending) -> str:
    estimate = ending.estimate
    interval = "none: no answer"
    if ending.identified and estimate is not None and estimate.interval_95 is not None:
        interval = f"{estimate.interval_95[0]:.0f} .. {estimate.interval_95[1]:.0f}"
    said = ending.sentence.strip().removeprefix("look at ").replace("|", "/")
    said = f"{said[:150]}..." if len(said) > 150 else said
    flag = "" if ending.right else " **(wrong)**"
    return f"| {ending.kind.name} | {ending.truth[VISCOSITY]:.0f} | {interval}{flag} | {said} |"


def main(out: Path) -> int:
    """Write the page; 1 where a record ends otherwise than it should."""
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        bench = solver_bench(folder)
        endings = []
        for seed, kind in enumerate(KINDS):
            endings.append(ended(bench, kind, folder, seed))
            sys.stderr.write(f"{_row(endings[-1])}\n")
    out.write_text(table(endings, time.perf_counter() - start), encoding="utf-8")
    return 0 if all(ending.right for ending in endings) else 1


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
