"""Which hypotheses explain the records, and how probable each is.

Enters: setups and shots. Leaves: a `Ranking`. Read `system` (all records stacked), `hypotheses` (the models and their
priors), `evidence`, `ranking`.
"""
