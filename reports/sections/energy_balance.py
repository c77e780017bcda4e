"""Energy balance of every simulation used: errors of energy and momentum, erosion, cost."""

from __future__ import annotations

from collections.abc import Mapping

from birdstrike.data.formatting import many
from birdstrike.reports.blocks import Paragraph, Section, Table
from birdstrike.reports.figures.quantities import significant
from birdstrike.reports.results.findings import NO_BALANCE, ROUNDING, largest, of_momentum, percent
from birdstrike.reports.results.results import CampaignResults, Results, RunSummary

LIMIT_ENERGY = 0.01  # of the initial normal kinetic energy


def section(results: CampaignResults) -> Section:
    """One row a simulation; a failed one has no balance and stands among the warnings of the summary."""
    every = results.every_summary
    words = f"Listed: {many(len(every), 'simulation')}{_not_listed(results)}. {_worst(every)}"
    return Section("energy_balance", "Energy balance of every simulation", (Paragraph(words), _table(results)))


def _not_listed(results: CampaignResults) -> str:
    """A diagnosis has simulations of its own."""
    diagnosed = isinstance(results, Results) and results.diagnosis is not None
    return "; those that the diagnosis has run besides are not among them" if diagnosed else ""


def _worst(every: Mapping[str, RunSummary]) -> str:
    """The largest errors of energy and momentum, or that no simulation states them."""
    energy, momentum = (largest(every, key) for key in ("energy_error", "momentum_error"))
    if energy is None or momentum is None:
        return f"{NO_BALANCE[0].upper()}{NO_BALANCE[1:]}."
    above = sum(abs(float(summary["energy_error"])) > LIMIT_ENERGY for summary in every.values())
    return (
        f"Worst energy error {percent(energy)} of the bird's "
        f"initial kinetic energy normal to the plate ({counted(above)} above {percent(LIMIT_ENERGY)}), worst momentum "
        f"error {of_momentum(momentum)}. Every term is integrated from its own rate; none is the "
        "difference of the others."
    )


def counted(runs: int) -> str:
    """`1 simulation`, `2 simulations`, `none`."""
    return "none" if runs == 0 else many(runs, "simulation")


def _table(results: CampaignResults) -> Table:
    balance = ("energy error", "momentum error", "hourglass / plate", "shock viscosity [Pa s]", "eroded")
    head = ("simulation", *balance, "steps", "time [s]")
    rows = tuple((label, *_row(summary)) for label, summary in results.every_summary.items())
    caption = (
        "Energy error: of the initial normal kinetic energy; momentum error: of the bird's initial momentum (< 10⁻⁷ %: "
        "of rounding alone); hourglass: energy of the plate's hourglass control over its internal energy; shock "
        "viscosity: the MU that would have dissipated what the artificial viscosity did; eroded: particles; time: wall "
        "clock."
    )
    return Table(head, rows, caption, frozenset(range(1, len(head))))


def _momentum(error: float | None) -> str:
    """An error as a share; of one that is of floating-point numbers alone the limit."""
    if error is None:
        return "–"
    return percent(error) if abs(error) > ROUNDING else "< 10⁻⁷ %"


def _row(summary: RunSummary) -> tuple[str, ...]:
    energies = summary.get("energies_J", {})
    hourglass, internal = energies.get("plate_hourglass"), energies.get("plate_internal")
    viscosity = summary.get("shock_equivalent_viscosity_Pa_s")
    energy, momentum = summary.get("energy_error"), summary.get("momentum_error")
    return (
        "–" if energy is None else f"{100 * energy:+.2f} %".replace("-", "−"),
        _momentum(momentum),
        percent(hourglass / internal) if hourglass is not None and internal else "–",
        "–" if viscosity is None else significant(viscosity),
        f"{summary['eroded_particles']} of {summary['particles']}" if "particles" in summary else "–",
        f"{summary.get('steps', '–')}",
        f"{summary['wall_s']:.1f}",
    )
