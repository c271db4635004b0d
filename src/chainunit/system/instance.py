"""FMUs 2.0 and their instances on fmpy, by variable name: Co-Simulation and Model Exchange."""

from __future__ import annotations

import contextlib
import ctypes
import logging
import math
import re
import shutil
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal
from xml.etree.ElementTree import Element

from ..core.errors import InputError, RunError, printable, shown
from ..core.inputs import ON_DISK, XML, check_archive, regular, xml_of
from ..fmu.loading import fmi2_callbacks, loading

log = logging.getLogger("chainunit.fmu")
_WARNING, _DISCARD, _FATAL = 1, 2, 4  # of fmi2Status
NUMBERS: Mapping[str, Any] = {"Real": ctypes.c_double, "Integer": ctypes.c_int, "Boolean": ctypes.c_int}
"""By type of the variables that this package takes for numbers, how FMI 2.0 passes them: false is 0, true is 1."""
_WHOLE = {
    "Integer": (-(2.0**31), 2.0**31 - 1.0, "a whole number of 32 bits"),
    "Boolean": (0.0, 1.0, "0 or 1"),
}
Kind = Literal["Co-Simulation", "Model Exchange"]
"""Interface of an FMU."""


class DiscardError(RunError):
    """An FMU cannot compute at a point; at a point nearer to the last one it may."""


class Fmu:
    """An FMU file, unpacked once; instances come from `Instance` and `ExchangeInstance`.

    Parameters
    ----------
    file : the FMU
    kind : interface that the FMU must have
    names : by the name that callers use, the name in the FMU, where they differ

    Raises
    ------
    InputError
        where the file is no FMU, or the FMU does not have that interface.
    """

    def __init__(
        self, file: Path, kind: Kind = "Co-Simulation", names: Mapping[str, str] | None = None
    ) -> None:
        from fmpy import extract, read_model_description

        self.file, self.kind = file, kind
        if not Path(file).exists():
            raise InputError(f"{file}: no such FMU")
        check_archive(regular(Path(file)), str(file), ON_DISK, "FMU")
        self.folder = tempfile.mkdtemp(prefix="chainunit_fmu_")
        self._remove = weakref.finalize(self, shutil.rmtree, self.folder, ignore_errors=True)
        try:
            extract(str(file), unzipdir=self.folder)
            if self.document("modelDescription.xml") is None:
                raise InputError(f"{file}: is no FMU (it has no modelDescription.xml)")
            self.description = read_model_description(self.folder, validate=False)
            self.interface = self._interface()
        except BaseException as error:
            self.close()
            if isinstance(error, InputError) or not isinstance(error, Exception):
                raise
            raise InputError(f"{file}: is no FMU ({printable(str(error))})") from error
        ours = {theirs: name for name, theirs in (names or {}).items()}
        for variable in self.description.modelVariables:
            variable.name = ours.get(variable.name, variable.name)
        self.variables = {v.name: v for v in self.description.modelVariables}

    def document(self, path: str) -> Element | None:
        """A document of the FMU in XML; None where it has none.

        Raises
        ------
        InputError
            for one that cannot be read.
        """
        place = Path(self.folder) / path
        if not place.is_file():
            return None
        with place.open("rb") as stream:
            return xml_of(stream.read(XML + 1), f"{self.file}: {path}")

    @property
    def identifier(self) -> str:
        """Name of the FMU's library."""
        return str(self.interface.modelIdentifier)

    def _interface(self) -> Any:
        """The description of the interface `kind`, checked so that the FMU can run here."""
        description = self.description
        there = {"Co-Simulation": description.coSimulation, "Model Exchange": description.modelExchange}
        interface = there[self.kind]
        if description.fmiVersion != "2.0" or interface is None:
            has = (
                self.kind
                if interface
                else f"{next((k for k in there if there[k]), 'of no known kind')} alone"
            )
            raise InputError(
                f"{self.file}: is FMI {printable(description.fmiVersion)}, {has}; must be FMI 2.0 for {self.kind}"
            )
        identifier = interface.modelIdentifier
        # the identifier becomes part of a path, which must not lead out of the folder
        if re.fullmatch(r"[A-Za-z_]\w*", identifier, re.ASCII) is None:
            raise InputError(
                f"{self.file}: modelIdentifier = {shown(identifier)}: must be a name in C (letters, digits, _)"
            )
        return interface

    def outputs(self) -> list[str]:
        """Names of the outputs that are numbers, in declared order."""
        return [name for name, v in self.variables.items() if v.causality == "output" and v.type in NUMBERS]

    def feedthrough(self) -> dict[str, set[str] | None]:
        """By output, the inputs on which it depends directly; None where the FMU does not declare them."""
        inputs = {name for name, v in self.variables.items() if v.causality == "input"}
        return {
            unknown.variable.name: None
            if unknown.dependencies is None
            else {v.name for v in unknown.dependencies} & inputs
            for unknown in self.description.outputs
        }

    def close(self) -> None:
        """Remove the unpacked files."""
        self._remove()


def _unloadable(fmu: Fmu, error: Exception) -> str:
    """Why the library of an FMU cannot be loaded."""
    from fmpy import platform, sharedLibraryExtension

    library = f"binaries/{platform}/{fmu.identifier}{sharedLibraryExtension}"
    if (Path(fmu.folder) / library).is_file():
        return f"its library {library} cannot be loaded ({printable(str(error))})"
    there = sorted(p.name for p in Path(fmu.folder, "binaries").glob("*"))
    has = f"it has those for {printable(', '.join(there))}" if there else "it has none"
    return f"has no library for this machine, {library}; {has}"


class Handle:
    """Variables by their value references, with room for their `values`. Variables of one type have this type as
    `kind`; those of several types have `parts`, each with the places of its variables and their own handle."""

    def __init__(self, variables: Sequence[Any]) -> None:
        self.n, self.names = len(variables), [v.name for v in variables]
        kinds = {v.type for v in variables} or {"Real"}
        self.kind = kinds.pop() if len(kinds) == 1 else "Real"
        self.references = (ctypes.c_uint * self.n)(*(v.valueReference for v in variables))
        self.values: Any = (NUMBERS[self.kind] * self.n)()
        places = [[i for i, v in enumerate(variables) if v.type == kind] for kind in kinds]
        self.parts = [(part, Handle([variables[i] for i in part])) for part in places]

    def put(self, new: Sequence[float]) -> None:
        """Take values of variables of one type.

        Raises
        ------
        InputError
            for a count that is no whole number, and a switch that is neither 0 nor 1.
        """
        if self.kind == "Real":
            self.values[:] = new
            return
        least, most, range_text = _WHOLE[self.kind]
        for i, value in enumerate(new):
            if not (least <= value <= most and value % 1.0 == 0.0):
                raise InputError(f"{self.names[i]} = {value:g}: must be {range_text}")
            self.values[i] = int(value)


class Instance:
    """A running instance for Co-Simulation; every failing call becomes a `RunError` that cites the log of the FMU."""

    _api: ClassVar[str] = "FMU2Slave"
    """fmpy's class."""

    def __init__(self, fmu: Fmu, name: str, journal: list[str] | None = None) -> None:
        """The messages of the FMU are added to `journal`, which several instances may share: their messages then
        stand in the order of time."""
        from fmpy import fmi2 as api

        self.fmu = fmu
        self.name = name
        self.messages: list[str] = []

        def logger(_env: Any, _name: Any, status: int, _category: Any, message: bytes | None) -> None:
            """Keep a message of the FMU that is no success, and hand it to the log."""
            if message and status > 0:
                text = printable(message.decode(errors="replace"), 500)
                self.messages.append(text)
                if journal is not None:
                    journal.append(f"{name}: {text}")
                log.warning("%s: %s", name, text)

        self._callbacks = fmi2_callbacks(logger)
        self._alive = False
        try:
            with loading():
                self._fmi = getattr(api, self._api)(
                    guid=fmu.description.guid,
                    unzipDirectory=fmu.folder,
                    modelIdentifier=fmu.identifier,
                    instanceName=name,
                )
        except Exception as error:  # fmpy has no error class of its own for this
            raise InputError(f"{fmu.file}: {_unloadable(fmu, error)}") from error
        try:
            self._fmi.instantiate(callbacks=self._callbacks, loggingOn=True)
        except Exception as error:
            complaint = f": {self.messages[-1]}" if self.messages else ""
            raise RunError(f"{name}: cannot be instantiated{complaint}") from error
        self._alive = True
        # a run calls these functions at every step: without fmpy's layer, which takes twice their time
        self._library, self._component = self._fmi.dll, self._fmi.component
        self._getters = {kind: getattr(self._library, f"fmi2Get{kind}") for kind in NUMBERS}
        self._setters = {kind: getattr(self._library, f"fmi2Set{kind}") for kind in NUMBERS}

    def _call(self, what: str, function: Any, *args: Any) -> Any:
        """The result of a function of the FMU; if its status is no success, the failure of `what`, the work in words,
        is raised."""
        from fmpy.fmi1 import FMICallException

        try:
            return function(*args)
        except FMICallException as error:
            raise self._failure(what, error.status) from error

    def _failure(self, what: str, status: int) -> RunError:
        if status == _FATAL:
            self._alive = False
        complaint = f": {self.messages[-1]}" if self.messages else ""
        kind = DiscardError if status == _DISCARD else RunError
        return kind(f"{self.name}: {what} ended with status {status}{complaint}")

    def _check(self, status: int, what: str) -> None:
        if status > _WARNING:
            raise self._failure(what, status)

    def initialize(self, start: Mapping[str, float], time: float) -> None:
        """Set start values and enter the initialization mode, which `finish_initialization` leaves."""
        self._call("setup", self._fmi.setupExperiment, None, time)
        self.set(list(start), list(start.values()))
        self._call("initialization", self._fmi.enterInitializationMode)

    def finish_initialization(self) -> None:
        """Leave the initialization mode."""
        self._call("initialization", self._fmi.exitInitializationMode)

    def handle(self, names: Sequence[str]) -> Handle:
        """The variables of these names, for `read` and `write`."""
        return Handle([self.fmu.variables[name] for name in names])

    def read(self, handle: Handle) -> Sequence[float]:
        """Values behind a handle; a switch is 0 or 1."""
        values = handle.values
        for places, part in handle.parts:
            for i, value in zip(places, self.read(part), strict=True):
                values[i] = value
        if not handle.parts:
            get = self._getters[handle.kind]
            self._check(get(self._component, handle.references, handle.n, values), "reading values")
        return values

    def write(self, handle: Handle, new: Sequence[float]) -> None:
        """Set the values behind a handle; see `Handle.put`."""
        for places, part in handle.parts:
            self.write(part, [new[i] for i in places])
        if not handle.parts:
            handle.put(new)
            put = self._setters[handle.kind]
            self._check(put(self._component, handle.references, handle.n, handle.values), "setting values")

    def get(self, names: Sequence[str]) -> list[float]:
        """Values by name."""
        return list(self.read(self.handle(names)))

    def set(self, names: Sequence[str], values: Sequence[float]) -> None:
        """Set values by name."""
        if names:
            self.write(self.handle(names), values)

    def step(self, time: float, step: float) -> None:
        """One communication step."""
        status = self._library.fmi2DoStep(self._component, time, step, 1)
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
        """End and free the instance; after a fatal error no function of it may be called again."""
        if not self._alive:
            return
        self._alive = False
        with contextlib.suppress(Exception):
            self._fmi.terminate()
        self._fmi.freeInstance()


class ExchangeInstance(Instance):
    """A running instance for Model Exchange: its states belong to the solver of the importer."""

    _api = "FMU2Model"

    def __init__(self, fmu: Fmu, name: str, journal: list[str] | None = None) -> None:
        super().__init__(fmu, name, journal)
        self.n_states = int(fmu.description.numberOfContinuousStates)
        self.n_indicators = int(fmu.description.numberOfEventIndicators)
        self._states = (ctypes.c_double * self.n_states)()
        self._rates = (ctypes.c_double * self.n_states)()
        self._indicators = (ctypes.c_double * self.n_indicators)()
        self._is_continuous = False
        """whether the FMU is in the Continuous-Time Mode"""

    def write(self, handle: Handle, new: Sequence[float]) -> None:
        """Set the values behind a handle. In the Continuous-Time Mode counts and switches keep theirs, as FMI allows
        them to change at events alone; the event that their source makes sets them."""
        if not self._is_continuous or handle.parts or handle.kind == "Real":
            super().write(handle, new)

    def put(self, time: float, states: Sequence[float]) -> None:
        """Set the time [s] and the states, shape (states,)."""
        library, component = self._library, self._component
        self._check(library.fmi2SetTime(component, time), "setting the time")
        if self.n_states:
            self._states[:] = list(states)
            status = library.fmi2SetContinuousStates(component, self._states, self.n_states)
            self._check(status, "setting the states")

    def rates(self) -> Any:
        """Derivatives of the states at the present point, shape (states,)."""
        if self.n_states:
            status = self._library.fmi2GetDerivatives(self._component, self._rates, self.n_states)
            self._check(status, "computing derivatives")
        return self._rates

    def indicators(self) -> Any:
        """The event indicators at the present point: a change of sign of one of them is an event."""
        if self.n_indicators:
            status = self._library.fmi2GetEventIndicators(
                self._component, self._indicators, self.n_indicators
            )
            self._check(status, "computing event indicators")
        return self._indicators

    def states(self) -> list[float]:
        """The states in the FMU, which an event may have changed."""
        if self.n_states:
            self._call("reading the states", self._fmi.getContinuousStates, self._states, self.n_states)
        return list(self._states)

    def nominals(self) -> list[float]:
        """Nominal sizes of the states."""
        sizes = (ctypes.c_double * self.n_states)()
        if self.n_states:
            self._call("reading nominal sizes", self._fmi.getNominalsOfContinuousStates, sizes, self.n_states)
        return list(sizes)

    def complete_step(self) -> bool:
        """Tell the FMU that a step of the solver is complete; whether the FMU requests an event there."""
        event, ends = self._call("completing a step", self._fmi.completedIntegratorStep)
        if ends:
            raise RunError(f"{self.name}: ends the simulation")
        return bool(event)

    def enter_event(self) -> None:
        """Enter the event mode."""
        self._call("an event", self._fmi.enterEventMode)
        self._is_continuous = False

    def update(self) -> tuple[bool, float]:
        """Update the discrete states once, in event mode. Returns whether anything changed, so that all FMUs have to
        be updated again, and the time of the next time event [s]."""
        again, ends, _, new_states, has_next, time = self._call("an event", self._fmi.newDiscreteStates)
        if ends:
            raise RunError(f"{self.name}: ends the simulation")
        return bool(again or new_states), float(time) if has_next else math.inf

    def leave_event(self) -> None:
        """Return to continuous time."""
        self._call("an event", self._fmi.enterContinuousTimeMode)
        self._is_continuous = True
