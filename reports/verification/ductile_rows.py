"""Rows of the ductile plate: rate hardening in steady shear, and plates under an impulse."""

from __future__ import annotations

from reports.verification.draw import Curve, Panel, draw
from reports.verification.ductile_problems import (
    RATELESS_STEEL,
    dented,
    jones_deflection,
    nurick_plate,
    shear_stress_at_rate,
)
from reports.verification.problem import Outcome, Picture, Problem, Strikes
from reports.verification.rows import Row, matches, shown
from solver.shell_material import ShellMaterial

CONSTANTS = {"mild steel, 40.4 1/s and 5": (40.4, 5.0), "aluminium, 6500 1/s and 4": (6500.0, 4.0)}
RATES = (1.0, 1e3)  # 1/s, engineering shear
COWPER = "Y (1 + (plastic rate/C)^(1/P))/sqrt3, closed form of G. R. Cowper & P. S. Symonds (1957)"
NUMBERS = (5.0, 8.0, 14.0, 20.0)  # phi
NURICK = "0.471 phi + 0.001: G. N. Nurick & J. B. Martin, Int. J. Impact Engng 8 (1989) 171"
CORRELATION = (
    "a correlation of experiments that scatter by one thickness, quoted from memory and not checked against the paper "
    "here"
)
JONES = "rigid-plastic bracket: N. Jones, Structural Impact (1989), chapter 7; quoted from memory"


def solve_rate(_: Strikes) -> Outcome:
    """Steady shear of a perfectly plastic metal at two rates."""
    rows = []
    for name, constants in CONSTANTS.items():
        metal = ShellMaterial(200e9, 0.3, 7800.0, 250e6, 0.0, 1.0, *constants)
        for rate in RATES:
            factor = 1.0 + (rate / 3.0**0.5 / constants[0]) ** (1.0 / constants[1])
            at_yield = factor * metal.yield_stress / (metal.young / 2.6)
            pair = shear_stress_at_rate(metal, rate, 60.0 * at_yield / rate / 2000)
            ours, truth = 1e-6 * float(pair.computed[0]), 1e-6 * float(pair.reference[0])
            rows.append(matches(f"shear stress at {rate:g} 1/s, {name}", ours, truth, "MPa", 1e-8, COWPER))
    return Outcome(tuple(rows))


def solve_impulse(_: Strikes) -> Outcome:
    """Permanent deflection against phi: with rate hardening against experiments, without it against Jones's bracket."""
    figure = "impulsive_plate"
    rows: list[Row] = []
    hardened, correlated, rateless = [], [], []
    for number in NUMBERS:
        pair = nurick_plate(number)
        hardened.append(float(pair.computed[0]))
        correlated.append(float(pair.reference[0]))
        gate = 10.0 if number == 14.0 else None
        name = f"impulsive plate, phi {number:g}: deflection over thickness"
        rows.append(matches(name, hardened[-1], correlated[-1], "", gate, NURICK, CORRELATION, figure))
    for number in NUMBERS:
        rateless.append(dented(RATELESS_STEEL, number).permanent)
        low, high = jones_deflection(number), jones_deflection(number, 0.618)
        note = f"bracket {low:.2f} to {high:.2f}"
        name = f"impulsive plate without rate hardening, phi {number:g}: deflection over thickness"
        rows.append(shown(name, rateless[-1], "", JONES, note, figure))
    curves = (
        Curve("Nurick & Martin, experiments", NUMBERS, correlated, truth=True),
        Curve("birdstrike, mild steel", NUMBERS, hardened),
        Curve("birdstrike, no rate hardening", NUMBERS, rateless),
        Curve("Jones, circumscribed", NUMBERS, [jones_deflection(number) for number in NUMBERS]),
        Curve("Jones, inscribed", NUMBERS, [jones_deflection(number, 0.618) for number in NUMBERS]),
    )
    panel = Panel("dimensionless impulse phi", "permanent deflection / thickness", curves)
    off = ", ".join(f"{100.0 * (a / b - 1.0):+.1f} %" for a, b in zip(hardened, correlated, strict=True))
    caption = (
        f"A clamped square plate, 89 x 89 x 1.6 mm, given a uniform velocity: {off} off the correlation at "
        f"phi {', '.join(f'{number:g}' for number in NUMBERS)}."
    )
    return Outcome(tuple(rows), (Picture(figure, draw(panel), caption),))


ABOUT = "Mild steel, 296 MPa static yield stress, perfectly plastic, on 16 x 16 shells; Cowper-Symonds 40.4 1/s and 5."
PROBLEMS = (
    Problem("rate_hardening", "Ductile plate", "", solve_rate),
    Problem("impulsive_plate", "Ductile plate", ABOUT, solve_impulse),
)
