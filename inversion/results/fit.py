"""How the best fit lies beside the measurement: time origin, prior predictive check, residual correlation."""

from __future__ import annotations

from dataclasses import dataclass, field

from birdstrike.data.formatting import plain, signed_ms


@dataclass(frozen=True)
class TimeOrigin:
    """The model at t - value stands beside the record at t; value, sigma, interval_95 in [s].

    sigma: what was known beforehand, None where the clocks are the same (then value is 0). There is no interval where
    the clocks are the same, nor where a limit of the search holds the value.
    """

    value: float
    sigma: float | None
    interval_95: tuple[float, float] | None

    @property
    def sentence(self) -> str:
        """One line for the user."""
        if self.sigma is None:
            return "time origin: the record's own (the case names no time_offset)"
        if self.interval_95 is None:
            return f"time origin: {signed_ms(self.value)}, held there by a limit of the search"
        low, high = self.interval_95
        value, start, end = (signed_ms(one, high - low) for one in (self.value, low, high))
        return f"time origin: {value} (95 %: {start.removesuffix(' ms')} .. {end}), estimated by the emulator"


@dataclass(frozen=True)
class PriorPredictive:
    """Where the measurement lies among the runs of the campaign, at the estimated time origin.

    inside: False when the residual of the best fit in any channel is larger than noise and emulator error allow
    (chi-square at 0.1 % over all channels, and more than 1.5 of their standard deviations, since a stated noise is
    rarely better known), when most points lie outside the runs' envelope, or when the emulator has been found too
    coarse;
    fit: root mean square of the best fit's whitened residual (1 = noise and the emulator's error) in its worst channel;
    outside_envelope: share of points beyond the envelope by more than 3 standard deviations of the noise;
    coarse: why it may be the emulator that cannot follow the record, not the model; nearest_run: run number;
    nearest_distance: channel -> its RMS distance from the measurement, SI.
    """

    inside: bool
    fit: float
    outside_envelope: float
    nearest_run: int
    nearest_distance: dict[str, float]
    coarse: str = ""


@dataclass(frozen=True)
class ResidualCorrelation:
    """Of each channel's whitened residual at the best fit, channel -> figure.

    tau: integrated autocorrelation time in points (1 = no longer than the noise's, white where nothing is known); fit:
    root mean square (1 = noise); widened: factor by which the noise was raised for the intervals, fit times the root of
    tau over that of the noise, and at least 1; by_chance: the factor that noise exceeds once in a hundred records, for
    so few independent points and a noise known no better, 1 where no correlation of the noise is expected or may have
    been missed; empty in older files.
    """

    tau: dict[str, float]
    fit: dict[str, float]
    widened: dict[str, float]
    by_chance: dict[str, float] = field(default_factory=dict)

    @property
    def white(self) -> bool:
        """Nothing to widen."""
        return max(self.widened.values()) == 1.0

    @property
    def beyond_chance(self) -> tuple[str, ...]:
        """Channels that noise alone would not have widened as much."""
        return tuple(name for name, factor in self.widened.items() if factor > self.by_chance.get(name, 1.0))

    @property
    def correlated(self) -> tuple[str, ...]:
        """Of these, the channels whose residual is correlated, whatever its size."""
        return tuple(name for name in self.beyond_chance if self.tau[name] > 1.0)

    @property
    def warnings(self) -> tuple[str, ...]:
        """One sentence about the channel that is farthest from noise, or none."""
        if not self.beyond_chance:
            return ()
        worst = max(self.beyond_chance, key=lambda name: self.widened[name])
        factor, tau = self.widened[worst], self.tau[worst]
        if tau == 1.0:
            size = f"{plain(worst)}: the residual of the best fit is {self.fit[worst]:.1f} times the stated noise"
            return (f"{size}, so the intervals were widened by a factor {factor:.1f}",)
        return (
            f"{plain(worst)}: the residual is not noise (correlated over about {tau:.0f} points), so the intervals "
            f"were widened by a factor {factor:.1f}; something the parameters do not move may be missing from the "
            "model",
        )
