"""Bearings in the place of pins.

Rolling: rating life by ISO 281 over the real cycle of force and swing, static safety by ISO 76, and the swing below
which the tracks of the rolling elements do not meet. The life of a bearing that swings is counted by the way that it
turns to and fro, as the amplitude factor of Harris: a swing of theta from end to end, to and fro, is 2 theta/360 deg
of a turn. Menck and Stammler, "Review of rolling contact fatigue life calculation for oscillating bearings", Wind
Energ. Sci. 9 (2024) 777, compare it with the other factors.

Plain: the pressure on the projected area, F/(d b), as the specific load of ISO 7902-1, the sliding speed, and the
mean of their product over the time of the real cycle, which heats the bearing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ...core.quantities import quantity
from ...reading.results import part, result
from ...reading.text import number
from ...study.bearings import EXPONENT, largest_load, mean_load, pin_force
from ...study.readings import machine_series, turns_made
from ...study.record import StudyRuns
from .plan import BearingPlan, first_word, turning_pins
from .row import CheckRule, Checks
from .tables import PLAIN, BearingTable

_KIND = {"ball": {"clause": "5.3", "p": "3"}, "roller": {"clause": "7.3", "p": "10/3"}}
_LIFE = CheckRule(
    "rating life", "life", "ISO 281:2007, {clause}",
    "L = a (C/P)^p 10^6 turns, p = {p}; P = (sum F^p |dphi| / sum |dphi|)^(1/p)",
    "a = life_factor; C = C; P = load; mean |dphi/dt| = speed", at_least=True,
)  # fmt: skip
_LOAD = CheckRule(
    "equivalent load", "load", "ISO 281:2007, {clause}",
    "P <= 0.5 C, and P <= C0: beyond it the formula of the life does not hold", "P = load; C = C; C0 = C0",
)  # fmt: skip
_STATIC = CheckRule(
    "static safety ({run})", "static_safety", "ISO 76:2006, static safety factor",
    "S0 = C0/F, F: largest force of all runs", "C0 = C0; F = largest_force", at_least=True,
)  # fmt: skip
_SWING = CheckRule(
    "swing", "swing", "Rumbarger and Jones 1968; Harris, Rolling Bearing Analysis",
    "theta >= 4 pi/(Z (1 - gamma)): below it false brinelling threatens, and the rating life does not hold",
    "least = critical_swing", at_least=True,
)  # fmt: skip
_MAKER = "Limits of the maker of the bearing"
_PLAIN = (
    CheckRule(
        "pressure ({run})", "pressure", "Specific load of ISO 7902-1; limit of the maker of the bearing",
        "p = F/(d b), F: largest force of all runs", "F = largest_force; d = diameter; b = width",
    ),
    CheckRule("sliding speed", "speed", _MAKER, "v = d/2 |dphi/dt|, largest of steady running", "d = diameter"),
    CheckRule(
        "pressure times speed", "pv", _MAKER, "mean of F/(d b) d/2 |dphi/dt| over the time of steady running",
        "d = diameter; b = width",
    ),
)  # fmt: skip
"""Each limit is the quantity of the table with the name of the value."""
_MILLION_TURNS = 2e6 * math.pi
MOST_LOAD = 0.5
"""Equivalent load over the dynamic load rating up to which the formula of the life holds."""


@result
class RollingBearing:
    """A rolling bearing in steady running, and the largest force of all runs; None if it does not turn or carries
    nothing, or for data that the file does not give."""

    kind: str = part("ball or roller")
    run: str = part("the run with the largest force")
    C: float = quantity("N", "dynamic load rating")
    C0: float | None = quantity("N", "static load rating")
    p: float = quantity("1", "exponent of the load")
    load: float = quantity("N", "equivalent load P over the angle that it turns")
    speed: float = quantity("rad/s", "mean speed to and fro")
    swing: float | None = quantity("rad", "swing from end to end; none for a pin that turns round")
    amplitude_factor: float | None = quantity(
        "1", "a turn over the way that it turns in a turn of the {driver}"
    )
    life_factor: float = quantity("1", "factor a1 aISO of the life")
    life: float | None = quantity("s", "rating life", kind="hours")
    needed: float | None = quantity("N", "dynamic load rating for the life asked for")
    critical_swing: float | None = quantity("rad", "swing from which the tracks of the rolling elements meet")
    largest_force: float = quantity("N", "largest force of all runs")
    static_safety: float | None = quantity("1", "static safety C0/F")


@result
class PlainBearing:
    """A plain bearing in steady running, and its pressure under the largest force of all runs."""

    run: str = part("the run with the largest force")
    diameter: float = quantity("m", "diameter d", kind="millimetres")
    width: float = quantity("m", "width b", kind="millimetres")
    largest_force: float = quantity("N", "largest force of all runs")
    pressure: float = quantity("N/m2", "pressure under it", kind="stress")
    speed: float = quantity("m/s", "largest sliding speed of steady running")
    pv: float = quantity(
        "W/m2", "mean of pressure times sliding speed over the time of steady running", kind="pv"
    )


def rating_life(C: float, load: float, p: float, speed: float, factor: float = 1.0) -> float:
    """Rating life [s] of a bearing with the dynamic load rating `C` [N] at the equivalent `load` [N], exponent `p`,
    and a mean `speed` to and fro [rad/s]: factor (C/P)^p million turns."""
    return factor * (C / load) ** p * _MILLION_TURNS / speed


def needed_rating(life: float, load: float, p: float, speed: float, factor: float = 1.0) -> float:
    """Dynamic load rating [N] with which a bearing has that `life` [s]; see `rating_life`."""
    return load * (life * speed / (_MILLION_TURNS * factor)) ** (1.0 / p)


def critical_swing(elements: float, ratio: float) -> float:
    """Swing from end to end [rad] from which the tracks of neighbouring rolling elements meet on both rings.

    The cage turns (1 - gamma)/2 of the swing against the outer ring and (1 + gamma)/2 against the inner one; on the
    outer ring this has to reach the distance of two elements, 2 pi/Z: theta = 4 pi/(Z (1 - gamma)). Below it the
    lubricant is not brought back, and false brinelling threatens.
    """
    return 4.0 * math.pi / (elements * (1.0 - ratio))


def rolling_bearing(
    kind: str, table: BearingTable, time: Any, turns: float, force: Any, angle: Any, largest: float, run: str
) -> RollingBearing:
    """The bearing of that `kind` with the values of its `table`, over `turns` turns of the driver: `time` [s],
    `force` [N] and `angle` [rad] of the pin, each of shape (n,); its `largest` force [N] comes in `run`."""
    p, span = EXPONENT[kind], float(time[-1] - time[0])
    load, way = mean_load(force, angle, p), float(np.sum(np.abs(np.diff(angle))))
    speed, is_moved = way / span, load * way > 0.0
    swings = is_moved and abs(angle[-1] - angle[0]) <= math.pi
    cycle = (load, p, speed, table.life_factor)
    return RollingBearing(
        kind=kind,
        run=run,
        C=table.C,
        C0=table.C0,
        p=p,
        load=load,
        speed=speed,
        swing=float(np.ptp(angle)) if swings else None,
        amplitude_factor=2.0 * math.pi * turns / way if is_moved else None,
        life_factor=table.life_factor,
        life=rating_life(table.C, *cycle) if is_moved else None,
        needed=needed_rating(table.life, *cycle) if is_moved else None,
        critical_swing=critical_swing(table.elements, table.diameter_ratio) if table.elements else None,
        largest_force=largest,
        static_safety=table.C0 / largest if table.C0 and largest > 0.0 else None,
    )


def plain_bearing(
    table: BearingTable, time: Any, force: Any, angle: Any, largest: float, run: str
) -> PlainBearing:
    """The bearing with the values of its `table`; other arguments as of `rolling_bearing`."""
    step, slid = np.diff(time), 0.5 * table.diameter * np.abs(np.diff(angle))
    area = table.diameter * table.width
    return PlainBearing(
        run=run,
        diameter=table.diameter,
        width=table.width,
        largest_force=largest,
        pressure=largest / area,
        speed=float(np.max(slid / step)),
        pv=float(np.sum(0.5 * (force[1:] + force[:-1]) / area * slid) / np.sum(step)),
    )


def check_rolling(checks: Checks, pin: str, bearing: RollingBearing, table: BearingTable, run: str) -> None:
    """Check the rolling bearing of a `pin`; `run` is the title of the run with the largest force."""
    place, kind = (pin, f"checks.rolling.{pin}", bearing), _KIND[bearing.kind]
    least = bearing.critical_swing
    if bearing.swing is not None and least is not None and bearing.swing < least:
        why = (
            f"its swing of {number(bearing.swing, 'rad')} stays below {number(least, 'rad')}, from where on the "
            "formula holds; take a plain bearing, or ask the maker"
        )
        checks.lack(f"{pin}, rating life", why)
    else:
        checks.check(_LIFE, *place, table.life, **kind)
    most = MOST_LOAD * table.C
    checks.check(_LOAD, *place, min(most, table.C0 or most), **kind)
    if table.C0:
        checks.check(_STATIC, *place, table.static_safety, run=run)
    else:
        checks.lack(f"{pin}, static safety", "the file gives no static load rating C0")
    if bearing.swing is not None:
        checks.check(
            _SWING, *place, least, "the file does not give the number of rolling elements (elements)"
        )


def check_plain(checks: Checks, pin: str, bearing: PlainBearing, table: BearingTable, run: str) -> None:
    """Check the plain bearing of a `pin`; `run` is the title of the run with the largest force."""
    for rule in _PLAIN:
        why = f"the file gives no permitted {rule.value}"
        checks.check(rule, pin, f"checks.plain.{pin}", bearing, getattr(table, rule.value), why, run=run)


def find(
    runs: StudyRuns, plans: Mapping[str, BearingPlan], checks: Checks
) -> tuple[dict[str, RollingBearing], dict[str, PlainBearing]]:
    """The rolling and the plain bearings of a study by their pin, and their `checks`."""
    drive, turns = runs.drive, runs.steady
    rolling: dict[str, RollingBearing] = {}
    plain: dict[str, PlainBearing] = {}
    if drive.foreign_machine:
        checks.lack("bearings", "the machine is an FMU, whose pins are not known")
        return rolling, plain
    machine = drive.simulated_machine
    angles = machine.pin_turns(machine_series(turns)) if plans else {}
    for pin, (kind, table) in plans.items():
        name = machine.model.pins.get(pin)
        if name is None or name not in angles:
            checks.lack(f"{pin}, bearing", "its angle is not known with organs that are chains")
            continue
        largest, run = largest_load(runs.pins, pin)
        load = (pin_force(drive, turns, pin), angles[name], largest, run)
        time, title = turns["time"].values, runs.title_of(run)
        if kind == PLAIN:
            plain[pin] = plain_bearing(table, time, *load)
            check_plain(checks, pin, plain[pin], table, title)
        else:
            rolling[pin] = rolling_bearing(kind, table, time, turns_made(drive, turns), *load)
            check_rolling(checks, pin, rolling[pin], table, title)
    if missing := [pin for pin in turning_pins(machine.model) if pin not in plans]:
        key = f"bearing.{first_word(missing[0])}"
        why = f"the file has no table for {'them' if len(missing) > 1 else 'it'}; add [{key}]"
        checks.lack(f"bearings at {', '.join(missing)}", why, key)
    return rolling, plain
