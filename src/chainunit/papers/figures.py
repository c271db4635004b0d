"""The papers' figures in their own axes, and five that the papers lack.

Left organ: full lines, right organ: dashed, as in paper 000. Corrected curves are black; what the printed
formulas or the authors' own calculation give is orange and thin.
"""

from __future__ import annotations

import math
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from ..engines import numpy_
from ..machines.crank_rocker import longest_crank, parallel_frame, pressure_angle_extremes, swing
from ..report.style import LINES
from . import paper000 as p0
from . import paper001 as p1

LEFT = {"color": "#1b1b1b", "linestyle": "-", "linewidth": 1.8}
RIGHT = {"color": "#1b1b1b", "linestyle": "--", "linewidth": 1.8}
PRINTED_LEFT = {"color": "#c1440e", "linestyle": "-", "linewidth": 0.9}
PRINTED_RIGHT = {"color": "#c1440e", "linestyle": "--", "linewidth": 0.9}
_TEXT = {"X": "$X_{A2}$", "Y_A2": "$Y_{A2}$", "Y_A1": "$Y_{A1}$", "R_n": "$R^n$", "R_t": "$R^t$"}


def _fig_17_22() -> Any:
    figure, axes = plt.subplots(2, 3, figsize=(12, 7), sharex=True)
    degrees = np.linspace(-12.0, 12.0, 121)
    psi = np.radians(degrees)
    left, right = p0.statics(psi)
    hinge = {1.0: p0.hinge_loading(psi), -1.0: p0.hinge_loading(-psi)}
    panels = [("X", "17"), ("Y_A2", "18"), ("Y_A1", "20"), ("R_n", "21"), ("R_t", "22")]
    for axis, (name, number) in zip(axes.flat, panels, strict=False):
        axis.plot(degrees, getattr(left, name), label="left", **LEFT)
        axis.plot(degrees, getattr(right, name), label="right", **RIGHT)
        for hand, style, side in ((1.0, "-", "left"), (-1.0, "--", "right")):
            axis.plot(degrees, getattr(hinge[hand], name), color="#0b6fa4", linestyle=style, linewidth=1.0,
                      label=f"{side}, weights in B")  # fmt: skip
        also = " and 19" if name == "X" else ""
        axis.set_title(f"Fig {number}{also}: {_TEXT[name]}" + (" = $X_{A1}$" if also else ""))
        axis.set_xlim(-12, 12)
    for axis in axes[:, 0]:
        axis.set_ylabel("force / organ weight")
    for axis in (*axes[1, :2], axes[0, 2]):
        axis.set_xlabel("rocker angle psi [deg]")
    axes[0, 2].xaxis.set_tick_params(labelbottom=True)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    axes[1, 2].axis("off")
    axes[1, 2].legend(handles, labels, loc="center", fontsize=11, title="statics, zeta 0.5, mu 0.6")
    return figure


def _fig_23_29() -> Any:
    figure, axes = plt.subplots(2, 3, figsize=(12, 7), sharex=True)
    degrees = np.linspace(0.0, 360.0, 361)
    phi = np.radians(degrees)
    unit = p0.machine()
    out = unit.forces(phi, 1.0)
    panels = [
        ("X", "23", 0),
        ("Y_A2", "24", 1),
        ("R_n", "25", None),
        ("R_t", "26", 2),
        ("X_A1", "28", None),
        ("Y_A1", "29", None),
    ]
    for hand, side, line, thin in ((1.0, "left", LEFT, PRINTED_LEFT), (-1.0, "right", RIGHT, PRINTED_RIGHT)):
        organ = getattr(out, side)
        mine = p0.of_side(organ, hand, unit)
        theirs = p0.AUTHORS.forces(phi, 1.0, hand)
        psi = hand * out.rocker.psi
        for axis, (name, number, column) in zip(axes.flat, panels, strict=True):
            y = -hand * organ.support.fx / p0.weight(unit) if name == "X_A1" else getattr(mine, name)
            axis.plot(degrees, y, label=f"{side}, corrected", **line)
            old = theirs[1] * np.cos(psi) - theirs[0] * np.sin(psi) if name == "R_n" else None
            if column is not None:
                old = theirs[column]
            if old is not None:
                axis.plot(degrees, old, label=f"{side}, as the authors computed it", **thin)
            axis.set_title(f"Fig {number}: " + _TEXT.get(name, "$X_{A1}$"))
    for axis in axes[:, 0]:
        axis.set_ylabel("force / organ weight")
    for axis in axes[1]:
        axis.set_xlabel("crank angle [deg]")
        axis.set_xticks(range(0, 361, 90))
        axis.set_xlim(0, 360)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return figure


def _fig_27() -> Any:
    figure, axis = plt.subplots(figsize=(7.5, 5))
    (_, right), (_, left) = p0.machine().rocker_extremes()
    phi = np.linspace(left - 2.0 * math.pi, right, 361)
    x = np.degrees(p0.machine().forces(phi, 1.0).rocker.psi)
    axis.plot(x, p0.resultant(p0.CORRECTED, phi, 1.0), label="corrected", **LEFT)
    axis.plot(x, p0.resultant(p0.AUTHORS, phi, 1.0), label="as the authors computed it", **PRINTED_LEFT)
    axis.axhline(0.63, label="printed: about 0.63", **LINES[3])
    axis.set_xlabel("rocker angle psi, from the left to the right extreme [deg]")
    axis.set_ylabel("resultant on the rocker / organ weight")
    axis.set_title("Fig 27: both organs, crank at 1 rad/s")
    axis.legend()
    return figure


def _fig_30_31() -> Any:
    figure, axes = plt.subplots(1, 2, figsize=(12, 5))
    (_, right), (_, left) = p0.machine().rocker_extremes()
    w = np.linspace(10.0, 50.0, 81)
    places = (
        ("30", "left extreme, psi = -8.19 deg", left, (12.5, 313.4)),
        ("31", "right extreme, psi = 9.06 deg", right, (1.6, 35.4)),
    )
    for axis, (number, title, phi, printed) in zip(axes, places, strict=True):
        axis.plot([10, 50], printed, "o", color="#c1440e", label="printed")
        axis.plot(
            w, np.abs(p0.AUTHORS.forces(phi, w)[2]), label="as the authors computed it, |.|", **PRINTED_LEFT
        )
        for inertia, line, text in (
            (0.0, LEFT, "corrected, point masses, |.|"),
            (1.0, LINES[2], "corrected, uniform rods, |.|"),
        ):
            out = p0.machine(inertia).forces(phi, w)
            axis.plot(w, np.abs(out.left.tangential_load) / p0.weight(p0.machine()), label=text, **line)
        axis.set_yscale("log")
        axis.set_xlabel("crank speed [rad/s]")
        axis.set_ylabel("|$R^t$| of the left organ / organ weight")
        axis.set_title(f"Fig {number}: {title}")
        axis.legend(loc="upper left", fontsize=9)
    return figure


def _overload() -> Any:
    figure, (one, two) = plt.subplots(1, 2, figsize=(12, 5))
    degrees = np.linspace(0.4, 12.0, 200)
    left, right = p0.statics(np.radians(degrees))
    one.plot(degrees, left.R_t / (left.R_t - right.R_t), **LEFT)
    one.plot([12], [1.14], "o", color="#c1440e", label="printed as the maximum: 1.14 at 12 deg")
    one.set_ylim(0, 18)
    one.set_xlabel("rocker angle psi [deg]")
    one.set_ylabel("$R^t_L/(R^t_L - R^t_R)$ at rest")
    one.set_title("The papers' overload factor diverges at psi = 0")
    one.legend()
    speeds = np.concatenate([np.linspace(0.05, 15.0, 90), np.linspace(15.5, 50.0, 30)])
    for torque, line in (("rocker_torque", LEFT), ("crank_torque", LINES[1])):
        factors = [p0.cycle_factor(torque, float(w)) for w in speeds]
        two.plot(speeds, factors, label=torque.replace("_", " "), **line)
    two.axhline(1.0, color="#777777", linewidth=1.0)
    two.set_xlabel("crank speed [rad/s]")
    two.set_ylabel("left organ alone / both, cycle maxima")
    two.set_title("Above 6.5 (8.5) rad/s both sides together are heavier")
    two.legend()
    return figure


def _fig_7() -> Any:
    figure, axis = plt.subplots(figsize=(8, 5.5))
    degrees = np.linspace(0.0, 360.0, 721)
    for line, rho in zip(LINES, (0.1, 0.3, 0.5), strict=False):
        axis.plot(
            degrees,
            np.degrees(p1.pressure(rho, np.radians(degrees), p1.FROZEN)),
            label=f"rho = {rho}",
            **line,
        )
    axis.plot(
        degrees,
        np.degrees(p1.pressure(0.5, np.radians(degrees), p1.frame(0.5, "tracking"))),
        label="rho = 0.5, frame follows rho",
        **LINES[3],
    )
    for limit in (45, 60):
        for sign in (1, -1):
            axis.axhline(sign * limit, color="#777777", linewidth=0.9, linestyle="--" if limit == 45 else "-")
    axis.text(4, 61, "admissible: 45 (dashed) to 60 deg", fontsize=9, color="#444444")
    axis.set_xlabel("crank angle [deg]")
    axis.set_ylabel("pressure angle [deg]")
    axis.set_xticks(range(0, 361, 45))
    axis.set_xlim(0, 360)
    axis.set_ylim(-90, 90)
    axis.set_title("Fig 7: pressure angle, lam = 2/3, frame frozen at rho0 = 0.3")
    axis.legend(loc="lower left")
    return figure


def _fig_9() -> Any:
    figure, axis = plt.subplots(figsize=(7.5, 5))
    rho = np.linspace(0.05, 0.5, 400)
    axis.plot(rho, p1.K(rho), label="frame frozen at rho0 = 0.3 (Fig 9)", **LEFT)
    axis.plot(rho, p1.K(rho, "tracking"), label="frame follows rho: K = 1", **LINES[1])
    axis.plot([0.1, 0.5], [0.99, 1.26], "o", color="#c1440e", label="printed")
    axis.set_xlabel("rho = r/l")
    axis.set_ylabel("speed-change coefficient K")
    axis.set_title("Fig 9: K, lam = 2/3")
    axis.legend()
    return figure


def _map() -> Any:
    """Swing and pressure angle over (rho, lam) in the frame with K = 1."""
    xp = numpy_()
    rho, lam = np.meshgrid(np.linspace(0.02, 0.7, 240), np.linspace(0.15, 2.0, 240))
    b = parallel_frame(xp, rho, 1.0, lam)
    turns = rho < longest_crank(xp, 1.0, lam, b)
    with np.errstate(invalid="ignore"):
        high, low = pressure_angle_extremes(xp, rho, 1.0, lam, b)
        worst = np.where(turns, np.degrees(np.maximum(np.abs(high), np.abs(low))), np.nan)
        eta = np.where(turns, np.degrees(swing(xp, rho, 1.0, lam, b)), np.nan)
    figure, axis = plt.subplots(figsize=(8, 6))
    axis.contourf(rho, lam, worst, levels=[0, 45, 60, 90], colors=["#ffffff", "#e3e3e3", "#b9b9b9"])
    axis.clabel(
        axis.contour(rho, lam, worst, levels=[10, 20, 30, 45, 60], colors="#1b1b1b", linewidths=1.3),
        fmt="%d°",
    )
    lines = axis.contour(
        rho, lam, eta, levels=[10, 17.25, 30, 60, 90, 120], colors="#c1440e", linestyles="--", linewidths=1.3
    )
    axis.clabel(lines, fmt="%g°")
    axis.plot([0.1], [2 / 3], "o", color="#0b6fa4")
    axis.annotate("papers' machine", (0.1, 2 / 3), (0.13, 0.36), arrowprops={"arrowstyle": "->"})
    axis.plot([], [], color="#1b1b1b", label="largest pressure angle (grey: above 45, 60 deg)")
    axis.plot([], [], color="#c1440e", linestyle="--", label="swing")
    axis.set_xlabel("rho = r/l")
    axis.set_ylabel("lam = h/l")
    axis.set_title("Crank-rockers with K = 1 (b² = l² - r² + h²); they turn where rho < lam")
    figure.legend(loc="outside lower center", ncols=2)
    return figure


def _existence() -> Any:
    """Paper 001, (5), (6) and the third condition, over (b/l, rho) for three lam."""
    figure, axes = plt.subplots(1, 3, figsize=(12, 4.5), sharey=True)
    for axis, lam in zip(axes, (2.0 / 3.0, 1.0, 2.0), strict=True):
        b = np.linspace(max(0.0, abs(lam - 1.0) - 0.2), 1.0 + lam + 0.05, 400)
        limit = longest_crank(numpy_(), 1.0, lam, b)
        axis.fill_between(b, 0.0, np.maximum(limit, 0.0), color="#dcdcdc", label="the crank turns")
        axis.plot(b, lam - (b - 1.0), label="(5)", **LINES[0])
        axis.plot(b, lam + (b - 1.0), label="(6)", **LINES[1])
        axis.plot(b, b - lam + 1.0, label="third: rho <= b/l - lam + 1", **LINES[2])
        axis.set_ylim(0.0, 1.0)
        axis.set_xlim(b[0], b[-1])
        axis.set_xlabel("b/l")
        axis.set_title(f"lam = {lam:.3g}")
    axes[0].set_ylabel("rho = r/l")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return figure


def _zeta_range() -> Any:
    figure, axis = plt.subplots(figsize=(8, 5.5))
    mu = np.linspace(0.05, 0.95, 181)
    for line, degrees in zip(LINES, (4.0, 8.0, 12.0), strict=False):
        ends = np.array([p0.zeta_range(math.radians(degrees), float(m)) for m in mu])
        closed = ends[:, 0] < ends[:, 1]
        axis.plot(mu[closed], ends[closed, 0], label=f"swing of +-{degrees:g} deg", **line)
        axis.plot(mu[closed], ends[closed, 1], **line)
    axis.plot([p0.MU], [p0.ZETA], "o", color="#c1440e", label="the papers' machine")
    axis.set_xlabel("mu = e/l1")
    axis.set_ylabel("zeta = z/z_max")
    axis.set_ylim(0.0, 1.0)
    axis.set_title("Two-bar organs close between the lines (l2 = l1 - e)")
    axis.legend(loc="center left")
    return figure


def _slack() -> Any:
    figure, axis = plt.subplots(figsize=(8, 5.5))
    for line, mu in zip(LINES, (0.45, 0.6, 0.75), strict=False):
        low, high = p0.zeta_range(math.radians(9.07), mu)
        zeta = np.linspace(low + 0.02, min(high, 1.0) - 0.02, 40)
        speeds = [_slack_speed(float(z), mu) for z in zeta]
        axis.plot(zeta, speeds, label=f"mu = {mu:g}", **line)
    axis.set_xlabel("zeta = z/z_max")
    axis.set_ylabel("crank speed / sqrt(g/l1)")
    axis.set_ylim(bottom=0.0)
    axis.set_title(
        "Crank speed at which a web loses its pull\n(uniform rods without material, rho 0.1, lam 2/3)"
    )
    axis.legend()
    return figure


def _slack_speed(zeta: float, mu: float) -> float:
    return p0.machine(1.0, zeta, mu).slack_speed() / math.sqrt(p0.G / p0.L1)


FIGURES = {
    "000-fig17-22-statics.png": _fig_17_22,
    "000-fig23-29-dynamics.png": _fig_23_29,
    "000-fig27-resultant.png": _fig_27,
    "000-fig30-31-speed.png": _fig_30_31,
    "000-overload-factor.png": _overload,
    "001-fig7-pressure-angle.png": _fig_7,
    "001-fig9-speed-change.png": _fig_9,
    "001-existence.png": _existence,
    "001-map.png": _map,
    "two-bar-range.png": _zeta_range,
    "two-bar-slack-speed.png": _slack,
}
