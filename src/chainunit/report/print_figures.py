"""A figure in print, by matplotlib: a PNG in the folder of the page."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from ..reading.text import Units
from . import figure as fig
from .lines import capital
from .page_figures import classes
from .style import BARS, FILLS, HATCHES, INK, canvas, class_colours, draw, look_of, styled

_ROW, _COLUMN = 2.5, 4.3  # of a panel [in]
_LETTERS = 11.5  # of a title, to an inch
_WHITE = {"facecolor": "white", "edgecolor": "none", "pad": 1.0, "alpha": 0.85}
_PLACES: dict[str, tuple[tuple[int, int], str, str]] = {
    "left": ((-8, 0), "right", "center"),
    "right": ((8, 0), "left", "center"),
    "above": ((0, 9), "center", "bottom"),
    "below": ((0, -9), "center", "top"),
}


_SMALL, _NAMED = 0.62, 0.8
"""Size of a figure for a sheet over that of one for a screen, and its height where an axis has names."""
_ROOM = 0.04
"""Room above the largest value of an axis that begins at a given one, relative to the axis."""
_WORDS = 0.75
"""Size of the words beside bars in a small figure over that in one for a screen."""
_LABELS, _NARROW = 8, 6.0
"""Size of the letters of labels in a small figure (the others are as large as in one for a screen), and width [in] up
to which a legend below one panel has two columns."""


def write(figures: Iterable[fig.Figure], folder: Path, units: Units, are_small: bool = False) -> list[Path]:
    """Draw every figure that has a file into `folder`; returns the files. If they `are_small`, they have few
    centimetres on paper."""
    size = _SMALL if are_small else 1.0
    plots = {figure.file: partial(_figure, figure, units, size) for figure in figures if figure.file}
    return draw(plots, folder, {"axes.labelsize": _LABELS} if are_small else None)


def drawn(figure: fig.Figure, units: Units) -> Any:
    """The figure as one of matplotlib, as large as for a screen."""
    with styled():
        return _figure(figure, units)


def contours(x: Any, y: Any, z: Any, level: float) -> list[Any]:
    """The lines along which `z`, shape (len(y), len(x)), equals `level`, each as its points, shape (n, 2). The
    longest comes first. No line runs through NaN."""
    lines = canvas().subplots().contour(x, y, np.ma.masked_invalid(z), levels=[level]).allsegs[0]
    return sorted(lines, key=len, reverse=True)


def _figure(spec: fig.Figure, units: Units, size: float = 1.0) -> Any:
    """The figure drawn by matplotlib, `size` times as large as usual."""
    figure = fig.in_units(spec, units)
    rows, columns = len(figure.panels), len(figure.panels[0])
    heights, widths = figure.row_heights, figure.column_widths
    width = size * 8.2 if columns == 1 else 1.0 + _COLUMN * columns
    height = 1.2 + (_ROW if rows > 1 else 3.2) * sum(heights) + (0.3 * rows if figure.has_titles else 0.0)
    height *= max(size, _NAMED) if figure.has_names else size
    drawing = canvas(figsize=(width, height))
    axes = drawing.subplots(rows, columns, squeeze=False, height_ratios=heights, width_ratios=widths)
    places = {(r, c) for r, c, _ in figure.all_panels()}
    for place in np.ndindex(rows, columns):
        if place not in places:
            axes[place].remove()
    for r, c, panel in figure.all_panels():
        sharing = figure.sharing(r, c)
        if r > sharing[0]:
            axes[r, c].sharex(axes[sharing[0], c])
        if figure.level and c and (r, 0) in places:
            axes[r, c].sharey(axes[r, 0])
        for item in panel.items:
            _draw(axes[r, c], item, size)
    # scales come last: axes that share one need the items of all their panels
    for r, c, panel in figure.all_panels():
        sharing = figure.sharing(r, c)
        _dress(axes[r, c], panel, last=r == sharing[-1], first=r == sharing[0])
        if size < 1.0:
            # rows are lower than the titles of their axes are long: the unit has a line of its own
            axes[r, c].set_ylabel(axes[r, c].get_ylabel().replace(" [", "\n["))
    _legend(drawing, axes, columns)
    drawing.suptitle(fill(capital(figure.title), int(_LETTERS * drawing.get_figwidth())))
    return drawing


def _legend(drawing: Any, axes: Any, columns: int) -> None:
    """One legend below all panels, each name once."""
    entries: dict[str, Any] = {}
    for axis in axes.flat:
        if axis.figure is not None:
            handles, labels = axis.get_legend_handles_labels()
            for handle, label in zip(handles, labels, strict=True):
                entries.setdefault(label, handle)
    if entries:
        most = 3 if drawing.get_figwidth() > _NARROW else 2
        count = min(len(entries), most if columns == 1 else 2 + columns)
        drawing.legend(entries.values(), entries.keys(), loc="outside lower center", ncols=count, fontsize=9)


def _dress(axis: Any, panel: fig.Panel, *, last: bool, first: bool) -> None:
    """Set scales, labels and title of a panel; `last` and `first` in the column that shares its x axis."""
    _scale(axis, panel.x, "x")
    _scale(axis, panel.y, "y")
    if last:
        axis.set_xlabel(panel.x.label)
    else:
        axis.tick_params(which="both", labelbottom=False)
    axis.set_ylabel("" if panel.y.names else panel.y.label)
    if panel.equal:
        axis.set_aspect("equal", adjustable="datalim")
    if panel.title:
        axis.set_title(panel.title, fontsize=10)
    if first and panel.x.second is not None:
        label, ratio = panel.x.second
        above = axis.secondary_xaxis("top", functions=(lambda v: v * ratio, lambda v: v / ratio))
        above.set_xlabel(label)


def _scale(axis: Any, spec: fig.Axis, side: str) -> None:
    """Set scale, range and ticks of one side ("x" or "y") of the axes of a panel."""
    matplotlib_axis = getattr(axis, f"{side}axis")
    if spec.names:
        matplotlib_axis.set_ticks(range(len(spec.names)), list(spec.names))
        getattr(axis, f"set_{side}lim")(len(spec.names) - 0.45, -0.55)
        axis.grid(axis=side, visible=False)
        return
    if spec.log:
        getattr(axis, f"set_{side}scale")("log")
        matplotlib_axis.set_major_formatter(lambda v, _: f"{v:g}")
        matplotlib_axis.set_minor_formatter(lambda v, _: f"{v:g}" if f"{v:e}"[0] in "25" else "")
    else:
        axis.ticklabel_format(axis=side, useOffset=False)
    if spec.low is not None or spec.high is not None:
        getattr(axis, f"set_{side}lim")(spec.low, spec.high)
        low, high = getattr(axis, f"get_{side}lim")()
        largest = getattr(axis.dataLim, f"interval{side}")[1]
        if spec.high is None and not spec.log and np.isfinite(largest):
            # a curve that hardly changes is not on the edge
            getattr(axis, f"set_{side}lim")(low, max(high, largest + _ROOM * (largest - low)))
    if spec.ticks:
        matplotlib_axis.set_ticks(list(spec.ticks))
    elif spec.step is not None and spec.low is not None and spec.high is not None:
        matplotlib_axis.set_ticks(np.arange(spec.low, spec.high + 0.5 * spec.step, spec.step))


def _name(axis: Any, name: str) -> str | None:
    """A name for the legend, once for each panel."""
    return name if name and name not in axis.get_legend_handles_labels()[1] else None


def _draw(axis: Any, item: fig.Item, size: float = 1.0) -> None:
    """Draw an item of a panel."""
    match item:
        case fig.Curve():
            look = look_of(item.look) | ({} if item.has_line else {"linestyle": ""})
            hollow = (
                {"marker": item.marker, "markersize": 5.0, "markerfacecolor": "white"} if item.marker else {}
            )
            axis.plot(item.x, item.y, label=item.name if item.in_legend else None, **look, **hollow)
        case fig.Between():
            hatch = "--" if item.look == "hatched" else None
            style = {"facecolor": FILLS[item.look], "edgecolor": INK, "linewidth": 0.5, "hatch": hatch}
            axis.fill_between(item.x, item.low, item.high, label=item.name or None, **style)
        case fig.Shade():
            span = axis.axvspan if item.axis == "x" else axis.axhspan
            style = {"facecolor": FILLS[item.look], "linewidth": 0.0, "zorder": 0}
            span(item.low, item.high, label=_name(axis, item.name), **style)
        case fig.Mark():
            draw_line = axis.axvline if item.axis == "x" else axis.axhline
            draw_line(item.at, label=_name(axis, item.name), **look_of(item.look))
            if item.words and item.axis == "x":
                top = {"xycoords": ("data", "axes fraction"), "textcoords": "offset points", "fontsize": 8}
                if item.upright:  # inside: above there may be a second scale
                    style = {"rotation": 90, "ha": "right", "va": "top", "zorder": 6}
                    axis.annotate(item.words, (item.at, 1.0), (-1.0, -3.0), **top, **style)
                else:
                    axis.annotate(item.words, (item.at, 1.0), (0.0, 3.0), **top, ha="center", va="bottom")
        case fig.Bars():
            _bars(axis, item, size)
        case fig.Label():
            offset, ha, va = _PLACES[item.place]
            style = {"ha": ha, "va": va, "fontsize": 9, "bbox": _WHITE, "zorder": 6}
            axis.annotate(item.words, (item.x, item.y), offset, textcoords="offset points", **style)
        case fig.Field():
            _field(axis, item)
        case fig.Hatch():
            style = {"color": HATCHES[item.look % len(HATCHES)], "linewidth": 0.9}
            axis.plot(*fig.hatch_lines(item), label=_name(axis, item.name), **style)


def _bars(axis: Any, bars: fig.Bars, size: float) -> None:
    """Draw horizontal bars."""
    look = BARS[bars.look % len(BARS)]
    lying = axis.barh(
        bars.at, bars.size, bars.height, label=bars.name or None, edgecolor=INK, linewidth=0.6,
        color=INK if bars.slim else look["color"], hatch=None if bars.slim else look["hatch"],
    )  # fmt: skip
    if bars.words:
        # the words of two bars of one name stand below each other
        axis.bar_label(lying, bars.words, padding=4, fontsize=8 * max(size, _WORDS))
        axis.margins(x=0.22)


def _field(axis: Any, field: fig.Field) -> None:
    """Draw a map of classes, with a line around the bold level."""
    shades = class_colours(len(field.names))
    z = np.ma.masked_invalid(classes(field))
    axis.contourf(field.x, field.y, z, levels=range(len(field.levels)), colors=shades)
    if field.bold is not None and np.nanmax(field.z) > field.bold:
        axis.contour(field.x, field.y, z, levels=[field.levels.index(field.bold)], colors=INK, linewidths=1.3)
    for name, shade in zip(field.names, shades, strict=True):
        axis.scatter([], [], marker="s", s=80, facecolor=shade, edgecolor=INK, label=name)
