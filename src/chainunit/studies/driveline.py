"""A crusher's accelerator behind a cardan shaft, by itself: natural frequency, resonance, stability in rotation.

The mechanics are in `drives.cardan` and `drives.torsion`; here are the driveline file, the grids, and what the
numbers mean in words.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, ConfigDict, Field, ValidationError, create_model
from scipy.signal import find_peaks

from .. import __version__
from ..drives.cardan import (
    ORDERS,
    Cardan,
    FrequencyBand,
    check,
    frequency_band,
    frozen_frequency,
    sensitivity,
    two_joints,
)
from ..drives.line_table import SHAFTS, Damping, form, values
from ..drives.torsion import (
    RigidPeaks,
    SimulatedPeaks,
    SteadyMotion,
    damping_ratio,
    rigid,
    settling_time,
    simulate,
    simulation_steps,
    steady,
    with_damping_ratio,
)
from ..engines import numpy_
from ..errors import InputError
from ..quantities import Layout, Value, declaration, quantity, variables
from ..reading import (
    Title,
    first_line,
    given_values,
    instance,
    merged,
    packaged,
    read,
    schema,
    to_number,
    toml,
)
from ..text import number

TONGUES = (1, 2, 3, 4)
"""n of the parametric resonances 2 speed = 2 k/n."""
DENSER = (*TONGUES, 6)
"""n of the speeds k/n about which the curves have more points; order 6 comes with large bends"""
MOST_STEPS = 200_000
"""of a time simulation"""
LOST = 0.01
"""share of the speed by which a time simulation may have left what was asked"""
LEAST_DAMPING = 0.003
"""below which time simulation would take too long"""
DRIFT = 0.01
"""growth of a deviation of the mean speed [1/s] from which on it is worth a word"""
PEAK = 8
"""points between a peak of the coarse resonance curve and its neighbours"""
ROUNDOFF, ROUNDOFF_TORQUE = 1e-9, 1e-6
"""amplitude of an order [rad] and torque [N.m] up to which they are none"""
SIMULATED = 5
"""every so many points of the resonance curve are simulated"""


@declaration
class Running:
    """How the driveline runs, and what is looked at."""

    speed: Value = quantity(
        "rad/s", "mean speed in normal running", default=150.0, above=0.0, max=1e4, kind="speed"
    )
    load: Value = quantity("N.m", "mean torque on the driven inertia", default=375.0, min=0.0, max=1e9)
    speed_low: Value = quantity(
        "rad/s", "least speed that is looked at", default=40.0, above=0.0, max=1e4, kind="speed"
    )
    speed_high: Value = quantity(
        "rad/s", "largest speed that is looked at", default=300.0, above=0.0, max=1e4, kind="speed"
    )
    points: Value = quantity(
        "1", "number of speeds of the resonance curve", default=200.0, min=10.0, max=5000.0
    )
    margin: Value = quantity(
        "1",
        "permitted nearness to a resonance, as a share of the speed",
        default=0.15,
        min=0.0,
        max=1.0,
        kind="percent",
    )
    factor: Value = quantity(
        "1", "permitted ratio of the peak torque to that of the load alone", default=1.5, min=1.0, max=100.0
    )


@declaration
class Map:
    """The map of stability."""

    bend_low: Value = quantity("rad", "least bend of the map", default=0.0, min=0.0, max=1.5)
    bend_high: Value = quantity("rad", "largest bend of the map", default=0.7, min=0.0, max=1.5)
    speeds: Value = quantity("1", "number of speeds of the map", default=64.0, min=2.0, max=1000.0)
    bends: Value = quantity("1", "number of bends of the map", default=14.0, min=2.0, max=1000.0)


JOINTS = {"alpha1": ("alpha1",), "alpha2": ("alpha2",), "both": ("alpha1", "alpha2")}

_RATIO = next(
    dataclasses.replace(v, name="stability.damping_ratios")
    for v in variables(Damping)
    if v.name == "damping_ratio"
)
_Line = form(Cardan, "driveline", "driveline.")
_Running = schema(Running, "running", "running.")
_Stability = schema(
    Map,
    "stability",
    "stability.",
    joint=(Literal[*JOINTS], "alpha1"),
    damping_ratios=(
        Annotated[
            list[Annotated[float, BeforeValidator(lambda given: to_number(_RATIO, given))]],
            Field(min_length=1, max_length=4),
        ],
        [0.02],
    ),
)
_File: Any = create_model(
    "Driveline",
    __config__=ConfigDict(extra="forbid"),
    title=(Title, ""),
    driveline=(_Line, Field(default_factory=_Line)),
    running=(_Running, Field(default_factory=_Running)),
    stability=(_Stability, Field(default_factory=_Stability)),
)


@dataclasses.dataclass(frozen=True)
class Config:
    """A driveline file, checked."""

    title: str
    line: Cardan
    running: Running
    map: Map
    joint: str
    damping_ratios: tuple[float, ...]


def load(file: Path | None = None) -> Config:
    """Read and check a driveline file; without one, the packaged example.

    Raises
    ------
    InputError
        in one line: the file, the field, its value and what is allowed.
    """
    return read(file, example, parse)


def example() -> str:
    """The packaged driveline file."""
    return packaged("driveline.toml")


def _over_example(data: Mapping[str, Any]) -> dict[str, Any]:
    """A driveline file laid over the packaged example: what is not named is the example's. Its shafts and its damping
    give way whole to the user's own."""
    base = toml(example())
    base["title"] = ""
    mine = data.get("driveline", {})
    for shaft, stiffness in SHAFTS.items():
        if shaft in mine or stiffness in mine:
            del base["driveline"][shaft]
    if "d2" in mine or "d3" in mine:
        del base["driveline"]["damping_ratio"]
    return merged(base, data)


def parse(text: str, source: str = "driveline") -> Config:
    """A driveline from TOML text.

    Raises
    ------
    InputError
        see `load`.
    """
    data = toml(text)
    try:
        _File.model_validate(data)
        checked: Any = _File.model_validate(_over_example(data))
    except ValidationError as error:
        raise InputError(first_line(error, _File)) from error
    line = instance(Cardan, values(checked.driveline, "driveline."))
    try:
        check(line)
    except InputError as error:
        raise InputError(f"driveline.{error}") from error
    running = instance(Running, given_values(checked.running))
    given = given_values(checked.stability)
    config = Config(
        title=checked.title,
        line=line,
        running=running,
        map=instance(Map, {name: x for name, x in given.items() if name in Layout(Map).names}),
        joint=checked.stability.joint,
        damping_ratios=tuple(sorted(set(checked.stability.damping_ratios))),
    )
    _consistent(config)
    return config


def _consistent(config: Config) -> None:
    running, map_ = config.running, config.map
    for low, high, name, unit in (
        (running.speed_low, running.speed_high, "running.speed_high", "rad/s"),
        (map_.bend_low, map_.bend_high, "stability.bend_high", "rad"),
    ):
        if not high > low:
            raise InputError(f"{name} = {high:g} {unit}: must be > {low:g} {unit}, the least")
    for name, count in (
        ("running.points", running.points),
        ("stability.speeds", map_.speeds),
        ("stability.bends", map_.bends),
    ):
        if count != int(count):
            raise InputError(f"{name} = {count:g}: must be a whole number")
    k = frozen_frequency(numpy_(), config.line, 1.0)
    if not 0.01 <= k <= 1e6:
        raise InputError(
            f"natural frequency of the driveline = {k:.3g} rad/s: must be >= 0.01 and <= 1e+06 rad/s; check c2, c3, "
            "J1, J4"
        )
    slowest = frequency_band(config.line).largest / 50.0
    for name in ("speed", "speed_low"):
        given = getattr(running, name)
        if given < slowest:
            raise InputError(
                f"running.{name} = {given:g} rad/s: must be >= {slowest:.4g} rad/s, a fiftieth of the natural "
                "frequency; below that nothing resonates with orders 2 and 4"
            )


def speeds(low: float, high: float, k: float, points: int) -> Any:
    """Speeds [rad/s] from `low` to `high`, denser around the resonances k/n, shape (points,)."""
    fine = np.linspace(low, high, 20001)
    density = np.ones_like(fine)
    for n in DENSER:
        density += 6.0 / (1.0 + ((fine * n / k - 1.0) / 0.02) ** 2)
    reached = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    return np.interp(np.linspace(0.0, reached[-1], points), reached, fine)


@dataclasses.dataclass(frozen=True)
class StabilityMap:
    """Growth of torsional disturbances over speed, bend and damping ratio."""

    speed: Any
    """[rad/s], (speeds,)"""
    bend: Any
    """[rad], (bends,)"""
    ratio: tuple[float, ...]
    growth: Any
    """[1/s], (ratios, bends, speeds); NaN where no steady motion was found"""
    unstable: Any
    """bool, of the same shape"""


@dataclasses.dataclass(frozen=True)
class DrivelineStudy:
    """What is known of a driveline."""

    config: Config
    damping_ratio: float
    band: FrequencyBand
    at_even: float
    """natural frequency at i23 = 1 [rad/s]"""
    excitation: dict[int, float]
    """amplitude of phi3 - phi2 by order [rad]"""
    angle: Any
    """over a turn [rad], (points,)"""
    ratio: Any
    """i23 over `angle`"""
    frequency: Any
    """frozen-angle natural frequency over `angle` [rad/s]"""
    sensitivity: dict[str, float]
    speed: Any
    """[rad/s], (speeds,), of `steady` and `rigid`"""
    steady: SteadyMotion
    rigid: RigidPeaks
    operating: SteadyMotion
    simulated: SimulatedPeaks | None
    asked: Any
    """speeds that were asked of the simulation [rad/s]"""
    map: StabilityMap
    notes: tuple[str, ...]
    warnings: tuple[str, ...]

    @property
    def static2(self) -> float:
        """Largest torque of shaft 2 from the load alone, without inertia [N.m]."""
        return float(np.max(self.ratio)) * self.config.running.load

    @property
    def kept(self) -> Any:
        """Which points of the time simulation kept the speed that was asked, bool."""
        assert self.simulated is not None
        return np.abs(self.simulated.speed / self.asked - 1.0) < LOST

    def crossings(self) -> dict[int, tuple[float, float]]:
        """Speeds at which an order meets the band of the natural frequency, or 2 speed = 2 k/n [rad/s], by n."""
        return {n: (self.band.least / n, self.band.largest / n) for n in TONGUES}

    def unstable_ranges(self) -> list[tuple[float, float]]:
        """Ranges of speed in which a torsional disturbance grows [rad/s], between points of the resonance curve."""
        return _ranges(self.speed, self.steady.unstable)

    def drifting_ranges(self) -> list[tuple[float, float]]:
        """Ranges of speed that a constant torque does not hold, though torsion is stable [rad/s]."""
        return _ranges(self.speed, (self.steady.free_growth > DRIFT) & ~self.steady.unstable)

    def missing_ranges(self) -> list[tuple[float, float]]:
        """Ranges of speed without a steady motion that repeats itself after half a turn [rad/s]."""
        return _ranges(self.speed, ~self.steady.found)

    def resonances(self) -> list[tuple[float, float]]:
        """Speed [rad/s] and torque of shaft 2 [N.m] of each peak of the resonance curve, by speed."""
        peak = self.steady.peak2
        return [(float(self.speed[j]), float(peak[j])) for j in _peaks(peak)]


def _peaks(curve: Any) -> Any:
    """Places of the inner maxima that stand out by 2 %, above the ripple of torques that are sampled once a step."""
    known = np.isfinite(curve)
    if not known.any():
        return []
    height = np.log(np.maximum(np.where(known, curve, 1.0), 1e-9))
    # a gap counts as higher than all: beside it nothing is known to be a peak
    found, _ = find_peaks(np.where(known, height, height[known].max() + 1.0), prominence=0.02)
    return [int(j) for j in found if known[j]]


def _refined(line: Cardan, load: float, speed: Any, curve: SteadyMotion) -> tuple[Any, SteadyMotion]:
    """The resonance curve with more points about each of its peaks, whose heights a coarse grid misses."""
    near = [np.linspace(speed[j - 1], speed[j + 1], 2 * PEAK + 1)[1:-1] for j in _peaks(curve.peak2)]
    if not near:
        return speed, curve
    more = np.setdiff1d(np.concatenate(near), speed)
    added = steady(line, more, load)
    order = np.argsort(np.concatenate([speed, more]))
    whole = (np.concatenate([a, b], axis=-1)[..., order] for a, b in zip(curve, added, strict=True))
    return np.concatenate([speed, more])[order], SteadyMotion(*whole)


def _ranges(x: Any, inside: Any) -> list[tuple[float, float]]:
    """Ends of the runs of points that are `inside`, half-way to their neighbours outside."""
    middle = np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1]), x[-1:]])
    edge = np.diff(np.concatenate([[False], inside, [False]]).astype(int))
    begins, ends = np.flatnonzero(edge > 0), np.flatnonzero(edge < 0)
    return [(float(middle[a]), float(middle[b])) for a, b in zip(begins, ends, strict=True)]


Report = Callable[[str, float, float], None]


def run_driveline(config: Config, report: Report = lambda what, done, todo: None) -> DrivelineStudy:
    """Compute everything; `report` is told what is done and how much of it."""
    line, running = config.line, config.running
    xp = numpy_()
    k = float(frozen_frequency(xp, line, 1.0))
    angle = np.linspace(0.0, 2.0 * math.pi, 721)
    phi3, ratio, _ = two_joints(xp, line, angle)
    lead = phi3 - angle
    amplitudes = {n: float(2.0 * abs(np.mean(lead[:-1] * np.exp(-1j * n * angle[:-1])))) for n in ORDERS}
    excitation = {n: size if size > ROUNDOFF else 0.0 for n, size in amplitudes.items()}
    speed = speeds(running.speed_low, running.speed_high, k, int(running.points))
    curve = steady(line, speed, running.load, lambda done: report("steady motion", done, 1.0))
    speed, curve = _refined(line, running.load, speed, curve)
    operating = steady(line, running.speed, running.load)
    zeta = damping_ratio(line)
    asked = speed[::SIMULATED]
    simulated = None
    settle = settling_time(line, 0.01)
    if zeta >= LEAST_DAMPING and simulation_steps(line, asked, settle) <= MOST_STEPS:
        simulated = simulate(
            line,
            asked,
            running.load,
            settle,
            progress=lambda done: report("time simulation", done, 1.0),
        )
    map_ = stability_map(config, lambda done: report("map of stability", done, 1.0))
    study = DrivelineStudy(
        config=config,
        damping_ratio=zeta,
        band=frequency_band(line),
        at_even=k,
        excitation=excitation,
        angle=angle,
        ratio=ratio,
        frequency=frozen_frequency(xp, line, ratio),
        sensitivity=sensitivity(line),
        speed=speed,
        steady=curve,
        rigid=rigid(line, speed, running.load),
        operating=operating,
        simulated=simulated,
        asked=asked,
        map=map_,
        notes=(),
        warnings=(),
    )
    return dataclasses.replace(study, notes=tuple(_notes(study)), warnings=tuple(_warnings(study)))


def stability_map(config: Config, progress: Callable[[float], None] = lambda done: None) -> StabilityMap:
    """Floquet stability over speed, bend and damping, under the mean load."""
    line, running, map_ = config.line, config.running, config.map
    k = float(frozen_frequency(numpy_(), line, 1.0))
    speed = speeds(running.speed_low, running.speed_high, k, int(map_.speeds))
    bend = np.linspace(map_.bend_low, map_.bend_high, int(map_.bends))
    ratios = np.array(config.damping_ratios)
    each_ratio, each_bend, each_speed = (x.ravel() for x in np.meshgrid(ratios, bend, speed, indexing="ij"))
    varied: dict[str, Any] = dict.fromkeys(JOINTS[config.joint], each_bend)
    damped = with_damping_ratio(line, 1.0)
    p = dataclasses.replace(line, d2=damped.d2 * each_ratio, d3=damped.d3 * each_ratio, **varied)
    found = steady(p, each_speed, running.load, progress)
    shape = (len(ratios), len(bend), len(speed))
    return StabilityMap(
        speed, bend, config.damping_ratios, found.growth.reshape(shape), found.unstable.reshape(shape)
    )


def speed_text(*ends: float) -> str:
    """A speed [rad/s], or a range of speeds from one to the other, in words."""
    return " to ".join(number(float(end), "rad/s", "speed", 4) for end in ends)


def _torque(value: float) -> str:
    return number(value, "N.m", digits=4)


def _percent(value: float) -> str:
    return number(value, "1", "percent")


def _ratio(value: float) -> str:
    return number(float(value), "1", digits=4)


def _degrees(value: float) -> str:
    return number(value, "rad")


def _notes(study: DrivelineStudy) -> list[str]:
    by = study.sensitivity
    names = {"J1": "rotor J1", "J4": "driven inertia J4", "c2": "shaft 2", "c3": "shaft 3"}
    strongest = sorted(by, key=lambda name: -abs(by[name]))
    said = ", ".join(
        f"{'stiffer' if name[0] == 'c' else 'lighter'} {names[name]}: {_percent(0.01 * abs(by[name]))}"
        for name in strongest
    )
    notes = [f"What raises the natural frequency, per 1 %: {said}."]
    if study.damping_ratio <= 0.0:
        notes.append(
            "Without damping no transient dies: no time simulation, and resonance peaks are bounded by the twist "
            "alone; give damping_ratio, or d2 and d3."
        )
    elif study.simulated is None:
        notes.append(
            f"Transients take too long for a time simulation (damping ratio {number(study.damping_ratio, '1')}): the "
            "resonance curve is that of the steady motion."
        )
    elif not np.all(study.kept):
        lost = study.asked[~study.kept]
        notes.append(
            f"The slow control of the time simulation lost the speed at {len(lost)} of {len(study.asked)} speeds, "
            f"{speed_text(float(lost.min()), float(lost.max()))}; they are not drawn."
        )
    drifting = "; ".join(speed_text(*ends) for ends in study.drifting_ranges())
    if drifting:
        notes.append(f"Held by a speed control or slip only, not by a motor of constant torque: {drifting}.")
    notes.append(
        "The resonance curve is that of running at each speed for long; a run-up that passes quickly stays below it."
    )
    return notes


def _warnings(study: DrivelineStudy) -> list[str]:
    """In words and numbers, what an engineer should change."""
    line, running = study.config.line, study.config.running
    warnings = []
    at, margin = running.speed, running.margin
    shaken = not math.isclose(float(np.ptp(study.ratio)), 0.0, abs_tol=1e-9)
    if shaken:
        for n, (low, high) in study.crossings().items():
            near = max(low - at, at - high, 0.0) / at
            if n in ORDERS and near < margin:
                warnings.append(
                    f"Running at {speed_text(at)} is {_percent(near)} from where order {n} meets the natural "
                    f"frequency, {speed_text(low, high)}; permitted is {_percent(margin)}: change "
                    f"the speed or the shafts. Amplitude of the order: {_degrees(study.excitation[n])}."
                )
    warnings += _even_running(line, study.ratio)
    found = study.operating
    if not found.found[0]:
        warnings.append(
            f"No steady motion found at {speed_text(at)}: either none repeats itself each half turn, or the search "
            "did not reach it; more damping or less bend helps both."
        )
    else:
        warnings += _at_operation(study)
    for low, high in study.unstable_ranges():
        warnings.append(
            f"Unstable from {speed_text(low, high)} at the damping ratio {number(study.damping_ratio, '1')}: "
            "torsional vibration grows by itself (parametric resonance); more damping or less uneven joints end it."
        )
    for low, high in study.missing_ranges():
        warnings.append(
            f"No steady motion found from {speed_text(low, high)}: either none repeats itself each half turn, or the "
            "search did not reach it."
        )
    return warnings


def _at_operation(study: DrivelineStudy) -> list[str]:
    running, found = study.config.running, study.operating
    at, warnings = running.speed, []
    for shaft, peak, static in (
        (2, float(found.peak2[0]), study.static2),
        (3, float(found.peak3[0]), running.load),
    ):
        if static > 0.0 and peak > running.factor * static:
            warnings.append(
                f"Shaft {shaft} carries {_torque(peak)} at {speed_text(at)}, {number(peak / static, '1')} times what "
                f"the load alone asks; permitted is {running.factor:g}."
            )
    least = float(found.least2[0])
    if running.load > 0.0 and least < 0.0:
        warnings.append(
            f"The torque of shaft 2 falls to {_torque(least)} in each half turn: with play in splines and joints, "
            "which is not modelled, it hammers."
        )
    if found.unstable[0]:
        warnings.append(
            f"Running at {speed_text(at)} is unstable: a torsional vibration grows e-fold in "
            f"{number(1.0 / float(found.growth[0]), 's')}."
        )
    elif found.free_growth[0] > DRIFT:
        warnings.append(
            f"A motor whose torque does not fall with speed would not hold {speed_text(at)}: deviations grow by "
            f"{number(float(found.free_growth[0]), '1/s')}, as above a resonance faster running takes less torque; "
            "its control, or slip, must outweigh that."
        )
    return warnings


def _even_running(line: Cardan, ratio: Any) -> list[str]:
    if float(np.ptp(ratio)) < 1e-6:
        return []
    wrong = []
    if not math.isclose(line.alpha1, line.alpha2, abs_tol=1e-6):
        wrong.append(
            f"make the bends equal (alpha1 = {_degrees(line.alpha1)}, alpha2 = {_degrees(line.alpha2)})"
        )
    off = (line.delta_yokes - line.beta_planes + 0.5 * math.pi) % math.pi - 0.5 * math.pi
    if not math.isclose(off, 0.0, abs_tol=1e-6):
        wrong.append(f"turn the yokes of the middle shaft by {_degrees(-off)} (delta_yokes = beta_planes)")
    return [
        f"Shaft 3 does not run evenly: i23 from {_ratio(np.min(ratio))} to {_ratio(np.max(ratio))}; "
        f"{', and '.join(wrong)}."
    ]


def as_dict(study: DrivelineStudy) -> dict[str, Any]:
    """Ready for JSON, each number with its unit; what was not found is null."""

    def sizes(x: Any, unit: str, kind: str = "") -> dict[str, Any]:
        array = np.asarray(x, dtype=float)
        finite = array.astype(object)
        finite[~np.isfinite(array)] = None
        return {"value": finite.tolist(), "unit": unit} | ({"kind": kind} if kind else {})

    def speed(x: Any) -> dict[str, Any]:
        return sizes(x, "rad/s", "speed")

    def frequency(x: Any) -> dict[str, Any]:
        return sizes(x, "rad/s", "frequency")

    def torque(x: Any) -> dict[str, Any]:
        return sizes(np.where(np.abs(x) < ROUNDOFF_TORQUE, 0.0, x), "N.m")

    def declared(instance: Any) -> dict[str, Any]:
        layout = Layout(type(instance))
        return {
            v.name: sizes(x, v.unit, v.kind)
            for v, x in zip(layout.variables, layout.values(instance), strict=True)
        }

    def motion(found: SteadyMotion) -> dict[str, Any]:
        return {
            "found": found.found.tolist(),
            "peak_torque2": torque(found.peak2),
            "peak_torque3": torque(found.peak3),
            "least_torque2": torque(found.least2),
            "largest_torque2": torque(found.largest2),
            "least_torque3": torque(found.least3),
            "largest_torque3": torque(found.largest3),
            "drive_torque": sizes(found.drive, "N.m"),
            "growth": sizes(found.growth, "1/s"),
            "largest_multiplier": sizes(found.multiplier, "1"),
            "growth_with_constant_torque": sizes(found.free_growth, "1/s"),
            "frequency": frequency(found.frequency),
        }

    config, band, simulated = study.config, study.band, study.simulated
    return {
        "chainunit": __version__,
        "title": config.title,
        "driveline": declared(config.line),
        "running": declared(config.running),
        "damping_ratio": sizes(study.damping_ratio, "1"),
        "natural_frequency": {
            "even": frequency(study.at_even),
            "least": frequency(band.least),
            "largest": frequency(band.largest),
            "at_ratio_zero": frequency(band.at_zero),
            "at_ratio_infinite": frequency(band.at_infinity),
        },
        "sensitivity": {name: sizes(x, "1") for name, x in study.sensitivity.items()},
        "ratio": {"least": sizes(np.min(study.ratio), "1"), "largest": sizes(np.max(study.ratio), "1")},
        "excitation": {f"order {n}": sizes(x, "rad") for n, x in study.excitation.items()},
        "crossings": {f"speed = k/{n}": speed(ends) for n, ends in study.crossings().items()},
        "operating": {"static_torque2": sizes(study.static2, "N.m"), **motion(study.operating)},
        "resonance": {
            "speed": speed(study.speed),
            **motion(study.steady),
            "peaks": {
                "speed": speed([at for at, _ in study.resonances()]),
                "torque2": sizes([peak for _, peak in study.resonances()], "N.m"),
            },
            "rigid_torque2": sizes(study.rigid.peak2, "N.m"),
            "rigid_torque3": sizes(study.rigid.peak3, "N.m"),
            "unstable": speed(study.unstable_ranges()),
            "no_steady_motion": speed(study.missing_ranges()),
        },
        "simulation": None
        if simulated is None
        else {
            "asked_speed": speed(study.asked),
            "speed": speed(simulated.speed),
            "peak_torque2": sizes(simulated.peak2, "N.m"),
            "peak_torque3": sizes(simulated.peak3, "N.m"),
        },
        "stability": {
            "joint": config.joint,
            "speed": speed(study.map.speed),
            "bend": sizes(study.map.bend, "rad"),
            "damping_ratio": sizes(study.map.ratio, "1"),
            "growth": sizes(study.map.growth, "1/s"),
        },
        "warnings": list(study.warnings),
        "notes": list(study.notes),
    }
