"""Units, curves, run store, and the cases, measured and reference data that ship with birdstrike."""
