"""The five findings: record, verified error, parameters, prior predictive, energy balance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from birdstrike.data.formatting import listing, many
from birdstrike.data.units import rounded
from birdstrike.inversion.labels import in_words
from birdstrike.inversion.results.diagnosis import Diagnosis
from birdstrike.reports.figures.quantities import parameter_label, quantity, reading, significant, symbol, words
from birdstrike.reports.results.measurement import (
    RecordPosition,
    named,
    origin,
    peak,
    record_peak,
    record_position,
    residual,
)
from birdstrike.reports.results.results import CampaignResults, InversionResults, Results, RunSummary
from birdstrike.solver.build import outline_of


def findings(results: Results) -> tuple[str, str, str, str, str]:
    """The five findings in plain words, every number computed from the results."""
    return analysed(results), verified(results), identified(results), reach_and_residual(results), balance(results)


def analysed(results: Results) -> str:
    """Bird, impact, plate and record, and whether that record was measured or simulated."""
    case, record = results.case, results.record
    length, width, thickness = (quantity(float(x), "m") for x in (*outline_of(case).sides, case.plate.thickness))
    parts = len(case.target.parts) if case.target is not None else 1
    target = (
        f"a target of {parts} parts, {length} × {width}"
        if parts > 1
        else f"a plate of {length} × {width} × {thickness}"
    )
    peaks = _record_peaks(results)
    verdict = f"{origin(record)}, not measured" if record.simulated else "measured"
    return (
        f"Analysed: a bird of {quantity(case.bird.actual_mass, 'kg')} at {quantity(case.impact.speed, 'm/s')} "
        f"({quantity(case.normal_speed, 'm/s')} normal to the plate) on {target}; "
        f"{named(record)} is {verdict}: {peaks}."
    )


def _record_peaks(results: Results) -> str:
    """`148 points of displacement centre (peak 6.35 mm at 1.52 ms) and ...`, the count once where all have as many.

    `116 used points` where others were left out.
    """
    used, own = results.used, results.record
    counts = [_counted(used.points(channel)[0].size, own.points(channel)[0].size) for channel in results.channels]
    peaks = [f"{words(channel)} (peak {record_peak(results, channel).text})" for channel in results.channels]
    if len(set(counts)) == 1:
        each = " each" if len(counts) > 1 else ""
        return f"{counts[0]}{each} of {listing(peaks)}"
    return listing([f"{count} of {text}" for count, text in zip(counts, peaks, strict=True)])


def _counted(used: int, read: int) -> str:
    return many(used, "point" if used == read else "used point")


def verified(results: InversionResults) -> str:
    """RMS error of the solver re-run at each answer, the best first, with the time offset it is stated for."""
    first, *others = results.finished
    line = f"Verified: the simulation at the {first}'s answer differs from the record by {error_text(results, first)}"
    for other in others:
        line += f"; at the {other}'s answer by {error_text(results, other)}"
    meant = "RMS, and share of the peak; " if len(results.channels) > 1 else ""
    return f"{line} ({meant}{offset_text(results)})."


def error_text(results: InversionResults, method: str) -> str:
    """`0.310 mm RMS, 5.4 % of the peak`; of several channels `0.310 mm (5.4 %) in displacement centre and ...`."""
    if len(results.channels) == 1:
        return channel_error(results, method, results.channels[0])
    parts = list[str]()
    for channel in results.channels:
        score = results.inversion.methods[method].channels[channel]
        rmse, share = score.verified_rmse, score.verified_relative
        size = "unknown" if rmse is None or share is None else f"{reading(rmse, score.unit)} ({percent(share)})"
        parts.append(f"{size} in {words(channel)}")
    return listing(parts)


def channel_error(results: InversionResults, method: str, channel: str) -> str:
    """The same in one channel, which is named where there are several."""
    score = results.inversion.methods[method].channels[channel]
    if score.verified_rmse is None or score.verified_relative is None:
        return f"an unknown amount in {words(channel)}"
    where = f" in {words(channel)}" if len(results.channels) > 1 else ""
    return f"{reading(score.verified_rmse, score.unit)} RMS{where}, {percent(score.verified_relative)} of the peak"


def percent(share: float, digits: int = 2) -> str:
    """`5.4 %` of 0.054."""
    return f"{significant(share * 100, digits)} %"


def offset_text(results: InversionResults) -> str:
    """How the clocks of simulation and record were laid over each other."""
    if results.inversion.time_offset.sigma is None:
        return "record and simulation share one clock"
    if abs(results.offset) < 5e-7:
        return "the clocks of record and simulation agree within 1 µs"
    later = "later" if results.offset > 0 else "earlier"
    shift = abs(results.offset)
    size = f"{significant(shift * 1e6, 2)} µs" if shift < 1e-5 else quantity(shift, "s")
    return f"the simulation's clock set {size} {later} to fit the record"


def identified(results: InversionResults) -> str:
    """Which parameters are identified, with intervals, and which are not, with the reason in short."""
    parameters = results.answer.parameters
    found = [_estimated(results, name) for name, estimate in parameters.items() if estimate.identified]
    reasons: dict[str, list[str]] = {}
    for name, estimate in parameters.items():
        if not estimate.identified:
            reasons.setdefault(estimate.reason, []).append(symbol(name, parameters))
    open_ones = "; ".join(f"{', '.join(names)}: {_of(names, reason)}" for reason, names in reasons.items())
    first = f"Identified by the {results.best}: {'; '.join(found) or 'none'}"
    rest = f"Not identified: {open_ones}." if open_ones else "Every parameter is identified."
    return f"{first}. {rest}{_diagnosed(results)}"


def _of(names: Sequence[str], reason: str) -> str:
    """A reason, which is stated of one parameter, of so many."""
    return reason if len(names) == 1 else reason.replace("this parameter", "these parameters")


def _diagnosed(results: InversionResults) -> str:
    """What the diagnosis identifies: it calibrates the bird anew, so that its answer may be another one."""
    if not isinstance(results, Results) or results.diagnosis is None:
        return ""
    found = Diagnosis.read(results.diagnosis / "diagnosis.json")
    parameters = (found.after or found.before).parameters
    added = f" and the effect {in_words(found.after.model)}" if found.after else ""
    told = [
        f"{parameter_label(name, parameters)} {_with_interval(entry['value'], entry['unit'], entry['interval_95'])}"
        for name, entry in parameters.items()
        if entry.get("identified", True)
    ]
    return f" The diagnosis, with simulations of its own{added}, identifies {'; '.join(told) or 'none'}."


def _estimated(results: InversionResults, name: str) -> str:
    """`viscosity MU 641 Pa s (95 %: 500 Pa s to 900 Pa s)`."""
    parameters = results.answer.parameters
    estimate, label = parameters[name], parameter_label(name, parameters)
    return f"{label} {_with_interval(estimate.value, estimate.unit, estimate.interval_95)}".rstrip()


def _with_interval(value: float | None, unit: str, interval_95: Sequence[float] | None) -> str:
    """`641 Pa s (95 %: 500 Pa s to 900 Pa s)`, of what is known of it."""
    size = "" if value is None else quantity(value, unit)
    if interval_95 is None:
        return size
    low, high = (quantity(end, unit) for end in interval_95)
    return f"{size} (95 %: {low} to {high})".lstrip()


def reach_and_residual(results: Results) -> str:
    """Whether the campaign's simulations reach the record, and the largest residual of the best verification."""
    if len(results.channels) == 1:
        channel = results.channels[0]
        where, largest = prior_text(results, channel), worst_text(results, channel, results.best)
    else:
        where = _prior_texts(results)
        largest = listing([_worst_of(results, channel, results.best) for channel in results.channels])
    return (
        f"Prior predictive: {where}; {_fit(results)}. Largest residual of the {results.best}'s verification: {largest}."
    )


def _prior_texts(results: Results) -> str:
    """Of several channels: those outside all simulations, how often and how far, then those within their range."""
    outside, within = list[str](), list[str]()
    for channel in results.channels:
        seen, unit = record_position(results, channel), results.record.units[channel]
        if not (count := int(seen.outside.sum())):
            within.append(words(channel))
            continue
        outside.append(f"{words(channel)} ({count} of {seen.points} points, {_farthest(seen, unit)})")
    runs = _runs(results)
    if not outside:
        return f"within noise the record lies within the range of the campaign's {runs} in {listing(within)}"
    beyond = f"the record lies outside the campaign's {runs} by more than noise in {listing(outside)}"
    return f"{beyond}, within their range in {listing(within)}" if within else beyond


def _worst_of(results: InversionResults, channel: str, method: str) -> str:
    """`0.39 mm in displacement centre at 1.34 ms (simulation below)`."""
    at, value = residual(results, channel, method).worst
    side, size = "above" if value > 0 else "below", reading(abs(value), results.record.units[channel])
    return f"{size} in {words(channel)} at {quantity(at, 's')} (simulation {side})"


def _fit(results: Results) -> str:
    """The inversion's verdict on the whole curve; the emulator's own error counts as much as the noise in it."""
    found = results.inversion.prior_predictive
    if found.inside:
        return "within noise and the emulator's error the model can produce the whole curve"
    if found.coarse:
        return f"the emulator is too coarse to say whether the model can produce the whole curve; {found.coarse}"
    return (
        "no values of the parameters within their ranges produce the whole curve within noise and the emulator's error"
    )


def worst_text(results: InversionResults, channel: str, method: str) -> str:
    """`0.39 mm at 1.34 ms, the simulation below the record in displacement centre`."""
    at, value = residual(results, channel, method).worst
    side = "above" if value > 0 else "below"
    size = reading(abs(value), results.record.units[channel])
    return f"{size} at {quantity(at, 's')}, the simulation {side} the record in {words(channel)}"


def prior_text(results: Results, channel: str) -> str:
    """`the record's displacement centre lies outside all 25 simulations ... at 8 of 12 points, up to 0.41 mm above`."""
    seen, unit = record_position(results, channel), results.record.units[channel]
    count, runs = int(seen.outside.sum()), _runs(results)
    if not count:
        points = f"within noise, at all {seen.points} points"
        return f"the record's {words(channel)} lies within the range of the campaign's {runs}, {points}"
    return (
        f"the record's {words(channel)} lies outside the campaign's {runs} by more than noise at {count} of "
        f"{seen.points} points, {_farthest(seen, unit)}"
    )


def _farthest(seen: RecordPosition, unit: str) -> str:
    """How far the record lies outside the simulations: `up to 0.41 mm above them at 1.34 ms`."""
    at, value = peak(seen.time, seen.excess)
    return f"up to {reading(abs(value), unit)} {'above' if value > 0 else 'below'} them at {quantity(at, 's')}"


def smooth_limit(results: CampaignResults) -> str:
    """Share of its mass beyond which a bird that is lost makes another regime: `5 %`."""
    return f"{100 * results.dataset.smooth_loss:g} %"


def _runs(results: CampaignResults) -> str:
    """The simulations that the range is made of: `25 simulations`."""
    smooth = int(results.dataset.smooth.sum())
    eroded = f" with at most {smooth_limit(results)} erosion" if smooth < len(results.dataset.runs) else ""
    return f"{smooth} simulations{eroded}"


def balance(results: CampaignResults) -> str:
    """Number of simulations, the worst energy and momentum errors among them, and their cost."""
    energy, momentum = (worst_entry(results, key) for key in ("energy_error", "momentum_error"))
    seconds = sum(float(entry["wall_s"]) for entry in results.summaries.values())
    failed = f", {len(results.failures)} more failed" if results.failures else ""
    used = f"Energy balance: {len(results.summaries)} simulations used{failed}"
    cost = f"{_lasted(seconds)} of solver time."
    if energy is None or momentum is None:
        return f"{used}, {NO_BALANCE}; {cost}"
    return (
        f"{used}, worst energy error {percent(energy)} of "
        f"the initial normal kinetic energy ({worst_run(results, 'energy_error')}), worst momentum error "
        f"{of_momentum(momentum)}; {cost}"
    )


ROUNDING = 1e-9  # share up to which an error of momentum, or a correlation, is one of floating-point numbers


def of_momentum(error: float) -> str:
    """`0.02 % of the bird's momentum`, or that an error is as small as rounding makes it."""
    return f"{percent(error)} of the bird's momentum" if error > ROUNDING else "at the level of rounding"


def _lasted(seconds: float) -> str:
    """`28 s`, `4.6 minutes`, `3.2 hours`."""
    if seconds < 60.0:
        return f"{seconds:.0f} s"
    size, unit = (seconds / 60.0, "minutes") if seconds < 5940.0 else (seconds / 3600.0, "hours")
    return f"{rounded(size, 2)} {unit}"


NO_BALANCE = "errors of energy and momentum not known: an external solver's are not read, look into its own output"


def worst_entry(results: CampaignResults, key: str) -> float | None:
    """Largest magnitude of one entry in the summaries of the campaign's and the verification runs."""
    return largest(results.summaries, key)


def largest(summaries: Mapping[str, RunSummary], key: str) -> float | None:
    """Largest magnitude of one entry in runs' summaries; None where no run states it, as an external solver's do."""
    return max((abs(value) for value in _stated(summaries, key).values()), default=None)


def worst_run(results: CampaignResults, key: str) -> str:
    """The run with the largest magnitude of an entry that some run states, and whether it left the smooth regime."""
    values = _stated(results.summaries, key)
    label = max(values, key=lambda name: abs(values[name]))
    rough = {f"run {number}" for number in results.dataset.runs[~results.dataset.smooth]}
    return f"{label}, which lost over {smooth_limit(results)} of the bird" if label in rough else label


def _stated(summaries: Mapping[str, RunSummary], key: str) -> dict[str, float]:
    """One entry of the runs that state it, by their labels."""
    return {label: float(summary[key]) for label, summary in summaries.items() if summary.get(key) is not None}


def key_figures(results: Results) -> dict[str, object]:
    """The numbers behind the findings for other programs, SI."""
    return {
        "best": results.best,
        "methods": {
            method: {"verified_rmse": answer.verified_rmse, "verified_relative": answer.verified_relative}
            for method, answer in results.inversion.methods.items()
        },
        "identified": [name for name, estimate in results.answer.parameters.items() if estimate.identified],
        "inside_cloud": results.inversion.prior_predictive.inside,
        "time_offset": results.offset,
        "strikes": len(results.summaries),
        "worst_energy_error": worst_entry(results, "energy_error"),
        "solver_s": sum(float(entry["wall_s"]) for entry in results.summaries.values()),
    }
