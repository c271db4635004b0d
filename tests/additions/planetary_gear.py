"""A part of the line that is no part of the package: a planetary gear with stiffness, damping and backlash.

twist = phi_motor/ratio - phi_driven           z = the twist beyond the backlash, smoothed
tau = c z dz/dtwist + d dz/dtwist v            E = c z^2/2,    v = d twist/dt
J a_driven = tau - tau_load
"""

from __future__ import annotations

from types import MappingProxyType

from chainunit.core.engines import Dual, dual, slope
from chainunit.core.model import Model, Part
from chainunit.core.ports import (
    PortSlopes,
    PortValues,
    ShaftInput,
    Start,
    line_terminals,
    shaft_motion,
)
from chainunit.core.quantities import Layout, Value, declaration, group, quantity
from chainunit.drives.driveline import Driven, DrivenState, States
from chainunit.study.conditions import given
from chainunit.study.file_section import FileSection
from chainunit.study.line.part import PartOfLine

W_SMALL = 0.1


@declaration
class PlanetaryTable:
    """A planetary gear between motor and machine."""

    ratio: Value = quantity("1", "turns of the sun per turn of the carrier", default=5.0, above=1.0)
    c: Value = quantity("N.m/rad", "stiffness at the carrier", default=4000.0, above=0.0)
    d: Value = quantity("N.m.s/rad", "damping at the carrier", default=20.0, min=0.0)
    backlash: Value = quantity("rad", "backlash at the carrier", default=0.01, min=0.0)
    J_carrier: Value = quantity("kg.m2", "inertia on the carrier", default=0.05, above=0.0)


@declaration
class Parameters(Start, PlanetaryTable):
    smoothing: Value = quantity("rad", "twist over which the backlash is rounded", default=0.001, above=0.0)


@declaration
class Outputs(PortSlopes, PortValues):
    tau: Value = quantity("N.m", "torque that the motor has to give", nominal=100.0)
    twist: Value = quantity("rad", "twist, at the carrier", nominal=0.01)
    driven: Driven = group(Driven, "carrier")
    power: Value = quantity("W", "power that the motor gives", nominal=100.0)
    kinetic_energy: Value = quantity("J", "kinetic energy of the carrier", nominal=100.0)
    potential_energy: Value = quantity("J", "energy of the twist")
    dissipated_power: Value = quantity("W", "power that damping takes")


class Mesh:
    """The teeth at a twist and its speed."""

    def __init__(self, xp, p, twist, v):
        half, s2 = 0.5 * p.backlash, p.smoothing * p.smoothing
        right = xp.sqrt((twist - half) * (twist - half) + s2)
        left = xp.sqrt((twist + half) * (twist + half) + s2)
        z = twist + 0.5 * (right - left)
        share = 1.0 + 0.5 * ((twist - half) / right - (twist + half) / left)
        self.energy, self.dissipated = 0.5 * p.c * z * z, p.d * share * v * v
        self.tau = p.c * z * share + p.d * share * v


class Point:
    def __init__(self, xp, p, u, x):
        self.twist, self.v = u.phi / p.ratio - x.driven.phi, u.w / p.ratio - x.driven.w
        self.mesh = Mesh(xp, p, self.twist, self.v)
        self.a, self.load = shaft_motion(u.load, x.driven.phi, x.driven.w, p.J_carrier, self.mesh.tau)
        engine = dual(xp)
        by_twist = slope(Mesh(engine, p, Dual(self.twist, 1.0), self.v).tau)
        self.by_speed = slope(Mesh(engine, p, self.twist, Dual(self.v, 1.0)).tau)
        held = -(by_twist * x.driven.w + self.by_speed * self.a)
        w, small = u.w / p.ratio, W_SMALL / p.ratio
        self.along = by_twist + held * w * w * w / (w * w * w * w + small * small * small * small)


def _outputs(xp, p, u, x, s):
    tau = s.mesh.tau / p.ratio
    return Outputs(
        tau_bias=tau,
        J=0.0 * tau,
        dJ_dphi=0.0 * tau,
        phi0=u.phi,
        w0=u.w,
        tau_bias_dphi=s.along / (p.ratio * p.ratio),
        tau_bias_dw=s.by_speed / (p.ratio * p.ratio),
        tau=tau,
        twist=s.twist,
        driven=Driven(a=s.a, tau=s.load),
        power=tau * u.w,
        kinetic_energy=0.5 * p.J_carrier * x.driven.w * x.driven.w,
        potential_energy=s.mesh.energy,
        dissipated_power=s.mesh.dissipated,
    )


def _internal_step(xp, p):
    return xp.minimum(2.5e-4, 0.1 * xp.sqrt(p.J_carrier / p.c))


def _initial_states(xp, p):
    driven = DrivenState(phi=p.phi_start / p.ratio, w=p.w_start / p.ratio)
    return States(driven=driven, load_energy=0.0)


def _derivatives(xp, p, u, x):
    s = Point(xp, p, u, x)
    return [s.load * x.driven.w, x.driven.w, s.a]


PlanetaryGear = Model(
    name="PlanetaryGear",
    text="A planetary gear.",
    description="Planetary gear with stiffness, damping and backlash: takes a load port and shows one",
    Parameters=Parameters,
    Inputs=ShaftInput,
    States=States,
    terminals=line_terminals(),
    input_rates=MappingProxyType({"phi": "w", "w": "a"}),
    shared=Point,
    parts=(Part(Outputs, _outputs),),
    internal_step=_internal_step,
    initial_states=_initial_states,
    derivatives=_derivatives,
)


class PlanetaryPart(PartOfLine):
    """The part, with the table [planetary]."""

    name, model = "planetary", PlanetaryGear
    order = 5
    tables = {  # noqa: RUF012
        "planetary": FileSection(PlanetaryTable, optional=True, title="Planetary gear")
    }

    def rules(self):
        from chainunit.study.rules import Rule

        yield Rule(
            "planetary", given("sizing"), "sizing does not know its stiffness; leave out one of the two"
        )

    def plan(self, reading):
        return reading.values[self.name] if self.name in reading.data else None

    def placed(self, plan, drive, turn):
        from chainunit.study.line.placed import PlacedPart

        if plan is None:
            return None
        p = Parameters(**Layout(PlanetaryTable).by_name(plan))
        return PlacedPart(self.name, self.model, p, plan.ratio, plan.J_carrier)


PART = PlanetaryPart()
