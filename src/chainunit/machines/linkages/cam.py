"""Cams of linkage files: their keys, what is refused in a profile, and their groups."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.engines import numpy_
from ...core.errors import InputError, shown
from ...core.planar import ZERO, Vec2
from ...groups.cam import CamFollower, ProfilePoint
from ...groups.group import Group
from ...groups.joints import Rail
from ...mechanism.assur import GROUND, PRISMATIC, REVOLUTE, AssurGroup
from ...mechanism.curves import TableCurve
from ...mechanism.expressions import expression
from .joint_kind import CAM, JointEntry, JointParts, JointTable, SingleLinkKind
from .laws import LawCourse

if TYPE_CHECKING:
    from .entries import EntryReader

_PLACES, _SUSPECTS, _HALVINGS = 1440, 12, 30
"""Angles at which a profile is checked, of these the intervals in which a jump is looked for, and their halvings."""
_JUMP = 1e-6
"""Jump of a radius or of its derivatives, in parts of their size, that counts as one."""
_REMEDY = (
    "a profile is smooth up to its second derivative: take a table [tables.NAME] over phi, which is splined, or rises "
    "such as step(phi - 60 * deg, 80 * deg)"
)


class CamKind(SingleLinkKind):
    """A cam: a profile about a point of the link `by`, on which a roller or a flat face of the link `on` lies."""

    name = noun = CAM
    keys = ("radius", "roller", "pitch", "face")
    use = "for a cam give it `radius`, that of the profile over phi"
    losses = ("cams", ("friction", "damping"))
    limits = "A follower stays on its cam, also if its force `normal` is below 0, at which it would lift off."
    equations = 1
    alone = "cam follower"
    seats = (REVOLUTE, PRISMATIC)

    def read(self, reader: EntryReader, key: str, table: Mapping[str, Any], joint: JointTable) -> None:
        """Add the radius of the profile, and the roller or the face of the follower."""
        on, point = joint["on"]
        radius = reader.entry(f"{key}.radius", table.get("radius"), "m", {"phi": "rad", **reader.table_units})
        if isinstance(radius, str):
            parsed = expression(radius)
            with reader.at(f"{key}.radius"):
                if parsed.extremes:
                    raise InputError(f"has {parsed.extremes[0]}, which depends on it; give a number")
                reader.count(parsed)
        roller, pitch, face = (
            reader.entry(f"{key}.roller", table.get("roller", 0.0), "m"),
            table.get("pitch", False),
            "",
        )
        if not isinstance(roller, str) and roller < 0.0:
            reader.fault(
                f"{key}.roller", f"is {shown(table['roller'])}; must be >= 0, the radius of the roller"
            )
        if not isinstance(pitch, bool):
            reader.fault(f"{key}.pitch", f"is {shown(pitch)}; must be true or false")
        if on == GROUND:
            reader.fault(
                f"{key}.on", f"is ground.{point}; must be a point of the follower, and `by` one of the cam"
            )
        if "face" in table:
            face, others = table["face"], [name for name in reader.points[on] if name != point]
            if face not in others:
                reader.fault(
                    f"{key}.face",
                    f"is {shown(face)}; must be another point of {on} on its face: {', '.join(others) or 'add one'}",
                )
            for other in {"roller", "pitch"} & {*table}:
                reader.fault(
                    f"{key}.{other}", "belongs to a roller, and the follower has a face; take one of both out"
                )
        joint |= {"radius": radius, "roller": roller, "pitch": pitch, "face": face}

    def start_faults(
        self, joint: Mapping[str, Any], points: Mapping[str, Mapping[str, tuple[float, float]]]
    ) -> Iterator[tuple[str, str]]:
        """The fault of a face without a direction."""
        (on, point), face = joint["on"], joint["face"]
        if face and math.dist(points[on][point], points[on][face]) == 0.0:
            yield (
                f"joints.{joint['name']}.face",
                f"{point} and {face} are in one place, so that the face has no line",
            )

    def law_faults(
        self, joint: Mapping[str, Any], number: Callable[[Any], float], values: Mapping[str, Any],
        tables: Mapping[str, TableCurve],
    ) -> Iterator[tuple[str, str]]:  # fmt: skip
        """See `JointKind`: a radius that is none, a jump of the profile, and an undercut one."""
        law, key, angles = LawCourse(joint["radius"], values, tables), f"joints.{joint['name']}", _ANGLES

        def rates(at: Any) -> Any:
            radius, slopes = law(numpy_(), at)
            return np.array([np.broadcast_to(x, np.shape(at)) for x in (radius, *slopes)], float)

        with np.errstate(all="ignore"):
            course = rates(angles)
            wrong = ~(np.isfinite(course).all(axis=0) & (course[0] > 0.0))
            if wrong.any():
                k = int(np.argmax(wrong))
                state = f"is {1e3 * course[0, k]:.4g} mm" if np.isfinite(course[0, k]) else "has no value"
                yield f"{key}.radius", f"{state} at phi = {_degrees(angles[k])}; must be > 0 all around"
                return
            size = course[0].max() + np.abs(course[:3]).max(axis=1)
            misses = np.abs(course[:3, -1] - course[:3, 0]) > _JUMP * size
            if misses.any():
                what = ("radius", "slope", "second derivative")[int(np.argmax(misses))]
                yield f"{key}.radius", f"its {what} differs at phi = 0 and 360 deg; {_REMEDY}"
                return
            for order, what in enumerate(("radius", "slope", "second derivative")):
                place = _jump(
                    lambda at, order=order: rates(at)[order], course[order], course[order + 1], size[order]
                )
                if place is not None:
                    yield f"{key}.radius", f"its {what} jumps at phi = {_degrees(place)}; {_REMEDY}"
                    return
            profile = ProfilePoint.of(numpy_(), course, angles)
        k, roller = profile.curvature, number(joint["roller"])
        if joint["face"]:
            worst = int(np.argmin(k))
            if not k[worst] > 0.0:
                yield (
                    key,
                    f"the profile is hollow or straight at phi = {_degrees(angles[worst])}, and a flat face bridges it "
                    "there; take a roller, a larger base circle, or a slower rise",
                )
            return
        sign, what = (1.0, "pitch curve bulges") if joint["pitch"] else (-1.0, "profile is hollow")
        worst = int(np.argmax(sign * k))
        if not roller * sign * k[worst] < 1.0:
            radius = 1e3 / (sign * k[worst])
            yield (
                f"{key}.roller",
                f"is {1e3 * roller:.4g} mm, and the {what} with a radius of {radius:.4g} mm at phi = "
                f"{_degrees(angles[worst])}, so that the cam is undercut there; take a roller of less than "
                f"{radius:.4g} mm, a larger base circle, or a slower rise",
            )

    def rate(self, joint: JointEntry, link: str) -> float:
        """See `SingleLinkKind`: a follower goes to and fro."""
        return 1.0

    def start(
        self,
        first: JointEntry,
        joint: JointEntry,
        place: Callable[[str, str], Vec2],
        line: Callable[[JointEntry], Vec2],
    ) -> dict[str, float]:
        """See `SingleLinkKind`: the angle of the contact from the pin or the line of the follower, and on which side of
        its face the cam lies."""
        link, point = joint.on
        if first.kind == REVOLUTE:
            other = first.other_link(link)
            zero = place(other, first.at(other)) - place(*joint.by)
        else:
            zero = line(first)
        towards, side = place(link, point) - place(*joint.by), 1.0
        if face := joint.table["face"]:
            normal = (place(link, face) - place(link, point)).turned()
            side = math.copysign(1.0, normal.dot(towards))
            towards = normal * side
        return {link: math.atan2(zero.cross(towards), zero.dot(towards)), f"{link}.face": side}

    def group(self, parts: JointParts, link: str, first: JointEntry, joint: JointEntry) -> Group:
        """The follower on its pin or on its guide `first`, and on the cam by `joint`."""
        if joint.on[0] != link:
            raise InputError(
                f"{link} has the profile of {joint.name}, and its follower {joint.on[0]} moves before it: drive {link}, or "
                "a link before it",
                key=f"links.{link}",
            )
        geometry, (cam, centre), table = parts.geometry, joint.by, joint.table
        frame, start = parts.frames[cam], geometry.point(link, joint.on[1])
        profile = Rail(
            None if cam == GROUND else cam,
            frame.coordinates(geometry.point(cam, centre)),
            frame.components(Vec2(1.0, 0.0)),
        )
        normal = None
        if table["face"]:
            line = geometry.span(link, joint.on[1], table["face"])[0].axis
            normal = line.turned() * parts.sides[f"{link}.face"]
        rail, guide, arm = None, "", ZERO
        if first.kind == REVOLUTE:
            along = normal or geometry.span(link, first.at(link), joint.on[1])[0].axis
            bar = parts.hung(link, first, along)
            arm = parts.frames[link].coordinates(start)
        else:
            bar, rail, guide = parts.slider(link, first, joint.on[1])
        values = geometry.values
        names = expression(str(table["radius"])).names if isinstance(table["radius"], str) else ()
        curves = {name: values[f"spline {name}"] for name in names if f"spline {name}" in values}
        # a pin of its own: the guide of the follower may have its force at the same point
        pin = f"{joint.name}.{joint.on[1]}"
        bar = bar._replace(points={**bar.points, pin: (arm.x, arm.y)})
        parts.receive(joint, pin, link)
        return CamFollower(
            bar,
            pin,
            arm,
            profile,
            LawCourse(table["radius"], values, curves),
            None if normal else geometry.number(table["roller"]),
            not table["pitch"],
            normal and parts.frames[link].components(normal),
            rail,
            guide,
            joint.name,
            parts.pin(cam, centre),
            parts.sides[link],
            parts.structure.start,
        )

    def dead(self, group: AssurGroup, where: str) -> str:
        """See `SingleLinkKind`."""
        (link,), joint = group.links, group.joints[1]
        return (
            f"the force of {joint.name} on {link} has no lever, or no part along its way, at {where}, or {link} does not "
            "stay on the profile: the margin is the cosine of the pressure angle; take a larger base circle, a slower "
            "rise, or move the pin or the line of the follower, and give a start near the profile"
        )


_ANGLES = np.linspace(0.0, 2.0 * math.pi, _PLACES + 1)


def _jump(function: Callable[[Any], Any], values: Any, slopes: Any, size: float) -> float | None:
    """The angle at which a function over the angles of a turn jumps, from its values and slopes there; None if it does
    not."""
    step = _ANGLES[1] - _ANGLES[0]
    misses = np.abs(np.diff(values) - 0.5 * step * (slopes[1:] + slopes[:-1]))
    low = np.sort(np.argsort(misses)[-_SUSPECTS:])
    ends = np.array([_ANGLES[low], _ANGLES[low + 1]])
    at_ends = np.array([values[low], values[low + 1]])
    for _ in range(_HALVINGS):
        middle = ends.mean(axis=0)
        value = function(middle)
        first = np.abs(value - at_ends[0]) > np.abs(at_ends[1] - value)
        ends = np.where(first, [ends[0], middle], [middle, ends[1]])
        at_ends = np.where(first, [at_ends[0], value], [value, at_ends[1]])
    jumps = np.abs(at_ends[1] - at_ends[0]) > _JUMP * size
    return float(ends[0][int(np.argmax(jumps))]) if jumps.any() else None


def _degrees(angle: float) -> str:
    return f"{round(math.degrees(angle), 2):g} deg"
