"""A start in star: its times, the signals of contactor and connection, and the current of the windings."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..drives.contactor import CONTACTOR_EDGE
from ..system import Profile


@dataclass(frozen=True)
class StarStart:
    """A start from rest with a `time` in star and a `pause` before delta [s]; another start has no time in star."""

    time: float = 0.0
    pause: float = 0.0

    def __bool__(self) -> bool:
        return self.time > 0.0

    @property
    def end(self) -> float:
        """Time from which the motor is in delta [s]; 0 without star."""
        return self.time + self.pause + CONTACTOR_EDGE if self else 0.0

    def winding_current(self, time: Any, current: Any) -> Any:
        """The current of the windings [A], times sqrt(3), for the `current` of the line [A] over the `time` of a run
        from rest [s], all of shape (n,): in star the whole current of the line is in the windings, in delta 1/sqrt(3)
        of it. A relay in the phases of the delta is set by it; see `chainunit.study.relay`."""
        if not self:
            return current
        return current * np.where(time < self.time + 0.5 * self.pause, math.sqrt(3.0), 1.0)

    def signals(self) -> dict[str, Any]:
        """The signals of the contactor and of the connection in a start from rest."""
        if not self:
            return {}
        opens, closes = (self.time, CONTACTOR_EDGE, 0.0), (self.time + self.pause, CONTACTOR_EDGE, 1.0)
        # the connection changes while no current flows
        changes = (self.time + 0.75 * self.pause, 0.2 * self.pause, 0.0)
        return {"motor.contactor": Profile(1.0, (opens, closes)), "motor.star": Profile(1.0, (changes,))}


NO_STAR = StarStart()
