"""Diagnosis: from a case and its records to a named missing effect, or to an honest refusal.

Enters: a case, measured records, baseline records. Leaves: an `Answer`, written as diagnosis.json.
Read in this order: plan (which simulations), setup (campaign, mesh correction, responses), instrument, discrepancy,
shots (one record's mean and covariance), system (all records stacked), hypotheses (the models and their priors),
evidence, refit, alarm, required, power, experiment_design, solver_check, cross_validation, answer, diagnose.
"""
