"""The two models of a linkage: the inverse one takes the motion of the motor shaft and gives torque and load port,
the direct one takes the torque and gives the motion.

q is the crank angle, `w` and `a` are its derivatives. The shaft quantities `phi w a tau J` belong to the motor shaft,
which makes ``p.ratio`` turns for one turn of the crank.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from types import MappingProxyType
from typing import Any, Self

from ..core.descriptions import USUAL_DRIVER, of_driver
from ..core.engines import MATH
from ..core.model import UNSTATED, Model, Part, Sketch
from ..core.ports import PortSlopes, ShaftMotion
from ..core.quantities import (
    Fields,
    Layout,
    Quantity,
    Value,
    Variable,
    declaration,
    declared_class,
    fields_of,
    group,
    quantity,
)
from ..groups.joints import Joint
from .driver_ports import ROTATING, DriverPort, RotatingStates
from .end_stops import EndStops, StopAction, stop_action
from .linkage import Linkage, Topology
from .machine import MachineState, Mechanism, derived_numbers


def names_of(declared: type) -> tuple[str, ...]:
    """The names of the fields of a declaration."""
    return tuple(f.name for f in dataclasses.fields(declared))


@declaration
class CrankMotion(ShaftMotion):
    """Motion of the motor shaft that turns the crank."""

    phi: Value = quantity(
        "rad", "motor angle; crank angle is phi/ratio, from the upward vertical, clockwise", default=0.0
    )


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class LinkageModel(Model):
    """A model with the mechanics of a linkage."""

    linkage: Callable[[Any, Any, Any], Linkage] = UNSTATED
    """The linkage (xp, p, u) with these parameters and inputs, whose values the engine xp computes; places and
    lengths do not depend on the inputs."""

    def __post_init__(self) -> None:
        self.follow(derived_count=self.at_start.derived_count, derive=self._derived)
        super().__post_init__()

    def _derived(self, xp: Any, p: Any) -> list[Any]:
        """Values that the groups derive from the lengths."""
        return derived_numbers(xp, self.linkage(xp, p, self.Inputs()))

    def state(self, xp: Any, p: Any, u: Any, q: Any, w: Any) -> MachineState:
        """The machine at crank angle `q` [rad] and speed `w` [rad/s]."""
        derived = p.derived if self.derived_count else ()
        return MachineState(xp, Mechanism(xp, self.linkage(xp, p, u), q, derived, self.topology), w)

    @cached_property
    def at_start(self) -> Linkage:
        """The linkage with the start values."""
        return self.linkage(MATH, self.Parameters(), self.Inputs())

    @property
    def topology(self) -> Topology:
        """The names of the linkage."""
        return self.at_start.topology


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class MachineModel(Model):
    """The model of a machine as a study uses it: of a linkage, or of a foreign FMU.

    The work of a study on a machine depends only on the declarations here, never on the name of the machine.
    """

    Feed: Any = UNSTATED
    """Its loads in normal running: the inputs besides the motion of its shaft."""
    pins: Mapping[str, str] = UNSTATED
    """Output of each bearing by its title."""
    noun: str = "machine"
    """The machine's name in texts for people."""
    driver_noun: str = USUAL_DRIVER
    """The name, in texts for people, of the link that the motor turns."""
    angle_counts: str = "from the upward vertical, clockwise"
    """How the angle of that link counts, in texts for people."""
    usual_speed: tuple[float, float] = (0.05, 25.0)
    """Usual range of the crank speed [rad/s]; beyond it, a wrong unit is likely."""
    within: Mapping[str, str] = field(default_factory=dict)
    """By the name of a length, the name of the length that it usually does not exceed."""
    sides: tuple[str, ...] = ()
    """The names of its sides, each with a working organ that may be a chain. The groups of its loads and outputs on a
    side have the same name."""
    cuts: bool = False
    """Whether its outputs have a `blade`, and its parameters a `stack` that the blade cuts."""
    contacts: tuple[str, ...] = ()
    """The outputs with the forces of contacts, which lift off where these are below 0."""
    further: tuple[str, ...] = ()
    """Names with which the machine has all of its further parameters, those of its pins apart."""
    extend: Callable[[Any, frozenset[str]], Any] | None = None
    """The machine (machine, names) with further parameters, which it has only if a user names one of them."""
    root: Any = None
    """The machine without further parameters, if it has some; else None."""
    layers: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    """By link, its places across the parameter `width`, from -1 to 1; a link that is not named lies over all of it.
    Empty for a machine in a plane."""
    pin_names: Mapping[str, Joint] = field(default_factory=dict)
    """The joints of the pins that may differ, by the names that a file uses."""
    never_repeats: str = ""
    """The reason, in words, why no turn of its runs is like the one before; empty if steady turns are alike."""

    def __post_init__(self) -> None:
        self.follow(pins=MappingProxyType({}))
        super().__post_init__()

    @cached_property
    def feed_layout(self) -> Layout:
        """The layout of the feed."""
        return Layout(self.Feed)

    def having(self, names: Iterable[str]) -> Self:
        """The machine with those of its further parameters that are among `names`.

        Raises
        ------
        InputError
            for a parameter of a pin that the machine does not have, or one that requires another.
        """
        root, present = self.root or self, {*self.parameter_layout.names}
        further = {name for name in names if isinstance(name, str)} - present
        if self.extend is None or not further:
            return self
        machine: Self = self.extend(root, frozenset(further | (present - {*root.parameter_layout.names})))
        return machine


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class InverseMachine(LinkageModel, MachineModel):
    """Motion of the motor shaft in, torque, load port and every reaction out.

    A machine states its `Parameters`, `Inputs` (with those of `CrankMotion`), `Outputs` (with `tau`, `PortValues` and
    those of `running`), its `linkage` and its `probes`; all else follows. Without a statement of its own, its `Feed`
    has all inputs besides `ShaftMotion`, and its `pins` have the names of pin and link.
    """

    Outputs: Any
    probes: Callable[[Any, Any, Any, MachineState, Any], dict[str, Any]]
    """The machine's own outputs (xp, p, u, s, a) at the state s and the crank acceleration a. A key of `running` in
    this result replaces the value of `running`."""
    joints: Mapping[str, Joint] = field(default_factory=dict)
    """The joint of each reaction by the name of the output."""
    angles: Mapping[str, str] = field(default_factory=dict)
    """Links by the symbols of their angles; an angle counts from the downward vertical, positive towards +x."""
    direct_name: str = UNSTATED
    """Name of the direct model; by default ``<name>Direct``."""
    direct_description: str = ""
    by_differences: frozenset[str] = frozenset()
    """Outputs whose derivatives are taken by differences, see `chainunit.core.model.Part`."""
    span: tuple[float, float] = (0.0, 2.0 * math.pi)
    """Places of the driver from which to which it goes: a whole turn [rad], or its range [rad, m]."""
    driver_port: DriverPort = ROTATING
    """The declarations of its driver, which turns or slides."""
    turns: bool = True
    """Whether its driver turns all the way round; else it goes to and fro within `span`."""
    slides: bool = False
    """Whether its driver slides; else it turns."""
    end_stops: EndStops | None = None
    """The usual end stops of a driver with a range, at both ends of `span`."""

    def __post_init__(self) -> None:
        if self.Feed is UNSTATED:
            feed = declared_class("Feed", (), fields_of(self.Inputs, without=names_of(ShaftMotion)))
            # pickle finds the class by this name
            home = self.home or self.Parameters.__module__
            feed.__module__, feed.__qualname__ = home, f"{self.name}.Feed"
            self.follow(Feed=feed)
        apart = self.by_differences
        self.follow(
            input_rates=MappingProxyType({"phi": "w", "w": "a"}),
            terminals=self.driver_port.terminals,
            pins={f"{pin} {link}": output for output, (pin, link) in self.joints.items()},
            direct_name=f"{self.name}Direct",
            parts=(
                Part(self.Outputs, self._outputs, by_differences=apart & set(Layout(self.Outputs).names)),
                Part(self.driver_port.slopes, slopes, by_differences=apart & set(Layout(PortSlopes).names)),
            ),
            shared=self._at_shaft,
            sketch=self._sketched,
            further_quantities=self.usual_quantities,
        )
        super().__post_init__()

    def _at_shaft(self, xp: Any, p: Any, u: Any, x: Any) -> MachineState:
        """The machine at the crank angle and speed that follow from angle and speed of the motor."""
        return self.state(xp, p, u, u.phi / p.ratio, u.w / p.ratio)

    def _outputs(self, xp: Any, p: Any, u: Any, x: Any, s: MachineState) -> Any:
        """The outputs at the motor: torque, load port, energies, and the own ones of the machine."""
        a = u.a / p.ratio
        return self.Outputs(
            tau=s.torque(a) / p.ratio,
            tau_bias=s.bias / p.ratio,
            J=s.J / (p.ratio * p.ratio),
            dJ_dphi=s.inertia_slope / (p.ratio * p.ratio * p.ratio),
            phi0=u.phi,
            w0=u.w,
            **running(s, a) | self.probes(xp, p, u, s, a),
        )

    def _sketched(self, p: Any) -> Sketch:
        """The machine as lines; the driver is at 1/(2 pi) of its `span`."""
        from .sketch import sketch_of

        low, high = self.span
        return sketch_of(self.state(MATH, p, self.Inputs(), low + (high - low) / (2.0 * math.pi), 0.0).m)

    def usual_quantities(
        self, xp: Any, p: Any, u: Any, x: Any, outputs: Mapping[str, Any]
    ) -> list[tuple[Variable, Any]]:
        """The effort at the driver, ``crank_torque``; the size of each force, ``force(pivot)``; the places of all
        pins, ``x(A)`` and ``y(A)``; and the angle of each sliding block or cam, ``line(ram)``. A machine whose
        outputs depend on states has no places here."""
        from .sketch import directions

        unit = self.driver_port.unit("N.m")
        columns = [
            (Variable("crank_torque", "effort at the driver", Quantity(unit, "")), outputs["tau"] * p.ratio)
        ]
        for name in outputs:
            pin, _, axis = name.rpartition(".")
            if axis == "fx" and f"{pin}.fy" in outputs:
                size = xp.sqrt(outputs[name] * outputs[name] + outputs[f"{pin}.fy"] * outputs[f"{pin}.fy"])
                columns.append(
                    (Variable(f"force({pin})", f"size of the force {pin}", Quantity("N", "")), size)
                )
        if self.States is None:
            m = self.shared(xp, p, u, x).m
            for pin, motion in m.pins.items():
                for axis in "xy":
                    place = Variable(f"{axis}({pin})", f"place {axis} of the pin {pin}", Quantity("m", ""))
                    columns.append((place, getattr(motion.p, axis)))
            for pin, d in directions(m).items():
                line = Variable(f"line({pin})", f"angle of the line of the block {pin}", Quantity("rad", ""))
                columns.append((line, xp.atan2(d.y, d.x)))
        return columns

    @cache  # noqa: B019 - models live as long as the program
    def direct(self) -> DirectMachine:
        """The direct model of the same machine: torque in, motion out.

        It has the parameters of the machine, the inertia on its shaft and the start. Its inputs are the torque and
        the loads. It has the outputs of the machine without `tau` and load port, and those of `DriverPort.answer`.
        """
        stops = self.end_stops
        if stops is None:
            return self._direct_of(DirectMachine)
        more = ("end_stops", type(stops), group(type(stops), "end stops of the driver", default=stops))
        return self._direct_of(DirectMachine, [more])

    def _direct_of(self, base: type[DirectMachine], parameters: Fields = (), **more: Any) -> DirectMachine:
        """The direct model of the kind `base`, with further fields of its `parameters`, and `more` attributes."""
        port, stated = self.driver_port, fields_of(self.Parameters)
        # of two bases with one name the first wins, so that the fields of the machine are declared once more
        starts = [field for field in stated if field[0] in names_of(port.start)]
        inputs = fields_of(self.Inputs, without=names_of(ShaftMotion))
        outputs = fields_of(self.Outputs, without=("tau", *names_of(port.values)))
        states = _of_driver(port.states, self.driver_noun)
        return base(
            name=self.direct_name,
            text=f"The direct model of {self.name}: {port.words[0]} in, motion out.",
            description=self.direct_description or words_on_motion(f"{self.name} that moves by itself", port),
            made=(direct_model, (self,)),
            inverse=self,
            fmu_data=self.fmu_data,
            repeated=self.repeated,
            constant=self.constant,
            terminals=port.flanges,
            Parameters=declared_class(
                "DirectParameters", (port.start, port.added, self.Parameters), [*starts, *parameters]
            ),
            States=declared_class("States", (states,), fields_of(self.States)) if self.States else states,
            Inputs=declared_class("DirectInputs", (port.effort,), inputs),
            Outputs=declared_class("DirectOutputs", (), [*outputs, *fields_of(port.answer)]),
            **more,
        )


def words_on_motion(subject: str, port: DriverPort) -> str:
    """The description of a direct model: the `subject`, and the way from effort to motion."""
    effort, place = port.words
    return f"{subject}: from {effort} to {place}, speed, acceleration and every reaction"


def _of_driver(declared: type, noun: str) -> type:
    """The declaration with the `noun` of the driver in the slots of its descriptions; the same class without slots,
    or with the usual noun."""
    if noun == USUAL_DRIVER or not any("{driver}" in v.template for v in Layout(declared).variables):
        return declared
    fields: list[tuple[str, Any, Any]] = []
    for name, kind, slot in fields_of(declared):
        q = slot.metadata["quantity"]
        described = dataclasses.replace(q, template=of_driver(q.template, noun))
        fields.append((name, kind, dataclasses.field(default=slot.default, metadata={"quantity": described})))
    driver_type: type = declared_class(declared.__name__, (), fields)
    driver_type.__doc__, driver_type.__module__ = declared.__doc__, __name__
    return driver_type


def running(s: MachineState, a: Any) -> dict[str, Any]:
    """Outputs of every machine: power and energies at crank acceleration `a`, and the margin."""
    return {
        "power": s.torque(a) * s.w,
        "kinetic_energy": s.kinetic_energy,
        "potential_energy": s.potential_energy,
        "dissipated_power": s.lost_power,
        "margin": s.margin(),
    }


def slopes(xp: Any, p: Any, u: Any, x: Any, s: MachineState) -> PortSlopes:
    """The slopes of the port at the motor."""
    by_angle, by_speed = s.slopes()
    per_turn = 1.0 / (p.ratio * p.ratio)
    return PortSlopes(tau_bias_dphi=by_angle * per_turn, tau_bias_dw=by_speed * per_turn)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class DirectMachine(LinkageModel):
    """Torque of the motor in, motion and every reaction out, see `InverseMachine.direct`. `inverse` is the inverse
    model of the same machine."""

    inverse: InverseMachine
    Outputs: Any

    def __post_init__(self) -> None:
        inverse = self.inverse
        self.follow(
            linkage=inverse.linkage,
            required=(*inverse.required, inverse.driver_port.inertia),
            requirements=self._limits,
            parts=(Part(self.Outputs, self._outputs),),
            sketch=inverse.sketch,
            initial_states=lambda xp, p: RotatingStates(phi=p.phi_start, w=p.w_start),
            controlled=True,
            # 5 ms, so that no step skips the start of a cut or the contact with a stop
            internal_step=lambda xp, p: 5e-3,
            # tight: the motion is slow, but smoothed friction near rest and a blade that a stack stops act within
            # microseconds; and a free motion does not reduce its errors, so that local errors must be small
            tolerance=lambda xp, p: 1e-9,
            constrained_states=lambda xp, p, u, x: [x.phi, x.w],
            shared=self._at_shaft,
            derivatives=self._rates,
        )
        super().__post_init__()

    def _limits(self, xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
        """The limits of the inverse model, and those of an inertia that never vanishes."""
        yield from self.inverse.requirements(xp, p)
        yield p.J_added * p.ratio * p.ratio + self.linkage(xp, p, self.Inputs()).driver.inertia, 0.0, math.inf

    def state(self, xp: Any, p: Any, u: Any, q: Any, w: Any) -> MachineState:
        """See `LinkageModel`; the state of the inverse model."""
        return self.inverse.state(xp, p, u, q, w)

    def start_from(self, outputs: Mapping[str, float]) -> dict[str, float]:
        """Start parameters with which the direct model continues a motion of the inverse model; `outputs` gives the
        outputs and states of the inverse model at that instant by name."""
        return {"phi_start": outputs["phi0"], "w_start": outputs["w0"]}

    def _at_shaft(self, xp: Any, p: Any, u: Any, x: Any) -> MachineState:
        """The machine at the crank angle and speed that follow from angle and speed of the motor."""
        return self.state(xp, p, u, x.phi / p.ratio, x.w / p.ratio)

    def _rates(self, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """Time derivatives of the states, in declared order."""
        stops = self._stops(xp, p, x)
        return [x.w, acceleration(p, u, self.shared(xp, p, u, x), stops.force if stops else 0.0)]

    def _stops(self, xp: Any, p: Any, x: Any) -> StopAction | None:
        """The action of the end stops on a driver with a range; None for one that turns round."""
        if self.inverse.end_stops is None:
            return None
        return stop_action(xp, p.end_stops, self.inverse.span, x.phi / p.ratio, x.w / p.ratio)

    def _outputs(self, xp: Any, p: Any, u: Any, x: Any, s: MachineState) -> Any:
        """The outputs at the motor: the acceleration, energies with the added inertia and the end stops, and the own
        ones of the machine."""
        stops = self._stops(xp, p, x)
        a = acceleration(p, u, s, stops.force if stops else 0.0)
        at_crank = a / p.ratio
        fields = running(s, at_crank) | self.inverse.probes(xp, p, u, s, at_crank)
        # the motor also drives the inertia on its own shaft
        fields["kinetic_energy"] += 0.5 * p.J_added * (x.w * x.w)
        fields["power"] = u.tau * x.w
        if stops is not None:
            fields[self.inverse.driver_port.stop] = stops.force
            fields["potential_energy"] += stops.energy
            fields["dissipated_power"] += stops.lost * s.w
        return self.Outputs(a=a, tau_bias=s.bias / p.ratio, J=s.J / (p.ratio * p.ratio), **fields)


def acceleration(p: Any, u: Any, s: MachineState, stop: Any = 0.0) -> Any:
    """Motor acceleration [rad/s2]: (J_added + J) a = tau - tau_bias - stop/ratio at the motor shaft, with the force
    `stop` of the end stops at the driver [N], or their torque [N m]."""
    return (u.tau - (s.bias + stop) / p.ratio) / (p.J_added + s.J / (p.ratio * p.ratio))


def direct_model(machine: InverseMachine) -> DirectMachine:
    """The direct model of a machine."""
    return machine.direct()
