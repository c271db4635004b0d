"""The joints of a group: rows of its linear system, and the reactions that follow from their multipliers.

A joint holds a point of a `link` to a point of another link, by a hinge or by a guide. The other link is one of the
same group, `by`, or moves in a known way. The rows say that both points move alike; in a guide the link also slides
along a line of the other one, and both turn alike. For each order of derivative by the coordinate only the right
sides differ. The multipliers of the rows are the components of the reaction.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple, Protocol, Self

from ..core.jets import Jet
from ..core.planar import ZERO, Link, Motion, Vec2, rotated
from .block import Row
from .body import Load

Third = tuple[Vec2, Any]
"""Third derivatives of a link by q: of its pin and of its angle."""
Joint = tuple[str, str]
"""A joint of a linkage by the names of its pin and of the link on which its reaction acts."""
Seat = tuple[int, Vec2]
"""A pin on a link: the number of the link in its group, and the arm from its start."""
TURNS, SLIDES = "turns", "slides"
"""Forms of the relative motion in a joint."""
STEADY: tuple[Any, Any, Any] = (1.0, 0.0, 0.0)
"""Derivatives by q of the place of a driver that has the coordinate q itself."""
UNKNOWNS = 4
"""Number of the unknowns of a link: derivatives of its start along x and y, of its angle, and of its way along the
line on which it starts."""
Rates = Sequence[Sequence[Any]]
"""Derivatives by q of the unknowns of a group, by order from the first one on."""


class Rail(NamedTuple):
    """A straight line in a link, as data: the name of the link, None for the ground; a point `at` of the line [m] and
    its direction `along`, a unit vector, both in the frame of the link."""

    of: str | None
    at: Vec2
    along: Vec2

    def at_position(self, links: Mapping[str, Link]) -> Link:
        """The line at the position of its link, as a link of its own: it starts from the point."""
        if self.of is None:
            return Link(Motion(self.at), self.along, 0.0, 0.0)
        link, along = links[self.of], self.along
        u = link.u * along.x + link.u.turned() * along.y
        return Link(link.beside(self.at.x, self.at.y), u, link.t1, link.t2)


class LinkageInMotion(Protocol):
    """A linkage at one position: its `pins` with points, its `links`, and its `slides`, by name."""

    @property
    def pins(self) -> Mapping[str, Motion]:
        """Motion of each pin and point."""

    @property
    def links(self) -> Mapping[str, Link]:
        """Links by name."""

    @property
    def slides(self) -> Mapping[Joint, Slide]:
        """The motion in each joint that slides."""


class JointData(Protocol):
    """A joint as data."""

    @property
    def pin(self) -> str:
        """The pin at which its reaction counts."""

    @property
    def link(self) -> str:
        """The link on which its reaction acts."""

    @property
    def form(self) -> str:
        """`TURNS` if its links turn about the pin, `SLIDES` if they slide along each other; else another word."""

    def carrier(self, carries: Mapping[str, str]) -> str | None:
        """The link on which the opposite reaction acts, None for the ground, from the links that carry pins."""

    def third_before(
        self, m: LinkageInMotion, links: Mapping[str, Third], pins: Mapping[str, Vec2]
    ) -> Third | None:
        """The third derivatives of its pin or line on a link before the group, from the third derivatives of the
        `links` and `pins`; None if it joins two links of the group."""

    def opposite(self, m: LinkageInMotion, carrier: str, reaction: Vec2) -> Load:
        """What the opposite reaction does to the link `carrier`."""

    def turning(self, m: LinkageInMotion, carrier: str | None, reaction: Vec2) -> Iterator[tuple[str, Load]]:
        """The derivatives by q of the loads of a constant reaction on its links, as arms and lines turn."""


class HingeData(NamedTuple):
    """A hinge as data: its pin, the link on which its reaction acts, and the link of the same group that carries the
    pin; None if a link before the group does. That one is `motor_on` if a motor on it turns the link."""

    pin: str
    link: str
    by: str | None = None
    motor_on: str | None = None

    @property
    def form(self) -> str:
        return TURNS

    def carrier(self, carries: Mapping[str, str]) -> str | None:
        return carries.get(self.pin)

    def third_before(
        self, m: LinkageInMotion, links: Mapping[str, Third], pins: Mapping[str, Vec2]
    ) -> Third | None:
        turn = links[self.motor_on][1] if self.motor_on else 0.0
        return (pins.get(self.pin, ZERO), turn) if self.by is None else None

    def opposite(self, m: LinkageInMotion, carrier: str, reaction: Vec2) -> Load:
        moment = (m.pins[self.pin].p - m.links[carrier].pin.p).cross(reaction)
        if isinstance(reaction, GuideForce):
            moment = moment + reaction.moment
        return -reaction, -moment

    def turning(self, m: LinkageInMotion, carrier: str | None, reaction: Vec2) -> Iterator[tuple[str, Load]]:
        p1, start = m.pins[self.pin].p1, m.links[self.link].pin.p1
        if p1 is not start:
            yield self.link, (ZERO, (p1 - start).cross(reaction))
        if carrier is not None:
            yield carrier, (ZERO, (m.links[carrier].pin.p1 - p1).cross(reaction))


class GuideData(NamedTuple):
    """A sliding joint, or the contact with a cam, as data: the pin at which its reaction counts, the link on which
    this acts, and the other link of the same group, or a line of a link before; of a cam its centre and angle 0."""

    pin: str
    link: str
    by: str | Rail

    @property
    def form(self) -> str:
        return SLIDES

    def carrier(self, carries: Mapping[str, str]) -> str | None:
        return self.by.of if isinstance(self.by, Rail) else self.by

    def third_before(
        self, m: LinkageInMotion, links: Mapping[str, Third], pins: Mapping[str, Vec2]
    ) -> Third | None:
        """Third derivatives by q of the start of the line of a sliding joint in a link before the group, and of its
        angle; those of a line in the ground are 0, and None stands for a line in the group."""
        if not isinstance(self.by, Rail):
            return None
        if self.by.of is None:
            return ZERO, 0.0
        link, third = m.links[self.by.of], links[self.by.of]
        start = self.by.at_position(m.links).pin.p - link.pin.p
        return link.third_derivative(start, *third), third[1]

    def opposite(self, m: LinkageInMotion, carrier: str, reaction: Vec2) -> Load:
        assert isinstance(reaction, GuideForce)
        arm = m.links[self.link].pin.p - m.links[carrier].pin.p
        return -reaction, -(reaction.moment + arm.cross(reaction))

    def turning(self, m: LinkageInMotion, carrier: str | None, reaction: Vec2) -> Iterator[tuple[str, Load]]:
        """See `JointData`: the force is normal to the line, or to the profile, which turns; its lever may grow."""
        link, slide = m.links[self.link], m.slides[self.pin, self.link]
        more, moment = reaction.turned() * slide.turn, reaction.dot(slide.d.turned()) * slide.growth
        yield self.link, (more, moment)
        if carrier is not None:
            other = m.links[carrier]
            arm, arm1 = link.pin.p - other.pin.p, link.pin.p1 - other.pin.p1
            yield carrier, (-more, -(moment + arm1.cross(reaction) + arm.cross(more)))


class Slide(NamedTuple):
    """The motion in a sliding joint: the direction `d` of its line, the way `s` of the link that its reaction acts on
    along it, the derivatives of that by q [m, m/rad, m/rad2], and of the angle of the line. A contact has no way;
    `growth` is the derivative of the lever of `d`, turned by 90 degrees, about the start of the link."""

    d: Vec2
    s: Any
    s1: Any
    s2: Any
    turn: Any
    growth: Any = 0.0


class GuideForce(Vec2):
    """The reaction of a sliding joint on a link: force [N], and its whole `moment` about the start of the link's
    frame [N m]."""

    __slots__ = ("moment",)

    def __init__(self, x: Any, y: Any, moment: Any) -> None:
        super().__init__(x, y)
        self.moment = moment

    def plus(self, other: Vec2, factor: Any) -> GuideForce:
        """The sum with `other`, a reaction of the same joint, times a factor."""
        assert isinstance(other, GuideForce)
        return GuideForce(
            self.x + other.x * factor, self.y + other.y * factor, self.moment + other.moment * factor
        )

    @classmethod
    def along(cls, n: Vec2, force: Any, moment: Any) -> Self:
        """The reaction with a `force` in the direction `n`."""
        return cls(n.x * force, n.y * force, moment)


class Placed:
    """A joint, or a drive, at one position, by the numbers of its links in the group."""

    __slots__ = ()
    stiffness: Any = None
    """of a joint whose last row yields [N/m]"""

    @property
    def seat(self) -> Seat | None:
        """The pin that it adds to the group."""
        return None

    def rows(self) -> list[Row]:
        """Its rows."""
        raise NotImplementedError

    def right(self, rates: Rates, before: Third | None) -> list[Any]:
        """The right sides of its rows for the derivatives after those of `rates`; `before` are the third derivatives
        of the pin or line before the group."""
        raise NotImplementedError

    def force(self, multipliers: Iterator[Any]) -> tuple[Vec2 | None, Any]:
        """The reaction on the link [N], and the effort of a driver [N m, N], from the multipliers of its rows; None
        for what it does not have."""
        raise NotImplementedError

    def slide(self, rates: Rates) -> Slide | None:
        """The motion along its line."""
        return None


class Yielding(Placed):
    """A `joint` of a leg that yields along the unit vector `d` by its `stiffness` [N/m]. Of its two rows of the point
    the first one is across to `d`, over the `size` that the angle of the rod, or the way of the block, has in it; the
    one along `d`, which has no such unknown, comes last."""

    __slots__ = ("_across", "_d", "_joint", "_unknown", "stiffness")

    def __init__(self, joint: Hinge, stiffness: Any, d: Vec2, size: Any = 1.0) -> None:
        self._joint, self._d, self._across, self.stiffness = joint, d, d.turned() * (1.0 / size), stiffness
        self._unknown = UNKNOWNS * joint._link + (3 if isinstance(joint, Guide) else 2)

    @property
    def seat(self) -> Seat | None:
        return self._joint.seat

    def rows(self) -> list[Row]:
        """Its rows."""
        x, y, *rest = self._joint.rows()
        across, along = (
            {j: v.x * x.get(j, 0.0) + v.y * y.get(j, 0.0) for j in {**x, **y}}
            for v in (self._across, self._d)
        )
        across[self._unknown] = 1
        del along[self._unknown]
        return [across, *rest, along]

    def right(self, rates: Rates, before: Third | None) -> list[Any]:
        x, y, *rest = self._joint.right(rates, before)
        e = Vec2(x, y)
        return [self._across.dot(e), *rest, self._d.dot(e)]

    def force(self, multipliers: Iterator[Any]) -> tuple[Vec2 | None, Any]:
        across, *rest, along = (next(multipliers) for _ in self._joint.rows())
        force = self._across * across + self._d * along
        return self._joint.force(iter([force.x, force.y, *rest]))

    def slide(self, rates: Rates) -> Slide | None:
        return self._joint.slide(rates)


class Hinge(Placed):
    """A hinge at one position: the numbers of its links in the group, with the arms from their starts to the point at
    which they meet. The pin of a link before the group has the motion `base`; the link starts from it."""

    __slots__ = ("_arm", "_base", "_by", "_by_arm", "_link")

    def __init__(
        self,
        link: int,
        arm: Vec2 = ZERO,
        by: int | None = None,
        by_arm: Vec2 = ZERO,
        base: Motion | None = None,
    ) -> None:
        self._link, self._arm, self._by, self._by_arm, self._base = link, arm, by, by_arm, base

    @property
    def seat(self) -> Seat | None:
        """Its pin, if it joins two links of the group."""
        if self._by is None:
            return None
        return (self._by, ZERO) if self._by_arm is ZERO else (self._link, self._arm)

    def held_by(self, link: int, arm: Vec2) -> Hinge:
        """The same joint of the start of its link with a `link` of the group, at the arm from the start of that."""
        return Hinge(self._link, ZERO, link, arm)

    def rows(self) -> list[Row]:
        """Its rows: of the point along x and y."""
        k, r = UNKNOWNS * self._link, self._arm
        x, y = ({k: 1}, {k + 1: 1}) if r is ZERO else ({k: 1, k + 2: -r.y}, {k + 1: 1, k + 2: r.x})
        if self._by is not None:
            k, r = UNKNOWNS * self._by, self._by_arm
            x[k] = y[k + 1] = -1
            if r is not ZERO:
                x[k + 2], y[k + 2] = r.y, -r.x
        return [x, y]

    def right(self, rates: Rates, before: Third | None) -> list[Any]:
        """See `Joint`: the known derivative of the pin before the group, if it is one, and on both links the part of
        the next derivative of the pin that the lower ones give, such as the centripetal acceleration."""
        e, base = ZERO, self._base
        if base is not None:
            e = before[0] if before is not None else base.p2 if rates else base.p1
        if rates and self._arm is not ZERO:
            e = _bent(e, self._arm, rates, self._link, 1.0)
        if rates and self._by is not None and self._by_arm is not ZERO:
            e = _bent(e, self._by_arm, rates, self._by, -1.0)
        return [e.x, e.y]

    def force(self, multipliers: Iterator[Any]) -> tuple[Vec2 | None, Any]:
        return Vec2(next(multipliers), next(multipliers)), None


def _bent(e: Vec2, arm: Vec2, rates: Rates, link: int, sign: float) -> Vec2:
    """The vector and what the known derivatives of a link's angle take from the next one of the end of an arm."""
    turn = UNKNOWNS * link + 2
    t1 = rates[0][turn]
    if len(rates) == 1:
        return e.plus(arm, sign * (t1 * t1))
    return e.plus(arm.turned(), sign * (t1 * t1 * t1)).plus(arm, 3.0 * sign * (t1 * rates[1][turn]))


class DrivenHinge(Hinge):
    """A hinge with a motor: the angle of its link, from that of the other one, changes by `sense`, 1 or -1, with the
    place of the driver, which has the derivatives `course` by q. The other one is `by`, or a `carrier` before the
    group, None for the ground."""

    __slots__ = ("_carrier", "_course", "_sense")

    def __init__(
        self, link: int, sense: int, course: Sequence[Any], carrier: Link | None, *held: Any
    ) -> None:
        super().__init__(link, ZERO, *held)
        self._sense, self._course, self._carrier = sense, course, carrier

    def rows(self) -> list[Row]:
        """See `Hinge`; then of the angle."""
        turn: Row = {UNKNOWNS * self._link + 2: self._sense}
        if self._by is not None:
            turn[UNKNOWNS * self._by + 2] = -self._sense
        return [*super().rows(), turn]

    def right(self, rates: Rates, before: Third | None) -> list[Any]:
        turn, k = self._course[len(rates)], self._carrier
        if k is not None:
            carried = before[1] if before is not None else k.t2 if rates else k.t1
            turn = turn + self._sense * carried
        return [*super().right(rates, before), turn]

    def force(self, multipliers: Iterator[Any]) -> tuple[Vec2 | None, Any]:
        """See `Placed`; on a carrier before the group the reaction has the moment of the motor, a `GuideForce`."""
        force, effort = Vec2(next(multipliers), next(multipliers)), next(multipliers)
        return force if self._carrier is None else GuideForce(force.x, force.y, self._sense * effort), effort


class Guide(Hinge):
    """A sliding joint at one position: the line through a point of the other link in the direction `d`, on which the
    link starts, at the way `s`; `arm` goes from the start of the other link, or of the rail before the group, to the
    start of the link. With a `line` a driver gives the way, with the derivatives `course` by q: it is how far the
    force of the driver lies to the left of the start of the link [m]."""

    __slots__ = ("_course", "_d", "_line", "_other", "_s")

    def __init__(
        self,
        link: int,
        d: Vec2,
        s: Any,
        arm: Vec2,
        other: int | Link,
        line: Any = None,
        course: Sequence[Any] = STEADY,
    ) -> None:
        by, base = (other, None) if isinstance(other, int) else (None, other.carried(arm))
        super().__init__(link, ZERO, by, arm, base)
        self._d, self._s, self._other, self._line, self._course = d, s, other, line, course

    @property
    def seat(self) -> Seat | None:
        return None

    def held_by(self, link: int, arm: Vec2) -> Guide:
        """See `Hinge`."""
        return Guide(self._link, self._d, self._s, arm, link)

    def rows(self) -> list[Row]:
        """See `Hinge`; then of the angle. The way is an unknown, too."""
        (x, y), k, other = super().rows(), UNKNOWNS * self._link, self._other
        if self._line is None:
            x[k + 3], y[k + 3] = -self._d.x, -self._d.y
        return [x, y, {k + 2: 1, UNKNOWNS * other + 2: -1} if isinstance(other, int) else {k + 2: 1}]

    def right(self, rates: Rates, before: Third | None) -> list[Any]:
        """See `Joint`: for the two rows of the point those of a pin, and what a line that turns while the block
        slides adds (Coriolis); for the row of the angle the turn of the line, if it is known before the group."""
        other, angle, order, d = self._other, 0.0, len(rates), self._d
        if isinstance(other, int):
            turns = [z[UNKNOWNS * other + 2] for z in rates]
        else:
            turns = [other.t1, other.t2]
            if before is not None:
                before = other.third_derivative(self._by_arm, *before), before[1]
                turns.append(before[1])
            angle = turns[order]
        e = Vec2(*super().right(rates, before))
        if self._line is not None and (order == 0 or self._course is not STEADY):
            e = e.plus(d, self._course[order])
        if order == 1:
            e = e.plus(d.turned(), 2.0 * (turns[0] * self._speed(rates, 0)))
        elif order == 2:
            t1, s1 = turns[0], self._speed(rates, 0)
            across = 3.0 * (turns[1] * s1 + t1 * self._speed(rates, 1))
            e = e.plus(d.turned(), across).plus(d, -3.0 * (t1 * t1 * s1))
        return [e.x, e.y, angle]

    def _speed(self, rates: Rates, order: int) -> Any:
        """The derivative of the way by q."""
        return rates[order][UNKNOWNS * self._link + 3] if self._line is None else self._course[order]

    def slide(self, rates: Rates) -> Slide:
        """The motion along its line."""
        turn = rates[0][UNKNOWNS * self._link + 2]
        return Slide(self._d, self._s, self._speed(rates, 0), self._speed(rates, 1), turn)

    def force(self, multipliers: Iterator[Any]) -> tuple[Vec2 | None, Any]:
        """See `Placed`; the reaction is a `GuideForce`."""
        force, moment = Vec2(next(multipliers), next(multipliers)), next(multipliers)
        if self._line is None and self._by is not None:
            # normal to the line as it is: no load acts on the way alone
            return GuideForce(force.x, force.y, moment), None
        n, effort = self._d.turned(), None
        if self._line is not None:
            effort = force.dot(self._d)
            moment = moment + self._line * effort
        return GuideForce.along(n, force.dot(n), moment), effort


class Contact(Placed):
    """The contact of a follower with a cam at one position: the frame `cam` of the profile, the start `base` of the
    follower, the `arm` from there to the centre of its roller, or to a point of its face, the radius of the `roller`,
    None for a face, and the point of the pitch curve, or of the profile under a face, turned with the cam."""

    __slots__ = ("_arm", "_base", "_cam", "_lever", "_reach", "_roller", "_spot")

    def __init__(self, cam: Link, base: Vec2, arm: Vec2, spot: Any, roller: Any) -> None:
        self._cam, self._base, self._arm, self._spot, self._roller = cam, base, arm, spot, roller
        # along the face, from its point to the contact
        face = spot.normal.turned().dot(spot.place - (base + arm - cam.pin.p))
        self._reach = face if roller is None else 0.0
        self._lever = arm.cross(spot.normal) - self._reach

    def rows(self) -> list[Row]:
        """Its row: of the point at the contact along the normal."""
        return [{0: self._spot.normal.x, 1: self._spot.normal.y, 2: self._lever}]

    def right(self, rates: Rates, before: Third | None) -> list[Any]:
        """See `Placed`: what the gap loses while the next derivatives of the follower are 0. A profile counts by its
        curvature and the change of that."""
        (seen, turn), spot = self._seen(rates, len(rates) + 1, before), self._spot
        n, t, k = spot.normal, spot.normal.turned(), spot.curvature
        if self._roller is not None:
            along = Jet(0.0, *seen.dot(t).parts[1:])
            return [-(seen.dot(n) + along * along * (0.5 * k + along * (spot.change / 6.0))).parts[-1]]
        # the distance of a tangent of the profile from its centre, over the angle
        foot, bend = spot.place.dot(t), 1.0 / k - spot.place.dot(n)
        cubic = -(spot.change / (k * k * k) + foot) / 6.0
        distance = turn * (turn * (turn * cubic + 0.5 * bend) + foot)
        return [(distance - seen.dot(rotated(_direction(turn), n))).parts[-1]]

    def _seen(self, rates: Rates, order: int, before: Third | None = None) -> tuple[Vec2, Jet]:
        """The point of the follower from the centre, as the cam sees it, and the angle of the follower less that of
        the cam, up to an `order` of derivatives; the derivatives of the follower beyond `rates` are 0."""
        cam, point = self._cam, self._base - self._cam.pin.p
        motion = [(cam.pin.p1, cam.t1), (cam.pin.p2, cam.t2), *([] if before is None else [before])][:order]
        x, y, angle = (Jet(0.0, *(z[k] for z in rates), *[0.0] * (order - len(rates))) for k in range(3))
        turn = Jet(0.0, *(t for _, t in motion))
        start = Vec2(
            x + point.x - Jet(0.0, *(p.x for p, _ in motion)),
            y + point.y - Jet(0.0, *(p.y for p, _ in motion)),
        )
        return rotated(start + rotated(_direction(angle), self._arm), _direction(-turn)), angle - turn

    def force(self, multipliers: Iterator[Any]) -> tuple[Vec2 | None, Any]:
        """The force of the contact, along the normal where it presses."""
        force = next(multipliers)
        return GuideForce.along(self._spot.normal, force, force * self._lever), None

    def slide(self, rates: Rates) -> Slide:
        """The motion of the follower past the cam at the contact."""
        (seen, turn), follower = self._seen(rates, 2), rates[0][2]
        n, k = self._spot.normal, self._spot.curvature
        (_, s1, s2), (_, turn1, turn2), t = seen.dot(n.turned()).parts, turn.parts, n.turned()
        if self._roller is None:
            return Slide(t, None, s1, s2 - turn1 * turn1 * self._reach, follower, turn1 / k - s1)
        turned = self._cam.t1 + k * s1
        growth = (follower - turned) * self._arm.dot(n)
        return Slide(t, None, s1 - self._roller * turn1, s2 - self._roller * turn2, turned, growth)


def _direction(turn: Jet) -> Vec2:
    """Cosine and sine of an angle that is 0 at first, up to the third derivatives."""
    square = turn * turn
    return Vec2(1.0 - square * 0.5, turn - square * turn * (1.0 / 6.0))
