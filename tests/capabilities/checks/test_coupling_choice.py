"""Flexible couplings of one's own catalogues: their rows, the choice beside an independent computation of DIN 740-2
for each of them, the refusals, and a study that ends in an order number."""

from __future__ import annotations

import csv
import io
import json
import math
import shutil

import numpy as np
import pytest
import xarray as xr
from command import chainunit

from chainunit.capabilities.checks.coupling import CHOSEN, FITS, NEAREST, REJECTED, tried, with_row
from chainunit.capabilities.checks.row import CheckRow
from chainunit.capabilities.checks.tables import FlexibleCouplingTable
from chainunit.core.errors import InputError
from chainunit.drives.catalogue import offer
from chainunit.reading.result_entries import ResultEntries
from chainunit.study.config import parse

ROWS = (
    "designation,order_number,rated_torque [N.m],peak_torque [N.m],alternating_torque [N.m],"
    "stiffness [N.m/rad],damping,J [kg.m2],largest_speed [rev/min],price"
    """
FC 7,F-07,7.5,15,1.9,300,0.8,0.00004,12000,24
FC 10,F-10,10,20,2.6,520,0.8,0.00007,11000,29
FC 20,F-20,20,40,5.2,1100,0.8,0.00017,9500,38
FC 30,F-30,35,70,9.1,1900,0.8,0.0004,8000,55
FC 20 S,F-20S,20,40,5.2,140,0.9,0.00017,1000,31
FC 20 L,F-20L,20,40,0.8,1.5,0.3,0.00017,9500,30
FC 60,,60,120,16,4200,0.8,0.0011,,
"""
)
STUDY = """
title = "A flexible coupling of a catalogue"
catalogue = "couplings.csv"
[system]
motor = "IE3 4-pole 0.75 kW, 80M"
[run]
settle_turns = 1
[flexible_coupling]
temperature_factor = 1.2
[[event]]
type = "jam"
side = "left"
"""


def catalogue(folder, text=ROWS):
    file = folder / "couplings.csv"
    file.write_text(text, "utf-8")
    return file


# -- rows


def test_rows_are_read_from_csv_and_toml(tmp_path):
    rows = offer(catalogue(tmp_path)).flexible
    assert [each.designation for each in rows][:3] == ["FC 7", "FC 10", "FC 20"] and len(rows) == 7
    one = rows[2]
    assert (one.order_number, one.price, one.data.stiffness) == ("F-20", 38.0, 1100.0)
    assert one.data.largest_speed == pytest.approx(9500.0 * math.pi / 30.0)
    assert rows[-1].price is None and rows[-1].data.largest_speed == 0.0
    toml = tmp_path / "c.toml"
    toml.write_text(
        "[[flexible_coupling]]\ndesignation = 'A'\nrated_torque = '0.02 kN.m'\npeak_torque = 40\n"
        "alternating_torque = 5\nstiffness = 1000\ndamping = 0.8\n"
    )
    (own,) = offer(toml).flexible
    assert (own.data.rated_torque, own.data.J) == (20.0, 0.0)
    found = offer(tmp_path / "couplings.csv")
    assert not found.gears and not found.couplings and not found.motors


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        (
            "stiffness [N.m/rad]",
            "stifness [N.m/rad]",
            'heading "stifness [N.m/rad]": unknown; was "stiffness"',
        ),
        (
            "20,40,5.2,1100",
            "20,19,5.2,1100",
            "couplings.csv:4: column peak_torque = 19 N m: must be >= rated_",
        ),
        (
            "20,40,5.2,1100",
            "20,40,41,1100",
            "couplings.csv:4: column peak_torque = 40 N m: must be >= altern",
        ),
        ("300,0.8", "300,0", "couplings.csv:2: column damping = 0: must be > 0 and <= 10"),
        ("520,", ",", "couplings.csv:3: column stiffness: is missing; must be > 0 N m/rad"),
    ],
)
def test_a_wrong_row_is_told_with_its_line(tmp_path, before, after, said):
    with pytest.raises(InputError) as refusal:
        offer(catalogue(tmp_path, ROWS.replace(before, after, 1)))
    assert said in str(refusal.value) and len(str(refusal.value).splitlines()) == 1


# -- the choice


def needed(row, time, torque, largest, inertias, speed, temperature=1.2, surge=2.0, start=1.0):
    """By check, the share of its limit that a row of the catalogue uses: by the equations of motion of two inertias
    with a complex spring between them, for each frequency of the cycle, solved as they stand."""
    v = {
        name: float(text or 0.0) for name, text in row.items() if name not in ("designation", "order_number")
    }
    J = np.array(inertias) + 0.5 * v["J [kg.m2]"]
    span, count = time[-1] - time[0], len(time)
    even = np.interp(time[0] + span * np.arange(count) / count, time, torque)
    parts = np.fft.rfft(even) / count
    loss = v["damping"] / (2.0 * math.pi)
    spring = v["stiffness [N.m/rad]"] * (1.0 + 1j * loss)
    elastic = np.zeros_like(parts)
    frequency = 2.0 * math.pi * np.arange(len(parts)) / span
    for k, w in enumerate(frequency[1:], 1):
        # a torque on the motor's side that puts this part on a rigid shaft
        outer = parts[k] * sum(J) / J[1]
        dynamic = np.diag(-J * w**2) + spring * np.array([[1.0, -1.0], [-1.0, 1.0]])
        angles = np.linalg.solve(dynamic, [outer, 0.0])
        elastic[k] = spring * (angles[0] - angles[1]) * math.sqrt(max(1.0, w / (20.0 * math.pi)))
    swing = np.fft.irfft(elastic * count, count)
    mean = abs(np.trapezoid(torque, time) / span)
    rms = math.sqrt(np.trapezoid(torque**2, time) / span)
    natural = math.sqrt(v["stiffness [N.m/rad]"] * (1.0 / J[0] + 1.0 / J[1]))
    above = 2.0 * np.abs(parts[1:])[frequency[1:] > natural]
    passed = float(max(above, default=0.0)) * abs((1.0 + 1j * loss) / (1j * loss))
    shares = {
        "rated torque": rms * temperature / v["rated_torque [N.m]"],
        "peak torque": (mean + (largest - mean) * surge * start) * temperature / v["peak_torque [N.m]"],
        "alternating torque": 0.5 * np.ptp(swing) * temperature / v["alternating_torque [N.m]"],
        "passage through resonance": (mean + passed * start) * temperature / v["peak_torque [N.m]"],
    }
    if v["largest_speed [rev/min]"]:
        shares["speed"] = speed / (v["largest_speed [rev/min]"] * math.pi / 30.0)
    return shares


def shares_of(candidate):
    """By check without the name of its run, the share of a coupling in result.json."""
    return {each["title"].split(" (")[0]: each["utilisation"]["value"] for each in candidate["checks"]}


def made_up(shares):
    """The checks of a coupling from its shares by rated torque."""

    def rows(table):
        share = shares[table.rated_torque]
        yield CheckRow("coupling", "rated torque", "", "", share, 1.0, "", {}, "N.m")
        yield CheckRow("coupling", "speed", "", "", 0.5 * share, 1.0, "", {}, "N.m")

    return rows


PRICED = "designation,rated_torque,peak_torque,alternating_torque,stiffness,damping,price\n"


def judged(folder, shares, prices, name=""):
    rows = [f"c{x:g},{x},{9 * x},{x},100,0.8,{prices.get(x, '')}" for x in shares]
    couplings = offer(catalogue(folder, PRICED + "\n".join(rows))).flexible
    found = tried(couplings, FlexibleCouplingTable(), made_up(shares), name)
    return [(each.designation, each.verdict, each.reason.split(";")[0].split(",")[0]) for each in found]


def test_the_cheapest_that_fits_comes_first_and_one_without_a_price_last(tmp_path):
    shares = {1.0: 1.3, 2.0: 0.9, 3.0: 0.7, 4.0: 0.5, 5.0: 1.1}
    assert judged(tmp_path, shares, {1.0: 5, 2.0: 30, 3.0: 20, 5.0: 1}) == [
        ("c3", CHOSEN, "the cheapest that fits"),
        ("c2", FITS, "dearer: 30"),
        ("c4", FITS, "has no price"),
        ("c5", REJECTED, "rated torque 1.10 N m"),
        ("c1", REJECTED, "rated torque 1.30 N m"),
    ]
    assert judged(tmp_path, shares, {})[0] == ("c2", CHOSEN, "the smallest that fits")


def test_where_none_fits_the_nearest_is_told(tmp_path):
    found = judged(tmp_path, {1.0: 1.9, 2.0: 1.2, 3.0: 1.4}, {1.0: 5, 2.0: 30, 3.0: 20})
    assert found[0] == ("c2", NEAREST, "no coupling fits")
    assert {verdict for _, verdict, _ in found[1:]} == {REJECTED}


@pytest.mark.parametrize(("share", "verdict"), [(0.9, CHOSEN), (1.2, REJECTED)])
def test_the_coupling_that_the_file_names_is_taken(tmp_path, share, verdict):
    found = judged(tmp_path, {1.0: 0.5, 2.0: share}, {1.0: 5, 2.0: 30}, "c2")
    assert found == [
        ("c2", verdict, "named by the study file"),
        ("c1", FITS, "the study file names another one"),
    ]


def test_the_factors_of_the_file_stay_beside_a_row(tmp_path):
    table = FlexibleCouplingTable(temperature_factor=1.4, surge_factor=1.8, start_factor=1.1)
    made = with_row(table, offer(catalogue(tmp_path)).flexible[3])
    assert (made.temperature_factor, made.surge_factor, made.start_factor) == (1.4, 1.8, 1.1)
    assert (made.rated_torque, made.stiffness, made.damping, made.J) == (35.0, 1900.0, 0.8, 0.0004)


# -- refusals


@pytest.mark.parametrize(
    ("key", "said"),
    [
        (
            "stiffness = 900",
            "flexible_coupling.stiffness: each flexible coupling of the catalogue has its own",
        ),
        (
            "peak_torque = 900",
            "flexible_coupling.peak_torque: each flexible coupling of the catalogue has its own",
        ),
        ('designation = "FC 20S"', "not in the catalogue; must be one of FC 7, FC 10, FC 20, FC 30, FC 20 S"),
        ('designation = "FC20"', 'was "FC 20" meant?'),
    ],
)
def test_what_does_not_go_with_a_catalogue_is_refused(tmp_path, key, said):
    catalogue(tmp_path)
    text = STUDY.replace("temperature_factor = 1.2", key)
    with pytest.raises(InputError) as refusal:
        parse(text, str(tmp_path / "study.toml"))
    assert said in str(refusal.value)


def test_a_designation_needs_a_catalogue():
    with pytest.raises(InputError, match="no catalogue has flexible couplings"):
        parse('[flexible_coupling]\ndesignation = "FC 20"')
    assert parse("[flexible_coupling]\nrated_torque = 5").plans["checks"].couplings == ()


# -- a study


@pytest.fixture(scope="module")
def studied(tmp_path_factory):
    folder = tmp_path_factory.mktemp("chosen")
    catalogue(folder)
    (folder / "study.toml").write_text(STUDY, "utf-8")
    done = chainunit("study", "study.toml", "-o", "out", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder, " ".join(done.stdout.split())


@pytest.mark.slow
def test_each_coupling_is_tried_in_the_cycle_of_the_study(studied):
    """The shares of each row are those of the equations of motion with its own stiffness, damping and inertia; the
    chosen one is the cheapest that keeps each limit by them."""
    folder, _ = studied
    result = ResultEntries(json.loads((folder / "out" / "result.json").read_text("utf-8")))
    of, loss = result["checks"]["flexible_coupling"], 1.0 / result["gear"]["efficiency"]["value"] - 1.0

    def before_gear(run):
        """The torque on the motor's shaft, which turns forward: with the part that the gear loses."""
        tau = run["motor.tau"].values
        return tau + loss * np.abs(tau) * np.minimum(run["motor.w"].values, 1.0)

    with xr.open_dataset(folder / "out" / "result.nc", group="start_up") as run:
        angle = run["motor.phi"].values / result["machine"]["ratio"]["value"]
        turns = run.sel(time=angle >= angle[-1] - 2.0 * np.pi * result["run"]["turns"]["value"])
        time, torque = turns["time"].values, before_gear(turns)
        loads = np.mean(turns["machine.J"].values)
        largest, speed = (float(np.max(np.abs(x))) for x in (before_gear(run), run["motor.w"].values))
    with xr.open_dataset(folder / "out" / "result.nc", group="jam_left") as run:
        largest = max(largest, float(np.max(np.abs(before_gear(run)))))
        speed = max(speed, float(np.max(np.abs(run["motor.w"].values))))
    rotor = result["motor"]["rotor.J"]["value"]
    assert of["load_inertia"]["value"] == pytest.approx(loads, rel=1e-2)
    rows = list(csv.DictReader(io.StringIO(ROWS)))
    by_hand = {
        row["designation"]: needed(row, time, torque, largest, (rotor, of["load_inertia"]["value"]), speed)
        for row in rows
    }
    found = {each["designation"]: each for each in of["candidates"]}
    assert found.keys() == by_hand.keys()
    for name, shares in by_hand.items():
        own = shares_of(found[name])
        assert own.keys() == shares.keys()
        for check, share in shares.items():
            assert own[check] == pytest.approx(share, rel=0.01, abs=1e-4), (name, check)
    fits = [row for row in rows if max(by_hand[row["designation"]].values()) <= 1.0]
    assert 1 < len(fits) < len(rows) - 2
    cheapest = min(fits, key=lambda row: float(row["price"] or math.inf))
    best = of["candidates"][0]
    assert best["designation"] == cheapest["designation"] and best["verdict"] == CHOSEN
    # the soft one with little damping is rejected by its own amplification, the slow one by its speed
    assert found["FC 20 L"]["verdict"] == REJECTED and shares_of(found["FC 20 L"])["alternating torque"] > 1.0
    assert found["FC 20 S"]["reason"].startswith("speed")
    # the checks of the study are those of the chosen one
    checks = {r["title"].split(" (")[0]: r for r in result["checks"]["rows"] if r["of"] == "coupling"}
    assert {title: r["utilisation"]["value"] for title, r in checks.items()} == shares_of(best)


@pytest.mark.second
def test_its_order_number_stands_on_the_terminal_the_page_and_in_the_handover(studied):
    folder, shown = studied
    said = "Flexible coupling to order: FC 20, order number F-20, price 38, TKN 20 N m, CTdyn 1100 N m/rad"
    assert said in shown and "the cheapest that fits" in shown
    page = (folder / "out" / "report.html").read_text("utf-8")
    assert "Flexible couplings of the catalogues" in page and "F-30" in page
    assert 'title="flexible_coupling.stiffness"' not in page, "the row has it, not the file"
    assert 'title="flexible_coupling.surge_factor"' in page
    done = chainunit("handover", "out", "-o", "files", cwd=folder)
    assert done.returncode == 0, done.stderr
    part = json.loads((folder / "files" / "sizing.json").read_text("utf-8"))["flexible_coupling"]
    assert part == {"designation": "FC 20", "order_number": "F-20"}


@pytest.mark.slow
def test_a_catalogue_without_a_coupling_that_fits_ends_in_a_warning(studied, tmp_path):
    folder, _ = studied
    shutil.copy(folder / "study.toml", tmp_path)
    catalogue(tmp_path, "".join(ROWS.splitlines(keepends=True)[:3]))
    done = chainunit("study", "study.toml", "-o", "out", cwd=tmp_path)
    shown = " ".join(done.stdout.split())
    assert (
        "The flexible coupling FC 10 of the catalogues does not keep each limit: no coupling fits; peak"
        in shown
    )
    assert "Flexible coupling that does not fit: FC 10" in shown and "coupling to order" not in shown
    done = chainunit("handover", "out", "-o", "files", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "flexible_coupling" not in json.loads((tmp_path / "files" / "sizing.json").read_text("utf-8"))
