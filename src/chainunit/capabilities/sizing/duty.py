"""The duty of any drive of a machine: turns at constant speed, and the inertia that evens the speed.

The turns are computed by inverse dynamics, or by the capability whose model the machine has in its runs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...core.quantities import Value, declaration, quantity
from ...fmu.backends import Backend
from ...machines.chain_unit import SIDES, SideName
from ...reading.results import derived, part, result
from ...study.arrays import above_noise, peak
from ...study.cycle import Cycle, all_on_one, cycle, energy_swing, needed_inertia
from ...study.organs import ConstantSpeed, OrganModel
from ...study.quantiles import HIGH
from .table import Sizing
from .task import SizingTask


def rms(*parts: tuple[float, Any]) -> float:
    """RMS over parts of the time: pairs of (share of the time, values evenly spaced in that part)."""
    whole = sum(share for share, _ in parts)
    return math.sqrt(sum(share * float(np.mean(np.square(x))) for share, x in parts) / whole)


@declaration
class CycleNumbers:
    """The torque of a machine over a turn at constant crank speed; all values at the crank."""

    power_mean: Value = quantity("W", "mean power")
    torque_mean: Value = quantity("N.m", "mean torque, normal feed")
    torque_peak: Value = quantity("N.m", "peak torque, normal feed")
    torque_peak_one_sided: Value = quantity("N.m", "peak torque, all feed on one side, the larger of both")
    torque_rms: Value = quantity("N.m", "RMS torque of the duty")
    inertia_least: Value = quantity("kg.m2", "reflected inertia, least")
    inertia_mean: Value = quantity("kg.m2", "reflected inertia, mean")
    inertia_largest: Value = quantity("kg.m2", "reflected inertia, largest")
    inertia_wanted: Value = quantity(
        "kg.m2",
        "inertia at the {driver} that the wanted fluctuation takes by hand: machine, rotor, gear and flywheel; none "
        "where no fluctuation is wanted",
    )


@result
class Duty:
    """The duty of any drive, at constant speed of the crank: the turn with the feed of normal running and,
    for a machine with two sides, the turns with all feed on one side. `heavier` is the side with the larger
    RMS torque of two bars; the sides differ, as the rocker swings farther to one of them. Each is many turns of a
    machine that never repeats one."""

    normal: Cycle
    one_sided: Mapping[SideName, Cycle]
    heavier: SideName | None
    numbers: CycleNumbers = part("the torque over a turn", name="cycle", titled=True)

    @derived(name="one_sided", optional=True)
    def larger(self) -> dict[str, SideName | None] | None:
        """The sides with the larger RMS torque and with the larger peak torque."""
        peaks = [(_peak(turn), side) for side, turn in self.one_sided.items()]
        return {"larger_rms": self.heavier, "larger_peak": max(peaks)[1]} if peaks else None


def duty_of(
    task: SizingTask, organs: OrganModel, tables: Mapping[str, Any], folder: Path, backend: Backend | None
) -> Duty:
    """The duty of a machine with that model of its `organs`, whose values are in the `tables` of the study file; an
    FMU of one that has to be run for it is written to `folder`."""
    machine, feed, w = task.machine, task.operation.feed, task.operation.crank_speed
    feeds = {side: all_on_one(side, feed) for side in SIDES if side in machine.model.sides}
    normal_of_bars = cycle(machine, w, feed)
    one_sided_of_bars = {side: cycle(machine, w, feed_there) for side, feed_there in feeds.items()}
    sizes = {side: rms((1.0, turn.crank_torque)) for side, turn in one_sided_of_bars.items()}
    # if both sides are alike it is the left one, which comes first
    heavier = max(sizes, key=sizes.__getitem__, default=None)
    turns = ConstantSpeed(machine, w, (feed, *feeds.values()), (normal_of_bars, *one_sided_of_bars.values()))
    normal, *turns_of_sides = organs.turns(turns, tables, folder, backend)
    one_sided = dict(zip(feeds, turns_of_sides, strict=True))
    numbers = cycle_numbers(task.plan.demands, w, machine.ratio, normal, one_sided, heavier)
    return Duty(normal, one_sided, heavier, numbers)


def _peak(cycle: Cycle) -> float:
    """Largest crank torque of a cycle; of many turns the quantile of their peaks, as no single peak is a
    prediction."""
    peaks = np.max(np.abs(np.atleast_2d(cycle.crank_torque)), axis=1)
    return float(np.quantile(peaks, HIGH))


def cycle_numbers(
    demands: Sizing,
    crank_speed: float,
    ratio: float,
    normal: Cycle,
    one_sided: Mapping[SideName, Cycle],
    heavier: SideName | None,
) -> CycleNumbers:
    """The numbers of a duty at that speed of the crank [rad/s], with the `ratio` of the gear. The RMS torque has the
    feed on the `heavier` side for the share of the time that the `demands` state, and the normal feed otherwise. An
    infinite fluctuation stands for none that is wanted."""
    torque, inertia, wanted = normal.crank_torque, normal.outputs.J * ratio**2, None
    if math.isfinite(demands.fluctuation):
        swings = [energy_swing(turn) for turn in np.atleast_2d(torque)]
        wanted = needed_inertia(float(np.quantile(swings, HIGH)), crank_speed, demands.fluctuation)
    mean = float(np.mean(torque))
    parts = [(1.0, torque)]
    if heavier is not None:
        share = demands.one_sided_share
        parts = [(1.0 - share, torque), (share, one_sided[heavier].crank_torque)]
    return CycleNumbers(
        power_mean=mean * crank_speed,
        torque_mean=mean,
        torque_peak=_peak(normal),
        torque_peak_one_sided=max(map(_peak, one_sided.values()), default=None),
        torque_rms=rms(*parts),
        inertia_least=above_noise(float(np.min(inertia)), peak(inertia)),
        inertia_mean=float(np.mean(inertia)),
        inertia_largest=float(np.max(inertia)),
        inertia_wanted=wanted,
    )
