"""The error of two rigid bars in place of a hanging chain: the loads at the rocker against the catenary, at rest.

The organ has uniform mass per length, and its wall is as long as web and rocker arm together (l2 = l1 - e, as in the
papers). So its shape depends only on mu = e/l1, zeta = z/z_max and the rocker angle psi, and its loads are
proportional to its weight.
"""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from chainunit import __version__
from chainunit.core.errors import GeometryError
from chainunit.core.quantities import quantity
from chainunit.machines import hanging
from chainunit.reading.results import InUnit, as_data, part, result
from chainunit.report.blocks import Column, Report, Section, Table, TableRow, Text
from chainunit.report.figure import Axis, Curve, Field, Figure, Item, Panel
from chainunit.report.print_figures import contours
from chainunit.study.arrays import stretches
from chainunit.work.progress import Progress

PICTURE = "two_bar_error.png"
MU = tuple(np.round(np.arange(0.30, 0.801, 0.05), 2))
ZETA = tuple(np.round(np.arange(0.15, 0.951, 0.05), 2))
PSI = tuple(math.radians(x) for x in (-12.0, -6.0, 0.0, 6.0, 12.0))
LIMITS = (0.02, 0.05, 0.10)
"""Largest errors in parts of the weight with which two bars count as good."""
_LEVELS = (0.0, 2.0, 5.0, 10.0, 1000.0)
_CLASSES = ("below 2 % of the weight", "2 to 5 %", "5 to 10 %", "above 10 %")
_STRIDE = 2
"""The tables have every second value of mu and zeta."""


@dataclass(frozen=True)
class TwoBarError:
    """The loads R_t and R_n by two bars less the loads of the catenary, in parts of the organ's weight [1], shape
    (mu, zeta, psi); NaN where one of the two does not hang. `load_t` is R_t of the catenary in the same parts."""

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
        """Whether the error stays below the limit at every rocker angle, shape (mu, zeta)."""
        return self.largest < limit

    def good_zeta(self, limit: float) -> list[list[tuple[float, float]]]:
        """For each mu the ranges of zeta, least and largest of the grid, over which the error stays below the
        limit."""
        ends = map(stretches, self.good(limit))
        return [[(float(self.zeta[a]), float(self.zeta[b - 1])) for a, b in each] for each in ends]


def loads(mu: float, zeta: float, psi: float, counts: tuple[int, int] | None) -> tuple[float, float]:
    """R_t and R_n of a left organ in parts of its weight, as `counts` rods in wall and web, or as a catenary.

    Raises
    ------
    GeometryError
        where the organ does not hang.
    """
    wall, web = 1.0, 1.0 - mu
    reach = (zeta * 2.0 * math.sqrt(1.0 - mu) + mu * math.sin(psi), -mu * math.cos(psi))
    weights = (wall / (wall + web), web / (wall + web))
    if counts is None:
        x, y = hanging.catenary((wall, web), weights, reach).last
    else:
        lengths, shares = (np.repeat(np.divide(pair, counts), counts) for pair in ((wall, web), weights))
        x, y = hanging.rods(lengths, shares, reach).last
    return x * math.cos(psi) + y * math.sin(psi), y * math.cos(psi) - x * math.sin(psi)


def two_bar_error(
    progress: Progress = lambda done: None,
    mu: tuple[float, ...] = MU,
    zeta: tuple[float, ...] = ZETA,
    psi: tuple[float, ...] = PSI,
) -> TwoBarError:
    """Compare bars and catenary over the grid; `progress` is called with the completed share of the grid."""
    errors = np.full((3, len(mu), len(zeta), len(psi)), np.nan)
    for i, m in enumerate(mu):
        progress(i / len(mu))
        for (j, z), (k, angle) in itertools.product(enumerate(zeta), enumerate(psi)):
            with contextlib.suppress(GeometryError):
                bars, chain = loads(m, z, angle, (1, 1)), loads(m, z, angle, None)
                errors[:, i, j, k] = bars[0] - chain[0], bars[1] - chain[1], chain[0]
    progress(1.0)
    return TwoBarError(np.array(mu), np.array(zeta), np.array(psi), *errors)


def statement(comparison: TwoBarError) -> list[str]:
    """Sentences on the range in which two bars are good enough."""
    lines = []
    both_hang = np.isfinite(comparison.largest)
    for limit in LIMITS:
        good = comparison.good(limit)
        if not good.any():
            lines.append(
                f"Nowhere in the range are two bars good to {100 * limit:.0f} % of the organ's weight."
            )
            continue
        share = 100.0 * good.sum() / both_hang.sum()
        lines.append(
            f"Two bars are good to {100 * limit:.0f} % of the organ's weight, at rocker angles within "
            f"{math.degrees(comparison.psi.max()):.0f} deg, in {share:.0f} % of the range of mu and zeta."
        )
    middle = int(np.argmin(np.abs(comparison.psi)))
    share = comparison.error_t[:, :, middle] / comparison.load_t[:, :, middle]
    lines.append(
        f"With the rocker in the middle their R_t differs from the catenary's by {100 * np.nanmin(share):.0f} to "
        f"{100 * np.nanmax(share):.0f} % of its value."
    )
    return lines


@result
class ErrorTable:
    """A number over the grid of mu, zeta and psi."""

    numbers: InUnit = part(inline=True)
    description: str = part("the number in words")
    axes: tuple[str, ...] = part("the axes of the grid", default=("mu", "zeta", "psi"))


@result
class TwoBarData:
    """The content of two_bar_error.json."""

    chainunit: str = part("version of chainunit")
    mu: Any = quantity("1", "e/l1, shape (mu,)")
    zeta: Any = quantity("1", "z/z_max, shape (zeta,)")
    psi: Any = quantity("rad", "rocker angle, shape (psi,)")
    error_t: ErrorTable = part("error of R_t")
    error_n: ErrorTable = part("error of R_n")
    load_t: ErrorTable = part("R_t of the catenary")
    good_zeta: Mapping[str, Mapping[str, list[tuple[float, float]]]] = part(
        "by largest error and mu, the ranges of zeta over which two bars are good", unit="1"
    )
    statement: list[str] = part("sentences on the range in which two bars are good enough")


def data_of(comparison: TwoBarError) -> TwoBarData:
    """Every number of a comparison."""

    def table(numbers: Any, words: str) -> ErrorTable:
        return ErrorTable(InUnit(numbers, "1"), f"{words}, over the weight")

    return TwoBarData(
        __version__,
        comparison.mu,
        comparison.zeta,
        comparison.psi,
        table(comparison.error_t, "R_t of two bars less that of the catenary"),
        table(comparison.error_n, "R_n of two bars less that of the catenary"),
        table(comparison.load_t, "R_t of the catenary"),
        {
            f"{100 * limit:.0f} %": {
                f"mu = {mu:.2f}": ranges
                for mu, ranges in zip(comparison.mu, comparison.good_zeta(limit), strict=True)
            }
            for limit in LIMITS
        },
        statement(comparison),
    )


def report(comparison: TwoBarError) -> Report:
    """The report: statement, table and figure."""
    return Report(
        "Two bars against a hanging chain",
        "Errors of the loads R_t and R_n by two bars",
        as_data(data_of(comparison)),
        (),
        (
            Section("statement", "Statement", tuple(Text((line,)) for line in statement(comparison))),
            Section("errors", "Errors", (_table(comparison), _good_table(comparison), _figure(comparison))),
        ),
    )


def _table(comparison: TwoBarError) -> Table:
    """The larger error over the rocker angles."""
    columns = [Column(("mu \\ zeta",)), *(Column((f"{z:.2f}",)) for z in comparison.zeta[::_STRIDE])]
    errors = comparison.largest[::_STRIDE, ::_STRIDE]
    rows = [
        TableRow(((f"{m:.2f}",), *((f"{100.0 * x:.1f}" if np.isfinite(x) else "-",) for x in row)))
        for m, row in zip(comparison.mu[::_STRIDE], errors, strict=True)
    ]
    title = (
        "Largest error of R_t and R_n by two bars, % of the organ's weight, rocker within "
        f'{math.degrees(comparison.psi.max()):.0f} deg; "-": one of the two does not hang'
    )
    return Table(tuple(rows), tuple(columns), (title,))


def _good_table(comparison: TwoBarError) -> Table:
    """The ranges of zeta over which two bars are good, by mu."""

    def words(ranges: list[tuple[float, float]]) -> str:
        ends = (f"{low:.2f} to {high:.2f}" if high > low else f"{low:.2f}" for low, high in ranges)
        return " and ".join(ends) or "nowhere"

    columns = (Column(("mu",)), *(Column((f"zeta, to {100 * limit:.0f} %",)) for limit in LIMITS))
    good = zip(*(comparison.good_zeta(limit) for limit in LIMITS), strict=True)
    rows = [
        TableRow(((f"{mu:.2f}",), *((words(ranges),) for ranges in each)))
        for mu, each in zip(comparison.mu, good, strict=True)
    ]
    step = comparison.zeta[1] - comparison.zeta[0]
    title = (
        "Range of zeta over which two bars are good, % of the organ's weight, rocker within "
        f"{math.degrees(comparison.psi.max()):.0f} deg; zeta from {comparison.zeta[0]:.2f} to "
        f"{comparison.zeta[-1]:.2f} in steps of {step:.2f}"
    )
    return Table(tuple(rows), columns, (title,), numeric=False)


def _figure(comparison: TwoBarError) -> Figure:
    mu, zeta, percent = comparison.mu, comparison.zeta, 100.0 * comparison.largest
    errors: list[Item] = [Field(zeta, mu, percent, _LEVELS, _CLASSES)]
    errors += [Curve("20 %", line[:, 0], line[:, 1], 1) for line in contours(zeta, mu, percent, 20.0)]
    errors.append(Curve("the papers' organ", np.array([0.5]), np.array([0.6]), 1, "o", has_line=False))
    i, j = int(np.argmin(np.abs(mu - 0.6))), int(np.argmin(np.abs(zeta - 0.5)))
    load, error_t, error_n = (x[i, j] for x in (comparison.load_t, comparison.error_t, comparison.error_n))
    loads = (
        Curve("R_t of the catenary", comparison.psi, load),
        Curve("R_t of two bars", comparison.psi, load + error_t, 1),
        Curve("error of R_n by two bars", comparison.psi, error_n, 2),
    )
    within = f"At rocker angles within {math.degrees(comparison.psi.max()):.0f} deg"
    psi, share = Axis("rocker angle psi", "rad"), Axis("share of the weight", kind="percent")
    panels = (
        Panel(Axis("zeta = z/z_max"), Axis("mu = e/l1"), tuple(errors), within),
        Panel(psi, share, loads, f"mu = {mu[i]:g}, zeta = {zeta[j]:g}"),
    )
    return Figure(
        "two-bar-error",
        "Errors of two bars in place of a hanging chain",
        "The larger error of R_t and R_n over zeta and mu, and the loads of the papers' organ over the rocker angle.",
        (panels,),
        file=PICTURE,
        widths=(1.2, 1.0),
    )
