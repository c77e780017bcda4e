"""Analytic solutions that the solver is verified against: physical constants enter, closed forms or series leave.

hugoniot: planar shocks; wilbeck: pressures of a bird on a rigid target; plate_ritz: bending of plates;
plate_membrane: deflection with membrane forces. Tests and the verification report read them; the solver does not.
"""
