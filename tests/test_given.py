"""The given values of a study, and their origins."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import math
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from records import changed, record_of
from reports import at, report_of
from test_foreign_machine import MACHINE, SCRIPT
from test_foreign_machine import STUDY as PUMP
from test_foreign_system import build

from chainunit.core.errors import InputError
from chainunit.core.quantities import Layout
from chainunit.reading.result_entries import ResultEntries
from chainunit.report import blocks, html
from chainunit.report.sheet import sheet
from chainunit.report.study import report
from chainunit.study import remarks
from chainunit.study.catalogue_drive import with_inertia
from chainunit.study.choice import choose
from chainunit.study.config import load, parse
from chainunit.study.given import given_sections, origin_of
from chainunit.study.measures import Answers
from chainunit.study.package import remarks_on_export
from chainunit.study.parts import example
from chainunit.study.remarks import conclude, lengths_of_example
from chainunit.study.result import as_dict
from chainunit.study.run import run_study

KNIFE = example("knife")


def study_of(config, folder):
    """The study before its first run."""
    choice = choose(config, folder, lambda *_: None)
    study = record_of(config, choice.drive, choice.proposal)
    conclude(study)
    return study


def drive_of(study, folder):
    return choose(study, folder, lambda *_: None).drive


def test_the_motor_is_shown_as_it_is_and_turns_with_gear_and_flywheel(tmp_path):
    """Its FMU has all inertia on its shaft."""
    study = parse(KNIFE.replace("[gear]\n", "[gear]\nJ = 0.003\n"))
    assert study.drive.gear.J == 0.003 and study.drive.flywheel.J > 0.0
    drive, plate = drive_of(study, tmp_path), study.plate.model()[1].rotor
    assert (drive.parameters.rotor.J, drive.parameters.rotor.d) == (plate.J, plate.d)
    whole = plate.J + 0.003 + study.drive.flywheel.J
    assert drive.fmu_parameters.rotor.J == drive.rotor_inertia == pytest.approx(whole, rel=1e-12)
    assert drive.fmu_parameters.rotor.d == plate.d
    assert drive.fmu_parameters.gear.loss == pytest.approx(1.0 / study.drive.gear.efficiency - 1.0)
    assert drive.graph.components["motor"].start["rotor.J"] == pytest.approx(whole, rel=1e-12)


def test_values_of_a_motor_of_the_catalogue_are_the_catalogues(tmp_path):
    origin = partial(origin_of, study_of(parse(KNIFE), tmp_path).setup)
    assert origin("motor.rotor.J") == origin("motor.stator.R") == origin("machine.ratio") == "catalogue"
    assert origin("machine.r") == "file" and origin("motor.ambient.T") == "declared"
    assert origin("motor.w_start") == "declared"
    soft = KNIFE.replace("[system]", 'start = "inverter"\n[starter.inverter]\nramp = 2\n[system]')
    soft = soft.replace("[gear]\n", "[gear]\nratio = 25\n")
    origin = partial(origin_of, study_of(parse(soft), tmp_path).setup)
    assert origin("machine.ratio") == origin("motor.inverter.on") == "file"
    assert origin("motor.inverter.slip") == origin("starter.inverter.slip") == "catalogue"
    # the supply is what `start` says, and no other key
    with pytest.raises(InputError, match=r"starter\.inverter\.on"):
        parse(soft.replace("ramp = 2", "ramp = 2\non = 0"))
    # of the example, where the file leaves the system out
    origin = partial(
        origin_of, study_of(parse("[system]\nmachine = 'KnifeDrive'\n[run]\ncrank_speed = 4"), tmp_path).setup
    )
    assert origin("motor.rotor.J") == "catalogue"
    assert origin("machine.r") == origin("flywheel.J") == "example" and origin("run.crank_speed") == "file"


def test_the_slip_compensation_that_is_used_is_shown(tmp_path):
    """That of the rated slip; none with a flywheel, against which it works. The file may give either: 0 as well."""
    bare = KNIFE[: KNIFE.index("[flywheel]")] + KNIFE[KNIFE.index("[run]") :]
    plate = parse(KNIFE).plate.nameplate
    rated = (plate.synchronous - plate.speed) * plate.poles / (4.0 * math.pi) / plate.torque
    for text, given, used in (
        (KNIFE, None, 0.0),
        (bare, None, rated),
        (KNIFE, "0.3 Hz/(N m)", 0.3),
        (bare, "0 Hz/(N m)", 0.0),
    ):
        more = f'[starter.inverter]\nslip = "{given}"\n' if given else ""
        config = parse(f'start = "inverter"\n{text}\n{more}')
        choice = choose(config, tmp_path, lambda *_: None)
        drive = choice.drive
        study = changed(study_of(config, tmp_path), config=dataclasses.replace(config, drive=choice.tables))
        result = as_dict(study)
        assert drive.parameters.inverter.slip == pytest.approx(used, rel=1e-12)
        assert result["motor"]["inverter.slip"]["value"] == drive.parameters.inverter.slip
        assert result["starter"]["inverter.slip"]["value"] == drive.parameters.inverter.slip
        assert origin_of(study.setup, "starter.inverter.slip") == ("file" if given else "catalogue")
        # a flywheel that a comparison adds has the setting of a drive with one
        wheel = with_inertia(config.drive, drive, 0.1)
        assert wheel.added_inertia == 0.1 and wheel.parameters.inverter.slip == (used if given else 0.0)
        (note,) = [
            remark.text for remark in study.findings.remarks if "slip-compensation" in remark.code
        ] or [""]
        assert ("rated slip" in note) == (not given and used > 0.0)
        assert ("flywheel has to slow down" in note) == (not given and used == 0.0)


def test_the_ratio_is_shown_that_is_used(tmp_path):
    """Without one of its own, the gear has the ratio at which the crank has its speed: no start value beside it."""

    def shown(text):
        return {name for section in given_sections(study_of(parse(text), tmp_path)) for name in section.names}

    assert "gear.ratio" not in shown(KNIFE) and {"machine.ratio", "gear.efficiency"} <= shown(KNIFE)
    result = as_dict(study_of(parse(KNIFE), tmp_path))
    assert "ratio" not in result["gear"] and result["machine"]["ratio"]["value"] > 30.0
    assert "gear.ratio" in shown(KNIFE.replace("[gear]\n", "[gear]\nratio = 25\n"))


def test_what_no_example_gives_is_at_its_declared_start_value(tmp_path):
    study = study_of(parse("[run]\ncrank_speed = 2"), tmp_path)
    assert origin_of(study.setup, "machine.r") == origin_of(study.setup, "motor.rotor.J") == "example"
    assert (
        origin_of(study.setup, "event.jam_left.rise") == "declared"
        and origin_of(study.setup, "event.jam_left.force") == "example"
    )
    assert origin_of(study.setup, "motor.speed_control.kp") == "tuned"
    (note,) = (str(each) for each in study.findings.notes if each.code.startswith("assumed"))
    assert "come from the packaged example" in note
    (packaged,) = (
        str(each) for each in study_of(load(), tmp_path).findings.notes if each.code.startswith("assumed")
    )
    assert "the papers print none" in packaged
    # of a machine of somebody else there is no example
    build(tmp_path, script=SCRIPT)
    study = study_of(parse(PUMP + MACHINE, str(tmp_path / "x.toml")), tmp_path)
    assert origin_of(study.setup, "machine.throw") == origin_of(study.setup, "motor.rotor.J") == "declared"
    assert origin_of(study.setup, "machine.piston.mass") == "file"
    (note,) = (str(each) for each in study.findings.notes if each.code.startswith("assumed"))
    assert "example" not in note and "An eccentric pump" in note
    assert "machine.throw" not in as_dict(study)["origins"]


LINKAGE_STUDY = """
[machine]
linkage = "press.toml"
[run]
crank_speed = 6
[machine.pins]
friction = 0.1
"""


def test_a_value_of_the_linkage_file_is_no_assumption(tmp_path):
    """Its origin is that file and the line there; that of the study file has its line, too; the rest is a default."""
    linkage = (Path(__file__).parents[1] / "examples" / "linkages" / "slider_crank_press.toml").read_text(
        "utf-8"
    )
    (tmp_path / "press.toml").write_text(linkage, "utf-8")
    study = study_of(parse(LINKAGE_STUDY, str(tmp_path / "own.toml")), tmp_path)
    result, lines = as_dict(study), linkage.splitlines()
    for name, key in (
        ("machine.ram.mass", "mass = "),
        ("machine.r", "r = "),
        ("feed.press_force", "press_force = "),
    ):
        assert result["origins"][name] == "linkage"
        file, line = result["places"][name].split(", line ")
        assert file == "press.toml" and lines[int(line) - 1].startswith(key)
    assert result["origins"]["machine.pins.friction"] == "file"
    assert result["places"]["machine.pins.friction"] == "own.toml, line 7"
    assert result["places"]["run.crank_speed"] == "own.toml, line 5"
    assert "machine.g" not in result["origins"] and "machine.g" not in result["places"]
    page = html.render(report(study, result))
    assert (
        f'<abbr class="from" title="the linkage file&#x27;s">{result["places"]["machine.r"]}</abbr>' in page
    )
    on_sheet = {
        value.name
        for section in sheet(study, report(study, result)).sections
        for block in section.blocks
        if isinstance(block, blocks.Given)
        for _, values in block.sections
        for value in values
    }
    assert "machine.g" in on_sheet and not on_sheet & {"machine.ram.mass", "machine.r", "feed.press_force"}


ALL = """
empty_start = true
simulation = "me"
start = "soft"
[system]
motor = "IE3 4-pole 2.2 kW, 100L"
[run]
crank_speed = 2.5
[gear]
efficiency = 0.9
J = 0.004
[starter.soft_start]
voltage = 0.4
[flywheel]
J = 0.3
compare = [0.0, 1.0]
[coupling]
trip_torque = 1500
[monte_carlo]
runs = 20
event = { type = "jam", side = "left", force = ["1 kN", "3 kN"], duration = 0.2 }
[driveline]
damping_ratio = 0.02
place = "motor"
[[event]]
type = "jam"
side = "right"
force = "2.5 kN"
"""


def toml_of(result):
    """A study file by what a result says of its study, but for what follows from the rest."""
    lines = [f"title = {json.dumps(result['title'])}"]

    def text(value):
        return json.dumps(value["value"] if isinstance(value, dict) else value)

    def entry_of(name):
        table, _, inner = name.partition(".")
        for place in (name, f"{table}.asked.{inner}"):
            with contextlib.suppress(KeyError):
                return text(at(result, place))
        raise KeyError(name)

    lines += [
        f"{name} = {entry_of(name)}"
        for name, origin in result["origins"].items()
        if origin in ("file", "example") and name not in NOT_OF_A_FILE and not name.startswith("event.")
    ]
    for name, event in result["events"].items():
        lines += ["[[event]]", f'type = "{event["type"]}"', f'name = "{name}"']
        lines += [f'side = "{event["side"]}"'] if event["side"] else []
        lines += [f"{key} = {text(value)}" for key, value in result["event"][name].items()]
    return "\n".join(lines)


NOT_OF_A_FILE = (
    "motor.inverter.on",
    "motor.inverter.slip",
    "motor.soft_start.voltage",
    "motor.soft_start.time",
)


@pytest.mark.parametrize(
    "text", [ALL, KNIFE, "[run]\ncrank_speed = 2", 'organ = "chain"\n[chain]\nrods = 12']
)
def test_a_study_can_be_repeated_from_its_result(text, tmp_path):
    study = study_of(parse(text), tmp_path)
    again = parse(toml_of(ResultEntries(json.loads(json.dumps(as_dict(study))))))
    for each in dataclasses.fields(again):
        if each.name not in ("file", "machine", "events", "plans"):
            assert getattr(again, each.name) == getattr(study.setup.config, each.name), each.name
    for name in ("catalogues", "labels", "is_packaged"):
        assert getattr(again.file, name) == getattr(study.setup.config.file, name), name
    assert again.machine.by_name == pytest.approx(study.setup.config.machine.by_name, rel=1e-12)
    for name, plan in study.setup.config.plans.items():
        event = getattr(plan, "event", None)
        if name == "random_overloads":
            assert again.plans[name].event.identity() == event.identity()
            assert again.plans[name].table == plan.table
        else:
            assert again.plans[name] == plan, name
    for name, event in study.setup.config.events.items():
        assert (again.events[name].p, again.events[name].side) == (event.p, event.side)


def test_the_page_shows_all_that_was_given_and_used(tmp_path):
    study = study_of(parse(ALL), tmp_path)
    (section,) = (each for each in report_of(study).sections if each.name == "given")
    rows = {value.name: value for _, values in section.blocks[0].sections for value in values}
    wanted = {"gear.J", "starter.soft_start.voltage", "flywheel.J", "flywheel.compare", "monte_carlo.runs"}
    wanted |= {"monte_carlo.event.force", "monte_carlo.event.type", "start", "empty_start", "simulation"}
    wanted |= {"feed_forward", "system.machine", "system.motor", "driveline.place", "driveline.damping_ratio"}
    wanted |= {"organ", "event.jam_right.force", "coupling.trip_torque", "machine.ratio", "motor.rotor.J"}
    assert wanted <= set(rows)
    assert rows["gear.J"].origin == "file" and rows["system.machine"].origin == "declared"
    assert rows["motor.rotor.J"].origin == "catalogue"
    assert not [name for name in rows if name.startswith(("chain.", "sizing.", "ratios."))]
    names = [name for each in given_sections(study) for name in each.names]
    assert len(names) == len(set(names))
    # what a DC motor of the file's own does not use
    plain = {name for each in given_sections(study_of(parse(""), tmp_path)) for name in each.names}
    assert not [name for name in plain if name.startswith(("gear.", "starter.", "monte_carlo.", "start"))]


def test_a_current_that_an_inverter_hardly_gives_has_a_note(tmp_path):
    """The inverter is ordered by the currents of all runs: 4.5 times the rated one takes one of 3 times that."""
    none = {v.name: None for v in Layout(Answers).variables}
    for start, currents, noted in (
        ("inverter", (1.2, 4.5), ("jam_left",)),
        ("inverter", (1.2, 1.4), ()),
        ("direct", (1.2, 4.5), ()),
    ):
        study = study_of(parse(KNIFE.replace("[system]", f'start = "{start}"\n[system]')), tmp_path)
        rated = study.setup.drive.rated_current
        for name, times in zip(("steady", "jam_left"), currents, strict=True):
            study.runs.answers[name] = Answers(**none | {"current_peak": times * rated})
        remarks._on_inverter(study)
        notes = [remark for remark in study.findings.remarks if remark.code.startswith("inverter-")]
        assert len(notes) == len(noted)
        if noted:
            assert "(4.50)" in notes[0].text and "(1.20)" in notes[0].text
            assert notes[0].quantities["current"][:2] == (pytest.approx(3.0 * rated), "A")


def test_lengths_beside_those_of_the_example_are_named(tmp_path):
    """r, l and z of a mill made a rocker that swung from -33 to -15 deg, as c stayed the example's: in silence."""
    file = tmp_path / "mine.toml"
    file.write_text('[machine]\nr = "140 mm"\nl = "1.1 m"\nz = "0.95 m"\n', "utf-8")
    config = load(file)
    remark = lengths_of_example(config.file.given, bool(config.machine.model.sides))
    assert remark.text.startswith(
        "The file gives the lengths r, l, z of the chain unit. The lengths h, c, hy, e, l1, l2 come"
    )
    assert remark.remedy.startswith("Give them, too, or rho = r/l")
    assert remark.text in remarks_on_export(config)
    file.write_text('[ratios]\nrho = 0.127\nl = "1.1 m"\n', "utf-8")
    for config in (load(file), load(None)):
        assert lengths_of_example(config.file.given, bool(config.machine.model.sides)) is None


@pytest.mark.second
def test_the_loss_of_the_gear_of_an_own_motor_is_in_its_report(tmp_path):
    """With [motor] gear.loss the FMU lost it, and the report knew of none; by the balance of the rotor."""
    study = run_study(parse("event = []\n[motor]\ngear.loss = 0.25\n"), tmp_path)
    run, p = study.runs.steady, study.setup.drive.fmu_parameters
    time = run["time"].values
    w, air_gap, load = (run[f"motor.{name}"].values for name in ("w", "air_gap_tau", "tau"))
    power = (air_gap - p.rotor.d * w - load) * w
    lost = np.trapezoid(power, time) / np.ptp(time)
    found = study.findings.by_analysis["gear_loss"]
    assert found.loss.whole == pytest.approx(lost, rel=1e-4) and found.efficiency == pytest.approx(
        0.8, rel=1e-12
    )
    (said,) = [remark for remark in study.findings.notes if remark.code == "gear-loss"]
    assert said.quantities["total"].value == found.loss.whole > 1.0
