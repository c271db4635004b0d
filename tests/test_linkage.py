"""Linkages from data: a third machine, a Stephenson six-bar (crank, dyad, dyad), against an independent multibody
solution; energy, two routes to the torque, slopes, and the direct model of any linkage."""

from __future__ import annotations

import functools
import json
import math
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from chainunit.core.engines import MATH, Dual, casadi_, dual, numpy_, slope
from chainunit.core.errors import GeometryError
from chainunit.core.planar import Vec2
from chainunit.core.ports import PortValues
from chainunit.core.quantities import Value, declaration, group, quantity
from chainunit.groups.body import Bar, Mass
from chainunit.groups.chain import Rods
from chainunit.groups.driver import Crank
from chainunit.groups.dyad import Dyad
from chainunit.groups.hanging_chain import HangingChain
from chainunit.groups.loads import PinLosses, Push, Resistance, Weight
from chainunit.machines.knife_drive import KnifeDrive
from chainunit.machines.parts import Force, Pin, Processing, force
from chainunit.mechanism.chains import ChainedState
from chainunit.mechanism.linkage import Linkage
from chainunit.mechanism.machine import MachineState, Mechanism
from chainunit.mechanism.models import InverseMachine, ShaftMotion

DATA = json.loads((Path(__file__).parent / "data" / "stephenson.json").read_text())
BODIES = {body["name"]: body for body in DATA["description"]["bodies"]}
GROUND = {name: Vec2(*at) for name, at in DATA["description"]["ground"].items()}
G = -DATA["description"]["gravity"][1]
LOAD = Vec2(*DATA["description"]["loads"][0]["force"])


@declaration
class Parameters:
    """Of the six-bar; its lengths and masses are those of the file."""

    g: Value = quantity("m/s2", "gravity", default=G, tunable=True)
    ratio: Value = quantity("1", "gear ratio", default=1.0, above=0.0)
    pin: Pin = group(Pin, "pins", default=Pin(friction=0.0))
    joint_damping: Value = quantity("N.m.s/rad", "damping of each pin", default=0.0, min=0.0)
    processing: Processing = group(Processing, "resistance", default=Processing())


@declaration
class Inputs(ShaftMotion):
    """Motion, and loads on the output link."""

    load: Force = group(Force, "load", default=Force(fx=LOAD.x, fy=LOAD.y))
    resistance: Value = quantity("N", "resistance to the coupler point", default=0.0, min=0.0)


@declaration
class Outputs(PortValues):
    """Torque, load port and reactions."""

    output_bearing: Force = group(Force, "on the output link at O3")
    angle: Value = quantity("rad", "angle of the output link")
    power: Value = quantity("W", "power")
    kinetic_energy: Value = quantity("J", "kinetic energy")
    potential_energy: Value = quantity("J", "potential energy")
    dissipated_power: Value = quantity("W", "dissipated power")
    margin: Value = quantity("1", "margin")
    tau: Value = quantity("N.m", "torque")


def bar(name: str, pin: str, end: str, points: Any = None) -> Bar:
    body = BODIES[name]
    s, t = body["centroid"]
    mass = Mass(body["mass"], s, body["inertia"], t)
    return Bar(name, pin, body["points"][end][0], mass, {n: tuple(body["points"][n]) for n in points or ()})


def linkage_of_sixbar(xp, p, u):
    """Crank, dyad, dyad."""
    return Linkage(
        GROUND,
        Crank(bar("crank", "O1", "A"), "A"),
        (
            Dyad("B", bar("coupler", "A", "B", ["P"]), bar("rocker", "O2", "B"), 1.0),
            Dyad("Q", bar("link", "P", "Q"), bar("output", "O3", "Q", ["W"]), -1.0),
        ),
        {
            "weight": Weight(p.g),
            "load": Push("W", Vec2(u.load.fx, u.load.fy)),
            "resistance": Resistance("P", u.resistance, p.processing),
            "pins": PinLosses(p.pin, p.joint_damping),
        },
    )


def probes_of_sixbar(xp, p, u, s, a):
    """Bearing and angle of the output link."""
    output = s.m.links["output"].u
    return {
        "output_bearing": force(s.reactions(a)[SixBar.joints["output_bearing"]]),
        "angle": xp.atan2(output.y, output.x),
    }


SixBar = InverseMachine(
    name="SixBar",
    text="A Stephenson six-bar: the second dyad hangs on a point of the coupler.",
    description="Stephenson six-bar",
    Parameters=Parameters,
    Inputs=Inputs,
    Outputs=Outputs,
    joints=MappingProxyType({"output_bearing": ("O3", "output")}),
    linkage=linkage_of_sixbar,
    probes=probes_of_sixbar,
)


TurningSixBar = SixBar.direct()
LOSSY = {"ratio": 3.0, "pin.friction": 0.15, "joint_damping": 0.3}


def case(seed, xp=MATH, **inputs):
    """Parameters, inputs and state at a random motion, with losses."""
    rng = np.random.default_rng(seed)
    p = SixBar.parameter_layout.from_names(LOSSY)
    motion = {"phi": rng.uniform(-9.0, 9.0), "w": rng.uniform(-30.0, 30.0), "a": rng.uniform(-99.0, 99.0)}
    u = SixBar.input_layout.from_names(motion | {"resistance": rng.uniform(0.0, 400.0)} | inputs)
    return p, u, SixBar.shared(xp, p, u, None)


@pytest.mark.parametrize("state", DATA["states"], ids=lambda s: f"{s['phi']:.2f}")
def test_reference_points(state):
    """Torque, load port with slopes, energies, every reaction, motion of every centroid and pin. The reference counts
    the crank angle counter-clockwise from the x axis."""
    p, q, w, a = SixBar.Parameters(), 0.5 * math.pi - state["phi"], -state["w"], -state["a"]
    u = SixBar.Inputs(phi=q, w=w, a=a)
    s = SixBar.shared(MATH, p, u, None)
    out, slopes = SixBar.evaluate(MATH, p, u)
    got = {
        "tau": -out.tau, "J": out.J, "tau_bias": -out.tau_bias, "dJ_dphi": -out.dJ_dphi,
        "dtau_bias_dphi": slopes.tau_bias_dphi, "dtau_bias_dw": slopes.tau_bias_dw,
        "kinetic_energy": out.kinetic_energy, "potential_energy": out.potential_energy,
    }  # fmt: skip
    for name, value in got.items():
        assert value == pytest.approx(state[name], rel=1e-10), name
    reactions = s.reactions(a)
    for joint in DATA["description"]["joints"]:
        (on, pin), (by, _) = joint["on"], joint["by"]
        sign, at = (1.0, (pin, on)) if (pin, on) in reactions else (-1.0, (pin, by))
        wanted = state["reactions"][joint["name"]]
        size = math.hypot(wanted["fx"], wanted["fy"])
        got = sign * reactions[at].x, sign * reactions[at].y
        assert got == pytest.approx((wanted["fx"], wanted["fy"]), abs=1e-10 * size), joint["name"]
    for name, wanted in state["points"].items():
        body, point = name.split(".")
        c = s.m.bodies[body].c if point == "cg" else s.m.pins[point]
        speed, growth = c.p1 * w, c.p1 * a + c.p2 * (w * w)
        got = (c.p.x, c.p.y, speed.x, speed.y, growth.x, growth.y)
        assert got == pytest.approx(wanted, rel=1e-9, abs=1e-10), name


@pytest.mark.parametrize("seed", range(20))
def test_power_and_two_torques(seed):
    """tau w = d/dt energy + dissipation, the rate by dual numbers in time; the torque from the reactions beside that
    of virtual work."""
    p, u, s = case(seed)
    out = SixBar.evaluate(MATH, p, u)[0]
    moving = SixBar.input_layout.from_names({"phi": Dual(u.phi, u.w), "w": Dual(u.w, u.a)}, u)
    engine = dual(MATH)
    stored = SixBar.parts[0].equations(engine, p, moving, None, SixBar.shared(engine, p, moving, None))
    grows = slope(stored.kinetic_energy), slope(stored.potential_energy)
    size = abs(out.power) + sum(map(abs, grows)) + abs(out.dissipated_power)
    assert abs(out.power - sum(grows) - out.dissipated_power) < 1e-11 * size
    a = u.a / p.ratio
    by_work = s.torque(a) - s.effects["pins"].dissipative
    assert s.torque_by_reactions(a) == pytest.approx(
        by_work, abs=1e-11 * (abs(s.J * a) + abs(s.bias) + 100.0)
    )


@pytest.mark.parametrize("seed", range(20))
def test_slopes_match_the_complex_step(seed):
    p, u, _ = case(seed)
    slopes = SixBar.evaluate(MATH, p, u)[1]
    for got, by in ((slopes.tau_bias_dphi, "phi"), (slopes.tau_bias_dw, "w")):
        moved = SixBar.input_layout.from_names({by: getattr(u, by) + 1e-30j}, u)
        wanted = (SixBar.shared(numpy_(), p, moved, None).bias / p.ratio).imag / 1e-30
        assert got == pytest.approx(float(wanted), rel=1e-10, abs=1e-10)


def test_engines_agree():
    import casadi

    p, u, _ = case(5)
    wanted = [
        v
        for part, out in zip(SixBar.parts, SixBar.evaluate(MATH, p, u), strict=True)
        for v in part.layout.values(out)
    ]
    us = casadi.SX.sym("u", len(SixBar.input_layout.names))
    parts = SixBar.evaluate(casadi_(), p, SixBar.input_layout.instance(casadi.vertsplit(us)))
    symbols = [v for part, out in zip(SixBar.parts, parts, strict=True) for v in part.layout.values(out)]
    f = casadi.Function("f", [us], [casadi.vertcat(*symbols)])
    np.testing.assert_allclose(f(SixBar.input_layout.values(u)).full().ravel(), wanted, rtol=1e-11)
    many = SixBar.input_layout.from_names({"phi": np.full((2, 3), u.phi)}, u)
    tau = SixBar.evaluate(numpy_(), p, many)[0].tau
    np.testing.assert_allclose(tau, np.full((2, 3), SixBar.evaluate(MATH, p, u)[0].tau), rtol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_the_direct_model_is_the_inverse_of_the_inverse_one(seed):
    _, u, _ = case(seed)
    p = TurningSixBar.parameter_layout.from_names(LOSSY | {"J_added": 0.02})
    given = TurningSixBar.Inputs(tau=7.0, load=u.load, resistance=u.resistance)
    x = TurningSixBar.States(phi=u.phi, w=u.w)
    rates = TurningSixBar.derivatives(MATH, p, given, x)
    (out,) = TurningSixBar.evaluate(MATH, p, given, x)
    need = SixBar.evaluate(MATH, p, SixBar.input_layout.from_names({"a": rates[1]}, u))[0]
    assert rates == [u.w, out.a]
    assert need.tau + 0.02 * out.a == pytest.approx(7.0, rel=1e-11)
    assert out.output_bearing.fx == pytest.approx(need.output_bearing.fx, rel=1e-11)
    # the motor drives what is on its shaft, too
    assert out.power == pytest.approx(7.0 * u.w)
    assert out.kinetic_energy == pytest.approx(need.kinetic_energy + 0.5 * 0.02 * u.w**2)
    engine, moving = dual(MATH), TurningSixBar.States(phi=Dual(u.phi, u.w), w=Dual(u.w, out.a))
    (along,) = TurningSixBar.evaluate(engine, p, given, moving)
    stored = slope(along.kinetic_energy) + slope(along.potential_energy)
    assert out.power == pytest.approx(stored + out.dissipated_power, abs=1e-10 * abs(stored) + 1e-9)


def light_linkage(xp, p, u):
    """The same but for the crank, which has no body at all."""
    bars = SixBar.linkage(xp, p, u)
    return replace(bars, driver=Crank(bars.driver.bar._replace(mass=None), "A"))


LightSixBar = SixBar.altered(name="LightSixBar", linkage=light_linkage)
OtherSixBar = SixBar.altered(
    name="OtherSixBar",
    probes=lambda xp, p, u, s, a: SixBar.probes(xp, p, u, s, a) | {"angle": 3.0},
)


def test_a_machine_made_of_another_has_its_own_outputs():
    p, u, _ = case(2)
    assert OtherSixBar.evaluate(MATH, p, u)[0].angle == 3.0 != SixBar.evaluate(MATH, p, u)[0].angle
    direct = OtherSixBar.direct()
    assert (
        direct.evaluate(MATH, direct.Parameters(), direct.Inputs(), direct.States(phi=0.0, w=1.0))[0].angle
        == 3.0
    )


def test_a_crank_without_a_body_needs_an_inertia_on_its_shaft():
    direct = LightSixBar.direct()
    with pytest.raises(GeometryError, match=r"inertia of the crank and on its shaft = 0 kg m2"):
        direct.check(direct.Parameters())
    p = direct.check(direct.Parameters(J_added=0.1))
    assert math.isfinite(direct.derivatives(MATH, p, direct.Inputs(), direct.initial_states(MATH, p))[1])


def test_numbers_derived_once_follow_from_the_groups():
    """No model states how many."""
    assert SixBar.derived_count == 0
    triad = KnifeDrive.at_start.groups[-1]
    assert KnifeDrive.derived_count == KnifeDrive.direct().derived_count == triad.derived_count > 0


def hanging(p, u, state):
    """The six-bar with four rods from a ground pin to a point of the output link."""
    rods = Rods([0.2, 0.15, 0.2, 0.15], [2.0, 1.0, 1.5, 3.0], [0.3, 0.1, 0.2, 0.1, 0.4])
    bars = SixBar.linkage(MATH, p, u)
    chain = HangingChain("wall", "W", rods, state, p.g, Resistance("", 12.0, p.processing), 2)
    ground = {**bars.ground, "wall": Vec2(-0.6, 0.7)}
    return replace(bars, ground=ground, loads={**bars.loads, "chain": chain})


@pytest.mark.parametrize("seed", range(10))
def test_slopes_with_a_chain_match_the_complex_step(seed):
    """By the crank's angle and speed, the rods where they are: the chain resists the acceleration of its pin, whose
    slope has the third derivative."""
    p, u, _ = case(seed)
    rng = np.random.default_rng(seed)
    q, w, state = u.phi / p.ratio, u.w / p.ratio, (rng.uniform(0.2, 2.0, 4), rng.uniform(-1.0, 1.0, 4))
    linkage = hanging(p, u, tuple(list(map(float, values)) for values in state))

    def bias(q, w):
        return MachineState(numpy_(), Mechanism(numpy_(), linkage, q), w).bias

    slopes = MachineState(MATH, Mechanism(MATH, linkage, q), w).slopes()
    wanted = [bias(q + 1e-30j, w).imag / 1e-30, bias(q, w + 1e-30j).imag / 1e-30]
    np.testing.assert_allclose(slopes, wanted, rtol=1e-10, atol=1e-10)


def test_dual_numbers_over_dual_numbers_are_refused():
    """They would mix up what they are the slopes of."""
    p, u, _ = case(1)
    moving = SixBar.input_layout.from_names({"phi": Dual(u.phi, 1.0)}, u)
    with pytest.raises(TypeError, match="dual numbers over dual numbers"):
        SixBar.evaluate(dual(MATH), p, moving)


def test_a_chain_hangs_on_any_linkage():
    """Four rods from a ground pin to a point of the output link: power is what bodies and chain store and lose, with
    any acceleration, by dual numbers along the motion; the torque by the forces is that of virtual work."""
    p, u, _ = case(3)
    q, w, a = 2.0, 5.0, 20.0
    linkage = functools.partial(hanging, p, u)
    state = [0.5, 0.9, 1.4, 2.0], [0.0, 1.0, -1.0, 0.5]
    for _ in range(30):
        m = Mechanism(MATH, linkage(state), q)
        state = m.linkage.loads["chain"].close(MATH, m, w)[:2]
    s = ChainedState(MATH, Mechanism(MATH, linkage(state), q), w)
    held = s.chains["chain"]
    assert held.gap.length(MATH) < 1e-12
    accelerations, _ = held.at(a)
    theta, omega = state
    moving = (
        [Dual(x, v) for x, v in zip(theta, omega, strict=True)],
        [Dual(v, rate) for v, rate in zip(omega, accelerations, strict=True)],
    )
    engine = dual(MATH)
    along = ChainedState(engine, Mechanism(engine, linkage(moving), Dual(q, w)), Dual(w, a))
    kinetic, potential, _ = along.chains["chain"].energies(engine, [0.0] * 4)
    stored = slope(along.kinetic_energy + along.potential_energy + kinetic + potential)
    lost, power = s.lost_torque * w + held.lost_power(), s.torque(a) * w
    assert abs(held.torque(held.chain.forces)) > 0.5 and held.lost_power() > 0.0
    assert power == pytest.approx(stored + lost, abs=1e-9 * (abs(stored) + abs(lost)))
    assert s.torque_by_reactions(a) == pytest.approx(s.torque(a) - s.effects["pins"].dissipative, rel=1e-11)


def test_names_follow_from_the_description():
    topology = SixBar.topology
    assert topology.links == {
        "crank": ("O1", "A"), "coupler": ("A", "B", "P"), "rocker": ("O2", "B"), "link": ("P", "Q"),
        "output": ("O3", "Q", "W"),
    }  # fmt: skip
    assert {pin for pin, _ in topology.joints} == {joint["name"] for joint in DATA["description"]["joints"]}


def test_a_knife_drive_without_losses_keeps_its_energy():
    """A turn under its own weight and momentum, through the triad's branch, by an error-controlled solver."""
    model = KnifeDrive.direct()
    p = model.check(model.parameter_layout.from_names({"w_start": 12.0, "J_added": 0.5}))
    u, layout = model.Inputs(), model.state_layout
    run = solve_ivp(
        lambda _, x: model.derivatives(MATH, p, u, layout.instance([float(v) for v in x])),
        (0.0, 0.6), layout.values(model.initial_states(MATH, p)), rtol=1e-11, atol=1e-11, method="DOP853",
    )  # fmt: skip
    energies = []
    for phi, w in run.y.T:
        s = model.shared(MATH, p, u, model.States(phi=float(phi), w=float(w)))
        (out,) = model.evaluate(MATH, p, u, model.States(phi=float(phi), w=float(w)))
        assert out.kinetic_energy == pytest.approx(s.kinetic_energy + 0.5 * p.J_added * w * w)
        energies.append(out.kinetic_energy + out.potential_energy)
    assert run.y[0, -1] > 2.0 * math.pi and np.ptp(run.y[1]) > 1.0
    assert np.ptp(energies) < 1e-8 * abs(np.max(np.abs(energies)))
