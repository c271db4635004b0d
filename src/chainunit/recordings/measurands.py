"""The quantities that a recording may have."""

from __future__ import annotations

from dataclasses import dataclass

COUNTS = 4096
"""Counts of the encoder in a turn of the motor: 1024 lines with four edges each."""


@dataclass(frozen=True)
class Measurand:
    """A measured quantity: its name in the head of a column, its unit, and a description. An `analog` one has noise
    and a scale; the others are counted."""

    name: str
    unit: str
    description: str
    analog: bool = True


_ALL = (
    Measurand("time", "s", "time of the row by the clock of the logger", analog=False),
    # of the armature, or RMS of a phase of an induction motor
    Measurand("motor.i", "A", "current"),
    Measurand("motor.u", "V", "voltage of the armature"),
    Measurand("motor.power", "W", "active power at the terminals of the motor"),
    Measurand("motor.w", "rad/s", "speed of the motor's shaft"),
    Measurand("motor.count", "1", "count of an encoder on the motor's shaft", analog=False),
    Measurand("crank.tau", "N.m", "torque in the shaft between gear and crank"),
    Measurand("crank.w", "rad/s", "speed of the crank"),
    Measurand("mark", "1", "1 in the first row after the crank passed the mark, else 0", analog=False),
)
MEASURANDS = {measurand.name: measurand for measurand in _ALL}
"""By name."""
PHASES = ("motor.ia", "motor.ib", "motor.ic")
"""Instantaneous currents of the phases, of which a reader forms `motor.i`."""
COLUMNS = MEASURANDS | {
    name: Measurand(name, "A", f"instantaneous current of phase {name[-1]}") for name in PHASES
}
"""By name, the quantities that a file may have."""
OF_TERMINALS = ("motor.i", "motor.u", "motor.power")
"""Signals at the terminals of the motor."""
SIGNALS = (*OF_TERMINALS, "crank.tau")
"""Quantities that depend on the torque: a recording must have one."""
OFFSET_SHARE = 0.05
"""Standard deviation of the offset of a sensor of current or torque without another knowledge, in parts of the RMS of
its column."""


def usual_offset(name: str, size: float) -> float:
    """Standard deviation of the usual offset of a sensor whose column has the RMS `size`; 0 for most quantities."""
    return OFFSET_SHARE * size if name in ("motor.i", "crank.tau") else 0.0
