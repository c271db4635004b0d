"""The slave inside a pythonfmu FMU, for any model, by its declarations.

It computes with `math`, so that the importing Python (3.11 or later) needs only the standard library. It never
raises: pythonfmu turns an exception into a fatal status, after which the host must give up. Instead the outputs
become NaN, the step is discarded, and the reason is logged once. Outputs are evaluated when they are read, part by
part, once per state.
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
from typing import Any, TypeVar
from xml.etree.ElementTree import Element

from pythonfmu.enums import Fmi2Status
from pythonfmu.fmi2slave import Fmi2Slave

from ..core import messages
from ..core.engines import MATH
from ..core.errors import InputError
from ..core.integrators import ADDED_UP, MAX_STEPS, ROUNDED, SAME_TIME, BudgetError, controlled, rk4
from ..core.quantities import complaint
from .script import Script

_NAN = float("nan")
_NOTHING: dict[str, Any] = {"Real": _NAN, "Integer": 0, "Boolean": False, "String": ""}
"""By type of FMI, what stands for a value that cannot be told."""
_Slave = TypeVar("_Slave")
_LIBRARIES: set[Path] = set()


def hold(namespace: dict[str, Any]) -> Callable[[type[_Slave]], type[_Slave]]:
    """Decorate the class of a script with the script's own `namespace`, to mend two faults of pythonfmu 0.7.

    pythonfmu imports the script by its name, runs its text again in the namespace of that module at every
    instantiation, and takes the class from the module. It releases a reference to the namespace that it never took,
    so that later instances in a process would work on freed memory: each run therefore takes a reference. And a
    second FMU with a script of the same name would get the class of the first: each run therefore puts its class into
    the namespace.
    """
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(namespace))

    def register(slave: type[_Slave]) -> type[_Slave]:
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


_IDENTITY = __name__.partition(".")[0]
"""Inside an FMU: the name of its package, which has a hash of all contents of the FMU."""


class ModelSlave(Script, Fmi2Slave):  # type: ignore[misc]
    """A model as pythonfmu's slave; a script in `fmu/` derives one class with `model` and perhaps `start`."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        model = self.model
        _release_at_exit(Path(self.resources).parent / "binaries" / "linux64" / f"{type(self).__name__}.so")
        self._variables = (*model.parameter_layout.variables, *model.input_layout.variables)
        self._set: list[float] = [
            float(self.start.get(v.name, v.quantity.start or 0.0)) for v in self._variables
        ]
        self._n_p = len(model.parameter_layout.variables)
        self._first = len(self._set)
        self._n_x = len(model.state_layout.names) if model.state_layout else 0
        self._ranges = []
        at = self._first + self._n_x
        for part in model.parts:
            self._ranges.append((at, at + len(part.layout.names)))
            at = self._ranges[-1][1]
        self._end = at
        states = model.state_layout.variables if model.state_layout else ()
        outputs = [v for part in model.parts for v in part.layout.variables]
        self._types = {i: v.type for i, v in enumerate((*self._variables, *states, *outputs))}
        self._out = [_NAN] * (at - self._first)
        self._fresh = [False] * len(model.parts)
        self._shared: Any = None
        self._p: Any = None
        self._derived: Any = None  # from the fixed parameters, which do not change after the initialization
        self._u: Any = None
        self._x: list[float] = []  # empty before the start of the states
        self._pace = 0.0  # next substep of an integrator that controls its error
        self._closed = False
        self._initialized = False
        self._doubtful = True  # an input may be out of its bounds
        self._time = 0.0
        self._stop = math.inf  # the last admissible time, with an allowance for rounding
        self._refusal = ""  # why the parameters make no model
        self._unstarted = ""  # why the states could not be started
        self._unrestored = ""  # why the last saved state could not be restored
        self._last_line = ""

    # -- life cycle

    def setup_experiment(
        self, start_time: float, stop_time: float | None = None, tolerance: float | None = None
    ) -> None:
        """Set the start time and, if it is known, the stop time; `_bad_experiment` checks them."""
        self._time = start_time
        self._stop = math.inf if stop_time is None else stop_time
        if start_time <= self._stop < math.inf:
            rounding = ADDED_UP * max(abs(self._stop), abs(start_time))
            self._stop += SAME_TIME * (self._stop - start_time) + rounding
        self._touch()

    def enter_initialization_mode(self) -> None:
        """Check the parameters and start the states."""
        self._prepare()

    def exit_initialization_mode(self) -> None:
        """End the initialization: from here on fixed parameters cannot change."""
        self._prepare()
        self._initialized = True

    def do_step(self, current_time: float, step_size: float) -> bool:
        """One communication step; False (discard) where the model, its inputs or the step are not usable."""
        try:
            bad = self._prepare() or self._bad_step(current_time, step_size) or self._bad_input()
            if bad:
                self._tell(bad)
                return False
            if self._n_x and step_size and not self._integrate(current_time, step_size):
                return False
            self._time = current_time + step_size
            return True
        except BudgetError as reason:
            over = {"size": step_size, "time": current_time, "name": MAX_STEPS, "most": reason.most}
            self._tell(messages.OVER_BUDGET.format(**over))
            return False
        except ArithmeticError:
            self._tell(messages.ASTRAY.format(time=current_time))
            return False
        except BaseException as reason:
            self._tell(f"step from t = {current_time:g} s failed: {reason!r}")
            return False

    def _bad_step(self, time: float, size: float) -> str:
        if not (math.isfinite(time) and 0.0 <= size < math.inf and time + size < math.inf):
            return messages.STEP_SIZE.format(size=size, time=time)
        if abs(time - self._time) > SAME_TIME * size + ROUNDED * abs(self._time):
            return messages.STEP_BEGIN.format(time=time, now=self._time)
        if not time + size <= self._stop:
            return messages.STEP_END.format(size=size, time=time, stop=self._stop)
        return ""

    def _integrate(self, time: float, step: float) -> bool:
        p, model, run = self._p, self.model, self._running()
        layout = model.state_layout
        assert layout is not None
        longest = model.internal_step(MATH, p)

        def rates(since: float, x: Any) -> list[float]:
            return model.derivatives(MATH, p, self._inputs(run, since), layout.instance(x))

        if model.controlled:
            x = self._integrate_with_control(rates, run, step, longest)
        else:
            x = rk4(rates, self._x, step, longest, p.solver.max_steps)
        if not all(map(math.isfinite, x)):
            self._tell(messages.ASTRAY.format(time=time))
            return False
        self._x = x
        for at, rate, half in run:
            self._set[at] += step * (rate + step * half)
        if run:
            self._u = None
            self._doubtful = True
        self._touch()
        self._closed = model.controlled
        return True

    def _integrate_with_control(self, rates: Any, run: Any, step: float, longest: float) -> list[float]:
        p, model, x = self._p, self.model, self._x
        layout = model.state_layout
        assert layout is not None

        def close(since: float, x: Any) -> list[float]:
            return model.closed(MATH, p, self._inputs(run, since), layout.instance(x))

        for _ in range(0 if self._closed else 2):
            x = close(0.0, x)
        nominal = [v.quantity.nominal or 1.0 for v in layout.variables]
        tolerance, most = model.tolerance(MATH, p), p.solver.max_steps
        x, self._pace = controlled(rates, close, x, step, self._pace, longest, tolerance, nominal, most)
        return x

    # -- values; pythonfmu would raise for a value reference of another type, which is fatal for the host

    def _assign(self, kind: str, vrs: list[int], values: list[Any]) -> None:
        """Set parameters and inputs of that type; a fixed parameter only before the end of the initialization."""
        for vr, value in zip(vrs, values, strict=True):
            if self._types.get(vr) != kind:
                self._tell_no(kind, vr)
                continue
            if vr >= self._first:
                self._tell(messages.OUTPUT_SET.format(reference=vr))
                continue
            quantity, value = self._variables[vr].quantity, float(bool(value) if kind == "Boolean" else value)
            if quantity.admits(value):
                value = quantity.within_bounds(value)
            if self._set[vr] == value:
                continue
            if vr >= self._n_p:
                self._set[vr] = value
                self._u = None
                self._doubtful = True
                self._start_anew()
                self._touch()
            elif not self._initialized:
                self._take(vr, value)
            else:
                self._tune(vr, value)

    def _take(self, vr: int, value: float) -> None:
        self._set[vr] = value
        self._p = None
        self._start_anew()
        self._touch()

    def _start_anew(self) -> None:
        """Start the states again at the next use, unless the initialization has already started them."""
        if not self._initialized or self._unstarted:
            self._x, self._unstarted = [], ""

    def _tune(self, vr: int, value: float) -> None:
        variable = self._variables[vr]
        if not variable.quantity.tunable:
            self._tell(messages.FIXED.format(name=variable.name) + "; not changed")
        elif not variable.quantity.admits(value):
            self._tell(complaint(variable, value) + "; not changed")
        else:
            self._take(vr, value)

    set_real = partialmethod(_assign, "Real")
    set_integer = partialmethod(_assign, "Integer")
    set_boolean = partialmethod(_assign, "Boolean")
    set_string = partialmethod(_assign, "String")

    def _tell_no(self, kind: str, vr: int) -> None:
        """Log that there is no variable of that type with that reference."""
        line = messages.OTHER_TYPE if vr in self._types else messages.NO_REFERENCE
        self._tell(line.format(reference=vr, type=kind))

    def _read(self, kind: str, vrs: list[int]) -> list[Any]:
        """Values of that type by reference; outputs are evaluated at most once per state and part. A value that
        cannot be told is NaN, or 0, false or an empty text."""
        nothing = _NOTHING[kind]
        try:
            values = self._values(kind, vrs)
        except BaseException as reason:
            self._tell(f"values cannot be read: {reason!r}")
            return [nothing] * len(vrs)
        if kind == "Real":
            return values
        return [type(nothing)(value) if math.isfinite(value) else nothing for value in values]

    get_real = partialmethod(_read, "Real")
    get_integer = partialmethod(_read, "Integer")
    get_boolean = partialmethod(_read, "Boolean")
    get_string = partialmethod(_read, "String")

    def _values(self, kind: str, vrs: list[int]) -> list[float]:
        first, states = self._first, self._first + self._n_x
        out: list[float] = []
        for vr in vrs:
            if self._types.get(vr) != kind:
                self._tell_no(kind, vr)
                out.append(_NAN)
            elif vr < first:
                out.append(self._set[vr])
            elif vr < states:
                out.append(_NAN if self._prepare() else self._x[vr - first])
            else:
                for i, (low, high) in enumerate(self._ranges):
                    if low <= vr < high and not self._fresh[i]:
                        self._evaluate(i, low, high)
                out.append(self._out[vr - first])
        return out

    def _evaluate(self, i: int, low: int, high: int) -> None:
        values: list[float] | None = None
        bad = self._prepare() or self._bad_input()
        if not bad:
            try:
                p, u = self._p, self._inputs()
                layout, part = self.model.state_layout, self.model.parts[i]
                x = layout.instance(self._x) if layout else None
                if self._shared is None:
                    self._shared = self.model.shared(MATH, p, u, x)
                values = part.layout.values(part.equations(MATH, p, u, x, self._shared))
                if not all(map(math.isfinite, values)):
                    values, bad = None, messages.NO_OUTPUT.format(model=self.model.name, time=self._time)
            except BaseException as reason:
                bad = f"outputs cannot be evaluated: {reason!r}"
        if values is None:
            self._tell(bad)
            values = [_NAN] * (high - low)
        self._out[low - self._first : high - self._first] = values
        self._fresh[i] = True

    def _touch(self) -> None:
        """Mark all outputs for a new evaluation."""
        self._shared = None
        self._closed = False
        self._fresh = [False] * len(self._fresh)

    def _prepare(self) -> str:
        """Check the parameters and start the states, after a change of either. Returns why they make no model, or an
        empty text."""
        if bad := self._unrestored or self._bad_experiment():
            self._tell(bad)
            return bad
        if self._p is None:
            self._refusal = ""
            derived, self._derived = self._derived if self._initialized else None, None
            try:
                p = self._p = self.model.parameter_layout.instance(self._set[: self._n_p])
                p = self._p = self.model.check(p, derived)
                self._derived = getattr(p, "derived", None)
            except BaseException as reason:
                self._refusal = str(reason) or repr(reason)
                self._tell(self._refusal)
        if self._n_x and not (self._x or self._refusal or self._unstarted):
            self._start()
        return self._refusal or self._unstarted

    def _start(self) -> None:
        """Compute the states at the start, or keep why there are none."""
        layout = self.model.state_layout
        assert layout is not None
        try:
            if bad := self._bad_input():
                raise InputError(bad)
            self._x = layout.values(self.model.begin(self._p, self._inputs()))
            self._pace = 0.0
        except BaseException as reason:
            self._unstarted = str(reason) or repr(reason)
            self._tell(self._unstarted)

    def _bad_experiment(self) -> str:
        if not math.isfinite(self._time):
            return messages.TIME.format(which="start time", time=self._time)
        if not self._time <= self._stop:
            return messages.STOP.format(stop=self._stop, start=self._time)
        return ""

    def _inputs(self, run: list[tuple[int, float, float]] | None = None, since: float = 0.0) -> Any:
        """The inputs, with the running ones `run` at the time `since` [s] after they were set."""
        if run:
            values = self._set[self._n_p :]
            for at, rate, half in run:
                values[at - self._n_p] += since * (rate + since * half)
            return self.model.input_layout.instance(values)
        if self._u is None:
            self._u = self.model.input_layout.instance(self._set[self._n_p :])
        return self._u

    def _running(self) -> list[tuple[int, float, float]]:
        """Place, rate and half of the second derivative of each input that follows another one."""
        course = self.model.course(self._set[self._n_p :])
        return [(self._n_p + place, rate, half) for place, rate, half in course]

    def _bad_input(self) -> str:
        if self._doubtful:
            inputs = slice(self._n_p, None)
            for variable, value in zip(self._variables[inputs], self._set[inputs], strict=True):
                if not variable.quantity.admits(value):
                    return f"input {complaint(variable, value)}"
            self._doubtful = False
        return ""

    def _tell(self, reason: str) -> None:
        if reason != self._last_line:
            self._last_line = reason
            self.log(reason, Fmi2Status.error)

    # -- states of the FMU, and its description

    def _get_fmu_state(self) -> dict[str, Any]:
        if self._unrestored:
            return {"damaged": "it was taken after one that was refused"}
        return {
            "of": _IDENTITY,
            "set": list(self._set),
            "x": list(self._x),
            "time": self._time,
            "stop": self._stop,
            "initialized": self._initialized,
            "started": bool(self._x),
            "pace": self._pace,
            "closed": self._closed,
        }

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        try:
            why = self._bad_state(state)
        except (KeyError, TypeError, ValueError, AttributeError):
            why = "it is not a saved state of this model"
        self._touch()
        self._unrestored = messages.STATE.format(why=f"{why}; not restored") if why else ""
        if why:
            self._tell(self._unrestored)
            return
        self._set, self._x = list(state["set"]), list(state["x"])
        self._time, self._stop, self._pace = state["time"], state["stop"], state["pace"]
        self._initialized = state["initialized"]
        self._doubtful = True
        # the state may be that of another geometry
        self._p = self._u = self._derived = None
        self._unstarted = ""
        self._closed = state["closed"]

    def _bad_state(self, state: dict[str, Any]) -> str:
        """Why the state cannot be restored, or an empty text; an error where it is no state of this model."""
        if "damaged" in state:
            return str(state["damaged"])
        if state["of"] != _IDENTITY:
            return messages.STATE_OF_ANOTHER
        values, x = state["set"], state["x"]
        flags = [state[name] for name in ("initialized", "started", "closed")]
        numbers = {type(v) for v in (*values, *x, state["time"], state["stop"], state["pace"])} <= {
            float,
            int,
        }
        complete = len(values) == self._first and len(x) == (self._n_x if state["started"] else 0)
        if not (numbers and complete and state["pace"] >= 0.0 and {type(flag) for flag in flags} == {bool}):
            raise ValueError
        if not all(map(math.isfinite, x)):
            return "a value in it is not finite"
        if state["started"] and state["initialized"]:  # else `_prepare` judges them
            for variable, value in zip(self._variables[: self._n_p], values, strict=False):
                if not variable.quantity.admits(value):
                    return complaint(variable, value)
        return ""

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

    def to_xml(self, model_options: Any = None) -> Element:
        """The description from the declarations, for pythonfmu's build (its own description lacks units, bounds,
        dependencies and initial unknowns). Also writes the files that the FMU needs into `resources`."""
        from .export import complete  # not copied into the FMU: importers never call this

        return complete(type(self), Path(self.resources))
