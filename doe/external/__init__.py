"""External solvers: somebody else's program in the place of ours.

In: a case with the section `external` and a template of the program's deck. Out: histories on the case's clock.
Read in this order: template.py (the deck filled in), deck.py (which changes of a case the deck has a place for),
external.py (the program run in a folder of its own), guard.py (it ends with us), output.py (its files read back).
"""
