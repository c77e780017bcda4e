"""Sections of a page about part of a flow: what is not there, a campaign by itself, an inversion by itself."""

from __future__ import annotations

import numpy as np

from birdstrike.reports.blocks import Block, Lines, Paragraph, Section, Warnings, drawing
from birdstrike.reports.figures.prior_predictive import campaign_figure
from birdstrike.reports.figures.quantities import parameter_label, quantity, reading, words
from birdstrike.reports.results.findings import balance, identified, verified
from birdstrike.reports.results.measurement import origin, peak, short_name
from birdstrike.reports.results.parts import Parts
from birdstrike.reports.results.results import CampaignResults, InversionResults
from birdstrike.reports.sections.summary import methods_table


def missing_section(parts: Parts) -> Section:
    """What the page does not say, and the commands that would let it."""
    told = Paragraph("This page shows the parts that exist. Not there yet:")
    return Section("missing", "What is missing", (told, Lines(parts.missing)))


def campaign_findings(results: CampaignResults) -> tuple[str, ...]:
    """Size of the campaign, what was varied, the range of every sensor's peak, energy balance."""
    design, dataset = results.campaign["design"], results.dataset
    ranges = zip(dataset.names, dataset.units, dataset.lows, dataset.highs, strict=True)
    varied = "; ".join(
        f"{parameter_label(n, dataset.names)} {quantity(lo, u)} to {quantity(hi, u)}" for n, u, lo, hi in ranges
    )
    failed = f", {len(results.failures)} more failed" if results.failures else ""
    return (
        f"Campaign: {len(dataset.runs)} simulations of case {results.case_name}{failed}, {design['kind']} design. "
        "No record has been inverted with it.",
        f"Varied: {varied}.",
        f"Peaks: {'; '.join(_peaks(results, channel) for channel in dataset.curves)}.",
        balance(results),
    )


def _peaks(results: CampaignResults, channel: str) -> str:
    """`displacement centre 5.1 mm to 5.8 mm`."""
    dataset = results.dataset
    tops = np.array([peak(dataset.time, curve)[1] for curve in dataset.curves[channel]])
    unit = dataset.channel_units[channel]
    return f"{words(channel)} {reading(float(tops.min()), unit)} to {reading(float(tops.max()), unit)}"


def campaign_section(results: CampaignResults) -> Section:
    """The first screen of a campaign."""
    blocks: list[Block] = [Lines(campaign_findings(results))]
    if results.warnings:
        blocks.append(Warnings(results.warnings))
    return Section("summary", "The campaign", tuple(blocks))


def campaign_curves(results: CampaignResults) -> Section:
    """Every simulation's curve, one picture a sensor."""
    dataset = results.dataset
    pictures = (
        drawing(
            f"campaign-{channel}",
            campaign_figure(channel, dataset.channel_units[channel], dataset.time, curves, dataset.smooth),
            f"All {len(dataset.runs)} simulations: {words(channel)}. A record far outside of them cannot be produced "
            "by any values of the parameters within their ranges.",
        )
        for channel, curves in dataset.curves.items()
    )
    return Section("curves", "The campaign's curves", tuple(pictures))


def inversion_findings(results: InversionResults) -> tuple[str, ...]:
    """Record, verified error, parameters."""
    record = results.record
    kind = f"{origin(record)}, not measured" if record.simulated else "measured"
    return f"Record: {short_name(record)}, {kind}.", verified(results), identified(results)


def inversion_section(results: InversionResults) -> Section:
    """The first screen of an inversion."""
    blocks: list[Block] = [Lines(inversion_findings(results))]
    if results.warnings:
        blocks.append(Warnings(results.warnings))
    return Section("answer", "The inversion", (*blocks, methods_table(results)))
