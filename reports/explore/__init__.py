"""The page with sliders: sliders, curves, misfit, map and profile of a folder of results, in one HTML file.

Enters: a folder of run-doe, train-and-invert, diagnose or close-the-loop. Leaves: `explore.html`, which loads nothing
from outside and computes in the reader's browser what the emulator computes here. Read `kinds.registry` (which folders
there are), `view` (what the page is told of one), `explore` (how it is written), then the scripts in `page`, in the
order of `explore.SCRIPTS`.
"""
