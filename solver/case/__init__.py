"""The case: what defines one run of the solver, and what an inversion may vary in it.

A TOML file and overrides enter, a validated `Case` with every value in SI leaves, or all errors at once. Read case,
then the sections (plate, bird, sections, settings, external), the rules between them (rules, effects), then how a file
is read (load, overlay), how errors are worded (messages, remarks), and how a case is written (write).
"""
