"""What may be asked of an inversion beyond one campaign, one record and the paper's network."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from pathlib import Path

from birdstrike.data.arguments import refuse_other_kinds
from birdstrike.data.errors import UserError, refuse_not_whole
from birdstrike.inversion.estimation.refinement import AUTO, refuse_budget
from birdstrike.inversion.observations.filters import refuse_class
from birdstrike.surrogate.inverse_network import HIDDEN

MOST_HIDDEN = 100
"""Neurons of the network."""


@dataclass(frozen=True)
class Extras:
    """What may be asked for beyond one campaign, one record and the paper's network.

    refine: runs that may be added near the answer, "auto" while they pay; hidden: neurons, None searches; copies: noisy
    copies of every training run, None for 10 (0 with linear outputs or an ensemble); discrepancy: a stated slow error
    of the model, share of each channel's peak (1 sigma), None for what the case states by sensor; mesh: curves of a
    mesh study (convergence.csv), whose uncertainty every model then carries; filter: a named zero-phase filter
    for record and model alike; filtered: the one that the laboratory has passed the record through, for the model
    alone; posterior: drawn, with the identifiability's figures; else the intervals are linearised; retry_failed: runs
    with a failure on record are tried again;
    retry: those alone whose failure was stored before this time [s, Unix], where a longer command has taken it;
    channels: of the record that are used, all where none is named; mesh_correction: whether a few simulations on a
    finer mesh correct the campaign's curves; outputs: of the network, "bounded" by the ranges or "linear", the paper's;
    more_runs: the option by which the command that asks adds runs, for messages.
    """

    refine: int | str = AUTO
    hidden: int | None = HIDDEN
    copies: int | None = None
    discrepancy: float | None = None
    mesh: Path | None = None
    filter: str | None = None
    filtered: str | None = None
    posterior: bool = True
    retry_failed: bool = False
    retry: float = 0.0
    channels: str | Sequence[str] = ()
    mesh_correction: bool = False
    outputs: str = "bounded"
    more_runs: str = "--refine N"


def refuse_values(more: Extras) -> None:
    """Raises UserError for numbers that the command refuses too, and a Python call may give."""
    if more.copies is not None:
        refuse_not_whole("copies", more.copies, "leave it out for 10", least=0)
    if more.hidden is not None:
        refuse_not_whole("hidden", more.hidden, "None searches for it", least=1)
        if more.hidden > MOST_HIDDEN:
            raise UserError(f"hidden = {more.hidden} is above {MOST_HIDDEN}; None searches for it")
    refuse_budget(more.refine)
    share = more.discrepancy
    if share is not None and (not isinstance(share, Real) or not 0.0 <= share <= 1.0):
        raise UserError(
            f"discrepancy = {share!r} is outside 0 .. 1: it is a share of each channel's peak (1 sigma), such as 0.02"
        )
    refuse_other_kinds(more)
    _refuse_filters(more)


def _refuse_filters(more: Extras) -> None:
    """Raises UserError for an unknown class, and for a record that would be filtered twice."""
    for option in ("filter", "filtered"):
        if (name := getattr(more, option)) is not None:
            refuse_class(option, name)
    if more.filter and more.filtered:
        raise UserError(
            f"filter = {more.filter} and filtered = {more.filtered} were both given: a record that the laboratory has "
            "filtered would be filtered twice, the model once; leave one out"
        )
