"""Loads of a linkage from a description: forces and torques by expressions of the motion, springs with dampers, and
tables over the coordinate. Standard library only: FMUs carry this file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from ...groups.loads import Effect, Moving, Wrench
from ...mechanism.expressions import value_of
from ...planar import ZERO, Vec2

Entry = float | str
MOTION = ("phi", "w", "x", "y", "vx", "vy", "angle_rate")
"""Names that the expressions of a load know beside parameters and inputs: coordinate and speed of the driver, place
and velocity of the point, and angular velocity of the link."""


def name_of_load(load: Mapping[str, Any]) -> str:
    """The name of a load of a file among all loads: the weight and the losses have names of their own."""
    return f"loads.{load['name']}"


class CoordinateTable:
    """A table over the coordinate, between its points by cubic pieces that rise or fall as their ends do (Fritsch and
    Carlson). Over an angle it repeats itself each turn; over a way its ends go on."""

    def __init__(self, places: Sequence[float], values: Sequence[float], turns: bool) -> None:
        """
        Parameters
        ----------
        places : rising, of an angle within one turn [rad, m]
        values : at these places
        turns : whether the coordinate is an angle
        """
        self.turns = turns
        places, values = list(places), list(values)
        if turns:
            places.append(places[0] + 2.0 * math.pi)
            values.append(values[0])
        widths = [b - a for a, b in pairwise(places)]
        rises = [(b - a) / h for a, b, h in zip(values, values[1:], widths, strict=False)]
        slopes = [_mean_slope(rises[k - 1], rises[k], widths[k - 1], widths[k]) for k in range(len(rises))]
        slopes.append(slopes[0])
        if not turns:
            slopes[0] = slopes[-1] = 0.0
        knots = [place - places[0] for place in places]
        pieces = [*zip(widths, rises, slopes, slopes[1:], strict=False)]
        self._first, self._value, self._before = places[0], values[0], 0.0
        if turns:
            # the turn begins within the last piece, not at a point: there the slope would be that of one side alone
            knots.insert(0, knots[-2] - 2.0 * math.pi)
            pieces.insert(0, pieces[-1])
            self._value, self._before = values[-2], 0.5 * widths[-1]
        self._knots, self._pieces = tuple(knots), tuple(pieces)

    def value(self, xp: Any, q: Any) -> Any:
        """The value at the coordinate `q` [rad, m]."""
        total, way = self._value, q - self._first
        if self.turns:  # in one turn, from half of the last piece before the first place on
            x = way + self._before
            way = xp.atan2(-xp.sin(x), -xp.cos(x)) + (math.pi - self._before)
        # where two pieces meet they share the size of one distance, so that the sum of their slopes is right there
        sizes = [xp.abs(way - knot) for knot in self._knots]
        for before, after, (width, rise, begin, end) in zip(sizes, sizes[1:], self._pieces, strict=False):
            t = 0.5 + (before - after) * (0.5 / width)  # from 0 to 1
            # Hermite's cubic, from the value at its begin
            cubic = 3.0 * rise - 2.0 * begin - end + t * (begin + end - 2.0 * rise)
            total = total + width * t * (begin + t * cubic)
        return total


def _mean_slope(before: float, after: float, left: float, right: float) -> float:
    """The slope between two pieces: 0 at a peak, else the weighted harmonic mean."""
    if before * after <= 0.0:
        return 0.0
    a, b = 2.0 * right + left, right + 2.0 * left
    return (a + b) / (a / before + b / after)


class ForceLaw(NamedTuple):
    """A force on a point of a link [N] by two expressions: in the frame, or, with an `axis`, along the link's own
    axes (x along the axis of its description). Its power counts as dissipated."""

    link: str
    point: str
    components: tuple[Entry, Entry]
    axis: Vec2 | None
    values: Mapping[str, Any]
    tables: Mapping[str, CoordinateTable]
    by_reactions: bool = False

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Any) -> Effect:
        """See `Acting`."""
        at, link = m.pins[self.point], m.links[self.link]
        known = _motion(xp, m, w, self.values, self.tables) | {
            "x": at.p.x, "y": at.p.y, "vx": at.p1.x * w, "vy": at.p1.y * w, "angle_rate": link.t1 * w
        }  # fmt: skip
        fx, fy = (value_of(xp, each, known) for each in self.components)
        force = Vec2(fx, fy)
        if self.axis is not None:
            own = Vec2(self.axis.dot(force), self.axis.cross(force))
            force = link.u * own.x + link.u.turned() * own.y
        moment = (at.p - link.pin.p).cross(force)
        return Effect((Wrench(self.link, force, moment),), dissipative=-force.dot(at.p1))


class TorqueLaw(NamedTuple):
    """A torque on a link [N m], counter-clockwise, by an expression. Its power counts as dissipated."""

    link: str
    torque: Entry
    values: Mapping[str, Any]
    tables: Mapping[str, CoordinateTable]
    by_reactions: bool = False

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Any) -> Effect:
        """See `Acting`."""
        link = m.links[self.link]
        known = _motion(xp, m, w, self.values, self.tables) | {"angle_rate": link.t1 * w}
        torque = value_of(xp, self.torque, known)
        return Effect((Wrench(self.link, ZERO, torque),), dissipative=-(torque * link.t1))


def _motion(
    xp: Any, m: Moving, w: Any, values: Mapping[str, Any], tables: Mapping[str, CoordinateTable]
) -> dict[str, Any]:
    at = {name: table.value(xp, m.q) for name, table in tables.items()}
    return {**values, **at, "phi": m.q, "w": w}


class SpringDamper(NamedTuple):
    """A spring with a damper between two points, each of a link or, with the link None, of the ground: its pull is
    stiffness (L - length) + damping dL/dt, with its length L [N/m, m, N s/m]."""

    ends: tuple[tuple[str | None, str], tuple[str | None, str]]
    stiffness: Any
    length: Any
    damping: Any
    by_reactions: bool = False

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Any) -> Effect:
        """See `Acting`."""
        (one, a), (other, b) = ((link, m.pins[pin]) for link, pin in self.ends)
        arm = b.p - a.p
        length = arm.length(xp)
        along = arm * (1.0 / length)
        rate = along.dot(b.p1 - a.p1)
        stretch = length - self.length
        pull, drag = self.stiffness * stretch, self.damping * rate * w
        force = along * (pull + drag)
        wrenches = tuple(
            Wrench(link, f, (end.p - m.links[link].pin.p).cross(f))
            for link, end, f in ((one, a, force), (other, b, -force))
            if link is not None
        )
        energy = 0.5 * pull * stretch
        return Effect(wrenches, conservative=pull * rate, dissipative=drag * rate, energy=energy)
