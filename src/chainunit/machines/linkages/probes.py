"""Outputs of a linkage: which ones it has, and their values at one state (reactions of guides, motion of points, axes
of links); its frame and signs in words."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

from ...core.planar import Motion, Vec2
from ...groups.joints import GuideForce
from ...mechanism.assur import GROUND, PRISMATIC, REVOLUTE
from ...mechanism.machine import Mechanism
from .declarations import GuideReaction, PointMotion
from .geometry import LinkFrame
from .joint_kind import JointEntry
from .parts import LinkageParts
from .points import connected
from .structure import DriverEntry, LinkEntry, Structure


def description_axis(u: Vec2, frame: LinkFrame) -> Vec2:
    """The x axis of a link's description, from the direction of its frame in the group."""
    e = frame.axis
    return Vec2(u.x * e.x + u.y * e.y, u.y * e.x - u.x * e.y)


def repeated_outputs(structure: Structure, variable: Callable[[str, str], str]) -> dict[str, str]:
    """The outputs that repeat another one, by name, with the name of that one: the motion of a point at which links
    are pinned together (of the first link that is joined to the ground, else of the first) or in which a centroid
    lies; the speeds of further points of a link that cannot turn; and the rotation of a link that slides along
    another one. `variable` gives the name of a link's variables from ``("link", name)``."""
    grounded = set[str]().union(
        *(joint.links for joint in structure.joints.values() if GROUND in joint.links)
    )
    repeated: dict[str, str] = {}

    def repeat(end: tuple[str, str], original: tuple[str, str], fields: Iterable[str]) -> None:
        name, one = (
            f"{variable('link', link)}{f'.{point}' * bool(point)}" for link, point in (end, original)
        )
        repeated.update(
            {f"{name}.{field}": f"{one}.{field}" for field in fields if f"{name}.{field}" not in repeated}
        )

    for name, link in structure.links.items():
        points = [(name, point) for point in _points(link)]
        for end in points:
            met = _pinned(structure, end)
            links = {neighbour for neighbour, _ in met}
            ranked = [neighbour for neighbour in structure.links if neighbour in links]
            first = next((neighbour for neighbour in ranked if neighbour in grounded), ranked[0])
            one = next((first, point) for point in _points(structure.links[first]) if (first, point) in met)
            if one != end:
                repeat(end, one, _PLACE if GROUND in links else _PLACE + _SPEEDS)
        if name in _orientation(structure, GROUND):
            for end in points[1:]:
                repeat(end, points[0], _SPEEDS)
    for name in structure.links:
        alike = _orientation(structure, name)
        first = next(link for link in structure.links if link in alike)
        if GROUND not in alike and first != name:
            repeat((name, ""), (first, ""), _TURNING)
    # an output that is repeated may repeat one itself
    for name, original in repeated.items():
        while original in repeated:
            original = repeated[original]
        repeated[name] = original
    constant = constant_outputs(structure, variable)
    return {name: original for name, original in repeated.items() if name not in constant}


def constant_outputs(structure: Structure, variable: Callable[[str, str], str]) -> dict[str, float]:
    """The outputs that are constant, by name: places that are numbers, and speeds, of points in ground pins; the
    rotation of links that cannot turn. `variable` is that of `repeated_outputs`."""
    constant: dict[str, float] = {}
    for name, link in structure.links.items():
        variable_of_link = variable("link", name)
        if name in _orientation(structure, GROUND):
            constant |= {f"{variable_of_link}.{field}": 0.0 for field in _TURNING}
        for point in _points(link):
            ground = [end for neighbour, end in _pinned(structure, (name, point)) if neighbour == GROUND]
            if ground:
                constant |= {f"{variable_of_link}.{point}.{field}": 0.0 for field in _SPEEDS}
                place = zip(_PLACE, structure.ground[ground[0]], strict=True)
                constant |= {
                    f"{variable_of_link}.{point}.{field}": x for field, x in place if not isinstance(x, str)
                }
    return constant


_PLACE, _SPEEDS, _TURNING, _CENTROID = ("x", "y"), ("vx", "vy", "ax", "ay"), ("w", "a"), "centroid"


def _points(link: LinkEntry) -> list[str]:
    """The points of a link that have outputs."""
    return [*link.points, *[_CENTROID] * link.heavy]


def _orientation(structure: Structure, link: str) -> set[str]:
    """The links that turn as this one does, as sliding joints hold them, and itself; links of the ground cannot
    turn."""
    return connected(link, [j.links for j in structure.joints.values() if j.kind == PRISMATIC])


def _pinned(structure: Structure, end: tuple[str, str]) -> set[tuple[str, str]]:
    """The points, by link and name, that meet this one at all times, and itself: revolute joints hold them together,
    or a centroid lies in them."""
    pins = [{j.on, j.by} for j in structure.joints.values() if j.kind == REVOLUTE]
    for name, link in structure.links.items():
        pins += [
            {(name, _CENTROID), (name, pin)} for pin, place in link.points.items() if place == link.centroid
        ]
    return connected(end, pins)


def notes_on(driver: DriverEntry, limits: tuple[float, float] | None, angle_counts: str) -> str:
    """Paragraphs on frame, signs and limits of a linkage, each behind an empty line. `limits` is the range of a
    driver that has one [m, rad], `angle_counts` says how the angle of one that turns counts."""
    if driver.linear:
        effort, unit, counts = "force", "m", f"phi is the way of {driver.joint}"
    else:
        effort, unit = "torque", "deg"
        counts = f"The angle of {driver.link} is phi/ratio and counts {angle_counts}"
    if limits:
        low, high = limits if driver.linear else map(math.degrees, limits)
        counts += (
            f", from {low:g} {unit} to {high:g} {unit}: beyond, the linkage was not checked and may not close"
        )
    return (
        "\n\nFrame and signs: x points right, y up; the angle of a link counts counter-clockwise from the x axis. "
        f"{counts}. The {effort} tau is the one that the machine needs. The reaction of a joint is the force on the "
        "link that its description names first."
        "\n\nLimits: links are rigid, and joints have no play; a joint pushes and pulls. Static "
        "friction is not modelled. Lengths are fixed before the initialization, where lengths for which the linkage "
        "does not close are refused."
    )


def point_motion(k: Motion, w: Any, a: Any) -> PointMotion:
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


def guide_reaction(
    m: Mechanism,
    joint: JointEntry,
    key: tuple[str, str],
    sign: float,
    reaction: Vec2,
    parts: LinkageParts,
    w: Any,
    a: Any,
) -> GuideReaction:
    """The reaction of a sliding joint on the link that is named first, about its point, and the motion in it."""
    assert isinstance(reaction, GuideForce)
    slide, block = m.slides[key], m.pins[key[0]]
    # the line of the driver has the direction in which the driver moves
    along = sign if joint.name == parts.structure.driver.joint else 1.0
    d = slide.d * along
    n = d.turned()
    moment = reaction.moment - (block.p - m.links[key[1]].pin.p).cross(reaction)
    start = m.pins[parts.pin_on(*joint.by)]
    s1, s2 = slide.s1 * sign * along, slide.s2 * sign * along
    return GuideReaction(
        fx=reaction.x * sign,
        fy=reaction.y * sign,
        normal=reaction.dot(n) * sign,
        moment=moment * sign,
        s=(block.p - start.p).dot(d),
        v=s1 * w,
        a=s1 * a + s2 * (w * w),
    )
