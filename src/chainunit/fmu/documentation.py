"""documentation/index.html of an FMU, made from the model's docstring and declarations."""

from __future__ import annotations

import inspect
from html import escape

from .description import Interface, Signal

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 62rem; padding: 0 1rem; color: #1b1b1b; }
table { border-collapse: collapse; width: 100%; margin-bottom: 2rem; }
th, td { text-align: left; padding: .25rem .6rem; border-bottom: 1px solid #ccc; vertical-align: top; }
td.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
code { font-family: ui-monospace, monospace; }
"""

_NOT_CONNECTED = "An input that is not connected keeps its start value."
_MOTION = " Inputs phi, w and a belong together: give all of them. As declared, the shaft stands at phi = 0."


def page(interface: Interface, version: str) -> str:
    """A self-contained page: a description of the model, and tables of its parameters, inputs and outputs."""
    model = interface.model
    text = escape(inspect.cleandoc(model.__doc__ or "")).replace("\n\n", "</p><p>")
    tables = "".join(
        f"<h2>{title}</h2>\n{_table(interface.of(causality), causality)}"
        for title, causality in (("Parameters", "parameter"), ("Inputs", "input"), ("Outputs", "output"))
    )
    has_motion = {"phi", "w", "a"} <= {signal.variable.name for signal in interface.of("input")}
    inputs = _NOT_CONNECTED + (_MOTION if has_motion else "")
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{model.name}</title>'
        f"<style>{_STYLE}</style></head>\n<body><h1>{model.name}</h1>\n<p>{escape(model.description)}</p>\n"
        f"<p>{text}</p>\n<p>{inputs}</p>\n{tables}<p>Made by chainunit {version}, MIT licence.</p></body></html>\n"
    )


def _table(signals: list[Signal], causality: str) -> str:
    settable = causality != "output"
    head = (
        "<tr><th>name</th><th>unit</th>"
        + ("<th>start</th><th>allowed</th>" if settable else "")
        + "<th>meaning</th></tr>"
    )
    rows = []
    for signal in signals:
        v, q = signal.variable, signal.variable.quantity
        cells = [f"<td><code>{escape(v.name)}</code></td>", f"<td>{escape(v.unit)}</td>"]
        if settable:
            bounds = escape(q.allowed_range) + (
                "" if causality == "input" else ", tunable" if q.tunable else ", fixed"
            )
            cells += [f'<td class="number">{signal.start:.6g}</td>', f"<td>{bounds}</td>"]
        rows.append("<tr>" + "".join(cells) + f"<td>{escape(v.description)}</td></tr>")
    return f"<table>{head}\n" + "\n".join(rows) + "</table>\n"
