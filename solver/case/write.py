"""A copy of a case as one TOML file that stands alone, what it extended and every --set written in.

The files that it names go along, and it names them by paths from its own folder, so that the folder can be moved.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any, Protocol

import tomli_w

from birdstrike.data.storage.files import whole_file, write_atomically
from birdstrike.solver.case.overlay import Raw
from birdstrike.solver.target.files.mesh_file import included_files

DECK, MESH, BASELINES = "deck", "mesh", "baselines"
"""Folders beside `case.toml`: files of an external solver's deck, of a target's mesh, and records of baselines."""


class Written(Protocol):
    """A case as it is written."""

    @property
    def name(self) -> str:
        """What it is called."""
        ...

    @property
    def table(self) -> Raw:
        """As TOML gives it; a copy."""
        ...

    @property
    def external(self) -> Any:
        """Section `external`, None without another solver."""
        ...

    @property
    def mesh_file(self) -> Path | None:
        """File of the target's mesh."""
        ...

    @property
    def diagnosis(self) -> Any:
        """Section `diagnosis`, which names records."""
        ...


def copy_case(case: Written, folder: Path, name: str = "case.toml", place: str = "") -> None:
    """Write the case into the folder as `name`, and the files that it names beside it; place: "" or a folder in it for
    these, with "/" behind, where the files of several cases lie in one folder."""
    for own, path in named_files(case).items():
        copy = folder / f"{place}{own}"
        if path.resolve() != copy.resolve():
            with whole_file(copy) as temporary:
                shutil.copyfile(path, temporary)
    write_atomically(folder / name, case_toml(case, portable_table(case, place)))


def named_files(case: Written) -> dict[str, Path]:
    """Name in a case's folder -> the file: of a deck, of the target's mesh and what that includes, of baselines."""
    found = {} if case.external is None else {f"{DECK}/{path.name}": path for path in case.external.inputs}
    if (mesh := case.mesh_file) is not None:
        found[f"{MESH}/{mesh.name}"] = mesh
        found |= {f"{MESH}/{name}": mesh.parent / name for name in included_files(mesh)}
    return found | {name: Path(path) for path, name in _baselines(case).items()}


def _baselines(case: Written) -> dict[str, str]:
    """Path of a baseline's record, as the case has it -> its name in a case's folder; shipped records have none."""
    found: dict[str, str] = {}
    for i, path in enumerate(map(Path, case.diagnosis.baselines), 1):
        if path.is_absolute() and path.is_file():
            name = f"{BASELINES}/{path.name}"
            found[str(path)] = f"{BASELINES}/{i}_{path.name}" if name in found.values() else name
    return found


def portable_table(case: Written, place: str = "") -> Raw:
    """The case's table with the paths that its files have in its folder; place: of that folder, from the table's."""
    table = case.table
    if case.external is not None:
        names = [f"{place}{DECK}/{path.name}" for path in case.external.inputs]
        table["external"] |= {"template": names[0], "files": names[1:]}
    if (mesh := case.mesh_file) is not None:
        table["target"] |= {"mesh": f"{place}{MESH}/{mesh.name}"}
    if names := _baselines(case):
        given = case.diagnosis.baselines
        table["diagnosis"] |= {"baselines": [f"{place}{names[path]}" if path in names else path for path in given]}
    return table


def case_toml(case: Written, table: Raw | None = None) -> str:
    """TOML text that `load_case` reads back to the same case; table: the case's own, where paths in it differ."""
    head = f"# {case.name}, with everything that it extends and every override written in.\n"
    return head + tomli_w.dumps(case.table if table is None else table)
