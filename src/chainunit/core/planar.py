"""Planar vectors and the motion of points and links.

Frame of the whole package: x to the right, y up, angles counter-clockwise.

A mechanism with one degree of freedom moves along one coordinate q (a crank angle, a rocker
angle). A `Motion` holds a point and its first and second derivative *by q*, so that

    velocity = p1 * w,     acceleration = p1 * a + p2 * w**2,     w = dq/dt, a = dw/dt.

Kinetics are then linear in `a` and quadratic in `w` by construction.
Components are the numbers of the engine: floats, arrays, symbols, dual numbers.
"""

from __future__ import annotations

from typing import Any

from .engines import Dual, slope


class Vec2:
    """A vector in the plane; a scalar factor stands on the right: ``v * 2.0``."""

    __slots__ = ("x", "y")

    def __init__(self, x: Any, y: Any) -> None:
        self.x = x
        self.y = y

    def __add__(self, other: Vec2) -> Vec2:
        return Vec2(self.x + other.x, self.y + other.y)

    def __sub__(self, other: Vec2) -> Vec2:
        return Vec2(self.x - other.x, self.y - other.y)

    def __neg__(self) -> Vec2:
        return Vec2(-self.x, -self.y)

    def __mul__(self, factor: Any) -> Vec2:
        return Vec2(self.x * factor, self.y * factor)

    def plus(self, other: Vec2, factor: Any) -> Vec2:
        """The sum with `other` times a factor."""
        return Vec2(self.x + other.x * factor, self.y + other.y * factor)

    def dot(self, other: Vec2) -> Any:
        """Scalar product."""
        return self.x * other.x + self.y * other.y

    def cross(self, other: Vec2) -> Any:
        """z component of the vector product: the moment of force `other` on arm `self`."""
        return self.x * other.y - self.y * other.x

    def turned(self) -> Vec2:
        """The vector turned by +90 degrees."""
        return Vec2(-self.y, self.x)

    def squared(self) -> Any:
        """Squared length."""
        return self.x * self.x + self.y * self.y

    def length(self, xp: Any) -> Any:
        """Length, at least 1e-30. With this bound the zero vector, too, has a derivative, which is zero."""
        return xp.sqrt(self.squared() + _NO_LENGTH * _NO_LENGTH)


_NO_LENGTH = 1e-30


def lifted(v: Vec2, d: Vec2) -> Vec2:
    """The vector `v` as a dual vector with the derivative `d`."""
    return Vec2(Dual(v.x, d.x), Dual(v.y, d.y))


def growth(v: Vec2) -> Vec2:
    """The derivative of a dual vector."""
    return Vec2(slope(v.x), slope(v.y))


ZERO = Vec2(0.0, 0.0)


def rotated(v: Vec2, by: Vec2) -> Vec2:
    """A vector that is turned by the angle of the unit vector `by`."""
    return Vec2(v.x * by.x - v.y * by.y, v.x * by.y + v.y * by.x)


def mirrored(by: Vec2) -> Vec2:
    """The unit vector of the opposite angle."""
    return Vec2(by.x, -by.y)


class Motion:
    """A point `p` with its derivatives `p1`, `p2` by the coordinate q [m, m/rad, m/rad^2]."""

    __slots__ = ("p", "p1", "p2")

    def __init__(self, p: Vec2, p1: Vec2 = ZERO, p2: Vec2 = ZERO) -> None:
        self.p = p
        self.p1 = p1
        self.p2 = p2

    def lifted(self, p3: Vec2) -> Motion:
        """The motion with its derivatives by q as dual parts; `p3` is the third one."""
        return Motion(lifted(self.p, self.p1), lifted(self.p1, self.p2), lifted(self.p2, p3))


class Link:
    """A rigid link: the pin it starts from, the unit vector `u` along it, and the first and
    second derivative of its angle by q (`t1`, `t2`, counter-clockwise)."""

    __slots__ = ("pin", "t1", "t2", "u")

    def __init__(self, pin: Motion, u: Vec2, t1: Any, t2: Any) -> None:
        self.pin = pin
        self.u = u
        self.t1 = t1
        self.t2 = t2

    def at(self, s: Any) -> Motion:
        """Motion of the point at distance `s` from the pin along the link."""
        return self.carried(Vec2(self.u.x * s, self.u.y * s))

    def beside(self, s: Any, t: Any) -> Motion:
        """Motion of the point at distance `s` along the link and `t` to its left."""
        u = self.u
        return self.carried(Vec2(u.x * s - u.y * t, u.y * s + u.x * t))

    def carried(self, r: Vec2) -> Motion:
        """Motion of the point `r` away from the pin."""
        # in components: with the engine `math` a vector takes ten times as long as a number
        p, p1, p2, x, y = self.pin.p, self.pin.p1, self.pin.p2, r.x, r.y
        t1, t2 = self.t1, self.t2
        spin = t1 * t1
        return Motion(
            Vec2(p.x + x, p.y + y),
            Vec2(p1.x - y * t1, p1.y + x * t1),
            Vec2(p2.x - y * t2 - x * spin, p2.y + x * t2 - y * spin),
        )

    def third_derivative(self, r: Vec2, start: Vec2, t3: Any) -> Vec2:
        """Third derivative by q of the point `r` away from the pin; `start` and `t3` are the third derivatives of the
        pin and of the angle."""
        t1 = self.t1
        across, along = t3 - t1 * t1 * t1, 3.0 * (t1 * self.t2)
        return Vec2(start.x - r.y * across - r.x * along, start.y + r.x * across - r.y * along)

    def lifted(self, start: Vec2, t3: Any) -> Link:
        """The link with its derivatives by q as dual parts; `start` and `t3` are the third derivatives of the pin and
        of the angle."""
        return Link(
            self.pin.lifted(start),
            lifted(self.u, self.u.turned() * self.t1),
            Dual(self.t1, self.t2),
            Dual(self.t2, t3),
        )
