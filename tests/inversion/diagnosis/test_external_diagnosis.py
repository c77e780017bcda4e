"""`birdstrike diagnose` with somebody else's solver: an independent program whose response to an effect is analytic."""

from __future__ import annotations

import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.curves import Measured
from birdstrike.doe.external.external import simulate_external
from birdstrike.inversion.diagnosis.diagnose import DiagnosisOptions, diagnose
from birdstrike.inversion.results.diagnosis import Diagnosis
from birdstrike.solver.case.case import load_case
from birdstrike.solver.effects.registry import effects
from tests.doe.external.test_external import exact
from tests.doe.external_case import DECK, written

NOISE = 1e-4
VISCOSITY, SPEED = 700.0, 91.1
STIFFENED = DECK.replace("{{ 20 | card }}", "{{ (20.0 * (plate.thickness / 0.01) ** 3) | card }}")
CARRIED = {"plate_thickness", "impact_speed", "impact_angle", "time_offset"}
CARRIED |= {name for name in effects() if name.startswith("sensor_")}


def record(late: float = 0.0, faster: float = 0.0) -> Measured:
    """The exact oscillation, 2 ms after 0.5 ms of rest, with noise; what is undeclared: late [s], faster [m/s]."""
    time = 20e-6 * np.arange(-25, 99)
    w = exact(np.maximum(time - late, 0.0), VISCOSITY, SPEED + faster)
    w += NOISE * np.random.default_rng(0).standard_normal(len(time))
    return Measured(time, {"displacement_centre": w}, {}, {"displacement_centre": "m"}, ("SIMULATED, not measured",))


def diagnosed(folder: Path, shot: Measured) -> Diagnosis:
    """By the oscillator, as stiff as a plate of its thickness, of which the damping is sought; on threads."""
    path = written(folder, deck=STIFFENED)
    text = re.sub(r'\[inversion\.parameters\."impact\.speed"\]\n.*\n', "", path.read_text(encoding="utf-8"))
    path.write_text(text, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("birdstrike.doe.campaign.simulations.process_pool", ThreadPoolExecutor)
        return diagnose(path, shot, folder / "out", options=DiagnosisOptions(workers=2, runs=8))


def test_a_late_record_of_another_solver_is_found_and_the_case_repaired(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, record(late=6e-5))
    assert found.effects[0].name == "time_offset"
    assert "time_offset" in found.confidence_set
    low, high = found.named("time_offset").interval_95 or (np.nan, np.nan)
    assert low < 6e-5 < high
    assert found.after is not None
    assert found.after.raw < 1.2 < 2.0 < found.before.raw
    assert {one.name for one in found.effects} == CARRIED | {"none", "something_else"}
    assert found.refused["clamp_rotation"] == "the deck has no place for plate.edges.rotational"
    assert any("its discretisation error is not measured and may be taken for an effect" in w for w in found.warnings)
    repaired = load_case(tmp_path / "out" / (found.case_after or ""))
    again, shot = simulate_external(repaired), record(late=6e-5)
    off = np.interp(shot.time, again.time, again.channels["displacement_centre"]) - shot.channels["displacement_centre"]
    assert np.sqrt(np.mean(off**2)) == pytest.approx(NOISE, rel=0.2)


def test_effects_that_no_record_can_separate_share_the_probability(tmp_path: Path) -> None:
    """The oscillator is linear: speed, the sine of the angle and the transducer's gain are one factor on its curve."""
    found = diagnosed(tmp_path, record(faster=3.0))
    speed = found.named("impact_speed")
    assert min(speed.twins[name] for name in ("impact_angle", "sensor_gain")) > 0.99
    assert max(found.probabilities[name] for name in ("impact_speed", "impact_angle", "sensor_gain")) < 0.9
    low, high = speed.interval_95 or (np.nan, np.nan)
    assert low < 3.0 < high
    assert found.next_measurement is not None
    assert found.next_measurement["channel"] == "baseline"  # the deck writes no other sensor
