"""Rules between the fields of the bird: size and density, hardening, tabulated law, and what is sought of it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from solver.case_bird import derived
from solver.case_overlay import FROM_MASS, SIZES, Raw, at
from solver.case_sections import quantity_at, quantity_in, si


def bird_rules(raw: Raw) -> Iterator[str]:
    """One line for every broken rule about the bird of a case as read from its file."""
    if isinstance(raw.get("bird"), dict):
        for rule in (_size, _density, _length, _hardening, _table):
            yield from rule(raw)
    yield from _sought(raw)


def _given(raw: Raw, keys: tuple[str, ...]) -> list[str]:
    return [key for key in keys if at(raw, f"bird.{key}") not in (None, False)]


def _size(raw: Raw) -> Iterator[str]:
    sizes, from_mass = _given(raw, SIZES), _given(raw, FROM_MASS)
    if sizes and from_mass:
        yield f"bird.{sizes[0]} and bird.{from_mass[0]} are both given; keep one, the other follows"
    if from_mass and at(raw, "bird.mass") is None:
        yield f'bird.{from_mass[0]} needs bird.mass, such as mass = "1.8 kg"'
    slenderness = si(raw, "bird.slenderness")
    if at(raw, "bird.shape") == "sphere" and slenderness not in (None, 1.0):
        yield f"bird.slenderness = {slenderness:g} is no sphere; leave it out"


def _density(raw: Raw) -> Iterator[str]:
    mass, density = at(raw, "bird.mass"), at(raw, "bird.density")
    known = _given(raw, ("statistics",)) or at(raw, "bird.material.eos.kind") == "porous"
    if _given(raw, FROM_MASS):
        if density is not None and _given(raw, ("statistics",)):
            yield f"bird.density = {density} and bird.statistics are both given; the statistics give the density"
        if density is None and not known:
            yield 'bird.slenderness needs bird.density beside the mass, such as density = "938 kg/m^3"'
        return
    if mass is not None and density is not None:
        yield f"bird.mass = {mass} and bird.density = {density} are both given; keep one, the shape gives the other"
    if mass is None and density is None and not known:
        yield 'bird.mass or bird.density is missing; give one, such as density = "938 kg/m^3"'


def _length(raw: Raw) -> Iterator[str]:
    shape, length, diameter = at(raw, "bird.shape"), si(raw, "bird.length"), si(raw, "bird.diameter")
    found = derived(raw["bird"]) if shape == "hemispherical_cylinder" else {}
    if "length" in found and float(found["length"].split()[0]) < float(found["diameter"].split()[0]):
        yield f"bird.mass = {at(raw, 'bird.mass')} makes a bird shorter than wide; use another shape or slenderness"
    if length is None or diameter is None:
        return
    given = f"bird.length = {at(raw, 'bird.length')}"
    if shape == "hemispherical_cylinder" and length < diameter:
        yield f"{given} is less than the diameter; length is overall, hemispheres included"
    if shape == "sphere" and length != diameter:
        yield f"{given} differs from the sphere's diameter; leave it out"


def _hardening(raw: Raw) -> Iterator[str]:
    young, tangent = si(raw, "bird.material.young"), si(raw, "bird.material.tangent_modulus")
    if young is not None and tangent is not None and tangent >= young:
        text = at(raw, "bird.material.tangent_modulus")
        yield f"bird.material.tangent_modulus = {text} is not below young; megapascals?"


def _table(raw: Raw) -> Iterator[str]:
    eos = at(raw, "bird.material.eos")
    if not isinstance(eos, dict) or eos.get("kind") != "table":
        return
    given = [name for name in ("rho", "mu") if name in eos]
    if len(given) != 1:
        yield "bird.material.eos: a table is over rho or over mu; give one of them (or `file`)"
        return
    first, p = eos[given[0]], eos.get("p")
    if isinstance(first, list) and isinstance(p, list) and (len(first) != len(p) or len(p) < 3):
        yield f"bird.material.eos: {len(first)} values of {given[0]} and {len(p)} of p; as many, and at least three"


def _sought(raw: Raw) -> Iterator[str]:
    parameters: Any = at(raw, "inversion.parameters")
    for key in parameters if isinstance(parameters, dict) else ():
        if quantity_in(raw, key) is None and quantity_at(key) is not None:
            yield f'inversion.parameters."{key}" is no key of the {at(raw, "bird.material.model")} bird; leave it out'
