"""The folder `fmu`: each script is all that ``pythonfmu build`` needs, and README.md says how to build."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from lxml import etree

from chainunit.core.native.compilers import host
from chainunit.models import MODELS

pytestmark = pytest.mark.second

FOLDER = Path(__file__).parents[1] / "fmu"
OPTIONS = ("--handle-state", "--serialize-state")
OTHER_START = {"ChamberForces": {"r": 0.14}, "DcMotor": {"rotor.J": 0.5}}

# in a process that has no chainunit, as at an importer: rows of each FMU, all loaded in the one process
SIMULATE = """
import sys
sys.modules["chainunit"] = None
import fmpy, numpy
for file in sys.argv[1:]:
    description = fmpy.read_model_description(file)
    names = [v.name for v in description.modelVariables if v.causality == "output"]
    given = [v.name for v in description.modelVariables if v.causality == "input"]
    t = numpy.linspace(0.0, 0.05, 6)
    inputs = numpy.zeros(6, [("time", float), *((n, float) for n in given)])
    inputs["time"] = t
    start = {v.name: float(v.start) for v in description.modelVariables if v.causality == "input"}
    for k, n in enumerate(given):
        # masses and loads stay positive
        inputs[n] = start[n] * (1.0 + 0.1 * t) + 0.01 * (k + 1) * t
    rows = fmpy.simulate_fmu(file, stop_time=0.05, output_interval=0.01, input=inputs, output=names)
    numpy.save(file + ".npy", rows)
    assert numpy.isfinite(numpy.array(rows.tolist())).all() and len(rows) == 6
"""


def build(script, folder, *options):
    command = [
        sys.executable,
        "-B",
        "-m",
        "pythonfmu",
        "build",
        "-f",
        str(script),
        "-d",
        str(folder),
        *options,
    ]
    process = subprocess.run(command, capture_output=True, text=True, cwd=folder)
    assert process.returncode == 0, process.stderr
    return folder / f"{script.stem}.fmu"


def simulated(*files):
    subprocess.run([sys.executable, "-c", SIMULATE, *map(str, files)], check=True)
    return [np.load(f"{file}.npy") for file in files]


def carried(file):
    """Code by name, the script of whatever name as "script"; and the attributes of the description's elements."""
    with zipfile.ZipFile(file) as archive:
        code = {n: archive.read(n) for n in archive.namelist() if n.startswith(("resources/", "binaries/"))}
        root = etree.fromstring(archive.read("modelDescription.xml"))
    script = f"resources/{code.pop('resources/slavemodule.txt').decode()}.py"
    code["script"] = code.pop(script)
    root.attrib.pop("generationDateAndTime", None)
    described = [
        # "false" is the default of a capability
        (e.tag, {k: v for k, v in e.attrib.items() if v != "false" or e.tag != "CoSimulation"})
        for e in root.iter()
    ]
    return code, described


def test_each_model_has_a_script():
    assert {file.stem for file in FOLDER.glob("*.py")} == set(MODELS)
    text = (FOLDER / "README.md").read_text()
    assert all(f"`{name}.py`" in text for name in MODELS) and " ".join(OPTIONS) in text


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.slow
def test_pythonfmu_builds_it_as_the_exporter_does(name, fmus, tmp_path):
    file = build(FOLDER / f"{name}.py", tmp_path)
    exported = tmp_path / f"exported {name}.fmu"
    shutil.copy(fmus[name], exported)
    assert validate_fmu(str(file)) == []
    built, reference = simulated(file, exported)
    assert built.dtype == reference.dtype and built.tolist() == reference.tolist()
    (code, described), (wanted_code, reference) = carried(file), carried(exported)
    assert code == wanted_code
    # pythonfmu's own options win over the description: without them it says that the FMU cannot save its state
    without = {"canGetAndSetFMUstate", "canSerializeFMUstate"}
    assert described != reference and described == [
        (tag, {k: v for k, v in attributes.items() if k not in without}) for tag, attributes in reference
    ]
    with_options = build(FOLDER / f"{name}.py", tmp_path, *OPTIONS)
    assert carried(with_options) == (code, reference)


@pytest.mark.parametrize("name", OTHER_START)
def test_start_values_of_a_script(name, tmp_path):
    """Two scripts of one name in one process do not share code or start values."""
    folders = [tmp_path / "one", tmp_path / "two"]
    for folder in folders:
        folder.mkdir()
        shutil.copy(FOLDER / f"{name}.py", folder)
    with (folders[1] / f"{name}.py").open("a") as script:
        script.write(f"    start = {OTHER_START[name]!r}\n")
    files = [build(folder / f"{name}.py", folder) for folder in folders]
    (parameter, value), *_ = OTHER_START[name].items()
    variables = {v.name: v for v in fmpy.read_model_description(str(files[1])).modelVariables}
    assert float(variables[parameter].start) == value
    one, two = simulated(*files)
    again, first = simulated(files[1], files[0])
    assert one.tolist() == first.tolist() and two.tolist() == again.tolist() and one.tolist() != two.tolist()


def test_a_script_with_a_class_and_imports_of_its_own(tmp_path):
    """Both were built without an error, and no host could instantiate the FMU."""
    text = (FOLDER / "ChamberForces.py").read_text()
    script = tmp_path / "MyChamber.py"
    script.write_text(
        text.replace("class ChamberForces", "class MyChamber").replace(
            "from chainunit.machines import chain_unit",
            "import chainunit.core.integrators as steps\nfrom chainunit.drives import cardan, dc_motor, driveline\n"
            "from chainunit.machines import chain_unit",
        )
        + '    experiment = {"stop": 3.0}\n'
        + '    start = {"crank.m": len(driveline.CardanDriveline.name) + float(steps.rk4 is not None)}\n'
    )
    file = build(script, tmp_path)
    assert validate_fmu(str(file)) == []
    description = fmpy.read_model_description(str(file))
    assert description.coSimulation.modelIdentifier == "MyChamber"
    assert {v.name: v.start for v in description.modelVariables}["crank.m"] == "16.0"
    assert (description.defaultExperiment.stopTime, description.defaultExperiment.stepSize) == ("3", "0.001")
    plain = tmp_path / "plain"
    plain.mkdir()
    other = build(FOLDER / "ChamberForces.py", plain)
    # side by side: the first that is loaded must not hide modules from the second
    for files in ((other, file), (file, other)):
        rows = simulated(*files)
        assert rows[0].dtype == rows[1].dtype and rows[0].tolist() != rows[1].tolist()


def test_a_script_imports_what_it_wants(tmp_path):
    """It is run when the FMU is built, not inside the FMU."""
    script = tmp_path / "ChamberForces.py"
    line = "import numpy\nfrom chainunit import ChainUnitMachine"
    text = (FOLDER / "ChamberForces.py").read_text().replace("\n\n\n", f"\n{line}\n\n\n", 1)
    script.write_text(f'{text}    start = {{"r": float(numpy.float64(ChainUnitMachine().p.r))}}\n')
    (rows,) = simulated(build(script, tmp_path))
    assert len(rows) == 6
    with zipfile.ZipFile(tmp_path / "ChamberForces.fmu") as archive:
        assert b"numpy" not in archive.read("resources/ChamberForces.py")


@pytest.mark.skipif(host() != "linux64" or shutil.which("cc") is None, reason="a C compiler on 64-bit Linux")
def test_the_commands_of_the_readme(native_fmus, tmp_path):
    """The command in the README compiles a native FMU from its own sources, with the same results."""
    commands = [
        c for c in re.findall(r"```sh\n(.*?)```", (FOLDER / "README.md").read_text(), re.DOTALL) if "cc " in c
    ]
    assert len(commands) == 1
    file, _ = native_fmus["ChamberForces", 2]
    copy = tmp_path / "ChamberForces.fmu"
    with zipfile.ZipFile(file) as archive, zipfile.ZipFile(copy, "w") as emptied:
        for name in archive.namelist():
            # a library that is none: what runs below is the new one
            emptied.writestr(name, b"" if name.startswith("binaries/") else archive.read(name))
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    subprocess.run(
        ["sh", "-e", "-c", commands[0]], check=True, cwd=tmp_path, env={**os.environ, "PATH": path}
    )
    assert validate_fmu(str(copy)) == []
    original = tmp_path / "original.fmu"
    shutil.copy(file, original)
    built, reference = simulated(copy, original)
    for name in reference.dtype.names:
        np.testing.assert_allclose(built[name], reference[name], rtol=1e-12, atol=1e-12)
