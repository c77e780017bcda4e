"""The LS-DYNA example of the documentation: it loads, its cards are in fixed fields and in the units they claim."""

from __future__ import annotations

from pathlib import Path

import pytest

from birdstrike.doe.external.external import external_solver
from birdstrike.doe.external.template import rendered
from birdstrike.solver.case.case import load_case

EXAMPLE = Path(__file__).parents[3] / "docs" / "external_solver" / "lsdyna.toml"


def card_below(deck: str, keyword: str) -> list[float]:
    """Numbers of the first card below a keyword, read in fields of ten characters as LS-DYNA does."""
    lines = [line for line in deck.split(f"{keyword}\n", 1)[1].splitlines() if not line.startswith("$")]
    return [float(lines[0][i : i + 10]) for i in range(0, len(lines[0]), 10)]


def test_the_example_s_cards_hold_the_reference_strike_in_kg_mm_ms() -> None:
    case = load_case(EXAMPLE)
    deck = rendered(case)
    material = case.bird.material
    number, rho, cutoff, viscosity, terod, cerod, *_ = card_below(deck, "*MAT_NULL")
    assert number == 1
    assert rho == pytest.approx(1e-9 * case.bird.actual_density, rel=1e-3)
    assert cutoff == pytest.approx(1e-9 * material.pressure_cutoff)
    assert viscosity == pytest.approx(1e-6 * material.viscosity)  # 1 GPa ms = 1e6 Pa s
    assert (terod, cerod) == (material.tension_erosion, material.compression_erosion)
    assert card_below(deck, "*EOS_GRUNEISEN")[:3] == [1.0, 1670.0, 2.48]
    velocities = card_below(deck, "*INITIAL_VELOCITY_GENERATION")[3:]
    assert velocities == pytest.approx([78.895, 0.0, -45.55], rel=1e-4)  # 91.1 m/s at 30 degrees
    assert card_below(deck, "*CONTROL_TERMINATION")[0] == 3.0
    assert card_below(rendered(case, 0.5), "*CONTROL_TIMESTEP")[1] == 0.45
    assert all(len(line) <= 80 for line in deck.splitlines() if not line.startswith(("$", "Bird of")))


def test_every_parameter_of_the_example_is_sought_with_a_second_chance() -> None:
    solver = external_solver(load_case(EXAMPLE))
    assert solver.step_factors == (1.0, 0.5)
    assert solver.version == "external: LS-DYNA R14.1 double"
