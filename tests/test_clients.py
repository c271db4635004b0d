"""Native FMUs in other importers. They are in the extra `dev`; without them these tests are skipped."""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import shutil
import subprocess
import sys
import sysconfig
import textwrap
import zipfile
from operator import attrgetter
from pathlib import Path

import fmpy
import numpy as np
import pytest
from systems import pair as pair_of

from chainunit.core.engines import MATH, numpy_
from chainunit.core.native.compilers import compiler
from chainunit.fmu.native.export import export
from chainunit.models import MODELS
from chainunit.system import CoSimulation, compiled
from chainunit.system.instance import Fmu, Instance

pytestmark = [pytest.mark.second, pytest.mark.skipif(compiler() is None, reason="no C compiler")]

# what runs alone: its start values and what is read. From rest at 0.4 rad the chain unit falls and swings
ALONE = {
    "ChainUnit": ({"phi_start": 0.4}, ["phi", "w", "a", "left.support.fy", "margin"]),
    # the crank turns by itself: inside a step phi runs along w
    "ChainUnitFlexible": (
        {"phi": 1.0, "w": 8.0},
        ["phi0", "tau", "J", "left.theta_1", "right.pull_8", "rocker.tau"],
    ),
    # a motor and its machine as one model
    "System": (
        {"motor.w_ref": 100.0, "machine.left.material_mass": 20.0, "machine.ratio": 20.0},
        ["motor.phi", "motor.w", "motor.a", "motor.armature.i", "machine.tau", "machine.left.support.fx"],
    ),
    "KnifeDrive": ({"phi": 1.0, "a": 2.0}, ["tau", "J", "blade.y", "blade.tilt", "d_pin.fx", "margin"]),
    # a machine that is held
    "LoadObserver": (
        {"phi": 20.0, "current": 0.3},
        ["speed", "left.material_mass", "imbalance.feed_threshold", "rocker.tau", "quiet.offset_offset"],
    ),
}

# a motor runs up at its current limit and turns the machine; the step is exact in binary, so that every client
# comes to the same times
STEP, STEPS = 2.0**-10, 256
PARAMETERS = {"motor.w_start": 100.0, "machine.ratio": 20.0}
INPUTS = {"motor.w_ref": 150.0}
CONNECTIONS = pair_of("ChamberForces", "DcMotor").connections
FROM_STATES = (  # what follows from the motor's states alone
    "motor.phi motor.w motor.armature.i motor.load_energy machine.tau_bias machine.J machine.kinetic_energy".split()
)
FROM_ACCELERATION = "motor.a motor.tau machine.tau machine.power".split()
MACHINES = {"ChamberForces": "left.support.fx", "KnifeDrive": "d_pin.fx"}  # and one of its reactions

LIBRARIES = Path(sys.prefix) / "lib"
SCRIPTS = os.pathsep.join([sysconfig.get_path("scripts"), os.environ.get("PATH", "")])

SIMULATE = """
    import json, sys
    import fmpy

    run = fmpy.simulate_fmu(**json.loads(sys.argv[1]))
    print("values", json.dumps({name: run[name].tolist() for name in run.dtype.names}))
"""


@pytest.fixture(scope="module", params=ALONE)
def alone(request, tmp_path_factory):
    """Single FMUs by version of FMI, and the variables that are read from them."""
    folder, (start, names) = tmp_path_factory.mktemp("clients"), ALONE[request.param]
    if request.param == "System":
        model = compiled(pair_of("ChamberForces", "DcMotor")).model
    else:
        model = MODELS[request.param]
    return {fmi: export(model, folder / f"{request.param}{fmi}.fmu", start, fmi=fmi) for fmi in (2, 3)}, names


@pytest.fixture(scope="module", params=MACHINES)
def kind(request):
    return request.param


@pytest.fixture(scope="module")
def outputs(kind):
    return [*FROM_STATES, *FROM_ACCELERATION, f"machine.{MACHINES[kind]}"]


@pytest.fixture(scope="module")
def pair(kind, tmp_path_factory):
    """Motor and machine, which meet at the load port: {fmi: {name: file}}."""
    folder = tmp_path_factory.mktemp("pair")
    models = {"motor": MODELS["DcMotor"], "machine": MODELS[kind]}
    return {
        fmi: {name: export(model, folder / f"{name}{fmi}.fmu", fmi=fmi) for name, model in models.items()}
        for fmi in (2, 3)
    }


@pytest.fixture(scope="module")
def master(kind, pair, outputs):
    """The pair under this package's master, every row consistent."""
    with CoSimulation(pair_of(kind, "DcMotor", pair[2], PARAMETERS), INPUTS) as simulation:
        run = simulation.run(STEPS * STEP, STEP)
    run = {name: run[name].values for name in outputs}
    assert np.ptp(run["motor.w"]) > 40.0 and np.ptp(run["machine.tau"]) > 1.0
    return run


@pytest.fixture(scope="module")
def jacobi(pair, outputs):
    """``jacobi(rounds)``: the pair by hand. All connected outputs are read, then written, then both FMUs step; before
    the first step so many times: port and motion come round in two, the acceleration under that port in three.
    `outputs` at the end, before and after the last exchange."""

    def run(rounds):
        with contextlib.ExitStack() as stack:
            instances = {}
            for name, file in pair[2].items():
                fmu = stack.enter_context(contextlib.closing(Fmu(file)))
                instances[name] = stack.enter_context(contextlib.closing(Instance(fmu, name)))

            def get(full):
                return instances[full.partition(".")[0]].get([full.partition(".")[2]])[0]

            def exchange():
                for target, value in [(target, get(source)) for source, target in CONNECTIONS]:
                    instances[target.partition(".")[0]].set([target.partition(".")[2]], [value])

            start = PARAMETERS | INPUTS
            for name, instance in instances.items():
                own = {full.partition(".")[2]: v for full, v in start.items() if full.startswith(name)}
                instance.initialize(own, 0.0)
            for _ in range(rounds):
                exchange()
            for instance in instances.values():
                instance.finish_initialization()
            for k in range(STEPS):
                if k:
                    exchange()
                for instance in instances.values():
                    instance.step(k * STEP, STEP)
            before = [get(full) for full in outputs]
            exchange()
            return before, [get(full) for full in outputs]

    return run


def here(package):
    return pytest.mark.skipif(importlib.util.find_spec(package) is None, reason=f"{package} is not installed")


def values(script, *arguments, **environment):
    """The JSON that a script prints after the word "values"."""
    command = [sys.executable, "-c", textwrap.dedent(script), *map(str, arguments)]
    process = subprocess.run(command, capture_output=True, text=True, env=os.environ | environment)
    assert process.returncode == 0, (process.stdout + process.stderr)[-2000:]
    (line,) = [line for line in process.stdout.splitlines() if line.startswith("values ")]
    return json.loads(line.removeprefix("values "))


def simulated(file, names, **more):
    """Columns by name of a run in fmpy, in a process of its own."""
    wanted = {"filename": str(file), "fmi_type": "CoSimulation", "output": names, "stop_time": STEPS * STEP}
    steps = {"step_size": STEP, "output_interval": STEP}
    run = values(SIMULATE, json.dumps(wanted | steps | more))
    return {name: np.array(column) for name, column in run.items()}


def by_fmpy(file, names):
    """The values of the variables after 0.5 s."""
    run = fmpy.simulate_fmu(
        str(file), fmi_type="CoSimulation", stop_time=0.5, output_interval=1e-3, output=names
    )
    assert "w" not in names or abs(run["w"][-1]) > 0.01
    return [run[name][-1] for name in names]


@pytest.mark.stages(second=3)
@here("libcosimpy")
def test_libcosim(alone):
    files, names = alone
    script = """
        import json, sys
        from libcosimpy.CosimExecution import CosimExecution
        from libcosimpy.CosimObserver import CosimObserver
        from libcosimpy.CosimSlave import CosimLocalSlave

        execution = CosimExecution.from_step_size(step_size=1_000_000)
        index = execution.add_local_slave(CosimLocalSlave(fmu_path=sys.argv[1], instance_name="unit"))
        observer = CosimObserver.create_last_value()
        execution.add_observer(observer=observer)
        assert execution.step(step_count=500)
        variables = {v.name.decode(): v.reference for v in execution.slave_variables(slave_index=index)}
        wanted = [variables[n] for n in sys.argv[2:]]
        print("values", json.dumps(list(observer.last_real_values(slave_index=index, variable_references=wanted))))
    """
    assert values(script, files[2], *names) == pytest.approx(by_fmpy(files[2], names), rel=1e-12)


def ecos(test):
    tbb = pytest.mark.skipif(not (LIBRARIES / "libtbb.so.12").is_file(), reason="tbb is not installed")
    return here("ecospy")(tbb(pytest.mark.parametrize("fmi", (2, 3))(test)))


def in_ecos(script, *arguments):
    """`values` of a script that finds TBB, and leaves past its exit handlers, which crash now and then."""
    path = os.pathsep.join(filter(None, [str(LIBRARIES), os.environ.get("LD_LIBRARY_PATH")]))
    leave = "\nimport os\nsys.stdout.flush()\nos._exit(0)\n"
    return values(textwrap.dedent(script) + leave, *arguments, LD_LIBRARY_PATH=path)


@pytest.mark.stages(second=3)
@ecos
def test_ecos(alone, fmi):
    files, names = alone
    script = """
        import json, sys
        from ecospy import EcosSimulation, EcosSimulationStructure

        with EcosSimulationStructure() as structure:
            structure.add_model("unit", sys.argv[1])
            with EcosSimulation(structure=structure, step_size=1e-3) as simulation:
                assert simulation.init()
                simulation.step(500)
                print("values", json.dumps([simulation.get_real("unit::" + name) for name in sys.argv[2:]]))
    """
    assert in_ecos(script, files[fmi], *names) == pytest.approx(by_fmpy(files[fmi], names), rel=1e-12)


@pytest.mark.stages(second=2)
@ecos
def test_ecos_connects(pair, jacobi, outputs, fmi):
    """Its algorithm with a fixed step is Jacobi's."""
    script = """
        import json, sys
        from ecospy import EcosSimulation, EcosSimulationStructure

        files, connections, start, step, steps, names = map(json.loads, sys.argv[1:])
        full = lambda name: name.replace(".", "::", 1)
        with EcosSimulationStructure() as structure:
            for name, file in files.items():
                structure.add_model(name, file)
            for source, target in connections:
                structure.make_real_connection(full(source), full(target))
            structure.add_parameter_set("start", {full(name): value for name, value in start.items()})
            with EcosSimulation(structure=structure, step_size=step) as simulation:
                assert simulation.init(parameter_set="start")
                simulation.step(steps)
                print("values", json.dumps([simulation.get_real(full(name)) for name in names]))
    """
    files = {name: str(file) for name, file in pair[fmi].items()}
    inputs = (files, CONNECTIONS, PARAMETERS | INPUTS, STEP, STEPS, outputs)
    assert in_ecos(script, *map(json.dumps, inputs)) == pytest.approx(jacobi(2)[1], rel=1e-12)


@pytest.mark.stages(second=3)
@here("fmu_manipulation_toolbox")
@pytest.mark.parametrize("fmi", (2, 3))
def test_fmu_manipulation_toolbox(alone, fmi, tmp_path):
    files, _ = alone
    command = [
        sys.executable,
        "-m",
        "fmu_manipulation_toolbox.cli.fmutool",
        "-input",
        str(files[fmi]),
        "-check",
    ]
    process = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    output = process.stdout + process.stderr
    assert (
        process.returncode == 0 and "No semantic error" in output and f"compliant with FMI-{fmi}.0" in output
    ), output


def fmucontainer(files, outputs, fmi, sequential, folder):
    """The pair in one FMU by fmucontainer, which fixes the parameters and takes the inputs."""
    for file in files.values():
        shutil.copy(file, folder)

    def split(full):
        instance, _, variable = full.partition(".")
        return [files[instance].name, variable]

    description = {
        "name": "container.fmu",
        "step_size": STEP,
        "sequential": sequential,
        "auto_link": False,
        "auto_input": False,
        "auto_output": False,
        "fmu": [file.name for file in files.values()],
        "link": [[*split(source), *split(target)] for source, target in CONNECTIONS],
        "start": [[*split(full), str(value)] for full, value in PARAMETERS.items()],
        "input": [[full, *split(full)] for full in INPUTS],
        "output": [[*split(full), full] for full in outputs],
    }
    (folder / "container.json").write_text(json.dumps(description), encoding="utf-8")
    command = [
        sys.executable,
        "-m",
        "fmu_manipulation_toolbox.cli.fmucontainer",
        "-fmu-directory",
        str(folder),
    ]
    command += ["-container", "container.json", "-fmi", str(fmi)]
    process = subprocess.run(command, capture_output=True, text=True)
    assert process.returncode == 0, process.stdout + process.stderr
    return folder / "container.fmu"


@pytest.mark.stages(second=2)
@here("fmu_manipulation_toolbox")
@pytest.mark.parametrize("fmi", (2, 3))
def test_fmucontainer_parallel(pair, jacobi, outputs, fmi, tmp_path):
    """Jacobi's exchange; what the container shows is from before the exchange."""
    run = simulated(fmucontainer(pair[fmi], outputs, fmi, False, tmp_path), outputs, start_values=INPUTS)
    assert [run[name][-1] for name in outputs] == pytest.approx(jacobi(3)[0], rel=1e-12)


@pytest.mark.stages(second=2)
@here("fmu_manipulation_toolbox")
@pytest.mark.parametrize("fmi", (2, 3))
def test_fmucontainer_sequential(kind, pair, master, outputs, fmi, tmp_path):
    """Gauss-Seidel, the motor first: the machine takes the motion of the end of a step for that of its begin, and is
    one step ahead. The load port says to which point it belongs, so that the motor's run is that of this package's
    master to second order."""
    run = simulated(fmucontainer(pair[fmi], outputs, fmi, True, tmp_path), outputs, start_values=INPUTS)
    for name in ("motor.phi", "motor.w", "motor.armature.i", "motor.load_energy"):
        most = 1e-5 * np.max(np.abs(master[name]))
        np.testing.assert_allclose(run[name], master[name], rtol=0.0, atol=most, err_msg=name)
    phi, w, a = (run[f"motor.{x}"][1:] for x in ("phi", "w", "a"))
    motion = {"phi": phi + STEP * (w + 0.5 * STEP * a), "w": w + STEP * a, "a": a}
    model = MODELS[kind]
    p = model.parameter_layout.from_names({"ratio": PARAMETERS["machine.ratio"]})
    (want, _) = model.evaluate(numpy_(), model.with_derived(MATH, p), model.input_layout.from_names(motion))
    for name in ("tau_bias", "J", "kinetic_energy", "tau", "power", MACHINES[kind]):
        wanted = attrgetter(name)(want)
        np.testing.assert_allclose(run[f"machine.{name}"][1:], wanted, rtol=1e-9, atol=1e-9, err_msg=name)


@here("fmpy.container_fmu")
@pytest.mark.parametrize("fmi", (2, 3))
def test_fmpy_container(pair, master, outputs, fmi, tmp_path):
    """This container makes its connections one after the other: the motor's angle and speed, then the port, then
    the acceleration, as this package's master does. Every row is the master's."""
    from fmpy.container_fmu.cli import create_container_fmu
    from fmpy.container_fmu.config import Component, Configuration, Connection
    from fmpy.model_description import CoSimulation as Interface
    from fmpy.model_description import DefaultExperiment, ModelDescription, ModelVariable, Unknown

    parts = {
        name: Component(name, file, fmpy.read_model_description(file)) for name, file in pair[fmi].items()
    }
    variables = {
        f"{n}.{v.name}": v for n, part in parts.items() for v in part.modelDescription.modelVariables
    }
    for variable in variables.values():
        variable.type = "Float64"  # in FMI 2 it is Real, which the container cannot read in a connection

    def connection(pairs):
        (source,), (target,) = (
            {full.partition(".")[0] for full in side} for side in zip(*pairs, strict=True)
        )
        ends = ([variables[full] for full in side] for side in zip(*pairs, strict=True))
        return Connection(parts[source], next(ends), parts[target], next(ends))

    def shown(full, causality, variability, **more):
        kind = "Real" if fmi == 2 else "Float64"
        return ModelVariable(name=full, type=kind, causality=causality, variability=variability, **more)

    mappings = {
        **{shown(n, "parameter", "fixed", start=str(v)): n for n, v in PARAMETERS.items()},
        **{shown(n, "input", "continuous", start="0.0"): n for n in INPUTS},
        **{shown(n, "output", "continuous"): n for n in outputs},
    }
    unknowns = [Unknown(variable=variable) for variable in mappings if variable.causality == "output"]
    description = ModelDescription(
        fmiVersion=f"{fmi}.0",
        modelName="container",
        instantiationToken="{container}",
        coSimulation=Interface(fixedInternalStepSize=STEP, canHandleVariableCommunicationStepSize=True),
        defaultExperiment=DefaultExperiment(stepSize=str(STEP)),
        modelVariables=[shown("time", "independent", "continuous"), *mappings],
        outputs=unknowns,
        initialUnknowns=unknowns,
    )
    order = [CONNECTIONS[:2], CONNECTIONS[3:], CONNECTIONS[2:3]]
    mapped = {variable: [(parts[n.partition(".")[0]], variables[n])] for variable, n in mappings.items()}
    configuration = Configuration(
        False, description, list(parts.values()), [connection(pairs) for pairs in order], mapped
    )
    (tmp_path / "content").mkdir()
    create_container_fmu(configuration, tmp_path / "content", tmp_path / "container.fmu")
    run = simulated(tmp_path / "container.fmu", outputs, start_values=INPUTS)
    for name in outputs:
        np.testing.assert_allclose(run[name], master[name], rtol=1e-12, err_msg=name)


@pytest.mark.stages(second=1)
@pytest.mark.skipif(shutil.which("cmake", path=SCRIPTS) is None, reason="cmake is not installed")
@pytest.mark.parametrize("fmi", (2, 3))
def test_fmpy_compile(kind, pair, fmi, tmp_path):
    """The sources alone make the same FMU, though cmake hides no names: our `step` must not meet the C library's."""
    if kind != "ChamberForces":
        pytest.skip("the motor is the same")
    rebuilt = tmp_path / "DcMotor.fmu"
    with zipfile.ZipFile(pair[fmi]["motor"]) as original, zipfile.ZipFile(rebuilt, "w") as sources:
        for name in original.namelist():
            if not name.startswith("binaries/"):
                sources.writestr(name, original.read(name))
    command = [sys.executable, "-m", "fmpy", "compile", str(rebuilt)]
    environment = os.environ | {"PATH": SCRIPTS}
    process = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert process.returncode == 0, process.stdout + process.stderr
    names = "phi w armature.i armature.T load_energy a tau v supply_power heat".split()
    start = {"start_values": {"w_ref": 100.0, "load.tau_bias": 1.0, "load.J": 0.002}}
    one, two = (simulated(file, names, **start) for file in (pair[fmi]["motor"], rebuilt))
    assert np.ptp(one["w"]) > 40.0
    for name in names:
        np.testing.assert_allclose(two[name], one[name], rtol=1e-12, err_msg=name)
