"""The files of a diagnosis: the case with the effect in it, the curves, diagnosis.json."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from birdstrike.data.files import write_atomically
from birdstrike.inversion.diagnosis.curves_file import write_curves
from birdstrike.inversion.diagnosis.diagnosis import Diagnosis
from birdstrike.inversion.diagnosis.verdict import ATTRIBUTED
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.write import case_toml


def write(found: Diagnosis, folder: Path) -> Diagnosis:
    """Write all files, diagnosis.json last; returns the diagnosis with the name of its case file."""
    if found.case is not None and found.after is not None:
        path = folder / f"{found.case.name}_with_{found.after.model}.toml"
        write_atomically(path, case_text(found, found.case))
        found = replace(found, case_after=path.name)
    write_curves(folder / "diagnosis.csv", found)
    found.save(folder / "diagnosis.json")
    return found


def case_text(found: Diagnosis, case: Case) -> str:
    """TOML of the case after, headed by what it is: one strike of it makes the curve and the error after."""
    head = [found.sentence]
    if found.verdict != ATTRIBUTED:
        head.append(f"This case has {found.after.model if found.after else ''} in it, the likeliest; it is not named.")
    head.append("The calibrated parameters are the refitted ones; the effect stands under [effects].")
    fitted = ", ".join(f"{name} {one['value']:+.4g} (SI)" for name, one in found.nuisance.items())
    if fitted:
        head.append(f"Fitted nuisances are written into the values that they shift, beside the effect: {fitted}.")
    return "".join(f"# {line}\n" for line in head) + case_toml(case)
