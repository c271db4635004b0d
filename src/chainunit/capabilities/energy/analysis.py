"""The energy of a year by place, its cost and CO2, and a second motor over the life of the drive."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ...core.errors import InputError, RunError
from ...core.quantities import Value, declaration, percentage, quantity
from ...drives.catalogue import CatalogueMotor
from ...reading.results import part, result
from ...study.analysis import Analysis, Findings, Work
from ...study.drive import Drive
from ...study.record import StudyRecord
from ...study.remark import fault, note, warning
from ...study.verdict import STEADY
from .duty import LoadDuty, duty_of
from .inverter import apparent_power, typical_losses
from .other_motor import other_motor, with_motor
from .running import InverterRating, Losses
from .table import Usage, UsagePlan

LARGEST_GAP = 0.01
"""Share of the electric power that may be missing in the balance."""
_SPEEDS = 0.05
"""Relative difference of mean speeds up to which two motors have the same duty."""
_ALIKE = 1e-6
"""Relative difference of energies up to which two motors take the same."""
_GIVEN_BACK = 0.01
"""Share of the electric power above which the power that comes back from the motor is worth a remark."""


@declaration
class Year:
    """Energy, cost and CO2 of a year, and of the life of the drive."""

    energy: Value = quantity("J", "energy a year", kind="energy")
    energy_per_tonne: Value = quantity("J", "energy a tonne", kind="energy")
    cost: Value = quantity("1", "cost of energy a year")
    co2: Value = quantity("kg", "CO2 a year")
    life_energy: Value = quantity("J", "energy over the life", kind="energy")
    life_cost: Value = quantity("1", "price of the motor and cost of energy over the life")


@result
class LoadEnergy:
    """A load of the machine in steady running."""

    losses: Losses = part(inline=True)
    share: float = percentage("share of the running time")
    factor: float = quantity("1", "factor on the feed")


@result
class MotorEnergy:
    """The energy that the duty takes with one motor."""

    motor: str = part("the motor")
    year: Year = part(inline=True)
    mean: Losses = part("mean power over the time of running, by place")
    temperature: float = quantity("K", "temperature of the winding in the duty")
    too_hot: bool = part(
        "whether the duty makes the winding hotter than permitted; the energy is that at the limit"
    )
    speed: float = quantity("rad/s", "speed of the motor, mean", kind="speed")
    price: float | None = quantity("1", "price of the motor")


@result
class MotorComparison:
    """The better of two motors, by energy, and what it saves."""

    better: str = part("the motor that takes less energy; empty where both take the same")
    saving: float = quantity("J", "energy that it saves a year", kind="energy")
    saving_share: float = percentage("the same over the energy with the other motor")
    cost_saving: float | None = quantity("1", "cost that it saves a year")
    extra_price: float | None = quantity("1", "price that it costs more")
    pays_after: float | None = quantity("1", "years until it has paid; 0 where it costs no more")
    life_saving: float | None = quantity(
        "1", "cost that it saves over the life, after its price; negative where it does not pay"
    )


@result
class EnergyFindings(Findings):
    """The energy of the study's motor, by load; the other motor, where there is one, and the comparison of both."""

    own: MotorEnergy = part("the motor of the study")
    loads: Mapping[str, LoadEnergy] = part("its loads, by name")
    running: float = quantity("s", "time of running a year", kind="hours")
    other: MotorEnergy | None = part("the other motor")
    comparison: MotorComparison | None = part("the better of both motors")
    inverter: str = part("the source of the losses of the inverter; empty without one")
    no_other: str = part("the reason why no other motor is compared; empty where one is")
    given_back: float = quantity("W", "mean power that the motor gives back at moments")

    @property
    def gear_loss(self) -> float | None:
        """That of a load with the feed of the study."""
        return next((load.losses.gear for load in self.loads.values() if load.factor == 1.0), None)

    def remark(self, study: StudyRecord) -> None:
        """The assumptions behind the losses."""
        mean = self.own.mean
        for motor in filter(None, (self.own, self.other)):
            if motor.too_hot:
                study.findings.say(_TOO_HOT, motor=motor.motor, limit=motor.temperature)
        if abs(mean.missing) > LARGEST_GAP * abs(mean.electric):
            study.findings.say(_BALANCE, STEADY, missing=mean.missing, electric=mean.electric)
        study.findings.say(_IRON)
        if mean.gear and any(load.factor != 1.0 for load in self.loads.values()):
            study.findings.say(_GEAR, gear=study.setup.drive.transmission)
        if self.inverter:
            study.findings.say(_INVERTER, losses=self.inverter)
        elif study.setup.drive.follows:
            study.findings.say(_CONVERTER)
        if study.setup.drive.follows and self.given_back > _GIVEN_BACK * mean.electric:
            study.findings.say(_COMES_BACK, back=self.given_back)


_TOO_HOT = warning(
    "energy-of-a-winding-too-hot",
    "With the loads of [usage] the winding of {motor} would get hotter than the permitted {limit}. Its energy is "
    "the one at this temperature, and too low.",
    remedy="Take a larger motor, or lower usage.load.factor.",
    sizes={("K", "temperature"): "limit"},
)
_BALANCE = fault(
    "energy-balance",
    "{missing} of the electric power of {electric} are missing in the sum of the losses by place.",
    remedy="Raise run.settle_turns, or take a shorter run.step.",
    sizes={"W": "missing electric"},
)
_IRON = note(
    "losses-in-iron",
    "The model of the motor has no separate losses in iron and no stray losses. The windings of a motor of the "
    "catalogue are fitted so that their losses include them at rated load. At light load a real motor loses more.",
)
_GEAR = note(
    "gear-at-other-loads",
    "At each load the loss of the {gear} is the one with the feed of the study. With less feed it is less than the "
    "table says, with more feed it is more.",
)
_INVERTER = note("losses-of-the-inverter", "The losses of the inverter are {losses}.")
_CONVERTER = note(
    "losses-of-the-converter",
    "The losses of the converter are not known, as the motor has no nameplate. They come on top.",
)
_COMES_BACK = note(
    "power-that-comes-back",
    "In parts of the turn the motor gives back {back} in the mean. Here this power counts as saved. An inverter "
    "with a diode bridge stores it as far as its intermediate circuit is large enough, and turns the rest into heat "
    "in a braking resistor.",
    sizes={"W": "back"},
)
_NOT_KNOWN = fault(
    "energy-not-known",
    "The drive does not run steadily with {loads}, so that no mean power stands for a year.",
    remedy="Raise run.settle_turns, or see the other warnings.",
)


class EnergyAnalysis(Analysis):
    """The energy of a study with a table [usage]."""

    name = "energy"
    needs_runs = True
    applies = staticmethod(lambda drive, plans: plans["energy"] is not None and drive.foreign is None)

    @staticmethod
    def find(study: StudyRecord, work: Work) -> EnergyFindings | None:
        """Run the loads, with both motors; None where one of them has no steady running.

        Raises
        ------
        RunError
            where a run fails.
        """
        return _Task(study, work, study.setup.config.plans["energy"]).find()


@dataclass(frozen=True)
class _Task:
    study: StudyRecord
    work: Work
    plan: UsagePlan

    def find(self) -> EnergyFindings | None:
        """The energy of the motor of the study and of the other one; None where a load is not steady."""
        drive, motor = self.study.setup.drive, self.study.setup.plate
        inverter = self._inverter(drive, motor)
        duty = self._duty(drive, inverter, "")
        if duty.unsteady:
            self.study.findings.say(_NOT_KNOWN, loads=", ".join(duty.unsteady))
            return None
        price = _price(self.plan.table.motor_price, motor)
        energy = self._energy(duty, motor.designation if motor else "the motor of the study", price)
        other, no_other = self._other(drive, motor, duty)
        return EnergyFindings(
            own=energy,
            loads={
                name: LoadEnergy(run.losses, duty.shares[name], float(self.plan.loads[name].factor))
                for name, run in duty.runs.items()
            },
            running=self.plan.running,
            other=other,
            comparison=None if other is None else compared(energy, other),
            inverter=self._inverter_words() if inverter else "",
            no_other=no_other,
            given_back=duty.given_back,
        )

    def _duty(self, drive: Drive, inverter: InverterRating | None, suffix: str) -> LoadDuty:
        """The runs of the loads with a drive; `suffix` follows their names in the progress."""
        steady = self.study.runs.answers[STEADY].winding_temperature
        usual = drive.parameters.ambient.T if steady is None else steady
        # a duty with the feed of the study is its steady running
        full = all(load.factor == 1.0 for load in self.plan.loads.values())
        is_steady = full and steady is not None and drive is self.study.setup.drive

        def progress(name: str) -> None:
            self.work.progress(f"energy: {name}{suffix}", 0.0, 1.0)

        hottest = self.study.setup.config.permitted_temperature[1]
        return duty_of(self.work.rig, drive, self.plan.loads, inverter, usual, hottest, progress, is_steady)

    def _inverter(self, drive: Drive, motor: CatalogueMotor | None) -> InverterRating | None:
        """The losses of an inverter for the motor, by the file or typical; None on the line."""
        if not drive.follows or motor is None:
            return None
        power = motor.nameplate.power
        shares = self.plan.inverter_losses
        losses = tuple(apparent_power(power) * x for x in shares) if shares else typical_losses(power)
        return InverterRating(losses, motor.nameplate)

    def _inverter_words(self) -> str:
        """Where the losses of the inverter come from."""
        if self.plan.inverter_losses:
            return "interpolated between the eight operating points of IEC 61800-9-2 that usage.inverter_losses gives"
        return (
            "interpolated between the eight operating points of IEC 61800-9-2 of a drive of this size at the limit "
            "of class IE2, which every drive on the market has to keep (three quarters of the losses of the "
            "reference drive). The data sheet of the inverter has its own (usage.inverter_losses)"
        )

    def _other(
        self, drive: Drive, motor: CatalogueMotor | None, study_duty: LoadDuty
    ) -> tuple[MotorEnergy | None, str]:
        """The energy with the other motor beside the `study_duty`, or the reason why there is none."""
        if motor is None:
            return None, "the motor has no nameplate"
        try:
            other = other_motor(motor, self.plan.other, self.study.setup.config.file.catalogues)
            if other is None:
                return (
                    None,
                    "the motor has no efficiency class, or the highest one; usage.other names another motor",
                )
            with_it = with_motor(drive, self.study.setup.config.drive, other)
            duty = self._duty(with_it, self._inverter(with_it, other), f", {other.designation}")
        except (InputError, RunError) as error:
            return None, f"the other motor could not be run: {error}"
        if duty.unsteady:
            return None, f"{other.designation} does not run steadily with {', '.join(duty.unsteady)}"
        speeds = duty.mean(drive.motor_speed) / study_duty.mean(drive.motor_speed)
        if abs(speeds - 1.0) > _SPEEDS:
            return None, (
                f"with {other.designation} behind the same gear the crank turns at {speeds:.3g} times the speed, "
                "which is another duty; name a motor of the same number of poles in usage.other"
            )
        return self._energy(duty, other.designation, _price(self.plan.table.other_price, other)), ""

    def _energy(self, duty: LoadDuty, name: str, price: float | None) -> MotorEnergy:
        """Energy and cost of a year with a motor that runs this duty."""
        losses = duty.losses
        year = year_of(self.plan, float(losses.electric), price)
        speed = duty.mean(self.study.setup.drive.motor_speed)
        return MotorEnergy(name, year, losses, duty.temperature, duty.is_too_hot, speed, price)


def _price(price: float, motor: CatalogueMotor | None) -> float | None:
    """The price that the file gives, or else the catalogue; None where neither does."""
    return float(price) or (motor.nameplate.price if motor else 0.0) or None


def year_of(plan: UsagePlan, power: float, price: float | None) -> Year:
    """Energy and cost of a year with that mean electric `power` [W], for a motor of that `price`, if it is known."""
    table: Usage = plan.table
    energy, years = power * plan.running, float(table.years)
    tonnes = float(table.tonnes_per_hour) * plan.running / 3600.0
    kWh = energy / 3.6e6
    cost = kWh * float(table.price) if table.price else None
    return Year(
        energy=energy,
        energy_per_tonne=energy / tonnes if tonnes else None,
        cost=cost,
        co2=kWh * float(table.co2) if table.co2 else None,
        life_energy=years * energy,
        life_cost=None if cost is None or price is None else price + years * cost,
    )


def compared(energy: MotorEnergy, other: MotorEnergy) -> MotorComparison:
    """The comparison of two motors with the same duty."""
    better, worse = sorted((energy, other), key=lambda motor: float(motor.year.energy))
    saving = worse.year.energy - better.year.energy
    cost = _difference(worse.year.cost, better.year.cost)
    extra = _difference(better.price, worse.price)
    share = saving / worse.year.energy
    if share < _ALIKE:
        return MotorComparison("", 0.0, 0.0, cost, extra, None, None)
    pays = None if not cost or extra is None else max(0.0, extra / cost)
    life = _difference(worse.year.life_cost, better.year.life_cost)
    return MotorComparison(better.motor, saving, share, cost, extra, pays, life)


def _difference(larger: float | None, smaller: float | None) -> float | None:
    """`larger` less `smaller`; None where one of them is not known."""
    return None if larger is None or smaller is None else larger - smaller
