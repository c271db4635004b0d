"""Measures by hand: their values in a run that is made up, and the runs in which each has a meaning."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from records import like

from chainunit import ChainUnitMachine
from chainunit.core.quantities import Layout
from chainunit.drives.dc_motor import DcMotor
from chainunit.study import remarks
from chainunit.study.drive import Drive
from chainunit.study.limits import reaches
from chainunit.study.measures import MEASURES, Answers, measures_of, read_answers, read_measure
from chainunit.study.window import BURNT, Phase, Trip, Window


@pytest.mark.parametrize(("swing", "is_told"), [(100.0, True), (10.0, False)])
def test_a_peak_of_the_motor_that_is_none_of_the_load_has_its_reason(swing, is_told):
    """A pump takes 53 N m at the motor's shaft at most, and its sheet said 59 N m without a reason."""
    time = np.linspace(0.0, 1.0, 1001)
    load, a = 50.0 + 3.0 * np.sin(94.0 * time), swing * np.cos(94.0 * time)
    run = xr.Dataset(
        {"motor.air_gap_tau": ("time", load + 0.085 * a), "motor.a": ("time", a)}, {"time": time}
    )
    notes, rotor = [], SimpleNamespace(J=0.085)
    study = like(
        drive=SimpleNamespace(foreign=None, fmu_parameters=SimpleNamespace(rotor=rotor)),
        steady=run,
        answers={"steady": SimpleNamespace(speed_ripple=0.012)},
        say=lambda code, *runs, **values: notes.append((code.code, runs, values)),
    )
    remarks._on_rotor(study)
    if is_told:
        ((kind, runs, parts),) = notes
        assert kind == "rotor-accelerates" and runs == ("steady",)
        assert parts["load"] == pytest.approx(53.0, rel=1e-3)
        assert parts["most"] == pytest.approx(50.0 + math.hypot(3.0, 8.5), rel=1e-3)
    else:
        assert not notes


RATIO, SPEED = 10.0, 2.0
TIME = np.linspace(0.0, 4.0, 4001)
"""A little more than one turn of the crank at 2 rad/s."""


def window(phase=Phase.STEADY, *, begin=0.0, steady=None, trip=None, **changed):
    """A crank that turns evenly and a torque of 5 + 3 sin(2 q) N m at the crank; `changed` takes other series."""
    q = SPEED * TIME
    torque = (5.0 + 3.0 * np.sin(2.0 * q)) / RATIO
    series = {
        "machine.phi0": RATIO * q,
        "machine.w0": np.full_like(q, RATIO * SPEED),
        "machine.tau": torque,
        "machine.power": torque * RATIO * SPEED,
        "machine.rocker.tau": 7.0 * np.cos(q),
        "machine.frame.fx": 4.0 * np.cos(q) + 100.0,
        "machine.frame.fy": 4.0 * np.sin(q) - 50.0,
        "machine.frame.moment": 2.0 * np.sin(q) + 9.0,
        "motor.phi": RATIO * q,
        "motor.w": np.full_like(q, RATIO * SPEED),
        "motor.tau": torque,
        "motor.air_gap_tau": torque,
        "motor.armature.i": torque / 1.27,
        "motor.armature.T": np.full_like(q, 300.0),
        "motor.heat": np.full_like(q, 20.0),
        "motor.supply_power": np.full_like(q, 50.0),
        **{f"machine.{s}.{rod}_pull": 10.0 + np.cos(q) for s in ("left", "right") for rod in ("web", "wall")},
        **changed,
    }
    run = xr.Dataset({name: ("time", x) for name, x in series.items()}, {"time": TIME})
    drive = Drive(DcMotor, DcMotor.Parameters(), ChainUnitMachine(ratio=RATIO))
    return Window(phase, run, drive, ("left", "right"), SPEED, begin, steady, trip)


def test_means_are_over_whole_turns_and_peaks_over_all():
    answers = read_answers(window())
    assert answers.crank_torque_mean == pytest.approx(5.0, rel=1e-6)
    assert answers.crank_torque_rms == pytest.approx(math.sqrt(25.0 + 4.5), rel=1e-6)
    assert answers.crank_torque_peak == pytest.approx(8.0, rel=1e-6)
    assert answers.motor_torque_peak == pytest.approx(0.8, rel=1e-6)
    assert answers.power_mean == pytest.approx(10.0, rel=1e-6) and answers.power_peak == pytest.approx(16.0)
    assert answers.rocker_torque_peak == pytest.approx(7.0)
    assert answers.speed_mean == pytest.approx(SPEED) and answers.speed_ripple == pytest.approx(0.0)
    assert answers.shaking_force == pytest.approx(4.0, rel=1e-4)
    assert answers.shaking_moment == pytest.approx(2.0, rel=1e-4)
    assert answers.web_pull_least == answers.wall_pull_least == pytest.approx(9.0)
    assert answers.shaft_share == 1.0
    # a motor that only brakes gives no power
    braking = read_answers(window(**{"machine.power": np.full_like(TIME, -3.0)}))
    assert braking.power_peak == 0.0 and braking.power_mean == pytest.approx(-3.0)


OF_OTHERS = {"slack_time", "fold_largest", "front_pivot_peak", "back_pivot_peak", "bar_stress_peak"}
"""Measures of a machine with chains, or with a width."""


def test_each_measure_has_its_reader_and_its_runs():
    for each in MEASURES.values():
        assert callable(each.reader) and each.during <= set(Phase)
    assert {v.name for v in measures_of(Phase.START_UP)} == {
        "start_time", "crank_torque_peak", "motor_torque_peak", "current_peak", "rocker_torque_peak",
        "web_pull_least", "wall_pull_least", *OF_OTHERS,
    }  # fmt: skip
    steady = window()
    for phase in Phase:
        answers = read_answers(window(phase, steady=steady, begin=1.0 if phase is Phase.EVENT else 0.0))
        values = {n for n, x in Layout(Answers).by_name(answers).items() if x is not None}
        assert values <= {v.name for v in measures_of(phase)}
        if phase is Phase.START_UP:
            assert values == {v.name for v in measures_of(phase)} - OF_OTHERS
    assert read_measure("crank_torque_mean", steady) == pytest.approx(5.0)


def slowed(factor):
    """The speed falls by this factor between 1 and 2 s."""
    speed = np.where((TIME > 1.0) & (TIME < 2.0), factor, 1.0) * RATIO * SPEED
    return {"machine.w0": speed, "motor.w": speed}


def test_what_follows_an_event():
    steady = window()
    dipped = read_answers(window(Phase.EVENT, begin=1.0, steady=steady, **slowed(0.7)))
    assert dipped.speed_dip == pytest.approx(0.3) and dipped.speed_least == pytest.approx(1.4)
    assert dipped.recovery_time == pytest.approx(1.0, abs=0.002) and dipped.stall_time is None
    none = read_answers(window(Phase.EVENT, begin=1.0, steady=steady))
    assert none.recovery_time == 0.0 and none.speed_dip == 0.0
    stands = {"machine.w0": np.where(TIME < 2.0, RATIO * SPEED, 0.0)}
    stalled = read_answers(window(Phase.EVENT, begin=0.5, steady=steady, **stands))
    assert stalled.stall_time == pytest.approx(1.5, abs=0.002) and stalled.recovery_time is None
    # in a start the speed says nothing of a dip
    assert read_answers(window(Phase.LOADED_START, steady=steady, **stands)).speed_dip is None


def test_a_motor_on_the_line_dips_below_its_own_mean_in_running_and_events():
    """It keeps the speed of its slip, here 3 % above the one asked for: no dip is below zero."""

    def on_line(*of, **changed):
        made = window(*of, **changed)
        return replace(made, drive=replace(made.drive, follows=False))

    q = 1.03 * SPEED * TIME + 0.01 * np.sin(SPEED * TIME)
    speed = {"machine.w0": np.gradient(q, TIME) * RATIO, "motor.w": np.gradient(q, TIME) * RATIO}
    steady = on_line(**speed)
    answers = read_answers(steady)
    assert (
        answers.speed_dip == pytest.approx(0.5 * answers.speed_ripple, rel=0.05) and answers.speed_dip > 0.0
    )
    event = read_answers(on_line(Phase.EVENT, begin=1.0, steady=steady, **speed))
    assert event.speed_dip == pytest.approx(answers.speed_dip, rel=0.01)
    stands = np.zeros_like(TIME)
    assert read_answers(on_line(**{"machine.w0": stands, "motor.w": stands})).speed_dip == 1.0


def test_a_coupling_that_opened():
    late = np.linspace(3.0, 6.0, 301)
    coasting = xr.Dataset(
        {
            "machine.phi": ("time", late),
            "machine.w": ("time", RATIO * np.maximum(0.0, SPEED * (1.0 - (late - 3.0) / 2.0))),
            "machine.kinetic_energy": ("time", np.full_like(late, 12.5)),
        },
        {"time": late},
    )
    trip = Trip(3.0, 4.5, coasting)
    answers = read_answers(window(Phase.EVENT, begin=1.0, steady=window(), trip=trip))
    assert (answers.coupling_trip_time, answers.energy_after_trip, answers.energy_behind) == (2.0, 4.5, 12.5)
    # at a hundredth of the speed that is asked for: 2*(1 - 0.01) s after the trip
    assert answers.standstill_time == pytest.approx(2.0 + 1.98, abs=0.011)
    assert answers.thermal_trip_time is None


def test_the_winding_settles_where_its_heat_and_cooling_balance():
    steady = window()
    warm = read_answers(steady).winding_temperature
    p = DcMotor.Parameters()
    assert warm == pytest.approx(DcMotor.settled_temperature(p, 20.0, 300.0, RATIO * SPEED))
    assert steady.warm == warm < BURNT
    hot = window(**{"motor.heat": np.full_like(TIME, 1e9)})
    assert hot.warm == BURNT


def test_reaching_the_speed_is_within_three_percent():
    assert reaches(2.059, 2.0) and not reaches(2.061, 2.0) and reaches(1.941, 2.0) and not reaches(1.939, 2.0)
    assert not reaches(math.nan, 2.0)
