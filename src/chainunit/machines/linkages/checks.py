"""Checks of a whole linkage file, beyond each entry by itself: the keys that are wrong, and what is wrong."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any

from ...core.errors import InputError
from ...mechanism.assur import GROUND, PRISMATIC, REVOLUTE, FixedLinksError, FreeLinksError, check_stiffness
from ...mechanism.expressions import CONSTANTS, WORDS
from .declarations import RESERVED
from .entries import Places
from .joint_kind import CAM, JointEntry
from .joint_kinds import KINDS
from .loads import MOTION
from .names import alike_points
from .structure import DriverEntry, groups_of

Fault = tuple[str, str]
Entries = Sequence[Mapping[str, Any]]

POINT_NAMES = ("angle", "w", "a", "centroid", "mass", "inertia")
"""Names that the variables of a link have already."""
_STUDY = ("machine", "motor", "event", "run", "system", "sizing", "feed")


def guide_faults(data: Mapping[str, Any], joints: Entries) -> Iterator[Fault]:
    """The fault of a table of guides or cams if the linkage has none."""
    for table, kind, has in (("guides", PRISMATIC, "slides"), ("cams", CAM, "is a cam")):
        if table in data and not any(joint["type"] == kind for joint in joints):
            yield table, f"no joint of the linkage {has}; leave the table out"


def study_fault(data: Mapping[str, Any]) -> None:
    """Refuse a study file."""
    study_tables = [key for key in _STUDY if key in data]
    if study_tables and "links" not in data:
        raise InputError(
            f"{study_tables[0]}: is a table of a study file, and this file has no [links]: run a study file with "
            "chainunit study; a linkage file has [ground], [driver] and [links]",
            key=study_tables[0],
        )


def quantity_names(names: Mapping[str, Sequence[str]], links: Entries) -> Iterator[Fault]:
    """Names of parameters, inputs and tables that two things share, or that have a meaning already; `names` are
    those by the table of the file."""
    seen: dict[str, str] = {}
    link_names = {link["name"] for link in links}
    link_quantities = {f"{quantity}_of_{link['name']}" for link in links for quantity in link.get("own", ())}
    for kind, name in ((kind, name) for kind, members in names.items() for name in members):
        key = f"{kind}.{name}"
        if name in (*WORDS, *CONSTANTS, *MOTION):
            yield key, "the name has a meaning in expressions; choose another one"
        elif name in link_quantities or (kind != "tables" and name in RESERVED):
            yield key, "is a variable of every linkage; choose another name"
        elif name in seen:
            yield key, f"is a name in [{seen[name]}], too; choose another one"
        elif kind not in ("tables", "drivers") and name in link_names:
            yield key, "is the name of a link, too; choose another one"
        seen.setdefault(name, kind)


def spring_faults(loads: Entries, joints: Entries) -> Iterator[Fault]:
    """Springs without a length: between two points of a link, or in a pin."""
    pins = {frozenset((tuple(j["on"]), tuple(j["by"]))): j["name"] for j in joints if j["type"] == REVOLUTE}
    for load in loads:
        if not load.get("by") or not load.get("on"):
            continue
        ends, key = frozenset((tuple(load["on"]), tuple(load["by"]))), f"loads.{load['name']}"
        if load["on"][0] == load["by"][0]:
            link = load["on"][0]
            yield key, f"both ends are on {link}; give points of two links, or of one and the ground"
        elif ends in pins:
            yield key, f"both ends are in the joint {pins[ends]}; give points that move apart"


def freedom_faults(
    points: Mapping[str, Iterable[str]],
    links: Entries,
    joints: Entries,
    loads: Entries,
    drivers: Entries,
) -> Iterator[Fault]:
    """Too many or too few degrees of freedom, and groups of a class that is not covered. Too many may come from a
    name of a point that is not spelled as that of the pin that it was meant to be.

    Raises
    ------
    FixedLinksError
        for links that are fixed more than once.
    """
    names = [link["name"] for link in links]
    try:
        entries = [JointEntry.from_table(j) for j in joints], [DriverEntry(**driver) for driver in drivers]
        check_stiffness(groups_of(names, *entries), [link["name"] for link in links if "stiffness" in link])
    except FixedLinksError:
        raise
    except InputError as error:
        used = {tuple(entry[end]) for entry in (*joints, *loads) for end in ("on", "by") if end in entry}
        used |= {(joint["by"][0], joint["toward"]) for joint in joints if "toward" in joint}
        used |= {(link["name"], point) for link in links for point in link["masses"]}
        hint = alike_points(points, used) if isinstance(error, FreeLinksError) else ""
        yield f"links.{error.key}" if error.key in names else "joints", f"{error}{hint}"


def length_faults(points: Places, joints: Entries, drivers: Collection[str]) -> Iterator[Fault]:
    """Lines without a direction and links without a length, but for the drivers, at the start values of the
    parameters."""
    ends: dict[str, list[tuple[str, str]]] = {}
    for joint in joints:
        for link, point in (joint["on"], joint["by"]):
            ends.setdefault(link, []).append((point, joint["type"]))
        yield from KINDS[joint["type"]].start_faults(joint, points)
    for link, those in ends.items():
        if link in (GROUND, *drivers) or len(those) != 2 or {kind for _, kind in those} != {REVOLUTE}:
            continue
        (one, _), (other, _) = those
        if math.dist(points[link][one], points[link][other]) == 0.0:
            why = f"{one} and {other} are in one place, so that {link} has no length; place them apart"
            if one == other:
                why = f"{link} has two pins in its point {one}; if one of both joints is a guide, give it `toward`"
            yield f"links.{link}.points", why
