"""Wilbeck's problem, a soft cylinder end on against a rigid plate: its pressures and times in theory, and from a curve.

J. S. Wilbeck, AFML-TR-77-134 (1978): a shock of Hugoniot pressure, released from the edge, then steady flow.
"""

from __future__ import annotations

import numpy as np

from birdstrike.data.histories import Array


def hugoniot_pressure(density: float, c0: float, k: float, speed: float) -> float:
    """p_H = rho0 (c0 + k u0) u0 [Pa] of a plane impact at u0 [m/s], shock speed u_s = c0 + k u0 [m/s]."""
    return density * (c0 + k * speed) * speed


def stagnation_pressure(density: float, speed: float) -> float:
    """p_s = rho u0^2/2 [Pa] at the centre of the steady, incompressible jet."""
    return 0.5 * density * speed**2


def duration(length: float, speed: float) -> float:
    """t_D = L/u0 [s]: the time in which the bird flies its own length."""
    return length / speed


def steady_mean(time: Array, pressure: Array, first_contact: float, duration: float) -> float:
    """Mean of a pressure history from t_D/3 to 2 t_D/3 after first contact, trapezoidal. All in SI.

    Raises ValueError when the history ends earlier.
    """
    early, late = first_contact + duration / 3.0, first_contact + 2.0 * duration / 3.0
    if time[-1] < late * (1.0 - 1e-9):
        raise ValueError(f"the history ends at {time[-1]:.3g} s, before 2 t_D/3 at {late:.3g} s")
    inside = (time > early) & (time < late)
    t = np.concatenate([[early], time[inside], [late]])
    return float(np.trapezoid(np.interp(t, time, pressure), t) / (late - early))


def peak(time: Array, pressure: Array) -> tuple[float, float]:
    """Largest pressure [Pa] and its time [s]; of a gauge, below Hugoniot's as its disc and sampling average."""
    at = int(np.argmax(pressure))
    return float(pressure[at]), float(time[at])
