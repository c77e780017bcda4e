"""The audit's tables: acceptance criteria with their figures and intervals, reliability, answers, every record.

Records of one truth share it, so that truths are what is counted. A bootstrap over a handful of truths is too narrow,
and has no width at all where they agree; Clopper and Pearson's interval (Biometrika 26 (1934) 404) of the nearest whole
number of successes in as many truths is exact for yes and no, and wide. A criterion on an interval takes the wider.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import beta, binomtest, norm
from scipy.stats import t as student_t

from birdstrike.data.formatting import many
from birdstrike.data.histories import Array
from birdstrike.inversion.audit.draws import CLEAN, OUTSIDE, OWN, PAIR, SINGLE
from birdstrike.inversion.audit.records import ANOTHER_BIRD, BASELINES, NO_BASELINE, OWN_BIRD
from birdstrike.inversion.audit.score import Score
from birdstrike.inversion.diagnosis.inference.hypotheses import PRIOR_ELSE, PRIOR_NONE, PRIOR_PAIRS

RESAMPLES = 4000
SEED = 0  # of the bootstraps: the same scores give the same intervals
ORDER = (CLEAN, SINGLE, PAIR, OUTSIDE)
WANTED = 100  # truths a table needs
NEAR = 1.25  # a record counts at a signal within this factor of it
WIDEST = 0.03  # half the interval of the rate of false alarms
RANKS = {(False, False): (0.55, 0.80, 0.70), (True, False): (0.85, 0.97, 0.92), (True, True): (0.95, 0.99, 0.98)}
"""(several channels, several shots) -> first place, first three, first family; others are shown without a criterion."""
OF_BASELINE = {
    NO_BASELINE: "without a baseline",
    ANOTHER_BIRD: "with a baseline of another bird",
    OWN_BIRD: "with a baseline of its own bird",
}
PRIOR = {CLEAN: PRIOR_NONE, PAIR: PRIOR_PAIRS, OUTSIDE: PRIOR_ELSE}


@dataclass(frozen=True)
class Rate:
    """A figure over truths: value, 95 % intervals, over how many truths and records.

    interval_95: of a bootstrap over truths; exact_95: Clopper and Pearson's, None for a figure that is no rate.
    """

    value: float | None
    interval_95: tuple[float, float] | None
    exact_95: tuple[float, float] | None
    curves: int
    draws: int

    @property
    def wider(self) -> tuple[float, float]:
        """The wider interval; everything where there is none."""
        known = [one for one in (self.interval_95, self.exact_95) if one is not None]
        return max(known, key=lambda ends: ends[1] - ends[0], default=(-np.inf, np.inf))


@dataclass(frozen=True)
class Criterion:
    """One line of a table: figure, rate, the criterion's words, met (None: not measured, or shown without one)."""

    figure: str
    rate: Rate
    words: str
    met: bool | None

    def figures(self) -> dict[str, Any]:
        """For JSON."""
        return {"figure": self.figure, **vars(self.rate), "gate": self.words, "met": self.met}


def figures_of(per_truth: Sequence[Array], middle: Callable[..., Any] = np.mean) -> Rate:
    """Of figures of each truth's records; truths weigh alike and are resampled whole."""
    kept = [np.asarray(values, float) for values in per_truth if len(values)]
    if not kept:
        return Rate(None, None, None, 0, 0)
    means = np.array([middle(values) for values in kept])
    picks = np.random.default_rng(SEED).integers(len(means), size=(RESAMPLES, len(means)))
    low, high = np.quantile(middle(means[picks], axis=1), [0.025, 0.975])
    return Rate(float(middle(means)), (float(low), float(high)), None, len(kept), sum(map(len, kept)))


def rate(per_truth: Sequence[Array]) -> Rate:
    """Of yes and no for each truth's records."""
    found = figures_of(per_truth)
    if found.value is None:
        return found
    ends = binomtest(round(found.value * found.curves), found.curves).proportion_ci(0.95, method="exact")
    return replace(found, exact_95=(float(ends.low), float(ends.high)))


def by_truth(scores: Iterable[Score], figure: Callable[[Score], Any]) -> list[Array]:
    """Figures of the records, together for each truth; None is left out."""
    found: dict[str, list[float]] = {}
    for one in scores:
        value = figure(one)
        values = value if isinstance(value, list | tuple) else [] if value is None else [value]
        found.setdefault(one.draw, []).extend(map(float, values))
    return [np.array(values) for values in found.values() if values]


def at_least(figure: str, found: Rate, value: float) -> Criterion:
    """At least a value."""
    return Criterion(
        figure, found, f"at least {100 * value:g} %", None if found.value is None else found.value >= value
    )


def between(figure: str, found: Rate, low: float, high: float) -> Criterion:
    """Between two values."""
    met = None if found.value is None else low <= found.value <= high
    return Criterion(figure, found, f"{100 * low:g} to {100 * high:g} %", met)


def shown(figure: str, found: Rate) -> Criterion:
    """Without a criterion."""
    return Criterion(figure, found, "shown", None)


def criteria(scores: Sequence[Score], alpha: float, channels: int, shots: int) -> list[Criterion]:
    """The criteria for one table."""
    return [*_answers(scores, alpha), *_at_signals(scores, channels, shots), *_intervals(scores), *_shown(scores)]


def _answers(scores: Sequence[Score], alpha: float) -> list[Criterion]:
    alarms = rate(by_truth(_of(scores, CLEAN), lambda s: s.alarm))
    met = None
    if alarms.value is not None:
        low, high = alarms.wider
        met = low <= alpha <= high and high - low <= 2.0 * WIDEST
    words = f"the interval holds {100 * alpha:g} % and is at most +-{100 * WIDEST:g} points"
    deciles = [one for one in reliability(scores) if one["truths"]]
    within = Rate(None, None, None, 0, 0)
    if deciles:
        share = float(np.mean([one["within"] for one in deciles]))
        within = Rate(share, None, None, len({s.draw for s in scores}), len(scores))
    inside = rate(by_truth(_of(scores, SINGLE), lambda s: s.in_set))
    return [
        Criterion("false alarms", alarms, words, met),
        between("truth in the 95 % set, single effects", inside, 0.93, 0.98),
        Criterion(
            "deciles of the stated probabilities that hold",
            within,
            "each within its interval",
            None if within.value is None else within.value == 1.0,
        ),
    ]


def _at_signals(scores: Sequence[Score], channels: int, shots: int) -> list[Criterion]:
    near = {at: [s for s in _of(scores, SINGLE) if _near(s.signal, at)] for at in (4.0, 5.0)}
    figures: list[tuple[str, Callable[[Score], bool]]] = [
        ("truth first, signal of 5", lambda s: s.rank == 1),
        ("truth among the first three, signal of 5", lambda s: s.rank is not None and s.rank <= 3),
        ("family first, signal of 5", lambda s: s.family_rank == 1),
    ]
    limits = RANKS.get((channels > 1, shots > 1))
    found = []
    for i, (words, figure) in enumerate(figures):
        one = rate(by_truth(near[5.0], figure))
        found.append(at_least(words, one, limits[i]) if limits else shown(words, one))
    for at, least in ((4.0, 0.75), (5.0, 0.95)):
        found.append(at_least(f"power of the alarm at {at:g}", rate(by_truth(near[at], lambda s: s.alarm)), least))
    return found


def _near(value: float | None, at: float) -> bool:
    return value is not None and at / NEAR <= value <= at * NEAR


def _intervals(scores: Sequence[Score]) -> list[Criterion]:
    excess = figures_of(by_truth(scores, lambda s: s.excess if s.attributed else None), middle=np.median)
    met = None if excess.value is None else excess.value < 0.25
    theta = rate(by_truth(scores, lambda s: list(s.parameters.values())))
    sizes = rate(by_truth(_of(scores, SINGLE), lambda s: s.magnitude))
    return [
        Criterion("excess error after / before, held out, where attributed", excess, "median below 0.25", met),
        between("95 % intervals: parameters", theta, 0.90, 0.98),
        between("95 % intervals: magnitudes", sizes, 0.90, 0.98),
    ]


def _shown(scores: Sequence[Score]) -> list[Criterion]:
    wanted: list[tuple[str, str, Callable[[Score], bool]]] = [
        ("attributed to another effect, single effects", SINGLE, lambda s: s.attributed and not s.right),
        ("attributed to it, single effects", SINGLE, lambda s: s.attributed and s.right),
        ("attributed, clean records", CLEAN, lambda s: s.attributed),
        ("attributed to one effect, pairs", PAIR, lambda s: s.attributed),
        ("attributed, outside the library", OUTSIDE, lambda s: s.attributed),
    ]
    return [shown(words, rate(by_truth(_of(scores, kind), figure))) for words, kind, figure in wanted]


def _of(scores: Iterable[Score], kind: str) -> list[Score]:
    return [s for s in scores if s.kind == kind]


def weights(scores: Sequence[Score]) -> dict[str, float]:
    """Weight of a record by its kind: the diagnosis' prior over the share among the records."""
    counts = Counter(s.kind for s in scores)
    prior = {**PRIOR, SINGLE: 1.0 - sum(PRIOR.values())}
    return {kind: prior[kind] * len(scores) / count for kind, count in counts.items()}


def reliability(scores: Sequence[Score]) -> list[dict[str, Any]]:
    """Stated probabilities by deciles against how often they were true, kinds weighted to the diagnosis' prior.

    within: whether the mean that is stated lies within the 95 % interval of how often it was true (`_interval`).
    """
    own = weights(scores)
    rows = [(min(int(10.0 * p), 9), p, float(true), own[s.kind], s.draw) for s in scores for p, true in s.probabilities]
    found = []
    for decile in range(10):
        part = [row for row in rows if row[0] == decile]
        entry = {"from": decile / 10.0, "to": (decile + 1) / 10.0, "models": len(part)}
        if not part:
            found.append(entry | dict.fromkeys(("stated", "true", "interval_95", "within")) | {"truths": 0})
            continue
        p, true, weight = (np.array([row[i] for row in part]) for i in (1, 2, 3))
        draws = sorted({row[4] for row in part})
        place = np.array([draws.index(row[4]) for row in part])
        sums = np.array([np.bincount(place, weight * x, len(draws)) for x in (p, true, np.ones(len(part)))])
        picks = np.random.default_rng(SEED).integers(len(draws), size=(RESAMPLES, len(draws)))
        spread = float(np.var(sums[1][picks].sum(axis=1) / sums[2][picks].sum(axis=1)))
        stated, value = (float(sums[i].sum() / sums[2].sum()) for i in (0, 1))
        low, high = _interval(value, spread, len(draws), len(part))
        held = {"stated": stated, "true": value, "interval_95": (low, high), "within": low <= stated <= high}
        found.append(entry | held | {"truths": len(draws)})
    return found


def _interval(value: float, variance: float, truths: int, models: int) -> tuple[float, float]:
    """95 % interval of a rate of clustered yes and no, with the variance of a bootstrap over the truths.

    Clopper and Pearson's, of as many independent answers as have that variance: more than truths where each has many
    models, fewer where weights or truths are unlike (Korn & Graubard, Survey Methodology 24 (1998) 193). As many as
    truths where all agree.
    """
    count = float(truths)
    if 0.0 < value < 1.0 and variance > 0.0 and truths > 1:
        known = (norm.ppf(0.975) / student_t.ppf(0.975, truths - 1)) ** 2
        count = min(value * (1.0 - value) / (variance * truths / (truths - 1)) * known, models)
    yes = value * count
    low = float(beta.ppf(0.025, yes, count - yes + 1.0)) if value > 0.0 else 0.0
    return low, float(beta.ppf(0.975, yes + 1.0, count - yes)) if value < 1.0 else 1.0


def confusion(scores: Sequence[Score]) -> dict[str, dict[str, float]]:
    """Planted -> share of records by answer: none, an effect, ambiguous with or without the truth, unexplained."""
    found: dict[str, Counter[str]] = {}
    for s in sorted(scores, key=lambda one: (ORDER.index(one.kind), list(one.planted))):
        planted = " + ".join(s.planted) or (s.kind if s.kind == CLEAN else "outside the library")
        found.setdefault(planted, Counter())[_answer(s)] += 1
    return {name: {key: n / row.total() for key, n in row.items()} for name, row in found.items()}


def _answer(s: Score) -> str:
    if s.verdict == "no_significant_residual":
        return "none needed"
    if s.verdict == "unexplained":
        return "unexplained"
    return s.named or f"ambiguous, truth {'' if s.in_set else 'not '}among them"


def lines(scores: Sequence[Score]) -> list[dict[str, Any]]:
    """One line a record."""
    return [{key: value for key, value in vars(s).items() if key != "probabilities"} | _derived(s) for s in scores]


def _derived(score: Score) -> dict[str, Any]:
    """baseline: whether there is one; baseline_bird: one of BASELINES."""
    has = score.baseline != NO_BASELINE
    return {"baseline": has, "baseline_bird": score.baseline, "excess": score.excess}


def table_name(score: Score) -> str:
    """Channels, shots, baseline, form."""
    parts = [many(len(score.channels), "channel"), many(score.shots, "shot")]
    parts.append(OF_BASELINE[score.baseline])
    if score.form != OWN:
        parts.append("truth by another model")
    return ", ".join(parts)


def tables(scores: Sequence[Score], alpha: float) -> dict[str, dict[str, Any]]:
    """A table for each number of channels and of shots, each kind of baseline and of truth."""
    groups: dict[str, list[Score]] = {}
    for one in sorted(
        scores, key=lambda s: (s.form != OWN, len(s.channels), s.shots, BASELINES.index(s.baseline), s.name)
    ):
        groups.setdefault(table_name(one), []).append(one)
    return {
        name: {
            "curves": len({s.draw for s in part}),
            "records": len(part),
            "gates": [criterion.figures() for criterion in criteria(part, alpha, len(part[0].channels), part[0].shots)],
            "reliability": reliability(part),
            "confusion": confusion(part),
            "experiments": lines(part),
        }
        for name, part in groups.items()
    }
