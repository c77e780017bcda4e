"""Runs a command and ends it, children included, when time is up or whoever started it has gone.

Arguments: SECONDS, the FOLDER to remove where whoever started it has gone before the end ("" for none), COMMAND...
A program of its own, without imports of ours: it outlives a worker that is killed just long enough to end the solver.
Its standard input is the lifeline. Exit code: the command's own, TIME_IS_UP, or NOT_FOUND.
"""

import contextlib
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import threading
import time

TIME_IS_UP, NOT_FOUND = 124, 127


def end(process: "subprocess.Popen[bytes]") -> None:
    """Kill the command and all that it has started."""
    if hasattr(os, "killpg"):
        with contextlib.suppress(OSError):  # all of them have ended
            os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()


def end_with_the_lifeline(process: "subprocess.Popen[bytes]", abandoned: threading.Event) -> None:
    """Wait for the end of standard input, which comes with the end of who holds its other end."""
    sys.stdin.buffer.read()
    abandoned.set()
    end(process)


def remove(folder: str) -> None:
    """Remove a folder into which processes that are being killed may still write."""
    place = pathlib.Path(folder)
    os.chdir(place.parent)
    for _ in range(20):
        shutil.rmtree(folder, ignore_errors=True)
        if not place.exists():
            break
        time.sleep(0.1)


def signal_of(code: int) -> int:
    """The signal that ended a command with this exit code (128 + signal, or -signal as Python has it); 0 for none."""
    found = -code if code < 0 else code - 128
    return found if 0 < found < 65 else 0


def main(limit: float, folder: str, command: "list[str]") -> int:
    """Run the command for at most `limit` seconds."""
    abandoned = threading.Event()
    try:
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, start_new_session=True)
    except OSError as error:
        print(f"{command[0]}: {error.strerror}", flush=True)  # noqa: T201 (the command's own log)
        return NOT_FOUND
    threading.Thread(target=end_with_the_lifeline, args=(process, abandoned), daemon=True).start()
    try:
        return process.wait(limit)
    except subprocess.TimeoutExpired:
        return TIME_IS_UP
    finally:
        end(process)
        if folder and abandoned.is_set():
            remove(folder)


if __name__ == "__main__":
    code = main(float(sys.argv[1]), sys.argv[2], sys.argv[3:])
    sys.stdout.flush()
    os._exit(code & 0xFF if code >= 0 else 128 - code)
