"""The tetrad (class IV Assur group, order 2): two plates, each on an outer joint, with two legs between them.

A plate turns about a pin that moves in a known way, or slides along a rail: its angle, or its way, is a coordinate of
the group. The legs go from the first plate to the second one, as those of a triad go from the links before it to the
ternary link: with two pins, or with a pin and a slot in either plate. Each leg gives a row: what its wrench does
along both coordinates. Their determinant vanishes if the lines of the legs meet on the line of the outer pins.

A plate may also stand on more legs than it has coordinates: on two or more while a pin or a rail holds it, on four or
more alone. It moves as one of rigid links, as each leg fits all the way. Its legs share the force with the least
strain energy (Menabrea), each with one spring: of a rod along it, in its pin with the plate, of a block across its
guide.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple

from ..core.planar import ZERO, Link, Motion, Vec2
from .body import Bar
from .followed import USUAL, FollowedGroup, SolvedOnLegs, Tracking
from .joints import Guide, GuideData, Hinge, HingeData, Joint, JointData, LinkageInMotion, Rail, Slide
from .legs import PLATE, Leg, LegAt, PlacedLeg


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


class PlateAt(NamedTuple):
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


def plates_at(
    xp: Any, placed: Sequence[Motion | Link], x: Sequence[Any], number: int = PLATE - 1
) -> Iterator[PlateAt]:
    """The plates at the coordinates `x`, from the pin or the rail that holds each of them; `number` is that of the
    first one in the group."""
    for k, (base, place) in enumerate(zip(placed, x, strict=True), number):
        if isinstance(base, Motion):
            u = Vec2(xp.cos(place), xp.sin(place))
            yield PlateAt(base.p, u, True, (base, u), Hinge(k, base=base))
        else:
            d, way = base.u, base.u * place
            origin = base.pin.p + way
            yield PlateAt(origin, d, False, (origin, d), Guide(k, d, place, way, base))


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

    name: str
    plates: tuple[Plate, Plate]
    legs: tuple[Leg, Leg]
    assembly: tuple[Any, Any]
    start: float = 0.0
    tracking: Tracking = USUAL
    span: Sequence[float] = ()

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
        return self._legs(*plates_at(xp, placed, x))

    def _legs(self, first: PlateAt, second: PlateAt) -> list[LegAt]:
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
        first, second = plates = [*plates_at(xp, placed, x)]
        legs = self._legs(first, second)
        starts = [start for start, _ in (leg.pose for leg in legs) if isinstance(start, Vec2)]
        ends = [start - first.origin for start in starts], [leg.spot for leg in legs]
        spots = [[ZERO, *end] for plate, end in zip(plates, ends, strict=True) if plate.turns]
        held = [plate.joint for plate in plates]
        return SolvedOnLegs(xp, legs, spots, [plate.pose for plate in plates], held)


class _Placed(NamedTuple):
    """The legs for any pose of the plate, and the pin or the rail that holds this, if one does."""

    legs: Sequence[PlacedLeg]
    base: Motion | Link | None


@dataclass
class SharedPlate(FollowedGroup):
    """A plate on legs as data: what holds it besides (`held`), its bar, the legs with the `stiffness` of each [N/m],
    and coordinates near those of its assembly mode, see `FollowedGroup`: its angle or its way, or its pose."""

    kind: ClassVar[str] = "shared plate"
    shares: ClassVar[bool] = True

    name: str
    held: Plate | None
    plate: Bar
    legs: Sequence[Leg]
    stiffness: Sequence[Any]
    assembly: Sequence[Any]
    start: float = 0.0
    tracking: Tracking = USUAL
    span: Sequence[float] = ()

    @property
    def bars(self) -> tuple[Bar, ...]:
        """Its links, the plate last."""
        return *(leg.bar for leg in self.legs), self.plate

    @property
    def joints(self) -> tuple[JointData, ...]:
        outer, inner = zip(*(leg.joints(self.name) for leg in self.legs), strict=True)
        return *([self.held.joint] if self.held else []), *outer, *inner

    def at_position(self, linkage: LinkageInMotion) -> _Placed:
        """See `FollowedGroup`."""
        legs = [leg.at_position(k, linkage) for k, leg in enumerate(self.legs)]
        return _Placed(legs, self.held and self.held.at_position(linkage))

    def _at(self, xp: Any, placed: _Placed, x: Sequence[Any]) -> tuple[PlateAt | None, Vec2, list[LegAt]]:
        """The plate at its coordinate, if it is held, its direction, and its legs."""
        count, plate, legs = len(self.legs), None, []
        if placed.base is None:
            origin, u = Vec2(x[0], x[1]), Vec2(xp.cos(x[2]), xp.sin(x[2]))
        else:
            plate = next(plates_at(xp, [placed.base], x, count))
            origin, u = plate.origin, plate.u
        for leg, stiffness in zip(placed.legs, self.stiffness, strict=True):
            here = leg(origin, u, count)
            (fx, fy, moment), (start, _) = here.row, here.pose
            row = here.row if plate is None else [plate.along(Vec2(fx, fy), moment)]
            # a slot goes on to the pin of its block
            spot = start.p - origin if here.length is None and isinstance(start, Motion) else here.spot
            legs.append(here._replace(row=row, spot=spot, stiffness=stiffness))
        return plate, u, legs

    def legs_at(self, xp: Any, placed: _Placed, x: Sequence[Any]) -> list[LegAt]:
        """See `FollowedGroup`."""
        return self._at(xp, placed, x)[2]

    def solved(self, xp: Any, placed: _Placed, x: Sequence[Any]) -> SolvedOnLegs:
        """See `FollowedGroup`."""
        plate, u, legs = self._at(xp, placed, x)
        spots = [leg.spot for leg in legs]
        if plate is None:
            return SolvedOnLegs(xp, legs, [spots], [(Vec2(x[0], x[1]), u)])
        return SolvedOnLegs(xp, legs, [[ZERO, *spots]] if plate.turns else [], [plate.pose], [plate.joint])
