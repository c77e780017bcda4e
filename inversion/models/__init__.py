"""Every bird model calibrated to the same shots, and ranked by the error of shots that it was not calibrated to.

Cases, records and names of models enter; `models.json` leaves. Read calibrate_models first, then the stages: candidates
(a name -> a case with ranges), campaigns (simulations), joint_fit (one model over all shots; error_terms, points,
combinations), heldout_fits (without each shot), ranking (bootstrap), results. optimisers run beside.
"""
