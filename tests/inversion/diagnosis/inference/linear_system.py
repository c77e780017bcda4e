"""A linear-Gaussian system whose marginal likelihoods can be written down: few points, five effects."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.stats import multivariate_normal

from birdstrike.inversion.diagnosis.inference.hypotheses import CandidateEffect, Hypothesis
from birdstrike.inversion.diagnosis.inference.system import Block, System
from birdstrike.inversion.diagnosis.preparation.discrepancy import Amplitudes
from birdstrike.inversion.estimation.prior import NormalPrior
from birdstrike.inversion.results.diagnosis import NONE

POINTS, EFFECTS = 40, 5


class Stub:
    """A candidate effect as the evidence reads it."""

    def __init__(self, label: str, one_sided: bool = False) -> None:
        self.label, self.name, self.one_sided, self.limits = label, label, one_sided, (-5.0, 5.0)
        self.shots = ("shot",)


def system(seed: int, y: np.ndarray | None = None, size: float = 6.0) -> System:
    """A made-up shot of one kind of sensor: two parameters, an unnamed error, a nuisance, five effects, discrepancy."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, POINTS)
    waves = np.array(
        [np.sin((k + 1) * 2.0 * t + p) for k, p in zip(range(EFFECTS + 4), rng.uniform(0, 6, EFFECTS + 4), strict=True)]
    ).T
    U = 400.0 * np.exp(-0.5 * ((t[:, None] - t) / 0.15) ** 2)
    F = np.eye(POINTS)
    J, P, N, G = 10.0 * waves[:, :2], 5.0 * waves[:, 2:3], 3.0 * waves[:, -1:], size * waves[:, 3:-1]
    values = np.zeros(POINTS) if y is None else y
    columns = np.column_stack([values, J, P, N, G])
    at = {"y": slice(0, 1), "J": slice(1, 3), "unnamed": slice(3, 4), "nuisance": slice(4, 5)}
    at |= {f"e{i}": slice(5 + i, 6 + i) for i in range(EFFECTS)}
    at["lattice"] = slice(5 + EFFECTS, 5 + EFFECTS)
    block = Block.of("displacement", np.arange(POINTS), F, U)
    smooth = {"displacement": 50.0 * np.exp(-np.abs(t[:, None] - t) / 0.05)}
    priors = {"shots": NormalPrior.of_ranges(2)}
    return System((block,), smooth, columns, at, np.zeros(2), priors, np.eye(POINTS), {}, np.ones(2), {})


def log_density(y: np.ndarray, C: np.ndarray) -> float:
    mean: Any = np.zeros(len(y))
    spread: Any = C
    return float(multivariate_normal.logpdf(y, mean, spread))


def known(nodes: np.ndarray) -> Amplitudes:
    weights = np.full(len(nodes), -np.log(len(nodes)))
    return Amplitudes({"displacement": nodes}, {"displacement": weights}, {"displacement": 0.0}, "test")


def models(one_sided: bool = False) -> dict[str, Hypothesis]:
    found = {NONE: Hypothesis(NONE, (), 0.5, NONE)}
    for i in range(EFFECTS):
        found[f"e{i}"] = Hypothesis(f"e{i}", (Stub(f"e{i}", one_sided),), 0.5 / EFFECTS, f"f{i % 2}")  # pyright: ignore[reportArgumentType]
    return found


def covariance(s: System, a: float, unnamed: float, label: str | None = None, size: float = 1.0) -> np.ndarray:
    J, P = s.columns[:, s.at["J"]], unnamed * s.columns[:, s.at["unnamed"]]
    N = s.columns[:, s.at["nuisance"]]
    C = s.blocks[0].F + a**2 * s.blocks[0].U + J @ J.T + P @ P.T + N @ N.T
    return C if label is None else C + size**2 * s.columns[:, s.at[label]] @ s.columns[:, s.at[label]].T


def singles(every: Mapping[str, Hypothesis]) -> dict[str, CandidateEffect]:
    """As `Ranking.singles`."""
    return {label: one.members[0] for label, one in every.items() if len(one.members) == 1}
