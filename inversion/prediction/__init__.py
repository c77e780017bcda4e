"""Prediction: what was learnt from one shot carried to another case, with bands and where they come from.

Enters: a results folder and a case. Leaves: a `Prediction`, written as prediction.json and prediction.csv. Read in this
order: `learnt` (what a folder holds, in one form), `from_inversion`, `from_diagnosis`, `from_models` (its readers),
`reading` (the folder), `distance` (how far the case lies from the data), `carry_over` (what of it belongs to the new
case), `sample` (draws), `campaign` (simulations, emulator), `discrepancy` (what the model itself leaves), `curves` (all
of it together), `budget` (shares of the variance), `answer` (figures and files), `predict` (the command).
"""
