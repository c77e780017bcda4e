"""The installed package: the names that it puts on a user's path, the files that it carries, its public classes."""

from __future__ import annotations

import ast
import inspect
import os
import re
import shutil
import subprocess
import sys
import typing
import zipfile
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

import birdstrike

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("data", "solver", "doe", "surrogate", "inversion", "reports")
CARRIED = (".py", ".toml", ".csv", ".j2", ".js", ".css")
"""Endings of the files that a program reads at run time."""


def carried(folder: Path) -> list[str]:
    """Files below a folder of the repository that an installed birdstrike needs."""
    found = (path for path in folder.rglob("*") if path.suffix in CARRIED and "__pycache__" not in path.parts)
    return sorted(str(path.relative_to(folder.parent)) for path in found)


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with a wheel and a source archive, built from a copy of the tree, since building writes into it."""
    folder = tmp_path_factory.mktemp("built")
    source = folder / "source"
    without = shutil.ignore_patterns("__pycache__")
    for name in ("birdstrike", *PACKAGES):
        shutil.copytree(ROOT / name, source / name, symlinks=True, ignore=without)
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    program = "from setuptools import build_meta as b; print(b.build_wheel('..')); print(b.build_sdist('..'))"
    ended = subprocess.run(
        [sys.executable, "-c", program], cwd=source, capture_output=True, text=True, timeout=300, check=False
    )
    assert ended.returncode == 0, ended.stderr
    shutil.rmtree(source)
    return folder


@pytest.fixture(scope="module")
def installed(built: Path) -> Path:
    """A wheel's content, as pip puts it into site-packages."""
    (wheel,) = built.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(built / "site")
    return built / "site"


def test_a_wheel_puts_one_name_on_the_path_and_holds_every_file_once(installed: Path) -> None:
    top = {path.name for path in installed.iterdir() if not path.name.endswith(".dist-info")}
    assert top == {"birdstrike"}
    package = installed / "birdstrike"
    assert {path.name for path in package.iterdir() if path.is_dir()} == {"cli", "questions", *PACKAGES}
    for name in PACKAGES:
        assert carried(package / name) == carried(ROOT / name)


def test_a_source_archive_builds_without_the_links(built: Path) -> None:
    """Setuptools writes the linked folders as real ones, so that the archive unpacks on any system."""
    (archive,) = built.glob("*.tar.gz")
    shutil.unpack_archive(archive, built / "unpacked", filter="data")
    (unpacked,) = (built / "unpacked").iterdir()
    for name in PACKAGES:
        assert not (unpacked / "birdstrike" / name).is_symlink()
        assert carried(unpacked / "birdstrike" / name) == carried(ROOT / name)
        assert not (unpacked / name).exists()


def test_an_installed_birdstrike_ignores_a_users_files_of_the_same_names(installed: Path, tmp_path: Path) -> None:
    """A folder `data`, a file `solver.py` and a folder `reports` beside a user's script are the user's."""
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "__init__.py").write_text("raise SystemExit('data')")
    (tmp_path / "solver.py").write_text("raise SystemExit('solver')")
    (tmp_path / "reports").mkdir()
    program = (
        "import birdstrike.solver.version, birdstrike.doe.campaign, birdstrike.reports.page\n"
        "from birdstrike import load_case\n"
        "print(load_case('demo').bird.particles, birdstrike.__file__)"
    )
    ended = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(installed)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.split() == ["2200", str(installed / "birdstrike" / "__init__.py")]


def test_no_program_text_imports_a_bare_name() -> None:
    """Ruff forbids it in code; what a process of its own is started with is text to ruff."""
    bare = re.compile(rf"^\s*(?:from|import) (?:{'|'.join(PACKAGES)})\b", re.MULTILINE)
    folders = ("birdstrike/cli", *PACKAGES, "tests", "docs")
    sources = [path for name in folders for path in (ROOT / name).rglob("*") if path.suffix in (".py", ".md")]
    assert len(sources) > 100
    assert [str(path) for path in sources if bare.search(path.read_text(encoding="utf-8"))] == []


def test_a_clone_without_symbolic_links_says_what_to_do(tmp_path: Path) -> None:
    """Git for Windows writes a link as a text file that holds its target."""
    package = tmp_path / "birdstrike"
    package.mkdir()
    shutil.copy(ROOT / "birdstrike" / "__init__.py", package)
    for name in PACKAGES:
        (package / name).write_text(f"../{name}")
    ended = subprocess.run(
        [sys.executable, "-c", "import birdstrike"],
        cwd=tmp_path,
        env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert ended.returncode == 1
    said = ended.stderr.splitlines()[-1]
    assert said.startswith("ImportError: birdstrike/data in ")
    assert "core.symlinks=true" in said
    assert "install a wheel" in said


def named_in(module: str) -> dict[str, Any]:
    """Names of a module, those included that it imports for its annotations only."""
    source = sys.modules[module]
    names = dict(vars(source))
    for node in ast.walk(ast.parse(inspect.getsource(source))):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("birdstrike"):
            names |= {one.asname or one.name: getattr(import_module(node.module), one.name) for one in node.names}
    return names


def classes_of_ours(annotation: Any) -> set[type]:
    """Classes of birdstrike in an annotation, however deep."""
    if isinstance(annotation, type) and annotation.__module__.startswith("birdstrike."):
        return {annotation}
    parts = (one for part in typing.get_args(annotation) for one in (part if isinstance(part, list) else [part]))
    return {found for part in parts for found in classes_of_ours(part)}


VERBS = [name for name in birdstrike.__all__ if name.islower()]


def annotated(verb: str) -> dict[str, set[type]]:
    """Classes of birdstrike in a verb's annotations; `return` is what it gives."""
    function = getattr(birdstrike, verb)
    hints = typing.get_type_hints(function, named_in(function.__module__))
    return {name: classes_of_ours(hint) for name, hint in hints.items()}


@pytest.mark.parametrize("verb", VERBS)
def test_what_a_verb_takes_and_returns_is_public(verb: str) -> None:
    public = {getattr(birdstrike, name) for name in birdstrike.__all__}
    hints = annotated(verb)
    assert "return" in hints
    assert set().union(*hints.values()) - public == set()


def test_the_public_results_are_found() -> None:
    """Guards the walk above: an annotation that it cannot read would pass."""
    returned = set().union(*(annotated(verb)["return"] for verb in VERBS))
    expected = [
        "Case",
        "Histories",
        "Dataset",
        "Measured",
        "Inversion",
        "Diagnosis",
        "MeshConvergence",
        "Verification",
        "MethodScore",
        "ModelComparison",
        "Evidence",
        "Prediction",
    ]
    assert returned == {getattr(birdstrike, name) for name in expected}


def test_a_public_thing_has_one_name() -> None:
    assert len({getattr(birdstrike, name) for name in birdstrike.__all__}) == len(birdstrike.__all__)
    assert set(birdstrike.__all__) == set(dir(birdstrike))
