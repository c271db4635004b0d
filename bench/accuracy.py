# %% [markdown]
# Accuracy of the co-simulation against the monolithic solution
#
# Error in crank torque and motor speed, in parts of the reference's peak, at communication steps of 4, 2 and
# 1 ms, with the load port's slopes and without. The limit: with a linearised load the coupling is of second
# order; the floor is the tolerance of the reference, 1e-10.

# %%
from __future__ import annotations

import math
import tempfile
from pathlib import Path

import numpy as np
from figures import parser, save
from rich.console import Console
from rich.table import Table

from chainunit import ChainUnitMachine, SideLoads
from chainunit.drives.dc_motor import DcMotor
from chainunit.drives.speed_control import tune
from chainunit.machines.chain_unit import ChamberForces
from chainunit.system import (
    CoSimulation,
    ModelComponent,
    System,
    certify,
    export,
    hold_loads,
    monolithic,
    shaft_joints,
)

SPEED = 6.0  # rad/s of the crank
STEPS = (0.004, 0.002, 0.001)
STOP = 2.0  # s, nearly two turns


def motors():
    """The packaged drive behind its gear, and a motor straight on the crank whose rotor has 1/50 of the
    machine's largest inertia."""
    feed = SideLoads()
    J = ChainUnitMachine().forces(np.linspace(0.0, 2.0 * math.pi, 720), 0.0, 0.0, feed, feed).J
    geared = {}
    direct = {
        "rotor.J": float(np.max(J)) / 50.0,
        "armature.k": 60.0,
        "armature.R": 20.0,
        "armature.L": 0.3,
        "limit.i": 10.0,
        "limit.v": 800.0,
    }
    armature = DcMotor.parameter_layout.from_names(direct).armature
    direct |= tune(armature, float(np.mean(J)) + direct["rotor.J"]).parameters
    return {"gear 50, packaged motor": (50.0, geared), "direct, rotor 1/50 of J": (1.0, direct)}


def main() -> None:
    options, figures = parser().parse_args(), []
    console = Console(width=110)
    with tempfile.TemporaryDirectory() as folder:
        models = {"machine": ChamberForces, "motor": DcMotor}
        components = {name: ModelComponent(model, model.Parameters()) for name, model in models.items()}
        packaged, origin = export(System(components, shaft_joints("motor", "machine")), Path(folder))
        console.print(*(f"{name}: {how}" for name, how in origin.items()), sep="\n")
        for force in (0.0, 100.0):
            for title, (ratio, motor) in motors().items():
                table = Table(title=f"{title}; processing force {force:g} N a side", title_justify="left")
                for column in (
                    "slopes",
                    "step",
                    "crank torque",
                    "order",
                    "speed",
                    "order",
                    "energy residual",
                ):
                    table.add_column(column, justify="right")
                w = ratio * SPEED
                own = motor | {"w_start": w}
                signals = {"motor.w_ref": w} | {
                    f"machine.{side}.processing_force": force for side in ("left", "right")
                }
                start = {"machine.ratio": ratio} | {f"motor.{n}": v for n, v in own.items()}
                linear = packaged.with_values(start)
                exact = monolithic(linear, signals, np.arange(0.0, STOP + 1e-9, STEPS[0]))
                for slopes in (True, False):
                    before = None
                    for step in STEPS:
                        system = linear if slopes else hold_loads(linear)
                        with CoSimulation(system, signals) as simulation:
                            run = simulation.run(STOP, step)
                        _, energy = certify(run, system)["machine"]
                        every = round(STEPS[0] / step)
                        errors = [
                            float(np.max(np.abs(run[n].values[::every] - exact[n].values)))
                            / float(np.max(np.abs(exact[n].values)))
                            for n in ("machine.tau", "motor.w")
                        ]
                        orders = (
                            [f"{math.log2(a / b):.2f}" for a, b in zip(before, errors, strict=True)]
                            if before
                            else ["", ""]
                        )
                        table.add_row(
                            "exact" if slopes else "zero",
                            f"{1e3 * step:g} ms",
                            f"{errors[0]:.1e}",
                            orders[0],
                            f"{errors[1]:.1e}",
                            orders[1],
                            f"{energy:.1e}",
                        )
                        figures.append({
                            "title": title, "force": force, "slopes": slopes, "step": step, "torque": errors[0],
                            "speed": errors[1], "orders": orders, "energy": energy,
                        })  # fmt: skip
                        before = errors
                console.print(table)
    save(options.json, figures)


if __name__ == "__main__":
    main()
