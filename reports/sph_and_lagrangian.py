"""The same strike with an SPH and a Lagrangian bird: their figures side by side, and docs/sph_and_lagrangian.png.

python -m birdstrike.reports.sph_and_lagrangian [--case reference_strike] [--out docs/sph_and_lagrangian.png]
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

from birdstrike.data.histories import Histories
from birdstrike.reports.figures.bird_surfaces import bird_surfaces_figure
from birdstrike.reports.figures.quantities import quantity
from birdstrike.reports.figures.style import png
from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.simulate import simulate

METHODS = {"SPH": "sph", "Lagrangian hexahedra": "hexahedra"}
INSTANTS = "['0.5 ms', '1 ms', '1.5 ms', '2 ms']"


def strike(name: str, method: str) -> tuple[Case, Histories, float]:
    """The case with a bird of this method, its histories and the processor time that they took [s]."""
    case = load_case(name, {"bird.method": method, "time.snapshots": INSTANTS})
    started = time.process_time()
    histories = simulate(case, threads=1)
    return case, histories, time.process_time() - started


def note(histories: Histories) -> str:
    """Pieces, peak, impulse and eroded mass of a strike in one line."""
    summary, force = histories.summary, histories.channels["contact_force"]
    pieces = f"{summary['particles']} {'elements' if 'nodes' in summary else 'particles'}"
    peak = summary["peak"]["displacement_centre"]
    impulse = float(np.trapezoid(force, histories.time))
    eroded = summary["eroded_mass_fraction"]
    return (
        f"{pieces}; plate's centre {quantity(peak['value'], 'm')} at {quantity(peak['time'], 's')}; "
        f"impulse {impulse:.1f} N s; {f'{eroded:.1%} of the mass' if eroded else 'nothing'} eroded"
    )


def main(arguments: list[str] | None = None) -> None:
    """Run both strikes, print their figures and write the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--case", default="reference_strike")
    parser.add_argument("--out", type=Path, default=Path("docs/sph_and_lagrangian.png"))
    chosen = parser.parse_args(arguments)
    runs = {title: strike(chosen.case, method) for title, method in METHODS.items()}
    for title, (_, histories, cost) in runs.items():
        sys.stdout.write(f"{title}: {note(histories)}; {histories.summary['steps']} steps, {cost:.0f} s of one core\n")
    case, particles, _ = runs["SPH"]
    spacing = (case.bird.volume / particles.summary["particles"]) ** (1.0 / 3.0)
    snapshots = {title: histories.snapshots for title, (_, histories, _) in runs.items()}
    notes = {title: note(histories) for title, (_, histories, _) in runs.items()}
    figure = bird_surfaces_figure(snapshots, notes, case.plate.thickness, spacing)
    chosen.out.write_bytes(png(figure))


if __name__ == "__main__":
    main()
