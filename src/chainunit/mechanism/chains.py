"""A linkage with chains, which have states of their own: the slopes of its load port are taken along the motion.

Let D be the rate of change in time at the present speed and a = 0. Then, at the crank,

    tau_bias_dphi = D tau_bias w^3/(w^4 + W_SMALL^4),   dJ_dphi likewise,

which is the plain derivative by the angle for two rods. As the rods follow a change of the speed,

    tau_bias_dw = d tau_bias/d w + (d tau_bias/d omega) . (d alpha/d a).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

from ..core.engines import Dual, dual, slope
from ..groups.hanging_chain import HangingChain, HeldChain
from .machine import MachineState, Mechanism

W_SMALL = 0.01
"""Speed of the crank [rad/s] below which the slopes by the angle tend to zero."""


class ChainedState(MachineState):
    """A linkage with chains at one point: the `chains` by the names of their loads; `x` the states of the model."""

    def __init__(
        self, xp: Any, m: Mechanism, w: Any, loads: Mapping[str, Any] | None = None, x: Any = None
    ) -> None:
        super().__init__(xp, m, w, loads)
        self.x = x
        self.chains: dict[str, HeldChain] = {
            name: self.effects[name].source
            for name, load in self._loads.items()
            if isinstance(load, HangingChain)
        }

    @property
    def kinetic_energy(self) -> Any:
        """Kinetic energy of the bodies, without the chains [J]."""
        bodies = self.J - sum(chain.inertia() for chain in self.chains.values())
        return 0.5 * bodies * (self.w * self.w)

    def _moving(self, rates: Mapping[str, tuple[Sequence[Any] | None, Sequence[Any]]]) -> dict[str, Any]:
        """The loads, with chains whose angles and speeds change at these rates; None for the angles: they stay."""
        loads = dict(self._loads)
        for name, (turning, faster) in rates.items():
            theta, omega = loads[name].state
            if turning is not None:
                theta = [Dual(x, v) for x, v in zip(theta, turning, strict=True)]
            omega = [Dual(v, a) for v, a in zip(omega, faster, strict=True)]
            loads[name] = loads[name]._replace(state=(theta, omega))
        return loads

    @property
    def inertia_slope(self) -> Any:
        """The derivative of `J` by the crank angle along the motion [kg m2/rad]."""
        return self._along[2]

    def slopes(self) -> tuple[Any, Any]:
        """Derivatives of `bias` by the crank angle [N m/rad] and the crank speed [N m s/rad], along the motion."""
        return self._along[:2]

    @cached_property
    def _along(self) -> tuple[Any, Any, Any]:
        """Derivatives along the motion: of `bias` by the crank angle and the crank speed, and of `J` by the crank
        angle. They are rates by time over the speed; near rest, at `W_SMALL`, the share that stands for 1/w goes to
        0."""
        w, engine = self.w, dual(self._xp)
        rates = {name: chain.chain.rates for name, chain in self.chains.items()}
        moving = self._moving({name: (c.data.state[1], rates[name]) for name, c in self.chains.items()})
        along = MachineState(engine, Mechanism(engine, self.m.linkage, Dual(self.m.q, w)), w, moving)
        by_a = {}
        for name, chain in self.chains.items():
            at_one, _ = chain.at(1.0)
            # what an acceleration of 1 rad/s2 of the crank adds to the rates
            by_a[name] = None, [one - rate for one, rate in zip(at_one, rates[name], strict=True)]
        quicker = MachineState(engine, self.m, Dual(w, 1.0), self._moving(by_a))
        w2 = w * w
        share = w * w2 / (w2 * w2 + W_SMALL * W_SMALL * W_SMALL * W_SMALL)
        return slope(along.bias) * share, slope(quicker.bias), slope(along.J) * share
