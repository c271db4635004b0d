"""A hanging chain of pinned rods between a fixed pin A1 and a moving pin A2: the organ with more than two bars.

Rods are numbered from A1 to A2; rod k has the length l, the mass m, uniform along it, and the absolute angle theta
from the downward vertical, positive towards +x (as the rocker's psi): u = (sin theta, -cos theta) points from its A1
end to its A2 end. Pin k is the end of rod k, pin 0 is A1, pin N is A2. At pin k the next rod, or the rocker, acts on
rod k with the force f_k.

Damping moments act in the pins. In pin k the outer rod gets the moment -c_k (w_outer - w_inner); pin 0 damps against
the frame, pin N against the rocker. Two rods that fold up against each other meet a stop: beyond the angle
`fold_limit` between them, the stop turns them back with the moment fold_stiffness (angle - fold_limit)^2.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

from ..core.planar import ZERO, Motion, Vec2


class Rods:
    """The rods of a chain: `lengths` [m], `masses` [kg], and `damping` c_0 .. c_N of the pins [N m s/rad]. `inertia`
    is a factor on m l^2/12, 1 for uniform rods. The inner pins have stops: `fold_limit` is their angle [rad],
    `fold_stiffness` their stiffness [N m/rad2]."""

    __slots__ = ("damping", "fold_limit", "fold_stiffness", "inertia", "lengths", "masses")

    def __init__(
        self,
        lengths: Sequence[Any],
        masses: Sequence[Any],
        damping: Sequence[Any],
        inertia: Any = 1.0,
        fold_limit: Any = 3.0,
        fold_stiffness: Any = 0.0,
    ) -> None:
        self.lengths = tuple(lengths)
        self.masses = tuple(masses)
        self.damping = tuple(damping)
        self.inertia = inertia
        self.fold_limit, self.fold_stiffness = fold_limit, fold_stiffness

    def __len__(self) -> int:
        return len(self.lengths)


class _Matrix:
    """A symmetric 2 x 2 matrix."""

    __slots__ = ("xx", "xy", "yy")

    def __init__(self, xx: Any, xy: Any, yy: Any) -> None:
        self.xx, self.xy, self.yy = xx, xy, yy

    def times(self, v: Vec2) -> Vec2:
        return Vec2(self.xx * v.x + self.xy * v.y, self.xy * v.x + self.yy * v.y)

    def solve(self, v: Vec2) -> Vec2:
        det = self.xx * self.yy - self.xy * self.xy
        return Vec2((self.yy * v.x - self.xy * v.y) / det, (self.xx * v.y - self.xy * v.x) / det)


class _RodStep(NamedTuple):
    """A rod in the recursion: the normal `n` of its direction, and what its angular acceleration and the force and
    acceleration at its start are by the force f at its end.

    With across = n . f, E f = f - n across/(2 kappa) and a = S E f + rest, the acceleration of its start is a, its
    angular acceleration turn + l/j across - m l/(2 j) n . a, and the force at its start pull + E f - B a.
    """

    n: Vec2
    pull: Vec2
    B: _Matrix
    S: _Matrix
    rest: Vec2
    turn: Any
    j: Any


class Recursion:
    """A recursion over a chain at given angles: accelerations and pin forces from the acceleration of A2.

    From A1 to A2, rod by rod, it computes the acceleration of each pin as a_k = Phi_k f_k + beta_k. Phi_k is
    symmetric and positive: the articulated compliance of the part before the pin. At A2 the acceleration is known, so
    that f_N follows. A pass back from A2 to A1 gives all forces and angular accelerations. The cost grows with N, not
    with its cube, and the chain stays closed at the level of accelerations, to rounding.

    With speeds and loads zero the recursion maps a displacement of A2 to the smallest change of the angles in the
    metric of the masses: the projection that closes a chain after a drift (`close`).

    `compliance` is Phi_N, the acceleration at A2 by the force there [1/kg].
    """

    __slots__ = ("_free_end", "_half", "_rods", "_steps", "compliance")

    def __init__(
        self,
        xp: Any,
        rods: Rods,
        theta: Sequence[Any],
        free: Sequence[Vec2],
        spin: Sequence[Any],
        moments: Sequence[Any],
        at_start: Sequence[Vec2] | None = None,
    ) -> None:
        """
        Parameters
        ----------
        theta : angles of the rods [rad]
        free : force on each rod at its middle [N]
        spin : squared angular speed of each rod [rad2/s2]
        moments : moment on each rod [N m]
        at_start : force on each rod at its start [N]
        """
        self._rods = rods
        # the inertia about an end is kappa m l^2
        kappa = 0.25 + rods.inertia * (1.0 / 12.0)
        self._half, quarter = 0.5 / kappa, 0.25 / kappa
        zero = 0.0 * theta[0]
        self.compliance, self._free_end = _Matrix(zero, zero, zero), Vec2(zero, zero)
        self._steps: list[_RodStep] = []
        for k, (l, m) in enumerate(zip(rods.lengths, rods.masses, strict=True)):
            s, c = xp.sin(theta[k]), xp.cos(theta[k])
            u, n = Vec2(s, -c), Vec2(c, s)
            # about the pin before: kappa m l^2 alpha + (m l/2) n . a = l n . f + (l/2) n . free + moment
            j = kappa * m * l * l
            # the action on the rod besides f and the acceleration of the pin before: `turn` is its part of alpha
            turn = (free[k].dot(n) * (0.5 * l) + moments[k]) / j
            pull = free[k] + u * (0.5 * m * l * spin[k]) - n * (0.5 * m * l * turn)
            if at_start is not None:
                pull = pull + at_start[k]
            step = self._step(quarter, m, n, pull, turn, j)
            self._steps.append(step)
            # a = a_before + l n alpha - l u spin, alpha = turn + (l/j) n . f - (m l/(2 j)) n . a_before
            #   = E^T a_before + (l^2/j) n (n . f) + l n turn - l u spin
            self._go_on(l, step, u * (l * spin[k]))

    def _step(self, quarter: Any, m: Any, n: Vec2, pull: Vec2, turn: Any, j: Any) -> _RodStep:
        """The step of a rod on the chain before it, whose end has the acceleration a_before = Phi f_before + beta. As
        f_before = pull + E f - B a_before, with B = m (1 - n n/(4 kappa)), the acceleration solves
        (1 + Phi B) a_before = Phi (pull + E f) + beta. `quarter` is 1/(4 kappa)."""
        phi, beta = self.compliance, self._free_end
        b = _Matrix(
            m * (1.0 - quarter * n.x * n.x), -quarter * m * n.x * n.y, m * (1.0 - quarter * n.y * n.y)
        )
        k11 = 1.0 + phi.xx * b.xx + phi.xy * b.xy
        k12 = phi.xx * b.xy + phi.xy * b.yy
        k21 = phi.xy * b.xx + phi.yy * b.xy
        k22 = 1.0 + phi.xy * b.xy + phi.yy * b.yy
        det = k11 * k22 - k12 * k21
        # S = (1 + Phi B)^-1 Phi is symmetric
        S = _Matrix(
            (k22 * phi.xx - k12 * phi.xy) / det,
            (k22 * phi.xy - k12 * phi.yy) / det,
            (k11 * phi.yy - k21 * phi.xy) / det,
        )
        rest = Vec2((k22 * beta.x - k12 * beta.y) / det, (k11 * beta.y - k21 * beta.x) / det)
        return _RodStep(n, pull, b, S, rest + S.times(pull), turn, j)

    def _go_on(self, l: Any, step: _RodStep, inward: Vec2) -> None:
        """Add the rod of a step to the chain: Phi = E S E + (l^2/j) n n, with E = 1 - n n/(2 kappa), and beta.
        `inward` is the acceleration of its end towards its start by its angular speed [m/s2]."""
        n, S, half = step.n, step.S, self._half
        q = l * l / step.j
        e = _Matrix(1.0 - half * n.x * n.x, -half * n.x * n.y, 1.0 - half * n.y * n.y)
        ax, ay = e.xx * S.xx + e.xy * S.xy, e.xx * S.xy + e.xy * S.yy
        bx, by = e.xy * S.xx + e.yy * S.xy, e.xy * S.xy + e.yy * S.yy
        self.compliance = _Matrix(
            ax * e.xx + ay * e.xy + q * n.x * n.x,
            ax * e.xy + ay * e.yy + q * n.x * n.y,
            bx * e.xy + by * e.yy + q * n.y * n.y,
        )
        self._free_end = e.times(step.rest) + n * (l * step.turn) - inward

    def force(self, end: Vec2) -> Vec2:
        """Force on the last rod at A2 [N] if A2 has the acceleration `end` [m/s2]."""
        return self.compliance.solve(end - self._free_end)

    def back(self, force: Vec2) -> tuple[list[Any], list[Vec2]]:
        """Angular accelerations of the rods and the forces f_0 .. f_N at the pins, from the force at A2; f_0 acts on
        the support."""
        half = self._half
        accelerations: list[Any] = []
        forces = [force]
        for k in reversed(range(len(self._rods))):
            n, pull, b, S, rest, turn, j = self._steps[k]
            l, m = self._rods.lengths[k], self._rods.masses[k]
            f = forces[-1]
            across = n.dot(f)
            Ef = f - n * (half * across)
            before = S.times(Ef) + rest
            accelerations.append(turn + l / j * across - 0.5 * m * l / j * n.dot(before))
            forces.append(pull + Ef - b.times(before))
        return accelerations[::-1], forces[::-1]


class Chain:
    """A chain at one state, with the acceleration of its end at A2. `moment_at_start` and `moment_at_end` act on the
    chain in the pins A1 and A2 [N m]; `folding` is the energy in the stops [J], `damping_power` the power that
    damping takes [W]."""

    def __init__(
        self,
        xp: Any,
        rods: Rods,
        theta: Sequence[Any],
        omega: Sequence[Any],
        g: Any,
        end_spin: Any,
        end: Vec2,
        at_start: Sequence[Vec2] | None = None,
    ) -> None:
        """
        Parameters
        ----------
        theta, omega : angles [rad] and speeds [rad/s] of the rods
        end_spin : angular speed of the rocker [rad/s]
        end : acceleration of A2 [m/s2]
        at_start : force on each rod at its start [N], beside its weight
        """
        N = len(rods)
        speeds = [0.0, *omega, end_spin]
        relative = [speeds[k + 1] - speeds[k] for k in range(N + 1)]
        moments = [c * speed for c, speed in zip(rods.damping, relative, strict=True)]
        self.damping_power = sum(moment * speed for moment, speed in zip(moments, relative, strict=True))
        self.folding = 0.0
        # without a stop nothing is computed for it
        if not (isinstance(rods.fold_stiffness, float) and rods.fold_stiffness == 0.0):
            for k in range(1, N):
                # like damping, the stop turns the inner rod towards the outer one
                moment, energy = self._stop(xp, rods, theta[k] - theta[k - 1])
                moments[k] = moments[k] + moment
                self.folding = self.folding + energy
        self.moment_at_start, self.moment_at_end = -moments[0], moments[-1]
        self.recursion = Recursion(
            xp,
            rods,
            theta,
            [Vec2(0.0, -m * g) for m in rods.masses],
            [w * w for w in omega],
            [moments[k + 1] - moments[k] for k in range(N)],
            at_start,
        )
        self._end = end

    @cached_property
    def _solution(self) -> tuple[list[Any], list[Vec2]]:
        return self.recursion.back(self.recursion.force(self._end))

    @property
    def rates(self) -> list[Any]:
        """Angular accelerations of the rods [rad/s2]."""
        return self._solution[0]

    @property
    def forces(self) -> list[Vec2]:
        """Forces f_0 .. f_N at the pins [N]."""
        return self._solution[1]

    @staticmethod
    def _stop(xp: Any, rods: Rods, fold: Any) -> tuple[Any, Any]:
        """Moment of a stop in the direction of the angle `fold` between two rods, and its energy."""
        above = xp.maximum(fold - rods.fold_limit, 0.0)
        below = xp.maximum(-fold - rods.fold_limit, 0.0)
        k = rods.fold_stiffness
        return (
            k * (above * above - below * below),
            k * (1.0 / 3.0) * (above * above * above + below * below * below),
        )


def pins(lengths: Sequence[Any], theta: Sequence[Any], omega: Sequence[Any], xp: Any) -> list[Motion]:
    """Place and velocity of each pin relative to A1, pin 0 included."""
    joints = [Motion(ZERO, ZERO)]
    for l, angle, w in zip(lengths, theta, omega, strict=True):
        s, c = xp.sin(angle), xp.cos(angle)
        joints.append(Motion(joints[-1].p + Vec2(s, -c) * l, joints[-1].p1 + Vec2(c, s) * (l * w)))
    return joints


def end_motion(rods: Rods, theta: Sequence[Any], omega: Sequence[Any], xp: Any) -> Motion:
    """Place and velocity of the last pin relative to A1."""
    return pins(rods.lengths, theta, omega, xp)[-1]


def close(
    xp: Any, rods: Rods, theta: Sequence[Any], omega: Sequence[Any], end: Motion, rounds: int = 3
) -> tuple[list[Any], list[Any], Any]:
    """Angles and speeds with which the chain ends at `end` and moves with it: the nearest ones to the given ones, in
    the metric of the masses; and the work [J] of the jolts at A2 that change the speeds."""
    N, work = len(rods), 0.0
    nothing = [Vec2(0.0, 0.0)] * N, [0.0] * N, [0.0] * N
    for _ in range(rounds):
        chain_end = end_motion(rods, theta, omega, xp)
        recursion = Recursion(xp, rods, theta, *nothing)
        # the speed of the end is taken at the angles before the change: it is as near as they are
        turns, _ = recursion.back(recursion.force(end.p - chain_end.p))
        jolt = recursion.force(end.p1 - chain_end.p1)
        faster, _ = recursion.back(jolt)
        work = work + 0.5 * jolt.dot(end.p1 + chain_end.p1)
        theta = [a + d for a, d in zip(theta, turns, strict=True)]
        omega = [w + d for w, d in zip(omega, faster, strict=True)]
    return list(theta), list(omega), work
