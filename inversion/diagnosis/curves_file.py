"""`diagnosis.csv`: the record and the model's curves before and after, point by point."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from data.files import write_atomically
from inversion.diagnosis.diagnosis import Diagnosis


def write_curves(path: Path, found: Diagnosis) -> None:
    """Columns: channel, time_s, measured, sigma (of it), error (numerical too), before, after (empty: none); SI."""
    tables = [
        pd.DataFrame(
            {
                "channel": name,
                "time_s": c["time"],
                **{k: c[k] for k in ("measured", "sigma", "error", "before", "after")},
            }
        )
        for name, c in found.curves.items()
    ]
    write_atomically(path, pd.concat(tables).to_csv(index=False, float_format="%.9e", lineterminator="\n"))
