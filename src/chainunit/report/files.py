"""The files of a report, and those of the series; each appears whole or not at all."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path

import xarray as xr

from .. import __version__
from ..files import netcdf, whole
from ..studies.study import LOAD_CYCLE, Study
from . import html, print_figures
from .accessors import title
from .blocks import Report
from .markdown import markdown

SERIES = "result.nc"


def writers(report: Report, folder: Path, name: str) -> list[Callable[[], list[Path]]]:
    """What writes the numbers (``NAME.json``), the pictures, the text (``NAME.md``) and the page of a report, in this
    order; each returns its files."""
    pictures: list[Path] = []

    def numbers() -> list[Path]:
        file = folder / f"{name}.json"
        with whole(file) as part:
            part.write_text(json.dumps(report.result, indent=1, allow_nan=False) + "\n", "utf-8")
        return [file]

    def draw() -> list[Path]:
        pictures.extend(print_figures.write(report.figures, folder, report.units))
        return pictures

    def text() -> list[Path]:
        file = folder / f"{name}.md"
        with whole(file) as part:
            part.write_text(markdown(report, [picture.name for picture in pictures]), "utf-8")
        return [file]

    return [numbers, draw, text, lambda: [html.write(report, folder)]]


def names(name: str, pictures: tuple[str, ...]) -> tuple[str, ...]:
    """The files that a report may leave."""
    return (f"{name}.json", f"{name}.md", html.NAME, *pictures)


def _load_cycle(study: Study, turns: xr.Dataset, file: Path) -> Path:
    """The load that the motor shaft sees in the steady turns, in the form that sizing tools import: a row per instant
    with time, speed, torque of the load and inertia of the load, units in the head. The last row is the first of the
    next turn."""
    names = {
        "time": "time",
        "motor.w": "speed",
        f"{study.drive.loading}.tau": "torque",
        "machine.J": "inertia",
    }
    with whole(file) as part, part.open("w", newline="", encoding="utf-8") as out:
        writer = csv.writer(out)
        writer.writerow(f"{title} [{turns[name].attrs['units']}]" for name, title in names.items())
        columns = [turns[name].values for name in names]
        columns[0] = columns[0] - columns[0][0]
        columns[-1] = study.drive.load_inertia(turns)
        writer.writerows([f"{x:.9g}" for x in row] for row in zip(*columns, strict=True))
    return file


def series(study: Study, folder: Path) -> list[Path]:
    """Write the load cycle and the time series of a study; returns the files.

    ``result.nc`` is netCDF-4 with a group per run (open it with `xarray.open_datatree`); each variable has its
    unit and description.
    """
    written = []
    if "steady" in study.answers and study.drive.whole_turns(study.steady) is not None:
        written.append(_load_cycle(study, study.steady, folder / LOAD_CYCLE))
    if study.runs:
        file = folder / SERIES
        tree = xr.DataTree.from_dict(
            {f"/{name}": run.assign_attrs(title=title(study, name)) for name, run in study.runs.items()}
        )
        tree.attrs.update(title=study.config.title, source=f"chainunit {__version__}")
        with whole(file) as part, netcdf():
            tree.to_netcdf(part, engine="netcdf4")
        written.append(file)
    return written
