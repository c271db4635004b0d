"""The tetrad (class IV Assur group, order 2): two plates, each on an outer joint, with two legs between them.

A plate turns about a pin that moves in a known way, or slides along a rail: its angle, or its way, is a coordinate of
the group. The legs go from the first plate to the second one, as those of a triad go from the links before it to the
ternary link: with two pins, or with a pin and a slot in either plate. Each leg gives a row: what its wrench does
along both coordinates. Their determinant vanishes if the lines of the legs meet on the line of the outer pins.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple

from ..core.planar import ZERO, Link, Motion, Vec2
from .body import Bar
from .followed import TERMS, USUAL, FollowedGroup, SolvedOnLegs, Tracking
from .joints import Guide, GuideData, Hinge, HingeData, Joint, JointData, LinkageInMotion, Rail, Slide
from .legs import PLATE, Leg, LegAt


class Plate(NamedTuple):
    """A plate as data: its bar, its outer joint, and the places of its own `pins` [m]. Its frame starts at the outer
    pin; that of one that slides starts at the point that goes along the rail, and has its direction."""

    bar: Bar
    joint: HingeData | GuideData
    pins: Mapping[str, Vec2]

    def at_position(self, linkage: LinkageInMotion) -> Motion | Link:
        """Its outer pin, or its rail, with the linkage `linkage` before it."""
        rail = self.joint.by
        return rail.at_position(linkage.links) if isinstance(rail, Rail) else linkage.pins[self.joint.pin]


class _PlateAt(NamedTuple):
    """A plate at one coordinate: its origin and the direction of its x axis, whether it turns, and as a link its pose
    and its outer joint."""

    origin: Vec2
    u: Vec2
    turns: bool
    pose: tuple[Vec2 | Motion, Vec2]
    joint: Hinge | Guide

    def along(self, force: Vec2, moment: Any) -> Any:
        """What a wrench about its origin does along its coordinate."""
        return moment if self.turns else force.dot(self.u)


def _plates_at(xp: Any, placed: Sequence[Motion | Link], x: Sequence[Any]) -> Iterator[_PlateAt]:
    """The plates at the coordinates `x`, from the pin or the rail that holds each of them."""
    for number, (base, place) in enumerate(zip(placed, x, strict=True), PLATE - 1):
        if isinstance(base, Motion):
            u = Vec2(xp.cos(place), xp.sin(place))
            yield _PlateAt(base.p, u, True, (base, u), Hinge(number, base=base))
        else:
            d, way = base.u, base.u * place
            origin = base.pin.p + way
            yield _PlateAt(origin, d, False, (origin, d), Guide(number, d, place, way, base))


class _FirstPlate(NamedTuple):
    """The first plate and its pins, as the linkage from which the legs go; it has no slides."""

    pins: Mapping[str, Motion]
    links: Mapping[str, Link]
    slides: Mapping[Joint, Slide] = MappingProxyType({})


@dataclass
class Tetrad(FollowedGroup):
    """A tetrad as data: its plates, its legs from the first plate to the second one, and coordinates of the plates
    near those of its assembly mode, see `FollowedGroup`."""

    kind: ClassVar[str] = "tetrad"
    derived_count: ClassVar[int] = 2 * TERMS + 2

    name: str
    plates: tuple[Plate, Plate]
    legs: tuple[Leg, Leg]
    assembly: tuple[Any, Any]
    start: float = 0.0
    tracking: Tracking = USUAL

    @property
    def bars(self) -> tuple[Bar, ...]:
        """Its links, the plates last."""
        return *(leg.bar for leg in self.legs), *(plate.bar for plate in self.plates)

    @property
    def joints(self) -> tuple[JointData, ...]:
        first, second = self.plates
        near, far = zip(*(leg.joints(second.bar.name) for leg in self.legs), strict=True)
        return first.joint, second.joint, *(joint._replace(by=first.bar.name) for joint in near), *far

    def at_position(self, linkage: LinkageInMotion) -> list[Motion | Link]:
        """What holds the plates."""
        return [plate.at_position(linkage) for plate in self.plates]

    def legs_at(self, xp: Any, placed: Sequence[Motion | Link], x: Sequence[Any]) -> list[LegAt]:
        """See `FollowedGroup`."""
        return self._legs(*_plates_at(xp, placed, x))

    def _legs(self, first: _PlateAt, second: _PlateAt) -> list[LegAt]:
        """The legs between the plates, with their rows."""
        data, link, legs = self.plates[0], Link(Motion(first.origin), first.u, 0.0, 0.0), []
        pins = {name: link.beside(arm.x, arm.y) for name, arm in data.pins.items()}
        for k, leg in enumerate(self.legs):
            placed = leg.at_position(k, _FirstPlate(pins, {data.bar.name: link}))(second.origin, second.u)
            x, y, moment = placed.row
            force = Vec2(x, y)
            on_first = first.along(force, moment + (second.origin - first.origin).cross(force))
            legs.append(placed.between(first.origin, PLATE - 1, (-on_first, second.along(force, moment))))
        return legs

    def solved(self, xp: Any, placed: Sequence[Motion | Link], x: Sequence[Any]) -> SolvedOnLegs:
        """See `FollowedGroup`."""
        first, second = plates = [*_plates_at(xp, placed, x)]
        legs = self._legs(first, second)
        starts = [start for start, _ in (leg.pose for leg in legs) if isinstance(start, Vec2)]
        ends = [start - first.origin for start in starts], [leg.spot for leg in legs]
        spots = [[ZERO, *end] for plate, end in zip(plates, ends, strict=True) if plate.turns]
        held = [plate.joint for plate in plates]
        return SolvedOnLegs(xp, legs, spots, [plate.pose for plate in plates], held)
