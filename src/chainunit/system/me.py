"""The system as one ODE: all FMUs as Model Exchange under one solver that controls its error.

There is no communication step between the FMUs: at each evaluation of the derivatives the connected variables are
transferred in the order of their true dependencies, with each load at exactly the present angle and speed. Rows come
from the dense output of the solver. It stops at events: where a signal has a corner, where an FMU has named a time,
where an event indicator changes its sign, and where an FMU asks for one after a step, as a chain does whose states
have drifted off its constraints. After an event the solver begins anew from the states that the FMUs have then. A
guard ends a run at the instant at which it is passed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.integrate

from ..errors import InputError, RunError
from .graph import System
from .instance import DiscardError, ExchangeInstance
from .signals import at_time, corners
from .simulation import Simulation, Watch, beyond

METHODS = ("DOP853", "RK45", "RK23", "Radau", "BDF", "LSODA")
"""Solvers of scipy. The explicit ones suit motors, shafts and chains; Radau and BDF suit what is stiff."""
_ROUNDS = 100
"""Rounds of an event, in which the FMUs must agree."""
_SAMPLES = 8
"""of a step, at which event indicators are looked at: the solver of a smooth motion takes long ones"""
_HALVINGS = 60
"""with which an event is placed in its step"""


class ModelExchange(Simulation):
    """A running system of Model Exchange FMUs.

    Parameters
    ----------
    system, signals, start_time : see `Simulation`; a signal that jumps or bends must tell its `corners`
    rtol : relative tolerance of the solver; the absolute one is its thousandth of each state's nominal size, and at
        least 1e-12
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
        if method not in METHODS:
            raise InputError(f"method = {method}: must be one of {', '.join(METHODS)}")
        self._rtol, self._method = rtol, getattr(scipy.integrate, method)
        self._pace: float | None = None
        """step that the solver would take next [s]"""
        self._refused: DiscardError | None = None
        """why the last evaluation failed, if it did"""
        self._next_event = math.inf
        """time of the next event that an FMU has named [s]"""
        self.events = 0
        """events since the start, those at the begin of a run left out"""
        super().__init__(system, signals, start_time)

    def _initialize(self) -> None:
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
        """Make all values consistent at the time `t` [s] and states `x`; signals may be those of another time."""
        for unit, own in zip(self._units, self._slices, strict=True):
            unit.put(t, x[own])
        self._set_inputs(t if inputs_at is None else inputs_at)

    def _set_inputs(self, t: float) -> None:
        for instance, handle, names in self._inputs:
            instance.write(handle, [at_time(self.signals[full], t) for full in names])
        self._transfer()

    def _within(self, t: float) -> float:
        """A time at which a signal has the value that it has in the stretch of the solver: just behind the begin,
        where it may have jumped, and before the end."""
        return min(max(t, self._from), self._until)

    def _rates(self, t: float, x: Any) -> Any:
        """Derivatives of all states; not a number where an FMU cannot compute, so that the solver steps shorter."""
        dx = np.empty_like(self._x)
        try:
            self._put(t, x, self._within(t))
            for unit, own in zip(self._units, self._slices, strict=True):
                dx[own] = unit.rates()
        except DiscardError as error:
            self._refused = error
            dx[:] = math.nan
        return dx

    def _indicators(self, t: float, x: Any) -> Any:
        """The event indicators of all FMUs."""
        self._put(t, x, self._within(t))
        return np.concatenate([np.array(unit.indicators()) for unit in self._units])

    # -- events

    def _settle(self, t: float) -> None:
        """Let the FMUs, in event mode, agree on what is discrete, and go on in continuous time; takes their
        states."""
        self._inputs = self._driven()
        for _ in range(_ROUNDS):
            self._set_inputs(np.nextafter(t, math.inf))
            answers = [unit.update() for unit in self._units]
            if not any(again for again, _ in answers):
                break
        else:
            raise RunError(f"the event at t = {t:g} s finds no end in {_ROUNDS} rounds")
        self._next_event = min((time for _, time in answers), default=math.inf)
        for unit, own in zip(self._units, self._slices, strict=True):
            unit.leave_event()
            self._x[own] = unit.states()

    def _event(self, t: float) -> None:
        for unit in self._units:
            unit.enter_event()
        self._settle(t)

    # -- the solver

    def _begin(self, stop: float) -> None:
        """Signals may be others than before: an event."""
        self._stop = stop
        self._corners = corners(self.signals.values())
        self._event(self.time)
        self._restart(self.time)
        self._pieces: list[tuple[float, float, Any]] = []
        self._put(self.time, self._x, self._from)

    def _restart(self, t: float) -> None:
        """A new solver from the time `t` [s] to the next event that is known beforehand, or the end of the run."""
        ahead = (*(c for c in self._corners if c > t), self._next_event, self._stop)
        self._from = float(np.nextafter(t, math.inf))
        self._reached, self._until = t, max(min(ahead), self._from)
        self._dense: Any = None
        self._refused = None
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
        """One step of the solver, at most to the first change of sign of an event indicator in it."""
        if self._dense is not None:
            self._complete()
        before = float(self._solver.t)
        message = self._solver.step()
        if self._solver.status == "failed":
            why = f": {self._refused}" if self._refused else ""
            raise RunError(f"step at t = {before:g} s: the solver gives up ({message}){why}")
        self._dense = self._solver.dense_output()
        self._reached, self._crossed = float(self._solver.t), False
        if self._signs.size:
            self._find_event(before)

    def _complete(self) -> None:
        """End the last step of the solver, with the events at its end."""
        t, x = self._reached, self._dense(self._reached)
        self._put(t, x, self._within(t))
        events = [unit.completed() for unit in self._units]
        if self._crossed or any(events) or t >= self._until:
            self._pace = getattr(self._solver, "h_abs", None)
            self.events += 1
            self._event(t)
            self._restart(t)

    def _find_event(self, low: float) -> None:
        """Shorten the step to just behind the first change of sign of an event indicator. Two changes between the
        same two samples are not seen."""

        def changed(t: float) -> bool:
            signs = self._indicators(t, self._dense(t)) > 0.0
            # one that is zero at the begin of a step has no sign yet, such as the height of a ball that bounces
            self._signs = np.where(self._unsigned, signs, self._signs)
            self._unsigned[:] = False
            return bool((signs != self._signs).any())

        for high in np.linspace(low, self._reached, _SAMPLES + 1)[1:].tolist():
            if changed(high):
                break
            low = high
        else:
            return
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if changed(middle) else (middle, high)
        self._reached, self._crossed = high, True

    def _steps(self, times: Any) -> Iterator[None]:
        for after in times[1:].tolist():
            self._pieces = self._pieces[-1:]
            while self._reached < after:
                before = self._reached
                self._advance()
                self._pieces.append((before, self._reached, self._dense))
            self._put(after, self._dense(after), self._within(after))
            self._row, self.time = self.time, after
            yield

    def _meet(self, watches: Sequence[Watch]) -> None:
        """See `Simulation`: by bisection in the dense output since the last row, to the time just behind it."""
        row, now = self._row, self.time
        pieces = ((max(begin, row), min(end, now), dense) for begin, end, dense in self._pieces)
        low, high, dense = next(piece for piece in pieces if self._at(*piece[1:], watches))
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if self._at(middle, dense, watches) else (middle, high)
        self._at(high, dense, watches)
        self.time = high

    def _at(self, t: float, dense: Any, watches: Sequence[Watch]) -> bool:
        """Go to an instant of a step of the solver; whether a guard is passed there."""
        self._put(t, dense(t))
        return beyond(watches)

    # -- branching

    def save(self) -> float:
        """See `Simulation.save`; a branch begins with the same step of the solver."""
        self._saved_pace = self._pace
        return super().save()

    def restore(self) -> None:
        """See `Simulation.restore`."""
        super().restore()
        self._pace = self._saved_pace
