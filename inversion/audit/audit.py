"""`birdstrike audit`: the diagnosis on planted experiments, scored against their sealed truths."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from data.curves import Measured, read_measured
from data.errors import UserError
from doe.campaign import run_campaign
from doe.designs import make_design
from doe.space import ParameterSpace
from doe.worker import process_pool
from inversion.audit.experiment import Experiment, Truth, experiments, read_truth
from inversion.audit.planted import CLEAN, SINGLE
from inversion.audit.score import DRAWS, Draws, Noises, answer, at_signal, covered, signal
from inversion.diagnosis.diagnose import Study, Wishes, quiet, uncounted
from inversion.diagnosis.groundwork import Groundwork, prepare
from inversion.diagnosis.heldout import time_block
from inversion.diagnosis.judge import Judge, Judged, near
from inversion.diagnosis.strikes import Strikes
from inversion.diagnosis.verdict import NONE, confidence_set, verdict
from solver.case import Case, case_hash, load_case

SIGNALS = (2.0, 3.0, 4.0, 5.0, 6.0)
TWIN = 0.9
FEWEST_DRAWS = 20
ROBUST = (
    Noises(name="as stated"),
    Noises(level=1.2, name="noise 1.2 times the stated"),
    Noises(level=1.5, name="noise 1.5 times the stated"),
    Noises(rho=0.3, name="AR(1) noise, 0.3"),
    Noises(outliers=0.01, name="1 % outliers of 8 sigma"),
)


@dataclass(frozen=True)
class Score:
    """One experiment: truth, the answer to the record itself, and the answers to draws of the noise.

    blind: verdict and confidence set of the record as it stands; draws: by kind of noise; signals: planted effect ->
    |P_0 g b|; power: signal -> (draws,) rejected; covered: of the true model; error: before and after against the
    noise-free truth on a held-out block, where the blind verdict on the training part is attributed.
    """

    name: str
    channels: tuple[str, ...]
    truth: Truth
    blind: tuple[str, tuple[str, ...]]
    draws: dict[str, Draws]
    signals: dict[str, float]
    lone: bool
    power: dict[float, Any]
    covered: dict[str, Any]
    error: tuple[float, float] | None
    confirmed: tuple[str, tuple[str, ...]] | None = field(default=None)


@dataclass
class Bench:
    """Cases made ready, shared by experiments of the same case and channels; a context for its strikes."""

    out: Path
    wishes: Wishes
    grounds: dict[tuple[str, tuple[str, ...]], tuple[Groundwork, Strikes]] = field(default_factory=dict)
    stack: ExitStack = field(default_factory=ExitStack)

    def study(self, case: Case, channels: tuple[str, ...]) -> Study:
        """The study of a case with these channels, its campaign and strikes run or found."""
        key = (case_hash(case), channels)
        if key not in self.grounds:
            folder = self.out / key[0]
            design = make_design("uniform", ParameterSpace.of(case.parameters()), self.wishes.runs, self.wishes.seed)
            with self.wishes.counter() as shown:
                workers = self.wishes.workers
                dataset = run_campaign(
                    case, design, folder / "doe", workers=workers, progress=shown, say=lambda _: None
                )
            shown_runs = self.stack.enter_context(self.wishes.counter())
            strikes = Strikes(folder / "runs", (folder / "doe" / "runs",), self.wishes.workers, shown_runs)
            self.stack.enter_context(strikes)
            self.grounds[key] = (prepare(case, dataset, channels, strikes, lambda _: None), strikes)
        ground, strikes = self.grounds[key]
        return Study(ground, strikes, self.wishes)


def audit(
    folder: str | Path,
    out: str | Path,
    *,
    wishes: Wishes | None = None,
    draws: int = DRAWS,
    confirm: bool = False,
    channels: int | None = None,
    progress: Callable[[float], None] = lambda _: None,
    say: Callable[[str], None] = warnings.warn,
) -> dict[str, Any]:
    """Score every experiment of `folder` and write `out/audit.json`; returns its content.

    confirm: let the solver confirm the models in or near the confidence set of each record, as `diagnose` does (some
    twenty strikes an experiment); the draws are answered by emulator and learnt responses either way. channels: only
    records of so many. A script that calls this needs `if __name__ == "__main__":`. Raises UserError.
    """
    from inversion.audit.table import write_audit

    choice, place = wishes or Wishes(), Path(out)
    if draws < FEWEST_DRAWS:
        raise UserError(f"--draws = {draws} is below {FEWEST_DRAWS}: rates would be coarse; 200 is the gate's")
    found = [one for one in experiments(Path(folder)) if channels in (None, len(read_measured(one.record).channels))]
    if not found:
        raise UserError(f"no experiment in {folder} has {channels} channels")
    place.mkdir(parents=True, exist_ok=True)
    _ready(place, choice, found)
    scores: list[Score] = []
    for score in _scores(place, choice, found, draws, confirm):
        scores.append(score)
        say(f"{score.name}: {score.blind[0]} ({', '.join(score.blind[1][:4])})")
        progress(len(scores) / len(found))
    return write_audit(place, scores, choice.alpha, draws, confirm)


def _ready(place: Path, choice: Wishes, found: list[Experiment]) -> None:
    """Run campaigns and shared strikes before experiments are scored side by side."""
    cases = {}
    for one in found:
        case, channels = load_case(one.case), tuple(read_measured(one.record).channels)
        cases.setdefault(case_hash(case), (case, channels))
    bench = Bench(place, choice)
    with bench.stack:
        for case, channels in cases.values():
            bench.study(case, channels)


def _scores(place: Path, choice: Wishes, found: list[Experiment], draws: int, confirm: bool) -> Iterator[Score]:
    """Scores in the order of the experiments, several at a time; those of one case and its channels stay together."""
    plain = replace(choice, display=quiet, counter=uncounted, say=warnings.warn, workers=1)
    workers = min(choice.workers or os.cpu_count() or 1, len(found))
    with process_pool(workers) as pool:
        yield from pool.map(partial(_score, place, plain, draws, confirm), found)


_bench: Bench | None = None


def _score(place: Path, wishes: Wishes, draws: int, confirm: bool, experiment: Experiment) -> Score:
    """One experiment in a worker, which keeps its bench for the next."""
    global _bench
    if _bench is None:
        _bench = Bench(place, wishes)
    return score(_bench, experiment, draws, confirm)


def score(bench: Bench, experiment: Experiment, draws: int, confirm: bool) -> Score:
    """One experiment; the truth is opened after the record has been answered."""
    case, measured = load_case(experiment.case), read_measured(experiment.record)
    study = bench.study(case, tuple(measured.channels))
    alpha = study.choice.alpha
    judge = Judge.of(study.ground, study.read(measured), study.choice.seed)
    models = judge.models()
    blind = _answer(models, alpha)
    confirmed = _answer(_confirmed(study, judge, models), alpha) if confirm else None
    held = _held_error(judge, alpha)
    truth = read_truth(experiment.truth)
    clean = Judge.of(study.ground, study.read(_noise_free(measured, truth, case)), study.choice.seed)
    clean = replace(
        clean, record=replace(clean.record, traces=_with_noise(clean, judge)), measurement=judge.measurement
    )
    fitted = clean.models()
    answers = {kind.name: answer(fitted, kind.draw(clean, draws, study.choice.seed), alpha) for kind in ROBUST}
    base = fitted[NONE]
    planted = {n: b / _size(study.ground, n) for n, b in truth.effects.items() if n in base.fit.problem.names}
    signals = {n: signal(clean, base, n, b) for n, b in planted.items()}
    single = truth.kind == SINGLE and len(planted) == 1
    name = next(iter(planted), NONE)
    model = fitted[name if single else NONE]
    power = {}
    if single:
        at = {s: at_signal(clean, base, name, planted[name], s, alpha, study.choice.seed) for s in SIGNALS}
        power = {s: found for s, found in at.items() if found is not None}
    held_truth = covered(clean, model, answers["as stated"], truth.parameters, planted.get(name, 0.0))
    return Score(
        experiment.name,
        tuple(measured.channels),
        truth,
        blind,
        answers,
        signals,
        single and _lone(base, name),
        power,
        held_truth if single or truth.kind == CLEAN else {},
        None if held is None else _against_truth(clean, *held),
        confirmed,
    )


def _answer(models: dict[str, Judged], alpha: float) -> tuple[str, tuple[str, ...]]:
    inferred = models[NONE].reference.relative
    allowed = confidence_set({name: one.p for name, one in models.items()}, alpha)
    return verdict(allowed, inferred), allowed


def _confirmed(study: Study, judge: Judge, models: dict[str, Judged]) -> dict[str, Judged]:
    """As `diagnose` asks the solver."""
    found = {**models, **judge.confirm([models[NONE]], study.strikes)}
    return found | judge.confirm(near(found), study.strikes) if found[NONE].p < study.choice.alpha else found


def _held_error(judge: Judge, alpha: float) -> tuple[Judged, Judged, np.ndarray] | None:
    """Models before and after, selected and fitted without a block in time, where that attributes the miss."""
    trained, held = time_block(judge, judge.groundwork.case.first_contact)
    models = judge.only(trained).models()
    kind, allowed = _answer(models, alpha)
    return (models[NONE], models[allowed[0]], held) if kind == "attributed" else None


def _against_truth(clean: Judge, before: Judged, after: Judged, held: np.ndarray) -> tuple[float, float]:
    """RMS errors against the noise-free truth on the block, in units of the measurement noise."""
    sigma = np.sqrt(np.diag(clean.measurement))
    miss = [(clean.record.values - one.fit.curve) / sigma for one in (before, after)]
    first, second = (float(np.sqrt(np.mean(one[held] ** 2))) for one in miss)
    return first, second


def _noise_free(measured: Measured, truth: Truth, case: Case) -> Measured:
    """The record without its noise; the same points."""
    values = {name: np.interp(measured.time, truth.time, truth.channels[name]) for name in measured.channels}
    sigma = {n: np.full(len(measured.time), case.sensors[n].noise or 0.0) for n in values if case.sensors[n].noise}
    return replace(measured, channels=values, sigma=sigma)


def _with_noise(clean: Judge, judge: Judge):
    """The noise-free traces with the noise that the diagnosis found in the record."""
    pairs = zip(clean.record.traces, judge.record.traces, strict=True)
    return tuple(replace(a, noise=b.noise) if len(a.times) == len(b.times) else a for a, b in pairs)


def _size(ground: Groundwork, name: str) -> float:
    return next(known.size for known in ground.known if known.name == name)


def _lone(base: Judged, name: str) -> bool:
    """Whether no other effect is its twin."""
    cosines = np.abs(base.fit.linear.cosines()[base.fit.problem.index(name)])
    return bool(np.sort(cosines)[-2] < TWIN)
