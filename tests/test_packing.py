"""What a page holds packed, and that a page which is printed at once has its plots."""

from __future__ import annotations

import json
import random
import re
import subprocess

import numpy as np
import pytest
from browser import CHROMIUM
from javascript_hosts import NODE, node

from chainunit.reading.text import DEFAULT_UNITS
from chainunit.report import blocks as b
from chainunit.report import figure as fig
from chainunit.report import html
from chainunit.report.console import Forecast
from chainunit.report.html import packed_bytes

TEXTS = ["", "a", "abc" * 2000, "".join(random.Random(1).choices("abcdef ", k=70_000)), "é € " * 30]


@node
def test_a_page_unpacks_what_python_packed():
    """At once: a browser prints a page as soon as it is loaded, and does not wait for a stream."""
    script = (
        "const document = { getElementById: (id) => ({ textContent: given[id] }) };\n"
        f"const given = {json.dumps([packed_bytes(text.encode()) for text in TEXTS])};\n"
        f"{html.resource('packing.js')}\n"
        "const said = given.map((_, id) => new TextDecoder().decode(unpackedBytes(id)));\n"
        "console.log(JSON.stringify(said));"
    )
    done = subprocess.run([NODE, "-"], input=script, capture_output=True, text=True, check=True)
    assert json.loads(done.stdout) == TEXTS


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no chromium here")
def test_a_page_that_is_printed_without_waiting_has_its_plots(tmp_path):
    x = np.linspace(0.0, 1.0, 50)
    panel = fig.Panel(fig.Axis("speed", "rad/s"), fig.Axis("torque", "N.m"), (fig.Curve("a", x, x),))
    plots = tuple(fig.Figure(name, name, "A line.", ((panel,),)) for name in ("one", "two"))
    report = b.Report("A page", "kind", {}, (), (b.Section("plots", "Plots", plots),), units=DEFAULT_UNITS)
    file = tmp_path / "page.html"
    file.write_text(html.render(report), "utf-8")
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'b'}"]
    done = subprocess.run(
        [*command, f"--print-to-pdf={tmp_path / 'page.pdf'}", file.as_uri()], capture_output=True, timeout=120
    )
    assert done.returncode == 0
    reader = pytest.importorskip("pypdf").PdfReader(tmp_path / "page.pdf")
    text = " ".join(page.extract_text() for page in reader.pages)
    # the labels of the axes are drawn by the library
    assert len(re.findall(r"torque", text)) == 2 and len(re.findall(r"speed", text)) == 2


def test_long_work_is_told_with_its_forecast_until_that_ends():
    forecast = Forecast()
    assert not forecast.words(0.0, "the start-up", 0.0, 100.0)
    assert not forecast.words(4.0, "the start-up", 2.0, 100.0), "too early"
    assert forecast.words(6.0, "the start-up", 3.0, 100.0) == "About 3 min more: the start-up."
    assert not forecast.words(12.0, "the start-up", 6.0, 100.0), "told before"
    # it slows down: 194 s after the forecast there is as much left again, and more
    assert not forecast.words(199.0, "the start-up", 40.0, 100.0)
    assert forecast.words(201.0, "the start-up", 40.0, 100.0) == "About 5 min more: the start-up."
    assert not forecast.words(300.0, "the start-up", 50.0, 100.0), "told before"
    assert not forecast.words(600.0, "the start-up", 95.0, 100.0), "less than a minute"
    # other work, which is nearly done
    assert not forecast.words(20.0, "energy", 0.0, 10.0) and not forecast.words(40.0, "energy", 9.0, 10.0)
    # work whose amount is not known
    assert not forecast.words(50.0, "the choice", 0.0, 1.0) and not forecast.words(500.0, "it", 0.0, 1.0)
