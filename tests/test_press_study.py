"""A study of a press from a linkage file: forces in its guide, its picture in motion, and what its page says."""

from __future__ import annotations

import html
import itertools
import json
import math
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from reports import page_of, pictures, report_of

from chainunit.capabilities.sizing.coupling import effects
from chainunit.capabilities.sizing.protection import CouplingEffect, spares
from chainunit.reading.text import DEFAULT_UNITS
from chainunit.report import figures as study_figures
from chainunit.report import page_figures, study_motion
from chainunit.report.figure import Between, Curve
from chainunit.report.machine_picture import loads_on_slides
from chainunit.report.study_motion import machine_state
from chainunit.study import config
from chainunit.study.readings import crank_motion, crank_torque
from chainunit.study.run import run_study

pytestmark = pytest.mark.second

PRESS = Path(__file__).parents[1] / "examples" / "linkages" / "slider_crank_press.toml"
STUDY = """
title = "A press"
[system]
machine = "slider_crank_press.toml"
motor = "IE3 4-pole 2.2 kW, 100L"
[run]
crank_speed = "60 rev/min"
settle_turns = 1
turns = 1
step = 0.002
[[event]]
type = "surge"
input = "press_force"
factor = 2
crank_angle = "230 deg"
turns = 1
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("press")
    shutil.copy(PRESS, folder)
    return run_study(config.parse(STUDY, str(folder / "press.toml")), folder)


@pytest.fixture(scope="module")
def page(study):
    return page_of(study)


@pytest.fixture(scope="module")
def figures(study):
    return {figure.name: figure for figure in report_of(study).figures}


def test_the_guide_stands_among_the_bearings_by_the_names_of_the_file(study):
    for table in study.runs.pins.values():
        assert list(table) == ["guide", "O1", "A", "C"]
        # a guide does not turn: it has no load of ISO 281
        assert table["guide"]["ball_equivalent"] is None
        # the larger exponent weighs the peaks more
        assert table["C"]["roller_equivalent"] > table["C"]["ball_equivalent"] > 0.0
    run = study.runs.steady
    across = np.hypot(run["machine.guide.fx"].values, run["machine.guide.fy"].values)
    assert study.runs.pins["start_up"]["guide"]["peak"] >= np.max(across) > 100.0
    # the guide bears the sideways part of the force that the rod puts on the ram, with its mass and its load
    reactions = study.findings.by_analysis["constant_speed"].pins
    assert list(reactions) == ["guide", "O1", "A", "C"] and reactions["guide"].peak > 100.0


def test_ram_guide_and_working_force_are_drawn(study):
    moving = pictures(study_motion.motion(study))
    (rail,) = moving["rails"]
    # the guide is upright, 25 mm beside the bearing of the crank
    assert rail[0] == rail[2] == pytest.approx(0.025) and abs(rail[3] - rail[1]) > 0.16
    for run in moving["runs"]:
        assert list(run["blocks"]) == ["C"]
        assert abs(math.sin(math.radians(run["blocks"]["C"][0]))) == pytest.approx(1.0)
        forces = {force["title"]: force for force in run["forces"]}
        assert list(forces) == ["guide", "O1", "A", "C", "pressing"]
        pressing = forces["pressing"]
        assert (pressing["kind"], pressing["at"], pressing["short"]) == ("load", "T", "pressing")
        force = study.runs.series[run["name"]]["machine.press_force"].values
        # the whole force within the last way, a twentieth of it to the side, both with four digits of the largest
        assert max(pressing["y"]) == pytest.approx(np.max(force), rel=1e-3) and min(pressing["y"]) == 0
        half = 0.51 * 10.0 ** (math.floor(math.log10(np.max(force))) - 3) * (1.0 + 1.0 / 20.0)
        assert np.array(pressing["x"]) == pytest.approx(np.array(pressing["y"]) / 20.0, abs=half)


def test_the_page_of_a_press_does_not_speak_of_a_chain_unit(page):
    visible = re.sub(r"<script.*?</script>", "", page, flags=re.S)
    assert "chain unit" not in visible and "rocker" not in visible


def test_a_title_in_a_sentence_stands_in_quotes(page):
    """The question has no capital letter in its middle: a linkage has a title in place of a noun."""
    assert "this Slider" not in page
    assert (
        "motor of the machine &quot;Slider-crank press" in page
        or 'motor of the machine "Slider-crank press' in page
    )


def test_the_answer_comes_first(page):
    main = page[page.index("<main>") :]
    headings = re.findall(r'<h2 id="(\w+)-title">', main)
    assert headings[:2] == ["answer", "question"]
    assert "<h2" not in page[page.index("<header>") : page.index("<main>")]


def test_force_over_stroke(study, figures):
    """The way of the ram is that of the textbook, and the area of the loop is the work of the load in a turn."""
    steady = study.runs.steady
    state = machine_state(study.setup.drive, steady)
    ((link, (way, force)),) = loads_on_slides(state).items()
    angle, _ = crank_motion(study.setup.drive, steady)
    r, l, e = 0.08, 0.36, 0.025
    rod = np.sqrt(l * l - (e - r * np.cos(angle)) ** 2)
    y = r * np.sin(angle) - rod
    assert link == "ram" and way + y == pytest.approx(np.full(len(y), way[0] + y[0]), abs=1e-9)
    # 20 kN over the last 10 mm on the way down: none above it, all of it well within it
    least, falls = (
        -math.sqrt((l + r) ** 2 - e * e),
        r * np.cos(angle) + r * np.sin(angle) * (e - r * np.cos(angle)) / rod,
    )
    above, below = y > least + 0.0105, (y < least + 0.0095) & (falls * 2.0 * math.pi < -0.015)
    assert np.any(below) and force[below] == pytest.approx(np.full(np.sum(below), -20e3))
    assert force[above] == pytest.approx(np.zeros(np.sum(above)), abs=1e-9)
    (panel,) = (panel for *_, panel in figures["force-over-stroke"].all_panels())
    curves = [item for item in panel.items if isinstance(item, Curve)]
    assert [curve.name for curve in curves] == ["steady running", "press_force rises"]
    assert min(np.min(curve.x) for curve in curves) == 0.0
    assert np.min(curves[0].y) == pytest.approx(-20e3, rel=1e-3)
    assert np.min(curves[1].y) == pytest.approx(-40e3, rel=1e-3)


def test_a_coupling_opens_too_late_for_a_press(study):
    """The force of the workpiece comes at once, so that the peak lies within the release time."""
    run = study.runs.series["surge_press_force"].sel(
        time=slice(study.runs.event_times["surge_press_force"], None)
    )
    torque, time = np.abs(crank_torque(study.setup.drive, run)), run["time"].values
    setting = 1.25 * np.max(np.abs(crank_torque(study.setup.drive, study.runs.steady)))
    (effect,) = effects(study, setting).values()
    trip = time[np.flatnonzero(np.abs(run["motor.tau"].values) * study.setup.drive.ratio > setting)[0]]
    until = torque[(time <= trip + 0.005) & (time >= trip - 0.01)]
    assert effect.without == pytest.approx(np.max(torque)) and np.max(until) == pytest.approx(np.max(torque))
    assert effect.with_coupling == pytest.approx(effect.without) and not spares({"surge": effect})
    # one with the whole release before the peak would spare it
    assert spares({"surge": CouplingEffect(effect.without, setting)})


def test_power_over_the_turn_and_histogram(study, figures):
    (panel,) = (panel for *_, panel in figures["power-turn"].all_panels())
    curves = {item.name: item for item in panel.items if isinstance(item, Curve)}
    crank = curves["crank"]
    assert np.all(np.diff(crank.x) > 0.0) and 0.0 <= crank.x[0] and crank.x[-1] < 2.0 * math.pi
    # energy of the turn by angle: torque over angle is power over speed
    torque = crank_torque(study.setup.drive, study.runs.steady)
    angle, speed = crank_motion(study.setup.drive, study.runs.steady)
    k = len(angle) // 2
    at = angle[k] % (2.0 * math.pi)
    assert np.interp(at, crank.x, crank.y) == pytest.approx(torque[k] * speed[k], rel=1e-9)
    panels = [panel for *_, panel in figures["load-histogram"].all_panels()]
    both = [item for panel in panels for item in panel.items if isinstance(item, Between)]
    for bars in both:
        assert np.trapezoid(bars.high, bars.x) / np.ptp(
            bars.x
        ) * study_figures._LOAD_CLASSES == pytest.approx(1.0)
    # the motor has another torque than the crank, not the same divided by the ratio
    left, right = (bars.x / np.max(np.abs(bars.x)) for bars in both)
    assert len(left) != len(right) or np.max(np.abs(left - right)) > 0.05


def test_the_histogram_of_a_sine_is_the_arcsine_distribution():
    time = np.linspace(0.0, 1.0, 40001)
    edges, shares = study_figures.histogram(time, 7.0 * np.sin(2.0 * math.pi * time))
    wanted = np.diff(np.arcsin(np.clip(edges / 7.0, -1.0, 1.0))) / math.pi
    assert shares == pytest.approx(wanted, abs=2e-4) and np.sum(shares) == pytest.approx(1.0)


def test_the_bars_of_the_pins_are_few(figures):
    """However many runs there are: peak and RMS of steady running, and the largest peak with the name of its run."""
    (panel,) = (panel for *_, panel in figures["reactions"].all_panels())
    assert len(panel.items) == 3 and len(panel.items[2].words) == len(panel.y.names) == 4
    assert set(panel.items[2].words) <= {"start-up", "steady running", "press_force rises"}


def test_panels_stand_below_each_other_on_a_narrow_screen(figures):
    """No two panels overlap, those that share an axis are neighbours, and the height grows with them."""
    for figure in figures.values():
        embedded = page_figures.page_figure(figure, DEFAULT_UNITS)
        panels = list(figure.all_panels())
        if len(figure.panels[0]) == 1:
            # a long title has two lines, and a legend of more rows its room
            narrow, wide = dict(embedded.get("narrow", {})), embedded.get("wide", {})
            if "margin.b" in narrow:
                more = narrow.pop("margin.b") - wide["margin.b"]
                assert more == narrow["height"] - wide["height"] > 0, figure.name
            assert all(key.endswith(".title.text") for key in narrow if key != "height"), figure.name
            continue
        narrow = embedded["narrow"]
        rows = sorted(
            value for key, value in narrow.items() if key.startswith("yaxis") and key.endswith("domain")
        )
        assert len(rows) == len(panels) and all(a[1] < b[0] for a, b in itertools.pairwise(rows))
        assert all(
            value == [0.0, 1.0]
            for key, value in narrow.items()
            if key.startswith("xaxis") and "domain" in key
        )
        assert narrow["height"] > 150 * len(panels) and set(embedded["wide"]) == set(narrow)
        assert embedded["wide"]["height"] == embedded["layout"]["height"]
    assert "narrow" in page_figures.page_figure(figures["torque-speed"], DEFAULT_UNITS)


MEASURE = """
<script>
const sides = (b) => [b.left, b.top, b.right, b.bottom].map(Math.round);
const boxOf = (e) => sides(e.getBoundingClientRect());
const all = (selector, of = document) => [...of.querySelectorAll(selector)];
const measure = () => ({
  across: document.documentElement.scrollWidth,
  answer: boxOf(document.getElementById("answer"))[1] + Math.round(window.scrollY),
  plots: all(".plot").map((plot) => ({
    name: plot.dataset.figure, box: boxOf(plot),
    words: all(".annotation-text-g, .xtitle, .ytitle", plot).map((e) => [e.textContent, ...boxOf(e)]),
  })),
  names: all("#stage .joint-name").filter((e) => e.textContent).map((e) => [e.textContent, ...boxOf(e)]),
  hidden: all("#stage .arrow:not(.legend)").filter((e) => all("#stage .joint-name").some(
    (name) => name.compareDocumentPosition(e) & Node.DOCUMENT_POSITION_FOLLOWING)).length,
});
const wait = setInterval(() => {
  const count = document.querySelectorAll(".plot").length;
  if (Number(document.documentElement.dataset.plots) !== count) return;
  clearInterval(wait);
  setTimeout(() => parent.postMessage([innerWidth, measure()], "*"), 500);
}, 100);
</script>
"""
"""Measures the page in its frame and tells the parent."""
SCREENS = (400, 768, 1400)


@pytest.fixture(scope="module")
def screens(page, tmp_path_factory):
    """The measures of the page on screens of several widths, by width; a browser has no window as narrow as a phone,
    but a frame may be so."""
    folder = tmp_path_factory.mktemp("screens")
    (folder / "page.html").write_text(page.replace("</body>", f"{MEASURE}</body>"), "utf-8")
    frames = "".join(
        f'<iframe src="page.html" style="width:{w}px;height:900px;border:0"></iframe>' for w in SCREENS
    )
    listen = (
        "<script>const got = {}; addEventListener('message', (e) => { got[e.data[0]] = e.data[1]; "
        "document.getElementById('got').textContent = JSON.stringify(got); });</script>"
    )
    (folder / "frames.html").write_text(f'{listen}<pre id="got"></pre>{frames}', "utf-8")
    arguments = (
        "--headless --no-sandbox --disable-gpu --window-size=1500,900 --virtual-time-budget=60000 --dump-dom"
    )
    done = subprocess.run(
        [
            "chromium",
            *arguments.split(),
            f"--user-data-dir={folder / 'user'}",
            (folder / "frames.html").as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert done.returncode == 0
    got = html.unescape(re.search(r'<pre id="got">(.*?)</pre>', done.stdout, re.S)[1])
    return {int(width): measured for width, measured in json.loads(got).items()}


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("chromium") is None, reason="no chromium here")
@pytest.mark.parametrize("width", SCREENS)
def test_no_words_of_a_plot_stand_over_each_other(screens, width):
    measured = screens[width]
    # a phone shows the whole page without scrolling sideways
    assert measured["across"] <= width
    for plot in measured["plots"]:
        left, top, right, bottom = plot["box"]
        for words, *box in plot["words"]:
            assert left - 1 <= box[0] and box[2] <= right + 1, (plot["name"], words)
            assert top - 1 <= box[1] and box[3] <= bottom + 1, (plot["name"], words)
        for (one, *a), (other, *b) in itertools.combinations(plot["words"], 2):
            apart = max(b[0] - a[2], a[0] - b[2], b[1] - a[3], a[1] - b[3])
            assert apart >= -1, (plot["name"], one, other)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("chromium") is None, reason="no chromium here")
@pytest.mark.parametrize("width", SCREENS)
def test_the_answer_is_on_the_first_screen_and_names_stand_before_arrows(screens, width):
    measured = screens[width]
    assert measured["answer"] < 350 and measured["hidden"] == 0
    assert {name for name, *_ in measured["names"]} == {"O1", "A", "C", "T"}
    for (one, *a), (other, *b) in itertools.combinations(measured["names"], 2):
        apart = max(b[0] - a[2], a[0] - b[2], b[1] - a[3], a[1] - b[3])
        assert apart >= 0, (one, other)
