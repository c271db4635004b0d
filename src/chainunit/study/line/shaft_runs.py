"""The load of the driveline in each run of a study, beside the same run with a rigid shaft, and the remarks on it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from ...core.engines import numpy_
from ...core.errors import RunError
from ...drives.cardan import two_joints
from ...reading.results import part, result
from ...study.transients import follow
from ...system import rigid
from ..analysis import Analysis, Findings, Work, is_examined
from ..arrays import Dataset
from ..record import StudyFindings, StudyRecord, StudyRuns
from ..remark import note, warning
from .rigid_line import HOLDS_FROM, RigidLine
from .shaft import AMPLIFIED, UNEVEN, Cycles, ShaftAnswers, driveline_of, remedies, shaft_answers, with_rigid


@result
class ShaftFindings(Findings):
    """By run, the load of the driveline, and the rainflow cycles of the torque in shaft 2."""

    answers: Mapping[str, ShaftAnswers] = part("load of the driveline, by run", inline=True)
    cycles: Mapping[str, Cycles]

    def remark(self, study: StudyRecord) -> None:
        """None: the driveline has its remarks, see `remark`, before the remarks of the findings."""


def shaft_findings(findings: StudyFindings) -> ShaftFindings:
    """The load of the driveline; empty where the study has none, or failed before."""
    return ShaftFindings.found_in(findings) or ShaftFindings({}, {})


class ShaftAnalysis(Analysis):
    """Every run once more, without the elasticity and unevenness of the driveline."""

    name = "shaft"
    needs_runs = True
    applies = staticmethod(lambda drive, plans: drive.line.part("driveline") is not None)

    @staticmethod
    def find(study: StudyRecord, work: Work) -> ShaftFindings:
        """The load in each run; the torque in the rigid shaft is added to the runs."""
        work.progress("the same with a rigid shaft", 1.0, 1.0)
        try:
            twins = _rigid_runs(study.runs, work)
        except RunError as error:
            # the error has the values of the rigid drive, not of this one
            error.partial = None
            raise
        for name, twin in twins.items():
            study.runs.series[name] = with_rigid(study.setup.drive, study.runs.series[name], twin)
        return _findings(study, twins)


def _rigid_runs(runs: StudyRuns, work: Work) -> dict[str, Dataset]:
    """The runs of the rigid drive, at the same times and with the same coupling."""
    rig = replace(work.rig, twin=partial(rigid, line="driveline"))
    events = {name: runs.events[name] for name in runs.event_times}
    twins = {}
    with rig.from_rest() as simulation:
        twins["start_up"] = simulation.run(work.steady, rig.step)
        simulation.save()
        for name, event in events.items():
            if not event.from_rest:
                begin = runs.event_times[name]
                stop = begin + event.time_followed(runs.operation.turn)
                twins[name] = follow(rig, simulation, event, begin, stop, guards=rig.guards).run
    for name, event in events.items():
        if event.from_rest:
            with rig.from_rest(event) as simulation:
                twins[name] = simulation.run(work.steady, rig.step, guards=rig.guards)
    return twins


def _findings(study: StudyRecord, twins: Mapping[str, Dataset]) -> ShaftFindings:
    """The findings of the shaft in start-up, steady running and each event, beside the `twins`, the runs of the rigid
    drive at the same times."""
    setup, runs, steady = study.setup, study.runs, study.runs.steady
    until = slice(None, steady["time"].values[0])
    # the damage of steady running comes first, as that of the other runs is relative to it
    parts = [("steady", steady, twins["start_up"].sel(time=slice(runs.steady_begin, None)))]
    parts.append(("start_up", runs.series["start_up"].sel(time=until), twins["start_up"].sel(time=until)))
    for name, begin in runs.event_times.items():
        since = slice(begin, None)
        parts.append((name, runs.series[name].sel(time=since), twins[name].sel(time=since)))
    answers, cycles, per_turn = {}, {}, None
    for name, run, twin in parts:
        answers[name], cycles[name], damage = shaft_answers(
            setup.drive, run, twin, setup.config.values["driveline"].exponent, per_turn
        )
        per_turn = damage if per_turn is None else per_turn
    return ShaftFindings(answers, cycles)


def remark(study: StudyRecord) -> None:
    """Add to a study with a driveline the remarks on it."""
    setup, findings, modes = study.setup, study.findings, study.setup.statics.modes
    if modes is None:
        return
    line = driveline_of(setup.drive)
    if line.d2 == 0.0 and line.d3 == 0.0:
        findings.say(_UNDAMPED)
    fastest = max((loop.crossover for loop in setup.statics.loops.values()), default=0.0)
    if fastest > modes.antiresonance / 3.0:
        findings.say(
            _CONTROL,
            crossover=fastest,
            antiresonance=modes.antiresonance,
            k_least=modes.k_least,
            k_largest=modes.k_largest,
        )
    if setup.statics.rigid_line is not None:
        _on_rigid_line(study, setup.statics.rigid_line)
    _, i, _ = two_joints(numpy_(), line, np.linspace(0.0, np.pi, 361))
    unevenness = float(np.ptp(i))
    if unevenness > UNEVEN:
        findings.say(
            _UNEVEN if is_examined("driveline", findings.by_analysis) else _UNEVEN_ALONE,
            least=float(np.min(i)),
            largest=float(np.max(i)),
            unevenness=unevenness,
            way=", and ".join(remedies(line)),
        )
    for name, shaft in shaft_findings(findings).answers.items():
        if shaft.amplification is not None and shaft.amplification > AMPLIFIED:
            findings.say(_AMPLIFIED, name, title=study.runs.title_of(name), amplification=shaft.amplification)


_UNDAMPED = note(
    "undamped-line",
    "The driveline has no damping, so that a vibration, once excited, does not decay.",
    remedy="Give d2 and d3.",
)
_CONTROL = warning(
    "control-near-line",
    "The speed loop crosses over at {crossover}, near {antiresonance}, at which the machine swings on the shafts "
    "against a standing motor. Its margins are those of a rigid drive and do not hold here. A run shows the effect "
    "of lower gains on the peaks, as the control also damps the torsion.",
    remedy="A stiffer line or lower gains separate the two.",
    sizes={
        "rad/s": "crossover antiresonance",
        ("rad/s", "frequency", 3, "least natural frequency of the line over a turn"): "k_least",
        ("rad/s", "frequency", 3, "largest natural frequency of the line over a turn"): "k_largest",
    },
)
_JOINTS = (
    "The joints turn unevenly, as shaft 3 turns {least} to {largest} times as fast as shaft 2 (ratio i23).",
    "This varies by {unevenness} twice a turn.",
)
_RATIOS = {("1", "", 5): "least largest", ("1", "percent"): "unevenness"}
_UNEVEN = warning("uneven-joints", *_JOINTS, remedy="{way}.", sizes=_RATIOS)
_UNEVEN_ALONE = note("uneven-joints-of-a-slow-line", *_JOINTS, remedy="{way}.", sizes=_RATIOS)
_AMPLIFIED = warning(
    "amplification",
    "{title}: the line's torque peaks at {amplification} times that of a rigid drive.",
    sizes={"1": "amplification"},
)
_NOT_RIGID = warning(
    "no-rigid-line",
    "The lowest natural frequency of the line is only {ratio} times the frequency of the {driver}'s turns. Below "
    "{least} times (VDI 2149) a rigid model of the drive does not hold. The runs have the elastic line, and it is "
    "rigid in {taken}.",
    remedy="Stiffer shafts or a slower {driver} raise the ratio.",
    sizes={
        "1": "ratio",
        ("rad/s", "frequency", 3, "lowest natural frequency of the line"): "natural_frequency",
        ("rad/s", "frequency", 3, "frequency of the {driver}'s turns"): "driver_frequency",
    },
)


def _on_rigid_line(study: StudyRecord, rigid_line: RigidLine) -> None:
    """Warn of a line that swings too slowly for a rigid model of the drive."""
    if rigid_line.holds:
        return
    results = ["the turn at constant speed"]
    results += ["the speed loop"] if study.setup.statics.loops else []
    results += ["the choice of the drive"] if study.setup.proposal is not None else []
    study.findings.say(
        _NOT_RIGID,
        natural_frequency=rigid_line.natural_frequency,
        driver_frequency=rigid_line.driver_frequency,
        ratio=rigid_line.ratio,
        least=f"{HOLDS_FROM:g}",
        taken=" and ".join(filter(None, (", ".join(results[:-1]), results[-1]))),
    )
