"""What a prediction takes from a comparison of bird models: probabilities of being the best, posterior draws."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from birdstrike.data.curves import read_histories, read_measured
from birdstrike.data.errors import UserError
from birdstrike.data.formatting import listing
from birdstrike.doe.campaign.folder import stored_case
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.conditions import conditions
from birdstrike.inversion.estimation.prior import NormalPrior
from birdstrike.inversion.identifiability.summary import DRAWS_FILE
from birdstrike.inversion.models.ranking import misses
from birdstrike.inversion.models.results import (
    COMPARISON,
    ModelAnswer,
    ModelComparison,
    emulator_notes,
    read_comparison,
)
from birdstrike.inversion.models.warning_summary import summarised, warnings_of
from birdstrike.inversion.prediction.from_inversion import NO_SAMPLE, rough_draws
from birdstrike.inversion.prediction.learnt import (
    Explanation,
    Learnt,
    LearntShot,
    SensorError,
    amplitudes,
    calibrated_error,
)
from birdstrike.inversion.results.ingredients import MeasuredFigures
from birdstrike.solver.case.case import Case
from birdstrike.surrogate.files import read_region

LEAST = 0.02  # probability of being the best below which a model is left out


def read_models(folder: Path, model: str = "") -> Learnt:
    """From the folder of calibrate-models; model: this one alone. Raises UserError where none, or not it, is ranked."""
    comparison = read_comparison(folder, model)
    shares = {name: comparison.models[name].probability_best or 0.0 for name in comparison.ranking}
    likely = [name for name, share in shares.items() if share >= LEAST] or list(comparison.ranking[:1])
    kept = [model] if model else likely
    rough = [name for name in kept if not (folder / name / DRAWS_FILE).is_file()]
    names = list(comparison.records)
    cases = {name: stored_case(folder / kept[0] / name) for name in names}
    shots = tuple(
        LearntShot(name, conditions(cases[name]), _errors(folder, name, kept, cases[name], comparison.measured[name]))
        for name in names
    )
    whole = sum(shares[name] for name in kept)
    explanations = tuple(
        _explanation(folder, comparison.models[name], shares[name] / whole if whole else 1.0 / len(kept), shots)
        for name in kept
    )
    stored = [name for name in kept if name not in rough]
    said = (
        *([_alone(kept[0], shares, comparison.models)] if len(kept) == 1 else []),
        *([f"up to 2000 draws of {listing(stored)} from the posterior ({DRAWS_FILE})"] if stored else []),
        *([f"{listing(rough)}: {NO_SAMPLE}"] if rough else []),
        "the bird's material is each model's own; what the new case states of it is not used",
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
        set_size=len(kept) if len(kept) > 1 else 0,
        set_said=_several(kept, comparison.models),
        warnings=(*_warnings(comparison, kept), *(f"{name}: {NO_SAMPLE}" for name in rough)),
    )


def _alone(name: str, shares: Mapping[str, float], models: Mapping[str, ModelAnswer]) -> str:
    best = f"probability of being the best {100 * shares[name]:.0f} %"
    return f"the bird model {name} alone (held-out error {_heldout(models[name])}, {best})"


def _several(kept: Sequence[str], models: Mapping[str, ModelAnswer]) -> str:
    shown = ", ".join(f"{name}: held-out error {_heldout(models[name])}" for name in kept)
    return f"bird models by their probability of being the best ({shown})"


def _heldout(model: ModelAnswer) -> str:
    return f"{model.error[0]:.2f} times the noise"


def _warnings(comparison: ModelComparison, kept: Sequence[str]) -> Iterator[str]:
    """Those of the comparison as a whole, then those of the models that are used, and of no other."""
    own = warnings_of(comparison.models, comparison.ranking)
    of_models = summarised(own)
    first = comparison.ranking[0]
    for name in kept:
        _, interval = comparison.models[name].error
        if first not in kept and misses(interval):
            yield (
                f"{name} leaves {interval[0]:.3g} .. {interval[1]:.3g} times the noise (95 %) in what it was not "
                f"calibrated to; the best model of {COMPARISON} is {first}"
            )
    yield from (line for line in comparison.warnings if line not in of_models)
    yield from summarised({name: own[name] for name in kept})


def _explanation(folder: Path, model: ModelAnswer, share: float, shots: tuple[LearntShot, ...]) -> Explanation:
    name, keys = model.name, tuple(model.parameters)
    file = folder / name / DRAWS_FILE
    own_case = stored_case(folder / name / shots[0].name)
    table = pd.read_csv(file) if file.is_file() else _rough(folder / name, model, own_case)
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


def _rough(folder: Path, model: ModelAnswer, case: Case) -> pd.DataFrame:
    """Where no sample is stored; case: with the ranges."""
    space = ParameterSpace.of_case(case)
    if emulator_notes(folder) is None:
        raise UserError(
            f"{folder}: no emulator, or one of an earlier version; repeat calibrate-models with the same --out, whose "
            "simulations are stored"
        )
    searched = read_region(_present(folder.parent, folder / "emulator.npz"))
    prior = NormalPrior.of(case.priors, space)
    return pd.DataFrame(rough_draws(space, model.parameters, searched, prior, 0), columns=list(space.names))


def _errors(folder: Path, shot: str, models: list[str], case: Case, figures: MeasuredFigures) -> dict[str, SensorError]:
    """Of one shot's sensors at the points by which the models' errors are told.

    On the record's clock the likeliest model's run begins at its time origin.
    """
    record = read_measured(_present(folder, folder / "records" / f"{shot}.csv"))
    fitted = figures.fitted(figures.above_rest(record)).channels
    runs = {name: read_histories(_present(folder, folder / name / f"calibrated_{shot}.csv")) for name in models}
    contact = float(runs[models[0]].time[0]) + case.first_contact
    kept = record.time <= min(float(run.time[-1]) for run in runs.values())
    time, found = record.time[kept], dict[str, SensorError]()
    for sensor in case.sensors:
        if sensor in fitted and all(sensor in run.channels for run in runs.values()):
            curves = {name: np.interp(time, run.time, run.channels[sensor]) for name, run in runs.items()}
            noise = figures.known_noise(sensor)
            found[sensor] = calibrated_error(case, sensor, time - contact, fitted[sensor][kept], curves, noise)
    return found


def _present(folder: Path, path: Path) -> Path:
    """A file of the comparison; raises UserError where it is missing."""
    if not path.is_file():
        raise UserError(
            f"--from {folder}: {path.relative_to(folder)} is missing (the run at that model's answer failed, or files "
            "were moved); repeat calibrate-models with the same --out and --retry-failed, whose simulations are stored"
        )
    return path
