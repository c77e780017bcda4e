"""What the calibration of several bird models found: the content of `models.json`. SI; None where a thing is not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from birdstrike.data.curves import Measured, write_measured
from birdstrike.data.display import Displayed
from birdstrike.data.errors import UserError
from birdstrike.data.storage.files import file_in, json_values, read_json, withdraw, write_atomically, write_json
from birdstrike.inversion.identifiability.summary import DRAWS_FILE
from birdstrike.inversion.labels import provenance
from birdstrike.inversion.models.candidates import candidate
from birdstrike.inversion.results.estimates import Estimate
from birdstrike.inversion.results.ingredients import MeasuredFigures

SCHEMA_VERSION = 1
COMPARISON = "models.json"
ANSWER = "answer.json"
"""One model's answer in its folder, which a repeated call reads."""
PAGES = ("models.html", "explore.html")
"""Pages that show a ranking, beside it."""
OF_AN_ANSWER = (ANSWER, DRAWS_FILE, "emulator.npz", "emulator.json", "calibrated_*.csv", "published_*.csv", *PAGES)
"""What a model's folder holds of its answer, beside the simulations, which serve other answers too."""


@dataclass(frozen=True)
class Combined:
    """A quantity that several sought constants make together, such as the bulk modulus K = B g.

    formula: in the model's symbols; of: their dotted keys; sentence: the answer in words, with what is not
    identifiable.
    """

    value: float
    interval_95: tuple[float, float] | None
    unit: str
    identified: bool
    formula: str
    of: tuple[str, ...]
    sentence: str


@dataclass(frozen=True)
class ShotError:
    """Errors of one simulation against one shot's record.

    rmse: sensor -> root mean square error, SI; weighted: whitened RMS, root mean square over the channels of each
    channel's error over its noise.
    """

    rmse: Mapping[str, float]
    weighted: float


@dataclass(frozen=True)
class Optimised:
    """What an optimiser with the solver in the loop reached. parameters: SI; weighted: its error over the noise, all
    shots; strikes: simulations of each shot; ended: why it stopped."""

    parameters: Mapping[str, float]
    weighted: float
    strikes: int
    ended: str


@dataclass(frozen=True)
class ModelAnswer:
    """One bird model over all shots.

    parameters: as in inversion.json; literature: published constants of what was sought, SI; source: where they stand;
    verified, published: shot -> error of the calibrated model and of the published constants, by the solver;
    heldout: shot -> whitened RMS of the solver at what the other shots (or, of a single shot, the other two thirds of
    the record) gave; heldout_95: its block-bootstrap interval; residuals: shot -> channel -> those residuals over their
    noise; expected: root mean square of `heldout`, expected_95; probability_best: share of the bootstrap in which no
    model is better; q2: shot -> channel -> leave-one-out Q2 of the emulator; eroded: shot -> the campaign's largest
    eroded share of the bird; optimised: optimiser -> what it reached, where any was asked for; discrepancy: share of
    the peaks that the fit allowed for (1 sigma); inside: whether the model can make the records; strikes: shot ->
    simulations; wall_s: [s] of the call that made the answer; failure: why there is none; measured: shot -> the points
    of its record by which the errors of all models are told.
    """

    name: str
    source: str
    parameters: Mapping[str, Estimate] = field(default_factory=dict)
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    combinations: Mapping[str, Combined] = field(default_factory=dict)
    literature: Mapping[str, float] = field(default_factory=dict)
    verified: Mapping[str, ShotError] = field(default_factory=dict)
    published: Mapping[str, ShotError] = field(default_factory=dict)
    heldout: Mapping[str, float] = field(default_factory=dict)
    heldout_95: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    heldout_parameters: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    residuals: Mapping[str, Mapping[str, tuple[float, ...]]] = field(default_factory=dict)
    expected: float | None = None
    expected_95: tuple[float, float] | None = None
    probability_best: float | None = None
    q2: Mapping[str, Mapping[str, float | None]] = field(default_factory=dict)
    eroded: Mapping[str, float] = field(default_factory=dict)
    optimised: Mapping[str, Optimised] = field(default_factory=dict)
    discrepancy: float = 0.0
    inside: bool = True
    runs: int = 0
    strikes: Mapping[str, int] = field(default_factory=dict)
    wall_s: float = 0.0
    warnings: tuple[str, ...] = ()
    failure: str | None = None
    measured: Mapping[str, MeasuredFigures] = field(default_factory=dict)

    @property
    def error(self) -> tuple[float, tuple[float, float]]:
        """Expected held-out error over the noise with its 95 % interval, of a model that is ranked."""
        assert self.expected is not None
        assert self.expected_95 is not None
        return self.expected, self.expected_95


@dataclass(frozen=True, repr=False)
class ModelComparison(Displayed):
    """All models over all shots.

    ranking: names, least expected held-out error first; per_shot: the same by shot; tied: names that share the first
    place, empty where the first stands alone; tied_per_shot: the same by shot; records: shot -> file; simulated:
    whether one of them is, simulated_shots: of which; sentence: the answer; speeds: shot -> impact speed [m/s];
    heldout_by: "shot", or "time block" of a single record; measured: shot -> points of its record by which errors are
    told, with their noise and what the sensors read at rest; warnings: of all models, one for each thing found, the
    gravest first.
    """

    models: Mapping[str, ModelAnswer]
    ranking: tuple[str, ...]
    per_shot: Mapping[str, tuple[str, ...]]
    tied: tuple[str, ...]
    tied_per_shot: Mapping[str, tuple[str, ...]]
    records: Mapping[str, str]
    speeds: Mapping[str, float]
    simulated: bool
    heldout_by: str
    sentence: str
    per_shot_sentences: Mapping[str, str]
    seed: int
    measured: Mapping[str, MeasuredFigures]
    warnings: tuple[str, ...] = ()
    simulated_shots: tuple[str, ...] = ()

    @classmethod
    def load(cls, path: str | Path) -> ModelComparison:
        """From models.json or the folder of calibrate_models, without the models' `residuals`, which it does not keep.

        Raises UserError for a file that is missing, damaged, of another version, or ranks no model.
        """
        return read_comparison(file_in(path, COMPARISON))

    @property
    def provenance(self) -> str:
        """Whether the records are measured, and of several which are simulated."""
        return provenance(list(self.records), self.simulated_shots)

    def as_json(self) -> dict[str, Any]:
        """`models.json`: the contract's keys, and beside them what the page shows."""
        tree = _COMPARISON.dump_python(self, mode="json")
        for name, model in tree["models"].items():
            model["verified_weighted"] = {shot: one["weighted"] for shot, one in model["verified"].items()}
            model["verified"] = {shot: one["rmse"] for shot, one in model["verified"].items()}
            model["strikes_per_shot"] = model["strikes"]
            model["strikes"] = sum(model["strikes"].values())
            model["wall_s"] = round(model["wall_s"], 1)
            del model["residuals"], model["measured"], tree["models"][name]["name"]
        return {"schema_version": SCHEMA_VERSION, **tree}

    @property
    def headline(self) -> str:
        """The answer, and each model's expected held-out error."""
        return self.sentence

    def to_dataframe(self) -> Any:
        """A row a model, best first: expected held-out error with its interval, that of each shot, strikes."""
        import pandas as pd

        rows = []
        for name in self.ranking:
            one = self.models[name]
            low, high = one.expected_95 or (None, None)
            own = {f"heldout {shot}": value for shot, value in one.heldout.items()}
            rows.append(
                {
                    "model": name,
                    "expected": one.expected,
                    "low_95": low,
                    "high_95": high,
                    "probability_best": one.probability_best,
                    **own,
                    "strikes": sum(one.strikes.values()),
                }
            )
        return pd.DataFrame(rows)

    def draw(self) -> tuple[Any, ...]:
        """No picture of its own; the page has them."""
        return ()


_COMPARISON = TypeAdapter(ModelComparison)
_ANSWER = TypeAdapter(ModelAnswer)


def save_comparison(folder: Path, found: ModelComparison, records: Sequence[Measured]) -> None:
    """Write models.json and the records that it ranks by, in place of another ranking, its records and its pages.

    A page of this same ranking stays.
    """
    path, content, earlier = folder / COMPARISON, json_values(found.as_json()), None
    with suppress(UserError):
        earlier = read_json(path)
    if earlier != content:
        withdraw(folder, COMPARISON, *PAGES, "records/*.csv")
    (folder / "records").mkdir(parents=True, exist_ok=True)
    for name, record in zip(found.records, records, strict=True):
        write_measured(folder / "records" / f"{name}.csv", record)
    write_json(path, content)


def withdraw_answer(folder: Path) -> None:
    """Remove a model's earlier answer before another is sought, and the ranking that may rest on it.

    A call that is interrupted would leave the earlier ranking beside constants, curves and draws of other records.
    """
    if any(next(folder.glob(pattern), None) for pattern in OF_AN_ANSWER):
        withdraw(folder.parent, COMPARISON, *PAGES)
        withdraw(folder, *OF_AN_ANSWER)


def save_answer(path: Path, answer: ModelAnswer, fingerprint: str) -> None:
    """Keep one model's answer, with what it was made from."""
    tree = {"fingerprint": fingerprint, "answer": _ANSWER.dump_python(answer, mode="json")}
    write_atomically(path, _JSON.dump_json(tree, indent=1).decode() + "\n")


def saved_answer(path: Path, fingerprint: str) -> ModelAnswer | None:
    """An answer kept before, where it was made from the same; None where there is none."""
    try:
        tree = _JSON.validate_json(path.read_bytes())
        return _ANSWER.validate_python(tree["answer"]) if tree["fingerprint"] == fingerprint else None
    except (OSError, ValueError, KeyError):
        return None


def read_comparison(place: Path, model: str = "") -> ModelComparison:
    """From models.json or its folder, without residuals, which it does not keep.

    model: one that must be ranked. Raises UserError where there is no such file, no model is ranked, or not this one.
    """
    path = place if place.name == COMPARISON else place / COMPARISON
    if not path.is_file():
        raise UserError(
            f"no {COMPARISON} in {path.parent}; make it, or resume what was interrupted, with: birdstrike "
            f"calibrate-models CASE --measured CSV --out {path.parent}"
        )
    try:
        tree = _JSON.validate_json(path.read_bytes())
        models = {name: _answer_of(name, own) for name, own in tree["models"].items()}
        found = _COMPARISON.validate_python({**tree, "models": models})
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise UserError(f"{path} is damaged or of another version; repeat birdstrike calibrate-models") from error
    if not found.ranking and not model:
        reasons = "; ".join(f"{name}: {one.failure}" for name, one in models.items())
        raise UserError(f"{path}: no model has an answer: {reasons}")
    if model and model not in found.ranking:
        raise UserError(f"{path}: {_not_ranked(found, model)}")
    return found


def emulator_notes(folder: Path) -> dict[str, Any] | None:
    """What stands beside the emulator in a model's folder: ranges, units, known points, clocks, all SI.

    None where there is none, or one of an earlier version, which had constants over decades as fractions of these.
    """
    found = read_json(folder / "emulator.json")
    return None if "clocks" not in found or found.get("logarithmic") else found


def _answer_of(name: str, tree: Mapping[str, Any]) -> ModelAnswer:
    """One model of models.json."""
    weighted = tree["verified_weighted"]
    verified = {shot: {"rmse": rmse, "weighted": weighted[shot]} for shot, rmse in tree["verified"].items()}
    own = {"name": name, "verified": verified, "strikes": tree["strikes_per_shot"]}
    return _ANSWER.validate_python({**tree, **own})


def _not_ranked(found: ModelComparison, model: str) -> str:
    """Why a comparison has no answer of a model, and how it gets one."""
    if model in found.models:
        return f"{model} has no answer: {found.models[model].failure}"
    said = f'ranks no model "{model}" but {", ".join(found.ranking) or "none"}'
    try:
        candidate(model)
    except UserError as error:
        return f"{said}; {'; '.join(error.errors).removeprefix('--models: ')}"
    wanted = ",".join([*found.models, model])
    return f"{said}; to have it, repeat calibrate-models with the same --out and --models {wanted}"


_JSON = TypeAdapter(dict[str, Any])
