"""Numbers from scripts: texts with units and quantities of pint are taken where numbers are; other types are refused
in one line."""

from __future__ import annotations

import re

import numpy as np
import pint
import pytest
import xarray as xr

from chainunit import ChainUnitMachine, InputError, SideLoads, Study, linearize, linkage
from chainunit.batch import Beyond, Histogram, evaluate
from chainunit.core.bounds import complaint
from chainunit.core.declared_numbers import one_number
from chainunit.core.named import Named
from chainunit.core.quantities import Quantity, Variable
from chainunit.machines.api import ChainUnitOfChains
from chainunit.machines.chain_unit import Feed
from chainunit.machines.crank_rocker import CrankRocker
from chainunit.machines.knife_drive import KnifeDrive
from chainunit.machines.machine import Machine
from chainunit.models import MODELS
from chainunit.system import CompiledSimulation, ModelComponent, Profile, System, monolithic, shaft_joints
from chainunit.work.runner import check_scheduler

UNITS = pint.UnitRegistry()
DC_MOTOR = MODELS["DcMotor"]
MOTOR = {"motor": ModelComponent(DC_MOTOR, DC_MOTOR.Parameters())}
MM, RPM, DEG, KG, N = UNITS.mm, UNITS.rpm, UNITS.deg, UNITS.kg, UNITS.newton


@pytest.mark.parametrize("r", ["160 mm", 160 * MM, 0.16 * UNITS.m, np.float64(0.16)])
def test_a_parameter_has_its_unit(r):
    for machine in (
        ChainUnitMachine(r=r),
        ChainUnitMachine({"r": r}),
        ChainUnitMachine().replace(r=r),
        Study(machine={"r": r}).machine,
        Study().with_values({"machine.r": r}).machine,
    ):
        assert machine.p.r == pytest.approx(0.16, rel=1e-15)


def test_motion_and_loads_have_their_units():
    machine, angles = ChainUnitMachine(), np.linspace(0.0, 2.0, 5)
    plain = machine.forces(angles, np.pi, left=SideLoads(material_mass=30.0, processing_force=2000.0))
    texts = machine.forces(angles, "30 rpm", left=SideLoads(material_mass="30 kg", processing_force="2 kN"))
    load = SideLoads(material_mass=30 * KG, processing_force=2000 * N)
    library = machine.forces(np.degrees(angles) * DEG, 30 * RPM, left=load)
    for out in (texts, library):
        np.testing.assert_allclose(out.tau, plain.tau, rtol=1e-12)
    assert machine.evaluate({"phi": "90 deg", "w": 30 * RPM})["tau"] == pytest.approx(
        machine.evaluate({"phi": np.pi / 2, "w": np.pi})["tau"], rel=1e-12
    )
    knife = Machine(KnifeDrive, {"knife.m": "90 kg"}, ratio=10)
    feed = KnifeDrive.Feed(cut_force="9 kN")
    assert knife.outputs("30 deg", feed=feed).tau == pytest.approx(
        Machine(KnifeDrive, {"knife.m": 90.0}, ratio=10.0)
        .outputs(np.pi / 6, feed=KnifeDrive.Feed(cut_force=9e3))
        .tau
    )
    assert CrankRocker.for_swing("17.25 deg", 2 / 3).r == CrankRocker.for_swing(np.radians(17.25), 2 / 3).r
    np.testing.assert_allclose(machine.mean_pulls(30 * RPM), machine.mean_pulls(np.pi), rtol=1e-12)


def test_a_batch_takes_arrays_with_units():
    machine, angles = ChainUnitMachine(), np.linspace(0.0, 360.0, 90)
    plain = machine.batch({"phi": np.radians(angles), "w": np.pi, "r": 0.15}, ["tau"], engine="numpy")
    given = {"phi": angles * DEG, "w": "30 rpm", "r": 150 * MM}
    np.testing.assert_allclose(machine.batch(given, ["tau"], engine="numpy").tau, plain.tau, rtol=1e-12)
    wrapped = xr.DataArray(angles * DEG, dims="phi")
    states = machine.batch(given | {"phi": wrapped}, ["tau"], engine="numpy")
    np.testing.assert_allclose(states.tau, plain.tau, rtol=1e-12)


@pytest.mark.parametrize(
    "texts",
    [["10 deg", "0.5 rad"], np.array(["10 deg", "0.5 rad"]), xr.DataArray(["10 deg", "0.5 rad"], dims="phi")],
)
def test_a_list_of_texts_is_a_list_of_numbers(texts):
    machine, angles = ChainUnitMachine(), [np.radians(10.0), 0.5]
    plain = machine.forces(np.array(angles), 3.0).tau
    np.testing.assert_allclose(machine.forces(texts, 3.0).tau, plain, rtol=1e-12)
    states = machine.batch({"phi": texts, "w": 3.0}, "tau", engine="numpy")
    plain = machine.batch({"phi": angles, "w": 3.0}, "tau", engine="numpy").tau
    np.testing.assert_allclose(states.tau, plain, rtol=1e-12)
    np.testing.assert_allclose(states.phi, angles, rtol=1e-12)


def test_an_array_with_units_is_converted_by_every_method():
    machine = ChainUnitMachine()
    degrees = xr.DataArray([10.0, 20.0], dims="phi", attrs={"units": "deg"})
    np.testing.assert_allclose(
        machine.forces(degrees).tau, machine.forces(np.radians(degrees.values)).tau, rtol=1e-12
    )


def test_loads_and_speeds_with_units_in_every_method():
    """Texts and quantities of pint give what plain numbers give."""
    machine, plain = ChainUnitMachine(), SideLoads(material_mass=30.0, processing_force=50.0)
    methods = [
        lambda loads, w, psi: machine.slack_speed(loads, loads),
        lambda loads, w, psi: machine.pushed_speed(loads, loads, highest=w),
        lambda loads, w, psi: machine.slack_speed(loads, loads, highest=w),
        lambda loads, w, psi: machine.mean_pulls(w, loads, loads),
        lambda loads, w, psi: machine.least_web_pull(w, loads, loads),
        lambda loads, w, psi: machine.loaded_sides(Feed(left=loads, right=loads)),
        lambda loads, w, psi: machine.hanging("left", psi, loads).theta,
        lambda loads, w, psi: machine.organ_pulls(psi, w, left=loads)["left"]["web"]["A2"],
        lambda loads, w, psi: machine.chamber(psi, w, left=loads).rocker.tau,
    ]
    texts = SideLoads(material_mass="30 kg", processing_force="0.05 kN")
    library = SideLoads(material_mass=3e4 * UNITS.gram, processing_force=50 * N)
    for method in methods:
        numbers = method(plain, 30.0, np.radians(10.0))
        for others in ((texts, "30 rad/s", "10 deg"), (library, 30.0 * UNITS.rad / UNITS.s, 10 * DEG)):
            other = method(*others)
            assert other == numbers if isinstance(other, tuple) else np.allclose(other, numbers, rtol=1e-9)


def test_shares_are_taken_in_percent():
    assert (
        ChainUnitMachine(web_share="8 %").p.web_share
        == ChainUnitMachine(web_share=8 * UNITS.percent).p.web_share
    )
    shares = ChainUnitMachine.from_ratios("10 %", 2 / 3, "60 %", "50 %")
    assert shares.by_name == pytest.approx(
        ChainUnitMachine.from_ratios(0.1, 2 / 3, 0.6, 0.5).by_name, rel=1e-12
    )
    with pytest.raises(InputError) as refusal:
        ChainUnitMachine(ratio="8 %")
    assert "%" not in str(refusal.value).partition(":")[2]


@pytest.mark.parametrize(
    "call",
    [
        lambda x: ChainUnitMachine(r=x),
        lambda x: ChainUnitMachine().forces(0.0, left=SideLoads(material_mass=x)),
        lambda x: ChainUnitMachine().forces(x * np.ones(3)),
        lambda x: ChainUnitMachine().batch({"phi": 0.0, "r": x}, engine="numpy"),
        lambda x: Study(machine={"r": x}),
        lambda x: Study().with_values({"machine.r": x}),
    ],
)
def test_a_quantity_without_a_dimension_is_no_length(call):
    with pytest.raises(
        InputError, match=r' = .*0\.15 1".*: must be a number in .*, or a text such as'
    ) as refusal:
        call(0.15 * UNITS.dimensionless)
    assert "\n" not in str(refusal.value)
    assert Study(machine={"ratio": 40 * UNITS.dimensionless}).machine.p.ratio == 40.0


RATIOS = {"rho": 0.1, "lam": 2 / 3, "mu": 0.6, "zeta": 0.5}


@pytest.mark.parametrize(
    ("name", "value"),
    [("rho", 0.99), ("lam", 0.05), ("lam", 0.12), ("mu", 0.99), ("zeta", 0.01), ("zeta", 0.99)],
)
def test_a_ratio_that_makes_no_machine_is_refused_with_its_range(name, value):
    with pytest.raises(InputError, match=rf"as they are, {name} = {value} must be ([<>]=.*)$") as refusal:
        ChainUnitMachine.from_ratios(**RATIOS | {name: value})
    limits = re.findall(r"[<>]= ([0-9.]+)", str(refusal.value).rpartition("must be")[2])
    for limit in limits:
        ChainUnitMachine.from_ratios(**RATIOS | {name: float(limit)})


@pytest.mark.parametrize(
    ("name", "value", "limits"),
    [
        ("rho", 0.0, "0.999"),
        ("rho", 1.0, "0.999"),
        ("lam", -1.0, "100"),
        ("mu", 1.0, "0.999"),
        ("zeta", 1.1, "1"),
    ],
)
def test_a_ratio_beyond_its_bounds_is_refused_by_its_name(name, value, limits):
    with pytest.raises(InputError, match=rf"^{name} = {value:g}: must be > 0 and <= {limits} \("):
        ChainUnitMachine.from_ratios(**RATIOS | {name: value})


def test_ratios_of_which_none_alone_is_wrong_are_refused_with_a_begin():
    with pytest.raises(
        InputError, match=r"no other value of one of rho = 0\.6092, .* alone makes a machine; begin with"
    ) as refusal:
        ChainUnitMachine.from_ratios(rho=0.6092, lam=0.3898, mu=0.9872, zeta=0.981)
    begin = dict(re.findall(r"(\w+) = ([0-9.]+)", str(refusal.value).rpartition("begin with")[2]))
    ChainUnitMachine.from_ratios(**{name: float(x) for name, x in begin.items()})


def test_one_text_is_a_list_of_one():
    """And not read letter by letter."""
    machine, turn = ChainUnitMachine(), {"phi": [0.0, 0.5, 1.0]}
    for one, listed in (
        ({"outputs": "tau"}, {"outputs": ["tau"]}),
        ({"outputs": "tau", "by": "crank.m"}, {"outputs": ["tau"], "by": ["crank.m"]}),
        ({"over": "phi", "reduce": {"tau": "rms"}}, {"over": "phi", "reduce": {"tau": ["rms"]}}),
        ({"over": "phi", "reduce": {"tau": Beyond(9.0)}}, {"over": "phi", "reduce": {"tau": [Beyond(9.0)]}}),
    ):
        assert machine.batch(turn, **one, engine="numpy").identical(
            machine.batch(turn, **listed, engine="numpy")
        )
    model = MODELS["DcMotor"]
    with CompiledSimulation(System({"motor": ModelComponent(model, model.Parameters())})) as simulation:
        run = simulation.run(0.01, 0.001, names="motor.w")
    assert set(run.data_vars) == {"motor.w"}


def test_limits_of_a_batch_have_units():
    machine, turn = ChainUnitMachine(), {"phi": np.linspace(0.0, 300.0, 400)}
    for limit, ends in (
        ("0.01 kN m", ("-20 N m", "0.02 kN m")),
        (10.0 * N * UNITS.m, (-20.0 * N * UNITS.m, 20.0)),
    ):
        requests = [Beyond(limit), Histogram(*ends, 4)]
        plain = [Beyond(10.0), Histogram(-20.0, 20.0, 4)]
        counts, others = (
            machine.batch(turn, over="phi", reduce={"tau": some}, engine="numpy")
            for some in (requests, plain)
        )
        assert counts.identical(others) and 0 < int(counts["beyond(tau, 10)"]) < 400


def test_a_dimension_of_one_argument_is_a_coordinate_with_its_unit():
    machine, turn = ChainUnitMachine(), np.linspace(0.0, 360.0, 90)
    phi = xr.DataArray(turn, dims="place", attrs={"units": "deg"})
    states = machine.batch({"phi": phi, "w": 3.0, "r": [0.15, 0.16]}, ["tau"], engine="numpy")
    for name in ("place", "phi"):
        coordinate = states.tau.coords[name]
        np.testing.assert_allclose(coordinate, np.radians(turn))
        assert coordinate.units == "rad" and "motor angle" in coordinate.long_name
    line = states.tau.isel(r=0).plot()[0]
    np.testing.assert_allclose(line.get_xdata(), np.radians(turn))
    assert "[rad]" in line.axes.get_xlabel() and "[N.m]" in line.axes.get_ylabel()
    # a path of two quantities has no natural place, but both as coordinates
    both = {"phi": phi, "w": xr.DataArray(np.linspace(1.0, 2.0, 90), dims="place")}
    path = machine.batch(both, ["tau"], engine="numpy")
    assert "place" not in path.coords and set(path.coords) == {"phi", "w"}
    assert path.tau.plot(x="phi")[0].axes.get_xlabel()
    # the user's own coordinate stays
    own = phi.assign_coords(place=turn)
    np.testing.assert_array_equal(machine.batch({"phi": own}, ["tau"], engine="numpy").place, turn)


def test_a_linear_model_takes_quantities():
    texts = linearize("DcMotor", {"w": "600 rpm"})
    library = linearize("DcMotor", {"w": 600 * RPM})
    np.testing.assert_array_equal(texts.A, library.A)


def test_a_system_takes_them_too():
    chamber, motor = MODELS["ChamberForces"], MODELS["DcMotor"]
    runs = []
    for ratio, w, reference, stop, step in (
        (50.0, 150.0, 120.0, 0.2, 0.002),
        ("50", 150 * UNITS.rad / UNITS.s, 120 * UNITS.rad / UNITS.s, "200 ms", 2 * UNITS.ms),
    ):
        components = {
            "machine": ModelComponent(chamber, chamber.Parameters(ratio=ratio)),
            "motor": ModelComponent(motor, motor.Parameters(w_start=w)),
        }
        system = System(components, shaft_joints("motor", "machine"), start={"motor.w_ref": reference})
        with CompiledSimulation(system, {"motor.w_ref": reference}) as simulation:
            runs.append(simulation.run(stop, step))
    assert runs[0].equals(runs[1]) and runs[0].sizes["time"] == 101
    with pytest.raises(InputError, match=r'motor\.w_ref = "3 kg".*kg is a mass'):
        CompiledSimulation(system, {"motor.w_ref": "3 kg"})
    with CompiledSimulation(system) as simulation, pytest.raises(InputError, match=r'stop = "3 kg"'):
        simulation.run("3 kg", 0.002)


@pytest.mark.parametrize("kind", ["Real", "Integer", "Boolean"])
def test_a_variable_without_a_description_has_no_empty_brackets(kind):
    """Of an FMU of somebody else."""
    with pytest.raises(InputError) as refusal:
        one_number(Variable("drag", "drag", Quantity("1", "", type=kind)), "x")
    assert "()" not in str(refusal.value)
    assert "()" not in complaint("drag", 3.0, "1", "<= 2", True, "")


def test_a_long_profile_has_a_short_repr():
    assert len(repr(Profile(1.0, [(float(k), 0.5, 2.0) for k in range(200)]))) < 500


def batch(outputs=None, by=(), over="phi", reduce=None, out=None, workers=None, **values):
    options = {"by": by, "over": over, "reduce": reduce, "out": out, "workers": workers}
    return ChainUnitMachine().batch({"phi": [0.0, 0.5]} | values, outputs, **options, engine="numpy")


@pytest.mark.parametrize(
    ("call", "line"),
    [
        (lambda: ChainUnitMachine(r=None), "r = None: must be a number in m"),
        (lambda: ChainUnitMachine(r=[0.1, 0.2]), "r = [0.1, 0.2]: must be one number"),
        (lambda: ChainUnitMachine(r=3 * KG), "kg is a mass"),
        (lambda: ChainUnitMachine(r=True), "r = true: must be a number in m"),
        (lambda: ChainUnitMachine(rr=1.0), "no variable 'rr'"),
        (lambda: ChainUnitMachine(3), "parameters = 3: must be a mapping"),
        (lambda: ChainUnitMachine().forces("12 kg"), 'phi = "12 kg": must be a number in rad'),
        (lambda: ChainUnitMachine().forces({"phi": 1.0}), "phi = { phi = 1.0 }: must be a number"),
        (lambda: ChainUnitMachine().forces(0.0, left=30.0), "left = 30.0: must be SideLoads"),
        (lambda: ChainUnitMachine().slack_speed(30.0), "left = 30.0: must be SideLoads"),
        (lambda: ChainUnitMachine().equilibria(3), "feed = 3: must be the Feed of ChamberForces"),
        (lambda: ChainUnitMachine().evaluate(3), "inputs = 3: must be a mapping"),
        (lambda: ChainUnitMachine().batch(3), "values = 3: must be a mapping"),
        (lambda: ChainUnitMachine().batch({"phi": object()}), "must be a number in rad"),
        (lambda: ChainUnitMachine.from_ratios("a", 0.6, 0.6, 0.5), 'rho = "a": must be a pure number'),
        (
            lambda: ChainUnitMachine().slack_speed(highest="3 kg"),
            'highest = "3 kg": must be a number in rad/s',
        ),
        (lambda: ChainUnitMachine().organ_rods("top"), 'side = "top": must be one of left, right'),
        (
            lambda: ChainUnitMachine().organ_rods("left", number="x"),
            'number of rods = "x": must be a whole number >= 2',
        ),
        (
            lambda: ChainUnitMachine().organ_rods("left", number=1),
            "number of rods = 1: must be a whole number >= 2",
        ),
        (
            lambda: ChainUnitMachine().organ_rods("left", number=10**30),
            "number of rods = 1000000000000000000000000000000: must be a whole number >= 2 and <= 10000",
        ),
        (
            lambda: ChainUnitOfChains(number=2.5).simulated,
            "number of rods = 2.5: must be a whole number >= 2",
        ),
        (
            lambda: ChainUnitMachine().energy_per_kg("top", 0.0, 1.0),
            'side = "top": must be one of left, right',
        ),
        (lambda: ChainUnitMachine().forces(np.zeros(3), np.zeros(4)), "shapes do not fit: phi (3,), w (4,)"),
        (
            lambda: ChainUnitMachine().evaluate({"phi": np.zeros(3), "w": np.zeros(4)}),
            "shapes do not fit: phi (3,)",
        ),
        (lambda: ChainUnitMachine().chamber(np.zeros(3), np.zeros(4)), "shapes do not fit: w (4,), psi (3,)"),
        (
            lambda: ChainUnitMachine().forces(np.zeros(3), left=SideLoads(material_mass=np.zeros(4))),
            "shapes do not fit: phi (3,), left.material_mass (4,)",
        ),
        (lambda: ChainUnitMachine().forces(["1 deg", "2 kg"]), 'phi = "2 kg": must be a number in rad'),
        (lambda: batch(reduce=["tau"]), 'reduce = ["tau"]: must be a mapping such as {"tau": ["peak"]}'),
        (lambda: batch(reduce={"tau": 3}), "tau: no reduction 3; there are min"),
        (lambda: batch(reduce={"tau": [["rms"]]}), 'tau: no reduction ["rms"]; there are min'),
        (lambda: batch(reduce={"tau": Beyond("3 kg")}), 'Beyond: limit = "3 kg": must be a number in N m'),
        (
            lambda: batch(reduce={"tau": Beyond("-3 N m")}),
            "Beyond: limit = -3.0: must be a finite number >= 0",
        ),
        (
            lambda: batch(reduce={"tau": Histogram("3 N m", "1 N m", 4)}),
            "low = 3.0, high = 1.0: must be finite",
        ),
        (lambda: batch(reduce={"tau": Beyond(None)}), "Beyond: limit = None: must be a number in N m"),
        (lambda: Histogram(1.0, 2.0, "4"), 'Histogram: bins = "4": must be a whole number'),
        (
            lambda: batch(over=["phi"], reduce={"tau": "rms"}),
            'over = ["phi"]: must be the name of a dimension',
        ),
        (lambda: batch(outputs=3), "outputs = 3: must be a text, or a list of texts"),
        (lambda: batch(outputs=["tau"], by=[3]), "by = 3: must be a text, or a list of texts"),
        (lambda: batch(outputs="tau", workers="x"), 'workers = "x": must be a number of threads'),
        (lambda: batch(outputs="tau", out=3), "out = 3: must be the result of an earlier call"),
        (
            lambda: batch(w=xr.DataArray([1.0], dims="x", attrs={"units": "kg"})),
            "w in kg: must be a number in rad/s",
        ),
        (lambda: MODELS["DcMotr"], '"DcMotr": no such model; was "DcMotor" meant? there are'),
        (lambda: batch(w=xr.DataArray(["1 rpm", "2 kg"], dims="x")), 'w = "2 kg": must be a number in rad/s'),
        (
            lambda: batch(w=xr.DataArray(np.array([None, 1.0], object), dims="x")),
            "w = [None, 1.0]: must be a number",
        ),
        (
            lambda: System({}, ("motor.flange", "machine.flange")),
            'joints = "motor.flange": must be a list of pairs',
        ),
        (
            lambda: Study().export("x.fmu", platforms="linux"),
            "platforms = linux: no such platform; there are linux64",
        ),
        (lambda: CrankRocker.for_swing("17 kg", 0.6), "kg is a mass"),
        (lambda: Study(machine={"r": 3 * KG}), 'machine.r = "3.0 kg": must be a number in m'),
        (lambda: Study(machine={"r": object()}), "machine.r = <object"),
        (lambda: Study().with_values(3), "values = 3: must be a mapping"),
        (lambda: Study.from_file(3), "path = 3: must be the path of a study file"),
        (lambda: Study.from_text(3), "text = 3: must be a text in TOML"),
        (lambda: linearize("DcMotor", 3), "at = 3: must be a text, or a mapping"),
        (lambda: linkage(3), "file = 3: must be the path of a linkage file"),
        (lambda: linkage("x.toml", 3), "speed = 3: must be a text with a unit"),
        (lambda: Study().compare(3), "other = 3: must be a study"),
        (lambda: Study().export(3), "file = 3: must be the path of a file"),
        (lambda: Study().export("mine.txt"), 'file = "mine.txt": must end in .fmu'),
        (lambda: Study().export_ssp("mine.fmu"), 'file = "mine.fmu": must end in .ssp'),
        (lambda: Study().live("mine"), 'file = "mine": must end in .html'),
        (lambda: Study().run(3), "folder = 3: must be the path of a folder"),
        (lambda: Study().run(progress=3), "progress = 3: must be a function"),
        (lambda: Study().export("x.fmu", progress=3), "progress = 3: must be a function"),
        (lambda: ChainUnitMachine(r=[1, 2] * MM), 'millimeter": must be one number'),
        (lambda: ChainUnitMachine().evaluate(3 * KG), 'inputs = "3 kilogram": must be a mapping'),
        (lambda: batch(outputs=3 * KG), 'outputs = "3 kilogram": must be a text, or a list of texts'),
        (lambda: batch(outputs=np.array(3)), "outputs = 3: must be a text, or a list of texts"),
        (lambda: Study(title=np.longdouble(3)), "title = 3.0: must be a text"),
        (lambda: Study(machine={"r": np.clongdouble(3)}), "machine.r = (3+0j): must be a number in m"),
        (lambda: linearize(3), "of = 3: must be a study, a study file"),
        (lambda: linearize(""), ": no such model; there are"),
        (lambda: linearize("DcMotor", config=3), "config = 3: must be the path of a study file"),
        (lambda: Study().export("x.fmu", fmi=np.ones(2)), "fmi = [1.0, 1.0]: must be 2 or 3"),
        (lambda: Study().export("x.fmu", names=np.ones(2)), "names = [1.0, 1.0]: must be one of structured"),
        (lambda: Study().export("x.fmu", backend=np.ones(2)), "backend = [1.0, 1.0]: must be one of native"),
        (
            lambda: evaluate("DcMotor", {}),
            'model = "DcMotor": must be a model, such as MODELS["DcMotor"] of chainunit.models',
        ),
        (
            lambda: ChainUnitMachine().batch({}, engine=np.ones(2)),
            "engine = [1.0, 1.0]: must be one of native",
        ),
        (lambda: Machine("KnifeDrive"), 'model = "KnifeDrive": must be a machine'),
        (lambda: CrankRocker("3 kg", 1.0, 1.0, 1.0), 'r = "3 kg": must be a number in m'),
        (lambda: Study(event=[]).run(scheduler=3), "scheduler = 3: is for random overloads"),
        (lambda: check_scheduler(3), "scheduler = 3: must be the address of a Dask scheduler"),
        (lambda: Named({"a": 1})[[1]], "[1]: is no name; there are a"),
        (lambda: System(3), "components = 3: must be a mapping of names to components"),
        (lambda: System({"motor": 3}), "components.motor = 3: must be a ModelComponent"),
        (lambda: System({}, 3), "joints = 3: must be a list of pairs"),
        (lambda: System({}, start=3), "start = 3: must be a mapping of full names"),
        (lambda: System(MOTOR, start={"motor.w_ref": None}), "motor.w_ref = None: must be a number in rad/s"),
        (lambda: System(MOTOR, start={"motor.w_ref": [1.0]}), "motor.w_ref = [1.0]: must be one number"),
        (lambda: ModelComponent(DC_MOTOR, 3), "parameters = 3: must be the Parameters of DcMotor"),
        (
            lambda: ModelComponent(DC_MOTOR, DC_MOTOR.Parameters(w_start=[1.0])),
            "w_start = [1.0]: must be one number",
        ),
        (lambda: CompiledSimulation(System(MOTOR), 3), "signals = 3: must be a mapping of full names"),
        (
            lambda: CompiledSimulation(System(MOTOR), {"motor.w_ref": [1.0]}),
            "motor.w_ref = [1.0]: must be one number",
        ),
        (lambda: Profile("3 kg"), 'start = "3 kg": must be a pure number'),
        (lambda: Profile(0.0, [1.0]), "changes = [1.0]: must be a list of (begin, duration, value after it)"),
        (lambda: Profile(0.0, [("1 kg", 1.0, 2.0)]), 'begin = "1 kg": must be a number in s'),
        (lambda: monolithic(System(MOTOR), {}, 3.0), "times = 3.0: must be a list of times"),
    ],
)
def test_a_wrong_type_is_refused_in_one_line(call, line):
    with pytest.raises(InputError) as refusal:
        call()
    assert line in str(refusal.value) and "\n" not in str(refusal.value)
