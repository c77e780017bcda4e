"""A formula in the solver's place: late and slow, alike to first order, are told apart; runs near the fits; priors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.curves import Measured
from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array, Histories
from birdstrike.inversion.diagnosis.diagnose import diagnose
from birdstrike.inversion.diagnosis.pipeline import DiagnosisOptions
from birdstrike.inversion.estimation.refinement import PAYS
from birdstrike.inversion.results.diagnosis import Diagnosis
from birdstrike.solver.case.case import Case
from birdstrike.solver.sensors.instrument import Instrument, recorded
from tests.inversion.diagnosis.rig import as_solver, few_simulations, tiny

TIME = np.linspace(0.0, 0.9e-3, 181)
NOISE = 1.5e-5  # m
CENTRE, SIDE = "displacement_centre", "displacement_side"
UNITS = {"displacement": "m", "strain": "1", "strain_principal": "1", "contact_force": "N", "reaction_force": "N"}


def deflections(viscosity: float, speed: float, thickness: float) -> dict[str, Array]:
    """channel -> (m,) [m]: a bending mode, and a faster one that a viscous bird excites less."""
    t = np.maximum(TIME - 2e-5, 0.0)
    rise = -np.expm1(-((t / (1.2e-4 * (viscosity / 400.0) ** 0.15)) ** 2))
    slow = np.sin(4.4e3 * thickness / 6e-3 * t) * np.exp(-t / 1.5e-3)
    fast = np.sin(2.3e4 * thickness / 6e-3 * t) * np.exp(-t / 3e-4 * (400.0 / viscosity) ** 0.1)
    size = 4e-3 * (speed / 80.0) ** 1.3 * (6e-3 / thickness) ** 1.5
    return {CENTRE: size * rise * (slow + 0.25 * fast), SIDE: 0.7 * size * rise * (slow - 0.15 * fast)}


@as_solver
def strike(case: Case) -> Histories:
    """What a simulation would give, each with a little of its own; every other sensor reads a mixture of the two."""
    viscosity, particles = case.bird.material.viscosity, case.bird.particles
    rng = np.random.default_rng([int(1e3 * viscosity), particles, int(1e9 * case.plate.thickness)])
    own = deflections(viscosity, case.impact.speed, case.plate.thickness)
    for name, curve in own.items():
        wave = np.sin(2.0 * np.pi * rng.integers(2, 8) * TIME / TIME[-1] + rng.uniform(0.0, 6.0))
        own[name] = curve * (1.0 + 0.003 * rng.standard_normal() + 0.003 * wave)
    rest = {name: 0.3 * own[CENTRE] + 0.4 * own[SIDE] for name in case.sensors if name not in own}
    channels = own | rest
    units = {name: UNITS[case.sensors[name].kind] for name in channels}
    return Histories(TIME, channels, units, {"eroded_mass_fraction": 0.0})


def shot(instruments: dict[str, Instrument]) -> Measured:
    """What the two sensors record."""
    rng, time = np.random.default_rng(3), TIME[::2]
    curves = deflections(430.0, 80.0, 6e-3)
    seen = {name: recorded(instruments.get(name), TIME, curve)[::2] for name, curve in curves.items()}
    seen = {name: curve + NOISE * rng.standard_normal(len(time)) for name, curve in seen.items()}
    sigma = {name: np.full(len(time), NOISE) for name in seen}
    return Measured(time, seen, sigma, dict.fromkeys(seen, "m"), ("SIMULATED by a formula",), "shot.csv")


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder whose simulations the others use."""
    return tmp_path_factory.mktemp("late_and_slow") / "first"


def diagnosed(
    simulated: Path, out: Path, measured: Measured, options: DiagnosisOptions | None = None, case: Case | None = None
) -> Diagnosis:
    """With the first call's simulations at hand."""
    place, further = (out, simulated) if simulated.exists() else (simulated, None)
    with few_simulations(sought=("plate_thickness", "impact_speed")) as patch:
        patch.setattr("birdstrike.doe.campaign.simulations.simulate", strike)
        return diagnose(case or tiny(), measured, place, doe=further, options=options)


@pytest.mark.parametrize(
    ("effect", "size", "own"),
    [
        ("time_offset", 5e-5, {"time_offset": "50 us"}),
        ("time_offset", -5e-5, {"time_offset": "-50 us"}),
        ("sensor_bandwidth", 5e-5, {"bandwidth": f"{1.0 / (2.0 * np.pi * 5e-5)} Hz"}),
    ],
)
def test_late_and_slow_are_told_apart(
    simulated: Path, tmp_path: Path, effect: str, size: float, own: dict[str, str]
) -> None:
    found = diagnosed(simulated, tmp_path, shot({CENTRE: Instrument.model_validate(own)}))
    first = max(found.effects, key=lambda one: one.probability)
    assert first.name == f"{effect}.{CENTRE}"
    assert first.probability > 0.95
    assert first.interval_95 is not None
    low, high = first.interval_95
    assert low < size < high
    assert high - low < 1e-5


def test_runs_near_the_fits_are_added_while_the_emulator_counts(simulated: Path, tmp_path: Path) -> None:
    """Until it adds less than a fifth to an interval's variance; none where the user asks for none."""
    clean = shot({})
    none = diagnosed(simulated, tmp_path / "none", clean, DiagnosisOptions(refine=0)).strikes["refinement"]
    added = diagnosed(simulated, tmp_path / "auto", clean).strikes["refinement"]
    assert none["added"] == 0
    assert none["added_variance"][0] > PAYS, "the emulator does not matter: nothing is tested"
    assert added["added_variance"][0] == pytest.approx(none["added_variance"][0], rel=1e-6)
    assert 0 < added["added"] <= 10
    assert added["added_variance"][-1] < PAYS


@pytest.mark.parametrize("refine", ["some", -1])
def test_a_budget_that_is_none_is_refused(tmp_path: Path, refine: int | str) -> None:
    with pytest.raises(UserError, match="give the number of runs that may be added"):
        diagnose(tiny(), shot({}), tmp_path, options=DiagnosisOptions(refine=refine))


VISCOSITY = "bird.material.viscosity"


def with_prior(mean: float, sd: float) -> Case:
    """The rig with what is known of the bird's viscosity [Pa s]."""
    known = {"range": ["100 Pa s", "1000 Pa s"], "prior": {"mean": f"{mean} Pa s", "sd": f"{sd} Pa s"}}
    return tiny().overlaid({"inversion": {"parameters": {VISCOSITY: known}}})


def test_a_stated_prior_is_weighed_as_one_more_measurement(simulated: Path, tmp_path: Path) -> None:
    """Normal record and normal prior: precisions add up, the mean is the weighted one; the record's part is found from
    the answer without the prior, whose own is range/sqrt(12) about the middle."""
    alone = diagnosed(simulated, tmp_path / "alone", shot({})).before.parameters[VISCOSITY]
    known = diagnosed(simulated, tmp_path / "known", shot({}), case=with_prior(460.0, 30.0))
    low, high = alone["interval_95"]
    posterior, usual = ((high - low) / 3.92) ** -2.0, (900.0 / np.sqrt(12.0)) ** -2.0
    record = posterior - usual
    said = (posterior * alone["value"] - usual * 550.0) / record
    both = record + 30.0**-2.0
    found = known.before.parameters[VISCOSITY]
    low, high = found["interval_95"]
    assert found["value"] == pytest.approx((record * said + 460.0 / 30.0**2) / both, abs=0.5 * both**-0.5)
    assert high - low == pytest.approx(3.92 * both**-0.5, rel=0.25)
    assert not any("contradicts the stated prior" in line for line in known.warnings)


def test_a_prior_that_the_record_contradicts_is_told(simulated: Path, tmp_path: Path) -> None:
    found = diagnosed(simulated, tmp_path / "out", shot({}), case=with_prior(990.0, 20.0))
    assert any(line.startswith("viscosity: the record contradicts the stated prior") for line in found.warnings)
