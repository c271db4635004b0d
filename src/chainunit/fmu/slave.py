"""The slave inside a pythonfmu FMU: serves any model from its declarations.

It computes with `math`, so that the importing Python (3.11 or later) needs nothing but the standard
library. It never raises: pythonfmu turns an exception into a fatal status, after which the host must give
up. Instead the outputs become NaN, the step is discarded, and the reason is logged once. Outputs are
evaluated when they are asked for, part by part, once per state.
"""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import json
import math
import os
import sys
from pathlib import Path
from typing import Any, ClassVar
from xml.etree.ElementTree import Element, parse

from pythonfmu.enums import Fmi2Status
from pythonfmu.fmi2slave import Fmi2Slave

from ..engines import MATH
from ..integrate import rk4
from ..model import Model
from ..quantities import complaint

_NAN = float("nan")


_LIBRARIES: set[Path] = set()


def hold(namespace: dict[str, Any]) -> None:
    """Take one reference to the namespace of the exported module.

    pythonfmu 0.7 runs that module at every instantiation, and each time gives up a reference to its
    namespace that it never took; without this, the second or third instance in a process works on freed
    memory.
    """
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(namespace))


def _release_at_exit(library: Path) -> None:
    """Have the FMU's library let go of its interpreter handle while Python still runs.

    On Linux, pythonfmu 0.7 releases that handle twice when the process ends, the second time in freed
    memory, which now and then aborts the host at its exit. After this release, which sets it to null, both
    find nothing to do.
    """
    if sys.platform != "linux" or library in _LIBRARIES or not library.is_file():
        return
    _LIBRARIES.add(library)

    def release() -> None:
        # where the host has unloaded it, this has been done in the right order
        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(str(library), mode=os.RTLD_NOW | os.RTLD_NOLOAD).finalizePythonInterpreter()

    atexit.register(release)


class ModelSlave(Fmi2Slave):  # type: ignore[misc]
    """A model as pythonfmu's slave; the exported module derives one class with `model` and `start`."""

    model: ClassVar[type[Model]]
    start: ClassVar[dict[str, float]]

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        model = self.model
        _release_at_exit(Path(self.resources).parent / "binaries" / "linux64" / f"{model.name}.so")
        parameters, inputs = model.parameter_layout.variables, model.input_layout.variables
        self._set: list[float] = [
            float(self.start.get(v.name, v.quantity.start or 0.0)) for v in (*parameters, *inputs)
        ]
        self._n_p = len(parameters)
        self._first = len(self._set)
        self._n_x = len(model.state_layout.names) if model.state_layout else 0
        self._ranges = []
        at = self._first + self._n_x
        for part in model.parts:
            self._ranges.append((at, at + len(part.layout.names)))
            at = self._ranges[-1][1]
        self._out = [_NAN] * (at - self._first)
        self._fresh = [False] * len(model.parts)
        self._shared: Any = None
        self._p: Any = None
        self._u: Any = None
        self._x: list[float] = []
        self._initialized = False
        self._refused = ""  # why the parameters make no model
        self._told = ""

    # -- life cycle

    def enter_initialization_mode(self) -> None:
        """Parameters are settled: check them and start the states."""
        self._initialize()

    def exit_initialization_mode(self) -> None:
        """From here on, fixed parameters stay as they are."""
        self._initialize()
        self._initialized = True

    def _initialize(self) -> None:
        self._touch(True, True)
        self._refused = ""
        try:
            p = self._parameters()
            self.model.check(p)
            if self.model.state_layout:
                self._x = self.model.state_layout.values(self.model.initial_states(p))
        except Exception as reason:
            self._refused = str(reason)
            self._tell(self._refused)

    def do_step(self, current_time: float, step_size: float) -> bool:
        """One communication step; False (discard) where the model or its inputs are not usable."""
        try:
            bad = self._refused or self._bad_input()
            if bad:
                self._touch(True, True)
                self._tell(bad)
                return False
            if self._n_x:
                p, u, model = self._parameters(), self._inputs(), self.model
                layout = model.state_layout
                assert layout is not None

                def rates(x: Any) -> list[float]:
                    return model.derivatives(MATH, p, u, layout.instance(x))

                x = rk4(rates, self._x, step_size, model.internal_step)
                if not all(map(math.isfinite, x)):
                    self._tell(f"the states left all bounds in the step from t = {current_time:g} s")
                    return False
                self._x = x
                self._touch(False, False)
            return True
        except Exception as reason:
            self._tell(f"step from t = {current_time:g} s failed: {reason}")
            return False

    # -- values

    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Take parameters and inputs; a fixed parameter only before initialisation."""
        n_p = self._n_p
        for vr, value in zip(vrs, values, strict=True):
            if vr >= self._first:
                self._tell(f"value reference {vr} is not a parameter or input: not set")
            elif self._set[vr] == value:
                continue
            elif vr >= n_p:
                self._set[vr] = value
                self._touch(False, True)
            elif not self._initialized:
                self._set[vr] = value
                self._touch(True, False)
            else:
                self._tune(vr, value)

    def _tune(self, vr: int, value: float) -> None:
        variable = self.model.parameter_layout.variables[vr]
        if not variable.quantity.tunable:
            self._tell(f"{variable.name} is fixed: set it before initialisation or after reset; not changed")
        elif not variable.quantity.admits(value):
            self._tell(complaint(variable, value) + "; not changed")
        else:
            self._set[vr] = value
            self._touch(True, False)

    def get_real(self, vrs: list[int]) -> list[float]:
        """Values by reference; outputs are evaluated at most once per state and part."""
        first, states = self._first, self._first + self._n_x
        out: list[float] = []
        for vr in vrs:
            if vr < first:
                out.append(self._set[vr])
            elif vr < states:
                out.append(self._x[vr - first] if self._x else _NAN)
            else:
                for i, (low, high) in enumerate(self._ranges):
                    if low <= vr < high and not self._fresh[i]:
                        self._evaluate(i, low, high)
                out.append(self._out[vr - first])
        return out

    def _evaluate(self, i: int, low: int, high: int) -> None:
        values: list[float] | None = None
        bad = self._refused or self._bad_input()
        if not bad:
            try:
                p, u = self._parameters(), self._inputs()
                layout, part = self.model.state_layout, self.model.parts[i]
                if layout and not self._x:
                    self._x = layout.values(self.model.initial_states(p))
                x = layout.instance(self._x) if layout else None
                if self._shared is None:
                    self._shared = self.model.shared(MATH, p, u, x)
                values = part.layout.values(part.equations(MATH, p, u, x, self._shared))
            except Exception as reason:
                bad = f"outputs cannot be evaluated: {reason}"
        if values is None:
            self._tell(bad)
            values = [_NAN] * (high - low)
        self._out[low - self._first : high - self._first] = values
        self._fresh[i] = True

    def _touch(self, parameters: bool, inputs: bool) -> None:
        """Outputs are to be evaluated anew; parameters or inputs may have changed, too."""
        if parameters:
            self._p = None
        if inputs:
            self._u = None
        self._shared = None
        self._fresh = [False] * len(self._fresh)

    def _parameters(self) -> Any:
        if self._p is None:
            self._p = self.model.parameter_layout.instance(self._set[: self._n_p])
        return self._p

    def _inputs(self) -> Any:
        if self._u is None:
            self._u = self.model.input_layout.instance(self._set[self._n_p :])
        return self._u

    def _bad_input(self) -> str:
        for i in range(self._n_p, self._first):
            if not math.isfinite(self._set[i]):
                name = self.model.input_layout.names[i - self._n_p]
                return f"input {name} = {self._set[i]}: must be a finite number"
        return ""

    def _tell(self, reason: str) -> None:
        if reason != self._told:
            self._told = reason
            self.log(reason, Fmi2Status.error)

    # -- states of the FMU, and its description

    def _get_fmu_state(self) -> dict[str, Any]:
        return {
            "set": list(self._set),
            "x": list(self._x),
            "initialized": self._initialized,
            "refused": self._refused,
        }

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        self._set = list(state["set"])
        self._x = list(state["x"])
        self._initialized = state["initialized"]
        self._refused = state["refused"]
        self._touch(True, True)

    @staticmethod
    def _fmu_state_to_bytes(state: dict[str, Any]) -> bytes:
        return json.dumps(state).encode()

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        return json.loads(state.decode())

    def to_xml(self, model_options: Any = None) -> Element:
        """The description that the exporter wrote beside this module: pythonfmu's own lacks
        units, bounds, dependencies and initial unknowns."""
        return parse(Path(self.resources) / "modelDescription.xml").getroot()
