"""From a campaign's folder and a measured file to an inversion's folder: what `birdstrike train-and-invert` does."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from data.curves import Measured, read_measured, write_histories
from data.dataset import Dataset
from data.errors import UserError
from data.paths import resolve_measured
from data.store import RunStore
from doe.campaign import load_dataset
from inversion.figures import TRAINING_FILE
from inversion.forward import Forward, StoredSolver
from inversion.inversion import Inversion
from inversion.invert import Options, Outcome, invert
from inversion.posterior_figures import DRAWS_FILE, write_draws
from inversion.verification import write_verification
from solver.case import Case, case_hash, load_case
from surrogate.files import save_emulator, save_network

Progress = Callable[[float], None]


def train_and_invert(
    doe_dir: str | Path,
    measured: str | Path | Measured,
    out: str | Path,
    trainer: str = "lm",
    method: str = "both",
    case: str | Path | Case | None = None,
    forward: Forward | None = None,
    seed: int = 0,
    progress: Progress | None = None,
    allow_rank_deficient: bool = False,
) -> Inversion:
    """Train on the campaign in `doe_dir`, invert `measured`, verify by the solver, and write everything to `out`.

    case: the campaign's own by default; forward: another forward model in the solver's place.
    Writes inversion.json, verification.csv, verified_<method>.csv, emulator.npz and, with the network, network.npz and
    training.csv. Raises UserError (exit code 1) and RunFailed (exit code 2).
    """
    doe, folder = Path(doe_dir), Path(out)
    dataset = load_dataset(doe)
    base = campaign_case(doe, dataset, case)
    record = measured if isinstance(measured, Measured) else read_measured(resolve_measured(measured))
    options = Options(
        trainer=trainer,
        method=method,
        seed=seed,
        noise={name: sensor.noise for name, sensor in base.sensors.items() if sensor.noise},
        time_offset=base.inversion.nuisance.get("time_offset", 0.0),
        allow_rank_deficient=allow_rank_deficient,
    )
    folder.mkdir(parents=True, exist_ok=True)  # an unwritable place is better known before the work than after
    solver = forward or StoredSolver(base, RunStore(folder / "runs"), (RunStore(doe / "runs"),))
    outcome = invert(dataset, record, solver, options, progress)
    write(folder, outcome, dataset, record)
    return outcome.inversion


def campaign_case(doe: Path, dataset: Dataset, case: str | Path | Case | None) -> Case:
    """The case that the campaign varied; raises UserError when the given one is another."""
    given = case if isinstance(case, Case) else load_case(doe / "case.toml" if case is None else case)
    if case_hash(given) == dataset.case_hash:
        return given
    raise UserError(
        f"the campaign in {doe} was run for another case (hash {dataset.case_hash}) than {given.name} "
        f"(hash {case_hash(given)}): its curves cannot explain this one's measurement; run run-doe for this case"
    )


def write(folder: Path, outcome: Outcome, dataset: Dataset, measured: Measured) -> None:
    """All files of an inversion; the JSON last, so that its presence means the rest is there."""
    folder.mkdir(parents=True, exist_ok=True)
    inversion = outcome.inversion
    save_emulator(folder / "emulator.npz", outcome.emulator, dataset)
    if outcome.network is not None:
        save_network(folder / "network.npz", outcome.network.network)
        outcome.network.training.write(folder / TRAINING_FILE)
    if outcome.posterior is not None:
        write_draws(folder / DRAWS_FILE, outcome.posterior, dataset.names)
    for method, verification in outcome.verified.items():
        if verification.histories is not None:
            write_histories(folder / f"verified_{method}.csv", verification.histories)
    t0 = inversion.time_offset.value
    write_verification(folder / "verification.csv", measured, outcome.observations, outcome.verified, t0)
    inversion.save(folder / "inversion.json")
