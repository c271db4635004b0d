"""FMUs whose variables have flat names, as `left_material_mass`: the files in them, their runs, the SSP package."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from command import chainunit
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssd, read_ssv
from fmpy.validation import validate_fmu
from systems import component, shaft_joints
from wrong_linkages import PRESS

from chainunit.core.errors import InputError, RunError
from chainunit.core.model import Model, Part
from chainunit.core.native.compilers import compiler
from chainunit.core.quantities import declaration, group, quantity
from chainunit.drives.dc_motor import DcMotor
from chainunit.fmu.backends import export
from chainunit.fmu.description import Interface, model_description, model_description_3, terminals
from chainunit.fmu.script import Script, script_with_names
from chainunit.machines.chain_unit import ChamberForces
from chainunit.machines.linkages.file import read_linkage
from chainunit.system import System, ssp
from chainunit.system.instance import Fmu, Instance

LINKAGE = Path(__file__).parents[1] / "examples" / "linkages" / "slider_crank_press.toml"
KINDS = {"ModelExchange": {}, "CoSimulation": {}}
DOTTED = re.compile(r"\b[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)+")

native = pytest.mark.skipif(compiler() is None, reason="no C compiler")


def both(model):
    """The interface with structured names, and that with flat ones."""
    return Interface(model, {}), Interface(model, {}, script_with_names("flat"))


@pytest.mark.parametrize(
    "model",
    [ChamberForces, DcMotor, lambda: read_linkage(LINKAGE).direct()],
    ids=["ChamberForces", "DcMotor", "linkage"],
)
def test_the_description_differs_by_its_names_alone(model):
    """Of FMI 2 and 3, terminals included; no variable of the model is left with its dots, whatever text names it."""
    interfaces = both(model if isinstance(model, Model) else model())
    names = {s.variable.name for s in interfaces[0].signals}
    assert any("." in name for name in names)
    for write in (model_description, model_description_3):
        texts = [ElementTree.tostring(write(each, "{0}", KINDS, "9.9"), "unicode") for each in interfaces]
        flat = DOTTED.sub(lambda m: m[0].replace(".", "_") if m[0] in names else m[0], texts[0])
        assert texts[1] == flat.replace('Convention="structured"', 'Convention="flat"')
    of_variables = {s.name for s in interfaces[1].signals}
    members = [*terminals(interfaces[1]).iter("TerminalMemberVariable")]
    assert members and {m.get("variableName") for m in members} <= of_variables


def run(file, names):
    result = fmpy.simulate_fmu(str(file), stop_time=0.2, output_interval=0.01, output=names)
    return np.array([result[name] for name in names])


def check_flat(folder, model, start, line):
    """The texts of the FMU `flat.fmu` have no name with a dot; its runs are those of `usual.fmu`. An FMU 2.0 refuses
    `start` with this `line`."""
    names = {s.variable.name for s in Interface(model, {}).signals}
    with zipfile.ZipFile(folder / "flat.fmu") as archive:
        for member in archive.namelist():
            if member.endswith((".csv", ".exp", ".html", "model.c", "rules.h", "Icons.xml")):
                assert not names & set(DOTTED.findall(archive.read(member).decode())), member
    assert validate_fmu(str(folder / "flat.fmu")) == []
    outputs = [s.variable.name for s in Interface(model, {}).signals_of("output")]
    usual = run(folder / "usual.fmu", outputs)
    np.testing.assert_array_equal(
        run(folder / "flat.fmu", [name.replace(".", "_") for name in outputs]), usual
    )
    if fmpy.read_model_description(str(folder / "flat.fmu")).fmiVersion != "2.0":
        return  # the package runs FMUs 2.0
    fmu = Fmu(folder / "flat.fmu")
    unit = Instance(fmu, "unit", [])
    with pytest.raises(RunError, match=line):
        unit.initialize(start, 0.0)
        unit.finish_initialization()
        unit.step(0.0, 0.1)
    unit.close()
    fmu.close()


@native
@pytest.mark.second
@pytest.mark.parametrize("fmi", [2, 3])
def test_a_native_fmu(fmi, tmp_path):
    """Reference results, documentation and messages have the flat names, too."""
    for name, names in (("usual", "structured"), ("flat", "flat")):
        export(
            ChamberForces, tmp_path / f"{name}.fmu", {"ratio": 50.0}, backend="native", fmi=fmi, names=names
        )
    check_flat(tmp_path, ChamberForces, {"left_wall_mass": -1.0}, "left_wall_mass = -1 kg: must be >= 0 kg")


@pytest.mark.second
def test_a_python_fmu_of_a_linkage(tmp_path):
    model = read_linkage(LINKAGE)
    for name, names in (("usual", "structured"), ("flat", "flat")):
        export(model, tmp_path / f"{name}.fmu", backend="python", names=names)
    some = next(v.name for v in model.parameter_layout.variables if "." in v.name and v.quantity.low == 0.0)
    flat = some.replace(".", "_")
    check_flat(tmp_path, model, {flat: -1.0}, f"{flat} = -1")


@declaration
class Inner:
    c: float = quantity("1", "a number", default=1.0)


@declaration
class Same:
    a_b: Inner = group(Inner, "one", default=Inner())
    b_c: float = quantity("1", "another", default=2.0)
    a: Inner = group(Inner, "far", default=Inner())


@declaration
class Other:
    a: Same = group(Same, "inner", default=Same())
    a_b_c: float = quantity("1", "a third", default=3.0)


@declaration
class Sum:
    y: float = quantity("1", "their sum")


Clash = Model(
    name="Clash",
    text="Two parameters that differ by their dots alone.",
    description="two parameters that differ by their dots alone",
    Parameters=Other,
    Inputs=Inner,
    parts=(Part(Sum, lambda xp, p, u, x, shared: Sum(y=p.a.b_c + p.a_b_c)),),
)


def test_names_that_become_the_same_are_refused(tmp_path):
    """All pairs, and the file is not written; with structured names the same model is exported."""
    with pytest.raises(
        InputError,
        match=r"Clash with flat names: a\.b_c and a_b_c would be a_b_c; rename one of them, or take structured names",
    ):
        export(Clash, tmp_path / "clash.fmu", backend="python", names="flat")
    assert not list(tmp_path.iterdir())
    assert Script.names == "structured"
    with pytest.raises(InputError, match=r'names = "short": must be one of structured, flat'):
        export(Clash, tmp_path / "clash.fmu", backend="python", names="short")


@pytest.mark.second
def test_the_commands(tmp_path):
    """Of a linkage file, a whole drive and an SSP package; fmpy runs the package as one with structured names."""
    (tmp_path / "press.toml").write_text(PRESS, "utf-8")
    (tmp_path / "mine.toml").write_text("[machine]\nratio = 50\n")
    for name, variable in (("press.toml", "crank_angle"), ("mine.toml", "machine_left_material_mass")):
        done = chainunit("export", name, "--names", "flat", "-o", "x.fmu", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        described = fmpy.read_model_description(str(tmp_path / "x.fmu"))
        names = {v.name for v in described.modelVariables}
        assert described.variableNamingConvention == "flat" and variable in names
        assert not [name for name in names if "." in name]
    done = chainunit("export", "press.toml", "--names", "long", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (
        2,
        "",
    ) and "'long' is not one of 'structured', 'flat'" in done.stderr


@native
@pytest.mark.second
def test_an_ssp_package(tmp_path):
    """Connectors, connections and parameter sets have the names of its FMUs; a run in fmpy is that with structured
    names."""
    system = System(
        {"machine": component("ChamberForces", values={"ratio": 50.0}), "motor": component("DcMotor")},
        shaft_joints("motor", "machine"),
        start={"motor.w_ref": 150.0},
    )
    results = {}
    for names in ("structured", "flat"):
        file = tmp_path / f"{names}.ssp"
        ssp.export(system, file, stop=0.1, names=names)
        results[names] = simulate_ssp(str(file), stop_time=0.1, step_size=1e-3)
    structure = read_ssd(str(tmp_path / "flat.ssp")).system
    found = {c.name for e in structure.elements for c in e.connectors}
    found |= {name for c in structure.connections for name in (c.startConnector, c.endConnector)}
    found |= {p.name for p in read_ssv(str(tmp_path / "flat.ssp"), "resources/machine.ssv").parameters}
    assert "left_material_mass" in found and "load_tau_bias" in found
    assert not [name for name in found if "." in name]
    for name in results["structured"].dtype.names:
        element, _, variable = name.partition(".")
        flat = f"{element}.{variable.replace('.', '_')}" if variable else name
        np.testing.assert_array_equal(results["flat"][flat], results["structured"][name])
