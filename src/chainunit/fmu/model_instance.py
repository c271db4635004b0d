"""An instance of a model inside a pythonfmu FMU: its values, its states, its time, and its outputs. The FMU carries
this file, and the model as the module that `chainunit.fmu.printed_model` prints.

It never raises: a reason is logged, outputs become NaN, and a step is refused. Outputs are evaluated when they are
read, once per state, together with the outputs that were read at an earlier state.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NamedTuple

from ..core import bounds, messages
from ..core.integrators import ADDED_UP, ROUNDED, SAME_TIME, BudgetError, controlled, rk4
from ..core.printing.python_functions import function_text

NAN = float("nan")
_IDENTITY = __name__.partition(".")[0]
"""Inside an FMU: the name of its package, which has a hash of all contents of the FMU."""
_GROWTHS = 3
"""How often outputs join the evaluated ones; after that all are evaluated."""


class Settable(NamedTuple):
    """A parameter or an input: its name, unit and description, its bounds (see `chainunit.core.quantities.Quantity`),
    its type in FMI and its start value."""

    name: str
    unit: str
    description: str
    allowed: str
    low: float
    high: float
    slack: float
    open_low: bool
    tunable: bool
    type: str
    start: float

    def admits(self, x: float) -> bool:
        """Whether the value is allowed, or beyond a bound by rounding only."""
        whole = self.type != "Real"
        return bool(bounds.admits(x, self.low, self.high, self.slack, self.open_low, whole))

    def within_bounds(self, x: float) -> float:
        """The allowed value; the bound in place of a value that is beyond it by rounding."""
        return bounds.within(x, self.low, self.high)

    def complaint(self, x: float) -> str:
        """The line that refuses the value."""
        bounded = math.isfinite(self.low) or math.isfinite(self.high)
        return bounds.complaint(self.name, x, self.unit, self.allowed, bounded, self.description)


class _RefusedError(Exception):
    """The values make no model."""


@cache
def _evaluation(model: Any, references: frozenset[int]) -> tuple[frozenset[int], list[int], Any]:
    """These variables, always as the same object, the outputs among them by reference, and their function."""
    first = len(model.SETTABLE) + len(model.NOMINAL)
    outputs = sorted(i for i in references if i >= first)
    results = [model.OUTPUTS[i - first] for i in outputs]
    functions: dict[str, Any] = {}
    exec(function_text("def values(p, u, x, k=()):", model.STATEMENTS, results), vars(model), functions)
    return references, outputs, functions["values"]


class ModelInstance:
    """An instance of the printed `model`; `log` gets each line for the user. Variables are known by their value
    references: parameters, inputs, states, outputs."""

    def __init__(self, model: Any, log: Callable[[str], None]) -> None:
        self.model, self._log = model, log
        self.settable = [Settable(*row) for row in model.SETTABLE]
        self.first_input, self.first_state = model.PARAMETERS, len(self.settable)
        self.first_output = self.first_state + len(model.NOMINAL)
        count = self.first_output + len(model.OUTPUTS)
        self._now = [v.start for v in self.settable] + [NAN] * (count - self.first_state)
        ends = self.first_state, self.first_output, count
        self._settable, self._states, self._all = (frozenset(range(end)) for end in ends)
        self._current = self._settable
        """the variables whose values in `_now` are up to date"""
        self._read, self._growths = self._states, 0
        """the outputs that were read, with all other variables, and how often outputs were added"""
        self._p: list[float] | None = None
        self._derived: Sequence[float] | None = None
        """from the fixed parameters, which do not change after the initialization"""
        self._derived_argument: tuple[Sequence[float], ...] = ()
        """the derived values as the last argument of the model's functions; empty if the model has none"""
        self._x: Sequence[float] = ()  # empty before the start of the states
        self._pace = 0.0  # next substep of an integrator that controls its error
        self._closed = False
        self._initialized = False
        self._doubtful = set(range(self.first_input, self.first_state))
        """inputs that may be out of their bounds"""
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
        """One communication step; False if the model, its inputs or the step are not usable."""
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
            name = self.settable[self.model.MAX_STEPS].name
            over = {"size": size, "time": time, "name": name, "most": reason.most}
            self.tell(messages.OVER_BUDGET.format(**over))
        except (ArithmeticError, ValueError):
            self.tell(messages.ASTRAY.format(time=time))
        except BaseException as reason:
            self.tell(f"step from t = {time:g} s failed: {reason!r}")
        return False

    def _bad_step(self, time: float, size: float) -> str:
        """Why a step cannot be taken from the present time; else an empty text."""
        if not (math.isfinite(time) and 0.0 <= size < math.inf and time + size < math.inf):
            return messages.STEP_SIZE.format(size=size, time=time)
        if abs(time - self._time) > SAME_TIME * size + ROUNDED * abs(self._time):
            return messages.STEP_BEGIN.format(time=time, now=self._time)
        if not time + size <= self._stop:
            return messages.STEP_END.format(size=size, time=time, stop=self._stop)
        return ""

    def _advance(self, time: float, step: float) -> bool:
        """Take states and inputs to the end of a step; False if a state runs away."""
        run = self._running()
        if self.model.NOMINAL:
            x = self._integrate(run, step)
            if not all(map(math.isfinite, x)):
                self.tell(messages.ASTRAY.format(time=time))
                return False
            self._x = x
        for place, rate, half in run:
            reference = self.first_input + place
            self._now[reference] = self.settable[reference].within_bounds(
                self._now[reference] + step * (rate + step * half)
            )
            self._doubtful.add(reference)
        self._touch()
        self._closed = self.model.CONTROLLED
        return True

    def _integrate(self, run: list[tuple[int, float, float]], step: float) -> list[float]:
        """The states after a step [s]; `run` are the inputs that move in it, see `_running`."""
        p, derived, model = self._p, self._derived_argument, self.model
        still = self._inputs()

        def inputs(since: float) -> list[float]:
            """The inputs, with the running ones at the time `since` [s] after they were set."""
            if not run:
                return still
            values = still.copy()
            for place, rate, half in run:
                values[place] += since * (rate + since * half)
            return values

        def rates(since: float, x: Sequence[float]) -> Sequence[float]:
            derivatives: Sequence[float] = model.derivatives(p, inputs(since), x, *derived)
            return derivatives

        def close(since: float, x: Sequence[float]) -> Sequence[float]:
            states: Sequence[float] = model.closed(p, inputs(since), x, *derived)
            return states

        (longest,), most = model.internal_step(p), self._now[model.MAX_STEPS]
        x = self._x
        if not model.CONTROLLED:
            return rk4(rates, x, step, longest, most)
        for _ in range(0 if self._closed else 2):
            x = close(0.0, x)
        (tolerance,) = model.tolerance(p)
        later, self._pace = controlled(
            rates, close, x, step, self._pace, longest, tolerance, model.NOMINAL, most
        )
        return later

    # -- values

    def assign(self, reference: int, value: float) -> None:
        """Set a parameter or an input; a fixed parameter only before the end of the initialization."""
        variable = self.settable[reference]
        if variable.admits(value):
            value = variable.within_bounds(value)
        if self._now[reference] == value:
            return
        if reference >= self.first_input:
            self._now[reference] = value
            self._doubtful.add(reference)
            self._start_anew()
            self._touch()
        elif not self._initialized:
            self._take(reference, value)
        elif not variable.tunable:
            self.tell(messages.FIXED.format(name=variable.name) + "; not changed")
        elif not variable.admits(value):
            self.tell(variable.complaint(value) + "; not changed")
        else:
            self._take(reference, value)

    def _take(self, reference: int, value: float) -> None:
        """Set a parameter: all that follows from it is computed anew."""
        self._now[reference] = value
        self._p = None
        self._start_anew()
        self._touch()

    def _start_anew(self) -> None:
        """Start the states again at the next use, unless the initialization has already started them."""
        if not self._initialized or self._unstarted:
            self._x, self._unstarted = (), ""

    def values(self, references: Sequence[int]) -> list[float]:
        """The values of these variables; outputs are evaluated at most once per state."""
        if not self._current.issuperset(references):
            self._evaluate(references)
        now = self._now
        return [now[i] for i in references]

    def _evaluate(self, references: Sequence[int]) -> None:
        """Evaluate these variables and the outputs that were read before; all are NaN if the model has a fault."""
        bad = self.prepare()
        count = self.first_output - self.first_state
        self._now[self.first_state : self.first_output] = [NAN] * count if bad else self._x
        self._current = self._states
        if self._states.issuperset(references):
            return
        bad = bad or self._bad_input()
        if not bad:
            if not self._read.issuperset(references):
                self._growths += 1
                wanted = self._all if self._growths > _GROWTHS else self._read.union(references)
                self._read, _, _ = _evaluation(self.model, wanted)
            # an output that was read at an earlier state only must not spoil these
            bad = self._fault(self._read) and self._fault(self._states.union(references))
        if bad:
            self.tell(bad)
            self._now[self.first_output :] = [NAN] * len(self.model.OUTPUTS)
            self._current = self._all

    def _fault(self, references: frozenset[int]) -> str:
        """Evaluate the outputs among these variables; why they have no values, or an empty text."""
        try:
            self._current, outputs, function = _evaluation(self.model, references)
            values = function(self._p, self._inputs(), self._x, *self._derived_argument)
            # the sum of finite numbers is finite, except of the largest, and takes a third of the time
            if not (math.isfinite(sum(values)) or all(map(math.isfinite, values))):
                raise ArithmeticError
        except (ArithmeticError, ValueError):
            return messages.NO_OUTPUT.format(model=self.model.NAME, time=self._time)
        except BaseException as reason:
            return f"outputs cannot be evaluated: {reason!r}"
        for i, value in zip(outputs, values, strict=True):
            self._now[i] = value
        return ""

    def _touch(self) -> None:
        """Mark all outputs for a new evaluation."""
        self._closed = False
        self._current = self._settable

    def prepare(self) -> str:
        """Check the parameters and start the states, after a change of either. Returns why they make no model, or an
        empty text."""
        if bad := self._unrestored or self._bad_experiment():
            self.tell(bad)
            return bad
        if self._p is None:
            self._refusal = self._refused_parameters()
            if self._refusal:
                self.tell(self._refusal)
        if self.model.NOMINAL and not (self._x or self._refusal or self._unstarted):
            self._start()
        return self._refusal or self._unstarted

    def _refused_parameters(self) -> str:
        """Take the parameters, with the values that are derived from them; why they make no model, or an empty
        text."""
        derived, self._derived = self._derived if self._initialized else None, None
        p = self._p = self._now[: self.first_input]
        model = self.model
        try:
            for variable, x in zip(self.settable, p, strict=False):
                if not variable.admits(x):
                    return variable.complaint(x)
            p[:] = [v.within_bounds(x) for v, x in zip(self.settable, p, strict=False)]
            if model.DERIVED:
                derived = model.derive(p) if derived is None else derived
                self._derived_argument = (derived,)
            if model.REQUIRED:
                self._check(model.REQUIRED, model.requirements(p, *self._derived_argument))
            self._derived = derived
        except BaseException as reason:
            return str(reason) or repr(reason)
        return ""

    def _check(self, required: Sequence[Any], limits: Sequence[float]) -> None:
        """Raise an error for a requirement that is not met."""
        for k, (subject, unit, why, remedy, context) in enumerate(required):
            value, low, high = three = limits[3 * k : 3 * k + 3]
            if not low < value < high:
                parameters = {self.settable[i].name: self._now[i] for i in context}
                raise _RefusedError(bounds.refusal(subject, unit, why, remedy, parameters, three))

    def _start(self) -> None:
        """Compute the states at the start, or keep why there are none."""
        model, p = self.model, self._p
        try:
            if bad := self._bad_input():
                raise _RefusedError(bad)
            u, z = self._inputs(), ()
            if model.UNKNOWNS:
                z = model.guess(p, u)
                for _ in range(model.START_ROUNDS):
                    z = model.improved(p, u, z)
            x = model.initial(p, u, z)
            if model.START_REQUIRED:
                self._check(model.START_REQUIRED, model.start_limits(p, u, x, *self._derived_argument))
            if not all(map(math.isfinite, x)):
                raise _RefusedError(messages.NO_OUTPUT.format(model=model.NAME, time=self._time))
            self._x, self._pace = x, 0.0
        except BaseException as reason:
            self._unstarted = str(reason) or repr(reason)
            self.tell(self._unstarted)

    def _bad_experiment(self) -> str:
        """Why the start and the stop time are not allowed; else an empty text."""
        if not math.isfinite(self._time):
            return messages.TIME.format(which="start time", time=self._time)
        if not self._time <= self._stop:
            return messages.STOP.format(stop=self._stop, start=self._time)
        return ""

    def _inputs(self) -> list[float]:
        return self._now[self.first_input : self.first_state]

    def _running(self) -> list[tuple[int, float, float]]:
        """Place, rate and half of the second derivative of each input that follows another one and moves."""
        u = self._inputs()
        rows = [
            (place, u[rate], 0.5 * u[second] if second >= 0 else 0.0)
            for place, rate, second in self.model.RATES
        ]
        return [row for row in rows if row[1] or row[2]]

    def _bad_input(self) -> str:
        """The refusal of the first input that is not allowed; else an empty text."""
        for reference in sorted(self._doubtful):
            if not self.settable[reference].admits(self._now[reference]):
                return f"input {self.settable[reference].complaint(self._now[reference])}"
        self._doubtful.clear()
        return ""

    # -- saved states

    def saved(self) -> dict[str, Any]:
        """The state of the instance, ready for JSON."""
        if self._unrestored:
            return {"damaged": "it was taken after one that was refused"}
        return {
            "of": _IDENTITY,
            "set": self._now[: self.first_state],
            "x": list(self._x),
            "time": self._time,
            "stop": self._stop,
            "initialized": self._initialized,
            "started": bool(self._x),
            "pace": self._pace,
            "closed": self._closed,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Take a saved state; if it is none of this model, nothing works until another one is restored."""
        try:
            why = self._bad_state(state)
        except (KeyError, TypeError, ValueError, AttributeError):
            why = "it is not a saved state of this model"
        self._touch()
        self._unrestored = messages.STATE.format(why=f"{why}; not restored") if why else ""
        if why:
            self.tell(self._unrestored)
            return
        self._now[: self.first_state], self._x = state["set"], list(state["x"])
        self._time, self._stop, self._pace = state["time"], state["stop"], state["pace"]
        self._initialized = state["initialized"]
        self._doubtful = set(range(self.first_input, self.first_state))
        # the state may belong to another geometry
        self._p = self._derived = None
        self._unstarted = ""
        self._closed = state["closed"]

    def _bad_state(self, state: dict[str, Any]) -> str:
        """Why the state cannot be restored, or an empty text; raises an error if it is no state of this model."""
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
        states = self.first_output - self.first_state if state["started"] else 0
        complete = len(values) == self.first_state and len(x) == states
        if not (numbers and complete and state["pace"] >= 0.0 and {type(flag) for flag in flags} == {bool}):
            raise ValueError
        if not all(map(math.isfinite, x)):
            return "a value in it is not finite"
        if state["started"] and state["initialized"]:  # else `prepare` judges them
            for variable, value in zip(self.settable[: self.first_input], values, strict=False):
                if not variable.admits(value):
                    return variable.complaint(value)
        return ""
