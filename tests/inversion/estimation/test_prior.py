"""What a case states of a parameter is weighed as one more measurement of it, and told where the record disagrees."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import UserError
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.estimation.calibration import Calibrator
from birdstrike.inversion.estimation.coordinates import parameter_coordinates
from birdstrike.inversion.estimation.curve_model import CurveModel
from birdstrike.inversion.estimation.locate import InversionOptions, Located, locate
from birdstrike.inversion.estimation.posterior import Sampling, sample
from birdstrike.inversion.estimation.prior import NormalPrior, conflicts, identified
from birdstrike.inversion.estimation.shots import CampaignShot, joined
from birdstrike.inversion.invert import invert
from birdstrike.inversion.models.points import prior_draws
from birdstrike.inversion.observations.observations import observe
from birdstrike.solver.case.settings import Prior
from birdstrike.surrogate.emulator import Emulator
from tests.inversion import eroding
from tests.inversion.stand_in import CHANNEL, HIGHS, LOWS, NAMES, TIMES, forward, record, truth

DAMPING = NAMES[2]
SHARE = (0.4, 0.6, 0.45, 0.5)
NOISE = 2e-4


def known(mean: float, sd: float) -> dict[str, Prior]:
    """A prior of the damping, in fractions of its range."""
    low, high = LOWS[2], HIGHS[2]
    return {DAMPING: Prior(mean=low + mean * (high - low), sd=sd * (high - low))}


def problem(dataset: Dataset, emulator: Emulator, stated: dict[str, Prior]) -> Calibrator:
    observations = observe(record(truth(SHARE)), dataset, {CHANNEL: NOISE})
    coordinates = parameter_coordinates(dataset, emulator.regions, stated)
    return Calibrator(CurveModel(emulator, observations), coordinates, 0.0)


def test_precisions_of_record_and_prior_add_up(dataset: Dataset, emulator: Emulator) -> None:
    """Two normal distributions: the precision is their sum and the mean the one weighted by them."""
    alone = problem(dataset, emulator, {}).fit()[0]
    P = np.linalg.inv(alone.covariance[:-1, :-1])
    sd = float(np.sqrt(alone.covariance[2, 2]))
    told = problem(dataset, emulator, known(SHARE[2] + sd, 0.5 * sd)).fit()[0]
    more = np.zeros((4, 4))
    more[2, 2] = (0.5 * sd) ** -2.0 - 12.0
    right = P @ alone.z
    right[2] += (SHARE[2] + sd) * (0.5 * sd) ** -2.0 - 0.5 * 12.0
    expected = np.linalg.inv(P + more)
    assert told.z == pytest.approx(expected @ right, abs=0.1 * sd)
    assert np.sqrt(np.diag(told.covariance)[:-1]) == pytest.approx(np.sqrt(np.diag(expected)), rel=0.05)


def test_the_draws_have_the_same_prior_as_the_fit(dataset: Dataset, emulator: Emulator) -> None:
    told = problem(dataset, emulator, known(0.5, 0.03))
    modes = told.fit()
    drawn = sample(told, modes, sampling=Sampling(chunk=400, most=1200))
    assert drawn.z[:, 2].mean() == pytest.approx(modes[0].z[2], abs=0.006)
    assert drawn.z[:, 2].std() == pytest.approx(np.sqrt(modes[0].covariance[2, 2]), rel=0.15)


def located(dataset: Dataset, emulator: Emulator, stated: dict[str, Prior], method: str = "emulator") -> Located:
    options = InversionOptions(method=method, noise={CHANNEL: NOISE}, sampling=None, analyse=False, priors=stated)
    return locate(dataset, record(truth(SHARE), noise=NOISE), options, emulator)


@pytest.mark.parametrize(("mean", "sd", "contradicted"), [(0.5, 0.1, False), (0.95, 0.04, True)])
def test_a_prior_that_the_record_contradicts_is_told(
    dataset: Dataset, emulator: Emulator, mean: float, sd: float, contradicted: bool
) -> None:
    lines = [line for line in located(dataset, emulator, known(mean, sd)).warnings if "stated prior" in line]
    assert bool(lines) is contradicted
    if contradicted:
        assert lines[0].startswith("damping: the record contradicts the stated prior about 0.24: with it the answer ")
        assert " of its standard deviations below, " in lines[0]


def test_a_record_that_says_nothing_of_a_parameter_contradicts_no_prior() -> None:
    """Its mean is off by the fit's tolerance, or by a region without runs; next to nothing is to be expected."""
    prior = NormalPrior(np.array([0.5, 0.9]), np.array([0.1, 0.02]), np.array([True, True]))
    mean, sd = np.array([0.5 + 1e-6, 0.8]), prior.sd * (1.0 - 1e-13)
    assert not conflicts(prior, ("a", "b"), mean, sd, "{}: {}".format)


def test_a_prior_far_narrower_than_the_record_can_be_contradicted() -> None:
    """Record 0.9 ± 0.1 and prior 0.5 ± 0.001: 4 standard deviations apart, and the answer hardly leaves the prior."""
    prior, gain = NormalPrior(np.array([0.5]), np.array([0.001]), np.array([True])), 1e-6 / (1e-6 + 1e-2)
    (said,) = conflicts(prior, ("a",), prior.mean + 0.4 * gain, prior.sd * np.sqrt(1.0 - gain), "{}: {:.5f}".format)
    assert "4.0 times what is expected" in said


def test_who_states_a_prior_hears_that_the_network_does_not_know_it(dataset: Dataset, emulator: Emulator) -> None:
    said = "the network does not know the prior of damping: it knows the ranges alone"
    assert said in located(dataset, emulator, known(0.5, 0.1), "both").warnings
    assert said not in located(dataset, emulator, known(0.5, 0.1)).warnings
    assert said not in located(dataset, emulator, {}, "both").warnings


def test_the_networks_answer_does_not_hang_on_a_prior(dataset: Dataset) -> None:
    """It was called not identified where it was wider than a prior that it does not know."""
    peak, options = NAMES[0], InversionOptions(method="network", hidden=4, noise={CHANNEL: 0.1 * NOISE})
    stated = {peak: Prior(mean=truth(SHARE)[0], sd=0.001 * (HIGHS[0] - LOWS[0]))}
    free, told = (
        invert(dataset, record(truth(SHARE)), forward, replace(options, priors=one)).inversion.methods["network"]
        for one in ({}, stated)
    )
    assert free.parameters[peak].identified
    assert told.parameters == free.parameters


@pytest.mark.parametrize(
    ("scale", "interval", "shown"),
    [("linear", (0.304, 0.696), "0.4 .. 0.6"), ("logarithmic", (0.338, 0.740), "0.409 .. 0.611")],
)
def test_what_the_record_does_not_tell_has_the_stated_prior_as_its_interval(
    scale: str, interval: tuple[float, float], shown: str
) -> None:
    """Tension erosion is off, no value of it changes the curve: it is not identified. 0.5 +- 0.1, or by 20 %."""
    runs = replace(eroding.campaign(), scales=("linear", scale, "linear"))
    tension = eroding.NAMES[1]
    values = np.interp(TIMES, eroding.TIME, eroding.curve(np.array([600.0, 0.4, 0.5])))
    values = values + 3e-5 * np.random.default_rng(0).normal(size=len(TIMES))
    measured = replace(record(truth(0.5)), channels={CHANNEL: values})
    options = InversionOptions(sampling=None, analyse=False, method="emulator", noise={CHANNEL: 3e-5})
    stated = replace(options, priors={tension: Prior(mean=0.5, sd=0.1)})
    free, told = (
        invert(runs, measured, eroding.forward, one).inversion.methods["emulator"].parameters[tension]
        for one in (options, stated)
    )
    assert free.interval_95 == pytest.approx((runs.lows[1], runs.highs[1]))
    assert not told.identified
    assert told.interval_95 == pytest.approx(interval, abs=5e-3)
    assert told.reason.endswith(f"; the case states {shown} beforehand, one standard deviation to each side")


def test_shots_that_share_a_bird_share_its_prior(dataset: Dataset) -> None:
    options = InversionOptions(method="emulator", noise={CHANNEL: NOISE}, sampling=None, analyse=False)
    shots = [
        CampaignShot(dataset, record(truth(SHARE)), forward, replace(options, priors=stated))
        for stated in (known(0.5, 0.1), known(0.5, 0.2))
    ]
    with pytest.raises(UserError, match=r"different priors of pulse.damping"):
        joined(shots)


def test_a_prior_in_a_logarithmic_scale_is_relative() -> None:
    """200 +- 20 of 10 .. 1000: the fraction of the logarithm, and a tenth of a logarithm's unit of two decades."""
    space = ParameterSpace(("a", "b"), ("Pa s", ""), np.array([10.0, 0.0]), np.array([1e3, 2.0]), ("logarithmic", ""))
    stated = {"a": Prior(mean=200.0, sd=20.0), "b": Prior(mean=0.5, sd=0.1)}
    found = NormalPrior.of(stated, space)
    assert found.mean == pytest.approx([np.log10(20.0) / 2.0, 0.25])
    assert found.sd == pytest.approx([0.1 / np.log(100.0), 0.05])
    step = 1e-6 * (space.highs - space.lows)
    at = np.array([200.0, 0.5])
    slope = (space.to_unit((at + step)[None]) - space.to_unit((at - step)[None]))[0] / (2.0 * step)
    assert space.slopes(at) == pytest.approx(slope, rel=1e-6)


def test_a_calibration_has_the_prior_of_a_diagnosis_in_either_scale(dataset: Dataset, emulator: Emulator) -> None:
    """Over a logarithmic range the calibration took as normal what the diagnosis took as log-normal."""
    scaled = replace(dataset, scales=("linear", "linear", "logarithmic", "linear"))
    space = ParameterSpace(NAMES, scaled.units, LOWS, HIGHS, scaled.scales)
    stated = {DAMPING: Prior(mean=0.1, sd=0.02)}
    found, expected = parameter_coordinates(scaled, emulator.regions, stated), NormalPrior.of(stated, space)
    assert (found.prior.mean, found.prior.sd) == (pytest.approx(expected.mean), pytest.approx(expected.sd))
    assert found.values(2, found.prior.mean[2] + np.array([-1.0, 1.0]) * found.prior.sd[2]) == pytest.approx(
        0.1 * np.exp([-0.2, 0.2])
    )
    for box in found.boxes:
        assert found.theta(box.lows, box) == pytest.approx(box.theta_lows)
        assert found.theta(box.highs, box) == pytest.approx(box.theta_highs)
        assert found.nearest(box.theta_lows) == pytest.approx(box.lows, abs=1e-12)


def test_identified_is_an_interval_below_half_of_the_priors_with_its_ends_cut() -> None:
    """Of a range alone: 0.5 +- 0.289 cut at 0 and 1 has a central 95 % of 0.876, not of 3.92 x 0.289 = 1.13."""
    before = NormalPrior.of_ranges(1).width()
    assert before == pytest.approx(0.876, abs=1e-3)
    assert identified(np.array([0.43, 0.44, 0.56]), before).tolist() == [True, False, False]


def test_draws_of_the_prior_have_what_the_case_states(dataset: Dataset, emulator: Emulator) -> None:
    rng = np.random.default_rng(0)
    coordinates = parameter_coordinates(dataset, emulator.regions, known(0.4, 0.05))
    z = (prior_draws(coordinates, 4000, rng) - LOWS) / (HIGHS - LOWS)
    assert np.all((z >= 0.0) & (z <= 1.0))
    assert z[:, 2].mean() == pytest.approx(0.4, abs=0.005)
    assert z[:, 2].std() == pytest.approx(0.05, rel=0.05)
    spans = np.quantile(z, [0.025, 0.975], axis=0)
    assert spans[1] - spans[0] == pytest.approx(coordinates.prior.width(), rel=0.05)
