"""The check of a shaft section by DIN 743: the worked example of docs/checks.md by the formulas once more in MPa and
mm, published numbers of an exam problem, cycles of fibres, the directions, and a study."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from command import chainunit
from reports import at

from chainunit.capabilities.checks.plan import SectionPlan
from chainunit.capabilities.checks.row import Checks
from chainunit.capabilities.checks.section import (
    check_section,
    fibre_fatigue,
    fibres,
    permitted_amplitude,
    safety,
    section_strength,
    shaft_section,
    size_factor,
    yield_share,
)
from chainunit.capabilities.checks.tables import STEELS, SectionTable
from chainunit.core.errors import InputError
from chainunit.reading.result_entries import ResultEntries
from chainunit.reading.tables import instance
from chainunit.study.config import parse

DOCS = (Path(__file__).parents[3] / "docs" / "checks.md").read_text("utf-8")
SHAFT = {
    "diameter": 0.06, "arm": 0.12, "tensile_strength": 700e6, "yield_strength": 490e6, "radius": 0.003,
    "outer_diameter": 0.072, "roughness": 12.5e-6,
}  # fmt: skip
LOAD = {"force": 12.5e3, "largest": 3500.0 / 0.12, "torque": 500.0, "swing": 150.0, "largest_torque": 2500.0}


def section(notch="shoulder", steel="quenched", mean=0.0, mean_stress="ratio", is_hard=False, **values):
    table = instance(SectionTable, SHAFT | {name: x for name, x in values.items() if name not in LOAD})
    load = LOAD | {name: x for name, x in values.items() if name in LOAD}
    torque = load["torque"] + load["swing"] * np.sin(np.linspace(0.0, 2.0 * np.pi, 721))
    plan = SectionPlan(table, notch=notch, steel=steel, mean_stress=mean_stress, hard_surface=is_hard)
    amplitude = np.array([load["force"]])
    of = shaft_section(
        plan, amplitude, np.array([mean]), load["force"], load["largest"], torque, load["largest_torque"]
    )
    check_section(checks := Checks(), "shaft", of, table.safety, "a jam")
    return of, {row.title.partition(" (")[0]: row for row in checks.rows}


def test_the_example():
    for each in ("0.830 and 0.778", "1.984 and 1.488", "1.761 and 1.372", "133.9 MPa", "60.9 MPa", "1.814", "66.2 %",
                 "264 MPa", "2.44", "49.2 %"):  # fmt: skip
        assert each in DOCS, each
    # in MPa and mm
    d, D, r = 60.0, 72.0, 3.0
    B, S = (x * (1.0 - fall * math.log10(D / 16.0)) for x, fall in ((700.0, 0.26), (490.0, 0.34)))
    t = (D - d) / 2.0
    alpha = 1 + 1 / math.sqrt(0.62 * r / t + 11.6 * r / d * (1 + 2 * r / d) ** 2 + 0.2 * (r / t) ** 3 * d / D)
    alpha_t = 1 + 1 / math.sqrt(3.4 * r / t + 38 * r / d * (1 + 2 * r / d) ** 2 + (r / t) ** 2 * d / D)
    support = 10.0 ** -(0.33 + S / 712.0)
    beta = alpha / (1 + math.sqrt(2.3 * (1 + 1 / (4 * math.sqrt(t / r) + 2)) / r) * support)
    beta_t = alpha_t / (1 + math.sqrt(1.15 / r) * support)
    K2 = 1 - 0.2 * math.log10(d / 7.5) / math.log10(20)
    KF = 1 - 0.22 * math.log10(12.5) * (math.log10(B / 20) - 1)
    bWK, tWK = 0.5 * B / (beta / K2 + 1 / KF - 1), 0.3 * B / (beta_t / K2 + 1 / (0.575 * KF + 0.425) - 1)
    W = math.pi / 32 * d**3
    ba, ta, tm = 1500e3 / W, 150e3 / 2 / W, 500e3 / 2 / W
    bF, tF = 1.2 * 1.05 * S, 1.2 * S / math.sqrt(3)
    bADK = bWK / (1 + bWK / (2 * B - bWK) * math.sqrt(3) * tm / ba)
    tADK = tF / (1 + tm / ta)
    fatigue = 1 / math.hypot(ba / bADK, ta / tADK)
    yields = 1 / math.hypot(3500e3 / W / bF, 2500e3 / 2 / W / tF)
    of, rows = section()
    assert of.strength.beta_bending == pytest.approx(beta, rel=1e-9) == pytest.approx(1.761, rel=1e-3)
    assert of.strength.beta_torsion == pytest.approx(beta_t, rel=1e-9)
    assert of.strength.bending / 1e6 == pytest.approx(bWK, rel=1e-9) == pytest.approx(133.9, rel=1e-3)
    assert of.strength.torsion / 1e6 == pytest.approx(tWK, rel=1e-9)
    assert of.bending / 1e6 == pytest.approx(ba, rel=1e-9)
    assert of.torsion / 1e6 == pytest.approx(ta, rel=1e-4)
    assert of.torsion_mean / 1e6 == pytest.approx(tm, rel=1e-4)
    assert of.permitted_bending / 1e6 == pytest.approx(bADK, rel=1e-3)
    assert of.permitted_torsion / 1e6 == pytest.approx(tADK, rel=1e-3) == pytest.approx(60.9, rel=1e-2)
    assert fatigue == pytest.approx(1.814, rel=1e-3) and yields == pytest.approx(2.44, rel=1e-3)
    assert rows["safety against fatigue"].value == pytest.approx(fatigue, rel=1e-3)
    assert rows["safety against fatigue"].utilisation == pytest.approx(0.662, rel=0.01)
    assert rows["safety against yield"].value == pytest.approx(yields, rel=1e-6)
    assert rows["safety against yield"].utilisation == pytest.approx(0.492, rel=0.01)


def test_published_numbers_of_an_exam_problem():
    """A keyway in a shaft of 60 mm, C50 hardened at its surface, d_eff = 80 mm: safeties 1.472 and 2.568."""
    table = instance(
        SectionTable,
        {"diameter": 0.06, "tensile_strength": 750e6, "yield_strength": 520e6, "effective_diameter": 0.08,
         "roughness": 25e-6},
    )  # fmt: skip
    of = section_strength(SectionPlan(table, notch="keyway", steel="quenched", hard_surface=True))
    W = math.pi / 32.0 * 0.06**3
    cycle = {"bending": np.array([1402.294 / W]), "tension": 0.0, "torsion": 0.0}
    _, used = fibre_fatigue(of, cycle, math.sqrt(3.0) * 1336.902 / (2.0 * W))
    assert safety(np.max(used)) == pytest.approx(1.472, abs=5e-4)
    share = yield_share(of, 1.8 * 1402.294 / W, 0.0, 1.8 * 1336.902 / (2.0 * W))
    assert safety(share) == pytest.approx(2.568, abs=5e-4)


def test_size_factors_begin_at_one_and_never_rise():
    for steel in STEELS:
        for is_yield in (False, True):
            factors = [size_factor(steel, d, is_yield) for d in np.linspace(0.005, 0.5, 300)]
            assert factors[0] == 1.0 and np.all(np.diff(factors) <= 0.0) and factors[-1] > 0.55
    # the floors of the standard beyond 300 mm, 150 mm
    for steel, floors in {
        "quenched": (0.67, 0.57),
        "structural": (0.89, 0.75),
        "case-hardened": (0.60, 0.60),
    }.items():
        assert [size_factor(steel, 0.4, is_yield) for is_yield in (False, True)] == pytest.approx(
            floors, abs=0.006
        )
    assert size_factor("", 0.4, True) == 1.0


def test_a_force_that_stands_swings_a_turning_section_and_one_that_turns_with_it_does_not():
    turned = np.linspace(0.0, -4.0 * np.pi, 2001)
    still = np.full(2001, 300.0), np.full(2001, -400.0)
    amplitude, mean = fibres(*still, turned)
    assert amplitude == pytest.approx(np.full(len(amplitude), 500.0), rel=1e-4)
    assert mean == pytest.approx(np.zeros(len(mean)), abs=0.05)
    amplitude, mean = fibres(*still, 0.0)
    assert np.max(amplitude) == 0.0 and np.max(mean) == pytest.approx(500.0, rel=1e-3)
    amplitude, mean = fibres(200.0 * np.cos(turned), 200.0 * np.sin(turned), turned)
    assert np.max(amplitude) < 1e-9 and np.max(mean) == pytest.approx(200.0, rel=1e-9)
    # the other sense would see it turn twice
    assert np.max(fibres(200.0 * np.cos(turned), 200.0 * np.sin(turned), -turned)[0]) > 199.0


def test_permitted_amplitudes_meet_their_limits():
    args = (100e6, 400e6, 600e6)
    for case in ("ratio", "constant"):
        assert permitted_amplitude(*args, 50e6, 0.0, case) == pytest.approx(100e6)
    # where both lines meet, mean and amplitude together reach the yield point
    psi = 100.0 / 1100.0
    turn = 300e6 / (1.0 - psi)
    assert permitted_amplitude(*args, 1.0, turn, "constant") == pytest.approx(400e6 - turn)
    assert permitted_amplitude(*args, 1.0, 500e6, "constant") == 0.0
    ratio = 300.0 / (100.0 - 400.0 * psi)
    a = permitted_amplitude(*args, 1e6, ratio * 1e6, "ratio")
    assert a * (1.0 + ratio) == pytest.approx(400e6)


FATIGUE = {
    "force": 1, "swing": 1, "torque": 1, "mean": 1, "arm": 1, "tensile_strength": -1, "radius": -1, "diameter": -1,
    "roughness": 1, "hardening_factor": -1, "safety": 1, "bore": 1, "effective_diameter": 1, "largest": 0,
    "largest_torque": 0, "axial_share": 1, "torsion_share": 1,
}  # fmt: skip
YIELD = {
    "largest": 1, "largest_torque": 1, "arm": 1, "yield_strength": -1, "diameter": -1, "bore": 1, "safety": 1,
    "effective_diameter": 1, "force": 0, "swing": 0, "roughness": 0, "hardening_factor": 0, "torsion_share": 1,
}  # fmt: skip
START = SHAFT | LOAD | {
    "mean": 2e3, "hardening_factor": 1.0, "safety": 1.2, "bore": 0.02, "effective_diameter": 0.08, "axial_share": 0.4,
    "torsion_share": 0.6,
}  # fmt: skip


@pytest.mark.parametrize(
    ("title", "name", "sign"),
    [
        (title, name, sign)
        for title, of in (("fatigue", FATIGUE), ("yield", YIELD))
        for name, sign in of.items()
    ],
)
def test_the_used_share_moves_in_the_right_direction(title, name, sign):
    title = f"safety against {title}"
    values = {"mean": 2e3, "bore": 0.02, "effective_diameter": 0.08, "axial_share": 0.4, "torsion_share": 0.6}
    shares = [
        section(**values | {name: START[name] * factor})[1][title].utilisation for factor in (1.0, 1.05, 1.15)
    ]
    steps = np.diff(shares)
    assert np.all(sign * steps > 0.0) if sign else np.allclose(steps, 0.0, atol=1e-12), shares


def test_the_fibre_that_decides_is_not_always_the_one_with_the_largest_amplitude():
    plan = SectionPlan(instance(SectionTable, SHAFT))
    args = (12e3, 20e3, np.zeros(3), 0.0)
    # equal amplitudes nearly, and a large mean on the second fibre
    both = shaft_section(plan, np.array([10.1e3, 10.0e3]), np.array([0.0, 30e3]), *args)
    alone = shaft_section(plan, np.array([10.0e3]), np.array([30e3]), *args)
    assert both == alone and both.bending_mean > 0.0


def test_notches_steels_and_surfaces():
    def used(**values):
        return section(**values)[1]["safety against fatigue"].utilisation

    plain = used(notch="none")
    assert plain < used(notch="shoulder") < used(notch="keyway")
    assert used(notch="given", beta_bending=2.0) > plain == used(notch="given")
    assert used(notch="press fit") > plain
    assert used(steel="") < used(steel="quenched")  # the strengths are those at the diameter
    assert used(mean_stress="constant", torque=500.0) <= used(torque=500.0)
    assert section(is_hard=True)[0].strength.yield_bending < section()[0].strength.yield_bending
    hollow = section(bore=0.03)[0].strength
    assert hollow.yield_torsion == pytest.approx(section()[0].strength.yield_torsion / 1.2)


def test_a_section_without_load_lasts():
    of, rows = section(force=0.0, largest=0.0, torque=0.0, swing=0.0, largest_torque=0.0)
    assert math.isinf(of.fatigue_safety) and math.isinf(of.yield_safety)
    assert [row.utilisation for row in rows.values()] == [0.0, 0.0] and all(
        row.holds for row in rows.values()
    )


def test_a_load_that_does_not_swing_has_no_permitted_amplitude():
    for share, names in ((0.0, ["sbADK", "ttADK"]), (0.4, ["sbADK", "szdADK", "ttADK"])):
        of, rows = section(axial_share=share)
        fatigue = rows["safety against fatigue"]
        assert [name for name in fatigue.numbers if name.endswith("ADK")] == names
        assert (of.permitted_tension is None) == (share == 0.0)
        yields = rows["safety against yield"]
        assert all(symbol in yields.formula for symbol in yields.numbers) and "szdFK" in yields.numbers


# -- a study

STUDY = """
title = "Sections"
[machine]
ratio = 50
[run]
settle_turns = 2
[[event]]
type = "jam"
side = "left"
[section.crankshaft]
notch = "none"
diameter = "35 mm"
arm = "80 mm"
tensile_strength = "700 MPa"
yield_strength = "490 MPa"
steel = "quenched"
[section.pivot]
pin = "C"
on = "frame"
diameter = "20 mm"
arm = "90 mm"
torsion_share = 0
tensile_strength = "360 MPa"
yield_strength = "235 MPa"
notch = "keyway"
[section.rod]
pin = "Bd"
on = "link"
notch = "none"
arm = 0
diameter = "20 mm"
torsion_share = 0
axial_share = 1
tensile_strength = "360 MPa"
yield_strength = "235 MPa"
"""


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sections")
    (folder / "mine.toml").write_text(STUDY, "utf-8")
    assert chainunit("study", "mine.toml", "-o", "out", cwd=folder).returncode == 0
    return folder / "out"


@pytest.mark.second
def test_the_stresses_of_a_study_follow_from_its_runs(done):
    result = ResultEntries(json.loads((done / "result.json").read_text("utf-8")))
    found = result["checks"]["section"]
    with xr.open_dataset(done / "result.nc", group="start_up") as run:
        angle = run["machine.phi0"].values / 50.0
        turns = run.sel(time=angle >= angle[-1] - 2.0 * np.pi * result["run"]["turns"]["value"])
        phi = turns["machine.phi0"].values / 50.0
        bearing, pivot, coupler = (
            [turns[f"machine.{name}.{axis}"].values for axis in ("fx", "fy")]
            for name in ("crank_bearing", "pivot", "coupler_pin")
        )
        torque = turns["machine.tau"].values * 50.0
    # the crank turns clockwise: its own axes, along the crank and across it
    along = np.sin(phi) * bearing[0] + np.cos(phi) * bearing[1]
    across = np.cos(phi) * bearing[0] - np.sin(phi) * bearing[1]
    W = math.pi / 32.0 * 0.035**3
    around = np.linspace(0.0, np.pi, 500)
    ranges = [np.ptp(np.cos(a) * along + np.sin(a) * across) for a in around]
    own = found["crankshaft"]
    assert own["pin"] == "O1 crank bearing"
    assert own["bending"]["value"] == pytest.approx(0.08 * 0.5 * max(ranges) / W, rel=2e-3)
    assert own["torsion"]["value"] == pytest.approx(0.5 * np.ptp(torque) / (2.0 * W), rel=2e-3)
    W = math.pi / 32.0 * 0.02**3
    along = np.stack([np.cos(a) * pivot[0] + np.sin(a) * pivot[1] for a in around]) * 0.09 / W
    amplitude = 0.5 * np.ptp(along, axis=1)
    mean = np.abs(0.5 * (np.max(along, axis=1) + np.min(along, axis=1)))
    # mean and amplitude in one ratio: the lines of fatigue and of yield
    strength = {name: each["value"] for name, each in found["pivot"]["strength"].items()}
    psi = strength["bending"] / (2.0 * strength["tensile"] - strength["bending"])
    used = np.maximum(
        (amplitude + psi * mean) / strength["bending"], (amplitude + mean) / strength["yield_bending"]
    )
    assert found["pivot"]["fatigue_safety"]["value"] == pytest.approx(1.0 / np.max(used), rel=5e-3)
    worst = int(np.argmax(used))
    assert found["pivot"]["bending"]["value"] == pytest.approx(amplitude[worst], rel=0.1)
    assert found["pivot"]["bending_mean"]["value"] == pytest.approx(mean[worst], rel=0.02)
    assert found["pivot"]["torsion"]["value"] == 0.0
    area = math.pi / 4.0 * 0.02**2
    assert found["rod"]["tension"]["value"] == pytest.approx(np.max(np.hypot(*coupler)) / area, rel=1e-3)
    peaks = max(pins["C rocker pivot"]["peak"]["value"] for pins in result["pins"].values())
    assert found["pivot"]["largest_bending"]["value"] == pytest.approx(0.09 * peaks / W, rel=1e-9)
    rows = [row for row in result["checks"]["rows"] if row["of"].startswith("section ")]
    assert len(rows) == 6
    text = (done / "result.md").read_text("utf-8")
    for row in rows:
        assert at(result, row["number"])["value"] == row["value"]["value"]
        assert all(at(result, place)["value"] is not None for place in row["numbers"].values())
        assert f"| {row['of']}: {row['title']} |" in text


STRENGTHS = "arm = 0.1\ndiameter = 0.05\ntensile_strength = 7e8\nyield_strength = 4.9e8\n"
NEEDED = f'{STRENGTHS}notch = "none"\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("diameter = 0.05", "section.A.tensile_strength: must be given"),
        ("diameter = 0.05", "section.A.notch: must be given, one of none, given, shoulder, keyway, press fit"),
        ("diameter = 0.05", "section.A.arm: must be given"),
        (NEEDED + 'pin = "Q"', "section.A.pin: is no turning pin"),
        (NEEDED + 'pin = "A1"', "section.A.pin: stands for A1 left support, A1 right support; give the whole title"),
        (STRENGTHS + 'notch = "shoulder"\nradius = 0.002', "section.A.outer_diameter: must be given for the notch"),
        (NEEDED + "radius = 0.002", "section.A.radius: is of the notch shoulder, and the notch is none"),
        (NEEDED + "beta_bending = 2", "section.A.beta_bending: is of the notch given"),
        (NEEDED + "bore = 0.05", "section.A.bore: must be less than the diameter"),
        (STRENGTHS + 'notch = "shoulder"\nradius = 0.002\nouter_diameter = 0.0505', "the diameter over 0.98"),
        (STRENGTHS + 'notch = "shoulder"\nradius = 0.0001\nouter_diameter = 0.06', "at least 0.03 of the depth"),
        (NEEDED + 'steel = "rusty"', "section.A.steel"),
        (NEEDED + "safety = 0.5", "section.A.safety = 0.5"),
    ],
)  # fmt: skip
def test_a_wrong_section_is_refused(text, words):
    with pytest.raises(InputError) as refusal:
        parse(f"[section.A]\n{text}")
    assert words in str(refusal.value)


def test_a_section_takes_the_pin_by_its_first_word():
    plan = parse(f'[section.A]\n{NEEDED}pin = "C"\non = "frame"').plans["checks"].sections["A"]
    assert (plan.pin, plan.on, plan.notch, plan.table.safety) == ("C rocker pivot", "frame", "none", 1.2)
    assert replace(plan, pin="") != plan
