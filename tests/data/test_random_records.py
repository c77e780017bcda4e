"""Random text in place of a record: it is read, or refused by lines that name what is wrong; both readers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from hypothesis import event, given
from hypothesis import strategies as st

from birdstrike.cli.import_curve import import_curve
from birdstrike.data.curves import Measured, read_measured
from birdstrike.data.errors import UserError
from tests.fuzz import fuzzed

CELLS = st.one_of(
    st.floats(-100.0, 100.0).map(repr),
    st.integers(0, 50).map(str),
    st.integers(0, 50).map(lambda n: f"{n},5"),
    st.sampled_from(
        ["", " ", "NaN", "nan", "inf", "-inf", "OVL", "-", "--", "#N/A", "1e400", "1e-400", "1 000", "1'000", "0x1F",
         "12:30:01.5", "1.2.3", '"1"', '"', "'", "1e5e5", "1D-3", "+", "٣", "\x00", "x" * 500, "9" * 400]
    ),
)  # fmt: skip
HEADS = st.sampled_from(
    ["time [ms]", "time_s", "t", "time", "Zeit [s]", "time []", "w [mm]", "w", "w [furlong]", "w_sigma [mm]", "w [ms]",
     "displacement_centre [mm]", "strain [-]", "strain [um/m]", "e [%]", "F (kN)", "[mm]", "w [mm", "", "w [m/s/s]",
     "w [1e3 m]"]
)  # fmt: skip
DELIMITERS = st.sampled_from([",", ";", "\t", " ", ", ", "|"])
ENCODINGS = st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "latin-1", "cp1252"])
ENDS = st.sampled_from(["\n", "\r\n", "\r", "\n\n"])
NOTES = st.sampled_from(["", "# note\n", "$ nodout\n", "%\n", "DAQ 3000\nchannel 1\n", "\ufeff", "sep=;\n", "\x00\x00"])
NODOUT = (
    "n o d a l   p r i n t   o u t   f o r   t i m e  s t e p       1      ( at time 0.0E+00 )\n"
    " nodal point  x-disp     y-disp      z-disp      x-vel       y-vel       z-vel\n"
)


@st.composite
def tables(draw: st.DrawFn) -> bytes:
    """Rows of one width or of several, clock rising or not, under a head or none."""
    width, delimiter, end = draw(st.integers(1, 4)), draw(DELIMITERS), draw(ENDS)
    ragged = draw(st.booleans())
    head = [draw(HEADS) for _ in range(width)] if draw(st.booleans()) else []
    rising = draw(st.booleans())
    rows = []
    for i in range(draw(st.integers(0, 6))):
        more = draw(st.integers(0, 4)) if ragged else width - 1
        rows.append([f"{0.1 * i:.1f}" if rising else draw(CELLS), *(draw(CELLS) for _ in range(more))])
    text = draw(NOTES) + end.join(delimiter.join(cells) for cells in ([head] if head else []) + rows)
    return text.encode(draw(ENCODINGS), errors="replace")


NODOUTS = st.text(max_size=200).map(lambda text: (NODOUT + text).encode())
RECORDS = st.one_of(tables(), tables(), tables(), st.binary(max_size=200), NODOUTS)
UNITS = st.sampled_from(["mm", "furlong", "", "kN", "%"])
SCALES = st.sampled_from([1.0, -1.0, 0.0, 1e300])


@given(content=RECORDS, unit=UNITS, scale=SCALES)
@fuzzed
def test_random_records_are_read_or_refused(tmp_path: Path, content: bytes, unit: str, scale: float) -> None:
    path, out = tmp_path / "record.csv", tmp_path / "out.csv"
    path.write_bytes(content)
    options = {"units": {"w": unit, "time": "ms"}, "scales": {"w": scale}}
    readers = {
        "strict": lambda: read_measured(path),
        "import": lambda: import_curve(path, out, {"w": ""}, **options),
        "import by a rate": lambda: import_curve(path, out, {"w": ""}, rate="200 kHz", **options),
    }
    for name, read in readers.items():
        record, lines = read_or_refused(read)
        event(f"{name}: {'refused' if record is None else 'read'}")
        assert (record is None) == bool(lines)
        assert all(line.strip() for line in lines)
        if record is not None:
            assert np.all(np.diff(record.time) > 0.0)
            assert all(values.shape == record.time.shape for values in record.channels.values())


def read_or_refused(read: Callable[[], Measured]) -> tuple[Measured | None, list[str]]:
    """The record, or the lines that say why there is none; any other exception goes through."""
    try:
        return read(), []
    except UserError as error:
        return None, error.errors
