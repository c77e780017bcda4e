"""Arguments of the Python functions: one thing or several, and values of another kind than is declared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from birdstrike.data.arguments import as_list, as_names, as_options, as_path, refuse_no_function, refuse_other_kinds
from birdstrike.data.errors import UserError


@dataclass(frozen=True)
class Wanted:
    """Fields of every kind that is looked at, and one that is not."""

    share: float = 0.5
    count: int = 1
    most: int | None = None
    told: bool = True
    folder: Path | None = None
    limits: Mapping[str, str] | None = None
    several: tuple[str, ...] = ()


@pytest.mark.parametrize(
    ("given", "found"),
    [
        (None, []),
        ("ab", ["ab"]),
        (Path("a"), [Path("a")]),
        ({"plate": {}}, [{"plate": {}}]),
        (("a", "b"), ["a", "b"]),
        ({"a": 1}.keys(), ["a"]),
        (iter(["a", "b"]), ["a", "b"]),
    ],
)
def test_one_thing_is_not_the_sequence_of_its_letters(given: Any, found: list[Any]) -> None:
    assert as_list(given) == found


def test_what_is_no_name_and_no_path_is_named() -> None:
    assert as_names("channels", "strain_back") == ("strain_back",)
    with pytest.raises(UserError, match=r"channels = \['a', 3\]: 3 is no name; give text"):
        as_names("channels", ["a", 3])
    with pytest.raises(UserError, match="out = None is no path"):
        as_path("out", None)


def test_options_are_of_their_class() -> None:
    assert as_options("options", None, Wanted) == Wanted()
    with pytest.raises(
        UserError, match=r"options = \{'share': 0.1\} is no Wanted; write birdstrike.Wanted\(NAME=VALUE\)"
    ):
        as_options("options", {"share": 0.1}, Wanted)  # pyright: ignore[reportArgumentType]


def test_every_value_of_another_kind_is_named_at_once() -> None:
    right: dict[str, Any] = {"share": np.float64(1.0), "count": np.int64(2), "most": 3, "limits": {"a": "1 mm"}}
    refuse_other_kinds(Wanted(**right, folder=Path("a")))
    given: dict[str, Any] = {"share": "x", "count": 1.5, "most": "3", "told": "no", "folder": 3, "limits": "a=8 mm"}
    with pytest.raises(UserError) as refused:
        refuse_other_kinds(Wanted(**given))
    assert refused.value.errors == [
        "Wanted: share = 'x' must be a number",
        "Wanted: count = 1.5 must be a whole number",
        "Wanted: most = '3' must be a whole number or None",
        "Wanted: told = 'no' must be True or False",
        "Wanted: folder = 3 must be a path or None",
        "Wanted: limits = 'a=8 mm' must be a dict of texts or None",
    ]


def test_what_cannot_be_called_is_no_function() -> None:
    refuse_no_function("forward", None, "theta")
    with pytest.raises(UserError, match="forward = 3 is no function; give one of theta, or leave it out"):
        refuse_no_function("forward", 3, "theta")  # pyright: ignore[reportArgumentType]
