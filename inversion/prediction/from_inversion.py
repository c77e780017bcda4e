"""What a prediction takes from a calibration: draws of its posterior, residuals of its verification run."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import truncnorm

from birdstrike.data.columns import read_own_table
from birdstrike.data.errors import UserError
from birdstrike.data.formatting import plain
from birdstrike.data.histories import Array
from birdstrike.doe.campaign.folder import stored_case
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.conditions import conditions
from birdstrike.inversion.estimation.prior import NormalPrior
from birdstrike.inversion.estimation.shots import suffix
from birdstrike.inversion.prediction.learnt import (
    Explanation,
    Learnt,
    LearntShot,
    SensorError,
    amplitudes,
    calibrated_error,
)
from birdstrike.inversion.results.estimates import Estimate
from birdstrike.inversion.results.inversion import AGAIN, Inversion
from birdstrike.inversion.train_and_invert import OPTIONS_FILE, case_file
from birdstrike.solver.case.case import Case, case_hash, load_case
from birdstrike.surrogate.files import read_region
from birdstrike.surrogate.gaussian_process import NORMAL_95

CALIBRATED, EMULATOR = "calibrated", "emulator"
DRAWN = 400  # where no sample is stored
NO_SAMPLE = (
    "no posterior is stored: independent normal distributions from the 95 % intervals, and the prior in the searched "
    "range of what is not identified; correlations are lost"
)


def read_inversion(folder: Path) -> Learnt:
    """What a prediction takes from the folder of train-and-invert; raises UserError for one that is incomplete."""
    found = Inversion.load(folder / "inversion.json")
    missing = [name for name in ("case.toml", "verification.csv") if not (folder / name).is_file()]
    if missing or found.best is None:
        lacking = ", ".join(missing) if missing else "a verified answer"
        raise UserError(f"--from {folder}: it lacks {lacking}; repeat train-and-invert with the campaign's case")
    first = stored_case(folder)
    cases, warned = _cases(folder, first, found)
    table = read_own_table(folder / "verification.csv", ["time_s"], AGAIN)
    method = _method(folder, found, table)
    shots = [
        LearntShot(f"shot {i + 1}", conditions(case), _errors(table, method, suffix(i), case, found))
        for i, case in cases
    ]
    names, draws, said, warnings = _posterior(folder, found, first, method)
    n = len(draws)
    rng = np.random.default_rng(found.seed)
    shared, own = amplitudes(shots, CALIBRATED, first.inversion.discrepancy, n, rng)
    one = Explanation(CALIBRATED, 1.0, names, draws, magnitudes=np.zeros((n, 0)), amplitude=shared, own=own)
    effects = "no missing effect was looked for: run diagnose to have the explanations averaged"
    return Learnt(
        "train-and-invert",
        folder,
        first,
        tuple(shots),
        (one,),
        corrected=bool(found.mesh_correction),
        diagnosed=False,
        said=(said, effects),
        warnings=(*warned, *warnings),
    )


def _cases(folder: Path, first: Case, found: Inversion) -> tuple[list[tuple[int, Case]], list[str]]:
    """Number and case of each shot, and a warning for each whose case is not to be had as it was inverted with."""
    cases, warned = [(0, first)], list[str]()
    for i, shot in enumerate(found.shots[1:], start=1):
        held = (one for one in _candidates(folder, first, i) if shot.case_hash in ("", case_hash(one)))
        if (case := next(held, None)) is not None:
            cases.append((i, case))
            continue
        warned.append(
            f"the case of shot {i + 1} (hash {shot.case_hash}) is gone or was edited: its record is left out of the "
            f"distance and the model error; repeat train-and-invert, which keeps it as {folder / case_file(i + 1)}"
        )
    return cases, warned


def _candidates(folder: Path, first: Case, number: int) -> Iterator[Case]:
    """Cases that may be that of a shot: the stored one, then, of an earlier version, the first shot's, those of the
    campaigns, and the file that was named."""
    try:
        asked: Mapping[str, Any] = json.loads((folder / OPTIONS_FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        asked = {}
    named = [*asked.get("cases", [])][number : number + 1]
    campaigns = [Path(campaign) / "case.toml" for campaign in asked.get("campaigns", [])]
    places = [folder / case_file(number + 1), None, *campaigns, *(one for one in named if one is not None)]
    for place in places:
        with suppress(UserError):
            if place is None:
                yield first
            elif Path(place).is_file():
                yield load_case(place)


def _method(folder: Path, found: Inversion, table: pd.DataFrame) -> str:
    """Whose draws and whose residual are taken, which belong together.

    The emulator's, where its posterior is stored and its answer is verified, else the best one's.
    """
    if found.stored_draws(folder) is not None and any(column.startswith(f"{EMULATOR}_") for column in table):
        return EMULATOR
    assert found.best is not None
    return found.best


def _posterior(
    folder: Path, found: Inversion, case: Case, method: str
) -> tuple[tuple[str, ...], Array, str, list[str]]:
    """Dotted keys, draws (n, k) SI of a method's answer, what was used, warnings."""
    names = tuple(found.ranges)
    figures, kept = found.posterior, found.stored_draws(folder)
    if method == EMULATOR and figures is not None and kept is not None:
        draws = read_own_table(kept, list(names), AGAIN)[list(names)].to_numpy(float)
        unsettled = [] if figures.converged else ["the posterior's chains had not settled: the bands are rough"]
        return names, draws, f"{len(draws)} draws of the emulator's posterior ({figures.draws})", unsettled
    answer = found.methods[method]
    vague = [plain(name, names) for name in names if not answer.parameters[name].identified]
    text = NO_SAMPLE + (f" (prior: {', '.join(vague)})" if vague else "")
    remedy = (
        "where the records allow, train-and-invert stores one: by --method emulator or both, without --no-posterior"
    )
    space, emulator = ParameterSpace.of_case(case), folder / "emulator.npz"
    own = method == EMULATOR and emulator.is_file()  # a network seeks over the whole ranges
    searched = read_region(emulator) if own else np.stack([space.lows, space.highs])
    prior = NormalPrior.of(case.priors, space)
    return space.names, rough_draws(space, answer.parameters, searched, prior, found.seed), text, [f"{text}; {remedy}"]


def rough_draws(
    space: ParameterSpace, estimates: Mapping[str, Estimate], searched: Array, prior: NormalPrior, seed: int
) -> Array:
    """(n, k) independent draws, SI, inside the box (2, k) in which an answer was sought.

    In the scale of the range: normal from value and 95 % interval where the parameter is identified, else from the
    prior.
    """
    rng, limits = np.random.default_rng(seed), space.to_unit(searched)
    draws = prior.draw(rng, limits, (DRAWN, len(space.names)))
    places = space.to_unit(np.array([_ends(estimates[name]) for name in space.names]).T)
    for j in np.flatnonzero(np.isfinite(places).all(axis=0)):
        mean, low, high = places[:, j]
        draws[:, j] = mean
        sd = (high - low) / (2.0 * NORMAL_95)
        if sd > 0.0:
            draws[:, j] = truncnorm.rvs(*(limits[:, j] - mean) / sd, mean, sd, size=DRAWN, random_state=rng)
    return np.clip(space.to_physical(draws), *searched)


def _ends(one: Estimate) -> tuple[float, float, float]:
    """Value and 95 % interval, SI, of an identified parameter; NaN of another."""
    if not one.identified or one.value is None or one.interval_95 is None:
        return np.nan, np.nan, np.nan
    return one.value, *one.interval_95


def _errors(table: pd.DataFrame, method: str, ending: str, case: Case, known: Inversion) -> dict[str, SensorError]:
    """Of one shot's sensors that the verification holds, at the points that the fit used."""
    time, own = table["time_s"].to_numpy(float), known.measured
    since = time - known.time_offset.value - case.first_contact
    found: dict[str, SensorError] = {}
    for name, sensor in case.sensors.items():
        label = f"{name}{ending}_{sensor.unit}".rstrip("_")
        if f"measured_{label}" not in table or f"{method}_{label}" not in table:
            continue
        measured, model = (table[f"{start}_{label}"].to_numpy(float) for start in ("measured", method))
        used, noise = own.used(name + ending, time, measured), own.known_noise(name + ending)
        fitted = np.where(used, measured, np.nan)
        found[name] = calibrated_error(case, name, since, fitted, {CALIBRATED: model}, noise)
    return found
