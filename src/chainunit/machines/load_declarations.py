"""The declarations of the load observer (`chainunit.machines.load_observer`)."""

from __future__ import annotations

from typing import Any

from ..core.ports import Solver
from ..core.quantities import Value, declaration, declared_class, group, quantity
from ..drives.motor import GearOfMotor, Rotor
from . import chain_unit
from .load_filter import TRIANGLE, UNKNOWNS


@declaration
class SignalWeights:
    """The torque on the rotor from the measured signals: torque (u.torque - zero) of a torque sensor, plus current
    u.current of an armature, plus power (u.power - resistance u.current^2) of an induction motor."""

    torque: Value = quantity("1", "factor of the measured torque", default=0.0, min=-1e3, max=1e3)
    current: Value = quantity(
        "N.m/A", "torque per current: the motor constant", default=1.27, min=-1e6, max=1e6
    )
    power: Value = quantity(
        "s/rad", "torque per power: 1 over the synchronous speed", default=0.0, min=-1e3, max=1e3
    )
    resistance: Value = quantity(
        "Ohm", "three times the resistance of a phase, for the power", default=0.0, min=0.0
    )
    zero: Value = quantity("N.m", "torque at the signal's zero", default=0.0, min=-1e6, max=1e6, tunable=True)


@declaration
class Noise:
    """Noise of the measured signals."""

    torque: Value = quantity(
        "N.m", "standard deviation of the torque from the signal", default=0.006, above=0.0
    )
    w: Value = quantity("rad/s", "standard deviation of the measured speed", default=1.5, above=0.0)
    rate: Value = quantity("Hz", "rate of independent samples", default=1000.0, above=0.0)


@declaration
class FeedCourse:
    """What is known of the feed of a side before it is measured."""

    expected: Value = quantity("kg", "usual feed of a side", default=30.0, min=0.0)
    spread: Value = quantity(
        "kg", "standard deviation of the feed from the usual one", default=15.0, above=0.0
    )
    change: Value = quantity(
        "kg", "standard deviation of the change in a second that the filter follows", default=3.2, above=0.0
    )
    fluctuation: Value = quantity(
        "1", "standard deviation of the natural fluctuation, share of the usual feed", default=0.03, min=0.0,
        max=1.0, kind="percent",
    )  # fmt: skip
    time: Value = quantity("s", "correlation time of the fluctuation", default=10.0, above=0.0)


@declaration
class ForceCourse:
    """What is known of the processing force of a side before it is measured."""

    expected: Value = quantity("N", "usual force", default=0.0, min=0.0)
    spread: Value = quantity(
        "N",
        "standard deviation of the force from the usual one, and size of a jam",
        default=1000.0,
        above=0.0,
    )
    change: Value = quantity(
        "N", "standard deviation of the change in a second that the filter follows", default=10.0, above=0.0
    )
    fluctuation: Value = quantity("N", "standard deviation of the natural fluctuation", default=5.0, min=0.0)
    time: Value = quantity("s", "correlation time of the fluctuation", default=10.0, above=0.0)


@declaration
class Offset:
    """What is known of the offset of the torque: zero error of the signal, and friction that is not in the model."""

    spread: Value = quantity("N.m", "standard deviation", default=0.1, above=0.0)
    change: Value = quantity("N.m", "standard deviation of the change in a second", default=1e-3, above=0.0)


@declaration
class Uncertainty:
    """False imbalance that errors of the machine's parameters make (see the load observer), and the imbalance
    that is an overload."""

    uncertainty: Value = quantity("kg", "standard deviation of the false imbalance", default=0.0, min=0.0)
    force_uncertainty: Value = quantity(
        "N", "standard deviation of the false imbalance of the forces", default=0.0, min=0.0
    )
    overload: Value = quantity("kg", "imbalance of the feed that overloads a side", default=12.0, above=0.0)
    force_overload: Value = quantity(
        "N", "imbalance of the forces that overloads a side", default=1000.0, above=0.0
    )


@declaration
class AlarmRule:
    """The alarm."""

    rate: Value = quantity(
        "1", "permitted false alarms in a million turns of the crank", default=1.0, above=0.0, max=1e5
    )


@declaration
class Parameters(chain_unit.Parameters):
    """Parameters of the machine, of the signal, and what is known of the loads. The start values describe
    the packaged machine on a DC motor of the start values of `DcMotor`."""

    ratio: Value = quantity(
        "1", "gear ratio, motor turns per crank turn", default=50.0, above=0.0, max=1e6, usual=(1.0, 500.0)
    )
    rotor: Rotor = group(Rotor, "rotor of the motor", default=Rotor())
    gear: GearOfMotor = group(GearOfMotor, "gear", default=GearOfMotor())
    signal: SignalWeights = group(SignalWeights, "measured signal", default=SignalWeights())
    noise: Noise = group(Noise, "noise", default=Noise())
    feed: FeedCourse = group(FeedCourse, "feed of a side", default=FeedCourse())
    force: ForceCourse = group(ForceCourse, "processing force of a side", default=ForceCourse())
    offset: Offset = group(Offset, "offset of the torque", default=Offset())
    imbalance: Uncertainty = group(Uncertainty, "imbalance", default=Uncertainty())
    alarm: AlarmRule = group(AlarmRule, "alarm", default=AlarmRule())
    solver: Solver = group(Solver, "internal integrator", default=Solver())


@declaration
class Inputs:
    """Motion and measured signals of the motor. A signal whose factor is zero need not be connected."""

    phi: Value = quantity(
        "rad", "motor angle; crank angle is phi/ratio, from the upward vertical, clockwise", default=0.0
    )
    w: Value = quantity("rad/s", "measured motor speed", default=0.0)
    torque: Value = quantity("N.m", "measured torque on the rotor", default=0.0)
    current: Value = quantity("A", "measured current", default=0.0)
    power: Value = quantity("W", "measured active power", default=0.0, nominal=100.0)


@declaration
class LoadEstimate:
    """Estimated loads of a side."""

    material_mass: Value = quantity("kg", "estimated material on the organ", nominal=30.0)
    processing_force: Value = quantity("N", "estimated processing force", nominal=100.0)


ENTRIES = tuple(f"{UNKNOWNS[i]}_{UNKNOWNS[j]}" for i, j in TRIANGLE)
Covariance = declared_class(
    "Covariance",
    (),
    [(name, Value, quantity("1", "entry, in parts of noise.w and of the spreads")) for name in ENTRIES],
)
"""The stored entries of a covariance."""


@declaration
class States:
    """Estimates, and the covariances of their errors."""

    speed: Value = quantity("rad/s", "estimated motor speed", nominal=100.0)
    left: LoadEstimate = group(LoadEstimate, "left organ")
    right: LoadEstimate = group(LoadEstimate, "right organ")
    torque_offset: Value = quantity("N.m", "estimated offset of the torque")
    surprise: Value = quantity("rad/s", "mean deviation of the measured speed from the estimated one")
    covariance: Any = group(Covariance, "covariance of the filter")
    quiet: Any = group(Covariance, "covariance of the errors while the loads only fluctuate")


@declaration
class SideJudgement:
    """What is known of the loads of a side."""

    material_mass_deviation: Value = quantity("kg", "standard deviation of the estimated material")
    processing_force_deviation: Value = quantity(
        "N", "standard deviation of the estimated processing force", nominal=100.0
    )
    web_pull: Value = quantity(
        "N",
        "least axial pull in the web with the estimated loads; negative where it would push",
        nominal=100.0,
    )
    overload: Value = quantity("1", "probability that the side is overloaded against the other one")


@declaration
class Imbalance:
    """Left less right, with the thresholds of the alarm."""

    feed: Value = quantity("kg", "imbalance of the feed, left less right")
    feed_deviation: Value = quantity("kg", "standard deviation of the imbalance of the feed")
    feed_threshold: Value = quantity("kg", "imbalance of the feed from which there is an alarm")
    force: Value = quantity("N", "imbalance of the processing forces, left less right", nominal=100.0)
    force_deviation: Value = quantity("N", "standard deviation of the imbalance of the forces", nominal=100.0)
    force_threshold: Value = quantity(
        "N", "imbalance of the forces from which there is an alarm", nominal=100.0
    )


@declaration
class RockerEstimate:
    """The load of the rocker."""

    tau: Value = quantity(
        "N.m", "torque on the rocker for both organs, with the estimated loads", nominal=100.0
    )


@declaration
class Grounds:
    """What the alarm rests on."""

    feed: Value = quantity("1", "imbalance of the feed in parts of its threshold; positive left")
    force: Value = quantity("1", "imbalance of the forces in parts of its threshold; positive left")


@declaration
class Outputs:
    """Loads with their deviations, forces that follow, and the alarm."""

    left: SideJudgement = group(SideJudgement, "left organ")
    right: SideJudgement = group(SideJudgement, "right organ")
    imbalance: Imbalance = group(Imbalance, "imbalance")
    rocker: RockerEstimate = group(RockerEstimate, "rocker")
    grounds: Grounds = group(Grounds, "ground of the alarm")
    alarm: Value = quantity(
        "1", "side that is overloaded: 1 left, -1 right, 0 none", min=-1, max=1, type="Integer"
    )
