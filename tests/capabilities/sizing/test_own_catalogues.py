"""Sizing with catalogues of one's own: gears by rows, the lowest price, order numbers, and what a gear may carry."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from command import chainunit
from event_tables import HEAVY_TABLES
from records import like
from sizings import sized_by

from chainunit.capabilities.handover.tables import candidates_csv, checks_csv
from chainunit.capabilities.sizing import findings
from chainunit.capabilities.sizing.candidate import Candidate, Criterion, Standing, TrialResult
from chainunit.capabilities.sizing.gear_order import GearLoad, GearOrder
from chainunit.capabilities.sizing.gear_rows import (
    gear_checks,
    helps,
    rows_for,
    spent,
    stronger,
    unknown_limits,
)
from chainunit.capabilities.sizing.parts import coupling_for
from chainunit.capabilities.sizing.preference import order_words, rank
from chainunit.core.errors import InputError
from chainunit.drives.catalogue import catalogue, offer
from chainunit.drives.gearing import ordered_torque
from chainunit.reading.result_entries import ResultEntries
from chainunit.reading.results import as_data
from chainunit.study.catalogue_drive import catalogue_drive
from chainunit.study.config import load, parse
from chainunit.study.cycle import cycle
from chainunit.study.limits import Check
from chainunit.study.rig import Rig

pytestmark = pytest.mark.slow

EXAMPLE = Path(__file__).parents[3] / "examples" / "own_catalogue.toml"

_COLUMNS = "ratio,rated_torque [N.m],efficiency,J [kg.m2],thermal_power [W],overhung_load [N],price"
GEARS = f"""designation,order_number,{_COLUMNS}
small,G-1,51,200,0.94,0.0001,,,100
middle,G-2,51.4,500,0.94,0.0002,3000,6000,200
large,G-3,50.8,900,0.96,0.0004,6000,9000,
far,G-4,80,900,0.94,0.0004,6000,9000,50
"""

MACHINE = f"""
event = []
catalogue = ["gears.csv"]
start = "soft"{HEAVY_TABLES}[sizing]
candidates = 1
poles_least = 4
poles_most = 4
"""


def gears_of(folder, text=GEARS):
    (folder / "gears.csv").write_text(text, encoding="utf-8")
    return {gear.designation: gear for gear in offer(folder / "gears.csv").gears}


def study_of(folder, text=MACHINE, gears=GEARS):
    gears_of(folder, gears)
    return parse(text, str(folder / "study.toml"))


# -- rows


def test_gears_with_the_ratio_come_by_size_or_by_price(tmp_path):
    gears = [*gears_of(tmp_path).values()]

    def names(ratio, objective="preference"):
        return [gear.designation for gear in rows_for(gears, ratio, 0.025, objective)]

    assert names(51.1) == ["small", "middle", "large"]
    assert names(51.1, "price") == ["small", "middle", "large"]  # without a price at the end
    assert names(50.0) == ["small", "large"]  # 51.4 is 2.7 % off
    assert names(75.0) == ["far"]  # none is near: the nearest
    assert stronger(gears, gears[0], 600.0).designation == "large"
    assert stronger(gears, gears[0], 1000.0) is None
    assert unknown_limits(gears[0]) == ["thermal rating", "permitted overhung load", "largest speed"]
    assert unknown_limits(gears[1]) == ["largest speed"]


def drive_with(folder, gear):
    """The first motor with that gear, and its candidate."""
    config = study_of(folder)
    turn = cycle(config.machine, config.run.crank_speed, config.feed)
    motor = next(m for m in catalogue() if m.nameplate.poles == 4.0)
    return Candidate(motor, catalogue_drive(config.drive, config.machine, turn, motor), sold=gear, margin=0.1)


def with_checks(c, **values):
    """The candidate whose checks have these utilisations."""
    checks = {name: Check(name, value, 1.0, "1") for name, value in values.items()}
    return dataclasses.replace(c, trial=TrialResult(checks=checks))


def test_a_gear_is_ruled_out_by_the_runs_with_another_one(tmp_path):
    """The values are those of the runs, the limits its own; a gear that may carry them is tried itself."""
    gears = gears_of(tmp_path)
    c = drive_with(tmp_path, gears["small"])
    checks = {
        "gear": Check("torque", 600.0, 200.0, "N.m"),
        "gear_start": Check("start", 700.0, 400.0, "N.m"),
        "start": Check("time", 1.0, 10.0, "s"),
    }
    tried = dataclasses.replace(c, trial=TrialResult(checks=checks), runs_with=None)
    other = spent(dataclasses.replace(c, sold=gears["middle"]), [tried])
    assert other.checks["gear"].utilisation == pytest.approx(600.0 / 500.0)
    assert other.checks["gear_start"].utilisation == pytest.approx(700.0 / 1000.0)
    assert other.checks["start"] == checks["start"] and other.runs_with == tried.gear
    rank([other], 2.0)
    assert "torque 600 N m, 120 % of the permitted 500 N m" in other.reason
    assert spent(dataclasses.replace(c, sold=gears["large"]), [tried]) is None
    # within the spread of inertia and losses it is tried itself
    near = dataclasses.replace(
        tried, trial=TrialResult(checks={"gear": Check("torque", 520.0, 200.0, "N.m")})
    )
    assert spent(dataclasses.replace(c, sold=gears["middle"]), [near]) is None


def test_another_gear_helps_a_motor_that_is_too_weak_only_by_its_efficiency(tmp_path):
    gears = gears_of(tmp_path)
    c = drive_with(tmp_path, gears["middle"])
    weak = with_checks(c, rms_torque=1.2, gear=0.5)
    assert not helps(gears["small"], [weak]) and helps(gears["large"], [weak])
    assert helps(gears["small"], [with_checks(c, rms_torque=1.2, gear=0.95)])
    assert helps(gears["small"], [])


# -- a sized drive


@pytest.fixture(scope="module")
def sized(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sized")
    return study_of(folder), sized_by(study_of(folder), folder)


def test_the_smallest_gear_that_carries_is_chosen_and_the_others_are_rejected_with_numbers(sized):
    _, found = sized
    best = found.chosen_candidate
    assert best.sold.designation == "middle" and best.ratio == 51.4 and best.series == "catalogue"
    assert best.gear == "middle" and best.worst_start
    rejected = [c for c in found.candidates if c.motor == best.motor and c is not best]
    (small,) = rejected
    assert small.sold.designation == "small" and small.verdict is Standing.REJECTED
    over = {name for name, check in small.checks.items() if check.over}
    assert over and over <= {"gear", "gear_start", "gear_service"}
    # the data of the reason: value, limit and utilisation of each check
    data = as_data(small)["checks"]["gear"]
    assert data["utilisation"]["value"] == pytest.approx(data["value"]["value"] / data["limit"]["value"])
    assert data["limit"]["value"] == 200.0
    assert not any(c.sold.designation == "far" for c in found.candidates)


def test_inertia_and_loss_of_the_row_take_part_in_the_computation(sized):
    """The energy balance of the rotor over a turn: what the motor gives in the air gap and neither its friction nor
    its inertia takes is the energy of the machine and (1/efficiency - 1) of it, in either direction."""
    config, found = sized
    drive, gear = found.best.drive, found.best.sold
    assert drive.gear.J == gear.data.J == 0.0002
    # the file gives no drag
    assert drive.gear.d == 0.0 and drive.gear.loss == pytest.approx(1.0 / 0.94 - 1.0)
    rig = Rig(config.operation, drive, None)
    with rig.from_rest() as simulation:
        simulation.run(8.0, rig.step)
        run = simulation.run(8.0 + config.operation.turn, rig.step)
    w, passed = run["motor.w"].values, run["motor.tau"].values * run["motor.w"].values
    rotor = drive.parameters.rotor
    J = rotor.J + gear.data.J + drive.added_inertia
    into_gear = run["motor.air_gap_tau"].values * w - rotor.d * w * w
    energy, lost, of_machine = (
        float(np.trapezoid(power, run["time"].values)) for power in (into_gear, np.abs(passed), passed)
    )
    assert np.min(passed) < 0.0 < of_machine
    energy -= 0.5 * J * (w[-1] ** 2 - w[0] ** 2)
    assert (energy - of_machine) / lost == pytest.approx(1.0 / 0.94 - 1.0, rel=1e-3)
    tables = found.proposal(config.drive).tables
    assert tables.gear.torque_limit == 500.0 and "gear.torque_limit" in tables.given
    assert tables.gear.efficiency == pytest.approx(0.94) and tables.gear.J == 0.0002


@pytest.mark.parametrize(("rated", "is_weak"), [(500.4, False), (500.1, True)])
def test_a_gear_that_just_carries_an_overload_is_not_too_weak(sized, monkeypatch, rated, is_weak):
    """The gear is judged by the torque that it has to carry, and told with the digits that part it from the gear."""
    _, found = sized
    load = GearLoad(1000.4, "an overload", 2.0)
    order = GearOrder(ordered_torque(load.rated), {"overload": load}, (), ordered_torque(load.rated))
    monkeypatch.setattr(findings, "gear_order", lambda *of: order)
    data = dataclasses.replace(found.best.sold.data, rated_torque=rated)
    best = dataclasses.replace(found.best, sold=dataclasses.replace(found.best.sold, data=data))
    study = like(insufficient="")
    listed = dataclasses.replace(found, candidates=[best]).parts(study, None)
    assert any("an overload takes one that permits 501 N m" in words for words in listed.open) == is_weak


def test_checks_of_thermal_rating_overhung_load_and_speed(sized):
    """Those whose limits the row has: the mean of |power|, and the reaction at O1, which is at least its weight."""
    _, found = sized
    checks = found.best.checks
    assert {"gear", "gear_start", "gear_thermal", "gear_overhung"} <= checks.keys()
    assert "gear_speed" not in checks
    assert (checks["gear_thermal"].limit, checks["gear_overhung"].limit) == (3000.0, 6000.0)
    assert checks["gear_overhung"].value > 160.0 * 9.81
    small = next(c for c in found.candidates if c.sold.designation == "small")
    assert not {"gear_thermal", "gear_overhung"} & small.checks.keys()


def test_the_thermal_rating_takes_the_power_of_either_direction(tmp_path, monkeypatch):
    """Power that swings to and fro heats the teeth though its mean is zero; cases count by their share of time."""
    from chainunit.capabilities.sizing import gear_rows

    gear = gears_of(tmp_path, GEARS.replace("overhung_load [N]", "largest_speed [rad/s]"))["middle"]
    angle = np.linspace(0.0, 2.0 * math.pi, 1001)
    swing, steady = 500.0 * np.sin(angle), np.full(1001, 100.0)
    monkeypatch.setattr(gear_rows, "shaft_power", lambda drive, run: run)
    running = [{"motor.w": SimpleNamespace(values=np.full(3, 150.0))}]
    checks = gear_checks(gear.rating, None, running, [(0.75, swing), (0.25, steady)])
    assert checks["gear_thermal"].value == pytest.approx(0.75 * 1000.0 / math.pi + 25.0, rel=1e-3)
    assert checks["gear_speed"].utilisation == pytest.approx(150.0 / 6000.0)


def test_with_bearings_of_its_own_the_crank_does_not_load_the_gear(tmp_path):
    text = MACHINE.replace("candidates = 1", "candidates = 1\nseparate_bearing = true")
    weak = GEARS.replace("3000,6000,200", "3000,60,200").replace("6000,9000", "6000,90")
    chosen = sized_by(study_of(tmp_path, text, weak), tmp_path).chosen_candidate
    assert chosen.sold.designation == "middle"
    # the checks of the study take its ratings
    assert chosen.drive.gear.rating == dataclasses.replace(chosen.sold.rating, overhung_load=0.0)


def test_an_overhung_load_beyond_the_permitted_one_rejects_a_gear(tmp_path):
    (tmp_path / "a").mkdir()
    weak = GEARS.replace("3000,6000,200", "3000,60,200")
    found = sized_by(study_of(tmp_path / "a", gears=weak), tmp_path)
    assert found.chosen_candidate.sold.designation == "large"
    middle = next(c for c in found.candidates if c.sold.designation == "middle")
    assert middle.verdict is Standing.REJECTED and "overhung load of the gear" in middle.reason


# -- the lowest price


def priced(folder, name, motor_price, gear, flywheel=0.0):
    c = drive_with(folder, gear)
    plate = dataclasses.replace(c.motor.nameplate, price=motor_price)
    drive = dataclasses.replace(c.drive, added_inertia=flywheel)
    motor = dataclasses.replace(c.motor, designation=name, nameplate=plate)
    return with_checks(dataclasses.replace(c, motor=motor, drive=drive), peak_torque=0.5)


def test_the_cheapest_that_fits_comes_first_and_drives_without_a_price_last(tmp_path):
    gears = gears_of(tmp_path)
    candidates = [
        priced(tmp_path, "dear", 900.0, gears["middle"]),
        priced(tmp_path, "unpriced", 0.0, gears["middle"]),
        priced(tmp_path, "on request", 100.0, gears["large"]),
        priced(tmp_path, "heavy", 100.0, gears["middle"], flywheel=0.1),
        priced(tmp_path, "cheap", 150.0, gears["middle"]),
        priced(tmp_path, "full", 10.0, gears["middle"]),
    ]
    candidates[-1] = with_checks(candidates[-1], peak_torque=0.95)
    rank(candidates, 2.0, "price")
    assert [c.motor.designation for c in candidates[:2]] == ["cheap", "dear"]
    assert candidates[0].reason.startswith("the cheapest that fits: 350 without a torque limiter;")
    reasons = {c.motor.designation: c.reason.split(";")[0] for c in candidates[1:]}
    assert reasons == {
        "dear": "dearer: 1100",
        "unpriced": "its motor has no price",
        "on request": "its gear has no price",
        "heavy": "its flywheel has no price",
        "full": "leaves less than the margin of 10 %",
    }
    assert all(c.criterion is Criterion.PRICE for c in candidates[1:] if c.motor.designation != "full")
    assert order_words(2.0, "price")[1].startswith("the price of motor and gear is lower")
    assert len(order_words(2.0, "price")) == len(order_words(2.0, "preference"))


def test_without_any_price_the_order_of_preference_decides(tmp_path):
    gears = gears_of(tmp_path)
    candidates = [priced(tmp_path, name, 0.0, gears["large"]) for name in ("b", "a")]
    rank(candidates, 2.0, "price")
    assert candidates[0].motor.designation == "a"
    assert candidates[0].reason.startswith("the first that fits, of drives of which none has a price")


# -- refusals


@pytest.mark.parametrize(
    ("key", "said"),
    [
        (
            "[gear]\ntorque_limit = 500",
            "gear.torque_limit: each gear of the catalogue has its own; leave it out",
        ),
        ("[gear]\nefficiency = 0.9", "gear.efficiency: each gear of the catalogue has its own"),
        (
            "[gear]\nratio = 60",
            "gear.ratio = 60: no gear of the catalogue has it; must be a ratio of the catalogue",
        ),
        (
            "gear_torque = 5000",
            "sizing.gear_torque = 5000 N m: no gear of the catalogue permits it; must be <= 900",
        ),
        ("ratios = [50]", "sizing.ratios: each gear of the catalogue has its own"),
        ('gear_kind = "worm"', "sizing.gear_kind: each gear of the catalogue has its own"),
    ],
)
def test_values_that_gears_of_a_catalogue_have_are_refused_beside_them(tmp_path, key, said):
    with pytest.raises(InputError) as refusal:
        study_of(tmp_path, MACHINE + key)
    assert said in str(refusal.value)


def test_without_gears_of_a_catalogue_a_demand_on_them_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"sizing\.gear_torque: is of gears of a catalogue"):
        sized_by(parse("[sizing]\ngear_torque = 100"), tmp_path)


def test_only_own_motors_need_some(tmp_path):
    config = study_of(tmp_path, MACHINE + "own_only = true")
    with pytest.raises(InputError, match=r"sizing\.own_only: the catalogues have no motor of their own"):
        sized_by(config, tmp_path)


def test_the_frequency_of_the_supply_chooses_the_motors(tmp_path):
    """All motors that are tried have it, their supply follows, and so does the ratio."""
    found = {}
    for hertz in (50, 60):
        keys = f'[sizing]\nfrequency = "{hertz} Hz"\ncandidates = 1\npoles_least = 4\npoles_most = 4'
        sizing = sized_by(parse(keys), tmp_path)
        assert {c.motor.nameplate.frequency for c in sizing.candidates} == {hertz}
        supply = sizing.best.drive.parameters.supply
        assert (supply.V, supply.f) == ((460.0, 60.0) if hertz == 60 else (400.0, 50.0))
        found[hertz] = sizing.best.drive.ratio
    assert 1.1 < found[60] / found[50] < 1.35


def test_a_frequency_of_no_motor_is_refused(tmp_path):
    words = r'sizing\.frequency = 16\.7 Hz: the catalogue has no such motor .* must be "50 Hz" or "60 Hz"'
    with pytest.raises(InputError, match=words):
        sized_by(parse('[sizing]\nfrequency = "16.7 Hz"'), tmp_path)


def test_a_catalogue_whose_ratios_keep_no_speed_is_refused(tmp_path):
    (far,) = (line for line in GEARS.splitlines() if line.startswith("far"))
    config = study_of(tmp_path, gears=f"{GEARS.splitlines()[0]}\n{far}\n")
    words = r"catalogue: no ratio on offer brings the crank to 3\.00 rad/s .* nearest on offer is 80"
    with pytest.raises(InputError, match=words):
        sized_by(config, tmp_path)


# -- couplings, order numbers, files


def test_the_cheapest_coupling_that_can_be_set_so_is_taken(tmp_path):
    file = tmp_path / "couplings.csv"
    head = "designation,setting_least [N.m],setting_most [N.m],largest_speed [rev/min],price\n"
    file.write_text(f"{head}a,5,20,,300\nb,5,40,,200\nc,5,20,1000,100\nd,30,60,,50\ne,5,20,,\n")
    couplings = offer(file).couplings
    assert coupling_for(couplings, 10.0, 150.0).designation == "b"
    assert coupling_for(couplings, 10.0, 100.0).designation == "c"
    assert coupling_for(couplings, 50.0, 150.0).designation == "d"
    assert coupling_for(couplings, 70.0, 150.0) is None


def test_the_example_ends_in_a_list_of_parts(tmp_path):
    """Order number and price stand on the terminal, on the page, on the sheet's answer, in result.json and in the
    candidates as CSV."""
    done = chainunit("study", EXAMPLE, "-o", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    result = ResultEntries(json.loads((tmp_path / "out" / "result.json").read_text("utf-8")))
    listed = result["sizing"]["parts"]
    assert [each["part"] for each in listed["parts"]] == ["motor", "gear", "torque limiter"]
    best = result["sizing"]["candidates"][0]
    prices = [each["price"]["value"] for each in listed["parts"]]
    assert listed["total"]["value"] == sum(prices) and not listed["open"]
    assert best["total_price"]["value"] == sum(prices[:2])
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    text = " ".join(done.stdout.split())
    for each in listed["parts"]:
        assert each["order_number"] and each["order_number"] in text and each["order_number"] in page
        assert "made up" in each["source"]
    assert "Parts to order" in page and "drives with them come last" in page
    assert not any(each["motor"].startswith("IE3") for each in result["sizing"]["candidates"])
    cheaper = [
        c for c in result["sizing"]["candidates"] if (c["total_price"]["value"] or math.inf) < sum(prices[:2])
    ]
    assert all(c["verdict"] in ("rejected", "fits without margin") for c in cheaper)
    rows = list(csv.DictReader(io.StringIO(candidates_csv(result["sizing"]["candidates"])), delimiter=";"))
    first = rows[0]
    assert first["gear.order_number"] == listed["parts"][1]["order_number"]
    assert float(first["motor.price"]) == prices[0] and float(first["total_price"]) == sum(prices[:2])
    assert (
        float(first["gear_overhung.utilisation"]) == best["checks"]["gear_overhung"]["utilisation"]["value"]
    )


def test_no_cell_of_a_csv_is_a_formula():
    """A text of a catalogue that a program for tables would compute is a text there; numbers stay numbers."""
    formulas = ["=HYPERLINK(1)", "+1+1", "-2+3", "@SUM(A1)", "\t=1", "\r=1", " =1", "\uff1d1"]
    candidate = {
        "motor": formulas[0],
        "reason": formulas[3],
        "parts": [{"part": "motor", "designation": formulas[1], "order_number": formulas[2]}],
        "numbers": {"=a": {"value": -1.5, "unit": "N"}, "b": {"value": 2.0, "unit": "1"}},
    }
    row = next(csv.DictReader(io.StringIO(candidates_csv([candidate])), delimiter=";"))
    assert [row["motor"], row["motor.designation"], row["motor.order_number"]] == [
        f"'{x}" for x in formulas[:3]
    ]
    assert (row["'=a [N]"], row["b"], row["rank"]) == ("-1.5", "2.0", "1")
    text = checks_csv([{"of": each, "title": "a-b", "value": {"value": -3.0}} for each in formulas])
    rows = list(csv.DictReader(io.StringIO(text, newline=""), delimiter=";"))
    assert [each["of"] for each in rows] == [
        f"'{' '.join(each.splitlines())}".replace("\t", " ") for each in formulas
    ]
    assert {(each["title"], each["value"]) for each in rows} == {("a-b", "-3.0")}


def test_a_gear_that_an_overload_breaks_is_told_with_a_stronger_one(tmp_path):
    text = EXAMPLE.read_text("utf-8")
    line = next(each for each in text.splitlines() if each.startswith("gear_torque"))
    for name in ("motors", "gears", "torque_limiters", "flexible_couplings"):
        target = tmp_path / "catalogue" / f"{name}.csv"
        target.parent.mkdir(exist_ok=True)
        target.write_text((EXAMPLE.parent / "catalogue" / f"{name}.csv").read_text("utf-8"), encoding="utf-8")
    text = text.replace(line, "service_factor = 1")
    (tmp_path / "weak.toml").write_text(text, encoding="utf-8")
    chainunit("study", "weak.toml", "-o", "out", cwd=tmp_path)
    result = ResultEntries(json.loads((tmp_path / "out" / "result.json").read_text("utf-8")))
    (warning,) = [each["text"] for each in result["warnings"] if "carries it" in each["text"]]
    gear = result["sizing"]["candidates"][0]["parts"][1]["designation"]
    assert warning.startswith(
        f"The gear {gear} permits 450 N m in running and 900 N m in a start or an overload"
    )
    assert "of the catalogue does so; give sizing.gear_torque" in warning
    assert result["sizing"]["parts"]["open"][0].startswith("The gear is too weak: ")


def test_the_example_says_that_its_catalogues_are_made_up():
    assert "The catalogues beside this file are made up" in EXAMPLE.read_text("utf-8")
    config = load(EXAMPLE)
    found = offer(*config.file.catalogues)
    items = (*found.motors, *found.gears, *found.couplings, *found.flexible)
    assert all("made up" in item.source and item.order_number for item in items)
    assert any(gear.price is None for gear in found.gears)
