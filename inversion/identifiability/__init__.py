"""How well a record determines the parameters.

A calibration enters; singular directions, profile likelihoods, Sobol indices and information bounds leave. Read
directions, profile, sobol, information; summary writes them for `inversion.json`, and coverage counts how often the
intervals hold synthetic truths.
"""
