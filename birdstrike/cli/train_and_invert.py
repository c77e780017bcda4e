"""`birdstrike train-and-invert`: from a campaign and a measured curve to parameters, verified by the solver."""

from __future__ import annotations

from collections.abc import Iterator
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from birdstrike.cli.frame import console, framed, progress_bar, say, warn
from birdstrike.cli.next_steps import following
from birdstrike.cli.options import Channels, Json, RetryFailed, ShotRecords, names_of, refinement_runs
from birdstrike.data.errors import UserError
from birdstrike.data.formatting import key_labels

if TYPE_CHECKING:
    from birdstrike.inversion.results.estimates import Answer, ChannelScore, Estimate
    from birdstrike.inversion.results.inversion import Inversion


class Trainer(StrEnum):
    """How the network is trained."""

    lm = "lm"
    adam = "adam"
    br = "br"
    ensemble = "ensemble"


class Outputs(StrEnum):
    """What the network's outputs may be."""

    bounded = "bounded"
    linear = "linear"


class Method(StrEnum):
    """Which inversion is run."""

    network = "network"
    emulator = "emulator"
    both = "both"


@framed
def command(
    doe: Annotated[
        list[Path], typer.Argument(metavar="DOE...", help="Folder of a finished campaign (run-doe); one for each case.")
    ],
    measured: ShotRecords,
    out: Annotated[Path, typer.Option(help="Folder for inversion.json and what belongs to it.")],
    trainer: Annotated[
        Trainer, typer.Option(help="Levenberg-Marquardt, Adam, Bayesian regularisation, or 50 networks at once.")
    ] = Trainer.lm,
    method: Annotated[Method, typer.Option(help="Inverse network, forward emulator, or both.")] = Method.both,
    case: Annotated[
        list[str], typer.Option(help="The measurement's case, one for each; by default the campaign's own.")
    ] = [],  # noqa: B006 (typer copies it)
    seed: Annotated[int, typer.Option(min=0, help="Start of the network and of the emulator's fit.")] = 0,
    refine: Annotated[
        str,
        typer.Option(
            help="Runs that may be added where the answer may lie; auto: up to 10, while the emulator widens intervals."
        ),
    ] = "auto",
    hidden: Annotated[str, typer.Option(help="Hidden neurons, or search (7 to 14, cross-validated).")] = "9",
    copies: Annotated[
        int | None,
        typer.Option(min=0, help="Copies of every training run with noise; by default 10, 0 if linear or an ensemble."),
    ] = None,
    outputs: Annotated[
        Outputs, typer.Option(help="The network's outputs: bounded by the ranges, or linear, as in the paper.")
    ] = Outputs.bounded,
    discrepancy: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            max=1.0,
            help="Slow error of the model, share of each channel's peak (1 sigma); by default the case's own.",
        ),
    ] = None,
    mesh: Annotated[
        Path | None, typer.Option(help="convergence.csv of birdstrike converge: the mesh's uncertainty is carried.")
    ] = None,
    mesh_correction: Annotated[
        bool,
        typer.Option(
            "--mesh-correction",
            help="Correct the campaign by 10 simulations with 8 times the particles, and verify so.",
        ),
    ] = False,
    filter: Annotated[  # noqa: A002 (the option's name)
        str | None, typer.Option(help="CFC60, CFC180, CFC600 or CFC1000, zero-phase, for record and model alike.")
    ] = None,
    filtered: Annotated[
        str | None, typer.Option(help="The filter that the laboratory has used on the record: for the model alone.")
    ] = None,
    posterior: Annotated[
        bool, typer.Option(help="Draw the posterior and its identifiability; else linearised intervals.")
    ] = True,
    allow_rank_deficient: Annotated[
        bool, typer.Option("--allow-rank-deficient", help="Give the combination that such a design carries.")
    ] = False,
    channels: Channels = "",
    retry_failed: RetryFailed = False,
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Train on a campaign, invert one or several measured curves, and re-run the solver at each answer.

    Example: birdstrike train-and-invert campaign --measured table7_group5 --out inversion --refine 5

    The folder campaign: birdstrike run-doe reference_strike --out campaign --runs 25
    """
    from birdstrike.inversion.extras import Extras
    from birdstrike.inversion.train_and_invert import train_and_invert

    extras = Extras(
        refine=refinement_runs(refine),
        hidden=_neurons(hidden),
        copies=copies,
        discrepancy=discrepancy,
        mesh=mesh,
        filter=filter,
        filtered=filtered,
        posterior=posterior,
        retry_failed=retry_failed,
        channels=names_of(channels),
        mesh_correction=mesh_correction,
        outputs=outputs.value,
    )
    with progress_bar("train, invert, verify") as progress:
        inversion = train_and_invert(
            doe,
            measured,
            out,
            trainer=trainer.value,
            method=method.value,
            case=case,
            seed=seed,
            progress=progress,
            allow_rank_deficient=allow_rank_deficient,
            extras=extras,
        )
    warn(inversion.warnings, f"{out / 'inversion.json'}")
    for line in lines(inversion):
        say(line)
    for name, answer in inversion.methods.items():
        console.print(table(inversion, name, answer))
        for line in reasons(answer):
            say(line)
    say(closing(inversion, doe[0], out))
    return {"out": str(out), "inversion": str(out / "inversion.json"), **summary(inversion)}


def _neurons(text: str) -> int | None:
    """Hidden neurons; None for a search. Raises UserError."""
    from birdstrike.inversion.extras import MOST_HIDDEN

    if text == "search":
        return None
    if not text.isdecimal() or not 1 <= int(text) <= MOST_HIDDEN:
        raise UserError(f'--hidden = {text} must be a number from 1 to {MOST_HIDDEN}, or "search"')
    return int(text)


def lines(inversion: Inversion) -> Iterator[str]:
    """What stands above the tables: provenance, training, time origin, posterior."""
    from birdstrike.data.formatting import listing

    if simulated := inversion.simulated_records:
        yield f"measurement: {listing(simulated)} {'are' if len(simulated) > 1 else 'is'} simulated, not measured"
    if inversion.training is not None:
        yield f"network {inversion.training.shape} ({inversion.training.trainer}): {inversion.training.status}"
    for channel, q2 in inversion.emulator.q2.items():
        known = "no variance to predict" if q2 is None else f"leave-one-out Q2 {q2:.4f}"
        yield f"emulator of {channel}: {inversion.emulator.components[channel]} components, {known}"
    yield inversion.time_offset.sentence
    yield from posterior_lines(inversion)


def posterior_lines(inversion: Inversion) -> Iterator[str]:
    """Known errors, shots, refinement, posterior and directions, one line each."""
    from birdstrike.data.formatting import many, signed_ms

    if inversion.known_errors:
        yield f"carried by the model: {'; '.join(inversion.known_errors)}"
    for figures in inversion.mesh_correction:
        yield figures.sentence
    for shot in inversion.shots:
        yield f"shot {shot.path}: time origin {signed_ms(shot.time_offset)} on its own"
    if inversion.shot_scatter is not None:
        few = len(inversion.shots)
        yield (
            f"shot-to-shot scatter of the curves' size: {100 * inversion.shot_scatter:g} % (1 sigma), the most likely "
            f"value and low on average: {few} shots determine it poorly, and 0 is no proof that there is none"
        )
    if inversion.refinement is not None:
        ends = inversion.refinement
        yield (
            f"refinement: {many(len(ends.added), 'run')} added; emulator's error at the answer {ends.error[0]:.2f} -> "
            f"{ends.error[-1]:.2f} of the noise; {ends.reason}"
        )
    if (posterior := inversion.posterior) is not None:
        worst = max((rhat for rhat in posterior.rhat.values() if rhat is not None), default=float("nan"))
        yield (
            f"posterior: {posterior.steps} steps, R-hat {worst:.3f}, "
            f"{min(posterior.effective.values()):.0f} effective draws or more of each parameter"
        )
    if inversion.identifiability is not None and inversion.prior_predictive.inside:
        weak = [d.words for d in inversion.identifiability.directions if d.null]
        if weak:
            yield f"directions that are not identifiable from this record: {'; '.join(weak)}"


def table(inversion: Inversion, name: str, answer: Answer) -> Table:
    """Parameter, value, 95 % interval, identified; narrow enough for a terminal of 80 columns."""
    shown = Table(title=f"{name}: {_errors(answer)}", title_justify="left")
    for head in ("parameter", "value", "95 % interval", "identified"):
        shown.add_column(head, overflow="fold")
    labels = key_labels(answer.parameters)
    for key, estimate in answer.parameters.items():
        shown.add_row(labels[key], *_cells(estimate, inversion.ranges[key]))
    if answer.combination is not None:
        shown.caption, shown.caption_justify = answer.combination.sentence, "left"
    return shown


def reasons(answer: Answer) -> Iterator[str]:
    """Why each parameter is identified or not; those of one reason on one line."""
    said: dict[str, list[str]] = {}
    labels = key_labels(answer.parameters)
    for key, estimate in answer.parameters.items():
        said.setdefault(estimate.reason, []).append(labels[key])
    for reason, names in said.items():
        yield f"  reason, {', '.join(names)}: {reason.removeprefix(f'{names[0]}: ')}"


def _cells(estimate: Estimate, limits: tuple[float, float]) -> tuple[str, str, str]:
    """A parameter that is not identified is shown as its range, or its prior, never as a number with digits."""
    from birdstrike.data.formatting import quantity, span

    interval = span(*estimate.interval_95, estimate.unit) if estimate.interval_95 else "-"
    if not estimate.identified or estimate.value is None:
        return f"in {span(*(estimate.interval_95 or limits), estimate.unit)}", interval, "no"
    return quantity(estimate.value, estimate.unit, 4), interval, "yes"


def _errors(answer: Answer) -> str:
    """Verified errors of every channel."""
    parts = [_error(channel, score) for channel, score in answer.channels.items()]
    return answer.failure or "; ".join(parts)


def _error(channel: str, score: ChannelScore) -> str:
    """One channel's verified error, and what it is without the time origin."""
    from birdstrike.data.formatting import reading

    if score.verified_rmse is None or score.verified_relative is None:
        return f"{channel} not verified"
    text = f"{channel} verified at {reading(score.verified_rmse, score.unit)} RMS"
    unshifted = score.verified_rmse_at_zero_offset
    share = f"{100 * score.verified_relative:.1f} % of the peak"
    if unshifted is None or unshifted == score.verified_rmse:
        return f"{text}, {share}"
    return f"{text}, {share} ({reading(unshifted, score.unit)} at zero offset)"


def closing(inversion: Inversion, doe: Path, out: Path) -> str:
    """The verdict, where everything is, and what to do next."""
    from birdstrike.inversion.estimation.verification import verdict

    loop = out.parent if (out.name, doe.name, out.parent) == ("inversion", "doe", doe.parent) else None
    after = following("report", loop) if loop else following("report", out, "--doe", doe)
    return f"{verdict(inversion)}\nWritten to {out}: inversion.json, verification.csv. {after}"


def summary(inversion: Inversion) -> dict[str, Any]:
    """What the --json line carries."""
    methods = {
        name: {"verified_rmse": answer.verified_rmse, "verified_relative": answer.verified_relative}
        for name, answer in inversion.methods.items()
    }
    return {"best": inversion.best, "methods": methods, "warnings": list(inversion.warnings)}
