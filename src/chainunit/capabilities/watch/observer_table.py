"""The table [observer] of a study file: what is known of signals, feed and machine, and what is an overload."""

from __future__ import annotations

from ...core.quantities import Value, declaration, quantity


@declaration
class ObserverTable:
    """A load observer beside the motor."""

    signal_noise: Value = quantity(
        "1",
        "noise of the measured current or power: standard deviation in parts of the RMS torque of normal running",
        default=0.01,
        min=1e-5,
        max=1.0,
        kind="percent",
    )
    speed_noise: Value = quantity(
        "1",
        "noise of the measured speed: standard deviation in parts of the speed of normal running",
        default=0.01,
        min=1e-5,
        max=1.0,
        kind="percent",
    )
    rate: Value = quantity("Hz", "rate of independent samples", default=1000.0, min=1.0, max=1e6)
    fluctuation: Value = quantity(
        "1",
        "natural fluctuation of the feed of a side: standard deviation as a share",
        default=0.03,
        min=0.0,
        max=1.0,
        kind="percent",
    )
    fluctuation_time: Value = quantity(
        "s", "correlation time of this fluctuation", default=10.0, min=0.01, max=1e6
    )
    change: Value = quantity(
        "1",
        "change of the feed that is followed: standard deviation in a second, in parts of the feed of a side; larger "
        "finds a shift earlier, smaller finds a smaller shift",
        default=0.1,
        min=1e-4,
        max=10.0,
        kind="percent",
    )
    false_alarms: Value = quantity(
        "1", "permitted false alarms in a million turns", default=1.0, min=1e-6, max=1e5
    )
    overload: Value = quantity(
        "1",
        "share of the feed of a side that, moved to the other side, overloads that side",
        default=0.2,
        min=1e-3,
        max=1.0,
        kind="percent",
    )
    force_overload: Value = quantity(
        "N",
        "processing force on one side that overloads it, and the size of a jam",
        default=1000.0,
        above=0.0,
    )
    uncertainty: Value = quantity(
        "kg",
        "false imbalance of the feed by errors of the machine's parameters: standard deviation",
        default=0.0,
        min=0.0,
        max=1e6,
    )
    force_uncertainty: Value = quantity(
        "N",
        "false imbalance of the processing forces by errors of the machine's parameters: standard deviation",
        default=0.0,
        min=0.0,
        max=1e9,
    )
