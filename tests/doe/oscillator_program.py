"""An independent program in the place of somebody else's solver: a damped oscillator struck at t = 0. DECK

It shares nothing with birdstrike. Units kg, mm, ms. The deck, fixed fields of ten characters:

    *OSCILLATOR
    mass [kg], stiffness [kN/mm], damping [kN ms/mm], impulse [kN ms]
    *CONTROL
    end [ms], step [ms]
    *BEHAVIOUR
    what goes wrong: nothing, hang, crash, early, silent
"""

import math
import os
import subprocess
import sys
import time


def cards(text):
    """Keyword -> the fields of the card below it; lines that begin with $ are comments."""
    lines = [line for line in text.splitlines() if line and not line.startswith("$")]
    return {
        line: [field for field in (below[i : i + 10].strip() for i in range(0, len(below), 10)) if field]
        for line, below in zip(lines, lines[1:])  # noqa: B905 (Python 3.8 runs it too)
        if line.startswith("*")
    }


def histories(mass, stiffness, damping, impulse, end, step):
    """Times, displacements (towards -z) and spring forces by the exact solution of the underdamped oscillator."""
    decay = damping / (2.0 * mass)
    omega = math.sqrt(stiffness / mass - decay**2)
    times = [i * step for i in range(int(round(end / step)) + 1)]
    z = [-impulse / (mass * omega) * math.exp(-decay * t) * math.sin(omega * t) for t in times]
    return times, z, [-stiffness * value for value in z]


def write_nodout(times, z):
    """Two nodes, in the format of LS-DYNA's nodout; the numbers may touch each other there."""
    names = "".join(f"{axis}-{what}".rjust(12) for what in ("disp", "vel", "accl", "coor") for axis in "xyz")
    with open("nodout", "w") as file:
        for i, (t, value) in enumerate(zip(times, z), 1):  # noqa: B905
            step = " n o d a l   p r i n t   o u t   f o r   t i m e  s t e p"
            file.write("\n\n%s%8d                              ( at time%14.7E )\n\n" % (step, i, t))
            file.write(f" nodal point{names[2:]}\n")
            for node, own in ((7, 0.0), (4711, value)):
                row = [0.0, 1e-3 * own, own, *[0.0] * 6, -125.0, -100.0, own]
                file.write(f"{node:10d}" + "".join("%12.5E" % number for number in row) + "\n")


def main(deck):
    """Read the deck, do as it says, write nodout, sensors.csv and force.txt."""
    with open(deck) as file:
        found = cards(file.read())
    behaviour = found["*BEHAVIOUR"][0]
    if behaviour == "hang":
        with open("pids", "w") as file:
            child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
            file.write(f"{os.getpid()} {child.pid}")
        os.rename("pids", os.environ.get("OSCILLATOR_PIDS", "started"))
        time.sleep(60)
    mass, stiffness, damping, impulse = map(float, found["*OSCILLATOR"])
    end, step = map(float, found["*CONTROL"])
    if behaviour == "crash" or damping**2 >= 4.0 * mass * stiffness:
        print("*** Error 20001: negative volume in brick element 12")
        sys.exit(3)
    times, z, force = histories(mass, stiffness, damping, impulse, 0.5 * end if behaviour == "early" else end, step)
    write_nodout(times, z)
    with open("sensors.csv", "w") as file:
        file.write("# written by the oscillator\ntime, z_disp, other\n")
        file.writelines(f"{t!r}, {value!r}, 1\n" for t, value in zip(times, z))  # noqa: B905
    with open("force.txt", "w") as file:
        file.write("Oscillator\n  time  force\n")
        file.writelines(f"  {t:.12e}  {value:.12e}\n" for t, value in zip(times, force))  # noqa: B905
    if behaviour != "silent":
        print("N o r m a l    t e r m i n a t i o n")


if __name__ == "__main__":
    main(sys.argv[1])
