"""The surrogates: how far the network converged, and how well the emulator predicts new simulations."""

from __future__ import annotations

from birdstrike.inversion.results.ingredients import TrainingFigures
from birdstrike.reports.blocks import Block, Paragraph, Section, Table, drawing
from birdstrike.reports.figures.quantities import reading, words
from birdstrike.reports.figures.training import hidden_size_figure, training_figure
from birdstrike.reports.results.results import InversionResults


def section(results: InversionResults) -> Section:
    """Network first, as the literature has it; then the forward emulator."""
    return Section("surrogates", "Network and emulator", (*_network(results), _emulator(results)))


def _network(results: InversionResults) -> tuple[Block, ...]:
    training, convergence = results.inversion.training, results.convergence
    if training is None or convergence is None:
        return (Paragraph("No network was trained: the inversion was asked for the emulator alone."),)
    figure = training_figure(convergence.epoch, convergence.training, convergence.held_out, training.goal)
    facts = Table(
        ("what", "value"),
        (
            ("network", f"{training.shape}, trainer {training.trainer}, seed {results.inversion.seed}"),
            ("noisy copies of every run", str(training.copies)),
            ("why it stopped", training.status),
            ("hold-out and inputs", training.holdout),
        ),
        "The network's training.",
    )
    return (drawing("training", figure, _caption(training)), *_sizes(training), facts)


def _sizes(training: TrainingFigures) -> tuple[Block, ...]:
    """Error against the number of hidden neurons, where that was searched."""
    if not training.hidden_sizes:
        return ()
    words = (
        "Root mean square error of the outputs over the hidden neurons, cross-validated among the training runs: "
        "mean and standard deviation over the starts."
    )
    return (drawing("hidden-size", hidden_size_figure(training.hidden_sizes), words),)


def _caption(training: TrainingFigures) -> str:
    """Where both errors ended, and whether the network generalises."""
    reached = "reached" if training.mse <= training.goal else "not reached"
    text = (
        f"Mean square error of the network's outputs (parameters scaled to 0..1) over {training.epochs} epochs: "
        f"{training.mse:.2g} on the training simulations, goal {training.goal:g} {reached}"
    )
    if training.test_mse is None:
        return f"{text}; there is no held-out simulation."
    ratio = training.test_mse / max(training.mse, 1e-300)
    text += f"; {training.test_mse:.2g} on the held-out simulations"
    if ratio > 10:
        text += f", {ratio:.0f} times as much: the network does not generalise; use the held-out error"
    # A constant guess at the middle of a range errs by 1/12 when the parameter is spread evenly over it.
    if training.test_mse > 1 / 12:
        text += " (guessing the middle of every range would give about 0.083)"
    return f"{text}."


def _emulator(results: InversionResults) -> Table:
    figures, units = results.inversion.emulator, results.record.units
    rows = tuple(
        (
            words(channel),
            str(components),
            _known(figures.q2[channel]),
            reading(figures.loo_rmse[channel], units[channel]),
            _known(figures.standardised_rms[channel]),
        )
        for channel, components in figures.components.items()
    )
    caption = (
        "The forward emulator (principal components of the curves, a Gaussian process each), tested by predicting each "
        "simulation from all others. Q²: 1 is perfect, 0 no better than the mean curve. Standardised error: 1 when the "
        f"emulator's own error bars are honest. Simulations left out: {_numbers(figures.runs_left_out)}."
    )
    head = ("channel", "components", "leave-one-out Q²", "leave-one-out RMS error", "standardised error")
    return Table(head, rows, caption, frozenset(range(1, len(head))))


def _numbers(runs: tuple[int, ...]) -> str:
    return ", ".join(map(str, runs)) or "none"


def _known(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"
