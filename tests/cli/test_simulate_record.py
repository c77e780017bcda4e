"""`simulate --noise`: a record that says what it is, readable as measured data, beside noise-free histories."""

from __future__ import annotations

import numpy as np
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.data.curves import read_histories, read_measured
from birdstrike.reports.results.measurement import origin
from tests.doe.external_case import written

SETTINGS = {
    "bird.particles": "200",
    "plate.elements": "[8, 6]",
    "time.end": "0.3 ms",
    "time.snapshots": "[]",
    "sensors.strain_1.kind": "strain",
    "sensors.strain_1.noise": "5e-6",
    "sensors.gauge.kind": "pressure",
}


def test_a_noisy_record_stands_beside_clean_histories(tmp_path):
    sets = [word for key, text in SETTINGS.items() for word in ("--set", f"{key}={text}")]
    command = ["simulate", "reference_strike_156mm", "--out", str(tmp_path), "--threads", "1", "--noise", "3", *sets]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    record, histories = read_measured(tmp_path / "record.csv"), read_histories(tmp_path / "histories.csv")
    assert record.simulated
    assert record.units == histories.units
    assert record.units["strain_1"] == ""
    assert record.units["gauge"] == "Pa"
    assert set(record.sigma) == {"displacement_centre", "strain_1"}
    instants = [line.split(",")[0] for line in (tmp_path / "record.csv").read_text().splitlines()[3:]]
    assert instants[:4] == ["0", "0.005", "0.01", "0.015"]
    assert max(map(len, instants)) == len("0.005")
    noise = record.channels["strain_1"] - histories.channels["strain_1"]
    assert 3e-6 < np.std(noise) < 7e-6
    assert np.allclose(record.channels["gauge"], histories.channels["gauge"], rtol=1e-9)


def test_noise_without_a_sigma_is_refused_before_the_run(tmp_path):
    command = ["simulate", "reference_strike", "--out", str(tmp_path), "--noise", "1"]
    result = CliRunner().invoke(app, [*command, "--set", "sensors.displacement_centre.noise=0 mm"])
    assert result.exit_code == 1
    assert "no sensor has noise" in result.output


def test_a_record_of_another_program_names_that_program(tmp_path):
    case = written(tmp_path / "case")
    noise = ["--set", "sensors.displacement_centre.noise=0.01 mm"]
    result = CliRunner().invoke(app, ["simulate", str(case), "--out", str(tmp_path / "out"), "--noise", "3", *noise])
    assert result.exit_code == 0, result.output
    assert "size" not in result.stdout, "the size of its model is not known"
    record = read_measured(tmp_path / "out" / "record.csv")
    assert record.provenance[0] == "SIMULATED by oscillator 1, run by birdstrike, from case oscillator, NOT MEASURED."
    assert origin(record) == "simulated by oscillator 1"
