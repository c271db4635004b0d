"""The slave inside a pythonfmu FMU, for any model as a printed module (`chainunit.fmu.printed_model`). The FMU
carries this file.

It never raises: pythonfmu turns an exception into a fatal status, after which the host must give up. Instead the
outputs become NaN, the step is discarded, and the reason is logged once (`chainunit.fmu.model_instance`).
"""

from __future__ import annotations

import atexit
import binascii
import contextlib
import ctypes
import json
import math
import os
import sys
from collections.abc import Callable
from functools import partialmethod
from pathlib import Path
from typing import Any, ClassVar, TypeVar

from pythonfmu.enums import Fmi2Status
from pythonfmu.fmi2slave import Fmi2Slave

from ..core import messages
from .model_instance import NAN, ModelInstance

_NOTHING: dict[str, Any] = {"Real": NAN, "Integer": 0, "Boolean": False, "String": ""}
"""By type of FMI, the value of a variable that has none."""
_Slave = TypeVar("_Slave", bound="PrintedSlave")
_LIBRARIES: set[Path] = set()


def hold(namespace: dict[str, Any], model: Any) -> Callable[[type[_Slave]], type[_Slave]]:
    """Decorate the class of a script with its printed `model`; its own `namespace` mends two faults of pythonfmu 0.7.

    pythonfmu imports the script by its name, runs its text again in the namespace of that module at every
    instantiation, and takes the class from the module. It releases a reference to the namespace that it never took,
    so that later instances in a process would work on freed memory: each run therefore takes a reference. And a
    second FMU with a script of the same name would get the class of the first: each run therefore puts its class into
    the namespace.
    """
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(namespace))

    def register(slave: type[_Slave]) -> type[_Slave]:
        slave.model = model
        namespace[slave.__name__] = slave
        return slave

    return register


def _release_at_exit(library: Path) -> None:
    """Make the FMU's library release its interpreter handle while Python still runs.

    On Linux, pythonfmu 0.7 releases that handle twice when the process ends, the second time in freed memory, which
    sometimes aborts the host at its exit. The release here sets the handle to null, so that the later two do nothing.
    """
    if sys.platform != "linux" or library in _LIBRARIES or not library.is_file():
        return
    _LIBRARIES.add(library)

    def release() -> None:
        # if the host has already unloaded the library, the handle was released in the right order
        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(str(library), mode=os.RTLD_NOW | os.RTLD_NOLOAD).finalizePythonInterpreter()

    atexit.register(release)


class PrintedSlave(Fmi2Slave):  # type: ignore[misc]
    """A model as pythonfmu's slave; the script in the FMU derives a class, and `hold` gives it its module."""

    model: ClassVar[Any]

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        _release_at_exit(Path(self.resources).parent / "binaries" / "linux64" / f"{type(self).__name__}.so")
        self._instance = instance = ModelInstance(self.model, lambda line: self.log(line, Fmi2Status.error))
        types = (
            dict.fromkeys(range(instance.first_output + len(self.model.OUTPUTS)), "Real") | self.model.TYPES
        )
        self._of_type = {
            kind: {i for i, type_name in types.items() if type_name == kind} for kind in _NOTHING
        }

    # -- life cycle

    def setup_experiment(
        self, start_time: float, stop_time: float | None = None, tolerance: float | None = None
    ) -> None:
        """Set the start time and, if it is known, the stop time."""
        self._instance.set_times(start_time, stop_time)

    def enter_initialization_mode(self) -> None:
        """Check the parameters and start the states."""
        self._instance.prepare()

    def exit_initialization_mode(self) -> None:
        """End the initialization: from here on fixed parameters cannot change."""
        self._instance.end_initialization()

    def do_step(self, current_time: float, step_size: float) -> bool:
        """One communication step; False (discard) if the model, its inputs or the step are not usable."""
        return self._instance.step(current_time, step_size)

    # -- values; pythonfmu would raise for a value reference of another type, which is fatal for the host

    def _assign(self, kind: str, vrs: list[int], values: list[Any]) -> None:
        """Set parameters and inputs of that type; a fixed parameter only before the end of the initialization."""
        for vr, value in zip(vrs, values, strict=True):
            if not self._is_of(kind, vr):
                continue
            if vr >= self._instance.first_state:
                self._instance.tell(messages.OUTPUT_SET.format(reference=vr))
                continue
            self._instance.assign(vr, float(bool(value) if kind == "Boolean" else value))

    set_real = partialmethod(_assign, "Real")
    set_integer = partialmethod(_assign, "Integer")
    set_boolean = partialmethod(_assign, "Boolean")
    set_string = partialmethod(_assign, "String")

    def _is_of(self, kind: str, vr: int) -> bool:
        """Whether there is a variable of that type with that reference; a line in the log if there is none."""
        if vr in self._of_type[kind]:
            return True
        line = (
            messages.OTHER_TYPE
            if any(vr in references for references in self._of_type.values())
            else messages.NO_REFERENCE
        )
        self._instance.tell(line.format(reference=vr, type=kind))
        return False

    def _read(self, kind: str, vrs: list[int]) -> list[Any]:
        """Values of that type by reference. A variable without a value is NaN, 0, false or an empty text."""
        nothing = _NOTHING[kind]
        try:
            if self._of_type[kind].issuperset(vrs):
                values = self._instance.values(vrs)
            else:
                values = [self._instance.values([vr])[0] if self._is_of(kind, vr) else NAN for vr in vrs]
        except BaseException as reason:
            self._instance.tell(f"values cannot be read: {reason!r}")
            return [nothing] * len(vrs)
        if kind == "Real":
            return values
        return [type(nothing)(value) if math.isfinite(value) else nothing for value in values]

    get_real = partialmethod(_read, "Real")
    get_integer = partialmethod(_read, "Integer")
    get_boolean = partialmethod(_read, "Boolean")
    get_string = partialmethod(_read, "String")

    # -- states of the FMU, and its description

    def _get_fmu_state(self) -> dict[str, Any]:
        return self._instance.saved()

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        self._instance.restore(state)

    @staticmethod
    def _fmu_state_to_bytes(state: dict[str, Any]) -> bytes:
        text = json.dumps(state).encode()
        return binascii.crc32(text).to_bytes(4, "big") + text

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        checksum, text = state[:4], state[4:]
        if checksum != binascii.crc32(text).to_bytes(4, "big"):
            return {"damaged": messages.STATE_DAMAGED}
        try:
            saved = json.loads(text)
        except ValueError:
            return {}
        return saved if isinstance(saved, dict) else {}
