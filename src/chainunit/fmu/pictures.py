"""Pictures of a model from its sketch: the icon of its FMU, and the labelled drawing of its documentation."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from xml.sax.saxutils import escape

from ..core.model import Place, Sketch

_DARK, _DRIVEN = "#1b1b1b", "#b5541c"
_SIZE = 200
"""Width and height of an icon in PNG [px]."""


def icon_svg(sketch: Sketch) -> bytes:
    """The icon as SVG."""
    pieces = [
        f'<rect x="2" y="2" width="96" height="96" rx="6" fill="#ffffff" stroke="{_DARK}" stroke-width="2"/>'
    ]
    positions = _placed(sketch, 100.0, 100.0, 16.0)
    pieces += _lines(sketch, positions, 3.5)
    pieces += _pins(sketch, positions, 3.2, 6.0, 7.0)
    return _svg(100.0, 100.0, pieces, width=_SIZE, height=_SIZE).encode()


def icon_png(sketch: Sketch) -> bytes:
    """The icon of a sketch as PNG, as `icon_svg` draws it."""
    from PIL import Image, ImageDraw

    scale = 4 * _SIZE / 100.0  # drawn larger and reduced: so its lines are smooth
    image = Image.new("RGB", (4 * _SIZE, 4 * _SIZE), "#ffffff")
    draw = ImageDraw.Draw(image)

    def box(x: float, y: float, half: float) -> list[float]:
        return [scale * (x - half), scale * (y - half), scale * (x + half), scale * (y + half)]

    draw.rounded_rectangle(box(50.0, 50.0, 48.0), 6.0 * scale, outline=_DARK, width=round(2 * scale))
    positions = _placed(sketch, 100.0, 100.0, 16.0)
    for name, points in _strokes(sketch, positions):
        colour = _DRIVEN if name == sketch.driven else _DARK
        for x, y in points:  # round ends
            draw.ellipse(box(x, y, 1.75), fill=colour)
        draw.line(
            [(scale * x, scale * y) for x, y in points], fill=colour, width=round(3.5 * scale), joint="curve"
        )
    for name, (x, y) in positions.items():
        if name in sketch.ground:
            corners = [(x - 6, y + 7), (x, y), (x + 6, y + 7), (x - 6, y + 7)]
            draw.polygon(
                [(scale * a, scale * b) for a, b in corners],
                fill="#ffffff",
                outline=_DARK,
                width=round(2 * scale),
            )
        draw.ellipse(box(x, y, 4.2), fill=_DARK)
        draw.ellipse(box(x, y, 2.2), fill="#ffffff")
    file = io.BytesIO()
    image.resize((_SIZE, _SIZE), Image.Resampling.LANCZOS).save(file, "PNG")
    return file.getvalue()


def drawing(sketch: Sketch) -> str:
    """The machine with the names of its pins and links, as SVG."""
    width, height = 640.0, 420.0
    positions = _placed(sketch, width, height, 64.0)
    strokes = list(_strokes(sketch, positions))
    pieces = _lines(sketch, positions, 5.0)
    pieces += _pins(sketch, positions, 4.5, 9.0, 12.0)
    taken = [along for _, points in strokes for a, b in pairwise(points) for along in _between(a, b)]
    taken += [(x, y + 8.0) for name, (x, y) in positions.items() if name in sketch.ground]
    middles = []
    for name, points in strokes:
        a, b = max(pairwise(points), key=lambda ends: math.dist(*ends))
        middles.append((name, (0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])), "#5a5a5a"))
    for name, place, colour in [*((name, place, _DARK) for name, place in positions.items()), *middles]:
        x, y = _clear_place(name, place, taken)
        taken += _between((x - _half(name), y), (x + _half(name), y))
        pieces.append(
            f'<text x="{x:.1f}" y="{y + 5.0:.1f}" text-anchor="middle" font-family="sans-serif" font-size="14" '
            f'fill="{colour}" stroke="#ffffff" stroke-width="3" paint-order="stroke">{escape(name)}</text>'
        )
    return _svg(width, height, pieces)


def _half(text: str) -> float:
    """Half of the width of a label [px]."""
    return 4.0 * len(text)


def _between(a: Place, b: Place) -> list[Place]:
    """Places along a line, at most 8 px apart."""
    n = max(1, math.ceil(math.dist(a, b) / 8.0))
    return [(a[0] + (b[0] - a[0]) * k / n, a[1] + (b[1] - a[1]) * k / n) for k in range(n + 1)]


def _clear_place(text: str, about: Place, taken: Sequence[Place]) -> Place:
    """The middle of a label beside a place: of eight around it the one farthest from all places that are taken."""

    def room(place: Place) -> float:
        beside = _between((place[0] - _half(text), place[1]), (place[0] + _half(text), place[1]))
        return min(math.dist(a, b) for a in beside for b in taken)

    directions = [(math.cos(k * math.pi / 4.0), math.sin(k * math.pi / 4.0)) for k in range(8)]
    places = [(about[0] + (12.0 + _half(text)) * c, about[1] + 16.0 * s) for c, s in directions]
    return max(places, key=room)


def _svg(x: float, y: float, pieces: list[str], **attributes: object) -> str:
    more = "".join(f' {name}="{value}"' for name, value in attributes.items())
    body = "\n".join(pieces)
    return f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {x:g} {y:g}"{more}>\n{body}\n</svg>\n'


def _placed(sketch: Sketch, width: float, height: float, margin: float) -> dict[str, Place]:
    """The pins on a page with x right and y down, as large as they fit within its margin."""
    xs, ys = zip(*sketch.pins.values(), strict=True)
    middle = 0.5 * (min(xs) + max(xs)), 0.5 * (min(ys) + max(ys))
    least = 1e-9
    scale = min(
        (width - 2.0 * margin) / max(max(xs) - min(xs), least),
        (height - 2.0 * margin) / max(max(ys) - min(ys), least),
    )
    return {
        name: (0.5 * width + scale * (x - middle[0]), 0.5 * height - scale * (y - middle[1]))
        for name, (x, y) in sketch.pins.items()
    }


def _strokes(sketch: Sketch, positions: Mapping[str, Place]) -> Iterator[tuple[str, list[Place]]]:
    """Each link with two pins or more, by name, as a line through its pins, closed if there are more than two."""
    for name, pins in sketch.links.items():
        if len(pins) > 1:
            yield name, [positions[pin] for pin in (*pins, *pins[: len(pins) > 2])]


def _pins(
    sketch: Sketch, positions: Mapping[str, Place], radius: float, half: float, height: float
) -> Iterator[str]:
    """The pins, those in the ground with a support of that half width and height."""
    look = f'fill="#ffffff" stroke="{_DARK}" stroke-width="2"'
    for name, (x, y) in positions.items():
        if name in sketch.ground:
            foot = y + height
            yield f'<path d="M{x - half:.1f} {foot:.1f} L{x:.1f} {y:.1f} L{x + half:.1f} {foot:.1f} Z" {look}/>'
        yield f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:g}" {look}/>'


def _lines(sketch: Sketch, positions: Mapping[str, Place], width: float) -> list[str]:
    """The links of a sketch as paths of SVG of a `width`, with the driven one in its own colour."""
    return [
        f'<path d="M{" L".join(f"{x:.1f} {y:.1f}" for x, y in points)}" fill="none" '
        f'stroke="{_DRIVEN if name == sketch.driven else _DARK}" stroke-width="{width:g}" stroke-linecap="round" '
        'stroke-linejoin="round"/>'
        for name, points in _strokes(sketch, positions)
    ]
