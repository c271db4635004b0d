"""The results of a job in one NetCDF file, which is written batch by batch.

One process writes. Each value has its place in the file from the begin, and the checksum of a batch is written after
its values: a batch without the right checksum is missing. The bytes of the file follow from the job alone, and not
from the order of the batches or the number of kills between them. Any reader of NetCDF reads it::

    xarray.open_dataset("results/monte_carlo_0123456789ab.nc")
"""

from __future__ import annotations

import hashlib
import re
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from .. import __version__
from ..core.errors import InputError, RunError
from ..core.files import atomic_file, netcdf, writing
from .job import BATCH, CHECKS, DECLARATION, Job, ResultVariable, text_array

if TYPE_CHECKING:
    import xarray as xr

_FORMAT: Literal["NETCDF3_64BIT_DATA"] = "NETCDF3_64BIT_DATA"
"""The classic format: a kill between two writes leaves all other values as they are."""
_HEAD = 1 << 20  # bytes, more than the head of the file of any job
_COPIED = 1 << 16  # points that are copied at once into a larger file


class BatchStore:
    """The store of a `job` at `path`, which is made where it is missing or has another declaration. A store that
    already has more points than the job keeps them.

    Raises
    ------
    InputError
        where `path` is no regular file.
    WriteError
        where the store cannot be written.
    """

    def __init__(self, job: Job, path: Path) -> None:
        self.job, self.path = job, path
        self._layout = job.layout()
        self.earlier_points = self._stored_points()
        """number of points that the store was made for before, complete or not"""
        self.points = max(job.points, self.earlier_points)
        self._remove_leftovers()
        if not self.earlier_points or self.points > self.earlier_points:
            self._make()

    def _stored_points(self) -> int:
        """The number of points of a file of this job; 0 without one. The NetCDF library trusts the head of a file, so
        that its digest is checked first."""
        if not self.path.exists():
            return 0
        if not self.path.is_file():
            raise InputError(f"{self.path}: is not a regular file; remove it")
        head, seal = self._head(self.path)
        if not seal or not head.endswith(seal):
            return 0
        with self._opened() as file:
            return len(file.dimensions[self.job.dimension])

    def _head(self, path: Path) -> tuple[bytes, bytes]:
        """The head of a file to the end of its digest, and the digest that it must have; empty for the head of
        another job."""
        with writing(path), path.open("rb") as file:
            head = file.read(_HEAD)
        end = head.find(self._layout) + len(self._layout)
        seal = hashlib.sha256(head[:end]).hexdigest().encode()
        return (head[: end + len(seal)], seal) if end >= len(self._layout) else (b"", b"")

    def _make(self) -> None:
        """Make the file for all points, with the whole batches that a smaller one has."""
        from netCDF4 import Dataset

        with atomic_file(self.path, is_result=False) as part:
            with netcdf(), Dataset(part, "w", format=_FORMAT) as new:
                new.set_fill_off()
                self._declare(new)
                new.set_auto_maskandscale(False)
                new.set_auto_chartostring(False)
                if self.earlier_points:
                    self._copy(new)
            head, seal = self._head(part)
            with part.open("r+b") as file:
                file.seek(len(head) - len(seal))
                file.write(seal)

    def _declare(self, file: Any) -> None:
        """Declare the dimensions and variables. The declaration's digest comes first, and the checksums last."""
        job = self.job
        file.setncatts({"title": job.title, "source": f"chainunit {__version__}"})
        file.createDimension(job.dimension, self.points)
        file.createDimension(BATCH, job.batches(self.points))
        file.createDimension(DECLARATION, 2 * len(self._layout))
        file.createVariable(DECLARATION, "S1", (DECLARATION,))
        for c in job.coordinates:
            file.createDimension(c.name, len(c.values))
            file.createVariable(c.name, "f8", (c.name,)).setncatts(
                {"units": c.unit, "long_name": c.description}
            )
        for v in job.variables:
            for name, size in zip(job.dims(v), (self.points, *job.shape(v)), strict=True):
                if name not in file.dimensions:
                    file.createDimension(name, size)
            file.createVariable(v.name, v.kind, job.dims(v)).setncatts(v.attributes)
        about = {"units": "1", "long_name": "CRC-32 of the values of a batch"}
        file.createVariable(CHECKS, "u4", (BATCH,)).setncatts(about)
        file.sync()
        file[DECLARATION][: len(self._layout)] = np.frombuffer(self._layout, "S1")
        for c in job.coordinates:
            file[c.name][:] = np.array(c.values)

    def _copy(self, new: Any) -> None:
        earlier = self.earlier_points
        with self._opened() as old:
            for name in self._names:
                for begin in range(0, earlier, _COPIED):
                    rows = slice(begin, min(begin + _COPIED, earlier))
                    new[name][rows] = old[name][rows]
            # an incomplete last batch gets more points
            whole = earlier // self.job.batch
            new[CHECKS][:whole] = old[CHECKS][:whole]

    @contextmanager
    def _opened(self, mode: Literal["r", "r+"] = "r") -> Iterator[Any]:
        """The file, with its values as they are."""
        from netCDF4 import Dataset

        with writing(self.path), netcdf(), Dataset(self.path, mode) as file:
            file.set_auto_maskandscale(False)
            file.set_auto_chartostring(False)
            yield file

    def extent(self, batch: int) -> tuple[int, int]:
        """The first point of a batch, and the first one of the next."""
        begin = batch * self.job.batch
        return begin, min(begin + self.job.batch, self.points)

    def missing(self, progress: Callable[[int], None]) -> tuple[list[int], int]:
        """The batches of the job that the store does not have, and how many of these it has damaged. `progress`
        is called with the number of points that are complete."""
        gaps, damaged, complete = [], 0, 0
        with self._opened() as file:
            marks = file[CHECKS][:]
            for batch in range(self.job.batches()):
                begin, end = self.extent(batch)
                if marks[batch] and marks[batch] == self._mark(file, batch):
                    complete += min(end, self.job.points) - begin
                    if batch % 1000 == 999:
                        progress(complete)
                else:
                    gaps.append(batch)
                    damaged += bool(marks[batch])
        progress(complete)
        return gaps, damaged

    @property
    def _names(self) -> list[str]:
        return [v.name for v in self.job.variables]

    def _mark(self, file: Any, batch: int) -> int:
        """The checksum of a batch: of the declaration, the extent of the batch, and its values as they are stored."""
        begin, end = self.extent(batch)
        check = zlib.crc32(f"{begin, end}".encode(), zlib.crc32(self._layout))
        for name in self._names:
            check = zlib.crc32(np.ascontiguousarray(file[name][begin:end]).tobytes(), check)
        return check

    def write(self, batch: int, results: Mapping[str, Any]) -> None:
        """Write the results of a batch, and then its checksum.

        Raises
        ------
        RunError
            for results that the job does not declare.
        WriteError
            where the file cannot be written.
        """
        begin, end = self.extent(batch)
        if set(results) != set(self._names):
            raise RunError(f"{self.job.title}: the results are {sorted(results)}, must be {self._names}")
        values = {v.name: self._values(v, results[v.name], end - begin) for v in self.job.variables}
        with self._opened("r+") as file:
            for name, array in values.items():
                self._put(file, name, slice(begin, end), array)
            self._put(file, CHECKS, batch, np.uint32(self._mark(file, batch)))

    def _put(self, file: Any, name: str, place: slice | int, values: Any) -> None:
        file[name][place] = values
        file.sync()

    def _values(self, variable: ResultVariable, values: Any, points: int) -> np.ndarray:
        """The results of a variable, checked."""
        if variable.letters:
            values = text_array(values, variable.letters)
        array, shape = np.asarray(values), (points, *self.job.shape(variable))
        if array.shape != shape or not np.can_cast(array.dtype, variable.kind, "same_kind"):
            raise RunError(
                f"{self.job.title}: {variable.name} is {array.dtype} of the shape {array.shape}, must be "
                f"{variable.kind} of the shape {shape}"
            )
        return array.astype(variable.kind)

    def _remove_leftovers(self) -> None:
        """Remove the temporary files of a process that was killed while it made the file; see `atomic_file`."""
        for part in self.path.parent.glob(f"{self.path.name}.*.part"):
            if re.search(r"\.[0-9a-f]{16}\.part$", part.name):
                part.unlink(missing_ok=True)

    def open(self) -> xr.Dataset:
        """The points of the job, with texts as str; each variable is read when its values are used."""
        import xarray as xr

        with netcdf():
            dataset = xr.open_dataset(self.path, engine="netcdf4", decode_times=False, cache=False)
        dataset.attrs["points"] = self.job.points
        return dataset[self._names].isel({self.job.dimension: slice(0, self.job.points)})


def made_anew(batches: int, points: str, store: str) -> str:
    """Words on damaged batches of a store."""
    were = (
        "batch of {} in {} was damaged, and was"
        if batches == 1
        else "batches of {} in {} were damaged, and were"
    )
    return f"{batches} {were.format(points, store)} computed anew"
