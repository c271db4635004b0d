"""The plain address of PMKS+: joints after ``j=``, links after ``l=``, forces after ``f=``, settings after ``s=``; a
row for each, with commas between its fields."""

from __future__ import annotations

import math
from urllib.parse import unquote

from ....core.errors import InputError, shown
from ....mechanism.assur import GROUND
from .foreign import ForeignDriver, ForeignLink, ForeignLinkage

_TRUE, _FALSE = ("t", "true"), ("f", "false")
_MASSES = {"cm": (1e-3, 1e-4), "m": (1.0, 1.0)}
"""By unit of length the units of mass [kg] and inertia [kg m2]: g and kg cm2, or kg and kg m2."""
Row = list[str]


def read(text: str, name: str) -> ForeignLinkage:
    """The linkage in an address; `name` is that of its file.

    Raises
    ------
    InputError
        for a text without joints and links; other faults are collected.
    """
    sections: dict[str, list[Row]] = {}
    for section in unquote(text[text.find("j=") :]).split("&"):
        key, _, rows = section.partition("=")
        sections[key] = [[x.strip() for x in row.split(",")] for row in rows.splitlines() if row.strip(" ,")]
    if not sections.get("j") or not sections.get("l"):
        raise InputError(
            f"{name}: has no joints and links; must be the plain address of PMKS+, ?j=...&l=...&f=...&s=..."
        )
    return _Reader(sections).linkage


class _Reader:
    """The reader of one address; joints and links have names by their ids in it."""

    def __init__(self, sections: dict[str, list[Row]]) -> None:
        _, clockwise, gravity, unit = ([*sections.get("s", []), []][0] + ["", "", "", ""])[:4]
        self.linkage = ForeignLinkage("PMKS+", unit or "cm")
        if self.linkage.unit not in _MASSES:
            self.linkage.fault("settings", f"the unit of length is {shown(unit)}; set it to cm or m in PMKS+")
        self.clockwise, self.linkage.weightless = clockwise in _TRUE, gravity in _FALSE
        if self.linkage.weightless:
            self.linkage.remarks.append("gravity is off in the drawing, and so it is here")
        self.joints: dict[str, str] = {}
        self.links: dict[str, str] = {}
        sliders = [row for row in sections["j"] if self.joint(row)]
        for row in sections["l"]:
            # some versions write the type of the link after its name
            self.link([row[0], *row[2:]] if row[1:2] in (["R"], ["P"]) else row)
        for row in sliders:
            self.slider(row)
        for row in sections.get("f", []):
            self.force(row)

    def numbers(self, title: str, row: Row, most: float = 1e9) -> list[float]:
        """The numbers in fields of a row."""
        return [self.linkage.number(title, "a field", text, most) for text in row]

    def link_of(self, text: str) -> ForeignLink:
        """The link of an id; a new one is added."""
        if text not in self.links:
            self.links[text] = self.linkage.link(text, f"link {shown(text)}")
        return self.linkage.links[self.links[text]]

    def joint(self, row: Row) -> bool:
        """Add a joint; whether it slides."""
        title = f"joint {shown(row[0])}"
        if (
            len(row) < 6
            or row[4] not in ("R", "P")
            or row[5] not in (*_TRUE, *_FALSE)
            or row[0] in self.joints
        ):
            wrong = "stands there twice; each joint" if row[0] in self.joints else "a joint"
            self.linkage.fault(
                title, f"{wrong} must be id, x, y, links, R or P, t or f for the ground, angle, input"
            )
            return False
        x, y = self.numbers(title, row[1:3])
        pin = self.joints[row[0]] = self.linkage.pin(row[0], (x, y))
        for link in filter(None, row[3].split("|")):
            self.link_of(link).pins.append(pin)
        if row[4] == "R" and row[5] in _TRUE:
            self.linkage.links[GROUND].pins.append(pin)
        if [field for field in row[6:] if field in (*_TRUE, *_FALSE)][-1:] in (["t"], ["true"]):
            self.linkage.drivers.append(ForeignDriver(title, (pin,), self.clockwise))
        return row[4] == "P"

    def link(self, row: Row) -> None:
        """A link: its mass and its joints."""
        link, title = self.link_of(row[0]), f"link {shown(row[0])}"
        if len(row) < 6:
            self.linkage.fault(title, "must be id, mass, inertia, x and y of the centre, joints")
            return
        mass, inertia, x, y = self.numbers(title, row[1:5])
        if min(mass, inertia) < 0.0:
            self.linkage.fault(title, "has a mass or an inertia below 0")
        units = _MASSES.get(self.linkage.unit, (1.0, 1.0))
        link.mass, link.inertia, link.centroid = mass * units[0], inertia * units[1], (x, y)
        for joint in filter(None, row[5].split("|")):
            if joint not in self.joints:
                self.linkage.fault(title, f"has joint {shown(joint)}, which is no joint of the address")
            elif self.joints[joint] not in link.pins:
                link.pins.append(self.joints[joint])

    def slider(self, row: Row) -> None:
        """A joint that slides in the ground: a link with further places turns in the slot, a block does not."""
        title, pin = f"joint {shown(row[0])}", self.joints[row[0]]
        text = next((field for field in row[6:] if field not in (*_TRUE, *_FALSE, "", "Null")), "0")
        riders = [link for link in self.linkage.links.values() if pin in link.pins]
        places = {self.linkage.places[other] for link in riders for other in link.pins}
        if row[5] in _FALSE:
            self.linkage.fault(title, "slides on a moving link, and the address does not say on which one")
        self.linkage.slot(title, pin, GROUND, *self.numbers(title, [text], 100.0), stiff=len(places) == 1)

    def force(self, row: Row) -> None:
        """A constant force from its start towards its end, or against that."""
        title = f"force {shown(row[0])}"
        if len(row) < 9 or row[1] not in self.links:
            self.linkage.fault(title, "must be id, a link, x and y of start and end, t or f, direction, size")
            return
        x, y, end_x, end_y = self.numbers(title, row[2:6])
        size, angle = (
            math.hypot(*self.numbers(title, [*filter(None, row[8:10])], 1e12)),
            math.atan2(end_y - y, end_x - x),
        )
        size = -size if row[7] in _FALSE else size
        point = self.linkage.pin(row[0], (x, y))
        self.link_of(row[1]).pins.append(point)
        kind = "follower" if row[6] in _FALSE else "force"
        load = {"type": kind, "force": [size * math.cos(angle), size * math.sin(angle)]}
        self.linkage.loads[point] = self.links[row[1]], load
