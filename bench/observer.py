# %% [markdown]
# The load observer: false alarms, and chains as the plant
#
# False alarms: the estimates follow noise and fluctuation linearly, with gains that are periodic in the crank angle.
# So many machines are simulated at once, at 100 Hz on the periodic solution, with fluctuating feeds and forces and
# with noise; alarms are counted and compared with the permitted number.
#
# Chains: the observer knows two bars. With equal feed on chains it estimates a false imbalance, which grows with the
# speed; the table gives it in parts of the feed, over the crank speed in parts of the chains' lowest resonance.

# %%
from __future__ import annotations

import contextlib
import functools
import math
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from figures import parser, save, table

from chainunit.core import engines
from chainunit.fmu.native.export import export
from chainunit.machines.flexible import flexible
from chainunit.machines.load_filter import SIZE, TRIANGLE, UNKNOWNS
from chainunit.machines.load_observer import Inputs, LoadObserver, balance, sizes
from chainunit.models import MODELS
from chainunit.system import CompiledSimulation, ModelComponent, System, shaft_joints
from chainunit.system.instance import Fmu, Instance

STEP, SAMPLE = 1e-3, 10
"""Time between the rows of the course [s], and rows in a sample of the linear filter."""
TURN, RATIO = 2.1, 50.0
"""Time of a turn [s], a whole number of samples, and motor turns per crank turn."""
RUN_IN = 60.0
"""Time after which course and covariance repeat with each turn [s]."""
PERMITTED = ((1000.0, 10_000, 20), (1.0, 10_000, 200))
"""Permitted false alarms in a million turns, with the numbers of machines and of turns in which they are counted."""
SPEEDS = np.arange(1.0, 4.01, 0.25)
"""Speeds of the crank on chains [rad/s]."""
RESONANCE = 1.8
"""Lowest resonance of a chain in parts of sqrt(g/l1)."""


def course(machine, crank_speed, duration, ratio=RATIO):
    """Angle, speed and current of a DC motor on the machine, shape (3, rows)."""
    motor, speed = MODELS["DcMotor"], crank_speed * ratio
    system = System(
        {
            "machine": ModelComponent(machine, machine.parameter_layout.from_names({"ratio": ratio})),
            "motor": ModelComponent(motor, motor.parameter_layout.from_names({"w_start": speed})),
        },
        shaft_joints("motor", "machine"),
    )
    with CompiledSimulation(system, {"motor.w_ref": speed}) as simulation:
        names = ["motor.phi", "motor.w", "motor.armature.i"]
        run = simulation.run(duration, STEP, names=names)
    return np.array([run[name].values for name in names])


def noise_of(rows, share=0.01):
    """The observer's parameters for a noise of this share of the RMS of speed and torque."""
    rms = np.sqrt(np.mean(rows**2, axis=1))
    return {"noise.w": share * rms[1], "noise.torque": share * 1.27 * rms[2]}


def observe(file, rows, values, names):
    """The outputs of the observer's FMU beside a course, shape (names, rows)."""
    result = np.zeros((len(names), rows.shape[1]))
    with contextlib.closing(Fmu(file)) as fmu, contextlib.closing(Instance(fmu, "observer")) as unit:
        unit.initialize(values | dict(zip(("phi", "w", "current"), map(float, rows[:, 0]), strict=True)), 0.0)
        unit.finish_initialization()
        inputs, outputs = unit.handle(["phi", "w", "current"]), unit.handle(names)
        for k, row in enumerate(rows.T):
            unit.write(inputs, row)
            result[:, k] = unit.read(outputs)
            unit.step(k * STEP, STEP)
    return result


@dataclass(frozen=True)
class PeriodicFilter:
    """The filter on the periodic solution, by samples of a turn: `transitions` of fluctuations and errors, shape
    (samples, 10, 10), `roots` of the covariance of what noise adds, of the same shape, and the `thresholds` of feed
    and force, shape (samples, 2). The first four states are the deviations of the loads from their means, the others
    the errors of the estimates."""

    transitions: np.ndarray
    roots: np.ndarray
    thresholds: np.ndarray

    @functools.cached_property
    def covariance(self):
        """The covariance at the first sample, shape (10, 10)."""
        P = np.zeros((10, 10))
        for _ in range(200):
            for F, root in zip(self.transitions, self.roots, strict=True):
                P = F @ P @ F.T + root @ root.T
        return P

    def stationary(self):
        """Standard deviations of the estimated imbalances, shape (samples, 2)."""
        P = self.covariance
        rows = []
        for F, root in zip(self.transitions, self.roots, strict=True):
            rows.append(np.sqrt(np.diag(ESTIMATES @ P @ ESTIMATES.T)))
            P = F @ P @ F.T + root @ root.T
        return np.array(rows)

    def alarms(self, machines, turns, rng):
        """Alarms of many machines in so many turns, of each ground; an alarm within a turn after another one of the
        same machine is not counted."""
        samples, counts = len(self.transitions), np.zeros(2, int)
        rank = max(int(np.sum(root.any(axis=0))) for root in self.roots)
        factors = np.concatenate([self.transitions, self.roots[:, :, :rank]], axis=2).astype(np.float32)
        limits, read = self.thresholds.astype(np.float32), ESTIMATES.astype(np.float32)
        last = np.full((2, machines), -(10**9))
        both = np.empty((10 + rank, machines), np.float32)
        both[:10] = np.linalg.cholesky(self.covariance + 1e-9 * np.eye(10)) @ rng.standard_normal(
            (10, machines)
        )
        for k in range(turns * samples):
            at = k % samples
            both[10:] = rng.standard_normal((rank, machines), np.float32)
            raised = np.abs(read @ both[:10]) > limits[at][:, None]
            if raised.any():
                counts += np.count_nonzero(raised & (k - last > samples), axis=1)
                last[raised] = k
            both[:10] = factors[at] @ both
        return counts


ESTIMATES = np.zeros((2, 10))
"""The estimated imbalances of feed and force: those of the loads minus those of the errors."""
ESTIMATES[0, [0, 1, 5, 6]] = 1.0, -1.0, -1.0, 1.0
ESTIMATES[1, [2, 3, 7, 8]] = 1.0, -1.0, -1.0, 1.0


def periodic_filter(file, values):
    """The linear filter beside the packaged machine."""
    crank_speed = 2.0 * math.pi / TURN
    rows = course(MODELS["ChamberForces"], crank_speed, RUN_IN)
    values = noise_of(rows) | values
    p = LoadObserver.parameter_layout.from_names(values)
    first = [f"covariance.{UNKNOWNS[i]}_{UNKNOWNS[j]}" for i, j in TRIANGLE if i == 0]
    names = [*first, "imbalance.feed_threshold", "imbalance.force_threshold"]
    result = observe(file, rows, values, names)
    count = round(TURN / STEP)
    scale = np.array(sizes(p))
    times = np.array([p.feed.time] * 2 + [p.force.time] * 2)
    deviations = np.array([p.feed.fluctuation * p.feed.expected] * 2 + [p.force.fluctuation] * 2)
    last = slice(rows.shape[1] - count - 1, rows.shape[1])
    start = LoadObserver.begin(p, Inputs(w=2.0 * math.pi / TURN * RATIO))
    points = Inputs(phi=rows[0, last], w=rows[1, last], current=rows[2, last])
    # the estimates are the true loads and the true speed
    start = LoadObserver.state_layout.from_names({"speed": points.w}, start)
    gradients = np.array(
        [np.broadcast_to(g, points.phi.shape) for g in balance(engines.numpy_(), p, points, start).gradient]
    )
    transitions, roots, thresholds = [], [], []
    for begin in range(rows.shape[1] - count - 1, rows.shape[1] - 1, SAMPLE):
        F, noise = np.eye(10), np.zeros((10, 10))
        thresholds.append(result[SIZE:, begin])
        for k in range(begin, begin + SAMPLE):
            gradient = gradients[:, k - last.start]
            A = np.zeros((10, 10))
            gain = result[:SIZE, k] * p.noise.rate * scale / scale[0]
            A[4, 4:] = gradient
            A[4:, 4] -= gain
            fluctuation = np.zeros((10, 4))
            for n in range(4):
                A[n, n] = A[5 + n, n] = -1.0 / times[n]
                fluctuation[[n, 5 + n], n] = deviations[n] * math.sqrt(2.0 / times[n])
            driven = fluctuation @ fluctuation.T
            measured = np.array([*np.zeros(4), *gain]) * p.noise.w
            driven += np.outer(measured, measured) / p.noise.rate
            driven[4, 4] += (p.noise.torque * gradient[5]) ** 2 / p.noise.rate
            one = np.eye(10) + STEP * A + 0.5 * STEP**2 * A @ A
            F, noise = one @ F, one @ noise @ one.T + driven * STEP
        transitions.append(F)
        units = np.array([1.0, 1.0, 1.0, 1.0, *scale])
        size, vectors = np.linalg.eigh(noise / np.outer(units, units))
        size, vectors = size[::-1], vectors[:, ::-1]
        root = units[:, None] * vectors * np.sqrt(np.maximum(size, 0.0))
        roots.append(np.where(size > 1e-14 * size[0], root, 0.0))
    return PeriodicFilter(np.array(transitions), np.array(roots), np.array(thresholds))


def cost(file, rows, rounds=7):
    """The least mean time of a communication step of 1 ms through fmpy: three inputs, the step, the alarm [us]."""
    times = []
    with contextlib.closing(Fmu(file)) as fmu, contextlib.closing(Instance(fmu, "observer")) as unit:
        unit.initialize(noise_of(rows), 0.0)
        unit.finish_initialization()
        inputs, outputs, count = unit.handle(["phi", "w", "current"]), unit.handle(["alarm"]), 2000
        for part in range(rounds):
            began = time.perf_counter()
            for k in range(part * count, (part + 1) * count):
                unit.write(inputs, rows[:, k])
                unit.step(k * STEP, STEP)
                unit.read(outputs)
            times.append(1e6 * (time.perf_counter() - began) / count)
    return min(times)


def false_alarms(file, rate, machines, turns, seed=1, values=None):
    """False alarms in a turn, of feed and of force, and of both; the permitted rate is `rate` in a million turns."""
    periodic = periodic_filter(file, {"alarm.rate": rate, **(values or {})})
    counts = periodic.alarms(machines, turns, np.random.default_rng(seed))
    return counts, counts / (machines * turns), periodic


def chains(file, speeds, rods=(3, 1)):
    """The false imbalance of the feed on chains in parts of the feed of a side, by crank speed: its mean, and its
    largest size within a turn; and the mean on bars."""
    rows = []
    for speed in speeds:
        turn = 2.0 * math.pi / speed
        found = []
        for machine in (flexible(*rods), MODELS["ChamberForces"]):
            motion = course(machine, speed, max(40.0, 12.0 * turn), 150.0 / speed)
            values = noise_of(motion) | {"ratio": 150.0 / speed}
            (imbalance,) = observe(file, motion, values, ["imbalance.feed"])[:, -round(4.0 * turn / STEP) :]
            found.append((np.mean(imbalance) / 30.0, np.max(np.abs(imbalance)) / 30.0))
        rows.append((speed, *found[0], found[1][0]))
    return rows


def measured(folder, permitted=PERMITTED, speeds=SPEEDS):
    """All figures: false alarms for `permitted` rates in a million turns with so many machines and turns of each,
    and the false imbalance on chains at crank `speeds`."""
    file = export(MODELS["LoadObserver"], Path(folder) / "observer.fmu")
    alarms = []
    for rate, machines, turns in permitted:
        counts, _, periodic = false_alarms(file, rate, machines, turns)
        total, levels = machines * turns, periodic.thresholds / periodic.stationary()
        alarms.append(
            {
                "permitted": rate, "turns": total, "by_feed": int(counts[0]), "by_force": int(counts[1]),
                "found": 1e6 * int(counts.sum()) / total,
                "levels": [[float(level.min()), float(level.max())] for level in levels.T],
            }
        )  # fmt: skip
        print(f"{alarms[-1]['found']:g} of {rate:g} permitted false alarms in 1e6 turns", flush=True)
    resonance = RESONANCE * math.sqrt(9.81 / 1.35)
    return {
        "false_alarms": alarms,
        "step": cost(file, course(MODELS["ChamberForces"], 3.0, 15.0)),
        "chains": [
            {
                "speed": float(speed),
                "share": float(speed / resonance),
                "mean": mean,
                "most": most,
                "bars": bars,
            }
            for speed, mean, most, bars in chains(file, speeds)
        ],
    }


def share_below(figures, imbalance):
    """The largest speed in parts of the resonance up to which the false imbalance stays below this one."""
    share = 0.0
    for row in figures["chains"]:
        if row["most"] >= imbalance:
            break
        share = row["share"]
    return share


def tables(figures):
    """The tables and numbers of the figures in Markdown, by name."""
    alarms = (
        [
            f"{row['permitted']:g}", f"{row['turns']:,}", str(row["by_feed"]), str(row["by_force"]),
            f"{row['found']:.3g}", *(f"{low:.2f} to {high:.2f}" for low, high in row["levels"]),
        ]
        for row in figures["false_alarms"]
    )  # fmt: skip
    chains = (
        [
            f"{row['speed']:.2f}",
            f"{row['share']:.2f}",
            *(f"{100.0 * row[x]:.1f} %".replace("-0.0", "0.0") for x in ("mean", "most", "bars")),
        ]
        for row in figures["chains"]
    )
    return {
        "alarms": table(
            ["permitted in 1e6 turns", "turns", "by the feed", "by the force", "found in 1e6 turns",
             "threshold of the feed / deviation", "threshold of the force / deviation"], alarms,
        ),
        "chains": table(
            ["crank speed [rad/s]", "in parts of the resonance", "mean", "largest in a turn", "mean on bars"], chains
        ),
        "step": f"{figures['step']:.1f}",
        "share_5": f"{share_below(figures, 0.05):.2f}",
        "share_20": f"{share_below(figures, 0.2):.2f}",
    }  # fmt: skip


def main() -> None:
    options = parser().parse_args()
    with tempfile.TemporaryDirectory() as folder:
        figures = measured(folder)
    shown = tables(figures)
    print(
        shown["alarms"], shown["chains"], f"A step of 1 ms through fmpy takes {shown['step']} us.", sep="\n"
    )
    save(options.json, figures)


if __name__ == "__main__":
    main()
