"""Bird models calibrated to the same shots: the answer, errors by speed, constants, curves, what it rests on."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from birdstrike.data.curves import Measured
from birdstrike.data.formatting import plain, quantity, reading, span
from birdstrike.data.histories import Histories
from birdstrike.data.units import rounded
from birdstrike.inversion.misfit import rms
from birdstrike.inversion.models.results import ModelAnswer, ModelComparison
from birdstrike.inversion.results.ingredients import MeasuredFigures
from birdstrike.reports.blocks import Block, Paragraph, Section, Table, Warnings, drawing
from birdstrike.reports.figures.calibrated_models import curves_figure, heldout_figure
from birdstrike.reports.figures.quantities import parameter_label
from birdstrike.reports.sections.curves import fitted_curve

MOST_CHANNELS = 3  # of a shot, that are drawn
NONE = "–"


@dataclass(frozen=True)
class ModelsResults:
    """records: shot -> record above rest; calibrated, published: shot -> model -> curves; program: whose."""

    found: ModelComparison
    records: Mapping[str, Measured]
    calibrated: Mapping[str, Mapping[str, Histories]]
    published: Mapping[str, Mapping[str, Histories]]
    program: str

    @property
    def ranked(self) -> list[str]:
        """Models with an answer, best first."""
        return list(self.found.ranking)

    def title(self, shot: str) -> str:
        """`s70, 70 m/s`."""
        return f"{shot}, {self.found.speeds[shot]:g} m/s"


def answer_section(results: ModelsResults) -> Section:
    """Which model predicts best, overall and at each speed."""
    found = results.found
    lines = [f"{results.title(shot)}: {said}." for shot, said in found.per_shot_sentences.items()]
    blocks: list[Block] = [Paragraph(f"{found.sentence}."), *map(Paragraph, lines)]
    if found.warnings:
        blocks.append(Warnings(found.warnings))
    by = (
        "Each shot is predicted by the solver with the constants that the other shots gave"
        if found.heldout_by == "shot"
        else "Each third of the record is predicted by the solver with the constants that the other two gave"
    )
    words = (
        f"{by}. Error of a prediction: root mean square over the channels of simulation minus record, each in units of "
        "its noise; 1 is as good as the noise allows. Expected error: root mean square over all predictions. "
        "Intervals: 95 %, by a circular moving-block bootstrap of the residuals in time. Probability of being best: "
        "share of the bootstrap samples, the same blocks for every model, in which no other model is better; it "
        "compares these models and does not say that one of them is right."
    )
    head = ("bird model", "expected error", "probability of being best")
    rows = tuple(_ranked_row(found.models[name]) for name in results.ranked)
    blocks.append(Table(head, rows, words, frozenset({1, 2})))
    shots = {
        results.title(shot): {
            name: (found.models[name].heldout[shot], found.models[name].heldout_95[shot]) for name in results.ranked
        }
        for shot in found.speeds
    }
    if results.ranked:
        caption = "Errors of the predictions by shot, with their 95 % intervals. Dotted line: 1, the noise alone."
        blocks.append(drawing("heldout", heldout_figure(shots, results.ranked), caption))
    return Section("answer", "Which bird model predicts best", tuple(blocks))


def _ranked_row(model: ModelAnswer) -> tuple[str, ...]:
    return (model.name, _error(*model.error), _share(model.probability_best or 0.0))


def _share(probability: float) -> str:
    """A share of bootstrap samples, of which 0 and 1 are no certainties: `58 %`, `< 1 %`, `> 99 %`."""
    if probability < 0.01:
        return "< 1 %"
    return "> 99 %" if probability > 0.99 else f"{100 * probability:.0f} %"


def _error(value: float, ends: tuple[float, float]) -> str:
    return f"{rounded(value, 3)} ({rounded(ends[0], 3)} .. {rounded(ends[1], 3)})"


def constants_section(results: ModelsResults) -> Section:
    """Calibrated beside published constants, and the combinations that count."""
    blocks: list[Block] = []
    rows, said = list[tuple[str, ...]](), list[str]()
    for name in results.ranked:
        model = results.found.models[name]
        rows += _constants(model)
        said += [f"{name}: {one.sentence}." for one in model.combinations.values() if one.sentence]
    words = (
        "Constants of each model from all shots together, with 95 % intervals, beside published ones of such birds. A "
        "constant whose interval is not much narrower than its range is not identifiable from these records."
    )
    blocks.append(
        Table(("bird model", "constant", "calibrated", "95 % interval", "range", "published"), tuple(rows), words)
    )
    blocks += map(Paragraph, said)
    sources = {name: source for name in results.ranked if (source := results.found.models[name].source)}
    if sources:
        blocks.append(Paragraph("Published: " + "; ".join(f"{n}: {text}" for n, text in sources.items()) + "."))
    errors = tuple((name, *row) for name in results.ranked for row in _pairs(results, results.found.models[name]))
    words = (
        "Error of the simulation over noise, shot by shot. Held out: with constants calibrated without the shot or the "
        "third of the record that is predicted, as in the first table. Calibrated: with constants from all shots. "
        "Published: with the constants of the literature."
    )
    head = ("bird model", "shot", "held out (95 %)", "calibrated", "published")
    blocks.append(Table(head, errors, words, frozenset({2, 3, 4})))
    return Section("constants", "Calibrated beside published constants", tuple(blocks))


def _constants(model: ModelAnswer) -> Iterator[tuple[str, ...]]:
    for key, one in model.parameters.items():
        unit, published = one.unit, model.literature.get(key)
        yield (
            model.name,
            parameter_label(key, model.parameters),
            quantity(one.value, unit) if one.identified and one.value is not None else "not identifiable",
            _span(one.interval_95, unit) if one.interval_95 else NONE,
            _span(model.ranges[key], unit),
            NONE if published is None else quantity(published, unit),
        )


def _span(ends: tuple[float, float], unit: str) -> str:
    return span(ends[0], ends[1], unit)


def _pairs(results: ModelsResults, model: ModelAnswer) -> Iterator[tuple[str, str, str, str]]:
    """By shot, which would make columns too many for a page: its title, and the errors of a model over noise."""
    for shot in results.found.speeds:
        published = model.published.get(shot)
        shown = f"{published.weighted:.2f}" if published else NONE
        heldout = _error(model.heldout[shot], model.heldout_95[shot])
        yield results.title(shot), heldout, f"{model.verified[shot].weighted:.2f}", shown


def curves_section(results: ModelsResults) -> Section:
    """The solver's curves beside each record; switches hide the calibrated or the published ones."""
    blocks = []
    for shot, record in results.records.items():
        channels = {name: record.units[name] for name in list(record.channels)[:MOST_CHANNELS]}
        left = len(record.channels) - len(channels)
        others = f"{left} more channel{'s are' if left > 1 else ' is'}"
        more = f"; {others} in the table of errors in models.json" if left else ""
        label = f"record ({'simulated' if record.simulated else 'measured'})"
        figure = curves_figure(
            channels,
            {name: fitted_curve(record, name, results.found.measured[shot], label) for name in channels},
            results.calibrated[shot],
            results.published[shot],
            results.ranked,
        )
        words = f"Shot {results.title(shot)}: heavy lines calibrated, thin lines published constants{more}."
        words += _of_record(results.found.measured[shot], channels)
        blocks.append(drawing(f"curves-{shot}", figure, words))
    return Section("curves", "Curves", tuple(blocks))


def _of_record(figures: MeasuredFigures, channels: Mapping[str, str]) -> str:
    """What was done to the record before it was compared; channels: name -> SI unit."""
    zeros = [
        f"{plain(name)} reads {reading(figures.at_rest[name].value, unit, 2)} at rest, which is subtracted"
        for name, unit in channels.items()
        if name in figures.at_rest
    ]
    return f" Record: {'; '.join(zeros)}." if zeros else ""


def basis_section(results: ModelsResults) -> Section:
    """Simulations, emulators and erosion behind the answer."""
    rows = tuple(_basis(results.found.models[name]) for name in results.ranked)
    words = (
        "Simulations of each shot: campaign, runs near the answer, verification, held-out prediction, published "
        "constants. "
        "Q2: least leave-one-out Q2 of a channel's emulator, 1 is perfect; below 0.9 the channel carries that "
        "emulator's scatter as noise. Eroded: largest share of the bird in a run of the campaign. Discrepancy: share "
        "of the peaks (1 sigma) that the fit allowed for as error of the model's form."
    )
    head = ("bird model", "simulations a shot", "least Q2", "in", "eroded", "discrepancy", "seconds")
    tables = [Table(head, rows, words, frozenset({1, 2, 4, 5, 6}))]
    if any(results.found.models[name].optimised for name in results.ranked):
        tables.append(_optimised(results))
    return Section("basis", "What the answer rests on", tuple(tables))


def _optimised(results: ModelsResults) -> Table:
    """Optimisers with the solver in the loop beside the calibration."""
    rows = []
    for name in results.ranked:
        model = results.found.models[name]
        own = rms([one.weighted for one in model.verified.values()])
        rows.append((name, "calibration", f"{own:.2f}", str(max(model.strikes.values())), ""))
        for method, one in model.optimised.items():
            rows.append((name, method.replace("_", " "), f"{one.weighted:.2f}", str(one.strikes), one.ended))
    words = (
        "Error over the noise of the solver at each method's constants, all shots, and simulations of each shot; those "
        "of the calibration include its held-out predictions and the published constants."
    )
    return Table(
        ("bird model", "method", "error", "simulations a shot", "ended"), tuple(rows), words, frozenset({2, 3})
    )


def _basis(model: ModelAnswer) -> tuple[str, ...]:
    q2 = {f"{plain(c)} of {shot}": v for shot, own in model.q2.items() for c, v in own.items() if v is not None}
    worst = min(q2, key=lambda key: q2[key]) if q2 else ""
    return (
        model.name,
        str(max(model.strikes.values(), default=0)),
        f"{q2[worst]:.3f}" if worst else NONE,
        worst,
        f"{100 * max(model.eroded.values(), default=0.0):.0f} %",
        f"{100 * model.discrepancy:.1f} %",
        f"{model.wall_s:.0f}",
    )
