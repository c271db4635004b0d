"""Synthetic recordings: both integrators give the same course, and the sensors do what they are said to do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import HiddenRun, Logger, synthetic, write_recording

from chainunit import InputError
from chainunit.core.native.compilers import compiler
from chainunit.drives.dc_motor import DcMotor
from chainunit.drives.induction_motor import InductionMotor
from chainunit.recordings.measurands import COUNTS
from chainunit.recordings.recording import read_recording
from chainunit.study.config import parse
from chainunit.study.drive import Drive
from chainunit.system import Profile

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")
CONFIG = parse("")
DRIVE = Drive(DcMotor, CONFIG.motor.parameters, CONFIG.machine)
RUN = HiddenRun(3.0, 5.0, {"motor.w_ref": 150.0, "machine.left.material_mass": 20.0}, angle=1.0, before=2.0)
PLAIN = Logger(rate=200.0, noise=0.0, jitter=0.0)


def made(measured, run=RUN, logger=PLAIN, integrator="compiled", drive=DRIVE):
    return synthetic(drive, measured, run, logger, np.random.default_rng(3), integrator)


def test_both_integrators_agree():
    """Of a run whose reference and load change, with jitter of the rows."""
    shaken = Profile(150.0, ((-1.0, 0.5, 160.0), (2.0, 1.0, 120.0)))
    feed = Profile(30.0, ((3.0, 0.5, 10.0),))
    run = replace(RUN, values={"motor.w_ref": shaken, "machine.left.material_mass": feed})
    logger = replace(PLAIN, jitter=1e-4, angles=("mark", "motor.count"))
    names = ("motor.i", "motor.u", "motor.w", "crank.tau", "crank.w")
    one, other = (made(names, run, logger, each) for each in ("compiled", "monolithic"))
    for name in names:
        a, b = one.columns[name], other.columns[name]
        assert np.max(np.abs(a - b)) < 1e-6 * np.max(np.abs(b)), name
    np.testing.assert_array_equal(one.columns["mark"], other.columns["mark"])
    assert np.max(np.abs(one.columns["motor.count"] - other.columns["motor.count"])) <= 1.0
    assert np.ptp(one.columns["motor.w"]) > 35.0


def test_an_induction_motor():
    drive = Drive(InductionMotor, InductionMotor.Parameters(), CONFIG.machine)
    recording = made(("motor.i", "motor.power"), replace(RUN, values={}), drive=drive)
    assert 0.0 < np.mean(recording.columns["motor.power"]) < 2200.0
    with pytest.raises(InputError, match=r"motor\.v: is not measured at this drive"):
        made(("motor.v",), replace(RUN, values={}), drive=drive)


def test_the_sensors():
    """Noise of the stated size, a converter that rounds and clips, gain and offset, an encoder and a mark, a clock
    that drifts, and gaps."""
    true = made(("motor.i", "motor.u", "motor.w"))
    noisy = made(("motor.i", "motor.u", "motor.w"), logger=replace(PLAIN, noise=0.01))
    rest = noisy.columns["motor.w"] - true.columns["motor.w"]
    assert np.std(rest) == pytest.approx(0.01 * 150.0, rel=0.1)
    wrong = replace(PLAIN, gain={"motor.i": 1.1}, offset={"motor.i": 0.2}, full={"motor.u": 190.0}, bits=10)
    columns = made(("motor.i", "motor.u"), logger=wrong).columns
    np.testing.assert_allclose(columns["motor.i"], 1.1 * true.columns["motor.i"] + 0.2)
    step = 190.0 / 512.0
    u = true.columns["motor.u"]
    assert np.any(u > 190.0) and np.max(columns["motor.u"]) == pytest.approx(511 * step)
    assert np.max(np.abs(columns["motor.u"] - u)[u < 189.0]) <= 0.5001 * step
    angles = made(("crank.w",), logger=replace(PLAIN, angles=("mark", "motor.count"), mark_angle=0.4))
    count, mark = angles.columns["motor.count"], angles.columns["mark"]
    assert count[0] == 0.0 and count[-1] == pytest.approx(150.0 * 4.995 * COUNTS / (2.0 * np.pi), rel=0.01)
    # from 1 rad to 0.4 rad of the next turn
    first = angles.time[np.flatnonzero(mark)[0]]
    assert first == pytest.approx((2.0 * np.pi - 0.6) / 3.0, abs=0.05)
    drifting = made(("motor.w",), logger=replace(PLAIN, drift=0.01, gaps=((1.0, 2.0),)))
    assert drifting.gaps == [(1.0, 2.0)] and drifting.missing == pytest.approx(0.2, abs=0.01)
    late = drifting.time > 2.0
    shown = np.interp(drifting.time[late] * 1.01, true.time, true.columns["motor.w"])
    inside = drifting.time[late] * 1.01 < true.time[-1]
    np.testing.assert_allclose(drifting.columns["motor.w"][late][inside], shown[inside], atol=0.01)


def test_a_recording_is_written_as_it_is_read(tmp_path):
    recording = made(("motor.i", "motor.w"), logger=replace(PLAIN, noise=0.01))
    for name in ("run.csv", "run.csv.gz"):
        write_recording(recording, tmp_path / name)
        again = read_recording(tmp_path / name)
        assert again.heads == recording.heads and set(again.columns) == set(recording.columns)
        np.testing.assert_allclose(again.time, recording.time, rtol=1e-6)
        for column, x in recording.columns.items():
            np.testing.assert_allclose(again.columns[column], x, rtol=1e-6)
    first = (tmp_path / "run.csv.gz").read_bytes()
    write_recording(recording, tmp_path / "run.csv.gz")
    assert (tmp_path / "run.csv.gz").read_bytes() == first


def test_another_integrator_is_refused():
    with pytest.raises(InputError, match="integrator 'euler': must be one of compiled, monolithic"):
        made(("motor.w",), integrator="euler")
