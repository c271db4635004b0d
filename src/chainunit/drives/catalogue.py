"""Standard motors: the packaged table, and the rows of the user's file.

The packaged table has cage motors for 400 V, 50 Hz, 0.12 to 75 kW, with 2, 4 and 6 poles, in the frames of
EN 50347, and the same motors on 460 V, 60 Hz. Their efficiencies are the limits in IEC 60034-30-1 of the class that
the regulation EU 2019/1781 asks of motors on the market: IE3, and IE4 from 75 kW on (since July 2023, up to 200 kW,
with 2 to 6 poles). All other values are typical of such motors but belong to no maker: they vary smoothly with size,
and take the place of a supplier's catalogue. Their locked-rotor currents are in the range that makers publish for IE3
motors, and at 50 Hz below the limits of IEC 60034-12 (design N).

On 60 Hz each has the same power, and the speed, power factor, torques and currents of its circuit with that supply.
Its efficiency is the limit of its class for 60 Hz, or that at 50 Hz if it is higher.

A second table has motors of high slip, 0.75 to 55 kW with 4 and 6 poles, for machines with a flywheel: design D of
NEMA MG 1, of the class with 8 to 13 % slip. Each is the circuit of the motor of its power rewound (all impedances
times one factor) with another resistance of its cage, which has no skin effect. The two give a rated slip of 10 % and
the locked-rotor torque that NEMA MG 1 demands of design D, 2.75 times the rated one. All else of its nameplate is of
this circuit; frame, inertia, mass and locked-rotor time are taken from the next larger motor, as the cage gives
off more heat.

Files of the user have the same columns, see `chainunit.drives.catalogue_rows`; beside motors they may have gears and
couplings (`chainunit.drives.catalogue_gears`, `chainunit.drives.catalogue_couplings`,
`chainunit.drives.catalogue_flexible`).
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from ..core.errors import Faults, InputError, each_refusal, near_name, shown
from ..core.quantities import Layout, Value, declaration, quantity
from ..reading.tables import packaged
from .catalogue_couplings import COUPLINGS, CatalogueCoupling
from .catalogue_flexible import FLEXIBLE, CatalogueFlexible
from .catalogue_gears import GEARS, CatalogueGear
from .catalogue_rows import CatalogueItem, CatalogueKind, Sold, csv_rows, items_in
from .induction_motor import InductionMotor
from .motor import Motor
from .nameplate import Identification, Nameplate, check, identify


@declaration
class CatalogueData(Sold, Nameplate):
    """A nameplate, and the other values of a catalogue."""

    starts: Value = quantity(
        "1",
        "permitted starts direct on line in an hour, without load; 0: unknown",
        default=0.0,
        min=0.0,
        max=1e5,
    )


LAYOUT = Layout(CatalogueData)
MOTOR_KIND = CatalogueKind(
    "motor",
    "motors",
    CatalogueData,
    check,
    (
        {
            "designation": "Made-up 1.5",
            "order_number": "M-1504",
            "source": "made up, as an example of a row",
            "power": "1500",
            "poles": "4",
            "speed": "1445",
            "efficiency": "0.853",
            "power_factor": "0.79",
            "breakdown_ratio": "2.9",
            "locked_torque_ratio": "2.3",
            "locked_current_ratio": "6.2",
            "J": "0.0037",
            "locked_time": "11",
            "mass": "20",
            "price": "310",
        },
    ),
)
STANDARD, HIGH_SLIP = "motors.csv", "high_slip_motors.csv"
"""Files with the packaged motors."""
KINDS = (MOTOR_KIND, GEARS, COUPLINGS, FLEXIBLE)
"""The kinds of things in catalogues."""


@dataclass(frozen=True)
class CatalogueMotor:
    """A motor of the catalogue; `origin` is its file and row, `source` the source of its values."""

    designation: str
    nameplate: CatalogueData
    source: str
    origin: str
    order_number: str = ""

    @property
    def price(self) -> float | None:
        """Its price; None where it is unknown."""
        return float(self.nameplate.price) or None

    @property
    def is_packaged(self) -> bool:
        """Whether it is one of the packaged motors, which nobody sells."""
        return self in packaged_motors()

    def identify(self) -> Identification:
        """The equivalent circuit of the motor; see `chainunit.drives.nameplate.identify`.

        Raises
        ------
        InputError
            in one line, where no circuit meets the nameplate.
        """
        with each_refusal(
            lambda fault: InputError(f"{self.origin}: {self.designation}: {fault}", placed=True)
        ):
            return identify(self.nameplate)

    def model(self) -> tuple[Motor, Any]:
        """The model of the motor, and its parameters.

        Raises
        ------
        InputError
            see `identify`.
        """
        return InductionMotor, self.identify().parameters


@dataclass(frozen=True)
class Offer:
    """All that some catalogues of the user offer."""

    motors: Sequence[CatalogueMotor] = ()
    gears: Sequence[CatalogueGear] = ()
    couplings: Sequence[CatalogueCoupling] = ()
    flexible: Sequence[CatalogueFlexible] = ()


def offer(*files: Path) -> Offer:
    """The motors, gears and couplings of some files (CSV, or TOML if the name ends in .toml), without the packaged
    motors.

    Raises
    ------
    InputError
        with a line for each wrong value: the file, the line, the column, the value and the allowed range.
    """
    items_by_kind = items_in(
        files, KINDS, {MOTOR_KIND.name: {motor.designation for motor in packaged_motors()}}
    )
    return Offer(
        tuple(map(_motor, items_by_kind[MOTOR_KIND.name])),
        tuple(CatalogueGear(**vars(item)) for item in items_by_kind[GEARS.name]),
        tuple(CatalogueCoupling(**vars(item)) for item in items_by_kind[COUPLINGS.name]),
        tuple(CatalogueFlexible(**vars(item)) for item in items_by_kind[FLEXIBLE.name]),
    )


def catalogue(*files: Path) -> list[CatalogueMotor]:
    """The packaged motors without those of high slip, followed by the motors of these files, see `offer`.

    Raises
    ------
    InputError
        see `offer`.
    """
    return [*_packaged(STANDARD), *offer(*files).motors]


def high_slip_motors() -> list[CatalogueMotor]:
    """The packaged motors of high slip."""
    return list(_packaged(HIGH_SLIP))


def packaged_motors() -> list[CatalogueMotor]:
    """All packaged motors."""
    return [*_packaged(STANDARD), *_packaged(HIGH_SLIP)]


def motor_of_catalogue(
    designation: str, files: Sequence[Path] = (), others: Collection[str] = ()
) -> CatalogueMotor:
    """The motor with this `designation`, among the packaged motors and the motors of the `files`; `others` are
    further names to suggest for a misspelled one.

    Raises
    ------
    InputError
        for an unknown designation, in one line with the nearest ones; and see `catalogue`.
    """
    motors = {m.designation: m for m in (*catalogue(*files), *high_slip_motors())}
    if designation not in motors:
        near = difflib.get_close_matches(designation, motors, n=3, cutoff=0.0)
        hint = near_name(designation, (*motors, *others))
        raise InputError(
            f"{shown(designation)}: not in the catalogue; must be one of its designations, such as "
            + ", ".join(f'"{name}"' for name in near)
            + hint
        )
    return motors[designation]


def check_own(files: Sequence[Path]) -> Offer:
    """Read what the files of the user offer and fit a circuit to each motor.

    Raises
    ------
    InputError
        see `catalogue` and `CatalogueMotor.identify`.
    """
    faults, offered = Faults(), offer(*files)
    for motor in offered.motors:
        with faults.collected():
            motor.identify()
    faults.refuse()
    return offered


@cache
def _packaged(name: str) -> tuple[CatalogueMotor, ...]:
    faults = Faults()
    rows = [row for _, kind_rows in csv_rows(packaged(name), name, [MOTOR_KIND], faults) for row in kind_rows]
    motors = MOTOR_KIND.items(rows, (), faults)
    faults.refuse()
    return tuple(map(_motor, motors))


def _motor(item: CatalogueItem) -> CatalogueMotor:
    return CatalogueMotor(item.designation, item.data, item.source, item.origin, item.order_number)
