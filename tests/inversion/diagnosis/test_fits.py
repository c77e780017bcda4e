"""The scatter of runs, which the shots of a setup share."""

import numpy as np
import pytest

from .conftest import Laboratory


def test_runs_scatter_alike_in_every_shot_of_a_setup(laboratory: Laboratory) -> None:
    """Mean square 1 a channel, and what a shot reads at one of its instants is the setup's row there."""
    problem = laboratory.answered[0][0].problem
    shot = next(one for one in problem.shots if one.setup.changes)
    setup = shot.setup
    for rows in np.split(setup.scatter, len(setup.channels), axis=1):
        assert (rows**2).sum(axis=0).mean() == pytest.approx(1.0)
    fine = len(setup.time)
    for i, trace in enumerate(shot.record.traces):
        begin = fine * setup.channels.index(trace.name)
        read = shot.scatter[:, shot.record.channel == i]
        expected = np.array(
            [np.interp(trace.middle, setup.time, row) for row in setup.scatter[:, begin : begin + fine]]
        )
        assert np.abs(read - expected).max() < 0.1 * np.abs(expected).max()
