"""Random machines and states that every property test draws from."""

from __future__ import annotations

import math

import numpy as np

from chainunit import EMPTY, ChainUnitMachine, InputError, SideLoads
from chainunit.machines.api import FREE
from chainunit.machines.chain_unit import Inputs


def random_machine(rng: np.random.Generator, *, lossless: bool = False) -> ChainUnitMachine:
    """An admissible machine with masses, material shares, losses and a gear, sizes over a decade."""
    while True:
        scale = 10.0 ** rng.uniform(-1.0, 0.3)
        rho, lam = rng.uniform(0.03, 0.35), rng.uniform(0.3, 1.4)
        mu, zeta = rng.uniform(0.3, 0.75), rng.uniform(0.3, 0.8)
        mass = 10.0 ** rng.uniform(-1.0, 2.0)
        l, l1 = scale, scale * rng.uniform(0.5, 1.5)
        values = {
            "ratio": rng.uniform(0.2, 60.0),
            "web_share": rng.uniform(0.0, 1.0),
            "rod_inertia": rng.choice([0.0, 1.0, rng.uniform(0.0, 1.0)]),
            "g": rng.choice([0.0, 9.81]),
            "left.wall_mass": mass * rng.uniform(0.0, 1.0),
            "left.web_mass": mass * rng.uniform(0.0, 1.0),
            "right.wall_mass": mass * rng.uniform(0.0, 1.0),
            "right.web_mass": mass * rng.uniform(0.0, 1.0),
            "pin.friction": 0.0 if lossless else rng.uniform(0.0, 0.3),
            "pin.diameter": 0.05 * scale,
            "joint_damping": 0.0 if lossless else rng.uniform(0.0, 2.0),
        }
        for body, length in (("crank", rho * l), ("coupler", l), ("rocker", lam * l)):
            values[f"{body}.m"] = mass * rng.uniform(0.0, 1.0)
            values[f"{body}.s"] = length * rng.uniform(-0.2, 1.1)
            values[f"{body}.I"] = values[f"{body}.m"] * length**2 * rng.uniform(0.0, 0.3)
        try:
            machine = ChainUnitMachine.from_ratios(rho, lam, mu, zeta, values, l=l, l1=l1)
            # off the papers' frame, too
            p = machine.p
            return ChainUnitMachine(p, c=p.c * rng.uniform(0.97, 1.03), hy=p.hy * rng.uniform(0.95, 1.05))
        except InputError:
            continue


def random_loads(rng: np.random.Generator, *, lossless: bool = False) -> SideLoads:
    return SideLoads(
        material_mass=rng.choice([0.0, rng.uniform(0.0, 60.0)]),
        processing_force=0.0 if lossless else rng.choice([0.0, rng.uniform(0.0, 1000.0)]),
    )


def random_state(rng: np.random.Generator, machine: ChainUnitMachine) -> tuple[float, float, float]:
    """(phi, w, a) of the motor; a tenth of the states are at rest."""
    w = rng.choice([0.0, 1.0], p=[0.1, 0.9]) * rng.uniform(-30.0, 30.0)
    return (
        machine.p.ratio * rng.uniform(-4.0 * math.pi, 4.0 * math.pi),
        machine.p.ratio * w,
        machine.p.ratio * rng.uniform(-100.0, 100.0),
    )


def torque_by_reactions(machine, phi, w=0.0, a=0.0, left=EMPTY, right=EMPTY, stop=FREE):
    """The motor torque of a chain unit without friction, from the force passes group by group: the second route."""
    return (
        _state(machine, phi, w, left, right, stop).torque_by_reactions(a / machine.p.ratio) / machine.p.ratio
    )


def friction_torque(machine, phi, w, left=EMPTY, right=EMPTY, stop=FREE):
    """The part of the motor torque of a chain unit against pin friction and joint damping."""
    return _state(machine, phi, w, left, right, stop).effects["pins"].dissipative / machine.p.ratio


def _state(machine, phi, w, left, right, stop):
    inputs = Inputs(phi=phi, w=w, left=left, right=right, stop=stop)
    return machine.state(machine.inputs(machine.model.input_layout.by_name(inputs)))
