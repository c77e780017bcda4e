"""Tables of the bird models: constants, errors against the record, state of bird and plate at the end."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from birdstrike.data.formatting import listing
from birdstrike.data.units import rounded
from birdstrike.reports.blocks import Table
from birdstrike.reports.comparison.end_state import impulse, penetration, residual_deflection, sensor_of_kind
from birdstrike.reports.comparison.iso18571 import SAMPLES
from birdstrike.reports.comparison.scores import Score, score
from birdstrike.reports.figures.quantities import (
    bound,
    quantity,
    reading,
    signed_quantity,
    signed_reading,
    significant,
    words,
)
from birdstrike.reports.results.findings import percent
from birdstrike.reports.results.measurement import hidden_peaks, origin, record_peak
from birdstrike.reports.results.results import Model, Results
from birdstrike.solver.case.sections import quantity_at

NONE = "–"


def scores(results: Results, *, shaped: bool = False) -> dict[tuple[str, str], Score]:
    """Score by (model, channel) of every finished model and every channel of the record that it meets, at the points
    that the fit used.

    shaped: with magnitude, phase and rating.
    """
    used = results.used
    found = {
        (key, channel): score(
            used.time,
            used.channels[channel],
            model.run,
            channel,
            model.offset,
            shaped=shaped,
        )
        for key, model in results.models.items()
        for channel in results.channels
        if model.run is not None
    }
    return {place: entry for place, entry in found.items() if entry is not None}


def errors_table(results: Results) -> Table:
    """One row a model and channel."""
    head = (
        "bird model",
        "RMS error",
        "of the peak",
        "peak error",
        "peak time",
        "Sprague-Geers M",
        "Sprague-Geers P",
        "ISO/TS 18571",
    )
    rated = scores(results, shaped=True)
    rows = tuple(_errors(results, results.models[key], channel, entry) for (key, channel), entry in rated.items())
    shifted = any(results.models[key].offset for key, _ in rated)
    if shifted:
        head = (*head, "clock set later by")
        offsets = (signed_quantity(results.models[key].offset, "s") for key, _ in rated)
        rows = tuple((*row, offset) for row, offset in zip(rows, offsets, strict=True))
    clock = (
        " Clock: by how much each simulation was set later to fit, within what is known of the record's trigger."
        if shifted
        else ""
    )
    sparse = min(int(np.isfinite(values).sum()) for values in results.used.channels.values())
    note = (
        f" M, P and the ISO score need the curve between the record's points; with {sparse} of them it is the straight "
        "line from each to the next, so that the slope part also counts what lies between the points."
        if sparse < SAMPLES // 4
        else ""
    )
    caption = (
        f"Errors of the simulated curves against the record ({origin(results.record)}). Peak and its time: simulated "
        f"less record (in brackets of the record's peak, + where the simulated one is larger), both at the record's "
        f"instants{hidden_peaks(results)}. M, P: magnitude and phase after Sprague "
        "and Geers, 0 is perfect; – where a stretch of the curve is not known. "
        f"ISO/TS 18571: 1 is perfect, above 0.94 excellent, 0.80 good, 0.58 fair.{note}{clock}"
    )
    return Table(head, rows, caption, frozenset(range(1, len(head))))


def _errors(results: Results, model: Model, channel: str, entry: Score) -> tuple[str, ...]:
    unit = results.record.units[channel]
    name = model.title + (f", {words(channel)}" if len(results.channels) > 1 else "")
    rating, clipped = entry.rating, record_peak(results, channel).clipped
    return (
        name,
        reading(entry.rms, unit),
        percent(entry.share),
        NONE if clipped else f"{signed_reading(entry.peak, unit)} ({_signed_share(entry.peak_share)})",
        NONE if clipped else signed_quantity(entry.peak_time, "s"),
        NONE if entry.magnitude is None else _signed_share(entry.magnitude),
        NONE if entry.phase is None else percent(entry.phase),
        NONE if rating is None else f"{rating.overall:.3f} {rating.grade}",
    )


def _signed_share(share: float) -> str:
    text = percent(share)
    return f"+{text}" if share > 0 else text


def end_state_table(results: Results) -> Table:
    """One row a model: impulse, peak forces, deflection that stays, penetration, erosion, energy error."""
    head = (
        "bird model",
        "peak contact force",
        "impulse on the plate",
        "impulse on the frame",
        "residual deflection",
        "penetration",
        "bird eroded",
        "energy error",
    )
    rows = tuple(_end_state(results, model) for model in results.models.values() if model.run is not None)
    momentum = results.case.bird.actual_mass * results.case.normal_speed
    reasons: dict[str, list[str]] = {}
    for model in results.models.values():
        found = _residual(model)
        if found is not None and found[0] is None:
            reasons.setdefault(found[1], []).append(model.title)
    caption = (
        f"State at the end of the simulations, {quantity(results.case.time.end, 's')}. Shares "
        f"are of the bird's normal momentum, {rounded(momentum, 3)} N s. Residual deflection: 0 where the plate never "
        "yielded, else the mean over the plate's last period once the bird has left"
        + "".join(f"; – : {listing(titles)}, {reason}" for reason, titles in reasons.items())
        + "."
    )
    return Table(head, rows, caption, frozenset({1, 2, 3, 4, 6, 7}))


def _end_state(results: Results, model: Model) -> tuple[str, ...]:
    assert model.run is not None
    case, run = results.case, model.run
    momentum = case.bird.actual_mass * case.normal_speed
    contact = sensor_of_kind(case, run, "contact_force")
    residual = _residual(model)
    energy = run.summary.get("energy_error")
    eroded = run.summary.get("eroded_mass_fraction")
    return (
        model.title,
        NONE if contact is None else quantity(float(run.channels[contact].max()), "N"),
        *(_impulse(model, kind, momentum) for kind in ("contact_force", "reaction_force")),
        NONE if residual is None else quantity(residual[0], "m") if residual[0] is not None else NONE,
        penetration(case, run) if run.summary else NONE,
        NONE if eroded is None else percent(float(eroded)),
        NONE if energy is None else _signed_share(float(energy)),
    )


def _residual(model: Model) -> tuple[float | None, str] | None:
    """Residual deflection at the case's first displacement sensor; None without one."""
    if model.run is None or model.case is None or not model.run.summary:
        return None
    channel = sensor_of_kind(model.case, model.run, "displacement")
    return None if channel is None else residual_deflection(model.case, model.run, channel)


def _impulse(model: Model, kind: str, momentum: float) -> str:
    assert model.run is not None
    sensor = None if model.case is None else sensor_of_kind(model.case, model.run, kind)
    if sensor is None:
        return NONE
    given = float(impulse(model.run.time, model.run.channels[sensor])[-1])
    return f"{significant(given)} N s ({percent(given / momentum, 3)})"


def constants_table(results: Results) -> Table:
    """One row a model: its law and every constant with its unit."""
    rows = tuple((model.title, _constants(model)) for model in results.models.values() if model.case is not None)
    caption = (
        "The constants behind the models. The standard birds: Tables 10 to 13 of Shock and Vibration 2022, art. "
        "2456777, from the shipped cases reference_strike_*; the inverted bird: the point at which its answer was "
        "verified, of which only the identified parameters are results."
    )
    return Table(("bird model", "constants"), rows, caption)


def _constants(model: Model) -> str:
    assert model.case is not None
    material = model.case.canonical()["bird"]["material"]
    return ", ".join(_flat(material, "bird.material."))


def _flat(tree: Mapping[str, Any], before: str) -> Iterator[str]:
    """`young 68.9 MPa` of every constant that is not zero."""
    for name, value in tree.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{before}{name}.")
        elif isinstance(value, str):
            yield "NULL" if value == "null" else words(value)
        elif isinstance(value, int | float) and not isinstance(value, bool) and value != 0:
            mark = quantity_at(before + name)
            yield f"{words(name)} {bound(float(value), '' if mark is None else mark.unit)}"
