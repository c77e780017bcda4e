"""The console script, and `python -m birdstrike`: loads the commands, in which Ctrl-C ends without a traceback too."""

from __future__ import annotations

import os
import signal
import sys
from contextlib import suppress
from types import FrameType

INTERRUPTED = 130


def main() -> None:
    """Entry point of the console script."""
    with suppress(ValueError):  # a thread cannot take signals, and needs not to
        signal.signal(signal.SIGINT, _leave)
    from birdstrike.cli.app import main as run  # late: loading takes time, in which Ctrl-C may come

    with suppress(ValueError):
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.signal(signal.SIGTERM, _terminate)
    try:
        run()
    except KeyboardInterrupt:
        _leave()


def _terminate(_signal: int, _frame: FrameType | None) -> None:
    """Raise what ends a command as Ctrl-C does: at once, its workers and their semaphores would be left behind."""
    from birdstrike.data.errors import Terminated

    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # `timeout` sends it to the process and to its group
    raise Terminated


def _leave(_signal: int = 0, _frame: FrameType | None = None) -> None:
    """End in one line, at once: nothing has been begun, and half-loaded modules have nothing to put in order."""
    sys.stderr.write("interrupted\n")
    sys.stderr.flush()
    os._exit(INTERRUPTED)


if __name__ == "__main__":
    main()
