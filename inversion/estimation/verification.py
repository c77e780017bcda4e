"""VerificationRun: the forward model is run at each answer and laid over the measurement. Only this error counts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from birdstrike.data.curves import Measured
from birdstrike.data.errors import RunFailed
from birdstrike.data.formatting import reading
from birdstrike.data.histories import Array, Histories
from birdstrike.data.storage.files import write_atomically
from birdstrike.data.units import rounded
from birdstrike.inversion.forward import Forward
from birdstrike.inversion.misfit import finite, relative, rms, rmse, whitened
from birdstrike.inversion.observations.observations import Observations
from birdstrike.inversion.results.estimates import Answer, ChannelScore
from birdstrike.inversion.results.inversion import Inversion


def verdict(inversion: Inversion) -> str:
    """The verified errors side by side, the best first; in the channel's unit, or in per cent of the peaks and over
    noise, which decides between methods where channels differ in their noise."""
    if inversion.best is None:
        return "no verification run finished, so no answer is confirmed"
    winner = f"the {inversion.best} ({error_words(inversion.methods[inversion.best])})"
    others = [f"the {m} ({error_words(a)})" for m, a in inversion.methods.items() if m != inversion.best]
    if not others:
        return f"verified by the solver: {winner}"
    return f"better verified by the solver: {winner}, against {' and '.join(others)}"


def error_words(answer: Answer) -> str:
    """ "0.31 mm RMS, 5.4 % of the peak", "4.1 % RMS of the 3 channels' peaks, 2.3 over noise", or why there is none."""
    if answer.verified_rmse is None or answer.verified_relative is None:
        return f"its run failed: {answer.failure}"
    share = 100 * answer.verified_relative
    if len(answer.channels) > 1:
        misfit = "" if answer.verified_misfit is None else f", {rounded(answer.verified_misfit, 2)} over noise"
        return f"{share:.1f} % RMS of the {len(answer.channels)} channels' peaks{misfit}"
    first = next(iter(answer.channels.values()))
    return f"{reading(answer.verified_rmse, first.unit)} RMS, {share:.1f} % of the peak"


@dataclass(frozen=True)
class VerificationRun:
    """A run at an answer: its histories, or why there are none."""

    histories: Histories | None
    failure: str | None

    def at(self, channel: str, times: Array) -> Array:
        """The channel at `times` [s] of the model's clock: at rest before the record, NaN after it or without a run."""
        if self.histories is None:
            return np.full(len(times), np.nan)
        return self.histories.at(channel, np.maximum(times, self.histories.time[0]))


def verify(forward: Forward, theta: Mapping[str, float]) -> VerificationRun:
    """Run the forward model at theta; a failed run is recorded, not raised: the other method may still finish."""
    try:
        return VerificationRun(forward(theta), None)
    except RunFailed as error:
        return VerificationRun(None, str(error))


def channel_scores(
    verification: VerificationRun,
    predicted: Mapping[str, Array] | None,
    observations: Observations,
    t0: float,
    allowed: Mapping[str, Array],
) -> dict[str, ChannelScore]:
    """Errors of every channel; predicted: the emulator's curves at the measured instants, None where it has none.

    allowed: channel -> (n,) SI, standard deviation by which a right answer's run may differ from the record.
    """
    scores: dict[str, ChannelScore] = {}
    for c in observations.channels:
        shifted, unshifted = (verification.at(c.name, c.times - shift) for shift in (t0, 0.0))
        scores[c.name] = ChannelScore(
            unit=c.unit,
            predicted_rmse=rmse(predicted[c.name], c.values) if predicted is not None else None,
            verified_rmse=finite(rmse(shifted, c.values)),
            verified_relative=finite(relative(shifted, c.values)),
            verified_rmse_at_zero_offset=finite(rmse(unshifted, c.values)),
            verified_misfit=finite(whitened(shifted, c.values, allowed[c.name])),
        )
    return scores


def overall(parts: Iterable[float | None]) -> float | None:
    """Root mean square of the channels' errors; None where none is known."""
    known = [p for p in parts if p is not None]
    return rms(known) if known else None


def write_verification(
    path: Path, measured: Measured, observations: Observations, verified: Mapping[str, VerificationRun], t0: float
) -> None:
    """CSV: time_s of the record, then for each channel measured_..., and one column a method, on the record's clock.

    Measured: less the sensor's reading at rest, where the fit has subtracted it.
    """
    table = {"time_s": measured.time}
    for c in observations.channels:
        label = f"{c.name}_{c.unit}".rstrip("_")
        rest = c.record.baseline if c.record is not None and c.record.zeroed else None
        table[f"measured_{label}"] = measured.channels[c.name] - (0.0 if rest is None else rest.at(measured.time))
        for method, verification in verified.items():
            table[f"{method}_{label}"] = verification.at(c.name, measured.time - t0)
    write_atomically(path, pd.DataFrame(table).to_csv(index=False, lineterminator="\n"))
