"""The knife drive: reference points of an independent multibody solution, power, two torque routes, refusals."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from systems import component

from chainunit import GeometryError, InputError
from chainunit.core.engines import MATH, Dual, dual, numpy_, slope
from chainunit.fmu.native.export import export
from chainunit.groups.followed import TERMS
from chainunit.groups.series import values_of
from chainunit.groups.triad import Pose
from chainunit.machines.knife_drive import KnifeDrive, modes
from chainunit.mechanism.machine import Mechanism

POINTS = json.loads((Path(__file__).parent / "data" / "class_iii.json").read_text())["points"]
PINS = {
    "O1": "crank_bearing", "A": "crank_pin", "B_ab": "coupler_pin", "O2": "rocker_bearing", "B_bc": "leg_pin",
    "C": "c_pin", "D": "d_pin", "E": "e_pin", "O3": "o3_bearing", "O4": "o4_bearing",
}  # fmt: skip
DEFAULT = KnifeDrive.with_derived(MATH, KnifeDrive.parameter_layout.from_names({}))
BODIES = ("crank", "coupler", "rocker", "leg_b", "leg_3", "leg_4", "knife")
NAMES = [name for part in KnifeDrive.parts for name in part.layout.names]


def evaluate(p, given, xp=MATH):
    """Every output by name."""
    parts = KnifeDrive.evaluate(xp, p, KnifeDrive.input_layout.from_names(given))
    values = [v for part, out in zip(KnifeDrive.parts, parts, strict=True) for v in part.layout.values(out)]
    return dict(zip(NAMES, values, strict=True))


def inputs_of(point):
    """The reference's frame is x right, y down; its crank angle counts from the x axis, clockwise on the page."""
    state, (fx, fy) = point["state"], point["blade_force"]
    turn = {"phi": state["phi"] + 0.5 * math.pi, "w": state["omega"], "a": state["alpha"]}
    return turn | {"blade.fx": fx, "blade.fy": -fy}


def wanted_of(point):
    out = point["outputs"]
    found = {"tau": out["torque"], "J": out["M"], "dJ_dphi": 2.0 * out["h_coef"]}
    for theirs, ours in PINS.items():
        fx, fy = out["forces"][theirs]
        found |= {f"{ours}.fx": fx, f"{ours}.fy": -fy}
    knife, (x, y) = out["bodies"]["cde"], out["points"]["K"]
    return found | {"blade.x": x, "blade.y": -y, "blade.tilt": -knife["theta"]}


def deviation(got, wanted):
    return max(abs(float(got[name]) - x) / max(1.0, abs(x)) for name, x in wanted.items())


@pytest.mark.parametrize("point", POINTS, ids=lambda p: str(p["id"]))
def test_reference_points(point):
    """Torque, reflected inertia, all ten reactions and the knife; the motion of every body."""
    assert deviation(evaluate(DEFAULT, inputs_of(point)), wanted_of(point)) < 1e-9
    u = KnifeDrive.input_layout.from_names(inputs_of(point))
    m, w, a = KnifeDrive.shared(MATH, DEFAULT, u, None).m, u.w, u.a
    assert set(m.bodies) == set(BODIES)
    for link, name in zip(BODIES, ("crank", "ab", "bo2", "bc", "o3d", "o4e", "cde"), strict=True):
        body = m.bodies[link]
        c, link, given = body.c, body.link, point["outputs"]["bodies"][name]
        got = {
            "x": c.p.x, "y": -c.p.y, "vx": c.p1.x * w, "vy": -c.p1.y * w, "omega": -link.t1 * w,
            "ax": c.p1.x * a + c.p2.x * w * w, "ay": -(c.p1.y * a + c.p2.y * w * w),
            "eps": -(link.t1 * a + link.t2 * w * w),
        }  # fmt: skip
        assert deviation(got, {k: given[k] for k in got}) < 1e-9, name


@pytest.mark.compiler
@pytest.mark.parametrize("fmi", [2, 3])
def test_reference_points_by_the_native_fmu(fmi, tmp_path):
    from fmpy import simulate_fmu

    file = export(KnifeDrive, tmp_path / "k.fmu", fmi=fmi)
    for point in POINTS:
        wanted = wanted_of(point)
        got = simulate_fmu(
            str(file),
            start_values=inputs_of(point),
            output=list(wanted),
            stop_time=1e-3,
            output_interval=1e-3,
        )
        assert deviation({name: got[name][0] for name in wanted}, wanted) < 1e-9


def moved(xp, p, q, before=2):
    """The mechanism at the crank angle `q`; with the dyad alone before the triad."""
    linkage = KnifeDrive.linkage(MATH, p, KnifeDrive.Inputs())
    return Mechanism(xp, linkage.before(before), q, getattr(p, "derived", ()))


def random_machine(rng):
    """A knife drive around the packaged one: any triad, hung at any angle, with any bodies; None if it does not
    turn."""
    given = {f"knife.{pin}.{axis}": rng.uniform(-0.6, 0.6) for pin in "cde" for axis in "xy"}
    given |= {
        "r": rng.uniform(0.02, 0.09),
        "pin.friction": rng.uniform(0.0, 0.2),
        "joint_damping": rng.uniform(0.0, 0.5),
    }
    for rod in ("crank", "coupler", "rocker", "leg_b", "leg_3", "leg_4"):
        given |= {
            f"{rod}.m": rng.uniform(0.0, 30.0),
            f"{rod}.s": rng.uniform(-0.3, 0.5),
            f"{rod}.I": rng.uniform(0.0, 2.0),
        }
    given |= {
        "knife.m": rng.uniform(1.0, 100.0),
        "knife.I": rng.uniform(0.0, 9.0),
        "ratio": rng.uniform(0.5, 40.0),
    }
    given |= {f"knife.{at}.{axis}": rng.uniform(-0.5, 0.5) for at in ("centroid", "blade") for axis in "xy"}
    p = KnifeDrive.parameter_layout.from_names(given)
    # the triad is hung from the pin B at crank angle 0, at a random pose and with random legs
    x, y, theta = rng.uniform(0.5, 1.2), rng.uniform(-0.4, 0.4), rng.uniform(-3.0, 3.0)
    b = moved(MATH, p, 0.0, before=1).pins["B"].p
    cos, sin = math.cos(theta), math.sin(theta)

    def at(pin):
        px, py = given[f"knife.{pin}.x"], given[f"knife.{pin}.y"]
        return x + cos * px - sin * py, y + sin * px + cos * py

    given["bc"] = math.hypot(at("c")[0] - b.x, at("c")[1] - b.y)
    for pin, bearing, leg in (("d", "o3", "o3d"), ("e", "o4", "o4e")):
        angle, given[leg] = rng.uniform(-math.pi, math.pi), rng.uniform(0.3, 0.8)
        given |= {
            f"{bearing}.x": at(pin)[0] + given[leg] * math.cos(angle),
            f"{bearing}.y": at(pin)[1] + given[leg] * math.sin(angle),
        }
    given |= {"assembly.x": x, "assembly.y": y, "assembly.theta": theta}
    p = KnifeDrive.parameter_layout.from_names(given)
    try:
        KnifeDrive.check(p)
    except (GeometryError, InputError):
        return None
    p = KnifeDrive.with_derived(MATH, p)
    return p if p.derived[-1] > 0.02 else None


def first(engine, p, u):
    """The outputs without slopes, which are dual numbers themselves."""
    return KnifeDrive.parts[0].equations(engine, p, u, None, KnifeDrive.shared(engine, p, u, None))


@pytest.mark.slow
def test_power_and_two_torques_of_random_machines():
    """500 admissible triads: the power balance, with the storage's growth by dual numbers, and the crank torque from
    the reactions beside that of virtual work."""
    rng = np.random.default_rng(9)
    found = 0
    engine = dual(MATH)
    while found < 500:
        p = random_machine(rng)
        if p is None:
            continue
        found += 1
        w, a = rng.uniform(-9.0, 9.0) * p.ratio, rng.uniform(-20.0, 20.0) * p.ratio
        given = {
            "phi": rng.uniform(-20.0, 20.0) * p.ratio,
            "w": w,
            "a": a,
            "cut_force": rng.uniform(0.0, 9e3),
        }
        given |= {"blade.fx": rng.uniform(-500.0, 500.0), "blade.fy": rng.uniform(-500.0, 500.0)}
        u = KnifeDrive.input_layout.from_names(given)
        out = KnifeDrive.evaluate(MATH, p, u)[0]
        moving = KnifeDrive.input_layout.from_names({**given, "phi": Dual(given["phi"], w), "w": Dual(w, a)})
        stored = first(engine, p, moving)
        grows = slope(stored.kinetic_energy), slope(stored.potential_energy)
        size = abs(out.power) + sum(map(abs, grows)) + abs(out.dissipated_power)
        assert abs(out.power - sum(grows) - out.dissipated_power) < 1e-9 * size
        s = KnifeDrive.shared(MATH, p, u, None)
        by_forces = s.torque_by_reactions(a / p.ratio)
        by_work = s.torque(a / p.ratio) - s.effects["pins"].dissipative
        terms = (
            abs(by_forces)
            + abs(s.J * a / p.ratio)
            + sum(abs(s.effects[load].dissipative) for load in ("cut", "push", "pins"))
        )
        assert abs(by_forces - by_work) < 1e-9 * max(terms, 1.0)


def test_pins_on_one_line():
    """C, D and E on one line: all finite, and right by the two torques."""
    given = {
        "knife.c.y": 0.0,
        "knife.e.y": 0.0,
        "knife.d.y": 0.0,
        "assembly.x": 1.02,
        "assembly.y": -0.01,
        "assembly.theta": 0.0,
    }
    p = KnifeDrive.parameter_layout.from_names(given)
    KnifeDrive.check(p)
    p = KnifeDrive.with_derived(MATH, p)
    for phi in np.linspace(0.0, 6.0, 13):
        out = evaluate(p, {"phi": float(phi), "w": 4.0, "a": 2.0, "cut_force": 5e3})
        assert all(math.isfinite(x) for x in out.values())
        u = KnifeDrive.input_layout.from_names({"phi": float(phi), "w": 4.0, "a": 2.0, "cut_force": 5e3})
        s = KnifeDrive.shared(MATH, p, u, None)
        by_forces = s.torque_by_reactions(2.0)
        assert by_forces == pytest.approx(s.torque(2.0) - s.effects["pins"].dissipative, rel=1e-9)


def test_the_outputs_depend_on_the_angle_alone():
    """Whatever turn, forward or back, and alike under numpy; the knife closes after a turn."""
    phi = np.linspace(-2.0 * math.pi, 2.0 * math.pi, 201)
    out = evaluate(DEFAULT, {"phi": phi, "w": 3.0}, numpy_())
    np.testing.assert_allclose(out["blade.y"][:101], out["blade.y"][100:], rtol=1e-13)
    for k in (0, 57, 120):
        one = evaluate(DEFAULT, {"phi": float(phi[k]), "w": 3.0})
        for name, x in one.items():
            assert np.broadcast_to(out[name], phi.shape)[k] == pytest.approx(x, rel=1e-11, abs=1e-9), name


def test_slopes_and_inertia_by_differences():
    given = {"phi": 2.2, "w": 4.0, "a": 0.0, "cut_force": 6e3}
    out, h = evaluate(DEFAULT, given), 1e-6
    for name, by, of in (
        ("tau_bias_dphi", "phi", "tau_bias"),
        ("tau_bias_dw", "w", "tau_bias"),
        ("dJ_dphi", "phi", "J"),
    ):
        ends = [evaluate(DEFAULT, {**given, by: given[by] + sign * h})[of] for sign in (1, -1)]
        assert out[name] == pytest.approx((ends[0] - ends[1]) / (2.0 * h), rel=1e-5)


def test_the_stack_resists_the_blade_on_its_way_down_alone():
    phi = np.linspace(0.0, 2.0 * math.pi, 721)
    out = evaluate(DEFAULT, {"phi": phi, "w": 4.0, "cut_force": 1e4}, numpy_())
    force = np.hypot(out["blade.cut_fx"], out["blade.cut_fy"])
    stack = DEFAULT.stack
    inside = (out["blade.y"] < stack.top - 5 * stack.edge) & (out["blade.y"] > stack.table + 5 * stack.edge)
    down = out["blade.vy"] < -10 * stack.v_smooth
    assert np.sum(inside & down) > 20 and np.all(force[inside & down] > 0.95e4)
    assert np.all(force[out["blade.vy"] > 10 * stack.v_smooth] < 50.0)
    assert np.all(force[out["blade.y"] > stack.top + 5 * stack.edge] < 100.0)
    # against the motion, and never giving energy
    power = out["blade.cut_fx"] * out["blade.vx"] + out["blade.cut_fy"] * out["blade.vy"]
    assert np.all(power <= 0.0) and np.all(out["dissipated_power"] >= 0.0)


def test_modes_and_the_one_that_is_packaged():
    found = modes(DEFAULT)
    assert len(found) == 4
    a = DEFAULT.assembly
    nearest = min(found, key=lambda m: abs(m.theta - a.theta) + abs(m.x - a.x))
    assert (nearest.x, nearest.y, nearest.theta) == pytest.approx((a.x, a.y, a.theta), abs=1e-6)


def test_every_mode_that_goes_round_can_be_chosen():
    """Each has the same lengths and another motion; what ends within the turn is refused."""
    blades = []
    for mode in modes(DEFAULT):
        given = {f"assembly.{k}": v for k, v in mode._asdict().items()}
        p = KnifeDrive.parameter_layout.from_names(given)
        try:
            KnifeDrive.check(p)
        except GeometryError as refused:
            assert "triad" in str(refused)
            continue
        blades.append(evaluate(KnifeDrive.with_derived(MATH, p), {"phi": 1.0})["blade.y"])
    assert len(blades) >= 2 and len({round(b, 6) for b in blades}) == len(blades)


def test_the_series_is_a_start_and_newton_the_answer():
    """The series alone is some 1e-8 m off; what is shown closes to rounding, and what `derive` says of it is so."""
    *series, misfit, least = DEFAULT.derived
    assert len(series) == 3 * TERMS and misfit < 1e-14 and 0.3 < least < 0.6
    angles = np.linspace(0.0, 2.0 * math.pi, 257)
    near = Pose(*values_of(series, 3, TERMS, np.cos(angles), np.sin(angles)))
    link = moved(numpy_(), DEFAULT, angles).links["knife"]
    off = np.hypot(near.x - link.pin.p.x, near.y - link.pin.p.y)
    assert 1e-10 < np.max(off) < 1e-7


def test_accepted_machines_are_right_all_the_way_round():
    """30 random machines at 200 angles each: closed legs, power in balance, no jump; the series is at its worst
    between the angles at which it was made."""
    rng = np.random.default_rng(21)
    phi, found = np.linspace(0.0, 2.0 * math.pi, 200), 0
    engine = dual(numpy_())
    while found < 30:
        p = random_machine(rng)
        if p is None:
            continue
        found += 1
        moving = {
            "phi": Dual(phi * p.ratio, 4.0 * p.ratio),
            "w": Dual(4.0 * p.ratio, 3.0 * p.ratio),
            "a": 3.0 * p.ratio,
        }
        u = KnifeDrive.input_layout.from_names({**moving, "cut_force": 3e3})
        out = first(engine, p, u)
        grows = slope(out.kinetic_energy) + slope(out.potential_energy)
        size = np.max(np.abs(out.power.v)) + np.max(np.abs(grows)) + np.max(np.abs(out.dissipated_power.v))
        assert np.max(np.abs(out.power.v - grows - out.dissipated_power.v)) < 1e-9 * size
        m = moved(numpy_(), p, phi)
        for pin, leg, length in (("C", "leg_b", p.bc), ("D", "leg_3", p.o3d), ("E", "leg_4", p.o4e)):
            r = m.pins[pin].p - m.links[leg].pin.p
            np.testing.assert_allclose(np.hypot(r.x, r.y), length, rtol=1e-12)
        assert np.max(np.abs(np.diff(out.blade.x.v))) < 0.2


@pytest.mark.compiler
@pytest.mark.parametrize(
    ("values", "line"),
    [
        ({"r": 0.3}, "r = 0.3 m: the crank cannot turn with ab = 0.37, bo2 = 0.3"),
        ({"o2.x": 3.0}, "r = 0.06 m: the crank cannot turn"),
        ({"knife.e.x": 0.1}, "largest misfit of a leg over the turn of the crank, in parts of its length = "),
        ({"knife.m": -1.0}, "knife.m = -1 kg: must be >= 0 kg"),
        ({"o3d": 0.0}, "o3d = 0 m: must be > 0 m"),
    ],
)
def test_refusals(values, line, tmp_path):
    with pytest.raises((GeometryError, InputError)) as refused:
        export(KnifeDrive, tmp_path / "x.fmu", values)
    assert str(refused.value).startswith(line) and "\n" not in str(refused.value)
    assert not (tmp_path / "x.fmu").exists()


@pytest.mark.compiler
def test_the_native_fmu_refuses_what_python_refuses(tmp_path):
    """Derived values are computed anew from what is set before initialisation, and refused in the same words."""
    from chainunit import RunError
    from chainunit.system import CoSimulation, System

    file = export(KnifeDrive, tmp_path / "k.fmu")
    with pytest.raises(
        RunError,
        match=r"misfit of a leg over the turn of the crank, in parts of its length = .*the triad does not close",
    ):
        CoSimulation(System({"k": component(KnifeDrive, file, {"knife.e.x": 0.1})}))
    start = {"bc": 0.6, "assembly.x": 1.02}
    with CoSimulation(System({"k": component(KnifeDrive, file, start)}), {"k.phi": 0.7, "k.w": 2.0}) as one:
        run = one.run(0.01, 0.01)
    p = KnifeDrive.with_derived(MATH, KnifeDrive.parameter_layout.from_names(start))
    for name, x in evaluate(p, {"phi": 0.7, "w": 2.0}).items():
        assert float(run[f"k.{name}"][-1]) == pytest.approx(x, rel=1e-10, abs=1e-9), name
