"""The load port: how a machine shows its load to the shaft that drives it; and other declarations that models with a
shaft have in common.

The machine gives its torque at constant speed and its reflected inertia at one point, with their slopes. The
driver solves for its own acceleration with the linearised load inside its step. So there is no algebraic
loop, and the coupling is second order in the communication step; through a driveline near rest it is first order
(`chainunit.drives.driveline`). The port is seven plain signals, and ports can be chained.
"""

from __future__ import annotations

from typing import Any

from .model import Terminal
from .quantities import Layout, Value, declaration, group, quantity


@declaration
class Solver:
    """Limits of the internal integrator, a parameter of each model with states."""

    max_steps: Value = quantity(
        "1",
        "most steps of its own that a communication step may take; the step is discarded where it takes more",
        default=500_000,
        min=1,
        max=1_000_000_000,
        type="Integer",
    )


@declaration
class PortValues:
    """The load at the point (phi0, w0)."""

    tau_bias: Value = quantity("N.m", "torque needed at constant speed of the shaft", nominal=100.0)
    J: Value = quantity("kg.m2", "inertia reflected to the shaft", min=0.0)
    dJ_dphi: Value = quantity("kg.m2/rad", "derivative of J by the angle of the shaft")
    phi0: Value = quantity("rad", "angle of the shaft at which the load was evaluated")
    w0: Value = quantity("rad/s", "speed of the shaft at which the load was evaluated")


@declaration
class PortSlopes:
    """Exact derivatives of the load."""

    tau_bias_dphi: Value = quantity(
        "N.m/rad", "derivative of tau_bias by the angle of the shaft", nominal=100.0
    )
    tau_bias_dw: Value = quantity("N.m.s/rad", "derivative of tau_bias by the speed of the shaft")


@declaration
class LoadPort(PortSlopes, PortValues):
    """The seven signals of the load port, as inputs of a driver."""


NO_LOAD = LoadPort(tau_bias=0.0, J=0.0, dJ_dphi=0.0, phi0=0.0, w0=0.0, tau_bias_dphi=0.0, tau_bias_dw=0.0)


@declaration
class Start:
    """Parameters of a model that has a shaft of its own."""

    phi_start: Value = quantity("rad", "angle of the motor's shaft at the start", default=0.0)
    w_start: Value = quantity("rad/s", "speed of the motor's shaft at the start", default=0.0)
    solver: Solver = group(Solver, "internal integrator", default=Solver())


@declaration
class LoadInput:
    """The load of a shaft."""

    load: LoadPort = group(LoadPort, "load", default=NO_LOAD)


@declaration
class ShaftMotion:
    """Motion of the motor's shaft, as the input of a model that does not compute it."""

    phi: Value = quantity("rad", "motor angle", default=0.0)
    w: Value = quantity("rad/s", "motor speed", default=0.0)
    a: Value = quantity("rad/s2", "motor acceleration", default=0.0)


@declaration
class ShaftInput(ShaftMotion, LoadInput):
    """Motion of the motor's shaft, and the load of the machine: the inputs of a part between motor and
    machine."""


@declaration
class LoadState:
    """The energy that a shaft has given to its load."""

    load_energy: Value = quantity("J", "energy given to the load since the start", nominal=1000.0)


def load_torque(load: LoadPort, phi: Any, w: Any) -> Any:
    """Torque that the load needs at constant speed [N m], linearised about the port's point."""
    return load.tau_bias + load.tau_bias_dphi * (phi - load.phi0) + load.tau_bias_dw * (w - load.w0)


def load_inertia(load: LoadPort, phi: Any) -> Any:
    """Inertia of the load [kg m2], linearised about the port's point."""
    return load.J + load.dJ_dphi * (phi - load.phi0)


def shaft_motion(load: LoadPort, phi: Any, w: Any, J: Any, tau: Any) -> tuple[Any, Any]:
    """Acceleration [rad/s2] of a shaft with the inertia `J` [kg m2], which the torque `tau` [N m] drives
    against the load, and the torque [N m] that the shaft gives to the load."""
    torque, inertia = load_torque(load, phi, w), load_inertia(load, phi)
    a = (tau - torque) / (J + inertia)
    return a, inertia * a + torque


OWN = "org.chainunit"
"""Prefix of the names of this package's own kinds of terminals."""
FLANGE, LOAD, MEASURED = f"{OWN}.flange", f"{OWN}.load", f"{OWN}.measured"
"""Kinds of terminals: of a shaft, of a load port, and of the measured signals of a motor."""
ROTATIONAL = "Modelica.Mechanics.Rotational.Interfaces.Flange_a"
TRANSLATIONAL = "Modelica.Mechanics.Translational.Interfaces.Flange_a"
"""Kinds of the flanges of Modelica's library, as the FMI standard (3.0, 2.4.9) and exporters of Modelica write them:
the path of the connector's class."""


def flange(flow: str, prefix: str = "", name: str = "flange") -> Terminal:
    """The terminal, called `name`, of a shaft whose torque flows into the model or out of it ("inflow", "outflow")
    and whose variables carry `prefix`."""
    members = {member: prefix + member for member in ("phi", "w", "a", "tau")}
    return Terminal(name, FLANGE, "the shaft and its torque", members, {"tau": flow})


def flanges(flow: str) -> tuple[Terminal, Terminal]:
    """The terminals of the shaft: the package's own, and the one that tools with Modelica's library know."""
    terminal = flange(flow)
    return terminal, _as_modelica(terminal, "flange_a")


def driven_flanges() -> tuple[Terminal, Terminal]:
    """The same of the second shaft of a part between motor and machine, which drives the machine; its variables
    carry ``driven.``."""
    terminal = flange("outflow", "driven.", "driven")
    return terminal, _as_modelica(terminal, "flange_b")


def line_terminals() -> tuple[Terminal, ...]:
    """The terminals of a part between motor and machine: its shaft and load port to the motor, and those to the
    machine."""
    return *flanges("inflow"), load_terminal(), *driven_flanges(), load_terminal("load.", "machine")


def _as_modelica(terminal: Terminal, name: str) -> Terminal:
    """The terminal of a shaft as Modelica's flange: of angle and torque alone. Every one is of the kind Flange_a,
    as tools join terminals of equal kinds, and Modelica's Flange_a and Flange_b differ in their icon alone."""
    members = {member: terminal.members[member] for member in ("phi", "tau")}
    return Terminal(name, ROTATIONAL, f"{terminal.description}, as Modelica's", members, terminal.flows)


def measured_terminal(**signals: str) -> Terminal:
    """The terminal of the motion of a motor and of the `signals` that are measured at it: ``torque``, ``current``,
    ``power``, with the names of their variables."""
    members = {"phi": "phi", "w": "w", **signals}
    return Terminal("measured", MEASURED, "the measured signals of the motor", members, rule="bus")


def way_terminals(load: bool, driver: str = "") -> tuple[Terminal, ...]:
    """The terminals of a driver that slides: our own, the one that tools with Modelica's library know, and with
    `load` its load port. None of them fits a shaft. The variables of a further `driver` carry its name."""
    prefix, suffix = (f"{driver}.", f"_{driver}") if driver else ("", "")
    members = {member: prefix + member for member in ("phi", "w", "a", "tau")}
    title = "the driver and its force"
    terminal = Terminal(f"flange{suffix}", f"{OWN}.linear_flange", title, members, {"tau": "inflow"})
    modelica = {"s": members["phi"], "f": members["tau"]}
    outside = Terminal(
        f"flange_a{suffix}", TRANSLATIONAL, f"{title}, as Modelica's", modelica, {"f": "inflow"}
    )
    port = {member: prefix + member for member in Layout(LoadPort).names}
    title = "the load port: a load as the driver sees it"
    return (
        terminal,
        outside,
        *([Terminal(f"load{suffix}", f"{OWN}.linear_load", title, port)] if load else []),
    )


def further_terminals(driver: str) -> tuple[Terminal, ...]:
    """The terminals of a driver that turns beside the first one; its variables carry its name."""
    terminal = flange("inflow", f"{driver}.", f"flange_{driver}")
    port = load_terminal(f"{driver}.", f"load_{driver}")
    return terminal, _as_modelica(terminal, f"flange_a_{driver}"), port


def load_terminal(prefix: str = "", name: str = "load") -> Terminal:
    """The terminal, called `name`, of a load port whose variables carry `prefix`."""
    members = {member: prefix + member for member in Layout(LoadPort).names}
    return Terminal(name, LOAD, "the load port: a load as the shaft sees it", members)
