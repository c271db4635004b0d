"""The variables of a machine's driver, which turns or slides: motion, load port, start, and the answer to an effort.

The names are those of a shaft in both cases: `phi` is the angle or the way, `tau` the torque or the force, `J` the
inertia or the mass. The units tell them apart.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from ..core.integrators import Solver
from ..core.model import Requirement, Terminal
from ..core.ports import PortSlopes, PortValues, ShaftMotion, Start, flanges, load_terminal, way_terminals
from ..core.quantities import Value, declaration, group, quantity


class DriverWords(NamedTuple):
    """The words for the effort that drives a driver, and for its place."""

    effort: str
    place: str


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
    words: DriverWords
    units: Mapping[str, str] = MappingProxyType({})
    """units of quantities at the driver, by those of a driver that turns, where they differ"""

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
class TurningStates:
    """States of the direct machine; each is an output, too."""

    phi: Value = quantity("rad", "motor angle; crank angle is phi/ratio")
    w: Value = quantity("rad/s", "motor speed")


@declaration
class DrivingTorque:
    """Torque of the motor."""

    tau: Value = quantity("N.m", "torque of the motor on the shaft", default=0.0, nominal=100.0)


@declaration
class Turning:
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
    TurningStates,
    DrivingTorque,
    Turning,
    (*flanges("inflow"), load_terminal()),
    flanges("inflow"),
    Requirement(
        "inertia of the crank and on its shaft",
        "kg.m2",
        "at the dead points of the rocker nothing else carries the torque; give crank.I, crank.m or J_added",
    ),
    DriverWords("motor torque", "angle"),
)
"""A driver that a motor turns."""


@declaration
class WayMotion:
    """Motion of a driver that slides."""

    phi: Value = quantity("m", "way of the driver", default=0.0)
    w: Value = quantity("m/s", "speed of the driver", default=0.0)
    a: Value = quantity("m/s2", "acceleration of the driver", default=0.0)


@declaration
class WayPortValues:
    """The load of a driver that slides, at the point (phi0, w0)."""

    tau_bias: Value = quantity("N", "force needed at constant speed of the driver", nominal=1000.0)
    J: Value = quantity("kg", "mass reflected to the driver", min=0.0)
    dJ_dphi: Value = quantity("kg/m", "derivative of J by the way of the driver")
    phi0: Value = quantity("m", "way of the driver at which the load was evaluated")
    w0: Value = quantity("m/s", "speed of the driver at which the load was evaluated")


@declaration
class WayPortSlopes:
    """Exact derivatives of the load of a driver that slides."""

    tau_bias_dphi: Value = quantity("N/m", "derivative of tau_bias by the way of the driver", nominal=1000.0)
    tau_bias_dw: Value = quantity("N.s/m", "derivative of tau_bias by the speed of the driver")


@declaration
class WayStart:
    """Start of a driver that slides."""

    phi_start: Value = quantity("m", "way of the driver at the start", default=0.0)
    w_start: Value = quantity("m/s", "speed of the driver at the start", default=0.0)
    solver: Solver = group(Solver, "internal integrator", default=Solver())


@declaration
class AddedMass:
    """The mass on a driver that slides by itself."""

    J_added: Value = quantity(
        "kg", "mass on the driver beside the machine's", default=0.0, min=0.0, tunable=True
    )


@declaration
class WayStates:
    """States of a machine whose driver slides by itself."""

    phi: Value = quantity("m", "way of the driver")
    w: Value = quantity("m/s", "speed of the driver")


@declaration
class DrivingForce:
    """Force on a driver that slides."""

    tau: Value = quantity("N", "force on the driver", default=0.0, nominal=1000.0)


@declaration
class WayAnswer:
    """Acceleration of a driver that slides, and the force that it needs."""

    a: Value = quantity("m/s2", "acceleration of the driver", nominal=10.0)
    tau_bias: Value = quantity("N", "force needed at constant speed of the driver", nominal=1000.0)
    J: Value = quantity("kg", "mass reflected to the driver")
    end_stop_force: Value = quantity(
        "N",
        "force of the end stops against the driver: above 0 behind the upper end of its range",
        nominal=1000.0,
    )


SLIDING = DriverPort(
    WayMotion,
    WayPortValues,
    WayPortSlopes,
    WayStart,
    AddedMass,
    WayStates,
    DrivingForce,
    WayAnswer,
    way_terminals(load=True),
    way_terminals(load=False),
    Requirement(
        "mass of the driver and on it",
        "kg",
        "at a dead point nothing else carries the force; give the link a mass, or J_added",
    ),
    DriverWords("force on the driver", "way"),
    MappingProxyType({"rad": "m", "rad/s": "m/s", "N.m": "N", "kg.m2": "kg"}),
)
"""A driver that a cylinder pushes."""
