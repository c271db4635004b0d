"""The chain unit with its organs as true chains: N rods a side between wall hinge A1 and web hinge A2, with states.

Symbols as in `chainunit.machines.chain_unit`, of the chain as in `chainunit.groups.chain`: rods are numbered from A1,
the first `walls` of them are the wall, the others the web; theta is the angle of a rod from the downward vertical,
positive towards +x. The drive is that of the two-bar machine. A2 moves as the crank says, with the acceleration
p1 a + p2 w^2 (derivatives by the crank angle), so that each chain adds to the load port

    J = p1 . Phi^-1 p1,     tau_bias = p1 . Phi^-1 (p2 w^2 - beta) + t1 m_A2,

with the compliance Phi and the bias beta of the recursion at A2, and the moment m_A2 of the pin there.

Slopes of the port are taken along the motion, in which the chains move, too. With a rate of change D at the present
speed and a = 0,

    tau_bias_dphi = D tau_bias w^3/(w^4 + W_SMALL^4),   dJ_dphi likewise (at the crank),

which is the plain derivative by the angle for two rods, and

    tau_bias_dw = d tau_bias/d w + (d tau_bias/d omega) . (d alpha/d a),

as the rods follow a change of the speed.

A chain that does not quite end at A2, through errors of integration, is drawn there: the wanted acceleration of its
end has the addition 2 CLOSING (speed that is missing) + CLOSING^2 (way that is missing). Outputs are without it: at a
communication point the drive has just corrected its speed, and the chain follows in the next step only.

Pin friction acts in the four pins of the drive alone; in those of the chains it is the viscous damping of `organ`.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from types import MappingProxyType
from typing import Any, NamedTuple

from ..engines import Dual, dual, slope
from ..errors import InputError
from ..groups import chain
from ..groups.loads import Effect, Resistance, wrench_at
from ..integrate import Solver
from ..mechanism.linkage import Linkage
from ..mechanism.machine import MachineState, Mechanism
from ..model import Model, Part, Requirement
from ..planar import ZERO, Link, Motion, Vec2
from ..ports import PortSlopes
from ..quantities import Layout, Value, declaration, group, quantity
from . import chain_unit
from .chain_unit import (
    SIDES,
    ChamberForces,
    Inputs,
    Outputs,
    Rocker,
    on_drive,
    rocker_load,
    rocker_motion,
    supports,
)

W_SMALL = 0.01
"""Speed of the crank [rad/s] below which the slopes by the angle tend to zero."""
CLOSING = 20.0
"""Rate at which a chain that has drifted off A2 is drawn back [1/s]."""
_CLOSED = 1e-6
"""Gap at the start above which a chain does not hang [m]."""
_NO_PULL = 1e-6  # N, over which a rod turns from pulled to slack
LEAST, MOST = 2, 24
"""Rods of an organ."""


@declaration
class OrganLaw:
    """What damps and bounds the rods of a chain; alike on both sides."""

    eta: Value = quantity(
        "N.m2.s/rad",
        "damping of the inner pins times the mean length of the rods beside each; assumed",
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
        "stiffness of the stop behind it, whose moment grows with the square of the angle; assumed",
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
    solver: Solver = group(Solver, "internal integrator", default=Solver(max_steps=1e5))


@declaration
class ChainSide(chain_unit.Side):
    """Loads of one organ as a chain."""

    slack_share: Value = quantity("1", "share of the rods whose mean axial pull is below zero")
    fold_largest: Value = quantity("rad", "largest angle between neighbouring rods")
    drift: Value = quantity(
        "m",
        "distance between the end of the chain and A2, in Co-Simulation behind the projection of each step",
    )
    kinetic_energy: Value = quantity("J", "kinetic energy")
    potential_energy: Value = quantity(
        "J", "potential energy, of weights zero at the level of C, and of folded rods", nominal=100.0
    )
    energy_residual: Value = quantity(
        "J",
        "energy that is there beyond that at the start and what came and went since",
        nominal=1000.0,
    )
    energy_per_kg: Value = quantity("J/kg", "energy of a kilogram of material on its place")


class Hung:
    """A chain at one state on a rocker that moves in a known way, with the material and the force on it.

    `chain` is solved for one acceleration of the crank; `wanted` is the acceleration of A2 without the crank's part
    p1 a. `inertia` and `torque` are its parts of the load port at the crank.
    """

    __slots__ = (
        "a2", "at_start", "chain", "missing", "processing", "resisted", "rods", "state", "turn", "walls", "wanted"
    )  # fmt: skip

    def __init__(
        self,
        xp: Any,
        p: Any,
        rods: chain.Rods,
        walls: int,
        a1: Vec2,
        a2: Motion,
        turn: Any,
        w: Any,
        state: tuple[Sequence[Any], Sequence[Any]],
        loads: Any,
        a: Any = 0.0,
        closing: float = 0.0,
    ) -> None:
        """
        Parameters
        ----------
        walls : number of rods in the wall
        a2, turn : motion of A2, and rotation of the rocker per rotation of the crank
        w, a : speed of the crank [rad/s], and the acceleration for which `chain` is solved [rad/s2]
        state : angles and speeds of the rods
        loads : `SideLoads`
        closing : rate at which the chain is drawn to A2 [1/s]
        """
        self.rods, self.walls, self.state = rods, walls, state
        self.a2, self.turn = a2, turn
        theta, omega = state
        pins = chain.pins(rods.lengths, theta, omega, xp)
        v, end = pins[walls].p1, pins[-1]
        per_speed = Resistance("B", loads.processing_force, p.processing).per_speed(xp, v.squared())
        self.processing, self.resisted = v * (-per_speed), v.squared() * per_speed
        self.missing = self.a2.p - a1 - end.p
        late = self.a2.p1 * w - end.p1
        self.wanted = self.a2.p2 * (w * w) + late * (2.0 * closing) + self.missing * (closing * closing)
        self.at_start = [ZERO] * len(rods)
        self.at_start[walls] = self.processing
        self.chain = chain.Chain(
            xp, rods, theta, omega, p.g, self.turn * w, self.wanted + self.a2.p1 * a, self.at_start
        )

    def per_acceleration(self) -> Vec2:
        """Force at A2 by the acceleration of the crank [N s2]."""
        return self.chain.sweep.compliance.solve(self.a2.p1)

    def inertia(self) -> Any:
        """What it adds to the reflected inertia at the crank [kg m2]."""
        return self.a2.p1.dot(self.per_acceleration())

    def torque(self) -> Any:
        """What it adds to the torque at the crank [N m]."""
        return self.a2.p1.dot(self.chain.forces[-1]) + self.turn * self.chain.moment_at_end

    def lost(self) -> Any:
        """Power that damping and processing take [W]."""
        return self.chain.damped + self.resisted

    def at(self, a: Any) -> tuple[list[Any], list[Vec2]]:
        """Accelerations of the rods and forces at the pins, see `chain.Sweep.back`, at the crank acceleration `a`."""
        sweep = self.chain.sweep
        return sweep.back(sweep.force(self.wanted + self.a2.p1 * a))


def _rods(p: Any, counts: tuple[int, int], masses: Any, loads: Any) -> chain.Rods:
    """Wall and web with the material on them, as uniform rods: paper 000's organ in more pieces."""
    walls, webs = counts
    on_web = p.web_share * loads.material_mass
    lengths = [p.l1 / walls] * walls + [p.l2 / webs] * webs
    each = [(masses.wall_mass + (loads.material_mass - on_web)) / walls] * walls
    each += [(masses.web_mass + on_web) / webs] * webs
    inner = [2.0 * p.organ.eta / (one + other) for one, other in pairwise(lengths)]
    damping = [p.organ.end_damping, *inner, p.organ.end_damping]
    return chain.Rods(lengths, each, damping, p.rod_inertia, p.organ.fold_limit, p.organ.fold_stiffness)


def _energies(xp: Any, p: Any, hung: Hung, a1: Vec2) -> tuple[Any, Any, Any]:
    """Kinetic and potential energy [J], and the energy of a kilogram of material on its place [J/kg]."""
    (theta, omega), rods = hung.state, hung.rods
    share = p.web_share / (len(rods) - hung.walls), (1.0 - p.web_share) / hung.walls
    kinetic, potential, per_kg = 0.0, hung.chain.folding, 0.0
    p0, v0 = a1, ZERO
    for k, (l, m, angle, w) in enumerate(zip(rods.lengths, rods.masses, theta, omega, strict=True)):
        s, c = xp.sin(angle), xp.cos(angle)
        half, across = Vec2(s, -c) * (0.5 * l), Vec2(c, s) * (0.5 * l * w)
        moving = 0.5 * (v0 + across).squared() + rods.inertia * (l * l * w * w) * (1.0 / 24.0)
        height = p.g * (p0 + half).y
        kinetic, potential = kinetic + m * moving, potential + m * height
        per_kg = per_kg + share[k < hung.walls] * (moving + height)
        p0, v0 = p0 + half * 2.0, v0 + across * 2.0
    return kinetic, potential, per_kg


class HangingOrgan(NamedTuple):
    """A chain as a load of the rocker: of the `side`, of these rods, `walls` of them in the wall, in this state, with
    these `SideLoads`."""

    p: Any
    side: str
    rods: chain.Rods
    walls: int
    state: tuple[Sequence[Any], Sequence[Any]]
    loads: Any
    by_reactions: bool = False

    def hung(self, xp: Any, m: Mechanism, w: Any, a: Any = 0.0, closing: float = 0.0) -> Hung:
        """The chain where the rocker holds it; see `Hung`."""
        a1, turn = m.pins[f"A1 {self.side}"].p, m.links["rocker"].t1
        return Hung(
            xp, self.p, self.rods, self.walls, a1, m.pins["A2"], turn, w, self.state, self.loads, a, closing
        )

    def effect(self, xp: Any, m: Mechanism, w: Any, reactions: Any) -> Effect:
        """See `chainunit.groups.loads.Acting`."""
        h = self.hung(xp, m, w)
        at_a2 = wrench_at(m, "A2", -h.chain.forces[-1])
        return Effect(
            (at_a2._replace(moment=at_a2.moment - h.chain.moment_at_end),),
            held=h.torque(),
            inertia=h.inertia(),
            inertial=(wrench_at(m, "A2", -h.per_acceleration()),),
            source=h,
        )


class State(MachineState):
    """The machine at one point: the drive as mechanism, and both chains as loads on it."""

    __slots__ = ("_slopes", "organs")

    def __init__(self, xp: Any, m: Mechanism, w: Any, loads: Any = None) -> None:
        super().__init__(xp, m, w, loads)
        self.organs: tuple[Hung, ...] = tuple(self.effects[f"{side} organ"].source for side in SIDES)
        self._slopes: tuple[Any, Any, Any] | None = None

    def _moving(self, omegas: Sequence[Any], rates: Sequence[Any]) -> dict[str, Any]:
        """The loads with chains that move at these rates of their angles (none: they stand) and speeds."""
        loads = dict(self._loads)
        for side, h, omega, rate in zip(SIDES, self.organs, omegas, rates, strict=True):
            theta, speeds = h.state
            angles = theta if omega is None else [Dual(x, v) for x, v in zip(theta, omega, strict=True)]
            moving = angles, [Dual(v, a) for v, a in zip(speeds, rate, strict=True)]
            loads[f"{side} organ"] = loads[f"{side} organ"]._replace(state=moving)
        return loads

    def along(self, q: Any) -> tuple[Any, Any, Any]:
        """tau_bias_dphi, tau_bias_dw and dJ_dphi at the crank angle `q`, along the motion."""
        if self._slopes is None:
            w, engine = self.w, dual(self._xp)
            rates = [h.chain.rates for h in self.organs]
            moved = Mechanism(engine, self.m.linkage, Dual(q, w))
            along = MachineState(engine, moved, w, self._moving([h.state[1] for h in self.organs], rates))
            by_a = [
                [one - rate for one, rate in zip(h.at(1.0)[0], h.chain.rates, strict=True)]
                for h in self.organs
            ]
            quicker = MachineState(engine, self.m, Dual(w, 1.0), self._moving([None, None], by_a))
            w2 = w * w
            share = w * w2 / (w2 * w2 + W_SMALL * W_SMALL * W_SMALL * W_SMALL)
            self._slopes = slope(along.bias) * share, slope(quicker.bias), slope(along.J) * share
        return self._slopes


def _side(
    xp: Any, p: Any, h: Hung, a1: Vec2, hand: float, m: Mechanism, forces: list[Vec2], given: Any
) -> dict[str, Any]:
    """The fields of the declared side of an organ; `hand` is +1 on the left and -1 on the right."""
    theta, walls, N = h.state[0], h.walls, len(h.rods)
    axes = [Vec2(xp.sin(angle), -xp.cos(angle)) for angle in theta]
    before = [u.dot(forces[k] - h.at_start[k]) for k, u in enumerate(axes)]
    after = [u.dot(forces[k + 1]) for k, u in enumerate(axes)]
    least = [xp.minimum(one, other) for one, other in zip(before, after, strict=True)]
    pulls = [0.5 * (one + other) for one, other in zip(before, after, strict=True)]
    folds = [theta[k] - theta[k - 1] for k in range(1, N)]
    slack = [xp.maximum(0.0, xp.minimum(1.0, -pull * (1.0 / _NO_PULL))) for pull in pulls]
    kinetic, potential, per_kg = _energies(xp, p, h, a1)
    return {
        **chain_unit.on_side(m.links["rocker"], hand, (-forces[0], forces[walls], forces[-1])),
        "web_pull": functools.reduce(xp.minimum, least[walls:]),
        "wall_pull": functools.reduce(xp.minimum, least[:walls]),
        "slack_share": sum(slack) * (1.0 / N),
        "fold_largest": _largest_fold(xp, theta),
        "drift": h.missing.length(xp),
        "kinetic_energy": kinetic,
        "potential_energy": potential,
        "energy_residual": kinetic + potential - given,
        "energy_per_kg": per_kg,
        **{f"pull_{k + 1}": pull for k, pull in enumerate(pulls)},
        **{f"fold_{k + 1}": fold for k, fold in enumerate(folds)},
    }


def _largest_fold(xp: Any, theta: Sequence[Any]) -> Any:
    return functools.reduce(xp.maximum, [xp.abs(outer - inner) for inner, outer in pairwise(theta)])


def _bars(xp: Any, first: Link, second: Link) -> list[Any]:
    """Angles of wall and web as two rods."""
    wall, web = first.u, -second.u
    angle = xp.atan2(wall.x, -wall.y)
    return [angle, angle + xp.atan2(wall.cross(web), wall.dot(web))]


def _gradient(b: Sequence[Any], l: Sequence[Any], H: Any, v: Any, reach: tuple[Any, Any], xp: Any) -> Any:
    """The function whose minimum is the hanging position, see `machines.hanging`, with its derivatives by the
    horizontal force H > 0 and the height v at which the pull of the chain is level, both in parts of the weight."""
    value, by_h, by_v = v * reach[1] - H * reach[0], -reach[0], reach[1]
    hh, hv, vv = 0.0, 0.0, 0.0
    for middle, length in zip(b, l, strict=True):
        m = v - middle
        size = xp.sqrt(H * H + m * m)
        x, y, k = H / size, m / size, length / size
        value, by_h, by_v = value + length * size, by_h + length * x, by_v + length * y
        hh, hv, vv = hh + k * y * y, hv - k * x * y, vv + k * x * x
    return value, by_h, by_v, hh, hv, vv


def _shape(rods: chain.Rods) -> tuple[list[Any], list[Any]]:
    """Lengths in parts of the whole length, and weight before the middle of each rod in parts of the whole."""
    whole, weight = sum(rods.lengths), sum(rods.masses)
    middles, before = [], 0.0
    for m in rods.masses:
        middles.append((before + 0.5 * m) / weight)
        before = before + m
    return [l / whole for l in rods.lengths], middles


def _hang(xp: Any, rods: chain.Rods, reach: tuple[Any, Any], z: Sequence[Any]) -> list[Any]:
    """One round towards the hanging position of z = H, v and what holds back: Newton's method on log H and v, held
    back as long as it does not descend (Levenberg and Marquardt); H cannot cross zero."""
    H, v, held = z
    l, b = _shape(rods)
    value, by_h, by_v, hh, hv, vv = _gradient(b, l, H, v, reach, xp)
    gs = H * by_h
    ss, sv, vv = H * H * hh + xp.maximum(gs, 0.0) + held * H, H * hv, vv + held
    det = ss * vv - sv * sv
    farther = H * (1.0 + xp.maximum(-0.7, xp.minimum(1.0, (sv * by_v - vv * gs) / det)))
    higher = v + (sv * gs - ss * by_v) / det
    after = _gradient(b, l, farther, higher, reach, xp)[0]
    # 1 where it descends or stands, 0 where not
    taken = xp.minimum(1.0, xp.maximum(0.0, (value - after + 2e-15) * 1e18))
    return [
        H + taken * (farther - H), v + taken * (higher - v), xp.minimum(1e6, held * (4.0 - 3.9 * taken))
    ]  # fmt: skip


def flexible(walls: int, webs: int) -> type[Model]:
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
def _flexible(walls: int, webs: int) -> type[Model]:
    N, counts = walls + webs, (walls, webs)

    def declared(name: str, base: tuple[type, ...], fields: Sequence[tuple[str, Any, Any]]) -> Any:
        return dataclasses.make_dataclass(name, fields, bases=base, frozen=True, kw_only=True)

    def numbered(
        name: str, number: int, unit: str, words: str, nominal: float | None
    ) -> list[tuple[str, Any, Any]]:
        return [
            (f"{name}_{k}", Value, quantity(unit, words.format(k, k + 1), nominal=nominal))
            for k in range(1, number + 1)
        ]

    def both(of: type) -> list[tuple[str, Any, Any]]:
        return [(name, of, group(of, f"{name} organ")) for name in ("left", "right")]

    angles = numbered(
        "theta",
        N,
        "rad",
        "angle of rod {}, counted from A1, from the downward vertical, positive towards +x",
        None,
    )
    due = quantity(
        "J",
        "energy at the start, and what came and went since by rocker, damping and processing",
        nominal=100.0,
    )
    side_states = declared(
        "ChainStates",
        (),
        [*angles, *numbered("omega", N, "rad/s", "speed of rod {}", 10.0), ("energy_due", Value, due)],
    )
    side_loads = declared(
        "ChainLoads",
        (ChainSide,),
        [
            *numbered("pull", N, "N", "mean axial pull in rod {}", 100.0),
            *numbered("fold", N - 1, "rad", "angle of rod {1} from rod {0}", None),
        ],
    )
    states = declared("States", (), both(side_states))
    outputs = declared("ChainOutputs", (Outputs,), both(side_loads))
    of_side = Layout(side_states)

    def split(x: Any) -> tuple[Any, Any]:
        """Angles and speeds of the rods, left and right."""
        left, right = of_side.values(x.left), of_side.values(x.right)
        return (left[:N], left[N : 2 * N]), (right[:N], right[N : 2 * N])

    def rods(p: Any, u: Any) -> tuple[chain.Rods, chain.Rods]:
        return _rods(p, counts, p.left, u.left), _rods(p, counts, p.right, u.right)

    def linkage(p: Any, u: Any, state: Sequence[Any]) -> Linkage:
        organs = {
            f"{side} organ": HangingOrgan(p, side, each, walls, own, getattr(u, side))
            for side, each, own in zip(SIDES, rods(p, u), state, strict=True)
        }
        return chain_unit.drive(p, u, (), organs)

    def hung(xp: Any, m: Mechanism, w: Any, a: Any = 0.0, closing: float = 0.0) -> Iterator[Hung]:
        for side in SIDES:
            yield m.linkage.loads[f"{side} organ"].hung(xp, m, w, a, closing)

    def results(xp: Any, p: Any, u: Any, x: Any, s: State) -> Any:
        a = u.a / p.ratio
        forces = [h.at(a)[1] for h in s.organs]
        left, right = (
            side_loads(**_side(xp, p, h, a1, hand, s.m, each, state.energy_due))
            for h, a1, hand, each, state in zip(
                s.organs, supports(p).values(), (1.0, -1.0), forces, (x.left, x.right), strict=True
            )
        )
        margin = s.margin()
        if N == LEAST:
            for theta, _ in (h.state for h in s.organs):
                margin = xp.minimum(margin, xp.abs(xp.sin(theta[1] - theta[0])))
        reactions = s.reactions(a)
        for side, each in zip(SIDES, forces, strict=True):
            reactions[f"A1 {side}", f"{side} wall"] = -each[0]
        at_a2, at_a1 = (
            sum(getattr(h.chain, moment) for h in s.organs) for moment in ("moment_at_end", "moment_at_start")
        )
        return outputs(
            tau=s.torque(a) / p.ratio,
            tau_bias=s.bias / p.ratio,
            J=s.J / (p.ratio * p.ratio),
            dJ_dphi=s.along(u.phi / p.ratio)[2] / (p.ratio * p.ratio * p.ratio),
            phi0=u.phi,
            w0=u.w,
            rocker=Rocker(**rocker_motion(xp, s, a), **rocker_load(p, left, right, at_a2)),
            left=left,
            right=right,
            **on_drive(xp, p, s, a, reactions, at_a1),
            power=s.torque(a) * s.w,
            kinetic_energy=0.5 * (s.J - sum(h.inertia() for h in s.organs)) * (s.w * s.w)
            + left.kinetic_energy
            + right.kinetic_energy,
            potential_energy=s.held_energy + left.potential_energy + right.potential_energy,
            dissipated_power=s.lost * s.w + sum(h.lost() for h in s.organs),
            margin=margin,
        )

    def port_slopes(xp: Any, p: Any, u: Any, x: Any, s: State) -> PortSlopes:
        by_angle, by_speed, _ = s.along(u.phi / p.ratio)
        per_motor_turn = 1.0 / (p.ratio * p.ratio)
        return PortSlopes(tau_bias_dphi=by_angle * per_motor_turn, tau_bias_dw=by_speed * per_motor_turn)

    def bare_drive(xp: Any, p: Any, u: Any, q: Any) -> Mechanism:
        return Mechanism(xp, chain_unit.drive(p, u, (), {}), q)

    def reaches(xp: Any, p: Any, m: Mechanism) -> Iterator[tuple[Any, Any]]:
        """From A1 to A2 in parts of the length, the right organ mirrored."""
        a2, whole = m.pins["A2"].p, p.l1 + p.l2
        for hand, a1 in zip((1.0, -1.0), supports(p).values(), strict=True):
            yield (a2 - a1).x * hand / whole, (a2 - a1).y / whole

    class ChainUnitFlexible(Model):
        """The chain unit with its organs as chains of rods, as many as `flexible` was told.

        Inputs, outputs and load port are those of ChamberForces, and connect alike. In a co-simulation the inputs phi
        and w run along w and a inside a step, and its own integrator controls its error to `tolerance`. In Model
        Exchange phi, w and a must be set whenever derivatives are evaluated. Rods are counted from A1; a rod is slack
        where its mean axial pull is below zero.
        """

        name = "ChainUnitFlexible"
        built_by = f"flexible({walls}, {webs})"
        description = (
            f"Forces in a chain unit whose organs are chains of {N} rods, {walls} in the wall and {webs} in the web: "
            "from motor angle and speed to torque, load port and every support reaction"
        )
        Parameters = Parameters
        Inputs = Inputs
        States = states
        terminals = ChamberForces.terminals
        input_rates = MappingProxyType({"phi": "w", "w": "a"})
        controlled = True
        # two rods stand where the dyad does
        start_unknowns, start_rounds = (0, 0) if N == LEAST else (6, 100)
        start_required = tuple(
            requirement
            for one in ("left", "right")
            for requirement in (
                Requirement(
                    f"distance of the {one} chain's end from A2 at the start",
                    "m",
                    "it does not hang, as a rod would have to push (widen z or shorten the rods)",
                    ("z", "l1", "l2", "e"),
                ),
                Requirement(
                    f"largest angle between rods of the {one} organ at the start",
                    "rad",
                    "they rest against each other (raise organ.fold_limit, widen z, or take more rods)",
                    ("z", "l1", "l2", "e"),
                ),
            )
        )
        required = (
            *ChamberForces.required,
            *(
                Requirement(
                    f"{one}.{part}_mass", "kg", "a chain without mass has no motion of its own; for an organ that is "
                    "not there take ChamberForces"
                )
                for one in ("left", "right")
                for part in ("wall", "web")
            ),
        )  # fmt: skip

        @staticmethod
        def requirements(xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
            """Those of two bars, and masses that move."""
            yield from ChamberForces.requirements(xp, p)
            for masses in (p.left, p.right):
                yield masses.wall_mass, 0.0, math.inf
                yield masses.web_mass, 0.0, math.inf

        @staticmethod
        def start_limits(xp: Any, p: Any, u: Any, x: Any) -> Iterator[tuple[Any, Any, Any]]:
            """Of each side: the chain ends at A2, and no stop between rods is met."""
            m = Mechanism(xp, linkage(p, u, split(x)), u.phi / p.ratio)
            for h in hung(xp, m, 0.0):
                yield h.missing.length(xp), -math.inf, _CLOSED
                yield _largest_fold(xp, h.state[0]), -math.inf, p.organ.fold_limit

        @staticmethod
        def internal_step(xp: Any, p: Any) -> Any:
            """20 ms: a quarter of a radian of the crank at 12 rad/s."""
            return 0.02

        @staticmethod
        def tolerance(xp: Any, p: Any) -> Any:
            """As the parameter says."""
            return p.tolerance

        @staticmethod
        def start_guess(xp: Any, p: Any, u: Any) -> list[Any]:
            """Of each side H, the pull of a shallow parabola, v = 1/2, and what holds Newton's method back."""
            found: list[Any] = []
            if N == LEAST:
                return found
            for x, y in reaches(xp, p, bare_drive(xp, p, u, u.phi / p.ratio)):
                spare = xp.maximum(1e-9, 1.0 - xp.sqrt(x * x + y * y))
                found += [xp.maximum(x, 0.05) / xp.sqrt(24.0 * spare), 0.5, 1.0]
            return found

        @staticmethod
        def start_improved(xp: Any, p: Any, u: Any, z: Sequence[Any]) -> list[Any]:
            """One round of each side; see `_hang`."""
            where = reaches(xp, p, bare_drive(xp, p, u, u.phi / p.ratio))
            left, right = (
                _hang(xp, each, reach, z[3 * k : 3 * k + 3])
                for k, (each, reach) in enumerate(zip(rods(p, u), where, strict=True))
            )
            return [*left, *right]

        @classmethod
        def started(cls, xp: Any, p: Any, u: Any, z: Sequence[Any]) -> Any:
            """Hanging at rest, and taken along by A2 where the crank turns."""
            of = ChamberForces.linkage(p, u) if N == LEAST else chain_unit.drive(p, u, (), {})
            m, w = Mechanism(xp, of, u.phi / p.ratio), u.w / p.ratio
            found = []
            for k, (side, hand, each) in enumerate(zip(SIDES, (1.0, -1.0), rods(p, u), strict=True)):
                if N == LEAST:
                    theta = _bars(xp, m.links[f"{side} wall"], m.links[f"{side} web"])
                else:
                    H, v = z[3 * k : 3 * k + 2]
                    theta = [xp.atan2(hand * H, v - b) for b in _shape(each)[1]]
                hanging = theta, [0.0 * theta[0]] * N
                # once: of a chain that was not found to hang it leaves a gap, see `start_limits`
                found.append(_closed(xp, each, side, m, w, hanging)[:2])
            m = Mechanism(xp, linkage(p, u, found), u.phi / p.ratio)
            sides = []
            for (theta, omega), h, a1 in zip(found, hung(xp, m, w), supports(p).values(), strict=True):
                kinetic, potential, _ = _energies(xp, p, h, a1)
                sides.append(of_side.instance([*theta, *omega, kinetic + potential]))
            return states(left=sides[0], right=sides[1])

        @staticmethod
        def closed(xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
            """Both chains end at A2 and move with it, by the smallest change in the metric of the masses. Where the
            drive has corrected its speed this is a jolt from the rocker, whose work counts."""
            m, w = bare_drive(xp, p, u, u.phi / p.ratio), u.w / p.ratio
            found: list[Any] = []
            dues = x.left.energy_due, x.right.energy_due
            for side, each, state, due in zip(SIDES, rods(p, u), split(x), dues, strict=True):
                theta, omega, work = _closed(xp, each, side, m, w, state)
                found += [*theta, *omega, due + work]
            return found

        @staticmethod
        def shared(xp: Any, p: Any, u: Any, x: Any) -> State:
            """The machine at the crank angle and speed that belong to the motor's."""
            m = Mechanism(xp, linkage(p, u, split(x)), u.phi / p.ratio)
            return State(xp, m, u.w / p.ratio)

        @staticmethod
        def derivatives(xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
            """Time derivatives of the states, in declared order."""
            w, a = u.w / p.ratio, u.a / p.ratio
            m = Mechanism(xp, linkage(p, u, split(x)), u.phi / p.ratio)
            rates: list[Any] = []
            for h in hung(xp, m, w, a, CLOSING):
                rates += [*h.state[1], *h.chain.rates, h.torque() * w - h.lost()]
            return rates

        parts = (
            Part(outputs, results, by_differences=frozenset(("dJ_dphi",))),
            Part(PortSlopes, port_slopes, by_differences=frozenset(Layout(PortSlopes).names)),
        )

    return ChainUnitFlexible


def _closed(
    xp: Any, rods: chain.Rods, side: str, m: Mechanism, w: Any, state: tuple[Any, Any]
) -> tuple[list[Any], list[Any], Any]:
    a1, a2 = m.pins[f"A1 {side}"], m.pins["A2"]
    return chain.jolted(xp, rods, *state, Motion(a2.p - a1.p, a2.p1 * w), 1)


ChainUnitFlexible = flexible(6, 2)
"""Eight rods, split as the start values' lengths want it."""
