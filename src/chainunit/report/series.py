"""The time series of a study: result.nc and the load cycle. Each file appears whole or not at all.

This line opens result.nc::

    runs = xarray.open_datatree("results/result.nc")

``runs["jam_left"]["machine.tau"]`` is then the torque in that run over ``time``, with its unit and description in
``attrs``. The start-up has the time at which the turns of load_cycle.csv begin, ``attrs["steady_begin"]`` [s]. A tool
that knows no trees opens a run as a group: ``xarray.open_dataset(file, group="jam_left")``.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING

from .. import __version__
from ..core.files import atomic_file, netcdf
from ..study.drive import Drive
from ..study.readings import load_inertia, motor_shaft
from ..study.record import LOAD_CYCLE, StudyRecord
from ..work.interrupts import stoppable
from .run_names import has_steady_turns, title

if TYPE_CHECKING:
    import xarray as xr

SERIES = "result.nc"
LOAD_CYCLE_HEADS = ("time [s]", "speed [rad/s]", "torque [N.m]", "inertia [kg.m2]")
"""The heads of the load cycle."""
STEADY_BEGIN = "steady_begin"
"""Attribute of the start-up: the time at which the turns of the load cycle begin [s]."""


def _load_cycle(drive: Drive, turns: xr.Dataset, file: Path) -> Path:
    """Write the load at the motor shaft in the steady turns, in the form that sizing tools import: a row for each
    instant with time, speed, load torque and load inertia; the head has the units. The last row is the first instant
    of the next turn."""
    time = turns["time"].values
    torque, speed = motor_shaft(drive, turns)
    columns = time - time[0], speed, torque, load_inertia(drive, turns)
    with atomic_file(file) as part, part.open("w", newline="", encoding="utf-8") as out:
        writer = csv.writer(out)
        writer.writerow(LOAD_CYCLE_HEADS)
        writer.writerows([f"{x:.9g}" for x in row] for row in zip(*columns, strict=True))
    return file


def tree(study: StudyRecord) -> xr.DataTree:
    """The time series of all runs, a node for each run; each variable has its unit and description."""
    import xarray as xr

    runs = study.runs
    nodes = {f"/{name}": run.assign_attrs(title=title(runs, name)) for name, run in runs.series.items()}
    if has_steady_turns(runs):
        nodes["/start_up"].attrs[STEADY_BEGIN] = float(runs.steady["time"][0])
    whole_study = xr.DataTree.from_dict(nodes)
    whole_study.attrs.update(title=study.setup.config.title, source=f"chainunit {__version__}")
    return whole_study


def write(study: StudyRecord, folder: Path) -> list[Path]:
    """Write the load cycle and the time series of a study; returns the files.

    ``result.nc`` is netCDF-4 with a group per run, the `tree`.
    """
    files = []
    if has_steady_turns(study.runs):
        files.append(_load_cycle(study.setup.drive, study.runs.steady, folder / LOAD_CYCLE))
    if study.runs.series:
        file = folder / SERIES
        # an interrupt inside the library leaves its locks taken
        with stoppable(), atomic_file(file) as part, netcdf():
            tree(study).to_netcdf(part, engine="netcdf4")
        files.append(file)
    return files
