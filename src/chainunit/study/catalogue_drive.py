"""The drive with a motor of the catalogue: its gear ratio, its starter or inverter, and the losses of its
gear."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from ..core.engines import numpy_
from ..drives.catalogue import CatalogueMotor
from ..drives.gear_ratios import GearUnit, gear_unit, typical_efficiency
from ..drives.gearing import Transmission, motor_side
from ..drives.induction_motor import Inverter, InverterControl
from ..drives.nameplate import Nameplate
from ..machines.machine import Machine
from .cycle import Cycle
from .drive import Drive, TurningGear
from .operation import NO_GEAR, DriveTables
from .star_start import NO_STAR, StarStart

SLIP = "starter.inverter.slip"
"""Key of the slip compensation."""
BOOST = "starter.inverter.boost"
"""Key of the voltage boost at low frequency."""


@dataclass(frozen=True)
class GearOffer:
    """Gears on offer: their `kind`, a key of `chainunit.drives.gear_ratios.UNITS`, and whether their ratios are those
    of gears that are made."""

    kind: str = "helical"
    is_made: bool = False


HELICAL = GearOffer()
"""Helical gears, of any ratio."""


def catalogue_drive(
    tables: DriveTables,
    machine: Machine,
    turn: Cycle,
    motor: CatalogueMotor,
    ambient: float | None = None,
    gear_ratio: float | None = None,
    offer: GearOffer = HELICAL,
) -> Drive:
    """The motor with the gear ratio at which the crank has its speed, or with the ratio that the file gives; without
    a gear where that ratio is about 1.

    Parameters
    ----------
    tables : gear and starter of the study
    turn : the machine at that speed; many turns for chains
    ambient : temperature of the surroundings [K]; by default that of the motor's declaration
    gear_ratio : the ratio, where it is chosen already
    offer : the gears from which that of the drive is taken

    Raises
    ------
    InputError
        where no circuit meets the motor's nameplate.
    """
    plate, w, crank_torque = motor.nameplate, turn.crank_speed, turn.crank_torque
    model, p = motor.model()
    synchronous, rated_speed, rated_torque = plate.synchronous, plate.speed, plate.torque
    follows = tables.start == "inverter"
    if gear_ratio is None and "gear.ratio" in tables.given:
        gear_ratio = tables.gear.ratio
    ratio = rated_speed / w if gear_ratio is None else gear_ratio
    speed = rated_speed
    for _ in range(3):
        shaft = motor_side(numpy_(), gear_with(tables, ratio, offer), crank_torque, speed)
        mean = float(np.mean(shaft))
        # the slip is proportional to the torque; the reference of an inverter has the speed of the crank
        speed = rated_speed if follows else synchronous - (synchronous - rated_speed) * mean / rated_torque
        if gear_ratio is None:
            # a motor that follows its reference keeps its own speed, so that no ratio makes up for the slip
            ratio = speed * (1.0 if follows else tables.speed_behind(mean, plate)) / w
    is_free = gear_ratio is None and offer.kind != "belt" and tables.line_ratio(ratio) == 1.0
    if is_free and abs(ratio - 1.0) <= NO_GEAR:
        return catalogue_drive(tables, machine, turn, motor, ambient, 1.0, offer)
    droop = tables.starter.droop if follows else 0.0
    # beside the droop nothing makes up for the slip of the motor
    fall = (droop + 1.0) * synchronous - rated_speed if droop else 0.0
    p = with_starter(tables, p, plate)
    if ambient is not None:
        p = replace(p, ambient=replace(p.ambient, T=ambient))
    star = tables.starter.star_delta
    drive = Drive(
        model,
        p,
        machine.replace({"ratio": ratio}),
        follows,
        rated_current=plate.rated_current,
        gear=TurningGear(tables.gear.J, tables.gear.d, gear_with(tables, ratio, offer).loss),
        transmission=transmission_of(tables, ratio, offer),
        star=StarStart(star.time, star.pause) if tables.start == "star-delta" else NO_STAR,
        flywheel_shaft=tables.flywheel_shaft,
        droop_speed=fall * mean / rated_torque,
    )
    return with_slipping_parts(drive, tables, plate)


def with_slipping_parts(drive: Drive, tables: DriveTables, plate: Nameplate | None = None) -> Drive:
    """The drive with the parts of its line that slip; `plate` is that of a motor of the catalogue.

    Raises
    ------
    InputError
        where such a part does not fit the drive.
    """
    for plan in tables.line:
        drive = replace(drive, line=drive.line.behind(plan.placed(plate, drive.ratio)))
    return drive


def gear_with(tables: DriveTables, ratio: float, offer: GearOffer = HELICAL) -> Transmission:
    """The gear of a study with that ratio; its efficiency is the typical one of its kind and stages, unless the file
    gives one."""
    gear, given_keys = tables.gear, tables.given
    if "gear.efficiency" in given_keys:
        return replace(gear, ratio=ratio)
    behind = tables.ratio_behind(ratio)
    return replace(
        gear, ratio=ratio, efficiency=typical_efficiency(offer.kind, behind, _is_made(tables, offer))
    )


def transmission_of(tables: DriveTables, ratio: float, offer: GearOffer) -> str:
    """The parts between motor and machine in a noun, see `Drive.transmission`."""
    unit = gear_unit(offer.kind, tables.ratio_behind(ratio), _is_made(tables, offer))
    return GearUnit.noun if unit is None else unit.noun


def _is_made(tables: DriveTables, offer: GearOffer) -> bool:
    return "gear.ratio" in tables.given or offer.is_made


def with_starter(tables: DriveTables, p: Any, plate: Nameplate) -> Any:
    """The parameters `p` of a motor that starts on line, with the starter of the study. An inverter compensates the
    rated slip of the motor, or has its droop, and the boost of `usual_boost`, unless the file gives them."""
    control = asdict(tables.starter.inverter)
    follows = tables.start == "inverter"
    if follows and BOOST not in tables.given:
        control["boost"] = usual_boost(p, plate)
    if follows and SLIP not in tables.given:
        slip_hz = (plate.synchronous - plate.speed) * plate.poles / (4.0 * math.pi)
        droop_hz = tables.starter.droop * plate.frequency
        control["slip"] = (-droop_hz if droop_hz else slip_hz) / plate.torque
    soft = tables.starter.soft_start if tables.start == "soft" else p.soft_start
    if tables.start == "star-delta":
        preferred = tables.starter.star_delta.preferred
        p = replace(p, switching=replace(p.switching, preferred=preferred))
    return replace(p, soft_start=soft, inverter=Inverter(on=float(follows), **control))


def usual_boost(p: Any, plate: Nameplate) -> float:
    """The boost of an inverter for a motor with the parameters `p`: the declared one, or the voltage that the
    rated current takes across the stator, if that is less. With more the flux exceeds the rated one at low frequency,
    and a large motor hunts and turns backwards in its start."""
    drop = math.sqrt(3.0) * p.stator.R * plate.rated_current / p.supply.V
    return float(min(InverterControl().boost, round(drop, 3)))


def with_inertia(tables: DriveTables, drive: Drive, added: float) -> Drive:
    """The drive with a flywheel of that inertia at its own shaft [kg m2]. Slip compensation raises the frequency in
    each peak of the load, where the flywheel has to slow down to give its energy: with one there is none, unless the
    file gives it, or a droop in its place."""
    drive = replace(drive, added_inertia=added)
    if not added or tables.start != "inverter" or drive.rated_current is None:
        return drive
    if SLIP in tables.given or tables.starter.droop:
        return drive
    inverter = replace(drive.parameters.inverter, slip=0.0)
    return replace(drive, parameters=replace(drive.parameters, inverter=inverter))


def as_used(tables: DriveTables, drive: Drive, offer: GearOffer = HELICAL) -> DriveTables:
    """The tables with the values that follow from the drive with a motor of the catalogue: the efficiency of its
    gear, which is of the `offer`, and boost and slip compensation of the inverter."""
    efficiency = gear_with(tables, drive.ratio, offer).efficiency
    inverter = tables.starter.inverter
    if drive.follows:
        used = drive.parameters.inverter
        inverter = replace(inverter, boost=used.boost, slip=used.slip)
    return replace(
        tables,
        gear=replace(tables.gear, efficiency=efficiency),
        starter=replace(tables.starter, inverter=inverter),
    )
