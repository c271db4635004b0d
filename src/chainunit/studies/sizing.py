"""Sizing of the drive: which motor of the catalogue, behind which gear, with which flywheel.

First the cycle by inverse dynamics, then every candidate is co-simulated by its FMU: a start under load, steady
running, and steady running with all feed on one side. Each check is a utilisation: what is used of what is
permitted. Hand formulas (RMS torque, flywheel, relay) stand here and in `protection`; the rest is read from the runs.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..config import Config
from ..drives.catalogue import CatalogueMotor, catalogue
from ..drives.gearing import motor_side
from ..drives.induction_motor import InductionMotor, volts_per_hertz
from ..drives.motor import T_RATED
from ..engines import MATH, numpy_
from ..errors import InputError, InterruptedRunError, RunError
from ..fmu.backends import Backend
from ..machines.chain_unit import SIDES, SideName
from ..quantities import Layout, Value, declaration, quantity
from ..system.instance import Fmu
from ..text import entry, number
from .chain import HIGH, duty
from .cycle import Cycle, all_on_one, cycle
from .drive import Drive
from .measures import BURNT
from .rig import Rig


def rms(*parts: tuple[float, Any]) -> float:
    """RMS over parts of the time: pairs of (share of the time, values evenly spaced in that part)."""
    whole = sum(share for share, _ in parts)
    return math.sqrt(sum(share * float(np.mean(np.square(x))) for share, x in parts) / whole)


def flywheel(torque: Any, speed: float, fluctuation: float) -> float:
    """Inertia [kg m2] on the shaft that keeps (largest - least)/mean of its speed at `fluctuation`.

    `torque` [N m] is what the shaft needs over a turn at constant `speed` [rad/s], evenly spaced in angle, shape
    (n,), against a drive that gives its mean: J = (E_max - E_min)/(fluctuation w^2), with E the energy that runs
    ahead of the mean (Wittenbauer's method with the torque at constant speed).
    """
    torque = np.asarray(torque, dtype=float)
    excess = np.cumsum(torque - np.mean(torque)) * (2.0 * math.pi / len(torque))
    return float(np.ptp(excess)) / (fluctuation * speed * speed)


def start_time(time: Any, speed: Any, share: float = 0.95) -> float | None:
    """Time at which the speed first reaches `share` of its mean over the last fifth of the run; None where the shaft
    does not turn by then."""
    speed = np.asarray(speed)
    final = float(np.mean(speed[-max(1, len(speed) // 5) :]))
    if not final > 0.0:
        return None
    return float(time[int(np.argmax(speed >= share * final))])


_SPEED_DEVIATION = 0.03  # of the crank speed that is asked for


@declaration
class CycleNumbers:
    """What the machine asks over a turn at constant crank speed; at the crank."""

    power_mean: Value = quantity("W", "mean power")
    torque_mean: Value = quantity("N.m", "mean torque, both sides loaded")
    torque_peak: Value = quantity("N.m", "peak torque, both sides loaded")
    torque_peak_one_sided: Value = quantity("N.m", "peak torque, all feed on one side, the larger of both")
    torque_rms: Value = quantity("N.m", "RMS torque of the duty, both cases in their shares of time")
    inertia_least: Value = quantity("kg.m2", "reflected inertia, least")
    inertia_mean: Value = quantity("kg.m2", "reflected inertia, mean")
    inertia_largest: Value = quantity("kg.m2", "reflected inertia, largest")
    inertia_wanted: Value = quantity(
        "kg.m2",
        "inertia at the crank that the wanted fluctuation takes by the hand formula: rotor, gear and flywheel",
    )


@declaration
class Flywheel:
    """The flywheel of the chosen motor."""

    J: Value = quantity("kg.m2", "flywheel on the motor shaft")
    fluctuation: Value = quantity("1", "fluctuation of the crank speed in the run", kind="percent")


@dataclass(frozen=True)
class Check:
    """What is used of what is permitted, in one unit."""

    title: str
    value: float | None
    limit: float
    unit: str
    kind: str = ""

    @property
    def utilisation(self) -> float | None:
        """value/limit; None where there is no value: the candidate does not get that far."""
        return None if self.value is None else self.value / self.limit

    @property
    def passed(self) -> str:
        """A limit that is passed, in words."""
        value, limit = (number(x, self.unit, self.kind, full=False) for x in (self.value, self.limit))
        used = number(self.utilisation, "1", "used")
        return f"{self.title} {value}, {used}{' of' if used.endswith('%') else ''} the permitted {limit}"

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON."""
        return {
            "title": self.title,
            "utilisation": entry(self.utilisation, "1", "used"),
            "value": entry(self.value, self.unit, self.kind),
            "limit": entry(self.limit, self.unit, self.kind),
        }


class Verdict(StrEnum):
    """How a candidate came off."""

    CHOSEN = "chosen"
    FITS = "fits"
    INSUFFICIENT = "insufficient"
    """the nearest of those that do not fit, where none does: the study goes on with it"""
    REJECTED = "rejected"


_WORSE_WITH_INERTIA = ("start", "starts", "inertia")
"""Checks that no flywheel heals."""


@dataclass
class Candidate:
    """A motor behind a gear, with what its runs gave."""

    motor: CatalogueMotor
    drive: Drive
    flywheel: float
    """[kg m2], on the motor shaft"""
    checks: dict[str, Check]
    peak_torque: float = math.nan
    """of the crank, over start and steady running with either load [N m]"""
    breakdown_torque: float = math.nan
    """of the motor [N m]"""
    duty_torque: float = math.nan
    """peak at the crank in steady running, and while all feed moves to either side and runs there [N m]"""
    fluctuation: float = math.nan
    verdict: Verdict | None = None
    """None until it is judged or ranked"""
    reason: str = ""

    @property
    def sizes(self) -> dict[str, float]:
        """Utilisation by check; infinite where the candidate does not get that far."""
        return {n: math.inf if c.utilisation is None else c.utilisation for n, c in self.checks.items()}

    @property
    def violation(self) -> float:
        """Utilisation of the check that is used most; infinite where its run failed."""
        return max(self.sizes.values(), default=math.inf)

    @property
    def fits(self) -> bool:
        """Whether every check is within its limit."""
        return self.violation <= 1.0


@dataclass
class SizingResult:
    """Cycle, candidates in the order of their rank, and which of them is chosen."""

    config: Config
    duty: Duty
    candidates: list[Candidate]
    notes: list[str]
    motors: int
    """motors of the catalogue with a permitted number of poles; `candidates` are those of them that were tried"""
    weak: int = 0
    """those that were left out, since their nameplate has not 0.7 times the power that the cycle needs"""

    @property
    def chosen(self) -> Candidate | None:
        """The candidate that was chosen, if one fits."""
        return self.candidates[0] if self.candidates[0].verdict is Verdict.CHOSEN else None

    @property
    def best(self) -> Candidate:
        """The candidate that the study goes on with: the chosen one, or the nearest where none fits."""
        return self.candidates[0]

    @property
    def answer(self) -> str:
        """What sizing found, in a sentence; with the words of `rank`."""
        tried = f"{len(self.candidates)} of {self.motors} were tried"
        if self.weak:
            tried += f", {self.weak} {'is' if self.weak == 1 else 'are'} too weak by the nameplate"
        if self.chosen:
            return f"{self.best.motor.designation} is {self.best.reason} ({tried})"
        return (
            f"no motor of the catalogue fits ({tried}); {self.best.motor.designation} is {self.best.reason}"
        )

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON, each number with its unit."""
        best = self.best
        assert self.config.sizing is not None
        return {
            "asked": _entries(self.config.sizing),
            **self.duty.as_dict(),
            "flywheel": _entries(Flywheel(J=best.flywheel, fluctuation=best.fluctuation)),
            "tried": {"value": len(self.candidates), "unit": "1"},
            "motors": {"value": self.motors, "unit": "1"},
            "weak": {"value": self.weak, "unit": "1"},
            "candidates": [
                {
                    "motor": c.motor.designation,
                    "ratio": {"value": c.drive.ratio, "unit": "1"},
                    "verdict": c.verdict,
                    "reason": c.reason,
                    "checks": {name: check.as_dict() for name, check in c.checks.items()},
                }
                for c in self.candidates
            ],
            "chosen": self.candidates.index(self.chosen) if self.chosen else None,
            "nearest": None if self.chosen else self.candidates.index(best),
            "notes": self.notes,
        }


def _entries(declared: Any) -> dict[str, Any]:
    layout = Layout(type(declared))
    return {
        v.name: entry(value, v.unit, v.kind) | {"title": v.description}
        for v, value in zip(layout.variables, layout.values(declared), strict=True)
    }


@dataclass(frozen=True)
class Duty:
    """What the machine asks of any drive, at constant speed of the crank: the turn with both sides loaded, those with
    all feed on one side, and which of these asks the larger RMS torque with two bars, as the rocker swings farther to
    one side than to the other; with chains of many turns."""

    both: Cycle
    one_sided: Mapping[SideName, Cycle]
    heavier: SideName
    numbers: CycleNumbers

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON."""
        peaks = {side: _peak(turn) for side, turn in self.one_sided.items()}
        return {
            "cycle": _entries(self.numbers),
            "one_sided": {
                "larger_rms": self.heavier,
                "larger_peak": max(SIDES, key=lambda side: peaks[side]),
            },
        }


def duty_of(config: Config, folder: Path, backend: Backend | None) -> Duty:
    """The duty of a study with `sizing`; chains are run by their FMU, which is written to `folder`."""
    feed, w = config.feed, config.run.crank_speed
    loads = {side: all_on_one(side, feed.left, feed.right) for side in SIDES}
    both = cycle(config.machine, w, feed.left, feed.right)
    one_sided = {side: cycle(config.machine, w, *case) for side, case in loads.items()}
    size = {side: rms((1.0, turn.crank_torque)) for side, turn in one_sided.items()}
    heavier: SideName = "left" if size["left"] >= size["right"] else "right"
    if config.chain is not None:
        drive = Drive(InductionMotor, None, config.machine, chain=config.chain)
        fmu = Fmu(drive.export_machine(folder, backend)[0])
        try:
            both = duty(fmu, drive, w, feed.left, feed.right)
            one_sided = {side: duty(fmu, drive, w, *case) for side, case in loads.items()}
        finally:
            fmu.close()
    return Duty(both, one_sided, heavier, cycle_numbers(config, both, one_sided, heavier))


def _peak(cycle: Cycle) -> float:
    """Largest crank torque of a cycle; of many turns of chains the quantile of their peaks, as no single one is a
    prediction."""
    peaks = np.max(np.abs(np.atleast_2d(cycle.crank_torque)), axis=1)
    return float(np.quantile(peaks, HIGH))


def cycle_numbers(
    config: Config, both: Cycle, one_sided: Mapping[SideName, Cycle], heavier: SideName
) -> CycleNumbers:
    """Of a duty: with all feed on one side the RMS torque of the heavier, and the larger of both peaks, which may be
    that of the other side."""
    assert config.sizing is not None
    w, share = config.run.crank_speed, config.sizing.one_sided_share
    inertia = both.outputs.J * config.machine.p.ratio**2
    mean = float(np.mean(both.crank_torque))
    return CycleNumbers(
        power_mean=mean * w,
        torque_mean=mean,
        torque_peak=_peak(both),
        torque_peak_one_sided=max(_peak(turn) for turn in one_sided.values()),
        torque_rms=rms((1.0 - share, both.crank_torque), (share, one_sided[heavier].crank_torque)),
        inertia_least=float(np.min(inertia)),
        inertia_mean=float(np.mean(inertia)),
        inertia_largest=float(np.max(inertia)),
        inertia_wanted=float(
            np.quantile(
                [flywheel(turn, w, config.sizing.fluctuation) for turn in np.atleast_2d(both.crank_torque)],
                HIGH,
            )
        ),
    )


def size(
    config: Config,
    folder: Path,
    report: Callable[[str, float, float], None],
    backend: Backend | None = None,
) -> SizingResult:
    """Choose a motor of the catalogue for the study: at least `sizing.candidates` are tried, from small to large, and
    then more until one fits or the catalogue ends.

    Parameters
    ----------
    config : a study with `sizing`
    folder : where the FMUs are written
    report, backend : see `chainunit.studies.run.run_study`

    Raises
    ------
    InputError
        for a catalogue that cannot be read, or that has no motor with the poles that are asked.
    """
    asked = config.sizing
    assert asked is not None
    report("the machine at constant speed", 0.0, 1.0)
    duty = duty_of(config, folder, backend)
    numbers = duty.numbers
    notes = [
        "Catalogue data are typical; iron losses are not in the motor model.",
        "The gear's losses act as viscous drag on the motor shaft, of the mean power that its efficiency takes.",
    ]
    if config.chain is not None:
        notes.append(
            f"Peaks of the cycle and the flywheel are those of single turns, {100 * HIGH:g} % quantile over all "
            "turns of all starts of the chains."
        )
    motors = [
        m for m in catalogue(config.catalogue) if asked.poles_least <= m.nameplate.poles <= asked.poles_most
    ]
    # from below what the mean power and RMS torque need, so that the first that fits is the smallest
    needed = max(numbers.power_mean, numbers.torque_rms * config.run.crank_speed)
    motors.sort(key=lambda m: (m.nameplate.power, abs(m.nameplate.poles - 4.0)))
    if not motors:
        raise InputError(
            f"sizing.poles_least = {asked.poles_least:g}, sizing.poles_most = {asked.poles_most:g}: the catalogue "
            "has no motor with so many poles"
        )
    strong = [m for m in motors if m.nameplate.power >= 0.7 * needed]
    if not strong:
        notes.append(
            f"No motor of the catalogue has 0.7 times the power of the cycle, {0.7 * needed:.3g} W: the largest were "
            "tried."
        )
        strong = [m for m in motors if m.nameplate.power == motors[-1].nameplate.power]
    found: list[Candidate] = []
    files: Mapping[str, Path] = {}
    for k, motor in enumerate(strong):
        if len(found) >= asked.candidates and any(c.fits for c in found):
            break
        report(f"co-simulating {motor.designation}", float(k), float(len(strong)))
        candidate = proposed(config, motor, duty)
        if not files:
            files, _ = candidate.drive.export(folder, backend)
        found.append(with_flywheel(config, candidate, duty, files))
    rank(found)
    return SizingResult(config, duty, found, notes, len(motors), len(motors) - len(strong))


def with_flywheel(config: Config, bare: Candidate, duty: Duty, files: Mapping[str, Path]) -> Candidate:
    """The candidate as it is, or with the least flywheel, to about a tenth, that keeps the speed as asked; as it is,
    too, where it misses a limit that no flywheel heals.

    The largest tried is that of the hand formula, which leaves out that a motor's torque falls with speed and evens
    it, too."""
    whole = max(0.0, duty.numbers.inertia_wanted / bare.drive.ratio**2 - bare.drive.parameters.rotor.J)

    def tried(share: float) -> Candidate:
        p = bare.drive.parameters
        p = dataclasses.replace(p, rotor=dataclasses.replace(p.rotor, J=p.rotor.J + share * whole))
        drive = dataclasses.replace(bare.drive, parameters=p)
        candidate = dataclasses.replace(bare, drive=drive, flywheel=share * whole)
        judge(config, candidate, duty, files)
        return candidate

    def even(candidate: Candidate) -> bool:
        sizes = candidate.sizes
        hopeless = any(sizes.get(name, 0.0) > 1.0 for name in _WORSE_WITH_INERTIA)
        return hopeless or not 1.0 < sizes.get("speed", 0.0) < math.inf

    best, below = tried(0.0), 0.0
    if even(best):
        return best
    for share in (0.03, 0.1, 0.3, 1.0):
        best = tried(share)
        if even(best):
            break
        below = share
    else:
        return best
    for _ in range(3):
        middle = 0.5 * (below + share)
        candidate = tried(middle)
        if even(candidate):
            best, share = candidate, middle
        else:
            below = middle
    return best


def proposed(config: Config, motor: CatalogueMotor, duty: Duty) -> Candidate:
    """A motor with the gear ratio at which the crank has its speed, without a flywheel."""
    asked, gear = config.sizing, config.gear
    assert asked is not None
    plate = motor.nameplate
    p = motor.identify().parameters
    synchronous, rated_speed, rated_torque = plate.synchronous, plate.speed, plate.torque
    w = config.run.crank_speed
    follows = config.start == "inverter"
    ratio = gear.ratio if "gear.ratio" in config.given else rated_speed / w
    speed, drag = rated_speed, gear.d
    for _ in range(3):
        shaft = motor_side(numpy_(), dataclasses.replace(gear, ratio=ratio), duty.both.crank_torque, speed)
        mean = float(np.mean(shaft))
        # the slip goes with the torque; an inverter makes up for it
        speed = rated_speed if follows else synchronous - (synchronous - rated_speed) * mean / rated_torque
        if "gear.ratio" not in config.given:
            ratio = speed / w
        drag = (mean - duty.numbers.torque_mean / ratio) / speed
    soft = config.starter.soft_start if config.start == "soft" else p.soft_start
    slip_hz = (synchronous - rated_speed) * plate.poles / (4.0 * math.pi)
    inverter = config.starter.inverter
    if follows:
        given = inverter.slip or slip_hz / rated_torque
        inverter = dataclasses.replace(inverter, on=1.0, slip=given)
    p = dataclasses.replace(
        p,
        rotor=dataclasses.replace(p.rotor, J=p.rotor.J + gear.J, d=p.rotor.d + drag),
        soft_start=soft,
        inverter=inverter,
        ambient=dataclasses.replace(p.ambient, T=asked.ambient),
    )
    machine = config.machine.replace({"ratio": ratio})
    drive = Drive(InductionMotor, p, machine, follows, rated_current=plate.rated_current, chain=config.chain)
    return Candidate(motor, drive, 0.0, {})


def judge(config: Config, c: Candidate, duty: Duty, files: Mapping[str, Path]) -> None:
    """Co-simulate a candidate and fill in its checks."""
    plate, drive = c.motor.nameplate, c.drive
    w, turn = config.run.crank_speed, 2.0 * math.pi / config.run.crank_speed
    ramp = config.run.ramp if drive.follows else None
    # three times what the rated torque needs to bring everything up to speed, and at least the ramp of the start
    inertia = drive.parameters.rotor.J + duty.numbers.inertia_mean / drive.ratio**2
    rise = config.starter.soft_start.time if config.start == "soft" else ramp or 0.0
    window = max(1.0, 3.0 * inertia * plate.speed / plate.torque, 1.5 * rise)
    try:
        rig = Rig(config, drive, files)
        with rig.from_rest() as simulation:
            start = simulation.run(window, config.run.step)
            steady = simulation.run(window + 2.0 * turn, config.run.step)
            event, shifts, one_sided = simulation.save(), [], {}
            for side in SIDES:
                feed = config.one_sided(side)
                shifts.append(rig.follow(simulation, feed, event, event + feed.p.shift + turn).run)
                one_sided[side] = simulation.run(simulation.time + turn, config.run.step)
    except InterruptedRunError:
        raise
    except RunError as error:
        c.reason = f"its run failed: {error}"
        return
    speed = np.concatenate([start["motor.w"].values, steady["motor.w"].values])
    times = np.concatenate([start["time"].values, steady["time"].values])
    expected = w * drive.ratio
    started = start_time(times, speed) if float(np.mean(steady["motor.w"])) > 0.5 * expected else None
    loaded = (steady, *shifts, *one_sided.values())
    c.duty_torque = max(float(np.max(np.abs(r["machine.tau"]))) for r in loaded) * drive.ratio
    c.peak_torque = max(c.duty_torque, float(np.max(np.abs(start["machine.tau"]))) * drive.ratio)
    c.checks = _checks(config, c, start, steady, one_sided, duty.heavier, started)


def _checks(
    config: Config,
    c: Candidate,
    start: xr.Dataset,
    steady: xr.Dataset,
    one_sided: Mapping[SideName, xr.Dataset],
    heavier_side: SideName,
    started: float | None,
) -> dict[str, Check]:
    asked, gear, plate, p = config.sizing, config.gear, c.motor.nameplate, c.drive.parameters
    assert asked is not None
    share, heavier = asked.one_sided_share, one_sided[heavier_side]
    gap = "motor.air_gap_tau"
    running = steady["motor.w"].values
    mean_speed = float(np.mean(running))
    c.fluctuation = float(np.ptp(running[len(running) // 2 :])) / mean_speed if mean_speed > 0.0 else math.inf
    motor = c.drive.motor
    cooling = motor.cooling(MATH, p, mean_speed)

    def checked(value: float | None) -> float | None:
        return value if started is not None else None

    # heat of a start beyond that of running, as if spread over the hour
    time, heat = start["time"].values, start["motor.heat"].values
    steady_heat = (1.0 - share) * float(np.mean(steady["motor.heat"])) + share * float(
        np.mean(heavier["motor.heat"])
    )
    extra = max(0.0, float(np.trapezoid(heat - steady_heat, time)))
    mean_heat = steady_heat + asked.starts_per_hour * extra / 3600.0
    # the runs are short and the winding in them as cold as the surroundings: as warm as it becomes, it heats more
    ran_at = float(np.mean(steady[f"motor.{motor.temperature}"]))
    temperature = min(BURNT, motor.settled_temperature(p, mean_heat, ran_at, mean_speed))
    peak = max(float(np.max(np.abs(r[gap]))) for r in (steady, *one_sided.values()))
    reflected = float(np.max(steady["machine.J"]))
    torque = rms((1.0 - share, steady[gap].values), (share, heavier[gap].values))
    hot = (1.0 + p.stator.alpha * (asked.temperature - T_RATED)) / (1.0 + p.stator.alpha * (ran_at - T_RATED))
    permitted = permitted_starts(p, hot * steady_heat, hot * extra, cooling, asked.temperature)
    if plate.starts and config.start == "direct":
        # the catalogue's number is that of the bare rotor
        total = p.rotor.J + float(np.mean(steady["machine.J"]))
        permitted = min(permitted, plate.starts * plate.J / total)
    frequency, voltage = plate.frequency, 1.0
    longest = plate.locked_time
    if c.drive.follows:
        frequency = max(mean_speed * plate.poles / (4.0 * math.pi), 1.0)
        voltage = float(volts_per_hertz(MATH, p, frequency))
        longest = 1.0 + 1.2 * config.run.ramp
    # as warm as it may become, at the frequency at which it runs: above the corner an inverter has no more voltage
    c.breakdown_torque = motor.largest_torque(p, asked.temperature, voltage * p.supply.V, frequency)
    weaker = min(1.0, plate.frequency / frequency)
    cooled = min(1.0, cooling / motor.cooling(MATH, p, plate.speed))
    checks = {
        "start": Check("time to start", started, longest, "s"),
        "rms_torque": Check("RMS torque", checked(torque), plate.torque * weaker * math.sqrt(cooled), "N.m"),
        "peak_torque": Check(
            "peak torque", checked(peak), c.breakdown_torque / asked.breakdown_margin, "N.m"
        ),
        "temperature": Check(
            "rise of temperature",
            checked(temperature - p.ambient.T),
            asked.temperature - p.ambient.T,
            "K",
            "difference",
        ),
        "starts": Check("starts per hour", asked.starts_per_hour, permitted, "1"),
        "crank_speed": Check(
            "deviation of the crank speed",
            checked(abs(mean_speed / (c.drive.ratio * config.run.crank_speed) - 1.0)),
            _SPEED_DEVIATION,
            "1",
            "percent",
        ),
        "speed": Check("speed fluctuation", checked(c.fluctuation), asked.fluctuation, "1", "percent"),
    }
    if math.isfinite(asked.inertia_ratio):
        ratio = (reflected + p.rotor.J - plate.J) / plate.J
        checks["inertia"] = Check("inertia ratio", ratio, asked.inertia_ratio, "1")
    if "gear.torque_limit" in config.given:
        checks["gear"] = Check("torque of the gear", c.peak_torque, gear.torque_limit, "N.m")
    return checks


def permitted_starts(
    p: Any, running_heat: float, start_heat: float, cooling: float, temperature: float
) -> float:
    """Starts per hour that bring the winding to its permitted `temperature` [K], beside `running_heat` [W], with
    `start_heat` [J] each; a ten-thousandth where running alone is too hot."""
    spare = (temperature - p.ambient.T) * cooling / p.stator.R_th - running_heat
    return max(1e-4, 3600.0 * spare / start_heat) if start_heat > 0.0 else 1e6


def rank(candidates: list[Candidate]) -> None:
    """Order by rank and say why: what fits by size, then what does not by how far it is off, which is the utilisation
    of its most used check; of those that do not start at all the larger is nearer."""
    for c in candidates:
        over = [check for name, check in c.checks.items() if c.sizes[name] > 1.0]
        if c.fits:
            most = max(c.checks.values(), key=lambda check: check.utilisation or 0.0)
            c.verdict, c.reason = Verdict.FITS, f"most used: {most.title}, {number(c.violation, '1', 'used')}"
        elif not c.checks:
            # its run failed, and the reason is there
            c.verdict = Verdict.REJECTED
        elif math.isinf(c.violation):
            c.verdict, c.reason = Verdict.REJECTED, "it does not bring the machine up to speed"
        else:
            c.verdict, c.reason = Verdict.REJECTED, "; ".join(check.passed for check in over)
        if c.flywheel:
            c.reason += f", with a flywheel of {c.flywheel:.3g} kg m2"
    candidates.sort(
        key=lambda c: (
            not c.fits,
            c.motor.nameplate.power if c.fits else c.violation,
            c.violation if c.fits else -c.motor.nameplate.power,
        )
    )
    best = candidates[0]
    if not best.fits:
        best.verdict = Verdict.INSUFFICIENT
        best.reason = f"the nearest of those that do not fit; {best.reason}"
        return
    best.verdict, best.reason = Verdict.CHOSEN, f"the smallest that fits; {best.reason}"
    for c in candidates[1:]:
        if c.fits:
            larger = c.motor.nameplate.power > best.motor.nameplate.power
            c.reason = f"{'larger than needed' if larger else 'more used than the chosen one'}; {c.reason}"
