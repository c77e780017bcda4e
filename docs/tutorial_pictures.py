"""Pictures of docs/tutorial.md from a run of the commands that it shows: `python docs/tutorial_pictures.py FOLDER`.

The solver plays the test rig, coarse enough for minutes: 300 particles, 16 x 12 shells. What FOLDER holds is used.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "docs")]

from make_session import environment  # noqa: E402  # pyright: ignore[reportMissingImports] (docs/ is no package)

from birdstrike.data.curves import read_measured  # noqa: E402
from birdstrike.inversion.observations.raw import read_raw  # noqa: E402
from birdstrike.reports.figures.parameters import parameters_figure  # noqa: E402
from birdstrike.reports.figures.record import draw_record  # noqa: E402
from birdstrike.reports.figures.setup import setup_figure  # noqa: E402
from birdstrike.reports.results.reading import read_results  # noqa: E402
from birdstrike.reports.sections.curves import comparison, prior_predictive  # noqa: E402
from birdstrike.reports.sections.parameters import parameter_rows  # noqa: E402
from birdstrike.reports.sections.setup import drawn  # noqa: E402

PICTURES = ROOT / "docs" / "tutorial"
DPI = 72
CHANNEL = "displacement_centre"
COARSE = "--set bird.particles=300 --set plate.elements='[16, 12]'"
COMMANDS = (
    "test -f rig.toml || birdstrike new rig",
    f"test -f rig/record.csv || birdstrike simulate rig.toml --noise 12 --out rig {COARSE} "
    '--set bird.material.viscosity="420 Pa s" --set sensors.displacement_centre.noise="0.03 mm"',
    "birdstrike import rig/record.csv --sensor displacement_centre --out shot_12.csv",
    "birdstrike start --answers answers.toml",
)
ANSWERS = """
[record]
file = "shot_12.csv"
[effort]
particles = 300
elements = [16, 12]
runs = 16
diagnosis = false
"""


def main(folder: Path) -> None:
    """Run the commands where that is due, and draw."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "answers.toml").write_text(ANSWERS, encoding="utf-8")
    bin_folder = folder / ".bin"
    if bin_folder.is_dir():
        for path in (*bin_folder.iterdir(), bin_folder):
            path.unlink() if path.is_file() else path.rmdir()
    around = environment(bin_folder)
    for command in COMMANDS:
        subprocess.run(command, shell=True, cwd=folder, env=around, check=True)
    draw(folder)


def draw(folder: Path) -> None:
    """The pictures of what the folder holds."""
    PICTURES.mkdir(exist_ok=True)
    record = read_measured(folder / "shot_12.csv")
    draw_record(record, read_raw(record), PICTURES / "record.png")
    results = read_results(folder / "shot_12" / "loop")
    save(setup_figure(drawn(results.case)), "setup")
    save(prior_predictive(results, CHANNEL), "campaign")
    save(comparison(results, CHANNEL), "comparison")
    save(parameters_figure(parameter_rows(results)), "parameters")


def save(figure: Figure, name: str) -> None:
    """A picture of moderate size."""
    figure.savefig(PICTURES / f"{name}.png", dpi=DPI, bbox_inches="tight")


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
