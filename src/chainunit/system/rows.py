"""The rows of a run, in memory or in a file."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import InputError, texts_in
from ..core.files import netcdf
from .instance import Instance

if TYPE_CHECKING:
    import xarray as xr

Recorder = tuple[Instance, Any, list[str]]
"""An instance, the handle of its recorded variables, and their full names."""
BLOCK = 4096
"""Rows that are written to a file at a time."""


def selected(names: Iterable[str] | None, there: Sequence[str]) -> list[str]:
    """The full names of `there` that a run is to keep, in their order: the `names`, or all without them.

    Raises
    ------
    InputError
        for a name that is not there.
    """
    wanted = set(there if names is None else texts_in("names", names))
    for full in sorted(wanted - set(there)):
        raise InputError(f"{full}: cannot be kept; must be an output or an input with a signal")
    return [full for full in there if full in wanted]


class Rows:
    """The rows of a run: in memory, or in a NetCDF file, to which they are written in blocks."""

    def __init__(self, recorders: Sequence[Recorder], room: int, file: Path | None) -> None:
        self._recorders = recorders
        self._names = [name for _, _, names in recorders for name in names]
        self._values = np.empty((1 + len(self._names), room))
        self._filled = self._written = 0
        self._file = None if file is None else self._create(file)

    def __enter__(self) -> Rows:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Write the last rows, unless the block failed, and close the file."""
        if self._file is not None:
            try:
                if kind is None:
                    self._flush()
            finally:
                with netcdf():
                    self._file.close()

    def add(self, time: float) -> None:
        """Keep the present values as the row of the instant `time`."""
        if self._filled == self._values.shape[1]:
            self._flush()
        row = self._values[:, self._filled]
        row[0] = time
        column = 1
        for instance, handle, names in self._recorders:
            row[column : column + len(names)] = instance.read(handle)
            column += len(names)
        self._filled += 1

    def _attributes(self) -> dict[str, dict[str, str]]:
        """Units and descriptions, of the time first."""
        attributes = {"time": {"units": "s", "long_name": "time"}}
        for instance, _, names in self._recorders:
            for full in names:
                variable = instance.fmu.variables[full.partition(".")[2]]
                attributes[full] = {"units": variable.unit or "1", "long_name": variable.description or full}
        return attributes

    def _create(self, file: Path) -> Any:
        """A netCDF file with a variable of the time for each recorded one."""
        import netCDF4

        with netcdf():
            out = netCDF4.Dataset(file, "w")
            out.createDimension("time", None)
            for name, attributes in self._attributes().items():
                variable = out.createVariable(name, "f8", ("time",), chunksizes=(BLOCK,))
                variable.setncatts(attributes)
                # by default the library keeps megabytes of each variable in memory
                variable.set_var_chunk_cache(size=8 * BLOCK, nelems=3, preemption=1.0)
        return out

    def _flush(self) -> None:
        """Write the filled rows of the block to the file."""
        assert self._file is not None
        end = self._written + self._filled
        with netcdf():
            for values, variable in zip(self._values, self._file.variables.values(), strict=True):
                variable[self._written : end] = values[: self._filled]
            self._file.sync()
        self._written, self._filled = end, 0

    def dataset(self) -> xr.Dataset:
        """The rows in memory; the variables share the memory of this table."""
        import xarray as xr

        rows = {
            name: ("time", values[: self._filled], attributes)
            for values, (name, attributes) in zip(self._values, self._attributes().items(), strict=True)
        }
        time = rows.pop("time")
        return xr.Dataset(rows, {"time": time})
