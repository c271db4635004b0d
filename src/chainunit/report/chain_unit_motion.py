"""The chain unit in motion: where every joint is in each run, and what it carries."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ..engines import numpy_
from ..groups.chain import pins
from ..groups.loads import Resistance
from ..machines.chain_unit import SIDES, ChamberForces, Inputs, SideLoads, SideName
from ..planar import Motion
from ..study.study import Study
from . import accessors as read
from . import linkage
from .motion import Animation, Arrow, Clip, Reading

_PER_SECOND = 60
_PER_TURN = 90
MOST = 7000
"""Pictures of all runs together: a longer study is shown at a lower rate."""

_LOOKS = {"coupler": "light", "rocker": "heavy", "left web": "chain", "right web": "chain"}
_ORGAN = {"support": "A1 {}", "hinge": "B {}", "rocker_joint": "A2"}
_SIDE_OF = {f"{side}.{name}": side for side in SIDES for name in _ORGAN}
_JOINTS = {"crank_bearing": "O1", "pivot": "C"} | {
    f"{side}.{name}": joint.format(side) for side in SIDES for name, joint in _ORGAN.items()
}
"""By output, the joint of its reaction; the pins of the coupler would hide those of the rocker."""
_CAPTION = (
    "Blue, full: left side; red, dashed: right side; black: crank bearing O1 and rocker pivot C. An arrow is the "
    "force on the machine part from its support or neighbour: at A1 on the wall, at B on the wall from the web, at "
    "A2 on the web from the rocker; P, dotted, is the processing force on the web. The brown band is the material; "
    "its width goes with its mass. Joints are those of the simulated run."
)


def motion(study: Study) -> Animation:
    """Every run at about 60 pictures a second of machine time, more where the crank is fast."""
    turn = 2.0 * math.pi / study.config.run.crank_speed
    interval = min(1.0 / _PER_SECOND, turn / _PER_TURN)
    spans = (float(np.ptp(run["time"].values)) for run in study.runs.values())
    interval = max(interval, sum(spans) / MOST)
    rods = _rods(study)
    chains = {
        f"{side} {rod}": tuple(_organ_joints(side, rods)[span])
        for side in SIDES
        for rod, span in (("wall", slice(rods[0] + 1)), ("web", slice(rods[0], None)))
    }
    inner = {pin: "" for joints in chains.values() for pin in joints[1:-1]}
    plan = ChamberForces.linkage(study.drive.machine.p, Inputs())
    links = (replace(link, joints=chains.get(link.name, link.joints)) for link in linkage.links(plan, _LOOKS))
    return Animation(
        tuple(links),
        tuple(plan.ground),
        tuple(_run(study, name, interval, rods) for name in read.in_order(study)),
        turn,
        _CAPTION,
        hanging=("C", "A1 left", "A1 right"),
        orbit=("O1", "A"),
        groups=SIDES,
        names=inner | {f"{pin} {side}": pin for pin in ("A1", "B") for side in SIDES},
    )


def _rods(study: Study) -> tuple[int, int]:
    """How many rods wall and web have."""
    return (1, 1) if study.drive.chain is None else study.drive.rods


def _organ_joints(side: str, rods: tuple[int, int]) -> list[str]:
    """The joints of an organ from A1 to A2."""
    walls, webs = rods
    names = [f"rod {k} {side}" for k in range(1, walls + webs)]
    names[walls - 1] = f"B {side}"
    return [f"A1 {side}", *names, "A2"]


def _chain(p: Any, part: Any, side: str, rods: tuple[int, int]) -> list[Motion]:
    """Places, from A1, and velocities of the joints of a simulated chain."""
    walls, webs = rods
    theta, omega = (
        [part[f"machine.{side}.{x}_{k}"].values for k in range(1, walls + webs + 1)]
        for x in ("theta", "omega")
    )
    return pins([p.l1 / walls] * walls + [p.l2 / webs] * webs, theta, omega, numpy_())


def _positions(
    study: Study, part: Any, loads: Mapping[SideName, SideLoads], rods: tuple[int, int]
) -> tuple[dict[str, Any], dict[SideName, Any]]:
    """Joints [m] and the processing force of each side [N]. The positions are those of the kernels that the forces
    come from; the rods of chains have joints of their own between the named ones."""
    p = study.drive.machine.p
    angle, speed = study.drive.crank_motion(part)
    inputs = Inputs(phi=angle * p.ratio, w=speed * p.ratio, a=0.0, left=loads["left"], right=loads["right"])
    state = ChamberForces.shared(numpy_(), p, inputs, None)
    joints = {name: pin.p for name, pin in state.m.pins.items()}
    processing = {side: state.effects[f"{side} processing"].wrenches[0].force for side in SIDES}
    walls, webs = rods
    for side in SIDES if study.drive.chain is not None else ():
        a1, b, a2 = (joints[name] for name in (f"A1 {side}", f"B {side}", "A2"))
        if f"machine.{side}.theta_1" in part:
            chain = _chain(p, part, side, rods)
            between, v = [a1 + pin.p for pin in chain[1:-1]], chain[walls].p1
            law = Resistance(f"B {side}", loads[side].processing_force, p.processing)
            processing[side] = v * -law.per_speed(numpy_(), v.squared())
        else:
            # behind an open coupling the machine is followed with two bars
            between = [a1 + (b - a1) * (k / walls) for k in range(1, walls)]
            between += [b + (a2 - b) * (k / webs) for k in range(webs)]
        joints |= dict(zip(_organ_joints(side, rods)[1:-1], between, strict=True))
    return joints, processing


def _run(study: Study, name: str, interval: float, rods: tuple[int, int]) -> Clip:
    run, share = study.runs[name], study.drive.machine.p.web_share
    time = run["time"].values
    instants = np.arange(time[0], time[-1] + 0.5 * interval, interval)
    part = run.isel(time=np.unique(np.minimum(np.searchsorted(time, instants), len(time) - 1)))

    def value(series: str) -> Any:
        return part[f"machine.{series}"].values

    loads = {
        side: SideLoads(
            material_mass=value(f"{side}.material_mass"), processing_force=value(f"{side}.processing_force")
        )
        for side in SIDES
    }
    joints, processing = _positions(study, part, loads, rods)
    forces = (
        *linkage.arrows(
            read.PINS, _JOINTS, lambda output: (value(f"{output}.fx"), value(f"{output}.fy")), _SIDE_OF
        ),
        *(
            Arrow(f"processing force {side}", f"B {side}", force.x, force.y, "P", side, load=True)
            for side, force in processing.items()
        ),
    )
    angle, speed = study.drive.crank_motion(part)
    readings = (
        Reading("Crank angle", angle % (2.0 * math.pi), "rad"),
        Reading("Crank speed", speed, "rad/s"),
        Reading("Crank torque", study.drive.crank_torque(part), "N.m"),
        *(Reading(f"Material {side}", loads[side].material_mass, "kg") for side in SIDES),
    )
    material = {
        f"{side} {rod}": carried * loads[side].material_mass
        for side in SIDES
        for rod, carried in (("wall", 1.0 - share), ("web", share))
    }
    event = read.event_time(study, name)
    since = part["time"].values - (event or 0.0)
    places = {joint: (at.x, at.y) for joint, at in joints.items()}
    still = study.settled if event is None else 0.0
    title = read.title(study, name)
    return Clip(name, title, since, places, readings, forces, material, event is not None, still)
