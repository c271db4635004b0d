"""Runs of an FMU 2.0 or 3.0 on this machine, by fmpy: it is stepped with inputs from a table, as the reference
results inside it say, or set up at single points."""

from __future__ import annotations

import contextlib
import csv
import io
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...core.errors import InputError, RunError, printable
from ...core.files import full, scratch
from ...core.quantities import Type
from ...fmu.loading import fmi2_callbacks, loading
from ...fmu.reference import csv_bytes
from .archive import unsafe

_TYPES: Mapping[str, Type] = {
    "Real": "Real", "Float64": "Real", "Integer": "Integer", "Int32": "Integer", "Boolean": "Boolean",
}  # fmt: skip
"""By the name of a type in FMI 2.0 or 3.0, the type of this package."""


class FmuVariable(NamedTuple):
    """A variable that is a number, as the description of an FMU has it; None where it states nothing."""

    name: str
    causality: str
    kind: str
    """type by its name in FMI"""
    reference: int
    unit: str
    start: float | None
    low: float | None
    high: float | None
    nominal: float

    @property
    def type(self) -> Type:
        """Its type by the name of this package."""
        return _TYPES[self.kind]


@dataclass(frozen=True)
class UnpackedFmu:
    """An FMU in a folder: its description by fmpy, and its variables by the names of its model."""

    folder: Path
    description: Any
    variables: Mapping[str, FmuVariable]
    instead: Callable[..., Any] | None = None
    """what is called in place of fmpy's class, with the same arguments, where the FMU's own library is not used"""
    names: Mapping[str, str] = field(default_factory=dict)
    """by names of the model, those in the FMU, where they may differ"""

    @property
    def fmi(self) -> int:
        """The version of FMI, 2 or 3."""
        return 2 if self.description.fmiVersion.startswith("2") else 3

    @property
    def identifier(self) -> str:
        """The name of its library in C, without its ending."""
        return str(self.description.coSimulation.modelIdentifier)

    @property
    def name(self) -> str:
        """The name of the model."""
        return str(self.description.modelName)

    def with_names(self, names: Mapping[str, str]) -> UnpackedFmu:
        """The FMU with the names of its model for its variables; `names` has by them those in the FMU."""
        of_model = {name: model for model, name in names.items()}
        variables = [v._replace(name=of_model.get(v.name, v.name)) for v in self.variables.values()]
        return replace(self, variables={v.name: v for v in variables}, names=names)

    def of(self, causality: str) -> list[FmuVariable]:
        """The variables of a causality, in declared order."""
        return [v for v in self.variables.values() if v.causality == causality]

    def start(self, causality: str) -> dict[str, float]:
        """Start values by name."""
        return {v.name: v.start for v in self.of(causality) if v.start is not None}

    def file(self, path: str) -> bytes | None:
        """The content of a member; None where there is none."""
        place = self.folder / path
        return place.read_bytes() if place.is_file() else None

    def table(self, content: bytes) -> TimeTable:
        """A table in CSV of the FMU, with the names of the model; see `table`."""
        of_model = {name: model for model, name in self.names.items()}
        found = table(content)
        return found._replace(names=tuple(of_model.get(name, name) for name in found.names))

    def table_bytes(self, of: TimeTable) -> bytes:
        """A table in CSV, with the names in the FMU."""
        names = [self.names.get(name, name) for name in of.names]
        types = {new: self.variables[name].type for new, name in zip(names, of.names, strict=True)}
        return csv_bytes(["time", *names], np.column_stack([of.time, of.values]), types)


@contextmanager
def unpacked(members: Mapping[str, bytes], name: str) -> Iterator[UnpackedFmu]:
    """The FMU with these members in a temporary folder; `name` is its file, for errors.

    Raises
    ------
    InputError
        for members that are no FMU, or whose names lead out of the folder.
    """
    from fmpy import read_model_description

    if bad := unsafe(members):
        raise InputError(
            f"{name}: the member {printable(bad[0])!r} leads out of its folder; the file is not unpacked"
        )
    with scratch() as folder:
        for member, content in members.items():
            place = folder / member
            try:
                (place if member.endswith("/") else place.parent).mkdir(parents=True, exist_ok=True)
                if not member.endswith("/"):
                    place.write_bytes(content)
            except OSError as error:
                if full(error):
                    raise
                cause = f"cannot be unpacked ({error.strerror or error})"
                raise InputError(f"{name}: the member {printable(member)!r} {cause}") from error
        try:
            description = read_model_description(str(folder), validate=False)
        except Exception as error:  # fmpy has no class of its own
            raise InputError(f"{name}: is no FMU ({printable(str(error))})") from error
        if description.coSimulation is None or description.fmiVersion[:2] not in ("2.", "3."):
            version = printable(str(description.fmiVersion))
            raise InputError(f"{name}: is FMI {version}; must be FMI 2.0 or 3.0 with Co-Simulation")
        identifier = str(description.coSimulation.modelIdentifier)
        if re.fullmatch(r"[A-Za-z_]\w*", identifier, re.ASCII) is None:
            raise InputError(f"{name}: modelIdentifier {printable(identifier)!r}: must be a name in C")
        other = description.modelExchange and str(description.modelExchange.modelIdentifier)
        if other and other != identifier:
            raise InputError(
                f"{name}: modelIdentifier {printable(other)!r} of Model Exchange: must be that of Co-Simulation, "
                f"{identifier!r}, as one library is judged"
            )
        variables = [_variable(v) for v in description.modelVariables if v.type in _TYPES]
        yield UnpackedFmu(folder, description, {v.name: v for v in variables})


def _variable(v: Any) -> FmuVariable:
    def number(text: Any) -> float | None:
        if text in ("true", "false"):
            return float(text == "true")
        try:
            return None if text is None else float(text)
        except ValueError:
            return None

    nominal = number(v.nominal) or 1.0
    numbers = (number(v.start), number(v.min), number(v.max), nominal)
    return FmuVariable(v.name, v.causality, v.type, v.valueReference, str(v.unit or ""), *numbers)


class NoLibraryError(RunError):
    """An FMU has no library that this machine can load."""


def opened(fmu: UnpackedFmu) -> Any:
    """The library of the FMU in fmpy's class for it, or what stands in its place.

    Raises
    ------
    NoLibraryError
        where this machine cannot load the library, or an FMU by pythonfmu lacks its script.
    """
    from fmpy import fmi2, fmi3

    if reason := _lost_script(fmu):
        raise NoLibraryError(reason)
    of_class = fmu.instead or (fmi2.FMU2Slave if fmu.fmi == 2 else fmi3.FMU3Slave)
    try:
        with loading():
            return of_class(
                guid=fmu.description.guid if fmu.fmi == 2 else fmu.description.instantiationToken,
                unzipDirectory=str(fmu.folder),
                modelIdentifier=fmu.identifier,
                instanceName=fmu.identifier,  # as others call it
            )
    except Exception as error:  # fmpy has no class of its own
        raise NoLibraryError(_no_library(fmu, error)) from error


def _lost_script(fmu: UnpackedFmu) -> str:
    """Why an FMU by pythonfmu cannot be run: its library ends the process if the script is not there."""
    resources = fmu.folder / "resources"
    if not (named := resources / "slavemodule.txt").is_file():
        return ""
    script = f"{named.read_text('utf-8', 'replace').strip()}.py"
    return "" if (resources / script).is_file() else f"resources/{printable(script, 100)} is missing"


class Slave:
    """An instance for Co-Simulation of either version of FMI.

    Raises
    ------
    NoLibraryError
        where the FMU has no library for this machine.
    RunError
        where a function of the FMU fails; the message cites what it logged.
    """

    def __init__(self, fmu: UnpackedFmu) -> None:
        self._fmu, self._is_2 = fmu, fmu.fmi == 2
        self._said: list[str] = []
        self._api: Any = opened(fmu)
        self._loggers = self._logging()
        with self._told("cannot be instantiated"):
            self._api.instantiate(loggingOn=False, **self._loggers)

    def _logging(self) -> dict[str, Any]:
        """The arguments of `instantiate` by which the messages are kept; the object keeps them alive."""
        from fmpy import fmi3

        def keep(message: bytes | None) -> None:
            if message:
                self._said.append(printable(message.decode(errors="replace"), 300))

        if not self._is_2:
            return {"logMessage": fmi3.fmi3LogMessageCallback(lambda *args: keep(args[-1]))}
        return {"callbacks": fmi2_callbacks(lambda *args: keep(args[-1]))}

    @contextmanager
    def _told(self, what: str) -> Iterator[None]:
        try:
            yield
        except Exception as error:  # fmpy's classes have no common base
            cause = self._said[-1] if self._said else printable(str(error), 200)
            raise RunError(f"{self._fmu.name} {what}: {cause}") from error

    def begin(self, start: Mapping[str, float]) -> None:
        """Set start values, and pass through the initialization, from the time 0."""
        with self._told("cannot be initialized"):
            self._set(start)
            if self._is_2:
                self._api.setupExperiment(startTime=0.0)
                self._api.enterInitializationMode()
            else:
                self._api.enterInitializationMode(startTime=0.0)
            self._api.exitInitializationMode()

    def set(self, values: Mapping[str, float]) -> None:
        """Set inputs by name."""
        with self._told("refuses a value"):
            self._set(values)

    def _set(self, values: Mapping[str, float]) -> None:
        by_kind: dict[str, list[tuple[int, Any]]] = {}
        for name, value in values.items():
            variable = self._fmu.variables[name]
            number = value if variable.type == "Real" else round(value)
            by_kind.setdefault(variable.kind, []).append((variable.reference, number))
        for kind, pairs in by_kind.items():
            getattr(self._api, f"set{kind}")([r for r, _ in pairs], [x for _, x in pairs])

    def get(self, names: Sequence[str]) -> list[float]:
        """Values by name; a switch is 0 or 1."""
        variables = [self._fmu.variables[name] for name in names]
        values: dict[str, float] = {}
        with self._told("gives no values"):
            for kind in dict.fromkeys(v.kind for v in variables):
                own = [v for v in variables if v.kind == kind]
                numbers = getattr(self._api, f"get{kind}")([v.reference for v in own])
                values |= {v.name: float(x) for v, x in zip(own, numbers, strict=True)}
        return [values[name] for name in names]

    def step(self, time: float, size: float) -> None:
        """One communication step [s]."""
        with self._told(f"stops at t = {time:g} s"):
            self._api.doStep(time, size)

    def close(self) -> None:
        """End and free the instance."""
        with contextlib.suppress(Exception):
            self._api.terminate()
        with contextlib.suppress(Exception):
            self._api.freeInstance()


def _no_library(fmu: UnpackedFmu, error: Exception) -> str:
    there = sorted(path.name for path in (fmu.folder / "binaries").glob("*") if path.is_dir())
    has = f"it has those for {printable(', '.join(there))}" if there else "it has none"
    cause = str(error).replace(f"{fmu.folder}{os.sep}", "").rstrip(".")
    return f"the FMU has no library that this machine can load; {has} ({printable(cause, 300)})"


@contextmanager
def slave(fmu: UnpackedFmu, start: Mapping[str, float]) -> Iterator[Slave]:
    """An instance that is initialized with these start values, and is freed at the end."""
    running = Slave(fmu)
    try:
        running.begin(start)
        yield running
    finally:
        running.close()


class TimeTable(NamedTuple):
    """Numbers over time: names of the columns without the time, times [s] of shape (n,), values (n, columns)."""

    names: tuple[str, ...]
    time: Any
    values: Any

    def row(self, k: int) -> dict[str, float]:
        """One row by name."""
        return dict(zip(self.names, map(float, self.values[k]), strict=True))


def table(content: bytes) -> TimeTable:
    """A table in CSV with the time in its first column.

    Raises
    ------
    InputError
        where the content is no such table.
    """
    words = {"true": 1.0, "false": 0.0}
    try:
        head, *rows = csv.reader(io.StringIO(content.decode()))
        values = np.array([[words[x] if x in words else float(x) for x in row] for row in rows], float)
        if values.ndim != 2 or values.shape[1] != len(head) or head[0] != "time":
            raise ValueError("the rows do not fit the head")
    except (ValueError, csv.Error) as error:
        raise InputError(f"is no table in CSV ({printable(str(error))})") from error
    return TimeTable(tuple(head[1:]), values[:, 0], values[:, 1:])


def stepped(
    fmu: UnpackedFmu, given: TimeTable, outputs: Sequence[str], *, every: int = 1
) -> tuple[TimeTable, TimeTable]:
    """Run the FMU over every so many rows of a table of inputs, which are held from one to the next.

    Returns
    -------
    the outputs at the end of each step, before the inputs of that time are set, and after they are set.

    Raises
    ------
    RunError
        see `Slave`.
    """
    times, rows = given.time[::every], range(0, len(given.time), every)
    before, behind = [], []
    with slave(fmu, given.row(0)) as running:
        for k, row in enumerate(rows):
            before.append(running.get(outputs))
            running.set(given.row(row))
            behind.append(running.get(outputs))
            if k + 1 < len(times):
                running.step(float(times[k]), float(times[k + 1] - times[k]))
    names = tuple(outputs)
    return (
        TimeTable(names, times, np.array(before, float)),
        TimeTable(names, times, np.array(behind, float)),
    )


def sizes(of: TimeTable, fmu: UnpackedFmu) -> Any:
    """The size of each column for the comparison of two tables: its peak, at least a thousandth of the nominal size
    of its variable, shape (columns,)."""
    peaks = np.max(np.abs(of.values), axis=0, initial=0.0)
    return np.maximum(peaks, [1e-3 * fmu.variables[name].nominal for name in of.names])


def deviation(got: TimeTable, wanted: TimeTable, fmu: UnpackedFmu) -> tuple[float, str]:
    """The largest deviation of a table from the wanted one, over the size of its column, with the name of that;
    infinite where a number is none, and for other columns or times."""
    if got.names != wanted.names or got.values.shape != wanted.values.shape:
        return float("inf"), "the columns or rows"
    if not np.allclose(got.time, wanted.time, rtol=0.0, atol=1e-9):
        return float("inf"), "the time"
    if not wanted.names:
        return 0.0, ""
    gaps = np.max(np.abs(got.values - wanted.values), axis=0, initial=0.0) / sizes(wanted, fmu)
    gaps = np.where(np.isfinite(gaps), gaps, np.inf)
    worst = int(np.argmax(gaps))
    return float(gaps[worst]), wanted.names[worst]
