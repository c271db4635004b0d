"""`ChainUnitMachine`: the chain unit in Python, with arrays as arguments and results."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from operator import itemgetter
from typing import Any, Self

import numpy as np

from ..core.declared_numbers import in_declared_unit, number_in, one_number
from ..core.engines import MATH, numpy_
from ..core.errors import GeometryError, check_choice, check_kind
from ..core.ports import PortSlopes
from ..core.quantities import Layout, Quantity, Variable
from ..mechanism.models import InverseMachine
from . import chain_unit
from .chain_organs import USUAL, OrganLaw
from .chain_unit import (
    RODS,
    SIDES,
    Chamber,
    ChamberForces,
    Feed,
    Inputs,
    Outputs,
    Parameters,
    Pulls,
    SideLoads,
)
from .crank_rocker import rocker_extremes
from .flexible import ChainedModel, flexible
from .hanging import Hanging, Modes, modes, rods, split
from .machine import Machine, admit, check_shapes
from .paper_ratios import RATIOS, of_ratios
from .parts import Stop

_XP = numpy_()
CHAIN_RODS = 32
"""Number of rods of an organ with which its lowest frequency agrees with that of a chain to a thousandth."""
EMPTY = SideLoads(material_mass=0.0, processing_force=0.0)
FREE = Stop()
_ROCKER = {
    name: Variable(name, f"{what} of the rocker", Quantity(unit, what))
    for name, what, unit in (
        ("psi", "angle", "rad"),
        ("w", "speed", "rad/s"),
        ("a", "acceleration", "rad/s2"),
    )
}


_SPEED = Variable("crank_speed", "speed of the crank", Quantity("rad/s", ""))


class ChainUnitMachine(Machine):
    """A chain unit with checked parameters; arguments, arrays and errors are those of `Machine`.

    Examples
    --------
    >>> machine = ChainUnitMachine.from_ratios(rho=0.1, lam=2 / 3, mu=0.6, zeta=0.5)
    >>> round(float(machine.forces(phi=0.5, w=3.0).tau), 2)
    -10.53
    """

    p: Parameters

    def __init__(
        self,
        parameters: Parameters | Mapping[str, float] | None = None,
        /,
        *,
        model: InverseMachine = ChamberForces,
        **values: Any,
    ) -> None:
        super().__init__(model, parameters, **values)

    @property
    def _kind(self) -> list[str]:
        model = self.model.root or self.model
        return [] if model is ChamberForces else [f"model={model.name}"]

    @classmethod
    def from_ratios(
        cls,
        rho: float,
        lam: float,
        mu: float,
        zeta: float,
        parameters: Mapping[str, float] | None = None,
        *,
        l: float = 1.5,
        l1: float = 1.35,
        **values: Any,
    ) -> Self:
        """The machine with the ratios and the frame of the papers 000 and 001.

        The ratios are rho = r/l, lam = h/l, mu = e/l1 and zeta = z/z_max with z_max = 2 l1 sqrt(1 - mu); l2 = l1 - e.
        The frame has c = sqrt(l^2 - r^2) and hy = h, so that crank and rocker are parallel at phi = 0.

        Raises
        ------
        InputError, GeometryError
            for a ratio out of its range, and for ratios that make no machine, with the ranges in which one of them
            would.
        """
        ratios = {"rho": rho, "lam": lam, "mu": mu, "zeta": zeta, "l": l, "l1": l1}
        numbers = {name: admit(RATIOS[name], one_number(RATIOS[name], x)) for name, x in ratios.items()}
        return of_ratios(lambda lengths: cls({**lengths, **(parameters or {}), **values}), numbers)

    def _inputs(
        self, phi: Any, w: Any, a: Any, left: SideLoads, right: SideLoads, stop: Stop = FREE
    ) -> Inputs:
        """The checked inputs with these loads, which may have places across the width."""
        for name, loads in (("left", left), ("right", right)):
            check_kind(name, loads, SideLoads)
        groups = {"left": left, "right": right, "stop": stop}
        values = {"phi": phi, "w": w, "a": a} | {
            f"{name}.{key}": x
            for name, group in groups.items()
            for key, x in Layout(type(group)).by_name(group).items()
        }
        inputs: Inputs = self.inputs(values)
        return inputs

    def forces(
        self,
        phi: Any,
        w: Any = 0.0,
        a: Any = 0.0,
        left: SideLoads = EMPTY,
        right: SideLoads = EMPTY,
        stop: Stop = FREE,
    ) -> Outputs:
        """Torque, load port (without slopes), energies and every reaction at motor angle `phi` [rad],
        speed `w` [rad/s] and acceleration `a` [rad/s2] (see `Outputs` for names and units).

        Raises
        ------
        InputError
            see the class.
        """
        out: Outputs = self._outputs(self._inputs(phi, w, a, left, right, stop))
        return out

    def slopes(
        self, phi: Any, w: Any = 0.0, left: SideLoads = EMPTY, right: SideLoads = EMPTY, stop: Stop = FREE
    ) -> PortSlopes:
        """Exact derivatives of `tau_bias` by motor angle and speed."""
        u = self._inputs(phi, w, 0.0, left, right, stop)
        return ChamberForces.parts[1].equations(_XP, self.p, u, None, self.state(u))

    def torque_by_reactions(
        self,
        phi: Any,
        w: Any = 0.0,
        a: Any = 0.0,
        left: SideLoads = EMPTY,
        right: SideLoads = EMPTY,
        stop: Stop = FREE,
    ) -> Any:
        """The motor torque without friction [N m], from the force passes group by group: the second route."""
        u = self._inputs(phi, w, a, left, right, stop)
        return self.state(u).torque_by_reactions(u.a / self.p.ratio) / self.p.ratio

    def friction_torque(
        self, phi: Any, w: Any, left: SideLoads = EMPTY, right: SideLoads = EMPTY, stop: Stop = FREE
    ) -> Any:
        """The part of `tau` against pin friction and joint damping [N m]."""
        state = self.state(self._inputs(phi, w, 0.0, left, right, stop))
        return state.effects["pins"].dissipative / self.p.ratio

    def energy_per_kg(self, side: str, phi: Any, w: Any) -> Any:
        """Kinetic and potential energy of one kilogram of material on the `side` ("left" or "right") [J/kg]: dE/dm,
        the factor of the feed in an energy balance (the energy is linear in the mass)."""
        check_choice("side", side, SIDES)
        kilogram = SideLoads(material_mass=1.0, processing_force=0.0)

        def energy(**loads: Any) -> Any:
            out = self.forces(phi, w, 0.0, **loads)
            return out.kinetic_energy + out.potential_energy

        return energy(**{side: kilogram}) - energy()

    @property
    def stored_per_unit(self) -> Mapping[str, Callable[[Mapping[str, Any]], Any]]:
        """See `Machine`: the material of both organs."""
        return {f"{side}.material_mass": partial(self._per_kg, side) for side in SIDES}

    def _per_kg(self, side: str, run: Mapping[str, Any]) -> Any:
        return self.energy_per_kg(side, run["phi0"], run["w0"])

    def chamber(
        self, psi: Any, w: Any = 0.0, a: Any = 0.0, left: SideLoads = EMPTY, right: SideLoads = EMPTY
    ) -> Chamber:
        """Loads of the organs at a rocker angle `psi` [rad], with speed `w` and acceleration `a` of the rocker,
        independent of the drive: for the papers' statics at +-12 degrees, beyond this drive's swing.

        For an array of angles, the loads of a side and of the rocker are NaN if that side cannot be assembled: the
        array may pass the limit.

        Raises
        ------
        GeometryError
            for a single angle at which a side cannot be assembled.
        InputError
            see the class.
        """
        loads, psi, w, a = self._at_rocker(psi, w, a, left, right)
        if np.ndim(psi) == 0:
            self._check_assembly(float(psi))
        with np.errstate(invalid="ignore"):
            return chain_unit.chamber(_XP, self.p, loads, psi, w, a)

    def _at_rocker(self, psi: Any, w: Any, a: Any, left: SideLoads, right: SideLoads) -> tuple[Any, ...]:
        """The loads and the motion of the rocker, checked."""
        loads = self._inputs(0.0, 0.0, 0.0, left, right)
        motion = {name: admit(_ROCKER[name], x) for name, x in (("psi", psi), ("w", w), ("a", a))}
        check_shapes(ChamberForces.input_layout.by_name(loads) | motion)
        return loads, motion["psi"], motion["w"], motion["a"]

    def _check_assembly(self, psi: float) -> None:
        """Refuse an angle `psi` of the rocker [rad] at which an organ does not reach from pin to pin."""
        p = self.p
        for side in ("left", "right"):
            span = float(np.hypot(*self._reach(side, psi)))
            low, high = abs(p.l1 - p.l2), p.l1 + p.l2
            if not low < span < high:
                raise GeometryError(
                    f"psi = {psi:g} rad: the {side} organ cannot be assembled, A1-A2 = {span:g} m; must be > "
                    f"{low:g} and < {high:g} m, l1 - l2 and l1 + l2"
                )

    def organ_rods(self, side: str, loads: SideLoads = EMPTY, number: int = CHAIN_RODS) -> tuple[Any, Any]:
        """Lengths [m] and masses [kg] of an organ as `number` rods, shape (number,), wall first, with the material on
        them. Wall and web have the numbers of rods that bring the rods nearest to equal length."""
        check_choice("side", side, SIDES)
        loads = getattr(self._inputs(0.0, 0.0, 0.0, loads, loads), side)
        lengths, masses = (self.p.l1, self.p.l2), chain_unit.organ_masses(self.p, side, loads)
        counts = split(lengths, number)
        length, mass = (np.repeat(np.divide(parts, counts), counts) for parts in (lengths, masses))
        return length, mass

    def hanging(self, side: str, psi: float, loads: SideLoads = EMPTY, number: int = CHAIN_RODS) -> Hanging:
        """An organ at rest as a chain of `number` rods, at the rocker angle `psi` [rad]. The right organ is returned
        mirrored, as a left organ at -psi.

        Raises
        ------
        GeometryError
            if the organ does not hang.
        """
        lengths, masses = self.organ_rods(side, loads, number)
        return rods(lengths, masses * self.p.g, self._reach(side, one_number(_ROCKER["psi"], psi)))

    def _reach(self, side: str, psi: float) -> Any:
        """The vector from A1 to A2 of a left organ, or of the mirrored right one [m]."""
        hand = 1.0 if side == "left" else -1.0
        return np.array([self.p.z + self.p.e * math.sin(hand * psi), -self.p.e * math.cos(psi)])

    def chain_modes(
        self, left: SideLoads = EMPTY, right: SideLoads = EMPTY, number: int = CHAIN_RODS
    ) -> Modes | None:
        """Small vibration of an organ as a chain of `number` rods, with the rocker held in the middle. Of the sides
        that have mass and hang, it is the one with the lowest frequency; None if there is no such side."""
        candidates = []
        for side, loads in (("left", left), ("right", right)):
            lengths, masses = self.organ_rods(side, loads, number)
            if self.p.g > 0.0 and np.all(masses > 0.0):
                try:
                    rest = self.hanging(side, 0.0, loads, number)
                except GeometryError:
                    continue
                candidates.append(modes(lengths, masses * self.p.g, rest, self.p.g))
        return min(candidates, key=lambda candidate: float(candidate.frequency[0]), default=None)

    def rocker_extremes(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """(psi, phi_crank) [rad] at the right and at the left extreme of the rocker."""
        p = self.p
        extremes = []
        for psi, sense in zip(rocker_extremes(MATH, p), (1.0, -1.0), strict=True):
            x, y = p.h * math.sin(psi) + p.c, -p.h * math.cos(psi) + p.hy
            extremes.append((psi, math.atan2(sense * x, sense * y) % (2.0 * math.pi)))
        return extremes[0], extremes[1]

    def organ_pulls(
        self, psi: Any, w: Any = 0.0, a: Any = 0.0, left: SideLoads = EMPTY, right: SideLoads = EMPTY
    ) -> Pulls:
        """Axial pull in the rods just inside their pins [N] at a rocker angle `psi` [rad], with speed `w` and
        acceleration `a` of the rocker; see `chain_unit.organ_pulls`."""
        return chain_unit.organ_pulls(_XP, self.p, *self._at_rocker(psi, w, a, left, right))

    def mean_pulls(
        self, crank_speed: Any, left: SideLoads = EMPTY, right: SideLoads = EMPTY, points: int = 720
    ) -> Any:
        """Mean pull in web and wall of each side with weight [N] over `points` angles of a crank turn at constant
        `crank_speed` [rad/s]: shape (rods, ..., points), webs first; see `chain_unit.organ_pulls`."""
        phi = np.linspace(0.0, 2.0 * math.pi * self.p.ratio, points, endpoint=False)
        speed = np.asarray(in_declared_unit(_SPEED, crank_speed))[..., None]
        # at constant speed the speed of the rocker grows with that of the crank, its acceleration with the square
        rocker = self.forces(phi, self.p.ratio, 0.0, left, right).rocker
        pulls = self.organ_pulls(rocker.psi, rocker.w * speed, rocker.a * speed**2, left, right)
        sides = [side for side in SIDES if side in self.loaded_sides(Feed(left=left, right=right))]
        means = [sum(pulls[side][rod].values()) / 2.0 for rod in RODS for side in sides]
        shape = np.broadcast_shapes(np.shape(speed), np.shape(phi))
        return np.array([np.broadcast_to(mean, shape) for mean in means]).reshape(len(means), *shape)

    def least_web_pull(
        self, w: Any, left: SideLoads = EMPTY, right: SideLoads = EMPTY, points: int = 720
    ) -> Any:
        """The least pull at an end of the webs [N] over `points` angles of a crank turn at constant motor speed `w`,
        for each speed in `w`; infinite if no side is loaded."""
        phi = np.linspace(0.0, 2.0 * math.pi * self.p.ratio, points, endpoint=False)
        w = np.asarray(in_declared_unit(_SPEED, w))
        out = self.forces(phi, w[..., None], 0.0, left, right)
        pulls = [getattr(out, side).web_pull for side in self.loaded_sides(Feed(left=left, right=right))]
        return np.min(pulls, axis=(0, -1)) if pulls else np.full(np.shape(w), np.inf)

    def loaded_sides(self, feed: Feed) -> tuple[str, ...]:
        """The sides whose organ has any mass or load: an organ without both is absent, and cannot go slack."""
        present, numbers = [], self._inputs(0.0, 0.0, 0.0, feed.left, feed.right)
        for side in SIDES:
            masses, loads = getattr(self.p, side), getattr(numbers, side)
            if np.any(
                masses.wall_mass + masses.web_mass + loads.material_mass + loads.processing_force > 0.0
            ):
                present.append(side)
        return tuple(present)

    def slack_speed(
        self, left: SideLoads = EMPTY, right: SideLoads = EMPTY, highest: float = 1000.0
    ) -> float:
        """Lowest crank speed [rad/s] at which a web goes slack somewhere in the turn, as its mean pull falls below
        zero: 0 if a web is slack at rest, infinity if no web is up to `highest`. Above this speed two rigid bars are
        no model of a chain. An end of a web may be pushed at a lower speed: there a chain sags."""
        webs = len(self.loaded_sides(Feed(left=left, right=right)))

        def pull(crank_speed: Any) -> Any:
            means = self.mean_pulls(crank_speed, left, right)[:webs]
            return np.min(means, axis=(0, -1)) if webs else np.full(np.shape(crank_speed), np.inf)

        return _first_loss(pull, highest)

    def pushed_speed(
        self, left: SideLoads = EMPTY, right: SideLoads = EMPTY, highest: float = 1000.0
    ) -> float:
        """Lowest crank speed [rad/s] at which an end of a web is pushed somewhere in the turn, as `slack_speed`;
        there a chain sags."""
        return _first_loss(lambda w: self.least_web_pull(w * self.p.ratio, left, right), highest)


def _first_loss(pull: Callable[[Any], Any], highest: Any) -> float:
    """The lowest crank speed [rad/s] at which a least pull [N] falls to zero, see `ChainUnitMachine.slack_speed`."""
    from scipy.optimize import brentq

    low, high, highest = 0.0, 1.0, number_in("rad/s", "highest", highest, "highest speed of the crank")
    if pull(low) <= 0.0:
        return 0.0
    while low < highest:
        # the pull may fall and rise again with the speed: the first loss counts
        speeds = np.linspace(low, high, 33)
        losses = np.flatnonzero(pull(speeds) <= 0.0)
        if losses.size:
            i = int(losses[0])
            return float(brentq(pull, speeds[i - 1], speeds[i], xtol=1e-9))
        low, high = high, 2.0 * high
    return math.inf


class ChainedUnit(Machine):
    """A chain unit with chains. Its outputs depend on its states, so that its results come from runs of its model."""

    @property
    def rods(self) -> tuple[int, int]:
        """Numbers of rods in wall and web of an organ."""
        assert isinstance(self.model, ChainedModel)
        return self.model.organs.walls, self.model.organs.webs

    def pin_turns(self, run: Mapping[str, Any]) -> dict[str, Any]:
        """See `Machine`; the angles in A2, B and A1 of each side come from the angles of the rods."""
        assert isinstance(self.model, ChainedModel)
        angles, organs = super().pin_turns(run), self.model.organs
        # the rods at A1, at B in wall and web, and at A2
        at_pins = (1, organs.walls, organs.walls + 1, organs.number)
        for side in SIDES:
            first, last, web, end = (run[f"{side}.theta_{k}"] for k in at_pins)
            angles[f"{side}.rocker_joint"] = end - run["rocker.psi"]
            angles[f"{side}.hinge"] = web - last
            angles[f"{side}.support"] = first
        return angles

    @property
    def stored_per_unit(self) -> Mapping[str, Callable[[Mapping[str, Any]], Any]]:
        """See `Machine`: the material of both organs, distributed over their chains."""
        return {f"{side}.material_mass": itemgetter(f"{side}.energy_per_kg") for side in SIDES}


class ChainUnitOfChains(ChainUnitMachine):
    """A chain unit in whose runs each organ is a chain of `number` rods with a `law` of their pins. Its results
    without a run are those of two bars."""

    in_place = "two bars in place of the chains"

    def __init__(
        self,
        parameters: Parameters | Mapping[str, float] | None = None,
        /,
        *,
        law: OrganLaw | None = None,
        number: int = USUAL,
        **options: Any,
    ) -> None:
        super().__init__(parameters, **options)
        law = law or OrganLaw()
        self._law = {f"organ.{name}": getattr(law, name) for name in Layout(OrganLaw).names}
        self._number = number

    @property
    def simulated(self) -> ChainedUnit:
        """See `Machine`.

        Raises
        ------
        GeometryError
            for chains without mass.
        """
        rods = split((self.p.l1, self.p.l2), self._number)
        return ChainedUnit(flexible(*rods), self.by_name | self._law)


def machine_of(model: InverseMachine, parameters: Any = None, /, **values: float) -> Machine:
    """The machine of a model, of the class with the methods for its kind; arguments and errors are those of
    `Machine`."""
    if (model.root or model).Parameters is ChamberForces.Parameters:
        return ChainUnitMachine(parameters, model=model, **values)
    if isinstance(model, ChainedModel):
        return ChainedUnit(model, parameters, **values)
    return Machine(model, parameters, **values)
