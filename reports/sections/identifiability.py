"""Identifiability of the parameters: posterior, directions, profiles, and when which parameter acts."""

from __future__ import annotations

from birdstrike.data.units import rounded
from birdstrike.inversion.observations.prior_predictive import POOR_Q2
from birdstrike.inversion.results.identifiability import IdentifiabilityFigures, PosteriorFigures
from birdstrike.reports.blocks import Block, Paragraph, Section, Table, drawing, photograph
from birdstrike.reports.figures.posterior import corner_figure, sobol_figure
from birdstrike.reports.figures.quantities import symbol, words
from birdstrike.reports.results.results import InversionResults


def section(results: InversionResults) -> Section:
    """Only what was asked for and could be drawn."""
    blocks: list[Block] = []
    posterior, figures = results.inversion.posterior, results.inversion.identifiability
    if posterior is not None and results.draws is not None:
        blocks.append(_corner(results, posterior))
    if figures is not None and results.inversion.prior_predictive.inside:
        blocks += [_directions(figures), *_profiles(figures)]
    if figures is not None:
        for channel, indices in figures.sobol.items():
            caption = (
                f"Which parameter's range makes {words(channel)} vary, and when: total Sobol indices by the emulator. "
                "They add up to more than 1 where parameters act together; a single one above 1 is scatter of the "
                f"estimate.{_of_a_poor_emulator(results, channel)}"
            )
            blocks.append(drawing(f"sobol-{channel}", sobol_figure(indices.times, indices.total), caption))
    if not blocks:
        blocks.append(Paragraph("Neither posterior nor identifiability was asked for: the intervals are linearised."))
    return Section("identifiability", "Identifiability of the parameters", tuple(blocks))


def _of_a_poor_emulator(results: InversionResults, channel: str) -> str:
    """Whether the indices of a channel are those of an emulator that hardly follows the simulations."""
    q2 = results.inversion.emulator.q2.get(channel)
    if q2 is not None and q2 > POOR_Q2:
        return ""
    known = "unknown" if q2 is None else f"{q2:.2f}"
    return f" The emulator predicts this sensor poorly (leave-one-out Q² {known}): the simulations may say otherwise."


def _corner(results: InversionResults, posterior: PosteriorFigures) -> Block:
    draws = results.draws or {}
    units = {**results.units, "time_offset": "s"}
    figure = corner_figure(
        {name: draws[name] for name in posterior.names}, units, posterior.most_probable, results.inversion.logarithmic
    )
    worst = max((value for value in posterior.rhat.values() if value is not None), default=None)
    settled = "R-hat not known" if worst is None else f"R-hat at most {worst:.3f}"
    contraction = ", ".join(
        f"{symbol(name, posterior.names)} {100 * value:.0f} %" for name, value in posterior.contraction.items()
    )
    caption = (
        f"Posterior by the emulator: histograms of each parameter and pair, red: the most probable point. "
        f"{posterior.steps} steps, {settled}, {min(posterior.effective.values()):.0f} effective draws "
        f"or more. Reduction of the prior's variance: {contraction}."
    )
    return photograph("posterior", figure, caption, "Corner plot of the posterior's draws")


def _directions(figures: IdentifiabilityFigures) -> Table:
    rows = tuple(
        (direction.words, rounded(direction.strength, 2), "no" if direction.null else "yes")
        for direction in figures.directions
    )
    caption = (
        "Directions of the parameters, each scaled by its prior, and the information that the record adds: below 1 "
        "the prior carries more than the record."
    )
    return Table(("direction", "strength", "identified by the record"), rows, caption, frozenset({1}))


def _profiles(figures: IdentifiabilityFigures) -> tuple[Table, ...]:
    if not figures.profiles:
        return ()
    rows = tuple(
        (symbol(name, figures.profiles), profile.sentence.split(": ", 1)[1])
        for name, profile in figures.profiles.items()
    )
    caption = "Profile likelihood: what bounds each parameter when all others follow."
    return (Table(("parameter", "bounds"), rows, caption),)
