"""The reference results inside an FMU.

They are the results of a Co-Simulation master that sets its inputs at the begin of each step, computed by the Python
kernels. There are two files of them, as masters read outputs at different moments, and a smoke test that names inputs
and results. The files lie in the folder of the layered standard FMI-LS-REF (1.0.0-beta.1), whose manifest describes
each file.
"""

from __future__ import annotations

import csv
import io
import logging
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple, TypeAlias
from xml.etree.ElementTree import Element, SubElement, register_namespace

import numpy as np

from ..core.engines import MATH
from ..core.inputs import xml_of
from ..core.ports import FLANGE, LOAD
from ..core.quantities import Quantity, Type, written
from .description import Interface, Signal, xml_bytes

STANDARD = "org.fmi-standard.fmi-ls-ref"
REFERENCE = f"extra/{STANDARD}"
RELATED = f"{REFERENCE}/fmi-ls-manifest.xml"
"""The manifest of the layered standard, which tells the role of each related file."""
INPUTS, STEPPED, READ = "in", "co_simulation", "set_then_read"
"""Endings of the names of the files: inputs; outputs at the end of each step; outputs at its beginning."""
SMOKE_TEST = "smoke_test.exp"
"""Ending of the name of the file with the experiment of these inputs and results."""
EXPERIMENTS_TYPE = "application/x-ma-hs-experiments"
STEP, ROWS = 0.04, 26  # s
_NAMESPACE = "http://fmi-standard.org/fmi-ls-manifest"
_MOST_STEPS = 100_000
"""Largest number of steps of the integrator in one step of the file; at their start values the models take some
hundred."""

log = logging.getLogger("chainunit.fmu")


class ReferenceExperiment(NamedTuple):
    """An experiment over the time of the reference results: step [s], the files of its inputs and of its results, by
    their places from the file of experiments, and the deviation that is allowed, in parts of the size of a column."""

    name: str
    description: str
    step: float
    stimuli: str
    references: str
    tolerance: float | None = None


def experiments_file(name: str, description: str, experiments: Iterable[ReferenceExperiment]) -> bytes:
    """A file of experiments in the format MA-HS-Experiments, to which FMI-LS-REF refers. Times are attributes, as its
    text has them; the draft of its schema has them in an element of their own."""
    root = Element("Experiments", name=name, description=description)
    for experiment in experiments:
        numbers = {"startTime": 0.0, "stopTime": (ROWS - 1) * STEP, "stepSize": experiment.step}
        if experiment.tolerance is not None:
            numbers["tolerance"] = experiment.tolerance
        attributes = {"name": experiment.name, "description": experiment.description}
        attributes |= {key: repr(value) for key, value in numbers.items()}
        node = SubElement(root, "Experiment", attributes)
        SubElement(node, "Stimuli", source=experiment.stimuli, type="text/csv")
        SubElement(node, "References", source=experiment.references, type="text/csv")
    return xml_bytes(root)


def reference_results(interface: Interface) -> dict[str, bytes]:
    """The files of reference results. If, with the start values, the states run away or are too fast for the
    integrator, there are no files, and a warning is logged."""
    name = interface.model.name
    try:
        tables = reference_tables(interface)
    except (ArithmeticError, ValueError) as reason:  # ValueError: of `math`, if a linkage does not close
        log.warning(
            "The FMU %s: no reference results inside: %s; no run of this package needs them, an importer is checked "
            "by them",
            name,
            reason,
        )
        return {}
    titles = {
        INPUTS: f"inputs, set every {STEP * 1e3:g} ms; in between each stays, or follows another input that is its "
        "derivative",
        STEPPED: "outputs at the end of each step, before the inputs of that time are set",
        READ: "outputs after the inputs of the time are set, before an event there and the step from it: of "
        "Model Exchange, and of Co-Simulation masters that read there, which the FMI standard does not allow",
    }
    types = {s.name: s.variable.type for s in interface.signals}
    files = {f"{REFERENCE}/{name}_{end}.csv": csv_bytes(*table, types) for end, table in tables.items()}
    test = ReferenceExperiment(
        "reference",
        f"{titles[INPUTS]}; {titles[STEPPED]}",
        STEP,
        f"{name}_{INPUTS}.csv",
        f"{name}_{STEPPED}.csv",
    )
    smoke_test = f"{name}_{SMOKE_TEST}"
    files[f"{REFERENCE}/{smoke_test}"] = experiments_file(name, "Smoke test in Co-Simulation", [test])
    root = related_files()
    related = [
        ("text/csv", f"{name}_{end}.csv", "testcase" if end == INPUTS else "result", titles[end])
        for end in tables
    ]
    related.append(
        (EXPERIMENTS_TYPE, smoke_test, "experiment/smoke-test", f"{test.description}, as an experiment")
    )
    for kind, source, role, description in related:
        SubElement(root, "Related", type=kind, source=source, role=role, description=description)
    return files | {RELATED: xml_bytes(root)}


@lru_cache(maxsize=32)
def reference_tables(
    interface: Interface, *, traced: bool = True
) -> dict[str, tuple[list[str], list[list[float]]]]:
    """Head and rows of each file of reference results by the ending of its name, from the equations: `traced`, or in
    Python, which is slower, and takes no casadi for a model without states. They are the same for each version of
    FMI.

    Raises
    ------
    ArithmeticError, ValueError
        if a value is no finite number, one step of the file takes more than `_MOST_STEPS` of the integrator, or a
        linkage does not close.
    """
    model, p = interface.model, interface.start_parameters
    inputs = excitation(interface)
    layout = model.state_layout
    tables: dict[str, list[list[float]]] = {INPUTS: [], STEPPED: [], READ: []}

    outputs_at = (_traced_outputs if traced else _outputs)(interface, p)

    def outputs(t: float, u: Sequence[float], x: Sequence[float]) -> list[float]:
        values = outputs_at(u, x)
        if not np.isfinite(values).all():
            raise ArithmeticError(f"an output is no finite number at t = {t:g} s")
        return [t, *x, *values]

    march = _march(interface, p) if layout else None
    u: list[float] = []
    x: list[float] = []
    for k in range(ROWS):
        t = k * STEP
        values = inputs(t)
        new = [values[s.name] for s in interface.signals_of("input")]
        if k == 0:
            u = new
            x = layout.values(model.begin(p, model.input_layout.instance(new))) if layout else []
        tables[INPUTS].append([t, *new])
        tables[STEPPED].append(outputs(t, u, x))
        tables[READ].append(outputs(t, new, x))
        if march:
            x = march(t, new, x)
        u = list(new)
        for place, rate, half in model.extrapolations(new):
            moved = u[place] + STEP * (rate + STEP * half)
            u[place] = model.input_layout.variables[place].quantity.within_bounds(moved)
    heads = {kind: ["time", *(s.name for s in interface.signals_of(kind))] for kind in ("input", "output")}
    return {end: (heads["input" if end == INPUTS else "output"], rows) for end, rows in tables.items()}


def related_files(content: bytes | None = None) -> Element:
    """The root of the manifest of FMI-LS-REF with this content, or of a new one, which names no file yet."""
    register_namespace("fmi-ls", _NAMESPACE)
    if content is not None:
        return xml_of(content, RELATED)
    texts = {
        "name": STANDARD,
        "version": "1.0.0-beta.1",
        "description": "Layered Standard providing information on related files included in an FMU.",
    }
    return Element("fmiReferences", {f"{{{_NAMESPACE}}}fmi-ls-{key}": text for key, text in texts.items()})


_Outputs: TypeAlias = Callable[[Sequence[float], Sequence[float]], list[float]]
"""A function of inputs and states that gives all outputs."""


def _outputs(interface: Interface, p: Any) -> _Outputs:
    """The outputs with the parameters `p`, by the equations in Python."""
    model, layout = interface.model, interface.model.state_layout

    def values(u: Sequence[float], x: Sequence[float]) -> list[float]:
        states = layout.instance(list(x)) if layout else None
        parts = model.evaluate(MATH, p, model.input_layout.instance(list(u)), states)
        return [v for part, out in zip(model.parts, parts, strict=True) for v in part.layout.values(out)]

    return values


def _traced_outputs(interface: Interface, p: Any) -> _Outputs:
    """The outputs with the parameters `p`, by the traced equations."""
    import casadi

    trace = interface.trace
    equations = casadi.Function(
        "outputs", trace.symbols, [casadi.densify(casadi.vertcat(*map(casadi.SX, trace.outputs)))]
    )
    parameters, derived = interface.model.parameter_layout.values(p), getattr(p, "derived", [])
    # a zero without a sign
    return lambda u, x: [float(v) + 0.0 for v in equations(parameters, u, x, derived).full().ravel()]


def _march(interface: Interface, p: Any) -> Any:
    """A function of time, inputs and states that gives the states one step later, with an accuracy of about 1e-9,
    also for stiff equations. It keeps nothing from call to call."""
    import casadi

    model = interface.model
    layout = model.state_layout
    assert layout is not None
    (of_p, of_u, of_x, of_derived), derivatives = interface.trace.symbols, interface.trace.derivatives
    inputs, since = casadi.SX.sym("u", len(model.input_layout.names)), casadi.SX.sym("since")
    moving = [inputs[k] for k in range(inputs.numel())]
    for place, rate, half in model.extrapolations(moving):
        moving[place] += since * (rate + since * half)
    # states in units of their nominal size, so that one tolerance suits all of them
    nominal = casadi.DM([v.quantity.nominal or 1.0 for v in layout.variables])
    relative = casadi.SX.sym("x", nominal.numel())
    constants = casadi.DM([*model.parameter_layout.values(p), *getattr(p, "derived", [])])
    rates = casadi.substitute(
        [casadi.vertcat(*derivatives) / nominal],
        [of_p, of_derived, of_u, of_x],
        [constants[: of_p.numel()], constants[of_p.numel() :], casadi.vertcat(*moving), relative * nominal],
    )
    solver = casadi.integrator(
        "march",
        "cvodes",
        {"x": relative, "u": inputs, "t": since, "ode": casadi.cse(rates[0])},
        0.0,
        STEP,
        {"reltol": 1e-12, "abstol": 1e-14, "max_num_steps": _MOST_STEPS, "disable_internal_warnings": True},
    )

    def march(t: float, u: Sequence[float], x: Sequence[float]) -> list[float]:
        """The states one step after `t` [s]; an event at `t` comes first, and may lead to another."""
        if model.controlled:
            for _ in range(2):
                values, states = model.input_layout.instance(list(u)), layout.instance(list(x))
                x = model.constrained_states(MATH, p, values, states)
        try:
            later = solver(x0=casadi.DM(x) / nominal, u=u)["xf"] * nominal
        except RuntimeError as error:
            raise ArithmeticError(
                f"the states are too fast to be followed from t = {t:g} s on, or run away"
            ) from error
        states = [float(v) for v in later.full().ravel()]
        if not np.isfinite(states).all():
            raise ArithmeticError(f"the states run away after t = {t:g} s")
        return states

    return march


def csv_bytes(head: Sequence[str], rows: Iterable[Sequence[float]], types: Mapping[str, Type]) -> bytes:
    """A table in CSV with the exact numbers; a column without a type, such as the time, has real ones."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    kinds = [types.get(name, "Real") for name in head]
    writer.writerows([written(v, kind) for v, kind in zip(row, kinds, strict=True)] for row in rows)
    return text.getvalue().encode()


# -- inputs that move

_SIZES = {"rad": 0.1, "rad/s": 50.0, "kg": 10.0, "N": 100.0}
"""Size by unit of an input whose declaration has neither start nor nominal value; for other units the size is 1."""
_PUSH = 300.0
"""Acceleration of a shaft by the torque of its load, and the largest one by the torque that turns it [rad/s2]."""
_RUN = 4.0
"""Mean speed of a shaft that runs from rest [rad/s]."""


def excitation(interface: Interface) -> Callable[[float], dict[str, float]]:
    """The inputs by name as functions of time [s], for the reference results: all change smoothly, within their
    bounds. The names are the names in the FMU.

    A shaft runs from rest, unevenly, or swings within its bounds. A load or a torque has a size that suits the
    inertia of its shaft. Every other input swings about its start value, or about its usual size if the start
    value is 0.
    """
    model = interface.model
    sizes = dict(interface.sizes)
    inputs = {s.variable.name: s for s in interface.signals_of("input")}
    shafts: dict[str, Callable[[float], float]] = {}
    """the courses of inputs that belong to a shaft, by their names in the FMU"""
    for terminal in model.terminals:
        if terminal.kind == LOAD and (torque := terminal.members["tau_bias"]) in inputs:
            inertia = _inertia(interface, torque)
            courses = _load(sizes.get(torque, _PUSH * inertia), inertia)
        elif terminal.kind == FLANGE:
            courses = _shaft(
                interface, terminal.members.get("phi", ""), sizes.get(terminal.members.get("w", ""), _RUN)
            )
            if (torque := terminal.members.get("tau", "")) in inputs and model.state_layout:
                # with a usual torque the states of a light shaft would run away
                sizes[torque] = min(_size(inputs[torque], sizes), _PUSH * _inertia(interface, torque))
        else:
            continue
        shafts |= {interface.name(terminal.members[member]): course for member, course in courses.items()}
    swings = {s.name: _swing(s.variable.quantity, _size(s, sizes), k) for k, s in enumerate(inputs.values())}
    all_courses = swings | {name: course for name, course in shafts.items() if name in swings}
    return lambda t: {name: course(t) for name, course in all_courses.items()}


def _from_rest(run: float) -> dict[str, Callable[[float], float]]:
    """The motion of a shaft from rest, uneven, with the mean speed `run`."""
    return {
        "phi": lambda t: run * (t - 0.5 * math.sin(2.0 * t)),
        "w": lambda t: run * (1.0 - math.cos(2.0 * t)),
        "a": lambda t: 2.0 * run * math.sin(2.0 * t),
    }


def _shaft(interface: Interface, phi: str, run: float) -> dict[str, Callable[[float], float]]:
    """The motion of a shaft: it runs from rest with the mean speed `run` [rad/s, m/s], or swings if the input `phi`
    has bounds."""
    bounds = [v.quantity for v in interface.inputs if v.name == phi]
    if not bounds or not math.isfinite(bounds[0].high - bounds[0].low):
        return _from_rest(run)
    middle, reach = 0.5 * (bounds[0].low + bounds[0].high), 0.45 * (bounds[0].high - bounds[0].low)
    return {
        "phi": lambda t: middle + reach * math.sin(2.0 * t),
        "w": lambda t: 2.0 * reach * math.cos(2.0 * t),
        "a": lambda t: -4.0 * reach * math.sin(2.0 * t),
    }


def _load(tau: float, inertia: float) -> dict[str, Callable[[float], float]]:
    """A load of about this torque [N m] and inertia [kg m2]. The slopes are so small that, for a shaft up to 150 rad
    from the point of the load, the inertia stays positive and the torque within twice its size."""
    return {
        "tau_bias": lambda t: tau * (1.0 + 0.4 * math.sin(10.0 * t)),
        "tau_bias_dphi": lambda t: 0.01 * tau * math.cos(4.0 * t),
        "tau_bias_dw": lambda t: 0.002 * tau * (1.0 + 0.5 * math.sin(5.0 * t)),
        "J": lambda t: inertia * (1.0 + 0.3 * math.sin(6.0 * t)),
        "dJ_dphi": lambda t: 0.001 * inertia * math.cos(6.0 * t),
        "phi0": _from_rest(_RUN)["phi"],
        "w0": _from_rest(_RUN)["w"],
    }


def _inertia(interface: Interface, torque: str) -> float:
    """The inertia of the shaft on which the input `torque` acts [kg m2], from the derivatives of the accelerations by
    it; 1 for a model without states."""
    import casadi

    model, layout = interface.model, interface.model.state_layout
    if layout is None:
        return 1.0
    symbols, derivatives = interface.trace.symbols, interface.trace.derivatives
    speeds = [d for d, v in zip(derivatives, interface.states, strict=True) if v.unit == "rad/s"]
    by = casadi.jacobian(casadi.vertcat(*speeds), symbols[1][model.input_layout.names.index(torque)])
    p = interface.start_parameters
    u = [s.start for s in interface.signals_of("input")]
    x = layout.values(model.begin(p, model.input_layout.instance(u)))
    point: list[Any] = [model.parameter_layout.values(p), u, x, getattr(p, "derived", [])]
    slopes = casadi.Function("slopes", symbols, [casadi.densify(by)])(*point).full()
    return float(1.0 / (abs(slopes).max() or 1.0))


def _size(signal: Signal, sizes: Mapping[str, float]) -> float:
    """The size of an input: the stated one, its start value, its nominal size, or the one of its unit."""
    q = signal.variable.quantity
    return sizes.get(signal.variable.name) or signal.start or q.nominal or _SIZES.get(q.unit, 1.0)


def _swing(q: Quantity, size: float, k: int) -> Callable[[float], float]:
    """A swing about `size` by 40 %, limited to the bounds; the rate depends on the number `k` of the input."""
    near, far = sorted((0.6 * size, 1.4 * size))
    low, high = max(near, q.low), min(far, q.high)
    rate = 3.0 + 7.0 * (0.618 * k % 1.0)
    return lambda t: 0.5 * (low + high) + 0.5 * (high - low) * math.sin(rate * t)
