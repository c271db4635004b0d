"""The crank-rocker as a tool: does it turn, how far does it swing, how well does it push, how even is its return.

`r` crank, `l` coupler, `h` rocker, `b` frame O1-C; ``rho = r/l``, ``lam = h/l`` (paper 001). Angles in radians.
`b` is free: the papers' frame, with crank and rocker parallel at the start, has b^2 = l^2 - r^2 + h^2
(`parallel_frame`). It is the frame in which both strokes take the same time, for any rho and lam: at the
extremes the rocker's end lies at l + r and l - r from O1 on its circle about C, and b^2 - h^2 = (l + r)(l - r)
says that these two points lie on one line through O1 (the power of the point O1). The crank then turns by half
a revolution between them, and K = 1.

Functions take floats, and those with an `xp` any engine's values.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ..engines import MATH
from ..errors import GeometryError
from ..model import Requirement


def longest_crank(xp: Any, l: Any, h: Any, b: Any) -> Any:
    """The crank turns where r is less than this [m].

    Eqs. (3), (4) of paper 001, and the third condition that it misses for h > l: b - r > h - l.
    """
    return xp.minimum(l + h - b, b - xp.abs(l - h))


def parallel_frame(xp: Any, r: Any, l: Any, h: Any) -> Any:
    """The frame length of the papers: crank and rocker parallel at the start, and K = 1."""
    return xp.sqrt(l * l - r * r + h * h)


def angle_at_pivot(xp: Any, h: Any, b: Any, reach: Any) -> Any:
    """Angle O1-C-Bd where Bd is `reach` away from O1; at the extremes reach = l + r and l - r (eqs. (14), (15))."""
    return xp.acos((h * h + b * b - reach * reach) / (2.0 * h * b))


def angle_at_bearing(xp: Any, h: Any, b: Any, reach: Any) -> Any:
    """Angle C-O1-Bd where Bd is `reach` away from O1."""
    return xp.acos((b * b + reach * reach - h * h) / (2.0 * b * reach))


def swing(xp: Any, r: Any, l: Any, h: Any, b: Any) -> Any:
    """The rocker's whole swing, eta = psi_1 + psi_2 of paper 001."""
    return angle_at_pivot(xp, h, b, l + r) - angle_at_pivot(xp, h, b, l - r)


def pressure_angle(xp: Any, l: Any, h: Any, crank_pin_to_pivot_squared: Any) -> Any:
    """The pressure angle at Bd, signed, where |AC|^2 is given (before eq. (11) of paper 001)."""
    return xp.asin((h * h + l * l - crank_pin_to_pivot_squared) / (2.0 * h * l))


def pressure_angle_extremes(xp: Any, r: Any, l: Any, h: Any, b: Any) -> tuple[Any, Any]:
    """The largest and the least pressure angle over the turn, where A lies on the line O1-C.

    Either may be the larger in size: the limit of eq. (10) of paper 001 holds for both.
    """
    near, far = b - r, b + r
    return pressure_angle(xp, l, h, near * near), pressure_angle(xp, l, h, far * far)


def speed_change(xp: Any, r: Any, l: Any, h: Any, b: Any) -> Any:
    """The speed-change coefficient K = (180 + theta)/(180 - theta): crank angle of the forward stroke
    (towards the far extreme) to that of the return; theta is the angle between the extreme couplers."""
    theta = angle_at_bearing(xp, h, b, l + r) - angle_at_bearing(xp, h, b, l - r)
    return (math.pi + theta) / (math.pi - theta)


def rocker_extremes(xp: Any, p: Any) -> tuple[Any, Any]:
    """Largest and smallest rocker angle psi [rad], where crank and coupler lie on one line.

    Eqs. (14), (15) of paper 001, for any frame.
    """
    b, to_bearing = xp.sqrt(p.c * p.c + p.hy * p.hy), xp.atan2(p.c, p.hy)
    right, left = (angle_at_pivot(xp, p.h, b, reach) - to_bearing for reach in (p.l + p.r, p.l - p.r))
    return right, left


_FAR = 1e300  # more than any length; times a length of either sign it picks one of two limits


def half_width_range(xp: Any, e: Any, l1: Any, l2: Any, swing: Any, z: Any = math.inf) -> tuple[Any, Any]:
    """Least and largest half width [m] at which both organs close wherever the rocker stands within +-`swing` [rad];
    both ends are singular, but for 0. Empty where the least is not below the largest.

    The distance of A2 from A1 must stay above |l1 - l2| and below l1 + l2; over the swing its square is within
    (z -+ e sin(swing))^2 + (e cos(swing))^2. Above e cos(swing), |l1 - l2| leaves out half widths about e sin(swing):
    then it is the range on the side of these on which `z` lies. With l2 = l1 - e the range begins at 2 e sin(swing).
    """
    reach = e * xp.sin(swing)
    drop2 = e * e - reach * reach
    short2 = (l1 - l2) * (l1 - l2) - drop2
    left_out = xp.sqrt(xp.maximum(short2, 0.0))
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
    """A crank-rocker that turns.

    Raises
    ------
    GeometryError
        where it does not, with the allowed range.
    """

    r: float
    l: float
    h: float
    b: float

    def __post_init__(self) -> None:
        for name in ("r", "l", "h", "b"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise GeometryError(f"{name} = {value:g} m: must be finite, > 0 m")
        longest = longest_crank(MATH, self.l, self.h, self.b)
        if not self.r < longest:
            raise GeometryError(TURNS.refusal(self.r, 0.0, longest, vars(self)))

    @property
    def swing(self) -> float:
        """The rocker's whole swing [rad]."""
        return float(swing(MATH, self.r, self.l, self.h, self.b))

    @property
    def pressure_angles(self) -> tuple[float, float]:
        """The largest and the least pressure angle over the turn [rad]."""
        return pressure_angle_extremes(MATH, self.r, self.l, self.h, self.b)

    @property
    def worst_pressure_angle(self) -> float:
        """The largest pressure angle in size [rad]; admissible is 45 to 60 degrees."""
        return max(map(abs, self.pressure_angles))

    @property
    def K(self) -> float:
        """The speed-change coefficient."""
        return float(speed_change(MATH, self.r, self.l, self.h, self.b))

    @classmethod
    def for_swing(cls, wanted: float, lam: float, l: float = 1.0) -> CrankRocker:
        """The crank-rocker with K = 1 and the swing `wanted` [rad], for a chosen lam = h/l.

        With K = 1 the extremes of the rocker's end are 2 r apart on a line through O1, so that
        r = h sin(eta/2); in its own frame b^2 = l^2 - r^2 + h^2 the pressure angle then reaches
        arcsin(sin(eta/2) sqrt(1 + lam^2 cos^2(eta/2))), to both sides alike. It falls with lam, towards eta/2:
        the least pressure angle belongs to the shortest rocker that can be built.

        Raises
        ------
        GeometryError
            for a swing outside 0 to 180 degrees, or a rocker so long that the pressure angle reaches 90 degrees.
        """
        if not 0.0 < wanted < math.pi:
            raise GeometryError(f"swing = {math.degrees(wanted):g} deg: must be > 0 and < 180 deg")
        h = lam * l
        r = h * math.sin(0.5 * wanted)
        if not r < l:
            raise GeometryError(
                f"lam = {lam:g}: for a swing of {math.degrees(wanted):g} deg it must be "
                f"< {1.0 / math.sin(0.5 * wanted):g}"
            )
        return cls(r, l, h, parallel_frame(MATH, r, l, h))


def longest_rocker(wanted: float, admissible: float) -> float:
    """The largest lam = h/l at which a crank-rocker with K = 1 and the swing `wanted` keeps its pressure angle
    within `admissible` [rad]; 0 where none does (the pressure angle is never below half the swing)."""
    s, c = math.sin(0.5 * wanted), math.cos(0.5 * wanted)
    return math.sqrt(max((math.sin(admissible) / s) ** 2 - 1.0, 0.0)) / c
