"""Tables that birdstrike wrote itself as CSV; a damaged file is refused by its name."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array

if TYPE_CHECKING:
    import pandas as pd


def read_own_table(path: Path, numbers: Sequence[str], remedy: str, texts: Sequence[str] = ()) -> pd.DataFrame:
    """A table with these columns of numbers and of text among its own.

    Raises UserError for a file that cannot be read, lacks one of them, or has text among the numbers; remedy: what to
    do then.
    """
    import pandas as pd

    try:
        table = pd.read_csv(path)
        if lacking := [name for name in (*texts, *numbers) if name not in table]:
            raise ValueError(f"no column {', '.join(lacking)}")
        return table.astype(dict.fromkeys(numbers, float))
    except (OSError, ValueError) as error:
        raise damaged(path, str(error).strip().splitlines()[0], remedy) from error


def read_columns(path: Path, numbers: Sequence[str], remedy: str) -> dict[str, Array]:
    """Columns (n,) by name; raises UserError as `read_own_table` does."""
    table = read_own_table(path, numbers, remedy)
    return {name: table[name].to_numpy(float) for name in numbers}


def damaged(path: Path, why: str, remedy: str) -> UserError:
    """What is raised of a file that cannot be used, for the caller to raise."""
    return UserError(f"{path} is damaged or of another version ({why}); {remedy}")
