"""The declarations that every linkage from a file has: parameters, inputs and outputs."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Mapping
from typing import Any

from ...core.ports import LoadInput, PortSlopes, PortValues, ShaftMotion, Start
from ...core.quantities import Layout, Value, declaration, declared_class, fields_of, group, quantity
from ...mechanism.assur import PRISMATIC, REVOLUTE
from ...mechanism.driver_ports import AddedInertia
from ...mechanism.models import names_of
from ..parts import Force, GuideLaw, PinLaw
from .joint_kind import CAM


@declaration
class CommonParameters:
    """Parameters that every linkage has; `guides` only one in which a joint slides, `cams` only one with a cam."""

    g: Value = quantity("m/s2", "gravity, against y", default=9.81, min=0.0, tunable=True)
    ratio: Value = quantity(
        "1", "gear ratio, motor turns per driver turn", default=1.0, above=0.0, max=1e6, usual=(0.1, 500.0)
    )
    pins: PinLaw = group(PinLaw, "pins", default=PinLaw(friction=0.0, diameter=0.05))
    guides: GuideLaw = group(GuideLaw, "guides", default=GuideLaw())
    cams: GuideLaw = group(GuideLaw, "contacts of cams", default=GuideLaw())


@declaration
class WayParameters(CommonParameters):
    """Those of a linkage whose driver slides."""

    ratio: Value = quantity(
        "1", "ratio of the way phi to the way of the driver", default=1.0, above=0.0, max=1e6
    )


@declaration
class LinkBody:
    """A link as a body."""

    mass: Value = quantity("kg", "mass", default=0.0, min=0.0, tunable=True)
    inertia: Value = quantity(
        "kg.m2", "moment of inertia about the centroid", default=0.0, min=0.0, tunable=True
    )


@declaration
class GuideReaction(Force):
    """The reaction of a sliding joint, and the motion in it."""

    normal: Value = quantity("N", "force across the line, positive to the left of its direction", nominal=1e3)
    moment: Value = quantity("N.m", "moment about the point of the block, counter-clockwise", nominal=100.0)
    s: Value = quantity("m", "way of the block along the line")
    v: Value = quantity("m/s", "speed along the line")
    a: Value = quantity("m/s2", "acceleration along the line")


@declaration
class CamReaction(Force):
    """The force of a cam on its follower."""

    normal: Value = quantity("N", "force of the contact, above 0 where it presses", nominal=1e3)


@declaration
class PointMotion:
    """A point in the frame."""

    x: Value = quantity("m", "position x")
    y: Value = quantity("m", "position y")
    vx: Value = quantity("m/s", "velocity along x")
    vy: Value = quantity("m/s", "velocity along y")
    ax: Value = quantity("m/s2", "acceleration along x")
    ay: Value = quantity("m/s2", "acceleration along y")


@declaration
class LinkTurning:
    """The rotation of a link."""

    angle: Value = quantity("rad", "angle of its x axis, counter-clockwise")
    w: Value = quantity("rad/s", "angular velocity")
    a: Value = quantity("rad/s2", "angular acceleration")


@declaration
class LinkageMotion(ShaftMotion):
    """Motion of the motor shaft that turns the driver."""

    phi: Value = quantity("rad", "motor angle; the driver has turned by phi/ratio", default=0.0)


@declaration
class Energies:
    """Power and energies of every machine."""

    power: Value = quantity("W", "power that the driver takes, tau w", nominal=100.0)
    kinetic_energy: Value = quantity("J", "kinetic energy")
    potential_energy: Value = quantity("J", "potential energy of weights and springs", nominal=1000.0)
    dissipated_power: Value = quantity("W", "power that friction, dampers and loads take", nominal=100.0)
    load_power: Value = quantity(
        "W",
        "power that forces and torques give the machine; dissipated_power contains minus it",
        nominal=100.0,
    )
    margin: Value = quantity("1", "least margin of the groups; 0 is a dead position")


@declaration
class Running(Energies):
    """Outputs of every machine whose driver turns."""

    tau: Value = quantity("N.m", "torque needed at the motor shaft, J a + tau_bias", nominal=100.0)


@declaration
class WayRunning(Energies):
    """Outputs of every machine whose driver slides."""

    tau: Value = quantity("N", "force needed at the driver, J a + tau_bias", nominal=1000.0)


LOSSES: Mapping[str, tuple[str, type]] = {
    "pins": (REVOLUTE, PinLaw), "guides": (PRISMATIC, GuideLaw), "cams": (CAM, GuideLaw)
}  # fmt: skip
"""By table, the kind of the joints and the declaration of their losses."""


def with_differing(common: type, table: str, laws: Mapping[str, Mapping[str, float]]) -> tuple[str, Any, Any]:
    """The field of the losses in a `table` of the common parameters, with the `laws` of joints that differ."""
    declared, shared = LOSSES[table][1], getattr(common(), table)
    fields = [
        (name, declared, group(declared, f"{table.removesuffix('s')} {name}", default=declared(**values)))
        for name, values in laws.items()
    ]
    differing: Any = declared_class(f"{declared.__name__}s", (declared,), fields)
    return table, differing, group(differing, table, default=differing(**Layout(declared).by_name(shared)))


def common_parameters(linear: bool, kinds: Collection[str], starts: Mapping[str, float]) -> type:
    """The parameters that a linkage has whatever its file says: of a driver that slides (`linear`) or turns, with
    the losses of the `kinds` of its joints, and with the given start values by name."""
    declared = WayParameters if linear else CommonParameters
    fields = fields_of(
        declared, without=[name for name, (kind, _) in LOSSES.items() if kind not in (REVOLUTE, *kinds)]
    )
    return with_starts(declared_class(declared.__name__, (), fields), starts)


def with_starts(declared: type, starts: Mapping[str, float]) -> type:
    """A declaration with other start values, by name."""
    flat, fields = Layout(declared).from_names(dict(starts)), []
    for name, kind, slot in fields_of(declared):
        start, data = getattr(flat, name), slot.metadata
        if "of" in data:
            started: Any = group(data["of"], data["group"], default=start)
        else:
            described = dataclasses.replace(data["quantity"], start=start)
            started = dataclasses.field(default=start, metadata=data | {"quantity": described})
        fields.append((name, kind, started))
    return declared_class(declared.__name__, (), fields)


RESERVED = frozenset(
    name
    for declared in (
        CommonParameters,
        LinkageMotion,
        PortValues,
        PortSlopes,
        Running,
        Start,
        AddedInertia,
        LoadInput,
    )
    for name in (*names_of(declared), "end_stops", "end_stop_force", "end_stop_torque")
)
"""Names of variables that every machine has."""
