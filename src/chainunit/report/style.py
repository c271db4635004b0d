"""The look of every plot (matplotlib). Lines differ in dash and weight, too, so that they stay distinct in grey."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ..core.files import atomic_file

STYLE: dict[str, Any] = {
    "font.size": 10,
    "axes.grid": True,
    "grid.alpha": 0.35,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "figure.constrained_layout.use": True,
    "savefig.dpi": 130,
}
LINES = [
    {"color": "#1b1b1b", "linestyle": "-", "linewidth": 1.8},
    {"color": "#c1440e", "linestyle": "--", "linewidth": 1.6},
    {"color": "#0b6fa4", "linestyle": "-.", "linewidth": 1.6},
    {"color": "#6a994e", "linestyle": ":", "linewidth": 2.0},
    {"color": "#7b3f98", "linestyle": (0, (8, 3)), "linewidth": 1.8},
    {"color": "#8a6d00", "linestyle": (0, (8, 3, 2, 3)), "linewidth": 1.8},
    {"color": "#4d4d4d", "linestyle": (0, (1, 3)), "linewidth": 2.4},
    {"color": "#00796b", "linestyle": (0, (6, 2, 1, 2, 1, 2)), "linewidth": 1.8},
]
LOOKS: dict[str, dict[str, Any]] = {
    "mark": {"color": "#555555", "linestyle": "--", "linewidth": 1.2},
    "thin": {"color": "#777777", "linestyle": "-", "linewidth": 0.8},
    "limit": {"color": "#777777", "linestyle": "-", "linewidth": 3.0},
    "reference": {"color": "#777777", "linestyle": (0, (6, 2)), "linewidth": 1.2},
    "path": {"color": "#1b1b1b", "linestyle": "-", "linewidth": 1.0},
    "edge": {"color": "#1b1b1b", "linestyle": "-", "linewidth": 2.8},
    "right": {"color": "#1b1b1b", "linestyle": "--", "linewidth": 1.8},
    "printed": {"color": "#c1440e", "linestyle": "-", "linewidth": 0.9},
    "printed right": {"color": "#c1440e", "linestyle": "--", "linewidth": 0.9},
}
"""Looks of lines that have one meaning in every plot."""
INK = "#1b1b1b"
FILLS = {
    "pale": "#ececec",
    "dark": "#a9a9a9",
    "band": "#c8c8c8",
    "hatched": "#e4e4e4",
    "left alarm": "#f3d9cd",
    "right alarm": "#cfe0ee",
}
CLASSES = ("#ffffff", "#d4d4d4", "#9a9a9a", "#4d4d4d")
"""Shades of the classes of a map."""
SEQUENCE = ("#f7fbff", "#dbe9f6", "#bad6eb", "#89bedc", "#539ecd", "#2b7bba", "#0b559f", "#08306b")
"""Shades of a map of more classes, from the least values to the largest."""


def class_colours(count: int) -> tuple[str, ...]:
    """The shades of so many classes of a map, at most those of `SEQUENCE`."""
    return CLASSES[:count] if count <= len(CLASSES) else SEQUENCE[:count]


BARS = (
    {"color": "#ffffff", "pattern": "", "hatch": ""},
    {"color": "#d4d4d4", "pattern": "", "hatch": ""},
    {"color": "#ffffff", "pattern": "/", "hatch": "//"},
    {"color": "#e9c3b2", "pattern": "x", "hatch": "xx"},
    {"color": "#ffffff", "pattern": "|", "hatch": "||"},
    {"color": "#c9dbe6", "pattern": ".", "hatch": ".."},
    {"color": "#ffffff", "pattern": "-", "hatch": "--"},
    {"color": "#d9e4d0", "pattern": "+", "hatch": "++"},
)
HATCHES = ("#c1440e", "#1b1b1b", "#7b3f98", "#8a6d00")
"""Colours of hatched cells of a map; the direction of the lines differs, too."""
WIDE = 30.0
"""The ratio of the largest value to the least from which an axis is logarithmic."""


def look_of(look: int | str) -> dict[str, Any]:
    """Colour, dash and weight of a line, as matplotlib takes them."""
    return LOOKS[look] if isinstance(look, str) else LINES[look % len(LINES)]


def canvas(**options: Any) -> Any:
    """A new figure of matplotlib, of which its list of open figures knows nothing: a script or a notebook keeps its
    own backend."""
    from matplotlib.figure import Figure

    return Figure(**options)


def styled(more: Mapping[str, Any] | None = None) -> Any:
    """The context with the look of every plot, and `more` settings of matplotlib."""
    import matplotlib

    return matplotlib.rc_context({**STYLE, **(more or {})})


def draw(
    plots: Mapping[str, Callable[[], Any]], folder: Path, more: Mapping[str, Any] | None = None
) -> list[Path]:
    """Draw each figure into its file in `folder`, a PNG, with `more` settings of matplotlib; returns the files."""
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    with styled(more):
        for name, make in plots.items():
            figure = make()
            with atomic_file(folder / name) as part:
                figure.savefig(part, format="png")
            files.append(folder / name)
    return files
