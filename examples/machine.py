# %% [markdown]
# # The machine in Python
#
# Arrays are inputs and outputs. The script computes the papers' statics, a crank turn at several speeds, and the
# speed from which a web goes slack.

# %%
import numpy as np

from chainunit import ChainUnitMachine, InputError, SideLoads

machine = ChainUnitMachine.from_ratios(rho=0.1, lam=2 / 3, mu=0.6, zeta=0.5, l1=1.35)

# %% [markdown]
# Paper 000, Figs 17-22: the left organ at psi = -12, 0, +12 degrees, in parts of its weight.

# %%
weight = (machine.p.left.wall_mass + machine.p.left.web_mass) * machine.p.g
left = machine.chamber(np.radians([-12.0, 0.0, 12.0])).left
print("X  ", np.round(left.rocker_joint.fx / weight, 4))
print("R_t", np.round(left.tangential_load / weight, 4))

# %% [markdown]
# A crank turn at three speeds, with 30 kg of material a side.

# %%
feed = SideLoads(material_mass=30.0, processing_force=0.0)
phi = np.linspace(0.0, 2.0 * np.pi, 361)[:, None]
w = np.array([1.0, 3.0, 6.0])
out = machine.forces(phi, w, left=feed, right=feed)
for i, speed in enumerate(w):
    torque = out.tau[:, i]
    print(
        f"{speed:g} rad/s: torque {torque.min():6.1f} .. {torque.max():5.1f} N m, "
        f"least web pull {min(out.left.web_pull[:, i].min(), out.right.web_pull[:, i].min()):6.1f} N"
    )
print(f"a web goes slack from {machine.slack_speed(feed, feed):.2f} rad/s on")

# %% [markdown]
# A machine that cannot turn is refused, with the allowed range.

# %%
try:
    ChainUnitMachine(r=0.9)
except InputError as error:
    print(error)
