"""The report of a study: its page, its text on a terminal, its files."""

from __future__ import annotations

import base64
import gzip
import io
import json
import re
from itertools import accumulate

import numpy as np
import plotly.graph_objects as go
from rich.console import Console

from chainunit.reading.text import DEFAULT_UNITS
from chainunit.report import files, html, motion, page_figures, series, terminal
from chainunit.report import study as study_report
from chainunit.report.blocks import found_at
from chainunit.study.result import as_dict


def at(result, path):
    """The entry of a result at the dotted path."""
    return found_at(result, path)[1]


def report_of(study):
    return study_report.report(study, as_dict(study))


def page_of(study, result=None):
    return html.render(study_report.report(study, result or as_dict(study)))


def plotly_figure(spec, units=DEFAULT_UNITS):
    """A figure of the page, whose properties plotly's own classes check, with its arrays as such."""
    drawn = page_figures.page_figure(spec, units)
    return go.Figure(
        [{name: _array(x) for name, x in trace.items()} for trace in drawn["data"]], drawn["layout"]
    )


def _array(x):
    if not (isinstance(x, dict) and "bdata" in x):
        return x
    array = np.frombuffer(base64.b64decode(x["bdata"]), x["dtype"])
    return array.reshape(list(map(int, x["shape"].split(",")))) if "shape" in x else array


def plain(report, width=120):
    """The short form of a report as a terminal without colours shows it."""
    out = io.StringIO()
    terminal.show(report, Console(file=out, markup=False, highlight=False, width=width, no_color=True))
    return "\n".join(line.rstrip() for line in out.getvalue().splitlines())


def said_of(study, width=200):
    return plain(report_of(study), width)


def screen_of(report):
    """The lines of one screen of a terminal of 80 columns."""
    out = io.StringIO()
    terminal.screen(
        report, Console(file=out, markup=False, highlight=False, width=80), "All numbers here: --all."
    )
    return [line.rstrip() for line in out.getvalue().splitlines()]


def write(study, folder):
    numbers, *others = files.writers(report_of(study), folder, "result", png=True)
    return [file for each in (numbers, lambda: series.write(study, folder), *others) for file in each()]


def packed_in(page, name):
    """The data of that name which a page holds packed, as a text of JSON."""
    content = re.search(rf'<script type="application/octet-stream" id="{name}">(.*?)</script>', page)[1]
    return json.dumps(unpacked(content))


def pictures(moving):
    return motion.pictures(moving, DEFAULT_UNITS)


def unpacked(text):
    """The data that a page holds packed, as the page reads it."""
    return _restored(json.loads(gzip.decompress(base64.b64decode(text))))


def _restored(data):
    if isinstance(data, list):
        return [_restored(x) for x in data]
    if not isinstance(data, dict):
        return data
    if "+" not in data:
        return {name: _restored(x) for name, x in data.items()}
    digits, *differences = data["+"]
    return [whole / 10**digits for whole in accumulate(differences)]
