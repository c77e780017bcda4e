"""Somebody else's solver: its deck filled in, its command run in a folder of its own, its sensors read back."""

from __future__ import annotations

import errno
import mmap
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from birdstrike.data.errors import CaseError, MachineFailure, RunFailed
from birdstrike.data.histories import Array, Histories
from birdstrike.data.progress import Progress, silent
from birdstrike.doe.attempt import STEP_FACTORS, Solver
from birdstrike.doe.external import guard
from birdstrike.doe.external.deck import unsupported_by_deck
from birdstrike.doe.external.output import read_sensor
from birdstrike.doe.external.template import rendered
from birdstrike.solver.case.case import Case, case_hash
from birdstrike.solver.case.external import External
from birdstrike.solver.sensors.instrument import recorded

LOG = "solver.log"
TAIL = 300
"""Characters of the log's end that stand in a failure's reason."""
END = 65_536  # bytes, in which they are looked for
ROUNDING = 0.01
"""Of the output interval, by which a written time may differ from the meant one."""
LONGEST_GAP = 5
"""Output intervals between two instants of a file, beyond which the curve between them is not known."""
NO_PROGRAM = (
    "external.command names no program that can be run on this machine; correct the name, give its whole path, or "
    "install it"
)
MACHINE_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.ENOMEM)
"""What the system tells a program when the disk or the memory is full: that is no failure of the run."""
FROM_OUTSIDE = ("SIGHUP", "SIGINT", "SIGKILL", "SIGTERM", "SIGXCPU", "SIGXFSZ", "SIGUSR1", "SIGUSR2")
"""Signals by which people, queues and limits end a program; another number above 128 is the program's own exit code."""
CRASHES = (signal.SIGSEGV, signal.SIGFPE, signal.SIGILL, signal.SIGABRT)
"""Signals of a fault inside the program, which the same deck raises again."""


def _placeholder(name: str, unit: str) -> str:
    """What stands for a quantity in a template."""
    return f'{{{{ {name} | to("{unit}") }}}}' if unit else f"{{{{ {name} }}}}"


def external_solver(case: Case) -> Solver:
    """The case's external solver; raises CaseError where the template cannot be filled or leaves out what is asked.

    A run gets its second attempt only where the template holds `step_factor`: nothing else would be safer.
    """
    assert case.external is not None
    deck = rendered(case)
    template = Path(case.external.template).name
    errors = [
        f"inversion.parameters.{p.name}: no placeholder of {template} changes with it; "
        f"write {_placeholder(p.name, p.unit)} where it belongs, or leave the parameter out"
        for p in case.parameters()
        if rendered(case.with_values({p.name: p.low})) == rendered(case.with_values({p.name: p.high}))
    ]
    errors += [f"effects.{name}: {reason}" for name in case.effects if (reason := unsupported_by_deck(case, name))]
    if errors:
        raise CaseError(errors, f"case {case.name} does not fit its template")
    safer = rendered(case, STEP_FACTORS[-1]) != deck
    return Solver(simulate_external, f"external: {case.external.version}", STEP_FACTORS if safer else STEP_FACTORS[:1])


def simulate_external(
    case: Case,
    *,
    step_factor: float = 1.0,
    threads: int | None = None,
    progress: Progress = silent,
) -> Histories:
    """Run the external command over the filled template and return the sensors' histories on the case's clock.

    threads: for the command's `{threads}`. Raises RunFailed (exit code, time limit, output that is missing, unreadable
    or ends early), MachineFailure (killed from outside, disk or memory full) and FileNotFoundError when there is no
    such command or no such `scratch` folder.
    """
    external, started = case.external, time.perf_counter()
    assert external is not None
    folder = _folder(external)
    stays = external.keep == "all"
    try:
        deck = _lay_out(folder, external, rendered(case, step_factor))
        _run(folder, external, _words(external, deck, threads))
        clock, channels = _read(folder, case, external)
    except (RunFailed, MachineFailure) as failure:
        stays = external.keep != "none"
        where = f"; its folder is kept: {folder}" if stays else ""
        raise type(failure)(f"{failure.reason}{where}") from failure
    finally:
        if not stays:
            shutil.rmtree(folder, ignore_errors=True)
    progress(1.0)
    return _histories(case, external, clock, channels, time.perf_counter() - started)


def unusable_scratch(external: External) -> bool:
    """Whether `scratch` is given and is no folder that can be written on this machine."""
    place = external.scratch
    return place is not None and not (Path(place).is_dir() and os.access(place, os.W_OK | os.X_OK))


def _folder(external: External) -> Path:
    """A new folder for a run."""
    if unusable_scratch(external):
        reason = "external.scratch is no folder that can be written here; make it, or leave the key out"
        raise FileNotFoundError(errno.ENOENT, reason, external.scratch)
    return Path(tempfile.mkdtemp(prefix="run-", dir=external.scratch))


def _lay_out(folder: Path, external: External, deck: str) -> str:
    """Put deck and files into the folder; the deck's name."""
    name = Path(external.template).name.removesuffix(".j2")
    (folder / name).write_text(deck, encoding="utf-8")
    for file in external.files:
        shutil.copy(file, folder)
    return name


def program_of(external: External) -> str | None:
    """Path of the program that the command names; None where none of that name can be run on this machine."""
    found = shutil.which(external.command[0])
    return None if found is None else str(Path(found).absolute())


def _words(external: External, deck: str, threads: int | None) -> list[str]:
    program, words = program_of(external), external.command[1:]
    if program is None:
        raise FileNotFoundError(errno.ENOENT, NO_PROGRAM, external.command[0])
    cores = str(threads or os.cpu_count() or 1)
    return [program, *(word.replace("{input}", deck).replace("{threads}", cores) for word in words)]


def _run(folder: Path, external: External, command: list[str]) -> None:
    """Run the command to its end; raises RunFailed. It ends with us: the guard sees its standard input closed."""
    unkept = "" if external.keep == "all" else str(folder)
    guarded = [sys.executable, "-I", "-S", str(Path(guard.__file__)), repr(external.time_limit), unkept, *command]
    begun = time.perf_counter()
    with (folder / LOG).open("wb") as log:
        process = subprocess.Popen(guarded, cwd=folder, stdin=subprocess.PIPE, stdout=log, stderr=log)
        try:
            code = process.wait()
        finally:
            assert process.stdin is not None
            process.stdin.close()
            process.wait()
    log_file, end = folder / LOG, _end_of(folder / LOG)
    name, tail = Path(command[0]).name, f": {' / '.join(end.splitlines()[-3:])}" if end else ""
    if code == guard.TIME_IS_UP and time.perf_counter() - begun >= external.time_limit:
        raise RunFailed(f"{name} was stopped at external.time_limit = {external.time_limit:g} s{tail}")
    if code != 0:
        _raise_machine_failure(name, code, log_file)
        raise RunFailed(f"{name} {_ended(code)}{tail}")
    if external.success is not None and not _holds(log_file, external.success):
        raise RunFailed(f'{name} has not written "{external.success}"{tail}')


def _end_of(log_file: Path) -> str:
    """Last characters of a log, at most TAIL, blanks at its end left out; a solver may write gigabytes."""
    with log_file.open("rb") as file:
        file.seek(max(log_file.stat().st_size - END, 0))
        return file.read().decode(errors="replace").strip()[-TAIL:]


def _holds(log_file: Path, text: str) -> bool:
    """Whether a log has a text anywhere; it is not read into memory."""
    if not log_file.stat().st_size:
        return False
    with log_file.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        return content.find(text.encode()) >= 0


def _raise_machine_failure(name: str, code: int, log_file: Path) -> None:
    """Raise MachineFailure where the log names a full disk or memory, or the exit code a signal from outside."""
    for error in MACHINE_ERRORS:
        if _holds(log_file, os.strerror(error)):
            raise MachineFailure(f"{name} stopped: {os.strerror(error)}", "free some and run the same command again")
    killed = guard.signal_of(code)
    if killed in [getattr(signal, word, None) for word in FROM_OUTSIDE]:
        raise MachineFailure(f"{name} was killed by signal {killed}")


def _ended(code: int) -> str:
    """How a program that failed has ended: "crashed (SIGSEGV)", "ended with exit code 3"."""
    crash = next((one for one in CRASHES if one == guard.signal_of(code)), None)
    return f"crashed ({crash.name})" if crash else f"ended with exit code {code}"


def _read(folder: Path, case: Case, external: External) -> tuple[Array, dict[str, Array]]:
    """The case's clock and every sensor on it, as its instrument gives it."""
    interval, end = case.time.output_interval, case.time.end
    clock = np.array(case.time.instants)
    channels = {}
    for name, sensor in case.sensors.items():
        time_read, values = read_sensor(folder, external.sensors[name])
        _refuse_unknown_stretch(external.sensors[name].file, time_read, interval, end)
        channels[name] = sensor.sampled(clock, time_read, recorded(case.instrument.get(name), time_read, values))
    return clock, channels


def _refuse_unknown_stretch(file: str, time: Array, interval: float, end: float) -> None:
    """Raise RunFailed where a curve begins late, ends early or has a gap: there the clock would have no reading."""
    slack, told = (1.0 + ROUNDING) * interval, f"time.output_interval = {1e6 * interval:.4g} us"
    if time[0] > slack:
        raise RunFailed(
            f"{file} begins at {1e3 * time[0]:.4g} ms, more than {told} after 0: let the solver write from its start, "
            "its time 0 being the case's"
        )
    if time[-1] < end - slack:
        raise RunFailed(
            f"{file} ends at {1e3 * time[-1]:.4g} ms, before time.end = {1e3 * end:.4g} ms by more than {told}: did "
            "the solver stop early, or is time_unit another one?"
        )
    longest = int(np.argmax(np.diff(time)))
    if time[longest + 1] - time[longest] > LONGEST_GAP * slack:
        raise RunFailed(
            f"{file} has no reading between {1e3 * time[longest]:.4g} and {1e3 * time[longest + 1]:.4g} ms, more than "
            f"{LONGEST_GAP} times {told}: let the solver write more often, correct time_unit, or raise "
            "time.output_interval"
        )


def _histories(case: Case, external: External, clock: Array, channels: dict[str, Array], wall: float) -> Histories:
    from birdstrike.solver.simulate import peak  # late: it brings in the embedded solver's compiled kernels

    summary = {
        "schema_version": 1,
        "solver_version": f"external: {external.version}",
        "case_hash": case_hash(case),
        "command": list(external.command),
        "peak": {name: peak(clock, values) for name, values in channels.items()},
        "wall_s": wall,
    }
    units = {name: sensor.unit for name, sensor in case.sensors.items()}
    return Histories(clock, channels, units, summary)
