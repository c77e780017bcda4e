"""The laws of a target's materials that a case can name; a new one is a file beside this one and a line here."""

from __future__ import annotations

from birdstrike.solver.registry import Kinds
from birdstrike.solver.target.laws.bilinear import Bilinear
from birdstrike.solver.target.laws.interface import TargetMaterial
from birdstrike.solver.target.laws.johnson_cook import JohnsonCook
from birdstrike.solver.target.laws.power import Power
from birdstrike.solver.target.laws.rigid import Rigid
from birdstrike.solver.target.laws.tabulated import Tabulated

TARGET_LAWS: Kinds[TargetMaterial] = Kinds(
    "law of a target's material",
    "law",
    None,
    {
        "bilinear": Bilinear,
        "power": Power,
        "tabulated": Tabulated,
        "johnson_cook": JohnsonCook,
        "rigid": Rigid,
    },
    TargetMaterial,
)
