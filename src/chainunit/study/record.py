"""The record of a study: its drive, its runs, and the numbers read from them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

import xarray as xr

from ..drives.speed_control import Tuning
from ..errors import RunError
from ..fmu.backends import Origin
from ..text import entry, number
from . import verdict
from .chain import ChainResult
from .config import Config
from .drive import Drive
from .limits import reaches
from .measures import Answers, not_known
from .monte_carlo import MonteCarloResult
from .parts import LENGTHS
from .protection import Setting
from .shaft import Cycles, ShaftAnswers
from .sizing import SizingResult
from .statics import DriveStatics
from .verdict import STEADY, Verdict
from .window import Phase, Trip, Window, whole_turns

LOAD_CYCLE = "load_cycle.csv"
"""File with the steady turns as the motor's shaft sees them."""


INSUFFICIENT = "No motor of the catalogue fits; all is run with the nearest, which is insufficient."
"""What is said of a study whose sizing found no motor."""

Amount: TypeAlias = (
    tuple[float | None, str] | tuple[float | None, str, str] | tuple[float | None, str, str, int]
)
"""A number, its unit, and perhaps how people show it, and with how many digits."""


Origins: TypeAlias = Literal["file", "example", "declared", "tuned", "catalogue", "sizing"]
"""Where a value comes from."""


@dataclass(frozen=True)
class Remark:
    """Something that the reader has to know beside the numbers: a `warning` of a fault, or of a demand that
    is not met, or a `note` on an assumption behind the numbers. `kind` names its subject, `runs` the runs of it."""

    severity: Literal["warning", "note"]
    kind: str
    text: str
    """the remark in words"""
    runs: tuple[str, ...] = ()
    quantities: Mapping[str, Amount] = field(default_factory=dict)
    """numbers of the text; what differs from run to run is named ``run.quantity``"""

    @classmethod
    def of(
        cls, severity: Literal["warning", "note"], kind: str, text: str, /, *runs: str, **parts: Amount | str
    ) -> Remark:
        """A remark; in its `text` the names of the `parts`, amounts and words, stand in braces."""
        amounts = {name: part for name, part in parts.items() if not isinstance(part, str)}
        words = {name: part if isinstance(part, str) else number(*part) for name, part in parts.items()}
        return cls(severity, kind, text.format_map(words), runs, amounts)

    def __str__(self) -> str:
        return self.text[:1].upper() + self.text[1:]

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON."""
        return {
            "kind": self.kind,
            "text": str(self),
            "runs": list(self.runs),
            "quantities": {name: entry(*amount[:3]) for name, amount in self.quantities.items()},
        }


@dataclass
class Spread:
    """What is assumed in an event, and the peaks over the range of the assumption: from and to, by quantity."""

    assumed: dict[str, tuple[float, float]]
    """in the declared units of the event"""
    peaks: dict[str, tuple[float, float]]
    """crank_torque, motor_torque, rocker_torque [N m]"""


@dataclass
class StudyRecord:
    """The record of a study, which `run_study` fills; everything is by the names of the runs: ``start_up``,
    ``steady`` (its last turns), one for each event. `failure` says why the study stopped early, if it did."""

    config: Config
    drive: Drive
    statics: DriveStatics
    tuning: Tuning | None = None
    sizing: SizingResult | None = None
    fmus: dict[str, Origin] = field(default_factory=dict)
    """how each FMU was made"""
    runs: dict[str, xr.Dataset] = field(default_factory=dict)
    steady_from: float | None = None
    """when running became steady [s], where that was later than `config.settled`"""
    fed_from: float | None = None
    """when the feed came to a machine that starts empty [s]"""
    event: dict[str, float] = field(default_factory=dict)
    """when each event that was run began [s]"""
    answers: dict[str, Answers] = field(default_factory=dict)
    start: Answers | None = None
    """what the start-up asks, once the machine ran steadily"""
    settling: Answers | None = None
    """what the coming of the feed asks of a machine that starts empty, until it runs steadily"""
    pins: dict[str, dict[str, dict[str, float]]] = field(default_factory=dict)
    """By run and pin: peak, RMS and equivalent (ISO 281) load."""
    certificate: dict[str, dict[str, float]] = field(default_factory=dict)
    shaft: dict[str, ShaftAnswers] = field(default_factory=dict)
    """what each run asks of the driveline, where there is one"""
    cycles_of: dict[str, Cycles] = field(default_factory=dict)
    """rainflow cycles of the torque in shaft 2"""
    spreads: dict[str, Spread] = field(default_factory=dict)
    """of the events that rest on an assumption"""
    start_torques: dict[str, float] = field(default_factory=dict)
    """peak on the coupling in each part of starting that is judged apart, at the crank [N m]: in the start-up, in the
    settling under the feed, and in each start under load"""
    setting: Setting | None = None
    """the safety coupling that a sized drive should have, where none is given: one that is given cuts off the peaks
    which would set it"""
    ripple_without: float | None = None
    """fluctuation of the speed in steady running without the feed-forward that the study has"""
    findings: dict[str, Any] = field(default_factory=dict)
    """`Findings` of each analysis, by its name"""
    chain: ChainResult | None = None
    """the organs as chains at constant speed, where the study has them"""
    monte_carlo: MonteCarloResult | None = None
    verdict: Verdict | None = None
    """whether the model of the organs holds, once there are runs"""
    remarks: list[Remark] = field(default_factory=list)
    failure: RunError | None = None

    @property
    def warnings(self) -> list[Remark]:
        """Remarks on faults, and on demands that are not met."""
        return [remark for remark in self.remarks if remark.severity == "warning"]

    @property
    def notes(self) -> list[Remark]:
        """Remarks on the assumptions behind the numbers."""
        return [remark for remark in self.remarks if remark.severity == "note"]

    def warn(self, kind: str, text: str, /, *runs: str, **parts: Amount | str) -> None:
        """Add a warning, see `Remark.of`."""
        self.remarks.append(Remark.of("warning", kind, text, *runs, **parts))

    def note(self, kind: str, text: str, /, *runs: str, **parts: Amount | str) -> None:
        """Add a note, see `Remark.of`."""
        self.remarks.append(Remark.of("note", kind, text, *runs, **parts))

    @property
    def titles(self) -> dict[str, str]:
        """Runs by name, as sentences call them."""
        named = {STEADY: "steady running", verdict.START: "start-up"}
        named |= {verdict.SETTLING: "settling under the feed", "constant": "chains at constant speed"}
        return named | {name: event.title for name, event in self.config.events.items()}

    def called(self, run: str) -> str:
        """How sentences call a run."""
        return self.titles.get(run, run.replace("_", " "))

    def origin(self, name: str) -> Origins:
        """Where the value of a quantity comes from, by its name in a study file ("motor.rotor.J"): the file, the
        example, tuning, the catalogue with the motor that the file names or that sizing chose, or its declaration."""
        section, _, parameter = name.partition(".")
        if section == "motor" and self.tuning is not None and parameter in self.tuning.parameters:
            return "file" if name in self.config.given else "tuned"
        if section == "machine" and parameter in LENGTHS and self.config.gives("ratios"):
            return "file"
        if section == "machine" and parameter in LENGTHS and "ratios.rho" in self.config.of_example:
            return "example"
        if self.config.of_catalogue and (name == "machine.ratio" or section == "motor"):
            told = self._told(parameter)
            if not told:
                return "catalogue" if self.sizing is None else "sizing"
            name = told
        return self._of(name)

    def _of(self, name: str) -> Origins:
        """Of a value that only the study file and the example tell."""
        if name in self.config.given:
            return "file"
        return "example" if name in self.config.of_example else "declared"

    def _told(self, parameter: str) -> str:
        """The name in a study file of a parameter that the motor of the catalogue does not set, else ""."""
        config = self.config
        if parameter == "ratio":
            return "gear.ratio" if self._of("gear.ratio") != "declared" else ""
        group = parameter.partition(".")[0]
        if parameter == "inverter.on":
            return "start"
        if parameter == "inverter.slip" and config.start == "inverter" and not config.starter.inverter.slip:
            return ""
        if group in ("soft_start", "inverter"):
            return f"starter.{parameter}"
        if parameter in ("phi_start", "w_start") or group == "solver":
            return f"motor.{parameter}"
        return "sizing.ambient" if parameter == "ambient.T" else ""

    @property
    def kind(self) -> str:
        """What is studied, as the heading of a report."""
        return f"{self.noun.capitalize()}: forces, torque and overload"

    @property
    def noun(self) -> str:
        """What people call the machine."""
        return self.drive.machine.model.noun

    @property
    def turning(self) -> str:
        """What people call the link of the machine that the motor turns: "crank", but of a machine that has none."""
        return "crank" if self.drive.outsider else self.drive.machine.model.turning

    @property
    def reaches(self) -> bool:
        """Whether the crank turns at the speed that is asked for, as far as is known."""
        steady = self.answers.get(STEADY)
        return steady is None or reaches(steady.speed_mean, self.config.run.crank_speed)

    @property
    def returns(self) -> bool:
        """Whether there is a band of steady running that the speed could return to: a motor that follows the speed
        asked for has to reach it."""
        return STEADY in self.answers and (not self.drive.follows or self.reaches)

    @property
    def overloads(self) -> list[str]:
        """The events that were run and read."""
        return [name for name in self.answers if name in self.config.events]

    @property
    def settled(self) -> float:
        """Time from which running counts as steady [s]."""
        return self.config.settled if self.steady_from is None else self.steady_from

    @property
    def insufficient(self) -> bool:
        """Whether sizing found no motor that fits, so that all is run with the nearest."""
        return self.sizing is not None and self.sizing.chosen is None

    @property
    def start_apart(self) -> bool:
        """Whether the start is judged apart: switched on to the line, a motor gives more for a moment than it ever
        does in running. A coupling that is given is held shut where the file says so; one that is recommended has to
        be."""
        config = self.config
        if config.coupling is not None:
            return config.held_in_start
        return config.sizing is not None and config.start == "direct"

    @property
    def start_torque(self) -> float | None:
        """Largest of `start_torques` [N m]; None where no start is judged apart."""
        return max(self.start_torques.values(), default=None)

    @property
    def not_known(self) -> frozenset[str]:
        """Names of the measures that the motor, an FMU of somebody else, does not tell in steady running."""
        if self.drive.foreign is None:
            return frozenset()
        return frozenset(name for name, part in self.absent.items() if part == "motor")

    @property
    def absent(self) -> Mapping[str, str]:
        """The measures that motor or machine do not tell in steady running, each with the part that does not."""
        if verdict.STEADY not in self.answers:
            return {}
        return not_known(self.window(Phase.STEADY, self.steady))

    @property
    def steady(self) -> xr.Dataset:
        """The steady turns that are evaluated, both ends included; where the crank does not make them, all that was
        run since it should be steady."""
        run = self.runs["start_up"].sel(time=slice(self.settled, None))
        return whole_turns(self.drive, run, self.config.run.turns)

    def window(self, phase: Phase, run: xr.Dataset, begin: float = 0.0, trip: Trip | None = None) -> Window:
        """The rows of a run to read measures from."""
        sides = self.drive.machine.loaded_sides(self.config.feed)
        asked = self.config.run.crank_speed
        steady = None
        if phase in (Phase.START_UP, Phase.EVENT, Phase.LOADED_START):
            steady = Window(Phase.STEADY, self.steady, self.drive, sides, asked)
        return Window(phase, run, self.drive, sides, asked, begin, steady, trip)

    @property
    def motor(self) -> Any:
        """Parameters of the motor."""
        return self.drive.parameters
