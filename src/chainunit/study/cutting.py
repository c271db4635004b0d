"""The turn of a knife drive at constant speed: blade path, torque, work of a cut, reactions; the energy of a cut.

The mechanics are in `machines.knife_drive`.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import xarray as xr

from ..engines import numpy_
from ..machines.knife_drive import KnifeDrive, Parameters
from ..quantities import Value, declaration, quantity
from .duty import flywheel

PINS = KnifeDrive.pins
POINTS = 3600
"""Crank angles of the turn at constant speed."""
_TURN = 2.0 * math.pi


@declaration
class KnifeTurn:
    """A turn of the crank at constant speed."""

    blade_top: Value = quantity("m", "blade, highest y", kind="millimetres")
    blade_bottom: Value = quantity("m", "blade, lowest y", kind="millimetres")
    blade_draw: Value = quantity("m", "blade, way along x in the stack", kind="millimetres")
    tilt_least: Value = quantity("rad", "tilt of the blade, least")
    tilt_largest: Value = quantity("rad", "tilt of the blade, largest")
    speed_in_stack: Value = quantity("m/s", "speed of the blade in the stack, largest")
    torque_peak: Value = quantity("N.m", "crank torque, peak, cutting")
    torque_peak_free: Value = quantity("N.m", "crank torque, peak, without cut")
    torque_mean: Value = quantity("N.m", "crank torque, mean, cutting")
    cut_work: Value = quantity("J", "work of a cut")
    cut_path: Value = quantity("m", "path of the blade through the stack", kind="millimetres")
    cut_work_by_path: Value = quantity("J", "force times path through the stack")
    losses: Value = quantity("J", "losses of the pins in a turn, cutting")
    energy_swing: Value = quantity("J", "energy to be stored at constant torque of the drive")
    inertia_least: Value = quantity("kg.m2", "inertia reflected to the crank, least")
    inertia_largest: Value = quantity("kg.m2", "inertia reflected to the crank, largest")
    inertia_mean: Value = quantity("kg.m2", "inertia reflected to the crank, mean")
    margin: Value = quantity("1", "margin from a dead position, least")


@declaration
class KnifeReaction:
    """The peak of a pin over a turn at constant speed, and the crank angle at which it comes."""

    peak: Value = quantity("N", "largest reaction, cutting")
    angle: Value = quantity("rad", "crank angle of it")
    peak_free: Value = quantity("N", "largest reaction, without cut")
    angle_free: Value = quantity("rad", "crank angle of it")


@dataclasses.dataclass(frozen=True)
class TurnCurves:
    """Curves over a turn at constant speed, arrays over `angle`, shape (POINTS,)."""

    angle: Any
    """of the crank [rad]"""
    torque: Any
    """of the crank, cutting [N.m]"""
    torque_free: Any
    """without cut [N.m]"""
    inertia: Any
    """at the crank [kg.m2]"""
    x: Any
    """of the blade [m]"""
    y: Any
    tilt: Any
    """[rad]"""
    turn: KnifeTurn
    pins: dict[str, KnifeReaction]

    @property
    def top(self) -> float:
        """Crank angle at which the blade is highest [rad]."""
        return float(self.angle[np.argmax(self.y)])


def statics(p: Parameters, w: float, force: float) -> TurnCurves:
    """The turn at the crank speed `w` [rad/s], with and without the cutting `force` [N]."""
    angle = np.arange(POINTS) * (_TURN / POINTS)
    cutting, free = outputs(p, angle, w, force), outputs(p, angle, w, 0.0)
    torque, torque_free = (np.broadcast_to(o.tau * p.ratio, angle.shape) for o in (cutting, free))
    blade = cutting.blade
    time = _TURN / POINTS / w
    against = -(blade.cut_fx * blade.vx + blade.cut_fy * blade.vy)
    work = float(np.sum(against)) * time
    losses = float(np.mean(cutting.dissipated_power)) * _TURN / w - work
    inside = in_stack(p.stack, blade.x, blade.y)
    path = float(np.sum(inside * _way(blade.x, blade.y)))
    inertia = np.broadcast_to(cutting.J * p.ratio**2, angle.shape)
    speed = np.hypot(blade.vx, blade.vy)
    turn = KnifeTurn(
        blade_top=float(np.max(blade.y)),
        blade_bottom=float(np.min(blade.y)),
        blade_draw=abs(float(np.sum(inside * (np.roll(blade.x, -1) - blade.x)))),
        tilt_least=float(np.min(blade.tilt)),
        tilt_largest=float(np.max(blade.tilt)),
        speed_in_stack=float(np.max(speed, where=inside > 0.0, initial=0.0)),
        torque_peak=float(np.max(np.abs(torque))),
        torque_peak_free=float(np.max(np.abs(torque_free))),
        torque_mean=float(np.mean(torque)),
        cut_work=work,
        cut_path=path,
        cut_work_by_path=force * path,
        losses=losses if losses > 1e-9 * work else 0.0,  # of two sums that differ by roundoff alone
        energy_swing=flywheel(torque, w, 1.0) * w * w,
        inertia_least=float(np.min(inertia)),
        inertia_largest=float(np.max(inertia)),
        inertia_mean=float(np.mean(inertia)),
        margin=float(np.min(cutting.margin)),
    )
    pins = {}
    for title, name in PINS.items():
        sizes = [np.hypot(getattr(o, name).fx, getattr(o, name).fy) for o in (cutting, free)]
        at = [int(np.argmax(size)) for size in sizes]
        pins[title] = KnifeReaction(
            peak=float(sizes[0][at[0]]),
            angle=float(angle[at[0]]),
            peak_free=float(sizes[1][at[1]]),
            angle_free=float(angle[at[1]]),
        )
    return TurnCurves(angle, torque, torque_free, inertia, blade.x, blade.y, blade.tilt, turn, pins)


def outputs(p: Parameters, angle: Any, w: float, force: float) -> Any:
    """The machine's outputs at crank angles [rad] and the crank speed `w` [rad/s], under a cutting force [N]."""
    inputs = {"phi": angle * p.ratio, "w": w * p.ratio, "cut_force": force}
    return KnifeDrive.evaluate(numpy_(), p, KnifeDrive.input_layout.from_names(inputs))[0]


def _way(x: Any, y: Any) -> Any:
    """Length of each piece of a closed path [m]."""
    return np.hypot(np.roll(x, -1) - x, np.roll(y, -1) - y)


def in_stack(stack: Any, x: Any, y: Any) -> Any:
    """Share of each piece of the blade's closed path that goes down between top and table, shape (n,)."""
    after = np.roll(y, -1)
    within = np.clip(y, stack.table, stack.top) - np.clip(after, stack.table, stack.top)
    fall = y - after
    return np.where(fall > 0.0, within / np.where(fall > 0.0, fall, 1.0), 0.0)


def cutting_power(run: xr.Dataset) -> Any:
    """Power that the stack takes from the blade [W], shape (time,)."""
    vx, vy, fx, fy = (run[f"machine.blade.{name}"].values for name in ("vx", "vy", "cut_fx", "cut_fy"))
    return -(fx * vx + fy * vy)


def stored_shares(run: xr.Dataset, inertia: float) -> tuple[float | None, float | None]:
    """Energy that rotor, flywheel (together of this `inertia` [kg m2]) and machine lend to a cut, over its work: from
    the beginning of the cut to its end, and from its beginning to their least energy. None where nothing is cut.

    The rest comes from the motor through the air gap, less friction; towards the end of a cut, where the blade slows
    down, the motor may already give back to them.
    """
    power, time = cutting_power(run), run["time"].values
    if not np.max(power) > 0.0:
        return None, None
    stored = (
        0.5 * inertia * run["motor.w"].values ** 2
        + run["machine.kinetic_energy"].values
        + run["machine.potential_energy"].values
    )
    inside = power > 0.01 * np.max(power)
    edge = np.diff(np.concatenate([[False], inside, [False]]).astype(int))
    net = most = work = 0.0
    for a, b in zip(np.flatnonzero(edge > 0), np.flatnonzero(edge < 0), strict=True):
        net += float(stored[a] - stored[b - 1])
        most += float(stored[a] - np.min(stored[a:b]))
        work += float(np.trapezoid(power[a:b], time[a:b]))
    return net / work, most / work
