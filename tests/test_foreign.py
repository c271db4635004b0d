"""Texts and FMUs from outside: the program obeys no control character in them and shortens long ones."""

from __future__ import annotations

import json
import os
import re
import time
import zipfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from records import record_of
from reports import said_of

from chainunit.core.errors import InputError, RunError, printable, shown
from chainunit.core.native.compilers import compiler
from chainunit.fmu.native.export import export
from chainunit.models import MODELS
from chainunit.study import config
from chainunit.system.instance import Fmu, Instance

ESCAPE, RIGHT_TO_LEFT, ISOLATE = "\x1b[31m", "\u202e", "\u2067"
EVIL = f"a{ESCAPE}b{RIGHT_TO_LEFT}c{ISOLATE}d\x07\u2028<script>alert(1)</script> | [x](javascript:y) \\ `"


def harmless(text):
    """Whether a terminal or a page shows every character as a character."""
    return all(x.isprintable() or x in "\n\u200c\u200d\u00a0\u202f" for x in text)


@pytest.mark.parametrize("text", [EVIL, "x" * 600_000, "\x00\x9b31m", "tag \U000e0041", "\ufeff", "\udc80"])
def test_printable_is_one_short_line(text):
    assert harmless(printable(text)) and len(printable(text)) < 2500
    assert "\n" not in printable(text + "\nx")


def test_what_scripts_need_stays():
    for text in (
        "Mühle Nr. 5, 30 kg/m²",
        "می‌خواهم",
        "粉碎机",
        "1\u00a0000 mm",
        "family \U0001f468\u200d\U0001f469",
    ):
        assert printable(text) == text


def nested(n):
    value = []
    for _ in range(n):
        value = [value]
    return value


@pytest.mark.parametrize(
    "given",
    ["x" * 600_000, EVIL * 1000, list(range(100_000)), nested(100_000), {EVIL: "y" * 1000}, "x\n" * 999],
)
def test_a_value_is_cited_in_a_short_line(given):
    assert harmless(shown(given)) and "\n" not in shown(given) and len(shown(given)) < 600


def toml_text(text):
    return json.dumps(text)


@pytest.mark.stages(first=2)
@pytest.mark.parametrize(
    "text",
    [
        f"[machine]\nr = {toml_text(EVIL)}",
        f"[machine]\nr = {toml_text('1' * 600_000 + ' m')}",
        f"[machine]\nr = {toml_text('x' * 600_000)}",
        f"[machine]\nr = {list(range(200_000))}",
        "[machine]\nr" + ".a" * 2_000 + " = 1",
        f"[machine]\n{toml_text(EVIL * 100)} = 1",
        f"start = {toml_text('y' * 600_000)}",
        f"title = {list(range(200_000))}",
        f"crank = {toml_text(EVIL)}",
        "x = " + "[" * 10_000 + "]" * 10_000,
        "x = " + "{a = " * 10_000 + "1" + "}" * 10_000,
        f"{toml_text(EVIL)} = 1\n{toml_text(EVIL)} = 2",
    ],
)
def test_refusals_are_short_and_harmless(text):
    with pytest.raises(InputError) as caught:
        config.parse(text)
    for fault in caught.value.faults:
        message = str(fault)
        assert harmless(message) and "\n" not in message and len(message) < 900


def test_a_foreign_catalogue_is_cited_in_short(tmp_path):
    from chainunit.drives.catalogue import catalogue

    for name, text in (
        ("a.toml", "x = " + "[" * 10_000),
        ("b.toml", f"[[motor]]\ndesignation = {toml_text('z' * 600_000)}"),
        ("c.csv", f"{EVIL * 1000},power\n"),
    ):
        (tmp_path / name).write_text(text)
        with pytest.raises(InputError) as caught:
            catalogue(tmp_path / name)
        for fault in caught.value.faults:
            assert harmless(str(fault)) and len(str(fault)) < 900 + len(str(tmp_path))


def test_titles_are_harmless_wherever_they_go():
    """Terminal, page and Markdown, of each study that has a title."""
    from chainunit.drives.dc_motor import DcMotor
    from chainunit.report.markdown import markdown_text
    from chainunit.study.drive import Drive

    with pytest.raises(InputError, match=r"title: .* has U\+001B, which is no sign of a text"):
        config.parse(f"title = {toml_text(EVIL)}")
    values = config.parse(f"title = {toml_text(EVIL.replace(ESCAPE, '').replace(chr(7), ''))}")
    assert harmless(values.title) and "\n" not in values.title
    assert not re.search(r"(?<!\\)[<>\[\]|`*_]", markdown_text(values.title))
    drive = Drive(DcMotor, values.motor.parameters, values.machine)
    assert harmless(said_of(record_of(values, drive)))
    assert "\\<script\\>" in markdown_text(EVIL)


# -- FMUs


def changed(fmu, file, *, description=lambda text: text, keep=lambda name: True, extra=()):
    """A copy of an FMU with another description and fewer, or more, files."""
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(file, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name == "modelDescription.xml":
                content = description(content.decode()).encode()
            if keep(name):
                new.writestr(name, content)
        for name, content in extra:
            new.writestr(name, content)
    return file


def identifier(value):
    return lambda text: re.sub(r'modelIdentifier="[^"]*"', lambda m: f'modelIdentifier="{value}"', text)


@pytest.fixture(scope="module")
def motor(fmus):
    return fmus["DcMotor"]


@pytest.mark.parametrize("name", ["../../../../tmp/evil", "..", "a/b", "a\\b", "", "x y", "é", "/etc/passwd"])
def test_an_identifier_that_leads_out_of_the_folder_is_refused(name, motor, tmp_path):
    file = changed(motor, tmp_path / "x.fmu", description=identifier(name))
    with pytest.raises(InputError, match=r"x\.fmu: modelIdentifier = .*: must be a name in C"):
        Fmu(file)


def test_a_library_that_is_not_there_or_none_is_told(motor, tmp_path):
    here = Path.cwd()
    for file, values in (
        (
            changed(motor, tmp_path / "none.fmu", keep=lambda name: not name.startswith("binaries")),
            r"none\.fmu: has no library for this machine, binaries/.*; it has none",
        ),
        (
            changed(
                motor,
                tmp_path / "other.fmu",
                keep=lambda name: not name.startswith("binaries"),
                extra=[("binaries/amiga68k/DcMotor.library", b"x")],
            ),
            r"other\.fmu: has no library for this machine, .*; it has those for amiga68k",
        ),
    ):
        fmu = Fmu(file)
        with pytest.raises(InputError, match=values):
            Instance(fmu, "motor")
        fmu.close()
    with zipfile.ZipFile(motor) as archive:
        libraries = [name for name in archive.namelist() if name.startswith("binaries/")]
    broken = changed(
        motor,
        tmp_path / "broken.fmu",
        keep=lambda name: name not in libraries,
        extra=[(name, b"no library") for name in libraries],
    )
    fmu = Fmu(broken)
    with pytest.raises(InputError, match=r"broken\.fmu: its library binaries/.* cannot be loaded"):
        Instance(fmu, "motor")
    fmu.close()
    assert Path.cwd() == here


def test_an_fmu_of_another_kind_is_refused(motor, tmp_path):
    def exchange(text):
        return text.replace("<CoSimulation ", "<ModelExchange ").replace(
            "</CoSimulation>", "</ModelExchange>"
        )

    with pytest.raises(InputError, match=r"Model Exchange alone; must be FMI 2\.0 for Co-Simulation"):
        Fmu(changed(motor, tmp_path / "x.fmu", description=exchange))


def test_what_an_fmu_says_is_harmless(motor):
    fmu = Fmu(motor)
    instance = Instance(fmu, "motor")
    instance.messages.clear()
    instance._callbacks.logger(None, b"motor", 3, b"", (EVIL * 100).encode())
    assert harmless(instance.messages[0]) and len(instance.messages[0]) < 2000
    instance.close()
    fmu.close()


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_an_fmu_that_cannot_be_instantiated_is_told(tmp_path):
    """A GUID that is not the library's."""
    origin = export(MODELS["DcMotor"], tmp_path / "motor.fmu")
    file = changed(
        origin, tmp_path / "x.fmu", description=lambda text: re.sub(r'guid="[^"]*"', 'guid="{other}"', text)
    )
    fmu = Fmu(file)
    with pytest.raises(RunError, match="motor: cannot be instantiated"):
        Instance(fmu, "motor")
    fmu.close()


@pytest.mark.slow
def test_threads_that_load_leave_the_working_directory(motor, fmus, monkeypatch):
    """fmpy goes to each library's folder and back; two threads at once would take each other's folder for home."""
    here, files, change = Path.cwd(), (motor, fmus["ChamberForces"]), os.chdir

    def slow(folder):
        change(folder)
        time.sleep(0.002)

    monkeypatch.setattr(os, "chdir", slow)

    def load(k):
        fmu = Fmu(files[k % 2])
        try:
            Instance(fmu, "unit").close()
        finally:
            fmu.close()

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(load, range(64)))
    assert Path.cwd() == here
