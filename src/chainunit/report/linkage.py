"""A linkage in pictures: its parts (links through pins, paths, supports, guides with their blocks), arrows for its
reactions and loads, and the force on each slide over its stroke: the working diagram of a press or a pump."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from ..machines.linkages.loads import ForceLaw, SpringDamper
from ..machines.machine import Machine
from ..mechanism.linkage import Linkage
from ..mechanism.machine import MachineState, Mechanism
from ..mechanism.sketch import places as places
from ..mechanism.sketch import shown_pins as shown_pins
from ..mechanism.sketch import supports as supports
from . import figure as fig
from .motion import Animation, Arrow, DrawnLink

_DESCRIBED = ForceLaw | SpringDamper
"""Loads that a linkage file describes."""


def picture(machine: Machine, way: Mechanism) -> Animation:
    """The parts of the picture of a machine that no run changes; `way` is its mechanism over the whole way of its
    driver."""
    driver, turns = way.linkage.driver, machine.model.turns
    return Animation(
        tuple(links(way.linkage)),
        supports(way.linkage),
        hanging=hanging(way),
        circles=(*[(driver.bar.pin, driver.end)] * turns, *way.linkage.circles),
        names=labels(way.linkage),
        paths=paths(way, "" if turns else driver.end),
        rails=rails(way),
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


def links(linkage: Linkage) -> Iterator[DrawnLink]:
    """The links as they are drawn, the crank first. Links with a pin in the ground are heavier than the others; a
    link with more than two pins is an area."""
    shown = shown_pins(linkage)
    for name, carried in linkage.topology.links.items():
        pins = tuple(pin for pin in carried if pin in shown)
        crank, grounded = name == linkage.driver.bar.name, any(pin in linkage.ground for pin in pins)
        look = "crank" if crank else "heavy" if grounded else "light"
        yield DrawnLink(name, pins, look, closed=len(pins) > 2)


def rails(turn: Mechanism) -> dict[str, tuple[tuple[float, float], tuple[float, float]]]:
    """The ends of the way of each block that slides in the ground, by its pin [m]; `turn` is the mechanism over a
    whole turn."""
    ways = {}
    for connections in turn.topology.groups:
        for joint, carrier, _ in connections.joints:
            if joint in turn.slides and carrier is None:
                place, d = turn.pins[joint[0]].p, turn.slides[joint].d
                s = np.atleast_1d(turn.slides[joint].s)
                x, y = (np.broadcast_to(v, s.shape) for v in (place.x, place.y))
                low, high = int(np.argmin(s)), int(np.argmax(s))
                margin = 0.25 * float(np.ptp(s)) + 1e-9
                dx, dy = (float(np.atleast_1d(v)[0]) * margin for v in (d.x, d.y))
                ways[joint[0]] = (
                    (float(x[low]) - dx, float(y[low]) - dy), (float(x[high]) + dx, float(y[high]) + dy)
                )  # fmt: skip
    return ways


def paths(turn: Mechanism, further: str = "") -> dict[str, tuple[Any, Any]]:
    """The paths of all points that are not pins, and of one `further` point [m]; `turn` is the mechanism over the
    whole way of its driver."""
    topology, positions = turn.topology, places(turn)
    pins = {pin for pin, _ in topology.joints}
    return {
        f"path of {point}": positions[point]
        for points in topology.points.values()
        for point in points
        if point in positions and (point not in pins or point == further)
    }


def hanging(turn: Mechanism) -> tuple[str, ...]:
    """The ground pins from which links hang, so that their supports are drawn above; `turn` is the mechanism over a
    whole turn."""
    low: dict[str, list[float]] = {}
    positions = places(turn)
    for pins in turn.topology.links.values():
        for pin in pins:
            if pin in turn.linkage.ground:
                ends = (end for end in pins if end != pin and end in positions)
                low.setdefault(pin, []).extend(float(np.mean(positions[end][1])) for end in ends)
    span = max(float(np.ptp([np.mean(y) for _, y in positions.values()])), 1e-9)
    return tuple(pin for pin, ends in low.items() if ends and np.mean(ends) < positions[pin][1] - 0.1 * span)


def blocks(mechanism: Mechanism) -> dict[str, Any]:
    """The angle of the line of each sliding block [rad], by its pin."""
    return {pin: np.arctan2(slide.d.y, slide.d.x) for (pin, _), slide in mechanism.slides.items()}


def labels(linkage: Linkage) -> dict[str, str]:
    """The labels of pins that differ from their names: a further point of a link at a pin of its name has none."""
    shown = shown_pins(linkage)
    return {pin: "" for pin in shown if "." in pin and pin.rpartition(".")[2] in shown}


def reactions(machine: Machine) -> Iterator[tuple[str, str, str, str]]:
    """Output, title, joint and name in the picture of each reaction. The name is the title in a linkage file, else
    empty, for that of the joint."""
    model = machine.model
    is_file = hasattr(model, "described_by")
    for title, output in model.pins.items():
        if output in model.joints:
            yield output, title, model.joints[output][0], title if is_file else ""


def arrows(
    machine: Machine,
    force: Callable[[str], tuple[Any, Any]],
    groups: Mapping[str, str] | None = None,
    hidden: Collection[str] = (),
) -> Iterator[Arrow]:
    """An arrow for each reaction, but those of the `hidden` outputs. `groups` gives the group of an output, `force`
    the components of its reaction [N]."""
    for output, title, joint, short in reactions(machine):
        if output not in hidden:
            yield Arrow(title, joint, *force(output), short=short, group=(groups or {}).get(output, ""))


def has_loads(linkage: Linkage) -> bool:
    """Whether `load_arrows` draws any load."""
    return any(isinstance(load, _DESCRIBED) for load in linkage.loads.values())


def load_arrows(state: MachineState) -> Iterator[Arrow]:
    """An arrow for each force and each end of a spring that a linkage file describes."""
    shown = shown_pins(state.m.linkage)
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
            if joint in m.slides and carrier is None and forces:
                slide, place = m.slides[joint], m.pins[joint[0]].p
                way, force = (
                    np.broadcast_to(x, np.shape(m.q))
                    for x in (slide.d.dot(place), sum(f.dot(slide.d) for f in forces))
                )
                along[joint[1]] = way, force
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
