"""The loads of other trades in `examples/loads`: each torque by hand, and its energy."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from records import record_of
from xarray import Dataset

from chainunit.machines.linkages.file import read_linkage
from chainunit.machines.machine import Machine
from chainunit.study import remarks
from chainunit.study.choice import drive_of
from chainunit.study.config import parse
from chainunit.study.record import StudyFindings

FOLDER = Path(__file__).parents[1] / "examples" / "loads"
TURN = np.linspace(0.0, 2.0 * math.pi, 721)[:-1]


def load(name):
    return Machine(read_linkage(FOLDER / f"{name}.toml"))


def outputs(name, w, **inputs):
    """The outputs over a turn at constant speed [rad/s]."""
    machine = load(name)
    feed = machine.model.feed_layout
    return machine.outputs(TURN, w=w, feed=feed.from_names(inputs))


def torque(name, w, **inputs):
    """The torque that the load takes at constant speed [N m], over a turn."""
    return outputs(name, w, **inputs).tau


def inertia(name):
    return float(np.mean(outputs(name, 0.0).J))


@pytest.mark.parametrize("file", sorted(FOLDER.glob("*.toml")), ids=lambda file: file.stem)
def test_a_load_has_its_power_and_nothing_else(file):
    """The torque times the speed is the power that the load takes: no link stores energy in a steady turn."""
    x = outputs(file.stem, 80.0)
    assert np.allclose(x.power, x.tau * 80.0, rtol=1e-12)
    assert np.allclose(x.dissipated_power, x.tau * 80.0, rtol=1e-9, atol=1e-9)
    assert np.ptp(x.J) == 0.0 and np.min(x.J) > 0.0


def test_a_fan_takes_the_square_of_the_speed():
    w = 1480.0 * math.pi / 30.0
    assert torque("fan", w) == pytest.approx(60.0, rel=1e-12)
    assert torque("fan", 0.5 * w) == pytest.approx(15.0, rel=1e-12)
    assert torque("fan", -w) == pytest.approx(-60.0, rel=1e-12)
    assert torque("fan", w, opening=0.5) == pytest.approx(30.0, rel=1e-12)


def test_a_pump_delivers_from_the_speed_of_its_static_head_on():
    w = 1480.0 * math.pi / 30.0
    assert torque("pump", w) == pytest.approx(95.0, rel=0.01)
    # below it the water churns, at 40 % of the torque of the flow
    assert torque("pump", 0.5 * w) == pytest.approx(0.4 * 95.0 / 4.0, rel=1e-9)
    # halfway between both speeds half of the flow comes
    assert torque("pump", 0.8 * w) == pytest.approx(95.0 * 0.64 * 0.7, rel=1e-9)


def test_a_conveyor_by_din_22101():
    masses, radius = 2.0 * 14.0 + 18.0 + 60.0, 0.25
    friction, lift = 1.8 * 0.022 * 120.0 * 9.81 * masses * radius, 60.0 * 9.0 * 9.81 * radius
    assert torque("conveyor", 6.0) == pytest.approx(friction + lift, rel=1e-4)
    # downhill the friction holds back, and at rest the goods pull
    assert torque("conveyor", -6.0) == pytest.approx(lift - friction, rel=1e-3)
    assert torque("conveyor", 0.0) == pytest.approx(lift, rel=1e-12)
    assert torque("conveyor", 6.0, goods=0.0) == pytest.approx(friction * 46.0 / 106.0, rel=1e-4)
    assert inertia("conveyor") == pytest.approx(masses * 120.0 * radius**2 + 6.0, rel=1e-12)


def test_a_hoist_lowers_with_less_than_it_lifts():
    pull = (3200.0 + 120.0) * 9.81 / 4.0
    assert torque("hoist", 10.0) == pytest.approx(1.06 * pull * 0.2, rel=1e-4)
    assert torque("hoist", -10.0) == pytest.approx(0.94 * pull * 0.2, rel=1e-4)
    assert inertia("hoist") == pytest.approx(1.8 + 3320.0 * 0.05**2, rel=1e-12)
    # lowering, the load gives its power to the motor
    assert np.all(outputs("hoist", -10.0).power < 0.0)


@pytest.mark.parametrize(
    ("name", "gear", "least"),
    [
        # the lift less the friction of DIN 22101
        ("conveyor", 0.95, 9.81 * (60.0 * 9.0 - 1.8 * 0.022 * 120.0 * 106.0) * 0.25),
        ("hoist", 0.95, 0.94 * 3320.0 * 9.81 * 0.2 / 4.0),
        # a gear with less than half of its efficiency is self-locking
        ("hoist", 0.48, None),
        ("hammer_mill", 0.95, None),
    ],
)
def test_a_load_that_turns_its_machine_back_needs_a_backstop(name, gear, least):
    config = parse(
        f"event = []\n[machine]\nlinkage = '{(FOLDER / name).as_posix()}.toml'\n[gear]\nefficiency = {gear}\n"
        "[system]\nmotor = 'IE3 4-pole 22 kW, 180L'\n[run]\ncrank_speed = 6\n"
    )
    study = record_of(config, drive_of(config))
    remarks._on_backward_pull(study.setup, study.findings)
    torques = [remark.quantities["torque"][0] for remark in study.findings.remarks]
    # the friction fades at slow speed
    assert torques == ([] if least is None else [pytest.approx(least, rel=0.05)])


def test_a_spindle_cuts_by_kienzle_while_a_tooth_is_in_the_work():
    h = 0.18
    force = 1700.0 * 4.0 * h * h**-0.25
    x = torque("spindle", 100.0)
    assert np.max(x) == pytest.approx(force * 0.05, rel=1e-9)
    assert np.min(x) == pytest.approx(0.0, abs=1e-9)
    # three teeth, each over 16 % of the turn
    assert np.mean(x) == pytest.approx(force * 0.05 * 0.48, rel=0.01)
    assert torque("spindle", 100.0, cutting=0.0) == pytest.approx(0.0, abs=1e-12)


def test_a_hammer_mill_is_held_by_its_material():
    w = 1480.0 * math.pi / 30.0
    assert torque("hammer_mill", w) == pytest.approx(74.0, rel=1e-4)
    assert torque("hammer_mill", 0.0) == pytest.approx(0.0, abs=1e-12)
    assert torque("hammer_mill", -w) == pytest.approx(-74.0, rel=1e-4)


def test_an_inverter_that_hunts_by_its_slip_compensation_is_told():
    """The fan takes an even torque, about which the torque of the motor swings by 233 N m."""
    config = parse(
        f"event = []\nstart = 'inverter'\n[machine]\nlinkage = '{(FOLDER / 'fan').as_posix()}.toml'\n"
        "[system]\nmotor = 'IE3 4-pole 11 kW, 160M'\n[gear]\nratio = 1\n[run]\ncrank_speed = 150\n"
    )
    study = record_of(config, drive_of(config))
    for swing, hunts in ((233.0, True), (15.0, False)):
        torque = 57.0 + 0.5 * swing * np.sin(TURN)
        run = Dataset({"motor.air_gap_tau": ("time", torque), "machine.tau_bias": ("time", 0.0 * TURN)})
        findings = StudyFindings("wheel")
        remarks._on_hunting(study.setup, run, findings)
        told = [remark.quantities for remark in findings.remarks]
        assert [sizes["swing"][0] for sizes in told] == ([pytest.approx(swing, rel=1e-3)] if hunts else [])
