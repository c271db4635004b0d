"""Belts and chains: two pulleys that are pinned to one link, the arm, turn together without slip.

Relative to the arm the pulleys turn the same way by the ratio of their pitch diameters; by a crossed belt they turn
against each other. The belt is tensioned: its strands have the tension T + F/2 and T - F/2 along the two common
tangents of the pitch circles. The pull F gives the pulleys their torques. It also pushes their centres to the sides,
as strands of unequal pulleys are not parallel. The tension T presses the centres together and is in no reaction.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from ...core.errors import InputError
from ...core.planar import Vec2
from ...groups.body import Load
from ...groups.group import Outline
from ...groups.joints import LinkageInMotion, Rail, Third
from .entries import EntryReader, is_given
from .gear import GearedLink, GearKind, Mesh, MeshData
from .joint_kind import BELT, JointEntry, JointParts, JointTable

_EVEN = 1e-9
"""Share of a ratio of diameters within which it is the fraction of two small whole numbers."""
_SMALL = 1000


@dataclass
class Belt:
    """A belt as data, seen from one pulley: the pitch radii of this pulley and of the `other` one, which is below 0
    of a crossed belt, and the `distance` of their centres [m]. The pull has the `sense` 1 or -1 in the line to the
    other centre."""

    radius: float
    other: float
    distance: Any
    sense: float

    def along(self, arm: Vec2) -> Vec2:
        """The direction of the pull, from the vector `arm` to the other centre."""
        return arm * (self.sense * (1.0 / self.distance))

    def side(self, arm: Vec2) -> Vec2:
        """The force on the centre of the pulley for a pull of 1, from the vector `arm` to the other centre."""
        return arm.turned() * ((self.radius - self.other) * (1.0 / (self.distance * self.distance)))

    def loop(self) -> Vec2:
        """The points of its closed line [m] from the centre of the pulley, in the direction to the other centre."""
        distance = float(self.distance)
        half = math.acos(max(-1.0, min(1.0, (self.radius - self.other) / distance)))
        near = np.linspace(half, 2.0 * math.pi - half, 41)
        # of a crossed belt the other way round
        far = np.linspace(-half, half if self.other > 0.0 else half - 2.0 * math.pi, 41)
        x = np.concatenate([self.radius * np.cos(near), distance + self.other * np.cos(far)])
        return Vec2(x, np.concatenate([self.radius * np.sin(near), self.other * np.sin(far)]))


@dataclass(frozen=True)
class BeltData(MeshData):
    """A belt on a pulley as data; `pin` is the centre of the other pulley. Its reaction is the pull, along the line
    to this centre."""

    belt: Belt

    def pull(self, m: LinkageInMotion, reaction: Vec2) -> tuple[Any, Vec2]:
        """The pull of its reaction, and the force on the centre of the pulley."""
        arm = m.pins[self.pin].p - m.pins[self.centre].p
        pull = self.belt.along(arm).dot(reaction)
        return pull, self.belt.side(arm) * pull

    def at_centre(self, m: LinkageInMotion, reaction: Vec2) -> Vec2:
        """See `MeshData`."""
        return self.pull(m, reaction)[1]

    def opposite(self, m: LinkageInMotion, carrier: str, reaction: Vec2) -> Load:
        """What the belt does to the other pulley."""
        pull, force = self.pull(m, reaction)
        arm = m.pins[self.pin].p - m.links[carrier].pin.p
        return -force, -arm.cross(force) - self.belt.other * pull


@dataclass
class BeltedLink(GearedLink):
    """A pulley on a pin that moves in a known way, with a `belt` to another pulley, see `GearedLink`. The belt has a
    `name`; the line of the centres is that of `rail`."""

    name: str
    belt: Belt
    rail: Rail

    @property
    def circles(self) -> tuple[tuple[str, str], ...]:
        """None: the belt is an outline."""
        return ()

    @property
    def outlines(self) -> Mapping[str, Outline]:
        """The belt."""
        return {self.name: Outline(self.bar.pin, self.rail, self.belt.loop)}

    @property
    def mesh_data(self) -> MeshData:
        """The belt as data."""
        bar = self.bar
        return BeltData(self.mesh, bar.name, bar.pin, self.by, self.rolling, self.belt)

    def mesh_at(self, arm: Vec2, rates: Sequence[Third]) -> Mesh:
        """The belt at one position: the pulley turns about its centre, which the pull pushes to the side."""
        return Mesh(self.belt.side(arm), self.belt.radius, rates, self.belt.along(arm))


class BeltKind(GearKind):
    """A belt or a chain: the links `on` and `by` are pulleys about their points, which are pinned to one link."""

    name = noun = BELT
    keys = ("diameters", "crossed")
    use = "for a belt give it `diameters`, the pitch diameters of both pulleys"
    limits = "The reaction of a belt is its pull; its tension, which presses the pulleys together, is in no reaction."
    alone = "belted link"

    def read(self, reader: EntryReader, key: str, table: Mapping[str, Any], joint: JointTable) -> None:
        """Add the pitch diameters of both pulleys [m], and whether the belt is crossed."""
        diameters: Any = table.get("diameters")
        numbers = list[float]()
        with reader.at(f"{key}.diameters"):
            if isinstance(diameters, list) and len(diameters) == 2:
                numbers = [reader.number(f"{key}.diameters", x, "m") for x in diameters]
            if not numbers or min(numbers) <= 0.0:
                raise InputError(
                    f"{is_given(diameters)}; must be two lengths > 0, the pitch diameters of {joint['on'][0]} and of "
                    f'{joint["by"][0]}, such as ["80 mm", "160 mm"]'
                )
        joint |= {"diameters": numbers, "crossed": reader.flag(f"{key}.crossed", table)}

    def complete(self, reader: EntryReader, joint: JointTable, joints: Sequence[JointTable]) -> None:
        """Add the arm with its points at the centres."""
        self.held(reader, joint, joints)

    def start_faults(
        self, joint: Mapping[str, Any], points: Mapping[str, Mapping[str, tuple[float, float]]]
    ) -> Iterator[tuple[str, str]]:
        """The fault of pulleys that overlap."""
        arm, (a, b) = joint["third"], joint["held"]
        distance, least = math.dist(points[arm][a], points[arm][b]), 0.5 * sum(joint["diameters"])
        if distance <= least:
            yield (
                f"joints.{joint['name']}.diameters",
                f"the pulleys overlap: their centres {a} and {b} are {1e3 * distance:.4g} mm apart, and must be "
                f"farther than {1e3 * least:.4g} mm; take smaller pulleys, or place them apart",
            )

    def ratio(self, joint: JointEntry, link: str) -> Fraction:
        """How often a pulley turns per turn of the other one, seen from the arm."""
        on, by = joint.table["diameters"]
        ratio = by / on if link == joint.on[0] else on / by
        whole = Fraction(ratio).limit_denominator(_SMALL)
        exact = whole if abs(whole - ratio) <= _EVEN * ratio else Fraction(ratio)
        return -exact if joint.table["crossed"] else exact

    def mesh_pin(self, parts: JointParts, joint: JointEntry, centre: str) -> str:
        """The centre of the other pulley."""
        return centre

    def wheel(self, parts: JointParts, joint: JointEntry, wheel: GearedLink) -> GearedLink:
        """The pulley with its belt."""
        held, diameters, sense = joint.table["held"], joint.table["diameters"], 1.0
        if wheel.bar.name != joint.on[0]:
            held, diameters, sense = held[::-1], diameters[::-1], 1.0 if joint.table["crossed"] else -1.0
        line, distance = parts.geometry.span(joint.third, *held)
        radius, other = (0.5 * diameter for diameter in diameters)
        belt = Belt(radius, -other if joint.table["crossed"] else other, distance, sense)
        frame = parts.frames[joint.third]
        rail = Rail(wheel.rolling.arm, frame.coordinates(line.origin), frame.components(line.axis))
        return BeltedLink(**vars(wheel), name=joint.name, belt=belt, rail=rail)
