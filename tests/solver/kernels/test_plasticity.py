"""Plane-stress return mapping against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.reports.verification.problems.plasticity import (
    RATELESS_STEEL,
    dented,
    jones_deflection,
    nurick_plate,
    shear_stress_at_rate,
)
from birdstrike.solver.kernels.target.metal import EPS_P, FLOW, hardened
from birdstrike.solver.target.point import Layer
from birdstrike.solver.target.section import ShellMaterial

STEEL = ShellMaterial(200e9, 0.3, 7800.0, 250e6, 2e9, beta=1.0)


def uniaxial(material: ShellMaterial, strains: np.ndarray) -> tuple[np.ndarray, float]:
    """Axial stress along a path of axial strain with the lateral stress held at zero by iteration."""
    layer, history = Layer(material.row()), []
    for increment in np.diff(strains):
        layer.pull(float(increment))
        history.append(layer.stress[0])
    return np.array(history), layer.eps_p


def test_uniaxial_tension_follows_the_tangent_modulus():
    strains = np.linspace(0.0, 0.02, 201)
    stress, eps_p = uniaxial(STEEL, strains)
    at_yield = STEEL.yield_stress / STEEL.young
    expected = STEEL.yield_stress + STEEL.tangent_modulus * (strains[-1] - at_yield)
    assert stress[-1] == pytest.approx(expected, rel=1e-10)
    assert eps_p == pytest.approx(strains[-1] - expected / STEEL.young, rel=1e-9)


@pytest.mark.parametrize("beta", [0.0, 0.5, 1.0])
def test_reverse_yield_shows_the_kind_of_hardening(beta):
    """After hardening by d, reverse yield comes at -(yield + (2 beta - 1) d): Bauschinger for kinematic hardening.

    Both branches of the way back are straight, so reverse yield is where they cross.
    """
    material = ShellMaterial(200e9, 0.3, 7800.0, 250e6, 20e9, beta)
    strains = np.concatenate([np.linspace(0.0, 0.01, 101), np.linspace(0.01, -0.01, 101)[1:]])
    stress, _ = uniaxial(material, strains)
    top, reached = stress[99], strains[100]
    elastic, (slope, offset) = material.young, np.polyfit(strains[-20:], stress[-20:], 1)
    crossing = (offset - top + elastic * reached) / (elastic - slope)
    expected = -(material.yield_stress + (2.0 * beta - 1.0) * (top - material.yield_stress))
    assert slope == pytest.approx(material.tangent_modulus, rel=1e-6)
    assert slope * crossing + offset == pytest.approx(expected, rel=1e-6)


def test_pure_shear_yields_at_the_von_mises_stress():
    perfect = ShellMaterial(200e9, 0.3, 7800.0, 250e6)
    layer = Layer(perfect.row())
    layer.strain(np.array([0.0, 0.0, 400e6 / 77e9]))
    assert layer.stress[2] == pytest.approx(250e6 / np.sqrt(3.0), rel=1e-12)


def test_returned_stress_lies_on_the_yield_surface():
    rng = np.random.default_rng(5)
    for _ in range(200):
        layer = Layer(STEEL.row())
        layer.stress[:], layer.back[:] = rng.normal(0.0, 1e9, 3), rng.normal(0.0, 3e7, 3)
        layer.memory[[EPS_P, FLOW]] = 0.01, hardened(layer.row, 0.01)[0]
        layer.strain(np.zeros(3))
        xi, eps_p = layer.stress - layer.back, layer.eps_p
        equivalent = np.sqrt(xi[0] ** 2 - xi[0] * xi[1] + xi[1] ** 2 + 3.0 * xi[2] ** 2)
        yield_now = STEEL.yield_stress + STEEL.hardening[1] * eps_p
        assert equivalent <= yield_now * (1.0 + 1e-10)
        assert eps_p == pytest.approx(0.01) or equivalent == pytest.approx(yield_now, rel=1e-10)


@pytest.mark.parametrize("rate", [1.0, 100.0, 1e4])
@pytest.mark.parametrize("constants", [(40.4, 5.0), (6500.0, 4.0), (10.0, 1.0)])
def test_cowper_symonds_stress_at_constant_rate(rate, constants):
    """Steady shear: the yield stress times 1 + (plastic rate/C)^(1/P), by the closed form, to 1e-10."""
    metal = ShellMaterial(200e9, 0.3, 7800.0, 250e6, 0.0, 1.0, *constants)
    factor = 1.0 + (rate / np.sqrt(3.0) / constants[0]) ** (1.0 / constants[1])
    strain_at_yield = factor * 250e6 / 77e9
    assert shear_stress_at_rate(metal, rate, 60.0 * strain_at_yield / rate / 2000).error < 1e-10


def test_rate_hardening_never_lets_the_return_run_away():
    """Random trial stresses, constants and steps: the returned one lies on the dynamic yield surface."""
    rng = np.random.default_rng(7)
    for _ in range(300):
        constants = 10.0 ** rng.uniform((-3.0, -0.5), (7.0, 1.0))
        metal = ShellMaterial(200e9, 0.3, 7800.0, 250e6, 2e9, rng.uniform(), *constants)
        layer, dt = Layer(metal.row()), 10.0 ** rng.uniform(-9, -4)
        layer.stress[:] = trial = rng.normal(0.0, 1e9, 3)
        layer.strain(np.zeros(3), dt)
        xi, eps_p = layer.stress - layer.back, layer.eps_p
        equivalent = np.sqrt(xi[0] ** 2 - xi[0] * xi[1] + xi[1] ** 2 + 3.0 * xi[2] ** 2)
        static = 250e6 + metal.hardening[1] * eps_p
        if eps_p > 0.0:
            factor = 1.0 + (eps_p / dt / metal.rate_c) ** (1.0 / metal.rate_p)
            assert equivalent == pytest.approx(factor * static, rel=1e-8)
        else:
            assert (layer.stress == trial).all()


def test_impulsively_loaded_plates_keep_the_published_deflections():
    """Mild steel with its rate hardening: Nurick & Martin's correlation within 10 %; without it: Jones's bracket."""
    assert nurick_plate(14.0, 12).error < 0.10
    assert jones_deflection(8.0) < dented(RATELESS_STEEL, 8.0, 12).permanent < jones_deflection(8.0, 0.618)
