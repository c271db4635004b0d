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

from chainunit import InputError, __version__
from chainunit.capabilities.vouching import archive, certify, experiments, keys, runs
from chainunit.capabilities.vouching.integrity import EVIDENCE, FAILS, HOLDS, OPEN, check_bytes, conclusion
from chainunit.capabilities.vouching.verify import verify
from chainunit.core.errors import WriteError
from chainunit.fmu.backends import export
from chainunit.fmu.native.export import export as native
from chainunit.fmu.native.platforms import compiles
from chainunit.fmu.reference import REFERENCE, RELATED
from chainunit.machines.accelerator import Accelerator
from chainunit.machines.chain_unit import ChamberForces
from chainunit.models import MODELS

pytest.importorskip("cryptography")


@pytest.fixture(scope="module")
def made(once):
    """A folder with a key, and a certified FMU beside the same without certification."""

    def fill(folder):
        assert chainunit("key", cwd=folder).returncode == 0
        export(ChamberForces, folder / "plain.fmu", {"left.material_mass": 45.0})
        run = chainunit("certify", "plain.fmu", "-o", "it.fmu", cwd=folder)
        assert run.returncode == 0, run.stderr

    return once("vouching", fill)


@pytest.fixture(scope="module")
def data(made):
    return (made / "it.fmu").read_bytes()


@pytest.fixture(scope="module")
def members(data):
    return archive.contents(data, "it.fmu")


@pytest.fixture(scope="module")
def own(made):
    return keys.private_key(made / "chainunit.key")


def generated():
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    return Ed25519PrivateKey.generate()


@pytest.fixture(scope="module")
def other():
    return generated()


signed = archive.signed


def members_in(file):
    return archive.contents(file.read_bytes(), file.name)


def signer(data):
    return check_bytes(data, "it.fmu").public


def failing(data, key=None):
    return [line.sentence for line in check_bytes(data, "it.fmu", key).findings if line.holds is False]


def checked(tmp_path, data, **options):
    """The lines of a file with this content, by topic; its signer is named."""
    file = tmp_path / "it.fmu"
    file.write_bytes(data)
    return {line.topic: line for line in verify(file, signer(data), **options)}


# -- what holds


@pytest.mark.compiler
def test_a_certified_fmu_holds(made):
    run = chainunit("verify", "it.fmu", "--key", "chainunit.key.pub", cwd=made)
    lines = run.stdout.splitlines()
    assert (run.returncode, run.stderr) == (0, "")
    assert [re.split(r"  +", line)[:2] for line in lines[:-1]] == [
        ["holds", topic]
        for topic in (
            "signature", "members", "version", "equations", "reference experiment", "points",
        )
    ]  # fmt: skip
    assert lines[-1] == "it.fmu: holds"
    assert "by the expected key" in lines[0] and "24 members" in lines[1]


NEEDED = {"cryptography", "fmpy", "numpy", "pydantic", "rich", "typer"}
"""The packages that a receiver installs beside this one; docs/how-to/vouching.md names them."""
PAGE = Path(__file__).parents[3] / "docs" / "how-to" / "vouching.md"


REFUSED = """
import fmpy
from chainunit.app.cli import app

app(["verify", "it.fmu", "--key", "chainunit.key.pub"], standalone_mode=False)
for _ in range(20):
    try:
        fmpy.simulate_fmu("it.fmu", stop_time=0.01, start_values={"l": -1.0})
    except fmpy.fmi1.FMICallException as error:
        print(error)
"""


@pytest.mark.compiler
def test_an_fmu_can_tell_its_refusal_after_a_verification(made):
    """Its message ran a logger of the verification that was gone: a crash of the whole process."""
    run = subprocess.run([sys.executable, "-c", REFUSED], cwd=made, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert run.stdout.count("fmi2EnterInitializationMode failed") == 20


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
    plain = members_in(made / "plain.fmu")
    changed = {name for name, content in plain.items() if members[name] != content}
    assert changed == {RELATED}
    assert set(members) - set(plain) == {EVIDENCE}
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
        again, _ = certify.certified(certify.members_of(made / name), "it.fmu", own, None)
        assert again == data
    plain = members_in(made / "plain.fmu")
    again = certify.members_of(made / "it.fmu")
    assert {name for name in again if again[name] != plain.get(name)} == {EVIDENCE, RELATED}


def test_evidence_holds_the_numbers_of_the_sentences(members):
    evidence = json.loads(members[EVIDENCE])
    assert evidence.keys() == {"model", "chainunit", "tolerance", "deviations"}
    assert (evidence["model"], evidence["chainunit"]) == ("ChamberForces", __version__)
    assert evidence["tolerance"] == 1e-9
    deviations = evidence["deviations"]
    assert deviations.keys() == {"reference experiment", "points"}
    assert all(0.0 < value <= 1e-12 for value in deviations.values())


def test_points_have_the_start_values_first_and_others_then():
    points = experiments.chosen_points(certify.interface_of(ChamberForces, {}))
    declared = ChamberForces.Parameters().r
    radii = [point.start["r"] for point in points]
    assert len(points) == experiments.POINTS and radii[0] == declared
    assert all(0.95 * declared <= r <= 1.05 * declared for r in radii) and len(set(radii)) == len(radii)


def test_the_evidence_has_its_role_in_fmi_ls_ref(members):
    root = ElementTree.fromstring(members[RELATED])
    roles = {node.get("source"): node.get("role") for node in root.findall("Related")}
    assert roles["vouching/evidence.json"] == "report"
    assert all(f"{REFERENCE}/{source}" in members for source in roles)


SCHEMAS = Path(__file__).parents[2] / "data" / "schemas"
"""The schemas of FMI-LS-REF and of the parts of FMI 3.0 that it names, of the FMI project (2-clause BSD licence)."""


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


# -- what does not hold


def spans(data):
    """By the name of a member the place of its bytes in the file, of the directory of the archive under the name "",
    and of the signature under "signature"."""
    with zipfile.ZipFile(io.BytesIO(data)) as opened:
        infos, end = opened.infolist(), opened.start_dir
    begins = [info.header_offset for info in infos]
    places = {
        info.filename: place
        for info, place in zip(infos, zip(begins, [*begins[1:], end], strict=True), strict=True)
    }
    last = len(data) - len(archive.MARK) - 192
    return places | {"": (end, last), "signature": (last, len(data))}


@pytest.mark.second
def test_500_changes_of_one_bit_are_found_and_named(data):
    """Of a member that cannot be read the name is in a line of its own."""
    places, rng = spans(data), random.Random(34)
    assert sum(end - begin for begin, end in places.values()) == len(data)
    names = list(places)
    with zipfile.ZipFile(io.BytesIO(data)) as opened:
        sizes = {info.filename: info.compress_size for info in opened.infolist()}
    for k in range(500):
        name = names[k % len(names)]
        bit = rng.randrange(8 * places[name][0], 8 * places[name][1])
        changed = bytearray(data)
        changed[bit // 8] ^= 1 << bit % 8
        first, *others = failing(bytes(changed))
        assert first.startswith(("does not hold: the file was changed", "is missing: the file is damaged")), (
            bit
        )
        if name in sizes and bit // 8 >= places[name][1] - sizes[name]:
            assert [line.partition(": ")[0] for line in others] == [name], (bit, others)


@pytest.mark.parametrize("place", ["modelDescription.xml", EVIDENCE, "signature", ""])
def test_the_command_names_a_changed_bit_and_loads_nothing(tmp_path, data, place):
    begin, end = spans(data)[place]
    changed = bytearray(data)
    changed[(begin + end) // 2] ^= 4
    (tmp_path / "it.fmu").write_bytes(changed)
    run = chainunit("verify", "it.fmu", cwd=tmp_path)
    assert (run.returncode, run.stderr) == (1, "")
    first, *others = (line for line in run.stdout.splitlines() if line.startswith("FAILS"))
    assert re.match("FAILS  signature +(does not hold|is missing)", first)
    assert all(place in line for line in others)
    if place.endswith((".xml", ".json")):
        assert len(others) == 1 and f"{place}: cannot be read (" in others[0]
    assert "holds  reference" not in run.stdout
    assert re.search(rf"it\.fmu: does not hold: {1 + len(others)} of \d lines fail", run.stdout)


def test_every_digit_of_the_signature_counts(data):
    """Also its case: two files with one signature would differ in bits that nobody signed."""
    for k in (*range(1, 193, 13), 192):
        for digit in (b"0", b"f", b"F", b" "):
            changed = data[: len(data) - k] + digit + data[len(data) - k + 1 :]
            assert (not failing(changed)) == (changed == data)
    upper = data[:-192] + data[-192:].upper()
    assert failing(upper) == [
        "is missing: the file is damaged, or another program packed it anew; ask for it as it was certified"
    ]


def test_no_bytes_at_all_make_an_error(data):
    """Pieces, repetitions and noise end in sentences."""
    rng = random.Random(5)
    for k in range(60):
        piece = data[: rng.randrange(len(data))] if k % 3 else rng.randbytes(rng.randrange(400))
        if k % 5 == 0:
            piece = piece + data[-rng.randrange(1, 3000) :]
        assert failing(bytes(piece))
    assert failing(b"") and failing(data + b"x")[0].startswith("is missing: the file is damaged")


def test_another_key_has_its_own_sentence(made, tmp_path, members, other, data):
    (tmp_path / "it.fmu").write_bytes(signed(members, other))
    run = chainunit("verify", "it.fmu", "--key", made / "chainunit.key.pub", cwd=tmp_path)
    assert run.returncode == 1
    mine, theirs = (
        keys.fingerprint(x)
        for x in (keys.public_key(made / "chainunit.key.pub"), signer(signed(members, other)))
    )
    assert f"holds, but by another key: expected {mine}, signed by {theirs}" in run.stdout
    assert "are not run: a file that is not as signed is not loaded" in run.stdout
    # whoever puts another key under a signature is found out
    digits = signer(signed(members, other)).hex().encode()
    (sentence,) = failing(data[:-192] + digits + data[-128:])
    assert f"does not hold: the file was changed, or not signed by the key {theirs} that it names" == sentence


def packed(members, order=sorted, **options):
    """The members in a zip file of another program."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, **options) as opened:
        for name in order(members):
            opened.writestr(name, members[name])
    return stream.getvalue()


def test_missing_added_changed_members_and_another_packer(data, members):
    """Whoever packs the members anew loses the signature; with the one of the file it does not hold."""
    fewer = {n: x for n, x in members.items() if n != "modelDescription.xml"}
    changed = {**members, "modelDescription.xml": members["modelDescription.xml"] + b" "}
    for contents in (fewer, {**members, "extra/new.txt": b"1"}, changed, members):
        (sentence,) = failing(packed(contents))
        assert sentence.startswith("is missing: the file is damaged, or another program packed it anew")
        stream = io.BytesIO(packed(contents))
        with zipfile.ZipFile(stream, "a") as opened:
            opened.comment = data[-len(archive.MARK) - 192 :]
        (sentence,) = failing(stream.getvalue())
        assert sentence.startswith("does not hold: the file was changed")


def test_a_member_that_stands_twice_is_named(members):
    stream = io.BytesIO(packed(members))
    with zipfile.ZipFile(stream, "a") as opened, pytest.warns(UserWarning, match="Duplicate"):
        opened.writestr("modelDescription.xml", b"other")
    assert "modelDescription.xml: stands in the archive twice" in failing(stream.getvalue())


def test_a_member_under_another_order_of_the_directory_is_found(data):
    """The same entries with two lines of the directory exchanged, or with another comment."""
    with zipfile.ZipFile(io.BytesIO(data)) as opened:
        begin = opened.start_dir
    tail = data[begin:]
    first = 46 + int.from_bytes(tail[28:30], "little")
    second = first + 46 + int.from_bytes(tail[first + 28 : first + 30], "little")
    swapped = data[:begin] + tail[first:second] + tail[:first] + tail[second:]
    assert len(swapped) == len(data) and zipfile.ZipFile(io.BytesIO(swapped)).testzip() is None
    assert failing(swapped)[0].startswith("does not hold: the file was changed")
    stream = io.BytesIO(data)
    with zipfile.ZipFile(stream, "a") as opened:
        opened.comment = b"signed by me"
    assert failing(stream.getvalue())[0].startswith("is missing: the file is damaged")


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
        assert not loaded & {"scipy", "casadi", "fmpy", "chainunit.machines.chain_unit"}


def test_an_unsigned_file_no_archive_and_no_file(made, tmp_path):
    run = chainunit("verify", "plain.fmu", cwd=made)
    assert (
        run.returncode == 1 and "the file is not signed; chainunit vouch certify FILE signs one" in run.stdout
    )
    (tmp_path / "text.fmu").write_text("no archive")
    run = chainunit("verify", "text.fmu", cwd=tmp_path)
    assert run.returncode == 2 and "is no FMU and no SSP package: it is not a zip archive" in run.stderr
    assert chainunit("verify", "none.fmu", cwd=tmp_path).returncode == 2


@pytest.mark.parametrize("version", ["0.0.9", "99.1"])
def test_an_older_and_a_newer_version_have_their_sentences(tmp_path, members, own, version):
    found = checked(tmp_path, signed(evidence(chainunit=version)(members), own), run=False)
    sentence = f"certified by chainunit {version}, here is {__version__}"
    assert found["version"].holds is False and found["version"].sentence.startswith(sentence)
    assert found["signature"].holds and found["members"].holds and found["equations"].holds


def test_a_changed_start_value_that_is_signed_again_is_found(tmp_path, members, other):
    """Whoever has a key of his own can sign anything; the evidence inside then does not fit."""
    start = f'start="{ChamberForces.Parameters().r!r}"'
    text = members["modelDescription.xml"].decode()
    place = text.index('name="r"')
    at = text.index(start, place)
    longer = text[:at] + 'start="0.2"' + text[at + len(start) :]
    found = checked(tmp_path, signed({**members, "modelDescription.xml": longer.encode()}, other))
    assert found["signature"].holds and found["members"].holds
    assert found["equations"].holds is False and "reference experiment" not in found


def test_another_library_that_is_signed_again_is_found(tmp_path, members, other):
    """The library of a machine with another crank, under the identifier of this one."""
    libraries = [name for name in members if name.startswith("binaries/")]
    if "sources/model.c" not in members:
        pytest.skip("no C compiler")
    export(ChamberForces, tmp_path / "longer.fmu", {"left.material_mass": 45.0, "r": 0.2})
    theirs = members_in(tmp_path / "longer.fmu")
    guid, new = (re.search(rb'guid="([^"]+)"', x["modelDescription.xml"])[1] for x in (members, theirs))
    swapped = {name: theirs[name].replace(new, guid) for name in libraries}
    assert all(guid in content for content in swapped.values())
    found = checked(tmp_path, signed({**members, **swapped}, other))
    assert found["equations"].holds
    assert found["reference experiment"].holds is False
    assert "the FMU here: largest deviation" in found["reference experiment"].sentence
    assert found["points"].holds, "all parameters are set there"


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
    whole = certify.certified(plain, "it.fmu", own, None)[0]
    bare = without(archive.contents(whole, "it.fmu"), "binaries/")
    before = checked(tmp_path, whole)
    found = checked(tmp_path, signed(bare, own))
    assert found["library"].holds is None
    assert found["library"].sentence.startswith("the FMU has no library for this machine, binaries/")
    assert re.search(r"one that \S+ made here from the sources in the FMU$", found.pop("library").sentence)
    assert found.keys() == before.keys() and all(each.holds for each in found.values())
    for topic in ("reference experiment", "points"):
        assert found[topic].sentence == before[topic].sentence


def test_other_sources_that_are_signed_again_are_found(tmp_path, members, other):
    """Those of a machine with another crank, whose results are not the ones inside."""
    if "sources/model.c" not in members:
        pytest.skip("no C compiler")
    export(ChamberForces, tmp_path / "longer.fmu", {"left.material_mass": 45.0, "r": 0.2})
    theirs = members_in(tmp_path / "longer.fmu")
    guid, new = (re.search(rb'guid="([^"]+)"', x["modelDescription.xml"])[1] for x in (members, theirs))
    model = theirs["sources/model.c"].replace(new, guid)
    assert guid in model
    found = checked(tmp_path, signed({**without(members, "binaries/"), "sources/model.c": model}, other))
    assert found["library"].holds is None and found["equations"].holds
    assert found["reference experiment"].holds is False and found["points"].holds


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
        return found["experiments"].sentence

    words = "are not run: the FMU has no library for this machine, binaries/"
    assert said(without(bare, "sources/")).startswith(words)
    assert said(without(bare, "sources/")).endswith(", and no sources of one")
    assert "its sources cannot be compiled here: the C compiler " in said(broken)
    assert "cannot be compiled here" in said(without(bare, "sources/runtime.c"))
    with monkeypatch.context() as patch:
        patch.setattr(runs, "compiler", lambda: None)
        assert "a C compiler makes one from the sources in the FMU: install cc" in said(bare)


def test_the_end_says_that_experiments_were_not_run(made):
    run = chainunit("verify", "it.fmu", "--no-run", "--key", "chainunit.key.pub", cwd=made)
    assert run.returncode == 3 and "note   experiments  are not run, as --no-run asks" in run.stdout
    assert run.stdout.splitlines()[-1] == "it.fmu: holds, but experiments were not run"


def test_evidence_of_another_form_is_a_sentence(tmp_path, members, other):
    for content in (b"[]", b"{}", b"not json"):
        found = checked(tmp_path, signed({**members, EVIDENCE: content}, other))
        assert found["evidence"].holds is False


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


def test_names_that_lead_out_of_a_folder_are_not_unpacked(made, members, own, tmp_path):
    data = signed({**members, "../evil.txt": b"1"}, own)
    found = checked(tmp_path, data)
    assert found["members"].holds is False and "leads out of its folder" in found["members"].sentence
    assert not (tmp_path / "evil.txt").exists() and not (tmp_path.parent / "evil.txt").exists()
    for name in ("/a", "a/../b", "c:\\x", "a//b", ".", "a\\b"):
        with pytest.raises(InputError, match="leads out of its folder"):
            archive.contents(signed({name: b""}, own), "it.fmu")
    assert archive.contents(signed({"a/b.txt": b"", "a/": b""}, own), "it.fmu").keys() == {"a/b.txt", "a/"}


# -- files that would fool whoever verifies them: signed by a key that is named, and nothing in them holds


def evidence(**changes):
    """A change of evidence.json: values by key, those of `deviations` by the name of the experiment; None takes a key
    out."""

    def change(members):
        stated = json.loads(members[EVIDENCE])
        for key, value in changes.items():
            place = stated["deviations"] if key in ("points", "reference experiment") else stated
            if value is None:
                del place[key]
            else:
                place[key] = value
        return {**members, EVIDENCE: json.dumps(stated).encode()}

    return change


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
    "a deviation of 1e9": (evidence(points=1e9), "points = 1000000000.0: must be a number from 0 to 1e-09"),
    "a deviation as text": (evidence(points="0"), 'points = "0": must be a number'),
    "a deviation below 0": (evidence(**{"reference experiment": -1.0}), "reference experiment = -1.0: must be"),
    "a deviation of something else": (evidence(deviations={"mine": 0.0}), "must be those of points and reference"),
    "no deviations": (evidence(deviations={}), "must be those of points and reference experiment"),
    "deviations that are no table": (evidence(deviations=[1]), "is not of the form that this version writes"),
    "no evidence": (lost(EVIDENCE), "evidence.json: is missing"),
    "evidence without end": (
        lambda members: {**members, EVIDENCE: b"[" * 100_000}, "evidence.json: is no JSON (it is nested",
    ),
    "no points": (evidence(points=None), "must be those of points and reference experiment"),
    "evidence of another model": (evidence(model="Accelerator"), 'model = "Accelerator": must be that of the FMU'),
    "a reference experiment of one row": (tables(lambda rows: rows[:1], *REFERENCE_FILES), "must have 26 rows"),
    "a reference experiment at rest": (tables(still, *REFERENCE_FILES), "the equations in Python here: largest"),
    "half of the reference results": (tables(half, *REFERENCE_FILES[1:]), "the equations in Python here: largest"),
    "half of the results after setting": (tables(half, REFERENCE_FILES[2]), "the equations in Python here: largest"),
    "reference results without numbers": (
        tables(lambda rows: [re.sub(",[^,]*", ",nan", row) for row in rows], "_set_then_read.csv"),
        "largest deviation inf",
    ),
    "no reference experiment": (lost(REFERENCE + "/ChamberForces"), "one of both lacks"),
    "large nominal sizes": (text(b' nominal="', b' nominal="9'), "the FMU is none of ChamberForces"),
    "another unit": (text(b'unit="N.m"', b'unit="N"'), "the FMU is none of ChamberForces"),
    "fewer variables": (text(b'name="frame.moment"', b'name="frame.other"'), "the FMU is none of ChamberForces"),
    "another library for Model Exchange": (
        text(b'<ModelExchange modelIdentifier="ChamberForces"', b'<ModelExchange modelIdentifier="Evil"'),
        "must be one name in C, as one library is judged",
    ),
    "a library that cannot be loaded": (
        lambda members: {
            name: b"junk" if name.startswith("binaries/") else content for name, content in members.items()
        },
        "does not run on this machine: Failed to load shared library",
    ),
}  # fmt: skip


@pytest.mark.stages(first=7)
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
    assert words in " ".join(each.sentence for each in found.values() if each.holds is False), found


@pytest.mark.parametrize(
    ("factor", "words"),
    [(0.5, "largest deviation"), (3.0, "largest deviation"), (np.nan, "largest deviation inf")],
)
def test_other_outputs_do_not_hold(tmp_path, data, monkeypatch, factor, words):
    """Of a library that gives a half, three times, or no numbers."""
    right = experiments.simulated

    def other(*arguments):
        run = right(*arguments)
        return run._replace(values=factor * run.values)

    monkeypatch.setattr(experiments, "simulated", other)
    found = checked(tmp_path, data)
    for topic in ("reference experiment", "points"):
        assert found[topic].holds is False and words in found[topic].sentence
    assert found["equations"].holds and conclusion(list(found.values()))[0] == FAILS


def test_an_ssp_package_holds_by_its_fmus_alone(tmp_path, members, other):
    """One without FMUs has nothing to judge; an FMU in it is signed and judged as any other."""
    system = {"SystemStructure.ssd": b"<a/>"}
    found = checked(tmp_path, signed(system, other))
    assert conclusion(list(found.values())) == (OPEN, "holds, but nothing in it was judged")
    found = checked(tmp_path, signed({**system, **members}, other))
    assert found["points"].holds, "an FMU does not become an SSP package"
    for inside, topic, sentence in (
        (packed(members), "signature", "is missing"),
        (signed(without(members, EVIDENCE), other), "evidence", "is missing"),
        (signed(evidence(tolerance=1.0)(members), other), "evidence", "must be a number"),
        (packed(members)[:5000], None, "cannot be read"),
    ):
        found = checked(tmp_path, signed({**system, "resources/a.fmu": inside}, other))
        line = found[f"resources/a.fmu, {topic}"] if topic else found["evidence"]
        assert line.holds is False and sentence in line.sentence
    with_other_key = signed({**system, "resources/a.fmu": signed(members, generated())}, other)
    line = checked(tmp_path, with_other_key)["resources/a.fmu, signature"]
    assert line.holds is False and "holds, but by another key" in line.sentence


def test_an_fmu_by_pythonfmu_without_its_script_is_not_run(fmus):
    """The library of pythonfmu would end the process."""
    members = members_in(fmus["ChamberForces"])
    lacking = {
        name: content
        for name, content in members.items()
        if not re.fullmatch("resources/ChamberForces_.*py", name)
    }
    assert len(lacking) == len(members) - 1
    with (
        runs.unpacked(lacking, "it.fmu") as fmu,
        pytest.raises(runs.NoLibraryError, match=r"^resources/ChamberForces_\w+[.]py is missing$"),
    ):
        runs.make_runnable(fmu)


def test_a_model_under_another_name_is_not_judged_by_itself(tmp_path, members, other):
    """Its results are then those in the file alone."""
    renamed = {re.sub("^(extra/.*/)ChamberForces_", r"\1Mine_", name): x for name, x in members.items()}
    renamed = text(b'modelName="ChamberForces"', b'modelName="Mine"')(evidence(model="Mine")(renamed))
    status, words = conclusion(list(checked(tmp_path, signed(renamed, other)).values()))
    assert (status, words) == (OPEN, "holds, but was not compared with its equations: name its file by --of")
    fewer = text(b'name="frame.moment"', b'name="frame.other"')(renamed)
    line = checked(tmp_path, signed(fewer, other))["evidence"]
    assert line.holds is False and "frame.moment: is no variable of the FMU" in line.sentence


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

    monkeypatch.setattr("fmpy.simulate_fmu", ran)
    monkeypatch.setattr(runs, "compiler", ran)
    for content in (members, without(members, "binaries/")):
        (tmp_path / "it.fmu").write_bytes(signed(content, other))
        found = verify(tmp_path / "it.fmu", None)
        assert conclusion(found)[0] == OPEN and {each.topic: each for each in found}["equations"].holds
    assert conclusion(verify(tmp_path / "it.fmu", None, run=False))[0] == OPEN


def test_experiments_that_cannot_be_computed_again_are_said_at_the_end(
    tmp_path, data, members, own, monkeypatch
):
    """Without casadi those of a motor; it must give the results in the file all the same."""

    def missing(*args):
        raise ModuleNotFoundError(name="casadi")

    monkeypatch.setattr(experiments, "by_equations", missing)
    found = list(checked(tmp_path, data).values())
    words = "holds, but its experiments were not computed again without the package casadi"
    assert conclusion(found) == (OPEN, words)
    found = checked(tmp_path, signed(tables(half, *REFERENCE_FILES[1:])(members), own))
    assert found["reference experiment"].holds is False
    assert "largest deviation 1 of" in found["reference experiment"].sentence


def test_members_that_no_folder_can_have_are_named(tmp_path, members, own):
    for name in ("modelDescription.xml/more", "x" * 300):
        found = checked(tmp_path, signed({**members, name: b"1"}, own))
        assert "cannot be unpacked" in found["evidence"].sentence and found["evidence"].holds is False


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


def test_files_that_are_no_keys_are_refused(made, tmp_path):
    from cryptography.hazmat.primitives import serialization as forms
    from cryptography.hazmat.primitives.asymmetric import ec

    foreign = ec.generate_private_key(ec.SECP256R1())
    text = foreign.private_bytes(forms.Encoding.PEM, forms.PrivateFormat.PKCS8, forms.NoEncryption())
    (tmp_path / "ec.key").write_bytes(text)
    (tmp_path / "text").write_text("-----BEGIN nothing")
    with pytest.raises(InputError, match=r"is a key of another kind; must be Ed25519"):
        keys.private_key(tmp_path / "ec.key")
    with pytest.raises(InputError, match=r"has no private key in PEM"):
        keys.private_key(made / "chainunit.key.pub")
    for read in (keys.private_key, keys.public_key):
        with pytest.raises(InputError, match=r"has no (private|public) key in PEM"):
            read(tmp_path / "text")
        with pytest.raises(
            InputError, match=r"none: cannot be read \(No such file or directory\); chainunit vouch key makes"
        ):
            read(tmp_path / "none")
    with pytest.raises(
        InputError, match=r"has no public key in PEM; chainunit vouch key makes it, .* with \.pub"
    ):
        keys.public_key(made / "chainunit.key")


# -- what is certified


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"modelDescription.xml": b"<a/>"}, "is no FMU"),
        ({"readme.txt": b"1"}, "is no FMU"),
    ],
)
def test_other_files_are_not_certified(made, tmp_path, content, words):
    (tmp_path / "x.fmu").write_bytes(packed(content))
    run = chainunit("certify", "x.fmu", "--key", made / "chainunit.key", cwd=tmp_path)
    assert run.returncode == 2 and words in run.stderr


def test_a_folder_is_not_certified(made, tmp_path):
    run = chainunit("certify", tmp_path, "--key", made / "chainunit.key", cwd=tmp_path)
    assert run.returncode == 2 and "is a folder" in run.stderr


def test_fmus_of_others_and_of_other_versions_are_not_certified(made, own):
    plain = certify.members_of(made / "plain.fmu")
    text = plain["modelDescription.xml"]
    for tool, words in (
        (b"Other 1.0", "was made by Other 1.0; must be by chainunit"),
        (b"chainunit 0.0.9", "was made by chainunit 0.0.9; .*: export it anew"),
    ):
        changed = text.replace(f"chainunit {__version__}".encode(), tool)
        with pytest.raises(InputError, match=words):
            certify.certified({**plain, "modelDescription.xml": changed}, "x.fmu", own, None)


def test_an_fmu_that_does_not_give_its_results_is_not_certified(made, own):
    plain = certify.members_of(made / "plain.fmu")
    name = next(n for n in plain if n.endswith("_co_simulation.csv"))
    lines = plain[name].decode().splitlines()
    lines[3] = ",".join(["0.08", *("7.0" for _ in lines[3].split(",")[1:])])
    with pytest.raises(certify.RunError, match=r"x\.fmu: is not certified: reference experiment: largest"):
        certify.certified({**plain, name: "\n".join(lines).encode()}, "x.fmu", own, None)


STUDY = """
[run]
crank_speed = 2.4
"""


@pytest.mark.second
def test_a_study_becomes_a_certified_system(made, tmp_path):
    """Its model has no name in the package: with the file it is compared, too."""
    (tmp_path / "mine.toml").write_text(STUDY)
    name = "ChamberForcesSystem.fmu"
    assert chainunit("export", "mine.toml", "-o", name, cwd=tmp_path).returncode == 0
    key = "--key", made / "chainunit.key"
    run = chainunit("certify", name, "--of", "mine.toml", *key, cwd=tmp_path)
    assert run.returncode == 0 and "  points: largest deviation" in run.stdout, run.stderr
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
    read = members_in(tmp_path / "a.ssp")
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
    assert re.search(r"note   resources/foreign\.fmu +is no FMU of this version of chainunit", run.stdout)
    after = archive.contents(first, "a.ssp")
    assert all(after[n] == x for n, x in read.items() if not n.endswith(".fmu"))
    assert after["resources/foreign.fmu"] == theirs
    changed = bytearray(first)
    changed[spans(first)["resources/DcMotor.fmu"][0] + 5000] ^= 1
    signature, member = failing(bytes(changed))
    assert signature.startswith("does not hold") and member.startswith("resources/DcMotor.fmu: ")


@pytest.mark.stages(second=4)
@pytest.mark.second
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("name", list(MODELS))
def test_every_model_is_certified_and_holds(native_fmus, own, tmp_path, name, fmi):
    file = native_fmus[name, fmi][0]
    made, _ = certify.certified(certify.members_of(file), file.name, own, None)
    (tmp_path / file.name).write_bytes(made)
    public = own.public_key().public_bytes_raw()
    found = {each.topic: each for each in verify(tmp_path / file.name, public)}
    assert all(each.holds for each in found.values()), found
    assert {"reference experiment", "points", "equations"} <= set(found)
    assert list(validate_fmu(str(tmp_path / file.name))) == []


@pytest.mark.second
def test_an_fmu_with_flat_names_is_certified_as_any_other(own, tmp_path):
    """Its names in tables are those of the FMU; points are there, and a changed start value is found."""
    export(ChamberForces, tmp_path / "plain.fmu", {"left.material_mass": 45.0}, names="flat")
    whole = certify.certified(certify.members_of(tmp_path / "plain.fmu"), "it.fmu", own, None)[0]
    members = archive.contents(whole, "it.fmu")
    found = checked(tmp_path, whole)
    if "sources/model.c" in members:
        assert conclusion(list(found.values())) == (HOLDS, "holds")
    assert found["equations"].holds
    assert json.loads(members[EVIDENCE])["deviations"]["points"] < 1e-12
    heavier = text(b'start="45.0"', b'start="46.0"')(members)
    assert conclusion(list(checked(tmp_path, signed(heavier, own)).values()))[0] == FAILS


@pytest.mark.second
def test_a_python_fmu_is_certified_and_holds(fmus, own, tmp_path):
    made, _ = certify.certified(certify.members_of(fmus["DcMotor"]), "DcMotor.fmu", own, None)
    (tmp_path / "DcMotor.fmu").write_bytes(made)
    found = verify(tmp_path / "DcMotor.fmu", own.public_key().public_bytes_raw())
    assert all(each.holds for each in found)
    assert "pythonfmu" in made.decode("latin-1")
    bare = without(archive.contents(made, "DcMotor.fmu"), "binaries/")
    found = checked(tmp_path, signed(bare, own))
    assert found["experiments"].sentence.endswith(", and no sources of one")
    assert conclusion(list(found.values())) == (OPEN, "holds, but experiments were not run")


# -- the experiments by themselves


@pytest.mark.parametrize("ratio", [1.0, 53.0])
def test_points_reach_every_angle_behind_a_gear(ratio):
    """The crank stands in each quarter of its turn at some point, whatever the gear is; at rest it is at the first
    point alone."""
    interface = certify.interface_of(ChamberForces, {"ratio": ratio})
    given = [point.start for point in experiments.chosen_points(interface)]
    assert len(given) == experiments.POINTS
    turns = [own["phi"] / own["ratio"] / (2.0 * np.pi) % 1.0 for own in given]
    assert {int(4.0 * turn) for turn in turns} == set(range(4))
    speeds = [own["w"] / own["ratio"] for own in given]
    assert speeds[0] == 0.0 and max(speeds) == pytest.approx(4.75, rel=0.06) and np.all(np.diff(speeds) > 0.0)


def test_points_of_a_system_turn_its_motor(tmp_path):
    """The start of the motor's shaft stands under the name of its component."""
    from chainunit.report.console import study_file
    from chainunit.study.package import model_and_start

    (tmp_path / "x.toml").write_text("[machine]\nratio = 20.0\n")
    model, start = model_and_start(str(tmp_path / "x.toml"), study_file(tmp_path / "x.toml"))
    given = [point.start for point in experiments.chosen_points(certify.interface_of(model, start))]
    assert len({own["motor.phi_start"] for own in given}) == len(given) == experiments.POINTS
    assert max(own["motor.w_start"] for own in given) > 20.0


LINKAGES = Path(__file__).parents[3] / "examples" / "linkages"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tipper", "scissor_lift", "cylinder_lift", "slider_crank_press"])
def test_a_linkage_with_any_driver_is_certified_and_holds(own, tmp_path, name):
    """A crank, a ram, a cylinder."""
    from chainunit.machines.linkages.file import read_linkage

    model = read_linkage(LINKAGES / f"{name}.toml")
    export(model, tmp_path / "it.fmu")
    data = certify.certified(certify.members_of(tmp_path / "it.fmu"), "it.fmu", own, model)[0]
    found = checked(tmp_path, data, model=model)
    assert {"equations", "reference experiment", "points"} <= found.keys()
    assert all(line.holds for line in found.values()), found


@pytest.mark.second
def test_a_certificate_made_without_the_model_holds_for_whoever_has_it(own, tmp_path):
    """It has no points of the model, and none are looked for; the file of another model is refused."""
    from chainunit.machines.linkages.file import read_linkage

    model = read_linkage(LINKAGES / "slider_crank_press.toml")
    export(model, tmp_path / "it.fmu")
    members = certify.members_of(tmp_path / "it.fmu")
    whole, sentences = certify.certified(members, "it.fmu", own, None)
    assert any(line.startswith("left out: points") for line in sentences)
    for given in (None, model):
        found = checked(tmp_path, whole, model=given)
        assert found["equations"].holds is (True if given else None)
        assert all(each.holds is not False for each in found.values())
    with pytest.raises(InputError, match=r"the FMU is none of ChamberForces, or .* --of"):
        certify.certified(members, "it.fmu", own, ChamberForces)
    (tmp_path / "it.fmu").write_bytes(certify.certified(members, "it.fmu", own, model)[0])
    found = {each.topic: each for each in verify(tmp_path / "it.fmu", None, ChamberForces)}
    assert found["evidence"].sentence.startswith("the FMU is none of ChamberForces")
