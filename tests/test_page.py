"""The page of a study: what it shows, where each number comes from, and that it works by itself."""

from __future__ import annotations

import base64
import dataclasses
import gzip
import itertools
import json
import math
import re
import shutil
import subprocess
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest
from event_tables import event_line
from plotly.offline import get_plotlyjs
from records import changed
from reports import at, page_of, pictures, plotly_figure, report_of, said_of, unpacked, write

from chainunit import EMPTY, InputError, RunError
from chainunit.capabilities.chains.analysis import rest_forces
from chainunit.capabilities.sizing.candidate import Candidate, Standing, TrialResult
from chainunit.capabilities.sizing.duty import CycleNumbers, Duty
from chainunit.capabilities.sizing.findings import SizingFindings
from chainunit.capabilities.sizing.result import DriveProtection, MotorProtection, SizedDrive
from chainunit.core.quantities import Layout
from chainunit.drives.catalogue import catalogue
from chainunit.drives.induction_motor import SoftStart
from chainunit.machines.chain_unit import Feed
from chainunit.reading.result_entries import ResultEntries
from chainunit.reading.results import InUnit
from chainunit.reading.text import DEFAULT_UNITS, digits_text, forms, scales, unit_text
from chainunit.reading.text import number as told_as
from chainunit.report import html, study_motion
from chainunit.report.blocks import Live, Report, Section, found_at
from chainunit.report.figure import Label, Mark, Shade
from chainunit.study import config, judgement
from chainunit.study.cycle import cycle
from chainunit.study.limits import Check
from chainunit.study.organ_limits import CRANK_GOOD, ROCKER_GOOD_EMPTY
from chainunit.study.result import as_dict
from chainunit.study.run import run_study
from chainunit.study.sections import Starter

pytestmark = pytest.mark.second

SHORT = """
title = "A mill <b>& more</b> </script><!--"
EVENTS
[run]
ramp = 0.3
settle_turns = 1
turns = 1
step = 0.004
crank_speed = 6
[machine]
ratio = 25
""".replace("EVENTS", event_line("feed_left", "jam_left", turns=1))


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    return run_study(config.parse(SHORT), tmp_path_factory.mktemp("page study"))


@pytest.fixture(scope="module")
def written(study, tmp_path_factory):
    return html.write(report_of(study), tmp_path_factory.mktemp("a page"))


@pytest.fixture(scope="module")
def chains(tmp_path_factory):
    """Rods go slack at the study's own speed and at the higher end of the sweep."""
    text = 'organ = "chain"\n' + SHORT.replace("= 6", "= 10").replace(
        event_line("feed_left", "jam_left", turns=1), event_line("jam_left", turns=1)
    )
    few = "[chain]\nsweep_points = 2\nsweep_lowest = 2\nsweep_highest = 12\n"
    return run_study(config.parse(text + few), tmp_path_factory.mktemp("chains"))


@pytest.fixture(scope="module")
def knife(tmp_path_factory):
    """A coupling opens as the blade meets a hard stack."""
    text = """
title = "A knife"
[system]
machine = "KnifeDrive"
[run]
settle_turns = 1
turns = 1
[coupling]
trip_torque = "2.5 kN.m"
[[event]]
type = "cut"
force = "60 kN"
"""
    return run_study(config.parse(text), tmp_path_factory.mktemp("knife study"))


class Sized(SizingFindings):
    """Findings of sizing with a protection that no run judged."""

    def sized(self, study):
        relay = MotorProtection(InUnit(1.6, "A", title="relay, setting"), None, None, "relay")
        torques = ("normal_torque", "running_torque", "start_torque", "breakdown_torque")
        protection = DriveProtection(
            210.0,
            8.4,
            relay,
            "Recommended torque limiter: 210 N m.",
            obstacle=None,
            why_none="",
            **dict.fromkeys(torques, 1.0),
            **{name: {} for name in ("effects", "overloads", "disturbances")},
            alternatives=[],
        )
        return SizedDrive(self.best, self.nearest is not None, "crank", None, False, protection=protection)


def candidate(study, name, verdict, reason, **utilisations):
    motor = dataclasses.replace(catalogue()[0], designation=name)
    checks = {
        of: Check(of.replace("_", "-"), None if used is None else 8.0 * used, 8.0, "N.m")
        for of, used in utilisations.items()
    }
    return Candidate(motor, study.setup.drive, TrialResult(checks), verdict=Standing(verdict), reason=reason)


def sized(study, *names):
    """The study with a chosen, a fitting and a rejected motor, or those of them with these `names`."""
    candidates = [
        candidate(study, "0.37 kW <IE3>", "chosen", "the least that fits", pull_out=0.87),
        candidate(study, "0.55 kW", "fits", "larger than it must be", pull_out=0.61, heat=None),
        candidate(study, "0.25 kW", "rejected", "too weak by 31 %", pull_out=1.31, heat=0.83),
    ]
    of_turn = CycleNumbers(**dict.fromkeys(Layout(CycleNumbers).names, 28.7))
    duty = Duty(study.setup.statics.normal, {}, None, of_turn)
    kept = [each for each in candidates if not names or each.motor.designation in names]
    findings = Sized(config.parse("[sizing]").plans["sizing"], duty, kept, ["Typical values."], 3, tried=3)
    return changed(study, by_analysis=study.findings.by_analysis | {"sizing": findings})


class Reader(HTMLParser):
    """Collects traced numbers and words, other text by section, elements, and what the page would load."""

    def __init__(self, text):
        super().__init__()
        self.numbers, self.words, self.loads, self.scripts = [], [], [], {}
        self.rest = {}
        self.stack = []
        self.open = []  # traced elements: [tag, depth, record]
        self.section = "head"
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.loads += [given[name] for name in ("src", "href", "action", "data") if name in given]
        if tag in ("section", "header", "script", "style"):
            self.section = given.get("id", tag)
        if "data-path" in given:
            record = {**given, "tag": tag, "text": ""}
            (self.numbers if tag == "data" else self.words).append(record)
            self.open.append([len(self.stack), record])
        if tag not in ("meta", "link", "input", "br"):
            self.stack.append(tag)

    def handle_endtag(self, tag):
        assert self.stack.pop() == tag
        if self.open and self.open[-1][0] == len(self.stack):
            self.open.pop()

    def handle_data(self, data):
        if self.stack and self.stack[-1] == "script":
            self.scripts[self.section] = self.scripts.get(self.section, "") + data
        elif self.open:
            for _, record in self.open:
                record["text"] += data
        elif self.stack and self.stack[-1] != "style":
            self.rest[self.section] = self.rest.get(self.section, "") + " " + data


def shown_number(text):
    """The number that a reader sees."""
    plain = text.replace("−", "-").replace("\u202f", "").replace("\u00a0", " ").replace("▲ ", "")
    power = re.match(r"(-?[\d.]+) × 10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)", plain)
    if power:
        return float(power[1]) * 10.0 ** int(power[2].translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")))
    return float(re.match(r"-?[\d.]+", plain)[0])


def check_traced(reader, result):
    """Every traced element says what stands at its path, and shows it."""
    assert len(reader.numbers) > 100 and len(reader.words) > 5
    for n in reader.numbers:
        entry = at(result, n["data-path"])
        assert json.loads(n["value"]) == entry["value"], n
        if entry["value"] is None:
            assert not re.search(r"\d", n["text"]), n
            continue
        (words, follows), *beside = forms(entry["value"], entry["unit"], entry.get("kind", ""))
        if not re.search(r"\d", words) or words.startswith(("over", "below")):
            # a shaft that stands, a share beyond any sense
            assert n["text"].removeprefix("▲ ").startswith(words), n
            continue
        if (words, follows) == ("0", "%"):
            assert abs(entry["value"]) < 5e-5 and n["text"].startswith("0"), n
            continue
        _, factor, offset = scales(entry["unit"], entry.get("kind", ""))[0]
        # by its size a number has another unit of the same kind; the page shows the unit, as checked below
        factor = {"W": 1.0, "kN": 1e-3, "kN m": 1e-3}.get(follows, factor)
        if follows == "times":
            factor = 1.0
        assert f"{follows} " in n["text"] + " " and all(
            f"{unit} " in n["text"] + " " for _, unit in beside
        ), n
        if entry.get("kind") == "assumed":
            assert n["text"].startswith(words), n
            continue
        assert shown_number(n["text"]) == pytest.approx(factor * entry["value"] + offset, rel=5.1e-3), n
    for w in reader.words:
        assert w["text"] == at(result, w["data-path"]), w


_DRAWING = re.compile(r'<figure class="drawing">.*?</figure>', re.S)


def test_the_drawing_has_the_dimensions_of_the_machine(study, written):
    (drawing,) = _DRAWING.findall(written.read_text("utf-8"))
    p = study.setup.drive.machine.p
    shown = re.findall(r">(\w+)</text>\s*<text[^>]*>([\d.]+) mm</text>", drawing)
    assert [name for name, _ in shown] == "r l h e l1 l2 c hy z".split()
    assert all(float(x) == pytest.approx(1e3 * getattr(p, name), rel=5e-4) for name, x in shown)


def test_every_number_is_traced_to_result_json(study, written):
    reader = Reader(_DRAWING.sub("", written.read_text("utf-8")))
    result = ResultEntries(json.loads(json.dumps(as_dict(study))))
    assert json.loads(reader.scripts["result"]) == result
    check_traced(reader, result)
    paths = {n["data-path"] for n in reader.numbers}
    for run, answers in result["answers"].items():
        assert {
            f"runs.answers.{run}.{a}" for a, entry in answers.items() if entry["value"] is not None
        } <= paths
    factors = (f"organs.overload_factors.{side}" for side in result["organs"]["overload_factors"])
    events = (f"event.{name}" for name in result["event"])
    for section in ("machine", "motor", "feed", "run", *events, "organs.limits", *factors):
        place, entries = found_at(result, section)
        wanted = {f"{place}.{n}" for n, e in entries.items() if isinstance(e, dict)}
        assert wanted <= paths, section
    for path in ("runs.answers.steady.crank_torque_peak", "runs.certificate.jam_left.energy_residual_share"):
        assert path in paths
    said = {f"{name}.{i}.text" for name in ("notes", "warnings") for i in range(len(result[name]))}
    assert said | {"verdict.model.text", "verdict.motor.text"} <= {w["data-path"] for w in reader.words}
    # what is not traced holds no number, but for the names of pins
    for section in ("header", "answer", "runs", "plots"):
        rest = re.sub(r"\b(A1|A2|O1|ISO 281)\b", "", reader.rest[section])
        assert not re.search(r"\d", rest), (section, re.findall(r".{20}\d.{20}", rest))


def test_the_page_needs_nothing_else(written):
    text = written.read_text("utf-8")
    assert written.stat().st_size < 8e6
    assert [p.name for p in written.parent.iterdir()] == ["report.html"]
    reader = Reader(text)
    assert reader.loads and all(link.startswith(("#", "data:")) for link in reader.loads)
    own = text.replace(reader.scripts["plotly"], "")
    assert "@import" not in own and "url(" not in own.replace("url(#", "")
    assert set(re.findall(r"https?://[\w./]+", own)) == {"http://www.w3.org/2000/svg"}
    assert "default-src 'none'" in text.replace("&#x27;", "'")
    assert "A mill &lt;b&gt;&amp; more&lt;/b&gt;" in text and "<b>& more" not in own
    # every reference to an element of the page has its element
    ids = set(re.findall(r'\bid="([^"]+)"', own))
    assert {link[1:] for link in reader.loads if link.startswith("#")} <= ids
    assert len(ids) == len(re.findall(r'\bid="[^"]+"', own))


def test_every_axis_says_what_it_shows_in_which_unit(study, written):
    figures = unpacked(Reader(written.read_text("utf-8")).scripts["figures"])
    assert set(figures) == {
        "torque-speed", "turn", "turn-at-constant-speed", "sides", "speed-loop", "time-start-up", "time-feed-left",
        "time-jam-left", "reactions", "power-turn", "load-histogram",
    }  # fmt: skip
    for name, figure in figures.items():
        axes = {
            k: v["title"]["text"] for k, v in figure["layout"].items() if k[1:5] == "axis" and "title" in v
        }
        for axis, title in axes.items():
            assert re.fullmatch(r".+ \[(N m|N|rad/s|A|s|deg|1|%|kW|kg m²|rad/\(N m s\))\]|pin", title), (
                name,
                axis,
            )
        columns = {"torque-speed": 2, "turn-at-constant-speed": 2, "speed-loop": 3, "load-histogram": 2}.get(
            name, 1
        )
        assert sum(axis.startswith("x") for axis in axes) == columns
        drawn = {trace.get("yaxis", "y") for trace in figure["data"]}
        assert {f"yaxis{y[1:]}" for y in drawn} <= set(axes)
        assert all(trace["name"] for trace in figure["data"])
        looks = [
            str(
                [t["line"]["dash"], round(t["line"]["width"])]
                if "dash" in t.get("line", {})
                else t.get("marker")
            )
            for t in figure["data"]
            if t.get("showlegend") is not False
        ]
        # not by colour alone
        assert len(set(looks)) == len(looks), name
    jam = figures["time-jam-left"]["layout"]
    assert any(shape["x0"] == 0.0 == shape["x1"] for shape in jam["shapes"])
    assert [a["text"] for a in jam["annotations"]] == ["event"]


def test_the_moving_machine_is_the_simulated_one(study, written):
    moving = unpacked(Reader(written.read_text("utf-8")).scripts["pictures"])
    assert [r["name"] for r in moving["runs"]] == ["start_up", "feed_left", "jam_left"]
    p = study.setup.drive.machine.p
    lengths = {("O1", "A"): p.r, ("A", "Bd"): p.l, ("C", "Bd"): p.h, ("Bd", "A2"): p.h - p.e}
    for side in ("left", "right"):
        lengths |= {(f"A1 {side}", f"B {side}"): p.l1, (f"B {side}", "A2"): p.l2}
    known = set(lengths)
    for run in moving["runs"]:
        series = study.runs.series[run["name"]]
        event = study.runs.event_times.get(run["name"], 0.0)
        time = np.array(run["time"])
        assert np.all(np.diff(time) > 0.0) and np.max(np.diff(time)) < 0.02
        count = len(time)

        def full(numbers, count=count):
            assert len(numbers) in (1, count)
            return np.broadcast_to(numbers, count)

        def joint(name, run=run, full=full):
            return np.array([full(run["joints"][name][axis]) for axis in "xy"])

        for link in moving["links"]:
            for start, end in itertools.pairwise(link["joints"]):
                length = np.hypot(*(joint(start) - joint(end)))
                assert (
                    np.ptp(length) < 4e-4
                    and abs(length[0] - lengths.setdefault((start, end), length[0])) < 4e-4
                )
        for name in moving["grounds"]:
            assert len(run["joints"][name]["x"]) == 1
        whole = series.sel(time=time + event, method="nearest")
        psi = np.arctan2(*(joint("A2") * [[1.0], [-1.0]]))
        assert np.max(np.abs(psi - whole["machine.rocker.psi"].values)) < 1e-3
        forces = {force["title"]: force for force in run["forces"]}
        pivot = np.array([full(forces["C rocker pivot"][axis]) for axis in "xy"])
        wanted = np.array([whole["machine.pivot.fx"].values, whole["machine.pivot.fy"].values])
        assert np.max(np.abs(pivot - wanted)) < 1e-3 * run["largest"]
        assert {force["at"] for force in run["forces"]} <= set(run["joints"])
        torque = whole["machine.tau"].values * 25.0
        readings = {reading["title"]: reading for reading in run["readings"]}
        assert readings["Crank torque"]["unit"] == "N\u00a0m"
        assert np.max(np.abs(full(readings["Crank torque"]["values"]) - torque)) < 1e-3 * np.max(
            np.abs(torque)
        )
    assert set(lengths) == known
    fed = moving["runs"][1]
    last = {reading["title"]: reading["values"][-1] for reading in fed["readings"]}
    material = {side: last[f"{side} organ: material that lies on the organ"] for side in ("Left", "Right")}
    assert material == {"Left": 60, "Right": 0}
    # all of it lies on the web
    assert p.web_share == 1.0 and fed["loads"]["left web"][-1] == 60 and fed["loads"]["left wall"] == [0]


def test_steady_running_begins_where_the_study_takes_it(study):
    """A soft starter that ramps for longer than the reference moves the mark and the still picture, too."""
    soft = SoftStart(voltage=0.5, time=0.7)
    config = dataclasses.replace(
        study.setup.config,
        drive=dataclasses.replace(study.setup.config.drive, start="soft", starter=Starter(soft_start=soft)),
    )
    slow = changed(study, config=config, started=None)
    start_up = next(each for each in report_of(slow).figures if each.name == "time-start-up")
    (mark,) = plotly_figure(start_up, DEFAULT_UNITS).layout.annotations
    assert mark.text == "steady from here" and mark.x == slow.runs.steady_begin == pytest.approx(
        0.7 + math.pi / 3.0
    )
    first = pictures(study_motion.motion(slow))["runs"][0]
    assert first["time"][first["still"] - 1] < slow.runs.steady_begin <= first["time"][first["still"]]


def test_the_verdict_comes_first_everywhere(study, written):
    """Two bars at 6 rad/s, above the resonance: the doubt stands before the numbers, and once."""
    verdict = as_dict(study)["verdict"]
    assert verdict["model"]["holds"] == "false"
    topics = [reason["topic"] for reason in verdict["model"]["reasons"]]
    assert {"pushed", "crank torque"} <= set(topics)
    pushed = [r for r in verdict["model"]["reasons"] if r["topic"] == "pushed"]
    for reason in pushed:
        rod = reason["quantity"].removesuffix("_mean_pull")
        assert reason["value"]["value"] == study.runs.pulls[reason["run"]][rod].mean < 0.0
    lines = said_of(study).splitlines()
    assert lines[:2] == [verdict["model"]["text"], verdict["motor"]["text"]]
    assert (
        sum(
            "Bars in compression, where a chain goes slack" in warning.text
            for warning in study.findings.warnings
        )
        == 1
    )
    assert not any("pull" in note.text for note in study.findings.notes)
    text = written.read_text("utf-8")
    answer = text[text.index('<section id="answer"') :]
    assert (
        answer.index("verdict.model.text") < answer.index("verdict.motor.text") < answer.index('class="lead"')
    )
    assert 'class="judged bad"' in answer


def test_the_start_up_stands_beside_the_runs(study, written):
    """Its crank torque and pulls are told, and it is a run of the pins."""
    said, text = said_of(study), written.read_text("utf-8")
    peak = told_as(study.runs.start.crank_torque_peak, "N.m")
    assert f"Start-up: crank torque, peak {peak};" in said and "start_up.crank_torque_peak" in text
    pin = "O1 crank bearing"
    pins = {
        **study.runs.pins,
        "start_up": {**study.runs.pins["start_up"], pin: {**study.runs.pins["start_up"][pin], "peak": 1e7}},
    }
    worst = changed(study, pins=pins)
    assert re.search(rf"{pin} .* {re.escape(told_as(1e7, 'N'))} .* start-up", said_of(worst))
    row = page_of(worst)
    row = row[row.index(f"pins.start_up.{pin}.peak") :].partition("</tr>")[0]
    assert "<td>start-up</td>" in row


def test_a_run_whose_energy_balance_is_not_kept_is_no_verdict_on_the_motor(study):
    before = as_dict(study)["verdict"]["motor"]
    assert before["left_out"] == [] and before["run"] == "jam_left"
    certificate = study.runs.certificate | {"jam_left": {"energy_residual_share": 1.36}}
    answers = study.runs.answers | {
        "jam_left": dataclasses.replace(study.runs.answers["jam_left"], torque_reserve=-12.0)
    }
    broken = changed(study, answers=answers, certificate=certificate)
    motor = as_dict(broken)["verdict"]["motor"]
    assert motor["left_out"] == ["jam_left"] and motor["run"] != "jam_left"
    others = [a.torque_reserve for name, a in answers.items() if name != "jam_left"]
    assert motor["least_reserve"]["value"] == min(others)
    assert motor["text"].endswith(
        "runs whose energy balance is not kept are left out (a lump jams the left side)."
    )
    # a torque that steady running has comes in each turn
    steady = study.runs.answers | {
        "steady": dataclasses.replace(study.runs.answers["steady"], torque_reserve=-0.3)
    }
    for worst, when in ((answers, "for a moment"), (steady, "in each turn")):
        said = as_dict(changed(study, answers=worst))["verdict"]["motor"]["text"]
        assert re.search(rf"{when} its torque exceeds the pull-out torque by ", said)
    # with none left nothing is known of the reserve
    nothing = {name: {"energy_residual_share": math.nan} for name in certificate}
    motor = as_dict(changed(study, certificate=nothing))["verdict"]["motor"]
    assert motor["holds"] == "in part" and motor["run"] is None and motor["least_reserve"]["value"] is None
    assert "its reserve of torque is not known" in motor["text"]


def test_the_speed_after_the_event_is_a_sentence(study):
    def caption(**answers):
        runs = study.runs.answers | {
            "jam_left": dataclasses.replace(study.runs.answers["jam_left"], **answers)
        }
        text = page_of(changed(study, answers=runs))
        place = text.rindex("answers.jam_left.speed_dip")
        text = text[text.rindex("<figcaption>", 0, place) :]
        return re.sub(r"<[^>]*>", "", text.partition("</figcaption>")[0]).replace("\u202f", " ")

    stays = "; it does not return to its steady band within the time followed."
    assert caption(speed_dip=1.5, recovery_time=None).endswith(f" The crank turns back{stays}")
    assert caption(speed_dip=1.0, recovery_time=None).endswith(f" The crank stands{stays}")
    assert "The speed dips by 10.0" in caption(speed_dip=0.1, recovery_time=0.0)


def test_what_does_not_act_is_not_given(study):
    """A motor on the line follows no reference, so that no ramp of one is shown."""
    given = page_of(study)
    assert 'data-path="given.run.ramp"' in given[given.index('<section id="given"') :]
    line = changed(study, drive=dataclasses.replace(study.setup.drive, follows=False))
    given = page_of(line)
    assert 'data-path="given.run.ramp"' not in given and 'data-path="given.run.crank_speed"' in given


def test_the_speeds_at_which_a_web_goes_slack_are_a_sentence(study):
    slack = {"slack_speed": 0.0, "slack_speed_empty": 4.64, "chain_resonance": 5.0}
    organs = study.findings.by_analysis["organs"]
    organs = dataclasses.replace(organs, limits=dataclasses.replace(organs.limits, **slack))
    assert (
        "With this feed, a web is slack at rest; empty, a web first goes slack at 4.64 rad/s (44.3 rev/min) of the "
        "crank; the lowest mode of a chain lies near 5.00 rad/s (47.7 rev/min)."
    ) in said_of(changed(study, by_analysis=study.findings.by_analysis | {"organs": organs}))


def test_a_motor_that_sizing_found_insufficient_is_not_praised(study, monkeypatch):
    # the jam of this study brings the motor near its limit
    assert as_dict(study)["verdict"]["motor"]["holds"] == "in part"
    monkeypatch.setattr(judgement, "AMPLE", 0.0)
    assert as_dict(study)["verdict"]["motor"]["holds"] == "true"
    nearest = SimpleNamespace(
        name="sizing",
        insufficient="No motor fits.",
        motor=None,
        duty=None,
        keys={},
        sentence=lambda study: "Insufficient motor.",
    )
    motor = as_dict(changed(study, proposal=nearest))["verdict"]["motor"]
    assert motor["holds"] == "in part" and "insufficient" in motor["text"]


def test_a_speed_that_is_not_reached_does_not_head_the_table(study):
    answers = dict(study.runs.answers)
    answers["steady"] = dataclasses.replace(answers["steady"], speed_mean=3.74)
    slow = changed(study, answers=answers)
    text = said_of(slow)
    assert (
        "crank at 3.74 rad/s (35.7 rev/min); 6 rad/s (57.3 rev/min) NOT reached" in text
        and "crank at 6 rad/s" not in text
    )
    assert "The motor does NOT reach the speed: 3.74 rad/s in place of 6 rad/s" in text
    answers["steady"] = dataclasses.replace(answers["steady"], speed_mean=7.0)
    assert "6 rad/s (57.3 rev/min) NOT kept, too fast" in said_of(changed(study, answers=answers))
    result = as_dict(slow)
    assert result["verdict"]["motor"]["holds"] == "false"

    def lead(study):
        text = page_of(study)
        return text[text.index('class="lead"') :].partition("</p>")[0]

    assert all(words in lead(slow) for words in ("answers.steady.speed_mean", "asked for", "▲"))
    assert "crank at 6.00 rad/s (57.3" in said_of(study)
    assert "answers.steady.speed_mean" in lead(study) and "run.crank_speed" not in lead(study)


def test_the_study_file_chooses_the_units(study):
    """The data stay in SI units."""
    chosen = config.parse(SHORT + '[report]\nunits = { speed = "rev/min", power = "W" }\n')
    other = changed(study, config=dataclasses.replace(study.setup.config, units=chosen.units))
    text = said_of(other)
    assert "crank at 57.3 rev/min" in text and "crank at 6.00 rad/s (57.3 rev/min)" in said_of(study)
    power = study.runs.answers["steady"].power_peak
    assert told_as(power, "W", units=chosen.units) in text and told_as(
        power, "W", units=chosen.units
    ).endswith(" W")
    told, own = as_dict(other), as_dict(study)
    # all but the words on the motor, which are made of the numbers here
    assert "rev/min" in told["verdict"]["motor"].pop("text")
    assert "rad/s" in own["verdict"]["motor"].pop("text")
    told["verdict"]["model"].pop("text"), own["verdict"]["model"].pop("text")
    assert told == own
    for table, words in (
        ('units = { speed = "rpm" }', 'report.units.speed = "rpm": must be "rad/s" or "rev/min"'),
        (
            "unit = 1",
            'report.unit: unknown key; was "units" meant? known here: units, project, author, date, revision',
        ),
    ):
        with pytest.raises(InputError) as refused:
            config.parse(f"{SHORT}[report]\n{table}\n")
        assert str(refused.value) == words


def test_each_overload_factor_says_its_use(study, written):
    """On the terminal, on the page, in the data: which question each answers, and which one sizes the drive."""
    sides = as_dict(study)["organs"]["overload_factors"]
    assert list(sides) == ["left", "right"]
    told, page_text = said_of(study), written.read_text("utf-8")
    for side, of in sides.items():
        for name, factor in of.items():
            size = told_as(factor["value"], "1")
            assert (
                size in told
                and f'data-path="findings.organs.overload_factors.{side}.{name}" value="{factor["value"]!r}"'
                in page_text
            )
    factors = sides["left"]
    assert {name: factor["for"] for name, factor in factors.items()} == {
        name: factor["for"] for name, factor in sides["right"].items()
    }
    assert next(iter(factors)) == "feed_crank_torque"
    assert [name for name, factor in factors.items() if "sizes the drive" in factor["for"]] == [
        "feed_crank_torque"
    ]
    fed = {side: of["feed_crank_torque"]["value"] for side, of in sides.items()}
    assert max(fed.values()) > 1.0
    assert f"feed all on the {max(fed, key=fed.get)} sizes" in factors["feed_crank_torque"]["for"]
    assert (
        "bearings" in factors["feed_rocker_torque"]["for"] and "papers" in factors["static_at_extreme"]["for"]
    )
    for name, factor in factors.items():
        assert (
            factor["for"] in told
            and f'data-path="findings.organs.overload_factors.left.{name}.for">{factor["for"]}<' in page_text
        )


def test_one_number_of_the_reserve_everywhere(study, written):
    """The least (limit - torque)/limit of a run, in %, on the terminal, on the page and in the data."""
    answers, p = study.runs.answers, study.setup.drive.parameters
    result = as_dict(study)
    warm = 1.0 + p.armature.alpha * (answers["steady"].winding_temperature - 293.15)
    for run in answers:
        rows = (
            study.runs.steady
            if run == "steady"
            else study.runs.series[run].sel(time=slice(study.runs.event_times[run], None))
        )
        torque, speed = rows["motor.air_gap_tau"].values, rows["motor.w"].values
        current = np.minimum(p.limit.i, (p.limit.v - p.armature.k * speed) / (p.armature.R * warm))
        driving = (torque > 0.0) & (speed > 0.0)
        wanted = float(np.min(1.0 - torque[driving] / (p.armature.k * current[driving])))
        assert result["answers"][run]["torque_reserve"]["value"] == pytest.approx(wanted, abs=1e-6)
    shown_there = {
        n["data-path"].split(".")[2]: n["text"].replace("\u00a0", " ").replace("−", "-")
        for n in Reader(written.read_text("utf-8")).numbers
        if n["data-path"].endswith(".torque_reserve")
    }
    row = next(line for line in said_of(study).splitlines() if "reserve of torque  " in line)
    cells = [cell.strip() for cell in row.strip("│ ").split("│")][1:]
    assert cells == [shown_there[run] for run in ("steady", "feed_left", "jam_left")]
    assert all(cell.endswith(" %") for cell in cells)


def test_a_long_study_is_thinned_out(study, monkeypatch):
    monkeypatch.setattr(study_motion, "MOST", 50)
    counts = [len(run["time"]) for run in pictures(study_motion.motion(study))["runs"]]
    assert sum(counts) < 60 and min(counts) > 5


def test_the_drive_stands_first_with_its_shares(study):
    chosen = sized(study)
    text, result = page_of(chosen), as_dict(chosen)
    reader = Reader(text)
    check_traced(reader, result)
    assert text.index('id="answer"') < text.index('id="sizing"') < text.index('id="plots"')
    paths = [n["data-path"] for n in reader.numbers]
    large = re.findall(r'<span class="large[^>]*><(?:data|span)[^>]*data-path="findings.(sizing[^"]+)"', text)
    assert large == [
        "sizing.candidates.0.motor",
        "sizing.candidates.0.ratio",
        "sizing.protection.trip_torque",
    ]
    assert "0.37 kW &lt;IE3&gt;" in text
    # in the order of sizing, which ranked them: chosen, fits, rejected
    ratios = [p for p in paths if p.endswith(".ratio") and "candidates" in p]
    first = text[text.index('id="answer"') : text.index('id="sizing"')]
    assert first.index('class="large') < first.index('data-path="verdict.model.text"')
    shares = re.findall(r'data-path="findings.sizing.candidates.0.checks.(\w+).utilisation"', first)
    assert shares == ["pull_out"]
    assert ratios[1:] == [f"findings.sizing.candidates.{i}.ratio" for i in (0, 1, 2)]
    over = re.findall(r"<strong><data[^>]*>([^<]*)", text[text.index('class="candidates"') :])
    assert over == ["▲ 131\u00a0"]
    assert "service factor" in text.lower() and "Typical values." in text
    # a sentence is no cell of a table of numbers, which it would make wider than the page
    assert text.count('data-path="findings.sizing.protection.coupling"') == 1


def test_no_candidate_fits(study):
    text = page_of(sized(study, "0.25 kW"))
    assert "No candidate fits. The reasons:" in text and "too weak by 31 %" in text


def test_a_run_that_stopped_early_has_a_page(study, tmp_path):
    series = {"unfinished": study.runs.series["start_up"].isel(time=slice(0, 1))}
    empty = {"answers": {}, "pins": {}, "event_times": {}, "certificate": {}}
    stopped = changed(study, failure=RunError("motor: it <broke>"), series=series, **empty)
    text = html.write(report_of(stopped), tmp_path).read_text("utf-8")
    assert "The run stopped early:" in text and "it &lt;broke&gt;" in text
    assert not any(words["data-path"] == "status" for words in Reader(text).words)
    stopped.runs.series = {}
    assert unpacked(Reader(page_of(stopped)).scripts["pictures"]) is None


def test_the_head_names_project_author_date_and_revision(study):
    text = '[report]\nproject = "Mill 3"\nauthor = "A. <b>"\ndate = 2026-11-22\nrevision = "B"\n'
    labels = config.parse(text).file.labels
    assert labels == {"project": "Mill 3", "author": "A. <b>", "date": "2026-11-22", "revision": "B"}
    named = changed(study, config=study.setup.config.with_file(labels=labels))
    page = html.render(report_of(named))
    head = re.search(r'<p class="from">.*?</p>', page)[0]
    plain = re.sub(r"<[^>]*>", "", head)
    assert plain.startswith(
        "Project: Mill 3 · Author: A. &lt;b&gt; · Date: 2026-11-22 · Revision: B · Study file"
    )
    assert as_dict(named)["report"] == labels


def test_the_page_carries_the_library_packed(written):
    packed = Reader(written.read_text("utf-8")).scripts["plotly"]
    assert gzip.decompress(base64.b64decode(packed)).decode() == get_plotlyjs()
    assert written.stat().st_size < 2.5e6


def test_a_piece_of_another_page_has_nothing_that_a_script_draws(study):
    report = report_of(study)
    kinds = {type(block).__name__ for block in report.blocks("long")}
    assert {"Figure", "Animation", "Live"} <= kinds
    piece = html.fragment(report)
    assert "<table" in piece and "crank torque, peak" in piece
    for mark in ('class="plot"', 'id="stage"', "live-root", "Move a slider", "Drag to zoom"):
        assert mark in html.render(report) and mark not in piece, mark


def test_a_machine_that_cannot_run_is_not_said_to_run():
    def refuse():
        raise InputError("erf: WebAssembly does not have it")

    report = Report("", "a study", {}, (), (Section("live", "Try it", (Live(refuse, "the study"),)),))
    page = html.render(report)
    assert "This machine cannot run in a page: erf: WebAssembly does not have it." in page
    assert "run in this page" not in page and "live-root" not in page and "wasm-unsafe-eval" not in page


def test_an_error_leaves_the_old_page(study, tmp_path, monkeypatch):
    (tmp_path / "report.html").write_text("old")

    def fails():
        raise OSError("no plotly")

    monkeypatch.setattr(html, "_packed_plotly", fails)
    with pytest.raises(OSError):
        html.write(report_of(study), tmp_path)
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("report.html", "old")]


def test_paths_numbers_and_units():
    result = {"machine": {"crank.m": {"value": 1}, "crank": {"x": [{"value": 2}]}}}
    assert at(result, "machine.crank.m.value") == 1 and at(result, "machine.crank.x.0.value") == 2
    with pytest.raises(KeyError):
        at(result, "machine.crank.m.unit")
    shown = {
        44.2248: "44.2",
        0.5: "0.500",
        99.97: "100",
        1374.4: "1374",
        -995.2: "−995",
        0.0: "0",
        12345.6: "12\u202f346",
    }
    assert {x: digits_text(x) for x in shown} == shown
    assert (
        digits_text(2.3392e-7) == "2.34\u00a0×\u00a010⁻⁷"
        and digits_text(2e6, full=False) == "2\u00a0×\u00a010⁶"
    )
    assert digits_text(1.5, 6, full=False) == "1.5" and digits_text(0.853815, 6, full=False) == "0.853815"
    units = {
        "N.m": "N\u00a0m",
        "kg.m2": "kg\u00a0m²",
        "1": "",
        "Ohm/s": "Ω/s",
        "rad/s2": "rad/s²",
        "deg": "°",
        "degC": "°C",
    }
    assert {unit: unit_text(unit) for unit in units} == units


@pytest.mark.slow
def test_factors_of_two_bars_are_not_passed_for_those_of_chains(chains, study):
    words = "of two bars in place of the chains"
    assert words in said_of(chains) and words not in said_of(study)


@pytest.mark.slow
def test_chains_stand_beside_two_bars(chains, tmp_path):
    result = ResultEntries(json.loads(json.dumps(as_dict(chains))))
    found = result["chain"]
    # the sweep, the resonance in it, the study's own speed
    speeds = [2.0, found["resonance"]["value"], 10.0, 12.0]
    assert result["status"] == "complete"
    assert [n["speed"]["value"] for n in found["sweep"]] == pytest.approx(speeds, rel=1e-9)
    own = found["own_speed"]
    assert (
        own == found["sweep"][2] and own["crank_torque_high"]["value"] >= own["crank_torque_median"]["value"]
    )
    assert own["two_bar_rocker_torque"]["value"] > 0.0 and own["slack_time"]["value"] > 0.01
    # from halfway to the last good speed
    assert found["avoid"][0]["from"]["value"] == pytest.approx(0.5 * (speeds[0] + speeds[1]))
    slack = [rod for side in found["slack_by_rod"].values() for rod in side if rod["value"] > 0.0]
    assert slack and {rod["rod"] for rod in slack} <= {
        f"{bar} {k}" for bar in ("wall", "web") for k in range(9)
    }
    (avoid,) = (warning for warning in result["warnings"] if warning["code"] == "speed-to-avoid")
    assert avoid["text"].startswith("Chains: the crank speed lies in a range to avoid")

    text = page_of(chains, result)
    reader = Reader(text)
    check_traced(reader, result)
    paths = {n["data-path"] for n in reader.numbers}
    peaks = [
        f"{name}_{of}" for name in ("crank_torque", "rocker_torque", "snatch") for of in ("median", "high")
    ]
    estimates = [*peaks, "slack_time"]
    # starts that differ tell no quantile
    missing = {
        f"{name}{end}"
        for name in estimates
        if own[f"{name}_from"]["value"] is None
        for end in ("", "_from", "_to")
    }
    # an interval that says no more than the number is left out
    missing |= {
        f"{name}{end}"
        for name in estimates
        if name not in missing
        and own[f"{name}_to"]["value"] - own[f"{name}_from"]["value"] <= 0.02 * own[name]["value"]
        for end in ("_from", "_to")
    }
    assert {f"findings.chain.own_speed.{name}" for name in own} - paths == {
        f"findings.chain.own_speed.{name}" for name in missing
    }
    for name in estimates:
        ends = [own[f"{name}{end}"]["value"] for end in ("_from", "", "_to")]
        assert name in missing or ends == sorted(ends)
    for k, numbers in enumerate(found["sweep"]):
        for name in estimates:
            value, low, high = (numbers[f"{name}{end}"]["value"] for end in ("", "_from", "_to"))
            path = f"findings.chain.sweep.{k}.{name}"
            assert (path in paths) == (low is not None), path
            assert (f"{path}_from" in paths) == (low is not None and high - low > 0.02 * value), path
    assert {f"findings.chain.{name}" for name in ("distance_to_resonance", "avoid.0.from", "starts")} <= paths
    assert "given.chain.eta" in paths
    assert {f"findings.chain.avoid.{i}.why" for i in range(len(found["avoid"]))} <= {
        w["data-path"] for w in reader.words
    }
    assert not re.search(r"\d", re.sub(r"\bA2\b", "", reader.rest["chains"]))
    assert "chains" in unpacked(reader.scripts["figures"])

    assert "chain_sweep.png" in {file.name for file in write(chains, tmp_path)}
    told = said_of(chains, 140)
    for words in (
        "chains, 95 %",
        "10 starts of 30 turns",
        "Rods that go slack",
        "Warning: Avoid 3.54 rad/s (33.8 rev/min) to",
        "at order n, n times the crank speed is the natural frequency",
        "(mode 1, order 1)",
    ):
        assert words in told, words


@pytest.mark.slow
def test_each_snatch_is_in_parts_of_its_own_rest(chains):
    """At rest a chain of 8 rods pulls as two bars do with this feed, but not without: the parts differ by a fifth."""
    machine, feed, own = (
        chains.setup.drive.machine,
        chains.setup.config.feed,
        chains.findings.by_analysis["chain"].own,
    )
    out = cycle(machine, own.speed, feed).outputs
    at_rest = machine.chamber(0.0, left=feed.left, right=feed.right)

    def size(joint):
        return np.hypot(joint.fx, joint.fy)

    sides = ("left", "right")
    wanted = [
        np.max(size(getattr(out, side).rocker_joint)) / size(getattr(at_rest, side).rocker_joint)
        for side in sides
    ]
    assert own.two_bar_snatch == pytest.approx(float(max(wanted)), rel=1e-12)
    empty = Feed(left=EMPTY, right=EMPTY)
    for given, more in ((feed, 0.9996), (empty, 1.1824)):
        chain, bars = rest_forces(machine, "left", given, 8)
        assert bars / chain == pytest.approx(more, abs=1e-4)
        assert chain == pytest.approx(float(np.hypot(*machine.hanging("left", 0.0, given.left, 8).last)))
        assert rest_forces(machine, "left", given, 2)[0] == pytest.approx(bars, rel=1e-9)
    weightless = machine.replace(g=0.0)
    assert all(math.isnan(x) for x in rest_forces(weightless, "left", feed, 8))


def test_the_rods_of_chains_move_as_simulated(chains):
    moving = pictures(study_motion.motion(chains))
    walls, webs = chains.setup.drive.simulated_machine.rods
    organs = {link["name"]: link["joints"] for link in moving["links"]}
    p = chains.setup.drive.machine.p
    for side in ("left", "right"):
        assert (len(organs[f"{side} wall"]), len(organs[f"{side} web"])) == (walls + 1, webs + 1)
    for run in moving["runs"]:
        for name, rod in (("wall", p.l1 / walls), ("web", p.l2 / webs)):
            for ends in (
                pair for side in ("left", "right") for pair in itertools.pairwise(organs[f"{side} {name}"])
            ):
                places = [
                    [np.broadcast_to(run["joints"][end][axis], len(run["time"])) for axis in "xy"]
                    for end in ends
                ]
                # the chain ends at the rocker's pin to a tenth of a millimetre
                assert np.max(np.abs(np.hypot(*np.subtract(*places)) - rod)) < 3e-4, (run["name"], ends)


@pytest.mark.stages(second=1)
def test_any_linkage_moves(knife):
    """Also behind the open coupling; links keep their lengths, and the blade stays on its path."""
    moving = pictures(study_motion.motion(knife))
    assert [run["name"] for run in moving["runs"]] == ["start_up", "hard_cut", "hard_cut_coasting"]
    assert (
        moving["hanging"] == ("O3", "O4") and moving["circles"] == (("O1", "A"),) and moving["groups"] == ()
    )
    (path,) = moving["paths"]
    size = np.ptp(path["y"])
    for run in moving["runs"]:
        count = len(run["time"])
        at = {
            name: np.array([np.broadcast_to(xy[axis], count) for axis in "xy"])
            for name, xy in run["joints"].items()
        }
        for link in moving["links"]:
            for start, end in itertools.pairwise(link["joints"]):
                assert np.ptp(np.hypot(*(at[start] - at[end]))) < 4e-4, (run["name"], link["name"])
        off = np.hypot(*(np.array([path["x"], path["y"]])[:, :, None] - at["blade"][:, None, :]))
        assert np.max(np.min(off, axis=0)) < 0.05 * size
        assert len(run["forces"]) == 10 and {force["at"] for force in run["forces"]} <= set(at)
        whole = knife.runs.series[run["name"]].sel(
            time=np.array(run["time"]) + (knife.runs.event_times["hard_cut"] if run["event"] else 0.0),
            method="nearest",
        )
        assert np.max(np.abs(at["blade"][1] - whole["machine.blade.y"].values)) < 2e-4
        titles = {reading["title"] for reading in run["readings"]}
        assert ("Crank torque" in titles) == (not run["name"].endswith("coasting"))
    text = page_of(knife)
    assert "path of blade" in text and 'id="stage"' in text


def test_one_bearing_has_room_for_its_bars(study):
    """A panel without height stops the script of the page, and with it the animation."""
    pins = {run: dict([next(iter(table.items()))]) for run, table in study.runs.pins.items()}
    figures = report_of(changed(study, pins=pins)).figures
    (reactions,) = (figure for figure in figures if figure.name == "reactions")
    layout = plotly_figure(reactions, DEFAULT_UNITS).layout
    assert layout.height - layout.margin.t - layout.margin.b > 100


def test_two_bars_have_no_row_of_chains(study, written):
    for text in (said_of(study, 140), written.read_text("utf-8")):
        for words in ("are of the time with a slack rod", "argest angle between", "Chains and two bars"):
            assert words not in text


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("chromium") is None, reason="no chromium here")
def test_the_page_in_a_browser(study, written, tmp_path):
    arguments = (
        "--headless --no-sandbox --disable-gpu --enable-logging=stderr --virtual-time-budget=10000 --dump-dom"
    )
    done = subprocess.run(
        ["chromium", *arguments.split(), f"--user-data-dir={tmp_path}", written.as_uri() + "#play=jam_left"],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0
    assert not [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    figures = done.stdout.split('data-figure="')[1:]
    declared = [figure.name for figure in report_of(study).figures if figure.on_page]
    assert [figure.partition('"')[0] for figure in figures] == declared and "sides" in declared
    for figure in figures:
        box = figure.partition("<figcaption>")[0]
        assert 'class="main-svg"' in box and ('class="scatterlayer' in box or 'class="barlayer' in box)
    stage = re.search(r'<svg id="stage".*?</svg>', done.stdout, re.S)[0]
    played = int(re.search(r'data-frame="(\d+)"', stage)[1])
    assert 0 < played and 'data-run="jam_left"' in stage
    assert stage.count('class="link') == 7 and stage.count('class="arrow') == 11


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("chromium") is None, reason="no chromium here")
@pytest.mark.parametrize(("width", "scrolls"), [(500, True), (1400, False)])
def test_a_table_that_is_wider_than_the_screen_says_that_it_scrolls(written, tmp_path, width, scrolls):
    arguments = f"--headless --no-sandbox --disable-gpu --window-size={width},900 --virtual-time-budget=10000"
    done = subprocess.run(
        ["chromium", *arguments.split(), "--dump-dom", f"--user-data-dir={tmp_path}", written.as_uri()],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0 and ('class="wide scrolls' in done.stdout) is scrolls
    # the hint itself stands in the style, for all that scrolls
    assert '.scrolls::before { content: "' in done.stdout


def test_plots_mark_running_margin_and_where_two_bars_end(study):
    """Each mark against the numbers of the study, computed otherwise."""
    figures = {figure.name: figure for figure in report_of(study).figures}
    running = study.setup.config.run.crank_speed

    def items(figure, kind, name=""):
        panels = [panel for *_, panel in figures[figure].all_panels()]
        return [[x for x in panel.items if isinstance(x, kind) and name in x.name] for panel in panels]

    mean = study.runs.answers["steady"].speed_mean
    for marks in items("torque-speed", Mark, "steady running, mean"):
        assert [mark.at for mark in marks] == [pytest.approx(mean * study.setup.drive.ratio)]
    for marks in items("sides", Mark, "normal running"):
        assert [mark.at for mark in marks] == [running]
    mode = at(as_dict(study), "organs.limits.chain_resonance")["value"]
    crank, rocker = items("sides", Shade)
    assert crank[0].low == pytest.approx(CRANK_GOOD * mode) and rocker[0].low == pytest.approx(
        ROCKER_GOOD_EMPTY * mode
    )
    gain, phase, _ = items("speed-loop", Mark, "crossover")
    narrowest = min(study.setup.statics.loops.values(), key=lambda loop: loop.phase_margin)
    crossing = np.interp(0.0, -np.log(narrowest.gain), np.log(narrowest.frequency))
    assert gain[0].at == phase[0].at == pytest.approx(math.exp(crossing), rel=2e-3)
    (label,) = (
        x for *_, panel in figures["speed-loop"].all_panels() for x in panel.items if isinstance(x, Label)
    )
    margin = 180.0 + np.interp(crossing, np.log(narrowest.frequency), narrowest.phase)
    assert label.words == f"margin {margin:.1f} deg"
