"""A machine whose torque is measured in the shaft between gear and crank. Of the motor nothing is known.

In steady running the motion repeats with the turn. The angle of the crank is that of an even motion and a Fourier
series in it,

    phi = theta + sum_k (c_k + d_k s) cos(k theta) + (f_k + g_k s) sin(k theta)
    theta = theta_0 + omega (t - t_0) + q_2 P_2(s) + q_3 P_3(s)

with s from -1 to 1 over the run. Its coefficients are nuisances: speed and acceleration follow from them without
noise, and the torque `J a + tau_bias` from the inverse machine. After the motor was switched off, its rotor turns
with the machine; then inertia and friction behind the shaft are nuisances.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..batch.evaluate import evaluate
from ..core.errors import InputError, RunError
from ..core.quantities import Variable
from ..drives.free_rotor import FreeRotor
from ..machines.machine import Machine
from ..study.drive import Drive
from .measurands import COUNTS
from .plant import ANGLE, CRANK, GUARD, AnyPlant, Nuisance, Overview, Response, Scenario, SourcedLoop

if TYPE_CHECKING:
    import xarray as xr

MEASURED = ("crank.tau", "crank.w", "motor.w", "motor.count")
"""Quantities of a machine whose torque is measured behind its motor, of which nothing need be known."""
ORDERS, CHANGING = 60, 6
"""Orders of the crank in its motion, and the orders that may change over the run, as a motor warms up."""
RIPPLE, CHANGE = 0.3, 0.05
"""Standard deviation of the first order of the speed in parts of the mean speed, that of order k being 1/k^2 of it;
and of its change over half of the run, in parts of the order itself."""
SPEED, INERTIA, FRICTION = "speed", "inertia", "friction"
_SLOW = ("phase.2", "phase.3")
_MOTION = ("phi", "w", "a")
_AFTER = 0.1
"""Standard deviation of the speed at which the motor is switched off, in parts of the mean speed."""


def _waves() -> list[tuple[str, int, bool, bool]]:
    """Of each coefficient: its name, the order, whether it is that of a sine, and whether it changes."""
    return [
        (f"order.{k}.{'sin' if sine else 'cos'}{'.change' if changes else ''}", k, sine, changes)
        for k in range(1, ORDERS + 1)
        for sine in (False, True)
        for changes in ((False, True) if k <= CHANGING else (False,))
    ]


WAVES = _waves()


class MeasuredShaft(AnyPlant):
    """The machine behind a shaft whose torque is measured.

    Parameters
    ----------
    machine : the machine, with the ratio of its gear
    measured : of `MEASURED`
    by : full names of the parameters and inputs of the machine that are sought, as in a drive: "machine.r"

    Raises
    ------
    InputError
        for another quantity, and for a name of the motor.
    """

    may_advance = False

    def __init__(self, machine: Machine, measured: Sequence[str], by: Sequence[str]) -> None:
        super().__init__(machine)
        for name in measured:
            if name not in MEASURED:
                raise InputError(
                    f"{name}: is not measured at a shaft without motor data; there are {', '.join(MEASURED)}"
                )
        model = machine.model
        arguments = {*model.parameter_layout.names, *model.input_layout.names}
        for name in by:
            if name.removeprefix("machine.") not in arguments:
                raise InputError(
                    f"{name}: is no parameter or load of the machine, and of the motor nothing is known"
                )
        self._measured, self._by = tuple(measured), tuple(by)

    def with_names(self, by: Sequence[str]) -> MeasuredShaft:
        """The same plant, of which the parameters and inputs `by` are sought."""
        return MeasuredShaft(self.machine, self._measured, by)

    def parameters(self) -> Iterator[tuple[Variable, float]]:
        """The parameters of the machine."""
        for v in self.machine.model.parameter_layout.variables:
            yield replace(v, name=f"machine.{v.name}"), float(self.machine.by_name[v.name])

    def nuisances(self, run: Overview) -> Iterator[Nuisance]:
        """The motion of a steady run; the state at which the motor is switched off, and what then turns with the
        machine, at the crank [kg m2], [N m s/rad]."""
        if run.off is not None:
            angle = run.angle + run.crank_speed * (run.off - run.begin)
            yield Nuisance(ANGLE, "rad", angle, 10.0, 0.01)
            yield Nuisance(SPEED, "rad/s", run.crank_speed, _AFTER * run.crank_speed, 0.02 * run.crank_speed)
            yield Nuisance(INERTIA, "kg.m2", 5.0, 20.0, 0.5, 1e-3)
            yield Nuisance(FRICTION, "N.m.s/rad", 1.0, 10.0, 0.2, 0.0)
            return
        yield Nuisance(ANGLE, "rad", run.angle, 10.0, 0.01)
        yield Nuisance(SPEED, "rad/s", run.crank_speed, 0.1 * run.crank_speed, 1e-3)
        for name in _SLOW:
            yield Nuisance(name, "rad", 0.0, 1.0, 1e-3)
        for name, k, _, changes in WAVES:
            spread = RIPPLE / k**3 * (CHANGE if changes else 1.0)
            yield Nuisance(name, "rad", 0.0, spread, spread)

    def respond(
        self, scenario: Scenario, directions: Mapping[str, tuple[str, float]], workers: int = 1
    ) -> Response:
        """Simulate a run; the slopes are derivatives by changes of the size of the `directions`."""
        changes = list(directions.values())
        if scenario.off is not None:
            return self._switched_off(scenario, scenario.off, changes, workers)
        time = scenario.rows
        motion = CrankSeries(scenario.nuisances, time, (scenario.begin, scenario.end))
        torque, slopes_of = self._torque(scenario.values, motion.rows, workers)
        angle, speed = motion.rows[:2]
        count = self.ratio * COUNTS / (2.0 * math.pi)
        rows = {"crank.tau": torque, "crank.w": speed, "motor.w": self.ratio * speed, CRANK: angle}
        rows["motor.count"] = count * angle
        slopes = {name: np.zeros((len(changes), len(time))) for name in rows}
        for place, (name, size) in enumerate(changes):
            if name in slopes_of:
                slopes["crank.tau"][place] = size * slopes_of[name]
                continue
            motion_slopes = size * motion.slopes(name)
            slopes["crank.tau"][place] = sum(
                slopes_of[quantity] * x for quantity, x in zip(_MOTION, motion_slopes, strict=True)
            )
            for quantity, factor, k in (
                ("crank.w", 1.0, 1), ("motor.w", self.ratio, 1), ("motor.count", count, 0), (CRANK, 1.0, 0),
            ):  # fmt: skip
                slopes[quantity][place] = factor * motion_slopes[k]
        kept = (*self._measured, CRANK)
        return Response(time, {name: rows[name] for name in kept}, {name: slopes[name] for name in kept})

    def _torque(self, values: Mapping[str, Any], motion: Any, workers: int) -> tuple[Any, dict[str, Any]]:
        """The torque at the crank along a motion of the crank (angle, speed, acceleration), shape (3, rows), and its
        derivatives by all sought quantities and by the motion: with derivatives that a run does not need, all runs
        share compiled code."""
        import xarray as xr

        model, ratio = self.machine.model, self.ratio
        machine_values = {
            name.removeprefix("machine."): x for name, x in values.items() if name.startswith("machine.")
        }
        p = self.machine.replace(
            {k: x for k, x in machine_values.items() if k in model.parameter_layout.names}
        ).p
        # a sought parameter is an argument, at its value
        arguments = model.parameter_layout.by_name(p) | {
            k: x for k, x in machine_values.items() if k in model.input_layout.names
        }
        along = {name: xr.DataArray(ratio * x, dims="row") for name, x in zip(_MOTION, motion, strict=True)}
        names = [name.removeprefix("machine.") for name in self._by]
        result = evaluate(model, arguments | along, ["tau"], by=[*names, *_MOTION], workers=workers)
        if np.any(result["reason"].values):
            reasons = result["reason"].attrs["reasons"]
            raise RunError(f"the machine has no torque at a row of the run: {reasons}")
        slopes = {
            name: ratio * _rows(result, f"d(tau)/d({argument})", motion)
            for name, argument in zip(self._by, names, strict=True)
        }
        slopes |= {name: ratio * ratio * _rows(result, f"d(tau)/d({name})", motion) for name in _MOTION}
        return ratio * result["tau"].values, slopes

    def _switched_off(
        self, scenario: Scenario, off: float, changes: Sequence[tuple[str, float]], workers: int
    ) -> Response:
        """The run from the time on at which the motor is switched off."""
        if off + GUARD >= scenario.end:
            none, nothing = np.zeros(len(scenario.rows)), np.zeros((len(changes), len(scenario.rows)))
            kept = (*self._measured, CRANK)
            return Response(
                scenario.rows,
                dict.fromkeys(kept, none),
                dict.fromkeys(kept, nothing),
                spans=dict.fromkeys((*kept, "mark"), ()),
            )
        nuisances, ratio = scenario.nuisances, self.ratio
        names = {INERTIA: ("motor.rotor.J", ratio**-2), FRICTION: ("motor.rotor.d", ratio**-2)}
        values = dict(scenario.values) | {
            full: nuisances[name] * factor for name, (full, factor) in names.items()
        }
        turned = [
            (names[name][0], size * names[name][1]) if name in names else (name, size)
            for name, size in changes
        ]
        loop = self._free
        start = loop.start(values, {}, off)
        states = {name: np.array([x, *(0.0 for _ in changes)]) for name, x in start.items()}
        for state, nuisance in (("motor.phi", ANGLE), ("motor.w", SPEED)):
            states[state][0] = nuisances[nuisance] * ratio
            states[state][1:] = [size * ratio * (name == nuisance) for name, size in changes]
        piece = loop.run(values, states, turned, (off, scenario.end), scenario.step, workers)
        response = loop.response(piece)
        spans = dict.fromkeys(response.values, ((off + GUARD, math.inf),))
        return replace(response, spans={**spans, "mark": ()})

    @cached_property
    def _free(self) -> SourcedLoop:
        drive = Drive(FreeRotor, FreeRotor.Parameters(), self.machine)
        return SourcedLoop(drive, self._measured, [*self._by, "motor.rotor.J", "motor.rotor.d"])


def _rows(result: xr.Dataset, name: str, motion: Any) -> Any:
    """A derivative at all rows, also one that is constant."""
    return np.broadcast_to(result[name].values, motion[0].shape)


class CrankSeries:
    """The motion of the crank with these nuisances at these times: `rows` are angle [rad], speed [rad/s] and
    acceleration [rad/s2], shape (3, times). `span` is that of the run [s]."""

    def __init__(self, nuisances: Mapping[str, float], time: Any, span: tuple[float, float]) -> None:
        begin, end = span
        half = 0.5 * (end - begin)
        s = (time - begin) / half - 1.0
        one, none = np.ones(len(time)), np.zeros(len(time))
        self._slow = {
            ANGLE: np.stack([one, none, none]),
            SPEED: np.stack([time - begin, one, none]),
            "phase.2": np.stack([1.5 * s * s - 0.5, 3.0 * s / half, 3.0 * one / half**2]),
            "phase.3": np.stack([(2.5 * s * s - 1.5) * s, (7.5 * s * s - 1.5) / half, 15.0 * s / half**2]),
        }
        # of the even motion, and the factors of the coefficients: constant, and growing over the run
        self._theta = np.sum([nuisances[name] * x for name, x in self._slow.items()], axis=0)
        self._waves: dict[tuple[int, bool], list[Any]] = {}
        self._growth = {False: (one, none), True: (s, one / half)}
        self._by_theta = np.stack([one, none, none])
        rows = self._theta.copy()
        for name, k, sine, changes in WAVES:
            c = nuisances[name]
            if c:
                h = self._wave(k, sine)
                rows += c * self._along(h[0], h[1], h[2], changes)
                self._by_theta += c * self._along(h[1], h[2], h[3], changes)
        self.rows = rows

    def _wave(self, k: int, sine: bool) -> list[Any]:
        """A cosine or sine of the even angle and its first three derivatives by that angle."""
        if (k, sine) not in self._waves:
            c, s = np.cos(k * self._theta[0]), np.sin(k * self._theta[0])
            self._waves[k, False] = [c, -k * s, -k * k * c, k**3 * s]
            self._waves[k, True] = [s, k * c, -k * k * s, -(k**3) * c]
        return self._waves[k, sine]

    def _along(self, h: Any, h1: Any, h2: Any, changes: bool) -> Any:
        """A function `h` of the even angle, with the derivatives `h1` and `h2`, times its factor, and the first two
        derivatives of that by the time, shape (3, times)."""
        (g, rate), (_, w, a) = self._growth[changes], self._theta
        return np.stack([g * h, rate * h + g * h1 * w, 2.0 * rate * h1 * w + g * (h2 * w * w + h1 * a)])

    def slopes(self, name: str) -> Any:
        """The derivatives of the rows by a nuisance, shape (3, times)."""
        if name in self._slow:
            (f, f1, f2), (g, g1, g2) = self._slow[name], self._by_theta
            return np.stack([f * g, f1 * g + f * g1, f2 * g + 2.0 * f1 * g1 + f * g2])
        _, k, sine, changes = next(wave for wave in WAVES if wave[0] == name)
        h = self._wave(k, sine)
        return self._along(h[0], h[1], h[2], changes)
