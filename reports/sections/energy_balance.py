"""Books of every strike used: what went astray of energy and momentum, what eroded, what it cost."""

from __future__ import annotations

from collections.abc import Mapping

from birdstrike.reports.blocks import Block, Paragraph, Section, Table, Warnings
from birdstrike.reports.figures.quantities import significant
from birdstrike.reports.findings import largest, percent
from birdstrike.reports.results import Books, Results

LIMIT_ENERGY = 0.01  # of the initial normal kinetic energy


def section(results: Results) -> Section:
    """One row a strike; failed strikes stand above with their reason."""
    every = all_books(results)
    above = sum(abs(float(book["energy_error"])) > LIMIT_ENERGY for book in every.values())
    energy, momentum = (largest(every, key) for key in ("energy_error", "momentum_error"))
    words = (
        f"{len(every)} strikes stand behind this report. Worst energy error {percent(energy)} of the bird's "
        f"initial kinetic energy normal to the plate ({counted(above)} above {percent(LIMIT_ENERGY)}), worst momentum "
        f"error {momentum:.1e} of the bird's initial momentum. Every term is integrated from its own rate; none is the "
        "difference of the others."
    )
    blocks: list[Block] = [Paragraph(words)]
    if results.failures:
        blocks.append(Warnings(tuple(f"{label} failed: {reason}" for label, reason in results.failures.items())))
    return Section("books", "Verification and balance of every strike", (*blocks, _table(results)))


def all_books(results: Results) -> Mapping[str, Books]:
    """Books of the campaign's and the verification strikes, and of the bird models' where they were struck."""
    struck = {f"model, {m.title}": m.run.summary for m in results.struck.values() if m.run is not None}
    return {**results.books, **struck}


def counted(strikes: int) -> str:
    """`1 strike`, `2 strikes`, `none`."""
    return "none" if strikes == 0 else f"{strikes} strike{'s' if strikes > 1 else ''}"


def _table(results: Results) -> Table:
    books = ("energy error", "momentum error", "hourglass / plate", "shock viscosity [Pa s]", "eroded")
    head = ("strike", *books, "steps", "time [s]")
    rows = tuple((label, *_row(book)) for label, book in all_books(results).items())
    caption = (
        "Simulated strikes. Energy error: of the initial normal kinetic energy; momentum error: of the bird's initial "
        "momentum; hourglass: energy of the plate's hourglass control over its internal energy; shock viscosity: the "
        "MU that would have dissipated what the artificial viscosity did; eroded: particles; time: wall clock."
    )
    return Table(head, rows, caption, frozenset(range(1, len(head))))


def _row(book: Books) -> tuple[str, ...]:
    energies = book.get("energies_J", {})
    hourglass, internal = energies.get("plate_hourglass"), energies.get("plate_internal")
    return (
        f"{book['energy_error'] * 100:+.2f} %".replace("-", "−"),
        f"{book['momentum_error']:.1e}",
        percent(hourglass / internal) if hourglass is not None and internal else "–",
        significant(book["shock_equivalent_viscosity_Pa_s"]) if "shock_equivalent_viscosity_Pa_s" in book else "–",
        f"{book['eroded_particles']} of {book['particles']}" if "particles" in book else "–",
        f"{book.get('steps', '–')}",
        f"{book['wall_s']:.1f}",
    )
