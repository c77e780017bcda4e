"""Intervals of magnitudes and draws from a model's posterior."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

from birdstrike.inversion.diagnosis.inference.evidence import SIZES, ModelTester, draws, quantiles
from birdstrike.inversion.diagnosis.inference.gaussians import drawn_above_zero, log_mass_above_zero
from birdstrike.inversion.diagnosis.inference.hypotheses import Hypothesis
from tests.inversion.diagnosis.inference.linear_system import POINTS, Stub, known, models, system


def test_intervals_hold_what_another_lattice_moves() -> None:
    """Truths from the priors on lattices of their own: 95 % intervals hold parameters and magnitude, and did not."""
    rng, s, label = np.random.default_rng(5), system(0), "e1"
    signature = s.columns[:, s.at[label].start]
    near = 0.3 * np.column_stack([s.columns[:, s.at["J"]], signature])  # what a lattice moves looks like other values
    lattice = near @ rng.standard_normal((3, 4)) / 2.0
    at = {**s.at, "lattice": slice(s.columns.shape[1], s.columns.shape[1] + 4)}
    amplitudes, draws, held = known(np.array([1e-3])), 150, {False: 0.0, True: 0.0}
    for _ in range(draws):
        z, h = rng.standard_normal(2), rng.standard_normal()
        modelled = np.column_stack([s.columns[:, s.at["J"]], s.columns[:, s.at["nuisance"]], signature])
        y = modelled @ [*z, rng.standard_normal(), h] + lattice @ rng.standard_normal(4) + rng.standard_normal(POINTS)
        columns = np.column_stack([y, s.columns[:, 1:], lattice])
        for moved in held:
            places = at if moved else s.at
            tester = ModelTester(replace(s, columns=columns, at=places), amplitudes, unnamed=(1e-6,))
            found = tester.model(models()[label])
            errors = np.append(found.z[:2] - z, found.h - h)
            spread = np.sqrt(np.append(np.diag(found.z_cov), found.h_cov[0, 0]))
            held[moved] += (np.abs(errors) < 1.96 * spread).mean() / draws
    assert held[False] < 0.8
    assert 0.9 < held[True] < 0.99


@pytest.mark.parametrize("one_sided", [False, True])
def test_an_interval_holds_an_effect_whose_signature_is_hardly_known(one_sided: bool) -> None:
    """Truths from the priors: signature as learnt off by its stated error, which is as large as the signature.

    The size's posterior is not Gaussian, because the error grows with the size.
    """
    rng, s, label, draws = np.random.default_rng(8), system(0, size=1.0), "e1", 300
    model = models(one_sided)[label]
    (one,) = model.members
    learnt = s.columns[:, s.at[label].start]
    errors = np.array([np.sin(f * np.linspace(0.0, 1.0, POINTS) + 1.0) for f in (3.0, 9.0, 17.0)]).T
    first = s.columns.shape[1]
    at = {**s.at, f"error of {label}": slice(first, first + 3)}
    amplitudes, held = known(np.array([1e-3])), 0.0
    for _ in range(draws):
        h = np.inf
        while abs(h) > one.limits[1]:
            h = rng.choice(SIZES) * rng.standard_normal()
        h = abs(h) if one_sided else h
        true = learnt + errors @ rng.standard_normal(3)
        z = rng.standard_normal(2)
        y = s.columns[:, s.at["J"]] @ z + s.columns[:, s.at["nuisance"]][:, 0] * rng.standard_normal() + h * true
        columns = np.column_stack([y + rng.standard_normal(POINTS), s.columns[:, 1:], errors])
        tester = ModelTester(replace(s, columns=columns, at=at), amplitudes, unnamed=(1e-6,))
        low, _, high = quantiles(tester, tester.model(model))
        held += (low <= h <= high) / draws
    assert held == pytest.approx(0.95, abs=0.03)


def test_a_sharp_interval_is_that_of_the_gaussian() -> None:
    s = system(0)
    s = system(0, 2.0 * s.columns[:, s.at["e1"].start])
    tester = ModelTester(s, known(np.array([0.01])))
    found = tester.model(models()["e1"])
    low, _, high = quantiles(tester, found)
    sd = float(np.sqrt(found.h_cov[0, 0]))
    assert (low, high) == pytest.approx((found.h[0] - 1.96 * sd, found.h[0] + 1.96 * sd), abs=0.05 * sd)


def test_draws_scatter_as_the_intervals_say_without_the_lattice() -> None:
    s, rng = system(0), np.random.default_rng(2)
    lattice = 0.3 * s.columns[:, s.at["J"]] @ rng.standard_normal((2, 4))
    y = s.columns[:, s.at["e1"].start] + rng.standard_normal(POINTS)
    at = {**s.at, "lattice": slice(s.columns.shape[1], s.columns.shape[1] + 4)}
    moved = replace(s, columns=np.column_stack([y, s.columns[:, 1:], lattice]), at=at)
    tester, model = ModelTester(moved, known(np.array([1e-3])), unnamed=(1e-6,)), models()["e1"]
    found = ModelTester(replace(moved, at=s.at), known(np.array([1e-3])), unnamed=(1e-6,)).model(model)
    assert (np.diag(found.z_cov) < np.diag(tester.model(model).z_cov)).all()
    z, h, _ = draws(tester, found, 4000, rng)
    assert np.cov(z.T) == pytest.approx(found.z_cov, abs=0.1 * float(found.z_cov.max()))
    assert h.std() == pytest.approx(float(np.sqrt(found.h_cov[0, 0])), rel=0.1)


@pytest.mark.parametrize("unnamed", [0.1, 1.0])
def test_draws_of_a_one_sided_magnitude_that_an_unnamed_error_shares_are_cut_off_as_its_mean_is(unnamed: float) -> None:
    """One in five was negative: only the member's own part was drawn anew, not the whole that is its size."""
    first, rng = system(0), np.random.default_rng(1)
    columns = first.columns.copy()
    columns[:, first.at["unnamed"]] = columns[:, first.at["e1"]]
    columns[:, 0] = rng.standard_normal(POINTS)
    tester = ModelTester(replace(first, columns=columns), known(np.array([0.01])), unnamed=(unnamed,))
    found = tester.model(models(one_sided=True)["e1"])
    z, h, _ = draws(tester, found, 4000, np.random.default_rng(0))
    sd = float(np.sqrt(found.h_cov[0, 0]))
    assert h.min() >= 0.0
    assert h.mean() == pytest.approx(found.h[0], abs=0.1 * sd)
    assert h.std() == pytest.approx(sd, rel=0.1)
    assert z.mean(axis=0) == pytest.approx(found.z[:2], abs=0.1 * np.sqrt(found.z_cov.max()))


@pytest.mark.parametrize("both", [False, True])
def test_draws_of_magnitudes_that_the_record_calls_negative_are_their_distribution_cut_off(both: bool) -> None:
    """Draws that stayed negative in fifty attempts were taken as they were: nearly all of these."""
    first, labels = system(0), ["e1", "e2"] if both else ["e1"]
    columns, at = first.columns.copy(), [first.at[label].start for label in labels]
    columns[:, 0] = -columns[:, at].sum(axis=1) + np.random.default_rng(1).standard_normal(POINTS)
    tester = ModelTester(replace(first, columns=columns), known(np.array([0.01])), unnamed=(0.1,))
    pair: Any = [Stub(label, True) for label in labels]
    found = tester.model(Hypothesis("+".join(labels), tuple(pair), 0.1, "pairs"))
    _, h, _ = draws(tester, found, 4000, np.random.default_rng(0))
    sd = np.sqrt(np.diag(found.h_cov))
    assert h.min() >= 0.0
    assert h.mean(axis=0) == pytest.approx(found.h, abs=0.08 * sd.min())
    assert np.atleast_2d(np.cov(h.T)) == pytest.approx(found.h_cov, rel=0.12, abs=0.12 * sd.min() ** 2)


@pytest.mark.parametrize(("means", "far"), [((-1.0, -1.5), 1e-3), ((0.5, -3.0), 1e-3), ((2.0, 1.0), 8.0)])
def test_two_magnitudes_of_one_signature_are_as_often_positive_as_their_distribution_says(
    means: tuple[float, float], far: float
) -> None:
    """Where data call their sum negative too: the log of that was off by up to 20, and of draws one mean by 1000 sd."""
    a, rho = np.array(means), -0.9999
    C = np.array([[1.0, rho], [rho, 1.0]])
    mass = float(log_mass_above_zero([Stub("a", True), Stub("b", True)], a, C))  # pyright: ignore[reportArgumentType]
    x = np.linspace(0.0, far, 200_001)
    logs = norm.logpdf(x - a[0]) + norm.logcdf((a[1] + rho * (x - a[0])) / np.sqrt(1.0 - rho**2))
    density = np.exp(logs - logs.max())
    exact = float(np.trapezoid(density, x))
    assert mass == pytest.approx(np.log(4.0 * exact) + logs.max(), abs=0.03)
    drawn = drawn_above_zero(a, C, 4000, np.random.default_rng(0))[:, 0]
    assert drawn.mean() == pytest.approx(float(np.trapezoid(x * density, x)) / exact, abs=0.06 * drawn.std())
