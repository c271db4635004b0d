"""Design of a crank-rocker: whether its crank turns, its swing, its pressure angle, its speed-change coefficient.

`r` is the crank, `l` the coupler, `h` the rocker, `b` the frame O1-C; ``rho = r/l``, ``lam = h/l`` (paper 001).
Angles are in radians. Any `b` is allowed. The papers' frame, with crank and rocker parallel at the start, has
b^2 = l^2 - r^2 + h^2 (`parallel_frame`). In this frame both strokes take the same time, for any rho and lam: at the
extremes the rocker's end lies at l + r and l - r from O1 on its circle about C, and from b^2 - h^2 = (l + r)(l - r)
follows that these two points lie on one line through O1 (the power of the point O1). The crank then turns by half
a revolution between them, and K = 1.

Functions with an `xp` take values of any engine, the others take floats.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ..core.declared_numbers import number_in
from ..core.engines import MATH
from ..core.errors import GeometryError
from ..core.model import Requirement


def longest_crank(xp: Any, l: Any, h: Any, b: Any) -> Any:
    """The upper limit of the crank length r below which the crank turns [m].

    Eqs. (3), (4) of paper 001, and a third condition for h > l that the paper lacks: b - r > h - l.
    """
    return xp.minimum(l + h - b, b - xp.abs(l - h))


def parallel_frame(xp: Any, r: Any, l: Any, h: Any) -> Any:
    """The frame length of the papers: crank and rocker parallel at the start, and K = 1."""
    return xp.sqrt(l * l - r * r + h * h)


def angle_at_pivot(xp: Any, h: Any, b: Any, reach: Any) -> Any:
    """Angle O1-C-Bd where Bd is `reach` away from O1; at the extremes reach is l + r and l - r (eqs. (14), (15) of
    paper 001)."""
    return xp.acos((h * h + b * b - reach * reach) / (2.0 * h * b))


def angle_at_bearing(xp: Any, h: Any, b: Any, reach: Any) -> Any:
    """Angle C-O1-Bd where Bd is `reach` away from O1."""
    return xp.acos((b * b + reach * reach - h * h) / (2.0 * b * reach))


def swing(xp: Any, r: Any, l: Any, h: Any, b: Any) -> Any:
    """The whole swing of the rocker, eta = psi_1 + psi_2 of paper 001."""
    return angle_at_pivot(xp, h, b, l + r) - angle_at_pivot(xp, h, b, l - r)


def pressure_angle(xp: Any, l: Any, h: Any, crank_pin_to_pivot_squared: Any) -> Any:
    """The signed pressure angle at Bd, from |AC|^2 (before eq. (11) of paper 001)."""
    return xp.asin((h * h + l * l - crank_pin_to_pivot_squared) / (2.0 * h * l))


def pressure_angle_extremes(xp: Any, r: Any, l: Any, h: Any, b: Any) -> tuple[Any, Any]:
    """The largest and the least pressure angle over the turn; at both, A lies on the line O1-C.

    Either may have the larger absolute value: the limit of eq. (10) of paper 001 holds for both.
    """
    near, far = b - r, b + r
    return pressure_angle(xp, l, h, near * near), pressure_angle(xp, l, h, far * far)


def speed_change(xp: Any, r: Any, l: Any, h: Any, b: Any) -> Any:
    """The speed-change coefficient K = (180 + theta)/(180 - theta): the ratio of the crank angles of the forward
    stroke (towards the far extreme) and the return stroke. theta is the angle between the couplers at the
    extremes."""
    theta = angle_at_bearing(xp, h, b, l + r) - angle_at_bearing(xp, h, b, l - r)
    return (math.pi + theta) / (math.pi - theta)


def rocker_extremes(xp: Any, p: Any) -> tuple[Any, Any]:
    """Largest and smallest rocker angle psi [rad], where crank and coupler lie on one line.

    Eqs. (14), (15) of paper 001, for any frame.
    """
    b, to_bearing = xp.sqrt(p.c * p.c + p.hy * p.hy), xp.atan2(p.c, p.hy)
    right, left = (angle_at_pivot(xp, p.h, b, reach) - to_bearing for reach in (p.l + p.r, p.l - p.r))
    return right, left


_NONE = 1e-100  # the square of no length; the root of 0 has no derivative
_FAR = 1e300  # larger than any length; the sign of a length times this number selects one of two limits


def half_width_range(xp: Any, e: Any, l1: Any, l2: Any, swing: Any, z: Any = math.inf) -> tuple[Any, Any]:
    """Least and largest half width [m] at which both organs close for every rocker angle within +-`swing` [rad]. Both
    ends are singular, except 0. The range is empty if the least half width is not below the largest.

    The distance of A2 from A1 must stay above |l1 - l2| and below l1 + l2; over the swing its square is within
    (z -+ e sin(swing))^2 + (e cos(swing))^2. If |l1 - l2| > e cos(swing), half widths about e sin(swing) are
    excluded: the range then is the part below or above them in which `z` lies. With l2 = l1 - e the range begins at
    2 e sin(swing).
    """
    reach = e * xp.sin(swing)
    drop2 = e * e - reach * reach
    short2 = (l1 - l2) * (l1 - l2) - drop2
    left_out = xp.sqrt(xp.maximum(short2, _NONE))
    whole = _FAR * xp.maximum(-short2, 0.0)
    low = reach + left_out - whole - _FAR * xp.maximum(reach - z, 0.0)
    high = reach - left_out + whole + _FAR * xp.maximum(z - reach, 0.0)
    longest = xp.sqrt(xp.maximum((l1 + l2) * (l1 + l2) - drop2, 0.0)) - reach
    return xp.maximum(low, 0.0), xp.minimum(high, longest)


TURNS = Requirement(
    "r", "m", "the crank cannot turn", ("l", "h", "b"), "|O1 C| must be > |l - h| and < l + h for any crank"
)


@dataclass(frozen=True)
class CrankRocker:
    """A crank-rocker whose crank turns.

    Raises
    ------
    GeometryError
        if the crank cannot turn, with the allowed range.
    """

    r: float
    l: float
    h: float
    b: float

    def __post_init__(self) -> None:
        for name in ("r", "l", "h", "b"):
            value = number_in("m", name, getattr(self, name), "a length of the crank-rocker")
            object.__setattr__(self, name, value)
            if not (math.isfinite(value) and value > 0.0):
                raise GeometryError(f"{name} = {value:g} m: must be finite, > 0 m")
        longest = longest_crank(MATH, self.l, self.h, self.b)
        if not self.r < longest:
            raise GeometryError(TURNS.refusal(self.r, 0.0, longest, vars(self)))

    @property
    def swing(self) -> float:
        """The whole swing of the rocker [rad]."""
        return float(swing(MATH, self.r, self.l, self.h, self.b))

    @property
    def pressure_angles(self) -> tuple[float, float]:
        """The largest and the least pressure angle over the turn [rad]."""
        return pressure_angle_extremes(MATH, self.r, self.l, self.h, self.b)

    @property
    def worst_pressure_angle(self) -> float:
        """The largest absolute pressure angle [rad]; the admissible limit is 45 to 60 degrees."""
        return max(map(abs, self.pressure_angles))

    @property
    def K(self) -> float:
        """The speed-change coefficient."""
        return float(speed_change(MATH, self.r, self.l, self.h, self.b))

    @classmethod
    def for_swing(cls, eta: float, lam: float, l: float = 1.0) -> CrankRocker:
        """The crank-rocker with K = 1 and the swing `eta` [rad], for a chosen lam = h/l.

        With K = 1 the extremes of the rocker's end are 2 r apart on a line through O1, so that r = h sin(eta/2). With
        the frame b^2 = l^2 - r^2 + h^2 the pressure angle then reaches arcsin(sin(eta/2) sqrt(1 + lam^2
        cos^2(eta/2))), equally to both sides. It falls with lam, towards eta/2: the least pressure angle belongs to
        the shortest rocker that can be built.

        Raises
        ------
        GeometryError
            for a swing outside 0 to 180 degrees, or a rocker so long that the pressure angle reaches 90 degrees.
        """
        eta, l = number_in("rad", "eta", eta, "swing"), number_in("m", "l", l, "coupler")
        lam = number_in("1", "lam", lam, "rocker by coupler")
        if not 0.0 < eta < math.pi:
            raise GeometryError(f"swing = {math.degrees(eta):g} deg: must be > 0 and < 180 deg")
        h = lam * l
        r = h * math.sin(0.5 * eta)
        if not r < l:
            raise GeometryError(
                f"lam = {lam:g}: for a swing of {math.degrees(eta):g} deg it must be "
                f"< {1.0 / math.sin(0.5 * eta):g}"
            )
        return cls(r, l, h, parallel_frame(MATH, r, l, h))
