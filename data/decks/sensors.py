"""Which nodes, contacts and elements of a deck stand for a case's sensors: the file written beside the deck."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from birdstrike.data.errors import UserError
from birdstrike.data.storage.files import write_json

SUFFIX = ".sensors.json"


@dataclass(frozen=True)
class DeckSensor:
    """kind, unit: of the case's sensor, SI; numbers: of the deck's nodes, or of the contacts of a contact force, or of

    the shell under a gauge. The sensor reads the sum of `weights` times their displacement or force along `direction`;
    a gauge's direction is that of the strain, its only weight the distance from the mid-surface [m].
    """

    kind: str
    unit: str
    numbers: tuple[int, ...]
    weights: tuple[float, ...]
    direction: tuple[float, float, float]


@dataclass(frozen=True)
class DeckSensors:
    """code: "lsdyna" or "radioss"; units: name of the system, as `birdstrike export --units` has it.

    begin: instant of the case's clock [s] at which the deck's own begins: below 0 where the bird's outermost points
    reach the plate before the case's stand-off is flown; case_hash: of the case that was exported, empty in a file of
    an earlier version.
    """

    code: str
    units: str
    sensors: Mapping[str, DeckSensor]
    begin: float = 0.0
    case_hash: str = ""

    def save(self, path: Path) -> None:
        """Write it as JSON, whole or not at all."""
        sensors = {name: asdict(sensor) for name, sensor in self.sensors.items()}
        origin = {"code": self.code, "units": self.units, "begin": self.begin, "case_hash": self.case_hash}
        write_json(path, origin | {"sensors": sensors})


def sensors_file(deck: Path, code: str) -> Path:
    """Where the file of a deck for a code stands: strike.k has strike.lsdyna.sensors.json, strike_0000.rad
    strike.radioss.sensors.json."""
    return deck.with_name(f"{deck.name.removesuffix(deck.suffix).removesuffix('_0000')}.{code}{SUFFIX}")


def read_deck_sensors(path: str | Path) -> DeckSensors:
    """The file of a deck; raises UserError."""
    if not Path(path).is_file():
        raise UserError(f"no file {path}; birdstrike export CASE --deck writes it beside the deck")
    try:
        content: Any = json.loads(Path(path).read_text(encoding="utf-8"))
        sensors = {name: _sensor(one) for name, one in content["sensors"].items()}
        begin, case_hash = float(content.get("begin", 0.0)), str(content.get("case_hash", ""))
        return DeckSensors(content["code"], content["units"], sensors, begin, case_hash)
    except (ValueError, KeyError, TypeError) as error:
        raise UserError(f"{path} is not the sensors' file of a deck, or is damaged; export the deck again") from error


def _sensor(content: Mapping[str, Any]) -> DeckSensor:
    x, y, z = (float(c) for c in content["direction"])
    numbers, weights = tuple(int(n) for n in content["numbers"]), tuple(float(w) for w in content["weights"])
    return DeckSensor(content["kind"], content["unit"], numbers, weights, (x, y, z))
