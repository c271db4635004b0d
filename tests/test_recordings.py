"""Recordings: what a file says is what is read, and each fault is answered by its column and a remedy."""

from __future__ import annotations

import gzip

import numpy as np
import pytest

from chainunit import InputError
from chainunit.study.identification.inspection import Expectation, inspect
from chainunit.study.identification.recording import Recording, read_recording

SPEED, RATIO = 3.0, 50.0
EXPECTED = {
    "motor.i": Expectation(0.04, 5.3, "limit.i = 4.4 A", driving=True),
    "motor.u": Expectation(2.4, 290.0, "limit.v = 240 V", driving=True),
    "motor.w": Expectation(7.0, 300.0, "the speed of the motor", driving=True),
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


def faults(recording):
    return [str(each) for each in inspect(recording, EXPECTED, SPEED, RATIO)]


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
        ({"motor.w": 0.01 * (W - 150.0)}, "motor.w [rad/s]", "the machine stands"),
        ({"mark": 0.0 * I}, "mark [1]", "is not passed in 5 turns"),
        ({"motor.i": 50.0 * I}, "motor.i [A]", "must be from 0.04 A to 5.3 A (limit.i = 4.4 A): check the sensor"),
    ],
)  # fmt: skip
def test_a_fault_names_its_column(changes, column, words):
    (fault,) = faults(recorded(**changes))
    assert fault.startswith(f"run.csv, column {column}: ") and words in fault


def test_faults_of_the_rows():
    missing = rows(GOOD, (GOOD.time < 2.0) | (GOOD.time > 6.0))
    (fault,) = faults(missing)
    assert "column time [s]: 40 % of the rows are missing, 4 s of them in one piece from 2 s" in fault
    assert missing.missing == pytest.approx(0.4, abs=1e-3) and missing.gaps == [(1.999, 6.001)]
    slow = recorded(rate=5.0, duration=60.0)
    (fault,) = faults(slow)
    assert "5 rows a second are 10 in a turn of the crank; record >= 19 rows a second" in fault
    (fault,) = faults(GOOD.part(0.0, 2.5))
    assert "2.5 s are 1.2 turns of the crank; record >= 3 turns" in fault


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


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time [s],motor.i [A]\n0,1\n", "has 1 rows behind its head; must have >= 100"),
        (table("t [s],motor.i [A]"), "has no column time [s]"),
        (table("time [s],x [A]"), "has no column of a known quantity, such as motor.i [A], "),
        (table("time [s],motor.i"), "column motor.i: has no unit; write [A] behind its name"),
        (table("time [s],motor.i [V]"), "column motor.i [V]: must have a unit like [A]"),
        (table("time [s],motor.i [A]").replace("\n0.003,4\n", "\n0.003,-\n"), "line 5, column 2: - is no number"),
        (table("time [s],motor.i [A]").replace("\n0.003,4\n", "\n0.003\n"),
         "line 5, column 2: an empty cell is no number"),
        (table("time [s],motor.i [A]").replace("\n0.003,4\n", "\n0.001,4\n"),
         "line 5: time = 0.001 s: must be later than 0.002 s of the line before"),
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
    assert "column time: has no unit" in text and "column motor.u [A]: must have a unit like [V]" in text
    with pytest.raises(InputError, match="cannot be read"):
        read_recording(tmp_path / "absent.csv")
