"""The expression of Pyslvs: ``M[J[R, P[x, y], L[ground, L1]], ...]``. A joint has its type (R, P, RP), for a slot its
angle A[deg], a colour, its place, and its links, of which the first one has the slot."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

from ....core.errors import InputError, shown
from ....mechanism.assur import GROUND
from .foreign import ForeignLinkage

_COMMENT = re.compile(r"#[^\n]*")
_BEGIN = re.compile(r"\s*M\s*\[")
_WHOLE = re.compile(r"\s*M\s*\[(.*)\]\s*", re.DOTALL)
_JOINT = re.compile(r"\s*J\s*\[\s*(\w+)\s*,((?:[^\[\]]|\[[^\[\]]*\])*)\]\s*(?:,|$)")
_TERM = re.compile(r"([A-Za-z]+)\s*\[([^\[\]]*)\]")


def begins(text: str) -> bool:
    """Whether a text looks like an expression of Pyslvs."""
    return bool(_BEGIN.match(_bare(text)))


def _bare(text: str) -> str:
    """A text without comments: from a # to the end of its line, or from #[ to the line of the last #]."""
    before, _, rest = text.partition("#[")
    if "#]" in rest:
        text = f"{before}#{rest.rpartition('#]')[2]}"
    return _COMMENT.sub("", text)


def read(text: str, name: str) -> ForeignLinkage:
    """The linkage in an expression; `name` is that of its file.

    Raises
    ------
    InputError
        for what is no expression; other faults are collected.
    """
    linkage, links, sliders = ForeignLinkage("Pyslvs", "mm"), {GROUND: GROUND}, []
    for number, (kind, terms) in enumerate(_joints(_bare(text), name)):
        title, place, riders = f"joint {number}", terms.get("P", []), terms.get("L", [])
        angle = terms.get("A", [])
        if kind not in ("R", "P", "RP") or len(place) != 2 or len(angle) != (kind != "R"):
            linkage.fault(
                title, "must be J[R, P[x, y], L[...]], or J[P, A[angle], P[x, y], L[...]], with P or RP"
            )
            continue
        links |= {link: linkage.link(link) for link in riders if link not in links}
        on = [links[link] for link in riders[kind != "R" :]]
        pin = linkage.pin(f"P{number}", linkage.numbers(title, place), *on)
        if kind != "R" and not on:
            linkage.fault(title, "slides, and has fewer than two links; the first one has the slot")
        elif kind != "R":
            sliders.append((title, pin, links[riders[0]], linkage.numbers(title, angle)[0], kind == "P"))
    for title, pin, track, degrees, stiff in sliders:
        linkage.slot(title, pin, track, math.radians(degrees), stiff)
    return linkage


def _joints(text: str, name: str) -> Iterator[tuple[str, dict[str, list[str]]]]:
    """The kind of each joint, and the words in its terms by their heads."""
    whole, start = _WHOLE.fullmatch(text), 0
    content = whole[1].rstrip(" ,\r\n\t") if whole else ""
    while start < len(content) or not whole:
        joint = _JOINT.match(content, start)
        if not joint:
            near = shown(content[start : start + 40].strip() if whole else text[-40:])
            raise InputError(f"{name}: must be M[J[...], J[...], ...]; it is wrong at {near}")
        terms = {head: [x.strip() for x in entries.split(",")] for head, entries in _TERM.findall(joint[2])}
        yield joint[1], {head: [entry for entry in entries if entry] for head, entries in terms.items()}
        start = joint.end()
