"""The types of events, each a class with its quantities; `event` says what a type declares."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

from ..core.quantities import Value, declaration, quantity, whole_number
from ..drives.contactor import CONTACTOR_EDGE
from ..machines.across import NO_WIDTH, PLACES, middle_of, place
from ..machines.chain_unit import SideName, other
from ..reading.text import number
from ..system.signals import Profile
from .event import AnySide, Event, Role, Signals, Timing, Values, filled


def _duration(description: str, default: float, least: float = 1e-4, usual: float = 1e-3) -> Any:
    """The declaration of the time for which an event lasts [s]; `usual` is the least usual one."""
    return quantity("s", description, default=default, min=least, max=1e4, usual=(usual, 60.0))


def _rise(what: str, default: float) -> Any:
    """The declaration of the time in which an input rises and falls [s]."""
    return quantity(
        "s", f"time in which {what} rises and falls", default=default, min=1e-4, max=1e4, usual=(1e-4, 60.0)
    )


def _spell(usual: float, other_value: float, begin: float, edge: float, duration: float) -> Profile:
    """An input that has another value for a while, with both changes in the time `edge` [s]."""
    return Profile(usual, ((begin, edge, other_value), (begin + duration, edge, usual)))


class _Pulses(Event):
    """An event in which an input rises for a while, once or several times."""

    role = Role.SHOCK

    def _height(self, usual: float) -> Any:
        """The rise of the input over its `usual` value."""
        raise NotImplementedError

    def _begins(self, begin: float) -> list[float]:
        return [begin]

    def signals(self, normal: Values, begin: float, state: Values) -> Signals:
        """The pulses, added to the input of normal running."""
        (name,) = self.inputs
        return {name: self._pulses(begin, normal[name], normal[name] + self._height(normal[name]))}

    def _pulses(self, begin: float, usual: float, height: float) -> Profile:
        """The pulses of the event, from a `usual` value to the `height` and back."""
        p, changes = self.p, list[tuple[float, float, float]]()
        for pulse in self._begins(begin):
            changes += _spell(usual, height, pulse, p.rise, p.rise + p.duration).changes
        return Profile(usual, tuple(changes))


class Jam(_Pulses):
    """A lump jams an organ."""

    kind, run = "jam", "jam_{side}"
    words, heading = "a lump jams the {side} side", "jam {side}"
    acts_on = ("{side}.processing_force",)
    draws: ClassVar[Mapping[str, tuple[float, float]]] = {"force": (1000.0, 3000.0)}

    @declaration
    class Parameters(Timing):
        """Quantities of a lump."""

        force: Value = quantity("N", "processing force of the lump", default=2000.0, min=0.0)
        duration: Value = _duration("time for which the lump holds", 0.3)
        rise: Value = _rise("the force", 0.02)
        across: Value = place("the lump")

    def _height(self, usual: float) -> Any:
        return self.p.force

    def fault(self, normal: Values) -> str:
        """A place across the width needs a machine with a width."""
        if not self.p.across or f"{self.side}.force_across" in normal:
            return ""
        return f"across = {self.p.across:g}: {NO_WIDTH}"

    def signals(self, normal: Values, begin: float, state: Values) -> Signals:
        """The pulses of the force, and for a machine with a width those of its place: while the lump adds its force
        to that of normal running, the place is the middle of both."""
        signals, place_name = super().signals(normal, begin, state), f"{self.side}.force_across"
        if place_name in normal:
            usual_force, usual_place = normal[self.inputs[0]], normal[place_name]
            middle = middle_of((usual_force, usual_place), (self.p.force, self.p.across))
            signals[place_name] = self._pulses(begin, usual_place, middle)
        return signals


class Lumps(Jam):
    """Lumps come one after the other."""

    kind, run = "lumps", "lumps_{side}"
    words, heading = "lumps come one after the other on the {side}", "lumps {side}"

    @declaration
    class Parameters(Jam.Parameters):
        """Quantities of the lumps, which are all alike."""

        number: Value = whole_number("number of lumps", default=4, min=1, max=1000)
        pause: Value = _duration("time between two lumps", 0.4, least=1e-3)

    def _begins(self, begin: float) -> list[float]:
        period = 2.0 * self.p.rise + self.p.duration + self.p.pause
        return [begin + k * period for k in range(int(self.p.number))]


@declaration
class FeedShift:
    """How fast material moves."""

    shift: Value = _duration("time in which material leaves or changes sides", 0.3)


@declaration
class FeedShare:
    """How much of the feed is on one side."""

    share: Value = quantity(
        "1", "part of the other side's feed that the side has to carry, too", default=1.0, min=0.0, max=1.0
    )


class Empties(Event):
    """One side empties; the other goes on."""

    kind, run = "empties", "{side}_empties"
    words, heading = "the {side} side empties", "{side} empties"
    role = Role.DUTY
    acts_on = tuple(f"{{side}}.{load}" for load in PLACES)

    @declaration
    class Parameters(Timing, FeedShift):
        """Quantities of the side that empties."""

    @property
    def loaded_side(self) -> AnySide:
        """The opposite side."""
        return other(self.side) if self.side else ""

    @property
    def empties(self) -> bool:
        """True: the side of the event carries no material."""
        return True

    def signals(self, normal: Values, begin: float, state: Values) -> Signals:
        """The material and the processing force of the side fall to zero."""
        return {name: Profile(normal[name], ((begin, self.p.shift, 0.0),)) for name in self.inputs}


class OneSidedFeed(Event):
    """All feed moves to one side."""

    kind, run = "feed", "feed_{side}"
    words, heading = "all feed moves to the {side}", "feed to {side}"
    role = Role.DUTY
    acts_on = tuple(f"{{{side}}}.{load}" for side in ("side", "other") for load in PLACES)

    @declaration
    class Parameters(Timing, FeedShift, FeedShare):
        """Quantities of the feed that moves."""

    @property
    def empties(self) -> bool:
        """Whether all feed of the opposite side moves, so that the opposite side is empty."""
        return bool(self.p.share == 1.0)

    def ends(self, normal: Mapping[str, float]) -> dict[str, float]:
        """The inputs of both sides after a share of each load has moved to the side of the event; on a machine with a
        width, the load there lies in the middle of both."""
        ends, share, opposite = {}, self.p.share, filled("{other}", self.side)
        for load, place_name in PLACES.items():
            load_here, load_there = f"{self.side}.{load}", f"{opposite}.{load}"
            place_here, place_there = f"{self.side}.{place_name}", f"{opposite}.{place_name}"
            moved = share * normal[load_there]
            ends[load_there] = (1.0 - share) * normal[load_there]
            ends[load_here] = normal[load_here] + moved
            if place_here in normal:
                present = normal[load_here], normal[place_here]
                ends[place_here] = middle_of(present, (moved, normal[place_there]))
        return ends

    def signals(self, normal: Values, begin: float, state: Values) -> Signals:
        """Material and processing force leave one side for the other, at the same time."""
        return {
            name: Profile(normal[name], ((begin, self.p.shift, end),))
            for name, end in self.ends(normal).items()
        }


def one_sided_event(events: Mapping[str, Event], side: SideName) -> Event:
    """The event of all feed on that side: the one among the `events` of a study, else that of the example."""
    matches = (
        event
        for event in events.values()
        if (event.kind, event.side) == (OneSidedFeed.kind, side) and event.empties
    )
    return next(matches, OneSidedFeed.on(side))


class LoadedStart(OneSidedFeed):
    """A start with all feed on one side."""

    kind, run = "start", "start_loaded_{side}"
    words, heading = "start with all feed on the {side}", "{side} start"
    from_rest = True

    @declaration
    class Parameters(FeedShare):
        """Quantities of the feed in the start. The start begins at rest and is followed as long as the start-up."""

    def signals(self, normal: Values, begin: float, state: Values) -> Signals:
        """The feed on one side from rest on."""
        return dict(self.ends(normal))

    def time_followed(self, turn: float) -> float:
        """As long as the start-up."""
        return 0.0


class Blocked(Event):
    """A stop holds the rocker where it stands."""

    kind, run = "blocked", "blocked"
    words, heading = "the rocker is blocked", "blocked"
    role, has_side = Role.SHOCK, False
    acts_on = ("stop.stiffness", "stop.damping", "stop.psi")
    reads = ("rocker.psi",)

    @declaration
    class Parameters(Timing):
        """Quantities of the stop."""

        stiffness: Value = quantity(
            "N.m/rad", "stiffness of the stop that blocks the rocker", default=2e5, above=0.0, max=1e9
        )
        damping: Value = quantity(
            "N.m.s/rad", "damping of the stop that blocks the rocker", default=2e3, min=0.0, max=1e9
        )

    def signals(self, normal: Values, begin: float, state: Values) -> Signals:
        """The stop, at the angle at which the rocker stands."""
        return {
            "stop.stiffness": self.p.stiffness,
            "stop.damping": self.p.damping,
            "stop.psi": state["rocker.psi"],
        }

    def variants(self) -> tuple[Event, ...]:
        """Stops over a decade of stiffness. The damping is proportional to the root of the stiffness, so that
        the damping ratio stays the same."""
        p = self.p
        return tuple(
            replace(self, p=replace(p, stiffness=factor * p.stiffness, damping=math.sqrt(factor) * p.damping))
            for factor in (1.0 / math.sqrt(10.0), math.sqrt(10.0))
        )

    def assumption(self, peaks: Mapping[str, tuple[float, float]]) -> str:
        """A sentence on how much the stiffness changes the peak of the crank torque, and on how to estimate
        the stiffness."""
        low, high = peaks["crank_torque"]
        decides = "but hardly change the peak here" if high < _FLAT * low else "and decide the peak"
        soft, stiff = (number(variant.p.stiffness, "N.m/rad", "assumed") for variant in self.variants())
        return (
            f"the stop's stiffness and damping are assumed {decides}, {number(low, 'N.m')} to {number(high, 'N.m')} "
            f"of crank torque for {soft} to {stiff}, damping with the root of it. For the stiffness of the event "
            "take that of the jammed part (N/m) times the square of its distance from the pivot C (m); it is now "
            f"{number(self.p.stiffness, 'N.m/rad')}, and its damping, now {number(self.p.damping, 'N.m.s/rad')}."
        )


_FLAT = 1.05
"""Ratio of the largest to the least peak over a decade of stiffness, up to which the stop hardly matters."""


class Dip(Event):
    """The voltage of the supply dips."""

    kind, run = "dip", "dip"
    words, heading = "the voltage dips", "dip"
    role, has_side = Role.DISTURBANCE, False
    acts_on = ("voltage",)

    @declaration
    class Parameters(Timing):
        """Quantities of the dip."""

        depth: Value = quantity(
            "1", "share of the voltage that the dip takes away", default=0.5, min=0.0, max=1.0
        )
        duration: Value = _duration("time for which the voltage is down", 0.3, least=1e-3)

    @property
    def without(self) -> str:
        """See `Event`: a DC motor has its own supply."""
        return "this motor's drive has no line voltage of its own"

    def signals(self, normal: Values, begin: float, state: Values) -> Signals:
        """The voltage falls and comes back within a millisecond."""
        whole, p = normal["voltage"], self.p
        return {"voltage": _spell(whole, (1.0 - p.depth) * whole, begin, 1e-3, p.duration)}


class Interruption(Event):
    """The contactor of the motor opens, and closes on the field that remains."""

    kind, run = "interruption", "interruption"
    words, heading = "the motor is cut off and reclosed", "interruption"
    role, has_side = Role.DISTURBANCE, False
    acts_on, on_line = ("contactor",), True

    @declaration
    class Parameters(Timing):
        """Quantities of the interruption."""

        duration: Value = _duration(
            "time for which the contactor is open; at its end it closes on the field of the motor",
            0.1,
            CONTACTOR_EDGE,
            5e-3,
        )

    @property
    def without(self) -> str:
        """See `Event`: a DC motor has its own supply, and an inverter limits its current and finds the speed of the
        motor before it switches on."""
        return "this motor's drive has no contactor on the line"

    def signals(self, normal: Values, begin: float, state: Values) -> Signals:
        """The contactor opens and closes."""
        return {"contactor": _spell(normal["contactor"], 0.0, begin, CONTACTOR_EDGE, self.p.duration)}


class HardCut(Event):
    """The blade meets a harder stack, or a hard object in it."""

    kind, run = "cut", "hard_cut"
    words, heading = "the blade meets a hard stack", "hard cut"
    role, has_side = Role.SHOCK, False
    acts_on = ("cut_force",)
    draws: ClassVar[Mapping[str, tuple[float, float]]] = {"force": (3e4, 1e5)}

    @declaration
    class Parameters(Timing):
        """Quantities of the hard stack."""

        force: Value = quantity("N", "resistance of the hard stack to the blade", default=6e4, min=0.0)
        duration: Value = quantity(
            "s", "time for which the stack is hard", default=1.5, min=1e-3, max=1e4, usual=(1e-2, 600.0)
        )

    def signals(self, normal: Values, begin: float, state: Values) -> Signals:
        """The resistance of the hard stack in place of the usual resistance; it changes within 10 ms."""
        return {"cut_force": _spell(normal["cut_force"], self.p.force, begin, 1e-2, self.p.duration)}


class Overload(_Pulses):
    """The material brakes the machine more than usual."""

    kind, run = "overload", "overload"
    words, heading = "the load of the machine rises", "overload"
    has_side = False
    acts_on = ("load",)
    draws: ClassVar[Mapping[str, tuple[float, float]]] = {"torque": (500.0, 2000.0)}

    @declaration
    class Parameters(Timing):
        """Quantities of the load."""

        torque: Value = quantity(
            "N.m", "torque of the material beside that of normal running", default=500.0, min=0.0
        )
        duration: Value = _duration("time for which it lasts", 0.5)
        rise: Value = _rise("it", 0.005)

    def _height(self, usual: float) -> Any:
        return self.p.torque


class Surge(_Pulses):
    """An input of the machine, which the key ``input`` names, rises to a multiple for a while."""

    kind, run = "surge", "surge_{input}"
    words, heading = "{input} rises", "surge of {input}"
    has_side, has_input = False, True
    acts_on = ("{input}",)
    draws: ClassVar[Mapping[str, tuple[float, float]]] = {"factor": (1.5, 4.0)}

    @declaration
    class Parameters(Timing):
        """Quantities of the surge."""

        factor: Value = quantity("1", "input over that of normal running", default=2.0, min=0.0, max=1e4)
        duration: Value = _duration("time for which it lasts", 0.5)
        rise: Value = _rise("it", 0.02)

    def fault(self, normal: Values) -> str:
        """Why the event cannot act on the input; empty where it can."""
        name = self.input
        if normal[name]:
            return ""
        return f"{name} is 0 in normal running, and so is its multiple; give feed.{name}"

    def _height(self, usual: float) -> Any:
        return (self.p.factor - 1.0) * usual
