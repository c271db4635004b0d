"""A figure as data: panels of curves, shades, marks, bars and maps, with names and units. It is drawn by
`page_figures` and by `print_figures`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal, TypeAlias

import numpy as np

from ..text import Units, plain, scales, unit_text
from .lines import Line


@dataclass(frozen=True)
class Axis:
    """What an axis shows; values are in the declared unit, a step between ticks in the unit that is shown."""

    label: str
    unit: str = "1"
    kind: str = ""
    low: float | None = None
    high: float | None = None
    step: float | None = None
    log: bool = False
    names: tuple[str, ...] = ()
    """of places 0, 1, .. from the top down"""
    second: tuple[str, float] | None = None
    """label and factor of the unit beside the one that is shown"""


@dataclass(frozen=True)
class Curve:
    """A line, or the points of one. `look` is a number of the lines in `style`, or the name of another."""

    name: str
    x: Any
    y: Any
    look: int | str = 0
    marker: str = ""
    joined: bool = True
    listed: bool = True
    """in the legend"""


@dataclass(frozen=True)
class Between:
    """The area between two curves."""

    name: str
    x: Any
    low: Any
    high: Any
    look: str = "dark"


@dataclass(frozen=True)
class Shade:
    """A range of one axis, shaded."""

    low: float
    high: float
    name: str = ""
    axis: Literal["x", "y"] = "x"
    look: str = "pale"


@dataclass(frozen=True)
class Mark:
    """A line across the panel; `name` is in the legend, `words` stand beside it."""

    at: float
    name: str = ""
    words: str = ""
    axis: Literal["x", "y"] = "x"
    look: int | str = "mark"
    upright: bool = False
    """whether the words run along the line"""


@dataclass(frozen=True)
class Bars:
    """Lying bars at places of the y axis."""

    name: str
    at: Any
    size: Any
    height: Any
    look: int = 0
    slim: bool = False
    """the dark bar inside another"""
    words: tuple[str, ...] = ()


@dataclass(frozen=True)
class Label:
    """Words at a point of the panel, to its left, its right, above or below."""

    x: float
    y: float
    words: str
    place: Literal["left", "right", "above", "below"] = "right"


@dataclass(frozen=True)
class Field:
    """A map: `z`, shape (len(y), len(x)), in classes between `levels`, which have `names`; the line at the level
    `bold` is drawn."""

    x: Any
    y: Any
    z: Any
    levels: tuple[float, ...]
    names: tuple[str, ...]
    bold: float | None = None


Item: TypeAlias = "Curve | Between | Shade | Mark | Bars | Label | Field"


@dataclass(frozen=True)
class Panel:
    """Axes with what is drawn in them; `equal` gives a metre the same length on both."""

    x: Axis
    y: Axis
    items: tuple[Item, ...]
    title: str = ""
    equal: bool = False


@dataclass(frozen=True)
class Figure:
    """Panels in rows. Those of a column with the same x axis share it, and their cursor; with `level`, those of a row
    share the scale of y.

    `file` names the picture in print. `alt` tells the figure to a reader who does not see it.
    """

    name: str
    title: str
    alt: str
    panels: tuple[tuple[Panel | None, ...], ...]
    caption: Line = ()
    file: str = ""
    heights: tuple[float, ...] = ()
    widths: tuple[float, ...] = ()
    level: bool = False
    half: bool = False
    """whether two stand beside each other on a page"""
    on_page: bool = True
    form: ClassVar[str] = "long"

    def sharing(self, row: int, column: int) -> list[int]:
        """The rows around `row`, one upon the other, whose panels in this column have the x axis of the one in it."""
        panels = [each[column] for each in self.panels]
        own = panels[row]
        if own is None:
            return []
        alike = [panel is not None and panel.x == own.x for panel in panels]
        first = max((r + 1 for r in range(row) if not alike[r]), default=0)
        last = next((r for r in range(row, len(panels)) if not alike[r]), len(panels))
        return list(range(first, last))

    def all_panels(self) -> Iterator[tuple[int, int, Panel]]:
        """Row, column and panel of each."""
        for r, row in enumerate(self.panels):
            yield from ((r, c, panel) for c, panel in enumerate(row) if panel is not None)


def stacked(x: Axis, panels: Iterable[tuple[Axis, Iterable[Item]]]) -> tuple[tuple[Panel], ...]:
    """Panels below each other, over the same x."""
    return tuple((Panel(x, y, tuple(items)),) for y, items in panels)


def along(item: Item) -> dict[str, str]:
    """By the name of each field of an item that holds places on an axis, that axis."""
    match item:
        case Curve() | Label() | Field():
            return {"x": "x", "y": "y"}
        case Between():
            return {"x": "x", "low": "y", "high": "y"}
        case Shade():
            return {"low": item.axis, "high": item.axis}
        case Mark():
            return {"at": item.axis}
        case Bars():
            return {"size": "x"}


def in_units(figure: Figure, units: Units) -> Figure:
    """The same with all values in the units in which they are shown; its axes name them."""
    cache: dict[tuple[int, float, float], Any] = {}

    def values(axis: Axis, x: Any) -> Any:
        """Values on an axis; the same object for the same object, so that curves over one x stay so."""
        _, factor, offset = scales(axis.unit, axis.kind, units)[0]
        key = (id(x), factor, offset)
        if key not in cache:
            scaled = factor * np.asarray(x, float) + offset
            # x is kept, so that no other object gets its identity
            cache[key] = float(scaled) if scaled.ndim == 0 else scaled, x
        return cache[key][0]

    def panel(original: Panel) -> Panel:
        axes = {"x": original.x, "y": original.y}
        items = (
            replace(item, **{name: values(axes[on], getattr(item, name)) for name, on in along(item).items()})
            for item in original.items
        )
        ends = (
            replace(axis, low=axis.low and values(axis, axis.low), high=axis.high and values(axis, axis.high))
            for axis in axes.values()
        )
        x, y = (_named(axis, units) for axis in ends)
        return replace(original, x=x, y=y, items=tuple(items))

    return replace(figure, panels=tuple(tuple(each and panel(each) for each in row) for row in figure.panels))


def _named(axis: Axis, units: Units) -> Axis:
    """An axis whose label has its unit."""
    if axis.names:
        return axis
    (unit, factor, _), *others = scales(axis.unit, axis.kind, units)
    word = plain(unit_text(unit))
    second = (f"{axis.label} [{others[0][0]}]", others[0][1] / factor) if others else None
    return replace(axis, label=f"{axis.label} [{word or '1'}]", unit=word, second=second)
