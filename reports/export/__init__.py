"""Decks and cards of other codes: a bird, the effects that its model lacks, or a whole case.

Enters: a case, or the folder of an inversion or a diagnosis. Leaves: a `.k` file, or `.rad` files of Radioss. Read
`exported` (whose constants, and what is known of them), `cards` (which field holds which constant), `lsdyna` (a file of
cards), `effects`; for whole decks `model` (the case as any code takes it), `numbering`, `fixed_columns`, then a code's
deck and its materials, and `deck` (which of them is written).
"""
