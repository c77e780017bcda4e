"""Diagnosis: from a case and its records to a named missing effect, or to the statement that none can be named.

Enters: a case, measured records, baseline records. Leaves: a `Diagnosis`, written as diagnosis.json.
Read `preparation/` (simulations, emulator, responses, shots), `inference/` (the hypotheses and
how probable each is), `conclusions/` (what follows), then `model_file` (what `explore` draws and `predict` carries on),
`pipeline` (the procedure) and `diagnose` (the command, and what enters).
"""
