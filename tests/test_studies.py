"""`Study` gives the results of the command."""

from __future__ import annotations

import doctest
import gc
import json
import re
from xml.etree import ElementTree

import numpy as np
import pytest
import xarray as xr
from command import chainunit

from chainunit import ChainUnitMachine, InputError, RunError, Study, StudyResult, WriteError
from chainunit.app import studies
from chainunit.core.files import LIST, FileList, claim
from chainunit.reading.result_entries import ResultEntries
from chainunit.study.record import StudySetup

pytestmark = pytest.mark.second

FILE = """
title = "<b>Short</b> & quick"
[machine]
r = "160 mm"
ratio = 25
[run]
ramp = 0.3
settle_turns = 1
turns = 1
step = "4 ms"
crank_speed = "60 rev/min"
[[event]]
type = "jam"
side = "left"
force = "1 kN"
"""
TABLES = {
    "title": "<b>Short</b> & quick",
    "machine": {"r": "160 mm", "ratio": np.int64(25)},
    "run": {"ramp": 0.3, "settle_turns": 1, "turns": np.float64(1.0), "step": "4 ms", "crank_speed": "60 rev/min"},
    "event": ({"type": "jam", "side": "left", "force": "1 kN"},),
}  # fmt: skip


@pytest.fixture(scope="module")
def result():
    return Study(**TABLES).run()


@pytest.fixture(scope="module")
def command(tmp_path_factory):
    """The folder of the same study by the command."""
    folder = tmp_path_factory.mktemp("command")
    (folder / "short.toml").write_text(FILE)
    process = chainunit("study", "short.toml", "-o", "out", cwd=folder)
    assert process.returncode == 0, process.stderr
    return folder / "out"


def test_python_and_the_command_find_the_same(result, command, tmp_path):
    written = result.save(tmp_path / "out", png=True)
    assert {file.name for file in written} == {p.name for p in command.iterdir()} - {"fmu", LIST}
    assert {p.name for p in (tmp_path / "out").iterdir()} == {p.name for p in command.iterdir()}
    for name in ("ChamberForces.fmu", "DcMotor.fmu"):
        assert (tmp_path / "out" / "fmu" / name).stat().st_size > 1000
    python, by_command = (
        ResultEntries(json.loads((f / "result.json").read_text())) for f in (tmp_path / "out", command)
    )
    assert python.pop("source") == "tables in Python" and by_command.pop("source") == "short.toml"
    # a file has lines, tables have none
    assert python["given"].pop("places") == {} and by_command["given"].pop("places")
    assert python == by_command
    assert ResultEntries(json.loads(result.to_json()))["answers"] == python["answers"]


def test_a_foreign_fmu_is_seen_before_earlier_results_are_removed(tmp_path):
    (tmp_path / "fmu").mkdir()
    (tmp_path / "fmu" / "DcMotor.fmu").write_text("mine")
    (tmp_path / "torque.png").write_text("of an earlier run")
    FileList(tmp_path).add(tmp_path / "torque.png", tmp_path / "torque.png")
    with pytest.raises(InputError, match=r"fmu/DcMotor\.fmu: would be lost, as chainunit did not write it"):
        Study(**TABLES).run(tmp_path)
    assert (tmp_path / "torque.png").exists() and (tmp_path / "fmu" / "DcMotor.fmu").read_text() == "mine"
    # results of other kinds see theirs before they compute, as their commands do
    (tmp_path / "identified.toml").write_text("mine")
    with pytest.raises(InputError, match=r"identified\.toml: would be lost"):
        Study(**TABLES).identify(tmp_path)


def test_an_unknown_backend_is_refused(tmp_path):
    with pytest.raises(
        InputError, match=r'backend = "natve": must be one of native, python; was "native" meant'
    ):
        Study(**TABLES).run(tmp_path / "out", backend="natve")
    assert not (tmp_path / "out" / "result.json").exists()


def test_a_file_that_cannot_be_written_is_a_public_error(result, tmp_path, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    folder = tmp_path / "out"
    folder.mkdir()
    monkeypatch.setattr("os.replace", full)
    with pytest.raises(WriteError, match="No space left"):
        result.save(folder)


def test_answers_are_a_table_with_units(result):
    numbers, table = ResultEntries(json.loads(result.to_json())), result.answers
    assert list(table.columns) == ["unit", "start_up", "steady", "jam_left"]
    for run in ("steady", "jam_left"):
        for name, entry in numbers["answers"][run].items():
            if entry["value"] is not None:
                assert table.loc[name, run] == entry["value"] and table.loc[name, "unit"] == entry["unit"]
            else:
                assert name not in table.index or np.isnan(table.loc[name, run])
    assert table.loc["start_time", "start_up"] == numbers["start_up"]["start_time"]["value"]
    # of a start, a ripple says nothing; no row has nothing to say
    assert np.isnan(table.loc["speed_ripple", "start_up"]) and "coupling_trip_time" not in table.index
    assert set(table.dtypes.iloc[1:]) == {np.dtype(float)}


def test_runs_are_the_tree_in_the_file(result, command):
    with xr.open_datatree(command / "result.nc") as tree:
        assert list(result.runs) == [*tree.children, "steady"] == ["start_up", "jam_left", "steady"]
        for name in tree.children:
            assert result.runs[name].drop_attrs().equals(tree[name].to_dataset().drop_attrs())
    assert len(result.runs) == 3 and all(isinstance(run, xr.Dataset) for run in result.runs.values())
    assert result.runs["steady"].sizes["time"] < result.runs["start_up"].sizes["time"]
    force = result.runs["jam_left"]["machine.left.processing_force"]
    assert force.units == "N" and float(force.max()) == pytest.approx(1010.0)
    # as the documentation says for a tool that knows no trees
    with xr.open_dataset(command / "result.nc", group="jam_left") as run:
        assert run["motor.w"].units == "rad/s"


def test_verdict_warnings_and_notes_are_texts(result, monkeypatch):
    numbers = ResultEntries(json.loads(result.to_json()))
    assert result.verdict.split("\n") == [numbers["verdict"][of]["text"] for of in ("model", "motor")]
    assert "Model of the organs, two bars" in result.verdict and "not valid" in result.verdict
    assert result.warnings == [each["text"] for each in numbers["warnings"]] and len(result.warnings) >= 2
    assert any("Static friction is not modelled" in note for note in result.notes)
    monkeypatch.setattr(StudySetup, "insufficient", "All runs are with one which is insufficient.")
    assert result.verdict.endswith("which is insufficient.")


def test_a_result_shows_itself(result):
    shown, html = repr(result), result._repr_html_()
    assert (
        "<b>Short</b> & quick" in shown
        and "\x1b" not in shown
        and max(map(len, shown.split("\n")[3:])) <= 120
    )
    assert re.search(r"crank torque, peak +│ +[\d.]+ N m │ +[\d.]+ N m", shown)
    for text in result.verdict.split("\n"):
        assert text in shown
    # escaped, and closed: a piece of a page
    tree = ElementTree.fromstring(f"<div>{html.replace(chr(0xA0), ' ')}</div>")
    assert tree.find("h3").text == "<b>Short</b> & quick"
    words = " ".join("".join(tree.itertext()).split())
    assert "crank torque, peak" in words and "a lump jams the left side" in words and "RMS" in words
    assert "mean" not in shown and "crank torque, mean" not in words


def test_files_of_a_result_without_a_folder_vanish_with_it(command):
    study = Study(**TABLES)
    result = study.run(backend="python")
    kept = result._folder
    assert (kept / "fmu" / "ChamberForces.fmu").exists()
    del result
    gc.collect()
    assert not kept.exists()


def test_a_run_in_a_folder_leaves_the_files_there(tmp_path, command):
    reports = []
    result = Study.from_text(FILE).run(tmp_path / "out", progress=lambda *report: reports.append(report))
    # of the command with figures as files
    files = {p.name for p in command.iterdir() if p.suffix != ".png"}
    assert {p.name for p in (tmp_path / "out").iterdir()} == files
    assert len({what for what, _, _ in reports}) >= 3 and all(done <= todo for _, done, todo in reports)
    # saved again where it lies already
    assert (tmp_path / "out" / "result.json") in result.save(tmp_path / "out")
    with (
        claim(tmp_path / "out"),
        pytest.raises(InputError, match="another chainunit writes to this folder"),
    ):
        Study(**TABLES).run(tmp_path / "out")


def test_a_run_that_is_stopped_keeps_what_it_has(tmp_path):
    def stop(what, done, todo):
        if done > 0.5 * todo:
            raise KeyboardInterrupt

    with pytest.raises(RunError, match="interrupted") as caught:
        Study(**TABLES).run(tmp_path / "out", progress=stop)
    partial = caught.value.partial
    assert isinstance(partial, StudyResult) and "The run stopped early: " in repr(partial)
    assert "The run stopped early: " in partial._repr_html_()
    assert ResultEntries(json.loads((tmp_path / "out" / "result.json").read_text()))["status"].startswith(
        "failed"
    )
    assert set(partial.answers.columns) <= {"unit", "start_up", "steady"}


def test_the_same_keys_and_checks_as_in_a_file():
    study = Study(**TABLES)
    assert study.machine.p.r == 0.16 and study.config.run.crank_speed == pytest.approx(2.0 * np.pi)
    assert study.config.file.given == Study.from_text(FILE).config.file.given
    with pytest.raises(InputError) as caught:
        Study(machin={}, run={"crank_speed": "30 kg"})
    assert {fault.key for fault in caught.value.faults} == {"run.crank_speed", "machin"}
    assert 'was "machine" meant?' in str(caught.value) and 'crank_speed = "30 kg"' in str(caught.value)
    with pytest.raises(InputError, match=r"^machine: r = 0.9 m: the crank cannot turn"):
        Study(machine={"r": 0.9})
    with pytest.raises(InputError, match=r"^machine = 3: must be a table"):
        Study(machine=3)
    with pytest.raises(InputError, match=r"^coupling = None: must be a table"):
        Study(coupling=None)
    with pytest.raises(InputError, match=r"^run.step = \[1.0, 2.0\]: must be a number in s"):
        Study(run={"step": np.array([1.0, 2.0])})


def test_a_text_and_a_file_tell_the_line(tmp_path):
    text = FILE.replace('"160 mm"', '"160 kg"')
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(InputError, match=r'^text in Python:4: machine.r = "160 kg"'):
        Study.from_text(text)
    with pytest.raises(InputError, match=r'mine.toml:4: machine.r = "160 kg"'):
        Study.from_file(tmp_path / "mine.toml")
    with pytest.raises(InputError, match=r"other.toml: cannot be read"):
        Study.from_file(str(tmp_path / "other.toml"))
    assert Study.from_file().config.file.is_packaged and not Study().config.file.is_packaged


OWN_MOTOR = """[[motor]]
designation = "pump"
power = "2.2 kW"
poles = 4
speed = "1455 rev/min"
efficiency = 0.867
power_factor = 0.8
breakdown_ratio = 3
locked_torque_ratio = 2.4
locked_current_ratio = 6.9
J = 0.0086
locked_time = 12
"""


def test_what_a_run_refuses_names_file_and_line(tmp_path):
    (tmp_path / "mine.toml").write_text('catalogue = "own.toml"\n[sizing]\n')
    (tmp_path / "own.toml").write_text(OWN_MOTOR)
    study = Study.from_file(tmp_path / "mine.toml")
    # beside the study file, as for the command
    assert study.config.file.catalogues == (tmp_path / "own.toml",)
    variant = study.with_values({"sizing.temperature": 400.0})
    (tmp_path / "own.toml").unlink()
    with pytest.raises(InputError, match=r"mine.toml:1: catalogue = .*own.toml: cannot be read"):
        study.run()
    assert variant.config.file.catalogues == (tmp_path / "own.toml",)
    with pytest.raises(InputError, match=r"^catalogue = .*own.toml: cannot be read"):
        variant.run(tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_other_values_make_another_study():
    study = Study(**TABLES)
    other = study.with_values({"machine.r": "170 mm", "event.jam_left.force": "3 kN"})
    assert (study.machine.p.r, other.machine.p.r) == (0.16, 0.17)
    assert study.config.events["jam_left"].p.force == 1000.0
    assert other.config.events["jam_left"].p.force == 3000.0
    assert (
        other.config.file.source
        == 'tables in Python with machine.r = "170 mm", event.jam_left.force = "3 kN"'
    )
    again = other.with_values({"machine.r": np.float64(0.165), "motor.rotor.J": 0.01})
    assert again.machine.p.r == 0.165 and again.config.events["jam_left"].p.force == 3000.0
    assert again.config.file.source.count("machine.r") == 1 and "motor.rotor.J = 0.01" in repr(again)
    assert list(study.with_values({"event": []}).config.events) == []
    right = study.with_values({"event.jam_left": {"type": "jam", "side": "right"}})
    assert list(right.config.events) == ["jam_right"] and list(study.config.events) == ["jam_left"]
    assert study.with_values({}).config.file.source == "tables in Python"
    with pytest.raises(InputError, match=r'^event.jam_lef.force: no such event; was "jam_left" meant'):
        study.with_values({"event.jam_lef.force": 1.0})
    with pytest.raises(InputError, match=r"^start = .*: must be "):
        study.with_values({"start.now": 1.0})
    with pytest.raises(InputError, match=r"^machine.rr: unknown key"):
        study.with_values({"machine.rr": 1.0})


def test_events_of_the_example_can_be_changed():
    study = Study.from_file().with_values({"event.jam_right.force": "3 kN"})
    assert list(study.config.events) == list(Study.from_file().config.events)
    assert study.config.events["jam_right"].p.force == 3000.0
    assert study.config.events["jam_left"].p == Study.from_file().config.events["jam_left"].p


def test_a_slip_of_a_unit_is_a_warning():
    with pytest.warns(UserWarning, match=r"run.crank_speed = 30 rad/s: is unusual") as caught:
        Study(run={"crank_speed": 30.0, "turns": 1})
    assert caught[0].filename == __file__
    with pytest.warns(UserWarning, match=r"run.crank_speed = 30 rad/s") as caught:
        Study(run={"turns": 1}).with_values({"run.crank_speed": 30.0})
    assert caught[0].filename == __file__


def test_a_study_says_what_it_is():
    assert repr(Study.from_text(FILE)) == (
        "<Study '<b>Short</b> & quick': ChamberForces with DcMotor, crank at 6.28 rad/s (60.0 rev/min); "
        "events: jam_left>"
    )
    html = Study.from_text(FILE)._repr_html_()
    assert "&lt;b&gt;Short" in html and "<svg" in html
    assert "InductionMotor" not in repr(Study(sizing={})) and "a motor that sizing chooses" in repr(
        Study(sizing={})
    )
    assert repr(Study(event=[])).endswith("events: none>") and "'tables in Python'" in repr(Study())
    assert repr(Study(report={"units": {"speed": "rev/min"}})).count("rad/s") == 0
    assert isinstance(Study().machine, ChainUnitMachine)


def test_the_lines_in_the_docstring_are_right():
    trials = doctest.testmod(studies)
    assert trials.attempted >= 3 and not trials.failed


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"flywheel.compare.5": 0.1}, "5: must be the place of an entry, from 0 to 0"),
        ({"event": [], "event.jam_left.force": 3.0}, "0: must be the place of an entry"),
        ({3: 3}, "3: must be the name of a key"),
    ],
)
def test_values_at_no_place_are_refused(values, said):
    study = Study(flywheel={"compare": [0.1]}, event=[{"type": "jam", "side": "left"}])
    with pytest.raises(InputError) as refusal:
        study.with_values(values)
    assert str(refusal.value).startswith(said)
