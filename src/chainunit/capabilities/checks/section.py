"""Fatigue and yield of a shaft section by DIN 743, from the real cycle of bending and torsion.

The force of a pin bends the section by a lever arm. Where the section turns with the crank, the force turns against
it: each fibre has its own cycle of stress, and the worst fibre counts.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ...core.quantities import Value, declaration, quantity
from ...reading.results import part, result
from ...study.arrays import peak
from ...study.bearings import driver_bearing, largest_load, pin_force
from ...study.readings import crank_torque, machine_series
from ...study.record import StudyRecord
from .row import CheckRow, CheckRule, NotChecked
from .runs import largest
from .section_plan import SectionPlan
from .section_strength import (
    DIRECTIONS,
    SectionStrength,
    Stresses,
    fibre_fatigue,
    section_strength,
    yield_safety,
)
from .tables import SectionTable

_FATIGUE = CheckRule(
    "fatigue_safety", "safety against fatigue", "DIN 743-1:2012, safety against fatigue",
    "S = 1/sqrt((szda/szdADK + sba/sbADK)^2 + (tta/ttADK)^2)",
    "sba = bending; szda = tension; tta = torsion; sbADK = permitted_bending; szdADK = permitted_tension; "
    "ttADK = permitted_torsion", at_least=True,
)  # fmt: skip
_YIELD = CheckRule(
    "yield_safety", "safety against yield ({run})", "DIN 743-1:2012, safety against yield",
    "S = 1/sqrt((szd/szdFK + sb/sbFK)^2 + (tt/ttFK)^2), largest stresses of all runs",
    "sb = largest_bending; szd = largest_tension; tt = largest_torsion; sbFK = strength.yield_bending; "
    "szdFK = strength.yield_tension; ttFK = strength.yield_torsion", at_least=True,
)  # fmt: skip


@declaration
class SectionStress:
    """The stresses of a section: of the fibre with the least safety in steady running, and the largest ones of all
    runs. A load that does not swing has no permitted amplitude."""

    bending: Value = quantity("N/m2", "amplitude of bending", kind="stress")
    bending_mean: Value = quantity("N/m2", "mean of bending", kind="stress")
    tension: Value = quantity("N/m2", "amplitude of tension", kind="stress")
    torsion: Value = quantity("N/m2", "amplitude of torsion", kind="stress")
    torsion_mean: Value = quantity("N/m2", "mean of torsion", kind="stress")
    permitted_bending: Value = quantity("N/m2", "permitted amplitude of bending, sbADK", kind="stress")
    permitted_tension: Value = quantity("N/m2", "permitted amplitude of tension, szdADK", kind="stress")
    permitted_torsion: Value = quantity("N/m2", "permitted amplitude of torsion, ttADK", kind="stress")
    largest_bending: Value = quantity("N/m2", "largest bending of all runs", kind="stress")
    largest_tension: Value = quantity("N/m2", "largest tension of all runs", kind="stress")
    largest_torsion: Value = quantity("N/m2", "largest torsion of all runs", kind="stress")
    fatigue_safety: Value = quantity("1", "safety against fatigue")
    yield_safety: Value = quantity("1", "safety against yield")


@result
class ShaftSection:
    """A section; `run` has the largest force of its pin."""

    pin: str = part("pin whose force bends it")
    run: str = part("the run with the largest force")
    stress: SectionStress = part(inline=True)
    strength: SectionStrength = part("its strength")


def moduli(table: SectionTable) -> tuple[float, float]:
    """Area [m2] and section modulus of bending [m3] of a round section; that of torsion is twice as large."""
    d, bore = table.diameter, table.bore
    return 0.25 * math.pi * (d**2 - bore**2), math.pi / 32.0 * (d**4 - bore**4) / d


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
    table = plan.table
    area, modulus = moduli(table)
    lever, twist = table.arm / modulus, table.torsion_share / (2.0 * modulus)
    pull = table.axial_share / area
    stress = Stresses(
        bending=lever * np.asarray(amplitude),
        bending_mean=lever * np.asarray(mean),
        # the force on a link changes its sign with an angle that is not known here
        tension=pull * force,
        torsion=twist * 0.5 * float(np.ptp(torque)),
        torsion_mean=twist * 0.5 * abs(float(np.max(torque) + np.min(torque))),
    )
    strength = section_strength(table, plan.notch, plan.steel, plan.is_hard)
    fatigue = fibre_fatigue(strength, stress, plan.mean_stress)
    worst = fatigue.worst
    most = (lever * largest, pull * largest, twist * largest_torque)
    amplitudes = {
        "bending": float(stress.bending[worst]),
        "tension": stress.tension,
        "torsion": stress.torsion,
    }
    numbers = SectionStress(
        **amplitudes,
        bending_mean=float(stress.bending_mean[worst]),
        torsion_mean=stress.torsion_mean,
        **{
            f"permitted_{load}": float(limit[worst]) if amplitudes[load] > 0.0 else None
            for load, limit in fatigue.permitted.items()
        },
        largest_bending=most[0],
        largest_tension=most[1],
        largest_torsion=most[2],
        fatigue_safety=fatigue.safety,
        yield_safety=yield_safety(strength, *most),
    )
    return ShaftSection(pin, run, numbers, strength)


def section_rows(name: str, section: ShaftSection, safety: float, run: str) -> Iterator[CheckRow]:
    """The rows of a section; `run` is the title of the run with the largest force."""
    for rule in (_FATIGUE, _YIELD):
        row = rule.row(f"section {name}", f"checks.section.{name}", section.stress, safety, run)
        # a section without a swinging stress lasts
        yield row if row.value is not None and math.isfinite(row.value) else replace(row, value=None)


def find(
    study: StudyRecord, plans: Mapping[str, SectionPlan]
) -> tuple[dict[str, ShaftSection], list[CheckRow | NotChecked]]:
    """The sections of a study by name, and their checks."""
    if not plans:
        return {}, [NotChecked("shaft sections", "the file has none; add [section.NAME]", "section.NAME")]
    drive = study.drive
    turns = study.steady
    machine = drive.simulated_machine
    turned = machine.pin_turns(machine_series(turns))
    bearing = driver_bearing(drive)
    torque = crank_torque(drive, turns)
    largest_torque, _ = largest(study, lambda run: crank_torque(drive, run))
    sections: dict[str, ShaftSection] = {}
    checks: list[CheckRow | NotChecked] = []
    for name, plan in plans.items():
        pin = plan.pin or bearing
        output = machine.model.pins.get(pin)
        if output is None or (plan.on == "crank" and not bearing):
            why = "its pin is not known" if output is None else "no pin of the machine turns with its driver"
            checks.append(NotChecked(f"section {name}", why))
            continue
        fx, fy = (turns[f"machine.{output}.{axis}"].values for axis in ("fx", "fy"))
        force = peak(pin_force(drive, turns, pin))
        if plan.on == "link":
            amplitude, mean = np.array([force]), np.zeros(1)
        else:
            angle = turned[machine.model.pins[bearing]] if plan.on == "crank" else 0.0
            amplitude, mean = fibres(fx, fy, angle)
        most, run = largest_load(study.pins, pin)
        args = (amplitude, mean, force, most, torque, largest_torque, pin, run)
        sections[name] = shaft_section(plan, *args)
        checks += section_rows(name, sections[name], plan.table.safety, study.title_of(run))
    return sections, checks
