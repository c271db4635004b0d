"""The drive with a motor of the catalogue: its gear ratio, its starter or inverter, and the losses of its
gear."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..core.engines import numpy_
from ..core.errors import InputError
from ..drives.catalogue import CatalogueMotor
from ..drives.gear_ratios import nearest, typical_efficiency
from ..drives.gearing import Transmission, motor_side
from ..drives.induction_motor import Inverter
from ..drives.nameplate import Nameplate
from ..reading.text import number
from .config import Config
from .drive import Drive
from .limits import SPEED_DEVIATION

SLIP = "starter.inverter.slip"
"""Key of the slip compensation."""


def catalogue_drive(
    config: Config,
    motor: CatalogueMotor,
    crank_torque: Any,
    ambient: float | None = None,
    gear_ratio: float | None = None,
) -> Drive:
    """The motor with the gear ratio at which the crank has its speed, or with the ratio that the file gives.

    Parameters
    ----------
    crank_torque : crank torque over a turn at that speed [N m], shape (points,), or (turns, points) for
        chains
    ambient : temperature of the surroundings [K]; by default that of the motor's declaration
    gear_ratio : the ratio, where it is chosen already

    Raises
    ------
    InputError
        where no circuit meets the motor's nameplate.
    """
    plate, w = motor.nameplate, config.run.crank_speed
    model, p = motor.model()
    synchronous, rated_speed, rated_torque = plate.synchronous, plate.speed, plate.torque
    follows = config.start == "inverter"
    if gear_ratio is None and "gear.ratio" in config.given:
        gear_ratio = config.gear.ratio
    ratio = rated_speed / w if gear_ratio is None else gear_ratio
    speed, drag = rated_speed, config.gear.d
    for _ in range(3):
        shaft = motor_side(numpy_(), gear_with(config, ratio), crank_torque, speed)
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


def check_ratios(config: Config, motors: Sequence[CatalogueMotor]) -> None:
    """Refuse `sizing.ratios` with which none of the `motors`, the smallest first, keeps the speed of the crank on the
    line, at any slip up to the rated one. An inverter keeps the speed with any ratio.

    Raises
    ------
    InputError
        with the ratios that are needed.
    """
    ratios, w = config.choices["sizing.ratios"], config.run.crank_speed
    if not ratios or config.start == "inverter" or "gear.ratio" in config.given:
        return
    needed: dict[float, float] = {}
    for plate in (motor.nameplate for motor in motors):
        least, most = plate.speed / w, plate.synchronous / w
        if any((1.0 - SPEED_DEVIATION) * least <= x <= (1.0 + SPEED_DEVIATION) * most for x in ratios):
            return
        needed.setdefault(plate.poles, least)
    wanted = sorted((ratio, poles) for poles, ratio in needed.items())
    near, _ = min(wanted, key=lambda each: abs(math.log(each[0] / nearest(each[0], ratios))))
    words = " or ".join(f"{number(ratio, '1', digits=2)} ({poles:g} poles)" for ratio, poles in wanted)
    raise InputError(
        f"sizing.ratios: no ratio on offer brings the crank to {number(w, 'rad/s', 'speed')} with a motor of the "
        f"catalogue: about {words} is needed, the nearest on offer is {nearest(near, ratios):g}; add such a ratio, "
        "change run.crank_speed, or take an inverter (start)",
        "sizing.ratios",
    )


def is_of_a_gear(config: Config) -> bool:
    """Whether the ratios are those of gears that there are: the file gives one, or a list of them."""
    return "gear.ratio" in config.given or bool(config.choices["sizing.ratios"])


def gear_with(config: Config, ratio: float) -> Transmission:
    """The gear of a study with that ratio; its efficiency is the typical one of its kind and stages, unless the file
    gives one."""
    typical = typical_efficiency(config.choices["sizing.gear_kind"], ratio, is_of_a_gear(config))
    efficiency = config.gear.efficiency if "gear.efficiency" in config.given else typical
    return dataclasses.replace(config.gear, ratio=ratio, efficiency=efficiency)


def with_starter(p: Any, plate: Nameplate, config: Config) -> Any:
    """The parameters `p` of a motor that starts on line, with the starter of the study. An inverter compensates the
    rated slip of the motor, unless the file gives its compensation."""
    control = dataclasses.asdict(config.starter.inverter)
    follows = config.start == "inverter"
    if follows and SLIP not in config.given:
        slip_hz = (plate.synchronous - plate.speed) * plate.poles / (4.0 * math.pi)
        control["slip"] = slip_hz / plate.torque
    soft = config.starter.soft_start if config.start == "soft" else p.soft_start
    return dataclasses.replace(p, soft_start=soft, inverter=Inverter(on=float(follows), **control))


def with_wheel(config: Config, drive: Drive, flywheel: float) -> Drive:
    """The drive with that flywheel [kg m2]. Slip compensation raises the frequency in each peak of the load, where a
    flywheel has to slow down to give its energy: with a flywheel there is none, unless the file gives it."""
    drive = dataclasses.replace(drive, flywheel=flywheel)
    if not flywheel or config.start != "inverter" or not config.of_catalogue or SLIP in config.given:
        return drive
    inverter = dataclasses.replace(drive.parameters.inverter, slip=0.0)
    return dataclasses.replace(drive, parameters=dataclasses.replace(drive.parameters, inverter=inverter))
