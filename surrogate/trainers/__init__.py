"""Trainers of the network, one a file: start weights and samples enter, a `Training` leaves.

Read training (samples, and what a trainer leaves behind), then levenberg_marquardt, which is the literature's; ensemble
trains many at once, bayesian_regularisation and adam are the others.
"""
