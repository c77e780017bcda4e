"""The blind test of the diagnosis: records of known truth, the answers to them, and the acceptance criteria.

Enters: a folder of experiments, shipped or drawn from a seed. Leaves: `audit.json`. Read in this order: `draws` (what a
truth is, its mesh and its form), `records` (an experiment's files), `truth_runs` (truths simulated and recorded),
`answers` (the diagnosis of each record, stored), `score` (an answer against its truth), `tables` (acceptance criteria,
rates, intervals: what goes into audit.json), `audit` (the procedure).
"""
