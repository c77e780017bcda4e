"""The content of `inversion.json` and `diagnosis.json`: plain records that computations fill and that reports read.

Nothing enters but numbers; what leaves is `inversion.Inversion` and `diagnosis.Diagnosis`, which save and load
themselves. Read estimates (what a method answers), fit (how the best fit lies beside the measurement),
identifiability, ingredients, then inversion; diagnosis, then diagnosis_text (its sentences).
"""
