"""The triad (class III Assur group, order 3): a ternary link C-D-E on three binary links, the legs.

The motion of the outer pins P is known; each leg keeps the distance `l` between its P and its pin on the ternary
link. The pose of the ternary link is (x, y, theta): its origin and the direction of its own x axis. A pin at `arm` in
the frame of the ternary link stands at (x, y) + R(theta) arm. With r = pin - P and A = R(theta) arm, each leg gives a
row

    (r.x, r.y, A x r).

The matrix of these three rows is that of every linear system here: Newton's correction, the first and second
derivative of the pose, the pull of the legs. Its determinant vanishes where the lines of the legs meet in one point
or are parallel: these are the dead positions of a triad, and there are no others. Where C, D and E lie on one line,
this matrix is regular; the three moment equations about C, D and E, which paper 003 solves, are singular there.

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

from ..model import Requirement
from ..planar import Link, Motion, Vec2
from .body import Bar, Load, Mass
from .group import Group, Placed, SolvedGroup, Third

LEGS = 3
SAMPLES = 20
"""Number of crank angles at which a triad is followed once around."""
HARMONICS = 8
"""Number of harmonics in the series of the pose."""
_STEPS = 3
"""Steps of Newton's method from the series: three remove an error of 1e-3, as of a pose that moves sharply."""


class Pose(NamedTuple):
    """The pose of the ternary link: its origin [m] and the angle of its x axis, counter-clockwise [rad]."""

    x: Any
    y: Any
    theta: Any


class _Rows:
    """The three rows (r.x, r.y, A x r) at a pose, and the solution of linear systems with them."""

    __slots__ = ("arms", "cofactors", "det", "minus_per_det", "r")

    def __init__(self, arms: tuple[Vec2, ...], r: tuple[Vec2, ...]) -> None:
        self.arms, self.r = arms, r
        rows = [(v.x, v.y, a.cross(v)) for v, a in zip(r, arms, strict=True)]
        self.cofactors = tuple(_cross(rows[(i + 1) % LEGS], rows[(i + 2) % LEGS]) for i in range(LEGS))
        self.det = _dot(rows[0], self.cofactors[0])
        # see `chainunit.groups.dyad` for the sign
        self.minus_per_det = -1.0 / self.det

    @classmethod
    def at(cls, xp: Any, pins: Sequence[Vec2], arms: Sequence[Vec2], pose: Pose) -> _Rows:
        """The rows at a pose; `arms` are given in the frame of the ternary link [m]."""
        c, s = xp.cos(pose.theta), xp.sin(pose.theta)
        origin = Vec2(pose.x, pose.y)
        arms_now = tuple(Vec2(c * a.x - s * a.y, s * a.x + c * a.y) for a in arms)
        return cls(arms_now, tuple(origin + a - p for a, p in zip(arms_now, pins, strict=True)))

    def solve(self, b: tuple[Any, ...]) -> tuple[Any, Any, Any]:
        """z with row_i . z = b_i."""
        (b0, b1, b2), (c0, c1, c2) = b, self.cofactors
        k = self.minus_per_det
        return (
            -(b0 * c0[0] + b1 * c1[0] + b2 * c2[0]) * k,
            -(b0 * c0[1] + b1 * c1[1] + b2 * c2[1]) * k,
            -(b0 * c0[2] + b1 * c1[2] + b2 * c2[2]) * k,
        )

    def combine(self, force: Vec2, moment: Any) -> tuple[Any, ...]:
        """lambda with sum of lambda_i row_i = (force, moment)."""
        return tuple(-_dot((force.x, force.y, moment), c) * self.minus_per_det for c in self.cofactors)


def _cross(a: tuple[Any, Any, Any], b: tuple[Any, Any, Any]) -> tuple[Any, Any, Any]:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _dot(a: tuple[Any, Any, Any], b: tuple[Any, Any, Any]) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def correct_pose(
    xp: Any, pins: Sequence[Vec2], lengths: Sequence[Any], arms: Sequence[Vec2], near: Pose, steps: int
) -> Pose:
    """The pose after `steps` of Newton's method from `near`. From a pose that is nearly right each step doubles the
    number of right digits. It also doubles the order up to which the derivatives of the pose are right."""
    pose = near
    for _ in range(steps):
        rows = _Rows.at(xp, pins, arms, pose)
        wrong = tuple(0.5 * (l * l - r.squared()) for l, r in zip(lengths, rows.r, strict=True))
        dx, dy, turn = rows.solve(wrong)
        pose = Pose(pose.x + dx, pose.y + dy, pose.theta + turn)
    return pose


@dataclass
class Triad(Group):
    """A triad as data: the ternary link with its `mass`, three legs, which start from pins of known motion, the pins
    of the ternary link in its own frame (`arms` [m], in the order of the legs), further points on it, and the pose
    `assembly`, from which Newton's method leads to the assembly mode at crank angle 0."""

    name: str
    mass: Mass
    legs: tuple[Bar, Bar, Bar]
    arms: Mapping[str, Vec2]
    points: Mapping[str, tuple[Any, Any]]
    assembly: Pose

    derived: ClassVar[int] = 3 * (2 * HARMONICS + 1) + 2
    """The number of values that `derive` gives: the series of the pose, the largest misfit, the least margin."""

    @property
    def bars(self) -> tuple[Bar, ...]:
        """Its links, the ternary one last."""
        return *self.legs, Bar(self.name, "", None, self.mass, self.points)

    @property
    def pins(self) -> dict[str, str]:
        """The pins that the triad adds, each with the link that carries it."""
        return dict.fromkeys(self.arms, self.name)

    @property
    def joints(self) -> tuple[tuple[str, str], ...]:
        """Pin and link of each reaction, in the order of `SolvedTriad.reactions`."""
        outer = ((leg.pin, leg.name) for leg in self.legs)
        return *outer, *((pin, leg.name) for pin, leg in zip(self.arms, self.legs, strict=True))

    def _lengths(self) -> tuple[Any, ...]:
        return tuple(leg.length for leg in self.legs)

    def outer(self, pins: Mapping[str, Motion]) -> tuple[Motion, ...]:
        """Motion of the outer pins of the legs."""
        return tuple(pins[leg.pin] for leg in self.legs)

    def solve(self, xp: Any, q: Any, at: Placed, derived: Sequence[Any]) -> SolvedTriad:
        """The triad where its outer pins are, on the branch that the series `derived` gives."""
        outer, arms = self.outer(at.pins), tuple(self.arms.values())
        near = pose_of_series(derived, xp.cos(q), xp.sin(q))
        pose = correct_pose(xp, [pin.p for pin in outer], self._lengths(), arms, near, _STEPS)
        return SolvedTriad.at(xp, outer, self._lengths(), arms, pose)

    def modes(self, pins: Mapping[str, Motion]) -> list[Pose]:
        """All poses in which the triad can be assembled at the position of its outer `pins`."""
        return assembly_modes(
            tuple(pin.p for pin in self.outer(pins)), self._lengths(), tuple(self.arms.values())
        )

    def derive(self, xp: Any, before: Callable[[float], Placed]) -> list[Any]:
        """The series of the pose over the crank angle, the largest misfit and the least margin around; `before` gives
        the linkage before the triad at a crank angle [rad]."""
        angles = [2.0 * math.pi * k / SAMPLES for k in range(SAMPLES)]
        lengths, arms = self._lengths(), tuple(self.arms.values())

        def pose(q: float, near: Pose, steps: int = _STEPS) -> Pose:
            return correct_pose(xp, [pin.p for pin in self.outer(before(q).pins)], lengths, arms, near, steps)

        poses = [pose(0.0, self.assembly, 8)]
        for q in angles[1:]:
            near = poses[-1]
            if len(poses) > 1:
                near = Pose(*(2.0 * now - before for now, before in zip(near, poses[-2], strict=True)))
            poses.append(pose(q, near))
        series = []
        for values in zip(*poses, strict=True):
            series.append(sum(values) / SAMPLES)
            for n in range(1, HARMONICS + 1):
                for wave in (math.cos, math.sin):
                    series.append(
                        sum(v * (2.0 / SAMPLES * wave(n * q)) for v, q in zip(values, angles, strict=True))
                    )
        # the misfit as in a run, at angles halfway between the samples
        misfit, first, least = 0.0, None, None
        for q in angles:
            middle = q + math.pi / SAMPLES
            at = before(middle)
            triad = self.solve(xp, middle, at, series)
            for pin, o, l in zip(triad.pins, self.outer(at.pins), lengths, strict=True):
                off = xp.abs(xp.sqrt((pin.p - o.p).squared()) / l - 1.0)
                misfit = xp.maximum(misfit, xp.minimum(off, 1.0))
            # relative to the sign of the first margin: a margin that changes sign has passed a dead position
            first = triad.margin if first is None else first
            margin = triad.margin * first / xp.abs(first)
            least = margin if least is None else xp.minimum(least, margin)
        return [*series, misfit, least]


def pose_of_series(series: Sequence[Any], cos: Any, sin: Any) -> Pose:
    """The pose that the series gives, from cosine and sine of the crank angle."""
    size = 2 * HARMONICS + 1
    sums = [series[k * size] for k in range(3)]
    c, s = cos, sin
    for n in range(1, HARMONICS + 1):
        for k in range(3):
            sums[k] = sums[k] + series[k * size + 2 * n - 1] * c + series[k * size + 2 * n] * s
        c, s = c * cos - s * sin, s * cos + c * sin
    return Pose(*sums)


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
    yield misfit, -math.inf, 1e-10
    yield least, 1e-3, math.inf


class SolvedTriad(SolvedGroup):
    """A solved triad. Its `links` are the legs from their outer pins and then the ternary link (origin and x axis of
    its frame); its `pins` are in the order of the legs; its `margin` is the determinant over the lengths of the legs
    and the size of the ternary link: 0 is a dead position."""

    __slots__ = ("_per_square", "_rows")

    def __init__(
        self,
        rows: _Rows,
        per_square: tuple[Any, ...],
        links: tuple[Link, ...],
        pins: tuple[Motion, ...],
        margin: Any = 1.0,
    ) -> None:
        super().__init__(links, pins, margin)
        self._rows, self._per_square = rows, per_square

    @classmethod
    def at(
        cls, xp: Any, outer: Sequence[Motion], lengths: Sequence[Any], arms: Sequence[Vec2], pose: Pose
    ) -> SolvedTriad:
        """
        Parameters
        ----------
        xp : engine (see `chainunit.engines`)
        outer : motion of the outer pins of the three legs
        lengths : of the legs [m]
        arms : pins on the ternary link, in its own frame [m]
        pose : pose of the ternary link, see `correct_pose`
        """
        rows = _Rows.at(xp, [p.p for p in outer], arms, pose)
        x1, y1, t1 = rows.solve(tuple(r.dot(p.p1) for r, p in zip(rows.r, outer, strict=True)))
        origin1 = Vec2(x1, y1)
        pins1 = tuple(origin1 + a.turned() * t1 for a in rows.arms)
        second = []
        for r, a, k1, p in zip(rows.r, rows.arms, pins1, outer, strict=True):
            second.append(r.dot(p.p2 + a * (t1 * t1)) - (k1 - p.p1).squared())
        x2, y2, t2 = rows.solve(tuple(second))
        origin2 = Vec2(x2, y2)
        pins2 = tuple(origin2 + a.turned() * t2 - a * (t1 * t1) for a in rows.arms)
        origin = Motion(Vec2(pose.x, pose.y), origin1, origin2)
        ternary = Link(origin, Vec2(xp.cos(pose.theta), xp.sin(pose.theta)), t1, t2)
        pins = tuple(
            Motion(p.p + r, k1, k2) for p, r, k1, k2 in zip(outer, rows.r, pins1, pins2, strict=True)
        )
        per_square = tuple(1.0 / (l * l) for l in lengths)
        legs = tuple(
            Link(p, r * (1.0 / l), r.cross(k.p1 - p.p1) * per, r.cross(k.p2 - p.p2) * per)
            for p, r, l, k, per in zip(outer, rows.r, lengths, pins, per_square, strict=True)
        )
        size = xp.sqrt(sum((arms[i] - arms[i - 1]).squared() for i in range(LEGS)))
        margin = rows.det / (lengths[0] * lengths[1] * lengths[2] * size)
        return cls(rows, per_square, (*legs, ternary), pins, margin)

    def third(
        self, outer: Sequence[Vec2], rails: Sequence[Third] = ()
    ) -> tuple[Sequence[Third], Sequence[Vec2]]:
        """See `SolvedGroup`."""
        (*legs, ternary), rows = self.links, self._rows
        t1, t2 = ternary.t1, ternary.t2
        spin, mixed_term = t1 * t1 * t1, 3.0 * (t1 * t2)
        b = []
        for r, a, k, leg, p in zip(rows.r, rows.arms, self.pins, legs, outer, strict=True):
            centripetal = 3.0 * (k.p1 - leg.pin.p1).dot(k.p2 - leg.pin.p2)
            b.append(r.dot(p + a.turned() * spin + a * mixed_term) - centripetal)
        x, y, t3 = rows.solve(tuple(b))
        origin = Vec2(x, y)
        pins = [ternary.third(a, origin, t3) for a in rows.arms]
        thirds: list[Third] = []
        for r, k3, leg, p, per in zip(rows.r, pins, legs, outer, self._per_square, strict=True):
            thirds.append((p, r.cross(k3 - p) * per + leg.t1 * leg.t1 * leg.t1))
        return [*thirds, (origin, t3)], pins

    def reactions(self, loads: Sequence[Load]) -> tuple[Vec2, ...]:
        """Forces on the legs at their outer pins, then at the ternary link [N].

        The loads are force and moment: of each leg about its outer pin, of the ternary link about its origin. The
        moment about the outer pin of a leg gives the part of the force across this leg; the pulls along the legs
        follow from the balance of two forces and one moment on the ternary link.
        """
        *legs, (force, moment) = loads
        across = []
        for (_, m), r, a, per in zip(legs, self._rows.r, self._rows.arms, self._per_square, strict=True):
            part = r.turned() * (-m * per)
            across.append(part)
            force, moment = force - part, moment - a.cross(part)
        along = self._rows.combine(force, moment)
        inner = tuple(t + r * x for t, r, x in zip(across, self._rows.r, along, strict=True))
        return *(-(f + q) for (f, _), q in zip(legs, inner, strict=True)), *inner


def assembly_modes(pins: tuple[Vec2, ...], lengths: tuple[float, ...], arms: tuple[Vec2, ...]) -> list[Pose]:
    """All poses in which the triad closes, by rising angle in (-pi, pi]; at most six.

    A triad with two pins of the ternary link in one place is a pair of dyads; this function does not search for their
    poses.

    With D the second pin, d = D - P2, u = (E - P3) - d and v = (C - P1) - d, the differences of the three equations
    of length are linear in d. Their solution, put into the second equation, leaves a trigonometric polynomial of
    third order in theta. Its coefficients come from seven samples, and its roots z = exp(i theta) are eigenvalues of
    a companion matrix. Newton's method on the three lengths polishes each real root.
    """
    import numpy as np

    from ..engines import MATH

    (p1, p2, p3), (l1, l2, l3) = pins, lengths
    c, e = arms[0] - arms[1], arms[2] - arms[1]

    def parts(theta: Any) -> tuple[Any, ...]:
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
        across, at = (u, a) if u.squared() > v.squared() else (v, b)
        if not across.squared() > 0.0:
            continue
        base = across * (at / across.squared())
        chord = across.turned() * math.sqrt(max(l2 * l2 - base.squared(), 0.0) / across.squared())
        cos, sin = math.cos(theta), math.sin(theta)
        arm = Vec2(cos * arms[1].x - sin * arms[1].y, sin * arms[1].x + cos * arms[1].y)
        for d in (base + chord, base - chord):
            start = p2 + d - arm
            try:
                near = Pose(float(start.x), float(start.y), theta)
                pose = correct_pose(MATH, pins, lengths, arms, near, 20)
                rows = _Rows.at(MATH, pins, arms, pose)
            except (ArithmeticError, ValueError):
                continue
            angle = math.remainder(pose.theta, 2.0 * math.pi)
            closes = all(
                abs(r.squared() - l * l) < 1e-9 * size * size for r, l in zip(rows.r, lengths, strict=True)
            )
            if closes and not any(
                abs(math.remainder(angle - other.theta, 2.0 * math.pi)) < 1e-7
                and math.hypot(pose.x - other.x, pose.y - other.y) < 1e-7 * size
                for other in modes
            ):
                modes.append(Pose(pose.x, pose.y, angle))
    return sorted(modes, key=lambda pose: (pose.theta, pose.x, pose.y))
