"""The animation of a study: the place of every joint in each run, and the force in it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ..mechanism.machine import MachineState
from ..mechanism.models import CrankMotion, names_of
from ..study.drive import Drive
from ..study.readings import crank_motion, crank_torque
from ..study.record import StudyRecord, StudyRuns
from . import linkage, machine_picture, run_names
from .capability import Supplement, capabilities
from .lines import capital
from .motion import Animation, Clip, DrawnLink, Reading

_PER_SECOND = 60
_PER_TURN = 90
MOST = 7000
"""The largest number of pictures of all runs together; a longer study is shown at a lower rate."""
_CAPTION = "An arrow is the force on a part of the machine from its support or neighbour{}{}."
_LOADS = "; a dotted one is a force of the loads"


def motion(study: StudyRecord) -> Animation:
    """The animation of every run, at about 60 pictures per second of machine time, more where the crank is fast."""
    drive = study.setup.drive
    machine = drive.machine
    turn = study.setup.config.operation.turn
    interval = min(1.0 / _PER_SECOND, turn / _PER_TURN)
    spans = (float(np.ptp(run["time"].values)) for run in study.runs.series.values())
    interval = max(interval, sum(spans) / MOST)
    supplements = (part.supplement(drive) for part in capabilities())
    supplement = next((candidate for candidate in supplements if candidate is not None), Supplement(drive))
    angles = np.linspace(0.0, 2.0 * math.pi, _PER_TURN + 1)
    whole_turn = machine.drive(angles * machine.ratio)
    picture = machine_picture.picture(machine, whole_turn)
    loads = _LOADS if machine_picture.has_loads(whole_turn) else ""
    thin_lines = f"; a thin line is the {', the '.join(picture.paths)}" if picture.paths else ""
    return replace(
        picture,
        links=tuple(_links(picture.links, supplement)),
        runs=tuple(_run(study.runs, name, interval, supplement) for name in run_names.in_order(study.runs)),
        turn=turn,
        caption=supplement.caption or _CAPTION.format(loads, thin_lines),
        groups=tuple(dict.fromkeys(supplement.groups.values())),
        names={**picture.names, **supplement.names},
    )


def _links(links: Iterable[DrawnLink], supplement: Supplement) -> Iterator[DrawnLink]:
    """The links with the joints and looks of a supplement, and then its further links."""
    others = dict(supplement.links)
    for link in links:
        look = supplement.looks.get(link.name, link.look)
        yield replace(link, joints=others.pop(link.name, link.joints), look=look)
    yield from (
        DrawnLink(name, joints, supplement.looks.get(name, "heavy")) for name, joints in others.items()
    )


def _loads(drive: Drive, part: Any) -> dict[str, Any]:
    """The inputs of the machine in rows of a run, besides the motion of its shaft, by name."""
    return {
        v.name: part[f"machine.{v.name}"].values
        for v in drive.machine.model.input_layout.variables
        if f"machine.{v.name}" in part and v.name not in names_of(CrankMotion)
    }


def machine_state(drive: Drive, part: Any) -> MachineState:
    """The machine in rows of a run, at the place and speed that the crank has there."""
    machine = drive.machine
    angle, speed = crank_motion(drive, part)
    motion = {"phi": angle * machine.ratio, "w": speed * machine.ratio}
    return machine.state(machine.inputs({**motion, **_loads(drive, part)}))


def _run(runs: StudyRuns, name: str, interval: float, supplement: Supplement) -> Clip:
    """The clip of a run at equal `interval`s [s]; `supplement` has what the model of the machine adds to its
    picture."""
    run, drive = runs.series[name], runs.drive
    model = drive.machine.model
    time = run["time"].values
    instants = np.arange(time[0], time[-1] + 0.5 * interval, interval)
    # the row of the run at or behind each instant
    part = run.isel(time=np.unique(np.minimum(np.searchsorted(time, instants), len(time) - 1)))
    angle, speed = crank_motion(drive, part)
    loads = _loads(drive, part)
    state = machine_state(drive, part)
    details = supplement.details(part, state)
    forces = machine_picture.arrows(
        drive.machine,
        lambda output: (part[f"machine.{output}.fx"].values, part[f"machine.{output}.fy"].values),
        supplement.groups,
        supplement.hidden,
    )
    has_motor, driver = name in run_names.motor_runs(runs), capital(runs.drive.driver_noun)
    readings = (
        Reading(f"{driver} angle", angle % (2.0 * math.pi), "rad"),
        Reading(f"{driver} speed", speed, "rad/s"),
        *([Reading(f"{driver} torque", crank_torque(drive, part), "N.m")] if has_motor else []),
        *(
            Reading(capital(v.description), loads[v.name], v.unit, v.kind)
            for v in model.feed_layout.variables
            if v.name in loads
        ),
    )
    event = run_names.event_time(runs, name)
    return Clip(
        name=name,
        title=run_names.title(runs, name),
        time=part["time"].values - (event or 0.0),
        joints={**linkage.places(state.m), **details.joints},
        readings=readings,
        arrows=(*forces, *machine_picture.load_arrows(state), *details.arrows),
        loads=details.loads,
        blocks=linkage.blocks(state.m),
        event=event is not None,
        still=runs.steady_begin if event is None else 0.0,
    )
