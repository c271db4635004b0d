"""One FMU 2.0 co-simulation instance on fmpy, by variable name."""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import logging
import os
import re
import shutil
import tempfile
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..errors import InputError, RunError, printable, shown

log = logging.getLogger("chainunit.fmu")
_WARNING, _FATAL = 1, 4  # of fmi2Status
_working_directory = threading.Lock()
"""Held while fmpy loads a library: all threads of the process have one working directory."""
_unpacked: set[str] = set()
"""Folders of the FMUs that this process has unpacked."""


@atexit.register
def remove_unpacked() -> None:
    """Remove the files of every FMU that nobody closed, for a process that ends."""
    while _unpacked:
        shutil.rmtree(_unpacked.pop(), ignore_errors=True)


class Fmu:
    """An FMU file, unpacked once; instances come from `instantiate`."""

    def __init__(self, file: Path) -> None:
        from fmpy import extract, read_model_description

        self.file = file
        if not Path(file).is_file():
            raise InputError(f"{file}: no such FMU")
        self.folder = tempfile.mkdtemp(prefix="chainunit_fmu_")
        _unpacked.add(self.folder)
        try:
            extract(str(file), unzipdir=self.folder)
            self.description = read_model_description(self.folder, validate=False)
            self.identifier = self._checked()
        except BaseException as error:
            self.close()
            if isinstance(error, InputError) or not isinstance(error, Exception):
                raise
            raise InputError(f"{file}: is no FMU ({printable(str(error))})") from error
        self.variables = {v.name: v for v in self.description.modelVariables}

    def _checked(self) -> str:
        """Its model identifier, where it is an FMU that can run here."""
        description = self.description
        if description.fmiVersion != "2.0" or description.coSimulation is None:
            kind = "Co-Simulation" if description.coSimulation else "Model Exchange alone"
            raise InputError(
                f"{self.file}: is FMI {printable(description.fmiVersion)}, {kind}; must be FMI 2.0 for Co-Simulation"
            )
        identifier = description.coSimulation.modelIdentifier
        # it becomes part of a path: a foreign one must not lead out of the folder
        if re.fullmatch(r"[A-Za-z_]\w*", identifier, re.ASCII) is None:
            raise InputError(
                f"{self.file}: modelIdentifier = {shown(identifier)}: must be a name in C (letters, digits, _)"
            )
        return str(identifier)

    def outputs(self) -> list[str]:
        """Names of the outputs, in declared order."""
        return [name for name, v in self.variables.items() if v.causality == "output"]

    def feedthrough(self) -> dict[str, set[str]]:
        """Of each output: the inputs that it depends on directly."""
        inputs = {name for name, v in self.variables.items() if v.causality == "input"}
        depends: dict[str, set[str]] = {}
        for unknown in self.description.outputs:
            known = unknown.dependencies
            depends[unknown.variable.name] = inputs if known is None else {v.name for v in known} & inputs
        return depends

    def close(self) -> None:
        """Remove the unpacked files."""
        shutil.rmtree(self.folder, ignore_errors=True)
        _unpacked.discard(self.folder)


def _unloadable(fmu: Fmu, error: Exception) -> str:
    """Why the library of an FMU cannot be loaded."""
    from fmpy import platform, sharedLibraryExtension

    library = f"binaries/{platform}/{fmu.identifier}{sharedLibraryExtension}"
    if (Path(fmu.folder) / library).is_file():
        return f"its library {library} cannot be loaded ({printable(str(error))})"
    there = sorted(p.name for p in Path(fmu.folder, "binaries").glob("*"))
    has = f"it has those for {printable(', '.join(there))}" if there else "it has none"
    return f"has no library for this machine, {library}; {has}"


class Instance:
    """A running instance; every failing call becomes a `RunError` that cites what the FMU logged."""

    def __init__(self, fmu: Fmu, name: str, journal: list[str] | None = None) -> None:
        """`journal` takes what the FMU says, for several instances in the order in which they said it."""
        from fmpy import calloc, free
        from fmpy import fmi2 as api

        self.fmu = fmu
        self.name = name
        self.messages: list[str] = []

        def logger(_env: Any, _name: Any, status: int, _category: Any, message: bytes | None) -> None:
            if message and status > 0:
                text = printable(message.decode(errors="replace"), 500)
                self.messages.append(text)
                if journal is not None:
                    journal.append(f"{name}: {text}")
                log.warning("%s: %s", name, text)

        self._callbacks = api.fmi2CallbackFunctions()
        self._callbacks.logger = api.fmi2CallbackLoggerTYPE(logger)
        self._callbacks.allocateMemory = api.fmi2CallbackAllocateMemoryTYPE(calloc)
        self._callbacks.freeMemory = api.fmi2CallbackFreeMemoryTYPE(free)
        self._alive = False
        with _working_directory:
            here = Path.cwd()
            try:
                self._fmi = api.FMU2Slave(
                    guid=fmu.description.guid,
                    unzipDirectory=fmu.folder,
                    modelIdentifier=fmu.identifier,
                    instanceName=name,
                )
            except Exception as error:  # fmpy knows no class of its own for this
                raise InputError(f"{fmu.file}: {_unloadable(fmu, error)}") from error
            finally:
                os.chdir(here)  # fmpy goes to the library, and stays there on an error or an interrupt
        try:
            self._fmi.instantiate(callbacks=self._callbacks, loggingOn=True)
        except Exception as error:
            said = f": {self.messages[-1]}" if self.messages else ""
            raise RunError(f"{name}: cannot be instantiated{said}") from error
        self._alive = True
        # the functions that a run calls at every step, without fmpy's layer around them, which takes twice their time
        library, self._component = self._fmi.dll, self._fmi.component
        self._get, self._set, self._step = library.fmi2GetReal, library.fmi2SetReal, library.fmi2DoStep

    def _call(self, what: str, function: Any, *args: Any) -> Any:
        from fmpy.fmi1 import FMICallException

        try:
            return function(*args)
        except FMICallException as error:
            raise self._failure(what, error.status) from error

    def _failure(self, what: str, status: int) -> RunError:
        if status == _FATAL:
            self._alive = False
        said = f": {self.messages[-1]}" if self.messages else ""
        return RunError(f"{self.name}: {what} ended with status {status}{said}")

    def initialize(self, start: Mapping[str, float], time: float) -> None:
        """Set start values and enter the initialization mode; `finish_initialization` leaves it."""
        self._call("setup", self._fmi.setupExperiment, None, time)
        self.set(list(start), list(start.values()))
        self._call("initialization", self._fmi.enterInitializationMode)

    def finish_initialization(self) -> None:
        """Leave the initialization mode."""
        self._call("initialization", self._fmi.exitInitializationMode)

    def handle(self, names: Sequence[str]) -> tuple[Any, Any, int]:
        """Value references and room for their values, for `read` and `write`."""
        n = len(names)
        references = (ctypes.c_uint * n)(*(self.fmu.variables[name].valueReference for name in names))
        return references, (ctypes.c_double * n)(), n

    def read(self, handle: tuple[Any, Any, int]) -> Sequence[float]:
        """Values behind a handle."""
        references, values, n = handle
        status = self._get(self._component, references, n, values)
        if status > _WARNING:
            raise self._failure("reading values", status)
        return values

    def write(self, handle: tuple[Any, Any, int], new: Sequence[float]) -> None:
        """Set the values behind a handle."""
        references, values, n = handle
        values[:] = new
        status = self._set(self._component, references, n, values)
        if status > _WARNING:
            raise self._failure("setting values", status)

    def get(self, names: Sequence[str]) -> list[float]:
        """Values by name."""
        return list(self.read(self.handle(names)))

    def set(self, names: Sequence[str], values: Sequence[float]) -> None:
        """Set values by name."""
        if names:
            self.write(self.handle(names), values)

    def step(self, time: float, step: float) -> None:
        """One communication step."""
        status = self._step(self._component, time, step, 1)
        if status > _WARNING:
            raise self._failure(f"step at t = {time:g} s", status)

    def state(self) -> Any:
        """The FMU's state, for `restore`."""
        return self._call("saving the state", self._fmi.getFMUState)

    def restore(self, state: Any) -> None:
        """Return to a saved state."""
        self._call("restoring the state", self._fmi.setFMUState, state)

    def forget(self, state: Any) -> None:
        """Free a saved state."""
        if not self._alive:
            return
        self._call("freeing a state", self._fmi.freeFMUState, state)

    def close(self) -> None:
        """End and free the instance; one that reported a fatal error must not be called again."""
        if not self._alive:
            return
        self._alive = False
        with contextlib.suppress(Exception):
            self._fmi.terminate()
        self._fmi.freeInstance()
