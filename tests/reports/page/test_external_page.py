"""The report of a case that another program simulates: whose curves they are, and what is not known of them."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import pytest

import birdstrike.reports.comparison.models as models
from birdstrike.data.storage.store import RunStore
from birdstrike.reports.page.page import report
from birdstrike.reports.results.measurement import program_in
from birdstrike.reports.results.parts import find_parts


@contextmanager
def threads(workers: int) -> Iterator[ThreadPoolExecutor]:
    with ThreadPoolExecutor(workers) as pool:
        yield pool


@pytest.fixture(scope="module")
def text(external_loop: Path) -> str:
    """The page's HTML, standard birds asked for."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(models, "process_pool", threads)
        return report(external_loop / "inversion", doe=external_loop / "doe").read_text(encoding="utf-8")


def test_the_curves_are_called_those_of_the_other_program(text: str, external_loop: Path) -> None:
    assert program_in(external_loop / "inversion") == "oscillator 1"
    assert "every model curve is simulated by oscillator 1." in text
    assert "simulated by birdstrike" not in text
    assert "digest of its sources" not in text


def test_an_energy_balance_that_is_not_read_is_called_not_known(text: str) -> None:
    assert "8 simulations used" not in text
    assert "9 simulations used, errors of energy and momentum not known" in text
    assert "nan" not in text.split("Energy balance of every simulation")[-1].split("</table>")[0]


def test_a_bird_that_the_deck_has_no_place_for_is_not_simulated_under_its_name(text: str, external_loop: Path) -> None:
    for bird in ("elastic", "plastic-kinematic", "hydrodynamic"):
        assert f"The {bird} bird has no curve, it cannot be simulated: the deck of strike.k.j2 has no place for" in text
    assert len(RunStore(external_loop / "inversion" / "models" / "runs").keys()) == 1  # the inverted bird alone
    assert "without --no-models" not in text


def test_the_report_of_a_loop_finds_the_campaign_that_it_has_adopted(external_loop: Path, tmp_path: Path) -> None:
    """Without it a second report would be of the inversion alone, in the place of the whole one."""
    copied = shutil.copytree(external_loop / "inversion", tmp_path / "loop" / "inversion")
    found = find_parts(tmp_path / "loop")
    assert (found.doe, found.inversion) == (external_loop / "doe", copied)
    assert "campaign" not in " ".join(found.missing)
    options = json.loads((copied / "options.json").read_text())
    (copied / "options.json").write_text(json.dumps({**options, "campaigns": [str(tmp_path / "gone")]}))
    assert find_parts(tmp_path / "loop").doe is None
