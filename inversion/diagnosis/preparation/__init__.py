"""What the diagnosis compares with the records: simulations, emulator, responses to effects, and the records.

Enters: a case, its records. Leaves: a `Setup` and `Shot`s. Read `plan` (which simulations; `doe.campaign.simulations`
runs and keeps them), `candidate_sensors` (simulated beside the case's own), `setup` (emulator of the campaign),
`responses` (to effects), `instrument`, `discrepancy` (error of the model's form), `shots` (a record and its setup).
"""
