"""What an inversion found: the content of `inversion.json`. SI units; None where a thing does not exist."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import Field, TypeAdapter

from birdstrike.data.files import write_atomically
from birdstrike.inversion.results.estimates import Answer
from birdstrike.inversion.results.fit import PriorPredictive, ResidualCorrelation, TimeOrigin
from birdstrike.inversion.results.identifiability import IdentifiabilityFigures, PosteriorFigures
from birdstrike.inversion.results.ingredients import (
    DesignFigures,
    EmulatorFigures,
    MeasuredFigures,
    MeshCorrectionFigures,
    RefinementFigures,
    ShotFigures,
    TrainingFigures,
)

SCHEMA_VERSION = 1


@dataclass(frozen=True)
class Inversion:
    """The whole result of `train_and_invert`.

    methods: those that were run; best: the one with the smallest verified error; ranges: name -> limits of the search,
    SI; runs_used: finished runs of the campaign, those of a refinement included; prior_predictive: `cloud` in the file;
    residual: of the emulator's best fit.
    None in older files, and where not asked for: residual, posterior, identifiability, refinement. known_errors: what
    the model's error holds besides the emulator's; shots: of several records; shot_scatter: 1 sigma, relative
    amplitude; mesh_correction: one a shot, where it was asked for: the verified errors are then those of the fine mesh.
    """

    methods: Mapping[str, Answer]
    best: str | None
    ranges: Mapping[str, tuple[float, float]]
    design: DesignFigures
    runs_used: int
    time_offset: TimeOrigin
    warnings: tuple[str, ...]
    training: TrainingFigures | None
    emulator: EmulatorFigures
    prior_predictive: Annotated[PriorPredictive, Field(alias="cloud")]
    measured: MeasuredFigures
    case_hash: str
    seed: int
    schema_version: int = SCHEMA_VERSION
    residual: ResidualCorrelation | None = None
    posterior: PosteriorFigures | None = None
    identifiability: IdentifiabilityFigures | None = None
    refinement: RefinementFigures | None = None
    known_errors: tuple[str, ...] = ()
    shots: tuple[ShotFigures, ...] = ()
    shot_scatter: float | None = None
    mesh_correction: tuple[MeshCorrectionFigures, ...] = ()

    def save(self, path: Path) -> None:
        """Write JSON; what is not finite becomes null."""
        for answer in self.methods.values():
            for name, estimate in answer.parameters.items():
                assert estimate.consistent, f"{name}: {estimate.value} lies outside {estimate.interval_95}"
        write_atomically(path, _ADAPTER.dump_json(self, indent=2, by_alias=True).decode() + "\n")

    @classmethod
    def load(cls, path: Path) -> Inversion:
        """Read what `save` wrote."""
        return _ADAPTER.validate_json(path.read_bytes())


_ADAPTER = TypeAdapter(Inversion)
