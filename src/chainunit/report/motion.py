"""The machine in motion: where every joint is and what it carries, picture by picture, for the page to play."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from ..engines import numpy_
from ..groups.chain import pins
from ..groups.loads import Resistance
from ..machines.chain_unit import ChamberForces, Inputs, SideLoads
from ..planar import Motion
from ..studies.bearings import PINS
from ..studies.study import Study
from .interactive import called, event_of, in_order

_XP = numpy_()
_PER_SECOND = 60
_PER_TURN = 90
MOST = 7000
"""Pictures of all runs together: a longer study is shown at a lower rate."""

# pin -> joint it acts at, short name, side
_AT = {
    "crank_bearing": ("O1", "O1", ""),
    "pivot": ("C", "C", ""),
    "left.support": ("A1 left", "A1", "left"),
    "left.hinge": ("B left", "B", "left"),
    "left.rocker_joint": ("A2", "A2", "left"),
    "right.support": ("A1 right", "A1", "right"),
    "right.hinge": ("B right", "B", "right"),
    "right.rocker_joint": ("A2", "A2", "right"),
}


def motion(study: Study) -> dict[str, Any]:
    """Joints [m], forces [N] and readings of every run, at about 60 pictures a second of machine time, more where
    the crank is fast. The rods of chains have joints of their own between the named ones.

    The positions are those of the kernels that the forces come from. A joint or force that does not move has
    one entry.
    """
    config = study.config
    p = study.drive.machine.p
    turn = 2.0 * math.pi / config.run.crank_speed
    interval = min(1.0 / _PER_SECOND, turn / _PER_TURN)
    spans = {name: float(run["time"].values[-1] - run["time"].values[0]) for name, run in study.runs.items()}
    interval = max(interval, sum(spans.values()) / MOST)
    runs = [_run(study, name, interval) for name in in_order(study)]
    links = [
        ("crank", "O1", "A", p.r),
        ("coupler", "A", "Bd", p.l),
        ("rocker", "C", "Bd", p.h),
        ("rocker", "C", "A2", p.e),
    ]
    walls, webs = _rods(study)
    for kind, length, span in (
        ("wall", p.l1 / walls, slice(walls + 1)),
        ("web", p.l2 / webs, slice(walls, None)),
    ):
        for side in ("left", "right"):
            ends = pairwise(_organ_joints(side, (walls, webs))[span])
            links += [(kind, start, end, length) for start, end in ends]
    return {
        "links": [
            {"kind": kind, "from": start, "to": end, "length": length} for kind, start, end, length in links
        ],
        "fixed": ["O1", "C", "A1 left", "A1 right"],
        "web_share": p.web_share,
        "turn": turn,
        "runs": runs,
    }


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


def _run(study: Study, name: str, interval: float) -> dict[str, Any]:
    run, p = study.runs[name], study.drive.machine.p
    time = run["time"].values
    wanted = np.arange(time[0], time[-1] + 0.5 * interval, interval)
    pictures = np.unique(np.minimum(np.searchsorted(time, wanted), len(time) - 1))
    part = run.isel(time=pictures)

    def value(series: str) -> Any:
        return part[series].values

    loads = {
        side: SideLoads(
            material_mass=value(f"machine.{side}.material_mass"),
            processing_force=value(f"machine.{side}.processing_force"),
        )
        for side in ("left", "right")
    }
    angle, speed = study.drive.crank_motion(part)
    inputs = Inputs(phi=angle * p.ratio, w=speed * p.ratio, a=0.0, left=loads["left"], right=loads["right"])
    state = ChamberForces.shared(_XP, p, inputs, None)
    joints = {name: pin.p for name, pin in state.m.pins.items()}
    processing = {side: state.effects[f"{side} processing"].wrenches[0].force for side in ("left", "right")}
    walls, webs = rods = _rods(study)
    for side in ("left", "right") if study.drive.chain is not None else ():
        names = _organ_joints(side, rods)[1:-1]
        a1, b, a2 = (joints[name] for name in (f"A1 {side}", f"B {side}", "A2"))
        if f"machine.{side}.theta_1" in part:
            moving = _chain(p, part, side, rods)
            between, v = [a1 + pin.p for pin in moving[1:-1]], moving[walls].p1
            law = Resistance(f"B {side}", loads[side].processing_force, p.processing)
            processing[side] = v * -law.per_speed(numpy_(), v.squared())
        else:
            # behind an open coupling the machine is followed with two bars
            between = [a1 + (b - a1) * (k / walls) for k in range(1, walls)]
            between += [b + (a2 - b) * (k / webs) for k in range(webs)]
        joints |= dict(zip(names, between, strict=True))
    reach = max(p.r, p.l, p.h, p.l1, p.z, p.c)
    forces = []
    for words, pin in PINS.items():
        if pin in _AT:
            joint, short, side = _AT[pin]
            xy = value(f"machine.{pin}.fx"), value(f"machine.{pin}.fy")
            forces.append((words, joint, short, side, "reaction", xy))
    for side, force in processing.items():
        forces.append((f"processing force {side}", f"B {side}", "P", side, "load", (force.x, force.y)))
    largest = max(float(np.max(np.hypot(*xy))) for *_, xy in forces)
    event = event_of(study, name)
    since = value("time") - (event or 0.0)
    return {
        "name": name,
        "title": called(study.config.events, name),
        "event": event is not None,
        # the picture that stands still until it is played
        "still": int(np.searchsorted(since, 0.0 if event is not None else study.settled)),
        "time": _list(since, max(since[-1] - since[0], 1e-9), 5),
        "angle": _list(np.degrees(angle) % 360.0, 360.0, 4),
        "speed": _list(speed, study.config.run.crank_speed, 4),
        "torque": _list(study.drive.crank_torque(part), None, 4),
        "material": {side: _list(load.material_mass, None, 3) for side, load in loads.items()},
        "joints": {
            joint: {"x": _list(v.x, reach, 5), "y": _list(v.y, reach, 5)} for joint, v in joints.items()
        },
        "largest": _list(largest, None, 4)[0],
        "forces": [
            {
                "title": words,
                "at": joint,
                "short": short,
                "side": side,
                "kind": kind,
                "x": _list(xy[0], largest, 4),
                "y": _list(xy[1], largest, 4),
            }
            for words, joint, short, side, kind, xy in forces
        ],
    }


def _list(x: Any, size: float | None, digits: int) -> list[float]:
    """Numbers rounded to `digits` digits of `size` (their own largest without one), one of them where all are
    the same."""
    x = np.nan_to_num(np.atleast_1d(np.asarray(x, float)))
    scale = size if size is not None else float(np.max(np.abs(x)))
    places = digits - 1 - math.floor(math.log10(scale)) if scale > 0.0 else 0
    # adding 0 makes -0 a 0
    rounded = np.round(x, places) + 0.0
    numbers = rounded.tolist() if places > 0 else [int(n) for n in rounded]
    return numbers[:1] if len(set(numbers)) == 1 else numbers
