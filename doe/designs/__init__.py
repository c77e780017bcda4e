"""Designs: points of the parameter space at which a campaign runs.

In: the parameter space of a case, a kind of design or a user's CSV file, runs and seed. Out: a Design with its quality.
Read in this order: space.py (ranges and scales), design.py (a Design, and the interface of the kinds), the kinds
(uniform.py with annealing.py, orthogonal.py, lhs.py, sobol.py), design_file.py, registry.py (all by name), quality.py,
completion.py (runs added to a design). A kind is added by a file of its own and a line in registry.py.
"""
