"""Compiled kernels stay as long as the sources of all kernels do."""

from __future__ import annotations

from pathlib import Path

import pytest

from birdstrike.solver.compilation import FOLDERS, forget_stale_kernels

PLACES = (*FOLDERS, f"{FOLDERS[0]}/bird")


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """Folders, one in another, with a source and a compiled kernel each."""
    for folder in PLACES:
        (tmp_path / folder / "__pycache__").mkdir(parents=True)
        (tmp_path / folder / "law.py").write_text("PLACE = 22\n", encoding="utf-8")
        compile_in(tmp_path / folder)
    forget_stale_kernels(tmp_path)
    for folder in PLACES:
        compile_in(tmp_path / folder)
    return tmp_path


def compile_in(folder: Path) -> None:
    for ending in ("nbi", "1.nbc"):
        (folder / "__pycache__" / f"law.{ending}").write_bytes(b"")


def compiled(root: Path) -> int:
    return len(list(root.rglob("*.nb[ic]")))


def test_what_was_compiled_before_anything_is_known_is_forgotten(tmp_path: Path) -> None:
    folder = tmp_path / FOLDERS[0]
    (folder / "__pycache__").mkdir(parents=True)
    compile_in(folder)
    forget_stale_kernels(tmp_path)
    assert compiled(tmp_path) == 0


def test_the_same_sources_keep_their_kernels(tree: Path) -> None:
    (tree / "simulate.py").write_text("", encoding="utf-8")
    forget_stale_kernels(tree)
    assert compiled(tree) == 2 * len(PLACES)


@pytest.mark.parametrize("folder", PLACES)
def test_a_constant_of_another_file_forgets_all(tree: Path, folder: str) -> None:
    (tree / folder / "law.py").write_text("PLACE = 23\n", encoding="utf-8")
    forget_stale_kernels(tree)
    assert compiled(tree) == 0
    compile_in(tree / folder)
    forget_stale_kernels(tree)
    assert compiled(tree) == 2


def test_a_folder_that_cannot_be_written_is_left_alone(tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError

    (tree / FOLDERS[0] / "law.py").write_text("PLACE = 23\n", encoding="utf-8")
    monkeypatch.setattr(Path, "unlink", refuse)
    forget_stale_kernels(tree)
    assert compiled(tree) == 2 * len(PLACES)
