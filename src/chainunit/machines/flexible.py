"""The chain unit with its organs as true chains: N rods a side between wall hinge A1 and web hinge A2, with states.

Symbols are those of `chainunit.machines.chain_unit`, and for the chain those of `chainunit.groups.chain`. Rods are
numbered from A1: the first `walls` rods are the wall, the others the web. theta is the angle of a rod from the
downward vertical, positive towards +x. The drive is that of the two-bar machine, the chains are loads of its rocker,
and a slope of the load port is taken along the motion (`chainunit.mechanism.chains`). The outputs do not include the
acceleration that closes the chains: at a communication point the drive has just corrected its speed, and the chain
follows only in the next step.

Pin friction acts only in the four pins of the drive; the pins of the chains have the viscous damping of `organ`.

Two models have these organs: the inverse one, and the direct one, which also has the states of the shaft. The direct
one starts with chains that hang at rest, or with the angles and speeds of the rods in `rods_start`.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..core.errors import InputError
from ..core.model import FmuData, Requirement, StartProblem
from ..core.ports import PortSlopes
from ..core.quantities import Layout, declared_class, group
from ..mechanism.chains import ChainedState
from ..mechanism.models import DirectMachine, InverseMachine, LinkageModel, acceleration
from .chain_organs import LEAST, MOST, Organs, Parameters, both
from .chain_unit import ON_DRIVE, PIN_NAMES, SIDES, ChamberForces, Inputs, Outputs, drive

CLOSING = 20.0
"""Rate at which the gap between a chain and A2 is closed [1/s]."""

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
        "a chain without mass has no motion of its own; for a machine without this organ take ChamberForces",
    )
    for side in SIDES
    for part in ("wall", "web")
)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class ChainedModel(LinkageModel):
    """A model of the chain unit with chains. Its internal integrator controls the error to `tolerance`."""

    organs: Organs
    never_repeats: str = "chains do not repeat a turn"

    def __post_init__(self) -> None:
        organs, unknowns = self.organs, self.organs.unknowns
        self.follow(
            controlled=True,
            start_problem=StartProblem(unknowns, 100 if unknowns else 0, _HANGS),
            # the drive alone: the places of the chains follow from their states
            linkage=lambda xp, p, u: drive(p, u, (), {}),
            # 20 ms, a quarter of a radian of the crank at 12 rad/s
            internal_step=lambda xp, p: 0.02,
            tolerance=lambda xp, p: p.tolerance,
            start_limits=lambda xp, p, u, x: organs.start_limits(xp, p, u, x, self.at_crank(p, u, x)[0]),
            start_guess=lambda xp, p, u: organs.guess(xp, p, u, self.at_crank(p, u)[0]),
            improve_start=lambda xp, p, u, z: organs.improved(xp, p, u, self.at_crank(p, u)[0], z),
            start_states=self._start_states,
            constrained_states=self._closed,
            shared=self._with_chains,
            derivatives=self._rates,
        )
        super().__post_init__()

    def at_crank(self, p: Any, u: Any, x: Any = None) -> tuple[Any, Any]:
        """Angle [rad] and speed [rad/s] of the crank; without states `x`, those at the start."""
        raise NotImplementedError

    def _start_states(self, xp: Any, p: Any, u: Any, z: Sequence[Any]) -> Any:
        """States of both organs at the start."""
        return self.States(**self.organs.start_states(xp, p, u, *self.at_crank(p, u), z))

    def _closed(self, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """The states with which both chains end at A2 and move with it."""
        return self.organs.constrained_states(xp, p, u, x, *self.at_crank(p, u, x))

    def _with_chains(self, xp: Any, p: Any, u: Any, x: Any) -> ChainedState:
        """The machine at its crank angle and speed."""
        q, w = self.at_crank(p, u, x)
        return ChainedState(xp, self.organs.mechanism(xp, p, u, self.organs.split(x), q), w, x=x)

    def _rates(self, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """Time derivatives of the states, in declared order."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class DrivenChains(ChainedModel, InverseMachine):
    """The inverse model of the chain unit with chains."""

    def at_crank(self, p: Any, u: Any, x: Any = None) -> tuple[Any, Any]:
        """See `ChainedModel`; they follow from the inputs."""
        return u.phi / p.ratio, u.w / p.ratio

    @functools.cache  # noqa: B019 - models live as long as the program
    def direct(self) -> DirectMachine:
        """The direct model of the same machine: torque in, motion out."""
        declared = self.organs.RodsStart
        rods = group(declared, "start of the rods", default=declared())
        return self._direct_of(TurningChains, [("rods_start", declared, rods)], organs=self.organs)

    def _rates(self, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        q, w = self.at_crank(p, u, x)
        m = self.organs.mechanism(xp, p, u, self.organs.split(x), q)
        return [v for h in self.organs.hold(xp, m, w) for v in h.rates(u.a / p.ratio, CLOSING)]


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class TurningChains(ChainedModel, DirectMachine):
    """The direct model of the chain unit with chains."""

    def at_crank(self, p: Any, u: Any, x: Any = None) -> tuple[Any, Any]:
        """See `ChainedModel`; they are states of this model."""
        shaft = self.initial_states(None, p) if x is None else x
        return shaft.phi / p.ratio, shaft.w / p.ratio

    def start_from(self, outputs: Mapping[str, float]) -> dict[str, float]:
        """See `DirectMachine`; the start parameters include the angles and speeds of the rods."""
        rods = {
            f"rods_start.{side}.{name}": outputs[f"{side}.{name}"]
            for side in SIDES
            for name in self.organs.rod_names
        }
        return {**super().start_from(outputs), "rods_start.given": 1.0, **rods}

    def _start_states(self, xp: Any, p: Any, u: Any, z: Sequence[Any]) -> Any:
        """States at the start: angle and speed of the motor, and both organs."""
        chains = self.organs.start_states(xp, p, u, *self.at_crank(p, u), z, p.rods_start)
        return self.States(**vars(self.initial_states(xp, p)), **chains)

    def _closed(self, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        return [x.phi, x.w, *super()._closed(xp, p, u, x)]

    def _rates(self, xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        s = self.shared(xp, p, u, x)
        a = acceleration(p, u, s)
        return [x.w, a, *(v for h in s.chains.values() for v in h.rates(a / p.ratio, CLOSING))]


@functools.cache
def flexible(walls: int, webs: int) -> InverseMachine:
    """The machine with `walls` + `webs` rods an organ; its direct model is `flexible(walls, webs).direct()`.

    Raises
    ------
    InputError
        for fewer than one rod in wall or web, or more than MOST rods in all.
    """
    if walls < 1 or webs < 1 or walls + webs > MOST:
        raise InputError(
            f"{walls + webs} rods an organ, {walls} in the wall and {webs} in the web: must be at least one in each "
            f"and at most {MOST} in all; more need an implicit integrator"
        )
    organs = Organs(walls, webs)
    return DrivenChains(
        name="ChainUnitFlexible",
        text="""The chain unit with its organs as chains of rods; `flexible` sets their numbers.

        Inputs, outputs and load port are those of ChamberForces and connect in the same way. The internal integrator
        controls the error to `tolerance`. In Model Exchange phi, w and a must be set before each evaluation of the
        derivatives. Rods are counted from A1; a rod is slack where its mean axial pull is below zero.
        """,
        made=(flexible, (walls, webs)),
        fmu_data=FmuData(sizes=ChamberForces.fmu_data.sizes),
        description=(
            f"Forces in a chain unit whose organs are chains of {organs.number} rods, {walls} in the wall and {webs} "
            "in the web: from motor angle and speed to torque, load port and every support reaction"
        ),
        direct_description=(
            f"A chain unit that turns by itself, with organs of {organs.number} rods: from motor torque to angle, "
            "speed, acceleration and every support reaction"
        ),
        organs=organs,
        Parameters=Parameters,
        Inputs=Inputs,
        Feed=ChamberForces.Feed,
        States=declared_class("States", (), both(organs.States)),
        Outputs=declared_class("ChainOutputs", (Outputs,), both(organs.Side)),
        joints=ChamberForces.joints,
        pins=ChamberForces.pins,
        pin_names={pin: joint for pin, joint in PIN_NAMES.items() if joint in ON_DRIVE.values()},
        extend=ChamberForces.extend,
        probes=organs.probes,
        by_differences=frozenset(("dJ_dphi", *Layout(PortSlopes).names)),
        required=(*ChamberForces.required, *_MASSES),
        requirements=_limits,
    )


def with_rods(number: int, start: Mapping[str, float]) -> InverseMachine:
    """ChainUnitFlexible with `number` rods an organ. They are divided between wall and web so that the rods
    are nearest to equal length, by the lengths among the `start` values.

    Raises
    ------
    InputError
        for a number of rods that the model cannot have.
    """
    from .hanging import split  # it takes numpy, which the Python of a simulator that runs the FMU may lack

    if not LEAST <= number <= MOST:
        raise InputError(f"rods = {number}: must be >= {LEAST} and <= {MOST}")
    lengths = ChamberForces.Parameters()
    return flexible(*split((start.get("l1", lengths.l1), start.get("l2", lengths.l2)), number))


def _limits(xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
    """The limits of the machine with two bars, and masses above zero."""
    yield from ChamberForces.requirements(xp, p)
    for masses in (p.left, p.right):
        yield masses.wall_mass, 0.0, math.inf
        yield masses.web_mass, 0.0, math.inf


ChainUnitFlexible = flexible(6, 2)
"""Eight rods, of nearly equal length at the start values."""
