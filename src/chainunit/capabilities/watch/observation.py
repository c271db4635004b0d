"""The load observer of a study: a part of its system that knows the study's machine, motor and feed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...core.quantities import Layout
from ...drives.gearing import lost_torque
from ...drives.terminal_signals import TerminalSignals, terminal_signals
from ...machines.load_observer import LoadObserver
from ...study.arrays import rms
from ...study.capability import Estimates
from ...study.cycle import Cycle
from ...study.drive import Drive
from ...system import ModelComponent
from .false_loads import false_loads
from .tables import ObserverTable

FEED_SPREAD = 0.5
"""Standard deviation of the feed of a side from the usual one, as a share."""
OFFSET, OFFSET_CHANGE = 0.15, 1.5e-3
"""Standard deviation of the offset of the torque, and of its change in a second, in parts of the RMS torque."""
FORCE_CHANGE, FORCE_FLUCTUATION = 0.01, 0.005
"""Change of a processing force in a second that is followed, and its natural fluctuation, in parts of an overload."""


def with_observer(drive: Drive, table: ObserverTable, feed: Any, turn: Cycle) -> Drive:
    """The drive with a load observer by that `table`, for a machine with this `feed` and `turn` in normal running."""
    p, speed = drive.fmu_parameters, turn.crank_speed * drive.ratio
    passed = np.asarray(turn.crank_torque) / drive.ratio
    torque = passed + lost_torque(np, p.gear.loss, passed, speed) + p.rotor.d * speed
    signals = terminal_signals(drive.motor, p, speed, float(np.mean(torque)))
    values = drive.machine.in_plane | of_shaft(p) | weights(signals)
    values |= tuning(table, feed, speed, rms(torque))
    component = ModelComponent(LoadObserver, LoadObserver.parameter_layout.from_names(values))
    wires = {"phi": "phi", "w": "w", **signals.outputs}
    return replace(drive, observer=component, observed=wires)


def of_shaft(p: Any) -> dict[str, float]:
    """The parameters of the observer for shaft and gear, by the parameters `p` of the motor."""
    return {"rotor.J": p.rotor.J, "rotor.d": p.rotor.d, "gear.loss": p.gear.loss}


def weights(signals: TerminalSignals) -> dict[str, float]:
    """The parameters of the observer that give the torque from signals at the terminals."""
    return {
        "signal.current": signals.per_current,
        "signal.power": signals.per_power,
        "signal.resistance": signals.resistance,
    }


def usual_loads(feed: Any) -> dict[str, float]:
    """The parameters of the observer by name that are the loads of normal running: the means of both sides."""
    return {
        "feed.expected": 0.5 * (feed.left.material_mass + feed.right.material_mass),
        "force.expected": 0.5 * (feed.left.processing_force + feed.right.processing_force),
    }


def tuning(table: ObserverTable, feed: Any, speed: float, torque: float) -> dict[str, float]:
    """Parameters of the observer by name.

    Parameters
    ----------
    table : what is known
    feed : loads of normal running
    speed : of the motor in normal running [rad/s]
    torque : RMS torque on the rotor in normal running [N m]
    """
    expected = usual_loads(feed)
    usual = expected["feed.expected"]
    return expected | {
        "noise.w": table.speed_noise * speed,
        "noise.torque": table.signal_noise * torque,
        "noise.rate": table.rate,
        "feed.spread": FEED_SPREAD * usual,
        "feed.change": table.change * usual,
        "feed.fluctuation": table.fluctuation,
        "feed.time": table.fluctuation_time,
        "force.spread": table.force_overload,
        "force.change": FORCE_CHANGE * table.force_overload,
        "force.fluctuation": FORCE_FLUCTUATION * table.force_overload,
        "force.time": table.fluctuation_time,
        "offset.spread": OFFSET * torque,
        "offset.change": OFFSET_CHANGE * torque,
        "imbalance.uncertainty": table.uncertainty,
        "imbalance.force_uncertainty": table.force_uncertainty,
        # what one side loses the other one gains
        "imbalance.overload": 2.0 * table.overload * usual,
        "imbalance.force_overload": table.force_overload,
        "alarm.rate": table.false_alarms,
    }


def false_imbalance_of(
    drive: Drive, usual: Any, crank_speed: float, estimates: Estimates
) -> dict[str, float]:
    """The keys of the table [observer] with the false imbalance of an observer of the estimated machine of a `drive`,
    with the `usual` feed at that speed of the crank [rad/s]."""
    values = estimates.values
    loads = {name.removeprefix("feed."): x for name, x in values.items() if name.startswith("feed.")}
    feed = Layout(type(usual)).from_names(loads, usual)
    machine_values = {name.removeprefix("machine."): x for name, x in values.items()}
    parameters = drive.machine.in_plane | machine_values | usual_loads(feed)
    parameters |= {"gear.loss": drive.fmu_parameters.gear.loss}
    return false_imbalance(parameters, list(machine_values), estimates.covariance, crank_speed)


def false_imbalance(
    values: Mapping[str, float], names: Sequence[str], covariance: Any, crank_speed: float
) -> dict[str, float]:
    """The keys of the table [observer] with the false imbalance that errors of the machine make.

    Parameters
    ----------
    values : parameters of the observer by name; others have their declared values
    names, covariance, crank_speed : see `false_loads`
    """
    layout = LoadObserver.parameter_layout
    parameters = layout.from_names({name: x for name, x in values.items() if name in layout.names})
    loads = false_loads(parameters, names, covariance, crank_speed)
    return {"uncertainty": loads.imbalance, "force_uncertainty": loads.force_imbalance}
