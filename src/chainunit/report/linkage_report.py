"""The report on a linkage file: its groups, its motion, torque, inertia and reactions over the way of its driver."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .. import __version__
from ..core.quantities import Layout
from ..machines.linkages.joint_kinds import KINDS
from ..machines.machine import Machine
from ..mechanism.machine import MachineState
from ..reading.tables import UnusualValue, slips_of
from ..reading.text import array_entry
from ..study.linkage_turn import GroupTurn, JointTurn, LinkageFindings, linkage_findings
from . import blocks as b
from . import figure as fig
from . import linkage, linkage_loads, linkage_rest
from .drawing import drawing
from .lines import Line, Name, Number, Strong, capital, join, line
from .live_block import Live, LiveMachine
from .motion import Animation, Clip, Reading
from .task import Task, no_check

PICTURES = (
    "linkage.svg", "linkage.png", "linkage_reactions.png", "linkage_stroke.png", "linkage_rest.png"
)  # fmt: skip
_PICTURES = 120
"""Pictures of a turn, or of the way there and back."""


class LinkageQuestion(NamedTuple):
    """A linkage, the constant speed of its driver, and its file."""

    machine: Machine
    speed: float
    """[rad/s], of a driver that slides [m/s]"""
    file: str
    unusual: tuple[UnusualValue, ...] = ()
    """values of the file that are of an unusual size"""
    remarks: tuple[str, ...] = ()
    """sentences on a linkage from a drawing of another program"""


def linkage_report(
    findings: LinkageFindings,
    source: str,
    unusual: tuple[UnusualValue, ...] = (),
    remarks: tuple[str, ...] = (),
) -> b.Report:
    """The report on a linkage from the file `source`, which has these values of an unusual size, and on which there
    are `remarks`."""
    slips = [str(value) for value in slips_of(unusual)]
    notes = [value.sentence for value in unusual if value.with_unit]
    drawn = [f"{capital(remark)}." for remark in remarks]
    result = _result(findings, source) | {"slips": slips, "notes": notes, "drawn": drawn}
    s = b.Source(result)
    return b.Report(
        result["title"],
        "Linkage",
        result,
        tuple(_opening(s, findings)),
        (
            b.Section("motion", "Motion", tuple(_motion(s, findings))),
            b.Section("live", "Try it", tuple(_live(findings, source))),
            b.Section("forces", "Effort, inertia and reactions", tuple(_forces(s, findings))),
            b.Section("rest", "At rest", tuple(linkage_rest.at_rest(s, findings, PICTURES[4]))),
            b.Section("outputs", "Parameters, inputs and outputs", tuple(_variables(findings))),
        ),
        source=s.line("Linkage file: {source} · chainunit {chainunit}"),
        opening_title="The linkage",
    )


def _live(f: LinkageFindings, source: str) -> Iterator[b.Block]:
    def make() -> LiveMachine:
        # a page alone needs it
        from .live.linkage import of_linkage

        return of_linkage(f.machine, f.speed, Path(source).name)

    yield Live(make, "the file")


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
        **_forces_of(f),
        "groups": {name: _of(f, group, ("margin_at",)) for name, group in f.groups.items()},
        "strokes": {name: _of(f, stroke, at_driver) for name, stroke in f.strokes.items()},
        "swings": {name: _of(f, swing, at_driver) for name, swing in f.swings.items()},
        "dead_centres": {name: _entry(places, unit("rad")) for name, places in f.dead_centres.items()},
        "angles": angles,
        "points": points,
        "over_the_way": {"driver": array_entry(f.q, unit("rad")), **_over_the_way(f)},
        "rest": linkage_rest.rest_data(f),
        **({"back": _forces_of(f.back) | {"over_the_way": _over_the_way(f.back)}} if f.back else {}),
    }


def _forces_of(f: LinkageFindings) -> dict[str, Any]:
    """Effort at the driver, and reactions."""
    return {
        "turn": _of(f, f.turn, Layout(type(f.turn)).names),
        "joints": {name: _of(f, joint, ("peak_at",)) for name, joint in f.joints.items()},
    }


def _over_the_way(f: LinkageFindings) -> dict[str, Any]:
    """Effort and inertia at each place."""
    unit = f.machine.model.driver_port.unit
    return {
        name: array_entry(f.outputs[name], unit(rotary_unit))
        for name, rotary_unit in (("tau", "N.m"), ("J", "kg.m2"))
    }


def _opening(s: b.Source, f: LinkageFindings) -> Iterator[b.Block]:
    yield b.Text(s.line("The driver gives one degree of freedom: {groups_in_words}."), central=True)
    yield from (b.Text(s.words(f"drawn.{i}"), central=True) for i in range(len(s.result["drawn"])))
    if slips := s.result["slips"]:
        items = tuple(s.words(f"slips.{i}") for i in range(len(slips)))
        yield b.Judgement("remark", Strong("Is this what was meant?"), items=items)
    yield from (b.Text(s.words(f"notes.{i}"), "note") for i in range(len(s.result["notes"])))
    yield b.Drawing(
        drawing(f.machine), "The linkage: its pins, links and dimensions", PICTURES[0],
        "A pair of hatched lines is a guide in the ground; a box is a block.",
    )  # fmt: skip


def _motion(s: b.Source, f: LinkageFindings) -> Iterator[b.Block]:
    for path, motions, nouns in (
        ("strokes", f.strokes, ("sliding joint", "stroke", "way")),
        ("swings", f.swings, ("link", "swing", "angle")),
    ):
        if motions:
            yield _ends(s, f, path, *nouns)
            yield from _reversals(s, f, path)
    if f.machine.model.turns and (f.strokes or f.swings):
        yield b.Text(
            "Forth: the angle of the driver from the least to the largest. Time ratio: slow stroke over quick "
            "return.",
            "note",
            "long",
        )
    still = [name for name in f.description.structure.links if name not in f.swings]
    turning = [name for name in still if f.description.link_turns[name][0]]
    for links, phrases in (
        (turning, ("turns all the way round", "turn all the way round")),
        ([name for name in still if name not in turning], ("does not turn", "do not turn")),
    ):
        if links:
            yield b.Text(line(join(map(Name, links)), f" {phrases[len(links) > 1]}."))
    names = Layout(GroupTurn).names
    rows = (
        b.TableRow((join(map(Name, name.split(", "))), *(s.number(f"groups.{name}.{key}") for key in names)))
        for name in f.groups
    )
    if f.groups:
        yield b.Table(
            tuple(rows),
            b.heads("group", "least margin", "at"),
            title="Margins: the sine of the transmission angle, or its like; 0 is a dead position",
        )
    rows = (
        b.TableRow((Name(name), *(s.number(f"points.{name}.{axis}", k) for axis in "xy" for k in (0, 1))))
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
        b.TableRow((_along(f, name) if path == "strokes" else Name(name),
                    *(s.number(f"{path}.{name}.{key}") for _, key in columns)))
        for name in s.result[path]
    )  # fmt: skip
    heads = [b.Column(title, form="long" if key == "forth" else "both") for title, key in columns]
    return b.Table(rows, (b.Column(head), *heads), title=f"{capital(whole)}{' and dead centres' * turns}")


def _reversals(s: b.Source, f: LinkageFindings, path: str) -> Iterator[b.Block]:
    """A sentence for each sliding joint or link that turns back more than twice in a turn."""
    for name in s.result[path]:
        variable = f.description.variable("joint" if path == "strokes" else "link", name)
        count = len(f.dead_centres[variable])
        if f.machine.model.turns and count > 2:
            places = join(s.number(f"dead_centres.{variable}", k) for k in range(count))
            yield b.Text(line(Name(name), f" turns back {count} times in a turn: at ", places, "."))


def _animation(f: LinkageFindings) -> Animation:
    machine, model = f.machine, f.machine.model
    low, _ = f.description.span
    step = (2 if f.back else 1) * (len(f.q) - 1) // _PICTURES
    q, speed = f.q[::step], np.full(_PICTURES // (2 if f.back else 1) + 1, f.speed)
    time = (q - low) / f.speed
    if f.back:  # the last place is that of the way back, too
        q, speed = np.concatenate([q, q[-2::-1]]), np.concatenate([speed, -speed[1:]])
        time = np.concatenate([time, time[1:] + time[-1]])

    def over(values: Callable[[LinkageFindings], Any]) -> Any:
        """A quantity at the places of the pictures."""
        forth = values(f)[::step]
        return np.concatenate([forth, values(f.back)[::-1][::step][1:]]) if f.back else forth

    state = _state(f, q, speed)
    effort, unit = ("Force" if model.slides else "Torque"), model.driver_port.unit
    driver = state.m.linkage.driver
    joints = {variable: pin for variable, (pin, _) in model.joints.items()}

    def force(output: str) -> tuple[Any, Any]:
        x, y = (over(lambda g, axis=axis: g.outputs[f"{output}.{axis}"]) for axis in ("fx", "fy"))  # type: ignore[misc]
        return x, y

    readings = (
        Reading("Place of the driver", q, unit("rad")),
        Reading(f"{effort} at the driver", over(lambda g: g.outputs["tau"]) * machine.ratio, unit("N.m")),
    )
    clip = Clip(
        "turn", f"{'There and back at' if f.back else 'At'} constant speed", time, linkage.places(state.m), readings,
        (*linkage.arrows(model.pins, joints, force, named=True), *linkage_loads.load_arrows(state)),
        blocks=linkage.blocks(state.m),
    )  # fmt: skip
    return Animation(
        tuple(linkage.links(state.m.linkage, {})),
        linkage.supports(state.m.linkage),
        (clip,),
        float(time[-1]),
        "An arrow is the force on a link from its neighbour; a dotted one is a force of the loads.",
        hanging=linkage.hanging(state.m),
        circles=(*[(driver.bar.pin, driver.end)] * model.turns, *state.m.linkage.circles),
        names=linkage.labels(state.m.linkage),
        paths=linkage.paths(state.m, driver.end if f.back else ""),
        rails=linkage.rails(state.m),
    )


def _state(f: LinkageFindings, q: Any, speed: Any) -> MachineState:
    """The machine at these places and speeds of its driver, with the loads of normal running."""
    machine = f.machine
    feed = machine.model.feed_layout.by_name(machine.model.Feed())
    return machine.state(machine.inputs({"phi": q * machine.ratio, "w": speed * machine.ratio, **feed}))


def _ways(f: LinkageFindings) -> dict[str, LinkageFindings]:
    """The findings by the direction in which the driver goes, without a name where there is one alone."""
    return {"forth": f, "back": f.back} if f.back else {"": f}


def _forces(s: b.Source, f: LinkageFindings) -> Iterator[b.Block]:
    there = ", there and back over its range" if f.back else ""
    yield b.Text(
        s.line(f"Inverse dynamics at {{=speed:4}} of the driver{there}, with the loads of normal running."),
        "lead",
        central=True,
    )
    slides = f.machine.model.slides
    effort, inertia_word = ("force", "mass") if slides else ("torque", "inertia")
    names = Layout(JointTurn).names
    for way in _ways(f):
        path, on = "back." if way == "back" else "", f", on the way {way}" if way else ""
        title = f"{capital(effort)}, power and {inertia_word} at the driver{on}"
        yield b.Table(s.rows(type(f.turn), f"{path}turn"), title=title, central=True)
        rows = (
            b.TableRow((_title(f, name), *(s.number(f"{path}joints.{name}.{key}") for key in names)))
            for name in f.joints
        )
        heads = b.heads("joint", "largest force", "at", "RMS", "largest moment")
        yield b.Table(tuple(rows), heads, title=f"Reactions{on}", central=True)
    yield from _figures(f, effort, inertia_word)


def _figures(f: LinkageFindings, effort: str, inertia_word: str) -> Iterator[b.Block]:
    """The figures over the way of the driver, with a curve, or of reactions a panel, for each direction."""
    model, unit, ratio, ways = f.machine.model, f.machine.model.driver_port.unit, f.machine.ratio, _ways(f)
    angle = fig.Axis(
        "way of the driver" if model.slides else "angle of the driver",
        unit("rad"),
        step=45.0 if model.turns else None,
    )
    panels: tuple[tuple[fig.Axis, Callable[[LinkageFindings], Any]], ...] = (
        (fig.Axis(f"{effort} at the driver", unit("N.m")), lambda g: g.outputs["tau"] * ratio),
        (fig.Axis("power at the driver", "W"), lambda g: g.outputs["tau"] * ratio * g.speed),
        (fig.Axis(f"reflected {inertia_word}", unit("kg.m2"), low=0.0), lambda g: g.outputs["J"] * ratio**2),
    )
    title = f"{capital(effort)}, power and {inertia_word}"
    yield fig.Figure(
        "linkage-turn",
        f"{title} over the way of the driver",
        f"{title} at the driver over its way.",
        fig.stacked(
            angle,
            (
                (
                    axis,
                    tuple(
                        fig.Curve(
                            way or axis.label, f.q, reader(findings), look, in_legend=bool(way) and k == 0
                        )
                        for look, (way, findings) in enumerate(ways.items())
                    ),
                )
                for k, (axis, reader) in enumerate(panels)
            ),
        ),
        file=PICTURES[1],
    )
    yield from linkage_loads.force_over_stroke(
        {way: _state(f, f.q, findings.speed) for way, findings in ways.items()},
        {way: f"on the way {way}" if way else "a turn at constant speed" for way in ways},
        PICTURES[3],
    )
    forces = {
        way: tuple(
            fig.Curve(
                name,
                f.q,
                np.hypot(findings.outputs[f"{v}.fx"], findings.outputs[f"{v}.fy"]),
                look=k,
                in_legend=way != "back",
            )
            for k, name in enumerate(f.joints)
            for v in [f.description.variable("joint", name)]
        )
        for way, findings in ways.items()
    }
    yield fig.Figure(
        "linkage-reactions", "Reactions over the way of the driver",
        "The force in each joint over the way of the driver.",
        tuple(
            (fig.Panel(angle, fig.Axis(f"force{', ' * bool(way)}{way}", "N", low=0.0), curves),)
            for way, curves in forces.items()
        ),
        file=PICTURES[2],
    )  # fmt: skip


def _title(f: LinkageFindings, name: str) -> Line:
    joint = f.description.structure.joints[name]
    return line(Name(name), f": {KINDS[joint.kind].noun}, on {joint.on[0]} from {joint.by[0]}")


def _along(f: LinkageFindings, name: str) -> Line:
    joint = f.description.structure.joints[name]
    return line(Name(name), f": {joint.on[0]} along {joint.by[0]}")


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


LinkageOutcome = tuple[LinkageFindings, str, tuple[UnusualValue, ...], tuple[str, ...]]
TASK: Task[LinkageQuestion, LinkageOutcome] = Task(
    "linkage",
    lambda question, folder, progress: (
        linkage_findings(question.machine, question.speed),
        question.file,
        question.unusual,
        question.remarks,
    ),
    lambda outcome: linkage_report(*outcome),
    files=PICTURES,
    accept=no_check,
    sources=lambda question: (Path(question.file),),
    tells_remarks=True,
)
