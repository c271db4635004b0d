"""Foreign FMUs as components: a motor or a machine with the terminals of this package.

A *flange* has the angle `phi` [rad], the speed `w` [rad/s], the acceleration `a` [rad/s2] and the torque `tau` [N.m]
of a shaft. A motor gives the motion and takes a *load*; a machine takes the motion and gives a load. The load is the
torque at constant speed `tau_bias` and the inertia `J` at the angle `phi0` and speed `w0`, with their slopes
(`chainunit.core.ports`). An FMU may omit all members of the load except `tau_bias` and `J`; without the slopes the
load is held constant over a step.

Terminals come from terminalsAndIcons.xml of the FMU, if it has this file, else from the names of its variables:
`phi`, `w`, `a`, `tau`; `load.tau_bias` and so on for a motor, `tau_bias` and so on for a machine. A mapping gives the
names of an FMU with other names. A variable without unit counts as one in the unit of this package."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

from ..core.errors import InputError, printable, shown
from ..core.model import Terminal
from ..core.ports import FLANGE, LOAD, LoadPort, flange, load_terminal
from ..core.quantities import Layout, base_units
from .graph import Connector, FmuComponent
from .instance import NUMBERS, Fmu, Kind

Role = Literal["motor", "machine"]
"""The side of a shaft on which an FMU stands."""

_UNITS = {"phi": "rad", "w": "rad/s", "a": "rad/s2", "tau": "N.m"} | {
    v.name: v.unit for v in Layout(LoadPort).variables
}
"""Unit of each member of a terminal."""
_REQUIREMENTS = {FLANGE: ("phi", "w"), LOAD: ("tau_bias", "J")}
"""Members that a terminal must have."""
_MOTOR = {"w_ref": "rad/s", "tau_ff": "N.m", "load_energy": "J", "air_gap_tau": "N.m", "supply_power": "W"}
"""Unit of each optional signal of a motor, besides its terminals, that a system reads or sets."""
_MACHINE = {
    "ratio": "1",
    "power": "W",
    "kinetic_energy": "J",
    "potential_energy": "J",
    "dissipated_power": "W",
}
"""Unit of each optional signal of a machine that a system reads or sets."""
NAMES: Mapping[Role, tuple[str, ...]] = {
    "motor": (*flange("outflow").members.values(), *load_terminal("load.").members.values(), *_MOTOR),
    "machine": (*flange("inflow").members.values(), *load_terminal().members.values(), *_MACHINE),
}
"""Names of a motor's and of a machine's variables that a system knows."""
_TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"


def fmu_component(
    file: Path, names: Mapping[str, str] | None = None, *, kind: Kind = "Co-Simulation"
) -> FmuComponent:
    """An FMU as a component, with its terminals.

    Parameters
    ----------
    file : the FMU
    names : by a name of this package, the FMU's name where it differs, such as ``{"w": "speed"}``
    kind : interface that the FMU must have

    Raises
    ------
    InputError
        where the file is no FMU 2.0 of that kind, the FMU has no variable of a name, or the unit of a terminal's
        variable is another one than that of this package.
    """
    names, file = dict(names or {}), Path(file)
    fmu = Fmu(file, kind)
    try:
        variables = [v for v in fmu.description.modelVariables if v.type in NUMBERS]
        fmu_names = {v.name for v in variables}
        for name, theirs in names.items():
            if theirs not in fmu_names:
                raise InputError(f"{file}: has no variable {printable(theirs)}, which was given for {name}")
            if name != theirs and name in fmu_names and name not in names.values():
                raise InputError(
                    f"{file}: has a variable {printable(name)} of its own, beside {printable(theirs)}, which was "
                    f"given for {name}; leave that name out, or name its own otherwise: other = {name!r}"
                )
        ours = {theirs: name for name, theirs in names.items()}
        units = {unit.name: unit.baseUnit for unit in fmu.description.unitDefinitions}
        connectors = {
            name: Connector(
                name,
                v.causality,
                v.unit or "",
                _dimension(v.unit, units) if v.type == "Real" else {},
                _number(file, v, "start", 0.0),
                printable(v.description or ""),
                _number(file, v, "min", -math.inf),
                _number(file, v, "max", math.inf),
                v.type,
            )
            for v in variables
            if v.causality in ("parameter", "input", "output")
            for name in [ours.get(v.name, v.name)]
        }
        terminals = _declared(fmu, ours) or _by_names(connectors)
        description = printable(fmu.description.description or "")
    finally:
        fmu.close()
    for terminal in terminals:
        units = {v: _UNITS[member] for member, v in terminal.members.items() if member in _UNITS}
        for variable in units:
            if variable not in connectors or connectors[variable].type != "Real":
                raise InputError(
                    f"{file}: terminal {terminal.name} has the member {printable(variable)}, which is no Real "
                    "parameter, input or output of the FMU"
                )
        connectors |= _with_units(file, units, connectors)
    return FmuComponent(file, connectors, {t.name: t for t in terminals}, names, description=description)


def foreign_component(file: Path, role: Role, names: Mapping[str, str] | None = None) -> FmuComponent:
    """An FMU as the motor or the machine of a system; see `fmu_component`.

    Raises
    ------
    InputError
        also where a variable is missing, or an input is an output or the reverse: in one line, with the remedy.
    """
    component = fmu_component(file, names)
    motor = role == "motor"
    kinds = {"flange": FLANGE, "load": LOAD}
    gives = {FLANGE: "output" if motor else "input", LOAD: "input" if motor else "output"}
    for name, kind in kinds.items():
        terminal = component.terminals.get(name)
        prefix = "load." if kind == LOAD and motor else ""
        for member in _REQUIREMENTS[kind]:
            variable = terminal.members.get(member, "") if terminal else prefix + member
            connector = component.connectors.get(variable)
            label = component.names.get(variable, variable) or prefix + member
            needs = f"a {role} needs the {gives[kind]} {prefix + member} in {_UNITS[member]}"
            if connector is None:
                raise InputError(
                    f"{file}: has no variable {prefix + member}; {needs}, or a name for it among `names`"
                )
            if connector.causality != gives[kind]:
                raise InputError(f"{file}: {label} is of the kind {connector.causality}; {needs}")
    signal_units = _MOTOR if motor else _MACHINE
    signals = {name: unit for name, unit in signal_units.items() if name in component.connectors}
    return replace(
        component, connectors={**component.connectors, **_with_units(file, signals, component.connectors)}
    )


def _dimension(unit: str | None, definitions: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """Powers of the base units, with factor and offset if they differ from 1 and 0; None where the unit is
    unknown."""
    if not unit:
        return None
    definition = definitions.get(unit)
    if definition is None:
        try:
            return base_units(unit)
        except ValueError:
            return None
    powers = {base: getattr(definition, base) for base in ("kg", "m", "s", "A", "K", "mol", "cd", "rad")}
    scale = {"factor": definition.factor, "offset": definition.offset}
    plain = {"factor": 1.0, "offset": 0.0}
    return {base: n for base, n in powers.items() if n} | {k: x for k, x in scale.items() if x != plain[k]}


def _with_units(
    file: Path, units: Mapping[str, str], connectors: Mapping[str, Connector]
) -> dict[str, Connector]:
    """The connectors of the variables in `units`, by name, with these units."""
    variables = {}
    for name, unit in units.items():
        connector = connectors[name]
        if connector.unit and connector.dimension != base_units(unit):
            raise InputError(
                f"{file}: {name} is in {printable(connector.unit)}; must be in {unit} to be joined"
            )
        variables[name] = replace(connector, unit=unit, dimension=base_units(unit))
    return variables


def _by_names(connectors: Mapping[str, Connector]) -> list[Terminal]:
    """The terminals of an FMU that declares none, by the names of its variables: a shaft for each prefix with angle
    and torque, and a load port for each prefix with the values of a load."""
    ends = {name for name, c in connectors.items() if c.causality != "parameter"}
    terminals = []
    for prefix in _prefixes(ends, _REQUIREMENTS[FLANGE]):
        shaft = flange("outflow")
        terminals.append(_of(ends, shaft, prefix.rstrip(".") or shaft.name, prefix))
    prefixes = _prefixes(ends, _REQUIREMENTS[LOAD])
    for prefix in prefixes:
        # if the FMU also gives a load itself, the load that it takes is that of the machine behind it
        name = "load" if prefix in ("", "load.") else prefix.rstrip(".")
        if prefix == "load." and "" in prefixes:
            name = "machine"
        terminals.append(_of(ends, load_terminal(), name, prefix))
    return terminals


def _prefixes(names: Iterable[str], members: Iterable[str]) -> list[str]:
    """The prefixes with which the names contain all `members`."""
    sets = [{n[: -len(m)] for n in names if n == m or n.endswith(f".{m}")} for m in members]
    return sorted(set.intersection(*sets))


def _of(ends: Iterable[str], pattern: Terminal, name: str, prefix: str) -> Terminal:
    """A terminal of the kind of `pattern`, with those of its members that the FMU has."""
    members = {m: prefix + m for m in pattern.members if prefix + m in ends}
    return Terminal(name, pattern.kind, pattern.description, members)


def _number(file: Path, variable: Any, name: str, usual: float) -> float:
    """The number of an attribute of a variable; `usual` where it states none."""
    attribute = getattr(variable, name)
    if attribute in (None, ""):
        return usual
    try:
        number = float({"true": 1, "false": 0}.get(attribute, attribute))
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number) and number != usual:
        raise InputError(
            f"{file}: {printable(variable.name)} has {name} = {shown(attribute)}; must be a finite number"
        )
    return number


def _declared(fmu: Fmu, ours: Mapping[str, str]) -> list[Terminal]:
    """The terminals of the kinds flange and load in the FMU's own declaration; none where it has no declaration."""
    root = fmu.document(_TERMINALS)
    terminals = []
    for node in () if root is None else root.iter("Terminal"):
        kind, name = node.get("terminalKind", ""), node.get("name", "")
        if kind in (FLANGE, LOAD):
            members = {
                m.get("memberName", ""): ours.get(m.get("variableName", ""), m.get("variableName", ""))
                for m in node.iter("TerminalMemberVariable")
            }
            terminals.append(Terminal(name, kind, node.get("description", ""), members))
    return terminals
