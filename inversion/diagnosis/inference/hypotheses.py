"""The models that are compared, and their prior probabilities.

none: 1/2. The other half: pairs and something else at stated shares, the rest equally among families, then among a
family's effects, then among an effect's sensors, sets of nodes and shots. Equal shares at each level are the
maximum-entropy choice for who knows only the taxonomy (Jaynes, Probability Theory, 2003, ch. 11-12).

How far the birds of several shots lie apart: what the user states of them, and what the records may show.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from types import MappingProxyType

import numpy as np

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.preparation.responses import Response
from birdstrike.inversion.diagnosis.preparation.shots import InstrumentEffect, Shot, instrument_effects, responses_of
from birdstrike.inversion.results.diagnosis import NONE, SOMETHING_ELSE
from birdstrike.solver.case.case import Case
from birdstrike.solver.effects.registry import effect_named, effects, kind_of

BIRDS = {"same": 0.02, "recipe": 0.1, "other": 1.0}
"""Prior standard deviations by which the parameters of a shot's bird lie off what the shots share: birds of one batch;
birds cast by one recipe, which scatter by a tenth of what is known of a recipe beforehand; birds of which one says
nothing of the other. Each is as likely as the others unless the user states which it is."""
BIRDS_APART = tuple(BIRDS.values())
AUTO = "auto"
CONTRADICTED = 0.05  # probability by the records below which a stated bird is contradicted by them


def birds_apart(stated: str) -> tuple[float, ...]:
    """The possibilities that a stated bird leaves: all of them for `auto`; raises UserError for an unknown word."""
    if stated == AUTO:
        return BIRDS_APART
    if stated not in BIRDS:
        raise UserError(f'baseline_bird = "{stated}" is unknown; available: {", ".join((AUTO, *BIRDS))}')
    return (BIRDS[stated],)


PRIOR_NONE = 0.5  # a model that is suspected is as likely right as wrong
PRIOR_PAIRS, PRIOR_ELSE = 0.05, 0.05
"""Share of the whole: about the square of the chance of one effect (0.4^2 / 2 = 0.08, of which half within the
library), and a tenth of the alternatives for what no library lists (Draper, J. R. Statist. Soc. B 57 (1995) 45)."""
SMALL = 1e-3  # size of a response that is below every one that was simulated


@dataclass(frozen=True)
class CandidateEffect:
    """One effect where it acts.

    label: as in the answer; name: of the effect, of one set of nodes with that; shots: names of the shots, response or
    fault: what it does; seen: whether a sensor that is used can show it.
    """

    label: str
    name: str
    family: str
    shots: tuple[str, ...]
    response: Response | None = None
    fault: InstrumentEffect | None = None
    seen: bool = True

    @property
    def one_sided(self) -> bool:
        """Whether its magnitude cannot be negative."""
        return self.response.known.one_sided if self.response else bool(self.fault and self.fault.one_sided)

    @property
    def bends(self) -> bool:
        """Whether what it changes is no multiple of its size beyond small sizes (`InstrumentEffect.bends`)."""
        return self.fault is not None and self.fault.bends

    @property
    def size(self) -> float:
        """Plausible magnitude, SI."""
        return self.response.known.size if self.response else self.fault.size if self.fault else 1.0

    @property
    def unit(self) -> str:
        """SI unit of the magnitude."""
        return effect_named(self.name).unit

    @property
    def limits(self) -> tuple[float, float]:
        """Of h, the size of its response."""
        if self.response:
            return self.response.limits
        assert self.fault is not None, "a candidate effect has a response or a fault"
        return self.fault.limits

    @property
    def search_limits(self) -> tuple[float, float]:
        """The same, infinite where nothing lies beyond: springs cannot be stiffer than rigid, nor a reading less than
        none.
        """
        kind = self.response.known if self.response else self.fault
        low, high = self.limits
        return (-np.inf if kind is not None and kind.ends else low), high

    def magnitude(self, h: float) -> float:
        """SI magnitude of a response of size h."""
        return self.size * (self.response.b(h) if self.response else h)

    def response_in(self, shot: Shot, h: float) -> tuple[Response, float]:
        """The response in a shot's case, in the sense of h, and its size there for h = 1.

        h counts in the first shot's response; where one of another case bends otherwise, h is another part of it: of
        h = 0 as of a small one.
        """
        own, first = shot.setup.responses[self.name], self.response
        if own is first or first is None:
            return own.sided(h), 1.0
        some = h or SMALL
        return own.sided(h), own.h(first.b(some)) / some

    def change_in(self, shot: Shot, z: Array, h: float) -> Array:
        """(n,) change of a shot's record for h = 1, in the sense and at the size h, at parameters z (k,)."""
        response, size = self.response_in(shot, h)
        return size * shot.sample(response.at(z)[None])[0]


@dataclass(frozen=True)
class Hypothesis:
    """members: none, one or two candidate effects; prior: probability."""

    label: str
    members: tuple[CandidateEffect, ...]
    prior: float
    family: str


NOTHING = Hypothesis(NONE, (), 1.0, NONE)  # of records in which nothing is suspected


def candidate_effects(shots: Sequence[Shot]) -> tuple[CandidateEffect, ...]:
    """Every effect that the measured shots could have; baselines have none.

    A sensor that is left out can be at fault too: the record holds no information on that, so that it is about as
    likely beside `none` as the prior has it.
    """
    measured = [shot for shot in shots if not shot.baseline]
    found: list[CandidateEffect] = []
    for name in responses_of(measured):
        able = {shot.name: shot.setup.responses[name] for shot in measured if name in shot.setup.responses}
        one = CandidateEffect(name, name, family_of(name), tuple(able), next(iter(able.values())))
        found += _by_shot(one, len(measured), able)
    case = _with_all_sensors(measured)
    channels = dict.fromkeys(channel for shot in measured for channel in shot.channels)
    left_out = dict.fromkeys(channel for shot in measured for channel in shot.setup.left_out)
    measured_by = instrument_effects(case, (*channels, *left_out))
    unseen = [one for one in measured_by if len(one.sensors) == 1 and one.sensors[0] in left_out]
    for fault in (*instrument_effects(case, tuple(channels)), *unseen):
        names = tuple(s.name for s in measured if any(sensor in s.setup.plan.case.sensors for sensor in fault.sensors))
        one = CandidateEffect(
            fault.label, fault.effect.name, "instrument", names, fault=fault, seen=fault not in unseen
        )
        found += _by_shot(one, len(measured)) if fault.label == fault.effect.name else [one]
    return tuple(found)


def _with_all_sensors(shots: Sequence[Shot]) -> Case:
    """The first shot's case with the sensors that only other shots have."""
    sensors = {name: sensor for shot in shots[::-1] for name, sensor in shot.setup.plan.case.sensors.items()}
    case = shots[0].setup.plan.case
    return case.model_copy(update={"sensors": {**case.sensors, **sensors}})


def _by_shot(
    one: CandidateEffect, count: int, responses: Mapping[str, Response] = MappingProxyType({})
) -> list[CandidateEffect]:
    """The effect in all of `count` shots that can carry it and, where it may belong to a single one, in each.

    responses: by shot; that in one shot alone is the response of its own case.
    """
    if count == 1 or effect_named(one.name).scope != "shot":
        return [one]
    each = [
        replace(one, label=f"{one.label}@{shot}", shots=(shot,), response=responses.get(shot)) for shot in one.shots
    ]
    return [one, *each] if len(each) > 1 else each


def family_of(name: str) -> str:
    """One of `effects.effect.FAMILIES`; raises KeyError for an unknown name."""
    return effects()[kind_of(name)].family


def hypotheses(found: Sequence[CandidateEffect]) -> tuple[Hypothesis, ...]:
    """none, singles, pairs of different effects, something else, with their priors."""
    couples = [(a, b) for a, b in combinations(found, 2) if kind_of(a.name) != kind_of(b.name)]
    single = _single_priors(found, 1.0 - PRIOR_NONE - (PRIOR_PAIRS if couples else 0.0) - PRIOR_ELSE)
    singles = [Hypothesis(one.label, (one,), single[one.label], one.family) for one in found]
    weight = {(a.label, b.label): single[a.label] * single[b.label] for a, b in couples}
    total = sum(weight.values())
    pairs = [
        Hypothesis(f"{a.label}+{b.label}", (a, b), PRIOR_PAIRS * weight[a.label, b.label] / total, "pairs")
        for a, b in couples
    ]
    none = Hypothesis(NONE, (), PRIOR_NONE, NONE)
    other = Hypothesis(SOMETHING_ELSE, (), PRIOR_ELSE, SOMETHING_ELSE)
    return (none, *singles, *pairs, other)


def _single_priors(found: Sequence[CandidateEffect], share: float) -> dict[str, float]:
    """Equally among families, their effects, and an effect's sensors, sets of nodes and shots."""
    tree: dict[str, dict[str, list[str]]] = {}
    for one in found:
        tree.setdefault(one.family, {}).setdefault(kind_of(one.name), []).append(one.label)
    return {
        label: share / len(tree) / len(names) / len(labels)
        for names in tree.values()
        for labels in names.values()
        for label in labels
    }


def by_family(probabilities: Mapping[str, float], models: Sequence[Hypothesis]) -> dict[str, float]:
    """Sum of the probabilities by family; none, pairs and something else stand beside them."""
    found: dict[str, float] = {}
    for one in models:
        found[one.family] = found.get(one.family, 0.0) + probabilities.get(one.label, 0.0)
    return found
