"""The triad (class III Assur group, order 3): a ternary link on three legs.

A leg is a rod between two pins, a block on a rail, or a block in a slot of the ternary link
(`chainunit.groups.legs`). The pose of the ternary link is (x, y, theta): its origin and the direction of its own x
axis. Each leg gives a row, the wrench that it can exert on the ternary link; of a rod from P to a pin, with r = pin
- P and A from the origin to the pin, it is

    (r.x, r.y, A x r).

Newton's correction of the pose solves these three rows, and they are what is left of the matrix of the group after
the legs are eliminated. Their determinant vanishes if the lines of the legs meet in one point or are parallel: these
are the dead positions of a triad, and there are no others. If C, D and E lie on one line, the matrix is regular; the
three moment equations about C, D and E, which paper 003 solves, are singular there.

There is no closed form for the pose. Up to six assembly modes are the real roots of a polynomial (`assembly_modes`),
and `correct_pose` follows a mode from one position to the next.

In a linkage with one crank the pose is a smooth periodic function of the crank angle. `Triad.derive` follows it once
around, from the mode to which `Triad.assembly` leads at q = 0, and keeps it as a Fourier series. At any angle the
series gives a pose that is nearly right, and Newton's method makes it exact. So the pose depends on the crank angle
alone, independent of the step and the history. The branch cannot jump; `requirements` refuses parameters with which
the branch ends within the turn.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ..core.engines import MATH
from ..core.model import Requirement
from ..core.planar import Motion, Vec2
from .block import minus_cofactors
from .body import Bar, Mass
from .group import Group, SolvedGroup
from .joints import JointData, LinkageInMotion
from .legs import LEGS, Leg, LegAt, PlacedLeg, RodLeg, rods_at
from .series import series_of, values_of

SAMPLES = 20
"""Number of crank angles at which a triad is followed once around."""
HARMONICS = 8
"""Number of harmonics in the series of the pose."""
MOST_MISFIT = 1e-10
"""Largest misfit of a leg that counts as closed, in parts of its length."""
_STEPS = 3
"""Steps of Newton's method from the series: three remove an error of 1e-3, as of a pose that moves sharply."""


class Pose(NamedTuple):
    """The pose of the ternary link: its origin [m] and the angle of its x axis, counter-clockwise [rad]."""

    x: Any
    y: Any
    theta: Any


def legs_at(xp: Any, legs: Sequence[PlacedLeg], pose: Pose) -> list[LegAt]:
    """The legs at a pose."""
    origin, u = Vec2(pose.x, pose.y), Vec2(xp.cos(pose.theta), xp.sin(pose.theta))
    return [leg(origin, u) for leg in legs]


def correct_pose(xp: Any, legs: Sequence[PlacedLeg], near: Pose, steps: int) -> Pose:
    """The pose after `steps` of Newton's method from `near`. From a pose that is nearly right each step doubles the
    number of right digits. It also doubles the order up to which the derivatives of the pose are right."""
    pose = near
    for _ in range(steps):
        placed = legs_at(xp, legs, pose)
        minus, det = minus_cofactors([leg.row for leg in placed])
        minus_per = -1.0 / det
        moved = (
            sum(leg.gap * row[k] for leg, row in zip(placed, minus, strict=True)) for k in range(len(pose))
        )
        pose = Pose(*(x + dx * minus_per for x, dx in zip(pose, moved, strict=True)))
    return pose


@dataclass
class Triad(Group):
    """A triad as data: the ternary link with its `mass`, three legs, further points on the ternary link, and the pose
    `assembly`, from which Newton's method leads to the assembly mode at the crank angle `start` [rad]. `turns` is how
    often the ternary link turns counter-clockwise in a turn of the crank: the rest of its angle is periodic."""

    name: str
    mass: Mass
    legs: tuple[Leg, Leg, Leg]
    points: Mapping[str, tuple[Any, Any]]
    assembly: Pose
    start: float = 0.0
    turns: float = 0.0

    derived_count: ClassVar[int] = 3 * (2 * HARMONICS + 1) + 2
    """The number of values that `derive` gives: the series of the pose, the largest misfit, the least margin."""

    @property
    def bars(self) -> tuple[Bar, ...]:
        """Its links, the ternary one last."""
        return *(leg.bar for leg in self.legs), Bar(self.name, "", None, self.mass, self.points)

    @property
    def joints(self) -> tuple[JointData, ...]:
        outer, inner = zip(*(leg.joints(self.name) for leg in self.legs), strict=True)
        return *outer, *inner

    def solve(self, xp: Any, q: Any, linkage: LinkageInMotion, derived: Sequence[Any]) -> SolvedTriad:
        """The triad with the linkage `linkage` before it, on the branch that the series `derived` gives."""
        legs = self.at_position(linkage)
        near = pose_of_series(derived, xp.cos(q), xp.sin(q))
        if self.turns:
            near = near._replace(theta=near.theta + self.turns * q)
        return SolvedTriad(xp, legs, correct_pose(xp, legs, near, _STEPS))

    def at_position(self, linkage: LinkageInMotion) -> tuple[PlacedLeg, ...]:
        """The legs, with the linkage `linkage` before them, for any pose of the ternary link."""
        return tuple(leg.at_position(k, linkage) for k, leg in enumerate(self.legs))

    def modes(self, pins: Mapping[str, Motion]) -> list[Pose]:
        """All poses in which the triad, with rods for legs, can be assembled at the position of its outer `pins`."""
        rods = [leg for leg in self.legs if isinstance(leg, RodLeg)]
        return assembly_modes(
            tuple(pins[leg.bar.pin].p for leg in rods),
            tuple(leg.bar.length for leg in rods),
            tuple(leg.arm for leg in rods),
        )

    def _followed(
        self, xp: Any, before: Callable[[float], LinkageInMotion], angles: Sequence[float]
    ) -> list[Pose]:
        """The poses at these crank angles, each from the ones before it."""

        def pose(q: float, near: Pose, steps: int = _STEPS) -> Pose:
            return correct_pose(xp, self.at_position(before(q)), near, steps)

        poses = [pose(angles[0], self.assembly, 8)]
        for q in angles[1:]:
            near = poses[-1]
            if len(poses) > 1:
                near = Pose(*(2.0 * now - before for now, before in zip(near, poses[-2], strict=True)))
            poses.append(pose(q, near))
        return poses

    def turns_in_a_turn(self, xp: Any, before: Callable[[float], LinkageInMotion]) -> float:
        """How often the ternary link turns in a turn of the crank, see `turns`."""
        angles = [self.start + 2.0 * math.pi * k / SAMPLES for k in range(SAMPLES + 1)]
        first, *_, last = self._followed(xp, before, angles)
        return float(round((last.theta - first.theta) / (2.0 * math.pi)))

    def derive(self, xp: Any, before: Callable[[float], LinkageInMotion]) -> list[Any]:
        """The series of the pose over the crank angle, the largest misfit and the least margin around; `before` gives
        the linkage before the triad at a crank angle [rad]."""
        angles = [self.start + 2.0 * math.pi * k / SAMPLES for k in range(SAMPLES)]
        poses = self._followed(xp, before, angles)
        if self.turns:
            poses = [
                pose._replace(theta=pose.theta - self.turns * q)
                for pose, q in zip(poses, angles, strict=True)
            ]
        series = [x for values in zip(*poses, strict=True) for x in series_of(values, angles, HARMONICS)]
        # the misfit as in a run, at angles halfway between the samples
        misfit, first, least = 0.0, None, None
        for q in angles:
            middle = q + math.pi / SAMPLES
            triad = self.solve(xp, middle, before(middle), series)
            for leg in triad.legs:
                misfit = xp.maximum(misfit, xp.minimum(leg.misfit(xp), 1.0))
            # relative to the sign of the first margin: a margin that changes sign has passed a dead position
            first = triad.margin if first is None else first
            margin = triad.margin * first / xp.abs(first)
            least = margin if least is None else xp.minimum(least, margin)
        return [*series, misfit, least]


def pose_of_series(series: Sequence[Any], cos: Any, sin: Any) -> Pose:
    """The pose that the series gives, from cosine and sine of the crank angle."""
    size = 2 * HARMONICS + 1
    return Pose(*values_of([series[k * size : (k + 1) * size] for k in range(3)], cos, sin))


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
    """Value, lower and upper limit of each of `requirements`, from `Triad.derive`."""
    *_, misfit, least = derived
    yield misfit, -math.inf, MOST_MISFIT
    yield least, 1e-3, math.inf


class SolvedTriad(SolvedGroup):
    """A solved triad with its `legs`. Its `links` are the legs and then the ternary link (origin and x axis of its
    frame); its `pins` are in the order of the legs; its `margin` is the determinant over the lengths of the rods and
    the size of the ternary link: 0 is a dead position."""

    __slots__ = ("legs",)

    def __init__(self, xp: Any, placed: Sequence[PlacedLeg], pose: Pose) -> None:
        """
        Parameters
        ----------
        xp : engine (see `chainunit.core.engines`)
        placed : the three legs, see `Leg.at_position`
        pose : pose of the ternary link, see `correct_pose`
        """
        legs = self.legs = legs_at(xp, placed, pose)
        size = xp.sqrt(sum((legs[k].spot - legs[k - 1].spot).squared() for k in range(LEGS)))
        for leg in legs:
            size = size if leg.length is None else size * leg.length
        ternary = Vec2(pose.x, pose.y), Vec2(xp.cos(pose.theta), xp.sin(pose.theta))
        joints = *(leg.outer for leg in legs), *(leg.inner for leg in legs)
        super().__init__((*(leg.pose for leg in legs), ternary), joints, size=size)


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
