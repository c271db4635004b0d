"""Faults of a recording that would spoil an identification, each with its column and a remedy."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..core.errors import Faults, InputError
from ..core.messages import unit_behind
from ..core.units import scale
from ..study.arrays import rms, stretches
from .logger_table import name_and_unit
from .measurands import COUNTS, MEASURANDS, OFFSET_SHARE
from .plant import CRANK, MOVING, Response
from .problem import Problem, RecordedRun, likeness, mark_times, mean_speed, measured_speed, speed_column
from .recording import Recording

MISSING = 0.2
"""Largest share of rows that may be missing."""
LEAST_ROWS = 40.0
"""Fewest rows in a turn of the crank: the torque has orders up to some 20."""
FEWEST_TURNS = 3.0
LONGEST, LONGEST_TURNS = 1200.0, 20.0
"""Longest recording, in seconds or, where that is longer, in turns of the crank: more tells little more, and is
simulated again and again."""
PASSES = 1.5
"""Factor by which the number of passes of the mark may differ from that of the turns."""
STUCK = 0.2
"""Longest time for which a column with noise may keep its value [s]."""
CLIPPED = 2e-3
"""Largest share of rows at the same extreme value, in parts of all rows."""
JUMP, FASTER = 100.0, 1.5
"""Fall of the count of an encoder from which it began anew, if it falls faster by this factor than it ever rises."""
STANDS = 0.05
"""Mean speed, in parts of the expected one, below which the machine stands."""
SAME = 1.2
"""Factor by which the mean of a column may differ from the known speed where it is that of the speed."""
SIGNAL = 0.3
"""Mean in parts of the RMS from which on a column is more than the zero of a sensor; and standard deviation in parts
of the mean up to which a column can be that of a steady speed."""
WANDERS, DRIFT = 0.01, 3
"""Standard deviation of the mean speeds of turns, in parts of the mean, above which a run is not steady; and the
degree of a polynomial over the run that is taken off before, as a motor warms up."""
OFFSETS, LIKE = 3.0, 0.5
"""Standard deviations of an offset up to which a mean may be that of an offset; and the correlation of a column with
its simulated course that tells its sign."""
WIDE, NEAR = 5.0, 1.2
"""Factors by which the RMS of a column may differ from the simulated one: of a current, power or torque, which depend
on the sought numbers; and of a speed or a voltage under control."""
CLOCK = 5e-4
"""Part of the speed by which the clock of a logger may be wrong."""
ALIKE, AROUND = 0.6, 1.5
"""Correlation of a column with itself one turn later from which it tells the turn; and the factor around the stated
time of a turn within which the turn is sought."""
_MOST_TURNS, _LESS_ALIKE = 12, 0.02
"""Largest number of turns that a time after which a column repeats may have, and how much less alike it may be after
one of them."""
GAINS = 3.0
"""Standard deviations by which the gain of a sensor of speed may be wrong."""
_ROWS_STUCK = 20
OF_SPEED = ("motor.w", "crank.w", "motor.u")
"""Quantities whose sizes follow from the speed."""


@dataclass(frozen=True)
class Expectation:
    """The sizes that a column can have: its RMS lies between `low` and `high`; `words` say from where the upper limit
    comes. `likeness` is the correlation of the column with its simulated course, 0 where the angle is not known."""

    low: float
    high: float
    words: str
    likeness: float = 0.0

    def admits(self, size: float) -> bool:
        """Whether the RMS can have this size."""
        return self.low <= size <= self.high

    def is_reversed(self, mean: float, size: float) -> bool:
        """Whether a column of a driven machine with this mean and RMS has a wrong sign. Of a motion that takes hardly
        any energy the mean may be that of an offset, and the course tells the sign."""
        clear = abs(mean) > OFFSETS * OFFSET_SHARE * size
        return mean < 0.0 and self.likeness < (LIKE if clear else -LIKE)


def inspect_runs(problem: Problem, workers: int) -> None:
    """Refuse recordings with faults; the expected sizes are simulated with the start values. What needs no
    simulation is told before it, as with a wrong unit of the time it has no end."""
    faults, ratio = Faults(), problem.plant.ratio
    for run in problem.runs:
        reference = run.values.get("motor.w_ref")
        speeds = [run.crank_speed, *(w / ratio for _, _, w in getattr(reference, "changes", ()))]
        faults.add(inspect_motion(run.recording, (min(speeds), max(speeds)), ratio, run.off))
    faults.refuse()
    unsteady = {run.name: _unsteadiness(run, ratio) for run in problem.runs}
    for run in problem.runs:
        response = problem.simulate(run, problem.start_values, workers)
        if not unsteady[run.name] and (wrong := inspect_speed(run, response, ratio, problem.speed_gain)):
            # with a wrong speed the simulated columns tell nothing
            faults.add(wrong)
            continue
        expected, off = dict[str, Expectation](), np.inf if run.off is None else run.off
        # of less than a turn the RMS is that of an angle
        has_turn = off - float(run.recording.time[0]) >= 2.0 * np.pi / run.crank_speed
        has_angle = len(mark_times(run.recording)) > 0
        for name in run.recording.columns if has_turn else ():
            rows = response.describes(name, response.time) & (response.time <= off)
            if MEASURANDS[name].analog and rows.any():
                size, factor = rms(response.values[name][rows]), NEAR if name in OF_SPEED else WIDE
                message = f"{1.0 / factor:.2g} to {factor:g} times the simulated one"
                like = likeness(run.recording, name, response) if has_angle else 0.0
                expected[name] = Expectation(size / factor, size * factor, message, like)
        faults.add(inspect_columns(run.recording, expected, run.off))
    faults.refuse()
    for run in problem.runs:
        faults.add(unsteady[run.name])
        if not _has_changes(run):
            faults.add(inspect_work(run.recording, ratio, run.off))
    faults.refuse()


def _has_changes(run: RecordedRun) -> bool:
    """Whether changes of the speed are stated."""
    return hasattr(run.values.get("motor.w_ref"), "changes")


def _unsteadiness(run: RecordedRun, ratio: float) -> list[InputError]:
    """The fault of a run without stated changes of the speed that is not steady."""
    if _has_changes(run):
        return []
    return inspect_steadiness(run.recording, ratio, run.off, "motor.w_ref" in run.values)


def inspect_motion(
    recording: Recording, speeds: tuple[float, float], ratio: float, off: float | None = None
) -> list[InputError]:
    """The faults of rows, speed and marks of a recording of a running machine, which are told without a simulation.

    Parameters
    ----------
    speeds : least and largest speed of the crank before the motor is switched off [rad/s], as they are known
    ratio : motor turns per crank turn
    off : the time at which the motor is switched off [s]
    """
    driven = recording if off is None else recording.part(end=off)
    least, largest = speeds
    faults = [
        *_rows(recording, largest),
        *(_stands(recording, driven, least, ratio) or _marks(driven, speeds, ratio)),
        *_counted(recording),
    ]
    other = _other_speed(driven, least, ratio) if faults and least == largest else None
    if other is None:
        return faults
    # at a wrong speed the rows look too few, and the machine seems to stand: the faults are those at the true one
    column, true_speed = other
    fault = _speed_fault(recording, column, true_speed, least)
    return [fault, *inspect_motion(recording, (true_speed, true_speed), ratio, off)]


def _other_speed(recording: Recording, stated: float, ratio: float) -> tuple[str, float] | None:
    """The column that tells that the crank turns at another speed than the `stated` one, and that speed [rad/s]: the
    mark, the count of an encoder or the measured speed, all of which agree; one alone needs another column that
    repeats after a turn at this speed."""
    speeds = _mean_speeds(recording, ratio)
    low, high = min(speeds.values(), default=0.0), max(speeds.values(), default=0.0)
    if high > SAME * low or stated / SAME < high < SAME * stated or not speeds:
        return None
    name, speed = next(iter(speeds.items()))
    # without a measured speed, the unit of the times may be another one, too
    if not speed_column(recording) and _likely_unit(recording, 2.0 * math.pi / stated, LONGEST):
        return None
    analog = (other for other in recording.columns if MEASURANDS[other].analog and other != name)
    repeats = any(_turn(recording, other, 2.0 * math.pi / speed)[0] > ALIKE for other in analog)
    return (name, speed) if len(speeds) > 1 or repeats else None


def _mean_speeds(recording: Recording, ratio: float) -> dict[str, float]:
    """The mean speed of the crank [rad/s] by each column that tells it: the mark, the count of an encoder, and the
    measured speed."""
    speeds = {}
    for name in ("mark", "motor.count", speed_column(recording)):
        if name in recording.columns and (name != "mark" or len(mark_times(recording)) > FEWEST_TURNS):
            alone = replace(recording, columns={name: recording.columns[name]})
            speeds[name] = mean_speed(RecordedRun("", alone, 0.0), ratio)
    return {name: speed for name, speed in speeds.items() if speed > 0.0}


def _speed_fault(recording: Recording, name: str, speed: float, stated: float) -> InputError:
    """The fault that the crank turns at a `speed`, by the column of this name, and not at the `stated` one."""
    measured, expected = (f"{x:.5g} rad/s ({_per_minute(x)})" for x in (speed, stated))
    others = ", or correct machine.ratio" if name in ("motor.w", "motor.count") else ""
    if not speed_column(recording) and not stated / AROUND < speed < AROUND * stated:
        others += ", or write the unit of the times into their head"
    return _fault(
        recording, name,
        f"the crank turns at {measured}, and crank_speed is {expected}; write crank_speed = "
        f'"{_per_minute(speed)}" into the table of this recording{others}',
    )  # fmt: skip


MOST_DROOP = 0.1
"""Largest part of the speed that a load may take; a motor that cannot reach the stated speed misses more."""


def inspect_speed(run: RecordedRun, response: Response, ratio: float, gain: float) -> list[InputError]:
    """That the crank turns at the speed of the run's reference, as far as the simulated one does.

    Parameters
    ----------
    response : the simulated run
    gain : standard deviation of the gain of the sensor of the speed [1]
    """
    if "motor.w_ref" not in run.values or _has_changes(run):
        return []
    driven = run.recording if run.off is None else run.recording.part(end=run.off)
    turning = _turning_speed(driven, run.crank_speed, ratio, gain)
    if turning is None:
        return []
    name, speed, error = turning
    time = np.clip(driven.time[[0, -1]], response.time[0], response.time[-1])
    simulated = float(np.ptp(np.interp(time, response.time, response.values[CRANK])) / np.ptp(time))
    # a control without an integral part lets the speed droop under load, by another amount under another one
    droop = min(2.0 * abs(simulated / run.crank_speed - 1.0), MOST_DROOP)
    if abs(speed / run.crank_speed - 1.0) <= error + droop:
        return []
    return [_speed_fault(run.recording, name, speed, run.crank_speed)]


def _per_minute(speed: float) -> str:
    return f"{speed * 30.0 / math.pi:.5g} rev/min"


def _turning_speed(
    recording: Recording, crank_speed: float, ratio: float, gain: float
) -> tuple[str, float, float] | None:
    """The column that tells the speed of the crank, the mean speed by it [rad/s], and the part of it by which it may
    be wrong. It is a mark, the count of an encoder, a column with turns that are alike, or the measured speed; None
    without one."""
    span = float(recording.time[-1] - recording.time[0])
    clock = CLOCK + recording.step / span
    speeds = _mean_speeds(recording, ratio)
    for name, speed in speeds.items():
        if name != speed_column(recording):
            return name, speed, clock
    turns = [
        (like, name, turn)
        for name in recording.columns
        if MEASURANDS[name].analog
        for like, turn in [_turn(recording, name, 2.0 * math.pi / crank_speed)]
        if like > ALIKE
    ]
    if turns:
        like, name, turn = max(turns)
        if abs(2.0 * math.pi / turn / crank_speed - 1.0) > 2.0 * clock:
            turn /= _turns_in(recording, name, turn, like, next(iter(speeds.values()), None))
        return name, 2.0 * math.pi / turn, 2.0 * clock
    return next(((name, speed, clock + GAINS * gain) for name, speed in speeds.items()), None)


def _turns_in(recording: Recording, name: str, span: float, like: float, measured: float | None) -> int:
    """The number of turns of the crank in a time after which a column repeats, with this correlation: by the measured
    speed of the crank, else the largest number of parts after each of which the column repeats as well."""
    if measured is not None:
        return max(1, round(span * measured / (2.0 * math.pi)))
    parts = [1]
    for count in range(2, _MOST_TURNS + 1):
        like_of_part, part = _turn(recording, name, span / count)
        if like_of_part > like - _LESS_ALIKE and abs(count * part / span - 1.0) < 0.01:
            parts.append(count)
    return parts[-1]


def _turn(recording: Recording, name: str, stated: float) -> tuple[float, float]:
    """The correlation of a column with itself a turn later, and the time of a turn [s] at which it is largest, within
    a factor of the `stated` one: first one turn later, and then as many as the half of the recording has."""
    time = np.arange(recording.time[0], recording.time[-1], recording.step)
    x = np.interp(time, recording.time, recording.columns[name])
    x = x - np.mean(x)

    def likeness_after(lags: Any) -> Any:
        return np.array([np.corrcoef(x[:-lag], x[lag:])[0, 1] if np.ptp(x) else 0.0 for lag in lags])

    def best(low: float, high: float, size: int) -> tuple[float, float]:
        """The largest correlation, and its lag in rows, of `size` lags between two."""
        low_lag, high_lag = max(1, math.floor(low)), min(math.ceil(high), len(x) // 2)
        if low_lag >= high_lag:
            return 0.0, low
        lags = np.unique(np.linspace(low_lag, high_lag, min(size, high_lag - low_lag + 1)).astype(int))
        likes = likeness_after(lags)
        k = int(np.argmax(likes))
        return float(likes[k]), float(lags[k])

    rows = stated / recording.step
    like, lag = best(rows / AROUND, rows * AROUND, 200)
    turns, spread = 1, max(3.0, 0.02 * lag)
    while like > ALIKE and 2.0 * turns * lag + spread < 0.5 * len(x):
        turns *= 2
        like, total = best(turns * lag - spread, turns * lag + spread, 200)
        lag = total / turns
    return like, lag * recording.step


def inspect_columns(
    recording: Recording, expected: Mapping[str, Expectation], off: float | None = None
) -> list[InputError]:
    """The faults of the columns of a recording of a running machine.

    Parameters
    ----------
    expected : by quantity, the sizes that its column can have up to the time `off`, where they are known
    off : the time at which the motor is switched off [s]; electric quantities are inspected up to it
    """
    driven = recording if off is None else recording.part(end=off)
    faults, sizes = list[InputError](), {name: rms(driven.columns[name]) for name in expected}
    swapped = _swapped(sizes, expected)
    if swapped:
        faults.append(_exchanged(recording, *swapped, sizes))
    for name in recording.columns:
        if MEASURANDS[name].analog and not (swapped and name in swapped):
            inspected = recording if name in MOVING else driven
            faults += _of_column(inspected, name, driven.columns[name], expected.get(name))
    return faults


def inspect_steadiness(
    recording: Recording, ratio: float, off: float | None = None, follows: bool = False
) -> list[InputError]:
    """That the speed of a run without stated changes of the speed is that of a steady run, as it is simulated.

    Parameters
    ----------
    off : the time at which the motor is switched off [s]
    follows : whether the motor follows a reference of the speed, whose changes can be stated
    """
    driven = recording if off is None else recording.part(end=off)
    name, times = _turns(driven, ratio)
    if len(times) < FEWEST_TURNS + 1.0:
        return []
    middles, lasts = 0.5 * (times[1:] + times[:-1]), np.diff(times)
    # a gap may hide passes of the mark
    speeds = 2.0 * math.pi * np.round(lasts / np.median(lasts)) / lasts
    degree = min(DRIFT, (len(speeds) - 2) // 2)
    slow = np.polynomial.Polynomial.fit(middles, speeds, degree)(middles)
    mean = float(np.mean(speeds))
    spread = math.sqrt(np.sum((speeds - slow) ** 2) / (len(speeds) - degree - 1))
    # a mark stands in the first row behind it
    instant = recording.step / math.sqrt(6.0) / float(np.median(lasts)) if name == "mark" else 0.0
    if spread <= (WANDERS + 3.0 * instant) * mean:
        return []
    remedy = "name a part in which it is steady (begin, end), or record at a constant speed"
    stated = "state its changes (speeds), " if follows else ""
    return [
        _fault(
            recording, name,
            f"the mean speed of the crank in a turn wanders from {np.min(speeds):.4g} to {np.max(speeds):.4g} rad/s, "
            f"with a standard deviation of {100.0 * spread / mean:.2g} %; must be <= {100.0 * WANDERS:g} %, as the "
            f"run is simulated at a constant speed: {stated}{remedy}",
        )
    ]  # fmt: skip


def inspect_work(recording: Recording, ratio: float, off: float | None = None) -> list[InputError]:
    """The faults of turns of a steady run whose mean torque or power has another sign than in most turns.

    Parameters
    ----------
    off : the time at which the motor is switched off [s]
    """
    driven = recording if off is None else recording.part(end=off)
    _, times = _turns(driven, ratio)
    faults = list[InputError]()
    for name in ("motor.power", "crank.tau"):
        if name not in driven.columns or len(times) < FEWEST_TURNS + 1.0:
            continue
        x = driven.columns[name]
        ends = np.searchsorted(driven.time, times)
        means = np.array([np.mean(x[i:k]) if k > i else np.nan for i, k in itertools.pairwise(ends)])
        clear = OFFSETS * OFFSET_SHARE * rms(x)
        wrong = np.flatnonzero(means * np.sign(np.nanmedian(means)) < -clear)
        if len(wrong) and abs(np.nanmedian(means)) > clear:
            k = int(wrong[0])
            size, usual = (_size(name, float(x)) for x in (means[k], np.nanmedian(means)))
            text = (
                f"mean of {size} in the turn from {times[k]:.10g} to {times[k + 1]:.10g} s, and of {usual} in most "
                f"turns: the work of {len(wrong)} of {len(means)} turns has the wrong sign; mend the sign or the "
                "order of these rows, or name a part without them (begin, end)"
            )
            faults.append(_fault(recording, name, text))
    return faults


def _turns(recording: Recording, ratio: float) -> tuple[str, Any]:
    """The column that tells the turns of the crank, and the times at which they end, by passes of the mark, by the
    count of an encoder, or by the measured speed."""
    passed, time = mark_times(recording), recording.time
    if len(passed):
        return "mark", passed
    if "motor.count" in recording.columns:
        turned = recording.columns["motor.count"] / (COUNTS * ratio)
        turned = np.maximum.accumulate(turned - turned[0])
        return "motor.count", np.interp(np.arange(0.0, turned[-1]), turned, time)
    speed = measured_speed(recording, ratio)
    if speed is None:
        return "", np.zeros(0)
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))]) / (
        2.0 * math.pi
    )
    turned = np.maximum.accumulate(turned)
    return speed_column(recording), np.interp(np.arange(0.0, turned[-1]), turned, time)


def _of_column(
    recording: Recording, name: str, driven: Any, expected: Expectation | None
) -> Iterator[InputError]:
    """The faults of a column; `driven` are its rows whose RMS and mean are `expected`, where they are known."""
    x, size, mean = recording.columns[name], rms(driven), float(np.mean(driven))
    stuck = _longest_constant(recording.time, x)
    extreme, share, longest = _extremes(x)
    if stuck is not None and not (share > CLIPPED and x[stuck[0]] in (x.min(), x.max())):
        begin, end = recording.time[list(stuck)]
        remedy_text = "record again"
        if end - begin <= 0.5 * (recording.time[-1] - recording.time[0]):
            remedy_text = f"leave this part out (begin, end), or {remedy_text}"
        kept = _kept(recording, name, stuck)
        yield _fault(recording, name, f"{kept}: the sensor or the logger is stuck; {remedy_text}")
        return
    if expected is not None and not expected.admits(size):
        yield _fault(recording, name, _scale_words(name, recording.heads[name], size, expected))
        return
    if expected is not None and expected.is_reversed(mean, size):
        yield _fault(
            recording, name,
            f"mean of {_size(name, mean)} at an RMS of {_size(name, size)}, although the motor drives: the sign is "
            "reversed; change the sign of the column, or turn the sensor round",
        )  # fmt: skip
    if share > CLIPPED and longest >= 3:
        yield _fault(
            recording, name,
            f"{100.0 * share:.2g} % of the rows have its {extreme} value, "
            f"{_size(name, float(x.max() if extreme == 'largest' else x.min()))}: it is clipped; record again with a "
            "larger range of the sensor",
        )  # fmt: skip


def _rows(recording: Recording, crank_speed: float) -> Iterator[InputError]:
    """The faults of the rows: too few in a turn of the crank, too few or too many turns, and rows that are
    missing."""
    step, turn = recording.step, 2.0 * math.pi / crank_speed
    span, longest = float(recording.time[-1] - recording.time[0]), max(LONGEST, LONGEST_TURNS * turn)
    if turn / step < LEAST_ROWS or span < FEWEST_TURNS * turn:
        likely = _likely_unit(recording, turn, longest)
        if likely:
            message = f"{span:.4g} s with {turn / step:.2g} rows in a turn of the crank"
            yield _fault(
                recording, "time", f"{message}: the values look like {likely}; write [{likely}] into its head"
            )
            return
    if span > longest:
        yield _fault(
            recording, "time",
            f"{span:.4g} s; must be <= {longest:.4g} s: name a part (begin, end), of which a minute is enough, or "
            "write the unit of its times into its head",
        )  # fmt: skip
    if turn / step < LEAST_ROWS:
        yield _fault(
            recording, "time",
            f"{1.0 / step:.3g} rows a second are {turn / step:.2g} in a turn of the crank; record >= "
            f"{math.ceil(LEAST_ROWS / turn)} rows a second, correct crank_speed, or write the unit of the times "
            "into their head",
        )  # fmt: skip
    if recording.missing > MISSING:
        begin, end = max(recording.gaps, key=lambda gap: gap[1] - gap[0])
        yield _fault(
            recording, "time",
            f"{100.0 * recording.missing:.0f} % of the rows are missing, {end - begin:.3g} s of them in one piece "
            f"from {begin:.10g} s; must be <= {100.0 * MISSING:.0f} %: name a part without gaps (begin, end), or "
            "record again",
        )  # fmt: skip
    if span < FEWEST_TURNS * turn:
        yield _fault(
            recording, "time",
            f"{span:.3g} s are {math.floor(100.0 * span / turn) / 100.0:.3g} turns of the crank at crank_speed; "
            f"record >= {FEWEST_TURNS:.0f} turns, or correct crank_speed",
        )  # fmt: skip


def _likely_unit(recording: Recording, turn: float, longest: float) -> str:
    """The unit in which the times would be those of a recording that can be used; empty where there is none."""
    time_scale = scale(name_and_unit(recording.heads["time"])[1], "s")[0]
    span = float(recording.time[-1] - recording.time[0])
    for unit in ("s", "ms", "µs"):
        factor = scale(unit, "s")[0] / time_scale
        fits = FEWEST_TURNS * turn <= factor * span <= longest
        if factor != 1.0 and fits and LEAST_ROWS * factor * recording.step <= turn:
            return unit
    return ""


def _marks(recording: Recording, speeds: tuple[float, float], ratio: float) -> Iterator[InputError]:
    """The fault of marks that do not come once a turn. The speed is the one of the run, or the measured one."""
    if "mark" not in recording.columns or len(recording.time) < 2:
        return
    measured = measured_speed(recording, ratio)
    all_speeds = [*speeds, *([] if measured is None else [float(np.mean(measured))])]
    seen = recording.step * len(recording.time) / (2.0 * math.pi)
    passes, rows = int(np.sum(recording.columns["mark"] > 0.5)), len(recording.time)
    if not (
        passes - 1 <= PASSES * max(all_speeds) * seen and PASSES * (passes + 1) >= min(all_speeds) * seen
    ):
        turns = f"{seen * min(all_speeds):.3g}"
        if max(all_speeds) > 1.01 * min(all_speeds):
            turns += f" to {seen * max(all_speeds):.3g}"
        yield _fault(
            recording, "mark",
            f"is 1 in {'all ' if passes == rows else ''}{passes} rows of {turns} turns of the crank; must be 1 only "
            "in the first row after the mark, once in a turn: check sensor and crank_speed",
        )  # fmt: skip


def _counted(recording: Recording) -> Iterator[InputError]:
    """The fault of an encoder that counts down, or begins anew."""
    count = recording.columns.get("motor.count")
    if count is None:
        return
    steps = np.diff(count)
    rates = steps / np.diff(recording.time)
    place = int(np.argmin(rates))
    if count[-1] < count[0] and np.median(steps) < 0.0:
        yield _fault(recording, "motor.count", "counts down, while the motor turns forward: change its sign")
    elif steps[place] < -JUMP and rates[place] < -FASTER * np.max(rates):
        instant = recording.time[place + 1]
        yield _fault(
            recording, "motor.count",
            f"falls by {-steps[place]:.0f} at {instant:.10g} s: the counter begins anew; write the count without "
            "the jump",
        )  # fmt: skip


def constant_parts(recording: Recording, names: Iterable[str]) -> Iterator[str]:
    """Words on columns that keep a value over a part: a sensor that is stuck, a stop, or a limit."""
    for name in names:
        if (stuck := _longest_constant(recording.time, recording.columns[name])) is not None:
            yield f"{name} {_kept(recording, name, stuck)}"


def _kept(recording: Recording, name: str, rows: tuple[int, int]) -> str:
    """Words on a column that is constant from a row to another one."""
    begin, end = recording.time[list(rows)]
    return f"keeps the value {_size(name, float(recording.columns[name][rows[0]]))} from {begin:.10g} to {end:.10g} s"


def _stands(recording: Recording, driven: Recording, crank_speed: float, ratio: float) -> list[InputError]:
    """The fault of a machine that does not turn, by the first column that shows it, or none; `driven` is the part
    before the motor is switched off, and the crank should turn at `crank_speed` [rad/s]."""
    for name, speed in (("motor.w", ratio * crank_speed), ("crank.w", crank_speed)):
        if name in driven.columns and abs(float(np.mean(driven.columns[name]))) < STANDS * speed:
            return [_too_slow(recording, driven, name, speed, ratio)]
    count = driven.columns.get("motor.count")
    if count is not None and np.ptp(count) < 4.0:
        return [_standing(recording, "motor.count", "does not change")]
    if "mark" in recording.columns and not np.any(recording.columns["mark"]):
        turns = (recording.time[-1] - recording.time[0]) * crank_speed / (2.0 * math.pi)
        if turns > FEWEST_TURNS:
            return [_standing(recording, "mark", f"is not passed in {turns:.0f} turns")]
    return []


def _too_slow(recording: Recording, driven: Recording, name: str, speed: float, ratio: float) -> InputError:
    """The fault of the column `name` of a speed that should be `speed` [rad/s], and is nearly 0: it is swapped with
    another column, or its sensor is not connected while mark or encoder show turns, or the machine stands."""
    finding = f"mean of {_size(name, float(np.mean(driven.columns[name])))}"
    other = _with_speed(driven, name, speed)
    if other:
        sizes = {quantity: rms(driven.columns[quantity]) for quantity in (name, other)}
        return _exchanged(recording, name, other, sizes)
    passes = len(mark_times(driven))
    counts = float(np.ptp(driven.columns["motor.count"])) if "motor.count" in driven.columns else 0.0
    if passes <= FEWEST_TURNS and counts <= FEWEST_TURNS * COUNTS * ratio:
        return _standing(recording, name, finding)
    turns = f"the mark is passed {passes} times" if passes else "the encoder counts"
    remedy = "the sensor is not connected, or the column is another one; mend it, or leave it out"
    return _fault(recording, name, f"{finding}, although {turns}: {remedy}")


def _with_speed(recording: Recording, name: str, speed: float) -> str:
    """The column of another quantity that has the values of a `speed` [rad/s], if the column `name` of the speed has
    values that are neither a speed nor the zero of a sensor; empty without one."""
    x = recording.columns[name]
    if abs(float(np.mean(x))) < SIGNAL * rms(x) or not np.any(x):
        return ""
    for other, y in recording.columns.items():
        like = MEASURANDS[other].analog and other not in OF_SPEED
        mean = float(np.mean(y))
        if like and speed / SAME < mean < SAME * speed and float(np.std(y)) < SIGNAL * mean:
            return other
    return ""


def _standing(recording: Recording, name: str, finding: str) -> InputError:
    """The fault of a machine that stands, by the `finding` in a column."""
    return _fault(
        recording,
        name,
        f"{finding}: the machine stands, or the sensor is not connected; record the running machine",
    )


def _exchanged(recording: Recording, first: str, second: str, sizes: Mapping[str, float]) -> InputError:
    """The fault of two columns that are swapped, with the RMS of each."""
    return _fault(
        recording, first,
        f"RMS of {_size(first, sizes[first])} and of {recording.heads[second]} {_size(second, sizes[second])}: the "
        "two columns look swapped; exchange their heads",
    )  # fmt: skip


def _scale_words(name: str, head: str, size: float, expected: Expectation) -> str:
    """Words on a column whose RMS `size` [SI unit] is not the `expected` one: the unit that its values look like, or
    else what to check."""
    finding = f"RMS of {_size(name, size)}"
    limit = f"must be from {_size(name, expected.low)} to {_size(name, expected.high)} ({expected.words})"
    unit = MEASURANDS[name].unit
    try:
        stated = scale(name_and_unit(head)[1], unit)[0]
    except ValueError:
        stated = 1.0
    for factor, prefix in ((1e-3, "m"), (1.0, ""), (1e3, "k"), (1e6, "M")):
        if stated != factor and expected.admits(size * factor / stated):
            return f"{finding}; {limit}: the values look like {prefix}{unit}; write [{prefix}{unit}] into its head"
    more = ", crank_speed and machine.ratio" if name in OF_SPEED else ""
    return f"{finding}; {limit}: check the sensor, the unit in its head{more}"


def _swapped(sizes: Mapping[str, float], expected: Mapping[str, Expectation]) -> tuple[str, str] | None:
    """Two columns of which neither can have its size, and each can have the size of the other one."""
    wrong = [name for name, size in sizes.items() if name in expected and not expected[name].admits(size)]
    for k, first in enumerate(wrong):
        for second in wrong[k + 1 :]:
            if expected[first].admits(sizes[second]) and expected[second].admits(sizes[first]):
                return first, second
    return None


def _longest(stretched: list[tuple[int, int]]) -> tuple[int, int]:
    return max(stretched, key=lambda ends: ends[1] - ends[0], default=(0, 0))


def _longest_constant(time: Any, x: Any) -> tuple[int, int] | None:
    """First and last row of the longest part in which the column keeps its value, if that is too long."""
    begin, end = _longest(stretches(np.diff(x) == 0.0))
    return (begin, end) if end - begin >= _ROWS_STUCK and time[end] - time[begin] >= STUCK else None


def _extremes(x: Any) -> tuple[str, float, int]:
    """Which extreme value more rows have, their share, and the length of the longest series of them."""
    extremes = []
    for name, value in (("largest", x.max()), ("least", x.min())):
        begin, end = _longest(stretches(x == value))
        extremes.append((float(np.mean(x == value)), end - begin, name))
    share, longest, name = max(extremes)
    return name, share, longest


def _size(name: str, x: float) -> str:
    return f"{x:.4g}{unit_behind(MEASURANDS[name].unit)}"


def _fault(recording: Recording, name: str, message: str) -> InputError:
    return InputError(f"{recording.source}, column {recording.heads[name]}: {message}")
