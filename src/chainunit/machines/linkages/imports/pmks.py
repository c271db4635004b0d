"""The plain address of PMKS+: joints after ``j=``, links after ``l=``, forces after ``f=``, settings after ``s=``; a
row for each, with commas between its fields."""

from __future__ import annotations

import math
from urllib.parse import unquote

from ....core.errors import InputError, shown
from ....mechanism.assur import GROUND
from .foreign import ForeignLink, ForeignLinkage

_TRUE, _FALSE = ("t", "true"), ("f", "false")
_MASSES = {"cm": (1e-3, 1e-4), "m": (1.0, 1.0)}
"""By unit of length the units of mass [kg] and inertia [kg m2]: g and kg cm2, or kg and kg m2."""


def read(text: str, name: str) -> ForeignLinkage:
    """The linkage in an address; `name` is that of its file.

    Raises
    ------
    InputError
        for a text without joints and links; other faults are collected.
    """
    sections = {}
    for section in unquote(text[text.find("j=") :]).split("&"):
        key, _, rows = section.partition("=")
        rows = rows.replace("Null", "0")
        sections[key] = [[x.strip() for x in row.split(",")] for row in rows.splitlines() if row.strip(" ,")]
    if not sections.get("j") or not sections.get("l"):
        raise InputError(f"{name}: has no joints and links; must be the plain address, ?j=...&l=...&f=...")
    return PmksDrawing(sections)


class PmksDrawing(ForeignLinkage):
    """The linkage of one address; `joints` and links have `names` by their ids in it."""

    def __init__(self, sections: dict[str, list[list[str]]]) -> None:
        speed, clockwise, gravity, unit = ([*sections.get("s", []), []][0] + [""] * 4)[:4]
        super().__init__("PMKS+", unit if unit in _MASSES else "cm")
        if unit not in ("", *_MASSES):
            self.fault("settings", f"the unit of length is {shown(unit)}; set it to cm or m")
        (self.speed,) = self.numbers("settings", [speed or "10"])
        self.clockwise, self.weightless = clockwise in _TRUE, gravity in _FALSE
        if any(row[7:8] not in ([], ["0"], *([x] for x in (*_TRUE, *_FALSE))) for row in sections["j"]):
            self.remarks.append("the friction of the drawing is left out; give that of [pins] and [guides]")
        self.remarks += ["gravity is off in the drawing, and so it is here"] * self.weightless
        self.joints: dict[str, str] = {}
        self.names: dict[str, str] = {}
        # some versions write the type of a link after its name
        links = [[row[0], *row[2:]] if row[1:2] in (["R"], ["P"]) else row for row in sections["l"]]
        forces = sections.get("f", [])
        for read, noun, rows, form, least in (
            (self.joint, "joint", sections["j"], "id, x, y, links, R or P, t or f (ground), angle, input", 6),
            (self.body, "link", links, "id, mass, inertia, x and y of the centre, joints", 6),
            (self.slide, "joint", [row for row in sections["j"] if row[4:5] == ["P"]], "", 6),
            (self.force, "force", forces, "id, link, x and y of start and end, t or f, direction, size", 9),
        ):
            for row in rows:
                title = f"{noun} {shown(row[0])}"
                if len(row) >= least:
                    read(title, row)
                elif form:
                    self.fault(title, f"has {len(row)} fields; must have {form}")

    def named(self, text: str) -> ForeignLink:
        """The link of an id; a new one is added."""
        if text not in self.names:
            self.names[text] = self.link(text)
        return self.links[self.names[text]]

    def joint(self, title: str, row: list[str]) -> None:
        """A pin, or a joint that slides."""
        if row[4] not in ("R", "P") or row[0] in self.joints or (row[4] == "P" and row[5] in _FALSE):
            self.fault(title, "must stand there once, and must be R, or P in the ground")
        pin = self.joints[row[0]] = self.pin(row[0], self.numbers(title, row[1:3]))
        if row[4] == "R" and row[5] in _TRUE:
            self.links[GROUND].pins.append(pin)
        for link in filter(None, row[3].split("|")):
            self.named(link).pins.append(pin)
        if [x for x in row[6:] if x in (*_TRUE, *_FALSE)][-1:] in (["t"], ["true"]):
            self.motor(title, pin, self.clockwise, self.speed)

    def body(self, title: str, row: list[str]) -> None:
        """A link: its mass and its joints."""
        link, (mass, inertia, x, y) = self.named(row[0]), self.numbers(title, row[1:5])
        units = _MASSES[self.unit]
        link.mass, link.inertia, link.centroid = mass * units[0], inertia * units[1], (x, y)
        joints = [joint for joint in row[5].split("|") if joint]
        if mass < 0.0 or inertia < 0.0 or not {*joints} <= {*self.joints}:
            self.fault(title, "must have a mass and an inertia >= 0, and joints of the address")
        pins = [self.joints[joint] for joint in joints if joint in self.joints]
        link.pins += [pin for pin in pins if pin not in link.pins]

    def slide(self, title: str, row: list[str]) -> None:
        """A joint that slides: a link with further places turns in the slot, a block does not."""
        pin = self.joints[row[0]]
        angle = next((x for x in row[6:] if x not in (*_TRUE, *_FALSE, "")), "0")
        riders = [link for link in self.links.values() if pin in link.pins]
        places = {self.places[other] for link in riders for other in link.pins}
        self.slot(title, pin, GROUND, self.numbers(title, [angle])[0], len(places) == 1)

    def force(self, title: str, row: list[str]) -> None:
        """A constant force from its start towards its end, or against that, in the frame or along its link."""
        x, y, end_x, end_y, *sizes = self.numbers(title, [*row[2:6], *filter(None, row[8:10])])
        if row[1] not in self.names:
            self.fault(title, f"is on {shown(row[1])}, which is no link of the address")
            return
        way = complex(end_x - x, end_y - y) or 1.0 + 0.0j
        way *= (-1.0 if row[7] in _FALSE else 1.0) * math.hypot(*sizes) / abs(way)
        point = self.pin(row[0], (x, y), self.names[row[1]])
        kind = "follower" if row[6] in _FALSE else "force"
        load = {"type": kind, "force": [way.real, way.imag]}
        self.loads[point] = self.names[row[1]], load
