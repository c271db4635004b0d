"""Statics of a hanging chain between two pins: N rods, and the catenary as their limit.

x points right, y up. `p` is the force on the chain at A1 from the support. Along the chain, the force of a part on
the next piece is p less the weight of that part. A rod lies along the mean of the forces at its ends: u = -m/|m|,
m = p - (0, weight before its middle). So the two components of p are the only unknowns. The vector from A1 to A2
is minus the gradient of a convex function of p,

    d/dp sum of l |m(p)| = -(A2 - A1).

With the term p . (A2 - A1) added, the function has a unique minimum if the chain is longer than the distance of
the pins: the hanging, stable position. A uniform piece has the integral of |p - (0, w s)| along it in place of l |m|:
the catenary, piece by piece, in closed form.

A trust-region method finds the minimum, since plain steps of Newton's method fail near a crossing of m = 0, where a
rod would turn over. Newton's method then polishes the result.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.errors import GeometryError, InputError, shown

_POLISH = 30
_MOST_RODS = 10_000
"""Largest number of rods of an organ at rest, whose vibration has a matrix with its square."""


@dataclass(frozen=True)
class Hanging:
    """A chain at rest. `first` and `last` are the forces on it at A1 and A2 [N], shape (2,). `theta` are the angles
    of the rods from the downward vertical, positive towards +x [rad], shape (N,), empty for a catenary. `pull` is the
    mean pull in each rod [N], for a catenary the least pull."""

    first: Any
    last: Any
    theta: Any
    pull: Any


def rods(lengths: Any, weights: Any, reach: Any) -> Hanging:
    """Rods of the `lengths` [m] and `weights` [N] at rest between A1 and A2 = A1 + `reach` [m].

    Raises
    ------
    GeometryError
        if the chain is not longer than the distance of the pins, or the pins are so near that it folds up.
    """
    l, W = np.asarray(lengths, float), np.asarray(weights, float)
    before = np.concatenate([[0.0], np.cumsum(W)[:-1]]) + 0.5 * W

    def means(p: Any) -> tuple[Any, Any]:
        """The means of the forces at the ends of the rods, and their sizes."""
        m = np.stack([np.full_like(before, p[0]), p[1] - before])
        return m, np.hypot(*m)

    def parts(p: Any) -> tuple[float, Any, Any]:
        m, size = means(p)
        unit = m / size
        hessian = np.einsum("k,ik,jk->ij", -l / size, unit, unit) + np.eye(2) * np.sum(l / size)
        return float(l @ size), unit @ l, hessian

    reach = np.asarray(reach, float)
    for k in range(len(l)):
        # without horizontal force all other rods would hang straight, and rod k, free of force, would close the gap
        open_end = reach + np.array([0.0, float(l @ np.sign(before[k] - before))])
        if np.hypot(*open_end) <= l[k] * (1.0 + 1e-9):
            raise GeometryError(
                f"horizontal distance of the pins = {abs(reach[0]):g} m: rod {k + 1} of {len(l)} ({l[k]:g} m) would "
                "lie across between two parts that hang straight, without force; must be larger, or the rods shorter"
            )
    p = _pull_at_rest(parts, reach, float(np.sum(l)), float(np.sum(W)))
    m, size = means(p)
    total = float(np.sum(W))
    return Hanging(p, np.array([-p[0], total - p[1]]), np.arctan2(-m[0], m[1]), size)


def catenary(lengths: Any, weights: Any, reach: Any) -> Hanging:
    """Uniform pieces of the `lengths` [m] and `weights` [N] in series, each a chain of infinitely many rods.

    Raises
    ------
    GeometryError
        see `rods`.
    """
    l, W = np.asarray(lengths, float), np.asarray(weights, float)
    ends = np.concatenate([[0.0], np.cumsum(W)])
    w = W / l

    def parts(p: Any) -> tuple[float, Any, Any]:
        """Value, gradient and second derivatives of f at the pull `p`: integrals over the pieces in closed form."""
        H = abs(p[0])
        v = p[1] - ends
        size = np.hypot(H, v)
        # the integral of |m| over a piece: (v |m| + H^2 asinh(v/H))/2 between its ends, divided by -w
        arc = np.arcsinh(v / H)
        area = 0.5 * (v * size + H * H * arc)
        along_x = np.sum(p[0] * (arc[:-1] - arc[1:]) / w)
        along_y = np.sum((size[:-1] - size[1:]) / w)
        xx = np.sum(((arc - v / size)[:-1] - (arc - v / size)[1:]) / w)
        xy = np.sum(((p[0] / size)[:-1] - (p[0] / size)[1:]) / w)
        yy = np.sum(((v / size)[:-1] - (v / size)[1:]) / w)
        return (
            float(np.sum((area[:-1] - area[1:]) / w)),
            np.array([along_x, along_y]),
            np.array([[xx, xy], [xy, yy]]),
        )

    p = _pull_at_rest(parts, np.asarray(reach, float), float(np.sum(l)), float(np.sum(W)))
    total = float(np.sum(W))
    return Hanging(p, np.array([-p[0], total - p[1]]), np.empty(0), np.array(abs(p[0])))


def _pull_at_rest(parts: Any, reach: Any, length: float, weight: float) -> Any:
    """The pull at the first pin of a hanging chain [N], shape (2,): the p at the minimum of f(p) + p . reach, at
    which the vectors of all rods add up to `reach`.

    Parameters
    ----------
    parts : gives value, gradient, shape (2,), and second derivatives, shape (2, 2), of f at p
    reach : from the first pin to the last [m], shape (2,)
    length, weight : of the whole chain [m, N]

    Raises
    ------
    GeometryError
        for a chain that is too short, or hangs as no minimum shows.
    """
    from scipy.optimize import minimize

    distance = float(np.hypot(*reach))
    if not length > distance:
        raise GeometryError(
            f"length of the chain = {length:g} m: must be > {distance:g} m, the distance of its ends"
        )
    # start from the pull of a shallow parabola; it has the right size for a deep chain, too
    across = max(abs(reach[0]), 0.05 * length)
    pull = across / np.sqrt(24.0 * max(length - distance, 1e-9 * length) * length)
    start = np.array([-np.copysign(pull, reach[0] or 1.0), 0.5])

    # all in parts of the weight and of the length
    def value(x: Any) -> float:
        return float(parts(weight * x)[0] / weight + x @ reach) / length

    def gradient(x: Any) -> Any:
        return (parts(weight * x)[1] + reach) / length

    def curvature(x: Any) -> Any:
        return parts(weight * x)[2] * weight / length

    search = {"method": "trust-exact", "options": {"gtol": 1e-7, "maxiter": 500}}
    with np.errstate(invalid="ignore", divide="ignore"):
        rough = minimize(value, start, jac=gradient, hess=curvature, **search).x
        x, residual = _polished(rough, gradient, curvature)
    if not residual < 1e-11:
        raise GeometryError(
            f"a chain of {length:g} m between pins {distance:g} m apart: no hanging position was found; must be "
            "neither stretched nor folded up"
        )
    return weight * x


@dataclass(frozen=True)
class Modes:
    """Small vibration of a hanging chain of N rods about its rest, with both pins held: the natural frequencies
    [rad/s], rising, shape (N - 2,), and the angles of the rods in each mode, scaled to a largest angle of 1, shape
    (N - 2, N)."""

    frequency: Any
    shape: Any


def modes(lengths: Any, weights: Any, rest: Hanging, g: float) -> Modes:
    """Natural frequencies and shapes of the rods at `rest`, undamped; the rods are uniform.

    A rotation theta of a rod shortens its projection on its line by l theta^2/2, so that the stiffness is diagonal:
    length times pull of each rod. The inertia is that of the chain that hangs from A1; the pin A2 removes two
    degrees of freedom.
    """
    from scipy.linalg import eigh, null_space

    l, m = np.asarray(lengths, float), np.asarray(weights, float) / g
    N = len(l)
    after = np.concatenate([np.cumsum(m[::-1])[::-1][1:], [0.0]])  # mass after each rod
    outer = np.maximum.outer(np.arange(N), np.arange(N))  # the rod farther from A1 of each two rods
    inertia = np.outer(l, l) * np.cos(np.subtract.outer(rest.theta, rest.theta)) * (0.5 * m + after)[outer]
    inertia[np.diag_indices(N)] = l * l * (m / 3.0 + after)
    along = np.stack([l * np.cos(rest.theta), l * np.sin(rest.theta)])
    free = null_space(along)
    k2, shapes = eigh(free.T @ (free * (l * rest.pull)[:, None]), free.T @ inertia @ free)
    rotations = (free @ shapes).T
    return Modes(np.sqrt(np.maximum(k2, 0.0)), rotations / np.max(np.abs(rotations), axis=1, keepdims=True))


def split(parts: Sequence[float], number: int) -> tuple[int, ...]:
    """Distribute `number` rods over two parts of these lengths, so that the rods are nearest to equal length: the
    number in each part.

    Raises
    ------
    InputError
        for a number that is not whole, below 2, or above 10000.
    """
    whole = type(number) is not bool and isinstance(number, int | np.integer)
    if not whole or not len(parts) <= number <= _MOST_RODS:
        raise InputError(f"number of rods = {shown(number)}: must be a whole number >= 2 and <= {_MOST_RODS}")
    first, second = parts
    most = number - 1
    share = round(number * first / (first + second))
    mine = min(max(1, share), most)
    return mine, number - mine


def _polished(x: Any, gradient: Any, curvature: Any) -> tuple[Any, float]:
    """The place at which the gradient vanishes, from `x` near it by Newton's steps, shape (2,), and the size of the
    gradient there. Near a minimum the values differ by less than rounding, but the gradient is still accurate."""
    residual = gradient(x)
    for _ in range(_POLISH):
        trial = x - np.linalg.solve(curvature(x), residual)
        after = gradient(trial)
        if not np.hypot(*after) < np.hypot(*residual):
            break
        x, residual = trial, after
    return x, float(np.hypot(*residual))
