"""A folder of diagnose: emulators with mesh correction, the effects that were looked at, before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.data.storage.tree import load_tree
from birdstrike.inversion.labels import label_parts
from birdstrike.inversion.misfit import rms
from birdstrike.inversion.results.diagnosis import NONE, SOMETHING_ELSE, Diagnosis, EffectFigures, ShotStates
from birdstrike.inversion.results.diagnosis_files import CASE, MODEL, case_files, curve_files, read_curves
from birdstrike.reports.explore.kinds.kind import Kind
from birdstrike.reports.explore.view import Table, View, answer, channel, parameter, preset, record, runs, unit_of
from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.effects.registry import effect_named
from birdstrike.solver.sensors.instrument import Instrument

LIKELY = 0.02  # probability from which on an effect's slider is shown at once


def holds(folder: Path) -> bool:
    """Whether diagnose has finished here."""
    return (folder / "diagnosis.json").is_file()


def read(folder: Path) -> tuple[View]:
    """The model that was diagnosed; raises UserError for a folder of an earlier version."""
    if not (folder / MODEL).is_file():
        raise UserError(
            f"no {MODEL} in {folder}: an earlier version made its diagnosis; repeat birdstrike diagnose with the "
            "same --out, which finds its simulations there"
        )
    found, model = Diagnosis.read(folder / "diagnosis.json"), load_tree(folder / MODEL)
    fits, parameters = model["fits"], model["parameters"]
    names = [one["name"] for one in model["shots"]]
    cases = _cases(folder, names)
    told = (found.after if found.after and "after" in fits else found.before).parameters
    first = model["systems"][model["shots"][0]["system"]]
    view = View(
        title="Diagnosis",
        headline=found.conclusion + _misfit(found) + _whose(names),
        parameters=[
            parameter(
                one["name"], one["unit"], one["low"], one["high"], told[one["name"]], logarithmic=one["log"], among=told
            )
            for one in parameters
        ],
        systems=[{key: part for key, part in system.items() if key != "runs"} for system in model["systems"]],
        shots=[
            _shot(folder / file, shot, found.noise["sensors"], cases[shot["name"]])
            for file, shot in zip(curve_files(names), model["shots"], strict=True)
        ],
        answers=[answer(one["name"], one["unit"], told[one["name"]], told) for one in parameters],
        effects=_effects(model["effects"], found, cases),
        presets=_presets(fits, found.shots),
        runs=runs(first["runs"]["parameters"], first["time"], first["runs"]["curves"]),
        warnings=list(found.warnings),
        case=str(folder / CASE),
    )
    return (view,)


def _misfit(found: Diagnosis) -> str:
    """What the page's misfit is of, which is larger than the one in the conclusion."""
    besides = ", and what the baseline shows is not taken off" if found.baseline else ""
    return f" The misfit on this page is over the measurement noise alone{besides}."


def _whose(names: Sequence[str]) -> str:
    """Of several shots, whose bird the parameters are."""
    if len(names) < 2:
        return ""
    return f" The parameters are those of the bird of shot {names[0]}; every shot has a bird of its own (buttons)."


def _presets(fits: Mapping[str, Mapping[str, Any]], shots: Sequence[ShotStates]) -> list[Table]:
    """The fits, after before before; of several shots with the bird of each, that of the first leading."""
    latest_first = list(fits.items())[::-1]
    if len(shots) < 2:
        return [preset(name, fit["theta"], fit["effects"]) for name, fit in latest_first]
    return [
        preset(f"{name}, {shot.name}", [one["value"] for one in state.parameters.values()], fit["effects"])
        for name, fit in latest_first
        for shot in shots
        if (state := shot.after if name == "after" else shot.before)
    ]


def _shot(path: Path, shot: Mapping[str, Any], sensors: Mapping[str, Mapping[str, Any]], case: Case) -> Table:
    """A shot with its record as the diagnosis read it: neighbouring instants averaged where there are many.

    sensors: of `noise` in diagnosis.json; case: as declared, whose instruments have read the curves already.
    """
    table, channels = read_curves(path), []
    for one in shot["channels"]:
        own = (table["channel"] == one["name"]).to_numpy()
        time, values, sigma = (table[key].to_numpy(float)[own] for key in ("time_s", "measured", "sigma"))
        noise = rms(sigma)
        seen = record(time, values, sigma, shot["name"])
        seen |= _averaging(one, time, sensors.get(one["name"], {}))
        channels.append(channel(one["name"], one["unit"], noise, seen) | {"instrument": _read_by(case, one["name"])})
    return {"name": shot["name"], "system": shot["system"], "channels": channels}


def _averaging(one: Mapping[str, Any], middle: Array, told: Mapping[str, Any]) -> Table:
    """Of points at `middle` (n,) [s]: `block`, the number of instants averaged, and `instants` (n block,) [s].

    A diagnosis of an earlier version does not hold the instants: its neighbours are taken as equally spaced.
    """
    if "instants" in one:
        return {"block": int(one["block"]), "instants": one["instants"]}
    block = int(told["averaged_over"]) if told.get("points") == len(middle) else 1
    steps = (np.arange(block) - 0.5 * (block - 1)) / block
    return {"block": block, "instants": (middle[:, None] + np.gradient(middle)[:, None] * steps).ravel()}


def _cases(folder: Path, names: Sequence[str]) -> dict[str, Case]:
    """Each shot's case as declared; in a folder of an earlier version, which keeps the first one's alone, that one."""
    files = [folder / file for file in case_files(names)]
    first = load_case(files[0])
    return {
        name: load_case(file) if number and file.is_file() else first
        for number, (name, file) in enumerate(zip(names, files, strict=True))
    }


def _effects(listed: Sequence[Mapping[str, Any]], found: Diagnosis, cases: Mapping[str, Case]) -> list[Table]:
    """Sliders of the effects, the likeliest first; none and something else have none."""
    told = {one.name: one for one in found.effects if one.name not in (NONE, SOMETHING_ELSE)}
    sliders = [_effect(one, told[one["label"]], cases) for one in listed if one["label"] in told]
    return sorted(sliders, key=lambda one: -one["probability"])


def _effect(one: Mapping[str, Any], told: EffectFigures, cases: Mapping[str, Case]) -> Table:
    """A slider over the magnitudes that were looked at; cases: by shot.

    single: the one sensor that it acts on, where it has no other; stated: what the case of the first shot in which it
    acts states of its instrument, without the case's effects, which act on top of it; elsewhere: the same by shot, of
    those whose cases state something else; declared: of a fault in common, the magnitude that this case declares
    besides, and least, below which none means anything.
    """
    single = one["sensors"][0] if one["sensors"] and label_parts(one["label"])[1] else None
    stated, *others = (_read_by(cases[name].with_effects({}), single or "") for name in one["shots"])
    case, common = cases[one["shots"][0]], one["sensors"] and not single
    return {
        **{key: one[key] for key in ("label", "name", "family", "size", "low", "high", "shots", "sensors")},
        **unit_of(one["unit"]),
        "meaning": told.meaning,
        "title": _title(one),
        "probability": told.probability,
        "likely": told.probability >= LIKELY,
        "value": told.magnitude,
        "interval": told.interval_95,
        "single": single,
        "stated": stated,
        "declared": case.effects.get(one["name"], 0.0) if common else 0.0,
        "least": effect_named(one["name"]).least(case) if common else one["low"],
        "elsewhere": {name: other for name, other in zip(one["shots"][1:], others, strict=True) if other != stated},
    }


def _read_by(case: Case, sensor: str) -> Table:
    """A sensor's instrument in a case."""
    found = case.instrument.get(sensor, Instrument())
    return {key: getattr(found, key) for key in ("gain", "time_offset", "drift", "bandwidth")}


def _title(one: Mapping[str, Any]) -> str:
    """`clamp rotation`, `sensor gain, displacement centre`, `impact speed, shot 2 alone`."""
    effect, place, shot = label_parts(one["label"])
    return ", ".join(filter(None, (*(one.replace("_", " ") for one in (effect, place)), shot and f"shot {shot} alone")))


KIND = Kind("diagnose", holds, read)
