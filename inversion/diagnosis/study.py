"""The procedure of a diagnosis: judge every model of a record, choose, hold data out, ask the solver once more."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from birdstrike.data.curves import Measured
from birdstrike.inversion.diagnosis.assemble import (
    curves,
    detectable,
    effect_figures,
    noise_figures,
    nuisance_figures,
    pair_figures,
    state,
    strike_figures,
)
from birdstrike.inversion.diagnosis.choice import Choice, effect_order, level
from birdstrike.inversion.diagnosis.diagnosis import Diagnosis
from birdstrike.inversion.diagnosis.doubts import changed_minds, doubts, strayed, unheard
from birdstrike.inversion.diagnosis.finer import unrefined
from birdstrike.inversion.diagnosis.groundwork import Groundwork
from birdstrike.inversion.diagnosis.heldout import (
    SHOT,
    TIME_BLOCK,
    HeldOut,
    channels,
    hold_out,
    in_short,
    other_shot,
    time_block,
)
from birdstrike.inversion.diagnosis.judge import Judge, Judged, near
from birdstrike.inversion.diagnosis.record import Record, read_record
from birdstrike.inversion.diagnosis.remainder import Remainder, pairs, remainder
from birdstrike.inversion.diagnosis.restrike import case_at, restrike
from birdstrike.inversion.diagnosis.separate import Proposal, propose
from birdstrike.inversion.diagnosis.strikes import Strikes
from birdstrike.inversion.diagnosis.tolerances import TOLERANCES, tolerance_figures
from birdstrike.inversion.diagnosis.verdict import AMBIGUOUS, NONE, UNEXPLAINED
from birdstrike.inversion.diagnosis.wishes import Wishes
from birdstrike.inversion.diagnosis.words import sentence
from birdstrike.inversion.observations.reader import Expected

LATEST_SHIFT = 3.0  # plausible sizes of the time offset that the record's end leaves free
FEWEST_HELD, FEWEST_TRAINED = 5, 10  # points


@dataclass(frozen=True)
class Study:
    """A case made ready, and what is asked of it."""

    ground: Groundwork
    strikes: Strikes
    choice: Wishes

    def read(self, measured: Measured, tolerance: float | None = None) -> Record:
        """The record in the model's window, its channels in the model's order."""
        case = self.ground.case
        own = {name: measured.channels[name] for name in self.ground.clock.channels}
        spare = LATEST_SHIFT * next((k.size for k in self.ground.known if k.name == "time_offset"), 0.0)
        expected = Expected.of_case(case, float(self.ground.clock.time[-1]), spare)
        return read_record(replace(measured, channels=own), expected, tolerance)

    def judgement(self, record: Record) -> tuple[Judge, dict[str, Judged]]:
        """Every model judged, those that matter confirmed by the solver."""
        judge = Judge.of(self.ground, record, self.choice.seed)
        with self.choice.display("Refit under every effect") as progress:
            models = judge.models(progress)
        models |= judge.confirm([models[NONE]], self.strikes)
        if models[NONE].p < self.choice.alpha:
            models |= judge.confirm(near(models), self.strikes)
        return judge, level(models)

    def diagnosis(self, measured: Measured, shot: Measured | None) -> Diagnosis:
        """The whole procedure for one record."""
        record = self.read(measured, TOLERANCES[0])
        judge, models = self.judgement(record)
        alpha = self.choice.alpha
        choice = Choice.of(models, alpha)
        chosen = choice.chosen
        held = self._held_out(judge, models[NONE], chosen, shot)
        proposal, two, rest = self._what_next(judge, models, choice)
        tolerances = self._tolerances(measured, record, judge, models)
        fits = {"before": models[NONE]} | ({"after": chosen} if chosen else {})
        struck, failed = restrike(judge, fits, self.strikes)
        held_before, held_after = in_short(held)
        before = state(judge, models[NONE], held_before, struck.get("before"))
        after = state(judge, chosen, held_after, struck.get("after")) if chosen else None
        figures = effect_figures(judge, models, choice.allowed)
        by_name = {one.name: one for one in figures}
        warnings = self._warnings(judge, models, chosen, choice.verdict, held)
        return Diagnosis(
            alpha=alpha,
            verdict=choice.verdict,
            confidence_set=choice.allowed,
            effects=figures,
            before=before,
            after=after,
            minimum_detectable=detectable(models, alpha),
            next_measurement=proposal,
            pairs=tuple(pair_figures(judge, one) for one in two),
            remainder=rest,
            noise=noise_figures(judge),
            nuisance=nuisance_figures(judge, chosen or models[NONE]),
            case_after=None,
            strikes=self._strikes(judge, models),
            warnings=(*warnings, *strayed(struck, failed)),
            held_out=held,
            tolerances=tolerances,
            refused=dict(self.ground.refused),
            record={"path": measured.path, "simulated": measured.simulated, "channels": list(measured.channels)},
            sentence=sentence(choice.verdict, choice.allowed, by_name, before, after, alpha, choice.unnamed),
            unnamed=choice.unnamed,
            curves=curves(judge, {"before": models[NONE], "after": chosen}, struck),
            case=case_at(self.ground.case, chosen.fit) if chosen and "after" in struck else None,
        )

    def _held_out(self, judge: Judge, base: Judged, chosen: Judged | None, shot: Measured | None) -> dict[str, HeldOut]:
        """A block in time, each channel in turn, another shot."""
        found: dict[str, HeldOut] = {}
        parts = {TIME_BLOCK: time_block(judge, self.ground.case.first_contact), **channels(judge)}
        for name, (trained, held) in parts.items():
            if held.sum() >= FEWEST_HELD and trained.sum() >= FEWEST_TRAINED:
                with self.choice.display(f"Selection and refit without the {name.replace('_', ' ')}") as progress:
                    found[name] = hold_out(judge, trained, held, self.choice.alpha, progress)
        if shot is not None:
            found[SHOT] = other_shot(judge, base, chosen, self.read(shot, TOLERANCES[0]))
        return found

    def _what_next(
        self, judge: Judge, models: dict[str, Judged], choice: Choice
    ) -> tuple[Proposal | None, list[Judged], Remainder | None]:
        """The separating measurement of rivals, or pairs and the remainder of what nothing explains."""
        if choice.verdict == AMBIGUOUS and len(choice.allowed) > 1:
            members = sorted(choice.allowed, key=effect_order(models).index)
            return propose(judge, [models[name] for name in members], self.strikes, self.choice.alpha), [], None
        if choice.verdict != UNEXPLAINED:
            return None, [], None
        with self.choice.display("Pairs of effects") as progress:
            two = pairs(judge, models, self.choice.alpha, progress)
        best = min(models.values(), key=lambda one: one.fit.cost)
        return None, two, None if two else remainder(judge, best)

    def _strikes(self, judge: Judge, models: dict[str, Judged]) -> dict[str, Any]:
        return strike_figures(judge, models, self.strikes)

    def _warnings(
        self, judge: Judge, models: dict[str, Judged], chosen: Judged | None, kind: str, held: dict[str, HeldOut]
    ) -> tuple[str, ...]:
        found = [*judge.record.warnings, *doubts(judge, chosen or models[NONE], models[NONE])]
        found += [f"model {n}: not confirmed by the solver: {one.doubt}" for n, one in models.items() if one.doubt]
        found += [*changed_minds(held, kind, chosen), *unheard(models[NONE])]
        found += unrefined(self.ground.case, self.ground.numerical.sizes)
        if not judge.record.noise_known:
            found.append("no noise is known: the verdict rests on a stated tolerance; see how it changes with that")
        return tuple(found)

    def _tolerances(
        self, measured: Measured, record: Record, judge: Judge, models: dict[str, Judged]
    ) -> tuple[dict[str, Any], ...]:
        """Where no noise is known: verdict, magnitudes and errors at each tolerance; the first is judged already."""
        if record.noise_known:
            return ()
        found: list[dict[str, Any]] = []
        for tolerance in sorted(TOLERANCES):
            known = tolerance == TOLERANCES[0]
            one, its = (judge, models) if known else self.judgement(self.read(measured, tolerance))
            found.append(tolerance_figures(tolerance, one, its, self.choice.alpha))
        return tuple(found)
