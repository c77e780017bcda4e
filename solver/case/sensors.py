"""What a case says of its sensors and of the instruments behind them; after validation every value is SI."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from birdstrike.solver.fields import Between, OneOf, Section, complaint

NOISE = {
    "displacement": Between("0 mm", "1000 mm"),
    "strain": Between(0.0, 1.0),
    "contact_force": Between("0 kN", "100000 kN"),
    "reaction_force": Between("0 kN", "100000 kN"),
    "pressure": Between("0 MPa", "100000 MPa"),
}
"""Unit and range of each kind of sensor's noise; the unit is also the channel's."""

DRIFT = {
    "displacement": Between("-1000 mm/s", "1000 mm/s"),
    "strain": Between("-1000 1/s", "1000 1/s"),
    "contact_force": Between("-1e6 kN/s", "1e6 kN/s"),
    "reaction_force": Between("-1e6 kN/s", "1e6 kN/s"),
    "pressure": Between("-1e6 MPa/s", "1e6 MPa/s"),
}
"""Unit and range of the drift of each kind of sensor: its channel's, per second."""

PLACED = ("displacement", "strain", "pressure")
OF_KIND = {"direction": "strain", "side": "strain", "length": "strain", "radius": "pressure"}
"""Fields that only one kind of sensor has."""

OFFSET = Between("-2500 mm", "2500 mm")
DIRECTION, LENGTH = Between("-360 deg", "360 deg"), Between("0.1 mm", "1000 mm")


class Sensor(Section):
    """What is recorded; at: place from the plate's centre along length and width, on the undeformed plate [m].

    noise: 1 sigma, SI. strain: direction [rad] from the length axis towards the width's, side of the plate, length of
    the gauge [m] (absent: a point). pressure: radius of the gauge [m], 10 mm unless given: about a tenth of the
    diameter of a 1.8 kg bird; below three particle spacings its reading is coarse, and the run says so.
    """

    kind: Annotated[str, OneOf(tuple(NOISE))]
    at: tuple[Annotated[float, OFFSET], Annotated[float, OFFSET]] = (0.0, 0.0)
    noise: float | None = None
    direction: Annotated[float, DIRECTION] = 0.0
    side: Annotated[str, OneOf(("impact", "back"))] = "back"
    length: Annotated[float, LENGTH] | None = None
    radius: Annotated[float, LENGTH] = 0.01

    @field_validator("noise", mode="before")
    @classmethod
    def _noise_in_the_unit_of_its_kind(cls, value: Any, info: ValidationInfo) -> float | None:
        return of_its_kind(NOISE, info.data.get("kind", ""), value, NO_NOISE)

    @property
    def unit(self) -> str:
        """SI unit of the channel."""
        return NOISE[self.kind].unit

    def canonical(self) -> dict[str, Any]:
        """What changes its history, SI."""
        fields = self.model_dump(mode="json", exclude={"noise"})
        return {name: value for name, value in fields.items() if OF_KIND.get(name, self.kind) == self.kind}


NO_NOISE = 'fits no kind of sensor; write a length or a force such as "0.1 mm" or "0.1 kN"'
NO_DRIFT = 'fits no kind of sensor; write it per second, such as "1 mm/s" or "5 kN/s"'


def of_its_kind(marks: Mapping[str, Between], kind: str, value: Any, fits_none: str) -> float | None:
    """The value in SI, in the unit of its sensor's kind; where the kind is itself an error, of any kind."""
    if value is None:
        return None
    for mark in [marks[kind]] if kind in marks else marks.values():
        try:
            return mark.validate(value)
        except PydanticCustomError:
            if kind in marks:
                raise
    raise complaint(fits_none)


class Instrument(Section):
    """What stands between the sensor and the record: reading(t) = gain * lowpass[signal](t - time_offset) + drift t.

    bandwidth [Hz]: of a first-order low-pass (-3 dB), absent: none; time_offset [s]: above 0 the record is late;
    drift: in the channel's SI unit per second, from the record's time 0.
    """

    time_offset: Annotated[float, Between("-10 ms", "10 ms")] = 0.0
    gain: Annotated[float, Between(0.01, 100.0)] = 1.0
    bandwidth: Annotated[float, Between("1 Hz", "1e9 Hz")] | None = None
    drift: float = 0.0

    @field_validator("drift", mode="before")
    @classmethod
    def _drift_of_some_kind(cls, value: Any) -> float | None:
        return of_its_kind(DRIFT, "", value, NO_DRIFT)


DEFAULT_SENSORS = {
    "displacement_centre": Sensor(kind="displacement"),
    "contact_force": Sensor(kind="contact_force"),
    "reaction_force": Sensor(kind="reaction_force"),
}
