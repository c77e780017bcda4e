"""What an inversion found: the content of `inversion.json`. SI units; None where a thing does not exist."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import Field, TypeAdapter, ValidationError

from birdstrike.data.columns import read_columns
from birdstrike.data.dataset import fraction
from birdstrike.data.display import Displayed, own_axes
from birdstrike.data.errors import UserError
from birdstrike.data.formatting import plain, quantity, span
from birdstrike.data.storage.files import file_in, write_atomically
from birdstrike.inversion.results.estimates import Answer, ends_95
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

if TYPE_CHECKING:
    import pandas as pd
    from arviz import InferenceData
    from matplotlib.axes import Axes

SCHEMA_VERSION = 1
RESULT = "inversion.json"

AGAIN = "repeat train-and-invert"
"""What to do about a damaged file of an inversion."""


@dataclass(frozen=True, repr=False)
class Inversion(Displayed):
    """The whole result of `train_and_invert`.

    methods: those that were run; best: the one whose verification run differs least from the record, over noise;
    ranges: name -> limits of the search, SI; runs_used: finished runs of the campaign, those of a refinement included;
    logarithmic: names whose range is one of the logarithm;
    prior_predictive: `cloud` in the file; residual: of the emulator's best fit.
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
    logarithmic: tuple[str, ...] = ()

    def fraction(self, name: str, value: float) -> float:
        """Place of a parameter's value (SI) on its range, in the scale of that, 0..1."""
        return fraction(value, *self.ranges[name], name in self.logarithmic)

    def save(self, path: str | Path) -> None:
        """Write JSON, into inversion.json of a folder; what is not finite becomes null."""
        for answer in self.methods.values():
            for name, estimate in answer.parameters.items():
                assert estimate.consistent, f"{name}: {estimate.value} lies outside {estimate.interval_95}"
        write_atomically(file_in(path, RESULT), _ADAPTER.dump_json(self, indent=2, by_alias=True).decode() + "\n")

    @classmethod
    def load(cls, path: str | Path) -> Inversion:
        """Read what `save` wrote, from the file or the folder of train_and_invert; raises UserError for one that is
        missing, damaged or of another version."""
        file = file_in(path, RESULT)
        try:
            return _ADAPTER.validate_json(file.read_bytes())
        except FileNotFoundError as error:
            raise UserError(f"{file}: there is no such file; birdstrike train-and-invert writes it") from error
        except ValidationError as error:
            raise UserError(f"{file} is damaged or of another version; {AGAIN}") from error

    @property
    def best_answer(self) -> Answer:
        """The best method's answer, the first one's where none is verified."""
        return self.methods[self.best or next(iter(self.methods))]

    @property
    def records(self) -> tuple[str, ...]:
        """Paths of the records, one for each shot."""
        return tuple(shot.path for shot in self.shots) or (self.measured.path,)

    @property
    def simulated_records(self) -> tuple[str, ...]:
        """Of these, those that no instrument took."""
        return tuple(path for path in self.records if any("SIMULATED" in line for line in self.provenance_of(path)))

    def provenance_of(self, path: str) -> tuple[str, ...]:
        """A record's own lines; those of shots inverted together begin with its path, in older files nothing tells
        them apart and each has all.
        """
        lines, begin = self.measured.provenance, f"{path}: "
        if not any(line.startswith(f"{one}: ") for one in self.records for line in lines):
            return lines
        return tuple(line.removeprefix(begin) for line in lines if line.startswith(begin))

    @property
    def headline(self) -> str:
        """The best method's answer: each parameter with its interval, or that it is not identifiable."""
        answer = self.best_answer
        said = []
        for name, one in answer.parameters.items():
            if not one.identified or one.value is None:
                said.append(f"{plain(name, answer.parameters)} not identifiable")
            else:
                ends = f" (95 %: {span(*one.interval_95, one.unit)})" if one.interval_95 else ""
                said.append(f"{plain(name, answer.parameters)} {quantity(one.value, one.unit)}{ends}")
        return f"Inversion by the {self.best or 'methods, none verified'}: {'; '.join(said)}"

    def to_dataframe(self) -> pd.DataFrame:
        """A row for each method and parameter: value, ends of the 95 % interval (SI), whether identified, and why."""
        import pandas as pd

        rows = [
            {
                "method": method,
                "parameter": name,
                "value": np.nan if one.value is None else one.value,
                **ends_95(one.interval_95),
                "unit": one.unit,
                "identified": one.identified,
                "reason": one.reason,
            }
            for method, answer in self.methods.items()
            for name, one in answer.parameters.items()
        ]
        return pd.DataFrame(rows)

    def stored_draws(self, folder: str | Path) -> Path | None:
        """The file of the posterior's draws in the folder of its train_and_invert; None where none was drawn."""
        path = None if self.posterior is None else Path(folder) / self.posterior.draws
        return path if path is not None and path.is_file() else None

    def to_inference_data(self, folder: str | Path) -> InferenceData:
        """The posterior's draws in `folder`, where train_and_invert wrote them, for arviz.

        Group `posterior`, a variable for each dotted key, SI. The file holds draws taken evenly from all chains, hence
        one chain here; R-hat and effective sizes of the chains themselves stand in the attributes. Raises UserError
        where no posterior was drawn.
        """
        figures, draws_file = self.posterior, self.stored_draws(folder)
        if figures is None or draws_file is None:
            raise UserError(
                f"no draws of a posterior in {folder}; repeat train-and-invert with the emulator's posterior"
            )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # arviz announces its next version on import
            import arviz
        table = read_columns(draws_file, list(figures.names), AGAIN)
        draws: dict[str, Any] = {name: values[None] for name, values in table.items()}
        known = {
            "chain_steps": figures.steps,
            "acceptance": figures.acceptance,
            "converged": int(figures.converged),
            **{f"rhat {name}": value for name, value in figures.rhat.items() if value is not None},
            **{f"effective draws {name}": value for name, value in figures.effective.items()},
        }
        return arviz.from_dict(posterior=draws, attrs=known)

    def plot(self, axes: Axes | None = None, **look: Any) -> Axes:
        """Each method's 95 % intervals as shares of the ranges, in the scales of these; hollow: not identifiable."""
        on, names = own_axes(axes), list(self.ranges)
        for number, (method, answer) in enumerate(self.methods.items()):
            for row, name in enumerate(names):
                one = answer.parameters[name]
                place, colour = row + 0.2 * number, f"C{number}"
                ends = [self.fraction(name, end) for end in one.interval_95 or self.ranges[name]]
                on.plot(ends, [place, place], color=colour, alpha=1.0 if one.identified else 0.3, **look)
                if one.value is not None:
                    face = colour if one.identified else "none"
                    on.plot(self.fraction(name, one.value), place, "o", color=colour, markerfacecolor=face)
            on.plot([], [], color=f"C{number}", label=method)
        on.set_yticks(range(len(names)), [plain(name, names) for name in names])
        on.set_xlim(-0.03, 1.03)
        on.set_xlabel("share of the range")
        on.legend(fontsize="small")
        return on

    def draw(self) -> tuple[Any, ...]:
        """The intervals."""
        return (self.plot,)


_ADAPTER = TypeAdapter(Inversion)
