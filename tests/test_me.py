"""The system as one ODE of Model Exchange FMUs: against the models' own equations, the co-simulation, and events."""

from __future__ import annotations

import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
import xarray as xr
from systems import component, pair
from test_ssp import OBSERVED

from chainunit import InputError, RunError
from chainunit.core.native.compilers import compiler
from chainunit.machines.flexible import flexible
from chainunit.system import (
    CoSimulation,
    Jump,
    ModelExchange,
    Profile,
    System,
    certify,
    export,
    fmu_component,
    monolithic,
    shaft_joints,
)

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")

RUNNING = {"machine.ratio": 50.0, "motor.w_start": 150.0}
SLOWER = {
    "motor.w_ref": Profile(150.0, ((0.05, 0.1, 140.0),)),
    "machine.left.processing_force": Profile(100.0, ((0.1, 0.05, 800.0),)),
}
DIP = {"motor.voltage": Profile(1.0, ((0.15, 0.002, 0.5), (0.2, 0.002, 1.0)))}
STEP = 0.002


def packaged():
    return pair("ChamberForces", "DcMotor", values=RUNNING)


def chains(tolerance=1e-9):
    return pair(flexible(3, 1), "DcMotor", values=RUNNING | {"machine.tolerance": tolerance})


def line():
    """An induction motor on the line, a gear, a cardan shaft with bent joints, the machine."""
    bent = {"ratio": 25.0, "alpha1": 0.2, "alpha2": 0.1, "d2": 20.0, "d3": 20.0}
    parts = {
        "machine": component("ChamberForces"),
        "driveline": component("CardanDriveline", values=bent | {"w_start": 150.0}),
        "motor": component("InductionMotor", values={"w_start": 150.0}),
    }
    joints = [
        *shaft_joints("motor", "driveline"),
        *shaft_joints("driveline", "machine", flange="driven", load="machine"),
    ]
    return System(parts, joints)


KINDS = {
    "packaged": (packaged, SLOWER, ["motor.w", "machine.tau"]),
    "chains": (chains, SLOWER, ["motor.w", "machine.tau", "machine.left.tangential_load"]),
    "line": (line, DIP, ["motor.w", "machine.tau", "driveline.tau2"]),
}
STOP = 0.24


FIRST, *LATER = KINDS


@pytest.fixture(
    scope="module", params=[FIRST, *(pytest.param(name, marks=pytest.mark.second) for name in LATER)]
)
def kind(request, tmp_path_factory):
    """The system with its FMUs, its signals, names that are compared."""
    graph, signals, names = KINDS[request.param]
    return export(graph(), tmp_path_factory.mktemp(request.param), "native")[0], signals, names


def off(run, exact, name):
    """Largest difference in parts of the peak, at the instants of `exact`."""
    every = (run.sizes["time"] - 1) // (exact.sizes["time"] - 1)
    reference = exact[name].values
    return float(np.max(np.abs(run[name].values[::every] - reference)) / np.max(np.abs(reference)))


def test_it_is_the_monolithic_solution_to_its_tolerance(kind):
    system, signals, names = kind
    exact = monolithic(system, signals, np.arange(0.0, STOP + 1e-9, STEP), rtol=1e-12)
    worst = []
    for rtol in (1e-5, 1e-10):
        with ModelExchange(system, signals, rtol=rtol) as simulation:
            run = simulation.run(STOP, STEP)
        np.testing.assert_allclose(run["time"], exact["time"], atol=1e-12)
        worst.append(max(off(run, exact, name) for name in names))
        assert all(share < 1e-5 for _, share in certify(run, system).values())
    assert worst[0] < 1e-3 and worst[1] < 5e-9 and worst[1] < 1e-3 * worst[0], worst


def test_the_co_simulation_tends_to_it_with_the_square_of_the_step(kind):
    system, signals, names = kind
    with ModelExchange(system, signals, rtol=1e-9) as simulation:
        exact = simulation.run(STOP, STEP)
    runs = []
    for step in (STEP / 4.0, STEP / 8.0, STEP / 16.0):
        with CoSimulation(system, signals) as simulation:
            runs.append(simulation.run(STOP, step))
    for name in names:
        errors = [off(run, exact, name) for run in runs]
        orders = np.log2(np.array(errors[:-1]) / errors[1:])
        assert np.all(np.abs(orders - 2.0) < 0.3) and errors[-1] < 1e-3, (name, errors)


def test_it_computes_what_the_co_simulation_records(kind):
    system, signals, _ = kind
    with ModelExchange(system, signals) as one, CoSimulation(system, signals) as other:
        runs = [one.run(0.01, STEP), other.run(0.01, STEP)]
    assert set(runs[0]) == set(runs[1])
    for name in runs[0]:
        assert runs[0][name].attrs == runs[1][name].attrs


# -- events


@pytest.mark.second
def test_chains_that_drift_are_put_back(tmp_path):
    """At constant crank speed with a loose solver, a strict FMU asks for events, in which the chains are closed."""
    model, w = flexible(3, 1), 6.0
    turning = {"machine.phi": lambda t: w * t, "machine.w": w}
    runs, events = [], []
    for tolerance in (1e-10, 1e-2):
        parts = {"machine": component(model, values={"tolerance": tolerance})}
        system = export(System(parts, start={"machine.w": w}), tmp_path / f"{tolerance}", "native")[0]
        with ModelExchange(system, turning, rtol=1e-3, method="RK23") as simulation:
            runs.append(simulation.run(1.0, 0.01))
            events.append(simulation.events)
    assert events[0] > 10 and events[1] == 0
    with ModelExchange(system, turning, rtol=1e-10) as simulation:
        exact = simulation.run(1.0, 0.01)
    for name in ("machine.tau", "machine.left.tangential_load"):
        assert off(runs[0], exact, name) < 2e-2, name


def test_a_jump_is_met_at_its_time(tmp_path):
    """A voltage that drops at an instant that is no communication point: two smooth pieces."""
    system = export(line(), tmp_path, "native")[0]
    signals = {"motor.voltage": Jump(0.0313, 1.0, 0.4)}
    with ModelExchange(system, signals, rtol=1e-9) as simulation:
        run = simulation.run(0.1, STEP)
        assert simulation.events == 1
    exact = monolithic(system, signals, run["time"].values, rtol=1e-12)
    assert max(off(run, exact, name) for name in ("motor.w", "machine.tau", "driveline.tau2")) < 1e-7


BALL = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="ball" guid="{ball}" numberOfEventIndicators="1">
  <ModelExchange modelIdentifier="ball"/>
  <ModelVariables>
    <ScalarVariable name="h" valueReference="0" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="v" valueReference="1" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="der(h)" valueReference="2"><Real derivative="1"/></ScalarVariable>
    <ScalarVariable name="der(v)" valueReference="3"><Real derivative="2"/></ScalarVariable>
    <ScalarVariable name="g" valueReference="4" causality="input"><Real start="9.81"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="1" dependencies=""/><Unknown index="2" dependencies=""/></Outputs>
    <Derivatives><Unknown index="3"/><Unknown index="4"/></Derivatives>
  </ModelStructure>
</fmiModelDescription>
"""


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    """An FMU of somebody else, for Model Exchange alone."""
    folder = tmp_path_factory.mktemp("ball")
    library = folder / f"ball{fmpy.sharedLibraryExtension}"
    headers = Path(fmpy.__file__).parent / "c-code"
    source = Path(__file__).parent / "ball.c"
    subprocess.run(["cc", "-shared", "-fPIC", f"-I{headers}", str(source), "-o", str(library)], check=True)
    with zipfile.ZipFile(folder / "ball.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", BALL)
        archive.write(library, f"binaries/{fmpy.platform}/{library.name}")
    return System({"ball": fmu_component(folder / "ball.fmu", kind="Model Exchange")})


def thrown(g=9.81, stop=1.5, bounce=0.8, kick=(1.05, 2.0)):
    """Height and speed at the end, by hand: the ball is at 1 m at rest at the start."""
    t, h, v = 0.0, 1.0, 0.0
    bounces = 0
    for until in (kick[0], stop):
        while True:
            # the positive root of h + v s - g s^2/2 = 0
            s = (v + np.sqrt(v * v + 2.0 * g * h)) / g
            if t + s > until:
                break
            t, h, v = t + s, 0.0, -bounce * (v - g * s)
            bounces += 1
        s = until - t
        t, h, v = until, h + v * s - 0.5 * g * s * s, v - g * s
        v += kick[1] if until == kick[0] else 0.0
    return h, v, bounces


@pytest.mark.parametrize("method", ["DOP853", "RK45", "Radau"])
def test_state_and_time_events_of_a_ball(ball, method):
    h, v, bounces = thrown(stop=2.5)
    assert bounces > 3
    with ModelExchange(ball, method=method, rtol=1e-10) as simulation:
        run = simulation.run(2.5, 0.01)
        assert simulation.events == bounces + 1
    assert float(run["ball.h"][-1]) == pytest.approx(h, rel=1e-8)
    assert float(run["ball.v"][-1]) == pytest.approx(v, rel=1e-8)
    assert float(np.min(run["ball.h"])) > -1e-12


def test_the_inputs_of_a_ball(ball):
    h, v, _ = thrown(g=4.0)
    with ModelExchange(ball, {"ball.g": 4.0}) as simulation:
        run = simulation.run(1.5, 0.25)
    assert float(run["ball.h"][-1]) == pytest.approx(h, rel=1e-7)
    assert float(run["ball.v"][-1]) == pytest.approx(v, rel=1e-7)


def test_a_ball_without_a_saved_state_is_thrown_again(ball):
    with ModelExchange(ball, {"ball.g": 4.0}) as simulation:
        assert simulation.without_states == ["ball"]
        simulation.run(0.7, 0.05)
        simulation.save()
        first = simulation.run(1.5, 0.25)
        simulation.signals = {"ball.g": 9.0}
        simulation.run(2.0, 0.25)
        simulation.signals = {"ball.g": 4.0}
        simulation.restore()
        assert simulation.time == 0.7 and simulation.run(1.5, 0.25).equals(first)


# -- the duties of any run


def test_going_on_branching_and_guards(kind):
    system, signals, names = kind
    with ModelExchange(system, signals) as simulation:
        whole = simulation.run(0.12, STEP)
    with ModelExchange(system, signals) as simulation:
        simulation.run(0.06, STEP)
        simulation.save()
        first = simulation.run(0.12, STEP)
        simulation.restore()
        passed = float(np.median(np.abs(first["motor.phi"].values)))
        cut = simulation.run(0.12, STEP, guards={"motor.phi": passed})
        assert 2 < cut.sizes["time"] < first.sizes["time"] and abs(float(cut["motor.phi"][-1])) > passed
        rest = simulation.run(0.12, STEP)
        simulation.restore()
        again = simulation.run(0.12, STEP)
    xr.testing.assert_identical(first, again)
    for name in names:
        size = np.max(np.abs(whole[name].values))
        np.testing.assert_allclose(
            first[name].values, whole[name].values[30:], atol=1e-5 * size, err_msg=name
        )
        assert float(rest[name][-1]) == pytest.approx(float(whole[name][-1]), abs=1e-5 * size)


@pytest.mark.second
def test_what_cannot_run_is_told(fmus, tmp_path):
    motor = component("DcMotor", fmus["DcMotor"])
    with pytest.raises(
        InputError, match=r"is FMI 2\.0, Co-Simulation alone; must be FMI 2\.0 for Model Exchange"
    ):
        ModelExchange(System({"motor": motor}))
    machine = export(System({"machine": component("ChamberForces")}), tmp_path, "native")[0]
    with pytest.raises(InputError, match="no component has states: there is nothing to solve"):
        ModelExchange(machine)
    with pytest.raises(InputError, match="method = Euler: must be one of DOP853, "):
        ModelExchange(machine, method="Euler")


def test_a_failing_run_keeps_what_it_computed(tmp_path):
    """From 0.0105 s on the reference is no number."""
    system = export(packaged(), tmp_path, "native")[0]
    signals = {"motor.w_ref": lambda t: 150.0 if t < 0.0105 else float("nan")}
    with ModelExchange(system, signals) as simulation:
        with pytest.raises(RunError, match=r"w_ref = nan rad/s") as caught:
            simulation.run(0.05, 0.001)
    partial = caught.value.partial
    assert 0 < partial.sizes["time"] <= 12 and np.all(np.isfinite(partial["motor.w"].values))


def test_a_discrete_output_changes_at_an_event_that_its_fmu_asks_for(native_fmus):
    """The alarm beside machine and motor: a whole number, up in one event; as late as a step of the solver."""
    files = {
        name: replace(each, file=native_fmus[each.model.name, 2][0])
        for name, each in OBSERVED.components.items()
    }
    with ModelExchange(replace(OBSERVED, components=files), rtol=1e-6) as simulation:
        run = simulation.run(2.2, 0.01, names=["observer.alarm", "observer.grounds.feed"])
        assert simulation.events == 1
    alarm, ground = (run[f"observer.{name}"].values for name in ("alarm", "grounds.feed"))
    (k,) = np.flatnonzero(np.diff(alarm))
    assert set(alarm[: k + 1]) == {0.0} and set(alarm[k + 1 :]) == {1.0}
    (first,) = np.flatnonzero((ground[:-1] < 1.0) & (ground[1:] >= 1.0))
    assert first <= k <= first + 2
