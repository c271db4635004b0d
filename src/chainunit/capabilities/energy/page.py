"""The section on energy: a year, the power by place and load, and the other motor."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ...core.quantities import Layout
from ...report import blocks as b
from ...report import figure as fig
from ...report.cited import cited, number
from ...report.lines import Line, line
from ...study.record import StudyRecord
from .analysis import EnergyFindings, MotorComparison, Year
from .motor_class import MotorClass, words_of
from .running import PLACES, Losses

PICTURE = "energy.png"


def _titles(study: StudyRecord) -> dict[str, str]:
    """The title of each power; the parts between motor and machine have their noun."""
    return {v.name: v.template for v in Layout(Losses).variables} | {"gear": study.drive.transmission}


def blocks(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """The tables and the figure of the energy."""
    findings = EnergyFindings.of_study(study)
    yield b.Text(_lead(s, findings))
    motor_class = MotorClass.found_in(study)
    if motor_class is not None:
        yield b.Text(words_of(motor_class))
    titles = _titles(study)
    yield _places(s, findings, titles)
    yield _figure(findings, titles)
    yield _year(s, findings)
    if findings.comparison is not None:
        yield b.Text(s.line(verdict_words(findings.comparison)))
    else:
        yield b.Text(f"No other motor is compared: {findings.no_other}.", "note")


def _lead(s: b.Source, findings: EnergyFindings) -> Line:
    text = "The drive takes {energy.own.mean.electric} in the mean, {energy.own.energy} in a year of {energy.running}"
    year = findings.own.year
    if year.energy_per_tonne is not None:
        text += ", {energy.own.energy_per_tonne} a tonne"
    if year.cost is not None:
        text += "; a year costs {energy.own.cost}"
    if year.co2 is not None:
        text += (
            " and stands for {energy.own.co2} of CO2" if year.cost is not None else "; CO2: {energy.own.co2}"
        )
    return s.line(text + ". Its winding, as warm as this duty makes it, is at {energy.own.temperature}.")


def _known(findings: EnergyFindings) -> list[str]:
    return [name for name in PLACES if getattr(findings.own.mean, name) is not None]


def _places(s: b.Source, findings: EnergyFindings, titles: Mapping[str, str]) -> b.Table:
    loads = list(findings.loads)
    paths = ["energy.own.mean", *(f"energy.loads.{name}" for name in loads)]
    rows = [
        b.TableRow((titles[name], *(s.number(f"{path}.{name}") for path in paths)))
        for name in ("electric", *_known(findings), "missing")
    ]
    heads: list[Line] = ["mean"]
    for name in loads:
        path = f"energy.loads.{name}"
        heads.append(
            line(f"{name}: ", s.number(f"{path}.share"), " of the time, feed x ", s.number(f"{path}.factor"))
        )
    return b.Table(tuple(rows), b.heads("", *heads), title="Electric power, and where it goes")


def _year(s: b.Source, findings: EnergyFindings) -> b.Table:
    x = cited(findings, "findings.energy")
    motors = list(filter(None, (findings.own, findings.other)))
    shown = list(filter(None, (x.own, x.other)))
    rows = [
        b.TableRow((v.template, *(number(getattr(motor.year, v.name)) for motor in shown)))
        for v in Layout(Year).variables
        if any(getattr(motor.year, v.name) is not None for motor in motors)
    ]
    for heading, sizes in (
        ("speed of the motor, mean", [number(motor.speed) for motor in shown]),
        ("price of the motor", [number(motor.price) for motor in shown]),
    ):
        rows += [b.TableRow((heading, *sizes))] if any(size.value is not None for size in sizes) else []
    title = s.line("A year, and a life of {=usage.years} years")
    return b.Table(tuple(rows), b.heads("", *(motor.motor for motor in shown)), title=title)


def verdict_words(comparison: MotorComparison) -> str:
    """Which motor takes less, and whether it pays: a text with the paths of its numbers in braces."""
    if not comparison.better:
        return "Both motors take the same energy."
    text = (
        "{energy.comparison.better} takes less: it saves {energy.comparison.saving} a year, "
        "{energy.comparison.saving_share}"
    )
    if comparison.cost_saving is not None:
        text += ", a cost of {energy.comparison.cost_saving} a year"
    if comparison.pays_after is None or comparison.life_saving is None:
        price = "" if comparison.cost_saving is not None else " and price (of a kWh)"
        text += f"; payback: enter motor_price and other_price{price}"
    elif comparison.pays_after <= 0.0:
        text += "; it costs no more than the other, and saves {energy.comparison.life_saving} over the life"
    elif comparison.life_saving >= 0.0:
        text += (
            "; it has paid after {energy.comparison.pays_after} years, and saves {energy.comparison.life_saving} "
            "over the life"
        )
    else:
        text += (
            "; it would have paid after {energy.comparison.pays_after} years, and so does not pay in a life of "
            "{=usage.years} years"
        )
    return text + "."


def _figure(findings: EnergyFindings, titles: Mapping[str, str]) -> fig.Figure:
    names, mean = _known(findings), findings.own.mean
    sizes = [float(getattr(mean, name)) for name in names]
    y = fig.Axis("", names=tuple(titles[name] for name in names))
    bars = fig.Bars("mean over the time of running", list(range(len(names))), sizes, 0.6)
    return fig.Figure(
        "energy",
        "Where the electric power goes",
        "Mean power by place.",
        ((fig.Panel(fig.Axis("mean power", "W", low=0.0), y, (bars,)),),),
        file=PICTURE,
        heights=(0.9,),
    )
