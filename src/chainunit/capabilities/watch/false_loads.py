"""False loads that errors of the machine's parameters make in the load observer."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.engines import casadi_
from ...drives.gearing import felt_share
from ...machines.load_declarations import Inputs
from ...machines.load_filter import UNKNOWNS
from ...machines.load_observer import LoadObserver, balance

ANGLES = 360
"""Number of crank angles of a turn."""


@dataclass(frozen=True)
class FalseLoads:
    """What errors of parameters make of the loads of a machine that runs steadily: the `covariance` of the false
    loads in the order of `LOADS`, shape (5, 5), and the false loads per unit of each parameter, `by_parameter`."""

    covariance: Any
    by_parameter: Mapping[str, Any]

    @property
    def imbalance(self) -> float:
        """Standard deviation of the false imbalance of the feed [kg]: `imbalance.uncertainty` of the observer."""
        return self._deviation([1.0, -1.0, 0.0, 0.0, 0.0])

    @property
    def force_imbalance(self) -> float:
        """Standard deviation of the false imbalance of the forces [N]: `imbalance.force_uncertainty`."""
        return self._deviation([0.0, 0.0, 1.0, -1.0, 0.0])

    def _deviation(self, direction: list[float]) -> float:
        return math.sqrt(max(float(direction @ self.covariance @ direction), 0.0))


LOADS = UNKNOWNS[1:]
"""Feed left and right, force left and right, offset of the torque."""


def false_loads(
    p: Any,
    names: Sequence[str],
    covariance: Any,
    crank_speed: float,
    acceleration: Any = 0.0,
) -> FalseLoads:
    """The false loads that the observer estimates where its parameters are wrong.

    Over a turn at steady speed the observer lays the torque that an error of a parameter makes over the torques of
    the loads and of the offset, by least squares; both are exact derivatives.

    Parameters
    ----------
    p : parameters of `LoadObserver`
    names : numbers that are uncertain, by full name; one that the observer does not know counts as right
    covariance : of their errors, shape (names, names)
    crank_speed : mean speed of the crank [rad/s]
    acceleration : of the crank at `ANGLES` even angles of a turn from 0 [rad/s2], shape (ANGLES,), or one number
    """
    import casadi

    layout = LoadObserver.parameter_layout
    places = [k for k, name in enumerate(names) if name in layout.names]
    names, sigma = [names[k] for k in places], np.asarray(covariance, float)[np.ix_(places, places)]
    symbols, phi, a = casadi.SX.sym("p", len(names)), casadi.SX.sym("phi"), casadi.SX.sym("a")
    parameters = layout.from_names(dict(zip(names, casadi.vertsplit(symbols), strict=True)), p)
    u = Inputs(phi=phi, w=crank_speed * p.ratio)
    assert LoadObserver.state_layout is not None
    start = LoadObserver.start(casadi_(), p, u)
    free = balance(casadi_(), p, u, start)
    # with this offset the right machine has the acceleration; the gear may pass a torque of the other sign then
    passed = (free.machine.bias + free.machine.J * a) / p.ratio
    other = free.felt - felt_share(casadi_(), p.gear.loss, passed, u.w)
    offset = free.inertia * (free.acceleration - a * p.ratio) + other * passed
    b = balance(
        casadi_(), parameters, u, LoadObserver.state_layout.from_names({"torque_offset": offset}, start)
    )
    # the torque that is missing at this acceleration, and its derivatives by the loads
    missing = b.inertia * (b.acceleration - a * p.ratio)
    rows = casadi.horzcat(*(b.inertia * g for g in b.gradient[1:]), casadi.jacobian(missing, symbols))
    function = casadi.Function("rows", [symbols, phi, a], [rows])
    values, turn = layout.by_name(p), np.arange(ANGLES) * (2.0 * math.pi / ANGLES)
    accelerations = np.broadcast_to(np.asarray(acceleration, float), (1, ANGLES))
    numbers = np.outer([values[name] for name in names], np.ones(ANGLES))
    table = np.array(function.map(ANGLES)(numbers, turn[None] * p.ratio, accelerations)).reshape(ANGLES, -1)
    loads, errors = table[:, : len(LOADS)], table[:, len(LOADS) :]
    # the observer's machine has the error, the loads make up for it
    answer = -np.linalg.lstsq(loads, errors, rcond=None)[0]
    return FalseLoads(answer @ sigma @ answer.T, dict(zip(names, answer.T, strict=True)))
