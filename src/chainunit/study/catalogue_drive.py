"""The drive with a motor of the catalogue: its gear ratio, its starter or inverter, and the losses of its
gear."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.engines import numpy_
from ..drives.catalogue import CatalogueMotor
from ..drives.gear_ratios import typical_efficiency
from ..drives.gearing import Transmission, motor_side
from ..drives.induction_motor import Inverter
from ..drives.nameplate import Nameplate
from .config import Config
from .drive import Drive

SLIP = "starter.inverter.slip"
"""Key of the slip compensation."""


@dataclass(frozen=True)
class GearOffer:
    """Gears on offer: their `kind`, a key of `chainunit.drives.gear_ratios.UNITS`, and whether their ratios are those
    of gears that are made."""

    kind: str = "helical"
    is_made: bool = False


HELICAL = GearOffer()
"""Helical gears, of any ratio."""


def catalogue_drive(
    config: Config,
    motor: CatalogueMotor,
    crank_torque: Any,
    ambient: float | None = None,
    gear_ratio: float | None = None,
    offer: GearOffer = HELICAL,
) -> Drive:
    """The motor with the gear ratio at which the crank has its speed, or with the ratio that the file gives.

    Parameters
    ----------
    crank_torque : crank torque over a turn at that speed [N m], shape (points,), or (turns, points) for
        chains
    ambient : temperature of the surroundings [K]; by default that of the motor's declaration
    gear_ratio : the ratio, where it is chosen already
    offer : the gears from which that of the drive is taken

    Raises
    ------
    InputError
        where no circuit meets the motor's nameplate.
    """
    plate, w = motor.nameplate, config.run.crank_speed
    model, p = motor.model()
    synchronous, rated_speed, rated_torque = plate.synchronous, plate.speed, plate.torque
    follows = config.start == "inverter"
    if gear_ratio is None and "gear.ratio" in config.file.given:
        gear_ratio = config.gear.ratio
    ratio = rated_speed / w if gear_ratio is None else gear_ratio
    speed, drag = rated_speed, config.gear.d
    for _ in range(3):
        shaft = motor_side(numpy_(), gear_with(config, ratio, offer), crank_torque, speed)
        mean = float(np.mean(shaft))
        # the slip is proportional to the torque; the reference of an inverter has the speed of the crank
        speed = rated_speed if follows else synchronous - (synchronous - rated_speed) * mean / rated_torque
        if gear_ratio is None:
            ratio = speed / w
        drag = (mean - float(np.mean(crank_torque)) / ratio) / speed
    p = with_starter(p, plate, config)
    if ambient is not None:
        p = dataclasses.replace(p, ambient=dataclasses.replace(p.ambient, T=ambient))
    machine = config.machine.replace({"ratio": ratio})
    return Drive(
        model,
        p,
        machine,
        follows,
        rated_current=plate.rated_current,
        gear_inertia=config.gear.J,
        gear_friction=drag,
    )


def gear_with(config: Config, ratio: float, offer: GearOffer = HELICAL) -> Transmission:
    """The gear of a study with that ratio; its efficiency is the typical one of its kind and stages, unless the file
    gives one."""
    gear, given = config.gear, config.file.given
    if "gear.efficiency" in given:
        return dataclasses.replace(gear, ratio=ratio)
    is_made = "gear.ratio" in given or offer.is_made
    return dataclasses.replace(gear, ratio=ratio, efficiency=typical_efficiency(offer.kind, ratio, is_made))


def with_starter(p: Any, plate: Nameplate, config: Config) -> Any:
    """The parameters `p` of a motor that starts on line, with the starter of the study. An inverter compensates the
    rated slip of the motor, unless the file gives its compensation."""
    control = dataclasses.asdict(config.starter.inverter)
    follows = config.start == "inverter"
    if follows and SLIP not in config.file.given:
        slip_hz = (plate.synchronous - plate.speed) * plate.poles / (4.0 * math.pi)
        control["slip"] = slip_hz / plate.torque
    soft = config.starter.soft_start if config.start == "soft" else p.soft_start
    return dataclasses.replace(p, soft_start=soft, inverter=Inverter(on=float(follows), **control))


def with_inertia(config: Config, drive: Drive, added: float) -> Drive:
    """The drive with that inertia added to the motor's shaft [kg m2]. Slip compensation raises the frequency in each
    peak of the load, where the inertia has to slow down to give its energy: with an added one there is none, unless
    the file gives it."""
    drive = dataclasses.replace(drive, added_inertia=added)
    if not added or config.start != "inverter" or not config.of_catalogue or SLIP in config.file.given:
        return drive
    inverter = dataclasses.replace(drive.parameters.inverter, slip=0.0)
    return dataclasses.replace(drive, parameters=dataclasses.replace(drive.parameters, inverter=inverter))
