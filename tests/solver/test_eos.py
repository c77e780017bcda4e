"""Grueneisen equation of state against the Rankine-Hugoniot relations and against itself."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from solver.kernels.eos import grueneisen_terms, grueneisen_update

RHO0, C, S1 = 938.0, 1670.0, 2.48
SEED = np.array([RHO0, C, S1, 0.0, 0.0, 0.0, 0.0])
FULL = np.array([2785.0, 5328.0, 1.338, 0.2, -0.1, 2.0, 0.48])


@pytest.mark.parametrize("u", [45.55, 100.0, 200.0, 300.0])
def test_compression_branch_is_the_hugoniot(u):
    shock = C + S1 * u
    compression = shock / (shock - u) - 1.0
    assert grueneisen_terms(compression, SEED)[0] == pytest.approx(RHO0 * shock * u, rel=1e-12)


def test_expansion_is_linear():
    assert grueneisen_terms(-0.1, SEED)[0] == pytest.approx(-0.1 * RHO0 * C**2)


@pytest.mark.parametrize("constants", [SEED, FULL])
@pytest.mark.parametrize("mu", [0.02, 0.2])
def test_slope_is_the_derivative(constants, mu):
    step = 1e-6
    numeric = (grueneisen_terms(mu + step, constants)[0] - grueneisen_terms(mu - step, constants)[0]) / (2 * step)
    assert grueneisen_terms(mu, constants)[1] == pytest.approx(numeric, rel=1e-7)


@pytest.mark.parametrize("constants", [SEED, FULL])
def test_slow_compression_and_release_is_reversible(constants):
    """Along an isentrope energy is p dV and comes back; the sound speed is that of dp/drho along it."""
    rho0 = constants[0]
    path = rho0 * (1.0 + 0.1 * np.sin(np.linspace(0.0, np.pi, 4001)))
    p, energy, ps, cs = 0.0, 0.0, [0.0], [0.0]
    for before, after in pairwise(path):
        p, energy, c = grueneisen_update(after, before, p, energy, constants)
        ps.append(p)
        cs.append(c)
    assert abs(p) < 1e-5 * max(ps)
    half = 1000
    numeric = (ps[half + 1] - ps[half - 1]) / (path[half + 1] - path[half - 1])
    assert cs[half] == pytest.approx(np.sqrt(numeric), rel=1e-4)
