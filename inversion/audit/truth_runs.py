"""Truths simulated through the run store, and the records that are made of them.

All records of one truth share its simulations: with one and with all channels, of one and of three shots, without a
baseline, with one of another bird and of the shots' own; each has noise of its own. Everything follows from the seed,
so that a killed audit goes on where it stood; a truth whose simulation fails is drawn again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from numpy.random import Generator

from birdstrike.data.curves import Measured, write_measured
from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.histories import Array, Histories
from birdstrike.data.storage.files import write_atomically
from birdstrike.inversion.audit.draws import (
    BASELINE,
    CLEAN,
    CLEAN_ROLES,
    HELDOUT,
    OWN_BASELINE,
    PAIR,
    SHOTS,
    SINGLE,
    SLOPE,
    STEP,
    Drawn,
    draw,
    roles,
    sensor_of,
    with_effects_of,
)
from birdstrike.inversion.audit.records import (
    ANOTHER_BIRD,
    CURVES,
    NO_BASELINE,
    OWN_BIRD,
    TRUTH,
    Truth,
    curves_text,
    read_truth,
    truth_text,
)
from birdstrike.inversion.observations.expected import declared_drifts
from birdstrike.solver.case.case import Case, case_hash, load_case
from birdstrike.solver.case.write import case_toml

Simulate = Callable[[Mapping[str, Case]], dict[str, Histories]]
"""Histories by label of those cases whose simulation succeeded."""
BEFORE = 5.5e-4  # s of record before first contact, from which the noise is read
ATTEMPTS = 10
HEADER = (
    "SIMULATED, NOT MEASURED: a virtual experiment made by birdstrike's own solver, with noise added.",
    "The declared case stands in the file of the same name that ends in .toml. What the shot really was is sealed.",
)


@dataclass(frozen=True)
class Layout:
    """What a record of a truth consists of; baseline: NO_BASELINE, ANOTHER_BIRD or OWN_BIRD."""

    channels: tuple[str, ...]
    shots: int
    baseline: str


def layouts(case: Case) -> list[Layout]:
    """One and all channels, one and three shots, without a baseline, with one of another bird and of the same bird.

    Those with the same bird come last, so that a layout keeps the number by which its records are called.
    """
    names = tuple(case.sensors)
    sets = [names[:1]] if len(names) == 1 else [names[:1], names]
    shots = (1, len(SHOTS))
    first = product(sets, shots, (NO_BASELINE, ANOTHER_BIRD))
    return [Layout(*one) for one in (*first, *product(sets, shots, (OWN_BIRD,)))]


def refuse_other_truths(case: Case, folder: Path, seed: int) -> None:
    """Raise UserError where the folder holds truths of another declared case or of another seed than those to be made.

    They would be taken for these, because a truth that is there is not made again.
    """
    declared = _declared(case)
    for path in sorted(folder.glob(f"*{TRUTH}")):
        made, given = read_truth(path).seed, path.with_name(f"{path.name.removesuffix(TRUTH)}.toml")
        if made not in (None, seed):
            raise UserError(
                f"--seed = {seed}: {folder} holds truths of --seed {made}, such as {path.name}; give that seed, "
                "or another --out"
            )
        if given.read_text(encoding="utf-8") != declared and case_hash(load_case(given)) != case_hash(case):
            raise UserError(
                f"--case = {case.name}: {folder} holds truths of another case, {given.name}; give the case of which "
                "they are, or another --out"
            )


def make_experiments(
    case: Case,
    folder: Path,
    simulate: Simulate,
    count: int,
    seed: int = 0,
    *,
    forms: bool = False,
    wanted: tuple[Layout, ...] = (),
) -> None:
    """Write the experiments of `count` truths into `folder`, those that are there already left alone.

    forms: of the model-form variant; wanted: by default all layouts; a layout has its number whatever is wanted. Raises
    RunFailed where a truth fails every time.
    """
    own = {i: one for i, one in enumerate(layouts(case)) if not wanted or one in wanted}
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(count):
        stem = f"{'form' if forms else 'truth'}_{number:03d}"
        names = [f"{stem}_{i + 1}" for i in own]
        if not all((folder / f"{name}{TRUTH}").is_file() for name in names):
            drawn, histories = _simulated(case, simulate, seed, number, forms, tuple(own.values()))
            columns = _columns(case, drawn, histories)
            write_atomically(folder / f"{stem}{CURVES}", curves_text(*columns))
            for name, (i, layout) in zip(names, own.items(), strict=True):
                rng = np.random.default_rng([seed, number, int(forms), i])
                _write(folder, name, case, drawn, layout, columns, rng, stem, seed)


def _simulated(
    case: Case, simulate: Simulate, seed: int, number: int, forms: bool, wanted: tuple[Layout, ...]
) -> tuple[Drawn, dict[str, Histories]]:
    """A truth with all its simulations, drawn again until they succeed."""
    reason, shots = "", max(one.shots for one in wanted)
    for attempt in range(ATTEMPTS):
        drawn = draw(case, seed, number, forms, attempt)
        try:
            cases = roles(drawn, case, shots, own_baseline=any(one.baseline == OWN_BIRD for one in wanted))
        except UserError as error:
            reason = str(error)
            continue
        histories = simulate(cases)
        missing = [role for role in cases if role not in histories]
        if not missing:
            return drawn, histories
        reason = f"{', '.join(missing)} failed"
    raise RunFailed(
        f"truth {number} failed {ATTEMPTS} times: {reason}", "use a case that runs over its whole parameter range"
    )


def _columns(
    case: Case, drawn: Drawn, histories: Mapping[str, Histories]
) -> tuple[Array, dict[tuple[str, str], Array]]:
    """The clock of the records and the noise-free curves on it, from well before contact to the declared end."""
    step = case.time.output_interval
    early = max(int(np.ceil((BEFORE - case.first_contact) / step)), 0)
    time = step * np.arange(-early, round(case.time.end / step) + 1)
    found: dict[tuple[str, str], Array] = {}
    for role, one in histories.items():
        if role.startswith(SLOPE):
            continue
        drifts = _drifts(case, drawn, role)
        for sensor in case.sensors:
            values = np.interp(time, one.time, one.channels[sensor])
            found[role, sensor] = np.where(time < 0.0, drifts.get(sensor, 0.0) * time, values)
    for p in case.parameters() if drawn.effects else ():
        low, high = (histories[f"{SLOPE} {p.name} {sign}"] for sign in ("-1", "+1"))
        ends = np.clip(drawn.parameters[p.name] + np.array([-1, 1]) * STEP * (p.high - p.low), p.low, p.high)
        share = float(ends[1] - ends[0]) / (p.high - p.low)
        for sensor in case.sensors:
            change = high.channels[sensor] - low.channels[sensor]
            found[f"{SLOPE} {p.name}", sensor] = np.interp(time, low.time, change) / share
    return time, found


def _drifts(case: Case, drawn: Drawn, role: str) -> dict[str, float]:
    """Sensor -> drift [SI/s] of its instrument, declared or drawn, which runs before contact as well."""
    return declared_drifts(case if role in CLEAN_ROLES else with_effects_of(case, drawn.effects, role))


def visible(drawn: Drawn, layout: Layout) -> dict[str, float]:
    """The effects of a truth that a record can show: a fault of a sensor that it does not have is not there."""
    shown = {}
    for label, value in drawn.effects.items():
        sensor = sensor_of(label)
        if not sensor or sensor in layout.channels:
            shown[label] = value
    return shown


def _write(
    folder: Path,
    name: str,
    case: Case,
    drawn: Drawn,
    layout: Layout,
    columns: tuple[Array, Mapping[tuple[str, str], Array]],
    rng: Generator,
    curves: str,
    seed: int,
) -> None:
    """Declared case, records and, last, the sealed truth."""
    time, clean = columns
    write_atomically(folder / f"{name}.toml", _declared(case, layout.baseline))
    for role, ending, channels in _files(case, layout):
        record = {sensor: clean[role, sensor] for sensor in channels}
        write_measured(folder / f"{name}{ending}", noisy(case, time, record, rng))
    shown = visible(drawn, layout)
    kind = {0: CLEAN, 1: SINGLE, 2: PAIR}[len(shown)] if drawn.effects else drawn.kind
    truth = Truth(kind, curves, drawn.form, drawn.what, shown, drawn.parameters, seed=seed)
    write_atomically(folder / f"{name}{TRUTH}", truth_text(truth, f"{curves}{CURVES}"))


def _declared(case: Case, baseline: str = NO_BASELINE) -> str:
    """Text of the file of the declared case, with what is known of the baseline's bird."""
    known = "same" if baseline == OWN_BIRD else "auto"
    if known != case.diagnosis.baseline_bird:
        case = case.overlaid({"diagnosis": {"baseline_bird": known}})
    return f"# Declared case of a virtual experiment.\n{case_toml(case)}"


def _files(case: Case, layout: Layout) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """Role, ending of the file, channels."""
    for i, shot in enumerate(SHOTS[: layout.shots]):
        yield shot, f".{shot}.csv" if i else ".csv", layout.channels
    if layout.baseline != NO_BASELINE:
        yield OWN_BASELINE if layout.baseline == OWN_BIRD else BASELINE, ".baseline.csv", layout.channels
    yield HELDOUT, ".heldout.csv", tuple(case.sensors)


def noisy(case: Case, time: Array, clean: Mapping[str, Array], rng: Generator) -> Measured:
    """White noise of each sensor's own level."""
    channels = {
        name: values + (case.sensors[name].noise or 0.0) * rng.standard_normal(len(values))
        for name, values in clean.items()
    }
    return Measured(time, channels, {}, {name: case.sensors[name].unit for name in channels}, HEADER)
