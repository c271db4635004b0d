"""Results without co-simulation: turns at constant speed, the speed loop, the modes of the line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..drives.speed_control import Loop
from .cycle import Cycle
from .drive import Drive
from .line.rigid_line import RigidLine
from .line.shaft import LineModes, line_modes


@dataclass(frozen=True)
class DriveStatics:
    """Results on a machine and its drive that need no run."""

    cycles: Mapping[str, Cycle]
    """turns at constant speed, by load case"""
    loops: dict[str, Loop] = field(default_factory=dict)
    """the linearised speed loop of a controlled motor, by the inertia that is used (mean, least, largest)"""
    modes: LineModes | None = None
    """the modes of the driveline, if there is one"""
    rigid_line: RigidLine | None = None
    """whether a rigid model of the drive holds, of a drive with a driveline"""

    @property
    def normal(self) -> Cycle:
        """The turn with the feed of normal running."""
        return next(iter(self.cycles.values()))


def statics(drive: Drive, turns: Mapping[str, Cycle], step: float) -> DriveStatics:
    """All results of a study that need no co-simulation, with the `turns` of its machine by load case.

    Raises
    ------
    InputError
        where the communication `step` [s] is too long for the driveline.
    """
    turn = next(iter(turns.values()))
    inertia = turn.inertia_at(drive.ratio)
    modes = None if drive.line.part("driveline") is None else line_modes(drive, inertia)
    if modes is not None and step > modes.step_longest:
        raise InputError(
            f"run.step = {step:g} s: the driveline swings at {modes.k_largest:.4g} rad/s; must be <= "
            f"{modes.step_longest:.3g} s"
        )
    return DriveStatics(
        cycles=turns,
        loops={} if drive.foreign else _loops(drive, inertia),
        modes=modes,
        rigid_line=None if modes is None else RigidLine(modes.k_least, turn.crank_speed),
    )


_CONSTANT = 1e-9
"""Relative variation of the inertia in a turn up to which it counts as constant."""


def _loops(drive: Drive, inertia: Any) -> dict[str, Loop]:
    """The speed loop with the mean, the least and the largest inertia of the turn; only with the mean where
    the inertia is constant. Empty for a motor without a speed loop."""
    sizes = {"mean inertia": np.mean(inertia)}
    if np.ptp(inertia) > _CONSTANT * np.max(inertia):
        sizes |= {"least inertia": np.min(inertia), "largest inertia": np.max(inertia)}
    loops = {
        name: drive.motor.speed_loop(drive.fmu_parameters, drive.rotor_inertia + float(size))
        for name, size in sizes.items()
    }
    return {name: loop for name, loop in loops.items() if loop is not None}
