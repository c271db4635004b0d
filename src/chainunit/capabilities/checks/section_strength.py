"""Strength of a round section by DIN 743:2012: influence factors, notch factors, safeties against fatigue and yield.

Stresses are in N/m2 and lengths in m, in the formulas of the standard in MPa and mm.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from ...core.quantities import Value, declaration, quantity
from .tables import GIVEN_NOTCH, KEYWAY, PRESS_FIT, RATIO, SHOULDER, SectionTable

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


@dataclass(frozen=True)
class Stresses:
    """Stresses of a cycle [N/m2]: bending of the fibres around the section, amplitude and mean of shape (n,);
    amplitude of tension; amplitude and mean of torsion."""

    bending: Any
    bending_mean: Any
    tension: float
    torsion: float
    torsion_mean: float


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
    d = min(max(diameter / _MM, 7.5), 150.0)
    return 1.0 - 0.2 * math.log10(beta) * math.log10(d / 7.5) / math.log10(20.0)


def surface_factor(roughness: float, tensile: float) -> float:
    """Surface factor KFs at that `roughness` Rz [m] and `tensile` strength [N/m2]."""
    if roughness <= _MICRON:
        return 1.0
    return 1.0 - 0.22 * math.log10(roughness / _MICRON) * (math.log10(tensile / (20.0 * _MPA)) - 1.0)


def shoulder_alpha(load: str, diameter: float, radius: float, outer: float) -> float:
    """Stress concentration factor of a shoulder: bar of that `diameter` [m], fillet `radius` [m], `outer` diameter
    [m]; the `load` is "tension", "bending" or "torsion"."""
    A, B, C, z = _ALPHA[load]
    depth, slim = 0.5 * (outer - diameter), radius / diameter
    root = A * radius / depth + 2.0 * B * slim * (1.0 + 2.0 * slim) ** 2
    return 1.0 + 1.0 / math.sqrt(root + C * (radius / depth) ** z * diameter / outer)


def shoulder_beta(
    load: str, diameter: float, radius: float, outer: float, yield_strength: float, is_hard: bool = False
) -> float:
    """Notch factor of a shoulder, with the `yield_strength` at its diameter [N/m2]; arguments as of
    `shoulder_alpha`."""
    alpha, r = shoulder_alpha(load, diameter, radius, outer), radius / _MM
    depth = 0.5 * (outer - diameter)
    phi = 1.0 / (4.0 * math.sqrt(depth / radius) + 2.0) if diameter / outer > 0.67 else 0.0
    gradient = 1.15 / r if load == "torsion" else 2.3 * (1.0 + phi) / r
    exponent = 0.7 if is_hard else 0.33 + yield_strength / (712.0 * _MPA)
    support = min(1.0 + math.sqrt(gradient) * 10.0**-exponent, alpha)
    return alpha / support


def notch_factors(
    table: SectionTable, notch: str, tensile: float, yield_strength: float, is_hard: bool
) -> dict[str, float]:
    """Notch factors by load, with the strengths at the diameter [N/m2]."""
    if notch == GIVEN_NOTCH:
        return {load: getattr(table, f"beta_{load}") or 1.0 for load in FATIGUE}
    if notch == SHOULDER:
        args = (table.diameter, table.radius, table.outer_diameter, yield_strength, is_hard)
        return {load: shoulder_beta(load, *args) for load in FATIGUE}
    if notch in (KEYWAY, PRESS_FIT):
        # measured at 40 mm
        ratio = tensile / (1000.0 * _MPA)
        bending = 3.0 * ratio**0.38 if notch == KEYWAY else 2.7 * ratio**0.43
        torsion = 0.56 * bending + 0.1 if notch == KEYWAY else 0.65 * bending
        at_40 = {"bending": bending, "tension": bending, "torsion": torsion}
        return {
            load: beta * notch_size_factor(40.0 * _MM, beta) / notch_size_factor(table.diameter, beta)
            for load, beta in at_40.items()
        }
    return dict.fromkeys(FATIGUE, 1.0)


def section_strength(
    table: SectionTable, notch: str, steel: str = "", is_hard: bool = False
) -> SectionStrength:
    """The strength of a section with the values of its `table`, a `notch` of `NOTCHES`, a kind of `steel`, and a hard
    surface layer or none."""
    heated = table.effective_diameter or max(table.diameter, table.outer_diameter or 0.0)
    k1, k1_yield = (size_factor(steel, heated, is_yield) for is_yield in (False, True))
    tensile, yields = k1 * table.tensile_strength, k1_yield * table.yield_strength
    beta = notch_factors(table, notch, tensile, yields, is_hard)
    # the notch factors of a hub have the surface in them
    rough = 0.0 if notch in (KEYWAY, PRESS_FIT) else table.roughness
    surface = surface_factor(rough, tensile)
    surfaces = {"bending": surface, "tension": surface, "torsion": 0.575 * surface + 0.425}
    k2 = geometrical_size_factor(table.diameter)
    sizes = {"bending": k2, "tension": 1.0, "torsion": k2}
    strength = {
        load: FATIGUE[load]
        * tensile
        * table.hardening_factor
        / (beta[load] / sizes[load] + 1.0 / surfaces[load] - 1.0)
        for load in FATIGUE
    }
    gains = {load: _static_gain(table, notch, load, is_hard) for load in FATIGUE}
    return SectionStrength(
        k1_tensile=k1,
        k1_yield=k1_yield,
        k2=k2,
        surface=surface,
        surface_torsion=surfaces["torsion"],
        **{f"beta_{load}": beta[load] for load in FATIGUE},
        **strength,
        tensile=tensile,
        yield_bending=gains["bending"] * yields,
        yield_tension=gains["tension"] * yields,
        yield_torsion=gains["torsion"] * yields / math.sqrt(3.0),
    )


def _static_gain(table: SectionTable, notch: str, load: str, is_hard: bool) -> float:
    """K2F times gF: what a section carries beyond the first yield of its fibre."""
    if is_hard:
        return 1.0
    support = {"tension": 1.0, "bending": 1.2, "torsion": 1.2}
    if table.bore:
        support = {"tension": 1.0, "bending": 1.1, "torsion": 1.0}
    gain = 1.0
    if notch == SHOULDER and load != "torsion":
        alpha = shoulder_alpha(load, table.diameter, table.radius, table.outer_diameter)
        gain = next((g for most, g in ((1.5, 1.0), (2.0, 1.05), (3.0, 1.1)) if alpha < most), 1.15)
    return support[load] * gain


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


@dataclass(frozen=True)
class FibreFatigue:
    """The fibres around a section, each of shape (n,): permitted amplitudes by load [N/m2], and the used share."""

    permitted: Mapping[str, Any]
    used: Any

    @property
    def worst(self) -> int:
        """The place of the fibre that decides."""
        return int(np.argmax(self.used))

    @property
    def safety(self) -> float:
        """Safety against fatigue; infinite where no stress swings."""
        used = float(np.max(self.used))
        return 1.0 / used if used > 0.0 else math.inf


def fibre_fatigue(section: SectionStrength, stress: Stresses, case: str = RATIO) -> FibreFatigue:
    """The fatigue of the fibres under their stresses; for the `case` see `permitted_amplitude`."""
    mean = np.sqrt(np.square(stress.bending_mean) + 3.0 * stress.torsion_mean**2)
    limits: dict[str, Any] = {}
    shares = []
    for load, amplitude, middle in (
        ("bending", stress.bending, mean),
        ("tension", stress.tension, mean),
        ("torsion", stress.torsion, mean / math.sqrt(3.0)),
    ):
        strength, yields = getattr(section, load), getattr(section, f"yield_{load}")
        limits[load] = permitted_amplitude(strength, yields, section.tensile, amplitude, middle, case)
        with np.errstate(divide="ignore", invalid="ignore"):
            shares.append(np.where(np.asarray(amplitude) > 0.0, amplitude / limits[load], 0.0))
    bending, tension, torsion = shares
    return FibreFatigue(limits, np.hypot(bending + tension, torsion))


def yield_safety(section: SectionStrength, bending: float, tension: float, torsion: float) -> float:
    """Safety against yield under the largest stresses [N/m2]; infinite without stress."""
    direct = bending / section.yield_bending + tension / section.yield_tension
    used = math.hypot(direct, torsion / section.yield_torsion)
    return 1.0 / used if used > 0.0 else math.inf
