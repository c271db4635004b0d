"""A figure as data: panels of curves, shades, marks, bars and maps, with names and units. It is drawn by
`page_figures` and by `print_figures`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Literal, TypeAlias

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

    `file` names the picture in print. `seen` tells the figure to who does not see it.
    """

    name: str
    title: str
    seen: str
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
        """The rows whose panels in this column have the x axis of the one in `row`."""
        panels = [each[column] for each in self.panels]
        own = panels[row]
        return [
            r for r, panel in enumerate(panels) if panel is not None and own is not None and panel.x == own.x
        ]
