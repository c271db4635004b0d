"""The section on energy: a year, the power by place and load, and the other motor."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ...core.quantities import Layout
from ...report import blocks as b
from ...report import figure as fig
from ...report.cited import cited, exact, number
from ...report.lines import Line, Number, filled, line
from ...study.record import StudyRecord
from .analysis import EnergyFindings, MotorComparison, Year
from .motor_class import MotorClass, words_of
from .running import PLACES, Losses

PICTURE = "energy.png"


def blocks(study: StudyRecord) -> Iterator[b.Block]:
    """The tables and the figure of the energy."""
    findings = EnergyFindings.of_study(study.findings)
    x = cited(findings, "findings.energy")
    years = exact(cited(study.setup.config.table("usage"), "given.usage").years)
    yield b.Text(_lead(findings, x))
    if (motor_class := MotorClass.found_in(study.findings)) is not None:
        yield b.Text(words_of(motor_class))
    # the parts between motor and machine have their noun
    titles = {v.name: v.template for v in Layout(Losses).variables} | {"gear": study.setup.drive.transmission}
    yield _places(findings, x, titles)
    yield _figure(findings, titles)
    yield _year(findings, x, years)
    if findings.comparison is not None and x.comparison is not None:
        yield b.Text(verdict(findings.comparison, x.comparison, years))
    else:
        yield b.Text(f"No other motor is compared: {findings.no_other}.", "note")


def _lead(findings: EnergyFindings, x: EnergyFindings) -> Line:
    """Mean power, energy, cost and CO2 of a year, as far as they are known, and the temperature of the winding."""
    text, year, shown = "The drive takes {} in the mean, {} in a year of {}", findings.own.year, x.own.year
    sizes = [number(x.own.mean.electric), number(shown.energy), number(x.running)]
    if year.energy_per_tonne is not None:
        text, sizes = text + ", {} a tonne", [*sizes, number(shown.energy_per_tonne)]
    if year.cost is not None:
        text, sizes = text + "; a year costs {}", [*sizes, number(shown.cost)]
    if year.co2 is not None:
        text += " and stands for {} of CO2" if year.cost is not None else "; CO2: {}"
        sizes.append(number(shown.co2))
    text += ". Its winding, as warm as this duty makes it, is at {}."
    return filled(text, *sizes, number(x.own.temperature))


def _known(findings: EnergyFindings) -> list[str]:
    """The names of the powers that are known."""
    return [name for name in PLACES if getattr(findings.own.mean, name) is not None]


def _places(findings: EnergyFindings, x: EnergyFindings, titles: Mapping[str, str]) -> b.Table:
    """A row for each power, from electric to the machine; a column for the mean and for each load."""
    columns = [x.own.mean, *(load.losses for load in x.loads.values())]
    rows = [
        b.TableRow((titles[name], *(number(getattr(losses, name)) for losses in columns)))
        for name in ("electric", *_known(findings), "missing")
    ]
    heads = (
        filled("{}: {} of the time, feed x {}", name, number(load.share), number(load.factor))
        for name, load in x.loads.items()
    )
    return b.Table(tuple(rows), b.heads("", "mean", *heads), title="Electric power, and where it goes")


def _year(findings: EnergyFindings, x: EnergyFindings, years: Number) -> b.Table:
    """The numbers of a year for the motor of the study and, if there is one, the other motor."""
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
    title = filled("A year, and a life of {} years", years)
    return b.Table(tuple(rows), b.heads("", *(motor.motor for motor in shown)), title=title)


def verdict(comparison: MotorComparison, x: MotorComparison, years: Number) -> Line:
    """Which motor takes less, and whether it pays in a life of so many `years`."""
    if not comparison.better:
        return "Both motors take the same energy."
    text = filled("{} takes less: it saves {} a year, {}", x.better, number(x.saving), number(x.saving_share))
    if comparison.cost_saving is not None:
        text = filled("{}, a cost of {} a year", text, number(x.cost_saving))
    after, saved = number(x.pays_after), number(x.life_saving)
    if comparison.pays_after is None or comparison.life_saving is None:
        price = "" if comparison.cost_saving is not None else " and price (of a kWh)"
        return line(text, f"; payback: enter motor_price and other_price{price}.")
    if comparison.pays_after <= 0.0:
        return filled("{}; it costs no more than the other, and saves {} over the life.", text, saved)
    if comparison.life_saving >= 0.0:
        return filled("{}; it has paid after {} years, and saves {} over the life.", text, after, saved)
    late = "{}; it would have paid after {} years, and so does not pay in a life of {} years."
    return filled(late, text, after, years)


def _figure(findings: EnergyFindings, titles: Mapping[str, str]) -> fig.Figure:
    """Bars of the mean power by place."""
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
