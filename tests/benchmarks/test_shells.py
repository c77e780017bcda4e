"""Shells alone against those of the commit whose numbers were verified: CPU time in pairs, in turn (`make bench`)."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.bit_comparison import BASE_COMMIT, TREE, BaseTree

WORKER = Path(__file__).with_name("shells_alone.py")
PAIRS = 5


class Worker:
    """A process that steps the shells of one tree, on one thread."""

    def __init__(self, tree: Path) -> None:
        environment = os.environ | {"PYTHONPATH": str(tree), "NUMBA_NUM_THREADS": "1"}
        self.process = subprocess.Popen(
            [sys.executable, "-P", str(WORKER)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
            cwd=tree.parent,
        )
        assert self.answer() == "ready"

    def answer(self) -> str:
        assert self.process.stdout is not None
        return self.process.stdout.readline().strip()

    def run(self, kind: str) -> tuple[float, float, str]:
        assert self.process.stdin is not None
        self.process.stdin.write(kind + "\n")
        self.process.stdin.flush()
        return tuple(json.loads(self.answer()))

    def close(self) -> None:
        self.process.communicate()


@pytest.mark.parametrize("kind", ["elastic", "yielding"])
def test_shells_alone_against_the_base(kind, capsys):
    given = os.environ.get("BIRDSTRIKE_BENCH_BASE")  # an existing worktree of the commit, else one is made
    with BaseTree(Path(given) if given else None) as base:
        workers = [Worker(base), Worker(TREE)]
        rounds = [[worker.run(kind) for worker in (workers if i % 2 else workers[::-1])] for i in range(PAIRS)]
        for worker in workers:
            worker.close()
    pairs = [pair if i % 2 else pair[::-1] for i, pair in enumerate(rounds)]
    before, after = (1e6 * np.array([pair[which][0] for pair in pairs]) for which in (0, 1))
    same = all(pair[0][2] == pair[1][2] for pair in pairs)
    with capsys.disabled():
        print(  # noqa: T201
            f"\n  shells alone, {kind} ({pairs[0][1][1]:.0%} of the layers yield in a step): "
            f"{np.median(after):.2f} us a shell-step, {np.median(after / before):.2f} of {BASE_COMMIT}'s "
            f"({min(after / before):.2f} to {max(after / before):.2f}); {'same' if same else 'OTHER'} bits",
            flush=True,
        )
    assert same
