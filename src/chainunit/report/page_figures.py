"""A figure on a page, by plotly: the reader can zoom, and all panels of a column share one cursor.

The figures are written as plotly's own JSON: its classes check each property when it is set, which takes a tenth of a
study. The tests have these classes check all figures.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable
from functools import reduce
from itertools import pairwise
from operator import getitem
from textwrap import wrap
from typing import Any

import numpy as np

from ..reading.text import Units
from . import figure as fig
from .style import BARS, FILLS, HATCHES, INK, class_colours, look_of

_AXIS = {
    "gridcolor": "#e4e4e4",
    "zerolinecolor": "#a8a8a8",
    "zerolinewidth": 1,
    "linecolor": "#666666",
    "showline": True,
    "ticks": "outside",
    "tickcolor": "#666666",
    "title": {"standoff": 8, "font": {"size": 13}},
    "automargin": True,
    "exponentformat": "none",
    "separatethousands": True,
}
_TEMPLATE = {
    "layout": {
        "font": {
            "family": "system-ui, 'Segoe UI', Roboto, 'Liberation Sans', Arial, sans-serif",
            "size": 13,
            "color": INK,
        },
        "paper_bgcolor": "#ffffff",
        "plot_bgcolor": "#ffffff",
        "xaxis": _AXIS,
        "yaxis": _AXIS,
        "legend": {"orientation": "h", "x": 0.0, "y": 0.0, "yref": "container", "yanchor": "bottom"},
        "hoverlabel": {"bgcolor": "#ffffff", "font": {"size": 12}},
        "dragmode": "zoom",
        "separators": ".\u202f",
    }
}
_DASH = {"-": "solid", "--": "dash", "-.": "dashdot", ":": "dot"}
_MARKERS = {"o": "circle-open", "s": "square", "+": "cross-thin-open", "x": "x-thin-open", "^": "triangle-up"}
_PLACES: dict[str, dict[str, Any]] = {
    "left": {"xanchor": "right", "yanchor": "middle", "xshift": -8},
    "right": {"xanchor": "left", "yanchor": "middle", "xshift": 8},
    "above": {"xanchor": "center", "yanchor": "bottom", "yshift": 7},
    "below": {"xanchor": "center", "yanchor": "top", "yshift": -7},
}
_MOST = 6000  # samples of a line
_ROW, _HALF_ROW, _ENDS = 250, 190, 75  # heights [px]


_COLUMN = 300
"""Width below which a column of panels is too narrow beside others [px]; then all panels stand below each other."""
_LEAST, _LINE = 430, 40
"""Width below which the title of an axis has lines [px], and the letters of a line."""
_DECADES = 300.0
"""Ratio of the ends of a logarithmic axis from which only powers of ten have ticks."""
_PHONE = 340
"""Width for which the rows of a legend are counted where panels stand below each other [px]."""


def height(figure: fig.Figure) -> int:
    """Height on the page [px]."""
    return round(_ENDS + _above(figure) + _legend_rows(figure) + _row(figure) * sum(figure.row_heights))


def _row(figure: fig.Figure) -> int:
    """Usual height of a row of panels [px]."""
    return _HALF_ROW if figure.half else _ROW


def _gap(figure: fig.Figure, joined: bool) -> float:
    """Room between two panels of a column [px], which is small if they are `joined` by one axis."""
    return (22.0 if joined else 66.0) + (22.0 if figure.has_titles else 0.0)


def page_figure(spec: fig.Figure, units: Units) -> dict[str, Any]:
    """The figure for the script of the page: traces and layout of plotly and, where panels stand beside each other,
    the changes of the layout for a `narrow` box and back to a `wide` one, and the width `below` which a box is
    narrow [px]. On paper a `tall` figure keeps its height, as its rows have names."""
    drawing = _Drawing(fig.in_units(spec, units))
    for place in drawing.spec.all_panels():
        drawing.panel(*place)
    by_point = any(_hovers_by_point(panel) for _, _, panel in spec.all_panels())
    layout: dict[str, Any] = {
        **drawing.axes,
        "template": _TEMPLATE,
        "height": height(spec),
        "margin": {"l": 64, "r": 16, "t": 34 + _above(spec), "b": 52 + _legend_rows(spec)},
        "barmode": "overlay",
        "hovermode": "closest" if by_point else "x unified",
        "hoversubplots": "axis",
    }
    layout |= {"annotations": drawing.annotations} if drawing.annotations else {}
    layout |= {"shapes": drawing.shapes} if drawing.shapes else {}
    shown = {"data": drawing.traces, "layout": layout, "rows": len(spec.panels), "tall": spec.has_names}
    if not (narrow := drawing.narrow()):
        return shown
    wide = {key: reduce(getitem, key.split("."), layout) for key in narrow}
    return shown | {"narrow": narrow, "wide": wide, "below": max(_LEAST, _COLUMN * len(spec.panels[0]))}


def _hovers_by_point(panel: fig.Panel) -> bool:
    """Whether the cursor shows single points of a panel: its x is not a variable that runs from left to right."""
    curves = (item for item in panel.items if isinstance(item, fig.Curve) and item.has_line)
    bars = any(isinstance(item, fig.Bars | fig.Field | fig.Hatch) for item in panel.items)
    return panel.equal or bars or any(bool(np.any(np.diff(curve.x) < 0.0)) for curve in curves)


def _above(figure: fig.Figure) -> int:
    """Room for words above the panels [px]."""
    panels = [panel for _, _, panel in figure.all_panels()]
    marks = [item for panel in panels for item in panel.items if isinstance(item, fig.Mark) and item.words]
    room = 82 if any(mark.upright for mark in marks) else 18 if marks else 0
    return room + (18 if figure.has_titles else 0)


def _legend_rows(figure: fig.Figure, width: float = 0.0) -> int:
    """Room for the second and further rows of the legend [px]; with a `width` [px], as many names stand in a row as
    it takes, else four."""
    items = (item for _, _, panel in figure.all_panels() for item in panel.items)
    names = {getattr(item, "name", "") for item in items} - {""}
    beside = max(1, int(width / (50.0 + 7.0 * max(map(len, names), default=0)))) if width else 4
    return 18 * ((len(names) - (1 if width else 0)) // beside)


def _small(x: Any) -> dict[str, str]:
    """An array as plotly takes it; single precision halves the page."""
    array = np.ascontiguousarray(x, "<f4")
    packed = {"dtype": "f4", "bdata": b64encode(array.tobytes()).decode()}
    return packed | ({"shape": ", ".join(map(str, array.shape))} if array.ndim > 1 else {})


def _domains(sizes: Iterable[float], gap: float) -> list[tuple[float, float]]:
    """The intervals of a length 1 that belong to `sizes`, with gaps between them."""
    shares = np.array(list(sizes), float)
    shares *= (1.0 - gap * (len(shares) - 1)) / shares.sum()
    begins = np.concatenate([[0.0], np.cumsum(shares + gap)])[:-1]
    return [(float(x), float(min(1.0, x + share))) for x, share in zip(begins, shares, strict=True)]


class _Drawing:
    """Traces, shapes and words of the panels that are drawn; the values of `spec` are in the units that are shown."""

    def __init__(self, spec: fig.Figure) -> None:
        self.spec = spec
        self.traces: list[dict[str, Any]] = []
        self.shapes: list[dict[str, Any]] = []
        self.annotations: list[dict[str, Any]] = []
        rows, columns = len(spec.panels), len(spec.panels[0])
        one_axis = all(len(spec.sharing(r, c)) == rows for r, c, _ in spec.all_panels())
        self.columns = _domains(spec.column_widths, 0.12 if columns > 2 else 0.1)
        domains = _domains(spec.row_heights, _gap(spec, one_axis) / (height(spec) - _ENDS))
        self.rows = [(1.0 - last, 1.0 - first) for first, last in domains]
        self.samples = _thin_groups(spec)
        self.x_axes: dict[tuple[int, int], str] = {}
        self.axes: dict[str, dict[str, Any]] = {}
        self.legend_names: set[str] = set()
        self.places: dict[tuple[int, int], tuple[str, str]] = {}

    def narrow(self) -> dict[str, Any]:
        """The changes of the layout for a narrow box: all panels below each other, long titles in two lines; empty
        where nothing changes."""
        spec = self.spec
        titles = {name: self.axes[name]["title"]["text"] for name in map(_long, self.x_axes.values())}
        changes: dict[str, Any] = {
            f"{name}.title.text": "<br>".join(wrap(text, _LINE))
            for name, text in titles.items()
            if len(text) > _LINE
        }
        legend = _legend_rows(spec, _PHONE)
        if len(spec.panels[0]) == 1:
            # panels that are below each other already: only the legend may take more rows
            more = max(0, legend - _legend_rows(spec))
            bottom = {"margin.b": 52 + _legend_rows(spec) + more} if more else {}
            return (changes or bottom) and {"height": height(spec) + more, **bottom, **changes}
        # column by column; the domains of the axes are shares of the height, from the top
        places = sorted(self.places, key=lambda place: (place[1], place[0]))
        sizes = [_row(spec) * min(spec.row_heights[r], 1.1) for r, _ in places]
        gaps = [_gap(spec, self.places[a][0] == self.places[b][0]) for a, b in pairwise(places)]
        room, begin = sum(sizes) + sum(gaps), 0.0
        changes["height"] = round(room + _ENDS + _above(spec) + legend)
        changes["margin.b"] = 52 + legend
        for place, size, gap in zip(places, sizes, (*gaps, 0.0), strict=True):
            x, y = self.places[place]
            changes[f"{_long(x)}.domain"] = [0.0, 1.0]
            ends = 1.0 - (begin + size) / room, 1.0 - begin / room
            changes[f"{_long(y)}.domain"] = [max(0.0, ends[0]), ends[1]]
            begin += size + gap
        return changes

    def panel(self, row: int, column: int, panel: fig.Panel) -> None:
        """Draw a panel into its place, with a y axis of its own and an x axis that the panels below it may share.
        Plotly names axes x, x2, .. and y, y2, .."""
        beside = [y for (other_row, _), (_, y) in self.places.items() if other_row == row]
        sharing = self.spec.sharing(row, column)
        y = f"y{len(self.places) + 1}" if self.places else "y"
        next_x = f"x{len(self.x_axes) + 1}" if self.x_axes else "x"
        x = self.x_axes.setdefault((column, sharing[0]), next_x)
        self.places[row, column] = x, y
        x_axis = self.axes.setdefault(_long(x), {"domain": self.columns[column], **_axis(panel.x)})
        if row == sharing[-1]:
            # the lowest panel has the title
            x_axis |= {"anchor": y, "title": {"text": panel.x.label}}
        y_axis = {"domain": self.rows[row], "anchor": x, **_axis(panel.y), "title": {"text": panel.y.label}}
        if panel.equal:
            y_axis["scaleanchor"] = x
        if self.spec.level and beside:
            y_axis["matches"] = beside[0]
        self.axes[_long(y)] = y_axis
        if panel.title:
            corner = {"xanchor": "left", "yanchor": "bottom"}
            self._words(f"{x} domain", f"{y} domain", 0.0, 1.0, f"<b>{panel.title}</b>", **corner)
        for item in panel.items:
            self._draw(item, panel, x, y)

    def _words(self, xref: str, yref: str, x: float, y: float, text: str, **more: Any) -> None:
        place = {"x": x, "y": y, "xref": xref, "yref": yref}
        self.annotations.append({**place, "text": text, "showarrow": False, "font": {"size": 12}, **more})

    def _trace(self, kind: str, **properties: Any) -> None:
        self.traces.append(
            {name: value for name, value in properties.items() if value is not None} | {"type": kind}
        )

    def _legend(self, name: str, in_legend: bool = True) -> dict[str, Any]:
        """The arguments of a trace that put its name into the legend, once for each name."""
        new = in_legend and bool(name) and name not in self.legend_names
        self.legend_names |= {name} if new else set()
        return {"name": name or " ", "legendgroup": name, "showlegend": new}

    def _draw(self, item: fig.Item, panel: fig.Panel, x: str, y: str) -> None:
        """Draw an item of a panel with the axes `x` and `y`."""
        place = {"xaxis": x, "yaxis": y}
        match item:
            case fig.Curve():
                self._curve(item, panel, place)
            case fig.Between():
                line = {"color": INK, "width": 0.8, "dash": "dot"}
                for values, name, fill in ((item.low, "", None), (item.high, item.name, "tonexty")):
                    self._trace(
                        "scatter",
                        x=_small(item.x), y=_small(values), mode="lines", line=line, fill=fill,
                        fillcolor=FILLS[item.look], hovertemplate=_hover(panel.y), **self._legend(name), **place,
                    )  # fmt: skip
            case fig.Shade():
                colour = FILLS[item.look]
                edge = {"line": {"width": 0}, "layer": "below"}
                area = {"type": "rect", "fillcolor": colour, "opacity": 0.6, **edge}
                self.shapes.append(area | _across(item.axis, item.low, item.high, x, y))
                self._sample(item.name, place, mode="markers", marker=_square(colour))
            case fig.Mark():
                self._mark(item, place)
            case fig.Bars():
                self._bars(item, panel, place)
            case fig.Label():
                at_x = float(np.log10(item.x)) if panel.x.log else float(item.x)
                at_y = float(np.log10(item.y)) if panel.y.log else float(item.y)
                white = {"bgcolor": "rgba(255, 255, 255, 0.8)"}
                self._words(x, y, at_x, at_y, item.words, **white, **_PLACES[item.place])
            case fig.Field():
                self._field(item, place)
            case fig.Hatch():
                self._hatch(item, place)

    def _curve(self, curve: fig.Curve, panel: fig.Panel, place: dict[str, Any]) -> None:
        """Draw a curve; long ones are thinned."""
        samples = self.samples[id(curve.x)] if curve.has_line and not curve.marker else slice(None)
        look = look_of(curve.look)
        mode = "+".join(
            name for name, is_shown in (("lines", curve.has_line), ("markers", curve.marker)) if is_shown
        )
        symbol, edge = _MARKERS.get(curve.marker, "circle"), {"width": 1.4, "color": look["color"]}
        self._trace(
            "scatter",
            x=_small(np.asarray(curve.x)[samples]),
            y=_small(np.asarray(curve.y)[samples]),
            mode=mode,
            line={"color": look["color"], "width": look["linewidth"] + 0.2, "dash": _dash(look["linestyle"])},
            marker={"symbol": symbol, "size": 7, "line": edge},
            hovertemplate=("%{x:.4g}, " if _hovers_by_point(panel) else "") + _hover(panel.y),
            **self._legend(curve.name, curve.in_legend),
            **place,
        )

    def _sample(self, name: str, place: dict[str, Any], **style: Any) -> None:
        """Put the name of an item that is not a trace into the legend."""
        legend = self._legend(name)
        if legend["showlegend"]:
            self._trace("scatter", x=[None], y=[None], **style, **legend, **place)

    def _mark(self, mark: fig.Mark, place: dict[str, Any]) -> None:
        """Draw a line across a panel, with its words."""
        x, y = place["xaxis"], place["yaxis"]
        look = look_of(mark.look)
        style = {"color": look["color"], "width": look["linewidth"], "dash": _dash(look["linestyle"])}
        self.shapes.append({"type": "line", "line": style, **_across(mark.axis, mark.at, mark.at, x, y)})
        if mark.words and mark.axis == "x":
            orientation = {"textangle": -90 if mark.upright else 0, "xanchor": "center", "yanchor": "bottom"}
            self._words(x, f"{y} domain", mark.at, 1.0, mark.words, **orientation)
        self._sample(mark.name, place, mode="lines", line=style)

    def _bars(self, bars: fig.Bars, panel: fig.Panel, place: dict[str, Any]) -> None:
        """Draw horizontal bars."""
        look = BARS[bars.look % len(BARS)]
        pattern = {"shape": look["pattern"], "fgcolor": "#666666", "size": 6} if not bars.slim else {}
        colour = INK if bars.slim else look["color"]
        self._trace(
            "bar",
            y=[float(position) for position in bars.at], x=_small(bars.size), orientation="h", width=bars.height,
            marker={"color": colour, "line": {"color": INK, "width": 0.8}, "pattern": pattern},
            text=list(bars.words) or None, textposition="outside" if bars.words else None, cliponaxis=False,
            hovertemplate=f"{bars.name}: %{{x:.4g}} {panel.x.unit}<extra></extra>",
            **self._legend(bars.name), **place,
        )  # fmt: skip

    def _field(self, field: fig.Field, place: dict[str, Any]) -> None:
        """Draw a map of classes, with a line around the bold level."""
        count, z = len(field.names), _small(classes(field))
        shades = [[i / max(1, count - 1), colour] for i, colour in enumerate(class_colours(count))]
        common = {"x": _small(field.x), "y": _small(field.y), "z": z, "showscale": False, "hoverinfo": "skip"}
        levels = {"start": 1, "end": count - 1, "size": 1, "coloring": "fill"}
        self._trace("contour", **common, **place, colorscale=shades, contours=levels, line={"width": 0})
        if field.bold is not None and np.nanmax(field.z) > field.bold:
            k = field.levels.index(field.bold)
            edge = {"start": k, "end": k, "size": 1, "coloring": "none"}
            line = {"width": 1.5, "color": INK}
            self._trace("contour", **common, **place, contours=edge, line=line, showlegend=False)
        for name, colour in zip(field.names, class_colours(count), strict=True):
            self._sample(name, place, mode="markers", marker=_square(colour))

    def _hatch(self, hatch: fig.Hatch, place: dict[str, Any]) -> None:
        x, y = fig.hatch_lines(hatch)
        line = {"color": HATCHES[hatch.look % len(HATCHES)], "width": 1.0}
        curve = {"x": _small(x), "y": _small(y), "mode": "lines", "line": line, "hoverinfo": "skip"}
        self._trace("scatter", **curve, **self._legend(hatch.name), **place)


def _axis(axis: fig.Axis) -> dict[str, Any]:
    """Range and ticks of an axis."""
    if axis.names:
        ticks = {"tickvals": list(range(len(axis.names))), "ticktext": list(axis.names), "ticks": ""}
        return {**ticks, "showgrid": False, "range": [len(axis.names) - 0.45, -0.55]}
    layout: dict[str, Any] = {"type": "log", "dtick": "D2"} if axis.log else {}
    if axis.log and axis.low and axis.high and axis.high > _DECADES * axis.low:
        layout["dtick"] = 1
    if axis.low is not None and axis.high is not None:
        ends = [axis.low, axis.high]
        layout["range"] = [float(np.log10(end)) for end in ends] if axis.log else ends
    elif axis.low == 0.0 and not axis.log:
        layout["rangemode"] = "tozero"
    if axis.ticks:
        return layout | {"tickvals": list(axis.ticks)}
    return layout | ({} if axis.step is None else {"dtick": axis.step})


def _across(axis: str, low: float, high: float, x: str, y: str) -> dict[str, Any]:
    """The place of a shape that spans a panel across an axis."""
    if axis == "x":
        return {"x0": low, "x1": high, "y0": 0, "y1": 1, "xref": x, "yref": f"{y} domain"}
    return {"y0": low, "y1": high, "x0": 0, "x1": 1, "yref": y, "xref": f"{x} domain"}


def _square(colour: str) -> dict[str, Any]:
    return {"symbol": "square", "size": 12, "color": colour, "line": {"width": 0.8, "color": INK}}


def _hover(axis: fig.Axis) -> str:
    return f"%{{y:.4g}} {axis.unit}"


def classes(field: fig.Field) -> Any:
    """The values of a map on a scale on which its levels are 0, 1, 2, .."""
    place = np.interp(field.z, field.levels, np.arange(len(field.levels), dtype=float))
    return np.where(np.isfinite(field.z), place, np.nan)


def _long(axis: str) -> str:
    return f"{axis[0]}axis{axis[1:]}"


def _dash(style: Any) -> str:
    """A dash of matplotlib in plotly's terms."""
    if style in _DASH:
        return _DASH[style]
    return " ".join(f"{2 * length}px" for length in style[1])


def _thin_groups(figure: fig.Figure) -> dict[int, Any]:
    """The samples to draw of the curves over one x; the key is the identity of x."""
    groups: dict[int, list[fig.Curve]] = {}
    for _, _, panel in figure.all_panels():
        for item in panel.items:
            if isinstance(item, fig.Curve) and item.has_line and not item.marker:
                groups.setdefault(id(item.x), []).append(item)
    return {key: thin(curves[0].x, *(curve.y for curve in curves)) for key, curves in groups.items()}


def thin(*signals: Any) -> Any:
    """The samples to draw: straight lines between them stay within a thousandth of the range of each signal."""
    values = np.array([np.nan_to_num(np.asarray(s, float)) for s in signals])
    values = values / np.array([[np.ptp(s) or 1.0] for s in values])
    tolerance = 1e-3
    samples = _corners(values, tolerance)
    while len(samples) > _MOST:
        tolerance *= 2.0
        samples = _corners(values, tolerance)
    return samples


def _corners(values: Any, tolerance: float) -> Any:
    """Samples of `values`, shape (signals, samples), that a polyline needs to stay within `tolerance` of all."""
    last = values.shape[1] - 1
    samples, todo = {0, last}, [(0, last)]
    while todo:
        start, stop = todo.pop()
        if stop - start < 2:
            continue
        along = np.arange(1, stop - start) / (stop - start)
        chord = values[:, [start]] + (values[:, [stop]] - values[:, [start]]) * along
        off = np.max(np.abs(values[:, start + 1 : stop] - chord), axis=0)
        furthest = int(np.argmax(off))
        if off[furthest] > tolerance:
            corner = start + 1 + furthest
            samples.add(corner)
            todo += [(start, corner), (corner, stop)]
    return np.array(sorted(samples))
