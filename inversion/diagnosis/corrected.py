"""What the solver is asked about a fit, and how its answer moves the model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.model import Place
from birdstrike.inversion.diagnosis.model_error import doubted
from birdstrike.inversion.diagnosis.refit import Fit

SMALLEST, SHOWS = 1.0, 1.5  # plausible sizes: a smaller fitted effect is struck at the second instead


def places(fit: Fit) -> tuple[Array, ...]:
    """Effects b (m,) at which the solver is asked: without the fit's own effect, and with it, large enough to show."""
    known = fit.problem.model.known
    without = fit.b.copy()
    without[list(fit.own)] -= fit.magnitudes
    if len(fit.own) != 1 or known[fit.own[0]].of_record:
        return (fit.b,)
    own, size = known[fit.own[0]], float(fit.magnitudes[0])
    wanted = size if abs(size) >= SMALLEST else float(np.copysign(SHOWS, size))
    shown = without.copy()
    shown[fit.own[0]] += np.clip(wanted, own.least, own.most)
    return without, shown


def corrected(fit: Fit, told: list[tuple[Array, Array]]) -> Fit:
    """The fit with a model nearer to what the solver said: (effects b (m,), curves (grid,)) without and with its own.

    A single strike is as rough as the emulator's runs were, what an effect does to it as rough as lattices are; the
    model moves by what stands above that.
    """
    model, z = fit.problem.model, fit.place.z
    b, curve = told[0]
    off = curve - model.grid(Place(z, b[None]), fit.box)[0]
    model = replace(model, correction=model.correction + doubted(model, fit.theta, off) * off)
    for there, seen in told[1:]:
        own, size = model.known[fit.own[0]].name, float((there - b)[fit.own[0]])
        missing = (seen - curve) - (
            model.grid(Place(z, there[None]), fit.box) - model.grid(Place(z, b[None]), fit.box)
        )[0]
        response = model.responses[own].told(missing / size, size, len(model.clock.channels))
        model = replace(model, responses={**model.responses, own: response})
    return replace(fit, problem=replace(fit.problem, model=model))


def shift_of(before: Fit, after: Fit) -> float:
    """RMS by which the refit moved the corrected curve, in its own standard deviations."""
    model = after.problem.model
    change = model.points(after.place, after.box) - model.points(before.place, before.box)
    return float(np.sqrt(np.mean(after.problem.whitener.apply(change[0]) ** 2)))


def unsettled(shift: float, moved: float) -> str:
    """Empty where the refit stayed where the solver was asked."""
    return f"its last refit still moved the curve by {shift:.1f} standard deviations" if shift > moved else ""
