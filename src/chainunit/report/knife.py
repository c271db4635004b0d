"""The report on a knife drive: the turn at constant speed, the pins, the flywheels."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..engines import numpy_
from ..machines.knife_drive import Inputs, KnifeDrive
from ..mechanism.machine import Mechanism
from ..quantities import Layout
from ..study.cutting import PINS, KnifeReaction, KnifeTurn, outputs
from ..study.flywheels import Wheel, WheelAnswers
from ..study.knife import KnifeStudy
from ..study.knife_answers import as_dict
from ..text import number
from . import blocks as b
from . import figure as fig
from . import linkage
from .motion import Animation, Clip, DrawnLink, Reading
from .style import LINES

KIND = "Knife drive: blade, reactions, cut and speed fluctuation"
PICTURES = ("blade_path.png", "torque.png", "reactions.png", "flywheel.png")
_TABLE_WIDTH = 5  # flywheels beside each other on a terminal
_MINOR = "inertia speed_least motor_torque_rms current_peak supply_power_mean drift residual".split()
"""Answers that the terminal leaves out."""
_LOOKS = {
    "coupler": "light",
    "rocker": "heavy",
    "leg_b": "light",
    "leg_3": "light",
    "leg_4": "light",
    "knife": "light",
}
_EDGE = DrawnLink("edge", ("first", "last"), "heavy")
_PICTURES = 120  # of a turn


def report(study: KnifeStudy) -> b.Report:
    """The report."""
    s, config = b.Source(as_dict(study)), study.config
    given = (
        s.given("Cut", config.cut, "cut"),
        s.given("Drive", config.train, "drive"),
        s.given("Run", config.run, "run"),
        s.given("Machine", config.machine, "machine"),
    )
    sections = (
        b.Section("answer", "The answer", tuple(s.conclusions())),
        b.Section("turn", "A turn at constant speed", (_turn(s), _pins(s))),
        b.Section("flywheels", "Flywheels, co-simulated", tuple(_flywheels(s, study))),
        b.Section("plots", "Plots", tuple(_figures(study))),
        b.Section("motion", "The machine in motion", (_motion(study),)),
        b.Section("given", "All that was given", (b.Given(given),)),
    )
    failure = s.words("failure") if study.failure is not None else ()
    return b.Report(config.title, KIND, s.result, (), sections, s.line("chainunit {chainunit}"), failure)


def _turn(s: b.Source) -> b.Table:
    """The turn at constant speed: quantity and value."""
    most = max(s.result["pins"], key=lambda pin: s.result["pins"][pin]["peak"]["value"])
    largest = b.TableRow((f"largest reaction, {most}", s.number(f"pins.{most}.peak")))
    return b.Table((*s.rows(KnifeTurn, "turn", digits=4), largest))


def _pins(s: b.Source) -> b.Table:
    names = Layout(KnifeReaction).names
    rows = (
        b.TableRow((pin, *(s.number(f"pins.{pin}.{name}") for name in names))) for pin in s.result["pins"]
    )
    heads = b.heads("pin", "peak, cutting", "at", "peak, without cut", "at")
    return b.Table(tuple(rows), heads, title="What the pins carry over a turn at constant speed", form="long")


def wheels(study: KnifeStudy) -> list[tuple[str, Wheel, str]]:
    """The flywheels by inertia: in words what each of them is, its run, and its place in the result."""
    runs = [(wheel, f"flywheels.{i}") for i, wheel in enumerate(study.wheels)]
    if study.least is not None and study.least not in study.wheels:
        runs.append((study.least, "least_flywheel"))
    special = (("given", study.own_wheel), ("least", study.least))
    return [
        (", ".join(word for word, which in special if wheel is which), wheel, path)
        for wheel, path in sorted(runs, key=lambda run: run[0].flywheel)
    ]


def _flywheels(s: b.Source, study: KnifeStudy) -> Iterator[b.Block]:
    if not study.wheels:
        return
    rated = ", ".join(f"{{drive.rated_{name}}}" for name in ("power", "speed", "torque", "current"))
    yield b.Text(s.line(f"Motor: {{drive.motor}}, rated {rated}; ratio {{machine.ratio:4}}."))
    runs = wheels(study)
    heads = (
        s.line(f"{{{path}.flywheel}}{f' ({what})' if what else ''}{' stalls' if wheel.stalled else ''}")
        for what, wheel, path in runs
    )
    rows = (
        b.TableRow(
            (v.description, *(s.number(f"{path}.{v.name}") for _, _, path in runs)),
            form="long" if v.name in _MINOR else "both",
        )
        for v in Layout(WheelAnswers).variables
        if v.name != "flywheel"
    )
    columns = range(1, len(runs) + 1)
    groups = (tuple(columns[i : i + _TABLE_WIDTH]) for i in range(0, len(runs), _TABLE_WIDTH))
    yield b.Table(tuple(rows), b.heads("flywheel", *heads), title="Flywheels", groups=tuple(groups))


# -- figures


def _figures(study: KnifeStudy) -> Iterator[fig.Figure]:
    yield _blade_path(study)
    yield _torque(study)
    yield _reactions(study)
    if any(wheel.answers.fluctuation is not None for wheel in study.wheels):
        yield _flywheel(study)


def _mechanism(study: KnifeStudy, q: Any) -> Mechanism:
    return KnifeDrive.state(numpy_(), study.config.machine, Inputs(), q, 0.0).m


def _links(m: Mechanism) -> tuple[DrawnLink, ...]:
    return (*linkage.links(m.linkage, _LOOKS), _EDGE)


def _places(study: KnifeStudy, m: Mechanism) -> dict[str, tuple[Any, Any]]:
    """Pins, the middle of the edge and its ends [m]; the edge is drawn as long as the knife's pins lie apart."""
    knife = study.config.machine.knife
    ends = {"first": min(knife.d.x, knife.e.x), "last": max(knife.d.x, knife.e.x)}
    edge = {name: m.links["knife"].beside(x, knife.blade.y).p for name, x in ends.items()}
    return linkage.places(m) | {name: (point.x, point.y) for name, point in edge.items()}


def _drawn(links: tuple[DrawnLink, ...], at: dict[str, tuple[Any, Any]]) -> tuple[Any, Any]:
    """All links as one line with gaps, shape (points,)."""
    gap, points = (math.nan, math.nan), []
    for link in links:
        points += [at[pin] for pin in (*link.joints, *link.joints[: int(link.closed)])] + [gap]
    x, y = np.array(points, float).T
    return x, y


def _angle_axis(label: str = "crank angle") -> fig.Axis:
    return fig.Axis(label, "rad", low=0.0, high=2.0 * math.pi, step=60.0)


def _spans(study: KnifeStudy) -> list[fig.Shade]:
    """Where the blade goes down in the stack."""
    s, stack = study.statics, study.config.machine.stack
    inside = (np.roll(s.y, -1) < s.y) & (s.y < stack.top) & (s.y > stack.table)
    edge = np.diff(np.concatenate([[False], inside, [False]]).astype(int))
    angle = np.append(s.angle, 2.0 * math.pi)
    ends = zip(angle[edge > 0], angle[edge < 0], strict=True)
    return [fig.Shade(float(low), float(high), "in the stack") for low, high in ends]


def _blade_path(study: KnifeStudy) -> fig.Figure:
    s, stack = study.statics, study.config.machine.stack
    fall = (float(s.angle[np.argmin(s.y)]) - s.top) % (2.0 * math.pi)
    positions: list[fig.Item] = []
    for look, (name, q) in (
        (2, ("blade at its top", s.top)),
        (1, ("half-way", s.top + 0.5 * fall)),
        (0, ("at its bottom", s.top + fall)),
    ):
        m = _mechanism(study, q)
        at = _places(study, m)
        words = f"{name}, crank at {number(q % (2.0 * math.pi), 'rad')}"
        positions.append(fig.Curve(words, *_drawn(_links(m), at), look, "o"))
    ends = sorted(float(at[name][0]) for name in ("first", "last"))
    low, high = ([each, each] for each in (stack.table, stack.top))
    positions += [
        fig.Between("stack", ends, low, high, "hatched"),
        fig.Curve("path of the edge's middle", s.x, s.y, "path"),
        *(fig.Label(float(x), float(y), name) for name, (x, y) in at.items() if len(name) < 3),
    ]
    x, y = (np.append(each, each[0]) for each in (s.x, s.y))
    path: list[fig.Item] = [
        fig.Shade(stack.table, stack.top, "stack", "y", "hatched"),
        fig.Curve("path of the edge's middle", x, y, listed=False),
    ]
    # on the way down alone: the way up may run along the same line
    for k in range(7):
        i = round((s.top + fall * k / 6.0) / (2.0 * math.pi) * len(s.angle)) % len(s.angle)
        words = number(float(s.angle[i]), "rad")
        path.append(fig.Curve("", [s.x[i]], [s.y[i]], marker="o", joined=False, listed=False))
        path.append(fig.Label(float(s.x[i]), float(s.y[i]), words, "left" if k == 6 else "right"))
    metre, small = ((fig.Axis("x", "m", kind), fig.Axis("y", "m", kind)) for kind in ("", "millimetres"))
    tilt: tuple[fig.Item, ...] = (fig.Curve("tilt", s.angle, s.tilt, listed=False), *_spans(study))
    panels = (
        fig.Panel(*metre, tuple(positions), "The linkage in three positions", equal=True),
        fig.Panel(*small, tuple(path), "Path of the edge's middle; crank angles on its way down", equal=True),
        fig.Panel(_angle_axis(), fig.Axis("tilt of the blade", "rad"), tilt, "Tilt of the blade"),
    )
    return fig.Figure(
        "blade-path",
        "The linkage in three positions, the path of its blade and its tilt",
        "The linkage with its blade at the top, half-way and at the bottom; the path of the edge's middle; the tilt "
        "of the blade over the crank angle.",
        tuple((panel,) for panel in panels),
        file="blade_path.png",
        heights=(2.2, 1.5, 1.0),
    )


def _torque(study: KnifeStudy) -> fig.Figure:
    s, config, spans = study.statics, study.config, _spans(study)
    mean = f"mean, cutting: {number(s.turn.torque_mean, 'N.m')}"
    torque = (
        fig.Curve(f"cutting, {number(config.cut.force, 'N')}", s.angle, s.torque),
        fig.Curve("without cut", s.angle, s.torque_free, 1),
        fig.Mark(s.turn.torque_mean, mean, axis="y", look=2),
    )
    inertia = fig.Curve("inertia", s.angle, s.inertia, listed=False)
    return fig.Figure(
        "torque",
        f"A turn at constant {number(config.run.crank_speed, 'rad/s', 'speed')}",
        "Crank torque with and without the cut, and the inertia reflected to the crank, over the crank angle.",
        (
            (fig.Panel(_angle_axis(), fig.Axis("crank torque", "N.m"), (*torque, *spans)),),
            (fig.Panel(_angle_axis(), fig.Axis("reflected inertia", "kg.m2", low=0.0), (inertia, *spans)),),
        ),
        file="torque.png",
        heights=(1.5, 1.0),
    )


def _reactions(study: KnifeStudy) -> fig.Figure:
    pins, items = study.statics.pins, []
    for look, shift, words, size, angle in (
        (1, -0.2, "cutting", "peak", "angle"),
        (2, 0.2, "without cut", "peak_free", "angle_free"),
    ):
        peaks = [(getattr(r, size), getattr(r, angle)) for r in pins.values()]
        places = tuple(f"{number(peak, 'N')} at {number(at, 'rad')}" for peak, at in peaks)
        at = np.arange(len(pins)) + shift
        items.append(fig.Bars(words, at, [peak for peak, _ in peaks], 0.38, look, words=places))
    # room for the words beside the bars
    x = fig.Axis("largest reaction", "N", low=0.0, high=1.3 * max(r.peak for r in pins.values()))
    return fig.Figure(
        "reactions",
        "What the pins carry over a turn at constant speed",
        "Bars of the largest reaction of every pin, cutting and without cut, with the crank angle at which it comes.",
        ((fig.Panel(x, fig.Axis("pin", names=tuple(pins)), tuple(items)),),),
        file="reactions.png",
        heights=(0.17 * len(pins),),
    )


def _flywheel(study: KnifeStudy) -> fig.Figure:
    cutting = [wheel for _, wheel, _ in wheels(study) if wheel.answers.fluctuation is not None]
    # as many as there are lines to tell apart, from the least to the largest
    some = [cutting[round(k)] for k in np.linspace(0, len(cutting) - 1, min(len(cutting), len(LINES)))]
    ratio, plate = study.config.machine.ratio, study.config.motor.nameplate
    speed, torque, current = (
        fig.Axis("crank speed", "rad/s", "speed"),
        fig.Axis("motor torque, air gap", "N.m"),
        fig.Axis("motor current, RMS of a phase", "A"),
    )
    items: dict[fig.Axis, list[fig.Item]] = {
        speed: [],
        torque: [fig.Mark(plate.torque, "rated", axis="y", look="reference")],
        current: [fig.Mark(plate.rated_current, "rated", axis="y", look="reference")],
    }
    for look, wheel in enumerate(some):
        run = wheel.turns
        assert run is not None
        # the last turn, from one top of the blade to the next
        angle = run["motor.phi"].values / ratio - study.statics.top
        first = int(np.searchsorted(angle, angle[-1] - 2.0 * math.pi))
        after = angle[first:] - angle[-1] + 2.0 * math.pi
        for axis, name, factor in (
            (speed, "w", 1.0 / ratio),
            (torque, "air_gap_tau", 1.0),
            (current, "i", 1.0),
        ):
            y = factor * run[f"motor.{name}"].values[first:]
            items[axis].append(fig.Curve(number(wheel.flywheel, "kg.m2"), after, y, look))
    x = _angle_axis("crank angle after the blade's top")
    panels = [fig.Panel(x, axis, tuple(curves)) for axis, curves in items.items()]
    return fig.Figure(
        "flywheel",
        "A cut with each flywheel, and the fluctuation of the speed over the inertia",
        "Crank speed, motor torque and current of a cut with each flywheel; fluctuation over inertia.",
        ((panels[0], panels[1]), (panels[2], _fluctuation(study, cutting))),
        file="flywheel.png",
        heights=(1.3, 1.3),
    )


def _fluctuation(study: KnifeStudy, cutting: list[Wheel]) -> fig.Panel:
    """Fluctuation over the inertia on the motor shaft."""
    inertia = np.array([wheel.answers.inertia for wheel in cutting])
    sizes = [wheel.answers.fluctuation for wheel in cutting]
    bare, permitted = study.inertia(0.0), study.config.run.fluctuation
    ends = np.array([min(inertia[0], bare), 1.3 * max(inertia[-1], study.inertia(study.flywheel_by_hand))])
    by_hand = [study.by_hand(J - bare) for J in ends]
    items: list[fig.Item] = [
        fig.Curve("by hand, dE/(J w2)", ends, by_hand, 1),
        fig.Curve("co-simulated", inertia, sizes, marker="o"),
        fig.Mark(permitted, "permitted", axis="y", look=3),
    ]
    if study.least is not None and study.least in cutting:
        a = study.least.answers
        items.append(fig.Curve("least flywheel", [a.inertia], [a.fluctuation], marker="s", joined=False))
    low, high = 0.7 * min(*sizes, permitted), min(2.0, 1.5 * max(by_hand))
    y = fig.Axis("fluctuation of the speed", "1", "percent", low=low, high=high, log=True)
    x = fig.Axis("inertia on the motor shaft", "kg.m2", log=True)
    return fig.Panel(x, y, tuple(items), "Fluctuation over inertia")


# -- motion


def _motion(study: KnifeStudy) -> Animation:
    """The turn at constant speed, with and without the cut."""
    config, statics = study.config, study.statics
    angle = np.linspace(0.0, 2.0 * math.pi, _PICTURES + 1)
    m = _mechanism(study, angle)
    places = _places(study, m)
    pins = {output: pin for output, (pin, _) in KnifeDrive.joints.items()}

    def run(name: str, title: str, force: float) -> Clip:
        out = outputs(config.machine, angle, config.run.crank_speed, force)
        readings = (
            Reading("Crank angle", angle, "rad"),
            Reading("Crank torque", out.tau * config.machine.ratio, "N.m"),
            Reading("Blade, x", out.blade.x, "m", "millimetres"),
            Reading("Blade, y", out.blade.y, "m", "millimetres"),
            Reading("Tilt", out.blade.tilt, "rad"),
        )
        arrows = linkage.arrows(PINS, pins, lambda pin: (getattr(out, pin).fx, getattr(out, pin).fy))
        return Clip(name, title, angle / config.run.crank_speed, places, readings, tuple(arrows))

    return Animation(
        _links(m),
        tuple(m.linkage.ground),
        (
            run("cutting", "a turn at constant speed, cutting", config.cut.force),
            run("free", "a turn at constant speed, without cut", 0.0),
        ),
        2.0 * math.pi / config.run.crank_speed,
        "An arrow is the force on the first-named part of a pin; the thin line is the path of the edge's middle.",
        orbit=("O1", "A"),
        names=dict.fromkeys(("first", "last", "blade"), ""),
        paths={"path of the edge's middle": (statics.x[::20], statics.y[::20])},
    )
