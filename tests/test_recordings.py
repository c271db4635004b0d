"""Recordings: what a file says is what is read, and each fault is answered by its column and a remedy."""

from __future__ import annotations

import gzip
import re
from dataclasses import replace

import numpy as np
import pytest
from synthetic import write_recording

from chainunit import InputError
from chainunit.capabilities.identification.identification import read_runs
from chainunit.capabilities.identification.reading import PlannedRun
from chainunit.capabilities.watch.watch import watch
from chainunit.recordings.inspection import (
    Expectation,
    _turning_speed,
    inspect_columns,
    inspect_motion,
    inspect_steadiness,
    inspect_work,
)
from chainunit.recordings.recording import (
    Recording,
    read_part,
    read_recording,
)
from chainunit.study.config import parse

SPEED, RATIO, RATE = 3.0, 50.0, 0.83
EXPECTED = {
    "motor.i": Expectation(0.04, 5.3, "limit.i = 4.4 A"),
    "motor.u": Expectation(2.4, 290.0, "limit.v = 240 V"),
    "motor.w": Expectation(7.0, 300.0, "the speed of the motor"),
}


def recorded(rate=1000.0, duration=10.0, **changes):
    """A recording such as the sensors of a DC drive give it, with 12 bits and noise; columns may be changed."""
    rng = np.random.default_rng(5)
    time = np.arange(round(rate * duration)) / rate
    angle = SPEED * time

    def analog(x, full):
        noisy = x + 0.01 * np.sqrt(np.mean(x**2)) * rng.standard_normal(len(time))
        return np.round(noisy / full * 2048.0) * full / 2048.0

    columns = {
        "motor.i": analog(0.5 + 0.6 * np.sin(angle) + 0.1 * np.sin(2.0 * angle + 1.0), 5.0),
        "motor.u": analog(196.0 + 6.0 * np.sin(angle), 250.0),
        "motor.w": analog(150.0 + 3.0 * np.cos(angle), 200.0),
        "mark": np.append(0.0, np.diff(np.floor(angle / (2.0 * np.pi)))),
    } | changes
    heads = {"time": "time [s]", "mark": "mark [1]", "motor.i": "motor.i [A]", "motor.u": "motor.u [V]"}
    return Recording("run.csv", time, columns, heads | {"motor.w": "motor.w [rad/s]"})


def rows(recording, keep):
    """The recording with these rows alone."""
    columns = {name: x[keep] for name, x in recording.columns.items()}
    return Recording(recording.source, recording.time[keep], columns, recording.heads)


def faults(recording, speeds=(SPEED, SPEED), off=None):
    found = inspect_motion(recording, speeds, RATIO, off) or inspect_columns(recording, EXPECTED, off)
    return [str(each) for each in found]


GOOD = recorded()
I, U, W = (GOOD.columns[name] for name in ("motor.i", "motor.u", "motor.w"))


def stuck():
    x = I.copy()
    x[2000:5000] = x[2000]
    return x


def test_a_good_recording_has_no_fault():
    assert faults(GOOD) == []
    # the mark alone tells of the angle, a tenth of the rows may be missing, and a part may begin anywhere
    assert faults(rows(GOOD, np.arange(len(I)) % 5000 > 500)) == []
    assert faults(GOOD.part(1.234, 9.0)) == []
    assert faults(recorded(rate=200.0)) == []


@pytest.mark.parametrize(
    ("changes", "column", "words"),
    [
        ({"motor.i": 1000.0 * I}, "motor.i [A]", "the values look like mA; write [mA] into its head"),
        ({"motor.u": 0.001 * U}, "motor.u [V]", "the values look like kV"),
        ({"motor.i": -I}, "motor.i [A]", "the sign is reversed"),
        ({"motor.w": -W}, "motor.w [rad/s]", "the sign is reversed"),
        ({"motor.i": np.clip(I, -0.7, 0.7)}, "motor.i [A]", "have its largest value, 0.7 A: it is clipped"),
        ({"motor.i": stuck()}, "motor.i [A]", "keeps the value"),
        ({"motor.i": U, "motor.u": I}, "motor.i [A]", "the two columns look swapped"),
        ({"motor.w": 0.01 * (W - 150.0), "mark": 0.0 * I}, "motor.w [rad/s]", "the machine stands"),
        ({"motor.w": 0.01 * (W - 150.0)}, "motor.w [rad/s]", "of -0.001027 rad/s, although the mark is passed 4"),
        ({"motor.w": I, "motor.i": W}, "motor.w [rad/s]", "and of motor.i [A] 149.9 A: the two columns look swapped"),
        ({"motor.w": I, "motor.i": W, "mark": 0.0 * I}, "motor.w [rad/s]", "A: the two columns look swapped"),
        ({"mark": 0.0 * I}, "mark [1]", "is not passed in 5 turns"),
        ({"motor.i": 50.0 * I}, "motor.i [A]", "must be from 0.04 A to 5.3 A (limit.i = 4.4 A): check the sensor"),
    ],
)  # fmt: skip
def test_a_fault_names_its_column(changes, column, words):
    (fault,) = faults(recorded(**changes))
    assert fault.startswith(f"run.csv, column {column}: ") and words in fault


@pytest.mark.parametrize(("head", "values", "true"), [("mA", 1.0, "A"), ("kA", 1.0, "A"), ("kA", 1e3, "mA")])
def test_the_likely_unit_is_another_one_than_the_head_has(head, values, true):
    """The numbers of the column as they stand in the file, with a wrong unit."""
    factor = {"mA": 1e-3, "kA": 1e3}[head]
    recording = recorded(**{"motor.i": factor * values * I})
    (fault,) = faults(replace(recording, heads=recording.heads | {"motor.i": f"motor.i [{head}]"}))
    assert f"the values look like {true}; write [{true}] into its head" in fault


def wandering(share, **more):
    """A recording whose speed changes by this share to both sides, in some seconds."""
    angle = SPEED * (time := np.arange(40000) / 1000.0) + SPEED * share * np.sin(RATE * time) / RATE
    noise = 1.0 + 0.01 * np.random.default_rng(6).standard_normal(len(time))
    w = SPEED * RATIO * (1.0 + share * np.cos(RATE * time)) * noise
    columns = {"motor.i": 0.5 + 0.6 * np.sin(angle), "motor.w": w, "mark": turned(angle)} | more
    return Recording("run.csv", time, columns, GOOD.heads | {"motor.count": "motor.count [1]"}), angle


def turned(angle):
    return np.append(0.0, np.diff(np.floor(angle / (2.0 * np.pi))))


def test_a_speed_that_wanders_is_told_before_a_fit():
    """By the mark, by an encoder and by the speed alone, with its true range and spread; a motor that warms up, and a
    gap, wander not."""
    recording, angle = wandering(0.06)
    names = [name for name in recording.columns if name != "mark"]
    without = replace(recording, columns={name: recording.columns[name] for name in names})
    counted = {
        "motor.i": without.columns["motor.i"],
        "motor.count": np.floor(angle * RATIO * 4096 / 2 / np.pi),
    }
    for each, name in ((recording, "mark [1]"), (replace(without, columns=counted), "motor.count [1]"),
                       (without, "motor.w [rad/s]")):  # fmt: skip
        (fault,) = map(str, inspect_steadiness(each, RATIO, follows=True))
        words = fault.replace(",", "").split()
        assert fault.startswith(
            f"run.csv, column {name}: the mean speed of the crank in a turn wanders from "
        )
        low, high = (float(words[words.index(word) + 1]) for word in ("from", "to"))
        # over a turn the mean of the change is less
        half = RATE * np.pi / SPEED
        mean = 0.06 * np.sin(half) / half
        assert low == pytest.approx(SPEED * (1.0 - mean), rel=0.01)
        assert high == pytest.approx(SPEED * (1.0 + mean), rel=0.01)
        share = float(words[words.index("deviation") + 2])
        assert share == pytest.approx(100.0 * mean / np.sqrt(2.0), rel=0.25)
        assert "state its changes (speeds), name a part in which it is steady (begin, end)" in fault
        assert "speeds" not in str(inspect_steadiness(each, RATIO)[0])
    for each in (wandering(0.005)[0], GOOD, rows(GOOD, (GOOD.time < 2.0) | (GOOD.time > 4.5))):
        assert inspect_steadiness(each, RATIO) == []
    time = recording.time
    warm = SPEED * time - SPEED * 0.03 * 10.0 * (time + 10.0 * (np.exp(-time / 10.0) - 1.0)) / 10.0
    assert inspect_steadiness(wandering(0.0, mark=turned(warm))[0], RATIO) == []
    # after the motor was switched off, the speed may fall
    assert inspect_steadiness(recording, RATIO, off=6.0) == []


def test_a_turn_whose_work_has_the_wrong_sign_is_named():
    """A part of the rows with the sign turned, in a steady run; a machine that takes no work has no sign."""
    time = np.arange(20000) / 1000.0
    tau = 100.0 + 80.0 * np.sin(SPEED * time)
    heads = {"time": "time [s]", "crank.tau": "crank.tau [N m]", "mark": "mark [1]"}

    def told(x):
        columns = {"crank.tau": x, "mark": turned(SPEED * time)}
        return [str(each) for each in inspect_work(Recording("run.csv", time, columns, heads), RATIO)]

    assert told(tau) == [] == told(tau - 100.0)
    (fault,) = told(np.where((time > 4.0) & (time < 9.0), -tau, tau))
    turn = 2.0 * np.pi / SPEED
    begin, end = (float(fault.split(word)[1].split()[0]) for word in ("turn from ", " to "))
    assert (begin, end) == pytest.approx((2.0 * turn, 3.0 * turn), abs=2e-3)
    assert (
        "column crank.tau [N m]: mean of -" in fault
        and "the work of 2 of 8 turns has the wrong sign" in fault
    )


def test_the_sign_of_a_machine_that_takes_hardly_any_energy():
    """Its mean is that of an offset: the simulated course tells the sign, and a clear mean where there is none."""
    rng = np.random.default_rng(1)
    swing = 178.0 * np.sin(SPEED * GOOD.time) + rng.standard_normal(len(GOOD.time))
    heads = {"time": "time [s]", "crank.tau": "crank.tau [N m]"}

    def told(x, likeness):
        recording = Recording("run.csv", GOOD.time, {"crank.tau": x}, heads)
        found = inspect_columns(recording, {"crank.tau": Expectation(20.0, 700.0, "", likeness)})
        return [str(each) for each in found]

    swing -= np.mean(swing)
    for mean in (-0.49, -15.0):
        assert told(swing + mean, 0.0) == [] == told(swing + mean, 0.9)
        (fault,) = told(swing + mean, -0.9)
        assert (
            f"mean of {mean:.4g} N m at an RMS of {np.hypot(mean, np.std(swing)):.4g} N m, although" in fault
        )
        assert "the sign is reversed" in fault
    assert told(swing - 40.0, 0.0) and told(swing - 40.0, 0.9) == []


def test_faults_of_the_rows():
    missing = rows(GOOD, (GOOD.time < 2.0) | (GOOD.time > 6.0))
    (fault,) = faults(missing)
    assert "column time [s]: 40 % of the rows are missing, 4 s of them in one piece from 1.999 s" in fault
    assert missing.missing == pytest.approx(0.4, abs=1e-3) and missing.gaps == [(1.999, 6.001)]
    slow = recorded(rate=5.0, duration=60.0)
    (fault,) = faults(slow)
    assert (
        "5 rows a second are 10 in a turn of the crank; record >= 20 rows a second, correct crank_speed"
        in fault
    )
    (fault,) = faults(GOOD.part(0.0, 2.5))
    assert (
        "2.5 s are 1.19 turns of the crank at crank_speed; record >= 3 turns, or correct crank_speed" in fault
    )


@pytest.mark.parametrize(
    ("factor", "unit", "words"),
    [
        (1e3, "s", "time [s]: 9999 s with 2.1 rows in a turn of the crank: the values look like ms; write [ms] into"),
        (1e6, "s", "the values look like µs; write [µs] into its head"),
        (1e-3, "ms", "the values look like s; write [s] into its head"),
        (200.0, "s", "2000 s; must be <= 1200 s: name a part (begin, end), of which a minute is enough"),
    ],
)  # fmt: skip
def test_times_of_another_unit(factor, unit, words):
    """Such a run would be simulated for minutes."""
    good = recorded(rate=20.0 * 1000.0 if factor == 200.0 else 1000.0)
    heads = {**good.heads, "time": f"time [{unit}]"}
    columns = {name: x for name, x in good.columns.items() if name != "mark"}
    (fault,) = inspect_motion(Recording("run.csv", factor * good.time, columns, heads), (SPEED, SPEED), RATIO)
    assert words in str(fault)


def passes(*angles):
    """A mark that is passed at these angles of a turn."""
    angle = SPEED * GOOD.time / (2.0 * np.pi)
    return sum(np.append(0.0, np.diff(np.floor(angle - at / (2.0 * np.pi)))) for at in angles)


def test_a_mark_is_passed_once_in_a_turn():
    (fault,) = faults(recorded(mark=0.0 * I + 1.0))
    assert fault.startswith(
        "run.csv, column mark [1]: is 1 in all 10000 rows of 4.77 turns of the crank; must be 1 only"
    )
    assert "only in the first row after the mark, once in a turn" in fault
    (fault,) = faults(recorded(mark=passes(0.0, 2.0)))
    assert "is 1 in 9 rows of 4.77 turns of the crank" in fault
    # a target of some width
    (fault,) = faults(recorded(mark=np.convolve(passes(0.0), np.ones(9))[: len(I)]))
    assert "is 1 in 36 rows" in fault
    (fault,) = faults(recorded(mark=passes(0.0) * (GOOD.time < 3.0)))
    assert "is 1 in 1 rows of 4.77 turns" in fault
    assert faults(recorded(mark=passes(0.5))) == []
    # the crank turns at half the speed for a part of the run, by the reference or as measured
    assert (
        faults(recorded(), (0.8 * SPEED, 2.0 * SPEED)) == [] and faults(recorded(), (2.0 * SPEED,) * 2) == []
    )


COUNT = np.floor(SPEED * RATIO * 4096.0 / (2.0 * np.pi) * GOOD.time)


@pytest.mark.parametrize("stated", [0.03, 0.1, 100.0])
@pytest.mark.parametrize(
    ("left_out", "column"),
    [
        ((), "mark"),
        (("mark",), "motor.count"),
        (("mark", "motor.count"), "motor.w"),
        (("motor.count", "motor.w"), "mark"),
        (("mark", "motor.w"), "motor.count"),
    ],
)
def test_a_stated_speed_far_from_that_of_the_recording_is_the_one_cause(stated, left_out, column):
    """And not that the rows are too few, that marks are missing, or that the machine stands. With the speed that the
    refusal names there is no fault."""
    columns = {name: x for name, x in (GOOD.columns | {"motor.count": COUNT}).items() if name not in left_out}
    recording = replace(GOOD, columns=columns, heads=GOOD.heads | {"motor.count": "motor.count [1]"})
    stated *= SPEED
    (fault,) = map(str, inspect_motion(recording, (stated, stated), RATIO))
    assert (
        f"column {column}" in fault
        and "the crank turns at" in fault
        and f"crank_speed is {stated:.5g} " in fault
    )
    (remedy,) = re.findall('crank_speed = "(.*) rev/min"', fault)
    speed = float(remedy) * np.pi / 30.0
    assert speed == pytest.approx(SPEED, rel=0.01) and inspect_motion(recording, (speed, speed), RATIO) == []


@pytest.mark.parametrize("stated", [0.45, 0.3])
@pytest.mark.parametrize("left_out", [("mark",), ("mark", "motor.w")])
def test_a_column_that_repeats_after_several_turns_tells_the_time_of_one(stated, left_out):
    """At half the speed the refusal named a third of it, with the remedy to state this third."""
    whole = recorded(rate=200.0, duration=60.0)
    columns = {name: x for name, x in whole.columns.items() if name not in left_out}
    name, speed, error = _turning_speed(replace(whole, columns=columns), stated * SPEED, RATIO, 0.01)
    assert name in ("motor.i", "motor.u", "motor.w") and speed == pytest.approx(SPEED, rel=error)


def test_a_stated_speed_is_not_blamed_for_another_fault():
    """Marks and measured speed contradict each other; a time without its unit slows down the mark alone."""
    columns = {name: x for name, x in GOOD.columns.items() if name != "motor.w"}
    six = {"mark": passes(0.0, 1.05, 2.09, 3.14, 4.19, 5.24)}
    for part in (GOOD.columns, columns):
        (fault,) = faults(replace(GOOD, columns=part | six))
        assert "is 1 in" in fault
        slow = replace(GOOD, time=1e3 * GOOD.time, columns=part)
        (fault,) = (str(each) for each in inspect_motion(slow, (SPEED, SPEED), RATIO) if "time" in str(each))
        assert "the values look like ms; write [ms] into its head" in fault


def test_an_encoder_counts_up_and_does_not_begin_anew():
    count = COUNT

    def of_count(x):
        columns = {name: x for name, x in GOOD.columns.items() if name != "mark"} | {"motor.count": x}
        return faults(
            Recording("run.csv", GOOD.time, columns, GOOD.heads | {"motor.count": "motor.count [1]"})
        )

    assert of_count(count) == [] == of_count(count + 3e9)
    (fault,) = of_count(-count)
    assert "motor.count [1]: counts down, while the motor turns forward: change its sign" in fault
    (fault,) = of_count(count % 65536.0)
    assert "falls by 65" in fault and "the counter begins anew; write the count without the jump" in fault
    # by less than 10,000: a counter that is set back by hand, and one of the turn
    (fault,) = of_count(np.where(GOOD.time < 0.05, count, count - count[50]))
    assert "at 0.05 s: the counter begins anew" in fault
    (fault,) = of_count(count % 9000.0)
    assert "the counter begins anew" in fault
    # after the motor was switched off, the crank rocks back about as fast as it turned
    after = np.maximum(GOOD.time - 5.0, 0.0)
    rocking = np.where(after > 0.0, count[5000] - 9000.0 * np.sin(12.0 * after) * np.exp(-after), count)
    assert np.diff(rocking).min() < -100.0 and of_count(rocking) == []


def coast(current=0.0):
    """The motor is switched off at 4 s; then its electric columns are zero, and the speed falls to zero."""
    on = GOOD.time <= 4.0
    zero = {"motor.i": np.where(on, I, current), "motor.u": np.where(on, U, 0.0)}
    rolling = W * np.where(on, 1.0, np.exp(4.0 - GOOD.time))
    return recorded(**zero, **{"motor.w": rolling}, mark=passes(0.0) * (GOOD.time < 6.0))


def test_electric_columns_are_inspected_until_the_motor_is_switched_off():
    assert faults(coast(), off=4.0) == [] and len(faults(coast())) == 2
    assert faults(coast(-500.0), off=4.0) == []
    high = coast()
    high.columns["motor.i"][:3500] *= 1e3
    (fault,) = faults(high, off=4.0)
    assert "column motor.i [A]: RMS of" in fault and "look like mA" in fault
    # a column of motion is inspected behind it
    stopped = coast()
    stopped.columns["motor.w"][6000:8000] = 20.0
    (fault,) = faults(stopped, off=4.0)
    assert "column motor.w [rad/s]: keeps the value 20 rad/s from 6 to 7.999 s" in fault


def written(folder, text, name="run.csv"):
    file = folder / name
    file.write_bytes(gzip.compress(text.encode()) if name.endswith(".gz") else text.encode())
    return file


def table(head, mark=","):
    """A file with this head and 150 rows, of which column k has k + row."""
    lines = [
        mark.join(str(0.001 * row if not k else k + row) for k in range(head.count(mark) + 1))
        for row in range(150)
    ]
    return "\n".join([head, *lines]) + "\n"


@pytest.mark.parametrize("name", ["run.csv", "run.csv.gz"])
def test_units_of_columns_are_converted(tmp_path, name):
    file = written(tmp_path, table("time [ms],motor.i [mA],room [degC],motor.w [rpm],mark [1]"), name)
    recording = read_recording(file)
    assert set(recording.columns) == {"motor.i", "motor.w", "mark"}
    assert recording.step == pytest.approx(1e-6) and recording.missing == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(recording.columns["motor.i"], 1e-3 * (1.0 + np.arange(150)))
    np.testing.assert_allclose(recording.columns["motor.w"], np.pi / 30.0 * (3.0 + np.arange(150)))


def test_columns_may_have_other_heads_and_decimal_commas(tmp_path):
    text = table("Zeit [s];Strom [A];Leistung [kW]", ";").replace(".", ",")
    names = {"time": "Zeit", "motor.i": "Strom", "motor.power": "Leistung [kW]"}
    recording = read_recording(written(tmp_path, text), names)
    np.testing.assert_allclose(recording.columns["motor.power"], 1e3 * (2.0 + np.arange(150)))
    assert recording.heads["motor.i"] == "Strom [A]" and recording.time[-1] == pytest.approx(0.149)
    remarked = table("time [s],motor.i [A]").replace("\n0.003,", "\n# logger restarted, 3\n0.003,")
    assert len(read_recording(written(tmp_path, remarked)).time) == 150


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time [s],motor.i [A]\n0,1\n", "has 1 rows behind its head; must have >= 100"),
        (table("t [s],motor.i [A]"), "has no column time [s]"),
        (table("time [s],x [A]"), "has no column of a known quantity, such as motor.i [A], "),
        (table("time [s],motor.i"), "column motor.i: has no unit; write [A] behind its name"),
        (table("time [s],motor.i [V]"), "column motor.i [V]: V is a voltage; must be a current in A or mA"),
        (table("time [s],motor.i [A]").replace("\n0.003,4\n", "\n0.003,x\n"),
         "line 5, column 2, motor.i [A]: x is no number"),
        (table("time [s],motor.i [A]").replace("\n0.003,4\n", "\n0.003\n"),
         "line 5: has 1 cell, and the head 2: a mark between columns is left out, or a cell"),
        (table("time [s],motor.i [A]").replace("\n0.003,4\n", "\n\n0.003,1e999\n"),
         "line 6, column 2, motor.i [A]: 1e999 is no number"),
        (table("time [s],motor.i [A]").replace("\n0.003,4\n", "\n1_000,4\n"),
         "line 5, column 1, time [s]: 1_000 is no number"),
        (table("time [s],motor.i [A]").replace("\n0.003,4\n", "\n0.001,4\n"),
         "line 5: time = 0.001 s: must be later than 0.002 s of the line before"),
        (table("Zeit [s],Strom [A]"),
         "its heads are: Zeit [s], Strom [A]; name it by the key columns, such as columns = { \"time\" = \"Zeit\" }"),
        (table("time [s],Strom [A]"),
         "heads are: time [s], Strom [A]; name it by the key columns, such as columns = { \"motor.i\" = \"Strom\" }"),
        (table("time [s],motor.w [kg]"), "[kg]: kg is a mass; must be a speed in rev/min, rad/s, Hz or rpm"),
        (table("time [s],motor.power [kWh]"), "kWh is a torque or an energy; must be a power in kW or W"),
        (table("time [s],crank.tau [%]"), "[%]: % is a share; must be a torque in N m or kN m"),
        (table("time [s],motor.w [1/s]"), "must have a unit like [rad/s]: no angle is named"),
        (table("time [s],motor.i [Foo]"), "must have a unit like [A]: Foo: is no unit"),
    ],
)  # fmt: skip
def test_files_that_are_no_recording(tmp_path, text, words):
    with pytest.raises(InputError) as refusal:
        read_recording(written(tmp_path, text))
    assert words in str(refusal.value)


def test_all_faults_of_a_head_at_once(tmp_path):
    with pytest.raises(InputError) as refusal:
        read_recording(written(tmp_path, table("time,motor.u [A]")), {"motor.y": "x", "motor.i": "Stron"})
    text = str(refusal.value)
    assert "columns.motor.y: no such quantity" in text and "columns.motor.i = 'Stron': no such column" in text
    assert (
        "column time: has no unit" in text
        and "column motor.u [A]: A is a current; must be a voltage in V or kV" in text
    )
    with pytest.raises(InputError, match="cannot be read"):
        read_recording(tmp_path / "absent.csv")


def test_a_part_is_within_the_recording_and_counts_from_its_first_row(tmp_path):
    """With rows of 1 ms from 0 s to 0.149 s; an end may be that of the last row's step."""
    file = written(tmp_path, table("time [s],motor.i [A],motor.count [1]"))
    part = read_part(file, {}, 0.01, 0.15)
    np.testing.assert_array_equal(part.columns["motor.count"], np.arange(140.0))
    assert part.columns["motor.i"][0] == 11.0
    # a part of a part goes on counting
    assert part.part(begin=0.1).columns["motor.count"][0] == 90.0
    with pytest.raises(InputError) as refusal:
        read_part(file, {}, -0.01, 0.2)
    first, second = str(refusal.value).splitlines()
    assert first == f"begin = -0.01 s: {file} goes from 0 s to 0.149 s; must lie within, or be left out"
    assert second.startswith("end = 0.2 s: ")
    with pytest.raises(
        InputError, match=r"has 49 rows from begin = 0\.101 s to the last row; must have >= 100 "
    ):
        read_part(file, {}, 0.101, np.inf)
    with pytest.raises(InputError, match=r"has 51 rows from the first row to end = 0\.05 s"):
        read_part(file, {}, -np.inf, 0.05)


def test_counts_and_times_are_written_in_full(tmp_path):
    time = 1.7e9 + 1e-3 * np.arange(150)
    count = 123456789.0 + np.arange(150)
    heads = {"time": "t [s]", "motor.count": "n", "motor.i": "Strom [mA]"}
    columns = {"motor.count": count, "motor.i": np.linspace(0.1, 0.2, 150)}
    write_recording(Recording("x", time, columns, heads), tmp_path / "run.csv")
    again = read_recording(tmp_path / "run.csv")
    np.testing.assert_array_equal(again.columns["motor.count"], count)
    np.testing.assert_allclose(again.time - 1.7e9, time - 1.7e9, atol=1e-5)
    np.testing.assert_allclose(again.columns["motor.i"], columns["motor.i"], rtol=1e-6)


def run(name, file, **more):
    plan = PlannedRun(file, {}, SPEED, -np.inf, np.inf, 293.15, name, name != "empty", {})
    return replace(plan, **more)


def test_faults_of_all_files_at_once(tmp_path):
    """Absent ones, one with the rows of another one, and one without a signal whose columns have other names."""
    same, other = (written(tmp_path, table("time [s],motor.i [A]"), f"{name}.csv") for name in "ab")
    foreign = written(tmp_path, table("time [s],motor.w [rad/s],Strom [A]"), "foreign.csv")
    runs = [
        run("loaded", same),
        run("empty", other),
        run("third", foreign),
        run("fourth", tmp_path / "absent"),
    ]
    with pytest.raises(InputError) as refusal:
        read_runs(runs)
    rows, names, absent = str(refusal.value).splitlines()
    assert (
        rows
        == f"identify.run (empty): {other} has rows of the run loaded; each run must have its own recording"
    )
    assert (
        "has no column that tells the torque" in names
        and "its other heads are: Strom [A]; name it by" in names
    )
    assert "absent: cannot be read" in absent
    assert list(read_runs(runs[:1])) == ["loaded"]
    # parts of one file that overlap
    first, second = run("loaded", same, end=0.1), run("second", same, begin=0.049)
    with pytest.raises(InputError, match=r"second.*has rows of the run loaded"):
        read_runs([first, second])
    text = '[watch]\nfile = "absent.csv"\nidentification = "none.json"\n'
    with pytest.raises(InputError) as refusal:
        watch(parse(text))
    recording, result = str(refusal.value).splitlines()
    assert recording.startswith("absent.csv: cannot be read (")
    assert result.startswith("watch.identification = none.json: cannot be read (")


@pytest.mark.parametrize(
    ("part", "words"),
    [
        ("begin = 4\n", "must be > begin = 4 s"),
        ("end = 2\n", "must be < end = 2 s"),
        ("begin = 4\nend = 9\n", "must be > begin = 4 s and < end = 9 s"),
    ],
)
def test_a_switch_outside_of_the_part_is_refused_by_its_ends_that_are_given(part, words):
    text = f'[[identify.run]]\nfile = "run.csv"\nswitched_off = 3\n{part}'
    with pytest.raises(InputError) as refusal:
        parse(text)
    assert f"identify.run.1.switched_off = 3 s: {words}" in str(refusal.value).splitlines()
