"""Paper 003: the forces in the class III group of the knife drive, as the paper solves it and as it must be.

The paper prints equations, but no dimensions and no results. The numbers here follow from its equations on the
packaged machine, whose dimensions are assumptions of this package.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np

from chainunit.core.engines import MATH
from chainunit.machines.knife_drive import KnifeDrive
from chainunit.mechanism.machine import MachineState, add_wrenches

from .table import PICK

W = 4.0
CUT = 5000.0
_LEGS = "leg_b", "leg_3", "leg_4"
_PINS = "C", "D", "E"
_ANGLES = np.radians(np.arange(0.0, 360.0, 5.0))


@cache
def machine(**values: float) -> Any:
    """Parameters of the packaged machine, some of them changed."""
    return KnifeDrive.with_derived(MATH, KnifeDrive.parameter_layout.from_names(values))


def state(p: Any, angle: float, cut: float = 0.0) -> MachineState:
    """The machine at the crank angle [rad], with the resistance of the stack [N]."""
    u = KnifeDrive.input_layout.from_names({"phi": angle, "w": W, "cut_force": cut})
    return KnifeDrive.shared(MATH, p, u, None)


def _acting(s: MachineState, *names: str) -> dict[str, Any]:
    """The action on each link at constant speed, from its inertia and from the loads with these names."""
    w2, field = s.w * s.w, sum(s.effects[name].field for name in names)
    wrenches = (wrench for name in names for wrench in s.effects[name].wrenches)
    return add_wrenches({name: body.centrifugal(w2, field) for name, body in s.m.bodies.items()}, wrenches)


def as_the_paper(s: MachineState, line: float, *, cut: bool = True) -> Any:
    """Forces at C, D, E on the legs [N], shape (3, 2), by the paper's scheme.

    The part across each leg comes from the moment about its outer pin, the parts along the legs from three moments
    about C, D and E on the ternary link and a line equation for each direction. The constant of that equation is
    multiplied by `line`: 0 as it must be, 1 as printed with lengths in m, 1000 as printed with lengths in mm. Without
    `cut` there is no force of the stack, as in the print.
    """
    m, acting = s.m, _acting(s, "weight", *(("cut",) if cut else ()))
    legs = [acting[leg] for leg in _LEGS]
    inner = [m.pins[pin].p for pin in _PINS]
    outer = [m.links[leg].pin.p for leg in _LEGS]
    across = [
        (k - o).turned() * (-moment / (k - o).squared())
        for k, o, (_, moment) in zip(inner, outer, legs, strict=True)
    ]
    matrix, right = np.zeros((6, 6)), np.zeros(6)
    force, moment = acting["knife"]
    origin = m.links["knife"].pin.p
    for i, about in enumerate(inner):
        right[i] = moment + (origin - about).cross(force)
        for k, at in enumerate(inner):
            arm = at - about
            right[i] -= arm.cross(across[k])
            matrix[i, 2 * k : 2 * k + 2] = -arm.y, arm.x
    for k, (at, from_) in enumerate(zip(inner, outer, strict=True)):
        matrix[3 + k, 2 * k : 2 * k + 2] = at.y - from_.y, from_.x - at.x
        right[3 + k] = -line * (at.x * from_.y - from_.x * at.y)
    along = np.linalg.solve(matrix, right).reshape(len(_LEGS), 2)
    return along + np.array([[t.x, t.y] for t in across])


def ours(s: MachineState) -> Any:
    """The same forces by the model."""
    reactions = s.steady.reactions
    return np.array([[reactions[joint].x, reactions[joint].y] for joint in zip(_PINS, _LEGS, strict=True)])


def error(angle: float, line: float) -> float:
    """Largest error of the forces at C, D, E by the printed line equation, over the largest of them [%]."""
    s = state(machine(), angle)
    right = ours(s)
    size = np.max(np.hypot(*right.T))
    return float(100.0 * np.max(np.hypot(*(as_the_paper(s, line) - right).T)) / size)


@cache
def _errors(line: float) -> Any:
    return np.array([error(angle, line) for angle in _ANGLES])


def error_in_turn(line: float, end: str) -> float:
    """Item 1: "least" or "largest" error over a turn [%]; for `line` see `as_the_paper`."""
    return float(PICK[end](_errors(line)))


def across_at_e(arm_from: str) -> float:
    """Item 2: the force across O4E at E [N] at crank angle 0, by the moment about O4; as printed, the weight has the
    arm "O3"-cM in place of "O4"-cM."""
    p = machine()
    s = state(p, 0.0)
    leg, body = s.m.links["leg_4"], s.m.bodies["leg_4"]
    force, moment = _acting(s, "weight")["leg_4"]
    if arm_from == "O3":
        # an arm along the leg, of the length in the paper
        length = math.sqrt((body.c.p - s.m.links["leg_3"].pin.p).squared())
        moment += (leg.u * length - (body.c.p - leg.pin.p)).cross(force)
    return float(-moment / p.o4e)


def _cut_squared(s: MachineState) -> float:
    (cut,) = s.effects["cut"].wrenches
    return float(cut.force.squared())


def force_in_cut(pin: str, moments: str) -> float:
    """Item 4: the force at C, D or E [N] where the cutting force is largest, by "all" moments, or by those "printed",
    without the cut."""
    p = machine()
    cutting = max((state(p, angle, CUT) for angle in _ANGLES), key=_cut_squared)
    forces = ours(cutting) if moments == "all" else as_the_paper(cutting, 0.0, cut=False)
    return float(np.hypot(*forces["CDE".index(pin)]))


def _in_line() -> MachineState:
    """The triad with C, D and E on one line."""
    straight = {"knife.c.y": 0.0, "knife.d.y": 0.0, "knife.e.y": 0.0}
    near = {"assembly.x": 1.02, "assembly.y": -0.01, "assembly.theta": 0.0}
    return state(machine(**straight, **near), 0.0)


def rank_in_line() -> float:
    """Item 6: rank of the three moments with C, D and E on one line."""
    m = _in_line().m
    at, legs = [m.pins[pin].p for pin in _PINS], [m.links[leg].u for leg in _LEGS]
    moments = [[(at[k] - at[i]).cross(legs[k]) for k in range(len(_LEGS))] for i in range(len(_LEGS))]
    return float(np.linalg.matrix_rank(np.array(moments)))


def margin_in_line() -> float:
    """Item 6: the margin of the same triad by two forces and one moment."""
    return float(abs(_in_line().m.margins()[1]))
