"""Files that would take the memory or the time of the machine, that have no end, or that are no files: each is
refused in words, before anything of it is unpacked. The limits are lowered here, so that small files stand for
large ones."""

from __future__ import annotations

import gzip
import io
import json
import os
import re
import socket
import time
import zipfile

import numpy as np
import pytest
from command import chainunit as command_line

import chainunit
from chainunit.capabilities.handover.studied import load_cycle
from chainunit.capabilities.vouching import archive
from chainunit.capabilities.vouching.certify import members_of
from chainunit.capabilities.vouching.keys import private_key, public_key
from chainunit.capabilities.vouching.verify import verify
from chainunit.capabilities.watch import watch
from chainunit.core import inputs
from chainunit.core.errors import Faults, InputError
from chainunit.drives.catalogue import offer
from chainunit.drives.catalogue_rows import MOST_FAULTS, MOST_ROWS
from chainunit.machines.linkages.entries import MOST_POINTS
from chainunit.machines.linkages.file import description_of, read_linkage
from chainunit.reading import toml_lines
from chainunit.recordings.recording import read_recording
from chainunit.report.series import LOAD_CYCLE_HEADS
from chainunit.study import config
from chainunit.study.stored_result import read_result
from chainunit.system.foreign import fmu_component
from chainunit.system.instance import Fmu


def _table(file):
    table = {"tables": {"t": {"file": str(file)}}, "links": {"a": {"points": {"O": [0, 0]}}}}
    description_of(table, "x")


READERS = {
    "tables.file": _table, "catalogue": offer, "recording": read_recording, "compare": read_result,
    "handover": load_cycle, "result.nc": lambda file: inputs.dataset(file, "start_up"), "study": config.load,
    "linkage": read_linkage, "fmu": Fmu, "verify": lambda file: verify(file, None), "certify": members_of,
    "key": private_key, "public key": public_key, "identification": watch._read_errors,
}  # fmt: skip
"""All places that read a file of the user."""


def refusal(read, file):
    with pytest.raises(InputError) as caught:
        read(file)
    words = next(line for line in str(caught.value).splitlines() if str(file) in line)
    assert len(words) < 1000
    return words


@pytest.mark.parametrize("read", READERS.values(), ids=READERS)
def test_what_is_no_file_is_refused_at_once(read, tmp_path, monkeypatch):
    """A pipe would be waited for, and a device has no end."""
    monkeypatch.chdir(tmp_path)  # the path of a socket is short
    os.mkfifo("pipe")
    (tmp_path / "folder").mkdir()
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind("socket")
        for name in ("pipe", "socket"):
            assert f"is a {name}" in refusal(read, tmp_path / name)
    assert "is a device" in refusal(read, type(tmp_path)("/dev/zero"))
    words = refusal(read, tmp_path / "folder")
    assert "is a folder" in words or "No such file" in words  # a folder may be that of a result


@pytest.mark.parametrize("read", READERS.values(), ids=READERS)
def test_no_refusal_cites_a_file_that_is_none_of_its_kind(read, tmp_path):
    file = tmp_path / "users"
    file.write_text("".join(f"user{k}:secret{k}:{k}:,,,:/home/user{k}:/bin/sh\n" for k in range(200)))
    with pytest.raises(InputError) as caught:
        read(file)
    assert "secret" not in str(caught.value) and str(file) in str(caught.value)


@pytest.mark.parametrize(
    ("limit", "reader"),
    [
        ("TEXT", "tables.file"), ("TEXT", "recording"), ("TOML", "study"), ("TOML", "linkage"), ("JSON", "compare"),
        ("TEXT", "handover"), ("ARCHIVE", "verify"), ("ARCHIVE", "certify"), ("JSON", "identification"),
    ],
)  # fmt: skip
def test_a_file_is_read_up_to_its_largest_size(limit, reader, tmp_path):
    file = tmp_path / "large"
    with file.open("wb") as stream:
        stream.truncate(getattr(inputs, limit) + 1)  # takes no room on the disk
    assert f"more than {getattr(inputs, limit) // inputs.MIB} MiB" in refusal(READERS[reader], file)


def _zip(file, *members):
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as out:
        for name, content in members:
            out.writestr(name, content)
    return file


def test_the_members_of_an_archive_are_added_up_before_one_is_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr(inputs, "UNPACKED", 3 * inputs.MIB)
    monkeypatch.setattr(inputs.check_archive, "__defaults__", (3 * inputs.MIB, "zip archive"))
    monkeypatch.setattr("chainunit.system.instance.ON_DISK", 3 * inputs.MIB)
    file = _zip(tmp_path / "x.fmu", *((f"part{k}", bytes(inputs.MIB)) for k in range(4)))
    assert file.stat().st_size < inputs.MIB / 10
    monkeypatch.setattr(zipfile.ZipFile, "open", lambda *_: pytest.fail("a member is unpacked"))
    for name in ("fmu", "verify", "certify"):
        assert "its content has more than 3 MiB" in refusal(READERS[name], file)
    with pytest.raises(InputError, match="more than 3 MiB"):
        archive.contents(file.read_bytes(), "x.fmu")


def test_the_directory_of_an_archive_is_measured_before_it_is_read(tmp_path, monkeypatch):
    """Also by the record that the form of large archives has."""
    monkeypatch.setattr(zipfile, "ZIP_FILECOUNT_LIMIT", 10)
    file = _zip(tmp_path / "x.fmu", *((f"part{k}", b"") for k in range(100)))
    with file.open("rb") as stream:
        size = inputs._size_of_directory(stream)
    with zipfile.ZipFile(file) as opened:
        assert size == file.stat().st_size - opened.start_dir - 22 - 56 - 20
    monkeypatch.setattr(inputs, "_DIRECTORY", 1000)
    monkeypatch.setattr(zipfile, "ZipFile", lambda *_: pytest.fail("the directory is read"))
    for name in ("fmu", "verify"):
        assert "its directory has more than" in refusal(READERS[name], file)


def test_a_packed_recording_is_unpacked_up_to_its_largest_size(tmp_path, monkeypatch):
    file = tmp_path / "x.csv.gz"
    file.write_bytes(gzip.compress(bytes(3 * inputs.MIB)))
    monkeypatch.setattr(inputs.unzipped, "__defaults__", (2 * inputs.MIB,))
    assert "its content has more than 2 MiB" in refusal(read_recording, file)


def test_rows_and_columns_of_a_table_are_counted(tmp_path, monkeypatch):
    monkeypatch.setattr(inputs.lines_of_table, "__defaults__", (1000,))
    file = tmp_path / "x.csv"
    file.write_text("time [s],motor.i [A]\n" + "1,2\n" * 1001)
    assert "more than 1000 rows" in refusal(read_recording, file)
    file.write_text("," * 2000 + "\n" + "1\n" * 200)
    assert "more than 1000 columns" in refusal(read_recording, file)


def test_a_table_of_a_load_has_a_largest_number_of_points(tmp_path):
    """Each step of a run goes through all of them."""
    file = tmp_path / "x.csv"
    file.write_text("".join(f"{k},{k}\n" for k in range(30_000)))
    assert f"has 30000 rows; must have at most {MOST_POINTS}" in refusal_of_table({"file": str(file)})
    many = list(range(MOST_POINTS + 1))
    assert f"must have at most {MOST_POINTS}" in refusal_of_table({"x": many, "value": many})


def test_a_long_list_in_toml_is_refused_before_it_is_parsed(tmp_path, monkeypatch):
    """A file of 3.8 MB took 7 s."""
    file = tmp_path / "x.toml"
    file.write_text(f"[tables.t]\nx = [{'1, ' * 360_000}]\n")
    monkeypatch.setattr("tomllib.loads", lambda text: pytest.fail("it is parsed"))
    assert "more than 1 MiB" in refusal(read_linkage, file)
    assert "more than 1 MiB" in refusal(READERS["study"], file)


def refusal_of_table(table):
    with pytest.raises(InputError) as caught:
        description_of({"tables": {"t": table}, "links": {"a": {"points": {"O": [0, 0]}}}}, "x")
    return next(line for line in str(caught.value).splitlines() if line.startswith("tables.t"))


def test_a_cell_that_is_too_long_is_refused(tmp_path):
    file = tmp_path / "x.csv"
    file.write_text(f"0,1\n1,{'5' * 200_000}\n")
    assert "line 2: no valid CSV" in refusal_of_table({"file": str(file)})


def test_a_catalogue_is_read_up_to_its_largest_number_of_rows_and_faults(tmp_path):
    file = tmp_path / "x.csv"
    head = "designation,power [kW],poles,speed [rev/min],efficiency,power_factor\n"
    file.write_text(head + "a,1,4,1440,0.8,0.8\n" * MOST_ROWS)
    assert f"more than {MOST_ROWS} rows" in refusal(offer, file)
    file.write_text(head + "a,1,4,1440,7,0.8\n" * (2 * MOST_FAULTS))
    with pytest.raises(InputError) as caught:
        offer(file)
    lines = str(caught.value).splitlines()
    assert len(lines) < MOST_FAULTS + 5 and "are not checked" in lines[-1]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[" * 100_000, "nested too deeply"),
        ('{"a": NaN}', "no number"),
        ("[1e400]", "too large"),
        ("x", "Expecting"),
    ],
)
def test_json_that_cannot_be_read_is_refused_in_a_line(text, words, tmp_path):
    file = tmp_path / "x.json"
    file.write_text(text)
    for name in ("compare", "identification"):
        assert words in refusal(READERS[name], file)


def test_a_series_that_would_fill_the_memory_or_is_damaged_is_refused(tmp_path, monkeypatch):
    import xarray as xr

    file = tmp_path / "result.nc"
    xr.Dataset({"x": ("time", np.zeros(300_000))}).to_netcdf(file, group="start_up")
    assert inputs.dataset(file, "start_up").x.size == 300_000
    monkeypatch.setattr(inputs, "UNPACKED", 2 * inputs.MIB)
    assert "more than 2 MiB" in refusal(READERS["result.nc"], file)
    whole = file.read_bytes()
    for data in (whole[: len(whole) // 2], whole[:8] + bytes(2000) + whole[2008:], b"x", b""):
        file.write_bytes(data)
        assert "cannot be read" in refusal(READERS["result.nc"], file)


def test_a_load_cycle_that_is_none_is_not_cited(tmp_path):
    file = tmp_path / "load_cycle.csv"
    file.write_text(f"{','.join(LOAD_CYCLE_HEADS)}\n1,2,3,secret\n1,2,3,4\n")
    words = refusal(load_cycle, file)
    assert "a row of the load cycle is not four numbers" in words and "secret" not in words


DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g"><CoSimulation modelIdentifier="m"/>
<ModelVariables><ScalarVariable name="k" valueReference="0" causality="parameter" variability="fixed">
<Real start="1.0" {more}/></ScalarVariable></ModelVariables><ModelStructure/></fmiModelDescription>"""
TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"
ENTITY = '<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]><a>&x;</a>'


@pytest.mark.parametrize(
    ("description", "terminals", "words"),
    [
        (DESCRIPTION.replace('start="1.0"', 'start="nan0.0"'), "<a/>", 'k has start = "nan0.0"'),
        (DESCRIPTION.replace('start="1.0"', 'start="1e999"'), "<a/>", "must be a finite number"),
        (DESCRIPTION.replace("{more}", 'min="low"'), "<a/>", 'k has min = "low"'),
        (DESCRIPTION, "garbage", "terminalsAndIcons.xml: is no XML"),
        (DESCRIPTION, "<a>&nothing;</a>", "terminalsAndIcons.xml: is no XML"),
        (DESCRIPTION, '<?xml version="1.0" encoding="klingon"?><a/>', "terminalsAndIcons.xml: is no XML"),
        (DESCRIPTION, ENTITY, "terminalsAndIcons.xml: has a document type"),
        (ENTITY, "<a/>", "modelDescription.xml: has a document type"),
        (DESCRIPTION + " " * inputs.XML, "<a/>", "modelDescription.xml: the document has more than"),
    ],
    ids=range(9),
)  # fmt: skip
def test_documents_of_a_foreign_fmu_are_refused_in_a_line(description, terminals, words, tmp_path):
    members = ("modelDescription.xml", description.replace("{more}", "")), (TERMINALS, terminals)
    file = _zip(tmp_path / "x.fmu", *members)
    told = refusal(fmu_component, file)
    assert words in told and "\n" not in told and "/tmp/chainunit" not in told


def test_the_lines_of_a_toml_text_are_found_once_through():
    """Of a list over many lines, each of which may be its last; texts and comments may have brackets."""
    text = "a = [\n" + "[1]\n," * 400 + ']\nb = """\n[c]\n"""  # [\n[d]\ne = [ # ]\n"]", \'[\',\n]\nf = 1\n'
    lines = toml_lines.lines_of(text)
    assert {name: line for name, line in lines.items() if len(name) < 4} == {
        "a": 1, "b": 403, "d": 406, "d.e": 407, "d.f": 410
    }  # fmt: skip
    calls = []
    loads = toml_lines.tomllib.loads
    toml_lines.tomllib.loads = lambda text: calls.append(len(text)) or loads(text)
    try:
        toml_lines.lines_of(text)
    finally:
        toml_lines.tomllib.loads = loads
    assert sum(calls) <= len(text)


@pytest.mark.parametrize(
    "text", [f"{'a.' * 1000}b = 1", f"[{'a.' * 1000}b]\nc = 1", f"x = {'[' * 200}{']' * 200}"]
)
def test_tables_inside_tables_have_a_largest_depth(text, tmp_path):
    file = tmp_path / "x.toml"
    file.write_text(text)
    for name in ("study", "linkage"):
        assert re.search("nested more than 30 times", refusal(READERS[name], file))


def test_tables_from_python_have_a_largest_depth_too():
    deep = {}
    for _ in range(2000):
        deep = {"a": deep}
    with pytest.raises(InputError, match="nested more than 30 times"):
        chainunit.Study(machine=deep)


def test_an_archive_of_the_size_that_is_read_is_as_it_was():
    content = {"a": b"1" * 1000, "b": json.dumps([1, 2]).encode()}
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as made:
        for name, data in content.items():
            made.writestr(name, data)
    assert archive.contents(out.getvalue(), "x.fmu") == content


@pytest.mark.stages(first=1)
@pytest.mark.parametrize(
    ("command", "text"),
    [
        ("study", "[machine]\n" + "".join(f"key_{k} = {k}\n" for k in range(50_000))),
        ("study", "".join(f"[key_{k}]\n" for k in range(50_000))),
        ("linkage", "".join(f"[loads.x{k}]\n" for k in range(20_000))),
    ],
    ids=["keys", "tables", "loads"],
)
def test_a_file_of_very_many_keys_is_refused_at_once(tmp_path, command, text):
    """The words on each unknown key took a millisecond, and their collection the square of their number."""
    (tmp_path / "many.toml").write_text(text)
    begin = time.monotonic()
    run = command_line(command, "many.toml", "-o", "out", cwd=tmp_path)
    assert (run.returncode, run.stderr.splitlines()) == (
        2, ["chainunit: many.toml: has more than 5000 keys, the most that are read"],
    )  # fmt: skip
    assert time.monotonic() - begin < 30.0


def test_faults_are_collected_in_a_time_that_grows_with_their_number():
    faults, begin = Faults(), time.process_time()
    for _ in range(20_000):
        with faults.collected():
            raise InputError("wrong")
    again = faults.errors[7]
    with faults.collected():
        raise again
    assert len(faults.errors) == 20_000 and time.process_time() - begin < 2.0
