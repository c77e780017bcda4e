"""Reading finished folders: campaign and inversion into Results; what is missing is named with its command."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from birdstrike.data.columns import damaged, read_columns
from birdstrike.data.curves import Measured, read_histories
from birdstrike.data.errors import UserError
from birdstrike.data.formatting import listing, plain, reading, signed_ms
from birdstrike.data.histories import Array, Histories
from birdstrike.data.storage.files import read_json
from birdstrike.data.storage.store import RunStore
from birdstrike.data.units import rounded
from birdstrike.doe.campaign.folder import stored_case
from birdstrike.doe.campaign.results import load_dataset
from birdstrike.inversion.observations.filters import ModelFilter
from birdstrike.inversion.results.estimates import Answer
from birdstrike.inversion.results.ingredients import ShotFigures
from birdstrike.inversion.results.inversion import AGAIN, Inversion
from birdstrike.inversion.train_and_invert import OPTIONS_FILE
from birdstrike.reports.results.parts import Parts, find_parts, invert_again
from birdstrike.reports.results.results import CampaignResults, Convergence, InversionResults, Results, RunSummary

T = TypeVar("T")
Simulated = dict[str, dict[str, Array]]


def of_shot(inversion: Inversion, number: int = 0) -> Inversion:
    """The inversion with the channels of one of its shots alone, on its record's clock; parameters and posterior stay
    those of all shots."""
    if len(inversion.shots) < 2:
        return inversion
    shot, late = inversion.shots[number], _moved(inversion, number)
    own, origin = partial(_own, suffix=shot.suffix), inversion.time_offset
    emulator, measured, identifiability = inversion.emulator, inversion.measured, inversion.identifiability
    residual, predictive = inversion.residual, inversion.prior_predictive
    ends = origin.interval_95
    return replace(
        inversion,
        time_offset=replace(origin, value=origin.value + late, interval_95=ends and (ends[0] + late, ends[1] + late)),
        methods={name: replace(m, channels=own(m.channels)) for name, m in inversion.methods.items()},
        emulator=replace(
            emulator,
            components=own(emulator.components),
            loo_rmse=own(emulator.loo_rmse),
            standardised_rms=own(emulator.standardised_rms),
        ),
        measured=replace(
            measured,
            path=shot.path,
            provenance=inversion.provenance_of(shot.path),
            simulated=shot.path in inversion.simulated_records,
            points=own(measured.points),
            noise=own(measured.noise),
            noise_source=own(measured.noise_source),
            cuts={
                name: {reason: tuple(t + late for t in times) for reason, times in cut.items()}
                for name, cut in own(measured.cuts).items()
            },
            at_rest={name: replace(one, middle=one.middle + late) for name, one in own(measured.at_rest).items()},
            start=measured.start + late,
        ),
        prior_predictive=replace(predictive, nearest_distance=own(predictive.nearest_distance)),
        residual=residual
        and replace(
            residual,
            tau=own(residual.tau),
            fit=own(residual.fit),
            widened=own(residual.widened),
            by_chance=own(residual.by_chance),
        ),
        identifiability=identifiability and replace(identifiability, sobol=own(identifiability.sobol)),
    )


def _moved(inversion: Inversion, number: int) -> float:
    """By how much a record was late [s] when it was laid on the first one's clock."""
    return inversion.shots[number].time_offset - inversion.shots[0].time_offset if number else 0.0


def other_shots(inversion: Inversion) -> tuple[str, ...]:
    """One sentence about each later shot: its record, its error, its clock, and what the page has of it."""
    if len(inversion.shots) < 2 or inversion.best is None:
        return ()
    best = inversion.methods[inversion.best]
    first = f"shot 1, {Path(inversion.shots[0].path).name}"
    return tuple(
        f"shot {number}, {Path(shot.path).name}, was inverted together with {first}: tables and figures are of shot 1, "
        f"but for the curves of shot {number} beside its verification; the {inversion.best}'s verification "
        f"differs from it by {_errors(best, shot)}; its clock is "
        f"ahead of its simulation's by {signed_ms(shot.time_offset)} by its own fit; within noise and the emulator's "
        f"error the model {'can' if shot.inside else 'CANNOT'} produce its curve"
        for number, shot in enumerate(inversion.shots[1:], start=2)
    )


def _own(entries: Mapping[str, T], suffix: str) -> dict[str, T]:
    """The entries of one shot's channels, by their names without its suffix."""
    split = {channel: channel.partition("@") for channel in entries}
    return {name: entries[channel] for channel, (name, sign, number) in split.items() if sign + number == suffix}


def _errors(answer: Answer, shot: ShotFigures) -> str:
    """RMS errors of a shot's channels, `0.1 mm RMS in displacement centre (2 % of the peak)`."""
    said: list[str] = []
    for channel, score in answer.channels.items():
        if channel.endswith(shot.suffix) and score.verified_rmse is not None:
            share = score.verified_relative
            of = "" if share is None else f" ({rounded(100 * share, 2)} % of the peak)"
            name = plain(channel.removesuffix(shot.suffix))
            said.append(f"{reading(score.verified_rmse, score.unit)} RMS in {name}{of}")
    return listing(said) or "an unknown error"


def read_results(source: Path | Parts) -> Results:
    """Campaign and inversion of a folder, or of parts; raises UserError that names every missing part."""
    parts = source if isinstance(source, Parts) else find_parts(source)
    if parts.doe is None or parts.inversion is None:
        raise UserError([*parts.missing], f"{parts.folder} is not ready for a whole report")
    campaign, inverted = read_campaign(parts, parts.doe), read_inversion(parts, parts.inversion)
    if inverted.inversion.case_hash != campaign.dataset.case_hash:
        raise UserError(
            f"{parts.inversion} was made from another campaign (case hash {inverted.inversion.case_hash}) than "
            f"{parts.doe} holds ({campaign.dataset.case_hash}); name its own with --doe, or repeat: "
            f"{invert_again(parts.doe, parts.inversion)}"
        )
    verifications = _verification_summaries(campaign.campaign, inverted)
    passed = inverted.filter
    campaign = campaign if passed is None else replace(campaign, dataset=passed.dataset(campaign.dataset))
    return Results(
        **vars(inverted),
        **{name: value for name, value in vars(campaign).items() if name not in ("folder", "summaries")},
        summaries={**campaign.summaries, **verifications},
        diagnosis=parts.diagnosis,
        other_diagnosis=parts.other_diagnosis,
    )


def read_campaign(parts: Parts, doe: Path) -> CampaignResults:
    """A finished campaign; raises UserError."""
    campaign = read_json(doe / "summary.json")
    return CampaignResults(
        folder=parts.folder,
        doe=doe,
        case=stored_case(doe),
        dataset=load_dataset(doe),
        campaign=campaign,
        summaries=_summaries(doe, campaign),
        failures={f"run {entry['run']}": str(entry["reason"]) for entry in campaign["failed"]},
    )


def read_inversion(parts: Parts, inverted: Path) -> InversionResults:
    """An inversion with its verification; raises UserError."""
    whole = _inversion(inverted / "inversion.json")
    first, *later = (_of_shot(parts, inverted, whole, number) for number in range(max(len(whole.shots), 1)))
    return replace(first, other_shots=other_shots(whole), later=tuple(later))


def _of_shot(parts: Parts, inverted: Path, whole: Inversion, number: int) -> InversionResults:
    """What concerns one shot of an inversion, on its record's clock."""
    inversion, passed = of_shot(whole, number), _filter(inverted, number)
    suffix = whole.shots[number].suffix if whole.shots else ""
    record, simulated = _verification(inverted / "verification.csv", inversion, suffix, _moved(whole, number))
    runs = {method: _verified(parts, inverted, inversion, method, passed, first=not suffix) for method in simulated}
    return InversionResults(
        folder=parts.folder,
        inverted=inverted,
        record=record,
        inversion=inversion,
        simulated=simulated,
        verified={
            method: replace(run, channels=_own(run.channels, suffix), units=_own(run.units, suffix))
            for method, run in runs.items()
        },
        convergence=_convergence(inverted, inversion),
        draws=_draws(inverted, inversion),
        filter=passed,
    )


def _filter(inverted: Path, number: int) -> ModelFilter | None:
    """Of one shot's curves; None without one, and for a folder of a version that did not store it."""
    path = inverted / OPTIONS_FILE
    every = (read_json(path).get("filters") or []) if path.is_file() else []
    own = every[number] if number < len(every) else None
    return None if own is None else ModelFilter(**own)


def _inversion(path: Path) -> Inversion:
    """`inversion.json`, refused when damaged or without a verification."""
    inversion = Inversion.load(path)
    if inversion.best is None:
        raise UserError(f"{path} names no best method: no verification run finished; {AGAIN}")
    return inversion


def _verification(path: Path, inversion: Inversion, suffix: str, late: float) -> tuple[Measured, Simulated]:
    """The record as it was inverted, and the finished methods' values at its times.

    suffix: of its shot's columns; late: by how much its clock is late on that of the file [s], whose rows are the
    instants of all shots.
    """
    best, source = inversion.methods[str(inversion.best)], inversion.measured
    finished = [method for method, answer in inversion.methods.items() if answer.verified_rmse is not None]
    time, measured, simulated = read_verification(path, best, finished, suffix)
    read = np.any([np.isfinite(values) for values in measured.values()], axis=0)
    units = {channel: score.unit for channel, score in best.channels.items()}
    record = {name: values[read] for name, values in measured.items()}
    at_record = {method: {n: values[read] for n, values in own.items()} for method, own in simulated.items()}
    return Measured(time[read] + late, record, {}, units, source.provenance, source.path), at_record


def read_verification(
    path: Path, answer: Answer, methods: Iterable[str] = (), suffix: str = ""
) -> tuple[Array, dict[str, Array], Simulated]:
    """`verification.csv`: instants (r,) [s], the record's channels (r,) SI, and those of each method at these instants.

    answer: of whichever method, for the channels and their units; suffix: of their columns. Raises UserError for a file
    that lacks a column, or in which a record is empty or zero everywhere, or a method has no value.
    """
    columns = {
        (source, channel): f"{source}_{channel}{suffix}_{score.unit}".rstrip("_")
        for source in ("measured", *methods)
        for channel, score in answer.channels.items()
    }
    table = read_columns(path, ["time_s", *columns.values()], AGAIN)
    for (source, _), column in columns.items():
        known = table[column][np.isfinite(table[column])]
        if not len(known) or (source == "measured" and not known.any()):
            raise damaged(path, f"{column} has no value{' other than 0' if len(known) else ''}", AGAIN)
    found: Simulated = {}
    for (source, channel), column in columns.items():
        found.setdefault(source, {})[channel] = table[column]
    return table["time_s"], found.pop("measured"), found


def _verified(
    parts: Parts, inverted: Path, inversion: Inversion, method: str, passed: ModelFilter | None, first: bool
) -> Histories:
    """The verification run with its pictures from the run store, else its curves alone; filtered as they were.

    first: of several shots that of the first one, which the store's key is of; the curves alone are of all.
    """
    key = inversion.methods[method].run if first else None
    stores = (folder / "runs" for folder in (inverted, parts.doe) if folder is not None)
    for runs in stores:
        if key is not None and (found := RunStore(runs).look_up(key)) is not None:
            found = replace(found, summary={**found.summary, "run_key": key})
            return found if passed is None else passed.histories(found)
    path = inverted / f"verified_{method}.csv"
    if not path.is_file():
        raise UserError(f"{path} is missing; repeat: {invert_again(parts.doe or Path('DOE'), inverted)}")
    try:
        return read_histories(path)
    except ValueError as error:
        raise damaged(path, str(error), AGAIN) from error


def _convergence(inverted: Path, inversion: Inversion) -> Convergence | None:
    """The network's convergence, None where no network was trained."""
    if inversion.training is None:
        return None
    columns = ("epoch", "mse", "test_mse")
    table = read_columns(inverted / inversion.training.history, columns, AGAIN)
    return Convergence(*(table[column] for column in columns))


def _draws(inverted: Path, inversion: Inversion) -> dict[str, Array] | None:
    """The posterior's draws, name -> SI; None where none were made or the file was taken away."""
    kept = inversion.stored_draws(inverted)
    if inversion.posterior is None or kept is None:
        return None
    return read_columns(kept, inversion.posterior.names, AGAIN)


def _summaries(doe: Path, campaign: Mapping[str, Any]) -> dict[str, RunSummary]:
    """Summary of every finished run: from the run store, and where that was cleared from the campaign's summary."""
    store, entries = RunStore(doe / "runs"), [one for one in campaign["runs"] if one["status"] == "finished"]
    return {f"run {entry['run']}": {**entry, **(store.summary(entry["key"]) or {})} for entry in entries}


def _verification_summaries(campaign: Mapping[str, Any], inverted: InversionResults) -> dict[str, RunSummary]:
    """Summary of every verification that is no run of the campaign."""
    known = {entry["key"] for entry in campaign["runs"] if entry["status"] == "finished"}
    methods = inverted.inversion.methods
    return {
        f"verification, {method}": run.summary
        for method, run in inverted.verified.items()
        if run.summary and methods[method].run not in known
    }
