"""Flywheels on the shaft of the machine, on a faster shaft of it, and behind a part of the line: by the equations of
motion, beside the same inertia on the motor's shaft, and in all that uses their inertia."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from chainunit import InputError
from chainunit.capabilities.flywheels.analysis import FlywheelFindings
from chainunit.capabilities.sizing.table import SizingPlan
from chainunit.core import engines
from chainunit.core.ports import LoadPort
from chainunit.drives.flywheel import Flywheel
from chainunit.drives.gear import Gear
from chainunit.study import config, start_runs
from chainunit.study.choice import drive_of
from chainunit.study.drive_fmus import coasting_parameters
from chainunit.study.line.shaft import rigid_torque, two_masses
from chainunit.study.readings import energy_held, load_inertia
from chainunit.study.rig import Rig
from chainunit.study.torques import gear_torque
from chainunit.system import rigid

KNIFE = """
[system]
machine = "KnifeDrive"
motor = "IE3 4-pole 2.2 kW, 100L"
[gear]
ratio = 37.0
efficiency = {efficiency}
[flywheel]
J = {J!r}
{place}
"""
RATIO = 37.0
MACHINE = 'place = "machine"'
LINE = "[driveline]\nc2 = 4e4\nc3 = 4e4\nJ4 = 2.0\nd2 = 20\nd3 = 20\n"


def study(J, place="", efficiency=1.0, more=""):
    return config.parse(KNIFE.format(J=J, place=place, efficiency=efficiency) + more)


def rig_of(J, place="", efficiency=1.0, more=""):
    read = study(J, place, efficiency, more)
    return Rig(read.operation, drive_of(read), None)


def run(J, place="", efficiency=1.0, more="", end=1.2):
    """The rig and its run from rest, on the compiled system."""
    rig = rig_of(J, place, efficiency, more)
    with rig.from_rest() as simulation:
        return rig, simulation.run(end, rig.step)


@pytest.fixture(scope="module")
def geared():
    """The run with a flywheel at the machine behind a gear with a loss."""
    return run(400.0, MACHINE, efficiency=0.8)


# --- the model


def at(model, p, motion, load):
    u = model.input_layout.from_names(motion | {f"load.{name}": x for name, x in load.items()})
    (outputs,) = model.evaluate(engines.MATH, p, u, None)
    return model.parts[0].layout.by_name(outputs)


def test_the_model_is_a_gear_whose_load_has_the_inertia_of_the_flywheel():
    rng = np.random.default_rng(5)
    names = [field.name for field in dataclasses.fields(LoadPort)]
    for _ in range(50):
        ratio, J, turns = rng.uniform(0.3, 60.0), rng.uniform(0.0, 900.0), rng.uniform(0.2, 12.0)
        motion = dict(zip(("phi", "w", "a"), rng.uniform(-90.0, 90.0, 3), strict=True))
        load = dict(zip(names, rng.uniform(0.0, 9.0, len(names)), strict=True))
        wheel = at(Flywheel, Flywheel.Parameters(ratio=ratio, J_wheel=J, turns=turns), motion, load)
        gear = at(Gear, Gear.Parameters(ratio=ratio), motion, load)
        at_machine = J * turns**2
        assert wheel["J"] == pytest.approx(gear["J"] + at_machine / ratio**2, rel=1e-12)
        # the torque of the flywheel does not reach the machine
        torque = at_machine * motion["a"] / ratio
        assert wheel["driven.tau"] == pytest.approx(gear["driven.tau"], rel=1e-9, abs=1e-9 * abs(torque))
        assert wheel["tau"] == pytest.approx(gear["tau"] + torque / ratio, rel=1e-9)
        speed = turns * motion["w"] / ratio
        assert wheel["kinetic_energy"] == pytest.approx(0.5 * J * speed**2, rel=1e-12)
        same = ("tau_bias", "dJ_dphi", "phi0", "w0", "tau_bias_dphi", "tau_bias_dw", "driven.w")
        assert [wheel[name] for name in same] == [gear[name] for name in same]


# --- its place in a drive


def test_the_inertia_stands_at_its_place():
    """Rotor, line and machine: all that swings, at the motor's shaft."""
    bare = rig_of(0.0).drive.rotor_inertia
    motor, machine = rig_of(0.4).drive, rig_of(400.0, MACHINE).drive
    assert motor.fmu_parameters.rotor.J == pytest.approx(bare + 0.4, rel=1e-12) and not motor.whole_line
    assert machine.fmu_parameters.rotor.J == bare
    assert machine.rotor_inertia == pytest.approx(bare + 400.0 / RATIO**2, rel=1e-12)
    assert [part.name for part in machine.whole_line] == ["flywheel"] and machine.driven_machine.ratio == 1.0
    assert (motor.flywheel_ratio, machine.flywheel_ratio) == (1.0, RATIO)
    fast = rig_of(400.0 / 81.0, f"{MACHINE}\nturns = 9").drive
    assert fast.rotor_inertia == pytest.approx(machine.rotor_inertia, rel=1e-12)
    assert fast.flywheel_ratio == pytest.approx(RATIO / 9.0, rel=1e-12)
    # the machine without its motor keeps the flywheel that is on its own shaft
    assert coasting_parameters(machine)["J_added"] == 400.0
    assert coasting_parameters(fast)["J_added"] == pytest.approx(400.0, rel=1e-12)
    assert "J_added" not in coasting_parameters(motor)


@pytest.mark.slow
def test_behind_a_gear_without_loss_it_is_the_same_as_before_it():
    _, before = run(0.4)
    rig, behind = run(0.4 * RATIO**2, MACHINE)
    _, fast = run(0.4 * RATIO**2 / 25.0, f"{MACHINE}\nturns = 5")
    for name in ("motor.w", "motor.air_gap_tau"):
        scale = np.max(np.abs(before[name].values))
        assert np.max(np.abs(behind[name].values - before[name].values)) < 1e-4 * scale
        assert np.max(np.abs(fast[name].values - behind[name].values)) < 1e-9 * scale
    # torque and power of the machine are those at the crank in both
    np.testing.assert_allclose(behind["machine.w0"].values * RATIO, behind["motor.w"].values, rtol=1e-12)
    assert max(rig.residuals(behind).values()) < 1e-6


@pytest.mark.second
def test_the_gear_loses_a_share_of_the_torque_of_the_flywheel(geared):
    """The equation of motion of the rotor, with torque and acceleration of the run."""
    rig, r = geared
    p, loss = rig.drive.fmu_parameters, rig.drive.gear.loss
    assert loss == pytest.approx(0.25)
    a, w = r["motor.a"].values, r["motor.w"].values
    passed = (r["machine.tau"].values + 400.0 * a / RATIO) / RATIO
    needed = p.rotor.J * a + p.rotor.d * w + passed + loss * np.abs(passed)
    rows = r["motor.w"].values > 5.0
    given = r["motor.air_gap_tau"].values
    assert np.max(np.abs(needed - given)[rows]) < 1e-3 * np.max(given)
    # the gear carries what flywheel and machine take
    np.testing.assert_allclose(gear_torque(rig.drive, r), passed * RATIO, atol=1e-3 * np.max(passed) * RATIO)
    np.testing.assert_allclose(
        load_inertia(rig.drive, r), (r["machine.J"].values + 400.0) / RATIO**2, rtol=1e-12
    )


@pytest.mark.second
def test_its_energy_is_among_the_energy_held(geared):
    rig, r = geared
    w = r["motor.w"].values
    own = 0.5 * rig.drive.fmu_parameters.rotor.J * w**2 + 0.5 * 400.0 * (w / RATIO) ** 2
    machine = r["machine.kinetic_energy"].values + r["machine.potential_energy"].values
    np.testing.assert_allclose(energy_held(rig.drive, r), own + machine, rtol=1e-9, atol=1e-9)


def test_a_driveline_swings_against_the_flywheel_behind_it():
    turned = 2.0 / RATIO**2  # of the machine
    crank = rig_of(300.0, MACHINE, more=LINE).drive
    assert [part.name for part in crank.whole_line] == ["driveline", "flywheel"]
    bare = rig_of(0.0, more=LINE).drive
    for drive, J1, J4 in (
        (bare, bare.fmu_parameters.rotor.J * RATIO**2, 2.0 + turned * RATIO**2),
        (crank, bare.fmu_parameters.rotor.J * RATIO**2, 302.0 + turned * RATIO**2),
        (rig_of(300.0, 'place = "driveline"', more=LINE).drive, None, 302.0 + turned * RATIO**2),
        (rig_of(0.2, more=LINE).drive, None, 2.0 + turned * RATIO**2),
    ):
        masses = two_masses(drive, turned)
        assert masses.J4 == pytest.approx(J4, rel=1e-12)
        assert J1 is None or masses.J1 == pytest.approx(J1, rel=1e-12)
    # on the motor's shaft before the gear, the flywheel turns with the motor
    before = rig_of(0.3, 'place = "driveline"', more=f'{LINE}place = "motor"\n').drive
    assert [part.ratio for part in before.whole_line] == [1.0, 1.0]
    assert two_masses(before, turned).J4 == pytest.approx(2.0 + 0.3 + turned, rel=1e-12)
    assert before.driven_machine.ratio == RATIO


@pytest.mark.second
def test_the_rigid_twin_of_a_driveline_keeps_the_flywheel():
    rig = rig_of(300.0, MACHINE, more=LINE)
    twin = dataclasses.replace(rig, twin=lambda system: rigid(system, "driveline"))
    with twin.from_rest() as simulation:
        r = simulation.run(0.6, rig.step)
    driven = 300.0 * r["motor.a"].values / RATIO + r["machine.tau"].values
    expected = driven + 2.0 * r["motor.a"].values / RATIO
    np.testing.assert_allclose(rigid_torque(rig.drive, r), expected, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(
    ("place", "more", "said"),
    [
        (
            "turns = 9",
            "",
            'flywheel.turns: is of a shaft geared to the machine; add flywheel.place = "machine"',
        ),
        (
            'place = "driveline"',
            "",
            "flywheel.place: names a part of the line that is not there; add [driveline]",
        ),
        ('place = "crank"', "", 'flywheel.place = "crank": must be "motor"'),
    ],
)
def test_a_place_that_is_not_there_is_refused(place, more, said):
    with pytest.raises(InputError) as refusal:
        study(0.1, place, more=more)
    assert said in str(refusal.value)


def test_the_hand_formula_counts_at_the_shaft_of_the_flywheel():
    """J = dE/(fluctuation w^2), less what is there, at the motor; at the machine as much more as the gear has ratio
    squared."""
    findings = [
        FlywheelFindings(
            own=0.0,
            permitted_fluctuation=0.05,
            swing=600.0,
            speed=150.0,
            bare=0.01,
            mean_torque=1.0,
            ratio=ratio,
        )
        for ratio in (1.0, RATIO)
    ]
    motor, machine = (each.flywheel_by_hand for each in findings)
    assert motor == pytest.approx(600.0 / (0.05 * 150.0**2) - 0.01, rel=1e-12)
    assert machine == pytest.approx(motor * RATIO**2, rel=1e-12)
    for each, flywheel in zip(findings, (motor, machine), strict=True):
        assert each.by_hand(flywheel) == pytest.approx(0.05, rel=1e-12)
        assert each.inertia(flywheel) == pytest.approx(motor + 0.01, rel=1e-12)


def test_what_has_no_flywheel_behind_the_gear_refuses_it():
    place = f"[flywheel]\n{MACHINE}\nJ = 1.0\n"
    with pytest.raises(InputError, match="observer: has no flywheel behind the gear"):
        config.parse(f"{place}[observer]\n")
    config.parse("[flywheel]\nJ = 0.1\n[observer]\n")


SIZED = '[system]\nmachine = "KnifeDrive"\n[flywheel]\n{}\n[sizing]\n'


@pytest.mark.parametrize("key", ["J = 0.2", "fluctuation = 0.05", "compare = [0.1]"])
def test_sizing_finds_the_inertia_and_takes_the_place(key):
    with pytest.raises(InputError, match=f"flywheel.{key.split()[0]}: sizing finds its own"):
        config.parse(SIZED.format(key))
    read = config.parse(SIZED.format(f"{MACHINE}\nturns = 4"))
    assert read.drive.flywheel_shaft.turns == 4.0 and read.plans["flywheels"] is None
    assert isinstance(read.plans["sizing"], SizingPlan)
    with pytest.raises(InputError, match="sizing tries flywheels of the motor or of the machine"):
        config.parse(SIZED.format('place = "driveline"') + LINE)


# --- behind a belt that slips

BELT = "[belt]\nratio = 4\n"


def test_on_the_driven_pulley_it_is_the_inertia_of_the_pulley():
    """A drive whose driven pulley has the inertia of flywheel and pulley moves in the same way."""
    rig, wheel = run(2.0, 'place = "belt"', more=BELT, end=0.6)
    pulley = rig_of(0.0, 'place = "belt"', more=BELT).drive.line.parts[0].inertia
    _, heavy = run(0.0, more=f"{BELT}J_driven = {2.0 + pulley!r}\n", end=0.6)
    assert rig.drive.flywheel_ratio == 4.0 and pulley > 0.0
    for name in ("motor.w", "belt.driven.tau", "machine.tau"):
        np.testing.assert_allclose(
            wheel[name], heavy[name], rtol=1e-9, atol=1e-9 * np.max(np.abs(heavy[name]))
        )


def test_behind_belt_and_gear_the_gear_carries_its_torque():
    """The torque of the gear is that of the machine, and what speeds up the flywheel."""
    rig, steady = run(300.0, MACHINE, more=BELT, end=1.0)
    a = np.gradient(steady["flywheel.driven.w"].values, steady["time"].values)
    expected = steady["machine.tau"].values + 300.0 * a
    off = gear_torque(rig.drive, steady) - expected
    # the difference quotient misses the first jerks of the start
    assert np.max(np.abs(off[50:-2])) < 2e-3 * np.max(np.abs(expected))
    assert np.max(np.abs(300.0 * a[50:])) > 0.2 * np.max(np.abs(expected))


def test_starts_with_a_flywheel_behind_belt_and_gear_have_the_torque_of_the_gear():
    """They record few outputs: the torque of the gear was not among them."""
    rig = rig_of(300.0, MACHINE, more=BELT)
    assert "flywheel.tau" in start_runs._read(rig)
    assert "flywheel.tau" not in start_runs._read(rig_of(0.0, more=BELT))


def test_feed_forward_is_refused_beside_a_flywheel_behind_the_gear():
    with pytest.raises(InputError, match="feed_forward: counts the machine without a flywheel; set"):
        config.parse('feed_forward = true\nstart = "inverter"\n[flywheel]\nJ = 1.0\nplace = "machine"\n')
