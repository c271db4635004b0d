"""A labelled drawing of a linkage machine, as SVG: pins, links and dimensions by their names, the frame, the angles.

The drawing follows from the linkage alone. To find the parameter that is the length of a link or the place of a pin,
each parameter gets a value that no other one has.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise, product
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from ..core.engines import MATH
from ..core.quantities import Layout
from ..groups.driver import Crank
from ..machines.machine import Machine
from ..mechanism.machine import Mechanism
from ..mechanism.sketch import directions
from ..reading.text import number
from . import linkage
from .motion import DrawnLink

WIDTH, HEIGHT, MARGIN, COLUMN = 620.0, 450.0, 60.0, 345.0
"""Width and height of the room for the machine, its margin, and the width of the column of dimensions [px]."""
_LETTER, _LINE = 7.2, 15.0
"""Width of a letter and height of a line of text [px]."""
_DISC = 60.0
"""Radius of a driver that has one point [px]."""
_DASHED = {"fill": "none", "stroke": "#999999", "stroke_dasharray": "4 4"}
_DIMENSION: dict[str, Any] = {"fill": "#c1440e", "font_style": "italic"}
_LOOKS = {"crank": ("#c1440e", 7), "heavy": ("#3d3d3d", 7), "light": ("#0b6fa4", 5)}

Point = tuple[float, float]
Side = tuple[Point, Point]


@dataclass(frozen=True)
class Dimension:
    """A parameter that is a length in the drawing: its name, its description, its value [m]."""

    name: str
    description: str
    value: float


@dataclass
class _Canvas:
    """The pieces of the picture, and the boxes that no further label may cover."""

    pieces: list[str] = field(default_factory=list)
    label_boxes: list[tuple[float, float, float, float]] = field(default_factory=list)

    def add(self, tag: str, text: str = "", **attributes: Any) -> None:
        """Add an element. An underscore in the name of an attribute stands for a hyphen."""
        attribute_texts = (
            f' {name.replace("_", "-")}="{f"{x:.2f}" if isinstance(x, float) else x}"'
            for name, x in attributes.items()
        )
        self.pieces.append(
            f"<{tag}{''.join(attribute_texts)}" + (f">{escape(text)}</{tag}>" if text else "/>")
        )

    def line(self, begin: Point, end: Point, **look: Any) -> None:
        """Add a line."""
        self.add("line", x1=begin[0], y1=begin[1], x2=end[0], y2=end[1], **look)

    def outline(self, tag: str, points: Iterable[Point], **look: Any) -> None:
        """Add a polyline or a polygon."""
        self.add(tag, points=" ".join(f"{x:.2f},{y:.2f}" for x, y in points), **look)

    def label(
        self,
        text: str,
        places: list[Point],
        lines: list[Side] | None = None,
        own_lines: Collection[Side] = (),
        **look: Any,
    ) -> None:
        """Add a label. `places` are the candidates for its middle: it gets the first one that is clear of other
        labels and of the `lines`, before others one that is nearest to its `own_lines`, else the one with most
        room."""
        boxes = [_box(text, place) for place in places]
        nearest, nearest_own = _from_lines(boxes, lines or ()), _from_lines(boxes, own_lines)
        clear = []
        for box, room in zip(boxes, nearest, strict=True):
            gaps = [_gap(box, other) for other in self.label_boxes]
            clear.append(min(*gaps, room, box[0] - 4.0, WIDTH + COLUMN - box[2]))
        free = [k for k, room in enumerate(clear) if room >= 3.0]
        beside = (k for k in free if own_lines and nearest_own[k] <= nearest[k])
        best = next(beside, free[0] if free else int(np.argmax(clear)))
        self.label_boxes.append(boxes[best])
        x, y = places[best]
        self.add("text", text, x=x, y=y + 4.5, text_anchor="middle", **look)


def _box(text: str, middle: Point) -> tuple[float, float, float, float]:
    half = 0.5 * _LETTER * len(text) + 1.0
    return (middle[0] - half, middle[1] - 0.5 * _LINE, middle[0] + half, middle[1] + 0.5 * _LINE)


def _gap(box: tuple[float, ...], other: tuple[float, ...]) -> float:
    """The distance between two boxes [px]; negative where they overlap."""
    return max(box[0] - other[2], other[0] - box[2], box[1] - other[3], other[1] - box[3])


def _from_lines(boxes: Sequence[tuple[float, ...]], lines: Collection[Side]) -> list[float]:
    """The distance of the nearest line from each box, from 25 points of each line [px]; infinite without lines."""
    if not lines:
        return [math.inf] * len(boxes)
    ends = np.array(list(lines), float)
    along = np.linspace(0.0, 1.0, 25)[:, None]
    points = ends[:, None, 0] + along * (ends[:, None, 1] - ends[:, None, 0])
    x, y = points[..., 0], points[..., 1]
    return [
        float(np.min(np.max([box[0] - x, x - box[2], box[1] - y, y - box[3]], axis=0))) - 3.0 for box in boxes
    ]


def dimensions(machine: Machine) -> dict[tuple[str, ...], Dimension]:
    """The parameters that are lengths in the drawing. Keys are ``("link", name)`` for the length of a link,
    ``("point", link, name)`` for the place of a point on a link, and ``("x", pin)`` and ``("y", pin)`` for the place
    of a ground pin. The linkage is made once with a value for each parameter that no other has: a length with this
    value is that parameter."""
    layout, model = machine.model.parameter_layout, machine.model
    variables = {1.0 + k / 7919.0: v for k, v in enumerate(layout.variables)}
    marked_values = layout.from_names({v.name: mark for mark, v in variables.items()})
    marked_linkage = model.linkage(MATH, marked_values, Layout(model.Inputs).from_names({}))
    values = layout.by_name(machine.p)

    def dimension_of(length: Any) -> Dimension | None:
        v = variables.get(abs(float(length)))
        return None if v is None or v.unit != "m" else Dimension(v.name, v.description, values[v.name])

    matches: dict[tuple[str, ...], Dimension | None] = {}
    for group in (marked_linkage.driver, *marked_linkage.groups):
        for bar in group.bars:
            matches["link", bar.name] = dimension_of(getattr(bar, "length", 0.0) or 0.0)
            for name, (s, _) in bar.points.items():
                matches["point", bar.name, name] = dimension_of(s)
    for pin, place in marked_linkage.ground.items():
        matches["x", pin], matches["y", pin] = dimension_of(place.x), dimension_of(place.y)
    return {key: dimension for key, dimension in matches.items() if dimension is not None}


def drawing(machine: Machine, phi: float | None = None) -> str:
    """The machine as an SVG picture, with its driver at the angle `phi` [rad], or the way `phi` [m]; by default a
    sixth of its span from the begin on.

    Where two mirrored organs share a name, such as A1, it stands at both.
    """
    low, high = machine.model.span
    phi = low + (high - low) / (2.0 * math.pi) if phi is None else phi
    whole = machine.drive(phi * machine.ratio)
    orbit = machine.drive(np.linspace(low, high, 73) * machine.ratio)
    crank, canvas, rails = whole.linkage.driver, _Canvas(), linkage.rails(orbit).values()
    xs, ys = (np.atleast_1d(x).tolist() for x in linkage.places(orbit)[crank.end])
    course = [*zip(xs, ys, strict=True)]
    to_page = _scale(
        [*_positions(whole).values(), *course, *(end for rail in rails for end in rail), *_rims(whole)]
    )
    page_points = {name: to_page(place) for name, place in _positions(whole).items()}
    links = [_straightened(link, page_points) for link in linkage.links(whole.linkage)]
    height = HEIGHT + (_TOP if machine.model.layers else 0.0)
    canvas.add("rect", width=WIDTH + COLUMN, height=height, fill="#ffffff", rx=8)
    for rail in rails:
        _rail(canvas, *map(to_page, rail))
    for centre, rim in whole.linkage.circles:
        if centre != rim:
            _circle(canvas, page_points[centre], math.dist(page_points[centre], page_points[rim]))
    for outline in linkage.outlines(whole):
        canvas.outline("polygon", map(to_page, outline), **_DASHED)
    if isinstance(crank, Crank):
        bearing = page_points[crank.bar.pin]
        # a link with its bearing alone, such as a drum or a fan, is a disc of any size; a cam has its profile
        length, outlined = math.dist(bearing, page_points[crank.end]), whole.linkage.outlines.values()
        radius = length or _DISC
        if machine.model.turns and (length or all(outline.pin != crank.bar.pin for outline in outlined)):
            _circle(canvas, bearing, radius)
        else:
            canvas.outline("polyline", map(to_page, course), **_DASHED)
    hanging = linkage.hanging(orbit)
    for pin in linkage.supports(whole.linkage):
        _support(canvas, page_points[pin], -1.0 if pin in hanging else 1.0)
    for link in links:
        colour, weight = _LOOKS[link.look]
        tag, fill = ("polygon", {"fill": "#dfe8ee"}) if link.closed else ("polyline", {"fill": "none"})
        look = {
            "stroke": colour,
            "stroke_width": weight,
            "stroke_linejoin": "round",
            "stroke_linecap": "round",
        }
        canvas.outline(tag, (page_points[joint] for joint in link.joints), **look, **fill)
    for name, (x, y) in page_points.items():
        if (name, name) in whole.linkage.circles:
            canvas.add(
                "circle", cx=x, cy=y, r=13.0, fill="none", stroke="#c1440e", stroke_width=2.5
            )  # a motor
        if any(name in link.joints for link in links):
            canvas.add("circle", cx=x, cy=y, r=4.5, fill="#ffffff", stroke="#1b1b1b", stroke_width=2)
            canvas.label_boxes.append((x - 6, y - 6, x + 6, y + 6))
    for pin, d in directions(whole).items():
        if pin in page_points:
            _block(canvas, page_points[pin], math.atan2(-d.y, d.x))
    if isinstance(crank, Crank):
        _angle(canvas, bearing, phi, radius, math.atan2(crank.start.y, crank.start.x), crank.sense)
    drawn_links = {link.name: link for link in links}
    for symbol, link_name in machine.model.angles.items():
        _swing(canvas, page_points, drawn_links[link_name], symbol)
    sizes = dimensions(machine)
    lines = [side for link in links for side in _sides(link, page_points)]
    lines += _sizes(canvas, sizes, page_points, to_page((0.0, 0.0)), whole, hanging)
    _names(canvas, links, sizes, page_points, lines)
    _frame(canvas)
    _column(canvas, sizes, whole.linkage.ground)
    if machine.model.layers:
        metre = to_page((1.0, 0.0))[0] - to_page((0.0, 0.0))[0]
        _top_view(canvas, machine, links, page_points, metre)
    return _svg(canvas, f"{machine.model.noun}: pins, links and dimensions", height)


def _top_view(
    canvas: _Canvas, machine: Machine, links: list[DrawnLink], page_points: Mapping[str, Point], metre: float
) -> None:
    """Draw the machine from above, below the picture, with its front at the lower edge: links at their places across
    the width, cross-bars where a link lies at both edges, and all others over the width, at most as wide as the room.
    `metre` is the length of a metre [px]."""
    layers, width = machine.model.layers, float(machine.p.width)
    half, middle = 0.5 * min(width * metre, _TOP - 70.0), HEIGHT + 0.5 * _TOP + 6.0
    for link in sorted(links, key=lambda link: link.name in layers):
        xs = [page_points[joint][0] for joint in link.joints]
        places = [middle + half * place for place in layers.get(link.name, ())]
        colour, weight = _LOOKS[link.look]
        if not places:
            size: dict[str, Any] = {"width": max(xs) - min(xs), "height": 2.0 * half, "fill_opacity": 0.12}
            canvas.add("rect", x=min(xs), y=middle - half, **size, fill="#0b6fa4", stroke=colour)
        for x in xs if len(places) > 1 else ():
            canvas.line((x, places[0]), (x, places[-1]), stroke=colour, stroke_width=3)
        for y in places:
            canvas.line((min(xs), y), (max(xs), y), stroke=colour, stroke_width=weight)
    ends = [x for x, _ in page_points.values()]
    for name, y in (("front (1)", middle + half), ("back (-1)", middle - half)):
        canvas.add("text", name, x=max(ends) + 12.0, y=y + 4.0, fill="#1b1b1b")
    shown = number(width, "m", "millimetres", 4, full=False)
    canvas.add("text", f"from above, width {shown}", x=12.0, y=HEIGHT + 16.0, fill="#555555")
    _line(canvas, (min(ends) - 16.0, middle + half), (min(ends) - 16.0, middle - half), "width")


_TOP = 240.0
"""Height of the room for the view from above [px]."""


def _positions(whole: Mechanism) -> dict[str, Point]:
    """The places of pins and points [m]."""
    return {name: (float(x), float(y)) for name, (x, y) in linkage.places(whole).items()}


def _rims(whole: Mechanism) -> Iterator[Point]:
    """Two corners of the square around each circle, and the points of outlines [m]."""
    positions = _positions(whole)
    for centre, rim in whole.linkage.circles:
        (x, y), r = positions[centre], math.dist(positions[centre], positions[rim])
        yield from ((x - r, y - r), (x + r, y + r))
    for outline in linkage.outlines(whole):
        yield from outline


def _circle(canvas: _Canvas, centre: Point, radius: float) -> None:
    canvas.add("circle", cx=centre[0], cy=centre[1], r=radius, **_DASHED)


def _names(
    canvas: _Canvas,
    links: list[DrawnLink],
    sizes: Mapping[tuple[str, ...], Dimension],
    page_points: Mapping[str, Point],
    lines: list[Side],
) -> None:
    """Write the names of pins around them, and those of links, with the symbol of their length, beside them."""
    for name, (x, y) in page_points.items():
        if "." not in name:  # else another name stands at the same place
            around = [(x + 19 * math.cos(t), y + 17 * math.sin(t)) for t in np.arange(-0.8, 5.5, 0.4)]
            canvas.label(_short(name), around, lines, font_weight="bold", fill="#1b1b1b")
    for link in links:
        if len(link.joints) > 1:
            size = sizes.get(("link", link.name))
            text = f"{_short(link.name)} {size.name}" if size else _short(link.name)
            sides = [*_sides(link, page_points)]
            canvas.label(text, [*_beside(link, page_points)], lines, sides, fill=_LOOKS[link.look][0])


def _short(name: str) -> str:
    """The name of a part without its side."""
    return " ".join(word for word in name.replace("_", " ").split() if word not in ("left", "right"))


def _scale(points: list[Point]) -> Any:
    """The function from places in the machine [m] to places in the picture [px], y down."""
    xs, ys = [x for x, _ in points], [y for _, y in points]
    sizes = ((WIDTH, max(xs) - min(xs)), (HEIGHT, max(ys) - min(ys)))
    factor = min(((room - 2.0 * MARGIN) / size for room, size in sizes if size), default=1.0)
    left = 0.5 * (WIDTH - factor * (max(xs) - min(xs)))
    top = 0.5 * (HEIGHT - factor * (max(ys) - min(ys)))
    return lambda p: (left + factor * (p[0] - min(xs)), top + factor * (max(ys) - p[1]))


def _sides(link: DrawnLink, page_points: Mapping[str, Point]) -> Iterator[Side]:
    """The lines between neighbouring joints of a link."""
    joints = (*link.joints, link.joints[0]) if link.closed else link.joints
    yield from pairwise(page_points[joint] for joint in joints)


def _beside(link: DrawnLink, page_points: Mapping[str, Point]) -> Iterator[Point]:
    """Candidate places for the name of a link: the middle of an area, and then places beside the sides, first near
    their middles and close to them."""
    if link.closed:
        x, y = zip(*(page_points[joint] for joint in link.joints), strict=True)
        yield sum(x) / len(x), sum(y) / len(y)
    sides = [*_sides(link, page_points)]
    for share, distance, ((x0, y0), (x1, y1)) in product(
        (0.5, 0.4, 0.6, 0.3, 0.7), (18.0, 26.0, 40.0), sides
    ):
        length = math.hypot(x1 - x0, y1 - y0)
        normals = [((y0 - y1) / length, (x1 - x0) / length)] if length >= 1.0 else _ALL_ROUND
        x_side, y_side = x0 + share * (x1 - x0), y0 + share * (y1 - y0)
        for normal in normals:
            # a name is wide: beside an upright link it stands further off
            off = distance * (1.0 + 1.3 * abs(normal[0]))
            yield from ((x_side + s * off * normal[0], y_side + s * off * normal[1]) for s in (1.0, -1.0))


_ALL_ROUND = [(math.cos(math.pi * x), math.sin(math.pi * x)) for x in (0.5, 0.0, 0.25, 0.75)]
"""Normals beside a block, which has no length, and stands free in any direction."""


def _support(canvas: _Canvas, point: Point, down: float) -> None:
    """Draw the bearing of a ground pin: below the pin, or above it where links hang from it."""
    x, y = point
    canvas.add("polygon", points=f"{x:.2f},{y:.2f} {x - 11:.1f},{y + 17 * down:.1f} {x + 11:.1f},{y + 17 * down:.1f}",
               fill="#ffffff", stroke="#777777", stroke_width=1.5)  # fmt: skip
    foot = y + 17 * down
    for k in range(-14, 14, 6):
        canvas.line((x + k + 5, foot), (x + k, y + 23 * down), stroke="#777777")
    canvas.line((x - 15, foot), (x + 15, foot), stroke="#777777", stroke_width=1.5)
    canvas.label_boxes.append((x - 15, min(y, y + 23 * down), x + 15, max(y, y + 23 * down)))


def _angle(canvas: _Canvas, centre: Point, phi: float, radius: float, zero: float, sense: float) -> None:
    """Draw the crank angle: an arc with an arrow from the direction `zero` [rad], where it is 0; it counts
    counter-clockwise where `sense` is +1."""

    def on_arc(angle: float, r: float) -> Point:
        return centre[0] + r * math.cos(zero + sense * angle), centre[1] - r * math.sin(zero + sense * angle)

    r = min(radius + 14.0, 70.0)
    (x0, y0), (x1, y1) = on_arc(0.0, r), on_arc(phi, r)
    canvas.line(centre, on_arc(0.0, r + 8.0), stroke="#999999", stroke_dasharray="2 3")
    canvas.add("path", d=f"M {x0:.1f} {y0:.1f} A {r:.1f} {r:.1f} 0 0 {int(sense < 0.0)} {x1:.1f} {y1:.1f}",
               fill="none", stroke="#c1440e", stroke_width=1.5, marker_end="url(#drawing-tip)")  # fmt: skip
    for k in range(4):
        x, y = on_arc(phi * k / 3.0, r)
        canvas.label_boxes.append((x - 5, y - 5, x + 5, y + 5))
    canvas.label("φ", [on_arc(0.5 * phi, r + 12.0)], **_DIMENSION)


def _rail(canvas: _Canvas, a: Point, b: Point) -> None:
    """Draw a rail of the ground: two lines along the way of a block, hatched on the outside."""
    length = math.dist(a, b) or 1.0
    along = ((b[0] - a[0]) / length, (b[1] - a[1]) / length)
    across = (-along[1], along[0])
    for side in (9.0, -9.0):
        begin, end = ((p[0] + side * across[0], p[1] + side * across[1]) for p in (a, b))
        canvas.line(begin, end, stroke="#777777", stroke_width=1.5)
        out = math.copysign(6.0, side)
        for k in range(6, int(length), 10):
            x, y = begin[0] + k * along[0], begin[1] + k * along[1]
            tip = x + out * across[0] - 5 * along[0], y + out * across[1] - 5 * along[1]
            canvas.line((x, y), tip, stroke="#777777")


def _block(canvas: _Canvas, centre: Point, angle: float) -> None:
    """Draw a sliding block with its line at this angle in the picture."""
    c, s = math.cos(angle), math.sin(angle)
    corners = [
        (centre[0] + c * x - s * y, centre[1] + s * x + c * y)
        for x, y in ((-13, -7), (13, -7), (13, 7), (-13, 7))
    ]
    canvas.outline("polygon", corners, fill="none", stroke="#1b1b1b", stroke_width=1.5)
    xs, ys = zip(*corners, strict=True)
    canvas.label_boxes.append((min(xs), min(ys), max(xs), max(ys)))


def _frame(canvas: _Canvas) -> None:
    """Draw the axes of the frame in a corner of the picture."""
    x, y = 26.0, HEIGHT - 26.0
    for dx, dy, name in ((34.0, 0.0, "x"), (0.0, -34.0, "y")):
        canvas.line((x, y), (x + dx, y + dy), stroke="#555555", marker_end="url(#drawing-axis)")
        canvas.add("text", name, x=x + 1.35 * dx, y=y + 1.35 * dy + 4, fill="#555555", text_anchor="middle")


def _straightened(link: DrawnLink, page_points: Mapping[str, Point]) -> DrawnLink:
    """The link as it is drawn. A closed link whose pins lie on one line becomes a line from its first pin to the
    furthest one."""
    if not link.closed:
        return link
    (x0, y0), *others = (page_points[joint] for joint in link.joints)
    across = [(x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0) for x1, y1 in others for x2, y2 in others]
    if max(map(abs, across)) > 1.0:
        return link
    joints = sorted(link.joints, key=lambda joint: math.dist(page_points[link.joints[0]], page_points[joint]))
    return replace(link, joints=tuple(joints), closed=False)


def _swing(canvas: _Canvas, page_points: Mapping[str, Point], link: DrawnLink, name: str) -> None:
    """Draw the angle of a link from the downward vertical, positive towards +x."""
    x, y = page_points[link.joints[0]]
    end = page_points[link.joints[-1]]
    r = 0.45 * math.dist((x, y), end)
    angle = math.atan2(end[0] - x, end[1] - y)
    canvas.line((x, y), (x, y + r + 14), stroke="#999999", stroke_dasharray="2 3")
    tip = (x + r * math.sin(angle), y + r * math.cos(angle))
    clockwise = 0 if angle > 0 else 1
    canvas.add("path", d=f"M {x:.1f} {y + r:.1f} A {r:.1f} {r:.1f} 0 0 {clockwise} {tip[0]:.1f} {tip[1]:.1f}",
               fill="none", stroke="#c1440e", stroke_width=1.5)  # fmt: skip
    side = -1.0 if angle > 0 else 1.0
    canvas.label(name, [(x + 10 * side, y + r)], **_DIMENSION)


def _sizes(
    canvas: _Canvas,
    sizes: Mapping[tuple[str, ...], Dimension],
    page_points: Mapping[str, Point],
    origin: Point,
    whole: Mechanism,
    hanging: Collection[str],
) -> list[Side]:
    """Draw the dimensions that are not the length of a link: places of ground pins from the origin of the frame, and
    places of points along a link. Returns their lines."""
    lines: list[Side] = []
    for (kind, *names), size in sizes.items():
        if "." in size.name or kind == "link" or names[-1] not in page_points:
            continue
        if kind == "point":
            link, point = names
            a, b = page_points[whole.topology.links[link][0]], page_points[point]
            length = math.dist(a, b) or 1.0
            off = (-(a[1] - b[1]) / length * 18.0, (a[0] - b[0]) / length * 18.0)
            ends = (a[0] + off[0], a[1] + off[1]), (b[0] + off[0], b[1] + off[1])
        elif kind == "x":
            x, y = page_points[names[0]]
            level = y - 34.0 if names[0] in hanging else y + 62.0
            ends = (origin[0], level), (x, level)
        else:
            x, y = page_points[names[0]]
            ends = (x - 44.0, origin[1]), (x - 44.0, y)
        _line(canvas, *ends, size.name)
        lines.append(ends)
    return lines


def _line(canvas: _Canvas, a: Point, b: Point, name: str) -> None:
    """Draw a dimension: a thin line with an arrow at each end, and its symbol."""
    arrows = {"marker_start": "url(#drawing-begin)", "marker_end": "url(#drawing-end)"}
    canvas.line(a, b, stroke="#777777", stroke_width=0.9, **arrows)
    length = math.dist(a, b) or 1.0
    across = ((b[1] - a[1]) / length * 10.0, (a[0] - b[0]) / length * 10.0)
    middle = (0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]))
    places = [(middle[0] + sign * across[0], middle[1] + sign * across[1]) for sign in (1.0, -1.0)]
    canvas.label(name, places, fill="#555555", font_style="italic")


def _column(canvas: _Canvas, sizes: Mapping[tuple[str, ...], Dimension], ground: Mapping[str, Any]) -> None:
    """Write the dimensions beside the picture, each once, in the order of the drawing. The two coordinates of a
    ground pin that are parameters stand in one row."""
    rows = [
        (size.name, number(size.value, "m", "millimetres", 4, full=False), size.description)
        for size in dict.fromkeys(sizes.values())
        if "." not in size.name
    ]
    for pin, place in ground.items():
        if "." in getattr(sizes.get(("x", pin)), "name", ""):
            x, y = (number(float(size), "m", "millimetres", 4, full=False) for size in (place.x, place.y))
            rows.append((pin, f"{x.removesuffix(' mm')}, {y}", "bearing: x, y in the frame"))
    left, top = WIDTH + 4.0, 40.0
    # beside the longest name there is room for the values
    right = max([116.0, *(7.0 * len(name) + 66.0 for name, _, _ in rows)])
    for name, value, description in rows:
        canvas.add("text", name, x=left, y=top, font_style="italic", fill="#1b1b1b")
        canvas.add("text", value, x=left + right, y=top, text_anchor="end", fill="#1b1b1b")
        for line in textwrap.wrap(description, max(16, 36 - int((right - 116.0) / 6.0))):
            canvas.add("text", line, x=left + right + 10.0, y=top, fill="#555555", font_size="11.5")
            top += 15.0
        top += 7.0


def _svg(canvas: _Canvas, title: str, height: float) -> str:
    """The picture as a text of SVG: the tips of its arrows, and the pieces of the canvas."""
    looks = (("tip", "#c1440e"), ("axis", "#555555"), ("end", "#777777"), ("begin", "#777777"))
    tips = "".join(
        f'<marker id="drawing-{name}" viewBox="0 0 8 8" refX="6" refY="4" markerWidth="7" markerHeight="7" '
        f'orient="{"auto-start-reverse" if name == "begin" else "auto"}">'
        f'<path d="M0 0L8 4L0 8z" fill="{colour}"/></marker>'
        for name, colour in looks
    )
    size = f"{WIDTH + COLUMN:.0f} {height:.0f}"
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size}" role="img" font-family="Helvetica, Arial, '
        f'sans-serif" font-size="13">\n<title>{escape(title)}</title>\n<defs>{tips}</defs>\n'
        + "\n".join(canvas.pieces)
        + "\n</svg>\n"
    )
