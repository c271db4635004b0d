"""The V-belt between the motor, or its fluid coupling, and the gear or the machine."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.engines import MATH
from ...core.errors import InputError
from ...core.quantities import Value, declaration, percentage, quantity
from ...drives.belt import belt_drive
from ...drives.gear_ratios import UNITS
from ...drives.gearing import KINDS
from ...drives.v_belt import VBelt, VBeltData, bending, grip, rated_grip, slip_at, usual_pretension, wrap
from ...reading.results import part, result
from ..analysis import Analysis, Findings, Work
from ..arrays import peak
from ..conditions import given, is_one_of
from ..event import Role
from ..file_section import FileSection
from ..record import StudyRecord
from ..remark import note, warning
from ..rules import Rule
from .slip_plan import SlipPlan
from .slipping import SlippingPart, parts_of_runs

_IRON, _FILLED, _WIDTH = 7200.0, 0.5, 0.35
"""A pulley: density of cast iron [kg/m3], share of a solid disc, width over the diameter of the motor's pulley."""
SLIPS = 5.0
"""Slip over the rated one from which on the belt slips through."""
LOADS = (0.25, 0.5, 0.75, 1.0, 1.25)
"""Torques of the motor for the table of the efficiency, over its rated torque."""


@declaration
class BeltTable(VBeltData):
    """A V-belt from the motor's shaft to the gear or the machine."""

    service_factor: Value = quantity(
        "1", "factor on the rated torque for which the belt is tensioned", default=1.3, min=1.0, max=3.0
    )


@dataclass(frozen=True)
class BeltPlan(SlipPlan):
    """The belt of a study."""

    name = "belt"
    model = VBelt

    def share(self, ratio: float) -> float:
        """Its own ratio, or the whole one where one belt has it."""
        if "ratio" in self.keys:
            return float(self.table.ratio)
        largest = UNITS["belt"][0].largest
        return ratio if 1.0 / largest <= ratio <= largest else KINDS["belt"].ratio

    def completed(self, table: Any, ratio: float) -> Any:
        """With the standard pulley of the motor, the usual distance and tension, and the inertia of the pulleys."""
        table = replace(table, ratio=ratio)
        if "diameter" not in self.keys:
            # the standard pulleys are chosen for the smaller one, which turns faster
            step = max(ratio, 1.0 / ratio)
            speed = table.rated_speed * max(1.0, 1.0 / ratio)
            belt = belt_drive(table.rated_power, speed, step, table.service_factor)
            table = replace(table, diameter=belt.small if ratio >= 1.0 else belt.small / ratio)
        sum_d = table.diameter * (1.0 + ratio)
        table = self.filled(table, distance=sum_d)
        if not table.distance > 0.5 * sum_d:
            raise InputError(
                f"belt.distance = {1e3 * table.distance:.4g} mm: must be > {500.0 * sum_d:.4g} mm, half of both "
                f"pulleys; leave it out for {1e3 * sum_d:.4g} mm",
                key="belt.distance",
            )
        return self.filled(
            table,
            pretension=usual_pretension(table, table.service_factor),
            J_motor=pulley_inertia(table.diameter, table.diameter),
            J_driven=pulley_inertia(table.diameter * ratio, table.diameter),
        )

    def stall_torque(self, table: Any) -> float:
        """The belt slips through, and bends."""
        return float(0.5 * table.diameter * grip(MATH, table, table.rated_speed, 0.0)) + self.drag(table)

    def drag(self, table: Any) -> float:
        """The torque that bends the belt."""
        return float(bending(MATH, table))


def pulley_inertia(diameter: float, small: float) -> float:
    """Inertia of a pulley of that diameter [m] beside a motor's pulley of the diameter `small` [m], in kg m2."""
    return math.pi / 32.0 * _IRON * _FILLED * _WIDTH * small * diameter**4


@declaration
class BeltAnswers:
    """The load of the belt in a run. It slips through from 5 times the rated slip on."""

    force_peak: Value = quantity("N", "force of the belt, peak")
    grip_largest: Value = percentage("largest force over the grip")
    slip_mean: Value = percentage("slip, mean")
    slipping_time: Value = quantity("s", "time in which it slips through")
    tight_strand_peak: Value = quantity("N", "tight strand, peak")
    shaft_force_mean: Value = quantity("N", "radial force on either shaft, mean")
    shaft_force_peak: Value = quantity("N", "radial force on either shaft, peak")
    loss_mean: Value = quantity("W", "power turned into heat, mean")
    heat: Value = quantity("J", "heat")


@result
class BeltLoad:
    """The belt at a constant load and the rated speed."""

    load: float = percentage("load over the rated torque")
    slip: float = percentage("slip")
    efficiency: float = percentage("efficiency")


@result
class BeltFindings(Findings):
    """By run, the load of the belt; its dimensions; its efficiency over the load."""

    small_pulley: float = quantity("m", "pitch diameter of the motor's pulley", kind="millimetres")
    large_pulley: float = quantity("m", "pitch diameter of the driven pulley", kind="millimetres")
    wrap: float = quantity("rad", "wrap of the smaller pulley")
    speed: float = quantity("m/s", "speed of the belt at the motor's rated speed")
    pretension: float = quantity("N", "tension of a strand at rest, of all belts together")
    static_force: float = quantity("N", "radial force on either shaft at rest")
    slip_torque: float = quantity(
        "N.m", "largest torque that it takes from the motor, with the machine at rest"
    )
    loads: tuple[BeltLoad, ...] = part("efficiency over load", default=())
    answers: Mapping[str, BeltAnswers] = part("load of the belt, by run", default_factory=dict)

    def remark(self, study: StudyRecord) -> None:
        """A gear behind the belt that speeds the machine up, and the runs in which the belt slips through."""
        drive = study.setup.drive
        if drive.is_geared and (behind := drive.ratio / drive.line.ratio) < 1.0:
            study.findings.say(_SPEEDS_UP, belt=drive.line.ratio, behind=behind)
        for name, answers in self.answers.items():
            if answers.slipping_time:
                event = study.setup.config.events.get(name)
                code = _PROTECTS if event is not None and event.role is Role.SHOCK else _SLIPS
                study.findings.say(
                    code,
                    name,
                    title=study.runs.title_of(name),
                    time=answers.slipping_time,
                    torque=self.slip_torque,
                    heat=answers.heat,
                )


_SPEEDS_UP = warning(
    "gear-speeds-up",
    "The belt slows the shaft down by {belt}, and the gear behind it speeds it up again, as its ratio is {behind}.",
    remedy="Leave belt.ratio out, so that the belt has the whole ratio.",
    sizes={"1": "belt behind"},
)
_SLIPS_THROUGH = (
    "{title}: the belt slips through for {time}, at up to {torque} at the motor's shaft.",
    "It turns {heat} into heat.",
)
_SIZES = {"s": "time", "N.m": "torque", "J": "heat"}
_SLIPS = warning(
    "belt-slips",
    *_SLIPS_THROUGH,
    remedy="More tension (belt.pretension), more belts or larger pulleys hold it, and load both shafts more.",
    sizes=_SIZES,
)
_PROTECTS = note("belt-slips-in-overload", *_SLIPS_THROUGH, sizes=_SIZES)


def at_loads(table: BeltTable) -> tuple[BeltLoad, ...]:
    """Slip and efficiency at the rated speed under each of the `LOADS` that the belt passes on without slipping
    through."""
    radius, rated, rows = 0.5 * table.diameter, table.rated_power / table.rated_speed, []
    for load in LOADS:
        pull = (load * rated - bending(MATH, table)) / radius
        if 0.0 < pull < rated_grip(MATH, table):
            slip = slip_at(MATH, table, pull)
            efficiency = (1.0 - slip) * pull * radius / (load * rated)
            rows.append(BeltLoad(load, slip, efficiency))
    return tuple(rows)


class BeltAnalysis(Analysis):
    """The load of the belt in each run."""

    name = "belt_slip"
    needs_runs = True
    applies = staticmethod(lambda drive, plans: drive.line.part(BeltPlan.name) is not None)

    @staticmethod
    def find(study: StudyRecord, work: Work) -> BeltFindings:
        """The load in each run."""
        placed = study.setup.drive.line.part(BeltPlan.name)
        assert placed is not None
        table, answers = placed.table, {}
        for name, run in parts_of_runs(study.runs, placed):
            x = run.variables
            slipping = np.abs(run.speed - run.driven) > SLIPS * table.rated_slip * table.rated_speed
            answers[name] = BeltAnswers(
                force_peak=peak(x["force"]),
                grip_largest=peak(x["grip"]),
                slip_mean=run.mean(run.slip),
                slipping_time=run.sum(slipping.astype(float)),
                tight_strand_peak=peak(x["tight_strand"]),
                shaft_force_mean=run.mean(x["shaft_force"]),
                shaft_force_peak=peak(x["shaft_force"]),
                loss_mean=run.mean(run.heat),
                heat=run.sum(run.heat),
            )
        angle = wrap(MATH, table)
        return BeltFindings(
            small_pulley=table.diameter,
            large_pulley=table.diameter * table.ratio,
            wrap=angle,
            speed=0.5 * table.diameter * table.rated_speed,
            pretension=table.pretension,
            static_force=2.0 * table.pretension * math.sin(0.5 * angle),
            slip_torque=placed.stall_torque,
            loads=at_loads(table),
            answers=answers,
        )


class BeltPart(SlippingPart):
    """The part, with the table [belt]."""

    def rules(self) -> Iterable[Rule]:
        """Sizing takes the rest of the ratio for the gear, not for a second belt."""
        yield from super().rules()
        refusal = 'is the belt; take sizing.gear_kind = "none", or the kind of the gear behind it'
        yield Rule(self.name, is_one_of("sizing.gear_kind", "belt"), refusal)
        for key in ("pulley_diameter", "tension_factor"):
            yield Rule(
                f"motor_shaft.{key}", given(self.name), "is of a belt without a table; [belt] has its own"
            )

    name = BeltPlan.name
    order = 6
    model = VBelt
    plan_type = BeltPlan
    analysis = BeltAnalysis
    tables = {  # noqa: RUF012
        "belt": FileSection(
            BeltTable,
            optional=True,
            title="V-belt",
            follows={
                "ratio": "the whole ratio of the drive up to 6.3, else 3; a gear behind the belt has the rest",
                "rated_power": "the motor's, by its nameplate",
                "rated_speed": "the motor's, by its nameplate",
                "diameter": "the standard pulley of a narrow V-belt for the rated torque times service_factor",
                "distance": "both diameters together",
                "pretension": "makers' rule for service_factor times the rated torque",
                "service_factor": "with [sizing] by the class of its load and the start, else 1.3",
                "J_motor": "cast iron pulley, half of a solid disc",
                "J_driven": "cast iron pulley, half of a solid disc",
            },
        )
    }


PART = BeltPart()
