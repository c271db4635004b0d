"""The chain unit with its organs as true chains: N rods a side between wall hinge A1 and web hinge A2, with states.

Symbols as in `chainunit.machines.chain_unit`, of the chain as in `chainunit.groups.chain`: rods are numbered from A1,
the first `walls` of them are the wall, the others the web; theta is the angle of a rod from the downward vertical,
positive towards +x. The drive is that of the two-bar machine, the chains are loads of its rocker, and a slope of the
load port is taken along the motion (`chainunit.mechanism.chains`). Outputs are without the acceleration that closes
the chains: at a communication point the drive has just corrected its speed, and the chain follows in the next step
only.

Pin friction acts in the four pins of the drive alone; in those of the chains it is the viscous damping of `organ`.

Two models have these organs: the inverse one, and the direct one, whose states are the shaft's, too.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from types import MappingProxyType
from typing import Any

from ..errors import InputError
from ..integrate import Solver
from ..mechanism.chains import ChainedState
from ..mechanism.models import (
    AddedInertia,
    LinkageModel,
    Turning,
    TurningStates,
    acceleration,
    declared_class,
    fields_of,
    names_of,
    turned,
)
from ..model import Model, Part, Requirement
from ..ports import PortSlopes, PortValues, Start
from ..quantities import Layout, declaration, group
from .chain_organs import MOST, Organs, Parameters, both
from .chain_unit import SIDES, ChamberForces, DirectChainUnit, Inputs, Outputs

CLOSING = 20.0
"""Rate at which a chain that has drifted off A2 is drawn back [1/s]."""


@declaration
class DirectChainParameters(Start, AddedInertia, Parameters):
    """Parameters of the chain unit with chains that turns by itself."""

    solver: Solver = group(Solver, "internal integrator", default=Solver(max_steps=1e5))


_HANGS = tuple(
    Requirement(subject.format(side), unit, why, ("z", "l1", "l2", "e"))
    for side in SIDES
    for subject, unit, why in (
        (
            "distance of the {} chain's end from A2 at the start",
            "m",
            "it does not hang, as a rod would have to push (widen z or shorten the rods)",
        ),
        (
            "largest angle between rods of the {} organ at the start",
            "rad",
            "they rest against each other (raise organ.fold_limit, widen z, or take more rods)",
        ),
    )
)
_MASSES = tuple(
    Requirement(
        f"{side}.{part}_mass",
        "kg",
        "a chain without mass has no motion of its own; for an organ that is not there take ChamberForces",
    )
    for side in SIDES
    for part in ("wall", "web")
)


class ChainedModel(Model):
    """A model of the chain unit with chains. Its own integrator controls its error to `tolerance`.

    `bars` is the model with two bars that has the same shaft; `shaft` names the states of the shaft, none where its
    motion is given.
    """

    bars: type[LinkageModel]
    organs: Organs
    shaft: tuple[str, ...] = ()
    controlled = True
    start_required = _HANGS

    def __init_subclass__(cls) -> None:
        cls.required = (*cls.bars.required, *_MASSES)
        cls.terminals = cls.bars.terminals
        cls.start_unknowns = cls.organs.unknowns
        cls.start_rounds = 100 if cls.start_unknowns else 0
        super().__init_subclass__()

    @classmethod
    def requirements(cls, xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
        """Those of two bars, and masses that move."""
        yield from cls.bars.requirements(xp, p)
        for masses in (p.left, p.right):
            yield masses.wall_mass, 0.0, math.inf
            yield masses.web_mass, 0.0, math.inf

    @staticmethod
    def internal_step(xp: Any, p: Any) -> Any:
        """20 ms: a quarter of a radian of the crank at 12 rad/s."""
        return 0.02

    @staticmethod
    def tolerance(xp: Any, p: Any) -> Any:
        """As the parameter says."""
        return p.tolerance

    @classmethod
    def at_crank(cls, p: Any, u: Any, x: Any = None) -> tuple[Any, Any]:
        """Angle [rad] and speed [rad/s] of the crank; without states those at the start."""
        if not cls.shaft:
            return u.phi / p.ratio, u.w / p.ratio
        return (p.phi_start / p.ratio, p.w_start / p.ratio) if x is None else (x.phi / p.ratio, x.w / p.ratio)

    @classmethod
    def start_limits(cls, xp: Any, p: Any, u: Any, x: Any) -> Iterator[tuple[Any, Any, Any]]:
        """See `Organs.start_limits`."""
        return cls.organs.start_limits(xp, p, u, x, cls.at_crank(p, u, x)[0])

    @classmethod
    def start_guess(cls, xp: Any, p: Any, u: Any) -> list[Any]:
        """See `Organs.guess`."""
        return cls.organs.guess(xp, p, u, cls.at_crank(p, u)[0])

    @classmethod
    def start_improved(cls, xp: Any, p: Any, u: Any, z: Sequence[Any]) -> list[Any]:
        """See `Organs.improved`."""
        return cls.organs.improved(xp, p, u, cls.at_crank(p, u)[0], z)

    @classmethod
    def started(cls, xp: Any, p: Any, u: Any, z: Sequence[Any]) -> Any:
        """See `Organs.started`."""
        shaft = {name: getattr(p, f"{name}_start") for name in cls.shaft}
        assert cls.States is not None
        return cls.States(**shaft, **cls.organs.started(xp, p, u, *cls.at_crank(p, u), z))

    @classmethod
    def closed(cls, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """See `Organs.closed`."""
        shaft = [getattr(x, name) for name in cls.shaft]
        return [*shaft, *cls.organs.closed(xp, p, u, x, *cls.at_crank(p, u, x))]

    @classmethod
    def shared(cls, xp: Any, p: Any, u: Any, x: Any) -> ChainedState:
        """The machine at its crank angle and speed."""
        q, w = cls.at_crank(p, u, x)
        return ChainedState(xp, cls.organs.mechanism(xp, p, u, cls.organs.split(x), q), w)


def flexible(walls: int, webs: int) -> type[ChainedModel]:
    """The machine with `walls` + `webs` rods an organ.

    Raises
    ------
    InputError
        for fewer than one rod in either, or more than MOST in all.
    """
    if walls < 1 or webs < 1 or walls + webs > MOST:
        raise InputError(
            f"{walls + webs} rods an organ, {walls} in the wall and {webs} in the web: must be at least one in each "
            f"and at most {MOST} in all; more need an implicit integrator"
        )
    return _flexible(walls, webs)


@functools.cache
def _flexible(walls: int, webs: int) -> type[ChainedModel]:
    chains = Organs(walls, webs)
    declared = declared_class("ChainOutputs", (Outputs,), both(chains.Side))

    def results(xp: Any, p: Any, u: Any, x: Any, s: ChainedState) -> Any:
        a = u.a / p.ratio
        return declared(
            tau=s.torque(a) / p.ratio,
            tau_bias=s.bias / p.ratio,
            J=s.J / (p.ratio * p.ratio),
            dJ_dphi=s.along(u.phi / p.ratio)[2] / (p.ratio * p.ratio * p.ratio),
            phi0=u.phi,
            w0=u.w,
            **chains.loads(xp, p, x, s, a),
        )

    def port_slopes(xp: Any, p: Any, u: Any, x: Any, s: ChainedState) -> PortSlopes:
        by_angle, by_speed, _ = s.along(u.phi / p.ratio)
        per_motor_turn = 1.0 / (p.ratio * p.ratio)
        return PortSlopes(tau_bias_dphi=by_angle * per_motor_turn, tau_bias_dw=by_speed * per_motor_turn)

    class ChainUnitFlexible(ChainedModel):
        """The chain unit with its organs as chains of rods, as many as `flexible` was told.

        Inputs, outputs and load port are those of ChamberForces, and connect alike. In a co-simulation the inputs phi
        and w run along w and a inside a step, and its own integrator controls its error to `tolerance`. In Model
        Exchange phi, w and a must be set whenever derivatives are evaluated. Rods are counted from A1; a rod is slack
        where its mean axial pull is below zero.
        """

        name = "ChainUnitFlexible"
        built_by = f"flexible({walls}, {webs})"
        description = (
            f"Forces in a chain unit whose organs are chains of {chains.number} rods, {walls} in the wall and {webs} "
            "in the web: from motor angle and speed to torque, load port and every support reaction"
        )
        bars, organs = ChamberForces, chains
        Feed, joints, pins = ChamberForces.Feed, ChamberForces.joints, ChamberForces.pins
        Parameters = Parameters
        Inputs = Inputs
        States = declared_class("States", (), both(chains.States))
        input_rates = MappingProxyType({"phi": "w", "w": "a"})

        @classmethod
        def direct(cls) -> type[ChainedModel]:
            """The direct model of the same machine."""
            return _turning(chains)

        @classmethod
        def derivatives(cls, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
            """Time derivatives of the states, in declared order."""
            q, w = cls.at_crank(p, u, x)
            m = chains.mechanism(xp, p, u, chains.split(x), q)
            return [v for h in chains.held(xp, m, w) for v in h.rates(u.a / p.ratio, CLOSING)]

        parts = (
            Part(declared, results, by_differences=frozenset(("dJ_dphi",))),
            Part(PortSlopes, port_slopes, by_differences=frozenset(Layout(PortSlopes).names)),
        )

    return ChainUnitFlexible


def turning(walls: int, webs: int) -> type[ChainedModel]:
    """The machine with chains that turns by itself, see `flexible`."""
    return _turning(flexible(walls, webs).organs)


@functools.cache
def _turning(chains: Organs) -> type[ChainedModel]:
    carried = fields_of(
        declared_class("_", (Outputs,), both(chains.Side)), without=("tau", *names_of(PortValues))
    )
    declared = declared_class("DirectChainOutputs", (), [*carried, *fields_of(Turning)])

    def results(xp: Any, p: Any, u: Any, x: Any, s: ChainedState) -> Any:
        a = acceleration(p, u, s)
        return declared(
            a=a,
            tau_bias=s.bias / p.ratio,
            J=s.J / (p.ratio * p.ratio),
            **turned(p, u, x, chains.loads(xp, p, x, s, a / p.ratio)),
        )

    class TurningChainUnitFlexible(ChainedModel):
        """The chain unit with chains that turns by itself: the torque of the motor in, the motion of shaft and rods
        out."""

        name = "ChainUnitFlexibleDirect"
        built_by = f"turning({chains.walls}, {chains.webs})"
        description = (
            f"A chain unit that turns by itself, with organs of {chains.number} rods: from motor torque to angle, "
            "speed, acceleration and every support reaction"
        )
        bars, organs, shaft = DirectChainUnit, chains, ("phi", "w")
        Parameters = DirectChainParameters
        Inputs = DirectChainUnit.Inputs
        States = declared_class("States", (TurningStates,), both(chains.States))

        @classmethod
        def derivatives(cls, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
            """Time derivatives of the states, in declared order."""
            s = cls.shared(xp, p, u, x)
            a = acceleration(p, u, s)
            rates = [v for h in s.chains.values() for v in h.rates(a / p.ratio, CLOSING)]
            return [x.w, a, *rates]

        parts = (Part(declared, results),)

    return TurningChainUnitFlexible


ChainUnitFlexible = flexible(6, 2)
"""Eight rods, split as the start values' lengths want it."""
