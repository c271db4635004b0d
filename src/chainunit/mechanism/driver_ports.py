"""The variables of a machine's driver, which turns or slides: motion, load port, start, and the answer to an effort.

The names are those of a shaft in both cases: `phi` is the angle or the way, `tau` the torque or the force, `J` the
inertia or the mass. The units tell them apart.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from ..core.model import Requirement, Terminal
from ..core.ports import PortSlopes, PortValues, ShaftMotion, Start, flanges, load_terminal, way_terminals
from ..core.quantities import Fields, Value, declaration, declared_class, fields_of, quantity


@declaration
class DriverEffort:
    """The effort of a driver beside the first one."""

    tau: Value = quantity("N.m", "torque needed along its angle", nominal=100.0)
    power: Value = quantity("W", "power that it takes, tau w", nominal=100.0)


@declaration
class FollowedDriver(DriverEffort):
    """A driver that follows the first one: its motion, and its effort."""

    phi: Value = quantity("rad", "angle of the driver")
    w: Value = quantity("rad/s", "speed of the driver")
    a: Value = quantity("rad/s2", "acceleration of the driver", nominal=100.0)


class DriverPort(NamedTuple):
    """The declarations of a driver: its motion, the values and slopes of its load port; of the direct model its
    start, the inertia added to it, its states, the effort that drives it, and its answer; its terminals, with the
    load port and without, and the requirement that the direct model has some inertia."""

    motion: type
    values: type
    slopes: type
    start: type
    added: type
    states: type
    effort: type
    answer: type
    terminals: tuple[Terminal, ...]
    flanges: tuple[Terminal, ...]
    inertia: Requirement
    words: tuple[str, str]
    """for the effort that drives it, and for its place"""
    units: Mapping[str, str] = MappingProxyType({})
    """units of quantities at the driver, by those of a driver that turns, where they differ"""
    stop: str = ""
    """the output of the end stops; empty without them"""
    follower: type = FollowedDriver
    """of a driver that follows another one: its motion and its effort"""

    def unit(self, unit: str) -> str:
        """The unit of a quantity at the driver that is in `unit` where the driver turns."""
        return self.units.get(unit, unit)


@declaration
class AddedInertia:
    """The inertia on the shaft of a machine that turns by itself."""

    J_added: Value = quantity(
        "kg.m2", "inertia on the motor shaft beside the machine's", default=0.0, min=0.0, tunable=True
    )


@declaration
class RotatingStates:
    """States of the direct machine; each is an output, too."""

    phi: Value = quantity("rad", "motor angle; {driver} angle is phi/ratio")
    w: Value = quantity("rad/s", "motor speed")


@declaration
class DrivingTorque:
    """Torque of the motor."""

    tau: Value = quantity("N.m", "torque of the motor on the shaft", default=0.0, nominal=100.0)


@declaration
class RotatingAnswer:
    """Acceleration, and the torque on the shaft."""

    a: Value = quantity("rad/s2", "motor acceleration", nominal=100.0)
    tau_bias: Value = quantity("N.m", "torque needed at constant speed of the shaft", nominal=100.0)
    J: Value = quantity("kg.m2", "inertia reflected to the shaft")


ROTATING = DriverPort(
    ShaftMotion,
    PortValues,
    PortSlopes,
    Start,
    AddedInertia,
    RotatingStates,
    DrivingTorque,
    RotatingAnswer,
    (*flanges("inflow"), load_terminal()),
    flanges("inflow"),
    Requirement(
        "inertia of the crank and on its shaft",
        "kg.m2",
        "at the dead points of the rocker nothing else carries the torque; give crank.I, crank.m or J_added",
    ),
    ("motor torque", "angle"),
)
"""A driver that a motor turns all the way round."""


_END_STOPS = "{} of the end stops against the driver: above 0 behind the upper end of its range"


@declaration
class SwingingAnswer(RotatingAnswer):
    """Acceleration, the torque on the shaft, and that of the end stops."""

    end_stop_torque: Value = quantity("N.m", _END_STOPS.format("torque"), nominal=1000.0)


SWINGING = ROTATING._replace(answer=SwingingAnswer, stop="end_stop_torque")
"""A driver that a motor turns to and fro within a range."""


_UNITS = {
    "rad": "m",
    "rad/s": "m/s",
    "rad/s2": "m/s2",
    "N.m": "N",
    "kg.m2": "kg",
    "kg.m2/rad": "kg/m",
    "N.m/rad": "N/m",
    "N.m.s/rad": "N.s/m",
    "W": "W",
}
"""The units of a driver that slides, by those of one that turns."""
_NOMINAL = {"rad/s2": 0.1, "N.m": 10.0, "N.m/rad": 10.0, "W": 1.0}
"""By the unit of a driver that turns, the factor of the nominal size."""
_WORDS = {
    "; {driver} angle is phi/ratio": "",
    "torque of the motor": "force",
    "the motor's shaft": "the driver",
    "the motor shaft": "the driver",
    "the shaft": "the driver",
    "motor angle": "way of the driver",
    "motor speed": "speed of the driver",
    "motor acceleration": "acceleration of the driver",
    "angle of": "way of",
    "torque": "force",
    "along its angle": "along its way",
    "inertia": "mass",
}
"""The words on a driver that slides, by those on one that turns; the longer ones come first."""


def _sliding(name: str, rotating: type, description: str, fields: Fields = ()) -> type:
    """The declaration of a driver that turns, for one that slides: the same names in other units and words, and more
    `fields`. `description` are its description."""
    slid: list[tuple[str, Any, Any]] = []
    for field in fields_of(rotating):
        q = field[2].metadata.get("quantity")
        if q is not None:
            text = q.template
            for turned, pushed in _WORDS.items():
                text = text.replace(turned, pushed)
            nominal = q.nominal and q.nominal * _NOMINAL[q.unit]
            more = {"default": q.start, "min": q.low, "nominal": nominal, "tunable": q.tunable}
            field = field[0], field[1], quantity(_UNITS[q.unit], text, **more)
        slid.append(field)
    sliding: type = declared_class(name, (), [*slid, *fields])
    sliding.__doc__, sliding.__module__ = description, __name__
    return sliding


SLIDING = DriverPort(
    _sliding("WayMotion", ShaftMotion, "Motion of a driver that slides."),
    _sliding("WayPortValues", PortValues, "The load of a driver that slides, at the point (phi0, w0)."),
    _sliding("WayPortSlopes", PortSlopes, "Exact derivatives of the load of a driver that slides."),
    _sliding("WayStart", Start, "Start of a driver that slides."),
    _sliding("AddedMass", AddedInertia, "The mass on a driver that slides by itself."),
    _sliding("WayStates", RotatingStates, "States of a machine whose driver slides by itself."),
    _sliding("DrivingForce", DrivingTorque, "Force on a driver that slides."),
    _sliding(
        "WayAnswer",
        RotatingAnswer,
        "Acceleration of a driver that slides, and the force that it needs.",
        [("end_stop_force", Value, quantity("N", _END_STOPS.format("force"), nominal=1000.0))],
    ),
    way_terminals(load=True),
    way_terminals(load=False),
    Requirement(
        "mass of the driver and on it",
        "kg",
        "at a dead point nothing else carries the force; give the link a mass, or J_added",
    ),
    ("force on the driver", "way"),
    MappingProxyType({unit: _UNITS[unit] for unit in ("rad", "rad/s", "N.m", "kg.m2", "N.m/rad")}),
    "end_stop_force",
    _sliding("FollowedSlide", FollowedDriver, "A driver that slides and follows the first one."),
)
"""A driver that a cylinder pushes."""
