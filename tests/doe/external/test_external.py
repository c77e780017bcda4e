"""Somebody else's solver: an independent program whose curves are known in closed form, and all that may go wrong."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
import tracemalloc
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from birdstrike.data.curves import Measured
from birdstrike.data.errors import CaseError, MachineFailure, RunFailed, UserError
from birdstrike.data.histories import Array
from birdstrike.data.storage.store import RunStore
from birdstrike.doe.campaign.campaign import run_campaign
from birdstrike.doe.designs.registry import make_design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.doe.external.external import external_solver, simulate_external
from birdstrike.inversion.extras import Extras
from birdstrike.inversion.forward import StoredSolver
from birdstrike.inversion.train_and_invert import train_and_invert
from birdstrike.solver.case.case import Case, case_hash, load_case
from tests.doe.campaign.test_interruption import gone, until
from tests.doe.external_case import CSV, DECK, NODOUT, PROGRAM, UNITS, oscillator, written

LINEARISED = Extras(refine=0, posterior=False)
FORCE = 'format = "columns"\nfile = "force.txt"\nunit = "kN"\ntime_unit = "ms"'


def exact(time: Array, viscosity: float, speed: float = 91.1) -> Array:
    """Displacement [m] of the oscillator of the deck: 1.8 kg, 20 kN/mm, damping as many N s/m as Pa s."""
    mass, stiffness, damping = 1.8, 20e6, viscosity
    decay = damping / (2.0 * mass)
    omega = np.sqrt(stiffness / mass - decay**2)
    return 0.5 * speed / omega * np.exp(-decay * time) * np.sin(omega * time)


@pytest.mark.parametrize("reading", [NODOUT, CSV], ids=["nodout", "csv"])
def test_a_strike_of_the_other_solver_is_its_exact_solution(tmp_path: Path, reading: str) -> None:
    found = simulate_external(oscillator(tmp_path, reading=reading))
    np.testing.assert_allclose(found.time, np.arange(101) * 20e-6)
    np.testing.assert_allclose(found.channels["displacement_centre"], exact(found.time, 400.0), rtol=0, atol=1e-7)
    assert found.units == {"displacement_centre": "m"}
    peak = found.summary["peak"]["displacement_centre"]
    assert peak["value"] == found.channels["displacement_centre"].max()


def test_a_force_is_read_from_columns_and_passes_its_instrument(tmp_path: Path) -> None:
    path = written(tmp_path)
    more = f'\n[external.sensors.contact_force]\n{FORCE}\n[sensors.contact_force]\nkind = "contact_force"\n'
    more += "[instrument.contact_force]\ngain = 2.0\n"
    path.write_text(path.read_text(encoding="utf-8") + more, encoding="utf-8")
    found = simulate_external(load_case(path)).channels
    spring = 2.0 * 20e6 * found["displacement_centre"]  # a force is a mean over 20 us of a period of 1.9 ms
    np.testing.assert_allclose(found["contact_force"][1:-1], spring[1:-1], rtol=0, atol=1e-3 * spring.max())


def failing(folder: Path, behaviour: str) -> str:
    """The reason for which a strike fails."""
    with pytest.raises(RunFailed) as caught:
        simulate_external(oscillator(folder, behaviour=behaviour))
    return str(caught.value)


def test_a_failing_run_says_what_the_solver_said(tmp_path: Path) -> None:
    assert "ended with exit code 1: *** Error 20001: negative volume" in failing(tmp_path / "a", "crash")
    assert "crashed (SIGSEGV)" in failing(tmp_path / "d", "fault")  # the run's own: the next call does not repeat it
    early = failing(tmp_path / "b", "early")
    assert "nodout ends at 1 ms, before time.end = 2 ms" in early
    assert "is time_unit another one?" in early
    assert 'has not written "N o r m a l' in failing(tmp_path / "c", "silent")


def changed(folder: Path, old: str, new: str, **options: str) -> Case:
    """The oscillator's case with a text in its file replaced."""
    path = written(folder, **options)
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    return load_case(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("node = 4711", "node = 12", "nodout has no node 12; it has 7, 4711"),
        ('"z-disp"', '"w-disp"', 'nodout has no column "w-disp"'),
        ('file = "nodout"', 'file = "nodfor"', "has written no nodfor"),
    ],
)
def test_output_that_cannot_be_read_is_a_failure_that_names_it(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    with pytest.raises(RunFailed, match=message):
        simulate_external(changed(tmp_path, old, new))


def test_nodout_as_fortran_writes_it(tmp_path: Path) -> None:
    blocks = "".join(
        f"\n n o d a l   p r i n t   o u t   f o r   t i m e  s t e p {i}   ( at time {t} )\n\n"
        " nodal point  x-disp     y-disp      z-disp\n"
        f"      4711 1.00000E-03-2.00000E+00{z}\n\n nodal point  x-rot      y-rot       z-rot\n"
        "      4711 9.00000E+00 9.00000E+00 9.00000E+00\n"
        for i, (t, z) in enumerate([("0.0000000E+00", " 0.00000E+00"), ("2.00000D+00", "-1.50000-103")])
    )
    program = tmp_path / "writes.py"
    program.write_text(f"open('nodout', 'w').write({blocks!r})\nprint('N o r m a l    t e r m i n a t i o n')\n")
    case = changed(tmp_path, str(PROGRAM), str(program)).overlaid({"time": {"output_interval": "1 ms"}})
    np.testing.assert_allclose(simulate_external(case).channels["displacement_centre"][-1], 1.5e-106, rtol=1e-9)


def test_a_run_beyond_its_time_is_ended_with_all_that_it_started(tmp_path: Path) -> None:
    case = changed(tmp_path, 'time_limit = "30 s"', 'time_limit = "1 s"\nscratch = "."', behaviour="hang")
    kept = case.external.model_copy(update={"keep": "failed", "scratch": str(tmp_path)})  # type: ignore[union-attr]
    with pytest.raises(RunFailed, match=r"was stopped at external.time_limit = 1 s; its folder is kept"):
        simulate_external(case.model_copy(update={"external": kept}))
    (note,) = tmp_path.glob("run-*/strike.pids")
    until(lambda: all(gone(int(pid)) for pid in note.read_text().split()), 5.0)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for left-over processes in /proc")
def test_a_killed_worker_takes_the_solver_with_it(tmp_path: Path) -> None:
    case = written(tmp_path, behaviour="hang")
    imports = "from birdstrike.doe.external.external import simulate_external; from birdstrike import load_case"
    code = f"{imports}; simulate_external(load_case({str(case)!r}))"
    environment = os.environ | {"TMPDIR": str(tmp_path)}
    worker = subprocess.Popen([sys.executable, "-c", code], cwd=PROGRAM.parents[2], env=environment)
    until(lambda: any(tmp_path.glob("run-*/strike.pids")))
    (note,) = tmp_path.glob("run-*/strike.pids")
    started = note.read_text().split()
    worker.send_signal(signal.SIGKILL)
    worker.wait()
    until(lambda: all(gone(int(pid)) for pid in started), 5.0)
    until(lambda: not note.parent.exists(), 5.0)


def test_a_program_that_is_not_there_is_the_user_s_error_and_no_failed_run(tmp_path: Path) -> None:
    case = changed(tmp_path / "case", sys.executable, "/no/such/solver")
    with pytest.raises(FileNotFoundError, match=r"external\.command names no program"):
        campaign(case, tmp_path / "out")
    assert RunStore(tmp_path / "out" / "runs").failed_keys() == []


def test_a_long_log_is_searched_where_it_lies(tmp_path: Path) -> None:
    program, megabytes = tmp_path / "writes.py", 32
    program.write_text(f"print('No normal end')\nfor _ in range({megabytes}): print('x' * 1000000)\nprint('the end')\n")
    case = changed(tmp_path, str(PROGRAM), str(program))
    tracemalloc.start()
    try:
        with pytest.raises(RunFailed, match=r'has not written "N o r m a l .*/ the end'):
            simulate_external(case)
        assert tracemalloc.get_traced_memory()[1] < 8e6
        found = case.external.model_copy(update={"success": "No normal end"})  # type: ignore[union-attr]
        with pytest.raises(RunFailed, match="has written no nodout"):
            simulate_external(case.model_copy(update={"external": found}))
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("scratch", ["missing", "file"])
def test_a_scratch_folder_that_is_none_is_named_and_ends_a_campaign(tmp_path: Path, scratch: str) -> None:
    (tmp_path / "file").touch(mode=0o755)
    path = written(tmp_path)
    path.write_text(path.read_text().replace("[external]\n", f"[external]\nscratch = '{tmp_path / scratch}'\n"))
    case = load_case(path)
    with pytest.raises(FileNotFoundError, match=r"external\.scratch is no folder .*make it, or leave the key out"):
        simulate_external(case)
    with pytest.raises(FileNotFoundError, match=r"external\.scratch"):
        campaign(case, tmp_path / "out")


def campaign(case: Case, out: Path, runs: int = 4) -> None:
    """A campaign of the external solver on threads of this process: each runs a process of its own."""
    planned = make_design("lhs", ParameterSpace.of(case.parameters()), runs)
    with ThreadPoolExecutor(2) as executor:
        run_campaign(case, planned, out, workers=2, executor=executor, say=lambda _: None)


def test_a_campaign_moves_with_its_deck_and_serves_an_inversion(tmp_path: Path) -> None:
    case = oscillator(tmp_path / "case")
    campaign(case, tmp_path / "out")
    shutil.move(tmp_path / "out", tmp_path / "moved")
    shutil.rmtree(tmp_path / "case")
    copy = load_case(tmp_path / "moved" / "case.toml")
    assert case_hash(copy) == case_hash(load_case(tmp_path / "moved" / "case.toml"))
    store = RunStore(tmp_path / "moved" / "runs")
    before = store.keys()
    campaign(copy, tmp_path / "moved")
    assert store.keys() == before  # nothing was paid for twice
    forward = StoredSolver(copy, store)
    record = exact(np.arange(101) * 20e-6, 700.0)

    def overshoot(viscosity: float) -> float:
        return float(np.sum(forward({"bird.material.viscosity": viscosity}).channels["displacement_centre"] - record))

    assert brentq(overshoot, 300.0, 1200.0, xtol=0.5) == pytest.approx(700.0, abs=2.0)


def test_network_and_emulator_learn_the_other_solver_and_find_what_was_planted(tmp_path: Path) -> None:
    campaign(oscillator(tmp_path / "case"), tmp_path / "doe", 12)
    instants, sigma = np.linspace(0.05e-3, 1.9e-3, 60), 1e-5
    noise = sigma * np.random.default_rng(0).standard_normal(60)
    record = Measured(
        instants,
        {"displacement_centre": exact(instants, 700.0, 100.0) + noise},
        {"displacement_centre": np.full(60, sigma)},
        {"displacement_centre": "m"},
        ("SIMULATED",),
    )
    answers = train_and_invert(tmp_path / "doe", record, tmp_path / "inversion", extras=LINEARISED).methods
    found = answers["emulator"].parameters
    for name, planted in (("bird.material.viscosity", 700.0), ("impact.speed", 100.0)):
        low, high = found[name].interval_95 or (np.nan, np.nan)
        assert low < planted < high
        assert found[name].value == pytest.approx(planted, rel=0.02)
    assert (answers["emulator"].verified_rmse or np.inf) < 3.0 * sigma
    assert (answers["network"].verified_relative or np.inf) < 0.1


def test_a_run_without_a_second_attempt_has_not_failed_twice(tmp_path: Path) -> None:
    """Half of the runs crash; the deck holds no step_factor."""
    case = oscillator(tmp_path / "case", behaviour="{% if viscosity > 800 %}crash{% else %}nothing{% endif %}")
    planned, said = make_design("lhs", ParameterSpace.of(case.parameters()), 4), list[str]()
    with ThreadPoolExecutor(2) as executor:
        run_campaign(case, planned, tmp_path / "out", workers=2, executor=executor, say=said.append)
    failed = [line for line in said if "negative volume" in line]
    assert failed
    assert all(" failed and is left out: " in line for line in failed)


def test_a_run_whose_output_stands_in_other_units_is_named(tmp_path: Path) -> None:
    """The impulse in kg m/s in place of kN ms is 1000 times as large, in the runs above 1200 Pa s."""
    scale = "{% if viscosity > 1200 %}{% set scale = 1000 %}{% else %}{% set scale = 1 %}{% endif %}"
    deck = scale + DECK.replace("(1.8 * velocity_normal)", "(1.8 * scale * velocity_normal)")
    planned, said = make_design("lhs", ParameterSpace.of(oscillator(tmp_path / "case").parameters()), 6), list[str]()
    with ThreadPoolExecutor(2) as executor:
        case = oscillator(tmp_path / "case", deck=deck)
        run_campaign(case, planned, tmp_path / "out", workers=2, executor=executor, say=said.append)
    column = planned.names.index("bird.material.viscosity")
    wrong = planned.numbers[planned.values[:, column] > 1200.0]
    assert [line.split(":")[0] for line in said if "other units?" in line] == [f"run {number}" for number in wrong]
    assert len(wrong)


def test_another_deck_is_another_campaign(tmp_path: Path) -> None:
    campaign(oscillator(tmp_path / "case"), tmp_path / "out")
    time.sleep(0.01)
    other = oscillator(tmp_path / "case", deck=DECK.replace("{{ 20 | card }}", "{{ 21 | card }}"))
    with pytest.raises(UserError, match=r"external.inputs.strike.k.j2 is"):
        campaign(other, tmp_path / "out")


@pytest.mark.parametrize(
    ("old", "new", "messages"),
    [
        ('template = "strike.k.j2"', 'template = "strke.k.j2"', ["external.template = strke.k.j2 is no file"]),
        (UNITS, 'unit = "kN"', ['external.sensors.displacement_centre.unit = "kN" does not fit a sensor of kind']),
        (
            "external.sensors.displacement_centre",
            "external.sensors.other",
            ["displacement_centre is missing"],
        ),
        ('format = "nodout"', 'format = "noduot"', ['did you mean "nodout"']),
        ("node = 4711", "", ["external.sensors.displacement_centre.node is missing"]),
        ('time_limit = "30 s"', "time_limit = 30", ["external.time_limit = 30 has no unit"]),
        ('version = "oscillator 1"', "", ["external.version is missing"]),
        ('template = "strike.k.j2"', "template = 1", ["external.template = 1 must be a text such as"]),
        ('template = "strike.k.j2"', 'template = "strike.k.j2"\nfiles = 3', ["external.files = 3 must be a list"]),
        ('template = "strike.k.j2"', 'template = "strike.k.j2"\nfiles = [3]', ["external.files.0 = 3 must be a text"]),
        ('template = "strike.k.j2"', f'template = "{300 * "x"}"', ["(320 characters) is no file in"]),
        ('file = "nodout"', f'file = "{300 * "x"}"', ["is longer than any file's name: 300 bytes, at most 255"]),
        (
            'template = "strike.k.j2"',
            'template = "strike.k.j2"\nfiles = ["nodout"]',
            ['external.sensors.displacement_centre.file = "nodout" is among external.files: where the solver writes'],
        ),
        ('file = "nodout"', 'file = "/tmp/nodout"', ["file = /tmp/nodout leaves the folder of the run"]),
        ('file = "nodout"', 'file = "out/../../nodout"', ["file = out/../../nodout leaves the folder of the run"]),
        ("factor = -1", "factor = 0", ["displacement_centre.factor = 0 would make every reading 0; write 1, or -1"]),
    ],
)
def test_what_is_wrong_in_the_section_is_named(tmp_path: Path, old: str, new: str, messages: list[str]) -> None:
    (tmp_path / "nodout").touch()
    with pytest.raises(CaseError) as caught:
        changed(tmp_path, old, new)
    for message in messages:
        assert message in str(caught.value)


def test_an_embedded_solver_needs_no_section_and_keeps_its_hash() -> None:
    case = load_case("reference_strike")
    assert case.solver.name == "embedded"
    assert "name" not in case.canonical()["solver"]
    assert "external" not in case.canonical()
    with pytest.raises(CaseError, match=r'solver = "external" needs a section \[external\]'):
        load_case("reference_strike", {"solver": "external"})


def test_the_solver_s_version_stands_in_every_key(tmp_path: Path) -> None:
    first = external_solver(oscillator(tmp_path / "a"))
    second = external_solver(changed(tmp_path / "b", "oscillator 1", "oscillator 2"))
    assert (first.version, second.version) == ("external: oscillator 1", "external: oscillator 2")


@pytest.mark.parametrize(("code", "failure"), [(150, RunFailed), (143, MachineFailure), (137, MachineFailure)])
def test_only_signals_that_come_from_outside_are_the_machine_s(
    tmp_path: Path, code: int, failure: type[RunFailed | MachineFailure]
) -> None:
    """150 is an exit code like any other; 143 and 137 are what a shell makes of SIGTERM and SIGKILL."""
    program = tmp_path / "ends.py"
    program.write_text(f"raise SystemExit({code})\n")
    with pytest.raises(failure) as caught:
        simulate_external(changed(tmp_path, str(PROGRAM), str(program)))
    assert type(caught.value) is failure
