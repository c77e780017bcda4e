"""A writer of Radioss' time history, by the layout that OpenRadioss' th_to_csv reads: what the tests read back."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

Group = tuple[str, dict[int, str], tuple[int, ...]]
"""Title, elements by number, codes of the variables."""


def record(content: bytes) -> bytes:
    length = struct.pack(">i", len(content))
    return length + content + length


def write_t01(
    path: Path, time: np.ndarray, general: np.ndarray, groups: list[tuple[Group, np.ndarray]], version: int = 4021
) -> None:
    """general (n, 12); values of each group (n, elements times variables)."""
    width = 100 if version >= 4021 else 80 if version >= 3041 else 40
    content = record(struct.pack(">i", version) + b"strike".ljust(80)) + record(b"Nov 2026".ljust(80))
    if version > 3050:
        content += record(struct.pack(">i", 3)) + record(struct.pack(">i", width)) + record(struct.pack(">3f", 1, 1, 1))
    content += record(struct.pack(">6i", 1, 1, 1, 0, len(groups), 12)) + record(struct.pack(">12i", *range(1, 13)))
    content += record(struct.pack(">i", 2) + b"bird".ljust(width) + struct.pack(">4i", 0, 2, 2, 1))
    content += record(struct.pack(">i", 5))
    content += 2 * record(struct.pack(">i", 1) + b"any".ljust(width))
    for number, ((title, elements, variables), _) in enumerate(groups, 1):
        counts = struct.pack(">5i", number, 0, 0, len(elements), len(variables))
        content += record(counts + title.encode().ljust(width))
        for element, name in elements.items():
            content += record(struct.pack(">i", element) + name.encode().ljust(width))
        content += record(struct.pack(f">{len(variables)}i", *variables))
    for i, instant in enumerate(time):
        content += record(struct.pack(">f", instant)) + record(general[i].astype(">f4").tobytes())
        content += record(struct.pack(">f", 2.0 * instant))
        content += b"".join(record(values[i].astype(">f4").tobytes()) for _, values in groups)
    path.write_bytes(content)
