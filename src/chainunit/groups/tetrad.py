"""The tetrad (class IV Assur group, order 2): two plates, each on an outer joint, with two legs between them.

A plate turns about a pin that moves in a known way, or slides along a rail: its angle, or its way, is a coordinate of
the group. The legs go from the first plate to the second one, as those of a triad go from the links before it to the
ternary link: with two pins, or with a pin and a slot in either plate. Each leg gives a row: what its wrench does along
both coordinates. Their determinant vanishes if the lines of the legs meet on the line of the outer pins.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from ..core.planar import ZERO, Link, Motion, Vec2
from .body import Bar
from .followed import FollowedGroup, SolvedOnLegs, count_derived, lengths_of, size_of
from .joints import Guide, GuideData, Hinge, HingeData, JointData, LinkageInMotion, Rail
from .legs import PLATE, Leg, LegAt


class Plate(NamedTuple):
    """A plate as data: its bar, which starts from the pin of its outer joint, and the places of its own `pins` [m]. One
    that slides on a `rail` has a frame with the direction of the rail, which starts at the point that goes along it;
    `guide` is the pin at which the force of the rail acts on it."""

    bar: Bar
    pins: Mapping[str, Vec2]
    rail: Rail | None = None
    guide: str = ""

    @property
    def joint(self) -> JointData:
        """Its outer joint."""
        if self.rail is None:
            return HingeData(self.bar.pin, self.bar.name)
        return GuideData(self.guide, self.bar.name, self.rail)

    def at_position(self, linkage: LinkageInMotion) -> Motion | Link:
        """Its outer pin, or its rail, with the linkage `linkage` before it."""
        return linkage.pins[self.bar.pin] if self.rail is None else self.rail.at_position(linkage.links)


class PlateAt(NamedTuple):
    """A plate at one coordinate: its origin and the direction of its x axis, the pin or the rail that `holds` it, and
    its coordinate."""

    origin: Vec2
    u: Vec2
    holds: Motion | Link
    x: Any

    @classmethod
    def of(cls, xp: Any, holds: Motion | Link, x: Any) -> PlateAt:
        """The plate at the coordinate `x`."""
        if isinstance(holds, Motion):
            return cls(holds.p, Vec2(xp.cos(x), xp.sin(x)), holds, x)
        return cls(holds.pin.p + holds.u * x, holds.u, holds, x)

    def along(self, force: Vec2, moment: Any) -> Any:
        """What a wrench about its origin does along its coordinate."""
        return moment if isinstance(self.holds, Motion) else force.dot(self.u)

    def joint(self, number: int) -> tuple[tuple[Vec2 | Motion, Vec2], Hinge | Guide]:
        """As the link of this `number`, its pose and its outer joint."""
        if isinstance(self.holds, Motion):
            return (self.holds, self.u), Hinge(number, base=self.holds)
        return (self.origin, self.u), Guide(number, self.u, self.x, self.u * self.x, self.holds)


class _FirstPlate(NamedTuple):
    """The first plate and its pins, as the linkage from which the legs go."""

    pins: Mapping[str, Motion]
    links: Mapping[str, Link]


@dataclass
class Tetrad(FollowedGroup):
    """A tetrad as data: its plates, its legs from the first plate to the second one, and coordinates of the plates
    near those of its assembly mode, see `FollowedGroup`."""

    kind: ClassVar[str] = "tetrad"
    derived_count: ClassVar[int] = count_derived(2)

    plates: tuple[Plate, Plate]
    legs: tuple[Leg, Leg]
    assembly: tuple[Any, Any]
    start: float = 0.0
    turns: Sequence[float] = ()

    @property
    def name(self) -> str:  # type: ignore[override]
        """The name of its first plate."""
        return self.plates[0].bar.name

    @property
    def bars(self) -> tuple[Bar, ...]:
        """Its links, the plates last."""
        return *(leg.bar for leg in self.legs), *(plate.bar for plate in self.plates)

    @property
    def joints(self) -> tuple[JointData, ...]:
        first, second = self.plates
        outer, inner = zip(*(leg.joints(second.bar.name) for leg in self.legs), strict=True)
        between = (joint._replace(by=first.bar.name) for joint in outer)
        return first.joint, second.joint, *between, *inner

    def at_position(self, linkage: LinkageInMotion) -> tuple[Motion | Link, ...]:
        """What holds the plates."""
        return tuple(plate.at_position(linkage) for plate in self.plates)

    def legs_at(self, xp: Any, placed: Sequence[Motion | Link], x: Sequence[Any]) -> list[LegAt]:
        """See `FollowedGroup`."""
        return self._legs(*(PlateAt.of(xp, holds, place) for holds, place in zip(placed, x, strict=True)))

    def _legs(self, first: PlateAt, second: PlateAt) -> list[LegAt]:
        """The legs between the plates, with their rows."""
        data, link, legs = self.plates[0], Link(Motion(first.origin), first.u, 0.0, 0.0), []
        pins = {name: link.beside(arm.x, arm.y) for name, arm in data.pins.items()}
        for k, leg in enumerate(self.legs):
            placed = leg.at_position(k, _FirstPlate(pins, {data.bar.name: link}))(second.origin, second.u)
            x, y, moment = placed.row
            force = Vec2(x, y)
            on_first = first.along(force, moment + (second.origin - first.origin).cross(force))
            legs.append(
                placed.between(first.origin, PLATE - 1, (-on_first, second.along(force, moment)))
            )
        return legs

    def solved(self, xp: Any, placed: Sequence[Motion | Link], x: Sequence[Any]) -> SolvedTetrad:
        """See `FollowedGroup`."""
        first, second = (PlateAt.of(xp, holds, place) for holds, place in zip(placed, x, strict=True))
        return SolvedTetrad(xp, (first, second), self._legs(first, second))


class SolvedTetrad(SolvedOnLegs):
    """A solved tetrad with its `legs`. Its `links` are the legs and then the plates; its `margin` is the determinant
    over the lengths of the rods and the sizes of the plates that turn: 0 is a dead position."""

    __slots__ = ()

    def __init__(self, xp: Any, plates: tuple[PlateAt, PlateAt], legs: Sequence[LegAt]) -> None:
        """
        Parameters
        ----------
        xp : engine (see `chainunit.core.engines`)
        """
        self.legs = legs
        first, second = plates
        size = lengths_of(legs, 1.0)
        for plate, spots in (
            (first, [start - first.origin for start, _ in (leg.pose for leg in legs)]),
            (second, [leg.spot for leg in legs]),
        ):
            if isinstance(plate.holds, Motion):
                size = size * size_of(xp, [ZERO, *spots])
        held = [plate.joint(PLATE - 1 + k) for k, plate in enumerate(plates)]
        joints = (
            *(joint for _, joint in held),
            *(leg.outer for leg in legs),
            *(leg.inner for leg in legs),
        )
        super().__init__((*(leg.pose for leg in legs), *(pose for pose, _ in held)), joints, size=size)
