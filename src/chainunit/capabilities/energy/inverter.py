"""Losses of an inverter (complete drive module) between the eight operating points of IEC 61800-9-2.

The eight points are pairs of relative motor frequency and relative torque-producing current. The loss at (90; 100)
of the reference drive is that by which the regulation EU 2019/1781 defines the classes of drives (IE1: within 25 % of
it, IE2: less). Its distribution over the other seven points is typical of inverters with a diode bridge: a constant
part for the electronics, conduction that grows with the current, switching and the bridge, which grow with the power.
A drive on the market has to be IE2: its losses are smaller than the losses of the reference drive by a quarter or
more. This quarter is taken off here. The data sheet of its maker has the eight values.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...core.quantities import Value, declaration, percentage

POINTS = ((0.0, 0.25), (0.0, 0.5), (0.0, 1.0), (0.5, 0.25), (0.5, 0.5), (0.5, 1.0), (0.9, 0.5), (0.9, 1.0))
"""Operating points: frequency over the rated one, torque-producing current over the rated one."""
_SHAPE = (0.52, 0.60, 0.85, 0.54, 0.63, 0.91, 0.68, 1.0)
"""Typical losses at `POINTS` over that at (90; 100)."""
_REFERENCE = (
    (0.12, 0.278, 0.100), (0.18, 0.381, 0.104), (0.25, 0.500, 0.109), (0.37, 0.697, 0.117), (0.55, 0.977, 0.129),
    (0.75, 1.29, 0.142), (1.1, 1.71, 0.163), (1.5, 2.29, 0.188), (2.2, 3.3, 0.237), (3.0, 4.44, 0.299),
    (4.0, 5.44, 0.374), (5.5, 7.45, 0.477), (7.5, 9.95, 0.581), (11.0, 14.4, 0.781), (15.0, 19.5, 1.01),
    (18.5, 23.9, 1.21), (22.0, 28.3, 1.41), (30.0, 38.2, 1.86), (37.0, 47.0, 2.25), (45.0, 56.9, 2.70),
    (55.0, 68.4, 3.24), (75.0, 92.8, 4.35), (90.0, 111.0, 5.17), (110.0, 135.0, 5.55), (132.0, 162.0, 6.65),
    (160.0, 196.0, 8.02), (200.0, 245.0, 10.0),
)  # fmt: skip
"""Rated power of the motor [kW], apparent power [kVA] and loss at (90; 100) [kW] of the reference drive, by size."""

IE2 = 0.75
"""Loss at (90; 100) up to which a drive is of class IE2, over that of the reference drive (EU 2019/1781)."""


@declaration
class InverterTable:
    """A loss of an inverter at one operating point."""

    loss: Value = percentage("loss over the rated apparent power", min=0.0, max=1.0)


def apparent_power(motor_power: float) -> float:
    """Apparent power [VA] of the reference drive for a motor of that rated power [W]; between two sizes by the
    logarithms of both, beyond the sizes in proportion."""
    return _by_size(motor_power, 1)


def typical_losses(motor_power: float) -> tuple[float, ...]:
    """Largest losses of a drive of class IE2 at `POINTS` [W], for a motor of that rated power [W]."""
    return tuple(IE2 * share * _by_size(motor_power, 2) for share in _SHAPE)


def _by_size(motor_power: float, column: int) -> float:
    """The value of a column of the reference table for a motor of this power [W]; beyond the table in proportion."""
    sizes, values = (np.array([row[k] for row in _REFERENCE]) for k in (0, column))
    kW = 1e-3 * motor_power
    tabled_kW = min(max(kW, float(sizes[0])), float(sizes[-1]))
    power = math.exp(float(np.interp(math.log(tabled_kW), np.log(sizes), np.log(values))))
    return 1e3 * power * (kW / tabled_kW)


def loss(losses: tuple[float, ...], frequency: Any, current: Any) -> Any:
    """The loss at any operating point, by linear interpolation in both quantities between the losses at `POINTS`.

    The point (90; 25), which the standard does not ask for, is on the plane through its three neighbours. Beyond the
    outer points the loss is that at the nearest frequency and current on the border.

    Parameters
    ----------
    losses : at `POINTS`, in one unit
    frequency, current : relative to the rated ones, as in `POINTS`, shape (n,)

    Returns
    -------
    The loss in the unit of `losses`, shape (n,).
    """
    a = dict(zip(POINTS, losses, strict=True))
    a[0.9, 0.25] = a[0.5, 0.25] + a[0.9, 0.5] - a[0.5, 0.5]
    fs, currents = np.array([0.0, 0.5, 0.9]), np.array([0.25, 0.5, 1.0])
    grid = np.array([[a[f, i] for i in currents.tolist()] for f in fs.tolist()])
    j, x = _cell(fs, np.abs(frequency))
    k, y = _cell(currents, np.abs(current))
    low = (1.0 - y) * grid[j, k] + y * grid[j, k + 1]
    high = (1.0 - y) * grid[j + 1, k] + y * grid[j + 1, k + 1]
    return (1.0 - x) * low + x * high


def _cell(places: Any, place: Any) -> tuple[Any, Any]:
    """Index of the place below, and the share of the way to the next."""
    place = np.clip(np.asarray(place, dtype=float), places[0], places[-1])
    k = np.clip(np.searchsorted(places, place, side="right") - 1, 0, len(places) - 2)
    return k, (place - places[k]) / (places[k + 1] - places[k])
