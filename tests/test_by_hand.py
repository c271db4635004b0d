"""The crusher, the fan and the mill of the examples have a calculation by hand at their top, and `docs/drives.md` a
row. It is done again here, from positions of the crusher that this file finds for itself."""

from __future__ import annotations

import itertools
import json
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from command import chainunit
from test_linkage_pins import pin_power

from chainunit.drives.catalogue import motor_of_catalogue
from chainunit.machines.linkages.file import read_linkage
from chainunit.machines.machine import Machine
from chainunit.reading.result_entries import ResultEntries

EXAMPLES = Path(__file__).parents[1] / "examples"
CRUSHER = EXAMPLES / "linkages" / "jaw_crusher_bearings.toml"
SPEED = 275.0 * 2.0 * math.pi / 60.0
PHI = np.arange(3600) * 2.0 * math.pi / 3600
SEATS = ("O3", "T1", "T2", "D")
PINS = {
    "O1": (0.0015, 0.18),
    "A": (0.0015, 0.22),
    "O4": (0.08, 0.14),
    **dict.fromkeys(SEATS, (0.15, 0.06)),
}
"""Coefficient of friction and diameter of each pin [m]."""


def meeting(p, r, q, s, near):
    """The point at the distances r and s from p and q, complex numbers, that is the nearer to another one."""
    line = q - p
    along = (r**2 - s**2 + abs(line) ** 2) / (2.0 * abs(line))
    across = math.sqrt(r**2 - along**2)
    return min(
        (p + line / abs(line) * complex(along, sign * across) for sign in (1, -1)),
        key=lambda x: abs(x - near),
    )


def angles_of(phis):
    """The angles of both toggles, pitman and jaw by circles that meet, from one place to the next [rad]."""
    t1, d, o3, o4 = -0.057 - 0.85j, 0.486 - 0.772j, -0.47 - 0.775j, 0.66 + 0.2j
    rows = []
    for phi in phis:
        a = 0.03 * np.exp(1j * phi)
        t1 = meeting(a, abs(0.88 - 0.06j), o3, 0.42, t1)
        pitman = (t1 - a) / (0.88 - 0.06j)
        t2 = a + pitman * (0.88 + 0.06j)
        d = meeting(t2, 0.43, o4, abs(0.97 - 0.18j), d)
        rows.append([np.angle(x) for x in (t1 - o3, d - t2, pitman, (d - o4) / (0.97 - 0.18j))])
    return np.array(rows).T


def rock_by_hand():
    """Work on the rock in a turn [J], and the ways of K between the angles of the table [m]."""
    table = tomllib.loads(CRUSHER.read_text("utf-8"))["tables"]["closing"]
    degrees = [float(text.split()[0]) for text in table["phi"]]
    closing = sorted(zip([x - 360.0 if x > 180.0 else x for x in degrees], table["value"], strict=True))[:-1]
    walk = np.radians(np.arange(90.0, -91.0, -1.0))
    jaw = dict(zip(np.round(np.degrees(walk)), angles_of(walk)[3], strict=True))
    pairs = [*itertools.pairwise(closing)]
    ways = [abs(0.8 * (jaw[one] - jaw[other])) for (one, _), (other, _) in pairs]
    shares = [(one + other) / 2.0 for (_, one), (_, other) in pairs]
    return 60e3 * float(np.dot(shares, ways)), ways


def test_a_crusher_with_three_kinds_of_pins():
    work, ways = rock_by_hand()
    assert [round(1e3 * way, 1) for way in ways] == [8.9, 7.4, 8.5, 2.6, 0.3] and round(work) == 722
    machine = Machine(read_linkage(CRUSHER))
    out = machine.outputs(phi=PHI, w=SPEED)
    per_turn = 2.0 * math.pi / SPEED
    assert -np.mean(out.load_power) * per_turn == pytest.approx(work, rel=0.015)
    described = machine.model.described_by
    losses = {pin: np.mean(pin_power(machine, out, pin, *law)) * per_turn for pin, law in PINS.items()}
    assert sum(losses.values()) == pytest.approx(
        np.mean(out.dissipated_power + out.load_power) * per_turn, rel=1e-9
    )
    assert round(sum(losses.values())) == 108
    # by hand with the RMS of the forces
    force = {}
    for pin in PINS:
        reaction = getattr(out, described.variable("joint", pin))
        force[pin] = math.sqrt(np.mean(reaction.fx**2 + reaction.fy**2))
    back, front, pitman, jaw = angles_of(PHI + math.pi / 2.0)
    turns = {"O3": back, "T1": back - pitman, "T2": pitman - front, "D": front - jaw, "O4": jaw}
    sways = {pin: 2.0 * np.ptp(np.unwrap(angle)) for pin, angle in turns.items()}
    assert [round(sways[pin] / 2.0, 3) for pin in SEATS] == [0.145, 0.149, 0.196, 0.198]
    rough = {
        pin: 0.5 * friction * diameter * force[pin] * sways.get(pin, 2.0 * math.pi)
        for pin, (friction, diameter) in PINS.items()
    }
    seats = sum(rough[pin] for pin in SEATS)
    assert round(rough["O1"] + rough["A"]) == 26 and round(seats) == 125 and round(rough["O4"]) == 3
    # a bound, as the large forces of a seat meet the slow part of its way
    assert 0.6 * seats < sum(losses[pin] for pin in SEATS) < seats
    assert losses["O1"] + losses["A"] == pytest.approx(rough["O1"] + rough["A"], rel=0.1)
    # the one law that the other crusher of the gallery has
    one = Machine(read_linkage(EXAMPLES / "linkages" / "blake_jaw_crusher.toml")).outputs(phi=PHI, w=SPEED)
    assert round(float(np.mean(one.dissipated_power + one.load_power)) * per_turn) == 399
    mean = (work + sum(rough.values())) / per_turn / 0.95
    assert mean == pytest.approx(4.2e3, rel=0.01) and 1.25 * mean == pytest.approx(5.3e3, rel=0.01)


def study_of(name, folder, text=""):
    """The result of an example, or of the `text` of a study file, and what the terminal shows."""
    file = EXAMPLES / f"{name}.toml"
    arguments = [str(file)]
    if text:
        machines = str(EXAMPLES / "loads").replace("\\", "/")
        (folder / f"{name}.toml").write_text(text.replace("loads/", f"{machines}/"), "utf-8")
        arguments = [str(folder / f"{name}.toml")]
    process = chainunit("study", *arguments, "-o", str(folder / "out"), cwd=folder, whole=False)
    assert process.returncode == 0, process.stderr
    result = ResultEntries(json.loads((folder / "out" / "result.json").read_text("utf-8")))
    return result, process.stdout


@pytest.mark.slow
def test_the_crusher_gets_the_motor_of_the_calculation_by_hand(tmp_path):
    result, text = study_of("jaw_crusher", tmp_path)
    assert "Largest force in a pin: D" in text
    assert "IE3 4-pole 5.5 kW" in result["sentence"] and "V-belt" in result["sentence"]
    mean = result["answers"]["steady"]["crank_torque_mean"]["value"]
    work, _ = rock_by_hand()
    assert mean * 2.0 * math.pi == pytest.approx(work + 108.0, rel=0.02)


@pytest.mark.second
def test_a_fan_gets_its_motor_without_a_gear(tmp_path):
    """The torque grows from 0 to its whole with the square of the speed: a third of it in the mean of the start."""
    result, text = study_of("fan_without_gear", tmp_path)
    # its bearing bears no force
    assert "Largest force in a pin" not in text
    assert 60.0 * 1480.0 * math.pi / 30.0 == pytest.approx(9.3e3, rel=1e-3)
    assert "IE3 4-pole 11 kW" in result["sentence"] and "no gear" in result["sentence"]
    plate = motor_of_catalogue("IE3 4-pole 11 kW, 160M").nameplate
    rated = plate.power / plate.speed
    mean = 0.45 * (plate.locked_torque_ratio + plate.breakdown_ratio)
    assert round(rated) == 71 and round(mean, 1) == 2.3
    time = (2.5 + plate.J) * plate.speed / (mean * rated - 20.0)
    assert result["start_up"]["start_time"]["value"] == pytest.approx(time, rel=0.1)
    assert result["answers"]["steady"]["crank_torque_mean"]["value"] == pytest.approx(60.0, rel=0.01)


@pytest.mark.slow
def test_the_mill_gets_the_motor_that_its_example_names(tmp_path):
    """12 kW in running and a fluid coupling that passes 1.9 times the rated torque in the start and in the jam."""
    text = (EXAMPLES / "mill_with_fluid_coupling.toml").read_text("utf-8")
    for line in ("[system]", 'motor = "IE3 4-pole 15 kW, 160L"', "[gear]", "ratio = 1"):
        assert f"{line}\n" in text
        text = text.replace(f"{line}\n", "", 1)
    result, _ = study_of("mill", tmp_path, f'{text}\n[sizing]\ngear_kind = "none"\ncandidates = 3\n')
    assert "IE3 4-pole 15 kW, 160L" in result["sentence"]


def test_a_valve_lifts_off_its_cam_at_the_speed_of_the_calculation_by_hand():
    """A rise of 70 deg by the 3-4-5 polynomial. Where its second derivative is below 0, the spring of 180 N and
    18 N/mm and the weight of 140 g hold the valve; the contact along the line of its guide is what they have left."""
    machine = Machine(read_linkage(EXAMPLES / "linkages" / "valve_cam.toml"))
    x, rise = np.linspace(0.0, 1.0, 100001), math.radians(70.0)
    lift = 8e-3 * (10.0 * x**3 - 15.0 * x**4 + 6.0 * x**5)
    slope = 8e-3 * 30.0 * x**2 * (1.0 - x) ** 2 / rise
    bend = 8e-3 * (60.0 * x - 180.0 * x**2 + 120.0 * x**3) / rise**2
    holding = 180.0 + 18e3 * lift + 0.14 * 9.81
    behind = bend < 0.0
    lifting = math.sqrt(np.min(holding[behind] / (-0.14 * bend[behind])))
    assert lifting * 30.0 / math.pi == pytest.approx(2575.1, abs=0.1)
    # the camshaft counts from its base circle; the rise begins at -70 deg, where the cam is at 110 deg of its profile
    phi = -rise * (1.0 - x)
    for speed, words in ((188.4956, 163.4), (lifting, 0.0)):
        normal = machine.outputs(phi, speed).cam.normal
        by_hand = (holding + 0.14 * bend * speed**2) * np.hypot(1.0, slope / (24e-3 + lift))
        assert np.max(np.abs(np.abs(normal) - np.abs(by_hand))) < 1e-9 * np.max(normal)
        assert np.min(normal) == pytest.approx(words, abs=0.05)


def test_a_rack_feeds_what_the_calculation_by_hand_says():
    """The rack goes 2 r to the left; the roll of 80 mm on the shaft of the pinion of 50 mm pulls the strip."""
    machine = Machine(read_linkage(EXAMPLES / "linkages" / "rack_feeder.toml"))
    r, l, w = 0.06, 0.4, 2.0 * math.pi
    phi = PHI[(PHI > 0.1) & (PHI < 3.0)]

    def rate(angle):
        long = np.sqrt(l * l - (r * np.sin(angle)) ** 2)
        return -r * np.sin(angle) - r * r * np.sin(angle) * np.cos(angle) / long

    out = machine.outputs(PHI, w)
    assert np.ptp(out.gear.angle) == pytest.approx(2.0 * r / 0.05, rel=1e-12)
    assert 0.08 * np.ptp(out.gear.angle) == pytest.approx(0.192, rel=1e-12)
    forth = machine.outputs(phi, w)
    assert forth.rack.B.vx == pytest.approx(rate(phi) * w, rel=1e-12) and np.all(rate(phi) < 0.0)
    # the teeth drive the strip, and 0.05 kg m2 with the acceleration of the rack, by a complex step
    bend = rate(phi + 1e-30j).imag / 1e-30 * w * w
    assert np.abs(forth.teeth.fx) == pytest.approx((1500.0 * 0.08 - 0.05 * bend / 0.05) / 0.05, rel=1e-12)
    # without friction the eccentric gives the work of the strip alone
    free = machine.replace({"pins.friction": 0.0, "guides.friction": 0.0}).outputs(PHI, w)
    assert np.mean(free.tau) * 2.0 * math.pi == pytest.approx(1500.0 * 0.192, rel=2e-3)
    assert np.max(out.tau) == pytest.approx(160.2, abs=0.1)
