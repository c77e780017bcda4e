"""How kernels are compiled and run: vectors of full width, threads that wait briefly, and no stale compiled code.

numba looks at the file of a kernel alone. A constant or an inlined function of another file, such as a place in a row
of constants, is compiled in; after a change of that file the cached kernel would go on with the old one, and no error
would say so.
"""

from __future__ import annotations

import os
from pathlib import Path

import llvmlite.binding
from numba.core import config

from birdstrike.solver.sources import digest_files

FEATURES = "CPU_FEATURES"  # numba makes its settings at run time, where type checkers do not see them
SPINS = "10000"  # 3000 to 30 000 were measured to be as good; libgomp's default is 300 000
HERE = Path(__file__).parent
FOLDERS = ("kernels", "bird/eos")  # all that numba compiles
MARK = "kernels/__pycache__/sources.digest"


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


def forget_stale_kernels(root: Path = HERE) -> None:
    """Remove the compiled kernels below `root` that were compiled from other sources than those that stand there.

    Where nothing may be written, nothing is: there numba keeps its cache elsewhere, by the path and date of each file.
    """
    sources = digest_files(root, (path for folder in FOLDERS for path in (root / folder).rglob("*.py")))
    mark = root / MARK
    try:
        if mark.is_file() and mark.read_text(encoding="utf-8") == sources:
            return
        for folder in FOLDERS:
            for compiled in (root / folder).rglob("*.nb[ic]"):
                compiled.unlink(missing_ok=True)
        mark.parent.mkdir(exist_ok=True)
        mark.write_text(sources, encoding="utf-8")
    except OSError:
        return
