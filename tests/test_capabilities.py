"""Each capability is one folder and an entry point: without both the rest works, and its keys are unknown."""

from __future__ import annotations

import ast
import importlib
import importlib.util
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import wheels
from typer.main import get_command

import chainunit
from chainunit.app.cli import app
from chainunit.core.register import entries
from chainunit.reading.result_entries import ResultEntries
from chainunit.study.registry import CAPABILITIES, _capability, capabilities
from chainunit.study.sections import choosing_tables

PACKAGE = Path(chainunit.__file__).parent
NAMES = sorted(wheels.declared(wheels.PROJECT.read_text("utf-8"))[CAPABILITIES])
STUDY = """
[run]
crank_speed = 6
ramp = 0.2
settle_turns = 1
step = 0.004

[[event]]
type = "jam"
side = "left"
"""
SMOKE = """
import json, sys
from pathlib import Path
from typer import Context
from typer.main import get_command
from chainunit import Study
from chainunit.app.cli import app
from chainunit.core.errors import InputError
from chainunit.fmu.export import export
from chainunit.models import MODELS
from chainunit.report import print_figures
from chainunit.study.schema import json_schema

folder, tables = Path(sys.argv[1]), sys.argv[2:]
# the page has the same figures; to draw them a second time is a third of the run
print_figures.draw = lambda plots, folder: []
properties = json_schema()["properties"]
refused = {}
for table in tables:
    try:
        Study(**{table: {}})
    except InputError as error:
        refused[table] = str(error)
result = Study.from_text((folder / "study.toml").read_text()).run(folder / "result")
export(MODELS["ChamberForces"], folder / "ChamberForces.fmu")
group = get_command(app)
commands, text = group.list_commands(None), group.get_help(Context(group))
print(json.dumps({"properties": list(properties), "refused": refused, "commands": commands, "help": text}))
"""


ORDER = """
chains sizing static_inertia energy sides blade random_overloads flywheels torsion checks optimize identification
watch sweep
""".split()
COMMANDS_ALONE = ["comparison", "handover", "linear", "vouching"]
"""Folders that add commands alone, and nothing to a study."""
COMMANDS = {
    "comparison": ["compare"],
    "handover": ["handover"],
    "identification": ["identify"],
    "linear": ["linearize"],
    "optimize": ["optimize"],
    "sweep": ["sweep"],
    "vouching": ["certify", "key", "verify", "vouch"],
    "watch": ["watch"],
}
"""Names of the commands of each folder that has any."""


def test_the_entry_points_name_the_folders():
    folders = {path.name for path in (PACKAGE / "capabilities").iterdir() if (path / "__init__.py").exists()}
    assert folders == set(NAMES) and len(NAMES) == len(folders)
    assert [part.name for part in capabilities()] == ORDER and sorted([*ORDER, *COMMANDS_ALONE]) == NAMES
    # an install from before a new capability does not have it: install the project anew
    assert {name: entry.value for name, entry in entries(CAPABILITIES).items()} == {
        name: f"chainunit.capabilities.{name}" for name in NAMES
    }
    own_tests = {path.parent.name for path in (Path(__file__).parent / "capabilities").glob("*/test_*.py")}
    assert own_tests <= set(NAMES)
    assert choosing_tables() == ["sizing"]


def test_a_folder_with_a_command_alone_is_no_capability_and_an_empty_one_is_an_error(tmp_path, monkeypatch):
    for name in ("has_command", "has_nothing"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").touch()
    (tmp_path / "has_command" / "command.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    assert list(_capability(importlib.import_module("has_command"))) == []
    with pytest.raises(ModuleNotFoundError, match=r"has_nothing\.capability"):
        list(_capability(importlib.import_module("has_nothing")))


@pytest.mark.second
def test_nothing_outside_a_folder_imports_from_it():
    outside = set()
    for file in PACKAGE.rglob("*.py"):
        parts = file.relative_to(PACKAGE).parts
        own = parts[1] if parts[0] == "capabilities" else ""
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if not isinstance(node, ast.ImportFrom) or not node.level:
                continue
            target = [*parts[: len(parts) - node.level], *(node.module or "").split(".")]
            if target[0] == "capabilities" and len(target) > 1 and target[1] != own:
                outside.add("/".join(parts))
    assert outside == set()


USER = """
from chainunit import Study, SweepResult, WatchResult

study = Study.from_file()
swept: SweepResult = study.sweep(workers=2)
begin: float = study.watch().alarms[0].begin
study.optimise()
study.identify(runs=3)
"""


def test_the_types_of_methods_are_those_of_the_list():
    """`docs/make_types.py` wrote the file from which type checkers know the methods of `Study`."""
    script = Path(__file__).parents[1] / "docs" / "make_types.py"
    spec = importlib.util.spec_from_file_location("make_types", script)
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    assert made.FILE.read_text("utf-8") == made.text()


@pytest.mark.slow
def test_a_type_checker_sees_the_methods_and_results_of_capabilities(tmp_path):
    pytest.importorskip("mypy")
    (tmp_path / "user.py").write_text(USER)
    call = [sys.executable, "-m", "mypy", "--config-file=", "--cache-dir", str(tmp_path), "user.py"]
    # mypy finds an installed package by itself, and refuses to be told its place
    place = {} if PACKAGE.parent.name == "site-packages" else {"MYPYPATH": str(PACKAGE.parent)}
    env = os.environ | place
    said = subprocess.run(call, env=env, capture_output=True, text=True, cwd=tmp_path).stdout.splitlines()
    errors = [line for line in said if line.startswith("user.py") and ": error: " in line]
    assert len(errors) == 2
    assert '"Study" has no attribute "optimise"' in errors[0] and "runs" in errors[1]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_the_rest_works_without(name, tmp_path):
    """A study, an export and the schema; a table of the capability is refused as an unknown key, and its commands are
    gone. A folder with a command alone has no table."""
    copy = tmp_path / "src" / "chainunit"
    # with the compiled modules, which are valid as long as the dates of the files are
    shutil.copytree(PACKAGE, copy)
    shutil.rmtree(copy / "capabilities" / name)
    lines = wheels.PROJECT.read_text("utf-8").splitlines(keepends=True)
    others = [line for line in lines if f'"chainunit.capabilities.{name}' not in line]
    assert len(others) < len(lines)
    wheels.install_copy(copy.parent, "".join(others))
    shutil.copytree(Path(__file__).parents[1] / "fmu", tmp_path / "fmu")
    (tmp_path / "study.toml").write_text(STUDY)
    parts = [part for part in capabilities() if part.name == name]
    assert bool(parts) == (name not in COMMANDS_ALONE)
    tables = [table for part in parts for table in part.tables]
    call = [sys.executable, "-c", SMOKE, str(tmp_path), *tables]
    env = os.environ | {"PYTHONPATH": str(copy.parent)}
    process = subprocess.run(call, env=env, capture_output=True, text=True, cwd=tmp_path)
    assert process.returncode == 0, process.stderr
    said = json.loads(process.stdout.splitlines()[-1])
    assert not set(tables) & set(said["properties"])
    assert list(said["refused"]) == tables
    gone = sorted(set(get_command(app).list_commands(None)) - set(said["commands"]))
    assert gone == COMMANDS.get(name, [])
    assert "chainunit study " in said["help"]
    assert not any(f"chainunit {command} " in said["help"] for command in gone)
    assert all(f"{table}: unknown key" in words for table, words in said["refused"].items())
    result = ResultEntries(json.loads((tmp_path / "result" / "result.json").read_text()))
    assert result["status"] == "complete" and "jam_left" in result["answers"]
