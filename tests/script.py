"""A user's script, run as one: in a process of its own, from a file that its workers read too."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = str(Path(__file__).parents[1])


def run_script(folder: Path, text: str, timeout: float) -> str:
    """What the script prints; it is written into the folder, and must end well within the timeout [s]."""
    path = folder / "script.py"
    path.write_text(text)
    run = subprocess.run(
        [sys.executable, str(path)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": ROOT},
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    return run.stdout.strip()
