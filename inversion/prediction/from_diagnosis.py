"""What a prediction takes from a diagnosis: credible set, draws of each of its models, discrepancy, residuals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.data.storage.tree import load_tree
from birdstrike.doe.campaign.folder import stored_case
from birdstrike.inversion.diagnosis.preparation.discrepancy import repeatability
from birdstrike.inversion.estimation.mesh_correction import EXTRAPOLATED
from birdstrike.inversion.prediction.learnt import Explanation, Learnt, LearntShot, SensorError, unseen_parts
from birdstrike.inversion.results.diagnosis import NONE, SOMETHING_ELSE, Diagnosis
from birdstrike.inversion.results.diagnosis_files import MODEL, RESULT, curve_files, read_curves

Tree = Mapping[str, Any]


def read_diagnosis(folder: Path) -> Learnt:
    """From the folder of a diagnosis; raises UserError for one that is incomplete or of an earlier version."""
    found = Diagnosis.read(folder / RESULT)
    missing = [name for name in (MODEL, "case.toml") if not (folder / name).is_file()]
    model = {} if missing else load_tree(folder / MODEL)
    if missing or "posterior" not in model or "contacts" not in model:
        raise UserError(
            f"--from {folder}: this diagnosis holds no draws of its models (an earlier version made it, or files were "
            "moved); repeat the diagnose command with the same --out, whose simulations are stored"
        )
    case, shape = stored_case(folder), model["discrepancy"]
    shots = tuple(_shots(folder, found, model))
    explanations = tuple(_explanation(one, model, shape) for one in model["posterior"])
    counts = len(explanations[0].parameters)
    other = [one for one in explanations if one.label == SOMETHING_ELSE]
    warnings = list(found.warnings)
    if other and other[0].probability > 0.05:
        warnings.append(
            f"the diagnosis gives something outside its library a probability of {other[0].probability:.2f}: in those "
            "draws the model is predicted without an effect, and what it left of the record is carried as model error"
        )
    if bare := [one["label"] for one in model["posterior"] if "residuals" not in one]:
        warnings.append(_substitutes(folder, bare, _chosen(found)))
    own = f"the bird is that of shot {shots[0].name}; every shot has its own"
    return Learnt(
        "diagnose",
        folder,
        case,
        shots,
        explanations,
        corrected=case.solver.name != "external",
        diagnosed=True,
        said=(own,) if len(shots) > 1 else (),
        next_measurement=found.next_measurement["sentence"] if found.next_measurement else "",
        warnings=tuple(warnings),
        set_size=sum(one.probability > 0.0 for one in explanations),
        set_said=f"models of the diagnosis' 95 % set by probability, {counts} draws of each from its posterior (joint "
        "in parameters and magnitudes)",
    )


def _explanation(one: Tree, model: Tree, shape: Tree) -> Explanation:
    n = len(one["parameters"])
    kinds = list(one["amplitude"])
    free = {kind: np.asarray(one["amplitude"][kind], dtype=float) for kind in kinds}
    fixed = {kind: np.full(n, float(shape["fixed"].get(kind, 0.0))) for kind in kinds}
    learnt = kinds if shape["own_is_free"] is True else shape["own_is_free"] or []  # of an earlier version: all or none
    parts = {
        kind: (fixed[kind], free[kind]) if kind in learnt else unseen_parts(free[kind], fixed[kind]) for kind in kinds
    }
    return Explanation(
        label=one["label"],
        probability=float(one["share"]),
        names=tuple(p["name"] for p in model["parameters"]),
        parameters=np.asarray(one["parameters"]),
        members=tuple(one["members"]),
        effects=tuple(one["names"]),
        sizes=tuple(one["sizes"]),
        magnitudes=np.asarray(one["magnitudes"]).reshape(n, len(one["members"])),
        amplitude={kind: shared for kind, (shared, _) in parts.items()},
        own={kind: np.maximum(own, repeatability(kind)) for kind, (_, own) in parts.items()},
    )


def _substitutes(folder: Path, labels: list[str], chosen: str) -> str:
    """A warning that names what is used in place of the residuals that an earlier version did not store."""
    own = [label for label in labels if label in (NONE, chosen)]
    unexplained = [label for label in labels if label == SOMETHING_ELSE]
    none = [label for label in labels if label not in (NONE, chosen, SOMETHING_ELSE)]
    parts = [f"{' and '.join(own)}: that of the fit, for all draws"] * bool(own)
    parts += [f"{SOMETHING_ELSE}: that of {NONE}"] * bool(unexplained)
    parts += [f"{', '.join(none)}: none, the model error as large as the diagnosis states it"] * bool(none)
    return (
        f"{folder} was made by an earlier version, which stored no residual of each draw; in its place stands, of "
        f"{'; of '.join(parts)}. The bands are wider than they need be; repeat the diagnose command with the same "
        "--out, whose simulations are stored"
    )


def _chosen(found: Diagnosis) -> str:
    """The effect whose fit has a curve of its own; empty where none has."""
    return found.after.model if found.after else ""


def _shots(folder: Path, diagnosis: Diagnosis, model: Tree) -> list[LearntShot]:
    """The measured shots with their residuals."""
    found, names = [], [one["name"] for one in model["shots"]]
    chosen = _chosen(diagnosis)
    files, conditions, contacts = curve_files(names), model["conditions"], model["contacts"]
    for i, (name, file, where, contact) in enumerate(zip(names, files, conditions, contacts, strict=True)):
        if not (folder / file).is_file():
            raise UserError(f"--from {folder}: {file} is missing; repeat the diagnose command with the same --out")
        table = read_curves(folder / file)
        stored = {one["label"]: one["residuals"][i] for one in model["posterior"] if "residuals" in one}
        system, errors = model["systems"][model["shots"][i]["system"]], dict[str, SensorError]()
        for channel, part in table.groupby("channel", sort=False):
            error = _error(part, str(channel), chosen, stored, model, float(contact))
            finer = _finer(system, str(channel), error.times + float(contact))
            errors[str(channel)] = replace(error, finer=finer)
        if not errors:
            raise UserError(f"--from {folder}: {file} holds no sensor; repeat the diagnose command with the same --out")
        found.append(LearntShot(name, where, errors))
    return found


def _finer(system: Tree, channel: str, times: Array) -> Array:
    """(n,) SI at `times` [s] of the record: one standard deviation of what a still finer mesh would add."""
    return EXTRAPOLATED * np.interp(times, system["time"], system["mesh"]["mean"][channel])


def _error(
    part: pd.DataFrame, channel: str, chosen: str, stored: Mapping[str, Tree], model: Tree, contact: float
) -> SensorError:
    """The residual of each model at each of its draws; where an earlier version stored none, that of the fits."""
    time, shape = part["time_s"].to_numpy(float), model["discrepancy"]
    measured = part["measured"].to_numpy(float)
    before = measured - part["before"].to_numpy(float)
    after = measured - part["after"].to_numpy(float)
    residual = {NONE: before[None], SOMETHING_ELSE: before[None]}
    if chosen and np.isfinite(after).all():
        residual[chosen] = after[None]
    for label, channels in stored.items():
        own = channels[channel]
        residual[label] = own["mean"] + own["scores"] @ own["directions"]
    return SensorError(
        times=time - contact,
        residual=residual,
        sigma=part["sigma"].to_numpy(float),
        peak=float(np.abs(measured).max()),
        length=float(shape["length"][channel]),
        # of the first shot, on whose clock it was learnt
        growth_times=np.asarray(shape["time"]) - float(model["contacts"][0]),
        growth=np.asarray(shape["growth"][channel]),
    )
