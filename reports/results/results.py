"""What a report says, in immutable things: of a campaign, of an inversion, and of both together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.histories import Array, Histories
from birdstrike.data.run_warnings import merged, unlike
from birdstrike.inversion.observations.filters import ModelFilter
from birdstrike.inversion.results.estimates import Answer
from birdstrike.inversion.results.inversion import Inversion
from birdstrike.solver.case.case import Case

RunSummary = Mapping[str, Any]
"""Content of a run's `summary.json`: cost, erosion and the energy balance."""

TITLES = {"elastic": "elastic", "plastic_kinematic": "plastic-kinematic", "hydrodynamic": "hydrodynamic"}
"""Bird model of a case -> what the page calls it."""


@dataclass(frozen=True)
class Convergence:
    """The network's mean square errors over the epochs (e,), on training and held-out runs, outputs scaled to 0..1."""

    epoch: Array
    training: Array
    held_out: Array


@dataclass(frozen=True)
class Model:
    """One bird model's simulation.

    key: the method that found the inverted bird, or the standard model's name; case: None where the user's case and
    the material do not go together; run: None where it failed, and `failure` says why; offset: [s] by which the
    record's clock is ahead of this simulation's.
    """

    key: str
    title: str
    case: Case | None
    run: Histories | None
    offset: float
    failure: str = ""


def titled(key: str, case: Case) -> str:
    """What a model is called in the page; the inverted one by the model of the case and the method that found it."""
    law = case.bird.material.model
    return TITLES.get(key, f"inverted {TITLES.get(law, law.upper())} ({key})")


@dataclass(frozen=True, kw_only=True)
class CampaignResults:
    """What the report says of a campaign, read from its folder.

    doe: that folder; campaign: content of its `summary.json`; summaries: run's label -> its summary; failures: run's
    label -> reason.
    """

    folder: Path
    doe: Path
    case: Case
    dataset: Dataset
    campaign: Mapping[str, Any]
    summaries: Mapping[str, RunSummary]
    failures: Mapping[str, str]

    @property
    def case_name(self) -> str:
        """What the case was called where the campaign began; its copy in the folder is just `case`."""
        return str(self.campaign["case_name"])

    @property
    def held_out(self) -> NDArray[np.bool_]:
        """(runs,) the simulations that a network was not trained on."""
        return np.zeros(len(self.dataset.runs), dtype=bool)

    @property
    def every_summary(self) -> Mapping[str, RunSummary]:
        """Summaries of all simulations that the report rests on."""
        return self.summaries

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the reader must know."""
        return campaign_warnings(self)


def campaign_warnings(results: CampaignResults) -> tuple[str, ...]:
    """Failed simulations, and the warnings of the others."""
    failed = [f"{label} failed and is not used: {reason}" for label, reason in results.failures.items()]
    return (*failed, *merged([summary.get("warnings", []) for summary in results.summaries.values()]))


@dataclass(frozen=True, kw_only=True)
class InversionResults:
    """What the report says of an inversion, read from its folder.

    inverted: that folder; record: what was inverted; simulated: method -> channel -> (r,) SI, the verification at the
    record's times, NaN where it has no value; verified: method -> its run; draws: of the posterior, name -> (n,) SI,
    None for none; other_shots: a sentence about each shot inverted together with the record; later: the same
    of these shots; filter: through which the simulated curves were compared with the record, None for none.
    """

    folder: Path
    inverted: Path
    record: Measured
    inversion: Inversion
    simulated: Mapping[str, Mapping[str, Array]]
    verified: Mapping[str, Histories]
    convergence: Convergence | None
    draws: Mapping[str, Array] | None = None
    other_shots: tuple[str, ...] = ()
    later: tuple[InversionResults, ...] = ()
    filter: ModelFilter | None = None

    def compared(self, run: Histories) -> Histories:
        """A simulation's curves as they are compared with the record: filtered where the inversion's were."""
        return run if self.filter is None else self.filter.histories(run)

    @property
    def used(self) -> Measured:
        """The record's points that the fit used, with gaps where it left others out.

        Left out are readings before and after the simulated record, clipped ones, and those with a fault: errors, peaks
        and ranks are of the points used alone.
        """
        return self.inversion.measured.fitted(self.record)

    def cut(self, channel: str, *reasons: str) -> Array:
        """Instants [s] of a channel that were cut for these reasons."""
        return self.inversion.measured.cut(channel, *reasons)

    @property
    def filter_text(self) -> str:
        """Through which filter the curves have passed; "" without one."""
        return "" if self.filter is None else f"The simulated curves have passed {self.filter.name}, as the record has."

    @property
    def best(self) -> str:
        """The method whose verification differs least from the record."""
        assert self.inversion.best is not None, "results without a verification are refused when they are read"
        return self.inversion.best

    @property
    def answer(self) -> Answer:
        """The best method's answer."""
        return self.inversion.methods[self.best]

    @property
    def units(self) -> Mapping[str, str]:
        """SI units of the parameters, by dotted key."""
        return {name: estimate.unit for name, estimate in self.answer.parameters.items()}

    @property
    def finished(self) -> tuple[str, ...]:
        """Methods with a verification run, the best first."""
        return self.best, *(name for name in self.verified if name != self.best)

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels of the record that were compared, in the record's order."""
        return tuple(self.record.channels)

    @property
    def offset(self) -> float:
        """[s] by which the record's clock is ahead of the simulation's."""
        return self.inversion.time_offset.value

    @property
    def records(self) -> tuple[Measured, ...]:
        """Of all shots that were inverted together, the first one's first."""
        return self.record, *(one.record for one in self.later)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the reader must know of the inversion, and what is shown of shots other than the first."""
        return (*self.inversion.warnings, *self.other_shots)


@dataclass(frozen=True, kw_only=True)
class Results(CampaignResults, InversionResults):
    """Campaign and inversion together: everything the report says.

    diagnosis: folder of the diagnosis, None for none; other_diagnosis: as in `Parts`; simulated_models: the bird
    models, {} where none were asked for.
    """

    diagnosis: Path | None = None
    other_diagnosis: str = ""
    simulated_models: Mapping[str, Model] = field(default_factory=dict)

    @property
    def models(self) -> Mapping[str, Model]:
        """The bird models side by side; the inverted one's verification run alone where no others were simulated."""
        if self.simulated_models:
            return self.simulated_models
        key = self.best
        return {key: Model(key, titled(key, self.case), self.case, self.verified[key], self.offset)}

    @property
    def held_out(self) -> NDArray[np.bool_]:
        """(runs,) the simulations that the network was not trained on."""
        training = self.inversion.training
        return np.isin(self.dataset.runs, training.held_out if training else [])

    @property
    def every_summary(self) -> Mapping[str, RunSummary]:
        """Summaries of the campaign's and the verification runs, and of the bird models' where they were simulated."""
        models = {f"model, {m.title}": m.run.summary for m in self.simulated_models.values() if m.run is not None}
        return {**self.summaries, **models}

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the reader must know, of each part the gravest first.

        Of the inversion, of failed simulations, of the simulations' own checks, which shots have no curves here, and
        that a diagnosis is left out. What both say of simulations is said once, of all of them.
        """
        of_runs = campaign_warnings(self)
        left_out = (self.other_diagnosis,) if self.other_diagnosis else ()
        return (*unlike(self.inversion.warnings, of_runs), *of_runs, *self.other_shots, *left_out)
