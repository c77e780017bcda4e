"""Which hypotheses explain the records, and how probable each is.

Enters: setups and shots. Leaves: a `Ranking`. Read `hypotheses` (the models and their priors), `linearisation` (the
shots about given parameters), `system` (all of it stacked, with the errors of model and simulations), `gaussians`
(algebra), `evidence` (marginal likelihoods and posterior), `ranking` (where each model fits best, and how probable it
is).
"""
