"""Coverage and interval scores of `birdstrike predict` on simulated rigs: the table of docs/prediction.md.

From the root of the repository, whose tests state the rig:

    PYTHONPATH=. python docs/prediction_validation.py rigs FOLDER [--rigs 8] [--speeds 77 84 ...] [--until HH:MM]
    PYTHONPATH=. python docs/prediction_validation.py records FOLDER
    PYTHONPATH=. python docs/prediction_validation.py scores FOLDER
    PYTHONPATH=. python docs/prediction_validation.py table FOLDER

A rig is a declared coarse plate and a truth of the audit (inversion/audit/draws.py): another bird of the ranges, one
undeclared effect, eight times the particles and twice the shells, on another lattice; every second rig by the audit's
model-form variant. Two shots of it, at 70 and 90 m/s, and a clean baseline are diagnosed; six other speeds are
predicted and simulated by the truth: 77 and 84 m/s between, 42, 56, 108 and 126 m/s outside, up to 40 % beyond the
nearer end.

The records are the three shipped ones of flat_plate_002: each speed is predicted from a calibration over the other two,
on a coarser plate and bird than declared.

`rigs` and `records` go on where they were stopped; `scores` weighs the stored simulations anew, after a change of how a
prediction is computed.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from birdstrike import run_doe
from birdstrike.data.curves import read_measured, write_measured
from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.histories import Array, Histories, largest
from birdstrike.data.paths import resolve_measured
from birdstrike.data.storage.files import write_json
from birdstrike.doe.campaign.simulations import Simulations
from birdstrike.inversion.audit.draws import BASELINE, SHOTS, SINGLE, Drawn, draw, truth_case
from birdstrike.inversion.audit.truth_runs import noisy
from birdstrike.inversion.diagnosis.diagnose import DiagnosisOptions, diagnose
from birdstrike.inversion.diagnosis.preparation import plan
from birdstrike.inversion.extras import Extras
from birdstrike.inversion.prediction.curves import DRAWS, SensorDraws, Setting, sensor_draws
from birdstrike.inversion.prediction.learnt import Learnt
from birdstrike.inversion.prediction.predict import PredictOptions, prepared
from birdstrike.inversion.prediction.reading import read_learnt
from birdstrike.inversion.prediction.sample import affordable, shares_of
from birdstrike.inversion.prediction.sample import draw as draw_sample
from birdstrike.inversion.results.diagnosis import NONE
from birdstrike.inversion.train_and_invert import train_and_invert
from birdstrike.solver.case.case import Case, case_from_table, load_case
from birdstrike.solver.effects.registry import effects
from tests.inversion.diagnosis.rig import PARTICLES, tiny

LEARNT, BETWEEN, OUTSIDE = (70.0, 90.0), (77.0, 84.0), (42.0, 56.0, 108.0, 126.0)
LEVELS = (0.5, 0.8, 0.95)
BUDGET = 24
CHOSEN_ON = 0
"""Rig on which the lengths of inversion/prediction/distance.py were chosen: it is left out."""
METHODS = ("parameters alone", "best single effect", "full average")


def declared(speed: float) -> Case:
    """The coarse plate of the tests, of an alloy that yields sooner, as it is declared."""
    table = (
        tiny().overlaid({"plate": {"material": {"yield_stress": "350 MPa"}}, "impact": {"speed": f"{speed} m/s"}}).table
    )
    return case_from_table(table, f"rig_{speed:g}")


def single_truths(count: int) -> list[Drawn]:
    """Truths with one effect, every second one of the model-form variant."""
    found: list[Drawn] = []
    number = 0
    while len(found) < count:
        drawn = draw(declared(LEARNT[0]), 5, number, bool(len(found) % 2))
        number += 1
        if drawn.kind == SINGLE:
            label = next(iter(drawn.effects))
            found.append(replace(drawn, effects={label.split("@")[0]: drawn.effects[label]}))
    return found


def at_speed(drawn: Drawn, speed: float, lattice: int, role: str = SHOTS[0]) -> Case:
    """The truth at a speed; an effect of a shot is drawn anew in every shot."""
    case, rng = declared(speed), np.random.default_rng([drawn.number, lattice])
    acting = {
        label: rng.standard_normal() * effects()[label].size(case) if effects()[label].scope == "shot" else value
        for label, value in drawn.effects.items()
    }
    acting = {k: abs(v) if k in effects() and effects()[k].one_sided(case) else v for k, v in acting.items()}
    return truth_case(case, replace(drawn, effects=acting, clean=drawn.parameters), lattice, role)


def simulated_truths(place: Path, drawn: Drawn, speeds: Sequence[float]) -> dict[str, Histories]:
    """Histories of the two shots, of the baseline, and of the truth at the speeds that are predicted."""
    cases = {f"shot{i + 1}": at_speed(drawn, speed, i) for i, speed in enumerate(LEARNT)}
    cases["clean"] = at_speed(drawn, LEARNT[0], 20, BASELINE)
    later = {f"{speed:g}": at_speed(drawn, speed, round(speed)) for speed in speeds}
    with Simulations(place / "truth", workers=1) as simulations:
        found = simulations.run(cases | later)
    if len(cases.keys() & found.keys()) < len(cases):
        raise RunFailed("the truth could not be simulated")
    return found


def diagnosed(folder: Path, drawn: Drawn, truths: Mapping[str, Histories], runs: Path) -> Learnt:
    """What a diagnosis of two shots and a baseline tells; simulations of the declared cases are shared by all rigs."""
    rng = np.random.default_rng([drawn.number, 7])
    for name in ("shot1", "shot2", "clean"):
        case, run = declared(LEARNT[1] if name == "shot2" else LEARNT[0]), truths[name]
        channels = {sensor: run.channels[sensor] for sensor in case.sensors}
        write_measured(folder / f"{name}.csv", noisy(case, run.time, channels, rng))
    options = DiagnosisOptions(workers=1, check=False)
    diagnose(
        [declared(speed) for speed in LEARNT],
        [folder / "shot1.csv", folder / "shot2.csv"],
        folder / "diagnosis",
        runs,
        options=options,
        baseline=[folder / "clean.csv"],
    )
    return read_learnt(folder / "diagnosis")


def variants(setting: Setting) -> dict[str, dict[str, SensorDraws]]:
    """Draws by method, sensor by sensor."""
    learnt = setting.learnt
    labels = [one.label for one in learnt.explanations]
    singles = [one for one in learnt.explanations if len(one.members) == 1] or [learnt.explanations[0]]
    best = max(singles, key=lambda one: one.probability).label
    chosen = {METHODS[0]: [NONE], METHODS[1]: [best], METHODS[2]: None}
    found: dict[str, dict[str, SensorDraws]] = {}
    for method, own in chosen.items():
        shares = [one.probability if own is None else float(one.label in own) for one in learnt.explanations]
        weighted = tuple(replace(one, probability=p) for one, p in zip(learnt.explanations, shares, strict=True))
        of = replace(learnt, explanations=weighted)
        sample = draw_sample(of, setting.carried, setting.tolerances, shares_of(weighted, DRAWS), setting.seed + 1)
        found[method] = {name: sensor_draws(setting, name, sample) for name in setting.campaign.case.sensors}
    assert NONE in labels
    return found


def scored(draws: SensorDraws, truth: Histories, name: str, alone: bool, contact: float) -> dict[str, Any]:
    """Coverage by points and of the largest reading, and interval scores over the largest reading of the truth.

    alone: the model's draws without mesh, emulator and model error.
    """
    values = draws.model if alone else draws.values
    inside = (draws.time > contact) & (draws.time <= truth.time[-1])
    real = np.interp(draws.time, truth.time, truth.channels[name])
    peak, top = float(largest(real)), largest(values)
    size = abs(peak)
    found: dict[str, Any] = {"points": {}, "peak": {}, "score_points": None, "score_peak": None}
    for level in LEVELS:
        tails = [(1.0 - level) / 2.0, (1.0 + level) / 2.0]
        low, high = np.quantile(values, tails, axis=0)
        found["points"][str(level)] = float(((real >= low) & (real <= high))[inside].mean())
        ends = np.quantile(top, tails)
        found["peak"][str(level)] = bool(ends[0] <= peak <= ends[1])
        if level == LEVELS[-1]:
            found["score_points"] = float(interval_score(low, high, real, level)[inside].mean()) / size
            found["score_peak"] = float(interval_score(ends[0], ends[1], np.array(peak), level)) / size
            found["width_peak"] = float(ends[1] - ends[0]) / size
            found["off_peak"] = float(np.median(top) - peak) / size
            found["z_peak"] = float((top.mean() - peak) / top.std())
    return found


def interval_score(low: Any, high: Any, real: Array, level: float) -> Array:
    """Width plus 2/alpha times what lies outside (Gneiting & Raftery, J. Am. Stat. Assoc. 102 (2007) 359, eq. 43)."""
    alpha = 1.0 - level
    return (high - low) + 2.0 / alpha * (np.maximum(low - real, 0.0) + np.maximum(real - high, 0.0))


def run_rigs(folder: Path, count: int, speeds: Sequence[float], until: str) -> None:
    """Rig by rig, each prediction's scores in a file of its own: a stopped run goes on where it stood."""
    runs = folder / "shared"
    for number, drawn in enumerate(single_truths(count)):
        place = folder / f"rig_{number:02d}"
        if _over(until):
            return
        if number == CHOSEN_ON:
            continue
        place.mkdir(parents=True, exist_ok=True)
        begun = time.monotonic()
        try:
            truths = simulated_truths(place, drawn, speeds)
            done = (place / "diagnosis" / "diagnosis.json").is_file()
            learnt = read_learnt(place / "diagnosis") if done else diagnosed(place, drawn, truths, runs)
        except (RunFailed, UserError) as error:
            told = {"effects": dict(drawn.effects), "form": drawn.form, "reason": str(error)}
            write_json(place / "failed.json", told)
            continue
        _share(place / "diagnosis" / "runs", runs / "runs")
        found = [(one.label, round(one.probability, 2)) for one in learnt.explanations[:6]]
        _say(f"rig {number}: {dict(drawn.effects)} {drawn.form}; in {time.monotonic() - begun:.0f} s as {found}")
        for speed in speeds:
            if (place / f"predicted_{speed:g}.json").is_file() or f"{speed:g}" not in truths or _over(until):
                continue
            begun = time.monotonic()
            try:
                predicted_at(place, number, drawn, learnt, speed, truths[f"{speed:g}"])
            except (RunFailed, UserError) as error:
                _say(f"  {speed:g} m/s failed: {error}")
                continue
            _say(f"  {speed:g} m/s in {time.monotonic() - begun:.0f} s")


def predicted_at(place: Path, number: int, drawn: Drawn, learnt: Learnt, speed: float, truth: Histories) -> None:
    """One prediction and its scores, from what is simulated already where it is."""
    case, none = declared(speed), [one for one in learnt.explanations if one.label == NONE]
    learnt = affordable(learnt, BUDGET)
    if all(one.label != NONE for one in learnt.explanations):
        unlikely = [replace(one, probability=0.0) for one in none]
        learnt = replace(learnt, explanations=(*learnt.explanations, *unlikely))
    options = PredictOptions(budget=BUDGET, workers=1)
    setting, _ = prepared(case, learnt, place / f"predict_{speed:g}", options)
    scores = {
        method: {name: scored(one, truth, name, method != METHODS[2], case.first_contact) for name, one in own.items()}
        for method, own in variants(setting).items()
    }
    told = {
        "rig": number,
        "speed": speed,
        "form": drawn.form,
        "between": LEARNT[0] < speed < LEARNT[1],
        "effects": dict(drawn.effects),
        "growth": setting.where.growth,
        "scores": scores,
    }
    write_json(place / f"predicted_{speed:g}.json", told)


def score_again(folder: Path) -> None:
    """Every prediction that has been simulated, by the present computation."""
    for place in sorted(folder.glob("rig_[0-9]*")):
        speeds = [float(path.stem.removeprefix("predicted_")) for path in sorted(place.glob("predicted_*.json"))]
        if speeds:
            number = int(place.name.removeprefix("rig_"))
            drawn = single_truths(number + 1)[number]
            truths, learnt = simulated_truths(place, drawn, speeds), read_learnt(place / "diagnosis")
            for speed in speeds:
                predicted_at(place, number, drawn, learnt, speed, truths[f"{speed:g}"])
            _say(f"{place.name}: {len(speeds)} predictions")
    cases = {speed: record_case(speed) for speed in RECORDS}
    for speed in cases:
        if (folder / f"rig_without_{speed:g}" / "record.json").is_file():
            predicted_record(folder, cases, speed)


def _say(text: str) -> None:
    print(text, flush=True)  # noqa: T201 (a script)


RECORDS = {70.0: "flat_plate_002_70", 120.0: "flat_plate_002", 170.0: "flat_plate_002_170"}
RECORD_OF = {70.0: "flat_plate_002_70", 120.0: "flat_plate_002_120", 170.0: "flat_plate_002_170"}
COARSE = {"bird.particles": 600, "target.generator.element_size": "30 mm", "time.end": "2.5 ms"}
SOUGHT = {"bird.material.eos.B": ["40 MPa", "250 MPa"], "bird.material.viscosity": ["0 Pa s", "300 Pa s"]}
RUNS = 12


def record_case(speed: float) -> Case:
    """A shipped case with a coarser mesh, the sensors that its record has, and two constants that are sought."""
    case, record = load_case(RECORDS[speed], COARSE), read_measured(resolve_measured(RECORD_OF[speed]))
    sensors = {name: one for name, one in case.table["sensors"].items() if name in record.channels}
    sought = {key: {"range": ends} for key, ends in SOUGHT.items()}
    return case_from_table(case.table | {"sensors": sensors, "inversion": {"parameters": sought}}, case.name)


def run_records(folder: Path) -> None:
    """Leave one speed out of the shipped records of flat_plate_002."""
    cases = {speed: record_case(speed) for speed in RECORDS}
    for speed, case in cases.items():
        run_doe(case, folder / f"doe_{speed:g}", design="uniform", runs=RUNS, workers=1)
        _say(f"campaign at {speed:g} m/s")
    for speed in cases:
        place, others = folder / f"rig_without_{speed:g}", [one for one in cases if one != speed]
        train_and_invert(
            [folder / f"doe_{one:g}" for one in others],
            [RECORD_OF[one] for one in others],
            place / "inversion",
            method="emulator",
            case=[folder / f"doe_{one:g}" / "case.toml" for one in others],
            extras=Extras(refine=0),
        )
        predicted_record(folder, cases, speed)
        _say(f"predicted {speed:g} m/s")


def predicted_record(folder: Path, cases: Mapping[float, Case], speed: float) -> None:
    """One record predicted from the calibration over the others, and its scores."""
    place, others, case = folder / f"rig_without_{speed:g}", [one for one in cases if one != speed], cases[speed]
    learnt = read_learnt(place / "inversion")
    setting, _ = prepared(case, learnt, place / "predict", PredictOptions(budget=RUNS, workers=1))
    measured = read_measured(resolve_measured(RECORD_OF[speed]))
    truth = Histories(measured.time, dict(measured.channels), dict(measured.units))
    counts = shares_of(learnt.explanations, DRAWS)
    sample = draw_sample(learnt, setting.carried, setting.tolerances, counts, 1)
    draws = {name: sensor_draws(setting, name, sample) for name in case.sensors}
    scores = {
        method: {
            name: scored(_noisy(one, case.sensors[name].noise or 0.0), truth, name, method != METHODS[2], 0.0)
            for name, one in draws.items()
        }
        for method in (METHODS[0], METHODS[2])
    }
    own = {"rig": f"002 without {speed:g}", "speed": speed, "between": min(others) < speed < max(others)}
    write_json(place / "record.json", {**own, "growth": setting.where.growth, "scores": scores})


def _noisy(draws: SensorDraws, sigma: float) -> SensorDraws:
    """With the noise of the record that it is compared with."""
    noise = sigma * np.random.default_rng(3).standard_normal(draws.model.shape)
    return replace(draws, model=draws.model + noise)


def _share(own: Path, shared: Path) -> None:
    """Simulations of a diagnosis for the next one."""
    shared.mkdir(parents=True, exist_ok=True)
    for path in own.glob("*.h5"):
        if not (shared / path.name).exists():
            (shared / path.name).hardlink_to(path)


def _over(until: str) -> bool:
    """Whether the time of day has come."""
    return bool(until) and datetime.now().strftime("%H:%M") >= until


def table(folder: Path) -> str:
    """Markdown of all predictions so far."""
    found = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(folder.glob("rig_*/predicted_*.json"))]
    found = [one for one in found if one["rig"] != CHOSEN_ON]
    records = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(folder.glob("rig_*/record.json"))]
    groups = {
        "between the learnt speeds": [one for one in found if one["between"]],
        "outside, up to 40 %": [one for one in found if not one["between"]],
        "all": found,
        "flat_plate_002, one speed left out": records,
    }
    coverage = [f"{level} %{of}" for of in ("", " of peaks") for level in (50, 80, 95)]
    head = ["predictions", "method", *coverage, "score, points", "score, peaks"]
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    for name, own in groups.items():
        for method in METHODS:
            cells = [cell for one in own for cell in one["scores"].get(method, {}).values()]
            if cells:
                lines.append(f"| {name} ({len(own)}) | {method} | {' | '.join(_figures(cells))} |")
    rigs = len({one["rig"] for one in found})
    return "\n".join([f"{len(found)} predictions on {rigs} rigs.", "", *lines])


def _figures(cells: Sequence[Mapping[str, Any]]) -> list[str]:
    points = [f"{100.0 * np.mean([c['points'][str(level)] for c in cells]):.0f} %" for level in LEVELS]
    peaks = [f"{100.0 * np.mean([c['peak'][str(level)] for c in cells]):.0f} %" for level in LEVELS]
    scores = [f"{100.0 * np.mean([c[key] for c in cells]):.1f} %" for key in ("score_points", "score_peak")]
    return [*points, *peaks, *scores]


def main() -> None:
    """Run, or print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("rigs", "records", "scores", "table"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--rigs", type=int, default=8)
    parser.add_argument("--speeds", type=float, nargs="+", default=[*BETWEEN, *OUTSIDE])
    parser.add_argument("--until", default="", help="Time of day after which no further prediction begins.")
    given = parser.parse_args()
    plan.COARSE_PARTICLES = PARTICLES  # a plate so coarse that a diagnosis takes minutes on one core
    if given.what == "rigs":
        run_rigs(given.folder, given.rigs, given.speeds, given.until)
    if given.what == "records":
        run_records(given.folder)
    if given.what == "scores":
        score_again(given.folder)
    _say(table(given.folder))


if __name__ == "__main__":
    main()
