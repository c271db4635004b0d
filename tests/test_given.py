"""What a study was given, and where it is from."""

from __future__ import annotations

import pytest
from test_foreign_machine import MACHINE, SCRIPT
from test_foreign_machine import STUDY as PUMP
from test_foreign_system import build

from chainunit.study.choice import choose
from chainunit.study.config import load, parse
from chainunit.study.parts import example
from chainunit.study.remarks import conclude
from chainunit.study.result import as_dict
from chainunit.study.statics import statics
from chainunit.study.study import Study

KNIFE = example("knife")


def study_of(config, folder):
    """The study before anything of it is run."""
    chosen = choose(config, folder, lambda *_: None)
    study = Study(config, chosen.drive, statics(config, chosen.drive), chosen.tuning, chosen.sizing)
    conclude(study)
    return study


def drive_of(study, folder):
    return choose(study, folder, lambda *_: None).drive


def test_the_motor_is_shown_as_it_is_and_turns_with_gear_and_flywheel(tmp_path):
    """Its FMU has all inertia on its shaft."""
    study = parse(KNIFE.replace("[gear]\n", "[gear]\nJ = 0.003\n"))
    assert study.gear.J == 0.003 and study.flywheel.J > 0.0
    drive, plate = drive_of(study, tmp_path), study.plate.model()[1].rotor
    assert (drive.parameters.rotor.J, drive.parameters.rotor.d) == (plate.J, plate.d)
    whole = plate.J + 0.003 + study.flywheel.J
    assert drive.fmu_parameters.rotor.J == drive.rotor_inertia == pytest.approx(whole, rel=1e-12)
    assert drive.fmu_parameters.rotor.d > plate.d
    assert drive.graph.components["motor"].start["rotor.J"] == pytest.approx(whole, rel=1e-12)


def test_values_of_a_motor_of_the_catalogue_are_the_catalogues(tmp_path):
    origin = study_of(parse(KNIFE), tmp_path).origin
    assert origin("motor.rotor.J") == origin("motor.stator.R") == origin("machine.ratio") == "catalogue"
    assert origin("machine.r") == "file" and origin("motor.ambient.T") == "declared"
    soft = KNIFE.replace("[system]", 'start = "inverter"\n[starter.inverter]\nramp = 2\n[system]')
    soft = soft.replace("[gear]\n", "[gear]\nratio = 25\n")
    origin = study_of(parse(soft), tmp_path).origin
    assert origin("machine.ratio") == origin("motor.inverter.on") == "file"
    assert origin("motor.inverter.slip") == "catalogue"
    # of the example, where the file leaves the system out
    origin = study_of(parse("[system]\nmachine = 'KnifeDrive'\n[run]\ncrank_speed = 4"), tmp_path).origin
    assert origin("motor.rotor.J") == "catalogue"
    assert origin("machine.r") == origin("flywheel.J") == "example" and origin("run.crank_speed") == "file"


def test_what_no_example_gives_is_at_its_declared_start_value(tmp_path):
    study = study_of(parse("[run]\ncrank_speed = 2"), tmp_path)
    assert study.origin("machine.r") == study.origin("motor.rotor.J") == "example"
    assert (
        study.origin("event.jam_left.rise") == "declared"
        and study.origin("event.jam_left.force") == "example"
    )
    assert study.origin("motor.speed_control.kp") == "tuned"
    (note,) = (str(each) for each in study.notes if each.kind == "assumed")
    assert "the packaged example's" in note
    (packaged,) = (str(each) for each in study_of(load(), tmp_path).notes if each.kind == "assumed")
    assert "the papers print none" in packaged
    # of a machine of somebody else there is no example
    build(tmp_path, script=SCRIPT)
    study = study_of(parse(PUMP + MACHINE, str(tmp_path / "x.toml")), tmp_path)
    assert study.origin("machine.throw") == study.origin("motor.rotor.J") == "declared"
    assert study.origin("machine.piston.mass") == "file"
    (note,) = (str(each) for each in study.notes if each.kind == "assumed")
    assert "example" not in note and "An eccentric pump" in note
    assert "machine.throw" not in as_dict(study)["origins"]
