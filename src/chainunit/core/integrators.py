"""The internal integrators of models with states in a co-simulation FMU, and the tolerances of times there. C and
JavaScript have the same methods (``core/printing/step.h`` for FMUs and lanes, ``steps.js``); their numbers are
generated from these. ``tests/test_steps.py`` compares the accepted steps.

`rk4`, the classical Runge-Kutta method with equal steps: its cost is known beforehand, it needs no error control
that could give up in the middle of a step, and with steps well below the model's shortest time constant its
error (fourth order) is far smaller than the error of the coupling (second order).

`controlled`, the pair of Dormand and Prince of orders 5 and 4 with control of the error: for a model that is slow
most of the time and now and then jerks. Python FMUs carry this file.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

MAX_STEPS = "solver.max_steps"
"""Full name of the parameter `chainunit.core.ports.Solver.max_steps`."""


SAME_TIME, ROUNDED, ADDED_UP = 1e-9, 4.0 * 2.0**-52, 1e6 * 2.0**-53
"""Tolerances of a time. The first is relative to the step or the experiment; the others allow for rounding
and are relative to the time itself. A communication point, which the FMU takes over from the host, is rounded
by some units in the last place. A stop time that the host adds up from its steps is rounded by half a unit
for each of a million steps."""


class BudgetError(ArithmeticError):
    """A communication step takes more than `most` steps of the integrator."""

    def __init__(self, most: float) -> None:
        super().__init__(f"takes more than {most:g} steps")
        self.most = most


RK4_NODES = (0.0, 0.5, 0.5, 1.0)
RK4_WEIGHTS = (1 / 6, 2 / 6, 2 / 6, 1 / 6)


def rk4(
    rates: Callable[[float, Sequence[float]], Sequence[float]],
    x: Sequence[float],
    step: float,
    longest: float,
    most: float = math.inf,
) -> list[float]:
    """The states after `step` [s], by equal substeps of at most `longest` [s]. `rates` gives the derivatives
    of the states; its arguments are the time since the start of the step, and the states at that time.

    Raises
    ------
    BudgetError
        if the step takes more than `most` substeps; it is raised before the first one.
    """
    count = step / longest - 1e-9
    if count > most:
        raise BudgetError(most)
    n = max(1, math.ceil(count))
    h = step / n
    now = list(x)
    for s in range(n):
        k: Sequence[float] = [0.0] * len(now)
        later = now
        for node, weight in zip(RK4_NODES, RK4_WEIGHTS, strict=True):
            k = rates((s + node) * h, [v + node * h * r for v, r in zip(now, k, strict=True)])
            later = [v + weight * h * r for v, r in zip(later, k, strict=True)]
        now = later
    return now


NODES = (0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0)
STAGES: tuple[tuple[float, ...], ...] = (
    (),
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
    (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
)
"""Coefficients of Dormand and Prince, J. Comp. Appl. Math. 6 (1980) 19; the last stage is the solution of order 5."""
ERRORS = (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)
"""Weights of the stages in the error of that solution."""
SHORTEST = 1e-6
"""Shortest substep over the longest: such a step is accepted whatever its error, as a snatch must not stop a
run."""
FIRST = 0.01
"""First substep over the longest, if no earlier substep is known."""
SAFETY, ERROR_POWER = 0.9, -0.2
"""The next substep is chosen so that its error should be the share `SAFETY` of the permitted one."""
LEAST_GROWTH, MOST_GROWTH = 0.2, 5.0
"""Limits of the ratio of a substep to the one before."""
NO_ERROR = 1e-4
"""Error over the permitted error below which the next substep grows by `MOST_GROWTH`."""
DENSE = (
    (1.0, -8048581381 / 2820520608, 8663915743 / 2820520608, -12715105075 / 11282082432),
    (0.0, 0.0, 0.0, 0.0),
    (0.0, 131558114200 / 32700410799, -68118460800 / 10900136933, 87487479700 / 32700410799),
    (0.0, -1754552775 / 470086768, 14199869525 / 1410260304, -10690763975 / 1880347072),
    (0.0, 127303824393 / 49829197408, -318862633887 / 49829197408, 701980252875 / 199316789632),
    (0.0, -282668133 / 205662961, 2019193451 / 616988883, -1453857185 / 822651844),
    (0.0, 40617522 / 29380423, -110615467 / 29380423, 69997945 / 29380423),
)
"""Dense output of fourth order, L. F. Shampine, Math. Comp. 46 (1986) 135: after the share z of a substep h the
state has changed by the sum of the stages with the weights h*(D1*z + D2*z^2 + D3*z^3 + D4*z^4), a row for each."""


def controlled(
    rates: Callable[[float, Sequence[float]], Sequence[float]],
    close: Callable[[float, Sequence[float]], Sequence[float]],
    x: Sequence[float],
    step: float,
    pace: float,
    longest: float,
    tolerance: float,
    nominal: Sequence[float],
    most: float = math.inf,
) -> tuple[list[float], float]:
    """The states after `step` [s], and the next substep [s] that the error allows.

    Parameters
    ----------
    rates : gives the derivatives of the states, from the time since the start of the step and the states at that time
    close : gives states near its argument that meet the model's constraints at that time; called after each substep
    pace, longest : first substep, 0 if none is known, and longest substep [s]
    tolerance, nominal : permitted error of a substep, relative to each state or to its nominal size

    Raises
    ------
    ArithmeticError
        if the states are not finite even after the shortest substep.
    BudgetError
        if the step takes more than `most` substeps.
    """
    now, since, steps, pace = list(x), 0.0, 0, pace or FIRST * longest
    while since < step:
        steps += 1
        if steps > most:
            raise BudgetError(most)
        left = step - since
        h = left if pace >= left else 0.5 * left if pace > 0.5 * left else pace
        k: list[Sequence[float]] = []
        point: list[float] = now
        error = 0.0
        try:
            for node, weights in zip(NODES, STAGES, strict=True):
                point = [
                    v + h * sum(a * r[i] for a, r in zip(weights, k, strict=True)) for i, v in enumerate(now)
                ]
                k.append(rates(since + h * node, point))
            usable = all(map(math.isfinite, (*point, *k[-1])))
        except (ArithmeticError, ValueError):
            usable = False
        for i, (v, after, size) in enumerate(zip(now, point, nominal, strict=True) if usable else ()):
            deviation = abs(h * sum(e * r[i] for e, r in zip(ERRORS, k, strict=True)))
            error = max(error, deviation / (tolerance * max(abs(v), abs(after), size)))
        last_resort = h <= SHORTEST * longest
        if not usable and last_resort:
            raise ArithmeticError("the states left all bounds")
        if usable and (error <= 1.0 or last_resort):
            since = step if h >= left else since + h
            now = list(close(since, point))
        growth = MOST_GROWTH if error < NO_ERROR else SAFETY * error**ERROR_POWER
        following = h * (min(max(growth, LEAST_GROWTH), MOST_GROWTH) if usable else LEAST_GROWTH)
        if usable and error <= 1.0 and h < pace:
            following = max(following, pace)
        pace = min(max(following, SHORTEST * longest), longest)
    return now, pace
