"""The table [sizing] of a study file, and the plan that it states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from pydantic import StrictBool

from ...core.quantities import Value, declaration, percentage, quantity, whole_number
from ...drives.gear_ratios import UNITS
from ...drives.gearing import Transmission
from ...drives.service_factor import LOAD_CLASSES, LOAD_WORDS, belt_factor, gear_factor, load_class
from ...reading.tables import file_key
from ...study.catalogue_drive import GearOffer
from ...study.file_section import numbers
from ...study.operation import DriveTables


@declaration
class Sizing:
    """The demands on a motor from the catalogue."""

    one_sided_share: Value = percentage(
        "share of the running time with all feed on one side", default=0.1, min=0.0, max=1.0
    )
    starts_per_hour: Value = quantity("1", "starts per hour", default=2.0, min=0.0, max=1000.0)
    fluctuation: Value = percentage(
        "permitted fluctuation of the {driver} speed, (largest - least)/mean; checked only where it is given",
        default=0.05,
        above=0.0,
        max=1.0,
    )
    margin: Value = percentage(
        "share of each limit that the chosen drive leaves free; not of the tolerance of the {driver} speed",
        default=0.1,
        min=0.0,
        max=0.9,
    )
    breakdown_margin: Value = quantity(
        "1", "factor between the peak torque and the pull-out torque", default=1.25, min=1.0, max=10.0
    )
    inertia_ratio: Value = quantity(
        "1",
        "permitted ratio of all other inertia at the motor shaft, flywheel included, to that of the rotor; checked "
        "only where it is given",
        default=10.0,
        above=0.0,
        max=1000.0,
    )
    ambient: Value = quantity("K", "temperature of the surroundings", default=313.15, min=230.0, max=340.0)
    temperature: Value = quantity(
        "K", "permitted temperature of the winding", default=393.15, min=330.0, max=500.0
    )
    poles_least: Value = whole_number("least number of poles", default=2, min=2, max=48)
    poles_most: Value = whole_number("largest number of poles", default=6, min=2, max=48)
    frequency: Value = quantity(
        "Hz",
        "rated frequency of the motors that are tried, as of the supply",
        default=50.0,
        min=1.0,
        max=1000.0,
    )
    larger: Value = quantity(
        "1",
        "power of a motor, relative to the smallest that fits, up to which it may be preferred: without a "
        "flywheel, with a lighter start, with a better number of poles",
        default=2.0,
        min=1.0,
        max=100.0,
    )
    gear_torque: Value = quantity(
        "N.m",
        "least permitted torque in running of a gear of the catalogue, such as the one that the overloads ask for",
        default=0.0,
        min=0.0,
    )
    service_factor: Value = quantity(
        "1",
        "service factor of the gear (fB) or of the belt, by its maker: its rated torque or power over that of the "
        "motor; 0: by load_class, hours and starts_per_hour",
        default=0.0,
        min=0.0,
        max=10.0,
    )
    hours: Value = quantity(
        "1", "hours of running a day, for the service factor", default=16.0, above=0.0, max=24.0
    )
    candidates: Value = whole_number(
        "least number of motors that are tried; further ones are tried until no later one could rank higher",
        default=9,
        min=1,
        max=200,
    )


RATIO_SERIES = ("preferred", "exact")
"""The ratios that sizing may take: preferred numbers, or any."""

PREFERENCE, PRICE = "preference", "price"
OBJECTIVES = (PREFERENCE, PRICE)
"""What is wanted of the drives that fit: the first by the order of preference, or the cheapest."""

STANDARD, HIGH_SLIP = "standard", "high-slip"
MOTORS = (STANDARD, HIGH_SLIP)
"""The packaged motors that are tried."""

SIZING_KEYS: Mapping[str, Any] = {
    "motors": file_key(
        Literal[MOTORS],
        STANDARD,
        "packaged motors that are tried: standard ones, or those of high slip (NEMA design D), with "
        "which a flywheel gives its energy to the peaks of the load",
    ),
    "gear_kind": file_key(
        Literal[tuple(UNITS)],
        "helical",
        "kind of the gear, by which one unit has a largest ratio; a belt of a larger ratio stands "
        "before a helical gear; none: the machine is on the motor's shaft or a coupling",
    ),
    "load_class": file_key(
        Literal[LOAD_CLASSES],
        None,
        "class of the load for the service factor: uniform, with moderate, heavy or very heavy "
        "shocks (crushers on a belt); without it, it follows from the inertia of the machine over that of the "
        "motor",
    ),
    "ratio_series": file_key(
        Literal[RATIO_SERIES],
        "preferred",
        "gear ratio: a preferred number of ISO 3, or exactly the one that gives the speed",
    ),
    "ratios": file_key(
        numbers(Transmission, "ratio", "sizing.ratios", 500, is_empty_allowed=False),
        [],
        "gear ratios on offer, of a catalogue of gears, in place of the series",
    ),
    "objective": file_key(
        Literal[OBJECTIVES],
        PREFERENCE,
        "the chosen drive of the fitting ones: the first by the order of preference, or the "
        "one of the lowest price of motor and gear",
    ),
    "own_only": file_key(
        StrictBool, False, "whether only motors of catalogues of your own are tried, no packaged ones"
    ),
    "separate_bearing": file_key(
        StrictBool,
        False,
        "whether the crank has bearings of its own, so that the shaft of a gear of the catalogue "
        "does not carry its reaction",
    ),
}


@dataclass(frozen=True)
class SizingPlan:
    """The demands on a motor of the catalogue, and the ratios of gears on offer, empty for a series of ratios."""

    demands: Sizing
    gear_kind: str
    ratio_series: str
    ratios: Sequence[float]
    objective: str = PREFERENCE
    own_only: bool = False
    separate_bearing: bool = False
    load_class: str | None = None
    motors: str = STANDARD

    def load(self, inertia_factor: float) -> str:
        """The class of the load, by this inertia factor where the file does not give it."""
        return self.load_class or load_class(inertia_factor)

    def gear_factor(self, inertia_factor: float) -> float:
        """The service factor of the gear; for `inertia_factor` see `chainunit.drives.service_factor`."""
        hours, starts = float(self.demands.hours), float(self.demands.starts_per_hour)
        return float(self.demands.service_factor) or gear_factor(self.load(inertia_factor), hours, starts)

    def belt_factor(self, inertia_factor: float, is_on_line: bool) -> float:
        """The service factor of a belt, of a motor that starts at the full voltage of the line or more gently."""
        load, hours = self.load(inertia_factor), float(self.demands.hours)
        factor = belt_factor(load, hours, is_on_line=is_on_line)
        return float(self.demands.service_factor) or factor

    def tensioned(self, tables: DriveTables, inertia_factor: float) -> DriveTables:
        """The `tables` with a belt that has the tension for its service factor, unless the file gives one."""
        factor = self.belt_factor(inertia_factor, tables.start == "direct")
        line = (
            replace(part, table=part.filled(part.table, service_factor=factor))
            if part.name == "belt"
            else part
            for part in tables.line
        )
        return replace(tables, line=tuple(line))

    def service_words(self, inertia_factor: float) -> str:
        """The source of the service factor of a gear in words; see `gear_factor`."""
        starts = f"{float(self.demands.starts_per_hour):g}"
        noun = "start" if starts == "1" else "starts"
        return self._factor_source(inertia_factor, f"{starts} {noun} an hour; typical of makers")

    def belt_words(self, inertia_factor: float, is_on_line: bool) -> str:
        """The source of the service factor of a belt in words; see `belt_factor`."""
        start = (
            "started direct on line, or as hard" if is_on_line else "started in star and delta or more gently"
        )
        return self._factor_source(inertia_factor, f"{start}; DIN 7753-2")

    def _factor_source(self, inertia_factor: float, starts: str) -> str:
        """The source of a service factor in words: the file, or class of the load, hours a day and `starts`, which is
        the clause on the starts and the table of factors."""
        if self.demands.service_factor:
            return "of the file"
        load, hours = LOAD_WORDS[self.load(inertia_factor)], f"{float(self.demands.hours):g} h a day"
        by = "by the file" if self.load_class else f"by an inertia factor of {inertia_factor:.3g}"
        return f"{load} {by}, {hours}, {starts} (sizing.load_class, sizing.hours, sizing.service_factor)"

    @property
    def offer(self) -> GearOffer:
        """The gears on offer."""
        return GearOffer(self.gear_kind, bool(self.ratios))

    @property
    def offered(self) -> Sequence[float]:
        """The ratios on offer; empty for a series."""
        return (1.0,) if self.gear_kind == "none" else self.ratios

    @property
    def words(self) -> dict[str, Any]:
        """The words and lists of the table, by key, without empty ones."""
        return {key: x for key in SIZING_KEYS if (x := getattr(self, key))}
