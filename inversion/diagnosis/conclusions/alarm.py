"""Two tests of the model without effects: the alarm, and the model error that a record requires.

Alarm: how often would a record without any effect look as much like one with an effect as this does? Statistic: the
posterior odds of all single effects and of something else against none, by the prior's shares, at fixed amplitudes of
the discrepancy: by Neyman and Pearson the best test of none against that mixture. Its distribution under none is
simulated in the linear system; the p-value is the mean over the amplitudes' posterior under none (posterior predictive:
Bayarri & Berger, J. Am. Stat. Assoc. 95 (2000) 1127). It is uniform where the amplitudes are known, and else drawn to
the middle, because the record is used twice: of linear records without an effect 0 to 2.4 % are below 0.05, with one
channel and with four, without a baseline and beside one, of amplitudes from small to large (four channels beside a
baseline at a middle amplitude alone). The partial posterior predictive p-value (ibid.), which leaves the statistic out
of the amplitudes' posterior, is no remedy: 34 % of such records were below 0.05, for the statistic holds most of what
is known of the amplitudes.

Required discrepancy of a model: the smallest model error, one share of the peak for every kind of sensor, with which
the record is consistent. Consistent: the share is not too small for what the model leaves (its marginal likelihood is
within 1.35 of its largest over the share, or the share is larger), and from there on no other model is likelier by more
than 1.35 at the same share: a model error of that size can stand in for what the model lacks. 1.35 is the one-sided
95 % limit of a likelihood ratio with one degree of freedom (Wilks, Ann. Math. Stat. 9 (1938) 60: half of the chi-square
quantile 2.71). By the first condition alone all models would need the same share, that of the rough part of the
residual, which has many degrees of freedom and which no effect explains.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.linalg import block_diag
from scipy.special import logsumexp

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.inference.evidence import UNNAMED, ModelTester
from birdstrike.inversion.diagnosis.inference.fit import Fit
from birdstrike.inversion.diagnosis.inference.hypotheses import Hypothesis
from birdstrike.inversion.diagnosis.inference.ranking import Ranking
from birdstrike.inversion.results.diagnosis import LEAST_SHARE, MOST_SHARE, NONE, SOMETHING_ELSE

SHARES = np.geomspace(LEAST_SHARE, MOST_SHARE, 41)
WITHIN = 1.35


def required_discrepancy(ranking: Ranking) -> dict[str, float | None]:
    """Model -> share of the peak; None where even half of the peak is not enough.

    Pairs and something else are left out. A model is weighed against the others where it fits itself: about other
    places their likelihoods would differ by how curves bend.
    """
    fits = {label: ranking.fits.get(label, ranking.fits[NONE]) for label in _weighed(ranking)}
    tables = {id(fit): _likelihoods(ranking, fit) for fit in {id(one): one for one in fits.values()}.values()}
    found: dict[str, float | None] = {}
    for label, fit in fits.items():
        table = tables[id(fit)]
        # An effect may be of no size: what the prior's room for one costs makes no record inconsistent with it.
        found[label] = smallest(np.maximum(table[label], table[NONE]), table.values())
    return found


def _weighed(ranking: Ranking) -> dict[str, Hypothesis]:
    """None and the single effects."""
    return {
        label: model for label, model in ranking.models.items() if len(model.members) < 2 and label != SOMETHING_ELSE
    }


def _likelihoods(ranking: Ranking, fit: Fit) -> dict[str, Array]:
    """Model -> (shares,) log marginal likelihood, all about the place of one fit, the birds' distance averaged."""
    tester = at_shares(fit)
    return {
        label: np.logaddexp.reduce(
            tester.at_nodes(model, list(ranking.evidence[label].h)).reshape(-1, len(SHARES)), axis=0
        )
        for label, model in _weighed(ranking).items()
    }


def at_shares(fit: Fit) -> ModelTester:
    """The fit's system tested at common shares, with the birds as far apart as the fit may have them.

    Unnamed errors are the smallest: they stand for model error too.
    """
    combinations = np.repeat(SHARES[:, None], len(fit.tester.kinds), axis=1)
    return ModelTester(
        system=fit.system,
        known=fit.tester.known,
        places=fit.tester.places,
        scale=fit.tester.scale,
        combinations=combinations,
        unnamed=(UNNAMED[0],),
        apart=tuple(np.unique(fit.tester.apart)),
    )


def smallest(logs: Array, others: Iterable[Array] = ()) -> float | None:
    """The smallest consistent share of a model's log likelihoods (shares,); others: those of the models beside it."""
    if int(logs.argmax()) == len(logs) - 1:
        return None
    first = int(np.flatnonzero(logs >= logs.max() - WITHIN)[0])
    behind = np.flatnonzero(np.max([logs, *others], axis=0) - logs > WITHIN)
    enough = max(first, int(behind[-1]) + 1) if len(behind) else first
    return float(SHARES[enough]) if enough < len(SHARES) else None


DRAWS = 2000
KEPT = 0.05  # posterior weight of an amplitude below which it cannot move the p-value
ALPHA = 0.05


def alarm(ranking: Ranking, seed: int = 0, draws: int = DRAWS) -> float:
    """p-value of none, parameters and discrepancy free."""
    fit = ranking.fits[NONE]
    weights = fit.evidence.weights
    kept = np.flatnonzero(weights > KEPT * weights.max())
    labels = list(ranking.singles)
    priors = np.array([ranking.models[label].prior for label in labels])
    other = ranking.models[SOMETHING_ELSE].prior
    rng = np.random.default_rng(seed)
    p = [_at(fit.tester, int(node), labels, priors, other, rng, draws) for node in kept]
    return float(np.average(p, weights=weights[kept]))


def _at(
    tester: ModelTester,
    node: int,
    labels: list[str],
    priors: Array,
    other_prior: float,
    rng: np.random.Generator,
    draws: int,
) -> float:
    """The p-value at one set of amplitudes."""
    system, amplitudes = tester.system, tester.combinations[node]
    free, sizes = tester.free, tester.sizes(np.array([node]))[0]
    wanted = [0, *free, *(system.at[label].start for label in labels)]
    white, smooth = [], []
    for block, other, a in zip(system.blocks, system.other, amplitudes, strict=True):
        scale = 1.0 / np.sqrt(1.0 + a**2 * block.lam)
        white.append(scale[:, None] * (block.T @ tester.columns[np.ix_(block.rows, wanted)]))
        more = block.T @ (other.F - block.F) @ block.T.T
        smooth.append(scale[:, None] * more * scale)
    x = np.vstack(white)
    r = len(free)
    u, size, _ = np.linalg.svd(x[:, 1 : 1 + r] * sizes, full_matrices=False)
    shrink = 1.0 - 1.0 / np.sqrt(1.0 + size**2)  # whitens the parameters' and the unnamed errors' prior too

    def whitened(columns: Array) -> Array:
        return columns - u @ (shrink[:, None] * (u.T @ columns))

    deviations = tester.deviations
    out = whitened(np.column_stack([x[:, 0], *(size * x[:, 1 + r :] for size in deviations)]))
    S = whitened(whitened(np.asarray(block_diag(*smooth))).T)
    values, vectors = np.linalg.eigh(0.5 * (S + S.T))
    samples = rng.standard_normal((draws, len(x)))
    shares = np.tile(priors / len(deviations), len(deviations))
    score = odds(np.vstack([out[:, 0], samples]), out[:, 1:], shares, values, vectors, other_prior)
    return float((1 + (score[1:] >= score[0]).sum()) / (draws + 1))


def odds(samples: Array, G: Array, priors: Array, values: Array, vectors: Array, other: float) -> Array:
    """(q,) log of the weighted sum of Bayes factors against none of whitened residuals (q, p).

    G: (p, m) whitened signatures for one prior standard deviation; values, vectors: of something else's covariance.
    """
    power = (G**2).sum(axis=0)
    singles = 0.5 * (samples @ G) ** 2 / (1.0 + power) - 0.5 * np.log1p(power)
    along = (samples @ vectors) ** 2
    kept = np.maximum(values, 0.0)
    rest = 0.5 * along @ (kept / (1.0 + kept)) - 0.5 * np.log1p(kept).sum()
    return np.asarray(logsumexp(np.column_stack([singles + np.log(priors), rest + np.log(other)]), axis=1))
