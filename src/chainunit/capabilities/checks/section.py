"""Fatigue and yield of a round shaft section by DIN 743:2012, from the real cycle of bending and torsion.

The force of a pin bends the section by a lever arm. Where the section turns with the crank, the force turns against
it: each fibre has its own cycle of stress, and the worst fibre counts. Stresses are in N/m2 and lengths in m, in the
formulas of the standard in MPa and mm.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from ...core.quantities import Value, declaration, quantity
from ...reading.results import part, result
from ...study.arrays import peak
from ...study.bearings import driver_bearing, largest_load, pin_force
from ...study.readings import crank_torque, machine_series
from ...study.record import StudyRuns
from .plan import SectionPlan
from .row import CheckRule, Checks
from .runs import largest
from .tables import KEYWAY, PRESS_FIT, RATIO, SHOULDER, SectionTable

_FATIGUE = CheckRule(
    "safety against fatigue", "fatigue_safety", "DIN 743-1:2012, safety against fatigue",
    "S = 1/sqrt((szda/szdADK + sba/sbADK)^2 + (tta/ttADK)^2)",
    "sba = bending; szda = tension; tta = torsion; sbADK = permitted_bending; szdADK = permitted_tension; "
    "ttADK = permitted_torsion", at_least=True,
)  # fmt: skip
_YIELD = CheckRule(
    "safety against yield ({run})", "yield_safety", "DIN 743-1:2012, safety against yield",
    "S = 1/sqrt((szd/szdFK + sb/sbFK)^2 + (tt/ttFK)^2), largest stresses of all runs",
    "sb = largest_bending; szd = largest_tension; tt = largest_torsion; sbFK = strength.yield_bending; "
    "szdFK = strength.yield_tension; ttFK = strength.yield_torsion", at_least=True,
)  # fmt: skip
_MPA, _MM, _MICRON = 1e6, 1e-3, 1e-6
K1_BY_STEEL = MappingProxyType(
    {
        "": ((math.inf, 0.0), (math.inf, 0.0)),
        "structural": ((100.0, 0.23), (32.0, 0.26)),
        "quenched": ((16.0, 0.26), (16.0, 0.34)),
        "nitrided": ((100.0, 0.23), (100.0, 0.23)),
        "case-hardened": ((16.0, 0.41), (16.0, 0.41)),
        "case-hardened CrNiMo": ((16.0, 0.26), (16.0, 0.26)),
    }
)
"""By kind of steel, for tensile and yield strength: the diameter [mm] up to which K1 is 1, and its fall for ten times
the diameter."""
LARGEST = MappingProxyType({"case-hardened": 150.0})
"""Diameter [mm] from which on K1 falls no more, by kind of steel; 300 mm for the others."""
FATIGUE = MappingProxyType({"bending": 0.5, "tension": 0.4, "torsion": 0.3})
"""Fatigue strength of a smooth bar over the tensile strength, DIN 743-3."""
DIRECTIONS = 72
"""Number of directions of the fibre, evenly around the section."""
_ALPHA = {"tension": (0.62, 3.5, 0.0, 0), "bending": (0.62, 5.8, 0.2, 3), "torsion": (3.4, 19.0, 1.0, 2)}
"""By load, A, B, C and z of the stress concentration factor of a shoulder."""
_HUBS = {KEYWAY: (3.0, 0.38, 0.56, 0.1), PRESS_FIT: (2.7, 0.43, 0.65, 0.0)}
"""By notch of a hub at 40 mm: factor and exponent of beta of bending by the tensile strength in 1000 MPa, and beta of
torsion as factor and summand of that."""


@declaration
class SectionStrength:
    """The strength of a section."""

    k1_tensile: Value = quantity("1", "technological size factor of the tensile strength, K1")
    k1_yield: Value = quantity("1", "technological size factor of the yield strength, K1")
    k2: Value = quantity("1", "geometrical size factor of bending and torsion, K2")
    surface: Value = quantity("1", "surface factor of bending and tension, KFs")
    surface_torsion: Value = quantity("1", "surface factor of torsion, KFt")
    beta_bending: Value = quantity("1", "notch factor of bending")
    beta_tension: Value = quantity("1", "notch factor of tension")
    beta_torsion: Value = quantity("1", "notch factor of torsion")
    bending: Value = quantity("N/m2", "fatigue strength of the section in bending, sbWK", kind="stress")
    tension: Value = quantity("N/m2", "fatigue strength of the section in tension, szdWK", kind="stress")
    torsion: Value = quantity("N/m2", "fatigue strength of the section in torsion, ttWK", kind="stress")
    tensile: Value = quantity("N/m2", "tensile strength at the diameter, K1 sB", kind="stress")
    yield_bending: Value = quantity("N/m2", "yield point of the section in bending, sbFK", kind="stress")
    yield_tension: Value = quantity("N/m2", "yield point of the section in tension, szdFK", kind="stress")
    yield_torsion: Value = quantity("N/m2", "yield point of the section in torsion, ttFK", kind="stress")


@result
class ShaftSection:
    """The stresses of a section: of the fibre with the least safety in steady running, and the largest ones of all
    runs, of which `run` has the largest force of its pin. A load that does not swing has no permitted amplitude."""

    pin: str = part("pin whose force bends it")
    run: str = part("the run with the largest force")
    bending: float = quantity("N/m2", "amplitude of bending", kind="stress")
    bending_mean: float = quantity("N/m2", "mean of bending", kind="stress")
    tension: float = quantity("N/m2", "amplitude of tension", kind="stress")
    torsion: float = quantity("N/m2", "amplitude of torsion", kind="stress")
    torsion_mean: float = quantity("N/m2", "mean of torsion", kind="stress")
    permitted_bending: float | None = quantity("N/m2", "permitted amplitude of bending, sbADK", kind="stress")
    permitted_tension: float | None = quantity(
        "N/m2", "permitted amplitude of tension, szdADK", kind="stress"
    )
    permitted_torsion: float | None = quantity("N/m2", "permitted amplitude of torsion, ttADK", kind="stress")
    largest_bending: float = quantity("N/m2", "largest bending of all runs", kind="stress")
    largest_tension: float = quantity("N/m2", "largest tension of all runs", kind="stress")
    largest_torsion: float = quantity("N/m2", "largest torsion of all runs", kind="stress")
    fatigue_safety: float = quantity("1", "safety against fatigue")
    yield_safety: float = quantity("1", "safety against yield")
    strength: SectionStrength = part("its strength")


def size_factor(steel: str, diameter: float, is_yield: bool) -> float:
    """Technological size factor K1 of a kind of steel at that `diameter` [m]."""
    begin, fall = K1_BY_STEEL[steel][int(is_yield)]
    d = min(diameter / _MM, LARGEST.get(steel, 300.0))
    return 1.0 if d <= begin else 1.0 - fall * math.log10(d / begin)


def geometrical_size_factor(diameter: float) -> float:
    """Geometrical size factor K2 of bending and torsion at that `diameter` [m]."""
    d = min(max(diameter / _MM, 7.5), 150.0)
    return 1.0 - 0.2 * math.log10(d / 7.5) / math.log10(20.0)


def notch_size_factor(diameter: float, beta: float) -> float:
    """Factor K3 by which a measured notch factor `beta` depends on the `diameter` [m]."""
    return 1.0 - math.log10(beta) * (1.0 - geometrical_size_factor(diameter))


def surface_factor(roughness: float, tensile: float) -> float:
    """Surface factor KFs at that `roughness` Rz [m] and `tensile` strength [N/m2]."""
    if roughness <= _MICRON:
        return 1.0
    return 1.0 - 0.22 * math.log10(roughness / _MICRON) * (math.log10(tensile / (20.0 * _MPA)) - 1.0)


def shoulder_alpha(load: str, table: SectionTable) -> float:
    """Stress concentration factor of a shoulder; the `load` is "tension", "bending" or "torsion"."""
    A, B, C, z = _ALPHA[load]
    d, D, r = table.diameter, table.outer_diameter, table.radius
    t = 0.5 * (D - d)
    root = A * r / t + 2.0 * B * r / d * (1.0 + 2.0 * r / d) ** 2
    return 1.0 + 1.0 / math.sqrt(root + C * (r / t) ** z * d / D)


def shoulder_beta(load: str, table: SectionTable, yield_strength: float, is_hard: bool) -> float:
    """Notch factor of a shoulder, with the `yield_strength` at its diameter [N/m2]."""
    alpha, d, D, r = shoulder_alpha(load, table), table.diameter, table.outer_diameter, table.radius
    phi = 1.0 / (4.0 * math.sqrt(0.5 * (D - d) / r) + 2.0) if d / D > 0.67 else 0.0
    gradient = (1.15 if load == "torsion" else 2.3 * (1.0 + phi)) / (r / _MM)
    exponent = 0.7 if is_hard else 0.33 + yield_strength / (712.0 * _MPA)
    return alpha / min(1.0 + math.sqrt(gradient) * 10.0**-exponent, alpha)


def hub_beta(load: str, notch: str, tensile: float, diameter: float) -> float:
    """Notch factor of a keyway or a press fit at that `diameter` [m], with the `tensile` strength there [N/m2]."""
    factor, exponent, torsion, more = _HUBS[notch]
    beta = factor * (tensile / (1000.0 * _MPA)) ** exponent
    beta = torsion * beta + more if load == "torsion" else beta
    return beta * notch_size_factor(40.0 * _MM, beta) / notch_size_factor(diameter, beta)


def section_strength(plan: SectionPlan) -> SectionStrength:
    """The strength of a section."""
    table, notch = plan.table, plan.notch
    heated = table.effective_diameter or max(table.diameter, table.outer_diameter or 0.0)
    k1, k1_yield = (size_factor(plan.steel, heated, is_yield) for is_yield in (False, True))
    tensile, yields = k1 * table.tensile_strength, k1_yield * table.yield_strength
    # the notch factors of a hub have the surface in them
    surface = surface_factor(0.0 if notch in _HUBS else table.roughness, tensile)
    surface_torsion, k2 = 0.575 * surface + 0.425, geometrical_size_factor(table.diameter)
    strength: dict[str, float] = {}
    for load, share in FATIGUE.items():
        if notch == SHOULDER:
            beta = shoulder_beta(load, table, yields, plan.hard_surface)
        elif notch in _HUBS:
            beta = hub_beta(load, notch, tensile, table.diameter)
        else:
            beta = getattr(table, f"beta_{load}") or 1.0
        size = 1.0 if load == "tension" else k2
        rough = surface_torsion if load == "torsion" else surface
        strength[f"beta_{load}"] = beta
        strength[load] = share * tensile * table.hardening_factor / (beta / size + 1.0 / rough - 1.0)
        gain = _static_gain(plan, load) / (math.sqrt(3.0) if load == "torsion" else 1.0)
        strength[f"yield_{load}"] = gain * yields
    return SectionStrength(
        k1_tensile=k1,
        k1_yield=k1_yield,
        k2=k2,
        surface=surface,
        surface_torsion=surface_torsion,
        tensile=tensile,
        **strength,
    )


def _static_gain(plan: SectionPlan, load: str) -> float:
    """K2F times gF: what a section carries beyond the first yield of its fibre."""
    if plan.hard_surface:
        return 1.0
    hollow = {"bending": 1.1, "torsion": 1.0}
    support = 1.0 if load == "tension" else hollow[load] if plan.table.bore else 1.2
    if plan.notch != SHOULDER or load == "torsion":
        return support
    alpha = shoulder_alpha(load, plan.table)
    return support * next((g for most, g in ((1.5, 1.0), (2.0, 1.05), (3.0, 1.1)) if alpha < most), 1.15)


def permitted_amplitude(
    fatigue: float, yields: float, tensile: float, amplitude: Any, mean: Any, case: str
) -> Any:
    """Amplitude that a section carries for ever [N/m2] at an equivalent `mean` stress [N/m2].

    Parameters
    ----------
    fatigue, yields : fatigue strength and yield point of the section [N/m2]
    tensile : tensile strength at the diameter [N/m2]
    amplitude : amplitude that it has [N/m2], with which the mean grows in the case `RATIO`
    case : `RATIO` where mean and amplitude grow together, else the mean stays
    """
    psi = fatigue / (2.0 * tensile - fatigue)
    if case != RATIO:
        turn = (yields - fatigue) / (1.0 - psi)
        return np.where(mean <= turn, fatigue - psi * mean, np.maximum(yields - mean, 0.0))
    ratio = mean / np.maximum(amplitude, 1e-9 * fatigue)
    slope = fatigue - yields * psi
    turn = (yields - fatigue) / slope if slope > 0.0 else math.inf
    return np.where(ratio <= turn, fatigue / (1.0 + psi * ratio), yields / (1.0 + ratio))


def fibre_fatigue(
    section: SectionStrength, amplitudes: Mapping[str, Any], mean: Any, case: str = RATIO
) -> tuple[dict[str, Any], Any]:
    """The fibres around a section, each of shape (n,): permitted amplitudes by load [N/m2], and the used share of the
    strength, one over the safety.

    Parameters
    ----------
    amplitudes : by load, the amplitude of stress [N/m2], that of bending of shape (n,)
    mean : equivalent mean stress sqrt(sm^2 + 3 tm^2) of the fibres [N/m2], shape (n,)
    case : see `permitted_amplitude`
    """
    limits, shares = {}, {}
    for load, amplitude in amplitudes.items():
        limits[load] = permitted_amplitude(
            getattr(section, load),
            getattr(section, f"yield_{load}"),
            section.tensile,
            amplitude,
            mean / math.sqrt(3.0) if load == "torsion" else mean,
            case,
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            shares[load] = np.where(np.asarray(amplitude) > 0.0, amplitude / limits[load], 0.0)
    return limits, np.hypot(shares["bending"] + shares["tension"], shares["torsion"])


def safety(used: float) -> float:
    """The safety of a used share of the strength; infinite without stress."""
    return 1.0 / used if used > 0.0 else math.inf


def yield_share(section: SectionStrength, bending: float, tension: float, torsion: float) -> float:
    """The share of the yield points that the largest stresses [N/m2] use."""
    direct = bending / section.yield_bending + tension / section.yield_tension
    return math.hypot(direct, torsion / section.yield_torsion)


def fibres(fx: Any, fy: Any, turned: Any) -> tuple[Any, Any]:
    """Amplitude and mean of the force on the fibres around a section, each of shape (DIRECTIONS,).

    Parameters
    ----------
    fx, fy : force in the frame [N], shape (n,)
    turned : counter-clockwise angle of the section [rad], shape (n,), or 0 for one that stands
    """
    c, s = np.cos(turned), np.sin(turned)
    forces = np.stack([c * fx + s * fy, c * fy - s * fx])
    # half of the circle: the fibre opposite has the same amplitude, and the mean with its other sign
    angle = np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    force = np.stack([np.cos(angle), np.sin(angle)], axis=1) @ forces
    largest, least = np.max(force, axis=1), np.min(force, axis=1)
    return 0.5 * (largest - least), 0.5 * np.abs(largest + least)


def shaft_section(
    plan: SectionPlan,
    amplitude: Any,
    mean: Any,
    force: float,
    largest: float,
    torque: Any,
    largest_torque: float,
    pin: str = "",
    run: str = "",
) -> ShaftSection:
    """The section of a plan.

    Parameters
    ----------
    amplitude, mean : amplitude and mean of the pin's force on the fibres [N], shape (directions,)
    force, largest : largest force of the pin in steady running, and of all runs [N]
    torque : torque of the crank in steady running [N m], shape (n,)
    largest_torque : the largest size of it in all runs [N m]
    """
    table, d, bore = plan.table, plan.table.diameter, plan.table.bore
    area, modulus = 0.25 * math.pi * (d**2 - bore**2), math.pi / 32.0 * (d**4 - bore**4) / d
    lever, twist = table.arm / modulus, table.torsion_share / (2.0 * modulus)
    pull = table.axial_share / area
    bending, bending_mean = (lever * np.asarray(force) for force in (amplitude, mean))
    # the force on a link changes its sign with an angle that is not known here
    tension = pull * force
    torsion = twist * 0.5 * float(np.ptp(torque))
    torsion_mean = twist * 0.5 * abs(float(np.max(torque) + np.min(torque)))
    strength = section_strength(plan)
    swings = {"bending": bending, "tension": tension, "torsion": torsion}
    equivalent = np.sqrt(bending_mean**2 + 3.0 * torsion_mean**2)
    permitted, used = fibre_fatigue(strength, swings, equivalent, plan.mean_stress)
    worst = int(np.argmax(used))
    swings["bending"] = float(bending[worst])
    limits: dict[str, Any] = {
        f"permitted_{load}": float(permitted[load][worst]) if x > 0.0 else None for load, x in swings.items()
    }
    most = (lever * largest, pull * largest, twist * largest_torque)
    return ShaftSection(
        pin=pin,
        run=run,
        bending=swings["bending"],
        bending_mean=float(bending_mean[worst]),
        tension=tension,
        torsion=torsion,
        torsion_mean=torsion_mean,
        **limits,
        largest_bending=most[0],
        largest_tension=most[1],
        largest_torsion=most[2],
        fatigue_safety=safety(float(used[worst])),
        yield_safety=safety(yield_share(strength, *most)),
        strength=strength,
    )


def check_section(checks: Checks, name: str, section: ShaftSection, least: float, run: str) -> None:
    """Check a section, whose `least` safety is asked for; `run` is the title of the run with the largest force."""
    for rule in (_FATIGUE, _YIELD):
        checks.check(rule, f"section {name}", f"checks.section.{name}", section, least, run=run)


def find(runs: StudyRuns, plans: Mapping[str, SectionPlan], checks: Checks) -> dict[str, ShaftSection]:
    """The sections of a study by name, and their `checks`."""
    sections: dict[str, ShaftSection] = {}
    if not plans:
        checks.lack("shaft sections", "the file has none; add [section.NAME]", "section.NAME")
        return sections
    drive, turns = runs.drive, runs.steady
    machine, bearing = drive.simulated_machine, driver_bearing(drive)
    turned = machine.pin_turns(machine_series(turns))
    torque = crank_torque(drive, turns)
    largest_torque, _ = largest(runs, lambda run: crank_torque(drive, run))
    for name, plan in plans.items():
        pin = plan.pin or bearing
        output = machine.model.pins.get(pin)
        if output is None or (plan.on == "crank" and not bearing):
            why = "its pin is not known" if output is None else "no pin of the machine turns with its driver"
            checks.lack(f"section {name}", why)
            continue
        force = peak(pin_force(drive, turns, pin))
        if plan.on == "link":
            # its force swings in any direction
            amplitude, mean = np.array([force]), np.zeros(1)
        else:
            angle = turned[machine.model.pins[bearing]] if plan.on == "crank" else 0.0
            fx, fy = (turns[f"machine.{output}.{axis}"].values for axis in ("fx", "fy"))
            amplitude, mean = fibres(fx, fy, angle)
        most, run = largest_load(runs.pins, pin)
        sections[name] = shaft_section(
            plan, amplitude, mean, force, most, torque, largest_torque, pin=pin, run=run
        )
        check_section(checks, name, sections[name], plan.table.safety, runs.title_of(run))
    return sections
