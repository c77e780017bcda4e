"""Which hypotheses explain the records, and how probable each is.

Enters: setups and shots. Leaves: a `Ranking`. Read `hypotheses` (the models and their priors), `linearisation` (the
shots about given parameters), `model_error` and `simulation_error` (what either leaves uncertain), `system` (all of it
stacked), `gaussians` (algebra), `bird_scatter`, `evidence` (marginal likelihoods), `posterior`, `fit` (where a model
lies best), `probabilities`, `ranking`.
"""
