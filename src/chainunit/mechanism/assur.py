"""The decomposition of a planar linkage into Assur groups, from its links and joints alone.

Each joint of two links, revolute or prismatic, gives two equations, one of a further kind may give one; each link
has three unknowns. Equations are matched with unknowns (a maximum flow of joints into links). What an equation cannot
find is over-determined, what no equation takes is free. In a full matching each link depends on the other links of
its equations; the links that depend on each other, directly or by a circle, form a group, which no smaller part of it
determines. The groups come in the order in which they can be solved. This is the fine Dulmage-Mendelsohn
decomposition of the equations; where all their ranks are full, it is that into Assur groups.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import NamedTuple

from ..core.errors import InputError

GROUND = "ground"
REVOLUTE, PRISMATIC = "revolute", "prismatic"
FURTHER_DRIVERS = "give each of the others a table [drivers.NAME] beside [driver]"


class FreeLinksError(InputError):
    """Links of a linkage can move by themselves."""


class FixedLinksError(InputError):
    """The `links` of a linkage are fixed more than once."""

    def __init__(self, message: str, links: Sequence[str], key: str) -> None:
        super().__init__(message, key)
        self.links = links


class JointOf(NamedTuple):
    """A joint as the decomposition sees it: its name, its kind, its two links, and a `third` one that its equations
    contain. `alone` is the kind of the group that a single link forms by it and a joint of the kinds `seats`. One
    that a driver moves has 3 equations."""

    name: str
    kind: str
    on: str
    by: str
    third: str = ""
    equations: int = 2
    alone: str = ""
    seats: tuple[str, ...] = (REVOLUTE,)

    @property
    def links(self) -> tuple[str, ...]:
        """All links that its equations contain."""
        return (self.on, self.by, self.third) if self.third else (self.on, self.by)

    def other_link(self, link: str) -> str:
        """The link on its other side."""
        return self.by if link == self.on else self.on


class AssurGroup(NamedTuple):
    """A group: its kind (RRR, RRP, RPR, PRP, RPP, triad, tetrad, that of a single link or a driver), its links, and
    its joints in the order of their roles.

    Of a dyad the links are `first` and `second`; the joints connect the first link with the links before, both with
    each other, and the second link with the links before. Of a triad the ternary link stands first, then its legs;
    the joints are the outer ones of the legs, then their inner ones. Of a tetrad the two links with an outer joint
    stand first, then its legs; the joints are the outer ones, then the joints of the legs with the first link and
    with the second. Of a plate that legs share it stands first; the joints are the one that holds it besides, if one
    does, then the outer ones of the legs, then their inner ones. Of a single link the pin or the guide stands first.
    Of a driver between two links these stand first, then the lever; the joints are as of a dyad, and the one of the
    driver is the last.
    """

    kind: str
    links: tuple[str, ...]
    joints: tuple[JointOf, ...]


def decompose(
    links: Sequence[str], joints: Sequence[JointOf], drivers: Mapping[str, str]
) -> list[AssurGroup]:
    """The groups of the links, in an order in which they can be solved; `drivers` are the links that drivers move, by
    joint. The first one moves its link in the ground, or is the first group; a further one is a group, too.

    Raises
    ------
    InputError
        for a linkage with too many or too few degrees of freedom, or with a group of a class that is not covered, in
        one line that names the links and the joints.
    """
    by_name, first, every = {joint.name: joint for joint in joints}, next(iter(drivers)), joints
    grounded = {name: link for name, link in drivers.items() if GROUND in by_name[name].links}
    alone = [
        AssurGroup(DRIVER, (link,), (by_name[name],)) for name, link in grounded.items() if name != first
    ]
    joints = [
        j._replace(equations=_DRIVEN) if j.name in drivers else j for j in joints if j.name not in grounded
    ]
    unknown = [link for link in links if link not in grounded.values()]
    try:
        matched = _matching(dict.fromkeys(unknown, 3), joints)
    except FixedLinksError as fault:
        return _with_redundant_leg(links, every, drivers, fault)
    free = {link: 3 - sum(1 for matched_link in matched.values() if matched_link == link) for link in unknown}
    if any(free.values()):
        raise _freedoms(unknown, joints, matched, free)
    groups, placed = [], {GROUND, *grounded.values()}
    for part in _strong_parts(_dependences(unknown, joints, matched)):
        groups.append(_classified(tuple(part), joints, placed))
        placed |= {*part}
    leading = [group for group in groups if group.joints[-1].name == first]
    for group in leading:
        if group.kind == DRIVER or not all(GROUND in joint.links for joint in group.joints[:3:2]):
            raise _unpinned(group.joints[-1], "of the ground")
    return [*leading, *alone, *(group for group in groups if group not in leading)]


def in_order_of_motion(
    pins: Mapping[str, Sequence[str]],
    links: Sequence[str],
    joints: Sequence[JointOf],
    drivers: Collection[str],
) -> dict[str, list[str]]:
    """By pin, the links that meet in it, in the order in which their motion is known: the first one carries the pin,
    and the others hang on it.

    Which of three links in a pin are said to be joined with each other is arbitrary, but the groups depend on it.
    So the order is found for a linkage in which each pin is an unknown point of its own, joined with all of its
    links: a link or point comes after all that it depends on.

    Parameters
    ----------
    pins : by pin, the names of the links in it
    links, joints : all links, and the other joints
    drivers : the links whose motions are given
    """
    ranks = {GROUND: -2, **dict.fromkeys(drivers, -1)}
    points = {pin: f"{pin}." for pin in pins}  # no link has a name with a point
    unknowns = {link: 3 for link in links if link not in ranks} | dict.fromkeys(points.values(), 2)
    all_joints = [joint for joint in joints if not {joint.on, joint.by} <= ranks.keys()]
    for pin, meeting in pins.items():
        # ground and driver both say where the pin of a driver is: one of them is enough
        placed = [link for link in meeting if link in ranks]
        joined = [link for link in meeting if link not in ranks] + placed[:1]
        all_joints += [JointOf(pin, REVOLUTE, link, points[pin]) for link in joined]
    try:
        depends = _dependences([*unknowns], all_joints, _matching(unknowns, all_joints))
    except InputError:  # the decomposition says why
        return {pin: list(meeting) for pin, meeting in pins.items()}
    for k, part in enumerate(_strong_parts(depends)):
        ranks |= dict.fromkeys(part, k)
    return {pin: sorted(meeting, key=ranks.__getitem__) for pin, meeting in pins.items()}


def _dependences(
    unknown: Sequence[str], joints: Sequence[JointOf], matched: Mapping[tuple[int, int], str]
) -> dict[str, dict[str, None]]:
    """By link, the others on which it depends: those in the joints whose equations are `matched` with it. The inner
    dicts are sets that keep the order."""
    depends: dict[str, dict[str, None]] = {link: {} for link in unknown}
    for (k, _), link in matched.items():
        for other in joints[k].links:
            if other in depends and other != link:
                depends[link][other] = None
    return depends


def _matching(room: Mapping[str, int], joints: Sequence[JointOf]) -> dict[tuple[int, int], str]:
    """By equation (joint and number), the link that it determines; a link has `room` for as many equations as it has
    unknowns.

    Raises
    ------
    InputError
        if an equation finds no link with room: these links are fixed more than once.
    """
    matched: dict[tuple[int, int], str] = {}
    owners: dict[str, list[tuple[int, int]]] = {link: [] for link in room}

    def augment(equation: tuple[int, int], seen: set[str]) -> bool:
        """Whether the equation has found a link: one with room, or one that hands on another equation of its own; the
        links in `seen` were tried."""
        for link in joints[equation[0]].links:
            if link in owners and link not in seen:
                seen.add(link)
                if len(owners[link]) < room[link]:
                    owners[link].append(equation)
                    matched[equation] = link
                    return True
                for held in list(owners[link]):
                    if augment(held, seen):
                        owners[link].remove(held)
                        owners[link].append(equation)
                        matched[equation] = link
                        return True
        return False

    for k in range(len(joints)):
        for number in range(joints[k].equations):
            seen: set[str] = set()
            if not augment((k, number), seen):
                involved = sorted(seen) or [joints[k].on]
                fixing = [j.name for j in joints if {*j.links} & {*involved}]
                raise FixedLinksError(
                    f"too few degrees of freedom: the joints {', '.join(fixing)} fix the link"
                    f"{'s' * (len(involved) > 1)} {', '.join(involved)} more than once",
                    involved,
                    involved[0],
                )
    return matched


def _with_redundant_leg(
    links: Sequence[str], joints: Sequence[JointOf], drivers: Mapping[str, str], fault: FixedLinksError
) -> list[AssurGroup]:
    """The groups of a linkage that is fixed more than once, by a leg that can be left out: those without it, of which
    one has the plate that the leg holds, too.

    Raises
    ------
    FixedLinksError
        the `fault`, if there is no such leg.
    """
    for leg in fault.links:
        ends = [joint for joint in joints if leg in joint.links]
        if len(ends) != 2 or any(joint.kind not in _LETTERS or joint.name in drivers for joint in ends):
            continue
        try:
            others = [link for link in links if link != leg]
            groups = decompose(others, [joint for joint in joints if joint not in ends], drivers)
        except InputError:
            continue
        places = {link: k for k, group in enumerate(groups) for link in group.links}
        (before, outer), (k, inner) = sorted((places.get(j.other_link(leg), -1), j) for j in ends)
        if k > before and (shared := _shared(groups[k], inner.other_link(leg), leg, outer, inner)):
            groups[k] = shared
            return groups
    raise fault


def _shared(group: AssurGroup, plate: str, leg: str, outer: JointOf, inner: JointOf) -> AssurGroup | None:
    """A group whose `plate` stands on one leg more; None if it is none of its plates, or slides in the leg."""
    if group.kind in DYADS:
        (first, second), (p, b, q) = group.links, group.joints
        held, legs, ends = ([p], [second], [q, b]) if plate == first else ([q], [first], [p, b])
    elif group.kind in (TRIAD, SHARED) and plate == group.links[0]:
        legs = [*group.links[1:]]
        held, ends = [*group.joints[: -2 * len(legs)]], [*group.joints[-2 * len(legs) :]]
    else:
        return None
    near, far = [*ends[: len(legs)], outer], [*ends[len(legs) :], inner]
    if any(one.kind == other.kind == PRISMATIC for one, other in zip(near, far, strict=True)):
        return None
    return AssurGroup(SHARED, (plate, *legs, leg), (*held, *near, *far))


def check_stiffness(groups: Sequence[AssurGroup], stiff: Sequence[str]) -> None:
    """Refuse a leg without a stiffness that shares the force of a plate, and a link that is `stiff` for no use.

    Raises
    ------
    FixedLinksError, InputError
        in one line; its key is the name of the link.
    """
    sharing = {leg: group for group in groups if group.kind == SHARED for leg in group.links[1:]}
    if missing := [leg for leg in sharing if leg not in stiff]:
        plate, *legs = sharing[missing[0]].links
        raise FixedLinksError(
            f"{', '.join(legs)} hold {plate} more often than needed and share its force: give each of them a "
            'stiffness, such as stiffness = "50 kN/mm"; that of a rod is k = E A / L',
            legs,
            missing[0],
        )
    if unused := [link for link in stiff if link not in sharing]:
        legs = [f"here of {', '.join(sharing)}" if sharing else "and here there is none"]
        raise InputError(f"a stiffness counts only of a redundant leg, {legs[0]}; leave it out", unused[0])


def _freedoms(
    unknown: Sequence[str],
    joints: Sequence[JointOf],
    matched: Mapping[tuple[int, int], str],
    free: Mapping[str, int],
) -> InputError:
    """The refusal of a linkage in which links can move by themselves."""
    number = sum(free.values())
    # all that a free link carries along: equations can be handed on to it
    loose = {link for link, count in free.items() if count}
    while more := {link for (k, _), link in matched.items() if {*joints[k].links} & loose} - loose:
        loose |= more
    names = [link for link in unknown if link in loose]
    lone = [link for link in names if sum(link in (j.on, j.by) for j in joints) < 2]
    hint = f"; if several motors or cylinders move the machine, {FURTHER_DRIVERS}; else"
    if lone:
        joined = any(lone[0] in (j.on, j.by) for j in joints)
        hint = f"; {lone[0]} has {'one joint' if joined else 'no joint'};"
    many = len(names) > 1
    return FreeLinksError(
        f"too many degrees of freedom: {number + 1} where the driver gives one; the link{'s' * many} "
        f"{', '.join(names)} {'are' if many else 'is'} free to move{hint} add a joint, or take out a link",
        key=(lone or names)[0],
    )


def _strong_parts(depends: Mapping[str, Mapping[str, None]]) -> Iterator[list[str]]:
    """The parts of links that depend on each other, each after all that it depends on."""
    needs = {link: _needed(link, depends) for link in depends}
    seen: set[str] = set()

    def visit(link: str) -> Iterator[list[str]]:
        """The parts that are complete once the link and all that it depends on are seen."""
        part = [other for other in depends if other in needs[link] and link in needs[other]]
        is_first = seen.isdisjoint(part)
        seen.add(link)
        for other in depends[link]:
            if other not in seen:
                yield from visit(other)
        if is_first:
            yield part

    for link in depends:
        if link not in seen:
            yield from visit(link)


def _needed(link: str, depends: Mapping[str, Mapping[str, None]]) -> set[str]:
    """The links on which one depends, also by way of others, and itself."""
    needed, more = set[str](), {link}
    while more:
        needed |= more
        more = {other for name in more for other in depends[name]} - needed
    return needed


def _classified(part: tuple[str, ...], joints: Sequence[JointOf], placed: set[str]) -> AssurGroup:
    """A group on links that are `placed`, with its links and joints in their roles.

    Raises
    ------
    InputError
        for one that is not covered.
    """
    # the others are of groups after it
    joints = [j for j in joints if {*part} & {*j.links} and {*j.links} <= {*part} | placed]
    inner = [j for j in joints if j.on in part and j.by in part]
    outer = {
        link: [j for j in joints if link in (j.on, j.by) and j.other_link(link) in placed] for link in part
    }
    if len(part) == 1 and len(outer[part[0]]) == 2:
        pair = sorted(outer[part[0]], key=lambda joint: bool(joint.alone))
        if pair[1].alone and pair[0].kind in pair[1].seats:
            return AssurGroup(pair[1].alone, part, tuple(pair))
    if drive := next((j for j in joints if j.equations == _DRIVEN), None):
        return _driven(drive, part, [j for j in inner if j is not drive], outer)
    plain = all(joint.kind in _LETTERS for joint in joints)
    singly = all(len(link_joints) == 1 for link_joints in outer.values())
    if plain and singly and len(part) == 2 and len(inner) == 1:
        return _dyad(part, inner[0], {link: link_joints[0] for link, link_joints in outer.items()})
    if plain and len(part) == 4:
        for ternary in part:
            legs = [link for link in part if link != ternary]
            pairs = [[j for j in inner if {j.on, j.by} == {ternary, leg}] for leg in legs]
            if not outer[ternary] and all(
                len(meeting) == 1 for meeting in (*pairs, *(outer[leg] for leg in legs))
            ):
                return _on_legs(
                    TRIAD, [ternary], legs, [outer[leg][0] for leg in legs], [pair[0] for pair in pairs]
                )
        held = [link for link in part if len(outer[link]) == 1]
        legs = [link for link in part if not outer[link]]
        ends = [[j for j in inner if {j.on, j.by} == {plate, leg}] for plate in held for leg in legs]
        if len(held) == len(legs) == 2 and len(inner) == 4 and all(len(pair) == 1 for pair in ends):
            near, far = ([pair[0] for pair in pairs] for pairs in (ends[:2], ends[2:]))
            group = _on_legs(TETRAD, held, legs, near, far)
            return group._replace(joints=(*(outer[plate][0] for plate in held), *group.joints))
    number, many = len(joints), len(part) > 1
    raise InputError(
        f"the link{'s' * many} {', '.join(part)} form{'s' * (not many)} one group with {len(part)} "
        f"link{'s' * many} and {number} joint{'s' * (number > 1)}: a class that is not covered; covered are dyads "
        "(class II), triads (class III, a ternary link on three legs) and tetrads (class IV, two links with an outer "
        "joint each and two legs between them); drive another link, or add a link that splits the group",
        key=part[0],
    )


def _driven(
    drive: JointOf, part: Sequence[str], inner: Sequence[JointOf], outer: Mapping[str, Sequence[JointOf]]
) -> AssurGroup:
    """The group of a link that a driver turns on one before it, or of two links that it moves against each other,
    with their lever.

    Raises
    ------
    InputError
        if it is neither.
    """
    if outer[part[0]] == [drive] and drive.kind == REVOLUTE:
        return AssurGroup(DRIVER, (*part,), (drive,))
    if len(part) == 3 and len(inner) == 1 and {drive.on, drive.by} < {*part}:
        (lever,), c = {*part} - {drive.on, drive.by}, inner[0]
        far = c.other_link(lever)
        near = drive.other_link(far)
        ends = *outer[near], c, *outer[lever]
        if not outer[far] and [joint.kind for joint in ends] == [REVOLUTE] * 3:
            kind = ELBOW if drive.kind == REVOLUTE else CYLINDER
            return AssurGroup(kind, (near, far, lever), (*ends, drive))
    others = [*inner, *(joint for link in part for joint in outer[link])]
    special = next((joint for joint in others if joint.kind not in _LETTERS), None)
    raise _unpinned(drive, "of the ground or of a link that is moved before it", special)


def _unpinned(drive: JointOf, place: str, special: JointOf | None = None) -> InputError:
    """The refusal of two links that a driver moves against each other, if their outer pins are not at that place, or
    their group has a `special` joint."""
    moves, machine, hint = "along", "a cylinder", ""
    if drive.kind == REVOLUTE:
        moves, machine = "against", "two arms"
        hint = (
            "; a motor on a link that another driver moves is no [driver] but [drivers.NAME] beside that one"
        )
    if special is not None:
        hint = (
            f"; the {special.kind} {special.name} must be on a link that no driver moves against another one"
        )
    return InputError(
        f"the links {drive.by} and {drive.on}, which the driver {drive.name} moves {moves} each other, must be "
        f"{machine}: one of them on a pin {place}, the other one on a pin of a lever, and the lever on a pin {place}"
        f"{hint}",
        key=drive.by,
    )


_LETTERS = {REVOLUTE: "R", PRISMATIC: "P"}
DYADS = ("RRR", "RRP", "RPR", "PRP", "RPP")
DRIVER, CYLINDER, ELBOW = DRIVES = "driver", "cylinder", "elbow"
"""Kinds of the groups of a link that a driver besides the first one moves in the ground, or turns on a link before;
of a cylinder that is pinned at both ends, and of two arms with a motor between, with the lever that they swing."""
_DRIVEN = 3
"""Number of equations of a joint that a driver moves."""
TRIAD, TETRAD, SHARED = ON_LEGS = "triad", "tetrad", "shared plate"
"""Kinds of groups of which links stand on legs, without a closed form; the legs of the last one are more than needed,
and share the force."""
GROUPS = (*DYADS, *ON_LEGS, CYLINDER, ELBOW)
"""Kinds that a file may list, besides single links."""


def _dyad(part: tuple[str, ...], inner: JointOf, outer: Mapping[str, JointOf]) -> AssurGroup:
    """The dyad of two links, with an `inner` joint between them and an `outer` joint of each link with one before it.
    Its kind names the joints in a row, such as RRP.

    Raises
    ------
    InputError
        for three sliding joints.
    """
    first, second = part
    kind = "".join(_LETTERS[j.kind] for j in (outer[first], inner, outer[second]))
    # a revolute outer joint comes first; of an oscillating slide the block, which the guide acts on
    if kind in ("PRR", "PPR") or (kind == "RPR" and inner.on != first):
        first, second, kind = second, first, kind[::-1]
    if kind not in DYADS:
        raise InputError(
            f"the links {first}, {second} have three sliding joints, {outer[first].name}, {inner.name} and "
            f"{outer[second].name}: nothing holds their angles; make one of them a revolute joint",
            key=first,
        )
    return AssurGroup(kind, (first, second), (outer[first], inner, outer[second]))


def _on_legs(
    kind: str, plates: Sequence[str], legs: Sequence[str], near: Sequence[JointOf], far: Sequence[JointOf]
) -> AssurGroup:
    """The group of `plates` on legs; by leg, the joints at its ends.

    Raises
    ------
    InputError
        for a leg that slides in both joints.
    """
    for leg, a, b in zip(legs, near, far, strict=True):
        if a.kind == b.kind == PRISMATIC:
            raise InputError(
                f"the link {leg} slides in both of its joints, {a.name} and {b.name}: such a leg of a {kind} is not "
                "covered; make one of them a revolute joint",
                key=leg,
            )
    return AssurGroup(kind, (*plates, *legs), (*near, *far))
