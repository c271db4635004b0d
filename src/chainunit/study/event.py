"""The base class of events: an event happens to a machine in steady running or in its start.

A type of event is a subclass of `Event`; the types of the package are in `events`. A type declares its
quantities, names the inputs that it acts on, gives their values over time, and says how long the machine is
followed. Every subclass, in whatever module, is a type that study files may name. An input has the name that
it has in the machine or the motor (``left.processing_force``, ``voltage``); a study leaves out an event whose
inputs its system does not have.
"""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, ClassVar, Literal, TypeAlias

from ..core.quantities import Value, declaration, quantity
from ..machines.chain_unit import SIDES, SideName, other
from ..system.signals import Profile, corners

OverTime: TypeAlias = float | Profile
"""Value of an input, or its values over time."""
Values: TypeAlias = Mapping[str, float]
"""Values of inputs or outputs by name."""
Signals: TypeAlias = dict[str, OverTime]
"""Values of inputs, over time, by name."""
AnySide: TypeAlias = SideName | Literal[""]
"""A side; empty for none."""


class Role(StrEnum):
    """The meaning of an event for a torque limiter."""

    DUTY = "duty"
    """the event may last, or comes with every start: a coupling has to carry its torque"""
    SHOCK = "shock"
    """the event is one that a coupling should open in"""
    DISTURBANCE = "disturbance"
    """the event passes by itself: a coupling should stay shut in it"""


LONGEST_USUAL = 36
"""Letters of the usual name of a run."""
TYPES: dict[str, type[Event]] = {}
"""The types of events, by the names that a study file uses."""


@declaration
class Timing:
    """When an event begins, and for how long the machine is followed."""

    crank_angle: Value = quantity("rad", "{driver} angle at which the event begins", default=0.0)
    turns: Value = quantity(
        "1",
        "{driver} turns that are followed after the event begins; a turn after its last change at least",
        default=2.0,
        min=1.0,
        max=1e4,
    )


@dataclass(frozen=True)
class Event:
    """An event with its quantities `p`, which is followed by the run `name`; `side` is empty for an event
    without a side.

    In the texts of a type ``{side}`` stands for that side, ``{other}`` for the opposite side, and ``{input}`` for the
    input that the study file names.
    """

    kind: ClassVar[str] = ""
    """name of the type in a study file"""
    run: ClassVar[str] = ""
    """name of the run, if the study file gives none"""
    words: ClassVar[str] = ""
    """the event as a clause of a sentence"""
    heading: ClassVar[str] = ""
    """the event in two or three words"""
    role: ClassVar[Role]
    has_side: ClassVar[bool] = True
    from_rest: ClassVar[bool] = False
    """whether the event is a start, with signals from rest on"""
    acts_on: ClassVar[tuple[str, ...]] = ()
    """inputs that the event changes"""
    on_line: ClassVar[bool] = False
    """whether the event is one of a motor on the line, not of one on an inverter"""
    reads: ClassVar[tuple[str, ...]] = ()
    """outputs whose values at the begin of the event set its signals; these are then single numbers, and the
    inputs jump to them"""
    draws: ClassVar[Mapping[str, tuple[float, float]]] = {}
    """range of each quantity that random overloads draw, if the study file gives none: from, to"""
    has_input: ClassVar[bool] = False
    """whether the study file names the input that the event changes"""
    Parameters: ClassVar[type] = Timing

    name: str
    side: AnySide
    p: Any
    input: str = ""
    """the input that the study file names"""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "kind" in vars(cls):
            TYPES[cls.kind] = cls

    @classmethod
    def on(cls, side: AnySide = "", p: Any = None, name: str = "", input_name: str = "") -> Event:
        """The event on that side, with the quantities `p` or, without them, the default quantities."""
        p = cls.Parameters() if p is None else p
        return cls(name or cls.usual_name(side, input_name), side, p, input_name)

    @classmethod
    def usual_name(cls, side: AnySide, input_name: str = "") -> str:
        """The name of the run, if the study file gives none."""
        return filled(cls.run, side, re.sub(r"[^a-z0-9]+", "_", input_name.lower()))[:LONGEST_USUAL]

    @property
    def inputs(self) -> tuple[str, ...]:
        """The inputs that the event changes."""
        return tuple(filled(name, self.side, self.input) for name in self.acts_on)

    def fault(self, normal: Values) -> str:
        """The reason, in words, why the event changes nothing with these `normal` values; empty where it does."""
        return ""

    @property
    def _mark(self) -> str:
        """The name of the run, where side and type alone do not distinguish the event from others; else
        empty."""
        usual = self.usual_name(self.side, self.input)
        return "" if self.name == usual else self.name.removeprefix(f"{usual}_").replace("_", " ")

    @property
    def title(self) -> str:
        """The event as a clause of a sentence."""
        return filled(self.words, self.side, self.input) + (f" ({self._mark})" if self._mark else "")

    @property
    def short(self) -> str:
        """The event as the heading of a narrow column."""
        return " ".join(filter(None, (filled(self.heading, self.side, self.input), self._mark)))

    @property
    def loaded_side(self) -> AnySide:
        """The side that has to carry the load of the event; empty where both have to."""
        return self.side

    @property
    def empties(self) -> bool:
        """Whether an organ carries no material during the event."""
        return False

    @property
    def without(self) -> str:
        """The reason, in words, why a system without the inputs of the event leaves the event out."""
        return f"the system has no {' or '.join(self.inputs)}"

    def signals(self, normal: Values, begin: float, state: Values) -> Signals:
        """Values of the inputs that the event changes, from its `begin` [s] on.

        `normal` has the values of all inputs in steady running, `state` the values of the outputs `reads` at the
        begin.
        """
        raise NotImplementedError

    def time_followed(self, turn: float) -> float:
        """Time for which the machine is followed from the begin of the event on [s]: the requested turns, and
        at least one turn after the last change. A turn of the crank takes `turn` [s]."""
        # a little longer than requested, so that a dip in speed does not cost a whole turn
        return float(max((self.p.turns + 0.1) * turn, self.lasts + turn))

    @property
    def lasts(self) -> float:
        """Time from the begin of the event to the last change of its signals [s]."""
        signals = self.signals(defaultdict(float), 0.0, defaultdict(float))
        return max([0.0, *corners(signals.values())])

    @property
    def passes(self) -> bool:
        """Whether all its signals return to their values before it."""
        signals = self.signals(defaultdict(float), 0.0, defaultdict(float)).values()
        return all(isinstance(x, Profile) and x(self.lasts) == x.start for x in signals)

    def variants(self) -> tuple[Event, ...]:
        """The same event with its assumed quantity at either end of the range; empty for an event without
        assumptions."""
        return ()

    def assumption(self, peaks: Mapping[str, tuple[float, float]]) -> str:
        """A sentence on the effect of the assumption, from the range of each peak over the variants [N m]."""
        return ""


def angle_of_begin(event: Event, angle: float) -> float:
    """The crank angle [rad] at which the event begins, counted on from the present `angle` [rad], at least an eighth
    of a turn ahead."""
    ahead = (getattr(event.p, "crank_angle", 0.0) - angle) % (2.0 * math.pi)
    return float(angle + ahead + (2.0 * math.pi if ahead < 0.25 * math.pi else 0.0))


def filled(text: str, side: AnySide, input_name: str = "") -> str:
    """The text with this side, the opposite side and this input in place of ``{side}``, ``{other}``, ``{input}``."""
    return text.format(side=side, other=other(side) if side else "", input=input_name)


def in_groups(events: Mapping[str, Event], names: Collection[str]) -> list[list[str]]:
    """The events among `names` in groups: events that the left side has to carry, the right side, both;
    without empty groups."""
    groups = [
        [name for name, event in events.items() if name in names and event.loaded_side == side]
        for side in (*SIDES, "")
    ]
    return [group for group in groups if group]
