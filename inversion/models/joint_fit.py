"""One bird model calibrated to all shots at once, verified by the solver, and tested on what it was not calibrated to.

campaigns simulates; the fit carries noise, nuisances and a discrepancy of the model whose size the records choose;
heldout_fits repeats it without each shot.
"""

from __future__ import annotations

import re
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from birdstrike.data.curves import write_histories
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import RunFailed
from birdstrike.data.formatting import plain
from birdstrike.data.histories import Array, Histories
from birdstrike.data.storage.files import write_json
from birdstrike.inversion.diagnosis.preparation.discrepancy import LEAST
from birdstrike.inversion.estimation.locate import Located, locate
from birdstrike.inversion.estimation.posterior import Sampling
from birdstrike.inversion.estimation.shots import CampaignShot, Joint, joined, own_origin, suffix
from birdstrike.inversion.identifiability.summary import DRAWS_FILE, write_draws
from birdstrike.inversion.invert import InversionOutcome, invert, measured_figures
from birdstrike.inversion.models.campaigns import ModelRuns
from birdstrike.inversion.models.candidates import kept_constants, literature_values
from birdstrike.inversion.models.combinations import combinations
from birdstrike.inversion.models.error_terms import Discrepancy, with_discrepancy
from birdstrike.inversion.models.heldout_fits import BLOCKS, HeldOutFits
from birdstrike.inversion.models.optimisers import Problem, optimised
from birdstrike.inversion.models.points import residuals_of, shot_errors, yardstick
from birdstrike.inversion.models.results import ModelAnswer, Optimised, ShotError, withdraw_answer
from birdstrike.inversion.models.simulations import PlacedSolver
from birdstrike.inversion.results.estimates import Estimate
from birdstrike.solver.case.nuisances import case_nuisances
from birdstrike.surrogate.emulator import Emulator
from birdstrike.surrogate.files import save_emulator

AMPLITUDES = (0.0, LEAST, 0.01, 0.03)
"""Of the peak: sizes of the discrepancy that are tried; the diagnosis's range, up to where a fit has a meaning.

A model that asks for the largest is wrong by more than that. A slow error of its own would then take what the constants
should fit, so that it is calibrated without one, to the least error over the noise, which is what ranks it; its
intervals are those of the widened residual."""


@dataclass(frozen=True)
class ModelFit:
    """The joint fit of one model, on its simulations."""

    runs: ModelRuns

    def answer(self) -> ModelAnswer:
        """The model's answer without its place in a ranking; raises UserError and RunFailed."""
        with threadpool_limits(limits=1, user_api="blas"):  # matrices of a few hundred rows lose to waking threads
            return self._answer()

    def _answer(self) -> ModelAnswer:
        began, said = time.monotonic(), list[str]()
        shots = self.runs.campaigns(said)  # refuses a folder of other cases, of which nothing is then touched
        withdraw_answer(self.runs.folder)
        said += kept_constants(self.runs.chosen, self.runs.cases)
        origins = [own_origin(s) if s.options.time_offset else (0.0, True) for s in shots]
        joint = joined(shots, origins)
        dataset, emulator, added = self.runs.refined(joint, said)
        self.runs.report("fit", 0.0)
        discrepancy = Discrepancy([case.first_contact for case in self.runs.cases], float(dataset.time[-1]))
        share, located = self._best_share(dataset, joint, emulator, discrepancy)
        columns = with_discrepancy(joint.columns, discrepancy, share)
        sampling = Sampling() if self.runs.options.posterior else None
        options = replace(joint.options, sampling=sampling, analyse=False)
        outcome = invert(dataset, joint.measured, joint.verifier, options, emulator=emulator, columns=columns)
        self.runs.report("fit", 1.0)
        self._kept_draws(outcome)
        folds = HeldOutFits(self.runs, dataset, shots, origins, emulator, discrepancy, share).answers()
        clocks = _clocks(origins, outcome.inversion.time_offset.value)
        self._kept(emulator, dataset, located, clocks)
        published = self.runs.published()
        self._written("published", published, clocks)
        q2 = self._q2(outcome)
        said += outcome.inversion.warnings
        return ModelAnswer(
            name=self.runs.chosen.name,
            source=self.runs.chosen.source,
            parameters=self._estimates(outcome),
            ranges={p.name: (p.low, p.high) for p in self.runs.cases[0].parameters()},
            combinations=combinations(self.runs, outcome, located),
            literature=self._literature(),
            verified=self._verified(shots, clocks, outcome),
            published=self._errors(shots, clocks, published),
            heldout_parameters=folds.thetas,
            residuals=folds.residuals,
            q2=q2,
            optimised=self._optimised(shots, clocks, said),
            eroded=self.runs.eroded(),
            discrepancy=share,
            inside=outcome.inversion.prior_predictive.inside,
            runs=len(dataset.runs),
            strikes=self._strikes(added, shots, published),
            wall_s=time.monotonic() - began,
            warnings=tuple(dict.fromkeys(self._named(line) for line in said)),
            measured={
                setup.name: measured_figures(setup.measured, yardstick(shot), float(shot.dataset.time[0]))
                for setup, shot in zip(self.runs.setups, shots, strict=True)
            },
        )

    def _kept(self, emulator: Emulator, dataset: Dataset, located: Located, clocks: Sequence[float]) -> None:
        """The emulator of all shots, known points of it, and the time origins, for the page with sliders."""
        save_emulator(self.runs.folder / "emulator.npz", emulator, dataset)
        literature = self._literature()
        published = [literature.get(name) for name in dataset.names]
        content = {
            "ranges": dataset.ranges,
            "units": dict(zip(dataset.names, dataset.units, strict=True)),
            "calibrated": [float(v) for v in located.calibration.modes[0].theta],
            "published": published if None not in published else None,
            "channels": {
                setup.name: {name: name + suffix(i) for name in setup.measured.channels}
                for i, setup in enumerate(self.runs.setups)
            },
            "clocks": {setup.name: t0 for setup, t0 in zip(self.runs.setups, clocks, strict=True)},
        }
        write_json(self.runs.folder / "emulator.json", content)

    def _kept_draws(self, outcome: InversionOutcome) -> None:
        """The posterior's draws, for `predict`."""
        if outcome.posterior is not None:
            write_draws(self.runs.folder / DRAWS_FILE, outcome.posterior, self.runs.space.names)

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
                with_discrepancy(joint.columns, discrepancy, share),
            )
            for share in AMPLITUDES
        }
        share = min(found, key=lambda one: found[one].calibration.modes[0].cost)
        if share == AMPLITUDES[-1]:
            share = 0.0
        return share, found[share]

    def _optimised(
        self, shots: Sequence[CampaignShot], clocks: Sequence[float], said: list[str]
    ) -> dict[str, Optimised]:
        """What each optimiser reaches; one without an answer is a warning, as the calibration does not need it."""
        found: dict[str, Optimised] = {}
        for name in self.runs.options.optimisers:
            try:
                found[name] = self._reached(name, shots, clocks)
            except RunFailed as failure:
                said.append(
                    f"{failure}: there is nothing of it to compare the calibration with; narrow the ranges "
                    "(inversion.models.NAME), or leave it out of --optimisers"
                )
        return found

    def _reached(self, name: str, shots: Sequence[CampaignShot], clocks: Sequence[float]) -> Optimised:
        """What an optimiser with the solver in the loop reaches on the same records."""

        def residuals(values: Mapping[str, float]) -> Array:
            self.runs.together([values])
            parts = []
            for shot, case, t0 in zip(shots, self.runs.cases, clocks, strict=True):
                own = residuals_of(shot, PlacedSolver(case, self.runs.store, retry=self.runs.retry)(values), t0)
                parts += [np.asarray(r) / np.sqrt(len(r) * len(own) * len(shots)) for r in own.values()]
            return np.concatenate(parts)

        self.runs.report(name, 0.0)
        space = self.runs.space
        problem = Problem(
            space.names,
            space.to_physical,
            residuals,
            self.runs.together,
            self.runs.options.budget,
            self.runs.options.seed,
        )
        return optimised(name, problem)

    def _errors(
        self, shots: Sequence[CampaignShot], clocks: Sequence[float], runs: Sequence[Histories | None]
    ) -> dict[str, ShotError]:
        """Of the shots that have a simulation."""
        each = zip(self.runs.setups, shots, clocks, runs, strict=True)
        return {setup.name: shot_errors(shot, run, t0) for setup, shot, t0, run in each if run is not None}

    def _verified(
        self, shots: Sequence[CampaignShot], clocks: Sequence[float], outcome: InversionOutcome
    ) -> dict[str, ShotError]:
        """Of the joint answer, shot by shot."""
        answer = outcome.inversion.methods["emulator"]
        theta = {name: float(e.value or 0.0) for name, e in answer.parameters.items()}
        if answer.combination is not None:
            theta = dict(answer.combination.point)
        runs = [shot.verified_by(theta) for shot in shots]
        self._written("calibrated", runs, clocks)
        return self._errors(shots, clocks, runs)

    def _written(self, what: str, runs: Sequence[Histories | None], clocks: Sequence[float]) -> None:
        """Curves on each record's clock, for the page."""
        for setup, run, t0 in zip(self.runs.setups, runs, clocks, strict=True):
            if run is not None:
                write_histories(self.runs.folder / f"{what}_{setup.name}.csv", replace(run, time=run.time + t0))

    def _estimates(self, outcome: InversionOutcome) -> dict[str, Estimate]:
        """With the shots' names in what is said of them."""
        found = outcome.inversion.methods["emulator"].parameters
        return {name: replace(one, reason=self._named(one.reason)) for name, one in found.items()}

    def _literature(self) -> dict[str, float]:
        """Published values of what is sought, SI."""
        return literature_values(self.runs.chosen, self.runs.setups[0].case, self.runs.space.names)

    def _q2(self, outcome: InversionOutcome) -> dict[str, dict[str, float | None]]:
        q2 = outcome.inversion.emulator.q2
        return {
            setup.name: {c: q2.get(c + suffix(i)) for c in setup.measured.channels}
            for i, setup in enumerate(self.runs.setups)
        }

    def _strikes(self, added: int, shots: Sequence[CampaignShot], published: Sequence[object]) -> dict[str, int]:
        """Simulations of each shot: campaign, runs near the answer, nuisances, verification, held out, published."""
        heldout = 1 if len(shots) > 1 else BLOCKS
        found = {}
        for setup, shot, run in zip(self.runs.setups, shots, published, strict=True):
            nuisances = 2 * len(case_nuisances(shot.case)) if shot.case is not None else 0
            found[setup.name] = self.runs.options.runs + added + nuisances + 1 + heldout + (run is not None)
        return found

    def _named(self, text: str) -> str:
        """Channels of the joint record ("force", "force of shot 2") as those of their shot, where there are several."""
        setups = self.runs.setups
        if len(setups) == 1:
            return text
        channels = {form for setup in setups for name in setup.measured.channels for form in (name, plain(name))}
        known = "|".join(map(re.escape, sorted(channels, key=len, reverse=True)))

        def of_shot(met: re.Match[str]) -> str:
            return f"{met[1]} of {setups[int(met[2] or met[3] or 1) - 1].name}"

        return re.sub(rf"(?<![\w.])({known})(?:@(\d+)| of shot (\d+))?(?!\w)", of_shot, text)


def _clocks(origins: Sequence[tuple[float, bool]], first: float) -> list[float]:
    """Each record's time origin [s] in the joint fit, which moves all records together.

    origins: (time origin [s], whether it is known) of each shot's own fit, by which later records lie on the first
    one's clock; first: what the joint fit gives the first record.
    """
    return [first + t0 - origins[0][0] for t0, _ in origins]
