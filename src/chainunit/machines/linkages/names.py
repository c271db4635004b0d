"""Names in the file of a linkage: which ones are right, which a text mentions, and points of one name."""

from __future__ import annotations

import keyword
import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from typing import Any, TypeVar

Node = TypeVar("Node")
LinkPoint = tuple[str, str]
"""A point by its link and its name."""
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_WORD = re.compile(r"[^\W\d]\w*")


def words_in(entry: Any) -> set[str]:
    """All words in the texts of a table."""
    if isinstance(entry, str):
        return {*_WORD.findall(entry)}
    inside = entry.values() if isinstance(entry, Mapping) else entry if isinstance(entry, list) else ()
    return set().union(*map(words_in, inside))


def name_fault(name: str) -> str:
    """What is wrong with a name; empty if nothing is."""
    if not _NAME.fullmatch(name):
        return "a name has letters, digits and _, and begins with a letter"
    if keyword.iskeyword(name):
        return f"{name} is a word of programming languages; choose another name, such as {name}_1"
    return ""


def model_name(stem: str) -> str:
    """The name of a machine whose file states none, from the name of the file: ``60 kN press`` gives
    ``linkage_60_kN_press``, ``größer`` gives ``grosser``. It is an identifier of C, as FMUs need one."""
    plain = unicodedata.normalize("NFKD", stem.replace("ß", "ss"))
    name = re.sub(r"[^A-Za-z0-9_]", "_", "".join(c for c in plain if not unicodedata.combining(c)))
    return f"linkage_{name}" if name_fault(name) else name


def owners_of(points: Mapping[str, Iterable[str]]) -> dict[str, list[str]]:
    """The links that have a point of each name; `points` are the names of the points of each link, the ground too."""
    owners: dict[str, list[str]] = {}
    for link, names in points.items():
        for point in names:
            owners.setdefault(point, []).append(link)
    return owners


def connected(start: Node, sets: Sequence[AbstractSet[Node]]) -> set[Node]:
    """All that the `sets` connect with the `start`, and itself."""
    met, grown = set[Node](), {start}
    while met != grown:
        met = grown
        grown = met.union(*(nodes for nodes in sets if nodes & met))
    return met


def alike_points(points: Mapping[str, Iterable[str]], used: set[tuple[str, ...]]) -> str:
    """Words on a point that nothing joins, whose name looks like that of a point of another link: a pin that was
    meant. `used` are the points that joints, loads and masses name, by link."""
    owners = owners_of(points)
    for link, names in points.items():
        for point in names:
            if owners[point] != [link] or (link, point) in used:
                continue
            for other, those in owners.items():
                if those != [link] and other != point and _alike(point, other):
                    return (
                        f"; the names of the points {link}.{point} and {those[0]}.{other} look alike: a pin joins "
                        "points of one name"
                    )
    return ""


def _alike(first: str, second: str) -> bool:
    """Whether two names may be meant to be one: but for capitals and signs between, or a letter more."""
    a, b = (name.replace("_", "").lower() for name in (first, second))
    if a == b:
        return True
    digits = [re.sub(r"\D", "", name) for name in (a, b)]
    short, long = sorted((a, b), key=len)
    return digits[0] == digits[1] and len(long) == len(short) + 1 and long.startswith(short)
