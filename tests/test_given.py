"""What a study was given, and where it is from."""

from __future__ import annotations

import pytest

from chainunit.study.choice import choose
from chainunit.study.config import parse
from chainunit.study.parts import example

KNIFE = example("knife")


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
