"""The expression of Pyslvs: ``M[J[R, P[x, y], L[ground, L1]], ...]``. A joint has its type (R, P, RP), for a slot its
angle A[deg], a colour, its place, and its links, of which the first one has the slot."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from ....core.errors import InputError, shown
from ....mechanism.assur import GROUND
from .foreign import ForeignLinkage

_COMMENTS = re.compile(r"#\[.*?#\][^\n]*|#[^\n]*", re.DOTALL)
_TOKENS = re.compile(r"([A-Za-z_]\w*)\s*\[|([\](),])|([^\s\[\](),]+)")
_DEEPEST = 4


class PyslvsTerm(NamedTuple):
    """A term with a head, as P[1, 2]: its words, and the terms in it by head or, of joints, by number."""

    head: str
    words: list[str]
    terms: dict[str, PyslvsTerm]


def begins(text: str) -> bool:
    """Whether a text looks like an expression of Pyslvs."""
    return bool(re.match(r"\s*M\s*\[", _COMMENTS.sub("", text)))


def read(text: str, name: str) -> ForeignLinkage:
    """The linkage in an expression; `name` is that of its file.

    Raises
    ------
    InputError
        for what is no expression; other faults are collected.
    """
    linkage, links, sliders = ForeignLinkage("Pyslvs", "mm"), {GROUND: GROUND}, []
    empty = PyslvsTerm("", [], {})
    for number, joint in enumerate(_term(_COMMENTS.sub("", text), name).terms.values()):
        title, kind = f"joint {number}", "".join(joint.words[:1])
        place, names, angle = (joint.terms.get(head, empty).words for head in "PLA")
        if (
            joint.head != "J"
            or kind not in ("R", "P", "RP")
            or len(place) != 2
            or (kind == "R") == bool(angle)
        ):
            linkage.fault(
                title, "must be J[R, P[x, y], L[...]], or J[P, A[angle], P[x, y], L[...]], with P or RP"
            )
            continue
        x, y = (linkage.number(title, axis, word) for axis, word in zip("xy", place, strict=True))
        pin = linkage.pin(f"P{number}", (x, y))
        for link in names:
            links[link] = links[link] if link in links else linkage.link(link, f"link {shown(link)}")
        for link in names if kind == "R" else names[1:]:
            linkage.links[links[link]].pins.append(pin)
        if kind != "R" and len(names) < 2:
            linkage.fault(title, "slides, and has fewer than two links; the first one has the slot")
        elif kind != "R":
            sliders.append(
                (title, pin, links[names[0]], linkage.number(title, "the angle", angle[0]), kind == "P")
            )
    for title, pin, track, degrees, stiff in sliders:
        linkage.slot(title, pin, track, math.radians(degrees), stiff)
    return linkage


def _term(text: str, name: str) -> PyslvsTerm:
    """The term M[...] that a text is."""
    stack = [PyslvsTerm("", [], {})]
    for match in _TOKENS.finditer(text):
        head, sign, word = match.groups()
        if head:
            stack.append(PyslvsTerm(head, [], {}))
        elif word:
            stack[-1].words.append(word)
        elif sign == "]" and len(stack) > 1:
            term = stack.pop()
            stack[-1].terms[f"J{len(stack[-1].terms)}" if stack[-1].head in ("", "M") else term.head] = term
        if len(stack) > _DEEPEST or (sign == "]" and len(stack) == 1 and match.end() < len(text.rstrip())):
            break
    whole = [*stack[0].terms.values()]
    if len(stack) > 1 or len(whole) != 1 or whole[0].head != "M" or stack[0].words or whole[0].words:
        raise InputError(
            f"{name}: must be M[J[...], J[...], ...]; brackets are missing or too many, or there is more"
        )
    return whole[0]
