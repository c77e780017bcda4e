"""Every model of the library refitted and judged: fits, p-values, and the solver's word on those that matter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.calibrated import calibrated
from birdstrike.inversion.diagnosis.corrected import corrected, places, shift_of, unsettled
from birdstrike.inversion.diagnosis.covariance import Whitener
from birdstrike.inversion.diagnosis.groundwork import Groundwork, middle, numerical_error
from birdstrike.inversion.diagnosis.model import Model, Place
from birdstrike.inversion.diagnosis.model_error import emulator_error, response_error
from birdstrike.inversion.diagnosis.point_error import PointError
from birdstrike.inversion.diagnosis.record import Record
from birdstrike.inversion.diagnosis.refit import Fit, Problem, again, columns_of, fit_effect, fit_none
from birdstrike.inversion.diagnosis.statistics import Consistency, Reference
from birdstrike.inversion.diagnosis.strikes import Strikes
from birdstrike.inversion.diagnosis.verdict import NONE
from birdstrike.inversion.estimation.coordinates import Box
from birdstrike.solver.case.case import Case

NEAR = 5e-3  # p from which a model is confirmed by the solver
BEST = 5  # so many of the lowest costs are confirmed whatever their p
ROUNDS = 2
MOVED = 0.3
MODES = 2
SETTLING = 2
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

    measurement, numerical: covariances (n, n), the latter where the model without effects fits; error: the latter
    wherever a model stands; used: points that count, all by default; size: by which the latter's draws were multiplied
    so that they predict one another.
    """

    groundwork: Groundwork
    record: Record
    measurement: Array
    numerical: Array
    error: Callable[[Model, Place, Box], Array]
    used: np.ndarray
    seed: int = 0
    size: float = 1.0

    @classmethod
    def of(cls, groundwork: Groundwork, record: Record, seed: int = 0) -> Judge:
        """For all points of the record."""
        model, measurement = groundwork.model(record), record.covariance()
        used, numerical = np.ones(len(record.values), dtype=bool), groundwork.numerical
        drawn = numerical.on(model.sample, record.middle, record.channel, measurement)
        place = Place(middle(model.coordinates.boxes[0])[None], np.zeros((1, len(model.known))))

        def by(found: PointError) -> Judge:
            error = numerical_error(numerical, found)
            there = error(model, place, model.coordinates.boxes[0])
            return cls(groundwork, record, measurement, there, error, used, seed, found.size)

        fit = by(drawn).start()[0]
        judge = by(calibrated(drawn, columns_of(fit), measurement))
        fit = judge.start()[0]
        return replace(judge, numerical=judge.error(model, fit.place, fit.box))

    def only(self, used: np.ndarray) -> Judge:
        """The same with fewer points."""
        return replace(self, used=used)

    def allowance(self, fit: Fit) -> Array:
        """(n, n) covariance of a fit's miss on all points: noise, and the numerical and the model's own error there.

        The emulator's stays where a strike corrects the model: it is also that of one strike about what is smooth in
        the parameters, which the correction carries over to its neighbours.
        """
        model = fit.problem.model
        own = emulator_error(model, fit.theta, fit.b) + response_error(model, fit.b)
        return self.measurement + self.error(model, fit.place, fit.box) + own

    def whitener(self, fit: Fit) -> Whitener:
        """Of the points used, at a fit."""
        return Whitener.of(self.allowance(fit), self.used)

    def start(self) -> list[Fit]:
        """Minima of the model without effects, the best one's whitener its own."""
        model = self.groundwork.model(self.record)
        fits: list[Fit] = []
        whitener = Whitener.of(self.measurement + self.numerical, self.used)
        for _ in range(2):
            fits = fit_none(Problem(model, whitener, self.groundwork.nuisances()), self.seed)
            whitener = self.whitener(fits[0])
        return [self.settled(fit) for fit in fits[:MODES]]

    def settled(self, fit: Fit) -> Fit:
        """The fit, made again with the errors where it stands."""
        for _ in range(SETTLING):
            fit = again(fit, replace(fit.problem, whitener=self.whitener(fit)))
        return fit

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
            found[name] = self.judged(name, self.settled(fit_effect(bases[0].problem, (i,), bases)))
            progress((i + 1) / len(names))
        return found

    def confirm(self, judged: Sequence[Judged], strikes: Strikes, rounds: int = ROUNDS) -> dict[str, Judged]:
        """The same models with the solver asked at their fits, and refitted to what it said.

        First without and with the model's own effect, so that its response is the one at these parameters; then, up to
        `rounds` times in all, at the fit of those whose curve moved by more than a third of its error. Confirmed are
        those that settled; a model whose strike failed keeps the fit that it had.
        """
        fits = {one.name: one.fit for one in judged}
        doubts = dict.fromkeys(fits, "the solver was not asked")
        due = list(fits)
        for number in range(rounds):
            wanted = {name: places(fits[name]) if number == 0 else (fits[name].b,) for name in due}
            cases = {(name, i): self._case(fits[name], b) for name, bs in wanted.items() for i, b in enumerate(bs)}
            runs = strikes.run({f"{name} {i}": case for (name, i), case in cases.items()})
            moved: dict[str, Fit] = {}
            for name, bs in wanted.items():
                labels = [f"{name} {i}" for i in range(len(bs))]
                if failed := [label for label in labels if label not in runs]:
                    doubts[name] = f"its strike failed: {strikes.failures[failed[0]]}"
                    continue
                curves = [self.groundwork.clock.stack(runs[label]) for label in labels]
                moved[name] = self.settled(corrected(fits[name], list(zip(bs, curves, strict=True))))
            shifts = {name: shift_of(fits[name], fit) for name, fit in moved.items()}
            doubts |= {name: unsettled(shift, MOVED) for name, shift in shifts.items()}
            due = [name for name, shift in shifts.items() if shift > MOVED]
            fits |= moved
            if not due:
                break
        return {name: self.judged(name, fit, not doubts[name], doubts[name]) for name, fit in fits.items()}

    def _case(self, fit: Fit, b: Array) -> Case:
        """The strike at a fit's parameters with effects b (m,), those of the record left out."""
        base, model = self.groundwork.probed, fit.problem.model
        acting = {
            k.name: k.magnitude(float(size))
            for k, size in zip(model.known, b, strict=True)
            if not k.of_record and abs(size) > ABSENT
        }
        theta = dict(zip(model.emulator.names, map(float, fit.theta), strict=True))
        return base.with_values(theta).with_effects({**base.effects, **acting})


def near(models: dict[str, Judged]) -> list[Judged]:
    """Models that the solver should be asked about: in or near the confidence set, or of the lowest costs."""
    by_cost = sorted(models.values(), key=lambda one: one.fit.cost)[:BEST]
    kept = {one.name: one for one in [*by_cost, *(m for m in models.values() if m.p >= NEAR)]}
    kept.pop(NONE, None)
    return list(kept.values())
