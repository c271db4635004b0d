"""Wrong files, as people write them: each fault is told in one run, with line, key and remedy."""

import datetime
import re

import pytest
from command import chainunit
from wrong_files import FILES

from chainunit.drives.motors import MOTORS
from chainunit.errors import InputError, shown
from chainunit.models import MACHINES
from chainunit.places import lines_of
from chainunit.reading import in_file
from chainunit.study.config import parse
from chainunit.study.keys import key_tables


def test_the_list_is_long_enough():
    assert len(FILES) >= 40


@pytest.mark.parametrize(("text", "faults"), FILES, ids=[str(k) for k in range(len(FILES))])
def test_every_fault_has_its_line_key_and_remedy(text, faults, tmp_path):
    (tmp_path / "mine.toml").write_text(text, "utf-8")
    done = chainunit("study", "mine.toml", "-o", "out", cwd=tmp_path)
    assert done.returncode == 2 and not done.stdout and not (tmp_path / "out").exists()
    said = [line for line in done.stderr.splitlines() if not line.startswith("Remark")]
    assert len(said) == len(faults), said
    for line, (number, key, remedy) in zip(said, faults, strict=True):
        place = f"mine.toml:{number}: " if number else "mine.toml: "
        assert re.match(rf"chainunit: {re.escape(place)}{re.escape(key)}", line), line
        assert remedy in line, line
        assert not (number == 4 and "crank.m" in line and key.startswith("run")), line


WRONG = ("{ type = 'jams' }", "['a']", "nan", "-inf", "07:32:00", "[[1, 2], [3]]", "true", "1979-05-27")
PYTHON = re.compile(r"True|False|None|\{'|\['|datetime|input_|validation|should|tuple|dict|\(at line")


def _head(table):
    """The beginning of a file that has that table."""
    if table.name == "event":
        return f'[[event]]\ntype = "{table.of}"\n'
    part = "machine" if table.of in MACHINES else "motor" if table.of in MOTORS else ""
    system = f'[system]\n{part} = "{table.of}"\n' if part else ""
    return system + (f"[{table.name}]\n" if table.name else "")


@pytest.mark.parametrize("shift", range(3))
@pytest.mark.parametrize("table", key_tables(), ids=lambda table: table.heading)
def test_each_key_of_a_table_is_refused_in_toml_forms(table, shift):
    """All keys of a table at once, each with a value of another type."""
    above = {key.name.rpartition(".")[0] for key in table.keys}
    named = {("event", "type"), ("system", "machine"), ("system", "motor")}
    keys = [key for key in table.keys if key.name not in above and (table.name, key.name) not in named]
    wrong = [WRONG[(k + 3 * shift) % len(WRONG)] for k, _ in enumerate(keys)]
    right = {"switch": "true", "table": WRONG[0]}
    lines = [
        f"{key.name} = {value if value != right.get(key.sort) and key.name != 'date' else 3}"
        for key, value in zip(keys, wrong, strict=True)
    ]
    text = _head(table) + "\n".join(lines)
    first = _head(table).count("\n") + 1
    with pytest.raises(InputError) as refused, in_file("mine.toml", lambda: lines_of(text)):
        parse(text)
    said = str(refused.value).splitlines()
    assert {int(line.split(":")[1]) for line in said} >= {first + k for k, _ in enumerate(keys)}
    for line in said:
        assert len(line) < 2000 and not PYTHON.search(line), line


def test_values_are_cited_as_toml_writes_them():
    deep = {"a": {"b": {"c": {"d": 1}}}}
    for value, text in (
        ({"type": "jam", "x y": [True, 1.5]}, '{ type = "jam", "x y" = [true, 1.5] }'),
        (False, "false"),
        ([], "[]"),
        ({}, "{}"),
        (list(range(9)), "[0, 1, 2, 3, ...]"),
        (deep, "{ a = { b = { c = { ... } } } }"),
        (float("nan"), "nan"),
        (datetime.date(2026, 11, 2), "2026-11-02"),
        ("a\nb" + 90 * "x", '"a\\nb' + 57 * "x" + '"... (33 more characters)'),
        (10**5000, "a number of about 5000 digits"),
    ):
        assert shown(value) == text
