"""The outputs of a linkage from a file: their declaration, their values at one state (reactions, motion of points,
rotation of links), and which of them repeat others or are constant."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from ...core.planar import Motion, Vec2
from ...core.quantities import declared_class, group
from ...groups.joints import GuideForce
from ...mechanism.assur import GROUND, PRISMATIC, REVOLUTE
from ...mechanism.driver_ports import DriverPort
from ...mechanism.linkage import Linkage
from ...mechanism.machine import MachineState, Mechanism
from ..parts import Force, force
from .declarations import RESERVED, CamReaction, GuideReaction, LinkTurning, PointMotion, Running, WayRunning
from .further import FurtherDrivers
from .joint_kind import CAM, JointEntry
from .loads import name_of_load
from .names import LinkPoint, connected
from .parts import LinkageParts
from .structure import LinkEntry, Structure

_PLACE, _SPEEDS, _TURNING, _CENTROID = ("x", "y"), ("vx", "vy", "ax", "ay"), ("w", "a"), "centroid"


@dataclass
class DescribedLinkage(Linkage):
    """A linkage with the parts that it was made from."""

    parts: LinkageParts

    def angle(self, link: str, m: Mechanism) -> float:
        """The angle of a link in the mechanism `m` of this linkage with numbers, in a turn [rad]."""
        axis = self.parts.frames[link].x_axis(m.links[link].u)
        return math.atan2(axis.y, axis.x)


def _points(link: LinkEntry) -> list[str]:
    """The points of a link that have outputs."""
    return [*link.points, *[_CENTROID] * link.heavy]


class LinkageOutputs:
    """The outputs of a described linkage."""

    data: Mapping[str, Any]
    structure: Structure
    port: DriverPort
    further: FurtherDrivers
    link_turns: Mapping[str, tuple[float, float]]
    """For each link its turns per turn of the driver, and the middle of the rest of its angle [rad]."""

    def variable(self, kind: str, name: str) -> str:
        """The name under which the variables of a link or a joint stand: with its kind if the name has another
        meaning already."""
        shared = kind != "link" and name in self.structure.links
        shared = shared or (kind == "driver" and name in self.structure.joints)
        return f"{name}_{kind}" if shared or name in RESERVED else name

    @cached_property
    def outputs(self) -> type:
        """The declaration of the outputs."""
        fields: list[tuple[str, Any, Any]] = []
        for name, joint in self.structure.joints.items():
            kind: type = {PRISMATIC: GuideReaction, CAM: CamReaction}.get(joint.kind, Force)
            description = f"joint {name}: on {joint.on[0]} from {joint.by[0]}"
            fields.append((self.variable("joint", name), kind, group(kind, description)))
        for name, kind in self.link_outputs.items():
            fields.append((self.variable("link", name), kind, group(kind, f"link {name}")))
        fields += self.further.outputs()
        running = WayRunning if self.structure.driver.linear else Running
        return declared_class("Outputs", (self.port.values, running), fields)

    @cached_property
    def link_outputs(self) -> Mapping[str, Any]:
        """The declaration of the outputs of each link."""
        declared = {}
        for name, link in self.structure.links.items():
            titles = {point: f"point {point}" for point in link.points}
            titles |= {_CENTROID: _CENTROID} if link.heavy else {}
            points = [(point, PointMotion, group(PointMotion, title)) for point, title in titles.items()]
            declared[name] = declared_class(f"Link_{name}", (LinkTurning,), points)
        return declared

    def probes(self, xp: Any, p: Any, u: Any, s: MachineState, a: Any) -> dict[str, Any]:
        """Reactions, rotation of links and motion of points at acceleration `a` of the driver."""
        further = self.further.outputs_at(xp, s, a)
        m, reactions, effects, w, a = s.moving(a)
        assert isinstance(m.linkage, DescribedLinkage)
        parts = m.linkage.parts
        losses = sum(
            effects[name_of_load(load)].dissipative for load in self.data["loads"] if load["type"] != "spring"
        )
        values: dict[str, Any] = {"load_power": -(losses * w), **further}
        for name, joint in self.structure.joints.items():
            key, sign = parts.receivers[name]
            if joint.kind == PRISMATIC:
                value: Any = self._guide_reaction(joint, parts, m, reactions[key], w, a)
            elif joint.kind == CAM:
                pressing = -reactions[key].dot(m.slides[key].d.turned())
                value = CamReaction(fx=reactions[key].x, fy=reactions[key].y, normal=pressing)
            else:
                value = force(reactions[key] if sign > 0.0 else -reactions[key])
            values[self.variable("joint", name)] = value
        for name, link in self.structure.links.items():
            moving, frame = m.links[name], parts.frames[name]
            fields = {
                "angle": self.angle(xp, name, frame.x_axis(moving.u), m.q),
                "w": moving.t1 * w,
                "a": moving.t2 * (w * w) + moving.t1 * a,
            }
            places = {point: parts.geometry.point(name, point) for point in link.points}
            if link.heavy:
                places[_CENTROID] = parts.geometry.vector(link.centroid)
            for point, place in places.items():
                in_frame = frame.coordinates(place)
                fields[point] = _point_motion(moving.beside(in_frame.x, in_frame.y), w, a)
            values[self.variable("link", name)] = self.link_outputs[name](**fields)
        return values

    def _guide_reaction(
        self, joint: JointEntry, parts: LinkageParts, m: Mechanism, reaction: Vec2, w: Any, a: Any
    ) -> GuideReaction:
        """The reaction of a sliding joint on the link that is named first, about its point, and the motion in it."""
        assert isinstance(reaction, GuideForce)
        key, sign = parts.receivers[joint.name]
        slide, block = m.slides[key], m.pins[key[0]]
        # the line of a driver has the direction in which the driver moves
        along = sign if any(joint.name == driver.joint for driver in self.structure.drivers) else 1.0
        d = slide.d * along
        moment = reaction.moment - (block.p - m.links[key[1]].pin.p).cross(reaction)
        s1, s2 = slide.s1 * sign * along, slide.s2 * sign * along
        return GuideReaction(
            fx=reaction.x * sign,
            fy=reaction.y * sign,
            normal=reaction.dot(d.turned()) * sign,
            moment=moment * sign,
            s=(block.p - m.pins[parts.pin_on(*joint.by)].p).dot(d),
            v=s1 * w,
            a=s1 * a + s2 * (w * w),
        )

    def angle(self, xp: Any, name: str, axis: Vec2, q: Any) -> Any:
        """The angle of a link without jumps: the middle of its course, which may turn with the driver, and the
        rest."""
        rate, middle = self.link_turns[name]
        about = middle + rate * q if rate else middle
        c, s = (xp.cos(about), xp.sin(about)) if rate else (math.cos(about), math.sin(about))
        return about + xp.atan2(c * axis.y - s * axis.x, c * axis.x + s * axis.y)

    # outputs that tell nothing new

    @cached_property
    def constant(self) -> dict[str, float]:
        """The outputs that are constant, by name: places that are numbers, and speeds, of points in ground pins; the
        rotation of links that cannot turn."""
        constant: dict[str, float] = {}
        for name, link in self.structure.links.items():
            title = self.variable("link", name)
            if name in self._orientation(GROUND):
                constant |= {f"{title}.{field}": 0.0 for field in _TURNING}
            for point in _points(link):
                ground = [end for owner, end in self._pinned(name, point) if owner == GROUND]
                if ground:
                    constant |= {f"{title}.{point}.{field}": 0.0 for field in _SPEEDS}
                    place = zip(_PLACE, self.structure.ground[ground[0]], strict=True)
                    constant |= {f"{title}.{point}.{axis}": x for axis, x in place if not isinstance(x, str)}
        return constant

    @cached_property
    def repeated(self) -> dict[str, str]:
        """The outputs that repeat another one, by name, with the name of that one: the motion of a point at which
        links are pinned together (of the first link that is joined to the ground, else of the first) or in which a
        centroid lies; the speeds of further points of a link that cannot turn; and the rotation of a link that slides
        along another one."""
        links, repeated = self.structure.links, dict[str, str]()
        grounded = {
            link for joint in self.structure.joints.values() for link in joint.links if GROUND in joint.links
        }

        def repeat(output: str, original: str, fields: Sequence[str]) -> None:
            for field in fields:
                repeated.setdefault(f"{output}.{field}", f"{original}.{field}")

        for name, link in links.items():
            points = _points(link)
            titles = {point: f"{self.variable('link', name)}.{point}" for point in points}
            for point in points:
                met = self._pinned(name, point)
                meeting = [owner for owner in links if owner in {owner for owner, _ in met}]
                first = next((owner for owner in meeting if owner in grounded), meeting[0])
                one = next(end for end in _points(links[first]) if (first, end) in met)
                if (first, one) != (name, point):
                    fields = _PLACE if any(owner == GROUND for owner, _ in met) else _PLACE + _SPEEDS
                    repeat(titles[point], f"{self.variable('link', first)}.{one}", fields)
            if name in self._orientation(GROUND):
                for point in points[1:]:
                    repeat(titles[point], titles[points[0]], _SPEEDS)
        for name in links:
            alike = self._orientation(name)
            first = next(link for link in links if link in alike)
            if GROUND not in alike and first != name:
                repeat(self.variable("link", name), self.variable("link", first), _TURNING)
        # an output that is repeated may repeat one itself
        for name, original in repeated.items():
            while original in repeated:
                original = repeated[original]
            repeated[name] = original
        return {name: original for name, original in repeated.items() if name not in self.constant}

    def _orientation(self, link: str) -> set[str]:
        """The links that turn as this one does, as sliding joints hold them, and itself; links of the ground cannot
        turn."""
        return connected(link, [j.links for j in self.structure.joints.values() if j.kind == PRISMATIC])

    def _pinned(self, link: str, point: str) -> set[LinkPoint]:
        """The points, by link and name, that meet this one at all times, and itself: revolute joints hold them
        together, or a centroid lies in them."""
        pins = [{j.on, j.by} for j in self.structure.joints.values() if j.kind == REVOLUTE]
        for name, entry in self.structure.links.items():
            centred = (pin for pin, place in entry.points.items() if place == entry.centroid)
            pins += [{(name, _CENTROID), (name, pin)} for pin in centred]
        return connected((link, point), pins)


def _point_motion(k: Motion, w: Any, a: Any) -> PointMotion:
    """The motion of a point at speed `w` and acceleration `a` of the driver."""
    w2 = w * w
    return PointMotion(
        x=k.p.x,
        y=k.p.y,
        vx=k.p1.x * w,
        vy=k.p1.y * w,
        ax=k.p1.x * a + k.p2.x * w2,
        ay=k.p1.y * a + k.p2.y * w2,
    )
