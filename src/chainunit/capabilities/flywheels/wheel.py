"""A drive with one of the flywheels that a study compares: its answers and its limits."""

from __future__ import annotations

from collections.abc import Mapping

from ...core.quantities import Value, declaration, percentage, quantity
from ...reading.results import derived, part, result
from ...study.arrays import Dataset
from ...study.limits import Check
from ...study.measures import same_measure
from ...study.window import closes


@declaration
class FlywheelAnswers:
    """Answers of the drive with a flywheel, in steady running; None where the motor does not start, or stalls
    under the load."""

    flywheel: Value = quantity("kg.m2", "flywheel, at its own shaft")
    inertia: Value = quantity("kg.m2", "all inertia on the motor shaft, mean of the machine's")
    start_time: Value = same_measure("start_time")
    speed_mean: Value = same_measure("speed_mean")
    speed_least: Value = same_measure("speed_least")
    speed_ripple: Value = same_measure("speed_ripple")
    motor_ripple: Value = percentage("ripple of the motor's speed")
    by_hand: Value = percentage("ripple by hand, dE/(J w2)")
    motor_torque_peak: Value = same_measure("motor_torque_peak")
    motor_torque_rms: Value = same_measure("motor_torque_rms")
    current_peak: Value = same_measure("current_peak")
    current_rms: Value = same_measure("current_rms")
    current_share: Value = same_measure("current_share")
    winding_temperature: Value = same_measure("winding_temperature")
    supply_power_mean: Value = same_measure("supply_power_mean")
    stored_share: Value = same_measure("stored_share")
    stored_share_most: Value = same_measure("stored_share_most")
    cycle_gap: Value = same_measure("cycle_gap")
    speed_drift: Value = same_measure("speed_drift")
    energy_gap: Value = same_measure("energy_gap")
    residual: Value = percentage("energy residual")


@result
class Wheel:
    """A flywheel with its run. `turns` are the steady turns, or the whole run where the crank makes none;
    `checks` are the limits of the motor, by name."""

    answers: FlywheelAnswers = part(inline=True)
    turns: Dataset
    checks: Mapping[str, Check]

    @property
    def flywheel(self) -> float:
        """[kg m2]"""
        return float(self.answers.flywheel)

    @derived()
    def stalls(self) -> bool:
        """Whether the machine starts, and then stands or creeps under its load."""
        return self.answers.start_time is not None and self.answers.speed_ripple is None

    @property
    def is_settled(self) -> bool:
        """Whether the turns of its run close."""
        answers = self.answers
        return closes(answers.cycle_gap or 0.0, answers.speed_drift or 0.0, answers.energy_gap or 0.0)

    @property
    def excesses(self) -> list[str]:
        """Words on each limit of motor and start that its run exceeds."""
        return [check.title for check in self.checks.values() if check.over]

    def passes(self, limit: str) -> bool:
        """Whether its run exceeds the `limit` of the motor, if the motor has a limit of that name."""
        return limit in self.checks and self.checks[limit].over

    def keeps(self, permitted: float) -> bool:
        """Whether the drive runs steadily with it, does not approach a stall, and keeps the `permitted`
        fluctuation."""
        ripple = self.answers.speed_ripple
        return ripple is not None and ripple <= permitted and self.is_settled
