"""A machine with one crank as the motor sees it: inertia and torque at a point, and the port with the gear between.

q is the crank angle, `w`, `a` its derivatives; at the port `phi w a tau J` are the motor's, ``p.ratio`` turns for
one of the crank. A machine gives its mechanism and its bias - the torque at constant crank speed, with its parts -
as classes.
"""

from __future__ import annotations

from typing import Any, ClassVar

from ..engines import Dual, dual, slope
from ..ports import PortSlopes


class DrivenState:
    """The machine at one point: mechanism `m`, inertia `J` with its derivative `dJ`, and torque at constant speed,
    ``bias.total`` [N m]."""

    __slots__ = ("J", "bias", "dJ", "m", "w")

    mechanism_of: ClassVar[Any]
    """Called with xp, p, u, q; has ``inertia()``."""
    bias_of: ClassVar[Any]
    """Called with xp, p, u, m, dJ, w; has ``total``."""

    def __init__(self, xp: Any, p: Any, u: Any, q: Any, w: Any) -> None:
        self.w = w
        self.m = self.mechanism_of(xp, p, u, q)
        self.J, self.dJ = self.m.inertia()
        self.bias = self.bias_of(xp, p, u, self.m, self.dJ, w)

    def torque(self, a: Any) -> Any:
        """The crank torque at crank acceleration `a` [N m]."""
        return self.J * a + self.bias.total

    def port(self, p: Any, u: Any) -> dict[str, Any]:
        """The fields of `PortValues`, at the motor."""
        return {
            "tau_bias": self.bias.total / p.ratio,
            "J": self.J / (p.ratio * p.ratio),
            "dJ_dphi": self.dJ / (p.ratio * p.ratio * p.ratio),
            "phi0": u.phi,
            "w0": u.w,
        }


def slopes(xp: Any, p: Any, u: Any, x: Any, s: DrivenState) -> PortSlopes:
    """The slopes of the port, exact by dual numbers."""
    # by the speed, only the force pass varies: the mechanism of the point is used again
    by_w = s.bias_of(dual(xp), p, u, s.m, s.dJ, Dual(s.w, 1.0)).total
    by_q = type(s)(dual(xp), p, u, Dual(u.phi / p.ratio, 1.0), s.w).bias.total
    per_motor_turn = 1.0 / (p.ratio * p.ratio)
    return PortSlopes(tau_bias_dphi=slope(by_q) * per_motor_turn, tau_bias_dw=slope(by_w) * per_motor_turn)
