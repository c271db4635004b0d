"""SSP packages: schemas, connections, parameter sets, and runs in fmpy, libcosim and ecos beside the own master."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import subprocess
import sys
import textwrap
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from command import chainunit
from fmpy.ssp.ssd import read_ssd, read_ssv
from systems import component, pair

from chainunit import InputError, RunError
from chainunit.app import cli
from chainunit.capabilities.sizing import search as sizing
from chainunit.core.errors import WriteError
from chainunit.drives.catalogue import catalogue
from chainunit.models import MODELS
from chainunit.study import config
from chainunit.study.choice import choose
from chainunit.study.package import export_study, start_of
from chainunit.study.parts import example
from chainunit.system import CoSimulation, System, fmu_component, shaft_joints, ssp

pytestmark = pytest.mark.second

MINE = """
title = "Mine, with <marks>"
[run]
crank_speed = 2.4
[feed]
left = { material_mass = 45 }
[motor]
limit = { i = 3.9 }
"""
# what a user would write over in the parameter sets: fixed, tunable, an input
OTHERS = {
    "machine.ratio": 40.0,
    "motor.limit.i": 3.0,
    "motor.w_ref": 110.0,
    "machine.left.material_mass": 80.0,
}


def here(package):
    return pytest.mark.skipif(importlib.util.find_spec(package) is None, reason=f"{package} is not installed")


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """A package by the command line, in a folder whose name has spaces."""
    folder = tmp_path_factory.mktemp("ssp")
    (folder / "mine.toml").write_text(MINE)
    process = chainunit("export", "mine.toml", "-o", "out dir/mine.ssp", cwd=folder)
    assert (process.returncode, process.stderr) == (0, "")
    assert re.fullmatch(
        r"out dir/mine\.ssp: SSP 1\.0, machine \(ChamberForces\), motor \(DcMotor\), 10 connections; "
        r"FMI 2\.0.*\n(Rocker.*\n)?",
        process.stdout,
    )
    return folder / "out dir" / "mine.ssp"


def test_schemas(package):
    """read_ssd and read_ssv validate by the schemas of SSP 1.0."""
    assert read_ssd(str(package)).version == "1.0"
    with zipfile.ZipFile(package) as archive:
        sets = [name for name in archive.namelist() if name.endswith(".ssv")]
    assert sets == ["resources/machine.ssv", "resources/motor.ssv"]
    for name in sets:
        assert read_ssv(str(package), name).name == ssp.PARAMETER_SET


@pytest.mark.second
@here("pyssp_standard")
def test_pyssp_finds_nothing(package):
    from pyssp_standard.ssp import SSP

    with SSP(package, mode="r") as opened:
        with opened.system_structure as ssd:
            ssd.__check_compliance__()
            assert ssd.check_connections(connector_not_in_system=True) == []
            parameters = {
                f"{e.name}.{c.name}"
                for e in ssd.system.elements
                for c in e.connectors
                if c.kind == "parameter"
            }
            entries = ssd.check_connections(unconnected_inputs=True)
            assert len(ssd.connections()) == 10
        values = set()
        for ssv in opened.ssv:
            ssv.__check_compliance__()
            values |= {f"{ssv.file_path.stem}.{p['name']}" for p in ssv.parameters}
    # an input without a source has its value in a parameter set, and is no connector
    assert {line.rsplit(" ", 1)[1] for line in entries} == parameters < values
    loads = {f"machine.{s}.{x}" for s in ("left", "right") for x in ("material_mass", "processing_force")}
    assert values - parameters >= {"motor.w_ref", *loads}


def connections(file):
    return [
        (f"{c.startElement}.{c.startConnector}", f"{c.endElement}.{c.endConnector}")
        for c in read_ssd(str(file)).system.connections
    ]


def test_the_connections_are_those_of_the_terminals_in_the_fmus(package, tmp_path):
    """SSP 2.0 has no terminals of its own: a tool finds them in the FMUs of the package. Each connection is of two
    members of one name, in terminals of one kind, and these are connected whole."""
    with zipfile.ZipFile(package) as archive:
        archive.extractall(tmp_path)
    members = {}
    for name in ("machine", "motor"):
        (file,) = (c.source for c in read_ssd(str(package)).system.elements if c.name == name)
        with zipfile.ZipFile(tmp_path / file) as fmu:
            root = ElementTree.fromstring(fmu.read("terminalsAndIcons/terminalsAndIcons.xml"))
        for terminal in root.iter("Terminal"):
            own = {f"{name}.{m.get('variableName')}": m.get("memberName") for m in terminal}
            members.setdefault(terminal.get("terminalKind"), []).append(own)
    found = connections(package)
    sides = {kind: sides for kind, sides in members.items() if len(sides) == 2}
    assert {*sides} == {
        "org.chainunit.flange", "org.chainunit.load", "Modelica.Mechanics.Rotational.Interfaces.Flange_a"
    }  # fmt: skip
    of_terminals = set()
    for kind, (one, other) in sides.items():
        theirs = {member: full for full, member in other.items()}
        ends = {frozenset((full, theirs[member])) for full, member in one.items() if member in theirs}
        # the torque of a shaft is given on both sides
        both = {end for end in ends if not kind.endswith("load") and all(e.endswith(".tau") for e in end)}
        of_terminals |= ends - both
    assert {frozenset(c) for c in found} == of_terminals and len(found) == len(of_terminals)


def test_connectors_are_the_fmus_variables(package, tmp_path):
    """Names, kinds and units, unit definitions included, are those of the FMU's own description. Inputs without
    connection are no connectors."""
    assert connections(package) == pair("ChamberForces", "DcMotor").connections
    targets = {target for _, target in connections(package)}
    with zipfile.ZipFile(package) as archive:
        archive.extractall(tmp_path)
    root = ElementTree.parse(tmp_path / "SystemStructure.ssd").getroot()
    ns = {
        p: f"http://ssp-standard.org/SSP1/SystemStructure{n}"
        for p, n in (("ssd", "Description"), ("ssc", "Common"))
    }
    units = {
        u.get("name"): u.find("ssc:BaseUnit", ns).attrib for u in root.iterfind("ssd:Units/ssc:Unit", ns)
    }
    for node in root.iterfind("ssd:System/ssd:Elements/ssd:Component", ns):
        described = fmpy.read_model_description(str(tmp_path / node.get("source")))
        connectors = {
            c.get("name"): (c.get("kind"), c[0].tag.partition("}")[2], c[0].get("unit"))
            for c in node.iterfind("ssd:Connectors/ssd:Connector", ns)
        }
        causal = {
            v.name: (v.causality, v.type, v.unit)
            for v in described.modelVariables
            if v.causality in ("parameter", "output") or f"{node.get('name')}.{v.name}" in targets
        }
        assert connectors == causal
        for unit in described.unitDefinitions:
            if unit.name in units:
                powers = {
                    b: getattr(unit.baseUnit, b) for b in ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
                }
                assert {b: int(n) for b, n in units[unit.name].items()} == {
                    b: n for b, n in powers.items() if n
                }


def test_parameter_sets_and_fmus_hold_the_studys_values(package, tmp_path):
    loaded = config.parse(MINE)
    drive = choose(loaded, tmp_path).drive
    motor = drive.parameters
    assert motor.limit.i == 3.9 and motor.speed_control.kp != loaded.motor.parameters.speed_control.kp
    start = {
        "machine": start_of(drive, loaded.operation, MODELS["ChamberForces"]),
        "motor": MODELS["DcMotor"].parameter_layout.by_name(motor) | {"w_ref": 2.4 * 50.0},
    }
    with zipfile.ZipFile(package) as archive:
        archive.extractall(tmp_path)
    for name, model in (("machine", "ChamberForces"), ("motor", "DcMotor")):
        values = {p.name: float(p.value) for p in read_ssv(str(package), f"resources/{name}.ssv").parameters}
        reference = start[name]
        assert {n: reference.get(n, v) for n, v in values.items()} == values
        described = fmpy.read_model_description(str(tmp_path / "resources" / f"{model}.fmu"))
        burnt = {v.name: float(v.start) for v in described.modelVariables if v.name in values}
        assert burnt == values


# -- runs

LIBCOSIM = """
    import json, sys
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver

    file, stop, step, names = sys.argv[1], float(sys.argv[2]), float(sys.argv[3]), sys.argv[4:]
    # without a step of its own it must find the one in the package
    execution = CosimExecution.from_ssp_file(file, **({"step_size": step * 1e9} if step else {}))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer=observer)
    places = []
    slaves = {info.name.decode(): info.index for info in execution.slave_infos()}
    for instance, _, variable in (name.partition(".") for name in names):
        variables = {v.name.decode(): v.reference for v in execution.slave_variables(slave_index=slaves[instance])}
        get = observer.last_integer_values if variable == "alarm" else observer.last_real_values
        places.append((get, slaves[instance], variables[variable]))
    rows = []
    for _ in range(round(stop / (step or 1e-3))):
        assert execution.step(step_count=1)
        rows.append([list(get(slave_index=i, variable_references=[v]))[0] for get, i, v in places])
    print("values", json.dumps(rows))
"""
ECOS = """
    import json, os, sys
    from ecospy import EcosSimulation

    file, stop, step, names = sys.argv[1], float(sys.argv[2]), float(sys.argv[3]), sys.argv[4:]
    get = lambda name: simulation.get_integer if name.endswith(".alarm") else simulation.get_real
    with EcosSimulation(step_size=step or 1e-3, ssp_path=file) as simulation:
        assert simulation.init(parameter_set="start" if step else None)
        rows = []
        for _ in range(round(stop / (step or 1e-3))):
            simulation.step()
            rows.append([get(name)(name.replace(".", "::", 1)) for name in names])
        simulation.terminate()
    print("values", json.dumps(rows), flush=True)
    # one process in some hundred crashes in the exit handlers of TBB, which ecos runs on, with whatever FMUs
    os._exit(0)
"""
# fmpy applies a set of its own alone, with the names of the whole system
FMPY = """
    import json, sys, zipfile
    from fmpy.ssp.simulation import simulate_ssp
    from fmpy.ssp.ssd import ParameterSet, read_ssv

    file, stop, step, names = sys.argv[1], float(sys.argv[2]), float(sys.argv[3]), sys.argv[4:]
    every = ParameterSet()
    for member in zipfile.ZipFile(file).namelist():
        if member.endswith(".ssv"):
            instance = member.removeprefix("resources/").removesuffix(".ssv")
            for parameter in read_ssv(file, member).parameters:
                parameter.name = f"{instance}.{parameter.name}"
                every.parameters.append(parameter)
    step = step or 1e-3
    # it adds its steps up: half a step less, or rounding makes one more
    result = simulate_ssp(file, stop_time=stop - step / 2, step_size=step, parameter_set=every)
    print("values", json.dumps([[float(row[name]) for name in names] for row in result]))
"""
TOOLS = [
    pytest.param(LIBCOSIM, id="libcosim", marks=[here("libcosimpy"), pytest.mark.slow]),
    pytest.param(ECOS, id="ecos", marks=[here("ecospy"), pytest.mark.slow]),
]


ALL_TOOLS = [*TOOLS, pytest.param(FMPY, id="fmpy", marks=pytest.mark.second)]


def run(tool, file, names, stop, step=0.0):
    """`names` in a process of its own, shape (steps, names); without a step, with what the package itself gives."""
    command = [sys.executable, "-c", textwrap.dedent(tool), str(file), str(stop), str(step), *names]
    # ecos needs libtbb, which pip puts there
    libraries = f"{sys.prefix}/lib:{os.environ.get('LD_LIBRARY_PATH', '')}".rstrip(":")
    environment = os.environ | {"LD_LIBRARY_PATH": libraries}
    process = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert process.returncode == 0, process.stdout[-1000:] + process.stderr[-1000:]
    (line,) = [line for line in process.stdout.splitlines() if line.startswith("values ")]
    return np.array(json.loads(line.removeprefix("values ")))


def own(file, folder, names, stop, step):
    """The same package in the own master: its FMUs, its parameter sets, its connections."""
    with zipfile.ZipFile(file) as archive:
        archive.extractall(folder)
    system = read_ssd(str(file)).system
    start = {
        f"{e.name}.{p.name}": float(p.value)
        for e in system.elements
        for p in e.parameterBindings[0].parameterValues[0].parameters
    }
    components = {e.name: fmu_component(folder / e.source) for e in system.elements}
    with CoSimulation(System(components, wires=connections(file), start=start)) as simulation:
        out = simulation.run(stop, step)
    return np.stack([out[name].values[1:] for name in names], axis=1)


def rewritten(package, file):
    """The package with the values OTHERS in its parameter sets, and nothing else changed."""
    left = dict(OTHERS)
    with zipfile.ZipFile(package) as values, zipfile.ZipFile(file, "w") as variant:
        for name in values.namelist():
            content = values.read(name)
            for full in [n for n in left if name == f"resources/{n.partition('.')[0]}.ssv"]:
                pattern = rf'(name="{re.escape(full.partition(".")[2])}"[^>]*>\s*<ssv:Real value=")[^"]*'
                text, n = re.subn(pattern, rf"\g<1>{left.pop(full)}", content.decode())
                assert n == 1, full
                content = text.encode()
            variant.writestr(name, content)
    assert not left
    return file


@pytest.mark.parametrize("tool", ALL_TOOLS)
def test_runs_near_the_own_master_with_the_values_of_the_parameter_sets(tool, package, tmp_path):
    """Start-up from rest. The tools exchange once a step, and the machine follows its speed and acceleration inside
    it, so that the motor sees a load port of the end of the step: second order, 1e-5 of the largest speed at 1 ms.
    fmpy sets all connected inputs to 0 for the first step, so that the motor speeds up without load: 8e-4."""
    other = rewritten(package, tmp_path / "other.ssp")
    names = ["motor.w", "motor.phi"]
    errors = []
    for step in (1e-3, 5e-4):
        got = run(tool, other, names, 1.0, step)
        reference = own(other, tmp_path / "out", names, 1.0, step)
        errors.append(np.max(np.abs(got - reference), axis=0) / np.max(np.abs(reference), axis=0))
    most, ratio = (1e-3, 2.5) if tool is FMPY else (1e-5, 3.0)
    assert np.all(errors[0] < most), errors
    assert np.all(errors[1] < errors[0] / ratio), errors
    before = own(package, tmp_path / "as it was", names, 1.0, 1e-3)
    assert abs(before[-1, 0] - got[-1, 0]) > 5.0


@pytest.mark.parametrize("tool", TOOLS)
def test_runs_as_it_is(tool, package, tmp_path):
    """libcosim with the package's step; ecos with the FMUs' start values alone. Inputs need no connectors in them."""
    names = ["motor.w", "machine.ratio", "machine.left.material_mass", "motor.w_ref", "motor.limit.i"]
    got = run(tool, package, names, 0.5)
    reference = own(package, tmp_path, names[:1], 0.5, 1e-3)
    assert np.max(np.abs(got[:, :1] - reference)) < 1e-5 * np.max(np.abs(reference))
    np.testing.assert_array_equal(got[-1, 1:], [50.0, 45.0, 120.0, 3.9])


SIGNALS = {"phi": "phi", "w": "w", "armature.i": "current"}
"""Inputs of the observer by the outputs of the motor that they take."""

# a second motor that follows the first: two instances of one model, each with its own start values
ANOTHER = System(
    {
        "machine": component("ChamberForces", values={"ratio": 30.0}),
        "motor": component("DcMotor"),
        "second": component("DcMotor", values={"rotor.J": 0.02, "w_start": 10.0}),
    },
    shaft_joints("motor", "machine"),
    [("motor.w", "second.w_ref")],
    {"motor.w_ref": 90.0},
)


@pytest.fixture(scope="module")
def another(tmp_path_factory):
    file = tmp_path_factory.mktemp("another") / "another.ssp"
    ssp.export(ANOTHER, file, stop=1.0, backend="python")
    return file


@pytest.mark.parametrize("tool", ALL_TOOLS)
def test_another_system_by_pythonfmu(tool, another, tmp_path):
    with zipfile.ZipFile(another) as archive:
        fmus = {name for name in archive.namelist() if name.endswith(".fmu")}
    assert fmus == {f"resources/{name}.fmu" for name in ("ChamberForces", "DcMotor", "DcMotor_second")}
    names = ["motor.w", "second.w"]
    got = run(tool, another, names, 0.3, 1e-3)
    reference = own(another, tmp_path / "out", names, 0.3, 1e-3)
    # what the second motor follows is one step old: first order; in fmpy the first step is without load, too
    assert np.max(np.abs(got - reference)) < (2e-3 if tool is FMPY else 1e-3) * np.max(reference)


OBSERVED = System(
    {
        "machine": component("ChamberForces", values={"ratio": 50.0}),
        "motor": component("DcMotor", values={"w_start": 150.0}),
        "observer": component("LoadObserver"),
    },
    shaft_joints("motor", "machine"),
    [(f"motor.{source}", f"observer.{target}") for source, target in SIGNALS.items()],
    {
        "motor.w_ref": 150.0,
        "observer.w": 150.0,
        "machine.left.material_mass": 38.0,
        "machine.right.material_mass": 24.0,
    },
)


@pytest.mark.parametrize("tool", ALL_TOOLS)
@pytest.mark.slow
def test_an_observer_beside_machine_and_motor(tool, tmp_path):
    """It takes plain signals of the motor. Its estimates are the loads, in the own master and in the tools."""
    file = tmp_path / "observed.ssp"
    ssp.export(OBSERVED, file, stop=8.0)
    names = [
        "observer.left.material_mass",
        "observer.right.material_mass",
        "observer.alarm",
        "observer.speed",
        "motor.w",
    ]
    got = run(tool, file, names, 8.0, 1e-3)
    reference = own(file, tmp_path / "out", names, 8.0, 1e-3)
    for rows in (got, reference):
        np.testing.assert_allclose(rows[-1, :2], [38.0, 24.0], rtol=0.02)
        assert rows[-1, 2] == 1.0
        assert rows[-1, 3] == pytest.approx(rows[-1, 4], rel=1e-3)
    np.testing.assert_allclose(got[-1], reference[-1], rtol=1e-2)


@pytest.mark.parametrize("tool", ALL_TOOLS)
@pytest.mark.slow
def test_a_driveline_between_runs_near_the_own_master(tool, tmp_path):
    """Motor, line and machine: the shaft torque follows, though both ports are a step older in these tools."""
    text = '[machine]\nratio = 50\n[driveline]\nalpha1 = "12 deg"\nalpha2 = "8 deg"\nd2 = 20\nd3 = 20\n'
    package = tmp_path / "line.ssp"
    export_study(config.parse(text), package, backend="native")
    names = ["motor.w", "driveline.driven.w", "driveline.tau2"]
    errors = []
    for step in (1e-3, 5e-4):
        got = run(tool, package, names, 0.5, step)
        reference = own(package, tmp_path / "out", names, 0.5, step)
        errors.append(np.max(np.abs(got - reference), axis=0) / np.max(np.abs(reference), axis=0))
    assert np.all(errors[0] < 2e-2) and np.all(errors[1] < 0.6 * errors[0]), errors


# -- the file, and what is refused


def test_connectors_are_connected_inputs_or_on_demand_all(package, tmp_path):
    """fmpy takes whatever output it connected last for an input without connection (FMPy, issue 690)."""
    ssp.export(ANOTHER, tmp_path / "all.ssp", backend="python", all_inputs=True)
    ssp.export(ANOTHER, tmp_path / "connected.ssp", backend="python")
    entries = {}
    for name in ("all", "connected"):
        elements = read_ssd(str(tmp_path / f"{name}.ssp")).system.elements
        entries[name] = {f"{e.name}.{c.name}" for e in elements for c in e.connectors if c.kind == "input"}
    assert entries["connected"] == {target for _, target in ANOTHER.connections}
    assert entries["all"] == {
        f"{name}.{c.name}"
        for name, part in ANOTHER.components.items()
        for c in part.connectors.values()
        if c.causality == "input"
    }
    assert entries["connected"] < entries["all"]


def test_feed_forward_and_sizing(tmp_path, monkeypatch):
    """The machine that the control asks is in the package, and shares the machine's FMU."""
    export_study(config.parse("feed_forward = true"), tmp_path / "x.ssp", backend="python")
    elements = read_ssd(str(tmp_path / "x.ssp")).system.elements
    assert [(e.name, e.source) for e in elements] == [
        ("machine", "resources/ChamberForces.fmu"),
        ("motor", "resources/DcMotor.fmu"),
        ("model", "resources/ChamberForces.fmu"),
    ]
    assert ("model.tau", "motor.tau_ff") in connections(tmp_path / "x.ssp")
    first = catalogue()[0]
    monkeypatch.setattr(sizing, "catalogue", lambda *files: [first])
    with pytest.raises(
        RunError, match=r"no motor of the catalogue fits \(1 of 1 were tried\); IE3 .*inertia"
    ):
        export_study(
            config.parse("[sizing]\ncandidates = 1\ninertia_ratio = 1e-6"),
            tmp_path / "y.ssp",
        )


def test_the_motor_that_sizing_chooses_is_packaged(tmp_path):
    sizing = "[run]\nstep = 0.002\n[sizing]\ncandidates = 1\npoles_least = 4\npoles_most = 4"
    message = export_study(config.parse(sizing), tmp_path / "z.ssp")
    assert "motor (InductionMotor)" in message
    elements = read_ssd(str(tmp_path / "z.ssp")).system.elements
    assert [e.source for e in elements] == ["resources/ChamberForces.fmu", "resources/InductionMotor.fmu"]
    assert ("machine.J", "motor.load.J") in connections(tmp_path / "z.ssp")


def test_two_alike_share_their_fmu(tmp_path):
    system = System({"a": component("DcMotor"), "b": component("DcMotor")})
    message = ssp.export(system, tmp_path / "two.ssp", backend="python")
    assert message.startswith(
        "SSP 1.0, a (DcMotor), b (DcMotor), 0 connections; FMI 2.0 Co-Simulation, by pythonfmu;"
    )
    elements = read_ssd(str(tmp_path / "two.ssp")).system.elements
    assert [e.source for e in elements] == ["resources/DcMotor.fmu"] * 2


def test_same_system_same_file(another, tmp_path):
    """Identical, byte for byte; that native FMUs are, too, is tested with them."""
    ssp.export(ANOTHER, tmp_path / "again.ssp", stop=1.0, backend="python")
    assert (tmp_path / "again.ssp").read_bytes() == another.read_bytes()


def test_whole_or_not_at_all(tmp_path, monkeypatch):
    file = tmp_path / "x.ssp"
    file.write_text("before")

    def breaks(contents, part):
        part.write_text("half")
        raise OSError("disk full")

    monkeypatch.setattr(ssp, "pack", breaks)
    with pytest.raises(WriteError, match=r"x\.ssp: cannot be written \(disk full\)"):
        export_study(config.load(), file, backend="python")
    assert [p.name for p in tmp_path.iterdir()] == ["x.ssp"] and file.read_text() == "before"


def test_what_the_command_writes_and_refuses(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    def command(*arguments):
        monkeypatch.setattr(sys, "argv", ["chainunit", "export", *arguments])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        return ended.value.code, *capsys.readouterr()

    Path("study.toml").write_text(example())
    status, out, _ = command("study.toml", "-o", "drive.ssp", "--backend", "python")
    assert not status and out.startswith("drive.ssp: SSP 1.0, ")
    assert out.count("\n") == 3 and "\nNot in it: the events " in out
    assert (
        "\nRocker torque of two bars: 10 % up to a crank speed of 2.03 rad/s. This study turns at 3.00 rad/s."
        in out
    )
    before = Path("drive.ssp").read_bytes()
    Path("wrong.toml").write_text("[machine]\nr = 0.9")
    for arguments, messages in (
        (["study.toml", "-o", "x.sps"], "-o x.sps: must be a file name that ends in .fmu or .ssp"),
        (["none.toml", "-o", "x.ssp"], "none.toml: cannot be read"),
        (["wrong.toml", "-o", "x.ssp"], "wrong.toml:2: machine: r = 0.9 m: the crank cannot turn"),
        (["study.toml", "--backend", "fortran"], "'fortran' is not one of"),
        (
            ["study.toml", "--backend", "python", "-o", "wrong.toml/x.ssp"],
            "wrong.toml: is a file; must be a folder",
        ),
    ):
        status, out, error = command(*arguments)
        assert (status, out, error.count("\n")) == (2, "", 1) and messages in error
    assert {p.name for p in tmp_path.iterdir()} == {"drive.ssp", "study.toml", "wrong.toml"}
    assert Path("drive.ssp").read_bytes() == before


@pytest.mark.parametrize(
    "models, connected, start, said",
    [
        ({"a.b": "DcMotor"}, [], {}, r'"a\.b": a component.s name must be of letters'),
        ({"m": "DcMotor"}, [], {"m.w": 1.0}, r"m\.w: no such parameter or input"),
        ({"m": "DcMotor"}, [], {"n.w_ref": 1.0}, r'n\.w_ref: there is no component "n"; there are m'),
        ({"m": "DcMotor"}, [], {"m.rotor.J": -1.0}, r"m: rotor\.J = -1 kg m2: must be > 0"),
        ({"c": "ChamberForces"}, [], {"c.r": 0.9}, r"c: r = 0\.9 m: the crank cannot turn"),
        ({"m": "DcMotor"}, [], {"m.w_ref": float("nan")}, r"m: w_ref = nan rad/s: must be a finite number"),
        ({"m": "DcMotor"}, [("m.w", "m.speed")], {}, r"m\.speed: no such input"),
        ({"m": "DcMotor"}, [("m.w_ref", "m.w_ref")], {}, r"m\.w_ref: no such output"),
        ({"m": "DcMotor"}, [("m.tau", "m.w_ref")], {}, r"m\.tau in N\.m cannot be connected to m\.w_ref"),
        (
            {"m": "DcMotor"},
            [("m.w", "m.w_ref"), ("m.w", "m.w_ref")],
            {},
            r"m\.w_ref: is connected to m\.w and to m\.w",
        ),
    ],
)
def test_systems_that_contradict_themselves(models, connected, start, said, tmp_path):
    with pytest.raises(InputError, match=said):
        components = {name: component(model) for name, model in models.items()}
        ssp.export(System(components, wires=connected, start=start), tmp_path / "x.ssp")
    assert not list(tmp_path.iterdir())


def test_an_experiment_goes_forward(tmp_path):
    with pytest.raises(InputError, match="must go forward"):
        ssp.export(System({"m": component("DcMotor")}), tmp_path / "x.ssp", step=0.0)
    assert not list(tmp_path.iterdir())
