"""Parameters, time origin and their uncertainty from observations and a campaign's runs.

Runs and `Observations` enter; a calibration, its posterior and each method's estimates leave. Read locate (the order of
the steps), then what it uses: prior, coordinates, curve_model, whitening, calibration, known_errors, time_origin,
likelihood, posterior; `answers/`, what each method says; verification by the solver; and what several records, further
runs or a finer mesh add: shots, refinement, mesh_correction (which the diagnosis reads as well).
"""
