"""The words of a study: in the units of its reader, and about the parts that the study has."""

from __future__ import annotations

import ast
import json
import re
from html import unescape
from pathlib import Path

import pytest
from command import chainunit
from event_tables import event_line
from reports import report_of, said_of

from chainunit.core.descriptions import of_driver
from chainunit.core.quantities import Quantity
from chainunit.reading.result_entries import ResultEntries
from chainunit.reading.text import chosen_units, number, shown_in
from chainunit.report.lines import Words, filled
from chainunit.report.markdown import markdown
from chainunit.study.config import parse
from chainunit.study.result import as_dict
from chainunit.study.run import run_study

pytestmark = pytest.mark.second

UNITS = 'units = { speed = "rev/min", torque = "kN.m", force = "kN", power = "W" }\n'
SHORT = """
[run]
turns = 1
settle_turns = 1
step = "2 ms"
"""


def study_words(study):
    return " ".join(sentences(study))


def sentences(study):
    result = as_dict(study)
    for verdict in result["verdict"].values():
        yield verdict["text"]
    for remark in (*result["warnings"], *result["notes"]):
        yield remark["text"]
    if "sizing" in result:
        yield from (c["reason"] for c in result["sizing"]["candidates"])
        yield result["sizing"]["protection"].get("coupling", "")


def test_sentences_are_in_the_units_of_the_reader(tmp_path):
    """Verdicts, remarks and the sentences on the coupling have the units of the tables beside them."""
    text = (
        event_line("jam_left", turns=1, force=6000.0)
        + f"""
    {SHORT}crank_speed = 4.7
[coupling]
trip_torque = 300
[report]
{UNITS}"""
    )
    study = run_study(parse(text.replace("\n    ", "\n")), tmp_path)
    assert study.findings.failure is None
    message = list(sentences(study))
    assert any("44.9 rev/min" in words for words in message[:2]) and any(
        "0.300 kN m" in each for each in message
    )
    for words in message:
        assert not re.search(r"\d (rad/s|N m|N|kW)(?![\w/]| m)", words), words
    # and not those of another study
    other = run_study(parse(event_line("jam_left", turns=1) + SHORT), tmp_path)
    assert any("the crank at 3.00 rad/s" in words for words in sentences(other))


def test_a_text_has_slots_for_the_driver():
    """A sentence with a slot names the driver of the machine; a name that a file gives stays as it is."""
    speed = Quantity("rad/s", "{driver} speed over {a driver} turn")
    assert speed.description == "crank speed over a crank turn"
    assert speed.described("eccentric") == "eccentric speed over an eccentric turn"
    title = Words("{driver}", "title")
    assert filled(of_driver("The {driver} of the {}", "gear"), title) == ("The gear of the ", title)


def test_the_units_of_words_end_where_they_are_written():
    assert number(10.0, "N.m") == "10.0 N m"
    with pytest.raises(ZeroDivisionError), shown_in(chosen_units({"torque": "kN.m"})):
        assert number(10.0, "N.m") == "0.0100 kN m"
        raise ZeroDivisionError
    assert number(10.0, "N.m") == "10.0 N m"
    assert number(2.0, "rad/s", "speed") == "2.00 rad/s (19.1 rev/min)"
    assert number(2.0, "rad/s", "speed", beside=False) == "2.00 rad/s"


ROTOR = """
[system]
machine = "Accelerator"
motor = "DcMotor"
[motor]
armature = { R = 0.12, L = 0.0025, k = 2.86, C = 60e3, R_th = 0.03 }
rotor = { J = 1.2 }
limit = { i = 260, v = 500 }
[run]
crank_speed = "1400 rev/min"
ramp = 3
settle_turns = 2
turns = 2
step = "2 ms"
"""


@pytest.mark.parametrize("friction", [0.0, 0.01])
def test_what_the_machine_does_not_have_is_not_spoken_of(friction, tmp_path):
    event = event_line("overload", turns=1)
    study = run_study(parse(f"{event}{ROTOR}[machine]\npin = {{ friction = {friction} }}\n"), tmp_path)
    assert study.findings.failure is None
    kinds = {note.code for note in study.findings.notes}
    assert ("smoothed-friction" in kinds) is (friction > 0.0)
    # nor has it a crank
    text = said_of(study) + markdown(report_of(study), [])
    assert not re.search(r"\bcrank\b", text, re.I)
    assert "accelerator torque, peak" in text
    assert "the accelerator at " in study_words(study)
    # its inertia is constant: one row of the speed loop
    loops = ResultEntries(json.loads(json.dumps(as_dict(study)["speed_loop"])))
    assert len(loops) == 1
    table = said_of(study).partition("The linearised speed loop")[2]
    assert "constant inertia" in table and "least inertia" not in table


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "[coupling]\nrelease_time = 0.005\n",
            "The file leaves out coupling.trip_torque (1000 N m) and the rating of the motor (limit.i = ",
        ),
        (
            "[coupling]\ntrip_torque = 1000\n[motor]\nlimit = { i = 8, v = 400 }\narmature = { k = 1.27 }\n",
            None,
        ),
        ('[system]\nmachine = "KnifeDrive"\n', "The file leaves out the motor (IE3 4-pole 2.2 kW, 100L). "),
    ],
)
def test_decisive_values_that_the_file_leaves_out_are_named_once(text, said, tmp_path):
    event = event_line("dip" if "Knife" in text else "jam_left", turns=1)
    study = run_study(parse(event + text + SHORT), tmp_path)
    words = [note.text for note in study.findings.notes if note.code == "values-left-out"]
    assert len(words) == (1 if said else 0)
    if said:
        assert words[0].startswith(said) and said_of(study).count("The file leaves out") == 1


ROOT = Path(__file__).parents[1]
WILD = "{A} {} {0} {{x}} {=run.turns} %s %(x)d %{y} $x^$ \\\\frac [red] [/b] <b>bold</b> */ &amp; `code`"


@pytest.mark.slow
def test_a_text_from_outside_is_no_template(tmp_path):
    """Title and descriptions of a linkage and of its study stand in all results as they are."""
    press = (ROOT / "examples" / "linkages" / "slider_crank_press.toml").read_text("utf-8")
    titled, title = re.subn(r'^title = ".*"$', lambda _: f"title = {json.dumps(WILD)}", press, flags=re.M)
    described, count = re.subn(
        r'description = "[^"]*"', lambda _: f"description = {json.dumps(WILD)}", titled
    )
    assert title == 1 and count >= 3
    (tmp_path / "press.toml").write_text(described, "utf-8")
    (tmp_path / "study.toml").write_text(
        f"title = {json.dumps('study ' + WILD)}\n[machine]\nlinkage = 'press.toml'\nratio = 20\n[run]\nturns = 1\n"
        "settle_turns = 1\nstep = '4 ms'\ncrank_speed = '60 rpm'\n",
        "utf-8",
    )
    for command, name in (("linkage", "linkage"), ("study", "result")):
        file = "press.toml" if command == "linkage" else "study.toml"
        done = chainunit(command, file, "-o", command, cwd=tmp_path)
        assert done.returncode in (0, 1) and "Traceback" not in done.stderr, done.stderr
        page = (tmp_path / command / "report.html").read_text("utf-8")
        assert WILD in unescape(page) and "<b>bold" not in page
        assert json.dumps(WILD, ensure_ascii=False)[1:-1] in (tmp_path / command / f"{name}.json").read_text(
            "utf-8"
        )
        assert " ".join(WILD.split()) in " ".join(done.stdout.split())


OUTSIDE = {"title", "titles", "title_of", "description", "designation", "noun", "source", "label"}
"""Names of attributes and variables that hold texts of a user or of a foreign FMU."""
TEMPLATES = {"line": 0, "filled": 0, "warn": 1, "note": 1, "of": 2}
"""By method that fills a template, the place of the template among its arguments."""


def _interpolated(template):
    """The names in the braces of an f-string that is a template, or a part of one."""
    for part in ast.walk(template):
        if isinstance(part, ast.FormattedValue):
            for node in ast.walk(part.value):
                if isinstance(node, ast.Name | ast.Attribute):
                    yield node.id if isinstance(node, ast.Name) else node.attr


def test_no_template_is_made_with_a_text_from_outside():
    """Such a text is a part by its name: in the template itself its braces would be read."""
    seen, wrong = 0, []
    for file in sorted((ROOT / "src" / "chainunit").rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if not isinstance(node, ast.Call):
                continue
            # the function `line` of the module lines joins pieces, and fills nothing
            name = ast.unparse(node.func)
            place = TEMPLATES.get(name.rpartition(".")[2]) if name != "line" else None
            if place is not None and len(node.args) > place:
                seen += 1
                if OUTSIDE & set(_interpolated(node.args[place])):
                    wrong.append(f"{file.name}:{node.lineno}")
    assert seen > 150 and not wrong
