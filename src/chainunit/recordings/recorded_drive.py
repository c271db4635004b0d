"""The drive of a study as its recordings show it: with the motor, or as a shaft without motor data."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from ..core.errors import InputError
from ..study.drive import Drive
from .measurands import OF_TERMINALS
from .plant import AnyPlant, Plant
from .recording import Recording
from .shaft import MEASURED, MeasuredShaft


def check_motor_is_known(recordings: Mapping[str, Recording], *, is_known: bool) -> None:
    """Refuse recordings with signals of a motor that the study does not know.

    Raises
    ------
    InputError
        with these signals.
    """
    of_motor = sorted(
        {name for recording in recordings.values() for name in recording.columns if name in OF_TERMINALS}
    )
    if of_motor and not is_known:
        raise InputError(
            f"motor: is missing, and the recordings have {', '.join(of_motor)}; add [motor] with its data, or "
            "system.motor with a motor of the catalogue",
            "motor",
        )


def is_of_shaft(columns: Collection[str]) -> bool:
    """Whether the columns are those of a machine whose motor is not recorded."""
    return all(name in (*MEASURED, "mark") for name in columns)


def plant_for(drive: Drive, columns: Collection[str], sought: Sequence[str]) -> AnyPlant:
    """The plant that has these columns, with derivatives by the `sought` parameters and inputs of the system."""
    measured = [name for name in columns if name != "mark"]
    if is_of_shaft(columns):
        return MeasuredShaft(drive.machine, measured, sought)
    return Plant(drive, measured, sought)
