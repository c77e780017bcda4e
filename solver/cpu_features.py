"""The processor that kernels are compiled for and run on: vectors of full width, and threads that wait briefly."""

from __future__ import annotations

import os

import llvmlite.binding
from numba.core import config

FEATURES = "CPU_FEATURES"  # numba makes its settings at run time, where type checkers do not see them
SPINS = "10000"  # 3000 to 30 000 were measured to be as good; libgomp's default is 300 000


def use_full_vectors() -> None:
    """Let LLVM use 512-bit vectors where the processor has them; it would hold itself to half of that.

    The pair loops live on vector width: they run 1.25 times faster (measured on a Sapphire Rapids core). A
    NUMBA_CPU_FEATURES of the user's own is left alone.
    """
    features = llvmlite.binding.get_host_cpu_features()
    if getattr(config, FEATURES) is None and features.get("avx512f"):
        setattr(config, FEATURES, f"{features.flatten()},-prefer-256-bit")


def wait_briefly() -> None:
    """Let OpenMP threads that wait spin for some 0.2 ms, then sleep, unless the user has said otherwise.

    A simulation has a dozen short parallel loops a step. Threads that sleep at once take longer to wake than such a
    loop lasts: two gained nothing on the reference strike, and 1.2 to 1.7 x so. Threads that spin for ever take the
    cores from every other process: with one of them on two cores, 15 times as long. Read when OpenMP loads, hence here.
    """
    if "OMP_WAIT_POLICY" not in os.environ:
        os.environ.setdefault("GOMP_SPINCOUNT", SPINS)
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")
