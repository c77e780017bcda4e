"""Mesh convergence of a user's own case: order of convergence, extrapolated values, numerical uncertainty.

A case enters; `convergence.json` and `convergence.csv` leave. Read meshes (which are run), convergence (the study),
grid_convergence (the theory), scalars (which numbers), files.
"""
