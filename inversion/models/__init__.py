"""Every bird model calibrated to the same shots, and ranked by the error of shots that it was not calibrated to.

Cases, records and names of models enter; `models.json` leaves. Read candidates (a name -> a case with ranges), scaled
(logarithmic ranges), error_terms, points, joint_fit (one model over all shots), optimisers (the usual way beside it),
heldout (bootstrap and ranking), results, calibrate_models.
"""
