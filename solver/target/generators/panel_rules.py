"""Rules between the keys of a stiffened panel: what needs what, and what has room beside what.

A key that so few stiffeners have no use for is no error: whoever varies their number leaves the others as they are.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from birdstrike.solver.fields import Between
from birdstrike.solver.target.generators.interface import closed_panel

ASIDE = Between("-2500 mm", "2500 mm")
SIDE_OF_PAD = Between("1 mm", "5000 mm")
LAPPED = ("lap", "rivet_pitch")
"""What a foot, a lap joint or a pad needs."""

TOUCH = 1e-9  # [m] by which sheets that touch may lie over each other

Sizes = Mapping[str, float | None]
"""Dimensions [m] by key; None where one is absent, or is itself an error."""
Stretch = tuple[float, float]


def broken_panel_rules(raw: Mapping[str, Any], sizes: Sizes, prefix: str) -> Iterator[str]:
    """One line for every rule that the table as read breaks; sizes: of it; prefix: its dotted key."""
    count = raw.get("stiffeners")
    if isinstance(count, int):
        for rule in (_stiffener_rules, _section_rules, _spacing_rules, _depth_rules):
            yield from rule(raw, sizes, prefix, count)
    yield from _lap_rules(raw, prefix)
    stretches = _stretches(raw, sizes)
    yield from _beyond_the_end(raw, sizes, prefix, stretches)
    yield from _in_the_way(raw, sizes, prefix, stretches["length"])
    yield from _pitch_rules(raw, sizes, prefix, stretches)
    yield from closed_panel(sizes["length"], sizes["radius"], f"{prefix}.radius = {raw.get('radius')}")


def _stiffener_rules(raw: Mapping[str, Any], sizes: Sizes, prefix: str, count: int) -> Iterator[str]:
    """Stiffeners have a height and a pitch, and stand on the panel."""
    if count > 0 and "height" not in raw:
        yield f'{prefix}.height is missing: {count} stiffeners need one, such as height = "40 mm"'
    if count > 1 and "pitch" not in raw:
        yield f'{prefix}.pitch is missing: {count} stiffeners need one, such as pitch = "200 mm"'
    pitch, length = sizes["pitch"], sizes["length"]
    if count > 1 and pitch is not None and length is not None and (count - 1) * pitch >= length:
        many = f"{count} stiffeners beyond {prefix}.length = {raw['length']}"
        yield f"{prefix}.pitch = {raw['pitch']} puts {many}; a smaller pitch, or fewer"


def _section_rules(raw: Mapping[str, Any], _sizes: Sizes, prefix: str, count: int) -> Iterator[str]:
    """Which flanges a section has."""
    section, riveted = raw.get("section", "blade"), "foot" in raw
    if count < 1:
        return
    if section == "Z" and not riveted:
        yield f'{prefix}.section = "Z" is riveted to the skin by its foot; give {prefix}.foot, such as foot = "20 mm"'
    if section == "blade" and riveted:
        yield f'{prefix}.foot makes a riveted stiffener, and a blade has none; choose section = "L" or "Z"'
    inner = section == "Z" or (section == "L" and not riveted)
    if inner != ("flange" in raw):
        yield (
            f'{prefix}.flange is the inner flange of section = "L" that shares the skin\'s nodes, or of section = "Z"; '
            "give both, or leave both out"
        )


def _spacing_rules(raw: Mapping[str, Any], sizes: Sizes, prefix: str, count: int) -> Iterator[str]:
    """A foot or a flange ends before the next stiffener, and the last foot on the skin."""
    pitch, half = sizes["pitch"] if count > 1 else None, 0.5 * (sizes["length"] or math.inf)
    for key in ("foot", "flange"):
        width = sizes[key]
        if width is not None and pitch is not None and width >= pitch:
            yield (
                f"{prefix}.{key} = {raw[key]} reaches the next stiffener, {prefix}.pitch = {raw['pitch']} away; a "
                f"smaller {key}, or a larger pitch"
            )
    last = 0.5 * (count - 1) * (pitch or 0.0) if count > 1 else 0.0
    end = last + (sizes["foot"] or 0.0)
    if count > 0 and sizes["foot"] is not None and last < half and end > half * (1.0 + 1e-9):
        yield (
            f"{prefix}.foot = {raw['foot']} of the last stiffener lies at {1e3 * last:.4g} .. {1e3 * end:.4g} mm along "
            f"the length, beyond the panel's end at {1e3 * half:.4g} mm, where its rivets join nothing; a smaller foot "
            "or pitch"
        )


def _depth_rules(raw: Mapping[str, Any], sizes: Sizes, prefix: str, count: int) -> Iterator[str]:
    """A riveted stiffener is higher than its foot lies, and nothing reaches the axis of a curved panel."""
    height, lap = (sizes["height"] or 0.0) if count > 0 else 0.0, sizes["lap"] or 0.0
    if count > 0 and "foot" in raw and 0.0 < height <= lap:
        yield (
            f"{prefix}.height = {raw['height']} is not above {prefix}.lap = {raw['lap']}: it counts from the skin's "
            "mid-surface, behind which the foot lies by the lap; a higher stiffener, or a smaller lap"
        )
    depth, radius = max(height, lap if "pad" in raw else 0.0) + (lap if "overlap" in raw else 0.0), sizes["radius"]
    if radius is not None and depth >= radius:
        yield (
            f"{prefix}.radius = {raw['radius']} is not above the {1e3 * depth:.4g} mm by which the panel reaches "
            "behind its skin: the shells there would cross the axis of the curvature; a larger radius, or a smaller "
            "height"
        )


def _lap_rules(raw: Mapping[str, Any], prefix: str) -> Iterator[str]:
    """Sheets that lie on each other have their distance and their rivets."""
    for key in ("foot", "overlap", "pad"):
        for needed in LAPPED:
            if key in raw and needed not in raw:
                example = "2 mm" if needed == "lap" else "25 mm"
                yield f'{prefix}.{needed} is missing: {key} needs it, such as {needed} = "{example}"'


def _in_the_way(raw: Mapping[str, Any], sizes: Sizes, prefix: str, found: Mapping[str, Stretch]) -> Iterator[str]:
    """Sheets do not lie three deep: overlap [m] and pad lie beside each other, and in a bay between stiffeners."""
    if len(found) == 2 and _lie_over(found["pad"], found["overlap"]):
        (low, high), (begin, end) = ((1e3 * x for x in found[key]) for key in ("pad", "overlap"))
        yield (
            f"{prefix}.pad = {raw['pad']} at {low:.4g} .. {high:.4g} mm along the length reaches the overlap of the "
            f"skins at {begin:.4g} .. {end:.4g} mm; make it smaller, or move it by {prefix}.pad_at"
        )
    given = raw.get("stiffeners")
    count = given if isinstance(given, int) else 0
    pitch, foot = sizes["pitch"] or 0.0, sizes["foot"] or 0.0
    for key, (low, high) in found.items():
        for i in range(count):
            place = (i - 0.5 * (count - 1)) * pitch
            if _lie_over((low, high), (place, place + foot)):
                there = f"{1e3 * place:.4g} .. {1e3 * (place + foot):.4g} mm along the length"
                yield (
                    f"{prefix}.{key} = {raw[key]} reaches a stiffener at {there}; move it into a bay "
                    f"({1e3 * low:.4g} .. {1e3 * high:.4g} mm now)"
                )


def _lie_over(one: Stretch, other: Stretch) -> bool:
    """Whether two stretches [m] have more in common than an end."""
    return one[0] < other[1] - TOUCH and one[1] > other[0] + TOUCH


def _pitch_rules(
    raw: Mapping[str, Any], sizes: Sizes, prefix: str, stretches: Mapping[str, Mapping[str, Stretch]]
) -> Iterator[str]:
    """Rivets are no farther apart than the sheet that they hold is long."""
    pitch, width = sizes["rivet_pitch"], sizes["width"]
    sides = [("pad", high - low) for found in stretches.values() for key, (low, high) in found.items() if key == "pad"]
    if width is not None and ("foot" in raw or "overlap" in raw):
        sides.append(("width", width))
    key, shortest = min(sides, key=lambda side: side[1], default=("", math.inf))
    if pitch is not None and pitch > shortest * (1.0 + 1e-9):
        yield (
            f"{prefix}.rivet_pitch = {raw['rivet_pitch']} is above the {1e3 * shortest:.4g} mm of {prefix}.{key} = "
            f"{raw[key]}, along which a row of rivets lies; at most that"
        )


def _stretches(raw: Mapping[str, Any], sizes: Sizes) -> dict[str, dict[str, Stretch]]:
    """From where to where overlap and pad lie along length and width [m]."""
    found: dict[str, dict[str, Stretch]] = {"length": {}, "width": {}}
    joint, overlap = ASIDE.valid(raw.get("joint", "0 mm")), sizes["overlap"]
    if joint is not None and overlap is not None:
        found["length"]["overlap"] = (joint - 0.5 * overlap, joint + 0.5 * overlap)
    pad, at = raw.get("pad"), raw.get("pad_at", ["0 mm", "0 mm"])
    if isinstance(pad, list) and isinstance(at, list) and len(pad) == len(at) == 2:
        for along, side, place in zip(found.values(), pad, at, strict=True):
            size, middle = SIDE_OF_PAD.valid(side), ASIDE.valid(place)
            if size is not None and middle is not None:
                along["pad"] = (middle - 0.5 * size, middle + 0.5 * size)
    return found


def _beyond_the_end(
    raw: Mapping[str, Any], sizes: Sizes, prefix: str, stretches: Mapping[str, Mapping[str, Stretch]]
) -> Iterator[str]:
    """Overlap and pad [m] along length and width lie on the panel."""
    for side, found in stretches.items():
        half = 0.5 * (sizes[side] or math.inf)
        for key, (low, high) in found.items():
            if max(-low, high) > half * (1.0 + 1e-9):
                where = "joint" if key == "overlap" else "pad_at"
                yield (
                    f"{prefix}.{key} = {raw[key]} lies at {1e3 * low:.4g} .. {1e3 * high:.4g} mm along the {side}, "
                    f"beyond the panel's end at {1e3 * half:.4g} mm; make it smaller, or move it by {prefix}.{where}"
                )
