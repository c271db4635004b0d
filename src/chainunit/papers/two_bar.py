"""The error of two rigid bars in place of a hanging chain: the loads at the rocker against the catenary, at rest.

An organ of one mass per length, the wall as long as web and rocker arm together (l2 = l1 - e, as in the papers): its
shape depends on mu = e/l1, zeta = z/z_max and the rocker angle psi alone, its loads on its weight.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from rich.console import Console
from rich.table import Table

from .. import __version__
from ..errors import GeometryError
from ..files import whole
from ..machines import hanging
from ..report.style import LINES, draw

NUMBERS, TEXT, PLOT = "two_bar_error.json", "two_bar_error.md", "two_bar_error.png"
NAMES = (NUMBERS, TEXT, PLOT)
MU = tuple(np.round(np.arange(0.30, 0.801, 0.05), 2))
ZETA = tuple(np.round(np.arange(0.15, 0.951, 0.05), 2))
PSI = tuple(math.radians(x) for x in (-12.0, -6.0, 0.0, 6.0, 12.0))
LIMITS = (0.02, 0.05, 0.10)
"""Errors in parts of the weight up to which two bars are said to be good."""
_LEVELS = (2.0, 5.0, 10.0, 20.0)
_SHOWN = 2
"""every so many values of mu and zeta are in the tables"""


@dataclass(frozen=True)
class TwoBarError:
    """Errors of the loads R_t and R_n by two bars, less those of the catenary, in parts of the organ's weight [1]:
    shape (mu, zeta, psi); NaN where one of the two does not hang. `load_t` is the catenary's R_t in the same
    parts."""

    mu: Any
    zeta: Any
    psi: Any
    """[rad]"""
    error_t: Any
    error_n: Any
    load_t: Any

    @property
    def largest(self) -> Any:
        """The larger error of both loads over the rocker angles, shape (mu, zeta)."""
        return np.max(np.maximum(np.abs(self.error_t), np.abs(self.error_n)), axis=2)

    def good(self, limit: float) -> Any:
        """Where the error stays below the limit at every rocker angle, shape (mu, zeta)."""
        return self.largest < limit


def loads(mu: float, zeta: float, psi: float, counts: tuple[int, int] | None) -> tuple[float, float]:
    """R_t and R_n of a left organ in parts of its weight, as `counts` rods in wall and web, or as a catenary.

    Raises
    ------
    GeometryError
        where it does not hang.
    """
    wall, web = 1.0, 1.0 - mu
    reach = (zeta * 2.0 * math.sqrt(1.0 - mu) + mu * math.sin(psi), -mu * math.cos(psi))
    weights = (wall / (wall + web), web / (wall + web))
    if counts is None:
        x, y = hanging.catenary((wall, web), weights, reach).last
    else:
        lengths, shares = (
            np.repeat([a / n for a, n in zip(pair, counts, strict=True)], counts)
            for pair in ((wall, web), weights)
        )
        x, y = hanging.rods(lengths, shares, reach).last
    return x * math.cos(psi) + y * math.sin(psi), y * math.cos(psi) - x * math.sin(psi)


def two_bar_error(
    mu: tuple[float, ...] = MU,
    zeta: tuple[float, ...] = ZETA,
    psi: tuple[float, ...] = PSI,
    report: Callable[[float], None] = lambda done: None,
) -> TwoBarError:
    """Compare over the grid; `report` is told the share that is done."""
    shape = (len(mu), len(zeta), len(psi))
    error_t, error_n, load_t = (np.full(shape, np.nan) for _ in range(3))
    for i, m in enumerate(mu):
        report(i / len(mu))
        for j, z in enumerate(zeta):
            for k, angle in enumerate(psi):
                try:
                    bars, chain = loads(m, z, angle, (1, 1)), loads(m, z, angle, None)
                except GeometryError:
                    continue
                error_t[i, j, k], error_n[i, j, k] = bars[0] - chain[0], bars[1] - chain[1]
                load_t[i, j, k] = chain[0]
    report(1.0)
    return TwoBarError(np.array(mu), np.array(zeta), np.array(psi), error_t, error_n, load_t)


def statement(comparison: TwoBarError) -> list[str]:
    """Where two bars are good enough, in words."""
    lines = []
    known = np.isfinite(comparison.largest)
    for limit in LIMITS:
        good = comparison.good(limit)
        if not good.any():
            lines.append(
                f"Nowhere in the range are two bars good to {100 * limit:.0f} % of the organ's weight."
            )
            continue
        share = 100.0 * good.sum() / known.sum()
        zetas = [comparison.zeta[row].min() for row in good if row.any()]
        lines.append(
            f"Two bars are good to {100 * limit:.0f} % of the organ's weight, at rocker angles within "
            f"{math.degrees(comparison.psi.max()):.0f} deg, in {share:.0f} % of the range of mu and zeta; "
            f"zeta at least {min(zetas):.2f} to {max(zetas):.2f}, by mu."
        )
    middle = int(np.argmin(np.abs(comparison.psi)))
    share = comparison.error_t[:, :, middle] / comparison.load_t[:, :, middle]
    lines.append(
        f"With the rocker in the middle their R_t differs from the catenary's by {100 * np.nanmin(share):.0f} to "
        f"{100 * np.nanmax(share):.0f} % of its value."
    )
    return lines


def as_dict(comparison: TwoBarError) -> dict[str, Any]:
    """Every number with its unit, ready for JSON."""

    def rows(values: Any) -> Any:
        return (
            [rows(v) for v in values] if np.ndim(values) else (float(values) if np.isfinite(values) else None)
        )

    axes = {"mu": ("1", comparison.mu), "zeta": ("1", comparison.zeta), "psi": ("rad", comparison.psi)}
    tables = {
        "error_t": "R_t of two bars less that of the catenary, over the weight",
        "error_n": "R_n of two bars less that of the catenary, over the weight",
        "load_t": "R_t of the catenary, over the weight",
    }
    return {
        "chainunit": __version__,
        **{name: {"value": rows(x), "unit": unit} for name, (unit, x) in axes.items()},
        **{
            name: {
                "value": rows(getattr(comparison, name)),
                "unit": "1",
                "description": text,
                "axes": list(axes),
            }
            for name, text in tables.items()
        },
        "statement": statement(comparison),
    }


def write(comparison: TwoBarError, folder: Path) -> list[Path]:
    """Write numbers, text and plot; returns the files."""
    numbers, text = folder / NUMBERS, folder / TEXT
    with whole(numbers) as part:
        part.write_text(json.dumps(as_dict(comparison), indent=1, allow_nan=False) + "\n", "utf-8")
    drawn = draw({PLOT: partial(_plot, comparison)}, folder)
    with whole(text) as part:
        part.write_text(markdown(comparison), "utf-8")
    return [numbers, text, *drawn]


def _cells(comparison: TwoBarError) -> tuple[list[str], list[list[str]]]:
    """Heads and rows of the larger error over the rocker angles [% of the weight]."""
    heads = ["mu \\ zeta", *(f"{z:.2f}" for z in comparison.zeta[::_SHOWN])]
    rows = [
        [f"{m:.2f}", *(f"{100.0 * x:.1f}" if np.isfinite(x) else "-" for x in row[::_SHOWN])]
        for m, row in zip(comparison.mu[::_SHOWN], comparison.largest[::_SHOWN], strict=True)
    ]
    return heads, rows


def _title(comparison: TwoBarError) -> str:
    return (
        "Largest error of R_t and R_n by two bars, % of the organ's weight, rocker within "
        f"{math.degrees(comparison.psi.max()):.0f} deg"
    )


def show(comparison: TwoBarError, console: Console) -> None:
    """Print the table and where two bars are good enough."""
    heads, rows = _cells(comparison)
    table = Table(title=_title(comparison), title_justify="left")
    for head in heads:
        table.add_column(head, justify="right")
    for row in rows:
        table.add_row(*row)
    console.print(table)
    for line in statement(comparison):
        console.print(line)


def markdown(comparison: TwoBarError) -> str:
    """Statement, table and plot."""
    heads, rows = _cells(comparison)
    lines = ["# Two bars against a hanging chain", "", *(f"- {line}" for line in statement(comparison)), ""]
    lines += [_title(comparison) + '; "-": one of the two does not hang.', "", f"| {' | '.join(heads)} |"]
    lines += [
        "|---" * len(heads) + "|",
        *(f"| {' | '.join(row)} |" for row in rows),
        "",
        f"![errors]({PLOT})",
    ]
    return "\n".join(lines) + "\n"


def _plot(comparison: TwoBarError) -> Any:
    figure, (left, right) = plt.subplots(1, 2, figsize=(11.0, 4.8), width_ratios=(1.2, 1.0))
    percent = 100.0 * comparison.largest
    filled = left.contourf(
        comparison.zeta,
        comparison.mu,
        percent,
        levels=(0.0, *_LEVELS, 60.0),
        cmap="Greys",
        alpha=0.6,
        extend="max",
    )
    lines = left.contour(
        comparison.zeta, comparison.mu, percent, levels=_LEVELS, colors="#1b1b1b", linewidths=1.2
    )
    left.clabel(lines, fmt="%g %%", fontsize=9)
    figure.colorbar(filled, ax=left, label="larger error of R_t and R_n [% of the weight]")
    left.plot(0.5, 0.6, "o", color="#c1440e", markersize=6)
    left.annotate("the papers' organ", (0.5, 0.6), (7, 4), textcoords="offset points", fontsize=9)
    left.set_xlabel("zeta = z/z_max [1]")
    left.set_ylabel("mu = e/l1 [1]")
    left.set_title(f"At rocker angles within {math.degrees(comparison.psi.max()):.0f} deg")
    i, j = int(np.argmin(np.abs(comparison.mu - 0.6))), int(np.argmin(np.abs(comparison.zeta - 0.5)))
    degrees = np.degrees(comparison.psi)
    right.plot(degrees, 100.0 * comparison.load_t[i, j], label="R_t of the catenary", **LINES[0])
    right.plot(
        degrees, 100.0 * (comparison.load_t + comparison.error_t)[i, j], label="R_t of two bars", **LINES[1]
    )
    right.plot(degrees, 100.0 * comparison.error_n[i, j], label="error of R_n by two bars", **LINES[2])
    right.set_xlabel("rocker angle psi [deg]")
    right.set_ylabel("[% of the weight]")
    right.set_title(f"mu = {comparison.mu[i]:g}, zeta = {comparison.zeta[j]:g}")
    right.legend(loc="best", fontsize=9)
    return figure
