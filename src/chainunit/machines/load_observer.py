"""An observer of the loads of a chain unit: from the motion and a measured signal of the motor to the feed and the
processing force of each side.

The signal gives the torque T on the motor's rotor. At the motor's shaft

    rotor.J dw/dt = T - offset - rotor.d w - P - gear.loss |P| sign(w)
    P = J(phi, feed)/ratio^2 dw/dt + tau_bias(phi, w, feed, force)/ratio

with the torque P that the gear passes on (`chainunit.drives.gearing`) and the machine's J and tau_bias
(`chainunit.machines.chain_unit`). An extended Kalman-Bucy filter estimates the speed, the loads and the offset from
the measured speed. Its gradient is the exact derivative of the machine's torque, by dual numbers; the sign of P and
the loss near rest count as constant. Angle and motion of the links are computed once for all directions.

Two covariances are states. The one of the filter (`covariance`) counts on loads that may change by their `change` in
a second; the gain follows from it. The other one (`quiet`) is that of the errors which this gain makes while the
loads only fluctuate; the thresholds of the alarms follow from it. Both are in parts of the sizes of `sizes`. While
nothing is measured, as at rest, the estimates stay and the variances grow up to the square of the spread.

A load that jumps, such as a jam, is no slow change: the measured speed runs away from the estimated one. The mean
deviation over `ONSET` is the state `surprise`; beyond `GATE` standard deviations both covariances grow by what could
explain it, and thus the filter forgets the loads and learns them anew. As long as the data leave the side open, the
thresholds are wide and there is no alarm.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from ..core.engines import Dual, dual, slope
from ..core.model import FmuData, Model, Part
from ..core.ports import measured_terminal
from ..drives.gearing import felt_inertia, felt_share, geared_acceleration
from ..mechanism.machine import MachineState, Mechanism
from . import chain_unit
from .chain_unit import ChamberForces, SideLoads
from .load_declarations import (
    ENTRIES,
    Covariance,
    Grounds,
    Imbalance,
    Inputs,
    LoadEstimate,
    Outputs,
    Parameters,
    RockerEstimate,
    SideJudgement,
    States,
)
from .load_filter import (
    TRIANGLE,
    UNKNOWNS,
    covariance_rates,
    difference,
    error_rates,
    level,
    normal_probability,
    step,
    symmetric,
)

ONSET = 0.02
"""Time over which the deviation of the speed is averaged to notice a jump [s]."""
GATE = 6.0
"""Mean deviation of the speed from which a load has jumped, in standard deviations."""
FEED_JUMP = 3.0
"""Jump of the feed in parts of its spread; the jump of the force is its spread."""
FEED, FORCE = 1, 3
"""Places in `UNKNOWNS` of feed and force of the left side; the right side stands after each."""
DIFFUSION = 0.3
"""Diffusion of an estimated imbalance that makes alarms, in parts of the square of the `change` of a load. The whole
square is that of the innovations; as they come in bursts at some angles of the crank, and a second alarm within a
turn is not counted, a third of it still overestimates the rate (bench/observer.py)."""
FARTHEST = 20.0
"""Largest deviation of an estimated load from the usual one, in spreads. A torque that no load explains, such as that
of a stop of the rocker, would drive the estimates beyond all bounds."""
FIRST_FORCE = 0.01
"""Variance of the forces at the start, in parts of their spread squared: a machine starts without a jam."""
_LEAST = 1e-12
"""Least variance, in parts of the sizes squared, of which a root is taken: it has a derivative."""
SLOWEST = 0.1
"""Least crank speed of which thresholds take notice [rad/s]: at rest a turn has no duration."""


def machine_inputs(u: Any, w: Any, left: SideLoads, right: SideLoads, a: Any = 0.0) -> chain_unit.Inputs:
    """The inputs of the machine at the motor's angle, at its speed `w` and acceleration `a`, with these loads."""
    return chain_unit.Inputs(phi=u.phi, w=w, a=a, left=left, right=right)


def rotor_torque(p: Any, u: Any) -> Any:
    """The torque on the rotor from the measured signals [N m]."""
    s = p.signal
    electric = s.current * u.current + s.power * (u.power - s.resistance * (u.current * u.current))
    return s.torque * u.torque + electric - s.zero


class Balance(NamedTuple):
    """The balance of the shaft with the estimated loads: its `inertia` [kg m2], its acceleration [rad/s2], the
    `gradient` of this by the unknowns in the order of `UNKNOWNS`, the state of the machine, and the share of its
    torque that the rotor feels (`felt_share`)."""

    inertia: Any
    acceleration: Any
    gradient: list[Any]
    machine: MachineState
    felt: Any


def balance(xp: Any, p: Any, u: Any, x: Any) -> Balance:
    """The balance of the shaft at the estimates `x`, with exact derivatives."""
    loads = [
        x.left.material_mass,
        x.right.material_mass,
        x.left.processing_force,
        x.right.processing_force,
    ]
    w, ratio = x.speed / p.ratio, p.ratio

    def linkage(engine: Any, values: list[Any]) -> Any:
        sides = (
            SideLoads(material_mass=m, processing_force=f)
            for m, f in zip(values[:2], values[2:], strict=True)
        )
        return ChamberForces.linkage(engine, p, machine_inputs(u, x.speed, *sides))

    m = Mechanism(xp, linkage(xp, loads), u.phi / ratio, (), ChamberForces.topology)
    s = MachineState(xp, m, w)
    load, load_inertia = s.bias / ratio, s.J / (ratio * ratio)
    driving = rotor_torque(p, u) - x.torque_offset - p.rotor.d * x.speed
    a = geared_acceleration(xp, load, load_inertia, x.speed, p.rotor.J, driving, p.gear.loss)
    felt = felt_share(xp, p.gear.loss, load_inertia * a + load, x.speed)
    inertia = felt_inertia(xp, p.rotor.J, felt * load_inertia)

    engine = dual(xp)
    turning = MachineState(engine, m, Dual(w, 1.0 / ratio))
    gradient = [-(p.rotor.d + felt * slope(turning.bias) / ratio) / inertia]
    rotor_at_crank = p.rotor.J * (ratio * ratio)
    for k in range(len(loads)):
        seeded = [Dual(v, 1.0) if i == k else v for i, v in enumerate(loads)]
        one = MachineState(engine, m.with_bodies(linkage(engine, seeded)), w)
        at_crank = slope(felt_inertia(engine, rotor_at_crank, felt * one.J))
        gradient.append(-(felt * slope(one.bias) + at_crank * (a / ratio)) / (ratio * inertia))
    return Balance(inertia, a, [*gradient, -1.0 / inertia], s, felt)


def sizes(p: Any) -> list[Any]:
    """The sizes of the unknowns, in parts of which the covariances are stored."""
    return [p.noise.w, p.feed.spread, p.feed.spread, p.force.spread, p.force.spread, p.offset.spread]


def densities(p: Any) -> list[Any]:
    """The densities of the noise that drives the unknowns after the speed, in parts of their sizes [1/s]."""
    shares = (p.feed.change / p.feed.spread, p.force.change / p.force.spread)
    feed, force = (share * share for share in shares)
    offset = p.offset.change / p.offset.spread
    return [feed, feed, force, force, offset * offset]


class _Judgement(NamedTuple):
    """An imbalance, its standard deviation, and its threshold."""

    value: Any
    deviation: Any
    threshold: Any

    @property
    def share(self) -> Any:
        """The imbalance in parts of the threshold."""
        return self.value / self.threshold


def _judge(
    xp: Any, p: Any, x: Any, unknown: int, value: Any, load: Any, usual: Any, uncertainty: Any
) -> _Judgement:
    """The judgement of an imbalance; `unknown` is the place of its left side, `load` the parameters of the load,
    `usual` its natural fluctuation."""
    size = load.spread * load.spread
    variance, quiet = (
        xp.maximum(difference(symmetric(_entries(matrix)), unknown, unknown + 1), _LEAST) * size
        for matrix in (x.covariance, x.quiet)
    )
    natural, permanent = 2.0 * (usual * usual), uncertainty * uncertainty
    deviation = xp.sqrt(natural + quiet + permanent)
    # the innovations of a filter that follows both sides move its estimate as much as the loads may move
    diffusion = DIFFUSION * load.change * load.change
    turn = 2.0 * math.pi * p.ratio / xp.maximum(xp.abs(x.speed), SLOWEST * p.ratio)
    # each of the two grounds has half of the false alarms
    z = level(xp, deviation * deviation / (diffusion * turn), 0.5e-6 * p.alarm.rate)
    noise = p.noise.w * p.noise.w / (2.0 * ONSET * p.noise.rate)
    # a load that begins to jump
    widening = xp.maximum(1.0, x.surprise * x.surprise / (0.25 * GATE * GATE * noise))
    return _Judgement(value, xp.sqrt(variance + permanent), z * deviation * widening)


def _entries(covariance: Any) -> list[Any]:
    return [getattr(covariance, name) for name in ENTRIES]


def _bounded(xp: Any, rate: Any, estimate: Any, load: Any) -> Any:
    """The rate of an estimated load, limited so that the estimate reaches its bounds in no less than `ONSET`; `load`
    has the parameters of the load."""
    deviation, farthest = estimate - load.expected, FARTHEST * load.spread
    return xp.maximum(xp.minimum(rate, (farthest - deviation) / ONSET), (-farthest - deviation) / ONSET)


def _filter_rates(xp: Any, p: Any, u: Any, x: Any, b: Balance, jump: Any) -> list[Any]:
    """Rates of the states; `jump` is the rate at which the variance of the forces grows by a jump, in parts of their
    spread squared."""
    scale, rate = sizes(p), p.noise.rate
    gradient = [g * size / scale[0] for g, size in zip(b.gradient, scale, strict=True)]
    signal = p.noise.torque / (b.inertia * scale[0])
    driven = densities(p)
    decay = [0.0, *(0.5 * q for q in driven)]
    jumps = [jump * (FEED_JUMP * FEED_JUMP), jump * (FEED_JUMP * FEED_JUMP), jump, jump, 0.0]
    P, quiet = symmetric(_entries(x.covariance)), symmetric(_entries(x.quiet))
    gain = [row[0] * rate for row in P]
    first = signal * signal / rate
    followed = [first, *(q + more for q, more in zip(driven, jumps, strict=True))]
    disturbed = [first, *(q + more for q, more in zip(_disturbances(p), jumps, strict=True))]
    difference_of_speed = u.w - x.speed
    share = _plausible(p, difference_of_speed)
    correction = [
        k * size * (share * difference_of_speed / scale[0]) for k, size in zip(gain, scale, strict=True)
    ]
    speed, left_feed, right_feed, left_force, right_force, offset = correction
    return [
        b.acceleration + speed + (1.0 - share) * difference_of_speed * (2.0 / ONSET),
        _bounded(xp, left_feed, x.left.material_mass, p.feed),
        _bounded(xp, left_force, x.left.processing_force, p.force),
        _bounded(xp, right_feed, x.right.material_mass, p.feed),
        _bounded(xp, right_force, x.right.processing_force, p.force),
        offset,
        (difference_of_speed - x.surprise) / ONSET,
        *covariance_rates(P, gradient, decay, followed, rate),
        *error_rates(quiet, gain, gradient, decay, disturbed, rate),
    ]


def _disturbances(p: Any) -> list[Any]:
    """The densities of the disturbances in normal running, in parts of the sizes [1/s]. The feed has none: the filter
    follows its fluctuation, whose whole variance counts in the threshold."""
    share = p.force.fluctuation / p.force.spread
    force = 2.0 * share * share / p.force.time
    offset = p.offset.change / p.offset.spread
    return [0.0, 0.0, force, force, offset * offset]


def _lever(p: Any, share: float = 1.0) -> Any:
    """The largest lever of a processing force on the rotor [m], with the loss of the gear; or a `share` of it."""
    return (1.0 + p.gear.loss) * (share * p.r * p.e / (p.h * p.ratio))


def _plausible(p: Any, deviation: Any) -> Any:
    """The share of a deviation of the speed [rad/s] from which loads are learned: less and less beyond the speed that
    a jam takes within `ONSET`. A larger one is no load: the measured speed has jumped, as if the observer starts
    with another speed."""
    most = GATE * p.noise.w + 2.0 * _lever(p) * p.force.spread / p.rotor.J * ONSET
    square = (deviation / most) * (deviation / most)
    return 1.0 / (1.0 + square * square)


def _jump(xp: Any, p: Any, x: Any, b: Balance) -> Any:
    """The rate at which the variance of the forces grows while the speed is off, in parts of their spread squared."""
    noise = p.noise.w * p.noise.w / (2.0 * ONSET * p.noise.rate)
    beyond = xp.maximum(x.surprise * x.surprise - (GATE * GATE) * noise, 0.0) / (ONSET * ONSET)
    spreads = [FEED_JUMP * p.feed.spread] * 2 + [p.force.spread] * 2
    explained = [g * spread for g, spread in zip(b.gradient[1:5], spreads, strict=True)]
    # a part of the lever of B, so that the sum is not zero in a dead position
    lever = _lever(p, 0.2) * p.force.spread / b.inertia
    jump = xp.minimum(beyond / (sum(e * e for e in explained) + lever * lever), 4.0) / ONSET
    return jump * _plausible(p, x.surprise)


def _outputs(xp: Any, p: Any, u: Any, x: Any, b: Balance) -> Outputs:
    """The outputs at the states `x`: the differences of the sides, left less right, each with its threshold; by side
    the uncertainty of its loads, the pull of its web and the probability of an overload; and the alarm, the side (+1
    or -1) on which a difference passes its threshold, else 0."""
    probes = _probes_of_machine(xp, p, u, x, b)
    natural, limits = p.feed.fluctuation * p.feed.expected, p.imbalance
    feed_difference = x.left.material_mass - x.right.material_mass
    force_difference = x.left.processing_force - x.right.processing_force
    feed = _judge(xp, p, x, FEED, feed_difference, p.feed, natural, limits.uncertainty)
    force = _judge(xp, p, x, FORCE, force_difference, p.force, p.force.fluctuation, limits.force_uncertainty)
    left = xp.maximum(feed.share, force.share)
    right = xp.maximum(-feed.share, -force.share)
    side = 2.0 * step(xp, left, right) - 1.0

    def judged(name: str, sign: float) -> SideJudgement:
        """The judgement of a side; with its `sign` a difference counts as more load on it."""
        beside = 0 if sign > 0.0 else 1
        by_feed = (sign * feed.value - limits.overload) / feed.deviation
        by_force = (sign * force.value - limits.force_overload) / force.deviation
        return SideJudgement(
            material_mass_deviation=_deviation(xp, x, FEED + beside, p.feed.spread),
            processing_force_deviation=_deviation(xp, x, FORCE + beside, p.force.spread),
            web_pull=probes[name].web_pull,
            overload=normal_probability(xp, xp.maximum(by_feed, by_force)),
        )

    return Outputs(
        left=judged("left", 1.0),
        right=judged("right", -1.0),
        imbalance=Imbalance(
            feed=feed.value,
            feed_deviation=feed.deviation,
            feed_threshold=feed.threshold,
            force=force.value,
            force_deviation=force.deviation,
            force_threshold=force.threshold,
        ),
        rocker=RockerEstimate(tau=probes["rocker"].tau),
        grounds=Grounds(feed=feed.share, force=force.share),
        alarm=side * step(xp, xp.maximum(left, right), 1.0),
    )


def _probes_of_machine(xp: Any, p: Any, u: Any, x: Any, b: Balance) -> dict[str, Any]:
    """The outputs of the machine with the estimated loads, by name, see `ChamberForces.probes`."""
    left, right = (
        SideLoads(material_mass=side.material_mass, processing_force=side.processing_force)
        for side in (x.left, x.right)
    )
    inputs = machine_inputs(u, x.speed, left, right, b.acceleration)
    return ChamberForces.probes(xp, p, inputs, b.machine, b.acceleration / p.ratio)


def _deviation(xp: Any, x: Any, unknown: int, spread: Any) -> Any:
    """The standard deviation of an estimated load, by its place in `UNKNOWNS`, in the unit of its `spread`."""
    name = UNKNOWNS[unknown]
    return xp.sqrt(xp.maximum(getattr(x.covariance, f"{name}_{name}"), _LEAST)) * spread


def _rates(xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
    """Time derivatives of the states, in declared order."""
    b = balance(xp, p, u, x)
    return _filter_rates(xp, p, u, x, b, _jump(xp, p, x, b))


def _start_states(xp: Any, p: Any, u: Any, z: list[Any]) -> Any:
    """The usual loads, and the measured speed."""
    side = LoadEstimate(material_mass=p.feed.expected, processing_force=p.force.expected)
    # the speed as if it had been averaged over 10 ms
    variances = [xp.minimum(100.0 / p.noise.rate, 1.0), 1.0, 1.0, FIRST_FORCE, FIRST_FORCE, 1.0]
    start = {name: variances[i] if i == j else 0.0 for name, (i, j) in zip(ENTRIES, TRIANGLE, strict=True)}
    return States(
        speed=u.w,
        left=side,
        right=side,
        torque_offset=0.0,
        surprise=0.0,
        covariance=Covariance(**start),
        quiet=Covariance(**start),
    )


def _internal_step(xp: Any, p: Any) -> Any:
    """Longest internal step: 2 ms, or the time in which the filter finds loads that have jumped by their spread,
    if this is shorter."""
    unknown = _lever(p) * (2.0 * p.force.spread + 2.0 * p.g * p.feed.spread) + p.offset.spread
    jerk = unknown / (p.rotor.J * p.noise.w)
    # of the cubic pole of a speed that an unknown acceleration drives
    pole = xp.exp(xp.log(jerk * jerk * p.noise.rate) * (1.0 / 3.0))
    return xp.minimum(2e-3, 1.5 / pole)


LoadObserver = Model(
    name="LoadObserver",
    home=__name__,
    text="""An observer of the feed and the processing forces of a chain unit beside its motor.

    Connect phi and w, and one of the signals. In a co-simulation the inputs are held over a step: estimates are late
    by half a step.
    """,
    # the torque that holds the machine nearly at rest: in the reference results no load jumps
    fmu_data=FmuData(sizes={"w": 0.05, "current": 0.1}),
    description=(
        "Observer of a chain unit: from motion and a measured signal of the motor to feed and processing force of "
        "each side with standard deviations, and an alarm where one side is overloaded"
    ),
    Parameters=Parameters,
    Inputs=Inputs,
    States=States,
    parts=(Part(Outputs, _outputs),),
    required=ChamberForces.required,
    requirements=ChamberForces.requirements,
    terminals=(measured_terminal(torque="torque", current="current", power="power"),),
    shared=balance,
    derivatives=_rates,
    start_states=_start_states,
    internal_step=_internal_step,
)
