"""What a study leaves: its page, its text on a terminal, its files."""

from __future__ import annotations

import io

from rich.console import Console

from chainunit.report import chain_unit, files, html, motion, series, terminal
from chainunit.text import DEFAULT_UNITS


def page_of(study, result=None):
    return html.render(chain_unit.report(study, result))


def said_of(study, width=200):
    told = io.StringIO()
    console = Console(file=told, markup=False, highlight=False, width=width)
    terminal.show(chain_unit.report(study), console)
    return told.getvalue()


def write(study, folder):
    numbers, *others = files.writers(chain_unit.report(study), folder, "result")
    return [file for each in (numbers, lambda: series.write(study, folder), *others) for file in each()]


def pictures(moving):
    return motion.pictures(moving, DEFAULT_UNITS)
