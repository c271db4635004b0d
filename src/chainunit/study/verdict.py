"""Whether the model of the organs holds for a machine at its speed: a rule on numbers, and its words.

Two bars are a good model of a chain as long as no bar is pushed and the crank turns well below the lowest
natural frequency of the chain. Only the energy balance is judged for a machine whose links are not known. A
capability that brings another model brings its verdict, too.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Set
from dataclasses import field, replace
from typing import Literal, NamedTuple

from ..core.descriptions import USUAL_DRIVER
from ..core.quantities import quantity
from ..machines.chain_unit import RodName
from ..reading.results import OWN, derived, part, result
from ..reading.text import number
from .organ_limits import LeastPull, passed_limits, speed_limits
from .remark import Remark, RemarkCode, fault, warning

RESIDUAL = 1e-3
"""Energy residual, relative to the energy moved, up to which a run counts as right."""
BARS = "two bars"
"""The papers' model of an organ."""
STEADY = "steady"
"""Run of normal running; if the model fails in it, the model does not hold at all."""
START = "start_up"
"""Run from rest to normal running, or to the coming of the feed."""
SETTLING = "settling"
"""Run of a machine that starts empty, from the coming of its feed to normal running."""

Holds = Literal["true", "in part", "false"]
Subject = Literal["organs", "machine", "energy balance"]
"""The subject of the verdict: the model of the organs, the model of the machine, or only the energy balance,
for a machine whose own model is not known."""
_SUBJECTS: Mapping[Subject, str] = {
    "organs": "Model of the organs, {}",
    "machine": "Model of the machine, {}",
    "energy balance": "Energy balance of a machine that is an FMU",
}
_HOLDS: Mapping[Holds, str] = {"true": "valid", "in part": "valid in steady running{}", "false": "not valid"}
_BARS_IN_PART = " for crank torque and motor (10 %)"


class Topic(NamedTuple):
    """A kind of fault: its words in the verdict, the remark with its numbers, and its remedy in the verdict."""

    short: str
    remark: RemarkCode
    remedy: str = ""


_FINER = "{finer}"
"""In place of a remedy: the model that is good where two bars are not, see `Verdict.finer`."""
TOPICS: Mapping[str, Topic] = {
    "pushed": Topic(
        "bars are in compression, where a chain goes slack: rocker torque and organ forces are no predictions",
        fault("model-pushed", "Bars in compression, where a chain goes slack: {where}."),
        _FINER,
    ),
    "end pushed": Topic(
        "bar ends are in compression, where a chain sags",
        warning(
            "model-end-pushed",
            "Bar ends in compression, where a chain sags (force in that pin, hardly the torques): {where}.",
        ),
    ),
    "slack speed": Topic(
        "the crank turns faster than the speed at which a web goes slack",
        fault("model-slack-speed", "A web goes slack from a crank speed of {limit} on{where}."),
        _FINER,
    ),
    "crank torque": Topic(
        "the torques of rocker and crank may be off by more than 10 %, as a chain resonates",
        fault(
            "model-crank-torque",
            "Crank torque of two bars: 10 % up to a crank speed of {limit}, rocker torque less far{where}.",
        ),
        _FINER,
    ),
    "rocker torque": Topic(
        "the rocker torque may be off by more than 10 %, as a chain resonates",
        warning(
            "model-rocker-torque", "Rocker torque of two bars: 10 % up to a crank speed of {limit}{where}."
        ),
        _FINER,
    ),
    "energy": Topic(
        "the energy balance is not kept",
        fault(
            "model-energy",
            "Energy residual over the energy moved (above the limit a run counts as wrong): {where}.",
        ),
        "shorten run.step",
    ),
}
"""By kind of fault, its words."""
_SLACK_AT_REST = fault("model-slack-at-rest", "A web is slack at rest already{where}.")


@result
class Reason:
    """A quantity that exceeds a limit of the model. `topic` is the key of its words; `run` is the run in
    which it does (empty for the machine itself, at its crank speed)."""

    topic: str = part("kind of fault")
    quantity: str = part("the quantity")
    value: float = part("its value", unit=OWN)
    limit: float = part("its limit", unit=OWN)
    unit: str
    run: str = part("the run; empty for the machine itself", default="")
    kind: str = ""
    grave: bool = False
    """whether it makes every number of normal running wrong"""
    rod: str = ""
    """the kind of rod that is pushed"""
    place: str | None = part("the pin at which it is, if it is at one", default=None)

    @property
    def numbers(self) -> str:
        """The value in words, with the limit if that is not 0, which the words of the topic give."""
        rod = f"{self.rod} {'mean' if self.topic == 'pushed' else 'end'} pull " if self.rod else ""
        rod += f"at {self.place} " if self.place else ""
        value, limit = (number(x, self.unit, self.kind, beside=False) for x in (self.value, self.limit))
        return f"{rod}{value}{f', limit {limit}' if self.limit else ''}"


@result
class Verdict:
    """Whether the model holds, and the reasons where it does not, or not everywhere."""

    subject: Subject = part("the judged model")
    model: str | None = part(
        "the model in words: of the organs of a chain unit, or of the links of another machine, if it is known"
    )
    speed: float = quantity("rad/s", "crank speed at which the model is judged", kind="speed")
    reasons: tuple[Reason, ...] = part("the limits that are exceeded", default=())
    actual: float | None = None
    """crank speed in the runs [rad/s], if the model is judged at the requested speed instead; else None"""
    driver: str = USUAL_DRIVER
    """the noun of the link that the motor turns"""
    step: float | None = None
    """communication step of the runs [s]; None where it is not known"""
    finer: str = ""
    """the remedy where two bars are no model of the organs; empty where there is none"""
    topics: Mapping[str, Topic] = field(default_factory=lambda: TOPICS)
    """by kind of fault, its words"""
    titles: Mapping[str, str] = field(default_factory=dict)
    """the titles of runs that only this verdict knows"""

    @derived()
    def holds(self) -> Holds:
        """ "false" where the numbers of normal running are wrong, "in part" where those of an overload or some
        numbers are."""
        if not self.reasons:
            return "true"
        return "false" if any(reason.grave for reason in self.reasons) else "in part"

    @property
    def _stalls(self) -> bool:
        """Whether the crank hardly turns."""
        return self.actual is not None and abs(self.actual) < CREEPS * self.speed

    @property
    def _shorter(self) -> str:
        """The step of the runs with which the energy balance is kept, to follow the words on it; empty where it is
        not known. The residual falls with the square of the step at least."""
        worst = max((r.value for r in self.reasons if r.topic == "energy"), default=math.nan)
        if self.step is None or not RESIDUAL <= worst < 4.0**_HALVINGS * RESIDUAL:
            return ""
        halvings = math.floor(math.log(worst / RESIDUAL, 4.0)) + 1
        return f': run.step = "{1e3 * self.step / 2.0**halvings:.3g} ms"'

    def without_acceleration(self) -> Verdict:
        """The same on runs whose balance no shorter step closes, as the acceleration of the motor is not known."""
        energy = self.topics["energy"]._replace(
            remedy="give the acceleration a of the motor (system.motor_names)"
        )
        return replace(self, step=None, topics={**self.topics, "energy": energy})

    @derived()
    def caveat(self) -> str | None:
        """Words to add to results of a model that does not hold; None where it holds, or holds in part."""
        if self.holds != "false":
            return None
        return (
            f"for {self.model}, which do not hold here"
            if self.model
            else "the energy balance does not hold here"
        )

    @derived()
    def text(self) -> str:
        """The verdict in a line."""
        holds = _HOLDS[self.holds].format(_BARS_IN_PART if self.model == BARS else "")
        if self._stalls and self.holds != "false":
            holds = f"would be {holds} if the {self.driver} turned"
        judged, turns = _speed(self.speed), _speed(shown_speed(self.reached, self.speed))
        line = f"{_SUBJECTS[self.subject].format(self.model)}, {self.driver} at {turns}"
        line += "" if turns == judged else f", judged at the required {judged}"
        why, remedies = [], []
        for topic, (short, _, remedy) in self.topics.items():
            runs = {reason.run for reason in self.reasons if reason.topic == topic}
            if runs:
                why.append(_where(runs) + short)
                remedy = remedy.format(finer=self.finer)
                # a crank that hardly turns moves no energy that a residual could be compared with
                remedy += self._shorter if topic == "energy" else ""
                remedies.append("" if topic == "energy" and self._stalls else remedy)
        # a remedy for several faults is named once
        remedy = "; ".join(dict.fromkeys(filter(None, remedies)))
        remedy = remedy[:1].upper() + remedy[1:]
        limits = f"{'Limits' if self.holds == 'in part' else 'Reason'}: {'; '.join(why)}" if why else ""
        return ". ".join(filter(None, (f"{line}: {holds}", limits, remedy))) + "."

    def details(self, titles: Mapping[str, str]) -> list[Remark]:
        """A remark for each topic with reasons: the runs, by their `titles`, with their numbers; runs beyond a limit
        of the crank speed have a remark for each limit instead."""
        remarks, titles = [], {**titles, **self.titles}
        for topic, (_, code, _) in self.topics.items():
            numbers_by_run: dict[str, list[str]] = {}
            runs_by_limit: dict[float, list[str]] = {}
            for reason in self.reasons:
                if reason.topic == topic and reason.quantity == "crank_speed":
                    runs_by_limit.setdefault(reason.limit, []).append(reason.run)
                elif reason.topic == topic:
                    numbers_by_run.setdefault(reason.run, []).append(reason.numbers)
            for limit, runs in runs_by_limit.items():
                where = "; ".join(titles.get(run, run) for run in runs if run)
                remarks.append(on_limit(topic, limit, where and f": {where}"))
            places = []
            for run, sizes in numbers_by_run.items():
                numbers = ", ".join(sizes)
                # a number of no run stands alone
                places.append(f"{titles.get(run, run)} ({numbers})" if run else numbers)
            if places:
                remarks.append(code.remark(where="; ".join(places)))
        return remarks

    @derived("rad/s", "speed")
    def reached(self) -> float:
        """Crank speed in the runs."""
        return self.speed if self.actual is None else self.actual


_HALVINGS = 3
"""Halvings of the step of the runs up to which the verdict names a shorter one."""
CREEPS = 0.5
"""Share of the requested speed below which a machine counts as standing."""
_STANDS = 1e-3
"""Share of the requested speed below which a speed is shown as 0."""


def shown_speed(speed: float, requested: float) -> float:
    """A speed of the crank as a sentence gives it [rad/s]: 0 for a crank that stands."""
    return speed if abs(speed) >= _STANDS * requested else 0.0


def _speed(speed: float) -> str:
    return number(speed, "rad/s", "speed", beside=False)


def on_limit(topic: str, limit: float, where: str = "") -> Remark:
    """The remark on a crank speed beyond its `limit` [rad/s]; `where` are its runs in words."""
    at_rest = topic == "slack speed" and limit == 0.0
    return (_SLACK_AT_REST if at_rest else TOPICS[topic].remark).remark(limit=_speed(limit), where=where)


def at_speed(topic: str, speed: float, limit: float, run: str = "", grave: bool = False) -> Reason:
    """A crank speed [rad/s] that passes a limit."""
    return Reason(topic, "crank_speed", speed, limit, "rad/s", run, "speed", grave)


def _where(runs: Set[str]) -> str:
    """The begin of a clause on the runs; empty where only the machine itself is meant."""
    if "" in runs:
        return ""
    if STEADY in runs:
        return "in steady running, too, " if runs - {STEADY} else "in steady running "
    places = ["the start-up"] if START in runs else []
    places += ["the settling under the feed"] if SETTLING in runs else []
    places += ["overloads"] if set(runs) - {START, SETTLING} else []
    return f"in {', '.join(places[:-1])}{' and in ' if places[1:] else ''}{places[-1]} "


def two_bars(
    speed: float,
    mode: float,
    slack_speed: float,
    pulls: Mapping[str, Mapping[RodName, LeastPull]],
    residuals: Mapping[str, float],
    *,
    empty: Collection[str] = (),
    actual: float | None = None,
    finer: str = "",
) -> Verdict:
    """The verdict on two bars an organ.

    Parameters
    ----------
    speed : crank speed at which the model is judged [rad/s]
    mode : lowest natural frequency of an organ as a chain [rad/s], infinite where there is none
    slack_speed : crank speed at which a web first goes slack [rad/s], infinite where none does
    pulls : by run and kind of rod, the least pulls [N]. A rod whose mean pull is negative is pushed, and a chain
        would be slack; a rod of which only an end is pushed is told with its pin.
    residuals : by run, the energy residual over the energy moved
    empty : runs in which a side carries no material; "" stands for all runs
    actual : crank speed in the runs, if that is another [rad/s]
    finer : see `Verdict`
    """
    reasons = []
    for run, rods in pulls.items():
        for rod, pull in rods.items():
            if pull.mean < 0.0:
                reasons.append(
                    Reason(
                        "pushed", f"{rod}_mean_pull", pull.mean, 0.0, "N", run, rod=rod, grave=run == STEADY
                    )
                )
            elif pull.end < 0.0:
                reasons.append(
                    Reason("end pushed", f"{rod}_pull", pull.end, 0.0, "N", run, rod=rod, place=pull.pin)
                )
    passed = passed_limits(speed_limits(slack_speed, mode), speed)
    reasons += [at_speed(limit.topic, speed, limit.speed, grave=limit.grave) for limit in passed]
    if all(limit.topic == "slack speed" for limit in passed):
        runs = [""] if "" in empty else sorted(empty)
        of_empty = passed_limits(speed_limits(math.inf, mode, empty=True), speed)
        reasons += [at_speed(limit.topic, speed, limit.speed, run) for limit in of_empty for run in runs]
    return Verdict("organs", BARS, speed, (*reasons, *balance_faults(residuals)), actual, finer=finer)


def balance_faults(residuals: Mapping[str, float]) -> tuple[Reason, ...]:
    """The runs, by their energy residual over the energy moved, whose balance is not kept."""
    return tuple(
        Reason("energy", "energy_residual", share, RESIDUAL, "1", run, grave=run == STEADY)
        for run, share in residuals.items()
        # a balance of NaN is not kept either
        if not share < RESIDUAL
    )
