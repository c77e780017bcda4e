"""Effects of the plate and its support: edges that give way, another plate, damping, initial tension."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from birdstrike.data.units import quantity_text
from birdstrike.solver.effects.effect import Declared, Effect, Table
from birdstrike.solver.fields import EDGE_SPRINGS

RATE = 100.0  # 1/s, at which plate_rate_hardening states its gain
ALUMINIUM_P = 4.0  # Cowper-Symonds exponent where the case declares no rate hardening


def bending_stiffness(case: Declared) -> float:
    """D = E h^3 / 12 (1 - nu^2) [N m] (Timoshenko & Woinowsky-Krieger, eq. 3)."""
    material = case.plate.material
    return material.young * case.plate.thickness**3 / (12.0 * (1.0 - material.poisson**2))


def first_frequency(case: Declared) -> float:
    """Angular frequency [1/s] of a clamped square plate of the shorter side, 35.99/b^2 sqrt(D/rho h) (Leissa 1969)."""
    b, plate = min(case.plate.length, case.plate.width), case.plate
    return 35.99 / b**2 * math.sqrt(bending_stiffness(case) / (plate.material.density * plate.thickness))


def _rigid(case: Declared) -> str:
    return "a rigid plate neither bends nor yields" if case.plate.rigid else ""


def _without(key: str, case: Declared) -> str:
    """Why the metal of the part that a target is struck on cannot have it; empty for a plate."""
    return _rigid(case) or ("" if case.target is None else case.target.lacks(key))


def _holds(case: Declared) -> dict[str, Any]:
    """How the edges are held: of a target every set of nodes by its name, of a plate the edge under ""."""
    return {"": case.plate.edges} if case.target is None else dict(case.target.supports)


def _compliance(held: Any, key: str) -> float:
    """Compliance of a support, a word or springs: 0 where it holds rigidly, infinite where it does not hold."""
    if not isinstance(held, str):
        stiffness = getattr(held, key)
        return 0.0 if stiffness is None else math.inf if stiffness == 0.0 else 1.0 / stiffness
    free = held == "free" or (held == "pinned" and key == "rotational")
    return math.inf if free else 0.0


def _stiffest(case: Declared, key: str, alone: str | None = None) -> float:
    """Least compliance of the supports, or of one set alone; infinite where none holds."""
    held = {name: one for name, one in _holds(case).items() if alone in (None, name)}
    return min((_compliance(one, key) for one in held.values()), default=math.inf)


def _springs(held: Any, key: str, unit: str, compliance: float) -> dict[str, str | None] | str:
    """A support with springs in series with what it declares.

    Where a compliance below 0 takes the whole declared one away, or leaves what is stiffer than a case may state, it
    holds rigidly.
    """
    springs: dict[str, str | None] = {}
    if not isinstance(held, str):
        springs |= held.texts()
    elif held == "pinned":
        springs = {"rotational": quantity_text(0.0, "N m/rad/m")}
    total = _compliance(held, key) + compliance
    rigid = total <= (1.0 / EDGE_SPRINGS[key].bounds[1] if compliance < 0.0 else 0.0)
    springs[key] = None if rigid else quantity_text(1.0 / total, unit)
    return springs if any(springs.values()) else "clamped"


def _edges(case: Declared, key: str, unit: str, compliance: float, alone: str | None = None) -> Table:
    """Springs in series with every support that holds, or with one set alone; freedoms that are free stay so."""
    given = {
        name: _springs(held, key, unit, compliance)
        for name, held in _holds(case).items()
        if alone in (None, name) and math.isfinite(_compliance(held, key))
    }
    return {"plate": {"edges": given[""]}} if case.target is None else {"target": {"supports": given}}


def _no_edges(key: str, case: Declared, alone: str | None = None) -> str:
    if alone is not None and alone not in (known := _holds(case) if case.target is not None else {}):
        sets = f"its supports are {', '.join(known)}" if known else "it has no supports by name"
        return f'the target is not held by a set of nodes "{alone}"; {sets}'
    loose = math.isinf(_stiffest(case, key, alone))
    return _rigid(case) or ("the declared edges do not hold it at all" if loose else "")


def _sets(key: str, case: Declared) -> tuple[str, ...]:
    """Sets of nodes that hold a target, where there are several; a single one is the whole support."""
    held = {} if case.target is None else _holds(case)
    holding = tuple(name for name, one in held.items() if math.isfinite(_compliance(one, key)))
    return holding if len(holding) > 1 else ()


def _support(name: str, meaning: str, of: tuple[str, str, str], size: Callable[[Any], float], source: str) -> Effect:
    """A support that gives way, all of it or one set of nodes alone; of: freedom, unit of its stiffness and of 1/it."""
    key, stiffness, unit = of

    def effect(alone: str | None) -> Effect:
        return Effect(
            name if alone is None else f"{name}.{alone}",
            meaning if alone is None else f"{meaning}, at {alone} alone",
            unit,
            lambda case, x: _edges(case, key, stiffness, x, alone),
            size,
            lambda case: -_stiffest(case, key, alone),
            lambda case: _no_edges(key, case, alone),
            "support",
            source,
        )

    return replace(effect(None), places=lambda case: _sets(key, case), alone=effect)


def _material(case: Declared, key: str, unit: str, change: float) -> Table:
    value = getattr(case.plate.material, key) + change
    return {"plate": {"material": {key: quantity_text(value, unit)}}}


def _gain(case: Declared) -> float:
    """Declared relative gain of the yield stress at 100 1/s, (RATE/C)^(1/p)."""
    material = case.plate.material
    return (RATE / material.rate_c) ** (1.0 / material.rate_p) if material.rate_c else 0.0


def _weakest(case: Declared) -> float:
    """The change down to the least gain that is one: that of the largest C; 0 where none is declared."""
    material = case.plate.material
    return (RATE / LARGEST_C) ** (1.0 / material.rate_p) - _gain(case) if material.rate_c else 0.0


def _rate_hardening(case: Declared, change: float) -> Table:
    """Cowper-Symonds sigma_y [1 + (rate/C)^(1/p)] with C = RATE / gain^p."""
    gain, p = _gain(case) + change, case.plate.material.rate_p if case.plate.material.rate_c else ALUMINIUM_P
    c = RATE / gain**p if gain > 0.0 else 0.0
    return {"plate": {"material": {"rate_c": quantity_text(c, "1/s"), "rate_p": p}}}


def _preload(case: Declared, change: float) -> Table:
    return {"plate": {"preload": [quantity_text(value + change, "Pa") for value in case.plate.preload]}}


def _curved(case: Declared) -> str:
    return "a curved panel holds no tension along its arc" if case.plate.radius is not None else ""


def _rivets(case: Declared, change: float) -> Table:
    """All strengths of all rows, times 1 + change."""
    scaled = {
        name: {
            key: quantity_text(getattr(row, key) * (1.0 + change), "N")
            for key in ("tension_strength", "shear_strength")
        }
        for name, row in case.target.rivets.items()
    }
    return {"target": {"rivets": scaled}}


LARGEST_C = 1e29
"""Of Cowper and Symonds [1/s], within the range of `plate.material.rate_c`."""
PLATE = (
    _support(
        "clamp_rotation",
        "a clamp that lets the plate's edges rotate",
        ("rotational", "N m/rad/m", "rad/N"),
        lambda case: 0.25 * min(case.plate.length, case.plate.width) / (4.0 * bending_stiffness(case)),
        "rotational springs along the edge: Leissa, Vibration of Plates, NASA SP-160 (1969), sect. 4.5; compliance, "
        "1/stiffness per length of edge, so that 0 is the rigid clamp",
    ),
    _support(
        "edge_slip",
        "a frame that lets the plate's edges slip inwards",
        ("in_plane", "Pa", "m^2/N"),
        lambda case: (
            0.5 * min(case.plate.length, case.plate.width) / (case.plate.material.young * case.plate.thickness)
        ),
        "springs in the plate's plane along the edge; compliance against the plate's own, b / E h",
    ),
    Effect(
        "plate_thickness",
        "a plate thicker or thinner than stated",
        "m",
        lambda case, x: {"plate": {"thickness": quantity_text(case.plate.thickness + x, "m")}},
        lambda case: 0.02 * case.plate.thickness,
        lambda case: -case.plate.thickness,
        _rigid,
        "plate",
        "rolling tolerance of sheet, EN 485-3: about 2 to 5 % of the thickness",
        scope="plate",
    ),
    Effect(
        "plate_modulus",
        "a plate of another Young's modulus",
        "Pa",
        lambda case, x: _material(case, "young", "Pa", x),
        lambda case: 0.02 * case.plate.material.young,
        lambda case: -case.plate.material.young,
        _rigid,
        "plate",
        "values of one alloy's modulus in handbooks differ by 1 to 3 %",
        scope="plate",
    ),
    Effect(
        "plate_density",
        "a plate heavier or lighter than its declared density",
        "kg/m^3",
        lambda case, x: _material(case, "density", "kg/m^3", x),
        lambda case: 0.02 * case.plate.material.density,
        lambda case: -case.plate.material.density,
        _rigid,
        "plate",
        "paint, cladding, cables and targets of the instruments: 1 to 3 % of the plate's mass",
        scope="plate",
    ),
    Effect(
        "plate_yield",
        "a plate of another yield stress",
        "Pa",
        lambda case, x: _material(case, "yield_stress", "Pa", x),
        lambda case: 0.1 * case.plate.material.yield_stress,
        lambda case: -case.plate.material.yield_stress,
        lambda case: _without("yield_stress", case),
        "plate",
        "scatter of the yield stress between batches",
        scope="plate",
    ),
    Effect(
        "plate_hardening",
        "a plate that hardens otherwise",
        "Pa",
        lambda case, x: _material(case, "tangent_modulus", "Pa", x),
        lambda case: 0.03 * case.plate.material.young,
        lambda case: -case.plate.material.tangent_modulus,
        lambda case: _without("tangent_modulus", case),
        "plate",
        "tangent modulus of the bilinear stress-strain curve",
        scope="plate",
    ),
    Effect(
        "plate_rate_hardening",
        "a plate whose yield stress rises with strain rate",
        "",
        _rate_hardening,
        lambda _: 0.2,
        _weakest,
        lambda case: _without("rate_c", case),
        "plate",
        "Cowper & Symonds (1957), stated as the relative gain of the yield stress at 100 1/s; p = 4 as for aluminium "
        "(Jones, Structural Impact, sect. 8.3) unless the case declares another",
        scope="plate",
    ),
    Effect(
        "plate_damping",
        "damping of the plate",
        "1/s",
        lambda case, x: {"plate": {"damping": quantity_text(case.plate.damping + x, "1/s")}},
        lambda case: 0.05 * first_frequency(case),
        lambda case: -case.plate.damping,
        _rigid,
        "plate",
        "mass-proportional; size: 5 % of critical in the first mode",
    ),
    Effect(
        "plate_preload",
        "tension or compression in the clamped plate before the impact",
        "Pa",
        _preload,
        lambda case: (
            10.0 * bending_stiffness(case) / (min(case.plate.length, case.plate.width) ** 2 * case.plate.thickness)
        ),
        lambda _: -math.inf,
        lambda case: _without("preload", case) or _no_edges("in_plane", case) or _curved(case),
        "support",
        "membrane stress, alike both ways; size: a fifth of what buckles a clamped square (Timoshenko & Gere, 1961)",
        level=0.5,  # at a tenth of the buckling load the first frequency's square changes by a tenth (Leissa, 10.4)
    ),
    Effect(
        "rivet_strength",
        "rivets stronger or weaker than stated",
        "",
        _rivets,
        lambda _: 0.2,
        lambda _: -0.999,
        lambda case: "" if case.target is not None and case.target.rivets else "the target has no rivets",
        "plate",
        "relative change of the strengths in tension and shear of all rivets; size: scatter of single-lap joints",
        scope="plate",
    ),
)
