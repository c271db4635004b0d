"""Declares long work that is made in batches: how many points, which results, and the function that makes them."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from ..core.quantities import base_units

Work: TypeAlias = Callable[[Any, int, int], Mapping[str, Any]]
"""``work(task, begin, end)``: the results of the points from `begin` to `end` - 1, by the names of the result
variables, each of shape (end - begin, ...); of a text variable a list of end - begin texts."""
CHECKS = "batch_checksum"
"""Name of the variable with the checksum of each batch in the store of a job."""
BATCH = "batch"
"""Name of its dimension."""
DECLARATION = "declaration"
"""Name of the variable with the digest of the declaration in the store of a job."""
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


@dataclass(frozen=True)
class Coordinate:
    """A dimension of a result beside the points, with its values, shape (n,)."""

    name: str
    values: tuple[float, ...]
    unit: str
    description: str


@dataclass(frozen=True)
class ResultVariable:
    """A result of each point.

    Parameters
    ----------
    name : a name as in Python; it is that of the variable in the store
    unit : as in `chainunit.core.quantities`
    dtype : a NumPy type of numbers: ``float64``, ``float32``, or an integer type
    dims : names of the coordinates beside the points, in order
    flags : words for the integers 0, 1, ... of a variable that is a choice (CF: flag_values, flag_meanings)
    letters : the longest text [bytes in UTF-8] of a variable that is a text; a longer text is cut
    """

    name: str
    unit: str
    description: str
    dtype: str = "float64"
    dims: tuple[str, ...] = ()
    flags: tuple[str, ...] = ()
    letters: int = 0

    @property
    def kind(self) -> np.dtype:
        """The type of the stored values."""
        return np.dtype("S1" if self.letters else self.dtype)

    @property
    def attributes(self) -> dict[str, Any]:
        """The attributes of the stored variable, by the CF conventions."""
        attributes: dict[str, Any] = {"units": self.unit, "long_name": self.description}
        if self.flags:
            attributes["flag_values"] = np.arange(len(self.flags), dtype=self.kind)
            attributes["flag_meanings"] = " ".join(self.flags)
        if self.letters:
            attributes["_Encoding"] = "utf-8"
        return attributes


@dataclass(frozen=True)
class Job:
    """Work on `points` points in batches of `batch`.

    The store of a job is called by its `name` and the first digits of its `digest`; the `digest` must differ
    where any result differs, the number of points apart. A store may grow: a job with more points goes on from
    the batches of one with fewer.

    Parameters
    ----------
    name : begin of the file name of the store, in letters, digits and ``_``
    title : the work in words, for progress and messages
    points : number of points
    batch : number of points of a batch. A batch should take a second
        or so: less than 0.1 s is lost in messages between processes, and a batch in work is lost at a kill
    variables : the results of a point
    work : the function that makes a batch; it is pickled by its name, so that it must be at the top of a module
        that a worker can import. Each process calls it from one thread at a time
    task : what `work` gets; it is pickled and sent once to each worker
    digest : digest of everything on which the results depend, in hexadecimal digits
    dimension : name of the dimension of the points
    coordinates : the dimensions beside it
    close : function that releases what `work` keeps in its process from batch to batch; called at the end

    Raises
    ------
    ValueError
        for a declaration that no store can have.
    """

    name: str
    title: str
    points: int
    batch: int
    variables: Sequence[ResultVariable]
    work: Work
    task: Any
    digest: str
    dimension: str = "point"
    coordinates: Sequence[Coordinate] = ()
    close: Callable[[], None] | None = None

    def __post_init__(self) -> None:
        if self.points < 0 or self.batch < 1:
            raise ValueError(f"a job of {self.points} points in batches of {self.batch}")
        names = [v.name for v in self.variables] + [c.name for c in self.coordinates]
        names += [CHECKS, self.dimension, BATCH, DECLARATION]
        wrong = [name for name in (self.name, *names) if not _NAME.fullmatch(name)]
        if wrong or len(set(names)) < len(names):
            raise ValueError(f"names of a job must be plain and differ: {wrong or names}")
        for variable in self.variables:
            base_units(variable.unit)
            self.shape(variable)
        if not re.fullmatch(r"[0-9a-f]{8,}", self.digest):
            raise ValueError(f"digest {self.digest!r}: must be at least 8 hexadecimal digits")

    @property
    def store_name(self) -> str:
        """Name of the file that is the store."""
        return f"{self.name}_{self.digest[:12]}.nc"

    def batches(self, points: int | None = None) -> int:
        """The number of batches, of all points by default."""
        return -(-(self.points if points is None else points) // self.batch)

    def shape(self, variable: ResultVariable) -> tuple[int, ...]:
        """The shape of a variable at one point."""
        sizes = {each.name: len(each.values) for each in self.coordinates}
        unknown = [name for name in variable.dims if name not in sizes]
        if unknown or (variable.letters and variable.dims):
            raise ValueError(f"{variable.name}: dimension {unknown or variable.dims} has no coordinate")
        return (variable.letters,) if variable.letters else tuple(sizes[name] for name in variable.dims)

    def dims(self, variable: ResultVariable) -> tuple[str, ...]:
        """The names of the dimensions of a stored variable."""
        return (self.dimension, *((f"{variable.name}_letter",) if variable.letters else variable.dims))

    def layout(self) -> bytes:
        """A digest of the declaration of the results, without the number of points, in hexadecimal digits."""
        variables = [
            [v.name, v.unit, v.kind.str, self.dims(v), self.shape(v), v.flags] for v in self.variables
        ]
        axes = [[c.name, c.unit, list(c.values)] for c in self.coordinates]
        text = json.dumps([self.digest, self.dimension, self.batch, variables, axes])
        return hashlib.sha256(text.encode()).hexdigest().encode()


def text_array(texts: Sequence[str], letters: int) -> np.ndarray:
    """Texts as an array of their bytes in UTF-8, shape (n, letters), with zeros behind; a longer text is cut
    between two characters."""
    cut = [text.encode()[:letters].decode(errors="ignore").encode() for text in texts]
    return np.array(cut, f"S{letters}").reshape(-1, 1).view("S1")
