"""`diagnosis.csv`: the record and the model's curves before and after, point by point."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from birdstrike.data.files import write_atomically
from birdstrike.inversion.diagnosis.diagnosis import Diagnosis

COLUMNS = ("measured", "sigma", "error", "before", "after", "before_fitted", "after_fitted")


def write_curves(path: Path, found: Diagnosis) -> None:
    """Columns: channel, time_s, measured, sigma (of it), error (numerical too), before, after (empty: none); SI.

    before, after: of one strike of the solver at each fit, with what finer meshes add; before_fitted, after_fitted:
    what the fits foretold of it.
    """
    tables = [
        pd.DataFrame(
            {
                "channel": name,
                "time_s": c["time"],
                **{k: c[k] for k in COLUMNS},
            }
        )
        for name, c in found.curves.items()
    ]
    write_atomically(path, pd.concat(tables).to_csv(index=False, float_format="%.9e", lineterminator="\n"))
