"""Cams of linkage files: their keys, what is refused in a profile, and their groups."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ...core.engines import MATH, numpy_
from ...core.errors import InputError, shown
from ...core.planar import ZERO, Vec2
from ...groups.cam import CamFollower, ProfilePoint
from ...groups.group import Group
from ...groups.joints import Rail
from ...mechanism.assur import GROUND, PRISMATIC, REVOLUTE, AssurGroup
from ...mechanism.expressions import LawCourse, value_of
from .entries import EntryReader
from .joint_kind import CAM, JointEntry, JointParts, JointTable, SingleLinkKind

_ANGLES = np.linspace(0.0, 2.0 * math.pi, 28801)
"""Angles at which a profile is checked."""
_JUMP = 0.02
"""Least jump of a derivative of the radius, in parts of its largest value: between two angles a spline through many
points changes by less."""
_SLOWER = "a larger base circle, or a slower rise"


class CamKind(SingleLinkKind):
    """A cam: a profile about a point of the link `by`, on which a roller or a flat face of the link `on` lies."""

    name = noun = CAM
    keys = ("radius", "roller", "pitch", "face")
    use = "for a cam give it `radius`, that of the profile over phi"
    losses = ("cams", ("friction", "damping"))
    limits = "A follower stays on its cam, also if the force `normal` is below 0, at which it would lift off."
    equations = 1
    alone = "cam follower"
    seats = (REVOLUTE, PRISMATIC)

    def read(self, reader: EntryReader, key: str, table: Mapping[str, Any], joint: JointTable) -> None:
        """Add the radius of the profile, and the roller or the face of the follower."""
        on, point = joint["on"]
        others = [name for name in reader.points[on] if name != point]
        joint["radius"] = reader.law_entry(f"{key}.radius", table.get("radius"), "m", "rad")
        joint["roller"] = reader.positive(f"{key}.roller", table.get("roller", 0.0), "m")
        joint |= {"face": table.get("face", ""), "pitch": reader.flag(f"{key}.pitch", table)}
        if on == GROUND:
            reader.fault(
                f"{key}.on", f"is ground.{point}; must be a point of the follower, in `by` one of the cam"
            )
        if "face" in table and joint["face"] not in others:
            must = f"another point of {on} on its face: {', '.join(others) or 'add one'}"
            reader.fault(f"{key}.face", f"is {shown(joint['face'])}; must be {must}")
        for other in {"roller", "pitch"} & {*table} if "face" in table else ():
            reader.fault(
                f"{key}.{other}", "belongs to a roller, and the follower has a face; take one of both out"
            )

    @staticmethod
    def profile_faults(
        joint: Mapping[str, Any], values: Mapping[str, Any], tables: Mapping[str, Any]
    ) -> Iterator[tuple[str, str]]:
        """The fault by key of a radius that is not above 0, that jumps, or with which the profile is undercut, at the
        start `values` of the parameters; `tables` has those over phi as curves."""
        with np.errstate(all="ignore"):
            radius, rates = LawCourse(joint["radius"], values, tables)(numpy_(), _ANGLES)
            course = np.array([np.broadcast_to(x, _ANGLES.shape) for x in (radius, *rates)], float)
            wrong = ~(np.isfinite(course).all(axis=0) & (course[0] > 0.0))
            # by the mean slope of each interval; the last one is from 360 to 0 deg
            misses = np.diff(course[:3]) - 0.5 * _ANGLES[1] * (course[1:, 1:] + course[1:, :-1])
            misses = np.abs(np.column_stack([misses, course[:3, -1] - course[:3, 0]]))
            jumps = misses > _JUMP * np.abs(course[:3]).max(axis=1, keepdims=True) + 1e-9
            k = ProfilePoint.placed(numpy_(), course, _ANGLES).curvature
        entry, message = "radius", ""
        if wrong.any():
            place = int(np.argmax(wrong))
            message = f"is {course[0, place]:.4g} m at phi = {_degrees(place)}; must be > 0 all around"
        elif jumps.any():
            order, place = divmod(int(np.argmax(jumps)), len(_ANGLES))
            message = (
                f"its {('size', 'slope', 'second derivative')[order]} jumps at phi = {_degrees(place)}; a profile is "
                "smooth up to the second derivative: take a table [tables.NAME] over phi, which is splined, or rises "
                "such as step(phi - 60 * deg, 80 * deg)"
            )
        elif joint["face"] and not k.min() > 0.0:
            hollow = _degrees(int(np.argmin(k)))
            message = (
                f"is hollow or straight at phi = {hollow}, where a face bridges it; take a roller, {_SLOWER}"
            )
        elif not joint["face"]:
            roller, sharp = value_of(MATH, joint["roller"], values), k if joint["pitch"] else -k
            worst = int(np.argmax(sharp))
            if roller * sharp[worst] >= 1.0:
                entry, most = "roller", f"{1e3 / sharp[worst]:.4g} mm"
                what = "pitch curve bulges" if joint["pitch"] else "profile is hollow"
                message = (
                    f"is {1e3 * roller:.4g} mm, and the {what} with a radius of {most} at phi = {_degrees(worst)}: "
                    f"the cam is undercut; take a roller of less than {most}, {_SLOWER}"
                )
        if message:
            yield f"joints.{joint['name']}.{entry}", message

    def start(self, first: JointEntry, joint: JointEntry, geometry: Any) -> dict[str, float]:
        """The angle of the contact from the pin or the line of the follower, and on which side of its face the cam
        lies."""
        cam, place = joint.by[0], geometry.rough_place
        if cam in first.links:
            state = f"{cam} has the profile of {joint.name}, and its follower {joint.on[0]} moves before it"
            raise InputError(f"{state}: drive {cam}, or a link before it", key=f"links.{cam}")
        (link, point), centre, side, other = joint.on, place(*joint.by), 1.0, first.other_link(joint.on[0])
        towards, face, turns = place(link, point) - centre, joint.table["face"], first.kind == REVOLUTE
        arm = place(link, face or first.at(link)) - place(link, point)
        if (face or turns) and not arm.squared() > 0.0:
            state = f"{point} and {face or first.at(link)} of {link} are in one place; place them apart"
            raise InputError(state, key=f"joints.{joint.name}")
        if face:
            side = math.copysign(1.0, arm.turned().dot(towards))
            towards = arm.turned() * side
        zero = place(other, first.at(other)) - centre if turns else geometry.rough_line(first)
        return {link: math.atan2(zero.cross(towards), zero.dot(towards)), f"{link}.face": side}

    def group(self, parts: JointParts, link: str, first: JointEntry, joint: JointEntry) -> Group:
        """The follower on its pin or on its guide `first`, and on the cam by `joint`."""
        geometry, (cam, centre), point, table = parts.geometry, joint.by, joint.on[1], joint.table
        frame, face, rail, guide, arm = parts.frames[cam], None, None, "", ZERO
        roller, values = geometry.number(table["roller"]), geometry.values
        if table["face"]:
            face, roller = geometry.span(link, point, table["face"])[0].axis.turned(), None
            face = face * parts.sides[f"{link}.face"]
        if first.kind == REVOLUTE:
            bar = parts.hung(link, first, face or geometry.span(link, first.at(link), point)[0].axis)
            arm = parts.frames[link].coordinates(geometry.point(link, point))
        else:
            bar, rail, guide = parts.slider(link, first, point)
        zero = frame.coordinates(geometry.point(cam, centre)), frame.components(Vec2(1.0, 0.0))
        # a pin of its own: the guide of the follower may have its force at the same point
        pin = f"{joint.name}.{point}"
        parts.receive(joint, pin, link)
        return CamFollower(
            bar._replace(points={**bar.points, pin: (arm.x, arm.y)}), pin, arm,
            Rail(None if cam == GROUND else cam, *zero), parts.pin(cam, centre),
            LawCourse(table["radius"], values, values["splines"]), roller, not table["pitch"],
            face and parts.frames[link].components(face), rail, guide, parts.sides[link], parts.structure.start,
            parts.structure.span,
        )  # fmt: skip

    def dead(self, group: AssurGroup, where: str) -> str:
        """See `SingleLinkKind`."""
        (link,), joint = group.links, group.joints[1]
        return (
            f"the force of {joint.name} does not move {link} at {where}, as its pressure angle is 90 deg, or the cam "
            f"is undercut, or {link} is not on it; take {_SLOWER}, move the pin or the line of {link}, or start "
            "nearer to the profile"
        )


def _degrees(place: int) -> str:
    return f"{round(math.degrees(_ANGLES[place % (len(_ANGLES) - 1)]), 2):g} deg"
