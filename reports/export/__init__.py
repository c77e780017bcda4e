"""Cards for LS-DYNA: the bird's material and equation of state in a chosen system of units.

Enters: a case or the folder of an inversion. Leaves: a `.k` file. Read `exported` (whose constants, and what is known
of them), `cards` (which field holds which constant), `lsdyna` (the file).
"""
