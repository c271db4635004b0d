"""All feed moves to the left organ: what the drive, an ammeter and the rocker notice."""

import fmpy
import matplotlib.pyplot as plt
import numpy as np

variables = fmpy.read_model_description("mine.fmu").modelVariables
normal = {v.name: float(v.start) for v in variables if v.causality == "input"}
ratio = next(float(v.start) for v in variables if v.name == "machine.ratio")  # motor turns per crank turn
left = {n: load + normal[n.replace("left", "right")] for n, load in normal.items() if ".left." in n}
overload = normal | left | {n.replace("left", "right"): 0.0 for n in left}  # material and force
rows = [(t, *loads.values()) for t, loads in ((0, normal), (10, normal), (10, overload), (20, overload))]
inputs = np.array(rows, [("time", float), *((name, float) for name in normal)])
run = fmpy.simulate_fmu("mine.fmu", stop_time=20, output_interval=0.005, input=inputs)
run = run[run["time"] >= 4]  # after the start-up
time, curves = run["time"], {"crank torque [N m]": ratio * run["machine.tau"]}
curves |= {"rocker torque [N m]": run["machine.rocker.tau"], "motor current [A]": run["motor.armature.i"]}
figure, axes = plt.subplots(3, sharex=True, figsize=(9, 6), layout="constrained")
for ax, label in zip(axes, curves, strict=True):
    ax.plot(time, curves[label])
    ax.set(ylabel=label, xlim=(4, 16))
    ax.axvline(10, color="grey", linestyle=":")
figure.suptitle("At 10 s all feed moves to the left organ")
figure.supxlabel("time [s]")
figure.savefig("one_sided_overload.png")
for name, end in {"both organs": 10, "left organ alone": 20}.items():
    part = (time > end - 4 * np.pi * ratio / normal["motor.w_ref"]) & (time <= end)  # two turns
    crank, rocker, current = (curve[part] for curve in curves.values())
    peaks = f"crank {abs(crank).max():5.1f} N m  rocker {abs(rocker).max():6.1f} N m"
    print(f"{name:16}  {peaks}  current {np.mean(current**2) ** 0.5:.3f} A RMS")
