"""Diagnosis: from a case and its records to a named missing effect, or to an honest refusal.

Enters: a case, measured records, baseline records. Leaves: a `Diagnosis`, written as diagnosis.json.
Read in this order: `plan` (which simulations; `doe.campaign.simulations` runs and keeps them), `setup` (emulator of
the campaign), `responses` (to effects), `instrument`, `discrepancy` (error of the model's form), `shots` (a record and
its setup), `system` (all records stacked), `hypotheses` (the models and their priors), `evidence`, `ranking`,
`baseline`, `solver_update`, `alarm`, `power`, `next_measurement`, `before_and_after`, `answer`, `model_file` (what
`explore` draws and `predict` carries on), `pipeline` (the procedure), `diagnose` (the command).
"""
