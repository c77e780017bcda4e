"""A model linearised at its own refit: residual, tangent plane, and every effect's signature in whitened rows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array

SEEN = 1e-3  # of |g|: what the model cannot imitate; below it an effect has no signature of its own
RANK = 1e-9


@dataclass(frozen=True)
class Linear:
    """Rows: n whitened data, then the priors of the unknowns; all in units in which they scatter by 1.

    names: (m) the effects; residual: (rows,); design: (rows, q) of the unknowns that are free; effects: (rows, m), the
    change of every effect at magnitude b = 1; one_sided: (m,) those that only act with b > 0; held: the model's own
    effect where its bound b = 0 holds it, else None (free, it is a column of the design, or the model has none).
    """

    names: tuple[str, ...]
    residual: Array
    design: Array
    effects: Array
    one_sided: NDArray[np.bool_]
    held: int | None = None

    @cached_property
    def basis(self) -> Array:
        """(rows, rank) orthonormal basis of what the free unknowns can imitate, A A^+ = basis basis^T."""
        scale = np.linalg.norm(self.design, axis=0)
        left, s, _ = np.linalg.svd(self.design / np.where(scale > 0.0, scale, 1.0), full_matrices=False)
        return left[:, s > RANK * s.max(initial=1.0)]

    def project(self, rows: Array) -> Array:
        """P x = x - A A^+ x for vectors or columns (rows, ...)."""
        return rows - self.basis @ (self.basis.T @ rows)

    @cached_property
    def remainder(self) -> Array:
        """e = P r (rows,)."""
        return self.project(self.residual)

    @property
    def freedom(self) -> int:
        """Degrees of freedom of e."""
        return len(self.residual) - self.basis.shape[1]

    @cached_property
    def projected(self) -> Array:
        """P g of every effect (rows, m)."""
        return self.project(self.effects)

    @cached_property
    def sizes(self) -> Array:
        """|P g| of every effect (m,): standard errors by which b = 1 stands out."""
        return np.linalg.norm(self.projected, axis=0)

    @cached_property
    def seen(self) -> NDArray[np.bool_]:
        """(m,) effects whose signature the free unknowns cannot imitate entirely."""
        return self.sizes > SEEN * np.maximum(np.linalg.norm(self.effects, axis=0), 1e-300)

    @cached_property
    def signatures(self) -> Array:
        """(rows, m) P g / |P g|, zero where an effect has none."""
        return np.where(self.seen, self.projected / np.where(self.seen, self.sizes, 1.0), 0.0)

    def cosines(self) -> Array:
        """(m, m) cos(P g_i, P g_j)."""
        return self.signatures.T @ self.signatures
