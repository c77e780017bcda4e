"""The page shows the raw record, what was cut from it, its reading at rest and its noise."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from birdstrike.inversion.results.ingredients import RestFigures
from birdstrike.reports.blocks import Picture
from birdstrike.reports.results.results import Results
from birdstrike.reports.sections.record import section

CENTRE = "displacement_centre"


def picture(results: Results) -> Picture:
    (found,) = (
        block
        for block in section(results).blocks
        if isinstance(block, Picture) and CENTRE in block.caption.lower().replace(" ", "_")
    )
    return found


def test_the_page_has_the_record_as_it_was_read(page: Path) -> None:
    text = page.read_text()
    assert "The record as it was read" in text
    assert "points are used. Band: two standard deviations of the noise" in text


def test_what_was_cut_and_subtracted_stands_under_the_picture(results: Results) -> None:
    time = results.record.time
    rest = RestFigures("offset", 1.2e-3, (1.19e-3, 1.21e-3), 0.0, 0.0, (1.2e-3,))
    cuts = {CENTRE: {"clipped (the same reading in a row)": tuple(map(float, time[3:6]))}}
    measured = replace(results.inversion.measured, cuts=cuts, at_rest={CENTRE: rest})
    spoilt = replace(results, inversion=replace(results.inversion, measured=measured))
    caption = picture(spoilt).caption
    assert "3 points left out, clipped (the same reading in a row)" in caption
    assert "The reading at rest (offset) was subtracted: 1.20 mm before contact (95 %: 1.190 mm .. 1.210 mm)" in caption
    assert picture(spoilt) != picture(results)


def test_instants_at_which_another_shot_alone_was_read_are_not_cut_from_this_one(results: Results) -> None:
    """Of shots inverted together, with a longer record beside a shorter, the report ended in an IndexError."""
    record = results.record
    time = np.concatenate([[-2e-3, -1e-3], record.time])
    read = {name: np.concatenate([[np.nan, np.nan], values]) for name, values in record.channels.items()}
    joint = replace(results, record=replace(record, time=time, channels=read))
    assert picture(joint).caption == picture(results).caption
    read[CENTRE][1] = 0.0
    assert "1 point left out, outside" in picture(replace(results, record=replace(joint.record, channels=read))).caption


def test_a_drift_and_a_hum_are_drawn_as_they_were_subtracted() -> None:
    time = np.linspace(-1e-3, 3e-3, 5)
    drift = RestFigures("offset and drift", 0.0, (0.0, 0.0), 1e-3, 0.0, (1.0, 2.0))
    np.testing.assert_allclose(drift.at(time), 1.0 + 2.0 * (time - 1e-3))
    hum = RestFigures("hum", 0.0, (0.0, 0.0), 0.0, 50.0, (0.0, 0.0, 1.0, 0.5))
    np.testing.assert_allclose(hum.at(time), np.sin(100 * np.pi * time) + 0.5 * np.cos(100 * np.pi * time))
