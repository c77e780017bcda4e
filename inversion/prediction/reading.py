"""A results folder read for a prediction, by the command that made it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from birdstrike.data.errors import UserError
from birdstrike.data.storage.out_folder import model_of
from birdstrike.inversion.prediction.from_diagnosis import read_diagnosis
from birdstrike.inversion.prediction.from_inversion import read_inversion
from birdstrike.inversion.prediction.from_models import read_models
from birdstrike.inversion.prediction.learnt import Learnt
from birdstrike.inversion.results.same_shot import refuse_two_shots

READERS: tuple[tuple[str, str, Callable[[Path], Learnt]], ...] = (
    ("diagnosis.json", "diagnosis", read_diagnosis),
    ("models.json", "models", read_models),
    ("inversion.json", "inversion", read_inversion),
)
"""File by which a folder is known, its folder in a close-the-loop's, reader; what tells most stands first."""


def read_learnt(folder: Path) -> Learnt:
    """What a folder of train-and-invert, diagnose, calibrate-models or close-the-loop tells; raises UserError.

    A bird model's folder in that of calibrate-models tells of this model alone.
    """
    if not folder.is_dir():
        raise UserError(
            f"--from {folder}: there is no such folder; name the --out of train-and-invert, diagnose, calibrate-models "
            "or close-the-loop"
        )
    refuse_two_shots(folder)
    for file, below, reader in READERS:
        for place in (folder, folder / below):
            if (place / file).is_file():
                return reader(place)
    if of_model := model_of(folder):
        return read_models(*of_model)
    names = ", ".join(file for file, _, _ in READERS)
    raise UserError(
        f"--from {folder} holds no results: none of {names}; name the --out of train-and-invert, diagnose, "
        "calibrate-models or close-the-loop, once that command has finished"
    )
