"""Loads of a linkage from a description: forces and torques by expressions of the motion, springs with dampers, and
tables over the coordinate."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from ...core.errors import InputError
from ...core.model import Requirement
from ...core.planar import ZERO, Vec2
from ...groups.joints import STEADY
from ...groups.loads import Effect, Moving, Wrench
from ...mechanism.curves import TableCurve
from ...mechanism.expressions import Width, expression, value_of

Entry = float | str
OF_POINT = ("x", "y", "vx", "vy")
"""Names that the expressions of a force know alone: place and velocity of its point."""
MOTION = ("phi", "w", *OF_POINT, "angle", "angle_rate")
"""Names that the expressions of a load know beside parameters and inputs: coordinate and speed of the driver, those
of `OF_POINT`, and angle and angular velocity of the link."""


LinkAngle = Callable[[Any, Moving], Any]
"""The angle of a link, of engine and mechanism [rad]."""
_EXTREME = re.compile(r"(min|max)\((.+)\)")


def extremes_of(loads: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    """The names of the extremes of the motion in the expressions of loads, each once."""
    return tuple(dict.fromkeys(name for _, text in _texts(loads) for name in expression(text).extremes))


def checked_widths(
    loads: Sequence[Mapping[str, Any]], values: Mapping[str, Any]
) -> tuple[tuple[str, Width, float], ...]:
    """The widths in the expressions of loads that depend on parameters: the key of the load, the width, and its sign
    at these `values`.

    Raises
    ------
    InputError
        in one line, for one that is zero, or below zero although it must not.
    """
    checked = []
    for key, width in ((key, width) for key, text in _texts(loads) for width in expression(text).widths):
        if not width.of.is_number:
            value = width.of.number(values)
            if wrong := width.fault(value):
                parameters = ", ".join(f"{name} = {values[name]:.6g}" for name in width.of.names)
                raise InputError(f"{wrong}{f' ({parameters})' * bool(parameters)}", key=key)
            checked.append((key, width, math.copysign(1.0, value)))
    return tuple(checked)


def requirement_of_width(key: str, width: Width, sign: float, parameters: Collection[str]) -> Requirement:
    """The requirement that a width keeps its sign."""
    subject = f"{'width' if sign > 0.0 else 'fall'} of {width.call} in {key}"
    names = tuple(name for name in width.of.names if name in parameters)
    return Requirement(subject, "1", "the function cannot change over it", names)


def loads_by_speed(loads: Sequence[Mapping[str, Any]]) -> list[str]:
    """The names of the forces and torques that depend on the speed: at rest they have their value at the speed 0."""
    speeds = {"w", "vx", "vy", "angle_rate"}
    fast_loads = {key.split(".")[1] for key, text in _texts(loads) if speeds & set(expression(text).names)}
    return [load["name"] for load in loads if load["name"] in fast_loads]


def _texts(loads: Sequence[Mapping[str, Any]]) -> Iterator[tuple[str, str]]:
    """The key and the text of each expression of a force or a torque."""
    for load in loads:
        for key, entries in (("force", load.get("force", ())), ("torque", (load.get("torque", 0.0),))):
            yield from ((f"loads.{load['name']}.{key}", entry) for entry in entries if isinstance(entry, str))


class ExtremeName(NamedTuple):
    """The parts of the name of an extreme: its kind (min, max), its link, its point (empty for the link itself), and
    its axis (x, y, angle)."""

    kind: str
    link: str
    point: str
    axis: str


def parts_of_extreme(extreme: str) -> ExtremeName:
    """The parts of the name of an extreme."""
    match = _EXTREME.fullmatch(extreme)
    assert match
    link, *point, axis = match[2].split(".")
    return ExtremeName(match[1], link, "".join(point), axis)


def name_of_load(load: Mapping[str, Any]) -> str:
    """The name of a load of a file among all loads: the weight and the losses have names of their own."""
    return f"loads.{load['name']}"


class ForceLaw(NamedTuple):
    """A force on a point of a link [N] by two expressions: in the frame, or, with an `axis`, along the link's own
    axes (x along the axis of its description). Its power counts as dissipated."""

    link: str
    point: str
    components: tuple[Entry, Entry]
    axis: Vec2 | None
    values: Mapping[str, Any]
    tables: Mapping[str, TableCurve]
    angle: LinkAngle
    by_reactions: bool = False

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Any) -> Effect:
        """Force and moment [N, N m], and the dissipated power by speed."""
        pin, link = m.pins[self.point], m.links[self.link]
        names = _motion(xp, m, w, self, self.components)
        names |= {"x": pin.p.x, "y": pin.p.y, "vx": pin.p1.x * w, "vy": pin.p1.y * w}
        fx, fy = (value_of(xp, component, names) for component in self.components)
        force = Vec2(fx, fy)
        if self.axis is not None:
            components = Vec2(self.axis.dot(force), self.axis.cross(force))
            force = link.u * components.x + link.u.turned() * components.y
        moment = (pin.p - link.pin.p).cross(force)
        return Effect((Wrench(self.link, force, moment),), dissipative=-force.dot(pin.p1))


class TorqueLaw(NamedTuple):
    """A torque on a link [N m], counter-clockwise, by an expression. Its power counts as dissipated."""

    link: str
    torque: Entry
    values: Mapping[str, Any]
    tables: Mapping[str, TableCurve]
    angle: LinkAngle
    by_reactions: bool = False

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Any) -> Effect:
        """The torque on the link [N m], which counts as dissipated."""
        link = m.links[self.link]
        torque = value_of(xp, self.torque, _motion(xp, m, w, self, [self.torque]))
        return Effect((Wrench(self.link, ZERO, torque),), dissipative=-(torque * link.t1))


def _motion(
    xp: Any, m: Moving, w: Any, load: ForceLaw | TorqueLaw, entries: Sequence[Entry]
) -> dict[str, Any]:
    """The quantities that both kinds of loads know, for these entries of the load."""
    used = {name for entry in entries if isinstance(entry, str) for name in expression(entry).names}
    table_values = {name: table.value(xp, m.q) for name, table in load.tables.items() if name in used}
    speed = w if m.rate is STEADY[0] else w * m.rate
    names = {**load.values, **table_values, "phi": m.q, "w": speed, "angle_rate": m.links[load.link].t1 * w}
    return names | ({"angle": load.angle(xp, m)} if "angle" in used else {})


class SpringDamper(NamedTuple):
    """A spring with a damper between two points, each of a link or, with the link None, of the ground: its pull is
    stiffness (L - length) + damping dL/dt, with its length L [N/m, m, N s/m]."""

    ends: tuple[tuple[str | None, str], tuple[str | None, str]]
    stiffness: Any
    length: Any
    damping: Any
    by_reactions: bool = False

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Any) -> Effect:
        """Forces on both ends [N], with the energy of the spring [J]."""
        (one, a), (other, b) = ((link, m.pins[pin]) for link, pin in self.ends)
        arm = b.p - a.p
        length = arm.length(xp)
        along = arm * (1.0 / length)
        rate = along.dot(b.p1 - a.p1)
        stretch = length - self.length
        pull, drag = self.stiffness * stretch, self.damping * rate * w
        force = along * (pull + drag)
        wrenches = tuple(
            Wrench(link, f, (end.p - m.links[link].pin.p).cross(f))
            for link, end, f in ((one, a, force), (other, b, -force))
            if link is not None
        )
        energy = 0.5 * pull * stretch
        return Effect(wrenches, conservative=pull * rate, dissipative=drag * rate, energy=energy)
