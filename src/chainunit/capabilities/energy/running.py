"""Steady running of a drive with a share of its feed: where its electric power goes.

Means are over the time of whole turns. The power that the masses still take up, where the turns have not settled, is
no loss and is left out of the electric power, as in the measures of a study. The balance

    electric power = winding + friction and windage + gear + line + machine        (+ inverter on its own side)

closes because each loss is read from another output than the electric power; what is missing is reported.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.messages import unit_behind
from ...core.quantities import Layout, Value, declaration, quantity
from ...drives.nameplate import Nameplate
from ...machines.machine import Machine
from ...study.arrays import Dataset
from ...study.drive import Drive
from ...study.readings import crank_angle, crank_speed, gear_loss, shaft_power
from ...study.rig import Rig
from ...study.start_up import start_up
from ...study.window import Window
from .inverter import loss

_HELD = 1e6
"""Factor on the heat capacity of a winding that keeps its temperature."""
_LOSS_IN_JOINT = re.compile(r"(pins?|guides|cams)(\.\w+)?\.(friction|damping)|joint_damping")
"""A parameter by which the joints of a machine take power."""


@declaration
class Losses:
    """Mean electric power, and the places where it goes. A place that the drive has not, or whose loss is not known,
    has no number."""

    electric: Value = quantity("W", "electric power")
    inverter: Value = quantity("W", "inverter")
    winding: Value = quantity("W", "windings of the motor")
    windage: Value = quantity("W", "friction and windage of the motor")
    gear: Value = quantity("W", "gear")
    line: Value = quantity("W", "shafts and clutches of the line")
    joints: Value = quantity("W", "pins and guides of the machine")
    processing: Value = quantity("W", "processing")
    machine: Value = quantity("W", "machine, joints and processing together")
    missing: Value = quantity("W", "missing in the balance")


PLACES = ("inverter", "winding", "windage", "gear", "line", "joints", "processing", "machine")
"""The places of losses, in the order of the power's way."""


@dataclass(frozen=True)
class InverterRating:
    """An inverter by its losses [W] at the points of `chainunit.capabilities.energy.inverter`, and the nameplate of
    its motor."""

    losses: tuple[float, ...]
    plate: Nameplate

    def loss(self, run: Dataset) -> Any:
        """The loss over a run [W], shape (time,). The torque-producing current is in proportion to the torque, and in
        field weakening to the frequency, too."""
        frequency = run["motor.supply.frequency"].values / self.plate.frequency
        torque = run["motor.air_gap_tau"].values / self.plate.torque
        return loss(self.losses, frequency, torque * np.maximum(frequency, 1.0))


@dataclass(frozen=True)
class SteadyLoad:
    """Steady running with a load: its `losses`, its whole `turns`, and the mean power that the motor gives back to
    its supply at moments [W]. `lasts` tells whether its means stand for running that lasts."""

    losses: Losses
    turns: Dataset
    given_back: float
    lasts: bool


def scaled(feed: Any, factor: float) -> Any:
    """The feed with each of its quantities multiplied by the `factor`; counts and switches stay."""
    layout = Layout(type(feed))
    pairs = zip(layout.variables, layout.values(feed), strict=True)
    return layout.instance([factor * x if v.quantity.type == "Real" else x for v, x in pairs])


def scale_faults(feed: Any, factor: float) -> list[str]:
    """The quantities of the feed that the `factor` takes beyond their bounds, each in words; none where it can be
    `scaled`."""
    layout = Layout(type(feed))
    pairs = zip(layout.variables, layout.values(scaled(feed, factor)), strict=True)
    return [
        f"feed.{v.name} comes to {x:.6g}{unit_behind(v.unit)} with it: must be {v.quantity.allowed_range}"
        for v, x in pairs
        if not v.quantity.admits(x)
    ]


def warm(drive: Drive, temperature: float) -> Drive:
    """The drive with its winding held at that temperature [K], as a long duty leaves it: it begins there, and its
    heat capacity is so large that it stays there."""
    p, name = drive.parameters, drive.motor.winding
    winding = getattr(p, name)
    held = {name: replace(winding, C=_HELD * winding.C), "ambient": replace(p.ambient, T=temperature)}
    return replace(drive, parameters=replace(p, **held), observer=None)


def run_steadily(rig: Rig, drive: Drive, feed: Any, inverter: InverterRating | None) -> SteadyLoad:
    """The `drive` in steady running with that `feed`, from rest, without its torque limiter.

    Raises
    ------
    RunError
        where the run fails.
    """
    rig = replace(rig, drive=drive, operation=replace(rig.operation, feed=feed), fed_from=None)
    with rig.from_rest() as simulation:
        steady, _ = start_up(rig, simulation, lambda time: None, {}).windows
    return _read(steady, feed, inverter)


def _read(w: Window, feed: Any, inverter: InverterRating | None) -> SteadyLoad:
    """The losses in steady running with that feed."""
    drive, turns = w.drive, w.run
    squared = w.rms(drive.motor_speed) ** 2
    motor = w.mean("motor.supply_power") - w.taken_up[1]
    shaft = w.mean(shaft_power) - w.taken_up[0]
    line = [f"{part.name}.dissipated_power" for part in drive.line]
    parts: dict[str, float | None] = dict.fromkeys(PLACES)
    parts["winding"] = w.mean("motor.heat")
    parts["windage"] = float(drive.parameters.rotor.d) * squared
    parts["gear"] = w.mean(gear_loss) if drive.gear.d or drive.gear.loss else None
    # behind a part that slips the gear is a part of the line
    geared = parts["gear"] or 0.0 if drive.line.before_gear is not None else 0.0
    parts["line"] = sum(w.mean(full) for full in line if full in turns) - geared if drive.line else None
    if inverter is not None:
        parts["inverter"] = w.mean(lambda drive, run: inverter.loss(run))
    if "machine.dissipated_power" in turns:
        parts |= _machine(w, feed)
    else:
        parts["machine"] = shaft - (parts["line"] or 0.0) - geared
    electric = motor + (parts["inverter"] or 0.0)
    missing = electric - sum(x for x in parts.values() if x is not None)
    back = w.mean(lambda drive, run: np.maximum(-run["motor.supply_power"].values, 0.0))
    return SteadyLoad(Losses(electric=electric, missing=missing, **parts), turns, back, w.lasts)


def losses_in_joints(machine: Machine) -> list[str]:
    """The names of the parameters of a machine by which its joints take power."""
    return [name for name in machine.by_name if _LOSS_IN_JOINT.fullmatch(name)]


def _machine(w: Window, feed: Any) -> dict[str, float]:
    """The power that the machine takes: of its joints and of the processing, where they can be told apart. The forces
    of the processing follow from the motion alone, so the same turns without friction take theirs alone."""
    whole, machine = w.mean("machine.dissipated_power"), w.drive.machine
    names = losses_in_joints(machine)
    if not names or machine.simulated is not machine or machine.model.States is not None:
        return {"machine": whole}
    smooth = machine.replace(dict.fromkeys(names, 0.0))
    values = Layout(type(feed)).by_name(feed)

    def processing(drive: Drive, run: Dataset) -> Any:
        motion = {"phi": crank_angle(drive, run) * drive.ratio, "w": crank_speed(drive, run) * drive.ratio}
        return smooth.evaluate({**motion, **values})["dissipated_power"]

    processing_power = w.mean(processing)
    return {"joints": whole - processing_power, "processing": processing_power}
