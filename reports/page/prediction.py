"""The page of a prediction: how far it goes, limits and bands, where the width comes from, what it rests on."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from birdstrike.data.curves import read_histories
from birdstrike.data.errors import UserError
from birdstrike.data.formatting import listing, many, plain, quantity, reading, span
from birdstrike.data.histories import Array, Histories
from birdstrike.data.storage.files import read_json, write_atomically
from birdstrike.data.units import of_reading
from birdstrike.inversion.labels import in_words
from birdstrike.inversion.prediction.answer import QUANTILES, tearing_words
from birdstrike.inversion.prediction.budget import SOURCES
from birdstrike.inversion.prediction.distance import WORDS
from birdstrike.reports.blocks import Block, Lines, Paragraph, Section, Table, Warnings, drawing
from birdstrike.reports.figures.prediction import bands_figure, budget_figure
from birdstrike.reports.page.render import rendered

Content = Mapping[str, Any]
METHOD = (
    "Shares are of the sum of six variances: effect is the variance between the explanations' means, parameters the "
    "mean variance within them, and the others let one source alone vary. The model's error is a Gaussian process "
    "given what the model left of the learnt record; see docs/prediction.md."
)


def write_prediction_page(folder: str | Path) -> Path:
    """Write prediction.html beside prediction.json and prediction.csv; raises UserError where they are not there."""
    place = Path(folder)
    missing = [name for name in ("prediction.json", "prediction.csv") if not (place / name).is_file()]
    if missing:
        raise UserError(f"{place} lacks {' and '.join(missing)}; make them with birdstrike predict")
    content = read_json(place / "prediction.json")
    write_atomically(place / "prediction.html", page(content, read_histories(place / "prediction.csv")))
    return place / "prediction.html"


def page(content: Content, table: Histories) -> str:
    """HTML; table: prediction.csv."""
    sections = (
        Section("reach", "How far it goes beyond what was learnt", _reach(content)),
        Section("limits", "Limits and largest readings", _limits(content)),
        Section("bands", "What the sensors will read", _bands(content, table)),
        Section("budget", "Where the width comes from", _budget(content)),
        Section("rest", "What it rests on", _rest(content)),
    )
    subtitle = f"Case {content['case']}, predicted from {content['source']}; nothing shown here is measured."
    return rendered(title=f"Prediction of {content['case']}", subtitle=subtitle, sections=sections)


def _reach(content: Content) -> tuple[Block, ...]:
    rows = tuple(
        (
            WORDS[name],
            quantity(one["value"], one["unit"], 4),
            _range(one["low"], one["high"], one["unit"]),
            f"{100.0 * one['outside']:+.0f} %" if one["outside"] else "inside",
        )
        for name, one in content["reach"].items()
    )
    head = ("condition", "new shot", "learnt", "outside by")
    figures = Table(head, rows, "The new shot beside the range of the learnt ones.", frozenset({1, 2, 3}))
    known = (*content["extrapolation"], *content["warnings"])
    blocks: list[Block] = [Warnings(known)] if known else []
    if not content["extrapolation"]:
        blocks.append(Paragraph("The new shot lies within the range of the learnt ones."))
    return (*blocks, figures, Paragraph(_growth(content)))


def _range(low: float, high: float, unit: str) -> str:
    """Of several learnt shots their range, of one its value."""
    return span(low, high, unit, 4) if high > low else quantity(low, unit, 4)


def _readings(low: float, high: float, unit: str) -> str:
    """Two ends of a sensor's interval."""
    return span(low, high, of_reading(unit))


def _growth(content: Content) -> str:
    larger = content["growth"] > 1.005
    spread = f"taken {content['growth']:.3g} times as large as there" if larger else "not enlarged"
    return (
        f"The model's error has a correlation of {content['correlation']:.2f} with that of the nearest learnt shot, "
        f"and its standard deviation is {spread}."
    )


def _limits(content: Content) -> tuple[Block, ...]:
    blocks: list[Block] = []
    if content["limits"]:
        rows = tuple(
            (
                plain(name),
                reading(one["value"], one["unit"]),
                f"{one['probability']:.3g}",
                f"{one['interval_95'][0]:.2g} .. {one['interval_95'][1]:.2g}",
            )
            for name, one in content["limits"].items()
        )
        head = ("sensor", "limit", "probability of exceeding", "95 % interval")
        words = f"{_left_open(content)} The model's error is in the probability itself."
        blocks.append(Table(head, rows, words, frozenset({1, 2, 3})))
    rows = tuple(
        (plain(name), reading(one["q50"], one["unit"]), *(_readings(one[a], one[b], one["unit"]) for a, b in PAIRS))
        for name, one in content["peaks"].items()
    )
    head = ("sensor", "median", "50 %", "95 %")
    blocks.append(Table(head, rows, "Largest reading of each sensor.", frozenset({1, 2, 3})))
    if content["residual"]:
        rows = tuple(
            (plain(name), reading(one["q50"], one["unit"]), *(_readings(one[a], one[b], one["unit"]) for a, b in PAIRS))
            for name, one in content["residual"].items()
        )
        caption = "Deflection at the end of the simulation: mean over its last 15 %, while the plate may still vibrate."
        blocks.append(Table(head, rows, caption, frozenset({1, 2, 3})))
    told = tearing_words(content["perforation"])
    blocks.append(Paragraph(f"{told[0].upper()}{told[1:]}."))
    return tuple(blocks)


def _left_open(content: Content) -> str:
    """Of which number of simulations the intervals of the probabilities are."""
    counts = content["campaign"]
    methods = {name: counts["method"][name] for name in content["limits"]}
    scarce = [plain(name) for name, method in methods.items() if method != "emulator"]
    ample = [plain(name) for name, method in methods.items() if method == "emulator"]
    told = []
    if scarce:
        told.append(
            f"The interval of {listing(scarce)} is what {many(counts['finished'], 'simulation')} of the new case leave "
            "open, for no emulator of them is good enough: more (--runs) make it narrower."
        )
    if ample:
        told.append(f"The interval of {listing(ample)} is what the posterior's draws, by the emulator, leave open.")
    return " ".join(told)


PAIRS = (("q25", "q75"), ("q025", "q975"))


def _bands(content: Content, table: Histories) -> tuple[Block, ...]:
    blocks: list[Block] = []
    for name, one in content["peaks"].items():
        column = f"{name}_{one['unit']}".rstrip("_")
        own: dict[str, Array] = {key: _column(table, column, key) for key in QUANTILES}
        limit = content["limits"].get(name, {}).get("value")
        figure = bands_figure(name, one["unit"], table.time, own, limit)
        q2, method = content["campaign"]["q2"][name], content["campaign"]["method"][name]
        how = (
            f"by an emulator of the simulations (leave-one-out Q² {q2:.2f})"
            if method == "emulator"
            else "by the simulations themselves, where no emulator is good enough"
        )
        words = f"What {plain(name)} will read, {how}: median, and the bands that hold it in 50 and 95 % of such shots."
        blocks.append(drawing(f"bands-{name}", figure, words))
    return tuple(blocks)


def _column(table: Histories, column: str, key: str) -> Array:
    """A column of prediction.csv, whatever the reader takes for its unit."""
    for name, values in table.channels.items():
        unit = table.units[name]
        if f"{name}_{unit}".rstrip("_") == f"{column}_{key}":
            return values
    raise UserError(f'prediction.csv has no column "{column}_{key}"; repeat birdstrike predict')


def _budget(content: Content) -> tuple[Block, ...]:
    blocks: list[Block] = [
        drawing(
            "budget", budget_figure(content["sources"]), "Sources of the variance of each sensor's largest reading."
        )
    ]
    rows = tuple(
        (plain(name), *(f"{100.0 * own[source]:.0f} %" for source in SOURCES))
        for name, own in content["sources"].items()
    )
    blocks.append(Table(("sensor", *SOURCES), rows, METHOD, frozenset(range(1, len(SOURCES) + 1))))
    if content["narrowing"]:
        blocks.append(Paragraph("What would narrow it, the most useful first:"))
        blocks.append(Lines(tuple(one["sentence"] for one in content["narrowing"])))
    return tuple(blocks)


def _rest(content: Content) -> tuple[Block, ...]:
    rows = tuple(
        (
            in_words(one["name"]),
            f"{one['probability']:.3f}",
            "; ".join(f"{in_words(label)}: {how}" for label, how in one["effects"].items()) or "-",
        )
        for one in content["explanations"]
    )
    counts = content["campaign"]
    used = tuple(line for line in content["posterior"] if not any(one.startswith(line) for one in content["warnings"]))
    blocks: list[Block] = [
        *((Lines(used),) if used else ()),
        Table(("explanation", "probability", "its effects here"), rows, "What was averaged over.", frozenset({1})),
        Paragraph(
            f"{counts['finished']} of {counts['asked']} simulations of the new case finished, {counts['finer']} of "
            "them also on a finer mesh."
        ),
    ]
    if content["tolerances"]:
        stated = tuple(
            (key, quantity(one["value"], one["unit"], 4), quantity(one["sigma"], one["unit"]))
            for key, one in content["tolerances"].items()
        )
        head = ("quantity", "value", "one standard deviation")
        blocks.append(Table(head, stated, "Tolerances of the new shot.", frozenset({1, 2})))
    return tuple(blocks)
