"""What a card export is about: the birds of a case or of an inversion, and what is known of their constants."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from birdstrike.data.errors import UserError
from birdstrike.data.formatting import listing, quantity, span
from birdstrike.data.storage.out_folder import maker_of, model_of
from birdstrike.doe.campaign.folder import stored_case
from birdstrike.inversion.estimation.verification import error_words
from birdstrike.inversion.labels import flight
from birdstrike.inversion.models.results import COMPARISON, read_comparison
from birdstrike.inversion.results.diagnosis import Diagnosis
from birdstrike.inversion.results.estimates import Answer, Estimate
from birdstrike.inversion.results.inversion import Inversion
from birdstrike.solver.bird.materials.interface import BirdMaterial
from birdstrike.solver.case.bird import Bird
from birdstrike.solver.case.case import Case, CaseSource, as_case, case_hash, load_case

MATERIAL = "bird.material."
COMPARED = ("elastic", "plastic_kinematic", "hydrodynamic")
"""The other bird models of the paper, shipped as cases of the reference strike."""


@dataclass(frozen=True)
class ExportedBird:
    """One bird; density [kg/m^3]; remarks: lines about it, the constants that an inversion sought among them.

    sph: whether particles carry it, else hexahedra.
    """

    name: str
    material: BirdMaterial
    density: float
    remarks: tuple[str, ...]
    sph: bool = True

    @classmethod
    def of(cls, name: str, bird: Bird, remarks: Iterable[str]) -> ExportedBird:
        """The bird of a case."""
        return cls(name, bird.material, bird.actual_density, tuple(remarks), bird.method == "sph")


@dataclass(frozen=True)
class Export:
    """Everything that goes into a file of cards, the bird that it is about first; source: lines for its head."""

    birds: tuple[ExportedBird, ...]
    source: tuple[str, ...]


def read_export(
    target: CaseSource,
    case: str | Path | None = None,
    method: str = "best",
    settings: Mapping[str, Any] | None = None,
    model: str = "",
) -> Export:
    """The birds of a case, or of the folder of train-and-invert, diagnose, calibrate-models or close-the-loop.

    case: the inversion's case where the folder does not hold it; method: network, emulator, or best, the one whose
    verification differs least from the record; settings: dotted keys laid over a case; model: of calibrate-models, the
    first of its ranking where none is named. An inverted bird comes with the three that it is compared with. Raises
    UserError.
    """
    if not isinstance(target, str | Path):
        refuse_choices(case, method, model)
        return _of_case(as_case(target, settings))
    folder = Path(target)
    if (chosen := chosen_model(folder, model)) is not None:
        if case is not None or method != "best":
            raise UserError(f"--case and --method are of inversions; a model of {chosen[0]} is chosen by --model alone")
        return _of_model(*chosen)
    if not folder.is_dir():
        refuse_choices(case, method)
        return _of_case(load_case(target, settings))
    path = next((p for p in (folder / "inversion.json", folder / "inversion" / "inversion.json") if p.is_file()), None)
    if path is None and (folder / "diagnosis.json").is_file():
        if method != "best":
            raise UserError(f"--method {method}: {folder} is of a diagnosis, which has one answer; leave it out")
        return _of_diagnosis(folder / "diagnosis.json", case)
    if path is None:
        maker = maker_of(folder)
        made = f"was made by birdstrike {maker} and " if maker else ""
        raise UserError(
            f"{folder} {made}holds no inversion.json; make it with train-and-invert or close-the-loop, or give a "
            "folder of calibrate-models"
        )
    inversion = Inversion.load(path)
    base, name = _case_of(path, inversion, case), _chosen(path, inversion, method)
    answer = inversion.methods[name]
    inverted = base.with_values(_point(answer))
    source = (
        f"Inverted by the {name} ({path.name}). The simulation at these values differs from the record by "
        f"{error_words(answer)}.",
        f"{'Records' if len(inversion.records) > 1 else 'Record'}: {', '.join(map(_record, inversion.records))}"
        f"{_simulated(inversion)}.",
        f"Case {case_hash(base)}: {_impact(base)}.",
    )
    first = ExportedBird.of("inverted", inverted.bird, _found(inversion, name))
    return Export((first, *_compared(first)), source)


def refuse_choices(case: str | Path | None, method: str, model: str = "") -> None:
    """Raises UserError for options that choose from a folder of results, where a case is exported."""
    given = {"--case": case, "--method": "" if method == "best" else method, "--model": model}
    if wrong := [f"{option} {value}" for option, value in given.items() if value]:
        raise UserError(
            f"{listing(wrong)}: a case is exported, and {'these choose' if len(wrong) > 1 else 'this chooses'} from a "
            "folder of results; leave it out, or give the folder of train-and-invert or calibrate-models"
        )


def _record(path: str) -> str:
    return Path(path).name


def _simulated(inversion: Inversion) -> str:
    """Which of its records are no measurements; empty for none."""
    if not (found := inversion.simulated_records):
        return ""
    which = f"of which {listing([*map(_record, found)])} {'are' if len(found) > 1 else 'is'}"
    return f", {'which is' if len(inversion.records) == 1 else which} SIMULATED, NOT MEASURED"


def chosen_model(folder: Path, model: str = "") -> tuple[Path, str] | None:
    """The calibrate-models' folder and which of its models is exported; None for a folder of another kind or a case.

    folder: that of calibrate-models, or one of a model in it; model: the name given, "" for the first of the ranking.
    Raises UserError for a model that has no answer, and for a name where there are no models to choose from.
    """
    whole, own = (folder, "") if maker_of(folder) == "calibrate-models" else model_of(folder) or (None, "")
    if whole is None:
        if model:
            raise UserError(f"--model {model} chooses from the folder of birdstrike calibrate-models, not {folder}")
        return None
    if model and own and model != own:
        raise UserError(f"--model {model}: {folder} is of the bird model {own}; give {whole}")
    comparison = read_comparison(whole, model or own)
    return whole, model or own or comparison.ranking[0]


def _of_model(folder: Path, name: str) -> Export:
    """The bird of one calibrated model of a comparison, with what is known of its constants."""
    comparison = read_comparison(folder, name)
    answer, shots = comparison.models[name], list(comparison.speeds)
    base = stored_case(folder / name / shots[0])
    values = {key: one.value for key, one in answer.parameters.items() if one.value is not None}
    bird = base.with_values(values).bird
    remarks = [
        f"{key.removeprefix(MATERIAL)}: {_known(one, one.value, answer.ranges[key])}"
        for key, one in answer.parameters.items()
    ]
    remarks += [one.sentence for one in answer.combinations.values() if one.sentence]
    error, (low, high) = answer.error
    files = ", ".join(Path(comparison.records[shot]).name for shot in shots)
    source = (
        f"Bird model {name} calibrated by calibrate-models ({COMPARISON}), place {comparison.ranking.index(name) + 1} "
        f"of {len(comparison.ranking)}, held-out error {error:.2f} times the noise (95 %: {low:.2f} .. "
        f"{high:.2f}).",
        *([] if answer.inside else ["NO CONSTANTS in its ranges produce the records: these are only the nearest."]),
        f"{comparison.sentence}.",
        f"Records: {files}. {comparison.provenance}.",
        f"Case of the first {case_hash(base)}: {_impact(base)}.",
    )
    return Export((ExportedBird.of(name, bird, remarks),), source)


def _of_diagnosis(path: Path, case: str | Path | None) -> Export:
    """The bird that a diagnosis fitted, with the likeliest effect in its model where there is one."""
    beside = path.parent / "case.toml"
    if case is None and not beside.is_file():
        raise UserError(f"{path.parent} does not hold the declared case; name it: --case CASE.toml")
    declared = load_case(case or beside)
    found = Diagnosis.read(path)
    estimates = {key: _estimate(one) for key, one in (found.after or found.before).parameters.items()}
    bird = declared.with_values((found.after or found.before).point).bird
    ranges = {parameter.name: (parameter.low, parameter.high) for parameter in declared.parameters()}
    known = [
        f"{key.removeprefix(MATERIAL)}: {_known(one, one.value, ranges.get(key, (math.nan, math.nan)))}"
        for key, one in estimates.items()
    ]
    model = "with its likeliest effect" if found.after else "without effects"
    source = (
        f"Fitted by the diagnosis ({path.name}), {model}.",
        *_records(found),
        f"Case {case_hash(declared)}: {_impact(declared)}.",
    )
    return Export((ExportedBird.of("inverted", bird, known),), source)


def _records(found: Diagnosis) -> tuple[str, ...]:
    """What a diagnosis was made of, and of several shots whose bird is written."""
    first, *others = found.record["shots"]
    said = f"{'Records' if others else 'Record'}: {', '.join((first, *others))}. {found.provenance}."
    return (said, f"The bird is that of shot {first}; every shot has its own (`shots` there).") if others else (said,)


def _estimate(one: Mapping[str, Any]) -> Estimate:
    interval = one["interval_95"]
    limits = None if interval is None else (float(interval[0]), float(interval[1]))
    return Estimate(one["value"], limits, one["unit"], one["identified"], "")


def _of_case(case: Case) -> Export:
    bird = ExportedBird.of(case.name, case.bird, ("From the case; not inverted.",))
    return Export((bird,), (f"Case {case.name} ({case_hash(case)}): {_impact(case)}.",))


def _impact(case: Case) -> str:
    return f"bird of {quantity(case.bird.actual_mass, 'kg')}, {flight(case.impact)}"


def _compared(first: ExportedBird) -> Iterator[ExportedBird]:
    """The paper's other three birds, at the density of this one so that all weigh the same, and by its method."""
    for model in COMPARED:
        material = load_case(f"reference_strike_{model}").bird.material
        remark = "Constants of the paper (Tables 10 to 13); not inverted."
        yield ExportedBird(model, material, first.density, (remark,), first.sph)


def _case_of(path: Path, inversion: Inversion, given: str | Path | None) -> Case:
    """The case that was inverted: the one given, or the campaign's beside the inversion; it must be the same impact."""
    beside = [path.parent / "case.toml", path.parent.parent / "doe" / "case.toml"]
    found = given or next((file for file in beside if file.is_file()), None)
    if found is None:
        raise UserError(f"{path.parent} does not hold the case; name it: --case CAMPAIGN/case.toml")
    case = load_case(found)
    if case_hash(case) != inversion.case_hash:
        raise UserError(
            f"{found} has the case hash {case_hash(case)}, but {path} was inverted with {inversion.case_hash}; "
            "name the campaign's own: --case CAMPAIGN/case.toml"
        )
    return case


def _chosen(path: Path, inversion: Inversion, method: str) -> str:
    if method == "best" and inversion.best is not None:
        return inversion.best
    if method in inversion.methods:
        return method
    why = "no verification finished" if method == "best" else f'"{method}" was not run'
    raise UserError(f"{path}: {why}; available: --method {' or '.join(inversion.methods)}")


def _point(answer: Answer) -> Mapping[str, float]:
    """The values at which the solver verified the answer, SI."""
    if answer.combination is not None:
        return answer.combination.point
    return {key: estimate.value for key, estimate in answer.parameters.items() if estimate.value is not None}


def _found(inversion: Inversion, method: str) -> Iterator[str]:
    """A line for every parameter that was sought: its interval, or that it is not identified."""
    answer = inversion.methods[method]
    point = _point(answer)
    for key, estimate in answer.parameters.items():
        yield f"{key.removeprefix(MATERIAL)}: {_known(estimate, point.get(key), inversion.ranges[key])}"
    if answer.combination is not None:
        yield f"NOT SEPARATE ESTIMATES: {answer.combination.sentence}"


def _known(estimate: Estimate, value: float | None, limits: tuple[float, float]) -> str:
    shown = "no value" if value is None else quantity(value, estimate.unit, 4)
    if estimate.identified and estimate.interval_95 is not None:
        return f"identified, {shown}, 95 % interval {span(*estimate.interval_95, estimate.unit, 4)}"
    return f"NOT IDENTIFIED in {span(*limits, estimate.unit)}; {shown} is only where the verification ran"
