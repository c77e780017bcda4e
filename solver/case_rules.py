"""Rules between the fields of a case; each reads the file's own text, so that one broken field hides no other error."""

from __future__ import annotations

from collections.abc import Iterator

from solver.case_bird_rules import bird_rules
from solver.case_fields import Between
from solver.case_overlay import Raw
from solver.case_sections import at, si, valid


def broken_rules(raw: Raw) -> Iterator[str]:
    """One line for every broken rule of a case as read from its file."""
    for rule in (bird_rules, _hardening, _rates, _times):
        yield from rule(raw)


def _hardening(raw: Raw) -> Iterator[str]:
    young, tangent = si(raw, "plate.material.young"), si(raw, "plate.material.tangent_modulus")
    if young is not None and tangent is not None and tangent >= young:
        text = at(raw, "plate.material.tangent_modulus")
        yield f"plate.material.tangent_modulus = {text} is not below young; megapascals?"


def _rates(raw: Raw) -> Iterator[str]:
    if si(raw, "plate.material.rate_c"):
        text = at(raw, "plate.material.rate_c")
        yield f"plate.material.rate_c = {text}: rate hardening is not available in this version; leave it out"


def _times(raw: Raw) -> Iterator[str]:
    end, interval = si(raw, "time.end"), si(raw, "time.output_interval")
    if end is None:
        return
    if interval is not None and interval > 0.5 * end:
        yield f"time.output_interval = {at(raw, 'time.output_interval')} leaves fewer than 3 outputs before time.end"
    snapshots = at(raw, "time.snapshots")
    for text in snapshots if isinstance(snapshots, list) else []:
        instant = valid(Between("0 ms", "100 ms"), text)
        if instant is not None and instant > end:
            yield f'time.snapshots: "{text}" is after time.end = {at(raw, "time.end")}'
