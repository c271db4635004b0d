"""The report of a study: its page, its text on a terminal, its files."""

from __future__ import annotations

import io
import json
import re

from rich.console import Console

from chainunit.reading.text import DEFAULT_UNITS
from chainunit.report import files, html, motion, series, terminal
from chainunit.report import study as study_report
from chainunit.report.packing import unpacked


def page_of(study, result=None):
    return html.render(study_report.report(study, result))


def said_of(study, width=200):
    out = io.StringIO()
    console = Console(file=out, markup=False, highlight=False, width=width)
    terminal.show(study_report.report(study), console)
    return out.getvalue()


def screen_of(report):
    """The lines of one screen of a terminal of 80 columns."""
    out = io.StringIO()
    terminal.screen(
        report, Console(file=out, markup=False, highlight=False, width=80), "All numbers here: --all."
    )
    return [line.rstrip() for line in out.getvalue().splitlines()]


def write(study, folder):
    numbers, *others = files.writers(study_report.report(study), folder, "result", png=True)
    return [file for each in (numbers, lambda: series.write(study, folder), *others) for file in each()]


def packed_in(page, name):
    """The data of that name which a page holds packed, as a text of JSON."""
    content = re.search(rf'<script type="application/octet-stream" id="{name}">(.*?)</script>', page)[1]
    return json.dumps(unpacked(content))


def pictures(moving):
    return motion.pictures(moving, DEFAULT_UNITS)
