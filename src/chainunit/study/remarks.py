"""The remarks of a study, which the reader needs beside the numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator, Set
from dataclasses import replace
from importlib import import_module
from pkgutil import iter_modules

import numpy as np

from ..reading.text import aside, number
from .analyses import all_analyses
from .arrays import Dataset, peak
from .catalogue_drive import SLIP
from .coupling import remark_on_coupling, remark_on_rams
from .cycle import cycle
from .inverter import inverter_need
from .judgement import lasts, model_verdict, motor_limits, no_reserve, slowed
from .measures import STARTED, Answers
from .parts import LENGTHS
from .permitted_starts import standard_inertia
from .readings import breakdown_speed, crank_speed, has_turn, less_than_a_turn
from .record import LOAD_CYCLE, StudyFindings, StudyRecord, StudyRuns, StudySetup
from .registry import capabilities, parts_of_line
from .remark import DECLARED, SEVERITIES, Remark, RemarkCode, fault, note, warning
from .start_runs import speed_in_star
from .starts import FULL_STAR, StartFindings
from .verdict import START, STEADY, shown_speed
from .window import CLOSED, DRIFT, STORED

WITHOUT_COMPILER = note(
    "no-compiler",
    "No C compiler was found, so that the FMUs run in Python. With one the runs take about a tenth of the time.",
    remedy="Install gcc or clang, or the compiler that comes with pip install 'chainunit[cross]'.",
)
EVENT_LEFT_OUT = note("event-left-out", "{title}: it was left out, as {reason}.")
STATE_NOT_SAVED = note(
    "state-not-saved",
    "{title} cannot save its state (canGetAndSetFMUstate). Each event was run from rest, through the same start-up. "
    "With an FMU that can, the study takes less time.",
)
NO_ACCELERATION = fault(
    "no-acceleration",
    "{title} does not give its acceleration (a). Torques and forces of the machine are those at constant speed, "
    "without the work that changes its speed. Give the FMU an output a, or its name in system.motor_names.",
)


def conclude(study: StudyRecord) -> None:
    """Judge the model, and add every remark to the study."""
    config, machine = study.setup.config, study.setup.drive.foreign_machine
    if config.file.is_packaged:
        study.findings.say(_PACKAGED)
    elif config.file.of_example:
        study.findings.say(_OF_EXAMPLE)
    elif machine:
        study.findings.say(_FOREIGN, description=machine.model.description)
    else:
        study.findings.say(_DEFAULTS)
    if any(value for name, value in study.setup.drive.machine.by_name.items() if name.endswith("friction")):
        study.findings.say(_FRICTION)
    for value in config.file.unusual:
        if value.with_unit:
            study.findings.say(_UNUSUAL, value=str(value))
    if (lengths := lengths_of_example(config.file.given, bool(config.machine.model.sides))) is not None:
        study.findings.remarks.append(lengths)
    if left_out := list(_left_out(study.setup)):
        study.findings.say(_LEFT_OUT, what=" and ".join(left_out))
    if study.runs.answers:
        study.findings.verdict = replace(model_verdict(study), step=config.run.step)
        motor = study.setup.drive.foreign
        if motor is not None and "a" not in motor.connectors:
            study.findings.say(NO_ACCELERATION, title=motor.title)
            study.findings.verdict = study.findings.verdict.without_acceleration()
        study.findings.remarks += study.findings.verdict.details(study.runs.titles)
    config.organs.remark(study)
    if STEADY in study.runs.answers:
        _on_start(study)
        _on_star(study)
        _on_inertia(study)
        if not study.setup.drive.foreign_machine:
            _on_backward_pull(study.setup, study.findings)
        _on_limits(study)
        _on_steady_running(study, study.runs.answers[STEADY])
        if study.setup.drive.foreign is None:
            _on_rotor(study)
            _on_hunting(study.setup, study.runs.steady, study.findings)
    of_drive = None if study.setup.proposal is None else study.setup.proposal.findings
    if of_drive is not None:
        of_drive.remark(study)
    if config.coupling is not None:
        if STEADY in study.runs.answers:
            remark_on_coupling(study, config.coupling.trip_torque)
        remark_on_rams(study, config.coupling.trip_torque)
    _on_runs(study)
    _on_inverter(study)
    _on_assumptions(study)
    for part in parts_of_line():
        part.remark(study)
    for findings in study.findings.by_analysis.values():
        if findings is not of_drive:
            findings.remark(study)


_PACKAGED = note("assumed-packaged", "Masses, pins, feed and drive are assumed, as the papers print none.")
_OF_EXAMPLE = note(
    "assumed-of-example",
    "Values that the study file does not name come from the packaged example, whose masses and drive are assumed.",
)
_FOREIGN = note(
    "assumed-of-foreign-machine",
    "The machine is an FMU, {description}. Values that the study file does not name are the start values of this "
    "FMU, which alone computes the turn at constant speed. Its bearings and its motion behind an open coupling are "
    "not known.",
)
_DEFAULTS = note("assumed", "Values that no file names are the program's defaults, which are assumed.")
_FRICTION = note(
    "smoothed-friction",
    "Static friction is not modelled, and breakaway torque from a loaded stop is not included.",
)
_UNUSUAL = note("unusual-value", "By the file, {value}.")
_LEFT_OUT = note(
    "values-left-out",
    "The file leaves out {what}. The packaged values are used, and the result depends on them.",
)
_LENGTHS_OF_EXAMPLE = note(
    "lengths-of-example",
    "The file gives the lengths {stated} of the chain unit. The lengths {others} come from the example, and "
    "may not suit them.",
    remedy="Give them, too, or rho = r/l, lam, mu, zeta, l and l1 in [ratios], from which all follow.",
)


def lengths_of_example(given: Set[str], has_sides: bool) -> Remark | None:
    """The remark on a chain unit, which has sides, of which the file gives some lengths alone, by the names of all
    values that it gives; None for another machine."""
    stated = [name for name in LENGTHS if f"machine.{name}" in given]
    others = [name for name in LENGTHS if name not in stated]
    if not stated or not others or not has_sides or any(name.startswith("ratios.") for name in given):
        return None
    return _LENGTHS_OF_EXAMPLE.remark(stated=", ".join(stated), others=", ".join(others))


_RATING = ("limit.i", "limit.v", "armature.k")
"""Parameters that limit the torque of a motor without a nameplate."""


def _left_out(setup: StudySetup) -> Iterator[str]:
    """Values that decide the result, but that the file leaves out, so that the packaged values are used."""
    config, coupling = setup.config, setup.config.coupling
    if config.file.is_packaged:
        return
    if coupling is not None and "coupling.trip_torque" not in config.file.given:
        yield f"coupling.trip_torque ({number(coupling.trip_torque, 'N.m', full=False)})"
    if config.plate is not None and "system.motor" in config.file.of_example:
        yield f"the motor ({config.plate.designation})"
    elif setup.proposal is None and setup.drive.foreign is None:
        values = setup.drive.motor.parameter_layout.by_name(setup.drive.parameters)
        units = {v.name: v.unit for v in setup.drive.motor.parameter_layout.variables}
        names = [name for name in _RATING if f"motor.{name}" in config.file.of_example]
        if names:
            sizes = (f"{name} = {number(values[name], units[name], full=False)}" for name in names)
            yield f"the rating of the motor ({', '.join(sizes)})"


def _on_start(study: StudyRecord) -> None:
    """Warn where the feed came to a machine that did not have its speed yet."""
    feed_time = study.runs.started.rig.fed_from if study.runs.started else None
    if feed_time is None:
        return
    run = study.runs.series["start_up"]
    speed = float(np.interp(feed_time, run["time"].values, crank_speed(study.setup.drive, run)))
    requested = study.setup.config.run.crank_speed
    # the row at which the speed is passed is the last of the start
    if speed < STARTED * requested:
        study.findings.say(
            _FED_BEFORE_SPEED,
            START,
            fed=feed_time,
            speed=speed,
            asked=number(requested, "rad/s", "speed", full=False, beside=False),
        )


_FED_BEFORE_SPEED = fault(
    "fed-before-speed",
    "In the start-up the motor does not bring the empty machine to its speed in a reasonable time. The feed comes "
    "after {fed}, with the {driver} at {speed} in place of {asked}.",
    remedy="Take a larger motor or a lighter flywheel.",
    sizes={"s": "fed", ("rad/s", "speed"): "speed"},
)
_HEAVIER = "Take a larger motor, less load, or for a load that comes and goes a heavier flywheel."
_LIMITS = {
    "temperature": warning(
        "motor-temperature",
        "In steady running the winding comes to {value} if it goes on for ever, permitted is {limit} ({key}).",
        remedy=_HEAVIER,
    ),
    "current": warning(
        "motor-current",
        "In steady running the RMS current is {value}, rated is {limit}. A lasting excess overheats the motor.",
        remedy=_HEAVIER,
    ),
    "start": warning(
        "motor-start",
        "The start-up takes {value}, with up to {peak}. The rotor of a warm motor may be locked for {limit}, and a "
        "start that takes longer overheats it as a locked rotor does.",
        remedy='Take a lighter flywheel, a larger motor, or start = "inverter".',
        sizes={"A": "peak"},
    ),
}
"""By limit of the motor, the warning if it is exceeded."""
_NO_RESERVE = fault(
    "no-reserve",
    "In steady running of the motor {passes}. A heavier load or a dip of the voltage stalls it{turns}.",
    remedy="Take a larger motor or a heavier flywheel.",
    sizes={("1", "percent"): "over"},
)


def _on_limits(study: StudyRecord) -> None:
    """Warn where the motor exceeds a limit in its start or in steady running."""
    runs, findings, steady = study.runs, study.findings, study.runs.answers[STEADY]
    key, permitted = study.setup.config.permitted_temperature
    for name, check in motor_limits(study).items():
        if not check.over:
            continue
        value, limit = check.value, check.limit
        if name == "temperature":
            value, limit = steady.winding_temperature, permitted
            if not math.isfinite(value):
                # that case has its own remark
                continue
        findings.say(
            _LIMITS[name],
            START if name == "start" else STEADY,
            value=(value, check.unit),
            limit=(limit, check.unit),
            **({"peak": runs.start.current_peak if runs.start else 0.0} if name == "start" else {}),
            key=key,
        )
    if steady.torque_reserve is not None and steady.torque_reserve < 0.0:
        findings.say(
            _NO_RESERVE,
            STEADY,
            turns="" if _stall_speed(runs, steady) is None else None,
            passes=no_reserve(STEADY, steady.torque_reserve),
            over=-steady.torque_reserve,
        )


def _stall_speed(runs: StudyRuns, steady: Answers) -> float | None:
    """The crank speed [rad/s] below which a load stalls the motor, if this motor is stalled; else None, as of one
    that still speeds up. It is not known for a foreign motor."""
    if runs.reaches or runs.drive.foreign is not None or steady.energy_gap > STORED:
        return None
    breakdown = breakdown_speed(runs.drive, runs.steady)
    return breakdown if steady.speed_mean < breakdown else None


def _speed_missed(code: str, why: str, remedy: str = "") -> RemarkCode:
    """The remark on a crank that misses its speed, with the reason `why`."""
    missed = "In steady running the {driver} turns at {speed_mean} in place of {asked}."
    begin = "The overloads begin from this state{overloads}."
    return fault(code, missed, why, begin, remedy=remedy, sizes={("rad/s", "speed"): "speed_mean"})


_STALLED = _speed_missed(
    "motor-below-pull-out", "The motor stalls below its pull-out speed, {below}.", _HEAVIER
)
_SPEEDS_UP = _speed_missed(
    "start-does-not-end",
    "The machine still speeds up, too slowly for a start that ends.",
    "Take a larger motor, a lighter flywheel or less load.",
)
_AT_ITS_LIMIT = _speed_missed(
    "speed-missed", "The motor's voltage or current is at its limit, or the run is too short to settle."
)
_BY_SLIP = _speed_missed(
    "speed-by-slip", "A motor on the line takes the speed that gear ratio and slip give."
)


def _why_missed(runs: StudyRuns, steady: Answers) -> RemarkCode:
    """The remark on a crank that does not turn at the requested speed, by the reason."""
    if _stall_speed(runs, steady) is not None:
        return _STALLED
    if steady.energy_gap > STORED:
        return _SPEEDS_UP
    return _AT_ITS_LIMIT if runs.drive.follows else _BY_SLIP


_NO_MEAN = (
    "Mean power, electric power and the temperature of the winding have no value{refused}.",
    "No mean of these turns stands for running that lasts{refused}.",
)
_NO_TURN = fault(
    "no-whole-turn",
    f"In steady running {{made}}, so that means are over this time and there is no {LOAD_CYCLE}.",
    *_NO_MEAN,
)
_NOT_CLOSED = fault(
    "turns-do-not-close",
    "In steady running the turns do not close, as their ends differ by {cycle_gap} in speed or torque ({repeats}).",
    *_NO_MEAN,
    remedy="Raise run.settle_turns or run.turns.",
    sizes={("1", "percent"): "cycle_gap"},
)
_SPEED_DRIFTS = fault(
    "speed-drifts",
    "In steady running the machine still {moves}. The change of its speed over the evaluated turns is {speed_drift} "
    "of the ripple. Ripple and RMS are not those of steady running.",
    remedy="Raise run.settle_turns.",
    sizes={("1", "percent"): "speed_drift"},
)
_ENERGY_TAKEN = fault(
    "energy-taken-up",
    "In steady running the moving masses {take}, over the evaluated turns {energy_gap} of the energy that passes "
    "the motor's shaft. Mean powers are given without it{lasts}.",
    *_NO_MEAN,
    "The peaks, RMS and ripple are not those of steady running.",
    remedy="Raise run.settle_turns.",
    sizes={("1", "percent"): "energy_gap"},
)
_NO_THERMAL = fault(
    "no-thermal-steady-state",
    "In steady running the winding has no thermal steady state, as its loss grows faster than the cooling.",
)


def _on_steady_running(study: StudyRecord, steady: Answers) -> None:
    """Say what steady running lacks: the speed asked for; a whole turn, or turns that close, or a speed and an energy
    that stay, the first of these alone; a final temperature."""
    setup, runs, findings = study.setup, study.runs, study.findings
    requested, never = setup.config.run.crank_speed, setup.drive.simulated_machine.model.never_repeats
    refused = None if lasts(runs) else ""
    if not runs.reaches:
        from_here = any(not setup.config.events[name].from_rest for name in runs.overloads)
        below = _stall_speed(runs, steady)
        findings.say(
            _why_missed(runs, steady),
            STEADY,
            speed_mean=shown_speed(steady.speed_mean, requested),
            asked=number(requested, "rad/s", "speed", full=False),
            below=None if below is None else number(below, "rad/s", "speed", beside=False),
            overloads="" if from_here else None,
        )
    if not has_turn(setup.drive, runs.steady):
        findings.say(_NO_TURN, STEADY, made=less_than_a_turn(setup.drive, runs.steady), refused=refused)
    elif steady.cycle_gap > CLOSED:
        findings.say(
            _NOT_CLOSED,
            STEADY,
            cycle_gap=steady.cycle_gap,
            refused=refused,
            repeats=never or "the machine has not settled",
        )
    elif abs(steady.speed_drift) > DRIFT and not never:
        findings.say(
            _SPEED_DRIFTS,
            STEADY,
            moves="speeds up" if steady.speed_drift > 0.0 else "slows down",
            speed_drift=abs(steady.speed_drift),
        )
    elif abs(steady.energy_gap) > STORED and not never:
        findings.say(
            _ENERGY_TAKEN,
            STEADY,
            take="still take up energy" if steady.energy_gap > 0.0 else "still give energy",
            energy_gap=abs(steady.energy_gap),
            lasts="" if lasts(runs) else None,
            refused=refused,
        )
    if steady.winding_temperature is not None and not math.isfinite(steady.winding_temperature):
        findings.say(_NO_THERMAL, STEADY)


_STAR_TOO_SHORT = warning(
    "star-too-short",
    "In a start from {angle} the change from star to delta comes at {share} of the synchronous speed, after {time}. "
    "The current jumps almost to the one of a start direct on line, {delta}.",
    remedy="Take more time in star (starter.star_delta.time), less load, or another start.",
    sizes={"s": "time", ("1", "percent"): "share", "A": "delta", "rad": "angle"},
)
_LITTLE_STAR = 0.9
"""Share of the synchronous speed up to which a change to delta has little reserve: at 95 % of the voltage a motor has
a tenth less torque."""
_STAR_JUST_LONG = note(
    "star-just-long-enough",
    "In a start from {angle} the change from star to delta comes at {share} of the synchronous speed. If the voltage "
    "dips or the motor is weaker, it comes below 80 %, and is as hard as a start direct on line.",
    remedy="Take more time in star (starter.star_delta.time).",
    sizes={("1", "percent"): "share", "rad": "angle"},
)
_STANDING = 0.1
"""Share of the synchronous speed up to which a motor in star has not broken its load away."""
_STANDS_IN_STAR = warning(
    "stands-in-star",
    "The load holds the motor in star {where}, and the change to delta takes {delta}, as a start direct on line.",
    "From the other angles it reaches {share} of its synchronous speed or more.",
    remedy="Let the machine start empty (empty_start = true), or take another start.",
    sizes={"A": "delta", ("1", "percent"): "share"},
)


def _on_star(study: StudyRecord) -> None:
    """Warn of a motor that stands in star, and of a change from star to delta at too low a speed, in any start: from
    the angle 0, which the study runs, and from all others, if they were run. Speeds are shares of the synchronous
    one at the end of the time in star."""
    drive, run = study.setup.drive, study.runs.series["start_up"]
    share_from_0 = speed_in_star(drive, run)
    if share_from_0 is None or study.setup.plate is None:
        return
    findings, times = StartFindings.found_in(study.findings), run["time"].values
    starts = () if findings is None else findings.starts
    after_change = np.abs(run[f"motor.{drive.motor.current}"].values)[times >= drive.star.end]
    delta = float(max([*after_change, *(start.current for start in starts)], default=0.0))
    shares = {start.angle: start.star_speed for start in starts if start.star_speed is not None}
    if standing := [angle for angle, share in shares.items() if share < _STANDING]:
        angles = ", ".join(number(angle, "rad") for angle in standing)
        where = f"from {len(standing)} of {len(starts)} angles ({angles})"
        least = min((share for angle, share in shares.items() if angle not in standing), default=None)
        study.findings.say(_STANDS_IN_STAR, START, where=where, share=least, delta=delta)
        return
    share, angle = min([(share_from_0, 0.0), *((share, angle) for angle, share in shares.items())])
    if times[-1] <= drive.star.end or share >= _LITTLE_STAR:
        return
    if share < FULL_STAR:
        time = drive.star.time
        study.findings.say(_STAR_TOO_SHORT, START, time=time, share=share, angle=angle, delta=delta)
    else:
        study.findings.say(_STAR_JUST_LONG, START, share=share, angle=angle)


_HEAVY = warning(
    "heavy-to-start",
    "The machine has {inertia} at the motor's shaft. IEC 60034-12 demands no more than {most} of a motor.",
    remedy="Ask the maker of the motor.",
    sizes={"kg.m2": "inertia most"},
)


def _on_inertia(study: StudyRecord) -> None:
    """Warn of an inertia beyond the one that each motor brings up to speed."""
    setup, plate = study.setup, study.setup.plate
    if plate is None:
        return
    limit = standard_inertia(setup.drive, plate.nameplate, study.runs.steady, setup.config.drive.start)
    if limit is not None and limit[0] > limit[1]:
        study.findings.say(_HEAVY, START, inertia=limit[0], most=limit[1])


_PULLED_BACK = warning(
    "pulled-back",
    "The load turns the {driver} backwards without the motor, with {torque} or more from any angle.",
    "A backstop (holdback) or a brake is needed.",
    sizes={"N.m": "torque"},
)


def _on_backward_pull(setup: StudySetup, findings: StudyFindings) -> None:
    """Warn of a load that no angle of the crank holds without the motor. A self-locking gear holds it."""
    config, drive = setup.config, setup.drive
    # at a tenth of the speed backwards the friction is whole, and the resistance of air or liquid small
    torque = np.min(cycle(config.machine, -0.1 * config.run.crank_speed, config.feed).crank_torque)
    if torque > 0.0 and drive.gear.loss < 1.0:
        findings.say(_PULLED_BACK, STEADY, torque=float(torque))


_HAPPENINGS = {
    code.code: code
    for code in (
        warning(
            "rod-end-pushed",
            "An end of a rod is pushed, though the rod is pulled in the mean: {where}.",
            remedy="More rods are nearer to a chain.",
        ),
        warning(
            "bar-overloaded",
            "The bar between the rockers passes its permitted stress: {where}.",
            remedy="Take a thicker bar (machine.bar.diameter), or bring the load towards the middle.",
            sizes={("N/m2", "stress"): "bar_stress_peak"},
        ),
        warning(
            "lifts-off",
            "A follower would lift off its cam, as the force of the contact falls below 0: {where}.",
            remedy="Take a stronger spring, less mass, a slower rise, or a groove that guides the roller.",
            sizes={("N", "", 3, "least force of the contact"): "least"},
        ),
        warning(
            "current-limit",
            "The motor runs into its current limit of {passed}: {where}.",
            sizes={"A": "passed"},
        ),
        fault("stall", "The {driver} stands after the event: {where}.", sizes={"s": "stall_time"}),
        warning(
            "slowed",
            "The motor is pulled below half its speed, as in a stall: {where}.",
            sizes={("1", "percent"): "speed_dip"},
        ),
        warning(
            "trip",
            "The torque limiter opens after the event: {where}.",
            sizes={"s": "coupling_trip_time", "J": "energy_after_trip energy_behind"},
        ),
        warning(
            "not-recovered",
            "The speed does not return to its steady band within the time followed: {where}.",
            remedy="Follow it for more turns (turns in [[event]]).",
        ),
    )
}
"""By code, the remarks on a happening in runs."""


def _on_runs(study: StudyRecord) -> None:
    """A remark for each kind of happening in the runs, with all runs in which it occurred."""
    ran, drive = study.runs, study.runs.drive
    happenings = [(name, *happening) for name in ran.answers for happening in _happenings(ran, name)]
    for code in dict.fromkeys(code for _, code, *_ in happenings):
        runs = {name: (text, sizes) for name, kind, text, sizes in happenings if kind == code}
        where = (f"{ran.title_of(name)}{aside(text)}" for name, (text, _) in runs.items())
        passed = {"passed": drive.motor.current_limit(drive.parameters)}
        limit = passed if code == "current-limit" else {}
        study.findings.say(
            _HAPPENINGS[code],
            *runs,
            where="; ".join(where),
            **limit,
            **{f"{name}.{size}": x for name, (_, sizes) in runs.items() for size, x in sizes.items()},
        )


def _happenings(runs: StudyRuns, name: str) -> Iterator[tuple[str, str, dict[str, float | None]]]:
    """Each happening in a run: its code, its numbers in words, and its numbers as data."""
    answers, drive = runs.answers[name], runs.drive
    pulls = answers.web_pull_least, answers.wall_pull_least
    is_pushed = any(pull is not None and pull < 0.0 for pull in pulls)
    if answers.slack_time == 0.0 and is_pushed:
        yield "rod-end-pushed", "", {}
    if (stress := answers.bar_stress_peak) is not None and stress > drive.machine.p.bar.limit:
        yield "bar-overloaded", number(stress, "N/m2", "stress"), {"bar_stress_peak": stress}
    run = runs.steady if name == STEADY else runs.series[name]
    contacts = {x: float(run[f"machine.{x}"].min()) for x in drive.machine.model.contacts}
    if lifting := {x.removesuffix(".normal"): least for x, least in contacts.items() if least < 0.0}:
        text = ", ".join(f"{cam} with {number(least, 'N')}" for cam, least in lifting.items())
        yield "lifts-off", text, {"least": min(lifting.values())}
    largest = drive.motor.current_limit(drive.parameters)
    if largest is not None and answers.current_peak > 0.999 * largest:
        yield "current-limit", "", {}
    if answers.stall_time is not None:
        late = answers.stall_time > 10.0 * runs.operation.run.step
        after = f"after {number(answers.stall_time, 's')}{'' if late else ', as it hardly turned before'}"
        yield "stall", after, {"stall_time": answers.stall_time}
    if (dip := slowed(runs).get(name)) is not None:
        yield "slowed", f"by {number(dip, '1', 'percent')}", {"speed_dip": dip}
    if answers.coupling_trip_time is not None:
        names = ("coupling_trip_time", "energy_after_trip", "energy_behind")
        sizes = {key: getattr(answers, key) for key in names}
        time, energy, behind = (number(x, unit) for x, unit in zip(sizes.values(), "sJJ", strict=True))
        stays = "the machine behind it is an FMU and is not followed"
        if answers.energy_behind is not None:
            stays = f"{behind} stay behind it"
        yield "trip", f"after {time}; {energy} pass it while it opens, {stays}", sizes
    elif (
        name in runs.events and answers.recovery_time is None and answers.stall_time is None and runs.returns
    ):
        yield "not-recovered", "", {}


_ROTOR = note(
    "rotor-accelerates",
    "In steady running load and losses take {load} at the motor's shaft at most, and the motor gives {most}. The "
    "rest accelerates its rotor, as the speed swings by {ripple}.",
    sizes={"N.m": "load most", ("1", "percent"): "ripple"},
)
_NO_SLIP = note(
    "no-slip-compensation",
    "The inverter does not compensate the slip of the motor (starter.inverter.slip). It would raise its frequency "
    "in each peak of the load, where the flywheel has to slow down to give its energy.",
)
_SLIP = note(
    "slip-compensation",
    "The inverter compensates the rated slip of the motor by {slip} (starter.inverter.slip).",
    sizes={"Hz/(N.m)": "slip"},
)
_HUNTS = warning(
    "slip-compensation-hunts",
    "The slip compensation of the inverter lets the torque of the motor swing by {swing}, while its load swings by "
    "{load}.",
    remedy="Halve starter.inverter.slip, now {slip}.",
    sizes={"N.m": "swing load", "Hz/(N.m)": "slip"},
)
_DROOP = note(
    "inverter-droop",
    "The frequency of the inverter falls by {droop} at the rated torque of the motor (starter.droop).",
    sizes={("1", "percent"): "droop"},
)
_RATED_SUFFICES = note(
    "inverter-with-rated-current",
    "An inverter with the rated current of the motor, {rated}, suffices for running, all starts and all events. It "
    "carries {overload} times that for up to 60 s (starter.overload).",
    sizes={"A": "rated"},
)
_INVERTER = note(
    "inverter-current",
    "An inverter carries {overload} times its rated current for up to 60 s (starter.overload). One with the rated "
    "current of the motor, whose own limit of {held} holds its frequency back, {limited}. Times the rated {rated} "
    "of the motor: {cases}.",
    remedy="Order one of at least {current}, for {case}.",
    sizes={"A": "current rated held"},
)


def _on_rotor(study: StudyRecord) -> None:
    """Note a peak of the motor's torque that is not of the load, but of the rotor, whose speed swings."""
    torque, acceleration = (study.runs.steady[f"motor.{name}"].values for name in ("air_gap_tau", "a"))
    most, load = peak(torque), peak(torque - study.setup.drive.fmu_parameters.rotor.J * acceleration)
    if most > 1.05 * load:
        ripple = study.runs.answers[STEADY].speed_ripple
        study.findings.say(_ROTOR, STEADY, load=load, most=most, ripple=ripple)


def _on_hunting(setup: StudySetup, steady: Dataset, findings: StudyFindings) -> None:
    """Warn of slip compensation that lets the torque swing by 30 % of the rated one more than the load does."""
    drive, plate = setup.drive, setup.plate
    names = "motor.air_gap_tau", "machine.tau_bias"
    if plate is None or not drive.follows or names[1] not in steady:
        return
    swing, load = (float(np.ptp(steady[full].values)) for full in names)
    load, slip = load / drive.whole_line.ratio, drive.parameters.inverter.slip
    if slip > 0.0 and swing > load + 0.3 * plate.nameplate.torque:
        findings.say(_HUNTS, STEADY, swing=swing, load=load, slip=slip)


def _on_inverter(study: StudyRecord) -> None:
    """Note slip compensation or droop, and the inverter to order by the currents of all starts and events."""
    rated_current = study.setup.drive.rated_current
    if rated_current is None or study.setup.config.drive.start != "inverter":
        return
    if SLIP not in study.setup.config.file.given:
        slip, droop = study.setup.drive.parameters.inverter.slip, study.setup.config.drive.starter.droop
        if droop:
            study.findings.say(_DROOP, droop=droop)
        elif slip:
            study.findings.say(_SLIP, slip=slip)
        else:
            study.findings.say(_NO_SLIP)
    need, overload = inverter_need(study), study.setup.config.drive.starter.overload
    if need is None:
        return
    high = {case: peak for case, peak in need.peaks.items() if peak > 1.001 * overload * rated_current}
    if not high and need.current <= 1.001 * rated_current:
        if study.setup.proposal is not None:
            study.findings.say(_RATED_SUFFICES, rated=rated_current, overload=f"{overload:g}")
        return
    held, limited = _limited(study)
    study.findings.say(
        _INVERTER,
        overload=f"{overload:g}",
        current=need.current,
        case=need.case,
        rated=rated_current,
        cases="; ".join(f"{case} ({number(peak / rated_current, '1')})" for case, peak in need.peaks.items()),
        held=held,
        limited=limited,
    )


def _limited(study: StudyRecord) -> tuple[float | None, str]:
    """The current limit of an inverter with the rated current of the motor [A], and words on the starts with it; None
    where there are none."""
    findings = StartFindings.found_in(study.findings)
    if findings is None or findings.current_limit is None:
        return None, ""
    if stuck := [start for start in findings.limited if start.start_time is None]:
        where = " and ".join(number(start.angle, "rad") for start in stuck)
        driver = study.setup.driver_noun
        return findings.current_limit, f"does not bring the {driver} to its speed from {where}"
    time = number(max(start.start_time or 0.0 for start in findings.limited), "s")
    return findings.current_limit, f"starts in up to {time}"


_ASSUMPTION = note(
    "assumption",
    "{title}: {text}",
    "These peaks are without the torque limiter, which opens at {trip}.",
    sizes={"N.m": "crank_torque_low crank_torque_high"},
)


def _on_assumptions(study: StudyRecord) -> None:
    """Note the effect of the assumption of an event on its peaks."""
    coupling = study.setup.config.coupling
    for name, spread in study.runs.spreads.items():
        event = study.setup.config.events[name]
        low, high = spread.peaks["crank_torque"]
        study.findings.say(
            _ASSUMPTION,
            name,
            title=event.title,
            text=event.assumption(spread.peaks),
            trip=number(coupling.trip_torque, "N.m") if coupling else None,
            crank_torque_low=low,
            crank_torque_high=high,
        )


def declared_remarks() -> list[RemarkCode]:
    """All declared remarks, the gravest first, then by code."""
    all_analyses()
    for part in capabilities():
        folder = import_module(str(import_module(type(part).__module__).__package__))
        for module in iter_modules(folder.__path__):
            import_module(f"{folder.__name__}.{module.name}")
    order = list(SEVERITIES)
    return sorted(DECLARED.values(), key=lambda declared: (order.index(declared.severity), declared.code))
