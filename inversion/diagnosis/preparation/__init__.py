"""What the diagnosis compares with the records: simulations, emulator, responses to effects, and the records.

Enters: a case, its records. Leaves: a `Setup` and `Shot`s. Read `plan` (which simulations, and the sensors that they
have beside the case's own; `doe.campaign.simulations` runs and keeps them), `setup` (emulator of the campaign),
`responses` (to effects), `discrepancy` (error of the model's form), `shots` (a record, its setup, and what may be
wrong with its instruments).
"""
