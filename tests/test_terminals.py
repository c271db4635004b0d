"""The terminals of the FMUs: Modelica's flange at every shaft, and a tool that knows the FMI standard alone."""

from __future__ import annotations

import importlib.util
import io
import itertools
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from lxml import etree
from systems import component, pair

from chainunit.core.errors import InputError
from chainunit.core.model import Model, Part, Terminal
from chainunit.core.ports import driven_flanges, flanges
from chainunit.core.quantities import declaration, quantity
from chainunit.drives.gear import Gear
from chainunit.drives.slip_clutch import SlipClutch
from chainunit.fmu.backends import export
from chainunit.fmu.description import Interface
from chainunit.fmu.pack import companion_files
from chainunit.machines.linkages.file import read_linkage
from chainunit.models import MODELS
from chainunit.system import CoSimulation, ModelComponent, System, monolithic

FILE = "terminalsAndIcons/terminalsAndIcons.xml"
LINKAGES = Path(__file__).parents[1] / "examples" / "linkages"
ROTATIONAL = "Modelica.Mechanics.Rotational.Interfaces.Flange_a"
TRANSLATIONAL = "Modelica.Mechanics.Translational.Interfaces.Flange_a"
SCHEMA = Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3TerminalsAndIcons.xsd"


def linkage(name, direct=False):
    machine = read_linkage(LINKAGES / f"{name}.toml")
    return machine.direct() if direct else machine


SHAFTS = {
    **{name: lambda name=name: MODELS[name] for name in MODELS if name != "LoadObserver"},
    **{model.name: lambda model=model: model for model in (Gear, SlipClutch)},
    "KnifeDrive direct": lambda: MODELS["KnifeDrive"].direct(),
    "press": lambda: linkage("slider_crank_press"),
    "press direct": lambda: linkage("slider_crank_press", direct=True),
    "luffing crane": lambda: linkage("level_luffing_crane"),
    "luffing crane direct": lambda: linkage("level_luffing_crane", direct=True),
}


@pytest.mark.stages(first=2)
@pytest.mark.parametrize("name", SHAFTS)
def test_every_shaft_has_the_flange_of_modelica(name):
    """In FMI 2 and 3, beside each flange of this package: the same angle and torque, by Modelica's names."""
    model = SHAFTS[name]()
    interface = Interface(model, {})
    signals = {s.name: s for s in interface.signals}
    roots = {fmi: etree.fromstring(companion_files(interface, "1", fmi)[FILE]) for fmi in (2, 3)}
    schema = etree.XMLSchema(etree.parse(SCHEMA))
    for fmi, root in roots.items():
        schema.assertValid(root)
        assert root.get("fmiVersion") == "3.0"
        # the icon of an FMU 2.0 is model.png
        assert (root.find("GraphicalRepresentation") is None) == (fmi == 2)
    of = {
        fmi: {t.get("name"): etree.tostring(t) for t in root.iter("Terminal")} for fmi, root in roots.items()
    }
    assert of[2] == of[3]
    nodes = {t.get("name"): t for t in roots[2].iter("Terminal")}
    own = {
        n
        for n, t in nodes.items()
        if t.get("terminalKind", "").endswith(("chainunit.flange", "linear_flange"))
    }
    assert own == ({"flange", "driven"} if "driven" in nodes else {"flange"})
    for flange, modelica in [("flange", "flange_a"), ("driven", "flange_b")][: len(own)]:
        node, beside = nodes[modelica], nodes[flange]
        linear = beside.get("terminalKind").endswith("linear_flange")
        assert node.get("terminalKind") == (TRANSLATIONAL if linear else ROTATIONAL)
        assert node.get("matchingRule") == "plug"
        members = {m.get("memberName"): (m.get("variableName"), m.get("variableKind")) for m in node}
        same = {m.get("memberName"): (m.get("variableName"), m.get("variableKind")) for m in beside}
        assert [*members] == (["s", "f"] if linear else ["phi", "tau"])
        assert [*members.values()] == [same["phi"], same["tau"]]
        angle, torque = (signals[name] for name, _ in members.values())
        assert (angle.variable.unit, torque.variable.unit) == (("m", "N") if linear else ("rad", "N.m"))
        # who gives the motion to the machine lets its torque flow out, who takes it lets it in
        drives = model.name in ("DcMotor", "InductionMotor") or flange == "driven"
        assert members["f" if linear else "tau"][1] == ("outflow" if drives else "inflow")
        assert (angle.causality == "output") == (drives or torque.causality == "input")


def test_what_has_no_shaft_has_no_flange():
    root = ElementTree.fromstring(companion_files(Interface(MODELS["LoadObserver"], {}), "1", 2)[FILE])
    assert [t.get("name") for t in root.iter("Terminal")] == ["measured"]

    Bare = Gear.altered(name="Bare", terminals=())
    assert FILE not in companion_files(Interface(Bare, {}), "1", 2)
    assert FILE in companion_files(Interface(Bare, {}), "1", 3)  # of the icon


# -- a tool that knows the standard, and nothing of this package


def declared(files):
    """By FMU its terminals: kind, rule and members with their kinds; and the causality of each variable."""
    found = {}
    for name, file in files.items():
        with zipfile.ZipFile(file) as archive:
            root = ElementTree.fromstring(archive.read(FILE))
            variables = ElementTree.fromstring(archive.read("modelDescription.xml")).find("ModelVariables")
        causality = {v.get("name"): v.get("causality") for v in variables}
        found[name] = (
            [
                (
                    t.get("terminalKind"),
                    t.get("matchingRule"),
                    {m.get("memberName"): (m.get("variableName"), m.get("variableKind")) for m in t},
                )
                for t in root.iter("Terminal")
            ],
            causality,
        )
    return found


def joined(told):
    """The connections by section 2.4.9 of FMI 3.0: terminals of one kind and one rule; members of one name, by "plug"
    only if both have all; from output to input. An outflow is the inflow of the other side; two of the same
    direction would need a change of sign."""
    connections = {}
    for (one, (terminals, causes)), (other, (others, causes2)) in itertools.combinations(told.items(), 2):
        for (kind, rule, members), (kind2, rule2, members2) in itertools.product(terminals, others):
            if (kind, rule) != (kind2, rule2) or (rule == "plug" and {*members} != {*members2}):
                continue
            for member in {*members} & {*members2}:
                (a, flow), (b, flow2) = members[member], members2[member]
                if {causes[a], causes2[b]} == {"input", "output"}:
                    ends = [(one, a), (other, b)]
                    source, target = ends if causes[a] == "output" else ends[::-1]
                    assert (flow == "signal") == (flow2 == "signal") and (flow == "signal" or flow != flow2)
                    connections[".".join(target)] = ".".join(source)
    return {(source, target) for target, source in connections.items()}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Motor and machines as native FMUs 2.0."""
    folder = tmp_path_factory.mktemp("terminals")
    models = {
        "motor": MODELS["DcMotor"],
        "machine": MODELS["ChamberForces"],
        "press": linkage("slider_crank_press"),
    }
    for name, model in models.items():
        export(model, folder / f"{name}.fmu")
    return {name: folder / f"{name}.fmu" for name in models}


@pytest.mark.compiler
def test_fmpy_finds_no_fault(files, tmp_path):
    for fmi in (2, 3):
        export(MODELS["CardanDriveline"], tmp_path / f"line{fmi}.fmu", fmi=fmi)
    for file in (*files.values(), *tmp_path.glob("*.fmu")):
        assert validate_fmu(str(file)) == [], file


@pytest.mark.parametrize("machine", ["machine", "press"])
def test_a_tool_that_knows_the_standard_joins_motor_and_machine(files, machine):
    """The connections are those of the joints, and so is the run, to the last digit."""
    models = {"machine": MODELS["ChamberForces"], "press": linkage("slider_crank_press")}
    of = {"machine": files[machine], "motor": files["motor"]}
    found = joined(declared(of))
    values = {"motor.w_start": 100.0, "machine.ratio": 20.0}
    system = pair(models[machine], "DcMotor", of, values)
    assert found == set(system.connections) and len(found) == 10
    wired = System(system.components, (), sorted(found), system.start)
    runs = []
    for each in (system, wired):
        with CoSimulation(each, {"motor.w_ref": 150.0}) as simulation:
            runs.append(simulation.run(0.1, 0.002))
    assert np.ptp(runs[0]["motor.w"].values) > 5.0
    for name in runs[0]:
        np.testing.assert_array_equal(runs[0][name].values, runs[1][name].values, name)


@pytest.mark.second
@pytest.mark.skipif(
    importlib.util.find_spec("fmu_manipulation_toolbox") is None,
    reason="fmu_manipulation_toolbox is not installed",
)
def test_fmu_manipulation_toolbox_joins_them(files):
    """Its own rule for terminals: equal kind and rule, and the members by name."""
    from fmu_manipulation_toolbox.terminals import Terminals

    def read(name):
        with zipfile.ZipFile(files[name]) as archive:
            return Terminals.from_xml_source(io.BytesIO(archive.read(FILE)))

    told = {name: read(name) for name in ("motor", "machine")}
    linked = [
        (mine.name, theirs.name, *link)
        for mine in told["motor"]
        for theirs in told["machine"]
        if mine == theirs
        for link in mine.connect(theirs)
    ]
    assert {(a, b) for a, b, *_ in linked} == {("flange",) * 2, ("flange_a",) * 2, ("load",) * 2}
    pairs = {(f"motor.{a}", f"machine.{b}") for _, _, a, b in linked}
    wanted = {tuple(sorted(c, reverse=True)) for c in pair("ChamberForces", "DcMotor").connections}
    assert wanted == {p for p in pairs if p != ("motor.tau", "machine.tau")}


# -- the sign


@declaration
class SpringParameters:
    c: float = quantity("N.m/rad", "stiffness", default=300.0)


@declaration
class SpringInputs:
    angle: float = quantity("rad", "angle of the machine's end", default=0.0)


@declaration
class SpringOutputs:
    torque: float = quantity("N.m", "torque on the machine")


def outputs_of_spring(xp, p, u, x, shared):
    return SpringOutputs(torque=-p.c * u.angle)


Spring = Model(
    name="Spring",
    description="a torsion spring at the shaft of a machine",
    terminals=(Terminal("end", ROTATIONAL, "", {"phi": "angle", "tau": "torque"}, {"tau": "outflow"}),),
    Parameters=SpringParameters,
    Inputs=SpringInputs,
    parts=(Part(SpringOutputs, outputs_of_spring),),
)


def test_the_sign_is_that_of_modelica():
    """A machine on a spring, joined by Modelica's flange alone: only with the right sign of the torque is the energy
    of both kept."""
    frictionless = {"pin.friction": 0.0, "joint_damping": 0.0, "phi_start": 0.5, "J_added": 0.5}
    parts = {"machine": component("ChainUnit", values=frictionless), "spring": component(Spring)}
    system = System(parts, [("spring.end", "machine.flange_a")])
    assert system.connections == [("machine.phi", "spring.angle"), ("spring.torque", "machine.tau")]
    run = monolithic(system, {}, np.linspace(0.0, 1.0, 81), rtol=1e-10)
    phi, moved = run["machine.phi"].values, run["machine.kinetic_energy"] + run["machine.potential_energy"]
    stored = 0.5 * 300.0 * phi**2
    assert np.ptp(phi) > 0.5
    np.testing.assert_allclose(moved.values + stored, moved.values[0] + stored[0], atol=1e-6 * np.ptp(stored))


def test_a_line_is_joined_by_the_flanges_of_modelica():
    """Its two shafts by angle and torque alone: its kinds are alike, as tools compare them."""
    assert {t.kind for t in (*flanges("inflow"), *driven_flanges()) if t.name.startswith("flange_")} == {
        ROTATIONAL
    }
    parts = {
        "machine": component("ChamberForces"),
        "line": component("CardanDriveline"),
        "motor": component("DcMotor"),
    }
    joints = [("line.flange_b", "machine.flange_a"), ("motor.flange_a", "line.flange_a")]
    system = System({name: ModelComponent(c.model, c.parameters) for name, c in parts.items()}, joints)
    assert system.connections == [("line.driven.phi", "machine.phi"), ("motor.phi", "line.phi")]


def test_joints_that_do_not_fit_are_named():
    machine, motor = component("ChamberForces"), component("DcMotor")
    parts = {"machine": machine, "motor": motor}
    for joints, said in (
        (
            [("motor.shaft", "machine.flange")],
            r"motor\.shaft: no such terminal; motor \(DcMotor\) has flange, ",
        ),
        (
            [("gear.flange", "machine.flange")],
            r'gear\.flange: there is no component "gear"; there are machine, motor',
        ),
        (
            [("motor.flange", "machine.flange"), ("machine.flange", "motor.flange")],
            r"machine\.flange: is joined to motor\.flange and to motor\.flange",
        ),
        (
            [("motor.flange", "machine.load")],
            r"motor\.flange \(org\.chainunit\.flange\) cannot be joined to machine\.load \(org\.chainunit\.load\)",
        ),
    ):
        with pytest.raises(InputError, match=said):
            System(parts, joints)
    with pytest.raises(
        InputError, match=r"motor\.flange and second\.flange both give the angle: one must give it"
    ):
        System({"motor": motor, "second": motor}, [("motor.flange", "second.flange")])
