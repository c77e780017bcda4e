"""The posterior of the parameters and the time origin, sampled by emcee, its convergence checked by arviz.

Foreman-Mackey et al., "emcee: the MCMC hammer", PASP 125 (2013) 306; ter Braak and Vrugt, differential evolution with
snooker update, Stat. Comput. 18 (2008) 435; rank-normalised R-hat and effective sample size: Vehtari et al., Bayesian
Analysis 16 (2021) 667.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import emcee
import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from birdstrike.data.histories import Array
from birdstrike.data.progress import Progress, silent
from birdstrike.inversion.estimation.calibration import Calibrator, Mode
from birdstrike.inversion.estimation.likelihood import Likelihood

CONVERGED_RHAT = 1.01
CONVERGED_ESS = 400.0
WIDER = 1.5


@dataclass(frozen=True)
class Sampling:
    """ensembles: started independently, of so many walkers; the chains grow by `chunk` steps up to `most`.

    The first half of every chain is dropped as burn-in.
    """

    ensembles: int = 2
    walkers: int = 48
    chunk: int = 150
    most: int = 3000


@dataclass(frozen=True)
class Posterior:
    """Draws z (N, r) of the coordinates, theta (N, k) SI of the parameters, t0 (N,) [s] of the time origin.

    rhat: (r,) rank-normalised split R-hat; ess: (r,) bulk effective sample size; acceptance: share of moves taken;
    steps: length of each chain, burn-in included; mode: the most probable point found by least squares.
    """

    z: Array
    theta: Array
    t0: Array
    rhat: Array
    ess: Array
    acceptance: float
    steps: int
    mode: Mode

    @property
    def converged(self) -> bool:
        """R-hat at most 1.01 and at least 400 effective draws of every coordinate."""
        return bool((self.rhat <= CONVERGED_RHAT).all() and (self.ess >= CONVERGED_ESS).all())

    @property
    def warnings(self) -> tuple[str, ...]:
        """What makes the draws less than they seem."""
        if self.converged:
            return ()
        text = f"the posterior's chains have not settled after {self.steps} steps (R-hat {self.rhat.max():.3f}"
        return (f"{text}, {self.ess.min():.0f} effective draws): the intervals are rough",)

    def interval(self, share: float = 0.95) -> Array:
        """(r, 2) central intervals of z."""
        tail = (1.0 - share) / 2.0
        return np.quantile(self.z, [tail, 1.0 - tail], axis=0).T

    def correlation(self) -> Array:
        """(r + 1, r + 1) of (z, t0); 0 where one of the two never changes."""
        rows = np.column_stack([self.z, self.t0])
        centred = rows - rows.mean(axis=0)
        sd = centred.std(axis=0)
        scaled = np.divide(centred, sd, out=np.zeros_like(centred), where=sd > 0.0)
        return scaled.T @ scaled / len(rows)


def sample(
    calibrator: Calibrator,
    modes: tuple[Mode, ...],
    seed: int = 0,
    sampling: Sampling | None = None,
    progress: Progress = silent,
) -> Posterior:
    """Draw until the chains agree; modes: of the calibration, where the walkers start."""
    rules, density = sampling or Sampling(), Likelihood.of(calibrator, modes)
    free = np.array([True] * len(modes[0].z) + [calibrator.sigma > 0.0])
    rng = np.random.default_rng(seed)
    with threadpool_limits(limits=1, user_api="blas"):
        chains = [
            _Chain(density, free, _start(density, modes, rules.walkers, free, rng), rng) for _ in range(rules.ensembles)
        ]
        found = None
        while found is None or (not found.converged and found.steps < rules.most):
            for chain in chains:
                chain.run(rules.chunk)
            found = _posterior(density, modes[0], chains, free)
            progress(min(1.0, found.steps / rules.most))
    progress(1.0)
    return found


class _Chain:
    """One ensemble of walkers over the coordinates that are free."""

    def __init__(self, density: Likelihood, free: NDArray[np.bool_], start: Array, rng: np.random.Generator) -> None:
        moves = [(emcee.moves.DEMove(), 0.6), (emcee.moves.DESnookerMove(), 0.1), (emcee.moves.StretchMove(), 0.3)]
        self.sampler = emcee.EnsembleSampler(
            len(start), int(free.sum()), lambda p: density.log_posterior(_whole(p, free)), moves=moves, vectorize=True
        )
        seeded = np.random.RandomState(int(rng.integers(2**31))).get_state()
        self.state = emcee.State(start, random_state=seeded)

    def run(self, steps: int) -> None:
        """Go on by so many steps."""
        self.state = self.sampler.run_mcmc(self.state, steps, skip_initial_state_check=True)


def _whole(p: Array, free: NDArray[np.bool_]) -> Array:
    whole = np.zeros((len(p), len(free)))
    whole[:, free] = p
    return whole


def _start(
    density: Likelihood, modes: tuple[Mode, ...], walkers: int, free: NDArray[np.bool_], rng: np.random.Generator
) -> Array:
    """Walkers about the modes in turn, half as wide again as these are, where runs stand behind the emulator.

    The calibration has searched every box, so the modes are all there is; a walker from the prior would take thousands
    of steps to find a peak of a hundredth of a range.
    """
    sigma, found = density.calibrator.sigma, []
    while len(found) < walkers:
        mode = modes[len(found) % len(modes)]
        units = np.append(np.ones(len(mode.z)), 1.0 / sigma if sigma else 0.0)
        centre = np.append(mode.z, density.calibrator.tau(mode))
        p = centre + WIDER * np.sqrt(np.diag(mode.covariance)) * units * rng.normal(size=len(units))
        p[:-1] = _reflected(p[:-1], mode.box.lows, mode.box.highs)
        p[-1] = np.clip(p[-1], density.taus[0], density.taus[-1])
        if density.allowed(p[None, :-1], p[-1:])[0]:
            found.append(p[free])
    return np.array(found)


def _reflected(z: Array, lows: Array, highs: Array) -> Array:
    """Points mirrored at the ends into lows..highs: walkers on an end would never leave it."""
    room = highs - lows
    place = np.mod(z - lows, 2.0 * room)
    return lows + np.minimum(place, 2.0 * room - place)


def _posterior(density: Likelihood, mode: Mode, chains: list[_Chain], free: NDArray[np.bool_]) -> Posterior:
    """The second half of all chains, as draws and as figures of their agreement."""
    length = chains[0].sampler.iteration
    kept = [np.asarray(chain.sampler.get_chain(discard=length // 2)) for chain in chains]
    ensembles = np.stack([part.transpose(1, 0, 2) for part in kept])  # (ensembles, walkers, draws, free)
    rhat, ess = _agreement(ensembles)
    p = _whole(ensembles.reshape(-1, ensembles.shape[-1]), free)
    r = len(mode.z)
    acceptance = float(np.mean([chain.sampler.acceptance_fraction for chain in chains]))
    t0 = p[:, -1] * density.calibrator.sigma
    return Posterior(
        z=p[:, :r],
        theta=density.theta(p[:, :r]),
        t0=t0,
        rhat=rhat[:r],
        ess=ess[:r],
        acceptance=acceptance,
        steps=length,
        mode=mode,
    )


def _agreement(ensembles: Array) -> tuple[Array, Array]:
    """R-hat and bulk effective sample size of every coordinate of (ensembles, walkers, draws, coordinates).

    R-hat compares ensembles and the earlier and later half of each (walkers of one are no independent chains); the
    effective size counts each walker's autocorrelation.
    """
    many, walkers, draws, free = ensembles.shape
    apart = ensembles.transpose(0, 2, 1, 3).reshape(many, draws * walkers, free)  # in the order of the steps
    chains = ensembles.reshape(many * walkers, draws, free)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # arviz announces its next version on import
        import arviz  # takes seconds to load, so only who samples waits for it

        rhat = [float(arviz.rhat(apart[..., i])) for i in range(free)]
        ess = [float(arviz.ess(chains[..., i])) for i in range(free)]
    return np.array(rhat), np.array(ess)
