"""A loop over particles or elements compiled about one equation of state."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import FunctionType

from numba import njit

from birdstrike.solver.bird.eos.interface import Terms


@cache
def with_law(kernel: Callable[..., None], terms: Terms) -> Callable[..., None]:
    """The parallel loop `kernel`, written about the stand-in `kernels.bird.eos.law`, with `terms` in its place.

    Compiled code is kept on disk for the laws of this package. One from outside is compiled at its first use in each
    process, because numba would not notice that its source has changed.
    """
    law = terms if hasattr(terms, "py_func") else njit(terms)
    source = law.py_func  # pyright: ignore[reportFunctionMemberAccess, reportAttributeAccessIssue]
    inside = source.__module__.partition(".")[0] == __name__.partition(".")[0]
    own = FunctionType(kernel.__code__, kernel.__globals__ | {"law": law}, kernel.__name__)
    own.__module__, own.__doc__, own.__qualname__ = kernel.__module__, kernel.__doc__, kernel.__name__
    if inside:  # numba names the file of its cache by this
        digest = hashlib.sha256(Path(inspect.getfile(source)).read_bytes()).hexdigest()[:8]
        own.__qualname__ = f"{kernel.__name__}.{source.__name__}.{digest}"
    return njit(own, cache=inside, parallel=True)
