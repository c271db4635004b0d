"""All feed moves to the left organ: what the drive, the ammeter and the rocker see. The motor is a DC motor."""

import fmpy
import matplotlib.pyplot as plt
import numpy as np

variables = fmpy.read_model_description("mine.fmu").modelVariables
normal = {v.name: float(v.start) for v in variables if v.causality == "input"}
ratio = next(float(v.start) for v in variables if v.name == "machine.ratio")
turn = 2 * np.pi * ratio / normal["motor.w_ref"]  # of the crank [s]
at = np.ceil(4.7 * turn)  # after the start-up
left = {n: x + normal[n.replace("left", "right")] for n, x in normal.items() if ".left." in n}
overload = normal | left | {n.replace("left", "right"): 0.0 for n in left}
rows = [(t, *x.values()) for t, x in ((0, normal), (at, normal), (at, overload), (2 * at, overload))]
inputs = np.array(rows, [("time", float), *((name, float) for name in normal)])
run = fmpy.simulate_fmu("mine.fmu", stop_time=2 * at, output_interval=0.005, input=inputs)
run = run[run["time"] > at - 3 * turn]
curves = {"crank torque [N m]": ratio * run["machine.tau"], "rocker torque [N m]": run["machine.rocker.tau"]}
curves["motor current [A]"] = run["motor.armature.i"]
figure, axes = plt.subplots(3, sharex=True, figsize=(9, 6), layout="constrained")
for name, end in {"both organs": at, "left organ alone": 2 * at}.items():
    part = (run["time"] > end - 2 * turn) & (run["time"] <= end)  # two turns
    crank, rocker, current = (abs(curve[part]) for curve in curves.values())
    print(f"{name:16}  crank {crank.max():5.1f} N m  rocker {rocker.max():6.1f} N m", end="  ")
    print(f"current {np.mean(current**2) ** 0.5:.3f} A RMS")
for ax, (label, curve) in zip(axes, curves.items(), strict=True):
    ax.plot(run["time"], curve, [at, at], [curve.min(), curve.max()], "k:")
    ax.set_ylabel(label)
axes[0].set_title(f"At {at:.0f} s all feed moves to the left organ (time in s)")
figure.savefig("one_sided_overload.png")
