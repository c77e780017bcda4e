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

What could have been detected: the size of each effect that a test finds four times of five, a baseline's gain.

Also what the calibrated parameters can do: imitate an effect, or be led astray by one that the model lacks.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.linalg import block_diag
from scipy.special import logsumexp
from scipy.stats import norm

from birdstrike.data.histories import Array, Indices
from birdstrike.inversion.diagnosis.inference.evidence import UNNAMED, ModelTester
from birdstrike.inversion.diagnosis.inference.gaussians import Reduced, integrated
from birdstrike.inversion.diagnosis.inference.hypotheses import Hypothesis
from birdstrike.inversion.diagnosis.inference.ranking import Fit, Ranking
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
