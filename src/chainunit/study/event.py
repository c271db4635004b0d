"""An event of a study: what happens to a machine that runs steadily, or in its start.

A type of event is a subclass of `Event`; those of the package are in `events`. It declares its quantities, names the
inputs that it acts on, gives their values over time, and says how long it is followed. A class of that kind anywhere
is a type that study files may name. Inputs are called as the machine or the motor that has them calls them
(``left.processing_force``, ``voltage``); a study leaves out an event whose inputs its system does not have.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, ClassVar, Literal, TypeAlias

from ..machines.chain_unit import SIDES, SideName, other
from ..quantities import Value, declaration, quantity
from ..system.signals import Profile, corners

OverTime: TypeAlias = float | Profile
"""Value of an input, or its values over time."""
Values: TypeAlias = Mapping[str, float]
"""Values of inputs or outputs by name."""
Signals: TypeAlias = dict[str, OverTime]
"""Values of inputs, over time, by name."""
AnySide: TypeAlias = SideName | Literal[""]
"""A side, or none."""


class Role(StrEnum):
    """What an event is to a safety coupling."""

    DUTY = "duty"
    """it may last, or comes with every start: a coupling has to carry it"""
    SHOCK = "shock"
    """a coupling is there to open in it"""
    DISTURBANCE = "disturbance"
    """it passes, and a coupling has to ride it out"""


TYPES: dict[str, type[Event]] = {}
"""The types of events, by the names that a study file uses."""


@declaration
class Timing:
    """When an event begins, and for how long the machine is followed."""

    crank_angle: Value = quantity(
        "rad",
        "crank angle at which the event begins; the rocker of a chain unit is at its fastest at 0, to the right, "
        "and near 180 deg, to the left",
        default=0.0,
        usual=(0.0, 6.3),
    )
    turns: Value = quantity(
        "1",
        "crank turns that are followed after the event begins; a turn after its last change at least",
        default=2.0,
        min=1.0,
        max=1e4,
    )


@dataclass(frozen=True)
class Event:
    """An event with its quantities `p`, as the run `name` follows it; `side` is empty where it has none.

    In the texts of a type ``{side}`` stands for that side and ``{other}`` for the one across.
    """

    kind: ClassVar[str] = ""
    """its type, as a study file names it"""
    run: ClassVar[str] = ""
    """name of the run, where the study file gives none"""
    words: ClassVar[str] = ""
    """what happens, as in a sentence"""
    heading: ClassVar[str] = ""
    """the same in two or three words"""
    role: ClassVar[Role]
    sided: ClassVar[bool] = True
    from_rest: ClassVar[bool] = False
    """whether it is a start, and has its signals from rest on"""
    acts_on: ClassVar[tuple[str, ...]] = ()
    """inputs that it changes"""
    reads: ClassVar[tuple[str, ...]] = ()
    """outputs whose values at its begin decide its signals, which are numbers then: they jump"""
    draws: ClassVar[Mapping[str, tuple[float, float]]] = {}
    """quantities that random overloads draw, where the study file says nothing: from where to where"""
    counts: ClassVar[tuple[str, ...]] = ()
    """quantities that are whole numbers"""
    Parameters: ClassVar[type] = Timing

    name: str
    side: AnySide
    p: Any

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "kind" in vars(cls):
            TYPES[cls.kind] = cls

    @classmethod
    def on(cls, side: AnySide = "", p: Any = None, name: str = "") -> Event:
        """The event on that side, its quantities at their defaults where none are given."""
        return cls(name or on_side(cls.run, side), side, cls.Parameters() if p is None else p)

    @classmethod
    def inputs(cls, side: AnySide) -> tuple[str, ...]:
        """Inputs that it changes on that side."""
        return tuple(on_side(name, side) for name in cls.acts_on)

    @property
    def _mark(self) -> str:
        """The name of the run, where the side and the type alone do not tell it from others."""
        usual = on_side(self.run, self.side)
        return "" if self.name == usual else self.name.removeprefix(f"{usual}_").replace("_", " ")

    @property
    def title(self) -> str:
        """What happens, as in a sentence."""
        return on_side(self.words, self.side) + (f" ({self._mark})" if self._mark else "")

    @property
    def short(self) -> str:
        """The same as a heading of a narrow column."""
        return " ".join(filter(None, (on_side(self.heading, self.side), self._mark)))

    @property
    def loaded_side(self) -> AnySide:
        """The side that has to carry it; none where both do."""
        return self.side

    @property
    def empties(self) -> bool:
        """Whether an organ carries no material in it."""
        return False

    @property
    def without(self) -> str:
        """Why a system without its inputs leaves it out, in words."""
        return f"the system has no {' or '.join(self.inputs(self.side))}"

    def signals(self, normal: Values, at: float, state: Values) -> Signals:
        """Values of the inputs that it changes, from its begin `at` [s] on.

        `normal` are all inputs in steady running, `state` the outputs that it `reads`, at its begin.
        """
        raise NotImplementedError

    def follow(self, turn: float) -> float:
        """Time that is followed from its begin on [s], where a turn of the crank takes `turn` [s]: the turns that are
        asked for, and a turn after the last change at least."""
        # a little more than asked, so that a dip in speed does not cost a whole turn
        return float(max((self.p.turns + 0.1) * turn, self.lasts + turn))

    @property
    def lasts(self) -> float:
        """Time from its begin to the last change of its signals [s]."""
        signals = self.signals(defaultdict(float), 0.0, defaultdict(float))
        return max([0.0, *corners(signals.values())])

    def variants(self) -> tuple[Event, ...]:
        """The same event with what is assumed in it at the ends of its range; none where nothing is."""
        return ()

    def assumption(self, peaks: Mapping[str, tuple[float, float]]) -> str:
        """What the variants say of the assumption, from the range of each peak over them [N m], in words."""
        return ""


def on_side(text: str, side: AnySide) -> str:
    """The text with that side and the other in their places."""
    return text.format(side=side, other=other(side)) if side else text


def in_groups(events: Mapping[str, Event], names: Collection[str]) -> list[list[str]]:
    """The events among `names`: what the left side has to carry, the right side, both; without empty groups."""
    groups = [
        [name for name, event in events.items() if name in names and event.loaded_side == side]
        for side in (*SIDES, "")
    ]
    return [group for group in groups if group]
