"""Live pages in Chromium: sliders, shown numbers against Python, the copied study file, refusals, the console, the
network, two widths."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from browser import CHROMIUM, Page
from test_live import MEASURES, measured

from chainunit.core.quantities import Layout
from chainunit.report.html import render
from chainunit.report.live.page import live_page
from chainunit.study import config as study_files
from chainunit.study.choice import choose
from chainunit.study.cycle_quantities import cycle_quantity, evaluate

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="no chromium here"),
]
GALLERY = Path(__file__).parents[1] / "examples" / "linkages"
MOVED = {
    "feed.left.material_mass": 0.02,
    "feed.left.processing_force": 0.03,
    "feed.right.material_mass": 0.025,
    "run.crank_speed": 0.3,
    "run.ramp": 0.45,
    "machine.r": 0.4,
    "machine.l1": 0.38,
    "machine.rocker.m": 0.6,
    "machine.crank.I": 0.7,
    "machine.pin.friction": 0.2,
    "event.jam_left.force": 0.5,
    "event.jam_left.crank_angle": 0.2,
}
"""The sliders that the test moves, to these parts of their way."""


@pytest.fixture(scope="module")
def page_file(tmp_path_factory):
    folder = tmp_path_factory.mktemp("live page")
    file = folder / "live.html"
    file.write_text(render(live_page(None, None, folder)), "utf-8")
    return file


def ready(page):
    page.wait("!document.getElementById('live-root').hidden")
    page.wait(
        "document.getElementById('live-root').dataset.runs || document.getElementById('live-runs').hidden"
    )


def moved(page, key, share):
    """Move a slider to a share of its way, and let it go; returns the value that the field shows, in SI units."""
    script = f"""(async () => {{
      const data = await unpackedData("live-data");
      const i = data.quantities.findIndex((q) => q.key.join(".") === {json.dumps(key)});
      const q = data.quantities[i], range = document.querySelector(`input[type=range][data-q="${{i}}"]`);
      const root = document.getElementById("live-root"), before = Number(root.dataset.runs);
      range.value = Math.round(400 * {share});
      range.dispatchEvent(new Event("input", {{ bubbles: true }}));
      range.dispatchEvent(new Event("change", {{ bubbles: true }}));
      while (Number(root.dataset.runs) === before) await new Promise((go) => setTimeout(go, 5));
      return (Number(document.getElementById(`live-q-${{i}}-number`).value) - q.offset) / q.factor;
    }})()"""
    return page.evaluate(script)


def shown(page):
    """The numbers in the tables of the page, by name."""
    script = """JSON.stringify(Object.fromEntries(Array.from(document.querySelectorAll("td[data-result]"),
      (cell) => [cell.dataset.result, cell.dataset.value === "" ? null : Number(cell.dataset.value)])))"""
    return json.loads(page.evaluate(script))


@pytest.mark.parametrize("width", [1400, 400])
def test_sliders_show_the_numbers_of_python(page_file, tmp_path, width):
    with Page(page_file, tmp_path / "browser", width, 900) as page:
        ready(page)
        values = {key: moved(page, key, share) for key, share in MOVED.items()}
        numbers = shown(page)
        page.evaluate("document.getElementById('live-copy').click()")
        page.wait("document.getElementById('live-toml').value")
        text = page.evaluate("document.getElementById('live-toml').value")
        wide = page.evaluate("document.documentElement.scrollWidth")
        console, requests = page.console, page.requests
    assert not console and requests == [page_file.as_uri()]
    assert wide <= width
    copied = study_files.parse(text)
    choice = choose(copied, tmp_path)
    machine, model = choice.drive.machine, choice.drive.machine.model
    for key, x in values.items():
        table, _, name = key.partition(".")
        if table in ("machine", "feed"):
            of = machine.by_name if table == "machine" else Layout(type(copied.feed)).by_name(copied.feed)
            assert of[name] == pytest.approx(x, rel=1e-6), key
    speed = float(copied.run.crank_speed)
    factors = {"": 1.0, "speed": speed, "ratio2": machine.ratio**2}
    seen = 0
    for name, x in numbers.items():
        if "(" in name:
            own, _, by = name.partition(" ")
            want = (
                float(evaluate(machine, [cycle_quantity(own, model)], speed, copied.feed)[own]) * factors[by]
            )
            assert x == pytest.approx(want, rel=1e-9), name
            seen += 1
    assert seen >= 15
    want = measured(copied, choice, copied.events["jam_left"])
    for name in set(MEASURES) & set(numbers):
        assert (
            numbers[name] == pytest.approx(want[name], rel=1e-4)
            if want[name] is not None
            else numbers[name] is None
        )


def test_the_field_to_mend_is_marked(page_file, tmp_path):
    """Of two wrong values first the one, then the other."""
    typed = """(async () => {
      const data = await unpackedData("live-data");
      for (const [key, text] of Object.entries(%s)) {
        const i = data.quantities.findIndex((q) => q.key.join(".") === key);
        const field = document.getElementById(`live-q-${i}-number`);
        field.value = text;
        field.dispatchEvent(new Event("change", { bubbles: true }));
        await new Promise((go) => setTimeout(go, 200));
      }
      const marked = document.querySelectorAll("input[aria-invalid=true]");
      return Array.from(marked, (each) => each.getAttribute("aria-label")).join();
    })()"""
    with Page(page_file, tmp_path / "browser") as page:
        ready(page)
        both = page.evaluate(typed % '{ "machine.r": "1.4", "machine.crank.m": "50" }')
        other = page.evaluate(typed % '{ "machine.coupler.m": "-1", "machine.r": "0.15" }')
        none = page.evaluate(typed % '{ "machine.coupler.m": "25" }')
        console = page.console
    assert both == "crank O1-A in m" and other == "coupler A-Bd: mass in kg" and none == ""
    assert not console


def test_a_length_that_cannot_close_is_refused_in_words(page_file, tmp_path):
    with Page(page_file, tmp_path / "browser") as page:
        ready(page)
        before = shown(page)
        page.evaluate("""(async () => {
          const data = await unpackedData("live-data");
          const i = data.quantities.findIndex((q) => q.key.join(".") === "machine.z");
          const field = document.getElementById(`live-q-${i}-number`);
          field.value = "2";
          field.dispatchEvent(new Event("change", { bubbles: true }));
          await new Promise((go) => setTimeout(go, 300));
        })()""")
        said = page.evaluate("document.getElementById('live-said').textContent")
        invalid = page.evaluate("document.querySelectorAll('input[aria-invalid=true]').length")
        after = shown(page)
        page.evaluate("document.getElementById('live-back').click()")
        page.wait("!document.getElementById('live-root').dataset.refused")
        mended = page.evaluate("document.querySelectorAll('input[aria-invalid=true], .refused').length")
        console = page.console
    assert (
        "the organs cannot follow the rocker over its swing" in said and "must be ≥" in said and "≤" in said
    )
    assert invalid == 1 and after == before and mended == 0 and not console


def test_the_worst_angle_is_that_of_the_runs(page_file, tmp_path):
    config = study_files.load()
    choice = choose(config, tmp_path)
    with Page(page_file, tmp_path / "browser") as page:
        ready(page)
        page.evaluate("document.getElementById('live-angles').click()")
        page.wait("document.getElementById('live-root').dataset.worst")
        worst = float(page.evaluate("document.getElementById('live-root').dataset.worst"))
    event = config.events["jam_left"]
    peaks = []
    for angle in range(0, 360, 10):
        turned = dataclasses.replace(event, p=dataclasses.replace(event.p, crank_angle=np.radians(angle)))
        peaks.append(measured(config, choice, turned)["crank_torque_peak"])
    assert worst % 360 == 10 * int(np.argmax(peaks))


@pytest.mark.parametrize("name", ["slider_crank_press", "toggle_clamp", "andrews_squeezer", "knife_drive"])
def test_a_linkage_moves_in_its_page(name, tmp_path):
    file = tmp_path / "linkage.html"
    file.write_text(render(live_page(GALLERY / f"{name}.toml", None, tmp_path)), "utf-8")
    with Page(file, tmp_path / "browser") as page:
        page.wait("!document.getElementById('live-root').hidden")
        links = "Array.from(document.querySelectorAll('#live-stage .link'), (l) => l.getAttribute('points')).join()"
        before = page.evaluate(links)
        page.evaluate("""(() => {
          const place = document.getElementById("live-place");
          place.value = 60;
          place.dispatchEvent(new Event("input"));
        })()""")
        assert page.evaluate(links) != before
        assert not page.console and page.requests == [file.as_uri()]


def test_a_page_evaluates_no_text_and_needs_no_webassembly(page_file, tmp_path):
    """Its policy admits neither, and the machine runs."""
    text = page_file.read_text("utf-8")
    assert "unsafe-eval" not in text
    file = tmp_path / "without.html"
    file.write_text(
        text.replace("<script>", "<script>delete window.WebAssembly;</script><script>", 1), "utf-8"
    )
    with Page(file, tmp_path / "browser") as page:
        ready(page)
        assert not page.console and shown(page)


def test_a_page_whose_equations_are_damaged_says_so(page_file, tmp_path):
    text = page_file.read_text("utf-8").replace('id="live-data">', 'id="live-data">A', 1)
    file = tmp_path / "damaged.html"
    file.write_text(text, "utf-8")
    with Page(file, tmp_path / "browser") as page:
        page.wait("document.getElementById('live-none').textContent.includes('does not run here')")
        assert page.evaluate("document.getElementById('live-root').hidden")


def test_a_frame_and_a_transient_are_short(page_file, tmp_path):
    """The least of a slider's moves, and of the start and event after each: the machine may have other work."""
    with Page(page_file, tmp_path / "browser") as page:
        ready(page)
        times = []
        for share in np.linspace(0.3, 0.6, 20):
            moved(page, "machine.crank.m", share)
            read = "JSON.stringify([root.dataset.frame, root.dataset.transient].map(Number))"
            times.append(
                json.loads(
                    page.evaluate(
                        f"(() => {{ const root = document.getElementById('live-root'); return {read}; }})()"
                    )
                )
            )
    frame, transient = np.min(times, axis=0)
    assert frame < 16.0 and transient < 100.0, (frame, transient)
