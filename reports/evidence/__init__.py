"""Everything that backs and repeats an answer, in one archive.

Enters: the folder of train-and-invert or close-the-loop. Leaves: a zip. Read `sources` (what belongs to the answer, and
where it is), `verification_rows` (which checks of the solver bear on the case), `summary` (the page at its head), then
`archive` (the zip and its manifest).
"""
