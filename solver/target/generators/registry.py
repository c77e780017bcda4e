"""The generators of targets that a case can name; a new one is a file beside this one and a line here."""

from __future__ import annotations

from birdstrike.solver.registry import Kinds
from birdstrike.solver.target.generators.flat_plate import FlatPlate
from birdstrike.solver.target.generators.interface import Generator
from birdstrike.solver.target.generators.stiffened_panel import StiffenedPanel

GENERATORS: Kinds[Generator] = Kinds(
    "generator of a target", "kind", None, {"stiffened_panel": StiffenedPanel, "flat_plate": FlatPlate}, Generator
)
