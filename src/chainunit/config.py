"""Study files: what they hold, and what must fit together in them; `reading` says how they are read."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from .drives.cardan import check
from .drives.dc_motor import DcMotor
from .drives.driveline import Mounted
from .drives.gearing import KINDS, Transmission
from .drives.induction_motor import Inverter, SoftStart
from .drives.line_table import form, given_line
from .errors import GeometryError, InputError
from .machines.api import ChainUnit, ratios
from .machines.chain_unit import ChamberForces, SideLoads, SideName
from .machines.flexible import LEAST, MOST, OrganLaw
from .quantities import Layout, Value, declaration, group, quantity
from .reading import (
    Slip,
    Title,
    filled,
    first_line,
    given_values,
    merged,
    packaged,
    read,
    schema,
    slips,
    toml,
)
from .studies.event_table import RandomEvent, read_events, read_random_event
from .studies.events import Event, OneSidedFeed
from .system.signals import Profile


@declaration
class Feed:
    """The material on both organs in normal running."""

    left: SideLoads = group(SideLoads, "left organ", default=SideLoads())
    right: SideLoads = group(SideLoads, "right organ", default=SideLoads())


@declaration
class Ratios:
    """The papers' ratios, in place of lengths."""

    rho: Value = quantity("1", "r/l, crank to coupler", default=0.1, above=0.0, max=1.0)
    lam: Value = quantity("1", "h/l, rocker to coupler", default=2.0 / 3.0, above=0.0)
    mu: Value = quantity("1", "e/l1, rocker arm of the web hinge to wall", default=0.6, above=0.0, max=1.0)
    zeta: Value = quantity("1", "z/z_max, half width", default=0.5, above=0.0, max=1.0)
    l: Value = quantity("m", "coupler A-Bd", default=1.5, above=0.0)
    l1: Value = quantity("m", "wall A1-B", default=1.35, above=0.0)


@declaration
class Run:
    """How the machine is run."""

    crank_speed: Value = quantity(
        "rad/s",
        "speed of the crank in normal running",
        default=3.0,
        min=0.01,
        max=1000.0,
        usual=(0.05, 25.0),
        kind="speed",
    )
    ramp: Value = quantity(
        "s",
        "time in which the speed reference rises from rest",
        default=1.5,
        min=0.001,
        max=1e4,
        usual=(1e-3, 600.0),
    )
    settle_turns: Value = quantity(
        "1", "crank turns after the ramp, before running counts as steady", default=2.0, min=0.0, max=1e4
    )
    turns: Value = quantity(
        "1",
        "whole crank turns of steady running that are evaluated and that load_cycle.csv holds",
        default=1.0,
        min=1.0,
        max=1e4,
    )
    step: Value = quantity("s", "communication step of the co-simulation", default=0.001, min=1e-5, max=0.02)


@declaration
class Coupling:
    """A safety coupling or shear pin on the motor shaft."""

    trip_torque: Value = quantity("N.m", "torque of the crank at which it opens", default=1000.0, above=0.0)
    release_time: Value = quantity(
        "s",
        "time from the trip until no torque passes; near 0 for a shear pin",
        default=0.005,
        min=0.0,
        max=1.0,
    )
    scatter: Value = quantity(
        "1",
        "standard deviation of the trip torque in a Monte Carlo study, as a share",
        default=0.05,
        min=0.0,
        max=0.5,
    )


@declaration
class MonteCarlo:
    """Overloads at random crank angles and times."""

    runs: Value = quantity("1", "number of runs; 0 leaves the study out", default=0.0, min=0.0, max=1e6)
    duration: Value = quantity(
        "s", "time that is followed after the event", default=2.0, min=0.05, max=1e4, usual=(0.05, 600.0)
    )
    seed: Value = quantity("1", "seed of the random numbers", default=1.0, min=0.0, max=1e9)


@declaration
class Sizing:
    """What is asked of a motor from the catalogue."""

    one_sided_share: Value = quantity(
        "1", "share of the running time with all feed on one side", default=0.1, min=0.0, max=1.0
    )
    starts_per_hour: Value = quantity("1", "starts per hour", default=2.0, min=0.0, max=1000.0)
    fluctuation: Value = quantity(
        "1",
        "permitted fluctuation of the crank speed, (largest - least)/mean",
        default=0.05,
        above=0.0,
        max=1.0,
    )
    breakdown_margin: Value = quantity(
        "1", "factor between the peak torque and the breakdown torque", default=1.25, min=1.0, max=10.0
    )
    inertia_ratio: Value = quantity(
        "1",
        "permitted ratio of all other inertia at the motor shaft, flywheel included, to that of the rotor; of motors "
        "on the line only where it is given",
        default=10.0,
        above=0.0,
        max=1000.0,
    )
    ambient: Value = quantity("K", "temperature of the surroundings", default=313.15, min=230.0, max=340.0)
    temperature: Value = quantity(
        "K", "permitted temperature of the winding", default=393.15, min=330.0, max=500.0
    )
    poles_least: Value = quantity("1", "least number of poles", default=2.0, min=2.0, max=48.0)
    poles_most: Value = quantity("1", "largest number of poles", default=6.0, min=2.0, max=48.0)
    candidates: Value = quantity(
        "1",
        "least number of motors that are co-simulated; more follow until one fits",
        default=9.0,
        min=1.0,
        max=200.0,
    )


@declaration
class Starter:
    """How an induction motor is started, where `start` is "soft" or "inverter"."""

    soft_start: SoftStart = group(SoftStart, "soft starter", default=SoftStart(voltage=0.5, time=1.0))
    inverter: Inverter = group(Inverter, "inverter", default=Inverter())


@declaration
class Driveline(Mounted):
    """A cardan driveline between motor and machine. The start values are ours: the paper prints no dimensions."""

    exponent: Value = quantity(
        "1",
        "exponent of Woehler's line for the damage of torque cycles; assumed",
        default=5.0,
        min=1.0,
        max=20.0,
    )


@declaration
class Chain(OrganLaw):
    """The organs as chains, where `organ` is "chain", and the sweep over crank speeds with them."""

    rods: Value = quantity("1", "number of rods of an organ", default=8.0, min=float(LEAST), max=float(MOST))
    sweep_lowest: Value = quantity(
        "rad/s", "lowest crank speed of the sweep", default=1.0, min=0.01, max=1000.0
    )
    sweep_highest: Value = quantity(
        "rad/s", "highest crank speed of the sweep", default=15.0, above=0.0, max=1000.0
    )
    sweep_points: Value = quantity(
        "1",
        "number of speeds of the sweep; 0 leaves all but the study's own out",
        default=15.0,
        min=0.0,
        max=200.0,
    )
    starts: Value = quantity(
        "1", "starts at each speed, evenly over the turn: at least 10", default=10.0, min=10.0, max=1000.0
    )
    turns: Value = quantity(
        "1", "crank turns that are evaluated of each start: at least 30", default=30.0, min=30.0, max=1e4
    )


ORGANS = ("two-bar", "chain")
"""How the organs are modelled."""

PLACES = ("crank", "motor")
"""Where a driveline is: on the crank's shaft, behind the gear, or on the motor's, before it."""

STARTS = ("direct", "soft", "inverter")


@dataclasses.dataclass(frozen=True)
class Section:
    """A table of a study file. The study has its values, or None where it is `optional` and the file does not have
    it; what it does not name is of `default`."""

    declared: type
    default: Any = None
    optional: bool = False
    whole: tuple[str, ...] = ()
    """quantities that are whole numbers"""
    keys: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """other keys than quantities, as pydantic fields"""
    form: Callable[..., type[BaseModel]] = schema
    values: Callable[[Any], dict[str, Any]] = given_values
    """what a checked table gives, by the name of the quantity"""


SECTIONS: Mapping[str, Section] = {
    "machine": Section(ChamberForces.Parameters),
    "ratios": Section(Ratios),
    "feed": Section(Feed),
    "motor": Section(DcMotor.Parameters),
    "run": Section(Run, whole=("turns",)),
    "coupling": Section(Coupling, optional=True),
    "monte_carlo": Section(MonteCarlo, whole=("runs", "seed"), keys={"event": (dict[str, Any], {})}),
    "sizing": Section(Sizing, optional=True),
    "gear": Section(Transmission, default=KINDS["gear"]),
    "starter": Section(Starter),
    "chain": Section(Chain, whole=("rods", "sweep_points", "starts", "turns")),
    "driveline": Section(
        Driveline,
        optional=True,
        keys={"place": (Literal[PLACES], "crank")},
        form=form,
        values=partial(given_line, prefix="driveline."),
    ),
}


def _table(name: str, section: Section) -> tuple[Any, Any]:
    table = section.form(section.declared, name, f"{name}.", **section.keys)
    return table, Field(default_factory=table)


_File = create_model(
    "Config",
    __config__=ConfigDict(extra="forbid"),
    title=(Title, ""),
    **{name: _table(name, section) for name, section in SECTIONS.items()},
    feed_forward=(bool, False),
    start=(Literal[STARTS], "direct"),
    organ=(Literal[ORGANS], "two-bar"),
    catalogue=(str, ""),
    event=(list[Any], []),
)  # type: ignore[call-overload]


@dataclasses.dataclass(frozen=True)
class Config:
    """A study, checked: machine, motor, loads, runs and events by the names of their runs."""

    title: str
    machine: ChainUnit
    feed: Feed
    motor: Any
    run: Run
    events: Mapping[str, Event]
    coupling: Coupling | None
    monte_carlo: MonteCarlo
    random: RandomEvent
    feed_forward: bool
    sizing: Sizing | None
    gear: Transmission
    start: str
    starter: Starter
    catalogue: Path | None
    driveline: Driveline | None
    place: str
    """of the driveline, one of `PLACES`"""
    damping_ratio: float | None
    """of the driveline's torsion, in place of d2 and d3"""
    chain: Chain | None
    """the organs as chains, or None for two bars"""
    source: str
    given: frozenset[str]
    """names of all that the file sets, such as "machine.crank.m"; everything else is the example's"""
    remarks: tuple[Slip, ...] = ()
    """values that look like a slip of the unit"""

    @property
    def turn(self) -> float:
        """Time of a turn of the crank at the speed that is asked for [s]."""
        return float(2.0 * math.pi / self.run.crank_speed)

    @property
    def settled(self) -> float:
        """Time from which running counts as steady [s]: `run.settle_turns` after the ramp of the reference or of the
        soft starter."""
        soft = self.starter.soft_start.time if self.start == "soft" else 0.0
        return float(max(self.run.ramp, soft) + self.run.settle_turns * self.turn)

    def one_sided(self, side: SideName) -> Event:
        """All feed on that side: the event of the study, where it has one, else the example's."""
        of_study = (
            event
            for event in self.events.values()
            if (event.kind, event.side) == (OneSidedFeed.kind, side) and event.empties
        )
        return next(of_study, OneSidedFeed.on(side))


def load(file: Path | None = None) -> Config:
    """Read and check a study file; without one, the packaged example.

    Raises
    ------
    InputError
        in one line: the file, the field, its value and what is allowed.
    """
    return read(file, example, parse)


def example() -> str:
    """The packaged study file."""
    return packaged("example.toml")


def parse(text: str, source: str = "config") -> Config:
    """A study from TOML text. What it leaves out is the example's: the packaged file's, and where that does not name
    it, as declared.

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
    declared = {name: section.declared for name, section in SECTIONS.items()}
    remarks = tuple(slips(declared, data))
    try:
        events = read_events(checked.event)
        if "event" in data:
            kinds = {f"event.{name}": event.Parameters for name, event in events.items()}
            tables = dict(zip(events, data["event"], strict=True))
            remarks += tuple(slips(kinds, {"event": tables}))
        return _config(data, checked, events, source, remarks)
    except InputError as error:
        # what does not fit together may be a slip of the unit
        hints = [f'was {slip.variable.name} = "{slip.meant}" meant?' for slip in remarks if slip.meant]
        raise type(error)("; ".join([str(error), *hints])) from error


def _config(
    data: Mapping[str, Any],
    checked: Any,
    events: Mapping[str, Event],
    source: str,
    remarks: tuple[Slip, ...],
) -> Config:
    """The study of a file whose values are each allowed."""
    _check_company(data)
    tables = {name: section.values(getattr(checked, name)) for name, section in SECTIONS.items()}
    values = {
        name: Layout(section.declared).from_names(
            {key: x for key, x in tables[name].items() if key in Layout(section.declared).names},
            section.default,
        )
        for name, section in SECTIONS.items()
    }
    _check_order(values)
    parts = {name: values[name] for name in ("feed", "run", "monte_carlo", "gear", "starter")}
    parts |= {
        name: values[name] if name in data else None for name, each in SECTIONS.items() if each.optional
    }
    if "sizing" in data and checked.start != "inverter" and "inertia_ratio" not in tables["sizing"]:
        # of motors on the line only where it is given
        parts["sizing"] = dataclasses.replace(parts["sizing"], inertia_ratio=math.inf)
    config = Config(
        title=checked.title,
        machine=_machine(tables["machine"], tables["ratios"]),
        motor=_checked("motor: ", DcMotor.check, values["motor"]),
        events=events,
        random=read_random_event(checked.monte_carlo.event, "monte_carlo.event"),
        feed_forward=checked.feed_forward,
        start=checked.start,
        catalogue=_beside(checked.catalogue, source),
        place=checked.driveline.place,
        damping_ratio=checked.driveline.damping_ratio,
        chain=values["chain"] if checked.organ == "chain" else None,
        source=source,
        given=frozenset(_names(data, events)),
        remarks=remarks,
        **parts,
    )
    if config.driveline is not None:
        _checked("driveline.", check, config.driveline)
    _check_loads(config)
    _check_steps(config)
    return config


def _checked(prefix: str, check: Callable[[Any], object], values: Any) -> Any:
    """The `values`, which `check` does not refuse; `prefix` goes before its words."""
    try:
        check(values)
    except InputError as error:
        raise InputError(f"{prefix}{error}") from error
    return values


def _names(data: Mapping[str, Any], events: Mapping[str, Event], prefix: str = "") -> Iterator[str]:
    """Names of all values that a file gives, events by the names of their runs."""
    for name, value in data.items():
        if name == "event" and not prefix:
            for run, table in zip(events, value, strict=True):
                yield from _names(table, {}, f"event.{run}.")
        elif isinstance(value, Mapping):
            yield from _names(value, {}, f"{prefix}{name}.")
        else:
            yield prefix + name


def _machine(given: dict[str, float], of_papers: Mapping[str, float]) -> ChainUnit:
    """The machine by its lengths, or by the papers' ratios in their place."""
    if of_papers:
        try:
            lengths = ratios(**filled(Ratios, of_papers))
        except InputError as error:
            raise InputError(f"ratios: {error}") from error
        twice = sorted(set(lengths) & set(given))
        if twice:
            raise InputError(
                f"machine.{twice[0]}: given beside [ratios], which sets it; leave out one of the two"
            )
        given = given | lengths
    try:
        return ChainUnit(given)
    except InputError as error:
        raise InputError(f"machine: {error}{_taken_over(error, given)}") from error


def _taken_over(error: InputError, given: Mapping[str, float]) -> str:
    """The lengths behind a refusal that the file does not give, as words to follow it."""
    names = error.names if isinstance(error, GeometryError) else ()
    example = Layout(type(ChainUnit().p)).named(ChainUnit().p)
    taken = [f"{name} = {example[name]:g}" for name in names if name in example and name not in given]
    return f"; not in the file, so taken from the packaged example: {', '.join(taken)}" if taken else ""


def _check_company(data: Mapping[str, Any]) -> None:
    """Refuse what would be passed over in silence."""
    if "sizing" in data:
        for name in ("motor", "feed_forward"):
            if data.get(name):
                raise InputError(
                    f"{name}: is of the DC motor, and [sizing] picks another; leave out one of the two"
                )
        if "ratio" in data.get("machine", {}):
            raise InputError("machine.ratio: [sizing] finds it; to have it kept, give gear.ratio")
    else:
        for name in ("gear", "start", "starter", "catalogue"):
            if name in data:
                raise InputError(
                    f"{name}: is of the motor that [sizing] picks; add [sizing], or leave it out"
                )
    if "chain" in data and data.get("organ") != "chain":
        raise InputError('chain: is of organs that are chains; add organ = "chain", or leave it out')


_ORDER = (
    ("sizing.poles_least", ">=", "sizing.poles_most"),
    ("sizing.ambient", ">", "sizing.temperature"),
    ("chain.sweep_lowest", ">", "chain.sweep_highest"),
)
"""Quantities of which the second has to be more than the first."""


def _check_order(values: Mapping[str, Any]) -> None:
    """Limits that leave nothing between them, and counts that are none."""

    def value(name: str) -> tuple[float, str]:
        section, _, key = name.partition(".")
        x, declared = getattr(values[section], key), type(values[section])
        unit = next(v.unit for v in Layout(declared).variables if v.name == key)
        return x, f"{x:g}" + ("" if unit == "1" else f" {unit}")

    for low, relation, high in _ORDER:
        (least, limit), (most, shown) = value(low), value(high)
        if most < least or (most == least and relation == ">"):
            raise InputError(f"{high} = {shown}: must be {relation} {low}, {limit}")
    for section, table in SECTIONS.items():
        for key in table.whole:
            number, shown = value(f"{section}.{key}")
            if number != int(number):
                raise InputError(f"{section}.{key} = {shown}: must be a whole number")


def _check_loads(config: Config) -> None:
    """Refuse loads that, together, no machine reaches: all on one side, and at the height of each event."""
    feed = config.feed
    for v in Layout(SideLoads).variables:
        most = getattr(feed.left, v.name) + getattr(feed.right, v.name)
        if not v.quantity.admits(most):
            raise InputError(
                f"feed: {v.name} of both sides = {most:.9g} {v.unit}: must be <= {v.quantity.high:g} {v.unit} "
                "together, as an overload may lay all of it on one side"
            )
    inputs = {v.name: v for v in ChamberForces.input_layout.variables}
    normal = {name: v.quantity.start or 0.0 for name, v in inputs.items()} | Layout(Feed).named(feed)
    hardest = [(f"event.{name}", event) for name, event in config.events.items()]
    hardest += [("monte_carlo.event", event) for event in config.random.hardest()]
    for where, event in hardest:
        if not set(event.inputs(event.side)) <= set(inputs):
            continue
        for name, signal in event.signals(normal, 0.0, dict.fromkeys(event.reads, 0.0)).items():
            most = (
                max([signal.start, *(x for *_, x in signal.changes)])
                if isinstance(signal, Profile)
                else signal
            )
            v = inputs[name]
            if not v.quantity.admits(most):
                raise InputError(
                    f"{where}: {name} comes to {most:.9g} {v.unit} with the feed: must be {v.quantity.allowed}"
                )


MOST_STEPS = 1e6


def _check_steps(config: Config) -> None:
    """Refuse a study that would never end."""
    run, turn = config.run, config.turn
    seconds = config.settled + run.turns * turn
    seconds += sum(event.follow(turn) + 2.0 * turn for event in config.events.values())
    steps = max(seconds, config.monte_carlo.duration) / run.step
    if not steps <= MOST_STEPS:
        raise InputError(
            f"run.step = {run.step:g} s: the study would take {steps:.2g} steps, more than {MOST_STEPS:.0e}; "
            "lengthen the step, raise the speed, or lessen the turns"
        )


def _beside(name: str, source: str) -> Path | None:
    """A file that a study file names, relative to the study file."""
    return (Path(source).parent / name) if name else None


_LENGTHS = ("r", "l", "h", "c", "hy", "e", "l1", "l2", "z")


def _over_example(data: Mapping[str, Any]) -> dict[str, Any]:
    """A study file laid over the packaged example: what is not named is the example's. Its ratios give way to
    lengths of the user's own."""
    base = toml(example())
    if any(name in data.get("machine", {}) for name in _LENGTHS) and "ratios" not in data:
        del base["ratios"]
    base["title"] = ""
    return merged(base, data)
