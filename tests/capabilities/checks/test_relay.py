"""The check of the thermal relay: the worked example of docs/checks.md, the bands of the classes, the directions, and
a study with a motor on the line."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from event_tables import event_line
from reports import at

from chainunit.capabilities.checks.relay import RelaySetting, check_relay, relay_findings, stall_heat
from chainunit.capabilities.checks.row import Checks
from chainunit.core.errors import InputError
from chainunit.reading.result_entries import ResultEntries
from chainunit.study.choice import drive_of
from chainunit.study.config import parse
from chainunit.study.measures import read_measure
from chainunit.study.relay import (
    CLASSES,
    protecting_class,
    relay_trip,
    stall_trip,
    start_seconds,
)
from chainunit.study.window import Phase, Window

DOCS = (Path(__file__).parents[3] / "docs" / "checks.md").read_text("utf-8")
BASE = {"setting": 20.0, "before": 16.0, "start_seconds": 1.890, "stall_current": 140.0, "stall_time": 12.0}
JAM = np.linspace(0.0, 10.0, 10_001), np.full(10_001, 120.0), 16.0


def checked(relay):
    checks = Checks()
    check_relay(checks, relay, {"jam": "a jam"})
    return checks


def used(trip_class="10", jam=JAM, **values):
    found = relay_findings(trip_class, RelaySetting(**BASE | values), {"jam": jam})
    return {row.title: row for row in checked(found).rows}


def test_the_example():
    for each in ("1.890 s <= 4 s, 47.3 %", "355.0 s", "5.921 s <= 12 s, 49.3 %", "8.123 s", "5.968 s"):
        assert each in DOCS, each
    time = np.linspace(0.0, 3.0, 30_001)
    seconds = start_seconds(time, np.where(time < 2.0, 140.0, 0.0), 20.0)
    assert seconds == pytest.approx(2.0 * (140.0 / 144.0) ** 2, rel=1e-3)
    rows = used(start_seconds=seconds)
    assert rows["start"].utilisation == pytest.approx(0.473, rel=0.01)
    assert rows["trip with the rotor locked"].value == pytest.approx(5.921, rel=0.01)
    assert rows["trip with the rotor locked"].utilisation == pytest.approx(0.493, rel=0.01)
    heat = rows["heat of the motor until the trip (a jam)"]
    assert heat.value == pytest.approx(5.968, rel=0.01) and heat.utilisation == pytest.approx(0.497, rel=0.01)


@pytest.mark.parametrize("of", CLASSES, ids=lambda each: each.name)
def test_the_slowest_relay_trips_at_the_end_of_its_band_and_is_an_ode(of):
    assert stall_trip(of, 5.0, 0.0, 36.0) == pytest.approx(of.longest, rel=1e-9)
    # the image by Euler's steps: T dx/dt = (I/(1.2 Ir))^2 - x
    T = of.longest / math.log(51.84 / (51.84 - 1.44))
    x, t, step = (4.0 / 6.0) ** 2, 0.0, of.longest / 50_000.0
    while x < 1.0:
        x, t = x + step / T * ((25.0 / 6.0) ** 2 - x), t + step
    assert stall_trip(of, 5.0, 4.0, 25.0) == pytest.approx(t, rel=1e-3)
    assert stall_trip(of, 5.0, 4.0, 5.99) is None


def test_a_jam_whose_end_is_not_simulated_goes_on_with_its_current():
    short = tuple(x[:2001] for x in JAM[:2])
    (long, cut) = (
        used(jam=jam)["heat of the motor until the trip (a jam)"].value for jam in (JAM, (*short, 16.0))
    )
    assert cut == pytest.approx(long, rel=1e-3)


@pytest.mark.parametrize(
    ("title", "name", "sign"),
    [
        ("start", "start_seconds", 1),
        ("start", "stall_time", 0),
        ("start", "before", 0),
        ("trip with the rotor locked", "setting", 1),
        ("trip with the rotor locked", "before", -1),
        ("trip with the rotor locked", "stall_current", -1),
        ("trip with the rotor locked", "stall_time", -1),
        ("heat of the motor until the trip (a jam)", "setting", 1),
        ("heat of the motor until the trip (a jam)", "stall_current", -1),
        ("heat of the motor until the trip (a jam)", "stall_time", -1),
    ],
)
def test_the_used_share_moves_in_the_right_direction(title, name, sign):
    shares = [used(**{name: BASE[name] * factor})[title].utilisation for factor in (1.0, 1.05, 1.15)]
    steps = np.diff(shares)
    assert np.all(sign * steps > 0.0) if sign else np.allclose(steps, 0.0)


def test_a_heavier_class_lets_more_of_the_start_through_and_trips_later():
    rows = [used(each.name) for each in CLASSES]
    starts = [each["start"].utilisation for each in rows]
    stalls = [each["trip with the rotor locked"].utilisation for each in rows]
    assert np.all(np.diff(starts) < 0.0) and np.all(np.diff(stalls) >= 0.0)


def test_the_classes_that_let_the_start_through_and_protect():
    def suitable(least=10, **values):
        return relay_findings("", RelaySetting(**BASE | values), {}, least)

    assert suitable().suitable == ("10A", "10", "20") and suitable().trip_class == "10"
    assert suitable(start_seconds=5.0).suitable == ("20",)
    # a start from another angle needs class 20
    assert suitable(least=20).suitable == ("20",) and suitable(least=20).trip_class == "20"
    assert suitable(stall_time=4.0).suitable == ()
    heaviest = suitable(least=40, start_seconds=10.0)
    assert heaviest.trip_class == "30" and not heaviest.suitable
    assert not {row.title: row.holds for row in checked(heaviest).rows}["start"]


def test_a_relay_that_running_trips_passes_no_check():
    """A motor of jaw crushers that never came to its speed: the relay trips at once, and no heat is counted."""
    found = relay_findings("20", RelaySetting(**BASE | {"before": 24.0}), {"jam": (*JAM[:2], 24.0)})
    assert not found.suitable and not found.events
    (start, running), (missing,) = checked(found).rows, checked(found).missing
    assert (running.title, running.holds, running.limit) == ("running", False, 21.0) and start.holds
    assert missing.why == "running alone trips it"
    assert used(before=20.9)["running"].holds and not used(before=21.1)["running"].holds


@pytest.mark.parametrize(
    ("least", "seconds", "stall_time", "trip_class"),
    [(10, 0.4, 12.0, 10), (10, 0.4, 5.9, 5), (10, 0.6, 5.9, 10), (10, 0.4, 2.0, 10), (20, 0.4, 5.9, 20)],
)
def test_a_class_that_trips_too_late_gives_way_to_one_that_passes(least, seconds, stall_time, trip_class):
    """Class 10 trips after 5.921 s in the example."""
    assert protecting_class(least, seconds, 20.0, 16.0, 140.0, stall_time) == trip_class
    rows = used(str(trip_class), start_seconds=seconds, stall_time=stall_time)
    assert rows["trip with the rotor locked"].holds == (stall_time == 12.0 or trip_class == 5)


def test_a_class_lets_a_motor_at_the_tolerance_of_its_current_start():
    """20 % more current heats a relay by 1.44: a start of 3 s takes class 20, if that trips in time."""
    assert (
        protecting_class(10, 2.7, 20.0, 16.0, 140.0, 12.0) == 10
    )  # 1.44 x 2.7 = 3.9 s of the 4 s of class 10
    assert protecting_class(10, 3.0, 20.0, 16.0, 140.0, 12.0) == 20
    assert protecting_class(10, 3.0, 20.0, 16.0, 140.0, 6.0) == 10  # class 20 trips after 11.8 s
    # neither class 10, after 5.9 s, nor class 20 protects the rotor: the start decides
    assert protecting_class(10, 3.0, 20.0, 16.0, 140.0, 5.5) == 20
    assert protecting_class(20, 6.0, 20.0, 16.0, 140.0, 5.5) == 30
    # 7 s are 10.1 s with the tolerance: no class up to 30 holds
    assert protecting_class(30, 7.0, 20.0, 16.0, 140.0, 5.5) == 30


def test_an_overload_that_passes_trips_no_relay():
    """The last current of a surge of 0.3 s was assumed to flow on for ever: a trip after 133 s, beside the surge."""
    time, current = np.linspace(0.0, 0.5, 51), np.full(51, 60.0)
    assert stall_heat(CLASSES[2], time, current, 20.0, 16.0, 140.0).trip_time > 0.5
    assert stall_heat(CLASSES[2], time, current, 20.0, 16.0, 140.0, after=16.0) is None
    events = parse(event_line("jam_left", "blocked")).events
    assert events["jam_left"].passes and not events["blocked"].passes


def test_a_relay_that_never_trips_in_a_stall_does_not_protect():
    row = used(stall_current=20.0)["trip with the rotor locked"]
    assert math.isinf(row.utilisation) and not row.holds


# -- a study


@pytest.mark.second
def test_the_numbers_of_a_study_follow_from_its_run(rated):
    result = ResultEntries(json.loads((rated / "result.json").read_text("utf-8")))
    found = result["checks"]["relay"]
    plate = 750.0 / (0.825 * 0.75 * math.sqrt(3.0) * 400.0)
    assert found["setting"]["value"] == pytest.approx(plate, rel=1e-9)
    assert found["stall_current"]["value"] == pytest.approx(6.0 * plate, rel=1e-9)
    assert found["trip_class"] == "20" and found["suitable"] == ["5", "10A", "10"]
    start = result["start_up"]["start_time"]["value"]
    with xr.open_dataset(rated / "result.nc", group="start_up") as run:
        current, time = np.abs(run["motor.i"].values), run["time"].values
    until = time <= start
    expected = np.trapezoid((current[until] / (7.2 * plate)) ** 2, time[until])
    assert found["start_seconds"]["value"] == pytest.approx(expected, rel=1e-6)
    # a relay of class 20 is too slow for a stall of 14 s
    rows = [row for row in result["checks"]["rows"] if row["of"] == "thermal relay of class 20"]
    assert [row["holds"] for row in rows] == [True, True, False]
    for row in rows:
        assert at(result, row["number"])["value"] == row["value"]["value"]
        assert all(at(result, place)["value"] is not None for place in row["numbers"].values())
    page = (rated / "report.html").read_text("utf-8")
    assert "Classes of the thermal relay" in page


def test_a_relay_in_the_phases_of_a_delta_carries_the_whole_current_of_star():
    """Twice the rated current of the line for 6 s in star is 2 sqrt(3) times that of a winding: 6 s (3.46/7.2)^2 =
    1.39 s at 7.2 times the setting, three times as much as in the line; in delta both places see the same."""
    motor = '[system]\nmotor = "IE3 4-pole 4 kW, 112M"\n[starter]\nstar_delta = { time = 6 }'
    drive = drive_of(parse(f'start = "star-delta"\n{motor}'))
    time = np.linspace(0.0, 8.0, 8001)
    current = np.where(time < 6.0, 2.0, 0.0)
    in_line, in_phases = (
        start_seconds(time, i, 1.0) for i in (current, drive.star.winding_current(time, current))
    )
    assert in_phases == pytest.approx(6.0 * 12.0 / 7.2**2, rel=1e-3)
    assert in_phases == pytest.approx(3.0 * in_line)
    late = np.where(time > 7.0, 5.0, 0.0)
    assert np.array_equal(drive.star.winding_current(time, late), late)
    assert parse('[relay]\nplace = "line"').plans["checks"].relay_in_phases is False


def test_the_clock_of_an_event_in_running_says_nothing_of_star():
    """The runs of a sweep begin with their event, long after the starter changed to delta; a start begins in star."""
    motor = '[system]\nmotor = "IE3 4-pole 4 kW, 112M"\n[starter]\nstar_delta = { time = 6 }'
    drive = drive_of(parse(f'start = "star-delta"\n{motor}'))
    time, name = np.linspace(0.0, 8.0, 8001), f"motor.{drive.motor.current}"

    def trip(phase):
        turning = {"machine.phi0": ("time", 9.0 * time), "machine.w0": ("time", np.full_like(time, 9.0))}
        run, steady = (
            xr.Dataset(
                turning | {name: ("time", np.full_like(time, times * drive.rated_current))}, {"time": time}
            )
            for times in (4.0, 0.0)
        )
        window = Window(phase, run, drive, (), 1.0, 0.0, Window(Phase.STEADY, steady, drive, (), 1.0))
        return read_measure("thermal_trip_time", window)

    current = np.full_like(time, 4.0)
    usual = relay_trip(time, current, 1.0, 0.0, 4.0, 10)
    assert trip(Phase.EVENT) == pytest.approx(usual)
    # 6 s of star heat three times as much
    assert trip(Phase.LOADED_START) == pytest.approx(usual - 12.0, rel=0.05)


def test_a_relay_of_an_unknown_class_and_of_an_fmu_are_refused():
    with pytest.raises(InputError, match="trip_class"):
        parse('[relay]\ntrip_class = "15"')
    with pytest.raises(InputError, match="needs a model of the motor, which is an FMU; leave it out"):
        parse('[system]\nmotor = "m.fmu"\n[relay]\nsetting = 3')
