"""A machine whose shaft torque is measured, without a motor: its motion is estimated beside its parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from derivatives import check_derivatives
from synthetic import HiddenRun, Logger, synthetic

from chainunit import InputError
from chainunit.capabilities.identification.identification import inspect_runs
from chainunit.core.native.compilers import compiler
from chainunit.drives.dc_motor import DcMotor
from chainunit.recordings.fit import fit
from chainunit.recordings.problem import Problem, RecordedRun, Sensor, Unknown
from chainunit.recordings.residuals import residual_tests
from chainunit.recordings.shaft import WAVES, MeasuredShaft
from chainunit.study.config import parse
from chainunit.study.drive import Drive

pytestmark = [pytest.mark.second, pytest.mark.skipif(compiler() is None, reason="no C compiler")]
CONFIG = parse("")
TRUTH = {
    "machine.left.material_mass": 41.0,
    "machine.right.material_mass": 24.0,
    "machine.left.processing_force": 60.0,
    "machine.right.processing_force": 20.0,
    "machine.left.web_mass": 25.0,
    "machine.crank.m": 46.0,
    "machine.joint_damping": 1.3,
    "machine.pin.friction": 0.09,
}
LOADS = [name for name in TRUTH if "material" in name or "processing" in name]
SOUGHT = (
    Unknown.within("machine.left.material_mass", "kg", 10.0, 60.0),
    Unknown.within("machine.right.material_mass", "kg", 10.0, 60.0),
    Unknown.within("machine.left.processing_force", "N", 0.0, 200.0),
    Unknown.within("machine.right.processing_force", "N", 0.0, 200.0),
    Unknown.within("machine.left.web_mass", "kg", 10.0, 40.0),
    Unknown.within("machine.crank.m", "kg", 25.0, 60.0),
    Unknown.within("machine.joint_damping", "N.m.s/rad", 0.1, 3.0),
    Unknown.within("machine.pin.friction", "1", 0.02, 0.25),
)
SENSORS = {"crank.tau": Sensor(offset=5.0)}


def recorded(seed, angles=("mark",), measured=("crank.tau", "crank.w"), speed=3.0, rate=100.0, **values):
    """A recording of a drive by the direct model, of which the plant uses nothing. The motor warms up from cold."""
    run = HiddenRun(speed, 30.0, {**TRUTH, "motor.w_ref": 50.0 * speed, **values}, angle=2.0)
    logger = Logger(rate, offset={"crank.tau": -1.1}, angles=angles, mark_angle=0.15, drift=-4e-5)
    return synthetic(
        Drive(DcMotor, CONFIG.motor.parameters, CONFIG.machine),
        measured,
        run,
        logger,
        np.random.default_rng(seed),
    )


def problem_of(*runs, sensors=SENSORS):
    measured = [name for name in runs[0].recording.columns if name != "mark"]
    return Problem(MeasuredShaft(CONFIG.machine, measured, [u.name for u in SOUGHT]), runs, SOUGHT, sensors)


def found_of(problem):
    """The fit, after the values were compared with the true ones and the residuals with noise."""
    best = fit(problem)
    for name, true in TRUTH.items():
        place = problem.place[name]
        assert abs(best.z[place] - true) < 4.0 * best.deviations[place], name
    assert all(each.is_noise and 0.9 < each.noise < 1.1 for each in residual_tests(best))
    return best


@pytest.mark.parametrize(
    ("second", "values", "known"),
    [
        ("empty", dict.fromkeys(LOADS, 0.0), {"values": dict.fromkeys(LOADS, 0.0)}),
        pytest.param("speed", {}, {}, marks=pytest.mark.slow),
        pytest.param(
            "added",
            {"machine.left.web_mass": 40.0},
            {"added": {"machine.left.web_mass": 15.0}},
            marks=pytest.mark.slow,
        ),
    ],
)
def test_two_runs_are_identified(second, values, known):
    """The machine with another run: empty, at half the speed, with a known mass added. The material is told from the
    web only by a run without it or with a mass."""
    speed = 1.5 if second == "speed" else 3.0
    runs = [
        RecordedRun("first", recorded(1), 3.0),
        RecordedRun(second, recorded(2, speed=speed, **values), speed, **known),
    ]
    problem = problem_of(*runs)
    best = found_of(problem)
    deviation = dict(zip(problem.place, best.deviations, strict=True))
    assert abs(best.z[problem.place["mark.angle"]] - 0.15) < 4.0 * deviation["mark.angle"] < 0.05
    assert deviation["machine.right.material_mass"] < 1.0
    assert (deviation["machine.left.material_mass"] < 1.0) == (second == "empty")


@pytest.mark.parametrize("angles", [("motor.count",), pytest.param((), marks=pytest.mark.slow)])
def test_an_encoder_or_nothing_tells_the_angle(angles):
    """Without a mark the angle at the first row is searched."""
    measured = ("crank.tau",) if angles else ("crank.tau", "crank.w")
    runs = [
        RecordedRun("first", recorded(3, angles, measured), 3.0),
        RecordedRun(
            "empty",
            recorded(4, angles, measured, **dict.fromkeys(LOADS, 0.0)),
            3.0,
            dict.fromkeys(LOADS, 0.0),
        ),
    ]
    found_of(problem_of(*runs))


@pytest.mark.slow
def test_derivatives_of_residuals():
    """By every unknown, and of 60 orders by ten, of every column, against differences, at a motion that is far from
    even."""
    measured = ("crank.tau", "crank.w", "motor.w")
    recording = recorded(5, ("mark", "motor.count"), measured, rate=300.0).part(0.0, 5.0)
    problem = problem_of(
        RecordedRun("run", recording, 3.0), sensors={"crank.tau": Sensor(offset=5.0, gain=0.01)}
    )
    z, rng = problem.start_values, np.random.default_rng(1)
    names = [f"run.{name}" for name, *_ in WAVES] + ["run.phase.2", "run.phase.3", "run.speed", "run.drift"]
    for name in names:
        place = problem.place[name]
        z[place] += 0.1 * rng.standard_normal() * problem.prior_deviations[place]
    # that by the drift is the rate of a spline through the rows
    left_out = {f"run.{name}" for name, k, *_ in WAVES if k not in (*range(1, 9), 30, 60)}
    check_derivatives(problem, z, 5e-3, lambda name: name not in left_out)


def test_what_such_a_shaft_does_not_have():
    with pytest.raises(
        InputError, match=r"motor\.i: is not measured at a shaft without motor data; there are crank"
    ):
        MeasuredShaft(CONFIG.machine, ["motor.i"], ["machine.r"])
    with pytest.raises(InputError, match=r"motor\.rotor\.J: is no parameter or load of the machine"):
        MeasuredShaft(CONFIG.machine, ["crank.tau"], ["motor.rotor.J"])


def test_a_machine_without_friction_has_no_reversed_sign():
    """It takes no energy over a turn: the mean of its torque is the offset of the sensor, -1.1 N m, and its course
    tells the sign."""
    none = {name: 0.0 for name in TRUTH if name.endswith(("force", "friction", "damping"))}
    recording = recorded(3, **none)
    torque = recording.columns["crank.tau"]
    assert np.mean(torque) == pytest.approx(-1.1, abs=0.5) and np.std(torque) > 20.0
    inspect_runs(problem_of(RecordedRun("run", recording, 3.0)), 1)
    other = replace(recording, columns={**recording.columns, "crank.tau": -torque - 3.0})
    with pytest.raises(InputError, match=r"column crank\.tau .* the sign is reversed"):
        inspect_runs(problem_of(RecordedRun("run", other, 3.0)), 1)
