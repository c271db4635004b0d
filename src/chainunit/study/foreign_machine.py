"""A foreign machine in a study: an FMU of somebody else, declared by its own variables."""

from __future__ import annotations

import keyword
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from pydantic import BaseModel

from ..core.quantities import Value, base_units, declared_class, group, quantity
from ..machines.machine import Machine
from ..mechanism.models import MachineModel
from ..system import Connector, CoSimulation, FmuComponent, System, foreign_component

_GEAR = Connector("ratio", "parameter", "1", {}, 1.0, "gear ratio, motor turns per crank turn", 1e-4, 1e4)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class ForeignModel(MachineModel):
    """The model of a machine that is a foreign FMU: its parameters, and as `Feed` its inputs other than the
    shaft.

    An FMU with a parameter `ratio` includes the gear, and its shaft is the motor's. Otherwise its shaft is
    the crank, and a gear stands before it if one is needed.
    """

    component: FmuComponent
    usual_speed: tuple[float, float] = (0.05, 1000.0)

    def has_gear(self) -> bool:
        """Whether the FMU includes the gear."""
        return "ratio" in self.component.connectors


def foreign_model(file: Path, names: Mapping[str, str]) -> ForeignModel:
    """The machine in an FMU; `names` gives the FMU's names by ours, where they differ. Its feed are the inputs that
    are not of its shaft. The gear ratio is a parameter of the machine even if the FMU has none.

    Raises
    ------
    InputError
        see `chainunit.system.foreign_component`.
    """
    component = foreign_component(file, "machine", names)
    connectors, ratio = component.connectors.values(), component.connectors.get("ratio")
    gear = _GEAR if ratio is None else replace(ratio, most=_GEAR.most, least=_GEAR.least)
    others = [c for c in connectors if c.causality == "parameter" and c.name != "ratio"]
    shaft = {name for terminal in component.terminals.values() for name in terminal.members.values()}
    feed = _declared("Feed", [c for c in connectors if c.causality == "input" and c.name not in shaft])
    return ForeignModel(
        name=component.title,
        description=component.description or component.title,
        component=component,
        Parameters=_declared("Parameters", [gear, *others]),
        Inputs=feed,
        Feed=feed,
        made=(foreign_model, (file, names)),
    )


def declared_parameters(component: FmuComponent) -> type:
    """The declaration of the parameters of an FMU."""
    return _declared("Parameters", [c for c in component.connectors.values() if c.causality == "parameter"])


def _declared(title: str, connectors: Iterable[Connector]) -> type:
    """The declaration of variables; those with dots in their names are in groups. A variable is left out if
    no table of a file can have its name."""
    groups: dict[str, list[Connector]] = {}
    for c in connectors:
        head, _, member = c.name.partition(".")
        if head.isidentifier() and not (
            keyword.iskeyword(head) or head[0] == "_" or hasattr(BaseModel, head)
        ):
            groups.setdefault(head, []).append(replace(c, name=member))
    fields: list[tuple[str, Any, Any]] = []
    for head, members in groups.items():
        if not members[0].name:
            fields.append((head, Value, _quantity(members[0])))
        else:
            group_type = _declared(f"{title}_{head}", [c for c in members if c.name])
            fields.append((head, group_type, group(group_type, head, default=group_type())))
    declared: type = declared_class(title, (), fields)
    return declared


def _quantity(c: Connector) -> Any:
    """The declaration of one variable; an unknown unit is given in the description."""
    try:
        base_units(c.unit or "1")
        unit, description = c.unit or "1", c.description
    except ValueError:
        unit, description = "1", f"{c.description} [{c.unit}]"
    return quantity(unit, description, default=c.start, min=c.least, max=c.most, type=c.type)


class ForeignMachine(Machine):
    """A machine that is a foreign FMU, with its parameters. It has no bearings and no direct model."""

    model: Any

    @property
    def needs_gear(self) -> bool:
        """Whether a gear has to stand before the machine."""
        return self.ratio != 1.0 and not self.model.has_gear()

    @property
    def component(self) -> FmuComponent:
        """The FMU with these parameters."""
        names = self.model.component.connectors
        component: FmuComponent = self.model.component
        return replace(component, start={name: x for name, x in self.by_name.items() if name in names})

    def outputs(self, phi: Any, w: Any = 0.0, a: Any = 0.0, feed: Any = None) -> Any:
        """See `Machine`: torque `tau` [N m] and inertia `J` [kg m2] at the motor. The FMU alone is run at the
        constant speed `w` [rad/s]. The run begins a turn of the crank before the angles `phi` [rad], which
        rise evenly, shape (n,)."""
        gear = self.ratio if self.needs_gear else 1.0
        first, w, turn = float(phi[0]) / gear, float(w) / gear, 2.0 * math.pi * self.ratio / float(w)
        times = (np.asarray(phi) - phi[0]) / (w * gear)
        terminals = self.model.component.terminals
        shaft, load = terminals["flange"].members, terminals["load"].members
        signals = {f"machine.{name}": x for name, x in self._feed(feed).items()}
        signals |= {f"machine.{shaft['phi']}": lambda t: first + w * t, f"machine.{shaft['w']}": w}
        names = {"tau": f"machine.{load['tau_bias']}", "J": f"machine.{load['J']}"}
        step = float(times[1] - times[0])
        with CoSimulation(System({"machine": self.component}), signals, -turn) as alone:
            alone.run(0.0, step, names=names.values())
            run = alone.run(float(times[-1]), step, names=names.values())
        tau, J = (run[full].values for full in names.values())
        return SimpleNamespace(tau=tau / gear, J=J / gear**2)
