"""One bird model calibrated to all shots at once, verified by the solver, and tested on what it was not calibrated to.

A campaign a shot at the same points; an emulator of all; rounds of runs where the answer may lie; the fit with
noise, nuisances and a discrepancy of the model whose size the records choose; then once more without each shot.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from birdstrike.data.curves import Measured, write_histories
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import RunFailed
from birdstrike.data.files import write_json
from birdstrike.data.histories import Array, Histories
from birdstrike.data.store import RunStore
from birdstrike.doe.campaign.campaign import run_campaign
from birdstrike.doe.campaign.folder import CampaignFolder
from birdstrike.doe.campaign.planned import planned_design
from birdstrike.doe.campaign.runner import RunCounts
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion import forward
from birdstrike.inversion.diagnosis.discrepancy import LEAST
from birdstrike.inversion.estimation.calibration import Mode
from birdstrike.inversion.estimation.known_errors import (
    case_nuisances,
    discrepancy_columns,
    stated_discrepancy,
)
from birdstrike.inversion.estimation.locate import InversionOptions, Located, locate
from birdstrike.inversion.estimation.posterior import Sampling
from birdstrike.inversion.estimation.refinement import PAYS, added_variance, with_run
from birdstrike.inversion.estimation.shots import Joint, Shot, joined, own_origin, suffix
from birdstrike.inversion.formatting import plain, quantity, span
from birdstrike.inversion.forward import Forward, StoredSolver
from birdstrike.inversion.identifiability.summary import DRAWS_FILE, write_draws
from birdstrike.inversion.invert import InversionOutcome, invert
from birdstrike.inversion.models.candidates import (
    Candidate,
    built,
    calibrated_case,
    literature_case,
    modulus_of,
    shared_keys,
)
from birdstrike.inversion.models.error_terms import Discrepancy, NuisanceRuns, with_discrepancy
from birdstrike.inversion.models.optimisers import Problem, optimised
from birdstrike.inversion.models.points import linearised_draws, near_answer, residuals_of, shot_errors
from birdstrike.inversion.models.results import Combined, ModelAnswer, Optimised, ShotError
from birdstrike.inversion.models.scaled import NearestFinished, Scale, ScaledForward
from birdstrike.inversion.models.simulations import LatePool, simulate_all
from birdstrike.inversion.observations.observations import Observations
from birdstrike.inversion.results.estimates import Estimate
from birdstrike.solver.case.case import Case
from birdstrike.surrogate.emulator import Emulator, fit_emulator
from birdstrike.surrogate.files import save_emulator

AMPLITUDES = (0.0, LEAST, 0.01, 0.03)
"""Of the peak: sizes of the discrepancy that are tried; the diagnosis's range, up to where a fit has a meaning.

A model that asks for the largest is wrong by more than that. A slow error of its own would then take what the constants
should fit, so that it is calibrated without one, to the least error over the noise, which is what ranks it; its
intervals are those of the widened residual."""
GOOD_Q2 = 0.9
BLOCKS = 3  # time blocks of a single record, each left out once
DRAWS = 400  # of the posterior, for a quantity made of several constants
NEWS = 0.5  # of the prior's 95 % width, as for single parameters


@dataclass(frozen=True)
class ShotSetup:
    """One record with the case of its shot; name: in models.json."""

    name: str
    case: Case
    measured: Measured


@dataclass(frozen=True)
class FitOptions:
    """runs: of each campaign; rounds, batch: of runs near the answer; posterior: drawn, else linearised intervals.

    optimisers: that are run beside it, with so many simulations of each shot (budget).
    """

    runs: int = 20
    rounds: int = 3
    batch: int = 5
    design: str = "uniform"
    seed: int = 0
    posterior: bool = True
    optimisers: tuple[str, ...] = ()
    budget: int = 160


@dataclass(frozen=True)
class ModelFit:
    """One model over these shots; folder: of its runs; retry: failures stored before it [s, Unix] are tried again."""

    chosen: Candidate
    setups: Sequence[ShotSetup]
    folder: Path
    options: FitOptions
    pool: LatePool
    report: Callable[[str, float], None]
    retry: float = 0.0

    @cached_property
    def cases(self) -> list[Case]:
        """Each shot's case with this model; raises UserError or CaseError."""
        found = [calibrated_case(self.chosen, setup.case) for setup in self.setups]
        shared_keys(found)
        return found

    @cached_property
    def scale(self) -> Scale:
        """Ranges and their scales."""
        return Scale(ParameterSpace.of_case(self.cases[0]))

    @cached_property
    def store(self) -> RunStore:
        """Runs beside the campaigns'."""
        return RunStore(self.folder / "runs")

    def answer(self) -> ModelAnswer:
        """The model's answer without its place in a ranking; raises UserError and RunFailed."""
        with threadpool_limits(limits=1, user_api="blas"):  # matrices of a few hundred rows lose to waking threads
            return self._answer()

    def _answer(self) -> ModelAnswer:
        began, said = time.monotonic(), list[str]()
        shots = self._campaigns(said)
        origins = [own_origin(s) if s.options.time_offset else (0.0, True) for s in shots]
        joint = joined(shots, origins)
        dataset, emulator, added = self._refined(joint, said)
        self.report("fit", 0.0)
        discrepancy = Discrepancy(self.cases[0].first_contact, float(dataset.time[-1]))
        share, located = self._best_share(dataset, joint, emulator, discrepancy)
        columns = with_discrepancy(joint.columns, discrepancy, share)
        sampling = Sampling() if self.options.posterior else None
        options = replace(joint.options, sampling=sampling, analyse=False)
        outcome = invert(dataset, joint.measured, joint.verifier, options, None, emulator, columns)
        self.report("fit", 1.0)
        self._kept(emulator, dataset, located)
        self._kept_draws(outcome)
        folds = self._folds(dataset, shots, origins, emulator, discrepancy, share)
        published = self._published()
        self._written("published", published, origins)
        combinations = self._combinations(outcome, located)
        q2 = self._q2(outcome)
        said += outcome.inversion.warnings
        said += self._poor(q2)
        return ModelAnswer(
            name=self.chosen.name,
            source=self.chosen.source,
            parameters=self._estimates(outcome),
            ranges={p.name: (p.low, p.high) for p in self.cases[0].parameters()},
            combinations=combinations,
            literature=self._literature(),
            verified=self._verified(shots, origins, outcome),
            published={n: e for n, e in self._errors(shots, origins, published).items() if e is not None},
            heldout_parameters={name: self.scale.values(theta) for name, (theta, _) in folds.items()},
            residuals={name: own for name, (_, own) in folds.items()},
            q2=q2,
            optimised={name: self._optimised(name, shots, origins) for name in self.options.optimisers},
            eroded=self._eroded(),
            discrepancy=share,
            inside=outcome.inversion.prior_predictive.inside,
            runs=len(dataset.runs),
            strikes=self._strikes(added, shots, folds, published),
            wall_s=time.monotonic() - began,
            warnings=tuple(dict.fromkeys(self._named(line) for line in said)),
        )

    def _kept(self, emulator: Emulator, dataset: Dataset, located: Located) -> None:
        """The emulator of all shots, and how its inputs are to be read, for the page to play with."""
        save_emulator(self.folder / "emulator.npz", emulator, dataset)
        space, log = self.scale.space, self.scale.space.logarithmic
        published = np.array([[self._literature().get(name, np.nan) for name in space.names]])
        seen = np.where(log, space.to_unit(published), published)[0]
        ends = zip(space.names, dataset.lows, dataset.highs, strict=True)
        decades = zip(space.names, space.lows, space.highs, space.units, log, strict=True)
        content = {
            "ranges": {name: [float(low), float(high)] for name, low, high in ends},
            "units": dict(zip(space.names, dataset.units, strict=True)),
            "logarithmic": {name: [float(low), float(high), unit] for name, low, high, unit, one in decades if one},
            "calibrated": [float(v) for v in located.calibration.modes[0].theta],
            "published": [float(v) for v in seen] if np.isfinite(seen).all() else None,
            "channels": {
                setup.name: {name: name + suffix(i) for name in setup.measured.channels}
                for i, setup in enumerate(self.setups)
            },
        }
        write_json(self.folder / "emulator.json", content)

    def _kept_draws(self, outcome: InversionOutcome) -> None:
        """The posterior's draws in SI, for `predict`; none of an earlier call stay where none were drawn."""
        (self.folder / DRAWS_FILE).unlink(missing_ok=True)
        if outcome.posterior is not None:
            drawn = replace(outcome.posterior, theta=self.scale.physical(outcome.posterior.theta))
            write_draws(self.folder / DRAWS_FILE, drawn, self.scale.space.names)

    def _campaigns(self, said: list[str]) -> list[Shot]:
        """Each shot's runs, at the same points, as a shot of the joint estimation."""
        shots = []
        for setup, case in zip(self.setups, self.cases, strict=True):
            place, o = self.folder / setup.name, self.options
            place.mkdir(parents=True, exist_ok=True)
            design = planned_design(o.design, self.scale.space, o.runs, o.seed, place)
            dataset = run_campaign(
                case,
                design,
                place,
                workers=self.pool.workers,
                simulate=forward.simulate,
                executor=self.pool,
                progress=lambda counts, n=setup.name: self.report(n, _done(counts)),
                say=said.append,
                retry=self.retry,
            )
            shots.append(self._shot(setup, case, self.scale.dataset(dataset), place, said))
        return shots

    def _shot(self, setup: ShotSetup, case: Case, dataset: Dataset, place: Path, said: list[str]) -> Shot:
        stored = StoredSolver(case, self.store, (RunStore(place / "runs"),), retry=self.retry)
        solver = ScaledForward(stored, self.scale)
        nuisances = NuisanceRuns(solver, case_nuisances(case))
        shares = stated_discrepancy(case, setup.measured.channels, None)
        options = InversionOptions(
            method="emulator",
            seed=self.options.seed,
            noise={name: sensor.noise for name, sensor in case.sensors.items() if sensor.noise},
            time_offset=case.inversion.nuisance.get("time_offset", 0.0),
            sampling=None,
            analyse=False,
        )

        def columns(observations: Observations, mode: Mode) -> Array:
            parts = [nuisances.columns(observations, mode, dataset.names)]
            parts += [discrepancy_columns(shares, observations)] if shares else []
            return np.hstack(parts)

        known = columns if nuisances.nuisances or shares else None
        verifier = NearestFinished(solver, dataset, said.append)
        return Shot(dataset, setup.measured, solver, options, known, campaign=place, verifier=verifier, case=case)

    def _refined(self, joint: Joint, said: list[str]) -> tuple[Dataset, Emulator, int]:
        """Runs added about the best fit, all shots at each point, while the emulator's error widens the answer."""
        dataset, names, added = joint.dataset, list(joint.measured.channels), 0
        emulator = fit_emulator(dataset, names, self.options.seed)
        for number in range(self.options.rounds):
            found = locate(dataset, joint.measured, joint.options, emulator, _silent, None)
            calibration = found.calibration
            if calibration.design.deficient:
                break
            if added_variance(calibration.calibrator, calibration.modes[0]) < PAYS:
                break
            self.report("runs near the answer", number / self.options.rounds)
            points = near_answer(found, self.options.batch, self.options.seed + number)
            before = len(dataset.runs)
            dataset = self._with_points(dataset, points, joint.forward, said)
            added += len(points)
            if len(dataset.runs) == before:
                break
            emulator = fit_emulator(dataset, names, self.options.seed)
        return dataset, emulator, added

    def _with_points(self, dataset: Dataset, points: Array, joint: Forward, said: list[str]) -> Dataset:
        thetas = [dict(zip(dataset.names, map(float, row), strict=True)) for row in points]
        self.together([self.scale.values(theta) for theta in thetas])
        for theta in thetas:
            try:
                dataset = with_run(dataset, theta, joint(theta))
            except RunFailed as failure:
                said.append(f"a run near the answer failed and is left out: {failure}")
        return dataset

    def _best_share(
        self, dataset: Dataset, joint: Joint, emulator: Emulator, discrepancy: Discrepancy
    ) -> tuple[float, Located]:
        """The size of the model's discrepancy at which the records are likeliest (empirical Bayes), and the fit."""
        found = {
            share: locate(
                dataset,
                joint.measured,
                joint.options,
                emulator,
                _silent,
                with_discrepancy(joint.columns, discrepancy, share),
            )
            for share in AMPLITUDES
        }
        share = min(found, key=lambda one: found[one].calibration.modes[0].cost)
        if share == AMPLITUDES[-1]:
            share = 0.0
        return share, found[share]

    def _folds(
        self,
        dataset: Dataset,
        shots: Sequence[Shot],
        origins: Sequence[tuple[float, bool]],
        emulator: Emulator,
        discrepancy: Discrepancy,
        share: float,
    ) -> dict[str, tuple[dict[str, float], dict[str, tuple[float, ...]]]]:
        """Shot -> what the rest gave (as the estimation sees it), and the solver's residuals there over their noise."""
        if len(shots) == 1:
            return self._time_blocks(dataset, shots[0], origins[0][0], emulator, discrepancy, share)
        parts = [_part(dataset, shot, i) for i, shot in enumerate(shots)]
        thetas = []
        for i in range(len(shots)):
            rest = [j for j in range(len(shots)) if j != i]
            joint = joined([parts[j] for j in rest], [origins[j] for j in rest])
            channels = {
                name + suffix(place): emulator.channels[name + suffix(j)]
                for place, j in enumerate(rest)
                for name in shots[j].measured.channels
            }
            columns = with_discrepancy(joint.columns, discrepancy, share)
            own = replace(emulator, channels=channels)
            found = locate(joint.dataset, joint.measured, joint.options, own, _silent, columns)
            thetas.append(dict(zip(dataset.names, map(float, found.calibration.modes[0].theta), strict=True)))
        self._run(thetas)
        answers = {}
        for setup, shot, theta, (t0, _) in zip(self.setups, shots, thetas, origins, strict=True):
            answers[setup.name] = (theta, residuals_of(shot, verified(shot)(theta), t0))
        return answers

    def _run(self, thetas: Sequence[Mapping[str, float]]) -> None:
        """One simulation a shot, all at a time."""
        jobs = [(case, self.scale.values(theta)) for case, theta in zip(self.cases, thetas, strict=True)]
        simulate_all(jobs, self.store, self.pool, self.retry)

    def _time_blocks(
        self,
        dataset: Dataset,
        shot: Shot,
        t0: float,
        emulator: Emulator,
        discrepancy: Discrepancy,
        share: float,
    ) -> dict[str, tuple[dict[str, float], dict[str, tuple[float, ...]]]]:
        """Of a single record: each third in time from the other two."""
        record, case = shot.measured, self.cases[0]
        begin, end = case.first_contact + t0, min(float(record.time[-1]), float(dataset.time[-1]) + t0)
        edges = np.linspace(begin, end * (1.0 + 1e-9), BLOCKS + 1)
        columns = with_discrepancy(shot.columns, discrepancy, share)
        thetas = []
        for low, high in pairwise(edges):
            inside = (record.time >= low) & (record.time < high)
            left = {name: np.where(inside, np.nan, values) for name, values in record.channels.items()}
            found = locate(dataset, replace(record, channels=left), shot.options, emulator, _silent, columns)
            thetas.append(dict(zip(dataset.names, map(float, found.calibration.modes[0].theta), strict=True)))
        simulate_all([(case, self.scale.values(theta)) for theta in thetas], self.store, self.pool, self.retry)
        together: dict[str, tuple[float, ...]] = {}
        for theta, low, high in zip(thetas, edges[:-1], edges[1:], strict=True):
            for name, own in residuals_of(shot, verified(shot)(theta), t0, (low, high)).items():
                together[name] = together.get(name, ()) + own
        return {self.setups[0].name: (thetas[0], together)}

    def _optimised(self, name: str, shots: Sequence[Shot], origins: Sequence[tuple[float, bool]]) -> Optimised:
        """What an optimiser with the solver in the loop reaches on the same records."""

        def residuals(values: Mapping[str, float]) -> Array:
            self.together([values])
            parts = []
            for shot, case, (t0, _) in zip(shots, self.cases, origins, strict=True):
                own = residuals_of(shot, StoredSolver(case, self.store, retry=self.retry)(values), t0)
                parts += [np.asarray(r) / np.sqrt(len(r) * len(own) * len(shots)) for r in own.values()]
            return np.concatenate(parts)

        self.report(name, 0.0)
        space = self.scale.space
        problem = Problem(
            space.names, space.to_physical, residuals, self.together, self.options.budget, self.options.seed
        )
        return optimised(name, problem)

    def together(self, points: Sequence[Mapping[str, float]]) -> None:
        """Every shot at these SI values, in parallel."""
        simulate_all([(case, values) for case in self.cases for values in points], self.store, self.pool, self.retry)

    def _published(self) -> list[Histories | None]:
        """Each shot with the published constants, None where there are none or the run failed."""
        cases = [literature_case(self.chosen, setup.case) for setup in self.setups]
        known = [case for case in cases if case is not None]
        simulate_all([(case, {}) for case in known], self.store, self.pool, self.retry)
        found: list[Histories | None] = []
        for case in cases:
            try:
                found.append(StoredSolver(case, self.store, retry=self.retry)({}) if case is not None else None)
            except RunFailed:
                found.append(None)
        return found

    def _errors(
        self, shots: Sequence[Shot], origins: Sequence[tuple[float, bool]], runs: Sequence[Histories | None]
    ) -> dict[str, ShotError | None]:
        triples = zip(self.setups, shots, origins, runs, strict=True)
        return {s.name: shot_errors(shot, run, t0) if run is not None else None for s, shot, (t0, _), run in triples}

    def _verified(
        self, shots: Sequence[Shot], origins: Sequence[tuple[float, bool]], outcome: InversionOutcome
    ) -> dict[str, ShotError]:
        """Of the joint answer, shot by shot."""
        answer = outcome.inversion.methods["emulator"]
        theta = {name: float(e.value or 0.0) for name, e in answer.parameters.items()}
        if answer.combination is not None:
            theta = dict(answer.combination.point)
        moved = [(outcome.inversion.time_offset.value, True), *origins[1:]]
        runs = [verified(shot)(theta) for shot in shots]
        self._written("calibrated", runs, moved)
        found = self._errors(shots, moved, runs)
        return {name: one for name, one in found.items() if one is not None}

    def _written(self, what: str, runs: Sequence[Histories | None], origins: Sequence[tuple[float, bool]]) -> None:
        """Curves on each record's clock, for the page."""
        for setup, run, (t0, _) in zip(self.setups, runs, origins, strict=True):
            if run is not None:
                write_histories(self.folder / f"{what}_{setup.name}.csv", replace(run, time=run.time + t0))

    def _estimates(self, outcome: InversionOutcome) -> dict[str, Estimate]:
        """SI values and intervals."""
        found: dict[str, Estimate] = {}
        units = dict(zip(self.scale.space.names, self.scale.space.units, strict=True))
        for name, one in outcome.inversion.methods["emulator"].parameters.items():
            value = None if one.value is None else self.scale.value(name, one.value)
            ends = one.interval_95
            interval = (self.scale.value(name, ends[0]), self.scale.value(name, ends[1])) if ends else None
            found[name] = replace(
                one, value=value, interval_95=interval, unit=units[name], reason=self._named(one.reason)
            )
        return found

    def _combinations(self, outcome: InversionOutcome, located: Located) -> dict[str, Combined]:
        """The bulk modulus, where what is sought changes it."""
        rng = np.random.default_rng(self.options.seed)
        calibration, case = located.calibration, self.cases[0]
        if calibration.design.deficient:
            return {}
        formula, keys = modulus_of(case)
        mode, space = calibration.modes[0], self.scale.space
        everywhere = self._moduli(space.to_physical(rng.random((DRAWS, len(space.names)))))
        if np.ptp(everywhere) <= 1e-9 * np.abs(everywhere).max():
            return {}
        if outcome.posterior is not None:
            theta = outcome.posterior.theta[rng.integers(0, len(outcome.posterior.theta), DRAWS)]
        else:
            theta = linearised_draws(located, DRAWS, rng)
        draws = self._moduli(self.scale.physical(theta))
        value = float(self._moduli(self.scale.physical(mode.theta[None]))[0])
        low, high = np.quantile(draws, [0.025, 0.975])
        interval = (min(float(low), value), max(float(high), value))
        before = np.quantile(everywhere, [0.025, 0.975])
        width = np.log(interval[1] / interval[0]) / np.log(before[1] / before[0])
        identified = bool(width < NEWS) and outcome.inversion.prior_predictive.inside
        estimates = outcome.inversion.methods["emulator"].parameters
        weak = [plain(key) for key in keys if not estimates[key].identified]
        named = f"K = {formula}" if formula else "K"
        text = f"{named} = {quantity(value, 'Pa')} (95 %: {span(*interval, 'Pa')})"
        if not identified:
            text = f"the bulk modulus {named} is not identifiable from this record"
        elif weak and len(keys) > 1:
            text += f"; {' and '.join(weak)} not identifiable from this record: only the combination counts"
        return {"bulk_modulus": Combined(value, interval, "Pa", identified, formula, keys, text)}

    def _moduli(self, values: Array) -> Array:
        """Bulk modulus [Pa] at SI values (n, k)."""
        names = self.scale.space.names
        case = self.cases[0]
        return np.array([built(case, dict(zip(names, map(float, row), strict=True))).bulk_modulus for row in values])

    def _literature(self) -> dict[str, float]:
        """Published values of what is sought, SI."""
        case = literature_case(self.chosen, self.setups[0].case)
        if case is None:
            return {}
        found: dict[str, float] = {}
        for name in self.scale.space.names:
            place: object = case
            for part in name.split("."):
                place = getattr(place, part, None)
            if isinstance(place, int | float):
                found[name] = float(place)
        return found

    def _q2(self, outcome: InversionOutcome) -> dict[str, dict[str, float | None]]:
        q2 = outcome.inversion.emulator.q2
        return {
            setup.name: {c: q2.get(c + suffix(i)) for c in setup.measured.channels}
            for i, setup in enumerate(self.setups)
        }

    def _poor(self, q2: Mapping[str, Mapping[str, float | None]]) -> list[str]:
        """One line of the channels that the emulator predicts poorly."""
        poor = [
            f"{plain(channel)} of {shot} ({value:.2f})"
            for shot, own in q2.items()
            for channel, value in own.items()
            if value is not None and value < GOOD_Q2
        ]
        if not poor:
            return []
        return [
            f"Q2 below {GOOD_Q2:g} for {', '.join(poor)}: these channels carry the emulator's scatter as noise and "
            "count for less in the calibration; more --runs may help, where the runs themselves do not scatter"
        ]

    def _eroded(self) -> dict[str, float]:
        found = {}
        for setup in self.setups:
            entries = CampaignFolder(self.folder / setup.name).read_summary().get("runs", [])
            found[setup.name] = max((float(e.get("eroded_mass_fraction") or 0.0) for e in entries), default=0.0)
        return found

    def _strikes(
        self, added: int, shots: Sequence[Shot], folds: Mapping[str, object], published: Sequence[object]
    ) -> dict[str, int]:
        """Simulations of each shot: campaign, runs near the answer, nuisances, verification, held out, published."""
        heldout = len(folds) and (1 if len(shots) > 1 else BLOCKS)
        found = {}
        for setup, shot, run in zip(self.setups, shots, published, strict=True):
            nuisances = 2 * len(case_nuisances(shot.case)) if shot.case is not None else 0
            found[setup.name] = self.options.runs + added + nuisances + 1 + heldout + (run is not None)
        return found

    def _named(self, text: str) -> str:
        """Channels "@2" of the joint record as those of their shot."""
        for i, setup in reversed(list(enumerate(self.setups))):
            if i:
                text = re.sub(rf"(\w)@{i + 1}\b", rf"\1 of {setup.name}", text)
        return text


def verified(shot: Shot) -> Forward:
    """The model of a shot that verifies answers."""
    return shot.verifier or shot.forward


def _part(dataset: Dataset, shot: Shot, number: int) -> Shot:
    """A shot with its part of the joint runs, those near the answer included."""
    own = {name: dataset.curves[name + suffix(number)] for name in shot.dataset.curves}
    units = {name: dataset.channel_units[name + suffix(number)] for name in shot.dataset.curves}
    return replace(shot, dataset=replace(dataset, curves=own, channel_units=units))


def _done(counts: RunCounts) -> float:
    return (counts.finished + counts.failed) / max(counts.total, 1)


def _silent(_: float) -> None:
    """Nobody watches."""
