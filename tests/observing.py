"""Courses of a drive for the load observer, with noise, and runs of the observer beside them."""

from __future__ import annotations

import contextlib
import math

import numpy as np
from systems import pair

from chainunit.drives.dc_motor import DcMotor
from chainunit.system import CompiledSimulation, Profile
from chainunit.system.instance import Fmu, Instance

STEP, W_REF, RATIO = 1e-3, 150.0, 50.0
TURN = 2.0 * math.pi * RATIO / W_REF
"""Time of a turn of the crank [s]."""
FEEDS = "left.material_mass", "right.material_mass"


def shifted(at, share, feed=30.0, side="left", time=0.5):
    """Signals of the machine: at a time the named side gets a share of the other side's feed."""
    hand = 1.0 if side == "left" else -1.0
    return {
        f"machine.{name}": Profile(feed, ((at, time, feed * (1.0 + sign * hand * share)),))
        for name, sign in zip(FEEDS, (1.0, -1.0), strict=True)
    }


def jammed(at, force=1500.0, side="left", time=1.0):
    """Signals of the machine: a force on one web for some time."""
    return {f"machine.{side}.processing_force": Profile(0.0, ((at, 0.01, force), (at + time, 0.01, 0.0)))}


def course(signals, duration, machine="ChamberForces", values=None, w_ref=W_REF, before=6.0):
    """Angle, speed and torque of a DC motor on the machine, shape (3, rows), after `before` seconds of running in;
    the times of the signals count from there."""
    values = {"machine.ratio": RATIO, "motor.w_start": w_ref} | (values or {})
    system = pair(machine, "DcMotor", values=values)
    late = {
        name: Profile(x.start, tuple((t + before, d, v) for t, d, v in x.changes))
        for name, x in signals.items()
    }
    with CompiledSimulation(system, late | {"motor.w_ref": w_ref}) as simulation:
        run = simulation.run(before + duration, STEP, names=["motor.phi", "motor.w", "motor.armature.i"])
    rows = [run[name].values for name in ("motor.phi", "motor.w", "motor.armature.i")]
    first = round(before / STEP)
    return np.array(rows)[:, first:]


def noisy(rows, seed=1, share=0.01):
    """Speed and current with noise, a share of their RMS."""
    rng = np.random.default_rng(seed)
    out = rows.copy()
    for k in (1, 2):
        out[k] += share * np.sqrt(np.mean(rows[k] ** 2)) * rng.standard_normal(rows.shape[1])
    return out


def noise_of(rows, share=0.01):
    """The parameters of the observer for this noise."""
    k = DcMotor.Parameters().armature.k
    size = [share * math.sqrt(float(np.mean(row**2))) for row in rows]
    return {"noise.w": size[1], "noise.torque": k * size[2]}


def observe(file, rows, values, names, step=STEP):
    """The outputs `names` of the observer's FMU over the rows, shape (names, rows)."""
    with contextlib.closing(Fmu(file)) as fmu, contextlib.closing(Instance(fmu, "observer")) as unit:
        unit.initialize({**values, **dict(zip(("phi", "w", "current"), rows[:, 0], strict=True))}, 0.0)
        unit.finish_initialization()
        inputs, outputs = unit.handle(["phi", "w", "current"]), unit.handle(names)
        result = np.zeros((len(names), rows.shape[1]))
        for k in range(rows.shape[1]):
            unit.write(inputs, rows[:, k])
            result[:, k] = unit.read(outputs)
            unit.step(k * step, step)
    return result
