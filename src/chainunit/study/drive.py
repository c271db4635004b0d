"""The co-simulated system of a study: a motor and the machine that it drives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

from ..core.brief import briefly_shown
from ..core.errors import InputError
from ..core.quantities import Layout
from ..drives.gear import Gear
from ..drives.gear_rating import GearRating
from ..drives.motor import Motor
from ..drives.speed_control import Tuning
from ..machines.api import ChainUnitMachine
from ..machines.machine import Machine
from ..system import Bond, Component, FmuComponent, ModelComponent, Profile, System, in_line, torque_names
from ..system.graph import Connection
from .foreign_machine import ForeignMachine
from .line.flywheel import ON_MOTOR, FlywheelShaft
from .line.placed import Line, PlacedPart
from .star_start import NO_STAR, StarStart


class AbsentError(InputError):
    """A quantity that this motor or machine does not have; `part` is the name of motor or machine in the system."""

    def __init__(self, part: str, text: str) -> None:
        super().__init__(text)
        self.part = part


def _component(machine: Machine) -> ModelComponent:
    return ModelComponent(machine.model, machine.p)


@dataclass(frozen=True)
class TurningGear:
    """The gear of a drive: inertia `J` [kg m2], drag `d` [N m s/rad] and `Transmission.loss`, at its shaft on the
    motor's side."""

    J: float = 0.0
    d: float = 0.0
    loss: float = 0.0
    rating: GearRating | None = None
    """its ratings; none of the overhung load where its shaft carries no reaction of the driver"""


NO_LOSS = TurningGear()


@briefly_shown
@dataclass(frozen=True)
class Drive:
    """A `motor` with its `parameters` that turns a `machine`; `follows` says whether it follows the reference
    `w_ref`."""

    motor: Motor
    parameters: Any
    machine: Machine
    follows: bool = True
    rated_current: float | None = None
    """rated current [A], where a nameplate gives it"""
    feed_forward: bool = False
    """whether the speed control has feed-forward: a second machine FMU computes the torque of the machine
    with its normal feed, at the motor's angle and speed and the requested acceleration"""

    tuning: Tuning | None = None
    """the tuning of the gains of its control, where they were tuned"""

    line: Line = field(default_factory=Line)
    """its parts that have a table, without the flywheel and the gear; see `geared_line`"""

    added_inertia: float = 0.0
    """inertia of the flywheel at its own shaft [kg m2]"""
    flywheel_shaft: FlywheelShaft = ON_MOTOR

    transmission: str = "gear"
    """its parts in a noun: "gear", "belt", "belt and gear", or "coupling" of a machine that turns with the motor"""

    gear: TurningGear = NO_LOSS
    observer: ModelComponent | None = None
    """a load observer, which takes signals of the motor"""
    observed: Mapping[str, str] = field(default_factory=dict)
    """by input of the observer, the output of the motor that it takes"""

    star: StarStart = NO_STAR
    """its time in star in a start from rest"""

    droop_speed: float = 0.0
    """speed by which a motor with a droop falls at the mean torque [rad/s]: its reference stands as much higher"""

    foreign: FmuComponent | None = None
    """the motor, if it is a foreign FMU; then `motor` is `Motor` itself, of which only the terminals are
    known, and there are no `parameters`"""

    @property
    def is_geared(self) -> bool:
        """Whether a gear is between motor and machine."""
        return "gear" in self.transmission

    @property
    def ratio_noun(self) -> str:
        """The parts that have the ratio, in a noun."""
        if self.line.part("belt") is None:
            return "gear"
        return "belt and gear" if self.is_geared else "belt"

    @property
    def ratio(self) -> float:
        """Motor turns per crank turn."""
        return self.machine.ratio

    @cached_property
    def driven_machine(self) -> Machine:
        """The machine as its FMU has it: with the gear ratio that remains behind the line."""
        if not self.geared_line:
            return self.machine
        return self.machine.replace(ratio=self.ratio / self.geared_line.ratio)

    @cached_property
    def geared_line(self) -> Line:
        """The line with the flywheel, if it is on another shaft than the motor's, and with the gear on the driven
        shaft of the last part that slips."""
        line = self.flywheel_shaft.mounted(self.line, self.ratio, self.added_inertia)
        return line.with_gear(self.gear.J, self.gear.d, self.gear.loss)

    @property
    def inertia_on_rotor(self) -> float:
        """Inertia of the flywheel if it is on the motor's shaft [kg m2], else 0."""
        return self.added_inertia if self.flywheel_shaft.is_motor else 0.0

    @property
    def flywheel_ratio(self) -> float:
        """Turns of the motor per turn of the flywheel."""
        return self.flywheel_shaft.ratio(self.line, self.ratio)

    @cached_property
    def fmu_parameters(self) -> Any:
        """Parameters of the motor's FMU: those of the motor, whose rotor has also the flywheel on its shaft and a
        gear that turns with it, with the loss of that gear."""
        p, gear = self.parameters, self.gear_at_rotor
        if self.inertia_on_rotor or gear.J or gear.d:
            J = p.rotor.J + gear.J + self.inertia_on_rotor
            p = replace(p, rotor=replace(p.rotor, J=J, d=p.rotor.d + gear.d))
        # a gear behind a part that slips has its loss in the line, and none here
        if gear.loss or self.line.before_gear is not None:
            p = replace(p, gear=replace(p.gear, loss=gear.loss))
        return p

    @property
    def gear_at_rotor(self) -> TurningGear:
        """The gear if it turns with the rotor; nothing behind a part that slips, see `geared_line`."""
        return self.gear if self.line.before_gear is None else NO_LOSS

    @property
    def loss_behind_port(self) -> float:
        """`Transmission.loss` of the gear between `motor_torque` and the crank: 0 if the gear is at the rotor."""
        return self.gear.loss - self.gear_at_rotor.loss

    def at_crank(self, torque: Any) -> Any:
        """The torque at the crank [N m] that a `motor_torque` [N m] gives while the motor drives: the line takes its
        drag from it, and a gear behind a part that slips its loss. The loss of a gear at the rotor is not in
        `motor_torque`."""
        return (torque - self.line.drag) * self.ratio / (1.0 + self.loss_behind_port)

    def at_port(self, torque: Any) -> Any:
        """The `motor_torque` [N m] that gives a `torque` at the crank [N m], see `at_crank`."""
        return torque * (1.0 + self.loss_behind_port) / self.ratio + self.line.drag

    def at_motor_shaft(self, torque: Any) -> Any:
        """The torque on the motor's shaft before every gear [N m] that gives a `torque` at the crank [N m]."""
        return self.at_port(torque) * (1.0 + self.gear_at_rotor.loss)

    @property
    def rotor_inertia(self) -> float:
        """Inertia that turns with the rotor, at the motor's shaft [kg m2]: of rotor, gear, flywheel, and of the parts
        of the line."""
        self.needs_own("the inertia of its rotor")
        return float(self.fmu_parameters.rotor.J + self.geared_line.at_motor(0.0))

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

    @property
    def foreign_machine(self) -> ForeignMachine | None:
        """The machine as the shaft behind the driveline drives it, if it is a foreign FMU; else None."""
        return self.driven_machine if isinstance(self.driven_machine, ForeignMachine) else None

    @property
    def driver_noun(self) -> str:
        """The noun for the part of the machine that the motor turns: "crank", or another word for a machine
        without one."""
        return self.machine.model.driver_noun

    @property
    def foreign_titles(self) -> list[str]:
        """Titles of the foreign FMUs."""
        parts = self.foreign_machine and self.foreign_machine.component, self.foreign
        return [part.title for part in parts if part]

    @cached_property
    def simulated_machine(self) -> Machine:
        """The machine as its FMU has it, with the model of its runs."""
        return self.driven_machine.simulated

    @cached_property
    def graph(self) -> System:
        """The system of the models, each before the part that drives it. With feed-forward it also has the
        second machine, `model`, that the control uses; and it has the `observer`, if the drive has one."""
        machine = self.foreign_machine
        system = in_line(
            {
                "machine": machine.component if machine else _component(self.simulated_machine),
                **{part.name: part.component for part in reversed(self.whole_line.parts)},
                "motor": self.foreign or ModelComponent(self.motor, self.fmu_parameters),
            }
        )
        beside: dict[str, Component] = {}
        wires: list[Connection] = []
        if self.feed_forward:
            # the second machine turns with the motor's shaft, before the line
            beside["model"] = _component(self.machine.simulated)
            wires += [("motor.phi", "model.phi"), ("motor.w", "model.w"), ("model.tau", "motor.tau_ff")]
        if self.observer is not None:
            beside["observer"] = self.observer
            wires += [(f"motor.{output}", f"observer.{name}") for name, output in self.observed.items()]
        return replace(system, components={**system.components, **beside}, wires=wires) if beside else system

    @cached_property
    def whole_line(self) -> Line:
        """The line with the flywheel, and the gear before a foreign machine that has none. Behind other parts its
        ratio may be 1: the twin with a rigid shaft puts that of the driveline there."""
        machine, line = self.foreign_machine, self.geared_line
        if machine is None or machine.model.has_gear() or not (self.line or machine.needs_gear):
            return line
        return line.behind(PlacedPart("gear", Gear, Gear.Parameters(ratio=machine.ratio), machine.ratio))

    @cached_property
    def motor_bond(self) -> Bond:
        """The shaft of the motor."""
        return next(bond for bond in self.graph.bonds if bond.driver == "motor")

    @property
    def motor_speed(self) -> str:
        """Name of the speed of the motor's shaft in a run."""
        return f"motor.{self.motor_bond.flanges[0].members['w']}"

    @property
    def motor_torque(self) -> str:
        """Name of the torque that the motor gives to its shaft in a run."""
        # an FMU may leave it out: then it is the torque that the next part takes
        *_, name = torque_names(self.motor_bond)
        return name

    @cached_property
    def machine_bond(self) -> Bond:
        """The shaft that drives the machine."""
        return next(bond for bond in self.graph.bonds if bond.machine == "machine")

    @property
    def ratio_at_machine(self) -> float:
        """Turns of the shaft that drives the machine's component per turn of the crank."""
        return self.driven_machine.ratio if self.whole_line is self.geared_line else 1.0

    def crank_output(self, quantity: Literal["phi", "w"]) -> tuple[str, float]:
        """Name of the angle ("phi") or speed ("w") that turns the machine in a run, and its ratio to that of the
        crank."""
        bond = self.machine_bond
        return f"{bond.driver}.{bond.flanges[0].members[quantity]}", self.ratio_at_machine

    def reference_speed(self, crank_speed: float) -> float:
        """The speed reference of the motor for this mean crank speed [rad/s]."""
        return crank_speed * self.ratio + self.droop_speed

    def reference(self, crank_speed: float, ramp: float | None = None) -> dict[str, Any]:
        """The signal of the speed reference for this crank speed [rad/s], after a `ramp` from rest [s] if one
        is given."""
        if not self.follows:
            return {}
        w = self.reference_speed(crank_speed)
        if ramp is None:
            return {"motor.w_ref": w} | ({"model.a": 0.0} if self.feed_forward else {})
        rise = Profile(0.0, ((0.0, ramp, w),))
        return {"motor.w_ref": rise} | ({"model.a": rise.rate} if self.feed_forward else {})

    def loads(self, feed: Any) -> dict[str, Any]:
        """Signals of the loads in normal running: of the machine, and of the machine in the feed-forward."""
        values = Layout(type(feed)).by_name(feed)
        model = {f"model.{name}": value for name, value in values.items()} if self.feed_forward else {}
        return {f"machine.{name}": value for name, value in values.items()} | model
