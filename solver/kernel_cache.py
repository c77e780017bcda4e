"""Kernels compiled from other sources are forgotten: numba looks at the file of a kernel alone.

A constant or an inlined function of another file, such as a place in a row of constants, is compiled in; after a change
of that file the cached kernel would go on with the old one, and no error would say so.
"""

from __future__ import annotations

from pathlib import Path

from birdstrike.solver.sources import digest_files

HERE = Path(__file__).parent
FOLDERS = ("kernels", "bird/eos")  # all that numba compiles
MARK = "kernels/__pycache__/sources.digest"


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
