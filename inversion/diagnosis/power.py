"""What could have been detected: the size of each effect that a test finds four times of five, a baseline's gain.

Also what the calibrated parameters can do: imitate an effect, or be led astray by one that the model lacks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.stats import norm

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.ranking import Fit, Ranking
from birdstrike.inversion.results.diagnosis import NONE

STEP = 1e-3  # of a range: for the derivative of a parameter's scale
MOST_ALIKE = 3  # effects that are named beside one
POWER = 0.8  # of the test by which an effect counts as detectable


def information(fit: Fit, names: Sequence[str]) -> Array:
    """(q, q) information on columns of the system, parameters and unnamed errors free, at the likeliest node.

    names: of `System.at`: an effect's label has one column, for its h.
    """
    columns = [column for name in names for column in range(fit.system.at[name].start, fit.system.at[name].stop)]
    node = np.array([int(fit.evidence.weights.argmax())])
    return fit.tester.reduced(fit.tester.grams, node, columns).S[0]


def scatter_of_sizes(fit: Fit, labels: Sequence[str]) -> Array:
    """(labels,) standard deviation of each effect's estimated h, alone in the model, at the likeliest node.

    With parameters and unnamed errors free and with what another lattice moves, which no residual shows: where S is the
    information with the free directions taken out, the lattice's columns move the estimate by their S with the
    signature over the signature's own (omitted variables: White, Econometrica 50 (1982) 1).
    """
    S = information(fit, [*labels, "lattice"])
    own = np.maximum(np.diag(S)[: len(labels)], 1e-300)
    moved = S[: len(labels), len(labels) :] / own[:, None]
    return np.asarray(np.sqrt(1.0 / own + (moved**2).sum(axis=1)))


def minimum_detectable(ranking: Ranking, alpha: float) -> dict[str, float | None]:
    """Effect -> SI magnitude that a two-sided test of this effect alone finds four times of five.

    None where even the largest that is looked for stays unseen. alpha: rate of the test's false alarms. The model error
    is that which the record leaves open without an effect. The alarm, which looks for all effects at once and learns
    the model error from the same record, follows it beside a baseline (in the audits 87 of 89 effects above it raised
    the alarm), and not without one (1 of 12).
    """
    singles, signal = ranking.singles, float(norm.ppf(1.0 - alpha / 2.0) + norm.ppf(POWER))
    found: dict[str, float | None] = {}
    for (label, one), sd in zip(singles.items(), scatter_of_sizes(ranking.fits[NONE], list(singles)), strict=True):
        h = signal * float(sd)
        found[label] = None if h > one.limits[1] else abs(one.magnitude(h))
    return found


def absorbed(ranking: Ranking) -> dict[str, float]:
    """Effect that a sensor shows -> share of its signature that the parameters imitate."""
    fit = ranking.fits[NONE]
    labels = ranking.seen
    gram = fit.tester.grams.node(int(fit.evidence.weights.argmax()))
    whole = np.array([gram[fit.system.at[label].start, fit.system.at[label].start] for label in labels])
    left = np.diag(information(fit, labels))
    shares = 1.0 - left / np.maximum(whole, 1e-300)
    return {label: float(np.clip(s, 0.0, 1.0)) for label, s in zip(labels, shares, strict=True)}


def collinear(ranking: Ranking) -> dict[str, dict[str, float]]:
    """Effect -> the three most like it, with the cosine of the signatures once parameters have taken their part.

    Of effects that a sensor shows.
    """
    fit = ranking.fits[NONE]
    labels = ranking.seen
    left = information(fit, labels)
    size = np.sqrt(np.maximum(np.diag(left), 1e-300))
    cosine = left / np.outer(size, size)
    found: dict[str, dict[str, float]] = {}
    for i, label in enumerate(labels):
        order = [j for j in np.argsort(-np.abs(cosine[i])) if j != i and labels[j].split(".")[0] != label.split(".")[0]]
        found[label] = {labels[j]: float(np.clip(cosine[i, j], -1.0, 1.0)) for j in order[:MOST_ALIKE]}
    return found


def gain(with_baseline: Mapping[str, float | None], without: Mapping[str, float | None]) -> float | None:
    """Median factor by which minimum detectable effects shrink."""
    ratios = [other / own for label, own in with_baseline.items() if own and (other := without.get(label)) is not None]
    return float(np.median(ratios)) if ratios else None


def biases(ranking: Ranking) -> dict[str, dict[str, float]]:
    """Effect -> what one plausible size of it, absent from the model, adds to each parameter of the first shot, SI."""
    fit, shot = ranking.fits[NONE], ranking.problem.shots[0]
    space, at = shot.setup.plan.space, fit.system.at
    labels = list(ranking.singles)
    gram = fit.tester.grams.node(int(fit.evidence.weights.argmax()))
    J, own = np.arange(at["J"].start, at["J"].stop), np.array([at[label].start for label in labels])
    node = np.array([int(fit.evidence.weights.argmax())])
    prior = np.diag(fit.tester.sizes(node)[0, : len(J)] ** -2.0)
    moved = fit.tester.rotation.T @ np.linalg.solve(prior + gram[np.ix_(J, J)], gram[np.ix_(J, own)])
    k = len(space.names)
    first = fit.system.names.index(shot.name) * k
    z = np.clip(fit.places.z[shot.name], STEP, 1.0 - STEP)
    width = (space.to_physical((z + STEP)[None])[0] - space.to_physical((z - STEP)[None])[0]) / (2.0 * STEP)
    shifts = (width * shot.setup.plan.prior.sd)[:, None] * moved[first : first + k]
    return {label: {name: float(shifts[i, j]) for i, name in enumerate(space.names)} for j, label in enumerate(labels)}
