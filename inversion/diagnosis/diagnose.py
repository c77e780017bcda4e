"""`birdstrike diagnose`: from a case and a record to a verdict, an effect's name, the error before and after."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from data.curves import Measured, read_measured
from data.dataset import Dataset
from data.errors import MeasuredError, UserError
from data.paths import resolve_measured
from doe.campaign import load_dataset, run_campaign
from doe.case_copy import case_toml
from doe.designs import make_design
from doe.runner import Progress as Counts
from doe.space import ParameterSpace
from inversion.diagnosis.assemble import detectable, doubts, effect_figures, noise_figures, nuisance_figures, state
from inversion.diagnosis.diagnosis import Diagnosis
from inversion.diagnosis.groundwork import Groundwork, prepare
from inversion.diagnosis.heldout import HeldOut, channel, hold_out, other_shot, time_block
from inversion.diagnosis.judge import Judge, Judged, near
from inversion.diagnosis.record import Record, Window, read_record
from inversion.diagnosis.refinable import unrefined
from inversion.diagnosis.remainder import Remainder, pairs, remainder
from inversion.diagnosis.separate import Proposal, propose
from inversion.diagnosis.strikes import Strikes
from inversion.diagnosis.verdict import (
    ALPHA,
    AMBIGUOUS,
    ATTRIBUTED,
    NO_RESIDUAL,
    NONE,
    UNEXPLAINED,
    confidence_set,
    verdict,
)
from inversion.diagnosis.words import sentence
from inversion.train_and_invert import campaign_case
from solver.case import Case, load_case

RUNS = 25
TOLERANCES = (0.01, 0.005, 0.03)  # of the peak, where no noise is known; the first gives the verdict
LATEST_SHIFT = 3.0  # plausible sizes of the time offset that the record's end leaves free
Display = Callable[[str], AbstractContextManager[Callable[[float], None]]]
Counter = Callable[[], AbstractContextManager[Callable[[Counts], None]]]


def quiet(_: str) -> AbstractContextManager[Callable[[float], None]]:
    """No display."""
    return nullcontext(lambda _: None)


def uncounted() -> AbstractContextManager[Callable[[Counts], None]]:
    """No bar of strikes."""
    return nullcontext(lambda _: None)


@dataclass(frozen=True)
class Wishes:
    """How to diagnose. alpha: rate of false alarms; design of the campaign where none is given."""

    alpha: float = ALPHA
    seed: int = 0
    workers: int | None = None
    runs: int = RUNS
    display: Display = quiet
    counter: Counter = uncounted
    say: Callable[[str], None] = warnings.warn


def diagnose(
    case: str | Path | Case,
    measured: str | Path | Measured,
    out: str | Path,
    doe: str | Path | None = None,
    heldout: str | Path | Measured | None = None,
    wishes: Wishes | None = None,
) -> Diagnosis:
    """Diagnose the record and write `diagnosis.json`, the curves and, where an effect is named, the case with it.

    doe: folder of a finished campaign of the case (else one is run in `out/doe`); heldout: another shot of the same
    case, which nothing is fitted to. Raises UserError and RunFailed; every strike that was paid stays in `out/runs`.
    """
    choice, folder = wishes or Wishes(), Path(out)
    if not 0.0 < choice.alpha < 0.5:
        raise UserError(f"--alpha = {choice.alpha} is outside 0 .. 0.5; 0.05 is usual")
    loaded = load_case(case) if isinstance(case, str | Path) else case
    record = _read(measured)
    shot = None if heldout is None else _read(heldout)
    _refuse_unknown(loaded, record, shot)
    folder.mkdir(parents=True, exist_ok=True)
    dataset, campaign = _campaign(loaded, folder, doe, choice)
    with choice.counter() as shown, Strikes(folder / "runs", (campaign / "runs",), choice.workers, shown) as strikes:
        with choice.display("Emulator, and strikes for every effect and numerical choice") as progress:
            ground = prepare(loaded, dataset, tuple(record.channels), strikes, progress)
        found = Study(ground, strikes, choice).diagnosis(record, shot)
    return write(found, ground, folder)


def _read(measured: str | Path | Measured) -> Measured:
    return measured if isinstance(measured, Measured) else read_measured(resolve_measured(measured))


def _refuse_unknown(case: Case, record: Measured, shot: Measured | None) -> None:
    """Raise MeasuredError for channels that the case or the other shot lacks, before any strike is paid for."""
    known = ", ".join(case.sensors)
    unknown = [name for name in record.channels if name not in case.sensors]
    errors = [f'{record.path}: channel "{n}" is no sensor of case {case.name}; its sensors: {known}' for n in unknown]
    missing = [name for name in record.channels if shot is not None and name not in shot.channels]
    errors += [
        f'{shot.path if shot else ""}: channel "{n}" is missing; the two records must have the same' for n in missing
    ]
    if errors:
        raise MeasuredError(errors)


def _campaign(case: Case, folder: Path, doe: str | Path | None, choice: Wishes) -> tuple[Dataset, Path]:
    """The campaign given, or one's own."""
    if doe is not None:
        dataset = load_dataset(Path(doe))
        campaign_case(Path(doe), dataset, case)
        return dataset, Path(doe)
    design = make_design("uniform", ParameterSpace.of(case.parameters()), choice.runs, choice.seed)
    with choice.counter() as shown:
        dataset = run_campaign(case, design, folder / "doe", workers=choice.workers, progress=shown, say=lambda _: None)
    return dataset, folder / "doe"


@dataclass(frozen=True)
class Study:
    """A case made ready, and what is asked of it."""

    ground: Groundwork
    strikes: Strikes
    choice: Wishes

    def read(self, measured: Measured, tolerance: float | None = None) -> Record:
        """The record in the model's window."""
        case = self.ground.case
        units = {name: sensor.unit for name, sensor in case.sensors.items()}
        stated = {name: sensor.noise for name, sensor in case.sensors.items() if sensor.noise}
        spare = LATEST_SHIFT * next((k.size for k in self.ground.known if k.name == "time_offset"), 0.0)
        uncertain = spare + 4.0 * case.inversion.nuisance.get("time_offset", 0.0)
        window = Window(0.0, float(self.ground.clock.time[-1]) - spare, case.first_contact - uncertain)
        return read_record(measured, units, window, stated, tolerance)

    def judgement(self, record: Record) -> tuple[Judge, dict[str, Judged]]:
        """Every model judged, those that matter confirmed by the solver."""
        judge = Judge.of(self.ground, record, self.choice.seed)
        with self.choice.display("Refit under every effect") as progress:
            models = judge.models(progress)
        models |= judge.confirm([models[NONE]], self.strikes)
        if models[NONE].p < self.choice.alpha:
            models |= judge.confirm(near(models), self.strikes)
        return judge, models

    def diagnosis(self, measured: Measured, shot: Measured | None) -> Diagnosis:
        """The whole procedure for one record."""
        record = self.read(measured, TOLERANCES[0])
        judge, models = self.judgement(record)
        alpha = self.choice.alpha
        allowed = confidence_set({name: one.p for name, one in models.items()}, alpha)
        kind = verdict(allowed, record.noise_inferred)
        chosen = self._chosen(models, allowed)
        held = self._held_out(judge, models, chosen, shot)
        figures = effect_figures(judge, models)
        before = state(judge, models[NONE], {n: one.before for n, one in held.items()} | _absent(held))
        after = state(judge, chosen, {n: one.after for n, one in held.items()} | _absent(held)) if chosen else None
        proposal, two, rest = self._what_next(judge, models, allowed, kind)
        by_name = {one.name: one for one in figures}
        return Diagnosis(
            alpha=alpha,
            verdict=kind,
            confidence_set=allowed,
            effects=figures,
            before=before,
            after=after,
            minimum_detectable=detectable(models, alpha),
            next_measurement=proposal,
            pairs=tuple(_pair(judge, one) for one in two),
            remainder=rest,
            noise=noise_figures(judge),
            nuisance=nuisance_figures(judge, chosen or models[NONE]),
            case_after=None,
            strikes=self._strikes(judge, models),
            warnings=self._warnings(judge, models, chosen, kind, held),
            held_out=held,
            tolerances=self._tolerances(measured, record),
            refused=dict(self.ground.refused),
            record={"path": measured.path, "simulated": measured.simulated, "channels": list(measured.channels)},
            sentence=sentence(kind, allowed, by_name, before, after, alpha),
            curves=_curves(judge, models, chosen),
        )

    def _chosen(self, models: dict[str, Judged], allowed: tuple[str, ...]) -> Judged | None:
        """The model after: the only one allowed, or the likeliest of several, None where none is needed or allowed."""
        if NONE in allowed or not allowed:
            return None
        ranked = effect_order(models)
        return models[min(allowed, key=ranked.index)]

    def _held_out(
        self, judge: Judge, models: dict[str, Judged], chosen: Judged | None, shot: Measured | None
    ) -> dict[str, HeldOut]:
        """A block in time, each channel in turn (the last word is the worst), another shot."""
        found: dict[str, HeldOut] = {}
        with self.choice.display("Selection and refit without a block in time") as progress:
            trained, held = time_block(judge, self.ground.case.first_contact)
            if held.sum() >= 5 and trained.sum() >= 10:
                found["time_block"] = hold_out(judge, trained, held, self.choice.alpha, progress)
        if len(judge.record.traces) > 1:
            with self.choice.display("Selection and refit without the last channel") as progress:
                trained, held = channel(judge, len(judge.record.traces) - 1)
                found["channel"] = hold_out(judge, trained, held, self.choice.alpha, progress)
        if shot is not None:
            other = self.read(shot, TOLERANCES[0])
            before, raw = other_shot(judge, models[NONE], other)
            after = other_shot(judge, chosen, other) if chosen else (None, None)
            name = chosen.name if chosen else None
            found["shot"] = HeldOut(before, after[0], raw, after[1], name, "not repeated")
        return found

    def _what_next(
        self, judge: Judge, models: dict[str, Judged], allowed: tuple[str, ...], kind: str
    ) -> tuple[Proposal | None, list[Judged], Remainder | None]:
        """The separating measurement of rivals, or pairs and the remainder of what nothing explains."""
        if kind == AMBIGUOUS and allowed:
            ranked = effect_order(models)
            members = [models[name] for name in sorted(allowed, key=ranked.index)]
            return propose(judge, members, self.strikes), [], None
        if kind != UNEXPLAINED:
            return None, [], None
        with self.choice.display("Pairs of effects") as progress:
            two = pairs(judge, models, self.choice.alpha, progress)
        best = min(models.values(), key=lambda one: one.fit.cost)
        return None, two, None if two else remainder(judge, best)

    def _strikes(self, judge: Judge, models: dict[str, Judged]) -> dict[str, Any]:
        """Strikes paid and reused, and the emulator's error where the solver was asked."""
        paid, reused = self.strikes.paid, self.strikes.reused
        campaign = len(self.ground.dataset.runs)
        off = {}
        for name, one in models.items():
            correction = one.fit.problem.model.correction
            if np.ndim(correction):
                size = np.split(np.asarray(correction), len(judge.record.traces))
                off[name] = {
                    t.name: float(np.sqrt(np.mean(part**2))) for t, part in zip(judge.record.traces, size, strict=True)
                }
        return {
            "campaign": campaign,
            "paid": paid,
            "reused": reused,
            "emulator_error": off,
            "failed": dict(self.strikes.failures),
        }

    def _warnings(
        self, judge: Judge, models: dict[str, Judged], chosen: Judged | None, kind: str, held: dict[str, HeldOut]
    ) -> tuple[str, ...]:
        found = list(judge.record.warnings)
        found += doubts(judge, chosen or models[NONE], models[NONE])
        found += [
            f"model {name}: not confirmed by the solver: {one.doubt}" for name, one in models.items() if one.doubt
        ]
        for name, one in held.items():
            if one.verdict not in ("not repeated", kind) or (
                kind == ATTRIBUTED and one.chosen not in (None, chosen.name if chosen else None)
            ):
                what = f"{one.verdict}{f' ({one.chosen})' if one.chosen else ''}"
                found.append(f"without the held-out {name.replace('_', ' ')} the verdict is {what}")
        unheard = [
            k.name
            for k in self.ground.known
            if not np.any(models[NONE].fit.linear.effects[:, models[NONE].fit.problem.index(k.name)])
        ]
        if unheard:
            found.append(f"at a plausible size these change nothing in this strike: {', '.join(unheard)}")
        found += unrefined(self.ground.case, self.ground.numerical.directions)
        if not judge.record.noise_known:
            found.append("no noise is known: the verdict rests on a stated tolerance; see how it changes with that")
        return tuple(found)

    def _tolerances(self, measured: Measured, record: Record) -> tuple[dict[str, Any], ...]:
        """Where no noise is known: the verdict at each tolerance."""
        if record.noise_known:
            return ()
        found = []
        for tolerance in sorted(TOLERANCES):
            _, models = self.judgement(self.read(measured, tolerance))
            allowed = confidence_set({name: one.p for name, one in models.items()}, self.choice.alpha)
            found.append({"tolerance": tolerance, "verdict": verdict(allowed), "confidence_set": list(allowed)})
        return tuple(found)


def effect_order(models: dict[str, Judged]) -> list[str]:
    """Names by evidence, the likeliest first."""
    from inversion.diagnosis.evidence import log_evidence

    return sorted(models, key=lambda name: -log_evidence(models[name].fit))


def _absent(held: dict[str, HeldOut]) -> dict[str, float | None]:
    return {name: None for name in ("time_block", "channel", "shot") if name not in held}


def _pair(judge: Judge, judged: Judged) -> dict[str, Any]:
    known = judged.fit.problem.model.known
    values = [known[i].magnitude(float(b)) for i, b in zip(judged.fit.own, judged.fit.magnitudes, strict=True)]
    names = [known[i].name for i in judged.fit.own]
    return {
        "effects": names,
        "magnitudes": values,
        "p_consistent": judged.p,
        "weighted": state(judge, judged, {}).weighted,
    }


def _curves(judge: Judge, models: dict[str, Judged], chosen: Judged | None) -> dict[str, Any]:
    """Record and fitted curves on the record's points, per channel."""
    record, found = judge.record, {}
    whole = np.sqrt(np.diag(judge.measurement + judge.numerical))
    for i, trace in enumerate(record.traces):
        here = record.channel == i
        found[trace.name] = {
            "unit": trace.unit,
            "time": record.middle[here],
            "measured": record.values[here],
            "sigma": np.sqrt(np.diag(judge.measurement))[here],
            "error": whole[here],
            "before": models[NONE].fit.curve[here],
            "after": chosen.fit.curve[here] if chosen else None,
        }
    return found


def write(found: Diagnosis, ground: Groundwork, folder: Path) -> Diagnosis:
    """The files of a diagnosis, diagnosis.json last."""
    from data.files import write_atomically
    from inversion.diagnosis.curves_file import write_curves

    if found.verdict == ATTRIBUTED:
        text = diagnosed_case(found, ground)
        path = folder / f"{ground.case.name}_with_{found.confidence_set[0]}.toml"
        write_atomically(path, text)
        found = replace(found, case_after=path.name)
    write_curves(folder / "diagnosis.csv", found)
    found.save(folder / "diagnosis.json")
    return found


def diagnosed_case(found: Diagnosis, ground: Groundwork) -> str:
    """TOML of the case with the effect and the parameters refitted beside it."""
    named = found.named(found.confidence_set[0])
    assert named.magnitude is not None
    assert found.after is not None
    values = {name: float(entry["value"]) for name, entry in found.after.parameters.items()}
    case = ground.case.with_values(values).with_effects({**ground.case.effects, named.name: named.magnitude})
    return f"# {found.sentence}\n{case_toml(case)}"


__all__ = ["NO_RESIDUAL", "Study", "Wishes", "diagnose"]
