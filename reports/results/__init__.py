"""A finished loop, read from its folder.

Enters: the folder that `close-the-loop` made, or those of its parts. Leaves: `Results`, and what follows from it in
words and numbers. Read `parts` (which folders), `results` (what is held), `reading` (from the folders), `measurement`
(the measured record beside the simulations), `findings` (the five sentences).
"""
