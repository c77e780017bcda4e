"""The posterior's draws as arviz holds them."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from birdstrike.data.errors import UserError

if TYPE_CHECKING:
    from arviz import InferenceData

    from birdstrike.inversion.results.identifiability import PosteriorFigures


def inference_data(figures: PosteriorFigures | None, folder: Path) -> InferenceData:
    """Group `posterior` of the draws that train_and_invert left in `folder`, a variable for each dotted key, SI.

    The file holds draws taken evenly from all chains, hence one chain here; R-hat and effective sizes of the chains
    themselves stand in the attributes. Raises UserError where no posterior was drawn.
    """
    if figures is None or not (folder / figures.draws).is_file():
        raise UserError(f"no draws of a posterior in {folder}; repeat train-and-invert with the emulator's posterior")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # arviz announces its next version on import
        import arviz

    table = pd.read_csv(folder / figures.draws)
    draws: dict[str, Any] = {name: table[name].to_numpy(float)[None] for name in figures.names}
    known = {
        "chain_steps": figures.steps,
        "acceptance": figures.acceptance,
        "converged": int(figures.converged),
        **{f"rhat {name}": value for name, value in figures.rhat.items() if value is not None},
        **{f"effective draws {name}": value for name, value in figures.effective.items()},
    }
    return arviz.from_dict(posterior=draws, attrs=known)
