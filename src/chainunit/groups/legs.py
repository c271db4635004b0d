"""The legs of a plate: a rod between two pins, a block on a rail, and a block in a slot of the plate.

Each leg takes one degree of freedom from the plate. At one pose of the plate, which has its origin at `origin` and
its x axis along `u`, a leg gives one row for Newton's method: the wrench (force, moment about the origin) that it can
exert on the plate. A rod pulls along its line, a block pushes across its line.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

from ..core.planar import ZERO, Link, Motion, Vec2
from .body import Bar
from .joints import Guide, GuideData, Hinge, HingeData, JointData, LinkageInMotion, Placed, Rail, Yielding

PLATE = 3
"""The number of the link at the end of the legs: after the three of a triad, or after two and another plate."""


class LegAt(NamedTuple):
    """A leg at one pose: its `row`, the `gap` by which it misses, in the unit of the row, a `spot` of the plate
    through which it goes, from the origin, the `length` of a rod, and of the leg as a link its `pose`, its outer
    joint and the one with the plate; the `stiffness` of one that yields [N/m]."""

    row: Sequence[Any]
    gap: Any
    spot: Vec2
    length: Any
    pose: tuple[Vec2 | Motion, Vec2]
    outer: Hinge | Guide
    inner: Hinge | Guide
    stiffness: Any = None

    @property
    def weight(self) -> Any:
        """Of the square of its gap in the strain energy."""
        return self.stiffness if self.length is None else self.stiffness / (self.length * self.length)

    @property
    def joints(self) -> tuple[Placed, Placed]:
        """Its outer joint and the one with the plate. A rod that yields does so in the pin with the plate, a block
        across its guide."""
        outer, inner, k, (_, d) = self.outer, self.inner, self.stiffness, self.pose
        if k is None:
            return outer, inner
        if self.length is not None:
            return outer, Yielding(inner, k, d, self.length)
        if isinstance(outer, Guide):
            return Yielding(outer, k, d.turned()), inner
        return outer, Yielding(inner, k, d.turned())

    def between(self, origin: Vec2, other: int, row: Sequence[Any]) -> LegAt:
        """The leg with this row from the link `other` of its group, at `origin`, in place of a link before that."""
        start, d = self.pose
        start = start.p if isinstance(start, Motion) else start
        return self._replace(row=row, pose=(start, d), outer=self.outer.held_by(other, start - origin))

    @property
    def shortness(self) -> float:
        """By how much it is too short, in numbers [m]."""
        l = self.length
        return -self.gap if l is None else math.sqrt(l * l - 2.0 * self.gap) - l

    def misfit(self, xp: Any) -> Any:
        """The gap in size, of a rod in parts of its length [1], of a block [m]."""
        l = self.length
        return xp.abs(self.gap if l is None else xp.sqrt(l * l - 2.0 * self.gap) / l - 1.0)


PlacedLeg = Callable[..., LegAt]
"""A leg with the linkage before it, for any origin and axis of the plate, and its number."""


@dataclass
class Leg:
    """A leg as data: its bar."""

    bar: Bar

    def joints(self, plate: str) -> tuple[JointData, JointData]:
        """Its outer joint, and the one with the plate of this name."""
        raise NotImplementedError

    def at_position(self, number: int, linkage: LinkageInMotion) -> PlacedLeg:
        """The leg of this number, with the linkage `linkage` before it."""
        raise NotImplementedError


@dataclass
class RodLeg(Leg):
    """A rod from a pin of known motion to a `pin` of the plate, at `arm` in its frame [m]. With r from its
    outer pin to its inner pin and A from the origin of the plate to the inner pin, its row is (r, A x r)."""

    pin: str
    arm: Vec2

    def joints(self, plate: str) -> tuple[JointData, JointData]:
        name = self.bar.name
        return HingeData(self.bar.pin, name), HingeData(self.pin, name, plate)

    def at_position(self, number: int, linkage: LinkageInMotion) -> PlacedLeg:
        return partial(_rod, number, linkage.pins[self.bar.pin], self.bar.length, self.arm)


@dataclass
class BlockLeg(Leg):
    """A block on a rail of known motion, with a `pin` of the plate, at `arm` in its frame [m]. Its own frame
    starts at this pin and has the direction of the rail; the rail goes through the pin. `guide` is the pin at which
    the force of the rail acts on the block. With n normal to the rail and A from the origin of the plate to
    the pin, its row is (n, A x n)."""

    pin: str
    arm: Vec2
    on: Rail
    guide: str

    def joints(self, plate: str) -> tuple[JointData, JointData]:
        return GuideData(self.guide, self.bar.name, self.on), HingeData(self.pin, self.bar.name, plate)

    def at_position(self, number: int, linkage: LinkageInMotion) -> PlacedLeg:
        return partial(_block, number, self.on.at_position(linkage.links), self.arm)


@dataclass
class SlotLeg(Leg):
    """A block on a pin of known motion, in a slot of the plate: the line through `at` [m] in the direction
    `along`, a unit vector, both in the frame of the plate. The frame of the block starts at its pin and has
    the direction of the slot; the slot goes through the pin. `guide` is the pin at which the force of the slot acts
    on the block. With n normal to the slot and y from the origin of the plate to the pin, its row is (n, y x
    n)."""

    at: Vec2
    along: Vec2
    guide: str

    def joints(self, plate: str) -> tuple[JointData, JointData]:
        return HingeData(self.bar.pin, self.bar.name), GuideData(self.guide, self.bar.name, plate)

    def at_position(self, number: int, linkage: LinkageInMotion) -> PlacedLeg:
        return partial(_slot, number, linkage.pins[self.bar.pin], self.at, self.along)


def rods_at(outer: Sequence[Motion], lengths: Sequence[Any], arms: Sequence[Vec2]) -> list[PlacedLeg]:
    """Rods from pins of this motion, with these lengths and arms [m]."""
    return [partial(_rod, k, *rod) for k, rod in enumerate(zip(outer, lengths, arms, strict=True))]


def _rod(
    number: int, outer: Motion, length: Any, arm: Vec2, origin: Vec2, u: Vec2, plate: int = PLATE
) -> LegAt:
    a = _turned(arm, u)
    r = origin + a - outer.p
    gap = 0.5 * (length * length - r.squared())
    joints = Hinge(number, base=outer), Hinge(number, r, plate, a)
    return LegAt((r.x, r.y, a.cross(r)), gap, a, length, (outer, r * (1.0 / length)), *joints)


def _block(number: int, rail: Link, arm: Vec2, origin: Vec2, u: Vec2, plate: int = PLATE) -> LegAt:
    a, d, n = _turned(arm, u), rail.u, rail.u.turned()
    way = origin + a - rail.pin.p
    joints = Guide(number, d, way.dot(d), way, rail), Hinge(number, ZERO, plate, a)
    return LegAt((n.x, n.y, a.cross(n)), -way.dot(n), a, None, (rail.pin.p + way, d), *joints)


def _slot(
    number: int, outer: Motion, point: Vec2, along: Vec2, origin: Vec2, u: Vec2, plate: int = PLATE
) -> LegAt:
    d, a, y = _turned(along, u), _turned(point, u), outer.p - origin
    n = d.turned()
    joints = Hinge(number, base=outer), Guide(number, d, (y - a).dot(d), y, plate)
    return LegAt((n.x, n.y, y.cross(n)), (y - a).dot(n), a, None, (outer, d), *joints)


def _turned(arm: Vec2, u: Vec2) -> Vec2:
    return Vec2(u.x * arm.x - u.y * arm.y, u.y * arm.x + u.x * arm.y)
