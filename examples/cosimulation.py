# %% [markdown]
# # Machine and motor
#
# Two FMUs share a shaft: the machine gives its load port, the motor solves for the motion. All feed moves to the left
# side after half a second. The energy balance of the run is its certificate.

# %%
import tempfile
from pathlib import Path

from chainunit import ChainUnitMachine
from chainunit.models import MODELS
from chainunit.system import CoSimulation, ModelComponent, Profile, System, certify, export, shaft_joints

RATIO = 50.0
folder = tempfile.TemporaryDirectory()
ChamberForces, DcMotor = MODELS["ChamberForces"], MODELS["DcMotor"]
components = {
    "machine": ModelComponent(ChamberForces, ChamberForces.Parameters(ratio=RATIO)),
    "motor": ModelComponent(DcMotor, DcMotor.Parameters(w_start=150.0)),
}
system, _ = export(System(components, shaft_joints("motor", "machine")), Path(folder.name), backend="python")
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
machine = ChainUnitMachine(ratio=RATIO)
feed = {
    f"machine.{side}.material_mass": lambda run, side=side: machine.energy_per_kg(
        side, run["machine.phi0"].values, run["machine.w0"].values
    )
    for side in ("left", "right")
}
_, share = certify(run, system, feed)["machine"]
print(f"energy residual {share:.1e} of the energy moved")
folder.cleanup()
