"""A hanging chain of pinned rods between a fixed pin A1 and a moving pin A2: the organ with more than two bars.

Rods are numbered from A1 to A2; rod k has the length l, the mass m, uniform along it, and the absolute angle theta
from the downward vertical, positive towards +x (as the rocker's psi): u = (sin theta, -cos theta) points from its A1
end to its A2 end. Pin k is the end of rod k, pin 0 is A1, pin N is A2; f_k is the force on rod k at pin k, from what
follows.

Damping moments act in the pins: on the outer of two rods -c_k (w_outer - w_inner), pin 0 against the frame, pin N
against the rocker.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..planar import Motion, Vec2


class Rods:
    """Lengths [m] and masses [kg] of the rods, and damping c_0 .. c_N of the pins [N m s/rad]."""

    __slots__ = ("damping", "lengths", "masses")

    def __init__(self, lengths: Sequence[Any], masses: Sequence[Any], damping: Sequence[Any]) -> None:
        self.lengths = tuple(lengths)
        self.masses = tuple(masses)
        self.damping = tuple(damping)

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


class Sweep:
    """One pass over a chain at given angles: accelerations and pin forces from the acceleration of A2.

    Carried from A1 rod by rod is the acceleration of each pin as a_k = Phi_k f_k + beta_k, with Phi symmetric and
    positive: the articulated compliance of what hangs before the pin. At A2, where the acceleration is known, f_N
    follows, and a pass back gives all forces and angular accelerations. The cost grows with N, not with its cube,
    and the chain stays closed at the level of accelerations, to rounding.

    With speeds and loads zero it maps a wanted displacement of A2 to the smallest change of the angles in the metric
    of the masses: the projection that closes a chain which has drifted (`closed`).
    """

    __slots__ = ("_beta", "_n", "_phi", "_rods", "_steps", "_u")

    def __init__(
        self,
        xp: Any,
        rods: Rods,
        theta: Sequence[Any],
        free: Sequence[Vec2],
        spin: Sequence[Any],
        moments: Sequence[Any],
    ) -> None:
        """
        Parameters
        ----------
        theta : angles of the rods [rad]
        free : force on each rod at its middle [N]
        spin : squared angular speed of each rod [rad2/s2]
        moments : moment on each rod [N m]
        """
        self._rods = rods
        zero = 0.0 * theta[0]
        phi, beta = _Matrix(zero, zero, zero), Vec2(zero, zero)
        self._phi, self._beta, self._steps, self._u, self._n = [phi], [beta], [], [], []
        for k, (l, m) in enumerate(zip(rods.lengths, rods.masses, strict=True)):
            s, c = xp.sin(theta[k]), xp.cos(theta[k])
            u, n = Vec2(s, -c), Vec2(c, s)
            # about the pin before: (m l^2/3) alpha + (m l/2) n . a = l n . f + (l/2) n . free + moment
            j = m * l * l * (1.0 / 3.0)
            # what acts on the rod beside f and the acceleration of the pin before; `turn` is alpha's part of it
            turn = (free[k].dot(n) * (0.5 * l) + moments[k]) / j
            pull = free[k] + u * (0.5 * m * l * spin[k]) - n * (0.5 * m * l * turn)
            # f_before = pull + f - (3/2) n (n . f) - B a_before, B = m (1 - (3/4) n n)
            b = _Matrix(m * (1.0 - 0.75 * n.x * n.x), -0.75 * m * n.x * n.y, m * (1.0 - 0.75 * n.y * n.y))
            # (1 + Phi B) a_before = Phi (pull + E f) + beta, E = 1 - (3/2) n n
            k11 = 1.0 + phi.xx * b.xx + phi.xy * b.xy
            k12 = phi.xx * b.xy + phi.xy * b.yy
            k21 = phi.xy * b.xx + phi.yy * b.xy
            k22 = 1.0 + phi.xy * b.xy + phi.yy * b.yy
            det = k11 * k22 - k12 * k21
            # S = (1 + Phi B)^-1 Phi is symmetric
            sxx = (k22 * phi.xx - k12 * phi.xy) / det
            sxy = (k22 * phi.xy - k12 * phi.yy) / det
            syy = (k11 * phi.yy - k21 * phi.xy) / det
            held = _Matrix(sxx, sxy, syy)
            rest = Vec2((k22 * beta.x - k12 * beta.y) / det, (k11 * beta.y - k21 * beta.x) / det)
            rest = rest + held.times(pull)
            self._steps.append((pull, b, held, rest, turn, j))
            self._u.append(u)
            self._n.append(n)
            # a = a_before + l n alpha - l u spin, alpha = turn + (l/j) n . f - (m l/(2 j)) n . a_before
            #   = E^T a_before + (l^2/j) n (n . f) + l n turn - l u spin
            q = l * l / j
            ex, exy, ey = 1.0 - 1.5 * n.x * n.x, -1.5 * n.x * n.y, 1.0 - 1.5 * n.y * n.y
            e = _Matrix(ex, exy, ey)
            # Phi_k = E S E + q n n
            ax, ay = ex * sxx + exy * sxy, ex * sxy + exy * syy
            bx, by = exy * sxx + ey * sxy, exy * sxy + ey * syy
            phi = _Matrix(
                ax * ex + ay * exy + q * n.x * n.x,
                ax * exy + ay * ey + q * n.x * n.y,
                bx * exy + by * ey + q * n.y * n.y,
            )
            beta = e.times(rest) + n * (l * turn) - u * (l * spin[k])
            self._phi.append(phi)
            self._beta.append(beta)

    @property
    def compliance(self) -> _Matrix:
        """The chain's acceleration at A2 by the force there [1/kg]."""
        return self._phi[-1]

    def force(self, end: Vec2) -> Vec2:
        """Force on the last rod at A2 [N] where A2 has the acceleration `end`."""
        return self._phi[-1].solve(end - self._beta[-1])

    def back(self, force: Vec2) -> tuple[list[Any], list[Vec2]]:
        """Angular accelerations of the rods and the forces f_0 .. f_N at the pins, from the force at A2; f_0 is on
        the support."""
        accelerations: list[Any] = []
        forces = [force]
        for k in reversed(range(len(self._rods))):
            pull, b, held, rest, turn, j = self._steps[k]
            l, m = self._rods.lengths[k], self._rods.masses[k]
            n, f = self._n[k], forces[-1]
            across = n.dot(f)
            moved = f - n * (1.5 * across)
            before = held.times(moved) + rest
            accelerations.append(turn + l / j * across - 0.5 * m * l / j * n.dot(before))
            forces.append(pull + moved - b.times(before))
        return accelerations[::-1], forces[::-1]


class Chain:
    """A chain at one state, its A2 end moved."""

    __slots__ = ("forces", "moment_at_end", "rates", "sweep")

    def __init__(
        self,
        xp: Any,
        rods: Rods,
        theta: Sequence[Any],
        omega: Sequence[Any],
        g: Any,
        end_spin: Any,
        end: Vec2,
    ) -> None:
        """
        Parameters
        ----------
        theta, omega : angles [rad] and speeds [rad/s] of the rods
        end_spin : angular speed of the rocker [rad/s]
        end : acceleration of A2 [m/s2]
        """
        N = len(rods)
        speeds = [0.0, *omega, end_spin]
        moments = [c * (speeds[k + 1] - speeds[k]) for k, c in enumerate(rods.damping)]
        self.moment_at_end = moments[-1]
        self.sweep = Sweep(
            xp,
            rods,
            theta,
            [Vec2(0.0, -m * g) for m in rods.masses],
            [w * w for w in omega],
            [moments[k + 1] - moments[k] for k in range(N)],
        )
        self.rates, self.forces = self.sweep.back(self.sweep.force(end))


def end_motion(rods: Rods, theta: Sequence[Any], omega: Sequence[Any], xp: Any) -> Motion:
    """Place and velocity of the last pin from A1."""
    p, v = Vec2(0.0, 0.0), Vec2(0.0, 0.0)
    for l, angle, w in zip(rods.lengths, theta, omega, strict=True):
        s, c = xp.sin(angle), xp.cos(angle)
        p = p + Vec2(s, -c) * l
        v = v + Vec2(c, s) * (l * w)
    return Motion(p, v)


def closed(
    xp: Any, rods: Rods, theta: Sequence[Any], omega: Sequence[Any], end: Motion, rounds: int = 2
) -> tuple[list[Any], list[Any]]:
    """Angles and speeds nearest to the given ones, in the metric of the masses, with which the chain ends at `end`
    and moves with it."""
    N = len(rods)
    nothing = [Vec2(0.0, 0.0)] * N, [0.0] * N, [0.0] * N
    for _ in range(rounds):
        at = end_motion(rods, theta, omega, xp)
        sweep = Sweep(xp, rods, theta, *nothing)
        change, _ = sweep.back(sweep.force(end.p - at.p))
        theta = [a + d for a, d in zip(theta, change, strict=True)]
    at = end_motion(rods, theta, omega, xp)
    sweep = Sweep(xp, rods, theta, *nothing)
    change, _ = sweep.back(sweep.force(end.p1 - at.p1))
    return list(theta), [w + d for w, d in zip(omega, change, strict=True)]
