"""What ``chainunit two-bar-error`` leaves behind: numbers, text, a plot, and a table on the terminal."""

from __future__ import annotations

import json
import math
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from rich.console import Console
from rich.table import Table

from ..files import whole
from ..studies.two_bar import TwoBarError, as_dict, statement
from .style import LINES, draw

NUMBERS, TEXT, PLOT = "two_bar_error.json", "two_bar_error.md", "two_bar_error.png"
NAMES = (NUMBERS, TEXT, PLOT)
_LEVELS = (2.0, 5.0, 10.0, 20.0)
_SHOWN = 2
"""every so many values of mu and zeta are in the tables"""


def write(found: TwoBarError, folder: Path) -> list[Path]:
    """Write numbers, text and plot; returns the files."""
    numbers, text = folder / NUMBERS, folder / TEXT
    with whole(numbers) as part:
        part.write_text(json.dumps(as_dict(found), indent=1, allow_nan=False) + "\n", "utf-8")
    drawn = draw({PLOT: partial(_plot, found)}, folder)
    with whole(text) as part:
        part.write_text(markdown(found), "utf-8")
    return [numbers, text, *drawn]


def _cells(found: TwoBarError) -> tuple[list[str], list[list[str]]]:
    """Heads and rows of the larger error over the rocker angles [% of the weight]."""
    heads = ["mu \\ zeta", *(f"{z:.2f}" for z in found.zeta[::_SHOWN])]
    rows = [
        [f"{m:.2f}", *(f"{100.0 * x:.1f}" if np.isfinite(x) else "-" for x in row[::_SHOWN])]
        for m, row in zip(found.mu[::_SHOWN], found.largest[::_SHOWN], strict=True)
    ]
    return heads, rows


def _title(found: TwoBarError) -> str:
    return (
        "Largest error of R_t and R_n by two bars, % of the organ's weight, rocker within "
        f"{math.degrees(found.psi.max()):.0f} deg"
    )


def show(found: TwoBarError, console: Console) -> None:
    """Print the table and where two bars are good enough."""
    heads, rows = _cells(found)
    table = Table(title=_title(found), title_justify="left")
    for head in heads:
        table.add_column(head, justify="right")
    for row in rows:
        table.add_row(*row)
    console.print(table)
    for line in statement(found):
        console.print(line)


def markdown(found: TwoBarError) -> str:
    """Statement, table and plot."""
    heads, rows = _cells(found)
    lines = ["# Two bars against a hanging chain", "", *(f"- {line}" for line in statement(found)), ""]
    lines += [_title(found) + '; "-": one of the two does not hang.', "", f"| {' | '.join(heads)} |"]
    lines += [
        "|---" * len(heads) + "|",
        *(f"| {' | '.join(row)} |" for row in rows),
        "",
        f"![errors]({PLOT})",
    ]
    return "\n".join(lines) + "\n"


def _plot(found: TwoBarError) -> Any:
    figure, (left, right) = plt.subplots(1, 2, figsize=(11.0, 4.8), width_ratios=(1.2, 1.0))
    percent = 100.0 * found.largest
    filled = left.contourf(
        found.zeta, found.mu, percent, levels=(0.0, *_LEVELS, 60.0), cmap="Greys", alpha=0.6, extend="max"
    )
    lines = left.contour(found.zeta, found.mu, percent, levels=_LEVELS, colors="#1b1b1b", linewidths=1.2)
    left.clabel(lines, fmt="%g %%", fontsize=9)
    figure.colorbar(filled, ax=left, label="larger error of R_t and R_n [% of the weight]")
    left.plot(0.5, 0.6, "o", color="#c1440e", markersize=6)
    left.annotate("the papers' organ", (0.5, 0.6), (7, 4), textcoords="offset points", fontsize=9)
    left.set_xlabel("zeta = z/z_max [1]")
    left.set_ylabel("mu = e/l1 [1]")
    left.set_title(f"At rocker angles within {math.degrees(found.psi.max()):.0f} deg")
    i, j = int(np.argmin(np.abs(found.mu - 0.6))), int(np.argmin(np.abs(found.zeta - 0.5)))
    degrees = np.degrees(found.psi)
    right.plot(degrees, 100.0 * found.load_t[i, j], label="R_t of the catenary", **LINES[0])
    right.plot(degrees, 100.0 * (found.load_t + found.error_t)[i, j], label="R_t of two bars", **LINES[1])
    right.plot(degrees, 100.0 * found.error_n[i, j], label="error of R_n by two bars", **LINES[2])
    right.set_xlabel("rocker angle psi [deg]")
    right.set_ylabel("[% of the weight]")
    right.set_title(f"mu = {found.mu[i]:g}, zeta = {found.zeta[j]:g}")
    right.legend(loc="best", fontsize=9)
    return figure
