"""The linear model of a study, a linkage file or a model at a point that words name: `linearize`."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeGuard

import numpy as np

from ..core.engines import MATH
from ..core.errors import InputError, RunError, check_kind, near_name, refusal_prefix, shown
from ..core.model import Model
from ..core.quantities import Variable, plain_variable
from ..machines.equilibria import INDIFFERENT, STOP, Equilibria, Equilibrium
from ..machines.machine import Machine
from ..mechanism.models import DirectMachine, InverseMachine
from ..models import linkage_named
from ..reading.tables import to_number
from ..system.compiled_simulation import CompiledSystem
from ..system.linear import LinearModel, place
from ..system.linear import linearize as linearize_model
from ..system.signals import at_time
from . import config as study_files
from .config import Config
from .event import Event
from .package import drive_to_export, model_and_start
from .readings import crank_angle
from .rig import Rig
from .start_up import start_up
from .transients import follow, lead_times
from .verdict import START, STEADY

At = str | Mapping[str, Any] | None
"""A point: RUN:TIME of a study, equilibrium:N of a machine, or values of states and inputs by name, as a text
NAME=VALUE,.. or a mapping."""
_USUAL_SPEED = 2.0 * np.pi
"""Speed of the driver of a linkage that turns [rad/s]: 60 rev/min, as of the command ``chainunit linkage``."""
_USUAL_WAY_SPEED = 0.1
"""That of one that slides [m/s]."""


class LinearPoint(NamedTuple):
    """A model with the values of a point of it, by name, and the point in words."""

    model: Model
    parameters: Any
    inputs: dict[str, float]
    states: dict[str, float]
    words: str
    title: str = ""
    """of the study or the machine; empty for a model by its name"""

    def linear(self) -> LinearModel:
        """The linear model at the point."""
        return linearize_model(
            self.model, self.parameters, self.inputs, self.states, at=self.words, title=self.title
        )


def linearize(
    of: Any, at: At = None, *, config: str | Path | None = None, inverse: bool = False
) -> LinearModel:
    """The linear model of a drive, a linkage or a model at a point: A, B, C, D by exact derivatives.

    Parameters
    ----------
    of : a `Study` or a study file, whose drive becomes one system; a linkage file; or the name of a model, such as
        ``"DcMotor"``
    at : the point. Of a study: ``"RUN:TIME"``, such as ``"start_up:0.4 s"`` or ``"jam_left:3.2 s"``, the time of the
        run as its rows have it; by default steady running, at the end of the run of start-up and steady running. Or
        values of states and inputs by name, ``"phi=30 deg, w=60 rpm"`` or a mapping; all others are those of steady
        running, of the start of a model, or of a linkage whose driver goes at 60 rev/min (0.1 m/s) at the angle 0,
        one with a range in its middle. A direct model has the torque at which its speed is constant, unless
        ``tau`` is given. Of a linkage or a machine: ``"equilibrium"``, at rest in its stable equilibrium with the
        least potential, or ``"equilibrium:2"`` by its number in the table of ``chainunit linkage``
    config : a study file whose machine, feed or motor gives the values of a named model
    inverse : of a linkage file: the model that takes motion and gives torque and reactions, which has D alone, in
        place of the direct one

    Returns
    -------
    The linear model, whose ``state_space()`` is python-control's ``StateSpace``.

    Raises
    ------
    InputError, RunError
        for a name, a time or a value that the model has not, and where a run ends before the time.

    Examples
    --------
    >>> from chainunit import linearize
    >>> motor = linearize("DcMotor")
    >>> motor.unit_of("A", 2, 3), motor.poles[-1].state
    ('rad/(s2.A)', 'armature.i')
    """
    if hasattr(of, "config"):
        return _point_of_study(of.config, at).linear()
    check_kind("of", of, str | Path, "a study, a study file, a linkage file or the name of a model")
    check_kind("config", config, str | Path | None, "the path of a study file")
    return linear_point(str(of), at, None if config is None else Path(config), inverse=inverse).linear()


def linear_point(
    name: str,
    operating_point: At = None,
    values: Path | None = None,
    *,
    inverse: bool = False,
    progress: Callable[[str], None] = lambda what: None,
) -> LinearPoint:
    """The point of a file or a model by its name; `operating_point` is `at` of `linearize`, and `values` the study
    file that gives the values of a named model."""
    machine = linkage_named(name)
    whole = machine is None and name.lower().endswith(".toml")
    if whole and values is not None:
        raise InputError(
            f"config = {values}: is not of a study file, which has its own values; leave it out for {name}"
        )
    if inverse and machine is None:
        raise InputError(f"inverse: is of linkage files; leave it out for {name}")
    if whole:
        return _point_of_study(study_files.load(Path(name)), operating_point, progress)
    if machine is not None:
        if asks_for_equilibrium(operating_point):
            point = _at_equilibrium(machine if inverse else machine.direct(), {}, operating_point)
            return point._replace(title=machine.noun)
        return _point_of_linkage(machine, operating_point, inverse)
    loaded = None if values is None else study_files.load(values)
    model, start = model_and_start(name, loaded, progress=progress)
    if asks_for_equilibrium(operating_point):
        return _at_equilibrium(model, start, operating_point)
    return _at_values(model, start, operating_point)


# -- models and linkages


def _at_values(model: Model, start: Mapping[str, float], operating_point: At) -> LinearPoint:
    """The point of a model with these start values, and with the values of the `operating_point`."""
    point_values = _values(model, operating_point)
    names = set(model.parameter_layout.names)
    p = model.check(model.parameter_layout.from_names({k: x for k, x in start.items() if k in names}))
    input_names = set(model.input_layout.names)
    inputs = {k: float(x) for k, x in start.items() if k in input_names} | {
        k: x for k, x in point_values.items() if k in input_names
    }
    states: dict[str, float] = {}
    if model.state_layout:
        x = model.begin(p, model.input_layout.from_names(inputs))
        states = {k: float(v) for k, v in model.state_layout.by_name(x).items()}
        states |= {k: v for k, v in point_values.items() if k in states}
    if isinstance(model, DirectMachine) and "tau" not in point_values:
        inputs["tau"] = holding_torque(model, p, inputs, states)
    text = _in_words(model, point_values)
    return LinearPoint(model, p, inputs, states, text or "start of the model")


def _at_equilibrium(model: Model, start: Mapping[str, float], operating_point: str) -> LinearPoint:
    """The point of a machine at rest in an equilibrium, with these start values."""
    inverse = model.inverse if isinstance(model, DirectMachine) else model
    if not isinstance(inverse, InverseMachine) or inverse.States is not None:
        raise InputError(
            f"at = {shown(operating_point)}: {model.name} has no equilibria that are known; they are of linkages "
            "and machines without states of their own; give states and inputs, NAME=VALUE, .."
        )
    number, equilibrium = equilibrium_point(inverse, start, operating_point)
    phi = equilibrium.place * float(start.get("ratio", inverse.Parameters().ratio))
    at_rest = {"phi_start": phi, "w_start": 0.0} if model is not inverse else {"phi": phi, "w": 0.0}
    point = _at_values(model, {**start, **at_rest}, {"tau": 0.0} if model is not inverse else None)
    return point._replace(words=f"equilibrium {number} ({place_words(inverse, equilibrium)})")


def holding_torque(
    model: DirectMachine, p: Any, inputs: Mapping[str, float], states: Mapping[str, float]
) -> float:
    """The torque on the shaft at which its speed is constant at this point [N m], of a driver that slides the force
    [N]: a = (tau - tau_held)/(J_added + J)."""
    assert model.state_layout is not None
    u = model.input_layout.from_names(dict(inputs) | {"tau": 0.0})
    outputs = model.parts[0].layout.by_name(
        model.evaluate(MATH, p, u, model.state_layout.from_names(dict(states)))[0]
    )
    return float(-outputs["a"] * (p.J_added + outputs["J"]))


def _point_of_linkage(machine: Any, operating_point: At, inverse: bool) -> LinearPoint:
    """The point of a linkage at the angle (place) and speed of its driver."""
    low, high = machine.span
    ratio = float(machine.Parameters().ratio)
    middle = 0.0 if machine.turns else 0.5 * (low + high)
    usual = middle, _USUAL_WAY_SPEED if machine.slides else _USUAL_SPEED
    phi, w = (x * ratio for x in usual)
    start = {"phi": phi, "w": w} if inverse else {"phi_start": phi, "w_start": w}
    point = _at_values(machine if inverse else machine.direct(), start, operating_point)
    if operating_point is None:
        point = point._replace(words=_in_words(point.model, {"phi": phi, "w": w}))
    driver_at = (point.inputs if inverse else point.states)["phi"] / ratio
    if not machine.turns and not low <= driver_at <= high:
        end = "lower" if driver_at < low else "upper"
        point = point._replace(words=f"{point.words}, beyond the range of the driver, on its {end} end stop")
    return point._replace(title=machine.noun)


def _in_words(model: Model, point_values: Mapping[str, float]) -> str:
    """The values that a point gives to states and inputs, with their units."""
    units = {v.name: v.unit for v in _states_and_inputs(model)}
    return ", ".join(f"{name} = {x:g} {units[name]}".removesuffix(" 1") for name, x in point_values.items())


def _states_and_inputs(model: Model) -> tuple[Variable, ...]:
    return *(model.state_layout.variables if model.state_layout else ()), *model.input_layout.variables


def _values(model: Model, operating_point: At) -> dict[str, float]:
    """The values that a point gives to states and inputs."""
    if operating_point is None:
        return {}
    variables = _states_and_inputs(model)
    if isinstance(operating_point, str):
        pairs = {}
        for assignment in operating_point.split(","):
            name, sign, text = (part.strip() for part in assignment.partition("="))
            if not sign:
                raise InputError(
                    f"at = {shown(operating_point)}: must be NAME=VALUE, .. of states and inputs of {model.name}, "
                    f'such as "{variables[0].name}=0.5"; RUN:TIME is of a study, "equilibrium" of a machine'
                )
            pairs[name] = text
        operating_point = pairs
    check_kind("at", operating_point, Mapping, "a text, or a mapping of names to values")
    values = {}
    for name, value in operating_point.items():
        k = place("state or input", name, variables)
        try:
            values[name] = to_number(variables[k], value)
        except ValueError as error:
            raise InputError(f"at: {error}") from None
    return values


# -- a study


def _point_of_study(
    config: Config, operating_point: At, progress: Callable[[str], None] = lambda what: None
) -> LinearPoint:
    """The point of the whole drive of a study, compiled to one system. The compiled system makes the runs, which
    agree with the co-simulation of a study to some 1e-5.

    Raises
    ------
    InputError
        where motor or machine is a foreign FMU, for an unknown run, and for a time that the run has not.
    RunError
        where the torque limiter opens before.
    """
    runs = [START, STEADY, *config.events]
    if asks_for_equilibrium(operating_point):
        raise InputError(
            f"at = {shown(operating_point)}: is of a linkage file, or of a machine by its name; a study has runs: "
            f"{', '.join(runs)}"
        )
    rig = Rig(config.operation, drive_to_export(config, progress=progress), None)
    with refusal_prefix("linear model: "):
        system = CompiledSystem(rig.graph)
    run, time, point_values = STEADY, None, {}
    if isinstance(operating_point, str) and "=" not in operating_point:
        run, time = _run_and_time(operating_point, runs)
    else:
        point_values = _values(system.model, operating_point)
    progress(f"run to {run.replace('_', ' ')}")
    simulation = _simulation_at(rig, run, config.events.get(run), time)
    assert system.model.state_layout is not None
    time = float(simulation.time)
    inputs = system.inputs | {full: float(at_time(x, time)) for full, x in simulation.signals.items()}
    states = dict(zip(system.model.state_layout.names, map(float, simulation.states), strict=True))
    for group in (inputs, states):
        group |= {name: x for name, x in point_values.items() if name in group}
    text = f"{'steady running' if run == STEADY else run}, t = {time:.6g} s"
    words = ", ".join(filter(None, (text, _in_words(system.model, point_values))))
    return LinearPoint(system.model, system.p, inputs, states, words, config.title)


def _run_and_time(operating_point: str, runs: list[str]) -> tuple[str, float | None]:
    """The run and the time [s] of a point RUN:TIME; without a time the end of steady running."""
    name, sign, text = (part.strip() for part in operating_point.partition(":"))
    if name not in runs:
        raise InputError(
            f"at = {shown(operating_point)}: there is no run {shown(name)}{near_name(name, runs) or ';'} there are "
            f'{", ".join(runs)}; must be RUN:TIME, such as "{START}:0.4 s", or NAME=VALUE, .. of states and inputs'
        )
    if not sign and name == STEADY:
        return name, None
    if not text:
        raise InputError(
            f'at = {shown(operating_point)}: must be RUN:TIME, such as "{name}:0.4 s"; the time is missing'
        )
    try:
        return name, to_number(plain_variable("at", "s", "time of the run", low=0.0, high=1e6), text)
    except ValueError as error:
        raise InputError(f'{error}; must be RUN:TIME, such as "{name}:0.4 s"') from None


def _simulation_at(rig: Rig, run: str, event: Event | None, time: float | None) -> Any:
    """The compiled simulation of a run at the time [s]: of start-up and steady running, by default at their end, or
    of an event."""
    is_start = event.from_rest if event is not None else run == START and not rig.operation.empty_start
    simulation: Any = rig.from_rest(event if is_start else None)
    if is_start:
        assert time is not None
        return _run_to(simulation, rig, time)
    started = start_up(rig, simulation, lambda time: None, rig.guards)
    _refuse_opened(simulation, started.stop - 0.5 * rig.step)
    rig = started.rig
    if time is None:
        return simulation
    if event is None:
        if run == STEADY and time < started.steady_from:
            raise InputError(
                f'at = "{STEADY}:{time:g} s": steady running begins at {started.steady_from:.4g} s; before it name '
                f'"{START}:{time:g} s"'
            )
        return _run_to(rig.from_rest(), rig, time)
    if not rig.takes(event):
        raise InputError(f"at: {event.title} is not in the study, as {event.without}")
    saved = simulation.save()
    steady = started.run.sel(time=slice(started.steady_from, None))
    angles = crank_angle(rig.drive, steady)
    speed = float(angles[-1] - angles[0]) / float(steady["time"][-1] - steady["time"][0])
    begin = saved + lead_times(rig, simulation, [event], float(angles[-1]), speed)[0]
    stop = begin + event.time_followed(rig.operation.turn)
    if not saved < time <= stop:
        raise InputError(
            f"at = {time:g} s: the run of {event.name} goes from {saved:.4g} s to {stop:.4g} s; the event begins at "
            f"{begin:.4g} s"
        )
    if time > begin:
        follow(rig, simulation, event, begin, time, guards=rig.guards)
        _refuse_opened(simulation, time)
        return simulation
    simulation.restore()
    simulation.signals = rig.signals()
    return _run_to(simulation, rig, time)


def _run_to(simulation: Any, rig: Rig, time: float) -> Any:
    """The simulation, run to the time [s].

    Raises
    ------
    RunError
        where the torque limiter opens before.
    """
    if time > simulation.time:
        simulation.run(time, rig.step, guards=rig.guards)
    _refuse_opened(simulation, time)
    return simulation


def _refuse_opened(simulation: Any, time: float) -> None:
    """Refuse a point that a run does not reach, as the torque limiter ends it before."""
    if simulation.time < time * (1.0 - 1e-9) - 1e-9:
        raise RunError(
            f"the torque limiter opens at t = {simulation.time:.4g} s, before the point at {time:.4g} s; take an "
            "earlier one"
        )


_FORM = re.compile(r"equilibrium\s*(?::\s*(.*))?")


def asks_for_equilibrium(operating_point: object) -> TypeGuard[str]:
    """Whether a point is given as an equilibrium."""
    return (
        isinstance(operating_point, str)
        and operating_point.strip().partition(":")[0].strip() == "equilibrium"
    )


def equilibrium_point(
    model: InverseMachine, values: Mapping[str, float], operating_point: str
) -> tuple[int, Equilibrium]:
    """The number of an equilibrium of a machine and the equilibrium: by default the stable one with the least
    potential, the first one where it has none.

    Parameters
    ----------
    values : parameters and loads that differ from their start values, by name; other names do not matter
    operating_point : ``"equilibrium"``, or ``"equilibrium:N"`` with the number in the table of ``chainunit linkage``

    Raises
    ------
    InputError
        where there is none, and for one on a stop or over a range; the message lists all.
    """
    machine = Machine(model, {name: x for name, x in values.items() if name in model.parameter_layout.names})
    feed = model.feed_layout.from_names(
        {name: x for name, x in values.items() if name in model.feed_layout.names}
    )
    equilibria = machine.equilibria(feed)
    number = _number(operating_point, equilibria, model)
    equilibrium = equilibria.places[number - 1]
    if equilibrium.kind in (STOP, INDIFFERENT):
        where = "on an end stop" if equilibrium.kind == STOP else "indifferent over a range"
        raise InputError(
            f"at = {shown(operating_point)}: the equilibrium {number} is {where}; {_listed(equilibria, model)}; "
            f"give {_others(equilibria)}"
        )
    return number, equilibrium


def _number(operating_point: str, equilibria: Equilibria, model: InverseMachine) -> int:
    """The number, from 1 on, of the equilibrium that a point names; without a number the stable one of the least
    potential."""
    match = _FORM.fullmatch(operating_point.strip())
    text = match[1] if match else operating_point
    if text is None:
        if not equilibria.stable:
            raise InputError(
                f"at = {shown(operating_point)}: there is no stable equilibrium; {_listed(equilibria, model)}; "
                f"give {_others(equilibria)}"
            )
        lowest = min(equilibria.stable, key=lambda equilibrium: equilibrium.potential or 0.0)
        return equilibria.places.index(lowest) + 1
    if not text.isdecimal() or not 1 <= int(text) <= len(equilibria.places):
        raise InputError(
            f"at = {shown(operating_point)}: must be equilibrium:N with N from 1 to {len(equilibria.places)}; "
            f"{_listed(equilibria, model)}"
        )
    return int(text)


def _others(equilibria: Equilibria) -> str:
    """The points that are left, in words: equilibria that are no stop and no range, by number, and places."""
    free = [
        k for k, equilibrium in enumerate(equilibria.places, 1) if equilibrium.kind not in (STOP, INDIFFERENT)
    ]
    by_number = f'the number of one, as in "equilibrium:{free[0]}", or ' if free else ""
    return f'{by_number}a place, "phi=.., w=0"'


def _listed(equilibria: Equilibria, model: InverseMachine) -> str:
    """The equilibria in words."""
    if not equilibria.places:
        return "it has no equilibrium"
    return "its equilibria are " + ", ".join(
        f"{k} ({place_words(model, equilibrium)})" for k, equilibrium in enumerate(equilibria.places, 1)
    )


def place_words(model: InverseMachine, equilibrium: Equilibrium) -> str:
    """Kind and place of an equilibrium in words."""
    unit = "m" if model.slides else "rad"
    on = "on its stop" if equilibrium.kind == STOP else equilibrium.kind
    return f"{on}, {equilibrium.place:.6g} {unit}"
