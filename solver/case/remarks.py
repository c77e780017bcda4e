"""What the user should know of a valid case before it is run, and a parameter that it could be asked for."""

from __future__ import annotations

from collections.abc import Iterator
from functools import reduce

from birdstrike.solver.case.case import Case
from birdstrike.solver.case.sections import quantities
from birdstrike.solver.fields import Between

REST = 1e-6  # of the bulk modulus: a pressure at rest below it is rounding
SAME_DENSITY = 1e-3
AT_REST = ("p0", "C0", "E0")
"""Keys of the laws that may give a bird a pressure in flight."""


def remarks(case: Case) -> list[str]:
    """Sentences about what is allowed and seldom meant."""
    return [*_pressure_at_rest(case), *_other_density(case)]


def _pressure_at_rest(case: Case) -> list[str]:
    """Nothing holds a bird in flight: a pressure at rest is released from its surface, at p/(rho c)."""
    law = case.bird.material.law
    if law is None:
        return []
    eos = law.build(case.bird.actual_density)
    p = eos.pressure_at_rest
    if not eos.sound_speed > 0.0:
        return []  # refused when the bird is built
    if abs(p) <= REST * eos.bulk_modulus:
        return []
    given = [f"bird.material.eos.{name}" for name in AT_REST if getattr(law, name, 0.0)]
    remedy = f"set {' and '.join(given)} to 0" if given else "let the table's pressure be 0 at the bird's density"
    does = "bursts" if p > 0.0 else "shrinks"
    speed = abs(p) / (eos.rho0 * eos.sound_speed)
    return [
        f"the bird's law has {1e-6 * p:.3g} MPa at rest and nothing holds that in flight: the bird {does} before it "
        f"touches the plate, its surface at {speed:.2g} m/s; {remedy}"
    ]


def _other_density(case: Case) -> list[str]:
    """A porous law has a density of its own; that of the bird may be another, by its mass or as it stands."""
    law, density = case.bird.material.law, case.bird.actual_density
    own = None if law is None else law.own_density
    if own is None or abs(density - own) <= SAME_DENSITY * own:
        return []
    return [
        f"the bird's density is {density:.4g} kg/m^3, that of its porous mixture {own:.4g} kg/m^3: its sound speed and "
        "shock are not that mixture's; leave bird.density (or the mass or statistics that give it) out, or change "
        "bird.material.eos.z"
    ]


def example_parameter(case: Case) -> str:
    """Lines of a case file that seek a constant of this bird's own model, from half of its value to twice that."""
    found = list(_constants(case))
    key, mark, value = next((entry for entry in found if entry[0].endswith(".viscosity")), found[0])
    low, high = mark.bounds
    ends = sorted(min(max(factor * value, low), high) for factor in (0.5, 2.0))
    quote = '"' if mark.unit else ""
    span = ", ".join(f"{quote}{mark.display(end)}{quote}" for end in ends)
    return f'[inversion.parameters."{key}"] range = [{span}]'


def _constants(case: Case) -> Iterator[tuple[str, Between, float]]:
    """Key, mark and value of the material's constants that are not 0; every material has some."""
    material = case.bird.material.model_dump()
    for key, mark in quantities({"bird": {"material": material | {"model": case.bird.material.model}}}):
        if key.startswith("bird.material."):
            value = reduce(lambda table, part: table.get(part) or {}, key.split(".")[2:], material)
            if isinstance(value, float) and value:
                yield key, mark, value
