"""Wrong files, as people write them: each fault is told in one run, with line, key and remedy."""

import datetime
import re

import pytest
from command import chainunit

from chainunit.drives.motors import MOTORS
from chainunit.errors import InputError, shown
from chainunit.models import MACHINES
from chainunit.places import lines_of
from chainunit.reading import in_file
from chainunit.study.config import parse
from chainunit.study.keys import key_tables

# the file, and for each fault its line, its key and words of the remedy
FILES = [
    ("organs = 'chain'", [(1, "organs", 'was "organ" meant?')]),
    ("[machine]\nr = '150 kg'", [(2, "machine.r", 'such as "2 mm"')]),
    ("[machine]\nr = '1,5 m'", [(2, "machine.r", 'was "1.5 m" meant?')]),
    ("[machine]\nr = -0.1", [(2, "machine.r", "must be > 0 m")]),
    ("[machine]\nr = true", [(2, "machine.r", "must be a number in m")]),
    ("[machine]\ncrank.mass = 3", [(2, "machine.crank.mass", "known here: m, s, I")]),
    ("[machine]\n\n# a comment\ncrank = { m = -3 }", [(4, "machine.crank.m", "must be >= 0 kg")]),
    ("[machine]\nwebshare = 1", [(2, "machine.webshare", 'was "web_share" meant?')]),
    ("[machine]\ncrank_speed = 3", [(2, "machine.crank_speed", "it stands in [run]")]),
    ("[machine]\nfeed_forward = true", [(2, "machine.feed_forward", "it stands before all tables")]),
    ("[machin]\nr = 1", [(1, "machin", 'was "machine" meant?')]),
    ("[machine]\nr = 0.9", [(2, "machine: r", "must be > 0 and < 0.703476 m")]),
    ("[ratios]\nmu = 1.0", [(1, "ratios: rho = 0.1, mu", "mu = e/l1 < 1")]),
    ("[ratios]\nrho = 0.1\n[machine]\nr = 0.2", [(4, "machine.r", "leave out one of the two")]),
    ("[run]\ncrank_speed = '3 1/s'", [(2, "run.crank_speed", 'such as "2 rev/min"')]),
    ("[run]\ncrank_speed = '30 RPM'", [(2, "run.crank_speed", 'was "30 rpm" meant?')]),
    ("[run]\nstep = 1", [(2, "run.step", 'was "1 ms" meant?')]),
    ("[run]\nturns = 2.5", [(2, "run.turns", "must be a whole number")]),
    ("[coupling]\ntrip = '4 kNm'", [(2, "coupling.trip", "known here: trip_torque")]),
    ("[coupling]\ntrip_torque = '4 kN'", [(2, "coupling.trip_torque", 'such as "2 N m"')]),
    ("[[event]]\ntype = 'jamm'", [(2, "event 1: type", 'was "jam" meant?')]),
    ("[[event]]\nside = 'left'", [(1, "event 1: type", "must be given, one of jam, lumps")]),
    ("[[event]]\ntype = 'jam'", [(1, "event 1 (jam): side", '"left" or "right"')]),
    (
        "[[event]]\ntype='dip'\n\n[[event]]\ntype = 'jam'\nside = 'left'\nforce = '3 m'",
        [(7, "event.jam_left.force", 'such as "2 N"')],
    ),
    ("[[event]]\ntype = 'jam'\nside = 'up'", [(3, "event 1 (jam): side", '"left" or "right"')]),
    ("[[event]]\ntype = 'lumps'\nside = 'left'\nnumber = 1.5", [(4, "event.lumps_left.number", "whole number")]),
    ("[event]\ntype = 'jam'", [(1, "event", "each below [[event]]")]),
    ("[system]\nmachine = 'KnifeDriv'", [(2, "system.machine", 'was "KnifeDrive" meant?')]),
    ("[system]\nmotor = 'DcMotr'", [(2, "system.motor", 'was "DcMotor" meant?')]),
    ("[system]\nmotor = 'IE3 4-pole 2,2 kW, 100L'", [(2, "system.motor", 'was "IE3 4-pole 2.2 kW, 100L" meant?')]),
    ("[system]\nmotor = 'pump.fmu'", [(2, "system.motor", "no such FMU")]),
    ("[run]\nturns = '500 %'", [(2, "run.turns", "must be a pure number")]),
    ("[feed]\nleft.processing_force = '1,500 N'", [(2, "feed.left.processing_force", "must be a number in N")]),
    ("[feed]\nleft.processing_force = '2*1000 N'", [(2, "feed.left.processing_force", "must be a number in N")]),
    ('catalogue = "a\\u0000b"\n[sizing]', [(1, "catalogue", "must be the name of a file")]),
    (f"[system]\nmotor = '{5000 * 'x'}.fmu'", [(2, "system.motor", "must be the name of a file")]),
    (
        "[machine]\ncrank.m = '30 mg'\n[run]\nturns = 2.5",
        [(4, "run.turns = 2.5: must be a whole number", "must be a whole number")],
    ),
    ("start = 'softly'\n[sizing]", [(1, "start", 'was "soft" meant?')]),
    ("start = 'soft'", [(1, "start", "add [sizing] or system.motor")]),
    ("organ = 'belt'", [(1, "organ", '"two-bar" or "chain"')]),
    ("[sizing]\n[motor]\nrotor = { J = 1 }", [(2, "motor", "leave out one of the two")]),
    ("[sizing]\npoles_least = 6\npoles_most = 4", [(3, "sizing.poles_most", "must be >= sizing.poles_least")]),
    ("catalogue = 'none.csv'\n[sizing]", [(1, "catalogue", "none.csv: cannot be read")]),
    ("[report]\nunits = { speed = 'rpm' }", [(2, "report.units.speed", '"rad/s" or "rev/min"')]),
    ("[report]\nunits = { sped = 'rpm' }", [(2, "report.units.sped", 'was "speed" meant?')]),
    (
        "[driveline]\nc2 = 3\nshaft2 = { section = 'round', outer = '30 mm' }",
        [(2, "driveline.c2", "leave out one of the two")],
    ),
    ("[driveline]\nalpha1 = '95 deg'", [(1, "driveline.alpha1", "must be < 1.5708 rad")]),
    ("[monte_carlo]\nevent = { force = [5000, 100] }", [(2, "monte_carlo.event.force", ">= the first")]),
    ("[torsion]\npoints = 50", [(1, "torsion", "add [driveline]")]),
    ("[[motor]]\ndesignation = 'x'", [(1, "motor", "name this file in a study file by catalogue")]),
    ("designation,power [kW],voltage,poles\nx,1,2,3", [(1, "no valid TOML", "it is a CSV table")]),
    (
        "[report]\nunits = { speed = 'a', sped = 'b', power = 3 }",
        [
            (2, "report.units.speed", '"rad/s" or "rev/min"'),
            (2, "report.units.sped", 'was "speed" meant?'),
            (2, "report.units.power = 3", '"W" or "kW"'),
        ],
    ),
    (
        "[[event]]\ntype = 'jam'\nside = 'lef'\nname = 'Big one'\nforce = '3 m'\n[[event]]\ntype = 'jam'",
        [
            (3, 'event 1 (jam): side = "lef"', 'was "left" meant?'),
            (4, 'event 1 (jam): name = "Big one"', "must be small letters"),
            (5, "event.jam.force", 'such as "2 N"'),
            (6, "event 2 (jam): side", "must be given"),
        ],
    ),
    (
        "[run]\nstep = 1\n[monte_carlo]\n[monte_carlo.event]\nside = 'up'\nturns = 2\nforce = [1, 2, 3]\n"
        "duration = ['1 s', '1 m']\nfoce = 3",
        [
            (2, "run.step", "must be"),
            (5, "monte_carlo.event: side", '"left" or "right"'),
            (6, "monte_carlo.event.turns", "at any crank angle"),
            (7, "monte_carlo.event.force = [1, 2, 3]", "from where to where"),
            (8, "monte_carlo.event.duration", 'such as "2 s"'),
            (9, "monte_carlo.event.foce", 'was "force" meant?'),
        ],
    ),
    (
        "[machine]\nr = 150 mm\nl = 1,5 # m\n[run]\nturns = .5\n[report]\nauthor = Ann",
        [
            (2, "no valid TOML: r = 150 mm", 'r = "150 mm"'),
            (3, "no valid TOML: l = 1,5", "l = 1.5"),
            (5, "no valid TOML: turns = .5", "turns = 0.5"),
            (7, "no valid TOML: author = Ann", 'author = "Ann"'),
        ],
    ),
    ("feed_forward = True", [(1, "no valid TOML: feed_forward = True", "feed_forward = true")]),
    ("[run]\n[machine]\n[run]", [(3, "no valid TOML", "[run] stands twice, first in line 1")]),
    ("[run]\nturns = 1\nturns = 2", [(3, "no valid TOML", "turns stands twice")]),
    ("title = 'a", [(1, "no valid TOML", "a quotation mark is missing")]),
    ("title =\n", [(1, "no valid TOML", "its value is missing")]),
    ("[machine\nr = 1", [(1, "no valid TOML: [machine", "']'")]),
    (f"[machine]\nr = 1{5000 * '0'}", [(2, "no valid TOML", "more than 4300 digits")]),
    ('{"a": 1}', [(1, "no valid TOML", "it is JSON")]),
    ("PK\x03\x04", [(0, "", "is a ZIP archive, such as an FMU")]),
    (
        "organs = 'chain'\n[machine]\nr = '3 kg'\ncrank = { m = -3 }\n[run]\nstep = 1\n[[event]]\ntype = 'jamm'",
        [
            (1, "organs", "was"),
            (3, "machine.r", "such as"),
            (4, "machine.crank.m", "must be"),
            (6, "run.step", "must be"),
            (8, "event 1: type", "must be"),
        ],
    ),
    (
        "[sizing]\npoles_least = 6\npoles_most = 4\n[ratios]\nmu = 1.0\n[run]\nturns = 1.5",
        [
            (3, "sizing.poles_most", "must be"),
            (4, "ratios: rho", "needs"),
            (7, "run.turns", "must be a whole number"),
        ],
    ),
]  # fmt: skip


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
