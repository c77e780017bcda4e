"""The small campaign over the new case: some draws simulated, an emulator of them where its Q2 allows, a few on a finer
mesh.

The simulated points are draws of the posterior themselves, so that they serve as such where no emulator is good enough.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import CaseError, RunFailed
from birdstrike.data.histories import Array, Histories
from birdstrike.data.progress import Progress
from birdstrike.data.run_warnings import merged
from birdstrike.doe.campaign.simulations import Simulations
from birdstrike.inversion.diagnosis.preparation.plan import meshes
from birdstrike.inversion.estimation.mesh_correction import fine_mesh, spread
from birdstrike.inversion.models.candidates import with_material
from birdstrike.inversion.prediction.learnt import Learnt
from birdstrike.inversion.prediction.sample import EFFECT, Sample
from birdstrike.solver.case.case import Case, case_hash
from birdstrike.surrogate.emulator import CurveEmulator, Emulator, fit_emulator

GOOD_Q2 = 0.9
FINE = 3  # simulations on the finer mesh: a mean and its scatter
LEAST_FINISHED = 0.6  # of the simulations
TORN = "eroded_shells"


@dataclass(frozen=True)
class Family:
    """Explanations of one bird model: their numbers, the dotted keys that vary, their emulators by sensor."""

    members: tuple[int, ...]
    keys: tuple[str, ...]
    emulator: Emulator | None

    def curve(self, sensor: str) -> CurveEmulator | None:
        """The sensor's emulator where its Q2 allows; None where the draws themselves are taken."""
        one = None if self.emulator is None else self.emulator.channels.get(sensor)
        return one if one is not None and one.validation.q2 >= GOOD_Q2 else None


@dataclass(frozen=True)
class Campaign:
    """What was simulated.

    case: on the campaign's mesh; points: the draws whose simulation finished; time: (m,) [s]; curves: sensor -> (n, m)
    SI; torn: (n,) whether shells were eroded; families: by bird model; finer: sensor -> (fine, m) SI, what the finer
    mesh adds, empty where none was asked for; counts, failures: of the simulations; warnings: that they give.
    """

    case: Case
    points: Sample
    time: Array
    curves: Mapping[str, Array]
    torn: NDArray[np.bool_]
    families: tuple[Family, ...]
    finer: Mapping[str, Array]
    counts: Mapping[str, int]
    failures: Mapping[str, str]
    warnings: tuple[str, ...] = ()

    def emulated(self, sensor: str) -> bool:
        """Whether every family has an emulator of the sensor that may be used, and no simulation tore the plate."""
        return not self.torn.any() and all(one.curve(sensor) is not None for one in self.families)

    def q2(self, sensor: str) -> float | None:
        """The least of the families' leave-one-out Q2; None without an emulator."""
        emulators = [one.emulator for one in self.families]
        found = [float(one.channels[sensor].validation.q2) for one in emulators if one is not None]
        return min(found) if len(found) == len(emulators) else None

    def mesh_mean(self, sensor: str) -> Array:
        """(m,) SI: mean of what the finer mesh adds, 0 where none was asked for."""
        return self.finer[sensor].mean(axis=0) if sensor in self.finer else np.zeros(len(self.time))

    def mesh_draws(self, sensor: str, n: int, rng: np.random.Generator) -> Array:
        """(n, m) SI about that mean: its scatter over the places."""
        if sensor not in self.finer:
            return np.zeros((n, len(self.time)))
        rows = self.finer[sensor]
        left = (rows - rows.mean(axis=0)) / np.sqrt(max(len(rows) - 1, 1))
        return rng.standard_normal((n, len(rows))) @ left * np.sqrt(1.0 + 1.0 / len(rows))


def case_at(base: Case, values: Mapping[str, float]) -> Case:
    """A case with a draw's parameters, tolerances and effects, beside those that it states; raises CaseError."""
    keys = {key: value for key, value in values.items() if not key.startswith(EFFECT)}
    sizes = {key.removeprefix(EFFECT): value for key, value in values.items() if key.startswith(EFFECT) and value}
    case = base.with_values(keys)
    if not sizes:
        return case
    return case.with_effects({**case.effects, **{n: case.effects.get(n, 0.0) + x for n, x in sizes.items()}})


def run_campaign(
    learnt: Learnt,
    case: Case,
    points: Sample,
    simulations: Simulations,
    progress: Progress,
    seed: int,
    simulated: Callable[[], None] = lambda: None,
) -> Campaign:
    """Simulate the points, call `simulated`, and fit the emulators; raises RunFailed when too few finish."""
    coarse, fine = used_meshes(learnt, case)
    chosen = _fine_points(points) if fine is not None else []
    cases, failures = _cases(learnt, points, coarse, fine, chosen)
    runs = simulations.run(cases)
    simulated()
    failures |= simulations.failures
    done = [i for i in range(len(points)) if f"draw {i}" in runs]
    if len(done) < max(3, LEAST_FINISHED * len(points)):
        reason = next(iter(failures.values()), "")
        raise RunFailed(
            f"{len(done)} of {len(points)} simulations of the new case finished: {reason}",
            "check the case by birdstrike simulate; a lower speed or a thicker plate may lie where the model holds",
        )
    first = runs[f"draw {done[0]}"]
    time = first.time
    curves = {name: np.array([runs[f"draw {i}"].channels[name] for i in done]) for name in case.sensors}
    torn = np.array([bool(runs[f"draw {i}"].summary.get(TORN, 0)) for i in done])
    kept = _reweighted(points, done, len(learnt.explanations))
    with threadpool_limits(limits=1, user_api="blas"):
        families = _families(learnt, coarse, kept, time, curves, first, progress, seed)
    pairs = [i for i in chosen if f"fine {i}" in runs and i in done]
    added = {
        name: np.array([_difference(runs[f"fine {i}"], runs[f"draw {i}"], name, time) for i in pairs])
        for name in case.sensors
        if len(pairs) > 1
    }
    counts = {"asked": len(points), "finished": len(done), "finer": len(pairs)}
    return Campaign(
        case=coarse,
        points=kept,
        time=time,
        curves=curves,
        torn=torn,
        families=families,
        finer=added,
        counts=counts,
        failures=failures,
        warnings=merged([runs[f"draw {i}"].summary.get("warnings", []) for i in done]),
    )


def _cases(
    learnt: Learnt, points: Sample, coarse: Case, fine: Case | None, chosen: Sequence[int]
) -> tuple[dict[str, Case], dict[str, str]]:
    """Cases of the draws, `draw 0` and so on, and of the chosen ones on the finer mesh, `fine 0`; why a draw has none.

    coarse, fine: the new case on both meshes.
    """
    bases, failures, cases = _bases(learnt, coarse), dict[str, str](), dict[str, Case]()
    for i in range(len(points)):
        try:
            cases[f"draw {i}"] = case_at(bases[int(points.explanation[i])], points.at(i))
        except CaseError as error:
            failures[f"draw {i}"] = "; ".join(error.errors)
    if fine is not None:
        finer, there = _bases(learnt, fine), [i for i in chosen if f"draw {i}" in cases]
        cases |= {f"fine {i}": case_at(finer[int(points.explanation[i])], points.at(i)) for i in there}
    return cases, failures


def _difference(fine: Histories, coarse: Histories, name: str, time: Array) -> Array:
    return np.interp(time, fine.time, fine.channels[name]) - coarse.channels[name]


def used_meshes(learnt: Learnt, case: Case) -> tuple[Case, Case | None]:
    """The meshes of the campaign and of its correction: those that what was learnt stands for."""
    if learnt.diagnosed and learnt.corrected:
        return meshes(case)
    return case, (fine_mesh(case, case) if learnt.corrected else None)


def _bases(learnt: Learnt, case: Case) -> list[Case]:
    """The case with each explanation's bird material; it seeks nothing of its own bird's then."""
    return [case if not one.material else with_material(case, one.material) for one in learnt.explanations]


def _fine_points(points: Sample) -> list[int]:
    """Draws of the likeliest explanation that are most spread."""
    share = np.bincount(points.explanation, weights=points.weights)
    own = np.flatnonzero(points.explanation == int(share.argmax()))
    columns = np.stack([column[own] for column in points.values.values() if np.isfinite(column[own]).all()], axis=1)
    low, width = columns.min(axis=0), np.ptp(columns, axis=0)
    unit = (columns - low)[:, width > 0.0] / width[width > 0.0]
    return [int(own[i]) for i in spread(unit)[:FINE]] if unit.shape[1] else [int(i) for i in own[:FINE]]


def _reweighted(points: Sample, done: list[int], explanations: int) -> Sample:
    """The finished points; what an explanation's failed ones weighed is its others'."""
    kept = points.take(np.array(done))
    before = np.bincount(points.explanation, weights=points.weights, minlength=explanations)
    counts = np.bincount(kept.explanation, minlength=explanations)
    weights = before[kept.explanation] / counts[kept.explanation]
    return Sample(kept.explanation, kept.row, kept.values, kept.faults, weights / weights.sum())


def _families(
    learnt: Learnt,
    case: Case,
    points: Sample,
    time: Array,
    curves: Mapping[str, Array],
    first: Histories,
    progress: Progress,
    seed: int,
) -> tuple[Family, ...]:
    """One a bird model, with an emulator where there are enough points."""
    groups: dict[str, list[int]] = {}
    for i, one in enumerate(learnt.explanations):
        groups.setdefault(repr((one.names, one.material)), []).append(i)
    found: list[Family] = []
    for members in groups.values():
        of = np.isin(points.explanation, members)
        columns = {key: values[of] for key, values in points.values.items() if np.isfinite(values[of]).all()}
        varied = tuple(key for key, values in columns.items() if len(values) and np.ptp(values) > 0.0)
        emulator = None
        if varied and of.sum() >= max(len(varied) + 2, 6):
            x = np.stack([columns[key] for key in varied], axis=1)
            data = Dataset(
                names=varied,
                units=("",) * len(varied),
                lows=x.min(axis=0),
                highs=x.max(axis=0),
                runs=np.arange(1, int(of.sum()) + 1),
                parameters=x,
                time=time,
                curves={name: rows[of] for name, rows in curves.items()},
                channel_units=dict(first.units),
                smooth=np.ones(int(of.sum()), dtype=bool),
                case_hash=case_hash(case),
            )
            emulator = fit_emulator(data, list(curves), seed, progress)
        found.append(Family(tuple(members), varied, emulator))
    return tuple(found)
