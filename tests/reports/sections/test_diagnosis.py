"""What the sections of a diagnosis say is what diagnosis.json holds, and no more."""

from __future__ import annotations

from typing import Any

import pandas as pd

from birdstrike.inversion.results.diagnosis import ShotStates
from birdstrike.reports.blocks import Paragraph, Picture, Section, Table
from birdstrike.reports.figures.diagnosis import probability_figure
from birdstrike.reports.sections.diagnosis import (
    DiagnosisResults,
    _baseline,
    _candidates,
    _errors,
    _parameters,
    basis_section,
    effects_section,
    verdict_section,
)
from tests.diagnoses import diagnosis, effect, state

PAIR = {"effects": ["clamp_rotation", "impact_speed"], "probability": 0.0096}


def effects_of(**figures: Any) -> Section:
    """The section of the effects of a diagnosis with these figures."""
    return effects_section(DiagnosisResults(diagnosis(effect("impact_speed"), **figures), {}, "birdstrike"))


def test_pairs_that_are_not_listed_are_counted() -> None:
    """Five of nine pairs stood there as if they were all, each with the same `(probability 0.01)`."""
    said = effects_of(pairs=(PAIR,) * 9).blocks[-1]
    assert isinstance(said, Paragraph)
    assert said.text.startswith("Pairs of effects in the 95 % set, with their probabilities: clamp rotation and impact")
    assert said.text.count("impact speed 0.010") == 5
    assert said.text.endswith("; 4 more are less likely.")
    few = effects_of(pairs=(PAIR,)).blocks[-1]
    assert isinstance(few, Paragraph)
    assert few.text.endswith("clamp rotation and impact speed 0.010.")


def test_the_title_speaks_of_a_next_measurement_only_where_one_is_listed() -> None:
    one = {"what": "the strain at the edge", "expected_probability": 0.9}
    proposed = {"candidates": [one, one], "separates": ["impact_speed", "bird_mass"], "now": 0.5, "sentence": ""}
    assert effects_of().title == "Diagnosis: every effect considered"
    assert effects_of(next_measurement=proposed).title.endswith(", and what to measure next")
    alone = effects_of(next_measurement=proposed | {"separates": ["impact_speed"]})
    assert len(alone.blocks) == 1, "a single model is told from no other: all its probabilities were 1.00"


def test_a_parameter_that_is_not_identified_has_no_bias() -> None:
    """It had one of -0.0631 MPa, the distance of two places in its range."""

    def fitted(cutoff: float, viscosity: float) -> dict[str, Any]:
        entry = {"unit": "Pa", "value": cutoff, "interval_95": [-1.25e6, -5e4], "identified": False}
        other = {"unit": "Pa s", "value": viscosity, "interval_95": [300.0, 600.0], "identified": True}
        return {"bird.material.pressure_cutoff": entry, "bird.material.viscosity": other}

    before, after = state(parameters=fitted(-6.6e5, 504.0)), state(parameters=fitted(-6.0e5, 417.0))
    rows = {row[0]: row[-1] for row in _parameters(ShotStates("a", "case", before, after), several=False).rows}
    assert rows == {"pressure cutoff": "–", "viscosity": "+87 Pa s"}


def test_errors_of_one_table_have_the_same_digits() -> None:
    """0.12 mm stood below 0.203 mm, and 1 mm below 0.319 mm."""
    shot = ShotStates("a", "case", state(rmse={"w": 2.03e-4}), state(rmse={"w": 1.202e-4}))
    assert _errors(shot, {"w": "m"}).rows[0] == ("w", "0.203 mm", "0.120 mm", "–", "–")


def test_the_birds_that_the_records_tell_of_stand_apart() -> None:
    sensor = {"unit": "m", "sigma": 3e-5, "source": "case", "points": 74, "numerical_share": 0.34}
    figures: dict[str, Any] = {
        "noise": {"sensors": {"w": sensor}},
        "discrepancy": {"source": "1 baseline shot", "amplitude": {}, "growth": {}},
        "strikes": {"paid": 1, "reused": 0},
        "before": state(rmse={"w": 1e-4}),
    }
    base = {"shots": ["clean"], "residual_rms": {}, "gain": None}
    base["bird"] = {"stated": "auto", "records": {"same": 0.6, "recipe": 8e-10, "other": 0.4}, "contradicted": False}
    found = diagnosis(effect("impact_speed"), **figures, baseline=base)
    table, _, told, *_ = basis_section(DiagnosisResults(found, {}, "birdstrike")).blocks
    assert isinstance(table, Table)
    assert table.rows[0][4] == "34 %"
    assert isinstance(told, Paragraph)
    assert "cast and shot alike: 0.60; " in told.text
    assert "another batch: < 0.01; unlike the shot's: 0.40." in told.text


def test_a_family_that_is_all_but_impossible_is_not_of_probability_0() -> None:
    effects = effect("impact_speed", family="impact"), effect("none", family="none", probability=2e-9)
    found = diagnosis(*effects, families={"impact": 1.0, "none": 2e-9})
    left, _ = probability_figure(found).axes
    words = [text.get_text() for text in left.texts]
    assert words[-2:] == ["none < 0.01", "impact 1.00"], "beside their rows, from below"


def test_two_baselines_are_spoken_of_in_the_plural() -> None:
    bird = {"stated": "auto", "records": {}, "contradicted": False}
    told = _baseline({"shots": ["a", "b"], "residual_rms": {"w": 1e-4}, "gain": 2.5, "bird": bird}, {"w": "m"})
    assert told.startswith("Baselines a and b: the calibrated model leaves an RMS of w 0.100 mm. With them, minimum ")
    assert "Nothing was stated of their birds, so" in told


def test_next_measurements_stand_in_the_order_of_what_they_are_worth() -> None:
    """A shot that is needed whatever it tells stood first, as the best, with the least probability of all."""
    candidates = [
        {"what": name, "expected_probability": share}
        for name, share in (("own bird", 0.4), ("far", 0.6), ("near", 0.9))
    ]
    proposal = {"candidates": candidates, "separates": ["bird_mass"], "now": 0.3, "needed": "why", "what": "own bird"}
    table = _candidates(proposal)
    assert [row[0] for row in table.rows] == ["near", "far", "own bird"]
    assert "Needed before all others is own bird: why." in table.caption


def test_a_fault_of_a_sensor_that_is_not_used_is_not_ranked() -> None:
    names = ("impact_speed", "sensor_gain.contact_force", "sensor_gain.displacement_centre")
    found = diagnosis(*map(effect, names), left_out={"contact_force": 0.06})
    table = effects_section(DiagnosisResults(found, {}, "birdstrike")).blocks[0]
    assert isinstance(table, Table)
    assert [row[0] for row in table.rows] == ["impact speed", "sensor gain, displacement centre"]
    assert "The 2 likeliest of 2" in table.caption


def test_every_shot_has_its_residuals_on_the_first_screen() -> None:
    """Of a diagnosis of two shots the page showed the first one's alone."""
    names = ("measured", "sigma", "error", "baseline", "before", "after", "before_solver", "after_solver")
    curves = pd.DataFrame(
        [{"channel": "displacement_centre", "time_s": t} | dict.fromkeys(names, 1.0) for t in (0.0, 1e-3, 2e-3)]
    )
    shots = tuple(ShotStates(name, "case", state(rmse={"displacement_centre": 1e-3}), None) for name in ("a", "b"))
    found = diagnosis(effect("impact_speed"), shots=shots, noise={"sensors": {"displacement_centre": {"unit": "m"}}})
    results = DiagnosisResults(found, {"a": curves, "b": curves}, "birdstrike")
    captions = [block.caption for block in verdict_section(results).blocks if isinstance(block, Picture)]
    assert any(caption.startswith("Shot a.") for caption in captions)
    assert any(caption.startswith("Shot b.") for caption in captions)
