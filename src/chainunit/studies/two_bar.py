"""What two rigid bars get wrong about a hanging chain: the loads at the rocker against the catenary, at rest.

An organ of one mass per length, the wall as long as web and rocker arm together (l2 = l1 - e, as in the papers): its
shape depends on mu = e/l1, zeta = z/z_max and the rocker angle psi alone, its loads on its weight.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import __version__
from ..errors import GeometryError
from ..machines import hanging

MU = tuple(np.round(np.arange(0.30, 0.801, 0.05), 2))
ZETA = tuple(np.round(np.arange(0.15, 0.951, 0.05), 2))
PSI = tuple(math.radians(x) for x in (-12.0, -6.0, 0.0, 6.0, 12.0))
LIMITS = (0.02, 0.05, 0.10)
"""Errors in parts of the weight up to which two bars are said to be good."""


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


def statement(found: TwoBarError) -> list[str]:
    """Where two bars are good enough, in words."""
    lines = []
    known = np.isfinite(found.largest)
    for limit in LIMITS:
        good = found.good(limit)
        if not good.any():
            lines.append(
                f"Nowhere in the range are two bars good to {100 * limit:.0f} % of the organ's weight."
            )
            continue
        share = 100.0 * good.sum() / known.sum()
        zetas = [found.zeta[row].min() for row in good if row.any()]
        lines.append(
            f"Two bars are good to {100 * limit:.0f} % of the organ's weight, at rocker angles within "
            f"{math.degrees(found.psi.max()):.0f} deg, in {share:.0f} % of the range of mu and zeta; zeta at least "
            f"{min(zetas):.2f} to {max(zetas):.2f}, by mu."
        )
    middle = int(np.argmin(np.abs(found.psi)))
    share = found.error_t[:, :, middle] / found.load_t[:, :, middle]
    lines.append(
        f"With the rocker in the middle their R_t differs from the catenary's by {100 * np.nanmin(share):.0f} to "
        f"{100 * np.nanmax(share):.0f} % of its value."
    )
    return lines


def as_dict(found: TwoBarError) -> dict[str, Any]:
    """Every number with its unit, ready for JSON."""

    def rows(values: Any) -> Any:
        return (
            [rows(v) for v in values] if np.ndim(values) else (float(values) if np.isfinite(values) else None)
        )

    axes = {"mu": ("1", found.mu), "zeta": ("1", found.zeta), "psi": ("rad", found.psi)}
    tables = {
        "error_t": "R_t of two bars less that of the catenary, over the weight",
        "error_n": "R_n of two bars less that of the catenary, over the weight",
        "load_t": "R_t of the catenary, over the weight",
    }
    return {
        "chainunit": __version__,
        **{name: {"value": rows(x), "unit": unit} for name, (unit, x) in axes.items()},
        **{
            name: {"value": rows(getattr(found, name)), "unit": "1", "description": text, "axes": list(axes)}
            for name, text in tables.items()
        },
        "statement": statement(found),
    }
