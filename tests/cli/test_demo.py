"""What `make demo` runs on (shipped shot, baseline, case of their rig), and the lines that it ends with."""

from __future__ import annotations

import numpy as np
import pytest
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.cli.close_the_loop import diagnosis_lines
from birdstrike.data.curves import read_measured
from birdstrike.data.paths import resolve_measured
from birdstrike.inversion.diagnosis.diagnose import read_records
from birdstrike.inversion.diagnosis.preparation.plan import meshes
from birdstrike.inversion.results.diagnosis import ShotStates
from birdstrike.loop import answer_of, stated_truth
from birdstrike.solver.case.case import case_hash, load_case
from tests.diagnoses import diagnosis, effect, state

SHOT, BASELINE = "openradioss_speed96", "openradioss_clean1"


def test_the_case_of_the_rig_has_no_error() -> None:
    result = CliRunner().invoke(app, ["check", "demo_rig"])
    assert result.exit_code == 0, result.output
    assert "1.876 kg" in result.stdout


def test_the_case_of_the_rig_stays_what_the_documented_figures_were_made_with() -> None:
    assert case_hash(load_case("demo_rig")) == "c16f3238241ffee6", "docs/performance.md counts this case's runs"


@pytest.mark.parametrize("name", [SHOT, BASELINE])
def test_records_fit_the_case_and_state_what_was_simulated_and_what_was_true(name: str) -> None:
    (shot,) = read_records("demo_rig", name).shots
    case, record = shot.case, shot.record
    assert record.simulated
    assert "SIMULATED by OpenRadioss, NOT MEASURED" in record.provenance[0]
    assert set(record.channels) == set(case.sensors)
    assert 0.95 * case.time.end <= record.time[-1] <= case.time.end
    assert stated_truth(record.provenance)


def test_the_shot_is_as_much_faster_than_the_baseline_as_its_file_states() -> None:
    shot, baseline = (read_measured(resolve_measured(name)) for name in (SHOT, BASELINE))
    assert "96.0 m/s, 5.4 % faster" in stated_truth(shot.provenance)[0]
    # Without plasticity the push on the plate grows with the speed's square, or a little less while the bird flows off.
    rise = [float(np.max(r.channels["displacement_centre"])) for r in (shot, baseline)]
    assert 1.054 < rise[0] / rise[1] < 1.054**2.2


def test_the_diagnosis_s_fine_mesh_is_finer_than_the_records_bird() -> None:
    case = load_case("demo_rig")
    coarse, fine = meshes(case)
    assert case.bird.particles <= 3000
    assert coarse.bird.particles <= case.bird.particles
    assert fine.bird.particles > 4490


def test_the_loop_ends_with_effect_probability_magnitude_and_errors() -> None:
    one = effect(
        "impact_speed",
        5.0,
        meaning="a bird faster or slower than measured",
        unit="m/s",
        interval_95=(4.5, 5.5),
        probability=0.97,
    )
    before = state(
        rmse={"displacement_centre": 9e-4},
        solver={"rmse": {"displacement_centre": 8e-4}, "weighted": 1.0, "raw": 1.0},
    )
    after = state("impact_speed@fast", rmse={"displacement_centre": 2e-4})
    found = diagnosis(
        one,
        sentence="The model lacks speed",
        after=after,
        shots=(ShotStates("slow", "", state(), after), ShotStates("fast", "", before, after)),
        noise={"sensors": {"displacement_centre": {"unit": "m"}}},
    )
    lines = list(diagnosis_lines(answer_of(found)))
    assert lines[0] == "Diagnosis: The model lacks speed."
    assert "impact_speed" in lines[1]
    assert "probability 0.97" in lines[1]
    assert "+5 m/s (95 %: +4.5 .. +5.5 m/s)" in lines[1]
    assert "displacement centre 0.9 mm -> 0.2 mm" in lines[2]
