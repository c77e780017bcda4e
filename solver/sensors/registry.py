"""The kinds of sensors: one line each; installed packages add theirs by entry points `birdstrike.sensors`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic_core import InitErrorDetails

from birdstrike.solver.fields import complaint
from birdstrike.solver.registry import Kinds, errors_of
from birdstrike.solver.sensors.contact_force import ContactForce
from birdstrike.solver.sensors.displacement import Displacement
from birdstrike.solver.sensors.pressure import Pressure
from birdstrike.solver.sensors.reaction_force import ReactionForce
from birdstrike.solver.sensors.sensor import Sensor
from birdstrike.solver.sensors.strain import Strain

NO_NOISE = 'fits no kind of sensor; write a length or a force such as "0.1 mm" or "0.1 kN"'


class SensorKinds(Kinds[Sensor]):
    """Registry of the kinds of sensors."""

    def foreign(self, key: str, /) -> str:
        """Why a sensor of another kind has no such key; empty for a key that no kind has."""
        having = [name for name, kind in self.items() if key in kind.model_fields]
        if not having:
            return ""
        thing = "place" if key == "at" else key
        if len(having) == 1:
            return f"only a {having[0]} sensor has a {thing}; leave it out"
        return f"only {', '.join(having[:-1])} and {having[-1]} sensors have a {thing}; leave it out"

    def refuse(self, value: Mapping[str, Any]) -> Any:
        """Raise ValidationError for a sensor of no known kind, about its noise too where that fits no kind at all."""
        noise = value.get("noise")
        fits = noise is None or any(kind.noise_range.valid(noise) is not None for kind in self.values())
        wrong = [] if fits else [InitErrorDetails(type=complaint(NO_NOISE), loc=("noise",), input=noise)]
        raise errors_of([self.unknown(value), *wrong])


SENSORS = SensorKinds(
    "sensor kind",
    "kind",
    "birdstrike.sensors",
    {
        "displacement": Displacement,
        "strain": Strain,
        "contact_force": ContactForce,
        "reaction_force": ReactionForce,
        "pressure": Pressure,
    },
    Sensor,
)

DEFAULT_SENSORS: dict[str, Sensor] = {
    "displacement_centre": Displacement(),
    "contact_force": ContactForce(),
    "reaction_force": ReactionForce(),
}
"""Sensors of a case that names none."""
