"""Five lines that say what was found: the record, the verified error, the parameters, the cloud, the books."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from birdstrike.reports.figures.quantities import parameter_label, quantity, significant, symbol, words
from birdstrike.reports.record import cloud, origin, peak, residual, short_name
from birdstrike.reports.results import Books, Results


def findings(results: Results) -> tuple[str, str, str, str, str]:
    """The five findings in plain words, every number computed from the results."""
    return analysed(results), verified(results), identified(results), cloud_and_residual(results), books(results)


def analysed(results: Results) -> str:
    """Bird, impact, plate and record, and whether that record was measured or simulated."""
    case, record = results.case, results.record
    plate = " × ".join(quantity(size, "m") for size in (case.plate.length, case.plate.width, case.plate.thickness))
    peaks = ", ".join(_record_peak(results, channel) for channel in results.channels)
    verdict = f"{origin(record)}, not measured" if record.simulated else "measured"
    return (
        f"Analysed: a bird of {quantity(case.bird.actual_mass, 'kg')} at {quantity(case.impact.speed, 'm/s')} "
        f"({quantity(case.normal_speed, 'm/s')} normal to the plate) on a plate of {plate}; "
        f"the record {short_name(record)} is {verdict}: {peaks}."
    )


def _record_peak(results: Results, channel: str) -> str:
    time, values = results.record.points(channel)
    at, value = peak(time, values)
    unit = results.record.units[channel]
    return f"{time.size} points of {words(channel)}, peak {quantity(value, unit)} at {quantity(at, 's')}"


def verified(results: Results) -> str:
    """RMS error of the solver re-run at each answer, the best first, with the time offset it is stated for."""
    first, *others = results.finished
    line = f"Verified: the solver re-run at the {first}'s answer misses the record by {error_text(results, first)}"
    for other in others:
        line += f"; at the {other}'s answer by {error_text(results, other)}"
    return f"{line} ({offset_text(results)})."


def error_text(results: Results, method: str) -> str:
    """`0.310 mm RMS, 5.4 % of the peak`, one for every channel."""
    return " and ".join(channel_error(results, method, channel) for channel in results.channels)


def channel_error(results: Results, method: str, channel: str) -> str:
    """The same in one channel, which is named where there are several."""
    score = results.inversion.methods[method].channels[channel]
    if score.verified_rmse is None or score.verified_relative is None:
        return f"an unknown amount in {words(channel)}"
    where = f" in {words(channel)}" if len(results.channels) > 1 else ""
    return f"{quantity(score.verified_rmse, score.unit)} RMS{where}, {percent(score.verified_relative)} of the peak"


def percent(share: float, digits: int = 2) -> str:
    """`5.4 %` of 0.054."""
    return f"{significant(share * 100, digits)} %"


def offset_text(results: Results) -> str:
    """How the clocks of simulation and record were laid over each other."""
    if results.inversion.time_offset.sigma is None:
        return "record and simulation share one clock"
    if abs(results.offset) < 5e-7:
        return "the clocks of record and simulation agree within 1 µs, as the record lets one tell"
    later = "later" if results.offset > 0 else "earlier"
    shift = abs(results.offset)
    size = f"{significant(shift * 1e6, 2)} µs" if shift < 1e-5 else quantity(shift, "s")
    return f"the simulation's clock set {size} {later} to fit the record"


def identified(results: Results) -> str:
    """Which parameters the record tells, with intervals, and which it doesn't, with the reason in short."""
    parameters = results.answer.parameters
    told = [_told(results, name) for name, estimate in parameters.items() if estimate.identified]
    reasons: dict[str, list[str]] = {}
    for name, estimate in parameters.items():
        if not estimate.identified:
            reasons.setdefault(estimate.reason, []).append(symbol(name))
    untold = "; ".join(f"{', '.join(names)}: {reason}" for reason, names in reasons.items())
    first = f"Identified by the {results.best}: {'; '.join(told) or 'none'}"
    return f"{first}. Not identified: {untold}." if untold else f"{first}. No parameter is left open."


def _told(results: Results, name: str) -> str:
    """`viscosity MU 641 Pa s (95 %: 500 Pa s to 900 Pa s)`."""
    estimate = results.answer.parameters[name]
    value = "" if estimate.value is None else f" {quantity(estimate.value, estimate.unit)}"
    if estimate.interval_95 is None:
        return parameter_label(name) + value
    low, high = (quantity(end, estimate.unit) for end in estimate.interval_95)
    return f"{parameter_label(name)}{value} (95 %: {low} to {high})"


def cloud_and_residual(results: Results) -> str:
    """Whether any strike of the campaign reaches the record, and where the best verification misses it most."""
    where = "; ".join(cloud_text(results, channel) for channel in results.channels)
    misses = "; ".join(worst_text(results, channel, results.best) for channel in results.channels)
    return f"Cloud: {where}; {_fit(results)}. Largest residual of the {results.best}'s verification: {misses}."


def _fit(results: Results) -> str:
    """The inversion's verdict on the whole curve; the emulator's own error counts as much as the noise in it."""
    found = results.inversion.cloud
    if found.inside:
        return "within noise and the emulator's own error the model can produce the whole curve"
    if found.coarse:
        return f"the emulator is too coarse to tell whether the model can produce the whole curve: {found.coarse}"
    return (
        "the emulator finds no choice of the parameters that gives the whole curve within noise and the emulator's own "
        "error"
    )


def worst_text(results: Results, channel: str, method: str) -> str:
    """`0.39 mm at 1.34 ms, the simulation below the record in displacement centre`."""
    at, value = residual(results, channel, method).worst
    side = "above" if value > 0 else "below"
    size = quantity(abs(value), results.record.units[channel])
    return f"{size} at {quantity(at, 's')}, the simulation {side} the record in {words(channel)}"


def cloud_text(results: Results, channel: str) -> str:
    """`the record's displacement centre lies outside all 25 strikes ... at 8 of 12 points, up to 0.41 mm above`."""
    seen, unit = cloud(results, channel), results.record.units[channel]
    count, smooth = int(seen.outside.sum()), int(results.dataset.smooth.sum())
    strikes = f"{smooth} smooth strikes" if smooth < len(results.dataset.runs) else f"{smooth} strikes"
    if not count:
        points = f"within noise, at all {seen.points} points"
        return f"the record's {words(channel)} lies among the campaign's {strikes}, {points}"
    at, value = peak(seen.time, seen.excess)
    side = "above" if value > 0 else "below"
    return (
        f"the record's {words(channel)} lies outside all {strikes} of the campaign by more than noise at {count} of "
        f"{seen.points} points, up to {quantity(abs(value), unit)} {side} them at {quantity(at, 's')}"
    )


def books(results: Results) -> str:
    """Strikes, the worst energy and momentum errors among them, and their cost."""
    energy, momentum = (worst_book(results, key) for key in ("energy_error", "momentum_error"))
    seconds = sum(float(books["wall_s"]) for books in results.books.values())
    failed = f", {len(results.failures)} more failed" if results.failures else ""
    return (
        f"Books: {len(results.books)} strikes used{failed}, worst energy error {percent(energy)} of the initial normal "
        f"kinetic energy ({worst_strike(results, 'energy_error')}), worst momentum error {momentum:.0e} of the bird's; "
        f"{seconds / 60:.2g} minutes of solver time."
    )


def worst_book(results: Results, key: str) -> float:
    """Largest magnitude of one entry in the books of the campaign's and the verification strikes."""
    return largest(results.books, key)


def largest(books: Mapping[str, Books], key: str) -> float:
    """Largest magnitude of one entry in books."""
    return float(np.max(np.abs([float(book[key]) for book in books.values()])))


def worst_strike(results: Results, key: str) -> str:
    """The strike with the largest magnitude of one entry, and whether it left the smooth regime."""
    label = max(results.books, key=lambda name: abs(float(results.books[name][key])))
    rough = {f"run {number}" for number in results.dataset.runs[~results.dataset.smooth]}
    return f"{label}, which lost over 5 % of the bird" if label in rough else label


def key_figures(results: Results) -> dict[str, object]:
    """The numbers behind the findings for other programs, SI."""
    return {
        "best": results.best,
        "methods": {
            method: {"verified_rmse": answer.verified_rmse, "verified_relative": answer.verified_relative}
            for method, answer in results.inversion.methods.items()
        },
        "identified": [name for name, estimate in results.answer.parameters.items() if estimate.identified],
        "inside_cloud": results.inversion.cloud.inside,
        "time_offset": results.offset,
        "strikes": len(results.books),
        "worst_energy_error": worst_book(results, "energy_error"),
        "solver_s": sum(float(books["wall_s"]) for books in results.books.values()),
    }
