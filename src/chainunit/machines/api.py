"""`ChainUnit`: the machine for Python - arrays in, arrays out."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..engines import MATH, numpy_
from ..errors import GeometryError, InputError
from ..groups.loads import Stop
from ..mechanism.machine import MachineState
from ..ports import PortSlopes
from ..quantities import Layout, Quantity, Variable, complaint
from . import chain_unit
from .chain_unit import PINS, Chamber, ChamberForces, Inputs, Outputs, Parameters, SideLoads
from .crank_rocker import rocker_extremes
from .hanging import Hanging, Modes, modes, rods, split

_XP = numpy_()
CHAIN_RODS = 32
"""Rods of an organ with which its lowest frequency is that of a chain to a thousandth."""
EMPTY = SideLoads(material_mass=0.0, processing_force=0.0)
FREE = Stop()
_INPUTS = {v.name: v for v in ChamberForces.input_layout.variables}
_ROCKER = {
    name: Variable(name, f"{what} of the rocker", Quantity(unit, what))
    for name, what, unit in (
        ("psi", "angle", "rad"),
        ("w", "speed", "rad/s"),
        ("a", "acceleration", "rad/s2"),
    )
}


class ChainUnit:
    """A chain unit with its parameters checked.

    Angles and speeds are the motor's, as at the FMU; with ``ratio`` 1 they are the crank's.
    Every argument may be a float or an array; shapes broadcast, and outputs have the common shape. A value that
    is not finite, or a load outside its declared bounds, is an `InputError` that names it, in an array as well as
    alone; a value beyond a bound by rounding only counts as the bound.

    Parameters
    ----------
    parameters : Parameters, or names of `ChamberForces` parameters with their values (SI), e.g.
        ``{"r": 0.2, "crank.m": 35.0}``; a value that is not named is the packaged machine's.
    **values : the same for names without a dot.

    Raises
    ------
    KeyError
        for a name that is not declared.
    InputError, GeometryError
        for values out of bounds and lengths that cannot turn, in one line.

    Examples
    --------
    >>> machine = ChainUnit.from_ratios(rho=0.1, lam=2 / 3, mu=0.6, zeta=0.5)
    >>> round(float(machine.forces(phi=0.5, w=3.0).tau), 2)
    -10.53
    """

    def __init__(
        self, parameters: Parameters | Mapping[str, float] | None = None, /, **values: float
    ) -> None:
        base = parameters if isinstance(parameters, Parameters) else Parameters()
        given = {} if isinstance(parameters, Parameters) else dict(parameters or {})
        self.p: Parameters = ChamberForces.parameter_layout.from_names({**given, **values}, base)
        ChamberForces.check(self.p)

    def replace(self, parameters: Mapping[str, float] | None = None, /, **values: float) -> ChainUnit:
        """The same machine with some parameters changed, given as to the constructor."""
        return ChainUnit(ChamberForces.parameter_layout.from_names({**(parameters or {}), **values}, self.p))

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
        **values: float,
    ) -> ChainUnit:
        """The machine in the papers' ratios and frame.

        rho = r/l, lam = h/l, mu = e/l1, zeta = z/z_max with z_max = 2 l1 sqrt(1 - mu), l2 = l1 - e;
        c = sqrt(l^2 - r^2) and hy = h, so that crank and rocker are parallel at phi = 0 (papers 000, 001).
        """
        lengths = ratios(rho, lam, mu, zeta, l, l1)
        return cls({**lengths, **(parameters or {}), **values})

    def _inputs(
        self, phi: Any, w: Any, a: Any, left: SideLoads, right: SideLoads, stop: Stop = FREE
    ) -> Inputs:
        return Inputs(
            phi=_admitted(_INPUTS["phi"], phi),
            w=_admitted(_INPUTS["w"], w),
            a=_admitted(_INPUTS["a"], a),
            left=_loads("left", left),
            right=_loads("right", right),
            stop=Stop(
                **{name: _admitted(_INPUTS[f"stop.{name}"], getattr(stop, name)) for name in _STOP_NAMES}
            ),
        )

    def _state(self, u: Inputs) -> MachineState:
        return ChamberForces.shared(_XP, self.p, u, None)

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
        u = self._inputs(phi, w, a, left, right, stop)
        part = ChamberForces.parts[0]
        out = part.equations(_XP, self.p, u, None, self._state(u))
        return part.layout.instance(np.broadcast_arrays(*part.layout.values(out)))

    def slopes(
        self,
        phi: Any,
        w: Any = 0.0,
        left: SideLoads = EMPTY,
        right: SideLoads = EMPTY,
        stop: Stop = FREE,
    ) -> PortSlopes:
        """Exact derivatives of `tau_bias` by motor angle and speed."""
        u = self._inputs(phi, w, 0.0, left, right, stop)
        return ChamberForces.parts[1].equations(_XP, self.p, u, None, self._state(u))

    def evaluate(self, inputs: Mapping[str, Any]) -> dict[str, Any]:
        """All outputs of the FMU by name, from inputs by name; an input not named is 0.

        Raises
        ------
        KeyError
            for a name that is not an input.
        InputError
            see the class.
        """
        layout = ChamberForces.input_layout
        u = layout.from_names({**dict.fromkeys(layout.names, 0.0), **inputs})
        u = layout.instance([_admitted(_INPUTS[n], v) for n, v in layout.named(u).items()])
        outputs = ChamberForces.evaluate(_XP, self.p, u)
        named: dict[str, Any] = {}
        for part, instance in zip(ChamberForces.parts, outputs, strict=True):
            named |= part.layout.named(instance)
        return dict(zip(named, np.broadcast_arrays(*named.values()), strict=True))

    def torque_by_reactions(
        self,
        phi: Any,
        w: Any = 0.0,
        a: Any = 0.0,
        left: SideLoads = EMPTY,
        right: SideLoads = EMPTY,
        stop: Stop = FREE,
    ) -> Any:
        """The motor torque without friction [N m], from the reactions, group by group: the second route."""
        u = self._inputs(phi, w, a, left, right, stop)
        return self._state(u).torque_by_reactions(u.a / self.p.ratio) / self.p.ratio

    def friction_torque(
        self,
        phi: Any,
        w: Any,
        left: SideLoads = EMPTY,
        right: SideLoads = EMPTY,
        stop: Stop = FREE,
    ) -> Any:
        """The part of `tau` that pin friction and joint damping take [N m]."""
        state = self._state(self._inputs(phi, w, 0.0, left, right, stop))
        return state.effects["pins"].lost / self.p.ratio

    def pin_turns(self, phi: Any) -> list[Any]:
        """Angle through which each of the ten pins O1, A, Bd, C, A2, B, A1 (left, then right) has turned [rad], from
        the first of the motor angles `phi`, shape (n,); the sum of all turning to and fro is left to the reader."""
        phi = _array(phi)
        m = self._state(self._inputs(phi, 0.0, 0.0, EMPTY, EMPTY)).m
        per_turn = [m.turns[joint] for joint in PINS]
        step = np.diff(phi / self.p.ratio)
        angles = []
        for rate in per_turn:
            rate = np.broadcast_to(rate, phi.shape)
            angles.append(np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * step)]))
        return angles

    def energy_per_kg(self, side: str, phi: Any, w: Any) -> Any:
        """Kinetic and potential energy of a kilogram of material on the `side` ("left" or "right") [J/kg]:
        dE/dm, with which the feed enters an energy balance (the energy is linear in the mass)."""
        kilogram = SideLoads(material_mass=1.0, processing_force=0.0)

        def energy(**loads: Any) -> Any:
            out = self.forces(phi, w, 0.0, **loads)
            return out.kinetic_energy + out.potential_energy

        return energy(**{side: kilogram}) - energy()

    def chamber(
        self, psi: Any, w: Any = 0.0, a: Any = 0.0, left: SideLoads = EMPTY, right: SideLoads = EMPTY
    ) -> Chamber:
        """Loads of the organs at a rocker angle `psi` [rad] (speed `w`, acceleration `a` of the
        rocker), independent of the drive: the papers' statics at +-12 degrees, beyond this drive's swing.

        Where a side cannot be assembled an array of angles has NaN in the loads of that side and in those of the
        rocker: a sweep may pass the limit.

        Raises
        ------
        GeometryError
            for a single angle at which a side cannot be assembled.
        InputError
            see the class.
        """
        loads = Inputs(left=_loads("left", left), right=_loads("right", right))
        psi, w, a = (_admitted(_ROCKER[n], x) for n, x in (("psi", psi), ("w", w), ("a", a)))
        if np.ndim(psi) == 0:
            self._assembled(float(psi))
        with np.errstate(invalid="ignore"):
            return chain_unit.chamber(_XP, self.p, loads, psi, w, a)

    def _assembled(self, psi: float) -> None:
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
        it: as many in wall and web as brings them nearest to equal length."""
        p, own, loads = self.p, getattr(self.p, side), _loads(side, loads)
        on_web = p.web_share * loads.material_mass
        masses = own.wall_mass + loads.material_mass - on_web, own.web_mass + on_web
        counts = split((p.l1, p.l2), number)
        lengths, shares = ([x / n for x, n in zip(xs, counts, strict=True)] for xs in ((p.l1, p.l2), masses))
        return np.repeat(lengths, counts), np.repeat(shares, counts)

    def hanging(self, side: str, psi: float, loads: SideLoads = EMPTY, number: int = CHAIN_RODS) -> Hanging:
        """An organ at rest as a chain of `number` rods, at the rocker angle `psi` [rad]; the right one is given
        mirrored, as a left one at -psi.

        Raises
        ------
        GeometryError
            where it does not hang.
        """
        lengths, masses = self.organ_rods(side, loads, number)
        return rods(lengths, masses * self.p.g, self._reach(side, psi))

    def _reach(self, side: str, psi: float) -> Any:
        """From A1 to A2 of a left organ, or of the mirrored right one [m]."""
        hand = 1.0 if side == "left" else -1.0
        return np.array([self.p.z + self.p.e * math.sin(hand * psi), -self.p.e * math.cos(psi)])

    def chain_modes(
        self, left: SideLoads = EMPTY, right: SideLoads = EMPTY, number: int = CHAIN_RODS
    ) -> Modes | None:
        """Small vibration of the organs as chains of `number` rods, the rocker held in the middle: of the loaded side
        with the lowest frequency. None where no side is loaded, weighs anything or hangs."""
        candidates = []
        for side, loads in (("left", left), ("right", right)):
            lengths, masses = self.organ_rods(side, loads, number)
            if self.p.g > 0.0 and np.all(masses > 0.0):
                try:
                    rest = self.hanging(side, 0.0, loads, number)
                except GeometryError:
                    continue
                candidates.append(modes(lengths, masses * self.p.g, rest, self.p.g))
        return min(candidates, key=lambda each: float(each.frequency[0]), default=None)

    def rocker_extremes(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """(psi, phi_crank) [rad] at the right and at the left extreme of the rocker."""
        p = self.p
        extremes = []
        for psi, sense in zip(rocker_extremes(MATH, p), (1.0, -1.0), strict=True):
            x, y = p.h * math.sin(psi) + p.c, -p.h * math.cos(psi) + p.hy
            extremes.append((psi, math.atan2(sense * x, sense * y) % (2.0 * math.pi)))
        return extremes[0], extremes[1]

    def least_web_pull(
        self, w: Any, left: SideLoads = EMPTY, right: SideLoads = EMPTY, points: int = 720
    ) -> Any:
        """The least pull in the webs [N] over `points` angles of a crank turn at constant motor speed `w`, for
        each speed given; infinite where no side is loaded."""
        phi = np.linspace(0.0, 2.0 * math.pi * self.p.ratio, points, endpoint=False)
        out = self.forces(phi, np.asarray(w, float)[..., None], 0.0, left, right)
        pulls = [getattr(out, side).web_pull for side in self.loaded_sides(left, right)]
        return np.min(pulls, axis=(0, -1)) if pulls else np.full(np.shape(w), np.inf)

    def loaded_sides(self, left: SideLoads = EMPTY, right: SideLoads = EMPTY) -> list[str]:
        """The sides whose organ has any mass or load: a web that is not there cannot go slack."""
        present = []
        for side, loads in (("left", left), ("right", right)):
            masses = getattr(self.p, side)
            if np.any(
                masses.wall_mass + masses.web_mass + loads.material_mass + loads.processing_force > 0.0
            ):
                present.append(side)
        return present

    def slack_speed(
        self, left: SideLoads = EMPTY, right: SideLoads = EMPTY, highest: float = 1000.0
    ) -> float:
        """Lowest crank speed [rad/s] at which a web loses its pull somewhere in the turn; 0 if it has none at
        rest, infinity if it keeps it up to `highest`. Beyond, two rigid bars are no model of a chain."""
        from scipy.optimize import brentq

        def pull(crank_speed: Any) -> Any:
            return self.least_web_pull(crank_speed * self.p.ratio, left, right)

        low, high = 0.0, 1.0
        if pull(low) <= 0.0:
            return 0.0
        while low < highest:
            # the pull may fall and rise again with the speed: look for the first loss, not for any
            speeds = np.linspace(low, high, 33)
            losses = np.flatnonzero(pull(speeds) <= 0.0)
            if losses.size:
                i = int(losses[0])
                return float(brentq(pull, speeds[i - 1], speeds[i], xtol=1e-9))
            low, high = high, 2.0 * high
        return math.inf


def ratios(rho: float, lam: float, mu: float, zeta: float, l: float, l1: float) -> dict[str, float]:
    """Lengths [m] from the papers' ratios, by parameter name; see `ChainUnit.from_ratios`."""
    r, h, e = rho * l, lam * l, mu * l1
    if not abs(rho) < 1.0 or not mu < 1.0:
        raise GeometryError(
            f"rho = {rho:g}, mu = {mu:g}: the papers' frame needs rho = r/l < 1 and mu = e/l1 < 1"
        )
    return {
        "r": r,
        "l": l,
        "h": h,
        "c": math.sqrt(l * l - r * r),
        "hy": h,
        "e": e,
        "l1": l1,
        "l2": l1 - e,
        "z": zeta * 2.0 * l1 * math.sqrt(1.0 - mu),
    }


def _loads(side: str, loads: SideLoads) -> SideLoads:
    return SideLoads(
        **{name: _admitted(_INPUTS[f"{side}.{name}"], getattr(loads, name)) for name in _LOAD_NAMES}
    )


_LOAD_NAMES = Layout(SideLoads).names
_STOP_NAMES = Layout(Stop).names


def _admitted(variable: Variable, given: Any) -> Any:
    """A float or an array whose every value the declaration admits; a value beyond a bound by rounding is set on
    it."""
    q, x = variable.quantity, _array(given)
    for extreme in (
        (np.min(x), np.max(x)) if np.size(x) else ()
    ):  # NaN is the extreme of any array that holds it
        if not q.admits(float(extreme)):
            raise InputError(complaint(variable, float(extreme)))
    return q.bounded(x) if isinstance(x, float) else np.clip(x, q.low, q.high)


def _array(x: Any) -> Any:
    return x if isinstance(x, float) else np.asarray(x, float)
