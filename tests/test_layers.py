"""The direction of imports, by the imports themselves, and the drawing of the house that is made from them."""

from __future__ import annotations

import ast
import dataclasses
import importlib.util
import inspect
import re
import xml.etree.ElementTree as ET
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import wheels
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from chainunit.core.errors import RunError
from chainunit.core.register import entries
from chainunit.report.analyses import analysis_sections
from chainunit.study.file_section import FileSection, TableForm, TableLists
from chainunit.study.record import StudyRecord

pytestmark = pytest.mark.second

ROOT = Path(__file__).parents[1]
UPWARD: set[tuple[str, str]] = set()
"""Imports that run upward: none may be added."""


def _script(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


HOUSE = _script(ROOT / "docs" / "draw_architecture.py")


def test_imports_run_downward():
    upward = {(a, b) for a, b in HOUSE.imports() if not HOUSE.admitted(HOUSE.layer(a), HOUSE.layer(b))}
    assert upward <= UPWARD, f"these imports run upward: {sorted(upward - UPWARD)}"
    assert upward >= UPWARD, f"these are mended, take them out of UPWARD: {sorted(UPWARD - upward)}"


HOMES = {
    "chainunit.machines": {"machines"},
    "chainunit.motors": {"drives"},
    "chainunit.models": {"machines", "drives"},
    "chainunit.line": {"study"},
    "chainunit.organs": {"study", "capabilities"},
    "chainunit.capabilities": {"capabilities"},
}
"""By group of entry points, the layers that declare in it."""


def test_what_is_imported_by_name_is_declared():
    """The layers below find what the layers above have by entry points alone. Each is of the layers of its group, and
    names a module that is there; the installed ones are these of the project."""
    declared = wheels.declared(wheels.PROJECT.read_text("utf-8"))
    assert declared.keys() == HOMES.keys()
    for group, points in declared.items():
        assert {name: entry.value for name, entry in entries(group).items() if _is_own(entry)} == points
        for value in points.values():
            module = value.partition(":")[0].removeprefix("chainunit.")
            assert HOUSE.layer(module) in HOMES[group], value
            path = HOUSE.PACKAGE.joinpath(*module.split("."))
            assert path.is_dir() or path.with_suffix(".py").exists(), value
    by_name = {
        ".".join(file.relative_to(HOUSE.PACKAGE).with_suffix("").parts)
        for file in HOUSE.PACKAGE.rglob("*.py")
        if re.search(r"\bimport_module\(|__import__\(|\bentry\.load\(\)", file.read_text("utf-8"))
    }
    assert by_name == BY_NAME
    with pytest.raises(
        RunError, match=r"no installed package declares chainunit\.other: install chainunit anew"
    ):
        entries("chainunit.other")


BY_NAME = {
    "__init__",  # the names for users
    "core.register",
    "study.registry",  # the modules in the folder of a capability
    "core.model",  # a model that pickle takes by its place
    "study.remarks",  # the modules of capabilities, whose remarks the reference lists
}
"""The modules that import others by name."""


def _is_own(entry):
    return entry.dist is None or entry.dist.name == "chainunit"


def test_no_renderer_names_a_study_or_a_machine():
    """Blocks, figures and lines, and the modules that draw and print them, serve any study."""
    renderers = [
        *"blocks figure files html lines markdown motion".split(),
        *"page_figures print_figures style terminal".split(),
    ]
    assert {f"report.{name}" for name in renderers} <= {a for a, _ in HOUSE.imports()} | {"report.lines"}
    results = {(a, b) for a, b in HOUSE.imports() if a.startswith("report.") and a.split(".")[1] in renderers}
    assert {HOUSE.layer(b) for _, b in results} == {"core", "reading", "report"}
    assert {b.split(".")[1] for _, b in results if HOUSE.layer(b) == "report"} <= set(renderers)


def test_no_modules_import_each_other_in_a_circle():
    pairs = [(a, b) for a, b in HOUSE.imports() if a != b]
    names = sorted({name for pair in pairs for name in pair})
    matrix = np.zeros((len(names), len(names)))
    for a, b in pairs:
        matrix[names.index(a), names.index(b)] = 1.0
    count, part = connected_components(csr_matrix(matrix), connection="strong")
    circles = [set(np.array(names)[part == k]) for k in range(count) if np.sum(part == k) > 1]
    assert not circles


def test_a_table_of_a_study_file_is_declared_in_parts_and_a_section_is_made_of_the_study():
    """No declaration of a table knows everything of it, and no section of a report reads the data of a result."""
    sizes = {part: len(dataclasses.fields(part)) for part in (FileSection, TableForm, TableLists)}
    assert max(sizes.values()) <= 16, sizes
    for name, contents in analysis_sections().items():
        assert list(inspect.signature(contents.blocks).parameters) == ["study"], name


def test_no_two_classes_share_a_name():
    """No two classes share a name, apart from a model's own parameters, inputs, states and outputs."""
    places: dict[str, list[str]] = {}
    for file in sorted(HOUSE.PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.ClassDef):
                places.setdefault(node.name, []).append(file.relative_to(HOUSE.PACKAGE).as_posix())
    own = {"Parameters", "Inputs", "States", "Outputs"}
    assert {name: files for name, files in places.items() if len(files) > 1 and name not in own} == {}
    assert own <= set(places)


DOORS = {
    # the reader
    "study.study_file": {"changed_tables"},
    # capabilities have their hooks and plans in the folder's own module, or in `capability`
    "study.capability": {"faults", "take_estimates"},
    # the run of a study, from Python and as a task
    "study.provenance": {"provenance", "writers"},
    "study.choice": {"choose", "choose_for", "drive_of"},
    "study.run": {"run_study"},
    "report.study_task": {"_accept", "_compute", "_fmus"},
    # the live machine of a study
    "report.live.study": {"of_study", "without_drive"},
    "report.live.page": {"live_of_config", "live_page_of_config"},
    "app.studies": {"_take"},
    # the export of a study and its linear model, and the tasks of the capabilities
    "study.linear": {"_point_of_study"},
    "study.package": {"drive_to_export", "export_study", "model_and_start", "remarks_on_export"},
    "capabilities.identification.identification": {"identify"},
    "capabilities.optimize.page": {"_accept", "_compute"},
    "capabilities.sweep.page": {"_compute"},
    "capabilities.sweep.points": {"run_sweep", "task_of"},
    "capabilities.watch.watch": {"watch"},
}
"""By module, the functions that take the whole configuration of a study; all others take what they use of it."""


def test_few_functions_take_the_whole_configuration():
    """A function that takes a `Config`, by its annotation or by its name, is one of the doors. The records of a run
    hold the configuration for their reports."""
    found: dict[str, set[str]] = {}
    for file in sorted(HOUSE.PACKAGE.rglob("*.py")):
        module = ".".join(file.relative_to(HOUSE.PACKAGE).with_suffix("").parts).removesuffix(".__init__")
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.FunctionDef) and any(map(_is_whole, _arguments(node))):
                found.setdefault(module, set()).add(node.name)
    hooks = DOORS["study.capability"] | DOORS["study.capability"]
    own = {name for name in found if re.fullmatch(r"capabilities\.\w+(\.capability)?", name)}
    assert all(found[name] <= hooks for name in own), {name: found[name] for name in own}
    assert {name: taken for name, taken in found.items() if name not in own} == DOORS


def _arguments(node):
    of = node.args
    return [*of.posonlyargs, *of.args, *of.kwonlyargs]


def _is_whole(argument):
    """Whether an argument is a `Config`; the commands name the path of a study file config, too."""
    words = _words_of(argument)
    return bool(re.search(r"\bConfig\b", words)) or (argument.arg == "config" and words in ("", "Any"))


WHOLE_RECORD = 210
"""Functions that take the whole record of a study; the number only falls."""
AS_OTHERS_OF_THEIR_KIND = {
    "capabilities.chains.page": {"_over_speed"},
    "capabilities.checks.page": {"missing", "relay"},
    "capabilities.flywheels.analysis": {"_on_heavier"},
    "capabilities.sizing.alternatives": {"_before_flywheel"},
    "capabilities.torsion.page": {"blocks"},
    "report.figures": {"_speed_loop", "_turn"},
    "report.study_task": {"_kept"},
}
"""By module, the functions that take the record and use one part of it, as others are called like them."""


def test_a_function_takes_the_part_of_a_record_that_it_uses():
    """A record has three parts; a function that passes the record on may need all of them, a method is a hook."""
    assert [field.name for field in dataclasses.fields(StudyRecord)] == ["setup", "runs", "findings"]
    whole, of_one_part = 0, {}
    for file in sorted(HOUSE.PACKAGE.rglob("*.py")):
        if "StudyRecord" not in (text := file.read_text("utf-8")):
            continue
        module = ".".join(file.relative_to(HOUSE.PACKAGE).with_suffix("").parts).removesuffix(".__init__")
        tree = ast.parse(text)
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef):
                names = {a.arg for a in _arguments(node) if _words_of(a) == "StudyRecord"}
                whole += bool(names)
                if names and node in tree.body and len(_parts_used(node, names)) == 1:
                    of_one_part.setdefault(module, set()).add(node.name)
    assert of_one_part == AS_OTHERS_OF_THEIR_KIND
    assert WHOLE_RECORD - 5 < whole <= WHOLE_RECORD, whole


def _parts_used(node, names):
    """The attributes that a function takes of its arguments with these `names`; the names of those that it passes on
    are among them, twice."""
    taken = [n.value for n in ast.walk(node) if isinstance(n, ast.Attribute)]
    used = {n.attr for n in ast.walk(node) if isinstance(n, ast.Attribute) and _is_one_of(n.value, names)}
    passed = [n for n in ast.walk(node) if _is_one_of(n, names) and n not in taken]
    return used | ({"passed", "on"} if passed else set())


def _is_one_of(node, names):
    return isinstance(node, ast.Name) and node.id in names


def _words_of(argument):
    return "" if argument.annotation is None else ast.unparse(argument.annotation)


def test_the_scan_sees_every_way_of_importing(tmp_path, monkeypatch):
    """Relative and absolute, of a module and from one, inside a function, and from the package itself."""
    package = tmp_path / "chainunit"
    for name in ("fmu", "groups", "app"):
        (package / name).mkdir(parents=True)
        (package / name / "__init__.py").write_text("")
    (package / "__init__.py").write_text("from .app.cli import app")
    (package / "errors.py").write_text("")
    (package / "fmu" / "export.py").write_text("")
    (package / "groups" / "chain.py").write_text(
        "from .. import __version__, errors\n"
        "from ..errors import InputError\n"
        "def f():\n    from chainunit.fmu.export import export\n"
        "    from chainunit.fmu import export\n    import chainunit.app.cli\n"
    )
    (package / "app" / "cli.py").write_text("from ..groups import chain\n")
    monkeypatch.setattr(HOUSE, "PACKAGE", package)
    assert HOUSE.imports() == {
        ("groups.chain", "errors"),
        ("groups.chain", "fmu.export"),
        ("groups.chain", "app.cli"),
        ("app.cli", "groups.chain"),
    }
    assert [HOUSE.layer(m) for m in ("groups.chain", "errors", "fmu.export", "app.cli")] == [
        "groups", "core", "fmu", "app"
    ]  # fmt: skip
    assert HOUSE.admitted("app", "groups") and not HOUSE.admitted("groups", "app")
    assert HOUSE.admitted("system", "fmu") and not HOUSE.admitted("machines", "fmu")
    assert HOUSE.admitted("fmu", "core") and not HOUSE.admitted("fmu", "groups")


def test_the_page_names_files_that_exist():
    text = (ROOT / "docs" / "architecture.md").read_text("utf-8")
    for name in re.findall(r"`([\w/]+\.py)`", text):
        assert any((base / name).exists() for base in (ROOT, HOUSE.PACKAGE)), name
    for way, (_, stations) in HOUSE.WAYS.items():
        section = text.split(f"## The way of {way}")[1].split("\n## ")[0]
        assert re.findall(r"^\d+\. \*\*(\w+)\*\*", section, re.M) == list(stations), way


def test_the_drawing_is_that_of_the_imports():
    """Its arcs and boxes; else run docs/draw_architecture.py."""

    def shapes(text):
        return [(e.tag, sorted(e.attrib.items()), e.text) for e in ET.fromstring(text).iter()]

    def arcs(text):
        width = "stroke-width"  # follows the number of imports: no reason to draw anew
        return [
            (tag, [(k, v) for k, v in keys if not (tag.endswith("path") and k == width)], words)
            for tag, keys, words in shapes(text)
        ]

    assert arcs(HOUSE.DRAWING.read_text("utf-8")) == arcs(HOUSE.drawing())


EMPTY = {"each", "words", "own", "of", "at", "given", "found", "known", "told", "made"}
AT_MOST = 107
"""Names that say nothing, as of fields and public arguments; the number only falls."""


def test_names_are_nouns_of_the_trade():
    bound = Counter()
    for file in HOUSE.PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                bound[node.id] += 1
            elif isinstance(node, ast.arg):
                bound[node.arg] += 1
            elif isinstance(node, ast.FunctionDef | ast.ClassDef):
                bound[node.name] += 1
    count = sum(bound[name] for name in EMPTY)
    assert count <= AT_MOST, {name: bound[name] for name in EMPTY}
    assert count > AT_MOST - 10, f"lower AT_MOST to {count}"


LONG, UNSAID = 5, 8
"""Lines of a body from which on a function has a docstring, and the functions without one: members that a base class
describes; the number only falls."""


def test_long_functions_say_what_they_give():
    """The methods of Python itself, such as ``__init__``, need no docstring."""
    unsaid = []
    for file in sorted(HOUSE.PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("__"):
                lines = node.body[-1].end_lineno - node.body[0].lineno + 1
                if lines > LONG and ast.get_docstring(node) is None:
                    unsaid.append(f"{file.parent.name}/{file.name}: {node.name}")
    assert len(unsaid) == UNSAID, unsaid
