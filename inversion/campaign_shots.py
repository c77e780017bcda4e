"""The shots of an inversion: each record with the campaign of its case, forward model, filter and known errors."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from birdstrike.data.curves import Measured, read_histories
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import UserError
from birdstrike.data.formatting import quantity
from birdstrike.data.histories import Array, Histories
from birdstrike.data.progress import Progress
from birdstrike.data.storage.files import read_json
from birdstrike.data.storage.store import RunStore
from birdstrike.doe.campaign.folder import CampaignFolder, refusal_of_other_case, stored_case
from birdstrike.doe.campaign.results import load_dataset
from birdstrike.inversion.estimation.calibration import Mode
from birdstrike.inversion.estimation.known_errors import (
    Columns,
    NuisanceRuns,
    discrepancy_columns,
    mesh_columns,
    stated_discrepancy,
)
from birdstrike.inversion.estimation.locate import InversionOptions, design_figures, refuse_deficient
from birdstrike.inversion.estimation.mesh_correction import CorrectedCampaign, correct_campaign, fine_mesh
from birdstrike.inversion.estimation.shots import CampaignShot
from birdstrike.inversion.extras import Extras
from birdstrike.inversion.forward import Forward, StoredSolver
from birdstrike.inversion.observations.expected import declared_drifts
from birdstrike.inversion.observations.filtered_records import FilteredRecord, filtered_by_laboratory, filtered_record
from birdstrike.inversion.observations.filters import FilteredForward, ModelFilter
from birdstrike.inversion.observations.observations import Observations, observe
from birdstrike.solver.case.case import Case, as_case, case_hash
from birdstrike.solver.case.nuisances import Nuisance, case_nuisances
from birdstrike.solver.case.settings import NUISANCE

One = str | Path


@dataclass(frozen=True)
class ShotReader:
    """Reads the shots of one call, which share campaigns, solvers and what was asked for.

    folders: of the campaigns; out: where new runs go; forward: in the solver's place; retry: see Extras; solvers: those
    that were made, by their case's hash and filter.
    """

    folders: list[Path]
    out: Path
    options: InversionOptions
    more: Extras
    forward: Forward | None
    retry: float
    solvers: dict[tuple[str, ModelFilter | None], Forward] = field(default_factory=dict)

    def solver(self, case: Case, passed: ModelFilter | None = None) -> Forward:
        """The forward model of a case with its curves filtered, one for all shots that share both."""
        key = ("" if self.forward else case_hash(case), passed)
        return self.solvers.setdefault(key, self._solver(case, passed))

    def _solver(self, case: Case, passed: ModelFilter | None) -> Forward:
        """Runs of all campaigns are at hand."""
        stores = tuple(RunStore(folder / "runs") for folder in self.folders)
        run: Forward = self.forward or StoredSolver(case, RunStore(self.out / "runs"), stores, retry=self.retry)
        return run if passed is None else FilteredForward(run, passed)

    def _filtered(self, read: Measured, dataset: Dataset, options: InversionOptions) -> FilteredRecord | None:
        """The record through the filter, or as one that the laboratory has filtered; None without a filter."""
        if self.more.filter:
            return filtered_record(read, self.more.filter, dataset, options.noise, options.time_offset)
        return filtered_by_laboratory(read, self.more.filtered, dataset, options.noise) if self.more.filtered else None

    def shot(self, read: Measured, case: One | Case | None, progress: Progress) -> CampaignShot:
        """A record with the campaign of its case."""
        dataset, base, campaign = _campaign(self.folders, case)
        dataset = replace(dataset, drifts=declared_drifts(base))
        options = self.options.of_case(base)
        filtered = self._filtered(read, dataset, options)
        passed = None if filtered is None else filtered.filter
        if filtered is not None:
            dataset, read = filtered.filter.dataset(dataset), filtered.measured
        solver = self.solver(base, passed)
        nuisances, shares = case_nuisances(base), stated_discrepancy(base, read.channels, self.more.discrepancy)
        bands = _bands(self.more.mesh) if self.more.mesh else None
        known_errors = _in_words(base, nuisances, shares, self.more)
        corrected = verifier = None
        if self.more.mesh_correction:
            refuse_uncorrectable(dataset, read, base, options)
            fine = fine_mesh(base, base)
            verifier = self.solver(fine, passed)
            corrected = correct_campaign(dataset, verifier, fine, [*read.channels], progress, options.seed)
            dataset = corrected.dataset
        columns = _error_columns(dataset, NuisanceRuns(solver, nuisances), shares, bands, corrected, filtered)
        return CampaignShot(
            dataset=dataset,
            measured=read,
            forward=solver if corrected is None else corrected.forward(solver),
            options=options,
            columns=columns if known_errors or (filtered is not None and filtered.baselines) else None,
            known_errors=known_errors,
            campaign=campaign,
            verifier=verifier,
            mesh_correction=None if corrected is None else corrected.figures,
            case=base,
            filter=passed,
            warnings=() if filtered is None else filtered.warnings,
        )


def _bands(path: Path) -> Histories:
    """Curves and bands of a mesh study; raises UserError for any other file."""
    try:
        study = read_histories(path)
    except (OSError, ValueError, IndexError) as error:
        raise UserError(f"--mesh: {path} is no convergence.csv of birdstrike converge ({error})") from error
    if not any(name.endswith("_uncertainty") for name in study.channels):
        raise UserError(f"--mesh: {path} is no convergence.csv of birdstrike converge (no column of an uncertainty)")
    return study


def _error_columns(
    dataset: Dataset,
    moved: NuisanceRuns,
    shares: Mapping[str, float],
    bands: Histories | None,
    corrected: CorrectedCampaign | None,
    filtered: FilteredRecord | None,
) -> Columns:
    """The known errors of a shot's model and of its record's rest as columns, one standard deviation each."""

    def columns(observations: Observations, mode: Mode) -> Array:
        parts = [moved.columns(observations, dataset.named(mode.theta), mode.t0)]
        parts += [discrepancy_columns(shares, observations)] if shares else []
        parts += [mesh_columns(bands, observations, mode.t0)] if bands else []
        parts += [corrected.columns(observations, mode)] if corrected else []
        parts += [filtered.rest_columns(observations)] if filtered else []
        return np.hstack(parts)

    return columns


def _in_words(case: Case, nuisances: Sequence[Nuisance], shares: Mapping[str, float], more: Extras) -> tuple[str, ...]:
    """The errors that every model of a shot carries."""
    sentences = [
        f"uncertain {n.name}: ± {quantity(case.inversion.nuisance[n.name], NUISANCE[n.name].unit)} "
        "(2 simulations at the first best fit)"
        for n in nuisances
    ]
    sentences += [f"a stated discrepancy of {100 * share:g} % of the peak of {name}" for name, share in shares.items()]
    sentences += [f"the mesh's uncertainty from {more.mesh}"] if more.mesh else []
    sentences += ["what the mesh correction leaves uncertain"] if more.mesh_correction else []
    return tuple(sentences)


def refuse_uncorrectable(dataset: Dataset, measured: Measured, case: Case, options: InversionOptions) -> None:
    """Raises UserError for what the inversion would refuse as well, before the fine simulations are paid for."""
    observe(measured, dataset, options.noise, options.time_offset)
    refuse_deficient(design_figures(dataset), options.allow_rank_deficient)
    if case.solver.name == "external":
        raise UserError(
            f"--mesh-correction: {case.name} is simulated by another program, whose deck has a mesh of its own; "
            "calibrate without it"
        )


def _campaign(folders: list[Path], case: One | Case | None) -> tuple[Dataset, Case, Path]:
    """The campaign that was run for a case, and its folder; raises UserError when none was."""
    datasets = [load_dataset(folder) for folder in folders]
    if case is not None and len(folders) > 1:
        given = as_case(case)
        for folder, dataset in zip(folders, datasets, strict=True):
            if case_hash(given) == dataset.case_hash:
                return dataset, campaign_case(folder, dataset, given), folder
    return datasets[0], campaign_case(folders[0], datasets[0], case), folders[0]


def campaign_case(doe: Path, dataset: Dataset, case: str | Path | Case | None) -> Case:
    """The case that the campaign varied; raises UserError when the given one is another."""
    given = stored_case(doe) if case is None else as_case(case)
    if case_hash(given) == dataset.case_hash:
        if other := CampaignFolder(doe).other_sources(given):
            warnings.warn(
                f"the campaign in {doe} was run with other sources of {other}, from an installed package: its curves "
                "are those of the old ones; repeat run-doe to make them anew",
                stacklevel=2,
            )
        return given
    differing = refusal_of_other_case(read_json(doe / "case.json"), given)
    raise UserError(
        f"the campaign in {doe} was run for another case (hash {dataset.case_hash}) than {given.name} "
        f"(hash {case_hash(given)}): its curves cannot explain this one's measurement; make a campaign of this "
        "case with birdstrike run-doe" + (f". It is {differing}" if differing else "")
    )
