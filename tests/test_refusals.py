"""Wrong files, as people write them: each fault is told in one run, with line, key and remedy."""

import datetime
import re
from pathlib import Path

import pytest
from command import chainunit
from wrong_files import FILES

from chainunit.core.errors import InputError, shown
from chainunit.models import MACHINES, MOTORS
from chainunit.reading.tables import in_file
from chainunit.reading.toml_lines import lines_of
from chainunit.study.config import parse
from chainunit.study.keys import key_tables
from chainunit.study.parts import example


def test_the_list_is_long_enough():
    assert len(FILES) >= 40


@pytest.mark.parametrize(("text", "faults"), FILES, ids=[str(k) for k in range(len(FILES))])
def test_every_fault_has_its_line_key_and_remedy(text, faults, tmp_path):
    (tmp_path / "mine.toml").write_text(text, "utf-8")
    process = chainunit("study", "mine.toml", "-o", "out", cwd=tmp_path)
    assert process.returncode == 2 and not process.stdout and not (tmp_path / "out").exists()
    output = [line for line in process.stderr.splitlines() if not line.startswith("Remark")]
    assert len(output) == len(faults), output
    for line, (number, key, remedy) in zip(output, faults, strict=True):
        place = f"mine.toml:{number}: " if number else "mine.toml: "
        assert re.match(rf"chainunit: {re.escape(place)}{re.escape(key)}", line), line
        assert remedy in line, line
        assert not (number == 4 and "crank.m" in line and key.startswith("run")), line


@pytest.mark.parametrize(
    ("data", "place", "remedy"),
    [
        (example().encode("utf-16"), "", "save it as UTF-8"),
        (example().encode("utf-16-le"), "", "save it as UTF-8"),
        ("[run]\ntitle = 'Mühle'".encode("latin-1"), "2:", "save it as UTF-8"),
        (b"\x89PNG\r\n", "", "is a picture"),
        (b"\x1f\x8b\x08", "", "is a compressed file"),
        (b"\x7fELF\x02", "", "is a program"),
        (b"\xef\xbb\xbf[machine]\r\nr = '3 kg'\r\n", "2:", 'such as "2 mm"'),
    ],
)
def test_files_of_other_kinds_are_told(data, place, remedy, tmp_path):
    (tmp_path / "mine.toml").write_bytes(data)
    process = chainunit("study", "mine.toml", "-o", "out", cwd=tmp_path)
    assert (
        process.returncode == 2 and not process.stdout and [*tmp_path.iterdir()] == [tmp_path / "mine.toml"]
    )
    assert process.stderr.startswith(f"chainunit: mine.toml:{place}") and remedy in process.stderr
    assert len(process.stderr.splitlines()) == 1


def test_wrong_cells_of_a_catalogue_stand_behind_the_faults_of_the_file(tmp_path):
    (tmp_path / "cat.csv").write_text("designation,power [kW]\na,-1\nb,x\n")
    (tmp_path / "mine.toml").write_text(
        "catalogue = 'cat.csv'\n[sizing]\n[run]\nstep = 1\n[ratios]\nmu = 1\n"
    )
    output = chainunit("study", "mine.toml", cwd=tmp_path).stderr.splitlines()
    begins = ["mine.toml:4: run.step", "mine.toml:6: ratios.mu", *(8 * ["cat.csv:1: column"])]
    begins += ["cat.csv:2: column power", "cat.csv:3: column power"]
    assert len(output) >= len(begins) and output[-1].startswith("chainunit: cat.csv:3: column power")
    for line, begin in zip(output[:10], begins, strict=False):
        assert line.startswith(f"chainunit: {begin}"), line


WRONG = ("{ type = 'jams' }", "['a']", "nan", "-inf", "07:32:00", "[[1, 2], [3]]", "true", "1979-05-27")
PYTHON = re.compile(r"True|False|None|\{'|\['|datetime|input_|validation|\bshould\b|tuple|dict|\(at line")


def _head(table):
    """The beginning of a file that has that table."""
    if table.name == "event":
        return f'[[event]]\ntype = "{table.of}"\n'
    part = "machine" if table.of in MACHINES else "motor" if table.of in MOTORS else ""
    system = f'[system]\n{part} = "{table.of}"\n' if part else ""
    return system + (f"{table.bracketed}\n" if table.name else "")


@pytest.mark.parametrize("shift", range(3))
@pytest.mark.parametrize("table", key_tables(), ids=lambda table: table.heading)
def test_each_key_of_a_table_is_refused_in_toml_forms(table, shift):
    """All keys of a table at once, each with a value of another type."""
    above = {key.name.rpartition(".")[0] for key in table.keys}
    names = {("event", "type"), ("system", "machine"), ("system", "motor")}
    keys = [key for key in table.keys if key.name not in above and (table.name, key.name) not in names]
    wrong = [WRONG[(k + 3 * shift) % len(WRONG)] for k, _ in enumerate(keys)]
    right = {"switch": "true", "table": WRONG[0]}

    def sort(key):
        return "switch" if key.variable is not None and key.variable.type == "Boolean" else key.sort

    lines = [
        f"{key.name.replace('NAME', 'A')} = {value if value != right.get(sort(key)) and key.name != 'date' else 3}"
        for key, value in zip(keys, wrong, strict=True)
    ]
    text = _head(table) + "\n".join(lines)
    first = _head(table).count("\n") + 1
    with pytest.raises(InputError) as refusal, in_file("mine.toml", lambda: lines_of(text)):
        parse(text)
    message = str(refusal.value).splitlines()
    assert {int(line.split(":")[1]) for line in message} >= {first + k for k, _ in enumerate(keys)}
    for line in message:
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


def test_a_linkage_file_is_no_study_file(tmp_path):
    linkage = Path(__file__).parents[1] / "examples" / "linkages" / "slider_crank_press.toml"
    (tmp_path / "press.toml").write_text(linkage.read_text("utf-8"), "utf-8")
    done = chainunit("study", "press.toml", "-o", "out", cwd=tmp_path)
    (line,) = done.stderr.splitlines()
    assert done.returncode == 2 and not (tmp_path / "out").exists()
    assert re.match(r"chainunit: press.toml:\d+: links, driver: this is a linkage file", line)
    assert "by linkage in [machine]" in line and "chainunit linkage FILE" in line


@pytest.mark.parametrize("name", ["machine", "motor"])
def test_a_name_in_place_of_a_table_is_sent_to_its_table(name):
    with pytest.raises(
        InputError, match=rf'^{name} = "KnifeDrive": must be a table; its name stands in \[system\]$'
    ):
        parse(f'{name} = "KnifeDrive"')


@pytest.mark.parametrize(
    ("words", "remedy"),
    [
        (["export"], "(chainunit export --help shows its options)"),
        (["study", "--chek"], "(chainunit study --help shows its options)"),
        (["vouch", "key", "mine"], "(chainunit vouch key --help shows its options)"),
        (["study", "--backend", "rust"], "'rust' is not one of 'native', 'python' (chainunit study --help"),
        (["stduy"], "(chainunit --help shows the commands)"),
    ],
)
def test_a_wrong_command_names_the_help_that_has_the_right_one(words, remedy, tmp_path):
    done = chainunit(*words, cwd=tmp_path)
    (line,) = done.stderr.splitlines()
    assert done.returncode == 2 and remedy in line and "Value error" not in line


def test_a_group_without_a_command_prints_its_help(tmp_path):
    done, asked = (chainunit("vouch", *option, cwd=tmp_path) for option in ((), ("--help",)))
    assert done.returncode == 0 and done.stdout == asked.stdout and not done.stderr


def test_a_missing_linkage_file_is_told_at_the_key_that_names_it(tmp_path):
    (tmp_path / "mine.toml").write_text('[machine]\nlinkage = "press.toml"\n', "utf-8")
    done = chainunit("study", "mine.toml", "-o", "out", cwd=tmp_path)
    (line,) = done.stderr.splitlines()
    assert (
        line.startswith("chainunit: mine.toml:2: machine.linkage: ") and "press.toml: cannot be read" in line
    )


@pytest.mark.parametrize("command", ["sweep", "optimize", "identify", "watch"])
def test_a_command_without_its_table_names_the_study_file(command, tmp_path):
    (tmp_path / "mine.toml").write_text('title = "x"\n')
    done = chainunit(command, "mine.toml", "-o", "out", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith(f"chainunit: mine.toml: {command}") and "; add " in done.stderr
    assert not (tmp_path / "out").exists() or not any((tmp_path / "out").iterdir())
