"""`birdstrike explore`: one HTML page with sliders, made of a folder of results."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from birdstrike.data.errors import UserError
from birdstrike.data.storage.files import json_values, write_atomically
from birdstrike.data.storage.tree import ARRAY, without_arrays
from birdstrike.data.units import ACCEPTED, factor
from birdstrike.reports.explore.kinds.registry import kind_of
from birdstrike.reports.explore.view import View
from birdstrike.reports.sections.reproducibility import installed
from birdstrike.reports.template import page_template
from birdstrike.surrogate.weights import student_table

PAGE = "explore.html"
LARGEST = 8_000_000  # bytes of a page: what a mail takes
SCRIPTS = (
    "numbers.js",
    "emulator.js",
    "misfit.js",
    "record.js",
    "search.js",
    "chart.js",
    "sliders.js",
    "curves.js",
    "maps.js",
    "copy.js",
    "main.js",
)
"""The page's script, in this order; each uses the ones before it."""
EXACT = (
    "weights",
    "points",
    "lengths",
    "low",
    "high",
    "theta",
    "parameters",
    "regions",
    "time",
    "instants",
    "centre",
    "knots",
)
"""Arrays in which differences cancel, or that are compared: 64 bits; all others are curves, for which 32 serve."""


def explore(folder: str | Path, out: str | Path | None = None) -> Path:
    """Write the page about `folder` (default `folder/explore.html`) and return its path.

    Raises UserError for a folder without results, or for one whose page would be larger than 8 MB.
    """
    place = Path(folder)
    views = kind_of(place).read(place)
    path = Path(out) if out is not None else place / PAGE
    text = page(views, place.resolve().name)
    if len(text.encode()) > LARGEST:
        raise UserError(
            f"the page of {place} would have {len(text) / 1e6:.1f} MB, more than 8; explore a part of it (its doe, "
            "inversion or diagnosis folder), or raise time.output_interval and repeat"
        )
    write_atomically(path, text)
    return path


def page(views: Sequence[View], name: str) -> str:
    """The page as HTML text; nothing in it points outside."""
    text, numbers = packed(content(views))
    own = files("birdstrike.reports.explore") / "page"
    return page_template("birdstrike.reports.explore", "page", "page.html.j2").render(
        title=f"Explore {name}: {', '.join(shot['name'] for shot in views[0].shots)}",
        views=views,
        view=views[0],
        version=installed("birdstrike"),
        style=Markup((own / "explore.css").read_text(encoding="utf-8")),
        script=Markup("".join((own / script).read_text(encoding="utf-8") for script in SCRIPTS)),
        content=Markup(text),
        numbers=Markup(numbers),
    )


def content(views: Sequence[View]) -> dict[str, Any]:
    """All that the script reads: the views, Student's t, the units that a record may have."""
    units = {text: {"si": si, "factor": float(factor(text))} for si in ACCEPTED for text in _written(si)}
    return {
        "views": [view.table() for view in views],
        "student": student_table(),
        "units": {"-": {"si": "", "factor": 1.0}, "1": {"si": "", "factor": 1.0}, **units},
        "accepted": dict(ACCEPTED),
    }


def _written(si: str) -> list[str]:
    """How a record's header may write a unit."""
    listed = (text.removeprefix("or ") for text in ACCEPTED[si].split(", "))
    return [text for text in (*listed, si) if text and not text.startswith("a bare")]


def packed(tree: Mapping[str, Any]) -> tuple[str, str]:
    """JSON text that no tag can end, and all arrays as one text in base64: 64 bits where it matters, else 32."""
    sized = _sized(tree, exact=False)
    arrays: list[np.ndarray] = []
    bare = without_arrays(sized, arrays)
    buffer, places = bytearray(), list[dict[str, Any]]()
    for array in arrays:
        buffer.extend(b"\0" * (-len(buffer) % 8))
        places.append({"at": len(buffer), "shape": list(array.shape), "bits": 8 * array.dtype.itemsize})
        buffer.extend(np.ascontiguousarray(array).tobytes())
    text = json.dumps(json_values({"tree": bare, "arrays": places, "mark": ARRAY}), allow_nan=False)
    return text.replace("<", "\\u003c"), base64.b64encode(bytes(buffer)).decode("ascii")


def _sized(value: Any, exact: bool) -> Any:
    """Arrays as little-endian floats of 64 bits under the keys of EXACT, else of 32."""
    if isinstance(value, np.ndarray):
        return value.astype("<f8" if exact else "<f4")
    if isinstance(value, Mapping):
        return {key: _sized(entry, exact or key in EXACT) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_sized(entry, exact) for entry in value]
    return value
