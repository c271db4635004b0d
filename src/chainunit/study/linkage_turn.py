"""A linkage over the way of its driver at constant speed, by inverse dynamics: motion, torque, inertia, reactions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..engines import numpy_
from ..machines.linkages.model import LinkageDescription
from ..machines.linkages.structure import CYLINDER
from ..machines.machine import Machine
from ..quantities import Value, declaration, quantity
from .arrays import rms

PLACES = 361


@declaration
class LinkageTurn:
    """A linkage over the way of its driver at constant speed."""

    torque_peak: Value = quantity("N.m", "largest in size")
    torque_rms: Value = quantity("N.m", "RMS")
    torque_mean: Value = quantity("N.m", "mean")
    power_mean: Value = quantity("W", "mean power")
    inertia_least: Value = quantity("kg.m2", "reflected inertia, least")
    inertia_largest: Value = quantity("kg.m2", "reflected inertia, largest")
    energy_gap: Value = quantity("1", "gap between reactions and virtual work, share of the peak")


@declaration
class GroupTurn:
    """A group over the way of the driver."""

    margin: Value = quantity("1", "least margin; 0 is a dead position")
    margin_at: Value = quantity("rad", "angle of the driver where it is least")


@declaration
class JointTurn:
    """A joint over the way of the driver."""

    peak: Value = quantity("N", "largest force")
    peak_at: Value = quantity("rad", "angle of the driver where it is largest")
    rms: Value = quantity("N", "force, RMS")
    moment: Value = quantity("N.m", "largest moment of a guide, about the point of its block")


@dataclass(frozen=True)
class LinkageFindings:
    """The findings on a linkage: `q` are the places of the driver [rad], shape (n,), `outputs` the outputs there by
    name, and the summaries by the names of groups and joints."""

    machine: Machine
    speed: float
    """of the driver [rad/s, m/s]"""
    q: Any
    outputs: dict[str, Any]
    turn: LinkageTurn
    groups: dict[str, GroupTurn]
    joints: dict[str, JointTurn]

    @property
    def description(self) -> LinkageDescription:
        """The description of the machine's linkage."""
        described: LinkageDescription = self.machine.model.described_by  # type: ignore[attr-defined]
        return described

    @property
    def sentence(self) -> str:
        """The groups in one line: ``crank + RRR dyad (coupler, rocker) + RRP dyad (rod, ram)``."""
        groups = self.description.structure.groups
        pinned = groups and groups[0].kind == CYLINDER
        parts = [] if pinned else [self.machine.model.turning]
        for group in groups:
            kind = group.kind if group.kind in ("triad", CYLINDER) else f"{group.kind} dyad"
            parts.append(f"{kind} ({', '.join(group.links)})")
        return " + ".join(parts)


def linkage_findings(machine: Machine, speed: float) -> LinkageFindings:
    """The linkage over its way at a constant `speed` of the driver [rad/s], with the loads of normal running."""
    description: LinkageDescription = machine.model.described_by  # type: ignore[attr-defined]
    low, high = description.span
    q = np.linspace(low, high, PLACES)
    feed = machine.model.feed_layout.by_name(machine.model.Feed())
    u = machine.inputs({"phi": q * machine.ratio, "w": speed * machine.ratio, **feed})
    state = machine.state(u)
    part = machine.model.parts[0]
    given = part.equations(numpy_(), machine.p, u, None, state)
    outputs = {name: np.broadcast_to(x, q.shape) for name, x in part.layout.by_name(given).items()}
    torque = np.broadcast_to(state.bias, q.shape)
    inertia = np.broadcast_to(state.J, q.shape)
    losses = sum(effect.dissipative for load, effect in state.effects.items() if load in ("pins", "guides"))
    gap = np.abs(state.torque_by_reactions(0.0) + losses - torque)
    groups = {}
    for group, margin in zip(description.structure.groups, state.m.margins(), strict=True):
        size = np.broadcast_to(np.abs(margin), q.shape)
        k = int(np.argmin(size))
        groups[", ".join(group.links)] = GroupTurn(margin=float(size[k]), margin_at=float(q[k]))
    joints = {}
    for name in description.structure.joints:
        variable = description.variable("joint", name)
        force = np.hypot(outputs[f"{variable}.fx"], outputs[f"{variable}.fy"])
        k = int(np.argmax(force))
        moment = outputs.get(f"{variable}.moment")
        largest = None if moment is None else float(np.max(np.abs(moment)))
        joints[name] = JointTurn(peak=float(force[k]), peak_at=float(q[k]), rms=_rms(force), moment=largest)
    mean = float(np.mean(torque[:-1]))
    # the mean of a torque without losses is rounding
    mean = mean if abs(mean) > 1e-12 * np.max(np.abs(torque)) else 0.0
    turn = LinkageTurn(
        torque_peak=float(torque[np.argmax(np.abs(torque))]),
        torque_rms=_rms(torque),
        torque_mean=mean,
        power_mean=mean * speed,
        inertia_least=float(np.min(inertia)),
        inertia_largest=float(np.max(inertia)),
        energy_gap=float(np.max(gap) / max(np.max(np.abs(torque)), 1e-300)),
    )
    return LinkageFindings(machine, speed, q, outputs, turn, groups, joints)


def _rms(x: Any) -> float:
    """Over the way of the driver; its two ends count as one."""
    return rms(x[:-1])
