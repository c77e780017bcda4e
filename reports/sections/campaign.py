"""The campaign's design: whether it separates the parameters, and how evenly it fills their box."""

from __future__ import annotations

from birdstrike.data.units import rounded
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.reports.blocks import Picture, Section, Table, drawing
from birdstrike.reports.figures.design import design_figure
from birdstrike.reports.figures.quantities import symbol
from birdstrike.reports.results.findings import ROUNDING, smooth_limit
from birdstrike.reports.results.results import CampaignResults, Results
from birdstrike.surrogate.features import FEATURES, LIMIT


def section(results: Results) -> Section:
    """Figures of quality and the projections."""
    return _section(results, _quality(results))


def without_inversion(results: CampaignResults) -> Section:
    """The same of a campaign that no record has been inverted with."""
    design = results.campaign["design"]
    rows = (
        ("design", _kind(results)),
        ("simulations", f"{len(results.dataset.runs)} finished, {len(results.failures)} failed, {_lost(results)}"),
        ("rank", f"{design['rank']} of {len(results.dataset.names)}"),
        ("largest correlation of two parameters", _figure(design["max_correlation"]) + " (0 is best)"),
        ("centred L2 discrepancy, squared", _figure(design["discrepancy"]) + " (smaller fills the box more evenly)"),
    )
    return _section(results, Table(("what", "value"), rows, "Quality of the design (parameters scaled)."))


def _section(results: CampaignResults, quality: Table) -> Section:
    blocks = (quality, _projections(results)) if len(results.dataset.names) > 1 else (quality,)
    return Section("design", "The campaign's design", blocks)


def _lost(results: CampaignResults) -> str:
    return f"{int((~results.dataset.smooth).sum())} over {smooth_limit(results)} eroded"


def _quality(results: Results) -> Table:
    design = results.inversion.design
    rows = (
        ("design", _kind(results)),
        ("simulations used", f"{results.inversion.runs_used}, {len(results.failures)} failed, {_lost(results)}"),
        ("rank", f"{design.rank} of {design.parameters}: {design.finding}"),
        ("largest correlation of two parameters", _figure(design.max_correlation) + " (0 is best)"),
        ("centred L2 discrepancy, squared", _figure(design.discrepancy) + " (smaller fills the box more evenly)"),
    )
    return Table(
        ("what", "value"),
        rows,
        f"Quality of the design (simulations with at most {smooth_limit(results)} erosion, parameters scaled).",
    )


def _kind(results: CampaignResults) -> str:
    """`uniform, 25 runs, seed 0`, or the user's own file."""
    design = results.campaign["design"]
    seed = "" if design["seed"] is None else f", seed {design['seed']}"
    return f"{design['source'] or design['kind']}, {design['runs']} runs{seed}"


def _figure(value: float | None) -> str:
    return "–" if value is None else rounded(value if abs(value) > ROUNDING else 0.0, 3)


def _projections(results: CampaignResults) -> Picture:
    """Two parameters at a time, with the limits beyond which an erosion parameter does nothing."""
    dataset, held_out = results.dataset, results.held_out
    last = [name.rsplit(".", 1)[-1] for name in dataset.names]
    limits = {column: LIMIT for column, name in enumerate(last) if name in FEATURES}
    figure = design_figure(
        names=[symbol(name, dataset.names) for name in dataset.names],
        space=ParameterSpace.of_dataset(dataset),
        values=dataset.parameters,
        held_out=held_out,
        limits=limits,
    )
    kept = f"; {int(held_out.sum())} were held out of training" if held_out.any() else ""
    text = f"The {len(dataset.runs)} simulations, two parameters at a time{kept}."
    if limits:
        text += " Dashed: TEROD acts only above 1 and CEROD only below 1; elsewhere they change nothing."
    return drawing("design", figure, text)
