# %% [markdown]
# # Machine and motor
#
# Two FMUs on one shaft: the machine shows its load port, the motor solves for the motion. All feed
# moves to the left side after half a second. The run carries its own certificate.

# %%
import tempfile
from pathlib import Path

from chainunit import ChainUnit
from chainunit.fmu.export import export
from chainunit.models import MODELS
from chainunit.system import Bond, CoSimulation, Profile, System, energy_residual, port_connections

RATIO = 50.0
folder = tempfile.TemporaryDirectory()
files = {
    "machine": export(MODELS["ChamberForces"], Path(folder.name) / "ChamberForces.fmu"),
    "motor": export(MODELS["DcMotor"], Path(folder.name) / "DcMotor.fmu"),
}
system = System(
    files,
    port_connections("machine", "motor"),
    start={"machine.ratio": RATIO, "motor.w_start": 150.0},
)
signals = {
    "motor.w_ref": 150.0,
    "machine.left.material_mass": Profile(30.0, ((0.5, 0.3, 60.0),)),
    "machine.right.material_mass": Profile(30.0, ((0.5, 0.3, 0.0),)),
}

# %%
with CoSimulation(system, signals) as simulation:
    run = simulation.run(stop=2.5, step=0.002)
torque = run["machine.tau"] * RATIO
print(f"crank torque {float(torque.min()):.1f} .. {float(torque.max()):.1f} N m")
print(
    f"speed {float(run['motor.w'].min()) / RATIO:.3f} .. {float(run['motor.w'].max()) / RATIO:.3f} rad/s of the crank"
)

# %% [markdown]
# The energy from the motor is stored and dissipated by the machine, less the energy that the moving feed brings.

# %%
machine = ChainUnit(ratio=RATIO)
feed = {
    f"{side}.material_mass": lambda run, side=side: machine.energy_per_kg(
        side, run["machine.phi0"].values, run["machine.w0"].values
    )
    for side in ("left", "right")
}
_, share = energy_residual(run, Bond("motor", "machine", feed))
print(f"energy residual {share:.1e} of the energy moved")
folder.cleanup()
