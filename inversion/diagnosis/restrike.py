"""The case that a fit describes, struck once: the error before and after is the solver's own, not the emulator's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from birdstrike.data.errors import CaseError
from birdstrike.data.histories import Array, Histories
from birdstrike.inversion.diagnosis.covariance import Whitener
from birdstrike.inversion.diagnosis.judge import Judge, Judged
from birdstrike.inversion.diagnosis.miss import by_channel, errors, rms
from birdstrike.inversion.diagnosis.record import Record, averaged
from birdstrike.inversion.diagnosis.refit import Fit
from birdstrike.inversion.diagnosis.strikes import Strikes
from birdstrike.solver.case.case import Case


@dataclass(frozen=True)
class Struck:
    """One strike of a fit's case on the record's points, with what finer meshes add to its mesh on average.

    curve: (n,) SI; rmse: sensor -> SI; declared: the same without what finer meshes add; weighted, raw: whitened RMS as
    those of the fit; off: RMS of what lies between this curve and the fitted one, whitened likewise.
    """

    curve: Array
    rmse: Mapping[str, float]
    declared: Mapping[str, float]
    weighted: float
    raw: float
    off: float

    def figures(self) -> dict[str, object]:
        """For JSON."""
        return {key: value for key, value in vars(self).items() if key != "curve"}


def case_at(case: Case, fit: Fit) -> Case:
    """The declared case at a fit: a strike of it is the fitted model's curve.

    Parameters and fitted nuisances stand in the keys that they are values of (a time offset: in every `instrument`),
    the model's own effects under `effects`, beside those that the case states. Raises CaseError for a fit that is no
    case.
    """
    known = fit.problem.model.known
    theta = dict(zip(fit.problem.model.emulator.names, map(float, fit.theta), strict=True))
    found = case.with_effects({}).with_values(theta)
    for (index, sigma), v in zip(fit.problem.nuisances, fit.v, strict=True):
        if v:
            value = known[index].magnitude(sigma * float(v))
            found = found.overlaid(dict(known[index].effect.change(found, value)))
    own = {known[i].name: known[i].magnitude(float(b)) for i, b in zip(fit.own, fit.magnitudes, strict=True)}
    return found.with_effects({**case.effects, **own})


def restrike(judge: Judge, judged: Mapping[str, Judged], strikes: Strikes) -> tuple[dict[str, Struck], dict[str, str]]:
    """Strikes of the fits by their labels, and why others have none."""
    cases: dict[str, Case] = {}
    failed: dict[str, str] = {}
    for label, one in judged.items():
        try:
            cases[label] = case_at(judge.groundwork.case, one.fit)
        except CaseError as error:
            failed[label] = "; ".join(error.errors)
    runs = strikes.run(cases) if cases else {}
    failed |= {label: strikes.failures[label] for label in cases if label not in runs}
    return {label: _struck(judge, judged[label].fit, run) for label, run in runs.items()}, failed


def _struck(judge: Judge, fit: Fit, run: Histories) -> Struck:
    declared, covariance = on_record(run, judge.record), judge.allowance(fit)
    curve, measured = declared + fit.mesh, judge.record.values
    miss = measured - curve
    weighted, raw = errors(judge, miss, covariance, judge.used)
    off = rms(Whitener.of(covariance, judge.used).apply(curve - fit.curve))
    return Struck(curve, by_channel(judge, miss), by_channel(judge, measured - declared), weighted, raw, off)


def on_record(run: Histories, record: Record) -> Array:
    """(n,) a strike, its instruments included, on the record's points."""
    parts = [
        averaged(np.interp(trace.times, run.time, run.channels[trace.name]), trace.block) for trace in record.traces
    ]
    return np.concatenate(parts)
