"""Every quantity that a report shows in two places is equal in them: the packaged study and five others."""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import fields, is_dataclass
from html import unescape
from pathlib import Path

import pytest
from reports import plain, report_of, screen_of

from chainunit.reading.text import number
from chainunit.report import blocks as b
from chainunit.report import html, pdf
from chainunit.report.lines import Number, Words, pieces
from chainunit.report.markdown import markdown as markdown_of
from chainunit.report.sheet import sheet
from chainunit.study import config
from chainunit.study.run import run_study

pytestmark = pytest.mark.second

EXAMPLES = Path(__file__).parents[1] / "examples"
PRESS = """
title = "Press with an inverter"
start = "inverter"
[system]
machine = "slider_crank_press.toml"
motor = "IE3 4-pole 2.2 kW, 100L"
[gear]
torque_limit = "450 N m"
[flywheel]
J = "0.15 kg m2"
[run]
crank_speed = "60 rev/min"
step = "2 ms"
settle_turns = 4
[bearing.O1]
kind = "roller"
C = "110 kN"
C0 = "130 kN"
[bearing.C]
kind = "ball"
C = "110 kN"
[usage]
hours = 8
days = 220
[[event]]
type = "surge"
input = "press_force"
factor = 1.6
crank_angle = "200 deg"
turns = 1
"""
PUMP = """
title = "Pump in star and delta"
event = []
start = "star-delta"
[system]
machine = "scotch_yoke_pump.toml"
[run]
crank_speed = "150 rev/min"
[sizing]
starts_per_hour = 2
poles_least = 4
poles_most = 4
candidates = 1
[starting]
permitted = 900
[bearing.O1]
kind = "roller"
C = "60 kN"
[usage]
hours = 12
days = 300
"""
STUDIES = {
    "packaged": (None, "", "test"),
    "press": ("linkages", PRESS, ""),
    "pump": ("linkages", PUMP, ""),
    "star": ("", (EXAMPLES / "star_delta.toml").read_text("utf-8"), ""),
    "jam": ("", (EXAMPLES / "jam_trips_coupling.toml").read_text("utf-8"), ""),
    "line": ("", (EXAMPLES / "jam_with_driveline.toml").read_text("utf-8"), ""),
}

QUANTITIES = {
    "mean speed": r"answers\.steady\.speed_mean|verdict\.motor\.speed|verdict\.model\.reached",
    "speed asked for": r"run\.crank_speed|verdict\.motor\.asked",
    "winding": r"answers\.steady\.winding_temperature|energy\.own\.temperature",
    "RMS current": r"answers\.steady\.current_rms|checks\.(relay\.before|starting\.current)",
    "rated current": r"motor\.rated_current|checks\.(relay\.setting|starting\.rated_current)"
    r"|sizing\.protection\.relay_current",
    "torque of running at the gear": r"starts\.running|checks\.gear\.running|sizing\.gear\.running",
    "worst torque of a start at the gear": r"starts\.worst\.quasi_static|sizing\.gear\.start",
    "permitted starts": r"sizing\.candidates\.0\.checks\.starts\.limit|checks\.starting\.permitted",
    "loss of the gear": r"gear_loss\.whole|energy\.own\.mean\.gear",
    "least reserve": r"verdict\.motor\.least_reserve|LEAST",
}
"""By quantity, the places of a result at which it stands, as an expression; one of them is its own."""
IN_PHASES = r"checks\.relay\.(before|setting)|sizing\.protection\.relay_current"
"""The places of a star-delta relay: in the phases of the delta it carries the current of the line over sqrt(3)."""


SHORT = ("packaged", "press", "jam")
"""The studies that the second stage has."""


@pytest.fixture(
    scope="module",
    params=[name if name in SHORT else pytest.param(name, marks=pytest.mark.slow) for name in STUDIES],
)
def study(request, tmp_path_factory):
    folder, text, _ = STUDIES[request.param]
    out = tmp_path_factory.mktemp(request.param)
    if folder is None:
        return run_study(config.load(), out)
    return run_study(config.parse(text, str(EXAMPLES / folder / "study.toml")), out)


@pytest.fixture(scope="module")
def report(study):
    return report_of(study)


def pieces_of(node):
    """All numbers and sentences of a result in a part of a report."""
    if isinstance(node, Number | Words):
        yield node
    elif isinstance(node, tuple | list):
        for each in node:
            yield from pieces_of(each)
    elif is_dataclass(node) and not isinstance(node, type):
        for each in fields(node):
            yield from pieces_of(getattr(node, each.name))


def test_one_screen_has_the_answer_and_one_table(study, report):
    lines = screen_of(report)
    assert len(lines) <= 45 and max(map(len, lines)) <= 80
    text = " ".join(" ".join(lines).split())
    verdict = report.result["verdict"]
    for each in ("model", "motor"):
        assert verdict[each] is None or verdict[each]["text"] in text
    assert sum("┏" in line for line in lines) == 1
    # the worst overload is the one with the largest crank torque, and stands there with its title
    peaks = {
        run: abs(report.result["answers"][run]["crank_torque_peak"]["value"]) for run in study.runs.overloads
    }
    if peaks:
        assert study.runs.title_of(max(peaks, key=peaks.get)) in text
    assert ("Motor: " in text or "Insufficient motor: " in text) == ("sizing" in report.result)


def test_the_sized_drive_is_said_first_everywhere_in_one_sentence(study, report):
    """It stood on the terminal alone, below the verdicts."""
    sentence = report.result.get("sentence")
    assert (sentence is not None) == (study.setup.proposal is not None)
    if sentence is None:
        return
    assert list(report.result).index("sentence") < list(report.result).index("verdict")
    page = html.render(report).split("<main>")[1].split("<script")[0]
    paper = pdf.page_text(sheet(study, report), {}).split("</nav>")[1]
    markdown = re.sub(r"\\(.)", r"\1", markdown_of(report, ()))
    printed = " ".join(" ".join(screen_of(report)).split())
    texts = [printed, " ".join(plain(report, 10_000).split()), markdown.split("## ", 1)[1]]
    for text in (*texts, *(unescape(re.sub(r"<[^>]+>", " ", each)) for each in (page, paper))):
        assert text.count(sentence) == 1
        # nothing but the heading of the section stands before it
        assert len(text.split(sentence)[0].split()) < 5


def rows_of(result):
    return result.get("checks", {}).get("rows", [])


def test_a_quantity_has_one_value(study, report):
    """A start and a steady turn are run by several analyses: they take them from the same runs."""
    values = defaultdict(dict)
    plan = study.setup.config.plans["checks"]
    factor = 3.0**0.5 if study.setup.drive.star and plan.relay_in_phases else 1.0
    for whole, value in leaves(report.result):
        place = whole.removeprefix("given.").removeprefix("runs.").removeprefix("findings.")
        if value is not None and re.fullmatch(IN_PHASES, place):
            value *= factor
        for name, places in QUANTITIES.items():
            if value is not None and re.fullmatch(places, place):
                values[name][place] = value
    assert len(values) >= 2
    for name, by_place in values.items():
        first = next(iter(by_place.values()))
        assert all(x == pytest.approx(first, rel=1e-6) for x in by_place.values()), (name, by_place)


def leaves(node, place=""):
    """Place and value of each number of a result."""
    if isinstance(node, dict) and "value" in node and "unit" in node:
        if isinstance(node["value"], int | float | None):
            yield place, node["value"]
    elif isinstance(node, dict | list):
        items = node.items() if isinstance(node, dict) else enumerate(node)
        for name, below in items:
            yield from leaves(below, f"{place}.{name}" if place else str(name))


def test_a_number_that_stands_twice_is_printed_alike_and_is_that_of_the_result(report):
    """Cards, tables, sentences and headings: what has one place in the result has one value."""
    at = {}
    for piece in pieces_of(tuple(report.blocks("long"))):
        if isinstance(piece, Number) and piece.path:
            assert at.setdefault(piece.path, piece.value) == piece.value, piece.path
    numbers = dict(leaves(report.result))
    for path, value in at.items():
        if path in numbers:
            assert numbers[path] == value, path
    assert len(at) > 100


def test_the_equivalent_load_of_a_pin_is_that_of_its_check(report):
    pins = report.result["pins"]
    for pin, bearing in report.result.get("checks", {}).get("rolling", {}).items():
        own = pins["steady"][pin][f"{bearing['kind']}_equivalent"]["value"]
        assert bearing["load"]["value"] == pytest.approx(own, rel=1e-12)
        most = max(table[pin]["peak"]["value"] for table in pins.values())
        assert bearing["largest_force"]["value"] == pytest.approx(most, rel=2e-3)


def test_a_torque_of_the_gear_has_one_verdict(study, report):
    """A torque of running is judged by the rating times its factor, a shock by the peak factor, everywhere."""
    result = report.result
    limits = {row["title"]: row["limit"]["value"] for row in rows_of(result) if row["of"] == "gear"}
    if "gear.torque_limit" in study.setup.config.drive.given and "torque of running" in limits:
        gear = study.setup.config.drive.gear
        assert limits["torque of running"] == gear.torque_limit
        (largest,) = (x for title, x in limits.items() if title.startswith("largest torque"))
        assert largest == gear.start_limit == result["starts"]["limit"]["value"]
    over = {row["title"] for row in rows_of(result) if not row["holds"]}
    for warning in result["warnings"]:
        if "permitted" in warning["text"] and "of the output" in warning["text"]:
            assert any(title in warning["text"] for title in over)


def test_the_relay_is_of_one_class_and_its_checks_have_numbers(report):
    result = report.result
    relay = result.get("checks", {}).get("relay")
    if relay is None:
        return
    ordered = result.get("sizing", {}).get("protection", {}).get("relay_class")
    if ordered is not None:
        assert ordered["value"] == f"class {relay['trip_class']}"
    for row in rows_of(result):
        if row["of"].startswith("thermal relay") and row["holds"]:
            assert row["value"]["value"] > 0.0
    for name, event in relay["events"].items():
        later = result["answers"][name]["thermal_trip_time"]["value"]
        assert later == pytest.approx(event["trip_time"]["value"], rel=1e-9)


def test_a_heading_names_the_speed_that_was_run(study, report):
    """Above values of steady running stands their mean speed, not the one asked for."""
    mean = study.runs.answers["steady"].speed_mean
    shown = number(mean, "rad/s", "speed", beside=False)
    (table,) = (
        block
        for block in report.blocks("long")
        if isinstance(block, b.Table) and "runs.answers.steady.current_rms" in paths_of(block)
    )
    assert shown in str(table.columns[0].short)
    (lead,) = (
        block
        for block in report.blocks("long")
        if isinstance(block, b.Text) and str(pieces(block.line)[0]).startswith("First the values of steady")
    )
    assert {piece.path for piece in pieces_of(lead) if isinstance(piece, Number)} == {
        "runs.answers.steady.speed_mean"
    }


def paths_of(block):
    return {piece.path for piece in pieces_of(block)}


def test_peak_and_rms_of_an_event_are_of_the_same_time(study):
    for name in study.runs.overloads:
        run = study.runs.series[name].sel(time=slice(study.runs.event_times[name], None))
        answers = study.runs.answers[name]
        torque = run["motor.air_gap_tau"].values
        time = run["time"].values
        mean_square = ((torque[1:] ** 2 + torque[:-1] ** 2) / 2.0 * (time[1:] - time[:-1])).sum()
        assert answers.motor_torque_rms == pytest.approx(
            (mean_square / (time[-1] - time[0])) ** 0.5, rel=1e-9
        )


SAID = re.compile(r"the (\S+ k?N m) that (steady running|the start-up|a start from \S+ deg) puts on it")


def test_a_sentence_puts_a_torque_where_it_is(study, report):
    """The torque of a sentence is that of the run that it names."""
    result = report.result
    for piece in pieces_of(tuple(report.blocks("long"))):
        if isinstance(piece, Words):
            for torque, where in SAID.findall(piece):
                protection = result["sizing"]["protection"]
                of = "running_torque" if where == "steady running" else "start_torque"
                assert torque == number(protection[of]["value"], "N.m")
