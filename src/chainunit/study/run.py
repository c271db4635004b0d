"""The main job: start-up, steady running and overloads of a machine with its motor.

The FMUs are exported and co-simulated, and the answers are read from their runs. Every overload branches from
the same steady state, which is saved once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from ..core.errors import InputError, InterruptedRunError, RunError
from ..fmu.backends import Backend
from ..reading.text import number, shown_in
from ..system import Simulation
from ..work.progress import Progress, TaskProgress, quiet
from . import verdict
from .analyses import all_analyses
from .analysis import Work
from .arrays import Dataset
from .bearings import pin_loads
from .choice import choose_for, with_parts_beside
from .config import Config
from .cycle import turns_by_load
from .drive_fmus import export_coasting, export_drive
from .event import Event
from .event_table import random_runs
from .measures import read_answers, read_measure
from .organ_limits import least_pulls
from .readings import crank_angle
from .record import Spread, StudyFindings, StudyRecord, StudyRuns, StudySetup
from .relay import class_holding, locked_rotor, protecting_class, start_seconds
from .remarks import EVENT_LEFT_OUT, STATE_NOT_SAVED, WITHOUT_COMPILER, conclude
from .rig import Rig
from .start_up import start_up
from .starts import StartAnalysis, StartFindings
from .statics import statics
from .torques import on_coupling, quasi_static_peak
from .transients import Transient, coast, compare, follow, lead_times, release
from .window import Phase, Trip

_AFTER_TRIP = 1.0
"""Time for which a start in which the coupling opens is followed without it [s]: the first swings are the largest."""
_PEAKS = ("crank_torque", "motor_torque", "rocker_torque")
"""The peaks that are given over the range of an assumption."""


def run_study(
    config: Config,
    folder: Path,
    progress: TaskProgress = quiet,
    *,
    check: bool = False,
    backend: Backend | None = None,
    scheduler: str | None = None,
) -> StudyRecord:
    """Run the study; FMUs are written to ``folder/fmu``, by `backend` (see `chainunit.fmu.backends`).

    With `check`, every run is also compared with the monolithic solution. The workers of a `scheduler` of Dask, by
    its address, make the random overloads; without it local processes do.
    A run that fails ends the study early: the record has the earlier results, and `failure` is the error.

    Raises
    ------
    InputError
        for a communication step that is too long for the driveline, a catalogue from which no motor can be chosen,
        random overloads for which the drive has no inputs, and a foreign motor that does not fit or cannot
        save its state.
    """
    with shown_in(config.units):
        turns = turns_by_load(config.machine, config.run.crank_speed, config.feed)
        turn = next(iter(turns.values()))
        choice = choose_for(turn, config, folder / "fmu", progress, backend)
        config = replace(config, drive=choice.tables)
        drive = with_parts_beside(choice.drive, config.plans, config.feed, turn)
        if check and drive.foreign_titles:
            titles = " and ".join(drive.foreign_titles)
            raise InputError(f"check: the equations of {titles} are not known; leave it out")
        setup = StudySetup(config, drive, statics(drive, turns, config.run.step), choice.proposal)
        runs = StudyRuns(drive, config.operation, config.events)
        study = StudyRecord(setup, runs, StudyFindings(drive.driver_noun))
        if choice.proposal is not None:
            study.findings.by_analysis[choice.proposal.name] = choice.proposal.findings
        unmade = Rig(config.operation, drive, {})
        for plan in random_runs(config.plans):
            plan.check(unmade)
        _analyse(study, Work(unmade, progress), needs_runs=False)
        files, runs.fmus = export_drive(drive, folder / "fmu", backend, lambda what: progress(what, 0.0, 1.0))
        rig = Rig(config.operation, drive, files)
        if backend is None and "python" in {origin.backend for origin in runs.fmus.values()}:
            study.findings.say(WITHOUT_COMPILER)
        runner = Runner(study, rig, progress)
        with _ending(study):
            runner.run(check, lambda: export_coasting(drive, folder / "fmu", backend))
            work = Work(runner.rig, progress, folder, scheduler, runner.stop)
            _analyse(study, work, needs_runs=True)
        if not isinstance(study.findings.failure, InterruptedRunError):
            with _ending(study):
                _analyse(study, Work(runner.rig, progress), needs_runs=True, at_end=True)
        conclude(study)
        return study


@contextmanager
def _ending(study: StudyRecord) -> Iterator[None]:
    """Record the error that ends a part of the study early; the first one counts."""
    error: RunError | None = None
    try:
        yield
    except RunError as ended:
        error = ended
        if error.partial is not None:
            study.runs.series["unfinished"] = error.partial
    except KeyboardInterrupt:
        # Ctrl-C came between two runs, or in a run that is not a co-simulation
        error = InterruptedRunError("interrupted")
    study.findings.failure = study.findings.failure or error


def _analyse(study: StudyRecord, work: Work, *, needs_runs: bool, at_end: bool = False) -> None:
    """Make every analysis for which the system has the parts."""
    for analysis in all_analyses():
        is_due = (analysis.needs_runs, analysis.at_end) == (needs_runs, at_end)
        if is_due and analysis.applies(study.setup.drive, study.setup.config.plans):
            findings = analysis.find(study, work)
            if findings is not None:
                study.findings.by_analysis[analysis.name] = findings
            if analysis.name == StartAnalysis.name:
                # before an analysis reads the answers that depend on it
                _with_class_of_all_starts(study)


def _with_class_of_all_starts(study: StudyRecord) -> None:
    """Where the starts from all crank angles, or a stall, take a relay of another class, read its trips in the events
    once more."""
    setup, runs = study.setup, study.runs
    findings, plate = StartFindings.found_in(study.findings), setup.plate
    if findings is None or plate is None or setup.drive.follows:
        return
    least, before = max(findings.start_class, runs.relay_class), runs.answers[verdict.STEADY].current_rms
    trip_class = protecting_class(least, findings.relay_seconds, *locked_rotor(plate.nameplate, before))
    if trip_class == runs.relay_class:
        return
    runs.relay_class = trip_class
    for name in runs.overloads:
        if runs.answers[name].coupling_trip_time is None:
            event = setup.config.events[name]
            phase = Phase.LOADED_START if event.from_rest else Phase.EVENT
            window = runs.window(phase, runs.event_parts[name], runs.event_times[name], event=event)
            later = read_measure("thermal_trip_time", window)
            runs.answers[name] = replace(runs.answers[name], thermal_trip_time=later)


class Runner:
    """Makes the runs of a study on its rig, and writes the results into the record."""

    def __init__(self, study: StudyRecord, rig: Rig, progress: TaskProgress) -> None:
        self.study, self.runs, self.rig, self.progress = study, study.runs, rig, progress
        operation = rig.operation
        self.stop = operation.stop
        """time to which the start-up is run [s]; later where the motor takes longer to settle"""
        events = [event for event in study.runs.events.values() if rig.takes(event)]
        self.events = [event for event in events if not event.from_rest]
        self.starts = [event for event in events if event.from_rest]
        self.total = self.stop * (1 + len(self.starts))
        self.total += sum(operation.turn + event.time_followed(operation.turn) for event in self.events)
        self._coasting: Path | None = None

    def run(self, check: bool, coasting: Callable[[], Path | None]) -> None:
        """Make every run of the study. With `check` each is compared with the monolithic solution; `coasting`
        writes the FMU of the machine behind an open coupling."""
        self._export_coasting = coasting
        for event in self.runs.events.values():
            if event not in (*self.events, *self.starts):
                self.study.findings.say(EVENT_LEFT_OUT, event.name, title=event.title, reason=event.without)
        with self.rig.from_rest() as simulation:
            self._start_up(simulation)
            for part in simulation.without_states if self.events else ():
                title = self.rig.graph.components[part].title
                self.study.findings.say(STATE_NOT_SAVED, *(event.name for event in self.events), title=title)
            begin, speed = simulation.save(), self.runs.answers["steady"].speed_mean
            angle = float(crank_angle(self.rig.drive, self.runs.series["start_up"])[-1])
            progress, transients = 0.0, []
            leads = lead_times(self.rig, simulation, self.events, angle, speed)
            for event, lead in zip(self.events, leads, strict=True):
                transients.append(self._event(simulation, event, begin + lead, progress))
                progress += lead + event.time_followed(self.rig.operation.turn)
            for transient in transients:
                self._assumption(simulation, transient, progress)
        if check:
            states = self._compare("the start-up", "start_up", None)
            for transient in transients:
                self._compare(transient.event.title, transient.event.name, transient, states)
        for k, event in enumerate(self.starts):
            self._loaded_start(event, self.total - (len(self.starts) - k) * self.stop, check)

    def _progress(self, what: str, before: float) -> Progress:
        """The progress of a run from the time `before` of all runs on [s]."""

        def progress(time: float) -> None:
            self.progress(what, min(before + time, self.total), self.total)

        return progress

    def _start_up(self, simulation: Simulation) -> None:
        """Make the start-up and steady running, and read their answers.

        Raises
        ------
        RunError
            where the torque limiter opens in one of them.
        """
        runs, rig, coupling = self.runs, self.rig, self.runs.operation.coupling
        progress = self._progress("start-up and steady running", 0.0)
        runs.started = start_up(rig, simulation, progress, rig.guards)
        run, self.stop = runs.started.run, runs.started.stop
        self.rig = rig = runs.started.rig
        self._certify("start_up", run)
        if simulation.time < self.stop - 0.5 * rig.step:
            raise RunError(self._opens_in_start(simulation.time))
        steady = runs.steady
        runs.answers["steady"] = read_answers(runs.window(Phase.STEADY, steady))
        self._pins_and_pulls("steady", steady)
        # the start of an empty machine ends where the feed comes
        begin = steady["time"].values[0]
        end = begin if rig.fed_from is None else rig.fed_from
        start = run.sel(time=slice(None, end))
        # if the feed comes before the machine is at speed, the start goes on under the feed
        whole = runs.window(Phase.START_UP, run.sel(time=slice(None, begin)))
        start_time = read_measure("start_time", whole)
        runs.start = replace(read_answers(runs.window(Phase.START_UP, start)), start_time=start_time)
        self._relay(run)
        self._pins_and_pulls(verdict.START, start)
        if rig.fed_from is not None:
            settling = run.sel(time=slice(end, begin))
            runs.settling = read_answers(runs.window(Phase.SETTLING, settling))
            self._pins_and_pulls(verdict.SETTLING, settling)
        torque = on_coupling(rig.drive, steady)
        if coupling and torque > coupling.trip_torque:
            raise RunError(
                f"the torque limiter opens in steady running, which puts {number(torque, 'N.m', digits=4)} on it; "
                "coupling.trip_torque must be above that"
            )

    def _relay(self, run: Dataset) -> None:
        """Record the trip class of the relay that the start-up needs; that of a proposed drive holds from
        every crank angle."""
        runs, proposal, drive = self.runs, self.study.setup.proposal, self.rig.drive
        time, rated = runs.start_end, drive.rated_current
        if time is None or rated is None or drive.follows:
            return
        rise = run.sel(time=slice(None, time))
        current = drive.star.winding_current(rise["time"].values, rise[f"motor.{drive.motor.current}"].values)
        runs.relay_class = class_holding(start_seconds(rise["time"].values, current, rated))
        if proposal is not None:
            runs.relay_class = max(runs.relay_class, proposal.start_class)

    def _event(self, simulation: Simulation, event: Event, begin: float, before: float) -> Transient:
        """Follow an event of steady running to its end, or until a guard ends it."""
        stop = begin + event.time_followed(self.rig.operation.turn)
        progress = self._progress(event.title, before)
        transient = follow(self.rig, simulation, event, begin, stop, progress, self.rig.guards)
        self._close(simulation, transient, stop, Phase.EVENT)
        return transient

    def _loaded_start(self, event: Event, before: float, check: bool) -> None:
        """Run a start under load; with `check` compare it with the monolithic solution."""
        progress = self._progress(event.title, before)
        with self.rig.from_rest(event) as simulation:
            run = simulation.run(self.stop, self.rig.step, progress, guards=self.rig.guards)
            transient = Transient(event, 0.0, run, self.rig.event_signals(event, 0.0, {}), {})
            self._close(simulation, transient, self.stop, Phase.LOADED_START)
        if check:
            self._compare(event.title, event.name, transient)

    def _close(self, simulation: Simulation, transient: Transient, stop: float, phase: Phase) -> None:
        """Read the answers of a transient. Where the coupling opened, follow it until it passes no torque,
        and the machine behind it until it comes to rest."""
        runs, rig, coupling = self.runs, self.rig, self.runs.operation.coupling
        name, run, trip = transient.event.name, transient.run, None
        runs.event_times[name] = transient.begin
        if coupling and simulation.time < stop - 0.5 * rig.step:
            time = simulation.time
            run, energy = release(rig, simulation, run, coupling.release_time)
            self._coasting = self._coasting or self._export_coasting()
            coasting = coast(rig, transient, run, stop, self._coasting) if self._coasting else None
            if coasting is not None:
                runs.series[f"{name}_coasting"] = coasting
            trip = Trip(time, energy, coasting)
        self._certify(name, run, transient.lead)
        after = run.sel(time=slice(transient.begin, None))
        window = runs.window(phase, after, transient.begin, trip, transient.event)
        runs.answers[name] = read_answers(window)
        self._pins_and_pulls(name, after)

    def _opens_in_start(self, time: float) -> str:
        """The reason why a study ends whose coupling opens in the start-up, at `time` [s]."""
        coupling, share = self.runs.operation.coupling, ""
        assert coupling is not None
        with self.rig.from_rest() as simulation:
            run = simulation.run(time + _AFTER_TRIP, self.rig.step)
        start, trip = on_coupling(self.rig.drive, run), coupling.trip_torque
        lasting = quasi_static_peak(self.rig.drive, run, on_coupling)
        if lasting <= trip:
            share = (
                " for some milliseconds (the electromagnetic transient of the motor; load and acceleration put "
                f"{number(lasting, 'N.m')} on it)"
            )
        return (
            f"the torque limiter opens in the start-up, at t = {time:.3g} s: it is set to {number(trip, 'N.m')}, "
            f"and this start puts up to {number(start, 'N.m')} on it{share}; coupling.trip_torque must be above "
            'that, or the start softer (start = "soft" or "inverter"); without [coupling] a study with [sizing] '
            "compares the ways"
        )

    def _pins_and_pulls(self, name: str, run: Dataset) -> None:
        """Record the loads of the pins and the pulls in the rods."""
        drive = self.rig.drive
        if pulls := least_pulls(drive, run, drive.machine.loaded_sides(self.runs.operation.feed)):
            self.runs.pulls[name] = pulls
        if loads := pin_loads(self.rig.drive, run):
            self.runs.pins[name] = loads

    def _certify(self, name: str, run: Dataset, lead: Dataset | None = None) -> None:
        self.runs.certificate[name] = self.rig.residuals(run, lead)
        self.runs.series[name] = run

    def _assumption(self, simulation: Simulation, transient: Transient, before: float) -> None:
        """Record the peaks over the range of the assumption of an event, run from the saved steady state. The
        runs are without a torque limiter, which would cut the peaks off."""
        event, begin = transient.event, transient.begin
        variants = event.variants()
        if not variants:
            return
        self.progress(f"{event.title}, over the range of its assumption", before, self.total)
        answers = self.runs.answers[event.name]
        peaks = {name: [] if self.rig.guards else [getattr(answers, f"{name}_peak")] for name in _PEAKS}
        for variant in (*variants, event) if self.rig.guards else variants:
            stop = begin + event.time_followed(self.rig.operation.turn)
            run = follow(self.rig, simulation, variant, begin, stop).run.sel(time=slice(begin, None))
            window = self.runs.window(Phase.EVENT, run, begin)
            for name in _PEAKS:
                peaks[name].append(read_measure(f"{name}_peak", window))
        ranges = {
            name: [getattr(variant.p, name) for variant in variants]
            for name in vars(event.p)
            if any(getattr(variant.p, name) != getattr(event.p, name) for variant in variants)
        }
        self.runs.spreads[event.name] = Spread(
            {name: (min(x), max(x)) for name, x in ranges.items()},
            # the torque of a foreign motor is not known
            {name: (min(x), max(x)) for name, x in peaks.items() if None not in x},
        )

    def _compare(
        self, title: str, name: str, transient: Transient | None, states: dict[str, float] | None = None
    ) -> dict[str, float]:
        """Compare a run with the monolithic solution; the states at its end."""
        self.progress(f"monolithic reference: {title}", self.total, self.total)
        differences, end = compare(self.rig, self.runs.series[name], transient, states)
        self.runs.certificate[name] |= differences
        return end
