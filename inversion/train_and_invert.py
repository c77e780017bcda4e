"""From a campaign's folder and a measured file to an inversion's folder: what `birdstrike train-and-invert` does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from shutil import rmtree
from typing import Any

from birdstrike.data.arguments import as_list, as_names, as_options, as_path, refuse_no_function
from birdstrike.data.curves import Measured, as_measured, only_channels, refuse_twice, write_histories
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import UserError
from birdstrike.data.formatting import many
from birdstrike.data.progress import Progress, part_of, silent
from birdstrike.data.storage.files import withdraw, write_json
from birdstrike.data.storage.out_folder import fills_out
from birdstrike.doe.campaign.run import retry_before
from birdstrike.doe.designs.registry import refuse_seed
from birdstrike.inversion.campaign_shots import One, ShotReader
from birdstrike.inversion.estimation.locate import InversionOptions
from birdstrike.inversion.estimation.mesh_correction import shells_of_a_file
from birdstrike.inversion.estimation.posterior import Sampling
from birdstrike.inversion.estimation.refinement import AUTO, refine
from birdstrike.inversion.estimation.shots import CampaignShot, Joint, joined, with_scatter
from birdstrike.inversion.estimation.verification import write_verification
from birdstrike.inversion.extras import Extras, refuse_values
from birdstrike.inversion.forward import Forward
from birdstrike.inversion.identifiability.summary import DRAWS_FILE, write_draws
from birdstrike.inversion.invert import TRAINING_FILE, InversionOutcome, invert
from birdstrike.inversion.results.inversion import Inversion
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.write import copy_case
from birdstrike.surrogate.files import save_emulator, save_network
from birdstrike.surrogate.inverse_network import refuse_unknown

OPTIONS_FILE = "options.json"
"""Beside inversion.json: what was asked for, so that it can be asked for again, and each shot's filter of the model."""
Record = str | Path | Measured


def case_file(number: int | str) -> str:
    """Name of the file of a shot's case, the shots counted from 1; "*": of all but the first."""
    return "case.toml" if number == 1 else f"case_{number}.toml"


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
    progress: Progress = silent,
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
    refuse_values(more)
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
    share = 0.5 if more.mesh_correction else 0.0
    call = ShotReader(folders, folder, options, more, forward, retry)
    shots = [
        call.shot(*pair, part_of(progress, share * i / len(pairs), share * (i + 1) / len(pairs)))
        for i, pair in enumerate(pairs)
    ]
    _refuse_unused(folders, shots)
    refuse_twice([("--measured", shot.measured) for shot in shots])
    folder.mkdir(parents=True, exist_ok=True)  # an unwritable place is better known before the work than after
    outcome, dataset, record = inverted(shots, more, part_of(progress, share, 1.0))
    _withdraw_earlier(folder)
    _copy_cases(folder, shots)
    asked = {"trainer": trainer, "method": method, "seed": seed, "allow_rank_deficient": allow_rank_deficient}
    sources = _sources(folder, folders, pairs) | {"forward": None if forward is None else _called(forward)}
    write_json(folder / OPTIONS_FILE, asked | sources | {"extras": asdict(more)} | _filters(shots))
    _write(folder, outcome, dataset, record)
    return outcome.inversion


def _withdraw_earlier(folder: Path) -> None:
    """Take back the answer that an earlier call left in the folder, and the cases of its shots."""
    withdraw(folder, "inversion.json", "network.npz", TRAINING_FILE, DRAWS_FILE, "verified_*.csv", case_file("*"))
    for earlier in folder.glob("case_*/"):
        rmtree(earlier, ignore_errors=True)  # what the withdrawn cases name


def _copy_cases(folder: Path, shots: Sequence[CampaignShot]) -> None:
    """The case of every shot, with the files that it names."""
    for number, shot in enumerate(shots, start=1):
        if shot.case is not None:
            name = case_file(number)
            copy_case(shot.case, folder, name, "" if number == 1 else f"{Path(name).stem}/")


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


def _of_filters(shots: Sequence[CampaignShot]) -> tuple[str, ...]:
    """What the user should know of records that were filtered; of several shots each with its file."""
    return tuple(
        f"{shot.measured.path}: {text}" if len(shots) > 1 else text for shot in shots for text in shot.warnings
    )


def _filters(shots: Sequence[CampaignShot]) -> dict[str, Any]:
    """Each shot's filter of the model, where they have one."""
    found = [asdict(shot.filter) for shot in shots if shot.filter is not None]
    return {"filters": found} if found else {}


def _called(function: Any) -> str:
    """Module and name of a function, or of the class of a callable."""
    named = function if hasattr(function, "__qualname__") else type(function)
    return f"{named.__module__}.{named.__qualname__}"


def inverted(
    shots: Sequence[CampaignShot], more: Extras, progress: Progress
) -> tuple[InversionOutcome, Dataset, Measured]:
    """One or several shots, refined if asked for, with the runs and the record that the answer rests on."""
    joint, scatter = Joint.alone(shots[0]), None
    if len(shots) > 1:
        joint, scatter = with_scatter(joined(shots))
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
            progress=part_of(progress, 0.0, share),
        )
    outcome = invert(
        dataset,
        joint.measured,
        joint.verifier,
        joint.options,
        part_of(progress, share, 1.0),
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


def _refuse_unused(folders: Sequence[Path], shots: Sequence[CampaignShot]) -> None:
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
