"""What an FMU carries beside its model: documentation, licences, icon and terminals, reference results."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from importlib import metadata, resources
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from ..engines import MATH
from .description import Interface, terminals
from .documentation import page
from .pack import written

REFERENCE = "extra/chainunit/reference"
_STOP, _ROWS = 1.0, 41


def accompanying(
    interface: Interface, version: str, fmi: int, libraries: Sequence[str] = ()
) -> dict[str, bytes]:
    """Files by their path inside the FMU; `libraries` are packages whose code it holds, under their own licences."""
    model = interface.model
    icons = resources.files("chainunit") / "data" / "icons"
    png, svg = ((icons / f"{model.icon}.{kind}").read_bytes() for kind in ("png", "svg"))
    files = {
        "documentation/index.html": page(interface, version).encode(),
        "documentation/licenses/license.txt": licence("chainunit", *libraries).encode(),
    }
    if fmi == 2:
        files["model.png"] = png
    else:
        files |= {
            "terminalsAndIcons/terminalsAndIcons.xml": written(terminals(interface)),
            "terminalsAndIcons/icon.png": png,
            "terminalsAndIcons/icon.svg": svg,
        }
    return files | _reference(interface)


def licence(*packages: str) -> str:
    """Licences of installed packages, one after the other."""
    texts = [f"{name}\n\n{metadata.distribution(name).read_text('licenses/LICENSE')}" for name in packages]
    return "\n\n".join(texts)


def _reference(interface: Interface) -> dict[str, bytes]:
    """Inputs and outputs over a second, from the Python kernels: outputs at points, or along an accurate integration
    of the states. Nothing where the start values let the states run away."""
    model = interface.model
    p = model.prepared(MATH, model.parameter_layout.instance([s.start for s in interface.of("parameter")]))
    start = {s.name: s.start for s in interface.of("input")}
    times = np.linspace(0.0, _STOP, _ROWS)

    def inputs(t: float) -> Any:
        return model.input_layout.from_names(start | model.excitation(t))

    states: list[Any] = [None] * _ROWS
    if layout := model.state_layout:
        first = layout.values(model.begin(p, inputs(0.0)))
        solved = solve_ivp(
            lambda t, x: model.derivatives(MATH, p, inputs(t), layout.instance(x.tolist())),
            (0.0, _STOP),
            first,
            method="DOP853",
            t_eval=times,
            rtol=1e-10,
            atol=1e-10,
        )
        if not solved.success or not np.isfinite(solved.y).all():
            return {}
        states = [layout.instance(x) for x in solved.y.T.tolist()]
    given, found = [], []
    for t, x in zip(times.tolist(), states, strict=True):
        u = inputs(t)
        parts = model.evaluate(MATH, p, u, x)
        given.append([t, *model.input_layout.values(u)])
        outputs = [v for part, out in zip(model.parts, parts, strict=True) for v in part.layout.values(out)]
        found.append([t, *(layout.values(x) if layout else []), *outputs])
    heads = [["time", *(s.name for s in interface.of(kind))] for kind in ("input", "output")]
    return {
        f"{REFERENCE}/{model.name}_{end}.csv": _csv(head, rows)
        for end, head, rows in zip(("in", "ref"), heads, (given, found), strict=True)
    }


def _csv(head: Sequence[str], rows: Sequence[Sequence[float]]) -> bytes:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows([repr(float(v)) for v in row] for row in rows)
    return text.getvalue().encode()
