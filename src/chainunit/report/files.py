"""result.json and result.nc; each file appears whole or not at all."""

from __future__ import annotations

import json
from pathlib import Path

import xarray as xr

from .. import __version__
from ..files import whole
from ..studies.overload import SCENARIOS, Study, as_dict


def write(study: Study, folder: Path) -> list[Path]:
    """Write numbers and time series; returns the files.

    ``result.nc`` is netCDF-4 with a group per run (open it with `xarray.open_datatree`); each variable has its
    unit and description.
    """
    numbers = folder / "result.json"
    with whole(numbers) as part:
        part.write_text(json.dumps(as_dict(study), indent=2, allow_nan=False) + "\n", "utf-8")
    written = [numbers]
    if study.runs:
        series = folder / "result.nc"
        tree = xr.DataTree.from_dict(
            {
                f"/{name}": run.assign_attrs(title=SCENARIOS.get(name, name.replace("_", " ")))
                for name, run in study.runs.items()
            }
        )
        tree.attrs.update(title=study.config.title, source=f"chainunit {__version__}")
        with whole(series) as part:
            tree.to_netcdf(part, engine="netcdf4")
        written.append(series)
    return written
