"""The procedure: read the shots, calibrate the baselines, rank the models, check by the solver, assemble the answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from birdstrike.data.curves import Measured
from birdstrike.data.errors import UserError
from birdstrike.inversion.diagnosis.alarm import alarm
from birdstrike.inversion.diagnosis.answer import ATTRIBUTED, NO_RESIDUAL, Answer, sentence_of, verdict_of
from birdstrike.inversion.diagnosis.answer import (
    curves,
    effect_figures,
    magnitude_of,
    noise_figures,
    pair_figures,
    state,
)
from birdstrike.inversion.diagnosis.baseline import NOTHING, baseline_shapes, calibrated, mesh_shapes, residual_rms
from birdstrike.inversion.diagnosis.before_and_after import Held, error_sd, hold_out, predicted
from birdstrike.inversion.diagnosis.discrepancy import Amplitudes, beside_baselines, unknown_or_stated
from birdstrike.inversion.diagnosis.next_measurement import propose
from birdstrike.inversion.diagnosis.hypotheses import NONE, SOMETHING_ELSE, hypotheses, suspects
from birdstrike.inversion.diagnosis.pipeline import Options
from birdstrike.inversion.diagnosis.power import gain, minimum_detectable
from birdstrike.inversion.diagnosis.ranking import Ranking, rank
from birdstrike.inversion.diagnosis.refit import Fit, Problem
from birdstrike.inversion.diagnosis.required import required_discrepancy
from birdstrike.inversion.diagnosis.setup import Setup
from birdstrike.inversion.diagnosis.shots import Shot, read_shot
from birdstrike.inversion.diagnosis.before_and_after import SolverRun, run_at
from birdstrike.inversion.diagnosis.solver_update import update
from birdstrike.inversion.diagnosis.simulations import Strikes
from birdstrike.inversion.diagnosis.system import Options as Choices
from birdstrike.inversion.diagnosis.system import Places

UNCLEAN = 0.05  # share of the peak: a baseline whose discrepancy is larger is hardly one in which nothing is amiss
TRUNCATED = 0.6  # of the simulated time: a shorter baseline says nothing of the rest
SETTLED = 0.05  # posterior probability below which a model is not refitted for before and after
MOST_WARNINGS = 5


@dataclass(frozen=True)
class Baselines:
    """shots: those that serve; fits: their calibrations; warnings: why others do not."""

    shots: tuple[Shot, ...]
    fits: Mapping[str, tuple[Shot, Fit]]
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Pipeline:
    """One diagnosis. setups: of every measured shot's case, by the shot's name."""

    shots: tuple[Shot, ...]
    baselines: Baselines
    choice: Options
    strikes: Strikes

    def answer(self, heldout: Shot | None = None) -> Answer:
        """The whole procedure."""
        with threadpool_limits(limits=1, user_api="blas"), self.choice.display("Models compared") as progress:
            problem = self.problem()
            ranking = rank(problem, progress)
            again = update(ranking, self.strikes)
            ranking = ranking if again is problem else rank(again, progress)
            p = alarm(ranking, self.choice.seed)
            required = required_discrepancy(ranking)
            return replace(self, shots=tuple(s for s in ranking.problem.shots if not s.baseline))._assembled(
                ranking, p, required, heldout
            )

    def problem(self) -> Problem:
        """The shots with their discrepancy."""
        shots = (*self.shots, *self.baselines.shots)
        kinds = tuple(dict.fromkeys(kind for shot in self.shots for kind in shot.kinds))
        shapes = mesh_shapes(shots)
        if self.baselines.shots:
            shapes = baseline_shapes(self.baselines.fits, shapes)
        choices = Choices(self.choice.parameter_length)
        return Problem(shots, suspects(shots), self._known(kinds), shapes, choices, self.choice.magnitude_scale)

    def _known(self, kinds: Sequence[str]) -> Amplitudes:
        """The discrepancy's amplitudes from baselines, from the case, or unknown."""
        if self.baselines.shots:
            found = [fit.evidence.amplitudes for _, fit in self.baselines.fits.values()]
            mean = {k: float(np.mean([one[k] for one in found if k in one] or [0.02])) for k in kinds}
            return beside_baselines(mean, len(found), self.choice.remainder_scale)
        case = self.shots[0].setup.plan.case
        by_kind: dict[str, list[float]] = {}
        for sensor, share in case.inversion.discrepancy.items():
            if sensor in case.sensors:
                by_kind.setdefault(case.sensors[sensor].kind, []).append(share)
        stated = {kind: max(shares) for kind, shares in by_kind.items() if kind in kinds}
        return unknown_or_stated(kinds, stated, len(self.shots) > 1)

    def _chosen(self, ranking: Ranking, verdict: str) -> str | None:
        """The single effect whose case is written: the likeliest, where it is likelier than none."""
        singles = [label for label, m in ranking.models.items() if len(m.members) == 1]
        best = max(singles, key=lambda label: ranking.shares[label])
        if verdict == NO_RESIDUAL or ranking.shares[best] < max(SETTLED, ranking.shares[NONE]):
            return None
        return best

    def _assembled(
        self, ranking: Ranking, p: float, required: Mapping[str, float | None], heldout: Shot | None
    ) -> Answer:
        singles = {label for label, m in ranking.models.items() if len(m.members) == 1}
        credible = ranking.confidence_set
        verdict = verdict_of(ranking.shares, p, self.choice.alpha, singles, credible)
        chosen = self._chosen(ranking, verdict)
        ranking = _refitted(ranking, chosen)
        runs, failed = self._checked(ranking, chosen)
        labels = [NONE] + ([chosen] if chosen else [])
        held = {label: hold_out(ranking.problem, ranking.models[label], ranking.fits[label]) for label in labels}
        if heldout is not None:
            for label in labels:
                held[label].append(_other(ranking, label, heldout, self.shots[0]))
        shot = self.shots[0]
        before = state(ranking, NONE, shot, held[NONE], runs.get(f"{shot.name} before"))
        after = state(ranking, chosen, shot, held[chosen], runs.get(f"{shot.name} after")) if chosen else None
        detectable = minimum_detectable(ranking)
        proposal = propose(ranking, shot)
        best = runs.get(f"{shot.name} after")
        found = Answer(
            alpha=self.choice.alpha,
            alarm=p,
            verdict=verdict,
            confidence_set=credible,
            probabilities={label: ranking.shares[label] for label in sorted(ranking.shares, key=lambda x: -ranking.shares[x])[:30]},
            families=ranking.families,
            required_discrepancy=required,
            effects=effect_figures(ranking, required),
            before=before,
            after=after,
            minimum_detectable=detectable,
            next_measurement=None if proposal is None else {**vars(proposal), "sentence": proposal.sentence},
            pairs=pair_figures(ranking),
            remainder=_remainder(ranking),
            noise=noise_figures(shot, ranking),
            discrepancy=_discrepancy(ranking, chosen),
            nuisance={},
            baseline=self._baseline_figures(detectable),
            shots=tuple(self._shot_figures(ranking, one, chosen, runs) for one in self.shots),
            held_out=_side_by_side(held, chosen),
            case_after=None,
            strikes={"paid": self.strikes.paid, "reused": self.strikes.reused, "failures": dict(self.strikes.failures)},
            warnings=self._warnings(ranking, chosen, failed),
            refused=shot.setup.refused,
            record={"path": shot.name, "simulated": False},
            sentence="",
            curves={one.name: curves(ranking, one, chosen, _named(runs, one.name)) for one in self.shots},
            case=best.case if best else None,
        )
        return replace(found, sentence=sentence_of(found))

    def _checked(self, ranking: Ranking, chosen: str | None) -> tuple[dict[str, SolverRun], dict[str, str]]:
        """The solver at the fits, before and after, in every shot."""
        if not self.choice.check:
            return {}, {}
        wanted = {}
        for shot in self.shots:
            wanted[f"{shot.name} before"] = (shot, ranking.fits[NONE], ranking.models[NONE])
            if chosen:
                wanted[f"{shot.name} after"] = (shot, ranking.fits[chosen], ranking.models[chosen])
        return run_at(wanted, self.strikes)

    def _shot_figures(
        self, ranking: Ranking, shot: Shot, chosen: str | None, runs: Mapping[str, SolverRun]
    ) -> dict[str, Any]:
        own = _named(runs, shot.name)
        before = state(ranking, NONE, shot, [], own.get("before"))
        after = state(ranking, chosen, shot, [], own.get("after")) if chosen else None
        case = shot.setup.plan.case.name
        return {"name": shot.name, "case": case, "before": vars(before), "after": vars(after) if after else None}

    def _baseline_figures(self, detectable: Mapping[str, float | None]) -> dict[str, Any] | None:
        """What the baselines told, and by how much smaller they make what can be detected."""
        if not self.baselines.shots:
            return None
        kinds = tuple(dict.fromkeys(kind for shot in self.shots for kind in shot.kinds))
        shapes = mesh_shapes(self.shots)
        alone = Problem(self.shots, suspects(self.shots), unknown_or_stated(kinds, {}), shapes)
        none = alone.refit(NOTHING, steps=3)
        single = rank_only(alone, none)
        rms: dict[str, float] = {}
        for shot, fit in self.baselines.fits.values():
            for channel, value in residual_rms(shot, fit).items():
                rms[channel] = max(rms.get(channel, 0.0), value)
        return {
            "shots": [shot.name for shot in self.baselines.shots],
            "residual_rms": rms,
            "gain": gain(detectable, minimum_detectable(single)),
        }

    def _warnings(self, ranking: Ranking, chosen: str | None, failed: Mapping[str, str]) -> tuple[str, ...]:
        """At most five, the gravest first."""
        found = list(self.baselines.warnings)
        if not self.baselines.shots and not ranking.problem.known.source.startswith("stated"):
            found.append(
                "no baseline and no stated discrepancy: the model error is marginalised over 0.2 to 10 % of the peak, so "
                "that only effects larger than the model error can be named; fire a clean shot and pass it with --baseline"
            )
        if chosen:
            _, _, at_limit = magnitude_of(ranking, chosen)
            if at_limit:
                found.append(f"{chosen}: the magnitude reaches the largest that was looked at; it is at least that large")
        for label, reason in failed.items():
            found.append(f"the solver failed at the fit of {label}: {reason}; its error is that of the emulator")
        for shot in self.shots:
            found += [f"{shot.name}: {line}" for line in shot.record.warnings]
        return tuple(found[:MOST_WARNINGS])


def rank_only(problem: Problem, none: Fit) -> Ranking:
    """A ranking that holds the fit without effects alone: for what could be detected."""
    models = {one.label: one for one in hypotheses(problem.found) if len(one.members) < 2}
    return Ranking(problem, models, {NONE: none}, {NONE: none.evidence}, {NONE: 1.0})


def _refitted(ranking: Ranking, chosen: str | None) -> Ranking:
    """The ranking with a fit of the chosen model."""
    if chosen is None or chosen in ranking.fits:
        return ranking
    model, evidence = ranking.models[chosen], ranking.evidence[chosen]
    one = model.members[0]
    start = Places(dict(ranking.fits[NONE].places.z), {one.label: float(np.clip(evidence.h[0], *one.limits))})
    return replace(ranking, fits={**ranking.fits, chosen: ranking.problem.refit(model, start, steps=2)})


def _named(runs: Mapping[str, SolverRun], shot: str) -> dict[str, SolverRun]:
    return {label.rsplit(" ", 1)[1]: run for label, run in runs.items() if label.rsplit(" ", 1)[0] == shot}


def _other(ranking: Ranking, label: str, heldout: Shot, first: Shot) -> Held:
    """A record that nothing was fitted to, predicted."""
    fit = ranking.fits[label]
    model = ranking.models[label]
    members = tuple(replace(one, shots=(*one.shots, heldout.name)) for one in model.members)
    curve = predicted(heldout, replace(model, members=members), fit.places.z[first.group], dict(fit.places.h))
    sd = error_sd(first, ranking.problem, fit)
    scale = np.interp(heldout.record.middle, first.record.middle[: len(sd)], sd[: len(first.record.middle)])
    same = len(sd) == len(heldout.record.values)
    return Held("shot", float(np.sqrt(np.mean(((heldout.record.values - curve) / (sd if same else scale)) ** 2))))


def _remainder(ranking: Ranking) -> dict[str, Any] | None:
    """What something else has of the probability."""
    share = ranking.shares.get(SOMETHING_ELSE, 0.0)
    if share < SETTLED:
        return None
    return {"probability": share, "sentence": f"something that the library does not hold has a probability of {share:.2f}"}


def _discrepancy(ranking: Ranking, chosen: str | None) -> dict[str, Any]:
    """Amplitudes by kind of sensor, and when on the curve tells nothing."""
    fit = ranking.fits[chosen or NONE]
    known = ranking.problem.known
    growth = {}
    for channel, shape in ranking.problem.shapes.items():
        late = np.flatnonzero(shape.growth > 3.0)
        time = ranking.problem.shots[0].setup.time
        growth[channel] = {"largest": float(shape.growth.max()), "uninformative_from": float(time[late[0]]) if len(late) else None}
    return {"source": known.source, "amplitude": dict(fit.evidence.amplitudes), "fixed": dict(known.fixed), "growth": growth}


def _side_by_side(held: Mapping[str, list[Held]], chosen: str | None) -> dict[str, dict[str, float | None]]:
    """Part held out -> whitened RMS before and after."""
    after = {one.name: one.error for one in held.get(chosen or "", [])}
    return {one.name: {"before": one.error, "after": after.get(one.name)} for one in held[NONE]}


def read_baselines(setup: Setup, measured: Sequence[Measured], shot: Shot, setups: Mapping[str, Setup]) -> Baselines:
    """The baselines that can serve, calibrated; each of the others gets a warning that says why it does not."""
    shots: list[Shot] = []
    fits: dict[str, tuple[Shot, Fit]] = {}
    warnings: list[str] = []
    for record in measured:
        name = Path(record.path).stem or f"baseline {len(shots) + 1}"
        own = setups.get(name, setup)
        if reason := _useless(record, own, shot):
            warnings.append(f"baseline {name} is left out: {reason}")
            continue
        try:
            one = read_shot(f"baseline {name}", own, record, f"baseline {name}", True)
        except UserError as error:
            warnings.append(f"baseline {name} is left out: {'; '.join(error.errors)}")
            continue
        fit = calibrated(one, unknown_or_stated(tuple(dict.fromkeys(one.kinds)), {}), mesh_shapes((one,)))
        shots.append(one)
        fits[name] = (one, fit)
        lacking = [channel for channel in shot.channels if channel not in one.channels]
        if lacking:
            warnings.append(f"baseline {name} has no {', '.join(lacking)}: there the discrepancy stays unknown")
        for kind, amplitude in fit.evidence.amplitudes.items():
            if amplitude > UNCLEAN and kind != "contact_force":
                warnings.append(
                    f"baseline {name} leaves {100 * amplitude:.0f} % of the peak ({kind}) to the model error: it may lack "
                    "an effect itself; what it shares with the shot cannot be found"
                )
    return Baselines(tuple(shots), fits, tuple(warnings))


def _useless(record: Measured, setup: Setup, shot: Shot) -> str:
    """Why a baseline cannot serve; empty where it can."""
    common = [channel for channel in shot.channels if channel in record.channels]
    if not common:
        return f"it has none of the shot's sensors ({', '.join(shot.channels)}); its own: {', '.join(record.channels)}"
    if float(record.time[-1]) < TRUNCATED * float(setup.time[-1]):
        return f"it ends at {1e3 * record.time[-1]:.3g} ms, the simulation at {1e3 * setup.time[-1]:.3g} ms; use a whole record"
    if setup.plan.case.plate != shot.setup.plan.case.plate:
        return "its case has another plate: a baseline must be of the same rig"
    return ""


__all__ = ["ATTRIBUTED", "Baselines", "Pipeline", "read_baselines"]
