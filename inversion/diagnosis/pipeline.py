"""The procedure: rank the models of the library over the shots, check the likeliest by the solver, state the answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from birdstrike.data.progress import Display, no_display
from birdstrike.doe.campaign.simulations import Counter, Simulations, uncounted
from birdstrike.inversion.diagnosis.conclusions.alarm import (
    ALPHA,
    alarm,
    gain,
    minimum_detectable,
    required_discrepancy,
)
from birdstrike.inversion.diagnosis.conclusions.answer import (
    at_search_limit,
    curves,
    discrepancy_figures,
    effect_figures,
    fits_elsewhere,
    held_out_figures,
    held_out_record_is_worse,
    input_warnings,
    is_fault,
    noise_figures,
    not_explained,
    pair_figures,
    predicts_no_better,
    sensors_left_out,
    simulation_counts,
    something_else_figures,
    state,
    too_close,
    verdict_of,
    without_baseline,
)
from birdstrike.inversion.diagnosis.conclusions.baseline import (
    Baselines,
    Birds,
    baseline_shapes,
    larger_shapes,
    mesh_shapes,
    residual_rms,
)
from birdstrike.inversion.diagnosis.conclusions.before_and_after import (
    Held,
    SolverRun,
    hold_out,
    other_record,
    predicted_parts,
    run_at,
)
from birdstrike.inversion.diagnosis.conclusions.next_measurement import propose
from birdstrike.inversion.diagnosis.conclusions.solver_update import update
from birdstrike.inversion.diagnosis.inference.hypotheses import (
    AUTO,
    NOTHING,
    birds_apart,
    candidate_effects,
    hypotheses,
)
from birdstrike.inversion.diagnosis.inference.ranking import Assessment, Problem, Ranking, likelier, rank
from birdstrike.inversion.diagnosis.inference.system import Options as SystemOptions
from birdstrike.inversion.diagnosis.model_file import model_table
from birdstrike.inversion.diagnosis.preparation.discrepancy import Amplitudes, beside_baselines, unknown_or_stated
from birdstrike.inversion.diagnosis.preparation.plan import RUNS
from birdstrike.inversion.diagnosis.preparation.shots import Shot, setups_of
from birdstrike.inversion.estimation.refinement import AUTO as REFINE_AUTO
from birdstrike.inversion.results.diagnosis import (
    AMBIGUOUS,
    ATTRIBUTED,
    NO_RESIDUAL,
    NONE,
    SOMETHING_ELSE,
    Diagnosis,
    ShotStates,
    State,
    of_another_bird,
)
from birdstrike.inversion.results.diagnosis_text import sentence_of

SETTLED = 0.05  # posterior probability from which on an effect is likely enough for its case to be written
UPDATES = 3  # rounds of simulations at the fits: an edge that lets go bends the response more than one round can tell
MOST_SHARES = 30  # models whose probabilities are listed


@dataclass(frozen=True)
class DiagnosisOptions:
    """How to diagnose.

    alpha: rate of false alarms; runs: of the coarse campaign; refine: runs of it that may be added near the fits, or
    "auto"; retry: see Runner; check: whether the solver is run at the fits before and after; baseline_bird: what is
    known of the bird of a baseline beside the shot's, one of `hypotheses.BIRDS`, or `auto`, with which the records
    decide; magnitude_scale, remainder_scale, parameter_length: the priors, for a sensitivity study.
    """

    alpha: float = ALPHA
    seed: int = 0
    workers: int | None = None
    runs: int = RUNS
    display: Display = no_display
    counter: Counter = uncounted
    retry: float = 0.0
    check: bool = True
    magnitude_scale: float = 1.0
    remainder_scale: float = 1.0
    parameter_length: float = 1.0
    baseline_bird: str = AUTO
    refine: int | str = REFINE_AUTO

    def choices(self) -> dict[str, Any]:
        """Those that change an answer; the others say how it is made and shown."""
        return {
            name: value for name, value in vars(self).items() if name not in ("workers", "display", "counter", "retry")
        }


@dataclass(frozen=True)
class _Decision:
    """The verdict, and what it rests on.

    ranking: with a refit of the chosen effect; alarm: p of the model without an effect; same_bird: probability that all
    birds are one, None of a single shot; required: see `required_discrepancy`; chosen: the single effect whose case is
    written; runs, failed: shot and `before` or `after` -> the solver at that fit, or why it failed; held: model -> the
    parts of the data held out from it; fit_warnings: that the likeliest effect is not attributed, or not borne out.
    """

    ranking: Ranking
    alarm: float
    same_bird: float | None
    required: Mapping[str, float | None]
    verdict: str
    chosen: str | None
    runs: Mapping[str, SolverRun]
    failed: Mapping[str, str]
    held: Mapping[str, list[Held]]
    fit_warnings: tuple[str, ...]

    def states(self, shot: Shot, held: Mapping[str, list[Held]]) -> tuple[State, State | None]:
        """Before and after in one shot, by the given parts that were held out of each model."""
        runs = _of_shot(self.runs, shot.name)
        before = state(self.ranking, NONE, shot, held[NONE], runs.get("before"), self.chosen)
        if not self.chosen:
            return before, None
        return before, state(self.ranking, self.chosen, shot, held[self.chosen], runs.get("after"))

    def shot_states(self, shot: Shot) -> ShotStates:
        """Before and after in one shot, by the parts of its own record."""
        parts = {label: [part for part in held if part.shot == shot.name] for label, held in self.held.items()}
        return ShotStates(shot.name, shot.setup.plan.case.name, *self.states(shot, parts))


@dataclass(frozen=True)
class Pipeline:
    """One diagnosis of measured shots beside their baselines; warnings: what the user must know of the input."""

    shots: tuple[Shot, ...]
    baselines: Baselines
    options: DiagnosisOptions
    simulations: Simulations
    warnings: tuple[str, ...] = ()

    def diagnosis(self, refinement: Mapping[str, Any], heldout: Shot | None = None) -> Diagnosis:
        """The whole procedure; heldout: a record that nothing is fitted to.

        refinement: runs added near the fits, as `strikes.refinement` of diagnosis.json has them.
        """
        with threadpool_limits(limits=1, user_api="blas"), self.options.display("Comparison of the models") as progress:
            ranking = rank(self.problem, progress)
            for _ in range(UPDATES):
                again = update(ranking, self.simulations)
                if again is ranking.problem:
                    break
                ranking = rank(again, progress)
            p = alarm(ranking, self.options.seed)
            measured_alone = replace(self, shots=ranking.problem.measured)
            return measured_alone._assembled(measured_alone._decided(ranking, p, heldout), refinement)

    @cached_property
    def problem(self) -> Problem:
        """The shots with their discrepancy.

        What a baseline's residual is beyond the unnamed errors shows little of how the discrepancy grows in time: one
        slow curve has few degrees of freedom. Meshes show more, of an error that need not be the model's. So that both
        are tried, and the records say which.
        """
        shots = (*self.shots, *self.baselines.shots)
        meshes, known = mesh_shapes(shots), self._known(kinds_of(shots))
        options, apart = SystemOptions(self.options.parameter_length), birds_apart(self.options.baseline_bird)
        found, scale = candidate_effects(shots), self.options.magnitude_scale
        if not self.baselines.shots:
            return Problem(shots, found, known, meshes, options, scale, apart).manageable()
        own = baseline_shapes(self.baselines.fits, meshes)
        alone = Problem(shots, found, known, own, options, scale, apart)
        grown = replace(known, source=f"{known.source}; in time also as simulations on two meshes differ")
        both = (alone, replace(alone, known=grown, shapes=larger_shapes(own, meshes)))
        return likelier(*(one.manageable() for one in both))

    def _known(self, kinds: Sequence[str]) -> Amplitudes:
        """The discrepancy's amplitudes from baselines, from the cases, or unknown: one for each kind of sensor.

        Of sensors of one kind for which several are stated, the largest.
        """
        stated = dict[str, float]()
        for case in (shot.setup.plan.case for shot in self.shots):
            for sensor, share in case.inversion.discrepancy.items():
                kind = case.sensors[sensor].kind
                stated[kind] = max(share, stated.get(kind, 0.0))
        if not self.baselines.shots:
            return unknown_or_stated(kinds, stated, len(self.shots) > 1)
        found = [fit.evidence.amplitudes for _, fit in self.baselines.fits.values()]
        each = {kind: [one[kind] for one in found if kind in one] for kind in kinds}
        shown = {kind: float(np.mean(shares)) for kind, shares in each.items() if shares}
        return beside_baselines(kinds, shown, len(found), stated, self.options.remainder_scale)

    def _birds(self, ranking: Ranking) -> Birds:
        """What is known of the birds by a ranking."""
        return Birds(ranking, self.options.baseline_bird, len(self.shots) + len(self.baselines.shots) > 1)

    def _chosen(self, ranking: Ranking, verdict: str) -> str | None:
        """The single effect whose case is written: the likeliest, where it is likelier than none."""
        best = _likeliest(ranking)
        settled = ranking.presence[best] >= max(SETTLED, ranking.shares[NONE])
        return best if settled and verdict != NO_RESIDUAL else None

    def _decided(self, ranking: Ranking, p: float, heldout: Shot | None) -> _Decision:
        """The verdict by the probabilities, as far as what was held out bears it out."""
        ahead, same_bird = ranking.ahead(_likeliest(ranking)), self._birds(ranking).same
        verdict = verdict_of(ranking.presence, p, self.options.alpha, ranking.confidence_set, same_bird, ahead)
        chosen = self._chosen(ranking, verdict)
        required, fit_warnings = required_discrepancy(ranking), too_close(ranking, chosen, ahead)
        ranking = ranking.refitted(chosen) if chosen else ranking
        fit_warnings = [*fit_warnings, *fits_elsewhere(ranking, chosen or NONE)]
        runs, failed = self._checked(ranking, chosen)
        held = self._held_out(ranking, chosen, heldout, not of_another_bird(same_bird))
        if verdict == ATTRIBUTED and chosen and (against := self._against(ranking, chosen, held)):
            verdict, fit_warnings = AMBIGUOUS, [*fit_warnings, *against]
        if chosen and heldout is not None:
            fit_warnings = [*fit_warnings, *held_out_record_is_worse(chosen, held)]
        if chosen:
            held = {**held, chosen: predicted_parts(ranking.models[chosen].members[0], held[chosen])}
        return _Decision(
            ranking=ranking,
            alarm=p,
            same_bird=same_bird,
            required=required,
            verdict=verdict,
            chosen=chosen,
            runs=runs,
            failed=failed,
            held=held,
            fit_warnings=tuple(fit_warnings),
        )

    def _against(self, ranking: Ranking, effect: str, held: Mapping[str, Sequence[Held]]) -> list[str]:
        """Warnings for all that keeps an effect, although it is by far the likeliest, from being attributed."""
        return [
            *(at_search_limit(ranking, effect) if is_fault(ranking, effect) else ()),
            *not_explained(ranking, effect, self.shots),
            *predicts_no_better(ranking, effect, held),
        ]

    def _assembled(self, decision: _Decision, refinement: Mapping[str, Any]) -> Diagnosis:
        """The answer's figures."""
        ranking, chosen, runs = decision.ranking, decision.chosen, decision.runs
        shot = self.shots[0]
        best = runs.get(f"{self._shot_with(decision)} after")
        effects = effect_figures(ranking, decision.required, chosen if best else None)
        proposal = propose(ranking, shot, decision.verdict != NO_RESIDUAL and of_another_bird(decision.same_bird))
        before, after = decision.states(shot, decision.held)
        diagnosis = Diagnosis(
            alpha=self.options.alpha,
            alarm=decision.alarm,
            verdict=decision.verdict,
            confidence_set=ranking.confidence_set,
            probabilities=dict(sorted(ranking.shares.items(), key=lambda entry: -entry[1])[:MOST_SHARES]),
            families=ranking.families,
            required_discrepancy=decision.required,
            effects=effects,
            before=before,
            after=after,
            minimum_detectable=minimum_detectable(ranking, self.options.alpha),
            next_measurement=None if proposal is None else {**vars(proposal), "sentence": proposal.sentence},
            pairs=pair_figures(ranking),
            remainder=something_else_figures(ranking),
            noise=noise_figures(self.shots, ranking),
            discrepancy=discrepancy_figures(ranking, chosen),
            nuisance={},
            baseline=self._baseline_figures(ranking),
            shots=tuple(decision.shot_states(one) for one in self.shots),
            held_out=held_out_figures(decision.held, chosen),
            case_after=None,
            strikes={
                **simulation_counts(ranking, self.simulations, shot, runs, chosen),
                "refinement": dict(refinement),
            },
            warnings=self._warnings(decision),
            refused=shot.setup.refused,
            left_out={name: share for one in self.shots for name, share in one.setup.left_out.items()},
            record={"path": shot.name, "simulated": False},
            sentence="",
            curves={one.name: curves(ranking, one, chosen, _of_shot(runs, one.name)) for one in self.shots},
            case=best.case if best else None,
            model=model_table(ranking, self.shots, {"before": NONE, **({"after": chosen} if chosen else {})}),
        )
        return replace(diagnosis, sentence=sentence_of(diagnosis))

    def _shot_with(self, decision: _Decision) -> str:
        """Name of the first shot with the chosen effect; of a sensor's fault, that has the sensor in its record."""
        if decision.chosen is None:
            return self.shots[0].name
        effect = decision.ranking.models[decision.chosen].members[0]
        acting = [shot for shot in self.shots if shot.name in effect.shots]
        seen = [shot for shot in acting if effect.fault and set(effect.fault.sensors) & set(shot.channels)]
        return (seen or acting)[0].name

    def _checked(self, ranking: Ranking, chosen: str | None) -> tuple[dict[str, SolverRun], dict[str, str]]:
        """The solver at the fits, before and after, in every shot."""
        if not self.options.check:
            return {}, {}
        wanted = {}
        for shot in self.shots:
            wanted[f"{shot.name} before"] = (shot, ranking.fits[NONE], ranking.models[NONE])
            if chosen:
                wanted[f"{shot.name} after"] = (shot, ranking.fits[chosen], ranking.models[chosen])
        return run_at(wanted, self.simulations)

    def _held_out(
        self, ranking: Ranking, chosen: str | None, heldout: Shot | None, alike: bool
    ) -> dict[str, list[Held]]:
        """Parts of the data that each model predicts; alike: whether the birds are."""
        labels = [NONE] + ([chosen] if chosen else [])
        held = {label: hold_out(ranking.problem, ranking.models[label], ranking.fits[label], alike) for label in labels}
        if heldout is not None:
            for label in labels:
                fit, model = ranking.fits[label], ranking.models[label]
                held[label].append(other_record(ranking.problem, model, fit, heldout, self.shots[0]))
        return held

    def _baseline_figures(self, ranking: Ranking) -> dict[str, Any] | None:
        """What the baselines show, and by how much smaller they make what can be detected."""
        if not self.baselines.shots:
            return None
        alone = replace(self, baselines=Baselines()).problem
        none = alone.refit(NOTHING, steps=3)
        models = {one.label: one for one in hypotheses(alone.found) if len(one.members) < 2}
        without = Ranking(alone, models, {NONE: Assessment.refitted(none)})
        rms: dict[str, float] = {}
        for shot, fit in self.baselines.fits.values():
            for channel, value in residual_rms(shot, fit).items():
                rms[channel] = max(rms.get(channel, 0.0), value)
        return {
            "shots": [shot.name.removeprefix("baseline ") for shot in self.baselines.shots],
            "residual_rms": rms,
            "gain": gain(ranking, without, self.options.alpha),
            "same_bird": self._birds(ranking).same,
            "bird": self._birds(ranking).figures,
        }

    def _warnings(self, decision: _Decision) -> tuple[str, ...]:
        """The gravest first."""
        ranking, chosen = decision.ranking, decision.chosen
        failed = [
            f"the simulation at the fit of {label} failed: {reason}; the error stated is the emulator's"
            for label, reason in decision.failed.items()
        ]
        lone = [] if self.baselines.shots else without_baseline(ranking, self.shots[0].setup.plan.case)
        at_limit = at_search_limit(ranking, chosen) if chosen else ()
        return (
            *failed,
            *self.warnings,
            *sensors_left_out(setups_of(self.shots)),
            *self.baselines.warnings,
            *lone,
            *self._birds(ranking).warnings,
            *dict.fromkeys([*decision.fit_warnings, *at_limit]),
            *input_warnings(ranking, self.shots, self.baselines.shots, chosen or NONE),
        )


def _likeliest(ranking: Ranking) -> str:
    """The effect that is likeliest to be there, alone or beside another."""
    effects = (label for label in ranking.presence if label not in (NONE, SOMETHING_ELSE))
    return max(effects, key=lambda label: ranking.presence[label])


def kinds_of(shots: Sequence[Shot]) -> tuple[str, ...]:
    """Kinds of the shots' sensors."""
    return tuple(dict.fromkeys(kind for shot in shots for kind in shot.kinds))


def _of_shot(runs: Mapping[str, SolverRun], shot: str) -> dict[str, SolverRun]:
    """`before` and `after` of one shot."""
    return {label.rsplit(" ", 1)[1]: run for label, run in runs.items() if label.rsplit(" ", 1)[0] == shot}
