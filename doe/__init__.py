"""Design of experiments: the runs of a campaign, chosen over the parameters of a case, and carried out.

In: a case with its ranges (inversion.parameters), a design's name or file. Out: a campaign's folder and its Dataset.
Read in this order: designs/ (which runs), attempt.py (one attempt at a run, and whose fault its failure is),
solvers.py (ours or an external one, external/), campaign/ (all runs, resumable).
"""
