"""Campaign: the runs of a design on all cores or a cluster, resumable, into a folder.

In: a case, a Design, a folder. Out: design.csv, runs/, curves.csv, summary.json, and the Dataset read back from them.
Read in this order: campaign.py (the whole), run.py (one run, its stored results, its retry), runner.py (runs to an
executor), worker.py (processes) and cluster.py (Dask), simulations.py (any set of cases, for what inverts), folder.py
(whose folder it is), planned.py (a longer design for it), results.py (its files and the Dataset), inventory.py (what it
holds), adoption.py (whether it fits another flow).
"""
