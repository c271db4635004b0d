"""The force at a ram for which the setting of a torque limiter stands.

At constant speed the power of the crank is that of the ram: T w = F v. So a torque T at the crank stands for the
force F = T/|ds/dphi| along the guide, with the way s of the ram and the crank angle phi. Towards a dead centre
ds/dphi goes to zero, and the force has no limit. Weights, inertia and friction are left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np

from ..mechanism.assur import GROUND, PRISMATIC, REVOLUTE
from ..mechanism.sampled_quantities import ROUNDING, roots
from .record import StudyRecord
from .turn import TurnAnalysis, TurnFindings

TIMES = 2.0
"""Multiple of the working force from which on the ram counts as overloaded."""


@dataclass(frozen=True)
class RamForce:
    """A ram over a turn of the crank: `angle` [rad] and `rate` = ds/dphi [m], each of shape (n,); the largest
    `working` force of normal running along the guide [N]; and the angle `dead` of the dead centre before which it
    works [rad], between the angles of the turn."""

    ram: str
    angle: Any
    rate: Any
    working: float
    dead: float

    def lever(self, before: Any) -> Any:
        """|ds/dphi| at so much crank angle [rad] before the dead centre [m]."""
        return np.abs(np.interp(self.dead - before, self.angle, self.rate, period=2.0 * math.pi))

    def least(self, torque: float) -> float:
        """The force where the ram is fastest [N], for a torque of the crank [N m]."""
        return float(torque / np.max(np.abs(self.rate)))

    def before(self, torque: float, angle: float) -> float:
        """The force at so much crank angle [rad] before the dead centre [N]; without limit at the dead centre."""
        lever = float(self.lever(angle))
        return torque / lever if lever > ROUNDING * float(np.max(np.abs(self.rate))) else math.inf

    def overloaded(self, torque: float) -> tuple[float, float] | None:
        """Crank angle [rad] and way [m] before the dead centre within which `torque` [N m] stands for more than
        `TIMES` the working force; None where it does at every angle."""
        n, limit = len(self.angle), torque / (TIMES * self.working)
        before = np.arange(n) * (2.0 * math.pi / n)
        lever = self.lever(before)
        k = int(np.argmax(lever >= limit))
        if lever[k] < limit:
            return None
        # at the dead centre itself, where k is 0 for a limit of 0, the lever is nothing
        share = (limit - lever[k - 1]) / (lever[k] - lever[k - 1]) if k else 0.0
        angle = float(before[max(k - 1, 0)] + share * before[1])
        within = np.append(before[:k], angle)
        return angle, float(np.trapezoid(self.lever(within), within))


def rams(study: StudyRecord) -> Iterator[RamForce]:
    """The rams of a linkage: links that slide on the ground and that a pin drives."""
    description = getattr(study.drive.machine.model, "described_by", None)
    if description is None or TurnAnalysis.name not in study.findings:
        return
    turn = TurnFindings.of_study(study).loaded
    joints = description.structure.joints
    for name, joint in joints.items():
        if joint.kind != PRISMATIC or GROUND not in (joint.on[0], joint.by[0]):
            continue
        ram = joint.on[0] if joint.by[0] == GROUND else joint.by[0]
        pin = next((k for k, j in joints.items() if j.kind == REVOLUTE and ram in (j.on[0], j.by[0])), None)
        if pin is None or any(name == driver.joint for driver in description.structure.drivers):
            continue
        guide, force = (
            attrgetter(description.variable("joint", joint_name))(turn.outputs) for joint_name in (name, pin)
        )
        shape = turn.angle.shape
        rate = np.broadcast_to(guide.v, shape) / study.config.run.crank_speed
        size = np.broadcast_to(_along(guide, force), shape)
        dead = max(_dead_centres(turn.angle, rate), key=lambda q: _before(turn.angle, size, q), default=None)
        if dead is not None and np.max(size) > 0.0:
            yield RamForce(ram, turn.angle, rate, float(np.max(size)), dead)


def _along(guide: Any, force: Any) -> Any:
    """Size of the part of a pin's force along a fixed guide [N]. The reaction of the guide is across it, which gives
    its direction; without such a reaction the whole force is along it."""
    normal = np.atleast_1d(guide.normal)
    k = int(np.argmax(np.abs(normal)))
    across = [float(np.atleast_1d(x)[k if np.size(x) > 1 else 0]) for x in (guide.fx, guide.fy)]
    size = math.hypot(*across)
    if size == 0.0:
        return np.hypot(force.fx, force.fy)
    return np.abs(force.fx * across[1] - force.fy * across[0]) / size


def _dead_centres(angle: Any, rate: Any) -> list[float]:
    """The crank angles at which the ram turns back [rad]."""

    def rate_at(q: Any) -> Any:
        return np.interp(q, angle, rate, period=2.0 * math.pi)[None]

    (angles,) = roots(rate_at, np.append(angle, angle[0] + 2.0 * math.pi), around=True)
    return [round(float(q), 9) % (2.0 * math.pi) for q in angles]


def _before(angle: Any, size: Any, place: float) -> float:
    """Mean of a force over the thirty degrees before a place."""
    places = place - np.radians(np.arange(0.5, 30.0))
    return float(np.mean(np.interp(places, angle, size, period=2.0 * math.pi)))
