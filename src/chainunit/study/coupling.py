"""The torque limiter of a drive: whether it protects the drive, the torques by which it is set, and the force at a
ram for which its setting stands.

At constant speed the power of the crank is that of the ram: T w = F v. So a torque T at the crank stands for the
force F = T/|ds/dphi| along the guide, with the way s of the ram and the crank angle phi. Towards a dead centre
ds/dphi goes to zero, and the force has no limit. Weights, inertia and friction are left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np

from ..machines.linkages.structure import Structure
from ..mechanism.assur import GROUND, PRISMATIC, REVOLUTE
from ..mechanism.sampled_quantities import ROUNDING, roots
from ..reading.text import number
from .event import Role
from .readings import pull_out_torque
from .record import StudyRecord, StudyRuns
from .remark import note, warning
from .starts import StartFindings, transient_words
from .torques import on_coupling, peaks_in_events, quasi_static_peak
from .turn import TurnAnalysis, TurnFindings
from .verdict import START
from .window import Phase

TIMES = 2.0
"""Multiple of the working force from which on the ram counts as overloaded."""


@dataclass(frozen=True)
class RamForce:
    """A ram over a turn of the crank: `angle` [rad] and `rate` = ds/dphi [m], each of shape (n,); the largest
    `working` force of normal running along the guide [N]; and the angle `dead` of the dead centre before which it
    works [rad], between the angles of the turn."""

    ram: str
    angle: Any
    rate: Any
    working: float
    dead: float

    def lever(self, before: Any) -> Any:
        """|ds/dphi| at so much crank angle [rad] before the dead centre [m]."""
        return np.abs(np.interp(self.dead - before, self.angle, self.rate, period=2.0 * math.pi))

    def least(self, torque: float) -> float:
        """The force where the ram is fastest [N], for a torque of the crank [N m]."""
        return float(torque / np.max(np.abs(self.rate)))

    def before(self, torque: float, angle: float) -> float:
        """The force at so much crank angle [rad] before the dead centre [N]; without limit at the dead centre."""
        lever = float(self.lever(angle))
        return torque / lever if lever > ROUNDING * float(np.max(np.abs(self.rate))) else math.inf

    def overloaded(self, torque: float) -> tuple[float, float] | None:
        """Crank angle [rad] and way [m] before the dead centre within which `torque` [N m] stands for more than
        `TIMES` the working force; None where it does at every angle."""
        n, limit = len(self.angle), torque / (TIMES * self.working)
        angles_before = np.arange(n) * (2.0 * math.pi / n)
        lever = self.lever(angles_before)
        k = int(np.argmax(lever >= limit))
        if lever[k] < limit:
            return None
        # at the dead centre itself, where k is 0 for a limit of 0, the lever is nothing
        share = (limit - lever[k - 1]) / (lever[k] - lever[k - 1]) if k else 0.0
        angle = float(angles_before[max(k - 1, 0)] + share * angles_before[1])
        angles = np.append(angles_before[:k], angle)
        return angle, float(np.trapezoid(self.lever(angles), angles))


def rams(study: StudyRecord) -> Iterator[RamForce]:
    """The rams of a linkage with the forces of its turn in normal running: links that slide on the ground and that a
    pin moves, not a driver. A ram works before the dead centre to which it goes with the larger force; one without
    a force or a dead centre is left out."""
    description = getattr(study.setup.drive.machine.model, "described_by", None)
    if description is None or TurnAnalysis.name not in study.findings.by_analysis:
        return
    turn = TurnFindings.of_study(study.findings).loaded
    angle = turn.angle
    for ram, *joint_names in _pinned_rams(description.structure):
        variables = [description.variable("joint", name) for name in joint_names]
        guide, pin = (attrgetter(variable)(turn.outputs) for variable in variables)
        rate = np.broadcast_to(guide.v, angle.shape) / study.setup.config.run.crank_speed
        force = np.broadcast_to(_along(guide, pin), angle.shape)
        dead_centres = _dead_centres(angle, rate)
        if dead_centres and np.max(force) > 0.0:
            worked = max(dead_centres, key=lambda q: _mean_before(angle, force, q))
            yield RamForce(ram, angle, rate, float(np.max(force)), worked)


def _pinned_rams(structure: Structure) -> Iterator[tuple[str, str, str]]:
    """The links that slide on the ground and that a pin moves, each with its guide and its pin; not drivers."""
    driven = {driver.joint for driver in structure.drivers}
    for guide, joint in structure.joints.items():
        links = {joint.on[0], joint.by[0]}
        if joint.kind != PRISMATIC or GROUND not in links or guide in driven:
            continue
        (ram,) = links - {GROUND}
        pins = (
            name
            for name, pin in structure.joints.items()
            if pin.kind == REVOLUTE and ram in (pin.on[0], pin.by[0])
        )
        if pin_name := next(pins, ""):
            yield ram, guide, pin_name


def _along(guide: Any, force: Any) -> Any:
    """Size of the part of a pin's force along a fixed guide [N]. The reaction of the guide is across it, which gives
    its direction; without such a reaction the whole force is along it."""
    normal = np.atleast_1d(guide.normal)
    k = int(np.argmax(np.abs(normal)))
    across = [float(np.atleast_1d(x)[k if np.size(x) > 1 else 0]) for x in (guide.fx, guide.fy)]
    size = math.hypot(*across)
    if size == 0.0:
        return np.hypot(force.fx, force.fy)
    return np.abs(force.fx * across[1] - force.fy * across[0]) / size


def _dead_centres(angle: Any, rate: Any) -> list[float]:
    """The crank angles at which the ram turns back [rad]."""

    def rate_at(q: Any) -> Any:
        return np.interp(q, angle, rate, period=2.0 * math.pi)[None]

    (angles,) = roots(rate_at, np.append(angle, angle[0] + 2.0 * math.pi), around=True)
    return [round(float(q), 9) % (2.0 * math.pi) for q in angles]


def _mean_before(angle: Any, force: Any, place: float) -> float:
    """Mean of a force [N] over the thirty degrees before a place [rad]."""
    places = place - np.radians(np.arange(0.5, 30.0))
    return float(np.mean(np.interp(places, angle, force, period=2.0 * math.pi)))


@dataclass(frozen=True)
class StartPeak:
    """The largest torque of a start on the coupling by load and acceleration, at the crank [N m], and with the
    electromagnetic `transient`: in the run of that name, or in a start from a crank angle [rad] without a run of its
    own."""

    torque: float
    transient: float
    run: str = START
    angle: float | None = None

    def title(self, runs: StudyRuns) -> str:
        """The start in words."""
        return runs.title_of(self.run) if self.angle is None else f"start from {number(self.angle, 'rad')}"

    def named(self, runs: StudyRuns) -> str:
        """The start in words, with its article."""
        return f"{'the' if self.run == START and self.angle is None else 'a'} {self.title(runs)}"


def start_peaks(study: StudyRecord) -> list[StartPeak]:
    """The largest torques on the coupling in the parts of the start: the start-up with the settling under a feed that
    comes later, starts from other crank angles, starts under load."""
    drive, events = study.setup.drive, study.setup.config.events
    starts = {name: run for name, run in study.runs.event_parts.items() if events[name].from_rest}
    parts = [
        StartPeak(quasi_static_peak(drive, run, on_coupling), on_coupling(drive, run), name)
        for name, run in {START: study.runs.rise, **starts}.items()
    ]
    if findings := StartFindings.found_in(study.findings):
        parts += [StartPeak(x.coupling_torque, x.coupling_transient, angle=x.angle) for x in findings.starts]
    return parts


def hardest_start(study: StudyRecord) -> StartPeak:
    """The part of the start with the largest torque on the coupling by load and acceleration."""
    return max(start_peaks(study), key=lambda start: start.torque)


def transient_of_starts(study: StudyRecord) -> StartPeak:
    """The part of the start with the largest torque on the coupling, with the electromagnetic transient."""
    return max(start_peaks(study), key=lambda start: start.transient)


TRIPS_IN_TRANSIENT = (
    "A friction clutch slips in it for this time. A ball detent or a shear pin that is set lower may open in it, "
    "unless the line between motor and coupling is soft"
)
"""The response of a coupling to the electromagnetic transient, in words."""


def pull_out(runs: StudyRuns) -> float:
    """Largest torque of the warm motor at the crank in steady running [N m]."""
    return pull_out_torque(runs.drive, runs.steady, runs.window(Phase.STEADY, runs.steady).warm)


LESS_TORQUE = 0.1
"""Part by which the pull-out torque of a motor may be less than that of its catalogue, by IEC 60034-1."""


def remark_on_coupling(study: StudyRecord, trip: float) -> None:
    """Warn where a given coupling, set to `trip` [N m], does not protect the drive as it should."""
    # the limit of a foreign motor is not known
    setup, runs, findings = study.setup, study.runs, study.findings
    most = None if setup.drive.foreign else pull_out(runs)
    peaks, shocks = peaks_in_events(runs), peaks_in_events(runs, Role.SHOCK)
    start, quick = hardest_start(study), transient_of_starts(study)
    if start.torque > trip:
        findings.say(_OPENS_IN_START, START, trip=trip, where=start.title(runs), start=start.torque)
    elif quick.transient > trip:
        findings.say(
            _OPENS_IN_TRANSIENT,
            START,
            trip=trip,
            where=quick.title(runs),
            start=start.torque,
            transient=transient_words(setup),
            most=quick.transient,
        )
    openings = [name for name in peaks if runs.answers[name].coupling_trip_time is not None]
    if nuisances := [name for name in openings if name not in shocks]:
        findings.say(_NUISANCE, *nuisances, trip=trip, where="; ".join(map(runs.title_of, nuisances)))
    if shocks and not set(openings) & set(shocks):
        findings.say(
            _NEVER_OPENS,
            *shocks,
            where="; ".join(map(runs.title_of, shocks)),
            trip=trip,
            largest=max(shocks.values()),
            steady=on_coupling(setup.drive, runs.steady),
            motor=most,
        )
    elif most is not None and trip > (least := (1.0 - LESS_TORQUE) * most if setup.plate else most):
        findings.say(_ABOVE_MOTOR, trip=trip, motor=most, least=least if setup.plate else None)


_OPENS_IN_START = warning(
    "coupling-opens-in-start",
    "The torque limiter opens at {trip}, and a start puts up to {start} on it ({where}). It opens in some of the "
    "starts.",
    remedy='Set it higher, or start softer (start = "soft" or "inverter").',
    sizes={"N.m": "trip start"},
)
_OPENS_IN_TRANSIENT = warning(
    "coupling-opens-in-transient",
    "The torque limiter is set to {trip}, and load and acceleration put {start} on it in a start at most. The "
    "{transient}, with {most} at most ({where}).",
    f"{TRIPS_IN_TRANSIENT}.",
    sizes={"N.m": "trip start most"},
)
_NUISANCE = warning(
    "nuisance-trip",
    "The torque limiter, set to {trip}, opens where no shock asks for it, a nuisance trip that protects nothing: "
    "{where}.",
    sizes={"N.m": "trip"},
)
_NEVER_OPENS = warning(
    "coupling-never-opens",
    "The torque limiter opens in no overload of this study ({where}). It is set to {trip}, they put {largest} on it "
    "at most, steady running {steady}. The motor gives {motor} at most.",
    sizes={"N.m": "trip largest steady motor"},
)
_ABOVE_MOTOR = warning(
    "coupling-above-motor",
    "The torque limiter is set to {trip} and the motor gives {motor} at most. By IEC 60034-1 it may give as little "
    "as {least}. A load that rises slowly may stall the motor and not open it.",
    sizes={"N.m": "trip motor least"},
)
_RAM = note(
    "coupling-at-ram",
    "A coupling {set_for}that opens at {trip} does not limit the force on {ram} near the dead centre, at "
    "{a driver} angle of {dead}. At the dead centre the force has no limit. In running the pin pushes with "
    "{working} at most. Within {angle}, the last {way}, it can push with more than {times} times that while the "
    "coupling stays shut. At every angle it can push with more than {times} times that while the coupling stays "
    "shut{always}.",
    remedy="A device at the link protects it there, such as an overload cushion or a shear plate of a press, or the "
    "relief valve of a pump.",
    sizes={
        "N.m": "trip",
        "rad": "angle",
        ("N", "", 3, "force on the link at the setting, where it is fastest"): "fastest",
        ("N", "", 3, "30 deg before the dead centre"): "thirty",
        ("N", "", 3, "10 deg before the dead centre"): "ten",
        "N": "working",
        ("m", "millimetres"): "way",
    },
)


def remark_on_rams(study: StudyRecord, torque: float, set_for: str = "") -> None:
    """Note for each ram of a linkage what a coupling of that setting, the `torque` [N m], means at it, once for rams
    that differ in their dead centres alone; `set_for` says for which torques it is set."""
    alike: dict[tuple[str, str], list[RamForce]] = {}
    for ram in rams(study):
        alike.setdefault((f"{ram.least(torque):.4g}", f"{ram.working:.4g}"), []).append(ram)
    for group in alike.values():
        ram, names = group[0], [ram.ram for ram in group]
        angle, way = ram.overloaded(torque) or (None, None)
        study.findings.say(
            _RAM,
            trip=torque,
            set_for=set_for,
            ram=f"the link{'s' if names[1:] else ''} {' and '.join(names)}",
            dead=" and ".join(number(ram.dead, "rad") for ram in group),
            fastest=ram.least(torque),
            thirty=ram.before(torque, math.radians(30.0)),
            ten=ram.before(torque, math.radians(10.0)),
            working=ram.working,
            times=f"{TIMES:g}",
            angle=angle,
            way=way,
            always="" if angle is None else None,
        )
