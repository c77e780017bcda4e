"""Simulations of one bird model for all shots: campaigns at the same points, rounds of runs near the answer, published.

A shot enters as its record with its case; the campaign leaves as a shot of the joint estimation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import RunFailed
from birdstrike.data.formatting import listing, quantity
from birdstrike.data.histories import Array, Histories
from birdstrike.data.storage.store import RunStore
from birdstrike.doe.campaign.campaign import run_campaign
from birdstrike.doe.campaign.folder import CampaignFolder, flat
from birdstrike.doe.campaign.planned import planned_design
from birdstrike.doe.designs.design import Design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion import forward
from birdstrike.inversion.estimation.answers.proposal import Calibration
from birdstrike.inversion.estimation.calibration import Mode
from birdstrike.inversion.estimation.known_errors import NuisanceRuns, discrepancy_columns, stated_discrepancy
from birdstrike.inversion.estimation.locate import InversionOptions, locate
from birdstrike.inversion.estimation.refinement import OF_THE_NOISE, PAYS, added_variance, emulator_error, with_run
from birdstrike.inversion.estimation.shots import CampaignShot, Joint
from birdstrike.inversion.forward import Forward, StoredSolver
from birdstrike.inversion.models.candidates import PREFIX, Candidate, calibrated_case, literature_case, refuse_invalid
from birdstrike.inversion.models.points import near_answer
from birdstrike.inversion.models.simulations import LatePool, NearestFinished, PlacedSolver, simulate_all
from birdstrike.inversion.observations.expected import declared_drifts
from birdstrike.inversion.observations.observations import Observations
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.nuisances import case_nuisances
from birdstrike.solver.case.sections import quantity_at
from birdstrike.surrogate.emulator import Emulator, fit_emulator

CONSTRUCTION = ("bird", "plate", "target")
"""What shots of one comparison usually have in common, as sections of a case."""
MOST_KEYS = 3


@dataclass(frozen=True)
class ShotSetup:
    """One record with the case of its shot; name: in models.json."""

    name: str
    case: Case
    measured: Measured


def unlike_cases(setups: Sequence[ShotSetup]) -> tuple[str, ...]:
    """A warning where the cases differ in bird or target, which may be meant or the wrong case beside a record.

    The bird's material is each model's own; shots differ in impact, time and sensors.
    """
    tables = [flat({key: tree.get(key, {}) for key in CONSTRUCTION}) for tree in (s.case.canonical() for s in setups)]
    keys = dict.fromkeys(key for table in tables for key in table if not key.startswith(PREFIX))
    unlike = [key for key in keys if any(table.get(key) != tables[0].get(key) for table in tables)]
    if not unlike:
        return ()
    shown = listing([_by_shot(key, setups, tables) for key in unlike], MOST_KEYS)
    return (
        f"the cases of the shots differ in {shown}: each record is compared with a simulation of its own case; "
        "where this is not meant, correct --case",
    )


def _by_shot(key: str, setups: Sequence[ShotSetup], tables: Sequence[Mapping[str, Any]]) -> str:
    mark, values = quantity_at(key), [table.get(key, "not stated") for table in tables]
    shown = [quantity(v, mark.unit) if mark is not None and isinstance(v, float) else str(v) for v in values]
    return f"{key} ({', '.join(f'{value} of {s.name}' for value, s in zip(shown, setups, strict=True))})"


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
class ModelRuns:
    """Simulations of one model for these shots.

    folder: of its runs; retry: failures stored before it [s, Unix] are tried again.
    """

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
        return [calibrated_case(self.chosen, setup.case) for setup in self.setups]

    @cached_property
    def space(self) -> ParameterSpace:
        """Ranges and their scales, the same of all cases."""
        return ParameterSpace.of_case(self.cases[0])

    @cached_property
    def store(self) -> RunStore:
        """Runs beside the campaigns'."""
        return RunStore(self.folder / "runs")

    def campaigns(self, said: list[str]) -> list[CampaignShot]:
        """Each shot's runs, at the same points, as a shot of the joint estimation."""
        shots = []
        for setup, case in zip(self.setups, self.cases, strict=True):
            place = self.folder / setup.name
            place.mkdir(parents=True, exist_ok=True)
            dataset = run_campaign(
                case,
                self._design(setup),
                place,
                workers=self.pool.workers,
                simulate=forward.simulate,
                executor=self.pool,
                progress=lambda counts, n=setup.name: self.report(n, counts.done),
                say=said.append,
                retry=self.retry,
            )
            shots.append(self._shot(setup, case, dataset, place, said))
        return shots

    def refuse_invalid_runs(self) -> None:
        """Raises CaseError where a case refuses a run of its design, which would end the campaigns half-way."""
        names = self.space.names
        for setup, case in zip(self.setups, self.cases, strict=True):
            rows = self._design(setup).values
            refuse_invalid(self.chosen, case, (dict(zip(names, map(float, row), strict=True)) for row in rows))

    def _design(self, setup: ShotSetup) -> Design:
        """Of a shot's campaign: what its folder holds, or the same points for all."""
        o = self.options
        return planned_design(o.design, self.space, o.runs, o.seed, self.folder / setup.name)

    def _shot(self, setup: ShotSetup, case: Case, dataset: Dataset, place: Path, said: list[str]) -> CampaignShot:
        dataset = replace(dataset, drifts=declared_drifts(case))
        solver = PlacedSolver(case, self.store, (RunStore(place / "runs"),), retry=self.retry)
        nuisances = NuisanceRuns(solver, case_nuisances(case))
        shares = stated_discrepancy(case, setup.measured.channels, None)
        options = InversionOptions(seed=self.options.seed, more_runs="--runs N").fit_alone.of_case(case)

        def columns(observations: Observations, mode: Mode) -> Array:
            parts = [nuisances.columns(observations, dataset.named(mode.theta), mode.t0)]
            parts += [discrepancy_columns(shares, observations)] if shares else []
            return np.hstack(parts)

        known = columns if nuisances.nuisances or shares else None
        verifier = NearestFinished(solver, dataset, said.append)
        return CampaignShot(
            dataset, setup.measured, solver, options, known, campaign=place, verifier=verifier, case=case
        )

    def refined(self, joint: Joint, said: list[str]) -> tuple[Dataset, Emulator, int]:
        """Runs added about the best fit, all shots at each point, until the emulator is good enough there."""
        dataset, names, added = joint.dataset, list(joint.measured.channels), 0
        emulator = fit_emulator(dataset, names, self.options.seed)
        for number in range(self.options.rounds):
            found = locate(dataset, joint.measured, joint.options, emulator)
            calibration = found.calibration
            if calibration.design.deficient or _good_enough(calibration):
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
        thetas = [dataset.named(row) for row in points]
        self.together(thetas)
        for theta in thetas:
            try:
                dataset = with_run(dataset, theta, joint(theta))
            except RunFailed as failure:
                said.append(f"a run near the answer failed and is left out: {failure}")
        return dataset

    def together(self, points: Sequence[Mapping[str, float]]) -> None:
        """Every shot at these SI values, in parallel."""
        simulate_all([(case, values) for case in self.cases for values in points], self.store, self.pool, self.retry)

    def simulated(self, points: Iterable[tuple[Case, Mapping[str, float]]]) -> None:
        """Each case at its SI values, in parallel."""
        simulate_all(list(points), self.store, self.pool, self.retry)

    def published(self) -> list[Histories | None]:
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

    def eroded(self) -> dict[str, float]:
        """Shot -> largest eroded share of the bird in a run of its campaign."""
        found = {}
        for setup in self.setups:
            entries = CampaignFolder(self.folder / setup.name).read_summary().get("runs", [])
            found[setup.name] = max((float(e.get("eroded_mass_fraction") or 0.0) for e in entries), default=0.0)
        return found


def _good_enough(calibration: Calibration) -> bool:
    """Whether the emulator neither widens an interval nor errs by more than the noise.

    What its components leave out counts as the runs' scatter where an interval's width is shared out; about an answer
    far from most runs it is mostly want of runs, which more of them take away.
    """
    mode = calibration.modes[0]
    error, share = emulator_error(calibration.calibrator, mode), added_variance(calibration.raised, mode)
    return error < OF_THE_NOISE and share < PAYS
