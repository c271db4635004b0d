"""The triad (class III Assur group, order 3): a ternary link on three legs.

A leg is a rod between two pins, a block on a rail, or a block in a slot of the ternary link
(`chainunit.groups.legs`). The pose of the ternary link is (x, y, theta): its origin and the direction of its own x
axis. Each leg gives a row, the wrench that it can exert on the ternary link; of a rod from P to a pin, with r = pin
- P and A from the origin to the pin, it is

    (r.x, r.y, A x r).

The determinant of the three rows vanishes if the lines of the legs meet in one point or are parallel: these are the
dead positions of a triad, and there are no others. If C, D and E lie on one line, the matrix is regular; the three
moment equations about C, D and E, which paper 003 solves, are singular there.

Up to six assembly modes are the real roots of a polynomial (`assembly_modes`); `chainunit.groups.followed` follows a
mode from one position to the next.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ..core.engines import MATH
from ..core.model import Requirement
from ..core.planar import Motion, Vec2
from .body import Bar, Mass
from .followed import MOST_MISFIT, USUAL, FollowedGroup, SolvedOnLegs, Tracking, corrected
from .joints import JointData, LinkageInMotion
from .legs import Leg, LegAt, PlacedLeg, RodLeg, rods_at


class Pose(NamedTuple):
    """The pose of the ternary link: its origin [m] and the angle of its x axis, counter-clockwise [rad]."""

    x: Any
    y: Any
    theta: Any


def legs_at(xp: Any, legs: Sequence[PlacedLeg], pose: Sequence[Any]) -> list[LegAt]:
    """The legs at a pose."""
    x, y, theta = pose
    origin, u = Vec2(x, y), Vec2(xp.cos(theta), xp.sin(theta))
    return [leg(origin, u) for leg in legs]


def correct_pose(xp: Any, legs: Sequence[PlacedLeg], near: Sequence[Any], steps: int) -> Pose:
    """The pose after `steps` of Newton's method from `near`, see `corrected`."""
    return Pose(*corrected(partial(legs_at, xp, legs), near, steps))


def solved_triad(xp: Any, placed: Sequence[PlacedLeg], pose: Sequence[Any]) -> SolvedOnLegs:
    """The triad on these legs at a pose of the ternary link; its `pins` are in the order of the legs."""
    legs, (x, y, theta) = legs_at(xp, placed, pose), pose
    ternary = Vec2(x, y), Vec2(xp.cos(theta), xp.sin(theta))
    return SolvedOnLegs(xp, legs, [[leg.spot for leg in legs]], [ternary])


@dataclass
class Triad(FollowedGroup):
    """A triad as data: the ternary link with its `mass`, three legs, and further points on the ternary link; its
    coordinates are the pose, see `FollowedGroup`."""

    kind: ClassVar[str] = "triad"

    name: str
    mass: Mass
    legs: tuple[Leg, Leg, Leg]
    points: Mapping[str, tuple[Any, Any]]
    assembly: Pose
    start: float = 0.0
    tracking: Tracking = USUAL
    span: Sequence[float] = ()

    @property
    def bars(self) -> tuple[Bar, ...]:
        """Its links, the ternary one last."""
        return *(leg.bar for leg in self.legs), Bar(self.name, "", None, self.mass, self.points)

    @property
    def joints(self) -> tuple[JointData, ...]:
        outer, inner = zip(*(leg.joints(self.name) for leg in self.legs), strict=True)
        return *outer, *inner

    def at_position(self, linkage: LinkageInMotion) -> tuple[PlacedLeg, ...]:
        """The legs, with the linkage `linkage` before them, for any pose of the ternary link."""
        return tuple(leg.at_position(k, linkage) for k, leg in enumerate(self.legs))

    legs_at, solved = staticmethod(legs_at), staticmethod(solved_triad)  # type: ignore[assignment]

    def modes(self, pins: Mapping[str, Motion]) -> list[Pose]:
        """All poses in which the triad, with rods for legs, can be assembled at the position of its outer `pins`."""
        rods = [leg for leg in self.legs if isinstance(leg, RodLeg)]
        return assembly_modes(
            tuple(pins[leg.bar.pin].p for leg in rods),
            tuple(leg.bar.length for leg in rods),
            tuple(leg.arm for leg in rods),
        )


def requirements(legs: tuple[str, ...], assembly: tuple[str, ...]) -> tuple[Requirement, Requirement]:
    """The requirements that a triad closes over the whole turn, clear of its dead positions; `legs` and `assembly`
    are the names of the parameters for the lengths of the legs and the pose of assembly."""
    return (
        Requirement(
            "largest misfit of a leg over the turn of the crank, in parts of its length",
            "1",
            "the triad does not close all the way round in the mode that `assembly` leads to, or moves too sharply "
            "to be followed",
            (*legs, *assembly),
        ),
        Requirement(
            "least margin of the triad over the turn of the crank",
            "1",
            "the triad comes to a dead position, where the lines of its legs meet in one point",
            legs,
        ),
    )


def limits(derived: Sequence[Any]) -> Iterator[tuple[Any, Any, Any]]:
    """Value, lower and upper limit of each of `requirements`, from `FollowedGroup.derive`."""
    *_, misfit, least = derived
    yield misfit, -math.inf, MOST_MISFIT
    yield least, 1e-3, math.inf


def assembly_modes(pins: tuple[Vec2, ...], lengths: tuple[float, ...], arms: tuple[Vec2, ...]) -> list[Pose]:
    """All poses in which the triad closes, by rising angle in (-pi, pi]; at most six.

    A triad with two pins of the ternary link in one place is a pair of dyads; this function does not search for their
    poses.

    With D the second pin, d = D - P2, u = (E - P3) - d and v = (C - P1) - d, the differences of the three equations
    of length are linear in d. Their solution, put into the second equation, leaves a trigonometric polynomial of
    third order in theta. Its coefficients come from seven samples, and its roots z = exp(i theta) are eigenvalues of
    a companion matrix. Newton's method on the three lengths polishes each real root.
    """
    legs = rods_at([Motion(p) for p in pins], lengths, arms)
    (p1, p2, p3), (l1, l2, l3) = pins, lengths
    c, e = arms[0] - arms[1], arms[2] - arms[1]

    def parts(theta: Any) -> tuple[Any, ...]:
        """The vectors u and v, and the right sides a, b of u . d = a and v . d = b, at the angle `theta`."""
        cos, sin = np.cos(theta), np.sin(theta)
        u = Vec2(cos * e.x - sin * e.y, sin * e.x + cos * e.y) - (p3 - p2)
        v = Vec2(cos * c.x - sin * c.y, sin * c.x + cos * c.y) - (p1 - p2)
        a = 0.5 * (l3 * l3 - l2 * l2 - u.squared())
        b = 0.5 * (l1 * l1 - l2 * l2 - v.squared())
        return u, v, a, b

    size = max(l1, l2, l3, math.sqrt(c.squared() + e.squared()))
    order, samples = 3, 7
    u, v, a, b = parts(2.0 * np.pi * np.arange(samples) / samples)
    det = u.cross(v)
    # |d det|^2 = |a v - b u|^2
    f = (v * a - u * b).squared() - l2 * l2 * det * det
    spectrum = np.fft.fft(f / size**6) / samples
    coefficients = [spectrum[k % samples] for k in range(-order, order + 1)]
    modes: list[Pose] = []
    for z in np.roots(coefficients[::-1]):
        if not abs(abs(z) - 1.0) < 1e-4:
            continue
        theta = float(np.angle(z))
        u, v, a, b = parts(theta)
        # D lies on the circle about P2 and on the lines d . u = a and d . v = b; these two are one line where u and v
        # are parallel, as with parallel hangers, so that both ends of the chord are tried
        across, offset = (u, a) if u.squared() > v.squared() else (v, b)
        if not across.squared() > 0.0:
            continue
        base = across * (offset / across.squared())
        chord = across.turned() * math.sqrt(max(l2 * l2 - base.squared(), 0.0) / across.squared())
        cos, sin = math.cos(theta), math.sin(theta)
        arm = Vec2(cos * arms[1].x - sin * arms[1].y, sin * arms[1].x + cos * arms[1].y)
        for d in (base + chord, base - chord):
            start = p2 + d - arm
            try:
                near = Pose(float(start.x), float(start.y), theta)
                pose = correct_pose(MATH, legs, near, 20)
                closed = legs_at(MATH, legs, pose)
            except (ArithmeticError, ValueError):
                continue
            angle = math.remainder(pose.theta, 2.0 * math.pi)
            closes = all(abs(leg.gap) < 5e-10 * size * size for leg in closed)
            if closes and not any(
                abs(math.remainder(angle - other.theta, 2.0 * math.pi)) < 1e-7
                and math.hypot(pose.x - other.x, pose.y - other.y) < 1e-7 * size
                for other in modes
            ):
                modes.append(Pose(pose.x, pose.y, angle))
    return sorted(modes, key=lambda pose: (pose.theta, pose.x, pose.y))
