# %% [markdown]
# Identification of hidden machines
#
# Random machines are recorded for a minute with their feed and for a minute without, synthetically, with noise of
# 1 %, converters of 12 bits, jitter and drift of the clock; then they are identified. Drives are a DC motor with
# speed control, a small induction motor, and a shaft whose torque is measured; a mark or an encoder tells the angle.
# `python bench/identification.py` keeps each trial in a folder, and goes on where it ended before.
#
# - `bare`: of the machine nothing is known but the bounds from which it is drawn.
# - `weighed`: masses are known to 5 %, gains of the sensors to 1 %.
# - `wrong`: the recorded machine is another one than the fitted model.
# - `slight`: it is another one, too, but moves the torque by no more than some percent, or at standstill alone.
# - `known`: masses, inertias, motor and gains are known; the feed, the friction and a weighed web are sought.
# - `doubted`: the same, with any two of the known numbers wrong by 20 %.

# %%
from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from figures import parser, save, table

from chainunit import GeometryError
from chainunit.capabilities.identification.posterior import posterior
from chainunit.capabilities.identification.suspects import (
    REJECTION,
    KnownNumbers,
    is_described,
    known_number_tests,
    suspect_sets,
)
from chainunit.drives.dc_motor import DcMotor
from chainunit.drives.induction_motor import InductionMotor
from chainunit.machines.api import ChainUnitOfChains
from chainunit.machines.chain_unit import ChamberForces
from chainunit.recordings.fit import fit
from chainunit.recordings.plant import Plant
from chainunit.recordings.problem import Problem, RecordedRun, Sensor
from chainunit.recordings.residuals import prior_conflicts, residual_tests, sensor_conflicts
from chainunit.recordings.shaft import MeasuredShaft
from chainunit.recordings.unknown import Unknown
from chainunit.study.config import parse
from chainunit.study.drive import Drive

sys.path.insert(0, str(Path(__file__).parents[1] / "examples" / "identification"))
from synthetic import HiddenRun, Logger, synthetic

RODS = [f"{side}.{rod}_mass" for side in ("left", "right") for rod in ("wall", "web")]
BODIES = [f"{body}.{x}" for body in ("crank", "coupler", "rocker") for x in ("m", "I")]
FEED = [f"{side}.{load}" for side in ("left", "right") for load in ("material_mass", "processing_force")]
RANGES = {
    "pin.friction": (0.05, 0.2),
    "joint_damping": (0.2, 2.0),
    **{name: (10.0, 60.0) if "mass" in name else (0.0, 200.0) for name in FEED},
}
"""Ranges in which numbers are drawn; the masses of rods are drawn within 40 % of the masses of the packaged machine,
all other masses and inertias within 30 %."""
WEIGHED, GAIN, NOISE, BITS, DURATION = 0.05, 0.01, 0.01, 12, 60.0
INDUCTION = {
    "stator.R": 25.0, "stator.C": 400.0, "stator.R_th": 0.4, "main.L": 1.1, "cage.R": 18.0, "cage.L": 0.14,
    "rotor.J": 0.0012, "rotor.d": 0.0005,
}  # fmt: skip
"""A motor of 0.25 kW: a large one would not notice the machine."""
FULL = {
    "motor.i": 5.0, "motor.u": 250.0, "motor.w": 200.0, "motor.power": 1000.0, "crank.tau": 500.0, "crank.w": 5.0,
}  # fmt: skip
NAMES = {"dc": "DC motor", "im": "induction motor", "torque": "torque behind the gear"}
KINDS = tuple(NAMES)
SPEED = {"dc": 3.0, "im": 3.08, "torque": 3.0}
WRONG: dict[str, dict[str, float]] = {
    "friction grows with speed": {"machine.pin.w_smooth": 0.2},
    "chains": {},
    "gear 2 % larger": {},
}
"""Recorded machines that the model does not describe, with the values that differ from those of the model."""
SLIGHT: dict[str, dict[str, float]] = {
    "crank 2 % longer": {},
    "friction without a smooth passage": {"machine.pin.w_smooth": 0.002},
}
"""The same with little difference."""
OTHERS = {"wrong": WRONG, "slight": SLIGHT}
CONVERTER = [f"motor.{loop}_control.{gain}" for loop in ("speed", "current") for gain in ("kp", "ki")]
MOTOR = ["motor.armature.R", "motor.armature.L", "motor.armature.k", "motor.rotor.J"]
DIMENSIONS = [f"machine.{name}" for name in ("r", "l", "h", "c", "hy", "e", "l1", "l2", "z")]
MASSES = [
    *(f"machine.{body}.{x}" for body in ("crank", "coupler", "rocker") for x in ("m", "s", "I")),
    *(f"machine.{rod}" for rod in RODS if rod != "left.web_mass"),
]
KNOWN = [*CONVERTER, *MOTOR, *DIMENSIONS, *MASSES]
"""Numbers that are known in the trials `known`, and two of which are wrong in `doubted`."""
SPREAD, MISTAKE, WEB, BRIEF = 0.15, 0.2, 0.1, 30.0
"""Part by which known masses, motors and gains are drawn around the packaged ones; that by which two of them are
stated wrong; standard deviation of the weighed web, in parts of it; and the time of a recording [s]."""
TRIALS = {"bare": 200, "weighed": 100, "wrong": 102, "slight": 20, "known": 100, "doubted": 100}
"""Number of machines of each kind of trial."""
SHARP = 0.005
"""Standard deviation in parts of the value from which on a number is told sharply."""


@dataclass(frozen=True)
class Hidden:
    """A machine to be found: its values by full name, and how it is recorded. `priors` are means and deviations."""

    kind: str
    rate: float
    angle: str
    seed: int
    values: dict[str, float]
    gain: dict[str, float] = field(default_factory=dict)
    priors: dict[str, tuple[float, float]] = field(default_factory=dict)
    wrong: str = ""


@lru_cache(maxsize=1)
def ranges() -> dict[str, tuple[float, float]]:
    """The ranges of all sought numbers."""
    packaged = parse("").machine.by_name
    widths = dict.fromkeys(RODS, 0.4) | dict.fromkeys(BODIES, 0.3)
    return {n: (packaged[n] * (1.0 - x), packaged[n] * (1.0 + x)) for n, x in widths.items()} | RANGES


def hidden(trial: str, k: int) -> Hidden:
    """The machine of this number."""
    rng = np.random.default_rng([k, list(TRIALS).index(trial)])
    values = {f"machine.{name}": float(rng.uniform(*limits)) for name, limits in ranges().items()}
    kind = KINDS[k % len(KINDS)]
    angle = "mark" if kind == "torque" else ("mark", "motor.count")[k // len(KINDS) % 2]
    own = Hidden(kind, 1000.0 if k % 4 == 0 else 200.0, angle, k, values)
    if trial in OTHERS:
        kinds, wrong = ("dc", "im"), list(OTHERS[trial])  # a torque is measured behind the gear
        return replace(own, kind=kinds[k // (2 * len(wrong)) % 2], wrong=wrong[k % len(wrong)])
    if trial == "bare":
        return own
    priors = {}
    for name in (*RODS, *(name for name in BODIES if name.endswith(".m"))):
        known = values[f"machine.{name}"] * (1.0 + WEIGHED * rng.standard_normal())
        priors[f"machine.{name}"] = float(known), float(WEIGHED * known)
    signals = [name for name in measured(kind, "mark") if not name.endswith(".w")]
    gain = {name: float(1.0 + GAIN * rng.standard_normal()) for name in signals}
    return replace(own, priors=priors, gain=gain)


def measured(kind: str, angle: str) -> tuple[str, ...]:
    """The analog columns."""
    if kind == "torque":
        return ("crank.tau", "crank.w")
    speed = () if angle == "motor.count" else ("motor.w",)
    return ("motor.i", {"dc": "motor.u", "im": "motor.power"}[kind], *speed)


@lru_cache(maxsize=16)
def drive(kind: str, wrong: str = "") -> Drive:
    """A drive with the packaged machine, or with a wrong one."""
    config, layout = parse(""), InductionMotor.parameter_layout
    machine = config.machine
    if wrong.startswith("gear"):
        machine = machine.replace(ratio=1.02 * machine.ratio)
    if wrong.startswith("crank"):
        machine = machine.replace(r=1.02 * machine.by_name["r"])
    induction = layout.from_names(INDUCTION, InductionMotor.Parameters())
    if wrong == "chains":
        machine = ChainUnitOfChains(machine.p)
    if kind == "im":
        return Drive(InductionMotor, induction, machine)
    return Drive(DcMotor, config.motor.parameters, machine)


@lru_cache(maxsize=16)
def plant(kind: str, angle: str) -> Plant | MeasuredShaft:
    """The model by which all that is sought is fitted."""
    by = [f"machine.{name}" for name in ranges()]
    if kind == "torque":
        return MeasuredShaft(drive(kind).machine, measured(kind, angle), by)
    return Plant(drive(kind), [*measured(kind, angle), *([angle] if angle != "mark" else [])], by)


def sought(of: Hidden) -> list[Unknown]:
    """The unknowns: bounds, and for weighed masses a prior."""
    layouts = ChamberForces.parameter_layout, ChamberForces.input_layout
    units = {v.name: v.unit for layout in layouts for v in layout.variables}
    unknowns = []
    for name, limits in ranges().items():
        if prior := of.priors.get(f"machine.{name}"):
            bounds = 0.5 * prior[0], 1.5 * prior[0]
            unknowns.append(Unknown(f"machine.{name}", units[name], prior[0], *bounds, prior[1]))
        else:
            unknowns.append(Unknown.within(f"machine.{name}", units[name], *limits))
    return unknowns


def problem(of: Hidden) -> Problem:
    """The recordings of a loaded and an empty run, and what is sought."""
    rng, speed = np.random.default_rng([of.seed, 7]), SPEED[of.kind]
    known = {} if of.kind == "im" else {"motor.w_ref": 50.0 * speed}
    columns, mark, runs = measured(of.kind, of.angle), float(rng.uniform(-0.35, 0.35)), []
    offset = {"torque": "crank.tau"}.get(of.kind, "motor.i")
    for name in ("loaded", "empty"):
        none = dict.fromkeys((f"machine.{x}" for x in FEED), 0.0) if name == "empty" else {}
        logger = Logger(
            rate=of.rate, noise=NOISE, full=FULL, bits=BITS, angles=(of.angle,), mark_angle=mark,
            offset={offset: float(0.004 * FULL[offset] * rng.standard_normal())}, gain=of.gain,
            drift=float(rng.uniform(-5e-5, 5e-5)),
        )  # fmt: skip
        run = HiddenRun(
            speed, DURATION, of.values | known | none | (WRONG | SLIGHT).get(of.wrong, {}),
            float(rng.uniform(0.0, 2.0 * math.pi)), float(rng.uniform(293.15, 325.0)),
        )  # fmt: skip
        recording = synthetic(drive(of.kind, of.wrong), columns, run, logger, rng)
        values = none if of.kind == "torque" else known | none
        runs.append(RecordedRun(name, recording, speed, values))
    sensors = {
        name: Sensor(
            NOISE,
            2.0 * FULL[name] / 2**BITS,
            GAIN if name in of.gain else 0.0,
            0.02 * FULL[name] if name == offset else 0.0,
        )
        for name in columns
    }
    return Problem(plant(of.kind, of.angle), runs, sought(of), sensors)


def result(trial: str, k: int) -> dict[str, Any]:
    """The identification of the machine of this number."""
    of = hidden(trial, k)
    asked = problem(of)
    began = time.perf_counter()
    best = fit(asked)
    known, around, tests = known_number_tests(asked, best), posterior(asked, best), residual_tests(best)
    scores = [*known.tests, *([known.law] if known.law else [])]
    figures = {
        "kind": of.kind, "angle": of.angle, "rate": of.rate, "wrong": of.wrong, "rounds": best.rounds,
        "is_described": is_described(asked, best, tests, around, known),
        "checks": [
            {"run": c.run, "column": c.column, "statistic": c.statistic, "noise": c.noise, "is_noise": c.is_noise}
            for c in tests
        ],
        "strains": [each.name for each in (*sensor_conflicts(asked, best), *prior_conflicts(asked.sought, best))],
        "suspicions": {score.name: (score.change, score.deviation) for score in scores},
        "suspicious": [score.name for score in scores if score.is_rejected],
        "held": around.active_bounds,
    }  # fmt: skip
    if trial not in OTHERS:
        figures["numbers"] = [
            {
                "name": m.name, "true": of.values[m.name], "value": m.value, "deviation": m.deviation, "low": m.low,
                "high": m.high, "spread": m.prior_deviation, "fitted": float(x), "bound": float(s),
            }
            for m, x, s in zip(around.marginals, best.z, best.deviations, strict=False)
        ]  # fmt: skip
    figures["seconds"] = time.perf_counter() - began
    return figures


@dataclass(frozen=True)
class Stated:
    """A machine of which all but a few numbers are known: the true `values` by full name, the `stated` ones of the
    known numbers, and those of them that are `wrong`."""

    seed: int
    values: dict[str, float]
    stated: dict[str, float]
    wrong: tuple[str, ...]


def stated(trial: str, k: int) -> Stated:
    """The machine of this number of the trials `known` and `doubted`, whose numbers are the same."""
    rng, base = np.random.default_rng([k, 41]), drive("dc")
    motor = DcMotor.parameter_layout.by_name(base.parameters)
    packaged = {f"machine.{name}": x for name, x in base.machine.by_name.items()}
    packaged |= {f"motor.{name}": x for name, x in motor.items()}
    known = {name: float(packaged[name] * (1.0 + SPREAD * rng.uniform(-1.0, 1.0))) for name in KNOWN}
    known |= {name: float(packaged[name]) for name in DIMENSIONS}
    values = {f"machine.{name}": float(rng.uniform(*RANGES[name])) for name in (*FEED, "pin.friction")}
    values["machine.left.web_mass"] = float(packaged["machine.left.web_mass"] * rng.uniform(0.85, 1.15))
    wrong = tuple(map(str, rng.choice(KNOWN, 2, replace=False))) if trial == "doubted" else ()
    mistakes = {name: known[name] * (1.0 + MISTAKE * float(rng.choice([-1.0, 1.0]))) for name in wrong}
    return Stated(k, values | known, known | mistakes, wrong)


def stated_problem(of: Stated) -> Problem:
    """The recordings of a loaded and an empty run, with what is sought, by the drive as it is stated."""
    rng, speed, base, runs = np.random.default_rng([of.seed, 43]), SPEED["dc"], drive("dc"), []
    columns, mark = measured("dc", "mark"), float(rng.uniform(-0.35, 0.35))
    for name in ("loaded", "empty"):
        none = dict.fromkeys((f"machine.{x}" for x in FEED), 0.0) if name == "empty" else {}
        logger = Logger(
            rate=200.0, noise=NOISE, full=FULL, bits=BITS, mark_angle=mark,
            offset={"motor.i": float(0.004 * FULL["motor.i"] * rng.standard_normal())},
            drift=float(rng.uniform(-5e-5, 5e-5)),
        )  # fmt: skip
        known = {"motor.w_ref": base.ratio * speed}
        run = HiddenRun(
            speed, BRIEF, of.values | known | none, float(rng.uniform(0.0, 2.0 * math.pi)),
            float(rng.uniform(293.15, 325.0)),
        )  # fmt: skip
        runs.append(RecordedRun(name, synthetic(base, columns, run, logger, rng), speed, known | none))
    numbers = {
        kind: {name.removeprefix(kind): x for name, x in of.stated.items() if name.startswith(kind)}
        for kind in ("motor.", "machine.")
    }
    motor = DcMotor.parameter_layout.from_names(numbers["motor."], base.parameters)
    web = of.values["machine.left.web_mass"] * (1.0 + WEB * float(rng.standard_normal()))
    units = {
        v.name: v.unit
        for x in (ChamberForces.parameter_layout, ChamberForces.input_layout)
        for v in x.variables
    }
    asked = [
        *(Unknown.within(f"machine.{name}", units[name], *RANGES[name]) for name in (*FEED, "pin.friction")),
        Unknown("machine.left.web_mass", "kg", web, 0.5 * web, 1.5 * web, WEB * web),
    ]
    model = Drive(DcMotor, motor, base.machine.replace(numbers["machine."]))
    sensors = {
        name: Sensor(NOISE, 2.0 * FULL[name] / 2**BITS, 0.0, 0.02 * FULL[name] if name == "motor.i" else 0.0)
        for name in columns
    }
    return Problem(Plant(model, columns, [u.name for u in asked]), runs, asked, sensors)


def is_shown(of: Stated, name: str, known: KnownNumbers) -> bool:
    """Whether the recordings show that a known number is wrong, if all others are right."""
    (test,) = [each for each in known.tests if each.name == name]
    return abs(of.stated[name] - of.values[name]) > REJECTION * test.deviation


def stated_result(trial: str, k: int) -> dict[str, Any]:
    """The identification of the machine of this number. A machine that cannot turn with the stated lengths is refused
    before a fit: its suspects are the lengths that the refusal names."""
    of = stated(trial, k)
    try:
        asked = stated_problem(of)
    except GeometryError as refusal:
        named = {"names": [f"machine.{name}" for name in refusal.names], "excess": 0.0, "describes": None}
        return {
            "wrong": of.wrong, "shown": [], "is_described": False, "refusal": str(refusal), "sets": [named],
            "numbers": [], "rounds": 0, "seconds": 0.0,
        }  # fmt: skip
    began = time.perf_counter()
    best = fit(asked)
    known, around = known_number_tests(asked, best), posterior(asked, best)
    conflicts = [*sensor_conflicts(asked, best), *prior_conflicts(asked.sought, best)]
    tests = residual_tests(best)
    described = is_described(asked, best, tests, around, known)
    sets = () if described else suspect_sets(asked, best)
    return {
        "wrong": of.wrong, "shown": [name for name in of.wrong if is_shown(of, name, known)],
        "is_described": described, "is_ended": best.is_ended, "is_noise": all(test.is_noise for test in tests),
        "strains": [each.name for each in conflicts], "held": around.active_bounds, "rounds": best.rounds,
        "rejected": [each.name for each in known.tests if each.is_rejected], "law": known.is_law_rejected,
        "sets": [
            {"names": [x.name for x in each.suspects], "excess": each.excess, "describes": each.describes}
            for each in sets
        ],
        "numbers": [
            {
                "name": m.name, "true": of.values[m.name], "value": m.value, "deviation": m.deviation, "low": m.low,
                "high": m.high, "spread": m.prior_deviation, "fitted": float(x), "bound": float(s),
            }
            for m, x, s in zip(around.marginals, best.z, best.deviations, strict=False)
        ],
        "seconds": time.perf_counter() - began,
    }  # fmt: skip


# %% [markdown]
# Of the numbers of all machines, `cover` is the share within their interval of 95 %, `error` the root mean square of
# the errors in stated standard deviations, and `to_bound` that in the bounds by Cramer and Rao at the best fit.


# %%
def coverage(trials: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """How well errors follow their stated standard deviations."""
    numbers = [each for trial in trials for each in trial["numbers"]]
    column = {key: np.array([each[key] for each in numbers]) for key in numbers[0] if key != "name"}
    true, error = column["true"], column["value"] - column["true"]
    scaled = error / column["deviation"]
    figures = {
        "numbers": len(numbers),
        "cover": float(np.mean((column["low"] <= true) & (true <= column["high"]))),
        "error": float(np.sqrt(np.mean(scaled**2))),
        "mean": float(np.mean(scaled)),
        "to_bound": float(np.sqrt(np.mean((error / column["bound"]) ** 2))),
        "sharp": 0,
    }
    sharp = (column["bound"] <= SHARP * true) & (true > 0.0)
    if np.any(sharp):
        relative = np.abs(error / true)[sharp]
        figures |= {
            "sharp": int(np.sum(sharp)),
            "sharp_worst": float(np.max(relative)),
            "sharp_median": float(np.median(relative)),
        }
    return figures


GOALS = {"material_mass": 0.03, "pin.friction": 0.05, "joint_damping": 0.05}
"""By the end of a name, the error in parts of the value that is the goal with weighed machines."""


def reached(trials: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """How many numbers are within their goals, by drive: of all, and of those for which the bound by Cramer and Rao
    lets 95 % be within it."""
    rows = []
    for end, goal in GOALS.items():
        for kind in KINDS:
            own = [
                each
                for trial in trials
                if trial["kind"] == kind
                for each in trial["numbers"]
                if each["name"].endswith(end)
            ]
            near = [abs(each["value"] / each["true"] - 1.0) <= goal for each in own]
            can = [2.0 * each["bound"] <= goal * each["true"] for each in own]
            both = sum(a and b for a, b in zip(near, can, strict=True))
            rows.append(
                {
                    "number": end, "kind": kind, "goal": goal, "numbers": len(own), "within": sum(near),
                    "possible": sum(can), "both": both,
                    "bound": float(np.median([each["bound"] / each["true"] for each in own])) if own else 0.0,
                }
            )  # fmt: skip
    return rows


def by_number(trials: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, float]]:
    """By sought number: coverage, errors in stated deviations, and errors in parts of the value."""
    table = {}
    for k, first in enumerate(trials[0]["numbers"]):
        rows = [each["numbers"][k] for each in trials]
        relative = [abs(row["value"] / row["true"] - 1.0) for row in rows]
        own = coverage([{"numbers": rows}])
        table[first["name"].removeprefix("machine.")] = {
            "cover": own["cover"], "error": own["error"], "to_bound": own["to_bound"],
            "median": float(np.median(relative)), "p95": float(np.quantile(relative, 0.95)),
            "worst": float(np.max(relative)),
        }  # fmt: skip
    return table


def summary(trials: Mapping[str, Sequence[Mapping[str, Any]]]) -> dict[str, Any]:
    """The figures of all kept trials."""
    figures: dict[str, Any] = {}
    for trial in ("bare", "weighed"):
        own = trials[trial]
        if own:
            alarms = [not row["is_described"] for row in own]
            figures[trial] = {
                "machines": len(own),
                **coverage(own),
                "by_number": by_number(own),
                "by_kind": {
                    kind: coverage(some)
                    for kind in KINDS
                    if (some := [each for each in own if each["kind"] == kind])
                },
                "alarms": float(np.mean(alarms)),
                "goals": reached(own),
                "rounds": max(each["rounds"] for each in own),
                "seconds": float(np.median([each["seconds"] for each in own])),
            }
    for trial, others in OTHERS.items():
        for name in others:
            if own := [each for each in trials[trial] if each["wrong"] == name]:
                found = float(np.mean([not row["is_described"] for row in own]))
                figures.setdefault(trial, {})[name] = {"machines": len(own), "found": found}
    if own := trials["known"]:
        figures["known"] = {
            "machines": len(own),
            **coverage(own),
            "alarms": float(np.mean([not each["is_described"] for each in own])),
            "seconds": float(np.median([each["seconds"] for each in own])),
        }
    if own := trials["doubted"]:
        figures["doubted"] = suspicion(own)
    return figures


def suspicion(trials: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """How many machines with two wrong numbers are not described, and what the suspects of these contain: both wrong
    numbers, in one set or in several; and the coverage of the machines that are described nevertheless."""
    told = [each for each in trials if not each["is_described"]]
    suspects = [{name for some in each["sets"] for name in some["names"]} for each in told]
    wrong = [set(each["wrong"]) for each in told]
    quiet = [each for each in trials if each["is_described"]]
    return {
        "machines": len(trials),
        "told": len(told),
        "both": sum(own <= some for own, some in zip(wrong, suspects, strict=True)),
        "shown": sum(set(each["shown"]) <= some for each, some in zip(told, suspects, strict=True)),
        "one": sum(bool(own & some) for own, some in zip(wrong, suspects, strict=True)),
        "first": sum(
            bool(each["sets"]) and own == set(each["sets"][0]["names"])
            for own, each in zip(wrong, told, strict=True)
        ),
        "suspects": float(np.median([len(some) for some in suspects])) if told else 0.0,
        "cover_of_others": coverage(quiet)["cover"] if quiet else None,
        "seconds": float(np.median([each["seconds"] for each in trials])),
    }


def kept(folder: Path, trial: str, count: int) -> list[dict[str, Any]]:
    """The kept trials of a kind."""
    files = [folder / f"{trial}-{k}.json" for k in range(count)]
    return [json.loads(file.read_text("utf-8")) for file in files if file.exists()]


HEADS = {
    "cover": "within 95 %", "error": "error / deviation", "to_bound": "error / bound", "median": "median error",
    "p95": "95 % of the errors", "worst": "largest error",
}  # fmt: skip


def cell(key: str, x: float) -> str:
    if key in ("error", "to_bound"):
        return f"{x:.2f}"
    return f"{100.0 * x:.1f} %" if key == "cover" or x > 1.0 else f"{100.0 * x:.2g} %"


def coverage_table(figures: Mapping[str, Any]) -> str:
    """How errors follow their stated deviations, over all numbers, by drive and by number."""
    kinds = {f"all, {NAMES[kind]}": row for kind, row in figures["by_kind"].items()}
    rows = {"all numbers": figures, **kinds, **figures["by_number"]}
    keys = list(HEADS)
    cells = (
        [name, *(cell(key, row[key]) if key in row else "" for key in keys)] for name, row in rows.items()
    )
    return table(["", *HEADS.values()], cells)


def words(figures: Mapping[str, Any]) -> str:
    """The rest of the figures of `bare` or `weighed`."""
    f = figures
    return (
        f"{f['machines']} machines, {f['numbers']:,} numbers. Errors over stated deviations have the mean "
        f"{f['mean']:.2f} and the root mean square {f['error']:.2f}; the spread is {f['to_bound']:.2f} of the "
        f"bound. Of {f['sharp']} numbers with a bound of at most {100.0 * SHARP:g} % the largest error is "
        f"{100.0 * f.get('sharp_worst', 0.0):.2g} %, the median {100.0 * f.get('sharp_median', 0.0):.2g} %. A fit "
        f"takes at most {f['rounds']} rounds, an identification {f['seconds']:.0f} s (median). "
        f"{100.0 * f['alarms']:.2g} % of the machines are taken for another one."
    )


def goal_table(figures: Mapping[str, Any]) -> str:
    """How many numbers are within their goals."""
    cells = (
        [
            f"{row['number']}, {NAMES[row['kind']]}", f"{100.0 * row['goal']:g} %", f"{100.0 * row['bound']:.2g} %",
            f"{row['within']} of {row['numbers']}", f"{row['both']} of {row['possible']}",
        ]
        for row in figures["goals"]
    )  # fmt: skip
    heads = ["", "goal", "median bound", "within the goal", "of those with a bound of at most half the goal"]
    return table(heads, cells)


def recognised(figures: Mapping[str, Any]) -> str:
    """How many wrong models are recognised."""
    others = {name: row for trial in OTHERS for name, row in figures.get(trial, {}).items()}
    cells = ([name, str(row["machines"]), f"{100.0 * row['found']:.0f} %"] for name, row in others.items())
    return table(["recorded machine", "trials", "recognised"], cells)


def known_words(figures: Mapping[str, Any]) -> str:
    """The figures of `known`."""
    f = figures
    return (
        f"{f['machines']} machines, {f['numbers']:,} numbers, of which {100.0 * f['cover']:.1f} % are within their "
        f"intervals of 95 %. {100.0 * f['alarms']:.2g} % of the machines are taken for another one."
    )


def doubted_words(figures: Mapping[str, Any]) -> str:
    """The figures of `doubted`."""
    f = figures
    return (
        f"{f['machines']} machines, of which {f['told']} are told. Of these, {f['both']} have both wrong numbers "
        f"among their suspects, which are {f['suspects']:.0f} (median), {f['shown']} have all numbers that the "
        f"recordings show to be wrong if all others are right, and {f['one']} have one at least; "
        f"{f['first']} have the two as first set of suspects. An identification with its suspects takes "
        f"{f['seconds']:.0f} s (median)."
    )


SUSPICION = {"known": known_words, "doubted": doubted_words}


def tables(figures: Mapping[str, Any]) -> dict[str, str]:
    """The tables and sentences of the figures in Markdown, by name."""
    own = [trial for trial in ("bare", "weighed") if trial in figures]
    return {
        **{trial: coverage_table(figures[trial]) for trial in own},
        **{f"{trial}_words": words(figures[trial]) for trial in own},
        **{f"{trial}_goals": goal_table(figures[trial]) for trial in own},
        "recognised": recognised(figures),
        **{f"{trial}_words": words(figures[trial]) for trial, words in SUSPICION.items() if trial in figures},
    }


def main() -> None:
    options = parser()
    options.add_argument(
        "--folder", type=Path, default=Path("identification_trials"), help="where trials are kept"
    )
    for trial, count in TRIALS.items():
        options.add_argument(f"--{trial}", type=int, default=count, help="number of machines")
    given = options.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    counts = {trial: getattr(given, trial) for trial in TRIALS}
    for trial, count in counts.items():
        for k in range(count):
            file = given.folder / f"{trial}-{k}.json"
            if not file.exists():
                figures = (stated_result if trial in ("known", "doubted") else result)(trial, k)
                file.write_text(json.dumps(figures) + "\n", "utf-8")
                print(
                    f"{trial} {k + 1} of {count}: {figures['rounds']} rounds, {figures['seconds']:.1f} s",
                    flush=True,
                )
    figures = summary({trial: kept(given.folder, trial, count) for trial, count in counts.items()})
    print(*tables(figures).values(), sep="\n\n")
    save(given.json, figures)


if __name__ == "__main__":
    main()
