"""The co-simulated system of a study: a motor and the machine that it drives."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..core.errors import InputError
from ..core.quantities import Layout
from ..drives.driveline import CardanDriveline
from ..drives.gear import Gear
from ..drives.motor import Motor
from ..fmu.backends import Backend, Origin
from ..fmu.backends import export as export_fmu
from ..machines.api import ChainUnitMachine
from ..machines.machine import Machine
from ..mechanism.models import DirectMachine
from ..system import (
    Bond,
    Component,
    FmuComponent,
    ModelComponent,
    Profile,
    System,
    export,
    in_line,
    shaft_torque,
    through,
)
from ..system.graph import Connection
from .arrays import peak
from .foreign_machine import ForeignMachine


class AbsentError(InputError):
    """A quantity that this motor or machine does not have; `part` is the name of motor or machine in the
    system."""

    def __init__(self, part: str, text: str) -> None:
        super().__init__(text)
        self.part = part


def _component(machine: Machine) -> ModelComponent:
    return ModelComponent(machine.model, machine.p)


@dataclass(frozen=True)
class Drive:
    """A `motor` with its `parameters` that turns a `machine`; `follows` says whether it follows the reference
    `w_ref`."""

    motor: type[Motor]
    parameters: Any
    machine: Machine
    follows: bool = True
    rated_current: float | None = None
    """rated current [A], where a nameplate gives it"""
    feed_forward: bool = False
    """whether the speed control has feed-forward: a second machine FMU computes the torque of the machine
    with its normal feed, at the motor's angle and speed and the requested acceleration"""

    line: Any = None
    """parameters of the driveline between motor and machine, or None; its `ratio` is that of the gear before
    it"""

    flywheel: float = 0.0
    """inertia of a flywheel on the motor's shaft [kg m2]"""

    gear_inertia: float = 0.0
    gear_friction: float = 0.0
    """inertia [kg m2] and friction [N m s/rad] of the gear of a catalogue motor, at the motor's shaft"""

    observer: ModelComponent | None = None
    """a load observer, which takes signals of the motor"""
    observed: Mapping[str, str] = field(default_factory=dict)
    """by input of the observer, the output of the motor that it takes"""

    foreign: FmuComponent | None = None
    """the motor, if it is a foreign FMU; then `motor` is `Motor` itself, of which only the terminals are
    known, and there are no `parameters`"""

    @property
    def ratio(self) -> float:
        """Motor turns per crank turn."""
        return self.machine.ratio

    @cached_property
    def driven_machine(self) -> Machine:
        """The machine as its FMU has it: with the gear ratio that remains behind the driveline."""
        return self.machine if self.line is None else self.machine.replace(ratio=self.ratio / self.line.ratio)

    @cached_property
    def fmu_parameters(self) -> Any:
        """Parameters of the motor's FMU: those of the motor, with gear and flywheel added to the rotor."""
        p = self.parameters
        if not (self.flywheel or self.gear_inertia or self.gear_friction):
            return p
        J = p.rotor.J + self.gear_inertia + self.flywheel
        return replace(p, rotor=replace(p.rotor, J=J, d=p.rotor.d + self.gear_friction))

    @property
    def rotor_inertia(self) -> float:
        """Inertia that turns with the rotor, at the motor's shaft [kg m2]: of rotor, gear and flywheel, and
        of the driveline where there is one."""
        self.needs_own("the inertia of its rotor")
        line = 0.0 if self.line is None else self.line.J4 / self.line.ratio**2
        return float(self.fmu_parameters.rotor.J + line)

    def needs_own(self, quantity: str) -> None:
        """Refuse a `quantity`, named in words, that only a motor of this package has.

        Raises
        ------
        AbsentError
            where the motor is a foreign FMU.
        """
        if self.foreign is not None:
            raise AbsentError(
                "motor",
                f"{self.foreign.title}: {quantity} is not known, as the motor is an FMU of somebody else",
            )

    @property
    def chain_unit(self) -> ChainUnitMachine:
        """The machine, if it is a chain unit.

        Raises
        ------
        AbsentError
            where it is another machine.
        """
        if isinstance(self.machine, ChainUnitMachine):
            return self.machine
        raise AbsentError("machine", f"{self.machine.model.name}: has no organs")

    def series(self, run: xr.Dataset, name: str) -> Any:
        """A variable of a run, shape (time,).

        Raises
        ------
        AbsentError
            where motor or machine do not have the variable.
        """
        if name not in run:
            raise AbsentError(name.partition(".")[0], f"{name}: is not known of this motor or machine")
        return run[name].values

    def load_inertia(self, run: xr.Dataset) -> Any:
        """Inertia at the motor's shaft beside the rotor [kg m2], shape (time,); with a driveline, as if its
        ratio were even."""
        J = run["machine.J"].values / self.gear**2
        return J if self.line is None else (J + self.line.J4) / self.line.ratio**2

    def shaft_power(self, run: xr.Dataset) -> Any:
        """Power at the motor's shaft [W], shape (time,)."""
        full = f"{self._first_bond.machine}.power"
        if full in run:
            return run[full].values
        torque, speed = self.motor_shaft(run)
        return torque * speed

    def motor_shaft(self, run: xr.Dataset) -> tuple[Any, Any]:
        """Torque of the load [N m] and speed [rad/s] of the motor's shaft, shape (time,)."""
        return through(run, self._first_bond)

    @property
    def outsider(self) -> ForeignMachine | None:
        """The machine as the shaft behind the driveline drives it, if it is a foreign FMU; else None."""
        return self.driven_machine if isinstance(self.driven_machine, ForeignMachine) else None

    @property
    def outsiders(self) -> list[str]:
        """Titles of the foreign FMUs."""
        parts = self.outsider and self.outsider.component, self.foreign
        return [part.title for part in parts if part]

    @cached_property
    def simulated_machine(self) -> Machine:
        """The machine as its FMU has it, with the model of its runs."""
        return self.driven_machine.simulated

    def machine_series(self, run: xr.Dataset) -> dict[str, Any]:
        """The variables of the machine in a run by name, each of shape (time,)."""
        return {
            name.removeprefix("machine."): run[name].values
            for name in map(str, run.data_vars)
            if name.startswith("machine.")
        }

    @cached_property
    def graph(self) -> System:
        """The system of the models, each before the part that drives it. With feed-forward it also has the
        second machine, `model`, that the control uses; and it has the `observer`, if the drive has one."""
        outsider = self.outsider
        between: dict[str, Component] = {}
        if self.gear != 1.0 or (outsider and self.line is not None and not outsider.model.has_gear()):
            between["gear"] = ModelComponent(Gear, Gear.Parameters(ratio=self.gear))
        if self.line is not None:
            between["driveline"] = ModelComponent(CardanDriveline, self.line)
        system = in_line(
            {
                "machine": outsider.component if outsider else _component(self.simulated_machine),
                **between,
                "motor": self.foreign or ModelComponent(self.motor, self.fmu_parameters),
            }
        )
        beside: dict[str, Component] = {}
        wires: list[Connection] = []
        if self.feed_forward:
            # the second machine turns with the motor's shaft, before the driveline
            beside["model"] = _component(self.machine.simulated)
            wires += [("motor.phi", "model.phi"), ("motor.w", "model.w"), ("model.tau", "motor.tau_ff")]
        if self.observer is not None:
            beside["observer"] = self.observer
            wires += [(f"motor.{output}", f"observer.{name}") for name, output in self.observed.items()]
        return replace(system, components={**system.components, **beside}, wires=wires) if beside else system

    @property
    def gear(self) -> float:
        """Ratio of the gear that stands before the machine as a separate part; 1 where the machine includes
        its gear."""
        outsider = self.outsider
        return outsider.ratio if outsider and outsider.needs_gear else 1.0

    @property
    def _first_bond(self) -> Bond:
        return next(bond for bond in self.graph.bonds if bond.driver == "motor")

    @property
    def motor_speed(self) -> str:
        """Name of the speed of the motor's shaft in a run."""
        return f"motor.{self._first_bond.flanges[0].members['w']}"

    @property
    def motor_torque(self) -> str:
        """Name of the torque that the motor gives to its shaft in a run."""
        return f"motor.{self._first_bond.flanges[0].members.get('tau', 'tau')}"

    @property
    def _last_bond(self) -> Bond:
        return next(bond for bond in self.graph.bonds if bond.machine == "machine")

    def crank_torque(self, run: xr.Dataset) -> Any:
        """Torque at the crank in a run [N m], shape (time,), also for a machine without its motor."""
        return shaft_torque(run, self._last_bond) * (self.driven_machine.ratio / self.gear)

    @property
    def crank_speed(self) -> tuple[str, float]:
        """Name of the speed output that turns the machine in a run, and the ratio of that speed to the
        crank's."""
        return self._turned_by("w")

    @property
    def crank_angle(self) -> tuple[str, float]:
        """Name of the angle output that turns the machine in a run, and the ratio of that angle to the
        crank's."""
        return self._turned_by("phi")

    def _turned_by(self, quantity: str) -> tuple[str, float]:
        bond = self._last_bond
        return f"{bond.driver}.{bond.flanges[0].members[quantity]}", self.driven_machine.ratio / self.gear

    def crank_motion(self, run: xr.Dataset) -> tuple[Any, Any]:
        """Angle [rad] and speed [rad/s] of the crank in a run, shape (time,), also for a machine without its
        motor."""
        bond, ratio = self._last_bond, self.driven_machine.ratio / self.gear
        names = (f"{bond.driver}.{bond.flanges[0].members[x]}" for x in ("phi", "w"))
        pairs = (("machine.phi0", "machine.w0"), ("machine.phi", "machine.w"), tuple(names))
        phi, w = next(pair for pair in pairs if set(pair) <= set(run))
        return run[phi].values / ratio, run[w].values / ratio

    def turns(self, run: xr.Dataset) -> float:
        """Turns that the crank makes from the first to the last row of a run."""
        angle, _ = self.crank_motion(run)
        return float(angle[-1] - angle[0]) / (2.0 * math.pi)

    def whole_turns(self, run: xr.Dataset, most: float = math.inf) -> xr.Dataset | None:
        """The part of the run from its first row until the crank has made the largest number of whole turns,
        at most `most`, both ends included; None where it makes less than one turn.

        The last row is interpolated linearly; in periodic running it equals the first.
        """
        angle, _ = self.crank_motion(run)
        turns_made = (angle - angle[0]) / (2.0 * math.pi)
        # a run that ends on a whole turn may miss it by rounding
        rounding = 1e-9
        turns = min(math.floor(float(np.max(turns_made)) + rounding), most)
        if turns < 1:
            return None
        last = int(np.argmax(turns_made >= turns - rounding))
        share = min(1.0, (turns - turns_made[last - 1]) / (turns_made[last] - turns_made[last - 1]))

        def closed(x: Any) -> Any:
            return np.append(x[:last], x[last - 1] + share * (x[last] - x[last - 1]))

        return xr.Dataset(
            {name: ("time", closed(x.values), x.attrs) for name, x in run.data_vars.items()},
            {"time": ("time", closed(run["time"].values), run["time"].attrs)},
            run.attrs,
        )

    def export(
        self,
        folder: Path,
        backend: Backend | None = None,
        report: Callable[[str], None] = lambda what: None,
    ) -> tuple[dict[str, Path], dict[str, Origin]]:
        """Write the FMUs, with the start values of the drive. Returns the files by component, and the origin
        of each FMU. `report` is called with a text on the current task."""
        system, origins = export(self.graph, folder, backend, report)
        return {name: c.file for name, c in system.components.items() if c.file}, origins

    def export_machine(self, folder: Path, backend: Backend | None = None) -> Path:
        """Write only the machine's FMU, as `export` writes it."""
        machine = self.simulated_machine
        file = folder / f"{machine.model.name}.fmu"
        export_fmu(machine.model, file, machine.by_name, backend=backend)
        return file

    def system(self, files: Mapping[str, Path]) -> System:
        """The system of the FMU `files` of these models; their start values may be different ones."""
        # the machine in the feed-forward is the same FMU as the machine
        known = {"model": files["machine"], **files}
        components: dict[str, Component] = {
            name: replace(c, file=known[name]) for name, c in self.graph.components.items()
        }
        return replace(self.graph, components=components)

    def reference(self, crank_speed: float, ramp: float | None = None) -> dict[str, Any]:
        """The signal of the speed reference for this crank speed [rad/s], after a `ramp` from rest [s] if one
        is given."""
        if not self.follows:
            return {}
        w = crank_speed * self.ratio
        if ramp is None:
            return {"motor.w_ref": w} | ({"model.a": 0.0} if self.feed_forward else {})
        rise = Profile(0.0, ((0.0, ramp, w),))
        return {"motor.w_ref": rise} | ({"model.a": rise.rate} if self.feed_forward else {})

    def loads(self, feed: Any) -> dict[str, Any]:
        """Signals of the loads in normal running: of the machine, and of the machine in the feed-forward."""
        values = Layout(type(feed)).by_name(feed)
        model = {f"model.{name}": value for name, value in values.items()} if self.feed_forward else {}
        return {f"machine.{name}": value for name, value in values.items()} | model

    def largest_torque(self, run: xr.Dataset, T: float) -> Any:
        """Largest air-gap torque that the motor can give at each instant of a run [N m], shape (time,), with its
        winding at `T` [K]; see `Motor.largest_torque`."""
        self.needs_own("the largest torque")
        braking = run["motor.air_gap_tau"].values * run["motor.w"].values < 0.0
        columns = []
        for name, resolution in self.motor.limited_by.items():
            x = run[f"motor.{name}"].values
            if name == "w":
                x = np.where(braking, -np.abs(x), np.abs(x))
            unit = resolution * max(peak(x), 1e-9)
            columns.append(np.round(x / unit) * unit)
        instants, which = np.unique(np.stack(columns), axis=1, return_inverse=True)
        limits = [self.motor.largest_torque(self.fmu_parameters, T, *map(float, at)) for at in instants.T]
        return np.array(limits)[np.reshape(which, -1)]

    def pull_out(self, run: xr.Dataset, T: float) -> float:
        """Largest torque at the crank [N m] that the motor gives while a rising load slows it down from the
        mean state of a run until it stalls, with the winding at `T` [K]; see `Motor.pull_out`."""
        self.needs_own("the pull-out torque")
        return self.motor.pull_out(self.fmu_parameters, T, *self._mean_supply(run)) * self.ratio

    def breakdown_speed(self, run: xr.Dataset) -> float:
        """Speed of the crank [rad/s] below which a load stalls the motor, at the mean supply and temperature
        of a run; 0 where the motor has no such speed. See `Motor.breakdown_speed`."""
        self.needs_own("the breakdown speed")
        T = float(np.mean(run[f"motor.{self.motor.temperature}"].values))
        return self.motor.breakdown_speed(self.fmu_parameters, T, *self._mean_supply(run)) / self.ratio

    def _mean_supply(self, run: xr.Dataset) -> list[float]:
        """The means over a run of the variables `Motor.limited_by`."""
        return [float(np.mean(run[f"motor.{name}"].values)) for name in self.motor.limited_by]

    @property
    def coasting_model(self) -> type[DirectMachine]:
        """The model of the machine that turns without its motor."""
        return self.simulated_machine.model.direct()

    def coasting(self, folder: Path, backend: Backend | None = None) -> Path | None:
        """Write the FMU of the machine that turns without its motor, with the inertia on its shaft. None for
        a machine that is a foreign FMU, as there is no such model of it."""
        if self.outsider:
            return None
        file = folder / f"{self.coasting_model.name}.fmu"
        export_fmu(self.coasting_model, file, self.coasting_parameters(), backend=backend)
        return file

    def coasting_parameters(self) -> dict[str, float]:
        """Parameters of the `coasting_model` by name."""
        additions = {} if self.line is None else {"J_added": self.line.J4}
        return self.simulated_machine.by_name | additions
