"""The motor that is compared with the motor of the study over its life."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ...core.errors import InputError, shown
from ...drives.catalogue import CatalogueMotor, catalogue, motor_of_catalogue
from ...study.catalogue_drive import with_inertia, with_starter
from ...study.drive import Drive
from ...study.operation import DriveTables
from .efficiency_class import next_class

_SAME = 1e-3
"""Relative difference of rated powers that count as equal."""


def other_motor(motor: CatalogueMotor, designation: str, own_motors: Sequence[Path]) -> CatalogueMotor | None:
    """The motor with that `designation` in the packaged catalogue or the files `own_motors`; without one the motor of
    the catalogues of the same power and poles that reaches the next efficiency class, or else the same motor with the
    efficiency and the slip of that class. None where no class is above that of the motor.

    Raises
    ------
    InputError
        for an unknown designation, and for a motor of another frequency.
    """
    if designation:
        other = motor_of_catalogue(designation, own_motors)
        frequency, wanted = other.nameplate.frequency, motor.nameplate.frequency
        if frequency != wanted:
            reason = f"has {frequency:g} Hz, and the motor of the study {wanted:g} Hz; name a motor of {wanted:g} Hz"
            raise InputError(f"usage.other = {shown(designation)}: {reason}", "usage.other")
        return other
    plate, above = motor.nameplate, next_class(motor.nameplate)
    if above is None:
        return None
    name, efficiency = above
    better = [
        candidate
        for candidate in catalogue(*own_motors)
        if abs(candidate.nameplate.power / plate.power - 1.0) <= _SAME
        and candidate.nameplate.poles == plate.poles
        and candidate.nameplate.frequency == plate.frequency
        and candidate.nameplate.efficiency >= efficiency
    ]
    if better:
        return min(better, key=lambda candidate: float(candidate.nameplate.efficiency))
    # all losses fall alike, the loss of the slip with them
    share = (1.0 / efficiency - 1.0) / (1.0 / plate.efficiency - 1.0)
    speed = plate.synchronous * (1.0 - share * plate.slip)
    return replace(
        motor,
        designation=f"{name} in the size of {motor.designation}",
        nameplate=replace(plate, efficiency=efficiency, speed=speed, current=0.0, price=0.0),
        order_number="",
        source=f"efficiency: {name} limit of IEC 60034-30-1; slip: in proportion to the losses; else as the motor",
    )


def with_motor(drive: Drive, tables: DriveTables, motor: CatalogueMotor) -> Drive:
    """The same drive with another `motor`: gear, line and added inertia stay.

    Raises
    ------
    InputError
        where no circuit meets its nameplate.
    """
    model, p = motor.model()
    p = with_starter(tables, p, motor.nameplate)
    p = replace(p, ambient=drive.parameters.ambient)
    other = replace(
        drive,
        motor=model,
        parameters=p,
        rated_current=motor.nameplate.rated_current,
        tuning=None,
        observer=None,
    )
    return with_inertia(tables, other, drive.added_inertia)
