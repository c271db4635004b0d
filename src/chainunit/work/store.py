"""The results of a job in a folder: a Zarr store (format 3), in which each batch is one chunk of each variable.

One process writes. A chunk appears whole or not at all, and the checksum of a batch is written after its chunks:
a batch without the right checksum is missing. The bytes of the store follow from the job alone, and not from the
order of the batches or the number of kills between them. Any reader of Zarr reads the store::

    xarray.open_zarr("results/monte_carlo_0123456789ab.zarr", consolidated=False)
"""

from __future__ import annotations

import json
import re
import zlib
from collections.abc import AsyncIterator, Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import __version__
from ..core.errors import RunError
from ..core.files import atomic_file, writing
from ..core.inputs import regular_bytes
from .job import BATCH, CHECKS, Job, ResultVariable, text_array

if TYPE_CHECKING:
    import xarray as xr

_GROUP = "zarr.json"
_LEVEL = 1  # of zstd: results are noise in their last digits, so that more effort gains little


class BatchStore:
    """The store of a `job` at `path`, which is made where it is missing and mended where its declaration is
    damaged. A store that already has more points than the job keeps them.

    Raises
    ------
    WriteError
        where the store cannot be written.
    """

    def __init__(self, job: Job, path: Path) -> None:
        self.job, self.path = job, path
        self.earlier_points = self._stored_points()
        """number of points that the store was made for before, complete or not"""
        self.points = max(job.points, self.earlier_points)
        self._chunks: dict[str, Any] = {}
        self._arrays = self._declare()
        self._layout = job.layout()
        for name, content in self._chunks.items():
            self._put(path / name, content.to_bytes(), only_changes=True)
        self._chunks.clear()

    def _stored_points(self) -> int:
        try:
            points = json.loads(regular_bytes(self.path / _GROUP) or b"")["attributes"]["points"]
        except (ValueError, KeyError, TypeError):
            return 0
        return points if isinstance(points, int) and points > 0 else 0

    def _declare(self) -> dict[str, Any]:
        """The arrays by their names, in memory: their declarations, and later single chunks of them."""
        import zarr
        from zarr.codecs import ZstdCodec
        from zarr.storage import MemoryStore

        job = self.job
        attributes = {"title": job.title, "source": f"chainunit {__version__}", "points": self.points}
        group = zarr.create_group(MemoryStore(self._chunks), zarr_format=3, attributes=attributes)

        def array(name: str, shape: Any, chunks: Any, dims: Any, kind: Any, fill: Any, about: Any) -> Any:
            # an empty chunk is written, too, so that a chunk that is missing is noticed
            return group.create_array(
                name,
                shape=shape,
                chunks=tuple(max(1, n) for n in chunks),
                dtype=kind,
                fill_value=fill,
                compressors=None if name == CHECKS else ZstdCodec(level=_LEVEL),
                dimension_names=dims,
                attributes=about,
                config={"write_empty_chunks": True},
            )

        arrays = {}
        for v in job.variables:
            shape = job.shape(v)
            arrays[v.name] = array(
                v.name, (self.points, *shape), (job.batch, *shape), job.dims(v), v.kind, v.fill, v.attributes
            )
        for c in job.coordinates:
            about, size = {"units": c.unit, "long_name": c.description}, (len(c.values),)
            array(c.name, size, size, (c.name,), np.dtype("<f8"), 0.0, about)[:] = np.array(c.values)
        about = {"units": "1", "long_name": "CRC-32 of the chunks of a batch"}
        count = job.batches(self.points)
        arrays[CHECKS] = array(CHECKS, (count,), (1,), (BATCH,), np.dtype("<u4"), 0, about)
        return arrays

    def extent(self, batch: int, points: int | None = None) -> tuple[int, int]:
        """The first point of a batch, and the first one behind it."""
        begin = batch * self.job.batch
        return begin, min(begin + self.job.batch, self.points if points is None else points)

    def missing(self, progress: Callable[[int], None]) -> tuple[list[int], int]:
        """The batches of the job that the store does not have, and how many of these it has damaged. `progress`
        is called with the number of points that are complete."""
        gaps, damaged, complete = [], 0, 0
        for batch in range(self.job.batches()):
            begin, end = self.extent(batch)
            mark = self._read(CHECKS, batch)
            if mark is not None and mark == self._mark(batch, [self._read(v, batch) for v in self._names]):
                complete += min(end, self.job.points) - begin
                if batch % 1000 == 999:
                    progress(complete)
                continue
            gaps.append(batch)
            # the last batch of an earlier, smaller number of points is incomplete, and not damaged
            damaged += mark is not None and end == self.extent(batch, self.earlier_points)[1]
        if gaps:
            self._remove_leftovers()
        progress(complete)
        return gaps, damaged

    @property
    def _names(self) -> list[str]:
        return [v.name for v in self.job.variables]

    def _file(self, name: str, batch: int) -> Path:
        others = self._arrays[name].ndim - 1
        return self.path / name / "/".join(["c", str(batch), *["0"] * others])

    def _read(self, name: str, batch: int) -> bytes | None:
        """The bytes of a chunk; None where it has no file."""
        return regular_bytes(self._file(name, batch))

    def _mark(self, batch: int, chunks: list[bytes | None]) -> bytes | None:
        """The checksum of a batch as it is stored: of the declaration, the extent of the batch, and its chunks.
        None where a chunk is missing."""
        check = zlib.crc32(f"{self.extent(batch)}".encode(), zlib.crc32(self._layout))
        for chunk in chunks:
            if chunk is None:
                return None
            check = zlib.crc32(chunk, check)
        return check.to_bytes(4, "little")

    def write(self, batch: int, results: Mapping[str, Any]) -> None:
        """Write the results of a batch as whole chunks, and then its checksum.

        Raises
        ------
        RunError
            for results that the job does not declare.
        WriteError
            where a file cannot be written.
        """
        begin, end = self.extent(batch)
        if set(results) != set(self._names):
            raise RunError(f"{self.job.title}: the results are {sorted(results)}, must be {self._names}")
        chunks = []
        for v in self.job.variables:
            file = self._file(v.name, batch)
            self._arrays[v.name][begin:end] = self._values(v, results[v.name], end - begin)
            # the array has put the chunk into the dictionary of its store, under the name of its file
            content = self._chunks.pop(file.relative_to(self.path).as_posix()).to_bytes()
            self._put(file, content)
            chunks.append(content)
        mark = self._mark(batch, chunks)
        assert mark is not None
        self._put(self._file(CHECKS, batch), mark)

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

    def _put(self, file: Path, content: bytes, *, only_changes: bool = False) -> None:
        if only_changes and regular_bytes(file) == content:
            return
        with writing(file):
            file.parent.mkdir(parents=True, exist_ok=True)
        with atomic_file(file, is_result=False) as part:
            part.write_bytes(content)

    def _remove_leftovers(self) -> None:
        """Remove the temporary files of a process that was killed while it wrote; see `atomic_file`."""
        for part in self.path.rglob("*.part"):
            if re.search(r"\.[0-9a-f]{16}\.part$", part.name):
                part.unlink(missing_ok=True)

    def open(self) -> xr.Dataset:
        """The points of the job; each variable is read when its values are used. `Dataset.chunk` makes Dask arrays
        of them, for more points than the memory holds."""
        import xarray as xr

        own = _store_of(self.path, frozenset({*self._arrays, *(c.name for c in self.job.coordinates)}))
        dataset = xr.open_zarr(own, chunks=None, consolidated=False, decode_times=False)
        dataset.attrs["points"] = self.job.points
        return dataset[self._names].isel({self.job.dimension: slice(0, self.job.points)})


def _store_of(path: Path, names: frozenset[str]) -> Any:
    """The store with its own arrays alone: what others have put beside them is not read."""
    from zarr.storage import LocalStore, WrapperStore

    class OwnArrays(WrapperStore):  # type: ignore[misc]
        """A store that lists no other names."""

        async def list_dir(self, prefix: str) -> AsyncIterator[str]:
            async for name in super().list_dir(prefix):
                if prefix or name in names:
                    yield name

    return OwnArrays(LocalStore(path, read_only=True))


def made_anew(batches: int, points: str, store: str) -> str:
    """Words on damaged batches of a store."""
    were = (
        "batch of {} in {} was damaged, and was"
        if batches == 1
        else "batches of {} in {} were damaged, and were"
    )
    return f"{batches} {were.format(points, store)} computed anew"
