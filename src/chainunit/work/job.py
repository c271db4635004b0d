"""Long work that is made in batches: points, results, the function that makes them, and the file of the results.

One process writes the NetCDF file, batch by batch. Each value has its place in it from the begin, and the checksum of
a batch is written after its values: a batch without the right checksum is missing. The bytes of the file follow from
the job alone, and not from the order of the batches or the number of kills between them.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from .. import __version__
from ..core.errors import InputError, WriteError
from ..core.files import atomic_file, netcdf, writing

if TYPE_CHECKING:
    import xarray as xr

CHECKS = "batch_checksum"
"""Name of the variable with the checksum of each batch."""
_FORMAT: Literal["NETCDF3_64BIT_DATA"] = "NETCDF3_64BIT_DATA"
"""The classic format: a kill between two writes leaves all other values as they are."""


@dataclass(frozen=True)
class ResultVariable:
    """A result of each point.

    Parameters
    ----------
    unit : as in `chainunit.core.quantities`
    dtype : a NumPy type of numbers: ``float64``, ``float32``, or an integer type
    flags : words for the integers 0, 1, ... of a variable that is a choice (CF: flag_values, flag_meanings)
    letters : the longest text [bytes in UTF-8] of a variable that is a text; a longer text is cut
    """

    name: str
    unit: str
    description: str
    dtype: str = "float64"
    flags: tuple[str, ...] = ()
    letters: int = 0

    @property
    def attributes(self) -> dict[str, Any]:
        """The attributes of the stored variable, by the CF conventions."""
        attributes: dict[str, Any] = {"units": self.unit, "long_name": self.description}
        if self.flags:
            attributes["flag_values"] = np.arange(len(self.flags), dtype=self.dtype)
            attributes["flag_meanings"] = " ".join(self.flags)
        return attributes | ({"_Encoding": "utf-8"} if self.letters else {})

    def stored(self, values: Any) -> np.ndarray:
        """The values of some points as they are stored, texts as bytes in UTF-8, shape (n, letters)."""
        if not self.letters:
            return np.asarray(values).astype(self.dtype, casting="same_kind")
        # a longer text is cut between two characters
        cut = [text.encode()[: self.letters].decode(errors="ignore").encode() for text in values]
        return np.array(cut, f"S{self.letters}").reshape(-1, 1).view("S1")


@dataclass(frozen=True)
class Job:
    """Work on `points` points in batches of `batch`.

    Parameters
    ----------
    name : begin of the file name of the store, in letters, digits and ``_``
    title : the work in words, for progress and messages
    batch : number of points of a batch. A batch should take a second
        or so: less than 0.1 s is lost in messages between processes, and a batch in work is lost at a kill
    work : ``work(task, begin, end)`` gives the results of the points from `begin` to `end` - 1, by the names of the
        `variables`, each of shape (end - begin,); of a text a list of texts. A worker must be able to import it
    digest : digest of everything on which the results depend, the number of points apart, in hexadecimal digits
    dimension : name of the dimension of the points
    """

    name: str
    title: str
    points: int
    batch: int
    variables: Sequence[ResultVariable]
    work: Callable[[Any, int, int], Mapping[str, Any]]
    task: Any
    digest: str
    dimension: str = "point"

    @property
    def store_name(self) -> str:
        """Name of the file that is the store."""
        return f"{self.name}_{self.digest[:12]}.nc"

    @property
    def layout(self) -> str:
        """A digest of the declaration of the results, without the number of points, in hexadecimal digits."""
        variables = [[v.name, v.unit, v.dtype, v.flags, v.letters] for v in self.variables]
        text = json.dumps([self.digest, self.dimension, self.batch, variables])
        return hashlib.sha256(text.encode()).hexdigest()


class BatchStore:
    """The store of a `job` in a folder, which is made if it is missing or has another declaration. One with fewer
    points grows; one with more points keeps them.

    Raises
    ------
    InputError
        if its file is no regular one.
    WriteError
        if it cannot be written.
    """

    earlier_points = 0
    """number of points that the store had before"""
    damaged_batches = 0
    """number of batches that the store had in part or with other bytes than were written"""

    def __init__(self, job: Job, folder: Path) -> None:
        self.job, self.file = job, folder / job.store_name
        self._names = [v.name for v in job.variables]
        earlier = 0
        if self.file.exists():
            if not self.file.is_file():
                raise InputError(f"{self.file}: is not a regular file; remove it")
            with contextlib.suppress(WriteError, AttributeError), self._opened() as stored:
                if stored.declaration == job.layout:
                    earlier = len(stored.dimensions[job.dimension])
        self._points = max(job.points, earlier)
        if self._points > earlier:
            self._make(earlier)

    def _make(self, earlier: int) -> None:
        """Make the file for all points, with the whole batches of a smaller one with the `earlier` points."""
        with atomic_file(self.file, is_result=False) as part, self._opened("w", part) as new:
            new.set_fill_off()  # a batch that is not written has the checksum 0
            self._declare(new)
            if earlier:
                with self._opened() as old:
                    for batch in range(earlier // self.job.batch):
                        for name in self._names:
                            new[name][slice(*self.extent(batch))] = old[name][slice(*self.extent(batch))]
                        new[CHECKS][batch] = old[CHECKS][batch]

    def _declare(self, file: Any) -> None:
        """Write the dimensions, the variables and the attributes of an empty file."""
        job = self.job
        file.setncatts({"title": job.title, "source": f"chainunit {__version__}", "declaration": job.layout})
        file.createDimension(job.dimension, self._points)
        file.createDimension("batch", -(-self._points // job.batch))
        for v in job.variables:
            dims = [job.dimension] + ([f"{v.name}_letter"] if v.letters else [])
            if v.letters:
                file.createDimension(dims[1], v.letters)
            file.createVariable(v.name, "S1" if v.letters else v.dtype, dims).setncatts(v.attributes)
        attributes = {"units": "1", "long_name": "CRC-32 of the values of a batch"}
        file.createVariable(CHECKS, "u4", ("batch",)).setncatts(attributes)
        # the values as they are
        file.set_auto_maskandscale(False)
        file.set_auto_chartostring(False)

    @contextlib.contextmanager
    def _opened(self, mode: Literal["r", "r+", "w"] = "r", part: Path | None = None) -> Iterator[Any]:
        """The file of the store, with its values as they are stored."""
        from netCDF4 import Dataset

        with writing(self.file), netcdf(), Dataset(part or self.file, mode, format=_FORMAT) as file:
            file.set_auto_maskandscale(False)
            file.set_auto_chartostring(False)
            yield file

    def extent(self, batch: int) -> tuple[int, int]:
        """The first point of a batch, and the first one of the next."""
        begin = batch * self.job.batch
        return begin, min(begin + self.job.batch, self._points)

    def size(self, batch: int) -> int:
        """The number of points of a batch that the job asks for."""
        begin, end = self.extent(batch)
        return min(end, self.job.points) - begin

    def missing(self, progress: Callable[[int], None]) -> list[int]:
        """The batches of the job that the store does not have. `progress` is called with the number of points that
        are complete."""
        gaps = []
        with self._opened() as file:
            marks = file[CHECKS][:]
            for batch in range(-(-self.job.points // self.job.batch)):
                if marks[batch] and marks[batch] == self._mark(file, batch):
                    self.earlier_points += self.size(batch)
                    if batch % 1000 == 999:
                        progress(self.earlier_points)
                else:
                    gaps.append(batch)
                    self.damaged_batches += bool(marks[batch])
        progress(self.earlier_points)
        return gaps

    def _mark(self, file: Any, batch: int) -> int:
        """The checksum of a batch: of the declaration, the extent of the batch, and its values as they are stored."""
        begin, end = self.extent(batch)
        check = zlib.crc32(f"{self.job.layout}{begin, end}".encode())
        for name in self._names:
            check = zlib.crc32(np.ascontiguousarray(file[name][begin:end]).tobytes(), check)
        return check

    def write(self, batch: int, results: Mapping[str, Any]) -> None:
        """Write the results of a batch, and then its checksum.

        Raises
        ------
        WriteError
            if the file cannot be written.
        """
        begin, end = self.extent(batch)
        with self._opened("r+") as file:
            for v in self.job.variables:
                self._put(file, v.name, slice(begin, end), v.stored(results[v.name]))
            self._put(file, CHECKS, batch, np.uint32(self._mark(file, batch)))

    def _put(self, file: Any, name: str, place: slice | int, values: Any) -> None:
        file[name][place] = values
        file.sync()

    @property
    def dataset(self) -> xr.Dataset:
        """The points of the job, with texts as str, opened lazily: a variable is read when its values are used."""
        import xarray as xr

        with netcdf():
            dataset = xr.open_dataset(self.file, engine="netcdf4", decode_times=False, cache=False)
        dataset.attrs["points"] = self.job.points
        return dataset[self._names].isel({self.job.dimension: slice(0, self.job.points)})


def made_anew(batches: int, points: str, store: str) -> str:
    """Words on damaged batches of a store."""
    noun, verb = ("batch", "was") if batches == 1 else ("batches", "were")
    return f"{batches} {noun} of {points} in {store} {verb} damaged, and {verb} computed anew"
