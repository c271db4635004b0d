"""The outputs of a linkage from a file: their declaration, and their values at one state."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from ...core.planar import Vec2
from ...core.quantities import declared_class, group
from ...mechanism.assur import PRISMATIC
from ...mechanism.driver_ports import DriverPort
from ...mechanism.linkage import Linkage
from ...mechanism.machine import MachineState
from ..parts import Force, force
from .declarations import RESERVED, GuideReaction, LinkTurning, PointMotion, Running, WayRunning
from .loads import name_of_load
from .parts import LinkageParts
from .probes import description_axis, guide_reaction, point_motion
from .structure import Structure


@dataclass
class DescribedLinkage(Linkage):
    """A linkage with the parts that it was made from."""

    parts: LinkageParts


class LinkageOutputs:
    """The outputs of a described linkage."""

    data: Mapping[str, Any]
    structure: Structure
    port: DriverPort
    link_turns: Mapping[str, tuple[float, float]]
    """For each link its turns per turn of the driver, and the middle of the rest of its angle [rad]."""

    def variable(self, kind: str, name: str) -> str:
        """The name under which the variables of a link or a joint stand: with its kind where the name has another
        meaning already."""
        shared = kind == "joint" and name in self.structure.links
        return f"{name}_{kind}" if shared or name in RESERVED else name

    @cached_property
    def outputs(self) -> type:
        """The declaration of the outputs."""
        fields: list[tuple[str, Any, Any]] = []
        for name, joint in self.structure.joints.items():
            kind: type = GuideReaction if joint.kind == PRISMATIC else Force
            description = f"joint {name}: on {joint.on[0]} from {joint.by[0]}"
            fields.append((self.variable("joint", name), kind, group(kind, description)))
        for name, kind in self.link_outputs.items():
            fields.append((self.variable("link", name), kind, group(kind, f"link {name}")))
        running = WayRunning if self.structure.driver.linear else Running
        return declared_class("Outputs", (self.port.values, running), fields)

    @cached_property
    def link_outputs(self) -> Mapping[str, Any]:
        """The declaration of the outputs of each link."""
        declared = {}
        for name, link in self.structure.links.items():
            points = [(point, PointMotion, group(PointMotion, f"point {point}")) for point in link.points]
            if link.heavy:
                points.append(("centroid", PointMotion, group(PointMotion, "centroid")))
            declared[name] = declared_class(f"Link_{name}", (LinkTurning,), points)
        return declared

    def probes(self, xp: Any, p: Any, u: Any, s: MachineState, a: Any) -> dict[str, Any]:
        """Reactions, rotation of links and motion of points at acceleration `a` of the driver."""
        reactions, m, w = s.reactions(a), s.m, s.w
        assert isinstance(m.linkage, DescribedLinkage)
        parts = m.linkage.parts
        losses = sum(
            s.effects[name_of_load(load)].dissipative
            for load in self.data["loads"]
            if load["type"] != "spring"
        )
        values: dict[str, Any] = {"load_power": -(losses * w)}
        for name, joint in self.structure.joints.items():
            key, sign = parts.receivers[name]
            if joint.kind == PRISMATIC:
                value: Any = guide_reaction(m, joint, key, sign, reactions[key], parts, w, a)
            else:
                f = reactions[key]
                value = force(f if sign > 0.0 else -f)
            values[self.variable("joint", name)] = value
        for name, link in self.structure.links.items():
            moving, frame = m.links[name], parts.frames[name]
            fields = {
                "angle": self.angle(xp, name, description_axis(moving.u, frame), m.q),
                "w": moving.t1 * w,
                "a": moving.t2 * (w * w) + moving.t1 * a,
            }
            for point in link.points:
                place = frame.coordinates(parts.geometry.point(name, point))
                fields[point] = point_motion(moving.beside(place.x, place.y), w, a)
            if link.heavy:
                place = frame.coordinates(parts.geometry.vector(link.centroid))
                fields["centroid"] = point_motion(moving.beside(place.x, place.y), w, a)
            values[self.variable("link", name)] = self.link_outputs[name](**fields)
        return values

    def angle(self, xp: Any, name: str, axis: Vec2, q: Any) -> Any:
        """The angle of a link without jumps: the middle of its course, which may turn with the driver, and the
        rest."""
        rate, middle = self.link_turns[name]
        about = middle + rate * q if rate else middle
        c, s = (xp.cos(about), xp.sin(about)) if rate else (math.cos(about), math.sin(about))
        return about + xp.atan2(c * axis.y - s * axis.x, c * axis.x + s * axis.y)
