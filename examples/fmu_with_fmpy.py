# %% [markdown]
# # The FMU in fmpy
#
# The script exports `ChamberForces`; fmpy drives it through a crank turn.

# %%
import tempfile
from pathlib import Path

import fmpy
import numpy as np

from chainunit import ChamberForces
from chainunit.fmu.export import export

folder = tempfile.TemporaryDirectory()
file = export(ChamberForces, Path(folder.name) / "ChamberForces.fmu", {"ratio": 50.0})

# %% [markdown]
# fmpy warns of an input without a column. So each input has a column, by default with its start value.

# %%
speed = 150.0  # rad/s of the motor
turn = 2.0 * np.pi * 50.0 / speed
time = np.linspace(0.0, turn, 201)
variables = fmpy.read_model_description(str(file)).modelVariables
inputs = {"time": time} | {v.name: float(v.start) for v in variables if v.causality == "input"}
inputs |= {"phi": speed * time, "w": speed}
motion = np.zeros(len(time), [(name, float) for name in inputs])
for name, values in inputs.items():
    motion[name] = values
result = fmpy.simulate_fmu(
    str(file),
    stop_time=turn,
    output_interval=turn / 200,
    input=motion,
    output=["tau", "J", "rocker.psi", "left.support.fy", "left.web_pull"],
)
print(f"motor torque {result['tau'].min():.3f} .. {result['tau'].max():.3f} N m")
print(
    f"rocker angle {np.degrees(result['rocker.psi'].min()):.3f} .. {np.degrees(result['rocker.psi'].max()):.3f} deg"
)
print(f"load of the left support up to {result['left.support.fy'].max():.0f} N")
folder.cleanup()
