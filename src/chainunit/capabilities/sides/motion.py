"""The working organs of a chain unit in motion: chains, the material on them, the processing forces."""

from __future__ import annotations

from typing import Any

from ...core.engines import numpy_
from ...core.planar import Vec2
from ...groups.chain import pins
from ...groups.loads import Resistance
from ...machines.across import BEARINGS
from ...machines.api import ChainedUnit
from ...machines.chain_unit import NAMES, ON_SIDE, OrganNames, SideName
from ...mechanism.machine import MachineState
from ...report.capability import Details, Supplement
from ...report.motion import Arrow
from ...study.drive import Drive

_CAPTION = (
    "Blue, full: left side; red, dashed: right side; black: crank bearing O1 and rocker pivot C. An arrow is the "
    "force on the machine part from its support or neighbour: at A1 on the wall, at B on the wall from the web, at "
    "A2 on the web from the rocker; P, dotted, is the processing force on the web. The brown band is the material; "
    "its width goes with its mass. Joints move as in the simulated run."
)


def organ_motion(drive: Drive) -> Supplement:
    """The supplement with the organs of both sides, each side in its colour; wall and web are the rods between their
    joints. Joints inside a wall or a web have no name in the picture."""
    wall_rods, _ = rods = _rods(drive)
    links, side_of_output = dict[str, tuple[str, ...]](), dict[str, str]()
    inner_names, pin_names = dict[str, str](), dict[str, str]()
    for side, names in NAMES.items():
        joints = _joints(names, rods)
        wall, web = tuple(joints[: wall_rods + 1]), tuple(joints[wall_rods:])
        links |= {names.wall: wall, names.web: web}
        inner_names |= dict.fromkeys((*wall[1:-1], *web[1:-1]), "")
        pin_names |= {names.a1: "A1", names.b: "B"}
        for output, (_, link) in ON_SIDE.items():
            if link in (names.wall, names.web):
                side_of_output[output] = side
    return OrganMotion(
        drive,
        _CAPTION,
        links,
        looks=dict.fromkeys(links, "chain"),
        names=inner_names | pin_names,
        groups=side_of_output,
        # their arrows would hide the arrows of the rocker
        hidden=("crank_pin", "coupler_pin", *(output for _, output, _ in BEARINGS)),
    )


def _rods(drive: Drive) -> tuple[int, int]:
    """Numbers of rods in wall and web of an organ."""
    machine = drive.simulated_machine
    return machine.rods if isinstance(machine, ChainedUnit) else (1, 1)


def _joints(names: OrganNames, rods: tuple[int, int]) -> list[str]:
    """The joints of an organ from A1 to A2."""
    walls, webs = rods
    joints = [f"rod {k} {names.web}" for k in range(1, walls + webs)]
    joints[walls - 1] = names.b
    return [names.a1, *joints, "A2"]


class OrganMotion(Supplement):
    """Adds the organs to the picture of a chain unit."""

    def details(self, part: Any, state: MachineState) -> Details:
        """The inner joints of chains, the processing forces, and the material on each link."""
        share = self.drive.machine.p.web_share
        joints: dict[str, tuple[Any, Any]] = {}
        loads: dict[str, Any] = {}
        arrows = []
        for side, names in NAMES.items():
            force = state.effects[names.processing].wrenches[0].force
            if self.drive.machine.in_place:
                inner, force = self._chain(part, state, side)
                between = _joints(names, _rods(self.drive))[1:-1]
                joints |= {pin: (place.x, place.y) for pin, place in zip(between, inner, strict=True)}
            arrows.append(Arrow(f"processing force {side}", names.b, force.x, force.y, "P", side, load=True))
            material = part[f"machine.{side}.material_mass"].values
            loads |= {names.wall: (1.0 - share) * material, names.web: share * material}
        return Details(joints, tuple(arrows), loads)

    def _chain(self, part: Any, state: MachineState, side: SideName) -> tuple[list[Vec2], Vec2]:
        """The places of the inner joints of a chain [m], and its processing force [N]."""
        drive, names = self.drive, NAMES[side]
        p, (walls, webs) = drive.machine.p, _rods(drive)
        rods = range(1, walls + webs + 1)
        theta = [part[f"machine.{side}.theta_{k}"].values for k in rods]
        omega = [part[f"machine.{side}.omega_{k}"].values for k in rods]
        chain = pins([p.l1 / walls] * walls + [p.l2 / webs] * webs, theta, omega, numpy_())
        v, force = chain[walls].p1, part[f"machine.{side}.processing_force"].values
        law = Resistance(names.b, force, p.processing)
        a1 = state.m.pins[names.a1].p
        return [a1 + pin.p for pin in chain[1:-1]], v * -law.per_speed(numpy_(), v.squared())
