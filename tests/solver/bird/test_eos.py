"""Equations of state against the Rankine-Hugoniot relations, their formulas, and themselves."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from birdstrike.solver.bird.eos.grueneisen import grueneisen
from birdstrike.solver.bird.eos.interface import EquationOfState
from birdstrike.solver.bird.eos.linear_polynomial import linear_polynomial
from birdstrike.solver.bird.eos.logarithmic import logarithmic
from birdstrike.solver.bird.eos.murnaghan import murnaghan
from birdstrike.solver.bird.eos.polynomial_k import polynomial_k
from birdstrike.solver.bird.eos.porous import porous_density, porous_linear, porous_wood
from birdstrike.solver.bird.eos.table import table

RHO0, C, S1 = 938.0, 1670.0, 2.48
SEED = grueneisen(RHO0, C, S1)
FULL = grueneisen(2785.0, 5328.0, 1.338, 0.2, -0.1, 2.0, 0.48)
POLYNOMIAL = linear_polynomial(938.0, [0.0, 2072e6, 6217e6, 10362e6, 0.4, 0.3, 0.2])
DRY = porous_density(0.1, 1000.0)
WOOD = porous_wood(DRY, 0.1, 1482.9, 2.0, 1000.0)
LAWS = {
    "seed": SEED,
    "full": FULL,
    "polynomial": POLYNOMIAL,
    "murnaghan": murnaghan(950.0, 128e6, 7.98),
    "logarithmic": logarithmic(938.0, 1148e6),
    "wood": WOOD,
    "table": table(938.0, [-0.3, 0.0, 0.1, 0.3, 0.4], [-1e8, 0.0, 3e8, 1.5e9, 4e9]),
}
EVERY = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)


@pytest.mark.parametrize("u", [45.55, 100.0, 200.0, 300.0])
def test_compression_branch_is_the_hugoniot(u):
    shock = C + S1 * u
    compression = shock / (shock - u) - 1.0
    assert SEED.pressure(compression) == pytest.approx(RHO0 * shock * u, rel=1e-12)
    assert SEED.hugoniot(u) == pytest.approx((RHO0 * shock * u, shock, compression), rel=1e-9)


def test_expansion_is_linear():
    assert SEED.pressure(-0.1) == pytest.approx(-0.1 * RHO0 * C**2)


def test_polynomial_drops_its_even_terms_in_expansion():
    """C2 and C6 act in compression alone, C3 and C5 on both sides."""
    law = linear_polynomial(1000.0, [1.0, 10.0, 100.0, 1000.0, 0.5, 0.25, 0.125])
    assert law.pressure(0.1, 8.0) == pytest.approx(1.0 + 1.0 + 1.0 + 1.0 + (0.5 + 0.025 + 0.00125) * 8.0)
    assert law.pressure(-0.1, 8.0) == pytest.approx(1.0 - 1.0 - 1.0 + (0.5 - 0.025) * 8.0)


def test_murnaghan_of_water_has_its_sound_speed():
    """The printed 9.3 GPa at g = 7.14 gives 8360 m/s, and 9.3 MPa gives 264 m/s."""
    assert murnaghan(950.0, 9.3e9, 7.14).sound_speed == pytest.approx(8360.0, rel=1e-3)
    assert murnaghan(950.0, 9.3e6, 7.14).sound_speed == pytest.approx(264.0, rel=2e-3)


@pytest.mark.parametrize("u", [5.0, 50.0])
def test_polynomial_from_k_follows_its_shock_line(u):
    """us = c0 + k u, of which the cubic is the expansion to third order in mu."""
    _, shock, mu = polynomial_k(1000.0, 1482.9, 2.0).hugoniot(u)
    assert shock == pytest.approx(1482.9 + 2.0 * u, rel=4.0 * mu**3)


def test_tait_water_is_the_porous_law_without_air():
    law, n = porous_wood(1000.0, 0.0, 1482.9, 2.0, 1000.0), 7.0
    mu = np.linspace(0.0, 0.3, 37)
    expected = 1000.0 * 1482.9**2 / n * ((1.0 + mu) ** n - 1.0)
    assert [law.pressure(m) for m in mu] == pytest.approx(expected, rel=1e-6, abs=1.0)
    assert law.sound_speed == pytest.approx(1482.9, rel=1e-9)


def test_wood_sound_speed_of_a_bubbly_liquid():
    """1/(rho_z c^2) = (1 - z)/K_water + z/(1.4 p_atm): 40 m/s at a tenth of air."""
    softness = 0.9 / (1000.0 * 1482.9**2) + 0.1 / (1.4 * 101325.0)
    assert WOOD.sound_speed == pytest.approx((DRY * softness) ** -0.5, rel=1e-9)
    assert WOOD.sound_speed == pytest.approx(39.7, abs=0.1)
    assert WOOD.pressure_at_rest == 0.0


@pytest.mark.parametrize(("u", "megapascals"), [(100.0, 71.90), (200.0, 218.30), (300.0, 404.80)])
def test_wood_hugoniot_against_the_reference_table(u, megapascals):
    """data/reference/hugoniot_theory_computed.csv, 10 % air."""
    assert WOOD.hugoniot(u)[0] == pytest.approx(megapascals * 1e6, rel=2e-4)


def test_linear_mixture_has_the_sound_speed_of_its_source():
    """1368 m/s at 10 % of air in 1483 m/s water."""
    assert porous_linear(900.1, 0.1, 1483.0, 2.0).sound_speed == pytest.approx(1368.9, abs=0.1)


def test_table_meets_its_points_rises_between_and_goes_on_beyond():
    mu, p = np.array([-0.3, 0.0, 0.1, 0.3, 0.4]), np.array([-1e8, 0.0, 3e8, 1.5e9, 4e9])
    law = LAWS["table"]
    assert [law.pressure(m) for m in mu] == pytest.approx(p, abs=1e-3)
    fine = [law.pressure(m) for m in np.linspace(-0.5, 0.6, 500)]
    assert np.all(np.diff(fine) > 0.0)


@EVERY
@pytest.mark.parametrize("mu", [-0.02, 0.02, 0.2])
def test_slopes_are_the_derivatives(law: EquationOfState, mu: float):
    step = 1e-6
    above, here, below = (np.array(law.terms(m, law.constants)) for m in (mu + step, mu, mu - step))
    numeric = (above - below) / (2.0 * step)
    assert here[1] == pytest.approx(numeric[0], rel=1e-5)
    assert here[3] == pytest.approx(numeric[2], rel=1e-5, abs=1e-9)


@EVERY
def test_slow_compression_and_release_is_reversible(law: EquationOfState):
    """Along an isentrope energy is p dV and comes back; the sound speed is that of dp/drho along it."""
    rho0 = law.rho0
    path = rho0 * (1.0 + 0.1 * np.sin(np.linspace(0.0, np.pi, 4001)))
    p, energy, ps, cs = 0.0, 0.0, [0.0], [law.sound_speed]
    for before, after in pairwise(path):
        p, energy, c = law.update(after, before, p, energy)
        ps.append(p)
        cs.append(c)
    assert abs(p) < 1e-5 * max(ps)
    half = 1000
    numeric = (ps[half + 1] - ps[half - 1]) / (path[half + 1] - path[half - 1])
    assert cs[half] == pytest.approx(np.sqrt(numeric), rel=1e-4)


@EVERY
@pytest.mark.parametrize("u", [10.0, 150.0])
def test_hugoniot_conserves_mass_momentum_and_energy(law: EquationOfState, u: float):
    """The shocked state lies on the law itself at the energy that the shock left, u^2/2 per unit mass."""
    rise, shock, mu = law.hugoniot(u)
    assert mu == pytest.approx(u / (shock - u), rel=1e-9)
    assert law.pressure(mu, 0.5 * law.rho0 * u**2) == pytest.approx(rise, rel=1e-9)
    assert law.shocked_sound_speed(u) > shock - u  # the flow behind a shock is subsonic


def test_a_soft_porous_mixture_has_no_gap_in_its_table() -> None:
    """Below 26 m/s the water's own limit of tension is nearer than the air's, and the table was not a number."""
    law = porous_wood(DRY, 0.1, 12.0, 2.0, 1000.0)
    assert np.isfinite(law.constants).all()
    assert law.sound_speed > 0.0
