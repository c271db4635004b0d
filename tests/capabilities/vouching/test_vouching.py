"""`chainunit key`, `certify` and `verify`: what a certified file carries, and every way in which one may not hold."""

from __future__ import annotations

import errno
import io
import json
import random
import re
import subprocess
import sys
import zipfile
from importlib import metadata
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from command import chainunit
from fmpy.validation import validate_fmu

from chainunit import ChainUnitMachine, InputError, __version__
from chainunit.capabilities.vouching import (
    archive,
    certify,
    documents,
    experiments,
    keys,
    libraries,
    manifest,
    rerun,
)
from chainunit.capabilities.vouching.domain import domain
from chainunit.capabilities.vouching.integrity import integrity
from chainunit.capabilities.vouching.judgement import _difference
from chainunit.capabilities.vouching.verify import FAILS, HOLDS, OPEN, conclusion, verify
from chainunit.core import inputs
from chainunit.core.errors import WriteError
from chainunit.fmu.backends import export
from chainunit.fmu.native.export import export as native
from chainunit.fmu.native.platforms import compiles
from chainunit.fmu.reference import REFERENCE, RELATED
from chainunit.machines.accelerator import Accelerator
from chainunit.machines.chain_unit import ChamberForces
from chainunit.models import MODELS
from chainunit.study.verdict import CRANK_GOOD, ROCKER_GOOD, ROCKER_GOOD_EMPTY

pytest.importorskip("cryptography")


def silent(what):
    pass


@pytest.fixture(scope="module")
def made(once):
    """A folder with a key, and a certified FMU beside the same without certification."""

    def fill(folder):
        assert chainunit("key", cwd=folder).returncode == 0
        export(ChamberForces, folder / "plain.fmu", {"left.material_mass": 45.0})
        run = chainunit("certify", "plain.fmu", "-o", "it.fmu", cwd=folder)
        assert run.returncode == 0, run.stderr
        (folder / "said.txt").write_text(run.stdout)

    return once("vouching", fill)


@pytest.fixture(scope="module")
def data(made):
    return (made / "it.fmu").read_bytes()


@pytest.fixture(scope="module")
def members(data):
    return archive.contents(data).members


@pytest.fixture(scope="module")
def own(made):
    return keys.private_key(made / "chainunit.key")


@pytest.fixture(scope="module")
def other():
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    return Ed25519PrivateKey.generate()


def signed(members, key, **changes):
    """A file with these members, signed again: manifest and signature anew."""
    rest = {n: x for n, x in members.items() if n not in (manifest.MANIFEST, manifest.SIGNATURE)}
    given = {"kind": "fmu", "name": "it", "version": __version__, "time": "2026-11-27T00:00:00Z"}
    return manifest.signed(rest, key, **given | changes)


def failing(data, key=None):
    return [each.words for each in integrity(data, key).findings if each.holds is False]


def checked(tmp_path, data, **options):
    """The lines of a file with this content, by topic; its signer is named."""
    file = tmp_path / "it.fmu"
    file.write_bytes(data)
    options.setdefault("told", silent)
    return {each.topic: each for each in verify(file, integrity(data).public, **options)}


# -- what holds


@pytest.mark.compiler
def test_a_certified_fmu_holds(made):
    run = chainunit("verify", "it.fmu", "--key", "chainunit.key.pub", cwd=made)
    lines = run.stdout.splitlines()
    assert (run.returncode, run.stderr) == (0, "")
    assert [re.split(r"  +", line)[:2] for line in lines[:-1]] == [
        ["holds", topic]
        for topic in (
            "signature", "members", "SRMD", "version", "domain", "equations", "reference experiment",
            "smooth experiment", "step", "energy", "points",
        )
    ]  # fmt: skip
    assert lines[-1] == "it.fmu: holds"
    assert "by the expected key" in lines[0] and "31 members" in lines[1]


NEEDED = {"cryptography", "fmpy", "numpy", "pydantic", "rich", "scipy", "typer"}
"""The packages that a receiver installs beside this one; docs/how-to/vouching.md names them."""
PAGE = Path(__file__).parents[3] / "docs" / "how-to" / "vouching.md"


@pytest.mark.compiler
def test_a_receiver_needs_few_packages(made):
    """The others, as casadi, are not to be had for every machine."""
    arguments = ["verify", "it.fmu", "--key", "chainunit.key.pub"]
    code = f"import sys; from chainunit.app.cli import app; app({arguments}, standalone_mode=False)"
    after = "print('loaded', *{m.split('.')[0].lower() for m in sys.modules})"
    command = [sys.executable, "-c", f"{code}; {after}"]
    run = subprocess.run(command, cwd=made, capture_output=True, text=True, check=True)
    *said, loaded = run.stdout.splitlines()
    declared = {re.match(r"[\w-]+", line)[0].lower() for line in metadata.requires("chainunit")}
    assert said[-1] == "it.fmu: holds" and {"casadi", "pandas", "xarray"} < declared
    assert (declared | {"cryptography"}) & set(loaded.split()) == NEEDED
    (line,) = re.findall("^pip install (?!--no-deps|')(.*)$", PAGE.read_text("utf-8"), re.MULTILINE)
    assert set(line.split()) == NEEDED - {"rich"}, "typer brings rich"


def test_other_members_stay_to_the_bit_and_importers_take_it(made, data, members):
    plain = archive.contents((made / "plain.fmu").read_bytes()).members
    changed = {name for name, content in plain.items() if members[name] != content}
    assert changed == {RELATED}
    added = set(members) - set(plain)
    assert all(name.startswith(manifest.OWN) or name == documents.SRMD for name in added)
    assert list(validate_fmu(str(made / "it.fmu"))) == []
    one, two = (
        fmpy.simulate_fmu(str(made / name), stop_time=0.1, output_interval=0.02, output=["tau", "J"])
        for name in ("plain.fmu", "it.fmu")
    )
    np.testing.assert_array_equal(one, two)
    with zipfile.ZipFile(io.BytesIO(data)) as opened:
        assert opened.testzip() is None and {info.date_time for info in opened.infolist()} == {
            (1980, 1, 1, 0, 0, 0)
        }


def test_to_certify_is_deterministic_and_replaces_an_earlier_one(made, data, own):
    """From the FMU as it was exported, and from the certified one, with the same bytes."""
    for name in ("plain.fmu", "it.fmu"):
        again = certify.certified(certify.members_of(made / name), "it.fmu", own, None, silent)
        assert again.data == data
    plain = archive.contents((made / "plain.fmu").read_bytes()).members
    assert certify.members_of(made / "it.fmu") == plain


def test_the_domain_of_validity_in_numbers(members):
    found = json.loads(members[documents.DOMAIN])
    crank = found["variables"]["r"]
    quantity = next(v.quantity for v in ChamberForces.parameter_layout.variables if v.name == "r")
    assert (crank["causality"], crank["unit"], crank["start"]) == ("parameter", "m", quantity.start)
    assert (crank["min"], crank["max"]) == (quantity.low, quantity.high)
    low, high = crank["tried"]
    assert 0.95 * quantity.start <= low < quantity.start < high <= 1.05 * quantity.start
    assert found["variables"]["left.material_mass"]["causality"] == "input"
    limits = {each["name"]: each["value"] for each in found["limits"]}
    machine = ChainUnitMachine()
    from chainunit import SideLoads

    loads = (
        SideLoads(material_mass=45.0, processing_force=0.0),
        SideLoads(material_mass=0.0, processing_force=0.0),
    )
    right = json.loads(members[documents.DOMAIN])["variables"]["right.material_mass"]["start"]
    if right:
        loads = loads[0], SideLoads(material_mass=right, processing_force=0.0)
    assert limits["slack_free_speed"] == pytest.approx(machine.slack_speed(*loads), rel=1e-9)
    assert limits["chain_resonance"] == pytest.approx(
        float(machine.chain_modes(*loads).frequency[0]), rel=1e-9
    )
    mode = limits["chain_resonance"]
    assert limits["crank_torque_speed"] == pytest.approx(CRANK_GOOD * mode, rel=1e-12)
    good = ROCKER_GOOD if right else ROCKER_GOOD_EMPTY
    assert limits["rocker_torque_speed"] == pytest.approx(good * mode, rel=1e-12)
    assert limits["rocker_torque_speed"] < limits["crank_torque_speed"] < mode < limits["slack_free_speed"]
    subjects = [each["subject"] for each in found["conditions"]]
    assert subjects == [each.subject for each in ChamberForces.required]
    assert all(each["above"] is None or each["value"] > each["above"] for each in found["conditions"])


def test_evidence_holds_the_numbers_of_the_sentences(members):
    found = json.loads(members[documents.EVIDENCE])
    assert found["reference"]["deviation"] <= 1e-12 and found["tolerance"] == 1e-9
    assert found["energy"]["missing"] < 1e-7 * found["energy"]["flow"]
    assert found["points"]["deviation"] < 1e-12 and found["points"]["power_gap"] < 1e-12
    assert len(found["points"]["at"]) == experiments.POINTS
    first = found["points"]["at"][0]
    assert first["given"]["r"] == ChamberForces.Parameters().r
    assert found["sources"] == certify.sources_hash()
    words = members[documents.REPORT].decode()
    assert f"{found['energy']['missing']:.2g} J are missing" in words


def test_the_forms_of_the_standards(made, data, members):
    """Roles and places by FMI-LS-REF; SRMD with the checksum of the file beside it; CycloneDX."""
    root = ElementTree.fromstring(members[RELATED])
    roles = {node.get("source"): node.get("role") for node in root.findall("Related")}
    assert {roles[name] for name in roles if name.startswith("vouching/")} == {
        "report", "meta-data", "signature", "experiment/validation"
    }  # fmt: skip
    for source in roles:
        inside = f"{REFERENCE}/{source}" if not source.startswith("../") else f"extra/{source[3:]}"
        assert inside in members
    beside = ElementTree.fromstring((made / "it.srmd").read_bytes())
    inner = ElementTree.fromstring(members[documents.SRMD])
    space = "{http://ssp-standard.org/SSPTraceability1/SimulationResourceMetaData}"
    assert beside.tag == inner.tag == f"{space}SimulationResourceMetaData"
    assert beside.get("checksum") == manifest.sha3(data) and beside.get("checksumType") == "SHA3-256"
    assert beside.get("data") == "it.fmu" and inner.get("data") is None and inner.get("version") == "1.0.0"
    bill = json.loads(members[documents.SBOM])
    assert (bill["bomFormat"], bill["specVersion"]) == ("CycloneDX", "1.6")
    hashes = {each["name"]: each["hashes"][0]["content"] for each in bill["components"]}
    last = {documents.SBOM, manifest.MANIFEST, manifest.SIGNATURE}
    assert hashes == {name: manifest.sha3(x) for name, x in members.items() if name not in last}
    assert "chainunit" in {each["name"] for each in bill["metadata"]["tools"]["components"]}


def test_the_bill_of_materials_is_valid(members):
    pytest.importorskip("jsonschema")
    validation = pytest.importorskip("cyclonedx.validation.json")
    from cyclonedx.schema import SchemaVersion

    valid = validation.JsonStrictValidator(SchemaVersion.V1_6)
    bill = members[documents.SBOM].decode()
    assert valid.validate_str(bill) is None
    assert valid.validate_str(bill.replace("SHA3-256", "SHA3", 1)) is not None


SCHEMAS = Path(__file__).parents[2] / "data" / "schemas"
"""The schemas of FMI-LS-REF and of the parts of FMI 3.0 that it names, of the FMI project (2-clause BSD licence)."""
_ATTRIBUTES = "".join(
    f'<xs:attribute name="{name}" type="xs:string"/>' for name in ("type", "href", "role", "label", "title")
)
XLINK = (
    '<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema" targetNamespace="http://www.w3.org/1999/xlink">'
    f'{_ATTRIBUTES}<xs:attribute name="arcrole" type="xs:string"/><xs:attribute name="from" type="xs:string"/>'
    '<xs:attribute name="to" type="xs:string"/></xs:schema>'
)


@pytest.mark.second
def test_the_manifest_of_fmi_ls_ref_is_valid_by_its_schema(members, tmp_path):
    xmlschema = pytest.importorskip("xmlschema")
    for file in SCHEMAS.glob("*.xsd"):
        text = re.sub(r'(schemaLocation=")https://[^"]*/', r"\1", file.read_text("utf-8"))
        (tmp_path / file.name).write_text(text, "utf-8")
    schema = xmlschema.XMLSchema10(tmp_path / "fmi3LayeredStandardReferenceManifest.xsd")
    text = members[RELATED].decode()
    assert list(schema.iter_errors(text)) == []
    assert list(schema.iter_errors(text.replace('role="report"', 'role="reports"', 1)))


@pytest.mark.second
def test_the_meta_data_are_valid_by_the_schema_of_srmd(made, members, tmp_path):
    xmlschema = pytest.importorskip("xmlschema")
    resources = Path(pytest.importorskip("pyssp_standard").__file__).parent / "resources"
    for name in ("SRMD11.xsd", "STC11.xsd", "SystemStructureCommon.xsd"):
        text = re.sub(r'(schemaLocation=")https://[^"]*/', r"\1", (resources / name).read_text("utf-8"))
        (tmp_path / name).write_text(text, "utf-8")
    (tmp_path / "xlink.xsd").write_text(XLINK, "utf-8")
    schema = xmlschema.XMLSchema11(tmp_path / "SRMD11.xsd")
    for content in (members[documents.SRMD].decode(), (made / "it.srmd").read_text("utf-8")):
        assert list(schema.iter_errors(content)) == []
        assert list(schema.iter_errors(content.replace(" name=", " title=", 1)))


# -- what does not hold


def spans(data, stated):
    """By what a sentence must name, the place of its bytes in the file: members, and the directory at the end."""
    found = {name: (own.at, own.at + own.length) for name, own in stated.items()}
    for name in (manifest.MANIFEST, manifest.SIGNATURE):
        top, _, end = archive.located(data, name)
        found[name] = top, end
    found[""] = found[manifest.SIGNATURE][1], len(data)
    return found


@pytest.mark.second
def test_500_changes_of_one_bit_are_found_and_named(data):
    stated = integrity(data).manifest.members
    places, rng = spans(data, stated), random.Random(34)
    assert sum(end - begin for begin, end in places.values()) == len(data)
    names = list(places)
    for k in range(500):
        name = names[k % len(names)]
        bit = rng.randrange(8 * places[name][0], 8 * places[name][1])
        changed = bytearray(data)
        changed[bit // 8] ^= 1 << bit % 8
        (words,) = failing(bytes(changed))
        if name:
            assert words.startswith(f"{name}: "), (bit, words)
        else:
            assert "its line in the directory" in words or words.startswith("the end of the archive"), (
                bit,
                words,
            )


@pytest.mark.parametrize("place", ["modelDescription.xml", manifest.MANIFEST, manifest.SIGNATURE, ""])
def test_the_command_names_a_changed_bit_and_loads_nothing(tmp_path, data, place):
    begin, end = spans(data, integrity(data).manifest.members)[place]
    changed = bytearray(data)
    changed[(begin + end) // 2] ^= 4
    (tmp_path / "it.fmu").write_bytes(changed)
    run = chainunit("verify", "it.fmu", cwd=tmp_path)
    assert (run.returncode, run.stderr) == (1, "")
    (words,) = (line for line in run.stdout.splitlines() if line.startswith("FAILS"))
    assert (place or "the directory") in words
    assert "holds  reference" not in run.stdout
    assert re.search(r"it\.fmu: does not hold: 1 of \d lines fail", run.stdout)


def test_no_bytes_at_all_make_an_error(data):
    """Pieces, repetitions and noise end in sentences."""
    rng = random.Random(5)
    for k in range(60):
        piece = data[: rng.randrange(len(data))] if k % 3 else rng.randbytes(rng.randrange(400))
        if k % 5 == 0:
            piece = piece + data[-rng.randrange(1, 3000) :]
        assert failing(bytes(piece))
    assert failing(b"") and failing(data + b"x") == [
        "the end of the archive is changed: count of members, place of the directory, or a comment"
    ]


def test_another_key_has_its_own_sentence(made, tmp_path, members, other, data):
    (tmp_path / "it.fmu").write_bytes(signed(members, other))
    run = chainunit("verify", "it.fmu", "--key", made / "chainunit.key.pub", cwd=tmp_path)
    assert run.returncode == 1
    mine, theirs = (
        keys.fingerprint(x)
        for x in (keys.public_key(made / "chainunit.key.pub"), integrity(signed(members, other)).public)
    )
    assert f"holds, but by another key: expected {mine}, signed by {theirs}" in run.stdout
    assert "are not run: a file that is not as signed is not loaded" in run.stdout
    # whoever puts another key under a signature is found out
    content = json.loads(members[manifest.SIGNATURE])
    content["public_key"] = integrity(signed(members, other)).public.hex()
    forged = manifest.check_signature(members[manifest.MANIFEST], manifest.json_bytes(content))
    assert "does not hold: it is changed, or was not made by the key" in forged.fault


def packed(members, order=sorted, **options):
    """The members in a zip file of another program."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, **options) as opened:
        for name in order(members):
            opened.writestr(name, members[name])
    return stream.getvalue()


def test_missing_added_changed_members_and_another_packer(members):
    fewer = {n: x for n, x in members.items() if n != "modelDescription.xml"}
    assert failing(packed(fewer)) == ["modelDescription.xml: is missing"]
    assert failing(packed({**members, "extra/new.txt": b"1"})) == [
        "extra/new.txt: was added: it is not signed"
    ]
    changed = {**members, "modelDescription.xml": members["modelDescription.xml"] + b" "}
    assert failing(packed(changed)) == ["modelDescription.xml: its content is changed"]
    (words,) = failing(packed(members))
    assert words.startswith("the members are as signed, but another program packed the archive anew")
    for name in (manifest.MANIFEST, manifest.SIGNATURE):
        (words,) = failing(packed({n: x for n, x in members.items() if n != name}))
        assert words.startswith(f"{name}: is missing")


def test_a_member_that_stands_twice_is_named(members):
    stream = io.BytesIO(packed(members))
    with zipfile.ZipFile(stream, "a") as opened, pytest.warns(UserWarning, match="Duplicate"):
        opened.writestr("modelDescription.xml", b"other")
    assert "modelDescription.xml: stands in the archive twice" in failing(stream.getvalue())


def test_a_member_under_another_order_of_the_directory_is_found(data):
    """The same entries with two lines of the directory exchanged, or with a comment."""
    with zipfile.ZipFile(io.BytesIO(data)) as opened:
        begin = opened.start_dir
    tail = data[begin:]
    first = 46 + int.from_bytes(tail[28:30], "little")
    second = first + 46 + int.from_bytes(tail[first + 28 : first + 30], "little")
    swapped = data[:begin] + tail[first:second] + tail[:first] + tail[second:]
    assert len(swapped) == len(data) and zipfile.ZipFile(io.BytesIO(swapped)).testzip() is None
    assert all("its line in the directory of the archive is changed" in words for words in failing(swapped))
    assert len(failing(swapped)) >= 2
    stream = io.BytesIO(data)
    with zipfile.ZipFile(stream, "a") as opened:
        opened.comment = b"signed by me"
    (words,) = failing(stream.getvalue())
    assert words.startswith("the end of the archive is changed")


@pytest.mark.second
def test_a_file_that_is_bad_from_its_bytes_on_is_judged_without_the_models(made, tmp_path, data):
    """So in some tenths of a second: neither the models nor the reader of FMUs is imported."""
    (tmp_path / "cut.fmu").write_bytes(data[:5000])
    (tmp_path / "plain.fmu").write_bytes((made / "plain.fmu").read_bytes())
    (tmp_path / "bit.fmu").write_bytes(data[:700] + bytes([data[700] ^ 1]) + data[701:])
    words = (
        "import sys\nfrom chainunit.app.cli import app\ntry:\n    app(sys.argv[1:], standalone_mode=False)\n"
    )
    code = f"{words}finally:\n    print('loaded', *sys.modules)"
    for name in ("cut.fmu", "bit.fmu", "plain.fmu"):
        arguments = ["verify", str(tmp_path / name), "--key", str(made / "chainunit.key.pub")]
        run = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True)
        assert "does not hold" in run.stdout
        loaded = set(run.stdout.splitlines()[-1].split())
        assert not loaded & {"scipy", "casadi", "fmpy", "chainunit.models"}


def test_an_unsigned_file_no_archive_and_no_file(made, tmp_path):
    run = chainunit("verify", "plain.fmu", cwd=made)
    assert (
        run.returncode == 1 and "the file is not signed; chainunit vouch certify FILE signs one" in run.stdout
    )
    (tmp_path / "text.fmu").write_text("no archive")
    run = chainunit("verify", "text.fmu", cwd=tmp_path)
    assert run.returncode == 2 and "is no FMU and no SSP package: it is not a zip archive" in run.stderr
    assert chainunit("verify", "none.fmu", cwd=tmp_path).returncode == 2


@pytest.mark.parametrize(
    ("version", "words"),
    [
        ("0.0.9", "certified by chainunit 0.0.9, older than"),
        ("99.1", "certified by chainunit 99.1, newer than"),
    ],
)
def test_an_older_and_a_newer_version_have_their_sentences(tmp_path, members, own, version, words):
    found = checked(tmp_path, signed(members, own, version=version), run=False)
    assert found["version"].holds is False and found["version"].words.startswith(words)
    assert found["signature"].holds and found["members"].holds and found["equations"].holds


def test_another_form_of_the_manifest_is_said(members, own):
    text = members[manifest.MANIFEST].replace(manifest.FORM.encode(), b"chainunit vouching 9")
    assert text != members[manifest.MANIFEST] and manifest.parsed(text) is None
    for wrong in (
        b"[]",
        b"{",
        b'{"form": 1}',
        b"\xff",
        text.replace(b'"members"', b'"more"'),
        b"[" * 100_000,
    ):
        assert manifest.parsed(wrong) is None


def test_a_changed_start_value_that_is_signed_again_is_found(tmp_path, members, other):
    """Whoever has a key of his own can sign anything; the evidence inside then does not fit."""
    start = f'start="{ChamberForces.Parameters().r!r}"'
    text = members["modelDescription.xml"].decode()
    place = text.index('name="r"')
    at = text.index(start, place)
    longer = text[:at] + 'start="0.2"' + text[at + len(start) :]
    found = checked(tmp_path, signed({**members, "modelDescription.xml": longer.encode()}, other))
    assert found["signature"].holds and found["members"].holds
    assert found["domain"].holds is False and "differs from the certified one" in found["domain"].words


def test_another_library_that_is_signed_again_is_found(tmp_path, members, other):
    """The library of a machine with another crank, under the identifier of this one."""
    libraries = [name for name in members if name.startswith("binaries/")]
    if "sources/model.c" not in members:
        pytest.skip("no C compiler")
    export(ChamberForces, tmp_path / "longer.fmu", {"left.material_mass": 45.0, "r": 0.2})
    theirs = archive.contents((tmp_path / "longer.fmu").read_bytes()).members
    guid, new = (re.search(rb'guid="([^"]+)"', x["modelDescription.xml"])[1] for x in (members, theirs))
    swapped = {name: theirs[name].replace(new, guid) for name in libraries}
    assert all(guid in content for content in swapped.values())
    found = checked(tmp_path, signed({**members, **swapped}, other))
    assert found["equations"].holds
    assert found["reference experiment"].holds is False
    assert "the FMU here: largest deviation" in found["reference experiment"].words
    assert found["smooth experiment"].holds is False


def test_wrong_results_inside_are_found(tmp_path, members, other):
    name = next(n for n in members if n.endswith("_co_simulation.csv"))
    wrong = members[name].decode().splitlines()
    cells = wrong[5].split(",")
    cells[1] = repr(float(cells[1]) + 0.01)
    wrong[5] = ",".join(cells)
    found = checked(tmp_path, signed({**members, name: "\n".join(wrong).encode()}, other))
    assert found["equations"].holds is False
    assert found["experiments"].holds is None and "reference experiment" not in found


def without(members, *folders):
    return {name: content for name, content in members.items() if not name.startswith(folders)}


@pytest.mark.parametrize("fmi", [2, 3])
def test_without_a_library_for_this_machine_it_is_built_from_the_sources(tmp_path, own, fmi):
    """The same sources give the same numbers."""
    if not compiles(fmi):
        pytest.skip("no C compiler")
    native(Accelerator, tmp_path / "plain.fmu", fmi=fmi)
    plain = certify.members_of(tmp_path / "plain.fmu")
    whole = certify.certified(plain, "it.fmu", own, None, silent).data
    bare = without(archive.contents(whole).members, "binaries/")
    before = checked(tmp_path, whole)
    found = checked(tmp_path, signed(bare, own))
    words = (
        "the FMU has no library that this machine can load; it has none (Cannot find shared library binaries"
    )
    assert found["library"].holds is None and found["library"].words.startswith(words)
    assert re.search(r"one that \S+ made here from the sources in the FMU$", found.pop("library").words)
    assert found.keys() == before.keys() and all(each.holds for each in found.values())
    for topic in ("reference experiment", "smooth experiment", "step", "energy", "points"):
        assert found[topic].words == before[topic].words


def test_other_sources_that_are_signed_again_are_found(tmp_path, members, other):
    """Those of a machine with another crank, whose results are not the ones inside."""
    if "sources/model.c" not in members:
        pytest.skip("no C compiler")
    export(ChamberForces, tmp_path / "longer.fmu", {"left.material_mass": 45.0, "r": 0.2})
    theirs = archive.contents((tmp_path / "longer.fmu").read_bytes()).members
    guid, new = (re.search(rb'guid="([^"]+)"', x["modelDescription.xml"])[1] for x in (members, theirs))
    model = theirs["sources/model.c"].replace(new, guid)
    assert guid in model
    found = checked(tmp_path, signed({**without(members, "binaries/"), "sources/model.c": model}, other))
    assert found["library"].holds is None and found["equations"].holds
    assert found["reference experiment"].holds is False and found["smooth experiment"].holds is False


@pytest.mark.second
def test_without_library_and_sources_or_compiler_the_equations_are_compared(
    tmp_path, members, other, monkeypatch
):
    if "sources/model.c" not in members:
        pytest.skip("no C compiler")
    bare = without(members, "binaries/")
    broken = {**bare, "sources/model.c": b"int"}

    def said(contents):
        found = checked(tmp_path, signed(contents, other))
        assert found["experiments"].holds is None and "reference experiment" not in found
        assert found["equations"].holds and all(each.holds is not False for each in found.values())
        return found["experiments"].words

    words = "are not run: the FMU has no library that this machine can load; it has none (Cannot find"
    assert said(without(bare, "sources/")).startswith(words)
    assert said(without(bare, "sources/")).endswith(", and no sources of one")
    assert "its sources cannot be compiled here: the C compiler " in said(broken)
    assert "cannot be compiled here" in said(without(bare, "sources/runtime.c"))
    with monkeypatch.context() as patch:
        patch.setattr(libraries, "compiler", lambda: None)
        assert "a C compiler makes one from the sources in the FMU: install cc" in said(bare)


def test_the_end_says_that_experiments_were_not_run(made):
    run = chainunit("verify", "it.fmu", "--no-run", "--key", "chainunit.key.pub", cwd=made)
    assert run.returncode == 3 and "note   experiments  are not run, as --no-run asks" in run.stdout
    assert run.stdout.splitlines()[-1] == "it.fmu: holds, but experiments were not run"


@pytest.mark.second
def test_a_python_fmu_runs_without_its_library(fmus, own, tmp_path):
    """By its own Python code, and not by that of another FMU of the same name in the same process."""
    made = certify.certified(certify.members_of(fmus["DcMotor"]), "DcMotor.fmu", own, None, silent)
    bare = without(archive.contents(made.data).members, "binaries/")
    (equations,) = (name for name in bare if name.endswith("/model.py"))
    (script,) = (name for name in bare if re.fullmatch(r"resources/DcMotor_\w+\.py", name))
    modules = set(sys.modules)

    def found_in(**changed):
        contents = {**bare, **{name: text.encode() for name, text in changed.items()}}
        return checked(tmp_path, signed(contents, own))

    found = found_in()
    assert found["library"].holds is None
    assert found.pop("library").words.endswith(
        "the Python code in the FMU, in this Python and without its library"
    )
    assert {"reference experiment", "smooth experiment", "points"} <= found.keys()
    assert all(each.holds for each in found.values()), found
    text = bare[equations].decode()
    wanted = f"u[{MODELS['DcMotor'].input_layout.names.index('w_ref')}]"
    assert text.count(wanted) > 0
    slower = found_in(**{equations: text.replace(wanted, f"(0.9 * {wanted})")})
    assert slower["reference experiment"].holds is False and slower["equations"].holds
    assert all(each.holds for each in found_in().values() if each.topic != "library")
    refuses = found_in(
        **{script: bare[script].decode() + "    def do_step(self, *at):\n        return False\n"}
    )
    assert refuses["experiments"].holds is False
    assert refuses["experiments"].words == "DcMotor stops at t = 0 s: the step is discarded"
    fails = found_in(**{script: "import nothing_here"})
    assert (
        fails["experiments"].holds is None
        and "; its Python code does not run here: No module named" in fails["experiments"].words
    )
    assert {
        name for name in set(sys.modules) - modules if "DcMotor" in name or name.startswith("chainunit_")
    } == set()
    assert str(tmp_path) not in sys.path


def test_evidence_of_another_form_is_a_sentence(tmp_path, members, other):
    for content in (b"[]", b"{}", b"not json"):
        found = checked(tmp_path, signed({**members, documents.EVIDENCE: content}, other))
        assert found["evidence"].holds is False


def test_meta_data_beside_that_are_of_another_file(made, tmp_path, data):
    (tmp_path / "it.fmu").write_bytes(data)
    text = (made / "it.srmd").read_text()
    (tmp_path / "it.srmd").write_text(text.replace('checksum="', 'checksum="0')[:10_000])
    found = {each.topic: each for each in verify(tmp_path / "it.fmu", None, run=False, told=silent)}
    assert found["SRMD"].holds is False and "no checksum of 256 bits" in found["SRMD"].words
    digit = re.search('checksum="(.)', text)[1]
    other = "1" if digit == "0" else "0"
    (tmp_path / "it.srmd").write_text(text.replace(f'checksum="{digit}', f'checksum="{other}'))
    found = {each.topic: each for each in verify(tmp_path / "it.fmu", None, run=False, told=silent)}
    assert found["SRMD"].holds is False and "is of another file" in found["SRMD"].words


def test_a_check_of_a_machine_imports_few_other_models(made):
    """The import of all models takes longer than all else of a check."""
    code = (
        "import sys\nfrom chainunit.app.cli import app\n"
        "app(['verify', 'it.fmu', '--key', 'chainunit.key.pub', '--no-run'], standalone_mode=False)\n"
        "print('imported', *sys.modules)"
    )
    run = subprocess.run([sys.executable, "-c", code], cwd=made, capture_output=True, text=True)
    loaded = run.stdout.split("imported")[-1].split()
    assert "chainunit.machines.chain_unit" in loaded
    others = (
        "machines.linkages.file",
        "machines.load_observer",
        "machines.knife_drive",
        "drives.dc_motor",
        "study.parts",
    )
    assert not {f"chainunit.{name}" for name in others} & {*loaded}


def test_meta_data_with_entities_or_that_are_no_xml_are_refused(made, tmp_path, data):
    """By the reader of all other XML, even if the checksum in them is right."""
    (tmp_path / "it.fmu").write_bytes(data)
    text = (made / "it.srmd").read_text()
    head, _, rest = text.partition("?>")
    entities = f'{head}?><!DOCTYPE x [<!ENTITY a "b">]>{rest}'
    for content, words in ((entities, "has a document type"), (text[:-9], "is no XML that can be read")):
        (tmp_path / "it.srmd").write_text(content)
        found = {each.topic: each for each in verify(tmp_path / "it.fmu", None, run=False, told=silent)}
        assert found["SRMD"].holds is False and f"it.srmd beside the file: {words}" in found["SRMD"].words
    for content in (entities.encode(), text.encode() + b" " * inputs.XML):
        with pytest.raises(InputError, match=r"the manifest: .*(document type|more than 8 MiB)"):
            documents.resource_of(content, "the manifest")
        with pytest.raises(InputError, match=r"fmi-ls-manifest.xml: .*(document type|more than 8 MiB)"):
            documents.related(content, ())


def test_meta_data_of_another_file_are_no_fault_and_are_not_lost(made, tmp_path, data):
    """Of a study come an FMU and an SSP package of one name, whose meta-data would have one place."""
    for name, content in (("it.fmu", data), ("it.srmd", (made / "it.srmd").read_bytes())):
        (tmp_path / name).write_bytes(content)
    text = (tmp_path / "it.srmd").read_text().replace('data="it.fmu"', 'data="it.ssp"')
    (tmp_path / "it.srmd").write_text(re.sub('checksum="[0-9a-f]{64}"', f'checksum="{"0" * 64}"', text))
    found = {each.topic: each for each in verify(tmp_path / "it.fmu", None, run=False, told=silent)}
    assert found["SRMD"][:3] == (None, "SRMD", "it.srmd beside the file: is that of it.ssp")
    for content, words in (
        ((tmp_path / "it.srmd").read_bytes(), "it.srmd: the meta-data there are those of it.ssp"),
        (b"mine", "it.srmd: the meta-data there are not those of a certified file"),
    ):
        (tmp_path / "it.srmd").write_bytes(content)
        run = chainunit("certify", "it.fmu", "--key", made / "chainunit.key", cwd=tmp_path)
        assert run.returncode == 2 and words in " ".join(run.stderr.split()) and "-o" in run.stderr
        assert (tmp_path / "it.srmd").read_bytes() == content and (tmp_path / "it.fmu").read_bytes() == data


def test_limits_of_another_c_library_are_the_same():
    one = {"limits": [{"value": 0.7, "name": "a"}, {"value": None}]}
    near, far = ({"limits": [{"value": 0.7 * (1.0 + x), "name": "a"}, {"value": None}]} for x in (3e-9, 1e-6))
    assert _difference(one, near, "") == "" and _difference(one, far, "") == "limits[0].value"


def test_names_that_lead_out_of_a_folder_are_not_unpacked(made, members, own, tmp_path):
    data = signed({**members, "../evil.txt": b"1"}, own)
    found = checked(tmp_path, data)
    assert found["evidence"].holds is False and "leads out of its folder" in found["evidence"].words
    assert not (tmp_path / "evil.txt").exists() and not (tmp_path.parent / "evil.txt").exists()
    for name in ("/a", "a/../b", "c:\\x", "a//b", "."):
        assert archive.unsafe([name]) == [name]
    assert archive.unsafe(["a/b.txt", "a/"]) == []


# -- files that would fool whoever verifies them: signed by a key that is named, and nothing in them holds


def evidence(**changes):
    """A change of evidence.json: values by topic and key; None takes a topic out."""

    def change(members):
        found = json.loads(members[documents.EVIDENCE])
        for place, value in changes.items():
            topic, _, key = place.partition("__")
            if value is None:
                del found[topic]
            elif key:
                found[topic][key] = value
            else:
                found[topic] = value
        # as json_bytes, which writes no Infinity
        return {**members, documents.EVIDENCE: json.dumps(found, indent=1, sort_keys=True).encode() + b"\n"}

    return change


def points(change):
    """A change of the list of points."""

    def changed(members):
        found = json.loads(members[documents.EVIDENCE])["points"]["at"]
        return evidence(points__at=change(found))(members)

    return changed


def halved(point):
    return {**point, "outputs": {name: 0.5 * value for name, value in point["outputs"].items()}}


def tables(change, *endings):
    """A change of tables in CSV, by their rows without the head."""

    def changed(members):
        chosen = {
            name: text.decode().splitlines() for name, text in members.items() if name.endswith(endings)
        }
        assert len(chosen) == len(endings)
        new = {name: "\n".join([lines[0], *change(lines[1:])]) for name, lines in chosen.items()}
        return {**members, **{name: f"{text}\n".encode() for name, text in new.items()}}

    return changed


def still(rows):
    first = rows[0].partition(",")[2]
    return [f"{row.partition(',')[0]},{first}" for row in rows]


def half(rows):
    cells = [row.split(",") for row in rows]
    return [",".join([time, *(repr(0.5 * float(x)) for x in rest)]) for time, *rest in cells]


def text(old, new, name="modelDescription.xml"):
    def changed(members):
        assert old in members[name]
        return {**members, name: members[name].replace(old, new)}

    return changed


def lost(*names):
    return lambda members: without(members, *names)


REFERENCE_FILES = ("Forces_in.csv", "_co_simulation.csv", "_set_then_read.csv")
FORGERIES = {
    "a tolerance of 1e9": (evidence(tolerance=1e9), "tolerance = 1000000000.0: must be a number from 0 to 1e-09"),
    "a looser tolerance": (evidence(tolerance=1e-8), "tolerance = 1e-08: must be a number from 0 to 1e-09"),
    "a tolerance without end": (evidence(tolerance=float("inf")), "Infinity is no number"),
    "a tolerance that is none": (evidence(tolerance=float("nan")), "NaN is no number"),
    "a tolerance as text": (evidence(tolerance="1e9"), 'tolerance = "1e9": must be a number'),
    "a tolerance that is true": (evidence(tolerance=True), "tolerance = true: must be a number"),
    "no tolerance": (evidence(tolerance=None), "is not of the form that this version writes"),
    "an error of 1e9": (evidence(convergence__error=1e9), "convergence.error = 1000000000.0: must be a number"),
    "an error as text": (evidence(convergence__error="0"), 'convergence.error = "0": must be a number'),
    "missing energy": (evidence(energy__missing=1e9), "energy.missing = 1000000000.0: must be a number"),
    "missing energy in a large flow": (
        evidence(energy__missing=1e9, energy__flow=1e12), "says something else",
    ),
    "a gap of the powers": (evidence(points__power_gap=1.0), "points.power_gap = 1.0: must be a number"),
    "no evidence": (lost(documents.EVIDENCE), "evidence.json: is missing"),
    "evidence without end": (
        lambda members: {**members, documents.EVIDENCE: b"[" * 100_000}, "evidence.json: is no JSON (it is nested",
    ),
    "no smooth experiment": (evidence(convergence=None), "convergence: is missing"),
    "no points": (evidence(points=None), "points: is missing"),
    "evidence that is left out": (
        evidence(left_out="none", points=None, convergence=None, energy=None), "points: is missing",
    ),
    "an empty list of points": (points(lambda at: []), "says something else"),
    "points of numbers as text": (
        points(lambda at: [{**at[0], "outputs": {"tau": "1"}}, *at[1:]]), "points: have values that are no numbers",
    ),
    "points of half the size": (points(lambda at: [halved(each) for each in at]), "the equations in Python here"),
    "one point eleven times more": (points(lambda at: at[:1] * len(at)), "differs from the certified one"),
    "evidence of another model": (evidence(model="Accelerator"), 'model = "Accelerator": must be that of the FMU'),
    "a reference experiment of one row": (tables(lambda rows: rows[:1], *REFERENCE_FILES), "must have 26 rows"),
    "a reference experiment at rest": (tables(still, *REFERENCE_FILES), "differs from the certified one"),
    "half of the reference results": (tables(half, *REFERENCE_FILES[1:]), "the equations in Python here, at 12"),
    "reference results without numbers": (
        tables(lambda rows: [re.sub(",[^,]*", ",nan", row) for row in rows], "_set_then_read.csv"),
        "largest deviation inf",
    ),
    "no reference experiment": (lost(REFERENCE + "/ChamberForces"), "reference: is missing, or the files"),
    "a smooth experiment at rest": (tables(still, "smooth_in.csv"), "differs from the certified one"),
    "a smooth experiment of one row": (tables(lambda rows: rows[:1], "smooth_in.csv"), "the columns or rows"),
    "no smooth inputs": (lost(certify.SMOOTH_IN), "differs from the certified one"),
    "half of the smooth results": (tables(half, "smooth_out.csv"), "the FMU here: largest deviation 1 of"),
    "large nominal sizes": (text(b' nominal="', b' nominal="9'), "is not that of the FMU"),
    "another unit": (text(b'unit="N.m"', b'unit="N"'), "is not that of the FMU"),
    "fewer variables": (text(b'name="frame.moment"', b'name="frame.other"'), "frame.moment: is no variable"),
    "another library for Model Exchange": (
        text(b'<ModelExchange modelIdentifier="ChamberForces"', b'<ModelExchange modelIdentifier="Evil"'),
        "of Model Exchange: must be that of Co-Simulation",
    ),
    "a report of its own": (text(b"first goes slack", b"never goes slack", documents.REPORT), "says something else"),
    "meta-data of its own": (text(b"chainunit.limits", b"chainunit.limit", documents.SRMD), "says something else"),
    "a library that cannot be loaded": (
        lambda members: {
            name: b"junk" if name.startswith("binaries/") else content for name, content in members.items()
        },
        "no library that this machine can load",
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.compiler if "Model Exchange" in name else ())
        for name in FORGERIES
    ],
)
def test_no_evidence_of_its_own_makes_a_file_hold(tmp_path, members, other, name):
    change, words = FORGERIES[name]
    found = checked(tmp_path, signed(change(members), other))
    assert found["signature"].holds and found["members"].holds
    assert conclusion(list(found.values()))[0] == FAILS
    assert words in " ".join(each.words for each in found.values() if each.holds is False), found


@pytest.mark.parametrize(
    ("factor", "words"),
    [(0.5, "largest deviation"), (3.0, "largest deviation"), (np.nan, "largest deviation inf")],
)
def test_other_outputs_do_not_hold(tmp_path, data, monkeypatch, factor, words):
    """Of a library that gives a half, three times, or no numbers."""
    right = rerun.Slave.get
    monkeypatch.setattr(rerun.Slave, "get", lambda *args: [factor * x for x in right(*args)])
    found = checked(tmp_path, data)
    for topic in ("reference experiment", "smooth experiment", "points"):
        assert found[topic].holds is False and words in found[topic].words
    assert found["equations"].holds and conclusion(list(found.values()))[0] == FAILS


def test_a_file_is_of_the_kind_that_its_members_have(tmp_path, members, other):
    """An SSP package without FMUs needs no evidence; an FMU does not become one."""
    found = checked(tmp_path, signed(members, other, kind="ssp"))
    assert found["manifest"].words == 'kind = "ssp": the members are not those of such a file'
    empty = {"SystemStructure.ssd": b"<a/>", documents.EVIDENCE: evidence_of_a_system({})}
    found = checked(tmp_path, signed(empty, other, kind="ssp"))
    assert conclusion(list(found.values())) == (OPEN, "holds, but nothing in it was judged")
    inside = {**empty, "resources/a.fmu": packed(members)}
    for fmus in ({}, {"resources/a.fmu": "hash"}, {"resources/b.fmu": "certified"}):
        forged = {**inside, documents.EVIDENCE: evidence_of_a_system(fmus)}
        found = checked(tmp_path, signed(forged, other, kind="ssp"))
        assert "does not tell of the FMUs that are in the package" in found["evidence"].words


def evidence_of_a_system(fmus):
    return manifest.json_bytes({"sources": certify.sources_hash(), "fmus": fmus})


def test_an_fmu_by_pythonfmu_without_its_script_is_not_run(fmus):
    """The library of pythonfmu would end the process."""
    members = archive.contents(fmus["ChamberForces"].read_bytes()).members
    lacking = {
        name: content
        for name, content in members.items()
        if not re.fullmatch("resources/ChamberForces_.*py", name)
    }
    assert len(lacking) == len(members) - 1
    with (
        rerun.unpacked(lacking, "it.fmu") as fmu,
        pytest.raises(rerun.NoLibraryError, match=r"^resources/ChamberForces_\w+[.]py is missing$"),
    ):
        rerun.opened(fmu)


def test_a_model_under_another_name_is_not_judged_by_itself(tmp_path, members, other):
    """Its results are then those in the file alone."""
    renamed = {re.sub("^(extra/.*/)ChamberForces_", r"\1Mine_", name): x for name, x in members.items()}
    renamed = text(b'modelName="ChamberForces"', b'modelName="Mine"')(evidence(model="Mine")(renamed))
    renamed = text(b"# ChamberForces", b"# Mine", documents.REPORT)(renamed)
    renamed = text(b'name="ChamberForces"', b'name="Mine"', documents.SRMD)(renamed)
    status, words = conclusion(list(checked(tmp_path, signed(renamed, other)).values()))
    assert (status, words) == (OPEN, "holds, but was not compared with its equations: name its file by --of")


def test_a_manifest_that_leaves_out_members_is_found(members, other, monkeypatch):
    """The bytes that it does not name would be signed by nobody."""
    right = manifest.Manifest.data

    def forged(change):
        with monkeypatch.context() as patch:
            patch.setattr(manifest.Manifest, "data", lambda self: change(right(self)))
            return signed(members, other)

    def fewer(data):
        del data["members"]["modelDescription.xml"]
        return data

    def more(data):
        nothing = {"size": 0, "content": manifest.sha3(b""), "entry": manifest.sha3(b""), "length": 0}
        data["members"]["nothing"] = {**nothing, "at": 2**40}
        return data

    def other_name(data):
        data["members"]["modelDescription.txt"] = data["members"].pop("modelDescription.xml")
        return data

    assert failing(forged(lambda data: data)) == []
    for change in (fewer, more, other_name):
        assert failing(forged(change)), change
    twice = forged(lambda data: data)
    text = integrity(twice).manifest.data()
    doubled = manifest.json_bytes(text).replace(b'"kind": "fmu",', b'"kind": "fmu",\n "kind": "ssp",')
    assert manifest.parsed(manifest.json_bytes(text)) and manifest.parsed(doubled) is None


def test_without_a_key_no_code_of_the_file_runs(made, tmp_path, members, other, monkeypatch):
    """Anybody can make a key: neither library nor sources nor Python code is loaded, whatever is in the file."""
    run = chainunit("verify", "it.fmu", cwd=made)
    mine = keys.fingerprint(keys.public_key(made / "chainunit.key.pub"))
    assert (run.returncode, run.stderr) == (3, "")
    assert run.stdout.splitlines()[-1] == f"it.fmu: intact, signed by {mine}, whom you have not named"
    assert (
        run.stdout.startswith("note   signature ") and "experiments  are not run, as the signer" in run.stdout
    )

    def ran(*args):
        raise AssertionError

    monkeypatch.setattr(rerun, "opened", ran)
    monkeypatch.setattr(libraries, "opened", ran)
    for content in (members, without(members, "binaries/")):
        (tmp_path / "it.fmu").write_bytes(signed(content, other))
        found = verify(tmp_path / "it.fmu", None, told=silent)
        assert conclusion(found)[0] == OPEN and {each.topic: each for each in found}["equations"].holds
    assert conclusion(verify(tmp_path / "it.fmu", None, run=False, told=silent))[0] == OPEN


def test_experiments_that_cannot_be_computed_again_are_said_at_the_end(
    tmp_path, data, members, own, monkeypatch
):
    """Without casadi those of a motor; the equations are compared at its points all the same."""

    def missing(*args):
        raise ModuleNotFoundError(name="casadi")

    monkeypatch.setattr(experiments, "by_equations", missing)
    found = list(checked(tmp_path, data).values())
    words = "holds, but its experiments were not computed again without the package casadi"
    assert conclusion(found) == (OPEN, words)
    wrong = points(lambda at: [halved(each) for each in at])(members)
    found = checked(tmp_path, signed(wrong, own))
    assert found["equations"].holds is False and "largest deviation 0.5" in found["equations"].words


def test_members_that_no_folder_can_have_are_named(tmp_path, members, own):
    for name in ("modelDescription.xml/more", "x" * 300):
        found = checked(tmp_path, signed({**members, name: b"1"}, own))
        assert "cannot be unpacked" in found["evidence"].words and found["evidence"].holds is False


def test_sources_in_place_of_the_library_are_said_at_the_end(tmp_path, members, own):
    if "sources/model.c" not in members:
        pytest.skip("no C compiler")
    found = checked(tmp_path, signed(without(members, "binaries/"), own))
    assert found["reference experiment"].holds
    assert conclusion(list(found.values())) == (OPEN, "holds, but its own library was not run")


# -- keys


def test_a_key_is_for_its_owner_alone_and_never_written_over(made, tmp_path):
    assert (made / "chainunit.key").stat().st_mode & 0o777 == 0o600
    before = (made / "chainunit.key").read_bytes()
    run = chainunit("key", cwd=made)
    assert run.returncode == 2 and "is there already; a key is never written over" in run.stderr
    assert (made / "chainunit.key").read_bytes() == before
    (tmp_path / "mine.pub").write_text("")
    run = chainunit("key", "-o", "mine", cwd=tmp_path)
    assert run.returncode == 2 and not (tmp_path / "mine").exists()


@pytest.mark.parametrize("place", [0, 1], ids=["the private key", "the public key"])
def test_a_key_on_a_full_disk_leaves_nothing(tmp_path, monkeypatch, place):
    """An empty file would be taken for a key that is there already."""
    opened, right = [], keys.os.fdopen

    class Full:
        def __init__(self, handle):
            self.stream = right(handle, "wb")

        def __enter__(self):
            return self

        def __exit__(self, *at):
            self.stream.close()

        def write(self, content):
            raise OSError(errno.ENOSPC, "No space left on device")

    def fdopen(handle, mode):
        opened.append(handle)
        return Full(handle) if len(opened) > place else right(handle, mode)

    monkeypatch.setattr(keys.os, "fdopen", fdopen)
    with pytest.raises(WriteError, match=r"mine\S*: cannot be written \(No space left on device\)"):
        keys.make_key(tmp_path / "mine")
    assert list(tmp_path.iterdir()) == []
    monkeypatch.undo()
    assert keys.make_key(tmp_path / "mine")[0] == tmp_path / "mine.pub"


def test_a_certified_file_and_its_meta_data_are_written_together(tmp_path, monkeypatch):
    """Meta-data of the file before would make the new file fail."""
    for name in ("it.fmu", "it.srmd"):
        (tmp_path / name).write_bytes(before := b'<a data="it.fmu"/>')
    made = certify.Certified(b"new", [], {})

    def full(*args):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(documents, "srmd", full)
    with pytest.raises(WriteError, match="No space left"):
        certify.write(made, tmp_path / "it.fmu")
    names = ("it.fmu", "it.srmd")
    assert {each.name: each.read_bytes() for each in tmp_path.iterdir()} == dict.fromkeys(names, before)


def test_files_that_are_no_keys_are_refused(made, tmp_path):
    from cryptography.hazmat.primitives import serialization as forms
    from cryptography.hazmat.primitives.asymmetric import ec

    foreign = ec.generate_private_key(ec.SECP256R1())
    text = foreign.private_bytes(forms.Encoding.PEM, forms.PrivateFormat.PKCS8, forms.NoEncryption())
    (tmp_path / "ec.key").write_bytes(text)
    (tmp_path / "text").write_text("-----BEGIN nothing")
    with pytest.raises(InputError, match=r"is a key of another kind; must be Ed25519"):
        keys.private_key(tmp_path / "ec.key")
    with pytest.raises(InputError, match=r"it has a public key: name the file without \.pub"):
        keys.private_key(made / "chainunit.key.pub")
    for read in (keys.private_key, keys.public_key):
        with pytest.raises(InputError, match=r"has no (private|public) key in PEM"):
            read(tmp_path / "text")
        with pytest.raises(
            InputError, match=r"none: cannot be read \(No such file or directory\); chainunit vouch key makes"
        ):
            read(tmp_path / "none")
    assert keys.public_key(made / "chainunit.key") == keys.public_key(made / "chainunit.key.pub")
    (tmp_path / "open.key").write_bytes((made / "chainunit.key").read_bytes())
    (tmp_path / "open.key").chmod(0o644)
    run = chainunit("certify", made / "plain.fmu", "-o", "a.fmu", "--key", "open.key", cwd=tmp_path)
    assert run.returncode == 0 and "other users of this machine can read this key" in run.stderr


# -- what is certified


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"modelDescription.xml": b"<a/>"}, "is no FMU"),
        ({"readme.txt": b"1"}, "is neither an FMU"),
    ],
)
def test_other_files_are_not_certified(made, tmp_path, content, words):
    (tmp_path / "x.fmu").write_bytes(packed(content))
    run = chainunit("certify", "x.fmu", "--key", made / "chainunit.key", cwd=tmp_path)
    assert run.returncode == 2 and words in run.stderr


def test_a_file_whose_name_does_not_fit_is_refused(made, tmp_path):
    """An error names -o only where it was given."""
    plain, key = made / "plain.fmu", made / "chainunit.key"
    (tmp_path / "plain.zip").write_bytes(plain.read_bytes())
    (tmp_path / "a.ssp").write_bytes(packed({"SystemStructure.ssd": b"<a/>"}))
    for arguments, words in (
        ((tmp_path,), "is a folder; must be an FMU, an SSP package, a study file or a linkage file"),
        (
            ("plain.zip",),
            "chainunit: plain.zip: must be a file name that ends in .fmu, as an FMU has it; name one",
        ),
        (
            (plain, "-o", "a.ssp"),
            "chainunit: -o a.ssp: must be a file name that ends in .fmu, as an FMU has it",
        ),
        (("a.ssp", "-o", "b.fmu"), "chainunit: -o b.fmu: must be a file name that ends in .ssp"),
    ):
        run = chainunit("certify", *arguments, "--key", key, cwd=tmp_path)
        assert run.returncode == 2 and words in " ".join(run.stderr.split()), run.stderr
    assert not (tmp_path / "b.fmu").exists()


def test_fmus_of_others_and_of_other_versions_are_not_certified(made, own):
    plain = certify.members_of(made / "plain.fmu")
    text = plain["modelDescription.xml"]
    for tool, words in (
        (b"Other 1.0", "must be an FMU of chainunit"),
        (b"chainunit 0.0.9", "export it anew first"),
    ):
        changed = text.replace(f"chainunit {__version__}".encode(), tool)
        with pytest.raises(InputError, match=words):
            certify.certified({**plain, "modelDescription.xml": changed}, "x.fmu", own, None, silent)


def test_an_fmu_that_does_not_give_its_results_is_not_certified(made, own):
    plain = certify.members_of(made / "plain.fmu")
    name = next(n for n in plain if n.endswith("_set_then_read.csv"))
    lines = plain[name].decode().splitlines()
    lines[3] = ",".join(["0.08", *("7.0" for _ in lines[3].split(",")[1:])])
    with pytest.raises(
        certify.RunError, match=r"does not give its reference results: .* it is not certified"
    ):
        certify.certified({**plain, name: "\n".join(lines).encode()}, "x.fmu", own, None, silent)


STUDY = """
[run]
crank_speed = 2.4
"""


@pytest.mark.second
def test_a_study_becomes_a_certified_system(made, tmp_path):
    """Its model has no name in the package: with the file it is compared, too."""
    (tmp_path / "mine.toml").write_text(STUDY)
    run = chainunit("certify", "mine.toml", "--key", made / "chainunit.key", cwd=tmp_path)
    assert run.returncode == 0 and "ChamberForcesSystem.fmu: certified" in run.stdout, run.stderr
    assert "went to and fro" in run.stdout and "first goes slack" in run.stdout
    key = "--key", made / "chainunit.key.pub"
    run = chainunit("verify", "ChamberForcesSystem.fmu", *key, cwd=tmp_path)
    assert run.returncode == 3
    words = "holds, but was not compared with its equations: name its file by --of"
    assert run.stdout.splitlines()[-1] == f"ChamberForcesSystem.fmu: {words}"
    run = chainunit("verify", "ChamberForcesSystem.fmu", "--of", "mine.toml", *key, cwd=tmp_path)
    assert run.returncode == 0 and "note" not in run.stdout and "the equations in Python here" in run.stdout


@pytest.mark.second
def test_an_ssp_package_with_its_fmus(made, tmp_path):
    """Its own FMUs are certified themselves, by the same key; a foreign one by its hash."""
    (tmp_path / "mine.toml").write_text(STUDY)
    assert chainunit("export", "mine.toml", "-o", "a.ssp", cwd=tmp_path).returncode == 0
    read = archive.contents((tmp_path / "a.ssp").read_bytes()).members
    foreign = {"modelDescription.xml": b'<fmiModelDescription generationTool="other"/>'}
    theirs = packed(foreign)
    (tmp_path / "a.ssp").write_bytes(packed({**read, "resources/foreign.fmu": theirs}))
    assert chainunit("certify", "a.ssp", "--key", made / "chainunit.key", cwd=tmp_path).returncode == 0
    first = (tmp_path / "a.ssp").read_bytes()
    assert chainunit("certify", "a.ssp", "--key", made / "chainunit.key", cwd=tmp_path).returncode == 0
    assert (tmp_path / "a.ssp").read_bytes() == first
    run = chainunit("verify", "a.ssp", "--key", made / "chainunit.key.pub", cwd=tmp_path)
    assert run.returncode == 3
    assert run.stdout.splitlines()[-1] == "a.ssp: holds, but resources/foreign.fmu was not judged"
    assert re.search(r"holds  resources/DcMotor\.fmu, reference experiment", run.stdout)
    assert re.search(r"holds  signature +holds, by the expected key", run.stdout)
    assert re.search(
        r"holds  resources/DcMotor\.fmu, signature +holds, by the key of the package", run.stdout
    )
    assert re.search(r"note   resources/foreign\.fmu +is no FMU of this package", run.stdout)
    after = archive.contents(first).members
    assert all(after[n] == x for n, x in read.items() if not n.endswith(".fmu"))
    assert documents.SRMD in after and after["resources/foreign.fmu"] == theirs
    changed = bytearray(first)
    changed[integrity(first).manifest.members["resources/DcMotor.fmu"].at + 5000] ^= 1
    (words,) = failing(bytes(changed))
    assert words.startswith("resources/DcMotor.fmu: ")


@pytest.mark.second
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("name", list(MODELS))
def test_every_model_is_certified_and_holds(native_fmus, own, tmp_path, name, fmi):
    file = native_fmus[name, fmi][0]
    made = certify.certified(certify.members_of(file), file.name, own, None, silent)
    (tmp_path / file.name).write_bytes(made.data)
    public = own.public_key().public_bytes_raw()
    found = {each.topic: each for each in verify(tmp_path / file.name, public, told=silent)}
    assert all(each.holds for each in found.values()), found
    assert {"reference experiment", "smooth experiment", "step", "points", "equations", "domain"} <= set(
        found
    )
    assert list(validate_fmu(str(tmp_path / file.name))) == []


@pytest.mark.second
def test_an_fmu_with_flat_names_is_certified_as_any_other(own, tmp_path):
    """Its names in tables are those of the FMU; points and limits are there, and a changed start value is found."""
    export(ChamberForces, tmp_path / "plain.fmu", {"left.material_mass": 45.0}, names="flat")
    whole = certify.certified(certify.members_of(tmp_path / "plain.fmu"), "it.fmu", own, None, silent).data
    members = archive.contents(whole).members
    head = members[certify.SMOOTH_IN].splitlines()[0]
    assert b"left_material_mass" in head and b"left." not in head
    found = checked(tmp_path, whole)
    if "sources/model.c" in members:
        assert conclusion(list(found.values())) == (HOLDS, "holds")
    assert found["equations"].holds and "at 12 states" in found["equations"].words
    assert "41 variables and 4 limits" in found["domain"].words
    heavier = text(b'start="45.0"', b'start="46.0"')(members)
    assert conclusion(list(checked(tmp_path, signed(heavier, own)).values()))[0] == FAILS


@pytest.mark.second
def test_a_python_fmu_is_certified_and_holds(fmus, own, tmp_path):
    made = certify.certified(certify.members_of(fmus["DcMotor"]), "DcMotor.fmu", own, None, silent)
    (tmp_path / "DcMotor.fmu").write_bytes(made.data)
    found = verify(tmp_path / "DcMotor.fmu", own.public_key().public_bytes_raw(), told=silent)
    assert all(each.holds for each in found)
    assert "pythonfmu" in made.data.decode("latin-1")
    bill = json.loads(archive.contents(made.data).members[documents.SBOM])
    assert "pythonfmu" in {each["name"] for each in bill["metadata"]["tools"]["components"]}


# -- the experiments by themselves


def test_energy_of_a_pendulum_that_loses_power():
    """E = 2 + sin t with a loss of 0.3 W: the supply is their rate; a gap of 0.01 J is found."""
    time = np.linspace(0.0, 3.0, 301)
    speed = np.full_like(time, 2.0)
    tau = (np.cos(time) + 0.3) / speed
    names = ("tau", "w", "kinetic_energy", "potential_energy", "dissipated_power")
    columns = [tau, speed, 2.0 + np.sin(time), 0.0 * time, 0.3 + 0.0 * time]
    balance = experiments.balance_of(names)
    run = rerun.TimeTable(names, time, np.column_stack(columns))
    missing, flow = experiments.energy_residual(run, balance)
    assert missing < 1e-9 and flow == pytest.approx(np.trapezoid(np.abs(np.cos(time) + 0.3), time))
    columns[2] = columns[2] + 0.01 * (time > 1.5)
    missing, _ = experiments.energy_residual(rerun.TimeTable(names, time, np.column_stack(columns)), balance)
    assert missing == pytest.approx(0.01, abs=1e-9)


def test_which_outputs_make_a_balance():
    parts = ("kinetic_energy", "potential_energy", "dissipated_power")
    assert experiments.balance_of(["w", *parts]) is None  # no torque
    assert experiments.balance_of(["tau", "w", *parts[:2]]) is None  # no losses
    system = [f"{part}.{each}" for part in ("machine", "line", "model") for each in parts]
    found = experiments.balance_of(["motor.load_energy", *system])
    assert found.losses == (
        "machine.dissipated_power",
        "line.dissipated_power",
    )  # the model of the control is no part
    assert found.supply == ("motor.load_energy",) and len(found.stores) == 4


def test_the_power_balance_sees_a_wrong_torque(monkeypatch):
    interface = certify.interface_of(Accelerator, {})
    points = experiments.chosen_points(interface)
    balance = experiments.balance_of([s.name for s in interface.signals if s.causality != "parameter"])
    assert experiments.power_gap(interface, points, balance) < 1e-12
    more = balance._replace(stores=(*balance.stores, "kinetic_energy"))
    assert experiments.power_gap(interface, points, more) > 1e-3


@pytest.mark.parametrize("ratio", [1.0, 53.0])
def test_points_and_smooth_experiment_reach_every_angle_behind_a_gear(ratio):
    """The crank stands in each quarter of its turn at some point and moves as far in the smooth experiment, whatever
    the gear is; at rest it is at the first point alone."""
    interface = certify.interface_of(ChamberForces, {"ratio": ratio})
    given = [point.given for point in experiments.chosen_points(interface)]
    assert len(given) == experiments.POINTS
    turns = [own["phi"] / own["ratio"] / (2.0 * np.pi) % 1.0 for own in given]
    assert {int(4.0 * turn) for turn in turns} == set(range(4))
    speeds = [own["w"] / own["ratio"] for own in given]
    assert speeds[0] == 0.0 and max(speeds) == pytest.approx(4.75, rel=0.06) and np.all(np.diff(speeds) > 0.0)
    smooth = experiments.smooth_inputs(interface)
    way, speed = (smooth.values[:, smooth.names.index(name)] for name in ("phi", "w"))
    assert np.ptp(way) / ratio == pytest.approx(2.18, abs=0.01)
    assert np.trapezoid(speed, smooth.time) == pytest.approx(np.ptp(way), rel=1e-5)


def test_points_of_a_system_turn_its_motor(tmp_path):
    """The start of the motor's shaft stands under the name of its component."""
    from chainunit.report.console import study_file
    from chainunit.study.package import model_and_start

    (tmp_path / "x.toml").write_text("[machine]\nratio = 20.0\n")
    model, start = model_and_start(str(tmp_path / "x.toml"), study_file(tmp_path / "x.toml"))
    given = [point.given for point in experiments.chosen_points(certify.interface_of(model, start))]
    assert len({own["motor.phi_start"] for own in given}) == len(given) == experiments.POINTS
    assert max(own["motor.w_start"] for own in given) > 20.0


def test_a_point_without_torque_has_no_gap_of_its_powers():
    """Of a driveline without twist the powers are of rounding alone, a balance of which says nothing."""
    interface = certify.interface_of(MODELS["CardanDriveline"], {})
    balance = experiments.balance_of([s.name for s in interface.signals if s.causality != "parameter"])
    points = experiments.chosen_points(interface)
    still = points[1]._replace(given=points[1].given | {"phi": points[1].given["phi_start"]})
    assert experiments.power_gap(interface, [*points, still], balance) < 1e-12


@pytest.mark.second
def test_a_chain_has_no_limits_of_two_bars(tmp_path):
    """The lowest natural frequency is also that of the chain; slack webs and resonance are in its model."""
    model = MODELS["ChainUnitFlexible"]
    export(model, tmp_path / "it.fmu")
    members = certify.members_of(tmp_path / "it.fmu")
    with rerun.unpacked(members, "it.fmu") as fmu:
        found = domain(fmu, certify.with_interface(fmu)[1], [], [])
    assert [each["name"] for each in found["limits"]] == ["chain_resonance"]


LINKAGES = Path(__file__).parents[3] / "examples" / "linkages"


@pytest.mark.second
@pytest.mark.parametrize("name", ["tipper", "scissor_lift", "cylinder_lift", "slider_crank_press"])
def test_a_linkage_with_any_driver_balances(own, tmp_path, name):
    """A crank, a ram, a cylinder: their inputs move together, so that the energy balances."""
    from chainunit.machines.linkages.file import read_linkage

    model = read_linkage(LINKAGES / f"{name}.toml")
    export(model, tmp_path / "it.fmu")
    made = certify.certified(certify.members_of(tmp_path / "it.fmu"), "it.fmu", own, model, silent)
    found = json.loads(archive.contents(made.data).members[documents.EVIDENCE])
    assert found["energy"]["missing"] < 1e-5 * found["energy"]["flow"]
    assert found["points"]["power_gap"] < 1e-12
    (tmp_path / "it.fmu").write_bytes(made.data)
    public = own.public_key().public_bytes_raw()
    assert all(each.holds for each in verify(tmp_path / "it.fmu", public, model, told=silent))


def test_an_fmu_whose_energy_does_not_balance_is_not_certified(made, own, monkeypatch):
    plain = certify.members_of(made / "plain.fmu")
    for name, limit, words in (
        ("MISSING", 1e-15, "energy does not balance"),
        ("POWER_GAP", -1.0, "powers do not"),
    ):
        with monkeypatch.context() as changed, pytest.raises(certify.RunError, match=words):
            changed.setattr(experiments, name, limit)
            certify.certified(plain, "plain.fmu", own, None, silent)


@pytest.mark.second
def test_the_step_of_a_driveline_has_its_order(native_fmus):
    """Between masters the driveline is of third order while the shaft moves smoothly; chains of second."""
    for name, low, high in (("CardanDriveline", 2.7, 3.3), ("ChainUnitFlexible", 1.7, 2.4)):
        members = certify.members_of(native_fmus[name, 2][0])
        with rerun.unpacked(members, name) as fmu:
            interface = certify.with_interface(fmu)[1]
            given = experiments.smooth_inputs(interface)
            outputs = [s.name for s in interface.signals_of("output")]
            found, run = experiments.convergence(fmu, given, outputs)
        assert low < found.order < high and 0.0 < found.error < found.differences[1] < found.differences[0]
        assert run.values.shape == (1001, len(outputs))


def test_the_sources_hash_changes_with_a_source(monkeypatch, tmp_path):
    root = Path(certify.__file__).parents[2]
    copy = tmp_path / "chainunit"
    copy.mkdir()
    (copy / "a.py").write_text("1")
    monkeypatch.setattr(certify.resources, "files", lambda name: copy)
    first = certify.sources_hash()
    (copy / "a.py").write_text("2")
    second = certify.sources_hash()
    (copy / "a.py").rename(copy / "b.py")
    assert len({first, second, certify.sources_hash()}) == 3 and (root / "capabilities").is_dir()


@pytest.mark.second
def test_a_certificate_made_without_the_model_holds_for_whoever_has_it(own, tmp_path):
    """It has no conditions of the model, and none are looked for; the file of another model is refused."""
    from chainunit.machines.linkages.file import read_linkage

    model = read_linkage(LINKAGES / "slider_crank_press.toml")
    export(model, tmp_path / "it.fmu")
    members = certify.members_of(tmp_path / "it.fmu")
    without = certify.certified(members, "it.fmu", own, None, silent)
    assert any(line.startswith("left out: smooth experiment, energy, points") for line in without.words)
    for given in (None, model):
        found = checked(tmp_path, without.data, model=given)
        assert found["domain"].holds and found["equations"].holds is (True if given else None)
        assert all(each.holds is not False for each in found.values())
    with pytest.raises(InputError, match=r"it\.fmu: is no FMU of ChamberForces, or .* --of"):
        certify.certified(members, "it.fmu", own, ChamberForces, silent)
    (tmp_path / "it.fmu").write_bytes(certify.certified(members, "it.fmu", own, model, silent).data)
    found = {each.topic: each for each in verify(tmp_path / "it.fmu", None, ChamberForces, told=silent)}
    assert found["equations"].words == "the model of the file that --of names is not that of the FMU"
