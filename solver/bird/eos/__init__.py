"""Equations of state of the bird: one file a kind, each with its table in a case, its formula and what it builds.

A table (`interface.Law`) and the reference density enter, an `interface.EquationOfState` leaves, whose formula the
kernels call. Read interface, then any kind, then registry.
"""
