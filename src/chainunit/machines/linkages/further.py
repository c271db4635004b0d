"""The drivers of a linkage besides the first one: their courses, their inputs, and their outputs.

One that follows has a law, an expression of the place ``phi`` of the first one; a gear drives it, or a motor of its
own. One without a law is an input of its own, with a flange and a load port. While the first driver alone moves over
its way, such a driver stands at the place that its input gives.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from ...core.model import Terminal
from ...core.ports import further_terminals, way_terminals
from ...core.quantities import Value, declared_class, fields_of, group, quantity
from ...groups.driver import Course
from ...mechanism.curves import TableCurve
from ...mechanism.driven import DrivenLinkage, Free, StateOfDrivers
from ...mechanism.driver_ports import ROTATING, SLIDING, DriverPort
from ...mechanism.expressions import LawCourse, expression, held
from ...mechanism.machine import MachineState
from .structure import DriverEntry
from .way import WHOLE

_PLACES = 12
"""Parts of the range of a driver at whose ends the linkage is checked."""
_STRIDE = 5
"""Such parts between two places of the first driver at which a machine is checked with other lengths."""
_MOTION = ("phi", "w", "a")
BACK = 1e-9
"""Half of an angle [rad], or a way [m], by which a driver may miss its place after a turn of the first one."""


class FurtherDrivers:
    """The drivers besides the first one, by their `entries`, each with the name of its variables."""

    def __init__(
        self,
        entries: Sequence[DriverEntry],
        variables: Sequence[str],
        tables: Mapping[str, TableCurve],
    ) -> None:
        """
        Parameters
        ----------
        variables : the names of the group of variables of each driver
        tables : those over the place of the first driver, by name
        """
        self.entries, self.tables = entries, tables
        self.names = dict(zip((entry.name for entry in entries), variables, strict=True))
        self.free = {k: entry for k, entry in enumerate(entries, 1) if entry.is_free}
        """the drivers that are inputs, by their numbers among all drivers"""
        self.geared = (True, *(entry.geared and not entry.is_free for entry in entries))
        """whether the first driver drives each driver, itself among them"""
        self.declared = {entry.name: self._output(entry) for entry in entries}
        """the declaration of the outputs of each driver"""

    @property
    def are_motored(self) -> bool:
        """Whether one that follows has a motor of its own."""
        return any(not entry.geared for entry in self.entries)

    def port(self, entry: DriverEntry) -> DriverPort:
        """The declarations of a driver."""
        return SLIDING if entry.linear else ROTATING

    def courses(
        self, values: Mapping[str, Any], u: Any, places: Mapping[str, Any] | None = None
    ) -> dict[str, Callable[[Any, Any], Course]]:
        """The courses by joint, with the `values` of quantities; inputs stand at the places that `u` gives, or
        at the `places` by name."""
        courses: dict[str, Any] = {}
        for entry in self.entries:
            if entry.law is not None:
                courses[entry.joint] = LawCourse(entry.law, values, self.tables)
            else:
                place = getattr(u, self.names[entry.name]).phi if places is None else places[entry.name]
                courses[entry.joint] = lambda xp, q, place=place: held(place)
        return courses

    # declarations

    def inputs(self) -> list[tuple[str, Any, Any]]:
        """The fields of the inputs: the motion of each driver that is one."""
        fields = []
        for entry in self.free.values():
            low, high = entry.span
            place, unit = ("way", "m") if entry.linear else ("angle", "rad")
            phi = quantity(unit, f"{place} of the driver", default=entry.start, min=low, max=high)
            base = self.port(entry).motion
            motion = declared_class(
                base.__name__,
                (),
                [("phi", Value, phi), ("w", Value, quantity(f"{unit}/s", "its speed", default=0.0)),
                 ("a", Value, quantity(f"{unit}/s2", "its acceleration", default=0.0))],
            )  # fmt: skip
            fields.append(self._field(entry, motion, motion()))
        return fields

    def feed(self) -> list[tuple[str, Any, Any]]:
        """The fields of the inputs in normal running, in which such a driver stands."""
        return [
            self._field(entry, placed, placed())
            for entry, (_, declared, _) in zip(self.free.values(), self.inputs(), strict=True)
            for placed in [declared_class("Place", (), fields_of(declared, without=("w", "a")))]
        ]

    def _field(self, entry: DriverEntry, declared: Any, default: Any = None) -> tuple[str, Any, Any]:
        return self.names[entry.name], declared, group(declared, f"driver {entry.name}", default=default)

    def outputs(self) -> list[tuple[str, Any, Any]]:
        """The fields of the outputs."""
        return [self._field(entry, self.declared[entry.name]) for entry in self.entries]

    def _output(self, entry: DriverEntry) -> Any:
        port = self.port(entry)
        if not entry.is_free:
            return port.follower
        return declared_class("DriverLoad", (port.values,), fields_of(port.follower, without=_MOTION))

    def slopes(self) -> list[tuple[str, Any, Any]]:
        """The fields of the slopes of load ports."""
        return [self._field(entry, self.port(entry).slopes) for entry in self.free.values()]

    def terminals(self) -> Iterator[Terminal]:
        """The terminals of the drivers that are inputs."""
        for entry in self.free.values():
            name = self.names[entry.name]
            yield from way_terminals(True, name) if entry.linear else further_terminals(name)

    def input_rates(self) -> dict[str, str]:
        """The inputs whose time derivative is another input."""
        names = [self.names[entry.name] for entry in self.free.values()]
        pairs = ("phi", "w"), ("w", "a")
        return {f"{name}.{x}": f"{name}.{rate}" for name in names for x, rate in pairs}

    # values

    def motions(self, u: Any) -> Free:
        """The motion of the drivers that are inputs."""
        inputs = {k: getattr(u, self.names[entry.name]) for k, entry in self.free.items()}
        return {k: (motion.phi, motion.w, motion.a) for k, motion in inputs.items()}

    def outputs_at(self, xp: Any, s: MachineState, a: Any) -> dict[str, Any]:
        """The outputs of all drivers in a state of the linkage, at the acceleration `a` of the first one."""
        if not self.entries:
            return {}
        driven = s.driven if isinstance(s, StateOfDrivers) else DrivenLinkage(xp, s.m, s.m.q, s.w, {})
        values = {}
        efforts, accelerations = driven.efforts(a), driven.accelerations(a)
        for k, entry in enumerate(self.entries, 1):
            motion = driven.motions[k]
            common = {"tau": efforts[k], "power": efforts[k] * motion.speed}
            if entry.is_free:
                assert isinstance(s, StateOfDrivers)
                (J, bias), (dJ, _) = driven.port(k, self.geared, a), s.port_slope(k, a)
                load = {"tau_bias": bias, "J": J, "dJ_dphi": dJ, "phi0": motion.place, "w0": motion.speed}
            else:
                load = {"phi": motion.place, "w": motion.speed, "a": accelerations[k]}
            values[self.names[entry.name]] = self.declared[entry.name](**common, **load)
        return values

    def slopes_at(self, s: StateOfDrivers, a: Any) -> dict[str, Any]:
        """The slopes of the load ports of the drivers that are inputs."""
        values = {}
        for k, entry in self.free.items():
            (_, by_place), (_, by_speed) = s.port_slope(k, a), s.port_slope(k, a, by_speed=True)
            declared = self.port(entry).slopes
            values[self.names[entry.name]] = declared(tau_bias_dphi=by_place, tau_bias_dw=by_speed)
        return values

    # places

    def varying(self, turns: bool) -> list[DriverEntry]:
        """The drivers whose law depends on parameters, if the first one `turns` all the way round."""
        fixed = {"phi", *self.tables}
        return [
            entry
            for entry in self.entries
            if turns and isinstance(entry.law, str) and {*expression(entry.law).names} - fixed
        ]

    def misfit(self, xp: Any, entry: DriverEntry, values: Mapping[str, Any], start: float) -> Any:
        """The way by which a driver is not back after a turn of the first one, or the sine of half the angle."""
        course = LawCourse(entry.law or 0.0, values, self.tables)
        way = course(xp, start + WHOLE).place - course(xp, start).place
        return way if entry.linear else xp.sin(0.5 * way)

    def words(self, name: str, place: float) -> str:
        """A place of a driver in words."""
        linear = next(entry.linear for entry in self.entries if entry.name == name)
        return f"{name} at {place:.6g} m" if linear else f"{name} at {math.degrees(place):.4g} deg"

    def grid(self) -> list[dict[str, float]]:
        """The places of the drivers that are inputs at which the linkage is checked, by name: the start first, then
        all others from it outward."""
        free = [*self.free.values()]
        courses = [_even(entry) for entry in free]

        def way(places: Sequence[float]) -> float:
            return sum(
                abs(place - entry.start) / (course[-1] - course[0])
                for place, entry, course in zip(places, free, courses, strict=True)
            )

        start = tuple(entry.start for entry in free)
        rest = sorted(itertools.product(*courses), key=way) if free else []
        return [dict(zip((e.name for e in free), places, strict=True)) for places in (start, *rest)]

    def lattice(self, number: int) -> dict[str, float]:
        """The places of the drivers that are inputs beside the place of that `number` of the first one."""
        return {
            entry.name: _even(entry)[number * _STRIDE**k % (_PLACES + 1)]
            for k, entry in enumerate(self.free.values(), 1)
        }


def _even(entry: DriverEntry) -> list[float]:
    """Even places over the range of a driver."""
    low, high = entry.span
    return [low + (high - low) * k / _PLACES for k in range(_PLACES + 1)]
