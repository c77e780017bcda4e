"""The diagnosis of each record, stored beside what it was made of, so that a killed audit goes on record by record."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from birdstrike.data.curves import Measured, read_measured
from birdstrike.data.errors import MachineFailure, RunFailed, UserError
from birdstrike.data.storage.files import file_digest, json_values, write_json
from birdstrike.doe.solvers import content_of
from birdstrike.inversion.audit.draws import BASELINE, SHOTS
from birdstrike.inversion.audit.records import Experiment, read_truth
from birdstrike.inversion.diagnosis.diagnose import diagnose
from birdstrike.inversion.diagnosis.pipeline import DiagnosisOptions
from birdstrike.inversion.results.diagnosis import Diagnosis
from birdstrike.solver.case.case import case_hash, load_case
from birdstrike.solver.version import code_of

STATED = ("time", "sigma", "error")  # columns of the answer's curves from which the signal is measured


def answer_key(experiment: Experiment, options: DiagnosisOptions, noise: int) -> str:
    """What an answer depends on, as 16 hex digits: its records, the whole case, options and code."""
    case = load_case(experiment.case)
    files = [path for path in (*experiment.shots, experiment.baseline, experiment.heldout) if path]
    content = {
        "case": content_of(case),
        "options": options.choices(),
        "noise": noise,
        "drawn_on": read_truth(experiment.truth).curves if noise else {},
        "files": [(path.name, file_digest(path)) for path in files],
        "code": code_of("inversion"),
    }
    return hashlib.sha256(json.dumps(json_values(content), sort_keys=True).encode()).hexdigest()[:16]


def answered(experiment: Experiment, place: Path, options: DiagnosisOptions, noise: int = 0) -> dict[str, Any]:
    """The answer to a record: the content of diagnosis.json under `diagnosis`, or why there is none under `failed`.

    place: folder of the audit, in which the answer is stored, a stored failure tried again where the options ask for a
    retry; noise: 0 for the record as it is, else the number of a further draw of the noise.
    """
    path = place / "answers" / f"{experiment.name}{f'_noise{noise}' if noise else ''}.json"
    try:
        key = answer_key(experiment, options, noise)
    except UserError as error:
        return {"failed": str(error)}
    known = stored(path, key)
    if known is not None and not (options.retry and "failed" in known):
        return known
    found = {"key": key, **_made(experiment, place, options, noise)}
    write_json(path, found)
    return json.loads(path.read_text(encoding="utf-8"))


def stored(path: Path, key: str) -> dict[str, Any] | None:
    """A stored answer; None where there is none, or one that was made of something else."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError):
        return None
    return found if found.get("key") == key else None


def _made(experiment: Experiment, place: Path, options: DiagnosisOptions, noise: int) -> dict[str, Any]:
    """Diagnosed; the simulations lie in one store for all records of one declared case."""
    try:
        case = load_case(experiment.case)
        shots = records(experiment, noise, options.seed)
        clean = () if experiment.baseline is None else (_named(read_measured(experiment.baseline), BASELINE),)
        held = None if experiment.heldout is None else read_measured(experiment.heldout)
        folder = place / "diagnoses" / case_hash(case)
        found = diagnose(case, shots, folder, heldout=held, options=options, baseline=clean)
    except MachineFailure:
        raise
    except (UserError, RunFailed) as error:
        return {"failed": str(error)}
    return {"diagnosis": found.figures(), "stated": stated(found)}


def records(experiment: Experiment, noise: int, seed: int) -> list[Measured]:
    """The shots, named by their order; noise: 0 for the records as they are, else the number of a further draw.

    Raises UserError where a further draw is asked for and the truth has no noise-free curve of a shot.
    """
    found = [_named(read_measured(path), SHOTS[i]) for i, path in enumerate(experiment.shots)]
    if not noise:
        return found
    case, truth = load_case(experiment.case), read_truth(experiment.truth)
    rng = np.random.default_rng([seed, noise, len(experiment.name)])
    if missing := [one.path for one in found if one.path not in truth.curves]:
        raise UserError(f"{experiment.truth} has no noise-free curve of {', '.join(missing)}; use --draws 1")
    return [_redrawn(one, case.sensors, truth.time, truth.curves[one.path], rng) for one in found]


def _redrawn(one: Measured, sensors: Any, time: Any, clean: Any, rng: np.random.Generator) -> Measured:
    """The noise-free curve at the record's instants with other noise; gaps stay gaps."""
    values = {}
    for name, given in one.channels.items():
        level = sensors[name].noise or 0.0
        drawn = np.interp(one.time, time, clean[name]) + level * rng.standard_normal(len(one.time))
        values[name] = np.where(np.isfinite(given), drawn, np.nan)
    return replace(one, channels=values)


def _named(record: Measured, name: str) -> Measured:
    """The record under a name that tells nothing of the experiment, and by which effects of one shot are labelled."""
    return replace(record, path=name)


def stated(found: Diagnosis) -> dict[str, dict[str, dict[str, Sequence[float]]]]:
    """shot -> channel -> instants, noise and error that the answer states."""
    return {
        shot: {name: {key: np.asarray(one[key]).tolist() for key in STATED} for name, one in channels.items()}
        for shot, channels in found.curves.items()
    }
