"""The JSON Schema of study files against the reader: it marks no right file, and of the wrong ones all that it can
express. It is applied as editors do, which show it a date of TOML as a text."""

import datetime
import re
import tomllib
from pathlib import Path

import jsonschema
import pytest
from wrong_files import FILES

from chainunit.core import units
from chainunit.core.errors import InputError
from chainunit.models import MACHINES
from chainunit.reading.tables import in_file
from chainunit.reading.toml_lines import lines_of
from chainunit.study.commented import commented
from chainunit.study.config import parse
from chainunit.study.keys import key_tables
from chainunit.study.parts import EXAMPLES, example
from chainunit.study.schema import json_schema

ROOT = Path(__file__).parents[1]
SCHEMA = json_schema()
VALIDATOR = jsonschema.Draft7Validator(SCHEMA)


def as_in_editor(data):
    """The data of a file as an editor shows them to a schema."""
    if isinstance(data, dict):
        return {name: as_in_editor(value) for name, value in data.items()}
    if isinstance(data, list):
        return [as_in_editor(value) for value in data]
    return data.isoformat() if isinstance(data, datetime.date | datetime.time) else data


def marks(text):
    """What the schema says of a file."""
    return [error.message for error in VALIDATOR.iter_errors(as_in_editor(tomllib.loads(text)))]


def refused(text):
    try:
        with in_file("mine.toml", lambda: lines_of(text)):
            parse(text)
    except InputError as error:
        return str(error)
    return ""


def _is_toml(text):
    try:
        tomllib.loads(text)
    except ValueError:
        return False
    return True


def test_it_is_a_schema():
    jsonschema.Draft7Validator.check_schema(SCHEMA)
    names = re.findall(r"'#/definitions/(.*?)'", str(SCHEMA))
    assert {name.replace("%20", " ") for name in names} == set(SCHEMA["definitions"])


BLOCKS = [
    text
    for page in sorted((ROOT / "docs").rglob("*.md"))
    for text in re.findall(r"^```toml[^\n]*\n(.*?)^```", page.read_text("utf-8"), re.MULTILINE | re.DOTALL)
    if not refused(text)
]
RIGHT = [
    *(
        re.sub(r'"(linkages|loads|catalogue)/', rf'"{ROOT.as_posix()}/examples/\1/', file.read_text("utf-8"))
        for file in sorted((ROOT / "examples").glob("*.toml"))
    ),
    *map(example, EXAMPLES),
    commented(example("full")),
    *BLOCKS,
    "",
    "[report]\ndate = 2026-11-22\nunits = { speed = 'rev/min' }",
    "[report]\ndate = '22.11.2026'",
    "[run]\nturns = 2.0",
    "[run]\nturns = '2.0'",
    "[run]\nturns = '2e0'",
    "[[event]]\ntype = 'lumps'\nside = 'left'\nnumber = 3.0\nname = 'three_lumps'",
    "[[event]]\ntype = 'dip'",
    "[monte_carlo]\nevent = { force = ['1 kN', 3000] }",
    "[monte_carlo]\nevent = { type = 'lumps', number = [1, 3], side = 'left' }",
    "[flywheel]\ncompare = [0.1, '0.2 kg m²', '20 kg·cm²']",
    "[driveline]\nshaft2 = { section = 'hollow', outer = '90 mm', inner = 0.07, length = '1.2 m' }\n"
    "[torsion]\ndamping_ratios = ['2 %', 0.05]",
    "[driveline]\nshaft3.section = 'polygon'\nshaft3.length = 1\n"
    "shaft3.outline = [[0, 0], ['9 cm', 0], [0, 0.1]]\nshaft3.holes = [[[0.01, 0.01], [0.02, 0.01], [0.01, 0.02]]]",
    "organ = 'chain'\n[chain]\nrods = 8.0",
    "start = 'soft'\n[sizing]\nambient = '-10 °C'",
    "[sizing]\nmargin = '5 %'\nlarger = 1\ngear_kind = 'worm'\nratio_series = 'exact'\nratios = [10, 12.5]",
    "[observer]\nsignal_noise = '2 %'\nuncertainty = '500 g'\n[sizing]",
    "[system]\nmotor = 'IE3 4-pole 0.75 kW, 80M'\n[gear]\nefficiency = '96 %'",
    "start = 'soft'\n[system]\nmachine = 'KnifeDrive'",
    "[motor]\nrotor.J = 0.01",
    "[system]\nmotor = 'InductionMotor'\n[motor]\npole_pairs = 2\ninverter.on = true",
    "[system]\nmotor = 'InductionMotor'\n[motor]\npole_pairs = 3.0\ninverter.on = 0",
    "[system]\nmachine = 'KnifeDrive'\n[[event]]\ntype = 'cut'",
    "[ratios]\nrho = 0.1\n[machine]\ng = 9.81",
    "[sweep]\nmethod = 'grid'\nquantities = ['min(margin)']\n[[sweep.parameter]]\nname = 'machine.r'\n"
    "from = '100 mm'\nto = 0.2\npoints = 5\n[[sweep.parameter]]\nname = 'run.crank_speed'\nvalues = ['30 rpm', 4]",
    "[sweep]\npoints = 100\nangles = 90\n[[sweep.parameter]]\nname = 'machine.l1'\ntolerance = '1 mm'\n"
    "distribution = 'normal'",
]


@pytest.mark.stages(first=1)
@pytest.mark.parametrize("text", RIGHT, ids=range(len(RIGHT)))
def test_no_right_file_is_marked(text):
    if "polygon" in text:
        pytest.importorskip("sectionproperties")
    assert refused(text) == "" and marks(text) == []


def test_pages_have_study_files():
    assert len(BLOCKS) >= 5


FOREIGN = [
    "[system]\nmotor = 'pump.FMU'\nmotor_names = { phi = 'shaft.phi' }",
    "[system]\nmachine = 'mill.fmu'\n[machine]\nx = 1\ny.z = '3 m'\n[feed]\na = 2",
    "catalogue = 'own.csv'\n[system]\nmotor = 'of our own'",
]


@pytest.mark.parametrize("text", FOREIGN, ids=range(len(FOREIGN)))
def test_files_that_name_others_are_not_marked(text):
    assert marks(text) == []


UNSEEN = {
    "[machine]\nr = 0.9": "lengths of a crank that turns",
    "[observer]\n[feed]\nleft = { material_mass = 0 }\nright = { material_mass = 0 }": "sum of two values",
    "[run]\ncrank_speed = '3 1/s'": "dimension of a product of units",
    "[driveline]\n[torsion]\nslowest = 3\nfastest = 2": "order of two values",
    "[sizing]\npoles_least = 6\npoles_most = 4": "order of two values",
    "catalogue = 'none.csv'\n[sizing]": "another file",
    "[driveline]\nalpha1 = '95 deg'": "size of a number in a text",
    "[monte_carlo]\nevent = { force = [5000, 100] }": "order of two values",
}
"""Wrong files whose fault a schema cannot express, with the reason."""
UNSEEN |= {text: "names of several tables" for text, _ in FILES if "name = 'mark'" in text}
UNSEEN |= {text: "sum of two values" for text, _ in FILES if text.startswith("[feed]") and "[watch]" in text}
WRONG = [text for text, _ in FILES if _is_toml(text) and "pump.fmu" not in text]
WRONG += [
    "[run]\nturns = '2.5'",
    "[run]\nturns = true",
    "[[event]]\ntype = 'jam'\nside = 'left'\nname = 'Big'",
    "[[event]]\ntype = 'dip'\nname = 'steady'",
    "[[event]]\ntype = 'dip'\nname = 'dip_coasting'",
    "[[event]]\ntype = 'dip'\nside = 'left'",
    "[[event]]\ntype = 'cut'",
    "[system]\nmachine = 'KnifeDrive'\n[[event]]\ntype = 'jam'\nside = 'left'",
    "[system]\nmachine = 'KnifeDrive'\n[machine]\nweb_share = 1",
    "[system]\nmachine = 'KnifeDrive'\n[ratios]",
    "[system]\nmotor = 'InductionMotor'\n[motor]\narmature.R = 1",
    "[system]\nmotor = 'InductionMotor'\n[sizing]",
    "[system]\nmotor = 'IE3 4-pole 0.75 kW, 80M'\n[motor]",
    "feed_forward = true\n[system]\nmotor = 'InductionMotor'",
    "[system]",
    "[system]\nmotor = ''",
    "[system]\nmotor_names = { phi = 'x' }",
    "[sizing]\n[run]\nwinding_temperature = 400",
    "[sizing]\n[machine]\nratio = 50",
    "[sizing]\n[flywheel]\nJ = 1",
    "[gear]",
    "[observer]\n[driveline]",
    "[observer]\noverload = 2",
    "[system]\nmachine = 'KnifeDrive'\n[observer]",
    "[chain]",
    "[monte_carlo]\nevent = { type = 'start', side = 'left' }",
    "[monte_carlo]\nevent = { type = 'lumps', turns = 3 }",
    "[monte_carlo]\nevent = { force = [1] }",
    "[[sweep.parameter]]\nname = 'machine.r'\nfrom = 1",
    "[[sweep.parameter]]\nname = 'machine.r'\nvalues = [0.1]\ntolerance = 0.1",
    "[sweep]\nquantities = 'min(margin)'",
    "[sweep]\nmeasures = ['coupling_trip_time']\nevent = 'jam_left'",
    "[sweep]\nquantities = ['min(margin)']\n[system]\nmachine = 'ChamberForces'\n[chain]",
    "[monte_carlo]\nevent = { force = ['1 m', 2] }",
    "[flywheel]\ncompare = ['1 kg']",
    "[flywheel]\ncompare = 3",
    "[driveline]\n[torsion]\ndamping_ratios = [0.1, 0.2, 0.3, 0.4, 0.5]",
    "[driveline]\nshaft2 = { outer = 1 }",
    "[driveline]\nshaft2 = { section = 'round', outer = 1 }",
    "[driveline]\nshaft2 = { section = 'round', outer = 1, length = 1, inner = 0.5 }",
    "[driveline]\nshaft2 = { section = 'polygon', length = 1, outline = [[0, 0], [1]] }",
    "[driveline]\nd2 = 3\ndamping_ratio = 0.1",
    "[machine]\nr = '-3 mm'",
    "[machine]\nr = '0 mm'",
    "[machine]\nr = '3 deg'",
    "[machine]\nr = '1.2.3 m'",
    "[machine]\nr = 'm'",
    "[machine]\nr = ''",
    "[machine]\ncrank.m = '3 N'",
    "[run]\ncrank_speed = '15 upm'",
    "[run]\nwinding_temperature = '120 V'",
    "[run]\nturns = '5 %'",
    "[driveline]\n[torsion]\nslowest = 3\nfastest = 2",
    "[report]\nunits = { speed = 'rpm' }",
    "[report]\ndate = 3",
    "title = 3",
]


@pytest.mark.parametrize("text", WRONG, ids=range(len(WRONG)))
def test_a_wrong_file_is_marked_where_a_schema_can_see_the_fault(text):
    assert refused(text)
    assert bool(marks(text)) == (text not in UNSEEN)


LINKAGE = f"'{ROOT.as_posix()}/examples/linkages/slider_crank_press.toml'"
DRIVES = {
    "": {},
    **{name: {"system": f"machine = '{name}'"} for name in MACHINES},
    "linkage in [system]": {"system": f"machine = {LINKAGE}"},
    "linkage in [machine]": {"machine": f"linkage = {LINKAGE}"},
    "motor by designation": {"system": "motor = 'IE3 4-pole 0.75 kW, 80M'"},
    "motor by type": {"system": "motor = 'InductionMotor'"},
    "chains": {"": "organ = 'chain'"},
    "driveline": {"driveline": ""},
    "sizing": {"sizing": ""},
}
TABLES = {
    **{
        name: {name: ""}
        for name in ("ratios", "chain", "sizing", "gear", "starter", "observer", "torsion", "motor")
    },
    **{name: {name: ""} for name in ("coupling", "driveline", "flywheel", "monte_carlo", "report", "run")},
    "flywheel.J": {"flywheel": "J = 1"},
    "winding temperature": {"run": "winding_temperature = 400"},
    "one-sided share": {"sizing": "one_sided_share = 1"},
    "organ": {"": "organ = 'chain'"},
    "organ of bars": {"": "organ = 'two-bar'"},
    "feed-forward": {"": "feed_forward = true"},
    "start": {"": "start = 'soft'"},
    "machine.ratio": {"machine": "ratio = 20"},
    "watch": {"watch": f"file = '{ROOT.as_posix()}/README.md'"},
    "random": {"monte_carlo": "runs = 5"},
    "sweep of a grid": {
        "sweep": "method = 'grid'\npoints = 3\nparameter = [{ name = 'run.crank_speed', values = [1, 2] }]"
    },
    "sweep": {"sweep": "parameter = [{ name = 'run.crank_speed', from = 1, to = 2 }]"},
    "quantities": {
        "sweep": "parameter = [{ name = 'run.crank_speed', from = 1, to = 2 }]\nquantities = ['peak(crank_torque)']"
    },
    "optimize": {"optimize": "objectives = ['peak(crank_torque)']\nfree = { g = { min = 9, max = 10 } }"},
}


def _file(*parts):
    """The text of a file of several parts, by their tables; a later part goes on in a table of an earlier one."""
    tables = {"": ""}
    for part in parts:
        for name, lines in part.items():
            tables[name] = f"{tables.get(name, '')}\n{lines}"
    return tables.pop("") + "".join(f"\n[{name}]{lines}" for name, lines in tables.items())


@pytest.mark.stages(second=4)
@pytest.mark.second
@pytest.mark.parametrize("drive", DRIVES)
def test_each_table_beside_each_machine(drive):
    """The reader and the schema refuse the same pairs of a drive and a table."""
    off = {}
    for name, table in TABLES.items():
        text = _file(DRIVES[drive], table)
        if _is_toml(text) and bool(refused(text)) != bool(marks(text)):
            off[name] = refused(text) or marks(text)
    assert not off


@pytest.mark.second
def test_each_unit_that_is_read_is_matched_and_no_other_of_one_name():
    """Each key of a quantity with each unit of one name, as the reader takes it."""
    seen = set()
    for table in key_tables():
        for key in table.keys:
            v = key.variable
            if v is None or (v.unit, v.kind) in seen or v.unit == "1":
                continue
            seen.add((v.unit, v.kind))
            form = table.keys and VALIDATOR.evolve(schema=_property(table, key.name))
            for name in units.single_names():
                try:
                    units.convert(1.0, name, v.unit, v.kind)
                    fits = True
                except ValueError:
                    fits = False
                assert form.is_valid(f"1 {name}") == fits, (table.name, key.name, name)
    assert len(seen) > 20


def _property(table, name):
    """The schema of a key; those of machines, motors and events are definitions."""
    own, (first, *below) = f"{table.name}.{table.of}", table.name.split(".")
    inner = SCHEMA["definitions"][own] if own in SCHEMA["definitions"] else SCHEMA["properties"][first]
    inner = (
        inner["additionalProperties"]
        if table.is_named
        else inner["properties"][below[0]]["items"]
        if below
        else inner
    )
    for each in name.split("."):
        inner = inner["properties"][each]
    return inner
