"""What a comparison of bird models tells: each by its probability of being the best, with draws of its posterior."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from birdstrike.data.curves import Measured, read_histories, read_measured
from birdstrike.data.errors import UserError
from birdstrike.data.histories import Histories
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.conditions import conditions
from birdstrike.inversion.estimation.known_errors import DISCREPANCY_LENGTH
from birdstrike.inversion.identifiability.summary import DRAWS_FILE
from birdstrike.inversion.prediction.from_inversion import NO_SAMPLE, rough_draws
from birdstrike.inversion.prediction.learnt import (
    Explanation,
    Learnt,
    LearntShot,
    SensorError,
    amplitudes,
    read_results,
)
from birdstrike.solver.case.case import Case, load_case

LEAST = 0.02  # probability of being the best below which a model is left out


def read_models(folder: Path) -> Learnt:
    """What a calibrate-models' folder tells; raises UserError for one without draws."""
    content = read_results(folder / "models.json")
    shares = {name: float(content["models"][name].get("probability_best") or 0.0) for name in content["ranking"]}
    kept = [name for name, share in shares.items() if share >= LEAST] or list(content["ranking"][:1])
    if not kept:
        raise UserError(f"--from {folder}: no model was ranked; models.json says why under each model")
    rough = [name for name in kept if not (folder / name / DRAWS_FILE).is_file()]
    names = list(content["records"])
    cases = {name: load_case(folder / kept[0] / name / "case.toml") for name in names}
    shots = tuple(LearntShot(name, conditions(cases[name]), _errors(folder, name, kept, cases[name])) for name in names)
    whole = sum(shares[name] for name in kept)
    explanations = tuple(
        _explanation(folder, name, shares[name] / whole if whole else 1.0 / len(kept), shots, content) for name in kept
    )
    said = (
        f"{len(kept)} bird models by their probability of being the best ({', '.join(kept)}), up to 2000 draws of each "
        f"from its posterior ({DRAWS_FILE})",
        "no missing effect was looked for: run diagnose to have the explanations averaged",
    )
    return Learnt(
        "calibrate-models",
        folder,
        cases[names[0]],
        shots,
        explanations,
        corrected=False,
        diagnosed=False,
        said=said,
        warnings=(*content.get("warnings", ()), *(f"{name}: {NO_SAMPLE}" for name in rough)),
    )


def _explanation(
    folder: Path, name: str, share: float, shots: tuple[LearntShot, ...], content: Mapping[str, Any]
) -> Explanation:
    keys = tuple(content["models"][name]["parameters"])
    file = folder / name / DRAWS_FILE
    own_case = load_case(folder / name / shots[0].name / "case.toml")
    table = pd.read_csv(file) if file.is_file() else _rough(content["models"][name], own_case)
    draws = table[list(keys)].to_numpy(float)
    n = len(draws)
    shared, own = amplitudes(shots, name, {}, n, np.random.default_rng(0))
    return Explanation(
        name,
        share,
        keys,
        draws,
        magnitudes=np.zeros((n, 0)),
        amplitude=shared,
        own=own,
        material=own_case.table["bird"]["material"],
    )


def _rough(answer: Mapping[str, Any], case: Case) -> pd.DataFrame:
    """Where no sample is stored; case: with the ranges."""
    space = ParameterSpace.of_case(case)
    intervals = {key: (one["value"], one["interval_95"]) for key, one in answer["parameters"].items()}
    return pd.DataFrame(rough_draws(space, intervals, 0), columns=list(space.names))


def _errors(folder: Path, shot: str, models: list[str], case: Case) -> dict[str, SensorError]:
    record = read_measured(folder / "records" / f"{shot}.csv")
    runs = {name: read_histories(folder / name / f"calibrated_{shot}.csv") for name in models}
    return {
        sensor: _error(sensor, record, runs, case)
        for sensor in case.sensors
        if sensor in record.channels and all(sensor in run.channels for run in runs.values())
    }


def _error(sensor: str, record: Measured, runs: Mapping[str, Histories], case: Case) -> SensorError:
    end = min(float(run.time[-1]) for run in runs.values())
    values = record.channels[sensor]
    kept = np.isfinite(values) & (record.time <= end)
    times = record.time[kept]
    residual = {name: values[kept] - np.interp(times, run.time, run.channels[sensor]) for name, run in runs.items()}
    first = next(iter(residual.values()))
    noise = case.sensors[sensor].noise or float(np.median(np.abs(np.diff(first))) / 0.954)
    return SensorError(
        times - case.first_contact,
        residual,
        np.full(len(times), noise),
        float(np.abs(values[kept]).max()),
        DISCREPANCY_LENGTH * case.time.end,
        np.array([0.0, case.time.end]) - case.first_contact,
        np.ones(2),
        case.sensors[sensor].kind,
    )
