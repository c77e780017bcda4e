"""The content of `inversion.json`: plain records that every step of an inversion fills and that reports read.

Nothing enters but numbers; what leaves is `inversion.Inversion`, which saves and loads itself. Read estimates (what a
method answers), fit (how the best fit lies beside the measurement), identifiability, ingredients, then inversion.
"""
