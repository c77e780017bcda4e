"""Scores on the disk: one file an experiment, used again while nothing that made it has changed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import birdstrike.inversion
import birdstrike.surrogate
from birdstrike.data.files import write_json
from birdstrike.inversion.audit.draws import Draws
from birdstrike.inversion.audit.power import Power
from birdstrike.inversion.audit.score import Blind, Score
from birdstrike.solver.version import SOLVER_VERSION

NOT_IN_A_SCORE = ("audit.py", "answers.py", "gates.py", "make_experiments.py", "planted.py", "stored.py", "table.py")
"""Files of the audit that count and show scores, or make experiments: what they do changes no score."""


@cache
def code_digest() -> str:
    """First 16 hex digits of SHA-256 of the sources by which a score is made, beside the solver's own version."""
    found = hashlib.sha256(SOLVER_VERSION.encode())
    for package in (birdstrike.inversion, birdstrike.surrogate):
        folder = Path(package.__path__[0])
        for path in sorted(folder.rglob("*.py"), key=lambda p: p.relative_to(folder).as_posix()):
            if path.parent.name == "audit" and path.name in NOT_IN_A_SCORE:
                continue
            found.update(path.relative_to(folder).as_posix().encode())
            found.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return found.hexdigest()[:16]


def score_key(*parts: str) -> str:
    """What a score depends on, as 16 hex digits."""
    return hashlib.sha256("\0".join((code_digest(), *parts)).encode()).hexdigest()[:16]


def save_score(path: Path, key: str, score: Score) -> None:
    """Write a score, whole or not at all."""
    content = vars(score) | {
        "blind": vars(score.blind),
        "believed": {kind: _draws(one) for kind, one in score.believed.items()},
        "read": {kind: _draws(one) for kind, one in score.read.items()},
        "power": [vars(one) for one in score.power],
    }
    write_json(path, {"key": key, "score": content})


def load_score(path: Path, key: str) -> Score | None:
    """The score of a file; None where there is none, or one of another key."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError):
        return None
    if content.get("key") != key:
        return None
    said: dict[str, Any] = content["score"]
    blind = said["blind"]
    return Score(
        **said
        | {
            "channels": tuple(said["channels"]),
            "blind": Blind(blind["verdict"], tuple(blind["allowed"]), tuple(blind["struck"]), blind["strikes"]),
            "believed": {kind: _from(one) for kind, one in said["believed"].items()},
            "read": {kind: _from(one) for kind, one in said["read"].items()},
            "power": tuple(Power(**one | {"rejected": np.array(one["rejected"])}) for one in said["power"]),
            "covered": {name: np.array(values) for name, values in said["covered"].items()},
            "error": None if said["error"] is None else tuple(said["error"]),
        }
    )


def _draws(draws: Draws) -> dict[str, Any]:
    """The sets as texts; refitted unknowns are not kept."""
    return {"sets": [" ".join(one) for one in draws.sets], "named": draws.named}


def _from(said: Mapping[str, Any]) -> Draws:
    return Draws(tuple(tuple(one.split()) for one in said["sets"]), tuple(said["named"]))
