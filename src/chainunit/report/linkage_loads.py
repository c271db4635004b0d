"""The loads of a linkage file: arrows in the picture, and the force on each slide over its stroke, which is the
working diagram of a press or a pump."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ..machines.linkages.loads import ForceLaw, SpringDamper
from ..mechanism.linkage import Linkage
from ..mechanism.machine import MachineState
from ..mechanism.sketch import shown_pins
from . import figure as fig
from .motion import Arrow


def has_loads(linkage: Linkage) -> bool:
    """Whether `load_arrows` draws any load."""
    return any(isinstance(load, ForceLaw | SpringDamper) for load in linkage.loads.values())


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
    described = [name for name, load in loads.items() if isinstance(load, ForceLaw | SpringDamper)]
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


def force_over_stroke(
    states: Mapping[str, MachineState], titles: Mapping[str, str], file: str = ""
) -> Iterator[fig.Figure]:
    """The figure, a panel for each loaded slide; nothing where no load acts on a slide of the ground.

    Parameters
    ----------
    states : the machine over each run, by its name
    titles : of the runs
    """
    runs = {name: loads_on_slides(state) for name, state in states.items()}
    panels = []
    for link in next(iter(runs.values()), {}):
        least = min(float(np.min(slides[link][0])) for slides in runs.values())
        curves = tuple(
            fig.Curve(titles[name], slides[link][0] - least, slides[link][1], look, in_legend=len(runs) > 1)
            for look, (name, slides) in enumerate(runs.items())
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
