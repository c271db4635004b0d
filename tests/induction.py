"""The induction motor by the names of its parameters, inputs and states, for tests of its equations."""

from __future__ import annotations

from chainunit.core import engines
from chainunit.core.integrators import rk4
from chainunit.drives.induction_motor import InductionMotor

LAYOUT = InductionMotor.state_layout
SKIN = {"cage.skin_R": 0.9, "cage.skin_L": 0.3}
SATURATED = {"main.beta": 0.85}  # 1/L grows by 0.4 at rated flux
COLD = {"stator.alpha": 0.0}


def parameters(given=None):
    p = InductionMotor.parameter_layout.from_names(given or {})
    InductionMotor.check(p)
    return p


def inputs(given=None):
    return InductionMotor.input_layout.from_names(given or {})


def at_rest(p):
    return LAYOUT.values(InductionMotor.initial_states(engines.MATH, p))


def rates(p, u, xp=engines.MATH):
    """The time derivatives of the states, as a function of the states."""
    return lambda y: InductionMotor.derivatives(xp, p, u, LAYOUT.instance(y))


def advanced(p, u, start, stop, longest):
    """The states after the time `stop`, in steps of the FMU."""
    of = rates(p, u)
    return rk4(lambda _, y: of(y), start, stop, longest)


def outputs(p, u, y, xp=engines.MATH):
    return InductionMotor.evaluate(xp, p, u, LAYOUT.instance(y))[0]


def random_states(rng):
    values = {
        "phi": 0.3,
        "w": rng.uniform(-200.0, 200.0),
        "stator.T": rng.uniform(250.0, 450.0),
        "supply.frequency": rng.uniform(0.0, 80.0),
        "supply.ramp": rng.uniform(0.2, 1.0),
        "load_energy": 0.0,
        **{f"{side}.psi.{axis}": rng.uniform(-1.2, 1.2) for side in ("stator", "cage") for axis in "dq"},
    }
    return [values[name] for name in LAYOUT.names]
