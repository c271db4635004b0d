"""The system as one ODE: all FMUs as Model Exchange under one solver that controls its error.

There is no communication step between the FMUs: at each evaluation of the derivatives the connected variables are
transferred in the order of their true dependencies, with each load at exactly the present angle and speed. Rows come
from the dense output of the solver. The solver stops at events: where a signal has a corner, at a time event of an
FMU, where an event indicator changes its sign, and where an FMU requests an event after a step, such as a chain whose
states have drifted off its constraints. After an event the solver starts anew from the present states of the FMUs. A
guard ends a run at the instant at which its limit is passed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from ..core.errors import InputError, RunError
from .graph import System
from .instance import DiscardError, ExchangeInstance
from .signals import at_time, corners
from .simulation import FmuSimulation, Guarded, beyond

METHODS = ("DOP853", "RK45", "RK23", "Radau", "BDF", "LSODA")
"""Solvers of scipy. The explicit ones suit motors, shafts and chains; Radau and BDF suit stiff systems."""
_ROUNDS = 100
"""Largest number of rounds of one event, after which the FMUs must agree."""
_SAMPLES = 8
"""Number of points in a step at which event indicators are evaluated: for a smooth motion the steps are long."""
_HALVINGS = 60
"""Number of bisections that locate an event in its step."""


class ModelExchange(FmuSimulation):
    """A running system of Model Exchange FMUs.

    Parameters
    ----------
    system, signals, start_time : see `FmuSimulation`; a signal that jumps or bends must have `corners`
    rtol : relative tolerance of the solver; the absolute tolerance of a state is a thousandth of it times the state's
        nominal size, and at least 1e-12
    method : one of `METHODS`
    """

    kind = "Model Exchange"
    instances = ExchangeInstance

    def __init__(
        self,
        system: System,
        signals: Mapping[str, Any] | None = None,
        start_time: float = 0.0,
        *,
        rtol: float = 1e-8,
        method: str = "DOP853",
    ) -> None:
        import scipy.integrate

        if method not in METHODS:
            raise InputError(f"method = {method}: must be one of {', '.join(METHODS)}")
        self._rtol, self._method = rtol, getattr(scipy.integrate, method)
        super().__init__(system, signals, start_time)

    def _initialize(self) -> None:
        """Initialize the FMUs, and put their states in series into one vector."""
        self._pace: float | None = None
        """next step of the solver [s]"""
        self._refusal: DiscardError | None = None
        """why the last evaluation failed, if it did"""
        self._next_event = math.inf
        """next time event of the FMUs [s]"""
        self.events = 0
        """number of events since the start, without those at the begin of a run"""
        super()._initialize()
        self._units: list[ExchangeInstance] = list(self._instances.values())
        ends = np.cumsum([0, *(unit.n_states for unit in self._units)])
        self._slices = [slice(a, b) for a, b in pairwise(ends)]
        self._x = np.zeros(int(ends[-1]))
        if not self._x.size:
            raise InputError("no component has states: there is nothing to solve")
        # initialization leaves an FMU in the event mode
        self._settle(self.time)

    # -- one ODE

    def _put(self, t: float, x: Any, inputs_at: float | None = None) -> None:
        """Make all values consistent at the time `t` [s] and the states `x`; `inputs_at` is the time of the signals
        if it differs."""
        for unit, rows in zip(self._units, self._slices, strict=True):
            unit.put(t, x[rows])
        self._set_inputs(t if inputs_at is None else inputs_at)

    def _set_inputs(self, t: float) -> None:
        for instance, handle, names in self._inputs:
            instance.write(handle, [at_time(self.signals[full], t) for full in names])
        self._transfer()

    def _within(self, t: float) -> float:
        """The time `t` limited to the present interval of the solver: from just after its begin, where a signal may
        have jumped, to its end."""
        return min(max(t, self._from), self._until)

    def _rates(self, t: float, x: Any) -> Any:
        """Derivatives of all states; NaN where an FMU cannot compute, so that the solver takes a shorter step."""
        dx = np.empty_like(self._x)
        try:
            self._put(t, x, self._within(t))
            for unit, rows in zip(self._units, self._slices, strict=True):
                dx[rows] = unit.rates()
        except DiscardError as error:
            self._refusal = error
            dx[:] = math.nan
        return dx

    def _indicators(self, t: float, x: Any) -> Any:
        """The event indicators of all FMUs."""
        self._put(t, x, self._within(t))
        return np.concatenate([np.array(unit.indicators()) for unit in self._units])

    # -- events

    def _settle(self, t: float) -> None:
        """Update the FMUs, in event mode, until their discrete states agree; then enter continuous time and read
        their states."""
        self._inputs = self._signal_inputs()
        for _ in range(_ROUNDS):
            self._set_inputs(np.nextafter(t, math.inf))
            answers = [unit.update() for unit in self._units]
            if not any(again for again, _ in answers):
                break
        else:
            raise RunError(f"the event at t = {t:g} s finds no end in {_ROUNDS} rounds")
        self._next_event = min((time for _, time in answers), default=math.inf)
        for unit, rows in zip(self._units, self._slices, strict=True):
            unit.leave_event()
            self._x[rows] = unit.states()

    def _event(self, t: float) -> None:
        for unit in self._units:
            unit.enter_event()
        self._settle(t)

    # -- the solver

    def _begin(self, stop: float) -> None:
        """Begin a run with an event, as the signals may have changed since the last run."""
        self._stop = stop
        self._corners = corners(self.signals.values())
        self._event(self.time)
        self._restart(self.time)
        self._pieces: list[tuple[float, float, Any]] = []
        self._put(self.time, self._x, self._from)

    def _restart(self, t: float) -> None:
        """A new solver from the time `t` [s] to the next corner or time event, or to the end of the run."""
        ahead = (*(c for c in self._corners if c > t), self._next_event, self._stop)
        self._from = float(np.nextafter(t, math.inf))
        self._reached, self._until = t, max(min(ahead), self._from)
        self._dense: Any = None
        self._refusal = None
        nominal = np.concatenate([np.array(unit.nominals()) for unit in self._units])
        self._solver = self._method(
            self._rates,
            t,
            self._x.copy(),
            self._until,
            first_step=None if self._pace is None else min(self._pace, self._until - t),
            rtol=self._rtol,
            atol=np.maximum(1e-12, 1e-3 * self._rtol * nominal),
        )
        indicators = self._indicators(t, self._x)
        self._signs, self._unsigned = indicators > 0.0, indicators == 0.0

    def _advance(self) -> None:
        """One step of the solver, ended at the first change of sign of an event indicator."""
        if self._dense is not None:
            self._complete()
        before = float(self._solver.t)
        message = self._solver.step()
        if self._solver.status == "failed":
            why = f": {self._refusal}" if self._refusal else ""
            raise RunError(f"step at t = {before:g} s: the solver gives up ({message}){why}")
        self._dense = self._solver.dense_output()
        self._reached, self._crossed = float(self._solver.t), False
        if self._signs.size:
            self._find_event(before)

    def _complete(self) -> None:
        """Complete the last step of the solver, with the events at its end."""
        t, x = self._reached, self._dense(self._reached)
        self._put(t, x, self._within(t))
        events = [unit.complete_step() for unit in self._units]
        if self._crossed or any(events) or t >= self._until:
            self._pace = getattr(self._solver, "h_abs", None)
            self.events += 1
            self._event(t)
            self._restart(t)

    def _find_event(self, low: float) -> None:
        """Shorten the step to just after the first change of sign of an event indicator. Two changes between the same
        two samples are not detected."""

        def has_crossed(t: float) -> bool:
            signs = self._indicators(t, self._dense(t)) > 0.0
            # an indicator that is zero at the begin of a step has no sign yet, such as the height of a bouncing ball
            self._signs = np.where(self._unsigned, signs, self._signs)
            self._unsigned[:] = False
            return bool((signs != self._signs).any())

        for high in np.linspace(low, self._reached, _SAMPLES + 1)[1:].tolist():
            if has_crossed(high):
                break
            low = high
        else:
            return
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if has_crossed(middle) else (middle, high)
        self._reached, self._crossed = high, True

    def _steps(self, times: Any) -> Iterator[None]:
        """The steps from time to time [s]: the solver goes on with steps of its own, and the rows lie within them."""
        for after in times[1:].tolist():
            self._pieces = self._pieces[-1:]
            while self._reached < after:
                before = self._reached
                self._advance()
                self._pieces.append((before, self._reached, self._dense))
            self._put(after, self._dense(after), self._within(after))
            self._row, self.time = self.time, after
            yield

    def _meet(self, guarded: Sequence[Guarded]) -> None:
        """See `Simulation`: go back by bisection in the dense output since the last row, to just after the
        instant."""
        row, now = self._row, self.time
        pieces = ((max(begin, row), min(end, now), dense) for begin, end, dense in self._pieces)
        low, high, dense = next(piece for piece in pieces if self._at(*piece[1:], guarded))
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if self._at(middle, dense, guarded) else (middle, high)
        self._at(high, dense, guarded)
        self.time = high

    def _at(self, t: float, dense: Any, guarded: Sequence[Guarded]) -> bool:
        """Set the values at an instant in a step of the solver; whether a guard is passed there."""
        self._put(t, dense(t))
        return beyond(guarded)

    # -- branching

    def save(self) -> float:
        """See `Simulation.save`; every branch begins with the same step of the solver."""
        self._saved_pace = self._pace
        return super().save()

    def restore(self) -> None:
        """Go back to the state that was kept."""
        super().restore()
        self._pace = self._saved_pace
