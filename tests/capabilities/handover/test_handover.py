"""The files for others: names and types are those of the template, basyx reads them, and the cycle comes back."""

from __future__ import annotations

import csv
import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest
from command import chainunit

from chainunit import InputError
from chainunit.capabilities.handover.cycle import SECTION, read_cycle
from chainunit.capabilities.handover.page import HandoverQuestion, hand_over, save
from chainunit.capabilities.handover.shell import LONGEST, _element, environment
from chainunit.capabilities.handover.template import ROOT, elements

pytestmark = pytest.mark.slow

TEMPLATE = json.loads((Path(__file__).parents[2] / "data" / "idta_02021.json").read_text("utf-8"))
LINKAGES = Path(__file__).parents[3] / "examples" / "linkages"
SHORT = "event = []\n[run]\nramp = 0.3\nsettle_turns = 1\n"
STUDIES = {
    "sized": """
title = "A mill picks its motor"
start = "direct"
event = []
[report]
project = "Quarry"
author = "A. Miller"
date = 2026-03-01
[machine]
left = { wall_mass = 540, web_mass = 216 }
right = { wall_mass = 540, web_mass = 216 }
[usage]
hours = 7.5
days = 220
[sizing]
candidates = 3
poles_least = 4
fluctuation = 0.1
inertia_ratio = 50
""",
    "knife": SHORT + '[system]\nmachine = "KnifeDrive"\n',
    "press": f"""{SHORT}crank_speed = "60 rpm"
[system]
motor = "IE3 4-pole 5.5 kW, 132S"
[machine]
linkage = '{LINKAGES / "slider_crank_press.toml"}'
""",
    "line": SHORT
    + '[driveline]\nplace = "motor"\nalpha1 = "5 deg"\nalpha2 = "5 deg"\nc2 = 300\nd2 = 1\nc3 = 300\nd3 = 1\n',
}
KINDS = {"xs:long": int, "xs:integer": int, "xs:string": str}


@pytest.fixture(scope="module", params=STUDIES)
def folder(request, tmp_path_factory):
    """A folder with the result of a study and its files for others, in the folder ``out``."""
    folder = tmp_path_factory.mktemp(request.param)
    (folder / "study.toml").write_text(STUDIES[request.param], "utf-8")
    done = chainunit("study", "study.toml", "-o", "results", cwd=folder)
    assert done.returncode in (0, 1), done.stderr
    done = chainunit("handover", "results", "-o", "out", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder


def only(name):
    """A test of one study."""
    return pytest.mark.parametrize("folder", [name], indirect=True, scope="module")


def numbers(folder):
    return json.loads((folder / "results" / "result.json").read_text("utf-8"))


def plain(folder):
    return np.loadtxt(folder / "results" / "load_cycle.csv", delimiter=",", skiprows=1).T


def read_by_basyx(file):
    """The submodel in a file, and the names of its supplementary files, as basyx reads them; a fault is an error."""
    pytest.importorskip("basyx")
    from basyx.aas import model
    from basyx.aas.adapter import aasx
    from basyx.aas.adapter import json as adapter

    store, files = model.DictIdentifiableStore(), aasx.DictSupplementaryFileContainer()
    if file.suffix == ".aasx":
        with aasx.AASXReader(file, failsafe=False) as reader:
            reader.read_into(store, files)
    else:
        store = adapter.read_aas_json_file(file, failsafe=False)
    (own,) = (each for each in store if isinstance(each, model.Submodel))
    return own, list(files)


def walked(elements_, path=ROOT):
    """Path in the template and element, of all elements, by classes of basyx."""
    for each in elements_:
        name = each.id_short if each.id_short not in (None,) else ""
        own = f"{path}/{name}"
        if own not in elements() and name[-2:].isdigit():
            own = own[:-2]
        yield own, each
        below = getattr(each, "statement", None)
        if below is None and type(each).__name__ == "SubmodelElementCollection":
            below = each.value
        yield from walked(below or (), own)


def test_the_declaration_is_the_template():
    said = [
        f"{each.path} : {each.value_type}" if each.value_type else f"{each.path} [{each.type}]"
        for each in elements().values()
    ]
    assert said == TEMPLATE["paths"] and len(said) == 217
    assert elements()[ROOT].semantic_id == TEMPLATE["semanticId"]["keys"][0]["value"]
    names = " ".join(elements())
    assert all(
        word in names for word in ("RotraryTable", "EnergyConsumtionPerCycle", "InternalMomentOfIntertia")
    )


@pytest.mark.parametrize("file", ["sizing.aasx", "sizing.json"])
def test_basyx_reads_names_and_types_of_the_template(folder, file):
    own, files = read_by_basyx(folder / "out" / file)
    assert own.id_short == ROOT and own.semantic_id.key[0].value == TEMPLATE["semanticId"]["keys"][0]["value"]
    paths = {line.split(" ")[0]: line.split(" ", 1)[1] for line in TEMPLATE["paths"]}
    seen = list(walked(own.submodel_element))
    assert len(seen) > 40
    texts = [
        text
        for _, each in seen
        if type(each).__name__ == "MultiLanguageProperty"
        for text in each.value.values()
    ]
    assert texts and max(map(len, texts)) <= LONGEST
    for path, each in seen:
        assert path in paths
        kind, template = type(each).__name__, elements()[path]
        assert kind == template.type
        assert each.semantic_id.key[0].value == template.semantic_id
        if kind == "Property":
            assert paths[path] == f": {template.value_type}"
            if each.value is not None and template.value_type in KINDS:
                assert isinstance(each.value, KINDS[template.value_type])
    assert any(path.endswith("EnergyConsumtionPerCycle") for path, _ in seen)
    if file == "sizing.aasx":
        wanted = {"cycle.csv", "run.csv", "load_cycle.csv", "study.json"}
        assert {Path(name).name for name in files} == wanted


@pytest.mark.parametrize("file", ["sizing.aasx", "sizing.json", "cycle.csv"])
def test_the_cycle_comes_back(folder, file):
    if file.endswith("aasx"):
        pytest.importorskip("basyx")
    cycle = read_cycle(folder / "out" / file)
    time, speed, torque, inertia = plain(folder)
    np.testing.assert_array_equal([cycle.time, cycle.speed, cycle.torque], [time, speed, torque])
    if file.endswith("csv"):
        assert cycle.inertia is None
    else:
        np.testing.assert_array_equal(cycle.inertia, inertia)
    # angle and acceleration are those of this speed
    steps = np.diff(time) * 0.5 * (speed[1:] + speed[:-1])
    np.testing.assert_allclose(np.diff(cycle.angle), steps, atol=2e-3 * np.max(np.abs(steps)))
    gained = np.trapezoid(cycle.acceleration, time)
    assert gained == pytest.approx(speed[-1] - speed[0], abs=2e-3 * np.max(np.abs(speed)))


def test_the_whole_run_begins_at_rest_and_ends_with_the_steady_turns(folder):
    run = read_cycle(folder / "out" / "sizing.json", "RotativeSection02")
    time, speed, torque, _ = plain(folder)
    assert run.time[0] == run.angle[0] == run.speed[0] == 0.0
    begin = np.flatnonzero(np.isclose(run.speed, speed[0], rtol=1e-9, atol=0.0))[-1]
    # the last row of a turn lies between two steps
    own = slice(begin, begin + len(time) - 1)
    np.testing.assert_allclose(run.torque[own], torque[:-1], rtol=1e-8, atol=1e-8 * np.max(np.abs(torque)))
    np.testing.assert_allclose(run.time[own] - run.time[begin], time[:-1], atol=1e-8)


def value_of(data, name):
    """The exact value of an element of handover.json."""
    return data["said"][name]["value"]


def test_the_numbers_are_those_of_the_result(folder):
    data = json.loads((folder / "out" / "handover.json").read_text("utf-8"))
    assert (folder / "out" / "candidates.csv").exists() == ("sizing" in numbers(folder))
    result, motor, whole = numbers(folder), "SizingResult/MainComponent", "SizingResult/OverallSystem"
    steady = result["answers"]["steady"]
    time, speed, torque, inertia = plain(folder)
    assert value_of(data, f"{motor}/MaxCurrentUtilization") == steady["current_peak"]["value"]
    assert value_of(data, f"{motor}/RmsOfMotorTorque") == steady["motor_torque_rms"]["value"]
    cycle = steady["supply_power_mean"]["value"]
    taken = value_of(data, f"{motor}/PowerInMotorOperation")
    back = value_of(data, f"{motor}/PowerInRegenerativeOperation")
    if cycle is not None:
        energy = cycle * time[-1] / 3.6e6
        assert value_of(data, f"{whole}/EnergyConsumtionPerCycle") == pytest.approx(energy, rel=1e-12)
        # without what the masses take up
        assert taken - back == pytest.approx(cycle, rel=0.02)
    assert value_of(data, "ApplicationRequirements/UsageProfile/CyclesPerMinute") == 60.0 / time[-1]
    assert value_of(data, f"{motor}/MaxRotationSpeedUtilization") == pytest.approx(
        np.max(speed) * 30 / np.pi, rel=1e-8
    )
    power = math.sqrt(np.trapezoid((torque * speed) ** 2, time) / time[-1])
    assert value_of(data, f"{motor}/RmsOfPower") == pytest.approx(power, rel=1e-12)
    rotor = result["motor"]["rotor.J"]["value"]
    outside = value_of(data, f"{whole}/ExternalMomentOfInertia")
    assert outside >= np.max(inertia) and value_of(data, f"{whole}/InternalMomentOfIntertia") == rotor
    assert value_of(data, f"{whole}/MassInertiaRatio") == pytest.approx(outside / rotor, rel=1e-12)


def test_the_checks_have_one_number_for_each_utilisation(folder):
    rows = numbers(folder)["checks"]["rows"]
    assert (folder / "out" / "checks.csv").exists() == bool(rows)
    if rows:
        with (folder / "out" / "checks.csv").open(newline="", encoding="utf-8") as file:
            written = list(csv.DictReader(file, delimiter=";"))
        assert [each["title"] for each in written] == [row["title"] for row in rows]
        for own, row in zip(written, rows, strict=True):
            assert float(own["utilisation"]) == row["utilisation"]["value"]
            assert float(own["value"]) == row["value"]["value"] and own["unit"] == row["limit"]["unit"]
            assert own["holds"] == ("yes" if row["holds"] else "no")


@only("sized")
def test_a_sized_drive_has_one_number_for_each_utilisation(folder):
    data, sizing = (
        json.loads((folder / "out" / "handover.json").read_text("utf-8")),
        numbers(folder)["sizing"],
    )
    checks = sizing["candidates"][0]["checks"]
    with (folder / "out" / "candidates.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file, delimiter=";"))
    assert [row["motor"] for row in rows] == [each["motor"] for each in sizing["candidates"]]
    assert [row["reason"] for row in rows] == [each["reason"] for each in sizing["candidates"]]
    for name, check in checks.items():
        assert float(rows[0][f"{name}.utilisation"]) == check["utilisation"]["value"]
    motor = "SizingResult/MainComponent"
    for name, check in (("MaxTorque", "peak_torque"), ("MaxThermal", "temperature")):
        share = checks[check]["utilisation"]["value"]
        assert value_of(data, f"{motor}/{name}UtilizationPercentage") == pytest.approx(
            100.0 * share, rel=1e-12
        )
    ratio = value_of(data, "SizingResult/OverallSystem/MassInertiaRatio")
    assert ratio == pytest.approx(checks["inertia"]["value"]["value"], rel=1e-3)
    assert value_of(data, "SizingProjectInformation/SizingProjectName") == "Quarry"
    assert value_of(data, "SizingProjectInformation/DateCreated") == "2026-03-01T00:00:00+00:00"
    gear = value_of(data, f"{motor}02/ManufacturerProductDesignation")
    assert f"ratio {sizing['candidates'][0]['ratio']['value']:.6g}" in gear


def test_order_numbers_of_catalogues_are_handed_over(tmp_path):
    """Motor, gear and both couplings are rows of catalogues, and have the order numbers of these rows; without one
    there, nothing is written."""
    example = LINKAGES.parent / "own_catalogue.toml"
    text = example.read_text("utf-8").replace('"catalogue/', f'"{example.parent.as_posix()}/catalogue/')
    (tmp_path / "own.toml").write_text(f'static_inertia_runs = "never"\n{text}', "utf-8")
    done = chainunit("study", "own.toml", "-o", "results", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    save(tmp_path / "results", tmp_path / "out", aasx=False)
    said = json.loads((tmp_path / "out" / "handover.json").read_text("utf-8"))
    rows = {}
    for file in ("motors", "gears", "torque_limiters", "flexible_couplings"):
        with (example.parent / "catalogue" / f"{file}.csv").open(newline="", encoding="utf-8") as table:
            rows |= {row["designation"]: row["order_number"] for row in csv.DictReader(table)}
    parts = {"motor": "MainComponent", "gear": "MainComponent02", "torque limiter": "OtherComponent"}
    chosen = {each["part"]: each["designation"] for each in numbers(tmp_path)["sizing"]["parts"]["parts"]}
    assert chosen.keys() == parts.keys()
    flexible = numbers(tmp_path)["checks"]["flexible_coupling"]["candidates"][0]["designation"]
    parts["flexible coupling"], chosen["flexible coupling"] = "OtherComponent02", flexible
    for kind, element in parts.items():
        at = f"SizingResult/{element}"
        assert said["said"][f"{at}/ManufacturerOrderCode"]["value"] == rows[chosen[kind]] != ""
        assert chosen[kind] in said["said"][f"{at}/ManufacturerProductDesignation"]["value"]
        assert f"{at}/ManufacturerOrderCode" not in said["open"]
    own, _ = read_by_basyx(tmp_path / "out" / "sizing.json")
    path = f"{ROOT}/SizingResult/OtherComponent/ManufacturerOrderCode"
    codes = [each.value for name, each in walked(own.submodel_element) if name == path]
    assert codes == [rows[chosen["torque limiter"]], rows[flexible]]
    spoilt = numbers(tmp_path)
    spoilt["sizing"]["parts"]["parts"][1]["order_number"] = ""
    (tmp_path / "results" / "result.json").write_text(json.dumps(spoilt), "utf-8")
    save(tmp_path / "results", tmp_path / "other", aasx=False)
    data = json.loads((tmp_path / "other" / "handover.json").read_text("utf-8"))
    assert "SizingResult/MainComponent02/ManufacturerOrderCode" in data["open"]
    assert "SizingResult/MainComponent/ManufacturerOrderCode" not in data["open"]


def test_the_hours_of_the_usage_are_handed_over(folder):
    """Known with a table [usage] alone; half an hour is no whole number of the template, and stands beside it."""
    data = json.loads((folder / "out" / "handover.json").read_text("utf-8"))
    profile = "ApplicationRequirements/UsageProfile"
    names = [f"{profile}/OperatingHoursPerDay", f"{profile}/OperatingDaysPerYear"]
    if "usage" not in numbers(folder):
        assert set(names) <= set(data["open"])
        return
    assert [value_of(data, name) for name in names] == [7.5, 220.0] and not set(names) & set(data["open"])
    own, _ = read_by_basyx(folder / "out" / "sizing.json")
    hours, days = (next(x for p, x in walked(own.submodel_element) if p == f"{ROOT}/{n}") for n in names)
    assert days.value == 220 and hours.value is None
    assert [float(each.value) for each in hours.extension] == [7.5]


def test_a_long_text_is_cut_at_a_word():
    text = "word " * 400
    (own,) = environment({"SizingResult": {"TextStatement": text}}, "", "")["submodels"]
    (statement,) = own["submodelElements"][0]["value"]
    cut = statement["value"][0]["text"]
    assert len(cut) <= LONGEST and cut.endswith("word...") and text.startswith(cut.removesuffix("..."))


def test_what_nobody_knows_has_no_value(folder):
    data = json.loads((folder / "out" / "handover.json").read_text("utf-8"))
    assert {"SizingProjectInformation/ClientName", "SizingResult/MainComponent/ManufacturerOrderCode"} <= set(
        data["open"]
    )
    assert not any("TransformationMechanism" in name for name in data["said"])
    assert "TransformationMechanism/RotraryTable/CentroidAngle" in data["absent"]
    own = json.loads((folder / "out" / "sizing.json").read_text("utf-8"))["submodels"][0]
    client = own["submodelElements"][0]["value"][0]
    assert client["idShort"] == "ClientName" and "value" not in client


def test_a_whole_number_stands_only_where_it_is_near(folder):
    own, _ = read_by_basyx(folder / "out" / "sizing.json")
    data = json.loads((folder / "out" / "handover.json").read_text("utf-8"))["said"]
    seen = {False: 0, True: 0}
    for path, each in walked(own.submodel_element):
        if type(each).__name__ != "Property" or elements()[path].value_type not in ("xs:long", "xs:integer"):
            continue
        exact = [float(extension.value) for extension in each.extension]
        if exact:
            assert exact[0] == pytest.approx(
                next(
                    x["value"]
                    for n, x in data.items()
                    if n.startswith(path.removeprefix(f"{ROOT}/").rsplit("/", 1)[0])
                    and n.endswith(each.id_short)
                    and math.isclose(x["value"], exact[0], rel_tol=1e-8)
                ),
                rel=1e-8,
            )
            has_value = each.value is not None
            assert has_value == math.isclose(round(exact[0]), exact[0], rel_tol=0.005)
            assert not has_value or each.value == round(exact[0])
            seen[has_value] += 1
    assert seen[False] and seen[True]


@pytest.fixture
def results(folder, tmp_path):
    """A copy of the results of a study, whose files may be spoilt."""
    for name in ("result.json", "result.nc", "load_cycle.csv"):
        (tmp_path / name).write_bytes((folder / "results" / name).read_bytes())
    return tmp_path


def refused(results, aasx=False):
    with pytest.raises(InputError) as caught:
        hand_over(HandoverQuestion(results, aasx))
    return str(caught.value)


@only("knife")
def test_wrong_results_are_refused(results):
    cycle = (results / "load_cycle.csv").read_text().splitlines()
    spoilt = [cycle[0], *(",".join([*row.split(",")[:2], "1", row.split(",")[3]]) for row in cycle[1:])]
    (results / "load_cycle.csv").write_text("\n".join(spoilt))
    assert "are not of the same run; run the study again" in refused(results)
    (results / "load_cycle.csv").write_text("\n".join(x.rsplit(",", 1)[0] for x in cycle))
    assert "which has four columns" in refused(results)
    (results / "load_cycle.csv").unlink()
    assert "makes no whole turn in steady running" in refused(results)
    data = json.loads((results / "result.json").read_text())
    (results / "result.json").write_text(json.dumps(data | {"status": "failed: no"}))
    assert "is not complete (failed: no)" in refused(results)


@only("knife")
def test_a_study_without_a_title_begins_its_sentence(results):
    save(results, results / "out", aasx=False)
    assert "\nBy the names of IDTA 02021-1-0-1" in (results / "out" / "handover.md").read_text("utf-8")


@only("knife")
def test_an_earlier_result_is_refused(results):
    import xarray as xr

    run = xr.load_dataset(results / "result.nc", group="start_up")
    del run.attrs["steady_begin"]
    run.to_netcdf(results / "result.nc", group="start_up", mode="w")
    assert "an earlier version wrote it; run the study again" in refused(results)
    (results / "result.nc").write_bytes(b"no")
    assert "cannot be read" in refused(results)


@only("knife")
def test_an_aasx_without_basyx_names_the_extra(results, monkeypatch):
    monkeypatch.setitem(sys.modules, "basyx.aas.adapter", None)
    assert "needs basyx-python-sdk: pip install 'chainunit[aas]'" in refused(results, aasx=True)
    done = chainunit("handover", ".", "-o", "out", cwd=results)
    assert done.returncode == 2 and "--no-aasx" in done.stderr and not (results / "out").exists()
    done = chainunit("handover", ".", "--no-aasx", "-o", "out", cwd=results)
    assert done.returncode == 0, done.stderr
    assert (results / "out" / "sizing.json").exists() and not (results / "out" / "sizing.aasx").exists()
    (results / "a.aasx").write_bytes(b"no")
    with pytest.raises(InputError, match="reading an AASX needs basyx-python-sdk"):
        read_cycle(results / "a.aasx")


@only("knife")
def test_files_that_are_no_cycle_are_refused(results):
    written = save(results, results / "out", aasx=False)
    assert {file.name for file in written} >= {"sizing.json", "cycle.csv", "run.csv", "report.html"}
    out = results / "out"
    shell = json.loads((out / "sizing.json").read_text("utf-8"))
    with pytest.raises(
        InputError, match="has no motion section nothing; it has RotativeSection, RotativeSection02"
    ):
        read_cycle(out / "sizing.json", "nothing")
    for content, words in (
        ("no", "is no JSON"),
        ("[]", "is no asset administration shell"),
        (json.dumps(shell | {"submodels": []}), f"has no submodel {ROOT}"),
    ):
        (results / "x.json").write_text(content)
        with pytest.raises(InputError, match=words):
            read_cycle(results / "x.json")
    rows = (out / "cycle.csv").read_text("utf-8").splitlines()
    for content, words in (
        (rows[1:], "the first line of the motion section must be Time"),
        (rows[:2], "at least two rows of finite numbers"),
        ([*rows[:5], rows[5].replace(";", ";x", 1)], "x"),
        ([*rows[:5], "nan;nan;nan;nan;nan"], "finite"),
        ([rows[0], *rows[5:1:-1]], r"x\.csv: the time runs backwards, from"),
    ):
        (results / "x.csv").write_text("\n".join(content), "utf-8")
        with pytest.raises(InputError, match=words):
            read_cycle(results / "x.csv")
    with pytest.raises(InputError, match="cannot be read"):
        read_cycle(results / "missing.csv")
    wrong = [
        "a\n1,2\n",
        "a\n1,2,3,x\n",
        "a\n1,2,3,4\n1,2\n",
        "",
        "a\n1,2,3,4\n2,3,4,nan\n",
        "a\n2,2,3,4\n1,2,3,4\n",
    ]
    for content in wrong:
        (out / "load_cycle.csv").write_text(content, "utf-8")
        with pytest.raises(InputError, match=r"load_cycle\.csv: must have four columns of numbers"):
            read_cycle(out / "sizing.json")
    (out / "cycle.csv").unlink()
    with pytest.raises(InputError, match=r"cannot be read.*names it"):
        read_cycle(out / "sizing.json")


def test_the_columns_are_named_in_the_shell(folder):
    own, _ = read_by_basyx(folder / "out" / "sizing.json")
    heads = (folder / "out" / "cycle.csv").read_text("utf-8").splitlines()[0]
    assert (
        heads
        == "Time [s];AngularPosition [rad];AngularVelocity [rad/s];AngularAcceleration [rad/s²];LoadTorque [Nm]"
    )
    metadata = [path for path, _ in walked(own.submodel_element) if path.startswith(f"{SECTION}/Metadata")]
    assert [path.rsplit("/", 1)[1] for path in metadata[1:6]] == [
        head.split(" ")[0] for head in heads.split(";")
    ]


@pytest.mark.parametrize("kind", ["MultiLanguageProperty", "Property"])
def test_a_text_that_is_empty_is_an_element_without_a_value(kind):
    """As a result without its motor has it: the metamodel has no empty text, and its reader stopped there."""
    template = next(each for each in elements().values() if each.type == kind)
    assert "value" not in _element(template, "Name", "", "")
    assert _element(template, "Name", "", "") == _element(template, "Name", None, "")
