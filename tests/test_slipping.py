"""Fluid coupling and V-belt: their laws by hand, a start-up and a jam against an integration of our own, the energy,
and the gear behind them.

Measured against the integration of our own: speeds within 2e-8 of the synchronous speed."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from induction import LAYOUT, at_rest, rates
from scipy.integrate import solve_ivp

from chainunit.core.engines import MATH
from chainunit.drives import fluid_coupling, v_belt
from chainunit.drives.fluid_coupling import FluidCoupling
from chainunit.drives.induction_motor import InductionMotor
from chainunit.drives.v_belt import VBelt
from chainunit.machines.linkages.file import read_linkage
from chainunit.machines.machine import Machine
from chainunit.system import CompiledSimulation, ModelComponent, Profile, certify, in_line, monolithic

LOADS = Path(__file__).parents[1] / "examples" / "loads"
W = 150.0
INERTIA, AIR, CRUSHING, RATED = 1.5, 5.0, 20.0, 1480.0 * math.pi / 30.0
"""A mill: inertia [kg m2], torque of its air and of its material [N m], rated speed [rad/s]."""
MOTOR = InductionMotor.parameter_layout.from_names({})
"""A motor that starts on line."""
SMOOTH = 0.3


def coupling(**values):
    rated = {"rated_power": 4e3, "rated_speed": 150.0, "J_motor": 0.02, "J_driven": 0.01, "rated_slip": 0.04}
    return FluidCoupling.parameter_layout.from_names(rated | values)


def belt(**values):
    rated = {
        "rated_power": 4e3,
        "rated_speed": 150.0,
        "diameter": 0.112,
        "distance": 0.5,
        "pretension": 520.0,
    }
    return VBelt.parameter_layout.from_names(
        {**rated, "mass_per_length": 0.4, "J_motor": 0.003, "J_driven": 0.15} | values
    )


def coupling_torque(p, w1, w2):
    """The torque of a fluid coupling by its data sheet, for wheels that turn forward."""
    b = p.rated_slip * (p.peak_factor - 1.0) / (1.0 - p.peak_factor * p.rated_slip)
    fast, sign = max(w1, w2), 1.0 if w1 > w2 else -1.0
    s = abs(w1 - w2) / fast if fast > 0.0 else 0.0
    rated = p.rated_power / p.rated_speed * p.filling
    return sign * rated * (fast / p.rated_speed) ** 2 * p.peak_factor * (1.0 + b) * s / (s + b)


def belt_force(p, w1, w2):
    """The force of a V-belt by Euler and Eytelwein, with the creep of its rated slip."""
    # a belt that slips has the speed of the slower pulley
    r, v = 0.5 * p.diameter, 0.5 * p.diameter * min(abs(w1), p.ratio * abs(w2))
    wrap = math.pi - 2.0 * math.asin((p.ratio - 1.0) * p.diameter / 2.0 / p.distance)
    grip = 2.0 * math.tanh(0.5 * p.friction * wrap)
    most = grip * (p.pretension - p.mass_per_length * v * v)
    at_rated = grip * (p.pretension - p.mass_per_length * (r * p.rated_speed) ** 2)
    rated = p.rated_power / p.rated_speed / r * p.efficiency / (1.0 - p.rated_slip)
    # at the rated slip s the force is F = at_rated s/hypot(s, c)
    c = p.rated_slip * math.sqrt(((at_rated / rated) ** 2 - 1.0) / 1.04)
    slip = w1 - p.ratio * w2
    return most * slip / math.hypot(slip, c * math.hypot(w1, 0.2 * p.rated_speed))


def belt_torque(p, w1, w2):
    """The torque that the motor's pulley takes, with the one that bends the belt."""
    bending = (1.0 - p.efficiency / (1.0 - p.rated_slip)) * p.rated_power / p.rated_speed
    through = belt_force(p, w1, w2) * 0.5 * p.diameter
    return through + bending * w1 / math.hypot(w1, 0.01 * p.rated_speed), through * p.ratio


# -- laws


def test_the_torque_of_a_coupling_has_the_four_numbers_of_its_data_sheet():
    p = coupling(peak_factor=2.2)
    rated = 4e3 / 150.0

    def torque(w, driven):
        tau, passed = fluid_coupling.torque(MATH, p, w, driven)
        assert tau == passed
        return tau

    assert torque(150.0, 144.0) == pytest.approx(rated, rel=1e-9)
    assert torque(150.0, 0.0) == pytest.approx(2.2 * rated, rel=1e-9) == p.stall_torque
    # a parabola of the speed at each slip, and less oil in proportion
    assert torque(75.0, 72.0) == pytest.approx(rated / 4.0, rel=1e-9)
    less = fluid_coupling.torque(MATH, coupling(peak_factor=2.2, filling=0.7), 150.0, 144.0)[0]
    assert less == pytest.approx(0.7 * rated, rel=1e-9)
    # it rises with the slip all the way, brakes a machine that overtakes, and does nothing at rest
    course = [torque(150.0, 150.0 - d) for d in np.linspace(0.0, 150.0, 301)]
    assert np.all(np.diff(course) > 0.0)
    assert torque(144.0, 150.0) == pytest.approx(-rated, rel=1e-9)
    assert torque(0.0, 0.0) == 0.0


def test_a_steady_belt_by_hand():
    """Slip, efficiency and force on the shafts at the rated torque; the limit by Euler and Eytelwein."""
    p = belt(ratio=3.0, mass_per_length=0.0)
    w, r = 150.0, 0.056
    driven = w * 0.99 / 3.0
    tau, passed = v_belt.torques(MATH, p, w, driven)
    assert tau == pytest.approx(4e3 / 150.0, rel=1e-4)
    assert passed * driven / (tau * w) == pytest.approx(0.95, rel=1e-3)
    forces = v_belt.forces(MATH, p, w, driven)
    wrap = math.pi - 2.0 * math.asin(0.112 / 0.5)
    assert forces.force == pytest.approx(passed / 3.0 / r, rel=1e-12)
    assert forces.tight_strand + forces.slack_strand == pytest.approx(2.0 * 520.0, rel=1e-12)
    x = forces.tight_strand - forces.slack_strand * math.cos(wrap)
    assert forces.shaft_force == pytest.approx(math.hypot(x, forces.slack_strand * math.sin(wrap)), rel=1e-12)
    # the belt slips through where one strand carries exp(friction wrap) times as much as the other
    stuck = v_belt.forces(MATH, p, w, 0.0)
    assert stuck.grip == pytest.approx(1.0, rel=1e-3)
    assert stuck.tight_strand / stuck.slack_strand == pytest.approx(math.exp(0.92 * wrap), rel=0.01)


def test_the_tension_by_the_rule_of_makers_holds_five_to_one():
    """At half a turn of wrap the tight strand carries five times as much as the slack one."""
    p = belt(ratio=1.0, mass_per_length=0.0)
    pull = 4e3 / 150.0 / 0.056
    assert v_belt.usual_pretension(p, 1.0) == pytest.approx(0.75 * pull, rel=1e-9)
    fast = belt(ratio=1.0, mass_per_length=0.5)
    assert v_belt.usual_pretension(fast, 1.0) == pytest.approx(
        0.75 * pull + 0.5 * (0.056 * 150.0) ** 2, rel=1e-9
    )


def test_a_belt_loses_a_larger_share_at_part_load():
    p = belt(ratio=3.0)
    efficiencies = []
    for slip in (0.002, 0.004, 0.01):
        driven = 150.0 * (1.0 - slip) / 3.0
        tau, passed = v_belt.torques(MATH, p, 150.0, driven)
        efficiencies.append(passed * driven / (tau * 150.0))
    assert efficiencies[0] < efficiencies[1] < efficiencies[2] < 0.96
    assert efficiencies[0] < 0.85


@pytest.mark.parametrize(
    ("values", "key"),
    [
        ({"distance": 0.2}, "distance"),
        ({"efficiency": 0.995}, "efficiency"),
        ({"pretension": 200.0}, "pretension"),
    ],
)
def test_a_belt_that_cannot_work_is_refused(values, key):
    with pytest.raises(Exception, match=rf"^{key} = .*; must be [<>]"):
        VBelt.check(belt(ratio=3.0, **values))


# -- runs against an integration of our own


def mill(crushing):
    machine = Machine(read_linkage(LOADS / "hammer_mill.toml")).replace(
        {"rotor_inertia": INERTIA, "air": AIR, "smooth": SMOOTH}
    )
    return machine, {"machine.crushing": crushing}


def system_of(part, p, machine):
    return in_line(
        {
            "machine": ModelComponent(machine.model, machine.p),
            "part": ModelComponent(part, p),
            "motor": ModelComponent(InductionMotor, MOTOR),
        }
    )


def own_course(p, pair, crushing, times):
    """Speeds of the motor and of the mill by two shafts of our own, with the motor of the package."""

    def slopes(t, y):
        motor, w2 = y[:-1], y[-1]
        w1 = dict(zip(LAYOUT.names, motor, strict=True))["w"]
        taken, given = pair(p, w1, w2)
        u = InductionMotor.input_layout.from_names({"load.tau_bias": taken, "load.J": p.J_motor})
        load = crushing(t) * w2 / math.hypot(w2, SMOOTH) + AIR * w2 * abs(w2) / RATED**2
        # the teeth lose their share of the torque that they pass on, whichever way it acts
        for sense in (1.0, -1.0):
            share = 1.0 + sense * p.gear.loss * min(max(w2, -1.0), 1.0)
            a = (given - p.gear.d * w2 - share * load) / (p.J_driven + share * INERTIA)
            if sense * (INERTIA * a + load) >= 0.0:
                break
        return [*rates(MOTOR, u)(motor), a]

    course = solve_ivp(
        slopes, (0.0, times[-1]), [*at_rest(MOTOR), 0.0], "LSODA", times, rtol=1e-9, atol=1e-11, max_step=0.01
    )
    return course.y[list(LAYOUT.names).index("w")], course.y[-1]


CASES = {
    "a start through a fluid coupling": (
        FluidCoupling,
        coupling,
        lambda p, *w: 2 * (coupling_torque(p, *w),),
    ),
    "a jam through a belt": (VBelt, belt, belt_torque),
}


@pytest.mark.second
@pytest.mark.parametrize("case", CASES)
def test_a_start_and_a_jam_against_two_shafts_of_our_own(case):
    """The mill starts from rest; at 1.5 s it is jammed, and stands at the end while the motor turns."""
    model, parameters, pair = CASES[case]
    p = parameters(**({"ratio": 2.0, "rated_power": 2e3, "pretension": 200.0} if model is VBelt else {}))
    rise = Profile(CRUSHING, ((1.5, 0.01, 400.0),))
    machine, signals = mill(rise)
    system = system_of(model, p, machine)
    times = np.linspace(0.0, 3.0, 301)
    run = monolithic(system, signals, times, rtol=1e-9)
    motor, driven = own_course(p, pair, rise, times)
    assert np.max(np.abs(run["motor.w"].values - motor)) < 1e-5 * W
    assert np.max(np.abs(run["part.driven.w"].values - driven)) < 1e-5 * W
    # the jam stops the mill, and the motor goes on
    assert abs(driven[-1]) < 1.0 and motor[-1] > 100.0
    # the co-simulation of steps of a millisecond, and its energy
    with CompiledSimulation(system, signals) as simulation:
        stepped = simulation.run(3.0, 1e-3)
    w = np.interp(times, stepped["time"].values, stepped["motor.w"].values)
    assert np.max(np.abs(w - motor)) < 1e-3 * W
    for _, share in certify(stepped, system).values():
        assert share < 1e-3
    energy_closes(run, stepped)


def energy_closes(run, stepped):
    """The motor's energy is that of the masses, the heat of the part, and the losses of the mill."""
    time = stepped["time"].values
    heat, lost = (
        np.trapezoid(stepped[f"{name}.dissipated_power"].values, time) for name in ("part", "machine")
    )
    held = sum(float(stepped[f"{name}.kinetic_energy"][-1]) for name in ("part", "machine"))
    assert float(stepped["motor.load_energy"][-1]) == pytest.approx(heat + lost + held, rel=1e-3)
    assert heat > 0.1 * float(run["motor.load_energy"][-1])


@pytest.mark.second
@pytest.mark.parametrize("case", CASES)
def test_the_gear_behind_a_part_that_slips_stands_with_the_machine(case):
    """With a gear of 20 % loss and drag the mill is slower to start; jammed, the gear takes nothing."""
    model, parameters, pair = CASES[case]
    ratio = {"ratio": 2.0, "rated_power": 2e3, "pretension": 200.0} if model is VBelt else {}
    p = parameters(**ratio, **{"gear.loss": 0.25, "gear.d": 0.01})
    rise = Profile(CRUSHING, ((1.5, 0.01, 400.0),))
    machine, signals = mill(rise)
    times = np.linspace(0.0, 3.0, 301)
    run = monolithic(system_of(model, p, machine), signals, times, rtol=1e-9)
    start = times < 1.4
    motor, driven = own_course(p, pair, rise, times)
    assert np.max(np.abs(run["motor.w"].values - motor)[start]) < 1e-5 * W
    assert np.max(np.abs(run["part.driven.w"].values - driven)[start]) < 1e-5 * W
    loss = run["part.gear_loss"].values
    crushing = CRUSHING * driven[100] / math.hypot(driven[100], SMOOTH)
    load = crushing + AIR * (driven[100] / RATED) ** 2 + INERTIA * float(run["part.driven.a"][100])
    assert loss[100] == pytest.approx((0.25 * load + 0.01 * driven[100]) * driven[100], rel=1e-3)
    assert loss[-1] < 0.01 * loss[100]
