"""The bird models side by side: constants, errors, the state at the end, and the curves of every sensor."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from birdstrike.data.histories import Array, Histories
from birdstrike.reports.blocks import Block, Paragraph, Picture, Section, Warnings, drawing
from birdstrike.reports.comparison.clock import on_clock
from birdstrike.reports.comparison.end_state import impulse, sensor_of_kind
from birdstrike.reports.comparison.models import STANDARD
from birdstrike.reports.figures.load_cells import load_cells_figure
from birdstrike.reports.figures.models import RUNNING, ModelCurve, models_figure
from birdstrike.reports.figures.quantities import quantity, reading, shown_span, significant, words
from birdstrike.reports.results.findings import percent
from birdstrike.reports.results.measurement import origin, peak, record_peak
from birdstrike.reports.results.results import Model, Results
from birdstrike.reports.sections.curves import noise, record_curve
from birdstrike.reports.sections.models_tables import constants_table, end_state_table, errors_table, scores
from birdstrike.solver.sensors.reaction_force import ReactionForce
from birdstrike.solver.sensors.sensor import torn


def section(results: Results) -> Section:
    """Words, tables, then one figure a sensor."""
    blocks: list[Block] = [Paragraph(_words(results))]
    if warned := tuple(_warnings(results)):
        blocks.append(Warnings(warned))
    tables = (errors_table(results), end_state_table(results), constants_table(results))
    figures = (_figure(results, channel) for channel in _channels(results))
    cells = [_load_cells(results)] if len(_cells(results)) > 1 else []
    return Section("models", "The bird models side by side", (*blocks, *tables[:1], *figures, *cells, *tables[1:]))


def _cells(results: Results) -> tuple[str, ...]:
    """Sensors that read the reaction of one set of supports in the push, where a simulation of the inverted bird has
    them: impulses along other directions are no share of the frame's."""
    run = results.models[results.best].run if results.best in results.models else None
    pushed = {n: s for n, s in results.case.sensors.items() if isinstance(s, ReactionForce) and s.along is None}
    return tuple(n for n, s in pushed.items() if s.support is not None and run is not None and n in run.channels)


def _load_cells(results: Results) -> Picture:
    """All load cells in one picture, of the inverted bird; a cell of the record has its own figure beside it."""
    model, names = results.models[results.best], _cells(results)
    assert model.run is not None
    run = model.run
    cells = {name: run.channels[name] for name in names}
    whole = sensor_of_kind(results.case, run, "reaction_force")
    figure = load_cells_figure(run.time, cells, None if whole is None else run.channels[whole])
    parts = []
    for name, force in cells.items():
        at, top = peak(run.time, force)
        given = significant(_given(run, force))
        parts.append(f"{words(name)} {quantity(top, 'N')} at {quantity(at, 's')}, {given} N s")
    shared = sum(_given(run, force) for force in cells.values())
    text = (
        f"Load cells, simulated with the {model.title} bird, as computed. "
        f"Peak and impulse of each: {'; '.join(parts)}. Impulse of all: {significant(shared)} N s."
    )
    return drawing("load-cells", figure, text)


def _given(run: Histories, force: Array) -> float:
    """Impulse of a force up to the end [N s]."""
    return float(impulse(run.time, force)[-1])


def _warnings(results: Results) -> Iterator[str]:
    """Failed simulations, and the standard birds' warnings; those of the inverted bird stand in the summary."""
    for model in results.simulated_models.values():
        if model.run is None:
            why = "it cannot be simulated" if model.case is None else "its simulation failed"
            yield f"The {model.title} bird has no curve, {why}: {model.failure}"
        elif model.key in STANDARD:
            yield from (f"{model.title} bird: {line}" for line in model.run.summary.get("warnings", ()))


def finished(results: Results) -> Mapping[str, Histories]:
    """Models whose simulation finished, by key."""
    return {key: model.run for key, model in results.models.items() if model.run is not None}


def nearest(results: Results) -> str:
    """`RMS error of the 4 bird models ...: nearest is ..., 6.5 %; then ..., 15 %`; nothing with less than two."""
    channel = sound_channel(results)
    found = {model: entry.share for (model, c), entry in scores(results).items() if c == channel}
    order = sorted(found, key=lambda key: found[key])
    if len(order) < 2:
        return ""
    first, *others = (f"{results.models[key].title}, {percent(found[key])}" for key in order)
    return (
        f"RMS error of the {len(order)} bird models in {words(channel)}, of the record's peak: nearest is "
        f"{first}; then {'; '.join(others)}."
    )


def sound_channel(results: Results) -> str:
    """The record's first sensor whose shell no simulation tore away, the first of all where each has lost its own."""
    told = {line for run in finished(results).values() for line in run.summary.get("warnings", ())}
    sound = (name for name in results.channels if torn(name) not in told)
    return next(sound, results.channels[0])


def _words(results: Results) -> str:
    """What was simulated, and which model comes nearest."""
    count = len(finished(results))
    if count == 1:
        alone = "Only the inverted bird was simulated for this page"
        if results.simulated_models:
            return f"{alone}; the warnings say why the elastic, plastic-kinematic and hydrodynamic birds have no curve."
        others = "the elastic, plastic-kinematic and hydrodynamic birds"
        return f"{alone}; without --no-models, birdstrike report adds {others}."
    return (
        f"The same impact with {count} bird models: the standard ones with the paper's constants, the inverted one at "
        f"its calibrated parameters; shape, mass, speed, plate and mesh are the case's. {ranking(results)} "
        f"{results.filter_text}"
    ).rstrip()


def ranking(results: Results) -> str:
    """Models by their error in one sensor; the table has the others."""
    channel = sound_channel(results)
    found = {m: s for (m, c), s in scores(results).items() if c == channel}
    unit = results.record.units[channel]
    parts = [
        f"{results.models[key].title} {reading(found[key].rms, unit)} ({percent(found[key].share)} of the peak)"
        for key in sorted(found, key=lambda key: found[key].rms)
    ]
    others = " The table has the other sensors." if len(results.channels) > 1 else ""
    return f"RMS error of {words(channel)} against the record, least first: {'; '.join(parts)}.{others}"


def _channels(results: Results) -> tuple[str, ...]:
    """Channels of the record first, then the case's other sensors."""
    together = _cells(results) if len(_cells(results)) > 1 else ()
    others = tuple(name for name in results.case.sensors if name not in (*results.channels, *together))
    run = next(iter(finished(results).values()), None)
    return (*results.channels, *(name for name in others if run is not None and name in run.channels))


def _figure(results: Results, channel: str) -> Picture:
    recorded = channel in results.channels
    unit = results.case.sensors[channel].unit
    curves = [_curve(results, model, channel) for model in results.models.values() if model.run is not None]
    record = None
    if recorded:
        record = record_curve(results, channel)
    ends = [float(curve.time[-1]) for curve in curves]
    span = shown_span(results.record.time, max(ends)) if recorded else (0.0, min(ends))
    momentum = results.case.bird.actual_mass * results.case.normal_speed
    figure = models_figure(channel, unit, curves, record, momentum, span)
    return drawing(f"models-{channel}", figure, _caption(results, channel, curves, momentum))


def _curve(results: Results, model: Model, channel: str) -> ModelCurve:
    """A model's curve on the record's clock where the record has the channel, on its own where not."""
    assert model.run is not None
    run, recorded = model.run, channel in results.channels
    offset = model.offset if recorded else 0.0
    values = run.channels[channel]
    return ModelCurve(
        key=model.key,
        title=model.title,
        time=run.time + offset,
        values=values,
        at_record=on_clock(run, channel, results.record.time, offset) if recorded else None,
        impulse=impulse(run.time, values) if run.units[channel] == "N" else None,
        leading=model.key not in STANDARD,
    )


def _caption(results: Results, channel: str, curves: list[ModelCurve], momentum: float) -> str:
    """Peaks and impulses, all simulated, and what the lower panel shows."""
    unit, parts = results.case.sensors[channel].unit, []
    side = record_peak(results, channel).side if channel in results.channels else 0.0
    for curve in curves:
        at, top = peak(curve.time, curve.values, side)
        text = f"{curve.title} {reading(top, unit)} at {quantity(at, 's')}"
        if curve.impulse is not None:
            given = float(curve.impulse[-1])
            text += f", impulse {significant(given)} N s ({percent(given / momentum, 3)} of the bird's normal momentum)"
        parts.append(text)
    text = f"Simulated {words(channel)} by bird model. Peaks: {'; '.join(parts)}."
    if any(curve.impulse is not None for curve in curves):
        text += f" Bold: running mean over {quantity(RUNNING, 's', 2)}; faint: as computed."
    if channel in results.channels:
        band = noise(results, channel)
        text += f" The record ({origin(results.record)}) has its peak of {record_peak(results, channel).text}; below: "
        text += "simulated minus record."
        if band is not None:
            text += f" Grey: ±2σ of the record's noise ({reading(2 * float(np.max(band)), unit, 2)})."
    else:
        text += " The record has no such channel."
    return text
