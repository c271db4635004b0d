"""The cardan driveline as a model: power, slopes, limit cases, and in a system between motor and machine."""

from __future__ import annotations

import dataclasses
import math
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from systems import component

from chainunit import InputError, RunError
from chainunit.core import engines
from chainunit.core.errors import GeometryError
from chainunit.core.ports import LoadPort
from chainunit.core.quantities import Layout
from chainunit.drives import cardan
from chainunit.drives.cardan import ShaftLine, Twist
from chainunit.drives.dc_motor import DcMotor
from chainunit.drives.driveline import CardanDriveline
from chainunit.fmu.native.export import export as export_native
from chainunit.machines.chain_unit import ChamberForces
from chainunit.system import CoSimulation, Profile, System, certify, export, monolithic, rigid, shaft_joints

LAYOUT = CardanDriveline.state_layout
BENT = {"alpha1": 0.5, "alpha2": 0.2, "delta_yokes": 0.7, "beta_planes": 0.2, "gamma1": 0.3}


def parameters(**given):
    p = CardanDriveline.parameter_layout.from_names(given)
    CardanDriveline.check(p)
    return p


def inputs(**given):
    return CardanDriveline.input_layout.from_names({n.replace("__", "."): v for n, v in given.items()})


def at(p, u, x):
    return CardanDriveline.evaluate(engines.MATH, p, u, LAYOUT.instance(x))


def random_case(rng):
    p = parameters(
        alpha1=rng.uniform(0.0, 0.8),
        alpha2=rng.uniform(0.0, 0.8),
        beta_planes=rng.uniform(-3.0, 3.0),
        delta_yokes=rng.uniform(-3.0, 3.0),
        gamma1=rng.uniform(-3.0, 3.0),
        c2=10.0 ** rng.uniform(2.0, 5.0),
        c3=10.0 ** rng.uniform(2.0, 5.0),
        d2=rng.uniform(0.0, 5.0),
        d3=rng.uniform(0.0, 5.0),
        J4=10.0 ** rng.uniform(-2.0, 2.0),
        ratio=rng.uniform(0.5, 50.0),
    )
    phi, w = rng.uniform(-100.0, 100.0), rng.uniform(-200.0, 200.0)
    phi3, i, _ = cardan.two_joints(engines.MATH, p, p.gamma1 + phi / p.ratio)
    start, _, _ = cardan.two_joints(engines.MATH, p, p.gamma1)
    x = [0.0, phi3 - start + rng.uniform(-0.02, 0.02), i * w / p.ratio + rng.uniform(-1.0, 1.0)]
    u = inputs(
        phi=phi, w=w, load__tau_bias=rng.uniform(-500.0, 500.0), load__J=rng.uniform(0.0, 50.0),
        load__tau_bias_dphi=rng.uniform(-50.0, 50.0), load__phi0=x[1], load__w0=x[2] + 0.1,
        load__tau_bias_dw=rng.uniform(0.0, 5.0), load__dJ_dphi=rng.uniform(-5.0, 5.0),
    )  # fmt: skip
    return p, u, x


def test_power_in_is_power_out_and_stored_and_lost():
    """The balance of power holds to rounding at random points; the growth of the stored energy is by a complex
    step."""
    rng = np.random.default_rng(6)
    for _ in range(300):
        p, u, x = random_case(rng)
        out, _ = at(p, u, x)
        rates = CardanDriveline.derivatives(engines.MATH, p, u, LAYOUT.instance(x))
        dual = engines.dual(engines.MATH)
        along = (
            dual,
            p,
            dataclasses.replace(u, phi=engines.Dual(u.phi, u.w)),
            LAYOUT.instance([engines.Dual(v, d) for v, d in zip(x, rates, strict=True)]),
        )
        moving = CardanDriveline.parts[0].equations(*along, CardanDriveline.shared(*along))
        grows = engines.slope(moving.kinetic_energy) + engines.slope(moving.potential_energy)
        values = out.driven.tau * x[2]
        terms = (out.power, values, grows, out.dissipated_power)
        assert out.power - values - grows - out.dissipated_power == pytest.approx(
            0.0, abs=1e-9 * sum(map(abs, terms))
        )
        assert rates[0] == values


def test_slopes_of_the_port():
    """The slope by the speed is the partial derivative, that by the angle the one along the motion; against
    differences."""
    rng = np.random.default_rng(7)
    for _ in range(50):
        p, u, x = random_case(rng)
        out, port = at(p, u, x)
        h = 1e-6

        def tau(p, u, x, t=0.0, dw=0.0, held=False):
            w4 = x[2]
            a4 = 0.0 if held else at(p, u, x)[0].driven.a
            u = dataclasses.replace(u, phi=u.phi + (0.0 if held else u.w * t), w=u.w + dw)
            return at(p, u, [0.0, x[1] + w4 * t + 0.5 * a4 * t * t, w4 + a4 * t])[0].tau

        by_w = (tau(p, u, x, dw=h, held=True) - tau(p, u, x, dw=-h, held=True)) / (2.0 * h)
        assert port.tau_bias_dw == pytest.approx(by_w, rel=1e-5, abs=1e-6 * abs(out.tau))
        along = (tau(p, u, x, t=h) - tau(p, u, x, t=-h)) / (2.0 * h * u.w)
        scale = abs(along) + (p.c2 + p.c3) / p.ratio**2 * 1e-3
        assert port.tau_bias_dphi == pytest.approx(along, rel=1e-4, abs=1e-4 * scale)
        # where nothing turns it is the stiffness
        still = [0.0, x[1], 0.0]
        standing = dataclasses.replace(u, w=0.0)
        ends = [
            at(p, dataclasses.replace(standing, phi=standing.phi + sign * h), still)[0].tau
            for sign in (1, -1)
        ]
        plain = (ends[0] - ends[1]) / (2.0 * h)
        assert at(p, standing, still)[1].tau_bias_dphi == pytest.approx(plain, rel=1e-4, abs=1e-4)


def test_damping_is_that_of_a_cardan_without_mass():
    """Against the exact massless cardan, whose angle phi2 is a state, in parts of the start's twist: the same where
    d2/c2 = d3/c3 and i23 is constant, nearly so where i23 alone varies; else they differ by the order of (k d/c)^2, a
    quarter with half the damping."""

    def exact(p, J1, J4, start, stop):
        def rates(_, y):
            phi1, w1, phi4, w4, phi2 = y
            phi3, i, _ = cardan.two_joints(engines.MATH, p, phi2)
            pull2, pull3 = p.c2 * (phi1 - phi2), p.c3 * (phi3 - phi4)
            # d2 (w1 - w2) + pull2 = i (d3 (i w2 - w4) + pull3)
            w2 = (pull2 + p.d2 * w1 - i * (pull3 - p.d3 * w4)) / (p.d2 + i * i * p.d3)
            tau2, tau3 = pull2 + p.d2 * (w1 - w2), pull3 + p.d3 * (i * w2 - w4)
            return [w1, -tau2 / J1, w4, tau3 / J4, w2]

        return solve_ivp(rates, (0.0, stop), start, method="Radau", rtol=1e-10, atol=1e-13).y[:, -1]

    def ours(p, J1, J4, start, stop):
        def rates(_, y):
            line = Twist(engines.MATH, p, *y)
            return [y[1], -line.tau1 / J1, y[3], line.tau4 / J4]

        return solve_ivp(rates, (0.0, stop), start, method="DOP853", rtol=1e-11, atol=1e-14).y[:, -1]

    J1, J4, differences = 0.4, 2.0, []
    for d2, d3, alpha2 in ((2.0, 4.0, 0.4), (2.0, 4.0, 0.1), (2.0, 0.0, 0.1), (1.0, 0.0, 0.1)):
        p = ShaftLine(c2=8000.0, c3=16000.0, alpha1=0.4, alpha2=alpha2, d2=d2, d3=d3)
        phi3, i, _ = cardan.two_joints(engines.MATH, p, 0.2)
        start = [0.2 + 1e-3, 20.0, phi3, 20.0 * i]
        phi2 = cardan.middle_angle(engines.MATH, p, start[0], phi3)
        result = ours(p, J1, J4, start, 0.2)
        reference = exact(p, J1, J4, [*start, phi2], 0.2)[:4]
        differences.append(float(np.max(np.abs(result - reference) / [1e-3, 0.2, 1e-3, 0.2])))
    same, alike, other, half = differences
    assert same < 1e-8 and 1e-6 < alike < 1e-5, differences
    assert 1e-4 < other < 1e-2 and 3.0 < other / half < 5.0, differences


def driven(**line):
    """Motor, a line on its fast shaft, and the machine behind a gear."""
    components = {
        "machine": component(ChamberForces, values={"ratio": 50.0}),
        "driveline": component(CardanDriveline, values=line),
        "motor": component(DcMotor),
    }
    joints = [
        *shaft_joints("motor", "driveline"),
        *shaft_joints("driveline", "machine", flange="driven", load="machine"),
    ]
    return System(components, joints)


@pytest.fixture(scope="module")
def system(c_compiler, tmp_path_factory):
    line = {"c2": 60.0, "c3": 60.0, "d2": 0.02, "d3": 0.02, "J4": 0.002, **BENT}
    return export(driven(**line), tmp_path_factory.mktemp("system"), "native")[0]


RISE = Profile(0.0, ((0.0, 0.4, 150.0),))
SIGNALS = {"motor.w_ref": RISE}


STEPS = (1e-3, 5e-4, 2.5e-4)
READ = ("motor.w", "driveline.driven.w", "driveline.tau2", "driveline.tau3", "machine.tau")


def errors_of(system, signals, stop, rtol=1e-9):
    """The largest error of each variable of `READ` in parts of its range, a row for each of `STEPS`."""
    exact = monolithic(system, signals, np.linspace(0.0, stop, round(stop / 2e-3) + 1), rtol=rtol)
    errors = []
    for step in STEPS:
        with CoSimulation(system, signals) as simulation:
            run = simulation.run(stop, step)
        every = round(2e-3 / step)
        differences = {name: run[name].values[::every] - exact[name].values for name in READ}
        errors.append([np.max(np.abs(x)) / np.ptp(exact[name].values) for name, x in differences.items()])
    return errors


@pytest.mark.stages(first=1)
@pytest.mark.parametrize(
    ("speed", "ramp", "order", "of_page"),
    [
        (0.0, 1.5, 1.0, "0.92 % 0.46 % 0.23 %"),
        (0.0, 15.0, 1.0, "0.13 % 0.062 % 0.031 %"),
        (150.0, 1.5, 2.0, "0.35 % 0.086 % 0.021 %"),
    ],
)
def test_from_rest_the_coupling_is_of_first_order(system, speed, ramp, order, of_page):
    """The table of docs/physics.md."""
    turning = system.with_values({"motor.w_start": speed, "driveline.w_start": speed})
    rise = {"motor.w_ref": Profile(speed, ((0.0, 0.4, speed + ramp),))}
    errors = np.array(errors_of(turning, rise, 0.2, 1e-10))
    np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), order, atol=0.09)
    page = (Path(__file__).parents[1] / "docs" / "physics.md").read_text()
    shown = re.findall(r"\S+ %", of_page)
    assert [f"{100.0 * each:.2g} %" for each in errors.max(axis=1)] == shown
    assert all(f"| {each} |" in page for each in shown)


@pytest.mark.compiler
def test_a_shaft_that_signals_turn_is_followed_to_second_order(tmp_path):
    """Angle and speed run on inside a step from where they are at its begin, and lie on their signals at its end."""
    start = {**BENT, "d3": 3.0, "w_start": 40.0}
    file = export_native(CardanDriveline, tmp_path / "line.fmu", start)
    system = System({"line": component(CardanDriveline, file, start)})
    signals = {
        "line.phi": lambda t: 40.0 * t + 1.0 - np.cos(20.0 * t),
        "line.w": lambda t: 40.0 + 20.0 * np.sin(20.0 * t),
        "line.a": lambda t: 400.0 * np.cos(20.0 * t),
        "line.load.J": 1.0,
        "line.load.tau_bias": lambda t: 30.0 * np.sin(15.0 * t),
    }
    times = np.linspace(0.0, 0.1, 101)
    exact, errors = monolithic(system, signals, times, rtol=1e-10), []
    for every in (1, 2):
        with CoSimulation(system, signals) as simulation:
            run = simulation.run(0.1, 1e-3 / every)
        np.testing.assert_array_equal(run["line.phi"][::every], signals["line.phi"](times))
        for name in ("line.driven.w", "line.tau"):
            wrong = np.abs(run[name].values[::every] - exact[name].values)
            errors.append(np.max(wrong) / np.ptp(exact[name].values))
    assert max(errors[:2]) < 5e-6 and np.all(np.array(errors[:2]) > 3.0 * np.array(errors[2:])), errors
    # a shaft that stands by its signals stands, whatever its speed
    with CoSimulation(system, {"line.phi": 0.7, "line.w": 2.0}) as simulation:
        assert np.all(simulation.run(0.01, 2e-3)["line.phi"] == 0.7)


@pytest.mark.compiler
def test_too_long_a_step_runs_away_and_no_fmu_can_tell(tmp_path):
    """A rotor on a stiff line, whose k the FMUs do not know: as docs/physics.md says."""
    line, motor = CardanDriveline.parameter_layout, DcMotor.parameter_layout
    start = {v.name: v.quantity.start for v in (*line.variables, *motor.variables)}
    stiffness = 1.0 / (1.0 / start["c2"] + 1.0 / start["c3"])
    k = math.sqrt(stiffness * (1.0 / start["rotor.J"] + 1.0 / start["J4"]))
    assert round(k, -1) == 1070 and f"{0.3 / k * 1e3:.2f}" == "0.28"
    stiff, signals = export(driven(), tmp_path, "native")[0], {"motor.w_ref": 100.0}
    exact = monolithic(stiff, signals, np.linspace(0.0, 0.4, 201), rtol=1e-5)["motor.w"].values
    with CoSimulation(stiff, signals) as simulation:
        run = simulation.run(0.4, 2e-3)["motor.w"].values
    assert 25.0 < np.max(np.abs(run - exact)) / np.ptp(exact) < 40.0
    with (
        pytest.raises(RunError, match=r"the states left all bounds in the step from t = 0\.3"),
        CoSimulation(stiff, signals) as simulation,
    ):
        simulation.run(0.4, 4e-3)


def test_the_coupling_converges_to_the_monolithic_solution(system):
    """Of second order, through both ports, with the shafts turning and bent joints at 150 rad/s."""
    errors = errors_of(system, SIGNALS, 0.8)
    finer, finest = np.log2(np.array(errors[0]) / errors[1]), np.log2(np.array(errors[1]) / errors[2])
    assert np.all(finer > 1.7) and np.all(finest > 1.85), (errors, finer, finest)
    assert max(errors[0]) < 2e-2 and max(errors[2]) < 1e-3, errors


def test_energy_of_both_bonds(system):
    with CoSimulation(system, SIGNALS) as simulation:
        run = simulation.run(0.8, 2.5e-4)
    assert [(b.driver, b.machine) for b in system.bonds] == [("motor", "driveline"), ("driveline", "machine")]
    for driven, (_, share) in certify(run, system).items():
        assert share < 2e-4, driven
    assert float(np.max(np.abs(run["driveline.load_energy"]))) > 10.0


def test_a_stiff_line_is_a_rigid_shaft():
    """With straight joints and a stiff line the machine's torque tends to that without a line, J4 beside."""
    elastic = driven(alpha1=0.0, alpha2=0.0, c2=4e4, c3=4e4, d2=2.0, d3=2.0, J4=1e-4)
    straight = rigid(elastic, "driveline")
    assert straight.connections == [
        *((f"motor.{x}", f"machine.{x}") for x in ("phi", "w", "a")),
        *((f"machine.{x}", f"motor.load.{x}") for x in Layout(LoadPort).names),
    ]
    assert straight.values["motor.rotor.J"] == elastic.values["motor.rotor.J"] + 1e-4
    assert straight.values["machine.ratio"] == 50.0
    times = np.linspace(0.0, 0.8, 401)
    one, other = (monolithic(each, SIGNALS, times, rtol=1e-8) for each in (elastic, straight))
    for name in ("machine.tau", "machine.w0"):
        difference = np.max(np.abs(one[name].values - other[name].values))
        assert difference < 2e-3 * np.max(np.abs(other[name].values)), name


@pytest.mark.compiler
def test_both_backends_agree_also_in_a_turning_step(tmp_path):
    """The inputs run along w and a inside each step, in the native FMU as in that of pythonfmu."""
    from chainunit.fmu.export import export as python
    from chainunit.fmu.native.export import export as native

    start = {**BENT, "w_start": 30.0, "d3": 3.0, "ratio": 2.0}
    signals = {"line.load.tau_bias": 40.0, "line.load.J": 3.0, "line.w": 30.0, "line.a": 5.0, "line.phi": 0.0}
    runs = []
    for name, make in (("n", native), ("p", python)):
        file = make(CardanDriveline, tmp_path / f"{name}.fmu", start)
        # the signals are set once: between, phi and w run by themselves
        with CoSimulation(System({"line": component(CardanDriveline, file, start)})) as simulation:
            simulation.signals = signals
            simulation.run(0.001, 0.001)
            simulation.signals = {}
            runs.append(simulation.run(0.2, 0.002))
    for name in runs[0].data_vars:
        reference = runs[0][name].values
        np.testing.assert_allclose(
            runs[1][name].values, reference, rtol=1e-9, atol=1e-9 * np.max(np.abs(reference)) + 1e-12
        )
    out = runs[0]
    t = float(out["time"][-1]) - float(out["time"][0])
    assert float(out["line.w0"][-1]) == pytest.approx(float(out["line.w0"][0]) + 5.0 * t, rel=1e-12)
    advanced = float(out["line.phi0"][-1] - out["line.phi0"][0])
    assert advanced == pytest.approx(float(out["line.w0"][0]) * t + 2.5 * t * t, rel=1e-12)


@pytest.mark.parametrize(
    ("values", "named"),
    [
        (
            {"alpha1": 1.6},
            "alpha1 = 1.6 rad: a Hooke joint turns only with a bend below 90 deg; must be < 1.5708 rad",
        ),
        ({"alpha2": 0.5 * np.pi}, "alpha2 = 1.5708 rad"),
        ({"c2": 0.0}, "c2 = 0 N m/rad: must be > 0"),
        ({"c3": -1.0}, "c3 = -1 N m/rad: must be > 0"),
        ({"J4": 0.0}, "J4 = 0 kg m2: must be > 0"),
        ({"d2": -0.1}, "d2 = -0.1 N m s/rad: must be >= 0"),
        ({"ratio": 0.0}, "ratio = 0: must be > 0"),
    ],
)
@pytest.mark.compiler
def test_bad_parameters_are_refused_in_one_line(values, named, tmp_path):
    from chainunit.fmu.native.export import export

    with pytest.raises((InputError, GeometryError)) as refusal:
        export(CardanDriveline, tmp_path / "x.fmu", values)
    assert named in str(refusal.value) and "\n" not in str(refusal.value)
    assert not (tmp_path / "x.fmu").exists()
