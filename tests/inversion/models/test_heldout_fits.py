"""What is left out of a fit: the same instants for every model, each part's own discrepancy, every part's answer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from birdstrike.data.histories import Array
from birdstrike.inversion.estimation.locate import InversionOptions
from birdstrike.inversion.estimation.shots import CampaignShot
from birdstrike.inversion.models import heldout_fits
from birdstrike.inversion.models.calibrate_models import calibrate_models
from birdstrike.inversion.models.error_terms import Discrepancy
from birdstrike.inversion.models.points import time_blocks
from birdstrike.inversion.models.ranking import ranked
from birdstrike.inversion.models.results import ModelAnswer
from birdstrike.solver.case.case import Case
from tests.inversion.models import rig

OFFSET = 20e-6


def uncertain(case: Case) -> Case:
    """With a time origin that is not known, and a contact late enough to be before or after points of the record."""
    return case.overlaid(
        {"impact": {"standoff": "12 mm"}, "inversion": {"nuisance": {"time_offset": f"{1e6 * OFFSET} us"}}}
    )


def test_the_thirds_of_a_record_are_the_same_instants_whatever_a_model_s_clock(tmp_path: Path) -> None:
    """The first third began at each model's own contact, so that models were scored on different points."""
    case = uncertain(rig.shot(80.0))
    record = rig.record(case, "murnaghan", rig.TRUTH, 0, "shot")

    def of_clock(late: dict[str, float]) -> dict[str, int]:
        with rig.formula_for_solver() as patch:
            patch.setattr(
                "birdstrike.inversion.models.joint_fit.own_origin",
                lambda shot: (late[shot.dataset.names[0]], True),
            )
            found = calibrate_models(
                case, record, tmp_path / "out", ["null", "murnaghan"], runs=10, workers=1, posterior=False
            )
        return {name: len(one.residuals["shot"]["displacement_centre"]) for name, one in found.models.items()}

    points = of_clock({"bird.material.viscosity": -40e-6, "bird.material.pressure_cutoff": 55e-6})
    instants = record.time[record.time >= case.first_contact - 4.0 * OFFSET]
    spared = instants[instants <= 1e-3 - 4.0 * OFFSET]
    assert points == {"null": len(spared), "murnaghan": len(spared)}


def test_models_of_other_points_are_not_ranked_together() -> None:
    drawn = np.random.default_rng(0).normal(size=60)

    def of(points: Array) -> ModelAnswer:
        return ModelAnswer("m", "", residuals={"shot": {"centre": tuple(map(float, points))}})

    larger = ranked({"a": of(drawn), "b": of(1.05 * drawn)})
    assert larger.answers["a"].probability_best == 1.0  # 5 % more everywhere: blocks are pairs
    assert larger.tied == ()
    with pytest.raises(ValueError, match=r"a and b differ: .*60.*59"):
        ranked({"a": of(drawn), "b": of(1.05 * drawn[1:])})


def test_a_part_is_left_out_with_the_discrepancy_of_the_shots_that_stay(tmp_path: Path) -> None:
    """Each shot's discrepancy begins at its own contact, 1 mm at 60 and at 100 m/s before the plate."""
    contacts: list[list[float]] = []
    honest = heldout_fits.with_discrepancy

    def seen(columns: Any, discrepancy: Discrepancy, share: float) -> Any:
        contacts.append(list(discrepancy.contacts))
        return honest(columns, discrepancy, share)

    cases, records = rig.shots()
    with rig.formula_for_solver() as patch:
        patch.setattr(heldout_fits, "with_discrepancy", seen)
        calibrate_models(cases, records, tmp_path, ["null"], runs=10, workers=1, posterior=False)
    assert contacts == [[pytest.approx(1e-3 / 100.0)], [pytest.approx(1e-3 / 60.0)]]


def test_the_answers_without_each_third_are_kept(tmp_path: Path) -> None:
    """Only the first of three was."""
    cases, records = rig.shots()
    with rig.formula_for_solver():
        found = calibrate_models(cases[0], records[0], tmp_path, ["murnaghan"], runs=10, workers=1, posterior=False)
    own = found.models["murnaghan"]
    parts = own.heldout_parameters
    assert list(parts) == ["shot_0, third 1", "shot_0, third 2", "shot_0, third 3"]
    assert len({part["bird.material.viscosity"] for part in parts.values()}) == 3
    k = [part["bird.material.eos.B"] * part["bird.material.eos.g"] for part in parts.values()]
    assert k[2] == pytest.approx(420e6, rel=0.1)
    assert own.strikes == {"shot_0": own.runs + 1 + 3 + 1}


def test_thirds_begin_at_the_record_s_first_point_where_it_begins_late() -> None:
    """Else the first third of a record that was triggered late would be empty."""
    case = rig.shot(80.0)
    record = rig.record(case, "murnaghan", rig.TRUTH, 0, "shot")
    late = record.time >= 0.4e-3
    cut = replace(
        record,
        time=record.time[late],
        channels={name: values[late] for name, values in record.channels.items()},
        sigma={name: values[late] for name, values in record.sigma.items()},
    )
    dataset: Any = rig_dataset(case)
    shot = CampaignShot(dataset, cut, lambda _: None, InversionOptions(), case=case)  # pyright: ignore[reportArgumentType]
    assert time_blocks(shot, 3) == pytest.approx([0.4e-3, 0.6e-3, 0.8e-3, 1.0e-3])
    assert time_blocks(replace(shot, measured=record), 3)[0] == pytest.approx(1e-3 / 80.0)


def rig_dataset(case: Case) -> Any:
    """As much of a campaign as says what is expected of a record."""
    run = rig.strike(case)
    curves = {name: values[None] for name, values in run.channels.items()}
    return SimpleNamespace(time=run.time, curves=curves, channel_units=run.units, drifts={})
