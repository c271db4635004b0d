"""A figure on a page, by plotly: to zoom into, with one cursor for all panels of a column."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import plotly.graph_objects as go  # type: ignore[import-untyped]

from ..text import Units, plain, scales, unit_text
from .figure import Axis, Bars, Between, Curve, Field, Figure, Item, Label, Mark, Panel, Shade
from .style import BARS, CLASSES, FILLS, INK, look_of

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
_TEMPLATE = go.layout.Template(
    layout={
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
)
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


def height(figure: Figure) -> int:
    """Height on the page [px]."""
    row = _HALF_ROW if figure.half else _ROW
    heights = figure.heights or (1.0,) * len(figure.panels)
    return round(_ENDS + _above(figure) + 18 * (_listed(figure) // 4) + row * sum(heights))


def figure(figure: Figure, units: Units) -> Any:
    """The figure as plotly has it."""
    drawing = _Drawing(figure, units)
    for r, row in enumerate(figure.panels):
        for c, panel in enumerate(row):
            if panel is not None:
                drawing.panel(r, c, panel)
    drawing.figure.update_layout(
        drawing.axes,
        template=_TEMPLATE,
        height=height(figure),
        margin={"l": 64, "r": 16, "t": 34 + _above(figure), "b": 52 + 18 * (_listed(figure) // 4)},
        barmode="overlay",
        hovermode="closest" if any(map(_pointed, _panels(figure))) else "x unified",
        hoversubplots="axis",
    )
    return drawing.figure


def axis_title(axis: Axis, units: Units) -> str:
    """What an axis shows, in which unit."""
    unit = plain(unit_text(scales(axis.unit, axis.kind, units)[0][0]))
    return f"{axis.label} [{unit or '1'}]" if not axis.names else axis.label


def _panels(figure: Figure) -> Iterator[Panel]:
    return (panel for row in figure.panels for panel in row if panel is not None)


def _pointed(panel: Panel) -> bool:
    """Whether its points are told one by one, as x is no running variable."""
    return (
        panel.equal
        or any(isinstance(item, Bars | Field) for item in panel.items)
        or any(
            isinstance(item, Curve) and item.joined and np.any(np.diff(item.x) < 0.0) for item in panel.items
        )
    )


def _above(figure: Figure) -> int:
    """Room for words above the panels [px]."""
    marks = [
        item for panel in _panels(figure) for item in panel.items if isinstance(item, Mark) and item.words
    ]
    titles = any(panel.title for panel in _panels(figure))
    return max(18 if marks else 0, 82 if any(m.upright for m in marks) else 0) + (18 if titles else 0)


def _listed(figure: Figure) -> int:
    """How many names the legend has."""
    names = {getattr(item, "name", "") for panel in _panels(figure) for item in panel.items}
    return len(names - {""})


def _small(x: Any) -> Any:
    # plotly packs arrays as they are: single precision halves the page
    return np.asarray(x, np.float32)


def _domains(sizes: Iterable[float], gap: float) -> list[tuple[float, float]]:
    """Parts of the length 1 for sizes, with gaps between them."""
    shares = np.array(list(sizes), float)
    shares *= (1.0 - gap * (len(shares) - 1)) / shares.sum()
    begins = np.concatenate([[0.0], np.cumsum(shares + gap)])[:-1]
    return [
        (float(begin), float(min(1.0, begin + share))) for begin, share in zip(begins, shares, strict=True)
    ]


class _Drawing:
    """A plotly figure that panels are drawn into."""

    def __init__(self, figure: Figure, units: Units) -> None:
        self.spec, self.units, self.figure = figure, units, go.Figure()
        rows, columns = len(figure.panels), len(figure.panels[0])
        shared = all(
            panel is None or len(figure.sharing(r, c)) == rows
            for r, row in enumerate(figure.panels)
            for c, panel in enumerate(row)
        )
        inner = height(figure) - _ENDS
        self.columns = _domains(figure.widths or (1.0,) * columns, 0.09 if columns > 2 else 0.1)
        heights = figure.heights or (1.0,) * rows
        titles = any(panel.title for panel in _panels(figure))
        self.rows = [
            (1.0 - last, 1.0 - first)
            for first, last in _domains(
                heights, ((22.0 if shared else 66.0) + (22.0 if titles else 0.0)) / inner
            )
        ]
        self.kept = _thin_groups(figure)
        self.x_axes: dict[tuple[int, Axis], str] = {}
        self.y_count = 0
        self.first: dict[int, str] = {}
        self.axes: dict[str, dict[str, Any]] = {}
        self.listed: set[str] = set()

    def panel(self, r: int, c: int, panel: Panel) -> None:
        """Draw a panel into its place."""
        self.y_count += 1
        y = f"y{self.y_count if self.y_count > 1 else ''}"
        x = self.x_axes.setdefault((c, panel.x), f"x{len(self.x_axes) + 1 if self.x_axes else ''}")
        layout = self.axes
        layout.setdefault(_long(x), {}).update(domain=self.columns[c], **self._axis(panel.x, panel, "x"))
        if r == self.spec.sharing(r, c)[-1]:
            layout.setdefault(_long(x), {}).update(anchor=y, title={"text": axis_title(panel.x, self.units)})
        layout.setdefault(_long(y), {}).update(
            domain=self.rows[r], anchor=x, **self._axis(panel.y, panel, "y")
        )
        layout.setdefault(_long(y), {}).update(title={"text": axis_title(panel.y, self.units)})
        if panel.equal:
            layout.setdefault(_long(y), {}).update(scaleanchor=x)
        first = self.first.setdefault(r, y)
        if self.spec.level and first != y:
            layout.setdefault(_long(y), {}).update(matches=first)
        if panel.title:
            self._words(
                f"{x} domain",
                f"{y} domain",
                0.0,
                1.0,
                f"<b>{panel.title}</b>",
                xanchor="left",
                yanchor="bottom",
            )
        for item in panel.items:
            self._draw(item, panel, x, y)

    def _axis(self, axis: Axis, panel: Panel, side: str) -> dict[str, Any]:
        made: dict[str, Any] = {}
        if axis.names:
            return {
                "tickvals": list(range(len(axis.names))), "ticktext": list(axis.names), "showgrid": False,
                "ticks": "", "range": [len(axis.names) - 0.45, -0.55],
            }  # fmt: skip
        if axis.log:
            made |= {"type": "log", "dtick": "D2"}
        if axis.low is not None and axis.high is not None:
            ends = [float(self._values(axis, end)) for end in (axis.low, axis.high)]
            made |= {"range": [float(np.log10(end)) for end in ends] if axis.log else ends}
        elif axis.low == 0.0 and not axis.log:
            made |= {"rangemode": "tozero"}
        elif axis.high is not None or axis.low is not None:
            made |= {
                f"{'max' if axis.low is None else 'min'}allowed": self._values(axis, axis.high or axis.low)
            }
        if axis.step is not None:
            made |= {"dtick": axis.step}
        return made

    def _values(self, axis: Axis, x: Any) -> Any:
        _, factor, offset = scales(axis.unit, axis.kind, self.units)[0]
        return factor * np.asarray(x, float) + offset

    def _words(self, xref: str, yref: str, x: float, y: float, text: str, **more: Any) -> None:
        self.figure.add_annotation(
            x=x, y=y, xref=xref, yref=yref, text=text, showarrow=False, font={"size": 12}, **more
        )

    def _legend(self, name: str) -> dict[str, Any]:
        new = bool(name) and name not in self.listed
        self.listed.add(name)
        return {"name": name or " ", "legendgroup": name, "showlegend": new}

    def _hover(self, axis: Axis) -> str:
        unit = plain(unit_text(scales(axis.unit, axis.kind, self.units)[0][0]))
        return f"%{{y:.4g}} {unit}"

    def _draw(self, item: Item, panel: Panel, x: str, y: str) -> None:
        place = {"xaxis": x, "yaxis": y}
        match item:
            case Curve():
                self._curve(item, panel, place)
            case Between():
                for values, legend in (
                    (item.low, {"name": " ", "showlegend": False}),
                    (item.high, self._legend(item.name)),
                ):
                    self.figure.add_scatter(
                        x=_small(self._values(panel.x, item.x)), y=_small(self._values(panel.y, values)),
                        mode="lines", line={"color": INK, "width": 0.8, "dash": "dot"},
                        fill="tonexty" if values is item.high else None, fillcolor=FILLS[item.look],
                        hovertemplate=self._hover(panel.y), **legend, **place,
                    )  # fmt: skip
            case Shade():
                self._band(item, panel, x, y)
            case Mark():
                self._mark(item, panel, x, y)
            case Bars():
                self._bars(item, panel, place)
            case Label():
                ends = (float(self._values(panel.x, item.x)), float(self._values(panel.y, item.y)))
                if panel.x.log:
                    ends = (float(np.log10(ends[0])), ends[1])
                if panel.y.log:
                    ends = (ends[0], float(np.log10(ends[1])))
                self._words(
                    x, y, *ends, item.words, bgcolor="rgba(255, 255, 255, 0.8)", **_PLACES[item.place]
                )
            case Field():
                self._field(item, panel, place)

    def _curve(self, curve: Curve, panel: Panel, place: dict[str, Any]) -> None:
        kept = self.kept[id(curve.x)] if curve.joined and not curve.marker else slice(None)
        look = look_of(curve.look)
        mode = "+".join(name for name, there in (("lines", curve.joined), ("markers", curve.marker)) if there)
        legend = (
            self._legend(curve.name) if curve.listed else {"name": curve.name or " ", "showlegend": False}
        )
        self.figure.add_scatter(
            x=_small(self._values(panel.x, np.asarray(curve.x)[kept])),
            y=_small(self._values(panel.y, np.asarray(curve.y)[kept])),
            mode=mode,
            line={"color": look["color"], "width": look["linewidth"] + 0.2, "dash": _dash(look["linestyle"])},
            marker={
                "symbol": _MARKERS.get(curve.marker, "circle"),
                "size": 7,
                "line": {"width": 1.4, "color": look["color"]},
            },
            hovertemplate=(
                f"%{{x:.4g}}, {self._hover(panel.y)}" if _pointed(panel) else self._hover(panel.y)
            ),
            **legend,
            **place,
        )

    def _band(self, band: Shade, panel: Panel, x: str, y: str) -> None:
        axis = panel.x if band.axis == "x" else panel.y
        low, high = (float(self._values(axis, end)) for end in (band.low, band.high))
        across = {"x0": low, "x1": high, "y0": 0, "y1": 1, "xref": x, "yref": f"{y} domain"}
        if band.axis == "y":
            across = {"y0": low, "y1": high, "x0": 0, "x1": 1, "yref": y, "xref": f"{x} domain"}
        self.figure.add_shape(
            type="rect", fillcolor=FILLS[band.look], opacity=0.6, line_width=0, layer="below", **across
        )
        if band.name:
            self._sample(band.name, FILLS[band.look], x, y)

    def _sample(self, name: str, colour: str, x: str, y: str) -> None:
        """A name of a shade in the legend."""
        legend = self._legend(name)
        if legend["showlegend"]:
            marker = {"symbol": "square", "size": 12, "color": colour, "line": {"width": 0.8, "color": INK}}
            self.figure.add_scatter(
                x=[None], y=[None], mode="markers", marker=marker, **legend, xaxis=x, yaxis=y
            )

    def _mark(self, mark: Mark, panel: Panel, x: str, y: str) -> None:
        axis, look = (panel.x if mark.axis == "x" else panel.y), look_of(mark.look)
        at = float(self._values(axis, mark.at))
        across = {"x0": at, "x1": at, "y0": 0, "y1": 1, "xref": x, "yref": f"{y} domain"}
        if mark.axis == "y":
            across = {"y0": at, "y1": at, "x0": 0, "x1": 1, "yref": y, "xref": f"{x} domain"}
        style = {"color": look["color"], "width": look["linewidth"], "dash": _dash(look["linestyle"])}
        self.figure.add_shape(type="line", line=style, **across)
        if mark.words and mark.axis == "x":
            turned = {"textangle": -90} if mark.upright else {}
            self._words(x, f"{y} domain", at, 1.0, mark.words, xanchor="center", yanchor="bottom", **turned)
        if mark.name:
            legend = self._legend(mark.name)
            if legend["showlegend"]:
                self.figure.add_scatter(
                    x=[None], y=[None], mode="lines", line=style, **legend, xaxis=x, yaxis=y
                )

    def _bars(self, bars: Bars, panel: Panel, place: dict[str, Any]) -> None:
        look, unit = (
            BARS[bars.look % len(BARS)],
            plain(unit_text(scales(panel.x.unit, panel.x.kind, self.units)[0][0])),
        )
        pattern = {"shape": look["pattern"], "fgcolor": "#666666", "size": 6} if not bars.slim else {}
        colour = INK if bars.slim else look["color"]
        self.figure.add_bar(
            y=np.asarray(bars.at, float), x=_small(self._values(panel.x, bars.size)), orientation="h",
            width=bars.height, marker={"color": colour, "line": {"color": INK, "width": 0.8}, "pattern": pattern},
            text=list(bars.words) or None, textposition="outside" if bars.words else None, cliponaxis=False,
            hovertemplate=f"{bars.name}: %{{x:.4g}} {unit}<extra></extra>",
            **self._legend(bars.name), **place,
        )  # fmt: skip

    def _field(self, field: Field, panel: Panel, place: dict[str, Any]) -> None:
        count = len(field.names)
        shades = [[i / (count - 1), colour] for i, colour in enumerate(CLASSES[:count])]
        common = {
            "x": _small(self._values(panel.x, field.x)), "y": _small(self._values(panel.y, field.y)),
            "z": _small(classes(field)), "showscale": False, "hoverinfo": "skip", **place,
        }  # fmt: skip
        levels = {"start": 1, "end": count - 1, "size": 1}
        self.figure.add_contour(
            **common, colorscale=shades, contours=levels | {"coloring": "fill"}, line={"width": 0}
        )
        if field.bold is not None and np.nanmax(field.z) > field.bold:
            k = field.levels.index(field.bold)
            self.figure.add_contour(
                **common, contours={"start": k, "end": k, "size": 1, "coloring": "none"},
                line={"width": 1.5, "color": INK}, showlegend=False,
            )  # fmt: skip
        for name, colour in zip(field.names, CLASSES, strict=False):
            self._sample(name, colour, place["xaxis"], place["yaxis"])


def classes(field: Field) -> Any:
    """The values of a map on a scale on which its levels are 0, 1, 2, .."""
    inside = np.interp(field.z, field.levels, np.arange(len(field.levels), dtype=float))
    return np.where(np.isfinite(field.z), inside, np.nan)


def _long(axis: str) -> str:
    return f"{axis[0]}axis{axis[1:]}"


def _dash(style: Any) -> str:
    """A dash of matplotlib in plotly's terms."""
    if style in _DASH:
        return _DASH[style]
    return " ".join(f"{2 * length}px" for length in style[1])


def _thin_groups(figure: Figure) -> dict[int, Any]:
    """By the identity of x, which samples to draw of the curves over it."""
    groups: dict[int, list[Curve]] = {}
    for panel in _panels(figure):
        for item in panel.items:
            if isinstance(item, Curve) and item.joined and not item.marker:
                groups.setdefault(id(item.x), []).append(item)
    return {key: thin(curves[0].x, *(curve.y for curve in curves)) for key, curves in groups.items()}


def thin(*signals: Any) -> Any:
    """Which samples to draw: those from which straight lines run within a thousandth of the range of each signal."""
    values = np.array([np.nan_to_num(np.asarray(s, float)) for s in signals])
    values = values / np.array([[np.ptp(s) or 1.0] for s in values])
    tolerance = 1e-3
    kept = _corners(values, tolerance)
    while len(kept) > _MOST:
        tolerance *= 2.0
        kept = _corners(values, tolerance)
    return kept


def _corners(values: Any, tolerance: float) -> Any:
    """Samples of `values`, shape (signals, samples), that a polyline needs to stay within `tolerance` of all."""
    last = values.shape[1] - 1
    kept, todo = {0, last}, [(0, last)]
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
            kept.add(corner)
            todo += [(start, corner), (corner, stop)]
    return np.array(sorted(kept))
