"""Numbers from scripts: texts with units and quantities of pint are taken where numbers are; other types are refused
in one line."""

from __future__ import annotations

import numpy as np
import pint
import pytest
import xarray as xr

from chainunit import ChainUnitMachine, InputError, SideLoads, Study, linearize, linkage
from chainunit.machines.crank_rocker import CrankRocker
from chainunit.machines.knife_drive import KnifeDrive
from chainunit.machines.machine import Machine
from chainunit.models import MODELS
from chainunit.system import CompiledSimulation, ModelComponent, System, shaft_joints

UNITS = pint.UnitRegistry()
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
    ],
)
def test_a_wrong_type_is_refused_in_one_line(call, line):
    with pytest.raises(InputError) as refusal:
        call()
    assert line in str(refusal.value) and "\n" not in str(refusal.value)
