"""The page in a real browser, offline: no console message, nothing asked of the network, every figure has its size."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import matplotlib.image as images
import numpy as np
import pytest

BROWSER = next(
    (found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), ""
)
OPTIONS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync --hide-scrollbars --enable-logging=stderr --v=0 --window-size=1200,6000"
)

pytestmark = pytest.mark.skipif(not BROWSER, reason="no chromium or google-chrome on the PATH")


def visit(page: Path, folder: Path) -> tuple[list[str], Path]:
    """Console lines and the screenshot of a page."""
    shot = folder / "shot.png"
    command = [
        BROWSER,
        *OPTIONS.split(),
        f"--user-data-dir={folder / 'profile'}",
        f"--screenshot={shot}",
        page.as_uri(),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    return [line for line in done.stderr.splitlines() if "CONSOLE" in line], shot


def test_the_console_is_heard(tmp_path: Path) -> None:
    broken = tmp_path / "broken.html"
    broken.write_text("<!doctype html><script>undefinedName()</script>")
    console, _ = visit(broken, tmp_path)
    assert re.search("undefinedName is not defined", "\n".join(console))


def test_the_page_opens_without_a_console_message(page: Path, tmp_path: Path) -> None:
    console, shot = visit(page, tmp_path)
    assert console == []
    pixels = images.imread(shot)[..., :3]
    ink = np.any(pixels < 0.9, axis=-1)
    assert pixels.shape[:2] == (6000, 1200)
    screens = ink.reshape(6, 1000, 1200).mean(axis=(1, 2))
    assert np.all(screens > 0.005), f"an empty stretch of page: {screens}"
