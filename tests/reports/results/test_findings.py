"""The five findings are computed: each follows its input."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from birdstrike.data.curves import Measured, write_measured
from birdstrike.data.run_warnings import merged, unlike
from birdstrike.inversion.results.estimates import Estimate
from birdstrike.inversion.results.fit import TimeOrigin
from birdstrike.reports.page.page import report
from birdstrike.reports.results.findings import findings, key_figures, percent
from birdstrike.reports.results.measurement import origin, record_position, residual
from birdstrike.reports.results.reading import read_results
from birdstrike.reports.results.results import Results
from tests.diagnoses import effect, state, written_diagnosis
from tests.reports.synthetic import RECORD_TIMES, contact_force, displacement, finished_folder

CHANNEL = "displacement_centre"
PC, MU = "bird.material.pressure_cutoff", "bird.material.viscosity"


def changed(one: Results, other: Results) -> list[int]:
    """Numbers (from 1) of the lines that differ."""
    return [i for i, (a, b) in enumerate(zip(findings(one), findings(other), strict=True), 1) if a != b]


def with_answer(results: Results, **changes: Any) -> Results:
    """The best answer changed."""
    methods = {**results.inversion.methods, results.best: replace(results.answer, **changes)}
    return replace(results, inversion=replace(results.inversion, methods=methods))


def with_estimate(results: Results, name: str, **changes: Any) -> Results:
    """One estimate of the best answer changed."""
    parameters: Mapping[str, Estimate] = results.answer.parameters
    return with_answer(results, parameters={**parameters, name: replace(parameters[name], **changes)})


def test_another_record_changes_what_is_said_of_it(results: Results, simulated: Path) -> None:
    other = read_results(simulated)
    assert changed(results, other) == [1, 2, 3, 4]
    first, second, third, fourth, _ = findings(other)
    assert "is simulated by LS-DYNA, not measured" in first
    assert "peak 5.70 mm at 1.53 ms" in first
    assert f"{1e3 * (other.answer.verified_rmse or 0.0):.3f} mm RMS" in second
    assert ": none. Not identified: PC, MU, TEROD, CEROD" in third
    assert "this parameter" not in third
    assert re.search(r"outside the campaign's 25 simulations by more than noise at \d+ of 12 points", fourth)


def test_a_diagnosis_that_identifies_a_parameter_is_told_beside_the_inversion(results: Results, tmp_path: Path) -> None:
    """The summary said "identified: none. Not identified: MU" on a page whose diagnosis gave MU with an interval."""
    fitted = {"value": 417.0, "unit": "Pa s", "interval_95": [305.0, 529.0], "identified": True}
    rest = {"value": -6e5, "unit": "Pa", "interval_95": [-1.25e6, -5e4], "identified": False}
    after = state("impact_speed", parameters={PC: rest, MU: fitted})
    written_diagnosis(tmp_path, effect("impact_speed"), after=after)
    other = replace(results, diagnosis=tmp_path)
    assert changed(results, other) == [3]
    assert findings(other)[2].endswith(
        " The diagnosis, with simulations of its own and the effect impact speed, identifies viscosity MU 417 Pa s "
        "(95 %: 305 Pa s to 529 Pa s)."
    )


def test_a_measured_record_is_called_measured(results: Results) -> None:
    assert "the record shot7 is measured: 12 points of displacement centre" in findings(results)[0]
    assert "of 0.999 kg at 91.1 m/s (45.5 m/s normal to the plate)" in findings(results)[0]


def test_a_record_in_a_file_record_csv_is_named_once(results: Results) -> None:
    """As `simulate --noise` writes it."""
    found = findings(replace(results, record=replace(results.record, path="strike/record.csv")))
    assert "; the record is measured: 12 points" in found[0]


def test_the_verified_error_is_the_one_of_the_best_method(results: Results) -> None:
    scores = {CHANNEL: replace(results.answer.channels[CHANNEL], verified_rmse=3.21e-4, verified_relative=0.0567)}
    other = with_answer(results, channels=scores)
    assert changed(results, other) == [2]
    assert (
        f"at the {results.best}'s answer differs from the record by 0.321 mm RMS, 5.7 % of the peak"
        in findings(other)[1]
    )


def test_the_time_offset_is_said_with_its_sense(results: Results) -> None:
    for value, words in (
        (5e-5, "0.0500 ms later"),
        (-5e-5, "0.0500 ms earlier"),
        (6.3e-6, "6.3 µs later"),
        (1e-8, "agree within 1 µs"),
    ):
        moved = replace(results, inversion=replace(results.inversion, time_offset=TimeOrigin(value, 1e-4, None)))
        assert words in findings(moved)[1]
    fixed = replace(results, inversion=replace(results.inversion, time_offset=TimeOrigin(0.0, None, None)))
    assert "record and simulation share one clock" in findings(fixed)[1]


def test_identified_parameters_carry_value_and_interval(results: Results) -> None:
    known = with_estimate(results, MU, value=640.0, interval_95=(500.0, 900.0), identified=True)
    assert "viscosity MU 640 Pa s (95 %: 500 Pa s to 900 Pa s)" in findings(known)[2]


def test_a_parameter_that_is_not_identified_shows_its_reason_and_no_digits(results: Results) -> None:
    value = results.answer.parameters[PC].value
    assert value is not None
    lost = with_estimate(results, PC, identified=False, reason="the noise hides it")
    assert changed(results, lost) == [3]
    line = findings(lost)[2]
    assert "PC: the noise hides it" in line
    assert f"{abs(value) / 1e6:.3f}" not in line
    assert f"{abs(value) / 1e6:.3f}" in findings(results)[2]


def test_the_largest_residual_is_named_with_time_and_sign(results: Results) -> None:
    values = results.simulated[results.best][CHANNEL].copy()
    values[4] = results.record.channels[CHANNEL][4] - 0.5e-3
    moved = replace(results, simulated={**results.simulated, results.best: {CHANNEL: values}})
    assert changed(results, moved) == [4]
    assert "0.500 mm at 1.09 ms, the simulation below the record" in findings(moved)[3]
    assert residual(moved, CHANNEL, results.best).worst == (pytest.approx(1.09e-3), pytest.approx(-0.5e-3))


def test_a_record_above_all_simulations_is_counted_point_by_point(results: Results) -> None:
    values = results.record.channels[CHANNEL].copy()
    high = record_position(results, CHANNEL).high
    values[[5, 6]] = high[[5, 6]] + np.array([0.2e-3, 0.3e-3])
    lifted = replace(results, record=replace(results.record, channels={CHANNEL: values}))
    assert "at 2 of 12 points, up to 0.300 mm above them at 1.53 ms" in findings(lifted)[3]
    within_noise = values.copy()
    within_noise[[5, 6]] = high[[5, 6]] + 0.05e-3  # the case states 0.03 mm of noise
    inside = replace(results, record=replace(results.record, channels={CHANNEL: within_noise}))
    said = "lies within the range of the campaign's 25 simulations, within noise, at all 12 points"
    assert said in findings(inside)[3]


def test_the_energy_balance_names_the_worst_run_and_the_cost(results: Results) -> None:
    summaries = {**results.summaries, "run 3": {**results.summaries["run 3"], "energy_error": -0.013, "wall_s": 600.0}}
    other = replace(results, summaries=summaries, failures={"run 26": "unstable"})
    assert changed(results, other) == [5]
    line = findings(other)[4]
    assert "27 simulations used, 1 more failed, worst energy error 1.3 % of the initial normal kinetic energy" in line
    assert "(run 3)" in line
    minutes = sum(summary["wall_s"] for summary in summaries.values()) / 60
    assert f"{minutes:.2g} minutes of solver time" in line
    brief = {name: {**one, "wall_s": 1.0, "momentum_error": 1.3e-15} for name, one in results.summaries.items()}
    line = findings(replace(results, summaries=brief))[4]
    assert "worst momentum error at the level of rounding" in line, "1e-15 of the bird's momentum"
    assert f"; {len(brief)} s of solver time." in line, "0.46 minutes"
    long = {name: {**one, "wall_s": 2e4} for name, one in results.summaries.items()}
    assert "; 150 hours of solver time." in findings(replace(results, summaries=long))[4], "1.5e+02 hours"


def test_failures_and_the_simulations_own_warnings_reach_the_reader(results: Results) -> None:
    warned = {name: {**summary, "warnings": ["hourglass is 7 %"]} for name, summary in results.summaries.items()}
    other = replace(results, summaries=warned, failures={"run 26": "unstable"})
    assert other.warnings[-2:] == (
        "run 26 failed and is not used: unstable",
        "hourglass is 7 % (27 of 27 simulations)",
    )


def test_figures_for_programs_are_the_raw_numbers(results: Results) -> None:
    figures = key_figures(results)
    assert figures["methods"] == {
        name: {"verified_rmse": answer.verified_rmse, "verified_relative": answer.verified_relative}
        for name, answer in results.inversion.methods.items()
    }
    assert figures["strikes"] == 27
    assert figures["inside_cloud"] is True


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("SIMULATED (by LS-DYNA), NOT MEASURED: no instrument took this curve.", "simulated by LS-DYNA"),
        ("SIMULATED (LS-DYNA), NOT MEASURED.", "simulated by LS-DYNA"),
        ("SIMULATED by OpenRadioss (open explicit code), NOT MEASURED.", "simulated by OpenRadioss"),
        ("SIMULATED, NOT MEASURED", "simulated, see its provenance"),
        ("Shot 7 of March, gauge 3.", "measured"),
    ],
)
def test_origin_follows_the_provenance(line: str, expected: str) -> None:
    record = Measured(RECORD_TIMES, {}, {}, {}, ("A title.", line))
    assert origin(record) == expected


def test_per_cent_keeps_two_digits() -> None:
    assert [percent(share) for share in (0.0641, 0.112, 0.00042)] == ["6.4 %", "11 %", "0.042 %"]


def test_a_record_of_two_channels_with_a_gap_is_told_channel_by_channel(tmp_path: Path) -> None:
    time = np.linspace(-0.3e-3, 2.3e-3, 131)
    noise = np.random.default_rng(1).normal(size=(2, time.size))
    force = contact_force(time) + 500.0 * noise[1]
    force[50:70] = np.nan
    channels = {CHANNEL: displacement(time, 5.5e-3, 2.38e-3) + 3e-5 * noise[0], "contact_force": force}
    sigma = {CHANNEL: np.full(time.size, 3e-5)}
    record = Measured(time, channels, sigma, {CHANNEL: "m", "contact_force": "N"}, ("Shot 9.",))
    write_measured(tmp_path / "shot9.csv", record)
    with pytest.MonkeyPatch.context() as patch:
        finished_folder(tmp_path, tmp_path / "shot9.csv", patch, runs=12, posterior=False)
    results = read_results(tmp_path)
    first, second, _, fourth, _ = findings(results)
    assert "116 used points of displacement centre" in first
    assert "96 used points of contact force" in first
    assert re.search(r"mm \([\d.]+ %\) in displacement centre and [\d.]+ kN \([\d.]+ %\) in contact force", second)
    assert "RMS, and share of the peak" in second
    assert fourth.count("(simulation ") == 2
    text = report(tmp_path, models=False).read_text(encoding="utf-8")
    for name in ("models", "comparison", "prior-predictive"):
        assert all(f'id="figure-{name}-{channel}"' in text for channel in channels)
    assert "(sigma column)" in text
    assert "(scatter of neighbouring points)" in text


def test_the_emulators_own_error_is_named_with_the_noise(results: Results) -> None:
    found = results.inversion.prior_predictive
    coarse = replace(found, inside=False, coarse="the emulator predicts strain (Q2 0.23) poorly")
    other = replace(results, inversion=replace(results.inversion, prior_predictive=coarse))
    assert "within noise and the emulator's error the model can produce the whole curve" in findings(results)[3]
    said = (
        "too coarse to say whether the model can produce the whole curve; the emulator predicts strain (Q2 0.23) poorly"
    )
    assert said in findings(other)[3]


def test_warnings_of_several_simulations_keep_the_order_of_each() -> None:
    """The plate tore in the last run alone, and that is graver than what all of them have."""
    shock = "the shock viscosity is {} Pa s"
    runs = [[shock.format(83)], [shock.format(94)], ["the plate tore: 3 shells", shock.format(90)]]
    assert merged(runs) == (
        "the plate tore: 3 shells (1 of 3 simulations)",
        "the shock viscosity is 83 .. 94 Pa s (3 of 3 simulations)",
    )
    other = ("the shock viscosity is 90 Pa s (2 of 2 simulations)", "the record begins late")
    assert unlike(other, merged(runs)) == other[1:]
