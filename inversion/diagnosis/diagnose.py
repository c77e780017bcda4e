"""`birdstrike diagnose`: from a case and a record to a verdict, an effect's name, the error before and after."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from birdstrike.data.curves import Measured, read_measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import MeasuredError, UserError
from birdstrike.data.paths import resolve_measured
from birdstrike.doe.campaign.campaign import run_campaign
from birdstrike.doe.campaign.results import load_dataset
from birdstrike.doe.campaign.run import retry_before
from birdstrike.doe.designs.registry import make_design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.diagnosis.diagnosis import Diagnosis
from birdstrike.inversion.diagnosis.groundwork import prepare
from birdstrike.inversion.diagnosis.strikes import Strikes
from birdstrike.inversion.diagnosis.study import Study
from birdstrike.inversion.diagnosis.wishes import Wishes, quiet, uncounted
from birdstrike.inversion.diagnosis.write import write
from birdstrike.inversion.train_and_invert import campaign_case
from birdstrike.solver.case.case import Case, load_case


def diagnose(
    case: str | Path | Case,
    measured: str | Path | Measured,
    out: str | Path,
    doe: str | Path | None = None,
    heldout: str | Path | Measured | None = None,
    wishes: Wishes | None = None,
    retry_failed: bool = False,
) -> Diagnosis:
    """Diagnose the record and write `diagnosis.json`, the curves and, where an effect helps, the case with it.

    doe: folder of a finished campaign of the case (else one is run in `out/doe`); heldout: another shot of the same
    case, which nothing is fitted to; retry_failed: runs with a failure on record are tried again.
    Raises UserError and RunFailed; every strike that was paid stays in `out/runs`.
    """
    choice, folder = wishes or Wishes(), Path(out)
    choice = replace(choice, retry=retry_before(True)) if retry_failed else choice
    if not 0.0 < choice.alpha < 0.5:
        raise UserError(f"--alpha = {choice.alpha} is outside 0 .. 0.5; 0.05 is usual")
    loaded = load_case(case) if isinstance(case, str | Path) else case
    record = _read(measured)
    shot = None if heldout is None else _read(heldout)
    _refuse_unknown(loaded, record, shot)
    folder.mkdir(parents=True, exist_ok=True)
    dataset, campaign = _campaign(loaded, folder, doe, choice)
    read, workers, retry = (campaign / "runs",), choice.workers, choice.retry
    with choice.counter() as shown, Strikes(folder / "runs", read, workers, shown, retry) as strikes:
        with choice.display("Emulator, and strikes for every effect and numerical choice") as progress:
            ground = prepare(loaded, dataset, tuple(record.channels), strikes, progress)
        found = Study(ground, strikes, choice).diagnosis(record, shot)
    return write(found, folder)


def _read(measured: str | Path | Measured) -> Measured:
    return measured if isinstance(measured, Measured) else read_measured(resolve_measured(measured))


def _refuse_unknown(case: Case, record: Measured, shot: Measured | None) -> None:
    """Raise MeasuredError for channels that the case or the other shot lacks, before any strike is paid for."""
    known = ", ".join(case.sensors)
    unknown = [name for name in record.channels if name not in case.sensors]
    errors = [f'{record.path}: channel "{n}" is no sensor of case {case.name}; its sensors: {known}' for n in unknown]
    missing = [name for name in record.channels if shot is not None and name not in shot.channels]
    errors += [
        f'{shot.path if shot else ""}: channel "{n}" is missing; the two records must have the same' for n in missing
    ]
    if errors:
        raise MeasuredError(errors)


def _campaign(case: Case, folder: Path, doe: str | Path | None, choice: Wishes) -> tuple[Dataset, Path]:
    """The campaign given, or one's own."""
    if doe is not None:
        dataset = load_dataset(Path(doe))
        campaign_case(Path(doe), dataset, case)
        return dataset, Path(doe)
    design = make_design("uniform", ParameterSpace.of(case.parameters()), choice.runs, choice.seed)
    with choice.counter() as shown:
        dataset = run_campaign(
            case,
            design,
            folder / "doe",
            workers=choice.workers,
            progress=shown,
            say=lambda _: None,
            retry=choice.retry,
        )
    return dataset, folder / "doe"


__all__ = ["Study", "Wishes", "diagnose", "quiet", "uncounted"]
