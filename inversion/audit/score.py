"""The score of one experiment: the diagnosis of its record as it stands, and of many draws of its noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from birdstrike.inversion.diagnosis.choice import Choice
from birdstrike.inversion.diagnosis.heldout import time_block
from birdstrike.inversion.diagnosis.judge import Judge, Judged
from birdstrike.inversion.diagnosis.verdict import ATTRIBUTED, NONE

from birdstrike.data.curves import Measured, read_measured
from birdstrike.data.histories import Array
from birdstrike.inversion.audit.bench import Bench
from birdstrike.inversion.audit.carried import Models, confirmed_where_moved, of_part, of_record, struck, without_noise
from birdstrike.inversion.audit.coarse import FEW, coarse_models
from birdstrike.inversion.audit.coverage import covered
from birdstrike.inversion.audit.draws import Draws, Noises, answer
from birdstrike.inversion.audit.experiment import Experiment, Truth, read_truth
from birdstrike.inversion.audit.planted import CLEAN, SINGLE
from birdstrike.inversion.audit.power import Power, power, shown, signal
from birdstrike.inversion.audit.reading import read_draws
from birdstrike.inversion.diagnosis.diagnose import Study
from birdstrike.solver.case.case import load_case

TWIN = 0.9
STATED = "as stated"
COARSE = f"emulator of the first {FEW} runs"
KINDS = (
    Noises(name=STATED),
    Noises(level=1.2, name="noise 1.2 times the stated"),
    Noises(level=1.5, name="noise 1.5 times the stated"),
    Noises(rho=0.3, name="AR(1) noise, 0.3"),
    Noises(outliers=0.01, name="1 % outliers of 8 sigma"),
)


@dataclass(frozen=True)
class Asked:
    """Draws of the noise on each curve; read: of each kind as whole records; confirm: whether the solver is asked."""

    draws: int
    read: int
    confirm: bool


@dataclass(frozen=True)
class Blind:
    """The answer to the record as it stands; struck: models that the solver was asked about, in so many strikes."""

    verdict: str
    allowed: tuple[str, ...]
    struck: tuple[str, ...] = ()
    strikes: int = 0


@dataclass(frozen=True)
class Score:
    """One experiment: what was planted, the answer to the record itself, and the answers to draws of the noise.

    believed: by kind of noise, Sigma as stated; read: the same as the diagnosis reads whole records; unasked: share of
    the draws in whose confidence set an effect is that the solver was not asked about; signals: planted effect ->
    |P_0 g b|; shown: |P_0 r| of the noise-free record; lone: whether the effect has no twin; power: at several signals;
    covered: of the true model; error: before and after against the noise-free truth on a held-out block, where the
    verdict on the record is attributed.
    """

    name: str
    channels: tuple[str, ...]
    kind: str
    what: str
    planted: Mapping[str, float]
    blind: Blind
    believed: Mapping[str, Draws]
    read: Mapping[str, Draws] = field(default_factory=dict)
    unasked: float = 0.0
    signals: Mapping[str, float] = field(default_factory=dict)
    shown: float = 0.0
    lone: bool = False
    power: tuple[Power, ...] = ()
    covered: Mapping[str, Array] = field(default_factory=dict)
    error: tuple[float, float] | None = None

    @property
    def effect(self) -> str:
        """The first planted effect, or none."""
        return next(iter(self.planted), NONE)


def score(bench: Bench, experiment: Experiment, asked: Asked) -> Score:
    """One experiment; the truth is opened after the record has been answered."""
    measured = read_measured(experiment.record)
    study = bench.study(load_case(experiment.case), tuple(measured.channels))
    alpha, paid = study.choice.alpha, study.strikes.paid + study.strikes.reused
    judge, models = judgement(study, measured, asked.confirm)
    choice = Choice.of(models, alpha)
    blind = Blind(choice.verdict, choice.allowed, tuple(n for n, one in models.items() if struck(one)))
    trained = _trained(judge, models, alpha) if choice.verdict == ATTRIBUTED else None

    truth = read_truth(experiment.truth)
    clean = replace(judge, record=without_noise(judge.record, truth))
    fitted = of_record(clean, models, clean.record)
    if asked.confirm:
        fitted = confirmed_where_moved(clean, models, fitted, study.strikes)
    blind = replace(blind, strikes=study.strikes.paid + study.strikes.reused - paid)
    blunt, blunted = coarse_models(bench.coarse(study), clean, fitted)
    seed = study.choice.seed
    noise = {one.name: one.draw(clean.record.traces, asked.draws, seed) for one in KINDS}
    believed = {name: answer(clean, fitted, drawn, alpha) for name, drawn in noise.items()}
    believed[COARSE] = answer(blunt, blunted, noise[STATED], alpha)
    read = {one.name: read_draws(study, clean, fitted, measured, truth, one, asked.read, seed) for one in KINDS}
    read[COARSE] = read_draws(study, blunt, blunted, measured, truth, KINDS[0], asked.read, seed)
    return Score(
        experiment.name,
        tuple(measured.channels),
        truth.kind,
        truth.what,
        truth.effects,
        blind,
        believed,
        read,
        _unasked(fitted, believed[STATED]),
        error=None if trained is None else _against_truth(clean, *trained),
        **_of_truth(clean, fitted, believed[STATED], truth, alpha, asked.draws),
    )


def judgement(study: Study, measured: Measured, confirm: bool) -> tuple[Judge, dict[str, Judged]]:
    """As `diagnose` judges the record; without the solver if that is not to be asked."""
    record = study.read(measured)
    if confirm:
        return study.judgement(record)
    judge = Judge.of(study.ground, record, study.choice.seed)
    return judge, judge.models()


def _of_truth(clean: Judge, fitted: Models, draws: Draws, truth: Truth, alpha: float, count: int) -> dict:
    """Figures that need to know what was planted."""
    base = fitted[NONE]
    names = base.fit.problem.names
    sizes = {known.name: known.size for known in clean.groundwork.known}
    planted = {name: value / sizes[name] for name, value in truth.effects.items() if name in names}
    found: dict = {
        "signals": {name: signal(base.fit, name, b) for name, b in planted.items()},
        "shown": shown(base.fit),
    }
    if truth.kind == CLEAN:
        found["covered"] = covered(clean, base, draws, truth.parameters, 0.0)
    if truth.kind == SINGLE and len(planted) == 1:
        ((name, b),) = planted.items()
        found["lone"] = lone(base, name)
        found["power"] = tuple(power(clean, base, name, b, alpha, count, clean.seed))
        found["covered"] = covered(clean, fitted[name], draws, truth.parameters, b)
    return found


def lone(base: Judged, name: str) -> bool:
    """Whether no other effect is its twin."""
    cosines = np.abs(base.fit.linear.cosines()[base.fit.problem.index(name)])
    return bool(np.sort(cosines)[-2] < TWIN)


def _unasked(models: Models, draws: Draws) -> float:
    """Share of draws that reject none and allow a model that no strike has corrected."""
    learnt = {name for name, one in models.items() if not struck(one)}
    return float(np.mean([NONE not in one and bool(learnt & set(one)) for one in draws.sets]))


def _trained(judge: Judge, models: Models, alpha: float) -> tuple[Judged, Judged, np.ndarray]:
    """Models before and after, selected and fitted without a block in time, and the block; after may be before."""
    trained, held = time_block(judge, judge.groundwork.case.first_contact)
    part = judge.only(trained)
    found = of_part(part, models)
    return found[NONE], Choice.of(found, alpha).chosen or found[NONE], held


def _against_truth(clean: Judge, before: Judged, after: Judged, held: np.ndarray) -> tuple[float, float]:
    """RMS errors against the noise-free truth on the block, in units of the measurement noise."""
    sigma = np.sqrt(np.diag(clean.measurement))
    miss = [(clean.record.values - one.fit.curve) / sigma for one in (before, after)]
    first, second = (float(np.sqrt(np.mean(one[held] ** 2))) for one in miss)
    return first, second
