"""The organs of the chain unit as chains of rods: their declarations, and their mechanics on the drive.

Rods are numbered from the wall hinge A1: the first `walls` rods are the wall, the others the web. theta is the angle
of a rod from the downward vertical, positive towards +x.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

from ..core.planar import ZERO, Vec2
from ..core.ports import Solver
from ..core.quantities import Layout, Value, declaration, declared_class, group, quantity
from ..groups import hanging_chain
from ..groups.chain import Rods
from ..groups.hanging_chain import HangingChain, HeldChain, State
from ..groups.loads import Resistance
from ..mechanism.chains import ChainedState
from ..mechanism.linkage import Linkage
from ..mechanism.machine import Mechanism
from ..mechanism.models import running
from . import chain_unit
from .chain_unit import (
    NAMES,
    SIDES,
    ChamberForces,
    Rocker,
    coupler_force,
    on_drive,
    on_side,
    organ_masses,
    rocker_load,
    rocker_motion,
    rod_motions,
)

_CLOSED = 1e-6
"""Gap at the start above which a chain does not hang [m]."""
_ANY_FOLD = 1e6
"""Angle beyond any fold [rad]."""
_NO_LINE = 1e-30
"""Squared length that is added to that of a line, so that a chain folded to nothing has a speed, too [m2]."""
_NO_PULL = 1e-6  # N, range of the pull in which a rod changes from taut to slack
LEAST, USUAL, MOST = 2, 8, 24
"""Least, usual and largest number of rods of an organ."""


@declaration
class OrganLaw:
    """Damping and stops of the rods of a chain; the same on both sides."""

    eta: Value = quantity(
        "N.m2.s/rad",
        "damping of an inner pin times the mean length of its two rods; assumed",
        default=0.24,
        min=0.0,
        max=1e4,
        tunable=True,
    )
    end_damping: Value = quantity(
        "N.m.s/rad",
        "damping of each of the pins A1 and A2; assumed",
        default=1.0,
        min=0.0,
        max=1e5,
        tunable=True,
    )
    fold_limit: Value = quantity(
        "rad",
        "angle between neighbouring rods at which they meet; assumed",
        default=2.8,
        above=0.0,
        max=math.pi,
    )
    fold_stiffness: Value = quantity(
        "N.m/rad2",
        "stiffness of the stop beyond fold_limit; its moment grows with the square of the angle; assumed",
        default=5e4,
        min=0.0,
        max=1e7,
        tunable=True,
    )


@declaration
class Parameters(chain_unit.Parameters):
    """Parameters of the chain unit with chains."""

    organ: OrganLaw = group(OrganLaw, "organs as chains", default=OrganLaw())
    tolerance: Value = quantity(
        "1",
        "relative tolerance of the integrator in a Co-Simulation FMU",
        default=1e-7,
        min=1e-12,
        max=1e-2,
        tunable=True,
    )
    solver: Solver = group(Solver, "internal integrator", default=Solver(max_steps=100_000))


@declaration
class ChainSide(chain_unit.Side):
    """Loads of one organ as a chain."""

    slack_share: Value = quantity("1", "share of the rods whose mean axial pull is below zero")
    fold_largest: Value = quantity("rad", "largest angle between neighbouring rods")
    drift: Value = quantity(
        "m",
        "distance between the end of the chain and A2; in Co-Simulation after the projection in each step",
    )
    kinetic_energy: Value = quantity("J", "kinetic energy")
    potential_energy: Value = quantity(
        "J", "potential energy, of weights zero at the level of C, and of folded rods", nominal=100.0
    )
    energy_residual: Value = quantity(
        "J", "energy minus energy_due: the error of the energy balance since the start", nominal=1000.0
    )
    energy_per_kg: Value = quantity("J/kg", "energy of a kilogram of material at its place on the rods")


def _rod_fields(
    name: str,
    number: int,
    unit: str,
    template: str,
    nominal: float | None = None,
    default: float | None = None,
) -> list[Any]:
    return [
        (f"{name}_{k}", Value, quantity(unit, template.format(k, k + 1), nominal=nominal, default=default))
        for k in range(1, number + 1)
    ]


def both(declared: type, default: Any = None) -> list[Any]:
    """Fields for the declaration `declared` on each side."""
    return [(name, declared, group(declared, f"{name} organ", default=default)) for name in SIDES]


@declaration
class StartChoice:
    """The choice of the start of the rods."""

    given: Value = quantity(
        "1",
        "true: the rods start with these angles and speeds, changed as little as closes the chain; false: they hang "
        "at rest",
        default=False,
        type="Boolean",
    )


class Organs:
    """Both organs as chains of `walls` + `webs` rods: the declarations of their states and outputs, and their
    mechanics at the crank angle `q` and speed `w`, for the inverse and the direct model."""

    def __init__(self, walls: int, webs: int) -> None:
        self.walls, self.webs = walls, webs
        self.number = N = walls + webs
        angle = "angle of rod {}, counted from A1, from the downward vertical, positive towards +x"
        due = "energy at the start, plus the work of the rocker since, minus the losses to damping and processing"
        self.States = declared_class(
            "ChainStates",
            (),
            [
                *_rod_fields("theta", N, "rad", angle),
                *_rod_fields("omega", N, "rad/s", "speed of rod {}", 10.0),
                ("energy_due", Value, quantity("J", due, nominal=100.0)),
            ],
        )
        self.Side = declared_class(
            "ChainLoads",
            (ChainSide,),
            [
                *_rod_fields("pull", N, "N", "mean axial pull in rod {}", 100.0),
                *_rod_fields("fold", N - 1, "rad", "angle of rod {1} from rod {0}"),
            ],
        )
        self._layout = Layout(self.States)
        self.rod_names = self._layout.names[: 2 * N]
        rod_start = declared_class(
            "RodStart",
            (),
            [
                *_rod_fields("theta", N, "rad", angle, default=0.0),
                *_rod_fields("omega", N, "rad/s", "speed of rod {}", default=0.0),
            ],
        )
        self.RodsStart = declared_class("RodsStart", (StartChoice,), both(rod_start, rod_start()))
        self._start_layout = Layout(rod_start)

    def split(self, x: Any) -> list[State]:
        """Angles and speeds of the rods, left and right."""
        N, sides = self.number, (self._layout.values(x.left), self._layout.values(x.right))
        return [(side[:N], side[N : 2 * N]) for side in sides]

    def rods(self, p: Any, u: Any) -> list[Rods]:
        """Wall and web of each side with the material on them, as uniform rods: the organ of paper 000 in more
        pieces."""
        walls, webs = self.walls, self.webs
        lengths = [p.l1 / walls] * walls + [p.l2 / webs] * webs
        inner = [2.0 * p.organ.eta / (one + other) for one, other in pairwise(lengths)]
        damping = [p.organ.end_damping, *inner, p.organ.end_damping]
        sides, law = [], p.organ
        for side in SIDES:
            on_wall, on_web = organ_masses(p, side, getattr(u, side))
            masses = [on_wall / walls] * walls + [on_web / webs] * webs
            sides.append(Rods(lengths, masses, damping, p.rod_inertia, law.fold_limit, law.fold_stiffness))
        return sides

    def linkage(self, p: Any, u: Any, states: Sequence[State]) -> Linkage:
        """The drive with both chains in these states."""
        chains: dict[str, Any] = {}
        for side, rods, state in zip(SIDES, self.rods(p, u), states, strict=True):
            names = NAMES[side]
            resistance = Resistance(names.b, getattr(u, side).processing_force, p.processing)
            chains[side] = HangingChain(names.a1, "A2", rods, state, p.g, resistance, self.walls)
        return chain_unit.drive(p, u, (), chains)

    def mechanism(self, xp: Any, p: Any, u: Any, states: Sequence[State], q: Any) -> Mechanism:
        """The drive at the crank angle `q` with the chains in these states."""
        return Mechanism(xp, self.linkage(p, u, states), q)

    def hold(self, xp: Any, m: Mechanism, w: Any) -> Iterator[HeldChain]:
        """Both chains of the drive."""
        for side in SIDES:
            yield m.linkage.loads[side].hold(xp, m, w)

    def _shares(self, p: Any) -> list[Any]:
        """The share of each rod in the material."""
        on_wall, on_web = (1.0 - p.web_share) / self.walls, p.web_share / self.webs
        return [on_wall] * self.walls + [on_web] * self.webs

    def _side(self, xp: Any, p: Any, s: ChainedState, a: Any, side: Any, due: Any) -> tuple[Any, Vec2]:
        """The declared loads of a side at crank acceleration `a`, and the force at its support."""
        h, hand, walls = s.chains[side], NAMES[side].hand, self.walls
        accelerations, forces = h.at(a)
        theta = h.data.state[0]
        axes = [Vec2(xp.sin(angle), -xp.cos(angle)) for angle in theta]
        before = [u.dot(forces[k] - h.at_start[k]) for k, u in enumerate(axes)]
        after = [u.dot(forces[k + 1]) for k, u in enumerate(axes)]
        least = [xp.minimum(one, other) for one, other in zip(before, after, strict=True)]
        pulls = [0.5 * (one + other) for one, other in zip(before, after, strict=True)]
        folds = [outer - inner for inner, outer in pairwise(theta)]
        slack = [xp.maximum(0.0, xp.minimum(1.0, -pull * (1.0 / _NO_PULL))) for pull in pulls]
        kinetic, potential, per_kg = h.energies(xp, self._shares(p))
        loads = self.Side(
            **on_side(s.m.links["rocker"], hand, (-forces[0], forces[walls], forces[-1])),
            **rod_motions(xp, hand, *self._lines(axes, h.data.rods.lengths, h.data.state[1], accelerations)),
            web_pull=functools.reduce(xp.minimum, least[walls:]),
            wall_pull=functools.reduce(xp.minimum, least[:walls]),
            slack_share=sum(slack) * (1.0 / self.number),
            fold_largest=_largest_fold(xp, theta),
            drift=h.gap.length(xp),
            kinetic_energy=kinetic,
            potential_energy=potential,
            energy_residual=kinetic + potential - due,
            energy_per_kg=per_kg,
            **{f"pull_{k + 1}": pull for k, pull in enumerate(pulls)},
            **{f"fold_{k + 1}": fold for k, fold in enumerate(folds)},
        )
        return loads, -forces[0]

    def _lines(
        self, axes: Sequence[Vec2], lengths: Sequence[Any], omega: Sequence[Any], rates: Sequence[Any]
    ) -> Iterator[tuple[Vec2, Any, Any]]:
        """Of the lines from A1 to B and from A2 to B, which are wall and web if each is one rod: vector [m], angular
        speed [rad/s] and acceleration [rad/s2], from unit vectors, lengths, speeds and accelerations of the rods."""
        for sense, rods in ((1.0, slice(self.walls)), (-1.0, slice(self.walls, None))):
            along = moving = turning = ZERO
            for u, l, w, rate in zip(axes[rods], lengths[rods], omega[rods], rates[rods], strict=True):
                along, moving = along.plus(u, sense * l), moving.plus(u.turned(), sense * l * w)
                turning = turning + (u.turned() * rate - u * (w * w)) * (sense * l)
            per_square = 1.0 / (along.squared() + _NO_LINE)
            w = along.cross(moving) * per_square
            yield along, w, (along.cross(turning) - 2.0 * w * along.dot(moving)) * per_square

    def probes(self, xp: Any, p: Any, u: Any, s: Any, a: Any) -> dict[str, Any]:
        """The outputs of the machine at the state `s` and the crank acceleration `a` [rad/s2]."""
        reactions = s.reactions(a)
        sides: dict[str, Any] = {}
        for side, names in NAMES.items():
            sides[side], support = self._side(xp, p, s, a, side, getattr(s.x, side).energy_due)
            reactions[names.a1, names.wall] = support
        left, right = sides.values()
        chains = s.chains.values()
        at_a2, at_a1 = (
            sum(getattr(h.chain, moment) for h in chains) for moment in ("moment_at_end", "moment_at_start")
        )
        fields = running(s, a)
        fields["kinetic_energy"] += left.kinetic_energy + right.kinetic_energy
        fields["potential_energy"] += left.potential_energy + right.potential_energy
        fields["dissipated_power"] += sum(h.lost_power() for h in chains)
        if self.number == LEAST:
            for h in chains:
                (wall, web), _ = h.data.state
                fields["margin"] = xp.minimum(fields["margin"], xp.abs(xp.sin(web - wall)))
        return {
            **fields,
            "rocker": Rocker(
                **rocker_motion(xp, s, a),
                **coupler_force(s, reactions),
                **rocker_load(p, left, right, at_a2),
            ),
            **sides,
            **on_drive(xp, p, s, a, reactions, at_a1),
        }

    def constrained_states(self, xp: Any, p: Any, u: Any, x: Any, q: Any, w: Any) -> list[Any]:
        """States with which both chains end at A2 and move with it, by the smallest change in the metric of the
        masses. Where the drive has corrected its speed, the change is a jolt from the rocker; its work enters
        `energy_due`."""
        m = self.mechanism(xp, p, u, self.split(x), q)
        values: list[Any] = []
        for side in SIDES:
            theta, omega, work = m.linkage.loads[side].close(xp, m, w)
            values += [*theta, *omega, getattr(x, side).energy_due + work]
        return values

    # -- start

    @property
    def unknowns(self) -> int:
        """Number of unknowns of the chains at rest; two rods have none, as they stand in the position of the dyad."""
        return 0 if self.number == LEAST else 6

    def _reaches(self, xp: Any, p: Any, u: Any, q: Any) -> Iterator[tuple[Any, Any]]:
        """The vector from A1 to A2 of each organ in parts of its length, of the right one mirrored."""
        pins, whole = Mechanism(xp, chain_unit.drive(p, u, (), {}), q).pins, p.l1 + p.l2
        for names in NAMES.values():
            way = pins["A2"].p - pins[names.a1].p
            yield way.x * names.hand / whole, way.y / whole

    def guess(self, xp: Any, p: Any, u: Any, q: Any) -> list[Any]:
        """First guess of the unknowns."""
        if not self.unknowns:
            return []
        return [z for reach in self._reaches(xp, p, u, q) for z in hanging_chain.guess(xp, reach)]

    def improved(self, xp: Any, p: Any, u: Any, q: Any, z: Sequence[Any]) -> list[Any]:
        """The unknowns after one more round."""
        sides = zip(self.rods(p, u), self._reaches(xp, p, u, q), (z[:3], z[3:]), strict=True)
        return [
            value
            for rods, reach, unknowns in sides
            for value in hanging_chain.hang(xp, rods, reach, unknowns)
        ]

    def start_states(
        self, xp: Any, p: Any, u: Any, q: Any, w: Any, z: Sequence[Any], rods_start: Any = None
    ) -> dict[str, Any]:
        """States of both sides: hanging at rest, or as in `rods_start`; then changed so that they end at A2 and move
        with it."""
        states: list[Any] = []
        bars = None if self.unknowns else Mechanism(xp, ChamberForces.linkage(xp, p, u), q).links
        for k, (rods, names) in enumerate(zip(self.rods(p, u), NAMES.values(), strict=True)):
            if bars is not None:
                theta = hanging_chain.two_rods(xp, bars[names.wall], bars[names.web])
            else:
                theta = hanging_chain.resting(xp, rods, names.hand, z[3 * k : 3 * k + 3])
            states.append((theta, [0.0 * theta[0]] * self.number))
        if rods_start is not None:
            states = [self._start_state(rods_start, *hung) for hung in zip(SIDES, states, strict=True)]
        m = self.mechanism(xp, p, u, states, q)
        # closed once only: a chain without a hanging position keeps a gap, which `start_limits` refuses
        states = [m.linkage.loads[side].close(xp, m, w)[:2] for side in SIDES]
        m = self.mechanism(xp, p, u, states, q)
        sides: dict[str, Any] = {}
        for side, (theta, omega), h in zip(SIDES, states, self.hold(xp, m, w), strict=True):
            kinetic, potential, _ = h.energies(xp, self._shares(p))
            sides[side] = self._layout.instance([*theta, *omega, kinetic + potential])
        return sides

    def _start_state(self, rods_start: Any, side: str, hanging: State) -> State:
        """Angles and speeds of a side, of `rods_start` or of the hanging chain."""
        N, share = self.number, rods_start.given
        start = self._start_layout.values(getattr(rods_start, side))
        values = [
            (1.0 - share) * rest + share * chosen
            for rest, chosen in zip((*hanging[0], *hanging[1]), start, strict=True)
        ]
        return values[:N], values[N:]

    def start_limits(self, xp: Any, p: Any, u: Any, x: Any, q: Any) -> Iterator[tuple[Any, Any, Any]]:
        """Limits of each side: the chain ends at A2; and if it starts at rest, no rods touch the stops between
        them."""
        moving = p.rods_start.given if hasattr(p, "rods_start") else 0.0
        for h in self.hold(xp, self.mechanism(xp, p, u, self.split(x), q), 0.0):
            yield h.gap.length(xp), -math.inf, _CLOSED
            yield _largest_fold(xp, h.data.state[0]), -math.inf, p.organ.fold_limit + _ANY_FOLD * moving


def _largest_fold(xp: Any, theta: Sequence[Any]) -> Any:
    return functools.reduce(xp.maximum, [xp.abs(outer - inner) for inner, outer in pairwise(theta)])
