"""A candidate of sizing: a motor behind a gear, with or without a flywheel, and the results of its runs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from ...core.quantities import Value, declaration, percentage, quantity
from ...drives.catalogue import CatalogueMotor
from ...drives.catalogue_gears import CatalogueGear
from ...drives.disc import Disc, steel_disc
from ...drives.gear_ratios import GearUnit
from ...reading.results import derived, part, result
from ...reading.text import number
from ...study.drive import Drive
from ...study.limits import Check
from ...study.proposal import DutyPeak
from ...study.relay import class_holding, tolerant_class
from .parts import OrderedPart, total_price

TOLERANCES = ("crank_speed", "gear_speed")
"""Checks of a speed, which a drive may use wholly: the gear's ratio takes it, and no load does."""
_HARD = ("gear_start",)
"""Checks of a limit that leaves room by itself, which a drive may use wholly, too: a gear permits a multiple of its
rated torque in a start. A margin on top would prefer two gear units, or a flywheel, to a shock of 91 % of it. The
service factor of a gear is a margin, too."""
_WHOLLY = (*TOLERANCES, *_HARD, "gear_service")


FIELD_WEAKENING = 1.1
"""Frequency of running, in parts of the rated one, above which a motor counts as one in field weakening."""


@declaration
class Flywheel:
    """The flywheel of a drive, and the disc of steel that has its inertia; None without a flywheel."""

    J: Value = quantity("kg.m2", "flywheel, at its own shaft")
    mass: Value = quantity("kg", "steel disc, mass")
    diameter: Value = quantity("m", "steel disc, diameter")
    width: Value = quantity("m", "steel disc, width")
    rim_speed: Value = quantity("m/s", "steel disc, speed of the rim")
    fluctuation: Value = percentage("fluctuation of the {driver} speed in the run")


@declaration
class DriveNumbers:
    """The numbers by which the order of preference compares drives."""

    start_class: Value = quantity(
        "1",
        "trip class of the overload relay that holds in the start, at 20 % more current, too; 40: none up to 30",
    )
    inverter_current: Value = quantity(
        "A", "least rated current of the inverter by the runs of sizing, without the events of the study"
    )
    frequency: Value = quantity("Hz", "frequency of the supply in steady running")
    speed: Value = quantity("rad/s", "speed of the motor in steady running", kind="speed")
    mass: Value = quantity("kg", "mass of motor and flywheel, the relative cost")
    price: Value = quantity("1", "price of the motor, as the catalogue has it")


class Standing(StrEnum):
    """The result of a candidate."""

    CHOSEN = "chosen"
    FITS = "fits"
    BARELY = "fits without margin"
    INSUFFICIENT = "insufficient"
    """the nearest candidate, where none fits; the study goes on with it"""
    REJECTED = "rejected"


class Criterion(StrEnum):
    """The order of preference among candidates that fit: each criterion decides where those before it leave a
    choice."""

    MARGIN = "margin"
    PRICE = "price"
    LARGER = "larger"
    FIELD = "field"
    GEAR = "gear"
    START = "start"
    FLYWHEEL = "flywheel"
    POLES = "poles"
    POWER = "power"
    COST = "cost"
    USE = "use"


@dataclass(frozen=True)
class TrialResult:
    """The results of a candidate's runs; nothing is known before them, and where one fails."""

    checks: Mapping[str, Check] = field(default_factory=dict)
    relay_seconds: float | None = None
    """the hardest start as time at 7.2 times the rated current [s]; None for an inverter, or without a start"""
    start_current: float | None = None
    """largest current of the motor in a start [A]; None without a start"""
    inverter_current: float | None = None
    """least rated current of an inverter [A] that carries running and starts, see `Trial.inverter_current`; None on
    the line, or without a start"""
    speed: float | None = None
    frequency: float | None = None
    """mean speed of the motor in steady running [rad/s], and frequency of its supply [Hz]; None without a start"""
    duty: DutyPeak | None = None
    """the largest torque at the crank in steady running, and while all feed moves to either side and stays there;
    None where the run failed"""
    torque_mean: float = math.nan
    """mean air-gap torque of the duty [N m]"""
    fluctuation: float = math.nan
    inertia_factor: float = math.nan
    """inertia of the machine over that of the motor with its flywheel, both at the motor's shaft"""
    stall_angle: float | None = None
    """crank angle at which the load stalls the motor [rad]; None for a motor that starts"""
    failed_angle: float | None = None
    """crank angle from which it does not start [rad], though it does from the angle 0; else None"""

    @property
    def start_class(self) -> int | None:
        """Trip class of the relay that holds in each start; None for an inverter, or without a start."""
        return None if self.relay_seconds is None else class_holding(self.relay_seconds)

    @property
    def tolerant_class(self) -> int | None:
        """The same with the tolerance of the motor's current."""
        return None if self.relay_seconds is None else tolerant_class(self.relay_seconds)


@result(frozen=False)
class Candidate:
    """A motor behind a gear, with the results of its runs."""

    motor: CatalogueMotor
    drive: Drive
    trial: TrialResult = TrialResult()
    margin: float = 0.0
    """share of each limit that should remain free"""
    unit: GearUnit | None = None
    """the gear unit of the ratio; None where one unit does not suffice"""
    series: str = part(
        "source of the ratio, such as a series of preferred numbers; empty for an exact or a given one",
        default="",
    )
    heaviest: float = 0.0
    """the heaviest flywheel that was tried with the motor [kg m2]"""
    stop: str = ""
    """what ended the trials of flywheels: a check, or a key of `chainunit.capabilities.sizing.preference.STOPS`"""
    worst_start: bool = False
    """whether time, class and heat of its start belong to the worst crank angle, not to the angle 0 alone"""
    verdict: Standing | None = part("its standing; None until it is judged or ranked", default=None)
    criterion: Criterion | None = part(
        "the criterion by which a candidate that fits stands behind the chosen one", default=None
    )
    reason: str = part("the reason of its standing", default="")
    sold: CatalogueGear | None = None
    """the gear, if it is one of a catalogue"""
    runs_with: str | None = part(
        "the gear whose runs rule out this one, which was not tried itself", default=None, optional=True
    )
    remedy: str = ""
    """what makes a candidate fit that only fails in the torque of the gear in its start, in words"""

    @derived()
    def checks(self) -> Mapping[str, Check]:
        """The values of its runs beside their limits, by name; empty where a run failed."""
        return self.trial.checks

    @property
    def sizes(self) -> dict[str, float]:
        """Utilisation by check; infinite where the candidate does not get so far."""
        return {n: math.inf if c.utilisation is None else c.utilisation for n, c in self.checks.items()}

    @property
    def starts(self) -> bool:
        """Whether its motor brings the machine up to speed."""
        return bool(self.checks) and all(check.value is not None for check in self.checks.values())

    @property
    def violation(self) -> float:
        """Largest utilisation of all checks; infinite where the run of the candidate failed."""
        return max(self.sizes.values(), default=math.inf)

    @property
    def use(self) -> float:
        """Largest utilisation of the checks that have to leave the margin free."""
        return max((x for name, x in self.sizes.items() if name not in _WHOLLY), default=math.inf)

    @property
    def fits(self) -> bool:
        """Whether every check is within its limit."""
        return self.violation <= 1.0

    @property
    def breaks_gear(self) -> bool:
        """Whether its start puts too much on the gear, and nothing else exceeds a limit."""
        over = {name for name, size in self.sizes.items() if size > 1.0}
        return bool(over) and over <= set(_HARD)

    def exceeds(self, name: str) -> bool:
        """Whether a check takes more of its limit than the margin leaves; False for a check that there is not."""
        permitted = 1.0 if name in _WHOLLY else 1.0 - self.margin
        return self.sizes.get(name, 0.0) > permitted

    @property
    def keeps_margin(self) -> bool:
        """Whether the candidate fits with the margin."""
        return self.fits and self.leaves_margin

    @property
    def leaves_margin(self) -> bool:
        """Whether the candidate leaves the margin free of each limit that has one, whatever its start puts on the
        gear."""
        return not any(self.exceeds(name) for name in self.checks if name not in _HARD)

    @property
    def power(self) -> float:
        """Rated power [W]."""
        return float(self.motor.nameplate.power)

    @property
    def weakened(self) -> bool:
        """Whether an inverter runs the motor well above its rated frequency, where it has less torque."""
        rated = float(self.motor.nameplate.frequency)
        frequency = self.trial.frequency
        return frequency is not None and frequency > FIELD_WEAKENING * rated

    @property
    def disc(self) -> Disc | None:
        """The flywheel as a disc of steel; None without one."""
        return steel_disc(self.drive.added_inertia) if self.drive.added_inertia else None

    @property
    def mass(self) -> float | None:
        """Mass of motor and flywheel [kg]; None where that of the motor is unknown."""
        if not self.motor.nameplate.mass:
            return None
        return float(self.motor.nameplate.mass + (self.disc.mass if self.disc else 0.0))

    @derived()
    def parts(self) -> list[OrderedPart]:
        """The parts that are ordered from catalogues."""
        of_gear = [] if self.sold is None else [OrderedPart.of("gear", self.sold)]
        return [OrderedPart.of("motor", self.motor), *of_gear]

    @derived("1", name="total_price")
    def price(self) -> float | None:
        """The sum of the prices of its parts; none where one is unknown, as that of any flywheel is."""
        return None if self.drive.added_inertia else total_price(self.parts)

    @property
    def flywheel_words(self) -> str:
        """The flywheel, and its disc, in words."""
        assert self.disc is not None
        mass, diameter = number(self.disc.mass, "kg"), number(self.disc.diameter, "m")
        return f"{number(self.drive.added_inertia, 'kg.m2')} (steel disc of {mass}, {diameter} in diameter)"

    @derived(name="flywheel", titled=True)
    def flywheel_numbers(self) -> Flywheel:
        """The flywheel of the candidate."""
        disc = self.disc
        return Flywheel(
            J=self.drive.added_inertia,
            mass=disc and disc.mass,
            diameter=disc and disc.diameter,
            width=disc and disc.width,
            rim_speed=disc and disc.rim_speed(self.motor.nameplate.speed / self.drive.flywheel_ratio),
            fluctuation=self.trial.fluctuation,
        )

    @derived(titled=True)
    def numbers(self) -> DriveNumbers:
        """Numbers of the drive."""
        return DriveNumbers(
            start_class=self.trial.tolerant_class,
            inverter_current=self.trial.inverter_current,
            frequency=self.trial.frequency,
            speed=self.trial.speed,
            mass=self.mass,
            price=self.motor.nameplate.price or None,
        )

    @derived(name="motor")
    def designation(self) -> str:
        """Designation of the motor."""
        return self.motor.designation

    @derived("1")
    def ratio(self) -> float:
        """Ratio of the gear."""
        return self.drive.ratio

    @property
    def gear_words(self) -> str:
        """The gear, and the series of its ratio."""
        return f"{self.gear}, {self.series}" if self.series else self.gear

    @derived()
    def gear(self) -> str:
        """The gear."""
        return self.unit.title if self.unit else "two gear units"
