"""The processor that kernels are compiled for: with vectors of full width."""

from __future__ import annotations

import llvmlite.binding
from numba.core import config

FEATURES = "CPU_FEATURES"  # numba makes its settings at run time, where type checkers do not see them


def use_full_vectors() -> None:
    """Let LLVM use 512-bit vectors where the processor has them; it would hold itself to half of that.

    The pair loops live on vector width: they run 1.25 times faster (measured on a Sapphire Rapids core). A
    NUMBA_CPU_FEATURES of the user's own is left alone.
    """
    features = llvmlite.binding.get_host_cpu_features()
    if getattr(config, FEATURES) is None and features.get("avx512f"):
        setattr(config, FEATURES, f"{features.flatten()},-prefer-256-bit")
