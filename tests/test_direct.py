"""The direct model: motor torque in, motion out."""

from __future__ import annotations

import contextlib
import math

import fmpy
import numpy as np
import pytest
from machines import random_loads, random_machine, random_state
from scipy.integrate import solve_ivp

from chainunit import EMPTY, ChainUnitMachine, GeometryError
from chainunit.core import engines
from chainunit.core.native.compilers import compiler
from chainunit.fmu.native.export import export
from chainunit.machines.chain_unit import ChamberForces
from chainunit.system import ModelComponent, System, monolithic
from chainunit.system.instance import Fmu, Instance

MODEL = ChamberForces.direct()


def parameters(machine, **more):
    own = dict(
        zip(
            ChamberForces.parameter_layout.names,
            ChamberForces.parameter_layout.values(machine.p),
            strict=True,
        )
    )
    return MODEL.parameter_layout.from_names(own | more)


@pytest.mark.parametrize("seed", range(30))
def test_it_is_the_inverse_of_the_inverse_model(seed):
    """The torque that ChamberForces needs for the acceleration found is the torque given."""
    rng = np.random.default_rng(seed)
    machine = random_machine(rng)
    phi, w, _ = random_state(rng, machine)
    left, right = random_loads(rng), random_loads(rng)
    added = rng.uniform(0.0, 1.0)
    p = parameters(machine, J_added=added)
    u = MODEL.Inputs(tau=float(rng.uniform(-50.0, 50.0)), left=left, right=right)
    x = MODEL.States(phi=float(phi), w=float(w))
    a = MODEL.derivatives(engines.MATH, p, u, x)[1]
    out = MODEL.evaluate(engines.MATH, p, u, x)[0]
    need = machine.forces(phi, w, a, left, right)
    assert out.a == a
    size = max(1.0, abs(u.tau), abs(added * a))
    assert float(need.tau) + added * a == pytest.approx(u.tau, abs=1e-9 * size)
    assert out.left.support.fx == pytest.approx(float(need.left.support.fx), rel=1e-9, abs=1e-9)
    assert out.frame.moment == pytest.approx(float(need.frame.moment), rel=1e-9, abs=1e-7)


@pytest.mark.slow
def test_energy_is_kept_when_nothing_drives_or_brakes():
    machine = ChainUnitMachine({"pin.friction": 0.0})
    p, u = parameters(machine, w_start=4.0), MODEL.Inputs(tau=0.0, left=EMPTY, right=EMPTY)
    layout = MODEL.state_layout
    x0 = layout.values(MODEL.initial_states(engines.MATH, p))
    solution = solve_ivp(
        lambda t, y: MODEL.derivatives(engines.MATH, p, u, layout.instance(list(map(float, y)))),
        (0.0, 20.0), x0, method="DOP853", rtol=1e-11, atol=1e-12,
    )  # fmt: skip
    out = machine.forces(*solution.y)
    energy = out.kinetic_energy + out.potential_energy
    assert np.ptp(solution.y[1]) > 0.5
    assert np.max(np.abs(energy - energy[0])) < 1e-8 * np.max(out.kinetic_energy)


def test_a_machine_without_inertia_at_its_dead_points_is_refused():
    with pytest.raises(GeometryError, match=r"inertia of the crank .* must be > 0 kg m2"):
        MODEL.check(parameters(ChainUnitMachine({"crank.m": 0.0, "crank.I": 0.0})))
    MODEL.check(parameters(ChainUnitMachine({"crank.m": 0.0, "crank.I": 0.0}), J_added=0.1))


@pytest.mark.second
@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_the_fmu_falls_and_swings_as_the_equations(tmp_path):
    """From rest, no torque: CS and ME, FMI 2 and 3, against an error-controlled solver."""
    p, u = MODEL.Parameters(phi_start=0.4), MODEL.Inputs()
    layout = MODEL.state_layout
    exact = solve_ivp(
        lambda t, y: MODEL.derivatives(engines.MATH, p, u, layout.instance(list(map(float, y)))),
        (0.0, 1.0), layout.values(MODEL.initial_states(engines.MATH, p)), method="Radau", rtol=1e-9, atol=1e-11,
    ).y[:, -1]  # fmt: skip
    for fmi in (2, 3):
        file = export(MODEL, tmp_path / f"ChainUnit{fmi}.fmu", fmi=fmi)
        for kind in ("CoSimulation", "ModelExchange"):
            end = fmpy.simulate_fmu(
                str(file), fmi_type=kind, stop_time=1.0, output_interval=0.01, relative_tolerance=1e-9,
                start_values={"phi_start": 0.4}, output=["phi", "w"],
            )[-1]  # fmt: skip
            np.testing.assert_allclose(list(end)[1:], exact, rtol=2e-4, atol=1e-5)
    fmu = Fmu(tmp_path / "ChainUnit2.fmu")
    unit = Instance(fmu, "unit")
    unit.initialize({"w_start": 3.0, "ratio": 2.0, "tau": 5.0}, 0.0)
    unit.finish_initialization()
    unit.step(0.0, 0.1)
    phi, w, a, power = unit.get(["phi", "w", "a", "power"])
    loads = {f"{side}.material_mass": 30.0 for side in ("left", "right")}
    need = ChainUnitMachine(ratio=2.0).evaluate({"phi": phi, "w": w, "a": a} | loads)
    assert float(need["tau"]) == pytest.approx(5.0, rel=1e-9)
    assert power == pytest.approx(5.0 * w, rel=1e-9) and math.isfinite(a)
    unit.close()
    fmu.close()


@pytest.mark.second
@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_the_error_at_long_steps_is_that_of_a_torque_that_bends_inside_them(native_fmus):
    """From rest, with a torque that goes up and down, at communication steps of 10 and 5 ms, in parts of the peak.
    Along its derivatives a triangle is exact, and only the integrator errs. A sine is a chord in each step: its
    error is larger, whatever the integrator does, and falls with the square of the step."""
    times = np.linspace(0.0, 2.0, 201)
    system = System({"unit": ModelComponent(MODEL, MODEL.Parameters())})
    corners = [0.0, 0.5, 1.5, 2.0], [0.0, 100.0, -100.0, 0.0]
    courses = {
        "triangle": lambda t: np.interp(t, *corners),
        "sine": lambda t: 100.0 * np.sin(2.0 * np.pi * t),
    }
    errors = {}
    with contextlib.closing(Fmu(native_fmus["ChainUnit", 2][0])) as fmu:
        tau = fmu.variables["tau"].valueReference
        for course, torque in courses.items():
            exact = monolithic(system, {"unit.tau": torque}, times, rtol=1e-11)
            for every in (1, 2):
                unit, h, rows = Instance(fmu, "unit"), 0.01 / every, [[0.0, 0.0]]
                unit.initialize({}, 0.0)
                unit.finish_initialization()
                for k in range(200 * every):
                    begin, end = (float(torque(t * h)) for t in (k, k + 1))
                    unit.set(["tau"], [begin])
                    unit._fmi.setRealInputDerivatives([tau], [1], [(end - begin) / h])
                    unit.step(k * h, h)
                    rows.append(unit.get(["phi", "w"]))
                unit.close()
                for name, got in zip(("phi", "w"), np.array(rows)[::every].T, strict=True):
                    wanted = exact[f"unit.{name}"].values
                    errors[course, every, name] = np.max(np.abs(got - wanted)) / np.max(np.abs(wanted))
    for name in ("phi", "w"):
        assert max(errors["triangle", 1, name], errors["triangle", 2, name]) < 1e-6, errors
        assert errors["sine", 1, name] > 1e-4, errors
        assert 3.5 < errors["sine", 1, name] / errors["sine", 2, name] < 4.5, errors
