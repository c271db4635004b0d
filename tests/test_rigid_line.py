"""Whether a rigid model of a drive holds: the ten times of VDI 2149, in data, words and warnings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from records import record_of
from scipy.linalg import eigh

from chainunit.report import shaft
from chainunit.report.terminal import plain_line
from chainunit.study import config
from chainunit.study.choice import choose
from chainunit.study.line.shaft_runs import remark
from chainunit.study.result import as_dict

SOFT = {"c2": 5000.0, "c3": 9000.0, "J4": 3.0}
MACHINES = {
    "crank": '[machine]\nratio = 25\n[driveline]\nplace = "crank"\nc2 = 5000\nc3 = 9000\nJ4 = 3\nd2 = 20\nd3 = 20\n',
    "motor": '[machine]\nratio = 25\n[driveline]\nplace = "motor"\nc2 = 5000\nc3 = 9000\nJ4 = 3\nd2 = 20\nd3 = 20\n',
}


def study_of(place, speed):
    loaded = config.parse(f"{MACHINES[place]}[run]\nstep = 2e-4\ncrank_speed = {speed!r}\n")
    return record_of(loaded, choose(loaded, Path(), lambda *_: None).drive)


def by_hand(study, place):
    """The natural frequency of two inertias on the two shafts in series [rad/s], by eigenvalues of their matrices;
    the machine in its heaviest position."""
    rotor, machine, ratio = (
        study.setup.drive.fmu_parameters.rotor.J,
        float(np.max(study.setup.statics.normal.outputs.J)),
        25.0,
    )
    stiffness = 1.0 / (1.0 / SOFT["c2"] + 1.0 / SOFT["c3"])
    if place == "crank":
        # behind the gear: rotor and machine as they turn there
        inertia = [rotor * ratio**2, SOFT["J4"] + machine * ratio**2]
    else:
        inertia = [rotor, SOFT["J4"] + machine]
    matrix = stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])
    low, high = eigh(matrix, np.diag(inertia), eigvals_only=True)
    assert abs(low) < 1e-9 * high
    return float(np.sqrt(high))


@pytest.mark.parametrize("place", MACHINES)
def test_on_both_sides_of_ten(place):
    found = by_hand(study_of(place, 1.0), place)
    for ratio, holds in ((10.001, True), (9.999, False), (10.0 * (1.0 + 1e-9), True)):
        speed = found / ratio
        study = study_of(place, speed)
        line = study.setup.statics.rigid_line
        assert line.natural_frequency == pytest.approx(found, rel=1e-12)
        assert line.driver_frequency == speed and line.ratio == pytest.approx(ratio, rel=1e-12)
        assert line.holds is holds
        remark(study)
        told = [each for each in study.findings.warnings if each.code == "no-rigid-line"]
        assert len(told) == (not holds)
        for each in told:
            assert each.quantities["ratio"].value == line.ratio and "VDI 2149" in each.text
            assert each.quantities["natural_frequency"].value == line.natural_frequency
            assert "it is rigid in the turn at constant speed and the speed loop." in each.text
        data = as_dict(study)
        assert data["rigid_line"] == {
            "natural_frequency": {"value": line.natural_frequency, "unit": "rad/s", "kind": "frequency"},
            "driver_frequency": {"value": speed, "unit": "rad/s", "kind": "frequency"},
            "ratio": {"value": line.ratio, "unit": "1"},
            "holds": holds,
        }
        shown = shaft._rigid(study.setup, line)
        words = plain_line(shown.line)
        assert shown.severity == ("good" if holds else "partly")
        assert words.startswith(
            f"In steady running a rigid model of the drive {'holds' if holds else 'does not hold'} (VDI 2149"
        )
        assert "the frequency of the crank's turns" in words


def test_a_line_without_stiffness_has_no_ratio():
    loaded = config.parse("")
    study = record_of(loaded, choose(loaded, Path(), lambda *_: None).drive)
    remark(study)
    assert study.setup.statics.rigid_line is None and "rigid_line" not in as_dict(study)
    assert not [each for each in study.findings.warnings if each.code == "no-rigid-line"]
