"""Which elements meet at a node."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def node_rows(elements: NDArray[np.int64], nodes: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """For every node the places of its elements' corners in the raveled (e, corners) table, in compressed rows.

    Of node p: `member[start[p]:start[p + 1]]`, in order; place = corners * element + corner.
    """
    flat = elements.ravel()
    start = np.concatenate([[0], np.cumsum(np.bincount(flat, minlength=nodes))])
    return start.astype(np.int64), np.argsort(flat, kind="stable").astype(np.int64)
