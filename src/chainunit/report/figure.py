"""A figure as data: panels of curves, shades, marks, bars and maps, with names and units. `page_figures` and
`print_figures` draw it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal, TypeAlias

import numpy as np

from ..reading.text import Units, plain, scales_of_size, unit_text
from .lines import Line


@dataclass(frozen=True)
class Axis:
    """An axis. Values on it are in the declared unit; `step` between ticks is in the unit that is shown."""

    label: str
    unit: str = "1"
    kind: str = ""
    low: float | None = None
    high: float | None = None
    step: float | None = None
    log: bool = False
    ticks: tuple[float, ...] = ()
    """places of the ticks in the unit that is shown, where they do not follow from `step`"""
    names: tuple[str, ...] = ()
    """names of the places 0, 1, .. from the top down, in place of numbers"""
    second: tuple[str, float] | None = None
    """label and factor of the unit beside the one that is shown"""


@dataclass(frozen=True)
class Curve:
    """A curve as a line, as points, or as both. `look` is the number of a line in `style`, or the name of a look."""

    name: str
    x: Any
    y: Any
    look: int | str = 0
    marker: str = ""
    has_line: bool = True
    in_legend: bool = True
    """whether its name stands in the legend"""


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
    """A shaded range of one axis."""

    low: float
    high: float
    name: str = ""
    axis: Literal["x", "y"] = "x"
    look: str = "pale"


@dataclass(frozen=True)
class Mark:
    """A line across the panel at one value of an axis; `name` stands in the legend, `words` beside the line."""

    at: float
    name: str = ""
    words: str = ""
    axis: Literal["x", "y"] = "x"
    look: int | str = "mark"
    upright: bool = False
    """whether the words run along the line"""


@dataclass(frozen=True)
class Bars:
    """Horizontal bars at places of the y axis."""

    name: str
    at: Any
    size: Any
    height: Any
    look: int = 0
    slim: bool = False
    """whether they are the dark bars inside others"""
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
    """A map of `z`, shape (len(y), len(x)), in classes between neighbouring `levels`. `names` are the names of
    the classes; the line at the level `bold` is drawn."""

    x: Any
    y: Any
    z: Any
    levels: tuple[float, ...]
    names: tuple[str, ...]
    bold: float | None = None


@dataclass(frozen=True)
class Hatch:
    """Hatched cells of a map, such as those without values: `cells`, shape (len(y) - 1, len(x) - 1), says which cells
    between the lines `x` and `y` they are. Each `look` is another direction of the lines."""

    name: str
    x: Any
    y: Any
    cells: Any
    look: int = 0


Item: TypeAlias = "Curve | Between | Shade | Mark | Bars | Label | Field | Hatch"


@dataclass(frozen=True)
class Panel:
    """Two axes and the items that are drawn in them; with `equal`, a metre has the same length on both axes."""

    x: Axis
    y: Axis
    items: tuple[Item, ...]
    title: str = ""
    equal: bool = False


@dataclass(frozen=True)
class Figure:
    """Panels in rows. Panels of a column that have the same x axis share this axis and the cursor; with `level`, the
    panels of a row share the scale of y.

    `file` is the name of the picture in print. `alt` describes the figure to a reader who does not see it.
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
    """whether two such figures stand beside each other on a page"""
    on_page: bool = True
    form: ClassVar[str] = "long"

    @property
    def row_heights(self) -> tuple[float, ...]:
        """The height of each row over the usual one."""
        return self.heights or (1.0,) * len(self.panels)

    @property
    def column_widths(self) -> tuple[float, ...]:
        """The width of each column over that of the others."""
        return self.widths or (1.0,) * len(self.panels[0])

    @property
    def has_titles(self) -> bool:
        """Whether a panel has a title."""
        return any(panel.title for _, _, panel in self.all_panels())

    @property
    def has_names(self) -> bool:
        """Whether an upright axis has names in place of numbers."""
        return any(panel.y.names for _, _, panel in self.all_panels())

    def sharing(self, row: int, column: int) -> list[int]:
        """The unbroken rows around `row` in which the panel of this column has the same x axis as that of `row`."""
        panels = [panel_row[column] for panel_row in self.panels]
        reference = panels[row]
        if reference is None:
            return []
        alike = [panel is not None and panel.x == reference.x for panel in panels]
        first = max((r + 1 for r in range(row) if not alike[r]), default=0)
        last = next((r for r in range(row, len(panels)) if not alike[r]), len(panels))
        return list(range(first, last))

    def all_panels(self) -> Iterator[tuple[int, int, Panel]]:
        """Row, column and panel, for each panel."""
        for r, row in enumerate(self.panels):
            yield from ((r, c, panel) for c, panel in enumerate(row) if panel is not None)


def stacked(x: Axis, panels: Iterable[tuple[Axis, Iterable[Item]]]) -> tuple[tuple[Panel], ...]:
    """Panels below each other over the same x axis: a row for each y axis with its items."""
    return tuple((Panel(x, y, tuple(items)),) for y, items in panels)


def along(item: Item) -> dict[str, str]:
    """The fields of an item whose values lie along an axis, each with its axis, x or y."""
    match item:
        case Curve() | Label() | Field() | Hatch():
            return {"x": "x", "y": "y"}
        case Between():
            return {"x": "x", "low": "y", "high": "y"}
        case Shade():
            return {"low": item.axis, "high": item.axis}
        case Mark():
            return {"at": item.axis}
        case Bars():
            return {"size": "x"}


_DIRECTIONS = ((1.0, 1.0), (1.0, -1.0), (0.0, 1.0), (1.0, 0.0))
"""Normals of the lines of a hatch by its look, in parts of the width and the height of the map."""
_SPACING = 0.035


def hatch_lines(hatch: Hatch) -> tuple[Any, Any]:
    """The lines of a hatch over the true `cells` of a map: x and y of their ends, with NaN between two lines. Within,
    u and v go from 0 to 1 over the map, and t along a line."""
    (x0, x1), (y0, y1) = ((float(e[0]), float(e[-1])) for e in (np.asarray(hatch.x), np.asarray(hatch.y)))
    x, y = (np.asarray(hatch.x) - x0) / (x1 - x0), (np.asarray(hatch.y) - y0) / (y1 - y0)
    a, b = _DIRECTIONS[hatch.look % len(_DIRECTIONS)]
    cells, ends = np.asarray(hatch.cells, bool), list[list[float]]()
    size = a * a + b * b
    for c in np.arange(min(0.0, b) + 0.5 * _SPACING, a + max(0.0, b), _SPACING * size**0.5):
        # the line a u + b v = c from its foot along (-b, a), with its crossings of all lines of the map
        u0, v0 = a * c / size, b * c / size
        cuts = [*((u0 - x) / b if b else ()), *((y - v0) / a if a else ())]
        t = np.unique(np.round(cuts, 12))
        middle = 0.5 * (t[1:] + t[:-1])
        u, v = u0 - b * middle, v0 + a * middle
        column, row = np.searchsorted(x, u) - 1, np.searchsorted(y, v) - 1
        inside = (column >= 0) & (column < len(x) - 1) & (row >= 0) & (row < len(y) - 1)
        drawn = np.zeros(len(middle), bool)
        drawn[inside] = cells[row[inside], column[inside]]
        edges = np.diff(np.concatenate([[False], drawn, [False]]).astype(int))
        for begin, end in zip(np.flatnonzero(edges > 0), np.flatnonzero(edges < 0), strict=True):
            ends.append([t[begin], t[end], u0, v0])
    begins, stops, u_feet, v_feet = np.array(ends).reshape(-1, 4).T
    gaps = np.full(len(begins), np.nan)
    u = np.stack([u_feet - b * begins, u_feet - b * stops, gaps], axis=1).ravel()
    v = np.stack([v_feet + a * begins, v_feet + a * stops, gaps], axis=1).ravel()
    return x0 + (x1 - x0) * u, y0 + (y1 - y0) * v


def in_units(figure: Figure, units: Units) -> Figure:
    """The figure with all values in the units in which they are shown; the labels of its axes name these units. An
    axis has one unit, that of its largest value."""
    sizes = _sizes(figure)
    shown_arrays: dict[tuple[int, float, float], tuple[Any, Any]] = {}

    def shown(x: Any, factor: float, offset: float) -> Any:
        """Values as shown. The same array gives the same array again, so that curves over one x still share it."""
        # with the result stays x, so that no other object gets its identity
        result, _ = shown_arrays.setdefault(
            (id(x), factor, offset), (factor * np.asarray(x, float) + offset, x)
        )
        return float(result) if result.ndim == 0 else result

    def panel(original: Panel, row: int) -> Panel:
        """A panel of that row of the figure, with its items and its axes as shown."""
        axes, scales, items = {"x": original.x, "y": original.y}, {}, []
        for on, axis in axes.items():
            scales[on] = scales_of_size(sizes[_shared(figure, on, axis, row)], axis.unit, axis.kind, units)
        for item in original.items:
            values = {}
            for name, on in along(item).items():
                _, factor, offset = scales[on][0]
                values[name] = shown(getattr(item, name), factor, offset)
            items.append(replace(item, **values))
        x, y = (_with_unit(axis, scales[on]) for on, axis in axes.items())
        return replace(original, x=x, y=y, items=tuple(items))

    rows = enumerate(figure.panels)
    return replace(figure, panels=tuple(tuple(place and panel(place, r) for place in row) for r, row in rows))


def _shared(figure: Figure, on: str, axis: Axis, row: int) -> tuple[Any, ...]:
    """The axes that have one scale have one such key: equal axes in x, and in y of a row that is level."""
    return (on, axis) if on == "x" or not figure.level else (on, row)


def _sizes(figure: Figure) -> dict[tuple[Any, ...], float]:
    """The largest size of a value on each axis, in its declared unit, by the key of the axes that share it."""
    sizes: dict[tuple[Any, ...], float] = {}
    for row, _, panel in figure.all_panels():
        for on, axis in (("x", panel.x), ("y", panel.y)):
            values = [
                np.abs(np.asarray(getattr(item, name), float)).ravel()
                for item in panel.items
                for name, along_axis in along(item).items()
                if along_axis == on
            ]
            values.append(np.abs([x for x in (axis.low, axis.high) if x is not None]))
            table = np.concatenate(values)
            key = _shared(figure, on, axis, row)
            sizes[key] = float(np.max(table[np.isfinite(table)], initial=sizes.get(key, 0.0)))
    return sizes


def _with_unit(axis: Axis, scales: Sequence[tuple[str, float, float]]) -> Axis:
    """The axis with its ends in the unit that is shown, the first of the `scales`, and with the unit in its label."""
    if axis.names:
        return axis
    (unit, factor, offset), *others = scales
    word = plain(unit_text(unit))
    return replace(
        axis,
        label=f"{axis.label} [{word or '1'}]",
        unit=word,
        low=axis.low and factor * axis.low + offset,
        high=axis.high and factor * axis.high + offset,
        second=(f"{axis.label} [{others[0][0]}]", others[0][1] / factor) if others else None,
    )
