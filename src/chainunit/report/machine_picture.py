"""The picture of a machine: its parts, arrows for its reactions and loads, the nouns and the axis of its driver, and
the force on each slide over its stroke, which is the working diagram of a press or a pump."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from ..groups.driver import Crank
from ..machines.linkages.loads import ForceLaw, SpringDamper
from ..machines.machine import Machine
from ..mechanism.machine import MachineState, Mechanism
from . import figure as fig
from . import linkage
from .motion import Animation, Arrow

_DESCRIBED = ForceLaw | SpringDamper
"""Loads that a linkage file describes."""


def picture(machine: Machine, way: Mechanism) -> Animation:
    """The parts of the picture of a machine that no run changes; `way` is its mechanism over the whole way of its
    driver."""
    driver, turns = way.linkage.driver, machine.model.turns
    has_circle = turns and isinstance(driver, Crank) and driver.bar.pin != driver.end
    circles = [(driver.bar.pin, driver.end)] if has_circle else []
    outlines = {}
    for name, outline in way.linkage.outlines.items():
        corners = outline.points()
        outlines[name] = {"at": outline.pin, "points": np.round([corners.x, corners.y], 6).T.tolist()}
    return Animation(
        tuple(linkage.links(way.linkage)),
        linkage.supports(way.linkage),
        hanging=linkage.hanging(way),
        circles=(*circles, *way.linkage.circles),
        outlines=outlines,
        names=linkage.labels(way.linkage),
        paths=linkage.paths(way, "" if turns else driver.end),
        rails=linkage.rails(way),
    )


def driver_nouns(machine: Machine) -> tuple[str, str]:
    """The nouns of the effort and of the inertia at the driver."""
    return ("force", "mass") if machine.model.slides else ("torque", "inertia")


def driver_axis(machine: Machine, low: float | None = None, high: float | None = None) -> fig.Axis:
    """The axis of the place of the driver."""
    model = machine.model
    label = f"{'way' if model.slides else 'angle'} of the driver"
    return fig.Axis(
        label, model.driver_port.unit("rad"), low=low, high=high, step=45.0 if model.turns else None
    )


def reactions(machine: Machine) -> Iterator[tuple[str, str, str, str]]:
    """Output, title, joint and name in the picture of each reaction. The name is the title in a linkage file, else
    empty, for that of the joint. The share of a reaction, whose arrow would cover that of the whole, has an empty
    joint."""
    model, wholes = machine.model, set()
    is_file = hasattr(model, "described_by")
    for title, output in model.pins.items():
        if output in model.joints:
            joint = model.joints[output]
            yield output, title, "" if joint in wholes else joint[0], title if is_file else ""
            wholes.add(joint)


def arrows(
    machine: Machine,
    force: Callable[[str], tuple[Any, Any]],
    groups: Mapping[str, str] | None = None,
    hidden: Collection[str] = (),
) -> Iterator[Arrow]:
    """An arrow for each reaction, but shares and `hidden` outputs. `groups` gives the group of an output, `force`
    the components of its reaction [N]."""
    for output, title, joint, short in reactions(machine):
        if joint and output not in hidden:
            yield Arrow(title, joint, *force(output), short=short, group=(groups or {}).get(output, ""))


def has_loads(mechanism: Mechanism) -> bool:
    """Whether `load_arrows` draws any load."""
    return any(isinstance(load, _DESCRIBED) for load in mechanism.linkage.loads.values())


def load_arrows(state: MachineState) -> Iterator[Arrow]:
    """An arrow for each force and each end of a spring that a linkage file describes."""
    shown = linkage.shown_pins(state.m.linkage)
    for name, effect in state.effects.items():
        load, title = state.m.linkage.loads[name], name.removeprefix("loads.")
        points: dict[str, str] = {}
        if isinstance(load, ForceLaw):
            points = {load.link: load.point}
        elif isinstance(load, SpringDamper):
            points = {link: pin for link, pin in load.ends if link is not None}
        for wrench in effect.wrenches:
            if wrench.link in points:
                joint = points[wrench.link]
                # a further point of a link at a pin has its place under the name of the pin
                joint = joint if joint in shown else joint.rpartition(".")[2]
                yield Arrow(title, joint, wrench.force.x, wrench.force.y, short=title, load=True)


def loads_on_slides(state: MachineState) -> dict[str, tuple[Any, Any]]:
    """By the name of a link that slides in the ground and carries loads: its way from the least place on [m], and the
    force of all its loads along its line, positive in the direction of the way [N]."""
    m, loads = state.m, state.m.linkage.loads
    described = [name for name, load in loads.items() if isinstance(load, _DESCRIBED)]
    wrenches = [wrench for name in described for wrench in state.effects[name].wrenches]
    along: dict[str, tuple[Any, Any]] = {}
    for connections in m.topology.groups:
        for joint, carrier, _ in connections.joints:
            forces = [wrench.force for wrench in wrenches if wrench.link == joint[1]]
            if joint in m.slides and m.slides[joint].s is not None and carrier is None and forces:
                slide, place = m.slides[joint], m.pins[joint[0]].p
                way, force = slide.d.dot(place), sum(f.dot(slide.d) for f in forces)
                along[joint[1]] = np.broadcast_to(way, np.shape(m.q)), np.broadcast_to(force, np.shape(m.q))
    return along


def force_over_stroke(runs: Iterable[tuple[str, MachineState]], file: str = "") -> Iterator[fig.Figure]:
    """The figure, a panel for each loaded slide; nothing where no load acts on a slide of the ground. `runs` are
    titles, each with the machine over a run."""
    ways = [(title, loads_on_slides(state)) for title, state in runs]
    panels = []
    for link in ways[0][1] if ways else ():
        least = min(float(np.min(slides[link][0])) for _, slides in ways)
        curves = tuple(
            fig.Curve(title, slides[link][0] - least, slides[link][1], look, in_legend=len(ways) > 1)
            for look, (title, slides) in enumerate(ways)
        )
        x = fig.Axis(f"way of {link} from its least place", "m", "millimetres")
        forces = [0.0, *(end for curve in curves for end in (np.min(curve.y), np.max(curve.y)))]
        margin = 0.06 * float(np.ptp(forces))
        y = fig.Axis("force of the loads", "N", low=min(forces) - margin, high=max(forces) + margin)
        panels.append(fig.Panel(x, y, curves))
    if panels:
        yield fig.Figure(
            "force-over-stroke",
            "Force of the loads over the stroke",
            "The force of the loads on each slide along its line over its way.",
            tuple((panel,) for panel in panels),
            "Positive: in the direction of the way. The area within a closed curve is the work of a turn.",
            file=file,
        )
