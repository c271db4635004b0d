# %% [markdown]
# # A linkage of your own
#
# A jaw that a crank-rocker swings: crank, coupler, rocker. The material resists the tip of the jaw.

# %%

import numpy as np

from chainunit.core.planar import Vec2
from chainunit.core.ports import PortValues
from chainunit.core.quantities import declaration, group, quantity
from chainunit.groups.body import Bar
from chainunit.groups.driver import Crank
from chainunit.groups.dyad import Dyad
from chainunit.groups.loads import PinLosses, Resistance, Weight
from chainunit.machines.machine import Machine
from chainunit.machines.parts import Force, Pin, Processing, Rod, force
from chainunit.mechanism.linkage import Linkage
from chainunit.mechanism.models import InverseMachine, ShaftMotion

# %% [markdown]
# The declarations: parameters, inputs and outputs with their units, titles and bounds.


# %%
@declaration
class Parameters:
    """Dimensions, masses, friction."""

    r: float = quantity("m", "crank O1-A", default=0.05, above=0.0)
    l: float = quantity("m", "coupler A-B", default=0.60, above=0.0)
    h: float = quantity("m", "rocker O2-B", default=0.40, above=0.0)
    jaw: float = quantity("m", "rocker O2 to the tip of the jaw", default=0.70, above=0.0)
    x: float = quantity("m", "bearing O2 lies this far right of O1", default=0.60)
    y: float = quantity("m", "bearing O2 lies this far above O1", default=0.40)
    crank: Rod = group(Rod, "crank O1-A", default=Rod(m=20.0, s=0.0, I=0.2))
    coupler: Rod = group(Rod, "coupler A-B", default=Rod(m=25.0, s=0.30, I=0.8))
    rocker: Rod = group(Rod, "rocker O2-B", default=Rod(m=90.0, s=0.35, I=4.0))
    g: float = quantity("m/s2", "gravity", default=9.81, min=0.0)
    ratio: float = quantity("1", "gear ratio, motor turns per crank turn", default=1.0, above=0.0)
    pin: Pin = group(Pin, "pins", default=Pin(friction=0.1, diameter=0.05))
    joint_damping: float = quantity("N.m.s/rad", "damping of each pin", default=0.0, min=0.0)
    processing: Processing = group(Processing, "resistance", default=Processing())


@declaration
class Inputs(ShaftMotion):
    """Motion of the motor shaft, and the material."""

    resistance: float = quantity("N", "resistance of the material to the tip", default=3000.0, min=0.0)


@declaration
class Outputs(PortValues):
    """Torque, load port, reactions, energies."""

    tip_x: float = quantity("m", "position x of the tip")
    crank_bearing: Force = group(Force, "on the crank at O1, from the frame")
    jaw_bearing: Force = group(Force, "on the rocker at O2, from the frame")
    power: float = quantity("W", "power that the motor shaft takes", nominal=100.0)
    kinetic_energy: float = quantity("J", "kinetic energy")
    potential_energy: float = quantity("J", "potential energy")
    dissipated_power: float = quantity("W", "power that friction and material take", nominal=100.0)
    margin: float = quantity("1", "sine of the transmission angle; 0 is a dead position")
    tau: float = quantity("N.m", "torque needed at the motor shaft", nominal=100.0)


# %% [markdown]
# The machine: its linkage, and the outputs that are read from it.


# %%
def linkage_of_jaw(xp, p, u):
    return Linkage(
        ground={"O1": Vec2(0.0, 0.0), "O2": Vec2(p.x, p.y)},
        driver=Crank(Bar("crank", "O1", p.r, p.crank), "A"),
        groups=(
            Dyad(
                "B",
                Bar("coupler", "A", p.l, p.coupler),
                Bar("rocker", "O2", p.h, p.rocker, {"tip": (p.jaw, 0.0)}),
                1.0,  # of the two ways to assemble it: B lies left (1) or right (-1) of the ray from A to O2
            ),
        ),
        loads={
            "weight": Weight(p.g),
            "material": Resistance("tip", u.resistance, p.processing),
            "pins": PinLosses(p.pin, p.joint_damping),
        },
    )


def probes_of_jaw(xp, p, u, s, a):
    reactions = s.reactions(a)
    return {
        "tip_x": s.m.pins["tip"].p.x,
        **{name: force(reactions[joint]) for name, joint in Jaw.joints.items()},
    }


Jaw = InverseMachine(
    name="Jaw",
    text="A jaw: motion of the motor shaft in, torque and reactions out.",
    noun="jaw",
    description="Jaw swung by a crank-rocker",
    Parameters=Parameters,
    Inputs=Inputs,
    Outputs=Outputs,
    joints={"crank_bearing": ("O1", "crank"), "jaw_bearing": ("O2", "rocker")},
    linkage=linkage_of_jaw,
    probes=probes_of_jaw,
)


# %% [markdown]
# A turn of the crank at 25 rad/s.

# %%
machine = Machine(Jaw)
out = machine.outputs(np.linspace(0.0, 2.0 * np.pi, 361), w=25.0)
print(f"torque {out.tau.min():.0f} .. {out.tau.max():.0f} N m")
print(f"stroke of the tip {1e3 * np.ptp(out.tip_x):.0f} mm, margin {out.margin.min():.3f}")
print(f"bearing of the jaw up to {np.hypot(out.jaw_bearing.fx, out.jaw_bearing.fy).max():.0f} N")
