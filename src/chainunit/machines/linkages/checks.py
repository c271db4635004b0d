"""Checks of a whole linkage file, beyond each entry by itself: the keys that are wrong, and what is wrong."""

from __future__ import annotations

import keyword
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ...errors import InputError
from ...mechanism.assur import GROUND, PRISMATIC, REVOLUTE
from ...mechanism.expressions import CONSTANTS, FUNCTIONS
from .loads import MOTION
from .structure import DriverEntry, JointEntry, groups_of

Fault = tuple[str, str]
Entries = Sequence[Mapping[str, Any]]

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_WORD = re.compile(r"[^\W\d]\w*")
POINT_NAMES = ("angle", "w", "a", "centroid", "mass", "inertia")
"""Names that the variables of a link have already."""
_STUDY = ("machine", "motor", "event", "run", "system", "sizing", "feed")


def words(given: Any) -> set[str]:
    """All words in the texts of a table."""
    if isinstance(given, str):
        return {*_WORD.findall(given)}
    inside = given.values() if isinstance(given, Mapping) else given if isinstance(given, list) else ()
    return set().union(*map(words, inside))


def name_fault(name: str) -> str:
    """What is wrong with a name; empty where nothing is."""
    if not _NAME.fullmatch(name):
        return "a name has letters, digits and _, and begins with a letter"
    if keyword.iskeyword(name):
        return f"{name} is a word of programming languages; choose another name, such as {name}_1"
    return ""


def study_fault(data: Mapping[str, Any]) -> None:
    """Refuse a study file.

    Raises
    ------
    InputError
        in one line.
    """
    found = [key for key in _STUDY if key in data]
    if found and "links" not in data:
        raise InputError(
            f"{found[0]}: is a table of a study file, and this file has no [links]: run a study file with chainunit "
            "study; a linkage file has [ground], [driver] and [links]",
            key=found[0],
        )


def quantity_names(
    parameters: Entries, inputs: Entries, tables: Mapping[str, Any], reserved: frozenset[str], links: Entries
) -> Iterator[Fault]:
    """Names of parameters, inputs and tables that two things share, or that have a meaning already."""
    seen: dict[str, str] = {}
    own = {f"{quantity}_of_{link['name']}" for link in links for quantity in link.get("own", ())}
    names = [
        (kind, each["name"])
        for kind, entries in (("parameters", parameters), ("inputs", inputs))
        for each in entries
    ]
    for kind, name in (*names, *(("tables", name) for name in tables)):
        key = f"{kind}.{name}"
        if name in (*FUNCTIONS, *CONSTANTS, *MOTION):
            yield key, "the name has a meaning in expressions; choose another one"
        elif name in own or (kind != "tables" and name in reserved):
            yield key, "is a variable of every linkage; choose another name"
        elif name in seen:
            yield key, f"is a name in [{seen[name]}], too; choose another one"
        elif kind != "tables" and name in {link["name"] for link in links}:
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


def freedom_faults(links: Entries, joints: Entries, driver: Mapping[str, Any]) -> Iterator[Fault]:
    """Too many or too few degrees of freedom, and groups of a class that is not covered."""
    entries = [JointEntry(j["name"], j["type"], tuple(j["on"]), tuple(j["by"])) for j in joints]
    try:
        groups_of([link["name"] for link in links], entries, DriverEntry(**driver))
    except InputError as error:
        yield f"links.{error.key}" if error.key in {link["name"] for link in links} else "joints", str(error)


Places = Mapping[str, Mapping[str, tuple[float, float]]]


def length_faults(points: Places, joints: Entries, driver: str) -> Iterator[Fault]:
    """Lines without a direction and links without a length, but for the driver, at the start values of the
    parameters."""
    ends: dict[str, list[tuple[str, str]]] = {}
    for joint in joints:
        for link, point in (joint["on"], joint["by"]):
            ends.setdefault(link, []).append((point, joint["type"]))
        if joint["type"] == PRISMATIC:
            link, start = joint["by"]
            if math.dist(points[link][start], points[link][joint["toward"]]) == 0.0:
                key = f"joints.{joint['name']}.toward"
                yield (
                    key,
                    f"{start} and {joint['toward']} are in one place, so that the line has no direction",
                )
    for link, those in ends.items():
        if link in (GROUND, driver) or len(those) != 2 or {kind for _, kind in those} != {REVOLUTE}:
            continue
        (one, _), (other, _) = those
        if math.dist(points[link][one], points[link][other]) == 0.0:
            key = f"links.{link}.points"
            yield key, f"{one} and {other} are in one place, so that {link} has no length; place them apart"
