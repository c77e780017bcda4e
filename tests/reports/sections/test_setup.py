"""The page and the evidence say what a case states of effects and instruments."""

from __future__ import annotations

from dataclasses import replace

from birdstrike.reports.blocks import Table
from birdstrike.reports.results.results import Results
from birdstrike.reports.sections.setup import section


def test_the_set_up_has_the_effects_and_the_instruments_of_the_case(results: Results) -> None:
    case = results.case.with_effects({"edge_slip": 1e-9})
    case = case.overlaid({"instrument": {"displacement_centre": {"bandwidth": "20 kHz", "gain": 1.03}}})
    (table,) = (block for block in section(replace(results, case=case)).blocks if isinstance(block, Table))
    rows = {str(row[0]): str(row[1]) for row in table.rows}
    assert rows["effect of the case"].startswith("effects.edge_slip = +1 mm^2/kN")
    assert rows["instrument of displacement centre"] == "bandwidth 20 kHz, gain 1.03"
