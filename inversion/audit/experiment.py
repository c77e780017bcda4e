"""A virtual experiment's files: declared case, record, and the truth that only the scorer opens."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from birdstrike.data.curves import Measured
from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.inversion.audit.planted import Planted
from birdstrike.solver.effects.registry import effects

TRUTH = ".truth.toml"


@dataclass(frozen=True)
class Experiment:
    """Paths of one experiment."""

    name: str
    case: Path
    record: Path
    heldout: Path | None
    truth: Path


@dataclass(frozen=True)
class Truth:
    """What was planted: kind, parameters and effects in SI, and the record without noise."""

    kind: str
    parameters: Mapping[str, float]
    effects: Mapping[str, float]
    what: str
    time: Array
    channels: Mapping[str, Array]


def experiments(folder: Path) -> list[Experiment]:
    """All experiments of a folder by name; raises UserError where there is none or a file is missing."""
    records = sorted(p for p in folder.glob("*.csv") if not p.name.endswith(".heldout.csv"))
    if not records:
        raise UserError(f"{folder} holds no experiment: <name>.toml, <name>.csv and <name>{TRUTH} belong together")
    found = []
    for record in records:
        stem = record.with_suffix("")
        case, truth = stem.with_suffix(".toml"), Path(f"{stem}{TRUTH}")
        missing = [path.name for path in (case, truth) if not path.is_file()]
        if missing:
            raise UserError(f"{record}: {', '.join(missing)} is missing beside it")
        heldout = Path(f"{stem}.heldout.csv")
        found.append(Experiment(stem.name, case, record, heldout if heldout.is_file() else None, truth))
    return found


def truth_text(planted: Planted, clean: Measured) -> str:
    """TOML of a truth file; SI."""
    what = planted.outside.meaning if planted.outside else ""
    lines = ["schema_version = 1", f'kind = "{planted.kind}"', f'what = "{what}"', "\n[effects]"]
    lines += [
        f"{name} = {value!r}  # {effects()[name].unit or 'dimensionless'}" for name, value in planted.effects.items()
    ]
    lines += ["\n[parameters]", *(f'"{name}" = {value!r}' for name, value in planted.parameters.items())]
    lines += ["\n[mesh]", *(f'"{key}" = "{value}"' for key, value in planted.mesh.items())]
    lines += ["\n[curve]", f"time = {_numbers(clean.time)}"]
    lines += [f"{name} = {_numbers(values)}" for name, values in clean.channels.items()]
    return "\n".join(lines) + "\n"


def _numbers(values: Array) -> str:
    return "[" + ", ".join(f"{value:.7g}" for value in values) + "]"


def read_truth(path: Path) -> Truth:
    """The scorer's reading; raises UserError for a file that lacks something."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
        curve = {name: np.array(values, dtype=np.float64) for name, values in content.get("curve", {}).items()}
        time = curve.pop("time", np.empty(0))
        acting = {name: float(value) for name, value in content.get("effects", {}).items()}
        parameters = {name: float(value) for name, value in content.get("parameters", {}).items()}
        return Truth(content["kind"], parameters, acting, content.get("what", ""), time, curve)
    except (KeyError, TypeError, ValueError) as error:
        raise UserError(f"{path} is no truth file: {error}") from error
