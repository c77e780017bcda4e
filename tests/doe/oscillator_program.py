"""An independent program in the place of somebody else's solver: a damped oscillator struck at t = 0. DECK

It shares nothing with birdstrike. Units kg, mm, ms. The deck, fixed fields of ten characters:

    *OSCILLATOR
    mass [kg], stiffness [kN/mm], damping [kN ms/mm], impulse [kN ms]
    *CONTROL
    end [ms], step [ms]
    *BEHAVIOUR
    what goes wrong: nothing, hang, crash, fault, early, silent
"""

import math
import os
import signal
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path


def cards(text):
    """Keyword -> the fields of the card below it; lines that begin with $ are comments."""
    lines = [line for line in text.splitlines() if line and not line.startswith("$")]
    fields = {line: [below[i : i + 10].strip() for i in range(0, len(below), 10)] for line, below in pairwise(lines)}
    return {line: [field for field in found if field] for line, found in fields.items() if line.startswith("*")}


def histories(mass, stiffness, damping, impulse, end, step):
    """Times, displacements (towards -z) and spring forces by the exact solution of the underdamped oscillator."""
    decay = damping / (2.0 * mass)
    omega = math.sqrt(stiffness / mass - decay**2)
    times = [i * step for i in range(round(end / step) + 1)]
    z = [-impulse / (mass * omega) * math.exp(-decay * t) * math.sin(omega * t) for t in times]
    return times, z, [-stiffness * value for value in z]


def write_nodout(times, z):
    """Two nodes, in the format of LS-DYNA's nodout; the numbers touch each other there where they are negative."""
    names = "".join(f"{axis}-{what}".rjust(12) for what in ("disp", "vel", "accl", "coor") for axis in "xyz")
    with Path("nodout").open("w") as file:
        for i, (t, value) in enumerate(zip(times, z, strict=True), 1):
            step = " n o d a l   p r i n t   o u t   f o r   t i m e  s t e p"
            file.write(f"\n\n{step}{i:8d}                              ( at time{t:14.7E} )\n\n")
            file.write(f" nodal point{names[2:]}\n")
            for node, own in ((7, 0.0), (4711, value)):
                row = [0.0, 1e-3 * own, own, *[0.0] * 6, -125.0, -100.0, own]
                file.write(f"{node:10d}" + "".join(f"{number:12.5E}" for number in row) + "\n")


def hang(deck):
    """Start a child, say who we are, and never end."""
    child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
    note = Path(deck).with_suffix(".pids.writing")
    note.write_text(f"{os.getpid()} {child.pid}")
    note.rename(note.with_suffix(""))
    time.sleep(60)


def main(deck):
    """Read the deck, do as it says, write nodout, sensors.csv and force.txt."""
    found = cards(Path(deck).read_text())
    behaviour = found["*BEHAVIOUR"][0]
    if behaviour == "hang":
        hang(deck)
    mass, stiffness, damping, impulse = map(float, found["*OSCILLATOR"])
    end, step = map(float, found["*CONTROL"])
    if behaviour == "fault":
        os.kill(os.getpid(), signal.SIGSEGV)
    if behaviour == "crash" or damping**2 >= 4.0 * mass * stiffness:
        sys.exit("*** Error 20001: negative volume in brick element 12")
    times, z, force = histories(mass, stiffness, damping, impulse, 0.5 * end if behaviour == "early" else end, step)
    write_nodout(times, z)
    rows = "".join(f"{t!r}, {value!r}, 1\n" for t, value in zip(times, z, strict=True))
    Path("sensors.csv").write_text(f"# written by the oscillator\ntime, z_disp, other\n{rows}")
    rows = "".join(f"  {t:.12e}  {value:.12e}\n" for t, value in zip(times, force, strict=True))
    Path("force.txt").write_text(f"Oscillator\n  time  force\n{rows}")
    if behaviour != "silent":
        sys.stdout.write("N o r m a l    t e r m i n a t i o n\n")


if __name__ == "__main__":
    main(sys.argv[1])
