"""The triad (class III Assur group, order 3): a ternary link C-D-E on three binary links, the legs.

The outer pins P move in a known way; each leg keeps the distance `l` between its P and its pin on the ternary link.
The pose of the ternary link is (x, y, theta): its origin and the direction of its own x axis; a pin that lies at
`arm` in its own frame stands at (x, y) + R(theta) arm. With r = pin - P and A = R(theta) arm, each leg gives a row

    (r.x, r.y, A x r)

and all that is solved here - Newton's correction, first and second derivative of the pose, the pull of the legs - has
the matrix of these three rows, whose determinant vanishes where the lines of the legs meet in one point or are
parallel: the dead positions of a triad, and nothing else. Nothing is lost where C, D and E lie on one line; the
three moment equations about them that paper 003 solves are singular there.

There is no closed form for the pose: up to six assembly modes are the real roots of a polynomial (`assembly_modes`),
and a mode is followed from one position to the next by `corrected`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from ..planar import Link, Motion, Vec2

LEGS = 3


class Pose(NamedTuple):
    """Where the ternary link is: its origin [m] and the angle of its x axis, counter-clockwise [rad]."""

    x: Any
    y: Any
    theta: Any


class _Rows:
    """The three rows (r.x, r.y, A x r) at a pose, and what solves with them."""

    __slots__ = ("arms", "cofactors", "det", "r")

    def __init__(self, xp: Any, pins: tuple[Vec2, ...], arms: tuple[Vec2, ...], pose: Pose) -> None:
        c, s = xp.cos(pose.theta), xp.sin(pose.theta)
        origin = Vec2(pose.x, pose.y)
        self.arms = tuple(Vec2(c * a.x - s * a.y, s * a.x + c * a.y) for a in arms)
        self.r = tuple(origin + a - p for a, p in zip(self.arms, pins, strict=True))
        rows = [(r.x, r.y, a.cross(r)) for r, a in zip(self.r, self.arms, strict=True)]
        self.cofactors = tuple(_cross(rows[(i + 1) % LEGS], rows[(i + 2) % LEGS]) for i in range(LEGS))
        self.det = _dot(rows[0], self.cofactors[0])

    def solve(self, b: tuple[Any, ...]) -> tuple[Any, Any, Any]:
        """z with row_i . z = b_i."""
        return tuple(sum(b[i] * self.cofactors[i][k] for i in range(LEGS)) / self.det for k in range(3))

    def combine(self, force: Vec2, moment: Any) -> tuple[Any, ...]:
        """lambda with sum of lambda_i row_i = (force, moment)."""
        return tuple(_dot((force.x, force.y, moment), c) / self.det for c in self.cofactors)


def _cross(a: tuple[Any, Any, Any], b: tuple[Any, Any, Any]) -> tuple[Any, Any, Any]:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _dot(a: tuple[Any, Any, Any], b: tuple[Any, Any, Any]) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def corrected(
    xp: Any,
    pins: tuple[Vec2, ...],
    lengths: tuple[Any, ...],
    arms: tuple[Vec2, ...],
    near: Pose,
    steps: int,
) -> Pose:
    """The pose after `steps` of Newton's method from `near`. From a pose that is nearly right each step doubles the
    number of right digits, and the order to which derivatives by what the pins depend on are right."""
    pose = near
    for _ in range(steps):
        rows = _Rows(xp, pins, arms, pose)
        wrong = tuple(0.5 * (l * l - r.squared()) for l, r in zip(lengths, rows.r, strict=True))
        dx, dy, turn = rows.solve(wrong)
        pose = Pose(pose.x + dx, pose.y + dy, pose.theta + turn)
    return pose


class Triad:
    """A solved triad: the ternary link as a `link` (origin and x axis of its frame), its `pins` and the `legs` from
    their outer pins, in the order in which they were given; `margin`, the determinant over the lengths of the legs
    and the size of the ternary link: 0 is a dead position."""

    __slots__ = ("_lengths", "_rows", "legs", "link", "margin", "pins")

    def __init__(
        self,
        xp: Any,
        outer: tuple[Motion, Motion, Motion],
        lengths: tuple[Any, ...],
        arms: tuple[Vec2, ...],
        pose: Pose,
    ) -> None:
        """
        Parameters
        ----------
        xp : engine (see `chainunit.engines`)
        outer : motion of the outer pins of the three legs
        lengths : of the legs [m]
        arms : pins on the ternary link, in its own frame [m]
        pose : where it is, see `corrected`
        """
        rows = _Rows(xp, tuple(p.p for p in outer), arms, pose)
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
        self.link = Link(origin, Vec2(xp.cos(pose.theta), xp.sin(pose.theta)), t1, t2)
        self.pins = tuple(
            Motion(p.p + r, k1, k2) for p, r, k1, k2 in zip(outer, rows.r, pins1, pins2, strict=True)
        )
        self.legs = tuple(
            Link(
                p,
                r * (1.0 / l),
                r.cross(k1 - p.p1) / (l * l),
                r.cross(k2 - p.p2) / (l * l),
            )
            for p, r, l, k1, k2 in zip(outer, rows.r, lengths, pins1, pins2, strict=True)
        )
        size = xp.sqrt(sum((arms[i] - arms[i - 1]).squared() for i in range(LEGS)))
        self.margin = rows.det / (lengths[0] * lengths[1] * lengths[2] * size)
        self._rows = rows
        self._lengths = lengths

    def reactions(
        self, legs: tuple[tuple[Vec2, Any], ...], ternary: tuple[Vec2, Any]
    ) -> tuple[tuple[Vec2, ...], tuple[Vec2, ...]]:
        """Forces on the legs at their outer pins and at the ternary link [N], from the loads on each leg, as force
        and moment about its outer pin, and on the ternary link, about its origin.

        The moment about its outer pin gives the part of the force across each leg; the pulls along the legs follow
        from two forces and one moment on the ternary link.
        """
        force, moment = ternary
        across = []
        for (_, m), r, a, l in zip(legs, self._rows.r, self._rows.arms, self._lengths, strict=True):
            part = r.turned() * (-m / (l * l))
            across.append(part)
            force, moment = force - part, moment - a.cross(part)
        along = self._rows.combine(force, moment)
        inner = tuple(t + r * x for t, r, x in zip(across, self._rows.r, along, strict=True))
        return tuple(-(f + q) for (f, _), q in zip(legs, inner, strict=True)), inner


def assembly_modes(pins: tuple[Vec2, ...], lengths: tuple[float, ...], arms: tuple[Vec2, ...]) -> list[Pose]:
    """All poses in which the triad closes, by rising angle in (-pi, pi]; at most six.

    Two pins of the ternary link in one place make two dyads of it, which are not looked for here.

    With D the second pin, d = D - P2, u = (E - P3) - d and v = (C - P1) - d, the differences of the three equations
    of length are linear in d; put into the second, they leave a trigonometric polynomial of third order in theta. Its
    coefficients come from seven samples, its roots z = exp(i theta) are eigenvalues of a companion matrix, and each
    real one is polished by Newton's method on the three lengths.
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
    found: list[Pose] = []
    for z in np.roots(coefficients[::-1]):
        if not abs(abs(z) - 1.0) < 1e-4:
            continue
        theta = float(np.angle(z))
        u, v, a, b = parts(theta)
        # D lies on the circle about P2 and on the line d . u = a, and on d . v = b, which is the same line where u
        # and v are parallel, as of parallel hangers: both ends of the chord are tried
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
                pose = corrected(MATH, pins, lengths, arms, near, 20)
                rows = _Rows(MATH, pins, arms, pose)
            except (ArithmeticError, ValueError):
                continue
            turned = math.remainder(pose.theta, 2.0 * math.pi)
            closes = all(
                abs(r.squared() - l * l) < 1e-9 * size * size for r, l in zip(rows.r, lengths, strict=True)
            )
            if closes and not any(
                abs(math.remainder(turned - other.theta, 2.0 * math.pi)) < 1e-7
                and math.hypot(pose.x - other.x, pose.y - other.y) < 1e-7 * size
                for other in found
            ):
                found.append(Pose(pose.x, pose.y, turned))
    return sorted(found, key=lambda pose: (pose.theta, pose.x, pose.y))
