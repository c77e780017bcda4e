"""What could have been detected: the size of each effect that a test finds four times of five, a baseline's gain.

Also what the calibrated parameters can do: imitate an effect, or be led astray by one that the model lacks.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import norm

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.inference.fit import Fit
from birdstrike.inversion.diagnosis.inference.gaussians import Indices, Reduced, integrated
from birdstrike.inversion.diagnosis.inference.ranking import Ranking
from birdstrike.inversion.results.diagnosis import NONE

STEP = 1e-3  # of a range: for the derivative of a parameter's scale
MOST_ALIKE = 3  # effects that are named beside one
POWER = 0.8  # of the test by which an effect counts as detectable


def likeliest(fit: Fit) -> Indices:
    """(1,) the node of amplitudes with the largest posterior weight."""
    return np.array([int(fit.evidence.weights.argmax())])


def columns_of(fit: Fit, names: Sequence[str]) -> list[int]:
    """Columns of the system; names: of `System.at`: an effect's label has one column, for its h."""
    return [column for name in names for column in range(fit.system.at[name].start, fit.system.at[name].stop)]


def reduced(fit: Fit, names: Sequence[str]) -> Reduced:
    """Columns with parameters, unnamed errors and nuisances integrated out, as in every fit, at the likeliest node."""
    return fit.tester.reduced(fit.tester.grams, likeliest(fit), columns_of(fit, names))


def beside_parameters(fit: Fit, labels: Sequence[str]) -> tuple[Array, Array]:
    """(q, q) information on effects with everything else known, and with the parameters alone free (priors included).

    At the likeliest node. Unnamed errors are not free: they have every effect's own signature.
    """
    node, parameters = likeliest(fit), columns_of(fit, ["J"])
    grams = fit.tester.grams.at(node, [*parameters, *columns_of(fit, labels)])
    r = len(parameters)
    return grams[0, r:, r:], integrated(grams, fit.tester.sizes(node)[:, :r])[0][0]


def scatter_of_sizes(fit: Fit, labels: Sequence[str]) -> Array:
    """(labels,) standard deviation of each effect's estimated h, alone in the model, at the likeliest node.

    With parameters and unnamed errors free and with what another lattice moves, which no residual shows: where S is the
    information with the free directions taken out, the lattice's columns move the estimate by their S with the
    signature over the signature's own (omitted variables: White, Econometrica 50 (1982) 1).
    """
    S = reduced(fit, [*labels, "lattice"]).S[0]
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
    singles, sizes = ranking.singles, least_sizes(ranking, alpha)
    return {
        label: None if h > singles[label].limits[1] else abs(singles[label].magnitude(h)) for label, h in sizes.items()
    }


def least_sizes(ranking: Ranking, alpha: float) -> dict[str, float]:
    """Effect -> the size h of `minimum_detectable`, whether or not so large a one is looked for."""
    labels, signal = list(ranking.singles), norm.ppf(1.0 - alpha / 2.0) + norm.ppf(POWER)
    return dict(zip(labels, map(float, signal * scatter_of_sizes(ranking.fits[NONE], labels)), strict=True))


def absorbed(ranking: Ranking) -> dict[str, float]:
    """Effect that a sensor shows -> share of its signature that the parameters imitate.

    Of the information on its size that the record would hold if the parameters were known, the share that is lost
    because they are calibrated: 1 where a change of parameters inside their priors does the same.
    """
    labels = ranking.seen
    whole, left = map(np.diag, beside_parameters(ranking.fits[NONE], labels))
    shares = 1.0 - left / np.maximum(whole, 1e-300)
    return {label: float(np.clip(s, 0.0, 1.0)) for label, s in zip(labels, shares, strict=True)}


def collinear(ranking: Ranking) -> dict[str, dict[str, float]]:
    """Effect -> the three most like it, with the cosine of the signatures once parameters have taken their part.

    Of effects that a sensor shows. Signatures are weighed by noise, numerical error and discrepancy; unnamed errors,
    which have every signature of the library, are not taken out of them.
    """
    labels = ranking.seen
    _, left = beside_parameters(ranking.fits[NONE], labels)
    size = np.sqrt(np.maximum(np.diag(left), 1e-300))
    cosine = left / np.outer(size, size)
    found: dict[str, dict[str, float]] = {}
    for i, label in enumerate(labels):
        order = [j for j in np.argsort(-np.abs(cosine[i])) if j != i and labels[j].split(".")[0] != label.split(".")[0]]
        found[label] = {labels[j]: float(np.clip(cosine[i, j], -1.0, 1.0)) for j in order[:MOST_ALIKE]}
    return found


def gain(beside: Ranking, alone: Ranking, alpha: float) -> float | None:
    """Median factor by which a baseline makes minimum detectable effects smaller; None where none is detectable.

    Of effects that are detectable beside it or alone. Of those that are not in one of the two the size counts that the
    test would need there, though it is larger than what is looked for.
    """
    own, other = least_sizes(beside, alpha), least_sizes(alone, alpha)
    limits = {label: one.limits[1] for label, one in beside.singles.items() if label in other}
    ratios = [other[label] / own[label] for label, most in limits.items() if min(own[label], other[label]) <= most]
    return float(np.median(ratios)) if ratios else None


def biases(ranking: Ranking) -> dict[str, dict[str, float]]:
    """Effect -> what one plausible size of it, absent from the model, adds to each parameter of the first shot, SI.

    To the posterior means of the model without an effect, in which unnamed errors and nuisances take their part too.
    """
    fit, shot = ranking.fits[NONE], ranking.problem.shots[0]
    space, labels = shot.setup.plan.space, list(ranking.singles)
    r, k = len(fit.tester.rotation), len(space.names)
    taken = fit.tester.sizes(likeliest(fit))[0, :r, None] * reduced(fit, labels).W[0, :r]
    moved = fit.tester.rotation.T @ taken
    first = fit.system.names.index(shot.name) * k
    z = np.clip(fit.places.z[shot.name], STEP, 1.0 - STEP)
    width = (space.to_physical((z + STEP)[None])[0] - space.to_physical((z - STEP)[None])[0]) / (2.0 * STEP)
    shifts = (width * shot.setup.plan.prior.sd)[:, None] * moved[first : first + k]
    return {label: {name: float(shifts[i, j]) for i, name in enumerate(space.names)} for j, label in enumerate(labels)}
