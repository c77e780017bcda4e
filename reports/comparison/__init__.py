"""The bird models on the user's own impact, against the record.

Enters: results of a loop. Leaves: results with each model's simulation, their errors, ratings and state at the end.
Read `models` (the simulations), `clock` (time origin of each), `scores` and `iso18571` (errors), `end_state`.
"""
