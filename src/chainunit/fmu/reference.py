"""The reference results inside an FMU.

They are those of a Co-Simulation master that holds its inputs over a step, from the Python kernels, and they are
written twice, as masters differ in when they read. They lie in the folder of the layered standard FMI-LS-REF
(1.0.0-alpha.1), whose manifest says what each file is.
"""

from __future__ import annotations

import csv
import io
import logging
import math
from collections.abc import Callable, Sequence
from typing import Any
from xml.etree.ElementTree import Element, SubElement, register_namespace

import numpy as np

from ..engines import MATH
from ..ports import FLANGE, LOAD
from ..quantities import Quantity
from .description import Interface
from .pack import xml_bytes

STANDARD = "org.fmi-standard.fmi-ls-ref"
REFERENCE = f"extra/{STANDARD}"
INPUTS, STEPPED, READ = "in", "co_simulation", "set_then_read"
"""Endings of the names of the files: inputs; outputs at the end of each step; outputs at its beginning."""
STEP, ROWS = 0.04, 26  # s
_MANIFEST = "http://fmi-standard.org/fmi-ls-manifest"
_MOST_STEPS = 100_000
"""of the integrator for one step of the file; the models take some hundred at their start values"""

log = logging.getLogger("chainunit.fmu")


def reference_results(interface: Interface) -> dict[str, bytes]:
    """The files of reference results; none, and a warning, where the start values let the states run away, or so
    fast that following them would take too long."""
    name = interface.model.name
    try:
        tables = _tables(interface)
    except ArithmeticError as reason:
        log.warning(
            "The FMU %s: no reference results inside: %s; no run of this package needs them, an importer is checked "
            "by them",
            name,
            reason,
        )
        return {}
    words = {
        INPUTS: f"inputs, set at each time and held for {STEP * 1e3:g} ms",
        STEPPED: "outputs at the end of each step, before the inputs of that time are set",
        READ: "outputs after the inputs of the time are set, before an event there and the step from it: of "
        "Model Exchange, and of Co-Simulation masters that read there, which the FMI standard does not allow",
    }
    files = {f"{REFERENCE}/{name}_{end}.csv": _csv(*table) for end, table in tables.items()}
    register_namespace("fmi-ls", _MANIFEST)
    root = Element("fmiReferences")
    root.set(f"{{{_MANIFEST}}}fmi-ls-name", STANDARD)
    root.set(f"{{{_MANIFEST}}}fmi-ls-version", "1.0.0-alpha.1")
    root.set(
        f"{{{_MANIFEST}}}fmi-ls-description",
        "Layered Standard providing information on related files included in an FMU.",
    )
    for end in tables:
        role = "testcase" if end == INPUTS else "result"
        SubElement(
            root, "Related", type="text/csv", source=f"{name}_{end}.csv", role=role, description=words[end]
        )
    return files | {f"{REFERENCE}/fmi-ls-manifest.xml": xml_bytes(root)}


def _tables(interface: Interface) -> dict[str, tuple[list[str], list[list[float]]]]:
    """Head and rows of each file.

    Raises
    ------
    ArithmeticError
        where a value is no finite number, or the states take more than `_MOST_STEPS` for one of the file's.
    """
    model = interface.model
    p = model.prepared(MATH, model.parameter_layout.instance([s.start for s in interface.of("parameter")]))
    inputs = excitation(interface)
    layout = model.state_layout
    tables: dict[str, list[list[float]]] = {INPUTS: [], STEPPED: [], READ: []}

    def outputs(t: float, u: Sequence[float], x: Sequence[float]) -> list[float]:
        states = layout.instance(list(x)) if layout else None
        parts = model.evaluate(MATH, p, model.input_layout.instance(list(u)), states)
        values = [v for part, out in zip(model.parts, parts, strict=True) for v in part.layout.values(out)]
        if not np.isfinite(values).all():
            raise ArithmeticError(f"an output is no finite number at t = {t:g} s")
        return [t, *x, *values]

    march = _march(interface, p) if layout else None
    u: list[float] = []
    x: list[float] = []
    for k in range(ROWS):
        t = k * STEP
        given = model.input_layout.values(model.input_layout.from_names(inputs(t)))
        if k == 0:
            u = given
            x = layout.values(model.begin(p, model.input_layout.instance(given))) if layout else []
        tables[INPUTS].append([t, *given])
        tables[STEPPED].append(outputs(t, u, x))
        tables[READ].append(outputs(t, given, x))
        if march:
            x = march(t, given, x)
        u = list(given)
        for place, rate, half in model.course(given):
            u[place] += STEP * (rate + STEP * half)
    heads = {kind: ["time", *(s.name for s in interface.of(kind))] for kind in ("input", "output")}
    return {end: (heads["input" if end == INPUTS else "output"], rows) for end, rows in tables.items()}


def _march(interface: Interface, p: Any) -> Any:
    """A function of time, inputs and states that gives the states a step later, by an integrator for stiff and other
    equations that is accurate to 1e-9 or so; it carries nothing from call to call."""
    import casadi

    model = interface.model
    layout = model.state_layout
    assert layout is not None
    (of_p, of_u, of_x, of_derived), *_, derivatives = interface.trace
    given, since = casadi.SX.sym("given", len(model.input_layout.names)), casadi.SX.sym("since")
    moved = [given[k] for k in range(given.numel())]
    for place, rate, half in model.course(moved):
        moved[place] += since * (rate + since * half)
    # in units of their nominal size, so that one tolerance does for all states
    nominal = casadi.DM([v.quantity.nominal or 1.0 for v in layout.variables])
    scaled = casadi.SX.sym("scaled", nominal.numel())
    fixed = casadi.DM([*model.parameter_layout.values(p), *getattr(p, "derived", [])])
    rates = casadi.substitute(
        [casadi.vertcat(*derivatives) / nominal],
        [of_p, of_derived, of_u, of_x],
        [fixed[: of_p.numel()], fixed[of_p.numel() :], casadi.vertcat(*moved), scaled * nominal],
    )
    solver = casadi.integrator(
        "march",
        "cvodes",
        {"x": scaled, "u": given, "t": since, "ode": casadi.cse(rates[0])},
        0.0,
        STEP,
        {"reltol": 1e-12, "abstol": 1e-14, "max_num_steps": _MOST_STEPS, "disable_internal_warnings": True},
    )

    def march(t: float, given: Sequence[float], x: Sequence[float]) -> list[float]:
        if model.controlled:
            for _ in range(2):
                inputs, states = model.input_layout.instance(list(given)), layout.instance(list(x))
                x = model.closed(MATH, p, inputs, states)
        try:
            later = solver(x0=casadi.DM(x) / nominal, u=given)["xf"] * nominal
        except RuntimeError as error:
            raise ArithmeticError(
                f"the states are too fast to be followed from t = {t:g} s on, or run away"
            ) from error
        states = [float(v) for v in later.full().ravel()]
        if not np.isfinite(states).all():
            raise ArithmeticError(f"the states run away behind t = {t:g} s")
        return states

    return march


def _csv(head: Sequence[str], rows: Sequence[Sequence[float]]) -> bytes:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows([repr(float(v)) for v in row] for row in rows)
    return text.getvalue().encode()


# -- inputs that move

_SIZES = {"rad": 0.1, "rad/s": 50.0, "kg": 10.0, "N": 100.0}
"""of an input whose declaration shows none, by unit; others 1"""
_PUSH = 300.0
"""rad/s2: the torque of a load is what gives the shaft that takes it this acceleration; a torque that turns a shaft
gives no more"""
_RUN = 4.0
"""rad/s: mean speed of a shaft that runs from rest"""


def excitation(interface: Interface) -> Callable[[float], dict[str, float]]:
    """The inputs as functions of time [s], for the reference results: all move smoothly, within their bounds.

    A shaft runs from rest, unevenly. A load, or a torque, is of the size that suits the shaft that takes it.
    Everything else swings about its start value, or about its usual size where that is 0.
    """
    model = interface.model
    sizes = interface.script.sizes
    courses: dict[str, Callable[[float], float]] = {}
    for terminal in model.terminals:
        if terminal.kind == LOAD and terminal.members["tau_bias"] in model.input_layout.names:
            inertia = _inertia(interface, terminal.members["tau_bias"])
            moving = _load(sizes.get(terminal.members["tau_bias"], _PUSH * inertia), inertia)
        elif terminal.kind == FLANGE:
            moving = _SHAFT
            turning = [s for s in interface.of("input") if s.name == terminal.members.get("tau")]
            if turning and model.state_layout:
                # a torque that is usual for one shaft lets the states of a light one run away
                tau, most = turning[0], _PUSH * _inertia(interface, turning[0].name)
                usual = _size(tau.variable.quantity, tau.start, sizes.get(tau.name))
                sizes = {**sizes, tau.name: min(usual, most)}
        else:
            continue
        courses |= {terminal.members[member]: course for member, course in moving.items()}
    others = {
        s.name: _swing(s.variable.quantity, _size(s.variable.quantity, s.start, sizes.get(s.name)), k)
        for k, s in enumerate(interface.of("input"))
    }
    courses = others | {name: course for name, course in courses.items() if name in others}
    return lambda t: {name: course(t) for name, course in courses.items()}


_SHAFT: dict[str, Callable[[float], float]] = {
    "phi": lambda t: _RUN * (t - 0.5 * math.sin(2.0 * t)),
    "w": lambda t: _RUN * (1.0 - math.cos(2.0 * t)),
    "a": lambda t: 2.0 * _RUN * math.sin(2.0 * t),
}


def _load(tau: float, inertia: float) -> dict[str, Callable[[float], float]]:
    """A load of about this torque [N m] and inertia [kg m2]. The slopes are so small that the inertia stays positive,
    and the torque within twice its size, for a shaft that is 150 rad ahead of the load's point or behind it."""
    return {
        "tau_bias": lambda t: tau * (1.0 + 0.4 * math.sin(10.0 * t)),
        "tau_bias_dphi": lambda t: 0.01 * tau * math.cos(4.0 * t),
        "tau_bias_dw": lambda t: 0.002 * tau * (1.0 + 0.5 * math.sin(5.0 * t)),
        "J": lambda t: inertia * (1.0 + 0.3 * math.sin(6.0 * t)),
        "dJ_dphi": lambda t: 0.001 * inertia * math.cos(6.0 * t),
        "phi0": _SHAFT["phi"],
        "w0": _SHAFT["w"],
    }


def _inertia(interface: Interface, torque: str) -> float:
    """Of the shaft that the input `torque` slows down [kg m2], as the derivatives of the speeds by it say; 1 without
    any."""
    import casadi

    model, layout = interface.model, interface.model.state_layout
    if layout is None:
        return 1.0
    symbols, *_, derivatives = interface.trace
    speeds = [d for d, v in zip(derivatives, interface.states, strict=True) if v.unit == "rad/s"]
    by = casadi.jacobian(casadi.vertcat(*speeds), symbols[1][model.input_layout.names.index(torque)])
    p = model.prepared(MATH, model.parameter_layout.instance([s.start for s in interface.of("parameter")]))
    u = [s.start for s in interface.of("input")]
    x = layout.values(model.begin(p, model.input_layout.instance(u)))
    at: list[Any] = [model.parameter_layout.values(p), u, x, getattr(p, "derived", [])]
    slopes = casadi.Function("slopes", symbols, [casadi.densify(by)])(*at).full()
    return float(1.0 / (abs(slopes).max() or 1.0))


def _size(q: Quantity, start: float | None, own: float | None) -> float:
    return own or start or q.nominal or _SIZES.get(q.unit, 1.0)


def _swing(q: Quantity, size: float, k: int) -> Callable[[float], float]:
    """About `size` by 40 %, or as far as the bounds let it; the `k`-th input at a rate of its own."""
    near, far = sorted((0.6 * size, 1.4 * size))
    low, high = max(near, q.low), min(far, q.high)
    rate = 3.0 + 7.0 * (0.618 * k % 1.0)
    return lambda t: 0.5 * (low + high) + 0.5 * (high - low) * math.sin(rate * t)
