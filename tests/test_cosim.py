"""Co-simulation against the monolithic solution, energy, and the master's own duties."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr
from machines import random_machine
from systems import component, pair

from chainunit import ChainUnitMachine, InputError, RunError, SideLoads
from chainunit.core.errors import InterruptedRunError
from chainunit.core.native.compilers import compiler
from chainunit.fmu.native.export import export as export_native
from chainunit.machines.chain_unit import ChamberForces
from chainunit.models import MODELS
from chainunit.system import CoSimulation, Profile, System, energy_residual, hold_loads, monolithic
from chainunit.system.instance import Fmu
from chainunit.work.interrupts import stoppable

RATIO, SPEED = 50.0, 6.0
FEED = SideLoads()
STANDING = {"machine.ratio": RATIO}
START = STANDING | {"motor.w_start": RATIO * SPEED / 2.0}


def files(fmus):
    return {"machine": fmus["ChamberForces"], "motor": fmus["DcMotor"]}


def joined(fmus=None, values=START):
    """Machine and motor, with their FMUs where there are any."""
    return pair("ChamberForces", "DcMotor", files(fmus) if fmus else None, values)


def parts(fmus):
    return {name: component(file.stem, file) for name, file in files(fmus).items()}


def system(fmus, *, slopes=True, **start):
    graph = joined(fmus, START | start)
    return graph if slopes else hold_loads(graph)


(BOND,) = joined().bonds


@pytest.fixture(scope="module")
def reference():
    return monolithic(joined(), {"motor.w_ref": RATIO * SPEED / 2.0}, np.arange(0.0, 0.6001, 0.004))


def error(run, reference, name):
    every = round(0.004 / float(run["time"][1] - run["time"][0]))
    return float(np.max(np.abs(run[name].values[::every] - reference[name].values)))


def test_a_reference_goes_on_from_another(reference):
    """From the states at 0.4 s to the same end, at times of its own; a stretch between corners may hold none."""
    at = reference.sel(time=0.4, method="nearest")
    start = {name: float(at[name]) for name in map(str, reference.data_vars)}
    times = np.array([float(at["time"]), 0.5, 0.6])
    # from 0.41 to 0.42 s it changes by nothing
    signals = {"motor.w_ref": Profile(RATIO * SPEED / 2.0, ((0.41, 0.01, RATIO * SPEED / 2.0),))}
    again = monolithic(joined(values=STANDING), signals, times, start=start)
    for name in ("motor.w", "motor.phi", "machine.tau"):
        target = float(reference[name].sel(time=0.6, method="nearest"))
        assert float(again[name][-1]) == pytest.approx(target, rel=1e-8)


def test_second_order_with_slopes_first_without(fmus, reference):
    orders = {}
    for slopes in (True, False):
        errors = []
        for step in (0.004, 0.002):
            with CoSimulation(
                system(fmus, slopes=slopes), {"motor.w_ref": RATIO * SPEED / 2.0}
            ) as simulation:
                errors.append(error(simulation.run(0.6, step), reference, "machine.tau"))
        orders[slopes] = np.log2(errors[0] / errors[1])
    assert orders[True] == pytest.approx(2.0, abs=0.1)
    assert orders[False] == pytest.approx(1.0, abs=0.1)


def test_every_row_belongs_to_one_instant(fmus):
    """tau = J a + tau_bias of the recorded row, the motor's shaft torque the machine's, angles the same."""
    with CoSimulation(system(fmus), {"motor.w_ref": 150.0}) as simulation:
        run = simulation.run(0.05, 0.001)
    m, d = (lambda n: run[f"machine.{n}"].values), (lambda n: run[f"motor.{n}"].values)
    np.testing.assert_array_equal(m("phi0"), d("phi"))
    np.testing.assert_array_equal(m("w0"), d("w"))
    np.testing.assert_allclose(m("J") * d("a") + m("tau_bias"), m("tau"), rtol=1e-12)
    np.testing.assert_allclose(d("tau"), m("tau"), rtol=1e-12)


def test_python_api_gives_the_recorded_outputs(fmus):
    with CoSimulation(system(fmus), {"motor.w_ref": 150.0}) as simulation:
        run = simulation.run(0.02, 0.001)
    out = ChainUnitMachine(ratio=RATIO).forces(
        run["motor.phi"].values, run["motor.w"].values, run["motor.a"].values, FEED, FEED
    )
    np.testing.assert_allclose(run["machine.tau"].values, out.tau, rtol=1e-9)
    np.testing.assert_allclose(run["machine.left.support.fx"].values, out.left.support.fx, rtol=1e-9)
    assert run["machine.tau"].attrs["units"] == "N.m" and run["machine.tau"].attrs["long_name"]


def test_energy_residual_of_a_power_that_jumps():
    """A brake of 60 N m comes at 0.1 s: each side is integrated by itself; energy from nowhere is still missing."""
    time, w = np.linspace(0.0, 0.2, 21), 10.0
    after = time >= 0.1 - 1e-12

    def rows(braked, extra=0.0):
        values = {
            "machine.tau": 60.0 * braked,
            "motor.w": np.full(21, w),
            "motor.load_energy": 600.0 * np.maximum(time - 0.1, 0.0),
            "machine.dissipated_power": 600.0 * braked,
            "machine.kinetic_energy": np.full(21, 7.0) + extra * after,
            "machine.potential_energy": np.zeros(21),
        }
        return xr.Dataset({name: ("time", x) for name, x in values.items()}, {"time": time})

    run, lead = rows(after), rows(np.zeros(21)).isel(time=slice(0, 11))
    gap, share = energy_residual(run, BOND, lead=lead)
    assert np.max(np.abs(gap)) < 1e-9 and share < 1e-11
    # smeared over the step before it
    assert energy_residual(run, BOND)[1] > 0.02
    gap, _ = energy_residual(rows(after, extra=5.0), BOND, lead=lead)
    assert float(gap[-1]) == pytest.approx(-5.0) and float(gap[9]) == 0.0


@pytest.mark.second
def test_energy_residual_with_friction_processing_and_feed(fmus):
    """Mass flows from right to left while the machine runs: the feed's energy closes the balance."""
    machine = ChainUnitMachine(ratio=RATIO)

    def per_kg(side):
        return lambda run: machine.energy_per_kg(side, run["machine.phi0"].values, run["machine.w0"].values)

    fed = {f"machine.{s}.material_mass": per_kg(s) for s in ("left", "right")}
    signals = {
        "motor.w_ref": 150.0,
        "machine.left.material_mass": Profile(30.0, ((0.1, 0.3, 55.0),)),
        "machine.right.material_mass": Profile(30.0, ((0.1, 0.3, 0.0),)),
        "machine.left.processing_force": Profile(100.0, ((0.2, 0.05, 800.0), (0.35, 0.05, 100.0))),
    }
    shares, without = [], []
    for step in (0.002, 0.001):
        with CoSimulation(system(fmus), signals) as simulation:
            run = simulation.run(0.8, step)
        shares.append(energy_residual(run, BOND, fed)[1])
        without.append(energy_residual(run, BOND)[1])
    assert shares[1] < 2e-5 and shares[1] < shares[0] / 3.0
    assert without[1] > 100.0 * shares[1]


def test_varying_loads_act_to_second_order(fmus):
    """A load that changes within the step acts with its value at the middle of the step."""
    profile = Profile(0.0, ((0.05, 0.2, 900.0),))
    signals = {"motor.w_ref": 150.0, "machine.left.processing_force": profile}
    exact = monolithic(joined(), signals, np.arange(0.0, 0.3001, 0.004))
    errors = []
    for step in (0.004, 0.002):
        with CoSimulation(system(fmus), signals) as simulation:
            errors.append(error(simulation.run(0.3, step), exact, "motor.w"))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.25)


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_native_fmus_run_as_the_python_ones(fmus, tmp_path):
    native = {
        model: export_native(MODELS[model], tmp_path / f"{model}.fmu")
        for model in ("ChamberForces", "DcMotor")
    }
    signals = {"motor.w_ref": 150.0, "machine.left.material_mass": Profile(30.0, ((0.01, 0.05, 60.0),))}
    runs = []
    for kind in (fmus, native):
        with CoSimulation(system(kind), signals) as simulation:
            first = simulation.run(0.05, 0.001)
            simulation.save()
            simulation.run(0.07, 0.001)
            simulation.restore()
            runs.append((first, simulation.run(0.1, 0.001)))
    for one, two in zip(*runs, strict=True):
        assert set(one) == set(two)
        for name in one:
            np.testing.assert_allclose(one[name].values, two[name].values, rtol=1e-9, atol=1e-9, err_msg=name)


def test_stable_with_a_light_rotor(fmus):
    """Rotor inertia 1/50 of the machine's largest J, driven directly."""
    J = float(np.max(ChainUnitMachine().forces(np.linspace(0.0, 6.3, 400), 0.0, 0.0, FEED, FEED).J))
    light = {
        "machine.ratio": 1.0,
        "motor.rotor.J": J / 50.0,
        "motor.armature.k": 60.0,
        "motor.armature.R": 20.0,
        "motor.armature.L": 0.3,
        "motor.limit.i": 10.0,
        "motor.limit.v": 800.0,
        "motor.speed_control.kp": 1.0,
        "motor.speed_control.ki": 5.0,
        "motor.current_control.kp": 90.0,
        "motor.current_control.ki": 6000.0,
        "motor.w_start": SPEED,
    }
    with CoSimulation(system(fmus, **light), {"motor.w_ref": SPEED}) as simulation:
        run = simulation.run(2.0, 0.004)
    exact = monolithic(joined(values=light), {"motor.w_ref": SPEED}, run["time"].values)
    assert error(run, exact, "motor.w") < 5e-4 * SPEED
    assert energy_residual(run, BOND)[1] < 1e-3


def test_going_on_and_branching(fmus):
    signals = {"motor.w_ref": 150.0}
    with CoSimulation(system(fmus), signals) as simulation:
        whole = simulation.run(0.04, 0.001)
    with CoSimulation(system(fmus), signals) as simulation:
        simulation.run(0.02, 0.001)
        simulation.save()
        first = simulation.run(0.04, 0.001)
        simulation.restore()
        simulation.signals = {"motor.w_ref": 100.0}
        other = simulation.run(0.04, 0.001)
        simulation.restore()
        simulation.signals = signals
        again = simulation.run(0.04, 0.001)
    np.testing.assert_allclose(first["motor.w"].values, whole["motor.w"].values[20:], rtol=1e-12)
    xr.testing.assert_identical(first, again)
    assert abs(float(other["motor.w"][-1] - first["motor.w"][-1])) > 1e-3


def test_a_failing_run_keeps_what_it_computed(fmus):
    signals = {"motor.w_ref": lambda t: 150.0 if t < 0.0105 else float("nan")}
    with CoSimulation(system(fmus), signals) as simulation:
        with pytest.raises(
            RunError, match=r"step at t = 0\.011 s .*motor: input w_ref = nan rad/s"
        ) as caught:
            simulation.run(0.05, 0.001)
    partial = caught.value.partial
    assert 10 <= len(partial["time"]) <= 12
    assert np.all(np.isfinite(partial["motor.w"].values))


def test_wrong_names_and_loops_are_named(fmus):
    with pytest.raises(InputError, match=r"machine.speed: no such input"):
        System(parts(fmus), wires=[("motor.w", "machine.speed")])
    with pytest.raises(InputError, match=r"motor.phi: no such input"):
        System(parts(fmus), wires=[("motor.w", "motor.phi")])
    with pytest.raises(
        InputError, match=r'gearbox.w: there is no component "gearbox"; there are machine, motor'
    ):
        System(parts(fmus), wires=[("gearbox.w", "machine.w")])
    # torque and acceleration exchanged directly: what the load port is there to avoid
    with pytest.raises(InputError, match=r"algebraic loop: .*machine.tau.*load port"):
        loop = [("motor.a", "machine.a"), ("machine.tau", "motor.load.tau_bias")]
        CoSimulation(System(parts(fmus), wires=loop))


def test_systems_that_contradict_themselves(fmus, tmp_path):
    with pytest.raises(InputError, match=r"machine\.w: is connected to motor\.w and to motor\.phi"):
        System(parts(fmus), wires=[("motor.w", "machine.w"), ("motor.phi", "machine.w")])
    with pytest.raises(InputError, match=r"machine\.w: is connected, it cannot have a signal"):
        CoSimulation(System(parts(fmus), wires=[("motor.w", "machine.w")]), {"machine.w": 3.0})
    with pytest.raises(InputError, match=r"motor\.w: no such parameter or input"):
        System(parts(fmus), start={"motor.w": 3.0})
    with pytest.raises(
        InputError, match=r"machine \(ChamberForces\): has no FMU yet; export the system first"
    ):
        CoSimulation(joined())
    with pytest.raises(InputError, match="no such FMU"):
        CoSimulation(System({"machine": component("ChamberForces", tmp_path / "none.fmu")}))
    (tmp_path / "bad.fmu").write_text("no archive")
    with pytest.raises(InputError, match="is no FMU"):
        CoSimulation(System({"machine": component("ChamberForces", tmp_path / "bad.fmu")}))
    with CoSimulation(system(fmus)) as simulation:
        for stop, step in ((-1.0, 0.001), (0.0, 0.001), (0.1, 0.0), (0.1, -0.001), (0.1, float("nan"))):
            with pytest.raises(InputError, match="must go forward"):
                simulation.run(stop, step)
        run = simulation.run(0.01, 0.003)
    assert run["time"].values[-1] == 0.01 and len(run["time"]) == 5


def test_profile():
    profile = Profile(1.0, ((1.0, 0.5, 3.0), (2.0, 1.0, 0.0)))
    np.testing.assert_allclose(
        profile(np.array([0.0, 1.0, 1.25, 1.5, 2.0, 2.5, 9.0])), [1, 1, 2, 3, 3, 1.5, 0]
    )
    assert profile(1.25) == 2.0 and profile.corners == [1.0, 1.5, 2.0, 3.0]
    with pytest.raises(ValueError, match=r"change at t = 1.2 s"):
        Profile(0.0, ((1.0, 0.5, 3.0), (1.2, 1.0, 0.0)))


# -- what is kept of a run


def kept(fmus, stop=0.03, **options):
    signals = {"motor.w_ref": 150.0, "machine.left.material_mass": Profile(30.0, ((0.01, 0.01, 60.0),))}
    with CoSimulation(system(fmus), signals) as simulation:
        return simulation.run(stop, 0.001, **options)


def test_each_nth_row_and_the_last_are_those_of_the_whole_run(fmus):
    whole = kept(fmus)
    some = kept(fmus, every=4)
    assert np.array_equal(some["time"], [*whole["time"][:-1:4], whole["time"][-1]])
    xr.testing.assert_identical(some, whole.sel(time=some["time"]))
    xr.testing.assert_identical(kept(fmus, every=1000), whole.isel(time=[0, -1]))
    with pytest.raises(InputError, match="every = 0: must be a whole number >= 1"):
        kept(fmus, every=0)


def test_chosen_variables_are_those_of_the_whole_run(fmus):
    names = ["motor.w", "machine.left.material_mass", "machine.tau"]
    xr.testing.assert_identical(kept(fmus, names=names), kept(fmus)[sorted(names)])
    for name in ("motor.rotor.J", "machine.phi", "motor.speed"):
        with pytest.raises(InputError, match=f"{name}: cannot be kept; must be an output or an input with"):
            kept(fmus, names=[name])


def test_a_guard_acts_in_rows_that_are_not_kept(fmus):
    whole = kept(fmus, guards={"motor.phi": 1.0})
    assert 2 < whole.sizes["time"] < 30 and abs(whole["motor.phi"][-1]) > 1.0 > abs(whole["motor.phi"][-2])
    some = kept(fmus, guards={"motor.phi": 1.0}, every=1000, names=["machine.tau"])
    xr.testing.assert_identical(some, whole[["machine.tau"]].isel(time=[0, -1]))


@pytest.mark.second
def test_a_file_has_what_memory_has(fmus, tmp_path, monkeypatch):
    """Several blocks of rows, a step that fails, and a run that goes on."""
    from chainunit.system import rows
    from chainunit.system.instance import Instance

    monkeypatch.setattr(rows, "BLOCK", 7)
    whole = kept(fmus)
    file = tmp_path / "run.nc"
    for options in ({}, {"every": 4}, {"names": ["motor.w"]}):
        with kept(fmus, file=file, **options) as written:
            xr.testing.assert_identical(written.load(), kept(fmus, **options))
    assert [p.name for p in tmp_path.iterdir()] == ["run.nc"]

    step = Instance.step

    def fails_late(self, time, h):
        if time > 0.0195:
            raise RunError("motor: it broke")
        step(self, time, h)

    monkeypatch.setattr(Instance, "step", fails_late)
    with pytest.raises(RunError, match="it broke") as failed:
        kept(fmus, file=file)
    with failed.value.partial as partial:
        xr.testing.assert_identical(partial.load(), whole.isel(time=slice(0, 21)))
    assert [p.name for p in tmp_path.iterdir()] == ["run.nc"]


@pytest.mark.slow
@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_memory_does_not_grow_with_a_run_that_is_written_to_a_file(tmp_path):
    """Measured by the allocations of Python: 48,000 steps of a motor against 24,000."""
    import tracemalloc

    motor = export_native(MODELS["DcMotor"], tmp_path / "motor.fmu")

    def peak(steps, **options):
        with CoSimulation(
            System({"motor": component("DcMotor", motor)}), {"motor.w_ref": 100.0}
        ) as simulation:
            tracemalloc.start()
            try:
                simulation.run(1e-3 * steps, 1e-3, **options).close()
                return tracemalloc.get_traced_memory()[1]
            finally:
                tracemalloc.stop()

    peak(100, file=tmp_path / "run.nc")
    short, long = (peak(steps, file=tmp_path / "run.nc") for steps in (24_000, 48_000))
    # xarray holds the time, as an index, and some objects; one more variable in memory would take 192 kB
    assert long - short < 24_000 * 2 * 8 + 32_000
    in_memory, tenth, choice = peak(24_000), peak(24_000, every=10), peak(24_000, names=["motor.w"])
    row = 8 * (len(kept_names(motor)) + 1)
    assert row > 5 * 2 * 8
    # each row once, not twice
    assert 24_000 * row < in_memory < 24_000 * row + long
    assert tenth < 2_400 * row + long and choice < 24_000 * 2 * 8 + long


def kept_names(file):
    from chainunit.system.instance import Fmu

    fmu = Fmu(file)
    fmu.close()
    return [*fmu.outputs(), "w_ref"]


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_unpacking_that_ends_early_leaves_no_folder(error, fmus, tmp_path, monkeypatch):
    """An interrupted run leaves no file behind, either."""

    def extract(file, unzipdir):
        (tmp_path / "was here").touch()
        raise error

    monkeypatch.setattr("fmpy.extract", extract)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with pytest.raises(KeyboardInterrupt if error is KeyboardInterrupt else InputError):
        Fmu(fmus["DcMotor"])
    assert [p.name for p in tmp_path.iterdir()] == ["was here"]


def test_a_process_that_closes_no_fmu_leaves_no_folder(fmus, tmp_path):
    script = "import sys; from chainunit.system.instance import Fmu; print(Fmu(sys.argv[1]).folder)"
    command = [sys.executable, "-c", script, str(fmus["DcMotor"])]
    ran = subprocess.run(
        command, capture_output=True, text=True, check=True, env=os.environ | {"TMPDIR": str(tmp_path)}
    )
    assert str(tmp_path) in ran.stdout and list(tmp_path.iterdir()) == []


def test_an_interrupt_of_which_nobody_asked_any_more_comes_at_the_end():
    with pytest.raises(KeyboardInterrupt), stoppable() as stopped:
        assert not stopped()
        signal.raise_signal(signal.SIGINT)
    with stoppable() as stopped:
        signal.raise_signal(signal.SIGINT)
        assert stopped()


def test_an_interrupt_after_the_last_step_keeps_the_rows(fmus):
    """It comes while the last row is told, behind the last question whether to stop."""

    def told(time):
        if time > 0.0399:
            signal.raise_signal(signal.SIGINT)

    with CoSimulation(system(fmus), {"motor.w_ref": RATIO * SPEED / 2.0}) as simulation:
        with pytest.raises(InterruptedRunError) as stopped:
            simulation.run(0.04, 0.004, told)
    assert len(stopped.value.partial["time"]) == 11


@pytest.mark.parametrize("name", ["DcMotor", "InductionMotor", "CardanDriveline"])
def test_a_load_of_negative_inertia_is_refused(name, fmus):
    """No machine has a negative inertia: the reflected inertia is a sum of squares."""
    with pytest.raises(RunError, match=r"load\.J = -0\.01 kg m2: must be >= 0 kg m2"):
        with CoSimulation(
            System({"unit": component(name, fmus[name])}), {"unit.load.J": -0.01}
        ) as simulation:
            simulation.run(0.01, 0.001)


def test_no_machine_shows_a_negative_inertia():
    rng = np.random.default_rng(4)
    phi = np.linspace(0.0, 2.0 * np.pi, 361)
    for _ in range(20):
        machine = random_machine(rng)
        bodies = [v.name for v in ChamberForces.parameter_layout.variables if v.unit in ("kg", "kg.m2")]
        for each in (machine, machine.replace(dict.fromkeys(bodies, 0.0))):
            assert np.min(each.forces(phi * each.p.ratio, 3.0, 0.0).J) >= 0.0
