"""The efficiency class of the study's motor, beside the one that EU 2019/1781 asks of it."""

from __future__ import annotations

from ...core.quantities import percentage
from ...reading.results import part, result
from ...study.analysis import Analysis, Findings, Work
from ...study.record import StudyRecord
from ...study.remark import note, warning
from .efficiency_class import EXEMPTIONS, class_of, falls_short, no_class, required


@result
class MotorClass(Findings):
    """Class and efficiency of a motor."""

    designation: str = part("the motor")
    efficiency_class: str = part("its class by IEC 60034-30-1; empty where its limits are not known here")
    required: str = part(
        "the class that EU 2019/1781 asks of it; empty outside of the scope of that regulation"
    )
    falls_short: bool = part("whether its class is below that")
    efficiency: float = percentage("rated efficiency")
    no_class: str = part("the reason why its class is not known here; empty where it is", default="")

    def remark(self, study: StudyRecord) -> None:
        """Warn of a motor that may not be sold any more, and tell where that is not known."""
        if self.no_class and self.required:
            study.findings.say(_NOT_CHECKED, why=self.no_class, asked=self.required)
        if self.falls_short:
            study.findings.say(
                _TOO_LOW,
                motor=self.designation,
                own=self.efficiency_class,
                efficiency=self.efficiency,
                asked=self.required,
            )


_NOT_CHECKED = note(
    "efficiency-class-not-checked",
    "The class of the motor by IEC 60034-30-1 is not checked: {why}. EU 2019/1781 asks {asked}.",
    remedy="Compare its nameplate.",
)
_TOO_LOW = warning(
    "efficiency-class",
    "The motor {motor} is {own} by its efficiency of {efficiency}. EU 2019/1781 asks {asked} of a motor of its size "
    "and poles that has come to the market since July 2023.",
    *EXEMPTIONS,
    remedy="Take a motor of class {asked}.",
    sizes={("1", "percent"): "efficiency"},
)


class MotorClassAnalysis(Analysis):
    """The class of efficiency, if a motor of the catalogue is below the class that is asked for or has no known
    class, or if the study asks for the energy."""

    name = "motor_class"

    @staticmethod
    def find(study: StudyRecord, work: Work) -> MotorClass | None:
        """The class of the motor that the file names, or that was chosen."""
        motor = study.setup.plate
        if motor is None or study.setup.drive.foreign is not None:
            return None
        plate = motor.nameplate
        motor_class = MotorClass(
            motor.designation,
            class_of(plate),
            required(plate),
            falls_short(plate),
            float(plate.efficiency),
            no_class(plate),
        )
        is_asked = motor_class.falls_short or (motor_class.no_class and motor_class.required)
        return motor_class if is_asked or study.setup.config.plans["energy"] is not None else None


def words_of(motor_class: MotorClass) -> str:
    """Class and demand, in a sentence."""
    if motor_class.no_class:
        text = f"The class of the motor by IEC 60034-30-1 is not checked: {motor_class.no_class}."
        demand = f" EU 2019/1781 asks {motor_class.required}: compare its nameplate."
        return text + (demand if motor_class.required else "")
    if not motor_class.required:
        return f"The motor is {motor_class.efficiency_class}; EU 2019/1781 does not cover it."
    verb = "asks" if not motor_class.falls_short else "asks more,"
    return f"The motor is {motor_class.efficiency_class}; EU 2019/1781 {verb} {motor_class.required}."
