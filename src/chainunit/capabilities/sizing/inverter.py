"""Candidates of sizing with an inverter: the boost that the start needs, and the ratio that spares a larger motor."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator

from ...reading.text import number
from ...study.catalogue_drive import usual_boost
from .candidate import Candidate

_MULTIPLES = (1.0, 2.0, 3.0)
"""Boosts that are tried over the usual one (`chainunit.study.catalogue_drive.usual_boost`), in this order."""
HAIR = 1.1
"""Factor by which a candidate may exceed the share of a limit that the margin leaves, so that it is tried with the
ratio above: a step of the finest series is 3 %, and the heat of a winding changes with the square of the torque."""
_RELIEVED = ("rms_torque", "peak_torque", "temperature")
"""Checks that a larger ratio improves: the motor turns faster and gives less torque."""


def boosts(first: float, is_given: bool) -> list[float]:
    """The boosts to try, beginning with `first`; it alone where the file gives it."""
    return [first] if is_given else [round(multiple * first, 6) for multiple in _MULTIPLES]


def _with_boost(c: Candidate, boost: float) -> Candidate:
    """The candidate with this boost of its inverter."""
    p = c.drive.parameters
    p = dataclasses.replace(p, inverter=dataclasses.replace(p.inverter, boost=boost))
    return dataclasses.replace(c, drive=dataclasses.replace(c.drive, parameters=p))


def least_boost(c: Candidate, judged: Callable[[Candidate], Candidate], is_given: bool) -> Candidate:
    """The candidate, as `judged`, with the least boost with which it starts and does not turn backwards; where it
    starts with none, with the first. A boost with which the run fails is none with which it starts; one that the file
    gives is kept."""
    first_boost = float(c.drive.parameters.inverter.boost)
    first = judged(_with_boost(c, first_boost))
    # more boost makes a motor that turns backwards hunt the more
    if first.starts or not c.drive.follows:
        return first
    others = (judged(_with_boost(c, boost)) for boost in boosts(first_boost, is_given)[1:])
    return next((other for other in others if other.starts and "backwards" not in other.checks), first)


def misses_by_a_hair(c: Candidate) -> bool:
    """Whether the candidate exceeds what the margin leaves of its limits by so little, and in such checks, that the
    ratio above may do."""
    over = [name for name in c.checks if c.exceeds(name)]
    usable = HAIR * (1.0 - c.margin)
    return bool(over) and all(name in _RELIEVED and c.sizes[name] <= usable for name in over)


def inverter_needs(best: Candidate, is_given: bool) -> Iterator[str]:
    """The settings of the inverter, whose boost may be given."""
    boost, trial = best.drive.parameters.inverter.boost, best.trial
    if best.starts and not is_given:
        share = number(boost, "1", "percent", full=False)
        text = f"The inverter needs a voltage boost of {share} at frequency zero (starter.inverter.boost)"
        less = f"; with less the motor does not start the machine from every {best.drive.driver_noun} angle"
        usual = usual_boost(best.drive.parameters, best.motor.nameplate)
        yield f"{text}{less if boost > usual else ''}."
    if best.weakened:
        yield (
            f"The motor runs at {number(trial.frequency, 'Hz')}, above its rated "
            f"{number(best.motor.nameplate.frequency, 'Hz')}: in field weakening, where its pull-out torque falls "
            "with the square of the frequency; gear.ratio or sizing.ratios lead there."
        )
    yield (
        "The electronic motor protection of the inverter stands in place of a thermal relay: set it to the rated "
        "current of the motor. No trip class is to be chosen for it."
    )
