"""A driveline with a cardan shaft in rotation: its steady motion, Floquet stability, and time simulation.

There are two inertias with the line between them (`cardan.Twist`) and a constant torque on each: J1 w1' = M1 - tau1,
J4 w4' = tau4 - M4, with the states phi1, w1, phi4, w4. The ratio i23 varies twice a turn. It excites the line (orders
2, 4, ... of the speed), and it changes the stiffness of the line in step with the motion: parametric excitation. The
exact equations contain both. Hill's equation with the frozen frequency k(t) alone would be wrong, since a disturbance
of phi1 also shifts the kinematic excitation.

A steady motion repeats itself after half a turn. Shooting finds it: Newton's method with the exact variational
equations (dual numbers). These also give the Floquet multipliers, in two ways. The *free* line has constant torques
and four multipliers, one of which is 1: the shift along the orbit. In the *held* line the common speed of both
inertias, (J1 w1 + J4 w4)/(J1 + J4), follows the steady motion, as under a good speed control; its two multipliers are
torsional. The difference comes from the drive: above a resonance faster running takes less torque, so that a constant
torque does not hold the speed (Sommerfeld's effect). All functions are vectorised: speeds, bends, dampings and loads
may be arrays of one shape (n,).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from ..core.engines import Dual, dual, numpy_, value
from ..core.integrators import rk4
from ..core.quantities import quantity
from ..reading.results import derived, part, result
from ..work.progress import Progress
from .cardan import Cardan, Twist, frozen_frequency, largest_frequency, middle_angle, two_joints

HALF_TURN = np.array([math.pi, 0.0, math.pi, 0.0])
STEPS_PER_PERIOD = 32
"""Steps per period of the natural vibration."""
STEPS_PER_HARMONIC = 12
"""Steps per period of each harmonic of the ratio i23."""

ROUNDOFF_TORQUE = 1e-6
"""Torque up to which it is roundoff [N m]."""
_ITERATIONS = 12
_AGAIN = 8  # iterations from a neighbour, which is near
_WALKS = (1, 1, 6)
_CLOSED = 1e-9
_NOISE = 1e-5  # error of a multiplier by the steps: without it that of an undamped line is 1
_LARGEST_STEP = 0.3  # largest change of the unknowns of shooting, in rad and shares of the speed
_NEWTON = 2  # steps from the twist of the stage before, 1e-3 away: the error is then 1e-12


def _nothing(_: float) -> None:
    pass


def expand(p: Cardan, n: int) -> Cardan:
    """The same line with every value an array of shape (n,)."""
    return dataclasses.replace(
        p, **{f.name: np.broadcast_to(getattr(p, f.name), (n,)) for f in dataclasses.fields(p)}
    )


def _pick(p: Cardan, places: Any) -> Cardan:
    """The lines at some `places` of arrays of lines."""
    return dataclasses.replace(p, **{f.name: getattr(p, f.name)[places] for f in dataclasses.fields(p)})


def half_turn_steps(p: Cardan, speed: Any) -> Any:
    """Number of steps of a half turn that resolves the vibration and the ratio, with the shape of `speed`.

    Harmonic n of i23 of a joint is proportional to tan(bend/2)^(2n); harmonics down to 1e-4 count.
    """
    steep = np.maximum(np.tan(0.5 * np.maximum(p.alpha1, p.alpha2)), 0.05)
    harmonics = 1.0 + 0.5 * math.log(1e-4) / np.log(steep)
    periods = largest_frequency(numpy_(), p) / (2.0 * np.asarray(speed))
    return np.ceil(np.maximum(STEPS_PER_HARMONIC * harmonics, STEPS_PER_PERIOD * periods)).astype(int)


class _LineRates:
    """Right-hand sides with `duration` as the unit of time. The object keeps the twist of shaft 2, from which the
    next search for the balance of the cardan starts, and both torques at the start of each step. `held`, shape
    (slopes, 1), is 1 for the slopes of dual numbers with the common speed held, else 0."""

    def __init__(self, p: Cardan, load: Any, duration: Any, drive: Any, held: Any = None) -> None:
        self.p, self.load, self.duration, self.drive, self.held = p, load, duration, drive, held
        self.plain = numpy_()
        self.dual = dual(self.plain)
        self.twist: Any = 0.0
        self.torque2: list[Any] = []
        self.torque3: list[Any] = []

    def __call__(self, time: float, x: Sequence[Any]) -> list[Any]:
        """The derivatives of the states phi1, w1, phi4, w4 `x` by the time, which is in parts of the duration; the
        states are numbers, or dual numbers for slopes."""
        phi1, w1, phi4, w4 = x
        is_dual = isinstance(phi1, Dual)
        near = value(phi1) - self.twist
        if is_dual:
            # at the root one more Newton step in dual numbers gives the exact slopes
            near = middle_angle(self.plain, self.p, phi1.v, phi4.v, near, _NEWTON)
            line = Twist(self.dual, self.p, phi1, w1, phi4, w4, near, 1)
        else:
            line = Twist(self.plain, self.p, phi1, w1, phi4, w4, near, _NEWTON)
        self.twist = value(line.twist2)
        if time == 0.0:
            for record, torque in (
                (self.torque2, line.twist2 * self.p.c2),
                (self.torque3, line.twist3 * self.p.c3),
            ):
                record.append(value(torque))
        a1, a4 = (self.drive - line.tau1) / self.p.J1, (line.tau4 - self.load) / self.p.J4
        if is_dual and self.held is not None:
            # the control of the common speed pulls both inertias in proportion to themselves
            common = (self.p.J1 * a1.d + self.p.J4 * a4.d) / (self.p.J1 + self.p.J4) * self.held
            a1, a4 = Dual(a1.v, a1.d - common), Dual(a4.v, a4.d - common)
        return [rate * self.duration for rate in (w1, a1, w4, a4)]

    def steps(self, x: list[Any], count: int, size: float, progress: Progress = _nothing) -> list[Any]:
        for i in range(count):
            x = rk4(self, x, size, size)
            progress((i + 1) / count)
        return x


@result
class SteadyMotion:
    """Steady motions at n points, with arrays of shape (n,); NaN where none was found."""

    exists: Any = part("whether a steady motion was found", name="found")
    start: Any
    """phi1, w1, phi4, w4 where phi1 = 0 [rad, rad/s], (4, n)"""
    drive: Any = part("torque on J1 that keeps the mean speed", unit="N.m", name="drive_torque")
    largest2: Any = part(
        "largest elastic torque c2 (phi1 - phi2) of shaft 2 over the turn", unit="N.m", name="largest_torque2"
    )
    least2: Any = part("least elastic torque of shaft 2", unit="N.m", name="least_torque2")
    largest3: Any = part("largest elastic torque of shaft 3", unit="N.m", name="largest_torque3")
    least3: Any = part("least elastic torque of shaft 3", unit="N.m", name="least_torque3")
    multiplier: Any = part(
        "larger absolute value of the two torsional Floquet multipliers of half a turn, common speed held",
        unit="1",
        name="largest_multiplier",
    )
    growth: Any = quantity("1/s", "rate of growth of a small torsional disturbance, negative where it decays")
    frequency: Any = quantity(
        "rad/s",
        "frequency of the damped torsional vibration: the branch next to k at i23 = 1",
        kind="frequency",
    )
    free_growth: Any = part(
        "rate of growth with constant torques, the fastest one without the shift along the orbit",
        unit="1/s",
        name="growth_with_constant_torque",
    )
    monodromy: Any
    """monodromy matrix of phi1, w1, phi4, w4 over half a turn with constant torques, (4, 4, n)"""

    @property
    def unstable(self) -> Any:
        """Whether a torsional disturbance grows, bool, (n,); False where nothing was found."""
        return self.multiplier > 1.0 + _NOISE

    @derived("N.m", name="peak_torque2")
    def peak2(self) -> Any:
        """Largest torque of shaft 2, either way."""
        return np.maximum(np.abs(self.largest2), np.abs(self.least2))

    @derived("N.m", name="peak_torque3")
    def peak3(self) -> Any:
        """Largest torque of shaft 3, either way."""
        return np.maximum(np.abs(self.largest3), np.abs(self.least3))

    @classmethod
    def joined(cls, motions: Sequence[SteadyMotion], order: Any) -> SteadyMotion:
        """All points of some motions, in this order."""
        columns = zip(*(vars(motion).values() for motion in motions), strict=True)
        return cls(*(np.concatenate(column, axis=-1)[..., order] for column in columns))


def steady(
    p: Cardan, speed: Any, load: Any = 0.0, progress: Progress = _nothing, chunk: int = 1024
) -> SteadyMotion:
    """The motion that repeats itself after half a turn at the mean `speed` [rad/s], with the torque `load` [N.m] on
    J4, and its stability.

    Values of `p` may be numbers or arrays of the shape (n,) of `speed`. Points with similar numbers of steps are
    computed together, at most `chunk` at a time. A point without a result is tried again from its neighbours: give
    the speeds in order.
    """
    speed = np.atleast_1d(np.asarray(speed, dtype=float))
    n = len(speed)
    p, load = expand(p, n), np.broadcast_to(np.asarray(load, dtype=float), (n,))
    phi3, ratio, _ = two_joints(numpy_(), p, np.zeros(n))
    guess = np.stack([np.zeros(n), speed, phi3 - load / p.c3, speed * np.sqrt(ratio), load])
    motion = _in_batches(p, speed, load, guess, chunk, _ITERATIONS, lambda x: progress(0.8 * x))
    # near a resonance Newton's method has to start from a neighbour and go to the speed in steps
    for walk in _WALKS:
        for side in (-1, 1):
            gaps = np.flatnonzero(~motion.exists)
            gaps = gaps[(gaps + side >= 0) & (gaps + side < n)]
            gaps = gaps[motion.exists[gaps + side]]
            if not len(gaps):
                continue
            beside, q = gaps + side, _pick(p, gaps)
            guess = np.concatenate([motion.start[:, beside], motion.drive[None, beside]])
            for stage in range(1, walk + 1):
                there = speed[beside] + stage / walk * (speed[gaps] - speed[beside])
                again = _in_batches(q, there, load[gaps], guess, chunk, _AGAIN, _nothing)
                guess = np.concatenate([again.start, again.drive[None]])
            for name, whole in vars(motion).items():
                whole[..., gaps] = getattr(again, name)
    progress(1.0)
    return motion


def _in_batches(
    p: Cardan, speed: Any, load: Any, guess: Any, chunk: int, iterations: int, progress: Progress
) -> SteadyMotion:
    """The motions of all points, as `_shoot` has them: batches of at most `chunk` points with similar numbers of
    steps, each with the largest one of them."""
    counts = half_turn_steps(p, speed)
    order = np.argsort(counts, kind="stable")
    motions, before = [], 0.0
    for first in range(0, len(speed), chunk):
        batch = order[first : first + chunk]
        share, count = len(batch) / len(speed), int(max(counts[batch]))
        batch_progress = partial(lambda before, share, x: progress(before + share * x), before, share)
        line = _pick(p, batch)
        motions.append(
            _shoot(line, speed[batch], load[batch], guess[:, batch], count, iterations, batch_progress)
        )
        before += share
    return SteadyMotion.joined(motions, np.argsort(order, kind="stable"))


def _shoot(
    p: Cardan, speed: Any, load: Any, guess: Any, count: int, iterations: int, progress: Progress
) -> SteadyMotion:
    """The motions of n lines that repeat themselves after half a turn, by Newton's method on the states at its begin
    (multiple lines at once: a line that is done, or has no finite values, takes part no longer).

    Parameters
    ----------
    p, speed, load : of shape (n,), see `steady`
    guess : phi1, w1, phi4, w4 and the torque on J1 to start from, shape (5, n)
    count : number of steps of a half turn
    iterations : most iterations
    """
    n = len(speed)
    period = math.pi / speed
    scale = np.stack([np.ones(n), speed, np.ones(n), speed])
    # phi1 = 0 fixes the phase; the unknowns are the other states and the torque on J1
    weights = np.concatenate([scale[1:], np.maximum(np.abs(load), p.J1 * speed**2)[None]])
    x, drive = guess[:4].copy(), guess[4].copy()
    exists = np.zeros(n, dtype=bool)
    active = np.arange(n)
    extremes = {name: np.full(n, np.nan) for name in ("largest2", "least2", "largest3", "least3")}
    monodromy, held = np.full((4, 4, n), np.nan), np.full((2, 2, n), np.nan)
    with np.errstate(all="ignore"):
        for iteration in range(iterations):
            line = _pick(p, active)
            end, by, equations = _half_turn(
                line, x[:, active], drive[active], load[active], period[active], count
            )
            error = (end - x[:, active] - HALF_TURN[:, None]) / scale[:, active]
            at_goal = np.max(np.abs(error), axis=0) < _CLOSED
            new = active[at_goal]
            exists[new] = True
            for number in ("2", "3"):
                torque = np.array(getattr(equations, f"torque{number}"))[:, at_goal]
                extremes[f"largest{number}"][new] = torque.max(0)
                extremes[f"least{number}"][new] = torque.min(0)
            monodromy[:, :, new] = by[:, :4, at_goal]
            held[:, :, new] = (by[:2, 5:] - by[2:, 5:])[:, :, at_goal]
            progress((iteration + 1) / iterations)
            # points with infinite values are given up
            rest = ~at_goal & np.all(np.isfinite(error), axis=0) & np.all(np.isfinite(by), axis=(0, 1))
            if not np.any(rest):
                break
            active = active[rest]
            change = _newton_step(error[:, rest], by[:, 1:5, rest], scale[:, active], weights[:, active])
            x[1:, active] += change[:3]
            drive[active] += change[3]
    progress(1.0)
    x[:, ~exists], drive[~exists] = np.nan, np.nan
    multiplier, angle, free = np.full((3, n), np.nan)
    if np.any(exists):
        torsional = np.linalg.eigvals(np.moveaxis(held[:, :, exists], 2, 0))
        multiplier[exists] = np.max(np.abs(torsional), axis=1)
        angle[exists] = np.abs(np.angle(torsional[:, 0]))
        line = _pick(p, exists)
        free[exists] = _free(line, x[:, exists], drive[exists], load[exists], monodromy[:, :, exists])
    k = frozen_frequency(numpy_(), p, 1.0)
    return SteadyMotion(
        exists=exists,
        start=x,
        drive=drive,
        **{
            name: np.where(np.abs(torque) < ROUNDOFF_TORQUE, 0.0, torque) for name, torque in extremes.items()
        },
        multiplier=multiplier,
        growth=np.log(multiplier) / period,
        frequency=_branch(angle, k * period) / period,
        free_growth=np.log(free) / period,
        monodromy=monodromy,
    )


def _newton_step(error: Any, by: Any, scale: Any, weights: Any) -> Any:
    """The change of w1, phi4, w4 and the torque on J1, shape (4, n), that takes the `error` of the states after half
    a turn away, shape (4, n), by least squares; of the states at most `_LARGEST_STEP` of their weights.

    Parameters
    ----------
    error : in parts of `scale`, the sizes of the states, shape (4, n)
    by : the slopes of the states after half a turn by w1, phi4, w4 and the torque, shape (4, 4, n)
    weights : the sizes of the slopes, shape (4, n)
    """
    matrix = by - np.eye(4, 5)[:, 1:, None]
    matrix = np.moveaxis(matrix * weights[None] / scale[:, None], 2, 0)
    change = -(np.linalg.pinv(matrix) @ error.T[:, :, None])[:, :, 0].T
    change *= np.minimum(1.0, _LARGEST_STEP / np.max(np.abs(change[:3]), axis=0))
    return change * weights


def _branch(angle: Any, near: Any) -> Any:
    """The angle next to `near` among all angles with the cosine of `angle`."""
    turn = 2.0 * math.pi
    first = angle + turn * np.round((near - angle) / turn)
    second = -angle + turn * np.round((near + angle) / turn)
    return np.where(np.abs(first - near) < np.abs(second - near), first, second)


def _half_turn(
    p: Cardan, x: Any, drive: Any, load: Any, period: Any, count: int
) -> tuple[Any, Any, _LineRates]:
    """States (4, n) after half a turn and their slopes (4, 7, n): by the four states at its start, by the drive, and
    by the twist phi1 - phi4 and its speed with the common speed held."""
    seeds = np.zeros((5, 7, x.shape[1]))
    seeds[range(5), range(5)] = 1.0
    share = p.J1 / (p.J1 + p.J4)
    for i in range(2):
        seeds[i, 5 + i], seeds[2 + i, 5 + i] = 1.0 - share, -share
    states: list[Any] = [Dual(x[i], seeds[i]) for i in range(4)]
    held = np.array([[0.0]] * 5 + [[1.0]] * 2)
    equations = _LineRates(p, load, period, Dual(drive, seeds[4]), held)
    states = equations.steps(states, count, 1.0 / count)
    return np.stack([s.v for s in states]), np.stack([s.d for s in states]), equations


def _free(p: Cardan, x: Any, drive: Any, load: Any, monodromy: Any) -> Any:
    """Largest absolute multiplier of the line with constant torques, without the shift along the orbit, (n,).

    The shift x' has the multiplier 1. It is removed exactly, since the multiplier of the mean speed is so near to it
    that rounding would mix the two.
    """
    k = np.sqrt(p.c2 / p.J1)
    scale = np.stack([np.ones_like(k), k, np.ones_like(k), k])
    along = np.stack(_LineRates(p, load, 1.0, drive)(1.0, list(x))) / scale
    basis = np.repeat(np.eye(4)[None], len(k), axis=0)
    basis[:, :, 0] = along.T
    rotation, _ = np.linalg.qr(basis)
    matrix = np.moveaxis(monodromy * scale[None] / scale[:, None], 2, 0)
    rest = np.linalg.eigvals((np.swapaxes(rotation, 1, 2) @ matrix @ rotation)[:, 1:, 1:])
    return np.max(np.abs(rest), axis=1)


@result
class SimulatedPeaks:
    """Peaks of the last half turns of a time simulation at n speeds, with arrays of shape (n,)."""

    asked_speed: Any = quantity("rad/s", "speed at which the line should run", kind="speed")
    speed: Any = quantity("rad/s", "mean speed over these half turns", kind="speed")
    peak2: Any = part("largest elastic torque of shaft 2, either way", unit="N.m", name="peak_torque2")
    peak3: Any = part("largest elastic torque of shaft 3, either way", unit="N.m", name="peak_torque3")


def settling_time(p: Cardan, share: float = 1e-3) -> float:
    """Time [s] in which a torsional disturbance falls to `share` by the damping of the shafts; inf without
    damping."""
    rate = damping_ratio(p) * float(frozen_frequency(numpy_(), p, 1.0))
    return -math.log(share) / rate if rate > 0.0 else math.inf


def damping_ratio(p: Cardan) -> float:
    """Damping ratio of the torsional vibration at i23 = 1, to first order in the damping: both shafts are weighted by
    their shares of the twist."""
    k = float(frozen_frequency(numpy_(), p, 1.0))
    soft2, soft3 = 1.0 / p.c2, 1.0 / p.c3
    return 0.5 * k * (p.d2 * soft2**2 + p.d3 * soft3**2) / (soft2 + soft3)


def simulation_steps(p: Cardan, speed: Any, settle: float) -> float:
    """Number of steps of `simulate` until all speeds have settled."""
    speed = np.atleast_1d(np.asarray(speed, dtype=float))
    counts, wait = half_turn_steps(expand(p, len(speed)), speed), _wait(speed, settle)
    return float(np.max(np.ceil(wait * speed / math.pi) * counts))


def _wait(speed: Any, settle: float) -> Any:
    return np.maximum(settle, 50.0 * math.pi / speed)


def simulate(
    p: Cardan, speed: Any, load: float, settle: float, half_turns: int = 2, progress: Progress = _nothing
) -> SimulatedPeaks:
    """Time simulation at each mean `speed` [rad/s] from a start without twist; peaks of the last `half_turns`, after
    the time `settle` [s], or 50 half turns if this is longer.

    A slow PI control of the torque on J1 holds the mean speed. It gets the common speed of both inertias through a
    low pass of two half turns, which neither vibration nor ripple passes.
    """
    speed = np.atleast_1d(np.asarray(speed, dtype=float))
    n = len(speed)
    q = expand(p, n)
    period = math.pi / speed
    counts = half_turn_steps(q, speed)
    wait = _wait(speed, settle)
    steps = int(simulation_steps(p, speed, settle))
    window = half_turns * counts
    gain, slow = 10.0 / wait, 2.0 * period
    h = period / counts
    inertia = p.J1 + p.J4
    equations = _LineRates(q, load, h, load)

    def rates(time: float, x: Sequence[Any]) -> list[Any]:
        common, bias = x[4], x[5]
        deviation = common - speed
        equations.drive = load - inertia * (gain * deviation + bias)
        now = (p.J1 * x[1] + p.J4 * x[3]) / inertia
        return [*equations(time, x[:4]), (now - common) / slow * h, 0.25 * gain * gain * deviation * h]

    phi3, i, _ = two_joints(numpy_(), q, np.zeros(n))
    w1 = speed * np.sqrt(inertia / (p.J1 + i * i * p.J4))
    x: list[Any] = [np.zeros(n), w1, phi3, i * w1, speed.copy(), np.zeros(n)]
    peak2, peak3, begin, end = np.zeros((4, n))
    whole = steps + int(np.max(window)) + 1
    for step in range(whole):
        now, angle = step - steps, x[0]
        x = rk4(rates, x, 1.0, 1.0)
        torque2, torque3 = np.abs(equations.torque2.pop()), np.abs(equations.torque3.pop())
        if now >= 0:
            peak2 = np.where(now < window, np.maximum(peak2, torque2), peak2)
            peak3 = np.where(now < window, np.maximum(peak3, torque3), peak3)
            begin = np.where(now == 0, angle, begin)
            end = np.where(now == window, angle, end)
        if step % 50 == 0:
            progress(step / whole)
    progress(1.0)
    return SimulatedPeaks(speed, (end - begin) / (half_turns * period), peak2, peak3)


@result
class RigidPeaks:
    """Largest torques of the line with rigid shafts, each of shape (n,)."""

    peak2: Any = part("largest torque of shaft 2 of the rigid line", unit="N.m", name="rigid_torque2")
    peak3: Any = part("largest torque of shaft 3 of the rigid line", unit="N.m", name="rigid_torque3")


def rigid(p: Cardan, speed: Any, load: float, points: int = 720) -> RigidPeaks:
    """Peaks of the line with rigid shafts, by its energy: (J1 + i23^2 J4) w1^2/2 = E + M4 (phi1 - phi3)."""
    speed = np.atleast_1d(np.asarray(speed, dtype=float))[:, None]
    phi = np.linspace(0.0, math.pi, points, endpoint=False)
    phi3, i, slope = two_joints(numpy_(), p, phi)
    inertia = p.J1 + i * i * p.J4
    work = load * (phi - phi3)
    # Newton's method for the time of half a turn, a falling and convex function of E: from below it never oversteps
    excess = np.full_like(speed, 0.5 * np.min(inertia)) * speed**2
    work = work - np.min(work)
    for _ in range(60):
        time = np.mean(np.sqrt(0.5 * inertia / (excess + work)), axis=1, keepdims=True)
        by = -0.5 * np.mean(np.sqrt(0.5 * inertia) * (excess + work) ** -1.5, axis=1, keepdims=True)
        excess = np.maximum(excess - (time - 1.0 / speed) / by, 0.2 * excess)
    square = 2.0 * (excess + work) / inertia
    acceleration = (load * (1.0 - i) - i * slope * p.J4 * square) / inertia
    torque3 = load + p.J4 * (i * acceleration + slope * square)
    return RigidPeaks(np.max(np.abs(i * torque3), axis=1), np.max(np.abs(torque3), axis=1))
