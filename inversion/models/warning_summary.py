"""Warnings of all models as one each: what was found, what it means for the ranking, what to do; the gravest first.

Each model's own lines, with their channels and instants, stay in `models.json` under the model's name.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from birdstrike.data.formatting import listing, many
from birdstrike.inversion.models.ranking import misses
from birdstrike.inversion.models.results import ModelAnswer

MOST_NAMED = 3  # channels
MOST_MODELS = 9


@dataclass(frozen=True)
class Found:
    """One line of one model; found: the named parts of what the kind's pattern met."""

    model: str
    line: str
    found: Mapping[str, str]

    def number(self, name: str) -> float:
        """A part that is a number."""
        return float(self.found[name])


@dataclass(frozen=True)
class Kind:
    """Lines that say the same of several models, shots or channels.

    pattern: of a line; summary: of all of them as one.
    """

    pattern: re.Pattern[str]
    summary: Callable[[Sequence[Found]], str]


def summarised(lines: Mapping[str, Iterable[str]]) -> tuple[str, ...]:
    """One warning for each thing found, the gravest first; lines: model -> its own warnings."""
    kinds, others = dict[Kind, list[Found]](), dict[str, list[str]]()
    for model, own in lines.items():
        for line in dict.fromkeys(own):
            kind, met = next(((k, m) for k in (*GRAVE, *MINOR) if (m := k.pattern.search(line))), (None, None))
            if kind is None or met is None:
                others.setdefault(line, []).append(model)
            else:
                kinds.setdefault(kind, []).append(Found(model, line, met.groupdict()))
    grave, minor = ([kind.summary(kinds[kind]) for kind in part if kind in kinds] for part in (GRAVE, MINOR))
    return (*grave, *(f"{listing(models, MOST_MODELS)}: {line}" for line, models in others.items()), *minor)


def warnings_of(models: Mapping[str, ModelAnswer], ranking: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Model -> its warnings as a comparison gives them, or why it has no answer.

    Where the first of the ranking fits a record, the warnings of a model that does not fit it about that record's clock
    and sign are left out.
    """
    first_fits = bool(ranking) and not misses(models[ranking[0]].expected_95)

    def own(one: ModelAnswer) -> tuple[str, ...]:
        if one.failure:
            return (f"no answer: {one.failure}",)
        unreliable = first_fits and misses(one.expected_95)
        return tuple(line for line in one.warnings if not (unreliable and IMPLAUSIBLE_RECORD.search(line)))

    return {name: own(one) for name, one in models.items()}


def _no_answer(found: Sequence[Found]) -> str:
    reasons = "; ".join(f"{one.model}: {one.found['reason']}" for one in found)
    return f"{_models(found)} cannot be ranked, because there is no answer ({reasons}); the others are ranked without"


def _outside(found: Sequence[Found]) -> str:
    return (
        f"{_models(found)} cannot produce the records with any constants in the ranges (residual of the best fit over "
        f"noise and emulator error: {_sizes(found)}): no constant is identified, and the held-out error is that of the "
        "nearest constants; look for what else differs (birdstrike diagnose), or widen inversion.models.NAME"
    )


def _coarse(found: Sequence[Found]) -> str:
    return (
        f"the emulator cannot follow the simulations of {_models(found)} closely enough for these records (residual "
        f"over noise and emulator error: {_sizes(found)}): no constant is identified, and the held-out error is that "
        "of the nearest constants; use a finer mesh and more particles, raise --runs, or leave channels out: --channels"
    )


def _stands_in(found: Sequence[Found]) -> str:
    return (
        f"{many(len(found), 'simulation')} at the answers of {_models(found)} failed, {_first(found)}: the nearest "
        "run that finished stands in, so that the errors are those of its constants; change what the solver asks for, "
        "or narrow the ranges: inversion.models.NAME"
    )


def _lost_runs(found: Sequence[Found]) -> str:
    counts = Counter(one.model for one in found)
    return (
        f"{many(len(found), 'simulation')} failed and {_are(len(found))} left out ({_counted(counts)}), {_first(found)}"
        ": the emulator knows less of such constants; change what the solver asks for, or narrow the ranges: "
        "inversion.models.NAME"
    )


def _unsettled(found: Sequence[Found]) -> str:
    worst = max(found, key=lambda one: one.number("rhat"))
    return (
        f"the posterior of {_models(found)} has not converged (R-hat up to {worst.found['rhat']}): intervals are "
        "approximate; raise --runs, or state more noise where the residual is not noise"
    )


def _implausible(found: Sequence[Found]) -> str:
    channels, first = list(dict.fromkeys(one.found["channel"] for one in found)), found[0]
    more = f"; the same may hold of {listing(channels[1:], MOST_NAMED)}" if channels[1:] else ""
    return f"beside the runs of {_models(found)}: {first.line}{more}"


def _poor(found: Sequence[Found]) -> str:
    q2 = [(float(met["q2"]), met["channel"], one.model) for one in found for met in Q2.finditer(one.found["channels"])]
    worst, channel, model = min(q2, key=lambda one: -np.inf if np.isnan(one[0]) else one[0])
    return (
        f"left-out runs are predicted poorly by the {_emulators(found)}, in {many(len(q2), 'channel')} (worst: "
        f"{channel} with {model}, Q2 {worst:.2f}): such a channel carries that error as noise and counts for less in "
        "the calibration; raise --runs, or leave it out: --channels"
    )


def _not_noise(found: Sequence[Found]) -> str:
    worst = max(found, key=lambda one: one.number("factor"))
    return (
        f"the best fit of the {_emulators(found)} leaves more than noise: intervals were widened, by a factor "
        f"{worst.found['factor']} at most ({worst.model}, {worst.found['channel']}); where the error of the calibrated "
        "constants, by the solver, is that of the noise, the emulator errs there: raise --runs; else the model lacks "
        "something that its constants do not change: birdstrike diagnose"
    )


def _overruled(found: Sequence[Found]) -> str:
    channels, first = list(dict.fromkeys(one.found["channel"] for one in found)), found[0].found
    other = " and ".join(dict.fromkeys(one.found["other"] for one in found))
    return (
        f"the noise stated for {many(len(channels), 'channel')} ({listing(channels, MOST_NAMED)}) is not {other}, "
        f"which is used instead (the first: stated {first['stated']}; found {first['level']}); correct what is stated: "
        "sensors.NAME.noise of its case, or birdstrike import --sigma"
    )


def _left_out(found: Sequence[Found]) -> str:
    counts = {one.model: one.found["runs"].count(",") + 1 for one in found}
    return (
        f"{many(sum(counts.values()), 'run')} ({_counted(counts)}) lost more than {found[0].found['limit']} and "
        f"{_are(sum(counts.values()))} left out of the emulators, which know less of such constants; narrow the ranges "
        "of the constants that erode: inversion.models.NAME"
    )


def _gaps(found: Sequence[Found]) -> str:
    shown = listing([f"{one.found['where']} ({one.model})" for one in found], MOST_NAMED)
    return (
        f"no answer is sought where too few smooth runs stand, {shown}: one that lies there is not found; "
        "raise --runs, or narrow the ranges: inversion.models.NAME"
    )


def _single_readings(found: Sequence[Found]) -> str:
    points = {one.found["channel"]: int(one.found["points"]) for one in found}
    total = sum(points.values())
    return (
        f"{many(total, 'reading')} of {listing(list(points), MOST_NAMED)} {_are(total)} far off the neighbouring ones "
        "and left out, since single readings would pull the fit; check the record there, for what is real in them is "
        "lost to the fit"
    )


def _beyond(found: Sequence[Found]) -> str:
    points = {one.found["channel"]: int(one.found["before"]) + int(one.found["after"]) for one in found}
    total = sum(points.values())
    return (
        f"{many(total, 'point')} of {many(len(points), 'channel')} outside the simulated time "
        f"({found[0].found['span']}) {_are(total)} left out of the fit; raise time.end to use later ones"
    )


def _assumed(found: Sequence[Found]) -> str:
    channels = list(dict.fromkeys(one.found["channel"] for one in found))
    return (
        f"no noise is stated for {listing(channels, MOST_NAMED)}: 1 % of the peak is assumed, and intervals and "
        "held-out errors rest on it; state it: sensors.NAME.noise"
    )


OVERRULED = (
    r"the noise stated \((?P<stated>.*?)\) is (?:less than|not) (?P<other>the scatter of neighbouring points|"
    r"that of the record before contact) \((?P<level>.*?)\), which is used instead"
)
BEYOND = r"(?P<before>\d+) points before and (?P<after>\d+) after the simulated record (?P<span>.*?) are left out"
CHANNEL = r"(?P<channel>[^:]+?)"
Q2 = re.compile(r"(?:^|, | and )(?P<channel>.+?) \(Q2 (?P<q2>[^)]+)\)")
IMPLAUSIBLE_RECORD = re.compile(
    rf"^{CHANNEL} (?:lies beside the runs best|has the shape of the runs|has a size|has the opp)",
)
GRAVE = (
    Kind(re.compile(r"^no answer: (?P<reason>.*)", re.DOTALL), _no_answer),
    Kind(re.compile(r"^the model cannot produce this curve: .* fit is (?P<times>[\d.]+) times"), _outside),
    Kind(re.compile(r"^the emulator is too coarse for this curve: .* fit is (?P<times>[\d.]+) times"), _coarse),
    Kind(re.compile(r"^the simulation at an answer failed \((?P<reason>.*)\): run \d+ of the campaign"), _stands_in),
    Kind(re.compile(r"^(?:a run near the answer|run \d+) (?:failed|was ended).* left out: (?P<reason>.*)"), _lost_runs),
    Kind(re.compile(r"chains have not settled .*R-hat (?P<rhat>[\d.]+)"), _unsettled),
    Kind(IMPLAUSIBLE_RECORD, _implausible),
    Kind(re.compile(r"^the emulator predicts left-out runs of (?P<channels>.+?) poorly: "), _poor),
    Kind(re.compile(rf"^{CHANNEL}: the residual .* widened by a factor (?P<factor>[\d.]+)"), _not_noise),
)
"""The gravest first: no result, a result that may be wrong, an interval that may be."""
MINOR = (
    Kind(re.compile(r"^runs? (?P<runs>[\d, ]+) lost more than (?P<limit>.*?): the emulator leaves"), _left_out),
    Kind(re.compile(r"^(?P<where>[^:]+): too few smooth runs stand there"), _gaps),
    Kind(re.compile(rf"^{CHANNEL}: {OVERRULED}"), _overruled),
    Kind(re.compile(rf"^{CHANNEL}: (?P<points>\d+) points? at .* far off"), _single_readings),
    Kind(re.compile(rf"^{CHANNEL}: {BEYOND}"), _beyond),
    Kind(re.compile(rf"^{CHANNEL}: no noise is stated; "), _assumed),
)
"""What was left out of the records or assumed of them; after all warnings that are of no kind."""


def _first(found: Sequence[Found]) -> str:
    """The commonest reason of failures, numbers apart, as its first line gives it."""
    reasons = [one.found["reason"].removeprefix("CaseError: ").split(";")[0] for one in found]
    alike = [re.sub(r"[\d.]+", "#", reason) for reason in reasons]
    commonest = Counter(alike).most_common(1)[0][0]
    return ("most often because " if len(set(alike)) > 1 else "because ") + reasons[alike.index(commonest)]


def _models(found: Iterable[Found]) -> str:
    return listing(list(dict.fromkeys(one.model for one in found)), MOST_MODELS)


def _sizes(found: Iterable[Found]) -> str:
    """Each model with how many times the noise its residual is."""
    return listing([f"{one.model} {one.found['times']}" for one in found], MOST_MODELS)


def _counted(counts: Mapping[str, int]) -> str:
    """Each model with its number of runs."""
    return listing([f"{name} {count}" for name, count in counts.items()], MOST_MODELS)


def _emulators(found: Iterable[Found]) -> str:
    """ "emulator of null", "emulators of null and elastic"."""
    every = list(found)
    return f"emulator{'s' if len({one.model for one in every}) > 1 else ''} of {_models(every)}"


def _are(count: int) -> str:
    return "is" if count == 1 else "are"
