"""A chain of rods that hangs between a pin of the frame and a pin of a linkage: a load of the linkage with states.

The outer pin A2 moves with the acceleration p1 a + p2 w^2 (p1, p2: derivatives by the coordinate), so that the chain
adds

    J = p1 . Phi^-1 p1,     torque = p1 . Phi^-1 (p2 w^2 - beta) + t1 m_A2

at the coordinate, with the compliance Phi and the bias beta of the recursion at A2 (`chainunit.groups.chain`), and
the moment m_A2 of the pin there.

Errors of integration open a gap between the end of the chain and A2. To close it, the acceleration that the end has
to have is increased by 2 c (gap in speed) + c^2 (gap in place), with the rate c of closing.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from ..core.planar import ZERO, Link, Motion, Vec2
from .chain import Chain, Rods, close, pins
from .loads import Effect, Moving, Resistance, wrench_at

State = tuple[Sequence[Any], Sequence[Any]]
"""Angles [rad] and speeds [rad/s] of the rods."""


class HangingChain(NamedTuple):
    """A chain from the ground pin `start` to the pin `end` of a link: its rods in a state, and a resistance to the
    motion of the inner pin `at`."""

    start: str
    end: str
    rods: Rods
    state: State
    g: Any
    resistance: Resistance
    at: int
    by_reactions: bool = False

    def hold(self, xp: Any, m: Moving, w: Any) -> HeldChain:
        """The chain between its pins on the linkage, at the speed `w` of the coordinate [rad/s]."""
        return HeldChain(xp, self, m.pins[self.start].p, m.pins[self.end], m.links[m.carrier(self.end)].t1, w)

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Any) -> Effect:
        """See `chainunit.groups.loads.Acting`; the source is the `HeldChain`."""
        chain = self.hold(xp, m, w)
        at_end = wrench_at(m, self.end, -chain.chain.forces[-1])
        return Effect(
            (at_end._replace(moment=at_end.moment - chain.chain.moment_at_end),),
            conservative=chain.torque(chain.chain.forces),
            inertia=chain.inertia(),
            inertial=(wrench_at(m, self.end, -chain.per_acceleration()),),
            source=chain,
        )

    def close(self, xp: Any, m: Moving, w: Any) -> tuple[list[Any], list[Any], Any]:
        """Angles and speeds with which the chain ends at its outer pin and moves with it, by the smallest change in
        the metric of the masses, and the work of the jolt [J]."""
        a1, a2 = m.pins[self.start].p, m.pins[self.end]
        return close(xp, self.rods, *self.state, Motion(a2.p - a1, a2.p1 * w), 1)


class HeldChain:
    """A chain at one state, held at its outer pin, whose motion is known: the `chain`, the `gap` from its end to that
    pin, the `end_acceleration` of that pin at constant speed of the coordinate, and the force at the start of each
    rod."""

    def __init__(self, xp: Any, data: HangingChain, a1: Vec2, a2: Motion, turn: Any, w: Any) -> None:
        """
        Parameters
        ----------
        a1 : place of the ground pin
        a2, turn : motion of the outer pin, and rotation of its link per rotation of the coordinate
        w : speed of the coordinate [rad/s]
        """
        self.data, self.a1, self.a2, self.turn, self.w = data, a1, a2, turn, w
        theta, omega = data.state
        joints = pins(data.rods.lengths, theta, omega, xp)
        v, end = joints[data.at].p1, joints[-1]
        per_speed = data.resistance.per_speed(xp, v.squared())
        self.resistance_power = v.squared() * per_speed
        self.gap, self._speed_gap = a2.p - a1 - end.p, a2.p1 * w - end.p1
        self.end_acceleration = a2.p2 * (w * w)
        self.at_start = [ZERO] * len(data.rods)
        self.at_start[data.at] = v * (-per_speed)
        self.chain = Chain(
            xp, data.rods, theta, omega, data.g, turn * w, self.end_acceleration, self.at_start
        )

    def per_acceleration(self) -> Vec2:
        """Force at the outer pin per acceleration of the coordinate [N s2]."""
        return self.chain.recursion.compliance.solve(self.a2.p1)

    def inertia(self) -> Any:
        """Inertia that the chain adds at the coordinate [kg m2]."""
        return self.a2.p1.dot(self.per_acceleration())

    def torque(self, forces: Sequence[Vec2]) -> Any:
        """Torque that the chain adds at the coordinate [N m], with these forces at its pins."""
        return self.a2.p1.dot(forces[-1]) + self.turn * self.chain.moment_at_end

    def lost_power(self) -> Any:
        """Power that damping and resistance take [W]."""
        return self.chain.damping_power + self.resistance_power

    def at(self, a: Any, closing: float = 0.0) -> tuple[list[Any], list[Vec2]]:
        """Accelerations of the rods and forces at the pins at the acceleration `a` of the coordinate, see
        `chain.Recursion.back`; the end is drawn to the outer pin at the rate `closing` [1/s]."""
        end = self.end_acceleration + self.a2.p1 * a
        if closing:
            end = end + self._speed_gap * (2.0 * closing) + self.gap * (closing * closing)
        recursion = self.chain.recursion
        return recursion.back(recursion.force(end))

    def rates(self, a: Any, closing: float) -> list[Any]:
        """Rates of the angles and the speeds, and the power through the outer pin less the lost power [W]."""
        accelerations, forces = self.at(a, closing)
        return [*self.data.state[1], *accelerations, self.torque(forces) * self.w - self.lost_power()]

    def energies(self, xp: Any, shares: Sequence[Any]) -> tuple[Any, Any, Any]:
        """Kinetic and potential energy [J], and the energy of one kilogram of material that lies on the rods in these
        shares [J/kg]."""
        rods, (theta, omega), g = self.data.rods, self.data.state, self.data.g
        kinetic, potential, per_kg = 0.0, self.chain.folding, 0.0
        p0, v0 = self.a1, ZERO
        links = zip(rods.lengths, rods.masses, shares, theta, omega, strict=True)
        for l, m, share, angle, w in links:
            s, c = xp.sin(angle), xp.cos(angle)
            half, across = Vec2(s, -c) * (0.5 * l), Vec2(c, s) * (0.5 * l * w)
            moving = 0.5 * (v0 + across).squared() + rods.inertia * (l * l * w * w) * (1.0 / 24.0)
            height = g * (p0 + half).y
            kinetic, potential = kinetic + m * moving, potential + m * height
            per_kg = per_kg + share * (moving + height)
            p0, v0 = p0 + half * 2.0, v0 + across * 2.0
        return kinetic, potential, per_kg


# -- rest


def two_rods(xp: Any, first: Link, second: Link) -> list[Any]:
    """Angles of two rods in the position of the links of a dyad."""
    wall, web = first.u, -second.u
    angle = xp.atan2(wall.x, -wall.y)
    return [angle, angle + xp.atan2(wall.cross(web), wall.dot(web))]


def guess(xp: Any, reach: tuple[Any, Any]) -> list[Any]:
    """First guess of the unknowns of a chain at rest, for `hang`: the pull of a shallow parabola, v = 1/2, and the
    damping of Newton's method. `reach` is the vector from A1 to A2 in parts of the length of the chain."""
    x, y = reach
    spare = xp.maximum(1e-9, 1.0 - xp.sqrt(x * x + y * y))
    return [xp.maximum(x, 0.05) / xp.sqrt(24.0 * spare), 0.5, 1.0]


def resting(xp: Any, rods: Rods, hand: float, z: Sequence[Any]) -> list[Any]:
    """Angles of the rods at rest from the unknowns; `hand` is -1 for a mirrored chain."""
    H, v, _ = z
    return [xp.atan2(hand * H, v - b) for b in _shape(rods)[1]]


def hang(xp: Any, rods: Rods, reach: tuple[Any, Any], z: Sequence[Any]) -> list[Any]:
    """One round towards the hanging position, of the unknowns z = (H, v, damping): Newton's method on log H and v,
    with more damping as long as it does not descend (Levenberg and Marquardt). H cannot cross zero."""
    H, v, damping = z
    l, b = _shape(rods)
    value, by_h, by_v, hh, hv, vv = _gradient(b, l, H, v, reach, xp)
    gs = H * by_h
    ss, sv, vv = H * H * hh + xp.maximum(gs, 0.0) + damping * H, H * hv, vv + damping
    det = ss * vv - sv * sv
    farther = H * (1.0 + xp.maximum(-0.7, xp.minimum(1.0, (sv * by_v - vv * gs) / det)))
    higher = v + (sv * gs - ss * by_v) / det
    after = _gradient(b, l, farther, higher, reach, xp)[0]
    # 1 where the step descends or stands, otherwise 0
    accept = xp.minimum(1.0, xp.maximum(0.0, (value - after + 2e-15) * 1e18))
    return [
        H + accept * (farther - H), v + accept * (higher - v), xp.minimum(1e6, damping * (4.0 - 3.9 * accept))
    ]  # fmt: skip


def _gradient(b: Sequence[Any], l: Sequence[Any], H: Any, v: Any, reach: tuple[Any, Any], xp: Any) -> Any:
    """The function whose minimum is the hanging position, see `hang`, with its derivatives by H and v:
    the horizontal force H > 0, and the weight v between A1 and the point of horizontal pull, both in parts
    of the whole weight."""
    value, by_h, by_v = v * reach[1] - H * reach[0], -reach[0], reach[1]
    hh, hv, vv = 0.0, 0.0, 0.0
    for middle, length in zip(b, l, strict=True):
        m = v - middle
        size = xp.sqrt(H * H + m * m)
        x, y, k = H / size, m / size, length / size
        value, by_h, by_v = value + length * size, by_h + length * x, by_v + length * y
        hh, hv, vv = hh + k * y * y, hv - k * x * y, vv + k * x * x
    return value, by_h, by_v, hh, hv, vv


def _shape(rods: Rods) -> tuple[list[Any], list[Any]]:
    """Lengths of the rods in parts of the whole length, and the weight between A1 and the middle of each rod in parts
    of the whole weight."""
    whole, weight = sum(rods.lengths), sum(rods.masses)
    middles, before = [], 0.0
    for m in rods.masses:
        middles.append((before + 0.5 * m) / weight)
        before = before + m
    return [l / whole for l in rods.lengths], middles
