"""From a measured curve to parameters with intervals, a verifying solver run, and the name of a lacking effect.

A campaign's runs and a measured record enter; `inversion.json`, `convergence.json`, `diagnosis.json` and `audit.json`
leave. Read extras (what may be asked for), train_and_invert (the command), campaign_shots (records with their
campaigns), invert (one record), then the folders in the order of their imports:
results, observations, estimation, identifiability; beside them mesh_convergence, and above them
diagnosis, audit and models, which leaves `models.json`; prediction, which carries what these found to another shot.
"""
