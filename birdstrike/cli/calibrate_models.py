"""`birdstrike calibrate-models`: every bird model calibrated to the same shots, and ranked."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from birdstrike.cli.frame import (
    Channels,
    Json,
    RetryFailed,
    Settings,
    ShotCases,
    ShotRecords,
    console,
    framed,
    names_of,
    overrides,
    progress_bar,
    say,
    warn,
)
from birdstrike.cli.next_steps import following

if TYPE_CHECKING:
    from birdstrike.inversion.models.results import ModelComparison


@framed
def command(
    case: Annotated[str, typer.Argument(help="A case file, or the name of a shipped case.")],
    measured: ShotRecords,
    out: Annotated[Path, typer.Option(help="Folder for models.json, the page and a folder a model; again to resume.")],
    models: Annotated[
        str,
        typer.Option(
            metavar="NAME,...",
            help="Bird models: null, elastic, plastic_kinematic, hydrodynamic, one of an installed package; MODEL+LAW "
            "with an equation of state, or LAW alone for null+LAW.",
        ),
    ] = "null,elastic,plastic_kinematic,hydrodynamic,murnaghan",
    shot_case: ShotCases = [],  # noqa: B006 (typer copies it)
    runs: Annotated[
        int, typer.Option(help="Simulations of each campaign, 8 to 2000; at most 15 more near the answer.")
    ] = 20,
    seed: Annotated[int, typer.Option(min=0, help="Of designs, emulators, sampling and bootstrap.")] = 0,
    workers: Annotated[int | None, typer.Option(help="Simulations at a time; all cores by default.")] = None,
    posterior: Annotated[bool, typer.Option(help="Draw the posteriors; else linearised intervals.")] = True,
    optimisers: Annotated[
        str,
        typer.Option(metavar="NAME,...", help="least_squares, cma: run beside it, with the solver in the loop."),
    ] = "",
    budget: Annotated[int, typer.Option(min=1, help="Simulations of each shot that an optimiser may spend.")] = 160,
    channels: Channels = "",
    retry_failed: RetryFailed = False,
    settings: Settings = [],  # noqa: B006 (typer copies it)
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Calibrate every bird model to one or several shots, verify each, and rank them by held-out error.

    Each model is calibrated to all shots together, and once more without each
    of them: the shot that was left out is then predicted by the solver. Models
    that the records cannot tell apart share the first place. Ranges come with
    the models; a case may state its own under inversion.models.NAME.

    Called again with the same --out, it resumes; models.json and the page
    rank the models that --models names.

    Example: birdstrike calibrate-models flat_plate_002_70 --measured flat_plate_002_70 --out models

    Two shots: birdstrike calibrate-models a.toml --measured a.csv --case b.toml --measured b.csv --out models_of_two
    """
    from birdstrike.inversion.models.calibrate_models import calibrate_models
    from birdstrike.reports.page.models import write_models_page
    from birdstrike.solver.case.case import load_case

    cases = [load_case(one, overrides(settings)) for one in (case, *shot_case)]
    with progress_bar("calibrate models") as advance:
        found = calibrate_models(
            cases,
            list(measured),
            out,
            names_of(models, "--models", "null,elastic"),
            runs,
            seed,
            workers,
            channels=names_of(channels),
            posterior=posterior,
            optimisers=names_of(optimisers, "--optimisers", "least_squares"),
            budget=budget,
            retry_failed=retry_failed,
            progress=lambda _, share: advance(share),
        )
    page = write_models_page(out)
    warn(found.warnings, f"{page} and models.json")
    if found.simulated:
        say(found.provenance)
    console.print(table(found))
    for name in found.ranking:
        for one in found.models[name].combinations.values():
            say(f"{name}: {one.sentence}")
    for line in optimised_lines(found):
        say(line)
    for shot, said in found.per_shot_sentences.items():
        say(f"{shot}, {found.speeds[shot]:g} m/s: {said}")
    say(found.sentence)
    say(f"Written to {out}: models.json, {page.name}. {following('explore', out)}")
    return {
        "out": str(out),
        "models": str(out / "models.json"),
        "page": str(page),
        "ranking": list(found.ranking),
        "tied": list(found.tied),
        "expected": {name: found.models[name].expected for name in found.ranking},
        "warnings": list(found.warnings),
    }


def optimised_lines(found: ModelComparison) -> Iterator[str]:
    """What optimisers with the solver in the loop reached, beside the calibration, as the page has it."""
    for name in found.ranking:
        one = found.models[name]
        own = math.sqrt(sum(error.weighted**2 for error in one.verified.values()) / max(len(one.verified), 1))
        for method, reached in one.optimised.items():
            yield (
                f"{name} by {method.replace('_', ' ')}: error {reached.weighted:.2f} times the noise with "
                f"{reached.strikes} simulations a shot ({reached.ended}); the calibration's {own:.2f} with "
                f"{max(one.strikes.values(), default=0)}"
            )


def table(found: ModelComparison) -> Table:
    """Models, best first: held-out error over the noise, overall and by shot."""
    shown = Table(title="held-out error over noise (95 %)", title_justify="left")
    for head in ("bird model", "expected", *found.speeds, "best"):
        shown.add_column(head, overflow="fold", no_wrap=head == "bird model")
    for name in found.ranking:
        one = found.models[name]
        low, high = one.expected_95 or (float("nan"), float("nan"))
        own = (f"{one.heldout[shot]:.2f}" for shot in found.speeds)
        best = f"{100 * (one.probability_best or 0.0):.0f} %"
        shown.add_row(name, f"{one.expected:.2f} ({low:.2f} .. {high:.2f})", *own, best)
    return shown
