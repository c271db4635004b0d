"""documentation/index.html of an FMU, made from the model's docstring and declarations."""

from __future__ import annotations

import inspect
from dataclasses import fields
from html import escape

from ..core.model import About, Sketch
from ..core.quantities import written
from .description import Interface, Signal
from .pictures import drawing

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 62rem; padding: 0 1rem; color: #1b1b1b; }
table { border-collapse: collapse; width: 100%; margin-bottom: 2rem; }
th, td { text-align: left; padding: .25rem .6rem; border-bottom: 1px solid #ccc; vertical-align: top; }
td.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
code { font-family: ui-monospace, monospace; }
"""

_FIGURE = (
    "The machine with its start values, its driver at about a sixth of its way: links, pins and supports by name; "
    "the driven link is coloured."
)
_NOT_CONNECTED = "An input that is not connected keeps its start value."
_FOLLOWS = (
    " In Co-Simulation {pairs} inside a step, so that the outputs after it are those of its end. Derivatives of "
    "these inputs that the importer sets (FMI 2.0) hold instead."
)
_MOTION = (
    " Inputs phi, w and a belong together: give all of them. As declared, the {what} stands at phi = {at:g}."
)


def page(interface: Interface, version: str, sketch: Sketch | None) -> str:
    """A self-contained page: a description of the model with its `sketch`, and tables of its parameters, inputs and
    outputs."""
    model = interface.model
    text = escape(inspect.cleandoc(model.text) + model.fmu_data.notes).replace("\n\n", "</p><p>")
    picture = f"<figure>{drawing(sketch)}<figcaption>{_FIGURE}</figcaption></figure>\n" if sketch else ""
    tables = "".join(
        f"<h2>{title}</h2>\n{_table(interface.signals_of(causality), causality)}"
        for title, causality in (("Parameters", "parameter"), ("Inputs", "input"), ("Outputs", "output"))
    )
    motion = {s.name: s for s in interface.signals_of("input") if s.name in ("phi", "w", "a")}
    inputs = _NOT_CONNECTED
    if len(motion) == 3 and not motion["w"].start:
        phi = motion["phi"]
        inputs += _MOTION.format(
            what="shaft" if phi.variable.unit == "rad" else "driver", at=phi.start or 0.0
        )
    if model.input_rates:
        inputs += _FOLLOWS.format(pairs=", ".join(f"{a} follows {b}" for a, b in model.input_rates.items()))
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{model.name}</title>'
        f"<style>{_STYLE}</style></head>\n<body><h1>{model.name}</h1>\n<p>{escape(model.description)}</p>\n"
        f"{picture}<p>{text}</p>\n<p>{inputs}</p>\n{tables}{_origin(model.fmu_data.about)}"
        f"<p>Made by chainunit {version}; its code in this FMU is under the MIT licence.</p></body></html>\n"
    )


def _origin(about: About | None) -> str:
    """Who made the machine, as far as it is known."""
    texts = [
        f"{field.name}: {text}" for field in fields(About) if about and (text := getattr(about, field.name))
    ]
    return f"<p>Of this machine: {escape('; '.join(texts))}.</p>\n" if texts else ""


def _table(signals: list[Signal], causality: str) -> str:
    """A table in HTML of the signals of one causality."""
    settable = causality != "output"
    head = (
        "<tr><th>name</th><th>unit or type</th>"
        + ("<th>start</th><th>allowed</th>" if settable else "")
        + "<th>meaning</th></tr>"
    )
    rows = []
    for signal in signals:
        v, q = signal.variable, signal.variable.quantity
        unit = v.unit if v.type == "Real" else v.type
        cells = [f"<td><code>{escape(v.name)}</code></td>", f"<td>{escape(unit)}</td>"]
        if settable:
            bounds = escape(q.allowed_range) + (
                "" if causality == "input" else ", tunable" if q.tunable else ", fixed"
            )
            start = f"{signal.start:.6g}" if v.type == "Real" else written(signal.start or 0.0, v.type)
            cells += [f'<td class="number">{start}</td>', f"<td>{bounds}</td>"]
        rows.append("<tr>" + "".join(cells) + f"<td>{escape(v.description)}</td></tr>")
    return f"<table>{head}\n" + "\n".join(rows) + "</table>\n"
