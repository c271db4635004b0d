"""The remarks of a study, which the reader needs beside the numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..reading.text import number
from .arrays import peak
from .catalogue_drive import SLIP
from .coupling import remark_on_coupling, remark_on_rams
from .inverter import inverter_need
from .judgement import lasts, model_verdict, motor_limits, no_reserve, slowed
from .measures import STARTED, Answers
from .readings import breakdown_speed, crank_speed, has_turn, less_than_a_turn
from .record import LOAD_CYCLE, Amount, StudyRecord
from .registry import capabilities, parts_of_line
from .starts import StartFindings
from .verdict import START, STEADY, shown_speed
from .window import CLOSED, DRIFT, STORED


def conclude(study: StudyRecord) -> None:
    """Judge the model, and add every remark to the study."""
    config, note = study.config, study.note
    assumed = "Values that no file names are the program's defaults, which are assumed."
    if config.file.is_packaged:
        assumed = "Masses, pins, feed and drive are assumed; the papers print none."
    elif config.file.of_example:
        assumed = (
            "Values that the study file does not name come from the packaged example, whose masses and drive "
            "are assumed."
        )
    elif study.drive.foreign_machine:
        assumed = (
            "The machine is an FMU, {description}. Values that the study file does not "
            "name are the start values of this FMU, which alone computes the turn at constant speed. Its bearings "
            "and its motion behind an open coupling are not known."
        )
    machine = study.drive.foreign_machine
    note("assumed", assumed, description=machine.model.description if machine else "")
    if any(value for name, value in study.drive.machine.by_name.items() if name.endswith("friction")):
        note(
            "smoothed friction",
            "Static friction is not modelled; breakaway torque from a loaded stop is not included.",
        )
    for value in config.file.unusual:
        if value.with_unit:
            note("unusual value", "By the file, {value}.", value=str(value))
    if left_out := list(_left_out(study)):
        note(
            "values left out",
            "The file leaves out {what}: the packaged values are used, and the result depends on them.",
            what=" and ".join(left_out),
        )
    if study.answers:
        study.verdict = replace(model_verdict(study), step=config.run.step)
        for topic, line in study.verdict.details(study.titles):
            study.warn(f"model {topic}", "{line}", line=line)
    for part in capabilities():
        part.remark(study)
    if STEADY in study.answers:
        _on_start(study)
        _on_star(study)
        _on_limits(study)
        _on_steady_running(study, study.answers[STEADY])
        if study.drive.foreign is None:
            _on_rotor(study)
    of_drive = None if study.proposal is None else study.proposal.findings
    if of_drive is not None:
        of_drive.remark(study)
    if config.coupling is not None:
        if STEADY in study.answers:
            remark_on_coupling(study, config.coupling.trip_torque)
        remark_on_rams(study, config.coupling.trip_torque)
    _on_runs(study)
    _on_inverter(study)
    _on_assumptions(study)
    for part in parts_of_line():
        part.remark(study)
    for findings in study.findings.values():
        if findings is not of_drive:
            findings.remark(study)


_RATING = ("limit.i", "limit.v", "armature.k")
"""Parameters that limit the torque of a motor without a nameplate."""


def _left_out(study: StudyRecord) -> Iterator[str]:
    """Values that decide the result, but that the file leaves out, so that the packaged values are used."""
    config, coupling = study.config, study.config.coupling
    if config.file.is_packaged:
        return
    if coupling is not None and "coupling.trip_torque" not in config.file.given:
        yield f"coupling.trip_torque ({number(coupling.trip_torque, 'N.m', full=False)})"
    if config.plate is not None and "system.motor" in config.file.of_example:
        yield f"the motor ({config.plate.designation})"
    elif study.proposal is None and study.drive.foreign is None:
        values = study.drive.motor.parameter_layout.by_name(study.drive.parameters)
        units = {v.name: v.unit for v in study.drive.motor.parameter_layout.variables}
        names = [name for name in _RATING if f"motor.{name}" in config.file.of_example]
        if names:
            sizes = (f"{name} = {number(values[name], units[name], full=False)}" for name in names)
            yield f"the rating of the motor ({', '.join(sizes)})"


def _on_start(study: StudyRecord) -> None:
    """Warn where the feed came to a machine that did not have its speed yet."""
    feed_time = study.started.rig.fed_from if study.started else None
    if feed_time is None:
        return
    run = study.runs["start_up"]
    speed = float(np.interp(feed_time, run["time"].values, crank_speed(study.drive, run)))
    requested = study.config.run.crank_speed
    # the row at which the speed is passed is the last of the start
    if speed < STARTED * requested:
        study.warn(
            "fed before speed",
            "start-up: the motor does not bring the empty machine to its speed in a reasonable time: the feed comes "
            "after {fed}, with the {driver} at {speed} in place of {wanted}; take a larger motor or a lighter "
            "flywheel.",
            START,
            fed=(feed_time, "s"),
            speed=(speed, "rad/s", "speed"),
            wanted=number(requested, "rad/s", "speed", full=False, beside=False),
        )


_LIMITS = {
    "temperature": "steady running: the winding comes to {value} if it goes on for ever, permitted is {limit} "
    "({key}): take a larger motor, less load, or for a load that comes and goes a heavier flywheel.",
    "current": "steady running: the RMS current is {value}, rated is {limit}: a lasting excess overheats the motor; "
    "take a larger motor, less load, or for a load that comes and goes a heavier flywheel.",
    "start": "start-up: it takes {value}, with up to {peak}; the rotor of a warm motor may be locked for {limit}, "
    "and a start that takes longer overheats it as a locked rotor does: take a lighter flywheel, a larger motor, or "
    'start = "inverter".',
}
"""By limit of the motor, the warning where it is exceeded."""


def _on_limits(study: StudyRecord) -> None:
    """Warn where the motor exceeds a limit in its start or in steady running."""
    steady, warn = study.answers[STEADY], study.warn
    key, permitted = study.config.permitted_temperature
    for name, check in motor_limits(study).items():
        if not check.over:
            continue
        value, limit = check.value, check.limit
        if name == "temperature":
            value, limit = steady.winding_temperature, permitted
            if not math.isfinite(value):
                # that case has its own remark
                continue
        peak = 0.0 if study.start is None else study.start.current_peak
        unit = check.unit
        warn(
            f"motor {name}",
            _LIMITS[name],
            START if name == "start" else STEADY,
            value=(value, unit),
            limit=(limit, unit),
            peak=number(peak, "A"),
            key=key,
        )
    if steady.torque_reserve is not None and steady.torque_reserve < 0.0:
        turns = _stall_speed(study, steady) is None
        stalls = "; a heavier load or a dip of the voltage stalls it" if turns else ""
        warn(
            "no reserve",
            "steady running of the motor: {passes}{stalls}; take a larger motor or a heavier flywheel.",
            STEADY,
            stalls=stalls,
            passes=no_reserve(STEADY, steady.torque_reserve),
            over=(-steady.torque_reserve, "1", "percent"),
        )


def _stall_speed(study: StudyRecord, steady: Answers) -> float | None:
    """The crank speed [rad/s] below which a load stalls the motor, if this motor is stalled; else None, as of one
    that still speeds up. It is not known for a foreign motor."""
    if study.reaches or study.drive.foreign is not None or steady.energy_gap > STORED:
        return None
    breakdown = breakdown_speed(study.drive, study.steady)
    return breakdown if steady.speed_mean < breakdown else None


def _why_missed(study: StudyRecord, steady: Answers) -> str:
    """The reason why the crank does not turn at the requested speed."""
    if (breakdown := _stall_speed(study, steady)) is not None:
        below = number(breakdown, "rad/s", "speed", beside=False)
        return (
            f"the motor stalls below its pull-out speed, {below}; take a larger motor, less load, or for a load that "
            "comes and goes a heavier flywheel"
        )
    if steady.energy_gap > STORED:
        return (
            "the machine still speeds up, too slowly for a start that ends; take a larger motor, a lighter flywheel "
            "or less load"
        )
    if study.drive.follows:
        return "the motor's voltage or current is at its limit, or the run is too short to settle"
    return "a motor on the line takes the speed that gear ratio and slip give"


def _on_steady_running(study: StudyRecord, steady: Answers) -> None:
    requested, warn = study.config.run.crank_speed, study.warn
    never = study.drive.simulated_machine.model.never_repeats
    if not study.reaches:
        why, addition = _why_missed(study, steady), ""
        if any(not study.config.events[name].from_rest for name in study.overloads):
            addition = " The overloads begin from this state."
        warn(
            "speed missed",
            "steady running: the {driver} turns at {speed_mean} in place of {wanted}; {why}.{branched}",
            STEADY,
            speed_mean=(shown_speed(steady.speed_mean, requested), "rad/s", "speed"),
            asked=(requested, "rad/s", "speed"),
            wanted=number(requested, "rad/s", "speed", full=False),
            why=why,
            branched=addition,
        )
    if not has_turn(study.drive, study.steady):
        warn(
            "no whole turn",
            f"steady running: {{made}}; means are over this time, and there is no {LOAD_CYCLE}.{{refused}}",
            STEADY,
            made=less_than_a_turn(study.drive, study.steady),
            refused="" if lasts(study) else _REFUSED,
        )
    elif steady.cycle_gap > CLOSED:
        warn(
            "turns do not close",
            "steady running: the turns do not close, their ends differ by {cycle_gap} in speed or torque: {repeats}; "
            "raise run.settle_turns or run.turns.{refused}",
            STEADY,
            cycle_gap=(steady.cycle_gap, "1", "percent"),
            refused="" if lasts(study) else _REFUSED,
            repeats=never or "the machine has not settled",
        )
    elif abs(steady.speed_drift) > DRIFT and not never:
        warn(
            "speed drifts",
            "steady running: the machine still {moves}: the change of its speed over the evaluated turns is "
            "{speed_drift} of the ripple, so that ripple and RMS are not those of steady running; raise "
            "run.settle_turns.",
            STEADY,
            moves="speeds up" if steady.speed_drift > 0.0 else "slows down",
            speed_drift=(abs(steady.speed_drift), "1", "percent"),
        )
    elif abs(steady.energy_gap) > STORED and not never:
        warn(
            "energy taken up",
            "steady running: the moving masses {take}, over the evaluated turns {energy_gap} of the energy that "
            "passes the motor's shaft. {means} peaks, RMS and ripple are not those of "
            "steady running: raise run.settle_turns.",
            STEADY,
            take="still take up energy" if steady.energy_gap > 0.0 else "still give energy",
            energy_gap=(abs(steady.energy_gap), "1", "percent"),
            means="Mean powers are told without it;" if lasts(study) else f"{_REFUSED.strip()} The",
        )
    if steady.winding_temperature is not None and not math.isfinite(steady.winding_temperature):
        warn(
            "no thermal steady state",
            "steady running: the winding has no thermal steady state, its loss grows faster than the cooling.",
            STEADY,
        )


_REFUSED = (
    " Mean power, electric power and the temperature of the winding have no value: no mean of these turns stands for "
    "running that lasts."
)


_FULL_STAR = 0.8
"""Share of the synchronous speed from which on a motor in star may be changed over to delta: below it the current
jumps almost to the one of a start direct on line."""


def _on_star(study: StudyRecord) -> None:
    """Warn of a change from star to delta at too low a speed."""
    drive, time = study.drive, study.drive.time_in_star
    if not time or study.plate is None:
        return
    run = study.runs["start_up"]
    times, speeds = run["time"].values, run["motor.w"].values
    current = np.abs(run[f"motor.{drive.motor.current}"].values)
    share = float(np.interp(time, times, speeds)) / study.plate.nameplate.synchronous
    if share < _FULL_STAR and times[-1] > drive.switched_until:
        study.warn(
            "star too short",
            "start-up: after {time} in star the motor has {share} of its synchronous speed, and the current jumps "
            "from {star} to {delta}. Take more time in star (starter.star_delta.time), less load, or another start.",
            START,
            time=(time, "s"),
            share=(share, "1", "percent"),
            star=(float(np.interp(time, times, current)), "A"),
            delta=(peak(current[times >= drive.switched_until]), "A"),
        )


_HAPPENINGS = {
    "rod end pushed": "An end of a rod is pushed, though the rod is pulled in the mean; more rods are nearer to a "
    "chain",
    "current limit": "The motor runs into its current limit of {limit}",
    "stall": "The {driver} stands after the event",
    "slowed": "The motor is pulled below half its speed, as in a stall",
    "trip": "The torque limiter opens after the event",
    "not recovered": "The speed does not return to its steady band within the time followed",
}
"""By kind of happening in a run, the begin of its warning, with the limit that is exceeded."""


def _on_runs(study: StudyRecord) -> None:
    """A remark for each kind of happening in the runs, with all runs in which it occurred."""
    limits: dict[str, Amount] = {}
    if (largest := study.drive.motor.current_limit(study.motor)) is not None:
        limits["current limit"] = largest, "A"
    happenings = [(name, *each) for name in study.answers for each in _happenings(study, name)]
    for kind in dict.fromkeys(kind for _, kind, *_ in happenings):
        runs = {name: (text, amounts) for name, each, text, amounts in happenings if each == kind}
        where = (f"{study.title_of(name)}{f' ({text})' if text else ''}" for name, (text, _) in runs.items())
        limit = {"passed": limits[kind]} if kind in limits else {}
        study.warn(
            kind,
            f"{_HAPPENINGS[kind]}: {{where}}.",
            *runs,
            where="; ".join(where),
            limit=number(*limits[kind], full=False) if limit else "",
            **limit,
            **{f"{name}.{size}": x for name, (_, amounts) in runs.items() for size, x in amounts.items()},
        )


def _happenings(study: StudyRecord, name: str) -> Iterator[tuple[str, str, dict[str, Amount]]]:
    """Each happening in a run: its kind, its numbers in words, and its numbers as data."""
    config, answers = study.config, study.answers[name]
    pulls = answers.web_pull_least, answers.wall_pull_least
    is_pushed = any(pull is not None and pull < 0.0 for pull in pulls)
    if answers.slack_time == 0.0 and is_pushed:
        yield "rod end pushed", "", {}
    largest = study.drive.motor.current_limit(study.motor)
    if largest is not None and answers.current_peak > 0.999 * largest:
        yield "current limit", "", {}
    if answers.stall_time is not None:
        late = answers.stall_time > 10.0 * config.run.step
        after = f"after {number(answers.stall_time, 's')}{'' if late else ', as it hardly turned before'}"
        yield "stall", after, {"stall_time": (answers.stall_time, "s")}
    if (dip := slowed(study).get(name)) is not None:
        yield "slowed", f"by {number(dip, '1', 'percent')}", {"speed_dip": (dip, "1", "percent")}
    if answers.coupling_trip_time is not None:
        units = {"coupling_trip_time": "s", "energy_after_trip": "J", "energy_behind": "J"}
        amounts: dict[str, Amount] = {each: (getattr(answers, each), unit) for each, unit in units.items()}
        time, energy, behind = (number(*amount) for amount in amounts.values())
        stays = "the machine behind it is an FMU and is not followed"
        if answers.energy_behind is not None:
            stays = f"{behind} stay behind it"
        yield "trip", f"after {time}; {energy} pass it while it opens, {stays}", amounts
    elif name in config.events and answers.recovery_time is None and study.returns:
        yield "not recovered", "", {}


def _on_rotor(study: StudyRecord) -> None:
    """Note a peak of the motor's torque that is not of the load, but of the rotor, whose speed swings."""
    torque, acceleration = (study.steady[f"motor.{name}"].values for name in ("air_gap_tau", "a"))
    most, load = peak(torque), peak(torque - study.drive.fmu_parameters.rotor.J * acceleration)
    if most > 1.05 * load:
        study.note(
            "rotor accelerates",
            "steady running: load and losses take {load} at the motor's shaft at most, and the motor gives {most}: "
            "the rest accelerates its rotor, as the speed swings by {ripple}.",
            STEADY,
            load=(load, "N.m"),
            most=(most, "N.m"),
            ripple=(study.answers[STEADY].speed_ripple, "1", "percent"),
        )


def _on_inverter(study: StudyRecord) -> None:
    """Note the slip compensation, and the inverter to order by the currents of all starts and events."""
    rated_current = study.drive.rated_current
    if rated_current is None or study.config.drive.start != "inverter":
        return
    if SLIP not in study.config.file.given:
        slip = study.drive.parameters.inverter.slip
        without = (
            "The inverter does not compensate the slip of the motor (starter.inverter.slip): it would raise "
            "its frequency in each peak of the load, where the flywheel has to slow down to give its energy."
        )
        compensated = (
            "The inverter compensates the rated slip of the motor by {slip} (starter.inverter.slip)."
        )
        study.note("slip compensation", compensated if slip else without, slip=(slip, "Hz/(N.m)"))
    need, overload = inverter_need(study), study.config.drive.starter.overload
    if need is None:
        return
    high = {case: peak for case, peak in need.peaks.items() if peak > 1.001 * overload * rated_current}
    if not high and need.current <= 1.001 * rated_current:
        if study.proposal is not None:
            study.note(
                "inverter current",
                "An inverter with the rated current of the motor, {rated}, suffices for running, all starts and all "
                "events: it carries {overload} times that for up to 60 s (starter.overload).",
                rated=(rated_current, "A"),
                overload=f"{overload:g}",
            )
        return
    study.note(
        "inverter current",
        "An inverter carries {overload} times its rated current for up to 60 s (starter.overload): order one of at "
        "least {current}, for {case}{limited}. Times the rated {rated} of the motor: {cases}.",
        overload=f"{overload:g}",
        current=(need.current, "A"),
        case=need.case,
        rated=(rated_current, "A"),
        cases="; ".join(f"{case} ({number(peak / rated_current, '1')})" for case, peak in need.peaks.items()),
        limited=_limited(study),
    )


def _limited(study: StudyRecord) -> str:
    """Words on the starts with the current limit of an inverter with the rated current of the motor, to follow the
    order; empty where there are none."""
    found = StartFindings.found_in(study)
    if found is None or found.current_limit is None:
        return ""
    held = number(found.current_limit, "A")
    limit = f"one with the rated current of the motor, whose own limit of {held} holds its frequency back"
    if stuck := [start for start in found.limited if start.start_time is None]:
        where = " and ".join(number(start.angle, "rad") for start in stuck)
        return f"; {limit}, does not bring the {study.driver_noun} to its speed from {where}"
    time = number(max(start.start_time or 0.0 for start in found.limited), "s")
    return f"; {limit}, starts in up to {time}"


def _on_assumptions(study: StudyRecord) -> None:
    """Note the effect of the assumption of an event on its peaks."""
    coupling = study.config.coupling
    for name, spread in study.spreads.items():
        event = study.config.events[name]
        without = " These peaks are without the torque limiter, which opens at {trip}." if coupling else ""
        low, high = spread.peaks["crank_torque"]
        study.note(
            "assumption",
            "{title}: {text}" + without,
            name,
            title=event.title,
            text=event.assumption(spread.peaks),
            trip=number(coupling.trip_torque, "N.m") if coupling else "",
            crank_torque_low=(low, "N.m"),
            crank_torque_high=(high, "N.m"),
        )
