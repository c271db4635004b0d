"""The words of a study: in the units of its reader, and about the parts that the study has."""

from __future__ import annotations

import json
import re

import pytest
from event_tables import event_line
from reports import said_of

from chainunit.report.markdown import markdown
from chainunit.report.study import report
from chainunit.study.config import parse
from chainunit.study.result import as_dict
from chainunit.study.run import run_study
from chainunit.text import chosen_units, number, shown_in, turning

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
    assert study.failure is None
    message = list(sentences(study))
    assert any("44.9 rev/min" in words for words in message[:2]) and any(
        "0.300 kN m" in each for each in message
    )
    for words in message:
        assert not re.search(r"\d (rad/s|N m|N|kW)(?![\w/]| m)", words), words
    # and not those of another study
    other = run_study(parse(event_line("jam_left", turns=1) + SHORT), tmp_path)
    assert any("the crank at 3.00 rad/s" in words for words in sentences(other))


def test_a_word_in_place_of_crank():
    assert (
        turning("Crank torque over a crank turn", "accelerator")
        == "Accelerator torque over an accelerator turn"
    )
    assert turning("crank_speed of a crank", "rotor") == "crank_speed of a rotor"
    assert turning("a crank turn", "crank") == "a crank turn"


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
    assert study.failure is None
    kinds = {note.kind for note in study.notes}
    assert ("smoothed friction" in kinds) is (friction > 0.0)
    # nor has it a crank
    text = said_of(study) + markdown(report(study), [])
    assert not re.search(r"\bcrank\b", text, re.I)
    assert "accelerator torque, peak" in text
    assert "the accelerator at " in study_words(study)
    # its inertia is constant: one row of the speed loop
    loops = json.loads(json.dumps(as_dict(study)["speed_loop"]))
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
        ('[system]\nmachine = "KnifeDrive"\n', "The file leaves out the motor (IE3 4-pole 2.2 kW, 100L): "),
    ],
)
def test_decisive_values_that_the_file_leaves_out_are_named_once(text, said, tmp_path):
    event = event_line("dip" if "Knife" in text else "jam_left", turns=1)
    study = run_study(parse(event + text + SHORT), tmp_path)
    words = [note.text for note in study.notes if note.kind == "values left out"]
    assert len(words) == (1 if said else 0)
    if said:
        assert words[0].startswith(said) and said_of(study).count("The file leaves out") == 1
