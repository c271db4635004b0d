"""An instance of a model inside a pythonfmu FMU: its values, its states, its time, and its outputs.

It computes with `math`, so that the importing Python (3.11 or later) needs only the standard library. It never
raises: a reason is logged, outputs become NaN, and a step is refused. Outputs are evaluated when they are read, part
by part, once per state.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from ..core import messages
from ..core.engines import MATH
from ..core.errors import InputError
from ..core.integrators import ADDED_UP, MAX_STEPS, ROUNDED, SAME_TIME, BudgetError, controlled, rk4
from ..core.model import Model
from ..core.quantities import complaint

NAN = float("nan")
_IDENTITY = __name__.partition(".")[0]
"""Inside an FMU: the name of its package, which has a hash of all contents of the FMU."""


class References:
    """The value references of a model: of its `settable` variables, the parameters and then the inputs, from 0 on; of
    its states, from `first_state` on; and of its outputs, from `first_output` on. `parts` has the first reference of
    each part of the outputs and the reference behind its last one; `types` the type of FMI by reference."""

    def __init__(self, model: type[Model]) -> None:
        parameters, states = model.parameter_layout.variables, model.state_layout
        state_variables = states.variables if states else ()
        self.settable = (*parameters, *model.input_layout.variables)
        self.first_input, self.first_state = len(parameters), len(self.settable)
        self.first_output = at = self.first_state + len(state_variables)
        self.parts: list[tuple[int, int]] = []
        for part in model.parts:
            self.parts.append((at, at + len(part.layout.names)))
            at = self.parts[-1][1]
        outputs = [v for part in model.parts for v in part.layout.variables]
        self.types = {i: v.type for i, v in enumerate((*self.settable, *state_variables, *outputs))}


class ModelInstance:
    """An instance of a `model` with these `start` values by name; `log` gets each line for the user."""

    def __init__(self, model: type[Model], start: dict[str, float], log: Callable[[str], None]) -> None:
        self.model, self.references, self._log = model, References(model), log
        self._set: list[float] = [
            float(start.get(v.name, v.quantity.start or 0.0)) for v in self.references.settable
        ]
        self._out = [NAN] * (len(self.references.types) - self.references.first_state)
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

    def tell(self, line: str) -> None:
        """Log a line, except one that repeats the last one."""
        if line != self._last_line:
            self._last_line = line
            self._log(line)

    # -- time

    def set_times(self, start: float, stop: float | None) -> None:
        """Set the start time and, if it is known, the stop time; `prepare` checks them."""
        self._time = start
        self._stop = math.inf if stop is None else stop
        if start <= self._stop < math.inf:
            rounding = ADDED_UP * max(abs(self._stop), abs(start))
            self._stop += SAME_TIME * (self._stop - start) + rounding
        self._touch()

    def end_initialization(self) -> None:
        """From here on fixed parameters cannot change."""
        self.prepare()
        self._initialized = True

    def step(self, time: float, size: float) -> bool:
        """One communication step; False where the model, its inputs or the step are not usable."""
        try:
            bad = self.prepare() or self._bad_step(time, size) or self._bad_input()
            if bad:
                self.tell(bad)
                return False
            if size and not self._advance(time, size):
                return False
            self._time = time + size
            return True
        except BudgetError as reason:
            over = {"size": size, "time": time, "name": MAX_STEPS, "most": reason.most}
            self.tell(messages.OVER_BUDGET.format(**over))
        except ArithmeticError:
            self.tell(messages.ASTRAY.format(time=time))
        except BaseException as reason:
            self.tell(f"step from t = {time:g} s failed: {reason!r}")
        return False

    def _bad_step(self, time: float, size: float) -> str:
        if not (math.isfinite(time) and 0.0 <= size < math.inf and time + size < math.inf):
            return messages.STEP_SIZE.format(size=size, time=time)
        if abs(time - self._time) > SAME_TIME * size + ROUNDED * abs(self._time):
            return messages.STEP_BEGIN.format(time=time, now=self._time)
        if not time + size <= self._stop:
            return messages.STEP_END.format(size=size, time=time, stop=self._stop)
        return ""

    def _advance(self, time: float, step: float) -> bool:
        """Take states and inputs to the end of a step; False where a state runs away."""
        run = self._running()
        if self.model.state_layout:
            x = self._integrate(run, step)
            if not all(map(math.isfinite, x)):
                self.tell(messages.ASTRAY.format(time=time))
                return False
            self._x = x
        for at, rate, half in run:
            quantity = self.references.settable[at].quantity
            self._set[at] = quantity.within_bounds(self._set[at] + step * (rate + step * half))
            self._u = None
            self._doubtful = True
        self._touch()
        self._closed = self.model.controlled
        return True

    def _integrate(self, run: Any, step: float) -> list[float]:
        p, model = self._p, self.model
        layout = model.state_layout
        assert layout is not None
        longest = model.internal_step(MATH, p)

        def rates(since: float, x: Any) -> list[float]:
            return model.derivatives(MATH, p, self._inputs(run, since), layout.instance(x))

        if model.controlled:
            return self._integrate_with_control(rates, run, step, longest)
        return rk4(rates, self._x, step, longest, p.solver.max_steps)

    def _integrate_with_control(self, rates: Any, run: Any, step: float, longest: float) -> list[float]:
        p, model, x = self._p, self.model, self._x
        layout = model.state_layout
        assert layout is not None

        def close(since: float, x: Any) -> list[float]:
            return model.constrained_states(MATH, p, self._inputs(run, since), layout.instance(x))

        for _ in range(0 if self._closed else 2):
            x = close(0.0, x)
        nominal = [v.quantity.nominal or 1.0 for v in layout.variables]
        tolerance, most = model.tolerance(MATH, p), p.solver.max_steps
        x, self._pace = controlled(rates, close, x, step, self._pace, longest, tolerance, nominal, most)
        return x

    # -- values

    def assign(self, reference: int, value: float) -> None:
        """Set a parameter or an input; a fixed parameter only before the end of the initialization."""
        quantity = self.references.settable[reference].quantity
        if quantity.admits(value):
            value = quantity.within_bounds(value)
        if self._set[reference] == value:
            return
        if reference >= self.references.first_input:
            self._set[reference] = value
            self._u = None
            self._doubtful = True
            self._start_anew()
            self._touch()
        elif not self._initialized:
            self._take(reference, value)
        else:
            self._tune(reference, value)

    def _take(self, reference: int, value: float) -> None:
        self._set[reference] = value
        self._p = None
        self._start_anew()
        self._touch()

    def _start_anew(self) -> None:
        """Start the states again at the next use, unless the initialization has already started them."""
        if not self._initialized or self._unstarted:
            self._x, self._unstarted = [], ""

    def _tune(self, reference: int, value: float) -> None:
        variable = self.references.settable[reference]
        if not variable.quantity.tunable:
            self.tell(messages.FIXED.format(name=variable.name) + "; not changed")
        elif not variable.quantity.admits(value):
            self.tell(complaint(variable, value) + "; not changed")
        else:
            self._take(reference, value)

    def value(self, reference: int) -> float:
        """The value of a variable; an output is evaluated at most once per state and part."""
        places = self.references
        if reference < places.first_state:
            return self._set[reference]
        if reference < places.first_output:
            return NAN if self.prepare() else self._x[reference - places.first_state]
        for i, (low, high) in enumerate(places.parts):
            if low <= reference < high and not self._fresh[i]:
                self._evaluate(i, low, high)
        return self._out[reference - places.first_state]

    def _evaluate(self, i: int, low: int, high: int) -> None:
        values: list[float] | None = None
        bad = self.prepare() or self._bad_input()
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
            self.tell(bad)
            values = [NAN] * (high - low)
        self._out[low - self.references.first_state : high - self.references.first_state] = values
        self._fresh[i] = True

    def _touch(self) -> None:
        """Mark all outputs for a new evaluation."""
        self._shared = None
        self._closed = False
        self._fresh = [False] * len(self._fresh)

    def prepare(self) -> str:
        """Check the parameters and start the states, after a change of either. Returns why they make no model, or an
        empty text."""
        if bad := self._unrestored or self._bad_experiment():
            self.tell(bad)
            return bad
        if self._p is None:
            self._refusal = ""
            derived, self._derived = self._derived if self._initialized else None, None
            try:
                p = self._p = self.model.parameter_layout.instance(self._set[: self.references.first_input])
                p = self._p = self.model.check(p, derived)
                self._derived = getattr(p, "derived", None)
            except BaseException as reason:
                self._refusal = str(reason) or repr(reason)
                self.tell(self._refusal)
        if self.model.state_layout and not (self._x or self._refusal or self._unstarted):
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
            self.tell(self._unstarted)

    def _bad_experiment(self) -> str:
        if not math.isfinite(self._time):
            return messages.TIME.format(which="start time", time=self._time)
        if not self._time <= self._stop:
            return messages.STOP.format(stop=self._stop, start=self._time)
        return ""

    def _inputs(self, run: list[tuple[int, float, float]] | None = None, since: float = 0.0) -> Any:
        """The inputs, with the running ones `run` at the time `since` [s] after they were set."""
        first = self.references.first_input
        if run:
            values = self._set[first:]
            for at, rate, half in run:
                values[at - first] += since * (rate + since * half)
            return self.model.input_layout.instance(values)
        if self._u is None:
            self._u = self.model.input_layout.instance(self._set[first:])
        return self._u

    def _running(self) -> list[tuple[int, float, float]]:
        """Place, rate and half of the second derivative of each input that follows another one and moves."""
        first = self.references.first_input
        return [
            (first + place, rate, half)
            for place, rate, half in self.model.extrapolations(self._set[first:])
            if rate or half
        ]

    def _bad_input(self) -> str:
        if self._doubtful:
            inputs = slice(self.references.first_input, None)
            for variable, value in zip(self.references.settable[inputs], self._set[inputs], strict=True):
                if not variable.quantity.admits(value):
                    return f"input {complaint(variable, value)}"
            self._doubtful = False
        return ""

    # -- saved states

    def saved(self) -> dict[str, Any]:
        """The state of the instance, ready for JSON."""
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

    def restore(self, state: dict[str, Any]) -> None:
        """Take a saved state; where it is none of this model, nothing works until another one is restored."""
        try:
            why = self._bad_state(state)
        except (KeyError, TypeError, ValueError, AttributeError):
            why = "it is not a saved state of this model"
        self._touch()
        self._unrestored = messages.STATE.format(why=f"{why}; not restored") if why else ""
        if why:
            self.tell(self._unrestored)
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
        places = self.references
        states = places.first_output - places.first_state if state["started"] else 0
        complete = len(values) == places.first_state and len(x) == states
        if not (numbers and complete and state["pace"] >= 0.0 and {type(flag) for flag in flags} == {bool}):
            raise ValueError
        if not all(map(math.isfinite, x)):
            return "a value in it is not finite"
        if state["started"] and state["initialized"]:  # else `prepare` judges them
            for variable, value in zip(
                self.references.settable[: self.references.first_input], values, strict=False
            ):
                if not variable.quantity.admits(value):
                    return complaint(variable, value)
        return ""
