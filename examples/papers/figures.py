"""The papers' figures in their own axes, and five that the papers lack.

Left organ: full lines, right organ: dashed, as in paper 000. Corrected curves are black; curves of the printed
formulas or of the authors' own calculation are orange and thin.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from chainunit.core.engines import numpy_
from chainunit.machines.crank_rocker import longest_crank, parallel_frame, pressure_angle_extremes, swing
from chainunit.report.figure import Axis, Between, Curve, Field, Figure, Item, Label, Mark, Panel
from chainunit.report.print_figures import contours

from . import paper000 as p0
from . import paper001 as p1

_PHI = Axis("crank angle", "rad", low=0.0, high=2.0 * math.pi, step=90.0)
_LOAD = Axis("force / organ weight")
_W = Axis("crank speed", "rad/s")
_RHO, _MU, _ZETA = Axis("rho = r/l"), Axis("mu = e/l1"), Axis("zeta = z/z_max", low=0.0, high=1.0)
_SIDES = (("left", 1.0, 0, "printed"), ("right", -1.0, "right", "printed right"))
"""Name, hand, and looks of the corrected and of the printed curves of an organ."""


def _points(x: Any, y: Any, name: str = "printed") -> Curve:
    return Curve(name, x, y, "printed", "o", has_line=False)


def _figure(name: str, title: str, alt: str, *rows: Iterable[Panel | None], level: bool = False) -> Figure:
    return Figure(name, title, alt, tuple(map(tuple, rows)), file=f"{name}.png", level=level)


def _single(name: str, title: str, alt: str, x: Axis, y: Axis, items: Iterable[Item]) -> Figure:
    return _figure(name, title, alt, (Panel(x, y, tuple(items)),))


def statics() -> Figure:
    """Figs 17-22 of paper 000."""
    psi = np.radians(np.linspace(-12.0, 12.0, 121))
    organs = dict(zip(("left", "right"), p0.statics(psi), strict=True))
    angle = Axis("rocker angle psi", "rad", low=psi[0], high=psi[-1], step=4.0)
    titles = {
        "X": "Fig 17 and 19: X_A2 = X_A1",
        "Y_A2": "Fig 18: Y_A2",
        "Y_A1": "Fig 20: Y_A1",
        "R_n": "Fig 21: R^n",
        "R_t": "Fig 22: R^t",
    }
    panels: list[Panel | None] = []
    for load, title in titles.items():
        items = []
        for side, hand, look, _ in _SIDES:
            hinge = p0.hinge_loading(hand * psi)
            items += [
                Curve(side, psi, getattr(organs[side], load), look),
                Curve(f"{side}, weights in B", psi, getattr(hinge, load), 2 if hand > 0.0 else 3),
            ]
        panels.append(Panel(angle, _LOAD, tuple(items), title))
    return _figure(
        "000-fig17-22-statics",
        "Statics, zeta 0.5, mu 0.6",
        "Loads of both organs at rest over the rocker angle, with the weights at the middles of the rods and in B.",
        panels[:3],
        (*panels[3:], None),
    )


def dynamics() -> Figure:
    """Figs 23-29 of paper 000."""
    phi = np.linspace(0.0, 2.0 * math.pi, 361)
    unit = p0.machine()
    out = unit.forces(phi, 1.0)
    items: dict[str, list[Item]] = {name: [] for name in ("X", "Y_A2", "R_n", "R_t", "X_A1", "Y_A1")}
    for side, hand, look, printed in _SIDES:
        organ, psi = getattr(out, side), hand * out.rocker.psi
        X, Y, R_t = p0.AUTHORS.forces(phi, 1.0, hand)
        authors = {"X": X, "Y_A2": Y, "R_n": p0.on_rocker(X, Y, psi)[0], "R_t": R_t}
        model = vars(p0.of_side(organ, hand, unit)) | {"X_A1": -hand * organ.support.fx / p0.weight(unit)}
        for name, curves in items.items():
            curves.append(Curve(f"{side}, corrected", phi, model[name], look))
            if name in authors:
                curves.append(Curve(f"{side}, as the authors computed it", phi, authors[name], printed))
    titles = ("Fig 23: X_A2", "Fig 24: Y_A2", "Fig 25: R^n", "Fig 26: R^t", "Fig 28: X_A1", "Fig 29: Y_A1")
    panels = [
        Panel(_PHI, _LOAD, tuple(curves), title) for curves, title in zip(items.values(), titles, strict=True)
    ]
    return _figure(
        "000-fig23-29-dynamics",
        "The crank at 1 rad/s",
        "Loads of both organs over a turn of the crank, corrected and as the authors computed them.",
        panels[:3],
        panels[3:],
    )


def resultant() -> Figure:
    """Fig 27 of paper 000."""
    phi = np.linspace(p0.at_extreme("left") - 2.0 * math.pi, p0.at_extreme("right"), 361)
    psi = p0.machine().forces(phi, 1.0).rocker.psi
    return _single(
        "000-fig27-resultant",
        "Fig 27: both organs, crank at 1 rad/s",
        "Resultant of both organs on the rocker from the left to the right extreme.",
        Axis("rocker angle psi, from the left to the right extreme", "rad"),
        Axis("resultant on the rocker / organ weight"),
        [
            Curve("corrected", psi, p0.resultant(p0.CORRECTED, phi, 1.0)),
            Curve("as the authors computed it", psi, p0.resultant(p0.AUTHORS, phi, 1.0), "printed"),
            Mark(0.63, "printed: about 0.63", axis="y", look=3),
        ],
    )


def speeds() -> Figure:
    """Figs 30 and 31 of paper 000."""
    w = np.linspace(10.0, 50.0, 81)
    panels = []
    for title, place, printed in (
        ("Fig 30: left extreme, psi = -8.19 deg", "left", (12.5, 313.4)),
        ("Fig 31: right extreme, psi = 9.06 deg", "right", (1.6, 35.4)),
    ):
        phi = p0.at_extreme(place)
        curves = [
            Curve(name, w, np.abs(p0.loads(by, phi, w)["R_t"]), look)
            for name, by, look in (
                ("as the authors computed it", "authors", "printed"),
                ("corrected, point masses", "model", 0),
                ("corrected, uniform rods", "uniform rods", 2),
            )
        ]
        items = (_points((10.0, 50.0), printed), *curves)
        panels.append(Panel(_W, Axis("|R^t| of the left organ / organ weight", log=True), items, title))
    return _figure(
        "000-fig30-31-speed",
        "R^t at the extremes of the rocker",
        "Tangential load of the left organ at both extremes over the crank speed, corrected and as printed.",
        panels,
    )


def overload() -> Figure:
    """The papers' overload factor, and the ratios of cycle maxima that a drive needs."""
    psi = np.radians(np.linspace(0.4, 12.0, 200))
    left, right = p0.statics(psi)
    speed = np.concatenate([np.linspace(0.05, 15.0, 90), np.linspace(15.5, 50.0, 30)])
    ratios = [
        Curve(
            f"{of} torque", speed, np.array([p0.cycle_factor(f"{of}_torque", w) for w in speed.tolist()]), k
        )
        for k, of in enumerate(("rocker", "crank"))
    ]
    at_rest = Panel(
        Axis("rocker angle psi", "rad"),
        Axis("R_L/(R_L - R_R) at rest", low=0.0, high=18.0),
        (
            Curve("at rest", psi, left.R_t / (left.R_t - right.R_t)),
            _points(psi[-1:], (1.14,), "printed as the maximum: 1.14 at 12 deg"),
        ),
        "It diverges at psi = 0",
    )
    cycles = Panel(
        _W,
        Axis("left organ alone / both, cycle maxima"),
        (*ratios, Mark(1.0, axis="y", look="thin")),
        "Above 6.5 (8.5) rad/s both sides together are heavier",
    )
    return _figure(
        "000-overload-factor",
        "Overload factors",
        "The papers' factor over the rocker angle, and the ratio of cycle maxima over the crank speed.",
        (at_rest, cycles),
    )


def pressure() -> Figure:
    """Fig 7 of paper 001."""
    phi = np.linspace(0.0, 2.0 * math.pi, 721)
    items: list[Item] = [
        Curve(f"rho = {rho}", phi, p1.pressure(rho, phi, p1.FROZEN), look)
        for look, rho in enumerate((0.1, 0.3, 0.5))
    ]
    items.append(
        Curve("rho = 0.5, frame follows rho", phi, p1.pressure(0.5, phi, p1.frame(0.5, "tracking")), 3)
    )
    for limit, look in ((45.0, "mark"), (60.0, "thin")):
        name = f"admissible: {limit:g} deg"
        items += [Mark(math.radians(sign * limit), name, axis="y", look=look) for sign in (1.0, -1.0)]
    return _single(
        "001-fig7-pressure-angle",
        "Fig 7: pressure angle, lam = 2/3, frame frozen at rho0 = 0.3",
        "Pressure angle over a turn of the crank for three rho, with the admissible limits.",
        Axis("crank angle", "rad", low=0.0, high=2.0 * math.pi, step=45.0),
        Axis("pressure angle", "rad", low=-0.5 * math.pi, high=0.5 * math.pi, step=30.0),
        items,
    )


def speed_change() -> Figure:
    """Fig 9 of paper 001."""
    rho = np.linspace(0.05, 0.5, 400)
    return _single(
        "001-fig9-speed-change",
        "Fig 9: K, lam = 2/3",
        "Speed-change coefficient over rho, in the frozen frame and in that which follows rho.",
        _RHO,
        Axis("speed-change coefficient K"),
        [
            Curve("frame frozen at rho0 = 0.3 (Fig 9)", rho, p1.K(rho)),
            Curve("frame follows rho: K = 1", rho, p1.K(rho, "tracking"), 1),
            _points((0.1, 0.5), (0.99, 1.26)),
        ],
    )


def existence() -> Figure:
    """Paper 001, (5), (6) and the third condition, over b/l and rho for three lam."""
    panels = []
    for lam in (2.0 / 3.0, 1.0, 2.0):
        b = np.linspace(max(0.0, abs(lam - 1.0) - 0.2), 1.0 + lam + 0.05, 400)
        limit = np.maximum(longest_crank(numpy_(), 1.0, lam, b), 0.0)
        items = (
            Between("the crank turns", b, np.zeros_like(b), limit),
            Curve("(5)", b, lam - (b - 1.0), 0),
            Curve("(6)", b, lam + (b - 1.0), 1),
            Curve("third: rho <= b/l - lam + 1", b, b - lam + 1.0, 2),
        )
        rho = Axis(_RHO.label, low=0.0, high=1.0)
        panels.append(Panel(Axis("b/l", low=b[0], high=b[-1]), rho, items, f"lam = {lam:.3g}"))
    return _figure(
        "001-existence",
        "Where the crank turns",
        "The three conditions of existence over b/l and rho, for three lam.",
        panels,
        level=True,
    )


def crank_rockers() -> Figure:
    """Swing and pressure angle over rho and lam in the frame with K = 1."""
    xp = numpy_()
    rho, lam = np.linspace(0.02, 0.7, 240), np.linspace(0.15, 2.0, 240)
    r, h = np.meshgrid(rho, lam)
    b = parallel_frame(xp, r, 1.0, h)
    turns = r < longest_crank(xp, 1.0, h, b)
    with np.errstate(invalid="ignore"):
        ends = pressure_angle_extremes(xp, r, 1.0, h, b)
        worst = np.where(turns, np.degrees(np.max(np.abs(ends), axis=0)), np.nan)
        eta = np.where(turns, np.degrees(swing(xp, r, 1.0, h, b)), np.nan)
    field = Field(rho, lam, worst, (0.0, 45.0, 60.0, 90.0), ("admissible", "above 45 deg", "above 60 deg"))
    return _single(
        "001-map",
        "Crank-rockers with K = 1 (b^2 = l^2 - r^2 + h^2); they turn where rho < lam",
        "Lines of equal swing and of equal largest pressure angle over rho and lam.",
        _RHO,
        Axis("lam = h/l"),
        [
            field,
            *_contours(rho, lam, worst, "largest pressure angle", (10.0, 20.0, 30.0, 45.0, 60.0), 0, 0.45),
            *_contours(rho, lam, eta, "swing", (10.0, 17.25, 30.0, 60.0, 90.0, 120.0), 1, 0.25),
            Curve("the papers' machine", np.array([0.1]), np.array([p1.LAM]), 2, "o", has_line=False),
        ],
    )


def _contours(
    x: Any, y: Any, z: Any, name: str, levels: Sequence[float], look: int, place: float
) -> Iterator[Item]:
    """Lines of equal `z` [deg], with their level at a share of their length."""
    for level in levels:
        for k, line in enumerate(contours(x, y, z, level)):
            yield Curve(name, line[:, 0], line[:, 1], look)
            if k == 0:
                at_x, at_y = line[int(place * len(line))]
                yield Label(float(at_x), float(at_y), f"{level:g} deg")


def closing() -> Figure:
    """The range of zeta in which two-bar organs close, over mu."""
    mu = np.linspace(0.05, 0.95, 181)
    items: list[Item] = []
    for look, degrees in enumerate((4.0, 8.0, 12.0)):
        ends = np.array([p0.zeta_range(math.radians(degrees), float(m)) for m in mu])
        ends[ends[:, 0] >= ends[:, 1]] = np.nan
        items += [Curve(f"swing of +-{degrees:g} deg", mu, end, look) for end in ends.T]
    items.append(_points((p0.MU,), (p0.ZETA,), "the papers' machine"))
    return _single(
        "two-bar-range",
        "Two-bar organs close between the lines (l2 = l1 - e)",
        "Least and largest zeta over mu, for three swings.",
        _MU,
        _ZETA,
        items,
    )


def slack() -> Figure:
    """The crank speed at which a web loses its pull, over zeta."""
    items: list[Item] = []
    for look, mu in enumerate((0.45, 0.6, 0.75)):
        low, high = p0.zeta_range(math.radians(9.07), mu)
        zeta = np.linspace(low + 0.02, min(high, 1.0) - 0.02, 40)
        speed = [p0.machine(1.0, float(z), mu).pushed_speed() / math.sqrt(p0.G / p0.L1) for z in zeta]
        items.append(Curve(f"mu = {mu:g}", zeta, np.array(speed), look))
    return _single(
        "two-bar-slack-speed",
        "Crank speed at which a web loses its pull (uniform rods without material, rho 0.1, lam 2/3)",
        "The speed over zeta for three mu.",
        Axis(_ZETA.label),
        Axis("crank speed / sqrt(g/l1)", low=0.0),
        items,
    )


FIGURES = {
    "000": (statics, dynamics, resultant, speeds, overload, closing, slack),
    "001": (pressure, speed_change, existence, crank_rockers),
}
"""The makers of the figures of each paper."""
