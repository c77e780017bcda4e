"""Rules between the fields of a case; each reads the file's own text, so that one broken field hides no other error."""

from __future__ import annotations

import math
from collections.abc import Iterator

from solver.case_bird_rules import bird_rules
from solver.case_fields import Between
from solver.case_idle_rules import idle_rules
from solver.case_overlay import Raw, at
from solver.case_plate import STRESS
from solver.case_sections import si, valid


def broken_rules(raw: Raw) -> Iterator[str]:
    """One line for every broken rule of a case as read from its file."""
    for rule in (bird_rules, idle_rules, _hardening, _panel, _preload, _times):
        yield from rule(raw)


def _hardening(raw: Raw) -> Iterator[str]:
    young, tangent = si(raw, "plate.material.young"), si(raw, "plate.material.tangent_modulus")
    if young is not None and tangent is not None and tangent >= young:
        text = at(raw, "plate.material.tangent_modulus")
        yield f"plate.material.tangent_modulus = {text} is not below young; megapascals?"


def _panel(raw: Raw) -> Iterator[str]:
    radius, length = si(raw, "plate.radius"), si(raw, "plate.length")
    if radius is not None and length is not None and length > math.pi * radius:
        given = f"plate.radius = {at(raw, 'plate.radius')}"
        yield f"{given} closes the panel beyond half a circle; length is along the arc, at most pi times the radius"


def _preload(raw: Raw) -> Iterator[str]:
    texts = at(raw, "plate.preload")
    if not isinstance(texts, list) or len(texts) != 2:
        return
    along, across = (valid(STRESS, text) or 0.0 for text in texts)
    given = f"plate.preload = {texts}"
    if (along or across) and (at(raw, "plate.edges") == "free" or si(raw, "plate.edges.in_plane") == 0.0):
        yield f"{given} needs edges that hold it in the plane; clamp or pin them, or give plate.edges.in_plane"
    if along and at(raw, "plate.radius") is not None:
        yield f"{given}: a curved panel cannot hold a tension along its arc without a pressure; leave the first at 0"
    limit = si(raw, "plate.material.yield_stress")
    if limit is not None and math.sqrt(along**2 - along * across + across**2) >= limit:
        yield f"{given} is not below plate.material.yield_stress = {at(raw, 'plate.material.yield_stress')}"


def _times(raw: Raw) -> Iterator[str]:
    end, interval = si(raw, "time.end"), si(raw, "time.output_interval")
    if end is None:
        return
    if interval is not None and interval > 0.5 * end:
        yield f"time.output_interval = {at(raw, 'time.output_interval')} leaves fewer than 3 outputs before time.end"
    snapshots = at(raw, "time.snapshots")
    early: list[str] = []
    for text in snapshots if isinstance(snapshots, list) else []:
        instant = valid(Between("0 ms", "100 ms"), text)
        if instant is None or instant <= end:
            early.append(f'"{text}"')
            continue
        yield (
            f'time.snapshots: "{text}" is after time.end = {at(raw, "time.end")}; leave it out, such as '
            f"--set time.snapshots='[{', '.join(early)}]'"
        )
