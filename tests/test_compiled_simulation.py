"""A compiled system runs as its co-simulation does: rows, branches, guards, failures."""

from __future__ import annotations

import re

import numpy as np
import pytest
from systems import pair

from chainunit import InputError, RunError
from chainunit.core.native.compilers import compiler
from chainunit.system import CompiledSimulation, CoSimulation, Jump, Profile, export, monolithic, run_together

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")
SPEED = "motor.w_ref"
FORCE = "machine.left.processing_force"


@pytest.fixture(scope="module")
def system():
    return pair("ChamberForces", "DcMotor", values={"machine.ratio": 50.0})


@pytest.fixture(scope="module")
def exported(system, tmp_path_factory):
    """The same system as separate FMUs."""
    return export(system, tmp_path_factory.mktemp("fmus"))[0]


def signals(force=1000.0):
    ramp = Profile(0.0, ((0.0, 0.4, 150.0),))
    return {SPEED: ramp, FORCE: Profile(0.0, ((0.5, 0.02, force), (0.6, 0.02, 0.0)))}


def test_its_run_is_the_monolithic_solution_with_all_names(system, exported):
    with CompiledSimulation(system, signals()) as simulation:
        run = simulation.run(0.7, 1e-3)
        assert simulation.time == 0.7
    reference = monolithic(system, signals(), run["time"].values)
    assert set(map(str, run.data_vars)) == {*map(str, reference.data_vars), SPEED, FORCE}
    for name, row in reference.items():
        peak = float(np.max(np.abs(row)))
        assert float(np.max(np.abs(run[name] - row))) <= 1e-6 * peak, name
        assert run[name].attrs["units"] == row.attrs["units"]
    np.testing.assert_allclose(run[FORCE], signals()[FORCE](run["time"].values))
    # the separate FMUs have the rows of the same instants, and every name but those of the slopes
    with CoSimulation(exported, signals()) as reference:
        rows = reference.run(0.7, 1e-3)
    np.testing.assert_array_equal(rows["time"], run["time"])
    missing = {str(name) for name in rows.data_vars} - {str(name) for name in run.data_vars}
    assert missing == {"machine.tau_bias_dphi", "machine.tau_bias_dw"}


def test_branches_go_on_from_the_saved_state(system):
    with CompiledSimulation(system, signals()) as simulation:
        first = simulation.run(0.45, 1e-3)
        assert simulation.save() == 0.45
        hard = simulation.run(0.7, 1e-3)
        simulation.restore()
        simulation.signals = signals(0.0)
        soft = simulation.run(0.7, 1e-3, names=["motor.tau"])
    assert list(soft.data_vars) == ["motor.tau"]
    assert float(first["motor.w"][-1]) == float(hard["motor.w"][0])
    whole = CompiledSimulation(system, signals(0.0)).run(0.7, 1e-3)
    np.testing.assert_allclose(soft["motor.tau"], whole["motor.tau"][450:], atol=1e-6)
    assert float(np.max(np.abs(hard["motor.tau"] - soft["motor.tau"]))) > 0.1


def test_a_guard_and_every_keep_the_right_rows(system):
    with CompiledSimulation(system, signals()) as simulation:
        run = simulation.run(0.7, 1e-3)
    limit = 0.8 * float(np.max(np.abs(run["motor.tau"])))
    beyond = int(np.flatnonzero(np.abs(run["motor.tau"]) > limit)[0])
    with CompiledSimulation(system, signals()) as simulation:
        ended = simulation.run(0.7, 1e-3, guards={"motor.tau": limit}, every=7)
        assert simulation.time == float(run["time"][beyond])
    wanted = sorted({*range(0, beyond, 7), beyond})
    np.testing.assert_array_equal(ended["time"], run["time"][wanted])


def test_runs_side_by_side_are_those_of_each_by_itself():
    """They differ in parameters, states at the start, signals, and end; a guard ends one of them alone."""

    def simulations():
        for angle, force in ((0.0, 1000.0), (30.0, 0.0), (75.0, 400.0)):
            own = {"motor.phi_start": angle, "machine.ratio": 50.0 + angle}
            yield CompiledSimulation(pair("ChamberForces", "DcMotor", values=own), signals(force))

    stops = [0.7, 0.55, 0.62]
    free = [each.run(stop, 1e-3) for each, stop in zip(simulations(), stops, strict=True)]
    peaks = sorted(float(np.max(np.abs(run["motor.tau"]))) for run in free)
    limit = {"motor.tau": 0.5 * (peaks[1] + peaks[2])}
    alone = [each.run(stop, 1e-3, guards=limit) for each, stop in zip(simulations(), stops, strict=True)]
    together = list(simulations())
    runs = run_together(together, stops, 1e-3, guards=limit)
    ends = [float(run["time"][-1]) for run in runs]
    assert (
        ends == [each.time for each in together]
        and sum(e == s for e, s in zip(ends, stops, strict=True)) == 2
    )
    for run, reference in zip(runs, alone, strict=True):
        np.testing.assert_array_equal(run["time"], reference["time"])
        for name, row in reference.items():
            # compiled code that takes more arguments may round in another order
            np.testing.assert_allclose(run[name], row, rtol=1e-7, atol=1e-7 * float(np.max(np.abs(row))))
            assert run[name].attrs == row.attrs
    # each goes on from its own end
    further = run_together(together, [end + 0.1 for end in ends], 1e-3, names=["motor.tau"])
    assert [float(run["time"][0]) for run in further] == ends
    assert run_together([], [], 1e-3) == []


def test_runs_side_by_side_that_do_not_belong_together_are_refused(system):
    other = pair("ChamberForces", "InductionMotor", values={"machine.ratio": 50.0})
    strangers = [CompiledSimulation(system, signals()), CompiledSimulation(other, {})]
    with pytest.raises(InputError, match="must have one model"):
        run_together(strangers, [0.1, 0.1], 1e-3)
    with pytest.raises(InputError, match="must go forward"):
        run_together([CompiledSimulation(system, signals())], [0.0], 1e-3)


def test_the_names_to_keep_are_those_of_a_co_simulation(system, exported):
    """From an iterator, too; a guard that is not named is not kept."""
    runs = []
    for kind, of in ((CoSimulation, exported), (CompiledSimulation, system)):
        with kind(of, signals()) as simulation:
            names = iter([FORCE, "motor.tau", "machine.tau"])
            runs.append(simulation.run(0.01, 1e-3, names=names, guards={"motor.w": 1e3}))
            for full in ("motor.tua", "machine.right.material_mass"):
                with pytest.raises(
                    InputError, match=rf"^{re.escape(full)}: cannot be kept; must be an output"
                ):
                    simulation.run(0.02, 1e-3, names=["motor.tau", full])
    assert all(set(run.data_vars) == {FORCE, "motor.tau", "machine.tau"} for run in runs)
    np.testing.assert_array_equal(runs[0][FORCE], runs[1][FORCE])


@pytest.mark.parametrize("every", [0, -2, 1.5, float("nan"), float("inf")])
def test_every_is_a_whole_number(system, exported, every):
    for kind, of in ((CoSimulation, exported), (CompiledSimulation, system)):
        with kind(of, signals()) as simulation:
            with pytest.raises(InputError, match=r"^every = .*: must be a whole number >= 1$"):
                simulation.run(0.01, 1e-3, every=every)


def test_faults_are_told(system):
    with pytest.raises(InputError, match=r"motor\.w_reff: no such input"):
        CompiledSimulation(system, {"motor.w_reff": 1.0})
    with pytest.raises(InputError, match="takes numbers and profiles"):
        CompiledSimulation(system, {SPEED: Jump(0.1, 0.0, 1.0)})
    with CompiledSimulation(system, signals()) as simulation:
        with pytest.raises(InputError, match="must go forward"):
            simulation.run(0.0, 1e-3)
        with pytest.raises(InputError, match=r"motor\.tua"):
            simulation.run(0.1, 1e-3, guards={"motor.tua": 1.0})
        simulation.signals = signals(1e300)
        with pytest.raises(RunError, match="left all bounds") as failure:
            simulation.run(0.7, 1e-3)
    assert 0.5 <= float(failure.value.partial["time"][-1]) < 0.7
    assert np.isfinite(failure.value.partial["motor.w"]).all()
