"""Files of the program Linkage (`.linkage2`): XML with connectors, links as lists of connectors, and actuators."""

from __future__ import annotations

from xml.etree.ElementTree import Element

from ....core.errors import InputError, shown
from ....core.inputs import xml_of
from ....mechanism.assur import GROUND
from .foreign import ForeignDriver, ForeignLinkage, ForeignSlot

_MECHANISM = 16
"""Bit of the layer of a mechanism; what has no layer is on it."""
_USUAL_SPEED = "15"
"""[rev/min], without a speed in the file"""


def read(data: bytes, name: str) -> ForeignLinkage:
    """The linkage in the content of a file; `name` is that of the file.

    Raises
    ------
    InputError
        for what is no XML of this program; other faults are collected.
    """
    root = xml_of(data, name)
    if root.tag != "linkage2":
        raise InputError(f"{name}: is <{shown(root.tag)}>; a file of Linkage begins with <linkage2>")
    return _Reader(root).linkage


class _Reader:
    """The reader of one file; connectors and links have names by their ids in it."""

    def __init__(self, root: Element) -> None:
        self.linkage = ForeignLinkage("Linkage", "mm")
        self.connectors: dict[str, str] = {}
        self.links: dict[str, str] = {}
        connectors = [node for node in root if node.tag == "connector" and _is_mechanism(node)]
        links = [node for node in root if node.tag in ("Link", "element") and _is_mechanism(node)]
        for node in connectors:
            self.connector(node)
        for node in links:
            self.link(node)
        for node in (*connectors, *links):
            self.fasten(node)
        for node in connectors:
            if node.get("slider") == "true":
                self.slider(node)
        for ratio in root.iterfind("ratios/ratio"):
            ends = " and ".join(f"Link {_id(end)}" for end in ratio)
            wheels = "gears" if ratio.get("type") == "gears" else "a chain"
            self.linkage.fault(
                ends, f"are joined by {wheels}; only pins, slots and cylinders are carried over"
            )

    def connector(self, node: Element) -> None:
        """A connector: a pin, which may be fixed, and may be the input."""
        title = _title(node)
        if _id(node) in self.connectors:
            self.linkage.fault(title, "stands there twice; give each connector an id of its own")
            return
        x, y = (self.linkage.number(title, axis, node.get(axis, "")) for axis in ("x", "y"))
        pin = self.connectors[_id(node)] = self.linkage.pin(f"C{_id(node)}", (x, y))
        if node.get("anchor") == "true":
            self.linkage.links[GROUND].pins.append(pin)
        if node.get("input") == "true":
            self.linkage.drivers.append(ForeignDriver(title, (pin,)))
            speed = self.linkage.number(title, "rpm", node.get("rpm", _USUAL_SPEED))
            self.linkage.remarks.append(
                f'the drawing turns {pin} at {abs(speed):g} rev/min: --speed "{abs(speed):g} rpm"'
            )

    def link(self, node: Element) -> None:
        """A link, or an actuator."""
        title = _title(node)
        pins = [
            *dict.fromkeys(
                pin for end in node if end.tag.endswith("connector") for pin in self.pins(title, _id(end))
            )
        ]
        if node.get("actuator") == "true":
            throw = self.linkage.number(title, "throw", node.get("throw", ""))
            if len(pins) != 2 or throw <= 0.0:
                self.linkage.fault(title, "is an actuator; it must have two connectors and a throw > 0")
            sign = -1.0 if node.get("cpm", "").strip().startswith("-") else 1.0
            self.linkage.drivers.append(ForeignDriver(title, tuple(pins), throw=sign * throw))
            return
        name = self.linkage.link(f"L{_id(node)}", title)
        self.links.setdefault(_id(node), name)
        self.linkage.links[name].pins += pins

    def pins(self, title: str, *ids: str) -> list[str]:
        """The pins of connectors, if all are in the mechanism."""
        for missing in (name for name in ids if name not in self.connectors):
            self.linkage.fault(title, f"names connector {missing}, which is not in the file")
        return [self.connectors[name] for name in ids] if {*ids} <= {*self.connectors} else []

    def fasten(self, node: Element) -> None:
        """Fasten a connector or a link to a link."""
        link = node.get("fastenlink") or node.get("fasten") or ""
        is_pin = node.tag == "connector"
        own = (self.connectors if is_pin else self.links).get(_id(node))
        if node.get("fastenconnector") or (link and (link not in self.links or own is None)):
            self.linkage.fault(_title(node), "is fastened to something else than a link; fasten it to a link")
        elif link and own and is_pin:
            self.linkage.links[self.links[link]].pins.append(own)
        elif link and own:
            self.linkage.fastened.append((own, self.links[link]))

    def slider(self, node: Element) -> None:
        """A connector that slides between two others of one link."""
        title, limits = _title(node), [_id(limit) for limit in node.iterfind("slidelimit")][:2]
        line = self.pins(title, *limits)
        tracks = [name for name, link in self.linkage.links.items() if {*line} <= {*link.pins}]
        if self.linkage.number(title, "slideradius", node.get("slideradius", "0")) > 0.0:
            self.linkage.fault(title, "slides along an arc; replace it by a link from the centre of the arc")
        elif len(line) == 2 and not tracks:
            self.linkage.fault(
                title, f"slides between connectors {' and '.join(limits)}, which share no link"
            )
        elif len(line) == 2:
            self.linkage.slots.append(
                ForeignSlot(title, self.connectors[_id(node)], tracks[-1], (line[0], line[1]))
            )


def _is_mechanism(node: Element) -> bool:
    layer = node.get("layer", "0")[:9]
    on_layer = not layer.isdecimal() or int(layer) == 0 or bool(int(layer) & _MECHANISM)
    return on_layer and node.get("measurementelement") != "true"


def _id(node: Element) -> str:
    return node.get("id", "0").strip()[:20]


def _title(node: Element) -> str:
    return f"{'connector' if node.tag == 'connector' else 'Link'} {_id(node)}"
