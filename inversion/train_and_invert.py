"""From a campaign's folder and a measured file to an inversion's folder: what `birdstrike train-and-invert` does."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from numbers import Real
from pathlib import Path
from shutil import rmtree
from typing import Any

import numpy as np

from birdstrike.data.arguments import as_list, as_names, as_options, as_path, refuse_no_function, refuse_other_kinds
from birdstrike.data.curves import (
    Measured,
    as_measured,
    only_channels,
    read_histories,
    refuse_twice,
    write_histories,
)
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import UserError, refuse_not_whole
from birdstrike.data.formatting import many, quantity
from birdstrike.data.histories import Array, Histories
from birdstrike.data.progress import Progress, silent
from birdstrike.data.storage.files import read_json, withdraw, write_json
from birdstrike.data.storage.out_folder import fills_out
from birdstrike.data.storage.store import RunStore
from birdstrike.doe.campaign.folder import CampaignFolder, refusal_of_other_case, stored_case
from birdstrike.doe.campaign.results import load_dataset
from birdstrike.doe.campaign.run import retry_before
from birdstrike.doe.designs.registry import refuse_seed
from birdstrike.inversion.estimation.calibration import Mode
from birdstrike.inversion.estimation.known_errors import (
    Columns,
    NuisanceRuns,
    discrepancy_columns,
    mesh_columns,
    stated_discrepancy,
)
from birdstrike.inversion.estimation.locate import InversionOptions, design_figures, refuse_deficient
from birdstrike.inversion.estimation.mesh_correction import (
    CorrectedCampaign,
    correct_campaign,
    fine_mesh,
    shells_of_a_file,
)
from birdstrike.inversion.estimation.posterior import Sampling
from birdstrike.inversion.estimation.refinement import AUTO, refine, refuse_budget
from birdstrike.inversion.estimation.shots import Joint, Shot, joined, with_scatter
from birdstrike.inversion.estimation.verification import write_verification
from birdstrike.inversion.forward import Forward, StoredSolver
from birdstrike.inversion.identifiability.summary import DRAWS_FILE, write_draws
from birdstrike.inversion.invert import TRAINING_FILE, InversionOutcome, invert
from birdstrike.inversion.observations.filtered_records import FilteredRecord, filtered_by_laboratory, filtered_record
from birdstrike.inversion.observations.filters import FilteredForward, ModelFilter, refuse_class
from birdstrike.inversion.observations.observations import Observations, observe
from birdstrike.inversion.observations.reader import declared_drifts
from birdstrike.inversion.results.inversion import Inversion
from birdstrike.solver.case.case import Case, as_case, case_hash
from birdstrike.solver.case.nuisances import Nuisance, case_nuisances
from birdstrike.solver.case.settings import NUISANCE
from birdstrike.solver.case.write import copy_case
from birdstrike.surrogate.files import save_emulator, save_network
from birdstrike.surrogate.inverse_network import HIDDEN, refuse_unknown

OPTIONS_FILE = "options.json"
"""Beside inversion.json: what was asked for, so that it can be asked for again, and each shot's filter of the model."""
MOST_HIDDEN = 100
"""Neurons of the network."""
One = str | Path
Record = str | Path | Measured


def case_file(number: int | str) -> str:
    """Name of the file of a shot's case, the shots counted from 1; "*": of all but the first."""
    return "case.toml" if number == 1 else f"case_{number}.toml"


@dataclass(frozen=True)
class Extras:
    """What may be asked for beyond one campaign, one record and the paper's network.

    refine: runs that may be added near the answer, "auto" while they pay; hidden: neurons, None searches; copies: noisy
    copies of every training run, None for 10 (0 with linear outputs or an ensemble); discrepancy: a stated slow error
    of the model, share of each channel's peak (1 sigma), None for what the case states by sensor; mesh: curves of a
    mesh study (convergence.csv), whose uncertainty every model then carries;
    filter: a named zero-phase filter for record and model alike; filtered: the one that the laboratory has passed the
    record through, for the model alone; posterior: drawn, with the identifiability's figures; else the intervals are
    linearised; retry_failed: runs with a failure on record are tried again;
    retry: those alone whose failure was stored before this time [s, Unix], where a longer command has taken it;
    channels: of the record that are used, all where none is named; mesh_correction: whether a few simulations on a
    finer mesh correct the campaign's curves; outputs: of the network, "bounded" by the ranges or "linear", the paper's;
    more_runs: the option by which the command that asks adds runs, for messages.
    """

    refine: int | str = AUTO
    hidden: int | None = HIDDEN
    copies: int | None = None
    discrepancy: float | None = None
    mesh: Path | None = None
    filter: str | None = None
    filtered: str | None = None
    posterior: bool = True
    retry_failed: bool = False
    retry: float = 0.0
    channels: str | Sequence[str] = ()
    mesh_correction: bool = False
    outputs: str = "bounded"
    more_runs: str = "--refine N"


@fills_out("train-and-invert")
def train_and_invert(
    doe_dir: One | Sequence[One],
    measured: Record | Sequence[Record],
    out: str | Path,
    trainer: str = "lm",
    method: str = "both",
    case: One | Case | Sequence[One | Case] | None = None,
    forward: Forward | None = None,
    seed: int = 0,
    progress: Progress | None = None,
    allow_rank_deficient: bool = False,
    extras: Extras | None = None,
) -> Inversion:
    """Train on the campaign in `doe_dir`, invert `measured`, verify by the solver, and write everything to `out`.

    Parameters
    ----------
    doe_dir : path or sequence of paths
        Folders of finished campaigns.
    measured : path, Measured, or a sequence of them
        The records; several are inverted together, with the parameters shared.
    out : path
        Folder for inversion.json, verification.csv, verified_<method>.csv, posterior.csv, emulator.npz and, with the
        network, network.npz and training.csv.
    trainer : str
        Of the network: "lm" (Levenberg-Marquardt), "adam", "br" (Bayesian regularisation) or "ensemble".
    method : str
        "network", "emulator" or "both".
    case : path, Case, or a sequence of them, optional
        Case i belongs to record i, and its campaign must be among `doe_dir`; without it all records belong to the one
        campaign.
    forward : callable, optional
        {dotted case key: SI value} -> Histories, in the solver's place.
    seed : int
        Of training, search and sampling.
    progress : callable, optional
        Takes the share of the work that is done, 0..1.
    allow_rank_deficient : bool
        Whether a design that varies fewer directions than parameters gives the combination that it carries.
    extras : Extras, optional
        Refinement, known errors, filter.

    Returns
    -------
    Inversion
        Each method's estimates with 95 % intervals and verified errors, SI; the content of inversion.json.

    Raises
    ------
    UserError
        For what the user can mend: channels, units, times, a deficient design, campaigns of other cases.
    RunFailed
        When no verification run finishes.
    """
    folder, more = as_path("out", out), as_options("extras", extras, Extras)
    more = replace(more, channels=as_names("channels", more.channels))
    refuse_seed(seed)
    _refuse_values(more)
    refuse_no_function("forward", forward, "{dotted case key: SI value} -> Histories")
    folders, cases = [as_path("doe_dir", path) for path in as_list(doe_dir)], as_list(case)
    _refuse_missing(folders, as_list(measured))
    options = _options(trainer, method, seed, allow_rank_deficient, more)
    _refuse_unassigned(folders, cases)
    retry = more.retry or retry_before(more.retry_failed)
    if more.mesh_correction:
        _refuse_second_mesh(more, forward)
    records = only_channels([as_measured(record) for record in as_list(measured)], more.channels)
    pairs = _with_cases(records, cases)
    report, share = progress or silent, 0.5 if more.mesh_correction else 0.0
    call = _Call(folders, folder, options, more, forward, retry)
    shots = [call.shot(*pair, _share(report, i, len(pairs), share)) for i, pair in enumerate(pairs)]
    _refuse_unused(folders, shots)
    refuse_twice([("--measured", shot.measured) for shot in shots])
    folder.mkdir(parents=True, exist_ok=True)  # an unwritable place is better known before the work than after
    outcome, dataset, record = inverted(shots, more, lambda f: report(share + (1.0 - share) * f))
    withdraw(folder, "inversion.json", "network.npz", TRAINING_FILE, DRAWS_FILE, "verified_*.csv", case_file("*"))
    for earlier in folder.glob("case_*/"):
        rmtree(earlier, ignore_errors=True)  # what the withdrawn cases name
    for number, shot in enumerate(shots, start=1):
        if shot.case is not None:
            name = case_file(number)
            copy_case(shot.case, folder, name, "" if number == 1 else f"{Path(name).stem}/")
    asked = {"trainer": trainer, "method": method, "seed": seed, "allow_rank_deficient": allow_rank_deficient}
    sources = _sources(folder, folders, pairs) | {"forward": None if forward is None else _called(forward)}
    write_json(folder / OPTIONS_FILE, asked | sources | {"extras": asdict(more)} | _filters(shots))
    _write(folder, outcome, dataset, record)
    return outcome.inversion


def _options(trainer: str, method: str, seed: int, allow_rank_deficient: bool, more: Extras) -> InversionOptions:
    """How to invert, as far as no case decides it; raises UserError."""
    refuse_unknown(trainer, more.outputs)
    options = InversionOptions(
        trainer=trainer,
        method=method,
        seed=seed,
        allow_rank_deficient=allow_rank_deficient,
        hidden=more.hidden,
        copies=more.copies,
        outputs=more.outputs,
        more_runs=more.more_runs,
        sampling=Sampling() if more.posterior else None,
        analyse=more.posterior,
    )
    if "network" not in options.methods():
        _refuse_network_s(options)
    return options


def _refuse_network_s(options: InversionOptions) -> None:
    """Raises UserError for choices of a network where none is trained."""
    usual = InversionOptions()
    given = [
        name for name in ("trainer", "hidden", "copies", "outputs") if getattr(options, name) != getattr(usual, name)
    ]
    if given:
        raise UserError(
            f"--method {options.method} trains no network, so that {', '.join(f'--{name}' for name in given)} would "
            "change nothing: leave it out, or use --method network or both"
        )


def _sources(out: Path, folders: Sequence[Path], pairs: Sequence[tuple[Measured, Any]]) -> dict[str, Any]:
    """What an inversion was made of, as it was named: None for a record that is no file, and for cases where none was
    given; a case that is no file is named by its copy in `out`."""
    given = any(case is not None for _, case in pairs)
    cases = [
        str(case if isinstance(case, str | Path) else out / case_file(number)) if given else None
        for number, (_, case) in enumerate(pairs, start=1)
    ]
    records = [record.path or None for record, _ in pairs]
    return {"campaigns": [str(folder) for folder in folders], "measured": records, "cases": cases}


def _of_filters(shots: Sequence[Shot]) -> tuple[str, ...]:
    """What the user should know of records that were filtered; of several shots each with its file."""
    return tuple(
        f"{shot.measured.path}: {text}" if len(shots) > 1 else text for shot in shots for text in shot.warnings
    )


def _filters(shots: Sequence[Shot]) -> dict[str, Any]:
    """Each shot's filter of the model, where they have one."""
    found = [asdict(shot.filter) for shot in shots if shot.filter is not None]
    return {"filters": found} if found else {}


def _called(function: Any) -> str:
    """Module and name of a function, or of the class of a callable."""
    named = function if hasattr(function, "__qualname__") else type(function)
    return f"{named.__module__}.{named.__qualname__}"


def inverted(
    shots: Sequence[Shot], more: Extras, progress: Progress | None
) -> tuple[InversionOutcome, Dataset, Measured]:
    """One or several shots, refined if asked for, with the runs and the record that the answer rests on."""
    joint, scatter = Joint.alone(shots[0]), None
    if len(shots) > 1:
        joint, scatter = with_scatter(joined(shots))
    report = progress or silent
    dataset, refinement, share = joint.dataset, None, 0.0
    if more.refine and _refinable(joint.options, more):
        share = 0.6
        dataset, refinement = refine(
            dataset=dataset,
            measured=joint.measured,
            forward=joint.forward,
            options=joint.options,
            runs=more.refine,
            columns=joint.columns,
            progress=lambda f: report(share * f),
        )
    outcome = invert(
        dataset,
        joint.measured,
        joint.verifier,
        joint.options,
        lambda f: report(share + (1.0 - share) * f),
        columns=joint.columns,
    )
    corrections = tuple(shot.mesh_correction for shot in shots if shot.mesh_correction is not None)
    inversion = replace(
        outcome.inversion,
        warnings=(
            *outcome.inversion.warnings,
            *_of_filters(shots),
            *shells_of_a_file(figures.mesh_file for figures in corrections),
        ),
        refinement=refinement,
        shots=joint.figures,
        shot_scatter=scatter,
        known_errors=joint.known_errors,
        mesh_correction=corrections,
    )
    return replace(outcome, inversion=inversion), dataset, joint.measured


def _refuse_values(more: Extras) -> None:
    """Raises UserError for numbers that the command refuses too, and a Python call may give."""
    if more.copies is not None:
        refuse_not_whole("copies", more.copies, "leave it out for 10", least=0)
    if more.hidden is not None:
        refuse_not_whole("hidden", more.hidden, "None searches for it", least=1)
        if more.hidden > MOST_HIDDEN:
            raise UserError(f"hidden = {more.hidden} is above {MOST_HIDDEN}; None searches for it")
    refuse_budget(more.refine)
    share = more.discrepancy
    if share is not None and (not isinstance(share, Real) or not 0.0 <= share <= 1.0):
        raise UserError(
            f"discrepancy = {share!r} is outside 0 .. 1: it is a share of each channel's peak (1 sigma), such as 0.02"
        )
    refuse_other_kinds(more)
    _refuse_filters(more)


def _refuse_filters(more: Extras) -> None:
    """Raises UserError for an unknown class, and for a record that would be filtered twice."""
    for option in ("filter", "filtered"):
        if (name := getattr(more, option)) is not None:
            refuse_class(option, name)
    if more.filter and more.filtered:
        raise UserError(
            f"filter = {more.filter} and filtered = {more.filtered} were both given: a record that the laboratory has "
            "filtered would be filtered twice, the model once; leave one out"
        )


def _share(report: Progress, part: int, parts: int, whole: float) -> Progress:
    """The progress of one of several equal parts that together are a share of the work."""
    return lambda f: report(whole * (part + f) / parts)


def _refinable(options: InversionOptions, more: Extras) -> bool:
    """Whether runs may be added: `auto` does so only for the emulator's answer."""
    return more.refine != AUTO or "emulator" in options.methods()


def _refuse_missing(folders: Sequence[Path], records: Sequence[Record]) -> None:
    """Raises UserError without a campaign or without a record."""
    if not folders or not records:
        missing = "--measured" if folders else "the campaign's folder"
        raise UserError(f"{missing} is missing: give one, or several, each with its --case")


def _refuse_unassigned(folders: Sequence[Path], cases: Sequence[Any]) -> None:
    """Raises UserError for several campaigns of which nothing says which record is whose."""
    if len(folders) > 1 and not cases:
        raise UserError(
            f"{len(folders)} campaign folders were given and no --case: say which record belongs to which campaign by "
            "--case, once for each --measured in their order (a campaign's own is DOE/case.toml)"
        )


def _with_cases(records: list[Any], cases: list[Any]) -> list[tuple[Any, Any]]:
    """Each record with its case, None for the campaign's own; raises UserError."""
    if cases and len(cases) != len(records):
        raise UserError(
            f"{many(len(records), 'record')} (--measured) and {many(len(cases), 'case')} (--case): give each record "
            "its case, or none"
        )
    return list(zip(records, cases or [None] * len(records), strict=True))


def _refuse_unused(folders: Sequence[Path], shots: Sequence[Shot]) -> None:
    """Raises UserError for a campaign that explains no record: it would change nothing, unseen."""
    used = {shot.campaign for shot in shots}
    if unused := [str(folder) for folder in folders if folder not in used]:
        raise UserError(
            f"no record uses the campaign in {', '.join(unused)}: give its case by --case, or leave the folder out"
        )


def _refuse_second_mesh(more: Extras, forward: Forward | None) -> None:
    """Raises UserError where a mesh correction cannot be had, or would count the mesh's error twice."""
    if more.mesh is not None:
        raise UserError(
            "--mesh and --mesh-correction were both given: the correction takes the place of the mesh's uncertainty, "
            "so leave one out"
        )
    if forward is not None:
        raise UserError("--mesh-correction refines the mesh of the case's own solver, so no other model may stand in")


def _bands(path: Path) -> Histories:
    """Curves and bands of a mesh study; raises UserError for any other file."""
    try:
        study = read_histories(path)
    except (OSError, ValueError, IndexError) as error:
        raise UserError(f"--mesh: {path} is no convergence.csv of birdstrike converge ({error})") from error
    if not any(name.endswith("_uncertainty") for name in study.channels):
        raise UserError(f"--mesh: {path} is no convergence.csv of birdstrike converge (no column of an uncertainty)")
    return study


@dataclass(frozen=True)
class _Call:
    """What the shots of one call share.

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

    def shot(self, read: Measured, case: One | Case | None, progress: Progress) -> Shot:
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
        return Shot(
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


def _write(folder: Path, outcome: InversionOutcome, dataset: Dataset, measured: Measured) -> None:
    """All files of an answer; the JSON last, so that its presence means the rest is there and is of this answer."""
    inversion = outcome.inversion
    save_emulator(folder / "emulator.npz", outcome.emulator, dataset)
    if outcome.network is not None:
        save_network(folder / "network.npz", outcome.network.network)
        outcome.network.training.write(folder / TRAINING_FILE)
    if outcome.posterior is not None:
        write_draws(folder / DRAWS_FILE, outcome.posterior, dataset.names)
    for method, verification in outcome.verified.items():
        if verification.histories is not None:
            write_histories(folder / f"verified_{method}.csv", verification.histories)
    t0 = inversion.time_offset.value
    write_verification(folder / "verification.csv", measured, outcome.observations, outcome.verified, t0)
    inversion.save(folder / "inversion.json")
