"""Laws of the target's materials: one file a law, with its table in a case and the row of constants that kernels read.

A table under `target.materials` enters, a row (see `kernels.target.metal`) leaves. Read interface, then a law, then
registry.
"""
