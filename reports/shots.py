"""An inversion of several shots as the page shows it: the first shot's curves, and a sentence about each other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from data.units import display
from inversion.inversion import Answer, Inversion, ShotFigures

T = TypeVar("T")


def first_shot(inversion: Inversion) -> Inversion:
    """The inversion with the channels of its first shot alone; parameters and posterior stay those of all shots."""
    if len(inversion.shots) < 2:
        return inversion
    emulator, measured, told = inversion.emulator, inversion.measured, inversion.identifiability
    residual = inversion.residual
    return replace(
        inversion,
        methods={name: replace(m, channels=_own(m.channels)) for name, m in inversion.methods.items()},
        emulator=replace(
            emulator,
            components=_own(emulator.components),
            loo_rmse=_own(emulator.loo_rmse),
            standardised_rms=_own(emulator.standardised_rms),
        ),
        measured=replace(
            measured,
            path=inversion.shots[0].path,
            points=_own(measured.points),
            noise=_own(measured.noise),
            noise_source=_own(measured.noise_source),
        ),
        cloud=replace(inversion.cloud, nearest_distance=_own(inversion.cloud.nearest_distance)),
        residual=residual
        and replace(residual, tau=_own(residual.tau), fit=_own(residual.fit), widened=_own(residual.widened)),
        identifiability=told and replace(told, sobol=_own(told.sobol)),
    )


def other_shots(inversion: Inversion) -> tuple[str, ...]:
    """One sentence about each shot that the page has no curves of: its record, its error, its clock."""
    if len(inversion.shots) < 2 or inversion.best is None:
        return ()
    best = inversion.methods[inversion.best]
    return tuple(
        f"{Path(shot.path).name} was inverted together with {Path(inversion.shots[0].path).name}, whose curves alone "
        f"this page shows; the {inversion.best}'s verification misses it by {_errors(best, shot)}; its clock is ahead "
        f"of its simulation's by {1e3 * shot.time_offset:.3g} ms by its own fit, which lies "
        f"{'inside' if shot.inside else 'OUTSIDE'} what its model can make"
        for shot in inversion.shots[1:]
    )


def _own(entries: Mapping[str, T]) -> dict[str, T]:
    """The entries of the first shot's channels."""
    return {channel: entry for channel, entry in entries.items() if "@" not in channel}


def _errors(answer: Answer, shot: ShotFigures) -> str:
    """RMS errors of a shot's channels, `0.1 mm RMS in displacement_centre (2 % of the peak)`."""
    said: list[str] = []
    for channel, score in answer.channels.items():
        if channel.endswith(shot.suffix) and score.verified_rmse is not None:
            number, unit = display(score.verified_rmse, score.unit)
            share = "" if score.verified_relative is None else f" ({100 * score.verified_relative:.2g} % of the peak)"
            said.append(f"{number:.3g} {unit} RMS in {channel.removesuffix(shot.suffix)}{share}".replace("  ", " "))
    return " and ".join(said) or "an unknown error"
