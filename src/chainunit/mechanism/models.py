"""The two models of a linkage: the inverse one takes the motion of the motor shaft and gives torque and load port,
the direct one takes the torque and gives the motion.

q is the crank angle, `w`, `a` its derivatives; at the shaft `phi w a tau J` are the motor's, ``p.ratio`` turns for
one of the crank.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from typing import Any, ClassVar

from ..groups.loads import Joint
from ..model import Model, Part, Requirement
from ..ports import PortSlopes, PortValues, ShaftMotion, Start, flanges, load_terminal
from ..quantities import Layout, Value, declaration, quantity
from .linkage import Linkage, Topology
from .machine import MachineState, Mechanism, derived_numbers

MACHINES: dict[str, type[InverseMachine]] = {}
"""The machines by name: a class of that kind anywhere is a machine that study files may name."""
Fields = Sequence[tuple[str, Any, Any]]
"""Name, type and field of each quantity or group of a declaration that is built from others."""


def declared_class(name: str, bases: tuple[type, ...], fields: Fields = ()) -> Any:
    """A declaration that is built from its fields."""
    return dataclasses.make_dataclass(name, fields, bases=bases, frozen=True, kw_only=True)


def fields_of(declared: type, *, without: Sequence[str] = ()) -> Fields:
    """The fields of a declaration, those `without` left out, for another one."""
    return [
        (f.name, f.type, dataclasses.field(default=f.default, metadata=f.metadata))
        for f in dataclasses.fields(declared)
        if f.name not in without
    ]


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
    """A model whose mechanics are those of a linkage."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if hasattr(cls, "Parameters"):
            cls.derived = cls.linkage(cls.Parameters(), cls.Inputs()).derived

    @staticmethod
    def linkage(p: Any, u: Any) -> Linkage:
        """The linkage with these parameters and inputs; places and lengths do not depend on the inputs."""
        raise NotImplementedError

    @classmethod
    def derive(cls, xp: Any, p: Any) -> list[Any]:
        """Values that the groups derive from the lengths."""
        return derived_numbers(xp, cls.linkage(p, cls.Inputs()))

    @classmethod
    def state(cls, xp: Any, p: Any, u: Any, q: Any, w: Any) -> MachineState:
        """The machine at crank angle `q` [rad] and speed `w` [rad/s]."""
        derived = p.derived if cls.derived else ()
        return MachineState(xp, Mechanism(xp, cls.linkage(p, u), q, derived, cls.topology()), w)

    @classmethod
    @cache
    def topology(cls) -> Topology:
        """The names of the linkage."""
        return cls.linkage(cls.Parameters(), cls.Inputs()).topology


class MachineModel(Model):
    """The model of a machine, as far as a study asks for it: of a linkage, or of an FMU of somebody else.

    What a study does with a machine follows from what is declared here, not from which machine it is.
    """

    Feed: ClassVar[type]
    """Its loads in normal running: inputs beside the motion of its shaft."""
    feed_layout: ClassVar[Layout]
    pins: ClassVar[Mapping[str, str]] = {}
    """Output of each bearing by its title."""
    noun: ClassVar[str] = "machine"
    """What people call it."""
    turning: ClassVar[str] = "crank"
    """What people call the link that the motor turns."""
    usual_speed: ClassVar[tuple[float, float]] = (0.05, 25.0)
    """Of the crank [rad/s]; beyond, a slip of the unit is likely."""
    sides: ClassVar[tuple[str, ...]] = ()
    """Its sides, each with a working organ that may be a chain: so are called the groups of its loads, and of its
    outputs, on them."""
    cuts: ClassVar[bool] = False
    """Whether it has a `blade` among its outputs, and a `stack` that the blade cuts among its parameters."""


class InverseMachine(LinkageModel, MachineModel):
    """Motion of the motor shaft in, torque, load port and every reaction out.

    A machine states its `Parameters`, `Inputs` (with those of `CrankMotion`), `Outputs` (with `tau`, `PortValues` and
    those of `running`), its `linkage` and its `probes`; all else follows. Where it states none, its `Feed` are all
    inputs beside `ShaftMotion`, and its `pins` have the names of pin and link.
    """

    Outputs: ClassVar[type]
    joints: ClassVar[Mapping[str, Joint]] = {}
    """Joint of each reaction by the name of the output."""
    angles: ClassVar[Mapping[str, str]] = {}
    """Links by the symbols of their angles from the downward vertical, positive towards +x."""
    direct_name: ClassVar[str]
    """Name of the direct model, ``<name>Direct`` where a machine states none."""
    direct_description: ClassVar[str] = ""
    by_differences: ClassVar[frozenset[str]] = frozenset()
    """Outputs whose own derivatives are taken by differences, see `chainunit.model.Part`."""

    terminals = (*flanges("inflow"), load_terminal())

    def __init_subclass__(cls) -> None:
        own = vars(cls)
        if "Inputs" in own and "Feed" not in own:
            cls.Feed = declared_class("Feed", (), fields_of(cls.Inputs, without=names_of(ShaftMotion)))
            # where pickle finds it
            cls.Feed.__module__, cls.Feed.__qualname__ = cls.__module__, f"{cls.__qualname__}.Feed"
        if hasattr(cls, "Feed"):
            cls.feed_layout = Layout(cls.Feed)
        if "joints" in own and "pins" not in own:
            cls.pins = {f"{pin} {link}": output for output, (pin, link) in cls.joints.items()}
        if "name" in own and "direct_name" not in own:
            cls.direct_name = f"{cls.name}Direct"
        # a class that a function makes has others of its name
        if "name" in own and not cls.built_by:
            MACHINES[cls.name] = cls
        if hasattr(cls, "Outputs") and "parts" not in own:
            apart = cls.by_differences
            cls.parts = (
                Part(cls.Outputs, cls._outputs, by_differences=apart & set(Layout(cls.Outputs).names)),
                Part(PortSlopes, slopes, by_differences=apart & set(Layout(PortSlopes).names)),
            )
        super().__init_subclass__()

    @staticmethod
    def probes(xp: Any, p: Any, u: Any, s: MachineState, a: Any) -> dict[str, Any]:
        """The machine's own outputs, of a state at crank acceleration `a`; those that `running` gives, too, where it
        gives them otherwise."""
        raise NotImplementedError

    @classmethod
    def shared(cls, xp: Any, p: Any, u: Any, x: Any) -> MachineState:
        """The machine at the crank angle and speed that belong to the motor's."""
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
    @cache
    def direct(cls) -> type[DirectMachine]:
        """The direct model of the same machine: torque in, motion out.

        Its parameters are those of the machine, the inertia on its shaft and the start; its inputs the torque and the
        loads; its outputs those of the machine without `tau` and load port, and `Turning`.
        """
        return cls._turning(DirectMachine)

    @classmethod
    def _turning(cls, base: type[DirectMachine], parameters: Fields = (), **more: Any) -> type[DirectMachine]:
        """The direct model as a subclass of `base`, with more `parameters` and attributes."""
        carried = fields_of(cls.Outputs, without=("tau", *names_of(PortValues)))
        # the machine's own where the start declares it, too
        own = [field for field in fields_of(cls.Parameters) if field[0] in names_of(Start)]
        members = {
            "__module__": cls.__module__,
            "__doc__": f"The direct model of {cls.__name__}: motor torque in, motion out.",
            "name": cls.direct_name,
            "description": cls.direct_description
            or f"{cls.name} that turns by itself: from motor torque to angle, speed, acceleration and every reaction",
            "built_by": f"{cls.built_by or cls.__qualname__}.direct()",
            "maker": (direct_model, (cls,)),
            "inverse": cls,
            "Parameters": declared_class(
                "DirectParameters", (Start, AddedInertia, cls.Parameters), [*own, *parameters]
            ),
            **(
                {"States": declared_class("States", (TurningStates,), fields_of(cls.States))}
                if cls.States
                else {}
            ),
            "Inputs": declared_class(
                "DirectInputs", (DrivingTorque,), fields_of(cls.Inputs, without=names_of(ShaftMotion))
            ),
            "Outputs": declared_class("DirectOutputs", (), [*carried, *fields_of(Turning)]),
            **more,
        }
        return type(f"Direct{cls.__name__}", (base,), members)


def running(s: MachineState, a: Any) -> dict[str, Any]:
    """Power and energies at crank acceleration `a` and the margin, which every machine has as outputs."""
    return {
        "power": s.torque(a) * s.w,
        "kinetic_energy": s.kinetic_energy,
        "potential_energy": s.held_energy,
        "dissipated_power": s.lost * s.w,
        "margin": s.margin(),
    }


def slopes(xp: Any, p: Any, u: Any, x: Any, s: MachineState) -> PortSlopes:
    """The slopes of the port at the motor."""
    by_angle, by_speed = s.slopes()
    per_turn = 1.0 / (p.ratio * p.ratio)
    return PortSlopes(tau_bias_dphi=by_angle * per_turn, tau_bias_dw=by_speed * per_turn)


@declaration
class AddedInertia:
    """The inertia on the shaft of a machine that turns by itself."""

    J_added: Value = quantity(
        "kg.m2", "inertia on the motor shaft beside the machine's", default=0.0, min=0.0, tunable=True
    )


@declaration
class TurningStates:
    """States of the machine; each is an output, too."""

    phi: Value = quantity("rad", "motor angle; crank angle is phi/ratio, from the upward vertical, clockwise")
    w: Value = quantity("rad/s", "motor speed")


@declaration
class DrivingTorque:
    """Torque of the motor."""

    tau: Value = quantity("N.m", "torque of the motor on the shaft", default=0.0, nominal=100.0)


@declaration
class Turning:
    """Acceleration, and the torque on the shaft."""

    a: Value = quantity("rad/s2", "motor acceleration", nominal=100.0)
    tau_bias: Value = quantity("N.m", "torque needed at constant speed of the shaft", nominal=100.0)
    J: Value = quantity("kg.m2", "inertia reflected to the shaft")


class DirectMachine(LinkageModel):
    """Torque of the motor in, motion and every reaction out, see `InverseMachine.direct`. `inverse` is the model of
    the same machine with the motion given."""

    inverse: ClassVar[type[InverseMachine]]
    Outputs: ClassVar[type]
    States = TurningStates
    terminals = flanges("inflow")
    _carried = Requirement(
        "inertia of the crank and on its shaft",
        "kg.m2",
        "at the dead points of the rocker nothing else carries the torque; give crank.I, crank.m or J_added",
    )

    def __init_subclass__(cls) -> None:
        if not hasattr(cls, "inverse"):  # a common base of several models
            return
        cls.required = (*cls.inverse.required, cls._carried)
        cls.parts = (Part(cls.Outputs, cls._outputs),)
        super().__init_subclass__()

    @classmethod
    def linkage(cls, p: Any, u: Any) -> Linkage:
        """That of the inverse model."""
        return cls.inverse.linkage(p, u)

    @classmethod
    def requirements(cls, xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
        """Those of the inverse model, and an inertia that never vanishes."""
        yield from cls.inverse.requirements(xp, p)
        yield p.J_added * p.ratio * p.ratio + cls.linkage(p, cls.Inputs()).crank.inertia, 0.0, math.inf

    @classmethod
    def start_from(cls, outputs: Mapping[str, float]) -> dict[str, float]:
        """Start parameters with which it goes on from a motion of the inverse model, whose outputs and states at that
        instant are given by name."""
        return {"phi_start": outputs["phi0"], "w_start": outputs["w0"]}

    @staticmethod
    def initial_states(xp: Any, p: Any) -> Any:
        """The start angle and speed."""
        return TurningStates(phi=p.phi_start, w=p.w_start)

    controlled = True

    @staticmethod
    def internal_step(xp: Any, p: Any) -> Any:
        """5 ms: a cut or a stop that comes is not passed over."""
        return 5e-3

    @staticmethod
    def tolerance(xp: Any, p: Any) -> Any:
        """The motion is slow, but smoothed friction near rest, and a blade that a stack stops, take microseconds. A
        motion that runs freely keeps no error small: the local one is tight."""
        return 1e-9

    @staticmethod
    def closed(xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """The states themselves: they have no constraints."""
        return [x.phi, x.w]

    @classmethod
    def shared(cls, xp: Any, p: Any, u: Any, x: Any) -> MachineState:
        """The machine at the crank angle and speed that belong to the motor's."""
        return cls.state(xp, p, u, x.phi / p.ratio, x.w / p.ratio)

    @classmethod
    def derivatives(cls, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """Time derivatives of the states, in declared order."""
        return [x.w, acceleration(p, u, cls.shared(xp, p, u, x))]

    @classmethod
    def _outputs(cls, xp: Any, p: Any, u: Any, x: Any, s: MachineState) -> Any:
        a = acceleration(p, u, s)
        at_crank = a / p.ratio
        fields = running(s, at_crank) | cls.inverse.probes(xp, p, u, s, at_crank)
        # the motor drives what is on its shaft, too
        fields["kinetic_energy"] += 0.5 * p.J_added * (x.w * x.w)
        fields["power"] = u.tau * x.w
        return cls.Outputs(a=a, tau_bias=s.bias / p.ratio, J=s.J / (p.ratio * p.ratio), **fields)


def acceleration(p: Any, u: Any, s: MachineState) -> Any:
    """Motor acceleration [rad/s2]: (J_added + J) a = tau - tau_bias, all at the motor shaft."""
    return (u.tau - s.bias / p.ratio) / (p.J_added + s.J / (p.ratio * p.ratio))


def direct_model(machine: type[InverseMachine]) -> type[DirectMachine]:
    """The direct model of a machine."""
    return machine.direct()
