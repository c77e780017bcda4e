"""Short names of dotted keys, each with as many of its parents as tell it from the others."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable


def key_labels(keys: Iterable[str]) -> dict[str, str]:
    """Key -> its last word; keys that share it take parents until they differ.

    "bird.material.viscosity" is "viscosity"; "target.parts.left.thickness" beside "target.parts.right.thickness" is
    "left thickness".
    """
    words = {key: key.split(".") for key in keys}
    taken = dict.fromkeys(words, 1)
    while True:
        labels = {key: " ".join(words[key][-count:]) for key, count in taken.items()}
        shared = Counter(labels.values())
        longer = [key for key, label in labels.items() if shared[label] > 1 and taken[key] < len(words[key])]
        if not longer:
            return labels
        for key in longer:
            taken[key] += 1
