"""The shaft of the flywheel of a drive: the motor's, that behind a part of the line, or the machine's. Its inertia
stands there for all that uses it: in the rotor, or as a part of the line."""

from __future__ import annotations

from dataclasses import dataclass

from ...drives.flywheel import Flywheel
from .placed import Line, PlacedPart

MOTOR, MACHINE = "motor", "machine"
"""The places that every drive has; the others are the names of the parts of its line."""


@dataclass(frozen=True)
class FlywheelShaft:
    """The shaft of a flywheel."""

    place: str = MOTOR
    """`MOTOR`, `MACHINE`, or the part of the line on whose driven shaft it sits"""
    turns: float = 1.0
    """turns of the flywheel per turn of the crank, in place of 1, if it sits on a faster shaft of the machine"""

    @property
    def is_motor(self) -> bool:
        """Whether it is the motor's shaft."""
        return self.place == MOTOR

    def words(self, driver: str) -> str:
        """The shaft in words, of a machine with this noun for its driver."""
        if self.place == MACHINE and self.turns != 1.0:
            return f"shaft of the machine that turns {self.turns:g} times as fast as the {driver}"
        if self.place in (MOTOR, MACHINE):
            return f"{self.place} shaft"
        return f"shaft behind the {self.place.replace('_', ' ')}"

    def ratio(self, line: Line, ratio: float) -> float:
        """Turns of the motor per turn of the flywheel, in a drive with that `line` and `ratio`."""
        if self.is_motor:
            return 1.0
        if self.place == MACHINE:
            return ratio / self.turns
        return line.up_to(self.place).ratio

    def mounted(self, line: Line, ratio: float, J: float) -> Line:
        """The `line` with a flywheel of the inertia `J` [kg m2], in a drive of that `ratio`; the line itself for a
        flywheel on the motor's shaft."""
        if self.is_motor:
            return line
        if self.place == MACHINE:
            return line.behind(_placed(ratio / line.ratio, J, self.turns))
        *before, part = line.up_to(self.place)
        _, behind = line.around(self.place)
        if part.slips:
            return Line((*before, part.with_inertia(J), *behind))
        return Line((*before, part, _placed(1.0, J, 1.0), *behind))


ON_MOTOR = FlywheelShaft()


def _placed(ratio: float, J: float, turns: float) -> PlacedPart:
    p = Flywheel.Parameters(ratio=ratio, J_wheel=J, turns=turns)
    return PlacedPart("flywheel", Flywheel, p, ratio, J * turns**2)
