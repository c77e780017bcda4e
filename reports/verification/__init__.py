"""Verification of the solver: each row a truth, its source, our figure, the tolerance.

Enters: nothing but the code, shipped cases and reference data. Leaves: VERIFICATION.md with its figures. Read
`problem` (what a problem is), `registry` (which there are; a new one is a file in `problems/` and a line there),
`runs` (the simulations that problems share), `verify` (what is due, in worker processes), `cache` (what is kept),
`ledger` (what the page holds), `page`.
"""
