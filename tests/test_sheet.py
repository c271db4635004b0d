"""The sheet of a study as PDF: its parts, their order, its pages, and what it refuses."""

from __future__ import annotations

import builtins
import re
from dataclasses import replace
from html import unescape
from importlib import resources
from pathlib import Path
from types import SimpleNamespace

import pytest
from records import changed
from reports import report_of

from chainunit import InputError
from chainunit.capabilities.checks.plan import turning_pins
from chainunit.report import blocks as b
from chainunit.report import pdf, print_figures
from chainunit.report.figure import Figure
from chainunit.report.lines import Number
from chainunit.report.sheet import sheet
from chainunit.report.study_task import SHEET_TASK, TASK
from chainunit.study import config
from chainunit.study.organ_limits import limits_of_organs
from chainunit.study.run import run_study

TEXT = """
title = "A mill <b>& more</b>"
[report]
project = "Quarry 7"
author = "N. N."
revision = "B"
[run]
ramp = 0.3
settle_turns = 1
step = 0.004
crank_speed = 6
[machine]
ratio = 25
[bearing.C]
kind = "ball"
C = "60 kN"
C0 = "50 kN"
[bearing.A1]
kind = "roller"
C = "60 kN"
[[event]]
type = "jam"
side = "left"
turns = 1
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    return run_study(config.parse(TEXT), tmp_path_factory.mktemp("sheet"))


@pytest.fixture(scope="module")
def made(study):
    return sheet(study, report_of(study))


def test_the_sheet_has_each_section_once(study, made):
    names = [each.name for each in (*made.sections, *made.annex)]
    assert len(names) == len(set(names))
    assert names[:4] == ["answer", "question", "checks", "assumptions"] and {"unchecked", "runs"} <= set(
        names
    )
    whole = {each.name for each in report_of(study).sections}
    apart = {"live", "motion", "not_checked"}
    assert whole - set(names) == apart, "what moves is not on paper, and what was not checked has its section"
    assert made.block["Project"] == "Quarry 7" and made.block["Revision"] == "B"


def test_assumptions_are_the_numbers_that_the_file_leaves_out(study, made):
    (section,) = (each for each in made.sections if each.name == "assumptions")
    shown = {value.name for block in section.blocks for _, values in block.sections for value in values}
    assert {"machine.crank.m", "motor.armature.R", "run.turns"} <= shown
    assert not shown & study.setup.config.file.given and not any(name.startswith("event.") for name in shown)


def test_values_that_were_chosen_and_those_of_a_motor_of_a_catalogue_are_no_assumptions(study):
    names = {"sizing.margin": "declared", "machine.ratio": "sizing", "motor.rotor.J": "declared"}
    names |= {"motor.ambient.T": "declared", "gear.J": "file", "starter.inverter.lag": "declared"}
    names |= {"motor.soft_start.voltage": "declared", "starter.soft_start.voltage": "file"}
    values = tuple(b.GivenValue(name, name, Number(1.0, "1"), origin) for name, origin in names.items())
    chosen = changed(
        study, proposal=SimpleNamespace(name="sizing", insufficient="", motor=object(), duty=None, keys={})
    )
    whole = report_of(study)
    given = b.Section("given", "Given values", (b.Given((("all", values),)),))
    sections = (*(each for each in whole.sections if each.name != "given"), given)
    made = sheet(chosen, replace(whole, sections=sections))
    (section,) = (each for each in made.sections if each.name == "assumptions")
    lists, _ = section.blocks
    assert [each.name for each in lists.sections[0][1]] == ["sizing.margin", "motor.ambient.T"]
    assert "Other given values" in pdf.page_text(replace(made, sections=(section,), annex=()), {})
    (others,) = (each for each in made.annex if each.name == "given")
    (left,) = others.blocks
    names = [each.name for _, values in left.sections for each in values]
    # each stands once, those of a starter that is not used only if the file gives them
    assert names == ["machine.ratio", "motor.rotor.J", "gear.J", "starter.soft_start.voltage"]


def test_it_says_up_to_which_speed_it_holds(study, made):
    (basis,) = (each for each in made.sections if each.name == "basis")
    text = pdf.page_text(replace(made, sections=(basis,), annex=()), {})
    limits = {
        each.topic: each.speed
        for each in limits_of_organs(study.setup.drive.machine, study.setup.config.feed, ["N.m"])
    }
    shown = dict(re.findall(r'data-path="findings.organs.limits.(\w+)" value="([^"]+)"', text))
    assert float(shown["crank_torque_speed"]) == limits["crank torque"]
    assert float(shown["rocker_torque_speed"]) == limits["rocker torque"] < limits["crank torque"]
    assert float(shown["slack_speed"]) == limits["slack speed"]
    chain = changed(study, verdict=replace(study.findings.verdict, model="chains"))
    report = report_of(chain)
    assert "No highest speed was computed" in pdf.page_text(sheet(chain, report), {})


def test_it_names_each_pin_whose_bearing_was_not_checked(made):
    (section,) = (each for each in made.sections if each.name == "unchecked")
    text = pdf.page_text(replace(made, sections=(section,), annex=()), {})
    assert "bearings at O1 crank bearing, A crank pin, Bd coupler pin" in text


def test_without_sizing_it_says_that_no_drive_was_chosen_and_without_order_numbers(study):
    plans = {**study.setup.config.plans, "sizing": None}
    without = changed(study, config=replace(study.setup.config, plans=plans))
    made = sheet(without, report_of(without))
    (section,) = (each for each in made.sections if each.name == "unchecked")
    text = pdf.page_text(replace(made, sections=(section,), annex=()), {})
    assert "and order numbers: the motor is that of" in text


def test_figures_of_its_sections_and_the_versions_are_in_the_annex(study):
    whole = report_of(study)
    (plots,) = (each for each in whole.sections if each.name == "plots")
    picture = next(each for each in plots.blocks if isinstance(each, Figure))
    energy = b.Section("energy", "Energy", (b.Text("so much", form="long"), picture))
    made = sheet(study, replace(whole, sections=(*whole.sections, energy)))
    on_sheet = {each.name: each for each in made.sections}
    in_annex = {each.name: each for each in made.annex}
    assert on_sheet["energy"].blocks == energy.blocks[:1]
    assert in_annex["plots"].blocks.count(picture) == 2, "all figures stand together"
    assert not any(isinstance(x, Figure) for each in made.annex if each.name != "plots" for x in each.blocks)
    assert len(in_annex["software"].blocks) == 1
    assert not set(in_annex["software"].blocks) & set(on_sheet["basis"].blocks)


def test_its_text_escapes_the_file_and_numbers_its_sections(made):
    text = pdf.page_text(made, {})
    assert "<b>& more" not in text and "A mill &lt;b&gt;&amp; more&lt;/b&gt;" in text
    places = re.findall(r'<section id="section-(\w+)"', text)
    links = re.findall(r'<a href="#section-(\w+)"', text)
    assert places == links and places[0] == "1" and "A1" in places
    # WeasyPrint nests a first letter again at each layout: the text itself has the capitals
    on_paper = re.sub(r"@media screen \{[^{}]*\{[^{}]*\} \}", "", text)
    assert "::first-letter" in text and "::first-letter" not in on_paper
    assert not re.findall(r"<(?:th|h3)\b[^>]*>[a-z][^<]*", on_paper)
    assert 'id="live-root"' not in text and "<script" not in text and "Point at a number" not in text


def test_numbers_of_the_sheet_are_those_of_the_result(study, made):
    result = report_of(study).result
    text = pdf.page_text(made, {})
    peak = result["answers"]["jam_left"]["crank_torque_peak"]["value"]
    shown = re.findall(r'data-path="runs.answers.jam_left.crank_torque_peak" value="([^"]+)"', text)
    assert shown and all(float(each) == peak for each in shown)


def test_a_missing_library_is_refused_before_the_runs(monkeypatch, tmp_path):
    real = builtins.__import__

    def without(name, *more, **options):
        if name == "weasyprint":
            raise OSError("cannot load library 'libpango-1.0-0'")
        return real(name, *more, **options)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(InputError, match=r"--pdf: needs .*libpango.*pip install 'chainunit\[pdf\]'"):
        SHEET_TASK.accept(config.parse(TEXT))


def test_a_study_clears_the_sheet_of_an_earlier_one():
    assert pdf.NAME in TASK.files and pdf.NAME in SHEET_TASK.files


def test_blocks_for_the_sheet_stand_in_place_of_the_long_ones(study):
    long, own, both = (b.Text("long", form="long"), b.Text("own", form="sheet"), b.Text("both"))
    whole = report_of(study)
    checks = b.Section("checks", "Checks by clause", (long, own, both))
    others = (each for each in whole.sections if each.name != "checks")
    made = sheet(study, replace(whole, sections=(*others, checks)))
    on_sheet = {each.name: each for each in made.sections}
    assert [each.line for each in on_sheet["checks"].blocks] == ["own", "both"]
    assert not any(long in each.blocks for each in made.annex)
    # neither the page nor the terminal has the block of the sheet
    assert b.of_form(checks.blocks, "long") == [long, both] and b.of_form(checks.blocks, "short") == [both]


def test_each_check_of_the_sheet_names_its_clause_and_formula(study, made):
    (section,) = (each for each in made.sections if each.name == "checks")
    rows = report_of(study).result["checks"]["rows"]
    (table,) = (each for each in section.blocks if isinstance(each, b.Table))
    assert len(table.rows) == len(rows) > 0
    laws = [each.line for each in section.blocks if isinstance(each, b.Text) and each.role == "note"]
    assert len(laws) == len(set(laws)) == len({(row["clause"], row["formula"]) for row in rows})
    for row, check in zip(table.rows, rows, strict=True):
        assert not row.note
        (law,) = (each for each in laws if each.startswith(f"{row.cells[-1]} "))
        assert law == f"{row.cells[-1]} {check['clause']}. {check['formula']}"


def test_things_that_were_not_checked_for_one_reason_share_a_line(study, made):
    (section,) = (each for each in made.sections if each.name == "unchecked")
    text = re.sub(r"<[^>]+>", "", pdf.page_text(replace(made, sections=(section,), annex=()), {}))
    missing = [each for each in study.findings.by_analysis["checks"].not_checked if not each.table]
    assert missing and all(each.what in text and text.count(each.why) == 1 for each in missing)


MOST_PAGES = pdf.MOST_PAGES


def depth_of(page):
    """The share of the height of a page down to its lowest text above the foot; 1 for a page with a picture."""
    # the pages share their resources, so that page.images has the pictures of all
    return 1.0 if re.search(rb"/\S+ Do\b", page.get_contents().get_data()) else lowest_text(page)


def lowest_text(page):
    """The share of the height of a page down to its lowest text above the foot."""
    lowest = [1.0]

    def note(text, transform, lines, font, size):
        y = (lines[5] * transform[3] + transform[5]) / float(page.mediabox.height)
        if text.strip() and y > 0.06:
            lowest.append(y)

    page.extract_text(visitor_text=note)
    return 1.0 - min(lowest)


def pages_of(file):
    reader = pytest.importorskip("pypdf").PdfReader(file)
    return reader, [page.extract_text() for page in reader.pages]


@pytest.mark.slow
@pytest.mark.filterwarnings(
    "ignore::pytest.PytestUnraisableExceptionWarning"
)  # the library leaves a file open
def test_the_pdf_is_two_to_four_pages_and_an_annex_and_has_eight_at_most(study, made, tmp_path):
    try:
        pdf.check_library()
    except InputError as missing:
        pytest.skip(str(missing))
    pictures = print_figures.write(report_of(study).figures, tmp_path, made.units, are_small=True)
    file = pdf.write(made, {each.name: each for each in pictures}, tmp_path / pdf.NAME)
    reader, pages = pages_of(file)
    assert len(pages) <= MOST_PAGES and len(pictures) > 5
    # no page but the last is half empty
    assert all(depth_of(page) > 0.5 for page in reader.pages[:-1])
    assert reader.metadata.title == "A mill <b>& more</b>"
    heading = rf"A1\s+{made.annex[0].heading}"
    annex = next(n for n, text in enumerate(pages) if n and re.search(heading, text))
    assert 1 <= annex <= 3 < len(pages)
    assert f"Page 2 of {len(pages)}" in pages[1]
    box = reader.pages[0].mediabox
    assert (round(float(box.width)), round(float(box.height))) == (595, 842)
    packet = reader.trailer["/Root"][
        "/XMP_Metadata" if "/XMP_Metadata" in reader.trailer["/Root"] else "/Metadata"
    ]
    assert re.search(rb"pdfaid:part>3<|pdfaid:part=.3", packet.get_data())
    first = " ".join(pages[: annex + 1])
    for words in ("Quarry 7", "Prepared", "What was not checked", "Basis and validity", "The question"):
        assert words in first


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_an_annex_that_would_be_too_long_is_set_closer(study, made, tmp_path, monkeypatch):
    try:
        pdf.check_library()
    except InputError as missing:
        pytest.skip(str(missing))
    pictures = print_figures.write(report_of(study).figures, tmp_path, made.units, are_small=True)
    pictured, lengths = {each.name: each for each in pictures}, []
    for most in (100, 1):
        monkeypatch.setattr(pdf, "MOST_PAGES", most)
        reader, pages = pages_of(pdf.write(made, pictured, tmp_path / pdf.NAME))
        lengths.append(len(pages) - 1 + lowest_text(reader.pages[-1]))
    assert lengths[1] < lengths[0] - 0.2


@pytest.mark.second
def test_a_table_of_two_shares_stays_within_its_page(made):
    """Two bars with the value and the limit beside each are not wider than the paper."""
    try:
        pdf.check_library()
    except InputError as missing:
        pytest.skip(str(missing))
    share = b.Share(Number(1.14, "1", "percent", over=True), "91.2 K of 80.0 K")
    heads = b.heads("share of each limit", "IE3 4-pole 0.37 kW, 71M in the machine", "the other with one J")
    table = b.Table((b.TableRow(("rise of temperature with starts", share, share)),) * 3, heads)
    text = pdf.page_text(replace(made, sections=(), annex=(b.Section("x", "X", (table,)),)), {})
    import weasyprint

    for page in weasyprint.HTML(string=text).render().pages:
        box = page._page_box
        texts = [each for each in box.descendants() if getattr(each, "text", "").strip()]
        ends = [each.position_x + each.width for each in texts if hasattr(each, "text")]
        assert ends and max(ends) < box.content_box_x() + box.width + 1.0


def test_a_default_of_several_events_stands_at_the_first(made):
    (given,) = (each for each in made.annex if each.heading == "Other given values")
    values = [
        (each.description, each.value.value)
        for block in given.blocks
        if isinstance(block, b.Given)
        for _, group in block.sections
        for each in group
        if each.name.startswith("event.") and each.origin == "declared"
    ]
    assert values and len(values) == len(set(values))


EXAMPLES = Path(__file__).parents[1] / "examples"
LEAST_LETTERS = 8.0
"""Size of letters [pt] that is readable on paper."""


def with_bearings(text):
    """A study file with a bearing at each pin, of each kind in turn, and with overloads."""
    kinds = ("ball", "roller", "plain")
    rolling, plain = 'C = "62 kN"\nC0 = "48 kN"\n', 'diameter = "60 mm"\nwidth = "50 mm"\n'
    plain += 'pressure = "20 N/mm2"\nspeed = 0.5\npv = 1e6\n'
    for k, pin in enumerate(turning_pins(config.parse(text).machine.model)):
        kind = kinds[k % len(kinds)]
        text += f'\n[bearing."{pin}"]\nkind = "{kind}"\n{plain if kind == "plain" else rolling}'
    return text


def machine_of(name):
    """The text of a study file: a heavy machine and a knife drive with a bearing at each pin; drives of catalogues
    of one's own, and one that no motor fits."""
    catalogues = f'"{EXAMPLES.as_posix()}/catalogue/'
    read = {file.stem: file.read_text("utf-8") for file in EXAMPLES.glob("*.toml")}
    if name == "heavy_mill":
        events = '[[event]]\ntype = "jam"\nside = "left"\n[[event]]\ntype = "blocked"\n'
        return f"{with_bearings(read[name].replace('event = []', ''))}{events}"
    if name == "knife":
        return with_bearings((resources.files("chainunit.data") / "knife.toml").read_text("utf-8"))
    return read[name].replace('"catalogue/', catalogues)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("name", ["heavy_mill", "knife", "own_catalogue", "motor_rejected"])
def test_the_sheet_of_each_machine_has_at_most_four_pages_with_readable_letters(name, tmp_path):
    """The lettering of the drawing is smaller; the rest of the sheet has no smaller letters."""
    try:
        pdf.check_library()
    except InputError as missing:
        pytest.skip(str(missing))
    study = run_study(config.parse(machine_of(name)), tmp_path)
    made = sheet(study, report_of(study))
    drawn = "".join(x.svg for each in made.sections for x in each.blocks if isinstance(x, b.Drawing))
    drawn = unescape(re.sub(r"<[^>]+>|\s", "", drawn))
    pictures = print_figures.write(report_of(study).figures, tmp_path, made.units, are_small=True)
    pictured = {each.name: each for each in pictures}
    reader, pages = pages_of(pdf.write(made, pictured, tmp_path / pdf.NAME))
    heading = rf"A1\s+{re.escape(made.annex[0].heading)}"
    annex = next(n for n, text in enumerate(pages) if n and re.search(heading, text))
    assert 1 <= annex <= 4
    if name != "heavy_mill":
        assert len(pages) <= MOST_PAGES
    small = []

    def note(text, page, lines, font, size):
        if text.strip() and size * abs(lines[3]) * abs(page[3]) < LEAST_LETTERS - 0.01:
            small.append("".join(text.split()))

    for page in reader.pages[:annex]:
        page.extract_text(visitor_text=note)
    assert small and all(each in drawn for each in small)
    if name in ("heavy_mill", "knife"):
        pins = turning_pins(study.setup.drive.machine.model)
        words = " ".join(" ".join(pages[: annex + 1]).split())
        assert len(pins) > 8 and all(f"{pin}:" in words for pin in pins)
