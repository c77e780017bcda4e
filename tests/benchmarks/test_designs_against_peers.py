"""Designs of 25 runs in 4 factors: squared centred discrepancy of ours and of the peers' in the same time.

The peers are the extra `bench`; one that is not installed is named as such. `make bench`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from importlib.util import find_spec

import numpy as np
import pytest
from scipy.stats import qmc

from birdstrike.doe.designs.completion import completed
from birdstrike.doe.designs.orthogonal import orthogonal_design, rao_hamming
from birdstrike.doe.designs.quality import cd2
from birdstrike.doe.designs.uniform import uniform_design

RUNS, FACTORS = 25, 4
Draw = Callable[[int], np.ndarray]
"""A design from a seed."""


def scipy_hypercube(seed: int) -> np.ndarray:
    """scipy's plain Latin hypercube, centred."""
    return qmc.LatinHypercube(FACTORS, scramble=False, rng=seed).random(RUNS)


def scipy_random_cd(seed: int) -> np.ndarray:
    """scipy's own search on the centred discrepancy."""
    return qmc.LatinHypercube(FACTORS, scramble=False, optimization="random-cd", rng=seed).random(RUNS)


def pydoe_hypercube(seed: int) -> np.ndarray:
    """pyDOE's centred hypercube of the largest smallest distance."""
    import pydoe  # pyright: ignore[reportMissingImports] (an extra)

    return pydoe.lhs(FACTORS, RUNS, criterion="centermaximin", seed=seed)


def smt_ese(seed: int) -> np.ndarray:
    """SMT's enhanced stochastic evolutionary search, which minimises PhiP."""
    from smt.sampling_methods import LHS  # pyright: ignore[reportMissingImports] (an extra)

    return LHS(xlimits=np.array([[0.0, 1.0]] * FACTORS), criterion="ese", seed=seed)(RUNS)


def openturns_annealing(seed: int) -> np.ndarray:
    """OpenTURNS' simulated annealing on the centred discrepancy."""
    import openturns as ot  # pyright: ignore[reportMissingImports] (an extra)

    ot.RandomGenerator.SetSeed(seed)
    box = ot.JointDistribution([ot.Uniform(0.0, 1.0)] * FACTORS)
    lhs = ot.LHSExperiment(box, RUNS, True, False)
    return np.array(
        ot.SimulatedAnnealingLHS(lhs, ot.SpaceFillingC2(), ot.GeometricProfile(10.0, 0.95, 20000)).generate()
    )


PEERS: Mapping[str, tuple[str, Draw]] = {
    "scipy Latin hypercube": ("scipy", scipy_hypercube),
    "scipy random-cd": ("scipy", scipy_random_cd),
    "pyDOE centermaximin": ("pydoe", pydoe_hypercube),
    "SMT ESE": ("smt", smt_ese),
    "OpenTURNS annealing": ("openturns", openturns_annealing),
}


def best_within(draw: Draw, seconds: float) -> tuple[float, int, float]:
    """Least squared discrepancy of the designs that fit in the time (at least one), their number, the time taken."""
    begun, best, seed = time.perf_counter(), np.inf, 0
    while seed == 0 or time.perf_counter() - begun < seconds:
        best, seed = min(best, cd2(draw(seed))), seed + 1
    return best, seed, time.perf_counter() - begun


def test_the_uniform_design_is_at_or_below_every_peer_in_the_same_time(capsys: pytest.CaptureFixture[str]) -> None:
    uniform_design(6, 2, 0)  # compiled
    begun = time.perf_counter()
    own = cd2(uniform_design(RUNS, FACTORS, 0))
    taken = time.perf_counter() - begun
    tabulated = cd2((2 * rao_hamming(5, 2)[:, :FACTORS] + 1) / 10.0)
    rows = [("birdstrike uniform", own, 1, taken)]
    for name, (package, draw) in PEERS.items():
        if find_spec(package) is None:
            rows.append((f"{name}: not installed", np.nan, 0, 0.0))
        else:
            rows.append((name, *best_within(draw, taken)))
    with capsys.disabled():
        print(f"\n{RUNS} runs of {FACTORS} factors           CD squared   designs   seconds")  # noqa: T201
        for name, value, count, seconds in rows:
            print(f"{name:32s} {value:10.5f} {count:9d} {seconds:9.1f}")  # noqa: T201
        print(f"{'L25 as tabulated':32s} {tabulated:10.5f}")  # noqa: T201
        print(f"{'L25, levels permuted':32s} {cd2(orthogonal_design(RUNS, FACTORS, 0)):10.5f}")  # noqa: T201
        extended = cd2(completed(uniform_design(RUNS, FACTORS, 0), 40, 0))
        print(f"{'25 completed to 40':32s} {extended:10.5f}")  # noqa: T201
        print(f"{'40 at once':32s} {cd2(uniform_design(40, FACTORS, 0)):10.5f}")  # noqa: T201
    assert own < 0.0033
    assert own <= min(value for _, value, count, _ in rows[1:] if count)
