# %% [markdown]
# # The organ as a chain
#
# The script exports `ChainUnitFlexible` with 4 rods on each side, drives it with fmpy at a speed at which the chains
# snatch, and compares it with the machine with two bars.

# %%
import tempfile
from pathlib import Path

import fmpy
import numpy as np

from chainunit import ChainUnitMachine, SideLoads
from chainunit.fmu.backends import export
from chainunit.machines.flexible import flexible

speed, turns = 10.0, 6
folder = tempfile.TemporaryDirectory()
file = Path(folder.name) / "ChainUnitFlexible.fmu"
print(export(flexible(walls=3, webs=1), file))

# %% [markdown]
# fmpy warns of an input without a column. So each input has a column, by default with its start value.

# %%
# in co-simulation phi runs along w inside each step
step = 2.0 * np.pi / speed / 100
time = step * np.arange(100 * turns + 1)
sides = ("left", "right")
variables = fmpy.read_model_description(str(file)).modelVariables
inputs = {"time": time} | {v.name: float(v.start) for v in variables if v.causality == "input"}
inputs |= {"phi": speed * time, "w": speed} | {f"{side}.material_mass": 30.0 for side in sides}
motion = np.zeros(len(time), [(name, float) for name in inputs])
for name, values in inputs.items():
    motion[name] = values
result = fmpy.simulate_fmu(
    str(file),
    stop_time=time[-1],
    step_size=step,
    output_interval=step,
    input=motion,
    output=[
        "rocker.tau",
        *(f"{side}.{name}" for side in sides for name in ("slack_share", "energy_residual")),
    ],
)
steady = result[200:]

# %%
feed = SideLoads(material_mass=30.0, processing_force=0.0)
two_bars = ChainUnitMachine().forces(np.linspace(0.0, 2.0 * np.pi, 361), speed, 0.0, feed, feed)
peaks = np.abs(steady["rocker.tau"][: 100 * (turns - 2)]).reshape(turns - 2, 100).max(axis=1)
print("peak of the rocker torque in each turn:", " ".join(f"{peak:.0f}" for peak in peaks), "N m")
print(f"two bars: {np.abs(two_bars.rocker.tau).max():.0f} N m")
slack = np.mean(np.maximum(*(steady[f"{side}.slack_share"] for side in sides)) > 0.0)
print(f"a rod is slack for {100 * slack:.0f} % of the time")
residual = max(np.abs(result[f"{side}.energy_residual"]).max() for side in sides)
print(f"energy residual of the chains: at most {residual:.1e} J")
folder.cleanup()
