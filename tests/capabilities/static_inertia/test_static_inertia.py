"""The RMS torque by a constant inertia: by another derivative of the inertia, and said only where it differs."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from records import like

from chainunit.capabilities.static_inertia import CAPABILITY, StaticInertiaAnalysis, StaticInertiaFindings
from chainunit.machines.api import ChainUnitMachine
from chainunit.machines.knife_drive import KnifeDrive
from chainunit.machines.machine import Machine
from chainunit.report.terminal import plain_line
from chainunit.study.choice import drive_of
from chainunit.study.config import parse
from chainunit.study.cycle import cycle

SPEED = 3.0
MACHINES = {
    "chain unit": (ChainUnitMachine(ratio=7.0), ChainUnitMachine().model.Feed()),
    "knife drive": (Machine(KnifeDrive, ratio=7.0), KnifeDrive.Feed(cut_force=2000.0)),
}


def findings_of(machine, feed, speed=SPEED):
    turn = cycle(machine, speed, feed)
    study = like(statics=SimpleNamespace(normal=turn))
    return StaticInertiaAnalysis.find(study, None), turn


def rms(values):
    return math.sqrt(np.mean(np.square(values)))


@pytest.mark.parametrize("name", MACHINES)
def test_the_torque_by_a_constant_inertia_lacks_the_slope_of_the_inertia(name):
    """The slope is the derivative of the Fourier series of the inertia: a second route."""
    machine, feed = MACHINES[name]
    findings, turn = findings_of(machine, feed)
    inertia = turn.inertia_at(1.0)
    points = len(inertia)
    slope = np.fft.irfft(1j * np.arange(points // 2 + 1) * np.fft.rfft(inertia), points)
    assert findings.static == pytest.approx(rms(turn.crank_torque - 0.5 * slope * SPEED**2), rel=1e-9)
    assert findings.machine == pytest.approx(rms(turn.crank_torque), rel=1e-12)
    assert abs(findings.static / findings.machine - 1.0) > 0.01


@pytest.mark.parametrize("name", MACHINES)
def test_a_machine_that_turns_slowly_has_the_same_torque(name):
    """At rest the inertia takes no torque, and the line is left out."""
    findings, _ = findings_of(*MACHINES[name], speed=1e-3)
    assert findings.static == pytest.approx(findings.machine, rel=1e-5)
    assert said(findings) == []


def said(findings):
    study = like(by_analysis={"static_inertia": findings}, driver_noun="crank")
    blocks = CAPABILITY.answer(study).end
    return [plain_line(block.line) for block in blocks]


def test_it_is_said_beyond_two_percent():
    assert said(StaticInertiaFindings(300.0, 294.1)) == said(StaticInertiaFindings(300.0, 305.9)) == []
    words = "A constant-inertia calculation takes RMS 200 N m instead of 300 N m at the crank."
    assert said(StaticInertiaFindings(300.0, 200.0)) == [words]


@pytest.mark.parametrize(
    ("organ", "sizing", "applies"),
    [("", "[sizing]", True), ("", "", False), ('organ = "chain"', "[sizing]", False)],
)
def test_a_study_has_it_if_it_chooses_the_motor_of_a_machine_with_an_inertia_of_its_angle(
    organ, sizing, applies
):
    drive, plans = drive_of(parse(organ)), parse(f"{organ}\n{sizing}").plans
    assert StaticInertiaAnalysis.applies(drive, plans) == applies
