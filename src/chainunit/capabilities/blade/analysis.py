"""The blade of a knife drive over a turn at constant speed: its path and tilt, and the work of a cut.

The mechanics are in `machines.knife_drive`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.errors import InputError
from ...core.quantities import Value, declaration, quantity
from ...machines.knife_drive import Stack
from ...reading.results import derived, part, result
from ...reading.text import number
from ...study.analysis import Analysis, Findings, Work
from ...study.cycle import Cycle, cycle
from ...study.operation import OperatingConditions
from ...study.record import StudyRecord
from ...study.remark import fault, note, warning
from ...study.turn import EVERY, POINTS


@declaration
class Cutting:
    """The blade over a turn of the crank at constant speed, with the cut of normal running."""

    blade_top: Value = quantity("m", "blade, highest y", kind="millimetres")
    blade_bottom: Value = quantity("m", "blade, lowest y", kind="millimetres")
    blade_draw: Value = quantity("m", "blade, way along x in the stack", kind="millimetres")
    tilt_least: Value = quantity("rad", "tilt of the blade, least")
    tilt_largest: Value = quantity("rad", "tilt of the blade, largest")
    speed_in_stack: Value = quantity("m/s", "speed of the blade in the stack, largest")
    cut_work: Value = quantity("J", "work of a cut")
    cut_path: Value = quantity("m", "path of the blade through the stack", kind="millimetres")
    cut_work_by_path: Value = quantity("J", "force times path through the stack")
    losses: Value = quantity("J", "losses of the pins in a turn, cutting")


@result
class BladeCourse:
    """Position and tilt of the blade over a turn."""

    angle: Any = quantity("rad", "crank angle")
    x: Any = quantity("m", "middle of the cutting edge, x")
    y: Any = quantity("m", "middle of the cutting edge, y")
    tilt: Any = quantity("rad", "tilt of the blade")


@result
class BladeFindings(Findings):
    """The turn with the cut, and its numbers; position and tilt of the blade are arrays over the crank
    angle."""

    turn: Cycle
    stack: Stack
    numbers: Cutting = part(inline=True)

    @property
    def blade(self) -> Any:
        """Position `x` and `y` [m] of the middle of the cutting edge, and `tilt` [rad], each of shape
        (POINTS,)."""
        return self.turn.outputs.blade

    @property
    def top(self) -> float:
        """Crank angle at which the blade is highest [rad]."""
        return float(self.turn.angle[np.argmax(self.blade.y)])

    @derived()
    def over_turn(self) -> BladeCourse:
        """The course over the turn."""
        curves = (self.turn.angle, self.blade.x, self.blade.y, self.blade.tilt)
        return BladeCourse(*(x[::EVERY] for x in curves))

    def remark(self, study: StudyRecord) -> None:
        """Warn where the blade does not pass through the whole stack; note the assumptions behind the work of
        a cut."""
        n = self.numbers
        top, table = (float(x) for x in (self.stack.top, self.stack.table))
        low, high = _height(n.blade_bottom), _height(n.blade_top)
        if n.blade_bottom > top:
            study.findings.say(_NO_CUT, low=low, high=_height(top), blade_bottom=n.blade_bottom)
        elif n.blade_bottom > table:
            study.findings.say(_TABLE_NOT_REACHED, low=low, high=_height(table), blade_bottom=n.blade_bottom)
        if n.blade_top < top:
            study.findings.say(_STACK_NOT_LEFT, high=high, low=_height(top), blade_top=n.blade_top)
        if n.cut_path > 0.0:
            study.findings.say(_WORK_OF_A_CUT, cut_work=n.cut_work, cut_work_by_path=n.cut_work_by_path)


_BOTTOM = ("m", "millimetres")
_NO_CUT = fault(
    "no-cut",
    "No cut takes place, as the blade comes down to y = {low} and the stack's top is at {high}.",
    sizes={_BOTTOM: "blade_bottom"},
)
_TABLE_NOT_REACHED = warning(
    "table-not-reached",
    "The blade does not reach the table, as it comes down to y = {low} and the table is at {high}.",
    sizes={_BOTTOM: "blade_bottom"},
)
_STACK_NOT_LEFT = warning(
    "stack-not-left",
    "The blade does not leave the stack, as it rises to y = {high} and the stack's top is at {low}.",
    sizes={_BOTTOM: "blade_top"},
)
_WORK_OF_A_CUT = note(
    "work-of-a-cut",
    "The work of a cut is {cut_work}, and force times path through the stack is {cut_work_by_path}. The resistance "
    "rises and falls over stack.edge, and fades below stack.v_smooth.",
    sizes={"J": "cut_work cut_work_by_path"},
)


def _height(y: float) -> str:
    return number(y, "m", "millimetres", 4)


class BladeAnalysis(Analysis):
    """The blade of a knife drive."""

    name = "blade"
    applies = staticmethod(lambda drive, plans: drive.machine.model.cuts)

    @staticmethod
    def find(study: StudyRecord, work: Work) -> BladeFindings:
        """The turn at the crank speed of the study.

        Raises
        ------
        InputError
            for a stack whose top is not above the table.
        """
        config, machine = study.setup.config, study.setup.drive.machine
        stack = machine.p.stack
        if not stack.top > stack.table:
            raise InputError(
                f"machine.stack.top = {stack.top:g} m: must be > {stack.table:g} m, the height of the table"
            )
        turn = cycle(machine, config.run.crank_speed, config.feed, POINTS)
        return BladeFindings(turn, stack, _cutting(turn, stack, config.operation))


def _cutting(turn: Cycle, stack: Stack, operation: OperatingConditions) -> Cutting:
    """The numbers of a turn of the crank. The path of the blade is closed, a piece from each sample to the next; of a
    piece counts the share that is in the stack."""
    blade, turn_time = turn.outputs.blade, operation.turn
    dx, dy = np.roll(blade.x, -1) - blade.x, np.roll(blade.y, -1) - blade.y
    share = in_stack(stack, blade.x, blade.y)
    path = float(np.sum(share * np.hypot(dx, dy)))
    cut_power = -(blade.cut_fx * blade.vx + blade.cut_fy * blade.vy)
    cut_work = float(np.mean(cut_power)) * turn_time
    losses = float(np.mean(turn.outputs.dissipated_power)) * turn_time - cut_work
    speed = np.hypot(blade.vx, blade.vy)
    return Cutting(
        blade_top=float(np.max(blade.y)),
        blade_bottom=float(np.min(blade.y)),
        blade_draw=abs(float(np.sum(share * dx))),
        tilt_least=float(np.min(blade.tilt)),
        tilt_largest=float(np.max(blade.tilt)),
        speed_in_stack=float(np.max(speed, where=share > 0.0, initial=0.0)),
        cut_work=cut_work,
        cut_path=path,
        cut_work_by_path=operation.feed.cut_force * path,
        # a smaller difference of the two sums is roundoff
        losses=losses if losses > 1e-9 * cut_work else 0.0,
    )


def in_stack(stack: Stack, x: Any, y: Any) -> Any:
    """Share of each piece of the blade's closed path that leads downward between the top of the stack and the
    table, shape (n,)."""
    after = np.roll(y, -1)
    within = np.clip(y, stack.table, stack.top) - np.clip(after, stack.table, stack.top)
    fall = y - after
    return np.where(fall > 0.0, within / np.where(fall > 0.0, fall, 1.0), 0.0)
