"""The chain unit across its width: two rockers on one axle, joined by the bar on which the webs hang.

Paper 000 draws two rockers that coincide in the plane, and one coupler in the plane of symmetry between them. So the
coupler, the weights and the inertia of drive and empty organs load both rockers alike. Material and processing force
may lie beside the middle, at the place s: 1 at the front rocker, -1 at the back one. Webs and walls are flexible, so
that a load comes in its strip to the rigid bar. By the lever rule the front rocker takes the share (1 + s)/2 of its
force in A2 and of its reaction in C. The moments of both rockers about C differ: the bar passes half of the
difference as torsion, though the axle helps it. It bends as a beam on two supports, under material that lies evenly
on the widest strip whose middle is s, and a processing force at one point.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from ..core.errors import InputError
from ..core.model import Requirement
from ..core.planar import ZERO, Vec2
from ..core.quantities import Value, declaration, declared_class, group, quantity
from ..mechanism.machine import MachineState
from ..mechanism.models import InverseMachine
from .differing import with_pins
from .parts import Force, force

ROWS = ("front", "back")
"""The rockers; the place 1 is at the first one."""
PLACES: Mapping[str, str] = {"material_mass": "across", "processing_force": "force_across"}
"""By load of an organ, the name of its place across the width."""
NO_WIDTH = "a load has a place across rockers that stand a width apart; give machine.width"
"""The refusal of a place where a study has no width."""
_PLACE = "place across: 0 middle, 1 front rocker, -1 back rocker"


def place(what: str) -> Any:
    """The declaration of the place of a load across the width."""
    return quantity("1", f"{what}, {_PLACE}", default=0.0, min=-1.0, max=1.0)


def middle_of(*loads: tuple[float, float]) -> float:
    """The place of several loads together, each by its size and its place; 0 without a load."""
    whole = math.fsum(size for size, _ in loads)
    return math.fsum(size * place for size, place in loads) / whole if whole else 0.0


@declaration
class BarSection:
    """The section of the bar that joins the rockers, a tube or a solid one, and its permitted stress."""

    diameter: Value = quantity("m", "outer diameter", default=0.08, above=0.0, max=10.0)
    bore: Value = quantity("m", "inner diameter; 0 for a solid bar", default=0.0, min=0.0, max=10.0)
    limit: Value = quantity(
        "N/m2", "permitted equivalent stress", default=1e8, above=0.0, max=1e11, kind="stress", tunable=True
    )


@declaration
class RockerShare:
    """The share of one rocker."""

    pivot: Force = group(Force, "on this rocker at C, from the frame")
    left_pin: Force = group(Force, "on the left web at A2, from this rocker")
    right_pin: Force = group(Force, "on the right web at A2, from this rocker")
    tau: Value = quantity("N.m", "torque along psi that carries its share of both organs", nominal=100.0)


@declaration
class BarLoad:
    """The load of the bar that joins the rockers."""

    torsion: Value = quantity("N.m", "torque in the bar, if the axle in C takes none", nominal=100.0)
    bending: Value = quantity(
        "N.m", "bending moment in the bar, the sum of the largest ones of all loads", nominal=100.0
    )


@declaration
class LoadedBar(BarLoad):
    """The load of the bar and of its section."""

    stress: Value = quantity("N/m2", "largest equivalent stress (von Mises)", nominal=1e7, kind="stress")


def extended(placed: type, machine: InverseMachine, names: frozenset[str]) -> InverseMachine:
    """The chain unit with those of its further parameters that are among `names`, see `MachineModel.having`: with
    its width the shares of both rockers, with the section of the bar its stress, and pins that differ. `placed` is
    the declaration of the loads of an organ with their places.

    Raises
    ------
    InputError
        for a bar without a width, for chains with a width, and for a pin that the machine does not have.
    """
    bar = any(name == "bar" or name.startswith("bar.") for name in names)
    if bar and "width" not in names:
        needed = "give width, too, or, with chains, leave it out"
        raise InputError(f"bar: joins rockers that stand a width apart; {needed}", "bar")
    if "width" not in names:
        return with_pins(machine, names)
    if machine.States is not None:
        raise InputError("width: is of organs with two bars, and these are chains; leave it out", "width")
    return with_pins(_of_width(machine, placed, bar), names)


@functools.cache
def _of_width(machine: InverseMachine, placed: type, bar: bool) -> InverseMachine:
    """`ChamberForces` with the shares of both rockers, and the stress of the bar."""
    load: type = LoadedBar if bar else BarLoad
    sides = [(side, placed, group(placed, f"{side} organ", default=placed())) for side in machine.sides]
    width = quantity("m", "distance of the rockers", default=1.0, above=0.0, max=1e3)
    parameters: list[tuple[str, Any, Any]] = [("width", Value, width)]
    section: dict[str, Any] = {}
    if bar:
        parameters.append(("bar", BarSection, group(BarSection, "bar", default=BarSection())))
        wall = Requirement("bar.bore", "m", "the bar has no wall", depends=("bar.diameter",))
        section = {"required": (*machine.required, wall), "requirements": functools.partial(_limits, machine)}
    outputs: list[tuple[str, Any, Any]] = [
        (row, RockerShare, group(RockerShare, f"{row} rocker")) for row in ROWS
    ]
    outputs.append(("bar", load, group(load, "bar that joins the rockers")))
    return machine.altered(
        root=machine,
        made=(_of_width, (machine, placed, bar)),
        Parameters=declared_class("WideParameters", (machine.Parameters,), parameters),
        Inputs=declared_class("PlacedInputs", (machine.Inputs,), sides),
        Feed=declared_class("PlacedFeed", (machine.Feed,), sides),
        Outputs=declared_class("WideOutputs", (machine.Outputs,), outputs),
        probes=functools.partial(_probes, machine),
        joints={**machine.joints, **{name: machine.joints[joint] for _, name, joint in BEARINGS}},
        pins={**machine.pins, **{title: name for title, name, _ in BEARINGS}},
        layers={"rocker": (1.0, -1.0), "crank": (0.0,), "coupler": (0.0,)},
        **section,
    )


BEARINGS = tuple(
    (title.format(row), f"{row}.{name}", joint)
    for row in ROWS
    for title, name, joint in (
        ("C {} rocker pivot", "pivot", "pivot"),
        ("A2 left web at {} rocker", "left_pin", "left.rocker_joint"),
        ("A2 right web at {} rocker", "right_pin", "right.rocker_joint"),
    )
)
"""Title and output of the bearings of both rockers, and the output for both rockers together."""


def _limits(machine: InverseMachine, xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
    """The limits of the machine, and of the wall of the bar."""
    yield from machine.requirements(xp, p)
    yield p.bar.bore, -math.inf, p.bar.diameter


def _probes(machine: InverseMachine, xp: Any, p: Any, u: Any, s: MachineState, a: Any) -> dict[str, Any]:
    """The outputs of the machine, and the shares of both rockers."""
    reactions = s.reactions(a)
    by_mass, by_force = (_at_a2(machine, xp, p, u, s, a, load) for load in PLACES)
    # by side: force, place, and the largest moment in a beam by a unit of it, in quarters of the width
    parts: dict[str, list[tuple[Vec2, Any, Any]]] = {}
    for side, mass, push in zip(machine.sides, by_mass, by_force, strict=True):
        s_mass, s_push = getattr(u, side).across, getattr(u, side).force_across
        near = 1.0 - xp.abs(s_mass)
        parts[side] = [
            (reactions[machine.joints[f"{side}.rocker_joint"]] - mass - push, 0.0, 0.5),
            (mass, s_mass, 0.5 * near * (2.0 - near) * (2.0 - near)),
            (push, s_push, 1.0 - s_push * s_push),
        ]
    half, along = reactions[machine.joints["pivot"]] * 0.5, s.m.links["rocker"].u.turned()
    shares = {}
    for row, sign in zip(ROWS, (0.5, -0.5), strict=True):
        pins = {side: sum((f * (0.5 + sign * x) for f, x, _ in parts[side]), ZERO) for side in parts}
        shares[row] = RockerShare(
            pivot=force(sum((f * (sign * x) for side in parts for f, x, _ in parts[side]), half)),
            left_pin=force(pins["left"]),
            right_pin=force(pins["right"]),
            tau=p.e * along.dot(pins["left"] + pins["right"]),
        )
    torsion = 0.5 * (shares["front"].tau - shares["back"].tau)
    bending = 0.25 * p.width * sum(f.length(xp) * arm for side in parts for f, _, arm in parts[side])
    bar: Any = BarLoad(torsion=torsion, bending=bending)
    if hasattr(p, "bar"):
        outer, inner = p.bar.diameter * p.bar.diameter, p.bar.bore * p.bar.bore
        modulus = (math.pi / 32.0) * (outer * outer - inner * inner) / p.bar.diameter
        stress = xp.sqrt(bending * bending + 0.75 * (torsion * torsion)) / modulus
        bar = LoadedBar(torsion=torsion, bending=bending, stress=stress)
    return machine.probes(xp, p, u, s, a) | shares | {"bar": bar}


def _at_a2(
    machine: InverseMachine, xp: Any, p: Any, u: Any, s: MachineState, a: Any, load: str
) -> list[Vec2]:
    """By side, the force of the rockers on the web in A2 [N] if organs without mass carry this `load` alone, in the
    motion of the machine."""
    others = {name: 0.0 for name in PLACES if name != load}
    bare, alone = (
        {side: replace(getattr(values, side), **zeros) for side in machine.sides}
        for values, zeros in ((p, {"wall_mass": 0.0, "web_mass": 0.0}), (u, others))
    )
    linkage = machine.linkage(xp, replace(p, **bare), replace(u, **alone))
    reactions = MachineState(xp, s.m.with_bodies(linkage), s.w).reactions(a)
    return [reactions[machine.joints[f"{side}.rocker_joint"]] for side in machine.sides]
