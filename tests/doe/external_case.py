"""A case whose solver is the oscillator, with the template of its deck: what an analyst writes for his own code."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from birdstrike.solver.case.case import Case, load_case

PROGRAM = Path(__file__).with_name("oscillator_program.py")

DECK = """$ {{ bird.shape }} on a plate of {{ plate.thickness | to("mm") }} mm
*OSCILLATOR
{{ 1.8 | card }}{{ 20 | card }}{{ viscosity | to("MPa ms") | card }}{{ (1.8 * velocity_normal) | to("mm/ms") | card }}
*CONTROL
{{ time.end | to("ms") | card }}{{ 0.005 | card }}
*BEHAVIOUR
{BEHAVIOUR}
"""

CASE = """solver = "external"

[plate]
length = "250 mm"
width = "200 mm"
thickness = "10 mm"
elements = [10, 8]
edges = "clamped"

[plate.material]
young = "70 GPa"
poisson = 0.3
density = "2700 kg/m^3"
yield_stress = "300 MPa"
tangent_modulus = "0 MPa"

[bird]
shape = "cylinder"
diameter = "100 mm"
length = "200 mm"
density = "950 kg/m^3"
method = "sph"
particles = 500

[bird.material]
model = "null"
pressure_cutoff = "-0.1 MPa"
viscosity = "0.4 MPa ms"
tension_erosion = 1.1
compression_erosion = 0.9
eos = {kind = "grueneisen", C = "1670 m/s", S1 = 2.48}

[impact]
speed = "91.1 m/s"
angle = "30 deg"

[time]
end = "2 ms"
output_interval = "20 us"

[sensors.displacement_centre]
kind = "displacement"

[external]
command = {COMMAND}
template = "strike.k.j2"
version = "oscillator 1"
success = "N o r m a l    t e r m i n a t i o n"
time_limit = "30 s"
keep = "none"

[external.sensors.displacement_centre]
{READING}
"""

UNITS = 'unit = "mm"\ntime_unit = "ms"\nfactor = -1'
NODOUT = f'format = "nodout"\nfile = "nodout"\nnode = 4711\ncomponent = "z-disp"\n{UNITS}'
CSV = f'format = "csv"\nfile = "sensors.csv"\ncolumn = "z_disp"\n{UNITS}'

SOUGHT = """
[inversion.parameters."bird.material.viscosity"]
range = ["100 Pa s", "1500 Pa s"]

[inversion.parameters."impact.speed"]
range = ["60 m/s", "120 m/s"]
"""


def written(folder: Path, reading: str = NODOUT, behaviour: str = "nothing", deck: str = DECK) -> Path:
    """The case's file in `folder`, beside its template."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "strike.k.j2").write_text(deck.replace("{BEHAVIOUR}", behaviour), encoding="utf-8")
    command = json.dumps([sys.executable, "-I", "-S", str(PROGRAM), "{input}"])
    text = CASE.replace("{COMMAND}", command).replace("{READING}", reading)
    path = folder / "oscillator.toml"
    path.write_text(text + SOUGHT, encoding="utf-8")
    return path


def oscillator(folder: Path, **options: str) -> Case:
    """The case, loaded; options: those of `written`."""
    return load_case(written(folder, **options))
