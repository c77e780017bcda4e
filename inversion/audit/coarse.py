"""The same diagnosis with a coarse emulator: one that knows only the first runs of the campaign."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from birdstrike.inversion.diagnosis.groundwork import Groundwork
from birdstrike.inversion.diagnosis.judge import Judge, Judged

from birdstrike.inversion.audit.carried import Models, struck
from birdstrike.inversion.diagnosis.ranking import again
from birdstrike.surrogate.emulator import fit_emulator

FEW = 12


def coarse(ground: Groundwork) -> Groundwork:
    """The case made ready from the first twelve runs of its campaign; effects and numerical error are as they were."""
    whole = ground.dataset
    curves = {name: rows[:FEW] for name, rows in whole.curves.items()}
    few = replace(
        whole, runs=whole.runs[:FEW], parameters=whole.parameters[:FEW], curves=curves, smooth=whole.smooth[:FEW]
    )
    return replace(ground, dataset=few, emulator=fit_emulator(few, ground.clock.channels))


def coarse_models(ground: Groundwork, judge: Judge, models: Models) -> tuple[Judge, dict[str, Judged]]:
    """The models of `judge`'s record refitted with the coarse emulator of `ground`.

    Those that the solver had corrected are corrected at the same place to what it said there; the others carry the
    coarse emulator's own, larger error.
    """
    blunt = replace(judge, groundwork=ground)
    unasked = blunt.start()[0].problem.whitener
    found = {}
    for name, one in models.items():
        problem = one.fit.problem
        model = replace(problem.model, emulator=ground.emulator, correction=0.0)
        if struck(one):
            off = problem.model.grid(one.fit.place, one.fit.box) - model.grid(one.fit.place, one.fit.box)
            problem = replace(problem, model=replace(model, correction=np.asarray(off)[0]))
        else:
            problem = replace(problem, model=model, whitener=unasked)
        found[name] = blunt.judged(name, again(one.fit, problem), one.confirmed, one.doubt)
    return blunt, found
