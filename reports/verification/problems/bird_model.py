"""The paper's four bird models with its constants on the reference strike: what it says of them beside our runs."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from birdstrike.data.histories import Array, Histories
from birdstrike.reports.verification.draw import Curve, Panel, draw
from birdstrike.reports.verification.problem import Computed, Picture, Problem, Row, Solution, rms_of_peak, shown
from birdstrike.reports.verification.runs import RunSpec

SOURCE = "Shock and Vibration 2022, art. 2456777: LS-DYNA (simulated), in words and pictures only"
RADIUS = 0.05  # m, of the patch at the plate's centre: about the bird's
CHANGES = (
    ("time.snapshots", '["0.1 ms", "1.5 ms"]'),
    ("sensors.pressure_centre.kind", "pressure"),
    ("sensors.pressure_centre.at", '["0 mm", "0 mm"]'),
    ("sensors.pressure_centre.radius", f"{1e3 * RADIUS:g} mm"),
)
MODELS = {
    "inverted": RunSpec("reference_strike", CHANGES),
    "elastic": RunSpec("reference_strike_elastic", CHANGES),
    "plastic kinematic": RunSpec("reference_strike_plastic_kinematic", CHANGES),
    "hydrodynamic": RunSpec("reference_strike_hydrodynamic", CHANGES),
}
ALIKE = ("plastic kinematic", "hydrodynamic")
FORCES = {
    "contact force": lambda run: run.channels["contact_force"],
    "reaction of the frame": lambda run: np.abs(run.channels["reaction_force"]),
    "force on the centre patch": lambda run: math.pi * RADIUS**2 * run.channels["pressure_centre"],
}
"""What "force of the centre of the flat plate" (its Fig. 9) may mean: (n,) N."""


def deflection(run: Histories) -> Array:
    """Of the plate's centre [mm]."""
    return 1e3 * run.channels["displacement_centre"]


def deformation(run: Histories) -> float:
    """Share: how far what is left of the bird has moved from its shape in flight, over its radius of gyration.

    Root mean square over the particles that are not eroded, translation and rotation taken off.
    """
    before, after = run.snapshots[0], run.snapshots[-1]
    x, y = (s.particles[~after.eroded] - s.particles[~after.eroded].mean(axis=0) for s in (before, after))
    turned = Rotation.align_vectors(y, x)[0].apply(x)
    return float(np.sqrt(((y - turned) ** 2).sum() / (x**2).sum()))


def stress(run: Histories) -> tuple[float, float]:
    """Median von Mises stress of what is left of the bird, largest of the plate [MPa], at 1.5 ms."""
    last = run.snapshots[-1]
    return 1e-6 * float(np.median(last.bird_stress[~last.eroded])), 1e-6 * float(last.plate_stress.max())


def solve(computed: Computed) -> Solution:
    """Each claim as a figure; nothing is judged, since the paper gives no numbers."""
    runs = {name: computed[spec] for name, spec in MODELS.items()}
    peaks = {name: float(deflection(run).max()) for name, run in runs.items()}
    rows = [_over("elastic bird: peak displacement over the next largest", peaks, "mm")]
    for label, force in FORCES.items():
        rows.append(
            _over(
                f"elastic bird: peak {label} over the next largest",
                {n: _peak_kn(force(r)) for n, r in runs.items()},
                "kN",
            )
        )
    one, other = (runs[name] for name in ALIKE)
    apart = rms_of_peak(deflection(other), deflection(one))
    note = "claimed: nearly the same displacement and force"
    rows.append(_row("plastic kinematic against hydrodynamic: displacement, RMS of peak", apart, "%", note))
    forces = [FORCES["contact force"](run) for run in (one, other)]
    apart = 100.0 * abs(forces[1].max() / forces[0].max() - 1.0)
    rows.append(_row("plastic kinematic against hydrodynamic: peak contact force, difference", apart, "%", note))
    for name, run in runs.items():
        note = f"claimed for {' and '.join(ALIKE)}: a large deformation of the bird, a small one of the plate"
        lost = float(run.summary["eroded_mass_fraction"])
        note += f"; peak displacement {peaks[name]:.2f} mm; {100.0 * lost:.0f} % of the bird eroded by 3 ms"
        rows.append(_row(f"{name} bird: its deformation at 1.5 ms over its size", 100.0 * deformation(run), "%", note))
    for name, run in runs.items():
        bird, plate = stress(run)
        note = f"claimed: lower in both for {' and '.join(ALIKE)}; largest stress in the plate {plate:.0f} MPa"
        rows.append(_row(f"{name} bird: median von Mises stress in it at 1.5 ms", bird, "MPa", note))
    return Solution(tuple(rows), pictures(runs))


def _peak_kn(force: Array) -> float:
    return 1e-3 * float(force.max())


def _over(name: str, peaks: dict[str, float], unit: str) -> Row:
    """The elastic bird's peak over the largest of the others."""
    ratio = peaks["elastic"] / max(value for key, value in peaks.items() if key != "elastic")
    found = ", ".join(f"{key} {value:.3g}" for key, value in peaks.items())
    return _row(name, ratio, "", f"claimed: the elastic bird's is the largest, above 1; {found} {unit}")


def _row(name: str, ours: float, unit: str, note: str) -> Row:
    return shown(name, ours, unit, SOURCE, note, "bird_models")


def pictures(runs: dict[str, Histories]) -> tuple[Picture, ...]:
    """Displacement and contact force; the other readings of the force."""
    values_of = {"centre displacement [mm]": deflection} | {
        f"{label} [kN]": lambda run, force=force: 1e-3 * force(run) for label, force in FORCES.items()
    }
    panels = [
        Panel(
            "time [ms]",
            label,
            [Curve(name, 1e3 * run.time, values(run)) for name, run in runs.items()],
            legend=label.startswith("contact"),
        )
        for label, values in values_of.items()
    ]
    first = (
        "The paper's bird models with its constants on the reference strike (Tables 9 to 13): displacement and force "
        "of the contact."
    )
    second = (
        'The other two readings of its "force of the centre of the flat plate": the frame\'s reaction, and the force '
        f"on a patch of {1e3 * RADIUS:g} mm radius at the centre. Colours as above."
    )
    return (
        Picture("bird_models", draw(*panels[:2]), first),
        Picture("bird_model_forces", draw(*panels[2:]), second),
    )


ABOUT = (
    "The paper compares one bird inverted from a measurement with three that carry constants of the literature, each "
    "in LS-DYNA. It gives no numbers, so that its statements stand here as figures of ours without tolerance. Whether "
    "the force of its Fig. 9 is that of the contact, of the frame or on a patch at the centre is not said: all three "
    "are shown. Which model predicts best when each is calibrated is the question of calibrate-models."
)
PROBLEMS = (Problem("bird_models", "The paper's four bird models", ABOUT, solve, tuple(MODELS.values())),)
