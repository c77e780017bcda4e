"""What a method answers: values with intervals, the combination of a deficient design, the verified errors. SI."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import nan


def ends_95(interval: Sequence[float] | None) -> dict[str, float]:
    """Columns of a table for the ends of a 95 % interval, nan where there is none."""
    low, high = interval or (nan, nan)
    return {"low_95": low, "high_95": high}


@dataclass(frozen=True)
class Estimate:
    """One parameter by one method.

    value: SI; of a parameter that is not identified it is only the point at which the verification ran; None where the
    design carries no separate value. reason: one line that says why it is identified or not.
    """

    value: float | None
    interval_95: tuple[float, float] | None
    unit: str
    identified: bool
    reason: str

    @property
    def consistent(self) -> bool:
        """Whether the interval, where there is one, holds the value, rounding aside."""
        if self.value is None or self.interval_95 is None:
            return True
        low, high = self.interval_95
        rounding = 1e-9 * max(abs(low), abs(high))
        return low - rounding <= self.value <= high + rounding


@dataclass(frozen=True)
class ChannelScore:
    """Errors of one channel, SI `unit`.

    predicted_rmse: by the emulator at the method's answer; verified_rmse: by the solver, at the estimated time origin,
    verified_relative: the same over the measured peak; verified_rmse_at_zero_offset: by the solver on its own clock;
    verified_misfit: the verified error over the noise and, where the emulator predicts the channel poorly, its error;
    None in older files.
    """

    unit: str
    predicted_rmse: float | None
    verified_rmse: float | None
    verified_relative: float | None
    verified_rmse_at_zero_offset: float | None
    verified_misfit: float | None = None


@dataclass(frozen=True)
class Combination:
    """What a rank-deficient design does carry: coordinates 0..1 over the runs, and a line in the user's words.

    directions: for each coordinate, name -> change of the parameter from 0 to 1, SI; point: where the verification ran.
    """

    directions: tuple[dict[str, float], ...]
    coordinates: tuple[float, ...]
    interval_95: tuple[tuple[float, float] | None, ...]
    point: dict[str, float]
    sentence: str


@dataclass(frozen=True)
class Answer:
    """One method's answer.

    predicted_rmse, verified_rmse: of the first measured channel, SI; verified_relative: root mean square of the
    channels' errors relative to their peaks; verified_misfit: of those over noise, by which methods are ranked, None in
    older files; run: key of the verification run in the run store; failure: why it did not finish.
    """

    parameters: Mapping[str, Estimate]
    predicted_rmse: float | None
    verified_rmse: float | None
    verified_relative: float | None
    channels: Mapping[str, ChannelScore]
    combination: Combination | None
    run: str | None
    failure: str | None
    verified_misfit: float | None = None
