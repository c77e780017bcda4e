"""Every model of the library refitted and judged: fits, p-values, and the solver's word on those that matter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from data.histories import Array, Histories
from inversion.diagnosis.covariance import Whitener
from inversion.diagnosis.groundwork import Groundwork, emulator_error, middle, numerical_error
from inversion.diagnosis.record import Record
from inversion.diagnosis.refit import Fit, Problem, again, fit_effect, fit_none
from inversion.diagnosis.statistics import Consistency, Reference
from inversion.diagnosis.strikes import Strikes
from inversion.diagnosis.verdict import NONE
from solver.case import Case

NEAR = 5e-3  # p from which a model is confirmed by the solver
BEST = 3  # so many of the lowest costs are confirmed whatever their p
ROUNDS = 2
MOVED = 0.3
MODES = 2
ABSENT = 1e-3  # plausible sizes: nearer to 0 an effect is left out of a strike


@dataclass(frozen=True)
class Judged:
    """One model: its fit, what the data say of it, and whether the solver was asked at the fit and agreed.

    doubt: why the solver, though asked, did not confirm the fit.
    """

    name: str
    fit: Fit
    reference: Reference
    consistency: Consistency
    confirmed: bool
    doubt: str = ""

    @property
    def p(self) -> float:
        """High: the data allow the model."""
        return self.consistency.p


@dataclass(frozen=True)
class Judge:
    """Fits and judges models of a record.

    measurement, numerical: covariances (n, n); used: points that count, all by default.
    """

    groundwork: Groundwork
    record: Record
    measurement: Array
    numerical: Array
    used: np.ndarray
    seed: int = 0

    @classmethod
    def of(cls, groundwork: Groundwork, record: Record, seed: int = 0) -> Judge:
        """For all points of the record."""
        measurement = record.covariance()
        numerical = numerical_error(groundwork.numerical, groundwork.model(record), measurement)
        return cls(groundwork, record, measurement, numerical, np.ones(len(record.values), dtype=bool), seed)

    def only(self, used: np.ndarray) -> Judge:
        """The same with fewer points."""
        return replace(self, used=used)

    def whitener(self, emulator: Array | float = 0.0) -> Whitener:
        """Of the points used, with the emulator's error where that counts."""
        return Whitener.of(self.measurement + self.numerical + emulator, self.used)

    def start(self) -> list[Fit]:
        """Minima of the model without effects, the emulator's error taken where the best one lies."""
        model = self.groundwork.model(self.record)
        box = model.coordinates.boxes[0]
        theta = model.coordinates.theta(middle(box)[None], box)[0]
        fits: list[Fit] = []
        for _ in range(2):
            whitener = self.whitener(emulator_error(model, theta))
            fits = fit_none(Problem(model, whitener, self.groundwork.nuisances()), self.seed)
            theta = fits[0].theta
        return fits

    def judged(self, name: str, fit: Fit, confirmed: bool = False, doubt: str = "") -> Judged:
        """p-values of a fit; a stated tolerance is judged as a known noise."""
        record = self.record
        freedom = np.inf if record.noise_inferred else record.noise_freedom
        reference = Reference.of(fit.linear, freedom, record.noise_inferred, seed=self.seed)
        return Judged(name, fit, reference, reference.judge(), confirmed, doubt)

    def models(self, progress: Callable[[float], None] = lambda _: None) -> dict[str, Judged]:
        """Every model of the library, by the emulator and the learnt responses."""
        bases = self.start()
        found = {NONE: self.judged(NONE, bases[0])}
        names = bases[0].problem.names
        for i, name in enumerate(names):
            found[name] = self.judged(name, fit_effect(bases[0].problem, (i,), bases[:MODES]))
            progress((i + 1) / len(names))
        return found

    def confirm(self, judged: Sequence[Judged], strikes: Strikes, rounds: int = ROUNDS) -> dict[str, Judged]:
        """The same models with the solver asked at their fits, and refitted to what it said.

        Again, up to `rounds` times, for those whose curve then moved by more than a third of its error. Confirmed are
        those that settled; a model whose strike failed keeps the fit that it had.
        """
        fits = {one.name: one.fit for one in judged}
        doubts = dict.fromkeys(fits, "the solver was not asked")
        due = list(fits)
        whitener = self.whitener()
        for _ in range(rounds):
            runs = strikes.run({name: self._case(fits[name]) for name in due})
            doubts |= {name: f"its strike failed: {strikes.failures[name]}" for name in due if name not in runs}
            moved = {name: self._corrected(fits[name], histories, whitener) for name, histories in runs.items()}
            shifts = {name: _shift(fits[name], fit) for name, fit in moved.items()}
            doubts |= {name: _unsettled(shift) for name, shift in shifts.items()}
            due = [name for name, shift in shifts.items() if shift > MOVED]
            fits |= moved
            if not due:
                break
        return {name: self.judged(name, fit, not doubts[name], doubts[name]) for name, fit in fits.items()}

    def _corrected(self, fit: Fit, histories: Histories, whitener: Whitener) -> Fit:
        """The fit, made again with what the solver adds to the sum of emulator and responses where it stood."""
        model = fit.problem.model
        off = self.groundwork.clock.stack(histories) - model.grid(fit.place, fit.box)[0]
        corrected = replace(model, correction=model.correction + off)
        return again(fit, replace(fit.problem, model=corrected, whitener=whitener))

    def _case(self, fit: Fit) -> Case:
        """The strike at a fit, everything that acts on it included."""
        b, base = fit.b, self.groundwork.probed
        known = fit.problem.model.known
        acting = {
            k.name: k.magnitude(float(b[i])) for i, k in enumerate(known) if not k.of_record and abs(b[i]) > ABSENT
        }
        theta = dict(zip(fit.problem.model.emulator.names, map(float, fit.theta), strict=True))
        return base.with_values(theta).with_effects({**base.effects, **acting})


def _shift(before: Fit, after: Fit) -> float:
    """RMS by which the refit moved the corrected curve, in its own standard deviations."""
    model = after.problem.model
    change = model.points(after.place, after.box) - model.points(before.place, before.box)
    return float(np.sqrt(np.mean(after.problem.whitener.apply(change[0]) ** 2)))


def _unsettled(shift: float) -> str:
    """Empty where the refit stayed where the solver was asked."""
    return f"its last refit still moved the curve by {shift:.1f} standard deviations" if shift > MOVED else ""


def near(models: dict[str, Judged]) -> list[Judged]:
    """Models that the solver should be asked about: in or near the confidence set, or of the lowest costs."""
    by_cost = sorted(models.values(), key=lambda one: one.fit.cost)[:BEST]
    kept = {one.name: one for one in [*by_cost, *(m for m in models.values() if m.p >= NEAR)]}
    kept.pop(NONE, None)
    return list(kept.values())
