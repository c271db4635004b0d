"""Whether the model of the organs holds for a machine at its speed: a rule on numbers, and its words.

Two bars hold a chain's place as long as neither is pushed and the crank turns well below the chain's lowest natural
frequency. Chains hold as long as their energy balance does, no rod folds through its stop, and peaks do not depend on
the start.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from ..text import entry, number

ROCKER_GOOD, ROCKER_GOOD_EMPTY, CRANK_GOOD = 0.4, 0.2, 0.6
"""Crank speeds, in parts of the organ's lowest natural frequency, up to which two bars give the rocker torque
(loaded, with an empty side) and the crank torque to a tenth of the peak of chains: on the packaged machine, see
docs/physics.md."""
RESIDUAL = 1e-3
"""Energy residual, in parts of the energy moved, up to which a run is taken for right."""
STEADY = "steady"
"""Run of normal running; what spoils it leaves nothing that the model is good for."""

TWO_BARS = "two bars"

Holds = Literal["true", "in part", "false"]

_TOPICS = {
    "pushed": (
        "bars are pushed, where a chain would go slack and snatch",
        "Bars that are pushed, where a chain would go slack and snatch",
    ),
    "slack speed": (
        "the crank turns faster than the speed at which a web goes slack",
        "Crank speed at which a web is slack",
    ),
    "crank torque": (
        "the torques of rocker and crank may be off by more than 10 %, as a chain resonates",
        "Crank speed above that up to which two bars give the crank torque to 10 %, and the rocker torque not even "
        "there",
    ),
    "rocker torque": (
        "the rocker torque may be off by more than 10 %, as a chain resonates",
        "Crank speed above that up to which two bars give the rocker torque to 10 %",
    ),
    "energy": (
        "the energy balance is not kept",
        "Energy residual over the energy moved, so large that run.step is too long",
    ),
    "folded through": (
        "rods fold through their stop",
        "Rods that fold through their stop; raise chain.fold_stiffness, or take it for a machine that breaks",
    ),
    "folded": (
        "rods meet the stop between them, whose stiffness is assumed",
        "Rods that fold and meet the stop between them",
    ),
    "slack": (
        "rods go slack and snatch: a single peak is no prediction",
        "Share of the time with a slack rod; what snatches has no single peak that is a prediction",
    ),
    "starts": (
        "starts differ: the quantile of peaks is not told",
        "Turns that count as independent are too few for the quantile, as starts differ; raise chain.starts",
    ),
}
"""What may be wrong: in short for the verdict, and as the begin of a line with the numbers."""


@dataclass(frozen=True)
class Reason:
    """A quantity that passes a limit of the model. `topic` is a key of the words, `run` where it does ("" for the
    machine itself, at its crank speed)."""

    topic: str
    quantity: str
    value: float
    limit: float
    unit: str
    run: str = ""
    kind: str = ""
    grave: bool = False
    """whether it spoils every number of normal running"""

    @property
    def numbers(self) -> str:
        """Its value in words, and the limit where the words of the topic do not say it."""
        rod = {"web_pull": "web ", "wall_pull": "wall "}.get(self.quantity, "")
        said = self.topic in ("pushed", "slack")
        limit = "" if said else f", limit {number(self.limit, self.unit, self.kind)}"
        return f"{rod}{number(self.value, self.unit, self.kind)}{limit}"


@dataclass(frozen=True)
class Verdict:
    """Whether the model holds, and the reasons where it does not, or not everywhere."""

    organ: str
    """the model of the organs in words"""
    speed: float
    """of the crank [rad/s]"""
    reasons: tuple[Reason, ...] = ()

    @property
    def holds(self) -> Holds:
        """False where normal running is spoiled; in part where an overload or some of the numbers are."""
        if not self.reasons:
            return "true"
        return "false" if any(reason.grave for reason in self.reasons) else "in part"

    @property
    def text(self) -> str:
        """The verdict in a line."""
        holds = {"true": "holds", "in part": "holds in part", "false": "does not hold"}[self.holds]
        line = f"The model of the organs {holds}: {self.organ}, the crank at {number(self.speed, 'rad/s')}"
        why = []
        for topic, (short, _) in _TOPICS.items():
            runs = {reason.run for reason in self.reasons if reason.topic == topic}
            if runs:
                where = (
                    "" if "" in runs else ", in steady running, too" if STEADY in runs else ", in overloads"
                )
                why.append(short + where)
        remedy = ['organ = "chain" has chains'] if why and self.organ == TWO_BARS else []
        return "; ".join((line, *why, *remedy)) + "."

    def details(self, called: Mapping[str, str]) -> list[str]:
        """A line for each topic: the runs, by what they are `called`, with their numbers."""
        lines = []
        for topic, (_, begin) in _TOPICS.items():
            runs: dict[str, list[str]] = {}
            for reason in self.reasons:
                if reason.topic == topic:
                    runs.setdefault(reason.run, []).append(reason.numbers)
            each = [
                f"{called.get(run, run)} ({', '.join(sizes)})" if run else ", ".join(sizes)
                for run, sizes in runs.items()
            ]
            if each:
                lines.append(f"{begin}: {'; '.join(each)}.")
        return lines

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON."""
        return {
            "organ": self.organ,
            "holds": self.holds,
            "text": self.text,
            "speed": entry(self.speed, "rad/s"),
            "reasons": [
                {
                    "topic": r.topic,
                    "quantity": r.quantity,
                    "run": r.run,
                    "value": entry(r.value, r.unit, r.kind),
                    "limit": entry(r.limit, r.unit, r.kind),
                }
                for r in self.reasons
            ],
        }


def two_bars(
    speed: float,
    mode: float,
    slack_speed: float,
    pulls: Mapping[str, tuple[float, float]],
    residuals: Mapping[str, float],
    *,
    empty: Collection[str] = (),
) -> Verdict:
    """The verdict on two bars an organ.

    Parameters
    ----------
    speed : of the crank [rad/s]
    mode : lowest natural frequency of an organ as a chain [rad/s], infinite where there is none
    slack_speed : crank speed at which a web first goes slack [rad/s], infinite where none does
    pulls : by run, the least pull in a web and in a wall [N], negative where it is pushed
    residuals : by run, the energy residual over the energy moved
    empty : runs in which a side carries no material, "" where it is so in all
    """
    reasons = [
        Reason("pushed", name, pull, 0.0, "N", run, grave=run == STEADY)
        for run, both in pulls.items()
        for name, pull in zip(("web_pull", "wall_pull"), both, strict=True)
        if pull < 0.0
    ]
    if speed >= slack_speed:
        reasons.append(Reason("slack speed", "crank_speed", speed, slack_speed, "rad/s", grave=True))
    if speed > CRANK_GOOD * mode:
        reasons.append(Reason("crank torque", "crank_speed", speed, CRANK_GOOD * mode, "rad/s", grave=True))
    elif speed > ROCKER_GOOD * mode:
        reasons.append(Reason("rocker torque", "crank_speed", speed, ROCKER_GOOD * mode, "rad/s"))
    elif speed > ROCKER_GOOD_EMPTY * mode:
        limit = ROCKER_GOOD_EMPTY * mode
        runs = [""] if "" in empty else sorted(empty)
        reasons += [Reason("rocker torque", "crank_speed", speed, limit, "rad/s", run) for run in runs]
    return Verdict(TWO_BARS, speed, (*reasons, *_unbalanced(residuals)))


def chains(
    speed: float,
    residuals: Mapping[str, float],
    folds: Mapping[str, float],
    fold_limit: float,
    slack: Mapping[str, float],
    independent: float,
    needed: float,
) -> Verdict:
    """The verdict on organs as chains.

    Parameters
    ----------
    speed : of the crank [rad/s]
    residuals, folds, slack : by run, the energy residual over the energy moved, the largest angle between two rods
        [rad], the share of the time with a slack rod
    fold_limit : angle from which two rods meet the stop between them [rad]
    independent, needed : turns at constant speed that count as independent, and how many the quantile takes
    """
    reasons: list[Reason] = []
    for run, fold in folds.items():
        if fold > math.pi:
            reasons.append(
                Reason("folded through", "fold_largest", fold, math.pi, "rad", run, grave=run == STEADY)
            )
        elif fold > fold_limit:
            reasons.append(Reason("folded", "fold_largest", fold, fold_limit, "rad", run))
    for run, share in slack.items():
        if share > 0.0:
            reasons.append(Reason("slack", "slack_time", share, 0.0, "1", run, "percent"))
    if independent < needed:
        reasons.append(Reason("starts", "independent_turns", independent, needed, "1"))
    return Verdict("chains", speed, (*reasons, *_unbalanced(residuals)))


def _unbalanced(residuals: Mapping[str, float]) -> list[Reason]:
    return [
        Reason("energy", "energy_residual", share, RESIDUAL, "1", run, grave=run == STEADY)
        for run, share in residuals.items()
        # NaN, too, is no balance
        if not share < RESIDUAL
    ]
