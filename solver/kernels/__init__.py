"""Numba kernels: functions on arrays and scalars, outputs last, written in place.

The pair loops live on vector width. LLVM holds AVX-512 machines to half of theirs; asked for the whole, the pair
kernels run 1.25 times faster (measured on a Sapphire Rapids core). A NUMBA_CPU_FEATURES of the user's own is left alone.
"""

from __future__ import annotations

import numba
from numba.core.codegen import ll as llvm

if numba.config.CPU_FEATURES is None:  # pyright: ignore[reportAttributeAccessIssue]
    features = llvm.get_host_cpu_features()
    if features.get("avx512f"):
        numba.config.CPU_FEATURES = f"{features.flatten()},-prefer-256-bit"  # pyright: ignore[reportAttributeAccessIssue]
