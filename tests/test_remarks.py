"""Remarks are declared: short sentences, each number with its unit, in the order of severity, without a reader of
their words."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

import chainunit
from chainunit.core.descriptions import of_driver
from chainunit.report.reference import reference
from chainunit.study.remark import SEVERITIES, fault, note, warning
from chainunit.study.remarks import declared_remarks

MODULES = sorted(Path(chainunit.__file__).parent.rglob("*.py"))
MOST_WORDS = 30


@pytest.mark.second
def test_the_reference_lists_each_declared_remark():
    """Each call of `fault`, `warning` and `note` in the package declares one, and each is in the table."""
    codes = []
    for file in MODULES:
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            name = getattr(getattr(node, "func", None), "id", "")
            if name in SEVERITIES and node.args and isinstance(node.args[0], ast.Constant):
                codes.append(node.args[0].value)
    assert len(codes) > 100 and len(set(codes)) == len(codes)
    (section,) = (each for each in reference((), {}).sections if each.name == "remarks")
    assert [row.cells[0] for row in section.blocks[1].rows] == [each.code for each in declared_remarks()]
    assert set(codes) <= {each.code for each in declared_remarks()}
    # a switch of a sentence, as in "stalls it{turns}.", was shown
    assert not [row for row in section.blocks[1].rows if re.search(r"[a-z]\{", " ".join(map(str, row.cells)))]


def test_a_sentence_is_short_and_has_one_clause():
    for each in declared_remarks():
        assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", each.code)
        for sentence in (*each.sentences, *filter(None, [each.remedy])):
            plain = re.sub(r"\([^()]*\)", "", of_driver(sentence))
            assert len(plain.split()) <= MOST_WORDS, (each.code, sentence)
            assert ";" not in plain, (each.code, sentence)
            # a colon is followed by a list, or stands behind the name of a run
            assert all(part.startswith("{") for part in plain.split(": ")[1:]) or plain.split(":")[0] in (
                "{title}",
                "{run}",
                "{of}",
                "Chains",
                "Overloads at random",
                "Crank torque of two bars",
                "Rocker torque of two bars",
            ), (each.code, sentence)
            assert re.match(r"[A-Z0-9{]", sentence), (each.code, sentence)
            assert sentence[-1] in ".}", (each.code, sentence)


def test_each_number_is_in_a_sentence_or_has_a_title():
    for each in declared_remarks():
        text = " ".join((*each.sentences, each.remedy))
        for name, size in each.sizes.items():
            if name in WITHOUT:
                continue
            assert f"{{{name}}}" in text or size.title, (each.code, name)


WITHOUT = {
    # numbers of single runs, of which the remark gives a list in words
    *("stall_time", "coupling_trip_time", "energy_after_trip", "energy_behind", "speed_ripple"),
    *("J1", "J4", "c2", "c3", "crank_torque_low", "crank_torque_high", "over"),
    *("blade_bottom", "blade_top", "speed", "speed_dip", "bar_stress_peak"),
}


def test_the_gravest_come_first():
    ranks = [list(SEVERITIES).index(each.severity) for each in declared_remarks()]
    assert ranks == sorted(ranks) and set(ranks) == {0, 1, 2}


def test_a_sentence_without_a_value_is_left_out():
    code = warning(
        "test-of-a-remark",
        "The {driver} turns at {speed}.",
        "It is {why}.",
        remedy="Take {what}.",
        sizes={"rad/s": "speed"},
    )
    whole = code.remark("steady", driver="eccentric", speed=3.0, why="slow", what="more")
    assert (
        whole.text == "The eccentric turns at 3.00 rad/s. It is slow. Take more."
        and whole.remedy == "Take more."
    )
    assert whole.runs == ("steady",) and whole.quantities["speed"][:2] == (3.0, "rad/s")
    part = code.remark(speed=2.0, why=None, what=None)
    assert part.text == "The crank turns at 2.00 rad/s." and part.remedy == ""
    assert note.args == ("note",) and fault.args == ("fault",)


def test_no_code_reads_a_sentence():
    """A remark is chosen by its code: nothing looks into its text."""
    for file in MODULES:
        text = file.read_text("utf-8")
        assert not re.search(
            r"\bin (?:remark|warning|note|each)\.text\b|\b(?:remark|warning)\.text\.", text
        ), file
