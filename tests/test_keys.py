"""The reference of keys, the commented example and the schema, against the reader of study files itself."""

import importlib.util
import json
import re
import tomllib
from dataclasses import fields, replace
from pathlib import Path

import pytest
import typer.main
from command import chainunit

from chainunit.app.cli import app
from chainunit.core.errors import InputError
from chainunit.core.quantities import Layout
from chainunit.drives.dc_motor import DcMotor
from chainunit.fmu.description import Interface
from chainunit.machines.chain_unit import ChamberForces
from chainunit.models import MACHINES, MODELS, MOTORS
from chainunit.study.commented import commented
from chainunit.study.config import parse
from chainunit.study.event import TYPES
from chainunit.study.keys import NAME, catalogue_columns, entry_tables, key_tables
from chainunit.study.motor_sources import OwnMotor
from chainunit.study.parts import Parts, example
from chainunit.study.schema import json_schema

ROOT = Path(__file__).parents[1]


def _leaves(form, prefix=""):
    """Names of all keys of a pydantic form."""
    for name, field in form.model_fields.items():
        below = field.annotation
        if hasattr(below, "model_fields"):
            yield from _leaves(below, f"{prefix}{name}.")
        else:
            yield prefix + name


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("motor", MOTORS)
def test_each_key_of_the_form_is_documented(machine, motor):
    model = MACHINES[machine]
    form = Parts(model.having((*model.further, *(["pins.A"] if model.pin_names else []))), MOTORS[motor]).form
    documented = {
        f"{table.name}.{key.name}".lstrip(".")
        for table in key_tables()
        if table.of in ("", machine, motor) or table.name == "ratios"
        for key in table.keys
    }
    asked = {name for name in _leaves(form) if name not in ("event", "report.units")}
    asked = {name.replace(".pins.A.", f".pins.{NAME}.") for name in asked}
    if model.pin_names:
        # the reader of the file takes the kind of a pin before the form
        asked.add(f"machine.pins.{NAME}.kind")
    assert asked <= documented
    assert {
        name
        for name in documented - asked
        if not name.startswith(("event.", "report.units.", *(f"{each}." for each in entry_tables())))
    } == set()


def test_each_type_of_event_has_a_table():
    assert {table.of for table in key_tables() if table.name == "event"} == set(TYPES)


def test_each_key_says_what_it_means():
    for table in (*key_tables(), *catalogue_columns()):
        assert table.title
        for key in table.keys:
            assert key.description and key.allowed, (table.heading, key.name)


def _one_key(table, key):
    """A study file with that key alone, at the value that it has where it is left out."""
    if table.name == "event":
        side = 'side = "left"\n' if TYPES[table.of].has_side else ""
        side += 'input = "left.material_mass"\n' if TYPES[table.of].has_input else ""
        own = "" if key.name in ("type", "side", "input") else f"{key.name} = {key.left_out}\n"
        machine = {"cut": "KnifeDrive", "overload": "Accelerator"}.get(table.of, "ChamberForces")
        return f'[system]\nmachine = "{machine}"\n[[event]]\ntype = "{table.of}"\n{side}{own}'
    system = f'[system]\nmachine = "{table.of}"\n' if table.of in MACHINES else ""
    system += f'[system]\nmotor = "{table.of}"\n' if table.of in MOTORS else ""
    if table.name == "sweep.parameter":
        own = f"{key.name} = {key.left_out}\n"
        return f'[[sweep.parameter]]\nname = "machine.r"\ntolerance = "1 mm"\n{own}'
    if table.name == "usage.load":
        return f"[[usage.load]]\n{key.name} = {key.left_out}\n"
    if table.name.startswith("identify"):
        own = f"{key.name} = {key.left_out}\n"
        needed = {
            "identify": "[identify]\n",
            "identify.parameter": "[[identify.parameter]]\nname = 'machine.crank.m'\ndeviation = '5 %'\n",
            "identify.run": "[[identify.run]]\nfile = 'a.csv'\n",
            "identify.sensor": "[[identify.sensor]]\ncolumn = 'motor.i'\n",
        }
        return "".join(text + (own if name == table.name else "") for name, text in needed.items())
    if table.name == "bearing.NAME":
        return f'[bearing.C]\nkind = "ball"\nC = "50 kN"\n{key.name} = {key.left_out}\n'
    if table.name == "section.NAME":
        needed = 'arm = 0.1\nnotch = "none"\ndiameter = "50 mm"\n'
        needed += 'tensile_strength = "700 MPa"\nyield_strength = "490 MPa"\n'
        return f"[section.A]\n{needed}{key.name} = {key.left_out}\n"
    if table.name == "watch":
        return f"[watch]\nfile = 'a.csv'\n{key.name} = {key.left_out}\n"
    if table.name == "optimize":
        return f"[optimize]\n{key.name} = {key.left_out}\n[optimize.free]\nr = {{ min = 0.1, max = 0.2 }}\n"
    if table.name in ("gear", "starter"):
        start = 'start = "inverter"\n' if key.name == "droop" else ""
        system = f'{start}[system]\nmotor = "IE3 4-pole 0.75 kW, 80M"\n'
    if table.name == "torsion":
        system = "[driveline]\n"
    if table.name == "chain":
        system = 'organ = "chain"\n'
    if (table.name, key.name) == ("flywheel", "turns"):
        return f"[flywheel]\nplace = 'machine'\n{key.name} = {key.left_out}\n"
    if not table.name:
        return f"{key.name} = {key.left_out}"
    if table.name == "system":
        return f"title = 'x'\nsystem.{key.name} = {key.left_out}"
    if table.of in MACHINES and (further := MACHINES[table.of].further):
        of_machine = "".join(f"{name} = {x}\n" for name, x in zip(further, (1.0, 0.08), strict=True))
        own = f"{key.name.replace(NAME, 'A')} = {key.left_out}\n"
        return (
            f"{system}[machine]\n{of_machine}"
            + (f"[{table.name}]\n" if table.name != "machine" else "")
            + own
        )
    if table.of in MACHINES:
        return f"{system}[{table.name}]\n{key.name.replace(NAME, 'A')} = {key.left_out}\n"
    heading = "" if table.name == "driveline" and key.name.startswith("shaft") else f"[{table.name}]\n"
    return f"{system}{heading}{key.name} = {key.left_out}\n"


_WITH_VALUES = [
    (table, key) for table in key_tables() for key in table.keys if key.left_out and ".shaft" not in key.name
]


@pytest.mark.stages(first=10)
@pytest.mark.parametrize(
    ("table", "key"), _WITH_VALUES, ids=[f"{table.heading} {key.name}" for table, key in _WITH_VALUES]
)
def test_a_key_at_its_value_changes_nothing(table, key):
    """The value that the reference states for a key that is left out is taken, and is the one that the file has."""
    if table.name == "driveline" and (key.name.startswith("shaft") or key.name in ("c2", "c3")):
        pytest.skip("a shaft's profile goes with others of its keys")
    if table.name == "machine" and key.name in ("r", "l", "h", "c", "hy", "e", "l1", "l2", "z", "ratio"):
        pytest.skip("lengths come from ratios or from other lengths, see test_config")
    text = _one_key(table, key)
    lines = text.splitlines()
    own = (f"{key.name} =", f"system.{key.name} =")
    without = "\n".join(line for line in lines if not line.startswith(own) or key.name == "type")
    try:
        values, left_out = parse(text), parse(without)
    except InputError as error:
        # a start or a catalogue is of a motor of the catalogue alone
        assert "is of" in str(error) and not table.name
        return
    assert _values(values.machine) == pytest.approx(_values(left_out.machine), rel=1e-11)
    assert _values(_motor(values)) == pytest.approx(_values(_motor(left_out)), rel=1e-11)
    for part in {*values.values, "feed", "run", "coupling", "gear", "starter"}:
        assert _values(values.table(part)) == pytest.approx(_values(left_out.table(part)), rel=1e-11), part
    for one, other in zip(values.events.values(), left_out.events.values(), strict=True):
        assert _values(one) == pytest.approx(_values(other), rel=1e-11) and one.name == other.name
    for part in ("simulation",):
        assert getattr(values, part) == getattr(left_out, part)
    assert values.file.choices["driveline.place"] == left_out.file.choices["driveline.place"]
    # a damping ratio stands in place of both dampings, which are none in a file without it
    apart = {"optimize"} | ({"driveline"} if key.name == "damping_ratio" else set())
    for part in set(values.plans) - apart:
        assert _plain(values.plans[part]) == _plain(left_out.plans[part]), part
    if table.name == "optimize":
        own = {each.name for each in fields(values.plans["optimize"])} - {"machine"}
        assert "table" in own
        assert all(
            getattr(values.plans["optimize"], x) == getattr(left_out.plans["optimize"], x) for x in own
        )


def _plain(plan):
    """A plan without the random event, whose numbers may differ by rounding of a unit."""
    return replace(plan, event=None) if hasattr(plan, "is_asked_for") else plan


def _motor(study):
    return study.motor.parameters if isinstance(study.motor, OwnMotor) else None


def _values(part):
    """The numbers of a part of a study, by name."""
    declarations = getattr(part, "p", part)
    return Layout(type(declarations)).by_name(declarations) if declarations is not None else {}


def test_the_full_example_names_every_key_once():
    text = commented(example("full"))
    assert parse(text).machine.p == parse(example("full")).machine.p
    tables = re.findall(r"^(?:# )?\[(\w+)(?:\.NAME)?\]", text, re.MULTILINE)
    assert sorted({*tables}) == sorted({*Parts(ChamberForces, DcMotor).sections, "report", "system"})
    for table in key_tables():
        if table.name in ("", "event", "system") or table.of not in ("", "ChamberForces"):
            continue
        own = re.split(rf"^(?:# )?{re.escape(table.bracketed)}", text, flags=re.MULTILINE)[1]
        own = re.split(r"^(?:# )?\[", own, flags=re.MULTILINE)[0]
        set_here = tomllib.loads(text).get(table.name, {})
        for key in table.keys:
            first, *below = key.name.split(".")
            here = set_here.get(first)
            for name in below:
                here = here.get(name) if isinstance(here, dict) else None
            message = re.findall(rf"^# {re.escape(key.name)} =", own, re.MULTILINE)
            assert len(message) == (here is None), (table.name, key.name)


def test_a_bare_number_has_its_unit_in_the_comment_and_a_text_has_not():
    lines = commented(
        '[machine]\ncrank = { m = 40, s = "50 mm", I = -0.6 }\n[flywheel]\nJ = 2\n'
    ).splitlines()
    crank, flywheel = (line for line in lines if line.startswith(("crank =", "J =")))
    assert crank.endswith(
        "# crank O1-A: mass [kg]; distance of the centroid from the pin named first, along the link; "
        "moment of inertia about the centroid [kg m2]"
    )
    assert flywheel.endswith("at its own shaft [kg m2]")


def test_each_line_of_the_full_example_has_a_comment():
    for line in commented(example("full")).splitlines():
        if "=" in line:
            assert "#" in line.lstrip("# "), line


def test_the_commands(tmp_path):
    output = chainunit("keys", "jam", cwd=tmp_path).stdout
    assert "processing force of the lump" in output and '"2 kN"' in output
    assert "[[event]] of jam" in chainunit("keys", cwd=tmp_path).stdout
    assert "rated power at the shaft" in chainunit("keys", "catalogue", cwd=tmp_path).stdout
    # each machine has other keys: the command lists the machines, and how to ask for one
    machines = chainunit("keys", "machine", cwd=tmp_path).stdout
    assert re.findall(r"chainunit keys (\w+)", machines) == list(MACHINES) and "web_share" not in machines
    assert "web_share" in chainunit("keys", "ChamberForces", cwd=tmp_path).stdout
    refusal = chainunit("keys", "jams", cwd=tmp_path)
    assert (
        refusal.returncode == 2
        and "jams: no such table" in refusal.stderr
        and "chainunit keys lists" in refusal.stderr
    )
    for slip, meant in (("run.crankspeed", "run.crank_speed"), ("crankspeed", "crank_speed")):
        near = chainunit("keys", slip, cwd=tmp_path)
        assert near.returncode == 2 and f'no such key; was "{meant}" meant?' in near.stderr
    near = chainunit("keys", "knifedrive", cwd=tmp_path)
    assert near.returncode == 2 and 'was "KnifeDrive" meant?' in near.stderr
    assert chainunit("keys", "--schema", cwd=tmp_path).returncode == 0
    assert json.loads((tmp_path / "chainunit.schema.json").read_text("utf-8")) == json_schema()
    first, *_ = chainunit("study", "--example", "knife", cwd=tmp_path).stdout.splitlines()
    assert first == "#:schema chainunit.schema.json"


@pytest.mark.parametrize(
    ("asked", "tables", "keys"),
    [
        ("run.crank_speed", ["[run]"], ["crank_speed"]),
        ("crank_speed", ["[run]", "[watch]", "[[identify.run]]"], ["crank_speed"]),
        ("machine.r", ["[machine] of ChamberForces", "[machine] of KnifeDrive"], ["r"]),
        ("KnifeDrive.knife.c", ["[machine] of KnifeDrive"], ["knife.c.x", "knife.c.y"]),
        ("event.rise", [f"[[event]] of {name}" for name in ("jam", "lumps", "overload", "surge")], ["rise"]),
        ("[sizing]", ["[sizing]"], [key.name for t in key_tables() if t.name == "sizing" for key in t.keys]),
    ],
)
def test_a_key_is_found_by_its_name(asked, tables, keys, tmp_path):
    done = chainunit("keys", asked, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    titles = [line.strip() for line in done.stdout.splitlines() if line.startswith("[")]
    assert titles == tables
    shown_keys = re.findall(r"^│ ([a-z]\S*) ", done.stdout, re.MULTILINE)
    assert shown_keys == len(tables) * keys


def test_the_page_of_reference_has_every_key_variable_and_command():
    spec = importlib.util.spec_from_file_location("make_reference", ROOT / "docs" / "make_reference.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    page = module.text().replace("\\", "")
    parts = {heading: body for heading, _, body in (part.partition("\n") for part in page.split("\n## "))}
    for table in (*key_tables(), *catalogue_columns()):
        body = parts[f"{table.heading}: {table.title}"]
        for key in table.keys:
            assert f"| {key.name} | {key.left_out or key.follows or '-'} |" in body, (table.heading, key.name)
    for name, model in MODELS.items():
        for causality in ("parameter", "input", "output"):
            for signal in Interface(model, {}).signals_of(causality):
                assert f"| {signal.variable.name} | {causality} |" in parts[f"FMU {name}"], name
    for command, *_ in module.commands():
        assert f"chainunit {command}".strip() in parts


def test_the_help_has_at_most_fourteen_commands_by_group_each_with_an_example(tmp_path):
    text = chainunit("--help", cwd=tmp_path, whole=False).stdout
    assert max(map(len, text.splitlines())) <= 80
    group = typer.main.get_command(app)
    shown = [name for name in group.list_commands(typer.Context(group)) if not group.commands[name].hidden]
    assert len(shown) <= 14 and "Others:" not in text
    slip = chainunit("exprot", cwd=tmp_path).stderr
    assert "Did you mean 'export'?" in slip and "export-ssp" not in group.commands
    for name in shown:
        (example,) = re.findall(rf"^ +(chainunit {name} .+)$", text, re.MULTILINE)
        words = example.split()[1:]
        command, context = group, typer.Context(group)
        while words and hasattr(command, "commands"):
            command = command.commands[words.pop(0)]
        command.make_context(name, words, parent=context)  # refuses what the command does not have
