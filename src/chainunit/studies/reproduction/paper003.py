"""Paper 003: the forces in the class III group of the knife drive, as the paper solves it and as it must be.

The paper prints equations, no dimensions and no results; the numbers here are what its equations come to on the packaged
machine, whose dimensions are ours.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...engines import MATH
from ...groups.body import point_load, total
from ...groups.triad import LEGS
from ...machines.knife_drive import KnifeDrive, Reactions, State
from ...planar import Vec2
from .row import Row

W = 4.0
CUT = 5000.0
_ANGLES = np.radians(np.arange(0.0, 360.0, 5.0))


def machine(**given: float) -> Any:
    """Parameters of the packaged machine, some of them changed."""
    named = {name.replace("__", "."): x for name, x in given.items()}
    return KnifeDrive.prepared(MATH, KnifeDrive.parameter_layout.from_names(named))


def state(p: Any, angle: float, cut: float = 0.0) -> State:
    """The machine at the crank angle [rad], with the resistance of the stack [N]."""
    u = KnifeDrive.input_layout.from_names({"phi": angle, "w": W, "cut_force": cut})
    shared: State = KnifeDrive.shared(MATH, p, u, None)
    return shared


def as_the_paper(p: Any, s: State, line: float, *, cut: bool = True) -> Any:
    """Forces at C, D, E on the legs [N], shape (3, 2), by the paper's scheme: the part across each leg from the moment
    about its outer pin, the parts along from three moments about C, D and E on the ternary link and a line equation
    for each direction. The constant of that equation is multiplied by `line`: 0 as it must be, 1 as printed with lengths
    in m, 1000 as printed with lengths in mm. Without `cut` the force of the stack is left out, as in the print."""
    m, w2 = s.m, s.w * s.w
    legs = [body.applied(w2, 0.0, p.g) for body in m.bodies[3:6]]
    knife = m.bodies[6].applied(w2, 0.0, p.g)
    if cut:
        knife = total(knife, point_load(m.blade, m.triad.link.pin, s.bias.on_blade))
    inner = [pin.p for pin in m.triad.pins]
    outer = [leg.pin.p for leg in m.triad.legs]
    across = [
        (k - o).turned() * (-moment / (k - o).squared())
        for k, o, (_, moment) in zip(inner, outer, legs, strict=True)
    ]
    matrix, right = np.zeros((6, 6)), np.zeros(6)
    force, moment = knife
    origin = m.triad.link.pin.p
    for i, about in enumerate(inner):
        right[i] = moment + (origin - about).cross(force)
        for k, at in enumerate(inner):
            arm = at - about
            right[i] -= arm.cross(across[k])
            matrix[i, 2 * k : 2 * k + 2] = -arm.y, arm.x
    for k, (at, from_) in enumerate(zip(inner, outer, strict=True)):
        matrix[3 + k, 2 * k : 2 * k + 2] = at.y - from_.y, from_.x - at.x
        right[3 + k] = -line * (at.x * from_.y - from_.x * at.y)
    along = np.linalg.solve(matrix, right).reshape(LEGS, 2)
    return along + np.array([[t.x, t.y] for t in across])


def ours(p: Any, s: State) -> Any:
    """The same forces as the model has them."""
    inner = Reactions(s.m, p, s.w * s.w, 0.0, s.bias.on_blade).inner
    return np.array([[f.x, f.y] for f in inner])


def error(p: Any, angle: float, line: float) -> float:
    """Largest error of the forces at C, D, E by the printed line equation, over the largest of them [%]."""
    s = state(p, angle)
    wanted = ours(p, s)
    size = np.max(np.hypot(*wanted.T))
    return float(100.0 * np.max(np.hypot(*(as_the_paper(p, s, line) - wanted).T)) / size)


def across_at_e(p: Any, s: State, *, printed: bool) -> float:
    """The force across O4E at E [N], by the moment about O4; as printed, the weight has the arm O3-cM in place of
    O4-cM."""
    leg, body = s.m.triad.legs[2], s.m.bodies[5]
    force, moment = body.applied(s.w * s.w, 0.0, p.g)
    arm = body.c.p - leg.pin.p
    if printed:
        # of the length the paper names, along the leg
        wrong = math.sqrt((body.c.p - s.m.triad.legs[1].pin.p).squared())
        moment += (leg.u * wrong - arm).cross(force)
    return float(-moment / p.o4e)


def rows() -> list[Row]:
    """What paper 003's equations come to, as printed and corrected."""
    p = machine()
    errors = {line: [error(p, angle, line) for angle in _ANGLES] for line in (0.0, 1.0, 1000.0)}
    still = state(p, 0.0)
    cutting = max((state(p, angle, CUT) for angle in _ANGLES), key=lambda s: Vec2.squared(s.bias.cut))
    whole = ours(p, cutting)
    left_out = as_the_paper(p, cutting, 0.0, cut=False)
    size, printed = np.hypot(*whole.T), np.hypot(*left_out.T)
    line = machine(
        knife__c__y=0.0,
        knife__d__y=0.0,
        knife__e__y=0.0,
        assembly__x=1.02,
        assembly__y=-0.01,
        assembly__theta=0.0,
    )
    on_line = state(line, 0.0)
    at = [pin.p for pin in on_line.m.triad.pins]
    u = [leg.u for leg in on_line.m.triad.legs]
    moments = [[(at[k] - at[i]).cross(u[k]) for k in range(LEGS)] for i in range(LEGS)]
    constant = (
        "a line through two points is an equation for a point; the components of a force along it have no constant "
        "term. With it the result depends on the unit of length and on the origin"
    )
    arm = "the weight of O4E turns it about O4: its arm is O4-cM, not O3-cM"
    cut = "the cutting force is named among the acting forces, but is not in the three moments of CDE"
    collinear = "with C, D, E on one line the three moments say the same twice; two forces and one moment determine the group"
    eq = "line through two points"
    return [
        Row("003", "1", eq, "largest error of R_C, R_D, R_E in a turn, lengths in m", "+ (Ex O4y - O4x Ey)",
            max(errors[1.0]), "%", 2, constant, agrees=False),
        Row("003", "1", eq, "least error in a turn, lengths in m", "+ (Ex O4y - O4x Ey)", min(errors[1.0]), "%", 3,
            constant, agrees=False),
        Row("003", "1", eq, "largest error in a turn, lengths in mm", "+ (Ex O4y - O4x Ey)", max(errors[1000.0]), "%", 0,
            constant, agrees=False),
        Row("003", "1", eq, "largest error in a turn without the constant", None, max(errors[0.0]), "%", 9, constant),
        Row("003", "2", "M_O4", "force across O4E at E, crank angle 0", f"{across_at_e(p, still, printed=True):.1f}",
            across_at_e(p, still, printed=False), "N", 1, arm),
        *(
            Row("003", "4", "sum M_C, M_D, M_E", f"R_{pin} in a cut of {CUT:g} N", f"{printed[k]:.0f}", float(size[k]), "N", 0, cut)
            for k, pin in enumerate("CDE")
        ),
        Row("003", "6", "three moments", "rank of the three moments with C, D, E on one line", None,
            float(np.linalg.matrix_rank(np.array(moments))), "1", 0, collinear),
        Row("003", "6", "three moments", "margin of the same triad, two forces and one moment", None,
            float(abs(on_line.m.triad.margin)), "1", 3, collinear),
    ]  # fmt: skip
