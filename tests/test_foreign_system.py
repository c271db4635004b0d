"""FMUs of somebody else in a system: a motor with the terminals' variables alone, by their names or by others."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
import xarray as xr
from command import chainunit
from systems import component, pair
from test_foreign import changed

from chainunit import InputError, RunError
from chainunit.core.model import Terminal
from chainunit.drives.dc_motor import DcMotor
from chainunit.drives.motor import FOREIGN
from chainunit.reading.result_entries import ResultEntries
from chainunit.study import config, run
from chainunit.study.choice import choose, drive_of
from chainunit.study.drive import Drive
from chainunit.study.drive_fmus import export_drive, with_files
from chainunit.study.readings import crank_motion, crank_torque, largest_torque, pull_out_torque
from chainunit.study.rig import Rig
from chainunit.study.verdict import RESIDUAL
from chainunit.system import (
    CoSimulation,
    ModelExchange,
    Profile,
    System,
    certify,
    fmu_component,
    foreign_component,
    monolithic,
    rigid,
    shaft_joints,
)
from chainunit.system.graph import FmuComponent

pytestmark = pytest.mark.slow

SCRIPT = Path(__file__).parent / "foreign_motor.py"
OTHER = MappingProxyType({"w": "rotor_speed", "phi": "rotor_angle", "load.J": "inertia_behind"})
SIGNALS = {"motor.w_ref": Profile(0.0, ((0.0, 0.2, 150.0),))}
RATIO = 50.0


def build(folder, names=MappingProxyType({}), left_out=(), script=SCRIPT, **options):
    """The FMU, by pythonfmu in a process of its own; `names` are its own names of variables."""
    text = script.read_text().replace("NAMES = {}", f"NAMES = {dict(names)!r}")
    name = re.search(r"class (\w+)", text)[1]
    script = folder / f"{name}.py"
    script.write_text(text.replace("LEFT_OUT = ()", f"LEFT_OUT = {tuple(left_out)!r}"))
    given = {"canGetAndSetFMUstate": "true", "canSerializeFMUstate": "true"} | options
    code = (
        "from pythonfmu import FmuBuilder\n"
        f"FmuBuilder.build_FMU({str(script)!r}, {str(script.with_suffix('.fmu'))!r}, **{given!r})\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    return script.with_suffix(".fmu")


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return build(tmp_path_factory.mktemp("foreign"))


@pytest.fixture(scope="module")
def machine(fmus):
    return component("ChamberForces", fmus["ChamberForces"], {"ratio": RATIO})


def driven(machine, motor):
    return System({"machine": machine, "motor": motor}, shaft_joints("motor", "machine"))


def test_it_has_the_terminals_variables_alone(file):
    motor = foreign_component(file, "motor")
    # and a parameter
    assert set(motor.connectors) - {"drag"} == {
        "phi",
        "w",
        "a",
        "tau",
        "w_ref",
        *motor.terminals["load"].members.values(),
    }
    assert {name: terminal.kind for name, terminal in motor.terminals.items()} == {
        "flange": "org.chainunit.flange",
        "load": "org.chainunit.load",
    }
    # it declares no units: they are those of the terminals
    assert motor.connectors["w"].unit == "rad/s" and motor.connectors["load.J"].unit == "kg.m2"


def test_a_file_that_changes_between_two_runs_is_read_again(file, tmp_path):
    (tmp_path / "ForeignMotor.fmu").write_bytes(file.read_bytes())
    study = tmp_path / "study.toml"
    study.write_text('[system]\nmotor = "ForeignMotor.fmu"\n')
    read = config.load(study)
    assert drive_of(read).foreign is not None
    (tmp_path / "ForeignMotor.fmu").unlink()
    with pytest.raises(InputError, match="no such FMU"):
        drive_of(read)


def test_it_runs_as_our_motor_of_the_same_parameters(file, machine, fmus):
    """Both couplings are of second order; of each other they are no farther than their integrators."""
    ours = pair(
        "ChamberForces",
        "DcMotor",
        {"machine": machine.file, "motor": fmus["DcMotor"]},
        {"machine.ratio": RATIO},
    )
    exact = monolithic(ours, SIGNALS, np.arange(0.0, 0.4 + 1e-9, 0.004))
    foreign = driven(machine, foreign_component(file, "motor"))
    assert foreign.connections == ours.connections
    errors = []
    for step in (0.004, 0.002):
        runs = []
        for system in (foreign, ours):
            with CoSimulation(system, SIGNALS) as simulation:
                runs.append(simulation.run(0.4, step))
        every = round(0.004 / step)
        for name in ("motor.w", "machine.tau", "motor.tau", "motor.a"):
            size = np.max(np.abs(exact[name].values))
            assert np.max(np.abs(runs[0][name].values - runs[1][name].values)) < 1e-7 * size, name
        errors.append(
            [
                np.max(np.abs(runs[0][name].values[::every] - exact[name].values))
                / np.ptp(exact[name].values)
                for name in ("motor.w", "machine.tau")
            ]
        )
        # it does not count the energy that it gives: that is the integral of its torque
        ((_, share),) = certify(runs[0], foreign).values()
        assert share < 5e-3 * (step / 0.004) ** 2
        assert runs[0]["motor.w"].attrs["units"] == "rad/s"
    assert np.all(np.abs(np.log2(np.array(errors[0]) / errors[1]) - 2.0) < 0.3), errors


def test_other_names_are_told_by_a_mapping(file, machine, tmp_path):
    other = build(tmp_path, OTHER)
    with pytest.raises(
        InputError, match=r"has no variable phi; a motor needs the output phi in rad, or a name for it"
    ):
        foreign_component(other, "motor")
    with pytest.raises(InputError, match=r"has no variable speed, which was given for w"):
        foreign_component(other, "motor", {"w": "speed"})
    runs = []
    for motor in (foreign_component(file, "motor"), foreign_component(other, "motor", OTHER)):
        with CoSimulation(driven(machine, motor), SIGNALS) as simulation:
            runs.append(simulation.run(0.05, 0.001))
    assert set(runs[0]) == set(runs[1])
    for name in runs[0]:
        np.testing.assert_array_equal(runs[0][name].values, runs[1][name].values, err_msg=name)


def units(of, unit, base='rad="1" s="-1"'):
    """A model description in which a variable has a unit."""

    def add(text):
        definition = f'<UnitDefinitions><Unit name="{unit}"><BaseUnit {base}/></Unit></UnitDefinitions>'
        text = text.replace("<LogCategories>", f"{definition}<LogCategories>")
        return re.sub(rf'(name="{re.escape(of)}"[^>]*>\s*<Real)', rf'\1 unit="{unit}"', text)

    return add


@pytest.mark.parametrize(
    "change, said",
    [
        (
            units("w", "rpm", 'rad="1" s="-1" factor="0.10471975511965977"'),
            "w is in rpm; must be in rad/s to be joined",
        ),
        (units("load.J", "g.m2", 'kg="1" m="2" factor="0.001"'), r"load\.J is in g\.m2; must be in kg\.m2"),
        (
            lambda text: text.replace('name="w"', 'name="n"'),
            "has no variable w; a motor needs the output w in rad/s",
        ),
        (
            lambda text: text.replace('name="load.tau_bias"', 'name="load.torque"'),
            r"has no variable load\.tau_bias; a motor needs the input load\.tau_bias in N\.m",
        ),
    ],
)
def test_what_does_not_fit_is_refused_in_a_line(change, said, file, tmp_path):
    with pytest.raises(InputError, match=rf"x\.fmu: .*{said}") as refused:
        foreign_component(changed(file, tmp_path / "x.fmu", description=change), "motor")
    assert "\n" not in str(refused.value)


def test_a_name_that_the_fmu_uses_for_another_variable_is_refused(file):
    """Else one of two variables of one name would be taken, in silence."""
    with pytest.raises(
        InputError, match=r"has a variable a of its own, beside w, which was given for a; leave"
    ):
        foreign_component(file, "motor", {"a": "w"})
    assert foreign_component(file, "motor", {"a": "w", "w": "a"}).names == {"a": "w", "w": "a"}


def test_a_unit_that_is_ours_by_another_name_fits(file, machine, tmp_path):
    other = changed(file, tmp_path / "x.fmu", description=units("w", "radians_per_second"))
    assert driven(machine, foreign_component(other, "motor")).connections


def test_who_stands_on_the_wrong_side_is_refused(file, fmus):
    with pytest.raises(InputError, match=r"phi is of the kind output; a machine needs the input phi in rad"):
        foreign_component(file, "machine")
    with pytest.raises(InputError, match=r"phi is of the kind input; a motor needs the output phi in rad"):
        foreign_component(fmus["ChamberForces"], "motor")


def test_our_own_fmus_are_known_by_their_variables(fmus, native_fmus):
    """Without declared terminals as with those that an FMU declares: the terminals are those of the model."""
    for name, (flanges, ports) in {
        "ChamberForces": (["flange"], ["load"]),
        "DcMotor": (["flange"], ["load"]),
        "CardanDriveline": (["driven", "flange"], ["load", "machine"]),
    }.items():
        read, model = fmu_component(fmus[name]), component(name)
        for terminal in (*flanges, *ports):
            assert dict(read.terminals[terminal].members) == dict(model.terminals[terminal].members), name
        assert {n: c.causality for n, c in read.connectors.items()} == {
            n: c.causality for n, c in model.connectors.items()
        }
        assert {n: c.dimension for n, c in read.connectors.items()} == {
            n: c.dimension for n, c in model.connectors.items()
        }


def test_terminals_that_an_fmu_declares_are_used(file, tmp_path):
    declared = """<?xml version="1.0"?>
<fmiTerminalsAndIcons fmiVersion="3.0"><Terminals>
  <Terminal name="flange" terminalKind="org.chainunit.flange" matchingRule="plug">
    <TerminalMemberVariable memberName="phi" variableName="phi" variableKind="signal"/>
    <TerminalMemberVariable memberName="w" variableName="w" variableKind="signal"/>
  </Terminal>
  <Terminal name="shaft" terminalKind="com.example.shaft" matchingRule="plug"/>
</Terminals></fmiTerminalsAndIcons>"""
    extra = [("terminalsAndIcons/terminalsAndIcons.xml", declared)]
    read = fmu_component(changed(file, tmp_path / "x.fmu", extra=extra))
    assert {name: dict(t.members) for name, t in read.terminals.items()} == {
        "flange": {"phi": "phi", "w": "w"}
    }


def test_a_machine_of_somebody_else(fmus, file):
    """Our machine as if it were foreign: by its file alone."""
    machine = foreign_component(fmus["ChamberForces"], "machine")
    system = driven(machine, foreign_component(file, "motor")).with_values({"machine.ratio": RATIO})
    ours = driven(
        component("ChamberForces", fmus["ChamberForces"], {"ratio": RATIO}), foreign_component(file, "motor")
    )
    runs = []
    for each in (system, ours):
        with CoSimulation(each, SIGNALS) as simulation:
            runs.append(simulation.run(0.05, 0.001))
    np.testing.assert_array_equal(runs[0]["motor.w"].values, runs[1]["motor.w"].values)


def test_a_machine_that_counts_no_energies_has_the_certificate_of_the_shaft(machine, file):
    """Its own torque against that of the motor: what the exchange of values itself loses."""
    system = driven(machine, foreign_component(file, "motor"))
    with CoSimulation(system, SIGNALS) as simulation:
        run = simulation.run(0.2, 0.002)
    bare = run.drop_vars(["machine.kinetic_energy"])
    ((_, share),) = certify(bare, system).values()
    assert share < 1e-12
    wrong = bare.assign({"motor.tau": 1.01 * bare["motor.tau"]})
    ((_, share),) = certify(wrong, system).values()
    assert share == pytest.approx(0.01, rel=0.2)


# -- a system of terminals


def test_units_that_differ_are_named(machine, file):
    motor = foreign_component(file, "motor")
    turned = FmuComponent(
        motor.file,
        motor.connectors,
        {**motor.terminals, "flange": Terminal("flange", "org.chainunit.flange", "", {"phi": "w"})},
    )
    with pytest.raises(InputError, match=r"motor\.w in rad/s cannot be connected to machine\.phi in rad"):
        System({"machine": machine, "motor": turned}, [("motor.flange", "machine.flange")])


def test_what_needs_the_equations_says_so(machine, file):
    system = driven(machine, foreign_component(file, "motor"))
    with pytest.raises(
        InputError, match=r"motor \(ForeignMotor\.fmu\): is an FMU, whose equations are not known"
    ):
        monolithic(system, SIGNALS, [0.0, 0.1])
    with pytest.raises(InputError, match=r"Co-Simulation alone; must be FMI 2\.0 for Model Exchange"):
        ModelExchange(System({"motor": foreign_component(file, "motor")}), SIGNALS)


# -- in a drive


def test_a_drive_with_a_motor_of_somebody_else(file, tmp_path):
    """What a study does: from rest to steady running, then a jam from there."""
    given = config.load()
    drive = Drive(FOREIGN, None, given.machine, foreign=foreign_component(file, "motor"))
    assert drive.follows
    fmus, made = export_drive(drive, tmp_path, "python")
    assert set(made) == {"machine"} and fmus["motor"] == file
    speed = given.run.crank_speed
    with CoSimulation(
        with_files(drive, fmus), {**drive.loads(given.feed), **drive.reference(speed, 0.3)}
    ) as simulation:
        start = simulation.run(1.0, 0.002)
        simulation.save()
        jam = {"machine.left.processing_force": Profile(100.0, ((1.0, 0.02, 2000.0),))}
        runs = []
        for more in ({}, jam):
            simulation.restore()
            simulation.signals = {**drive.loads(given.feed), **drive.reference(speed), **more}
            runs.append(simulation.run(1.2, 0.002))
    _, turning = crank_motion(drive, start)
    assert turning[-1] == pytest.approx(speed, rel=0.02)
    plain, jammed = (np.max(np.abs(crank_torque(drive, run))) for run in runs)
    assert jammed > 1.5 * plain
    assert certify(runs[1], drive.graph)["machine"][1] < 1e-2
    for unknown in (
        lambda: drive.rotor_inertia,
        lambda: largest_torque(drive, start, 300.0),
        lambda: pull_out_torque(drive, start, 300.0),
    ):
        with pytest.raises(
            InputError, match=r"ForeignMotor\.fmu: .* is not known, as the motor is an FMU of somebody else"
        ):
            unknown()


STUDY = """
[run]
ramp = 0.3
turns = 1
settle_turns = 1
step = 0.002
crank_speed = 6
[machine]
ratio = 25
[[event]]
type = "jam"
side = "left"
"""
OWN_MOTOR = "[motor]\n" + "".join(
    f"{name} = {value!r}\n"
    for name, value in DcMotor.parameter_layout.by_name(DcMotor.Parameters()).items()
    if "." in name
)
OTHER_NAMES = 'motor_names = { w = "rotor_speed", phi = "rotor_angle", load.J = "inertia_behind" }\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Studies beside the FMU: with the FMU, and with our motor of the same parameters."""
    folder = tmp_path_factory.mktemp("studies") / "mine"
    folder.mkdir()
    build(folder, OTHER)
    system = f'[system]\nmotor = "ForeignMotor.fmu"\n{OTHER_NAMES}'
    (folder / "foreign.toml").write_text(f"{STUDY}{system}")
    (folder / "own.toml").write_text(f"{STUDY}{OWN_MOTOR}")
    for name in ("foreign", "own"):
        # from elsewhere: the path of the FMU is relative to the study file
        done = chainunit("study", f"mine/{name}.toml", "-o", name, cwd=folder.parent)
        assert done.returncode == 0, done.stderr
        (folder / f"{name}.txt").write_text(done.stdout)
    return folder


def test_a_study_with_a_motor_of_somebody_else(folder):
    """Its answers are those of our motor of the same parameters; what only that tells is null, shown as a dash."""
    foreign, own = (
        ResultEntries(json.loads((folder.parent / name / "result.json").read_text()))
        for name in ("foreign", "own")
    )
    assert foreign["status"] == own["status"] == "complete"
    assert set(foreign["answers"]) == set(own["answers"]) == {"steady", "jam_left"}
    absent = set()
    for name, answers in own["answers"].items():
        for quantity, answer in answers.items():
            other = foreign["answers"][name][quantity]
            assert other["unit"] == answer["unit"]
            if quantity == "energy_gap" and name == "steady":
                # the rotor of an FMU does not tell its energy
                assert 0.0 <= other["value"] < 1e-3 and 0.0 <= answer["value"] < 1e-3
            elif answer["value"] is not None and other["value"] is None:
                absent.add(quantity)
            elif answer["value"] is not None:
                assert other["value"] == pytest.approx(answer["value"], rel=1e-5, abs=1e-6), (name, quantity)
    assert absent == {
        *("motor_torque_peak", "motor_torque_rms", "supply_power_mean", "current_peak", "current_rms"),
        *("winding_temperature", "shaft_share", "torque_reserve"),
    }
    assert set(foreign["certificate"]) == {"start_up", "jam_left"}
    for shares in foreign["certificate"].values():
        assert shares["energy_residual_share"]["value"] < 1e-2
    assert foreign["motor"] == {"kind": "ForeignMotor.fmu", "title": "ForeignMotor.fmu"}
    assert "its reserve of torque is not known" in foreign["verdict"]["motor"]["text"]
    for text in ((folder / "foreign.txt").read_text(), (folder.parent / "foreign/result.md").read_text()):
        for title in ("motor air-gap torque, peak", "motor current, RMS", "reserve of torque"):
            (cells,) = (
                [cell.strip() for cell in re.split(r"[│|]", line)[2:-1]]
                for line in text.splitlines()
                if re.match(rf"[│|] {title}", line)
            )
            assert cells == ["-", "-"], title


def test_its_speeds_and_torques_are_those_of_ours(folder):
    runs = [xr.open_datatree(folder.parent / name / "result.nc") for name in ("foreign", "own")]
    assert set(runs[0].children) == set(runs[1].children) >= {"start_up", "jam_left"}
    for name, ours in runs[1].children.items():
        for quantity in ("motor.w", "machine.tau"):
            error = np.max(np.abs(runs[0][name][quantity].values - ours[quantity].values))
            assert error < 1e-6 * np.max(np.abs(ours[quantity].values)), (name, quantity)


@pytest.mark.parametrize(
    "change, said",
    [
        (("ForeignMotor.fmu", "none.fmu"), r"system\.motor: mine.none\.fmu: no such FMU"),
        (
            (OTHER_NAMES, ""),
            r"system\.motor: .*ForeignMotor\.fmu: has no variable phi; a motor needs the output phi",
        ),
        (("rotor_speed", "speed"), r"system\.motor: .*has no variable speed, which was given for w"),
        (
            ('w = "rotor_speed"', 'omega = "x"'),
            r"system\.motor_names\.omega: unknown key; known here: phi, w, a, tau, ",
        ),
        (("load.J", "load.mass"), r"system\.motor_names\.load\.mass: unknown key; known here: tau_bias, J, "),
        (('"rotor_speed"', "3"), r"system\.motor_names\.w = 3: must be a text"),
        (('"ForeignMotor.fmu"', '""'), r'system\.motor = "": must be a text that is not empty'),
        (('motor = "ForeignMotor.fmu"', ""), r"system.motor_names: are of an FMU of somebody else"),
        (
            ("[run]", "[motor]\nrotor.J = 0.01\n[run]"),
            r'motor: given beside system\.motor = "ForeignMotor\.fmu", .*',
        ),
        (("[run]", "[sizing]\n[run]"), r"sizing: given beside system\.motor = .*; leave out one of the two"),
        (
            ("[run]", "[driveline]\nJ4 = 2\n[run]"),
            r"system\.motor: .*inertia of its rotor is not known; leave",
        ),
        (("[run]", "[flywheel]\nJ = 1\n[run]"), r"system\.motor: .*leave \[flywheel\] out"),
        (
            ("[run]", "[monte_carlo]\nruns = 9\n[run]"),
            r"system\.motor: .*current and torque are not known.*; leave",
        ),
        (("[run]", "[starter]\n[run]"), r"starter: is of a motor of the catalogue"),
    ],
)
def test_a_study_file_that_does_not_fit_is_refused_in_a_line(change, said, folder):
    text = (folder / "foreign.toml").read_text()
    assert change[0] in text
    (folder / "changed.toml").write_text(text.replace(*change))
    done = chainunit("study", "mine/changed.toml", "-o", "foreign", cwd=folder.parent)
    assert done.returncode == 2 and re.search(said, done.stderr), done.stderr
    assert all(line.startswith("chainunit: mine/changed.toml") for line in done.stderr.splitlines())
    # the results of an earlier run are still there
    assert (folder.parent / "foreign" / "result.json").is_file()


@pytest.mark.parametrize(
    "command, said",
    [
        (
            ["study", "--check", "foreign.toml", "-o", "check"],
            r"check: the equations of ForeignMotor\.fmu are not",
        ),
        (
            ["export", "DcMotor", "--config", "foreign.toml"],
            r"the study's motor is ForeignMotor\.fmu, not DcMotor",
        ),
        (
            ["export", "foreign.toml"],
            r"motor \(ForeignMotor\.fmu\): is an FMU, whose equations are not known; only a system of models can be",
        ),
    ],
)
def test_what_needs_a_model_of_the_motor_is_refused(command, said, folder):
    done = chainunit(*command, cwd=folder)
    assert done.returncode == 2 and re.search(said, done.stderr), done.stderr
    assert done.stderr.splitlines()[-1].startswith("chainunit: ")


def test_the_machine_of_such_a_study_can_be_exported(folder):
    done = chainunit("export", "ChamberForces", "--config", "foreign.toml", "--backend", "python", cwd=folder)
    assert done.returncode == 0 and (folder / "ChamberForces.fmu").is_file(), done.stderr


def test_a_motor_without_a_torque_whose_parameters_are_set(folder, tmp_path):
    """The torque of its shaft is that which the machine takes; with another drag it runs as ours with that drag."""
    # a process has one Python module of a name
    script = tmp_path / "script.py"
    script.write_text(SCRIPT.read_text().replace("class ForeignMotor", "class QuietMotor"))
    build(tmp_path, OTHER, ["tau"], script)
    text = (folder / "foreign.toml").read_text().replace(
        "ForeignMotor", "QuietMotor"
    ) + "[coupling]\ntrip_torque = 120\n"
    other = "[system]\nmotor_parameters = { drag = 0.01 }\n"
    given = config.parse(text.replace("[system]\n", other), str(tmp_path / "x.toml"))
    study = run.run_study(given, tmp_path / "out")
    assert study.findings.failure is None and study.runs.answers["jam_left"].coupling_trip_time is not None
    own = (folder / "own.toml").read_text().replace("rotor.d = 0.001", "rotor.d = 0.01")
    assert own != (folder / "own.toml").read_text()
    own = run.run_study(config.parse(f"{own}[coupling]\ntrip_torque = 120\n"), tmp_path / "own")
    for name in ("steady", "jam_left"):
        for measure in ("crank_torque_peak", "speed_least", "coupling_trip_time"):
            value = getattr(own.runs.answers[name], measure)
            assert value is not None or name == "steady"
            assert value is None or getattr(study.runs.answers[name], measure) == pytest.approx(
                value, rel=1e-4
            ), (
                name,
                measure,
            )
    wrong = text.replace("[system]\n", other.replace("drag", "drg"))
    with pytest.raises(InputError, match=r"system\.motor_parameters\.drg: unknown key; was \"drag\" meant"):
        run.run_study(config.parse(wrong, str(tmp_path / "x.toml")), tmp_path / "out")


def test_a_motor_without_an_acceleration_is_the_cause_of_the_missing_energy(folder, tmp_path):
    """A shorter step, which the verdict named, left the same residual."""
    script = tmp_path / "script.py"
    script.write_text(SCRIPT.read_text().replace("class ForeignMotor", "class SteadyMotor"))
    build(tmp_path, OTHER, ["a", "tau"], script)
    text = (folder / "foreign.toml").read_text().replace("ForeignMotor", "SteadyMotor")
    study = run.run_study(config.parse(text, str(tmp_path / "x.toml")), tmp_path / "out")
    (remark,) = [remark for remark in study.findings.warnings if remark.code == "no-acceleration"]
    assert "SteadyMotor.fmu does not give its acceleration" in remark.text
    assert "the energy balance is not kept" in study.findings.verdict.text
    assert (
        "run.step" not in study.findings.verdict.text
        and "give the acceleration a of the motor" in study.findings.verdict.text
    )


def test_a_block_has_no_peaks_of_what_is_not_known(folder):
    """The range of an assumption is told of the torques that there are."""
    text = (folder / "foreign.toml").read_text().replace('type = "jam"\nside = "left"', 'type = "blocked"')
    study = run.run_study(config.parse(text, str(folder / "x.toml")), folder / "block")
    (spread,) = study.runs.spreads.values()
    assert study.findings.failure is None and set(spread.peaks) == {"crank_torque", "rocker_torque"}


@pytest.mark.parametrize("trip, opens", [(120, True), (400, False)])
def test_a_torque_limiter_behind_it(trip, opens, folder):
    """It opens in the jam or is said not to; the torque at which the motor stalls is not compared."""
    text = (folder / "foreign.toml").read_text() + f"[coupling]\ntrip_torque = {trip}\n"
    study = run.run_study(config.parse(text, str(folder / "x.toml")), folder / "coupling")
    assert study.findings.failure is None
    assert (study.runs.answers["jam_left"].coupling_trip_time is not None) == opens
    told = [remark for remark in study.findings.warnings if remark.code == "coupling-never-opens"]
    assert len(told) == (not opens)
    for remark in told:
        assert set(remark.quantities) == {"trip", "largest", "steady"} and remark.text.endswith("N m.")
    if opens:
        assert study.runs.certificate["jam_left"]["energy_residual_share"] < 1e-2


def test_a_motor_that_saves_no_state_runs_each_event_from_rest(folder, tmp_path):
    """Its answers are those of the motor that saves its state, also where an assumption needs further runs."""
    script = tmp_path / "script.py"
    script.write_text(SCRIPT.read_text().replace("class ForeignMotor", "class ForgetfulMotor"))
    build(tmp_path, OTHER, script=script, canGetAndSetFMUstate="false", canSerializeFMUstate="false")
    block = '\n[[event]]\ntype = "blocked"\n'
    text = (folder / "foreign.toml").read_text() + block
    saving = run.run_study(config.parse(text, str(folder / "x.toml")), tmp_path / "saving")
    text = text.replace("ForeignMotor", "ForgetfulMotor")
    study = run.run_study(config.parse(text, str(tmp_path / "x.toml")), tmp_path / "forgetful")
    assert study.findings.failure is None and list(study.runs.answers) == ["steady", "jam_left", "blocked"]
    assert (
        study.runs.answers == saving.runs.answers
        and study.runs.spreads == saving.runs.spreads
        and study.runs.spreads
    )
    for name, rows in saving.runs.series.items():
        assert study.runs.series[name].drop_attrs().equals(rows.drop_attrs())
    (note,) = [note for note in study.findings.notes if note.code == "state-not-saved"]
    assert note.runs == ("jam_left", "blocked") and "Each event was run from rest" in note.text
    assert not [note for note in saving.findings.notes if note.code == "state-not-saved"]


def test_a_reference_in_another_unit_is_refused(file, tmp_path):
    other = changed(
        file, tmp_path / "x.fmu", description=units("w_ref", "rpm", 'rad="1" s="-1" factor="0.1"')
    )
    with pytest.raises(InputError, match=r"x\.fmu: w_ref is in rpm; must be in rad/s to be joined"):
        foreign_component(other, "motor")


def test_a_flywheel_sits_behind_a_foreign_motor(file, tmp_path):
    """Its rotor takes none; on the shaft of the machine it is a part of the system."""
    text = f'[system]\nmotor = "{file}"\n[flywheel]\nJ = 2.0\n'
    with pytest.raises(InputError, match=r'takes no flywheel.*, or set flywheel\.place = "machine"'):
        drive_of(config.parse(text))
    read = config.parse(f'{text}place = "machine"\n')
    drive = drive_of(read)
    files, _ = export_drive(drive, tmp_path)
    rig = Rig(read.operation, drive, files)
    assert list(rig.system.components) == ["machine", "flywheel", "motor"]
    with rig.from_rest() as simulation:
        motion = simulation.run(0.3, rig.step)
    turned = motion["flywheel.driven.w"].values
    assert turned[-1] > 0.0
    assert motion["flywheel.kinetic_energy"].values == pytest.approx(turned**2, rel=1e-9)
    assert max(rig.residuals(motion).values()) < RESIDUAL


def test_a_study_that_asks_for_more_is_refused(file):
    def chosen(text):
        choose(config.parse(text + f'[system]\nmotor = "{file}"\n'), file.parent, lambda *said: None)

    with pytest.raises(InputError, match=r"ForeignMotor\.fmu: the inertia of its rotor is not known; leave"):
        chosen(STUDY + "[driveline]\nJ4 = 2\n")
    with pytest.raises(
        InputError, match=r"ForeignMotor\.fmu: has no input tau_ff in N\.m; leave feed_forward out"
    ):
        chosen("feed_forward = true\n" + STUDY)


def test_no_twin_without_a_rotor(file, machine, fmus):
    line = component("CardanDriveline", fmus["CardanDriveline"])
    joints = [
        *shaft_joints("motor", "driveline"),
        *shaft_joints("driveline", "machine", flange="driven", load="machine"),
    ]
    system = System(
        {"machine": machine, "driveline": line, "motor": foreign_component(file, "motor")}, joints
    )
    with pytest.raises(
        InputError, match=r"motor\.rotor\.J: is not known, so that there is no twin with a rigid shaft"
    ):
        rigid(system, "driveline")


def test_an_fmu_that_cannot_save_its_state_begins_again(machine, tmp_path):
    system = driven(machine, foreign_component(build(tmp_path, canGetAndSetFMUstate="false"), "motor"))
    with CoSimulation(system, SIGNALS) as simulation:
        assert simulation.without_states == ["motor"]
        simulation.run(0.05, 0.002)
        simulation.signals = {"motor.w_ref": 60.0}
        simulation.run(0.1, 0.002, guards={"motor.w": 55.0})
        saved = simulation.save()
        simulation.signals = {"motor.w_ref": 20.0}
        first = simulation.run(saved + 0.05, 0.002)
        simulation.signals = {"motor.w_ref": 90.0}
        other = simulation.run(saved + 0.1, 0.002)
        simulation.signals = {"motor.w_ref": 20.0}
        simulation.restore()
        assert simulation.time == saved and simulation.signals == {"motor.w_ref": 20.0}
        again = simulation.run(saved + 0.05, 0.002)
    assert again.equals(first) and float(other["motor.w"][-1]) > float(first["motor.w"][-1]) + 1.0


@pytest.mark.parametrize("alone", ["false", "true"])
def test_a_repeated_run_that_fails_leaves_the_simulation_as_it_was(machine, tmp_path, alone):
    """Time, signals and state, also if the FMU allows one instance alone."""
    flags = {"canGetAndSetFMUstate": "false", "canBeInstantiatedOnlyOncePerProcess": alone}
    system = driven(machine, foreign_component(build(tmp_path, **flags), "motor"))
    is_broken = []

    def fragile(t):
        if is_broken and t > is_broken[0]:
            is_broken.clear()
            raise RunError("the supply is gone")
        return 60.0

    def last_rows(breaks):
        with CoSimulation(system, SIGNALS) as simulation:
            simulation.run(0.05, 0.002)
            simulation.signals = {"motor.w_ref": fragile}
            simulation.run(0.1, 0.002)
            simulation.save()
            simulation.signals = {"motor.w_ref": 20.0}
            simulation.run(0.15, 0.002)
            if breaks:
                is_broken.append(0.07)
                with pytest.raises(RunError, match="the supply is gone"):
                    simulation.restore()
                assert simulation.time == 0.15 and simulation.signals == {"motor.w_ref": 20.0}
            rest = simulation.run(0.2, 0.002)
            simulation.restore()
            assert simulation.time == 0.1
            return rest, simulation.run(0.15, 0.002)

    for rows, unbroken in zip(last_rows(True), last_rows(False), strict=True):
        assert rows.equals(unbroken)


def test_it_carries_nothing_of_ours(file):
    with zipfile.ZipFile(file) as archive:
        assert not any("chainunit" in name for name in archive.namelist())
