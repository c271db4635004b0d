"""A cited result: the pieces that a page gets by attributes are those at the places of the result."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import chainunit
from chainunit.core.quantities import Value, declaration, quantity
from chainunit.reading.results import OWN, Estimate, InUnit, as_data, derived, part, result
from chainunit.report import blocks as b
from chainunit.report.cited import as_name, cited, estimate, number, quantity_rows, table
from chainunit.report.lines import Name, Number, Words, filled, line


@declaration
class Numbers:
    speed: Value = quantity("rad/s", "speed", kind="speed")


@result
class Inner:
    unit: str
    kind: str = "percent"
    size: float = part("size", unit=OWN, default=0.25)
    name: str = part("name", default="web")


@result
class Outer:
    numbers: Numbers = part(inline=True)
    inner: list[Inner] = part("inner results", name="parts")
    by_name: Mapping[str, InUnit] = part("numbers by name")
    course: Any = quantity("N.m", "course")
    ranges: list[tuple[float, float]] = quantity("s", "ranges")
    share: float | None = quantity("1", "share")
    none: Inner | None = part("nothing", default=None)
    holds: bool = part("whether", default=True)
    hidden: str = "hidden"

    @derived("N")
    def force(self) -> float:
        """A force."""
        return 3.0


def outer():
    inner = [Inner("1"), Inner("m", "millimetres", 2.0, "wall")]
    course = np.array([1.0, np.nan])
    return Outer(
        Numbers(speed=5.0), inner, {"a.b": InUnit(np.float64(7.0), "kg")}, course, [(1.0, 2.0)], None
    )


def test_each_piece_is_that_of_its_place():
    x, s = cited(outer()), b.Source(as_data(outer()))
    assert number(x.numbers.speed) == s.number("speed") and number(x.force) == s.number("force")
    for k in (0, 1):
        assert number(x.inner[k].size) == s.number(f"parts.{k}.size")
        assert x.inner[k].name == s.words(f"parts.{k}.name") and x.inner[k].name.path == f"parts.{k}.name"
    assert number(x.by_name["a.b"]) == s.number("by_name.a.b")
    assert [number(each) for each in x.course] == [s.number("course", k) for k in (0, 1)]
    assert [number(each) for each in x.ranges[0]] == [s.number("ranges", 0, k) for k in (0, 1)]
    assert number(x.share, 4, none="-") == s.number("share", digits=4, none="-")
    assert x.none is None and x.holds is True and x.hidden == "hidden"
    assert number(cited(outer(), "findings.own").force).path == "findings.own.force"


def test_a_name_that_is_none_and_a_text_that_is_no_number_are_refused():
    x = cited(outer())
    with pytest.raises(AttributeError, match="spead"):
        print(x.numbers.spead)
    with pytest.raises(AssertionError):
        number(x.inner[0].name)
    assert as_name(x.inner[0].name) == Name("web")


def test_a_cited_text_is_a_text():
    """A page may compare it, and take it for a key."""
    x = cited(outer())
    assert isinstance(x.inner[0].name, Words) and x.inner[0].name == "web"
    assert {"web": 1}[x.inner[0].name] == 1 and not Words("", "title")


def test_an_estimate_has_its_interval():
    (share,) = estimate(cited({"share": Estimate(0.5, 0.25, 0.75, "1", "percent")}, "findings")["share"])[:1]
    assert share == Number(0.5, "1", "percent", "findings.share")
    (interval,) = estimate(cited({"share": Estimate(0.5, 0.25, 0.75, "1")}, "findings")["share"])[1:]
    low, _, high = interval.line
    assert (low.path, high.path) == ("findings.share.low", "findings.share.high")
    assert (low.value, high.value) == (0.25, 0.75)


def test_a_row_for_each_number_of_a_result():
    rows = quantity_rows(cited(Numbers(speed=5.0), "run"), digits=4)
    assert rows == (b.TableRow(("speed", Number(5.0, "rad/s", "speed", "run.speed", digits=4))),)
    assert quantity_rows(cited(Numbers(speed=5.0)), only="torque") == ()


def test_a_template_takes_its_parts_in_their_order():
    force = Number(3.0, "N")
    assert filled("{} is {} ({}).", "F", force, line("of ", Name("A"))) == (
        "F",
        " is ",
        force,
        " (",
        "of ",
        Name("A"),
        ").",
    )
    with pytest.raises(ValueError):
        filled("{} and {}", "F")


def test_a_table_has_a_row_for_each_item():
    x = cited(outer())
    columns = (
        ("name", lambda each: each.name),
        (b.Column("size", form="long"), lambda each: number(each.size, 2)),
    )
    (whole,) = table(x.inner, *columns, title="Parts")
    assert [column.form for column in whole.columns] == ["both", "long"] and whole.title == "Parts"
    assert whole.rows[1].cells == (x.inner[1].name, number(x.inner[1].size, 2))
    assert list(table([], *columns)) == []


PATH = re.compile(r'\.result\[|\bs\.\w+\(\s*f?"')
"""A report reads its result, or takes a piece by a string path."""


def test_a_report_takes_nothing_of_a_declared_result_by_a_string_path():
    for folder in ("report", "capabilities"):
        for file in sorted((Path(chainunit.__file__).parent / folder).rglob("*.py")):
            assert PATH.findall(file.read_text("utf-8")) == [], file
