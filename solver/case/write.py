"""A copy of a case as one TOML file that stands alone, what it extended and every --set written in."""

from __future__ import annotations

import shutil
from pathlib import Path

import tomli_w

from birdstrike.data.files import whole_file, write_atomically
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.overlay import Raw

DECK = "deck"


def copy_case(case: Case, folder: Path) -> None:
    """Write `case.toml` into the folder, and beside it the files that an external solver's deck is made of."""
    table = case.table
    if case.external is not None:
        names = [f"{DECK}/{path.name}" for path in case.external.inputs]
        for path, name in zip(case.external.inputs, names, strict=True):
            if path != (folder / name).resolve():
                with whole_file(folder / name) as temporary:
                    shutil.copyfile(path, temporary)
        table["external"] |= {"template": names[0], "files": names[1:]}
    write_atomically(folder / "case.toml", case_toml(case, table))


def case_toml(case: Case, table: Raw | None = None) -> str:
    """TOML text that `load_case` reads back to the same case; table: the case's own, where paths in it differ."""
    head = f"# {case.name}, with everything that it extends and every override written in.\n"
    return head + tomli_w.dumps(case.table if table is None else table)
