"""What the reader has to know beside the numbers, and whether model and motor do what is asked of them."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ..drives.cardan import ORDERS, two_joints
from ..drives.dc_motor import DcMotor
from ..engines import numpy_
from ..text import number
from .coupling import peaks_on_coupling, remark_on_coupling
from .judgement import model_verdict
from .measures import Answers, reaches
from .rig import CLOSED
from .sections import Chain
from .shaft import AMPLIFIED, NEAR
from .study import LOAD_CYCLE, Study
from .verdict import RESIDUAL, STEADY


def conclude(study: Study) -> None:
    """Judge the model, and add every remark to the study."""
    config = study.config
    if config.source == "packaged example":
        study.remark("note", "assumed", "Masses, pins, feed and drive are assumed; the papers print none.")
    else:
        study.remark(
            "note",
            "assumed",
            "What the study file does not name is the packaged example's, whose masses and drive are assumed.",
        )
    study.remark(
        "note",
        "smoothed friction",
        "Friction is smoothed: at rest nothing sticks, so that the torque to break away from a loaded "
        "stop is not in the start-up.",
    )
    if study.answers:
        study.verdict = model_verdict(study)
        for line in study.verdict.details(study.titles):
            study.remark("warning", "model", line)
    if config.chain is not None:
        _on_chains(study, config.chain)
    if STEADY in study.answers:
        _on_steady_running(study, study.answers[STEADY])
    if study.sizing is not None:
        for note in study.sizing.notes:
            study.remark("note", "sizing", note)
        if study.insufficient:
            study.remark("warning", "insufficient motor", f"{study.sizing.answer}. All runs are with it.")
    if config.coupling is not None and STEADY in study.answers:
        remark_on_coupling(study, config.coupling.trip_torque)
    _on_runs(study)
    _on_random_overloads(study)
    _on_assumptions(study)
    if study.statics.torsion is not None:
        _on_shaft(study)


def _on_steady_running(study: Study, steady: Answers) -> None:
    asked, config = study.config.run.crank_speed, study.config
    if not reaches(steady.speed_mean, asked):
        why = (
            "the motor's voltage or current is at its limit, or the run is too short to settle."
            if study.drive.follows
            else "a motor on the line takes the speed that gear ratio and slip give."
        )
        study.remark(
            "warning",
            "speed missed",
            f"steady running: the crank turns at {number(steady.speed_mean, 'rad/s')} in place of "
            f"{number(asked, 'rad/s', full=False)}; {why} Overloads are those of this state.",
            STEADY,
            speed_mean=(steady.speed_mean, "rad/s"),
            asked=(asked, "rad/s"),
        )
    if study.drive.whole_turns(study.steady) is None:
        study.remark(
            "warning",
            "no whole turn",
            "steady running: the crank does not make a whole turn; means are over all that was run, and there is no "
            f"{LOAD_CYCLE}.",
            STEADY,
        )
    elif steady.cycle_gap > CLOSED:
        repeats = "chains do not repeat a turn" if config.chain else "the machine has not settled"
        study.remark(
            "warning",
            "turns do not close",
            "steady running: the turns do not close, their ends differ by "
            f"{number(steady.cycle_gap, '1', 'percent')} in speed or torque: {repeats}; raise run.settle_turns or "
            "run.turns.",
            STEADY,
            cycle_gap=(steady.cycle_gap, "1"),
        )
    if not math.isfinite(steady.winding_temperature):
        study.remark(
            "warning",
            "no thermal steady state",
            "steady running: the winding has no thermal steady state, its loss grows faster than the cooling.",
            STEADY,
        )
    if study.ripple_without is not None:
        study.remark(
            "note",
            "feed-forward",
            "Feed-forward of the machine's torque brings the ripple of the speed from "
            f"{number(study.ripple_without, '1', 'percent')} to {number(steady.speed_ripple, '1', 'percent')}.",
            STEADY,
            without=(study.ripple_without, "1"),
            speed_ripple=(steady.speed_ripple, "1"),
        )


_HAPPENED = {
    "rod end pushed": "An end of a rod is pushed, though the rod is pulled in the mean; more rods are nearer to a "
    "chain",
    "current limit": "The motor runs into its current limit of {limit}",
    "gear passed": "The torque passes the gear's permitted {limit}",
    "stall": "The crank stands after the event",
    "trip": "The safety coupling opens after the event",
    "not recovered": "The speed does not return to its steady band within the time followed",
}
"""What may happen in a run, by kind, with the limit that it passes."""


def _on_runs(study: Study) -> None:
    """What happened in the runs, a remark for each kind of happening with all runs in which it did."""
    limits: dict[str, tuple[float, str]] = {"gear passed": (study.config.gear.torque_limit, "N.m")}
    if study.drive.motor is DcMotor:
        limits["current limit"] = study.motor.limit.i, "A"
    happenings = [(name, *each) for name in study.answers for each in _happenings(study, name)]
    for kind in dict.fromkeys(kind for _, kind, *_ in happenings):
        runs = {name: (shown, sizes) for name, each, shown, sizes in happenings if each == kind}
        limit = number(*limits[kind], full=False) if kind in limits else ""
        where = (f"{study.called(name)}{f' ({shown})' if shown else ''}" for name, (shown, _) in runs.items())
        study.remark(
            "warning",
            kind,
            f"{_HAPPENED[kind].format(limit=limit)}: {'; '.join(where)}.",
            *runs,
            **({"limit": limits[kind]} if kind in limits else {}),
            **{f"{name}.{size}": x for name, (_, sizes) in runs.items() for size, x in sizes.items()},
        )


def _happenings(study: Study, name: str) -> Iterator[tuple[str, str, dict[str, tuple[float | None, str]]]]:
    """What happened in a run: kind, numbers in words, the same as data."""
    config, answers = study.config, study.answers[name]
    pushed = answers.web_pull_least < 0.0 or answers.wall_pull_least < 0.0
    if answers.slack_time == 0.0 and pushed:
        yield "rod end pushed", "", {}
    if study.drive.motor is DcMotor and answers.current_peak > 0.999 * study.motor.limit.i:
        yield "current limit", "", {}
    peak = peaks_on_coupling(study).get(name, 0.0)
    if "gear.torque_limit" in config.given and peak > config.gear.torque_limit:
        yield "gear passed", number(peak, "N.m"), {"torque": (peak, "N.m")}
    if answers.stall_time is not None:
        late = answers.stall_time > 10.0 * config.run.step
        after = f"after {number(answers.stall_time, 's')}{'' if late else ', as it hardly turned before'}"
        yield "stall", after, {"stall_time": (answers.stall_time, "s")}
    if answers.coupling_trip_time is not None:
        time, passed, behind = (
            (answers.coupling_trip_time, "s"),
            (answers.energy_after_trip, "J"),
            (answers.energy_behind, "J"),
        )
        yield (
            "trip",
            f"after {number(*time)}; {number(*passed)} pass it while it opens, {number(*behind)} stay behind it",
            {"coupling_trip_time": time, "energy_after_trip": passed, "energy_behind": behind},
        )
    elif name in config.events and answers.recovery_time is None and study.returns:
        yield "not recovered", "", {}


def _on_random_overloads(study: Study) -> None:
    random = study.monte_carlo
    if random is None:
        return
    if random.remark:
        study.remark("note", "too few runs", f"overloads at random: {random.remark}")
    if random.left_out:
        study.remark(
            "note",
            "rows left out",
            f"overloads at random: {random.left_out} lines of {random.file.name} were no rows of this study and are "
            "left out; runs that they may have stood for were computed anew.",
            rows=(random.left_out, "1"),
        )


def _on_assumptions(study: Study) -> None:
    """What the assumption of an event makes of its peaks."""
    coupling = study.config.coupling
    for name, spread in study.spreads.items():
        event = study.config.events[name]
        text = f"{event.title}: {event.assumption(spread.peaks)}"
        if coupling:
            trip = number(coupling.trip_torque, "N.m")
            text += f" These peaks are without the safety coupling, which opens at {trip}."
        low, high = spread.peaks["crank_torque"]
        study.remark(
            "note", "assumption", text, name, crank_torque_low=(low, "N.m"), crank_torque_high=(high, "N.m")
        )


def _on_chains(study: Study, chain: Chain) -> None:
    """What the reader has to know of the chains."""
    (walls, webs), result = study.drive.rods, study.chain
    study.remark(
        "note",
        "chains",
        f"The organs are chains of {walls} + {webs} rods; their damping (eta {chain.eta:g} N m2 s, ends "
        f"{chain.end_damping:g} N m s), which a heavier organ wants larger, and folding are assumed.",
    )
    for band in result.avoid if result else ():
        if result and band.low <= result.own.speed <= band.high:
            study.remark(
                "warning",
                "speed to avoid",
                f"chains: the crank speed lies among those to avoid, {band}: {band.why}.",
                speed=(result.own.speed, "rad/s"),
            )
    if walls + webs < 4:
        study.remark(
            "note",
            "few rods",
            f"chains: {walls + webs} rods have {walls + webs - 2} natural frequencies; 8 rods show what a chain "
            "does.",
        )
    if result:
        for speed, why in result.failed.items():
            study.remark(
                "warning",
                "speed missing",
                f"chains: {speed:.4g} rad/s is missing in the sweep: {why}",
                speed=(speed, "rad/s"),
            )
        residual = max(n.energy_residual for n in result.sweep)
        if not residual < RESIDUAL:
            study.remark(
                "warning",
                "energy of chains",
                f"chains: the energy residual reaches {number(residual, '1')} of the energy moved; lessen "
                "chain.fold_stiffness.",
                energy_residual=(residual, "1"),
            )
    if any(name.endswith("_coasting") for name in study.runs):
        study.remark(
            "note", "coasting bars", "Behind the open coupling the machine is followed with two bars."
        )


def _on_shaft(study: Study) -> None:
    """What the reader has to know of the driveline."""
    line, modes = study.drive.line, study.statics.torsion
    assert modes is not None
    if study.sizing is not None:
        study.remark(
            "note",
            "sized without line",
            "Sizing took the shafts for rigid and the driveline for massless; the runs have it.",
        )
    if line.d2 == 0.0 and line.d3 == 0.0:
        study.remark(
            "note",
            "undamped line",
            "The driveline has no damping: a vibration that was set off goes on; give d2 and d3.",
        )
    fastest = max((loop.crossover for loop in study.statics.loops.values()), default=0.0)
    if fastest > modes.k_least / 3.0:
        study.remark(
            "warning",
            "control near line",
            f"The speed loop crosses over at {fastest:.3g} rad/s, near the line's natural frequency of "
            f"{modes.k_least:.3g} rad/s: control and shaft disturb each other; lower the gains or stiffen the line.",
            crossover=(fastest, "rad/s"),
            k_least=(modes.k_least, "rad/s"),
        )
    _on_joints(study)
    for name, shaft in study.shaft.items():
        if shaft.amplification is not None and shaft.amplification > AMPLIFIED:
            study.remark(
                "warning",
                "amplification",
                f"{study.called(name)}: the line's torque peaks at {shaft.amplification:.2f} times that of a rigid "
                "drive.",
                name,
                amplification=(shaft.amplification, "1"),
            )


def _on_joints(study: Study) -> None:
    """The unevenness of the joints, and where it meets a natural frequency."""
    line, modes = study.drive.line, study.statics.torsion
    assert modes is not None
    speed = study.config.run.crank_speed * study.drive.driven.p.ratio
    _, i, _ = two_joints(numpy_(), line, np.linspace(0.0, np.pi, 361))
    unevenness = float(np.ptp(i))
    if unevenness <= 1e-6:
        return
    study.remark(
        "note",
        "uneven joints",
        f"The joints turn unevenly: i23 varies by {100 * unevenness:.2g} % twice a turn of the shaft.",
        unevenness=(unevenness, "1"),
    )
    for order in ORDERS:
        if (1.0 - NEAR) * modes.k_least < order * speed < (1.0 + NEAR) * modes.k_largest:
            study.remark(
                "warning",
                "order near line",
                f"The shaft turns at {speed:.3g} rad/s: order {order} of the joints, {order * speed:.3g} rad/s, "
                f"lies near the line's natural frequency, {modes.k_least:.3g} to {modes.k_largest:.3g} rad/s.",
                speed=(speed, "rad/s"),
                excited=(order * speed, "rad/s"),
            )
