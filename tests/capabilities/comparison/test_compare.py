"""Two results side by side: every number is that of the two result.json, and what differs in the input is first."""

from __future__ import annotations

import json
import shutil

import pytest
from command import chainunit

from chainunit.capabilities.comparison.comparison import compare
from chainunit.reading.text import number as shown
from chainunit.study.config import parse
from chainunit.study.result import as_dict
from chainunit.study.run import run_study
from chainunit.study.stored_result import ResultEntries, read_result

pytestmark = pytest.mark.second

STUDY = """
title = "{title}"
[machine]
r = "{r} mm"
[run]
ramp = 0.3
settle_turns = 0
step = 4e-3
crank_speed = "{speed} rpm"
[[event]]
type = "jam"
side = "left"
force = "{force} kN"
turns = 1
[[event]]
type = "{other}"
side = "right"
turns = 1
"""
FIRST = {"title": "short crank", "r": 150, "speed": 30, "force": 2, "other": "jam"}
SECOND = {"title": "long crank", "r": 160, "speed": 25, "force": 2.5, "other": "empties"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The results `a` and `b` of two studies, and their comparison `out`."""
    folder = tmp_path_factory.mktemp("compare")
    for name, values in (("a", FIRST), ("b", SECOND)):
        study = run_study(parse(STUDY.format(**values)), folder / name)
        assert study.findings.failure is None
        (folder / name / "result.json").write_text(json.dumps(as_dict(study), allow_nan=False))
    done = chainunit("compare", "a", "b", "-o", "out", cwd=folder)
    assert done.returncode == 0, done.stderr
    (folder / "printed.txt").write_text(done.stdout)
    return folder


def numbers(folder, name):
    return ResultEntries(json.loads((folder / name / "result.json").read_text()))


def rows_of(folder, title):
    """The cells of the table of a run in Markdown, by their first cell."""
    text = (folder / "out" / "comparison.md").read_text()
    lines = text.partition(f"**{title}**\n")[2].strip().splitlines()
    rows = {}
    for line in lines:
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) != 5:
            if rows:
                break
            continue
        rows[cells[0]] = cells[1:]
    return rows


@pytest.mark.parametrize(
    ("run", "title"), [("steady", "Steady running"), ("jam_left", "A lump jams the left side")]
)
def test_every_measure_is_shown_with_its_difference(folder, run, title):
    """Computed again from the two results, and compared with the cells of the table."""
    a, b = (numbers(folder, name)["answers"][run] for name in "ab")
    rows, data = rows_of(folder, title), json.loads((folder / "out" / "comparison.json").read_text())
    measures = data["runs"][f"answers.{run}"]["measures"]
    have = [name for name in a if a[name]["value"] is not None or b[name]["value"] is not None]
    assert list(measures) == have and len(rows) >= len(have) > 15
    for name in have:
        x, y, unit, kind = a[name]["value"], b[name]["value"], a[name]["unit"], a[name].get("kind", "")
        cells = rows[measures[name]["title"].replace("|", "\\|")]
        assert cells[:2] == [shown(x, unit, kind), shown(y, unit, kind)], name
        if x is None or y is None:
            assert cells[2:] == ["-", "-"]
            continue
        assert measures[name]["difference"]["value"] == y - x
        is_share = kind in ("percent", "dip", "used")
        wanted = shown(y - x, unit, "difference" if unit == "K" else kind)
        if is_share:
            wanted = shown(100.0 * (y - x), "% points")
        assert cells[2] == wanted, name
        share = (y - x) / x if x > 0.0 and y >= 0.0 and unit != "K" and not is_share else None
        assert measures[name]["relative"]["value"] == share
        assert cells[3] == shown(share, "1", "percent")


def test_verdicts_and_warnings_of_one_alone_come_first(folder):
    data = json.loads((folder / "out" / "comparison.json").read_text())
    page = (folder / "out" / "report.html").read_text().partition("</header>")[0]
    printed = (folder / "printed.txt").read_text()
    for name in "ab":
        own = numbers(folder, name)
        for subject, verdict in own["verdict"].items():
            assert data["verdict"][name][subject] == {key: verdict[key] for key in ("holds", "text")}
            words = f"{name.upper()}: {verdict['text']}"
            assert words in printed and printed.index(words) < printed.index("Given values that differ")
            assert verdict["text"].partition(":")[0] in page
    # the right side of the second machine empties, and its bars are pushed
    warnings = {name: [each["text"] for each in numbers(folder, name)["warnings"]] for name in "ab"}
    for name in "ab":
        assert set(data["warnings"][name]) <= set(warnings[name])
        assert all(f"Warning: only {name.upper()}: {text}" in printed for text in data["warnings"][name])


def test_warnings_are_compared_by_their_codes_and_runs(folder, tmp_path):
    """No sentence is read: the same code in the same runs is the same warning, whatever its words. An earlier version
    has a kind in place of a code."""
    speed, far, hot = (
        ("Speed 3.1 rad/s, too high: 1", "model speed"),
        ("Not so far: 2", "far"),
        ("Hot", "hot"),
    )
    results = []
    a = [speed, far, ("Pushed: 4", "model")]
    b = [("Far off: 3", "far"), ("Hot", "model speed"), hot, ("Pushed: 4", "model")]
    for name, warnings, key, sign in (("a", a, "kind", " "), ("b", b, "code", "-")):
        data = numbers(folder, name)
        data["warnings"] = [
            {key: kind.replace(" ", sign), "text": text, "runs": [name] if kind == "model speed" else []}
            for text, kind in warnings
        ]
        (tmp_path / name).mkdir()
        (tmp_path / name / "result.json").write_text(json.dumps(data))
        results.append(read_result(tmp_path / name))
    alone = compare(*results).warnings
    assert alone == {"a": ["Speed 3.1 rad/s, too high: 1"], "b": ["Hot", "Hot"]}


def test_keys_keep_their_letters(folder):
    """The page writes the first letter of a row's head large, except of a name."""
    page = (folder / "out" / "report.html").read_text()
    assert '<th scope="row"><span class="as-is">machine.r</span></th>' in page
    assert '<th scope="row">machine' not in page and '<th scope="row">run.' not in page


def test_numbers_of_pins_and_of_the_start_are_there(folder):
    a, b = (numbers(folder, name) for name in "ab")
    runs = json.loads((folder / "out" / "comparison.json").read_text())["runs"]
    for pin, sizes in a["pins"]["steady"].items():
        for size, each in sizes.items():
            entry = runs["pins.steady"]["measures"][f"{pin}.{size}"]
            assert entry["difference"]["value"] == b["pins"]["steady"][pin][size]["value"] - each["value"]
    assert runs["start_up"]["measures"]["start_time"]["a"] == a["start_up"]["start_time"]


def test_given_values_that_differ_come_first(folder):
    data = json.loads((folder / "out" / "comparison.json").read_text())
    given = data["given"]
    assert given["machine.r"]["a"]["value"] == pytest.approx(0.15)
    assert given["machine.r"]["b"]["value"] == pytest.approx(0.16)
    assert given["event.jam_left.force"]["b"] == {"value": 2500.0, "unit": "N"}
    own = {name for name in given if not name.startswith(("event.jam_right.", "event.right_empties."))}
    # the gains are tuned to the machine, and the half width of the example is rounded where r is not its own
    assert own - {"machine.z", "machine.c"} == {
        "machine.r",
        "run.crank_speed",
        "event.jam_left.force",
        "motor.speed_control.kp",
        "motor.speed_control.ki",
    }
    assert given["motor.speed_control.kp"]["origin_b"] == "tuned"
    all_values = {*numbers(folder, "a")["machine"]} | {*numbers(folder, "b")["machine"]}
    assert data["given_equal"]["value"] > len(all_values) - 5
    printed = (folder / "printed.txt").read_text()
    assert "machine.r" in printed and "0.15 m" in printed and "(tuned)" in printed
    assert printed.index("Given values that differ") < printed.index("Steady running")


def test_what_only_one_has_is_named(folder):
    data = json.loads((folder / "out" / "comparison.json").read_text())
    assert data["only"]["a"]["runs"] == ["a lump jams the right side"]
    assert data["only"]["b"]["runs"] == ["the right side empties"]
    assert data["only"]["a"]["events"] == ["jam_right"]
    printed = " ".join((folder / "printed.txt").read_text().split())
    assert "Only A has the runs: a lump jams the right side." in printed
    page = (folder / "out" / "report.html").read_text()
    assert "Only B has the runs: the right side empties." in page and "long crank" in page


def test_a_result_beside_itself_differs_in_nothing(folder, tmp_path):
    done = chainunit("compare", folder / "a", folder / "a" / "result.json", "-o", "out", cwd=tmp_path)
    assert done.returncode == 0 and "Every number is the same in: start-up; steady running" in done.stdout
    data = json.loads((tmp_path / "out" / "comparison.json").read_text())
    assert data["given"] == {} and data["only"]["a"] == data["only"]["b"]
    assert f"All {data['given_equal']['value']:.0f} given values are the same." in done.stdout


def test_numbers_have_the_noun_of_a_common_driver(folder, tmp_path):
    one, other = (ResultEntries(json.loads((folder / "a" / "result.json").read_text())) for _ in range(2))
    one["driver"] = other["driver"] = "eccentric"
    for driver, noun in (("eccentric", "eccentric"), ("crank", "driver")):
        other["driver"] = driver
        files = [tmp_path / "one.json", tmp_path / "other.json"]
        for file, data in zip(files, (one, other), strict=True):
            file.write_text(json.dumps(data))
        found = compare(*map(read_result, files))
        titles = {each.title for run in found.runs.values() for each in run.measures.values()}
        assert f"{noun} torque, peak" in titles and not any("crank torque" in title for title in titles)


def test_values_of_one_alone_leave_no_empty_table(folder, tmp_path):
    """On the terminal, where the given values of an event of one alone are left out."""
    (tmp_path / "b").mkdir()
    other = json.dumps(numbers(folder, "a")).replace("jam_right", "jam_other")
    (tmp_path / "b" / "result.json").write_text(other)
    done = chainunit("compare", folder / "a", "b", "-o", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    printed = " ".join(done.stdout.split())
    assert "given values that both have are the same." in printed and "key" not in printed


def test_a_measure_of_one_alone_and_other_units(folder, tmp_path):
    """As of another version of the program: a measure more, a unit that is another, a name that nobody declares."""
    shutil.copytree(folder / "a", tmp_path / "old")
    file = tmp_path / "old" / "result.json"
    data = json.loads(file.read_text())
    steady = data["runs"]["answers"]["steady"]
    steady["mystery_number"] = {"value": 3.0, "unit": "furlong"}
    steady["current_rms"]["unit"] = "kA"
    del steady["speed_dip"]
    data["title"], data["status"] = "bad \x1b[31m title", "failed: it broke"
    file.write_text(json.dumps(data))
    result = compare(read_result(file), read_result(folder / "a"))
    measures = result.runs["answers.steady"].measures
    assert result.only["a"].measures == ["steady running: mystery number"]
    assert result.only["b"].measures == ["steady running: speed dip"]
    current = measures["current_rms"]
    assert current.difference.value is None and (current.a.unit, current.b.unit) == ("kA", "A")
    done = chainunit("compare", "old", folder / "a", "-o", "out", cwd=tmp_path)
    assert done.returncode == 0 and "A: failed: it broke." in done.stdout and "\x1b[31m" not in done.stdout


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (
            None,
            "there: has no result (No such file or directory); make it by a run of the study into this folder",
        ),
        ("{", "result.json: is no result of a study ("),
        ('{"answers": {"steady": NaN}}', "is no result of a study (NaN is no number of JSON)"),
        ("[" * 100_000, "is no result of a study ("),
        ("[]", "is no result of a study; a run into a folder writes result.json"),
        ('{"answers": []}', "is no result of a study; a run into a folder writes result.json"),
        ("\x00\xff", "is no result of a study ("),
    ],
)
@pytest.mark.parametrize("second", [False, True])
def test_a_folder_without_a_result_is_refused(folder, tmp_path, content, words, second):
    if content is not None:
        (tmp_path / "there").mkdir()
        (tmp_path / "there" / "result.json").write_text(content, "latin-1")
    pair = [folder / "a", "there"] if second else ["there", folder / "a"]
    done = chainunit("compare", *pair, "-o", "out", cwd=tmp_path)
    assert done.returncode == 2 and words in done.stderr and len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("command", "there", "words"),
    [
        (["compare", "a", "b"], "a", "a study"),
        (["sweep", "s.toml"], "a", "a study"),
        (["optimize", "o.toml"], "a", "a study"),
        (["study"], "out", "a comparison"),
    ],
)
def test_a_result_of_another_kind_is_not_lost(folder, command, there, words):
    """Every command refuses it before it computes or writes."""
    parameter = "[[sweep.parameter]]\nname = 'machine.r'\nvalues = [0.15, 0.16]\n"
    (folder / "s.toml").write_text(f"[sweep]\nangles = 16\n{parameter}")
    (folder / "o.toml").write_text("[optimize.free]\nr = { min = 0.1, max = 0.2 }\n")
    before = {file: file.stat().st_mtime_ns for file in (folder / there).rglob("*")}
    done = chainunit(*command, "-o", there, cwd=folder)
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1
    assert f"{there}: has the result of {words}, which would be lost; name another folder" in done.stderr
    assert before == {file: file.stat().st_mtime_ns for file in (folder / there).rglob("*")}


def test_a_comparison_is_made_again_in_its_folder(folder):
    assert chainunit("compare", "a", "b", "-o", "out", cwd=folder).returncode == 0
