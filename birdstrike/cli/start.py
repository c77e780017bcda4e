"""`birdstrike start`: from a measured file to a report by questions with defaults."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from birdstrike.cli.close_the_loop import diagnosis_lines, stage_display
from birdstrike.cli.frame import errors, framed, say, warn
from birdstrike.cli.next_steps import command_line
from birdstrike.cli.options import Json, Workers
from birdstrike.data.arguments import as_path
from birdstrike.data.errors import CaseError, UserError
from birdstrike.data.progress import Display, no_display

if TYPE_CHECKING:
    from birdstrike.data.histories import Histories
    from birdstrike.questions.answers import Answers, Question
    from birdstrike.questions.cost import Part
    from birdstrike.questions.shot import ShotAnswers
    from birdstrike.solver.case.case import Case

ANSWERS, SECTIONS = "answers.toml", ("plate", "bird", "impact")
MOST_WARNINGS = 3
"""Of the loop, on the last screen; the report holds all."""


@dataclass(frozen=True)
class Begun:
    """A shot's folder: its files, and the case that they make."""

    shot: ShotAnswers
    out: Path
    case: Case

    @property
    def case_file(self) -> Path:
        """The commented case."""
        return self.out / f"{self.shot.name}.toml"

    @property
    def record(self) -> Path:
        """The record as measured-data CSV."""
        return self.out / f"{self.shot.name}.csv"

    @property
    def picture(self) -> Path:
        """The set-up, drawn to scale."""
        return self.out / "setup.png"

    @property
    def loop(self) -> Path:
        """The loop's folder."""
        return self.out / "loop"


def start(
    answers: str | Path | Mapping[str, Any],
    out: str | Path | None = None,
    *,
    workers: int | None = None,
    display: Display | None = None,
    say: Callable[[str], None] = lambda _: None,
) -> dict[str, Any]:
    """From a measured file to the report, by answers alone: a TOML file or its content. The loop's outcome.

    out: folder of everything, by default named after the measured file. What an answer leaves out takes its default.
    Raises UserError that names the key of an answer that cannot be, and what close_the_loop raises; after either the
    same call resumes. A script that calls this needs `if __name__ == "__main__":`.
    """
    from birdstrike.questions.answers import Answers, read_answers

    given = answers if isinstance(answers, Mapping) else read_answers(as_path("answers", answers))
    asked = Answers(given)
    begun = begin(asked, None if out is None else as_path("out", out), say)
    _announce(begun, workers, say)
    return finish(begun, workers, display, say)


def begin(asked: Answers, out: Path | None, say: Callable[[str], None]) -> Begun:
    """The interview, and what follows from it: answers, case and picture in the folder. Raises UserError."""
    from birdstrike.data.storage.files import write_atomically
    from birdstrike.data.storage.out_folder import reserved
    from birdstrike.questions.case_file import case_text
    from birdstrike.solver.case.case import load_case

    shot, case = _consistent(asked)
    if asked.prompt is None and (unknown := asked.never_asked()):
        raise UserError(unknown, "answers that nobody asked for")
    folder = out or Path(shot.name)
    begun = Begun(shot, folder, case)
    asked.path = folder / ANSWERS
    with reserved(folder, "start"):
        folder.mkdir(parents=True, exist_ok=True)
        write_atomically(asked.path, asked.text())
        write_atomically(begun.case_file, case_text(shot))
        _draw(case, begun.picture)
    say(f"Your answers: {asked.path}; the case: {begun.case_file}; the set-up drawn to scale: {begun.picture}")
    return Begun(shot, folder, load_case(begun.case_file))


def _consistent(asked: Answers) -> tuple[ShotAnswers, Case]:
    """Answers that make a valid case; those that do not go together are asked again, or raise UserError."""
    import tomllib

    from birdstrike.cli.import_curve import factor_of
    from birdstrike.questions.case_file import case_text
    from birdstrike.questions.shot import Interview
    from birdstrike.solver.case.case import load_case

    while True:
        shot = Interview(asked, factor_of).shot()
        try:
            return shot, load_case(tomllib.loads(case_text(shot)))
        except CaseError as error:
            if asked.prompt is None:
                raise UserError([*error.errors, *asked.never_asked()], "the answers do not go together") from error
            for line in error.errors:
                errors.print(f"[red]{escape(line)}[/]")
            wrong = [key for key in asked.accepted if _concerns(key, shot, " ".join(error.errors))]
            asked.forget(*(wrong or [key for key in asked.accepted if key[0] in SECTIONS]))


def _concerns(key: tuple[str, ...], shot: ShotAnswers, text: str) -> bool:
    """Whether an error of the case speaks of an answer."""
    if key[0] != "columns":
        return ".".join(key) in text
    return any(column.name == key[1] and f"sensors.{name}" in text for name, column in shot.columns.items())


def _draw(case: Case, path: Path) -> None:
    """The picture of the set-up."""
    from birdstrike.reports.figures.style import write_figure
    from birdstrike.reports.sections.setup import set_up_figure

    write_figure(set_up_figure(case), path)


def _announce(begun: Begun, workers: int | None, say: Callable[[str], None]) -> None:
    """What follows from the answers, and what the loop will cost, before it is begun."""
    from birdstrike.cli.check import FACTS, check, shown

    facts = check(begun.case)
    wanted = {key: FACTS[key] for key in ("mass", "normal_speed", "first_period") if facts[key]}
    told = [f"{label} {shown(facts[key], unit)}" for key, (label, unit) in wanted.items()]
    say(f"Compare with what you know: {', '.join(told)}.")
    warn(facts["warnings"], "the report")
    if begun.loop.joinpath("close_the_loop.json").is_file():
        say("Begun before: what is still valid is not computed again.")
    for line in cost_lines(begun, workers):
        say(line)


def cost_lines(begun: Begun, workers: int | None) -> Iterator[str]:
    """How many simulations, seconds of each, minutes in all."""
    from birdstrike.data.formatting import many
    from birdstrike.questions.cost import at_the_fits, minutes, parts

    cores = workers or os.cpu_count() or 1
    found = parts(begun.case, begun.shot.runs, begun.shot.diagnosis)
    yield "What it will cost, by the estimate of birdstrike check (one core, compiled, nothing else running):"
    yield from (f"  {part.runs:4d} x {part.each:6.1f} s  {part.what}" for part in found)
    idle = many(cores, "idle core")
    yield f"  {_sum(found)}, about {minutes(found, cores):.0f} min on {idle} with everything else."
    if begun.shot.diagnosis:
        least, most, each = at_the_fits(begun.case)
        yield f"  Where an effect is likely, the diagnosis adds {least} to {most} x {each:.1f} s at its fits."


def _sum(found: tuple[Part, ...]) -> str:
    return f"{sum(part.runs for part in found)} simulations, {sum(part.seconds for part in found):.0f} s of one core"


def finish(begun: Begun, workers: int | None, display: Display | None, say: Callable[[str], None]) -> dict[str, Any]:
    """Import the record and close the loop; raises what these do."""
    from birdstrike.loop import close_the_loop

    _import(begun, say)
    say(f"The loop: {command_line('close-the-loop', begun.case_file, '--measured', begun.record, '--out', begun.loop)}")
    closed = close_the_loop(
        begun.case_file,
        begun.record,
        begun.loop,
        runs=begun.shot.runs,
        workers=workers,
        diagnosis=begun.shot.diagnosis,
        display=display or no_display,
        say=say,
    )
    files = {"case_file": begun.case_file, "record": begun.record, "answers": begun.out / ANSWERS}
    return {**closed, **{name: str(path) for name, path in files.items()}}


def _import(begun: Begun, say: Callable[[str], None]) -> None:
    """The record on the case's clock; where first contact is not known, one simulation of the case shows when."""
    from birdstrike.data.curves import read_measured
    from birdstrike.data.formatting import signed_ms
    from birdstrike.data.units import to_si
    from birdstrike.questions.clock import shift_to
    from birdstrike.questions.shot import UNKNOWN

    shot, case = begun.shot, begun.case
    if shot.contact != UNKNOWN:
        shift = case.first_contact - to_si(shot.contact, "s")
    else:
        _imported(begun, 0.0)
        until = case.first_contact + to_si(shot.until, "s")
        shift = shift_to(_simulated(begun, say), read_measured(begun.record), until)
        say(f"The response begins as the simulation's does when {signed_ms(shift)} are added to the record's clock.")
    _imported(begun, shift)
    _cut(begun)


def _cut(begun: Begun) -> None:
    """Leave out of the record what comes after the time that is to be used: the simulation must outlast the record."""
    from dataclasses import replace

    from birdstrike.data.curves import read_measured, write_measured
    from birdstrike.data.units import to_si

    record = read_measured(begun.record)
    used = record.time <= begun.case.first_contact + to_si(begun.shot.until, "s")
    if used.all():
        return
    channels = {name: values[used] for name, values in record.channels.items()}
    sigma = {name: values[used] for name, values in record.sigma.items()}
    late = int((~used).sum())
    points = "The point" if late == 1 else f"The {late} points"
    note = f"{points} later than {begun.shot.until} after first contact {'was' if late == 1 else 'were'} left out."
    kept = replace(record, time=record.time[used], channels=channels, sigma=sigma)
    write_measured(begun.record, replace(kept, provenance=(*record.provenance, note)))


def _imported(begun: Begun, shift: float) -> None:
    """Write the record, its clock shifted [s], by the reader of `birdstrike import`."""
    from dataclasses import replace

    from birdstrike.cli.import_curve import factors_of, import_curve
    from birdstrike.data.curves import read_measured, write_measured

    shot, text = begun.shot, f"{1e6 * shift:.1f} us"
    if shot.measured:
        record = read_measured(shot.record).only(tuple(shot.columns))
        record = record.scaled({name: float(column.scale) for name, column in shot.columns.items()})
        record = record.as_simulated() if shot.simulated else record
        note = f"{text} was added to the clock of {shot.record.name}."
        write_measured(begun.record, replace(record, time=record.time + shift, provenance=(*record.provenance, note)))
        return
    scales, units, per = factors_of({name: column.scale for name, column in shot.columns.items()})
    units |= {name: column.unit for name, column in shot.columns.items() if column.unit}
    import_curve(
        shot.record,
        begun.record,
        {name: column.name for name, column in shot.columns.items()},
        time=shot.time,
        units=units | ({"time": shot.time_unit} if shot.time_unit else {}),
        scales=scales,
        per=per,
        shift=text if shift else "",
        simulated=shot.simulated,
        decimal=shot.decimal,
        table=shot.table,
        encoding=shot.encoding,
    )


def _simulated(begun: Begun, say: Callable[[str], None]) -> Histories:
    """One simulation of the case at the values in its file, kept in `trial/`."""
    from birdstrike.data.storage.store import RunStore
    from birdstrike.inversion.forward import StoredSolver

    say("One simulation of the case, to lay the record's clock over the model's")
    return StoredSolver(begun.case, RunStore(begun.out / "trial"))({})


def last_screen(closed: Mapping[str, Any], loop: Path) -> Iterator[str]:
    """What was found, in words of one screen."""
    from birdstrike.data.formatting import many, quantity, reading, span
    from birdstrike.inversion.results.inversion import Inversion
    from birdstrike.reports.figures.quantities import parameter_label

    inversion = Inversion.load(loop / "inversion" / "inversion.json")
    assert inversion.best is not None
    answer = inversion.methods[inversion.best]
    yield ""
    yield "What was found"
    for name, one in answer.parameters.items():
        label = parameter_label(name)
        if one.identified and one.value is not None:
            interval = f" (95 %: {span(*one.interval_95, one.unit)})" if one.interval_95 else ""
            yield f"  {label}: {quantity(one.value, one.unit, 3)}{interval}"
        else:
            yield f"  {label}: not identified; any value in {span(*inversion.ranges[name], one.unit)} may be the bird's"
    for channel, score in answer.channels.items():
        if score.verified_rmse is not None and score.verified_relative is not None:
            size = reading(score.verified_rmse, score.unit, 2)
            share = f"{100 * score.verified_relative:.1f} % of the peak"
            sensor = channel.replace("_", " ")
            yield f"  The simulation at these values differs from the record's {sensor} by {size} RMS, {share}."
    if not inversion.prior_predictive.inside:
        yield "  No values within the ranges produce the whole record: use no parameter before this is explained."
    if closed.get("diagnosis"):
        yield from (f"  {line}" for line in diagnosis_lines(closed["diagnosis"]))
    warnings = list(dict.fromkeys(closed["warnings"]))
    yield from (f"  Warning: {line}" for line in warnings[:MOST_WARNINGS])
    if more := len(warnings[MOST_WARNINGS:]):
        yield f"  {many(more, 'more warning')} in the report."
    yield f"Report: {closed['paths']['report']}; the case: {closed['case_file']}; the answers: {closed['answers']}"
    yield f"Next: open the report in a browser; the cards: {command_line('export', loop)}"


@framed
def command(
    record: Annotated[
        Path | None, typer.Argument(metavar="[RECORD]", help="The measured file; asked for where it is left out.")
    ] = None,
    answers: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Answers in TOML; then nothing is asked.", dir_okay=False)
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder of everything; by default named after the record.")] = None,
    workers: Workers = None,
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """From a measured file to a report: asks for plate, bird, impact and sensors, writes the case, closes the loop.

    Return takes the default that is shown. Answers are kept as they are
    given: after Ctrl-C the same command goes on. With --answers nothing is
    asked, and what the file leaves out takes its default.

    Example: birdstrike start shot.csv

    In scripts: birdstrike start --answers shot/answers.toml
    """
    from birdstrike.questions.answers import Answers, about, read_answers

    if record is not None and not record.expanduser().is_file():
        raise UserError(f"RECORD = {record} is no file here; give the path of the measured file")
    if answers is not None:
        asked = Answers(about(read_answers(answers), record))
        begun = begin(asked, out, say)
        _announce(begun, workers, say)
    else:
        asked = _resumed(record, out)
        begun = begin(asked, asked.path.parent if asked.path else out, say)
        _announce(begun, workers, say)
        say(f"Look at {begun.picture} before you go on.")
        if not _typed(typer.confirm, "Is that your set-up, and shall it be computed?", default=True):
            raise UserError(f"nothing was computed; change {begun.out / ANSWERS} and run birdstrike start again")
    closed = finish(begun, workers, stage_display, say)
    for line in last_screen(closed, begun.loop):
        say(line)
    return closed


def _resumed(record: Path | None, out: Path | None) -> Answers:
    """The questions to the user; answers of an earlier call in the same folder are taken, and named."""
    from birdstrike.questions.answers import Answers, about, read_answers
    from birdstrike.questions.shot import name_of

    say("Return takes the value in brackets. Ctrl-C stops; the same command goes on from there.")
    if record is None and not (out is not None and (out / ANSWERS).is_file()):
        text = "Measured file: CSV, text, TDMS, .mat, .xlsx, UFF58, binout"
        record = Path(str(_typed(typer.prompt, text))).expanduser()
    given: Mapping[str, Any] = {}
    path = (out or Path(name_of(record or Path()))) / ANSWERS
    if path.is_file():
        say(f"Answers of {path} are taken; change them there.")
        given = read_answers(path)
    return Answers(about(given, record), _prompt, path)


def _prompt(question: Question, error: str) -> str:
    """What the user types; a list is shown with a comma."""
    if error:
        errors.print(f"[red]{escape(error)}[/]")
    default = question.default
    if isinstance(default, list):
        default = ", ".join(map(str, default))
    if isinstance(default, bool):
        default = "yes" if default else "no"
    return str(_typed(typer.prompt, question.text, default=default, show_default=default is not None))


def _typed(ask: Callable[..., Any], text: str, **shown: Any) -> Any:
    """What the user types; raises KeyboardInterrupt on Ctrl-C, and UserError where nobody is there to type."""
    try:
        return ask(text, **shown)
    except typer.Abort as error:
        if sys.stdin.isatty():
            raise KeyboardInterrupt from error
        raise UserError(
            "the input ended before the last question; birdstrike start asks in a terminal, and in a script takes a "
            "file of answers: --answers answers.toml"
        ) from error
