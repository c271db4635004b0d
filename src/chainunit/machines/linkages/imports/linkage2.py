"""Files of the program Linkage (`.linkage2`): XML with connectors, links as lists of connectors, and actuators."""

from __future__ import annotations

import math
import re
from xml.etree.ElementTree import Element

from ....core.errors import InputError, shown
from ....core.inputs import xml_of
from ....mechanism.assur import GROUND
from .foreign import ForeignDriver, ForeignGear, ForeignLinkage, ForeignSlot

_MECHANISM = 16
"""Bit of the layer of a mechanism; what has no layer is on it."""


def read(data: bytes, name: str) -> ForeignLinkage:
    """The linkage in the content of a file; `name` is that of the file.

    Raises
    ------
    InputError
        for what is no XML of this program; other faults are collected.
    """
    try:
        root = xml_of(data, name)
    except InputError:
        root = xml_of(_mended(data), name)
    if root.tag != "linkage2":
        raise InputError(f"{name}: begins with {shown(root.tag)}; a file of Linkage begins with <linkage2>")
    return LinkageDrawing([*root])


def _mended(data: bytes) -> bytes:
    """A content that Linkage reads, and no XML: attributes without a space between them, a bare `&`, any letters."""
    text = re.sub(r"&(?!#?\w+;)", "&amp;", data.decode(errors="replace"))
    return re.sub(r'"(?=\w+=")', '" ', text).encode()


class LinkageDrawing(ForeignLinkage):
    """The linkage of one file; connectors and links have `names` by their ids in it. Of connectors that are `drawn`,
    and no part of the mechanism, it has the ids alone."""

    def __init__(self, nodes: list[Element]) -> None:
        super().__init__("Linkage", "mm")
        self.remarks.append('Linkage shows 96 units of a file as an inch: --scale "0.2645833 mm" does so')
        self.names: dict[str, dict[str, str]] = {"connector": {}, "Link": {}}
        drawn = [node for node in nodes if not _is_mechanism(node)]
        self.drawn = {_id(node) for node in drawn if node.tag == "connector"}
        self.remarks += [f"{len(drawn)} connectors and links only draw or measure: left out"] * bool(drawn)
        nodes = [node for node in nodes if _is_mechanism(node)]
        connectors = [node for node in nodes if node.tag == "connector"]
        links = [node for node in nodes if node.tag in ("Link", "element")]
        for read, chosen in (
            (self.connector, connectors), (self.body, links), (self.fasten, (*connectors, *links)),
            (self.slide, connectors), (self.wheels, [ratio for node in nodes for ratio in node.iterfind("ratio")]),
        ):  # fmt: skip
            for node in chosen:
                read(_title(node), node)

    def connector(self, title: str, node: Element) -> None:
        """A connector: a pin, which may be fixed, and may be the input; above 0 its speed is clockwise."""
        if _id(node) in self.names["connector"]:
            self.fault(title, "stands there twice; give each connector an id of its own")
            return
        place = self.numbers(title, [node.get("x", ""), node.get("y", "")])
        pin = self.pin(f"C{_id(node)}", place, *[GROUND] * (node.get("anchor") == "true"))
        self.names["connector"][_id(node)] = pin
        if node.get("input") == "true":
            keys = ("rpm", "15"), ("limitangle", "0"), ("startoffset", "0")
            speed, limit, offset = self.numbers(title, [node.get(*key) for key in keys])
            span = (-offset, limit - offset) if limit > 0.0 else ()
            self.motor(title, pin, speed > 0.0, speed, *map(math.radians, span))

    def body(self, title: str, node: Element) -> None:
        """A link, or an actuator."""
        pins = self.pins(title, [end for end in node if end.tag in ("connector", "fastenconnector")])
        if node.get("actuator") != "true":
            name = self.link(f"L{_id(node)}")
            self.names["Link"].setdefault(_id(node), name)
            self.links[name].pins += pins
            return
        throw, offset = self.numbers(title, [node.get("throw", ""), node.get("startoffset", "0")])
        if len(pins) != 2 or throw <= 0.0:
            self.fault(title, "is an actuator; it must have two connectors and a throw > 0")
        span = (offset - throw, offset) if node.get("cpm", "").startswith("-") else (-offset, throw - offset)
        self.drivers.append(ForeignDriver(title, tuple(pins), span=span))

    def pins(self, title: str, ends: list[Element]) -> list[str]:
        """The pins of connectors; a missing one is a fault, if it is not fastened or drawn alone."""
        names = {_id(end): self.names["connector"].get(_id(end), "") for end in ends}
        for end in ends:
            is_drawn = end.tag == "fastenconnector" or (end.tag == "connector" and _id(end) in self.drawn)
            if not names[_id(end)] and not is_drawn:
                self.fault(title, f"names connector {_id(end)}, which is not in the mechanism of the file")
        return [name for name in names.values() if name]

    def fasten(self, title: str, node: Element) -> None:
        """A connector or a link that is fastened to another link, or to an anchor: a connector becomes a pin of that
        link, and a link one body with it."""
        link_id = node.get("fastenlink") or node.get("fasten") or ""
        link = self.names["Link"].get(link_id)
        if self.names["connector"].get(node.get("fastenconnector", "")) in self.links[GROUND].pins:
            link = GROUND
        is_connector = node.tag == "connector"
        name = self.names["connector" if is_connector else "Link"].get(_id(node))
        if not link or not name:
            if link_id or node.get("fastenconnector"):
                self.fault(title, "is fastened, but not to a link of the file; fasten it to one")
        elif is_connector:
            self.links[link].pins.append(name)
        else:
            self.fastened.append((name, link))

    def slide(self, title: str, node: Element) -> None:
        """A connector that slides between two others of one link."""
        line = self.pins(title, node.findall("slidelimit")[:2])
        if len(line) < 2 or node.get("slider") != "true":
            return
        tracks = [name for name, link in self.links.items() if {*line} <= {*link.pins}]
        if not tracks or self.numbers(title, [node.get("slideradius", "0")])[0] != 0.0:
            wrong = "along an arc" if tracks else "between two connectors that share no link"
            self.fault(title, f"slides {wrong}; only a straight slot of one link is carried over")
            return
        pin = self.names["connector"][_id(node)]
        self.slots.append(ForeignSlot(title, pin, tracks[-1], (line[0], line[1])))

    def wheels(self, _: str, node: Element) -> None:
        """Two wheels of gears or of a chain."""
        ends = node.findall("link")
        title = " and ".join(f"Link {_id(end)}" for end in ends)
        links = [self.names["Link"].get(_id(end), "") for end in ends]
        sizes = self.numbers(title, [end.get("size", "") for end in ends])
        if len(links) != 2 or not all(links) or min(sizes) <= 0.0:
            self.fault(
                title, "are wheels of a gear or a chain; they must be two links of the file with sizes > 0"
            )
            return
        has_radii = node.get("sizeassize") == "true"
        self.gears.append(ForeignGear(title, links, sizes, node.get("type") == "chain", has_radii))


def _is_mechanism(node: Element) -> bool:
    """Whether an element is a part of the mechanism, and no drawing or measurement."""
    layer = node.get("layer", "0")[:9]
    on_layer = not layer.isdecimal() or int(layer) == 0 or bool(int(layer) & _MECHANISM)
    return on_layer and node.get("measurementelement") != "true"


def _id(node: Element) -> str:
    return node.get("id", "0").strip()[:20]


def _title(node: Element) -> str:
    return f"{'connector' if node.tag == 'connector' else 'Link'} {_id(node)}"
