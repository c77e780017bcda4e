"""The bar of a campaign: runs done, running and failed, and the time left."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from birdstrike.cli.frame import PLAIN_EVERY_S, errors

if TYPE_CHECKING:
    from birdstrike.doe.campaign.runner import RunCounts


@contextmanager
def campaign_bar() -> Iterator[Callable[[RunCounts], None]]:
    """A bar that takes a campaign's RunCounts; off a terminal, one plain line now and then."""
    counts = TextColumn("{task.fields[running]} running, {task.fields[failed]} failed")
    bar = Bar("runs", BarColumn(), MofNCompleteColumn(), counts, TimeRemainingColumn(), console=errors, transient=True)
    task = bar.add_task("runs", total=None, start=False, running=0, failed=0)
    spoken = time.monotonic()

    def show(state: RunCounts) -> None:
        nonlocal spoken
        over = state.finished + state.failed
        if not bar.tasks[0].started:  # what the store held already says nothing about the time left
            bar.update(task, total=state.total, completed=over)
            bar.start_task(task)
        bar.update(task, completed=over, running=state.running, failed=state.failed)
        if errors.is_terminal:
            if state.running and not bar.live.is_started:
                bar.start()
        elif time.monotonic() - spoken > PLAIN_EVERY_S:
            spoken = time.monotonic()
            errors.print(f"runs: {over} of {state.total} done, {state.running} running, {state.failed} failed")

    try:
        yield show
    finally:
        bar.stop()
