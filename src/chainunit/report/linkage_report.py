"""The report on a linkage file: its groups, its motion, torque, inertia and reactions over the way of its driver."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Any

import numpy as np

from .. import __version__
from ..engines import MATH
from ..mechanism.assur import PRISMATIC
from ..quantities import Layout
from ..study.linkage_turn import GroupTurn, JointTurn, LinkageFindings
from ..text import array_entry
from . import blocks as b
from . import figure as fig
from . import linkage
from .drawing import drawing
from .lines import Number, capital
from .motion import Animation, Clip, Reading

NAME, PICTURES = "linkage", ("linkage.svg", "linkage.png", "linkage_reactions.png")
_PICTURES_PER_TURN = 120


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
            axis: _entry([float(np.min(x)), float(np.max(x))], "m")
            for axis in ("x", "y")
            for x in [f.outputs[f"{description.variable('link', link)}.{point}.{axis}"]]
        }
        for link, entry in description.structure.links.items()
        for point in entry.points
    }
    angles = {
        link: _entry([float(np.min(x)), float(np.max(x))], "rad")
        for link in description.structure.links
        for x in [f.outputs[f"{description.variable('link', link)}.angle"]]
    }
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
    names = Layout(GroupTurn).names
    rows = (b.TableRow((name, *(s.number(f"groups.{name}.{each}") for each in names))) for name in f.groups)
    if f.groups:
        yield b.Table(
            tuple(rows),
            b.heads("group", "least margin", "at"),
            title="Margins: the sine of the transmission angle, or its like; 0 is a dead position",
        )
    rows = (
        b.TableRow((link, s.number(f"angles.{link}", 0), s.number(f"angles.{link}", 1)))
        for link in f.description.structure.links
    )
    yield b.Table(
        tuple(rows), b.heads("link", "least angle", "largest angle"), title="Limits of motion, links"
    )
    rows = (
        b.TableRow((name, *(s.number(f"points.{name}.{axis}", k) for axis in "xy" for k in (0, 1))))
        for name in s.result["points"]
    )
    heads = b.heads("point", "x from", "x to", "y from", "y to")
    yield b.Table(tuple(rows), heads, title="Limits of motion, points", form="long")
    yield _animation(f)


def _animation(f: LinkageFindings) -> Animation:
    machine = f.machine
    low, high = f.description.span
    q = np.linspace(low, high, _PICTURES_PER_TURN + 1)
    feed = machine.model.feed_layout.by_name(machine.model.Feed())
    state = machine.state(machine.inputs({"phi": q * machine.ratio, "w": f.speed * machine.ratio, **feed}))
    step = (len(f.q) - 1) // _PICTURES_PER_TURN
    effort, unit = ("Torque" if machine.model.turns else "Force"), machine.model.driver_port.unit
    time = (q - low) / f.speed
    description, driver = f.description, state.m.linkage.driver
    titles = {name: description.variable("joint", name) for name in description.structure.joints}
    receivers = description.parts(MATH, machine.p, machine.model.Inputs()).receivers
    joints = {variable: receivers[name][0][0] for name, variable in titles.items()}
    arrows = linkage.arrows(
        titles, joints, lambda output: (f.outputs[f"{output}.fx"][::step], f.outputs[f"{output}.fy"][::step])
    )
    readings = (
        Reading("Place of the driver", q, unit("rad")),
        Reading(f"{effort} at the driver", f.outputs["tau"][::step] * machine.ratio, unit("N.m")),
    )
    clip = Clip("turn", "At constant speed", time, linkage.places(state.m), readings, tuple(arrows))
    shown = linkage.shown_pins(state.m.linkage)
    return Animation(
        tuple(linkage.links(state.m.linkage, {})),
        tuple(pin for pin in state.m.linkage.ground if pin in shown),
        (clip,),
        float(time[-1]),
        "An arrow is the force on a link from its neighbour.",
        hanging=linkage.hanging(state.m),
        orbit=(driver.bar.pin, driver.end) if machine.model.turns else None,
        paths=linkage.paths(state.m),
    )


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
        (
            fig.Axis(f"{effort} at the driver", unit("N.m")),
            (fig.Curve("torque", f.q, f.outputs["tau"] * ratio, in_legend=False),),
        ),
        (
            fig.Axis(f"reflected {inertia_word}", unit("kg.m2"), low=0.0),
            (fig.Curve("inertia", f.q, f.outputs["J"] * ratio**2, in_legend=False),),
        ),
    )
    title = f"{capital(effort)} and {inertia_word}"
    yield fig.Figure(
        "linkage-turn",
        f"{title} over the way of the driver",
        f"{title} at the driver over its way.",
        fig.stacked(angle, curves),
        file=PICTURES[1],
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
