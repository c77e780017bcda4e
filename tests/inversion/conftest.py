"""A campaign of the stand-in and its emulator, made once."""

from __future__ import annotations

import pytest

from birdstrike.data.dataset import Dataset
from birdstrike.surrogate.emulator import Emulator, fit_emulator
from tests.inversion.stand_in import CHANNEL, campaign, spread


@pytest.fixture(scope="session")
def dataset() -> Dataset:
    """40 runs of the damped pulse."""
    return campaign(spread())


@pytest.fixture(scope="session")
def emulator(dataset: Dataset) -> Emulator:
    """Of the displacement."""
    return fit_emulator(dataset, [CHANNEL])
