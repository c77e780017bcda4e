"""Verification: verdicts, reasons, the Rankine-Hugoniot solver, what is kept between runs, and the page."""

from __future__ import annotations

import math
import re
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.histories import Histories, Snapshot
from birdstrike.reports.verification.cache import Cache, Result, fingerprint, imported
from birdstrike.reports.verification.columns import SEED
from birdstrike.reports.verification.made import Made, made_now
from birdstrike.reports.verification.page import page, write_page
from birdstrike.reports.verification.problem import Picture, Problem, Reason, Row, Solution, below, matches, near, shown
from birdstrike.reports.verification.problems.bird_model import deformation
from birdstrike.reports.verification.problems.planar import crossing, planar_impact
from birdstrike.reports.verification.registry import chosen, problems
from birdstrike.reports.verification.runs import RunSpec, compute, momentum_given
from birdstrike.reports.verification.verify import Verification, result_named, verify
from birdstrike.solver.bird.eos.grueneisen import grueneisen
from birdstrike.solver.bird.eos.murnaghan import murnaghan
from birdstrike.solver.reference.hugoniot import jump, pressure_of
from birdstrike.solver.reference.stagnation import compressible_stagnation_pressure

SMALL = RunSpec(
    "reference_strike_156mm",
    (
        ("bird.particles", "300"),
        ("plate.elements", "[12, 10]"),
        ("time.end", "0.6 ms"),
        ("time.snapshots", "[]"),
        ("impact.standoff", "1 mm"),
    ),
)


def test_a_row_is_judged_by_its_error_and_nan_never_passes():
    assert matches("a", 101.0, 100.0, "Hz", 1.01, "s").verdict == "within"
    assert matches("a", 101.0, 100.0, "Hz", 0.99, "s").verdict == "beyond"
    assert matches("a", 99.0, 100.0, "Hz", 0.99, "s").verdict == "beyond"
    assert near("a", 1.8, 2.0, "", 0.3, "s").error == pytest.approx(-0.2)
    assert below("a", math.nan, 1.0, "%", "s").verdict == "beyond"
    assert below("a", -3.0, 1.0, "%", "s").verdict == "beyond"
    assert shown("a", 3.0, "%", "s").verdict == "shown"


def solved(*rows: Row, reasons: dict[str, Reason] | None = None) -> Result:
    problem = Problem("p", "Family of rows", "About it.", lambda _: Solution(()))
    return Result(problem, rows, (), reasons or {}, 1.0)


def test_a_row_beyond_stands_only_with_a_reason_and_at_most_three_do():
    bad = [below(f"bad {i}", 2.0, 1.0, "%", "s") for i in range(4)]
    why = {row.name: Reason("shown by experiment", "figure") for row in bad}
    assert Verification((solved(below("good", 0.5, 1.0, "%", "s")),), 1.0).stands
    assert not Verification((solved(bad[0]),), 1.0).stands
    assert Verification((solved(*bad[:3], reasons=why),), 1.0).stands
    assert not Verification((solved(*bad, reasons=why),), 1.0).stands


def test_a_bird_s_deformation_is_free_of_its_flight_and_counts_a_stretch():
    rng = np.random.default_rng(0)
    shape = rng.normal(size=(200, 3))
    shape -= shape.mean(axis=0)

    def run(after: np.ndarray) -> Histories:
        empty, none = np.zeros((0, 3)), np.zeros(0, dtype=np.int64).reshape(0, 8)
        snapshots = tuple(
            Snapshot(t, x, np.zeros(200), x, np.zeros(200, bool), np.zeros(200), none, empty, none, np.zeros(0))
            for t, x in ((1e-4, shape), (1.5e-3, after))
        )
        return Histories(np.zeros(1), {}, {}, {}, snapshots)

    turned = Rotation.from_rotvec([0.2, -0.4, 0.9]).apply(shape) + np.array([1.0, -2.0, 3.0])
    assert deformation(run(turned)) == pytest.approx(0.0, abs=1e-9)
    assert deformation(run(1.1 * turned)) == pytest.approx(0.1, rel=1e-6)


def test_grueneisen_hugoniot_is_the_straight_line():
    """u_s = C + S1 u exactly with gamma0 = 0."""
    pressure = pressure_of(SEED.eos)
    for u in (45.0, 300.0):
        found = jump(pressure, SEED.rho0, u)
        assert found.shock == pytest.approx(1670.0 + 2.48 * u, rel=1e-10)
        assert found.pressure == pytest.approx(SEED.rho0 * found.shock * u, rel=1e-12)


def test_hugoniot_energy_reaches_the_pressure():
    """With gamma0 > 0 the reference curve of Grueneisen's form is still the Hugoniot: p_H is reproduced."""
    warm = grueneisen(938.0, 1670.0, 2.48, g0=0.8)
    found = jump(pressure_of(warm), 938.0, 200.0)
    assert found.shock == pytest.approx(1670.0 + 2.48 * 200.0, rel=1e-9)


def test_perfect_gas_reaches_its_limiting_compression():
    """Strong shock of a gas, gamma = 1.4: density ratio (gamma + 1)/(gamma - 1) = 6, u_s = 1.2 u."""
    gas = jump(lambda rho, energy: 0.4 * energy * rho / 1.2, 1.2, 1000.0)
    assert gas.density / 1.2 == pytest.approx(6.0, rel=1e-8)
    assert gas.shock == pytest.approx(1200.0, rel=1e-8)


def test_no_shock_is_an_error():
    with pytest.raises(UserError, match="no shock"):
        jump(lambda _rho, _energy: 0.0, 1000.0, 100.0)


def test_stagnation_pressure_of_a_compressible_stream():
    """Murnaghan: the integral of dp/rho is B g/(rho0 (g - 1)) [(rho/rho0)^(g - 1) - 1]; of a stiff law rho u^2/2."""
    B, g, u = 9.3e6, 7.14, 100.0
    ratio = (1.0 + 0.5 * u * u * 938.0 * (g - 1.0) / (B * g)) ** (1.0 / (g - 1.0))
    assert compressible_stagnation_pressure(murnaghan(938.0, B, g), u) == pytest.approx(B * (ratio**g - 1.0), rel=1e-6)
    assert compressible_stagnation_pressure(murnaghan(938.0, 1e4 * B, g), u) == pytest.approx(
        0.5 * 938.0 * u * u, rel=1e-4
    )


def test_a_front_is_found_between_the_planes():
    assert crossing(np.array([0.0, 1.0, 2.0]), np.array([10.0, 8.0, 2.0]), 5.0) == pytest.approx(1.5)
    assert crossing(np.array([0.0, 1.0]), np.array([1.0, 0.0]), 5.0) == 0.0


def test_planar_impact_finds_the_hugoniot_on_a_short_column():
    """Within 4 % while the start still rings; the page's long columns are within 1 %."""
    truth = jump(pressure_of(SEED.eos), SEED.rho0, 100.0)
    ours = planar_impact(100.0, truth.shock, length=80, side=2)
    assert ours.pressure == pytest.approx(truth.pressure, rel=0.04)
    assert ours.shock == pytest.approx(truth.shock, rel=0.04)
    assert abs(ours.energy_error) < 0.01


def test_a_varied_simulation_conserves_momentum_and_keeps_its_stand_off():
    """A turned lattice and a wider gap: momentum to rounding; a particle first touches about when the surface does."""
    start = SMALL.with_(impact__standoff="20 mm")
    plain, varied = compute(start), compute(replace(start, roll=0.5, gap=1e-3, stiffness=0.5))
    case = start.load()
    skin = 0.5 * (case.bird.volume / case.bird.particles) ** (1.0 / 3.0)
    for run in (plain, varied):
        force = run.channels["contact_force"]
        first = run.time[np.argmax(force > 0.0)]
        assert first == pytest.approx(case.first_contact, abs=skin / case.normal_speed)
        assert run.summary["momentum_error"] < 1e-10
        assert momentum_given(run)[-1] > 0.0
    assert not np.array_equal(plain.channels["contact_force"], varied.channels["contact_force"])


def test_every_problem_has_a_name_of_its_own_and_every_pattern_must_fit():
    assert len(problems()) >= 15
    assert {p.name for p in chosen(["plate_*"])} == {"plate_frequencies", "plate_step_linear", "plate_step_large"}
    assert chosen(["The OpenRadioss strike"])
    with pytest.raises(UserError, match="fits no problem"):
        chosen(["no_such"])


def test_what_is_solved_is_kept_until_its_inputs_change(tmp_path: Path):
    problem = problems()["kernel_moments"]
    outcome = problem.solve({})
    cache = Cache(tmp_path)
    assert cache.recall(problem) is None
    cache.keep(problem, outcome, 1.5)
    kept = cache.recall(problem)
    assert kept is not None
    assert kept.rows == outcome.rows
    other = Problem(problem.name, problem.family, problem.about, problem.solve, (SMALL,))
    assert fingerprint(other) != fingerprint(problem)
    assert cache.recall(other) is None


def test_what_is_solved_depends_on_what_it_imports_and_on_nothing_else():
    """Files are found by what the problem's module imports, not by their names."""
    files = {path.name for path in imported("birdstrike.reports.verification.problems.shell")}
    assert {"shell.py", "plate.py", "plate_ritz.py", "draw.py", "style.py", "runs.py"} <= files
    assert not {"page.py", "verify.py", "registry.py", "planar.py", "results.py"} & files


def test_a_second_verify_runs_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    first = verify(None, only=["return_mapping"], workers=1, cache=tmp_path)
    assert [row.verdict for row in first.rows] == ["within"] * 6

    def refuse(_workers: int) -> None:
        raise AssertionError("nothing is due")

    monkeypatch.setattr("birdstrike.reports.verification.verify.process_pool", refuse)
    second = verify(None, only=["return_mapping"], workers=1, cache=tmp_path)
    assert second.rows == first.rows
    assert first.spent["return_mapping"] > 0.0
    assert second.spent == {}


def test_a_single_pattern_is_no_list_of_letters_and_a_count_of_processes_is_one(tmp_path: Path):
    found = verify(None, only="return_mapping", workers=1, cache=tmp_path)
    assert [one.problem.name for one in found.results] == ["return_mapping"]
    with pytest.raises(UserError, match="--workers = 0 is below 1"):
        verify(None, only="return_mapping", workers=0, cache=tmp_path / "other")


def test_only_adds_a_problem_to_a_page_and_renews_it_and_says_at_which_commit_each_row_was_made(tmp_path: Path):
    """A page of one problem, made by older code; a second joins it, then the first is made anew."""
    out = tmp_path / "page.md"
    problem = problems()["kernel_moments"]
    old = Result(problem, problem.solve({}).rows, (), {}, 3.0, Made("0" * 12, "abcdef123456", "2026-01-02"), "older")
    write_page(out, [old], 1.0)

    said = list[str]()
    verify(out, only=["return_mapping"], workers=1, cache=tmp_path / "kept", told=said.append)
    both = out.read_text()
    assert re.search(r"\| integral of W \|.*\| abcdef1 \|\n", both)
    assert re.search(rf"\| pure shear, isotropic \|.*\| {re.escape(made_now().short)} \|\n", both)
    assert "abcdef1: solver 000000000000, commit abcdef123456, 2026-01-02: 7 rows" in both
    assert "return_mapping" in said[0]
    assert "1 of 1" in said[0]

    verify(out, only=["kernel_moments"], workers=1, cache=tmp_path / "kept")
    renewed = out.read_text()
    assert "abcdef1" not in renewed
    assert "made at" not in renewed
    assert "| integral of W |" in renewed
    assert "| pure shear, isotropic |" in renewed


def test_the_page_says_verdicts_reasons_and_sources(tmp_path: Path):
    good = matches("frequency", 398.0, 397.7, "Hz", 1.0, "Ritz", figure="pic")
    bad, worse = (below(name, 4.0, 3.0, "%", "other code") for name in ("misfit", "unexplained misfit"))
    cache = Cache(tmp_path)
    problem = replace(problems()["kernel_moments"], family="Family of rows")
    picture = Picture("pic", Figure(figsize=(2, 2)), "What is seen: 398 Hz.")
    reasons = {"misfit": Reason("the lattice alone moves it by 4 %.", "pic")}
    cache.keep(problem, Solution((good, bad, worse), (picture,), reasons), 1.0)
    kept = cache.recall(problem)
    assert kept is not None
    text = page([kept], 90.0)
    assert "**1 rows within** their tolerance, **2 beyond**" in text
    assert "[Family of rows](#family-of-rows): 1 of 3 within" in text
    assert re.search(
        r"\| \[frequency\]\(docs/verification/pic\.png\) \| 397\.7 Hz \| 398 Hz \| \+0\.0754 % \| 1 % \|", text
    )
    assert "the lattice alone moves it by 4 %." in text
    assert "unexplained misfit: 4 %, tolerance 3 %.** No figure is recorded with it" in text
    assert "*What is seen: 398 Hz.*" in text
    assert "Not solved for this page: planar_impact" in text
    assert kept.pictures[0].path.read_bytes()[:4] == b"\x89PNG"


def test_a_failing_simulation_is_named():
    failed: Future[float] = Future()
    failed.set_exception(RunFailed("went unstable", "lower solver.courant"))
    with pytest.raises(RunFailed, match="sensitivity_viscous: went unstable"):
        result_named(failed, "sensitivity_viscous")
