# %% [markdown]
# # The FMU in fmpy
#
# Export `ChamberForces` and let fmpy drive it through a crank turn.

# %%
import tempfile
from pathlib import Path

import fmpy
import numpy as np

from chainunit import ChamberForces
from chainunit.fmu.export import export

folder = tempfile.TemporaryDirectory()
file = export(ChamberForces, Path(folder.name) / "ChamberForces.fmu", {"ratio": 50.0})

# %%
speed = 150.0  # rad/s of the motor
turn = 2.0 * np.pi * 50.0 / speed
time = np.linspace(0.0, turn, 201)
motion = np.array(
    list(zip(time, speed * time, np.full_like(time, speed), strict=True)),
    dtype=[("time", float), ("phi", float), ("w", float)],
)
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
