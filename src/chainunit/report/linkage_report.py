"""The report on a linkage file: its groups, its motion, torque, inertia and reactions over the way of its driver."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np

from ..core.files import write_file
from ..machines.linkages.joint_kinds import KINDS
from ..machines.machine import Machine
from ..mechanism.machine import MachineState
from ..reading.results import as_data
from ..reading.tables import UnusualValue
from ..study.linkage_turn import LinkageData, LinkageFindings, Stroke, Swing, linkage_data, linkage_findings
from . import blocks as b
from . import figure as fig
from . import linkage, linkage_rest, machine_picture
from .cited import cited, exact, number, quantity_rows, table
from .drawing import drawing
from .lines import Line, Name, Number, Strong, capital, filled, join, line
from .motion import Animation, Clip, Reading
from .task import Task, no_check

PICTURES = (
    "linkage.svg", "linkage.png", "linkage_reactions.png", "linkage_stroke.png", "linkage_rest.png"
)  # fmt: skip
COPY = "linkage_copy.toml"
"""Name of the copy of the linkage file in the folder of the result."""
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
    text: str = ""
    """the linkage file; of a drawing the one into which it is translated"""


def linkage_report(
    findings: LinkageFindings,
    source: str,
    unusual: tuple[UnusualValue, ...] = (),
    remarks: tuple[str, ...] = (),
) -> b.Report:
    """The report on a linkage from the file `source`, which has these values of an unusual size, and on which there
    are `remarks`."""
    data = linkage_data(findings, source, unusual, [f"{capital(remark)}." for remark in remarks])
    unit = findings.machine.model.driver_port.unit
    x = cited(data, unit_of=unit)
    return b.Report(
        data.title,
        "Linkage",
        as_data(data, unit_of=unit),
        tuple(_opening(findings, x)),
        (
            b.Section("motion", "Motion", tuple(_motion(findings, x))),
            b.Section("live", "Try it", tuple(_live(findings, source))),
            b.Section("forces", "Effort, inertia and reactions", tuple(_forces(findings, x))),
            b.Section("rest", "At rest", tuple(linkage_rest.at_rest(findings, x.rest, PICTURES[4]))),
            b.Section("outputs", "Parameters, inputs and outputs", tuple(_variables(findings))),
        ),
        source=filled("Linkage file: {} · chainunit {}", x.source, x.chainunit),
        opening_title="The linkage",
    )


def _live(f: LinkageFindings, source: str) -> Iterator[b.Block]:
    """The live machine of the linkage."""

    def make() -> b.LiveMachine:
        # a page alone needs it
        from .live.machine import of_linkage

        return of_linkage(f.machine, f.speed, Path(source).name)

    yield b.Live(make, "the file")


def _opening(f: LinkageFindings, x: LinkageData) -> Iterator[b.Block]:
    """The groups and drivers in sentences, remarks on the file, and a drawing."""
    further = f.description.further
    lead = "The driver gives one degree of freedom: "
    if further.free:
        lead = f"The drivers give {1 + len(further.free)} degrees of freedom: "
    yield b.Text(line(lead, x.sentence, "."), central=True)
    yield from (b.Text(text, central=True) for text in _drivers(f))
    yield from (b.Text(remark, central=True) for remark in x.drawn)
    if x.slips:
        yield b.Judgement("remark", Strong("Is this what was meant?"), items=tuple(x.slips))
    yield from (b.Text(note, "note") for note in x.notes)
    yield b.Drawing(
        drawing(f.machine), "The linkage: its pins, links and dimensions", PICTURES[0],
        "A pair of hatched lines is a guide in the ground, a box a block, a ring a motor in a pin.",
    )  # fmt: skip


def _drivers(f: LinkageFindings) -> Iterator[Line]:
    """A sentence for each driver besides the first one."""
    first, driven = f.description.structure.driver, f.description.further
    noun = Name(first.joint if first.linear else first.link)
    for entry in driven.entries:
        name = Name(entry.name)
        if entry.law is None:
            yield line(
                "The driver ", name, " is an input of its own. In this report it stands at its place at the start; "
                "its effort is in the outputs ", Name(f"{driven.names[entry.name]}.tau"), ".",
            )  # fmt: skip
        else:
            drive = "a gear drives it, and" if entry.geared else "a motor of its own drives it, and"
            share = "contains" if entry.geared else "is without"
            text = f" follows by {entry.law}: {drive} the effort of "
            yield line("The driver ", name, text, noun, f" {share} its share.")


def _motion(f: LinkageFindings, x: LinkageData) -> Iterator[b.Block]:
    """Strokes, swings and time ratios, the links that turn or stand, the margins to dead positions, the limits of
    points, and the animation."""
    if f.strokes:
        strokes = {name: (_along(f, name), stroke) for name, stroke in x.strokes.items()}
        yield _ends(f, strokes.values(), "sliding joint", "stroke", "way")
        yield from _reversals(f, x, {name: f.description.variable("joint", name) for name in strokes})
    if f.swings:
        swings = [(Name(name), swing) for name, swing in x.swings.items()]
        yield _ends(f, swings, "link", "swing", "angle")
        yield from _reversals(f, x, {name: f.description.variable("link", name) for name in x.swings})
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
    yield from table(
        x.groups.items(),
        ("group", lambda row: join(map(Name, row[0].split(", ")))),
        ("least margin", lambda row: number(row[1].margin)),
        ("at", lambda row: number(row[1].margin_at)),
        title="Margins: the sine of the transmission angle, or its like; 0 is a dead position",
    )
    rows = (
        b.TableRow((Name(name), *map(number, cast("list[Number]", [*limits["x"], *limits["y"]]))))
        for name, limits in x.points.items()
    )
    heads = b.heads("point", "x from", "x to", "y from", "y to")
    yield b.Table(tuple(rows), heads, title="Limits of motion, points", form="long")
    yield _animation(f)


def _ends(
    f: LinkageFindings, motions: Iterable[tuple[Line, Stroke | Swing]], head: str, whole: str, way: str
) -> b.Table:
    """The table of the ends between which sliding joints or links move."""
    columns: list[tuple[Line | b.Column, Callable[[tuple[Line, Stroke | Swing]], b.Cell]]] = [
        (head, lambda row: row[0]),
        (f"least {way}", lambda row: number(row[1].least)),
        ("at", lambda row: number(row[1].least_at)),
        (f"largest {way}", lambda row: number(row[1].largest)),
        ("at", lambda row: number(row[1].largest_at)),
        (whole, lambda row: number(row[1].range)),
    ]
    if turns := f.machine.model.turns:
        columns += [
            (b.Column("forth over", form="long"), lambda row: number(row[1].forth)),
            ("time ratio", lambda row: number(row[1].time_ratio)),
        ]
    (ends,) = table(motions, *columns, title=f"{capital(whole)}{' and dead centres' * turns}")
    return ends


def _reversals(f: LinkageFindings, x: LinkageData, variables: Mapping[str, str]) -> Iterator[b.Block]:
    """A sentence for each sliding joint or link, by its name and its variable, that turns back more than twice in a
    turn."""
    for name, variable in variables.items():
        count = len(f.dead_centres[variable])
        if f.machine.model.turns and count > 2:
            places = join(map(number, cast("list[Number]", x.dead_centres[variable])))
            yield b.Text(line(Name(name), f" turns back {count} times in a turn: at ", places, "."))


def _animation(f: LinkageFindings) -> Animation:
    """The moving picture of a turn, or of the way there and back, at constant speed."""
    machine = f.machine
    low, _ = f.description.span
    ways = 2 if f.back else 1
    step = ways * (len(f.q) - 1) // _PICTURES
    q, speed = f.q[::step], np.full(_PICTURES // ways + 1, f.speed)
    time = (q - low) / f.speed
    if f.back:  # the last place is that of the way back, too
        q, speed = np.concatenate([q, q[-2::-1]]), np.concatenate([speed, -speed[1:]])
        time = np.concatenate([time, time[1:] + time[-1]])

    def over(values: Callable[[LinkageFindings], Any]) -> Any:
        """A quantity at the places of the pictures."""
        forth = values(f)[::step]
        return np.concatenate([forth, values(f.back)[::-1][::step][1:]]) if f.back else forth

    def force(output: str) -> tuple[Any, Any]:
        x, y = (over(lambda g, axis=axis: g.outputs[f"{output}.{axis}"]) for axis in ("fx", "fy"))  # type: ignore[misc]
        return x, y

    state = _state(f, q, speed)
    effort, unit = capital(machine_picture.driver_nouns(machine)[0]), machine.model.driver_port.unit
    readings = (
        Reading("Place of the driver", q, unit("rad")),
        Reading(f"{effort} at the driver", over(lambda g: g.outputs["tau"]) * machine.ratio, unit("N.m")),
    )
    clip = Clip(
        "turn",
        f"{'There and back at' if f.back else 'At'} constant speed",
        time,
        linkage.places(state.m),
        readings,
        (*machine_picture.arrows(machine, force), *machine_picture.load_arrows(state)),
        blocks=linkage.blocks(state.m),
    )
    caption = "An arrow is the force on a link from its neighbour; a dotted one is a force of the loads."
    return replace(
        machine_picture.picture(machine, state.m), runs=(clip,), turn=float(time[-1]), caption=caption
    )


def _state(f: LinkageFindings, q: Any, speed: Any) -> MachineState:
    """The machine at these places and speeds of its driver, with the loads of normal running."""
    machine = f.machine
    feed = machine.model.feed_layout.by_name(machine.model.Feed())
    return machine.state(machine.inputs({"phi": q * machine.ratio, "w": speed * machine.ratio, **feed}))


def _ways(f: LinkageFindings) -> dict[str, LinkageFindings]:
    """The findings by the direction in which the driver goes, without a name where there is one alone."""
    return {"forth": f, "back": f.back} if f.back else {"": f}


def _forces(f: LinkageFindings, x: LinkageData) -> Iterator[b.Block]:
    """Tables and figures of effort, power, inertia and reactions, by way of the driver."""
    both_ways = ", there and back over its range" if f.back else ""
    lead = f"Inverse dynamics at {{}} of the driver{both_ways}, with the loads of normal running."
    yield b.Text(filled(lead, exact(x.speed, 4)), "lead", central=True)
    effort, inertia = machine_picture.driver_nouns(f.machine)
    for way, forces in {"forth": x.forces, "back": x.back.forces}.items() if x.back else (("", x.forces),):
        on = f", on the way {way}" if way else ""
        title = f"{capital(effort)}, power and {inertia} at the driver{on}"
        yield b.Table(quantity_rows(forces.turn), title=title, central=True)
        yield from table(
            forces.joints.items(),
            ("joint", lambda row: _title(f, row[0])),
            ("largest force", lambda row: number(row[1].peak)),
            ("at", lambda row: number(row[1].peak_at)),
            ("RMS", lambda row: number(row[1].rms)),
            ("largest moment", lambda row: number(row[1].moment)),
            *[("least contact", lambda row: number(row[1].least))] * bool(f.machine.model.contacts),
            title=f"Reactions{on}",
            central=True,
        )
    for name, joint in f.joints.items():
        if joint.least is not None and joint.least < 0.0:
            text = "The follower would lift off at {}: the force of the contact falls to {}."
            yield b.Judgement("warning", filled(text, Name(name), number(x.forces.joints[name].least)))
    yield from table(
        (x.drivers or {}).items(),
        ("driver", lambda row: Name(row[0])),
        ("largest force or torque", lambda row: number(row[1]["peak"])),
        ("mean power", lambda row: number(row[1]["power_mean"])),
        title="Drivers besides the first one",
        central=True,
    )
    yield from _figures(f)


def _figures(f: LinkageFindings) -> Iterator[b.Block]:
    """The figures over the way of the driver, with a curve, or of reactions a panel, for each direction."""
    place, ways = machine_picture.driver_axis(f.machine), _ways(f)
    yield _turn_figure(f, place)
    states = (
        (f"on the way {way}" if way else "a turn at constant speed", _state(f, f.q, findings.speed))
        for way, findings in ways.items()
    )
    yield from machine_picture.force_over_stroke(states, PICTURES[3])
    yield fig.Figure(
        "linkage-reactions",
        "Reactions over the way of the driver",
        "The force in each joint over the way of the driver.",
        tuple((_reactions(f, place, way, findings),) for way, findings in ways.items()),
        file=PICTURES[2],
    )


def _turn_figure(f: LinkageFindings, place: fig.Axis) -> fig.Figure:
    """Effort, power and inertia at the driver."""
    effort, inertia = machine_picture.driver_nouns(f.machine)
    unit, ratio, ways = f.machine.model.driver_port.unit, f.machine.ratio, _ways(f)
    readers: dict[fig.Axis, Callable[[LinkageFindings], Any]] = {
        fig.Axis(f"{effort} at the driver", unit("N.m")): lambda g: g.outputs["tau"] * ratio,
        fig.Axis("power at the driver", "W"): lambda g: g.outputs["tau"] * ratio * g.speed,
        fig.Axis(f"reflected {inertia}", unit("kg.m2"), low=0.0): lambda g: g.outputs["J"] * ratio**2,
    }
    curves: dict[fig.Axis, list[fig.Curve]] = {axis: [] for axis in readers}
    for (k, (axis, reader)), (look, (way, findings)) in product(
        enumerate(readers.items()), enumerate(ways.items())
    ):
        is_named = bool(way) and k == 0
        curve = fig.Curve(way or axis.label, f.q, reader(findings), look, in_legend=is_named)
        curves[axis].append(curve)
    title = f"{capital(effort)}, power and {inertia}"
    return fig.Figure(
        "linkage-turn",
        f"{title} over the way of the driver",
        f"{title} at the driver over its way.",
        fig.stacked(place, curves.items()),
        file=PICTURES[1],
    )


def _reactions(f: LinkageFindings, place: fig.Axis, way: str, findings: LinkageFindings) -> fig.Panel:
    """The force in each joint on one way."""

    def force(name: str) -> Any:
        variable = f.description.variable("joint", name)
        return np.hypot(findings.outputs[f"{variable}.fx"], findings.outputs[f"{variable}.fy"])

    curves = (
        fig.Curve(name, f.q, force(name), k, in_legend=way != "back") for k, name in enumerate(f.joints)
    )
    return fig.Panel(place, fig.Axis(f"force{', ' * bool(way)}{way}", "N", low=0.0), tuple(curves))


def _title(f: LinkageFindings, name: str) -> Line:
    joint = f.description.structure.joints[name]
    return line(Name(name), f": {KINDS[joint.kind].noun}, on {joint.on[0]} from {joint.by[0]}")


def _along(f: LinkageFindings, name: str) -> Line:
    joint = f.description.structure.joints[name]
    return line(Name(name), f": {joint.on[0]} along {joint.by[0]}")


def _variables(f: LinkageFindings) -> Iterator[b.Block]:
    """Parameters and inputs with their values."""
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


LinkageOutcome = tuple[LinkageFindings, LinkageQuestion]
TASK: Task[LinkageQuestion, LinkageOutcome] = Task(
    "linkage",
    lambda question, folder, progress: (linkage_findings(question.machine, question.speed), question),
    lambda outcome: linkage_report(outcome[0], outcome[1].file, outcome[1].unusual, outcome[1].remarks),
    files=(*PICTURES, COPY),
    writers=lambda outcome, _, folder, other: [*other, lambda: write_file(folder / COPY, outcome[1].text)],
    accept=no_check,
    sources=lambda question: (Path(question.file),),
    tells_remarks=True,
)
