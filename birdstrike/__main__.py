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
    try:
        run()
    except KeyboardInterrupt:
        _leave()


def _leave(_signal: int = 0, _frame: FrameType | None = None) -> None:
    """End in one line, at once: nothing has been begun, and half-loaded modules have nothing to put in order."""
    sys.stderr.write("interrupted\n")
    sys.stderr.flush()
    os._exit(INTERRUPTED)


if __name__ == "__main__":
    main()
