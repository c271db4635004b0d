"""The report on a linkage file: its groups, its motion, torque, inertia and reactions over the way of its driver."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Any, NamedTuple

import numpy as np

from .. import __version__
from ..core.engines import MATH
from ..core.quantities import Layout
from ..machines.machine import Machine
from ..mechanism.assur import PRISMATIC
from ..mechanism.machine import MachineState
from ..reading.text import array_entry
from ..study.linkage_turn import GroupTurn, JointTurn, LinkageFindings, linkage_findings
from . import blocks as b
from . import figure as fig
from . import linkage, linkage_loads
from .drawing import drawing
from .lines import Name, Number, capital, join, line
from .motion import Animation, Clip, Reading
from .task import Task, no_check

PICTURES = ("linkage.svg", "linkage.png", "linkage_reactions.png", "linkage_stroke.png")
_PICTURES_PER_TURN = 120


class LinkageQuestion(NamedTuple):
    """A linkage, the constant speed of its driver, and its file."""

    machine: Machine
    speed: float
    """[rad/s], of a driver that slides [m/s]"""
    file: str


def linkage_report(findings: LinkageFindings, source: str) -> b.Report:
    """The report on a linkage from the file `source`."""
    result = _result(findings, source)
    s = b.Source(result)
    return b.Report(
        result["title"],
        "Linkage",
        result,
        tuple(_opening(s, findings)),
        (
            b.Section("motion", "Motion", tuple(_motion(s, findings))),
            b.Section("forces", "Effort, inertia and reactions", tuple(_forces(s, findings))),
            b.Section("outputs", "Parameters, inputs and outputs", tuple(_variables(findings))),
        ),
        source=s.line("Linkage file: {source} · chainunit {chainunit}"),
        opening_title="The linkage",
    )


def _entry(value: Any, unit: str) -> dict[str, Any]:
    return {"value": value, "unit": unit}


def _of(f: LinkageFindings, instance: Any, at_driver: Collection[str]) -> dict[str, Any]:
    """The values of an instance; those with a name in `at_driver` are in the units of the driver."""
    layout, unit = Layout(type(instance)), f.machine.model.driver_port.unit
    return {
        v.name: _entry(x, unit(v.unit) if v.name in at_driver else v.unit)
        for v, x in zip(layout.variables, layout.values(instance), strict=True)
    }


def _result(f: LinkageFindings, source: str) -> dict[str, Any]:
    description, unit = f.description, f.machine.model.driver_port.unit
    points = {
        f"{link}.{point}": {
            axis: _entry(list(f.limits[f"{description.variable('link', link)}.{point}.{axis}"]), "m")
            for axis in ("x", "y")
        }
        for link, entry in description.structure.links.items()
        for point in entry.points
    }
    angles = {
        link: _entry(list(f.limits[f"{description.variable('link', link)}.angle"]), "rad")
        for link in description.structure.links
    }
    at_driver = ("least_at", "largest_at", "forth")
    return {
        "chainunit": __version__,
        "source": source,
        "title": f.machine.model.description,
        "groups_in_words": f.sentence,
        "degrees_of_freedom": 1,
        "speed": _entry(f.speed, unit("rad/s")),
        "turn": _of(f, f.turn, Layout(type(f.turn)).names),
        "groups": {name: _of(f, each, ("margin_at",)) for name, each in f.groups.items()},
        "joints": {name: _of(f, each, ("peak_at",)) for name, each in f.joints.items()},
        "strokes": {name: _of(f, each, at_driver) for name, each in f.strokes.items()},
        "swings": {name: _of(f, each, at_driver) for name, each in f.swings.items()},
        "dead_centres": {name: _entry(places, unit("rad")) for name, places in f.dead_centres.items()},
        "angles": angles,
        "points": points,
        "over_the_way": {
            "driver": array_entry(f.q, unit("rad")),
            **{name: array_entry(f.outputs[name], unit(of)) for name, of in (("tau", "N.m"), ("J", "kg.m2"))},
        },
    }


def _opening(s: b.Source, f: LinkageFindings) -> Iterator[b.Block]:
    yield b.Text(s.line("The driver gives one degree of freedom: {groups_in_words}."))
    yield b.Drawing(
        drawing(f.machine), "The linkage: its pins, links and dimensions", PICTURES[0],
        "A pair of hatched lines is a guide in the ground; a box is a block.",
    )  # fmt: skip


def _motion(s: b.Source, f: LinkageFindings) -> Iterator[b.Block]:
    for path, motions, of in (
        ("strokes", f.strokes, ("sliding joint", "stroke", "way")),
        ("swings", f.swings, ("link", "swing", "angle")),
    ):
        if motions:
            yield _ends(s, f, path, *of)
            yield from _reversals(s, f, path)
    if f.machine.model.turns and (f.strokes or f.swings):
        yield b.Text(
            "Forth: the angle of the driver from the least to the largest. Time ratio: the time of the slower way "
            "over that of the faster one.",
            "note",
            "long",
        )
    still = [name for name in f.description.structure.links if name not in f.swings]
    turning = [name for name in still if f.description.link_turns[name][0]]
    for links, words in (
        (turning, ("turns all the way round", "turn all the way round")),
        ([name for name in still if name not in turning], ("does not turn", "do not turn")),
    ):
        if links:
            yield b.Text(line(join(map(Name, links)), f" {words[len(links) > 1]}."))
    names = Layout(GroupTurn).names
    rows = (b.TableRow((name, *(s.number(f"groups.{name}.{each}") for each in names))) for name in f.groups)
    if f.groups:
        yield b.Table(
            tuple(rows),
            b.heads("group", "least margin", "at"),
            title="Margins: the sine of the transmission angle, or its like; 0 is a dead position",
        )
    rows = (
        b.TableRow((name, *(s.number(f"points.{name}.{axis}", k) for axis in "xy" for k in (0, 1))))
        for name in s.result["points"]
    )
    heads = b.heads("point", "x from", "x to", "y from", "y to")
    yield b.Table(tuple(rows), heads, title="Limits of motion, points", form="long")
    yield _animation(f)


def _ends(s: b.Source, f: LinkageFindings, path: str, head: str, whole: str, way: str) -> b.Table:
    """The table of the ends between which sliding joints or links move."""
    turns = f.machine.model.turns
    columns = (
        (f"least {way}", "least"), ("at", "least_at"), (f"largest {way}", "largest"), ("at", "largest_at"),
        (whole, "range"), *((("forth over", "forth"), ("time ratio", "time_ratio")) if turns else ()),
    )  # fmt: skip
    rows = tuple(
        b.TableRow((_along(f, name) if path == "strokes" else name,
                    *(s.number(f"{path}.{name}.{key}") for _, key in columns)))
        for name in s.result[path]
    )  # fmt: skip
    heads = [b.Column(words, form="long" if key == "forth" else "both") for words, key in columns]
    return b.Table(rows, (b.Column(head), *heads), title=f"{capital(whole)} and dead centres")


def _reversals(s: b.Source, f: LinkageFindings, path: str) -> Iterator[b.Block]:
    """A sentence for each sliding joint or link that turns back more than twice in a turn."""
    for name in s.result[path]:
        variable = f.description.variable("joint" if path == "strokes" else "link", name)
        count = len(f.dead_centres[variable])
        if f.machine.model.turns and count > 2:
            places = join(s.number(f"dead_centres.{variable}", k) for k in range(count))
            yield b.Text(line(Name(name), f" turns back {count} times in a turn: at ", places, "."))


def _animation(f: LinkageFindings) -> Animation:
    machine = f.machine
    low, high = f.description.span
    q = np.linspace(low, high, _PICTURES_PER_TURN + 1)
    state = _state(f, q)
    step = (len(f.q) - 1) // _PICTURES_PER_TURN
    effort, unit = ("Torque" if machine.model.turns else "Force"), machine.model.driver_port.unit
    time = (q - low) / f.speed
    description, driver = f.description, state.m.linkage.driver
    titles = {name: description.variable("joint", name) for name in description.structure.joints}
    receivers = description.parts(MATH, machine.p, machine.model.Inputs()).receivers
    joints = {variable: receivers[name][0][0] for name, variable in titles.items()}
    arrows = linkage.arrows(
        titles,
        joints,
        lambda output: (f.outputs[f"{output}.fx"][::step], f.outputs[f"{output}.fy"][::step]),
        named=True,
    )
    readings = (
        Reading("Place of the driver", q, unit("rad")),
        Reading(f"{effort} at the driver", f.outputs["tau"][::step] * machine.ratio, unit("N.m")),
    )
    clip = Clip(
        "turn", "At constant speed", time, linkage.places(state.m), readings,
        (*arrows, *linkage_loads.load_arrows(state)), blocks=linkage.blocks(state.m),
    )  # fmt: skip
    shown = linkage.shown_pins(state.m.linkage)
    return Animation(
        tuple(linkage.links(state.m.linkage, {})),
        tuple(pin for pin in state.m.linkage.ground if pin in shown),
        (clip,),
        float(time[-1]),
        "An arrow is the force on a link from its neighbour; a dotted one is a force of the loads.",
        hanging=linkage.hanging(state.m),
        orbit=(driver.bar.pin, driver.end) if machine.model.turns else None,
        names=linkage.labels(state.m.linkage),
        paths=linkage.paths(state.m),
        rails=linkage.rails(state.m),
    )


def _state(f: LinkageFindings, q: Any) -> MachineState:
    """The machine at these places of its driver, with the loads of normal running."""
    machine = f.machine
    feed = machine.model.feed_layout.by_name(machine.model.Feed())
    return machine.state(machine.inputs({"phi": q * machine.ratio, "w": f.speed * machine.ratio, **feed}))


def _forces(s: b.Source, f: LinkageFindings) -> Iterator[b.Block]:
    yield b.Text(
        s.line("Inverse dynamics at {=speed:4} of the driver, with the loads of normal running."), "lead"
    )
    turns, unit = f.machine.model.turns, f.machine.model.driver_port.unit
    effort, inertia_word = ("torque", "inertia") if turns else ("force", "mass")
    yield b.Table(
        s.rows(type(f.turn), "turn"), title=f"{capital(effort)}, power and {inertia_word} at the driver"
    )
    names = Layout(JointTurn).names
    rows = (
        b.TableRow((_title(f, name), *(s.number(f"joints.{name}.{each}") for each in names)))
        for name in f.joints
    )
    yield b.Table(
        tuple(rows), b.heads("joint", "largest force", "at", "RMS", "largest moment"), title="Reactions"
    )
    angle = fig.Axis(
        "angle of the driver" if turns else "way of the driver", unit("rad"), step=45.0 if turns else None
    )
    ratio = f.machine.ratio
    curves = (
        (fig.Axis(f"{effort} at the driver", unit("N.m")), f.outputs["tau"] * ratio),
        (fig.Axis("power at the driver", "W"), f.outputs["tau"] * ratio * f.speed),
        (fig.Axis(f"reflected {inertia_word}", unit("kg.m2"), low=0.0), f.outputs["J"] * ratio**2),
    )
    title = f"{capital(effort)}, power and {inertia_word}"
    yield fig.Figure(
        "linkage-turn",
        f"{title} over the way of the driver",
        f"{title} at the driver over its way.",
        fig.stacked(angle, ((axis, (fig.Curve(axis.label, f.q, y, in_legend=False),)) for axis, y in curves)),
        file=PICTURES[1],
    )
    yield from linkage_loads.force_over_stroke(
        {"": _state(f, f.q)}, {"": "a turn at constant speed"}, PICTURES[3]
    )
    forces = tuple(
        fig.Curve(name, f.q, np.hypot(f.outputs[f"{v}.fx"], f.outputs[f"{v}.fy"]), look=k)
        for k, name in enumerate(f.joints)
        for v in [f.description.variable("joint", name)]
    )
    yield fig.Figure(
        "linkage-reactions", "Reactions over the way of the driver",
        "The force in each joint over the way of the driver.",
        ((fig.Panel(angle, fig.Axis("force", "N", low=0.0), forces),),), file=PICTURES[2],
    )  # fmt: skip


def _title(f: LinkageFindings, name: str) -> str:
    joint = f.description.structure.joints[name]
    kind = "guide" if joint.kind == PRISMATIC else "pin"
    return f"{name}: {kind}, on {joint.on[0]} from {joint.by[0]}"


def _along(f: LinkageFindings, name: str) -> str:
    joint = f.description.structure.joints[name]
    return f"{name}: {joint.on[0]} along {joint.by[0]}"


def _variables(f: LinkageFindings) -> Iterator[b.Block]:
    model = f.machine.model
    for title, layout, values in (
        ("Parameters", model.parameter_layout, f.machine.by_name),
        ("Inputs in normal running", model.feed_layout, model.feed_layout.by_name(model.Feed())),
    ):
        sections = tuple(
            b.GivenValue(v.name, v.description, Number(float(values[v.name]), v.unit, v.kind, as_given=True))
            for v in layout.variables
        )
        if sections:
            yield b.Given(((title, sections),))


TASK: Task[LinkageQuestion, tuple[LinkageFindings, str]] = Task(
    "linkage",
    lambda question, folder, progress: (linkage_findings(question.machine, question.speed), question.file),
    lambda outcome: linkage_report(*outcome),
    files=PICTURES,
    accept=no_check,
)
