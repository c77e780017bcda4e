"""`birdstrike calibrate-models`: every bird model calibrated to the same shots, and ranked."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from birdstrike.cli.frame import console, framed, progress_bar, say, warn
from birdstrike.cli.next_steps import following
from birdstrike.cli.options import (
    CaseName,
    Channels,
    Json,
    RetryFailed,
    Settings,
    ShotCases,
    ShotRecords,
    Workers,
    names_of,
    overrides,
)

if TYPE_CHECKING:
    from birdstrike.inversion.models.results import ModelComparison


@framed
def command(
    case: CaseName,
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
    workers: Workers = None,
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

    cases = [load_case(name, overrides(settings)) for name in (case, *shot_case)]
    with progress_bar("calibrate models") as advance:
        comparison = calibrate_models(
            cases,
            list(measured),
            out,
            names_of(models, "--models", "null,elastic"),
            runs=runs,
            seed=seed,
            workers=workers,
            channels=names_of(channels),
            posterior=posterior,
            optimisers=names_of(optimisers, "--optimisers", "least_squares"),
            budget=budget,
            retry_failed=retry_failed,
            progress=lambda _, share: advance(share),
        )
    page = write_models_page(out)
    warn(comparison.warnings, f"{page} and models.json")
    if comparison.simulated:
        say(comparison.provenance)
    console.print(table(comparison))
    for line in lines(comparison):
        say(line)
    say(f"Written to {out}: models.json, {page.name}. {following('explore', out)}")
    return {
        "out": str(out),
        "models": str(out / "models.json"),
        "page": str(page),
        "ranking": list(comparison.ranking),
        "tied": list(comparison.tied),
        "expected": {name: comparison.models[name].expected for name in comparison.ranking},
        "warnings": list(comparison.warnings),
    }


def lines(comparison: ModelComparison) -> Iterator[str]:
    """What stands below the table: combinations, optimisers, each shot, the ranking."""
    for name in comparison.ranking:
        for combination in comparison.models[name].combinations.values():
            yield f"{name}: {combination.sentence}"
    yield from optimised_lines(comparison)
    for shot, sentence in comparison.per_shot_sentences.items():
        yield f"{shot}, {comparison.speeds[shot]:g} m/s: {sentence}"
    yield comparison.sentence


def optimised_lines(comparison: ModelComparison) -> Iterator[str]:
    """What optimisers with the solver in the loop reached, beside the calibration, as the page has it."""
    for name in comparison.ranking:
        model = comparison.models[name]
        calibrated = math.sqrt(
            sum(error.weighted**2 for error in model.verified.values()) / max(len(model.verified), 1)
        )
        for method, reached in model.optimised.items():
            yield (
                f"{name} by {method.replace('_', ' ')}: error {reached.weighted:.2f} times the noise with "
                f"{reached.strikes} simulations a shot ({reached.ended}); the calibration's {calibrated:.2f} with "
                f"{max(model.strikes.values(), default=0)}"
            )


def table(comparison: ModelComparison) -> Table:
    """Models, best first: held-out error over the noise, overall and by shot."""
    shown = Table(title="held-out error over noise (95 %)", title_justify="left")
    for head in ("bird model", "expected", *comparison.speeds, "best"):
        shown.add_column(head, overflow="fold", no_wrap=head == "bird model")
    for name in comparison.ranking:
        model = comparison.models[name]
        low, high = model.expected_95 or (float("nan"), float("nan"))
        heldout = (f"{model.heldout[shot]:.2f}" for shot in comparison.speeds)
        best = f"{100 * (model.probability_best or 0.0):.0f} %"
        shown.add_row(name, f"{model.expected:.2f} ({low:.2f} .. {high:.2f})", *heldout, best)
    return shown
