"""The kinds of equation of state that a case can name; a new one is a file beside this one and a line here."""

from __future__ import annotations

from typing import Annotated

from birdstrike.solver.bird.eos.grueneisen import Grueneisen
from birdstrike.solver.bird.eos.interface import Law
from birdstrike.solver.bird.eos.linear_polynomial import LinearPolynomial
from birdstrike.solver.bird.eos.murnaghan import Murnaghan
from birdstrike.solver.bird.eos.polynomial_k import PolynomialK
from birdstrike.solver.bird.eos.porous import Porous
from birdstrike.solver.bird.eos.table import Table
from birdstrike.solver.registry import Kinds

EQUATIONS_OF_STATE: Kinds[Law] = Kinds(
    "equation of state",
    "kind",
    None,
    {
        "grueneisen": Grueneisen,
        "linear_polynomial": LinearPolynomial,
        "murnaghan": Murnaghan,
        "polynomial_k": PolynomialK,
        "porous": Porous,
        "table": Table,
    },
    Law,
)

AnyLaw = Annotated[Law, EQUATIONS_OF_STATE]
"""Field of a material that takes any of them."""
