"""torch on one thread: matrices of these sizes lose more to waking threads than they gain."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def one_torch_thread() -> Iterator[None]:
    """Within the block torch computes on one thread; afterwards on as many as before."""
    import torch  # takes seconds to load, so only who trains with it waits for it

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
