"""How well calibrate-models recovers known birds: the table of docs/models.md.

python docs/model_recovery.py --runs FOLDER [--truths 20] [--models murnaghan hydrodynamic ...] [--out TABLE.md]
python docs/model_recovery.py --runs FOLDER --optimisers [--truths 4] [--models ...] [--out TABLE.md]

The rig is a small plate with 150 particles at 60, 80 and 100 m/s, 45 degrees, two displacements with 0.02 mm of noise.
Truths of a model are drawn from the middle 80 % of its ranges, each in its scale; record and campaign share the mesh.
All truths share one campaign a model and shot (they lie in FOLDER and are kept): hits of intervals are therefore not
independent of the campaign's emulator, and the binomial limits below take them as if they were.

A row a model: bulk modulus within 3 %, 95 % intervals of the constants that were identified and held the truth, and
how often the generating model was first, alone or tied, among all that were given.

--optimisers: the generating model alone, beside optimisers with the solver in the loop and four times the simulations;
a row a truth: the error over the noise of the solver at each answer. The truth itself leaves about 1.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binom

from birdstrike.data.curves import Measured
from birdstrike.data.errors import RunFailed
from birdstrike.data.storage.files import write_atomically, write_json
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.models.calibrate_models import calibrate_models
from birdstrike.inversion.models.candidates import built, calibrated_case, candidate
from birdstrike.inversion.models.results import ModelAnswer
from birdstrike.solver.case.case import Case, case_from_table
from birdstrike.solver.simulate import simulate

SPEEDS = (60.0, 80.0, 100.0)
NOISE = 2e-5  # m
TIMES_THE_SIMULATIONS = 4  # that an optimiser may spend against the calibration
HEAD = (
    "| model | truths | K within 3 % | K inside its 95 % interval | constants inside theirs | first | tied | "
    "simulations |"
)
RIG: dict[str, Any] = {
    "plate": {
        "length": "300 mm",
        "width": "300 mm",
        "thickness": "6 mm",
        "elements": [10, 8],
        "edges": "clamped",
        "material": {"young": "71 GPa", "poisson": 0.3, "density": "2780 kg/m^3", "yield_stress": "690 MPa"},
    },
    "bird": {
        "shape": "hemispherical_cylinder",
        "diameter": "60 mm",
        "length": "110 mm",
        "density": "938 kg/m^3",
        "particles": 150,
        "material": {
            "model": "null",
            "pressure_cutoff": "-0.37 MPa",
            "viscosity": "641 Pa s",
            "eos": {"kind": "grueneisen", "C": "1670 m/s", "S1": 2.48},
        },
    },
    "impact": {"speed": "80 m/s", "angle": "45 deg", "standoff": "1 mm"},
    "time": {"end": "0.9 ms", "output_interval": "20 us"},
    "sensors": {
        "displacement_centre": {"kind": "displacement", "noise": "0.02 mm"},
        "displacement_side": {"kind": "displacement", "at": ["75 mm", "0 mm"], "noise": "0.02 mm"},
    },
}


def rig(speed: float) -> Case:
    """The rig at a speed."""
    return case_from_table({**RIG, "impact": {**RIG["impact"], "speed": f"{speed} m/s"}}, f"rig_{speed:g}")


def truth_of(model: str, number: int) -> dict[str, float]:
    """SI values of a model's truth."""
    space = ParameterSpace.of_case(calibrated_case(candidate(model), rig(80.0)))
    rng = np.random.default_rng([number, *map(ord, model)])
    values = space.to_physical(rng.uniform(0.1, 0.9, (1, len(space.names))))[0]
    return dict(zip(space.names, map(float, values), strict=True))


def records_of(model: str, number: int) -> list[Measured]:
    """The truth's three shots."""
    found = []
    for i, speed in enumerate(SPEEDS):
        run = simulate(calibrated_case(candidate(model), rig(speed)).with_values(truth_of(model, number)))
        rng = np.random.default_rng([number, i])
        seen = {name: values + NOISE * rng.standard_normal(len(run.time)) for name, values in run.channels.items()}
        found.append(Measured(run.time, seen, {}, dict(run.units), ("SIMULATED",), f"v{speed:g}.csv"))
    return found


def trial(folder: Path, model: str, number: int, models: list[str], runs: int) -> dict[str, Any]:
    """One truth calibrated and ranked; what was found is kept."""
    kept = folder / f"{model}_{number}.json"
    if kept.is_file():
        return json.loads(kept.read_text(encoding="utf-8"))
    found = calibrate_models([rig(v) for v in SPEEDS], records_of(model, number), folder / "models", models, runs=runs)
    truth, own = truth_of(model, number), found.models[model]
    bulk = built(calibrated_case(candidate(model), rig(80.0)), truth).bulk_modulus
    combined = own.combinations.get("bulk_modulus")
    hits = {
        name: bool(one.interval_95[0] <= truth[name] <= one.interval_95[1])
        for name, one in own.parameters.items()
        if one.identified and one.interval_95 is not None
    }
    entry = {
        "model": model,
        "number": number,
        "truth": truth,
        "bulk_truth": bulk,
        "bulk": combined.value if combined else None,
        "bulk_95": combined.interval_95 if combined else None,
        "hits": hits,
        "ranking": found.ranking,
        "tied": found.tied,
        "expected": {name: found.models[name].expected for name in found.ranking},
        "strikes": max(own.strikes.values(), default=0),
        "wall_s": {name: one.wall_s for name, one in found.models.items()},
    }
    write_json(kept, entry)
    return entry


def row(model: str, entries: list[dict[str, Any]]) -> str:
    """A model's line of the table."""
    errors = [e["bulk"] / e["bulk_truth"] - 1.0 for e in entries if e["bulk"] is not None]
    close = sum(abs(e) < 0.03 for e in errors)
    inside = sum(e["bulk_95"][0] <= e["bulk_truth"] <= e["bulk_95"][1] for e in entries if e["bulk_95"])
    hits = [hit for e in entries for hit in e["hits"].values()]
    low, high = (int(binom.ppf(q, max(len(hits), 1), 0.95)) for q in (0.005, 0.995))
    first = sum(e["ranking"][0] == model for e in entries)
    tied = sum(e["ranking"][0] != model and model in e["tied"] for e in entries)
    bulk = f"{close} of {len(errors)}, median error {100 * np.median(np.abs(errors)):.1f} %" if errors else "–"
    held = f"{sum(hits)} of {len(hits)} ({low} .. {high} by chance at 95 %)" if hits else "–"
    strikes = max(e["strikes"] for e in entries)
    return f"| {model} | {len(entries)} | {bulk} | {inside} of {len(errors)} | {held} | {first} | {tied} | {strikes} |"


def beside_optimisers(folder: Path, model: str, number: int, runs: int) -> dict[str, Any]:
    """A truth calibrated by its own model and by optimisers: method -> (error over the noise, simulations a shot)."""
    kept = folder / f"{model}_{number}_optimisers.json"
    if kept.is_file():
        return json.loads(kept.read_text(encoding="utf-8"))["methods"]
    cases, records = [rig(v) for v in SPEEDS], records_of(model, number)

    def calibrated(**more: Any) -> ModelAnswer:
        given = (cases, records, folder / "optimised", [model], runs)
        return calibrate_models(*given, posterior=False, **more).models[model]

    own = calibrated()
    found = calibrated(optimisers=("least_squares", "cma"), budget=TIMES_THE_SIMULATIONS * max(own.strikes.values()))
    error = float(np.sqrt(np.mean(np.square([one.weighted for one in own.verified.values()]))))
    entry = {
        "calibration": (error, max(own.strikes.values())),
        **{name: (one.weighted, one.strikes) for name, one in found.optimised.items()},
    }
    write_json(kept, {"methods": entry})
    return entry


def optimiser_row(model: str, number: int, entry: dict[str, Any]) -> str:
    """A truth's line of the table."""
    cells = (f"{error:.2f} ({simulations})" for error, simulations in entry.values())
    return f"| {model} | {number} | {' | '.join(cells)} |"


def main() -> None:
    """Make the truths, and the table from all that FOLDER holds."""
    given = argparse.ArgumentParser(description=__doc__)
    given.add_argument("--runs", type=Path, required=True)
    given.add_argument("--truths", type=int, default=20)
    given.add_argument(
        "--models", nargs="+", default=["null", "elastic", "plastic_kinematic", "hydrodynamic", "murnaghan"]
    )
    given.add_argument("--campaign", type=int, default=20)
    given.add_argument("--optimisers", action="store_true")
    given.add_argument("--out", type=Path)
    asked = given.parse_args()
    asked.runs.mkdir(parents=True, exist_ok=True)
    lines = compared(asked) if asked.optimisers else recovered(asked)
    for table in lines:
        if asked.out:
            write_atomically(asked.out, table + "\n")
        sys.stdout.write(table + "\n")


def recovered(asked: argparse.Namespace) -> Iterator[str]:
    """The table of recovery, after each truth."""
    found: dict[str, list[dict[str, Any]]] = {}
    for number in range(asked.truths):
        for model in asked.models:
            try:
                entry = trial(asked.runs, model, number, asked.models, asked.campaign)
            except RunFailed as failure:
                sys.stderr.write(f"{model} {number}: {failure}\n")
                continue
            found.setdefault(model, []).append(entry)
            yield "\n".join([HEAD, "|---" * 8 + "|", *(row(name, entries) for name, entries in found.items())])


def compared(asked: argparse.Namespace) -> Iterator[str]:
    """The table of optimisers, after each truth."""
    rows = ["| model | truth | calibration | least squares | CMA-ES |", "|---|---|---|---|---|"]
    for number in range(asked.truths):
        for model in asked.models:
            rows.append(optimiser_row(model, number, beside_optimisers(asked.runs, model, number, asked.campaign)))
            yield "\n".join(rows)


if __name__ == "__main__":
    main()
