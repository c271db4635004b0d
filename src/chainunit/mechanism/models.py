"""The two models of a linkage: the inverse one takes the motion of the motor shaft and gives torque and load port,
the direct one takes the torque and gives the motion.

q is the crank angle, `w` and `a` are its derivatives. The shaft quantities `phi w a tau J` belong to the motor shaft,
which makes ``p.ratio`` turns for one turn of the crank.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from functools import cache
from types import MappingProxyType
from typing import Any, ClassVar

from ..core.descriptions import USUAL_DRIVER, of_driver
from ..core.engines import MATH
from ..core.model import Making, Model, Part, Sketch, keep
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


class LinkageModel(Model):
    """A model with the mechanics of a linkage."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if hasattr(cls, "Parameters"):
            cls.derived_count = cls.linkage(MATH, cls.Parameters(), cls.Inputs()).derived_count

    @staticmethod
    def linkage(xp: Any, p: Any, u: Any) -> Linkage:
        """The linkage with these parameters and inputs, whose values the engine `xp` computes; places and
        lengths do not depend on the inputs."""
        raise NotImplementedError

    @classmethod
    def derive(cls, xp: Any, p: Any) -> list[Any]:
        """Values that the groups derive from the lengths."""
        return derived_numbers(xp, cls.linkage(xp, p, cls.Inputs()))

    @classmethod
    def state(cls, xp: Any, p: Any, u: Any, q: Any, w: Any) -> MachineState:
        """The machine at crank angle `q` [rad] and speed `w` [rad/s]."""
        derived = p.derived if cls.derived_count else ()
        return MachineState(xp, Mechanism(xp, cls.linkage(xp, p, u), q, derived, cls.topology()), w)

    @classmethod
    @cache
    def topology(cls) -> Topology:
        """The names of the linkage."""
        return cls.linkage(MATH, cls.Parameters(), cls.Inputs()).topology


class MachineModel(Model):
    """The model of a machine as a study uses it: of a linkage, or of a foreign FMU.

    The work of a study on a machine depends only on the declarations here, never on the name of the machine.
    """

    Feed: ClassVar[type]
    """Its loads in normal running: the inputs besides the motion of its shaft."""
    feed_layout: ClassVar[Layout]
    pins: ClassVar[Mapping[str, str]] = {}
    """Output of each bearing by its title."""
    noun: ClassVar[str] = "machine"
    """The machine's name in texts for people."""
    driver_noun: ClassVar[str] = USUAL_DRIVER
    """The name, in texts for people, of the link that the motor turns."""
    angle_counts: ClassVar[str] = "from the upward vertical, clockwise"
    """How the angle of that link counts, in texts for people."""
    usual_speed: ClassVar[tuple[float, float]] = (0.05, 25.0)
    """Usual range of the crank speed [rad/s]; beyond it, a wrong unit is likely."""
    within: ClassVar[Mapping[str, str]] = {}
    """By the name of a length, the name of the length that it usually does not exceed."""
    sides: ClassVar[tuple[str, ...]] = ()
    """The names of its sides, each with a working organ that may be a chain. The groups of its loads and outputs on a
    side have the same name."""
    cuts: ClassVar[bool] = False
    """Whether its outputs have a `blade`, and its parameters a `stack` that the blade cuts."""
    never_repeats: ClassVar[str] = ""
    """The reason, in words, why no turn of its runs is like the one before; empty where steady turns are alike."""


class InverseMachine(LinkageModel, MachineModel):
    """Motion of the motor shaft in, torque, load port and every reaction out.

    A machine states its `Parameters`, `Inputs` (with those of `CrankMotion`), `Outputs` (with `tau`, `PortValues` and
    those of `running`), its `linkage` and its `probes`; all else follows. Without a statement of its own, its `Feed`
    has all inputs besides `ShaftMotion`, and its `pins` have the names of pin and link.
    """

    Outputs: ClassVar[type]
    joints: ClassVar[Mapping[str, Joint]] = {}
    """The joint of each reaction by the name of the output."""
    angles: ClassVar[Mapping[str, str]] = {}
    """Links by the symbols of their angles; an angle counts from the downward vertical, positive towards +x."""
    direct_name: ClassVar[str]
    """Name of the direct model; by default ``<name>Direct``."""
    direct_description: ClassVar[str] = ""
    by_differences: ClassVar[frozenset[str]] = frozenset()
    """Outputs whose derivatives are taken by differences, see `chainunit.core.model.Part`."""
    input_rates = MappingProxyType({"phi": "w", "w": "a"})

    span: ClassVar[tuple[float, float]] = (0.0, 2.0 * math.pi)
    """Places of the driver from which to which it goes: a whole turn [rad], or its range [rad, m]."""
    driver_port: ClassVar[DriverPort] = ROTATING
    """The declarations of its driver, which turns or slides."""
    turns: ClassVar[bool] = True
    """Whether its driver turns all the way round; else it goes to and fro within `span`."""
    slides: ClassVar[bool] = False
    """Whether its driver slides; else it turns."""
    end_stops: ClassVar[EndStops | None] = None
    """The usual end stops of a driver with a range, at both ends of `span`."""

    def __init_subclass__(cls) -> None:
        own = vars(cls)
        if "Inputs" in own and "Feed" not in own:
            cls.Feed = declared_class("Feed", (), fields_of(cls.Inputs, without=names_of(ShaftMotion)))
            # pickle finds the class by this name
            cls.Feed.__module__, cls.Feed.__qualname__ = cls.__module__, f"{cls.__qualname__}.Feed"
        if "terminals" not in own:
            cls.terminals = cls.driver_port.terminals
        if hasattr(cls, "Feed"):
            cls.feed_layout = Layout(cls.Feed)
        if "joints" in own and "pins" not in own:
            cls.pins = {f"{pin} {link}": output for output, (pin, link) in cls.joints.items()}
        if "name" in own and "direct_name" not in own:
            cls.direct_name = f"{cls.name}Direct"
        if hasattr(cls, "Outputs") and "parts" not in own:
            apart = cls.by_differences
            cls.parts = (
                Part(cls.Outputs, cls._outputs, by_differences=apart & set(Layout(cls.Outputs).names)),
                Part(cls.driver_port.slopes, slopes, by_differences=apart & set(Layout(PortSlopes).names)),
            )
        super().__init_subclass__()

    @staticmethod
    def probes(xp: Any, p: Any, u: Any, s: MachineState, a: Any) -> dict[str, Any]:
        """The machine's own outputs at the state `s` and the crank acceleration `a`. A key of `running` in this
        result replaces the value of `running`."""
        raise NotImplementedError

    @classmethod
    def shared(cls, xp: Any, p: Any, u: Any, x: Any) -> MachineState:
        """The machine at the crank angle and speed that follow from angle and speed of the motor."""
        return cls.state(xp, p, u, u.phi / p.ratio, u.w / p.ratio)

    @classmethod
    def _outputs(cls, xp: Any, p: Any, u: Any, x: Any, s: MachineState) -> Any:
        a = u.a / p.ratio
        return cls.Outputs(
            tau=s.torque(a) / p.ratio,
            tau_bias=s.bias / p.ratio,
            J=s.J / (p.ratio * p.ratio),
            dJ_dphi=s.inertia_slope / (p.ratio * p.ratio * p.ratio),
            phi0=u.phi,
            w0=u.w,
            **running(s, a) | cls.probes(xp, p, u, s, a),
        )

    @classmethod
    def sketch(cls, start: Mapping[str, float] | None = None) -> Sketch:
        """See `chainunit.core.model.Model.sketch`; the driver is at a sixth of its `span`."""
        from .sketch import sketch_of  # here, as FMUs do without it

        low, high = cls.span
        layout, given = cls.parameter_layout, start or {}
        p = cls.check(layout.instance([given.get(v.name, v.quantity.start) for v in layout.variables]))
        return sketch_of(cls.state(MATH, p, cls.Inputs(), low + (high - low) / (2.0 * math.pi), 0.0).m)

    @classmethod
    def further_quantities(
        cls, xp: Any, p: Any, u: Any, x: Any, outputs: Mapping[str, Any]
    ) -> list[tuple[Variable, Any]]:
        """The effort at the driver, ``crank_torque``; the size of each force, ``force(pivot)``; the places of all
        pins, ``x(A)`` and ``y(A)``; and the angle of the line of each sliding block, ``line(ram)``. A machine whose
        outputs depend on states has no places here."""
        unit = cls.driver_port.unit("N.m")
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
        if cls.States is None:
            m = cls.shared(xp, p, u, x).m
            for pin, motion in m.pins.items():
                for axis in "xy":
                    place = Variable(f"{axis}({pin})", f"place {axis} of the pin {pin}", Quantity("m", ""))
                    columns.append((place, getattr(motion.p, axis)))
            for (pin, _), slide in m.slides.items():
                line = Variable(f"line({pin})", f"angle of the line of the block {pin}", Quantity("rad", ""))
                columns.append((line, xp.atan2(slide.d.y, slide.d.x)))
        return columns

    @classmethod
    @cache
    def direct(cls) -> type[DirectMachine]:
        """The direct model of the same machine: torque in, motion out.

        It has the parameters of the machine, the inertia on its shaft and the start. Its inputs are the torque and
        the loads. It has the outputs of the machine without `tau` and load port, and those of `DriverPort.answer`.
        """
        stops = cls.end_stops
        if stops is None:
            return cls._direct_of(DirectMachine)
        more = ("end_stops", type(stops), group(type(stops), "end stops of the driver", default=stops))
        return cls._direct_of(DirectMachine, [more])

    @classmethod
    def _direct_of(
        cls, base: type[DirectMachine], parameters: Fields = (), **more: Any
    ) -> type[DirectMachine]:
        """The direct model as a subclass of `base`, with more `parameters` and attributes."""
        outputs = fields_of(cls.Outputs, without=("tau", *names_of(cls.driver_port.values)))
        # where the start declares the same name, the machine's own declaration counts
        own = [field for field in fields_of(cls.Parameters) if field[0] in names_of(cls.driver_port.start)]
        port = cls.driver_port
        states = _of_driver(port.states, cls.driver_noun)
        members = {
            "__module__": cls.__module__,
            "__doc__": f"The direct model of {cls.__name__}: {port.words.effort} in, motion out.",
            "name": cls.direct_name,
            "description": cls.direct_description
            or words_on_motion(f"{cls.name} that moves by itself", port),
            "made": Making(direct_model, (cls,)),
            "inverse": cls,
            "fmu_data": cls.fmu_data,
            "repeated": cls.repeated,
            "constant": cls.constant,
            "terminals": port.flanges,
            "Parameters": declared_class(
                "DirectParameters", (port.start, port.added, cls.Parameters), [*own, *parameters]
            ),
            "States": declared_class("States", (states,), fields_of(cls.States)) if cls.States else states,
            "Inputs": declared_class(
                "DirectInputs", (port.effort,), fields_of(cls.Inputs, without=names_of(ShaftMotion))
            ),
            "Outputs": declared_class("DirectOutputs", (), [*outputs, *fields_of(port.answer)]),
            **more,
        }
        model = type(f"Direct{cls.__name__}", (base,), members)
        if cls.made:
            keep(model, "Parameters", "Inputs", *(["States"] if states is not port.states else []))
        return model


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
    for name, of, field in fields_of(declared):
        q = field.metadata["quantity"]
        own = dataclasses.replace(q, template=of_driver(q.template, noun))
        fields.append((name, of, dataclasses.field(default=field.default, metadata={"quantity": own})))
    made: type = declared_class(declared.__name__, (), fields)
    made.__doc__, made.__module__ = declared.__doc__, __name__
    return made


def running(s: MachineState, a: Any) -> dict[str, Any]:
    """Outputs of every machine: power and energies at crank acceleration `a`, and the margin."""
    return {
        "power": s.torque(a) * s.w,
        "kinetic_energy": s.kinetic_energy,
        "potential_energy": s.potential_energy,
        "dissipated_power": s.lost_torque * s.w,
        "margin": s.margin(),
    }


def slopes(xp: Any, p: Any, u: Any, x: Any, s: MachineState) -> PortSlopes:
    """The slopes of the port at the motor."""
    by_angle, by_speed = s.slopes()
    per_turn = 1.0 / (p.ratio * p.ratio)
    return PortSlopes(tau_bias_dphi=by_angle * per_turn, tau_bias_dw=by_speed * per_turn)


class DirectMachine(LinkageModel):
    """Torque of the motor in, motion and every reaction out, see `InverseMachine.direct`. `inverse` is the inverse
    model of the same machine."""

    inverse: ClassVar[type[InverseMachine]]
    Outputs: ClassVar[type]
    States = RotatingStates

    def __init_subclass__(cls) -> None:
        if not hasattr(cls, "inverse"):  # a common base of several models
            return
        cls.required = (*cls.inverse.required, cls.inverse.driver_port.inertia)
        cls.parts = (Part(cls.Outputs, cls._outputs),)
        super().__init_subclass__()

    @classmethod
    def sketch(cls, start: Mapping[str, float] | None = None) -> Sketch:
        """That of the inverse model."""
        return cls.inverse.sketch(start)

    @classmethod
    def linkage(cls, xp: Any, p: Any, u: Any) -> Linkage:
        """The linkage of the inverse model."""
        return cls.inverse.linkage(xp, p, u)

    @classmethod
    def requirements(cls, xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
        """The limits of the inverse model, and those of an inertia that never vanishes."""
        yield from cls.inverse.requirements(xp, p)
        yield p.J_added * p.ratio * p.ratio + cls.linkage(xp, p, cls.Inputs()).driver.inertia, 0.0, math.inf

    @classmethod
    def start_from(cls, outputs: Mapping[str, float]) -> dict[str, float]:
        """Start parameters with which the direct model continues a motion of the inverse model; `outputs` gives the
        outputs and states of the inverse model at that instant by name."""
        return {"phi_start": outputs["phi0"], "w_start": outputs["w0"]}

    @staticmethod
    def initial_states(xp: Any, p: Any) -> Any:
        """The start angle and speed."""
        return RotatingStates(phi=p.phi_start, w=p.w_start)

    controlled = True

    @staticmethod
    def internal_step(xp: Any, p: Any) -> Any:
        """Longest internal step: 5 ms, so that no step skips the start of a cut or the contact with a stop."""
        return 5e-3

    @staticmethod
    def tolerance(xp: Any, p: Any) -> Any:
        """Tight relative tolerance. The motion is slow, but smoothed friction near rest and a blade that a stack
        stops act within microseconds; and a free motion does not reduce its errors, so that local errors must be
        small."""
        return 1e-9

    @staticmethod
    def constrained_states(xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """The states themselves: they have no constraints."""
        return [x.phi, x.w]

    @classmethod
    def shared(cls, xp: Any, p: Any, u: Any, x: Any) -> MachineState:
        """The machine at the crank angle and speed that follow from angle and speed of the motor."""
        return cls.state(xp, p, u, x.phi / p.ratio, x.w / p.ratio)

    @classmethod
    def derivatives(cls, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """Time derivatives of the states, in declared order."""
        stops = cls._stops(xp, p, x)
        return [x.w, acceleration(p, u, cls.shared(xp, p, u, x), stops.force if stops else 0.0)]

    @classmethod
    def _stops(cls, xp: Any, p: Any, x: Any) -> StopAction | None:
        """The action of the end stops on a driver with a range; None for one that turns round."""
        if cls.inverse.end_stops is None:
            return None
        return stop_action(xp, p.end_stops, cls.inverse.span, x.phi / p.ratio, x.w / p.ratio)

    @classmethod
    def _outputs(cls, xp: Any, p: Any, u: Any, x: Any, s: MachineState) -> Any:
        stops = cls._stops(xp, p, x)
        a = acceleration(p, u, s, stops.force if stops else 0.0)
        at_crank = a / p.ratio
        fields = running(s, at_crank) | cls.inverse.probes(xp, p, u, s, at_crank)
        # the motor also drives the inertia on its own shaft
        fields["kinetic_energy"] += 0.5 * p.J_added * (x.w * x.w)
        fields["power"] = u.tau * x.w
        if stops is not None:
            fields[cls.inverse.driver_port.stop] = stops.force
            fields["potential_energy"] += stops.energy
            fields["dissipated_power"] += stops.lost * s.w
        return cls.Outputs(a=a, tau_bias=s.bias / p.ratio, J=s.J / (p.ratio * p.ratio), **fields)


def acceleration(p: Any, u: Any, s: MachineState, stop: Any = 0.0) -> Any:
    """Motor acceleration [rad/s2]: (J_added + J) a = tau - tau_bias - stop/ratio at the motor shaft, with the force
    `stop` of the end stops at the driver [N], or their torque [N m]."""
    return (u.tau - (s.bias + stop) / p.ratio) / (p.J_added + s.J / (p.ratio * p.ratio))


def direct_model(machine: type[InverseMachine]) -> type[DirectMachine]:
    """The direct model of a machine."""
    return machine.direct()
