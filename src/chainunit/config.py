"""Study files: what they hold, and what must fit together in them; `reading` says how they are read."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import ConfigDict, Field, ValidationError, create_model

from .drives.cardan import check
from .drives.dc_motor import DcMotor
from .drives.driveline import Mounted
from .drives.gearing import KINDS, Transmission
from .drives.induction_motor import Inverter, SoftStart
from .drives.line_table import form, given_line
from .errors import GeometryError, InputError
from .machines.api import ChainUnit, ratios
from .machines.chain_unit import SIDES, ChamberForces, SideLoads, SideName, other
from .machines.flexible import LEAST, MOST, OrganLaw
from .quantities import Layout, Value, declaration, group, quantity
from .reading import (
    Slip,
    Title,
    filled,
    first_line,
    given_values,
    instance,
    merged,
    packaged,
    read,
    schema,
    slips,
    toml,
)


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
class Overload:
    """The one-sided overloads."""

    turns: Value = quantity(
        "1", "crank turns that are followed after the event", default=2.0, min=1.0, max=1e4
    )
    crank_angle: Value = quantity(
        "rad",
        "crank angle at which the event begins; at 0 the rocker is at its fastest",
        default=0.0,
        usual=(0.0, 6.3),
    )
    shift: Value = quantity(
        "s",
        "time in which material leaves or changes sides",
        default=0.3,
        min=1e-4,
        max=1e4,
        usual=(1e-3, 60.0),
    )
    jam_force: Value = quantity("N", "processing force of a lump that jams an organ", default=2000.0, min=0.0)
    jam_duration: Value = quantity(
        "s", "time for which the lump holds", default=0.3, min=1e-4, max=1e4, usual=(1e-3, 60.0)
    )
    jam_rise: Value = quantity(
        "s", "time in which the jam rises and falls", default=0.02, min=1e-4, max=1e4, usual=(1e-4, 60.0)
    )
    lumps: Value = quantity(
        "1", "number of lumps that come one after the other", default=4.0, min=1.0, max=1000.0
    )
    lump_pause: Value = quantity(
        "s", "time between two lumps", default=0.4, min=1e-3, max=1e4, usual=(1e-3, 60.0)
    )
    block_stiffness: Value = quantity(
        "N.m/rad", "stiffness of what blocks the rocker", default=2e5, above=0.0, max=1e9
    )
    block_damping: Value = quantity(
        "N.m.s/rad", "damping of what blocks the rocker", default=2e3, min=0.0, max=1e9
    )
    dip_depth: Value = quantity(
        "1", "share of the voltage that a dip takes away", default=0.5, min=0.0, max=1.0
    )
    dip_duration: Value = quantity(
        "s", "time for which the voltage is down", default=0.3, min=1e-3, max=1e4, usual=(1e-3, 60.0)
    )


@dataclasses.dataclass(frozen=True)
class Scenario:
    """An overload: what happens, and to which side."""

    kind: Literal["empties", "feed", "jam", "lumps", "blocked", "dip", "start"]
    side: SideName | Literal[""]
    """the side that has to carry it; none where both do"""
    title: str
    short: str


def _of_side(side: SideName) -> dict[str, Scenario]:
    gone, suffix = other(side), "" if side == "left" else "_right"
    return {
        f"{gone}_empties": Scenario("empties", side, f"the {gone} side empties", f"{gone} empties"),
        f"feed_{side}": Scenario("feed", side, f"all feed moves to the {side}", f"feed to {side}"),
        f"jam_{side}": Scenario("jam", side, f"a lump jams the {side} side", f"jam {side}"),
        f"lumps{suffix}": Scenario(
            "lumps", side, f"lumps come one after the other on the {side}", f"lumps {side}"
        ),
        f"start_loaded{suffix}": Scenario(
            "start", side, f"start with all feed on the {side}", f"{side} start"
        ),
    }


OVERLOADS: Mapping[str, Scenario] = {
    **_of_side("left"),
    **_of_side("right"),
    "blocked": Scenario("blocked", "", "the rocker is blocked", "blocked"),
    "dip": Scenario("dip", "", "the voltage dips", "dip"),
}
"""The overloads by the names that `events` takes in a study file."""
SCENARIOS = {name: scenario.title for name, scenario in OVERLOADS.items()}
"""Their titles."""
STANDARD = ("right_empties", "left_empties", "feed_left", "feed_right", "jam_left", "jam_right")
"""The overloads of a study that names none: the rocker swings farther to one side than to the other, so that both
count."""


def by_side(names: Collection[str]) -> list[list[str]]:
    """The overloads among `names`: what the left side has to carry, the right side, both; without empty groups."""
    groups = [
        [name for name in OVERLOADS if name in names and OVERLOADS[name].side == side]
        for side in (*SIDES, "")
    ]
    return [group for group in groups if group]


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
        "s", "time that is followed after a lump", default=2.0, min=0.05, max=1e4, usual=(0.05, 600.0)
    )
    force_low: Value = quantity("N", "least processing force of the lump", default=1000.0, min=0.0)
    force_high: Value = quantity("N", "largest processing force of the lump", default=3000.0, min=0.0)
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

_SECTIONS = {
    "machine": ChamberForces.Parameters,
    "ratios": Ratios,
    "feed": Feed,
    "motor": DcMotor.Parameters,
    "run": Run,
    "overload": Overload,
    "coupling": Coupling,
    "monte_carlo": MonteCarlo,
    "sizing": Sizing,
    "gear": Transmission,
    "starter": Starter,
    "chain": Chain,
}
_Driveline = form(Driveline, "driveline", "driveline.", place=(Literal[PLACES], "crank"))
_File = create_model(
    "Config",
    __config__=ConfigDict(extra="forbid"),
    title=(Title, ""),
    **{
        name: (section, Field(default_factory=section))
        for name, section in ((n, schema(d, n, n + ".")) for n, d in _SECTIONS.items())
    },
    driveline=(_Driveline, Field(default_factory=_Driveline)),
    feed_forward=(bool, False),
    start=(Literal[STARTS], "direct"),
    organ=(Literal[ORGANS], "two-bar"),
    catalogue=(str, ""),
    events=(list[Literal[*SCENARIOS]], list(STANDARD)),  # type: ignore[valid-type]
)  # type: ignore[call-overload]


@dataclasses.dataclass(frozen=True)
class Config:
    """A study, checked: machine, motor, loads and runs. `motor_given` names the motor parameters that were set."""

    title: str
    machine: ChainUnit
    feed: Feed
    motor: Any
    motor_given: frozenset[str]
    run: Run
    events: tuple[str, ...]
    overload: Overload
    coupling: Coupling | None
    monte_carlo: MonteCarlo
    feed_forward: bool
    sizing: Sizing | None
    gear: Transmission
    gear_given: frozenset[str]
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
    remarks: tuple[Slip, ...] = ()
    """values that look like a slip of the unit"""

    @property
    def settled(self) -> float:
        """Time from which running counts as steady [s]: `run.settle_turns` after the ramp of the reference or of the
        soft starter."""
        soft = self.starter.soft_start.time if self.start == "soft" else 0.0
        return float(max(self.run.ramp, soft) + self.run.settle_turns * 2.0 * math.pi / self.run.crank_speed)


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
    """A study from TOML text.

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
    remarks = tuple(slips({**_SECTIONS, "driveline": Driveline}, data))
    try:
        return _config(data, checked, source, remarks)
    except InputError as error:
        # what does not fit together may be a slip of the unit
        hints = [f'was {slip.variable.name} = "{slip.meant}" meant?' for slip in remarks if slip.meant]
        raise type(error)("; ".join([str(error), *hints])) from error


def _taken_over(error: InputError, given: Mapping[str, float]) -> str:
    """The lengths behind a refusal that the file does not give, as words to follow it."""
    names = error.names if isinstance(error, GeometryError) else ()
    example = Layout(type(ChainUnit().p)).named(ChainUnit().p)
    taken = [f"{name} = {example[name]:g}" for name in names if name in example and name not in given]
    return f"; not in the file, so taken from the packaged example: {', '.join(taken)}" if taken else ""


def _config(data: Mapping[str, Any], checked: Any, source: str, remarks: tuple[Slip, ...]) -> Config:
    """The study of a file whose values are each allowed."""
    _consistent(data, checked)
    machine_given = given_values(checked.machine)
    if checked.ratios.model_fields_set:
        try:
            lengths = ratios(**filled(Ratios, given_values(checked.ratios)))
        except InputError as error:
            raise InputError(f"ratios: {error}") from error
        twice = sorted(set(lengths) & set(machine_given))
        if twice:
            raise InputError(
                f"machine.{twice[0]}: given beside [ratios], which sets it; leave out one of the two"
            )
        machine_given |= lengths
    try:
        machine = ChainUnit(machine_given)
    except InputError as error:
        raise InputError(f"machine: {error}{_taken_over(error, machine_given)}") from error
    motor_given = given_values(checked.motor)
    motor = DcMotor.parameter_layout.from_names(motor_given)
    try:
        DcMotor.check(motor)
    except InputError as error:
        raise InputError(f"motor: {error}") from error
    config = Config(
        title=checked.title,
        machine=machine,
        feed=instance(Feed, given_values(checked.feed)),
        motor=motor,
        motor_given=frozenset(motor_given),
        run=instance(Run, given_values(checked.run)),
        events=tuple(dict.fromkeys(checked.events)),
        overload=instance(Overload, given_values(checked.overload)),
        coupling=instance(Coupling, given_values(checked.coupling)) if "coupling" in data else None,
        monte_carlo=instance(MonteCarlo, given_values(checked.monte_carlo)),
        sizing=_sizing(checked) if "sizing" in data else None,
        feed_forward=checked.feed_forward,
        gear=instance(
            Transmission, {**Layout(Transmission).named(KINDS["gear"]), **given_values(checked.gear)}
        ),
        gear_given=frozenset(given_values(checked.gear)),
        start=checked.start,
        starter=instance(Starter, given_values(checked.starter)),
        catalogue=_beside(checked.catalogue, source),
        driveline=_driveline(checked.driveline) if "driveline" in data else None,
        place=checked.driveline.place,
        damping_ratio=checked.driveline.damping_ratio,
        chain=instance(Chain, given_values(checked.chain)) if checked.organ == "chain" else None,
        source=source,
        remarks=remarks,
    )
    run, turn, o = config.run, 2.0 * math.pi / config.run.crank_speed, config.overload
    lumps = o.lumps * (2.0 * o.jam_rise + o.jam_duration + o.lump_pause) if "lumps" in config.events else 0.0
    seconds = config.settled + (run.turns + len(config.events) * (o.turns + 2.0)) * turn + lumps
    steps = max(seconds, config.monte_carlo.duration) / run.step
    if not steps <= MOST_STEPS:
        raise InputError(
            f"run.step = {run.step:g} s: the study would take {steps:.2g} steps, more than {MOST_STEPS:.0e}; "
            "lengthen the step, raise the speed, or lessen the turns"
        )
    return config


def _sizing(checked: Any) -> Sizing:
    """What is asked of the motor; a motor on the line has a limit of the inertia ratio only where one is given."""
    given = given_values(checked.sizing)
    limit = {} if checked.start == "inverter" else {"inertia_ratio": math.inf}
    asked: Sizing = instance(Sizing, limit | given)
    return asked


def _driveline(section: Any) -> Driveline:
    given = given_line(section, "driveline.")
    names = Layout(Driveline).names
    line: Driveline = instance(Driveline, {name: x for name, x in given.items() if name in names})
    try:
        check(line)
    except InputError as error:
        raise InputError(f"driveline.{error}") from error
    return line


def _consistent(data: Mapping[str, Any], checked: Any) -> None:
    """Refuse what would be passed over in silence, and limits that leave nothing between them."""
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
    sizing, random = (
        instance(Sizing, given_values(checked.sizing)),
        instance(MonteCarlo, given_values(checked.monte_carlo)),
    )
    for low, high, what in (
        (sizing.poles_least, sizing.poles_most, "sizing.poles_most"),
        (random.force_low, random.force_high, "monte_carlo.force_high"),
    ):
        if high < low:
            raise InputError(f"{what} = {high:g}: must be >= {low:g}, the least")
    feed, jam = instance(Feed, given_values(checked.feed)), instance(Overload, given_values(checked.overload))
    added = {"material_mass": 0.0, "processing_force": max(jam.jam_force, random.force_high)}
    for v in Layout(SideLoads).variables:
        most = getattr(feed.left, v.name) + getattr(feed.right, v.name) + added[v.name]
        if not v.quantity.admits(most):
            # overloads lay all on one side
            jams = " and the hardest lump" if added[v.name] else ""
            raise InputError(
                f"feed: {v.name} of both sides{jams} = {most:g} {v.unit}: must be <= {v.quantity.high:g} {v.unit} "
                "together, as an overload may lay all of it on one side"
            )
    if "chain" in data and checked.organ != "chain":
        raise InputError('chain: is of organs that are chains; add organ = "chain", or leave it out')
    chain = instance(Chain, given_values(checked.chain))
    if chain.sweep_highest <= chain.sweep_lowest:
        raise InputError(
            f"chain.sweep_highest = {chain.sweep_highest:g} rad/s: must be > chain.sweep_lowest, "
            f"{chain.sweep_lowest:g} rad/s"
        )
    if not sizing.temperature > sizing.ambient:
        raise InputError(
            f"sizing.temperature = {sizing.temperature:g} K: must be > sizing.ambient, {sizing.ambient:g} K"
        )
    for name, number in (
        ("run.turns", instance(Run, given_values(checked.run)).turns),
        ("monte_carlo.runs", random.runs),
        ("monte_carlo.seed", random.seed),
        *((f"chain.{n}", getattr(chain, n)) for n in ("rods", "sweep_points", "starts", "turns")),
    ):
        if number != int(number):
            raise InputError(f"{name} = {number:g}: must be a whole number")


def _beside(name: str, source: str) -> Path | None:
    """A file that a study file names, relative to the study file."""
    return (Path(source).parent / name) if name else None


MOST_STEPS = 1e6
_LENGTHS = ("r", "l", "h", "c", "hy", "e", "l1", "l2", "z")


def _over_example(data: Mapping[str, Any]) -> dict[str, Any]:
    """A study file laid over the packaged example: what is not named is the example's. Its ratios give way to
    lengths of the user's own."""
    base = toml(example())
    if any(name in data.get("machine", {}) for name in _LENGTHS) and "ratios" not in data:
        del base["ratios"]
    base["title"] = ""
    return merged(base, data)
