"""Files of an experiment: declared case, shots, baseline, a record held out, and the truth that only the scorer opens.

`<name>.toml`, `<name>.csv`, optionally `<name>.shot2.csv` and so on, `<name>.baseline.csv`, `<name>.heldout.csv`, and
`<name>.truth.toml`. A truth's noise-free curves stand in it, or in a file of columns that several truths share.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.inversion.audit.draws import CLEAN, OUTSIDE, OWN, PAIR, SHOTS, SINGLE, SLOPE, name_of
from birdstrike.solver.case.case import load_case
from birdstrike.solver.effects.registry import effects

TRUTH, CURVES = ".truth.toml", ".curves"
NO_BASELINE, ANOTHER_BIRD, OWN_BIRD = BASELINES = "none", "another", "own"
"""Baselines of an experiment: none, one of another bird, or one of the shots' own bird, which the case says."""
KINDS = (CLEAN, SINGLE, PAIR, OUTSIDE)


@dataclass(frozen=True)
class Experiment:
    """Paths of one experiment; shots: the first one's record first."""

    name: str
    case: Path
    shots: tuple[Path, ...]
    baseline: Path | None
    heldout: Path | None
    truth: Path

    @property
    def baseline_kind(self) -> str:
        """One of BASELINES; of the shots' own bird where the declared case says that it is the same."""
        if self.baseline is None:
            return NO_BASELINE
        return OWN_BIRD if load_case(self.case).diagnosis.baseline_bird == "same" else ANOTHER_BIRD


@dataclass(frozen=True)
class Truth:
    """What the truth has, SI.

    draw: the truth that several records share; form: the model that made it; time: (n,) [s]; curves: role -> sensor ->
    (n,) without noise; slopes: parameter -> sensor -> (n,) change over the whole of its range; seed: of which it was
    drawn, None where its file does not say.
    """

    kind: str
    draw: str
    form: str
    what: str
    effects: Mapping[str, float]
    parameters: Mapping[str, float]
    time: Array = field(default_factory=lambda: np.empty(0))
    curves: Mapping[str, Mapping[str, Array]] = field(default_factory=dict)
    slopes: Mapping[str, Mapping[str, Array]] = field(default_factory=dict)
    seed: int | None = None


def find_experiments(folder: Path) -> list[Experiment]:
    """All experiments of a folder by name; raises UserError where there is none or a file is missing."""
    records = sorted(path for path in folder.glob("*.csv") if "." not in path.stem)
    if not records:
        raise UserError(f"{folder} holds no experiment: <name>.toml, <name>.csv and <name>{TRUTH} belong together")
    return [experiment_of(record) for record in records]


def experiment_of(record: Path) -> Experiment:
    """The experiment of a record `<name>.csv`; raises UserError where its case or its truth is not beside it."""
    stem = record.with_suffix("")

    def beside(ending: str) -> Path:
        return Path(f"{stem}{ending}")

    missing = [path.name for path in (beside(".toml"), beside(TRUTH)) if not path.is_file()]
    if missing:
        raise UserError(f"{record}: {', '.join(missing)} is missing beside it")
    further = [beside(f".{shot}.csv") for shot in SHOTS[1:]]
    clean, held = (path if path.is_file() else None for path in (beside(".baseline.csv"), beside(".heldout.csv")))
    shots = (record, *(path for path in further if path.is_file()))
    return Experiment(stem.name, beside(".toml"), shots, clean, held, beside(TRUTH))


def truth_text(truth: Truth, curves: str) -> str:
    """TOML of a truth file; SI; curves: name of the file of noise-free curves."""
    lines = ["schema_version = 2", f'kind = "{truth.kind}"', f'draw = "{truth.draw}"', f'form = "{truth.form}"']
    lines += [] if truth.seed is None else [f"seed = {truth.seed}"]
    lines += [f'what = "{truth.what}"', f'curves = "{curves}"', "\n[effects]"]
    lines += [
        f"{json.dumps(label, ensure_ascii=False)} = {value!r}  # {unit_of(label)}"
        for label, value in truth.effects.items()
    ]
    lines += ["\n[parameters]", *(f'"{name}" = {value!r}' for name, value in truth.parameters.items())]
    return "\n".join(lines) + "\n"


def unit_of(label: str) -> str:
    """SI unit of an effect's magnitude."""
    known = effects().get(name_of(label))
    return (known.unit if known else "") or "dimensionless"


def curves_text(time: Array, columns: Mapping[tuple[str, str], Array]) -> str:
    """Text of a file of curves: (role, sensor) -> (n,); role: a shot, `heldout`, `without`, `slope <parameter>`."""
    table = {"time_s": time, **{f"{role}|{sensor}": values for (role, sensor), values in columns.items()}}
    return pd.DataFrame(table).to_csv(index=False, float_format="%.7g", lineterminator="\n")


def read_truth(path: Path) -> Truth:
    """The scorer's reading; raises UserError for a file that lacks something."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
        if content["kind"] not in KINDS:
            raise ValueError(f'kind = "{content["kind"]}" is none of {", ".join(KINDS)}')
        effects = {label: float(value) for label, value in content.get("effects", {}).items()}
        parameters = {name: float(value) for name, value in content.get("parameters", {}).items()}
        time, curves, slopes = read_curves(path, content)
        named = (content.get("draw", path.name.removesuffix(TRUTH)), content.get("form", OWN), content.get("what", ""))
        return Truth(content["kind"], *named, effects, parameters, time, curves, slopes, content.get("seed"))
    except (KeyError, TypeError, ValueError, OSError) as error:
        raise UserError(
            f"{path} is no truth file: {error}; make experiments with: birdstrike audit --make N"
        ) from error


def refuse_damaged_truths(found: Sequence[Experiment]) -> None:
    """Raise UserError, with a line for each truth file that cannot be read, before a record is diagnosed in vain."""
    errors: list[str] = []
    for one in found:
        try:
            read_truth(one.truth)
        except UserError as error:
            errors += error.errors
    if errors:
        raise UserError(errors)


def read_curves(path: Path, content: Mapping) -> tuple[Array, dict[str, dict[str, Array]], dict[str, dict[str, Array]]]:
    """Clock, curves by role, and sensitivities, from the file that the truth names or from its own table."""
    if "curves" not in content:
        own: dict[str, Array] = {
            name: np.array(values, dtype=np.float64) for name, values in content.get("curve", {}).items()
        }
        time = own.pop("time", np.empty(0))
        curves = {SHOTS[0]: own} if own else dict[str, dict[str, Array]]()
        return time, curves, {}
    table = pd.read_csv(path.parent / content["curves"])
    curves = dict[str, dict[str, Array]]()
    slopes: dict[str, dict[str, Array]] = {}
    for column in table.columns[1:]:
        role, sensor = str(column).split("|", 1)
        into = slopes if role.startswith(f"{SLOPE} ") else curves
        into.setdefault(role.removeprefix(f"{SLOPE} "), {})[sensor] = table[column].to_numpy(np.float64)
    return table["time_s"].to_numpy(np.float64), curves, slopes
