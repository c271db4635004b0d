"""The drive with a motor of the catalogue: its gear ratio, its starter or inverter, and the losses of its
gear."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from ..drives.catalogue import CatalogueMotor
from ..drives.gearing import motor_side
from ..drives.induction_motor import Inverter
from ..engines import numpy_
from .config import Config
from .drive import Drive


def catalogue_drive(
    config: Config, motor: CatalogueMotor, crank_torque: Any, ambient: float | None = None
) -> Drive:
    """The motor with the gear ratio at which the crank has its speed, or with the ratio that the file gives.

    Parameters
    ----------
    crank_torque : crank torque over a turn at that speed [N m], shape (points,), or (turns, points) for
        chains ambient : temperature of the surroundings [K]; by default that of the motor's declaration

    Raises
    ------
    InputError
        where no circuit meets the motor's nameplate.
    """
    gear, plate, w = config.gear, motor.nameplate, config.run.crank_speed
    model, p = motor.model()
    synchronous, rated_speed, rated_torque = plate.synchronous, plate.speed, plate.torque
    follows = config.start == "inverter"
    given = "gear.ratio" in config.given
    ratio = gear.ratio if given else rated_speed / w
    speed, drag = rated_speed, gear.d
    for _ in range(3):
        shaft = motor_side(numpy_(), dataclasses.replace(gear, ratio=ratio), crank_torque, speed)
        mean = float(np.mean(shaft))
        # the slip is proportional to the torque; an inverter compensates it
        speed = rated_speed if follows else synchronous - (synchronous - rated_speed) * mean / rated_torque
        if not given:
            ratio = speed / w
        drag = (mean - float(np.mean(crank_torque)) / ratio) / speed
    soft = config.starter.soft_start if config.start == "soft" else p.soft_start
    slip_hz = (synchronous - rated_speed) * plate.poles / (4.0 * math.pi)
    control = dataclasses.asdict(config.starter.inverter)
    if follows:
        control["slip"] = control["slip"] or slip_hz / rated_torque
    inverter = Inverter(on=float(follows), **control)
    surroundings = p.ambient if ambient is None else dataclasses.replace(p.ambient, T=ambient)
    p = dataclasses.replace(p, soft_start=soft, inverter=inverter, ambient=surroundings)
    machine = config.machine.replace({"ratio": ratio})
    return Drive(
        model,
        p,
        machine,
        follows,
        rated_current=plate.rated_current,
        chain=config.chain,
        gear_inertia=gear.J,
        gear_friction=drag,
    )
