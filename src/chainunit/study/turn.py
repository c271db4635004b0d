"""A turn of the crank at constant speed, with the feed and without it: torque, inertia, energy, reactions."""

from __future__ import annotations

from operator import attrgetter
from typing import Any

import numpy as np

from ..core.quantities import Value, declaration, quantity
from ..reading.results import derived, part, result
from .analysis import Analysis, Findings, Work
from .arrays import above_noise, peak
from .cycle import Cycle, cycle, energy_swing, no_feed
from .record import StudyRecord

POINTS = 3600
"""Number of crank angles of the turn."""
EVERY = 10
"""One of so many angles is in the result."""


@declaration
class Turn:
    """A turn of the crank at constant speed, with the feed of normal running unless a description says
    otherwise."""

    torque_peak: Value = quantity("N.m", "{driver} torque, peak")
    torque_peak_free: Value = quantity("N.m", "{driver} torque, peak, without feed")
    torque_mean: Value = quantity("N.m", "{driver} torque, mean")
    lost: Value = quantity("J", "energy that load and pins take in a turn")
    lost_free: Value = quantity("J", "energy that the pins take in a turn without feed")
    energy_swing: Value = quantity("J", "energy to be stored at constant torque of the drive")
    inertia_least: Value = quantity("kg.m2", "inertia reflected to the {driver}, least")
    inertia_largest: Value = quantity("kg.m2", "inertia reflected to the {driver}, largest")
    inertia_mean: Value = quantity("kg.m2", "inertia reflected to the {driver}, mean")
    margin: Value = quantity("1", "margin from a dead position, least")


@declaration
class Reaction:
    """The largest reaction of a pin over the turn, and the crank angle at which it comes."""

    peak: Value = quantity("N", "largest reaction")
    angle: Value = quantity("rad", "{driver} angle of it")
    peak_free: Value = quantity("N", "largest reaction, without feed")
    angle_free: Value = quantity("rad", "{driver} angle of it")


@result
class TurnCourse:
    """The course of a turn, at one of `EVERY` crank angles."""

    angle: Any = quantity("rad", "{driver} angle")
    torque: Any = quantity("N.m", "{driver} torque")
    torque_free: Any = quantity("N.m", "{driver} torque, without feed")
    inertia: Any = quantity("kg.m2", "inertia reflected to the {driver}")


@result
class TurnFindings(Findings):
    """The turn with the feed (`loaded`) and without it (`free`), its numbers, and the reactions by the titles
    of the pins."""

    loaded: Cycle
    free: Cycle
    inertia: Any
    """inertia at the crank [kg m2], shape (POINTS,)"""
    numbers: Turn = part(inline=True)
    pins: dict[str, Reaction] = part("largest reactions, by the title of the pin")

    @derived()
    def over_turn(self) -> TurnCourse:
        """The course over the turn."""
        curves = (self.loaded.angle, self.loaded.crank_torque, self.free.crank_torque, self.inertia)
        return TurnCourse(*(x[::EVERY] for x in curves))


class TurnAnalysis(Analysis):
    """The turn of every machine; for organs that are chains, with two bars in their place."""

    name = "constant_speed"

    @staticmethod
    def find(study: StudyRecord, work: Work) -> TurnFindings:
        """The turn at the crank speed of the study, by inverse dynamics."""
        config, machine = study.setup.config, study.setup.drive.machine
        feed, w = config.feed, config.run.crank_speed
        loaded, free = (cycle(machine, w, load, POINTS) for load in (feed, no_feed(feed)))
        inertia = np.broadcast_to(loaded.outputs.J * machine.ratio**2, loaded.angle.shape)
        return TurnFindings(
            loaded,
            free,
            inertia,
            Turn(
                torque_peak=peak(loaded.crank_torque),
                torque_peak_free=peak(free.crank_torque),
                torque_mean=above_noise(float(np.mean(loaded.crank_torque)), peak(loaded.crank_torque)),
                lost=_lost_energy(loaded, config.operation.turn),
                lost_free=_lost_energy(free, config.operation.turn),
                energy_swing=energy_swing(loaded.crank_torque),
                inertia_least=above_noise(float(np.min(inertia)), peak(inertia)),
                inertia_largest=float(np.max(inertia)),
                inertia_mean=float(np.mean(inertia)),
                margin=float(np.min(loaded.outputs.margin)) if hasattr(loaded.outputs, "margin") else None,
            ),
            {title: _reaction(loaded, free, output) for title, output in machine.model.pins.items()},
        )


def _lost_energy(cycle: Cycle, turn: float) -> float:
    """The energy that is dissipated in a turn [J]; for an FMU without that output, the energy that the shaft
    brings in."""
    if hasattr(cycle.outputs, "dissipated_power"):
        return float(np.mean(cycle.outputs.dissipated_power)) * turn
    return float(np.mean(cycle.crank_torque)) * 2.0 * np.pi


def _reaction(loaded: Cycle, free: Cycle, output: str) -> Reaction:
    """The largest reaction of a pin in the turn with its loads and in the one without, with their crank angles."""
    forces = (attrgetter(output)(turn.outputs) for turn in (loaded, free))
    sizes = [np.broadcast_to(np.hypot(force.fx, force.fy), loaded.angle.shape) for force in forces]
    peak_rows = [int(np.argmax(size)) for size in sizes]
    return Reaction(
        peak=float(sizes[0][peak_rows[0]]),
        angle=float(loaded.angle[peak_rows[0]]),
        peak_free=float(sizes[1][peak_rows[1]]),
        angle_free=float(loaded.angle[peak_rows[1]]),
    )
