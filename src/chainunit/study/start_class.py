"""The class of a start: the overload relay that surely holds during it."""

from __future__ import annotations

from typing import Any

import numpy as np

CLASSES = ((10, 4.0), (20, 6.0), (30, 9.0))
"""Trip classes of IEC 60947-4-1, each with the shortest time [s] after which a cold relay of the class may trip at
7.2 times its setting."""
MULTIPLE = 7.2
HEAVIER = 40
"""The class of a start during which a relay of class 30 may trip."""


def start_class(time: Any, current: Any, rated: float) -> int:
    """The least trip class whose relay, cold and set to the `rated` current [A], surely holds during a start.

    The heat of the start is that of the square of the RMS `current` [A] over `time` [s], both of shape (n,). The
    relay's cooling is left out, which is on the safe side.
    """
    heat = float(np.trapezoid(np.square(np.asarray(current) / rated), np.asarray(time)))
    return next((name for name, shortest in CLASSES if heat <= shortest * MULTIPLE**2), HEAVIER)
