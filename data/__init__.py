"""Units, curves and the run store, and the cases, measured and reference data that ship with birdstrike.

In: files of users (curves, histories of other programs) and results of runs. Out: SI arrays, and files that are whole
or absent. Read in this order: units.py (the only conversion) and unit_systems.py, errors.py, histories.py and
dataset.py (what a run and a campaign give; ranges of parameters, in their scales), formatting.py (numbers and names in
words), tables/ and curves.py (a measured record), exports/ and import_curve.py (other programs' files), decks/ (another
code's results for a deck), storage/ (files that are whole or absent, and the run store), progress.py, vtu.py
(pictures), paths.py.
"""
