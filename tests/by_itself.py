"""The direct model of a linkage that moves by itself under a constant effort, with the energy that it is given."""

from __future__ import annotations

import casadi

from chainunit.core.engines import MATH, casadi_
from chainunit.core.integrators import controlled


def moved_by_itself(direct, p, u, seconds, pieces, tolerance, energy):
    """States after some `seconds`: angle or place, speed, and the energy that the effort gave less the losses; the
    angle or place at the end of each piece; the outputs at the end; and by how much the energy of motion and place
    grew. `tolerance` is that of the integration, of 1 rad or m, 1 rad/s or m/s, and this `energy`."""
    layout = direct.state_layout
    start = direct.start(MATH, p, u)
    x = casadi.SX.sym("x", 2)
    state = layout.instance(casadi.vertsplit(x))
    out = direct.evaluate(casadi_(), p, u, state)[0]
    derivatives = direct.derivatives(casadi_(), p, u, state)
    function = casadi.Function("rates", [x], [casadi.vertcat(*derivatives, out.power - out.dissipated_power)])
    states, pace, way = [start.phi, start.w, 0.0], 0.0, []
    for _ in range(pieces):
        states, pace = controlled(
            lambda t, v: function(v[:2]).full().ravel().tolist(), lambda t, v: v, states, seconds / pieces, pace,
            5e-3, tolerance, [1.0, 1.0, energy],
        )  # fmt: skip
        way.append(states[0])
    first, last = (direct.evaluate(MATH, p, u, at)[0] for at in (start, layout.instance(states[:2])))
    gained = sum(
        s * (each.kinetic_energy + each.potential_energy) for s, each in ((1.0, last), (-1.0, first))
    )
    return states, way, last, gained
